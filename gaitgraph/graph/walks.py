"""Closed walks on the surface graph: the shortest, the most robust, or the cheapest at own costs, through ordered stops.

Lengths in the (α1, α2) plane, and own costs, are compared as whole multiples of 1e-12, so that paths of the same length
tie exactly. Of those the one with the fewest turns is taken, then the one with the fewest steps.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import chain, combinations, pairwise, permutations, product
from operator import itemgetter
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from gaitgraph.angles import checked_number, is_list
from gaitgraph.errors import check_kind, checked_choice, shown, wrong
from gaitgraph.records import Record
from gaitgraph.tolerances import SAME_ANGLE

if TYPE_CHECKING:
    import networkx as nx

    from gaitgraph.invertibility.forms import FloatArray

EdgeRequirement = Literal["flyable", "valid", "two_color"]
Allowed = Callable[[Mapping[str, Any]], bool]
Weight = str | Callable[[Any, Any, Any], float | None]
"""Own cost of an edge, as in networkx: the name of an attribute, or a function of both nodes and the attributes."""

QUANTA_PER_RADIAN = 1e12
MOST_LENGTH = 1e12  # rad
MOST_ANY_ORDER = 9
"""Stops of which all orders are tried."""
_TURN = 1_000_000  # more than the steps of any path

_ALLOWED: dict[str, Allowed] = {
    "flyable": lambda edge: edge["flyable"],
    "valid": lambda edge: edge["continuous"] and edge["keeps_sign"],
    "two_color": lambda edge: True,
}


def allowed_edges(require: object) -> Allowed:
    """Return which edges count, as a predicate on their attributes; InputError for an unknown word."""
    return _ALLOWED[checked_choice("require", require, _ALLOWED)]


def quanta_of(length: float) -> int:
    """Return a length [rad] as a whole number of quanta."""
    return int(length * QUANTA_PER_RADIAN + 0.5)


def check_weight(weight: object) -> None:
    """Raise InputError unless a weight is None, a text or a function."""
    if not (weight is None or isinstance(weight, str) or callable(weight)):
        raise wrong(
            "weight", "must be the name of an edge attribute or a function", weight
        )


def cost_of_edge(
    first: Any, second: Any, edge: Mapping[str, Any], weight: Weight | None
) -> float | None:
    """Return the cost of an edge, by default its length; None hides it.

    As in networkx an edge without a named attribute costs 1. InputError if the cost is neither a number from 0 to 1e12
    nor None, or if it depends on the direction.
    """
    if weight is None:
        return float(edge["length"])
    costs = []
    for a, b in ((first, second), (second, first)):
        cost = edge.get(weight, 1) if isinstance(weight, str) else weight(a, b, edge)
        if cost is not None:
            allowed = f"a number from 0 to 1e12, or None, on the edge from {a} to {b}"
            cost = checked_number("weight", cost, allowed, most=MOST_LENGTH)
        costs.append(cost)
    there, back = costs
    if there != back:
        more = f" and {shown(back)} between {first} and {second}"
        raise wrong("weight", "must be the same in both directions", there, more)
    return there


def usable_graph(
    graph: nx.Graph[Any], allowed: Allowed, weight: Weight | None = None
) -> nx.Graph[Any]:
    """Return the allowed edges of a graph, with their `length` and `cost` in quanta, and `least_singular_value`.

    The cost is the length unless there is a weight; InputError if no edge has a named one. Nodes are in the order of the
    graph. Edges are in the order of their two nodes, and `rank` counts them from 0.
    """
    import networkx as nx

    check_weight(weight)
    if isinstance(weight, str) and graph.size():
        named = nx.get_edge_attributes(graph, weight)
        if not named:
            rule = "must be the name of an edge attribute"
            raise wrong("weight", rule, weight, ", which no edge has")
    number = {name: k for k, name in enumerate(graph)}
    pairs = [
        sorted(pair, key=number.__getitem__)
        for pair in graph.edges
        if pair[0] != pair[1] and allowed(graph.edges[pair])
    ]
    pairs.sort(key=lambda pair: [number[name] for name in pair])
    usable: nx.Graph[Any] = nx.Graph()
    usable.add_nodes_from(graph)
    for rank, (first, second) in enumerate(pairs):
        edge = graph.edges[first, second]
        cost = cost_of_edge(first, second, edge, weight)
        if cost is not None:
            usable.add_edge(
                first,
                second,
                rank=rank,
                length=quanta_of(edge["length"]),
                cost=quanta_of(cost),
                least_singular_value=edge["least_singular_value"],
            )
    return usable


@dataclass(frozen=True, slots=True, kw_only=True)
class ClosedWalk(Record):
    """A closed walk: its nodes, the first not repeated, its length [rad], and its cost, the length without a weight."""

    nodes: tuple[Any, ...]
    length: float
    cost: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Blocked:
    """No closed walk exists: no usable path leads from stop `leg` to the next one."""

    leg: int


def closed_walk(
    graph: nx.Graph[Any],
    stops: Sequence[Sequence[Any]],
    *,
    require: EdgeRequirement = "valid",
    objective: Literal["shortest", "robust"] = "shortest",
    weight: Weight | None = None,
) -> ClosedWalk | Blocked:
    """Return the best closed walk through ordered stops and back to the first, or which leg blocks it.

    A stop may be passed more than once; one stop alone is a walk of one node.

    Parameters
    ----------
    graph
        A surface graph that keeps the contract of :mod:`gaitgraph.graph.build`.
    stops
        For each waypoint, in order, the nodes that may serve it; each at least one.
    require
        Which edges count: "flyable", "valid" (on one sheet, R of one sign) or "two_color" (all).
    objective
        "shortest" in the (α1, α2) plane, or "robust": the best worst case of the edges' least singular value, then the
        shortest.
    weight
        Own cost of an edge instead of its length, as in networkx: the name of an edge attribute, or a function of both
        nodes and the edge's attributes, of which the cost is at least 0 and the same in both directions; None hides
        the edge. InputError otherwise, and if a stop is no node.

    Examples
    --------
    >>> from gaitgraph.graph.build import surface_graph
    >>> corners = [(14, 2), (14, 6), (10, 6), (10, 2)]
    >>> walk = closed_walk(surface_graph("negative"), [[f"{i:03} {j:03} red"] for i, j in corners])
    >>> len(walk.nodes), round(walk.length, 4)
    (16, 3.1416)
    """
    import networkx as nx

    are_lists = is_list(stops) and all(is_list(stop) and len(stop) for stop in stops)
    if not are_lists or not len(stops):
        raise wrong("stops", "must be lists of at least one node each", stops)
    _check_nodes(graph, chain.from_iterable(stops))
    usable = usable_graph(graph, allowed_edges(require), weight)
    if checked_choice("objective", objective, ("shortest", "robust")) == "robust":
        usable = _most_robust(usable, stops)
    paths = _Paths(graph, usable)

    # For each node of the first stop: the cheapest choice of a node for every other stop, leg by leg.
    best: tuple[float, list[Any]] = (math.inf, [])
    for first in stops[0]:
        reached: list[tuple[float, list[Any]]] = [(0, [first])]
        for options in [*stops[1:], [first]]:
            following = []
            for option in options:
                ways = [
                    (cost + paths.cost(chosen[-1], option), [*chosen, option])
                    for cost, chosen in reached
                ]
                following.append(min(ways, key=itemgetter(0)))
            reached = following
        best = min(best, *reached, key=itemgetter(0))
    cost, chosen = best
    if not chosen:
        return Blocked(leg=_blocked_leg(stops, paths))
    nodes = []
    for source, target in pairwise(chosen):
        nodes += paths.path(source, target)[:-1]
    length = nx.path_weight(usable, nodes + chosen[:1], "length")
    return ClosedWalk(
        nodes=tuple(nodes or chosen[:1]),
        length=length / QUANTA_PER_RADIAN,
        cost=cost / QUANTA_PER_RADIAN,
    )


def _check_nodes(graph: nx.Graph[Any], names: Iterable[Any]) -> None:
    """Raise InputError unless all names are nodes of a graph."""
    import networkx as nx

    check_kind("graph", graph, nx.Graph)
    for name in names:
        if name not in graph:
            raise wrong("stops", "must be nodes of the graph", name)


def _blocked_leg(stops: Sequence[Sequence[Any]], paths: _Paths) -> int:
    """Return the first leg that no path serves; the last one if each has a path, but not from the same nodes."""
    for leg, (starts, targets) in enumerate(pairwise(stops)):
        if all(math.isinf(paths.cost(a, b)) for a, b in product(starts, targets)):
            return leg
    return len(stops) - 1


def _most_robust(
    usable: nx.Graph[Any], stops: Sequence[Sequence[Any]]
) -> nx.Graph[Any]:
    """Return the edges that have the highest least singular value with which they still join a node of every stop."""
    import networkx as nx

    values = nx.get_edge_attributes(usable, "least_singular_value")

    def edges_above(least: float) -> nx.Graph[Any]:
        kept = usable.copy()
        kept.remove_edges_from(pair for pair in values if values[pair] < least)
        return kept

    def is_blocked(least: float) -> bool:
        parts = nx.connected_components(edges_above(least))
        return not any(all(map(part.intersection, stops)) for part in parts)

    levels: list[float] = sorted({0.0, *values.values()})
    first_blocked = bisect_left(levels, True, key=is_blocked)
    return edges_above(levels[max(first_blocked - 1, 0)])


class _Paths:
    """The cheapest paths between nodes of a usable graph, kept once they are found."""

    def __init__(self, graph: nx.Graph[Any], usable: nx.Graph[Any]) -> None:
        self._usable = usable
        self._nodes = graph.nodes
        self._from = cache(self._cheapest_from)

    def _cheapest_from(
        self, source: Any
    ) -> tuple[dict[Any, list[Any]], dict[Any, float]]:
        """Return the nodes before each node on the cheapest paths from a source, and the costs [quanta]."""
        import networkx as nx

        return nx.dijkstra_predecessor_and_distance(self._usable, source, weight="cost")

    def cost(self, source: Any, target: Any) -> float:
        """Return the cost of the cheapest path [quanta], infinite if there is none."""
        return self._from(source)[1].get(target, math.inf)

    def path(self, source: Any, target: Any) -> list[Any]:
        """Return the nodes of the cheapest path, both ends included, with the fewest turns, then the fewest steps."""
        import networkx as nx

        if source == target:
            return [source]
        before, _ = self._from(source)
        steps: nx.DiGraph[Any] = nx.DiGraph()
        ahead = [target]
        for node in ahead:  # grows in the loop
            for previous in before[node]:
                if previous not in steps:
                    ahead.append(previous)
                steps.add_edge(previous, node)
        # A path over steps instead of nodes, so that an edge of the line graph is a turn or straight on.
        starts = list(steps.out_edges(source))
        shortest: Any = nx.multi_source_dijkstra(
            nx.line_graph(steps), starts, weight=self._cost_of_a_step
        )
        costs, ways = shortest
        last = min(steps.in_edges(target), key=costs.__getitem__)
        return [source] + [node for _, node in ways[last]]

    def _cost_of_a_step(
        self, step: tuple[Any, Any], following: tuple[Any, Any], _: Any
    ) -> int:
        """Return 1 for a step straight on, and far more for one that turns; a step in place counts as a turn."""
        places = [self._nodes[name] for name in (*step, following[1])]
        a, b, c = [complex(place["alpha1"], place["alpha2"]) for place in places]
        turn = (b - a).conjugate() * (c - b)
        is_straight = abs(turn.imag) <= SAME_ANGLE * turn.real and turn.real > 0
        return 1 if is_straight else _TURN


def best_order(
    graph: nx.Graph[Any],
    stops: Sequence[Any],
    *,
    require: EdgeRequirement = "valid",
    weight: Weight | None = None,
) -> tuple[int, ...] | None:
    """Return the order of stops with a short closed walk, the shortest up to nine stops; None if there is none.

    Each stop is a node; the order counts them from 0, and the first one stays first; see :func:`shortest_order`. With a
    `weight`, as in :func:`closed_walk`, the order is that of a cheap walk.

    >>> from gaitgraph.graph.build import surface_graph
    >>> corners = [(14, 2), (10, 6), (14, 6), (10, 2)]
    >>> best_order(surface_graph("negative"), [f"{i:03} {j:03} red" for i, j in corners])
    (0, 2, 1, 3)
    """
    if not is_list(stops) or not len(stops):
        raise wrong("stops", "must be a list of at least one node", stops)
    _check_nodes(graph, stops)
    paths = _Paths(graph, usable_graph(graph, allowed_edges(require), weight))
    return shortest_order(len(stops), lambda a, b: paths.cost(stops[a], stops[b]))


def shortest_order(
    number: int,
    length: Callable[[int, int], float],
    *,
    nearest_next: bool = False,
) -> tuple[int, ...] | None:
    """Return an order of places, counted from 0, that makes a short closed path; None if two cannot be joined.

    `length` returns that of the shortest path between two places, a whole number of quanta, infinite if there is none.
    Up to nine places all orders are tried. For more the order is approximate, by Christofides' algorithm: its path is
    at most 1.5 times as long as the shortest, and not longer than in the given order. With `nearest_next` each place
    is followed by the nearest instead, which takes less time.
    """
    lengths = np.zeros((number, number))
    for a, b in combinations(range(number), 2):
        lengths[a, b] = lengths[b, a] = length(a, b)
        if math.isinf(lengths[a, b]):
            return None
    if number <= MOST_ANY_ORDER:
        orders = [(0, *rest) for rest in permutations(range(1, number))]
    else:
        orders = [tuple(range(number)), _approximate_order(lengths, nearest_next)]
    # Whole numbers, so that orders of the same length tie exactly; the first one is taken.
    table = np.array(orders)
    totals = lengths[table, np.roll(table, -1, axis=1)].sum(axis=1)
    return orders[int(totals.argmin())]


def _approximate_order(lengths: FloatArray, nearest_next: bool) -> tuple[int, ...]:
    """Return a short closed order that begins with 0, in the direction whose second place has the smaller number."""
    import networkx as nx

    complete: nx.Graph[int] = nx.Graph()
    for a, b in combinations(range(len(lengths)), 2):
        complete.add_edge(a, b, weight=lengths[a, b])
    if nearest_next:
        closed = nx.approximation.greedy_tsp(complete, source=0)
    else:
        closed = nx.approximation.christofides(complete)
    start = closed.index(0)
    order = closed[start:-1] + closed[:start]
    if order[1] > order[-1]:
        order[1:] = order[:0:-1]
    return tuple(order)
