"""Closed walks on the surface graph: the shortest, or the most robust, through ordered stops.

Lengths in the (α1, α2) plane are compared as whole multiples of 1e-12 rad, so that paths of the same length tie
exactly. Of those the one with the fewest turns is taken, then the first in the order of the graph's nodes and edges.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from heapq import heappop, heappush
from itertools import chain, combinations, count, pairwise, permutations, product
from typing import TYPE_CHECKING, Any, Literal, cast

import numpy as np

from gaitgraph.angles import text_from_angle
from gaitgraph.errors import checked_choice
from gaitgraph.graph.build import gait_along, metadata_of, vehicle_and_coefficients
from gaitgraph.surface.sheets import HOVER_LABEL, RELATION, Sign, red_label

if TYPE_CHECKING:
    import networkx as nx

    from gaitgraph.gait.gait import Gait
    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.invertibility.matrices import IntArray
    from gaitgraph.validation.report import Report

Use = Literal["flyable", "valid", "two_color"]
Allowed = Callable[[Mapping[str, Any]], bool]

QUANTA_PER_RADIAN = 1e12
MOST_ANY_ORDER = 9  # stops of which all orders are tried
_ROUNDS, _ASCENTS = 20, 50  # bounds of the time for more stops

_ALLOWED: dict[str, Allowed] = {
    "flyable": lambda edge: edge["flyable"],
    "valid": lambda edge: edge["continuous"] and edge["keeps_sign"],
    "two_color": lambda edge: True,
}


def allowed_edges(use: object) -> Allowed:
    """Return which edges a use allows, as a predicate on their attributes; InputError for an unknown use."""
    return _ALLOWED[checked_choice("use", use, _ALLOWED)]


def _above(threshold: float, allowed: Allowed) -> Allowed:
    """Return which allowed edges keep the least singular value at a threshold or above."""

    def is_above(edge: Mapping[str, Any]) -> bool:
        return allowed(edge) and edge["least_singular_value"] >= threshold

    return is_above


def quanta_of(length: float) -> int:
    """Return a length [rad] as a whole number of quanta."""
    return int(length * QUANTA_PER_RADIAN + 0.5)


@dataclass(frozen=True, slots=True, kw_only=True)
class ClosedWalk:
    """A closed walk: its nodes, the first not repeated, and its length [rad]."""

    nodes: tuple[Any, ...]
    length: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Cycle(ClosedWalk):
    """A simple closed cycle, its nodes in canonical order, with the verdict of its edges.

    Every cycle is two-color between its nodes; tilt rates and accelerations are not judged. The length is the sum of
    the edges, each rounded to 1e-12 rad; `surface` is the graph as it was when the search began.
    """

    surface: nx.Graph[Any] = field(repr=False, compare=False)

    @property
    def sign(self) -> Sign:
        """Sign of R: "positive" or "negative"."""
        return cast("Sign", metadata_of(self.surface)["sign"])

    @property
    def color(self) -> str:
        """The color of all nodes, "red" or "blue", or "mixed"."""
        colors = {self.surface.nodes[name]["color"] for name in self.nodes}
        return str(colors.pop()) if len(colors) == 1 else "mixed"

    @property
    def _edges(self) -> list[dict[str, Any]]:
        return [
            self.surface.edges[pair] for pair in pairwise((*self.nodes, self.nodes[0]))
        ]

    @property
    def valid(self) -> bool:
        """Whether every edge is continuous and keeps the sign of R."""
        return all(edge["continuous"] and edge["keeps_sign"] for edge in self._edges)

    @property
    def flyable(self) -> bool:
        """Whether every edge is flyable, with the graph's floor."""
        return all(edge["flyable"] for edge in self._edges)

    @property
    def least_singular_value(self) -> float:
        """The least value along the edges, dimensionless; 0 with blue nodes or jumps."""
        return min(float(edge["least_singular_value"]) for edge in self._edges)

    @property
    def path(self) -> Gait:
        """The gait through all nodes."""
        return gait_along(self.surface, self.nodes)

    @property
    def report(self) -> Report:
        """All checks of the gait with straight runs merged, with the graph's floor; milliseconds."""
        return self.path.merged().check(floor=metadata_of(self.surface)["floor"])

    @property
    def reachable_from_hover(self) -> bool:
        """Whether the cycle is valid, red, with R > 0, in the component of α = 0 on the red sheet."""
        alpha = self.path.alpha
        labels = red_label(
            alpha[:, 0], alpha[:, 1], vehicle_and_coefficients(self.surface)[0]
        )
        return (
            self.valid
            and self.color == "red"
            and self.sign == "positive"
            and bool((labels == HOVER_LABEL).all())
        )

    def __str__(self) -> str:
        verdict = "flyable" if self.flyable else "valid" if self.valid else "not valid"
        corners = self.path.merged().alpha[:, :2].tolist()
        points = " ".join(
            f"({text_from_angle(a)}, {text_from_angle(b)})" for a, b in corners
        )
        return f"{self.length:.4f} rad  {RELATION[self.sign]}  {self.color:<5}  {verdict:<9}  {points}"

    def as_mapping(self) -> dict[str, Any]:
        """Return the cycle as plain values, ready for JSON."""
        path = self.path
        return {
            "color": self.color,
            "sign": self.sign,
            "path": path.alpha.tolist(),
            "types": [self.surface.nodes[name]["types"] for name in self.nodes],
            "colors": list(path.colors),
            "length": self.length,
            "valid": self.valid,
            "two_color": True,
            "flyable": self.flyable,
            "reachable_from_hover": self.reachable_from_hover,
            "least_singular_value": self.least_singular_value,
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class Blocked:
    """No closed walk exists: no usable path leads from stop `leg` to the next one."""

    leg: int


def closed_walk(
    graph: nx.Graph[Any],
    stops: Sequence[Sequence[Any]],
    *,
    use: Use = "valid",
    objective: Literal["shortest", "robust"] = "shortest",
) -> ClosedWalk | Blocked:
    """Return the best closed walk through ordered stops and back to the first, or which leg blocks it.

    A stop may be passed more than once; one stop alone is a walk of one node.

    Parameters
    ----------
    graph
        A surface graph that keeps the contract of :mod:`gaitgraph.graph.build`.
    stops
        For each waypoint, in order, the nodes that may serve it; each at least one.
    use
        Which edges count: "flyable", "valid" (on one sheet, R of one sign) or "two_color" (all).
    objective
        "shortest" in the (α1, α2) plane, or "robust": the best worst case of the edges' least singular value, then the
        shortest.

    Examples
    --------
    >>> from gaitgraph.graph.build import surface_graph
    >>> corners = [(14, 2), (14, 6), (10, 6), (10, 2)]
    >>> walk = closed_walk(surface_graph("negative"), [[f"{i:03} {j:03} red"] for i, j in corners])
    >>> len(walk.nodes), round(walk.length, 4)
    (16, 3.1416)
    """
    allowed = allowed_edges(use)
    if objective == "robust":
        threshold = _best_worst_case(graph, stops, allowed)
        if threshold is not None:
            allowed = _above(threshold, allowed)
    paths = _Paths(graph, allowed)

    # For each node of the first stop: the cheapest choice of a node for every other stop, leg by leg.
    best: tuple[float, list[Any]] | None = None
    for first in stops[0]:
        reached: dict[Any, tuple[float, list[Any]]] = {first: (0, [first])}
        for options in [*stops[1:], [first]]:
            following: dict[Any, tuple[float, list[Any]]] = {}
            for option in options:
                for node, (so_far, chosen) in reached.items():
                    total = so_far + paths.path(node, option)[0]
                    if total < following.get(option, (math.inf, []))[0]:
                        following[option] = (total, [*chosen, option])
            reached = following
        if first in reached and (best is None or reached[first][0] < best[0]):
            best = reached[first]
    if best is None:
        ends = enumerate(product(*pair) for pair in pairwise(stops))
        blocked = (
            leg
            for leg, pairs in ends
            if all(math.isinf(paths.path(a, b)[0]) for a, b in pairs)
        )
        return Blocked(leg=next(blocked, len(stops) - 1))
    length, chosen = best
    nodes = [
        node
        for source, target in pairwise(chosen)
        for node in paths.path(source, target)[1][:-1]
    ]
    return ClosedWalk(
        nodes=tuple(nodes) or (chosen[0],), length=length / QUANTA_PER_RADIAN
    )


def _best_worst_case(
    graph: nx.Graph[Any], stops: Sequence[Sequence[Any]], allowed: Allowed
) -> float | None:
    """Return the highest least singular value such that the edges which have it join a node of every stop, or None."""
    from networkx.utils import UnionFind

    served: dict[Any, int] = {}
    for k, stop in enumerate(stops):
        for node in stop:
            served[node] = served.get(node, 0) | 1 << k
    every = (1 << len(stops)) - 1
    if every in served.values():
        return math.inf
    edges = [
        (edge["least_singular_value"], a, b)
        for a, b, edge in graph.edges(data=True)
        if allowed(edge)
    ]
    # Edges are added in falling order of their value until one component serves every stop.
    components: UnionFind[Any] = UnionFind()
    for value, a, b in sorted(edges, key=lambda item: -item[0]):
        first, second = components[a], components[b]
        if first != second:
            components.union(a, b)
            together = served.get(first, 0) | served.get(second, 0)
            if together == every:
                return float(value)
            served[components[a]] = together
    return None


class _Paths:
    """The shortest paths between nodes of a graph along the edges that are allowed, kept once they are found."""

    def __init__(self, graph: nx.Graph[Any], allowed: Allowed) -> None:
        self._adjacency: dict[Any, Any] = dict(graph.adjacency())
        self._place = {
            name: (data["alpha1"], data["alpha2"])
            for name, data in graph.nodes(data=True)
        }
        self._allowed = allowed
        self._found: dict[tuple[Any, Any], tuple[float, list[Any]]] = {}

    def path(self, source: Any, target: Any) -> tuple[float, list[Any]]:
        """Return length [quanta] and nodes of the shortest path, both ends included; infinite and empty if none."""
        key = (source, target)
        if key not in self._found:
            self._found[key] = (
                (0, [source]) if source == target else self._search(source, target)
            )
        return self._found[key]

    def _search(self, source: Any, target: Any) -> tuple[float, list[Any]]:
        """Search by A* with the straight-line distance; lengths of ties are exact, so turns can break them."""
        place, adjacency, allowed, hypot = (
            self._place,
            self._adjacency,
            self._allowed,
            math.hypot,
        )
        x, y = place[target]
        # A little less than the distance, so that rounding to quanta cannot make it too large.
        scale = QUANTA_PER_RADIAN * (1 - 1e-9)
        straight = int(
            hypot(x - place[source][0], y - place[source][1]) * QUANTA_PER_RADIAN
        )
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
                reached = cost + int(
                    edge["length"] * QUANTA_PER_RADIAN + 0.5
                )  # quanta_of, where a call would count
                if reached < best.get(neighbor, math.inf):
                    best[neighbor] = reached
                    parent[neighbor] = node
                    if neighbor == target:
                        limit = reached
                        if reached <= straight + len(best):
                            # A straight line: nothing is shorter or has fewer turns.
                            path = [target]
                            while path[-1] != source:
                                path.append(parent[path[-1]])
                            return reached, path[::-1]
                    at = place[neighbor]
                    heappush(
                        heap,
                        (
                            reached + hypot(at[0] - x, at[1] - y) * scale,
                            next(order),
                            reached,
                            neighbor,
                        ),
                    )
        if target not in best:
            return math.inf, []
        return best[target], self._fewest_turns(source, target, best)

    def _fewest_turns(
        self, source: Any, target: Any, best: dict[Any, int]
    ) -> list[Any]:
        """Among the shortest paths, return one with the fewest turns, then the fewest steps."""
        # The edges that shortest paths use, found backwards from the target.
        onward: dict[Any, list[Any]] = {}
        seen, stack = {target}, [target]
        while stack:
            node = stack.pop()
            for previous, edge in self._adjacency[node].items():
                if previous not in best or not self._allowed(edge):
                    continue
                if best[previous] + quanta_of(edge["length"]) == best[node]:
                    onward.setdefault(previous, []).append(node)
                    if previous not in seen:
                        seen.add(previous)
                        stack.append(previous)
        # Dijkstra's algorithm over pairs of a node and the heading in which it is reached.
        order = count()
        heap: list[tuple[int, int, int, Any, Any, Any]] = [
            (0, 0, 0, source, None, None)
        ]
        done: dict[tuple[Any, Any], Any] = {}
        while heap:
            turns, steps, _, node, heading, before = heappop(heap)
            if (node, heading) in done:
                continue
            done[node, heading] = before
            if node == target:
                path = [node]
                while before is not None:
                    path.append(before[0])
                    before = done[before]
                return path[::-1]
            here = self._place[node]
            for following in onward.get(node, ()):
                there = self._place[following]
                step = there[0] - here[0], there[1] - here[1]
                size = math.hypot(*step)
                ahead = (
                    (round(step[0] / size, 9), round(step[1] / size, 9))
                    if size
                    else heading
                )
                turned = turns + (heading is not None and ahead != heading)
                heappush(
                    heap,
                    (turned, steps + 1, next(order), following, ahead, (node, heading)),
                )
        raise AssertionError("the shortest paths lead to the target")


def best_order(
    graph: nx.Graph[Any], stops: Sequence[Any], *, use: Use = "valid"
) -> tuple[tuple[int, ...], float] | None:
    """Return the order of stops with the shortest closed walk, or a good one, and its gap; None if there is none.

    Each stop is a node; the order counts them from 0, and the first one stays first. The gap is the share by which the
    closed walk may be longer than the shortest one: 0 up to nine stops, where all orders are tried.

    >>> from gaitgraph.graph.build import surface_graph
    >>> corners = [(14, 2), (10, 6), (14, 6), (10, 2)]
    >>> best_order(surface_graph("negative"), [f"{i:03} {j:03} red" for i, j in corners])
    ((0, 2, 1, 3), 0.0)
    """
    paths = _Paths(graph, allowed_edges(use))
    places = np.array(
        [[graph.nodes[stop][name] for name in ("alpha1", "alpha2")] for stop in stops]
    )
    return order_of_places(places, lambda a, b: paths.path(stops[a], stops[b])[0])


def order_of_places(
    places: FloatArray, length: Callable[[int, int], float]
) -> tuple[tuple[int, ...], float] | None:
    """Return an order of places, shape (n, 2) [rad], and its gap, as :func:`best_order` does; None if none is closed.

    `length` returns that of the shortest path between two places [quanta], infinite if there is none. It is called for
    the pairs that good orders join; for others the straight line counts, which is not longer. Orders are improved by
    reversing parts (2-opt) and by moving up to three places elsewhere (Or-opt).
    """
    n = len(places)
    straight = np.linalg.norm(places[:, None] - places, axis=-1)
    lengths = np.floor(straight * (QUANTA_PER_RADIAN * (1 - 1e-9)))
    known = np.eye(n, dtype=bool)

    def measured(pairs: Iterable[tuple[int, int]]) -> bool:
        """Measure the pairs that are not known, and return whether one is longer than its straight line."""
        before = lengths.sum()
        for a, b in pairs:
            if not known[a, b]:
                lengths[a, b] = lengths[b, a] = length(a, b)
                known[a, b] = known[b, a] = True
        return bool(lengths.sum() > before)

    if n <= MOST_ANY_ORDER:
        measured(combinations(range(n), 2))
        others = np.fromiter(
            chain.from_iterable(permutations(range(1, n))), dtype=np.intp
        )
        orders = np.pad(
            others.reshape(math.factorial(n - 1), n - 1), ((0, 0), (1, 0))
        )  # the first one stays first
        # Whole numbers of quanta, so that orders of the same length tie exactly; the first one is taken.
        totals = lengths[orders, np.roll(orders, -1, axis=1)].sum(axis=1)
        best, shortest, bound = orders[totals.argmin()], totals.min(), totals.min()
    else:
        best, left = np.zeros(n, dtype=np.intp), lengths.copy()
        for k in range(1, n):  # on to the nearest place that is left
            left[:, best[k - 1]] = np.inf
            best[k] = left[best[k - 1]].argmin()
        order, shortest = best, math.inf
        for _ in range(_ROUNDS):
            order = _improved(order, lengths)
            longer = measured(pairwise([*order, order[0]]))
            total = lengths[order, np.roll(order, -1)].sum()
            if total < shortest:
                best, shortest = order, total
            if not longer or math.isinf(total):
                break
        bound = _bound_of_orders(lengths, shortest) if math.isfinite(shortest) else 0.0
        best = np.roll(best, -int(best.argmin()))
        best = best if best[1] < best[-1] else np.roll(best[::-1], 1)
    if math.isinf(shortest):
        return None
    return tuple(best.tolist()), float(max(shortest / bound - 1, 0.0)) if bound else 0.0


def _improved(order: IntArray, lengths: FloatArray) -> IntArray:
    """Return a closed order that neither reversing a part nor moving up to three places elsewhere makes shorter."""
    idle = 0
    while idle < len(order):
        first, onward = order[0], np.roll(order, -1)
        step = lengths[order, onward]
        # Reverse the part from the second place to the j-th.
        gain = (step[0] + step - lengths[first, order] - lengths[order[1], onward])[2:]
        j = int(gain.argmax()) + 2
        best, new = gain[j - 2], [order[j:0:-1], order[j + 1 :]]
        for k in (
            1,
            2,
            3,
        ):  # move the second to the k-th place behind the j-th, as they are or reversed
            forth = lengths[order[1], order] + lengths[order[k], onward]
            back = lengths[order[k], order] + lengths[order[1], onward]
            removed = step[0] + step[k] - lengths[first, onward[k]]
            gain = (removed + step - np.minimum(forth, back))[k + 1 :]
            j = int(gain.argmax()) + k + 1
            if gain[j - k - 1] > best:
                part = order[1 : k + 1] if forth[j] <= back[j] else order[k:0:-1]
                best, new = (
                    gain[j - k - 1],
                    [order[k + 1 : j + 1], part, order[j + 1 :]],
                )
        idle = 0 if best > 0 else idle + 1
        order = np.concatenate([order[:1], *new]) if best > 0 else onward
    return order


def _bound_of_orders(lengths: FloatArray, shortest: float) -> float:
    """Return a lower bound of the length of closed orders, by Held and Karp.

    A closed order is a tree of all places but the first, with two steps to that one, so that the least such tree is not
    longer. Weights on the places change all orders alike; they are raised where the tree has more than two steps.
    """
    from scipy.sparse.csgraph import minimum_spanning_tree

    n, bound, pace = len(lengths), 0.0, 1.0
    weights = np.zeros(n)
    for _ in range(_ASCENTS):
        weighted = lengths + weights + weights[:, None]
        raised = 1 - weighted.min()  # in a sparse matrix 0 is no edge
        tree = minimum_spanning_tree(weighted[1:, 1:] + raised)
        total, steps = tree.sum() - raised * (n - 2) - 2 * weights.sum(), np.zeros(n)
        np.add.at(steps, np.concatenate(tree.nonzero()) + 1, 1)
        ends = weighted[0, 1:].argsort(kind="stable")[:2] + 1
        total, steps[0] = total + weighted[0, ends].sum(), 2
        steps[ends] += 1
        bound = max(bound, float(total))
        excess = steps - 2
        if not excess.any():
            break
        weights += pace * (shortest - total) / (excess @ excess) * excess
        pace *= 0.93
    return bound


def note_on_gap(gap: float) -> str:
    """Return what the gap of an order means, as a text."""
    percent = math.ceil(1000 * gap) / 10
    return f"the order of the waypoints may not be the best: the loop is at most {percent:g} % longer than needed"
