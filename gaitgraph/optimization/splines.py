"""Periodic uniform cubic splines of (α1, α2): twice continuously differentiable, linear in their control points.

Piece j, local parameter t from 0 to 1, is a cubic of the control points j to j + 3, counted modulo their number K. Each
piece lies in the convex hull of its Bézier points, and so does each part of it in that of its own: what holds for the
hulls holds for the curve between any samples. A run of three equal control points makes the curve pass through them,
and hulls that touch such a point are segments.

The *effort* of a spline run once in the period T, at K/T pieces per second, is the integral over the period of the
squared rate of all four tilt angles, on red

    ∫ ‖α̇‖² dt = 2·∫ (α̇1² + α̇2²) dt = 2·(K/T)·Σ Pᵀ·G·P   [rad²/s],

where G, cyclic, holds the integrals of products of the derivatives of the basis: 2/3, −1/8, −1/5, −1/120 by distance.
By the Cauchy–Schwarz inequality it is at least (length in four dimensions)²/T, and equal to that at constant speed.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
import numpy.typing as npt

__all__ = ["FEWEST_PIECES", "basis_rows", "control_points_along", "effort_matrix", "hull_matrix", "power_pieces"]

FloatArray = npt.NDArray[np.float64]

FEWEST_PIECES = 8
"""Fewer control points would meet themselves around the loop."""

# Coefficients of the four basis functions of a piece in powers of t, constant first.
_BASIS = np.array([[1, -3, 3, -1], [4, 0, -6, 3], [1, 3, 3, -3], [0, 0, 0, 1]]) / 6.0
_PRODUCTS = (2 / 3, -1 / 8, -1 / 5, -1 / 120)


def basis_rows(s: npt.ArrayLike, count: int, derivative: int = 0) -> FloatArray:
    """Return the rows that give the spline, or a derivative of it by s, from its control points.

    Parameters
    ----------
    s
        Parameters, shape (m,): piece j runs from s = j to j + 1; periodic with `count`.
    count
        Number K of control points.
    derivative
        0 to 3.

    Returns
    -------
    array of shape (m, count)
        Times control points of shape (count, 2) these are points, or derivatives.

    Examples
    --------
    >>> basis_rows([0.0], 8)[0, :4].round(4).tolist()
    [0.1667, 0.6667, 0.1667, 0.0]
    """
    at = np.mod(np.atleast_1d(np.asarray(s, dtype=float)), count)
    piece = np.minimum(at.astype(np.int64), count - 1)
    powers = np.zeros((at.size, 4))
    for k in range(derivative, 4):
        powers[:, k] = math.perm(k, derivative) * (at - piece) ** (k - derivative)
    rows = np.zeros((at.size, count))
    columns = (piece[:, None] + np.arange(4)) % count
    np.put_along_axis(rows, columns, powers @ _BASIS.T, axis=1)
    return rows


@lru_cache(maxsize=16)
def hull_matrix(count: int, parts: int = 1) -> FloatArray:
    """Return what gives the Bézier points of every part of every piece from the control points.

    Parameters
    ----------
    count
        Number K of control points.
    parts
        Equal parts that each piece is cut into: the more, the closer the hulls are to the curve.

    Returns
    -------
    array of shape (count·parts, 4, count)
        Kept for the next call, so read-only.
    """
    lows = np.arange(parts) / parts
    # The blossom of a cubic, its symmetric form in three parameters, gives Bézier points: [a,a,a], [a,a,b], …
    triples = np.array([[[low] * (3 - k) + [low + 1 / parts] * k for k in range(4)] for low in lows])
    x, y, z = np.moveaxis(triples, -1, 0)
    blossom = np.stack([np.ones_like(x), (x + y + z) / 3, (x * y + y * z + z * x) / 3, x * y * z], axis=-1)
    local = blossom @ _BASIS.T
    out = np.zeros((count, parts, 4, count))
    for piece in range(count):
        for k in range(4):
            out[piece, :, :, (piece + k) % count] += local[:, :, k]
    flat = out.reshape(count * parts, 4, count)
    flat.flags.writeable = False
    return flat


def effort_matrix(count: int) -> FloatArray:
    """Return the cyclic matrix G of the effort, shape (count, count); its null space are the loops that stand still."""
    first = np.zeros(count)
    for distance, product in enumerate(_PRODUCTS):
        first[distance] += product
        if distance:
            first[-distance] += product
    index = np.arange(count)
    return np.asarray(first[(index[None, :] - index[:, None]) % count])


def power_pieces(points: FloatArray, width: float) -> FloatArray:
    """Return the pieces as polynomials in powers of a local parameter from 0 to `width`, highest first, (4, K, 2)."""
    # From the first point, so that a spline that stands still does so exactly.
    around = np.stack([np.roll(points - points[0], -k, axis=0) for k in range(4)])
    rising = np.einsum("kp,kjd->pjd", _BASIS, around)
    rising[0] += points[0]
    return np.asarray(rising[::-1] / width ** np.arange(3, -1, -1).reshape(4, 1, 1))


def control_points_along(corners: FloatArray, pieces: int) -> tuple[FloatArray, npt.NDArray[np.int64]]:
    """Return control points of a spline that runs along a closed polygon exactly, resting at its corners.

    Parameters
    ----------
    corners
        The polygon, shape (m, 2), m ≥ 1.
    pieces
        Number of control points wanted; three for each corner are the least. The others are shared among the sides
        by length.

    Returns
    -------
    points
        Shape (K, 2), the first three at the first corner.
    knots
        The parameter at which each corner is met, shape (m,).

    Examples
    --------
    >>> points, knots = control_points_along(np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]), 12)
    >>> len(points), knots.tolist(), (basis_rows(knots, 12) @ points).round(12).tolist()
    (12, [0, 4, 9], [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    """
    m = len(corners)
    total = max(pieces, 3 * m, FEWEST_PIECES)
    ends: FloatArray = np.roll(corners, -1, axis=0)
    length = np.linalg.norm(ends - corners, axis=1)
    share = length / length.sum() if length.sum() > 0 else np.full(m, 1.0 / m)
    # A corner's own three count as half of each of its sides.
    wanted = np.maximum(share * total - 3.0, 0.0)
    spare = total - 3 * m
    exact = wanted / wanted.sum() * spare if wanted.sum() > 0 else np.full(m, spare / m)
    inside = np.floor(exact).astype(np.int64)
    for k in np.argsort(inside - exact, kind="stable")[: spare - int(inside.sum())]:
        inside[k] += 1
    out, knots = [], []
    count = 0
    for corner, end, extra in zip(corners, ends, inside.tolist(), strict=True):
        knots.append(count)
        out += [corner] * 3 + [corner + (end - corner) * k / (extra + 1) for k in range(1, extra + 1)]
        count += 3 + extra
    return np.array(out), np.array(knots, dtype=np.int64)
