"""The least singular value of the scaled decoupling matrix, level, along segments."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from gaitgraph.invertibility.branch_and_bound import Bound, Least, least_along
from gaitgraph.invertibility.matrices import least_singular_value, least_singular_value_bound, singular_values_on_red
from gaitgraph.invertibility.sine_bounds import least_sine, range_of_sine, where_least_sine
from gaitgraph.vehicle import PAPER, Vehicle

__all__ = [
    "keeps_singular_value_above",
    "least_singular_value_along",
    "least_singular_value_of_all",
    "singular_value_bound",
]

FloatArray = npt.NDArray[np.float64]


def singular_value_bound(vehicle: Vehicle) -> Bound:
    """Return a bound from values at both ends that hold for the least singular value, or lie below it, at any attitude.

    Column i of the matrix turns at most √(2 + κ²) per radian of αᵢ, so the least singular value is Lipschitz in
    ‖Δα‖ with that constant.
    """
    constant = math.sqrt(2.0 + vehicle.drag_ratio**2)

    def bound(f0: FloatArray, f1: FloatArray, p0: FloatArray, p1: FloatArray) -> FloatArray:
        return np.asarray(np.maximum((f0 + f1 - constant * np.linalg.norm(p1 - p0, axis=1)) / 2, 0.0))

    return bound


def _on_red(starts: FloatArray, ends: FloatArray) -> bool:
    return all(np.array_equal(side[:, :2], side[:, 2:]) for side in (starts, ends))


def least_singular_value_along(
    starts: npt.ArrayLike,
    ends: npt.ArrayLike,
    vehicle: Vehicle = PAPER,
    *,
    tolerance: float = 1e-4,
    floor: float = math.inf,
    each: bool = False,
    known: float = math.inf,
) -> Least:
    """Bracket the least singular value of the scaled decoupling matrix, level, along segments.

    On the red sheet the matrix splits, and two of its blocks are cosines, whose least on a segment is known; only the
    third is searched. Elsewhere every end costs a decomposition: see :func:`least_singular_value_of_all`.

    Parameters
    ----------
    starts, ends
        The segments, shape (m, 4) [rad].
    tolerance, floor, each, known
        As for :func:`least_along`.
    """
    starts, ends = np.atleast_2d(np.asarray(starts, dtype=float)), np.atleast_2d(np.asarray(ends, dtype=float))
    bound, on_red = singular_value_bound(vehicle), _on_red(starts, ends)
    asked: dict[str, Any] = {"tolerance": tolerance, "floor": floor, "each": each, "known": known}

    def value(alpha: FloatArray) -> FloatArray:
        if on_red:
            return np.asarray(singular_values_on_red(alpha[:, 0], alpha[:, 1], vehicle)[1])
        return np.asarray(least_singular_value(alpha, vehicle))

    if not on_red:
        return least_along(starts, ends, value, bound, **asked)
    delta = math.atan(vehicle.signed_drag_ratio)
    quarter = math.pi / 2
    phases = [side[:, :2] + np.array([-delta, delta]) + quarter for side in (starts, ends)]
    alone = math.sqrt(2.0) / math.cos(delta) * least_sine(phases[0], phases[1]).min(axis=1)
    enough = alone if each else np.full(len(alone), alone.min())
    third = least_along(starts, ends, value, bound, enough=enough, **asked)
    fraction = np.where(third.upper <= alone, third.fraction, where_least_sine(phases[0], phases[1]))
    return Least(lower=np.minimum(third.lower, alone), upper=np.minimum(third.upper, alone), fraction=fraction)


def least_singular_value_of_all(
    starts: npt.ArrayLike,
    ends: npt.ArrayLike,
    vehicle: Vehicle = PAPER,
    *,
    tolerance: float = 1e-4,
    known: float = math.inf,
) -> Least:
    """Bracket the least singular value over many segments, most of them without any decomposition.

    Parameters as for :func:`least_singular_value_along`. A bound from arithmetic alone settles the segments that
    certainly stay above the least of all, or above `known`; their `upper` is +∞, since no value of theirs is known.
    """
    starts, ends = np.atleast_2d(np.asarray(starts, dtype=float)), np.atleast_2d(np.asarray(ends, dtype=float))
    if _on_red(starts, ends):
        return least_singular_value_along(starts, ends, vehicle, tolerance=tolerance, known=known)
    low0, lower = _bounds_without_decomposition(starts, ends, vehicle)
    upper, fraction = np.full(len(starts), np.inf), np.zeros(len(starts))
    first = int(np.argmin(low0))
    known = min(known, float(least_singular_value(starts[first], vehicle)))
    matters = lower < known - tolerance
    matters[first] = True
    found = least_singular_value_along(starts[matters], ends[matters], vehicle, tolerance=tolerance, known=known)
    lower[matters], upper[matters], fraction[matters] = found.lower, found.upper, found.fraction
    return Least(lower=lower, upper=upper, fraction=fraction)


def _bounds_without_decomposition(
    starts: FloatArray, ends: FloatArray, vehicle: Vehicle
) -> tuple[FloatArray, FloatArray]:
    """Return lower bounds of the least singular value at the starts, and along the segments."""
    low0, low1 = (least_singular_value_bound(side, vehicle) for side in (starts, ends))
    return low0, singular_value_bound(vehicle)(low0, low1, starts, ends)


def _bound_along_red(starts: FloatArray, ends: FloatArray, vehicle: Vehicle) -> FloatArray:
    """Return a lower bound of the least singular value, level, on segments of the red sheet, without halving them.

    The two lone values are cosines, whose least is known. The 2×2 block is √2·B with |det B| = |D|,
    D = κ·cos(α1 + α2) − sin(α1 − α2 − δ)/cos δ, whose range follows from those of both terms; and the squares of the
    singular values of B add up to f ≤ 2 + κ² + |κ|·√(κ² + 4). So the smaller one of the block is at least √2·|D|/√f.
    """
    kappa = vehicle.signed_drag_ratio
    delta, quarter = math.atan(kappa), math.pi / 2
    first, second = starts[:, :2], ends[:, :2]
    shift = np.array([-delta, delta]) + quarter
    alone = least_sine(first + shift, second + shift).min(axis=1) / math.cos(delta)
    # Columns: α1 − α2 − δ, and α1 + α2 + π/2, whose sine is the cosine of the sum.
    mix, shift = np.array([[1.0, 1.0], [-1.0, 1.0]]), np.array([-delta, quarter])
    low, high = range_of_sine(first @ mix + shift, second @ mix + shift)
    low, high = np.array([1 / math.cos(delta), abs(kappa)]) * np.stack([low, high])
    sums = (low[:, 1], high[:, 1]) if kappa > 0 else (-high[:, 1], -low[:, 1])
    minor = np.maximum(np.maximum(sums[0] - high[:, 0], low[:, 0] - sums[1]), 0.0)
    return np.asarray(
        math.sqrt(2.0) * np.minimum(alone, minor / math.sqrt(2 + kappa**2 + abs(kappa) * math.sqrt(kappa**2 + 4)))
    )


def keeps_singular_value_above(
    starts: npt.ArrayLike, ends: npt.ArrayLike, floor: float, vehicle: Vehicle = PAPER
) -> npt.NDArray[np.bool_]:
    """Return whether the least singular value is at least `floor` along each whole segment, shape (m,).

    Decided to within 1e-6 of the floor; what is closer than that counts as below.
    """
    starts, ends = np.atleast_2d(np.asarray(starts, dtype=float)), np.atleast_2d(np.asarray(ends, dtype=float))
    if _on_red(starts, ends):
        above = _bound_along_red(starts, ends, vehicle) >= floor
    else:
        above = _bounds_without_decomposition(starts, ends, vehicle)[1] >= floor
    open_ = ~above
    if open_.any():
        asked: dict[str, Any] = {"tolerance": 1e-6, "floor": floor, "each": True}
        above[open_] = least_singular_value_along(starts[open_], ends[open_], vehicle, **asked).lower >= floor
    return np.asarray(above)
