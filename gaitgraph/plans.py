"""What a plan answers: loops with their verdicts, obstacles as certificates of a refusal, and the plan itself."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Literal

from gaitgraph.errors import Infeasible
from gaitgraph.timing import TimedGait, parametrize

if TYPE_CHECKING:
    from gaitgraph.gait import Gait
    from gaitgraph.reports import Report
    from gaitgraph.requests import PlanRequest, Point

__all__ = ["Loop", "Obstacle", "Plan"]


@dataclass(frozen=True, slots=True, kw_only=True)
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
    report
        All checks, with those of the clock.
    """

    path: Gait
    gait: Gait
    sign: str
    order: tuple[int, ...]
    report: Report

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
            "path": self.path.alpha.tolist(),
            "types": list(self.path.types),
            "colors": list(self.path.colors),
            "length": self.length,
            "corners": self.gait.alpha.tolist(),
            "vertices": self.path.vertices().tolist(),
            **{key: verdict[key] for key in ("valid", "two_color", "flyable", "reachable_from_hover", "checks")},
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class Obstacle:
    """Why one color and sign of R has no loop: the certificate of a refusal.

    Parameters
    ----------
    color, sign
        What was tried.
    kind
        "waypoint": a waypoint has no root of this color and sign (or lies where the request forbids it);
        "separated": two waypoints cannot be joined; "color": the color does not exist.
    message
        What is in the way.
    waypoints
        The numbers of the waypoints concerned, from 1.
    R
        For "waypoint": the value of R there.
    components
        For "separated": how many graph nodes can be reached from each of the two waypoints.
    """

    color: str
    sign: str
    kind: Literal["waypoint", "separated", "color"]
    message: str
    waypoints: tuple[int, ...] = ()
    R: float | None = None
    components: tuple[int, ...] = ()


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
        return self.loop.gait

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
            "method": self.request.method,
            "request": request,
        }

    def __str__(self) -> str:
        from gaitgraph.summary import text_of_plan

        return text_of_plan(self)
