"""R along segments: bounds from its second derivative."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from gaitgraph.invertibility.branch_and_bound import Least, Several, least_along, least_of_bent, least_of_each
from gaitgraph.invertibility.matrices import Coefficients, level_determinant

__all__ = ["least_level_determinant", "level_determinant_curvature", "range_of_level_determinant"]

FloatArray = npt.NDArray[np.float64]


def level_determinant_curvature(start: FloatArray, step: FloatArray, coefficients: Coefficients) -> FloatArray:
    """Return a bound of |d²R/ds²| along start + s·step, for s in [0, 1], shape (m,).

    R is a sum of products of two sinusoids in the differences and sums of opposite arms' angles. A product's
    second derivative is at most its size times the square of the sum of both frequencies. Where one factor is
    constant along the segment, as on both sheets, its value at the start replaces its size.
    """
    form, factors, sizes, both = _form_of_sums(coefficients)
    turns, sums = np.abs(step[:, :2] - step[:, 2:]), np.abs(step[:, :2] + step[:, 2:])
    # A difference of one pair turns with the sum of the other: Δ1 with Σ2, then Δ2 with Σ1.
    slow, at = sums[:, ::-1], (start[:, :2] + start[:, 2:])[:, ::-1]
    now = np.abs(factors[0] * np.cos(at) + factors[1] * np.sin(at))
    local = turns**2 * (now + sizes * slow) + sizes * slow * (2 * turns + slow)
    crossed = np.minimum(local, sizes * (slow + turns) ** 2)
    return np.asarray(abs(form[0, 0]) * turns.sum(axis=1) ** 2 + crossed.sum(axis=1) + both * sums.sum(axis=1) ** 2)


@lru_cache(maxsize=32)
def _form_of_sums(coefficients: Coefficients) -> tuple[FloatArray, FloatArray, FloatArray, float]:
    """Return the form of R in (cos of the difference, cos and sin of the sum) of each pair, and norms of its parts.

    The second array has what multiplies cos Δ1, then cos Δ2, as columns; the third their sizes; the last number is a
    norm of the part without differences.
    """
    mix = np.array([[0.5, 0.5, 0.0], [0.5, -0.5, 0.0], [0.0, 0.0, 1.0]])
    form = mix.T @ coefficients.bilinear_form @ mix
    factors = np.stack([form[0, 1:], form[1:, 0]], axis=1)
    return form, factors, np.hypot(*factors), float(np.linalg.norm(form[1:, 1:], 2))


def range_of_level_determinant(
    starts: npt.ArrayLike,
    ends: npt.ArrayLike,
    coefficients: Coefficients,
    *,
    tolerance: float = 1e-6,
    known: tuple[float, float] = (math.inf, math.inf),
    at_ends: tuple[FloatArray, FloatArray] | None = None,
) -> tuple[Least, Least]:
    """Bracket the least of R and that of −R along segments; see :func:`least_level_determinant`.

    >>> from gaitgraph.invertibility.matrices import coefficients_of
    >>> least, _ = range_of_level_determinant([0, 0, 0, 0], [0.4, 0.4, 0.4, 0.4], coefficients_of())
    >>> round(least.worst()[0], 3)
    2.864
    """

    def values(alpha: FloatArray) -> tuple[FloatArray, FloatArray]:
        value = np.asarray(level_determinant(alpha, coefficients))
        return value, -value

    def bounds(v0: Several, v1: Several, p0: FloatArray, p1: FloatArray) -> list[FloatArray]:
        curvature = level_determinant_curvature(p0, p1 - p0, coefficients)
        return [least_of_bent(f0, f1, curvature) for f0, f1 in zip(v0, v1, strict=True)]

    both = None if at_ends is None else ((at_ends[0], -at_ends[0]), (at_ends[1], -at_ends[1]))
    least, minus_largest = least_of_each(starts, ends, values, bounds, tolerance=tolerance, known=known, at_ends=both)
    return least, minus_largest


def least_level_determinant(
    starts: npt.ArrayLike,
    ends: npt.ArrayLike,
    coefficients: Coefficients,
    *,
    sign: float = 1.0,
    tolerance: float = 1e-6,
    floor: float = math.inf,
    each: bool = False,
    known: float = math.inf,
    at_ends: tuple[FloatArray, FloatArray] | None = None,
) -> Least:
    """Bracket the least of sign·R along segments; a positive lower bound proves that R keeps that sign.

    >>> corners = np.array([[1.1, -1.1, 1.1, -1.1], [1.1, -0.4, 1.1, -0.4]])
    >>> from gaitgraph.invertibility.matrices import coefficients_of
    >>> round(least_level_determinant(corners[:1], corners[1:], coefficients_of(), sign=-1).worst()[0], 3)
    3.197
    """

    def value(alpha: FloatArray) -> FloatArray:
        return np.asarray(sign * level_determinant(alpha, coefficients))

    def bound(f0: FloatArray, f1: FloatArray, p0: FloatArray, p1: FloatArray) -> FloatArray:
        return least_of_bent(f0, f1, level_determinant_curvature(p0, p1 - p0, coefficients))

    return least_along(
        starts, ends, value, bound, tolerance=tolerance, floor=floor, each=each, known=known, at_ends=at_ends
    )
