"""Why a color and sign of R has no loop: obstacles, the certificates of a refusal."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Literal

import numpy as np

from gaitgraph.invertibility.matrices import Coefficients, noise_of
from gaitgraph.surface.closed_form_roots import RootArrays, root_arrays

if TYPE_CHECKING:
    from gaitgraph.planning.request import PlanRequest, Point

__all__ = ["RELATION", "Obstacle", "rootless", "waypoint_obstacle"]

RELATION = {"positive": "R > 0", "negative": "R < 0"}

_CODES = {"red": 1, "blue": -1}  # as in :class:`gaitgraph.surface.closed_form_roots.RootArrays`


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


def rootless(request: PlanRequest, coefficients: Coefficients, color: str, sign: str) -> set[int]:
    """Return the waypoints, counted from 0, above which the graph has no node of a color and sign."""
    if color == "blue" and coefficients.kind == "exact":
        return set(range(len(request.waypoints)))
    wanted = 1.0 if sign == "positive" else -1.0
    found = _roots_above(request.waypoints, coefficients)
    of_color = found.sheet == _CODES[color]
    rooted = (of_color & (wanted * found.R > noise_of(coefficients))).any(axis=1)
    if request.zones is not None:
        rooted &= request.zones.allow_points(np.array(request.waypoints))
    return set(np.nonzero(~rooted)[0].tolist())


@lru_cache(maxsize=2)
def _roots_above(waypoints: tuple[Point, ...], coefficients: Coefficients) -> RootArrays:
    """Return the roots above waypoints; each color and sign of one request asks for them again."""
    plane = np.array(waypoints)
    return root_arrays(plane[:, 0], plane[:, 1], coefficients)


def waypoint_obstacle(k: int, request: PlanRequest, coefficients: Coefficients, color: str, sign: str) -> Obstacle:
    """Return what is in the way at a waypoint, counted from 0, that :func:`rootless` names."""
    point = request.waypoints[k]
    place = f"waypoint {k + 1} ({point[0]:.4f}, {point[1]:.4f})"
    if color == "blue" and coefficients.kind == "exact":
        return Obstacle(
            color=color,
            sign=sign,
            kind="color",
            message="blue: with exact coefficients R = 0 on the whole blue sheet, so the matrix is singular there",
            R=0.0,
        )
    wanted = 1.0 if sign == "positive" else -1.0
    found = _roots_above(request.waypoints, coefficients)
    values = found.R[k][found.sheet[k] == _CODES[color]]
    best = float(values[np.argmax(wanted * values)])
    if wanted * best > 0 and request.zones is not None:
        message = f"{color}, {RELATION[sign]}: {place} lies where keep_out or keep_in forbids it"
    elif abs(best) < 1e-9:
        message = f"{color}, {RELATION[sign]}: {place} has R = 0, the matrix is singular there"
    else:
        message = f"{color}, {RELATION[sign]}: {place} has R = {best:.4g}"
    return Obstacle(color=color, sign=sign, kind="waypoint", message=message, waypoints=(k + 1,), R=best)
