"""Loops on the paper's grid: closed walks on the surface graph, for each color and sign of R, and closed cycles."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import chain
from typing import TYPE_CHECKING, Any

import networkx as nx
import numpy as np

from gaitgraph.angles import text_from_angle
from gaitgraph.graph.build import WAYPOINT_SNAP, gait_along, nodes_above, surface_graph
from gaitgraph.graph.cycle_list import Cycles, cycles
from gaitgraph.graph.walks import MOST_ANY_ORDER, Blocked, allowed_edges, best_order, closed_walk, note_on_gap
from gaitgraph.invertibility.matrices import coefficients_of
from gaitgraph.planning.any_angle import first_outside, prepared_region
from gaitgraph.surface.sheets import RELATION, SIGNS, Sign

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from gaitgraph.graph.walks import Cycle, Use
    from gaitgraph.planning.refusal import Branch, FoundPath, Obstacle
    from gaitgraph.planning.request import PlanRequest


def notes_beside_the_grid(request: PlanRequest) -> list[str]:
    """Return a hint for each waypoint that is nearly a grid node, mostly one rounded when printed."""
    step, half = math.pi / request.divisions, request.divisions / 2
    hints = []
    for number, point in enumerate(request.waypoints, start=1):
        node = [(round(angle / step + half) - half) * step for angle in point]
        distance = max(abs(a - b) for a, b in zip(point, node, strict=True))
        if WAYPOINT_SNAP < distance < step / 50:
            place = ", ".join(map(text_from_angle, node))
            beside = f"{distance:.1e} rad off the grid node ({place})"
            hints.append(f"waypoint {number} is {beside}; on the node the gait has fewer corners")
    return hints


def grid_paths(
    branches: Sequence[Branch], graph_of: Callable[[Sign], nx.Graph[Any]], progress: Callable[[str], None] | None
) -> list[list[FoundPath] | Obstacle]:
    """Return the loops of each color with one sign of R, or the obstacle."""
    request, sign = branches[0].request, branches[0].sign
    rootless = [branch.rootless() for branch in branches]
    if set.intersection(*map(set, rootless)):
        # Some waypoint has no root at all with this sign: no need to build the graph.
        return [branch.obstacle_at(k[0]) for branch, k in zip(branches, rootless, strict=True)]
    graph = graph_of(sign)
    served = nodes_above(graph, request.waypoints)
    return [_paths_of_color(graph, served, branch, progress) for branch in branches]


def _paths_of_color(
    graph: nx.Graph[Any], served: list[list[Any]], branch: Branch, progress: Callable[[str], None] | None
) -> list[FoundPath] | Obstacle:
    """Return the best loop of one color for each use of it, or the obstacle."""
    request = branch.request
    if progress is not None:
        progress(f"searching {branch.color} loops")
    stops = [[node for node in nodes if graph.nodes[node]["color"] == branch.color] for nodes in served]
    if not all(stops):
        return branch.obstacle_at(stops.index([]))
    found: list[FoundPath] = []
    for use in branch.uses:
        order, gap = tuple(range(len(stops))), 0.0
        if request.any_order:
            order, gap = best_order(graph, [nodes[0] for nodes in stops], use=use) or (order, gap)
        ordered = [stops[k] for k in order]
        walk = closed_walk(graph, ordered, use=use, objective=request.objective)
        if not isinstance(walk, Blocked):
            path = gait_along(graph, walk.nodes)
            if not any(np.array_equal(path.alpha, other.alpha) for other, *_ in found):
                found.append((path, order, None, gap))
        elif use == branch.uses[-1]:
            if use == "flyable" and (outside := first_outside(branch, prepared_region(branch, use))):
                return outside
            ends = order[walk.leg], order[(walk.leg + 1) % len(order)]
            # How many nodes usable edges join to each of the two.
            allowed = allowed_edges(use)
            edges = [(a, b) for a, b, data in graph.edges(data=True) if allowed(data)]
            view = nx.Graph([*edges, *((nodes[0], nodes[0]) for nodes in stops)])
            counts = tuple(len(nx.node_connected_component(view, stops[k][0])) for k in ends)
            wall = f"{'keep_out, keep_in or ' if request.zones else ''}the grid of {request.divisions} divisions"
            wall += ": try more divisions"
            return branch.separation(ends, wall, counts)
    return found


@dataclass(frozen=True, slots=True, kw_only=True)
class GridCycles:
    """The closed cycles of a request, for each sign of R of the request.

    `cycles` lists those of all graphs lazily, by length, then R < 0 before R > 0. `graphs` has, by sign of R, the graph
    and its nodes above the waypoints; `missing` has why there is no graph to search.
    """

    cycles: Cycles
    graphs: dict[Sign, tuple[nx.Graph[Any], list[list[Any]]]]
    missing: dict[Sign, str]
    notes: tuple[str, ...]
    use: Use
    any_order: bool
    max_length: float | None

    def best(self, *, effort: int) -> tuple[Cycle | None, float, str]:
        """Return the best cycle through the waypoints that an effort finds, a bound of all lengths, and a reason.

        The cycle is None if none is found; otherwise the reason is empty, and the cycle is a shortest one if it is
        not longer than the bound [rad]. The effort is the largest number of search steps for each sign of R.
        """
        searches = {
            sign: cycles(graph, through=stops, use=self.use, any_order=self.any_order, shortest=True, effort=effort)
            for sign, (graph, stops) in self.graphs.items()
            if stops
        }
        best = min(chain.from_iterable(searches.values()), key=lambda cycle: cycle.length, default=None)
        bound = min((search.bound for search in searches.values()), default=self.cycles.bound)
        within = "" if self.max_length is None else f" within {self.max_length:g} rad"
        if best is not None and self.max_length is not None and best.length > self.max_length + 1e-9:
            return None, bound, f"none was found{within}; the best one has {best.length:.4f} rad"
        reasons = self.missing | {sign: search.reason or "" for sign, search in searches.items()}
        reason = "; ".join(f"{RELATION[sign]}: {why}" for sign, why in sorted(reasons.items()))
        if not reasons:
            reason = f"the graph has none{within}" if self.cycles.complete else str(self.cycles.reason)
        return best, bound, "" if best is not None else reason


def grid_cycles(
    request: PlanRequest,
    *,
    through: bool = True,
    max_length: float | None = None,
    use: Use = "valid",
    effort: int | None = None,
    progress: Callable[[str], None] | None = None,
) -> GridCycles:
    """Return the simple closed cycles on the grid of a request, in order of length, as a lazy iterator.

    Period, law, objective and direction of the request are not used; a sign or color "auto" is both. With `through` the
    cycles pass its waypoints, in order or, with its `any_order`, in any order; more than nine in the order of
    :func:`~gaitgraph.graph.walks.best_order`, as `notes` state. The other options are those of
    :func:`gaitgraph.graph.cycle_list.cycles`; the effort is for each sign of R. InputError if a value is not allowed.
    """
    heuristic = request.any_order and through and len(request.waypoints) > MOST_ANY_ORDER
    any_order = request.any_order and through and not heuristic
    options: dict[str, Any] = {"max_length": max_length, "effort": effort, "progress": progress}
    sources, notes = [], []
    graphs: dict[Sign, tuple[nx.Graph[Any], list[list[Any]]]] = {}
    missing: dict[Sign, str] = {}
    for sign in SIGNS:
        if request.sign not in ("auto", sign):
            continue
        graph = request_graph(request, sign, progress, through=through)
        if request.color != "auto":
            graph.remove_nodes_from([name for name, data in graph.nodes(data=True) if data["color"] != request.color])
        stops = nodes_above(graph, request.waypoints) if through else []
        if not all(stops):
            color = "" if request.color == "auto" else f"{request.color} "
            number = stops.index([]) + 1
            missing[sign] = f"waypoint {number} has no {color}root with this sign of R in the region"
            continue
        best = best_order(graph, [nodes[0] for nodes in stops], use=use) if heuristic else None
        if best is not None:
            order, gap = best
            stops = [stops[k] for k in order]
            notes.append(f"{RELATION[sign]}: only cycles in one order of the waypoints are listed: {note_on_gap(gap)}")
        graphs[sign] = graph, stops
        sources += cycles(graph, through=stops, any_order=any_order, use=use, **options).sources
    return GridCycles(
        cycles=Cycles(sources),
        graphs=graphs,
        missing=missing,
        notes=tuple(notes),
        use=use,
        any_order=any_order,
        max_length=max_length,
    )


def request_graph(
    request: PlanRequest, sign: Sign, progress: Callable[[str], None] | None, *, through: bool = True
) -> nx.Graph[Any]:
    """Return the surface graph of a request for one sign of R, its waypoints among the nodes if `through`."""
    if progress is not None:
        progress(f"building the graph of {request.divisions} divisions with {RELATION[sign]}")
    return surface_graph(
        sign,
        divisions=request.divisions,
        vehicle=request.vehicle,
        coefficients=coefficients_of(request.vehicle, request.coefficients),
        waypoints=request.waypoints if through else (),
        zones=request.zones,
        floor=request.floor,
    )
