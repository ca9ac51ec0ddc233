"""Plan a gait: search a loop for each color and sign of R, check them as any gait, and return the best one.

A plan returns a flyable loop, or with ``require="valid"`` the best that obeys the paper's rules: flyable first, then
valid, then by the objective. The other loops are alternatives, with their verdicts. If there is none, the plan says why.

:func:`plan` leads from a :class:`~gaitgraph.planning.request.PlanRequest` by its branches
(:mod:`~gaitgraph.planning.branch`) to the searches, :mod:`~gaitgraph.planning.any_angle` in a region or
:mod:`~gaitgraph.planning.grid` on a graph; what they find is a :class:`~gaitgraph.planning.loop.Loop`.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from time import monotonic
from typing import TYPE_CHECKING, Any

import shapely

from gaitgraph.angles import checked_number
from gaitgraph.errors import Advice, Infeasible
from gaitgraph.gait.gait import corner_lines, setting_line
from gaitgraph.gait.table import RATE_CHECKS
from gaitgraph.graph.walks import MOST_ANY_ORDER
from gaitgraph.pictured import Pictured
from gaitgraph.planning.any_angle import any_angle_loop
from gaitgraph.planning.branch import Refusal, Search
from gaitgraph.planning.grid import grid_loop
from gaitgraph.planning.location import as_item, with_nearest
from gaitgraph.planning.loop import Loop
from gaitgraph.planning.request import PlanRequest, Point, plan_request, read_request
from gaitgraph.surface.sheets import RELATION
from gaitgraph.validation.report import verdict_of

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from gaitgraph.gait.gait import Gait
    from gaitgraph.graph.walks import Weight
    from gaitgraph.invertibility.coefficients import CoefficientsLike
    from gaitgraph.planning.request import Method, Objective, Progress
    from gaitgraph.surface.region import Points, Requirement
    from gaitgraph.surface.sheets import ColorChoice, SignChoice
    from gaitgraph.timing.laws import LawName
    from gaitgraph.timing.timed_gait import TimedGait
    from gaitgraph.validation.report import Report
    from gaitgraph.vehicle import Angle, VehicleLike

_NO_LOOP: dict[str, Any] = {
    **dict.fromkeys(("color", "sign", "length", "lower_bound", "order_exact")),
    "path": [],
    "types": [],
    "colors": [],
    "corners": [],
    "vertices": [],
    **verdict_of(None),
}
VALID_LOOPS = Advice(
    "for a loop that obeys only the paper's rules, use require='valid'",
    "for a loop that obeys only the paper's rules, plan with --require valid",
)
_APPROXIMATE = (
    f"the order of the waypoints is approximate: beyond {MOST_ANY_ORDER} waypoints not all orders are tried, "
    "and another one may make a shorter loop"
)
_LATE = "the deadline ended the search for an order of the waypoints: another order may make a shorter loop"
_POSTURE = "the plan is a single posture, not a gait; for a gait, give two or more different waypoints"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Plan(Pictured):
    """The answer to a request: a loop, or the reason why there is none. Truthy when there is one.

    `reason` says why there is no loop, or why the chosen one is not flyable; None if it is. `advice` says how to ask for
    a loop that only obeys the paper's rules, where there is one and no flyable one; else it is None. `waypoints` are in the
    order in which the loop passes them [rad]. `alternatives` are other loops through the same waypoints, with their
    verdicts: those that cannot fly only if there is no other, or if the request does not require it. `refusals` has
    one for each color and sign without a loop; without any loop the first is the one that the shortest moves of
    waypoints remove.
    """

    request: PlanRequest
    loop: Loop | None
    reason: str | None
    waypoints: tuple[Point, ...]
    alternatives: tuple[Loop, ...] = ()
    refusals: tuple[Refusal, ...] = ()
    warnings: tuple[str, ...] = ()
    advice: str | None = None

    @property
    def status(self) -> str:
        """Whether the plan is "planned" or "infeasible"."""
        return "infeasible" if self.loop is None else "planned"

    def __bool__(self) -> bool:
        return self.loop is not None

    @property
    def _found(self) -> Loop:
        if self.loop is None:
            advice = VALID_LOOPS if self.advice == VALID_LOOPS.python else None
            reasons = filter(None, (self.reason, None if advice else self.advice))
            raise Infeasible("; ".join(reasons), advice=advice)
        return self.loop

    @property
    def gait(self) -> Gait:
        """The planned gait, straight runs merged; raises Infeasible if there is none."""
        return replace(self._found.gait, request=self.request.as_mapping())

    @property
    def report(self) -> Report:
        """All checks of the planned gait; raises Infeasible if there is none."""
        return self._found.report

    def timed(
        self, *, samples: int | None = None, rate: float | None = None
    ) -> TimedGait:
        """Return the planned gait with the request's period and timing law; raises Infeasible if there is none."""
        return self.gait.parametrize(
            self.request.period, law=self.request.law, samples=samples, rate=rate
        )

    def as_mapping(self) -> dict[str, Any]:
        """Return the plan as plain values, ready for JSON."""
        loop = _NO_LOOP
        if self.loop is not None:
            loop = self.loop.as_mapping()
        return {
            "status": self.status,
            "reason": self.reason,
            "advice": self.advice,
            "waypoints": [list(point) for point in self.waypoints],
            **loop,
            **self._margins(),
            "alternatives": [other.as_mapping() for other in self.alternatives],
            "warnings": list(self.warnings),
            "refusals": [asdict(refusal) for refusal in self.refusals],
            "crossing_tolerance": math.pi / (2 * self.request.divisions),
            "method": self.request.method,
            "request": self.request.as_mapping(),
        }

    def _margins(self) -> dict[str, float | None]:
        """Return the servo margin of the loop, proven and found, if the request asks for one, as robustness does."""
        if not self.request.servo_margin:
            return {}
        if self.loop is None:
            return {"servo_margin_deg": None, "servo_margin_found_deg": None}
        margin = self.loop.servo_margin
        degrees = None if margin.found is None else math.degrees(margin.found)
        return {
            "servo_margin_deg": math.degrees(margin.proven),
            "servo_margin_found_deg": degrees,
        }

    def __str__(self) -> str:
        said = {_POSTURE}
        if self.loop is None:
            lines = self._refusal_lines()
        else:
            lines = self._loop_lines(self.loop)
            said |= {check.message for check in self.loop.report.checks}
        if self.alternatives:
            lines += ["", "alternatives", *map(as_item, self.alternatives)]
        # What is said above is not said again.
        new = [f"warning: {text}" for text in self.warnings if text not in said]
        if new:
            lines += ["", *new]
        return "\n".join(lines)

    def _loop_lines(self, loop: Loop) -> list[str]:
        head = f"Planned a {loop.color} gait, {RELATION[loop.sign]}: {loop.gait.size_text}, T = {self.request.period:g} s, "
        head += self.request.law
        if not loop.length:
            head = f"{_POSTURE[0].upper()}{_POSTURE[1:]}"
        lines = [head, self._conditions, "", *corner_lines(loop.gait), ""]
        lines += loop.report.lines
        if self.request.servo_margin:
            proven = degrees_below(loop.servo_margin.proven)
            lines.append(f"bears errors of the servos up to {proven}")
        return lines

    def _refusal_lines(self) -> list[str]:
        head = "No gait through these waypoints."
        if self.request.require == "flyable":
            head = "No flyable gait through these waypoints."
        if any(refusal.kind == "waypoint" for refusal in self.refusals):
            head += " All must be admissible with one color and sign of R:"
        messages = dict.fromkeys(refusal.message for refusal in self.refusals)
        lines = [head, *map(as_item, messages)]
        if self.advice is not None:
            lines.append(f"{self.advice[0].upper()}{self.advice[1:]}.")
        lines.append(self._conditions)
        return lines

    @property
    def _conditions(self) -> str:
        """The vehicle, the coefficients and the method, in words."""
        request = self.request
        method = "any-angle method"
        if request.method == "grid":
            method = f"grid of {request.divisions} divisions"
        return f"{setting_line(request.vehicle, request.coefficients)}, {method}"

    def __repr__(self) -> str:
        count, vehicle = len(self.waypoints), self.request.vehicle.name
        answer = "infeasible" if self.loop is None else repr(self.loop)
        return f"<Plan: {answer} through {count} waypoint{'s' * (count != 1)}, vehicle {vehicle!r}>"


def plan_loop(
    waypoints: Points,
    *,
    color: ColorChoice = PlanRequest.color,
    sign: SignChoice = PlanRequest.sign,
    objective: Objective = PlanRequest.objective,
    divisions: int | None = None,
    vehicle: VehicleLike = PlanRequest.vehicle,
    coefficients: CoefficientsLike | None = PlanRequest.coefficients,
    keep_out: Sequence[Points] = PlanRequest.keep_out,
    keep_in: Sequence[Points] = PlanRequest.keep_in,
    any_order: bool = PlanRequest.any_order,
    reverse: bool = PlanRequest.reverse,
    method: Method | None = None,
    accuracy: float = PlanRequest.accuracy,
    period: float = PlanRequest.period,
    law: LawName = PlanRequest.law,
    floor: float = PlanRequest.floor,
    require: Requirement = PlanRequest.require,
    servo_margin: Angle = PlanRequest.servo_margin,
    weight: Weight | None = PlanRequest.weight,
    progress: Progress | None = None,
    deadline: float | None = None,
) -> Plan:
    """Plan a closed gait through (α1, α2) waypoints, in order and back to the first.

    Parameters
    ----------
    waypoints
        (α1, α2) pairs in [−π/2, π/2], numbers [rad] or texts such as "3pi/8"; the loop passes through them exactly.
        Waypoints that repeat in a row are merged. One gives a single posture, two an out-and-back gait.
    color
        "red", "blue" or "auto".
    sign
        Sign of R: "positive", "negative" or "auto".
    objective
        "shortest", or "robust": the best worst-case least singular value, then the shortest.
    divisions
        Intervals into which [−π/2, π/2] is cut by the grid, at most 256; 16 if it is not given.
    vehicle
        A vehicle, a preset's name, a TOML file, or a mapping of constants.
    coefficients
        "published", "printed", "exact", or None: published for the paper's own vehicle, exact for any other.
    keep_out, keep_in
        Polygons in the (α1, α2) plane, lists of (α1, α2).
    any_order
        Visit the waypoints in the order that makes the shortest loop: exact up to nine, beyond that approximate
        (:func:`gaitgraph.graph.walks.shortest_order`).
    reverse
        Run the loop in the other direction.
    method
        "exact": the any-angle method, which finds the shortest loops of all; "grid": the paper's grid graph. By
        default the grid if `divisions` or a `weight` are given, else exact.
    accuracy
        With the method "exact": largest distance from a curved border to the polygon inside it [rad], 1e-9 to 0.1.
    period, law
        Period [s] and timing law with which tilt rates are checked; see :meth:`gaitgraph.gait.gait.Gait.parametrize`.
    floor
        Least singular value that a flyable loop keeps, dimensionless.
    require
        "flyable": a loop that can fly, or none; "valid": if none can fly, one that obeys the paper's rules.
    servo_margin
        Errors of the tilt angles, each angle's its own, that the loop is proven to bear to within 0.5 %
        (:func:`gaitgraph.robustness.servo_margin`): a number [rad] or a text such as "15deg". 0 asks for none.
    weight
        Own cost of an edge, with the method "grid": see :func:`gaitgraph.graph.walks.closed_walk`.
    deadline
        With `any_order` and the exact method: seconds, of which half are for measuring the paths between waypoints;
        straight lines stand for those that are left. Of more than 100 waypoints the order is that of the nearest
        neighbours if too little time is left for a better one. A warning says so.
    progress
        Called with a line of text before each step of long work.

    Notes
    -----
    Infeasible is an answer, not an error: see `status` and `reason`. InputError is raised if the request is malformed.

    Examples
    --------
    >>> plan = plan_loop([("3pi/8", "-3pi/8"), ("3pi/8", "-pi/8"), ("pi/8", "-pi/8"), ("pi/8", "-3pi/8")])
    >>> plan.status, plan.loop.color, plan.report.flyable
    ('planned', 'red', True)
    >>> plan.gait.alpha.round(3).tolist()[0]
    [1.178, -1.178, 1.178, -1.178]
    """
    request = plan_request(
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
        require=require,
        servo_margin=servo_margin,
        weight=weight,
    )
    return plan(request, progress=progress, deadline=deadline)


def planned_gait(path: str | Path, stated: Mapping[str, Any]) -> TimedGait:
    """Return the gait that the request in a file asks for, some fields replaced; Infeasible if there is none."""
    request, sampling = read_request(path, stated)
    return plan(request).timed(**sampling)


def plan(
    request: PlanRequest,
    *,
    progress: Progress | None = None,
    deadline: float | None = None,
) -> Plan:
    """Answer a request; see :func:`plan_loop`."""
    until = math.inf
    if deadline is not None:
        until = monotonic() + checked_number("deadline", deadline)
    search = Search(request, progress, until)
    flyable, refusals = _loops_of(search, "flyable")
    loops = _ranked(flyable)
    if request.require == "valid":
        valid, refusals = _loops_of(search, "valid")
        loops = _ranked(flyable + valid)
    if loops and getattr(loops[0].report, request.require):
        return _planned(request, loops, refusals)
    if loops:
        # What no region knows, such as a period that is too short for the vehicle's limits.
        best = loops[0]
        refusals = [_refusal_of(best, best.report.reason)]
    refused = _refused(request, refusals)
    if request.require == "valid" or request.vehicle.asymmetry is not None:
        return refused
    advice, others = _other_loops(search, flyable)
    if not others:
        return refused
    return replace(refused, advice=advice, alternatives=tuple(others))


def _loops_of(search: Search, require: Requirement) -> tuple[list[Loop], list[Refusal]]:
    """Return the loops of all branches, and why the other branches have none."""
    loops: list[Loop] = []
    refusals: list[Refusal] = []
    method = any_angle_loop if search.request.method == "exact" else grid_loop
    for branch in search.branches(require):
        answer = branch.rootless() or method(branch)
        if isinstance(answer, Refusal):
            refusals.append(answer)
        elif branch.servo_margin and not answer.bears_servo_errors:
            refusals.append(_refusal_of(answer, _not_proven(answer)))
        elif search.request.reverse:
            loops.append(answer.reversed())
        else:
            loops.append(answer)
    return loops, refusals


def _refusal_of(loop: Loop, reason: str | None) -> Refusal:
    """Return that a loop cannot fly, for a reason that only the loop shows."""
    message = f"{loop.color}, {RELATION[loop.sign]}: {reason}"
    return Refusal(color="red", sign=loop.sign, kind="limit", message=message)


def _not_proven(loop: Loop) -> str:
    """Return what errors of the servos a loop bears that is not proven to bear those of its request."""
    margin = loop.servo_margin
    asked = math.degrees(loop.request.servo_margin)
    text = "the best loop is not proven to bear errors of the servos of "
    text += f"{asked:.4g}°, but of {degrees_below(margin.proven)}"
    if margin.found is not None:
        text += f"; with {math.degrees(margin.found):.2f}° {margin.reason}"
    return text


def degrees_below(angle: float) -> str:
    """Return an angle in degrees, rounded down to one digit."""
    return f"{math.floor(10 * math.degrees(angle)) / 10:.1f}°"


def _other_loops(search: Search, flyable: list[Loop]) -> tuple[str, list[Loop]]:
    """Return the loops that are listed beside a refusal of what must be flyable, if there are any, and advice on them."""
    request = search.request
    if not request.servo_margin:
        # Those that only obey the paper's rules.
        valid, _ = _loops_of(search, "valid")
        return VALID_LOOPS.python, _ranked(flyable + valid)
    # Those that keep less than the servo margin.
    others = plan(replace(request, servo_margin=0.0), progress=search.progress)
    if others.loop is None:
        return "", []
    loops = [others.loop, *others.alternatives]
    most = max(loop.servo_margin.proven for loop in loops)
    advice = f"without a servo margin there are loops, which bear errors of {degrees_below(most)} at most"
    return advice, loops


def _preference(loop: Loop) -> tuple[Any, ...]:
    """Order loops: flyable first, then flyable but for tilt rates, then valid, then by the objective."""
    report = loop.report
    broken = {check.name for check in report.checks if check.mark != "ok"}
    robustness = 0.0
    if loop.request.objective == "robust":
        robustness = round(report["least_singular_value"].value or 0.0, 3)
    return (
        not report.flyable,
        not broken <= set(RATE_CHECKS),
        not report.valid,
        -robustness,
        round(loop.length if loop.cost is None else loop.cost, 9),
        loop.color != "red",
        loop.sign != "positive",
    )


def _ranked(loops: Sequence[Loop]) -> list[Loop]:
    """Return loops in order of preference, each path once, as it was found first."""
    kept: dict[bytes, Loop] = {}
    for loop in loops:
        kept.setdefault(loop.path.alpha.tobytes(), loop)
    return sorted(kept.values(), key=_preference)


def _planned(
    request: PlanRequest, loops: Sequence[Loop], refusals: Sequence[Refusal]
) -> Plan:
    """Return the plan with the first of some loops."""
    best = loops[0]
    waypoints = tuple(request.waypoints[k] for k in best.order)
    reason = None
    if not best.report.flyable:
        reason = f"no loop through these waypoints is flyable: {best.report.reason}"
    return Plan(
        request=request,
        loop=best,
        reason=reason,
        waypoints=waypoints,
        alternatives=tuple(loops[1:]),
        refusals=tuple(refusals),
        warnings=(*request.notes, *_warnings_of(best, waypoints)),
    )


def _refused(request: PlanRequest, refusals: Sequence[Refusal]) -> Plan:
    """Return the plan without a loop; the refusal that the shortest moves of waypoints remove comes first."""

    def moves(refusal: Refusal) -> float:
        if not refusal.moved:
            return math.inf
        return sum(map(math.dist, refusal.moved, request.waypoints))

    told = sorted([with_nearest(one, request) for one in refusals], key=moves)
    kind = "flyable" if request.require == "flyable" else "closed"
    messages = dict.fromkeys(refusal.message for refusal in told)
    return Plan(
        request=request,
        loop=None,
        reason=f"no {kind} loop: {'; '.join(messages)}",
        waypoints=request.waypoints,
        refusals=tuple(told),
        warnings=request.notes,
    )


def _warnings_of(loop: Loop, waypoints: Sequence[Point]) -> list[str]:
    """Return what a user should know of a loop through waypoints, in the order in which it visits them."""
    warnings = []
    if len(waypoints) == 1:
        warnings.append(_POSTURE)
    is_ordered = not loop.request.any_order and len(waypoints) > 3
    if is_ordered and not shapely.is_simple(shapely.linearrings(waypoints)):
        warnings.append(
            "the loop crosses itself; the same waypoints in any order may give a shorter one"
        )
    if not loop.in_time:
        warnings.append(_LATE)
    elif not loop.order_exact:
        warnings.append(_APPROXIMATE)
    warnings += loop.report.warnings
    if loop.report.reachability and not loop.report.reachable_from_hover:
        warnings.append(loop.report.reachability)
    return warnings
