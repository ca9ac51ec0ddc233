"""Timing laws along a path: monotone, twice continuously differentiable, closed at the seam.

A timing law maps time to the path's parameter s. Its second derivative is continuous and linear between knots, so that
s(t) is a cubic there. Put into the path's own polynomials it gives polynomials of time, whose Bernstein coefficients
bound every derivative on a whole interval: what is said about a law holds between samples, not only at them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gaitgraph.timing.curve import bernstein_from_power, derivative_of

FloatArray = npt.NDArray[np.float64]

# Knots nearer than this share of the period are taken for the same.
_NEAREST = 1e-12
_APART = 1e-9
_SECANTS = 30


@dataclass(frozen=True, slots=True, kw_only=True)
class TimingLaw:
    """A monotone periodic law s(t): s, ṡ and s̈ at knots, s̈ linear between them.

    Each has shape (m + 1,). The knots t go from 0 to the period [s], and s grows by the path's span meanwhile.
    """

    t: FloatArray
    s: FloatArray
    speed: FloatArray
    acceleration: FloatArray

    @property
    def period(self) -> float:
        """The period [s]."""
        return float(self.t[-1])


def law_through_nodes(s: FloatArray, acceleration: FloatArray, speed: float) -> TimingLaw | None:
    """Return the law through nodes s with given s̈, less a constant so that it closes; None if it would stop.

    The nodes, shape (n + 1,), are the law's knots; s̈, shape (n,), is linear in time between them, and each interval
    takes the time in which the cubic covers it. The constant is what makes the last speed equal to `speed`, the first,
    found by the secant method; for s̈ that nearly closes it is tiny.
    """
    rise = np.append(acceleration, acceleration[0])
    width = np.diff(s).tolist()

    def run(constant: float) -> tuple[list[float], list[float]] | None:
        v, speeds, times = speed, [speed], []
        starts, ends = (rise[:-1] - constant).tolist(), (rise[1:] - constant).tolist()
        for ds, a0, a1 in zip(width, starts, ends, strict=True):
            root = v * v + ds * (2 * a0 + a1) * 2 / 3
            if root <= 0:
                return None
            h = 2 * ds / (v + math.sqrt(root))
            v += h * (a0 + a1) / 2
            if v <= 0:
                return None
            times.append(h)
            speeds.append(v)
        return speeds, times

    first = run(0.0)
    if first is None:
        return None
    # What is left over at the end, as half a squared speed, goes down by the constant times the span.
    constants, left = [0.0, (first[0][-1] ** 2 - speed**2) / (2 * float(s[-1]))], [first[0][-1] - speed]
    for _ in range(_SECANTS):
        found = run(constants[-1])
        if found is None:
            return None
        left.append(found[0][-1] - speed)
        if abs(left[-1]) <= 1e-14 * speed or left[-1] == left[-2]:
            break
        constants.append(constants[-1] - left[-1] * (constants[-1] - constants[-2]) / (left[-1] - left[-2]))
    else:
        return None
    t = np.concatenate([[0.0], np.cumsum(found[1])])
    return TimingLaw(t=t, s=s, speed=np.array([*found[0][:-1], speed]), acceleration=rise - constants[-1])


def smoothed_law(s: FloatArray, squared: FloatArray, window: float) -> TimingLaw:
    """Return the law of squared speeds at nodes, shapes (n + 1,), averaged over a share of its period.

    Between nodes ṡ² is linear in s, that is, s̈ is constant; the average makes it continuous. The moving average keeps
    the period, and averages of accelerations within convex limits stay within them but for how much the path's
    direction and curvature change over the window.
    """
    speed, span = np.sqrt(squared), float(s[-1])
    t = np.concatenate([[0.0], np.cumsum(2 * np.diff(s) / (speed[1:] + speed[:-1]))])
    period = float(t[-1])
    half = window * period / 2
    knots = np.unique(np.concatenate([np.mod(t[:-1] - half, period), np.mod(t[:-1] + half, period), [0.0]]))
    knots = np.append(knots[np.diff(np.append(knots, period)) > _APART * period], period)
    knots[0] = 0.0
    ahead = np.interp(np.mod(knots + half, period), t, speed)
    behind = np.interp(np.mod(knots - half, period), t, speed)
    rise = (ahead - behind) / (2 * half)
    rise[-1] = rise[0]
    # The mean of s̈ is taken off, so that the speed closes; the first speed is such that s grows by the span.
    h = np.diff(knots)
    gained = np.concatenate([[0.0], np.cumsum(h * (rise[:-1] + rise[1:]) / 2)])
    surplus = gained[-1] / period
    rise = rise - surplus
    gained = gained - surplus * knots
    gained[-1] = 0.0
    steps = h * gained[:-1] + h**2 * (2 * rise[:-1] + rise[1:]) / 6
    first = (span - steps.sum()) / period
    start = _mean_near_zero(t, s, speed, half)
    smooth = start + np.concatenate([[0.0], np.cumsum(steps + first * h)])
    smooth[-1] = start + span
    return TimingLaw(t=knots, s=smooth, speed=gained + first, acceleration=rise)


def _mean_near_zero(t: FloatArray, s: FloatArray, speed: FloatArray, half: float) -> float:
    """Return the mean of s over times from −half to half, by Simpson's rule, exact for piecewise quadratics."""
    period, span = float(t[-1]), float(s[-1])
    # By symmetry s(−u) = s(T − u) − span: on both sides the edges are those of either.
    inner, outer = t[(t > 0) & (t < half)], period - t[(t > period - half) & (t < period)]
    edges = np.unique(np.concatenate([[0.0], inner, outer, [half]]))

    def position(time: FloatArray) -> FloatArray:
        phase = np.mod(time, period)
        piece = np.clip(np.searchsorted(t, phase, side="right") - 1, 0, len(t) - 2)
        local = phase - t[piece]
        rise = (speed[piece + 1] - speed[piece]) / (t[piece + 1] - t[piece])
        return np.asarray(s[piece] + speed[piece] * local + rise * local**2 / 2 + span * np.floor(time / period))

    low, high = edges[:-1], edges[1:]
    total = 0.0
    for sign in (1.0, -1.0):
        ends = position(sign * low) + position(sign * high)
        total += float(((high - low) * (ends + 4 * position(sign * (low + high) / 2)) / 6).sum())
    return total / (2 * half)


def tilts_over_time(law: TimingLaw, breaks: FloatArray, pieces: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return widths of intervals of time and (α1, α2) on them, as polynomials of the share of the interval passed.

    Shapes (m,) [s] and (degree + 1, m, 2) [rad], highest power first, for a law of positive speed along a path with
    `breaks` and `pieces` as in :class:`gaitgraph.timing.curve.Curve`. The first interval begins where the path does.

    To the law's knots those are added where s passes a break of the path. Widths are not differences of times: a knot
    may lie so near to a break that these would carry few digits.
    """
    span, h = float(breaks[-1]), np.diff(law.t)
    # In which interval of the law, and at what share of it, s passes each break: by bisection.
    ahead = np.mod(breaks[:-1] - law.s[0], span)
    ahead = np.where(ahead >= span, 0.0, ahead)
    at = np.clip(np.searchsorted(law.s - law.s[0], ahead, side="right") - 1, 0, len(h) - 1)
    rest = ahead - (law.s[at] - law.s[0])
    v, a, b = law.speed[at] * h[at], law.acceleration[at] * h[at] ** 2, law.acceleration[at + 1] * h[at] ** 2
    low, high = np.zeros(len(at)), np.ones(len(at))
    for _ in range(60):
        x = (low + high) / 2
        below = x * (v + x * (a / 2 + x * (b - a) / 6)) < rest
        low, high = np.where(below, x, low), np.where(below, high, x)
    x = (low + high) / 2
    speed, rise = (v + x * (a + x * (b - a) / 2)) / h[at], (a + x * (b - a)) / h[at] ** 2
    # Knots and breaks in order, from the first break on; `number` is that of the break, −1 for a knot.
    interval, share = np.concatenate([np.arange(len(h)), at]), np.concatenate([np.zeros(len(h)), x])
    number = np.concatenate([np.full(len(h), -1), np.arange(len(at))])
    order = np.lexsort((-number, share, interval))
    order = np.roll(order, -int(np.flatnonzero(order == len(h))[0]))
    interval, share, number = interval[order], share[order], number[order]
    following, until = np.roll(interval, -1), np.roll(share, -1)
    widths = np.where(following == interval, until - share, 1.0 - share) * h[interval]
    # Of a knot of the law and a break that coincide, the break stays.
    close = widths < _NEAREST * law.period
    kept = np.flatnonzero(~((number < 0) & (close | np.roll(close, 1))))
    widths = np.add.reduceat(widths, kept)
    number = number[kept]
    s, v, a = (
        np.concatenate(pair)[order][kept]
        for pair in ((law.s[:-1], breaks[:-1]), (law.speed[:-1], speed), (law.acceleration[:-1], rise))
    )
    piece = np.maximum.accumulate(number)
    local = np.where(number >= 0, 0.0, np.mod(s - breaks[piece], span))
    return widths, tilts_between(widths, local, np.append(v, v[0]), np.append(a, a[0]), pieces[:, piece])


def tilts_between(
    widths: FloatArray, local: FloatArray, speed: FloatArray, rise: FloatArray, pieces: FloatArray
) -> FloatArray:
    """Return (α1, α2) on intervals of time as polynomials of the share passed, shape (degree + 1, m, 2).

    `local` is s at the start of each interval, less that at which its piece of the path starts, shape (m,); `speed` and
    `rise` are ṡ and s̈ at the knots, shape (m + 1,); `pieces` are those that the intervals run along, shape (n + 1, m,
    2).
    """
    h = widths
    cubic = np.stack([(rise[1:] - rise[:-1]) * h**2 / 6, rise[:-1] * h**2 / 2, speed[:-1] * h, local])[:, :, None]
    out = pieces[:1].copy()
    for coefficient in pieces[1:]:
        # Horner's rule with polynomials: multiply by the cubic, add the next coefficient.
        product = np.zeros((len(out) + 3, *out.shape[1:]))
        for k, part in enumerate(cubic):
            product[k : k + len(out)] += out * part
        out = product
        out[-1] += coefficient
    return out


def peaks_of(widths: FloatArray, tilts: FloatArray, order: int) -> FloatArray:
    """Return an upper bound of the size of a derivative by time on each interval, shape (m, 2).

    The bound is that of the Bernstein coefficients; it is attained as intervals shrink, at second order.
    """
    control = bernstein_from_power(derivative_of(tilts, order), np.ones(len(widths)))
    return np.asarray(np.abs(control).max(axis=0) / widths[:, None] ** order)
