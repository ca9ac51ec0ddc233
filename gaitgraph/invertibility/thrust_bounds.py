"""Hover thrusts along segments: whether they push up, and brackets of the least and the largest."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from gaitgraph.invertibility.branch_and_bound import Least, Several, least_of_bent, least_of_each
from gaitgraph.invertibility.matrices import zero_moment_inputs
from gaitgraph.invertibility.sine_bounds import least_sine, where_least_sine
from gaitgraph.vehicle import PAPER, Vehicle

__all__ = ["thrust_shares_along", "thrusts_push_up", "where_thrusts_vanish"]

FloatArray = npt.NDArray[np.float64]

_NO_LIFT = 1e-300  # divides without an overflow


def thrusts_push_up(starts: npt.ArrayLike, ends: npt.ArrayLike, vehicle: Vehicle = PAPER) -> npt.NDArray[np.bool_]:
    """Return whether all hover thrusts are positive along whole segments, shape (m,).

    Decided exactly: each factor of w₀ keeps its sign, and no rotor is tilted beyond π/2, where a positive thrust
    would push down.
    """
    p0, p1 = np.atleast_2d(np.asarray(starts, dtype=float)), np.atleast_2d(np.asarray(ends, dtype=float))
    s0, s1 = _phases_of_inputs(p0, vehicle), _phases_of_inputs(p1, vehicle)
    # Each rotor has one of the two sums of opposite arms, then the cosine of its opposite arm.
    factors = np.sign(np.sin((s0 + s1) / 2))
    signs = np.array([1, -1, 1, -1]) * factors[:, [0, 1, 0, 1]] * factors[:, [4, 5, 2, 3]]
    kept = (least_sine(s0, s1) > 0).all(axis=-1) & (np.abs(signs.sum(axis=-1)) == 4)
    turns = 2 * math.pi * np.rint((p0 + p1) / (4 * math.pi))
    upright = np.maximum(np.abs(p0 - turns), np.abs(p1 - turns)).max(axis=-1) <= math.pi / 2 + 1e-9
    return np.asarray(kept & upright)


def _phases_of_inputs(alpha: FloatArray, vehicle: Vehicle) -> FloatArray:
    """Return phases whose sines are the factors of w₀: two sums of opposite arms, then four cosines, shape (m, 6)."""
    delta = math.atan(vehicle.signed_drag_ratio)
    beta = alpha + np.array([-delta, delta, -delta, delta])
    return np.concatenate([beta[:, 1::-1] + beta[:, 3:1:-1], beta + math.pi / 2], axis=-1)


def where_thrusts_vanish(start: FloatArray, end: FloatArray, vehicle: Vehicle = PAPER) -> float:
    """Return where on a segment, as a fraction, a factor of the zero-moment inputs is least, zero if one vanishes."""
    return float(where_least_sine(*(_phases_of_inputs(alpha[None], vehicle) for alpha in (start, end)))[0])


def thrust_shares_along(
    starts: npt.ArrayLike,
    ends: npt.ArrayLike,
    vehicle: Vehicle = PAPER,
    *,
    tolerance: float = 1e-4,
    each: bool = False,
    known: tuple[float, float] = (math.inf, math.inf),
) -> tuple[npt.NDArray[np.bool_], Least, Least]:
    """Bracket the hover thrusts along segments.

    Returns
    -------
    upward
        Whether every thrust is positive on the whole segment; see :func:`thrusts_push_up`.
    least
        Bracket of the least thrust share T/(m·g); NaN where not `upward`.
    largest
        Bracket of the least of −T/(m·g), that is of minus the largest share; NaN where not `upward`.
    """
    starts, ends = (
        np.atleast_2d(np.asarray(starts, dtype=float)),
        np.atleast_2d(np.asarray(ends, dtype=float)),
    )
    upward = thrusts_push_up(starts, ends, vehicle)
    lower, upper, fraction = np.full((3, 2, len(starts)), np.nan)
    fraction[:] = 0.0
    if upward.any():

        def values(alpha: FloatArray) -> tuple[FloatArray, ...]:
            return _shares_and_parts(alpha, vehicle)

        def bounds(v0: Several, v1: Several, p0: FloatArray, p1: FloatArray) -> list[FloatArray]:
            return _bounds_of_shares(v0, v1, p1 - p0, vehicle)

        found = least_of_each(starts[upward], ends[upward], values, bounds, tolerance=tolerance, each=each, known=known)
        for k, one in enumerate(found):
            lower[k, upward], upper[k, upward], fraction[k, upward] = one.lower, one.upper, one.fraction
    least, largest = (Least(lower=lower[k], upper=upper[k], fraction=fraction[k]) for k in range(2))
    return upward, least, largest


def _shares_and_parts(alpha: FloatArray, vehicle: Vehicle) -> tuple[FloatArray, ...]:
    """Return the least hover thrust share, minus the largest, then |w₀| of each rotor and V, where all push up.

    There a share is |wᵢ|/V with V = Σ|wⱼ|·cos αⱼ; see :func:`gaitgraph.invertibility.matrices.hover_thrust_shares`.
    """
    inputs = np.abs(zero_moment_inputs(alpha, vehicle))
    lift = (inputs * np.cos(alpha)).sum(axis=-1)
    return inputs.min(axis=-1) / lift, -inputs.max(axis=-1) / lift, *inputs.T, lift


def _bounds_of_shares(v0: Several, v1: Several, step: FloatArray, vehicle: Vehicle) -> list[FloatArray]:
    """Return lower bounds of the least share and of minus the largest on intervals where all rotors push up.

    |wᵢ| and V are products of sines of linear functions, whose second derivatives are bounded. So |wᵢ| − c·V is, where
    c is the least share at both ends; where that stays positive the share is nowhere below c, and elsewhere below by no
    more than it lacks over the least of V. The same holds for the largest share, with signs turned.
    """
    squares, sums = step**2, (step[:, :2] + step[:, 2:])[:, ::-1] ** 2
    # The second derivative of a product of two sinusoids is at most the sum of both frequencies squared. V is
    # ±sin(Σ2 + 2δ)·(cos(Σ1 − δ) + cos δ·cos Δ1) ± sin(Σ1 − 2δ)·(cos(Σ2 + δ) + cos δ·cos Δ2), with the sums Σ and the
    # differences Δ of opposite arms.
    bends = np.concatenate([sums + squares[:, 2:], sums + squares[:, :2]], axis=1).T
    lift_bend = 2 * (sums.sum(axis=1) + squares.sum(axis=1) / math.hypot(1.0, vehicle.drag_ratio))
    inputs0, lift0, inputs1, lift1 = np.asarray(v0[2:6]), v0[6], np.asarray(v1[2:6]), v1[6]
    least_lift = np.maximum(least_of_bent(lift0, lift1, lift_bend), _NO_LIFT)
    out = []
    for k, sense in enumerate((1.0, -1.0)):
        c = np.minimum(v0[k], v1[k])
        apart0, apart1 = sense * inputs0 - c * lift0, sense * inputs1 - c * lift1
        lacking = least_of_bent(apart0, apart1, bends + np.abs(c) * lift_bend).min(axis=0)
        out.append(c + np.minimum(lacking, 0.0) / least_lift)
    return [np.maximum(out[0], 0.0), out[1]]
