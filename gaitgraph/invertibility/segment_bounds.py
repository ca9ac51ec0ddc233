"""Bounds along straight segments of tilt angles: R, residuals, singular values and hover thrusts between two rows.

One search brackets the least value of several quantities along segments, so that a check holds between two rows and not
only at them. A quantity is bounded on an interval from its values at both ends and the bound of its second derivative
that its form has (:class:`gaitgraph.invertibility.forms.Bends`). Starts and ends have shape (m, 4) [rad].
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import numpy.typing as npt

from gaitgraph._lazy import cached_property
from gaitgraph.angles import angles_from
from gaitgraph.errors import wrong
from gaitgraph.invertibility.forms import (
    Bends,
    FloatArray,
    Form,
    Rotors,
    Sines,
    level_of,
    rotors_of,
)
from gaitgraph.invertibility.matrices import hover_thrust_shares
from gaitgraph.tolerances import IDLE_SHARE, ROUND_OFF, SAME_ANGLE
from gaitgraph.vehicle import PAPER, Vehicle

if TYPE_CHECKING:
    from gaitgraph.invertibility.coefficients import Coefficients

BoolArray = npt.NDArray[np.bool_]
Value = Callable[[FloatArray], FloatArray]
Bound = Callable[[FloatArray, FloatArray, FloatArray, FloatArray], FloatArray]

_BATCH = 1 << 14  # segments that are searched at once, so that memory is bounded
# Few intervals are cut finer: an iteration over them is cheap.
_FEW, _PIECES, _POINTS = 64, 16, 1024
_LONG = 0.05  # a longer segment is hardly settled without a cut to this length [rad]
_SHORT = 1e-13  # a shorter share of a segment is not cut
_MOST_POINTS = 4_000_000  # that a search evaluates
_TINY = float(np.finfo(float).tiny)
_ROUNDED = 1e-14  # more than rounding adds to a polynomial of numbers up to 1
_UPRIGHT = math.pi / 2 + SAME_ANGLE  # rad


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


@dataclass(frozen=True, eq=False)
class Points:
    """Points of a search, shape (k, n) [rad], and for four tilt angles what all quantities need of them."""

    rows: FloatArray

    @cached_property
    def sines(self) -> Sines:
        """The sines of four tilt angles."""
        return Sines.of(self.rows)

    def at(self, form: Form) -> FloatArray:
        """Return the values of forms, shape (q, k), which several quantities may need."""
        if form not in self._values:
            self._values[form] = form.at(self.sines)
        return self._values[form]

    @cached_property
    def _values(self) -> dict[Form, FloatArray]:
        return {}


class Quantity(Protocol):
    """Functions of the tilt angles that :func:`least_of_each` brackets."""

    count: int
    """How many functions there are."""

    def state(self, points: Points, least: FloatArray) -> FloatArray:
        """Return rows of shape (k,) at k points: first the functions, then what `bounds` needs.

        A function that is certainly above `least`, shape (count,), may be infinite instead.
        """

    def bounds(
        self, first: FloatArray, last: FloatArray, p0: FloatArray, p1: FloatArray
    ) -> FloatArray:
        """Return lower bounds on intervals from the rows at both ends, and the ends, shape (count, k)."""


def checked_segments(
    starts: npt.ArrayLike, ends: npt.ArrayLike, count: int = 4
) -> tuple[FloatArray, FloatArray]:
    """Return the ends of one or more segments of `count` tilt angles as arrays of one shape (m, count); else InputError."""
    both = []
    for name, points in (("starts", starts), ("ends", ends)):
        angles = angles_from(points, name)
        if angles.ndim != 2 or angles.shape[1] != count or not len(angles):
            raise wrong(
                name,
                f"must have the shape (m, {count}) with m at least 1",
                angles.shape,
            )
        both.append(angles)
    if len(both[0]) != len(both[1]):
        raise wrong("ends", f"must be as many as starts, {len(both[0])}", len(both[1]))
    return both[0], both[1]


def least_of_each(
    starts: FloatArray,
    ends: FloatArray,
    quantities: Sequence[Quantity],
    tolerances: Sequence[float],
    *,
    floor: float = math.inf,
    each: bool = False,
    most: int | None = None,
) -> tuple[Least, ...]:
    """Bracket the least of each function of some quantities along straight segments, shape (m, n), all in one search.

    An interval whose lower bound is good enough is settled, any other is cut, until the bracket of every function is as
    narrow as the tolerance of its quantity: that of every segment with `each`, else that of the least of all. A segment
    is settled earlier once its least value is known to be above or below `floor`. Work is bounded by `most` points, so
    that a bracket may stay wider than its tolerance; `lower` is always valid.
    """
    left = _MOST_POINTS if most is None else most
    search = _Search(len(starts), quantities, tolerances, floor, each, left)
    if not each and len(starts) > _FEW:
        search.prime(starts)
    for start in range(0, len(starts), _BATCH):
        part = slice(start, start + _BATCH)
        search.run(starts[part], ends[part], start)
    return tuple(
        Least(lower=lower, upper=upper, fraction=fraction)
        for lower, upper, fraction in zip(
            search.lower, search.upper, search.fraction, strict=True
        )
    )


class _Search:
    """The brackets of some quantities along segments, and the intervals that are not settled."""

    def __init__(
        self,
        segments: int,
        quantities: Sequence[Quantity],
        tolerances: Sequence[float],
        floor: float,
        each: bool,
        most: int,
    ) -> None:
        self.quantities = quantities
        counts = [quantity.count for quantity in quantities]
        self.tolerance = np.repeat(np.array(tolerances, dtype=float), counts)[:, None]
        last = np.cumsum(counts).tolist()
        self._rows = [
            slice(end - count, end) for count, end in zip(counts, last, strict=True)
        ]
        self.floor, self.each, self.left = floor, each, most
        shape = (sum(counts), segments)
        self.lower, self.upper = np.full((2, *shape), np.inf)
        self.fraction = np.zeros(shape)
        self.known = np.full(shape[0], np.inf)  # the least of all so far

    def prime(self, starts: FloatArray) -> None:
        """Take the least values at a few starts as the first known ones."""
        few = starts[:: max(1, len(starts) // _FEW)]
        for state, rows in zip(self._states(few[:, None]), self._rows, strict=True):
            self.known[rows] = state[: rows.stop - rows.start, :, 0].min(axis=1)

    def run(self, starts: FloatArray, ends: FloatArray, offset: int) -> None:
        """Search some segments, the first of which has the number `offset`."""
        steps = ends - starts
        segment = np.arange(len(starts))
        low, width = np.zeros(len(starts)), 1.0
        pieces = 1
        if len(starts) <= _FEW:
            pieces = math.ceil(float(np.abs(steps).max(initial=0.0)) / _LONG)
            pieces = min(max(pieces, 1), _PIECES)
        while len(segment):
            at = low[:, None] + width * np.linspace(0.0, 1.0, pieces + 1)
            points = starts[segment, None] + at[..., None] * steps[segment, None]
            self.left -= at.size
            states = self._states(points)
            self._improve(states, segment + offset, at)
            low, width = at[:, :-1].reshape(-1), width / pieces
            segment = np.repeat(segment, pieces)
            bounds = self._bounds(states, points)
            is_open = self._unsettled(bounds, segment + offset)
            if width < _SHORT:  # floats resolve no more
                bounds = self._ends(states)
            if width < _SHORT or self.left < 0:
                is_open[:] = False
            closed = ~is_open
            for row, bound in zip(self.lower, bounds, strict=True):
                np.minimum.at(row, segment[closed] + offset, bound[closed])
            segment, low = segment[is_open], low[is_open]
            pieces = min(max(_POINTS // max(len(segment), 1), 2), _PIECES)
        part = slice(offset, offset + len(starts))
        np.minimum(self.lower[:, part], self.upper[:, part], out=self.lower[:, part])

    def _states(self, points: FloatArray) -> list[FloatArray]:
        """Return the rows of each quantity at points of shape (k, j, n), each of shape (rows, k, j)."""
        flat = points.reshape(-1, points.shape[-1])
        # Where each segment begins at the end of the one before, each point is evaluated once.
        joined = np.array_equal(points[1:, 0], points[:-1, -1])
        is_polyline = points.shape[1] == 2 and len(points) > 1 and joined
        if is_polyline:
            flat = np.concatenate([points[:, 0], points[-1:, 1]])
        all_points = Points(flat)
        states = []
        for quantity, rows in zip(self.quantities, self._rows, strict=True):
            least = self.known[rows]
            if self.each:
                least = np.full(quantity.count, np.inf)
            state = quantity.state(all_points, least)
            if is_polyline:
                state = np.stack([state[:, :-1], state[:, 1:]], axis=-1)
            states.append(state.reshape(len(state), *points.shape[:2]))
        return states

    def _improve(
        self, states: list[FloatArray], segment: npt.NDArray[np.int64], at: FloatArray
    ) -> None:
        """Take the least values of the functions at the points, which segments of increasing number have."""
        values = [
            state[: quantity.count]
            for quantity, state in zip(self.quantities, states, strict=True)
        ]
        for k, value in enumerate(np.concatenate(values)):
            nearest = value.argmin(axis=1)
            rows = np.arange(len(nearest))
            lowest = value[rows, nearest]
            before = self.upper[k, segment]
            np.fmin.at(self.upper[k], segment, lowest)
            is_least = (lowest < before) & (lowest == self.upper[k, segment])
            self.fraction[k, segment[is_least]] = at[rows, nearest][is_least]
            self.known[k] = min(self.known[k], float(lowest.min()))

    def _bounds(self, states: list[FloatArray], points: FloatArray) -> FloatArray:
        """Return the lower bounds of all functions on the intervals between points, shape (f, k·(j − 1))."""
        size = points.shape[-1]
        p0, p1 = (points[:, part].reshape(-1, size) for part in _SIDES)
        bounds = []
        for quantity, state in zip(self.quantities, states, strict=True):
            first, last = (state[:, :, part].reshape(len(state), -1) for part in _SIDES)
            bounds.append(quantity.bounds(first, last, p0, p1))
        return np.concatenate(bounds)

    def _ends(self, states: list[FloatArray]) -> FloatArray:
        """Return the lesser values of the functions at both ends of intervals, shape (f, k·(j − 1))."""
        values = []
        for quantity, state in zip(self.quantities, states, strict=True):
            first, last = (state[: quantity.count, :, part] for part in _SIDES)
            values.append(np.minimum(first, last).reshape(quantity.count, -1))
        return np.concatenate(values)

    def _unsettled(
        self, bounds: FloatArray, segment: npt.NDArray[np.int64]
    ) -> BoolArray:
        """Return whether intervals of segments must be cut."""
        reference = self.upper[:, segment] if self.each else self.known[:, None]
        wanted = reference - self.tolerance
        if self.floor < math.inf:
            wanted = np.where(
                reference >= self.floor, np.minimum(wanted, self.floor), -np.inf
            )
        return np.asarray((bounds < wanted).any(axis=0))


_SIDES = (slice(None, -1), slice(1, None))


def least_of_bent(f0: FloatArray, f1: FloatArray, bend: FloatArray) -> FloatArray:
    """Return a lower bound of functions on intervals from their values at both ends, if |f''| ≤ `bend` there.

    A function stays above its chord minus bend·s·(1 − s)/2, which is least at an end where the chord is steep.
    """
    flat = np.maximum(0.5 * bend - np.abs(f1 - f0), 0.0)
    return np.asarray(np.minimum(f0, f1) - 0.5 * flat * flat / np.maximum(bend, _TINY))


@dataclass(frozen=True)
class Bounded:
    """Any one function, by its values and a lower bound on intervals."""

    value: Value
    bound: Bound
    count = 1

    def state(self, points: Points, least: FloatArray) -> FloatArray:
        """Return the values."""
        return self.value(points.rows)[None]

    def bounds(
        self, first: FloatArray, last: FloatArray, p0: FloatArray, p1: FloatArray
    ) -> FloatArray:
        """Return the lower bounds."""
        return self.bound(first[0], last[0], p0, p1)[None]


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
    quantity = Bounded(value, bound)
    return least_of_each(starts, ends, [quantity], [tolerance], **options)[0]


@lru_cache(maxsize=64)
def bends_of(form: Form) -> Bends:
    """Return the bounds of the second derivatives of a form."""
    return Bends(form)


class LevelSign:
    """sign·R."""

    count = 1

    def __init__(self, coefficients: Coefficients, sign: float) -> None:
        self.form = coefficients.level_form
        self.bends = bends_of(self.form)
        self.sign = sign

    def state(self, points: Points, least: FloatArray) -> FloatArray:
        """Return sign·R."""
        return self.sign * points.at(self.form)

    def bounds(
        self, first: FloatArray, last: FloatArray, p0: FloatArray, p1: FloatArray
    ) -> FloatArray:
        """Return lower bounds of sign·R."""
        return least_of_bent(first, last, self.bends.along(p1 - p0))


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
    quantity = LevelSign(coefficients, sign)
    return least_of_each(starts, ends, [quantity], [tolerance], **options)[0]


class Residual:
    """−max(|Rφ|, |Rθ|), in axes of which the first is along arm 1."""

    count = 1

    def __init__(self, coefficients: Coefficients) -> None:
        self.form = coefficients.surface_form
        self.bends = bends_of(self.form)

    def state(self, points: Points, least: FloatArray) -> FloatArray:
        """Return the least, and |Rθ| and |Rφ|."""
        sizes = np.abs(self.form.at(points.sines))
        return np.concatenate([-sizes.max(axis=0, keepdims=True), sizes])

    def bounds(
        self, first: FloatArray, last: FloatArray, p0: FloatArray, p1: FloatArray
    ) -> FloatArray:
        """Return lower bounds."""
        sizes = np.maximum(first[1:], last[1:]) + self.bends.along(p1 - p0) / 8
        return np.asarray(-sizes.max(axis=0, keepdims=True))


def singular_value_bound(rate: float) -> Bound:
    """Return a bound from values at both ends that are the least singular value or less; `rate` is that of `Level`.

    It is the larger of two: that of the rate r of change, and a closed form for short steps h. The square of the value
    is the least of ‖M·x‖² over unit x (and attitudes). Each column of M is a sinusoid of one angle, no longer than r,
    so that (‖M·x‖²)'' ≤ 2r²h² + 2rh²·‖M·x‖. Where the value is below that at both ends, ‖M·x‖ is below it plus r·h.
    """

    def bound(
        f0: FloatArray, f1: FloatArray, p0: FloatArray, p1: FloatArray
    ) -> FloatArray:
        change = rate * np.sqrt(((p1 - p0) ** 2).sum(axis=1))
        bend = 2 * change**2 * (1 + (np.minimum(f0, f1) + change) / rate)
        squared = np.maximum(least_of_bent(f0**2, f1**2, bend), 0.0)
        bounds = np.maximum((f0 + f1 - change) / 2, np.sqrt(squared))
        return np.asarray(np.maximum(bounds, 0.0))

    return bound


class SingularValue:
    """The least singular value of the scaled decoupling matrix, level.

    Its square is the least root of the characteristic polynomial of G = M·Mᵀ, whose coefficients follow from det M and
    the traces of powers of G, and which :func:`least_root` bounds from below. Only where that bound is below the least
    value so far is M decomposed.
    """

    count = 1

    def __init__(self, rotors: Rotors) -> None:
        self.level = level_of(rotors)
        self.bound = singular_value_bound(self.level.rate)
        self.size = 2 * abs(rotors.drag_ratio)

    def state(self, points: Points, least: FloatArray) -> FloatArray:
        """Return the least singular values, infinite where above the least one, and lower bounds of them."""
        below, near = self.up_to(points, least[0])
        values = np.full(len(below), np.inf)
        values[near] = below[near]
        return np.array([values, below])

    def up_to(
        self, points: Points, most: FloatArray
    ) -> tuple[FloatArray, npt.NDArray[np.intp]]:
        """Return lower bounds at points, shape (k,), and the numbers of those that are the values: of all up to `most`."""
        matrix = self.level.matrix(points.sines)
        below = np.zeros(len(matrix))
        if np.isfinite(most).all():
            determinant = self.size * points.at(self.level.lift)[0]
            below = least_singular_values_from_below(matrix, determinant)
        near = np.flatnonzero(below <= most)
        below[near] = np.linalg.svd(matrix[near], compute_uv=False)[:, -1]
        return below, near

    def bounds(
        self, first: FloatArray, last: FloatArray, p0: FloatArray, p1: FloatArray
    ) -> FloatArray:
        """Return lower bounds."""
        return self.bound(first[1], last[1], p0, p1)[None]


def least_singular_values_from_below(
    matrix: FloatArray, determinant: FloatArray
) -> FloatArray:
    """Return lower bounds of the least singular values of matrices, shape (k, 4, 4), of known determinants, shape (k,)."""
    rows = np.moveaxis(matrix, 0, -1)
    gram = np.einsum("ijk,ljk->ilk", rows, rows)
    trace = np.einsum("iik->k", gram)
    gram /= trace
    squared = np.einsum("ijk,jlk->ilk", gram, gram)
    square_sum = np.einsum("iik->k", squared)
    cube_sum = np.einsum("ijk,ijk->k", gram, squared)
    pairs = (1 - square_sum) / 2
    triples = 1 / 6 - square_sum / 2 + cube_sum / 3
    product = (determinant / trace**2) ** 2
    root = least_root(
        np.ones_like(trace),
        pairs,
        triples + _ROUNDED,
        np.maximum(product - _ROUNDED, 0.0),
        steps=2,
    )
    return np.asarray((1 - 1e-12) * np.sqrt(root * trace))


def least_root(e1: Any, e2: Any, e3: Any, e4: Any, *, steps: int) -> FloatArray:
    """Return lower bounds of the least roots of x⁴ − e1·x³ + e2·x² − e3·x + e4, whose roots are real and at least 0.

    Laguerre's iteration from 0 increases towards the least root: each step more than triples the correct digits, or
    leaves 27 % of the distance from a double root.
    """
    slope, height, bend, root = -e3, e4, 2 * e2, np.zeros_like(e1)
    for left in reversed(range(steps)):
        steep = np.sqrt(np.maximum(9 * slope * slope - 12 * height * bend, 0.0)) - slope
        root = root + 4 * np.where(slope < 0, height, 0.0) / np.maximum(steep, _TINY)
        if left:
            height = np.maximum(
                (((root - e1) * root + e2) * root - e3) * root + e4, 0.0
            )
            slope = ((4 * root - 3 * e1) * root + 2 * e2) * root - e3
            bend = (12 * root - 6 * e1) * root + 2 * e2
    return np.asarray(root)


@lru_cache(maxsize=32)
def singular_quantity(vehicle: Vehicle) -> SingularValue:
    """Return the least singular value of a vehicle as a quantity."""
    return SingularValue(rotors_of(vehicle))


def least_singular_value_along(
    starts: npt.ArrayLike,
    ends: npt.ArrayLike,
    vehicle: Vehicle = PAPER,
    *,
    tolerance: float = 1e-4,
    **options: Any,
) -> Least:
    """Bracket the least singular value of the scaled decoupling matrix, level, along segments.

    Segments are of tilt angles, shape (m, 4), m ≥ 1 [rad]; InputError otherwise. The options are those of
    :func:`least_of_each`.
    """
    first, last = checked_segments(starts, ends)
    quantity = singular_quantity(vehicle)
    return least_of_each(first, last, [quantity], [tolerance], **options)[0]


def keeps_singular_value_above(
    starts: FloatArray, ends: FloatArray, floor: float, vehicle: Vehicle = PAPER
) -> BoolArray:
    """Return whether the least singular value is at least `floor` along each whole segment, shape (m,).

    Decided to within 1e-6 of the floor; what is closer than that counts as below.
    """
    found = least_singular_value_along(
        starts, ends, vehicle, tolerance=1e-6, floor=floor, each=True
    )
    return np.asarray(found.lower >= floor)


class _Thrusts:
    """Zero-moment inputs of rotors, in the sense of thrusts, and R: their quotients are the shares of the weight."""

    def __init__(self, rotors: Rotors) -> None:
        self.signs = rotors.thrust_signs[:, None]
        self.level = level_of(rotors)
        self.bends = Bends(*self.level.inputs, self.level.lift)

    def at(self, points: Points) -> FloatArray:
        """Return the four thrusts times R, and R, shape (5, k)."""
        thrusts = self.signs * self.level.inputs_at(points.sines)
        return np.concatenate([thrusts, points.at(self.level.lift)])


class HoverShares(_Thrusts):
    """The least share of the weight, and minus the largest, in level flight."""

    count = 2

    def state(self, points: Points, least: FloatArray) -> FloatArray:
        """Return both, the thrusts times R, and R."""
        rows = self.at(points)
        with np.errstate(divide="ignore", invalid="ignore"):
            shares = rows[:4] / rows[4]
        least_share = np.nan_to_num(shares.min(axis=0), nan=-np.inf)
        largest_share = np.nan_to_num(shares.max(axis=0), nan=np.inf)
        return np.concatenate([[least_share, -largest_share], rows])

    def bounds(
        self, first: FloatArray, last: FloatArray, p0: FloatArray, p1: FloatArray
    ) -> FloatArray:
        """Return lower bounds; −∞ where R may vanish.

        With c a rotor's least share at both ends, wᵢ − c·R is at least 0 there, and bent no more than both forms are. So
        the share is below c by no more than the deficit of that over the least R. The same holds for the largest.
        """
        bends = self.bends.along(p1 - p0)
        sign = np.sign(first[6])
        level0, level1 = sign * first[6], sign * last[6]
        least_level = least_of_bent(level0, level1, bends[4])
        out = np.full((2, len(sign)), -np.inf)
        kept = least_level > 0
        thrusts0 = (sign * first[2:6])[:, kept]
        thrusts1 = (sign * last[2:6])[:, kept]
        level0, level1, least_level = level0[kept], level1[kept], least_level[kept]
        bends = bends[:, kept]
        for row, sense in enumerate((1.0, -1.0)):
            share0, share1 = thrusts0 / level0, thrusts1 / level1
            share = sense * np.minimum(sense * share0, sense * share1)
            deficit = least_of_bent(
                sense * (thrusts0 - share * level0),
                sense * (thrusts1 - share * level1),
                bends[:4] + np.abs(share) * bends[4],
            )
            bound = sense * share + np.minimum(deficit, 0.0) / least_level
            out[row, kept] = bound.min(axis=0)
        return out


class _UpwardThrust(_Thrusts):
    """The least thrust of all rotors, times |R|: above zero where all push up or, R < 0, all inputs are negative."""

    count = 1

    def state(self, points: Points, least: FloatArray) -> FloatArray:
        thrusts = self.at(points)[:4]
        value = np.maximum(thrusts.min(axis=0), -thrusts.max(axis=0))
        return np.concatenate([value[None], thrusts])

    def bounds(
        self, first: FloatArray, last: FloatArray, p0: FloatArray, p1: FloatArray
    ) -> FloatArray:
        bends = self.bends.along(p1 - p0)[:4]
        of_signs = [
            least_of_bent(sign * first[1:], sign * last[1:], bends).min(axis=0)
            for sign in (1.0, -1.0)
        ]
        return np.asarray(np.maximum(*of_signs)[None])


@lru_cache(maxsize=32)
def _upward_quantity(vehicle: Vehicle) -> _UpwardThrust:
    return _UpwardThrust(rotors_of(vehicle))


@lru_cache(maxsize=32)
def share_quantity(vehicle: Vehicle) -> HoverShares:
    """Return the shares of the weight of a vehicle's rotors as a quantity."""
    return HoverShares(rotors_of(vehicle))


def least_upward_thrust(
    starts: FloatArray, ends: FloatArray, vehicle: Vehicle = PAPER
) -> Least:
    """Bracket the least hover thrust times |R|, as far as its sign needs, along each segment."""
    quantity = _upward_quantity(vehicle)
    (found,) = least_of_each(
        starts, ends, [quantity], [0.0], floor=IDLE_SHARE, each=True
    )
    return found


def thrusts_push_up(
    starts: FloatArray, ends: FloatArray, vehicle: Vehicle = PAPER
) -> BoolArray:
    """Return whether all hover thrusts are positive along whole segments, no rotor beyond π/2, shape (m,).

    What is nearly zero does not count as positive.
    """
    kept = least_upward_thrust(starts, ends, vehicle).lower >= IDLE_SHARE
    sides = np.array([starts, ends])
    turns = 2 * math.pi * np.rint((starts + ends) / (4 * math.pi))
    upright = (np.abs(sides - turns) <= _UPRIGHT).all(axis=(0, 2))
    return np.asarray(kept & upright)


def where_thrusts_vanish(
    start: FloatArray, end: FloatArray, vehicle: Vehicle = PAPER
) -> float:
    """Return the fraction of a segment at which a hover thrust is least."""
    return float(least_upward_thrust(start[None], end[None], vehicle).fraction[0])


def segments_fly(
    starts: FloatArray, ends: FloatArray, floor: float, vehicle: Vehicle
) -> BoolArray:
    """Return whether segments on red where R keeps its sign meet the physics along their whole length, shape (m,)."""
    flies = thrusts_push_up(starts, ends, vehicle)
    # Rotors whose thrust axes lean may all pull where they are of one sign.
    flies &= (hover_thrust_shares(starts, vehicle) > 0).all(axis=1)
    if vehicle.tilt_range is not None:
        least, most = np.array(vehicle.tilt_range).T
        flies &= (np.minimum(starts, ends) >= least - ROUND_OFF).all(axis=1)
        flies &= (np.maximum(starts, ends) <= most + ROUND_OFF).all(axis=1)
    if flies.any():
        flies[flies] = keeps_singular_value_above(
            starts[flies], ends[flies], floor, vehicle
        )
    share = vehicle.thrust_share
    if share is not None and flies.any():
        quantity = share_quantity(vehicle)
        _, largest = least_of_each(
            starts[flies], ends[flies], [quantity], [1e-4], each=True
        )
        flies[flies] = -largest.lower <= share
    return flies
