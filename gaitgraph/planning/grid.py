"""Loops on the paper's grid: closed walks on the surface graph, for each color and sign of R."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import networkx as nx
import numpy as np

from gaitgraph.angles import text_from_angle
from gaitgraph.errors import InputError
from gaitgraph.gait.gait import Gait
from gaitgraph.graph.build import WAYPOINT_SNAP, nodes_above, surface_graph
from gaitgraph.graph.walks import Blocked, Use, allowed_edges, best_order, closed_walk
from gaitgraph.planning.plan import Candidates, Loop, loop_of
from gaitgraph.planning.refusal import Case, Obstacle, obstacle_at_waypoint, rootless_waypoints, separation
from gaitgraph.surface.sheets import COLORS, RELATION, Sign

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from gaitgraph.invertibility.matrices import Coefficients
    from gaitgraph.planning.request import PlanRequest


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


def add_grid_loops(
    found: Candidates,
    request: PlanRequest,
    coefficients: Coefficients,
    sign: Sign,
    *,
    graph: nx.Graph[Any] | None = None,
    progress: Callable[[str], None] | None = None,
) -> None:
    """Add the loops with one sign of R on the grid, or what is in their way, to what was found.

    Parameters
    ----------
    found
        Gains loops, two-color loops that jump, obstacles and notes.
    request, coefficients, sign
        What is asked for.
    graph
        A surface graph to search, instead of one built for the request.
    progress
        Called with a line of text before each step.
    """
    cases = [
        Case(request=request, coefficients=coefficients, color=color, sign=sign)
        for color in COLORS
        if request.color in ("auto", color)
    ]
    if graph is None:
        lacking = [rootless_waypoints(case) for case in cases]
        if set.intersection(*map(set, lacking)):
            # Some waypoint has no root at all with this sign: no need to build the graph.
            found.obstacles += [obstacle_at_waypoint(case, k[0]) for case, k in zip(cases, lacking, strict=True)]
            return
        if progress is not None:
            progress(f"building the graph with {RELATION[sign]}")
        graph = surface_graph(
            sign,
            request.divisions,
            vehicle=request.vehicle,
            coefficients=coefficients,
            waypoints=request.waypoints,
            zones=request.zones,
            floor=request.floor,
        )
        served = nodes_above(graph, request.waypoints)
    else:
        served = nodes_above(graph, request.waypoints)
        if not all(served):
            missing = request.waypoints[[bool(nodes) for nodes in served].index(False)]
            raise InputError(f"waypoints: {missing!r} is no node of the graph; pass waypoints= to surface_graph")
    for case in cases:
        if progress is not None:
            progress(f"searching {case.color} loops")
        answer = _loops_of_color(graph, served, case, found)
        if isinstance(answer, Obstacle):
            found.obstacles.append(answer)
        else:
            found.loops += answer
    if request.color == "auto" and all(served):
        # The shortest two-color loop may jump, between colors or by a wrap. Then it cannot be valid.
        walk = closed_walk(graph, served, use="two_color")
        if not isinstance(walk, Blocked) and len(walk.nodes) > 1:
            steps = zip(walk.nodes, (*walk.nodes[1:], walk.nodes[0]), strict=True)
            if not all(graph.edges[a, b]["continuous"] for a, b in steps):
                found.broken.append(_loop_along(graph, walk.nodes, tuple(range(len(served))), cases[0]))


def _loops_of_color(
    graph: nx.Graph[Any], served: list[list[Any]], case: Case, found: Candidates
) -> list[Loop] | Obstacle:
    """Return the best flyable and the best valid loop of one color, or what is in the way; notes are added."""
    request = case.request
    stops = [[node for node in nodes if graph.nodes[node]["color"] == case.color] for nodes in served]
    if not all(stops):
        return obstacle_at_waypoint(case, stops.index([]))
    uses: tuple[Use, ...] = ("flyable", "valid") if case.color == "red" else ("valid",)
    loops: list[Loop] = []
    for use in uses:
        order = tuple(range(len(stops)))
        if request.any_order:
            best = best_order(graph, [nodes[0] for nodes in stops], use=use)
            if best is not None:
                order = best.order
                if not best.exact:
                    found.note_heuristic_order(len(order))
        ordered = [stops[k] for k in order]
        walk = closed_walk(graph, ordered, use=use, objective="robust" if request.objective == "robust" else "shortest")
        if not isinstance(walk, Blocked):
            loop = _loop_along(graph, walk.nodes, order, case)
            if not any(np.array_equal(loop.path.alpha, other.path.alpha) for other in loops):
                loops.append(loop)
        elif use == "valid":
            ends = order[walk.leg], order[(walk.leg + 1) % len(order)]
            counts = _reachable(graph, [stops[k][0] for k in ends])
            wall = "the keep_out and keep_in polygons, or the grid," if request.zones else "the grid"
            wall += f" of {request.divisions} divisions: more divisions may join them"
            return separation(case, ends, wall, counts)
    return loops


def _reachable(graph: nx.Graph[Any], nodes: Sequence[Any]) -> tuple[int, ...]:
    """Return how many nodes valid edges join to each of some nodes, that one included."""
    valid = allowed_edges("valid")
    view = nx.subgraph_view(graph, filter_edge=lambda a, b: bool(valid(graph.edges[a, b])))
    return tuple(len(nx.node_connected_component(view, node)) for node in nodes)


def _loop_along(graph: nx.Graph[Any], nodes: Sequence[Any], order: tuple[int, ...], case: Case) -> Loop:
    data = [graph.nodes[node] for node in nodes]
    path = Gait(
        alpha=np.array([[node[f"alpha{k}"] for k in range(1, 5)] for node in data]),
        colors=tuple(node["color"] for node in data),
        vehicle=case.request.vehicle,
        coefficients=case.coefficients,
        crossing_tolerance=graph.graph["crossing_tolerance"],
    )
    return loop_of(path, order, case.request, case.sign, method="grid")
