"""Reading and writing angles, and arithmetic modulo π."""

from __future__ import annotations

import math
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from gaitgraph.angles import (
    HALF_PI,
    angle_from_text,
    distance_to_multiple,
    text_from_angle,
    wrapped,
)
from gaitgraph.errors import InputError

PI = math.pi
finite = st.floats(allow_nan=False, allow_infinity=False)
# Beyond a few thousand radians an angle modulo π has lost digits that no arithmetic brings back.
moderate = st.floats(-1e3, 1e3)
within = st.floats(-HALF_PI, HALF_PI)
whole = st.integers(-10_000, 10_000)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        *(
            ("0", 0.0),
            ("-1.178", -1.178),
            ("+.5", 0.5),
            ("5.", 5.0),
            ("1e-3", 1e-3),
            ("1.5E2", 150.0),
        ),
        *(
            ("0.3 rad", 0.3),
            ("  0.3\n", 0.3),
            ("pi", PI),
            ("-pi", -PI),
            ("π", PI),
            ("3PI/8", 3 * PI / 8),
        ),
        *(
            ("+3*pi/8", 3 * PI / 8),
            ("- 3 * pi / 8", -3 * PI / 8),
            ("−3π/8", -3 * PI / 8),
            ("0.375pi", 3 * PI / 8),
        ),
        *(
            ("3e0pi/.8e1", 3 * PI / 8),
            ("67.5deg", 3 * PI / 8),
            ("67.5 DEG", 3 * PI / 8),
            ("−90°", -PI / 2),
        ),
    ],
)
def test_a_text_means_its_angle(text: str, expected: float) -> None:
    assert angle_from_text(text) == pytest.approx(expected, rel=1e-15, abs=0)


@pytest.mark.parametrize(
    "number",
    [
        0,
        2,
        -3,
        0.25,
        np.float64(0.25),
        np.float32(0.25),
        np.array(0.25),
        Fraction(1, 4),
        Decimal("0.25"),
    ],
)
def test_real_numbers_are_radians(number: object) -> None:
    angle = angle_from_text(number)
    assert type(angle) is float
    assert angle == number


NO_ANGLES: list[object] = [
    *(
        math.nan,
        math.inf,
        np.float64("nan"),
        Decimal("Infinity"),
        10**400,
        True,
        None,
        1j,
        [0.3],
        np.array([0.3, 0.4]),
    ),
    *(
        "",
        " ",
        "+",
        ".",
        "e5",
        "deg",
        "rad",
        "0.3x",
        "0.3 0.4",
        "0,3",
        "nan",
        "-inf",
        "1e400",
        "-1e400deg",
        "1e308pi",
    ),
    *(
        "0x10",
        "1_000",
        "1e",
        "1.2.3",
        "--1",
        "1-",
        "(1)",
        "1+1",
        "١",
        "1/0pi",
        "pi/0",
        "pi/1e-400",
        "pi/",
        "/8",
    ),
    *(
        "3pi/8/2",
        "3/8",
        "3/8pi",
        "pi3",
        "pi*3",
        "pipi",
        "Π",
        "3pi/8deg",
        "3radpi",
        "67.5degrees",
        "*pi",
        "\ufeff1",
    ),
    *("1" * 10**6, "0." + "3" * 80, " " * 100 + "1", "(" * 5000),
]


def test_everything_else_is_refused_in_a_short_line() -> None:
    for value in NO_ANGLES:
        with pytest.raises(InputError) as caught:
            angle_from_text(value, "waypoint 2 alpha1")
        message = str(caught.value)
        assert message.startswith(
            "waypoint 2 alpha1 must be a finite number in radians, or a text such as '3pi/8'"
        )
        plain = value.tolist() if hasattr(value, "tolist") else value
        assert f", got {repr(plain)[:60]}" in message
        assert "\n" not in message
        assert len(message) < 250


@settings(deadline=None, max_examples=40)
@given(angle=finite)
def test_every_float_reads_back_from_its_shortest_text(angle: float) -> None:
    assert angle_from_text(repr(angle)) == angle
    assert angle_from_text(repr(angle).replace("-", "−")) == angle
    assert angle_from_text(f"{angle!r}deg") == math.radians(angle)
    assert angle_from_text(angle) == angle


@settings(deadline=None, max_examples=40)
@given(count=whole)
def test_multiples_of_a_thirtysecond_of_pi_are_written_as_such(count: int) -> None:
    angle = count * PI / 32
    assert angle_from_text(f"{count} * PI/32") == angle
    assert angle_from_text(f"{count * 180 / 32!r}deg") == pytest.approx(
        angle, rel=1e-14
    )
    text = text_from_angle(angle)
    assert "." not in text
    assert angle_from_text(text) == pytest.approx(angle, rel=1e-14, abs=1e-14)
    if "/" in text:  # in lowest terms
        factor, divisor = text.split("π/")
        assert (
            math.gcd(int({"": "1", "-": "-1"}.get(factor, factor)), int(divisor)) == 1
        )


def test_a_multiple_is_one_to_within_a_billionth() -> None:
    assert [text_from_angle(PI / 8 + off) for off in (0.9e-9, 1.1e-9, -1.1e-9)] == [
        "π/8",
        "0.3927",
        "0.3927",
    ]


@settings(deadline=None, max_examples=40)
@given(angle=moderate)
def test_any_other_angle_is_written_to_four_decimals(angle: float) -> None:
    assert abs(angle_from_text(text_from_angle(angle)) - angle) <= 5.0001e-5


@settings(deadline=None, max_examples=50)
@given(angle=moderate)
def test_wrapping_takes_away_whole_multiples_of_pi(angle: float) -> None:
    inside = wrapped(angle)
    assert -HALF_PI - 1e-12 <= inside <= HALF_PI + 1e-12
    # Functions of period π do not see the difference.
    assert math.sin(2 * inside) == pytest.approx(math.sin(2 * angle), abs=1e-12)
    assert math.cos(2 * inside) == pytest.approx(math.cos(2 * angle), abs=1e-12)
    assert wrapped(-angle) == -inside
    assert distance_to_multiple(wrapped(angle + PI) - inside, PI) < 1e-12


def test_both_ends_are_inside() -> None:
    assert wrapped(HALF_PI) == HALF_PI
    assert wrapped(-HALF_PI) == -HALF_PI
    assert wrapped(np.array([HALF_PI, -HALF_PI])).tolist() == [HALF_PI, -HALF_PI]
    assert wrapped(math.nextafter(HALF_PI, 2.0)) == pytest.approx(-HALF_PI)


@settings(deadline=None, max_examples=50)
@given(angle=moderate, other=moderate, period=st.sampled_from([PI, HALF_PI, 1.0, 0.3]))
def test_the_distance_to_a_multiple_is_a_distance(
    angle: float, other: float, period: float
) -> None:
    distance = distance_to_multiple(angle, period)
    assert 0 <= distance <= period / 2 + 1e-12
    # A chord of the circle whose circumference is the period, without any rounding to multiples.
    assert math.sin(PI / period * distance) == pytest.approx(
        abs(math.sin(PI / period * angle)), abs=1e-10
    )
    assert distance_to_multiple(-angle, period) == distance
    assert distance_to_multiple(angle + period, period) == pytest.approx(
        distance, abs=1e-12
    )
    assert (
        abs(distance_to_multiple(other, period) - distance)
        <= abs(other - angle) + 1e-12
    )


@pytest.mark.parametrize("shape", [(), (0,), (3,), (2, 1, 4)])
def test_arrays_of_any_shape_are_taken_element_by_element(
    shape: tuple[int, ...],
) -> None:
    angles = np.random.default_rng(1).uniform(-1e3, 1e3, shape)
    for period in (PI, HALF_PI):  # the distance is what wrapping leaves
        found = np.asarray(distance_to_multiple(angles, period))
        assert found.shape == shape
        assert found.ravel().tolist() == [
            distance_to_multiple(float(angle), period) for angle in angles.flat
        ]
