"""Regions as polygons: inside and enclosing the truth, separated by factors, and the questions that they answer."""

from __future__ import annotations

import math
import re
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import shapely
from hypothesis import given, settings, strategies as st
from scipy.ndimage import label as connected

import gaitgraph as gg
from gaitgraph.angles import HALF_PI
from gaitgraph.errors import InputError
from gaitgraph.gait.gait import lift
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.invertibility.error_margins import bears_servo_errors, servo_margin
from gaitgraph.invertibility.forms import rotors_of
from gaitgraph.invertibility.matrices import (
    hover_thrust_shares,
    least_singular_value,
    level_determinant,
    level_determinant_resolution,
    noise_of,
)
from gaitgraph.invertibility.segment_bounds import least_level_determinant
from gaitgraph.surface import servo_margin_region
from gaitgraph.surface.admissible import admissible_region, why_empty
from gaitgraph.surface.blocks import directions, roll_block, yaw_block
from gaitgraph.surface.flight_regions import (
    QUARTERS,
    hover_quarter_of,
    hover_region,
    singular_value_region,
    thrust_region,
)
from gaitgraph.surface.red_components import HOVER_LABEL, red_label, separating_factor
from gaitgraph.surface.region import Region, Zones, zones_region
from gaitgraph.surface.sheets import SIGNS, sheet_angles
from gaitgraph.surface.sign_regions import certain_determinant, sign_region
from gaitgraph.vehicle import PAPER, Vehicle, vehicle_named
from tests.samples import EXACT, PUBLISHED
from tests.test_error_margins import (
    reserve,
    some_gait,
    some_vehicle as some_servo_vehicle,
)

if TYPE_CHECKING:
    from gaitgraph.surface.sheets import Sign

FloatArray = Any
WANTED = {"negative": -1.0, "positive": 1.0}


def some_vehicle(kind: str, seed: int) -> Vehicle:
    """Return a vehicle whose pairs of arms differ in angle, length, height and drag, as far as its kind allows."""
    rng = np.random.default_rng(seed)
    lengths = rng.uniform(0.1, 1.0, 2)
    heights = rng.uniform(-1.0, 1.0, 2) * lengths.mean() * rng.choice([0.1, 1.0, 4.0])
    heights *= {"one pair raised": [1, 0], "flat": [0, 0]}.get(kind, [1, 1])
    if kind in ("equal heights", "opposite heights"):
        heights[1] = heights[0] * (1 if kind == "equal heights" else -1)
    turn = rng.uniform(0, 6) + np.array([0.0, rng.uniform(0.3, math.pi - 0.3)])
    angles = np.append(turn, turn + math.pi)
    pair = [0, 1, 0, 1]
    places = [
        lengths[pair] * np.cos(angles),
        lengths[pair] * np.sin(angles),
        heights[pair],
    ]
    drags = lengths.mean() * 10 ** rng.uniform(-2, 0.3, 2)
    return Vehicle(
        name=kind,
        rotor_positions=np.transpose(places).tolist(),
        drag_to_thrust=drags[pair].tolist(),
        first_rotor_spin=str(rng.choice(["clockwise", "counterclockwise"])),
    )


KINDS = ("any", "one pair raised", "flat", "equal heights", "opposite heights")
SQUARE = [
    Vehicle(name="light", drag_ratio=0.01),
    PAPER.replace(name="mirrored", first_rotor_spin="counterclockwise"),
    PAPER,
    Vehicle(name="strong", drag_ratio=0.8, first_rotor_spin="counterclockwise"),
    Vehicle(name="heavy", drag_ratio=1.5),
]
OF_EACH_KIND = [some_vehicle(kind, seed) for seed, kind in enumerate(KINDS)]
ALL = [SQUARE[1], SQUARE[4], *OF_EACH_KIND]


def every(vehicles: list[Vehicle]) -> Any:
    return pytest.mark.parametrize("vehicle", vehicles, ids=lambda one: one.name)


def red(points: Any) -> FloatArray:
    return np.asarray(points)[:, [0, 1, 0, 1]]


# Inner and outer borders


def points_near(region: Region, seed: int) -> FloatArray:
    """Return points all over the square, and on both sides of the borders at distances from 1e-7 to 1e-3."""
    rng = np.random.default_rng(seed)
    points = [rng.uniform(-HALF_PI, HALF_PI, (1500, 2))]
    for shape in (region.inner, region.outer):
        corners = shapely.get_coordinates(shape)
        for distance in (1e-7, 1e-6, 1e-5, 1e-3) if len(corners) else ():
            some = corners[rng.integers(len(corners), size=200)]
            points.append(some + distance * rng.normal(size=some.shape))
    return np.clip(np.vstack(points), -HALF_PI, HALF_PI)


def assert_encloses(region: Region, margin: Any, rounding: float = 1e-12) -> None:
    """Assert inner ⊆ {margin ≥ 0} ⊆ outer at many points near the borders."""
    near = points_near(region, seed=0)
    value, shapes = margin(near), shapely.points(near)
    inside = shapely.covers(region.inner, shapes)
    enclosed = shapely.covers(region.outer, shapes)
    assert value[inside].min(initial=np.inf) > -rounding
    assert value[~enclosed].max(initial=-np.inf) < rounding
    assert region.inner.is_valid
    assert region.outer.is_valid


@pytest.mark.no_cover
@every(ALL)
def test_regions_of_a_least_singular_value_enclose_the_truth(vehicle: Vehicle) -> None:
    at = np.random.default_rng(1).uniform(-HALF_PI, HALF_PI, (5000, 2))
    largest = least_singular_value(red(at), vehicle).max()
    for share, accuracy in ((0.03, 1e-4), (0.5, 1e-3), (0.95, 1e-5)):
        floor = float(share * largest)
        region = singular_value_region(floor, vehicle, accuracy=accuracy)
        assert_encloses(
            region, lambda at, f=floor: least_singular_value(red(at), vehicle) - f
        )
    assert singular_value_region(1.1 * largest, vehicle).inner.is_empty


@pytest.mark.no_cover
@every(ALL)
def test_regions_of_hover_thrusts_enclose_the_truth(vehicle: Vehicle) -> None:
    def margin(at: Any, share: float | None, least: float) -> Any:
        thrusts = hover_thrust_shares(red(at), vehicle)
        low = np.nan_to_num(thrusts.min(axis=1), nan=-1.0) - least
        if share is None:
            return low
        high = np.nan_to_num(thrusts.max(axis=1), nan=99.0)
        return np.minimum(low, share - high)

    assert_encloses(hover_region(vehicle), lambda at: margin(at, None, 0.0))
    for share, least in ((0.26, 0.0), (0.7, 0.1), (None, 1.0)):
        region = thrust_region(share, vehicle, least=least)
        # Next to the corner (δ, −δ) all thrusts are ratios of vanishing numbers.
        assert_encloses(
            region, lambda at, s=share, m=least: margin(at, s, m), rounding=1e-7
        )


@pytest.mark.no_cover
@every(ALL)
@pytest.mark.parametrize("sign", SIGNS)
def test_regions_of_a_sign_and_a_least_determinant_enclose_the_truth(
    vehicle: Vehicle, sign: Sign
) -> None:
    exact = coefficients_of(vehicle, "exact")
    size = float(exact.form.size[2])
    for share in (0.0, 1e-4, 0.1):
        region = sign_region(sign, vehicle, least=share * size, accuracy=1e-5)

        def margin(at: Any, share: float = share) -> Any:
            return WANTED[sign] * level_determinant(red(at), exact) / size - share

        assert_encloses(region, margin)
    assert sign_region(sign, vehicle, color="blue", coefficients=exact).outer.is_empty


@pytest.mark.parametrize("sign", SIGNS)
def test_blue_region_is_where_rounding_left_a_sign(sign: Sign) -> None:
    def margin(at: Any) -> Any:
        opposite = sheet_angles("blue", at[:, 0], at[:, 1], PUBLISHED)
        R = level_determinant(np.column_stack([at, *opposite]), PUBLISHED)
        return WANTED[sign] * R - noise_of(PUBLISHED)

    region = sign_region(sign, color="blue", accuracy=1e-5)
    assert_encloses(region, margin, rounding=1e-13)
    wrap = 2 * PUBLISHED.delta - HALF_PI
    for part in region.components:
        left, bottom, right, top = part.bounds
        assert not left < wrap < right
        assert not bottom < -wrap < top


def test_nothing_flies_on_blue_and_each_question_is_answered() -> None:
    blue = admissible_region(color="blue")
    here = (0.3, 0.3)
    assert blue.nearest(here) is None
    assert blue.component_of(here) is None
    assert blue.nearest_joined([here]) == ()
    assert "singular" in (blue.why_not(here) or "")
    assert "an invertible decoupling matrix" in why_empty(blue, 0.05, PAPER)


def test_borders_that_lie_closer_than_the_accuracy() -> None:
    band = singular_value_region(3e-7)
    assert_encloses(band, lambda at: least_singular_value(red(at)) - 3e-7, 1e-15)
    assert len(band.components) == 7
    assert singular_value_region(0.0).area == pytest.approx(math.pi**2, abs=1e-12)
    # Two limits of thrust: together their errors left no gap.
    vehicle = SQUARE[1]
    region = thrust_region(0.26, vehicle, accuracy=1e-5)
    delta = math.atan(vehicle.signed_drag_ratio)
    at = np.array([delta - 0.11111693, -delta + 0.11111553])
    assert hover_thrust_shares(red(at[None]), vehicle).max() < 0.26
    assert region.outer.covers(shapely.Point(at))


MADE: dict[str, Any] = {
    "singular value": lambda accuracy: singular_value_region(0.5, accuracy=accuracy),
    "thrust": lambda accuracy: thrust_region(0.6, accuracy=accuracy),
    "R": lambda accuracy: sign_region("negative", least=0.5, accuracy=accuracy),
    "blue": lambda accuracy: sign_region("positive", color="blue", accuracy=accuracy),
}


@pytest.mark.parametrize(
    ("name", "accuracy", "corners"),
    [
        ("singular value", 1e-2, 119),
        ("singular value", 1e-7, 5561),
        ("thrust", 1e-5, 520),
        ("R", 1e-5, 2217),
        ("blue", 1e-5, 1281),
    ],
)
def test_inner_and_outer_are_as_near_as_stated_with_few_corners(
    name: str, accuracy: float, corners: int
) -> None:
    region = MADE[name](accuracy)
    points = shapely.get_coordinates(region.outer)
    some = shapely.points(points[:: max(len(points) // 300, 1)])
    # Both are within the accuracy of the true border, and farther apart only in corners, sharp ones of R.
    most = 2.5 if name == "R" else 1.7
    assert accuracy / 2 < shapely.distance(region.inner, some).max() < most * accuracy
    assert region.accuracy == accuracy
    assert len(points) == pytest.approx(corners, rel=0.05)


def flat(turn: float, drag: float, arm: float = 0.3) -> Vehicle:
    """A flat frame whose second pair of rotors is `turn` beyond a right angle from the first."""
    second = (-arm * math.sin(turn), arm * math.cos(turn), 0.0)
    places = [(arm, 0.0, 0.0), second]
    opposite = [(-x, -y, z) for x, y, z in places]
    return Vehicle(rotor_positions=[*places, *opposite], drag_to_thrust=drag)


# Where a border nearly is a product of a function of each angle, its rounded corner was drawn square, up to 29 % below
# the floor; where its zeros nearly meet, the outer polygon missed what is admissible by twelve times the accuracy.
@pytest.mark.parametrize(
    ("vehicle", "floor"),
    [
        (flat(0.7, 30.0), 0.05),
        (flat(0.7, 1.0), 2e-3),
        (flat(0.7, 0.1), 5e-4),
        *[
            (flat(turn, 0.05), floor)
            for turn in (1e-8, 1e-5, 1e-2)
            for floor in (0.05, 1e-3)
        ],
        (
            Vehicle(
                rotor_positions=[
                    (-0.09208265881237944, -0.19781050328098718, 0.0),
                    (0.029947101506344442, -0.041913284688984656, 0.08413659744152144),
                    (0.09208265881237944, 0.19781050328098718, 0.0),
                    (-0.029947101506344442, 0.041913284688984656, 0.08413659744152144),
                ],
                drag_to_thrust=[0.3712327583685698, 0.8929049142826571] * 2,
            ),
            1e-3,
        ),
    ],
)
def test_borders_that_nearly_are_products_or_meet(
    vehicle: Vehicle, floor: float
) -> None:
    region = singular_value_region(floor, vehicle)
    corners = shapely.get_coordinates(region.inner)
    assert least_singular_value(red(corners), vehicle).min() >= floor * (1 - 1e-9)
    around = shapely.get_coordinates(region.outer.buffer(1e-9).boundary)
    inside = np.abs(around).max(axis=1) < HALF_PI
    beyond = least_singular_value(red(around[inside]), vehicle)
    assert beyond.max() < floor + 1e-6 * floor**0.5 + 1e-6
    assert len(corners) < 20_000


@pytest.mark.parametrize("vehicle", SQUARE)
def test_a_quarter_is_its_part_of_the_region(vehicle: Vehicle) -> None:
    whole = admissible_region(vehicle, sign="negative")
    parts = [
        admissible_region(vehicle, sign="negative", quarter=quarter)
        for quarter in QUARTERS
    ]
    for shape in ("inner", "outer"):
        drawn = shapely.union_all([getattr(part, shape) for part in parts])
        assert drawn.equals(getattr(whole, shape))
    corners = [(-HALF_PI, HALF_PI), (HALF_PI, -HALF_PI)]
    for quarter, part, corner in zip(QUARTERS, parts, corners, strict=True):
        points = [corner, *part.inner.representative_point().coords]
        assert hover_quarter_of(points, vehicle) == quarter
    assert hover_quarter_of(corners, vehicle) is None
    with pytest.raises(InputError, match="quarter"):
        admissible_region(vehicle, quarter="upper")  # type: ignore[arg-type]


# Components and labels


@pytest.mark.no_cover
@every(SQUARE)
@settings(deadline=None, max_examples=30)
@given(ends=st.lists(st.floats(-HALF_PI, HALF_PI), min_size=4, max_size=4))
def test_points_joined_without_a_singular_matrix_have_one_label(
    vehicle: Vehicle, ends: list[float]
) -> None:
    exact = coefficients_of(vehicle, "exact")
    first, second = ends[:2], ends[2:]
    start, end = red([first]), red([second])
    R = float(level_determinant(start[0], exact))
    sign = math.copysign(1.0, R)
    least = least_level_determinant(start, end, exact, sign=sign, tolerance=1e-6)
    label, other = (red_label(at[0], at[1], vehicle).tolist() for at in (first, second))
    assert math.prod(label) == sign or abs(R) < 1e-9
    assert label == other or least.worst()[0] <= 1e-9
    words = separating_factor(first, second, vehicle)
    assert (words is None) == (label == other)
    assert words is None or "the curve" in words or "the line" in words


@every(ALL)
def test_components_of_a_grid_and_labels_are_the_same(vehicle: Vehicle) -> None:
    """Small components apart; the sides of the square are fine."""
    count = 401
    axis = -HALF_PI * np.cos(math.pi * (np.arange(count) + 0.5) / count)
    first, second = np.meshgrid(axis, axis, indexing="ij")
    labels = red_label(first, second, vehicle)
    alpha = np.stack([first, second, first, second], axis=-1)
    R = level_determinant(alpha, coefficients_of(vehicle, "exact"))
    clear = np.abs(R) > 1e-12 * np.abs(R).max()
    np.testing.assert_array_equal(labels.prod(axis=-1)[clear], np.sign(R)[clear])
    assert tuple(red_label(0.0, 0.0, vehicle).tolist()) == HOVER_LABEL == (1, 1, 1)
    codes, u = labels @ [9, 3, 1], directions(axis)
    yaw, roll = (
        u.T @ block(rotors_of(vehicle)).form @ u > 0
        for block in (yaw_block, roll_block)
    )
    of_parts: list[int] = []
    for sides in product((True, False), repeat=2):
        parts, number = connected((yaw == sides[0]) & (roll == sides[1]))
        for part in range(1, number + 1):
            inside = codes[parts == part]
            if len(inside) > 40:
                assert len(np.unique(inside)) == 1
                of_parts.append(int(inside[0]))
    assert len(set(of_parts)) == len(of_parts)


@every(SQUARE)
def test_lines_and_curves_between_two_points_are_named(vehicle: Vehicle) -> None:
    kappa = vehicle.signed_drag_ratio
    side, delta = math.copysign(1.0, kappa), math.atan(kappa)
    line = delta - side * HALF_PI
    beyond = separating_factor(
        (0.5 * delta, -0.5 * delta), (side * 1.5, -side * 1.5), vehicle
    )
    assert beyond == f"the curve tan α1 − tan α2 = 2κ = {2 * kappa:.4f}"
    first, second = (line - side * 1e-4, 0.0), (0.0, -line + side * 1e-4)
    one = f"the line α1 = {line:.4f} (β1 = ∓π/2)"
    both = f"{one} and the line α2 = {-line:.4f} (β2 = ±π/2)"
    assert separating_factor((0.0, 0.0), first, vehicle) == one
    assert separating_factor(first, second, vehicle) == both


@pytest.mark.parametrize("step", [1e-2, 1e-4, 3e-6])
def test_components_are_not_joined_across_a_saddle(step: float) -> None:
    """At the saddle where β1 = −π/2 meets D = 0 two corners of R < 0 touch."""
    region = sign_region("negative")
    x = math.atan(PAPER.drag_ratio) - HALF_PI
    y = math.atan(math.tan(x) - 2 * PAPER.drag_ratio)
    right, left = (x + step, y), (x - step, y)
    assert region.contains(np.array([right, left])).all()
    assert not region.joined(right, left)
    assert region.joined(right, (1.178, -0.393))
    assert region.joined(left, (-1.5, 1.2))


# What may be flown


@pytest.mark.no_cover
@pytest.mark.parametrize("sign", SIGNS)
@every(
    [
        PAPER,
        SQUARE[1].replace(max_tilt=1.2),
        PAPER.replace(name="limited", max_thrust=2.2, max_tilt="80deg"),
        Vehicle(name="large", drag_ratio=1.5, mass=1.0, max_thrust=6.0),
    ]
)
def test_the_border_of_every_component_is_a_flyable_gait(
    vehicle: Vehicle, sign: Sign
) -> None:
    region = admissible_region(vehicle, sign=sign, accuracy=1e-3)
    assert region.components
    for part in region.components:
        corners = np.asarray(part.exterior.coords)[:-1]
        report = lift(corners, "red", vehicle=vehicle).check()
        assert report.flyable, report.reason


@pytest.mark.parametrize("kind", ["published", "printed", "exact"])
def test_what_is_valid_is_certain_for_the_digits_of_the_coefficients(kind: Any) -> None:
    numbers = coefficients_of(kind=kind)
    region = admissible_region(require="valid", coefficients=numbers, accuracy=1e-3)
    for part in region.components:
        corners = np.asarray(part.exterior.coords)[:-1]
        assert lift(corners, "red", coefficients=numbers).check().valid
    points = np.random.default_rng(2).uniform(-HALF_PI, HALF_PI, (20000, 2))
    exact = level_determinant(red(points), EXACT)
    off = np.abs(level_determinant(red(points), numbers) - exact)
    off += level_determinant_resolution(red(points), numbers)
    least = certain_determinant(numbers)
    assert off.max() <= least < 10 * off.max()


def test_admissible_is_the_intersection_of_its_conditions() -> None:
    vehicle = PAPER.replace(max_thrust=2.5)
    zones = Zones(
        keep_out=[[(0.5, -1.0), (0.8, -1.0), (0.8, -0.7), (0.5, -0.7)]],
        keep_in=[[(0, -1.2), (1.25, -1.2), (1.25, 0), (0, 0)]],
    )
    region = admissible_region(vehicle, zones=zones, sign="negative")
    together = sign_region("negative", vehicle) & hover_region(vehicle)
    together &= singular_value_region(0.05, vehicle) & zones_region(zones)
    together &= thrust_region(2.5 / (0.429 * 9.8), vehicle)
    # But for the margins of what checks can decide.
    assert region.inner.symmetric_difference(together.inner).area < 2e-3
    assert together.outer.buffer(1e-5).covers(region.inner)
    assert len(region.conditions) == 5
    assert admissible_region(vehicle) is admissible_region(vehicle)  # built once


@pytest.mark.parametrize("sign", SIGNS)
@pytest.mark.parametrize(("floor", "accuracy"), [(1e-5, 1e-4), (0.05, 0.1)])
def test_a_region_of_one_sign_is_enclosed_where_the_floor_is_small(
    sign: Sign, floor: float, accuracy: float
) -> None:
    vehicle = vehicle_named("beetle_art")
    points = np.random.default_rng(1).uniform(-HALF_PI, HALF_PI, (4000, 2))
    R = level_determinant(red(points), coefficients_of(vehicle, "exact"))
    rough = admissible_region(vehicle, sign=sign, floor=floor, accuracy=accuracy)
    assert rough.outer.buffer(1e-9).covers(rough.inner)
    whole = admissible_region(vehicle, floor=floor, accuracy=1e-6)
    inside = whole.contains(points) & (WANTED[sign] * R > 0)
    assert shapely.covers(rough.outer, shapely.points(points[inside])).all()


def test_a_floor_of_zero_leaves_the_sign_to_separate_components() -> None:
    region = admissible_region(sign="positive", floor=0.0)
    whole = (sign_region("positive") & hover_region()).area
    assert whole - 0.02 < region.area < whole


# Questions


def test_components_that_touch_are_joined() -> None:
    steps = [(-k - 1, -k - 1, -k, -k) for k in range(6)]
    boxes = [(0.0, 0.0, 0.8, 0.8), *steps, (1.6, 1.6, 2.4, 2.4)]
    shape = shapely.MultiPolygon([shapely.box(*box) for box in boxes])
    region = Region(inner=shape, outer=shape, accuracy=0.0)
    assert region.joined((-5.5, -5.5), (0.5, 0.5))
    assert not region.joined((-0.5, -0.5), (2.0, 2.0))
    assert not region.joined((-0.5, -0.5), (1.2, 1.2))
    first, *_, last = str(region).splitlines()
    assert first.endswith("7.28 rad² in 8 components, exact borders")
    assert last == "  … and 2 more"
    shown = repr(admissible_region())
    assert shown.startswith("<Region: 4.748 rad² in 5 components, accuracy 1e-06 rad")


def test_the_nearest_point_is_inside_also_as_it_is_printed() -> None:
    hole = [(0.3, -0.9), (1.1, -0.8), (0.5, -0.3)]
    region = admissible_region(zones=Zones(keep_out=[hole]))
    for point in np.random.default_rng(0).uniform(-2.0, 2.0, (60, 2)):
        nearest = region.nearest(point)
        assert nearest is not None
        assert region.contains(nearest)[0]
        distance = region.inner.distance(shapely.Point(point))
        assert math.dist(nearest, point) == pytest.approx(distance, abs=1e-12)
        texts = re.findall(r"-?\d+\.\d+", region.as_text(nearest))
        printed = [float(text) for text in texts]
        assert region.contains(printed)[0]
        assert math.dist(printed, nearest) < 2e-4


@pytest.mark.parametrize(
    ("point", "reason"),
    [
        ((0.5, -0.5), "R at level attitude must be ≥ 0.0026, got -6.336"),
        ((0.1, -0.3), "hover thrusts must be > 0, got "),
        ((-1.55, 0.2), "tilt must be ≤ 68.8°, got 88.8°"),
        ((0.16, -0.16), "least singular value must be ≥ 0.05, got 0.0"),
        ((-0.3, 0.3), "inside keep_out polygon 2"),
        ((-1.1, 1.1), "outside the keep_in polygons"),
    ],
)
def test_why_not_names_the_condition(point: tuple[float, float], reason: str) -> None:
    zones = Zones(
        keep_out=[
            [(1.5, 1.5), (3, 2), (3, 3)],
            [(-0.4, 0.2), (-0.2, 0.2), (-0.2, 0.4), (-0.4, 0.4)],
        ],
        keep_in=[[(-1, -1), (1, -1), (1, 1), (-1, 1)]],
    )
    vehicle = PAPER.replace(max_tilt=1.2)
    region = admissible_region(vehicle, sign="positive", zones=zones)
    assert reason in (region.why_not(point) or "")
    assert region.why_not((-0.5, 0.5)) is None
    for shape in ((2, 3), (1, 1, 2)):
        with pytest.raises(gg.InputError, match="^point must be"):
            region.contains(np.zeros(shape))


# Servo margins (docs/theory.md, 19)


@pytest.mark.parametrize("seed", range(3))
def test_a_point_is_inside_exactly_if_no_corner_of_its_errors_breaks_a_condition(
    seed: int,
) -> None:
    rng = np.random.default_rng(seed)
    vehicle = Vehicle(drag_ratio=float(rng.uniform(0.05, 0.6)))
    if seed % 3:
        vehicle = some_servo_vehicle(rng)
    floor, margin = (0.0, 0.05, 0.1)[seed % 3], float(rng.uniform(0.02, 0.3))
    sign: Sign = ("positive", "negative")[seed % 2]
    region = servo_margin_region(margin, vehicle, sign=sign, floor=floor)
    points = rng.uniform(-HALF_PI, HALF_PI, (60, 2))
    if region.components:
        low, high = np.reshape(region.outer.bounds, (2, 2))
        near = rng.uniform(low - 0.02, high + 0.02, (60, 2))
        points = np.vstack([points, near])
    points = np.clip(points, -HALF_PI, HALF_PI)
    R: Any = level_determinant(red(points), coefficients_of(vehicle, "exact"))
    enclosed = np.array(shapely.covers(region.outer, shapely.points(points)))
    errors = margin * np.array(list(product((-1.0, 1.0), repeat=4)))
    for k, alpha in enumerate(red(points)):
        bears = WANTED[sign] * R[k] > 0
        bears = bears and all(
            reserve(vehicle, floor, alpha + e, 0.0) > 0 for e in errors
        )
        assert bears or not region.contains(points[k])[0]
        assert enclosed[k] or not bears


def test_servo_margins_nest_and_only_what_flies_has_one() -> None:
    wide, narrow, none = (
        admissible_region(sign="positive", servo_margin=margin)
        for margin in ("5deg", "12deg", 0.0)
    )
    assert shapely.covers(wide.outer, narrow.inner)
    assert narrow.why_not((0.0, 0.0)) == "servo margin must be ≥ 12°, got 8.16°"
    assert none.inner.equals(admissible_region(sign="positive").inner)
    with pytest.raises(gg.InputError, match="servo_margin must be 0 with require"):
        admissible_region(require="valid", servo_margin=0.1)
    with pytest.raises(gg.InputError, match="servo_margin must be an angle from 0"):
        admissible_region(servo_margin="100deg")


@pytest.mark.parametrize("seed", range(2))
def test_what_is_called_borne_is_borne_and_what_was_found_to_break_is_not(
    seed: int,
) -> None:
    rng = np.random.default_rng(seed)
    points = None
    while points is None:
        vehicle = some_servo_vehicle(rng)
        points = some_gait(vehicle, rng)
    margin = servo_margin(points, vehicle)
    assert margin.found is not None
    for size in (margin.proven, 0.99 * margin.found):
        assert bears_servo_errors(points, size, vehicle)
    assert not bears_servo_errors(points, 1.006 * margin.found, vehicle)


# Sums of cosines, and their borders
