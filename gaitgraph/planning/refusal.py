"""Why a plan was refused: what is in the way of a color and sign of R, as the certificate of a refusal."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Literal

import numpy as np

from gaitgraph.invertibility.matrices import Coefficients, noise_of
from gaitgraph.surface.sheets import RELATION, RootArrays, Sign, root_arrays, separating_factor

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gaitgraph.gait.gait import Gait
    from gaitgraph.planning.request import PlanRequest, Point
    from gaitgraph.surface.sheets import Color

FoundPath = tuple["Gait", tuple[int, ...], float | None]
"""A loop through every node, the order of the waypoints (counted from 0), and a lower bound of its length [rad]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One color and sign of R for which a request is answered."""

    request: PlanRequest
    coefficients: Coefficients
    color: Color
    sign: Sign

    @property
    def wanted(self) -> float:
        """The sign of R as +1 or −1."""
        return 1.0 if self.sign == "positive" else -1.0

    def directed(self, path: Gait, order: tuple[int, ...], lower_bound: float | None = None) -> FoundPath:
        """Return a path and its order of waypoints in the direction that the request asks for."""
        if self.request.reverse:
            path, order = path.reversed(), (order[0], *order[:0:-1])
        return path, order, lower_bound

    def __str__(self) -> str:
        return f"{self.color}, {RELATION[self.sign]}"


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
        For "separated" on the grid: how many graph nodes can be reached from each of the two waypoints.
    nearest
        For "waypoint", any-angle: the nearest (α1, α2) that is admissible, if there is any [rad].
    """

    color: str
    sign: str
    kind: Literal["waypoint", "separated", "color"]
    message: str
    waypoints: tuple[int, ...] = ()
    R: float | None = None
    components: tuple[int, ...] = ()
    nearest: Point | None = None


@lru_cache(maxsize=2)
def _roots_above(waypoints: tuple[Point, ...], coefficients: Coefficients) -> RootArrays:
    """Return the roots above waypoints; each color and sign of one request asks for them again."""
    plane = np.array(waypoints)
    return root_arrays(plane[:, 0], plane[:, 1], coefficients)


def rootless_waypoints(case: Case) -> list[int]:
    """Return the waypoints, counted from 0, that have no root of a color and sign, or lie where polygons forbid it."""
    waypoints, zones = case.request.waypoints, case.request.zones
    if case.color == "blue" and case.coefficients.kind == "exact":
        return list(range(len(waypoints)))
    found = _roots_above(waypoints, case.coefficients)
    of_color = found.sheet == (1 if case.color == "red" else -1)
    rooted = (of_color & (case.wanted * found.R > noise_of(case.coefficients))).any(axis=1)
    if zones is not None:
        rooted &= zones.allow_points(np.array(waypoints))
    return [int(k) for k in np.flatnonzero(~rooted)]


def obstacle_at_waypoint(case: Case, k: int) -> Obstacle:
    """Return what is in the way at a waypoint, counted from 0, of :func:`rootless_waypoints`."""
    color, sign, point = case.color, case.sign, case.request.waypoints[k]
    if color == "blue" and case.coefficients.kind == "exact":
        message = "blue: with exact coefficients R = 0 on the whole blue sheet, so the matrix is singular there"
        return Obstacle(color=color, sign=sign, kind="color", message=message, R=0.0)
    found = _roots_above(case.request.waypoints, case.coefficients)
    values = found.R[k][found.sheet[k] == (1 if color == "red" else -1)]
    best = float(values[np.argmax(case.wanted * values)])
    if case.wanted * best > 0 and case.request.zones is not None:
        why = "lies where keep_out or keep_in forbids it"
    elif abs(best) < 1e-9:
        why = "has R = 0, the matrix is singular there"
    else:
        why = f"has R = {best:.4g}"
    message = f"{case}: waypoint {k + 1} ({point[0]:.4f}, {point[1]:.4f}) {why}"
    return Obstacle(color=color, sign=sign, kind="waypoint", message=message, waypoints=(k + 1,), R=best)


def separation(case: Case, ends: Sequence[int], otherwise: str, components: tuple[int, ...] = ()) -> Obstacle:
    """Return that two waypoints, counted from 0, are separated by a factor of R, or by what `otherwise` names."""
    first, second = (case.request.waypoints[k] for k in ends)
    factor = separating_factor(first, second, case.request.vehicle) if case.color == "red" else None
    numbers = ends[0] + 1, ends[1] + 1
    return Obstacle(
        color=case.color,
        sign=case.sign,
        kind="separated",
        message=f"{case}: waypoints {numbers[0]} and {numbers[1]} are separated by {factor or otherwise}",
        waypoints=numbers,
        components=components,
    )


def note_on_heuristic_order(number: int) -> str:
    """Return the note on an order of waypoints that is not proven to be the best."""
    return (
        f"order of {number} waypoints by Christofides' heuristic (networkx): the shortest loop in it is at most "
        "1.5 times the shortest in any order with this method, and not proven shortest"
    )
