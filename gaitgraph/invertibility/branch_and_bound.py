"""The least value along segments, by branch and bound.

An interval whose lower bound is good enough is settled, any other is cut. The result brackets the true least value;
no decision rests on samples alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
Value = Callable[[FloatArray], FloatArray]
Bound = Callable[[FloatArray, FloatArray, FloatArray, FloatArray], FloatArray]
# Several of one shape, or the rows of an array.
Several = Sequence[FloatArray] | FloatArray
Values = Callable[[FloatArray], Several]
Bounds = Callable[[Several, Several, FloatArray, FloatArray], Sequence[FloatArray]]

_BATCH = 1 << 15
# An iteration over few points costs the same for any number of them: a few intervals are cut finer.
_FEW, _PIECES = 32, 32
_SHORT = 1e-12  # fractions nearer than this are halved, to the end of what floats resolve
_TINY = float(np.finfo(float).tiny)
_MOST_HALVINGS = 20_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Least:
    """The least value along each of m segments, proven to be in [lower, upper]; all of shape (m,).

    `upper` is attained at `fraction`, from 0 at a segment's start to 1 at its end.
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
    """Bracket the least of one function, from (k, 4) to (k,); see :func:`least_of_each`."""
    (found,) = least_of_each(
        starts,
        ends,
        lambda alpha: (value(alpha),),
        lambda v0, v1, p0, p1: (bound(v0[0], v1[0], p0, p1),),
        tolerance=tolerance,
        floor=floor,
        each=each,
        enough=enough,
        known=(known,),
        at_ends=None if at_ends is None else ((at_ends[0],), (at_ends[1],)),
    )
    return found


def least_of_each(
    starts: npt.ArrayLike,
    ends: npt.ArrayLike,
    values: Values,
    bounds: Bounds,
    *,
    tolerance: float,
    known: tuple[float, ...],
    floor: float = math.inf,
    each: bool = False,
    enough: FloatArray | None = None,
    at_ends: tuple[Several, Several] | None = None,
) -> tuple[Least, ...]:
    """Bracket the least of each of a few functions along straight segments, shape (m, 4), all in one search.

    `values` maps points, shape (k, 4), to the functions, each of shape (k,), as many as `known` has numbers, then to
    any other arrays of that shape that `bounds` needs. `bounds` returns lower bounds of the functions on intervals from
    `values` at both ends and the ends themselves; `at_ends` are `values` at starts and ends, if at hand.

    An interval is cut until the bracket of every function is as narrow as `tolerance`: that of every segment with
    `each`, else that of the least of all and of `known`, a value that each function attains elsewhere. A segment
    is settled earlier if the comparison of its least value with `floor` is, or above its value of `enough`, shape (m,).

    Intervals are halved in batches, the latest first, so that memory is bounded; a few are cut into 32 pieces, to save
    iterations. Not guaranteed: that every bracket is as narrow as `tolerance`. Work is bounded; `lower` is always
    valid.
    """
    starts, ends = np.atleast_2d(np.asarray(starts, dtype=float)), np.atleast_2d(np.asarray(ends, dtype=float))
    steps, functions = ends - starts, range(len(known))
    v0, v1 = at_ends if at_ends is not None else (values(starts), values(ends))
    best = [np.minimum(v0[k], v1[k]) for k in functions]
    fraction = [np.where(v1[k] < v0[k], 1.0, 0.0) for k in functions]
    lower = [one.copy() for one in best]
    overall = [min(known[k], float(best[k].min())) for k in functions]
    # An interval has its segment and two rows, one for each end: the fraction, the four angles, the values.
    first = np.column_stack([np.zeros(len(starts)), starts, *v0])
    last = np.column_stack([np.ones(len(starts)), ends, *v1])
    batches: list[tuple[Any, FloatArray, FloatArray]] = [(np.arange(len(starts)), first, last)]
    halvings = 0
    while batches:
        segment, first, last = batches.pop()
        before, after = first.T[5:], last.T[5:]
        least = bounds(before, after, first[:, 1:5], last[:, 1:5])
        open_ = np.zeros(len(segment), dtype=bool)
        for k in functions:
            reference: Any = best[k][segment] if each else overall[k]
            unsettled = least[k] < np.minimum(reference - tolerance, floor)
            if math.isfinite(floor):
                unsettled &= reference >= floor
            if enough is not None:
                unsettled &= least[k] < enough[segment]
            open_ |= unsettled
        width = last[:, 0] - first[:, 0]
        finely = float(width.min()) > _SHORT
        if not finely:
            middle = first[:, 0] + width / 2
            # A fraction that no longer splits the interval is the end of what floats resolve.
            whole = open_ & ~((middle > first[:, 0]) & (middle < last[:, 0]))
            for k in functions:
                least[k][whole] = np.minimum(before[k], after[k])[whole]
            open_ &= ~whole
        count = int(np.count_nonzero(open_))
        halvings += count
        if halvings > _MOST_HALVINGS:
            open_[:], count = False, 0
        for k in functions:
            np.minimum.at(lower[k], segment[~open_], least[k][~open_])
        if not count:
            continue
        segment, first, last, width = segment[open_], first[open_], last[open_], width[open_]
        pieces = _PIECES if finely and count <= _FEW else 2
        nodes = np.empty((pieces + 1, *first.shape))
        nodes[0], nodes[-1], inner = first, last, nodes[1:-1]
        inner[..., 0] = first[:, 0] + np.arange(1, pieces)[:, None] / pieces * width
        inner[..., 1:5] = starts[segment] + inner[..., :1] * steps[segment]
        for k, found in enumerate(values(inner[..., 1:5].reshape(-1, 4)), start=5):
            inner[..., k] = found.reshape(pieces - 1, count)
        for k in functions:
            found = inner[..., 5 + k]
            better = np.flatnonzero(found.min(axis=0) < best[k][segment])
            if not better.size:
                continue
            lowest = inner[np.argmin(found[:, better], axis=0), better]
            order = np.argsort(lowest[:, 5 + k], kind="stable")[::-1]  # the last of a segment is its least
            at = segment[better[order]]
            best[k][at], fraction[k][at] = lowest[order, 5 + k], lowest[order, 0]
            overall[k] = min(overall[k], float(lowest[:, 5 + k].min()))
        # The first piece of every interval, then the second: each ends where the next begins.
        pieced = np.tile(segment, pieces)
        firsts, lasts = (side.reshape(len(pieced), -1) for side in (nodes[:-1], nodes[1:]))
        for start in range(0, len(pieced), _BATCH):
            part = slice(start, start + _BATCH)
            batches.append((pieced[part], firsts[part], lasts[part]))
    return tuple(Least(lower=np.minimum(lower[k], best[k]), upper=best[k], fraction=fraction[k]) for k in functions)


def least_of_bent(f0: FloatArray, f1: FloatArray, bend: FloatArray) -> FloatArray:
    """Return a lower bound of functions on intervals from their values at both ends, if |f''| ≤ `bend` there.

    With s from 0 to 1, a function stays above its chord minus bend·s·(1 − s)/2. That parabola is least at an end where
    the chord is steep.

    >>> least_of_bent(np.array([0.0, 0.0]), np.array([0.0, 1.0]), np.array([8.0, 2.0])).tolist()
    [-1.0, 0.0]
    """
    flat = np.maximum(bend / 2 - np.abs(f1 - f0), 0.0)
    return np.asarray(np.minimum(f0, f1) - flat**2 / (2 * np.maximum(bend, _TINY)))
