"""How wrong servos and drags may be (docs/theory.md, 22): formulas, random errors, and matrices of their own."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

import gaitgraph as gg
from gaitgraph.invertibility.error_margins import ErrorMargin, drag_margin, servo_margin
from gaitgraph.invertibility.forms import Sines, level_of, rotors_of
from gaitgraph.vehicle import PAPER, Vehicle

HALF_PI = math.pi / 2


def square(drag_ratio: float) -> Vehicle:
    return dataclasses.replace(
        PAPER, drag_ratio=drag_ratio, drag_coefficient=None, drag_to_thrust=None
    )


def closed(points: Any) -> Any:
    return np.vstack([points, points[:1]])


def thrusts_and_least(vehicle: Vehicle, alpha: Any, drag_error: Any) -> tuple[Any, Any]:
    """Return hover thrusts in units of m·g and the least singular value, from places, drags and spins alone."""
    rotors = rotors_of(vehicle)
    places = np.array(rotors.positions)
    tilt_axes = places * [1.0, 1.0, 0.0]
    tilt_axes /= np.linalg.norm(tilt_axes, axis=1, keepdims=True)
    up = np.array([0.0, 0.0, 1.0])
    thrust = np.cos(alpha)[:, None] * up
    thrust = thrust + np.sin(alpha)[:, None] * np.cross(tilt_axes, up)
    drags = np.array(rotors.drags) * (1 + drag_error) * rotors.thrust_signs
    moment = np.cross(places, thrust) - drags[:, None] * thrust
    matrix = np.column_stack([moment, thrust[:, 2]]).T
    least = np.linalg.svd(matrix, compute_uv=False)[-1]
    return np.linalg.solve(matrix, [0, 0, 0, 1.0]), least


def holds(vehicle: Vehicle, floor: float, alpha: Any, drag_error: Any) -> bool:
    thrusts, least = thrusts_and_least(vehicle, alpha, drag_error)
    most = vehicle.thrust_share or math.inf
    return bool(least >= floor and thrusts.min() > 0 and thrusts.max() <= most)


def place_of(points: Any, margin: ErrorMargin) -> Any:
    start = points[margin.segment]
    end = points[min(margin.segment + 1, len(points) - 1)]
    return start + margin.fraction * (end - start)


def some_vehicle(rng: np.random.Generator) -> Vehicle:
    """Return a vehicle that a half turn maps to itself."""
    (x1, x2), (y1, y2) = rng.uniform(0.1, 0.3, (2, 2))
    z1, z2 = rng.choice([0.0, 0.04, -0.06], 2)
    places = [[x1, y1, z1], [-x2, y2, z2], [-x1, -y1, z1], [x2, -y2, z2]]
    return Vehicle(
        name="some",
        mass=1.0,
        rotor_positions=places,
        drag_to_thrust=float(rng.uniform(0.01, 0.05)),
        max_thrust=float(rng.choice([4.0, 5.0, 8.0])),
        first_rotor_spin=str(rng.choice(["clockwise", "counterclockwise"])),
    )


def some_gait(vehicle: Vehicle, rng: np.random.Generator) -> Any:
    """Return the corners of a flyable gait, closed; None if none is found."""
    region = gg.admissible_region(vehicle)
    if not region.components:
        return None
    left, bottom, right, top = region.components[0].bounds
    tried = rng.uniform([left, bottom], [right, top], (500, 2))
    inside = [point for point in tried if region.component_of(point) == 0][:4]
    plan = gg.plan_loop(inside, vehicle=vehicle) if inside else None
    return closed(plan.gait.alpha) if plan else None


@pytest.mark.parametrize("seed", range(40))
def test_square_vehicles_have_the_formula_of_corners(seed: int) -> None:
    rng = np.random.default_rng(seed)
    vehicle = square(float(rng.uniform(0.05, 0.6)))
    delta = math.atan(vehicle.drag_ratio)
    count = int(rng.integers(1, 7))
    beta = rng.uniform(0, HALF_PI, (count, 2)) * [-1, 1]
    alpha = np.hstack([beta + np.array([delta, -delta])] * 2)
    margin = servo_margin(closed(alpha), vehicle, floor=0.0, tolerance=1e-9)
    expected = np.minimum(np.abs(beta), HALF_PI - np.abs(beta)).min()
    assert margin.proven == pytest.approx(expected, abs=2e-9)
    assert margin.found == pytest.approx(expected, abs=2e-9)


@pytest.mark.parametrize("seed", range(10))
def test_postures_off_the_sheet_have_the_formula_of_facets(seed: int) -> None:
    rng = np.random.default_rng(seed)
    vehicle = square(float(rng.uniform(0.05, 0.6)))
    delta = math.atan(vehicle.drag_ratio)
    while True:
        beta = rng.uniform(-HALF_PI, HALF_PI, 4)
        if beta[0] + beta[2] < 0 < beta[1] + beta[3]:
            break
    facets = [*(HALF_PI - np.abs(beta)), -(beta[0] + beta[2]) / 2]
    expected = min(*facets, (beta[1] + beta[3]) / 2)
    alpha = beta + np.array([delta, -delta, delta, -delta])
    margin = servo_margin(alpha[None], vehicle, floor=0.0, tolerance=1e-9)
    assert margin.proven == pytest.approx(expected, abs=2e-9)


@pytest.mark.parametrize("beta", [0.2, 0.7, 1.1])
def test_lift_limits_the_other_quadrant(beta: float) -> None:
    delta = math.atan(PAPER.drag_ratio)
    alpha = np.array([[beta + delta, -beta - delta] * 2])
    margin = servo_margin(alpha, PAPER, floor=0.0, tolerance=1e-9)
    expected = max(min(beta, HALF_PI - delta - beta), 0.0)
    assert margin.proven <= expected + 1e-9
    if beta < 0.5:
        assert margin.proven == pytest.approx(expected, abs=2e-9)


@pytest.mark.parametrize("spin", ["clockwise", "counterclockwise"])
@pytest.mark.parametrize("drag_ratio", [0.06, 0.17, 0.5])
def test_hover_bears_the_angle_of_the_drag_and_the_best_posture_45_degrees(
    drag_ratio: float, spin: str
) -> None:
    vehicle = dataclasses.replace(square(drag_ratio), first_rotor_spin=spin)  # type: ignore[arg-type]
    side = 1 if spin == "clockwise" else -1
    delta = math.atan(drag_ratio)
    for tilt, expected in ((0.0, delta), (math.pi / 4 - delta, math.pi / 4)):
        posture = side * np.array([[-tilt, tilt] * 2])
        margin = servo_margin(posture, vehicle, floor=0.0, tolerance=1e-6)
        assert margin.found == pytest.approx(expected, abs=2e-8)
        # At 45° R and the thrusts vanish at one corner together, so that rounding decides there.
        assert margin.proven == pytest.approx(expected, rel=2e-3)


def test_margins_of_gait_4_are_those_of_the_theory() -> None:
    gait = gg.gait_of("gait4").alpha
    delta = math.atan(PAPER.drag_ratio)
    with_floor = servo_margin(closed(gait), PAPER)
    without = servo_margin(closed(gait), PAPER, floor=0.0)
    moved = gait + np.array([delta, -delta, delta, -delta])
    of_moved = servo_margin(closed(moved), PAPER, floor=0.0)
    found = [margin.found or 0.0 for margin in (with_floor, without, of_moved)]
    assert np.degrees(found) == pytest.approx([10.93, 12.93, 22.5], abs=0.01)
    assert math.degrees(with_floor.proven) > 10.5
    assert "singular value" in with_floor.reason
    assert "not positive" in without.reason


@pytest.mark.parametrize("kind", ["servo", "drag"])
@pytest.mark.parametrize("seed", range(6))
def test_no_errors_within_the_margin_break_a_condition_and_the_found_ones_do(
    seed: int, kind: str
) -> None:
    rng = np.random.default_rng(seed)
    points, vehicle = None, PAPER
    while points is None:
        vehicle = some_vehicle(rng)
        points = some_gait(vehicle, rng)
    floor = (0.0, 0.05, 0.1)[seed % 3]
    search = {"servo": servo_margin, "drag": drag_margin}[kind]
    margin = search(points, vehicle, floor=floor)
    moves = np.array([kind == "servo", kind == "drag"])[:, None]

    for _ in range(400):
        segment = int(rng.integers(0, len(points) - 1))
        share = float(rng.choice([0.0, rng.random()]))
        at = points[segment] + share * (points[segment + 1] - points[segment])
        errors = rng.uniform(-1, 1, 4)
        if rng.random() < 0.6:
            errors = np.sign(errors)
        angle, drag = (1 - 1e-9) * margin.proven * errors * moves
        assert holds(vehicle, floor, at + angle, drag)
    if margin.found is None:
        assert margin.proven == 1.0
        return
    assert margin.proven <= margin.found < margin.proven / 0.8
    assert np.abs(margin.errors) == pytest.approx([margin.found] * 4)
    angle, drag = margin.errors * (1 + 1e-9) * moves
    assert not holds(vehicle, floor, place_of(points, margin) + angle, drag)


def test_more_rows_of_the_same_gait_change_nothing() -> None:
    gait = closed(gg.gait_of("gait3").alpha)
    rows = np.linspace(0, len(gait) - 1, 1001)
    finer = np.column_stack(
        [np.interp(rows, np.arange(len(gait)), column) for column in gait.T]
    )
    one, two = (servo_margin(points, PAPER) for points in (gait, finer))
    assert two.proven == pytest.approx(one.proven, rel=0.02)
    assert two.found == pytest.approx(one.found, rel=0.02)


@pytest.mark.parametrize("search", [servo_margin, drag_margin])
def test_what_cannot_fly_without_errors_bears_none(search: Any) -> None:
    margin = search(closed(gg.gait_of("gait1").alpha), PAPER)
    assert (margin.proven, margin.found) == (0.0, 0.0)
    assert margin.reason


def test_robustness_tells_both_margins() -> None:
    report = gg.robustness_of("gait4", bias=0.8, floor=0.1)
    plain = report.as_mapping()
    servo, drag = (
        search(closed(gg.gait_of("gait4").alpha), PAPER, floor=0.1)
        for search in (servo_margin, drag_margin)
    )
    assert plain["servo_margin_deg"] == pytest.approx(math.degrees(servo.proven))
    assert plain["servo_margin_found_deg"] == pytest.approx(
        math.degrees(servo.found or 0.0)
    )
    assert plain["drag_margin"] == pytest.approx(drag.proven)
    assert plain["drag_margin_found"] == drag.found
    assert plain["biased"]["servo_margin_deg"] > 0
    assert "errors of the servos up to 8.1°; with 9.0°" in str(report)


def test_zero_moment_inputs_have_the_signs_of_the_theory() -> None:
    rng = np.random.default_rng(1)
    alpha = rng.uniform(-HALF_PI, HALF_PI, (200, 4))
    delta = math.atan(PAPER.drag_ratio)
    b1, b2, b3, b4 = (alpha - np.array([delta, -delta, delta, -delta])).T
    level = level_of(rotors_of(PAPER))
    inputs = level.inputs_at(Sines.of(alpha)) * level.rotors.thrust_signs[:, None]
    first, second = np.sin(b2 + b4), -np.sin(b1 + b3)
    expected = [
        first * np.cos(b3),
        second * np.cos(b4),
        first * np.cos(b1),
        second * np.cos(b2),
    ]
    assert np.array_equal(np.sign(inputs), np.sign(expected))
