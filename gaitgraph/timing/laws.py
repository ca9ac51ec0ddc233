"""Timing laws: how fast a path is run, from rest to rest at corners or along a smooth curve without a stop.

A timing law maps time to position along the loop. Three laws are closed formulas over any period:

* ``smooth`` (the default): time in proportion to length, each segment from rest to rest by the minimum-jerk
  polynomial 10τ³ − 15τ⁴ + 6τ⁵, so that rates and accelerations are continuous and zero at the corners;
* ``constant-speed``: the point moves along the four-dimensional curve at constant speed;
* ``equal-time``: every segment takes the same time, at constant speed within it.

The last two turn the corners at full speed: their accelerations are zero between corners and impulses at them,
which no table shows; the rates of a sample at a corner are those just after it.

The other laws keep limits. Their paths are polynomial pieces: coefficients (degree + 1, k, …) of k pieces, highest
power first, in powers of the parameter s since the start of the piece, as in ``scipy.interpolate.PPoly``. The second
derivative of s(t) is continuous and linear between knots, so that s(t) is a cubic there. Put into the path's
polynomials it gives polynomials of time, whose Bernstein coefficients bound their derivatives.

The fastest speed along a closed curve: with b = ṡ², rates and accelerations q″b + q′s̈ are linear in b and s̈. For a
constant s̈ on every interval of a grid they are linear in the values of b at its two ends. Each row bounds the later
value by an increasing function of the earlier one (speeding up), the earlier by the later (slowing down), or both. Such
a set is closed under taking the larger of two solutions point by point, so there is a largest solution; it is the
fastest at every point, and one pass forwards and one backwards from the narrowest point find it, as in Consolini et al.
(Optimal time-complexity speed planning for robot manipulators, 2019).

For s̈ linear between nodes the jerk is √b·(q‴b + 3q″s̈ + q′·ds̈/ds), and its limit J reads |q‴b + 3q″s̈ + q′·ds̈/ds| ≤
J/√b. The right side is convex in b and lies above its tangents: with a tangent in its place the constraint is linear
and implies the true one. Programmes with tangents at the solution before improve step by step.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from gaitgraph.arrays import check_unmasked, freeze_arrays
from gaitgraph.errors import InputError, shown

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from gaitgraph.invertibility.forms import FloatArray

_NEAREST = 1e-12  # share of the period below which a knot and a break coincide
_APART = 1e-9  # the same of two knots
_TIMES = "t must be finite times"
_SECANTS = 30

# From rest to rest: without a jerk limit the acceleration rises in this share of a segment's time, so that it is
# continuous. Floats cannot carry phases shorter than the second share: the limits are lowered to it.
_RISE = 1e-3
_BRIEF = 1e-6

_CAP = 1e30
_PASSES, _PROGRAMMES = 100, 10
_TANGENTS = (
    0.5,
    1.0,
    1.6,
)  # where the time 1/√b is replaced by tangents, as multiples of the solution before
_LEAST, _MOST = 1e-2, 1e3  # bounds of b, as multiples of the solution before


class Law(NamedTuple):
    """A law over any period, the same on each segment, as functions of the share τ of the segment's time."""

    by_length: bool  # whether segments take time in proportion to their length; otherwise all take the same time
    motion: Callable[
        [FloatArray], tuple[FloatArray, FloatArray, FloatArray]
    ]  # share of the length, two derivatives
    peaks: tuple[
        float, float, float, float
    ]  # largest first to fourth derivative; infinite: an impulse at a corner


def _from_rest_to_rest(tau: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    return (
        tau**3 * (10 - 15 * tau + 6 * tau**2),
        30 * tau**2 * (1 - tau) ** 2,
        60 * tau * (1 - tau) * (1 - 2 * tau),
    )


def _evenly(tau: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    return tau, np.ones_like(tau), np.zeros_like(tau)


STRAIGHT = Law(
    by_length=True, motion=_evenly, peaks=(1.0, math.inf, math.inf, math.inf)
)  # rows with own times too
LAWS = {
    # The slope of the minimum-jerk polynomial is 15/8 at τ = 1/2; its slope is 10/√3 at most, that one's 60, its 360.
    "smooth": Law(
        by_length=True,
        motion=_from_rest_to_rest,
        peaks=(15.0 / 8.0, 10.0 / math.sqrt(3.0), 60.0, 360.0),
    ),
    "constant-speed": STRAIGHT,
    "equal-time": STRAIGHT._replace(by_length=False),
}
"""The laws over any period, by name."""

LawName = Literal["smooth", "constant-speed", "equal-time"]

DEFAULT_LAW: LawName = "smooth"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TimingLaw:
    """A monotone periodic law s(t): s, ṡ and s̈ at knots, each of shape (m + 1,), s̈ linear between them.

    The knots t go from 0 to the period [s]; over a period s grows by the path's span.
    """

    t: FloatArray
    s: FloatArray
    speed: FloatArray
    acceleration: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(self)


def bernstein_from_power(pieces: FloatArray, width: FloatArray) -> FloatArray:
    """Return the Bernstein coefficients of polynomial pieces on intervals of given widths, shape as `pieces`."""
    degree = len(pieces) - 1
    scale = width.reshape((-1,) + (1,) * (pieces.ndim - 2))
    rising = np.stack([pieces[degree - j] * scale**j for j in range(degree + 1)])
    mix = np.array(
        [
            [math.comb(i, j) / math.comb(degree, j) for j in range(degree + 1)]
            for i in range(degree + 1)
        ]
    )
    return np.asarray(np.einsum("ij,j...->i...", mix, rising))


def derivative_of(pieces: FloatArray, order: int = 1) -> FloatArray:
    """Return the coefficients of a derivative of polynomial pieces."""
    for _ in range(order):
        power = np.arange(len(pieces) - 1, 0, -1).reshape(
            (-1,) + (1,) * (pieces.ndim - 1)
        )
        pieces = pieces[:-1] * power if len(pieces) > 1 else np.zeros_like(pieces)
    return pieces


def values_of(pieces: FloatArray, local: FloatArray) -> FloatArray:
    """Return polynomials at local parameters: coefficients (degree + 1, ..., d), parameters (...), out (..., d)."""
    return np.asarray(np.polyval(pieces, local[..., None]))


def times_from(
    t: npt.ArrayLike, what: str = _TIMES, least: float = -math.inf
) -> FloatArray:
    """Return times [s] of any shape as an array; InputError, which `what` begins, unless finite and from `least` on."""
    check_unmasked(t, "t")
    try:
        times = np.asarray(t, dtype=float)
    except (
        OverflowError,
        TypeError,
        ValueError,
    ):  # of numpy; the last for rows of different lengths too
        times = np.array(np.nan)
    if not (np.isfinite(times) & (times >= least)).all():
        raise InputError(f"{what}, got {shown(t)}")
    return times


def located(
    breaks: FloatArray, at: npt.ArrayLike, what: str = _TIMES
) -> tuple[npt.NDArray[np.intp], FloatArray]:
    """Return in which piece of a period times or parameters lie, and how far from its start; breaks are from 0 on."""
    phase = np.asarray(np.mod(times_from(at, what), breaks[-1]))
    piece = np.clip(
        np.searchsorted(breaks, phase, side="right") - 1, 0, len(breaks) - 2
    )
    return piece, phase - breaks[piece]


def divided(breaks: FloatArray, count: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the starts and the widths of even parts of intervals, count[k] of the k-th."""
    number = count.astype(np.int64)
    width = np.repeat(np.diff(breaks) / number, number)
    step = np.arange(len(width)) - np.repeat(np.cumsum(number) - number, number)
    return np.repeat(breaks[:-1], number) + step * width, width


def smoothed_law(s: FloatArray, squared: FloatArray, window: float) -> TimingLaw:
    """Return the law of squared speeds at nodes, shapes (n + 1,), averaged over a share of its period.

    Between nodes ṡ² is linear in s, that is, s̈ is constant; the average makes it continuous. The moving average keeps
    the period, and averages of accelerations within convex limits stay within them but for how much the path's
    direction and curvature change over the window.
    """
    from scipy.interpolate import PPoly

    speed, span = np.sqrt(squared), float(s[-1])
    t = np.concatenate([[0.0], np.cumsum(2 * np.diff(s) / (speed[1:] + speed[:-1]))])
    period = float(t[-1])
    half = window * period / 2
    knots = np.unique(
        np.concatenate(
            [np.mod(t[:-1] - half, period), np.mod(t[:-1] + half, period), [0.0]]
        )
    )
    knots = np.append(
        knots[np.diff(np.append(knots, period)) > _APART * period], period
    )
    knots[0] = 0.0
    ahead = np.interp(np.mod(knots + half, period), t, speed)
    behind = np.interp(np.mod(knots - half, period), t, speed)
    rise = (ahead - behind) / (2 * half)
    rise[-1] = rise[0]
    # Subtracting the mean of s̈ closes the speed; the first speed is such that s grows by the span.
    rise = rise - np.trapezoid(rise, knots) / period
    gained = PPoly(
        np.stack([np.diff(rise) / np.diff(knots), rise[:-1]]), knots
    ).antiderivative()
    first = (span - float(gained.integrate(0.0, period))) / period
    # It starts at the mean of s from −half to half; by periodicity s(−u) = s(T − u) − span.
    rough = PPoly(np.stack([np.diff(speed) / np.diff(t) / 2, speed[:-1], s[:-1]]), t)
    around = float(rough.integrate(0.0, half) + rough.integrate(period - half, period))
    smooth = (
        around / (2 * half) - span / 2 + gained.antiderivative()(knots) + first * knots
    )
    smooth[-1] = smooth[0] + span
    speeds = gained(knots) + first
    speeds[-1] = first
    return TimingLaw(t=knots, s=smooth, speed=speeds, acceleration=rise)


def tilts_over_time(
    law: TimingLaw, breaks: FloatArray, pieces: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return widths of intervals of time and (α1, α2) on them, as polynomials of the share of the interval passed.

    Shapes (m,) [s] and (degree + 1, m, 2) [rad], highest power first, for a law of positive speed along a path with
    `breaks` and `pieces`. The first interval begins where the path does.

    The intervals end at the law's knots and where s passes a break of the path. Widths are not differences of times:
    a knot may lie so near to a break that these would carry few digits.
    """
    span, h = float(breaks[-1]), np.diff(law.t)
    # In which interval of the law, and at what share of it, s passes each break: by bisection.
    at, rest = located(law.s - law.s[0], breaks[:-1] - law.s[0])
    v, a, b = (
        law.speed[at] * h[at],
        law.acceleration[at] * h[at] ** 2,
        law.acceleration[at + 1] * h[at] ** 2,
    )
    low, high = np.zeros(len(at)), np.ones(len(at))
    for _ in range(60):
        x = (low + high) / 2
        below = x * (v + x * (a / 2 + x * (b - a) / 6)) < rest
        low, high = np.where(below, x, low), np.where(below, high, x)
    x = (low + high) / 2
    speed, rise = (
        (v + x * (a + x * (b - a) / 2)) / h[at],
        (a + x * (b - a)) / h[at] ** 2,
    )
    # Knots and breaks in order, from the first break on; `number` is that of the break, −1 for a knot.
    interval, share = (
        np.concatenate([np.arange(len(h)), at]),
        np.concatenate([np.zeros(len(h)), x]),
    )
    number = np.concatenate([np.full(len(h), -1), np.arange(len(at))])
    order = np.lexsort((-number, share, interval))
    order = np.roll(order, -int(np.flatnonzero(order == len(h))[0]))
    interval, share, number = interval[order], share[order], number[order]
    following, until = np.roll(interval, -1), np.roll(share, -1)
    widths = np.where(following == interval, until - share, 1.0 - share) * h[interval]
    # Where a knot and a break coincide, the knot is dropped.
    close = widths < _NEAREST * law.t[-1]
    kept = np.flatnonzero(~((number < 0) & (close | np.roll(close, 1))))
    widths = np.add.reduceat(widths, kept)
    number = number[kept]
    s, v, a = (
        np.concatenate(pair)[order][kept]
        for pair in (
            (law.s[:-1], breaks[:-1]),
            (law.speed[:-1], speed),
            (law.acceleration[:-1], rise),
        )
    )
    piece = np.maximum.accumulate(number)
    local = np.where(number >= 0, 0.0, np.mod(s - breaks[piece], span))
    return widths, tilts_between(
        widths, local, np.append(v, v[0]), np.append(a, a[0]), pieces[:, piece]
    )


def tilts_between(
    widths: FloatArray,
    local: FloatArray,
    speed: FloatArray,
    rise: FloatArray,
    pieces: FloatArray,
) -> FloatArray:
    """Return (α1, α2) on intervals of time as polynomials of the share passed, shape (degree + 1, m, 2).

    `local` is s at the start of each interval, since its piece of the path starts, shape (m,); `speed` and `rise` are ṡ
    and s̈ at the knots, shape (m + 1,); `pieces` are those that the intervals run along, shape (n + 1, m, 2).
    """
    h = widths
    cubic = np.stack(
        [(rise[1:] - rise[:-1]) * h**2 / 6, rise[:-1] * h**2 / 2, speed[:-1] * h, local]
    )[:, :, None]
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


def phases(
    distance: float, rate: float, acceleration: float, jerk: float
) -> list[tuple[float, float, float]]:
    """Return the phases of the fastest motion over a distance from rest to rest: duration, s̈ at its start and its end.

    There are seven at most: the acceleration rises to its limit at the limit of jerk, stays, falls to zero, the speed
    stays, and the same the other way round. The limits are positive; the rate may be infinite, and so may the
    acceleration or the jerk. An infinite jerk becomes one that lets the acceleration rise in a thousandth of the time.

    >>> [round(sum(phase[0] for phase in phases(1.0, *limits)), 6) for limits in ((9, 99, 32.0), (1, 2, 4))]
    [1.0, 2.0]
    """
    if math.isinf(jerk):
        cruise = distance * acceleration >= rate**2
        total = (
            distance / rate + rate / acceleration
            if cruise
            else 2.0 * math.sqrt(distance / acceleration)
        )
        jerk = acceleration / (_RISE * total)
    slow = max(distance / rate, 2.0 * math.sqrt(distance / acceleration))
    acceleration = (
        min(acceleration, rate / (_BRIEF * slow)) if slow > 0 else acceleration
    )
    jerk = min(jerk, acceleration / (_BRIEF * slow)) if slow > 0 else jerk
    top = min(rate, (distance * math.sqrt(jerk) / 2.0) ** (2.0 / 3.0))
    if math.isfinite(acceleration) and top * jerk > acceleration**2:
        # The acceleration meets its limit, so that speeding up and slowing down over v takes v(v/a + a/j).
        rise = acceleration / jerk
        top = min(
            rate,
            acceleration
            * (math.sqrt(rise**2 + 4.0 * distance / acceleration) - rise)
            / 2.0,
        )
    highest = min(acceleration, math.sqrt(top * jerk))
    ramp = highest / jerk
    hold, cruise_time = (
        max(top / highest - ramp, 0.0),
        max(distance / top - top / highest - ramp, 0.0),
    )
    up = [(ramp, 0.0, highest), (hold, highest, highest), (ramp, highest, 0.0)]
    down = [(ramp, 0.0, -highest), (hold, -highest, -highest), (ramp, -highest, 0.0)]
    out = [*up, (cruise_time, 0.0, 0.0), *down]
    whole = sum(duration for duration, _, _ in out)
    return [phase for phase in out if phase[0] > 1e-12 * whole]


def rest_to_rest(
    plane: FloatArray, rate: FloatArray, acceleration: FloatArray, jerk: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the law of a closed polyline that rests at every corner, as intervals of time and (α1, α2) on them.

    The corners have shape (n, 2), no two neighbours equal [rad]; the limits of α1 and α2 have shape (2,), infinite
    where there is none. Returns the same as :func:`tilts_over_time`.
    """
    step = np.roll(plane, -1, axis=0) - plane
    lengths = np.linalg.norm(step, axis=1)
    widths, local, speed, rise, piece = [], [], [0.0], [], []
    for k, length in enumerate(lengths.tolist()):
        share = np.abs(step[k]) / length
        moving = share > 1e-12
        along = [
            float((limit[moving] / share[moving]).min())
            for limit in (rate, acceleration, jerk)
        ]
        s, v = 0.0, 0.0
        for h, a0, a1 in phases(length, *along):
            widths.append(h)
            local.append(s)
            piece.append(k)
            s += v * h + h**2 * (2 * a0 + a1) / 6
            v = max(v + h * (a0 + a1) / 2, 0.0)
            speed.append(v)
            rise.append(a0)
        speed[-1] = 0.0
    pieces = np.stack([step / lengths[:, None], plane])[:, piece]
    # The acceleration is continuous: at the end of a phase it is that at the start of the next.
    out = np.array(widths)
    return out, tilts_between(
        out, np.array(local), np.array(speed), np.array([*rise, 0.0]), pieces
    )


def fastest_squared_speeds(
    first: FloatArray,
    second: FloatArray,
    width: FloatArray,
    rate: FloatArray,
    acceleration: FloatArray,
) -> FloatArray:
    """Return the largest b = ṡ² at every node of a closed grid, shape (n + 1,), the last equal to the first.

    `first` and `second` are q′ and q″ of each joint at the nodes, shape (n + 1, m), `width` the widths of the
    intervals, `rate` and `acceleration` the limits of each joint, shape (m,), positive; a rate may be infinite.

    The limits hold at both ends of every interval. A row whose two coefficients have the same sign, where q′ nearly
    vanishes (|q′| ≤ 2·width·|q″|), is replaced by the bound b ≤ limit/|q″| at both ends, which implies it and costs at
    most one interval of speeding up. Where an interval admits no pair of values beyond some point, that point is a
    bound too; then no row is violated after the two passes.
    """
    # Each joint gives |p·b_k + q·b_{k+1}| ≤ limit at either end of an interval: b_{k+1} ≤ (limit + |p|·b_k)/|q| and
    # b_k ≤ (limit + |q|·b_{k+1})/|p| if p and q have opposite signs.
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        bounds = np.minimum(((rate / np.abs(first)) ** 2).min(axis=1), _CAP)
        per = 0.5 / width[:, None]
        p = np.concatenate([second[:-1] - first[:-1] * per, -first[1:] * per], axis=1)
        q = np.concatenate([first[:-1] * per, second[1:] + first[1:] * per], axis=1)
        limit = np.tile(acceleration, 2)
        size_p, size_q = np.abs(p), np.abs(q)
        opposite = p * q <= 0
        up, down = opposite & (q != 0), opposite & (p != 0)
        up_at, up_slope = (
            np.where(up, limit / size_q, _CAP),
            np.where(up, size_p / size_q, 0.0),
        )
        down_at, down_slope = (
            np.where(down, limit / size_p, _CAP),
            np.where(down, size_q / size_p, 0.0),
        )
        box = np.where(p * q > 0, limit / np.abs(p + q), _CAP).min(axis=1)
        # Where two rows of an interval meet: beyond that point they admit no pair of values.
        gain = up_slope[:, :, None] * down_slope[:, None, :]
        rest = 1.0 - gain
        later = np.where(
            rest > 0,
            (up_at[:, :, None] + up_slope[:, :, None] * down_at[:, None, :]) / rest,
            _CAP,
        )
        earlier = np.where(
            rest > 0,
            (down_at[:, None, :] + down_slope[:, None, :] * up_at[:, :, None]) / rest,
            _CAP,
        )
    bounds[:-1] = np.minimum(bounds[:-1], np.minimum(box, earlier.min(axis=(1, 2))))
    bounds[1:] = np.minimum(bounds[1:], np.minimum(box, later.min(axis=(1, 2))))
    bounds[[0, -1]] = min(bounds[0], bounds[-1])
    # Forwards and backwards once round, from the narrowest node on, until that node stays as it is.
    b, start = bounds[:-1].tolist(), int(np.argmin(bounds[:-1]))
    order = np.roll(np.arange(len(b)), -start)
    ways = (
        (order, np.roll(order, -1), up_at, up_slope),
        (order[::-1], order[::-1], down_at, down_slope),
    )
    rounds = [
        [*zip(node.tolist(), at[k].tolist(), slope[k].tolist(), strict=True)]
        for k, node, at, slope in ways
    ]
    for _ in range(_PASSES):
        known = b[start]
        for way in rounds:
            x = b[start]
            for node, (i0, i1, i2, i3), (s0, s1, s2, s3) in way:
                x = b[node] = min(
                    b[node], i0 + s0 * x, i1 + s1 * x, i2 + s2 * x, i3 + s3 * x
                )
        if b[start] >= known * (1 - 1e-13):
            break
    return np.array([*b, b[0]])


def law_through_nodes(
    s: FloatArray, acceleration: FloatArray, speed: float
) -> TimingLaw | None:
    """Return the law through nodes s with given s̈, less a constant so that it closes; None if it would stop.

    The secant method finds the constant with which the last speed is `speed`, the first; it is tiny for s̈ that nearly
    closes. Each interval takes the time in which the cubic covers it.
    """
    rise = np.append(acceleration, acceleration[0])
    width = np.diff(s).tolist()
    before = constant = left = 0.0
    for turn in range(_SECANTS + 1):
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
        more, left = left, v - speed
        if turn and (abs(left) <= 1e-14 * speed or left == more):
            t = np.concatenate([[0.0], np.cumsum(times)])
            return TimingLaw(
                t=t,
                s=s,
                speed=np.array([*speeds[:-1], speed]),
                acceleration=rise - constant,
            )
        # First guess: the constant times the span lowers half the squared speed.
        change = (
            left * (constant - before) / (left - more)
            if turn
            else (speed**2 - v**2) / (2 * float(s[-1]))
        )
        before, constant = constant, constant - change
    return None


def laws_under_jerk(
    breaks: FloatArray,
    pieces: FloatArray,
    s: FloatArray,
    start: FloatArray,
    limits: FloatArray,
    progress: Callable[[str], None] | None = None,
) -> Iterator[TimingLaw]:
    """Yield ever faster laws whose rates, accelerations and jerks keep the limits at nodes.

    `start` is ṡ² of some slower law at the nodes `s`, shapes (n,) and (n + 1,), which have all breaks among them. The
    limits are rate, acceleration and jerk at the nodes, shape (3, n, 2); they may be changed in place between two laws.

    Between nodes they may exceed limits a little. The iteration ends once a programme has no solution.
    """
    from scipy import sparse
    from scipy.optimize import linprog

    diagonal, width, n = sparse.diags, np.diff(s), len(s) - 1
    # The path's derivatives at the nodes; the third, which jumps at breaks, at both ends of each interval.
    piece = np.searchsorted(breaks, (s[:-1] + s[1:]) / 2, side="right") - 1
    first, second, *thirds = (
        values_of(derivative_of(pieces, order)[:, piece], nodes - breaks[piece])
        for order, nodes in ((1, s[:-1]), (2, s[:-1]), (3, s[:-1]), (3, s[1:]))
    )
    # The variables of a programme: b, s̈ and a bound of 1/√b, at the nodes of the closed grid.
    here, none, at_end = (
        sparse.identity(n, format="csr"),
        sparse.csr_matrix((n, n)),
        np.roll(np.arange(n), -1),
    )
    after = sparse.csr_matrix(
        (np.ones(n), (np.arange(n), (np.arange(n) + 1) % n)), shape=(n, n)
    )
    slope = diagonal(1.0 / width) @ (after - here)
    # b grows by the trapezoidal integral of 2s̈.
    grows = sparse.csr_matrix(
        sparse.hstack([after - here, -(diagonal(width) @ (here + after)), none])
    )
    around = (width + np.roll(width, 1)) / 2
    b = start
    for k in range(_PROGRAMMES):
        if progress is not None:
            progress(
                f"programme {k + 1} of at most {_PROGRAMMES} under the jerk limit, {n} nodes"
            )
        rows: list[Any] = []
        right: list[FloatArray] = []
        for joint in range(2):
            one, two = first[:, joint], second[:, joint]
            gained = sparse.hstack([diagonal(two), diagonal(one), none])
            rows += [gained, -gained]
            right += [limits[1][:, joint]] * 2
            for third, node, pick in (
                (thirds[0], slice(None), here),
                (thirds[1], at_end, after),
            ):
                bends = 3.0 * diagonal(two[node]) @ pick + diagonal(one[node]) @ slope
                jerk = sparse.hstack([diagonal(third[:, joint]) @ pick, bends, none])
                limit, known = limits[2][node, joint], b[node]
                tangent = sparse.hstack(
                    [diagonal(0.5 * limit * known**-1.5) @ pick, none, none]
                )
                rows += [jerk + tangent, tangent - jerk]
                right += [1.5 * limit * known**-0.5] * 2
        for share in _TANGENTS:
            at = share * b
            rows.append(sparse.hstack([diagonal(-0.5 * at**-1.5), none, -here]))
            right.append(-1.5 * at**-0.5)
        sides = np.concatenate(right)
        # Relative to the solution before, so that the solver's absolute tolerances mean the same everywhere.
        unit = diagonal(np.concatenate([b, b / around, b**-0.5]))
        above: Any = sparse.csr_matrix(
            diagonal(1.0 / np.abs(sides)) @ sparse.vstack(rows) @ unit
        )
        equal: Any = sparse.csr_matrix(
            diagonal(1.0 / np.maximum(b, np.roll(b, -1))) @ grows @ unit
        )
        with np.errstate(divide="ignore"):
            fastest = np.minimum(
                ((limits[0] / np.abs(first)) ** 2).min(axis=1) / b, _MOST
            )
        low = np.concatenate([np.full(n, _LEAST), np.full(n, -np.inf), np.zeros(n)])
        bounds: Any = np.column_stack(
            [low, np.concatenate([fastest, np.full(2 * n, np.inf)])]
        )
        time = around * b**-0.5
        cost = np.concatenate([np.zeros(2 * n), time / time.sum()])
        lp = linprog(
            cost,
            A_ub=above,
            b_ub=np.sign(sides),
            A_eq=equal,
            b_eq=np.zeros(n),
            bounds=bounds,
            method="highs",
        )
        if lp.x is None:
            return
        rise = np.asarray(lp.x[n : 2 * n] * b / around)
        b = np.asarray(lp.x[:n] * b)
        law = law_through_nodes(s, rise, float(np.sqrt(b[0])))
        if law is None:
            return
        yield law
