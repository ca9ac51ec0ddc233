"""What holds along a straight segment of tilt angles, not only at its ends.

A quantity with a bound between samples is minimised by branch and bound: an interval whose lower bound is good
enough is settled, any other is cut. The result brackets the true least value; nothing is decided by samples
alone. Segments are pairs of arrays of shape (m, 4) [rad].
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt

from gaitgraph.invertibility import (
    Coefficients,
    hover_thrust_shares,
    least_singular_value,
    least_singular_value_bound,
    level_determinant,
    singular_values_on_red,
)
from gaitgraph.vehicle import PAPER, Vehicle

__all__ = [
    "Least",
    "keeps_singular_value_above",
    "largest_residual",
    "least_along",
    "least_level_determinant",
    "least_singular_value_along",
    "least_singular_value_of_all",
    "thrust_shares_along",
    "thrusts_push_up",
    "where_thrusts_vanish",
]

FloatArray = npt.NDArray[np.float64]
Value = Callable[[FloatArray], FloatArray]
Bound = Callable[[FloatArray, FloatArray, FloatArray, FloatArray], FloatArray]

_BATCH = 1 << 15
# A round over fewer open intervals than these costs the same however many there are: each is cut finer than in two.
_FEW = 64
_SHORT = 1e-12  # fractions nearer than this are halved, to the end of what floats resolve
_HALF, _SIXTEENTHS = np.array([[0.5]]), np.arange(1, 16)[:, None] / 16
_MOST_HALVINGS = 20_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Least:
    """The least value along each of m segments: certainly in [lower, upper].

    Parameters
    ----------
    lower, upper
        The bracket, shape (m,); `upper` is attained at `fraction`.
    fraction
        Where, from 0 at a segment's start to 1 at its end, shape (m,).
    """

    lower: FloatArray
    upper: FloatArray
    fraction: FloatArray

    def worst(self) -> tuple[float, float, int, float]:
        """Return (lower, upper, segment, fraction) of the least over all segments."""
        k = int(np.argmin(self.upper))
        return float(self.lower.min()), float(self.upper[k]), k, float(self.fraction[k])


def least_along(
    starts: npt.ArrayLike,
    ends: npt.ArrayLike,
    value: Value,
    bound: Bound,
    *,
    tolerance: float,
    floor: float = math.inf,
    each: bool = False,
    enough: FloatArray | None = None,
    known: float = math.inf,
    at_ends: tuple[FloatArray, FloatArray] | None = None,
) -> Least:
    """Bracket the least of a function along straight segments.

    Parameters
    ----------
    starts, ends
        The segments, shape (m, 4), m ≥ 1.
    value
        The function, from (k, 4) to (k,).
    bound
        A lower bound of the function on an interval from its values at both ends and the ends themselves.
    tolerance
        Width at which a bracket is narrow enough.
    floor
        If given, a segment is settled as soon as the comparison of its least value with `floor` is.
    each
        Whether every segment's own bracket is narrowed, or only that of the least of all.
    enough
        If given, for each segment a value from which on nothing more needs to be known, shape (m,).
    known
        A value that is attained elsewhere: without `each`, what certainly stays above it is not narrowed.
    at_ends
        The function's values at starts and ends, if they are at hand.

    Notes
    -----
    Intervals are halved in batches, the latest first, so that memory stays bounded however many are open; a few are
    cut into sixteen, which saves rounds. Not guaranteed: that every bracket is as narrow as `tolerance`. Work is
    bounded; `lower` is always valid.
    """
    starts, ends = (
        np.atleast_2d(np.asarray(starts, dtype=float)),
        np.atleast_2d(np.asarray(ends, dtype=float)),
    )
    steps = ends - starts
    f0, f1 = at_ends if at_ends is not None else (value(starts), value(ends))
    best = np.minimum(f0, f1)
    fraction = np.where(f1 < f0, 1.0, 0.0)
    lower = best.copy()
    overall = min(known, float(best.min()))
    segments = np.arange(len(starts))
    batches: list[tuple[Any, ...]] = [(segments, np.zeros(len(starts)), np.ones(len(starts)), starts, ends, f0, f1)]
    halvings = 0
    while batches:
        segment, low, high, p0, p1, f0, f1 = batches.pop()
        least = bound(f0, f1, p0, p1)
        reference = best[segment] if each else np.full(segment.size, overall)
        open_ = (least < reference - tolerance) & (least < floor)
        if math.isfinite(floor):
            open_ &= reference >= floor
        if enough is not None:
            open_ &= least < enough[segment]
        middle = (low + high) / 2
        # A fraction that no longer splits the interval is the end of what floats resolve.
        whole = open_ & ~((middle > low) & (middle < high))
        least[whole] = np.minimum(f0, f1)[whole]
        open_ &= ~whole
        halvings += int(open_.sum())
        if halvings > _MOST_HALVINGS:
            open_[:] = False
        np.minimum.at(lower, segment[~open_], least[~open_])
        if not open_.any():
            continue
        segment, low, high = segment[open_], low[open_], high[open_]
        finely = segment.size <= _FEW and float((high - low).min()) > _SHORT
        cuts = low + (_SIXTEENTHS if finely else _HALF) * (high - low)
        pm = starts[segment] + cuts[..., None] * steps[segment]
        fm = value(pm.reshape(-1, 4)).reshape(cuts.shape)
        number, cut, found = np.tile(segment, len(cuts)), cuts.ravel(), fm.ravel()
        order = np.argsort(found, kind="stable")[::-1]
        better = order[found[order] < best[number[order]]]
        best[number[better]], fraction[number[better]] = found[better], cut[better]
        overall = min(overall, float(found.min()))
        # The first piece of every interval, then the second: each ends where the next begins.
        at = np.concatenate([low[None], cuts, high[None]])
        p = np.concatenate([p0[None, open_], pm, p1[None, open_]])
        f = np.concatenate([f0[None, open_], fm, f1[None, open_]])
        pieces = (
            np.tile(segment, len(cuts) + 1),
            *(side.ravel() for side in (at[:-1], at[1:])),
            *(side.reshape(-1, 4) for side in (p[:-1], p[1:])),
            *(side.ravel() for side in (f[:-1], f[1:])),
        )
        batches += [tuple(part[k : k + _BATCH] for part in pieces) for k in range(0, len(pieces[0]), _BATCH)]
    return Least(lower=np.minimum(lower, best), upper=best, fraction=fraction)


def level_determinant_curvature(start: FloatArray, step: FloatArray, coefficients: Coefficients) -> FloatArray:
    """Return a bound of |d²R/ds²| along start + s·step, for s in [0, 1], shape (m,).

    R is a sum of products of two sinusoids in the differences and sums of opposite arms' angles. A product's
    second derivative is at most its size times the square of the sum of both frequencies. Where one factor is
    constant along the segment, as on both sheets, its value at the start replaces its size.
    """
    form, both = _form_of_sums(coefficients)
    m13, q13 = np.abs(step[:, 0] - step[:, 2]), np.abs(step[:, 0] + step[:, 2])
    m24, q24 = np.abs(step[:, 1] - step[:, 3]), np.abs(step[:, 1] + step[:, 3])

    def crossed(weights: FloatArray, sums: FloatArray, slow: FloatArray, fast: FloatArray) -> FloatArray:
        size = math.hypot(*weights)
        now = np.abs(weights[0] * np.cos(sums) + weights[1] * np.sin(sums))
        local = fast**2 * (now + size * slow) + size * slow * (2 * fast + slow)
        return np.asarray(np.minimum(local, size * (slow + fast) ** 2))

    return np.asarray(
        abs(form[0, 0]) * (m13 + m24) ** 2
        + crossed(form[0, 1:], start[:, 1] + start[:, 3], q24, m13)
        + crossed(form[1:, 0], start[:, 0] + start[:, 2], q13, m24)
        + both * (q13 + q24) ** 2
    )


@lru_cache(maxsize=32)
def _form_of_sums(coefficients: Coefficients) -> tuple[FloatArray, float]:
    """Return the form of R in (cos of the difference, cos and sin of the sum) of each pair, and a norm of its end."""
    mix = np.array([[0.5, 0.5, 0.0], [0.5, -0.5, 0.0], [0.0, 0.0, 1.0]])
    form = mix.T @ coefficients.bilinear_form @ mix
    return form, float(np.linalg.norm(form[1:, 1:], 2))


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
    >>> from gaitgraph.invertibility import coefficients_of
    >>> round(least_level_determinant(corners[:1], corners[1:], coefficients_of(), sign=-1).worst()[0], 3)
    3.197
    """

    def value(alpha: FloatArray) -> FloatArray:
        return np.asarray(sign * level_determinant(alpha, coefficients))

    def bound(f0: FloatArray, f1: FloatArray, p0: FloatArray, p1: FloatArray) -> FloatArray:
        return np.minimum(f0, f1) - level_determinant_curvature(p0, p1 - p0, coefficients) / 8

    return least_along(
        starts, ends, value, bound, tolerance=tolerance, floor=floor, each=each, known=known, at_ends=at_ends
    )


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
    alone = math.sqrt(2.0) / math.cos(delta) * _least_sine(phases[0], phases[1]).min(axis=1)
    enough = alone if each else np.full(len(alone), alone.min())
    third = least_along(starts, ends, value, bound, enough=enough, **asked)
    fraction = np.where(third.upper <= alone, third.fraction, _where_least_sine(phases[0], phases[1]))
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
    alone = _least_sine(first + shift, second + shift).min(axis=1) / math.cos(delta)
    # Columns: α1 − α2 − δ, and α1 + α2 + π/2, whose sine is the cosine of the sum.
    mix, shift = np.array([[1.0, 1.0], [-1.0, 1.0]]), np.array([-delta, quarter])
    low, high = _range_of_sine(first @ mix + shift, second @ mix + shift)
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


def largest_sine(x0: FloatArray, x1: FloatArray) -> FloatArray:
    """Return the largest |sin| on intervals: 1 if a peak lies inside, else the larger end."""
    peak = np.floor(x0 / math.pi - 0.5) != np.floor(x1 / math.pi - 0.5)
    return np.where(peak, 1.0, np.maximum(np.abs(np.sin(x0)), np.abs(np.sin(x1))))


def _least_sine(x0: FloatArray, x1: FloatArray) -> FloatArray:
    """Return the least |sin| on intervals: 0 if a zero lies inside, else the smaller end (|sin| is concave)."""
    zero = np.floor(x0 / math.pi) != np.floor(x1 / math.pi)
    return np.where(zero, 0.0, np.minimum(np.abs(np.sin(x0)), np.abs(np.sin(x1))))


def _range_of_sine(x0: FloatArray, x1: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the least and the largest sin on intervals: ±1 if a peak lies inside, else those of the ends."""
    s0, s1, turn = np.sin(x0), np.sin(x1), 2 * math.pi
    top = np.floor(x0 / turn - 0.25) != np.floor(x1 / turn - 0.25)
    bottom = np.floor(x0 / turn + 0.25) != np.floor(x1 / turn + 0.25)
    return np.where(bottom, -1.0, np.minimum(s0, s1)), np.where(top, 1.0, np.maximum(s0, s1))


def _where_least_sine(x0: FloatArray, x1: FloatArray) -> FloatArray:
    """Return where, as a fraction, the least |sin| of several phases, shape (m, k), is met on intervals, shape (m,)."""
    ends = np.stack([np.abs(np.sin(x0)), np.abs(np.sin(x1))], axis=-1)
    zero = np.maximum(np.floor(x0 / math.pi), np.floor(x1 / math.pi)) * math.pi
    crossing = np.floor(x0 / math.pi) != np.floor(x1 / math.pi)
    fraction = np.where(ends[..., 1] < ends[..., 0], 1.0, 0.0)
    fraction = np.where(crossing, (zero - x0) / np.where(crossing, x1 - x0, 1.0), fraction)
    least = np.where(crossing, 0.0, ends.min(axis=-1))
    return np.asarray(np.take_along_axis(fraction, np.argmin(least, axis=1)[:, None], axis=1)[:, 0])


def _residual_phases(alpha: FloatArray, delta: float) -> tuple[FloatArray, ...]:
    a1, a2, a3, a4 = alpha.T
    return a1 + a3 - 2 * delta, a2 - a4, a1 - a3, a2 + a4 + 2 * delta


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
        x, y, u, v = (np.abs(np.sin(phase)) for phase in _residual_phases(alpha, coefficients.delta))
        return np.asarray(-scale * np.maximum(x * y, u * v))

    def bound(f0: FloatArray, f1: FloatArray, p0: FloatArray, p1: FloatArray) -> FloatArray:
        ends0, ends1 = _residual_phases(p0, coefficients.delta), _residual_phases(p1, coefficients.delta)
        x, y, u, v = (largest_sine(a, b) for a, b in zip(ends0, ends1, strict=True))
        return -scale * np.maximum(x * y, u * v)

    return least_along(starts, ends, value, bound, tolerance=tolerance, known=known)


def _inputs_along(p0: FloatArray, p1: FloatArray, vehicle: Vehicle) -> tuple[FloatArray, FloatArray, Any]:
    """Return the least and largest |w₀| of each rotor on intervals, shape (m, 4), and whether all thrusts push up.

    Each entry of w₀ is a product of a sine and a cosine of linear functions of α.
    """
    delta = math.atan(vehicle.signed_drag_ratio)
    shift = np.array([-delta, delta, -delta, delta])
    b0, b1 = p0 + shift, p1 + shift
    quarter = math.pi / 2
    # Two sums of opposite arms, then the four cosines, as sines; the factors of w₀ are one of either.
    s0, s1 = (np.column_stack([b[:, 1] + b[:, 3], b[:, 0] + b[:, 2], b + quarter]) for b in (b0, b1))
    sums, opposite = [0, 1, 0, 1], [4, 5, 2, 3]
    least, largest, sines = _least_sine(s0, s1), largest_sine(s0, s1), np.sin((s0 + s1) / 2)
    low, high = (side[:, sums] * side[:, opposite] for side in (least, largest))
    signs = np.array([1, -1, 1, -1]) * np.sign(sines[:, sums] * sines[:, opposite])
    turns = 2 * math.pi * np.rint((p0 + p1) / (4 * math.pi))
    upright = np.maximum(np.abs(p0 - turns), np.abs(p1 - turns)).max(axis=-1) <= quarter + 1e-9
    upward = (low > 0).all(axis=-1) & (np.abs(signs.sum(axis=-1)) == 4) & upright
    return low, high, upward


def thrusts_push_up(starts: npt.ArrayLike, ends: npt.ArrayLike, vehicle: Vehicle = PAPER) -> npt.NDArray[np.bool_]:
    """Return whether all hover thrusts are positive along whole segments, shape (m,).

    Decided exactly: each factor of w₀ keeps its sign, and no rotor is tilted beyond π/2, where a positive thrust
    would push down.
    """
    p0, p1 = np.atleast_2d(np.asarray(starts, dtype=float)), np.atleast_2d(np.asarray(ends, dtype=float))
    return np.asarray(_inputs_along(p0, p1, vehicle)[2])


def where_thrusts_vanish(start: FloatArray, end: FloatArray, vehicle: Vehicle = PAPER) -> float:
    """Return where on a segment, as a fraction, a factor of the zero-moment inputs is least, zero if one vanishes."""
    delta = math.atan(vehicle.signed_drag_ratio)
    shift = np.array([-delta, delta, -delta, delta])
    phases = []
    for alpha in (start, end):
        beta = alpha + shift
        phases.append(np.concatenate([[beta[1] + beta[3], beta[0] + beta[2]], beta + math.pi / 2])[None])
    return float(_where_least_sine(phases[0], phases[1])[0])


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
    upward = _inputs_along(starts, ends, vehicle)[2]

    def shares(alpha: FloatArray) -> FloatArray:
        return hover_thrust_shares(alpha, vehicle)

    def extremes(p0: FloatArray, p1: FloatArray, *, smallest: bool) -> FloatArray:
        low, high, _ = _inputs_along(p0, p1, vehicle)
        quarter = math.pi / 2
        cosine = (largest_sine if smallest else _least_sine)(p0 + quarter, p1 + quarter)
        own, others = (low, high) if smallest else (high, low)
        carried = others * cosine
        rest = carried.sum(axis=-1, keepdims=True) - carried
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(np.where(own > 0, own / (own * cosine + rest), 0.0))

    def least_bound(f0: FloatArray, f1: FloatArray, p0: FloatArray, p1: FloatArray) -> FloatArray:
        return np.asarray(extremes(p0, p1, smallest=True).min(axis=-1))

    def largest_bound(f0: FloatArray, f1: FloatArray, p0: FloatArray, p1: FloatArray) -> FloatArray:
        return np.asarray(-extremes(p0, p1, smallest=False).max(axis=-1))

    def bracket(value: Value, bound: Bound, attained: float) -> Least:
        lower, upper = np.full(len(starts), np.nan), np.full(len(starts), np.nan)
        fraction = np.zeros(len(starts))
        if upward.any():
            found = least_along(
                starts[upward], ends[upward], value, bound, tolerance=tolerance, each=each, known=attained
            )
            lower[upward], upper[upward], fraction[upward] = found.lower, found.upper, found.fraction
        return Least(lower=lower, upper=upper, fraction=fraction)

    least = bracket(lambda alpha: shares(alpha).min(axis=-1), least_bound, known[0])
    largest = bracket(lambda alpha: -shares(alpha).max(axis=-1), largest_bound, known[1])
    return upward, least, largest
