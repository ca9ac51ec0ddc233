"""Regions as polygons: inside and enclosing the truth, separated by factors, and the questions that they answer."""

from __future__ import annotations

import math
import re
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import shapely
from hypothesis import given, settings, strategies as st

from gaitgraph.angles import HALF_PI
from gaitgraph.gait.gait import lift
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.invertibility.matrices import (
    hover_thrust_shares,
    least_singular_value,
    level_determinant,
    level_determinant_resolution,
    noise_of,
)
from gaitgraph.invertibility.segment_bounds import (
    least_level_determinant,
    least_singular_value_along,
    thrust_shares_along,
    thrusts_push_up,
)
from gaitgraph.surface.admissible import (
    admissible_region,
    certain_determinant,
    hover_region,
    sign_region,
    singular_value_region,
    thrust_region,
    why_empty,
)
from gaitgraph.surface.borders import Border, CosineSum, cosine, zeros_of_degree_two
from gaitgraph.surface.region import (
    Points,
    Region,
    Zones,
    polygons_of,
    zones_region,
)
from gaitgraph.surface.sheets import (
    HOVER_LABEL,
    SIGNS,
    red_label,
    separating_factor,
    sheet_angles,
)
from gaitgraph.validation.validating import check_gait
from gaitgraph.vehicle import PAPER, Vehicle

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gaitgraph.surface.sheets import Sign
VEHICLES = [
    Vehicle(drag_ratio=0.01),
    Vehicle(drag_ratio=PAPER.drag_ratio, first_rotor_spin="counterclockwise"),
    Vehicle(drag_ratio=PAPER.drag_ratio),
    Vehicle(drag_ratio=0.8, first_rotor_spin="counterclockwise"),
    Vehicle(drag_ratio=1.5),
]
every_vehicle = pytest.mark.parametrize(
    "vehicle", VEHICLES, ids=[f"{v.signed_drag_ratio:.3g}" for v in VEHICLES]
)
some_vehicles = pytest.mark.parametrize(
    "vehicle",
    [VEHICLES[k] for k in (0, 3, 4)],
    ids=lambda vehicle: f"{vehicle.signed_drag_ratio:.3g}",
)
points = st.tuples(st.floats(-HALF_PI, HALF_PI), st.floats(-HALF_PI, HALF_PI))


def points_near(region: Region, seed: int) -> np.ndarray[Any, Any]:
    """Return points all over the square, and on both sides of the borders at distances from 1e-7 to 1e-3."""
    rng = np.random.default_rng(seed)
    out = [rng.uniform(-HALF_PI, HALF_PI, (4000, 2))]
    for shape in (region.inner, region.outer):
        corners = shapely.get_coordinates(shape)
        if len(corners):
            for distance in (1e-7, 1e-6, 1e-5, 1e-3):
                some = corners[rng.integers(len(corners), size=400)]
                out.append(some + distance * rng.normal(size=some.shape))
    return np.clip(np.vstack(out), -HALF_PI, HALF_PI)


def assert_encloses(
    region: Region, margin: Any, seed: int = 0, rounding: float = 1e-12
) -> None:
    """Assert inner ⊆ {margin ≥ 0} ⊆ outer at many points near the borders."""
    near = points_near(region, seed)
    value, shapes = margin(near), shapely.points(near)
    inside, enclosed = (
        shapely.covers(region.inner, shapes),
        shapely.covers(region.outer, shapes),
    )
    assert value[inside].min(initial=np.inf) > -rounding
    assert value[~enclosed].max(initial=-np.inf) < rounding
    assert region.inner.is_valid
    assert region.outer.is_valid


def red(at: Any) -> np.ndarray[Any, Any]:
    return np.asarray(at)[:, [0, 1, 0, 1]]


def edges(
    polygons: Sequence[shapely.Polygon],
) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    """Return the segments of the borders of polygons on the red sheet."""
    corners, ring = shapely.get_coordinates(
        shapely.get_rings(polygons), return_index=True
    )
    follows = ring[1:] == ring[:-1]
    return red(corners[:-1][follows]), red(corners[1:][follows])


@pytest.mark.no_cover
@every_vehicle
@settings(deadline=None, max_examples=30)
@given(first=points, second=points)
def test_points_joined_without_a_singular_matrix_have_one_label(
    vehicle: Vehicle, first: Any, second: Any
) -> None:
    exact = coefficients_of(vehicle, "exact")
    start, end = red([first]), red([second])
    sign = float(np.sign(level_determinant(start[0], exact)))
    label, other = (red_label(at[0], at[1], vehicle) for at in (first, second))
    assert label.prod() == sign or abs(level_determinant(start[0], exact)) < 1e-9
    joined = (
        least_level_determinant(start, end, exact, sign=sign, tolerance=1e-6).worst()[0]
        > 1e-9
    )
    assert not joined or (label == other).all()
    assert (separating_factor(first, second, vehicle) is None) == (label == other).all()


@every_vehicle
def test_lines_and_curves_between_two_points_are_named(vehicle: Vehicle) -> None:
    kappa = vehicle.signed_drag_ratio
    side, delta = math.copysign(1.0, kappa), math.atan(kappa)
    line = delta - side * HALF_PI
    curve = f"the curve tan α1 − tan α2 = 2κ = {2 * kappa:.4f}"
    assert (
        separating_factor(
            (0.5 * delta, -0.5 * delta), (side * 1.5, -side * 1.5), vehicle
        )
        == curve
    )
    first, second = (line - side * 1e-4, 0.0), (0.0, -line + side * 1e-4)
    texts = (
        f"the line α1 = {line:.4f} (β1 = ∓π/2)",
        f"the line α2 = {-line:.4f} (β2 = ±π/2)",
    )
    assert separating_factor((0.0, 0.0), first, vehicle) == texts[0]
    assert separating_factor(first, second, vehicle) == " and ".join(texts)
    assert tuple(red_label(0.0, 0.0, vehicle).tolist()) == HOVER_LABEL == (1, 1, 1)


@every_vehicle
def test_components_have_the_signs_of_their_factors_along_their_borders_too(
    vehicle: Vehicle,
) -> None:
    kappa = vehicle.signed_drag_ratio
    delta = math.atan(kappa)
    at = np.random.default_rng(3).uniform(-HALF_PI, HALF_PI, (3000, 2))
    signs = red_label(at[:, 0], at[:, 1], vehicle).prod(axis=1)
    both = (
        sign_region("positive", vehicle, accuracy=1e-4),
        sign_region("negative", vehicle, accuracy=1e-4),
    )
    found = set()
    for region, sign in zip(both, (1, -1), strict=True):
        assert (signs[region.contains(at)] == sign).all()
        assert np.all(shapely.covers(region.outer, shapely.points(at[signs == sign])))
        for part in region.components:
            inside = part.representative_point()
            label = red_label(inside.x, inside.y, vehicle)
            found.add((*label.tolist(), sign))
            # Each factor of R keeps its sign along every side, by a bound of what it can fall below its ends.
            starts, ends = edges([part])
            a1, a2 = np.moveaxis(
                starts + np.linspace(0.0, 1.0, 1025)[:, None, None] * (ends - starts),
                -1,
                0,
            )[:2]
            bracket = math.copysign(1.0, kappa) * (
                2 * kappa * np.cos(a1) * np.cos(a2) - np.sin(a1 - a2)
            )
            # The second derivative of D along a side is at most 2·(1 + 2|κ|).
            falls = (
                (2 + 4 * abs(kappa))
                * (np.hypot(*(ends - starts).T[:2]) / 1024) ** 2
                / 8
            )
            assert (label[2] * bracket > falls).all()
            assert (label[0] * np.cos(a1 - delta) > 0).all()
            assert (label[1] * np.cos(a2 + delta) > 0).all()
    # Each combination of the signs of three factors but one is a component.
    assert len(found) == sum(len(region.components) for region in both) == 7
    assert all(math.prod(label) == 1 for label in found)


def test_components_are_not_joined_across_a_saddle() -> None:
    """At the saddle where β1 = −π/2 meets D = 0 two corners of R < 0 touch."""
    region = sign_region("negative")
    x = math.atan(PAPER.drag_ratio) - HALF_PI
    saddle = np.array([x, math.atan(math.tan(x) - 2 * PAPER.drag_ratio)])
    for step in (1e-2, 1e-4, 3e-6):
        right, left = saddle + np.array([step, 0.0]), saddle - np.array([step, 0.0])
        assert region.contains(np.array([right, left])).all()
        assert not region.joined(right, left)
        assert region.joined(right, (1.178, -0.393))
        assert region.joined(left, (-1.5, 1.2))


@pytest.mark.no_cover
@some_vehicles
def test_singular_value_region(vehicle: Vehicle) -> None:
    cap = 2 * math.sqrt((1 + vehicle.drag_ratio**2) / 3)
    for seed, (floor, accuracy) in enumerate(
        ((0.05, 1e-5), (0.4, 1e-3), (0.95 * cap, 1e-5))
    ):
        region = singular_value_region(floor, vehicle, accuracy=accuracy)
        assert_encloses(
            region,
            lambda at, floor=floor: least_singular_value(red(at), vehicle) - floor,
            seed,
        )
    assert singular_value_region(1.01 * cap, vehicle).inner.is_empty
    starts, ends = edges(singular_value_region(0.3, vehicle, accuracy=1e-3).components)
    found = least_singular_value_along(
        starts, ends, vehicle, tolerance=1e-6, floor=0.3 - 1e-6, each=True
    )
    assert found.lower.min() >= 0.3 - 1e-6


def test_a_floor_narrower_than_the_accuracy() -> None:
    region = singular_value_region(3e-7)
    assert_encloses(
        region, lambda at: least_singular_value(red(at)) - 3e-7, rounding=1e-15
    )
    assert len(region.components) == 7
    assert region.outer.area - region.area < 1e-5
    assert singular_value_region(0.0).area == pytest.approx(math.pi**2, abs=1e-12)


def test_the_outer_region_holds_the_narrow_end_between_two_limits_of_thrust() -> None:
    """Nearer to each other than their errors, two borders overlap: together they left no gap."""
    vehicle = VEHICLES[1]
    region = thrust_region(0.26, vehicle, accuracy=1e-5)
    delta = math.atan(vehicle.signed_drag_ratio)
    at = np.array([delta - 0.11111693, -delta + 0.11111553])
    assert hover_thrust_shares(red(at[None]), vehicle).max() < 0.26
    assert region.outer.covers(shapely.Point(at))


@pytest.mark.no_cover
@some_vehicles
def test_thrust_and_hover_regions(vehicle: Vehicle) -> None:
    delta = math.atan(vehicle.signed_drag_ratio)

    def margin(at: Any, share: float | None, least: float) -> Any:
        found = hover_thrust_shares(red(at), vehicle)
        low, high = (
            np.nan_to_num(side(found, axis=1), nan=bad)
            for side, bad in ((np.min, -1.0), (np.max, 99.0))
        )
        return np.fmin(low - least, 9.0 if share is None else share - high)

    for seed, (share, least) in enumerate(((0.26, 0.0), (0.7, 0.1), (None, 1.0))):
        # Next to the corner (δ, −δ) all thrusts are ratios of vanishing numbers.
        region = thrust_region(share, vehicle, least=least)
        assert_encloses(
            region,
            lambda at, bounds=(share, least): margin(at, *bounds),
            seed,
            rounding=1e-7,
        )
    hover = hover_region(vehicle)
    assert hover.outer.area == pytest.approx(
        (HALF_PI + delta) ** 2 + (HALF_PI - delta) ** 2, abs=1e-12
    )
    assert not hover.contains([delta, -delta])[0]
    assert all(
        "hover thrusts must be > 0" in (hover.why_not(at) or "")
        for at in ((delta, 0.3), (0.3, -delta))
    )
    assert_encloses(
        hover,
        lambda at: np.nan_to_num(
            hover_thrust_shares(red(at), vehicle).min(axis=1), nan=-1.0
        ),
    )
    # Across R = 0 the thrusts are not determined, so segments are judged on either side of it.
    small = thrust_region(0.3, vehicle, accuracy=1e-3)
    for sign in SIGNS:
        part = sign_region(sign, vehicle, least=1e-3)
        inside = [*polygons_of((hover & part).inner.buffer(-2e-6)).geoms]
        assert thrusts_push_up(*edges(inside), vehicle).all()
        upward, _, largest = thrust_shares_along(
            *edges((small & part).components), vehicle
        )
        assert upward.all()
        assert (-largest.lower).max(initial=0.0) <= 0.3 + 1e-4  # its own tolerance


@pytest.mark.no_cover
@pytest.mark.parametrize(
    ("vehicle", "least"), [*zip(VEHICLES[::2], (1e-3, 0.5, 3.0), strict=True)]
)
def test_region_of_a_least_determinant(vehicle: Vehicle, least: float) -> None:
    exact = coefficients_of(vehicle, "exact")
    size = float(exact.form.size[2])
    signs: tuple[tuple[Sign, float], ...] = (("positive", 1.0), ("negative", -1.0))
    for sign, factor in signs:
        region = sign_region(sign, vehicle, least=least, accuracy=1e-5)
        assert_encloses(
            region,
            lambda at, f=factor: (f * level_determinant(red(at), exact) - least) / size,
        )


@pytest.mark.parametrize("sign", ["positive", "negative"])
def test_blue_region_is_where_rounding_left_a_sign(sign: Any) -> None:
    coefficients = coefficients_of()
    factor = 1.0 if sign == "positive" else -1.0

    def margin(at: Any) -> Any:
        third, fourth = sheet_angles("blue", at[:, 0], at[:, 1], coefficients)
        return factor * level_determinant(
            np.column_stack([at, third, fourth]), coefficients
        ) - noise_of(coefficients)

    region = sign_region(sign, color="blue", accuracy=1e-5)
    assert_encloses(region, margin, rounding=1e-13)
    wraps = (2 * coefficients.delta - HALF_PI, HALF_PI - 2 * coefficients.delta)
    for part in region.components:
        left, bottom, right, top = part.bounds
        assert not left < wraps[0] < right
        assert not bottom < wraps[1] < top
    exact = sign_region(sign, color="blue", coefficients=coefficients_of(kind="exact"))
    assert exact.inner.is_empty
    assert exact.outer.is_empty
    assert "R at level attitude must be" in (exact.why_not((0.3, 0.2)) or "")
    flyable = admissible_region(color="blue")
    assert (flyable.nearest((0.3, 0.3)), flyable.component_of((0.3, 0.3))) == (
        None,
        None,
    )
    assert flyable.nearest_joined([(0.3, 0.3)]) == ()
    assert "singular" in (flyable.why_not((0.3, 0.3)) or "")
    assert why_empty(flyable, 0.05, PAPER).startswith(
        "no tilt angles meet all conditions (an invertible decoupling matrix); "
    )


MADE: list[tuple[Any, tuple[Any, ...], dict[str, Any]]] = [
    *[(singular_value_region, (floor,), {}) for floor in (0.5, 1.0)],
    *[(thrust_region, (share,), {}) for share in (0.6, 1.0)],
    (sign_region, ("negative",), {"least": 0.5}),
    (sign_region, ("positive",), {"color": "blue"}),
]


@pytest.mark.parametrize(
    ("accuracy", "corners"),
    [
        (1e-2, [112, 42, 64, 34, 269, 155]),
        (1e-5, [656, 272, 414, 226, 2217, 1255]),
        (1e-8, [19051, 6761, 14722, 6380]),
    ],
)
def test_inner_and_outer_are_as_near_as_stated_with_few_corners(
    accuracy: float, corners: list[int]
) -> None:
    for (function, values, options), few in zip(MADE, corners, strict=False):
        region = function(*values, **options, accuracy=accuracy)
        # Both borders are within the accuracy of the true one, and farther apart only in corners, sharp ones of R.
        points = shapely.get_coordinates(region.outer)
        some = shapely.points(points[:: max(len(points) // 300, 1)])
        most = 2.5 if options.get("least") else 1.7
        assert (
            accuracy / 2 < shapely.distance(region.inner, some).max() < most * accuracy
        )
        assert region.accuracy == accuracy
        assert len(points) == pytest.approx(few, rel=0.02)


@pytest.mark.no_cover
@pytest.mark.parametrize(
    "vehicle",
    [
        PAPER,
        PAPER.replace(first_rotor_spin="counterclockwise", max_tilt=1.2),
        PAPER.replace(max_thrust=2.2, max_tilt="80deg"),
        Vehicle(drag_ratio=1.5, mass=1.0, max_thrust=6.0),
    ],
    ids=["paper", "mirrored", "limited", "large"],
)
def test_the_border_of_every_component_is_a_flyable_gait(vehicle: Vehicle) -> None:
    """A loop right along the border of a flyable component passes every check, between samples too."""
    signs: tuple[Sign, ...] = ("positive", "negative")
    for sign in signs:
        region = admissible_region(vehicle, sign=sign, accuracy=1e-4)
        assert region.components
        for part in region.components:
            corners = np.asarray(part.exterior.coords)[:-1]
            report = check_gait(lift(corners, "red", vehicle=vehicle))
            assert report.flyable, (
                sign,
                [check.message for check in report.checks if not check.ok],
            )


@pytest.mark.parametrize("kind", ["published", "printed", "exact"])
def test_the_border_of_every_valid_component_is_a_valid_gait(kind: Any) -> None:
    coefficients = coefficients_of(kind=kind)
    for part in admissible_region(
        require="valid", coefficients=coefficients, accuracy=1e-3
    ).components:
        assert check_gait(
            lift(
                np.asarray(part.exterior.coords)[:-1], "red", coefficients=coefficients
            )
        ).valid


@pytest.mark.parametrize("kind", ["published", "printed", "exact"])
def test_certain_determinant_covers_what_digits_can_change(kind: Any) -> None:
    coefficients, exact = coefficients_of(kind=kind), coefficients_of(kind="exact")
    alpha = red(np.random.default_rng(2).uniform(-HALF_PI, HALF_PI, (20000, 2)))
    resolution = level_determinant_resolution(alpha, coefficients)
    least = certain_determinant(coefficients)
    off = np.abs(
        level_determinant(alpha, coefficients) - level_determinant(alpha, exact)
    )
    assert (off + resolution <= least).all()
    assert least < 10 * (off + resolution).max()


def test_admissible_is_the_intersection_of_its_conditions() -> None:
    vehicle = PAPER.replace(max_thrust=2.5)
    zones = Zones(
        keep_out=[[(0.5, -1.0), (0.8, -1.0), (0.8, -0.7), (0.5, -0.7)]],
        keep_in=[[(0, -1.2), (1.25, -1.2), (1.25, 0), (0, 0)]],
    )
    region = admissible_region(vehicle, zones=zones, sign="negative")
    together = (
        sign_region("negative", vehicle)
        & singular_value_region(0.05, vehicle)
        & hover_region(vehicle)
    )
    together &= thrust_region(2.5 / (0.429 * 9.8), vehicle) & zones_region(zones)
    assert (
        region.inner.symmetric_difference(together.inner).area < 2e-3
    )  # the margins of what checks can decide
    assert together.outer.buffer(1e-5).covers(region.inner)
    assert len(region.conditions) == 5
    assert admissible_region(vehicle, sign="negative") is admissible_region(
        vehicle, sign="negative"
    )  # built once


def test_a_floor_of_zero_leaves_the_sign_to_separate_components() -> None:
    for sign in SIGNS:
        region, whole = (
            admissible_region(sign=sign, floor=0.0),
            (sign_region(sign) & hover_region()).area,
        )
        assert whole - 0.02 < region.area < whole
        assert "least singular value ≥ 0" in [
            condition.name for condition in region.conditions
        ]


def test_components_that_touch_are_joined() -> None:
    region = admissible_region()
    areas = [part.area for part in region.components]
    assert areas == sorted(areas, reverse=True)
    assert (
        repr(region)
        == "<Region: 4.748 rad² in 5 components, accuracy 1e-06 rad, 3 conditions>"
    )
    corners = [
        (0.0, 0.0, 0.8, 0.8),
        *((-k - 1, -k - 1, -k, -k) for k in range(6)),
        (1.6, 1.6, 2.4, 2.4),
    ]
    shape = shapely.MultiPolygon([shapely.box(*one) for one in corners])
    region = Region(inner=shape, outer=shape, accuracy=0.0)
    assert region.joined((-5.5, -5.5), (0.5, 0.5))
    assert not region.joined((-0.5, -0.5), (2.0, 2.0))
    assert not region.joined((-0.5, -0.5), (1.2, 1.2))
    assert (
        str(region).splitlines()[0].endswith("7.28 rad² in 8 components, exact borders")
    )
    assert str(region).splitlines()[-1] == "  … and 2 more"


def test_nearest_point() -> None:
    region = admissible_region(
        zones=Zones(keep_out=[[(0.3, -0.9), (1.1, -0.8), (0.5, -0.3)]])
    )
    for point in np.random.default_rng(0).uniform(-2.0, 2.0, (60, 2)):
        found = region.nearest(point)
        assert found is not None
        assert region.contains(found)[0]
        assert region.nearest(found) == found
        assert math.dist(found, point) == pytest.approx(
            region.inner.distance(shapely.Point(point)), abs=1e-12
        )
        printed = [
            float(part) for part in re.findall(r"-?\d+\.\d+", region.as_text(found))
        ]
        assert region.contains(printed)[0]
        assert math.dist(printed, found) < 2e-4


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
    polygons: list[Points] = [
        [(1.5, 1.5), (3, 2), (3, 3)],
        [(-0.4, 0.2), (-0.2, 0.2), (-0.2, 0.4), (-0.4, 0.4)],
    ]
    zones = Zones(keep_out=polygons, keep_in=[[(-1, -1), (1, -1), (1, 1), (-1, 1)]])
    region = admissible_region(
        PAPER.replace(max_tilt=1.2), sign="positive", zones=zones
    )
    assert reason in (region.why_not(point) or "")
    assert region.why_not((-0.5, 0.5)) is None
    assert {condition.broken_at(-0.5, 0.5) for condition in region.conditions} == {None}


@pytest.mark.parametrize("seed", range(3))
def test_waves_add_multiply_and_bend(seed: int) -> None:
    def some(seed: int) -> CosineSum:
        rng = np.random.default_rng(seed)
        return CosineSum(
            np.column_stack(
                [rng.normal(size=3), rng.integers(-2, 3, (3, 2)), rng.uniform(0, 6, 3)]
            )
        )

    one, two = some(seed), some(seed + 100)
    at = np.random.default_rng(seed).uniform(-3, 3, (50, 2))
    np.testing.assert_allclose(
        (one * two + 0.5).at(at), one.at(at) * two.at(at) + 0.5, atol=1e-12
    )
    angle, step = 0.7 * seed, 1e-4
    along = np.tile([math.cos(angle), math.sin(angle)], (50, 1))
    ahead, behind = one.at(at + step * along), one.at(at - step * along)
    value, slope, side, bend = one.along(at, along)
    np.testing.assert_allclose(value, one.at(at), atol=1e-12)
    np.testing.assert_allclose((ahead - behind) / (2 * step), slope, atol=1e-6)
    left = np.column_stack([-along[:, 1], along[:, 0]])
    np.testing.assert_allclose(one.along(at, left)[1], side, atol=1e-12)
    bends = (ahead - 2 * one.at(at) + behind) / step**2
    np.testing.assert_allclose(bends, bend, atol=1e-6)
    assert (np.abs(bends) <= one.most(2) + 1e-6).all()
    assert cosine(2, -1, size=-3.0).most(3) == pytest.approx(3 * 5**1.5)


def test_deviation_bounds_how_far_a_circle_is_from_its_chords() -> None:
    """cos x + cos y = 2 − ε is nearly a circle; its true distance from a chord is known by bisection."""
    level = 2 - 0.02
    border = Border(rest=cosine(1, 0) + cosine(0, 1) + -level)

    def at(angle: float) -> np.ndarray[Any, Any]:
        low, high = 0.0, 1.0
        for _ in range(80):
            middle = (low + high) / 2
            inside = (
                math.cos(middle * math.cos(angle)) + math.cos(middle * math.sin(angle))
                > level
            )
            low, high = (middle, high) if inside else (low, middle)
        return np.array([low * math.cos(angle), low * math.sin(angle)])

    for first, second in pairwise(np.linspace(0, 2 * math.pi, 60)):
        p, q = at(first), at(second)
        bound = float(border.deviation(p[None], q[None], 0.004)[0])
        normal = np.array([-(q - p)[1], (q - p)[0]]) / np.hypot(*(q - p))
        true = max(
            abs(float((at(angle) - p) @ normal))
            for angle in np.linspace(first, second, 9)
        )
        assert true <= bound < 2 * true
    # A rectangle that reaches the other side of the circle certifies nothing.
    assert border.deviation(at(0.0)[None], at(0.1)[None], 0.4)[0] == np.inf


@pytest.mark.parametrize("seed", range(4))
def test_zeros_of_degree_two(seed: int) -> None:
    a = np.random.default_rng(seed).normal(size=5)
    if seed == 0:
        a = np.array([-1.0, 1.0, 0.0, 0.0, 0.0])  # cos x − 1: a double zero

    def value(x: Any) -> Any:
        return (
            a[0]
            + a[1] * np.cos(x)
            + a[2] * np.sin(x)
            + a[3] * np.cos(2 * x)
            + a[4] * np.sin(2 * x)
        )

    found = zeros_of_degree_two(value, 2 * math.pi)
    x = np.linspace(-math.pi, math.pi, 20001)
    changes = x[:-1][np.sign(value(x[:-1])) * np.sign(value(x[1:])) < 0]
    assert all(np.abs(found - change).min() < 1e-3 for change in changes)
    assert seed or np.abs(found).min() < 1e-6
    assert (np.abs(value(found)) < 1e-3).all()
