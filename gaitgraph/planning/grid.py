"""Loops on the paper's grid: closed walks on the surface graph, for each color and sign of R, and closed cycles."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import chain
from typing import TYPE_CHECKING, Any

import networkx as nx
import numpy as np

from gaitgraph.angles import text_from_angle
from gaitgraph.errors import InputError
from gaitgraph.graph.build import WAYPOINT_SNAP, gait_along, nodes_above, surface_graph
from gaitgraph.graph.cycle_list import Cycles, cycles
from gaitgraph.graph.walks import MOST_ANY_ORDER, Blocked, Use, allowed_edges, best_order, closed_walk, note_on_gap
from gaitgraph.invertibility.matrices import coefficients_of
from gaitgraph.surface.sheets import RELATION, SIGNS, Sign

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from gaitgraph.graph.walks import Cycle
    from gaitgraph.planning.refusal import Branch, FoundPath, Obstacle
    from gaitgraph.planning.request import PlanRequest, Point


def notes_beside_the_grid(request: PlanRequest) -> list[str]:
    """Return a hint for each waypoint that is nearly a grid node: printed digits, most likely."""
    step, half = math.pi / request.divisions, request.divisions / 2
    hints = []
    for number, point in enumerate(request.waypoints, start=1):
        node = [(round(angle / step + half) - half) * step for angle in point]
        distance = max(abs(a - b) for a, b in zip(point, node, strict=True))
        if WAYPOINT_SNAP < distance < step / 50:
            place = ", ".join(map(text_from_angle, node))
            beside = f"{distance:.1e} rad beside the grid node ({place})"
            hints.append(f"waypoint {number} is {beside}, which costs extra corners")
    return hints


def grid_paths(
    branches: Sequence[Branch], graph: nx.Graph[Any] | None, progress: Callable[[str], None] | None
) -> tuple[list[list[FoundPath] | Obstacle], FoundPath | None]:
    """Return the loops of each color with one sign of R, or what is in their way, and a shorter loop that jumps."""
    request, sign = branches[0].request, branches[0].sign
    answers: list[list[FoundPath] | Obstacle] = []
    if graph is None:
        lacking = [branch.rootless() for branch in branches]
        if set.intersection(*map(set, lacking)):
            # Some waypoint has no root at all with this sign: no need to build the graph.
            answers += [branch.obstacle_at(k[0]) for branch, k in zip(branches, lacking, strict=True)]
            return answers, None
        if progress is not None:
            progress(f"building the graph with {RELATION[sign]}")
        graph = _graph(request, sign, request.waypoints)
        served = nodes_above(graph, request.waypoints)
    else:
        served = nodes_above(graph, request.waypoints)
        if not all(served):
            missing = request.waypoints[[bool(nodes) for nodes in served].index(False)]
            raise InputError(f"waypoints: {missing!r} is no node of the graph; pass waypoints= to surface_graph")
    for branch in branches:
        if progress is not None:
            progress(f"searching {branch.color} loops")
        answers.append(_paths_of_color(graph, served, branch))
    if request.color == "auto" and all(served):
        # The shortest two-color loop may jump, between colors or by a wrap. Then it cannot be valid.
        walk = closed_walk(graph, served, use="two_color")
        if not isinstance(walk, Blocked) and len(walk.nodes) > 1:
            steps = zip(walk.nodes, (*walk.nodes[1:], walk.nodes[0]), strict=True)
            if not all(graph.edges[a, b]["continuous"] for a, b in steps):
                return answers, (gait_along(graph, walk.nodes), tuple(range(len(served))), None, 0.0)
    return answers, None


def _paths_of_color(graph: nx.Graph[Any], served: list[list[Any]], branch: Branch) -> list[FoundPath] | Obstacle:
    """Return the best flyable and the best valid loop of one color, or what is in the way."""
    request = branch.request
    stops = [[node for node in nodes if graph.nodes[node]["color"] == branch.color] for nodes in served]
    if not all(stops):
        return branch.obstacle_at(stops.index([]))
    uses: tuple[Use, ...] = ("flyable", "valid") if branch.color == "red" else ("valid",)
    found: list[FoundPath] = []
    valid = allowed_edges("valid")
    for use in uses:
        order, gap = tuple(range(len(stops))), 0.0
        if request.any_order:
            order, gap = best_order(graph, [nodes[0] for nodes in stops], use=use) or (order, gap)
        ordered = [stops[k] for k in order]
        walk = closed_walk(graph, ordered, use=use, objective="robust" if request.objective == "robust" else "shortest")
        if not isinstance(walk, Blocked):
            path = gait_along(graph, walk.nodes)
            if not any(np.array_equal(path.alpha, other.alpha) for other, *_ in found):
                found.append((path, order, None, gap))
        elif use == "valid":
            ends = order[walk.leg], order[(walk.leg + 1) % len(order)]
            # How many nodes usable edges join to each of the two.
            view = nx.subgraph_view(graph, filter_edge=lambda a, b: bool(valid(graph.edges[a, b])))
            counts = tuple(len(nx.node_connected_component(view, stops[k][0])) for k in ends)
            wall = "the keep_out and keep_in polygons, or the grid," if request.zones else "the grid"
            wall += f" of {request.divisions} divisions: more divisions may join them"
            return branch.separation(ends, wall, counts)
    return found


@dataclass(frozen=True, slots=True, kw_only=True)
class GridCycles:
    """The closed cycles of a request, for each sign of R that was asked for.

    `cycles` are those of all graphs, found while they are asked for: by length, then R < 0 before R > 0. `graphs` has,
    by sign of R, the graph and in it the nodes above the waypoints; `missing` why there is no graph to search.
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

    Of the request its period, law, objective and direction play no part; a sign or color "auto" is both. With `through`
    the cycles pass its waypoints, in order or, with its `any_order`, in any order; more than nine in the order of
    :func:`~gaitgraph.graph.walks.best_order`, which `notes` says. The other options are those of
    :func:`gaitgraph.graph.cycle_list.cycles`; the effort is for each sign of R. InputError if a value is not allowed.

    Examples
    --------
    >>> from gaitgraph.planning.request import plan_request
    >>> found = grid_cycles(plan_request([("pi/8", "-pi/8"), ("pi/4", "-pi/4")], color="red"))
    >>> cycle = next(found.cycles)
    >>> cycle.sign, len(cycle.nodes), round(cycle.length, 4), cycle.flyable
    ('negative', 5, 1.2257, True)
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
        if progress is not None:
            progress(f"building the graph of {request.divisions} divisions with {RELATION[sign]}")
        graph = _graph(request, sign, waypoints=request.waypoints if through else ())
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


def _graph(request: PlanRequest, sign: Sign, waypoints: Sequence[Point]) -> nx.Graph[Any]:
    return surface_graph(
        sign,
        divisions=request.divisions,
        vehicle=request.vehicle,
        coefficients=coefficients_of(request.vehicle, request.coefficients),
        waypoints=waypoints,
        zones=request.zones,
        floor=request.floor,
    )
