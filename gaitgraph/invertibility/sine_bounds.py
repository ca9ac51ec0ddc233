"""The least and the largest sine on intervals, in closed form."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

__all__ = ["largest_sine", "least_sine", "range_of_sine", "where_least_sine"]

FloatArray = npt.NDArray[np.float64]


def largest_sine(x0: FloatArray, x1: FloatArray) -> FloatArray:
    """Return the largest |sin| on intervals: 1 if a peak lies inside, else the larger end."""
    peak = np.floor(x0 / math.pi - 0.5) != np.floor(x1 / math.pi - 0.5)
    return np.where(peak, 1.0, np.maximum(np.abs(np.sin(x0)), np.abs(np.sin(x1))))


def least_sine(x0: FloatArray, x1: FloatArray) -> FloatArray:
    """Return the least |sin| on intervals: 0 if a zero lies inside, else the smaller end (|sin| is concave)."""
    zero = np.floor(x0 / math.pi) != np.floor(x1 / math.pi)
    return np.where(zero, 0.0, np.minimum(np.abs(np.sin(x0)), np.abs(np.sin(x1))))


def range_of_sine(x0: FloatArray, x1: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the least and the largest sin on intervals: ±1 if a peak lies inside, else those of the ends."""
    s0, s1, turn = np.sin(x0), np.sin(x1), 2 * math.pi
    top = np.floor(x0 / turn - 0.25) != np.floor(x1 / turn - 0.25)
    bottom = np.floor(x0 / turn + 0.25) != np.floor(x1 / turn + 0.25)
    return np.where(bottom, -1.0, np.minimum(s0, s1)), np.where(top, 1.0, np.maximum(s0, s1))


def where_least_sine(x0: FloatArray, x1: FloatArray) -> FloatArray:
    """Return where, as a fraction, the least |sin| of several phases, shape (m, k), is met on intervals, shape (m,)."""
    ends = np.stack([np.abs(np.sin(x0)), np.abs(np.sin(x1))], axis=-1)
    zero = np.maximum(np.floor(x0 / math.pi), np.floor(x1 / math.pi)) * math.pi
    crossing = np.floor(x0 / math.pi) != np.floor(x1 / math.pi)
    fraction = np.where(ends[..., 1] < ends[..., 0], 1.0, 0.0)
    fraction = np.where(crossing, (zero - x0) / np.where(crossing, x1 - x0, 1.0), fraction)
    least = np.where(crossing, 0.0, ends.min(axis=-1))
    return np.asarray(np.take_along_axis(fraction, np.argmin(least, axis=1)[:, None], axis=1)[:, 0])
