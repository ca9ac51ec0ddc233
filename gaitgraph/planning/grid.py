"""Loops on the paper's grid: closed walks on the surface graph, for each color and sign of R, and closed cycles."""

from __future__ import annotations

from dataclasses import replace
from heapq import merge
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitgraph.graph.build import gait_along, nodes_above, surface_graph
from gaitgraph.graph.cycle_list import cycles
from gaitgraph.graph.walks import Blocked, allowed_edges, best_order, closed_walk
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.planning.any_angle import first_outside, prepared_region
from gaitgraph.planning.refusal import FoundPath
from gaitgraph.surface.sheets import RELATION, SIGNS, Sign

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    import networkx as nx

    from gaitgraph.graph.cycle_list import Cycle
    from gaitgraph.graph.walks import Use
    from gaitgraph.planning.refusal import Branch, Obstacle
    from gaitgraph.planning.request import PlanRequest


def grid_paths(
    branches: Sequence[Branch],
    graph_of: Callable[[Sign], nx.Graph[Any]],
    progress: Callable[[str], None] | None,
) -> list[list[FoundPath] | Obstacle]:
    """Return the loops of each color with one sign of R, or the obstacle."""
    request, sign = branches[0].request, branches[0].sign
    rootless = [branch.rootless() for branch in branches]
    if set.intersection(*map(set, rootless)):
        # Some waypoint has no root at all with this sign: no need to build the graph.
        return [
            branch.obstacle_at(k[0])
            for branch, k in zip(branches, rootless, strict=True)
        ]
    graph = graph_of(sign)
    served = nodes_above(graph, request.waypoints)
    return [_paths_of_color(graph, served, branch, progress) for branch in branches]


def _paths_of_color(
    graph: nx.Graph[Any],
    served: list[list[Any]],
    branch: Branch,
    progress: Callable[[str], None] | None,
) -> list[FoundPath] | Obstacle:
    """Return the best loop of one color for each use of it, or the obstacle."""
    import networkx as nx

    request = branch.request
    if progress is not None:
        progress(f"searching {branch.color} loops")
    stops = [
        [node for node in nodes if graph.nodes[node]["color"] == branch.color]
        for nodes in served
    ]
    if not all(stops):
        return branch.obstacle_at(stops.index([]))
    found: list[FoundPath] = []
    for use in branch.uses:
        order = tuple(range(len(stops)))
        if request.any_order:
            order = best_order(graph, [nodes[0] for nodes in stops], use=use) or order
        ordered = [stops[k] for k in order]
        walk = closed_walk(graph, ordered, use=use, objective=request.objective)
        if not isinstance(walk, Blocked):
            path = gait_along(graph, walk.nodes)
            if not any(np.array_equal(path.alpha, other.path.alpha) for other in found):
                found.append(FoundPath(path, order, None))
        elif use == branch.uses[-1]:
            if use == "flyable" and (
                outside := first_outside(branch, prepared_region(branch, use))
            ):
                return outside
            ends = order[walk.leg], order[(walk.leg + 1) % len(order)]
            # How many nodes usable edges join to each of the two.
            allowed = allowed_edges(use)
            edges = [(a, b) for a, b, data in graph.edges(data=True) if allowed(data)]
            view = nx.Graph([*edges, *((nodes[0], nodes[0]) for nodes in stops)])
            counts = tuple(
                len(nx.node_connected_component(view, stops[k][0])) for k in ends
            )
            wall = f"{'keep_out, keep_in or ' if request.zones else ''}the grid of {request.divisions} divisions"
            wall += ": try more divisions"
            return branch.separation(ends, wall, counts)
    return found


def grid_cycles(
    request: PlanRequest,
    *,
    max_length: float | None = None,
    use: Use = "valid",
    progress: Callable[[str], None] | None = None,
) -> Iterator[Cycle]:
    """Return the simple closed cycles on the grid of a request, in order of length, as a lazy iterator.

    Of the request its color, sign ("auto": both, R > 0 first), divisions, vehicle, coefficients, floor and polygons
    count. The other options are those of :func:`gaitgraph.graph.cycle_list.cycles`. InputError if a value is not
    allowed.
    """
    of_each_sign = []
    for sign in SIGNS:
        if request.sign not in ("auto", sign):
            continue
        graph = request_graph(replace(request, waypoints=()), sign, progress)
        if request.color != "auto":
            graph.remove_nodes_from(
                [
                    name
                    for name, data in graph.nodes(data=True)
                    if data["color"] != request.color
                ]
            )
        of_each_sign.append(cycles(graph, use=use, max_length=max_length))
    return merge(*of_each_sign, key=lambda cycle: cycle.length)


def request_graph(
    request: PlanRequest, sign: Sign, progress: Callable[[str], None] | None
) -> nx.Graph[Any]:
    """Return the surface graph of a request for one sign of R, its waypoints among the nodes."""
    if progress is not None:
        progress(
            f"building the graph of {request.divisions} divisions with {RELATION[sign]}"
        )
    return surface_graph(
        sign,
        divisions=request.divisions,
        vehicle=request.vehicle,
        coefficients=coefficients_of(request.vehicle, request.coefficients),
        waypoints=request.waypoints,
        zones=request.zones,
        floor=request.floor,
    )
