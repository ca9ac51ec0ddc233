"""A loop that a search has found: lifted to four angles, with its checks and its timing."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitgraph._lazy import cached_property
from gaitgraph.gait.gait import Gait
from gaitgraph.graph.walks import MOST_ANY_ORDER
from gaitgraph.invertibility.error_margins import (
    PROOF,
    bears_servo_errors,
    closest_servo_margin,
)
from gaitgraph.planning.request import PlanRequest
from gaitgraph.records import Record
from gaitgraph.surface.sheets import RELATION, Sign
from gaitgraph.validation.report import verdict_of

if TYPE_CHECKING:
    from gaitgraph.invertibility.error_margins import ErrorMargin
    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.validation.report import Report


@dataclass(frozen=True, kw_only=True, eq=False)
class Loop(Record):
    """One closed loop on the surface with its verdict.

    `path` is a gait through every node that the loop passes, the first not repeated; `order` has the waypoints of the
    `request`, counted from 0, in the order in which the loop visits them. `lower_bound`, of an any-angle loop, is a
    lower bound of the length of all loops through these waypoints in this order, in the required region [rad]. With
    `any_order` no other order makes a shorter loop if `order_exact`; otherwise the order is approximate, and if it
    is not `in_time` a deadline ended the search for it. `cost` is that of a walk on the grid: its length without a weight.
    """

    path: Gait
    sign: Sign
    order: tuple[int, ...]
    request: PlanRequest
    lower_bound: float | None = None
    cost: float | None = None
    in_time: bool = True

    def reversed(self) -> Loop:
        """Return the loop run in the other direction, from the same waypoint."""
        order = (self.order[0], *self.order[:0:-1])
        return replace(self, path=self.path.reversed(), order=order)

    @cached_property
    def gait(self) -> Gait:
        """The same loop with straight runs merged."""
        return self.path.merged()

    @cached_property
    def checks(self) -> Report:
        """All checks but those of tilt rates."""
        return self.gait.check(floor=self.request.floor)

    @cached_property
    def report(self) -> Report:
        """All checks, with those of tilt rates."""
        request = self.request
        timed = self.gait.parametrize(request.period, law=request.law, samples=1)
        return self.checks.with_timing(timed)

    @cached_property
    def servo_margin(self) -> ErrorMargin:
        """The largest errors of the tilt angles that the loop bears, with the floor of the request."""
        vehicle, floor = self.request.vehicle, self.request.floor
        margin = closest_servo_margin(self._closed, vehicle, floor=floor)
        asked = (1 - PROOF) * self.request.servo_margin
        if margin.proven < asked and self.bears_servo_errors:
            margin = replace(margin, proven=asked)
        return margin

    @cached_property
    def bears_servo_errors(self) -> bool:
        """Whether the loop is proven to bear the servo margin of the request, to within 0.5 %."""
        request = self.request
        return bears_servo_errors(
            self._closed, request.servo_margin, request.vehicle, floor=request.floor
        )

    @property
    def _closed(self) -> FloatArray:
        return np.vstack([self.gait.alpha, self.gait.alpha[:1]])

    @property
    def color(self) -> str:
        """The loop's color: "red" or "blue"; "red" on a curved sheet, the rows of which have none."""
        return self.gait.color or "red"

    @property
    def length(self) -> float:
        """Length in the (α1, α2) plane [rad]."""
        return self.path.length

    @property
    def order_exact(self) -> bool:
        """Whether the order is as requested, or the shortest of all that were tried: up to nine waypoints."""
        if not self.request.any_order:
            return True
        return self.in_time and len(self.order) <= MOST_ANY_ORDER

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
    def surface(self) -> str:
        """The sheet and the sign of R in words, such as "red, R < 0"; a curved sheet has no color."""
        relation = RELATION[self.sign]
        if self.request.vehicle.asymmetry is not None:
            return relation
        return f"{self.color}, {relation}"

    def __repr__(self) -> str:
        return f"<Loop: {self.surface}, {self.gait.size_text}, {self.report.in_words}>"

    def __str__(self) -> str:
        text = f"{self.surface}, {self.length:.4f} rad: {self.report.in_words}"
        if self.report.flyable:
            return text
        broken = [check.name for check in self.report.checks if check.mark != "ok"]
        return f"{text} ({', '.join(broken).replace('_', ' ')})"
