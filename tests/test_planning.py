"""Plans: the paper's gaits, preferences, alternatives, refusals with certificates."""

from __future__ import annotations

import json
import math
import re
from math import pi
from typing import TYPE_CHECKING, Any

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import gaitgraph as gg
from gaitgraph.graph.build import surface_graph
from tests.published import GAITS, PublishedGait
from tests.samples import along, loop_of

if TYPE_CHECKING:
    from gaitgraph.planning.planner import Plan

G1, _, G3, _ = GAITS


def on_grid(waypoints: Any, **request: Any) -> Plan:
    """Plan by the paper's method and rules; what any-angle loops do is tested in test_planning_any_angle."""
    method = {} if "graph" in request else {"method": "grid"}
    return gg.plan_loop(waypoints, **{"require": "valid", **method, **request})


@pytest.mark.parametrize("gait", GAITS, ids=lambda gait: f"gait{gait.number}")
def test_the_papers_gaits_plan_themselves(gait: PublishedGait) -> None:
    plan = on_grid(gait.waypoints, color=gait.color)
    assert plan
    assert (loop_of(plan).color, loop_of(plan).sign) == (gait.color, gait.sign)
    assert plan.report.valid
    assert plan.report.flyable is gait.flyable
    assert plan.report.reachable_from_hover is gait.reachable
    assert len(plan.gait.alpha) == 4
    np.testing.assert_allclose(
        plan.gait.alpha, np.column_stack([gait.angles, gait.printed]), atol=5.0001e-4
    )
    np.testing.assert_allclose(plan.timed().vertices(), plan.gait.alpha)
    assert len(loop_of(plan).path.alpha) == 16
    assert loop_of(plan).length == pytest.approx(pi)
    assert (plan.reason is None) is gait.flyable
    assert (plan.report.reachability in plan.warnings) is (not gait.reachable)
    backward = on_grid(gait.waypoints, color=gait.color, reverse=True)
    assert plan.waypoints == plan.request.waypoints
    np.testing.assert_array_equal(plan.gait.reversed().alpha, backward.gait.alpha)
    assert backward.waypoints[1] == plan.waypoints[3]


@pytest.mark.parametrize("method", ["grid", "exact"])
def test_a_flyable_detour_beats_a_shorter_valid_loop(method: Any) -> None:
    """Straight between these two the least singular value dips under the floor; a detour keeps it."""
    vehicle = gg.Vehicle(drag_ratio=0.4)
    points = [("3pi/8", "-pi/8"), ("pi/8", "-3pi/8")]
    plan = gg.plan_loop(
        points,
        color="red",
        sign="negative",
        floor=0.9,
        vehicle=vehicle,
        method=method,
        accuracy=1e-4,
        require="valid",
    )
    assert plan.reason is None
    assert plan.report.flyable
    (straight,) = plan.alternatives
    assert straight.report.valid
    assert not straight.report.flyable
    assert straight.length < loop_of(plan).length
    assert straight.length == pytest.approx(pi / 2 * math.sqrt(2))
    for loop, above in ((loop_of(plan), True), (straight, False)):
        least = gg.invertibility.least_singular_value(
            along(loop.gait.alpha, 501), vehicle
        ).min()
        assert bool(least >= 0.9) is above


def test_a_loop_that_only_the_clock_forbids_is_preferred_to_one_that_physics_forbids() -> (
    None
):
    vehicle = gg.Vehicle(drag_ratio=0.4, max_tilt_rate=0.1)
    points = [("3pi/8", "-pi/8"), ("pi/8", "-3pi/8")]
    plan = on_grid(points, color="red", sign="negative", floor=0.9, vehicle=vehicle)
    assert [check.name for check in plan.report.checks if not check.ok] == ["tilt_rate"]
    assert "needs a period of at least" in str(plan.reason)
    (shorter,) = plan.alternatives
    assert shorter.length < loop_of(plan).length


def test_plans_repeat_and_serialise() -> None:
    first, second = (
        json.dumps(on_grid(G3.waypoints).as_mapping(), allow_nan=False)
        for _ in range(2)
    )
    assert first == second
    keys = list(json.loads(first))
    assert " ".join(keys) == (
        "status reason advice color sign waypoints path types colors length lower_bound order_exact corners vertices "
        "alternatives valid two_color flyable reachable_from_hover not_judged hover_power hover_power_over checks "
        "warnings refusals crossing_tolerance method request"
    )
    refused = json.loads(
        json.dumps(on_grid(G1.waypoints, coefficients="exact").as_mapping())
    )
    assert list(refused) == keys
    assert (refused["status"], refused["path"], refused["length"]) == (
        "infeasible",
        [],
        None,
    )
    assert refused["valid"] is refused["flyable"] is False


points = st.lists(
    st.tuples(st.floats(-1.57, 1.57), st.floats(-1.57, 1.57)), min_size=1, max_size=3
)


@pytest.mark.no_cover
@settings(deadline=None, max_examples=8)
@given(points=points, divisions=st.integers(3, 20))
def test_whatever_is_planned_holds_when_sampled(
    points: list[tuple[float, float]], divisions: int
) -> None:
    plan: Plan = on_grid(points, divisions=divisions)
    if plan.loop is None:
        assert plan.refusals
        return
    assert plan.report.valid
    gait, passed = plan.gait, along(plan.gait.alpha, 101)
    for residual in (
        gg.invertibility.roll_sensitivity,
        gg.invertibility.pitch_sensitivity,
    ):
        assert np.abs(residual(passed, gait.coefficients)).max() < 1e-10
    R = gg.invertibility.level_determinant(passed, gait.coefficients)
    assert R.min() * R.max() > 0 or not plan.report["R_sign"].decided
    for point in plan.waypoints:
        assert (
            np.abs(loop_of(plan).path.alpha[:, :2] - point).max(axis=1).min() <= 1e-9
        )  # what is closer is one node
    if plan.report.flyable:
        assert gg.invertibility.least_singular_value(passed).min() >= 0.05
        assert gg.invertibility.hover_thrust_shares(passed).min() > 0


def test_robust_ties_are_ties() -> None:
    """Two waypoints whose own least singular value is the worst case: the straight way is as robust as any."""
    for points, divisions in (
        ([("-pi/8", "3pi/8"), ("-pi/8", "5pi/16")], 16),
        ([("-3pi/8", "pi/8"), ("-3pi/8", "0")], 8),
    ):
        shortest, robust = (
            on_grid(
                points,
                color="red",
                sign="positive",
                divisions=divisions,
                objective=objective,
            )
            for objective in ("shortest", "robust")
        )
        assert loop_of(robust).length == pytest.approx(loop_of(shortest).length)


def test_blue_edges_with_a_tiny_R_of_one_sign_are_used() -> None:
    for divisions, cells in ((40, ((5, 1), (5, 2))), (32, ((1, 27), (1, 28)))):
        points = [tuple(-pi / 2 + k * pi / divisions for k in cell) for cell in cells]
        plan = on_grid(points, divisions=divisions, color="blue", sign="negative")
        assert loop_of(plan).length == pytest.approx(2 * pi / divisions)


def test_a_vehicle_may_be_a_mapping_and_polygons_arrays() -> None:
    square = np.array([(0.6, -0.6), (1.0, -0.6), (1.0, -0.2), (0.6, -0.2)])
    plan = on_grid(
        G3.waypoints, vehicle={"drag_ratio": 0.1}, keep_out=np.array([square])
    )
    assert plan.request.vehicle.drag_ratio == 0.1
    assert loop_of(plan).length > pi


def test_any_order_beyond_nine_waypoints_says_that_it_is_approximate() -> None:
    points = [(0.3 + 0.1 * k, -0.4 - 0.5 * (k % 2)) for k in range(10)]
    plan = on_grid(points, any_order=True, color="red")
    ordered = on_grid(points, color="red")
    assert loop_of(plan).length < loop_of(ordered).length
    assert sorted(loop_of(plan).order) == list(range(10))
    (warning,) = [text for text in plan.warnings if "order of the waypoints" in text]
    assert "is approximate" in warning
    assert plan.as_mapping()["order_exact"] is False
    assert loop_of(on_grid(points[:9], any_order=True)).order_exact
    assert loop_of(ordered).order_exact


def test_the_loop_is_made_for_the_request() -> None:
    vehicle = gg.PAPER.replace(max_tilt_rate=20.0)
    for kind in ("published", "printed", "exact"):
        plan = on_grid(
            G3.waypoints,
            vehicle=vehicle,
            coefficients=kind,
            divisions=8,
            floor=0.01,
            period=3.0,
            law="constant-speed",
        )
        for gait in (loop_of(plan).path, loop_of(plan).gait, plan.gait):
            assert gait.vehicle == vehicle
            assert gait.coefficients == gg.invertibility.coefficients_of(vehicle, kind)
            assert gait.crossing_tolerance == pi / 16
        assert plan.report["least_singular_value"].limit == 0.01
        rate = plan.report["tilt_rate"].value
        timed = plan.gait.parametrize(3.0, law="constant-speed")
        assert rate == timed.check()["tilt_rate"].value
        assert loop_of(plan).path.color == loop_of(plan).gait.color == "red"
        assert loop_of(plan).order == (0, 1, 2, 3)


def on_sheet(color: str, point: tuple[float, float]) -> float:
    """Return R of equation (6) on a sheet, from the planes themselves."""
    (a1, a2), delta = point, gg.invertibility.coefficients_of().delta
    a3, a4 = (a1, a2) if color == "red" else (2 * delta - a1, -2 * delta - a2)
    a3, a4 = (
        angle - pi * round(angle / pi) for angle in (a3, a4)
    )  # a shift by π turns the sign of R
    return float(
        gg.invertibility.level_determinant(
            [a1, a2, a3, a4], gg.invertibility.coefficients_of()
        )
    )


WALL = [(0.6, -0.6), (1.0, -0.6), (1.0, -0.2), (0.6, -0.2)]
FENCES = [[(x, -1.6), (x + 0.2, -1.6), (x + 0.2, 1.6), (x, 1.6)] for x in (0.0, 0.5)]
CORNER = [(1.5, 0.4), (1.6, 0.4), (1.6, 0.6), (1.5, 0.6)]
RED_BELOW: dict[str, Any] = {"color": "red", "sign": "negative"}
ON_LINE = gg.invertibility.coefficients_of(kind="exact").delta - pi / 2
ASKED: dict[str, tuple[Any, dict[str, Any]]] = {
    "first": (
        [(-0.5, 0.5), (-1.5, 0.5)],
        {},
    ),  # with either sign each has a root of one color
    "exact": ([(0.5, -0.5), (-0.5, 0.5)], {"coefficients": "exact"}),
    "merged": ([(0.5, -0.5), (0.5, -0.5), (-0.5, 0.5)], RED_BELOW),
    "forbidden": ([(0.3, -0.9), (0.8, -0.4)], {"keep_out": [WALL], **RED_BELOW}),
    "forbidden blue": (
        [(0.8, -0.4)],
        {"color": "blue", "sign": "negative", "keep_out": [WALL]},
    ),
    "singular": ([(ON_LINE, 0.3)], {"color": "red", "coefficients": "exact"}),
    "both signs": (
        [(pi / 2, 0.5)],
        {"color": "red", "keep_out": [CORNER]},
    ),  # α3 = ±π/2 both solve
    "walls": ([(1.2, -0.6), (1.1, -0.7), (-1.5, 0.5)], RED_BELOW),
    "last leg": ([(-1.5, 0.5), (-1.5, 0.5), (1.2, -0.6)], RED_BELOW),
    "strong drag": (
        [(1.2, -0.6), (-1.5, 0.5)],
        {"vehicle": gg.Vehicle(drag_ratio=0.4), **RED_BELOW},
    ),
    "one sign": ([(0, 0), (-1.5, -1.55)], {"color": "red", "sign": "positive"}),
    "fence": ([(0.9, -0.3), (0.3, -0.9)], {"keep_out": FENCES[1:], **RED_BELOW}),
    # Blue has no walls but the fence; red would have the curve between these two.
    "blue fence": (
        [(0.9, -0.3), (-0.5, 0.5)],
        {"color": "blue", "sign": "negative", "keep_out": FENCES[:1]},
    ),
}
ANSWERED = f"""
first / red, R > 0: waypoint 2 (-1.5000, 0.5000) has R = -0.8568
first / blue, R > 0: waypoint 1 (-0.5000, 0.5000) has R = -0.0002587
first / red, R < 0: waypoint 1 (-0.5000, 0.5000) has R = 8.29
first / blue, R < 0: waypoint 2 (-1.5000, 0.5000) has R = 0.0001191
exact / red, R > 0: waypoint 1 (0.5000, -0.5000) has R = -6.336
exact / blue: with exact coefficients R = 0 on the whole blue sheet, so the matrix is singular there
exact / red, R < 0: waypoint 2 (-0.5000, 0.5000) has R = 8.289
exact / blue: with exact coefficients R = 0 on the whole blue sheet, so the matrix is singular there
merged / red, R < 0: waypoint 2 (-0.5000, 0.5000) has R = 8.29
forbidden / red, R < 0: waypoint 2 (0.8000, -0.4000) lies in keep_out or outside keep_in
forbidden blue / blue, R < 0: waypoint 1 (0.8000, -0.4000) lies in keep_out or outside keep_in
singular / red, R > 0: waypoint 1 ({ON_LINE:.4f}, 0.3000) has R = 0, where the matrix is singular
singular / red, R < 0: waypoint 1 ({ON_LINE:.4f}, 0.3000) has R = 0, where the matrix is singular
both signs / red, R > 0: waypoint 1 (1.5708, 0.5000) lies in keep_out or outside keep_in
both signs / red, R < 0: waypoint 1 (1.5708, 0.5000) lies in keep_out or outside keep_in
walls / red, R < 0: waypoints 2 and 3 are separated by the line α1 = {ON_LINE:.4f} (β1 = ∓π/2) and the curve
last leg / red, R < 0: waypoints 1 and 2 are separated by the line α1 = {ON_LINE:.4f} (β1 = ∓π/2) and the curve
strong drag / red, R < 0: waypoints 1 and 2 are separated by the line α1 = {math.atan(0.4) - pi / 2:.4f} (β1 = ∓π/2) \
and the curve tan α1 − tan α2 = 2κ = 0.8000
one sign / red, R > 0: waypoints 1 and 2 are separated by the line α1 = {ON_LINE:.4f} (β1 = ∓π/2) and the curve
fence / red, R < 0: waypoints 1 and 2 are separated by
blue fence / blue, R < 0: waypoints 1 and 2 are separated by
"""


@pytest.mark.parametrize("method", ["grid", "exact"])
@pytest.mark.parametrize("name", ASKED)
def test_each_color_and_sign_without_a_loop_is_refused_with_what_is_in_its_way(
    name: str, method: Any
) -> None:
    points, options = ASKED[name]
    plan = gg.plan_loop(points, method=method, require="valid", **options)
    assert (plan.status, bool(plan)) == ("infeasible", False)
    messages = [
        line.split(" / ")[1]
        for line in ANSWERED.splitlines()
        if line.startswith(f"{name} / ")
    ]
    listed = sorted(
        plan.refusals, key=lambda one: (one.sign == "negative", one.color == "blue")
    )
    for refusal, message in zip(listed, messages, strict=True):
        assert refusal.message.startswith(message)
        ending = refusal.message.removeprefix(message)
        named = re.search(r"waypoints? (\d)(?: and (\d))?", message)
        numbers = [int(number) for number in named.groups() if number] if named else []
        assert list(refusal.waypoints) == numbers
        assert refusal.kind == ("color", "waypoint", "separated")[len(numbers)]
        if refusal.kind == "waypoint":
            assert ending.startswith("; the nearest admissible point")
            R = on_sheet(refusal.color, plan.request.waypoints[numbers[0] - 1])
            if name == "both signs":
                R = abs(R) * (1 if refusal.sign == "positive" else -1)
            assert refusal.R == pytest.approx(
                R, abs=2e-3 if "coefficients" in options else 1e-12
            )
        elif "fence" in name:
            grid = " keep_out, keep_in or the grid of 16 divisions: try more divisions"
            assert ending.startswith(
                grid
                if method == "grid"
                else " keep_out or keep_in: move these or one of"
            )
    assert plan.reason == "no closed loop: " + "; ".join(
        dict.fromkeys(one.message for one in plan.refusals)
    )
    assert plan.warnings == ("merged 1 waypoint that repeated the one before",) * (
        len(points) > len(plan.waypoints)
    )
    for ask in (lambda: plan.gait, lambda: plan.report, plan.timed):
        with pytest.raises(gg.Infeasible, match=re.escape(str(plan.reason))):
            ask()


LOW, BLUE = (
    [("3pi/8", "3pi/8"), ("pi/8", "pi/8")],
    "blue: with exact coefficients R = 0 on the whole blue sheet",
)
SLOW = gg.PAPER.replace(max_tilt_rate=1.0)
NOT_FLYABLE: dict[str, tuple[Any, dict[str, Any], list[str], list[str]]] = {
    # What is in the way of each branch, and the colors of the alternatives.
    "low": (
        LOW,
        {},
        [
            "red, R > 0: waypoint 1 (1.1781, 1.1781): least singular value must be ≥ 0.05, got 0.0493",
            "red",
        ],
        ["red", "blue"],
    ),
    "gait 1": (
        G1.waypoints,
        {},
        ["red, R > 0: waypoint 1", "red, R < 0: waypoint 2"],
        ["blue"],
    ),
    "blue": (G3.waypoints, {"color": "blue"}, [BLUE] * 2, ["blue"]),
    "exact blue": (
        G3.waypoints,
        {"color": "blue", "coefficients": "exact"},
        [BLUE] * 2,
        [],
    ),
    "slow": (
        G3.waypoints,
        {"vehicle": SLOW},
        ["red, R < 0: peak 5.89 rad/s (α1), limit 1: this"],
        ["red", "blue"],
    ),
    "floor": (
        G3.waypoints,
        {"floor": 0.6, **RED_BELOW},
        ["red, R < 0: waypoint 3 (0.3927, -0.3927): least"],
        ["red"],
    ),
}


@pytest.mark.parametrize("method", ["grid", "exact"])
@pytest.mark.parametrize("name", NOT_FLYABLE)
def test_only_what_can_fly_is_handed_out_and_the_rest_is_an_alternative(
    name: str, method: Any
) -> None:
    points, options, messages, colors = NOT_FLYABLE[name]
    plan, asked = (
        gg.plan_loop(points, method=method, require=use, **options)
        for use in ("flyable", "valid")
    )
    assert (plan.status, bool(asked)) == ("infeasible", bool(colors))
    for one, message in zip(plan.refusals, messages, strict=True):
        assert one.message.startswith(message)
        assert (
            (one.nearest is not None)
            == (one.kind == "waypoint")
            == ("nearest admissible" in one.message)
        )
    assert [(loop.color, loop.report.flyable) for loop in plan.alternatives] == [
        (color, False) for color in colors
    ]
    whys = list(dict.fromkeys(one.message for one in plan.refusals))
    assert plan.reason == "no flyable loop: " + "; ".join(whys)
    how = "for a loop that obeys only the paper's rules, use require='valid'"
    assert plan.advice == (how if colors else None)
    with pytest.raises(gg.Infeasible) as none:
        _ = plan.gait
    assert str(none.value) == "; ".join([plan.reason, *[how] * bool(colors)])
    assert plan.as_mapping()["advice"] == plan.advice
    assert re.match(
        r"No flyable gait through these waypoints\..*\n  " + re.escape(whys[0][:40]),
        str(plan),
    )
    if asked.loop is not None:
        np.testing.assert_array_equal(asked.gait.alpha, plan.alternatives[0].gait.alpha)
        assert str(asked.reason).startswith(
            "no loop through these waypoints is flyable: "
        )


@pytest.mark.parametrize(
    ("points", "options"),
    [
        (
            [(0.589, -0.785), (0.9, -0.4), (-1.374, 1.374)],
            {},
        ),  # the first waypoint lies in the other sign of R
        (
            [(-0.5, 0.5), (-1.5, 1.5), (-0.5, 1.55)],
            {"color": "red"},
        ),  # two parts of one sign
        (
            [(0.5, 0.5), (0.6, -0.6)],
            {"keep_out": [[(0.5, -2), (0.55, -2), (0.55, 2), (0.5, 2)]]},
        ),
        ([(-1.0, 1.0), (1.0, -1.0), (0.9, -0.9)], {}),  # admissible, but not together
    ],
)
def test_all_moves_of_the_first_obstacle_lead_to_a_gait_one_after_another(
    points: Any, options: dict[str, Any]
) -> None:
    plan, moves = gg.plan_loop(points, **options), 0
    while not plan:
        first, *others = plan.refusals
        far = [
            sum(map(math.dist, one.moved, plan.waypoints)) for one in (first, *others)
        ]
        assert far[0] == min(far) > 0
        assert gg.plan_loop(first.moved, **options)
        k = next(k for k, point in enumerate(plan.waypoints) if first.moved[k] != point)
        points, moves = (
            [*plan.waypoints[:k], first.moved[k], *plan.waypoints[k + 1 :]],
            moves + 1,
        )
        plan = gg.plan_loop(points, **options)
    assert 1 <= moves <= len(points)


def test_every_waypoint_outside_gets_its_nearest_admissible_point() -> None:
    (refusal,) = gg.plan_loop(
        [(1.2, -0.1 - 0.001 * k) for k in range(10)], **RED_BELOW
    ).refusals
    listed = re.findall(r"\((\S+), (\S+)\) for waypoint (\d+)", refusal.message)
    assert [int(number) for *_, number in listed] == list(range(1, 9))
    assert (
        gg.surface.admissible_region(sign="negative")
        .contains([(float(a), float(b)) for a, b, _ in listed])
        .all()
    )
    assert refusal.message.endswith(", and 2 more")
    (empty,) = gg.plan_loop(
        G3.waypoints, color="red", sign="negative", floor=2
    ).refusals
    assert empty.message.endswith(
        "the least singular value of this vehicle is at most 1.1710, below the floor 2; lower it"
    )
    heavy = gg.plan_loop(
        G3.waypoints,
        color="red",
        sign="negative",
        vehicle=gg.PAPER.replace(max_thrust=1.0),
    )
    assert (
        "four rotors lift 4 N at most, and the vehicle weighs 4.204 N; correct the vehicle"
        in str(heavy.reason)
    )


@pytest.mark.parametrize(
    ("order", "crosses"), [((0, 1, 2, 3), False), ((0, 2, 1, 3), True)]
)
def test_a_loop_that_crosses_itself_is_pointed_out(
    order: tuple[int, ...], crosses: bool
) -> None:
    points = [G3.waypoints[k] for k in order]
    for any_order in (False, True):
        warned = any(
            "the loop crosses itself" in one
            for one in gg.plan_loop(points, any_order=any_order).warnings
        )
        assert warned is (crosses and not any_order)


def test_what_cannot_fly_is_listed_beside_a_flyable_loop_only_when_asked() -> None:
    plan, asked = (
        gg.plan_loop(G3.waypoints, require=require) for require in ("flyable", "valid")
    )
    assert [[loop.color for loop in one.alternatives] for one in (plan, asked)] == [
        [],
        ["blue"],
    ]
    np.testing.assert_array_equal(plan.gait.alpha, asked.gait.alpha)


def test_no_graph_is_built_where_no_waypoint_could_serve() -> None:
    told: list[str] = []
    on_grid([(0.5, -0.5), (-0.5, 0.5)], coefficients="exact", progress=told.append)
    assert told == []
    # Each waypoint has roots, but not of one color and sign.
    on_grid([(-0.5, 0.5), (-1.5, 0.5)], progress=told.append)
    assert told == []
    on_grid([(-0.5, 0.5), (-0.4, 0.8)], progress=told.append)
    built = "building the graph of 16 divisions with R > 0"
    assert told[:2] == [built, "searching red loops"]
    assert told.count(built) == 1
    told.clear()
    plan = gg.plan_loop(G3.waypoints, progress=told.append, **RED_BELOW)
    assert told == ["searching red loops with R < 0"]
    assert repr(plan).startswith(
        "<Plan: <Loop: red, R < 0, 4 corners, 3.1416 rad around, flyable> through 4 waypoints, "
    )
    assert plan.request.law == gg.planning.plan_request([(0, 0)]).law == "smooth"


def test_separated_waypoints_are_told_with_what_can_be_reached_from_each() -> None:
    points = [(1.2, -0.6), (1.1, -0.7), (-1.5, 0.5)]
    (refusal,) = on_grid(points, **RED_BELOW).refusals
    graph = surface_graph("negative", waypoints=points)
    nodes = {
        k: next(name for name in graph if name.startswith(f"w{k:03} red"))
        for k in (1, 2)
    }
    edges = graph.edges(data=True)
    graph.remove_edges_from(
        [
            (a, b)
            for a, b, edge in edges
            if not (edge["continuous"] and edge["keeps_sign"])
        ]
    )
    assert refusal.components == tuple(
        len(nx.node_connected_component(graph, nodes[k])) for k in (1, 2)
    )
    (coarse,) = on_grid(
        [(-1.45, -0.3), (-1.45, 1.0)], divisions=3, **RED_BELOW
    ).refusals
    assert coarse.message.endswith(
        "separated by the grid of 3 divisions: try more divisions"
    )


def test_where_nothing_flies_the_objective_decides() -> None:
    """Blue goes straight where red must go round the saddle; red is far from singular, blue never."""
    robust = on_grid(
        [(1.0, 0.7), (-0.7, -1.0)], floor=2.0, sign="negative", objective="robust"
    )
    assert not robust.report.flyable
    assert [loop.color for loop in (loop_of(robust), *robust.alternatives)] == [
        "red",
        "blue",
    ]
    assert (
        loop_of(robust).length
        > robust.alternatives[0].length
        >= 2 * math.hypot(1.7, 1.7) - 1e-9
    )
    value = robust.report["least_singular_value"].value
    assert value is not None
    assert 0.05 < value < 0.5  # less than one, and yet what decides
    points = [(1.2, 1.0), (-1.0, -1.2)]
    shortest = on_grid(points, floor=2.0, sign="negative")
    robust = on_grid(points, floor=2.0, sign="negative", objective="robust")
    for plan, color in ((shortest, "blue"), (robust, "red")):
        assert loop_of(plan).color == color
        (other,) = plan.alternatives
        assert (other.length > loop_of(plan).length) is (color == "blue")


@pytest.mark.parametrize(
    ("point", "options", "expected"),
    [
        ((-1.5, -0.3), {"floor": 2.0}, [("red", "negative"), ("blue", "positive")]),
        # On a side of the square red has both signs: opposite rotors reversed against each other.
        ((pi / 2, -0.5), {"color": "red"}, [("red", "negative"), ("red", "positive")]),
        ((pi / 2, 0.5), {"color": "red"}, [("red", "positive"), ("red", "negative")]),
    ],
)
def test_of_loops_of_one_length_flyable_ones_come_first_then_red_then_positive(
    point: Any, options: dict[str, Any], expected: Any
) -> None:
    plan = on_grid([point], **options)
    loops = [loop_of(plan), *plan.alternatives]
    assert [(loop.color, loop.sign, loop.length) for loop in loops] == [
        (*one, 0.0) for one in expected
    ]
