"""Piecewise polynomials as arrays: coefficients (degree + 1, k, ...) of k pieces, highest power first.

Each piece is in powers of its own parameter, zero where the piece starts, as in ``scipy.interpolate.PPoly``.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

__all__ = ["bernstein_from_power", "derivative_of", "values_of"]

FloatArray = npt.NDArray[np.float64]


def bernstein_from_power(pieces: FloatArray, width: FloatArray) -> FloatArray:
    """Return the Bernstein coefficients of polynomial pieces on their intervals, shape as `pieces`, in order.

    Parameters
    ----------
    pieces
        Coefficients in powers of s − start, highest first, shape (degree + 1, k, ...).
    width
        Widths of the intervals, shape (k,).

    Examples
    --------
    >>> bernstein_from_power(np.array([[1.0], [0.0], [0.0]]), np.array([2.0])).ravel().tolist()
    [0.0, 0.0, 4.0]
    """
    degree = len(pieces) - 1
    scale = width.reshape((-1,) + (1,) * (pieces.ndim - 2))
    rising = np.stack([pieces[degree - j] * scale**j for j in range(degree + 1)])
    mix = np.array([[math.comb(i, j) / math.comb(degree, j) for j in range(degree + 1)] for i in range(degree + 1)])
    return np.asarray(np.einsum("ij,j...->i...", mix, rising))


def derivative_of(pieces: FloatArray, order: int = 1) -> FloatArray:
    """Return the coefficients of a derivative of polynomial pieces, highest power first.

    >>> derivative_of(np.array([[3.0], [2.0], [1.0]])).ravel().tolist()
    [6.0, 2.0]
    """
    for _ in range(order):
        degree = len(pieces) - 1
        if degree == 0:
            return np.zeros_like(pieces)
        pieces = pieces[:-1] * np.arange(degree, 0, -1).reshape((-1,) + (1,) * (pieces.ndim - 1))
    return pieces


def values_of(pieces: FloatArray, local: FloatArray) -> FloatArray:
    """Return polynomials at local parameters: coefficients (degree + 1, ..., d), parameters (...), out (..., d)."""
    out = np.broadcast_to(pieces[0], (*local.shape, pieces.shape[-1])).copy()
    for coefficient in pieces[1:]:
        out = out * local[..., None] + coefficient
    return np.asarray(out)
