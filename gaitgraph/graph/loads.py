"""What a way costs in thrust: the largest hover thrust share, a cost per radian of the (α1, α2) plane.

On the red sheet the thrusts that hover, in units of m·g, are in closed form

    T1 = T3 = sin β2 / (2 D),  T2 = T4 = −sin β1 / (2 D),  D = sin β2 cos α1 − sin β1 cos α2,

because the factor cos β1 cos β2 of :func:`gaitgraph.invertibility.matrices.hover_thrust_shares` cancels. D vanishes on the curve
tan α1 − tan α2 = 2κ, where no thrust carries the weight.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.invertibility.matrices import hover_thrust_shares
from gaitgraph.vehicle import PAPER, Vehicle

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["MOST_LOAD", "loads_of", "mean_load", "red_load"]

MOST_LOAD = 1000.0
"""The load where no thrust hovers, on blue and at singular points: beyond what any vehicle has, and finite."""


def red_load(alpha1: npt.ArrayLike, alpha2: npt.ArrayLike, vehicle: Vehicle = PAPER) -> npt.NDArray[np.float64]:
    """Return the largest |T|/(m·g) of the four rotors at hover on the red sheet, at most `MOST_LOAD`.

    Parameters
    ----------
    alpha1, alpha2
        Tilt angles [rad]; broadcast to the shape of the result.

    Notes
    -----
    The size of a thrust, whatever its sign: where a pair must push down, it costs as much. At least 1/4, since four
    thrusts carry the weight.

    Examples
    --------
    >>> red_load(0.0, [0.0, -0.1]).round(4).tolist()
    [0.25, 0.3576]
    """
    delta = math.atan(vehicle.signed_drag_ratio)
    a1, a2 = np.asarray(alpha1, dtype=float), np.asarray(alpha2, dtype=float)
    first, second = np.sin(a1 - delta), np.sin(a2 + delta)
    carried = 2.0 * np.abs(second * np.cos(a1) - first * np.cos(a2))
    largest = np.maximum(np.abs(first), np.abs(second))
    heavy = largest >= MOST_LOAD * carried
    return np.asarray(np.where(heavy, MOST_LOAD, largest / np.where(heavy, 1.0, carried)))


def loads_of(alpha: npt.ArrayLike, colors: Sequence[str], vehicle: Vehicle = PAPER) -> npt.NDArray[np.float64]:
    """Return the load of points on the surfaces: `MOST_LOAD` on blue, where no thrust hovers.

    Parameters
    ----------
    alpha
        Tilt angles, shape (n, 4) [rad].
    colors
        The family of each point, length n: "red", "blue", or a fibre.

    Examples
    --------
    >>> loads_of([[0, 0, 0, 0]], ["red"]).tolist(), loads_of([[0, 0, 0.3, -0.3]], ["blue"]).tolist()
    ([0.25], [1000.0])
    """
    alpha = np.asarray(alpha, dtype=float).reshape(-1, 4)
    color = np.asarray(colors, dtype=str)
    out = np.full(len(alpha), MOST_LOAD)
    red, other = color == "red", (color != "red") & (color != "blue")
    out[red] = red_load(alpha[red, 0], alpha[red, 1], vehicle)
    largest = np.abs(hover_thrust_shares(alpha[other], vehicle)).max(axis=-1)
    out[other] = np.fmin(largest, MOST_LOAD)
    return out


def mean_load(first: Any, second: Any) -> Any:
    """Return what an edge costs per radian: the mean of the loads at its two ends.

    Length times this mean is the trapezoidal rule for the integral of the load along the edge; it is the definition of
    the cost. It differs from the integral by at most length³/12 times the largest curvature of the load, so that the
    difference along a given curve falls with the square of the grid's step; where the larger of the two pairs changes,
    the load has a kink, which adds at most length²/8 times the change of slope.

    >>> mean_load(0.25, 0.75)
    0.5
    """
    return (first + second) / 2
