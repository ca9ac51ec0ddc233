"""Polynomial pieces: coefficients (degree + 1, k, …) of k pieces, highest power first, as ``scipy.interpolate.PPoly``.

The powers are those of the parameter since the start of a piece. Bernstein coefficients bound a polynomial on its
interval: its graph lies in their convex hull.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from gaitgraph.arrays import check_unmasked
from gaitgraph.errors import InputError, shown

if TYPE_CHECKING:
    from gaitgraph.invertibility.forms import FloatArray

_TIMES = "t must be finite times"


def derivative_of(pieces: FloatArray, order: int = 1) -> FloatArray:
    """Return the coefficients of a derivative of polynomial pieces."""
    for _ in range(order):
        if len(pieces) == 1:
            return np.zeros_like(pieces)
        power = np.arange(len(pieces) - 1, 0, -1)
        pieces = pieces[:-1] * power.reshape((-1,) + (1,) * (pieces.ndim - 1))
    return pieces


def values_of(pieces: FloatArray, local: FloatArray) -> FloatArray:
    """Return polynomials at local parameters: coefficients (degree + 1, ..., d), parameters (...), out (..., d)."""
    return np.asarray(np.polyval(pieces, local[..., None]))


def bernstein_from_power(pieces: FloatArray, width: FloatArray) -> FloatArray:
    """Return the Bernstein coefficients of polynomial pieces on intervals of given widths, shape as `pieces`."""
    degree = len(pieces) - 1
    scale = width.reshape((-1,) + (1,) * (pieces.ndim - 2))
    rising = np.stack([pieces[degree - j] * scale**j for j in range(degree + 1)])
    mix = [
        [math.comb(i, j) / math.comb(degree, j) for j in range(degree + 1)]
        for i in range(degree + 1)
    ]
    return np.asarray(np.einsum("ij,j...->i...", np.array(mix), rising))


def bends_of(pieces: FloatArray, width: FloatArray) -> FloatArray:
    """Return an upper bound of the norm of the second derivative on each interval, shape (k,)."""
    control = bernstein_from_power(derivative_of(pieces, 2), width)
    return np.asarray(np.linalg.norm(control, axis=-1).max(axis=0))


def value_at(
    tilts: FloatArray,
    times: FloatArray,
    width: FloatArray,
    t: npt.ArrayLike,
    order: int,
) -> FloatArray:
    """Return a derivative, at any times, of polynomials of the share of each interval, shape (..., d).

    The intervals are between the `times` of one period, and `width` is how long they are.
    """
    interval, local = located(times, t)
    h = width[interval]
    by_share = values_of(derivative_of(tilts, order)[:, interval], local / h)
    return by_share / h[..., None] ** order


def peaks_of(tilts: FloatArray, width: FloatArray, order: int) -> FloatArray:
    """Return an upper bound of the size of a derivative of such polynomials on each interval, shape (k, d).

    It is attained as intervals shrink, at second order.
    """
    by_share = bernstein_from_power(derivative_of(tilts, order), np.ones(len(width)))
    return np.asarray(np.abs(by_share).max(axis=0) / width[:, None] ** order)


def quintics(starts: FloatArray, ends: FloatArray, width: FloatArray) -> FloatArray:
    """Return polynomials of degree five in powers of the share of each interval, shape (6, n, d).

    `starts` and `ends` are the value and two derivatives at both ends of each interval, shape (3, n, d).
    """
    scale = width[:, None] ** np.arange(3)[:, None, None]
    value, slope, bend = starts * scale
    last, slope_after, bend_after = ends * scale
    step = last - value
    return np.stack(
        [
            6 * step - 3 * (slope + slope_after) + (bend_after - bend) / 2,
            -15 * step + 8 * slope + 7 * slope_after + 1.5 * bend - bend_after,
            10 * step - 6 * slope - 4 * slope_after + (bend_after - 3 * bend) / 2,
            bend / 2,
            slope,
            value,
        ]
    )


def times_from(
    t: npt.ArrayLike, what: str = _TIMES, least: float = -math.inf
) -> FloatArray:
    """Return times [s] of any shape as an array; InputError, which `what` begins, unless finite and from `least` on."""
    check_unmasked(t, "t")
    try:
        times = np.asarray(t, dtype=float)
    except (OverflowError, TypeError, ValueError):  # the last for rows of many lengths
        times = np.array(np.nan)
    if not (np.isfinite(times) & (times >= least)).all():
        raise InputError(f"{what}, got {shown(t)}", field="t", value=t)
    return times


def located(
    breaks: FloatArray, at: npt.ArrayLike, what: str = _TIMES
) -> tuple[npt.NDArray[np.intp], FloatArray]:
    """Return in which piece of a period times or parameters lie, and how far from its start; breaks are from 0 on."""
    phase = np.asarray(np.mod(times_from(at, what), breaks[-1]))
    piece = np.searchsorted(breaks, phase, side="right") - 1
    piece = np.clip(piece, 0, len(breaks) - 2)
    return piece, phase - breaks[piece]
