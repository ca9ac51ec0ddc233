"""Plan a gait: search loops for each color and sign of R, judge them, and answer with the best one.

Loops are judged as any gait is. The best is flyable, then valid, then what the objective prefers; every other loop
stays as an alternative with its verdict. When nothing is found the plan says what is in the way.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Literal

from gaitgraph.errors import InputError
from gaitgraph.graph.build import vehicle_and_coefficients
from gaitgraph.invertibility.matrices import DEFAULT_FLOOR, Kind, coefficients_of
from gaitgraph.planning.any_angle import add_any_angle_loops, with_nearest
from gaitgraph.planning.grid import add_grid_loops, notes_beside_the_grid
from gaitgraph.planning.plan import Candidates, Loop, Plan
from gaitgraph.planning.request import request_of
from gaitgraph.timing.timed_gait import LAWS
from gaitgraph.validation.report import RATE_CHECKS
from gaitgraph.vehicle import PAPER, Vehicle

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

    import networkx as nx

    from gaitgraph.planning.request import PlanRequest, Points
    from gaitgraph.surface.sheets import Sign


def plan_loop(
    waypoints: Points,
    *,
    color: Literal["auto", "red", "blue"] = "auto",
    sign: Literal["auto", "positive", "negative"] = "auto",
    objective: Literal["shortest", "robust"] = "shortest",
    divisions: int | None = None,
    vehicle: Vehicle | str | Path | Mapping[str, Any] = PAPER,
    coefficients: Kind | None = None,
    keep_out: Sequence[Points] = (),
    keep_in: Sequence[Points] = (),
    any_order: bool = False,
    reverse: bool = False,
    method: Literal["exact", "grid"] | None = None,
    accuracy: float = 1e-6,
    period: float = 1.0,
    law: str = LAWS[0],
    floor: float = DEFAULT_FLOOR,
    graph: nx.Graph[Any] | None = None,
    progress: Callable[[str], None] | None = None,
) -> Plan:
    """Plan a closed gait through (α1, α2) waypoints, in order and back to the first.

    Parameters
    ----------
    waypoints
        (α1, α2) pairs, numbers [rad] or texts such as "3pi/8". One waypoint plans a gait that is a point, two an
        out-and-back gait.
    color, sign, objective, divisions, vehicle, coefficients, keep_out, keep_in, any_order, reverse, method, accuracy
        What is asked for: see :func:`gaitgraph.planning.request.request_of`.
    period, law, floor
        How the loop is judged: see there too.
    graph
        A surface graph to plan on, instead of one built for the request. It must hold the waypoints as nodes. It
        fixes sign, divisions, method, vehicle, coefficients, floor and polygons, of which none may be asked for then.
    progress
        Called with a line of text before each step of long work.

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
        stated = {
            "sign": sign != "auto",
            "divisions": divisions is not None,
            "method": method is not None,
            "vehicle": vehicle is not PAPER,
            "coefficients": coefficients is not None,
            "floor": floor != DEFAULT_FLOOR,
            "keep_out": len(keep_out) > 0,
            "keep_in": len(keep_in) > 0,
        }
        for name in (name for name, is_stated in stated.items() if is_stated):
            raise InputError(f"{name} must not be stated beside a graph, which fixes it")
        vehicle, numbers = vehicle_and_coefficients(graph)
        coefficients, method = numbers.kind, "grid"
        sign, divisions, floor = (graph.graph[name] for name in ("sign", "divisions", "floor"))
    request = request_of(
        waypoints,
        color=color,
        sign=sign,
        objective=objective,
        divisions=divisions,
        vehicle=vehicle,
        coefficients=coefficients,
        keep_out=keep_out,
        keep_in=keep_in,
        any_order=any_order,
        reverse=reverse,
        method=method,
        accuracy=accuracy,
        period=period,
        law=law,
        floor=floor,
    )
    return plan(request, graph=graph, progress=progress)


def plan(
    request: PlanRequest,
    *,
    graph: nx.Graph[Any] | None = None,
    progress: Callable[[str], None] | None = None,
) -> Plan:
    """Answer a request; see :func:`plan_loop`."""
    coefficients = coefficients_of(request.vehicle, request.coefficients)
    found = Candidates()
    signs: tuple[Sign, ...] = ("positive", "negative")
    for sign in signs:
        if request.sign not in ("auto", sign):
            continue
        if request.method == "exact":
            add_any_angle_loops(found, request, coefficients, sign, progress=progress)
        else:
            add_grid_loops(found, request, coefficients, sign, graph=graph, progress=progress)
    loops = _ordered(found.loops, request.objective)
    # A loop that jumps is told of if it is shorter than what does not.
    shortest = min((loop.length for loop in loops), default=math.inf)
    broken = [loop for loop in found.broken if loop.length < shortest - 1e-9]
    if not loops:
        obstacles = found.obstacles
        if request.method == "exact":
            obstacles = [with_nearest(obstacle, request, coefficients) for obstacle in obstacles]
        return Plan(
            request=request,
            loop=None,
            reason="no closed loop: " + "; ".join(dict.fromkeys(obstacle.message for obstacle in obstacles)),
            waypoints=request.waypoints,
            alternatives=tuple(broken),
            obstacles=tuple(obstacles),
            warnings=request.notes,
        )
    chosen = loops[0]
    report = chosen.report
    beside = notes_beside_the_grid(request) if request.method == "grid" else []
    warnings = [*request.notes, *beside, *found.notes, *report.warnings]
    if not report.reachable_from_hover:
        warnings.append(report.reachability)
    return Plan(
        request=request,
        loop=chosen,
        reason=None if report.flyable else f"no loop through these waypoints is flyable: {report.reason}",
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
