"""The best worst case between stops of a compact graph: which edges are too narrow to be of use.

The *width* of an edge is its least singular value as the surface graph states it, within 1e-5 of the least along it.
The widest closed walk through all stops is found without it for almost all edges: the lower width of both ends is at
least the edge's, and exceeds it by no more than :func:`gaitgraph.graph.compact_bits.loss_within`, so that only edges about
the best worst case between ends are asked for theirs.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from gaitgraph.graph.build import edge_quantities
from gaitgraph.graph.compact_bits import STEPS, CompactGraph, loss_within
from gaitgraph.invertibility.matrices import least_singular_value_on_red

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from gaitgraph.graph.compact_sweeps import Roads

__all__ = ["robust_roads"]

FloatArray = npt.NDArray[np.float64]
IndexArray = npt.NDArray[np.int64]

_FORWARD = len(STEPS) // 2
_ROUND_OFF = 1e-11


def robust_roads(roads: Roads, stops: Sequence[Sequence[int]], progress: Callable[[str], None] | None) -> Roads:
    """Return the roads without the edges that are narrower than the best worst case needs.

    The width of an edge is its least singular value as the surface graph states it. Where both ends are wider than
    what an edge between them can lose, its width need not be known; only edges about the best worst case are asked.
    """
    graph = roads.graph
    if "red" not in graph.colors:
        return roads  # every width on blue is 0
    if progress is not None:
        progress("searching the best worst case")
    tail, head = _red_edges(graph)
    plane = np.meshgrid(graph.axis, graph.axis, indexing="ij", sparse=True)
    wide = np.concatenate(
        [least_singular_value_on_red(a1, a2, graph.vehicle).ravel() for a1, a2 in (plane, graph.extra[:, :2].T)]
    )
    # Red is the first sheet; the nodes off the grid follow the last one.
    shift = np.int32(len(graph.bits) - (graph.divisions + 1) ** 2)
    ends = (wide[np.where(nodes < len(graph.bits), nodes, nodes - shift)] for nodes in (tail, head))
    width = np.minimum(*ends) + _ROUND_OFF
    best = _widest(tail, head, width, stops, graph.nodes)
    if best is None:
        return roads
    loss = float(loss_within(graph.step, best, graph.vehicle)) + 3 * _ROUND_OFF
    narrow, near = width < best - loss, (width >= best - loss) & (width < best + loss)
    width[narrow], width[width >= best + loss] = -math.inf, math.inf
    width[near] = _widths(graph, np.column_stack([tail[near], head[near]]).astype(np.int64))
    best = _widest(tail[~narrow], head[~narrow], width[~narrow], stops, graph.nodes)
    if best is None or best <= 0:
        return roads
    dropped = width < best
    return _without(roads, np.column_stack([tail[dropped], head[dropped]]).astype(np.int64))


def _red_edges(graph: CompactGraph) -> tuple[npt.NDArray[np.int32], npt.NDArray[np.int32]]:
    """Return the ends of the edges on the red sheet, each of shape (k,)."""
    bits = graph.bits[: (graph.divisions + 1) ** 2]
    link = graph.link[graph.red(graph.link).all(axis=1)].astype(np.int32)
    tails, heads = [link[:, 0]], [link[:, 1]]
    for bit, offset in enumerate(graph.offsets[:_FORWARD].tolist()):
        tails.append(np.flatnonzero(bits & (1 << bit)).astype(np.int32))
        heads.append(tails[-1] + np.int32(offset))
    return np.concatenate(tails), np.concatenate(heads)


def _widths(graph: CompactGraph, edge: IndexArray) -> FloatArray:
    """Return the least singular value along red edges as the surface graph states it, shape (k,)."""
    out = np.zeros(len(edge))
    wanted = 1.0 if graph.sign == "positive" else -1.0
    for start in range(0, len(edge), 1 << 16):
        part = edge[start : start + (1 << 16)]
        alpha = graph.alpha(part.T).reshape(-1, 4)
        pairs = np.arange(len(alpha)).reshape(2, -1).T
        red = np.ones(len(alpha), dtype=bool)
        told = edge_quantities(alpha, red, pairs, wanted, graph.vehicle, graph.coefficients, graph.floor)
        out[start : start + len(part)] = told["least_singular_value"]
    return out


def _widest(
    tail: npt.NDArray[np.int32],
    head: npt.NDArray[np.int32],
    width: FloatArray,
    stops: Sequence[Sequence[int]],
    nodes: int,
) -> float | None:
    """Return the largest width such that edges at least so wide join a node of every stop; None if no edges do.

    No width beyond the widest edge at some stop can be the answer, so that all edges so wide are merged first. Then
    halving (Camerini, 1978): either the wider half of the edges joins them, and the others are not needed, or what that
    half joins is merged, and the others decide. Each time half of the edges are left.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    name = np.arange(nodes, dtype=np.int32)

    def merged(chosen: npt.NDArray[np.bool_]) -> npt.NDArray[np.int32]:
        ones = np.ones(int(chosen.sum()), dtype=np.int8)
        size = int(name.max()) + 1
        joins = coo_array((ones, (tail[chosen], head[chosen])), shape=(size, size))
        return np.asarray(connected_components(joins, directed=False)[1])

    def joined(label: npt.NDArray[np.int32]) -> bool:
        return bool(set.intersection(*({int(label[name[node]]) for node in served} for served in stops)))

    if not len(width) or not joined(merged(np.ones(len(width), dtype=bool))):
        return None
    middle = math.inf
    for served in stops:
        at_stop = np.zeros(nodes, dtype=bool)
        at_stop[list(served)] = True
        middle = min(middle, float(width[at_stop[tail] | at_stop[head]].max(initial=-math.inf)))
    while True:
        wider = width >= middle
        if wider.all():
            wider = width > middle
            if not wider.any():
                return float(middle)
        label = merged(wider)
        if joined(label):
            tail, head, width = tail[wider], head[wider], width[wider]
        else:
            tail, head, width = label[tail[~wider]], label[head[~wider]], width[~wider]
            name = label[name]
        middle = np.partition(width, len(width) // 2)[len(width) // 2]


def _without(roads: Roads, edge: IndexArray) -> Roads:
    """Return the roads without some edges, and without all that touch blue."""
    graph = roads.graph
    bits = roads.bits.copy()
    bits[(graph.divisions + 1) ** 2 :] = 0  # red is the first sheet
    on_grid = (edge < len(graph.bits)).all(axis=1)
    change = edge[on_grid, 1] - edge[on_grid, 0]
    for bit, offset in enumerate(graph.offsets[:_FORWARD].tolist()):
        tail = edge[on_grid][change == offset, 0]
        bits[tail] &= np.uint8(0xFF ^ (1 << bit))
        bits[tail + offset] &= np.uint8(0xFF ^ (1 << (bit + _FORWARD)))
    dropped = {*map(tuple, edge[~on_grid].tolist())}
    pairs = np.sort(np.column_stack([roads.tail, roads.head]), axis=1).reshape(-1, 2)
    red = graph.red(pairs).all(axis=1) if len(pairs) else np.zeros(0, dtype=bool)
    kept = np.array([tuple(pair) not in dropped for pair in pairs.tolist()], dtype=bool) & red
    return replace(roads, bits=bits, tail=roads.tail[kept], head=roads.head[kept], length=roads.length[kept])
