"""Any-angle loops: against visibility graphs built edge by edge, their bounds, the grid in its limit and requests."""

from __future__ import annotations

import math
import re
from itertools import pairwise, permutations
from math import pi
from typing import TYPE_CHECKING, Any

import networkx as nx
import numpy as np
import pytest
import shapely
from scipy.optimize import brentq
from scipy.spatial import ConvexHull

import gaitgraph as gg
from gaitgraph.invertibility.matrices import least_singular_value_on_red
from gaitgraph.planning.any_angle import straight_loop_holds
from gaitgraph.planning.branch import Branch
from gaitgraph.planning.request import PlanRequest, plan_request
from tests.published import GAITS
from tests.samples import along, loop_of, planning_region, visibility_graph

if TYPE_CHECKING:
    from gaitgraph.planning.loop import Loop
    from gaitgraph.planning.planner import Plan

Point = tuple[float, float]
G1, G2, G3, G4 = GAITS
STRONG = gg.Vehicle(drag_ratio=0.4)
MIRRORED = gg.PAPER.replace(first_rotor_spin="counterclockwise")
VEHICLES: dict[str, dict[str, Any]] = {
    "published": {},
    "exact": {"coefficients": "exact"},
    "beetle": {"vehicle": "beetle_omni"},
    "strong": {"vehicle": STRONG},
    "mirrored": {"vehicle": MIRRORED},
}
WALL = [(0.6, -0.6), (1.0, -0.6), (1.0, -0.2), (0.6, -0.2)]


def exact(waypoints: Any, **request: Any) -> Plan:
    return gg.plan_loop(waypoints, method="exact", **{"require": "valid", **request})


def straight_loop_flies(request: PlanRequest, sign: Any) -> bool:
    return straight_loop_holds(
        Branch(request=request, color="red", sign=sign, require="flyable")
    )


def perimeter(points: Any) -> float:
    rows = [tuple(row) for row in np.asarray(points, dtype=float)[:, :2].tolist()]
    return sum(math.dist(a, b) for a, b in pairwise([*rows, rows[0]]))


def bending_corners(region: Any) -> list[Point]:
    """Where the interior angle of a polygon's ring is more than half a turn: no other corner can hold a taut string."""
    found = []
    for part in shapely.orient_polygons(region).geoms:
        for ring in (part.exterior, *part.interiors):
            points = np.array(ring.coords[:-1])
            before, after = (
                points - np.roll(points, 1, axis=0),
                np.roll(points, -1, axis=0) - points,
            )
            turn = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
            found += [tuple(corner) for corner in points[turn < 1e-15].tolist()]
    return found


def visibility(region: Any, points: list[Point]) -> nx.Graph[Any]:
    return visibility_graph(region, {*bending_corners(region), *points})


def shortest(graph: nx.Graph[Any], points: list[Point]) -> float:
    legs = pairwise([*points, points[0]])
    return sum(nx.dijkstra_path_length(graph, a, b, weight="length") for a, b in legs)


def star(rng: np.random.Generator, center: Any, radius: float) -> list[list[float]]:
    count = int(rng.integers(3, 7))
    turns = 2 * pi * (np.arange(count) + rng.uniform(0, 0.8, count)) / count
    reach = radius * rng.uniform(0.4, 1.0, count)
    corners = center + reach[:, None] * np.column_stack([np.cos(turns), np.sin(turns)])
    return [[float(x), float(y)] for x, y in corners]


def some_request(
    seed: int, name: str, sign: Any, *, keep_in: bool = False, waypoints: int = 4
) -> dict[str, Any]:
    """Keep-outs strewn over the part where gaits with this sign fly, and waypoints between them."""
    rng = np.random.default_rng(seed)
    asked: dict[str, Any] = {
        **VEHICLES[name],
        "sign": sign,
        "color": "red",
        "accuracy": 1e-3,
        "floor": 0.3,
    }
    free = planning_region(
        plan_request([(0, 0)], **asked), "red", sign, "flyable"
    ).inner
    center = np.array(free.centroid.coords[0])
    while True:
        asked["keep_out"] = [
            star(rng, center + rng.uniform(-0.5, 0.5, 2), rng.uniform(0.1, 0.35))
            for _ in range(5)
        ]
        if keep_in:
            arms = [
                shapely.box(-0.6, -0.6, 0.6, -0.1),
                shapely.box(-0.6, -0.6, -0.1, 0.6),
            ]
            corner: Any = shapely.affinity.translate(shapely.union_all(arms), *center)
            asked["keep_in"] = [list(corner.exterior.coords[:-1])]
        region = planning_region(
            plan_request([(0, 0)], **asked), "red", sign, "flyable"
        ).inner
        part = max(region.geoms, key=lambda polygon: polygon.area)
        strewn = center + rng.uniform(-0.7, 0.7, (60, 2))
        inside = [
            (x, y) for x, y in strewn[shapely.contains_xy(part, *strewn.T)].tolist()
        ][:waypoints]
        if len(inside) == waypoints and not part.covers(
            shapely.LineString([*inside, inside[0]])
        ):
            return {"waypoints": inside, **asked}


def holds_between_samples_too(loop: Loop, request: PlanRequest) -> None:
    """What a flyable loop promises, by decompositions and closed forms at many points, and by the certified report."""
    passed, wanted = along(loop.gait.alpha, 101), 1 if loop.sign == "positive" else -1
    assert (
        gg.invertibility.least_singular_value(passed, request.vehicle).min()
        >= request.floor - 1e-12
    )
    assert gg.invertibility.hover_thrust_shares(passed, request.vehicle).min() > 0
    assert (
        wanted * gg.invertibility.level_determinant(passed, loop.gait.coefficients) > 0
    ).all()
    assert loop.gait.check(floor=request.floor).flyable


def keeps_to_the_polygons(loop: Loop, request: PlanRequest) -> None:
    rows = loop.path.alpha[:, :2]
    line = shapely.LineString(np.vstack([rows, rows[:1]]))
    for polygon in request.zones.keep_out if request.zones else ():
        assert not line.intersects(shapely.Polygon(polygon).buffer(-1e-9))
    if request.zones and request.zones.keep_in:
        allowed = shapely.union_all(
            [shapely.Polygon(polygon) for polygon in request.zones.keep_in]
        )
        assert allowed.buffer(1e-9).covers(line)


def passes_in_order(loop: Loop, plan: Plan) -> None:
    rows = [tuple(row) for row in loop.path.alpha[:, :2].tolist()]
    at = 0
    for point in plan.waypoints:
        at = rows.index(point, at)
    assert rows[0] == plan.waypoints[0]


CASES = [
    (seed, name, sign, (seed % 2 == 0) == (sign == "positive"))
    for seed, name in enumerate(VEHICLES)
    for sign in ("positive", "negative")
]


@pytest.mark.parametrize(("seed", "name", "sign", "keep_in"), CASES)
def test_shortest_of_all_in_the_region(
    seed: int, name: str, sign: Any, keep_in: bool
) -> None:
    asked = some_request(seed + 10 * keep_in, name, sign, keep_in=keep_in)
    plan = exact(**asked)
    loop, points, region = (
        loop_of(plan),
        asked["waypoints"],
        planning_region(plan.request, "red", sign, "flyable"),
    )
    assert plan.report.flyable
    expected = shortest(visibility(region.inner, points), points)
    assert loop.length == pytest.approx(expected, abs=1e-9)
    assert loop.lower_bound is not None
    assert shortest(visibility(region.outer, points), points) == pytest.approx(
        loop.lower_bound, abs=1e-9
    )
    assert loop.lower_bound <= loop.length + 1e-12
    holds_between_samples_too(loop, plan.request)
    keeps_to_the_polygons(loop, plan.request)
    passes_in_order(loop, plan)
    assert loop.length > perimeter(points)  # something was in the way


def string_under(curve: Any, start: Point, end: Point) -> float:
    """Length of a string from start to end, pulled up against a curve: the lower hull of the three, finely sampled."""
    x = np.linspace(start[0], end[0], 200_001)[1:-1]
    points = np.vstack([[start], np.column_stack([x, curve(x)]), [end]])
    hull = points[np.sort(ConvexHull(points).vertices)]
    # Of the hull the lower side: below the straight line from start to end.
    chord = np.array(end) - start
    lower = (
        chord[0] * (hull[:, 1] - start[1]) - chord[1] * (hull[:, 0] - start[0])
    ) <= 0
    return float(np.hypot(*np.diff(hull[lower], axis=0).T).sum())


@pytest.mark.no_cover
@pytest.mark.parametrize("kappa", [0.2, 0.9])
def test_along_the_curve_where_R_vanishes_against_a_string_under_it(
    kappa: float,
) -> None:
    vehicle = gg.Vehicle(drag_ratio=kappa)

    def border(x: Any) -> Any:
        return np.arctan(np.tan(x) - 2 * kappa)

    first = math.atan(kappa) - pi / 2 + 0.2
    start = (first, float(border(first)) - 0.01)
    end = (-start[1], -start[0])
    length = string_under(border, start, end)
    assert length > math.dist(start, end) + 1e-4
    for accuracy in (1e-3, 1e-4):
        asked: dict[str, Any] = {"vehicle": vehicle, "accuracy": accuracy, "floor": 2.0}
        loop = loop_of(exact([start, end], color="red", sign="negative", **asked))
        assert loop.lower_bound is not None
        assert loop.lower_bound - 1e-9 <= 2 * length <= loop.length + 1e-9
        assert loop.length - loop.lower_bound < 8 * accuracy
        assert len(loop.path.alpha) > 10


def test_between_straight_borders_the_bound_is_the_length() -> None:
    for accuracy in (1e-2, 1e-4):
        loop = loop_of(
            exact(G3.waypoints, color="red", keep_out=[WALL], accuracy=accuracy)
        )
        assert loop.lower_bound == pytest.approx(loop.length, abs=1e-14)
        # By hand: from a corner of the loop over both corners of the wall, instead of straight below them.
        left, right = (
            math.hypot(0.6 - pi / 8, pi / 8 - 0.2),
            math.hypot(3 * pi / 8 - 1.0, pi / 8 - 0.2),
        )
        assert loop.length == pytest.approx(3 * pi / 4 + left + 0.4 + right, abs=1e-12)


def test_robust_to_a_millionth() -> None:
    """A way as good as the worst waypoint exists: no loop is better, and the grid's is not."""
    points = [(0.3, -0.25), (1.3, -0.35), (1.2, -1.3)]
    quick, best = (
        exact(points, color="red", objective=objective)
        for objective in ("shortest", "robust")
    )
    grid = gg.plan_loop(
        points, color="red", objective="robust", method="grid", divisions=16
    )
    cap = float(least_singular_value_on_red(*np.array(points).T).min())
    value, other = (
        plan.report["least_singular_value"].value or 0.0 for plan in (best, grid)
    )
    assert value == pytest.approx(cap, abs=1e-6)
    assert value >= other - 1e-6
    assert loop_of(quick).length <= loop_of(best).length <= loop_of(grid).length + 1e-9


def test_robust_where_a_gate_is_the_worst_place(monkeypatch: Any) -> None:
    monkeypatch.setattr("gaitgraph.planning.any_angle._ROBUST_STEPS", 8)
    walls = [
        [(a, 0.6), (b, 0.6), (b, 0.7), (a, 0.7)]
        for a, b in ((-1.57, -1.3), (-1.25, 0.2))
    ]
    ends = [(-0.4, 0.45), (-0.4, 0.9)]
    plan = exact(
        ends,
        sign="positive",
        color="red",
        objective="robust",
        keep_out=walls,
        accuracy=0.1,
    )
    assert (plan.report.flyable, loop_of(plan).lower_bound) == (True, None)
    gate = float(least_singular_value_on_red(-1.25, 0.6))
    assert plan.report["least_singular_value"].value == pytest.approx(gate, abs=1e-5)


@pytest.mark.parametrize(("seed", "number"), [(40, 4), (41, 5), (42, 6)])
def test_any_order_is_the_best_of_all(seed: int, number: int) -> None:
    asked = some_request(seed, "exact", "negative", waypoints=number) | {
        "any_order": True
    }
    points, plan = asked["waypoints"], exact(**asked)
    graph = visibility(
        planning_region(plan.request, "red", "negative", "flyable").inner, points
    )
    ways = {
        a: nx.single_source_dijkstra_path_length(graph, a, weight="length")
        for a in points
    }
    orders = ([points[0], *rest] for rest in permutations(points[1:]))
    best = min(
        sum(ways[a][b] for a, b in pairwise([*order, order[0]])) for order in orders
    )
    assert loop_of(plan).length == pytest.approx(best, abs=1e-9)
    assert [points[k] for k in loop_of(plan).order] == list(plan.waypoints)
    passes_in_order(loop_of(plan), plan)
    assert best < shortest(graph, points) - 1e-6
    again = exact(
        **(
            asked
            | {
                "waypoints": [points[k] for k in loop_of(plan).order],
                "any_order": False,
            }
        )
    )
    assert loop_of(again).length == pytest.approx(best, abs=1e-12)


def test_a_straight_loop_is_the_shortest_and_needs_no_region() -> None:
    plan = exact(G3.waypoints, color="red", accuracy=0.1)
    loop = loop_of(plan)
    assert loop.length == loop.lower_bound == pytest.approx(pi, abs=1e-15)
    assert len(loop.path.alpha) == 4
    assert (
        loop_of(exact(G3.waypoints, color="red", objective="robust")).lower_bound
        == loop.length
    )
    assert straight_loop_flies(plan_request(G3.waypoints), "negative")
    assert not straight_loop_flies(plan_request(G3.waypoints), "positive")
    assert not straight_loop_flies(
        plan_request(G3.waypoints, keep_out=[WALL]), "negative"
    )


@pytest.mark.parametrize("name", VEHICLES)
def test_a_straight_loop_holds_where_its_report_says_so(name: str) -> None:
    """The quick answer is the report's, near every border; a step of 1e-5 to either side of it decides."""
    rng = np.random.default_rng(60)
    asked: dict[str, Any] = VEHICLES[name]
    counts = {True: 0, False: 0}
    for _ in range(20):
        center, size = rng.uniform(-1.2, 1.2, 2), 10 ** rng.uniform(-2, 0)
        points = np.clip(
            center + size * rng.uniform(-1, 1, (3, 2)), -1.57, 1.57
        ).tolist()
        floor = float(rng.uniform(0.05, 0.9))
        request = plan_request(points, floor=floor, **asked)
        gait = gg.lift(
            points, "red", vehicle=request.vehicle, coefficients=request.coefficients
        )
        found = any(straight_loop_flies(request, s) for s in ("positive", "negative"))
        report = gait.check(floor=floor)
        value = report["least_singular_value"].value
        if value is not None and abs(value - floor) > 1e-5:
            assert found is report.flyable
            counts[found] += 1
    assert min(counts.values()) > 1


def test_one_two_and_repeated_waypoints() -> None:
    point = exact(
        [(0.7, -0.9)],
        color="red",
        accuracy=1e-3,
        keep_out=[[(0.2, -0.4), (0.4, -0.4), (0.4, -0.2)]],
    )
    assert loop_of(point).length == loop_of(point).lower_bound == 0
    assert point.report.flyable
    there = exact(
        [(1.1, -0.35), (0.4, -0.35)], color="red", keep_out=[WALL], accuracy=1e-3
    )
    rows = loop_of(there).path.alpha[:, :2].tolist()
    assert rows == [
        [1.1, -0.35],
        [1.0, -0.2],
        [0.6, -0.2],
        [0.4, -0.35],
        [0.6, -0.2],
        [1.0, -0.2],
    ]
    twice = exact(
        [(1.1, -0.35), (1.1, -0.35), (0.4, -0.35), (1.1, -0.35)],
        color="red",
        keep_out=[WALL],
        accuracy=1e-3,
    )
    np.testing.assert_array_equal(loop_of(twice).path.alpha, loop_of(there).path.alpha)
    # The same place again later in the loop is passed again.
    again = exact(
        [(1.1, -0.35), (0.4, -0.35), (1.1, -0.35), (1.1, -1.0)],
        color="red",
        keep_out=[WALL],
        accuracy=1e-3,
    )
    assert loop_of(again).length == pytest.approx(
        loop_of(there).length + 1.3, abs=1e-12
    )


def test_waypoints_on_borders_and_corners_of_keep_outs() -> None:
    points = [(0.6, -0.4), (0.8, -0.2), (1.0, -0.6), (1.0, -0.2)]
    loop = loop_of(exact(points, color="red", keep_out=[WALL], accuracy=1e-3))
    # Along the wall: round its corners, nowhere away from it.
    assert loop.length == pytest.approx(
        0.2 + 0.2 + 0.2 + 0.4 + 0.4 + 0.4 + 0.2, abs=1e-12
    )
    assert (
        shapely.LinearRing(WALL)
        .buffer(1e-12)
        .covers(shapely.LineString(loop.path.alpha[:, :2]))
    )
    rng = np.random.default_rng(61)
    for seed in range(3):
        asked = some_request(62 + seed, "exact", "negative")
        walls = [shapely.Polygon(polygon).exterior for polygon in asked["keep_out"]]
        region = planning_region(plan_request(**asked), "red", "negative", "flyable")
        edges: list[Point] = []
        while len(edges) < 5:
            # Rounding leaves such a point a little inside the keep-out, or a little outside.
            at = walls[int(rng.integers(len(walls)))].interpolate(
                rng.uniform(), normalized=True
            )
            if region.component_of((at.x, at.y)) == 0:
                edges.append((at.x, at.y))
        plan = exact(**{**asked, "waypoints": edges})
        assert loop_of(plan).length == pytest.approx(
            shortest(visibility(region.inner, edges), edges), abs=1e-8
        )
        keeps_to_the_polygons(loop_of(plan), plan.request)


def test_waypoints_on_sides_of_the_square() -> None:
    points = [(pi / 2, -0.5), (0.8, -pi / 2), (0.4, -0.9)]
    loop = loop_of(exact(points, color="red", floor=0.01, accuracy=1e-3))
    assert loop.length == loop.lower_bound == perimeter(points)
    bent = loop_of(
        exact(
            [(pi / 2, -1.2), (pi / 2, -0.3)],
            color="red",
            accuracy=1e-3,
            keep_out=[[(1, -1), (2, -1), (2, -0.5)]],
        )
    )
    corner = (1.0, -1.0)
    assert bent.length == pytest.approx(
        2 * (math.dist((pi / 2, -1.2), corner) + math.dist(corner, (pi / 2, -0.3)))
    )


@pytest.mark.parametrize("beside", [1e-6, 1e-8, 1e-10])
def test_waypoints_closer_to_a_curved_border_than_its_polygon(beside: float) -> None:
    """Such a waypoint is outside the polygon inside the border, and the loop passes it all the same."""
    points = []
    for a1 in (0.25, 0.5):
        # Where the least singular value is the floor.
        border = brentq(
            lambda a2, a1=a1: float(least_singular_value_on_red(a1, a2)) - 0.5,
            -1.0,
            -0.167,
            xtol=1e-15,
        )
        points.append((a1, border - beside))
    plan = exact(
        [*points, (1.0, -1.0)], color="red", sign="negative", floor=0.5, accuracy=1e-3
    )
    loop = loop_of(plan)
    passes_in_order(loop, plan)
    assert loop.report.valid
    assert loop.length <= perimeter(plan.waypoints) + 8e-3


def test_a_blue_loop_bends_within_the_sign_that_rounding_leaves() -> None:
    points = [G1.angles[0], G1.angles[1], G1.angles[2]]
    wall = [(0.3, 0.5), (0.9, 0.5), (0.9, 0.9), (0.5, 1.1)]
    plan = exact(points, color="blue", keep_out=[wall], accuracy=1e-2)
    loop = loop_of(plan)
    assert (loop.color, loop.sign, loop.report.valid, loop.report.flyable) == (
        "blue",
        "negative",
        True,
        False,
    )
    region = planning_region(plan.request, "blue", "negative", "valid").inner
    assert loop.length == pytest.approx(
        shortest(visibility(region, points), points), abs=1e-9
    )
    keeps_to_the_polygons(loop, plan.request)
    # The published coefficients leave this sheet a sign of R, exact ones none.
    assert not exact(points, color="blue", keep_out=[wall], coefficients="exact")


@pytest.mark.parametrize(
    ("point", "request_", "told"),
    [
        ((0.8, -0.4), {"keep_out": [WALL], "sign": "negative"}, "keep_out"),
        ((0.5, -1.0), {"keep_in": [WALL], "sign": "negative"}, "keep_in"),
        ((0.5, 0.9), {"sign": "negative", "coefficients": "exact"}, "R = "),
        ((-1.5, -0.2), {"sign": "positive", "vehicle": STRONG}, "R = "),
        (
            (-0.3, -0.9),
            {"sign": "negative", "vehicle": MIRRORED, "keep_out": [WALL]},
            "R = ",
        ),
    ],
)
def test_a_waypoint_where_no_loop_may_be_is_told_with_the_nearest_place(
    point: Point, request_: dict[str, Any], told: str
) -> None:
    asked: dict[str, Any] = {"color": "red", "accuracy": 1e-4, **request_}
    plan = exact([point], **asked)
    (refusal,) = plan.refusals
    assert (refusal.kind, refusal.waypoints) == ("waypoint", (1,))
    assert told in refusal.message
    assert refusal.nearest is not None
    # It may be passed, as it is told too, and nothing nearer may: the region's rings and a disc around the point tell.
    spoken = re.search(
        r"the nearest admissible point is \((\S+), (\S+)\)", str(plan.reason)
    )
    assert spoken is not None
    for passed in (refusal.nearest, (float(spoken[1]), float(spoken[2]))):
        assert exact([passed], **asked)
        assert passed == pytest.approx(refusal.nearest, abs=5e-5)
    away = math.dist(refusal.nearest, point)
    region = planning_region(plan.request, "red", asked["sign"], "valid").inner
    dense = shapely.get_coordinates(shapely.segmentize(region, 1e-3))
    assert np.hypot(*(dense - point).T).min() >= away - 1e-12
    turns = np.linspace(0, 2 * pi, 721)[:-1]
    for share in (0.1, 0.5, 0.9, 0.999):
        disc = np.array(point) + share * away * np.column_stack(
            [np.cos(turns), np.sin(turns)]
        )
        assert not shapely.contains_xy(region, *disc.T).any()


def test_polygons_that_contradict_each_other_leave_nothing() -> None:
    around = [(0.5, -0.7), (1.1, -0.7), (1.1, -0.1), (0.5, -0.1)]
    plan = exact(
        [(0.8, -0.4)], color="red", sign="negative", keep_in=[WALL], keep_out=[around]
    )
    (refusal,) = plan.refusals
    assert (refusal.kind, refusal.nearest, "nearest" in str(plan.reason)) == (
        "waypoint",
        None,
        False,
    )


@pytest.mark.no_cover
@pytest.mark.parametrize(
    ("points", "request_"),
    [
        (
            [(1.1, -0.3), (0.3, -1.1)],
            {"vehicle": STRONG, "floor": 0.9, "sign": "negative", "color": "red"},
        ),
        (G3.waypoints, {"objective": "robust"}),
        (
            [(1.0, 0.7), (-0.7, -1.0)],
            {"floor": 2.0, "sign": "negative", "color": "red", "objective": "robust"},
        ),
        ([(1.0, 0.7), (-0.7, -1.0)], {"floor": 2.0, "sign": "negative"}),
        (
            [(0.3 + 0.1 * k, -0.4 - 0.5 * (k % 2)) for k in range(8)],
            {"any_order": True, "color": "red"},
        ),
        (
            [(0.9, -0.3), (0.3, -0.9)],
            {"keep_out": [[(0.5, -1.5), (0.7, -1.5), (0.7, 1.5), (0.5, 1.5)]]},
        ),
        (
            [(0.7, -0.9), (1.1, -0.8)],
            {"vehicle": gg.PAPER.replace(max_tilt=1.0, max_thrust=2.0)},
        ),
    ],
)
def test_requests_of_every_kind_are_planned_by_both(
    points: Any, request_: dict[str, Any]
) -> None:
    """Whenever the grid plans, exact plans too: as valid, as flyable, and never longer or less robust."""
    grid = gg.plan_loop(points, method="grid", divisions=16, **request_)
    best = exact(points, accuracy=1e-5, **request_)
    loop = loop_of(best)
    if grid.loop is None:
        return
    assert loop.report.valid or not grid.report.valid
    assert loop.report.flyable or not grid.report.flyable
    if request_.get("objective") == "robust":
        values = [
            plan.report["least_singular_value"].value or 0.0 for plan in (grid, best)
        ]
        assert values[1] >= values[0] - 1e-4
    elif loop.report.flyable == grid.report.flyable:
        assert (
            loop.length <= grid.loop.length + 1e-8
        )  # a grid takes what is nearer than 1e-9 to a node for the node
    if (
        loop.lower_bound is not None
        and loop.sign == grid.loop.sign
        and (grid.report.flyable or not loop.report.flyable)
    ):
        assert grid.loop.length >= loop.lower_bound - 1e-8


def least_step(plan: gg.Plan) -> float:
    """Return the length of the shortest side of a planned loop in the (α1, α2) plane."""
    corners = plan.gait.alpha[:, :2]
    steps = np.diff(np.vstack([corners, corners[:1]]), axis=0)
    return float(np.linalg.norm(steps, axis=1).min())


def test_a_robust_loop_keeps_the_waypoint_that_is_its_worst_point() -> None:
    """The margin of the region leaves it out; no second corner is made beside it."""
    points = [(-1.0, 0.3), (-0.3, 0.6), (-1.0, 0.9)]
    plan = gg.plan_loop(
        points,
        vehicle=gg.Vehicle(mass=1.2, arm_length=0.25, drag_to_thrust=0.02),
        keep_out=[[(-1.1, 0.55), (-0.6, 0.55), (-0.6, 0.65), (-1.1, 0.65)]],
        objective="robust",
        accuracy=1e-3,
    )
    assert least_step(plan) > 1e-2
    for point in points:
        assert np.abs(plan.gait.alpha[:, :2] - point).max(axis=1).min() == 0.0


@pytest.mark.parametrize("inside", [1e-9, 1e-7, 5e-7, 1.1e-6])
def test_a_waypoint_beside_a_line_where_rotors_idle_is_one_corner(
    inside: float,
) -> None:
    delta = gg.invertibility.coefficients_of(kind="exact").delta
    plan = gg.plan_loop(
        [(delta - inside, 0.5), (-0.1, 0.8), (-0.5, 0.5)],
        keep_out=[[(-0.3, 0.6), (0.05, 0.6), (0.05, 0.7), (-0.3, 0.7)]],
    )
    assert plan.report.flyable
    assert least_step(plan) > 0.1


def test_a_level_that_coarse_polygons_decide_holds_for_the_waypoints_themselves() -> (
    None
):
    (x1, y1), (x2, y2) = (0.328092, 0.331851), (0.015763, 0.104221)
    vehicle = gg.Vehicle(
        mass=1.89512860427698,
        drag_to_thrust=[0.067944, 0.085899, 0.067944, 0.085899],
        first_rotor_spin="counterclockwise",
        rotor_positions=[[x1, y1, 0], [x2, y2, 0], [-x1, -y1, 0], [-x2, -y2, 0]],
    )
    waypoints = [
        [1.2374391588481983, -0.44338788899743525],
        [-0.029964494697048538, -0.49019643591110695],
        [0.12391855119641232, -0.533285054285136],
        [0.45540523605214445, -0.23174732929041597],
        [0.2521090327265937, -0.5556704903865373],
    ]
    for any_order in (False, True):
        plan = gg.plan_loop(
            waypoints, vehicle=vehicle, objective="robust", any_order=any_order
        )
        assert plan, plan.reason


def test_a_deadline_ends_the_search_for_an_order_and_says_so() -> None:
    waypoints = (
        np.random.default_rng(3).uniform((-1.3, 0.25), (-0.25, 1.3), (40, 2)).tolist()
    )
    late = gg.plan_loop(waypoints, any_order=True, deadline=0.0)
    assert late.loop is not None
    assert not late.loop.in_time
    assert not late.loop.order_exact
    assert sorted(late.loop.order) == list(range(40))
    assert any("the deadline passed" in warning for warning in late.warnings)
    given = gg.plan_loop(waypoints)
    assert given.loop is not None
    assert late.loop.length < given.loop.length
    whole = gg.plan_loop(waypoints, any_order=True, deadline=60.0)
    assert whole == gg.plan_loop(waypoints, any_order=True)
    with pytest.raises(gg.InputError, match="deadline must be"):
        gg.plan_loop(waypoints, deadline=-1.0)
