"""Closed walks over a compact graph, up to 4096 divisions: the shortest, the most robust, or that of least thrust.

They answer what :func:`gaitgraph.graph.walks.closed_walk` answers on the networkx graph, with the same length, to the
quantum, the same worst case, and the same choice of what blocks them. Of several shortest ways one is taken by its own
rule: from the target backwards always the longest straight run, so that both engines, and every machine, give the same
one. It has few turns, not always the fewest.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.errors import InputError, shown
from gaitgraph.graph.compact_bits import CompactGraph, compact_graph
from gaitgraph.graph.compact_bottlenecks import robust_roads
from gaitgraph.graph.compact_sweeps import FAR, Engine, Roads, roads_of
from gaitgraph.graph.walks import QUANTA_PER_RADIAN, Blocked, Objective, Order, Use, cheapest_choice, order_on
from gaitgraph.surface.sheets import COLORS, Color
from gaitgraph.validation.report import DEFAULT_FLOOR
from gaitgraph.vehicle import PAPER, Vehicle

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from gaitgraph.graph.build import Sign
    from gaitgraph.invertibility.matrices import Coefficients
    from gaitgraph.surface.region import Zones

__all__ = ["CompactWalk", "compact_loop", "compact_order", "compact_walk", "reachable_nodes"]

FloatArray = npt.NDArray[np.float64]
IndexArray = npt.NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True)
class CompactWalk:
    """A closed walk over a compact graph.

    Parameters
    ----------
    nodes
        Node numbers in order, the first not repeated, shape (k,).
    alpha
        Their tilt angles, shape (k, 4) [rad].
    colors
        Their sheets, length k.
    stops
        Where in the walk each stop is.
    length
        Length in the (α1, α2) plane [rad].
    thrust
        If that was the objective, the integral of the load along the walk [rad]; see :mod:`gaitgraph.graph.loads`.
    """

    nodes: IndexArray
    alpha: FloatArray
    colors: tuple[str, ...]
    stops: tuple[int, ...]
    length: float
    thrust: float | None = None


def compact_loop(
    waypoints: npt.ArrayLike,
    *,
    sign: Sign,
    divisions: int,
    use: Use = "flyable",
    objective: Objective = "shortest",
    colors: Sequence[Color] = COLORS,
    vehicle: Vehicle = PAPER,
    coefficients: Coefficients | None = None,
    zones: Zones | None = None,
    floor: float = DEFAULT_FLOOR,
    engine: Engine = "auto",
    progress: Callable[[str], None] | None = None,
) -> CompactWalk | Blocked:
    """Return the best closed walk through waypoints, in order and back to the first, or what blocks it.

    Parameters
    ----------
    waypoints
        (α1, α2) pairs in [−π/2, π/2], shape (k, 2), k ≥ 1 [rad].
    sign, divisions, use, colors, vehicle, coefficients, zones, floor
        As for :func:`gaitgraph.graph.compact_bits.compact_graph`.
    objective, engine, progress
        As for :func:`compact_walk`.

    Returns
    -------
    CompactWalk or Blocked
        Blocked names the leg; if its `rootless` is true, that waypoint has no node of these colors at all.

    Raises
    ------
    InputError
        If an argument is not allowed.

    Examples
    --------
    >>> corners = np.pi / 8 * np.array([(3, -3), (3, -1), (1, -1), (1, -3)])
    >>> walk = compact_loop(corners, sign="negative", divisions=512)
    >>> round(walk.length, 4), len(walk.nodes), walk.stops
    (3.1416, 512, (0, 128, 256, 384))
    """
    graph = compact_graph(
        sign,
        divisions,
        use=use,
        vehicle=vehicle,
        coefficients=coefficients,
        waypoints=waypoints,
        zones=zones,
        floor=floor,
        colors=colors,
        progress=progress,
    )
    return compact_walk(graph, objective=objective, engine=engine, progress=progress)


def compact_walk(
    graph: CompactGraph,
    stops: Sequence[Sequence[int]] | None = None,
    *,
    objective: Objective = "shortest",
    engine: Engine = "auto",
    progress: Callable[[str], None] | None = None,
) -> CompactWalk | Blocked:
    """Return the best closed walk through ordered stops and back to the first, or which leg blocks it.

    Parameters
    ----------
    graph
        The graph; its use says which edges count.
    stops
        For each waypoint, in order, the node numbers that may serve it; by default the graph's own stops.
    objective
        "shortest", "robust" or "thrust", as for :func:`gaitgraph.graph.walks.closed_walk`; robust not for two_color.
    engine
        "auto", "waves" or "kernel"; see :mod:`gaitgraph.graph.compact_sweeps`. All give the same walk.
    progress
        Called with a line of text before each step of the work.

    Raises
    ------
    InputError
        If an argument is not allowed, or the engine asked for is not installed.

    Examples
    --------
    >>> graph = compact_graph("positive", 64, waypoints=[(-1.2, 0.1), (-0.1, 1.2)])
    >>> compact_walk(graph, objective="thrust").length > compact_walk(graph).length
    True
    """
    if objective not in ("shortest", "robust", "thrust"):
        raise InputError(f"objective: {shown(objective)}; allowed are shortest, robust, thrust")
    if objective == "robust" and graph.use == "two_color":
        raise InputError("objective: 'robust' with the use 'two_color'; allowed are the uses flyable and valid")
    stops = graph.stops if stops is None else [tuple(map(int, nodes)) for nodes in stops]
    if not stops:
        raise InputError("stops: none given; allowed is at least one")
    for k, served in enumerate(stops):
        if not served:
            return Blocked(leg=k, rootless=True)
    roads = roads_of(graph, loaded=objective == "thrust", engine=engine)
    if objective == "robust" and not set.intersection(*map(set, stops)):  # else a point serves, which no edge narrows
        roads = robust_roads(roads, stops, progress)
    legs = _Legs(roads, stops, progress)
    found = cheapest_choice(stops, legs.cost)
    if isinstance(found, Blocked):
        return found
    chosen = found[1]
    nodes: list[int] = []
    starts = []
    for source, target in zip(chosen, [*chosen[1:], chosen[0]], strict=True):
        starts.append(len(nodes))
        nodes += legs.way(source, target)[:-1]
    walked = np.array(nodes or chosen[:1], dtype=np.int64)
    total = found[0] / QUANTA_PER_RADIAN
    return CompactWalk(
        nodes=walked,
        alpha=graph.alpha(walked),
        colors=tuple("red" if red else "blue" for red in graph.red(walked).tolist()),
        stops=tuple(starts),
        length=total if objective != "thrust" else _length(roads, walked),
        thrust=total if objective == "thrust" else None,
    )


def compact_order(
    graph: CompactGraph, stops: Sequence[int], *, engine: Engine = "auto", progress: Callable[[str], None] | None = None
) -> Order | None:
    """Return the order of stops with the shortest closed walk, or a good one, as :func:`gaitgraph.graph.walks.best_order`.

    Parameters
    ----------
    graph, engine, progress
        As for :func:`compact_walk`.
    stops
        The node number of each stop; the first one stays first.

    Examples
    --------
    >>> corners = np.pi / 8 * np.array([(3, -3), (1, -1), (3, -1), (1, -3)])
    >>> graph = compact_graph("negative", 64, waypoints=corners)
    >>> compact_order(graph, [nodes[0] for nodes in graph.stops]).order
    (0, 2, 1, 3)
    """
    return order_on(_Legs(roads_of(graph, engine=engine), [[int(stop)] for stop in stops], progress), list(stops))


def reachable_nodes(graph: CompactGraph, node: int) -> int:
    """Return how many nodes can be reached from a node over the graph's edges, itself among them.

    >>> graph = compact_graph("negative", 16, waypoints=[(0.4, -0.4)])
    >>> reachable_nodes(graph, graph.stops[0][0])
    50
    """
    return int((roads_of(graph).distances(node, []) < FAR).sum())


class _Legs:
    """The shortest ways between stops, each searched when it is first asked for."""

    def __init__(self, roads: Roads, stops: Sequence[Sequence[int]], progress: Callable[[str], None] | None) -> None:
        self.roads, self.progress = roads, progress
        self.known: dict[tuple[int, int], tuple[int, list[int]] | None] = {}
        self.beside: dict[tuple[float, ...], list[int]] = {}
        graph = roads.graph
        self.apart = not (graph.red(roads.tail) != graph.red(roads.head)).any()
        for node in sorted({node for nodes in stops for node in nodes}):
            self.beside.setdefault(self._place(node), []).append(node)

    def _place(self, node: int) -> tuple[Any, ...]:
        """Return (α1, α2) of a node, and its sheet if no edge leads from one to the other."""
        plane = self.roads.graph.plane(np.asarray(node)).tolist()
        return (*plane, self.apart and bool(self.roads.graph.red(np.asarray(node))))

    def leg(self, source: int, target: int) -> tuple[int, list[int]] | None:
        """Return (cost in quanta, nodes from source to target) of the best way, or None."""
        if source == target:
            return 0, [source]
        if self.apart and self._place(source)[-1] != self._place(target)[-1]:
            return None
        if (source, target) not in self.known:
            if self.progress is not None:
                number = len({start for start, _ in self.known} | {source})
                self.progress(f"searching the ways from stop {number}")
            targets = self.beside[self._place(target)]
            reached = self.roads.distances(source, targets, self.progress)
            for other in targets:
                cost = int(reached[other])
                self.known[source, other] = None if cost == FAR else (cost, _way(self.roads, reached, source, other))
        return self.known[source, target]

    def cost(self, source: int, target: int) -> float:
        """Return the cost of the best way in quanta, ∞ if there is none."""
        found = self.leg(source, target)
        return math.inf if found is None else found[0]

    def way(self, source: int, target: int) -> list[int]:
        """Return the nodes of the best way, both ends among them."""
        found = self.leg(source, target)
        return found[1] if found else []

    def lengths(self, source: int) -> dict[int, int]:
        """Return the cost in quanta of the best way to each stop that can be reached."""
        reached = self.roads.distances(source, [], self.progress)
        nodes = [node for group in self.beside.values() for node in group]
        return {node: int(reached[node]) for node in nodes if reached[node] < FAR}


def _way(roads: Roads, reached: IndexArray, source: int, target: int) -> list[int]:
    """Follow shortest ways back from the target, each time along the longest straight run."""
    way = [target]
    while way[-1] != source:
        here = way[-1]
        longest: IndexArray = np.zeros(0, dtype=np.int64)
        gained = -1
        for run in _runs(roads, reached, here):
            gain = int(reached[here] - reached[run[-1]])
            if gain > gained:
                longest, gained = run, gain
        way += longest.tolist()
    return way[::-1]


def _runs(roads: Roads, reached: IndexArray, here: int) -> list[IndexArray]:
    """Return the straight runs from a node back along shortest ways, and its single edges that are no grid steps."""
    graph = roads.graph
    runs = []
    for bit, (offset, length) in enumerate(zip(graph.offsets.tolist(), roads.lengths.tolist(), strict=True)):
        reach = 1
        run = np.zeros(0, dtype=np.int64)
        while len(run) == reach - 1:
            reach *= 8
            ray = here + offset * np.arange(reach + 1)
            ray = ray[(ray >= 0) & (ray < len(roads.bits))]
            tail, head = ray[:-1], ray[1:]
            open_ = (roads.bits[tail] >> bit) & 1 == 1
            tight = open_ & (reached[tail] - reached[head] == roads.costs(tail, head, length))
            run = head[: int(np.argmin(np.append(tight, False)))]
            if len(run) < reach:
                break
            reach += 1
        if len(run):
            runs.append(run)
    first, last = np.searchsorted(roads.tail, here), np.searchsorted(roads.tail, here, side="right")
    for link in range(int(first), int(last)):
        tail, head = roads.tail[link : link + 1], roads.head[link : link + 1]
        if (reached[tail] - reached[head] == roads.costs(tail, head, roads.length[link : link + 1])).all():
            runs.append(head)
    return runs


def _length(roads: Roads, nodes: IndexArray) -> float:
    """Return the length of a closed walk in the plane [rad]."""
    if len(nodes) == 1:
        return 0.0
    plane = roads.graph.plane(nodes)
    steps = np.linalg.norm(np.roll(plane, -1, axis=0) - plane, axis=1)
    return int((steps * QUANTA_PER_RADIAN + 0.5).astype(np.int64).sum()) / QUANTA_PER_RADIAN
