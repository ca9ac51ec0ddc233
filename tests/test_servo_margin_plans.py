"""Plans, grids and optimal gaits that keep a servo margin."""

from __future__ import annotations

import json
import math
from itertools import pairwise
from typing import Any

import networkx as nx
import numpy as np
import pytest

import gaitgraph as gg
from gaitgraph.graph.build import surface_graph, validate_graph
from gaitgraph.graph.walks import ClosedWalk
from gaitgraph.invertibility.error_margins import servo_margin
from gaitgraph.planning.request import read_request
from tests.samples import loop_of
from tests.test_error_margins import closed

GAIT_4 = [
    ("-pi/8", "pi/8"),
    ("-pi/8", "3pi/8"),
    ("-3pi/8", "3pi/8"),
    ("-3pi/8", "pi/8"),
]


def test_a_plan_keeps_its_margin_and_tells_it() -> None:
    plan = gg.plan_loop(GAIT_4, servo_margin="10.9deg")
    margin = servo_margin(closed(plan.gait.alpha))
    assert margin.found is not None
    plain = plan.as_mapping()
    assert 0.995 * 10.9 <= plain["servo_margin_deg"] <= math.degrees(margin.found)
    assert plain["servo_margin_found_deg"] == pytest.approx(math.degrees(margin.found))
    assert plain["request"]["servo_margin"] == pytest.approx(math.radians(10.9))
    assert "bears errors of the servos up to 10.8°" in str(plan)


def test_waypoints_that_bear_less_are_told_where_they_bear_enough() -> None:
    points = [(-0.15, 1.25), (-1.25, 0.15)]
    straight = gg.plan_loop(points)
    wide = gg.plan_loop([(-0.2, 0.6), (-0.6, 0.2)], servo_margin="7deg")
    assert math.degrees(loop_of(wide).servo_margin.proven) >= 0.995 * 7
    plan = gg.plan_loop(points, servo_margin="12deg")
    assert not plan
    assert "servo margin must be ≥ 12°, got" in str(plan.reason)
    assert plan.refusals[0].nearest is not None
    assert "without a servo margin there are loops" in str(plan.advice)
    (loop, *_) = plan.alternatives
    assert np.array_equal(loop.path.alpha, loop_of(straight).path.alpha)
    moved = gg.plan_loop(plan.refusals[0].moved, servo_margin="12deg")
    assert moved


def test_what_asks_for_no_margin_states_none() -> None:
    plain = gg.plan_loop(GAIT_4).as_mapping()
    assert "servo_margin" not in plain["request"]
    assert "servo_margin_deg" not in plain


def test_requests_hold_the_margin(tmp_path: Any) -> None:
    file = tmp_path / "request.toml"
    file.write_text('waypoints = [[-0.5, 0.5], [-0.7, 0.7]]\nservo_margin = "15deg"\n')
    request, _ = read_request(file, {})
    assert request.servo_margin == pytest.approx(math.radians(15))
    for margin, words in (
        (-0.1, "servo_margin must be an angle"),
        ("x", "servo_margin"),
    ):
        with pytest.raises(gg.InputError, match=words):
            gg.plan_loop(GAIT_4, servo_margin=margin)
    with pytest.raises(gg.InputError, match="with require 'valid'"):
        gg.plan_loop(GAIT_4, servo_margin=0.1, require="valid")


def test_the_grid_keeps_the_margin_too() -> None:
    points = [
        (-3 * math.pi / 16, 3 * math.pi / 16),
        (-5 * math.pi / 16, 4 * math.pi / 16),
    ]
    plan = gg.plan_loop(points, method="grid", servo_margin="20deg")
    assert math.degrees(loop_of(plan).servo_margin.proven) >= 0.995 * 20
    assert not gg.plan_loop(points, method="grid", servo_margin="40deg")


def test_edges_have_margins_of_their_ends_and_middles() -> None:
    graph = surface_graph("positive", divisions=8, servo_margins=True)
    validate_graph(graph)
    for first, second, edge in graph.edges(data=True):
        if not edge["flyable"]:
            assert edge["servo_margin"] == 0
            continue
        ends = np.array(
            [
                [graph.nodes[node][f"alpha{k}"] for k in (1, 2, 3, 4)]
                for node in (first, second)
            ]
        )
        places = [ends[0], ends[1], ends.mean(axis=0)]
        found = [servo_margin(place[None]).found or 0.0 for place in places]
        assert edge["servo_margin"] == pytest.approx(min(found), abs=1e-6)
    edge["servo_margin"] += 1e-3
    with pytest.raises(gg.GaitgraphError, match="servo_margin must be"):
        validate_graph(graph)


def test_least_R_of_an_edge_is_along_the_whole_edge() -> None:
    graph = surface_graph("negative", divisions=8, coefficients="exact")
    exact = gg.invertibility.coefficients_of("paper", "exact")
    for first, second, edge in graph.edges(data=True):
        ends = np.array(
            [
                [graph.nodes[node][f"alpha{k}"] for k in (1, 2, 3, 4)]
                for node in (first, second)
            ]
        )
        along = ends[0] + np.linspace(0, 1, 201)[:, None] * (ends[1] - ends[0])
        values = gg.invertibility.level_determinant(along, exact)
        if edge["keeps_sign"]:
            assert edge["R"] == pytest.approx(values.max(), abs=2e-3)
        else:
            assert edge["R"] == 0


# -- Own costs


def corners() -> tuple[nx.Graph[Any], list[str]]:
    graph = surface_graph("negative", divisions=16, servo_margins=True)
    return graph, [f"{i:03} {j:03} red" for i, j in [(14, 2), (10, 6), (12, 3)]]


@pytest.mark.parametrize(
    "weight",
    [
        "length",
        "jump",
        lambda u, v, edge: edge["length"] / (0.01 + edge["least_singular_value"]),
        lambda u, v, edge: edge["length"] if edge["servo_margin"] > 0.1 else None,
    ],
)
def test_walks_cost_what_networkx_says(weight: Any) -> None:
    graph, stops = corners()
    walk = gg.graph.closed_walk(
        graph, [[stop] for stop in stops], require="flyable", weight=weight
    )
    flyable: nx.Graph[Any] = nx.Graph()
    flyable.add_edges_from(
        edge for edge in graph.edges(data=True) if edge[2]["flyable"]
    )
    legs = zip(stops, [*stops[1:], stops[0]], strict=True)
    expected = sum(
        nx.dijkstra_path_length(flyable, *leg, weight=weight) for leg in legs
    )
    assert isinstance(walk, ClosedWalk)
    assert walk.cost == pytest.approx(expected, abs=1e-9)
    ring = [*walk.nodes, walk.nodes[0]]
    assert walk.length == pytest.approx(nx.path_weight(graph, ring, "length"), abs=1e-9)
    order = gg.graph.best_order(graph, stops, require="flyable", weight=weight)
    assert order in {(0, 1, 2), (0, 2, 1)}


def test_an_attribute_of_ones_own_counts_and_one_that_is_missing_costs_1() -> None:
    graph, stops = corners()
    for edge in list(graph.edges.values())[::2]:
        edge["wear"] = 3.0
    walk = gg.graph.closed_walk(graph, [[stop] for stop in stops], weight="wear")
    legs = zip(stops, [*stops[1:], stops[0]], strict=True)
    valid: nx.Graph[Any] = nx.Graph()
    valid.add_edges_from(
        edge
        for edge in graph.edges(data=True)
        if edge[2]["continuous"] and edge[2]["keeps_sign"]
    )
    expected = sum(nx.dijkstra_path_length(valid, *leg, weight="wear") for leg in legs)
    assert isinstance(walk, ClosedWalk)
    assert walk.cost == pytest.approx(expected)


def test_cycles_come_in_order_of_cost() -> None:
    graph = surface_graph("positive", divisions=8)

    def cost(first: Any, second: Any, edge: Any) -> float:
        return float(edge["length"] / (0.1 + edge["least_singular_value"]))

    found = gg.graph.cycles(graph, require="flyable", weight=cost)
    listed = [next(found) for _ in range(40)]
    costs = [cycle.cost for cycle in listed]
    assert costs == sorted(costs)
    flyable: nx.Graph[Any] = nx.Graph()
    flyable.add_edges_from(
        edge for edge in graph.edges(data=True) if edge[2]["flyable"]
    )
    for cycle in listed[:5]:
        ring = [*cycle.nodes, cycle.nodes[0]]
        total = sum(cost(a, b, graph.edges[a, b]) for a, b in pairwise(ring))
        assert cycle.cost == pytest.approx(total)
    sizes = [
        sum(
            cost(a, b, flyable.edges[a, b])
            for a, b in zip(c, [*c[1:], c[0]], strict=True)
        )
        for c in nx.simple_cycles(flyable, length_bound=4)
    ]
    assert costs[0] == pytest.approx(min(sizes))


def test_a_grid_plan_at_own_costs() -> None:
    points = [
        (-3 * math.pi / 16, 2 * math.pi / 16),
        (-6 * math.pi / 16, 5 * math.pi / 16),
    ]
    short = gg.plan_loop(points, method="grid")

    def cost(first: Any, second: Any, edge: Any) -> float:
        return float(edge["length"] / edge["least_singular_value"] ** 3)

    plan = gg.plan_loop(points, weight=cost)
    assert plan.request.method == "grid"
    assert loop_of(plan).cost is not None
    assert loop_of(plan).length >= loop_of(short).length
    least, of_short = (
        one.report["least_singular_value"].value or 0.0 for one in (plan, short)
    )
    assert least >= of_short
    assert "weight is a function" in " ".join(plan.warnings)
    json.dumps(plan.as_mapping())
    named = gg.plan_loop(points, method="grid", weight="length")
    assert named.as_mapping()["request"]["weight"] == "length"
    assert np.array_equal(named.gait.alpha, short.gait.alpha)


@pytest.mark.parametrize(
    ("weight", "words"),
    [
        ("lenght", "which no edge has"),
        (lambda u, v, edge: -1.0, "a finite number ≥ 0"),
        (lambda u, v, edge: float(u < v), "the same in both directions"),
        (3, "the name of an edge attribute or a function"),
    ],
)
def test_bad_weights_are_refused(weight: Any, words: str) -> None:
    graph, stops = corners()
    with pytest.raises(gg.InputError, match=words):
        gg.graph.closed_walk(graph, [[stop] for stop in stops], weight=weight)


def test_own_costs_need_the_grid() -> None:
    with pytest.raises(gg.InputError, match="unless the method is grid"):
        gg.plan_loop(GAIT_4, method="exact", weight="length")


# -- Optimal gaits


@pytest.mark.parametrize("floor", [0.0, 0.05])
def test_the_optimal_margin_is_proven_and_near_its_bound(floor: float) -> None:
    gait = gg.optimal_gait(
        GAIT_4, radius=0.1, objective="servo_margin", floor=floor, sign="positive"
    )
    assert gait
    assert gait.value is not None
    assert gait.bound is not None
    margin = servo_margin(closed(gait.gait.alpha), floor=floor)
    assert margin.found is not None
    assert 0.97 * gait.bound < gait.value <= margin.found <= gait.bound
    if floor == 0:
        # The third disc, (−3π/8, 3π/8), reaches into the square of the theory along its diagonal.
        delta = math.atan(gg.vehicle_named("paper").drag_ratio)
        best = math.pi / 8 + 0.1 / math.sqrt(2) - delta
        assert best <= gait.bound == pytest.approx(best, rel=2e-3)
    assert "servo margin of the gait" in str(gait)
