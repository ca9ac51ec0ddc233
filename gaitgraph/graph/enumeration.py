"""All simple cycles of a weighted graph in order of length: the search behind :mod:`gaitgraph.graph.cycle_list`.

Nodes are whole numbers, lengths whole numbers of quanta, so that equal lengths tie exactly. Paths are deepened
depth first up to a limit of length that rises from pass to pass; a path is left as soon as its length, and the
shortest way that can still close it, exceed the limit. The shortest of what was left, the floor of the next pass,
is a proven bound: no cycle that has not been found is shorter.

Without stops each cycle is searched from its smallest node and the smaller of that node's two neighbours on it.
Nodes are visited in rising order, so a pass over a single length meets the cycles in their order, and nothing has
to be stored. Where lengths lie close together a pass covers a range of them and holds what it finds, at most
MOST_HELD cycles: beyond that it keeps the first ones and leaves the others to the next pass. With stops each cycle
is searched from one of its stops, and what a pass finds is always held, sorted and freed of repetitions.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from gaitgraph.graph.lengths_ahead import NEVER, Tour, Ways
from gaitgraph.graph.walks import QUANTA_PER_RADIAN

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterator, Mapping, Sequence

    from gaitgraph.graph.lengths_ahead import Rows, Way

__all__ = ["MOST_HELD", "Enumeration", "Item", "canonical"]

Item = tuple[int, tuple[int, ...]]
"""A cycle: its length [quanta] and its nodes in canonical form; items compare in the total order."""

MOST_HELD = 50_000
"""A pass keeps up to so many cycles, and twice as many for a moment."""
_REPORT_STEPS = 200_000


class _Spent(Exception):
    """The effort is spent."""


class Enumeration:
    """The simple cycles of three or more nodes as an iterator of items, in their total order, each once.

    Parameters
    ----------
    rows
        The graph; its edges are stated from both sides, with lengths ≥ 0.
    stops
        Nodes, any of which serves the stop; the cycle passes the stops in this cyclic order, one way round or the
        other. One node may serve several stops in a row. Without stops all cycles are found.
    any_order
        The cycle passes the stops in any order.
    most
        No longer cycles [quanta], or None.
    effort
        Largest number of steps, or None.
    progress
        Called with a line of text now and then, or None.

    Attributes
    ----------
    floor
        Every cycle that is shorter than this has been yielded [quanta].
    complete
        Whether the enumeration came to its end.
    steps
        Nodes expanded so far.
    found
        Cycles yielded so far.
    held
        Cycles found and not yielded yet, not in order.
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
        self.floor = self.steps = self.found = 0
        self.complete = False
        self.held: set[Item] = set()
        self._rows, self._effort, self._progress = rows, effort, progress
        self._most = NEVER - 1 if most is None else most
        self._limit, self._ahead, self._alarm = 0, NEVER, 0
        self._set_alarm()
        self._tours: list[Tour] | None = None
        if stops:
            start = min(range(len(stops)), key=lambda k: len(stops[k]))
            turned = [*stops[start:], *stops[:start]]
            self._tours = [Tour(rows, turned, any_order, root) for root in sorted(set(turned[0]))]
            self.floor = min(tour.shortest for tour in self._tours)

    @property
    def bound(self) -> float:
        """The floor in radians, infinite when there are no more cycles at all."""
        return math.inf if self.floor >= NEVER else self.floor / QUANTA_PER_RADIAN

    def __iter__(self) -> Iterator[Item]:
        try:
            yield from self._passes()
        except _Spent:
            return

    def shortest(self) -> Item | None:
        """Return a shortest cycle, instead of iterating; None if there is none or the effort is spent.

        Which of several shortest ones is the same each time, and need not be the first: there may be very many. When
        the effort is spent, `held` has the shortest cycle that was met, and `floor` is still a bound.
        """
        width = 0
        try:
            while self.floor <= self._most:
                floor = self.floor
                self._limit, self._ahead = min(floor + width, self._most), NEVER
                paths = self._closed()
                for length, path in paths:
                    self.held = {(length, canonical(path))}
                    self._limit = length - 1
                    if length <= floor:
                        break
                paths.close()
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
        width, alone = 0, self._tours is None
        while self.floor <= self._most:
            floor, before, cut = self.floor, self.found, None
            self._limit, self._ahead = min(floor if alone else floor + width, self._most), NEVER
            if alone:
                for length, path in self._closed():
                    # A level that overflowed in the pass before goes on where that pass was cut.
                    if length == floor and (item := (length, tuple(path))) > last:
                        self.found += 1
                        yield item
            else:
                cut = self._hold(last)
                for item in sorted(self.held):
                    self.floor = item[0]
                    self.found += 1
                    yield item
                self.held.clear()
            if cut is not None:
                last, self.floor = cut, cut[0]
                alone = self._tours is None and cut[0] == floor
                width = width if alone else cut[0] - floor
            else:
                last, self.floor = (self._limit, (NEVER,)), self._ahead
                few = 4 * (self.found - before) < self._room()
                alone = alone and (self.found == 0 or not few)
                if few and not alone:
                    width = max(2 * width, floor >> 7)
            self._tell()
        self.complete = True

    def _room(self) -> int:
        """Return how many cycles a pass keeps: few at first, so that the first ones come soon."""
        return min(MOST_HELD, max(1, 2 * self.found))

    def _hold(self, last: Item) -> Item | None:
        """Hold the first cycles beyond the last one; return the last one that is held if there are more."""
        floor, room, cut, held = self.floor, self._room(), None, self.held
        held.clear()
        paths = self._closed()
        for length, path in paths:
            if length < floor:
                continue
            item = (length, tuple(path) if self._tours is None else canonical(path))
            if item <= last or (cut is not None and item > cut):
                continue
            held.add(item)
            if len(held) > 2 * room:
                kept = sorted(held)[:room]
                held.clear()
                held.update(kept)
                cut = kept[-1]
                self._limit = cut[0]
                if cut[0] == floor and self._tours is None:
                    break  # one length alone is too much to hold, and its cycles come in their order
        paths.close()
        return cut

    def _closed(self) -> Generator[tuple[int, list[int]], None, None]:
        """Yield length and nodes of the closed paths up to the limit; the list of nodes is a live one."""
        if self._tours is not None:
            for tour in self._tours:
                yield from self._deepen([tour.root], 0, tour.start, tour, tour.closing)
            return
        for root, row in enumerate(self._rows):
            onward = [entry for entry in row if entry[0] > root]
            for k, (second, length) in enumerate(onward[:-1], start=1):
                closing = dict(onward[k:])
                self.steps += 1
                if self.steps >= self._alarm:
                    self._pause()
                ways = Ways(self._rows, root, second, closing, self._limit - length)
                shortest = length + ways.back.get(second, ways.beyond)
                if shortest <= self._limit:
                    yield from self._deepen([root, second], length, second, ways, closing)
                else:
                    self._ahead = min(self._ahead, shortest)

    def _deepen(
        self, path: list[int], length: int, state: Any, ways: Mapping[Any, list[Way]], closing: Mapping[Any, int]
    ) -> Iterator[tuple[int, list[int]]]:
        """Yield each way to close a path within the limit; `closing` holds the last edge from where there is one."""
        limit, ahead, left = self._limit, NEVER, self._alarm - self.steps
        used = set(path)
        stack: list[tuple[Iterator[Way], int]] = []
        ways_on = iter(ways[state])
        try:
            while True:
                room = limit - length
                for way in ways_on:
                    if way[0] > room:
                        if length + way[0] < ahead:  # noqa: PLR1730 - a call costs more than the rest of the loop
                            ahead = length + way[0]
                    elif way[1] not in used:
                        break
                else:
                    if not stack:
                        return
                    ways_on, length = stack.pop()
                    used.discard(path.pop())
                    continue
                _, node, step, state = way
                stack.append((ways_on, length))
                length += step
                path.append(node)
                used.add(node)
                ways_on = iter(ways[state])
                left -= 1
                if not left:
                    self.steps = self._alarm
                    self._pause()
                    left = self._alarm - self.steps
                if state in closing and len(path) > 2:
                    whole = length + closing[state]
                    if whole <= limit:
                        yield whole, path
                        limit = self._limit
                    elif whole < ahead:
                        ahead = whole
        finally:
            self.steps = self._alarm - left
            self._ahead = min(self._ahead, ahead)

    def _set_alarm(self) -> None:
        self._alarm = self.steps + _REPORT_STEPS
        if self._effort is not None:
            self._alarm = min(self._alarm, self._effort)

    def _pause(self) -> None:
        if self._effort is not None and self.steps >= self._effort:
            raise _Spent
        self._set_alarm()
        self._tell()

    def _tell(self) -> None:
        if self._progress is not None and self.floor < NEVER:
            up_to = self.floor / QUANTA_PER_RADIAN
            self._progress(f"cycles of length up to {up_to:.3f} rad, {self.found} found")


def canonical(path: Sequence[int]) -> tuple[int, ...]:
    """Return a cycle from its smallest node on, in the direction of that node's smaller neighbour."""
    start = path.index(min(path))
    turned = [*path[start:], *path[:start]]
    if turned[1] > turned[-1]:
        turned[1:] = turned[:0:-1]
    return tuple(turned)
