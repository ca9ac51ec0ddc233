"""How far segments leave the surfaces."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from gaitgraph.invertibility.branch_and_bound import Least, least_along
from gaitgraph.invertibility.sine_bounds import largest_sine

if TYPE_CHECKING:
    from gaitgraph.invertibility.matrices import Coefficients

__all__ = ["largest_residual"]

FloatArray = npt.NDArray[np.float64]


def _residual_phases(alpha: FloatArray, delta: float) -> FloatArray:
    """Return phases whose sines are the factors of Rθ, then those of Rφ, shape (4, k)."""
    a1, a2, a3, a4 = alpha.T
    return np.array([a1 + a3 - 2 * delta, a2 - a4, a1 - a3, a2 + a4 + 2 * delta])


def largest_residual(
    starts: npt.ArrayLike,
    ends: npt.ArrayLike,
    coefficients: Coefficients,
    *,
    tolerance: float = 1e-6,
    known: float = math.inf,
) -> Least:
    """Bracket the least of −max(|Rφ|, |Rθ|) along segments, for a first arm along body x.

    Both are products of two sines of linear functions, whose extremes on an interval are known.
    """
    scale = 1.0 / abs(math.sin(2 * coefficients.delta))

    def value(alpha: FloatArray) -> FloatArray:
        x, y, u, v = np.abs(np.sin(_residual_phases(alpha, coefficients.delta)))
        return np.asarray(-scale * np.maximum(x * y, u * v))

    def bound(f0: FloatArray, f1: FloatArray, p0: FloatArray, p1: FloatArray) -> FloatArray:
        x, y, u, v = largest_sine(*(_residual_phases(side, coefficients.delta) for side in (p0, p1)))
        return np.asarray(-scale * np.maximum(x * y, u * v))

    return least_along(starts, ends, value, bound, tolerance=tolerance, known=known)
