"""Plan a gait: search loops for each color and sign of R, judge them, and answer with the best one.

Loops are judged as any gait is. The best is flyable, then valid, then what the objective prefers; every other loop
stays as an alternative with its verdict. When nothing is found the plan says what is in the way.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from itertools import groupby
from textwrap import fill
from typing import TYPE_CHECKING, Any

from gaitgraph.errors import Infeasible, InputError
from gaitgraph.graph.build import vehicle_and_coefficients
from gaitgraph.graph.walks import note_on_gap
from gaitgraph.invertibility.matrices import DEFAULT_FLOOR, Kind
from gaitgraph.planning.any_angle import any_angle_paths, with_nearest
from gaitgraph.planning.grid import grid_paths, notes_beside_the_grid
from gaitgraph.planning.refusal import FoundPath, Obstacle, branches_of
from gaitgraph.planning.request import PlanRequest, plan_request
from gaitgraph.surface.sheets import RELATION
from gaitgraph.timing.laws import DEFAULT_LAW, LawName
from gaitgraph.validation.report import RATE_CHECKS, lines_of_checks
from gaitgraph.vehicle import PAPER, Vehicle

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence
    from pathlib import Path

    import networkx as nx

    from gaitgraph.gait.gait import Gait
    from gaitgraph.planning.request import Method, Objective, Point
    from gaitgraph.surface.region import Points
    from gaitgraph.surface.sheets import ColorChoice, Sign, SignChoice
    from gaitgraph.timing.timed_gait import TimedGait
    from gaitgraph.validation.report import Report

_WIDTH = 110
# A plan without a loop as plain values, in the order in which files have them.
_NO_LOOP: dict[str, Any] = {
    **dict.fromkeys(("status", "reason", "color", "sign", "waypoints")),
    **{name: [] for name in ("path", "types", "colors")},
    **dict.fromkeys(("length", "lower_bound", "order_gap")),
    **{name: [] for name in ("corners", "vertices", "alternatives")},
    **dict.fromkeys(("valid", "two_color", "flyable", "reachable_from_hover"), False),
    **{name: [] for name in ("checks", "warnings", "obstacles", "crossing_tolerance", "method", "request")},
}
_FINE = 1e-7  # accuracy for which curved borders have so many corners that it takes a while [rad]


@dataclass(frozen=True, kw_only=True)
class Loop:
    """One closed loop on the surface with its verdict.

    `path` is a gait through every node that the loop passes, the first not repeated; `order` has the waypoints of the
    `request`, counted from 0, in the order in which the loop visits them. `lower_bound`, of an any-angle loop, is a
    length that no loop through these waypoints in this order falls below, in the region that was asked of it [rad].
    With `any_order` the loop is at most `order_gap` times the shortest one longer than that, whatever the order.
    """

    path: Gait
    sign: Sign
    order: tuple[int, ...]
    request: PlanRequest
    lower_bound: float | None
    order_gap: float

    @cached_property
    def gait(self) -> Gait:
        """The same loop with straight runs merged."""
        return self.path.merged()

    @cached_property
    def report(self) -> Report:
        """All checks, with those of the clock; judged when first asked for."""
        return self.gait.parametrize(self.request.period, law=self.request.law).check(floor=self.request.floor)

    @property
    def is_judged(self) -> bool:
        """Whether the report is there already."""
        return "report" in vars(self)

    @property
    def color(self) -> str:
        """The loop's color: "red", "blue" or "mixed"."""
        return str(self.gait.color)

    @property
    def length(self) -> float:
        """Length in the (α1, α2) plane [rad]."""
        return self.path.length

    def as_mapping(self) -> dict[str, Any]:
        """Return the loop as plain values, ready for JSON."""
        verdict = self.report.as_mapping()
        return {
            "color": self.color,
            "sign": self.sign,
            "method": self.request.method,
            "path": self.path.alpha.tolist(),
            "types": list(self.path.types),
            "colors": list(self.path.colors),
            "length": self.length,
            "lower_bound": self.lower_bound,
            "order_gap": self.order_gap,
            "corners": self.gait.alpha.tolist(),
            "vertices": self.path.vertices().tolist(),
            **{key: verdict[key] for key in ("valid", "two_color", "flyable", "reachable_from_hover", "checks")},
        }

    @property
    def _verdict(self) -> str:
        return "flyable" if self.report.flyable else "valid, not flyable" if self.report.valid else "not valid"

    @property
    def corners(self) -> str:
        """How many corners the gait has, as a text."""
        count = len(self.gait.alpha)
        return f"{count} corner{'s' * (count > 1)}"

    def __repr__(self) -> str:
        return f"<Loop: {self.color}, {RELATION[self.sign]}, {self.corners}, {self.length:.4f} rad, {self._verdict}>"

    def __str__(self) -> str:
        broken = [check.name.replace("_", " ") for check in self.report.checks if check.mark != "ok"]
        why = "" if self.report.flyable else f" ({', '.join(broken)})"
        return f"{self.color}, {RELATION[self.sign]}, {self.length:.4f} rad: {self._verdict}{why}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """The answer to a request: a loop, or the reason why there is none. Truthy when there is one.

    `reason` says why there is no loop, or why the chosen one is not flyable; None if it is. `waypoints` are in the
    order in which the loop passes them [rad]. `alternatives` are other loops through the same waypoints, with their
    verdicts; `obstacles` what is in the way of each color and sign that has no loop.
    """

    request: PlanRequest
    loop: Loop | None
    reason: str | None
    waypoints: tuple[Point, ...]
    alternatives: tuple[Loop, ...] = ()
    obstacles: tuple[Obstacle, ...] = ()
    warnings: tuple[str, ...] = ()

    @property
    def status(self) -> str:
        """Whether the plan is "planned" or "infeasible"."""
        return "infeasible" if self.loop is None else "planned"

    def __bool__(self) -> bool:
        return self.loop is not None

    @property
    def _found(self) -> Loop:
        if self.loop is None:
            raise Infeasible(self.reason)
        return self.loop

    @property
    def gait(self) -> Gait:
        """The planned gait, straight runs merged; raises Infeasible, with the plan's reason, if there is none."""
        return replace(self._found.gait, request=self.request.as_mapping())

    @property
    def report(self) -> Report:
        """All checks of the planned gait; raises Infeasible if there is none."""
        return self._found.report

    def timed(self, *, samples: int | None = None, rate: float | None = None) -> TimedGait:
        """Return the planned gait with the request's clock; raises Infeasible if there is none."""
        return self.gait.parametrize(self.request.period, law=self.request.law, samples=samples, rate=rate)

    def as_mapping(self) -> dict[str, Any]:
        """Return the plan as plain values, ready for JSON."""
        return {
            **_NO_LOOP,
            **(self.loop.as_mapping() if self.loop else {}),
            "status": self.status,
            "reason": self.reason,
            "waypoints": [list(point) for point in self.waypoints],
            "alternatives": [other.as_mapping() for other in self.alternatives],
            "warnings": list(self.warnings),
            "obstacles": [asdict(obstacle) for obstacle in self.obstacles],
            "crossing_tolerance": math.pi / (2 * self.request.divisions),
            "method": self.request.method,
            "request": self.request.as_mapping(),
        }

    def __str__(self) -> str:
        def items(texts: Iterable[object], indent: str = "  ") -> list[str]:
            return [fill(str(text), _WIDTH, initial_indent=indent, subsequent_indent=indent + "  ") for text in texts]

        request, vehicle = self.request, self.request.vehicle
        method = "any angle" if request.method == "exact" else f"{request.divisions} divisions"
        body = f"vehicle {vehicle.name} (κ = {vehicle.drag_ratio:.4f})"
        conditions = f"{body}, {request.coefficients} coefficients, {method}"
        if self.loop is None:
            lines = ["No gait.", *items(dict.fromkeys(obstacle.message for obstacle in self.obstacles)), conditions]
        else:
            loop, report, corners = self.loop, self.loop.report, self.loop.gait.corner_lines()
            head = f"Planned a {loop.color} gait, {RELATION[loop.sign]}: {loop.corners}, {loop.length:.4f} rad around"
            lines = [f"{head}, T = {request.period:g} s, {request.law}", conditions, "", *corners, ""]
            lines += [report.verdict]
            lines += lines_of_checks(report.checks)
        if self.alternatives:
            lines += ["", "alternatives", *items(self.alternatives)]
        # What a check says already is not said again.
        stated = self.loop.report.warnings if self.loop else ()
        shown = [f"warning: {warning}" for warning in self.warnings if warning not in stated]
        return "\n".join([*lines, *([""] if shown else []), *items(shown, "")])

    def __repr__(self) -> str:
        count, vehicle = len(self.waypoints), self.request.vehicle.name
        answer = "infeasible" if self.loop is None else repr(self.loop)
        return f"<Plan: {answer} through {count} waypoint{'s' * (count != 1)}, vehicle {vehicle!r}>"

    def _repr_html_(self) -> str:
        from gaitgraph.plots.notebook import html_of

        return html_of(self)


def plan_loop(
    waypoints: Points,
    *,
    color: ColorChoice = "auto",
    sign: SignChoice = "auto",
    objective: Objective = "shortest",
    divisions: int | None = None,
    vehicle: Vehicle | str | Path | Mapping[str, Any] = PAPER,
    coefficients: Kind | None = None,
    keep_out: Sequence[Points] = (),
    keep_in: Sequence[Points] = (),
    any_order: bool = False,
    reverse: bool = False,
    method: Method | None = None,
    accuracy: float = 1e-6,
    period: float = 1.0,
    law: LawName = DEFAULT_LAW,
    floor: float = DEFAULT_FLOOR,
    graph: nx.Graph[Any] | None = None,
    progress: Callable[[str], None] | None = None,
) -> Plan:
    """Plan a closed gait through (α1, α2) waypoints, in order and back to the first.

    Parameters
    ----------
    waypoints
        (α1, α2) pairs in [−π/2, π/2], numbers [rad] or texts such as "3pi/8"; the loop passes through them exactly.
        Waypoints that repeat in a row are merged. One plans a gait that is a point, two an out-and-back gait.
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
        "published", "exact", or None: published for the paper's own vehicle, exact for any other.
    keep_out, keep_in
        Polygons in the (α1, α2) plane, lists of (α1, α2).
    any_order
        Visit the waypoints in the order that makes the shortest loop: exact up to nine, beyond the best order found,
        with a proven bound of how much longer it is (:func:`gaitgraph.graph.walks.best_order`).
    reverse
        Run the loop in the other direction.
    method
        "exact": any-angle loops, the shortest there are; "grid": the paper's grid graph. By default the grid if
        `divisions` are given, else exact.
    accuracy
        With the method "exact": how far the polygon of a curved border may stay inside it [rad], 1e-9 to 0.1.
    period, law
        The clock with which tilt rates are judged; see :meth:`gaitgraph.gait.gait.Gait.parametrize`.
    floor
        Least singular value that a flyable loop keeps, dimensionless.
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
        choices = {"divisions": divisions, "method": method, "coefficients": coefficients}
        stated = {name: value is not None for name, value in choices.items()}
        stated |= {"sign": sign != "auto", "vehicle": vehicle is not PAPER, "floor": floor != DEFAULT_FLOOR}
        stated |= {"keep_out": len(keep_out) > 0, "keep_in": len(keep_in) > 0}
        if any(stated.values()):
            name = next(name for name, is_stated in stated.items() if is_stated)
            raise InputError(f"{name} must not be stated beside a graph, which fixes it")
        vehicle, numbers = vehicle_and_coefficients(graph)
        sign, divisions, floor = (graph.graph[name] for name in ("sign", "divisions", "floor"))
        coefficients, method = numbers.kind, "grid"
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
    )
    return plan(request, graph=graph, progress=progress)


def plan(
    request: PlanRequest, *, graph: nx.Graph[Any] | None = None, progress: Callable[[str], None] | None = None
) -> Plan:
    """Answer a request; see :func:`plan_loop`."""
    exact = request.method == "exact"
    loops: list[Loop] = []
    broken: list[Loop] = []
    obstacles: list[Obstacle] = []

    def loop_of(found: FoundPath, sign: Sign) -> Loop:
        path, order, bound, gap = found
        if request.reverse:
            path, order = path.reversed(), (order[0], *order[:0:-1])
        return Loop(path=path, sign=sign, order=order, request=request, lower_bound=bound, order_gap=gap)

    for sign, group in groupby(branches_of(request), key=lambda branch: branch.sign):
        branches = list(group)
        if exact:
            if progress is not None and request.accuracy < _FINE:
                progress(f"drawing regions to {request.accuracy:g} rad, which takes a while")
            answers, jumping = [any_angle_paths(branch, progress) for branch in branches], None
        else:
            answers, jumping = grid_paths(branches, graph, progress)
        for answer in answers:
            if isinstance(answer, Obstacle):
                obstacles.append(answer)
            else:
                loops += [loop_of(found, sign) for found in answer]
        if jumping is not None:
            broken.append(loop_of(jumping, sign))
    # Only red can be flyable. A single loop that is not red comes after red ones that all are, whatever its checks say,
    # so that it is judged only when somebody asks.
    rest = [loop for loop in loops if loop.color != "red"]
    loops = sorted((loop for loop in loops if loop.color == "red"), key=_preference)
    judged = len(rest) > 1 or not all(loop.report.flyable for loop in loops)
    loops = sorted(loops + rest, key=_preference) if judged else loops + rest
    # A loop that jumps is stated if it is shorter than what does not.
    shortest = min((loop.length for loop in loops), default=math.inf)
    broken = [loop for loop in broken if loop.length < shortest - 1e-9]
    reason, waypoints, warnings = None, request.waypoints, [*request.notes]
    if loops:
        report = loops[0].report
        waypoints = tuple(waypoints[k] for k in loops[0].order)
        gap = loops[0].order_gap
        warnings += [*([] if exact else notes_beside_the_grid(request)), *([note_on_gap(gap)] if gap else [])]
        warnings += report.warnings
        if not report.reachable_from_hover:
            warnings.append(report.reachability)
        if not report.flyable:
            reason = f"no loop through these waypoints is flyable: {report.reason}"
    else:
        if exact:
            obstacles = [with_nearest(obstacle, request) for obstacle in obstacles]
        reason = "no closed loop: " + "; ".join(dict.fromkeys(obstacle.message for obstacle in obstacles))
    return Plan(
        request=request,
        loop=loops[0] if loops else None,
        reason=reason,
        waypoints=waypoints,
        alternatives=(*loops[1:], *broken),
        obstacles=tuple(obstacles),
        warnings=tuple(warnings),
    )


def _preference(loop: Loop) -> tuple[Any, ...]:
    """Order loops: flyable first, then flyable but for the clock, then valid, then by the objective."""
    report = loop.report
    timeless = all(check.mark == "ok" for check in report.checks if check.name not in RATE_CHECKS)
    robustness = report["least_singular_value"].value or 0.0
    return (
        not report.flyable,
        not timeless,
        not report.valid,
        -round(robustness, 3) if loop.request.objective == "robust" else 0.0,
        round(loop.length, 9),
        loop.color != "red",
        loop.sign != "positive",
    )
