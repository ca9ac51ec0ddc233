"""Regions that keep a servo margin (docs/theory.md, 22): the closed form, and errors at corners by brute force."""

from __future__ import annotations

import math
from itertools import product
from typing import TYPE_CHECKING

import numpy as np
import pytest
import shapely

import gaitgraph as gg
from gaitgraph.invertibility.error_margins import bears_servo_errors, servo_margin
from gaitgraph.invertibility.matrices import level_determinant
from gaitgraph.surface import servo_margin_region
from tests.test_error_margins import holds, some_gait, some_vehicle

if TYPE_CHECKING:
    from gaitgraph.surface.sheets import Sign

HALF_PI = math.pi / 2
CORNERS = np.array(list(product((-1.0, 1.0), repeat=4)))


@pytest.mark.parametrize("spin", ["clockwise", "counterclockwise"])
@pytest.mark.parametrize("drag_ratio", [0.06, 0.169, 0.5])
@pytest.mark.parametrize("margin", [0.12, 0.4, 0.78])
def test_without_a_floor_it_is_the_square_of_the_theory(
    margin: float, drag_ratio: float, spin: str
) -> None:
    vehicle = gg.Vehicle(drag_ratio=drag_ratio, first_rotor_spin=spin)
    side = 1 if spin == "clockwise" else -1
    delta = side * math.atan(drag_ratio)
    line = delta - side * margin, delta - side * (HALF_PI - margin)
    low, high = sorted(line)
    expected = shapely.box(low, -high, high, -low)
    region = servo_margin_region(margin, vehicle, sign="positive", floor=0.0)
    part = region.components[0]
    assert shapely.hausdorff_distance(part, expected) < 1e-9
    largest = max(region.outer.geoms, key=lambda other: other.area)
    assert shapely.hausdorff_distance(largest, expected) < 1e-9


@pytest.mark.parametrize("seed", range(6))
def test_a_point_is_inside_exactly_if_no_corner_of_its_errors_breaks_a_condition(
    seed: int,
) -> None:
    rng = np.random.default_rng(seed)
    vehicle = gg.Vehicle(drag_ratio=float(rng.uniform(0.05, 0.6)))
    if seed % 3:
        vehicle = some_vehicle(rng)
    floor = (0.0, 0.05, 0.1)[seed % 3]
    margin = float(rng.uniform(0.02, 0.3))
    sign: Sign = ("positive", "negative")[seed % 2]
    region = servo_margin_region(margin, vehicle, sign=sign, floor=floor)
    points = rng.uniform(-HALF_PI, HALF_PI, (100, 2))
    if region.components:
        left, bottom, right, top = region.outer.bounds
        near = [left - 0.02, bottom - 0.02], [right + 0.02, top + 0.02]
        points = np.vstack([points, rng.uniform(*near, (100, 2))])
    points = np.clip(points, -HALF_PI, HALF_PI)
    inside = region.contains(points)
    outside = [not region.outer.covers(shapely.Point(point)) for point in points]
    wanted = 1 if sign == "positive" else -1
    exact = gg.invertibility.coefficients_of(vehicle, "exact")
    for point, is_inside, is_outside in zip(points, inside, outside, strict=True):
        alpha = np.tile(point, 2)
        bears = wanted * float(level_determinant(alpha, exact)) > 0 and all(
            holds(vehicle, floor, alpha + margin * corner, 0.0) for corner in CORNERS
        )
        assert bears or not is_inside
        assert not (bears and is_outside)


def test_the_reason_and_the_area_follow_the_margin() -> None:
    wide, narrow = (
        gg.admissible_region(sign="positive", servo_margin=margin)
        for margin in ("5deg", "12deg")
    )
    assert shapely.covers(wide.outer, narrow.inner)
    assert narrow.why_not((0.0, 0.0)) == "servo margin must be ≥ 12°, got 8.16°"
    assert narrow.contains([[-0.5, 0.5]]).all()
    plain = gg.admissible_region(sign="positive")
    none = gg.admissible_region(sign="positive", servo_margin=0.0)
    assert none.inner.equals(plain.inner)


def test_only_what_flies_has_a_margin() -> None:
    with pytest.raises(gg.InputError, match="servo_margin must be 0 with require"):
        gg.admissible_region(require="valid", servo_margin=0.1)
    with pytest.raises(gg.InputError, match="servo_margin must be an angle from 0"):
        gg.admissible_region(servo_margin="100deg")


@pytest.mark.parametrize("seed", range(6))
def test_what_is_called_borne_is_borne_and_what_was_found_to_break_is_not(
    seed: int,
) -> None:
    rng = np.random.default_rng(seed)
    points, vehicle = None, gg.vehicle_named("paper")
    while points is None:
        vehicle = some_vehicle(rng)
        points = some_gait(vehicle, rng)
    margin = servo_margin(points, vehicle)
    assert bears_servo_errors(points, margin.proven, vehicle)
    assert margin.found is not None
    assert not bears_servo_errors(points, 1.006 * margin.found, vehicle)
    size = 0.99 * margin.found
    assert bears_servo_errors(points, size, vehicle)
    for _ in range(200):
        segment = int(rng.integers(0, len(points) - 1))
        step = points[segment + 1] - points[segment]
        at = points[segment] + rng.random() * step
        errors = (1 - 0.0051) * size * np.sign(rng.uniform(-1, 1, 4))
        assert holds(vehicle, 0.05, at + errors, 0.0)
