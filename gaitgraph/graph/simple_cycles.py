"""The shortest simple cycle through stops, or the best one found and how much shorter one could be."""

from __future__ import annotations

import math
from dataclasses import dataclass
from heapq import heappop, heappush
from typing import TYPE_CHECKING, Any

from gaitgraph.errors import InputError
from gaitgraph.graph.cycle_list import Cycle, Ground, checked_effort
from gaitgraph.graph.enumeration import Enumeration, canonical
from gaitgraph.graph.walks import Use, best_order

if TYPE_CHECKING:
    from collections.abc import Sequence

    import networkx as nx

    from gaitgraph.graph.enumeration import Item
    from gaitgraph.graph.lengths_ahead import Rows

__all__ = ["NoCycle", "SimpleCycle", "simple_cycle"]


@dataclass(frozen=True, slots=True, kw_only=True)
class SimpleCycle:
    """A simple cycle through stops, with what is known about shorter ones.

    Parameters
    ----------
    cycle
        The cycle.
    nodes
        Its nodes from the first stop on, in the direction in which it passes the stops.
    bound
        No simple cycle through the stops is shorter than this [rad].
    exact
        Whether the cycle is proven to be a shortest one; then `bound` is its length.
    """

    cycle: Cycle
    nodes: tuple[Any, ...]
    bound: float
    exact: bool

    @property
    def gap(self) -> float:
        """By what part the cycle may be longer than the shortest one, length/bound − 1; 0 if exact."""
        if self.exact:
            return 0.0
        return self.cycle.length / self.bound - 1 if self.bound > 0 else math.inf


@dataclass(frozen=True, slots=True, kw_only=True)
class NoCycle:
    """No simple cycle through stops was found; falsy.

    Parameters
    ----------
    reason
        Why, in one sentence.
    proven
        Whether there is none; otherwise the effort was spent.
    bound
        No simple cycle through the stops is shorter than this [rad]; infinite if there is none.
    """

    reason: str
    proven: bool
    bound: float

    def __bool__(self) -> bool:
        return False


def simple_cycle(
    graph: nx.Graph[Any],
    stops: Sequence[Sequence[Any]],
    *,
    use: Use = "valid",
    any_order: bool = False,
    effort: int | None = 1_000_000,
) -> SimpleCycle | NoCycle:
    """Return the shortest simple cycle through stops, or the best one found and how much shorter one could be.

    Parameters
    ----------
    graph, use, any_order
        As for :func:`cycles`.
    stops
        One or more stops, each a sequence of alternative nodes, passed in this cyclic order one way round or the
        other.
    effort
        Largest number of search steps. When they are spent the answer is the best cycle of the search and of a
        heuristic, which routes the legs one after the other around the nodes in use, with each leg as the first.

    Returns
    -------
    SimpleCycle or NoCycle
        Of several shortest cycles always the same one, by no rule. NoCycle is falsy and carries its reason.

    Raises
    ------
    InputError
        If an argument is malformed.

    Notes
    -----
    The problem is hard in general, and the heuristic may fail where a cycle exists. A closed walk, which may pass a
    node twice, is found in any case: :func:`gaitgraph.graph.walks.closed_walk`.

    Examples
    --------
    >>> from gaitgraph.graph.build import surface_graph
    >>> there_and_back = [[(12, 4, "red")], [(12, 6, "red")]]
    >>> answer = simple_cycle(surface_graph("negative"), there_and_back)
    >>> answer.exact, len(answer.nodes), round(answer.cycle.length, 4)
    (True, 4, 0.9481)
    """
    steps = checked_effort(effort)
    ground = Ground(graph, use)
    numbers = ground.stops(stops, "stops", any_order)
    if not numbers:
        raise InputError("stops: none given; allowed is one or more")
    rows = ground.rows_past(numbers)
    if not any(rows):
        return NoCycle(reason=_apart(ground.blocks(), numbers), proven=True, bound=math.inf)
    search = Enumeration(rows, stops=numbers, any_order=any_order, effort=steps)
    best = search.shortest()
    exact = best is not None
    if best is None and search.complete:
        reason = "every closed walk through the stops passes some node twice"
        return NoCycle(reason=reason, proven=True, bound=math.inf)
    if best is None:
        order = best_order(graph, [ground.names[stop[0]] for stop in numbers], use=use) if any_order else None
        ordered = [numbers[k] for k in order.order] if order is not None else numbers
        candidates = [*search.held, routed(rows, ordered)]
        best = min((item for item in candidates if item is not None), default=None)
    if best is None:
        reason = f"none found in {search.steps} steps; if there is one it is at least {search.bound:.4f} rad long"
        return NoCycle(reason=reason, proven=False, bound=search.bound)
    cycle = ground.cycle(best)
    exact = exact or cycle.length <= search.bound
    nodes = _from_first_stop(best[1], numbers, any_order)
    return SimpleCycle(
        cycle=cycle,
        nodes=tuple(ground.names[node] for node in nodes),
        bound=cycle.length if exact else search.bound,
        exact=exact,
    )


def _apart(blocks: list[set[int]], stops: Sequence[Sequence[int]]) -> str:
    """Return why no two-connected part of a graph holds every stop."""
    for number, stop in enumerate(stops, start=1):
        if all(block.isdisjoint(stop) for block in blocks):
            return f"stop {number} lies on no cycle"
    for number, stop in enumerate(stops, start=1):
        at = [block for block in blocks if not block.isdisjoint(stop)]
        for other, after in enumerate(stops[number:], start=number + 1):
            if all(block.isdisjoint(after) for block in at):
                return (
                    f"stops {number} and {other} are not joined, or only through a node that all ways between them pass"
                )
    return "no two-connected part of the graph holds all stops"


def _from_first_stop(path: tuple[int, ...], stops: Sequence[Sequence[int]], any_order: bool) -> tuple[int, ...]:
    """Return a cycle from its first stop on, in the direction in which it passes the stops."""
    turned = path
    for way in (path, (path[0], *path[:0:-1])):
        for k in [k for k, node in enumerate(way) if node in stops[0]]:
            turned = (*way[k:], *way[:k])
            places = iter((*turned, turned[0]))
            here: int | None = next(places)
            for stop in stops:
                while here is not None and here not in stop:
                    here = next(places, None)
            if any_order or here is not None:
                return turned
    return turned


def routed(rows: Rows, stops: Sequence[Sequence[int]]) -> Item | None:
    """Return a simple cycle through stops in order, not the shortest: leg after leg around what is in use, or None.

    Every leg is tried as the first one, and the shortest of the cycles is taken.
    """
    tours: list[list[Sequence[int]]]
    if len(stops) == 1:
        tours = [[(node,), (v,)] for node in stops[0] for v, _ in rows[node]]
    else:
        tours = [[(node,), *stops[k + 1 :], *stops[:k]] for k in range(len(stops)) for node in stops[k]]
    found = [cycle for tour in tours if (cycle := _routed_from(rows, tour)) is not None]
    return min(found, default=None)


def _routed_from(rows: Rows, stops: Sequence[Sequence[int]]) -> Item | None:
    start = stops[0][0]
    path, whole = [start], 0
    reserved = {stop[0] for stop in stops if len(stop) == 1}
    for k in range(1, len(stops) + 1):
        onward = k < len(stops)
        if onward and path[-1] in stops[k]:
            continue
        targets = set(stops[k]).difference(path) if onward else {start}
        closed = (reserved | set(path)) - targets
        leg = _leg(rows, path[-1], targets, closed, straight=onward or len(path) > 2)
        if leg is None:
            return None
        path += leg[1]
        whole += leg[0]
    return (whole, canonical(path[:-1])) if len(path) > 3 else None


def _leg(rows: Rows, source: int, targets: set[int], closed: set[int], *, straight: bool) -> Item | None:
    """Return length and nodes, without the source, of the shortest way to a target around closed nodes.

    Unless `straight`, the way has more than one edge.
    """
    heap: list[tuple[int, int, int]] = [(0, source, -1)]
    parent: dict[int, int] = {}
    while heap:
        whole, node, before = heappop(heap)
        if node in parent:
            continue
        parent[node] = before
        if node in targets and before >= 0:
            way = [node]
            while parent[way[-1]] != source:
                way.append(parent[way[-1]])
            return whole, tuple(way[::-1])
        for other, length in rows[node]:
            if other not in closed and other not in parent and (straight or node != source or other not in targets):
                heappush(heap, (whole + length, other, node))
    return None
