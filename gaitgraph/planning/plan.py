"""What a plan answers: loops with their verdicts, and the plan itself."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from textwrap import fill
from typing import TYPE_CHECKING, Any

from gaitgraph.errors import Infeasible
from gaitgraph.surface.sheets import RELATION
from gaitgraph.timing.timed_gait import TimedGait, parametrize
from gaitgraph.validation.report import lines_of_checks, verdict_line

if TYPE_CHECKING:
    from gaitgraph.gait.gait import Gait
    from gaitgraph.planning.refusal import Obstacle
    from gaitgraph.planning.request import PlanRequest, Point
    from gaitgraph.surface.sheets import Sign
    from gaitgraph.validation.report import Report

_WIDTH = 110


@dataclass(frozen=True, kw_only=True)
class Loop:
    """One closed loop on the surface with its verdict.

    Parameters
    ----------
    path
        Every node that the loop passes, in order, the first not repeated; a gait.
    gait
        The same loop with straight runs merged.
    sign
        Sign of R: "positive" or "negative".
    order
        The request's waypoints, counted from 0, in the order in which the loop visits them.
    request
        What it was sought for.
    lower_bound
        For an any-angle loop, a length that no loop through these waypoints in this order falls below, in the region
        that was asked of it [rad]; None on the grid.
    method
        How it was found: "exact" or "grid".
    """

    path: Gait
    gait: Gait
    sign: Sign
    order: tuple[int, ...]
    request: PlanRequest
    lower_bound: float | None
    method: str

    @cached_property
    def report(self) -> Report:
        """All checks, with those of the clock; judged when first asked for."""
        return parametrize(self.gait, self.request.period, law=self.request.law).check(floor=self.request.floor)

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
            "method": self.method,
            "path": self.path.alpha.tolist(),
            "types": list(self.path.types),
            "colors": list(self.path.colors),
            "length": self.length,
            "lower_bound": self.lower_bound,
            "corners": self.gait.alpha.tolist(),
            "vertices": self.path.vertices().tolist(),
            **{key: verdict[key] for key in ("valid", "two_color", "flyable", "reachable_from_hover", "checks")},
        }

    def __repr__(self) -> str:
        count = len(self.gait.alpha)
        verdict = "flyable" if self.report.flyable else "valid, not flyable" if self.report.valid else "not valid"
        return (
            f"<Loop: {self.color}, {RELATION[self.sign]}, {count} corner{'s' * (count > 1)}, "
            f"{self.length:.4f} rad, {verdict}>"
        )

    def __str__(self) -> str:
        head = f"{self.color}, {RELATION[self.sign]}, {self.length:.4f} rad"
        if self.report.flyable:
            return f"{head}: flyable"
        broken = [check.name.replace("_", " ") for check in self.report.checks if check.mark != "ok"]
        return f"{head}: {'valid, not flyable' if self.report.valid else 'not valid'} ({', '.join(broken)})"


def loop_of(
    path: Gait,
    order: tuple[int, ...],
    request: PlanRequest,
    sign: Sign,
    *,
    method: str,
    lower_bound: float | None = None,
) -> Loop:
    """Return the loop that a path makes, in the direction that the request asks for."""
    if request.reverse:
        path, order = path.reversed(), (order[0], *order[:0:-1])
    return Loop(
        path=path,
        gait=path.merged(),
        sign=sign,
        order=order,
        request=request,
        lower_bound=lower_bound,
        method=method,
    )


@dataclass(slots=True, kw_only=True)
class Candidates:
    """What the methods found: loops, two-color ones that jump, what was in the way, and notes in their order."""

    loops: list[Loop] = field(default_factory=list)
    broken: list[Loop] = field(default_factory=list)
    obstacles: list[Obstacle] = field(default_factory=list)
    notes: dict[str, None] = field(default_factory=dict)

    def note_heuristic_order(self, number: int) -> None:
        """Add the note on an order of waypoints that is not proven to be the best."""
        self.notes[
            f"order of {number} waypoints by Christofides' heuristic (networkx): the shortest loop in it is at most "
            "1.5 times the shortest in any order with this method, and not proven shortest"
        ] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """The answer to a request: a loop, or the reason why there is none. Truthy when there is one.

    Parameters
    ----------
    request
        What was asked.
    loop
        The chosen loop, or None.
    reason
        Why there is no loop, or why the chosen one is not flyable; None if it is.
    alternatives
        Other loops through the same waypoints, with their verdicts.
    obstacles
        What is in the way of each color and sign that has no loop.
    warnings
        What deserves attention.
    waypoints
        The waypoints in the order in which the loop passes them [rad].
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
        """The planned gait, straight runs merged.

        Raises
        ------
        Infeasible
            If the plan has none; the message is the plan's reason.
        """
        return replace(self._found.gait, request=self.request.as_mapping())

    @property
    def report(self) -> Report:
        """All checks of the planned gait; raises Infeasible if there is none."""
        return self._found.report

    def timed(self, *, samples: int | None = None, rate: float | None = None) -> TimedGait:
        """Return the planned gait with the request's clock; raises Infeasible if there is none."""
        return parametrize(self.gait, self.request.period, law=self.request.law, samples=samples, rate=rate)

    def as_mapping(self) -> dict[str, Any]:
        """Return the plan as plain values, ready for JSON."""
        loop = self.loop.as_mapping() if self.loop else {}
        return {
            "status": self.status,
            "reason": self.reason,
            "color": loop.get("color"),
            "sign": loop.get("sign"),
            "waypoints": [list(point) for point in self.waypoints],
            "path": loop.get("path", []),
            "types": loop.get("types", []),
            "colors": loop.get("colors", []),
            "length": loop.get("length"),
            "lower_bound": loop.get("lower_bound"),
            "corners": loop.get("corners", []),
            "vertices": loop.get("vertices", []),
            "alternatives": [other.as_mapping() for other in self.alternatives],
            "valid": loop.get("valid", False),
            "two_color": loop.get("two_color", False),
            "flyable": loop.get("flyable", False),
            "reachable_from_hover": loop.get("reachable_from_hover", False),
            "checks": loop.get("checks", []),
            "warnings": list(self.warnings),
            "obstacles": [asdict(obstacle) for obstacle in self.obstacles],
            "crossing_tolerance": math.pi / (2 * self.request.divisions),
            "method": self.request.method if self.loop is None else self.loop.method,
            "request": self.request.as_mapping(),
        }

    @property
    def headline(self) -> str:
        """What was planned, in one line."""
        request, loop = self.request, self.loop
        if loop is None:
            return "No gait."
        corners = len(loop.gait.alpha)
        return (
            f"Planned a {loop.color} gait, {RELATION[loop.sign]}: {corners} corner{'s' * (corners > 1)}, "
            f"{loop.length:.4f} rad around, T = {request.period:g} s, {request.law}"
        )

    @property
    def setting(self) -> str:
        """The vehicle, the coefficients and the method, in one line."""
        request, vehicle = self.request, self.request.vehicle
        method = "any angle" if (self.loop or request).method == "exact" else f"{request.divisions} divisions"
        return f"vehicle {vehicle.name} (κ = {vehicle.drag_ratio:.4f}), {request.coefficients} coefficients, {method}"

    def __str__(self) -> str:
        def item(text: str, indent: str = "  ") -> str:
            return fill(text, _WIDTH, initial_indent=indent, subsequent_indent=indent + "  ")

        if self.loop is None:
            reasons = dict.fromkeys(obstacle.message for obstacle in self.obstacles)
            lines = [self.headline, *map(item, reasons), self.setting]
            stated: tuple[str, ...] = ()
        else:
            report = self.loop.report
            lines = [self.headline, self.setting, "", *self.loop.gait.corner_lines(), ""]
            lines += [verdict_line(report.valid, report.flyable, report.reachable_from_hover)]
            lines += lines_of_checks(report.checks)
            stated = report.warnings
        if self.alternatives:
            lines += ["", "alternatives", *(item(str(other)) for other in self.alternatives)]
        # What a check says already is not said again.
        shown = [f"warning: {warning}" for warning in self.warnings if warning not in stated]
        if shown:
            lines += ["", *(item(warning, "") for warning in shown)]
        return "\n".join(lines)

    def __repr__(self) -> str:
        count, vehicle = len(self.waypoints), self.request.vehicle.name
        answer = "infeasible" if self.loop is None else repr(self.loop)
        return f"<Plan: {answer} through {count} waypoint{'s' * (count != 1)}, vehicle {vehicle!r}>"

    def _repr_html_(self) -> str:
        from gaitgraph.plots.notebook import html_of

        return html_of(self)
