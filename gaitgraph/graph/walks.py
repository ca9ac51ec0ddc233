"""Closed walks on the surface graph: the shortest, or the most robust, through ordered stops.

Lengths are compared as whole multiples of 1e-12 rad, so that paths of the same length tie exactly; among them
the one with the fewest turns is taken, then the one that the order of the graph's nodes and edges brings first.

A length is that in the (α1, α2) plane. It hides the motion of α3 and α4 on a fibre, so on a graph with the fibres it is
the *travel* instead, the length in four dimensions over √2: the same on both sheets, and more than zero on a fibre too.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass
from heapq import heappop, heappush
from itertools import count
from typing import TYPE_CHECKING, Any, Literal, Protocol

from gaitgraph.errors import InputError, shown
from gaitgraph.graph.build import vehicle_and_coefficients
from gaitgraph.graph.loads import loads_of, mean_load

if TYPE_CHECKING:
    import networkx as nx

    from gaitgraph.vehicle import Vehicle

__all__ = [
    "MOST_ANY_ORDER",
    "QUANTA_PER_RADIAN",
    "Blocked",
    "ClosedWalk",
    "Order",
    "allowed_edges",
    "best_order",
    "closed_walk",
    "quanta_of",
]

Node = Hashable
Use = Literal["flyable", "valid", "two_color"]
Objective = Literal["shortest", "robust", "thrust"]
Allowed = Callable[[Mapping[str, Any]], bool]

QUANTA_PER_RADIAN = 1e12
"""Lengths are compared as whole multiples of 1e-12 rad."""

MOST_ANY_ORDER = 9
"""Up to so many stops the best order is exact; beyond it is Christofides' heuristic."""

_ANGLES = ("alpha1", "alpha2", "alpha3", "alpha4")

_ALLOWED: dict[str, Allowed] = {
    "flyable": lambda edge: edge["flyable"],
    "valid": lambda edge: edge["continuous"] and edge["keeps_sign"],
    "two_color": lambda edge: True,
}


def allowed_edges(use: object) -> Allowed:
    """Return which edges a use counts, as a predicate on their attributes; InputError if there is no such use.

    >>> allowed_edges("valid")({"continuous": True, "keeps_sign": False})
    False
    """
    if not isinstance(use, str) or use not in _ALLOWED:
        raise InputError(f"use: {shown(use)}; allowed are {', '.join(_ALLOWED)}")
    return _ALLOWED[use]


def quanta_of(length: float) -> int:
    """Return a length [rad] as a whole number of quanta.

    >>> quanta_of(0.5)
    500000000000
    """
    return int(length * QUANTA_PER_RADIAN + 0.5)


@dataclass(frozen=True, slots=True, kw_only=True)
class ClosedWalk:
    """A closed walk: its nodes in order, the first not repeated, and its length [rad]; see the module for which.

    `stops` says where in `nodes` each stop is; `thrust` is the integral of the load along it
    (:func:`gaitgraph.graph.loads.mean_load`), if that was the objective [rad].
    """

    nodes: tuple[Any, ...]
    length: float
    stops: tuple[int, ...]
    thrust: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Blocked:
    """No closed walk exists: no usable path leads from stop `leg` to the next one; if `rootless`, it has no node."""

    leg: int
    rootless: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Order:
    """An order of stops, counted from 0, the first one first.

    Parameters
    ----------
    order
        Each stop once.
    exact
        Whether no other order has a shorter closed walk; otherwise that of this one is at most 1.5 times as long.
    method
        "exact": dynamic programming over subsets; "christofides": the heuristic of that name, from networkx.
    """

    order: tuple[int, ...]
    exact: bool
    method: Literal["exact", "christofides"]


class _Roads:
    """The usable part of a graph, looked at through plain dictionaries."""

    def __init__(self, graph: nx.Graph[Any], use: Use) -> None:
        self.adjacency: dict[Any, Any] = dict(graph.adjacency())
        self.nodes: dict[Any, dict[str, Any]] = dict(graph.nodes(data=True))
        self.allowed = allowed_edges(use)
        self.legs: dict[tuple[Any, Any], tuple[int, list[Any]] | None] = {}
        self.fibers = graph.graph.get("sheets") == "all"
        self.weight = "travel" if self.fibers else "length"
        self.least = 1.0  # the least that a radian costs

    def _step(self, here: Mapping[str, Any], there: Mapping[str, Any]) -> tuple[float, ...]:
        """Return the difference of two nodes in the coordinates whose Euclidean length is the weight."""
        if not self.fibers:
            return there["alpha1"] - here["alpha1"], there["alpha2"] - here["alpha2"]
        return tuple((there[name] - here[name]) / math.sqrt(2.0) for name in _ANGLES)

    def weigh_by_load(self, vehicle: Vehicle) -> None:
        """Let each edge cost its length times the mean load of its ends, instead of its length."""
        angles = [[data[name] for name in _ANGLES] for data in self.nodes.values()]
        loads = loads_of(angles, [data["color"] for data in self.nodes.values()], vehicle).tolist()
        load = dict(zip(self.nodes, loads, strict=True))
        self.adjacency = {
            here: {
                there: {**edge, "cost": edge[self.weight] * mean_load(load[here], load[there])}
                for there, edge in around.items()
            }
            for here, around in self.adjacency.items()
        }
        self.weight, self.least = "cost", min(loads, default=1.0)
        self.legs.clear()

    def restrict(self, threshold: float) -> None:
        """Drop edges whose least singular value is below a threshold."""
        before = self.allowed
        self.allowed = lambda edge: before(edge) and edge["least_singular_value"] >= threshold
        self.legs.clear()

    def leg(self, source: Node, target: Node) -> tuple[int, list[Any]] | None:
        """Return (length in quanta, nodes from source to target) of the best path, or None."""
        key = (source, target)
        if key not in self.legs:
            self.legs[key] = self._leg(source, target)
        return self.legs[key]

    def _leg(self, source: Any, target: Any) -> tuple[int, list[Any]] | None:
        """Search by A* with the straight-line distance; lengths of ties are exact, so turns can break them."""
        if source == target:
            return 0, [source]
        nodes, adjacency, allowed, weight, hypot = self.nodes, self.adjacency, self.allowed, self.weight, math.hypot
        goal = nodes[target]
        x, y = goal["alpha1"], goal["alpha2"]
        # A little less than the distance, so that rounding to quanta cannot make it too large.
        scale = self.least * QUANTA_PER_RADIAN * (1 - 1e-9)
        straight = int(hypot(*self._step(nodes[source], goal)) * self.least * QUANTA_PER_RADIAN)
        best: dict[Any, int] = {source: 0}
        parent: dict[Any, Any] = {}
        order = count()
        heap: list[tuple[float, int, int, Any]] = [(0.0, 0, 0, source)]
        limit = math.inf
        while heap:
            estimate, _, cost, node = heappop(heap)
            if estimate > limit:
                break
            if cost > best[node] or node == target:
                continue
            for neighbor, edge in adjacency[node].items():
                if not allowed(edge):
                    continue
                reached = cost + int(edge[weight] * QUANTA_PER_RADIAN + 0.5)
                if reached < best.get(neighbor, math.inf):
                    best[neighbor] = reached
                    parent[neighbor] = node
                    if neighbor == target:
                        limit = reached
                        if reached <= straight + len(best):
                            break  # a straight line: nothing is shorter or has fewer turns
                    data = nodes[neighbor]
                    plane = hypot(data["alpha1"] - x, data["alpha2"] - y)
                    ahead = (hypot(*self._step(data, goal)) if self.fibers else plane) * scale
                    heappush(heap, (reached + ahead, next(order), reached, neighbor))
            else:
                continue
            path = [target]
            while path[-1] != source:
                path.append(parent[path[-1]])
            return limit, path[::-1]
        if target not in best:
            return None
        return best[target], self._fewest_turns(source, target, best)

    def _fewest_turns(self, source: Any, target: Any, best: dict[Any, int]) -> list[Any]:
        """Among the shortest paths, return one with the fewest turns, then the fewest steps."""
        onward: dict[Any, list[Any]] = {}
        seen, stack = {target}, [target]
        while stack:
            node = stack.pop()
            for previous, edge in self.adjacency[node].items():
                if previous not in best or not self.allowed(edge):
                    continue
                if best[previous] + int(edge[self.weight] * QUANTA_PER_RADIAN + 0.5) == best[node]:
                    onward.setdefault(previous, []).append(node)
                    if previous not in seen:
                        seen.add(previous)
                        stack.append(previous)
        order = count()
        heap: list[tuple[int, int, int, Any, Any, Any]] = [(0, 0, 0, source, None, None)]
        done: dict[tuple[Any, Any], Any] = {}
        while heap:
            turns, steps, _, node, heading, trail = heappop(heap)
            if (node, heading) in done:
                continue
            done[node, heading] = trail
            if node == target:
                path = [node]
                while trail is not None:
                    path.append(trail[0])
                    trail = done[trail]
                return path[::-1]
            here = self.nodes[node]
            for following in onward.get(node, ()):
                there = self.nodes[following]
                step = self._step(here, there)
                size = math.hypot(*step)
                ahead = tuple(round(part / size, 9) for part in step) if size else heading
                turned = turns + (heading is not None and ahead != heading)
                heappush(heap, (turned, steps + 1, next(order), following, ahead, (node, heading)))
        raise AssertionError("the shortest paths lead to the target")

    def lengths(self, source: Any) -> dict[Any, int]:
        """Return the length in quanta of the shortest path to each node that can be reached."""
        best: dict[Any, int] = {source: 0}
        order = count()
        heap: list[tuple[int, int, Any]] = [(0, 0, source)]
        while heap:
            cost, _, node = heappop(heap)
            if cost > best[node]:
                continue
            for neighbor, edge in self.adjacency[node].items():
                if self.allowed(edge):
                    reached = cost + int(edge[self.weight] * QUANTA_PER_RADIAN + 0.5)
                    if reached < best.get(neighbor, math.inf):
                        best[neighbor] = reached
                        heappush(heap, (reached, next(order), neighbor))
        return best

    def widest(self, source: Any, target: Any) -> float:
        """Return the best worst-case least singular value of the paths from source to target; −∞ if none."""
        best = {source: math.inf}
        order = count()
        heap: list[tuple[float, int, Any]] = [(-math.inf, 0, source)]
        while heap:
            negative, _, node = heappop(heap)
            if node == target:
                return -negative
            if -negative < best[node]:
                continue
            for neighbor, edge in self.adjacency[node].items():
                if not self.allowed(edge):
                    continue
                width = min(-negative, edge["least_singular_value"])
                if width > best.get(neighbor, -math.inf):
                    best[neighbor] = width
                    heappush(heap, (-width, next(order), neighbor))
        return -math.inf


def closed_walk(
    graph: nx.Graph[Any],
    stops: Sequence[Sequence[Any]],
    *,
    use: Use = "valid",
    objective: Objective = "shortest",
) -> ClosedWalk | Blocked:
    """Return the best closed walk through ordered stops and back to the first, or which leg blocks it.

    Parameters
    ----------
    graph
        A surface graph that keeps the contract of :mod:`gaitgraph.graph.build`.
    stops
        For each waypoint, in order, the nodes that may serve it; each at least one.
    use
        Which edges count: "flyable", "valid" (on one sheet, R of one sign) or "two_color" (all).
    objective
        "shortest" in the length that the module states, or "robust": the best worst case of the edges' least singular
        value, then the shortest; or "thrust": the least integral of the load, the largest hover thrust share, along the
        way (:mod:`gaitgraph.graph.loads`).

    Returns
    -------
    ClosedWalk or Blocked
        A stop may be passed more than once; one stop alone is a walk of one node.

    Examples
    --------
    >>> from gaitgraph.graph.build import surface_graph
    >>> corners = [(14, 2), (14, 6), (10, 6), (10, 2)]
    >>> walk = closed_walk(surface_graph("negative"), [[(*corner, "red")] for corner in corners])
    >>> len(walk.nodes), round(walk.length, 4)
    (16, 3.1416)
    """
    roads = _Roads(graph, use)
    weight = roads.weight
    if objective == "thrust":
        roads.weigh_by_load(vehicle_and_coefficients(graph)[0])
    if objective == "robust":
        width = best_cycle(stops, roads.widest, widest=True)
        if width is not None and width[0] > -math.inf:
            roads.restrict(width[0])

    def cost(source: Any, target: Any) -> float:
        leg = roads.leg(source, target)
        return math.inf if leg is None else leg[0]

    found = cheapest_choice(stops, cost)
    if isinstance(found, Blocked):
        return found
    chosen = found[1]
    nodes: list[Any] = []
    starts = []
    for source, target in zip(chosen, [*chosen[1:], chosen[0]], strict=True):
        starts.append(len(nodes))
        leg = roads.leg(source, target)
        nodes += leg[1][:-1] if leg else []
    total = found[0] / QUANTA_PER_RADIAN
    walked = tuple(nodes) or (chosen[0],)
    if objective != "thrust":
        return ClosedWalk(nodes=walked, length=total, stops=tuple(starts))
    steps = zip(walked, (*walked[1:], walked[0]), strict=True) if len(walked) > 1 else ()
    length = sum(quanta_of(graph.edges[step][weight]) for step in steps) / QUANTA_PER_RADIAN
    return ClosedWalk(nodes=walked, length=length, stops=tuple(starts), thrust=total)


def cheapest_choice(
    stops: Sequence[Sequence[Any]], cost: Callable[[Any, Any], float]
) -> tuple[float, list[Any]] | Blocked:
    """Return the least sum of the legs and the node chosen for each stop, or the leg that no choice can go."""
    found = best_cycle(stops, cost, widest=False)
    if found is not None:
        return found
    for k, here in enumerate(stops):
        onward = stops[(k + 1) % len(stops)]
        if all(math.isinf(cost(a, b)) for a in here for b in onward):
            return Blocked(leg=k)
    return Blocked(leg=len(stops) - 1)


def best_cycle(
    stops: Sequence[Sequence[Any]], measure: Callable[[Any, Any], float], *, widest: bool
) -> tuple[float, list[Any]] | None:
    """Choose a node for each stop so that the sum of the legs is least, or the narrowest leg is widest."""
    best: tuple[float, list[Any]] | None = None
    for first in stops[0]:
        reached: dict[Any, tuple[float, list[Any]]] = {first: (math.inf if widest else 0.0, [first])}
        for options in [*stops[1:], [first]]:
            following: dict[Any, tuple[float, list[Any]]] = {}
            for option in options:
                for node, (so_far, chosen) in reached.items():
                    leg = measure(node, option)
                    total = min(so_far, leg) if widest else so_far + leg
                    if math.isinf(total) and (total < 0) == widest:
                        continue
                    known = following.get(option)
                    if known is None or (total > known[0] if widest else total < known[0]):
                        following[option] = (total, [*chosen, option])
            reached = following
        for total, chosen in reached.values():
            if best is None or (total > best[0] if widest else total < best[0]):
                best = (total, chosen[:-1])
    return best


def best_order(graph: nx.Graph[Any], stops: Sequence[Any], *, use: Use = "valid") -> Order | None:
    """Return the order of stops with the shortest closed walk, or a good one; None if there is no closed walk.

    Parameters
    ----------
    graph, use
        As for :func:`closed_walk`.
    stops
        The node of each stop; the first one stays first.

    Returns
    -------
    Order or None
        Exact up to nine stops. With more, the order of Christofides' heuristic on the lengths of the shortest
        paths: these keep the triangle inequality and join all stops, so that its closed walk is at most 1.5 times
        as long as the shortest one. A thousand stops take a minute or two.

    Examples
    --------
    >>> from gaitgraph.graph.build import surface_graph
    >>> corners = [(14, 2), (10, 6), (14, 6), (10, 2)]
    >>> best_order(surface_graph("negative"), [(*corner, "red") for corner in corners])
    Order(order=(0, 2, 1, 3), exact=True, method='exact')
    """
    return order_on(_Roads(graph, use), stops)


class Legs(Protocol):
    """What an order of stops is found from: best paths between two of them, and from one to all."""

    def leg(self, source: Any, target: Any) -> tuple[int, list[Any]] | None:
        """Return (length in quanta, nodes) of the best path, or None."""

    def lengths(self, source: Any) -> dict[Any, int]:
        """Return the length in quanta of the best path to each node that can be reached."""


def order_on(roads: Legs, stops: Sequence[Any]) -> Order | None:
    """Return the order of stops as :func:`best_order` does, whatever tells the legs."""
    if len(stops) > MOST_ANY_ORDER:
        order = _christofides(roads, stops)
        return None if order is None else Order(order=order, exact=False, method="christofides")
    order = _exact_order(roads, stops)
    return None if order is None else Order(order=order, exact=True, method="exact")


def _christofides(roads: Legs, stops: Sequence[Any]) -> tuple[int, ...] | None:
    import networkx as nx

    complete: nx.Graph[int] = nx.Graph()
    for a, here in enumerate(stops):
        lengths = roads.lengths(here)
        for b in range(a):
            if stops[b] not in lengths:
                return None
            complete.add_edge(a, b, weight=lengths[stops[b]])
    tour = nx.approximation.christofides(complete)[:-1]
    start = tour.index(0)
    order = tour[start:] + tour[:start]
    if order[1] > order[-1]:
        order[1:] = order[:0:-1]
    return tuple(order)


def _exact_order(roads: Legs, stops: Sequence[Any]) -> tuple[int, ...] | None:
    n = len(stops)

    def cost(a: int, b: int) -> float:
        leg = roads.leg(stops[min(a, b)], stops[max(a, b)])
        return math.inf if leg is None else leg[0]

    table: dict[tuple[int, int], tuple[float, tuple[int, ...]]] = {(1, 0): (0.0, (0,))}
    for subset in range(1, 1 << n, 2):
        for last in range(n):
            if (subset, last) not in table:
                continue
            so_far, order = table[subset, last]
            for following in range(1, n):
                if subset >> following & 1:
                    continue
                candidate = (so_far + cost(last, following), (*order, following))
                key = (subset | 1 << following, following)
                if math.isfinite(candidate[0]) and candidate < table.get(key, (math.inf, ())):
                    table[key] = candidate
    full = (1 << n) - 1
    closed = [
        (length + (cost(last, 0) if last else 0.0), order)
        for (subset, last), (length, order) in table.items()
        if subset == full
    ]
    closed = [entry for entry in closed if math.isfinite(entry[0])]
    return min(closed)[1] if closed else None
