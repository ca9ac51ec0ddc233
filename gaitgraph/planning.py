"""Plan a gait: a closed loop through (α1, α2) waypoints that is Two-Color-consistent and, if possible, flyable.

The order of preference is the shortest flyable loop; if there is none, the shortest valid one, with the reason.
All-red and all-blue loops are planned for each sign of R that is asked for or left open; what is not chosen is
kept as an alternative with its verdict. When nothing is found the plan says what is in the way.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitgraph.angles import text_from_angle
from gaitgraph.errors import InputError
from gaitgraph.gait import Gait
from gaitgraph.graph import WAYPOINT_SNAP, nodes_above, surface_graph, vehicle_and_coefficients
from gaitgraph.invertibility import Coefficients, coefficients_of, noise_of
from gaitgraph.plans import Loop, Obstacle, Plan
from gaitgraph.regions import separating_factor
from gaitgraph.requests import PlanRequest, request_of
from gaitgraph.search import Blocked, Use, best_order, closed_walk
from gaitgraph.surface import COLORS, root_arrays, roots
from gaitgraph.timing import CLOCK_CHECKS, parametrize

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import networkx as nx


__all__ = ["plan", "plan_loop"]


def plan_loop(
    waypoints: Any,
    *,
    graph: nx.Graph[Any] | None = None,
    progress: Callable[[str], None] | None = None,
    **request: Any,
) -> Plan:
    """Plan a closed gait through (α1, α2) waypoints, in order and back to the first.

    Parameters
    ----------
    waypoints
        (α1, α2) pairs, numbers [rad] or texts such as "3pi/8". One waypoint plans a gait that is a point, two an
        out-and-back gait.
    graph
        A surface graph to plan on, instead of one built for the request; it fixes sign, divisions, vehicle,
        coefficients and floor, and must hold the waypoints as nodes.
    progress
        Called with a line of text before each step of long work.
    **request
        The other fields of :class:`PlanRequest`: color, sign, objective, divisions, vehicle, coefficients,
        keep_out, keep_in, any_order, reverse, period, law, floor.

    Returns
    -------
    Plan
        Infeasible is an answer, not an error: look at `status` and `reason`.

    Raises
    ------
    InputError
        If the request is malformed.

    Examples
    --------
    >>> plan = plan_loop([("3pi/8", "-3pi/8"), ("3pi/8", "-pi/8"), ("pi/8", "-pi/8"), ("pi/8", "-3pi/8")])
    >>> plan.status, plan.loop.color, plan.report.flyable
    ('planned', 'red', True)
    >>> plan.gait.alpha.round(3).tolist()[0]
    [1.178, -1.178, 1.178, -1.178]
    """
    if graph is not None:
        vehicle, coefficients = vehicle_and_coefficients(graph)
        fixed = {
            "sign": graph.graph["sign"],
            "divisions": graph.graph["divisions"],
            "vehicle": vehicle,
            "coefficients": coefficients.kind,
            "floor": graph.graph["floor"],
        }
        for name in (*fixed, "keep_out", "keep_in"):
            if name in request:
                raise InputError(f"{name}: {request[name]!r}; allowed is no {name} beside a graph, which fixes it")
        request |= fixed
    return plan(request_of({"waypoints": waypoints, **request}), graph=graph, progress=progress)


def plan(
    request: PlanRequest,
    *,
    graph: nx.Graph[Any] | None = None,
    progress: Callable[[str], None] | None = None,
) -> Plan:
    """Answer a request; see :func:`plan_loop`."""
    coefficients = coefficients_of(request.vehicle, request.coefficients)
    signs = ("positive", "negative") if request.sign == "auto" else (request.sign,)
    colors = COLORS if request.color == "auto" else (request.color,)
    loops: list[Loop] = []
    broken: list[Loop] = []
    obstacles: list[Obstacle] = []
    notes: dict[str, None] = {}
    for sign in signs:
        rootless = {color: _rootless(request, coefficients, color, sign) for color in colors}
        if graph is None and set.intersection(*rootless.values()):
            # Some waypoint has no root at all with this sign: no need to build the graph.
            obstacles += [_waypoint_obstacle(min(rootless[c]), request, coefficients, c, sign) for c in colors]
            continue
        if progress is not None and graph is None:
            progress(f"building the graph with R {'>' if sign == 'positive' else '<'} 0")
        on = graph if graph is not None else _graph(request, coefficients, sign)
        served = nodes_above(on, request.waypoints)
        if graph is not None and not all(served):
            missing = request.waypoints[[bool(nodes) for nodes in served].index(False)]
            raise InputError(f"waypoints: {missing!r} is no node of the graph; pass waypoints= to surface_graph")
        for color in colors:
            if progress is not None:
                progress(f"searching {color} loops")
            found = _loops_of(on, served, request, coefficients, color, sign, notes)
            if isinstance(found, Obstacle):
                obstacles.append(found)
            else:
                loops += found
        if request.color == "auto" and all(served):
            broken += _broken(on, served, request, sign)
    loops.sort(key=lambda loop: _preference(loop, request.objective))
    shortest = min((loop.length for loop in loops), default=math.inf)
    broken = [loop for loop in broken if loop.length < shortest - 1e-9]
    if not loops:
        return Plan(
            request=request,
            loop=None,
            reason=_refusal(obstacles),
            waypoints=request.waypoints,
            alternatives=tuple(broken),
            obstacles=tuple(obstacles),
            warnings=request.notes,
        )
    chosen = loops[0]
    report = chosen.report
    reason = None if report.flyable else f"no loop through these waypoints is flyable: {report.reason}"
    warnings = [*request.notes, *_beside_the_grid(request), *notes, *report.warnings]
    if not report.reachable_from_hover:
        warnings.append(report.reachability)
    return Plan(
        request=request,
        loop=chosen,
        reason=reason,
        waypoints=tuple(request.waypoints[k] for k in chosen.order),
        alternatives=(*loops[1:], *broken),
        obstacles=tuple(obstacles),
        warnings=tuple(warnings),
    )


def _beside_the_grid(request: PlanRequest) -> list[str]:
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
        return _waypoint_obstacle(lacking[0], request, coefficients, color, sign)
    uses: tuple[Use, ...] = ("flyable", "valid") if color == "red" else ("valid",)
    loops: list[Loop] = []
    for use in uses:
        order = tuple(range(len(stops)))
        if request.any_order:
            best = best_order(graph, [nodes[0] for nodes in stops], use=use)
            if best is not None:
                order = best.order
                if not best.exact:
                    notes[_heuristic_order(len(order))] = None
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


def _heuristic_order(number: int) -> str:
    return (
        f"order of {number} waypoints by Christofides' heuristic (networkx): the shortest loop in it is at most 1.5 "
        "times the shortest in any order on this graph, and not proven shortest"
    )


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
    if request.reverse:
        path, order = path.reversed(), (order[0], *order[:0:-1])
    gait = path.merged()
    timed = parametrize(gait, request.period, law=request.law)
    return Loop(path=path, gait=gait, sign=sign, order=order, report=timed.check(floor=request.floor))


def _preference(loop: Loop, objective: str) -> tuple[Any, ...]:
    """Order loops: flyable first, then flyable but for the clock, then valid, then by the objective."""
    report = loop.report
    timeless = all(check.mark == "ok" for check in report.checks if check.name not in CLOCK_CHECKS)
    robustness = report["least_singular_value"].value or 0.0
    return (
        not report.flyable,
        not timeless,
        not report.valid,
        -round(robustness, 3) if objective == "robust" else 0.0,
        round(loop.length, 9),
        loop.color != "red",
        loop.sign != "positive",
    )


def _rootless(request: PlanRequest, coefficients: Coefficients, color: str, sign: str) -> set[int]:
    """Return the waypoints, counted from 0, above which the graph has no node of a color and sign."""
    if color == "blue" and coefficients.kind == "exact":
        return set(range(len(request.waypoints)))
    wanted = 1.0 if sign == "positive" else -1.0
    plane = np.array(request.waypoints)
    found = root_arrays(plane[:, 0], plane[:, 1], coefficients)
    of_color = found.sheet == (1 if color == "red" else -1)
    rooted = (of_color & (wanted * np.nan_to_num(found.R) > noise_of(coefficients))).any(axis=1)
    if request.zones is not None:
        rooted &= request.zones.allow_points(plane)
    return set(np.nonzero(~rooted)[0].tolist())


def _waypoint_obstacle(k: int, request: PlanRequest, coefficients: Coefficients, color: str, sign: str) -> Obstacle:
    point = request.waypoints[k]
    place = f"waypoint {k + 1} ({point[0]:.4f}, {point[1]:.4f})"
    if color == "blue" and coefficients.kind == "exact":
        return Obstacle(
            color=color,
            sign=sign,
            kind="color",
            message="blue: with exact coefficients R = 0 on the whole blue sheet, so the matrix is singular there",
            R=0.0,
        )
    wanted = 1.0 if sign == "positive" else -1.0
    values = [root.R for root in roots(point[0], point[1], coefficients) if root.color == color]
    best = max(values, key=lambda value: wanted * value)
    relation = ">" if sign == "positive" else "<"
    if wanted * best > 0 and request.zones is not None:
        message = f"{color}, R {relation} 0: {place} lies where keep_out or keep_in forbids it"
    elif abs(best) < 1e-9:
        message = f"{color}, R {relation} 0: {place} has R = 0, the matrix is singular there"
    else:
        message = f"{color}, R {relation} 0: {place} has R = {best:.4g}"
    return Obstacle(color=color, sign=sign, kind="waypoint", message=message, waypoints=(k + 1,), R=best)


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
    numbers = tuple(request.waypoints.index(min(request.waypoints, key=lambda w: math.dist(w, p))) + 1 for p in points)
    wall = separating_factor(points[0], points[1], request.vehicle) if color == "red" else None
    if wall is None:
        region = "the keep_out and keep_in polygons, or the grid," if request.zones else "the grid"
        wall = f"{region} of {request.divisions} divisions: more divisions may join them"
    relation = ">" if sign == "positive" else "<"
    return Obstacle(
        color=color,
        sign=sign,
        kind="separated",
        message=f"{color}, R {relation} 0: waypoints {numbers[0]} and {numbers[1]} are separated by {wall}",
        waypoints=numbers,
        components=tuple(len(node_connected_component(view, nodes[0])) for nodes in ends),
    )


def _refusal(obstacles: Sequence[Obstacle]) -> str:
    messages = list(dict.fromkeys(obstacle.message for obstacle in obstacles))
    return "no closed loop: " + "; ".join(messages)
