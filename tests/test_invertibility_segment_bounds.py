"""Bounds along whole segments, against many samples of them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings, strategies as st

from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.invertibility.forms import rotors_of
from gaitgraph.invertibility.matrices import (
    hover_thrust_shares,
    least_singular_value,
    least_singular_value_on_red,
    level_determinant,
    pitch_sensitivity,
    roll_sensitivity,
    zero_moment_inputs,
)
from gaitgraph.invertibility.segment_bounds import (
    HoverShares,
    Least,
    bound_along_red_path,
    largest_residual,
    least_along,
    least_level_determinant,
    least_of_bent,
    least_of_each,
    least_singular_value_along,
    thrust_shares_along,
    thrusts_push_up,
)
from gaitgraph.vehicle import PAPER, Vehicle
from tests.samples import (
    HALF_PI,
    KINDS,
    MIRRORED,
    PUBLISHED,
    STRONG,
    by_vehicle,
    points_of,
    random_segments,
)

if TYPE_CHECKING:
    from collections.abc import Callable

FloatArray = npt.NDArray[np.float64]

ALONG = np.linspace(0.0, 1.0, 401)

tilts = st.tuples(*[st.floats(-3, 3)] * 4)
three_vehicles = by_vehicle(PAPER, MIRRORED, STRONG)


@dataclass(frozen=True)
class Quantity:
    """A quantity along segments: its bracket, its value at a configuration, and a tolerance."""

    bracket: Callable[..., Least]
    value: Callable[[FloatArray], Any]
    tolerance: float


def residual(alpha: FloatArray) -> FloatArray:
    return np.asarray(
        -np.maximum(
            np.abs(roll_sensitivity(alpha, PUBLISHED)),
            np.abs(pitch_sensitivity(alpha, PUBLISHED)),
        )
    )


def least_share(start: FloatArray, end: FloatArray, **options: Any) -> Least:
    upward, least, _ = thrust_shares_along(start, end, **options)
    assert upward.all()
    return least


def minus_largest_share(start: FloatArray, end: FloatArray, **options: Any) -> Least:
    upward, _, largest = thrust_shares_along(start, end, MIRRORED, **options)
    assert upward.all()
    return largest


STRONG_NUMBERS = coefficients_of(STRONG)
QUANTITIES = {
    "R": Quantity(
        partial(least_level_determinant, coefficients=PUBLISHED),
        partial(level_determinant, coefficients=PUBLISHED),
        1e-6,
    ),
    "minus R, strong drag": Quantity(
        partial(least_level_determinant, coefficients=STRONG_NUMBERS, sign=-1.0),
        lambda at: -level_determinant(at, STRONG_NUMBERS),
        1e-4,
    ),
    "singular value": Quantity(least_singular_value_along, least_singular_value, 1e-3),
    "singular value, strong drag": Quantity(
        partial(least_singular_value_along, vehicle=STRONG),
        partial(least_singular_value, vehicle=STRONG),
        1e-3,
    ),
    "residual": Quantity(
        partial(largest_residual, coefficients=PUBLISHED), residual, 1e-5
    ),
    "least thrust": Quantity(
        least_share, lambda at: hover_thrust_shares(at).min(axis=-1), 1e-4
    ),
    "largest thrust": Quantity(
        minus_largest_share,
        lambda at: -hover_thrust_shares(at, MIRRORED).max(axis=-1),
        1e-4,
    ),
}
WITH_FLOOR = list(QUANTITIES)[:4]


def upward_segments(seed: int, mirrored: bool) -> tuple[FloatArray, FloatArray]:
    """Return segments near red where all rotors push up: α1 < δ and α2 > −δ, within ±π/2 of both lines."""
    rng = np.random.default_rng(seed)
    start, end = rng.uniform(0.0, 1.35, (2, 12, 4))
    for side in (start, end):
        side[:, 0] *= -1
        side[:, 2:] = side[:, :2] + rng.normal(0, 1e-2, (12, 2))
    # Mirrored spins are mirrored tilts.
    return (-start, -end) if mirrored else (start, end)


def segments_for(
    quantity: Quantity, kind: str, seed: int
) -> tuple[FloatArray, FloatArray]:
    if quantity.bracket in (least_share, minus_largest_share):
        start, end = upward_segments(
            seed, mirrored=quantity.bracket is minus_largest_share
        )
        if kind == "points":
            return start, start.copy()
        return (
            (start, start + 1e-3 * (end - start)) if kind == "short" else (start, end)
        )
    return random_segments(kind, seed)


def sampled(quantity: Quantity, start: FloatArray, end: FloatArray) -> FloatArray:
    return np.asarray(quantity.value(points_of(start, end)))


class TestBrackets:
    @pytest.mark.parametrize("name", QUANTITIES)
    @pytest.mark.parametrize("kind", KINDS)
    def test_they_contain_the_least_of_many_samples_and_are_attained(
        self, name: str, kind: str
    ) -> None:
        quantity = QUANTITIES[name]
        start, end = segments_for(quantity, kind, seed=1)
        values = sampled(quantity, start, end)
        least, tolerance = values.min(axis=1), quantity.tolerance + 1e-12
        # Between two samples the quantity moves no further than it does between neighbouring ones.
        gap = np.abs(np.diff(values, axis=1)).max(axis=1)
        brackets = [quantity.bracket(start, end, tolerance=quantity.tolerance)]
        if name != "residual":
            brackets.append(
                quantity.bracket(start, end, tolerance=quantity.tolerance, each=True)
            )
            assert (brackets[1].upper - brackets[1].lower <= tolerance).all()
            assert (brackets[1].upper <= least + tolerance).all()
        for found in brackets:
            assert (found.lower <= least + 1e-12).all()
            assert (found.lower <= found.upper).all()
            assert (found.upper >= least - gap - 1e-12).all()
            assert ((found.fraction >= 0) & (found.fraction <= 1)).all()
            at = start + found.fraction[:, None] * (end - start)
            known = np.isfinite(found.upper)
            np.testing.assert_allclose(
                quantity.value(at)[known], found.upper[known], atol=1e-12
            )
            assert (
                known.all() or found is brackets[0]
            )  # where the least of all is asked for, others are not decomposed
            # The bracket of the least of all is as narrow as was asked for.
            lower, upper, segment, fraction = found.worst()
            assert upper - tolerance <= lower <= least.min() + 1e-12
            assert upper <= least.min() + tolerance
            assert (upper, fraction) == (found.upper.min(), found.fraction[segment])


@pytest.mark.parametrize("name", WITH_FLOOR)
@pytest.mark.parametrize("kind", KINDS)
def test_each_segment_is_decided_rightly_against_a_floor(name: str, kind: str) -> None:
    quantity = QUANTITIES[name]
    start, end = random_segments(kind, seed=8)
    values = sampled(quantity, start, end)
    least, gap = values.min(axis=1), np.abs(np.diff(values, axis=1)).max(axis=1)
    for floor in (-1.0, 0.0, 0.05, 0.3, 2.0):
        found = quantity.bracket(
            start, end, tolerance=quantity.tolerance, floor=floor, each=True
        )
        above, below = found.lower >= floor, found.upper < floor
        clear = np.abs(least - floor) > quantity.tolerance + gap
        np.testing.assert_array_equal(above[clear], (least > floor)[clear])
        np.testing.assert_array_equal(below[clear], (least < floor)[clear])
        # A proof is a proof even where samples are too coarse to tell.
        assert (least[above] >= floor).all()
        assert (found.lower <= least + 1e-12).all()
        at = start + found.fraction[:, None] * (end - start)
        np.testing.assert_allclose(quantity.value(at), found.upper, atol=1e-12)


@pytest.mark.parametrize("zero", [0.0, 1 / 3, 0.1])
def test_work_ends_even_where_the_tolerance_is_finer_than_floats(zero: float) -> None:
    # The bound says less than it could, by so much that no interval is settled beside the zero.
    lower, upper, segment, fraction = least_along(
        np.full((1, 4), -1.0),
        np.full((1, 4), 1.0),
        lambda alpha: np.abs(alpha[:, 0] - zero),
        lambda f0, f1, p0, p1: (f0 + f1 - p1[:, 0] + p0[:, 0]) / 2 - 1e-15,
        tolerance=0.0,
    ).worst()
    assert 0 <= lower == upper < 1e-12
    assert segment == 0
    assert fraction == pytest.approx((1 + zero) / 2, abs=1e-12)


@three_vehicles
@pytest.mark.parametrize("height", [0.0, 0.3, -2.0])
def test_the_bound_along_red_is_true_and_of_second_order(
    vehicle: Vehicle, height: float
) -> None:
    vehicle, rng = (
        vehicle.replace(arm_length=1.0, rotor_height=height),
        np.random.default_rng(0),
    )
    start, turn = rng.uniform(-1.4, 1.4, (300, 2)), rng.uniform(0, 2 * np.pi, 300)
    for step, most in ((1.5, math.inf), (0.05, 0.2), (0.005, 5e-3)):
        end = start + step * np.stack([np.cos(turn), np.sin(turn)], axis=1)
        a1, a2 = np.moveaxis(
            points_of(np.tile(start, 2), np.tile(end, 2))[..., :2], -1, 0
        )
        least = least_singular_value_on_red(a1, a2, vehicle).min(axis=1)
        path = np.stack([start, end], axis=1).reshape(-1, 2)
        bound = bound_along_red_path(path.T, vehicle)[::2]
        assert (bound <= least).all()
        assert (bound >= least - most * np.maximum(least, 0.05)).all()


@settings(deadline=None, max_examples=50)
@given(
    bend=st.sampled_from([0.0, 1e-300, 1e-6, 1.0, 30.0]),
    low=st.floats(-2, 3),
    size=st.floats(0, 1),
    at=tilts,
)
def test_it_is_exact_for_a_parabola_and_holds_for_what_bends_less(
    bend: float, low: float, size: float, at: tuple[float, ...]
) -> None:
    # f'' = bend·size, least at `low` if that lies on [0, 1].
    height = at[0]
    f0, f1 = (np.array([height + bend * size / 2 * (s - low) ** 2]) for s in (0.0, 1.0))
    least = height + bend * size / 2 * (min(max(low, 0.0), 1.0) - low) ** 2
    assert least_of_bent(f0, f1, np.array([bend]))[0] <= least + 1e-12
    assert least_of_bent(f0, f1, np.array([bend * size]))[0] == pytest.approx(
        least, abs=1e-12
    )


class TestThrusts:
    @three_vehicles
    @pytest.mark.parametrize("kind", ["red", "near red", "anywhere", "short", "points"])
    def test_pushing_up_along_a_whole_segment(
        self, vehicle: Vehicle, kind: str
    ) -> None:
        start, end = random_segments(kind, seed=11, count=100)
        alpha = points_of(start, end)
        # Not the shares: they are a quotient, and keep their sign where all thrusts of a segment pass through zero
        # together, at a configuration from which there is no hover.
        lift = np.array([-1, 1, -1, 1]) * (
            1 if vehicle.first_rotor_spin == "clockwise" else -1
        )
        thrusts = lift * zero_moment_inputs(alpha, vehicle)
        expected = (thrusts > 0).all(axis=(1, 2)) | (thrusts < 0).all(axis=(1, 2))
        assert (hover_thrust_shares(alpha[expected], vehicle) > 0).all()
        np.testing.assert_array_equal(thrusts_push_up(start, end, vehicle), expected)
        np.testing.assert_array_equal(
            thrust_shares_along(start, end, vehicle)[0], expected
        )
        assert expected.any()
        assert not expected.all()

    @three_vehicles
    @pytest.mark.parametrize("size", [1.0, 1e-6])
    def test_a_line_where_two_rotors_idle_is_not_crossed_however_short_the_step(
        self, vehicle: Vehicle, size: float
    ) -> None:
        delta = math.atan(vehicle.signed_drag_ratio)
        idle = np.array([delta, -delta])

        def pushes(first: tuple[float, float], second: tuple[float, float]) -> bool:
            p, q = (idle + size * np.array(side) * 0.2 for side in (first, second))
            return bool(
                thrusts_push_up(np.array([[*p, *p]]), np.array([[*q, *q]]), vehicle)[0]
            )

        # Within the two quarters where all rotors push up.
        for good in (
            ((-1, 1), (-2, 3)),
            ((2, -1), (1, -3)),
            ((-1, 1), (-1, 1)),
            ((1, -1), (1, -1)),
        ):
            assert pushes(*good)
        # Within the two others, across one line, along one, up to one, from one away; and through the point of both.
        outside, across = (
            [((1, 1), (2, 3)), ((-1, -1), (-2, -1))],
            [((-1, 1), (1, 1)), ((-1, 1), (-1, -1))],
        )
        beside = [
            ((0, 1), (0, 2)),
            ((-1, 0), (-2, 0)),
            ((-1, 1), (0, 1)),
            ((-1, 0), (-1, 1)),
        ]
        for bad in (
            *outside,
            *across,
            *beside,
            ((-1, 1), (1, -1)),
            ((-1, 1), (2, -3)),
            ((0, 0), (0, 0)),
        ):
            assert not pushes(*bad)

    @three_vehicles
    def test_a_line_where_nothing_hovers_is_not_crossed_either(
        self, vehicle: Vehicle
    ) -> None:
        # At β1 = ∓π/2 the torques have rank two: before it and after it all rotors push up, on it nothing is unique.
        delta, side = (
            math.atan(vehicle.signed_drag_ratio),
            math.copysign(1.0, vehicle.signed_drag_ratio),
        )
        ends = np.array(
            [[[delta - side * (HALF_PI + x), side * 0.4] * 2] for x in (-1e-2, 1e-2)]
        )
        assert (hover_thrust_shares(ends, vehicle) > 0).all()
        assert not thrusts_push_up(ends[0], ends[1], vehicle)[0]

    @three_vehicles
    def test_without_any_cut_the_bracket_holds_on_long_segments(
        self, vehicle: Vehicle
    ) -> None:
        start, end = np.random.default_rng(16).uniform(-1.5, 1.5, (2, 3000, 4))
        end[::2] = start[::2] + 0.1 * (end[::2] - start[::2])
        upward = thrusts_push_up(start, end, vehicle)
        start, end = start[upward], end[upward]
        assert len(start) >= 20
        shares = hover_thrust_shares(points_of(start, end, 101), vehicle)
        quantity = HoverShares(rotors_of(vehicle))
        least, minus_largest = least_of_each(
            start, end, [quantity], [1e-4], each=True, most=0
        )
        assert (least.lower <= shares.min(axis=(1, 2)) + 1e-12).all()
        assert (minus_largest.lower <= -shares.max(axis=(1, 2)) + 1e-12).all()
        assert (least.lower > 0).any()

    @pytest.mark.parametrize("near", [1e-2, 1e-5])
    def test_beside_the_point_where_all_rotors_idle(self, near: float) -> None:
        delta = math.atan(PAPER.signed_drag_ratio)
        start, end = (
            np.array([delta - near, -delta + near / 3]),
            np.array([delta - 0.2, -delta + 2 * near]),
        )
        p, q = (np.array([[*side, *side]]) for side in (start, end))
        shares = hover_thrust_shares(p + (ALONG**6)[:, None] * (q - p))
        upward, least, minus_largest = thrust_shares_along(p, q)
        assert upward.all()
        for found, values in (
            (least, shares.min(axis=1)),
            (minus_largest, -shares.max(axis=1)),
        ):
            lower, upper, _, _ = found.worst()
            assert lower <= values.min() + 1e-12
            assert upper <= values.min() + 1e-4 + 1e-12
            assert upper - lower <= 1e-4 + 1e-12

    def test_of_segments_without_upward_thrusts_nothing_is_claimed(self) -> None:
        start, end = upward_segments(12, mirrored=False)
        start[[1, 4]], end[[1, 4]] = [0.6, 0.6, 0.6, 0.6], [0.9, 0.8, 0.9, 0.8]
        good = np.delete(np.arange(12), [1, 4])
        upward, *brackets = thrust_shares_along(start, end, each=True)
        assert np.flatnonzero(upward).tolist() == good.tolist()
        _, *alone = thrust_shares_along(start[good], end[good], each=True)
        for bracket, same in zip(brackets, alone, strict=True):
            assert np.isnan([bracket.lower[[1, 4]], bracket.upper[[1, 4]]]).all()
            np.testing.assert_array_equal(
                bracket.lower[good], same.lower
            )  # unchanged by the two
            np.testing.assert_array_equal(bracket.fraction[good], same.fraction)

    def test_beyond_a_right_angle_a_rotor_pushes_down(self) -> None:
        inside, outside = [1.2, -1.2, 1.2, -1.2], [1.6, -1.2, 1.6, -1.2]
        both = np.array([inside, outside])
        # By the shares alone nothing is wrong out there: all four are positive.
        assert (hover_thrust_shares(both) > 0).all()
        assert thrusts_push_up(both, both).tolist() == [True, False]
        assert thrusts_push_up(both, both[::-1]).tolist() == [False, False]
        end = np.array([[HALF_PI, -1.2, HALF_PI, -1.2]])
        assert thrusts_push_up(both[:1], end).tolist() == [True]


def test_many_open_intervals_are_halved_in_batches(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The brackets do not depend on the size of a batch."""
    starts, ends = random_segments("anywhere", seed=4, count=20)
    whole = least_singular_value_along(starts, ends, tolerance=1e-3, each=True)
    monkeypatch.setattr("gaitgraph.invertibility.segment_bounds._BATCH", 7)
    pieces = least_singular_value_along(starts, ends, tolerance=1e-3, each=True)
    np.testing.assert_allclose(pieces.lower, whole.lower, atol=1.1e-3)
    np.testing.assert_allclose(pieces.upper, whole.upper, atol=1.1e-3)
    assert (pieces.upper - pieces.lower <= 1e-3 + 1e-12).all()
    rough = least_singular_value_along(
        starts, ends, tolerance=1e-6, each=True, most=200
    )
    assert (rough.lower <= whole.upper + 1e-12).all()
