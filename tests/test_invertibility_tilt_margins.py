"""Tilt margins and the worst attitude within a tilt, against brute force over attitudes and directions."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import pytest
from scipy.optimize import brentq

from gaitgraph.gait.gait import lift
from gaitgraph.invertibility.coefficients import Coefficients, coefficients_of
from gaitgraph.invertibility.matrices import (
    attitude_of,
    attitude_sensitivities,
    body_vertical,
    determinant,
    least_singular_value,
    level_determinant,
    scaled_decoupling_matrix,
)
from gaitgraph.invertibility.segment_bounds import least_root
from gaitgraph.invertibility.tilt_margins import (
    LeastMargin,
    least_singular_value_within,
    least_singular_value_within_bound,
    least_tilt_margin,
    nearest_singular_attitude,
    sensitivity_deviations,
    singular_everywhere,
    tilt_margin,
)
from tests.published import GAITS
from tests.samples import (
    EVERY_KIND,
    EXACT,
    HALF_PI,
    along,
    by_kind,
    by_vehicle,
    closed,
    on_blue,
    on_red,
    points_of,
    random_tilts,
    random_vehicle,
)

if TYPE_CHECKING:
    from gaitgraph.vehicle import Vehicle

FloatArray = npt.NDArray[np.float64]

every_vehicle = by_vehicle(*EVERY_KIND)
ROUNDING = 5e-4


def cap(tilt: float, rings: int, spokes: int) -> FloatArray:
    """Return (roll, pitch) of attitudes all over the cap of a tilt, its rim included, shape (2, rings, spokes)."""
    m = np.linspace(0.0, tilt, rings)[:, None]
    z = np.linspace(0.0, 2 * math.pi, spokes)[None]
    up = [np.sin(m) * np.cos(z), np.sin(m) * np.sin(z), np.cos(m) + 0 * z]
    return np.moveaxis(attitude_of(np.stack(up, axis=-1)), -1, 0)


def around(corners: FloatArray) -> FloatArray:
    return np.append(corners, corners[:1], axis=0)


def location(corners: FloatArray, margin: LeastMargin) -> FloatArray:
    starts, ends = closed(corners)
    step = ends[margin.segment] - starts[margin.segment]
    return np.asarray(starts[margin.segment] + margin.fraction * step)


# -- The margin of a configuration


@every_vehicle
def test_below_the_margin_no_attitude_is_singular_and_just_above_one_is(
    vehicle: Vehicle,
) -> None:
    exact = coefficients_of(vehicle, "exact")
    for alpha in random_tilts(1, 6, reach=1.6):
        margin = float(tilt_margin(alpha, exact))
        values = determinant(alpha, exact, *cap(margin - 1e-6, 20, 91))
        assert values.min() * values.max() > 0
        if margin < HALF_PI - 2e-3:
            values = determinant(alpha, exact, *cap(margin + 1e-3, 2, 1801))
            assert values.min() * values.max() < 0
        nearest = nearest_singular_attitude(alpha, exact)
        size = np.linalg.norm(attitude_sensitivities(alpha, exact))
        assert abs(determinant(alpha, exact, *nearest)) <= 1e-12 * size
        tilt = math.acos(body_vertical(*nearest)[2])
        assert tilt == pytest.approx(margin, abs=1e-9)


def test_rounding_hides_v_on_blue_and_not_far_beyond() -> None:
    random = np.random.default_rng(9)
    first, second = random.uniform(-1.2, 1.2, (2, 500))
    blue = on_blue(first, second, EXACT.delta)
    move = random.uniform(-1, 1, (500, 4))
    move *= ROUNDING / np.abs(move).max(axis=1, keepdims=True)
    near, far = (
        singular_everywhere(blue + size * move, EXACT, angle_rounding=ROUNDING)
        for size in (1, 10)
    )
    assert near.all()
    assert far.mean() < 0.05
    for pair, side in zip(blue.reshape(-1, 2, 4)[:60], np.sign(move), strict=False):
        moved = pair + np.outer([ROUNDING, -ROUNDING], side)
        assert not least_tilt_margin(moved, EXACT, angle_rounding=ROUNDING).exists


# -- The least along segments


@by_kind
def test_blue_has_no_margin_and_one_blue_segment_is_enough(
    numbers: Coefficients,
) -> None:
    for gait in GAITS[:2]:
        alpha = lift(gait.angles, "blue", coefficients=numbers).alpha
        margin = least_tilt_margin(around(alpha), numbers)
        assert not margin.exists
        assert math.isnan(margin.lower)
        assert "singular at every attitude" in margin.reason
    points = np.vstack([alpha[0] + [0.1, 0.2, 0.0, 0.1], alpha[:2]])
    margin = least_tilt_margin(around(points), numbers)
    assert (margin.exists, margin.segment) == (False, 1)
    assert not least_tilt_margin(alpha[[0, 0]], numbers).exists


def test_the_least_margin_against_dense_sampling() -> None:
    """Never above what is met, never below what the bracket says, and met where it says."""
    random = np.random.default_rng(3)
    kinds = set()
    for number in range(42):
        vehicle = random_vehicle(random) if number % 2 else EVERY_KIND[number % 7]
        exact = coefficients_of(vehicle, "exact")
        size = random.choice([0.02, 0.2, 1.0, 3.0])
        steps = random.uniform(-size, size, (random.integers(1, 7), 4))
        points = random.uniform(-1.6, 1.6, 4) + steps
        if number % 3 == 0:
            points[:, 2:] = points[:, :2] * random.choice([0.8, 0.99, 1.0])
        margin = least_tilt_margin(around(points), exact)
        there, alpha = location(points, margin), along(points, 600)
        R, dense = level_determinant(alpha, exact), tilt_margin(alpha, exact)
        if R.min() * R.max() < 0:
            assert (margin.lower, margin.upper) == (0.0, 0.0)
            assert margin.reason == "R changes its sign"
            assert abs(level_determinant(there, exact)) <= 1e-12 * np.abs(R).max()
            kinds.add("zero")
        else:
            assert margin.lower <= np.nanmin(dense) + 1e-12
            assert margin.upper <= np.nanmin(dense) + 1e-7
            assert margin.upper - margin.lower <= 1.01e-7
            assert tilt_margin(there, exact) == pytest.approx(margin.upper, abs=1e-12)
            assert margin.reason == ""
            kinds.add("red" if margin.upper == HALF_PI else "between")
    assert kinds == {"zero", "red", "between"}


def test_without_any_cut_the_bracket_holds(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gaitgraph.invertibility.segment_bounds._MOST_POINTS", 0)
    starts, steps = random_tilts(7, 200, reach=1.5), random_tilts(8, 200, reach=0.3)
    dense = tilt_margin(points_of(starts, starts + steps, 101), EXACT).min(axis=1)
    pairs = np.stack([starts, starts + steps], axis=1)
    lower = np.array([least_tilt_margin(pair, EXACT).lower for pair in pairs])
    assert (lower <= dense + 1e-12).all()
    assert lower.mean() > 0.85 * dense.mean()
    # On the surface no cut is needed.
    first, second = (
        np.random.default_rng(9).uniform([-0.9, 0.7], [-0.7, 0.9], (500, 2)).T
    )
    margin = least_tilt_margin(around(on_red(first, second)), EXACT)
    assert margin.lower == pytest.approx(HALF_PI, abs=1e-12)


def test_a_loop_that_only_touches_zero_says_what_vanishes_there() -> None:
    """On red v vanishes with R, off it v does not."""
    border = EXACT.delta - HALF_PI
    red = on_red(*np.array([[border, 0.5], [border + 0.5, 0.5], [border + 0.5, 0.9]]).T)
    margin = least_tilt_margin(around(red), EXACT)
    assert (margin.upper, margin.segment, margin.fraction) == (0.0, 0, 0.0)
    assert "every attitude, at this point only" in margin.reason
    zero = brentq(
        lambda x: float(level_determinant([x, -0.4, 0.5, 0.3], EXACT)),
        0,
        0.3,
        xtol=1e-16,
    )
    steps = np.array([[0.0, 0, 0, 0], [0.1, 0, 0, 0], [0.2, 0.02, 0, 0]])
    off = np.array([zero, -0.4, 0.5, 0.3]) + steps
    margin = least_tilt_margin(around(off), EXACT)
    assert margin.upper < 1e-12
    assert "every attitude" not in margin.reason
    assert abs(level_determinant(location(off, margin), EXACT)) < 1e-12


@every_vehicle
def test_v_strays_from_its_chords_by_no_more_than_is_said(vehicle: Vehicle) -> None:
    exact = coefficients_of(vehicle, "exact")
    s = np.linspace(0.0, 1.0, 65)[:, None, None]
    for size in (1e-3, 0.1, 1.0, 4.0):
        starts = random_tilts(4, 60, reach=2)
        ends = starts + random_tilts(5, 60, reach=size)
        starts[:20, 2:], ends[:20, 2:] = starts[:20, :2], ends[:20, :2]
        v = attitude_sensitivities(starts + s * (ends - starts), exact)
        off = v - (v[0] + s * (v[-1] - v[0]))
        across, level = sensitivity_deviations(starts, ends, exact)
        slack = 1e-12 * (1 + np.abs(v).max())
        assert (np.hypot(off[..., 0], off[..., 1]).max(axis=0) <= across + slack).all()
        assert (np.abs(off[..., 2]).max(axis=0) <= level + slack).all()
        assert (across[:20] == 0).all() or exact.rotors.asymmetry


# -- The worst attitude within a tilt


@pytest.mark.parametrize("is_double", [False, True])
def test_the_least_root_is_approached_from_below(is_double: bool) -> None:
    roots = np.exp(np.random.default_rng(2).normal(size=(500, 4)))
    roots.sort(axis=1)
    if is_double:
        roots[:, 1] = roots[:, 0]
    least = roots[:, 0]
    _, *sums = np.abs(np.transpose([np.poly(four) for four in roots]))
    for steps in (1, 2, 3, 8):
        found = least_root(*sums, steps=steps)
        assert (found <= least * (1 + 1e-6)).all()
    assert (found >= least * (1 - 1e-4)).all()


def test_no_attitude_of_the_cap_is_worse_than_the_worst() -> None:
    """It is on the rim, and attains the value."""
    random = np.random.default_rng(5)
    open_ = 0
    for number in range(42):
        vehicle = random_vehicle(random) if number % 2 else EVERY_KIND[number % 7]
        alpha = random.uniform(-1.6, 1.6, 4)
        if number % 3:
            alpha[2:] = alpha[:2] + random.normal(
                0, random.choice([0.0, 1e-9, 1e-3]), 2
            )
        if number % 10 == 0:
            # Singular values that coincide, and no direction that is nearest to singular.
            alpha = random.choice([-0.5, 0.0, 1.2], 4) * (number % 20 > 0)
        tilt = float(random.choice([0.0, 1e-6, 0.01, 0.3, 1.0, 1.5]))
        value, attitude = least_singular_value_within(alpha, tilt, vehicle)
        there = float(least_singular_value(alpha, vehicle, *attitude))
        up = body_vertical(*attitude)
        if tilt_margin(alpha, coefficients_of(vehicle, "exact")) <= tilt:
            assert value == 0.0
            assert there < 1e-9
            assert math.acos(min(up[2], 1.0)) <= tilt + 1e-9
            continue
        open_ += 1
        assert value == pytest.approx(there, abs=1e-12)
        assert math.hypot(up[0], up[1]) == pytest.approx(math.sin(tilt), abs=1e-12)
        scaled = scaled_decoupling_matrix(alpha, vehicle, *cap(tilt, 11, 181))
        dense = np.linalg.svd(scaled, compute_uv=False)[..., 3].min()
        assert dense - 0.02 <= value <= dense + 1e-12
        bound = least_singular_value_within_bound(alpha[None], tilt, vehicle)[0]
        assert value - 1e-4 < bound < value
    assert 20 < open_ < 42
