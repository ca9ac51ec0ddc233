"""Is the straight loop through waypoints admissible along its whole length? Then nothing is shorter."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.gait.gait import lift
from gaitgraph.invertibility.matrices import Coefficients, least_singular_value_on_red, noise_of
from gaitgraph.invertibility.segment_bounds import (
    keeps_singular_value_above,
    least_level_determinant,
    least_singular_value_along,
    thrust_shares_along,
)
from gaitgraph.surface.sheets import red_label
from gaitgraph.validation.rules import jumps

if TYPE_CHECKING:
    from gaitgraph.planning.prepared import Use
    from gaitgraph.planning.request import PlanRequest

__all__ = ["straight_loop_holds"]

FloatArray = npt.NDArray[np.float64]


def straight_loop_holds(
    request: PlanRequest, coefficients: Coefficients, color: Any, sign: str, use: Use, robust: bool = False
) -> bool:
    """Return whether the straight loop through a request's waypoints may be used along its whole length.

    With `robust`, also whether its least singular value is that of a waypoint, so that no other loop has a better one.
    """
    wanted = 1.0 if sign == "positive" else -1.0
    if use == "flyable":
        starts = np.array(request.waypoints)[:, [0, 1, 0, 1]]  # red, where α3 = α1 and α4 = α2
        ends = np.roll(starts, -1, axis=0)
        holds = _flies(starts, ends, wanted, request)
    else:
        gait = lift(request.waypoints, color, vehicle=request.vehicle, coefficients=coefficients)
        starts, ends = gait.alpha, gait.ends
        painted, noise = np.full(len(starts), color == "red"), noise_of(coefficients)
        holds = not jumps(starts, ends, painted, painted, coefficients).any()
        least = least_level_determinant(starts, ends, coefficients, sign=wanted, tolerance=0.0, floor=noise)
        holds = holds and bool(least.lower.min() >= noise)
    if not holds:
        return False
    if request.zones is not None and not request.zones.allow_segments(starts[:, :2], ends[:, :2]).all():
        return False
    if not robust:
        return True
    along = least_singular_value_along(starts, ends, request.vehicle, tolerance=1e-7)
    at_waypoints = least_singular_value_on_red(starts[:, 0], starts[:, 1], request.vehicle)
    return bool(along.lower.min() >= at_waypoints.min() - 1e-6)


def _flies(starts: FloatArray, ends: FloatArray, wanted: float, request: PlanRequest) -> bool:
    """Return whether straight segments on red that form a closed chain are flyable, sign of R included.

    Where all thrusts push up, the borders of R are straight, so that R keeps its sign between points of one label;
    and positive thrusts are a matter of two quarter planes, each convex.
    """
    vehicle, (a1, a2) = request.vehicle, starts[:, :2].T
    delta = math.atan(vehicle.signed_drag_ratio)
    first, second = a1 - delta, a2 + delta
    up = ((first < 0) & (second > 0)).all() or ((first > 0) & (second < 0)).all()
    labels = red_label(a1, a2, vehicle)
    if not up or (labels != labels[0]).any() or labels[0].prod() != wanted:
        return False
    if vehicle.max_tilt is not None and np.abs(starts).max() > vehicle.max_tilt:
        return False
    if vehicle.max_thrust is not None:
        mass, gravity = vehicle.require("mass", "gravity", purpose="the limit of the largest thrust")
        _, _, largest = thrust_shares_along(starts, ends, vehicle)
        if -float(largest.lower.min()) * mass * gravity > vehicle.max_thrust:
            return False
    return bool(keeps_singular_value_above(starts, ends, request.floor, vehicle).all())
