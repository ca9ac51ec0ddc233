"""Loops that use the fibres: straight across the pages where that holds, on the grid of all sheets elsewhere."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.gait.gait import Gait
from gaitgraph.graph.build import edge_quantities, nodes_above, surface_graph, vehicle_and_coefficients
from gaitgraph.graph.walks import Blocked, Use, best_order, closed_walk
from gaitgraph.invertibility.matrices import level_determinant, noise_of
from gaitgraph.planning.plan import Candidates, heuristic_order, loop_of
from gaitgraph.planning.refusal import RELATION, Obstacle
from gaitgraph.planning.unfolding import shortest_leg_across, shortest_leg_between_fibers
from gaitgraph.surface.components import separating_factor
from gaitgraph.surface.fibers import nearest_on_line, point_on_family
from gaitgraph.surface.sheets import FIBERS, family_codes

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import networkx as nx

    from gaitgraph.graph.build import Sign
    from gaitgraph.invertibility.matrices import Coefficients
    from gaitgraph.planning.request import PlanRequest

__all__ = ["fiber_candidates", "gait_along"]

FloatArray = npt.NDArray[np.float64]

_MOVED = 1e-9


def gait_along(graph: nx.Graph[Any], nodes: Sequence[Any]) -> Gait:
    """Return the closed gait through nodes of a surface graph, in order, the first not repeated.

    >>> from gaitgraph.graph.build import surface_graph
    >>> graph = surface_graph("negative", sheets="all")
    >>> gait_along(graph, [(4, 6, "fiber1"), (5, 6, "fiber1")]).types
    ('(?,*)', '(?,*)')
    """
    vehicle, coefficients = vehicle_and_coefficients(graph)
    data = [graph.nodes[node] for node in nodes]
    return Gait(
        alpha=np.array([[node[f"alpha{k}"] for k in range(1, 5)] for node in data]),
        colors=tuple(node["color"] for node in data),
        vehicle=vehicle,
        coefficients=coefficients,
        crossing_tolerance=graph.graph["crossing_tolerance"],
    )


def fiber_candidates(
    request: PlanRequest,
    coefficients: Coefficients,
    sign: Sign,
    *,
    waypoints: Sequence[Sequence[float]] | None = None,
    progress: Callable[[str], None] | None = None,
) -> Candidates:
    """Return the loops with one sign of R on the red sheet and the fibres, or what is in their way.

    Parameters
    ----------
    request
        What is asked for. With the method "exact" the straight way across the pages is taken if it holds; it is then
        the shortest in the order of the waypoints. Otherwise a grid is searched, and a note says so.
    coefficients, sign
        As for :func:`gaitgraph.planning.grid.grid_candidates`.
    waypoints
        The request's waypoints unless given, each of two angles or of four, these exactly on a sheet or a fibre, as
        :func:`stops_on_families` returns them.
    progress
        Called with a line of text before each step.
    """
    found = Candidates()
    points = request.waypoints if waypoints is None else waypoints
    missing = _missing(points, request, coefficients, sign)
    if missing is not None:
        found.obstacles.append(missing)
        return found
    in_order = tuple(range(len(points)))
    if request.method == "exact" and request.objective == "shortest" and not request.any_order:
        path = _straight(points, request, coefficients, sign)
        if path is not None:
            found.loops.append(loop_of(path, in_order, request, sign, method="exact"))
            return found
        found.notes["across the fibres no straight loop holds: searched on a grid instead"] = None
    elif request.method == "exact":
        found.notes["across the fibres only the shortest loop in order is exact: searched on a grid instead"] = None
    if progress is not None:
        progress(f"building the graph of all sheets with {RELATION[sign]}")
    graph = surface_graph(
        sign,
        request.divisions,
        vehicle=request.vehicle,
        coefficients=coefficients,
        waypoints=points,
        zones=request.zones,
        floor=request.floor,
        sheets="all",
    )
    stops = [
        [node for node in nodes if graph.nodes[node]["color"] in (("red",) if len(point) == 2 else ("red", *FIBERS))]
        for point, nodes in zip(points, nodes_above(graph, points), strict=True)
    ]
    if progress is not None:
        progress("searching loops on the red sheet and the fibres")
    uses: tuple[Use, ...] = ("flyable", "valid")
    for use in uses:
        order = in_order
        if request.any_order:
            best = best_order(graph, [nodes[0] for nodes in stops], use=use)
            if best is not None:
                order = best.order
                if not best.exact:
                    found.notes[heuristic_order(len(order))] = None
        walk = closed_walk(graph, [stops[k] for k in order], use=use, objective=request.objective)  # type: ignore[arg-type]
        if not isinstance(walk, Blocked):
            loop = loop_of(gait_along(graph, walk.nodes), order, request, sign)
            if not any(np.array_equal(loop.path.alpha, other.path.alpha) for other in found.loops):
                found.loops.append(loop)
        elif use == "valid":
            leg = order[walk.leg], order[(walk.leg + 1) % len(order)]
            found.obstacles.append(_separated(points, leg, request, coefficients, sign))
    return found


def _missing(
    points: Sequence[Sequence[float]], request: PlanRequest, coefficients: Coefficients, sign: str
) -> Obstacle | None:
    """Return the first waypoint that is on no red or fibre point with the sign of R, or that the zones forbid."""
    wanted = 1.0 if sign == "positive" else -1.0
    for number, point in enumerate(points, start=1):
        alpha = tuple(point) if len(point) == 4 else (*point, *point)
        value = float(level_determinant(alpha, coefficients))
        place = f"waypoint {number} ({', '.join(f'{angle:.4f}' for angle in point)})"
        color = "red" if len(point) == 2 else point_on_family(point, coefficients, tolerance=_MOVED)[1]
        message = None
        if abs(value) <= noise_of(coefficients) or (color == "blue" and abs(value) < 1e-9):
            message = f"{place} has R = 0, singular: fibres and blue meet only there"
        elif color == "blue":
            message = f"{place} is on blue, which the fibres meet only where R = 0"
        elif not wanted * value > noise_of(coefficients):
            message = f"{place} has R = {value:.4g}" if abs(value) > 1e-9 else f"{place} has R = 0, singular"
        elif request.zones is not None and not request.zones.allow_points([point[:2]])[0]:
            message = f"{place} lies where keep_out or keep_in forbids it"
        if message is not None:
            message = f"{color}, {RELATION[sign]}: {message}"
            return Obstacle(color=color, sign=sign, kind="waypoint", message=message, waypoints=(number,), R=value)
    return None


def _separated(
    points: Sequence[Sequence[float]], leg: tuple[int, int], request: PlanRequest, coefficients: Coefficients, sign: str
) -> Obstacle:
    """Return what separates two waypoints: within ±π/2 fibres join no components of red, so the factors of R tell."""
    red = []
    for k in leg:
        point = points[k]
        color = "red" if len(point) == 2 else point_on_family(point, coefficients, tolerance=_MOVED)[1]
        red.append((nearest_on_line(point, color, coefficients) if color in FIBERS else np.array(point))[:2].tolist())
    wall = separating_factor(red[0], red[1], request.vehicle)
    if wall is None:
        region = "the keep_out and keep_in polygons, or the grid," if request.zones else "the grid"
        wall = f"{region} of {request.divisions} divisions: more divisions may join them"
    numbers = leg[0] + 1, leg[1] + 1
    message = f"red and fibres, {RELATION[sign]}: waypoints {numbers[0]} and {numbers[1]} are separated by {wall}"
    return Obstacle(color="red", sign=sign, kind="separated", message=message, waypoints=numbers)


def _straight(
    stops: Sequence[Sequence[float]], request: PlanRequest, coefficients: Coefficients, sign: Sign
) -> Gait | None:
    """Return the loop that is straight across the pages from waypoint to waypoint, or None unless it is valid."""
    points = [tuple(point) if len(point) == 4 else (*point, *point) for point in stops]
    colors = [point_on_family(point, coefficients, tolerance=_MOVED)[1] for point in points]
    alpha: list[Sequence[float]] = []
    names: list[str] = []
    for k, start in enumerate(points):
        after = (k + 1) % len(points)
        way = _leg(start, points[after], colors[k], colors[after], coefficients)
        if way is None:
            return None
        alpha += way[0][:-1]
        names += way[1][:-1]
    rows, codes = np.array([*alpha, alpha[0]]), family_codes([*names, names[0]])
    edge = np.array(list(pairwise(range(len(rows)))))
    wanted = 1.0 if sign == "positive" else -1.0
    red = codes == 1
    held = edge_quantities(rows, red, edge, wanted, request.vehicle, coefficients, request.floor, codes=codes)
    good = (held["jump"] == 0) & held["keeps_sign"]
    if request.zones is not None:
        good &= request.zones.allow_segments(rows[:-1, :2], rows[1:, :2])
    if not good.all():
        return None
    return Gait(alpha=rows[:-1], colors=tuple(names), vehicle=request.vehicle, coefficients=coefficients)


def _leg(
    start: Sequence[float], end: Sequence[float], color: str, after: str, coefficients: Coefficients
) -> tuple[list[Sequence[float]], list[str]] | None:
    """Return the points and colors of the shortest way between two points if nothing is in the way, or None."""
    if color == after:
        return [start, end], [color, after]
    if "red" in (color, after):
        fiber = color if after == "red" else after
        leg = shortest_leg_across(start, end, fiber, coefficients)
    else:
        leg = shortest_leg_between_fibers(start, end, coefficients)
    return None if leg is None or leg.bent else (leg.points.tolist(), list(leg.colors))
