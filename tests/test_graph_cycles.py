"""Cycles in their total order against networkx and against all paths."""

from __future__ import annotations

import itertools
import json
import math
import pickle
from itertools import islice, pairwise
from typing import TYPE_CHECKING, Any

import networkx as nx
import pytest
from hypothesis import given, settings, strategies as st

from gaitgraph.graph.build import surface_graph
from gaitgraph.graph.cycle_list import cycles
from gaitgraph.planning.grid import grid_cycles
from gaitgraph.planning.request import plan_request

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from gaitgraph.graph.cycle_list import Cycle

USES: dict[str, Callable[[Any], bool]] = {
    "flyable": lambda edge: edge["flyable"],
    "valid": lambda edge: edge["continuous"] and edge["keeps_sign"],
    "two_color": lambda edge: True,
}
Item = tuple[int, tuple[int, ...]]
SHORT = 2.5


def canonical(path: Sequence[int]) -> tuple[int, ...]:
    """The least of all rotations of both directions: the definition, by trying."""
    ways = [path, path[::-1]]
    return min(
        tuple(way[k:]) + tuple(way[:k]) for way in ways for k in range(len(path))
    )


def rows_of(
    number: int, edges: dict[tuple[int, int], int]
) -> list[list[tuple[int, int]]]:
    rows: list[list[tuple[int, int]]] = [[] for _ in range(number)]
    for (a, b), length in edges.items():
        rows[a].append((b, length))
        rows[b].append((a, length))
    return [sorted(row) for row in rows]


def brute_items(edges: dict[tuple[int, int], int]) -> list[Item]:
    """Every simple cycle, sorted; networkx finds them."""
    lengths = edges | {(b, a): length for (a, b), length in edges.items()}
    joined: nx.Graph[Any] = nx.Graph(list(edges))
    found = list(nx.simple_cycles(joined))
    return sorted(
        (sum(lengths[pair] for pair in pairwise([*path, path[0]])), canonical(path))
        for path in found
    )


def walked_items(edges: dict[tuple[int, int], int], most: float) -> list[Item]:
    """Every simple cycle up to a length, by trying all paths of at most that length."""
    rows = rows_of(1 + max(map(max, edges)), edges)
    found = []

    def go(path: list[int], whole: int) -> None:
        for node, length in rows[path[-1]]:
            if (
                node == path[0]
                and len(path) > 2
                and path[1] < path[-1]
                and whole + length <= most
            ):
                found.append((whole + length, tuple(path)))
            elif node > path[0] and node not in path and whole + length <= most:
                go([*path, node], whole + length)

    for root in range(len(rows)):
        go([root], 0)
    return sorted(found)


def edges_of(graph: nx.Graph[Any], use: str) -> dict[tuple[int, int], int]:
    index = {name: k for k, name in enumerate(graph)}
    return {
        (index[a], index[b]): round(edge["length"] * 1e12)
        for a, b, edge in graph.edges(data=True)
        if USES[use](edge)
    }


def items_of(graph: nx.Graph[Any], found: Iterable[Cycle]) -> list[Item]:
    index = {name: k for k, name in enumerate(graph)}
    return [
        (round(cycle.length * 1e12), tuple(index[name] for name in cycle.nodes))
        for cycle in found
    ]


# Graphs whose lengths are whole numbers


@st.composite
def weighted(draw: st.DrawFn) -> tuple[int, dict[tuple[int, int], int]]:
    number = draw(st.integers(3, 6))
    pairs = list(itertools.combinations(range(number), 2))
    chosen = draw(st.lists(st.sampled_from(pairs), unique=True, min_size=3))
    return number, {pair: draw(st.integers(0, 5)) for pair in chosen}


@settings(deadline=None, max_examples=100)
@given(weighted(), st.one_of(st.none(), st.integers(0, 25)))
def test_every_cycle_once_in_the_total_order(
    graph: tuple[int, dict[tuple[int, int], int]], most: int | None
) -> None:
    number, edges = graph
    joined = surface_graph("negative", divisions=2)  # for its metadata
    joined.remove_nodes_from(list(joined))
    joined.add_nodes_from(range(number))
    for pair, length in edges.items():
        joined.add_edge(*pair, length=float(length), least_singular_value=0.0)
    found = list(cycles(joined, require="two_color", max_length=most))
    expected = brute_items(edges)
    if most is not None:
        expected = [item for item in expected if item[0] <= most]
    assert [(int(cycle.length), cycle.nodes) for cycle in found] == expected


# Cycles of surface graphs


@pytest.mark.no_cover
@pytest.mark.parametrize("use", USES)
@pytest.mark.parametrize("divisions", [6, 7])
@pytest.mark.parametrize("sign", ["negative", "positive"])
def test_against_all_paths(sign: Any, divisions: int, use: Any) -> None:
    graph = surface_graph(sign, divisions=divisions, floor=0.02)
    longest = SHORT * 8 / divisions
    found = items_of(graph, cycles(graph, require=use, max_length=longest))
    assert found == walked_items(edges_of(graph, use), longest * 1e12 + 1000)
    assert len(found) > 5 or use == "flyable"


@pytest.mark.parametrize("use", ["valid", "two_color"])
def test_waypoints_off_the_grid_and_red_above_blue(use: Any) -> None:
    """Lengths of every kind lie close together; where a crossing line passes a node both colors are one."""
    graph = surface_graph(
        "negative", divisions=8, waypoints=[(0.5, -0.6), (1.2, -0.7), (-0.2, 0.5)]
    )
    found = items_of(graph, cycles(graph, require=use, max_length=1.8))
    assert found == walked_items(edges_of(graph, use), 1.8e12 + 1000)
    assert len({length for length, _ in found}) > 30
    fine = surface_graph("negative", divisions=16)
    above = [(a, b) for a, b, edge in fine.edges(data=True) if edge["length"] == 0]
    assert above
    first = next(
        cycle
        for cycle in cycles(fine, require="two_color")
        if set(above[0]) < set(cycle.nodes)
    )
    assert first.length == pytest.approx(2 * math.pi / 16)


def test_cycles_come_one_by_one(monkeypatch: Any) -> None:
    """The first one takes a search for each edge, and each further one a few."""
    simple_paths: Any = nx.algorithms.simple_paths
    searches = 0
    search = simple_paths._bidirectional_dijkstra

    def counted(*arguments: Any, **options: Any) -> Any:
        nonlocal searches
        searches += 1
        return search(*arguments, **options)

    monkeypatch.setattr(simple_paths, "_bidirectional_dijkstra", counted)
    graph = surface_graph("negative")
    found = cycles(graph)
    assert len(next(found).nodes) == 3
    assert searches <= graph.number_of_edges() + 10
    next(islice(found, 98, None))
    assert searches <= graph.number_of_edges() + 1000


def test_later_changes_of_the_graph_have_no_effect() -> None:
    graph = surface_graph("negative", divisions=8)
    expected = list(islice(cycles(graph), 500))
    search = cycles(graph)
    graph.clear()
    found = list(islice(search, 500))
    assert found == expected
    assert found[-1].path.length == pytest.approx(found[-1].length)


def test_max_length_includes_cycles_of_that_length() -> None:
    """Four diagonals: rounding each to 1e-12 rad makes the sum longer than the number itself."""
    graph = surface_graph("negative")
    most = math.sqrt(2) * math.pi / 4
    lengths = [
        cycle.length for cycle in cycles(graph, max_length=most, require="flyable")
    ]
    assert lengths[-1] == pytest.approx(most, abs=1e-11)
    assert all(
        cycle.length < most - 1e-6
        for cycle in cycles(graph, max_length=most - 1e-6, require="flyable")
    )
    assert list(cycles(graph, max_length=0)) == []


# The verdict of the edges against the check of the gait


@pytest.mark.no_cover
@pytest.mark.parametrize(
    ("sign", "use", "divisions", "waypoints"),
    [
        ("negative", "flyable", 8, ()),
        ("positive", "valid", 16, ()),
        ("negative", "two_color", 16, [(math.pi / 2, -0.5), (0.52, -0.61)]),
        ("positive", "two_color", 12, [(math.pi / 2, -0.5), (0.1, 0.2)]),
        (
            "positive",
            "valid",
            6,
            [(-1.5, 1.5), (-1.47, 1.55), (-1.55, 1.48)],
        ),  # in a corner, where hover is not
    ],
)
def test_edges_and_report_agree(
    sign: Any, use: Any, divisions: int, waypoints: Any
) -> None:
    graph = surface_graph(sign, divisions=divisions, waypoints=waypoints)
    found = list(islice(cycles(graph, require=use), 1000))
    place = {
        name: (data["alpha1"], data["alpha2"]) for name, data in graph.nodes(data=True)
    }
    near = [
        name
        for name in graph
        if any(math.dist(place[name], point) < 0.4 for point in waypoints)
    ]
    found += islice(cycles(graph.subgraph(near), require=use), 500)
    for cycle in found[:: max(1, len(found) // 6)]:
        report, told = cycle.report, cycle.as_mapping()
        for name in ("valid", "two_color", "flyable", "reachable_from_hover"):
            assert told[name] is getattr(report, name), (name, cycle)
        assert cycle.path.color == cycle.color
        assert cycle.path.types == tuple(told["types"])
        assert cycle.path.length == pytest.approx(cycle.length, abs=1e-10)
        if cycle.flyable:
            assert report["least_singular_value"].value == pytest.approx(
                cycle.least_singular_value, abs=2e-5
            )
    if use == "two_color":
        assert {cycle.color for cycle in found} >= {"red", "mixed"}


def test_a_cycle_is_plain_values_and_pickles() -> None:
    cycle = next(cycles(surface_graph("negative"), require="flyable"))
    told = json.loads(json.dumps(cycle.as_mapping(), allow_nan=False))
    assert set(told) == set(
        "color sign path types colors length valid two_color flyable reachable_from_hover least_singular_value".split()
    )
    assert told["path"] == cycle.path.alpha.tolist()
    assert pickle.loads(pickle.dumps(cycle)) == cycle
    assert hash(cycle) == hash(pickle.loads(pickle.dumps(cycle)))


# Requests


def test_cycles_of_a_request_merge_both_signs_in_order() -> None:
    request = plan_request([(0.0, 0.0)], divisions=6)
    merged = list(grid_cycles(request, max_length=2.2))
    parts = [
        list(cycles(surface_graph(sign, divisions=6), max_length=2.2))
        for sign in ("negative", "positive")
    ]
    assert len(merged) == sum(map(len, parts))
    assert [cycle.length for cycle in merged] == sorted(
        cycle.length for part in parts for cycle in part
    )
