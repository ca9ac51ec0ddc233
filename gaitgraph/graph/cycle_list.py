"""The simple closed cycles of surface graphs, one after the other in order of length.

A cycle passes three or more nodes, none of them twice. Cycles come in a total order: by length, compared as whole
multiples of 1e-12 rad, then by their nodes in canonical form. That form starts at the node that comes first in the
graph and continues with the earlier of its two neighbours on the cycle; a cycle and its reverse are the same cycle.

The search is depth first with iterative deepening, as IDA* (Korf 1985): a limit of length rises from pass to pass. A
path is cut as soon as its length and that of the shortest walk that can still close it exceed the limit. The shortest
such sum, the floor of the next pass, is a proven bound: no cycle that is still to come is shorter. Each cycle is
searched from its smallest node and the smaller of that node's two neighbours on it.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator
from copy import deepcopy
from functools import cache
from heapq import heapify, heappop, heappush, nsmallest
from typing import TYPE_CHECKING, Any, NamedTuple, Self

from gaitgraph.angles import checked_number, whole_number
from gaitgraph.graph.build import vehicle_and_coefficients
from gaitgraph.graph.walks import (
    QUANTA_PER_RADIAN,
    Cycle,
    Use,
    allowed_edges,
    quanta_of,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    import networkx as nx

Rows = list[list[tuple[int, int]]]
"""For each node its neighbours, in rising order, each with the length of the edge [quanta]."""

Item = tuple[int, tuple[int, ...]]
"""A cycle: its length [quanta] and its nodes in canonical form; items compare in the total order."""

Step = tuple[int, int, int]
"""One step on: least length over this edge and back, node, length of the edge."""

MOST_HELD = 50_000  # cycles that a pass keeps; twice as many for a moment
_NEVER = 1 << 62  # the distance of a node that cannot be reached
_REPORT_STEPS = 200_000
_ROUNDING = 1000  # quanta: what rounding its edges may add to a cycle


class Cycles(Iterator[Cycle]):
    """The simple closed cycles of one or more graphs, found lazily; see :func:`cycles`.

    Those of several graphs come in order of length, ties from the earlier graph first. `found` is how many have been
    yielded; `bound`, `complete` and `steps` hold at any time, after an interruption too, and the next cycle follows. A copy
    goes on by itself.
    """

    def __init__(self, sources: Iterable[tuple[CycleSearch, Iterator[Cycle]]]) -> None:
        self.found = 0
        self.sources = list(sources)
        self._heads: list[Cycle | None] = [None] * len(self.sources)

    def __copy__(self) -> Self:
        return deepcopy(self)  # else the two would take cycles from each other

    def look_ahead(self) -> None:
        """Find the next cycle of each graph without yielding it, which sharpens the bound."""
        for k, (_, following) in enumerate(self.sources):
            if self._heads[k] is None:
                self._heads[k] = next(following, None)

    def __next__(self) -> Cycle:
        self.look_ahead()
        heads = [head for head in self._heads if head is not None]
        if not heads:
            raise StopIteration
        cycle = min(heads, key=lambda head: head.length)
        self._heads[self._heads.index(cycle)] = None
        self.found += 1
        return cycle

    @property
    def bound(self) -> float:
        """Lower bound of the length of the cycles still to come [rad]; infinite when there are none."""
        return min((search.bound for search, _ in self.sources), default=math.inf)

    @property
    def complete(self) -> bool:
        """Whether every cycle within `max_length` has been yielded."""
        return all(search.complete for search, _ in self.sources) and not any(
            self._heads
        )

    @property
    def steps(self) -> int:
        """How many nodes have been expanded."""
        return sum(search.steps for search, _ in self.sources)

    def __str__(self) -> str:
        head = f"{self.found} cycle{'s' * (self.found != 1)}"
        return (
            f"{head}: all there are"
            if self.complete
            else f"{head}: all that are shorter than {self.bound:.4f} rad"
        )


def cycles(
    graph: nx.Graph[Any],
    *,
    max_length: float | None = None,
    use: Use = "valid",
    effort: int | None = None,
    progress: Callable[[str], None] | None = None,
) -> Cycles:
    """Return a lazy iterator over the simple closed cycles of a surface graph, in order of length, each once.

    Parameters
    ----------
    graph
        A surface graph that keeps the contract of :mod:`gaitgraph.graph.build`, of which a copy is searched;
        ContractError if its metadata are missing.
    max_length
        Length of the longest cycles [rad], with 1e-9 rad for rounding. None: no limit.
    use
        Which edges count: "flyable", "valid" (on one sheet, R of one sign) or "two_color" (all).
    effort
        Largest number of search steps, after which the iterator stops, incomplete. None: no limit.
    progress
        Called with a line of text for each range of lengths that is done, and every 200 000 steps.

    Notes
    -----
    The number of cycles grows exponentially with their length, and so does the time; memory does not. The shortest
    closed walk through given nodes is found by :func:`gaitgraph.graph.walks.closed_walk`.

    Examples
    --------
    >>> from gaitgraph.graph.build import surface_graph
    >>> found = cycles(surface_graph("negative"), max_length=0.7)
    >>> first = next(found)
    >>> first.nodes, round(first.length, 4), first.color
    (('002 001 red', '003 001 red', '003 002 red'), 0.6704, 'red')
    >>> 1 + sum(1 for _ in found), found.complete
    (965, True)
    """
    vehicle_and_coefficients(graph)  # raises ContractError if metadata are missing
    most = _NEVER - 1
    if max_length is not None:
        longest = checked_number(
            "max_length", max_length, "a finite number ≥ 0 (rad) or None"
        )
        most = quanta_of(longest) + _ROUNDING
    steps = _NEVER if effort is None else whole_number("effort", effort, 1, 10**12)
    allowed, surface, names = allowed_edges(use), graph.copy(), list(graph.nodes)
    index = {name: k for k, name in enumerate(names)}
    rows: Rows = [[] for _ in names]
    for first, second, edge in graph.edges(data=True):
        a, b = index[first], index[second]
        if a != b and allowed(edge):
            rows[a].append((b, quanta_of(edge["length"])))
            rows[b].append((a, quanta_of(edge["length"])))
    search = CycleSearch(
        [sorted(row) for row in rows], most=most, effort=steps, progress=progress
    )
    return Cycles([(search, _NamedCycles(search, names, surface))])


class _NamedCycles(Iterator[Cycle]):
    """The cycles that a search finds, with the names of their nodes."""

    def __init__(
        self, search: CycleSearch, names: list[Any], surface: nx.Graph[Any]
    ) -> None:
        self._search, self._names, self._surface = search, names, surface

    def __next__(self) -> Cycle:
        length, nodes = next(self._search)
        return Cycle(
            nodes=tuple(self._names[node] for node in nodes),
            length=length / QUANTA_PER_RADIAN,
            surface=self._surface,
        )


def _distances(
    rows: Rows, sources: Mapping[int, int], within: int, avoid: int, least: int
) -> tuple[dict[int, int], int]:
    """Return the distance [quanta] from the nearest source to each node `within` reach, by Dijkstra's algorithm.

    Sources are nodes with their initial distances. The node to `avoid` is reached but not passed; nodes below `least`
    are left out. The second answer is the least distance beyond reach, 2^62 if there is none.
    """
    found: dict[int, int] = {}
    heap = [(distance, node) for node, distance in sources.items()]
    heapify(heap)
    while heap:
        distance, node = heappop(heap)
        if distance > within:
            return found, distance
        if node in found:
            continue
        found[node] = distance
        if node != avoid:
            for other, length in rows[node]:
                if other >= least and other not in found:
                    heappush(heap, (distance + length, other))
    return found, _NEVER


class _Spent(Exception):
    """The effort is spent."""


class _Pass(NamedTuple):
    """A pass of the search: its floor, what was found before it, how many cycles it may hold, and where it was cut."""

    floor: int
    before: int
    capacity: int
    cut: Item | None


class CycleSearch(Iterator[Item]):
    """The simple cycles of three or more nodes as items, in their total order, each once; iterated once.

    `rows` states each edge from both sides, with lengths ≥ 0; `most` is the greatest length [quanta]. Every cycle
    shorter than `floor` [quanta] has been yielded, `found` of them, in `steps` expanded nodes. `complete` states
    whether the search has ended.

    In a pass `held` are the first cycles found after the last one yielded, at most MOST_HELD (twice as many for a
    moment). Cycles longer than `_limit`, which only falls, are not needed. `_least_left` is at most the length of any
    cycle cut off. So unless the limit fell all cycles up to it are known, and no other is shorter than `_least_left`.
    """

    def __init__(
        self,
        rows: Rows,
        *,
        most: int = _NEVER - 1,
        effort: int = _NEVER,
        progress: Callable[[str], None] | None = None,
    ) -> None:
        self.floor = self.steps = self.found = self._limit = 0
        self.complete = False
        self.held: set[Item] = set()
        # Each pass goes from the floor that the one before has proven to the floor and a width.
        self._width = 0
        self._last: Item = (-1, ())  # all items up to this one have been yielded
        self._pass: _Pass | None = None
        self._ready: deque[Item] = deque()
        self._rows, self._progress = rows, progress
        self._most, self._effort, self._least_left = most, effort, _NEVER

    @property
    def bound(self) -> float:
        """The floor in radians, infinite when there are no more cycles at all."""
        return math.inf if self.floor >= _NEVER else self.floor / QUANTA_PER_RADIAN

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {
            "_progress": None
        }  # a copy in another process is silent

    def __next__(self) -> Item:
        while not self._ready:
            if self._pass is not None:
                self._end(self._pass)
            if self.floor > self._most:
                self.complete = True
                raise StopIteration
            self._pass = self._begun()
        item = self._ready.popleft()
        self.floor = item[0]
        self.found += 1
        return item

    def _begun(self) -> _Pass:
        """Search the next pass, so that its cycles are ready; StopIteration if the effort is spent."""
        # At first few are held, so that the first cycles come soon.
        capacity = min(MOST_HELD, max(1, 2 * self.found))
        self._limit = min(self.floor + self._width, self._most)
        self._least_left = _NEVER
        try:
            cut = self._hold(self._last, capacity)
        except _Spent:
            raise StopIteration from None
        self._ready.extend(sorted(self.held))
        return _Pass(self.floor, self.found, capacity, cut)

    def _end(self, done: _Pass) -> None:
        """Set from where and how far the next pass goes, all cycles of this one having been yielded."""
        self.held.clear()
        self._pass = None
        if done.cut is not None:
            # More than could be held: go on after the last one held, with the width that filled this pass.
            self._last, self.floor = done.cut, done.cut[0]
            self._width = done.cut[0] - done.floor
        else:
            # All up to the limit: go on at the least length cut off, with a greater width if little was found.
            self._last, self.floor = (self._limit, (_NEVER,)), self._least_left
            if 4 * (self.found - done.before) < done.capacity:
                self._width = max(2 * self._width, done.floor >> 7)
        self._report()

    def _hold(self, last: Item, capacity: int) -> Item | None:
        """Hold the first cycles beyond the last one; return the last one that is held if there are more."""
        self.held, cut = set(), None
        for length, path in self._closed_paths():
            item = (length, tuple(path))
            if item <= last or (cut is not None and item > cut):
                continue
            self.held.add(item)
            if len(self.held) > 2 * capacity:
                self.held = set(nsmallest(capacity, self.held))
                cut = max(self.held)
                self._limit = cut[0]
                if cut[0] == self.floor:
                    break  # one length alone is too much to hold, and its cycles come in their order
        return cut

    def _closed_paths(self) -> Iterator[tuple[int, list[int]]]:
        """Yield length and nodes of the closed paths up to the limit; the list of nodes is a live one."""
        for root, row in enumerate(self._rows):
            onward = [entry for entry in row if entry[0] > root]
            for k, (second, length) in enumerate(onward[:-1], start=1):
                self._count_step()
                yield from self._closed_from(root, second, length, dict(onward[k:]))

    def _closed_from(
        self, root: int, second: int, length: int, closing: Mapping[int, int]
    ) -> Iterator[tuple[int, list[int]]]:
        """Yield each closed path within the limit, which the caller may lower in between.

        A path leads from the root to the second node and on over later nodes than the root; `closing` has the length of
        the last edge from each node that has one.
        """
        # One edge beyond the limit, so that pruned paths have their true distance, which is a limit worth trying.
        within = max(self._limit - length, 0) + max(closing.values())
        back, beyond = _distances(self._rows, closing, within, second, root + 1)
        shortest = length + back.get(second, beyond)
        if shortest > self._limit:
            self._least_left = min(self._least_left, shortest)
            return

        @cache
        def steps_from(node: int) -> list[Step]:
            return [
                (edge + back.get(v, beyond), v, edge)
                for v, edge in self._rows[node]
                if v > root
            ]

        path, used = [root, second], {root, second}
        limit, least_left = self._limit, _NEVER
        stack: list[
            tuple[Iterator[Step], int]
        ] = []  # for each node of the path the steps not yet taken, its length
        onward = iter(steps_from(second))
        try:
            while True:
                allowed = limit - length
                for step in onward:
                    if step[0] > allowed:
                        if length + step[0] < least_left:  # noqa: PLR1730 - a call costs more than the rest of the loop
                            least_left = length + step[0]
                    elif step[1] not in used:
                        break
                else:
                    if not stack:
                        return
                    onward, length = stack.pop()
                    used.discard(path.pop())
                    continue
                _, node, edge = step
                stack.append((onward, length))
                length += edge
                path.append(node)
                used.add(node)
                onward = iter(steps_from(node))
                self._count_step()
                if node in closing:
                    whole = length + closing[node]
                    if whole <= limit:
                        yield whole, path
                        limit = self._limit
                    elif whole < least_left:
                        least_left = whole
        finally:
            self._least_left = min(self._least_left, least_left)

    def _count_step(self) -> None:
        self.steps += 1
        if self.steps >= self._effort:
            raise _Spent
        if self.steps % _REPORT_STEPS == 0:
            self._report()

    def _report(self) -> None:
        if self._progress is not None and self.floor < _NEVER:
            self._progress(
                f"cycles of length up to {self.bound:.3f} rad, {self.found} found"
            )
