"""The method of the paper's grid: a closed walk on the surface graph for a branch of a request, and closed cycles."""

from __future__ import annotations

from dataclasses import replace
from heapq import merge
from operator import attrgetter
from typing import TYPE_CHECKING, Any

from gaitgraph.graph.build import gait_along, nodes_above
from gaitgraph.graph.cycle_list import cycles
from gaitgraph.graph.walks import Blocked, best_order, closed_walk
from gaitgraph.planning.any_angle import first_outside, prepared_region
from gaitgraph.planning.branch import Search
from gaitgraph.planning.loop import Loop
from gaitgraph.surface.sheets import SIGNS

if TYPE_CHECKING:
    from collections.abc import Iterator

    import networkx as nx

    from gaitgraph.graph.cycle_list import Cycle
    from gaitgraph.graph.walks import EdgeRequirement
    from gaitgraph.planning.branch import Branch, Refusal
    from gaitgraph.planning.request import PlanRequest, Progress


def grid_loop(branch: Branch) -> Loop | Refusal:
    """Return the best loop of a branch on the graph of its sign of R, or why there is none."""
    request = branch.request
    graph = branch.search.graph(branch.sign)
    branch.search.progress(f"searching {branch.color} loops")
    if branch.servo_margin:
        graph = _bearing(graph, branch.servo_margin)
    stops = [
        [node for node in nodes if graph.nodes[node]["color"] == branch.color]
        for nodes in nodes_above(graph, request.waypoints)
    ]
    order = None
    if request.any_order:
        nodes = [choices[0] for choices in stops]
        order = best_order(graph, nodes, require=branch.require, weight=request.weight)
    order = order or tuple(range(len(stops)))
    walk = closed_walk(
        graph,
        [stops[k] for k in order],
        require=branch.require,
        objective=request.objective,
        weight=request.weight,
    )
    if isinstance(walk, Blocked):
        return _blocked(branch, (order[walk.leg], order[(walk.leg + 1) % len(order)]))
    return Loop(
        path=gait_along(graph, walk.nodes),
        sign=branch.sign,
        order=order,
        request=request,
        cost=walk.cost,
    )


def _bearing(graph: nx.Graph[Any], least: float) -> nx.Graph[Any]:
    """Return a graph without the edges that have less than a servo margin [rad]."""
    import networkx as nx

    margins = nx.get_edge_attributes(graph, "servo_margin")
    kept = graph.copy()
    kept.remove_edges_from(pair for pair in margins if margins[pair] < least)
    return kept


def _blocked(branch: Branch, ends: tuple[int, int]) -> Refusal:
    """Return why two waypoints cannot be joined."""
    request = branch.request
    if branch.require == "flyable":
        outside = first_outside(branch, prepared_region(branch))
        if outside is not None:
            return outside
    wall = f"the grid of {request.divisions} divisions: try more divisions"
    if request.zones is not None:
        wall = f"keep_out, keep_in or {wall}"
    if request.weight is not None:
        wall = f"edges that the weight hides, {wall}"
    return branch.separation(ends, wall)


def grid_cycles(
    request: PlanRequest,
    *,
    max_length: float | None = None,
    require: EdgeRequirement = "valid",
    progress: Progress | None = None,
) -> Iterator[Cycle]:
    """Return the simple closed cycles on the grid of a request, in order of length, as a lazy iterator.

    Of the request its color, sign ("auto": both, merged by length), divisions, vehicle, coefficients, floor and polygons
    count. The other options are those of :func:`gaitgraph.graph.cycle_list.cycles`. InputError if a value is not
    allowed.
    """
    search = Search(replace(request, waypoints=()), progress)
    of_each_sign = []
    for sign in SIGNS:
        if request.sign not in ("auto", sign):
            continue
        graph = search.graph(sign)
        for node, color in list(graph.nodes(data="color")):
            if request.color not in ("auto", color):
                graph.remove_node(node)
        of_each_sign.append(cycles(graph, require=require, max_length=max_length))
    return merge(*of_each_sign, key=attrgetter("length"))
