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
from gaitgraph.graph.cycle_list import CycleSearch, cycles
from gaitgraph.planning.grid import grid_cycles
from gaitgraph.planning.request import plan_request

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from gaitgraph.graph.cycle_list import Rows
    from gaitgraph.graph.walks import Cycle

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


def rows_of(number: int, edges: dict[tuple[int, int], int]) -> Rows:
    rows: Rows = [[] for _ in range(number)]
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


# The search on graphs of whole numbers


@st.composite
def weighted(draw: st.DrawFn) -> tuple[int, dict[tuple[int, int], int]]:
    number = draw(st.integers(3, 6))
    pairs = list(itertools.combinations(range(number), 2))
    chosen = draw(st.lists(st.sampled_from(pairs), unique=True, min_size=3))
    return number, {pair: draw(st.integers(0, 5)) for pair in chosen}


@settings(deadline=None, max_examples=100)
@given(weighted(), st.integers(1, 4), st.one_of(st.none(), st.integers(0, 25)))
def test_every_cycle_once_in_the_total_order(
    graph: tuple[int, dict[tuple[int, int], int]], held: int, most: int | None
) -> None:
    number, edges = graph
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("gaitgraph.graph.cycle_list.MOST_HELD", held)
        search = CycleSearch(
            rows_of(number, edges), most=1 << 61 if most is None else most
        )
        expected = [
            item for item in brute_items(edges) if most is None or item[0] <= most
        ]
        found = []
        for item in search:
            assert item[0] >= search.floor
            assert len(search.held) <= 2 * held + 1
            found.append(item)
    assert found == expected
    assert search.complete
    assert most is not None or search.bound == math.inf


@pytest.mark.no_cover
def test_long_rings_need_no_recursion() -> None:
    number = 1050  # beyond Python's own limit of recursion
    ring = {(k, k + 1): 1 for k in range(number - 1)} | {(0, number - 1): 1}
    expected = [(number, tuple(range(number)))]
    assert list(CycleSearch(rows_of(number, ring))) == expected


# Cycles of surface graphs


@pytest.mark.no_cover
@pytest.mark.parametrize("use", USES)
@pytest.mark.parametrize("divisions", [6, 7])
@pytest.mark.parametrize("sign", ["negative", "positive"])
def test_against_all_paths(sign: Any, divisions: int, use: Any) -> None:
    graph = surface_graph(sign, divisions=divisions, floor=0.02)
    longest = SHORT * 8 / divisions
    found = items_of(graph, cycles(graph, use=use, max_length=longest))
    assert found == walked_items(edges_of(graph, use), longest * 1e12 + 1000)
    assert len(found) > 5 or use == "flyable"


@pytest.mark.parametrize("use", ["valid", "two_color"])
def test_waypoints_off_the_grid_and_red_above_blue(use: Any) -> None:
    """Lengths of every kind lie close together; where a crossing line passes a node both colors are one."""
    graph = surface_graph(
        "negative", divisions=8, waypoints=[(0.5, -0.6), (1.2, -0.7), (-0.2, 0.5)]
    )
    found = items_of(graph, cycles(graph, use=use, max_length=1.8))
    assert found == walked_items(edges_of(graph, use), 1.8e12 + 1000)
    assert len({length for length, _ in found}) > 30
    fine = surface_graph("negative", divisions=16)
    above = [(a, b) for a, b, edge in fine.edges(data=True) if edge["length"] == 0]
    assert above
    first = next(
        cycle
        for cycle in cycles(fine, use="two_color")
        if set(above[0]) < set(cycle.nodes)
    )
    assert first.length == pytest.approx(2 * math.pi / 16)


@pytest.mark.no_cover
def test_the_first_cycles_come_at_once() -> None:
    search = cycles(surface_graph("negative", divisions=40))
    first = next(search)
    assert len(first.nodes) == 3
    assert (
        search.steps < 16_000
    )  # about a look at each pair of a node and its neighbour, twice
    assert not search.complete


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
    lengths = [cycle.length for cycle in cycles(graph, max_length=most, use="flyable")]
    assert lengths[-1] == pytest.approx(most, abs=1e-11)
    assert all(
        cycle.length < most - 1e-6
        for cycle in cycles(graph, max_length=most - 1e-6, use="flyable")
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
    found = list(islice(cycles(graph, use=use), 1000))
    place = {
        name: (data["alpha1"], data["alpha2"]) for name, data in graph.nodes(data=True)
    }
    near = [
        name
        for name in graph
        if any(math.dist(place[name], point) < 0.4 for point in waypoints)
    ]
    found += islice(cycles(graph.subgraph(near), use=use), 500)
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
    cycle = next(cycles(surface_graph("negative"), use="flyable"))
    told = json.loads(json.dumps(cycle.as_mapping(), allow_nan=False))
    assert set(told) == set(
        "color sign path types colors length valid two_color flyable reachable_from_hover least_singular_value".split()
    )
    assert told["path"] == cycle.path.alpha.tolist()
    assert pickle.loads(pickle.dumps(cycle)) == cycle
    assert hash(cycle) == hash(pickle.loads(pickle.dumps(cycle)))


# Effort, interruption, progress, input


@pytest.mark.no_cover
def test_spent_effort_leaves_a_true_bound() -> None:
    graph = surface_graph("negative")
    whole = list(islice(cycles(graph), 1000))
    for effort in (1, 1400, 5000):
        search = cycles(graph, effort=effort)
        found = list(search)
        assert found == whole[: len(found)]
        assert search.steps == effort
        assert not search.complete
        assert whole[len(found)].length >= search.bound
        assert next(search, None) is None


def test_an_interruption_leaves_the_attributes_true() -> None:
    graph = surface_graph("negative")

    def interrupt(line: str) -> None:
        if len(found) > 500:
            raise KeyboardInterrupt

    found: list[Cycle] = []
    search = cycles(graph, progress=interrupt)
    with pytest.raises(KeyboardInterrupt):
        found.extend(search)
    assert len(found) > 500
    assert not search.complete
    assert 0 < search.steps
    following = next(islice(cycles(graph), len(found), None))
    assert found[-1].length <= search.bound <= following.length
    assert next(search).nodes == following.nodes


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
    found = grid_cycles(request, max_length=2.2)
    for cycle, following in itertools.zip_longest(found, merged[1:]):
        assert (
            cycle.length <= found.bound <= (following.length if following else math.inf)
        )
    assert found.complete
    assert str(found) == f"{len(merged)} cycles: all there are"
