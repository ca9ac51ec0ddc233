"""All simple cycles of a weighted graph in order of length: the search behind :mod:`gaitgraph.graph.cycle_list`.

Nodes are whole numbers, lengths whole numbers of quanta, so that equal lengths tie exactly. Paths are deepened
depth first up to a limit of length that rises from pass to pass. A path is left as soon as its length, and the
shortest walk that can still close it, exceed the limit. The shortest of what was left, the floor of the next pass,
is a proven bound: no cycle that has not been found is shorter.

Without stops each cycle is searched from its smallest node and the smaller of that node's two neighbours on it. With
stops each cycle is searched from one of its stops. A pass holds what it finds, sorted and freed of repetitions, at most
MOST_HELD cycles: beyond that it keeps the first ones and leaves the others to the next pass.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from heapq import heapify, heappop, heappush
from typing import TYPE_CHECKING, Any

from gaitgraph.graph.walks import QUANTA_PER_RADIAN

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

Rows = list[list[tuple[int, int]]]
"""For each node its neighbours, in rising order, each with the length of the edge [quanta]."""

Item = tuple[int, tuple[int, ...]]
"""A cycle: its length [quanta] and its nodes in canonical form; items compare in the total order."""

Step = tuple[int, int, int, Any]
"""One step on: least length over this edge and back, node, length of the edge, state there."""

MOST_HELD = 50_000  # cycles that a pass keeps; twice as many for a moment
_NEVER = 1 << 62  # the distance of what cannot be reached
_MOST_STATES = 30_000
_REPORT_STEPS = 200_000


def canonical(path: Sequence[int]) -> tuple[int, ...]:
    """Return a cycle from its smallest node on, in the direction of that node's smaller neighbour."""
    start = path.index(min(path))
    turned = [*path[start:], *path[:start]]
    if turned[1] > turned[-1]:
        turned[1:] = turned[:0:-1]
    return tuple(turned)


def distances(
    rows: Rows, sources: Iterable[tuple[int, int]], *, within: int = _NEVER, avoid: Iterable[int] = (), least: int = 0
) -> tuple[dict[int, int], int]:
    """Return the distance [quanta] from the nearest source to each node `within` reach, by Dijkstra's algorithm.

    Each source has the distance at which it starts. Nodes to `avoid` are reached but not passed, those below `least`
    left out. Returned besides is the least distance of what lay beyond reach, 2^62 if nothing did.
    """
    found: dict[int, int] = {}
    heap = [(distance, node) for node, distance in sources]
    heapify(heap)
    stopping = set(avoid)
    while heap:
        distance, node = heappop(heap)
        if distance > within:
            return found, distance
        if node in found:
            continue
        found[node] = distance
        if node not in stopping:
            for other, length in rows[node]:
                if other >= least and other not in found:
                    heappush(heap, (distance + length, other))
    return found, _NEVER


class _FreeSteps(dict[int, list[Step]]):
    """The steps on from each node when a cycle without stops is closed; made when they are first asked for."""

    def __init__(self, rows: Rows, root: int, second: int, closing: dict[int, int], left: int) -> None:
        super().__init__()
        self._rows, self._root = rows, root
        # One edge more than the limit leaves: what is pruned then has its true distance, a level worth trying.
        within = max(left, 0) + max(closing.values())
        self.back, self.beyond = distances(rows, closing.items(), within=within, avoid=(second,), least=root + 1)

    def __missing__(self, node: int) -> list[Step]:
        back, beyond, root = self.back, self.beyond, self._root
        row = [(edge + back.get(v, beyond), v, edge, v) for v, edge in self._rows[node] if v > root]
        self[node] = row
        return row


class _TourSteps(dict[tuple[int, int], list[Step]]):
    """The steps on from each state of a path from a root past all stops and back; made when first asked for.

    A state is a node and the progress made there: with stops in order how many have been passed, each as early as
    possible; in any order the set of those passed, as bits. What lies ahead of a state is the shortest walk that
    avoids the root, passes the remaining stops and ends at the root.
    """

    def __init__(self, rows: Rows, stops: Sequence[Sequence[int]], any_order: bool, root: int) -> None:
        super().__init__()
        self.root = root
        self._rows, self._any_order = rows, any_order
        self._stops = [frozenset(stop) for stop in stops]
        self._done = len(stops)
        while not any_order and self._done and root in self._stops[self._done - 1]:
            self._done -= 1  # the root, where the cycle ends, serves the last stops too
        if any_order:
            self._done = (1 << self._done) - 1
        begin = self._advanced(0, root)
        self.start = (root, begin)
        self.closing = {(node, self._done): edge for node, edge in rows[root]}
        self._ahead = {self._done: distances(rows, [(root, 0)])[0]}
        for progress in range(self._done - 1, begin - 1, -1):
            if any_order and progress & begin != begin:
                continue
            following = self._stops if any_order else self._stops[progress : progress + 1]
            sources = []
            for node in set().union(*following) - {root}:
                then = self._advanced(progress, node)
                if then != progress and node in self._ahead[then]:
                    sources.append((node, self._ahead[then][node]))
            self._ahead[progress] = distances(rows, sources, avoid=(root,))[0]
        self.shortest = self._ahead[begin].get(root, _NEVER)

    def __missing__(self, state: tuple[int, int]) -> list[Step]:
        row: list[Step] = []
        for node, edge in self._rows[state[0]]:
            if node != self.root:
                progress = self._advanced(state[1], node)
                if node in self._ahead[progress]:
                    row.append((edge + self._ahead[progress][node], node, edge, (node, progress)))
        row.sort()  # the most promising first: with stops, what is found is sorted anyway
        if len(self) >= _MOST_STATES:
            self.clear()
        self[state] = row
        return row

    def _advanced(self, progress: int, node: int) -> int:
        if self._any_order:
            return progress | sum(1 << k for k, stop in enumerate(self._stops) if node in stop)
        while progress < self._done and node in self._stops[progress]:
            progress += 1
        return progress


class _Spent(Exception):
    """The effort is spent."""


class CycleSearch(Iterator[Item]):
    """The simple cycles of three or more nodes as an iterator of items, in their total order, each once.

    `rows` states each edge from both sides, with lengths ≥ 0. With `stops` only cycles that pass them, as for
    :func:`cycles`; none longer than `most` [quanta]; `effort` limits the steps. Every cycle shorter than `floor`
    [quanta] has been yielded, `found` of them, in `steps` expanded nodes; `held` are found and not yielded yet, in no
    order. `complete` says whether the search came to its end.
    """

    def __init__(
        self,
        rows: Rows,
        *,
        stops: Sequence[Sequence[int]] = (),
        any_order: bool = False,
        most: int | None = None,
        effort: int | None = None,
        progress: Callable[[str], None] | None = None,
    ) -> None:
        self.floor = self.steps = self.found = self._limit = 0
        self.complete = False
        self.held: set[Item] = set()
        self._rows, self._progress = rows, progress
        self._effort = _NEVER if effort is None else effort
        self._most = _NEVER - 1 if most is None else most
        self._ahead, self._alarm = _NEVER, min(_REPORT_STEPS, self._effort)
        self._tours: list[_TourSteps] | None = None
        if stops:
            start = min(range(len(stops)), key=lambda k: len(stops[k]))
            turned = [*stops[start:], *stops[:start]]
            self._tours = [_TourSteps(rows, turned, any_order, root) for root in sorted(set(turned[0]))]
            self.floor = min(tour.shortest for tour in self._tours)
        self._items = self._passes()

    def __next__(self) -> Item:
        return next(self._items)

    @property
    def bound(self) -> float:
        """The floor in radians, infinite when there are no more cycles at all."""
        return math.inf if self.floor >= _NEVER else self.floor / QUANTA_PER_RADIAN

    def shortest(self) -> Item | None:
        """Return a shortest cycle, instead of iterating; None if there is none or the effort is spent.

        Of several it need not be the first. When the effort is spent `held` has the shortest one that was met.
        """
        width = 0
        try:
            while self.floor <= self._most:
                floor = self.floor
                self._limit, self._ahead = min(floor + width, self._most), _NEVER
                for length, path in self._closed():
                    self.held = {(length, canonical(path))}
                    self._limit = length - 1
                    if length <= floor:
                        break
                if self.held:
                    (best,) = self.held
                    self.floor = best[0]
                    return best
                self.floor = self._ahead
                width = max(2 * width, floor >> 7)
        except _Spent:
            return None
        self.complete = True
        return None

    def _passes(self) -> Iterator[Item]:
        """Yield what pass after pass finds; each starts at the floor that the one before has proven."""
        last: Item = (-1, ())
        width = 0
        while self.floor <= self._most:
            floor, before = self.floor, self.found
            # Few are held at first, so that the first ones come soon.
            capacity = min(MOST_HELD, max(1, 2 * self.found))
            self._limit, self._ahead = min(floor + width, self._most), _NEVER
            try:
                cut = self._hold(last, capacity)
            except _Spent:
                return
            for item in sorted(self.held):
                self.floor = item[0]
                self.found += 1
                yield item
            self.held.clear()
            if cut is not None:
                last, self.floor, width = cut, cut[0], cut[0] - floor
            else:
                last, self.floor = (self._limit, (_NEVER,)), self._ahead
                if 4 * (self.found - before) < capacity:
                    width = max(2 * width, floor >> 7)
            self._report()
        self.complete = True

    def _hold(self, last: Item, capacity: int) -> Item | None:
        """Hold the first cycles beyond the last one; return the last one that is held if there are more."""
        floor, cut, held = self.floor, None, self.held
        held.clear()
        for length, path in self._closed():
            if length < floor:
                continue
            item = (length, tuple(path) if self._tours is None else canonical(path))
            if item <= last or (cut is not None and item > cut):
                continue
            held.add(item)
            if len(held) > 2 * capacity:
                kept = sorted(held)[:capacity]
                held.clear()
                held.update(kept)
                cut = kept[-1]
                self._limit = cut[0]
                if cut[0] == floor and self._tours is None:
                    break  # one length alone is too much to hold, and its cycles come in their order
        return cut

    def _closed(self) -> Iterator[tuple[int, list[int]]]:
        """Yield length and nodes of the closed paths up to the limit; the list of nodes is a live one."""
        if self._tours is not None:
            for tour in self._tours:
                yield from self._deepen([tour.root], 0, tour.start, tour, tour.closing)
            return
        for root, row in enumerate(self._rows):
            onward = [entry for entry in row if entry[0] > root]
            for k, (second, length) in enumerate(onward[:-1], start=1):
                closing = dict(onward[k:])
                self._count_step()
                steps = _FreeSteps(self._rows, root, second, closing, self._limit - length)
                shortest = length + steps.back.get(second, steps.beyond)
                if shortest <= self._limit:
                    yield from self._deepen([root, second], length, second, steps, closing)
                else:
                    self._ahead = min(self._ahead, shortest)

    def _deepen(
        self, path: list[int], length: int, state: Any, steps: Mapping[Any, list[Step]], closing: Mapping[Any, int]
    ) -> Iterator[tuple[int, list[int]]]:
        """Yield each closed path within the limit; `closing` holds the last edge from where there is one."""
        limit, ahead = self._limit, _NEVER
        used = set(path)
        stack: list[tuple[Iterator[Step], int]] = []
        onward = iter(steps[state])
        try:
            while True:
                reach = limit - length
                for step in onward:
                    if step[0] > reach:
                        if length + step[0] < ahead:  # noqa: PLR1730 - a call costs more than the rest of the loop
                            ahead = length + step[0]
                    elif step[1] not in used:
                        break
                else:
                    if not stack:
                        return
                    onward, length = stack.pop()
                    used.discard(path.pop())
                    continue
                _, node, edge, state = step
                stack.append((onward, length))
                length += edge
                path.append(node)
                used.add(node)
                onward = iter(steps[state])
                self._count_step()
                if state in closing and len(path) > 2:
                    whole = length + closing[state]
                    if whole <= limit:
                        yield whole, path
                        limit = self._limit
                    elif whole < ahead:
                        ahead = whole
        finally:
            self._ahead = min(self._ahead, ahead)

    def _count_step(self) -> None:
        self.steps += 1
        if self.steps >= self._alarm:
            if self.steps >= self._effort:
                raise _Spent
            self._alarm = min(self.steps + _REPORT_STEPS, self._effort)
            self._report()

    def _report(self) -> None:
        if self._progress is not None and self.floor < _NEVER:
            up_to = self.floor / QUANTA_PER_RADIAN
            self._progress(f"cycles of length up to {up_to:.3f} rad, {self.found} found")
