"""The ways on from each state of a path that is to become a cycle, each with the least length that lies ahead.

Nodes are whole numbers, lengths whole numbers of quanta. What lies ahead is the length of a shortest walk, so it is
never more than the way that remains; a search that relies on it misses nothing.
"""

from __future__ import annotations

from array import array
from heapq import heapify, heappop, heappush
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

__all__ = ["NEVER", "Rows", "Tour", "Way", "Ways", "distances"]

Rows = list[list[tuple[int, int]]]
"""For each node its neighbours, in rising order, each with the length of the edge [quanta]."""

Way = tuple[int, int, int, Any]
"""One way on: least length of the way back over this edge, node, length of the edge, state there."""

NEVER = 1 << 62
"""The distance of what cannot be reached."""

_MOST_STATES = 30_000


def distances(
    rows: Rows, sources: Iterable[tuple[int, int]], *, within: int = NEVER, avoid: Iterable[int] = (), least: int = 0
) -> tuple[dict[int, int], int]:
    """Return the distance from the nearest source to each node by Dijkstra's algorithm [quanta].

    Parameters
    ----------
    rows
        The graph.
    sources
        Nodes, each with the distance at which it starts.
    within
        Farther nodes are left out.
    avoid
        Nodes that are reached but not passed.
    least
        Nodes below this number are left out.

    Returns
    -------
    distances of the nodes that were reached, and the least distance of those left out (NEVER if there are none)
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
    return found, NEVER


class Ways(dict[int, list[Way]]):
    """The ways on from each node when a cycle without stops is closed; made when they are first asked for."""

    def __init__(self, rows: Rows, root: int, second: int, closing: dict[int, int], room: int) -> None:
        super().__init__()
        self._rows, self._root = rows, root
        # One edge more than there is room for: what is pruned then has its true distance, a level worth trying.
        edge = max(closing.values())
        self.back, self.beyond = distances(
            rows, closing.items(), within=max(room, 0) + edge, avoid=(second,), least=root + 1
        )

    def __missing__(self, node: int) -> list[Way]:
        back, beyond, root = self.back, self.beyond, self._root
        row = [(edge + back.get(v, beyond), v, edge, v) for v, edge in self._rows[node] if v > root]
        self[node] = row
        return row


class Tour(dict[tuple[int, int], list[Way]]):
    """The ways on from each state of a path from a root past all stops and back; made when first asked for.

    A state is a node and the progress made there: with stops in order how many have been passed, each as early as
    possible; in any order the set of those passed, as bits. What lies ahead of a state is the shortest walk that
    avoids the root, passes the remaining stops and ends at the root.
    """

    def __init__(self, rows: Rows, stops: Sequence[Sequence[int]], any_order: bool, root: int) -> None:
        super().__init__()
        self.root = root
        self._rows, self._any_order = rows, any_order
        self._stops = [frozenset(stop) for stop in stops]
        self._serves: dict[int, int] = {}
        for k, stop in enumerate(self._stops):
            for node in stop:
                self._serves[node] = self._serves.get(node, 0) | 1 << k
        self._done = (1 << len(stops)) - 1 if any_order else len(stops)
        if not any_order:
            while self._done and root in self._stops[self._done - 1]:
                self._done -= 1  # the root, where the cycle ends, serves the last stops too
        self._home = distances(rows, [(root, 0)])[0]
        self._from_stop: dict[int, array[int]] = {}
        self._least: dict[tuple[int, int], int] = {}
        progress = self._advanced(0, root)
        self.start = (root, progress)
        self.closing = {(node, self._done): edge for node, edge in rows[root]}
        if not any_order:
            for k in range(self._done - 1, progress - 1, -1):  # the last stop first, so that nothing recurses deeply
                for node in self._stops[k]:
                    self._ahead(node, self._advanced(k, node))
        self.shortest = self._ahead(root, progress)

    def __missing__(self, state: tuple[int, int]) -> list[Way]:
        row: list[Way] = []
        for node, edge in self._rows[state[0]]:
            if node != self.root:
                progress = self._advanced(state[1], node)
                ahead = self._ahead(node, progress)
                if ahead < NEVER:
                    row.append((edge + ahead, node, edge, (node, progress)))
        row.sort()  # the most promising first: with stops, what is found is sorted anyway
        if len(self) >= _MOST_STATES:
            self.clear()
        self[state] = row
        return row

    def _advanced(self, progress: int, node: int) -> int:
        if self._any_order:
            return progress | self._serves.get(node, 0)
        while progress < self._done and node in self._stops[progress]:
            progress += 1
        return progress

    def _ahead(self, node: int, progress: int) -> int:
        if progress == self._done:
            return self._home.get(node, NEVER)
        state = (node, progress)
        least = self._least.get(state)
        if least is None:
            if self._any_order:
                following: Iterable[int] = [v for v, serves in self._serves.items() if serves & ~progress]
            else:
                following = self._stops[progress]
            least = min((self._over(node, v, progress) for v in following), default=NEVER)
            if node in self._serves:  # of these there are few
                self._least[state] = least
        return least

    def _over(self, node: int, stop: int, progress: int) -> int:
        """Return the shortest way from a node over the next stop and on to the root."""
        if stop == self.root:
            return NEVER
        if stop not in self._from_stop:
            table = array("q", [NEVER]) * len(self._rows)
            for v, distance in distances(self._rows, [(stop, 0)], avoid=(self.root,))[0].items():
                table[v] = distance
            self._from_stop[stop] = table
        way = self._from_stop[stop][node]
        return min(NEVER, way + self._ahead(stop, self._advanced(progress, stop))) if way < NEVER else NEVER
