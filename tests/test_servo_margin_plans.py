"""Plans, grids and optimal gaits that keep a servo margin; walks, cycles and plans at own costs."""

from __future__ import annotations

import json
import math
from itertools import pairwise
from typing import Any

import networkx as nx
import numpy as np
import pytest

import gaitgraph as gg
from gaitgraph.graph.build import surface_graph
from gaitgraph.invertibility.error_margins import servo_margin
from tests.published import GAITS
from tests.samples import loop_of

GAIT_4 = GAITS[3].waypoints


def margin_of(gait: gg.Gait, floor: float = 0.05) -> float:
    """Return the errors of servos with which a search breaks a condition [°]."""
    margin = servo_margin(np.vstack([gait.alpha, gait.alpha[:1]]), floor=floor)
    return math.degrees(margin.found or 0.0)


@pytest.mark.parametrize(("method", "wanted"), [("exact", 10.9), ("grid", 10.5)])
def test_a_plan_keeps_its_margin_and_tells_it(method: Any, wanted: float) -> None:
    plan = gg.plan_loop(GAIT_4, servo_margin=f"{wanted}deg", method=method)
    plain = plan.as_mapping()
    breaks = margin_of(plan.gait)
    assert 0.995 * wanted <= plain["servo_margin_deg"] <= breaks
    assert plain["servo_margin_found_deg"] == pytest.approx(breaks)
    assert plain["request"]["servo_margin"] == pytest.approx(math.radians(wanted))
    lower = math.floor(10 * plain["servo_margin_deg"]) / 10
    assert f"bears errors of the servos up to {lower}°" in str(plan)
    assert "servo_margin_deg" not in gg.plan_loop(GAIT_4).as_mapping()


def test_waypoints_that_bear_less_are_told_where_they_bear_enough() -> None:
    points = [(-0.15, 1.25), (-1.25, 0.15)]
    plan, straight = gg.plan_loop(points, servo_margin="12deg"), gg.plan_loop(points)
    assert not plan
    assert "servo margin must be ≥ 12°, got" in str(plan.reason)
    (loop, *_) = plan.alternatives
    assert np.array_equal(loop.path.alpha, loop_of(straight).path.alpha)
    most = math.floor(10 * math.degrees(loop.servo_margin.proven)) / 10
    assert f"bear errors of {most}° at most" in str(plan.advice)
    assert gg.plan_loop(plan.refusals[0].moved, servo_margin="12deg")
    assert not gg.plan_loop(GAIT_4, servo_margin="40deg", method="grid")


@pytest.mark.parametrize(("count", "floor"), [(4, 0.0), (2, 0.05)])
def test_the_optimal_margin_is_proven_and_near_its_bound(
    count: int, floor: float
) -> None:
    asked: Any = {"objective": "servo_margin", "sign": "positive", "floor": floor}
    best: Any = gg.optimal_gait(GAIT_4[:count], radius=0.1, pieces=24, **asked)
    breaks = math.radians(margin_of(best.gait, floor))
    assert 0.97 * best.bound < best.value <= breaks <= best.bound
    if floor == 0:
        # The third disc, (−3π/8, 3π/8), reaches into the square of the theory along its diagonal.
        delta = math.atan(gg.PAPER.drag_ratio)
        exact = math.pi / 8 + 0.1 / math.sqrt(2) - delta
        assert exact <= best.bound == pytest.approx(exact, rel=2e-3)


# -- Own costs


def least_cost(first: Any, second: Any, edge: Any) -> float:
    return float(edge["length"] / (0.01 + edge["least_singular_value"]))


def bearing(first: Any, second: Any, edge: Any) -> float | None:
    """Hide edges that bear little, and diagonals."""
    hidden = edge["servo_margin"] < 0.1 or edge["length"] > 0.2
    return None if hidden else 1.0


@pytest.fixture(scope="module")
def graph() -> nx.Graph[Any]:
    graph = surface_graph("negative", divisions=16, servo_margins=True)
    for edge in list(graph.edges.values())[::2]:
        edge["wear"] = 3.0  # where it is missing an edge costs 1
    return graph


def flyable_part(graph: nx.Graph[Any]) -> nx.Graph[Any]:
    part: nx.Graph[Any] = nx.Graph()
    edges = graph.edges(data=True)
    part.add_edges_from(edge for edge in edges if edge[2]["flyable"])
    return part


STOPS = ["014 002 red", "010 006 red", "012 003 red"]


@pytest.mark.parametrize("weight", ["length", "jump", "wear", least_cost, bearing])
def test_walks_cost_what_networkx_says(graph: nx.Graph[Any], weight: Any) -> None:
    asked: Any = {"require": "flyable", "weight": weight}
    walk: Any = gg.graph.closed_walk(graph, [[stop] for stop in STOPS], **asked)
    flyable = flyable_part(graph)
    expected = sum(
        nx.dijkstra_path_length(flyable, *leg, weight=weight)
        for leg in pairwise([*STOPS, STOPS[0]])
    )
    assert walk.cost == pytest.approx(expected, abs=1e-9)
    ring = [*walk.nodes, walk.nodes[0]]
    assert walk.length == pytest.approx(nx.path_weight(graph, ring, "length"), abs=1e-9)
    order = gg.graph.best_order(graph, STOPS, **asked)
    assert order in {(0, 1, 2), (0, 2, 1)}


def test_a_grid_plan_at_own_costs() -> None:
    points = [("-3pi/16", "pi/8"), ("-3pi/8", "5pi/16")]

    def cost(first: Any, second: Any, edge: Any) -> float:
        return float(edge["length"] / edge["least_singular_value"] ** 3)

    short = gg.plan_loop(points, method="grid", weight="length")
    assert short.as_mapping()["request"]["weight"] == "length"
    plan = gg.plan_loop(points, weight=cost)
    assert plan.request.method == "grid"
    assert loop_of(plan).cost is not None
    assert loop_of(plan).length > loop_of(short).length
    values = [each.report["least_singular_value"].value for each in (plan, short)]
    assert (values[0] or 0.0) >= (values[1] or 0.0)
    assert any("weight is a function" in warning for warning in plan.warnings)
    json.dumps(plan.as_mapping())
    with pytest.raises(gg.InputError, match="^weight must be left out"):
        gg.plan_loop(points, method="exact", weight="length")


@pytest.mark.parametrize(
    ("weight", "words"),
    [
        ("lenght", "which no edge has"),
        (lambda u, v, edge: -1.0, "must be a number from 0 to 1e12"),
        (lambda u, v, edge: math.inf, "must be a number from 0 to 1e12"),
        (lambda u, v, edge: True, "must be a number from 0 to 1e12"),
        (lambda u, v, edge: float(u < v), "the same in both directions"),
        (3, "the name of an edge attribute or a function"),
    ],
)
def test_bad_weights_are_refused(graph: nx.Graph[Any], weight: Any, words: str) -> None:
    with pytest.raises(gg.InputError, match=words):
        gg.graph.closed_walk(graph, [[stop] for stop in STOPS], weight=weight)
