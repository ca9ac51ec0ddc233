"""Bounds along whole segments, against many samples of them."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings, strategies as st

from gaitgraph.invertibility import matrices, segment_bounds as bounds
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.invertibility.forms import rotors_of
from gaitgraph.vehicle import PAPER, Vehicle
from tests.samples import (
    EVERY_KIND,
    HALF_PI,
    KINDS,
    MIRRORED,
    RAISED,
    STRONG,
    by_vehicle,
    points_of,
    random_segments,
)

if TYPE_CHECKING:
    from collections.abc import Callable

FloatArray = npt.NDArray[np.float64]

three_vehicles = by_vehicle(PAPER, MIRRORED, STRONG)


class Quantity(NamedTuple):
    """The bracket of a quantity along segments, and its value at a configuration."""

    bracket: Callable[..., bounds.Least]
    value: Callable[[FloatArray], Any]


def quantity_of(name: str, vehicle: Vehicle) -> Quantity:
    numbers = coefficients_of(vehicle)
    if name == "singular value":
        bracket = partial(bounds.least_singular_value_along, vehicle=vehicle)
        return Quantity(
            bracket, partial(matrices.least_singular_value, vehicle=vehicle)
        )
    if name == "residual":
        x, y, _ = vehicle.scaled_positions[0]
        turn = np.array([[x, -y], [y, x]]) / math.hypot(x, y)

        def residual(alpha: FloatArray) -> Any:
            v = matrices.attitude_sensitivities(alpha, numbers)
            return -np.abs(v[..., :2] @ turn).max(axis=-1)

        def residuals(
            starts: FloatArray, ends: FloatArray, tolerance: float, **options: Any
        ) -> bounds.Least:
            least = bounds.Residual(numbers)
            return bounds.least_of_each(starts, ends, [least], [tolerance], **options)[
                0
            ]

        return Quantity(residuals, residual)
    sign = -1.0 if name == "-R" else 1.0
    bracket = partial(bounds.least_level_determinant, coefficients=numbers, sign=sign)
    return Quantity(bracket, lambda at: sign * matrices.level_determinant(at, numbers))


def segments(seed: int) -> tuple[FloatArray, FloatArray]:
    """Return segments of each kind."""
    starts, ends = np.concatenate(
        [random_segments(kind, seed, 4) for kind in KINDS], axis=1
    )
    return starts, ends


def at_fractions(
    starts: FloatArray, ends: FloatArray, least: bounds.Least
) -> FloatArray:
    return starts + least.fraction[:, None] * (ends - starts)


@by_vehicle(*EVERY_KIND)
@pytest.mark.parametrize("name", ["R", "-R", "singular value", "residual"])
def test_brackets_contain_the_least_of_many_samples_and_are_attained(
    name: str, vehicle: Vehicle
) -> None:
    quantity, tolerance = quantity_of(name, vehicle), 1e-4
    starts, ends = segments(1)
    values = quantity.value(points_of(starts, ends))
    least = values.min(axis=1)
    # Between two samples the quantity moves no further than it does between neighbouring ones.
    gap = np.abs(np.diff(values, axis=1)).max(axis=1)
    options: list[dict[str, Any]] = [{}, {"each": True}, {"each": True, "most": 0}]
    for option in options:
        bracket = quantity.bracket(starts, ends, tolerance=tolerance, **option)
        assert (bracket.lower <= least + 1e-11).all()
        assert (bracket.lower <= bracket.upper).all()
        assert (bracket.upper >= least - gap - 1e-11).all()
        known = np.isfinite(bracket.upper)
        there = quantity.value(at_fractions(starts, ends, bracket))
        np.testing.assert_allclose(there[known], bracket.upper[known], atol=1e-11)
        lower, upper, segment, fraction = bracket.worst()
        assert (upper, fraction) == (bracket.upper.min(), bracket.fraction[segment])
        if "most" in option:
            continue
        assert upper - tolerance - 1e-11 <= lower
        assert upper <= least.min() + tolerance + 1e-11
        if option:
            assert (bracket.upper - bracket.lower <= tolerance + 1e-11).all()
            assert (bracket.upper <= least + tolerance + 1e-11).all()


def test_bounds_of_singular_values_from_below_hold_and_are_close() -> None:
    """Also where all four are alike, and where the matrix is singular."""
    random = np.random.default_rng(11)
    sizes = 10.0 ** random.uniform(-9, 3, (20_000, 4))
    sizes[::2] = random.uniform(0.03, 1, sizes[::2].shape)
    sizes[::5] = sizes[::5, :1]
    sizes[1::5, 3] = 0.0
    first, last = np.linalg.qr(random.normal(size=(2, len(sizes), 4, 4)))[0]
    matrix = first * sizes[:, None] @ last
    below = bounds.least_singular_values_from_below(matrix, sizes.prod(axis=1))
    least, next_one, _, largest = np.sort(sizes).T
    assert (below <= least).all()
    is_apart = (next_one > 3 * least) & (least > 0.03 * largest)
    assert (below[is_apart] >= 0.97 * least[is_apart]).all()


@by_vehicle(PAPER, RAISED)
@pytest.mark.parametrize("name", ["R", "-R", "singular value"])
def test_each_segment_is_decided_rightly_against_a_floor(
    name: str, vehicle: Vehicle
) -> None:
    quantity, tolerance = quantity_of(name, vehicle), 1e-3
    starts, ends = segments(8)
    values = quantity.value(points_of(starts, ends))
    least, gap = values.min(axis=1), np.abs(np.diff(values, axis=1)).max(axis=1)
    for floor in (-1.0, 0.0, 0.05, 0.3, 2.0):
        bracket = quantity.bracket(
            starts, ends, tolerance=tolerance, floor=floor, each=True
        )
        clear = np.abs(least - floor) > tolerance + gap
        above = bracket.lower >= floor
        assert np.array_equal(above[clear], (least > floor)[clear])
        assert np.array_equal((bracket.upper < floor)[clear], (least < floor)[clear])
        # A proof is a proof even where samples are too coarse to tell.
        assert (least[above] >= floor).all()
        assert (bracket.lower <= least + 1e-12).all()
        if name == "singular value":
            kept = bounds.keeps_singular_value_above(starts, ends, floor, vehicle)
            assert np.array_equal(kept[clear], (least > floor)[clear])


@pytest.mark.parametrize("zero", [0.0, 1 / 3, 0.1])
def test_work_ends_even_where_the_tolerance_is_finer_than_floats(zero: float) -> None:
    """The bound says less than it could, by so much that no interval is settled beside the zero."""
    lower, upper, segment, fraction = bounds.least_along(
        np.full((1, 4), -1.0),
        np.full((1, 4), 1.0),
        lambda alpha: np.abs(alpha[:, 0] - zero),
        lambda f0, f1, p0, p1: (f0 + f1 - p1[:, 0] + p0[:, 0]) / 2 - 1e-15,
        tolerance=0.0,
    ).worst()
    assert 0 <= lower == upper < 1e-12
    assert segment == 0
    assert fraction == pytest.approx((1 + zero) / 2, abs=1e-12)


@settings(deadline=None, max_examples=50)
@given(
    bend=st.sampled_from([0.0, 1e-300, 1e-6, 1.0, 30.0]),
    low=st.floats(-2, 3),
    size=st.floats(0, 1),
    height=st.floats(-3, 3),
)
def test_it_is_exact_for_a_parabola_and_holds_for_what_bends_less(
    bend: float, low: float, size: float, height: float
) -> None:
    """f'' = bend·size, least at `low` if that lies on [0, 1]."""

    def parabola(s: float) -> float:
        return height + bend * size / 2 * (s - low) ** 2

    f0, f1 = (np.array([parabola(s)]) for s in (0.0, 1.0))
    least = parabola(min(max(low, 0.0), 1.0))
    assert bounds.least_of_bent(f0, f1, np.array([bend]))[0] <= least + 1e-12
    exact = bounds.least_of_bent(f0, f1, np.array([bend * size]))[0]
    assert exact == pytest.approx(least, abs=1e-12)


# -- Thrusts


@by_vehicle(*EVERY_KIND)
def test_thrusts_push_up_and_shares_are_bracketed_along_whole_segments(
    vehicle: Vehicle,
) -> None:
    random = np.random.default_rng(11)
    starts = random.uniform(-0.5, 0.5, (150, 4))
    starts[:50, 2:] = starts[:50, :2]
    ends = starts + random.choice([0.0, 1e-3, 0.1, 1.3], (150, 1)) * random.uniform(
        -1, 1, (150, 4)
    )
    alpha = points_of(starts, ends, 201)
    # Not the shares: they are a quotient, and keep their sign where all thrusts of a segment pass through zero
    # together, at a configuration from which there is no hover.
    thrusts = matrices.thrust_signs(vehicle) * matrices.zero_moment_inputs(
        alpha, vehicle
    )
    size = np.maximum(thrusts.min(axis=(1, 2)), -thrusts.max(axis=(1, 2)))
    expected = (size > 0) & (np.abs(alpha) <= HALF_PI).all(axis=(1, 2))
    upward = bounds.thrusts_push_up(starts, ends, vehicle)
    clear = np.abs(size) > 1e-4
    assert np.array_equal(upward[clear], expected[clear])
    assert (upward <= expected).all()
    assert len({*upward}) == 2

    shares = matrices.hover_thrust_shares(alpha[upward], vehicle)
    assert (shares > 0).all()
    quantity = bounds.HoverShares(rotors_of(vehicle))
    ends_of = (starts[upward], ends[upward])
    brackets = bounds.least_of_each(*ends_of, [quantity], [1e-4], each=True)
    rough = bounds.least_of_each(*ends_of, [quantity], [1e-4], each=True, most=0)
    sides = (shares.min(axis=(1, 2)), -shares.max(axis=(1, 2)))
    for bracket, uncut, least in zip(brackets, rough, sides, strict=True):
        assert (bracket.lower <= least + 1e-12).all()
        assert (bracket.upper <= least + 1e-4 + 1e-12).all()
        assert (bracket.upper - bracket.lower <= 1e-4 + 1e-12).all()
        assert (uncut.lower <= least + 1e-12).all()
    assert (rough[0].lower > 0).any()


IDLE = [  # steps from the point where all rotors idle, and whether they push up from one to the other
    ((-1, 1), (-2, 3), True),  # within the two quarters where all push up
    ((2, -1), (1, -3), True),
    ((-1, 1), (-1, 1), True),
    ((1, 1), (2, 3), False),  # within the two others
    ((-1, -1), (-2, -1), False),
    ((-1, 1), (1, 1), False),  # across one line
    ((-1, 1), (-1, -1), False),
    ((0, 1), (0, 2), False),  # along one, up to one, from one away
    ((-1, 1), (0, 1), False),
    ((-1, 0), (-1, 1), False),
    ((-1, 1), (1, -1), False),  # through the point of both
    ((0, 0), (0, 0), False),
]


@three_vehicles
@pytest.mark.parametrize("size", [0.2, 2e-7])
def test_a_line_where_two_rotors_idle_is_not_crossed_however_short_the_step(
    vehicle: Vehicle, size: float
) -> None:
    delta = math.atan(vehicle.signed_drag_ratio)
    idle = np.array([delta, -delta])
    for first, second, pushes in IDLE:
        p, q = (
            np.tile(idle + size * np.array(side), (1, 2)) for side in (first, second)
        )
        assert bounds.thrusts_push_up(p, q, vehicle).tolist() == [pushes]


@three_vehicles
def test_a_line_where_nothing_hovers_is_not_crossed_either(vehicle: Vehicle) -> None:
    """At β1 = ∓π/2 the torques have rank two: before it and after it all rotors push up, on it nothing is unique."""
    delta = math.atan(vehicle.signed_drag_ratio)
    side = math.copysign(1.0, delta)
    p, q = (
        np.array([[delta - side * (HALF_PI + x), side * 0.4] * 2])
        for x in (-0.01, 0.01)
    )
    assert (matrices.hover_thrust_shares([p, q], vehicle) > 0).all()
    assert not bounds.thrusts_push_up(p, q, vehicle)[0]


@pytest.mark.parametrize("near", [1e-2, 1e-5])
def test_beside_the_point_where_all_rotors_idle(near: float) -> None:
    delta = math.atan(PAPER.signed_drag_ratio)
    p = np.array([[delta - near, -delta + near / 3] * 2])
    q = np.array([[delta - 0.2, -delta + 2 * near] * 2])
    shares = matrices.hover_thrust_shares(
        p + (np.linspace(0, 1, 401) ** 6)[:, None] * (q - p)
    )
    assert bounds.thrusts_push_up(p, q).all()
    quantity = bounds.HoverShares(rotors_of(PAPER))
    brackets = bounds.least_of_each(p, q, [quantity], [1e-4])
    for bracket, least in zip(brackets, (shares.min(), -shares.max()), strict=True):
        lower, upper, _, _ = bracket.worst()
        assert lower <= least + 1e-12
        assert upper <= least + 1e-4 + 1e-12
        assert upper - lower <= 1e-4 + 1e-12


def test_beyond_a_right_angle_a_rotor_pushes_down() -> None:
    """By the shares alone nothing is wrong out there: all four are positive."""
    both = np.array([[1.2, -1.2, 1.2, -1.2], [1.6, -1.2, 1.6, -1.2]])
    assert (matrices.hover_thrust_shares(both) > 0).all()
    assert bounds.thrusts_push_up(both, both).tolist() == [True, False]
    assert bounds.thrusts_push_up(both, both[::-1]).tolist() == [False, False]
    end = np.array([[HALF_PI, -1.2, HALF_PI, -1.2]])
    assert bounds.thrusts_push_up(both[:1], end).tolist() == [True]
    whole_turn = both + 2 * math.pi
    assert bounds.thrusts_push_up(whole_turn, whole_turn).tolist() == [True, False]
