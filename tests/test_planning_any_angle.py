"""Any-angle loops: the shortest of all against visibility graphs built edge by edge, their bounds, and hard cases."""

from __future__ import annotations

import math
from itertools import pairwise, permutations
from math import pi
from typing import TYPE_CHECKING, Any

import networkx as nx
import numpy as np
import pytest
import shapely
from hypothesis import given, settings, strategies as st
from scipy.optimize import brentq

import gaitgraph as gg
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.invertibility.matrices import least_singular_value
from gaitgraph.planning.any_angle import straight_loop
from gaitgraph.planning.branch import Branch, Search
from gaitgraph.planning.request import plan_request
from tests.published import GAITS
from tests.samples import (
    MIRRORED,
    loop_of,
    on_red,
    planning_region,
    random_vehicle,
    replan_requests,
    visibility_graph,
)

if TYPE_CHECKING:
    from gaitgraph.planning.planner import Plan

STRONG = gg.Vehicle(drag_ratio=0.4)
WALL = [(0.6, -0.6), (1.0, -0.6), (1.0, -0.2), (0.6, -0.2)]
BLOCKED: dict[str, Any] = {"keep_out": [WALL], "color": "red", "accuracy": 1e-3}
FENCE = [(0.5, -1.5), (0.7, -1.5), (0.7, 1.5), (0.5, 1.5)]
VEHICLES: list[dict[str, Any]] = [
    {},
    {"coefficients": "exact"},
    {"vehicle": "beetle_omni"},
    {"vehicle": STRONG},
    {"vehicle": MIRRORED},
]
signs = pytest.mark.parametrize("sign", ["positive", "negative"])


def exact(waypoints: Any, **request: Any) -> Plan:
    return gg.plan_loop(waypoints, **{"method": "exact", **request})


# -- The shortest of all


def bending_corners(region: Any) -> set[tuple[float, float]]:
    """Return the corners with more than half a turn inside: no other can hold a taut string."""
    bending = set()
    for part in shapely.orient_polygons(region).geoms:
        for ring in (part.exterior, *part.interiors):
            points = np.array(ring.coords[:-1])
            after = np.roll(points, -1, axis=0) - points
            before = np.roll(after, 1, axis=0)
            turn = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
            bending |= {(x, y) for x, y in points[turn < 1e-15].tolist()}
    return bending


def shortest_in(region: Any, points: Any, *, any_order: bool) -> float:
    """Return the length of the shortest loop in a polygon, in order or in the best order."""
    graph = visibility_graph(region, {*bending_corners(region), *points})
    lengths: Any = dict(nx.all_pairs_dijkstra_path_length(graph, weight="length"))
    orders = permutations(points[1:]) if any_order else [points[1:]]
    return min(
        float(sum(lengths[a][b] for a, b in pairwise([points[0], *order, points[0]])))
        for order in orders
    )


def check_shortest(plan: Plan) -> None:
    """Check a loop against visibility graphs of the region's polygons inside and outside its borders."""
    loop, request = loop_of(plan), plan.request
    color: Any = loop.path.color
    require: Any = "flyable" if plan.report.flyable else "valid"
    region = planning_region(request, color, loop.sign, require)
    points = list(request.waypoints)
    inner = shortest_in(region.inner, points, any_order=request.any_order)
    outer = shortest_in(region.outer, points, any_order=request.any_order)
    assert loop.length == pytest.approx(inner, abs=1e-8)
    assert loop.lower_bound == pytest.approx(outer, abs=1e-8)
    path = [tuple(row) for row in loop.path.alpha[:, :2].tolist()]
    assert list(plan.waypoints) == [points[k] for k in loop.order]
    at = 0
    for point in plan.waypoints:
        at = path.index(point, at)
    line = shapely.LineString([*path, path[0]])
    for polygon in request.keep_out:
        assert not line.intersects(shapely.Polygon(polygon).buffer(-1e-9))
    for polygon in request.keep_in:
        assert shapely.Polygon(polygon).buffer(1e-9).covers(line)


@signs
@pytest.mark.parametrize("asked", VEHICLES)
def test_a_loop_is_the_shortest_of_all(asked: dict[str, Any], sign: Any) -> None:
    asked = {**asked, "sign": sign, "color": "red", "accuracy": 1e-3, "floor": 0.3}
    region = planning_region(plan_request([(0, 0)], **asked), "red", sign, "flyable")
    planned = 0
    for _, stops, keep_out in replan_requests(region, np.random.default_rng(7), 5):
        points = [tuple(stop) for stop in stops[:5]]
        for any_order in (False, True):
            plan = exact(points, keep_out=keep_out, any_order=any_order, **asked)
            forbidden = shapely.union_all([shapely.Polygon(one) for one in keep_out])
            inside = shapely.intersects(forbidden, shapely.points(points))
            assert bool(plan) or inside.any()
            if plan:
                check_shortest(plan)
                planned += 1
    assert planned > 1


DELTA = coefficients_of(kind="exact").delta


# On sides and corners of a keep-out, and of the square of all angles.
ON_SIDES = [(0.6, -0.4), (0.8, -0.2), (1.0, -0.6), (1.0, -0.2)]


ON_SQUARE = [(pi / 2, -0.5), (0.8, -pi / 2), (0.4, -0.9)]


ACROSS = [[(1, -1), (2, -1), (2, -0.5)]]


BESIDE_BLUE = [[(0.3, 0.5), (0.9, 0.5), (0.9, 0.9), (0.5, 1.1)]]


@pytest.mark.parametrize(
    ("points", "options"),
    [
        # One waypoint, and the same again at once and later.
        ([(0.7, -0.9)], {}),
        ([(1.1, -0.35), (1.1, -0.35), (0.4, -0.35), (1.1, -0.35)], {}),
        ([(1.1, -0.35), (0.4, -0.35), (1.1, -0.35), (1.1, -1.0)], {}),
        (ON_SIDES, {}),
        (ON_SQUARE, {"floor": 0.01}),
        ([(pi / 2, -1.2), (pi / 2, -0.3)], {"keep_out": ACROSS}),
        ([(0.7, -0.5), (0.9, -0.3)], {"keep_in": [WALL], "keep_out": []}),
        # Blue, whose sign of R is left by rounding.
        (GAITS[0].angles[:3], {"color": "blue", "keep_out": BESIDE_BLUE}),
    ],
)
def test_so_it_is_in_hard_cases(points: Any, options: Any) -> None:
    check_shortest(exact(points, **{**BLOCKED, "require": "valid", **options}))


@pytest.mark.parametrize("beside", [1e-6, 1e-8, 1e-10])
def test_waypoints_closer_to_a_curved_border_than_its_polygon_are_passed(
    beside: float,
) -> None:
    def above_floor(a2: float, a1: float) -> float:
        return float(least_singular_value(on_red(a1, a2))) - 0.5

    borders = [brentq(above_floor, -1.0, -0.167, (a1,), 1e-15) for a1 in (0.25, 0.5)]
    points = [(0.25, borders[0] - beside), (0.5, borders[1] - beside), (1.0, -1.0)]
    plan = exact(points, color="red", sign="negative", floor=0.5, accuracy=1e-3)
    straight = sum(math.dist(a, b) for a, b in pairwise([*points, points[0]]))
    assert set(points) <= corners_of(plan)
    assert loop_of(plan).length <= straight + 8e-3


def corners_of(plan: Plan) -> set[tuple[float, ...]]:
    return {tuple(row) for row in plan.gait.alpha[:, :2].tolist()}


def test_a_straight_loop_is_taken_where_its_report_allows_it() -> None:
    """The quick answer is the report's, near every border; a step of 1e-5 to either side of it decides."""
    rng = np.random.default_rng(60)
    seen = []
    for _ in range(60):
        around = rng.uniform(-1.2, 1.2, 2) + rng.uniform(-1, 1, (3, 2)) ** 3
        points = np.clip(around, -1.57, 1.57).tolist()
        asked: Any = {"floor": float(rng.uniform(0.05, 0.9))}
        vehicle = random_vehicle(rng)
        report = gg.lift(points, "red", vehicle=vehicle).check(**asked)
        if abs((report["least_singular_value"].value or 0) - asked["floor"]) < 1e-5:
            continue
        search = Search(plan_request(points, vehicle=vehicle, **asked))
        loops = [
            straight_loop(Branch(search=search, color="red", sign=sign, require=FLIES))
            for sign in SIGNS
        ]
        assert any(loops) is report.flyable
        seen.append(report.flyable)
    assert 5 < sum(seen) < len(seen) - 5


SIGNS: tuple[Any, ...] = ("positive", "negative")
FLIES: Any = "flyable"


# -- The most robust of all
GATE = [
    [(a, 0.6), (b, 0.6), (b, 0.7), (a, 0.7)] for a, b in ((-1.57, -1.3), (-1.25, 0.2))
]


FREE = [(0.3, -0.25), (1.3, -0.35), (1.2, -1.3)]


# -- The most robust of all


@pytest.mark.parametrize(
    ("points", "keep_out", "worst"),
    [(FREE, [], FREE), ([(-0.4, 0.45), (-0.4, 0.9)], GATE, [(-1.25, 0.6)])],
)
def test_no_loop_is_more_robust(
    points: Any, keep_out: Any, worst: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A loop is as robust as the worst of its waypoints, or of a gate between them."""
    monkeypatch.setattr("gaitgraph.planning.any_angle._ROBUST_STEPS", 12)
    asked: Any = {"objective": "robust", "keep_out": keep_out, "accuracy": 0.01}
    plan = exact(points, **asked)
    best = least_singular_value(on_red(*np.array(worst).T)).min()
    value = plan.report["least_singular_value"].value
    assert value == pytest.approx(best, abs=1e-5)
    valid = exact(points, require="valid", floor=2.0, **asked)
    assert valid.report["least_singular_value"].value >= best - 1e-5
    assert loop_of(exact(points, keep_out=keep_out)).length <= loop_of(plan).length
    # Of a bent one no bound is known: a less robust one may be shorter.
    known = None if keep_out else loop_of(plan).length
    assert loop_of(plan).lower_bound == known


# Where coarse polygons decide a level wrongly for the waypoints themselves.
(X1, Y1), (X2, Y2) = (0.328092, 0.331851), (0.015763, 0.104221)
UNEVEN = gg.Vehicle(
    mass=1.89512860427698,
    drag_to_thrust=[0.067944, 0.085899, 0.067944, 0.085899],
    first_rotor_spin="counterclockwise",
    rotor_positions=[[X1, Y1, 0], [X2, Y2, 0], [-X1, -Y1, 0], [-X2, -Y2, 0]],
)
COARSE = [
    (1.2374391588481983, -0.44338788899743525),
    (-0.029964494697048538, -0.49019643591110695),
    (0.12391855119641232, -0.533285054285136),
    (0.45540523605214445, -0.23174732929041597),
    (0.2521090327265937, -0.5556704903865373),
]


def test_a_level_that_coarse_polygons_decide_holds_for_the_waypoints() -> None:
    assert exact(COARSE, vehicle=UNEVEN, objective="robust")


SMALL = gg.Vehicle(mass=1.2, arm_length=0.25, drag_to_thrust=0.02)
BAR = [(-1.1, 0.55), (-0.6, 0.55), (-0.6, 0.65), (-1.1, 0.65)]
BESIDE = [[(-0.3, 0.6), (0.05, 0.6), (0.05, 0.7), (-0.3, 0.7)]]


NEAR_LINE = [
    ([(DELTA - inside, 0.5), (-0.1, 0.8), (-0.5, 0.5)], {"keep_out": BESIDE})
    for inside in (1e-9, 1e-7, 5e-7, 1.1e-6)
]


ROBUST = {"vehicle": SMALL, "keep_out": [BAR], "objective": "robust"}


@pytest.mark.parametrize(
    ("points", "options"),
    [
        # The worst point of a robust loop, which the margin of the region leaves out; beside a line where rotors idle.
        ([(-1.0, 0.3), (-0.3, 0.6), (-1.0, 0.9)], ROBUST),
        *NEAR_LINE,
    ],
)
def test_a_waypoint_beside_a_border_is_one_corner(points: Any, options: Any) -> None:
    plan = exact(points, accuracy=1e-3, **options)
    corners = plan.gait.alpha[:, :2]
    steps = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
    assert steps.min() > 1e-2
    assert set(points) <= corners_of(plan)


# -- Beside the grid, places that are told, and time
quadrant = st.tuples(st.floats(0.2, 1.3), st.floats(-1.3, -0.2))


OPTIONS: list[dict[str, Any]] = [
    {"objective": "robust"},
    {"floor": 2.0},
    {"any_order": True, "color": "red"},
    {"keep_out": [FENCE]},
    {"vehicle": gg.PAPER.replace(max_tilt=1.0, max_thrust=2.0)},
]


# -- Beside the grid, places that are told, and time


@pytest.mark.no_cover
@settings(deadline=None, max_examples=6)
@given(
    points=st.lists(quadrant, min_size=2, max_size=4), options=st.sampled_from(OPTIONS)
)
def test_it_is_never_worse_than_the_grid(points: Any, options: dict[str, Any]) -> None:
    asked: Any = {"require": "valid", "sign": "negative", **options}
    grid = gg.plan_loop(points, divisions=16, **asked)
    if grid.loop is None:
        return
    plan = exact(points, accuracy=1e-5, **asked)
    assert plan.report.flyable or not grid.report.flyable
    if plan.report.flyable != grid.report.flyable:
        return
    if "objective" in asked:
        values = [each.report["least_singular_value"].value for each in (plan, grid)]
        assert (values[0] or 0.0) >= (values[1] or 0.0) - 1e-4
    else:  # a grid takes what is nearer than 1e-9 to a node for the node
        assert loop_of(plan).length <= grid.loop.length + 1e-8


def test_a_deadline_ends_the_search_for_an_order_and_says_so() -> None:
    rng = np.random.default_rng(3)
    waypoints = rng.uniform((-1.3, 0.25), (-0.25, 1.3), (40, 2)).tolist()
    late = exact(waypoints, any_order=True, deadline=0.0)
    assert not loop_of(late).in_time
    assert sorted(loop_of(late).order) == list(range(40))
    assert any("the deadline ended" in warning for warning in late.warnings)
    assert loop_of(late).length < loop_of(exact(waypoints)).length
    whole = exact(waypoints, any_order=True, deadline=60.0)
    assert whole == exact(waypoints, any_order=True)
