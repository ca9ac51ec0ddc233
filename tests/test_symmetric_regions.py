"""Regions and labels of the red sheet beside rasters of the level matrix, for half-turn symmetric vehicles of all kinds."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import shapely
from scipy.ndimage import label

from gaitgraph.angles import HALF_PI
from gaitgraph.invertibility.forms import Sines, level_of, rotors_of
from gaitgraph.surface import admissible, borders, sheets
from gaitgraph.surface.blocks import directions, roll_block, yaw_block
from gaitgraph.surface.sheets import red_label, separating_factor
from gaitgraph.vehicle import PAPER, Vehicle, vehicle_named

KINDS = (
    "any",
    "one pair raised",
    "flat",
    "equal heights",
    "opposite heights",
    "square",
)


def some_vehicle(kind: str, seed: int) -> Vehicle:
    """Return a vehicle whose pairs of arms differ in angle, length, height and drag, as far as its kind allows."""
    rng = np.random.default_rng(seed)
    lengths = rng.uniform(0.1, 1.0, 2)
    heights = rng.uniform(-1.0, 1.0, 2) * lengths.mean() * rng.choice([0.1, 1.0, 4.0])
    between = rng.uniform(0.3, math.pi - 0.3)
    if kind == "one pair raised":
        heights[rng.integers(2)] = 0.0
    if kind == "flat":
        heights[:] = 0.0
    if kind in ("equal heights", "square"):
        heights[1] = heights[0]
    if kind == "opposite heights":
        heights[1] = -heights[0]
    if kind == "square":
        between, lengths[1] = math.pi / 2, lengths[0]
    angles = rng.uniform(0, 6) + np.array([0.0, between, math.pi, math.pi + between])
    pair = [0, 1, 0, 1]
    places = np.column_stack(
        [lengths[pair] * np.cos(angles), lengths[pair] * np.sin(angles), heights[pair]]
    )
    drags = lengths.mean() * 10 ** rng.uniform(-2, 0.3, 2)
    return Vehicle(
        rotor_positions=places.tolist(),
        drag_to_thrust=drags[pair].tolist(),
        first_rotor_spin=str(rng.choice(["clockwise", "counterclockwise"])),
    )


every_vehicle = pytest.mark.parametrize(
    "vehicle",
    [some_vehicle(kind, seed) for kind in KINDS for seed in (1, 2)],
    ids=[f"{kind} {seed}" for kind in KINDS for seed in (1, 2)],
)


def red(points: Any) -> Sines:
    return Sines.of(np.asarray(points)[:, [0, 1, 0, 1]])


def assert_follows(shape: Any, holds: Any, tolerance: float) -> None:
    """Assert that a set is where it holds, and that its border is off by the tolerance at most."""
    rng = np.random.default_rng(0)
    points = [rng.uniform(-HALF_PI, HALF_PI, (2000, 2))]
    corners = shapely.get_coordinates(shape)
    if len(corners):
        middles = (corners[1:] + corners[:-1]) / 2
        for distance in (1e-7, 1e-5, 1e-3):
            some = middles[rng.integers(len(middles), size=400)]
            points.append(some + distance * rng.normal(size=some.shape))
    at = np.vstack(points)
    at = at[np.abs(at).max(axis=1) < HALF_PI]
    asked = shapely.points(at)
    true = holds(at)
    grown, shrunk = (shape.buffer(k * tolerance) for k in (1, -1))
    shapely.prepare([grown, shrunk])
    assert shapely.covers(grown, asked)[true].all()
    assert not shapely.covers(shrunk, asked)[~true].any()


@pytest.mark.parametrize("kind", KINDS)
def test_sets_follow_the_level_matrix(kind: str) -> None:
    vehicle, tolerance = some_vehicle(kind, 1), 1e-4
    level = level_of(rotors_of(vehicle))

    def least(at: Any) -> Any:
        return np.linalg.svd(level.matrix(red(at)), compute_uv=False)[:, -1]

    def shares(at: Any) -> Any:
        inputs = np.array([form.at(red(at))[0] for form in level.inputs])
        lift = level.direction.at(red(at))[2]
        return level.rotors.thrust_signs[:2] * (inputs[:2] / lift).T

    blocks = yaw_block(vehicle), roll_block(vehicle)
    largest = least(np.random.default_rng(1).uniform(-1.5, 1.5, (5000, 2))).max()
    for floor in (0.01 * largest, 0.5 * largest, 0.9 * largest):
        bands = [borders.singular_value_below(floor, one, tolerance) for one in blocks]
        band = shapely.union_all([each.around(True, 0.0) for each in bands])
        assert_follows(band, lambda at, f=floor: least(at) < f, tolerance)
    scale = 2 / level.rotors.drag_ratio
    size = np.abs(level.direction.table[..., 2]).max()
    for sign in (1, -1):
        below = borders.product_below(
            0.1 * size, sign * scale * blocks[0].form, blocks[1].form, tolerance
        )
        assert_follows(
            below.around(True, 0.0),
            lambda at, s=sign: s * level.direction.at(red(at))[2] < 0.1 * size,
            tolerance,
        )
    first, second = level.moment[:2, 2]
    for share in (0.2, 0.45, 1.0):
        above = borders.thrust_above(share, first, second, tolerance)
        assert_follows(
            above.around(True, 0.0),
            lambda at, s=share: (shares(at).min(axis=1) > 0) & (shares(at)[:, 0] > s),
            tolerance,
        )


@pytest.mark.parametrize(
    ("floor", "accuracy"), [(1e-5, 1e-4), (1e-3, 1e-2), (0.05, 0.1), (0.01, 0.01)]
)
def test_a_region_of_one_sign_is_enclosed_where_the_floor_is_small(
    floor: float, accuracy: float
) -> None:
    vehicle = vehicle_named("beetle_art")
    points = np.random.default_rng(1).uniform(-HALF_PI, HALF_PI, (4000, 2))
    level = level_of(rotors_of(vehicle))
    R = level.direction.at(red(points))[2]
    for sign, wanted in zip(sheets.SIGNS, (-1, 1), strict=True):
        region = admissible.admissible_region(
            vehicle, sign=sign, floor=floor, accuracy=accuracy
        )
        assert region.outer.buffer(1e-9).covers(region.inner)
        whole = admissible.admissible_region(vehicle, floor=floor, accuracy=1e-6)
        inside = whole.contains(points) & (wanted * R > 0)
        assert shapely.covers(region.outer, shapely.points(points[inside])).all()


@every_vehicle
def test_blue_of_exact_coefficients_has_no_sign_of_R(vehicle: Vehicle) -> None:
    for sign in sheets.SIGNS:
        assert admissible.sign_region(sign, vehicle, color="blue").outer.is_empty


@every_vehicle
def test_each_component_has_a_label_of_its_own(vehicle: Vehicle) -> None:
    """Components of a fine grid and labels are the same, small components apart; the sides of the square are fine."""
    level, count = level_of(rotors_of(vehicle)), 401
    axis = -HALF_PI * np.cos(math.pi * (np.arange(count) + 0.5) / count)
    u = directions(axis)
    signs = [u.T @ block(vehicle).form @ u > 0 for block in (yaw_block, roll_block)]
    labels = red_label(axis[:, None], axis[None, :], vehicle)
    plane = np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1).reshape(-1, 2)
    R = level.direction.at(red(plane))[2].reshape(count, count)
    clear = np.abs(R) > 1e-12 * np.abs(R).max()
    assert (labels.prod(axis=-1) == np.sign(R))[clear].all()
    assert red_label(0.0, 0.0, vehicle).tolist() == [1, 1, 1]
    codes, found = labels @ [9, 3, 1], []
    for sides in ((True, True), (True, False), (False, True), (False, False)):
        parts, number = label((signs[0] == sides[0]) & (signs[1] == sides[1]))
        for part in range(1, number + 1):
            inside = parts == part
            if inside.sum() > 40:
                assert len(np.unique(codes[inside])) == 1
                found.append(int(codes[inside][0]))
    assert len(found) == len(set(found))


@every_vehicle
def test_sides_of_R_are_told_in_words(vehicle: Vehicle) -> None:
    rng = np.random.default_rng(3)
    for first, second in rng.uniform(-1.5, 1.5, (20, 2, 2)).tolist():
        same = (
            red_label(first[0], first[1], vehicle).tolist()
            == red_label(second[0], second[1], vehicle).tolist()
        )
        words = separating_factor(first, second, vehicle)
        assert (words is None) == same
        assert words is None or "the curve" in words or "the line" in words


def test_regions_of_a_sign_fill_the_square_with_a_rotor_height() -> None:
    vehicle = PAPER.replace(rotor_height=0.05)
    regions = [admissible.sign_region(s, vehicle) for s in ("positive", "negative")]
    areas = [region.area for region in regions]
    assert sum(areas) == pytest.approx(math.pi**2, abs=1e-4)
    assert max(np.abs(region.outer.bounds).max() for region in regions) <= HALF_PI
    # The pole of the curve P = 0 as a function of α1 is no border.
    assert [len(region.components) for region in regions] == [2, 2]
