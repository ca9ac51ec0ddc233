"""Shortest distances over a compact graph, from one node outwards, without building anything per edge.

Costs are whole quanta, as in :mod:`gaitgraph.graph.walks`, so that ways of the same length tie exactly. Two engines give the
same distances:

"waves"
    numpy: all nodes whose distance falls into one bucket, as wide as the shortest grid step, are worked on at once
    (the buckets of Dial, and of Meyer and Sanders' Δ-stepping); what improves within its own bucket is taken again.
"kernel"
    A* in compiled code, with the package numba; the extra `fast` installs it.

Both know how far the goal is at least: a step of the grid is as long as the octagonal norm of its change of (α1, α2),
so no way over the grid is shorter than that norm of the whole change. Edges of nodes off the grid can be shorter, by a
share of at most 1 − cos(π/8) each. The waves try in turn nodes on ways up to the bound itself, then 1.05 and 1.3 times
as long, then all.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from gaitgraph.errors import InputError, shown
from gaitgraph.graph.compact_bits import STEPS, CompactGraph
from gaitgraph.graph.loads import MOST_LOAD, mean_load, red_load
from gaitgraph.graph.walks import QUANTA_PER_RADIAN

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

__all__ = ["FAR", "Engine", "Roads", "engine_of", "roads_of"]

FloatArray = npt.NDArray[np.float64]
IndexArray = npt.NDArray[np.int64]
Engine = Literal["auto", "waves", "kernel"]

FAR = 1 << 62
"""The distance of a node that was not reached."""

_EXCESS = (1.05, 1.3)
_BIT = (1 << np.arange(len(STEPS))).astype(np.uint8)
_STRAIGHT = np.array([di == 0 or dj == 0 for di, dj in STEPS])
_SAVED = 2 * math.sqrt(2) * (1 - math.cos(math.pi / 8))
"""What a way can save at a node off the grid against the octagonal norm, in steps: two edges, each at most √2 long."""
_ROUNDING = 1 - 1e-8  # of lengths to quanta: half a quantum in the shortest step of the finest grid is less
_TOLD = 5_000_000
_POPS = 1 << 21


@dataclass(frozen=True, slots=True, kw_only=True)
class Roads:
    """A compact graph with the costs of its edges, ready to be searched; made by :func:`roads_of`.

    Parameters
    ----------
    graph
        The graph.
    load
        If the cost is the integral of the load, the load of each node, shape (nodes,); else None, and it is the length.
    bits
        The graph's bits, or fewer, one byte for each node number.
    tail, head, length
        The edges that are no grid steps, both ways, sorted by tail, and their lengths [rad].
    engine
        "waves" or "kernel".
    """

    graph: CompactGraph
    load: FloatArray | None
    bits: npt.NDArray[np.uint8]
    tail: IndexArray
    head: IndexArray
    length: FloatArray
    engine: Engine

    @property
    def lengths(self) -> FloatArray:
        """Lengths of the eight grid steps [rad]."""
        return np.where(_STRAIGHT, self.graph.step, math.sqrt(2) * self.graph.step)

    def costs(self, first: Any, second: Any, length: Any) -> IndexArray:
        """Return what edges of given lengths between given nodes cost, in quanta, shape (...)."""
        mean = 1.0 if self.load is None else mean_load(self.load.take(first), self.load.take(second))
        return np.asarray((length * mean * QUANTA_PER_RADIAN + 0.5), dtype=np.float64).astype(np.int64)

    @property
    def least_load(self) -> float:
        """The least that a radian costs."""
        return 1.0 if self.load is None else float(self.load.min())

    def bound(self, nodes: IndexArray, goal: FloatArray) -> FloatArray:
        """Return a lower bound of the cost from nodes to a goal (α1, α2), in quanta, shape (...)."""
        change = np.abs(self.graph.plane(nodes) - goal)
        saved = _SAVED * self.graph.step * len(self.graph.extra)
        octagonal = change.max(axis=-1) + (math.sqrt(2) - 1) * change.min(axis=-1)
        scale = self.least_load * QUANTA_PER_RADIAN * _ROUNDING
        return np.asarray(np.maximum(octagonal - saved, 0.0) * scale)

    def distances(
        self, source: int, targets: Sequence[int], progress: Callable[[str], None] | None = None
    ) -> IndexArray:
        """Return the distance of each node from a source in quanta, shape (nodes,).

        Parameters
        ----------
        source
            Node number.
        targets
            Nodes at one and the same (α1, α2), or none. Only the distances of these, and of the nodes on their shortest
            ways, are certain to be least; without targets all are.
        progress
            Called with a line of text now and then.

        Returns
        -------
        array of int64
            `FAR` where nothing leads.
        """
        search = _kernel_distances if self.engine == "kernel" else _wave_distances
        return search(self, source, np.asarray(targets, dtype=np.int64), progress)


def engine_of(engine: object) -> Engine:
    """Return the engine that is asked for: "waves" or "kernel"; "auto" is the kernel if numba is there.

    Raises
    ------
    InputError
        If there is no such engine, or it needs a package that is not installed.

    Examples
    --------
    >>> engine_of("waves")
    'waves'
    """
    if engine not in ("auto", "waves", "kernel"):
        raise InputError(f"engine: {shown(engine)}; allowed are auto, waves, kernel")
    there = find_spec("numba") is not None
    if engine == "kernel" and not there:
        raise InputError("engine: 'kernel' needs the package numba; allowed is 'waves', or install gaitgraph[fast]")
    return "kernel" if there and engine != "waves" else "waves"


def roads_of(graph: CompactGraph, *, loaded: bool = False, engine: Engine = "auto") -> Roads:
    """Return a graph's edges with their costs: lengths, or if `loaded` the integrals of the load.

    >>> from gaitgraph.graph.compact_bits import compact_graph
    >>> roads = roads_of(compact_graph("negative", 16), engine="waves")
    >>> source, target = 14 * 17 + 2, 10 * 17 + 6
    >>> int(roads.distances(source, [target])[target]) / 1e12  # four diagonal steps
    1.11072073454
    """
    tail = np.concatenate([graph.link[:, 0], graph.link[:, 1]])
    head = np.concatenate([graph.link[:, 1], graph.link[:, 0]])
    order = np.lexsort((head, tail))
    tail, head = tail[order], head[order]
    length = np.linalg.norm(graph.plane(head) - graph.plane(tail), axis=-1)
    bits = np.concatenate([graph.bits, np.zeros(len(graph.extra), dtype=np.uint8)])
    return Roads(
        graph=graph,
        load=_loads(graph) if loaded else None,
        bits=bits,
        tail=tail,
        head=head,
        length=length,
        engine=engine_of(engine),
    )


def _loads(graph: CompactGraph) -> FloatArray:
    """Return the load of each node, shape (nodes,)."""
    parts = [
        red_load(graph.axis[:, None], graph.axis[None, :], graph.vehicle).ravel()
        if color == "red"
        else np.full((graph.divisions + 1) ** 2, MOST_LOAD)
        for color in graph.colors
    ]
    extra = np.where(graph.extra_red, red_load(graph.extra[:, 0], graph.extra[:, 1], graph.vehicle), MOST_LOAD)
    return np.concatenate([*parts, extra])


def _wave_distances(
    roads: Roads, source: int, targets: IndexArray, progress: Callable[[str], None] | None
) -> IndexArray:
    reached = np.full(roads.graph.nodes, FAR, dtype=np.int64)
    reached[source] = 0
    front = _Front(roads, reached, progress)
    levels = [math.inf]
    goal = roads.graph.plane(targets[:1])[0] if len(targets) else None
    if goal is not None and roads.load is None:
        least = float(roads.bound(np.asarray(source), goal)) / _ROUNDING + 3 * roads.graph.step * QUANTA_PER_RADIAN
        levels = [least, *(excess * least for excess in _EXCESS), math.inf]
    later = np.array([source])
    for level in levels:
        later = front.spread(later, targets, goal, level)
        if (reached[targets] <= level).all() and len(targets):
            break
    return reached


class _Front:
    """The nodes whose turn comes next, in buckets by their distance."""

    def __init__(self, roads: Roads, reached: IndexArray, progress: Callable[[str], None] | None) -> None:
        self.roads, self.reached, self.progress = roads, reached, progress
        self.offsets = roads.graph.offsets
        self.lengths = roads.lengths
        common = 1.0 if roads.load is None else float(np.median(roads.load[roads.bits > 0], overwrite_input=True))
        self.width = max(int(roads.graph.step * common * QUANTA_PER_RADIAN), 1)
        self.mark = np.zeros(len(reached), dtype=np.int32)
        self.linked = np.zeros(len(reached), dtype=bool)
        self.linked[roads.tail] = True
        self.done = 0

    def spread(self, start: IndexArray, targets: IndexArray, goal: FloatArray | None, level: float) -> IndexArray:
        """Go on from `start` over ways whose bound is at most `level`; return the nodes that lie beyond it."""
        from heapq import heappop, heappush

        reached, width = self.reached, self.width
        buckets: dict[int, list[IndexArray]] = {}
        keys: list[int] = []
        beyond: list[IndexArray] = []

        def put(nodes: IndexArray, costs: IndexArray) -> None:
            if goal is not None and math.isfinite(level):
                near = costs + self.roads.bound(nodes, goal) <= level
                if not near.all():
                    beyond.append(nodes[~near])
                    nodes, costs = nodes[near], costs[near]
            number = costs // width
            for key in _different(number):
                if key not in buckets:
                    buckets[key] = []
                    heappush(keys, key)
                buckets[key].append(nodes[number == key])

        put(start, reached.take(start))
        while keys:
            key = heappop(keys)
            if len(targets) and key * width > int(reached[targets].max()):
                break
            nodes = np.concatenate(buckets.pop(key))
            nodes = nodes[reached.take(nodes) // width == key]
            order = np.arange(len(nodes), dtype=np.int32)
            self.mark[nodes] = order
            nodes = nodes[self.mark.take(nodes) == order]
            self._tell(len(nodes))
            put(*self._improved(nodes))
        return np.unique(np.concatenate(beyond)) if beyond else np.zeros(0, dtype=np.int64)

    def _improved(self, nodes: IndexArray) -> tuple[IndexArray, IndexArray]:
        """Go one edge on from nodes; return the nodes that came nearer, and their distances."""
        roads, reached = self.roads, self.reached
        open_ = (roads.bits.take(nodes)[:, None] & _BIT) != 0
        which, step = np.nonzero(open_)
        tail = nodes[which]
        head = tail + self.offsets[step]
        if roads.load is None:
            cost = roads.costs(0, 0, self.lengths)[step]
        else:
            cost = roads.costs(tail, head, self.lengths[step])
        cost += reached.take(tail)
        at = nodes[self.linked.take(nodes)]
        if len(at):
            first, last = np.searchsorted(roads.tail, at), np.searchsorted(roads.tail, at, side="right")
            link = np.concatenate([np.arange(a, b) for a, b in zip(first, last, strict=True)])
            more = roads.costs(roads.tail[link], roads.head[link], roads.length[link])
            cost = np.concatenate([cost, more + reached.take(roads.tail[link])])
            head = np.concatenate([head, roads.head[link]])
        better = cost < reached.take(head)
        head, cost = head[better], cost[better]
        np.minimum.at(reached, head, cost)
        kept = cost == reached.take(head)
        return head[kept], cost[kept]

    def _tell(self, number: int) -> None:
        before, self.done = self.done, self.done + number
        if self.progress is not None and before // _TOLD != self.done // _TOLD:
            self.progress(f"{self.done:,} nodes searched")


def _different(values: IndexArray) -> list[int]:
    """Return the different values, quickly if they are close to each other."""
    if not len(values):
        return []
    low, high = int(values.min()), int(values.max())
    if high - low < 4:
        return list(range(low, high + 1))
    return [int(value) for value in np.unique(values)]


def _kernel_distances(
    roads: Roads, source: int, targets: IndexArray, progress: Callable[[str], None] | None
) -> IndexArray:
    """Run A* in pieces, between which an interrupt is noticed and progress told."""
    graph = roads.graph
    reached = np.full(graph.nodes, FAR, dtype=np.int64)
    reached[source] = 0
    goal = graph.plane(targets[:1])[0] if len(targets) else np.zeros(2)
    scale = roads.least_load * QUANTA_PER_RADIAN * _ROUNDING if len(targets) else 0.0
    bound = (float(goal[0]), float(goal[1]), _SAVED * graph.step * len(graph.extra), scale)
    load = roads.load if roads.load is not None else np.zeros(0)
    links = (roads.tail, roads.head, roads.length)
    places = (graph.axis, graph.extra[:, :2].copy())
    heap = np.zeros((3, 1 << 16), dtype=np.int64)
    heap[2, 0] = source
    run = _compiled() if roads.engine == "kernel" else expand
    size, done = 1, 0
    while size:
        if size + len(STEPS) + len(roads.tail) >= heap.shape[1]:
            heap = np.concatenate([heap, np.zeros_like(heap)], axis=1)
        size, pops = run(
            reached, heap, size, targets, roads.bits, graph.offsets, roads.lengths, load, links, places, bound, _POPS
        )
        done += pops
        if progress is not None and pops == _POPS:
            progress(f"{done:,} nodes searched")
    return reached


@cache
def _compiled() -> Any:
    from importlib import import_module

    numba = import_module("numba")
    try:
        return numba.njit(cache=True)(expand)
    except RuntimeError:  # no place to keep the compiled code
        return numba.njit(expand)


def expand(
    reached: Any,
    heap: Any,
    size: int,
    targets: Any,
    bits: Any,
    offsets: Any,
    lengths: Any,
    load: Any,
    links: Any,
    places: Any,
    bound: Any,
    most: int,
) -> tuple[int, int]:
    """Expand the nodes of a heap, least bound first, until nothing can improve, the heap is full, or `most` were.

    Plain Python, which numba compiles as it stands. The columns of `heap` are bound, distance and node; a node whose
    distance has fallen since is skipped. Returns the heap's new size, 0 when done, and the number of nodes taken out.
    """
    goal1, goal2, saved, scale = bound
    tail, head, length = links
    axis, extra = places
    side = len(axis)
    on_grid = len(bits) - len(extra)
    room = heap.shape[1] - len(offsets) - len(tail)
    pops = 0
    while size > 0 and pops < most and size < room:
        best = -1
        for target in targets:
            best = max(best, reached[target])
        if best >= 0 and heap[0, 0] > best:
            return 0, pops
        here, node = heap[1, 0], heap[2, 0]
        size -= 1
        pops += 1
        hole = 0
        while 2 * hole + 1 < size:
            child = 2 * hole + 1
            if child + 1 < size and heap[0, child + 1] < heap[0, child]:
                child += 1
            if heap[0, child] >= heap[0, size]:
                break
            for k in range(3):
                heap[k, hole] = heap[k, child]
            hole = child
        for k in range(3):
            heap[k, hole] = heap[k, size]
        if here > reached[node]:
            continue
        first = np.searchsorted(tail, node) if len(tail) > 0 else 0
        for turn in range(len(offsets) + len(tail) - first):
            if turn < len(offsets):
                if not (bits[node] >> turn) & 1:
                    continue
                after, far = node + offsets[turn], lengths[turn]
            else:
                link = first + turn - len(offsets)
                if tail[link] != node:
                    break
                after, far = head[link], length[link]
            if len(load) > 0:
                far *= (load[node] + load[after]) / 2
            cost = here + int(far * QUANTA_PER_RADIAN + 0.5)
            if cost >= reached[after]:
                continue
            reached[after] = cost
            estimate = cost
            if scale > 0.0:
                if after < on_grid:
                    place = after % (side * side)
                    one, two = abs(axis[place // side] - goal1), abs(axis[place % side] - goal2)
                else:
                    one, two = abs(extra[after - on_grid, 0] - goal1), abs(extra[after - on_grid, 1] - goal2)
                octagonal = max(one, two) + (math.sqrt(2.0) - 1.0) * min(one, two)
                estimate += int(max(octagonal - saved, 0.0) * scale)
            hole = size
            size += 1
            while hole > 0 and heap[0, (hole - 1) // 2] > estimate:
                for k in range(3):
                    heap[k, hole] = heap[k, (hole - 1) // 2]
                hole = (hole - 1) // 2
            heap[0, hole], heap[1, hole], heap[2, hole] = estimate, cost, after
    return size, pops
