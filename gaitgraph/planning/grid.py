"""Loops on the paper's grid: closed walks on the surface graph, for each color and sign of R."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitgraph.angles import text_from_angle
from gaitgraph.errors import InputError
from gaitgraph.gait.gait import Gait
from gaitgraph.graph.build import WAYPOINT_SNAP, nodes_above, surface_graph
from gaitgraph.graph.walks import Blocked, Use, best_order, closed_walk
from gaitgraph.invertibility.matrices import Coefficients, coefficients_of
from gaitgraph.planning.plan import Candidates, Loop, heuristic_order, loop_of
from gaitgraph.planning.refusal import RELATION, Obstacle, rootless, waypoint_obstacle
from gaitgraph.surface.sheets import COLORS, separating_factor

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import networkx as nx

    from gaitgraph.planning.request import PlanRequest

__all__ = ["grid_candidates", "notes_beside_the_grid"]


def notes_beside_the_grid(request: PlanRequest) -> list[str]:
    """Return a hint for each waypoint that is nearly a grid node: printed digits, most likely."""
    step, half = math.pi / request.divisions, request.divisions / 2
    hints = []
    for number, point in enumerate(request.waypoints, start=1):
        node = [(round(angle / step + half) - half) * step for angle in point]
        distance = max(abs(a - b) for a, b in zip(point, node, strict=True))
        if WAYPOINT_SNAP < distance < step / 50:
            place = ", ".join(map(text_from_angle, node))
            hints.append(
                f"waypoint {number} is {distance:.1e} rad beside the grid node ({place}), which costs extra corners"
            )
    return hints


def grid_candidates(
    request: PlanRequest,
    coefficients: Coefficients,
    sign: str,
    *,
    graph: nx.Graph[Any] | None = None,
    progress: Callable[[str], None] | None = None,
) -> Candidates:
    """Return the loops with one sign of R on the grid, or what is in their way.

    Parameters
    ----------
    request, coefficients, sign
        What is asked for.
    graph
        A surface graph to search, instead of one built for the request.
    progress
        Called with a line of text before each step.
    """
    found = Candidates()
    colors = COLORS if request.color == "auto" else (request.color,)
    lacking = {color: rootless(request, coefficients, color, sign) for color in colors}
    if graph is None and set.intersection(*lacking.values()):
        # Some waypoint has no root at all with this sign: no need to build the graph.
        found.obstacles += [waypoint_obstacle(min(lacking[c]), request, coefficients, c, sign) for c in colors]
        return found
    if progress is not None and graph is None:
        progress(f"building the graph with {RELATION[sign]}")
    on = graph if graph is not None else _graph(request, coefficients, sign)
    served = nodes_above(on, request.waypoints)
    if graph is not None and not all(served):
        missing = request.waypoints[[bool(nodes) for nodes in served].index(False)]
        raise InputError(f"waypoints: {missing!r} is no node of the graph; pass waypoints= to surface_graph")
    for color in colors:
        if progress is not None:
            progress(f"searching {color} loops")
        loops = _loops_of(on, served, request, coefficients, color, sign, found.notes)
        if isinstance(loops, Obstacle):
            found.obstacles.append(loops)
        else:
            found.loops += loops
    if request.color == "auto" and all(served):
        found.broken += _broken(on, served, request, sign)
    return found


def _graph(request: PlanRequest, coefficients: Coefficients, sign: Any) -> nx.Graph[Any]:
    return surface_graph(
        sign,
        request.divisions,
        vehicle=request.vehicle,
        coefficients=coefficients,
        waypoints=request.waypoints,
        zones=request.zones,
        floor=request.floor,
    )


def _loops_of(
    graph: nx.Graph[Any],
    served: list[list[Any]],
    request: PlanRequest,
    coefficients: Coefficients,
    color: str,
    sign: str,
    notes: dict[str, None],
) -> list[Loop] | Obstacle:
    """Return the best flyable and the best valid loop of one color, or what is in the way; notes gain warnings."""
    stops = [[node for node in nodes if graph.nodes[node]["color"] == color] for nodes in served]
    lacking = [k for k, nodes in enumerate(stops) if not nodes]
    if lacking:
        return waypoint_obstacle(lacking[0], request, coefficients, color, sign)
    uses: tuple[Use, ...] = ("flyable", "valid") if color == "red" else ("valid",)
    loops: list[Loop] = []
    for use in uses:
        order = tuple(range(len(stops)))
        if request.any_order:
            best = best_order(graph, [nodes[0] for nodes in stops], use=use)
            if best is not None:
                order = best.order
                if not best.exact:
                    notes[heuristic_order(len(order))] = None
        ordered = [stops[k] for k in order]
        walk = closed_walk(graph, ordered, use=use, objective=request.objective)  # type: ignore[arg-type]
        if isinstance(walk, Blocked):
            if use == "flyable":
                continue
            return _separation(graph, ordered, walk.leg, request, color, sign)
        loop = _loop(graph, walk.nodes, order, request, sign)
        if not any(np.array_equal(loop.path.alpha, other.path.alpha) for other in loops):
            loops.append(loop)
    return loops


def _broken(graph: nx.Graph[Any], served: list[list[Any]], request: PlanRequest, sign: str) -> list[Loop]:
    """Return the shortest two-color loop if it jumps, between colors or by a wrap: valid it cannot be."""
    walk = closed_walk(graph, served, use="two_color")
    if isinstance(walk, Blocked) or len(walk.nodes) == 1:
        return []
    steps = zip(walk.nodes, (*walk.nodes[1:], walk.nodes[0]), strict=True)
    if all(graph.edges[a, b]["continuous"] for a, b in steps):
        return []
    return [_loop(graph, walk.nodes, tuple(range(len(served))), request, sign)]


def _loop(graph: nx.Graph[Any], nodes: Sequence[Any], order: tuple[int, ...], request: PlanRequest, sign: str) -> Loop:
    data = [graph.nodes[node] for node in nodes]
    path = Gait(
        alpha=np.array([[node[f"alpha{k}"] for k in range(1, 5)] for node in data]),
        colors=tuple(node["color"] for node in data),
        vehicle=request.vehicle,
        coefficients=coefficients_of(request.vehicle, request.coefficients),
        crossing_tolerance=graph.graph["crossing_tolerance"],
    )
    return loop_of(path, order, request, sign)


def _separation(
    graph: nx.Graph[Any], stops: list[list[Any]], leg: int, request: PlanRequest, color: str, sign: str
) -> Obstacle:
    from networkx import node_connected_component, subgraph_view

    def usable(first: Any, second: Any) -> bool:
        edge = graph.edges[first, second]
        return bool(edge["continuous"] and edge["keeps_sign"])

    view = subgraph_view(graph, filter_edge=usable)
    ends = stops[leg], stops[(leg + 1) % len(stops)]
    points = [(graph.nodes[nodes[0]]["alpha1"], graph.nodes[nodes[0]]["alpha2"]) for nodes in ends]
    counts = tuple(len(node_connected_component(view, nodes[0])) for nodes in ends)
    return _separated(points, counts, request, color, sign)


def _separated(
    points: Sequence[Sequence[float]], counts: tuple[int, ...], request: PlanRequest, color: str, sign: str
) -> Obstacle:
    numbers = tuple(request.waypoints.index(min(request.waypoints, key=lambda w: math.dist(w, p))) + 1 for p in points)
    wall = separating_factor(points[0], points[1], request.vehicle) if color == "red" else None
    if wall is None:
        region = "the keep_out and keep_in polygons, or the grid," if request.zones else "the grid"
        wall = f"{region} of {request.divisions} divisions: more divisions may join them"
    return Obstacle(
        color=color,
        sign=sign,
        kind="separated",
        message=f"{color}, {RELATION[sign]}: waypoints {numbers[0]} and {numbers[1]} are separated by {wall}",
        waypoints=numbers,
        components=counts,
    )
