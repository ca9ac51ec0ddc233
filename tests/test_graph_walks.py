"""Closed walks against brute force on small grids."""

from __future__ import annotations

import itertools
import math
from typing import Any

import networkx as nx
import numpy as np
import pytest

from gaitgraph.graph.build import surface_graph
from gaitgraph.graph.walks import (
    Blocked,
    ClosedWalk,
    best_order,
    closed_walk,
    shortest_order,
)
from tests.test_graph_cycles import USES


def usable(
    graph: nx.Graph[Any], use: str, threshold: float = -math.inf
) -> nx.Graph[Any]:
    kept = [
        (a, b)
        for a, b, data in graph.edges(data=True)
        if USES[use](data) and data["least_singular_value"] >= threshold
    ]
    out = graph.edge_subgraph(kept).copy()
    out.add_nodes_from(graph.nodes(data=True))
    return out


def brute_length(
    graph: nx.Graph[Any], stops: list[list[Any]], use: str, threshold: float = -math.inf
) -> float:
    """Every choice of a node for each stop, all-pairs shortest paths by another algorithm."""
    cut = usable(graph, use, threshold)
    distance = dict(nx.all_pairs_bellman_ford_path_length(cut, weight="length"))
    best = math.inf
    for choice in itertools.product(*stops):
        legs = zip(choice, (*choice[1:], choice[0]), strict=True)
        best = min(best, sum(distance[a].get(b, math.inf) for a, b in legs))
    return best


def brute_width(graph: nx.Graph[Any], stops: list[list[Any]], use: str) -> float:
    """The largest threshold at which the stops are still joined."""
    values = sorted(
        {data["least_singular_value"] for *_, data in graph.edges(data=True)},
        reverse=True,
    )
    for value in values:
        cut = usable(graph, use, value)
        for choice in itertools.product(*stops):
            if all(nx.has_path(cut, choice[0], other) for other in choice[1:]):
                return float(value)
    return -math.inf


def walk_length(graph: nx.Graph[Any], walk: ClosedWalk, use: str) -> float:
    total = 0.0
    if len(walk.nodes) > 1:
        for a, b in zip(walk.nodes, (*walk.nodes[1:], walk.nodes[0]), strict=True):
            assert USES[use](graph.edges[a, b])
            total += graph.edges[a, b]["length"]
    return total


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("use", USES)
@pytest.mark.parametrize("sign", ["negative", "positive"])
def test_shortest_against_brute_force(sign: Any, use: Any, seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = rng.uniform(-1.2, 1.2, (2, 2)).round(2)
    graph = surface_graph(sign, divisions=6, waypoints=points, floor=0.2)
    by_place: dict[Any, list[Any]] = {}
    for name, data in graph.nodes(data=True):
        by_place.setdefault((data["alpha1"], data["alpha2"]), []).append(name)
    places = list(by_place)
    chosen = [places[k] for k in rng.choice(len(places), 3, replace=False)]
    chosen += [tuple(point) for point in points.tolist() if tuple(point) in by_place]
    stops = [by_place[place] for place in chosen]
    walk = closed_walk(graph, stops, require=use)
    expected = brute_length(graph, stops, use)
    if isinstance(walk, Blocked):
        assert math.isinf(expected)
        return
    assert walk.length == pytest.approx(expected, abs=1e-10)
    assert walk_length(graph, walk, use) == pytest.approx(expected, abs=1e-10)
    place = 0
    for stop in stops:  # in their order
        place = next(k for k in range(place, len(walk.nodes)) if walk.nodes[k] in stop)


@pytest.mark.parametrize("seed", range(4))
def test_robust_against_brute_force(seed: int) -> None:
    rng = np.random.default_rng(seed)
    graph = surface_graph("negative", divisions=8)
    names = sorted(
        name for name, data in graph.nodes(data=True) if data["color"] == "red"
    )
    stops = [[names[k]] for k in rng.choice(len(names), 3, replace=False)]
    walk = closed_walk(graph, stops, require="valid", objective="robust")
    width = brute_width(graph, stops, "valid")
    if isinstance(walk, Blocked):
        assert math.isinf(width)
        return
    pairs = list(zip(walk.nodes, (*walk.nodes[1:], walk.nodes[0]), strict=True))
    assert min(graph.edges[pair]["least_singular_value"] for pair in pairs) == width
    assert walk.length == pytest.approx(
        brute_length(graph, stops, "valid", width), abs=1e-10
    )


def red_stops(graph: nx.Graph[Any], number: int, seed: int) -> list[Any]:
    red = sorted(
        name
        for name, data in graph.nodes(data=True)
        if data["color"] == "red" and data["alpha1"] > 0.3
    )
    return [
        red[k]
        for k in np.random.default_rng(seed).choice(len(red), number, replace=False)
    ]


def turns(walk: ClosedWalk, graph: nx.Graph[Any]) -> int:
    points = np.array(
        [
            (graph.nodes[name]["alpha1"], graph.nodes[name]["alpha2"])
            for name in walk.nodes
        ]
    )
    step = np.roll(points, -1, axis=0) - points
    unit = step / np.linalg.norm(step, axis=1, keepdims=True)
    return int((np.linalg.norm(unit - np.roll(unit, 1, axis=0), axis=1) > 1e-9).sum())


def test_ties_are_broken_by_fewest_turns() -> None:
    """Eight by five steps can zigzag; one diagonal and one straight run are as short."""
    graph = surface_graph("positive")
    walk = closed_walk(graph, [["002 006 red"], ["007 014 red"]])
    assert isinstance(walk, ClosedWalk)
    assert walk.length == pytest.approx(2 * (5 * math.sqrt(2) + 3) * math.pi / 16)
    assert turns(walk, graph) == 4  # two bends, and a turn at each end


def test_a_walk_of_one_stop_is_a_point_and_a_blocked_one_names_its_leg() -> None:
    graph = surface_graph()
    walk = closed_walk(graph, [["014 002 red"]], objective="robust")
    assert walk == ClosedWalk(nodes=("014 002 red",), length=0, cost=0)
    graph.remove_edges_from(list(graph.edges("012 004 red")))
    assert closed_walk(
        graph, [["014 002 red"], ["013 003 red"], ["012 004 red"]]
    ) == Blocked(leg=1)
    assert best_order(graph, ["014 002 red", "012 004 red"]) is None
    assert (
        best_order(graph, ["012 004 red", *[f"014 {k:03} red" for k in range(1, 11)]])
        is None
    )


@pytest.mark.no_cover
@pytest.mark.parametrize("seed", range(4))
def test_any_order_against_all_permutations(seed: int) -> None:
    graph = surface_graph("negative")
    stops = red_stops(graph, 5, seed)
    best = best_order(graph, stops) or ()
    lengths = {
        order: length_of(graph, stops, (0, *order))
        for order in itertools.permutations(range(1, 5))
    }
    assert best[0] == 0
    assert lengths[best[1:]] == pytest.approx(min(lengths.values()), abs=1e-10)


def length_of(graph: nx.Graph[Any], stops: list[Any], order: tuple[int, ...]) -> float:
    walk = closed_walk(graph, [[stops[k]] for k in order])
    assert isinstance(walk, ClosedWalk)
    return walk.length


@pytest.mark.parametrize(("number", "seed"), [(10, 0), (30, 3)])
def test_beyond_nine_stops_the_order_is_good(
    number: int, seed: int, monkeypatch: Any
) -> None:
    graph = surface_graph("negative")
    stops = red_stops(graph, number, seed)
    best = best_order(graph, stops) or ()
    assert sorted(best) == list(range(number))
    assert best[0] == 0
    assert best[1] < best[-1]
    assert best == best_order(graph.copy(), stops)
    found = length_of(graph, stops, best)
    assert found <= length_of(graph, stops, tuple(range(number))) + 1e-9
    again = best_order(graph, [stops[k] for k in best]) or ()
    assert length_of(graph, [stops[k] for k in best], again) <= found + 1e-9
    if number <= 12:
        monkeypatch.setattr("gaitgraph.graph.walks.MOST_ANY_ORDER", number)
        exact = best_order(graph, stops) or ()
        shortest = length_of(graph, stops, exact)
        assert shortest - 1e-9 <= found <= 1.5 * shortest + 1e-9


def test_stops_that_repeat_have_an_order_too() -> None:
    best = best_order(surface_graph(), ["014 002 red"] * 6 + ["013 002 red"] * 5)
    assert sorted(best or ()) == list(range(11))


def test_many_places_have_a_good_order() -> None:
    """A wall between them takes a way around; the shortest tree of all is not longer than the shortest order."""
    places = np.random.default_rng(0).uniform(0, 1, (80, 2))
    wall = (places[:, 0] > 0.5) & (places[:, 1] < 0.7)

    def length(a: int, b: int) -> float:
        around = 0.3 * (wall[a] != wall[b])
        return float(round(1e12 * (math.dist(places[a], places[b]) + around)))

    order = shortest_order(80, length) or ()
    assert sorted(order) == list(range(80))
    assert sum(wall[a] != wall[b] for a, b in itertools.pairwise((*order, 0))) <= 4
    total = sum(length(a, b) for a, b in itertools.pairwise((*order, 0)))
    complete: nx.Graph[int] = nx.Graph()
    for a, b in itertools.combinations(range(80), 2):
        complete.add_edge(a, b, weight=length(a, b))
    assert total < 1.5 * nx.minimum_spanning_tree(complete).size("weight")
