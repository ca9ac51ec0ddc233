"""Plan a gait: a closed loop through (α1, α2) waypoints that is Two-Color-consistent and, if possible, flyable.

The order of preference is the shortest flyable loop; if there is none, the shortest valid one, with the reason.
All-red and all-blue loops are planned for each sign of R that is asked for or left open; what is not chosen is
kept as an alternative with its verdict. When nothing is found the plan says what is in the way.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from gaitgraph.errors import InputError
from gaitgraph.graph.build import vehicle_and_coefficients
from gaitgraph.invertibility.matrices import coefficients_of
from gaitgraph.planning.any_angle import any_angle_candidates, with_nearest
from gaitgraph.planning.grid import grid_candidates, notes_beside_the_grid
from gaitgraph.planning.plan import Candidates, Loop, Plan
from gaitgraph.planning.request import PlanRequest, request_from_mapping
from gaitgraph.validation.report import RATE_CHECKS

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import networkx as nx

    from gaitgraph.planning.refusal import Obstacle

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
        The other fields of :class:`PlanRequest`: color, sign, objective, method, divisions, accuracy, vehicle,
        coefficients, keep_out, keep_in, any_order, reverse, period, law, floor.

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
            "method": "grid",
            "vehicle": vehicle,
            "coefficients": coefficients.kind,
            "floor": graph.graph["floor"],
        }
        for name in (*fixed, "keep_out", "keep_in"):
            if name in request:
                raise InputError(f"{name}: {request[name]!r}; allowed is no {name} beside a graph, which fixes it")
        request |= fixed
    return plan(request_from_mapping({"waypoints": waypoints, **request})[0], graph=graph, progress=progress)


def plan(
    request: PlanRequest,
    *,
    graph: nx.Graph[Any] | None = None,
    progress: Callable[[str], None] | None = None,
) -> Plan:
    """Answer a request; see :func:`plan_loop`."""
    coefficients = coefficients_of(request.vehicle, request.coefficients)
    found = Candidates()
    for sign in ("positive", "negative") if request.sign == "auto" else (request.sign,):
        if request.method == "exact":
            more = any_angle_candidates(request, coefficients, sign, progress=progress)
        else:
            more = grid_candidates(request, coefficients, sign, graph=graph, progress=progress)
        found.take(more)
    loops = _ordered(found.loops, request.objective)
    shortest = min((loop.length for loop in loops), default=math.inf)
    broken = [loop for loop in found.broken if loop.length < shortest - 1e-9]
    if not loops:
        if request.method == "exact":
            found.obstacles = [with_nearest(obstacle, request, coefficients) for obstacle in found.obstacles]
        return Plan(
            request=request,
            loop=None,
            reason=_refusal(found.obstacles),
            waypoints=request.waypoints,
            alternatives=tuple(broken),
            obstacles=tuple(found.obstacles),
            warnings=request.notes,
        )
    chosen = loops[0]
    report = chosen.report
    reason = None if report.flyable else f"no loop through these waypoints is flyable: {report.reason}"
    beside = notes_beside_the_grid(request) if request.method == "grid" else []
    warnings = [*request.notes, *beside, *found.notes, *report.warnings]
    if not report.reachable_from_hover:
        warnings.append(report.reachability)
    return Plan(
        request=request,
        loop=chosen,
        reason=reason,
        waypoints=tuple(request.waypoints[k] for k in chosen.order),
        alternatives=(*loops[1:], *broken),
        obstacles=tuple(found.obstacles),
        warnings=tuple(warnings),
    )


def _ordered(loops: Sequence[Loop], objective: str) -> list[Loop]:
    """Return loops, the preferred first.

    Only red can be flyable. A single loop that is not red comes after red ones that all are, whatever its checks say,
    so that it is judged only when somebody asks.
    """
    red = sorted((loop for loop in loops if loop.color == "red"), key=lambda loop: _preference(loop, objective))
    rest = [loop for loop in loops if loop.color != "red"]
    if rest and (len(rest) > 1 or not red or not all(loop.report.flyable for loop in red)):
        return sorted(loops, key=lambda loop: _preference(loop, objective))
    return [*red, *rest]


def _preference(loop: Loop, objective: str) -> tuple[Any, ...]:
    """Order loops: flyable first, then flyable but for the clock, then valid, then by the objective."""
    report = loop.report
    timeless = all(check.mark == "ok" for check in report.checks if check.name not in RATE_CHECKS)
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


def _refusal(obstacles: Sequence[Obstacle]) -> str:
    messages = list(dict.fromkeys(obstacle.message for obstacle in obstacles))
    return "no closed loop: " + "; ".join(messages)
