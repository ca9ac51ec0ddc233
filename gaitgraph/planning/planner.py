"""Plan a gait: search loops for each color and sign of R, check them as any gait, and return the best one.

A plan returns a flyable loop, or with ``require="valid"`` the best that obeys the paper's rules: flyable first, then
valid, then by the objective. The other loops are alternatives, with their verdicts. If there is none, the plan lists
the obstacles.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field, replace
from functools import cache, cached_property
from itertools import groupby
from textwrap import fill
from typing import TYPE_CHECKING, Any

import shapely

from gaitgraph.errors import Advice, Infeasible
from gaitgraph.gait.table import RATE_CHECKS
from gaitgraph.graph.walks import MOST_ANY_ORDER
from gaitgraph.pictured import Pictured
from gaitgraph.planning.any_angle import any_angle_paths, with_nearest
from gaitgraph.planning.grid import grid_paths, request_graph
from gaitgraph.planning.refusal import FoundPath, Obstacle, branches_of
from gaitgraph.planning.request import PlanRequest, plan_request, read_request
from gaitgraph.surface.sheets import RELATION
from gaitgraph.timing.timed_gait import TimedGait
from gaitgraph.validation.report import verdict_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence
    from pathlib import Path

    import networkx as nx

    from gaitgraph.gait.gait import Gait
    from gaitgraph.invertibility.coefficients import CoefficientsLike
    from gaitgraph.planning.request import Method, Objective, Point, Requirement
    from gaitgraph.surface.region import Points
    from gaitgraph.surface.sheets import ColorChoice, Sign, SignChoice
    from gaitgraph.timing.laws import LawName
    from gaitgraph.validation.report import Report
    from gaitgraph.vehicle import VehicleLike

_WIDTH = 110
# A plan without a loop as plain values, in the order in which files have them.
_NO_LOOP: dict[str, Any] = {
    **dict.fromkeys(("status", "reason", "advice", "color", "sign", "waypoints")),
    **{name: [] for name in ("path", "types", "colors")},
    **dict.fromkeys(("length", "lower_bound", "order_exact")),
    **{name: [] for name in ("corners", "vertices", "alternatives")},
    **verdict_of(None),
    **{
        name: []
        for name in (
            "warnings",
            "obstacles",
            "crossing_tolerance",
            "method",
            "request",
        )
    },
}
VALID_LOOPS = Advice(
    "for a loop that obeys only the paper's rules, use require='valid'",
    "for a loop that obeys only the paper's rules, use --require valid",
)
_APPROXIMATE = (
    f"the order of the waypoints is approximate: beyond {MOST_ANY_ORDER} waypoints not all orders are tried, "
    "and another one may make a shorter loop"
)
_POSTURE = "the plan is a single posture, not a gait; for a gait, give two or more different waypoints"


@dataclass(frozen=True, kw_only=True)
class Loop:
    """One closed loop on the surface with its verdict.

    `path` is a gait through every node that the loop passes, the first not repeated; `order` has the waypoints of the
    `request`, counted from 0, in the order in which the loop visits them. `lower_bound`, of an any-angle loop, is a
    lower bound of the length of all loops through these waypoints in this order, in the required region [rad]. With
    `any_order` no other order makes a shorter loop if `order_exact`; otherwise the order is approximate.
    """

    path: Gait
    sign: Sign
    order: tuple[int, ...]
    request: PlanRequest
    lower_bound: float | None
    judged: tuple[Gait, Report] | None = field(default=None, compare=False)

    @cached_property
    def gait(self) -> Gait:
        """The same loop with straight runs merged."""
        return self.judged[0] if self.judged else self.path.merged()

    @cached_property
    def report(self) -> Report:
        """All checks, with those of tilt rates."""
        report = (
            self.judged[1] if self.judged else self.gait.check(floor=self.request.floor)
        )
        timed = TimedGait(
            gait=self.gait, period=self.request.period, law=self.request.law, samples=1
        )
        return report.with_timing(timed)

    @property
    def color(self) -> str:
        """The loop's color: "red" or "blue"."""
        return str(self.gait.color)

    @property
    def length(self) -> float:
        """Length in the (α1, α2) plane [rad]."""
        return self.path.length

    @property
    def order_exact(self) -> bool:
        """Whether the order is as requested, or the shortest of all that were tried: up to nine waypoints."""
        return not self.request.any_order or len(self.order) <= MOST_ANY_ORDER

    def as_mapping(self) -> dict[str, Any]:
        """Return the loop as plain values, ready for JSON."""
        return {
            "color": self.color,
            "sign": self.sign,
            "method": self.request.method,
            "path": self.path.alpha.tolist(),
            "types": list(self.path.types),
            "colors": list(self.path.colors),
            "length": self.length,
            "lower_bound": self.lower_bound,
            "order_exact": self.order_exact,
            "corners": self.gait.alpha.tolist(),
            "vertices": self.path.vertices().tolist(),
            **verdict_of(self.report),
        }

    @property
    def _verdict(self) -> str:
        if self.report.flyable:
            return "flyable"
        return (
            "obeys the paper's rules, cannot fly"
            if self.report.valid
            else "breaks the paper's rules"
        )

    def __repr__(self) -> str:
        return f"<Loop: {self.color}, {RELATION[self.sign]}, {self.gait.size_text}, {self._verdict}>"

    def __str__(self) -> str:
        broken = [
            check.name.replace("_", " ")
            for check in self.report.checks
            if check.mark != "ok"
        ]
        why = "" if self.report.flyable else f" ({', '.join(broken)})"
        return f"{self.color}, {RELATION[self.sign]}, {self.length:.4f} rad: {self._verdict}{why}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan(Pictured):
    """The answer to a request: a loop, or the reason why there is none. Truthy when there is one.

    `reason` says why there is no loop, or why the chosen one is not flyable; None if it is. `advice` says how to ask for
    a loop that only obeys the paper's rules, where there is one and no flyable one; else it is None. `waypoints` are in the
    order in which the loop passes them [rad]. `alternatives` are other loops through the same waypoints, with their
    verdicts: those that cannot fly only if there is no other, or if the request does not require it. `obstacles` has
    one for each color and sign without a loop; without any loop the first is the one that the shortest moves of
    waypoints remove.
    """

    request: PlanRequest
    loop: Loop | None
    reason: str | None
    waypoints: tuple[Point, ...]
    alternatives: tuple[Loop, ...] = ()
    obstacles: tuple[Obstacle, ...] = ()
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
            raise Infeasible("; ".join(filter(None, (self.reason, self.advice))))
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
        return {
            **_NO_LOOP,
            **(self.loop.as_mapping() if self.loop else {}),
            "status": self.status,
            "reason": self.reason,
            "advice": self.advice,
            "waypoints": [list(point) for point in self.waypoints],
            "alternatives": [other.as_mapping() for other in self.alternatives],
            "warnings": list(self.warnings),
            "obstacles": [asdict(obstacle) for obstacle in self.obstacles],
            "crossing_tolerance": math.pi / (2 * self.request.divisions),
            "method": self.request.method,
            "request": self.request.as_mapping(),
        }

    def __str__(self) -> str:
        def items(texts: Iterable[object]) -> list[str]:
            return [
                fill(str(text), _WIDTH, initial_indent="  ", subsequent_indent="    ")
                for text in texts
            ]

        request, vehicle = self.request, self.request.vehicle
        method = (
            "any-angle method"
            if request.method == "exact"
            else f"grid of {request.divisions} divisions"
        )
        body = f"vehicle {vehicle.name} (κ = {vehicle.drag_ratio:.4f})"
        conditions = f"{body}, {request.coefficients} coefficients, {method}"
        if self.loop is None:
            what = "flyable gait" if request.require == "flyable" else "gait"
            lines = [f"No {what} through these waypoints."]
            if any(one.kind == "waypoint" for one in self.obstacles):
                lines[0] += " All must be admissible with one color and sign of R:"
            lines += items(dict.fromkeys(one.message for one in self.obstacles))
            lines += [
                *([f"F{self.advice[1:]}."] if self.advice else []),
                conditions,
            ]
        else:
            loop, report, corners = (
                self.loop,
                self.loop.report,
                self.loop.gait.corner_lines,
            )
            head = f"Planned a {loop.color} gait, {RELATION[loop.sign]}: {loop.gait.size_text}"
            lines = [
                f"{head}, T = {request.period:g} s, {request.law}",
                conditions,
                "",
                *corners,
                "",
            ]
            if not loop.length:
                lines[0] = f"{_POSTURE[0].upper()}{_POSTURE[1:]}"
            lines += report.lines
        if self.alternatives:
            lines += ["", "alternatives", *items(self.alternatives)]
        # What is said above is not said again.
        stated = (
            {_POSTURE, *(check.message for check in self.loop.report.checks)}
            if self.loop
            else ()
        )
        shown = [
            f"warning: {warning}" for warning in self.warnings if warning not in stated
        ]
        return "\n".join([*lines, *([""] if shown else []), *shown])

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
    progress: Callable[[str], None] | None = None,
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
        default the grid if `divisions` are given, else exact.
    accuracy
        With the method "exact": largest distance from a curved border to the polygon inside it [rad], 1e-9 to 0.1.
    period, law
        Period [s] and timing law with which tilt rates are checked; see :meth:`gaitgraph.gait.gait.Gait.parametrize`.
    floor
        Least singular value that a flyable loop keeps, dimensionless.
    require
        "flyable": a loop that can fly, or none; "valid": if none can fly, one that obeys the paper's rules.
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
    )
    return plan(request, progress=progress)


def planned_gait(path: str | Path, stated: Mapping[str, Any]) -> TimedGait:
    """Return the gait that the request in a file asks for, some fields replaced; Infeasible if there is none."""
    request, sampling = read_request(path, stated)
    return plan(request).timed(**sampling)


def plan(
    request: PlanRequest, *, progress: Callable[[str], None] | None = None
) -> Plan:
    """Answer a request; see :func:`plan_loop`."""
    graph_of = cache(lambda sign: request_graph(request, sign, progress))
    uses: tuple[Requirement, ...] = (
        ("flyable",) if request.require == "flyable" else ("flyable", "valid")
    )
    found = _answer(request, uses, graph_of, progress)
    if found or request.require == "valid":
        return found
    # Loops that only obey the paper's rules are listed beside the refusal. Flyable regions are not searched again,
    # unless they have a loop that breaks a limit.
    uses = (
        ("flyable", "valid")
        if any(one.kind == "limit" for one in found.obstacles)
        else ("valid",)
    )
    other = _answer(replace(request, require="valid"), uses, graph_of, progress)
    if other.loop is None:
        return found
    loops = (other.loop, *other.alternatives)
    return replace(found, advice=VALID_LOOPS.python, alternatives=loops)


def _warnings_of(loop: Loop, waypoints: Sequence[Point]) -> list[str]:
    """Return what a user should know of a loop through waypoints, in the order in which it visits them."""
    warnings = []
    if len(loop.gait.alpha) == 1:
        warnings.append(_POSTURE)
    if (
        len(waypoints) > 3
        and not loop.request.any_order
        and not shapely.is_simple(shapely.linearrings(waypoints))
    ):
        warnings.append(
            "the loop crosses itself; the same waypoints in any order may give a shorter one"
        )
    if not loop.order_exact:
        warnings.append(_APPROXIMATE)
    warnings += loop.report.warnings
    if not loop.report.reachable_from_hover:
        warnings.append(loop.report.reachability)
    return warnings


def _answer(
    request: PlanRequest,
    uses: tuple[Requirement, ...],
    graph_of: Callable[[Sign], nx.Graph[Any]],
    progress: Callable[[str], None] | None,
) -> Plan:
    """Return the best loop that meets what a request requires, or the obstacles."""
    loops: list[Loop] = []
    obstacles: list[Obstacle] = []

    def loop_of(found: FoundPath, sign: Sign) -> Loop:
        path, order, bound, judged = found
        if request.reverse:
            path, order, judged = path.reversed(), (order[0], *order[:0:-1]), None
        return Loop(
            path=path,
            sign=sign,
            order=order,
            request=request,
            lower_bound=bound,
            judged=judged,
        )

    for sign, group in groupby(
        branches_of(request, uses), key=lambda branch: branch.sign
    ):
        branches = list(group)
        if request.method == "exact":
            answers = [any_angle_paths(branch, progress) for branch in branches]
        else:
            answers = grid_paths(branches, graph_of, progress)
        for answer in answers:
            if isinstance(answer, Obstacle):
                obstacles.append(answer)
            else:
                loops += [loop_of(found, sign) for found in answer]
    loops.sort(key=_preference)
    is_refused = request.require == "flyable" and not (
        loops and loops[0].report.flyable
    )
    if is_refused and loops:
        # What no region knows, such as a period that is too short for the vehicle's limits.
        message = (
            f"{loops[0].color}, {RELATION[loops[0].sign]}: {loops[0].report.reason}"
        )
        obstacles = [
            Obstacle(color="red", sign=loops[0].sign, kind="limit", message=message)
        ]
    reason, waypoints, warnings = None, request.waypoints, [*request.notes]
    if is_refused or not loops:
        obstacles = [with_nearest(obstacle, request) for obstacle in obstacles]
        obstacles.sort(
            key=lambda one: (
                sum(map(math.dist, one.moved, waypoints)) if one.moved else math.inf
            )
        )
        kind = "flyable" if is_refused else "closed"
        reason = f"no {kind} loop: {'; '.join(dict.fromkeys(obstacle.message for obstacle in obstacles))}"
        loops = []
    else:
        report = loops[0].report
        waypoints = tuple(waypoints[k] for k in loops[0].order)
        warnings += _warnings_of(loops[0], waypoints)
        if not report.flyable:
            reason = f"no loop through these waypoints is flyable: {report.reason}"
    return Plan(
        request=request,
        loop=loops[0] if loops else None,
        reason=reason,
        waypoints=waypoints,
        alternatives=tuple(loops[1:]),
        obstacles=tuple(obstacles),
        warnings=tuple(warnings),
    )


def _preference(loop: Loop) -> tuple[Any, ...]:
    """Order loops: flyable first, then flyable but for tilt rates, then valid, then by the objective."""
    report = loop.report
    timeless = all(
        check.mark == "ok" for check in report.checks if check.name not in RATE_CHECKS
    )
    return (
        not report.flyable,
        not timeless,
        not report.valid,
        -round(report["least_singular_value"].value or 0.0, 3)
        if loop.request.objective == "robust"
        else 0.0,
        round(loop.length, 9),
        loop.color != "red",
        loop.sign != "positive",
    )
