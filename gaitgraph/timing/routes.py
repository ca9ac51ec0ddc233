"""What a law runs along, and the fastest way to.

A smooth curve is run without a stop, a polyline rests at its corners.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from gaitgraph.errors import InputError, shown
from gaitgraph.gait.gait import Gait
from gaitgraph.timing.curve import Curve
from gaitgraph.timing.jerk import laws_under_jerk
from gaitgraph.timing.path_laws import peaks_of, smoothed_law, tilts_over_time
from gaitgraph.timing.polynomials import bernstein_from_power, derivative_of
from gaitgraph.timing.rest_laws import legs_from_rest_to_rest
from gaitgraph.timing.rounding import Rounding, rounded
from gaitgraph.timing.speeds import fastest_squared_speeds

if TYPE_CHECKING:
    from collections.abc import Callable

    from gaitgraph.timing.limits import Limits
    from gaitgraph.timing.path_laws import Law

__all__ = ["Route"]

FloatArray = npt.NDArray[np.float64]
Timed = tuple[FloatArray, FloatArray]

_FEWEST = 8
_WINDOWS = (1e-3, 3e-4, 1e-4)
_ENOUGH = 5e-4
_WINDOWS_UNDER_JERK = (0.3, 0.2, 0.1, 0.05, 0.02, 0.01, 5e-3, 2e-3, 1e-3)
_BRIEF = 1e-3
_GROWTH = 0.3
_CORRECTIONS = 4
_SETTLED = 1e-3
_STILL = 1e-12
_ROUND_OFF = 1e-12
# With more nodes than these, programmes take minutes.
_MOST_NODES_UNDER_JERK = 5000


class Route:
    """What is run.

    Parameters
    ----------
    path
        A gait of one color, a curve, or a rounded gait.
    rounding
        Tolerance by which to round a gait's corners, or None.

    Attributes
    ----------
    curve
        The smooth curve, or None for a gait with corners that is not rounded.
    gait
        The polyline: the gait itself, or points of the curve.
    rounding
        How corners were rounded, or None.
    vehicle
        What it is for.
    extent
        By how much α1 and α2 vary, shape (2,) [rad].
    still
        Whether it is a point.
    """

    def __init__(self, path: Gait | Curve | Rounding, rounding: float | str | None = None) -> None:
        if not isinstance(path, (Gait, Curve, Rounding)):
            raise InputError(f"path: {shown(path)}; allowed is a gait, a curve or a rounded gait")
        if rounding is not None and not isinstance(path, Gait):
            raise InputError(f"rounding: {shown(rounding)}; allowed for a gait, since a curve has no corners")
        self.rounding = path if isinstance(path, Rounding) else None
        self.curve: Curve | None = path if isinstance(path, Curve) else None
        if isinstance(path, Gait):
            # A gait that does nothing but turn back on its line is smooth as it is, whatever the tolerance.
            found = rounded(path, 1e-3 if rounding is None else rounding)
            if rounding is not None:
                self.rounding = found
            elif found.deviation == 0:
                self.curve = found.curve
        if self.rounding is not None:
            self.curve = self.rounding.curve
        if self.curve is not None:
            self.gait = self.curve.polyline()
            self.extent = np.ptp(self.curve.extremes()[:, :2], axis=0)
        elif isinstance(path, Gait):
            self.gait = path.merged()
            self.extent = np.ptp(path.alpha[:, :2], axis=0)
        if isinstance(path, Gait):
            self.gait = replace(self.gait, request=path.request)  # what was planned is what is paced
        self.vehicle = self.gait.vehicle
        self.still = bool(self.extent.max() <= _STILL)

    def at_rest(self, path: Gait | Curve | Rounding) -> Route | None:
        """Return the way along the same gait that rests at its corners, if this one rounds them."""
        if self.rounding is None or self.rounding.deviation == 0 or not isinstance(path, Gait):
            return None
        return Route(path)

    def fastest(
        self, limits: Limits, nodes: int, progress: Callable[[str], None] | None = None
    ) -> tuple[FloatArray, FloatArray, float, str]:
        """Return widths of intervals, tilts on them, by how much time was stretched to keep the limits, and a note.

        Parameters
        ----------
        limits
            What to respect; positive on every joint that moves.
        nodes
            How many intervals the curve is divided into, about.
        progress
            Called with a line of text before each programme.

        Notes
        -----
        The note says what was left undone; it is empty as a rule.
        """
        stated = [limits.in_plane(kind) for kind in ("rate", "acceleration", "jerk")]
        completed = limits.completed(self.extent)
        if self.curve is None:
            plane = self.gait.alpha[:, :2]
            legs = legs_from_rest_to_rest(np.array(plane), stated[0], completed[1], stated[2])
            return *self._kept(legs, stated), ""
        moving = self.extent > _STILL
        # A joint that stands still keeps any limit.
        rate, acceleration, jerk = (np.where(moving, limit, 1.0) for limit in completed)
        s = _grid(self.curve, nodes)
        first, second = (self.curve.at(s, order)[:, :2] for order in (1, 2))
        squared = fastest_squared_speeds(first, second, np.diff(s), rate, acceleration)
        # A limit that is met for less than a thousandth of the period would be beyond the averages and the nodes below.
        period = float((2 * np.diff(s) / (np.sqrt(squared[1:]) + np.sqrt(squared[:-1]))).sum())
        acceleration = np.minimum(acceleration, rate / (_BRIEF * period))
        jerk = np.minimum(jerk, acceleration / (_BRIEF * period))
        squared = fastest_squared_speeds(first, second, np.diff(s), rate, acceleration)
        if limits.jerk is None:
            for window in _WINDOWS:
                found = self._kept(self._over_time(smoothed_law(s, squared, window)), stated)
                if found[2] <= _ENOUGH:
                    break
            return *found, ""
        laws = [smoothed_law(s, squared, window) for window in _WINDOWS_UNDER_JERK]
        kept = [self._kept(self._over_time(law), stated) for law in laws]
        best = min(range(len(kept)), key=lambda k: _period(kept[k]))
        if len(s) - 1 > _MOST_NODES_UNDER_JERK:
            note = (
                f"not optimised under the jerk limit: {len(s) - 1} nodes on {len(self.curve.breaks) - 1} pieces, at "
                f"most {_MOST_NODES_UNDER_JERK} are; for a faster law thin out the table, ask for fewer nodes, "
                "or drop the jerk limit"
            )
            return *kept[best], note
        start = laws[best].stretched(1.0 + kept[best][2])
        known = np.interp(s[:-1], *_unrolled(start, float(s[-1]))) ** 2
        return *self._fastest_under_jerk(s, known, (rate, acceleration, jerk), kept[best], stated, progress), ""

    def _fastest_under_jerk(
        self,
        s: FloatArray,
        squared: FloatArray,
        limits: tuple[FloatArray, FloatArray, FloatArray],
        found: tuple[FloatArray, FloatArray, float],
        stated: list[FloatArray],
        progress: Callable[[str], None] | None,
    ) -> tuple[FloatArray, FloatArray, float]:
        """Return the best of some linear programmes and of what was found before.

        A programme keeps the limits at nodes. When it no longer gains, limits are lowered at the nodes beside which
        its law exceeds them, a few times, so that less is left to stretch.
        """
        assert self.curve is not None  # noqa: S101
        at_nodes = [np.tile(limit, (len(s) - 1, 1)) for limit in limits]
        corrections, before = 0, math.inf
        under = (at_nodes[0], at_nodes[1], at_nodes[2])
        for law in laws_under_jerk(self.curve, s, squared, under, progress):
            widths, tilts = self._over_time(law)
            candidate = self._kept((widths, tilts), stated)
            found = min(found, candidate, key=_period)
            gains, before = law.period < before * (1 - _SETTLED), law.period
            if gains and not corrections:
                continue
            if corrections == _CORRECTIONS or abs(candidate[2]) < _ENOUGH:
                break
            corrections += 1
            interval = np.clip(np.searchsorted(law.t, np.cumsum(widths) - widths / 2) - 1, 0, len(s) - 2)
            for order in (2, 3):
                excess = np.ones((len(s) - 1, 2))
                np.maximum.at(excess, interval, peaks_of(widths, tilts, order) / limits[order - 1])
                at_nodes[order - 1] /= np.maximum(excess, np.roll(excess, 1, axis=0))
        return found

    def _over_time(self, law: Law) -> Timed:
        assert self.curve is not None  # noqa: S101
        return tilts_over_time(law, self.curve.breaks, self.curve.pieces)

    def _kept(self, timed: Timed, stated: list[FloatArray]) -> tuple[FloatArray, FloatArray, float]:
        """Return a law with its time stretched, or shortened, until its certain peaks meet the limits."""
        widths, tilts = timed
        factor = 0.0
        for order, limit in enumerate(stated, start=1):
            peak = peaks_of(widths, tilts, order).max(axis=0)
            of = np.isfinite(limit) & (self.extent > _STILL)
            if of.any():
                factor = max(factor, float((peak[of] / limit[of]).max()) ** (1.0 / order))
        return widths * (factor * (1.0 + _ROUND_OFF)), tilts, factor - 1.0

    def blocked(self, limits: Limits) -> tuple[str, int, FloatArray] | None:
        """Return a limit of zero on a joint that must move: kind, joint and tilt angles there; or None."""
        for kind in ("rate", "acceleration", "jerk"):
            limit = limits.in_plane(kind)
            for joint in range(2):
                if limit[joint] == 0 and self.extent[joint] > _STILL:
                    both = limits.of(kind)
                    number = joint + 1 if both is not None and both[joint] == 0 else joint + 3
                    step = np.abs((self.gait.ends - self.gait.alpha)[:, joint])
                    return kind, number, self.gait.alpha[int(np.argmax(step > 0))]
        return None

    def lower_bound(self, limits: Limits) -> tuple[float, int]:
        """Return a period below which there is certainly no law, and the joint (1 or 2) that says so, 0 for both.

        Where a joint turns round its rate is zero, so between two turns it takes at least as long as the fastest
        motion from rest to rest over that distance. Over any part of the path a law takes at least |Δαᵢ|/rate. And by
        the inequality of Bohr and Favard half the extent of a periodic motion is at most jerk·(π³/24)·(T/2π)³.
        """
        rate, acceleration, jerk = limits.completed(self.extent)
        bounds = []
        for joint in range(2):
            if self.extent[joint] <= _STILL:
                bounds.append(0.0)
                continue
            values = self._turning_values(joint)
            runs = np.abs(np.diff(np.append(values, values[0])))
            v, a = float(rate[joint]), float(acceleration[joint])
            cruise = runs / v + v / a if math.isfinite(v) else np.full_like(runs, np.inf)
            alone = float(np.where(runs * a > v * v, cruise, 2.0 * np.sqrt(runs / a)).sum())
            bounds.append(max(alone, float(np.cbrt(96.0 * self.extent[joint] / jerk[joint]))))
        step = np.abs(self.gait.ends - self.gait.alpha)[:, :2]
        moving = self.extent > _STILL
        together = float((step[:, moving] / rate[moving]).max(axis=1).sum())
        best = max(*bounds, together)
        return best, (bounds.index(best) + 1 if best in bounds else 0)

    def _turning_values(self, joint: int) -> FloatArray:
        """Return the values at which an angle turns round, in order, noise left out."""
        if self.curve is None:
            values = self.gait.alpha[:, joint]
        else:
            values = self.curve.at(self.curve.turning_points())[:, joint]
        out: list[float] = []
        for value in np.roll(values, -int(np.argmin(values))).tolist():
            if out and abs(value - out[-1]) <= _STILL:
                continue
            if len(out) > 1 and (value - out[-1]) * (out[-1] - out[-2]) > 0:
                out[-1] = value
            else:
                out.append(value)
        if len(out) > 2 and (out[0] - out[-1]) * (out[-1] - out[-2]) > 0:
            out.pop()
        return np.array(out)


def _grid(curve: Curve, nodes: int) -> FloatArray:
    """Return nodes from 0 to the span, all breaks among them, evenly within pieces.

    Half of them are shared out by width, half by how much a piece bends, where the limits of the joints change. Beside
    a short piece they lie nearer, since speeds change much there.
    """
    width = np.diff(curve.breaks)
    control = bernstein_from_power(derivative_of(curve.pieces, 2), width)
    bend = width * np.linalg.norm(control, axis=-1).max(axis=0)
    share = width / width.sum()
    if bend.sum() > 0:
        share = (share + bend / bend.sum()) / 2
    step = width / np.maximum(np.ceil(nodes * share * (1 - 1e-12)), _FEWEST)
    at_break = np.minimum(step, np.roll(step, 1))
    parts = [
        curve.breaks[k]
        + _graded(float(width[k]), float(step[k]), float(at_break[k]), float(at_break[(k + 1) % len(step)]))
        for k in range(len(width))
    ]
    return np.concatenate([*parts, [curve.span]])


def _graded(width: float, step: float, left: float, right: float) -> FloatArray:
    """Return nodes from 0 to below a width, at most a step apart, nearer at the ends, from one to the next by 30 %."""
    rows: list[list[float]] = []
    for nearest in (left, right):
        size, covered = nearest, 0.0
        row: list[float] = []
        while size < step / (1 + _GROWTH) and covered + size < width / 2:
            row.append(size)
            covered += size
            size *= 1 + _GROWTH
        rows.append(row)
    middle = width - sum(rows[0]) - sum(rows[1])
    count = max(math.ceil(middle / step * (1 - 1e-12)), 1)
    steps = np.array([*rows[0], *[middle / count] * count, *reversed(rows[1])])
    return np.concatenate([[0.0], np.cumsum(steps)[:-1]])


def _period(found: tuple[FloatArray, FloatArray, float]) -> float:
    return float(found[0].sum())


def _unrolled(law: Law, span: float) -> tuple[FloatArray, FloatArray]:
    """Return s and ṡ of a law over three turns, so that they cover the path from 0 to its span."""
    s = np.concatenate([law.s[:-1] + turn * span for turn in (-1, 0, 1)])
    return s, np.tile(law.speed[:-1], 3)
