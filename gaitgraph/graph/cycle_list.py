"""The simple closed cycles of surface graphs, one after the other in order of length, and the shortest through stops.

A cycle passes three or more nodes, none of them twice. Cycles come in a total order: by length, compared as whole
multiples of 1e-12 rad, then by their nodes in canonical form. That form starts at the node that comes first in the
graph and continues with the earlier of its two neighbours on the cycle; a cycle and its reverse are the same cycle.

The search is depth first with iterative deepening, as IDA* (Korf 1985): a limit of length rises from pass to pass. A
path is cut as soon as its length and that of the shortest walk that can still close it exceed the limit. The shortest
such sum, the floor of the next pass, is a proven bound: no cycle that is still to come is shorter. Without stops each
cycle is searched from its smallest node and the smaller of that node's two neighbours on it, with stops from a stop.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Iterator
from functools import cache, lru_cache
from heapq import heapify, heappop, heappush, nsmallest
from itertools import chain, combinations
from typing import TYPE_CHECKING, Any, NamedTuple

import networkx as nx

from gaitgraph.angles import checked_number, whole_number
from gaitgraph.errors import InputError, shown
from gaitgraph.graph.build import vehicle_and_coefficients
from gaitgraph.graph.walks import MOST_ANY_ORDER, QUANTA_PER_RADIAN, Cycle, Use, allowed_edges, quanta_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

Rows = list[list[tuple[int, int]]]
"""For each node its neighbours, in rising order, each with the length of the edge [quanta]."""

Item = tuple[int, tuple[int, ...]]
"""A cycle: its length [quanta] and its nodes in canonical form; items compare in the total order."""

Step = tuple[int, int, int, Any]
"""One step on: least length over this edge and back, node, length of the edge, state there."""

MOST_HELD = 50_000  # cycles that a pass keeps; twice as many for a moment
_NEVER = 1 << 62  # the distance of a node that cannot be reached
_MOST_STATES, _REPORT_STEPS = 30_000, 200_000
_ROUNDING = 1000  # quanta: what rounding its edges may add to a cycle


class Cycles(Iterator[Cycle]):
    """The simple closed cycles of one or more graphs, found lazily; see :func:`cycles`.

    Those of several graphs come in order of length, ties from the earlier graph first. `found` is how many have been
    yielded; `bound`, `complete`, `steps` and `reason` hold at any time, after an interruption too.
    """

    def __init__(self, sources: Iterable[_Source]) -> None:
        self.found = 0
        self.sources = list(sources)
        self._heads: list[Cycle | None] = [None] * len(self.sources)

    def look_ahead(self) -> None:
        """Find the next cycle of each graph without yielding it, which sharpens the bound."""
        for k, source in enumerate(self.sources):
            if self._heads[k] is None:
                self._heads[k] = next(source.cycles, None)

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
        return min((source.search.bound for source in self.sources), default=math.inf)

    @property
    def complete(self) -> bool:
        """Whether every cycle within `max_length` has been yielded."""
        return all(source.search.complete for source in self.sources) and not any(self._heads)

    @property
    def steps(self) -> int:
        """How many nodes have been expanded."""
        return sum(source.search.steps for source in self.sources)

    @property
    def reason(self) -> str | None:
        """Why no cycle has been found, in one sentence; None if one has."""
        return None if self.found else "; ".join(dict.fromkeys(source.why_none() for source in self.sources))

    def __str__(self) -> str:
        head = f"{self.found} cycle{'s' * (self.found != 1)}"
        return f"{head}: all there are" if self.complete else f"{head}: all that are shorter than {self.bound:.4f} rad"


def cycles(
    graph: nx.Graph[Any],
    *,
    max_length: float | None = None,
    use: Use = "valid",
    through: Sequence[Sequence[Any]] = (),
    any_order: bool = False,
    shortest: bool = False,
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
    through
        Stops, each a sequence of alternative nodes: only cycles that pass the stops in this cyclic order, in either
        direction. One node may serve several consecutive stops.
    any_order
        Pass the stops, at most nine, in any order.
    shortest
        Yield only one cycle, soon: any shortest one, or, when the effort is spent, the best one found so far. It is
        proven to be a shortest one if it is not longer than the `bound`.
    effort
        Largest number of search steps, after which the iterator stops, incomplete. None: no limit.
    progress
        Called with a line of text for each range of lengths that is done, and every 200 000 steps.

    Notes
    -----
    The number of cycles grows exponentially with their length, and so does the time; memory does not. The next cycle
    may take long: stops in an awkward order may have none, and to prove that is hard. A closed walk, which may pass a
    node twice, is found in any case: :func:`gaitgraph.graph.walks.closed_walk`.

    Examples
    --------
    >>> from gaitgraph.graph.build import surface_graph
    >>> found = cycles(surface_graph("negative"), max_length=0.7)
    >>> first = next(found)
    >>> first.nodes, round(first.length, 4), first.color
    (((2, 1, 'red'), (3, 1, 'red'), (3, 2, 'red')), 0.6704, 'red')
    >>> 1 + sum(1 for _ in found), found.complete
    (965, True)
    >>> stops = [[(12, 4, "red")], [(12, 6, "red")]]
    >>> there_and_back = next(cycles(surface_graph("negative"), through=stops, shortest=True, effort=1_000_000))
    >>> len(there_and_back.nodes), round(there_and_back.length, 4)
    (4, 0.9481)
    """
    options: dict[str, Any] = {"any_order": any_order, "shortest": shortest, "progress": progress}
    if max_length is not None:
        most = checked_number("max_length", max_length, "a finite number ≥ 0 (rad) or None")
        options["most"] = quanta_of(most) + _ROUNDING
    if effort is not None:
        options["effort"] = whole_number("effort", effort, 1, 10**12)
    return Cycles([_Source(graph, use, through, options)])


class _Source:
    """A graph in whole numbers, and the cycles found in it: a node is its position in the graph, lengths are quanta."""

    def __init__(self, graph: nx.Graph[Any], use: Use, through: object, options: Mapping[str, Any]) -> None:
        allowed = allowed_edges(use)
        vehicle_and_coefficients(graph)  # raises ContractError if metadata are missing
        self._surface, self._names = graph.copy(), list(graph.nodes)
        index = {name: k for k, name in enumerate(self._names)}
        given: Any = through if isinstance(through, (list, tuple)) else [through]
        for stop in given:
            nodes = stop if isinstance(stop, (list, tuple, set, frozenset)) and stop else [None]
            if not all(isinstance(node, Hashable) and node in index for node in nodes):
                raise InputError(f"stops must be a list of lists of nodes of the graph, got {shown(stop)}")
        if options["any_order"] and len(given) > MOST_ANY_ORDER:
            raise InputError(f"stops in any order must be at most {MOST_ANY_ORDER}, got {len(given)}")
        stops = [sorted({index[node] for node in stop}) for stop in given]
        rows: Rows = [[] for _ in self._names]
        for first, second, edge in graph.edges(data=True):
            a, b = index[first], index[second]
            if a != b and allowed(edge):
                rows[a].append((b, quanta_of(edge["length"])))
                rows[b].append((a, quanta_of(edge["length"])))
        self._why_none: str | None = None if stops else "the graph has none"
        if stops:
            rows, self._why_none = _past_stops(rows, stops)
        self.search = CycleSearch([sorted(row) for row in rows], stops=stops, **options)
        self.cycles = map(self._cycle, self.search)

    def why_none(self) -> str:
        """Return why no cycle has been found."""
        search = self.search
        if search.complete and math.isinf(search.bound):
            return self._why_none or "every closed walk through the stops passes some node twice"
        return f"none found in {search.steps} steps; any cycle is at least {search.bound:.4f} rad long"

    def _cycle(self, item: Item) -> Cycle:
        length, nodes = item[0] / QUANTA_PER_RADIAN, tuple(self._names[node] for node in item[1])
        return Cycle(nodes=nodes, length=length, surface=self._surface)


def _past_stops(rows: Rows, stops: Sequence[Sequence[int]]) -> tuple[Rows, str | None]:
    """Return the edges of the two-connected parts that hold every stop; if there is no such part, also why."""
    whole: nx.Graph[int] = nx.Graph((k, other) for k, row in enumerate(rows) for other, _ in row if k < other)
    # Each cycle lies in one part, of three or more nodes.
    blocks: list[Any] = [block for block in nx.biconnected_components(whole) if len(block) > 2]
    parts = [{k for k, block in enumerate(blocks) if not block.isdisjoint(stop)} for stop in stops]
    kept: Rows = [[] for _ in rows]
    for k in set.intersection(*parts):
        for node in blocks[k]:
            kept[node] += [entry for entry in rows[node] if entry[0] in blocks[k]]
    if any(kept):
        return kept, None
    alone = (f"stop {number} lies on no cycle" for number, part in enumerate(parts, start=1) if not part)
    pairs = (
        f"stops {number} and {other} are not joined, or only through a node that all paths between them pass"
        for (number, part), (other, after) in combinations(enumerate(parts, start=1), 2)
        if part.isdisjoint(after)
    )
    return kept, next(chain(alone, pairs), "no two-connected part of the graph holds all stops")


def canonical(path: Sequence[int]) -> tuple[int, ...]:
    """Return a cycle from its smallest node on, in the direction of that node's smaller neighbour."""
    start = path.index(min(path))
    turned = [*path[start:], *path[:start]]
    if turned[1] > turned[-1]:
        turned[1:] = turned[:0:-1]
    return tuple(turned)


def distances(
    rows: Rows, sources: Iterable[tuple[int, int]], *, within: int = _NEVER, avoid: tuple[int, ...] = (), least: int = 0
) -> tuple[dict[int, int], int]:
    """Return the distance [quanta] from the nearest source to each node `within` reach, by Dijkstra's algorithm.

    Sources are nodes with their initial distances. Nodes to `avoid` are reached but not passed; nodes below `least` are
    left out. The second answer is the least distance beyond reach, 2^62 if there is none.
    """
    found: dict[int, int] = {}
    heap = [(distance, node) for node, distance in sources]
    heapify(heap)
    while heap:
        distance, node = heappop(heap)
        if distance > within:
            return found, distance
        if node in found:
            continue
        found[node] = distance
        if node not in avoid:
            for other, length in rows[node]:
                if other >= least and other not in found:
                    heappush(heap, (distance + length, other))
    return found, _NEVER


class _Start(NamedTuple):
    """Where paths begin: the first nodes, their length, the state there, and a length that no cycle falls below.

    `steps_from` a state are the steps on; `closing` has the length of the last edge from each state that has one.
    """

    nodes: tuple[int, ...]
    length: int
    state: Any
    shortest: int
    steps_from: Callable[[Any], list[Step]]
    closing: Mapping[Any, int]


def _free_start(rows: Rows, root: int, second: int, length: int, closing: dict[int, int], limit: int) -> _Start:
    """Return the start of cycles without stops, of nodes from the root on; a state is a node."""
    # One edge beyond the limit, so that pruned paths have their true distance, which is a limit worth trying.
    within = max(limit - length, 0) + max(closing.values())
    back, beyond = distances(rows, closing.items(), within=within, avoid=(second,), least=root + 1)

    @cache
    def steps_from(node: int) -> list[Step]:
        return [(edge + back.get(v, beyond), v, edge, v) for v, edge in rows[node] if v > root]

    return _Start((root, second), length, second, length + back.get(second, beyond), steps_from, closing)


def _tour_start(rows: Rows, stops: Sequence[frozenset[int]], any_order: bool, root: int) -> _Start:
    """Return the start of paths from a root through all stops and back.

    A state is a node and the progress made there: the number of stops passed in order, each as early as possible, or in
    any order the set of those passed, as bits. `ahead` has the length of the shortest walk from a state that avoids the
    root, passes the remaining stops and ends at the root.
    """
    done = len(stops)
    while not any_order and done and root in stops[done - 1]:
        done -= 1  # the root, where the cycle ends, serves the last stops too
    if any_order:
        done = (1 << done) - 1

    @cache
    def advanced(progress: int, node: int) -> int:
        if any_order:
            return progress | sum(1 << k for k, stop in enumerate(stops) if node in stop)
        while progress < done and node in stops[progress]:
            progress += 1
        return progress

    # Backwards from the last stop, each distance over the nodes that make progress from here.
    begin = advanced(0, root)
    ahead = {done: distances(rows, [(root, 0)])[0]}
    for progress in range(done - 1, begin - 1, -1):
        if any_order and progress & begin != begin:
            continue
        nodes = set().union(*(stops if any_order else [stops[progress]])) - {root}
        onward = [(node, then) for node in nodes if (then := advanced(progress, node)) != progress]
        sources = [(node, ahead[then][node]) for node, then in onward if node in ahead[then]]
        ahead[progress] = distances(rows, sources, avoid=(root,))[0]

    @lru_cache(maxsize=_MOST_STATES)
    def steps_from(state: tuple[int, int]) -> list[Step]:
        reached = [(node, edge, advanced(state[1], node)) for node, edge in rows[state[0]] if node != root]
        # The most promising first: with stops, the cycles found are sorted anyway.
        return sorted(
            (edge + ahead[then][node], node, edge, (node, then)) for node, edge, then in reached if node in ahead[then]
        )

    closing = {(node, done): edge for node, edge in rows[root]}
    return _Start((root,), 0, (root, begin), ahead[begin].get(root, _NEVER), steps_from, closing)


class _Spent(Exception):
    """The effort is spent."""


class CycleSearch:
    """The simple cycles of three or more nodes as items, in their total order, each once; iterated once.

    `rows` states each edge from both sides, with lengths ≥ 0; `most` is the greatest length [quanta]. `stops`, `effort`
    and `shortest` are as for :func:`cycles`. Every cycle shorter than `floor` [quanta] has been yielded, `found` of
    them, in `steps` expanded nodes. `complete` states whether the search has ended.

    In a pass `held` are the first cycles found after the last one yielded, at most MOST_HELD (twice as many for a
    moment). Cycles longer than `_limit`, which only falls, are not needed. `_least_left` is at most the length of any
    cycle cut off. So unless the limit fell all cycles up to it are known, and no other is shorter than `_least_left`.
    """

    def __init__(
        self,
        rows: Rows,
        *,
        stops: Sequence[Sequence[int]] = (),
        any_order: bool = False,
        most: int = _NEVER - 1,
        effort: int = _NEVER,
        progress: Callable[[str], None] | None = None,
        shortest: bool = False,
    ) -> None:
        self.floor = self.steps = self.found = self._limit = 0
        self.complete = False
        self.held: set[Item] = set()
        self._rows, self._progress, self._shortest = rows, progress, shortest
        self._most, self._effort, self._least_left = most, effort, _NEVER
        self._tours: list[_Start] | None = None
        if stops:
            first = min(range(len(stops)), key=lambda k: len(stops[k]))
            turned = [frozenset(stop) for stop in (*stops[first:], *stops[:first])]
            self._tours = [_tour_start(rows, turned, any_order, root) for root in sorted(turned[0])]
            self.floor = min(tour.shortest for tour in self._tours)

    @property
    def bound(self) -> float:
        """The floor in radians, infinite when there are no more cycles at all."""
        return math.inf if self.floor >= _NEVER else self.floor / QUANTA_PER_RADIAN

    def __iter__(self) -> Iterator[Item]:
        # Each pass goes from the floor that the one before has proven to the floor and a width.
        last: Item = (-1, ())  # all items up to this one have been yielded
        width = 0
        while self.floor <= self._most:
            floor, before = self.floor, self.found
            # At first few are held, so that the first cycles come soon.
            capacity = min(MOST_HELD, max(1, 2 * self.found))
            self._limit, self._least_left = min(floor + width, self._most), _NEVER
            try:
                cut = self._hold(last, capacity)
            except _Spent:
                if self._shortest:  # the best one found so far; of a list the first ones are not known
                    yield from self.held
                return
            for item in sorted(self.held):
                self.floor = item[0]
                self.found += 1
                yield item
                if self._shortest:
                    return
            self.held.clear()
            if cut is not None:
                # More than could be held: go on after the last one held, with the width that filled this pass.
                last, self.floor, width = cut, cut[0], cut[0] - floor
            else:
                # All up to the limit: go on at the least length cut off, with a greater width if little was found.
                last, self.floor = (self._limit, (_NEVER,)), self._least_left
                if 4 * (self.found - before) < capacity:
                    width = max(2 * width, floor >> 7)
            self._report()
        self.complete = True

    def _hold(self, last: Item, capacity: int) -> Item | None:
        """Hold the first cycles beyond the last one; return the last one that is held if there are more."""
        self.held, cut = set(), None
        for length, path in self._closed_paths():
            if self._shortest:
                self.held = {(length, canonical(path))}
                self._limit = length - 1
                if length <= self.floor:
                    break
                continue
            item = (length, tuple(path) if self._tours is None else canonical(path))
            if item <= last or (cut is not None and item > cut):
                continue
            self.held.add(item)
            if len(self.held) > 2 * capacity:
                self.held = set(nsmallest(capacity, self.held))
                cut = max(self.held)
                self._limit = cut[0]
                if cut[0] == self.floor and self._tours is None:
                    break  # one length alone is too much to hold, and its cycles come in their order
        return cut

    def _closed_paths(self) -> Iterator[tuple[int, list[int]]]:
        """Yield length and nodes of the closed paths up to the limit; the list of nodes is a live one."""
        if self._tours is not None:
            for tour in self._tours:
                yield from self._closed_from(tour)
            return
        for root, row in enumerate(self._rows):
            onward = [entry for entry in row if entry[0] > root]
            for k, (second, length) in enumerate(onward[:-1], start=1):
                self._count_step()
                start = _free_start(self._rows, root, second, length, dict(onward[k:]), self._limit)
                yield from self._closed_from(start)

    def _closed_from(self, start: _Start) -> Iterator[tuple[int, list[int]]]:
        """Yield each closed path within the limit, which the caller may lower in between."""
        nodes, length, state, shortest, steps_from, closing = start
        if shortest > self._limit:
            self._least_left = min(self._least_left, shortest)
            return
        path, used = [*nodes], {*nodes}
        limit, least_left = self._limit, _NEVER
        stack: list[tuple[Iterator[Step], int]] = []  # for each node of the path the steps not yet taken, its length
        onward = iter(steps_from(state))
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
                _, node, edge, state = step
                stack.append((onward, length))
                length += edge
                path.append(node)
                used.add(node)
                onward = iter(steps_from(state))
                self._count_step()
                if state in closing and len(path) > 2:  # an edge there and back is no cycle
                    whole = length + closing[state]
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
            self._progress(f"cycles of length up to {self.bound:.3f} rad, {self.found} found")
