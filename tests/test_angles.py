"""Reading and writing angles, and arithmetic modulo π."""

from __future__ import annotations

import math
from decimal import Decimal
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from gaitgraph.angles import (
    HALF_PI,
    angle_from_text,
    angle_within,
    angles_from,
    distance_to_multiple,
    text_from_angle,
    whole_number,
    wrapped,
)
from gaitgraph.errors import InputError

PI = math.pi
# Beyond a few thousand radians an angle modulo π has lost digits that no arithmetic brings back.
moderate = st.floats(-1e3, 1e3)

MEANT = {
    "0": 0.0, "-1.178": -1.178, "+.5": 0.5, "5.": 5.0, "1e-3": 1e-3, "1.5E2": 150.0,
    "0.3 rad": 0.3, "  0.3\n": 0.3, "pi": PI, "-pi": -PI, "π": PI, "3PI/8": 3 * PI / 8,
    "+3*pi/8": 3 * PI / 8, "- 3 * pi / 8": -3 * PI / 8, "−3π/8": -3 * PI / 8,
    "0.375pi": 3 * PI / 8, "3e0pi/.8e1": 3 * PI / 8,
    f"0.{'3' * 62}": 1 / 3,
    "67.5deg": 3 * PI / 8, "67.5 DEG": 3 * PI / 8, "−90°": -PI / 2,
}  # fmt: skip


@pytest.mark.parametrize("text", MEANT)
def test_a_text_means_its_angle(text: str) -> None:
    assert angle_from_text(text) == pytest.approx(MEANT[text], rel=1e-15, abs=0)


def test_real_numbers_are_radians() -> None:
    quarter = (0.25, np.float64(0.25), np.float32(0.25), np.array(0.25))
    for number in (0, 2, -3, *quarter, Fraction(1, 4), Decimal("0.25")):
        angle = angle_from_text(number)
        assert type(angle) is float
        assert angle == number


NO_ANGLES: list[Any] = [math.nan, math.inf, np.float64("nan"), Decimal("Infinity")]
NO_ANGLES += [10**400, True, None, 1j, [0.3], np.array([0.3, 0.4])]
NO_ANGLES += "0.3x|0.3 0.4|0,3|nan|-inf|1e400|-1e400deg|1e308pi|0x10|1_000".split("|")
NO_ANGLES += "|+|.|e5|deg|1e|--1|(1)|١|1/0pi|pi/0|pi/1e-400|pi/|3pi/8/2|3/8".split("|")
NO_ANGLES += "3/8pi|pipi|Π|3pi/8deg|3radpi|67.5degrees|*pi|\ufeff1".split("|")
NO_ANGLES += ["1" * 10**6, "0." + "3" * 63, " " * 100 + "1"]


@pytest.mark.parametrize("value", NO_ANGLES, ids=lambda value: repr(value)[:20])
def test_everything_else_is_refused_in_a_short_line(value: Any) -> None:
    with pytest.raises(InputError, match="^alpha1 must be a finite number") as caught:
        angle_from_text(value, "alpha1")
    plain = value.tolist() if hasattr(value, "tolist") else value
    assert f", got {repr(plain)[:60]}" in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1
    assert len(str(caught.value)) < 250
    assert caught.value.field == "alpha1"


def test_ranges_include_their_ends() -> None:
    assert angle_within(-HALF_PI, "x") == -HALF_PI
    assert angle_within("pi/2", "x") == HALF_PI
    assert angle_within(0.0, "x", least=0.0) == 0.0
    assert whole_number("x", np.int64(3), 3, 3) == 3
    assert angles_from([1e6]) == [1e6]


@pytest.mark.parametrize(
    "call",
    """
angle_within("-91deg", "x")
angle_within(-0.1, "x", least=0.0)
angle_within("360", "x")
angles_from([0.0, 1e6 + 0.5], "x")
whole_number("x", 2, 3, 3)
whole_number("x", 4, 3, 3)
whole_number("x", 3.0, 3, 3)
whole_number("x", True, 3, 3)
whole_number("x", "3", 3, 3)
""".strip().splitlines(),
)
def test_what_is_beyond_a_range_is_refused(call: str) -> None:
    with pytest.raises(InputError, match="^x must be"):
        eval(call)


@pytest.mark.parametrize(
    ("wrong", "hint"), [("2", True), ("360", True), (1.9, False), (361.0, False)]
)
def test_numbers_that_look_like_degrees_get_a_hint(wrong: Any, hint: bool) -> None:
    with pytest.raises(InputError) as caught:
        angle_within(wrong, "x")
    assert ("for degrees write" in str(caught.value)) == hint


@settings(deadline=None, max_examples=40)
@given(angle=st.floats(allow_nan=False, allow_infinity=False))
def test_every_float_reads_back_from_its_shortest_text(angle: float) -> None:
    assert angle_from_text(repr(angle)) == angle
    assert angle_from_text(repr(angle).replace("-", "−")) == angle
    assert angle_from_text(f"{angle!r}deg") == math.radians(angle)


@settings(deadline=None, max_examples=40)
@given(count=st.integers(-10_000, 10_000))
def test_multiples_of_a_thirtysecond_of_pi_are_written_as_such(count: int) -> None:
    angle = count * PI / 32
    assert angle_from_text(f"{count} * PI/32") == angle
    text = text_from_angle(angle)
    assert "." not in text
    assert angle_from_text(text) == pytest.approx(angle, rel=1e-14, abs=1e-14)
    if "/" in text:  # in lowest terms
        factor, divisor = text.split("π/")
        whole = {"": 1, "-": -1}.get(factor) or int(factor)
        assert math.gcd(whole, int(divisor)) == 1


@settings(deadline=None, max_examples=40)
@given(angle=moderate)
def test_any_other_angle_is_written_to_four_decimals(angle: float) -> None:
    assert abs(angle_from_text(text_from_angle(angle)) - angle) <= 5.0001e-5


@settings(deadline=None, max_examples=50)
@given(angle=moderate, other=moderate, period=st.sampled_from([PI, HALF_PI, 1.0, 0.3]))
def test_wrapping_leaves_the_distance_to_the_nearest_multiple(
    angle: float, other: float, period: float
) -> None:
    inside = wrapped(angle, period)
    assert abs(inside) <= period / 2 + 1e-12
    turns = (angle - inside) / period
    assert turns == pytest.approx(round(turns), abs=1e-9)
    assert wrapped(-angle, period) == -inside
    distance = distance_to_multiple(angle, period)
    assert distance == abs(inside)
    change = abs(distance_to_multiple(other, period) - distance)
    assert change <= abs(other - angle) + 1e-12


def test_both_ends_of_a_period_are_inside() -> None:
    assert wrapped(np.array([HALF_PI, -HALF_PI])).tolist() == [HALF_PI, -HALF_PI]
    assert (wrapped(HALF_PI), wrapped(-HALF_PI)) == (HALF_PI, -HALF_PI)
    assert wrapped(math.nextafter(HALF_PI, 2.0)) == pytest.approx(-HALF_PI)


@pytest.mark.parametrize("shape", [(), (0,), (3,), (2, 1, 4)])
def test_arrays_of_any_shape_are_taken_element_by_element(shape: Any) -> None:
    angles = np.random.default_rng(1).uniform(-1e3, 1e3, shape)
    distances = np.asarray(distance_to_multiple(angles, PI))
    assert distances.shape == shape
    alone = [distance_to_multiple(float(angle), PI) for angle in angles.flat]
    assert distances.ravel().tolist() == alone
