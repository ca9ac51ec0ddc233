"""How wrong servos and drags may be (docs/theory.md, 19): formulas, random errors, and matrices of their own.

A few random gaits by default; ``CASES=1000 pytest tests/test_error_margins.py`` takes as many.
"""

from __future__ import annotations

import math
import time
from typing import Any

import numpy as np
import pytest

import gaitgraph as gg
from gaitgraph.invertibility.error_margins import ErrorMargin, drag_margin, servo_margin
from gaitgraph.vehicle import PAPER, Vehicle
from tests.samples import HALF_PI, seeds, symmetric_vehicle
from tests.test_invertibility_matrices import wrench

SEARCHES = {"servo": servo_margin, "drag": drag_margin}


def closed(points: Any) -> Any:
    return np.vstack([points, points[:1]])


def some_vehicle(rng: np.random.Generator) -> Vehicle:
    return symmetric_vehicle(rng).replace(max_thrust=float(rng.choice([4.0, 8.0])))


def some_gait(vehicle: Vehicle, rng: np.random.Generator, floor: float = 0.05) -> Any:
    """Return the corners of a gait on red near hover, closed; None if it cannot fly."""
    corners = rng.uniform(-0.5, 0.5, 2) + rng.uniform(-0.2, 0.2, (4, 2))
    points = closed(np.tile(corners, 2))
    return points if servo_margin(points, vehicle, floor=floor).proven else None


def reserve(vehicle: Vehicle, floor: float, alpha: Any, drag_errors: Any) -> Any:
    """Return how far level flight is from being impossible, negative if it is, from places, drags and spins, (k,)."""
    alpha = np.atleast_2d(alpha)
    drags = np.array(vehicle.scaled_drags) * vehicle.spin_signs
    places, axes = vehicle.scaled_positions, vehicle.axes
    force, lever = wrench(places, np.zeros(4), *axes, alpha)
    moment = lever - (drags * (1 + np.atleast_2d(drag_errors)))[:, None] * force
    matrix = np.concatenate([moment, force[:, 2:]], axis=1)
    least = np.linalg.svd(matrix, compute_uv=False)[:, -1]
    thrusts = np.linalg.solve(matrix, np.eye(4)[3][:, None])[..., 0]
    most = vehicle.thrust_share or math.inf
    reserves = [least - floor, thrusts.min(axis=1), most - thrusts.max(axis=1)]
    return np.min(reserves, axis=0)


def place_of(points: Any, margin: ErrorMargin) -> Any:
    start = points[margin.segment]
    end = points[min(margin.segment + 1, len(points) - 1)]
    return start + margin.fraction * (end - start)


@pytest.mark.parametrize("seed", seeds(6))
def test_square_vehicles_have_the_formula_of_corners_and_facets(seed: int) -> None:
    """Of a gait on red in the quadrant of hover the corners decide, of a posture off it the facets."""
    rng = np.random.default_rng(seed)
    kappa = float(rng.uniform(0.05, 0.6))
    vehicle, delta = Vehicle(drag_ratio=kappa), math.atan(kappa)
    middle = delta * np.array([1, -1, 1, -1])
    count = int(rng.integers(1, 7))
    beta = np.tile(rng.uniform(0, HALF_PI, (count, 2)) * [-1, 1], 2)
    margin = servo_margin(closed(beta + middle), vehicle, floor=0.0, tolerance=1e-10)
    expected = np.minimum(np.abs(beta), HALF_PI - np.abs(beta)).min()
    assert margin.proven == pytest.approx(expected, abs=1e-9)
    assert margin.found == pytest.approx(expected, abs=1e-9)

    b1, b2 = rng.uniform([-HALF_PI, 0], [0, HALF_PI])
    b3, b4 = rng.uniform([-HALF_PI, -b2], [-b1, HALF_PI])
    posture = np.array([[b1, b2, b3, b4]])
    facets = [*(HALF_PI - np.abs(posture[0])), -(b1 + b3) / 2, (b2 + b4) / 2]
    margin = servo_margin(posture + middle, vehicle, floor=0.0, tolerance=1e-10)
    assert margin.proven == pytest.approx(min(facets), abs=1e-9)


@pytest.mark.parametrize("beta", [0.2, 0.7, 1.1])
def test_lift_limits_the_other_quadrant(beta: float) -> None:
    delta = math.atan(PAPER.drag_ratio)
    alpha = np.array([[beta + delta, -beta - delta] * 2])
    margin = servo_margin(alpha, PAPER, floor=0.0, tolerance=1e-9)
    expected = max(min(beta, HALF_PI - delta - beta), 0.0)
    assert margin.proven <= expected + 1e-9
    assert margin.proven == pytest.approx(expected, abs=2e-9) or beta > 0.5


@pytest.mark.parametrize("kind", SEARCHES)
# Seed 901: rounding hides the condition at the found size of drag errors itself.
@pytest.mark.parametrize("seed", sorted({*seeds(4), 901}))
def test_no_errors_within_the_margin_break_a_condition_and_the_found_ones_do(
    seed: int, kind: str
) -> None:
    rng, floor = np.random.default_rng(seed), (0.0, 0.05, 0.1)[seed % 3]
    points = None
    while points is None:
        vehicle = some_vehicle(rng)
        points = some_gait(vehicle, rng, floor)
    begin = time.process_time()
    margin = SEARCHES[kind](points, vehicle, floor=floor)
    assert time.process_time() - begin < 2.0

    def left(places: Any, errors: Any) -> Any:
        if kind == "servo":
            return reserve(vehicle, floor, places + errors, np.zeros(4))
        return reserve(vehicle, floor, places, errors)

    def left_within(trials: Any) -> Any:
        segment = np.minimum(trials[:, 0].astype(int), len(points) - 2)
        share = (trials[:, 0] - segment)[:, None]
        places = points[segment] * (1 - share) + points[segment + 1] * share
        return left(places, (1 - 1e-9) * margin.proven * trials[:, 1:])

    # Corners of the gait and places between them; corners of the box of errors and errors inside it.
    low, high = np.array([[0, len(points) - 1], *[[-1, 1]] * 4]).T
    trials = rng.uniform(low, high, (400, 5))
    trials[::2, 0] = np.rint(trials[::2, 0])
    trials[:240, 1:] = np.sign(trials[:240, 1:])
    reserves = left_within(trials)
    # The worst of them is made worse, by random steps of falling size.
    for size in np.geomspace(0.5, 1e-4, 12):
        worst = trials[reserves.argmin()]
        steps = size * rng.normal(0, 1, (60, 5)) * (high - low) / 2
        trials = np.clip(np.vstack([worst, worst + steps]), low, high)
        reserves = left_within(trials)
    assert reserves.min() > 0
    if margin.found is None:
        assert margin.proven == 1.0
        return
    assert margin.proven <= margin.found < margin.proven / 0.8
    assert np.abs(margin.errors) == pytest.approx([margin.found] * 4)
    assert left(place_of(points, margin), margin.errors * (1 + 1e-9)) < 0


def test_more_rows_of_the_same_gait_change_nothing() -> None:
    gait = closed(gg.gait_of("gait3").alpha)
    rows = np.linspace(0, len(gait) - 1, 1001)
    columns = [np.interp(rows, np.arange(len(gait)), column) for column in gait.T]
    coarse, fine = (
        servo_margin(points, PAPER) for points in (gait, np.transpose(columns))
    )
    assert fine.proven == pytest.approx(coarse.proven, rel=0.02)
    assert fine.found == pytest.approx(coarse.found, rel=0.02)


@pytest.mark.parametrize(
    ("gait", "floor", "reason"),
    [("gait4", 0.05, "singular value"), ("gait4", 0.0, "not positive")],
)
def test_the_reason_names_the_condition(gait: str, floor: float, reason: str) -> None:
    assert (
        reason
        in servo_margin(closed(gg.gait_of(gait).alpha), PAPER, floor=floor).reason
    )


@pytest.mark.parametrize("search", SEARCHES.values())
def test_what_cannot_fly_without_errors_bears_none(search: Any) -> None:
    margin = search(closed(gg.gait_of("gait1").alpha), PAPER)
    assert (margin.proven, margin.found) == (0.0, 0.0)
    assert margin.reason
