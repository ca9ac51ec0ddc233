"""The shortest closed polygon through discs in order, with a lower bound of every closed curve's length."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.optimization.levels import component_meeting
from gaitgraph.planning.shortest_paths import ShortestPaths

if TYPE_CHECKING:
    from gaitgraph.optimization.programs import Discs
    from gaitgraph.surface.region import Region

__all__ = ["least_loop_length", "shortest_loop"]

FloatArray = npt.NDArray[np.float64]

_SMALL = 1e-7  # what a side of length zero counts as, so that lengths are smooth [rad]


def least_loop_length(discs: Discs, region: Region | None = None) -> float:
    """Return a lower bound of the length of closed curves that pass discs in order [rad in the (α1, α2) plane].

    Whatever vectors y₁ … yₙ of length one or less are taken, with xᵢ where the curve passes disc i (centre cᵢ, radius
    rᵢ),

        length ≥ Σ ‖xᵢ₊₁ − xᵢ‖ ≥ Σ yᵢ·(xᵢ₊₁ − xᵢ) = Σ xᵢ·(yᵢ₋₁ − yᵢ) ≥ Σ cᵢ·(yᵢ₋₁ − yᵢ) − rᵢ·‖yᵢ₋₁ − yᵢ‖,

    and the directions of the shortest polygon make it sharp. If all radii are zero, the lengths of the shortest paths
    inside the region's outer polygons count instead.

    Examples
    --------
    >>> from gaitgraph.optimization.programs import Discs
    >>> square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    >>> round(least_loop_length(Discs(centers=square, radii=np.zeros(4))), 9)
    4.0
    """
    points, bound = shortest_loop(discs)
    if region is None or discs.radii.any():
        return bound
    outer = component_meeting(region.outer, discs)
    if outer is None:
        return bound
    paths = ShortestPaths(outer)
    legs = [paths.path(a, b) for a, b in zip(points, np.roll(points, -1, axis=0), strict=True)]
    known = [leg for leg in legs if leg is not None]
    if len(known) < len(legs):
        return bound
    return max(bound, sum(float(np.linalg.norm(np.diff(leg, axis=0), axis=1).sum()) for leg in known))


def shortest_loop(discs: Discs) -> tuple[FloatArray, float]:
    """Return the corners of the shortest closed polygon through discs, without obstacles, and a bound of its length."""
    from scipy.optimize import minimize

    centers, radii = discs.centers, discs.radii
    points = centers.copy()
    if radii.any() and len(radii) > 1:

        def length(x: FloatArray) -> tuple[float, FloatArray]:
            at = x.reshape(-1, 2)
            step = np.roll(at, -1, axis=0) - at
            size = np.sqrt(np.sum(step**2, axis=1) + _SMALL**2)
            unit = step / size[:, None]
            return float(size.sum()), np.asarray((np.roll(unit, 1, axis=0) - unit).ravel())

        def room(x: FloatArray) -> FloatArray:
            return np.asarray(radii**2 - np.sum((x.reshape(-1, 2) - centers) ** 2, axis=1))

        def room_slope(x: FloatArray) -> FloatArray:
            off = -2 * (x.reshape(-1, 2) - centers)
            return np.asarray((np.eye(len(radii))[:, :, None] * off[:, None, :]).reshape(len(radii), -1))

        found: Any = minimize(  # type: ignore[call-overload]
            length,
            points.ravel(),
            jac=True,
            method="SLSQP",
            constraints=[{"type": "ineq", "fun": room, "jac": room_slope}],
            options={"maxiter": 500, "ftol": 1e-14},
        )
        points = found.x.reshape(-1, 2)
        off = points - centers
        size = np.linalg.norm(off, axis=1, keepdims=True)
        points = centers + off * np.minimum(1.0, radii[:, None] / np.maximum(size, 1e-300))
    # Where two corners coincide no unit vector is distinguished; shorter ones bound the length too.
    step = np.roll(points, -1, axis=0) - points
    pull = step / np.sqrt(np.sum(step**2, axis=1, keepdims=True) + (_SMALL**2 if radii.any() else 1e-300))
    turn = np.roll(pull, 1, axis=0) - pull
    bound = float(np.sum(centers * turn) - np.sum(radii * np.linalg.norm(turn, axis=1)))
    return points, max(bound * (1 - 1e-12), 0.0)
