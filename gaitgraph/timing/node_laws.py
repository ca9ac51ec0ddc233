"""Laws along a path: what the position s(t) does at nodes, and how fast it may be.

A path is polynomial pieces of a parameter s. A law along it is stated in one way: the speed ṡ and the acceleration s̈ at
nodes, among which are all breaks of the path. Between two nodes the speed is the cubic polynomial of time with these
values at both ends. Its duration h follows from the width Δs of the interval,

    Δs = h·(v₀ + v₁)/2 + h²·(a₀ − a₁)/12,

so that every choice of speeds and accelerations is a law that closes and is twice continuously differentiable. Put into
the path's polynomials it gives polynomials of time, whose Bernstein coefficients bound their derivatives.

Three ways lead to speeds, each for what its limits ask. None serves for another: on 25 random loops laws with rests
found at 2000 nodes took 8 % to 11 % longer than the phases, and a linear programme takes about 25 times as long as the
passes, and has no tangent to 1/√b where a law rests.

* from rest to rest along straight lines, in the phases of the fastest motion (:func:`rest_to_rest`);
* along a smooth curve, or one with rests at corners, under limits of rate and acceleration. With b = ṡ² the
  accelerations q″b + q′s̈ are linear in b and s̈. For a constant s̈ on every interval they are linear in b at its two
  ends, and each limit bounds the later value by an increasing function of the earlier one (speeding up), the earlier by
  the later (slowing down), or both. Such a set is closed under taking the larger of two solutions point by point, so it
  has a largest solution, the fastest at every point. One pass forwards and one backwards from the narrowest point find
  it, as in Consolini et al. (Optimal time-complexity speed planning for robot manipulators, 2019);
* with a limit J of the jerk √b·(q‴b + 3q″s̈ + q′·ds̈/ds) as well, which reads |q‴b + 3q″s̈ + q′·ds̈/ds| ≤ J/√b. The right
  side is convex in b and lies above its tangents: with a tangent in its place the limit is linear and implies the true
  one. Linear programmes with tangents at the solution before improve step by step.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from gaitgraph.arrays import freeze_arrays
from gaitgraph.invertibility.forms import FloatArray
from gaitgraph.timing.polynomials import bends_of, derivative_of, values_of

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

# Intervals on a piece of a curve; with two, least periods under a jerk limit were up to 0.6 % longer.
_FEWEST = 8
# Growth of the distance between nodes, from one to the next; without it least periods were up to 0.7 % longer.
_GROWTH = 0.3

# From rest to rest: without a jerk limit the acceleration rises in this share of a segment's time, so that it is
# continuous. Floats cannot carry phases shorter than the second share: the limits are lowered to it.
_RISE = 1e-3
_BRIEF = 1e-6

_PROGRAMMES = 10  # twice as many as most laws need
_SETTLED = 1e-3  # share of the time that a programme must gain for another one
_UNLIMITED = 1e30  # in place of infinity, which times zero is not a number
_ROUNDS = 100  # of passes; two are enough unless the narrowest point is narrowed
# As multiples of the solution before: where the time 1/√b is replaced by tangents, which together are within 5 % of it
# from 0.34 to 2.2, and a lower bound of b, so that it stays positive.
_TANGENTS = (0.5, 1.0, 1.6)
_LEAST = 1e-2

# The widths of the n intervals of time [s], and (α1, α2) or all angles on them as polynomials of the share that has
# passed, highest power first, shape (degree + 1, n, joints).
NodeLaw = tuple[FloatArray, FloatArray]
# ṡ² and s̈ at the n nodes of a grid, each of shape (n,).
Speeds = tuple[FloatArray, FloatArray]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Grid:
    """Nodes `s` along a closed path, shape (n + 1,); at those with the numbers `rests` laws rest.

    `local` is s at the start of each interval since its piece of the path starts, shape (n,), and `pieces` are those
    that the intervals run along, shape (degree + 1, n, joints).
    """

    s: FloatArray
    local: FloatArray
    pieces: FloatArray
    rests: npt.NDArray[np.intp]

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def width(self) -> FloatArray:
        """Widths of the intervals, shape (n,)."""
        return np.diff(self.s)

    def derivative(self, order: int, *, at_end: bool = False) -> FloatArray:
        """Return a derivative of the path at the start of each interval, or at its end, shape (n, joints)."""
        local = self.local + self.width if at_end else self.local
        return values_of(derivative_of(self.pieces, order), local)

    def law(self, speeds: Speeds) -> NodeLaw:
        """Return the law with given speeds at the nodes."""
        squared, acceleration = speeds
        speed = np.sqrt(closed(squared))
        width = self.width
        mean = (speed[1:] + speed[:-1]) / 2
        # Up to this size of all accelerations an interval surely has a duration.
        most = mean**2 / width
        most = np.minimum(most, np.roll(most, 1))
        rise = closed(np.clip(acceleration, -most, most))
        root = np.sqrt(mean**2 + width * (rise[:-1] - rise[1:]) / 3)
        durations = 2 * width / (mean + root)
        return law_between(durations, speed, rise, self.local, self.pieces)


def law_between(
    durations: FloatArray,
    speed: FloatArray,
    acceleration: FloatArray,
    local: FloatArray,
    pieces: FloatArray,
) -> NodeLaw:
    """Return the law with given ṡ and s̈ at nodes, shape (n + 1,); `local` and `pieces` are those of :class:`Grid`."""
    h = durations
    gain = np.diff(speed)
    first = h * acceleration[:-1]
    last = h * acceleration[1:]
    position = [
        h * (first + last - 2 * gain) / 4,
        h * (3 * gain - 2 * first - last) / 3,
        h * first / 2,
        h * speed[:-1],
        local,
    ]
    tilts = pieces[:1].copy()
    for coefficient in pieces[1:]:
        # Horner's rule with polynomials: multiply by the position, add the next coefficient.
        product = np.zeros((len(tilts) + 4, *tilts.shape[1:]))
        for power, part in enumerate(position):
            product[power : power + len(tilts)] += tilts * part[:, None]
        tilts = product
        tilts[-1] += coefficient
    return durations, tilts


def closed(values: FloatArray) -> FloatArray:
    """Return values at the nodes of a closed grid with the first again at the end."""
    return np.concatenate([values, values[:1]])


def grid_along(
    breaks: FloatArray, pieces: FloatArray, nodes: int, corners: Sequence[int] = ()
) -> Grid:
    """Return nodes from 0 to the span of a path, all breaks among them, evenly within pieces; laws rest at corners.

    Half of the nodes are spread by width, half by how much a piece bends, where the limits of the joints change.
    Speeds change much beside a short piece: distances shrink towards it by 30 % from one node to the next.
    """
    width = np.diff(breaks)
    bend = width * bends_of(pieces, width)
    share = width / width.sum()
    if bend.sum() > 0:
        share = (share + bend / bend.sum()) / 2
    steps = width / np.maximum(np.ceil(nodes * share * (1 - 1e-12)), _FEWEST)
    at_break = np.minimum(steps, np.roll(steps, 1))
    local = []
    for k, (whole, step) in enumerate(zip(width.tolist(), steps.tolist(), strict=True)):
        first = _shrinking(float(at_break[k]), step, whole / 2)
        last = _shrinking(float(at_break[(k + 1) % len(steps)]), step, whole / 2)
        middle = whole - sum(first) - sum(last)
        count = max(math.ceil(middle / step * (1 - 1e-12)), 1)
        sizes = [0.0, *first, *[middle / count] * count, *last[::-1]]
        local.append(np.cumsum(sizes)[:-1])
    piece = np.repeat(np.arange(len(width)), [len(starts) for starts in local])
    from_start = np.concatenate(local)
    s = np.append(breaks[piece] + from_start, breaks[-1])
    rests = np.searchsorted(s, breaks[list(corners)])
    return Grid(s=s, local=from_start, pieces=pieces[:, piece], rests=rests)


def _shrinking(nearest: float, step: float, room: float) -> list[float]:
    """Return widths of intervals from a break on, that grow from the nearest to below a step, in some room."""
    count = math.ceil(math.log(step / nearest) / math.log1p(_GROWTH))
    sizes = nearest * (1 + _GROWTH) ** np.arange(count)
    fits = (sizes < step / (1 + _GROWTH)) & (np.cumsum(sizes) < room)
    kept: list[float] = sizes[fits].tolist()
    return kept


# -- From rest to rest


def rest_to_rest(plane: FloatArray, limits: FloatArray) -> NodeLaw:
    """Return the fastest law of a closed polyline that rests at every corner.

    The corners have shape (n, 2), no two neighbours equal [rad]; the limits of rate, acceleration and jerk of α1 and α2
    have shape (3, 2), infinite where there is none.
    """
    step = np.roll(plane, -1, axis=0) - plane
    lengths = np.linalg.norm(step, axis=1)
    straight = np.stack([step / lengths[:, None], plane])
    durations, local, speed, rise, segment = [], [], [0.0], [], []
    for k, length in enumerate(lengths.tolist()):
        share = np.abs(step[k]) / length
        moving = share > 1e-12
        along = limits[:, moving] / share[moving]
        s = v = 0.0
        for h, starting, ending in phases(length, *along.min(axis=1).tolist()):
            durations.append(h)
            local.append(s)
            segment.append(k)
            rise.append(starting)
            s += v * h + h**2 * (2 * starting + ending) / 6
            v = max(v + h * (starting + ending) / 2, 0.0)
            speed.append(v)
        speed[-1] = 0.0
    # The acceleration is continuous: at the end of a phase it is that at the start of the next.
    rise.append(0.0)
    return law_between(
        np.array(durations),
        np.array(speed),
        np.array(rise),
        np.array(local),
        straight[:, segment],
    )


class Phase(NamedTuple):
    """A part of a motion whose acceleration changes evenly."""

    duration: float
    starting: float  # the acceleration at its start
    ending: float


def phases(
    distance: float, rate: float, acceleration: float, jerk: float
) -> list[Phase]:
    """Return the phases of the fastest motion over a distance from rest to rest.

    There are seven at most: the acceleration rises to its limit at the limit of jerk, stays, falls to zero, the speed
    stays, and the same the other way round. The limits are positive; the rate may be infinite, and so may the
    acceleration or the jerk. An infinite jerk becomes one that lets the acceleration rise in a thousandth of the time.

    >>> [round(sum(phase.duration for phase in phases(1.0, *limits)), 6) for limits in ((9, 99, 32.0), (1, 2, 4))]
    [1.0, 2.0]
    """
    if math.isinf(jerk):
        total = 2.0 * math.sqrt(distance / acceleration)
        if distance * acceleration >= rate**2:
            total = distance / rate + rate / acceleration
        jerk = acceleration / (_RISE * total)
    slow = max(distance / rate, 2.0 * math.sqrt(distance / acceleration))
    if slow > 0:
        acceleration = min(acceleration, rate / (_BRIEF * slow))
        jerk = min(jerk, acceleration / (_BRIEF * slow))
    top = min(rate, (distance * math.sqrt(jerk) / 2.0) ** (2.0 / 3.0))
    if math.isfinite(acceleration) and top * jerk > acceleration**2:
        # The acceleration meets its limit, so that speeding up and slowing down over v takes v(v/a + a/j).
        rise = acceleration / jerk
        root = math.sqrt(rise**2 + 4.0 * distance / acceleration)
        top = min(rate, acceleration * (root - rise) / 2.0)
    highest = min(acceleration, math.sqrt(top * jerk))
    ramp = highest / jerk
    hold = max(top / highest - ramp, 0.0)
    cruise = max(distance / top - top / highest - ramp, 0.0)
    motion = [
        Phase(ramp, 0.0, highest),
        Phase(hold, highest, highest),
        Phase(ramp, highest, 0.0),
        Phase(cruise, 0.0, 0.0),
        Phase(ramp, 0.0, -highest),
        Phase(hold, -highest, -highest),
        Phase(ramp, -highest, 0.0),
    ]
    whole = sum(phase.duration for phase in motion)
    return [phase for phase in motion if phase.duration > 1e-12 * whole]


# -- Under limits of rate and acceleration


def fastest_speeds(grid: Grid, limits: FloatArray) -> Speeds:
    """Return the speeds of the fastest law under limits of rate and acceleration at the nodes, shape (2 or 3, n, 2).

    The fastest speeds have a constant s̈ on every interval. At a node it becomes the mean of both sides, weighted so
    that ṡ² grows by as much along the whole path, and ṡ² is what it then is.
    """
    after = grid.width
    squared = fastest_squared_speeds(
        closed(grid.derivative(1)),
        closed(grid.derivative(2)),
        after,
        closed(limits[0]),
        closed(limits[1]),
        grid.rests,
    )
    rise_after = np.diff(squared) / (2 * after)
    before, rise_before = np.roll(after, 1), np.roll(rise_after, 1)
    rise = (before * rise_before + after * rise_after) / (before + after)
    change = before * after / (before + after) * (rise_after - rise_before)
    # A change of more than that is of a grid too coarse for the limits; any speed makes a law.
    squared = np.maximum(squared[:-1] + change, 0.25 * squared[:-1])
    squared[grid.rests] = 0.0
    rise[grid.rests] = 0.0
    return squared, rise


def fastest_squared_speeds(
    first: FloatArray,
    second: FloatArray,
    width: FloatArray,
    rate: FloatArray,
    acceleration: FloatArray,
    rests: npt.ArrayLike = (),
) -> FloatArray:
    """Return the largest b = ṡ² at every node of a closed grid, shape (n + 1,), the last equal to the first.

    `first` and `second` are q′ and q″ of the joints at the nodes, shape (n + 1, joints), `width` the widths of the
    intervals, `rate` and `acceleration` the positive limits of the joints at the nodes, of the same shape or (joints,);
    a rate may be infinite. At the nodes with the numbers `rests` b is 0.

    The limits hold at both ends of every interval. A row whose two coefficients have the same sign, where q′ nearly
    vanishes (|q′| ≤ 2·width·|q″|), is replaced by the bound b ≤ limit/|q″| at both ends, which implies it and costs at
    most one interval of speeding up. Where an interval admits no pair of values beyond some point, that point is a
    bound too; then no row is violated after the two passes.
    """
    acceleration = np.broadcast_to(acceleration, first.shape)
    # Each joint gives |p·b_k + q·b_{k+1}| ≤ limit at either end of an interval: b_{k+1} ≤ (limit + |p|·b_k)/|q| and
    # b_k ≤ (limit + |q|·b_{k+1})/|p| if p and q have opposite signs.
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        bounds = np.minimum(((rate / np.abs(first)) ** 2).min(axis=1), _UNLIMITED)
        per = 0.5 / width[:, None]
        p = np.concatenate([second[:-1] - first[:-1] * per, -first[1:] * per], axis=1)
        q = np.concatenate([first[:-1] * per, second[1:] + first[1:] * per], axis=1)
        limit = np.concatenate([acceleration[:-1], acceleration[1:]], axis=1)
        box = np.where(p * q > 0, limit / np.abs(p + q), _UNLIMITED).min(axis=1)
        up = _line(limit, p, q)
        down = _line(limit, q, p)
        # Where two rows of an interval meet: beyond that point they admit no pair of values.
        later = _meeting(up, down).min(axis=(1, 2))
        earlier = _meeting(down, up).min(axis=(1, 2))
    bounds[:-1] = np.minimum(bounds[:-1], np.minimum(box, earlier))
    bounds[1:] = np.minimum(bounds[1:], np.minimum(box, later))
    bounds[np.asarray(rests, dtype=np.intp)] = 0.0
    bounds[[0, -1]] = min(bounds[0], bounds[-1])
    return _passed(bounds, up, down)


class _Lines(NamedTuple):
    """Upper bounds of the value at one end of each interval, start + slope·(value at the other end), shapes (n, rows)."""

    start: FloatArray
    slope: FloatArray


def _line(limit: FloatArray, known: FloatArray, bounded: FloatArray) -> _Lines:
    """Return the bounds that rows with these coefficients of a known and a bounded value are."""
    bounds = (known * bounded <= 0) & (bounded != 0)
    size = np.abs(bounded)
    return _Lines(
        np.where(bounds, limit / size, _UNLIMITED),
        np.where(bounds, np.abs(known) / size, 0.0),
    )


def _meeting(bounded: _Lines, other: _Lines) -> FloatArray:
    """Return the largest value of one end that each pair of rows admits, shape (n, rows, rows)."""
    start, slope = bounded.start[:, :, None], bounded.slope[:, :, None]
    rest = 1.0 - slope * other.slope[:, None, :]
    value = (start + slope * other.start[:, None, :]) / rest
    return np.where(rest > 0, value, _UNLIMITED)


def _passed(bounds: FloatArray, up: _Lines, down: _Lines) -> FloatArray:
    """Return the largest values within bounds at nodes and the rows of the intervals, both of a closed grid."""
    b = bounds[:-1].tolist()
    start = int(np.argmin(bounds[:-1]))
    order = np.roll(np.arange(len(b)), -start)
    forwards = (order, np.roll(order, -1), up)
    backwards = (order[::-1], order[::-1], down)
    ways = [
        [*zip(node.tolist(), np.stack(lines, axis=2)[interval].tolist(), strict=True)]
        for interval, node, lines in (forwards, backwards)
    ]
    # From the narrowest node on once round, until that node stays as it is.
    for _ in range(_ROUNDS):
        known = b[start]
        for way in ways:
            x = b[start]
            for node, rows in way:
                least = b[node]
                for lowest, slope in rows:
                    least = min(least, lowest + slope * x)
                x = b[node] = least
        if b[start] >= known * (1 - 1e-13):
            break
    return np.array([*b, b[0]])


# -- Under a jerk limit


def speeds_under_jerk(
    grid: Grid,
    squared: FloatArray,
    limits: FloatArray,
    progress: Callable[[str], None] | None,
) -> Speeds | None:
    """Return the speeds of the law after which another linear programme gains little.

    `squared` is ṡ² of some slower law, and `limits` are those at the nodes, shape (3, n, joints). The last solution is
    returned where a programme has none, and None if that is the first. Between nodes the law may exceed limits a little.
    """
    settled = None
    around = (grid.width + np.roll(grid.width, 1)) / 2
    for number in range(1, _PROGRAMMES + 1):
        if progress is not None:
            progress(f"programme {number} under the jerk limit, {len(squared)} nodes")
        solution = _faster(grid, squared, limits)
        if solution is None:
            break
        before = around @ squared**-0.5
        settled = solution
        squared, _ = solution
        if around @ squared**-0.5 > (1 - _SETTLED) * before:
            break
    return settled


def _faster(grid: Grid, squared: FloatArray, limits: FloatArray) -> Speeds | None:
    """Return the solution of the linear programme with tangents at a law before, None if it has none.

    Its variables are b = ṡ², s̈ and a bound of 1/√b at the nodes.
    """
    from scipy import sparse
    from scipy.optimize import linprog

    n = len(squared)
    width = grid.width
    around = (width + np.roll(width, 1)) / 2
    at_start = sparse.identity(n, format="csr")
    at_end = at_start[np.roll(np.arange(n), -1)]
    # b grows by the trapezoidal integral of 2s̈.
    gain = sparse.diags(width) @ (at_start + at_end)
    grows = sparse.hstack([at_end - at_start, -gain, sparse.csr_matrix((n, n))])
    rows, right = _rows_under_jerk(grid, squared, limits, at_start, at_end)
    # Relative to the law before, so that the solver's absolute tolerances mean the same everywhere.
    unit = sparse.diags(np.concatenate([squared, squared / around, squared**-0.5]))
    above: Any = sparse.diags(1.0 / np.abs(right)) @ rows @ unit
    equal: Any = sparse.diags(1.0 / np.maximum(squared, np.roll(squared, -1)))
    equal = equal @ grows @ unit
    with np.errstate(divide="ignore"):
        fastest = ((limits[0] / np.abs(grid.derivative(1))) ** 2).min(axis=1)
    bounds: Any = np.full((3 * n, 2), (-np.inf, np.inf))
    bounds[:n] = np.column_stack([np.full(n, _LEAST), fastest / squared])
    bounds[2 * n :, 0] = 0.0
    time = around * squared**-0.5
    solution = linprog(
        np.concatenate([np.zeros(2 * n), time / time.sum()]),
        A_ub=above.tocsr(),
        b_ub=np.sign(right),
        A_eq=equal.tocsr(),
        b_eq=np.zeros(n),
        bounds=bounds,
        method="highs",
    ).x
    if solution is None:
        return None
    return solution[:n] * squared, solution[n : 2 * n] * squared / around


def _rows_under_jerk(
    grid: Grid, squared: FloatArray, limits: FloatArray, at_start: Any, at_end: Any
) -> tuple[Any, FloatArray]:
    """Return the rows of the limits and of the bounds of 1/√b, and their right sides.

    `at_start` and `at_end` pick the values at the nodes of each interval.
    """
    from scipy import sparse

    diagonal = sparse.diags
    change = diagonal(1.0 / grid.width) @ (at_end - at_start)
    first, second = grid.derivative(1), grid.derivative(2)
    ends = [
        (at_start, 0, grid.derivative(3)),
        (at_end, -1, grid.derivative(3, at_end=True)),
    ]
    rows: list[Any] = []
    right: list[FloatArray] = []
    for joint in range(first.shape[1]):
        slope, bend = first[:, joint], second[:, joint]
        for sign in (1.0, -1.0):
            rows.append([diagonal(sign * bend), diagonal(sign * slope), None])
            right.append(limits[1][:, joint])
        for pick, shift, third in ends:
            known = np.roll(squared, shift)
            limit = np.roll(limits[2][:, joint], shift)
            tangent = diagonal(0.5 * limit * known**-1.5) @ pick
            of_squared = diagonal(third[:, joint]) @ pick
            of_rise = 3.0 * diagonal(np.roll(bend, shift)) @ pick
            of_rise += diagonal(np.roll(slope, shift)) @ change
            for sign in (1.0, -1.0):
                rows.append([tangent + sign * of_squared, sign * of_rise, None])
                right.append(1.5 * limit * known**-0.5)
    for share in _TANGENTS:
        at = share * squared
        rows.append([diagonal(-0.5 * at**-1.5), None, -at_start])
        right.append(-1.5 * at**-0.5)
    return sparse.bmat(rows), np.concatenate(right)
