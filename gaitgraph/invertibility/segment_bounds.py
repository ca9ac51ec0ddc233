"""Bounds along straight segments of tilt angles: R, residuals, singular values and hover thrusts between two rows.

Each function brackets the least value of a quantity along segments by branch and bound, so that a check holds between
two rows and not only at them. Starts and ends have shape (m, 4) [rad]; options are those of :func:`least_of_each`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, reduce
from itertools import accumulate, chain, pairwise
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import angles_from
from gaitgraph.errors import InputError
from gaitgraph.invertibility.matrices import (
    Coefficients,
    FloatArray,
    Sines,
    blocks_on_red,
    least_of_blocks,
    least_singular_value,
    sensitivity_phases,
    singular_value_rate,
    thrust_signs,
    zero_moment_inputs,
)
from gaitgraph.vehicle import PAPER, Vehicle

Value = Callable[[FloatArray], FloatArray]
Bound = Callable[[FloatArray, FloatArray, FloatArray, FloatArray], FloatArray]

_BATCH = 1 << 15
# An iteration over few points costs the same for any number of them: a few intervals are cut finer.
_FEW, _PIECES = 32, 32
_LONG = 0.1  # a longer segment is hardly settled without a cut to this length [rad]
_SHORT = (
    1e-12  # fractions nearer than this are halved, to the end of what floats resolve
)
_TINY = float(np.finfo(float).tiny)
_IDLE = 1e-9  # a zero-moment input below this counts as zero where its sign is proven by bounds
_MOST_HALVINGS = 20_000_000


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Least:
    """The least value along each of m segments, in [lower, upper], shape (m,); `upper` is attained at `fraction`."""

    lower: FloatArray
    upper: FloatArray
    fraction: FloatArray

    def worst(self) -> tuple[float, float, int, float]:
        """Return (lower, upper, segment, fraction) of the least over all segments."""
        k = int(self.upper.argmin())
        return float(self.lower.min()), float(self.upper[k]), k, float(self.fraction[k])


class Quantity(NamedTuple):
    """Functions of the tilt angles that :func:`least_of_each` brackets, each to within its tolerance.

    `values` has `size` rows, of shape (k,) for k points: the functions, one for each tolerance, and what `bounds`
    needs. `bounds` returns lower bounds of the functions on intervals from the rows at both ends and the ends
    themselves, shape (k, n).
    """

    values: Callable[[Any], FloatArray]
    bounds: Callable[[FloatArray, FloatArray, FloatArray, FloatArray], FloatArray]
    tolerances: tuple[float, ...]
    size: int


def checked_segments(
    starts: npt.ArrayLike, ends: npt.ArrayLike, count: int = 4
) -> tuple[FloatArray, FloatArray]:
    """Return the ends of one or more segments of `count` tilt angles as arrays of one shape (m, count); else InputError."""
    both = []
    for name, points in (("starts", starts), ("ends", ends)):
        angles = angles_from(points, name)
        if angles.ndim != 2 or angles.shape[1] != count or not len(angles):
            raise InputError(
                f"{name} must have the shape (m, {count}) with m at least 1, got {angles.shape}",
                field=name,
            )
        both.append(angles)
    if len(both[0]) != len(both[1]):
        raise InputError(
            f"ends must be as many as starts, {len(both[0])}, got {len(both[1])}",
            field="ends",
        )
    return both[0], both[1]


def least_along(
    starts: FloatArray,
    ends: FloatArray,
    value: Value,
    bound: Bound,
    *,
    tolerance: float,
    **options: Any,
) -> Least:
    """Bracket the least of one function, from (k, n) to (k,); the options are those of :func:`least_of_each`."""
    quantity = Quantity(
        lambda alpha: value(alpha)[None],
        lambda v0, v1, *ends: bound(v0[0], v1[0], *ends)[None],
        (tolerance,),
        1,
    )
    return least_of_each(starts, ends, [quantity], prepare=None, **options)[0]


def least_of_each(
    starts: FloatArray,
    ends: FloatArray,
    quantities: Sequence[Quantity],
    *,
    known: float | tuple[float, ...] = math.inf,
    prepare: Callable[[FloatArray], Any] | None = Sines.of,
    points: Any = None,
    floor: float = math.inf,
    each: bool = False,
    most: int | None = None,
) -> tuple[Least, ...]:
    """Bracket the least of each function of some quantities along straight segments, shape (m, n), all in one search.

    What `prepare` returns of points is given to `values`, and few segments are cut to short pieces at once; None for
    neither. `points` are those that consecutive segments join, prepared, shape (m + 1,), if at hand.

    An interval whose lower bound is good enough is settled, any other is cut, until the bracket of every function is as
    narrow as its tolerance: that of every segment with `each`, else that of the least of all and of `known`, a value
    that each function attains elsewhere. A segment is settled earlier once its least value is known to be above or
    below `floor`.

    Intervals are halved in batches, the latest first, so that memory is bounded. Work is bounded too, by `most`
    halvings, so that a bracket may stay wider than its tolerance; `lower` is always valid.
    """
    count, most = len(starts), _MOST_HALVINGS if most is None else most
    steps, origins, base = (
        (ends - starts).T,
        starts.T,
        1 + starts.shape[1],
    )  # base: row of the first value
    rows = [*accumulate((quantity.size for quantity in quantities), initial=base)]
    which = np.array(
        [
            row + k
            for row, one in zip(rows, quantities, strict=False)
            for k in range(len(one.tolerances))
        ]
    )
    margin = np.array(
        [tolerance for quantity in quantities for tolerance in quantity.tolerances]
    )[:, None]

    def values(prepared: Any) -> FloatArray:
        return np.concatenate([quantity.values(prepared) for quantity in quantities])

    def bounds(first: FloatArray, last: FloatArray) -> FloatArray:
        angles = first[1:base].T, last[1:base].T
        parts = zip(quantities, pairwise(rows), strict=True)
        return np.concatenate(
            [
                quantity.bounds(first[a:b], last[a:b], *angles)
                for quantity, (a, b) in parts
            ]
        )

    def nodes_at(
        fraction: FloatArray, origin: FloatArray, step: FloatArray
    ) -> FloatArray:
        """Return nodes, shape (rows, j, k): the fraction of the segment, the angles and the values."""
        places = origin[:, None] + fraction * step[:, None]
        alpha = places.reshape(base - 1, -1).T
        found = values(alpha if prepare is None else prepare(alpha))
        return np.concatenate(
            [fraction[None], places, found.reshape(-1, *fraction.shape)]
        )

    segment, halvings = np.arange(count), 0
    pieces = 1
    if prepare is not None and count <= min(_FEW, most):
        pieces = max(1, min(_PIECES, math.ceil(float(np.abs(steps).max()) / _LONG)))
    fractions = np.arange(pieces + 1) / pieces
    if pieces == 1 and points is not None:
        found = values(points)
        sides = ((0.0, starts, found[:, :-1]), (1.0, ends, found[:, 1:]))
        nodes = np.stack(
            [np.concatenate([np.full((1, count), s), p.T, v]) for s, p, v in sides],
            axis=1,
        )
    else:
        nodes = nodes_at(fractions[:, None] + np.zeros(count), origins, steps)
    found = nodes[which]
    best, fraction = found.min(axis=1), fractions[found.argmin(axis=1)]
    lower, overall = best.copy(), np.minimum(best.min(axis=1), known)[:, None]
    offsets = (
        count * np.arange(len(which))[:, None]
    )  # of functions in flat arrays of shape (f, m)
    batches: list[tuple[Any, FloatArray, FloatArray]] = []
    while True:
        # The first piece of every interval, then the second: each ends where the next begins.
        pieced = np.repeat(segment[None], nodes.shape[1] - 1, axis=0).reshape(-1)
        firsts, lasts = (
            nodes[:, :-1].reshape(len(nodes), -1),
            nodes[:, 1:].reshape(len(nodes), -1),
        )
        for start in range(0, len(pieced), _BATCH):
            part = slice(start, start + _BATCH)
            batches.append((pieced[part], firsts[:, part], lasts[:, part]))
        count = 0
        while batches and not count:
            segment, first, last = batches.pop()
            least = bounds(first, last)
            reference: Any = best[:, segment] if each else overall
            unsettled = least < (
                np.minimum(reference - margin, floor)
                if floor < math.inf
                else reference - margin
            )
            if floor < math.inf:
                unsettled &= reference >= floor
            open_ = np.logical_or.reduce(unsettled, axis=0)
            count = int(np.count_nonzero(open_))
            if count:
                width = last[0] - first[0]
                finely = float(width.min()) > _SHORT
                if not finely:
                    middle = first[0] + width / 2
                    # A fraction that no longer splits the interval is the end of what floats resolve.
                    whole = open_ & ~((middle > first[0]) & (middle < last[0]))
                    least[:, whole] = np.minimum(first[which], last[which])[:, whole]
                    open_ &= ~whole
                    count = int(np.count_nonzero(open_))
                halvings += count
                if halvings > most:
                    open_[:], count = False, 0
            settled = ~open_ if count else slice(None)
            at = (offsets + segment[settled]).reshape(-1)
            np.minimum.at(lower.reshape(-1), at, least[:, settled].reshape(-1))
        if not count:
            break
        segment, first, last, width = (
            segment[open_],
            first[:, open_],
            last[:, open_],
            width[open_],
        )
        pieces = _PIECES if finely and count <= _FEW else 2
        inner = first[0] + np.arange(1, pieces)[:, None] / pieces * width
        inner = nodes_at(inner, origins[:, segment], steps[:, segment])
        found = inner[which]
        better = found.min(axis=1) < best[:, segment]
        for k in np.flatnonzero(better.any(axis=1)).tolist():
            of = np.flatnonzero(better[k])
            nearest = found[k, :, of].argmin(axis=1)
            lowest = found[k, nearest, of]
            order = np.argsort(lowest, kind="stable")[
                ::-1
            ]  # the last of a segment is its least
            at = segment[of[order]]
            best[k, at], fraction[k, at] = lowest[order], inner[0, nearest, of][order]
            overall[k] = min(overall[k, 0], float(lowest.min()))
        nodes = np.concatenate([first[:, None], inner, last[:, None]], axis=1)
    lower = np.minimum(lower, best)
    return tuple(
        Least(lower=lower[k], upper=best[k], fraction=fraction[k])
        for k in range(len(which))
    )


def least_of_bent(f0: FloatArray, f1: FloatArray, bend: FloatArray) -> FloatArray:
    """Return a lower bound of functions on intervals from their values at both ends, if |f''| ≤ `bend` there.

    A function stays above its chord minus bend·s·(1 − s)/2, which is least at an end where the chord is steep.
    """
    flat = np.maximum(0.5 * bend - np.abs(f1 - f0), 0.0)
    return np.asarray(np.minimum(f0, f1) - 0.5 * flat * flat / np.maximum(bend, _TINY))


def largest_sine(
    x0: FloatArray, x1: FloatArray, larger: FloatArray | None = None
) -> FloatArray:
    """Return the largest |sin| on intervals: 1 if a peak lies inside, else that of the larger end, if at hand."""
    peak = np.floor(x0 / math.pi - 0.5) != np.floor(x1 / math.pi - 0.5)
    return np.where(
        peak,
        1.0,
        np.maximum(np.abs(np.sin(x0)), np.abs(np.sin(x1)))
        if larger is None
        else larger,
    )


def where_least_sine(x0: FloatArray, x1: FloatArray) -> FloatArray:
    """Return the fraction at which the least |sin| of several phases, shape (m, k), is on intervals, shape (m,)."""
    ends = np.stack([np.abs(np.sin(x0)), np.abs(np.sin(x1))], axis=-1)
    zero = np.maximum(np.floor(x0 / math.pi), np.floor(x1 / math.pi)) * math.pi
    crossing = np.floor(x0 / math.pi) != np.floor(x1 / math.pi)
    fraction = np.where(ends[..., 1] < ends[..., 0], 1.0, 0.0)
    fraction = np.where(
        crossing, (zero - x0) / np.where(crossing, x1 - x0, 1.0), fraction
    )
    least = np.where(crossing, 0.0, ends.min(axis=-1))
    return np.asarray(
        np.take_along_axis(fraction, np.argmin(least, axis=1)[:, None], axis=1)[:, 0]
    )


def level_determinant_curvature(
    start: FloatArray, step: FloatArray, coefficients: Coefficients
) -> FloatArray:
    """Return a bound of |d²R/ds²| along start + s·step, for s in [0, 1], shape (m,).

    R is a sum of products of two sinusoids in the differences and sums of opposite arms' angles, of two differences
    only with a rotor height. Its second derivative is at most their size times the square of the sum of both
    frequencies. A factor that hardly moves, as on both sheets, counts with its value at the start instead of its size.
    """
    factors, sizes, both = _form_of_sums(coefficients)
    start, step = start.T, step.T
    turns, sums = np.abs(step[:2] - step[2:]), np.abs(step[:2] + step[2:])
    # A difference of one pair turns with the sum of the other: Δ1 with Σ2, then Δ2 with Σ1.
    slow, bend = sums[::-1], both * (sums[0] + sums[1]) ** 2
    if not turns.any():
        crossed = sizes * slow**2
    else:
        at = (start[:2] + start[2:])[::-1]
        now = np.abs(factors[0] * np.cos(at) + factors[1] * np.sin(at))
        local = turns**2 * (now + sizes * slow) + sizes * slow * (2 * turns + slow)
        crossed = np.minimum(local, sizes * (slow + turns) ** 2)
        bend = bend + abs(coefficients.cross) * (turns[0] + turns[1]) ** 2
    return np.asarray(crossed[0] + crossed[1] + bend)


@lru_cache(maxsize=32)
def _form_of_sums(coefficients: Coefficients) -> tuple[FloatArray, FloatArray, float]:
    """Return the form of R in (cos of the difference, cos and sin of the sum) of each pair, in parts.

    These are the factors of cos Δ1 and cos Δ2 as columns, their sizes, and a norm of the part without differences.
    """
    mix = np.array([[0.5, 0.5, 0.0], [0.5, -0.5, 0.0], [0.0, 0.0, 1.0]])
    form = mix.T @ coefficients.bilinear_form @ mix
    factors = np.stack([form[0, 1:], form[1:, 0]], axis=1)
    return (
        factors[..., None],
        np.hypot(*factors)[:, None],
        float(np.linalg.norm(form[1:, 1:], 2)),
    )


def level_quantity(
    coefficients: Coefficients,
    signs: tuple[float, ...] = (1.0, -1.0),
    *,
    tolerances: tuple[float, ...],
) -> Quantity:
    """Return sign·R for each of some signs."""

    def values(sines: Sines) -> FloatArray:
        return np.asarray(
            np.multiply.outer(signs, sines.level_determinant(coefficients))
        )

    def bounds(
        v0: FloatArray, v1: FloatArray, p0: FloatArray, p1: FloatArray
    ) -> FloatArray:
        return least_of_bent(
            v0, v1, level_determinant_curvature(p0, p1 - p0, coefficients)
        )

    return Quantity(values, bounds, tolerances, len(signs))


def least_level_determinant(
    starts: FloatArray,
    ends: FloatArray,
    coefficients: Coefficients,
    *,
    sign: float = 1.0,
    tolerance: float = 1e-6,
    **options: Any,
) -> Least:
    """Bracket the least of sign·R along segments; a positive lower bound proves that R keeps that sign."""
    quantity = level_quantity(coefficients, (sign,), tolerances=(tolerance,))
    return least_of_each(starts, ends, [quantity], **options)[0]


def sensitivity_bends(
    p0: FloatArray, p1: FloatArray, coefficients: Coefficients
) -> tuple[FloatArray, FloatArray]:
    """Return bounds of the second derivatives of Rθ and Rφ from p0 to p1, over s in [0, 1], times |sin 2δ|, shape (m,).

    They are for a first arm along body x.
    The second derivative of sin x·sin y is at most (x'² + y'²)·|sin x|·|sin y| + 2·|x'y'|, that of sin x·E at most
    |sin x|·(|E''| + x'²·|E|) + 2·|x'E'|, E of :meth:`Sines.leaning` the difference of two cosines.
    """
    x0, x1 = (sensitivity_phases(side, coefficients) for side in (p0, p1))
    rate, size = np.abs(x1 - x0), largest_sine(x0, x1)
    # Of the two factors of Rθ, and of Rφ.
    bends = [
        (rate[i] ** 2 + rate[j] ** 2) * size[i] * size[j] + 2 * rate[i] * rate[j]
        for i, j in ((0, 1), (2, 3))
    ]
    if coefficients.cross:
        ends = [np.abs(Sines.of(side).leaning(coefficients.delta)) for side in (p0, p1)]
        steep = 1 / math.cos(coefficients.delta)  # size of the second cosine
        # Rθ has sin(α1 − α3) with the sum and the difference of arms 2 and 4, Rφ the same of the other pairs.
        for k, (sine, total, difference) in enumerate(((2, 3, 1), (1, 0, 2))):
            slope, bend = (
                rate[difference] ** n + steep * rate[total] ** n for n in (1, 2)
            )
            factor = np.maximum(ends[0][1 - k], ends[1][1 - k]) + slope / 2
            leaning = (
                size[sine] * (bend + rate[sine] ** 2 * factor) + 2 * rate[sine] * slope
            )
            bends[k] = (
                bends[k]
                + abs(coefficients.cross * math.sin(2 * coefficients.delta))
                / 2
                * leaning
            )
    return bends[0], bends[1]


def largest_residual(
    starts: FloatArray,
    ends: FloatArray,
    coefficients: Coefficients,
    *,
    tolerance: float,
    **options: Any,
) -> Least:
    """Bracket the least of −max(|Rφ|, |Rθ|) along segments, for a first arm along body x.

    Without a rotor height each is a product of two sines.
    """
    delta, turned = coefficients.delta, replace(coefficients, first_arm_angle=0.0)

    def values(sines: Sines) -> FloatArray:
        # Minus the larger, then the sizes of both, or of the factors in the order of their phases.
        sizes = np.abs(sines.sensitivities(turned))
        (first, fourth), (third, second) = sines.totals(delta), sines.differences()
        more = sizes if coefficients.cross else np.abs([first, second, third, fourth])
        return np.concatenate([-sizes.max(axis=0, keepdims=True), more])

    def bounds(
        v0: FloatArray, v1: FloatArray, p0: FloatArray, p1: FloatArray
    ) -> FloatArray:
        scale, sizes = abs(math.sin(2 * delta)), np.maximum(v0[1:], v1[1:])
        if coefficients.cross:
            sizes = sizes + np.array(sensitivity_bends(p0, p1, turned)[::-1]) / (
                8 * scale
            )
        else:
            phases = (
                sensitivity_phases(p0, coefficients),
                sensitivity_phases(p1, coefficients),
            )
            sizes = largest_sine(*phases, larger=sizes)
            sizes = sizes[::2] * sizes[1::2] / scale
        return np.asarray(-sizes.max(axis=0, keepdims=True))

    quantity = Quantity(values, bounds, (tolerance,), 3 if coefficients.cross else 5)
    return least_of_each(starts, ends, [quantity], **options)[0]


def bound_by_change(change: Callable[[FloatArray, FloatArray], FloatArray]) -> Bound:
    """Return a bound, at least 0, of functions that differ by at most change(p0, p1) along an interval."""

    def bound(
        f0: FloatArray, f1: FloatArray, p0: FloatArray, p1: FloatArray
    ) -> FloatArray:
        return np.asarray(np.maximum((f0 + f1 - change(p0, p1)) / 2, 0.0))

    return bound


def singular_value_bound(vehicle: Vehicle, *, level: bool = True) -> Bound:
    """Return a bound from values at both ends that are the least singular value or less.

    It is the larger of two: that of the rate r of change, and a closed form for short steps h. The square of the value
    is the least of ‖M·x‖² over unit x (and attitudes). Each column of M is a sinusoid of one angle, no longer than r,
    so that (‖M·x‖²)'' ≤ 2r²h² + 2rh²·‖M·x‖. Where the value is below that at both ends, ‖M·x‖ is below it plus r·h.
    """
    rate = singular_value_rate(vehicle, level=level)

    def bound(
        f0: FloatArray, f1: FloatArray, p0: FloatArray, p1: FloatArray
    ) -> FloatArray:
        change = rate * np.sqrt(((p1 - p0) ** 2).sum(axis=1))
        bend = 2 * change**2 * (1 + (np.minimum(f0, f1) + change) / rate)
        return np.asarray(
            np.maximum(
                (f0 + f1 - change) / 2,
                np.sqrt(np.maximum(least_of_bent(f0**2, f1**2, bend), 0)),
            )
        )

    return bound


def is_red(*points: FloatArray) -> bool:
    """Return whether points lie exactly on red, where α3 = α1 and α4 = α2."""
    return all(bool((side[:, :2] == side[:, 2:]).all()) for side in points)


@lru_cache(maxsize=32)
def singular_quantity(vehicle: Vehicle, *, tolerance: float, red: bool) -> Quantity:
    """Return the least singular value, level: on red in closed form, elsewhere lower bounds without decompositions.

    On red it is the least √8·|D|/G and √2·|e| of :func:`blocks_on_red`. A sinusoid e is concave where it is positive,
    and so least at an end if both have one sign, less than π apart. D and the entries are sums of sinusoids, and a
    length is convex: D − c·G lies above its chord but for their second derivatives. Where c is the smaller D/G of both
    ends, D/G is below c by no more than that over the least G. So the bound is of second order: points 0.05 rad apart
    leave about a per cent.
    """
    if not red:
        bound = singular_value_bound(vehicle)
        return Quantity(
            lambda sines: sines.least_singular_value_bound(vehicle)[None],
            lambda v0, v1, p0, p1: bound(v0[0], v1[0], p0, p1)[None],
            (tolerance,),
            1,
        )
    steep, height = 1 + vehicle.drag_ratio**2, vehicle.height_ratio
    # Bounds of |D″| and |G″| per square of the step; √2 times the latter is one of |G′| per step.
    rates = [(2 * math.sqrt(steep), math.sqrt(8 * steep))]
    if height:
        rates.append((steep + height**2, 2 * math.sqrt(steep + height**2)))

    def values(sines: Sines) -> FloatArray:
        blocks, alone = blocks_on_red(sines.cosine[:2], sines.sine[:2], vehicle)
        return np.array(
            [least_of_blocks(blocks, alone), *chain.from_iterable(blocks), *alone]
        )

    def bounds(
        v0: FloatArray, v1: FloatArray, p0: FloatArray, p1: FloatArray
    ) -> FloatArray:
        steps = (p1 - p0)[:, 1::-1].T  # of α2 and α1
        squares, least = steps[1] * steps[1] + steps[0] * steps[0], []
        for k, (bend, curve) in enumerate(rates):
            (f0, g0), (f1, g1) = v0[2 * k + 1 :][:2], v1[2 * k + 1 :][:2]
            sign = np.sign(f0)
            f0, f1 = sign * f0, sign * f1
            ratio = np.minimum(f0 / g0, f1 / g1)
            deficit = least_of_bent(
                f0 - ratio * g0, f1 - ratio * g1, (bend + ratio * curve) * squares
            )
            size = np.maximum((g0 + g1 - curve * np.sqrt(2 * squares)) / 2, 1e-100)
            least.append(2.0 * (ratio + np.minimum(deficit, 0.0) / size))
        if not height:
            e0, e1 = v0[3:], v1[3:]
            kept = (e0 * e1 > 0) & (np.abs(steps) < math.pi)
            least += [*np.where(kept, np.minimum(np.abs(e0), np.abs(e1)), 0.0)]
        return np.asarray(math.sqrt(2.0) * np.maximum(reduce(np.minimum, least), 0.0))[
            None
        ]

    return Quantity(values, bounds, (tolerance,), 5)


def bound_along_red_path(plane: FloatArray, vehicle: Vehicle) -> FloatArray:
    """Return a lower bound of the least singular value, level, between each two points (α1, α2) of red, rows (2, n)."""
    quantity, points = singular_quantity(vehicle, tolerance=math.inf, red=True), plane.T
    # The first two angles are all that red takes.
    values = quantity.values(
        Sines(plane, np.cos(plane), np.sin(plane), features=plane[:0])
    )
    least = quantity.bounds(values[:, :-1], values[:, 1:], points[:-1], points[1:])[0]
    return np.asarray(
        np.maximum((1 - 1e-12) * least - 1e-14 * (1 + vehicle.drag_ratio**2), 0.0)
    )


def least_singular_value_along(
    starts: npt.ArrayLike,
    ends: npt.ArrayLike,
    vehicle: Vehicle = PAPER,
    *,
    tolerance: float = 1e-4,
    each: bool = False,
    **options: Any,
) -> Least:
    """Bracket the least singular value of the scaled decoupling matrix, level, along segments; see :func:`decomposed`.

    Segments are of tilt angles, shape (m, 4), m ≥ 1 [rad]; InputError otherwise. The options are those of
    :func:`least_of_each`.
    """
    first, last = checked_segments(starts, ends)
    quantity = singular_quantity(vehicle, tolerance=tolerance, red=is_red(first, last))
    (found,) = least_of_each(first, last, [quantity], each=each, **options)
    return decomposed(found, first, last, vehicle, each=each)


def decomposed(
    found: Least,
    starts: FloatArray,
    ends: FloatArray,
    vehicle: Vehicle,
    *,
    each: bool = False,
) -> Least:
    """Return brackets of the least singular value with `upper` from a decomposition, unless all segments are red.

    Without `each` there is one only, where the value is least, and `upper` of other segments is infinite.
    """
    if is_red(starts, ends):
        return found
    which = np.arange(len(starts)) if each else np.array([np.argmin(found.upper)])
    upper = np.full(len(starts), np.inf)
    at = starts[which] + found.fraction[which, None] * (ends - starts)[which]
    upper[which] = least_singular_value(at, vehicle)
    return Least(
        lower=np.minimum(found.lower, upper), upper=upper, fraction=found.fraction
    )


def keeps_singular_value_above(
    starts: FloatArray, ends: FloatArray, floor: float, vehicle: Vehicle = PAPER
) -> npt.NDArray[np.bool_]:
    """Return whether the least singular value is at least `floor` along each whole segment, shape (m,).

    Decided to within 1e-6 of the floor, and off red 2e-5 of it more; what is closer than that counts as below.
    """
    found = least_singular_value_along(
        starts, ends, vehicle, tolerance=1e-6, floor=floor, each=True
    )
    return np.asarray(found.lower >= floor)


def thrusts_push_up(
    starts: FloatArray, ends: FloatArray, vehicle: Vehicle = PAPER
) -> npt.NDArray[np.bool_]:
    """Return whether all hover thrusts are positive along whole segments, no rotor beyond π/2, shape (m,); exact.

    They are products of two sines. With a rotor height they are so on red alone, where sin β1 and sin β2 must have
    opposite signs; off red their signs are then proven by bounds, and what is nearly zero does not count as positive.
    """
    sides, raised = np.array([starts.T, ends.T]), bool(vehicle.height_ratio)
    if raised and not is_red(starts, ends):
        signs = thrust_signs(vehicle)

        def value(alpha: FloatArray) -> FloatArray:
            thrusts = signs * zero_moment_inputs(alpha, vehicle)
            return np.asarray(np.maximum(thrusts.min(axis=1), -thrusts.max(axis=1)))

        def bound(
            f0: FloatArray, f1: FloatArray, p0: FloatArray, p1: FloatArray
        ) -> FloatArray:
            w0, w1 = (signs * zero_moment_inputs(side, vehicle) for side in (p0, p1))
            bends = _bends_of_inputs(p1 - p0, vehicle)[0].T
            return np.asarray(
                np.maximum(
                    *(
                        least_of_bent(s * w0, s * w1, bends).min(axis=1)
                        for s in (1.0, -1.0)
                    )
                )
            )

        kept = (
            least_along(
                starts, ends, value, bound, tolerance=0.0, floor=_IDLE, each=True
            ).lower
            >= _IDLE
        )
    else:
        # A sine keeps its sign between two multiples of π; it is negative after odd ones.
        at = _phases_of_inputs(sides, vehicle) / math.pi
        at = 0.5 * at[:, :2] if raised else at  # β2 and β1
        after = np.floor(at)
        kept = (np.ceil(at) == after[::-1] + 1).all(axis=(0, 1))
        odd = after[0] % 2 != 0
        if raised:
            kept &= odd[0] != odd[1]
        else:
            # Each rotor has one of the two sums of opposite arms, then the cosine of its opposite arm.
            negative = (odd[2:].reshape(2, 2, -1)[::-1] ^ odd[:2]).reshape(4, -1)
            kept &= (negative[1:] != negative[:-1]).all(axis=0)
    if (np.abs(sides) <= math.pi / 2).all():
        return np.asarray(kept)
    turns = 2 * math.pi * np.rint((sides[0] + sides[1]) / (4 * math.pi))
    return np.asarray(
        kept & (np.abs(sides - turns).max(axis=(0, 1)) <= math.pi / 2 + 1e-9)
    )


def _phases_of_inputs(rows: FloatArray, vehicle: Vehicle) -> FloatArray:
    """Return phases whose sines are the factors of w₀: two sums of opposite arms, then four cosines.

    Angles of shape (..., 4, m) [rad] give phases of shape (..., 6, m).
    """
    delta = math.atan(vehicle.signed_drag_ratio)
    beta = rows + np.array([[-delta], [delta], [-delta], [delta]])
    return np.concatenate(
        [beta[..., 1::-1, :] + beta[..., 3:1:-1, :], beta + math.pi / 2], axis=-2
    )


def where_thrusts_vanish(
    start: FloatArray, end: FloatArray, vehicle: Vehicle = PAPER
) -> float:
    """Return the fraction of a segment at which a factor of the zero-moment inputs is least, or vanishes."""
    if vehicle.height_ratio and not is_red(
        start[None], end[None]
    ):  # there are no factors; to 0.5 % of the segment
        at = np.linspace(0.0, 1.0, 201)
        inputs = zero_moment_inputs(start + at[:, None] * (end - start), vehicle)
        return float(at[np.argmin(np.abs(inputs).min(axis=1))])
    return float(
        where_least_sine(
            *(_phases_of_inputs(alpha[:, None], vehicle).T for alpha in (start, end))
        )[0]
    )


def thrust_shares_along(
    starts: FloatArray,
    ends: FloatArray,
    vehicle: Vehicle = PAPER,
    *,
    tolerance: float = 1e-4,
    each: bool = False,
) -> tuple[npt.NDArray[np.bool_], Least, Least]:
    """Return whether every thrust is positive on whole segments (:func:`thrusts_push_up`), and brackets of the shares.

    The brackets are of the least share T/(m·g) and of minus the largest one, NaN where not all are positive.
    """
    upward = thrusts_push_up(starts, ends, vehicle)
    (lower, upper), fraction = (
        np.full((2, 2, len(starts)), np.nan),
        np.zeros((2, len(starts))),
    )
    if upward.any():
        quantity = share_quantity(vehicle, tolerance=tolerance)
        found = least_of_each(starts[upward], ends[upward], [quantity], each=each)
        for k, one in enumerate(found):
            lower[k, upward], upper[k, upward], fraction[k, upward] = (
                one.lower,
                one.upper,
                one.fraction,
            )
    least, largest = (
        Least(lower=lower[k], upper=upper[k], fraction=fraction[k]) for k in range(2)
    )
    return upward, least, largest


_SENSES = np.array([1.0, -1.0])[:, None, None]


def share_quantity(
    vehicle: Vehicle, *, tolerance: float, red: bool = False
) -> Quantity:
    """Return the least share of the weight and minus the largest, where all rotors push up.

    There a share is |wᵢ|/V with V = Σ|wⱼ|·cos αⱼ, as in ``hover_thrust_shares``, of bounded second derivatives. On red
    |sin β2| and |sin β1| are enough, whatever the rotor height; V is then 2·|sin β2·cos α1 − sin β1·cos α2|, which is
    −cos δ·sin(α1 − α2) + sin δ·(cos(α1 − α2) + cos(α1 + α2)) twice.
    """
    rotors, delta = 2 if red else 4, math.atan(vehicle.signed_drag_ratio)
    turned = math.sin(delta) * np.array([[1.0], [-1.0]])

    def values(sines: Sines) -> FloatArray:
        rows = np.empty((3 + rotors, sines.alpha.shape[1]))
        if red:
            inputs = np.abs(
                math.cos(delta) * sines.sine[1::-1] + turned * sines.cosine[1::-1],
                out=rows[3:],
            )
            lift = np.add.reduce(2.0 * inputs * sines.cosine[:2], axis=0, out=rows[2])
        else:
            inputs = np.abs(sines.zero_moment_inputs(vehicle), out=rows[3:])
            lift = np.add.reduce(inputs * sines.cosine, axis=0, out=rows[2])
        rows[0], rows[1] = (
            np.minimum.reduce(inputs) / lift,
            -np.maximum.reduce(inputs) / lift,
        )
        return rows

    def bounds(
        v0: FloatArray, v1: FloatArray, p0: FloatArray, p1: FloatArray
    ) -> FloatArray:
        # |wᵢ| − c·V is bent too, where c is the rotor's least share at both ends, and at least 0 there. Its share is
        # below c by no more than the deficit of that over the least of V. The same holds for the largest, reversed.
        if red:
            steps, tilt = (p1 - p0)[:, 1::-1].T, abs(math.sin(delta))
            bends = steps * steps
            lift_bend = (
                2 * (1 + tilt) * (bends[0] + bends[1])
                - 4 * (1 - tilt) * steps[0] * steps[1]
            )
        else:
            bends, lift_bend = _bends_of_inputs(p1 - p0, vehicle)
        first, last, lift0, lift1 = _SENSES * v0[3:], _SENSES * v1[3:], v0[2], v1[2]
        # At a corner of the square V vanishes, and a share has no bound.
        least_lift = np.maximum(least_of_bent(lift0, lift1, lift_bend), 1e-200)
        c = np.minimum(first / lift0, last / lift1)
        deficit = least_of_bent(
            first - c * lift0, last - c * lift1, bends + np.abs(c) * lift_bend
        )
        out = np.minimum.reduce(c + np.minimum(deficit, 0.0) / least_lift, axis=1)
        np.maximum(out[0], 0.0, out=out[0])
        return np.asarray(out)

    return Quantity(values, bounds, (tolerance, tolerance), 3 + rotors)


def _bends_of_inputs(
    step: FloatArray, vehicle: Vehicle
) -> tuple[FloatArray, FloatArray]:
    """Return bounds of the second derivatives along steps of w₀, shape (4, m), and of V, shape (m,)."""
    rows = step.T
    squares, sums = rows * rows, rows[:2] + rows[2:]
    sums *= sums
    # The second derivative of a product of two sinusoids is at most the sum of both frequencies squared. V is
    # ±sin(Σ2 + 2δ)·(cos(Σ1 − δ) + cos δ·cos Δ1) ± sin(Σ1 − 2δ)·(cos(Σ2 + δ) + cos δ·cos Δ2), with the sums Σ and the
    # differences Δ of opposite arms.
    bends = (squares.reshape(2, 2, -1)[::-1] + sums[::-1]).reshape(4, -1)
    cosine = 1 / math.hypot(1.0, vehicle.drag_ratio)
    lift_bend = 2 * (sums[0] + sums[1]) + 2 * cosine * squares.sum(axis=0)
    height = abs(vehicle.height_ratio)
    if height:
        # H·cos²δ·sin β3·sin Δ2 and H²·cos³δ·sin α3·(cos Δ2 − cos(Σ2 + δ)/cos δ) in w₁, and so on; in V times cos αᵢ.
        # All frequencies of a product add up to no more than those of the four angles.
        more = (
            height
            * cosine**2
            * (1 + height * cosine + height)
            * np.abs(rows).sum(axis=0) ** 2
        )
        bends, lift_bend = bends + more, lift_bend + 4 * more
    return bends, lift_bend
