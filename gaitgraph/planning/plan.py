"""What a plan answers: loops with their verdicts, candidates of a search, and the plan itself."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

from gaitgraph.errors import Infeasible
from gaitgraph.timing.timed_gait import TimedGait, parametrize

if TYPE_CHECKING:
    from gaitgraph.gait.gait import Gait
    from gaitgraph.planning.refusal import Obstacle
    from gaitgraph.planning.request import PlanRequest, Point
    from gaitgraph.validation.report import Report

__all__ = ["Candidates", "Loop", "Plan", "heuristic_order", "loop_of"]


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
    sign: str
    order: tuple[int, ...]
    request: PlanRequest
    lower_bound: float | None = None
    method: str = "grid"

    @cached_property
    def report(self) -> Report:
        """All checks, with those of the clock; judged when first asked for."""
        clock = self.request
        return parametrize(self.gait, clock.period, law=clock.law).check(floor=clock.floor)

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
            f"<Loop: {self.color}, R {'>' if self.sign == 'positive' else '<'} 0, {count} corner{'s' * (count > 1)}, "
            f"{self.length:.4f} rad, {verdict}>"
        )


@dataclass(slots=True, kw_only=True)
class Candidates:
    """What a method found: loops, what is two-color but jumps, what was in the way, and notes in their order."""

    loops: list[Loop] = field(default_factory=list)
    broken: list[Loop] = field(default_factory=list)
    obstacles: list[Obstacle] = field(default_factory=list)
    notes: dict[str, None] = field(default_factory=dict)

    def take(self, more: Candidates) -> None:
        """Append what another search found."""
        self.loops += more.loops
        self.broken += more.broken
        self.obstacles += more.obstacles
        self.notes |= more.notes


def loop_of(
    path: Gait,
    order: tuple[int, ...],
    request: PlanRequest,
    sign: str,
    *,
    lower_bound: float | None = None,
    method: str = "grid",
) -> Loop:
    """Return the loop that a path makes, in the direction that the request asks for."""
    if request.reverse:
        path, order = path.reversed(), (order[0], *order[:0:-1])
    gait = path.merged()
    return Loop(path=path, gait=gait, sign=sign, order=order, request=request, lower_bound=lower_bound, method=method)


def heuristic_order(number: int) -> str:
    """Return the note on an order of waypoints that is not proven to be the best."""
    return (
        f"order of {number} waypoints by Christofides' heuristic (networkx): the shortest loop in it is at most 1.5 "
        "times the shortest in any order with this method, and not proven shortest"
    )


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
    def gait(self) -> Gait:
        """The planned gait, straight runs merged.

        Raises
        ------
        Infeasible
            If the plan has none; the message is the plan's reason.
        """
        if self.loop is None:
            raise Infeasible(self.reason)
        return replace(self.loop.gait, request=self.request.as_mapping())

    @property
    def report(self) -> Report:
        """All checks of the planned gait; raises Infeasible if there is none."""
        if self.loop is None:
            raise Infeasible(self.reason)
        return self.loop.report

    def timed(self, *, samples: int | None = None, rate: float | None = None) -> TimedGait:
        """Return the planned gait with the request's clock; raises Infeasible if there is none."""
        return parametrize(self.gait, self.request.period, law=self.request.law, samples=samples, rate=rate)

    def as_mapping(self) -> dict[str, Any]:
        """Return the plan as plain values, ready for JSON."""
        loop = self.loop.as_mapping() if self.loop else {}
        found = self.loop is not None
        request = self.request.as_mapping()
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
            "reachable_from_hover": loop.get("reachable_from_hover", False if not found else None),
            "checks": loop.get("checks", []),
            "warnings": list(self.warnings),
            "obstacles": [asdict(obstacle) for obstacle in self.obstacles],
            "crossing_tolerance": math.pi / (2 * self.request.divisions),
            "method": self.request.method if self.loop is None else self.loop.method,
            "request": request,
        }

    def __str__(self) -> str:
        from gaitgraph.planning.summary import text_of_plan

        return text_of_plan(self)

    def __repr__(self) -> str:
        count, vehicle = len(self.waypoints), self.request.vehicle.name
        answer = "infeasible" if self.loop is None else repr(self.loop)
        return f"<Plan: {answer} through {count} waypoint{'s' * (count != 1)}, vehicle {vehicle!r}>"

    def _repr_html_(self) -> str:
        from gaitgraph.plots.showing import html_of_plan

        return html_of_plan(self)
