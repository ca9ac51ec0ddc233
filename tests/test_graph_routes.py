"""Cycles of surface graphs in order of length, and closed walks through stops, against networkx and brute force."""

from __future__ import annotations

import itertools
import json
import math
from itertools import islice, pairwise
from typing import TYPE_CHECKING, Any

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from gaitgraph.errors import InputError
from gaitgraph.graph.build import surface_graph
from gaitgraph.graph.cycle_list import cycles
from gaitgraph.graph.walks import (
    Blocked,
    ClosedWalk,
    best_order,
    closed_walk,
    shortest_order,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

USES: dict[str, Callable[[Any], bool]] = {
    "flyable": lambda edge: edge["flyable"],
    "valid": lambda edge: edge["continuous"] and edge["keeps_sign"],
    "two_color": lambda edge: True,
}


def usable(
    graph: nx.Graph[Any], use: str, threshold: float = -math.inf
) -> nx.Graph[Any]:
    """Return a graph with the edges that count for a use, with a least singular value from the threshold on."""
    cut = graph.copy()
    for a, b, edge in graph.edges(data=True):
        if not USES[use](edge) or edge["least_singular_value"] < threshold:
            cut.remove_edge(a, b)
    return cut


def closed(nodes: Sequence[Any]) -> list[tuple[Any, Any]]:
    """Return the edges of a closed walk."""
    return list(pairwise([*nodes, nodes[0]]))


# Cycles


def canonical(cycle: Sequence[int]) -> tuple[int, ...]:
    """The first of all rotations of both directions: the definition, by trying."""
    turns = [[*cycle[k:], *cycle[:k]] for k in range(len(cycle))]
    return min(tuple(way) for turn in turns for way in (turn, turn[::-1]))


@st.composite
def weighted(draw: st.DrawFn) -> dict[tuple[int, int], int]:
    pairs = list(itertools.combinations(range(draw(st.integers(3, 6))), 2))
    chosen = draw(st.lists(st.sampled_from(pairs), unique=True, min_size=3))
    return {pair: draw(st.integers(0, 5)) for pair in chosen}


@settings(deadline=None, max_examples=40)
@given(weighted(), st.one_of(st.none(), st.integers(0, 25)), st.booleans())
def test_every_cycle_comes_once_in_the_total_order(
    lengths: dict[tuple[int, int], int], most: int | None, own: bool
) -> None:
    graph = surface_graph("negative", divisions=2)  # for its metadata
    graph.remove_nodes_from(list(graph))
    graph.add_nodes_from(range(6))
    for pair, length in lengths.items():
        stated = {"length": 1.0, "toll": length} if own else {"length": float(length)}
        graph.add_edge(*pair, least_singular_value=0.0, **stated)
    expected = sorted(
        (sum(lengths[min(pair), max(pair)] for pair in closed(cycle)), canonical(cycle))
        for cycle in nx.simple_cycles(graph)
    )
    if most is not None:
        expected = [item for item in expected if item[0] <= most]
    weight = "toll" if own else None
    listed = cycles(graph, require="two_color", max_length=most, weight=weight)
    assert [(cycle.cost, cycle.nodes) for cycle in listed] == expected


@pytest.mark.parametrize("use", USES)
@pytest.mark.parametrize("sign", ["negative", "positive"])
def test_cycles_are_those_of_the_graph_of_usable_edges_as_it_was(
    sign: Any, use: Any
) -> None:
    waypoints = [(0.5, -0.6), (1.2, -0.7), (-0.2, 0.5)]
    graph = surface_graph(sign, divisions=7, waypoints=waypoints, floor=0.02)
    cut = usable(graph, use)
    listed = cycles(graph, require=use, max_length=1.9)
    graph.clear()
    short = list(listed)
    assert short == list(cycles(cut, require="two_color", max_length=1.9))
    assert len(short) > 5
    for cycle in short[::20]:
        length = sum(cut.edges[pair]["length"] for pair in closed(cycle.nodes))
        assert cycle.length == cycle.cost == pytest.approx(length, abs=1e-11)


def test_max_length_includes_cycles_of_that_length() -> None:
    """Four diagonals: rounding each to 1e-12 rad makes the sum longer than the number itself."""
    graph = surface_graph("negative")
    most = math.sqrt(2) * math.pi / 4
    *_, longest = cycles(graph, max_length=most, require="flyable")
    assert longest.length == pytest.approx(most, abs=1e-11)
    *_, shorter = cycles(graph, max_length=most - 1e-6, require="flyable")
    assert shorter.length < most - 1e-6
    assert list(cycles(graph, max_length=0)) == []


@pytest.mark.parametrize(
    ("sign", "use", "waypoints"),
    [
        ("negative", "flyable", ()),
        ("positive", "valid", ()),
        ("positive", "two_color", [(math.pi / 2, -0.5), (0.1, 0.2)]),
        # In a corner of the square, where hover is not.
        ("positive", "valid", [(-1.5, 1.5), (-1.47, 1.55), (-1.55, 1.48)]),
    ],
)
def test_what_a_cycle_says_is_what_its_report_says(
    sign: Any, use: Any, waypoints: Any
) -> None:
    graph = surface_graph(sign, divisions=12, waypoints=waypoints)
    for name, data in [*graph.nodes(data=True)] if waypoints else []:
        place = data["alpha1"], data["alpha2"]
        if min(math.dist(place, point) for point in waypoints) > 0.4:
            graph.remove_node(name)
    listed = list(islice(cycles(graph, require=use), 500))
    for cycle in listed[:: len(listed) // 6]:
        report = cycle.path.merged().check()
        told = json.loads(json.dumps(cycle.as_mapping(), allow_nan=False))
        for name in ("valid", "two_color", "flyable", "reachable_from_hover"):
            assert told[name] is getattr(report, name), (name, cycle)
        assert told["path"] == cycle.path.alpha.tolist()
        assert told["types"] == list(cycle.path.types)
        assert (told["color"], told["sign"]) == (cycle.path.color, sign)
        assert told["length"] == pytest.approx(cycle.path.length, abs=1e-10)
        words = {True: " flyable ", False: " valid "}
        assert (words[cycle.flyable] if cycle.valid else " not valid ") in str(cycle)
        if cycle.flyable:
            least = report["least_singular_value"].value
            assert told["least_singular_value"] == pytest.approx(least, abs=2e-5)


# Closed walks


def shortest_by_brute_force(graph: nx.Graph[Any], stops: list[list[Any]]) -> float:
    """Every choice of a node for each stop, and paths by another algorithm."""
    distance = dict(nx.all_pairs_bellman_ford_path_length(graph, weight="length"))
    lengths = (
        sum(distance[a].get(b, math.inf) for a, b in closed(choice))
        for choice in itertools.product(*stops)
    )
    return float(min(lengths))


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("use", USES)
@pytest.mark.parametrize("sign", ["negative", "positive"])
def test_walks_are_the_best_of_all(sign: Any, use: Any, seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = rng.uniform(-1.2, 1.2, (2, 2)).round(2)
    graph = surface_graph(sign, divisions=6, waypoints=points, floor=0.2)
    above: dict[Any, list[Any]] = {}
    for name, data in graph.nodes(data=True):
        above.setdefault((data["alpha1"], data["alpha2"]), []).append(name)
    places = list(above.values())
    stops = [places[k] for k in rng.choice(len(places), 4, replace=False)]
    for *_, edge in graph.edges(data=True):
        edge["least_singular_value"] = float(rng.integers(4))
    thresholds = {"shortest": [-math.inf], "robust": [3.0, 2.0, 1.0, 0.0]}
    for objective, levels in thresholds.items():
        options: Any = {"require": use, "objective": objective}
        walk = closed_walk(graph, stops, **options)
        for level in levels:
            cut = usable(graph, use, level)
            length = shortest_by_brute_force(cut, stops)
            if math.isfinite(length):
                break
        if isinstance(walk, Blocked):
            assert math.isinf(length)
            continue
        assert walk.length == walk.cost == pytest.approx(length, abs=1e-10)
        edges = [cut.edges[pair] for pair in closed(walk.nodes)]
        assert sum(edge["length"] for edge in edges) == pytest.approx(length)
        remaining = iter(walk.nodes)  # the stops are passed in their order
        assert all(any(name in stop for name in remaining) for stop in stops)


def test_ties_are_broken_by_fewest_turns() -> None:
    """Eight by five steps can zigzag; one diagonal and one straight run are as short."""
    graph = surface_graph("positive")
    walk = closed_walk(graph, [["002 006 red"], ["007 014 red"]])
    assert isinstance(walk, ClosedWalk)
    assert walk.length == pytest.approx(2 * (5 * math.sqrt(2) + 3) * math.pi / 16)
    cells = [tuple(map(int, name.split()[:2])) for name in walk.nodes]
    steps = [(c - a, d - b) for (a, b), (c, d) in closed(cells)]
    turns = sum(first != second for first, second in closed(steps))
    assert turns == 4  # two bends, and a turn at each end


def test_a_walk_of_one_stop_is_a_point_and_a_blocked_one_names_its_leg() -> None:
    graph = surface_graph()
    here, near, cut = "014 002 red", "013 003 red", "012 004 red"
    point = closed_walk(graph, [[here]], objective="robust")
    assert point == ClosedWalk(nodes=(here,), length=0, cost=0)
    graph.remove_edges_from(list(graph.edges(cut)))
    assert closed_walk(graph, [[here], [near], [cut]]) == Blocked(leg=1)
    # Either leg is open, but not through one node of the second stop.
    apart = "010 004 red"
    graph.remove_edges_from(list(graph.edges(apart)))
    graph.add_edge(cut, apart, **graph.edges[here, near])
    split = [[here], [near, apart], [cut]]
    assert closed_walk(graph, split) == Blocked(leg=2)
    assert best_order(graph, [here, cut]) is None


# Orders


def total(order: Sequence[int], lengths: Any) -> float:
    return float(sum(lengths[pair] for pair in closed(order)))


@pytest.mark.parametrize(("number", "seed"), [(2, 0), (9, 2)])
def test_up_to_nine_stops_have_the_shortest_order(number: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    lengths = rng.integers(1, 50, (number, number))
    lengths += lengths.T
    order = shortest_order(number, lambda a, b: float(lengths[a, b])) or ()
    assert order[0] == 0
    orders = itertools.permutations(range(1, number))
    assert total(order, lengths) == min(total((0, *rest), lengths) for rest in orders)


def test_many_places_have_a_good_order() -> None:
    """A wall between them takes a way around; Christofides' bound counts from the shortest tree, which no order beats."""
    places = np.random.default_rng(0).uniform(0, 1, (80, 2))
    behind = (places[:, 0] > 0.5) & (places[:, 1] < 0.7)
    apart = np.linalg.norm(places[:, None] - places, axis=2)
    lengths = np.round(1e12 * (apart + 0.3 * (behind[:, None] != behind)))
    order = shortest_order(80, lambda a, b: lengths[a, b]) or ()
    assert sorted(order) == list(range(80))
    assert order[0] == 0
    assert order[1] < order[-1]
    tree = nx.minimum_spanning_tree(nx.from_numpy_array(lengths)).size("weight")
    assert total(order, lengths) < 1.5 * tree
    # The order that is given stays if no better one is known, also with places that repeat.
    again = lengths[np.ix_(order, order)]
    better = shortest_order(80, lambda a, b: again[a, b]) or ()
    assert total(better, again) <= total(range(80), again)
    assert shortest_order(11, lambda a, b: 0.0) == tuple(range(11))


@pytest.mark.parametrize("seed", range(4))
def test_in_a_hurry_each_place_is_followed_by_the_nearest_if_that_is_shorter(
    seed: int,
) -> None:
    places = np.random.default_rng(seed).uniform(0, 1, (12, 2))
    apart = np.linalg.norm(places[:, None] - places, axis=2)
    order = shortest_order(12, lambda a, b: apart[a, b], nearest_next=True) or ()
    nearest, left = [0], set(range(1, 12))
    while left:
        here = nearest[-1]
        nearest.append(min(left, key=lambda place: apart[here, place]))
        left.remove(nearest[-1])
    around = min(nearest, [0, *nearest[:0:-1]])
    ways = list(range(12)), around
    assert list(order) == min(ways, key=lambda way: total(way, apart))


@pytest.mark.parametrize(
    ("stops", "named"),
    [([["nowhere"]], "'nowhere'"), ([], r"\[\]"), ([[]], "at least one")],
)
def test_stops_of_a_walk_are_nodes(stops: Any, named: str) -> None:
    with pytest.raises(InputError, match=named) as refused:
        closed_walk(surface_graph(divisions=4), stops)
    assert refused.value.field == "stops"
