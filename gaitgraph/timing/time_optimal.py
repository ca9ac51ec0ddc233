"""Time-optimal laws: the least period under limits, and a law for a given period.

A route is what is run: a smooth curve, or a polyline, also lifted to a curved sheet, with a rest at each corner. Along
what bends the limits hold at nodes
first. Where the law between two nodes exceeds one, the limits at these nodes are lowered by as much and the law is found
again. In the end time is stretched by the exact factor with which the largest rate, acceleration and jerk, bounded
between samples too, meet their limits. A jerk limit changes only how speeds at nodes are found.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import angle_within, number_of, whole_number
from gaitgraph.errors import InputError, checked_choice, wrong
from gaitgraph.gait.given import given_gait
from gaitgraph.gait.table import RATE_UNITS
from gaitgraph.pictured import Pictured
from gaitgraph.timing.curve import SMALLEST, Curve, Rounding, rounded
from gaitgraph.timing.laws import LAWS
from gaitgraph.timing.lifted_gait import (
    gait_with_law,
    is_lifted,
    path_of,
)
from gaitgraph.timing.limited_gait import LimitedGait
from gaitgraph.timing.limits import Limits, limits_of
from gaitgraph.timing.node_laws import (
    Grid,
    Speeds,
    fastest_speeds,
    grid_along,
    rest_to_rest,
    speeds_under_jerk,
)
from gaitgraph.timing.timed_gait import LONGEST, SHORTEST, checked_clock

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from gaitgraph.gait.gait import Gait
    from gaitgraph.gait.given import GaitLike
    from gaitgraph.invertibility.coefficients import CoefficientsLike
    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.timing.limits import Limit
    from gaitgraph.timing.timed_gait import TimedGait
    from gaitgraph.vehicle import VehicleLike

_UNDER_LIMITS = ("least-period", "paced")  # laws
_NODES = 2000  # twice as many gain less than 0.05 % of the period
_NODES_UNDER_JERK = 300  # a programme then takes a tenth of a second
_MOST_NODES_UNDER_JERK = 5000  # with more, programmes take minutes
# How often limits at nodes are lowered: without it periods of 30 random gaits were up to 0.09 % longer, after the first
# time 0.002 %, and a third time changed none. A stretch of time up to the second number is not worth another time.
_CORRECTIONS = 4
_ENOUGH = 1e-5
_STILL = 1e-12  # extent of an angle that does not move [rad]
_ALONG_SHEET = "under the jerk limit each leg runs along its curved sheet by the law 'smooth': others may be faster"
_ROUND_OFF = 1e-12  # share by which time is stretched more than the peaks ask for


class Origin(NamedTuple):
    """What a paced gait was made from, so that it can be paced again."""

    gait: Gait
    rounding: float | None = None  # of its corners [rad]; None: a rest at each
    limits: Mapping[str, Limit] = MappingProxyType({})


def origin_of(
    path: GaitLike,
    *,
    vehicle: VehicleLike | None = None,
    coefficients: CoefficientsLike | None = None,
) -> Origin:
    """Return the gait that a path in any form was made from: of a paced table the one that it states, else itself.

    The options are those of :func:`gaitgraph.gait.given.given_gait`.
    """
    given = given_gait(path, vehicle=vehicle, coefficients=coefficients, once=False)
    motion = given.motion
    if not isinstance(motion, LimitedGait):
        return Origin(given.gait)
    rounding = motion.rounding
    if rounding is None:
        return Origin(motion.gait, None, motion.made_for)
    return Origin(rounding.gait, rounding.tolerance, motion.made_for)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LeastPeriod(Pictured):
    """The least period, or a law for a given period; falsy when there is none.

    The status is "ok", "too short" (the given period is below the least found), "no period" (a limit of zero on a
    joint that must move, or a least period above 1e9 s or below 1e-6 s) or "still" (a point has no least period).
    """

    status: str
    reason: str  # one sentence; empty if the status is "ok"
    limits: Limits
    timed: LimitedGait | None = None
    least: float | None = None  # the least period found [s]
    at_rest: float | None = (
        None  # the same with a rest at each corner, for a rounded gait [s]
    )
    lower_bound: float = 0.0  # proven: no law along this path has a shorter period [s]
    stretch: float = 0.0  # that of the law, see LimitedGait
    rounding: Rounding | None = None  # None too where resting at the corners is quicker
    note: str = ""  # why the law rests despite a rounding, or why it was not optimised
    limit: str | None = None  # the limit that prevents a law
    where: dict[str, Any] | None = None

    def __bool__(self) -> bool:
        return self.status == "ok"

    @property
    def _shown(self) -> Any:
        return self.timed

    @property
    def period(self) -> float | None:
        """The period of the law, or None [s]."""
        return None if self.timed is None else self.timed.period

    def as_mapping(self) -> dict[str, Any]:
        """Return the answer as plain values, ready for JSON."""
        out: dict[str, Any] = {
            "status": self.status,
            "reason": self.reason or None,
            "note": self.note or None,
            "period": self.period,
            "least_period": self.least,
            "least_period_at_rest": self.at_rest,
            "lower_bound": self.lower_bound,
            "stretch": self.stretch,
            "limits": self.limits.as_mapping(),
            "limit": self.limit,
            "where": self.where,
            "rounding": None if self.rounding is None else self.rounding.as_mapping(),
        }
        if self.timed is not None:
            out |= {
                f"peak_{kind}": float(self.timed.peaks(k).max())
                for k, kind in enumerate(RATE_UNITS, start=1)
            }
            out["touched"] = [asdict(touch) for touch in self.timed.limits_touched()]
        return out

    def __repr__(self) -> str:
        summary = self.status
        if self.timed is not None:
            summary = str(self).splitlines()[0]
        return f"<{type(self).__name__}: {summary}>"

    def __str__(self) -> str:
        lines = [self.reason]
        if self.timed is not None:
            way = ""
            if self.rounding is not None:
                way = " with rounded corners"
                if self.at_rest:
                    way += f" ({self.at_rest:.4f} s with rests at them)"
            elif self.timed.curve is None:
                way = " with a rest at each corner"
            period = f"period {self.timed.period:.4f} s; least found {self.least:.4f} s"
            lines = [f"{period}{way}, none below {self.lower_bound:.4f} s"]
            lines += [f"  {touch}" for touch in self.timed.limits_touched()]
        lines += [f"  {more}" for more in (self.rounding, self.note) if more]
        return "\n".join(lines)


def least_period(
    path: GaitLike | Curve,
    limits: Limits | None = None,
    *,
    rounding: float | str | None = None,
    samples: int | None = None,
    rate: float | None = None,
    nodes: int | None = None,
    progress: Callable[[str], None] | None = None,
) -> LeastPeriod:
    """Return the fastest periodic law along a path under limits.

    Parameters
    ----------
    path, limits
        A gait of one color in any form, or the curve of an optimal one; and what to keep, by default the limits of its
        vehicle. A table that was paced before starts again from the gait that it states, with its rounding and, where
        the vehicle states none, its limits. One with rounded corners under a jerk limit states none, and starts from
        its rows.
    rounding
        For a gait: round its corners by this tolerance first, see :func:`gaitgraph.timing.curve.rounded`. Otherwise
        the law rests at every corner, except for a gait that only turns back on its line. Where resting is quicker, as
        it can be with tiny blends, the law rests, and a note says so.
    samples, rate
        Of tables, as for :meth:`gaitgraph.gait.gait.Gait.parametrize`. With a rate [Hz] the period of the law is the
        least one that is a whole number of frames.
    nodes, progress
        Nodes along a curve, 2000 by default, 300 under a jerk limit, at least eight on each of its pieces; and a
        function called with lines of text, since a jerk limit may take a minute.

    Notes
    -----
    The law is the fastest of those with constant s̈ between nodes; under a jerk limit, the best of a few linear
    programmes of at most 5000 nodes. No law is faster than `lower_bound`. Without a jerk limit the acceleration changes
    over 0.1 % of the period (of a segment's time, where the law rests). Looser limits need not take less time. Along a
    curved sheet a law that rests at the corners is found at nodes between them; under a jerk limit each leg then runs by
    the law `smooth`, as fast as the bounds of its peaks allow, and a note says so.

    Examples
    --------
    >>> from gaitgraph.gait.gait import lift
    >>> there_and_back = lift([(0.4, -0.4), (1.2, -0.4)], "red")
    >>> found = least_period(there_and_back, Limits(acceleration=20.0))
    >>> bool(found), round(found.lower_bound, 6), 0.8 <= found.period < 0.801
    (True, 0.8, True)
    """
    checked_clock(1.0, "smooth", samples=samples, rate=rate)
    answer = _least(_routes(path, limits, rounding), nodes, progress)
    if answer.timed is None:
        return answer
    timed = answer.timed
    count = checked_clock(timed.period, "smooth", samples=samples, rate=rate)
    if rate is not None:
        timed = timed.with_period(count / number_of(rate))
    return replace(answer, timed=replace(timed, samples=count))


def paced(
    path: GaitLike | Curve,
    limits: Limits | None = None,
    *,
    period: float = 1.0,
    rounding: float | str | None = None,
    samples: int | None = None,
    rate: float | None = None,
    nodes: int | None = None,
    progress: Callable[[str], None] | None = None,
) -> LeastPeriod:
    """Return a law for a given period, or the reason why there is none.

    It is the fastest law, stretched to the period T [s]: rates fall with 1/T, accelerations with 1/T², jerks with 1/T³.
    The answer is falsy with status "too short" if the period is below the least found; that there is no law is proven
    only below `lower_bound`. The other parameters are those of :func:`least_period`.

    Examples
    --------
    >>> from gaitgraph.gait.gait import lift
    >>> there_and_back = lift([(0.4, -0.4), (1.2, -0.4)], "red")
    >>> print(paced(there_and_back, Limits(acceleration=20.0), period=0.7))
    T = 0.7 s is too short: α1 alone needs at least 0.8000 s under the limits
    """
    count = checked_clock(period, "smooth", samples=samples, rate=rate)
    period = float(period)
    routes = _routes(path, limits, rounding)
    answer = _least(routes, nodes, progress)
    timed = answer.timed
    if answer.status == "still":
        timed = replace(routes[0].standing(period), samples=count)
        return replace(answer, status="ok", reason="", timed=timed)
    if timed is None:
        return answer
    if period < timed.period:
        return _too_short(answer, timed, period, _lower_bound(routes))
    return replace(answer, timed=replace(timed.with_period(period), samples=count))


def timed_by_law(
    gait: Gait,
    law: Any,
    period: float,
    *,
    samples: int,
    limits: Mapping[str, Any],
    rounding: float | None = None,
) -> TimedGait:
    """Return a gait with the law that a table states: one of LAWS, or with `limits` the law of ``pace`` for these.

    That is the fastest one, stretched to the period, whether or not it keeps the limits then. Raises InputError if
    there is none.
    """
    checked_choice("law", law, (*LAWS, *_UNDER_LIMITS))
    if law in LAWS or not limits:
        return gait.parametrize(period, law=law, samples=samples)
    routes = _routes(gait, Limits(**limits), rounding)
    answer = _least(routes, None, None)
    timed = answer.timed
    if answer.status == "still":
        timed = routes[0].standing(period)
    if timed is None:
        raise InputError(f"limits must allow a law, got none: {answer.reason}")
    return replace(timed.with_period(period), law=law, samples=samples)


# -- What is run


class _Bound(NamedTuple):
    """A proven lower bound of the period [s], and what needs so long."""

    period: float
    reason: str


class _Bend(NamedTuple):
    """A path that bends between corners: its breaks and polynomials, and the breaks at which laws rest."""

    breaks: FloatArray
    pieces: FloatArray
    rests: Sequence[int] = ()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Route:
    """What is run under limits: the `bend`, or without one the straight segments of `gait` with a rest at each corner.

    The answer states the `curve` or the `rounding` that the bend is of; without these the bend is on the segments.
    """

    gait: Gait
    limits: Limits
    bend: _Bend | None = None
    curve: Curve | None = None
    rounding: Rounding | None = None

    @property
    def joints(self) -> int:
        """How many joints limits are for: α1 and α2, or on a curved sheet all four."""
        return 2 if self.gait.vehicle.asymmetry is None else 4

    @property
    def places(self) -> FloatArray:
        """The angles of these joints at the corners, or where a curve may turn round, shape (n, 2) or (n, 4) [rad]."""
        alpha = self.gait.alpha
        if self.curve is not None:
            alpha = self.curve.at(self.curve.turning_points())
        return alpha[:, : self.joints]

    @property
    def extent(self) -> FloatArray:
        """The ranges of these joints, shape (2,) or (4,) [rad]."""
        extent: FloatArray = np.ptp(self.places, axis=0)
        return extent

    @property
    def moves(self) -> npt.NDArray[np.bool_]:
        """Whether these joints move, shape (2,) or (4,)."""
        return self.extent > _STILL

    @property
    def lowest_limits(self) -> FloatArray:
        """The limits of these joints, shape (3, 2) or (3, 4)."""
        return self.limits.of_joints(self.joints)

    def answer(self, status: str, reason: str = "", **more: Any) -> LeastPeriod:
        """Return an answer for this route."""
        return LeastPeriod(
            status=status,
            reason=reason,
            limits=self.limits,
            rounding=self.rounding,
            **more,
        )

    def out_of_range(self, period: float) -> LeastPeriod:
        """Return the answer for a least period that a timed gait cannot have."""
        beyond = "below 1e-6 s"
        if period > LONGEST:
            beyond = "above 1e9 s"
        return self.answer(
            "no period", f"the least period under the limits would be {beyond}"
        )

    def blocked(self) -> LeastPeriod | None:
        """Return the answer for a limit of zero on a joint that must move, if there is one."""
        for kind, limit in zip(RATE_UNITS, self.lowest_limits, strict=True):
            for joint in np.flatnonzero((limit == 0) & self.moves).tolist():
                number = joint + 1
                if getattr(self.limits, kind)[joint] != 0:
                    number = joint + 3
                changes = (self.gait.ends != self.gait.alpha)[:, joint]
                alpha = self.gait.alpha[int(np.argmax(changes))].tolist()
                place = ", ".join(f"{angle:.3f}" for angle in alpha)
                reason = f"no period keeps the {kind} limit 0 of α{number}, which must move after ({place})"
                return self.answer(
                    "no period", reason, limit=kind, where={"alpha": alpha}
                )
        return None

    def lower_bound(self) -> _Bound:
        """Return a proven lower bound of the period.

        Between two turns, where its rate is zero, a joint takes at least as long as the fastest motion from rest to
        rest. Over any part of the path a law takes at least |Δαᵢ|/rate. And by the inequality of Bohr and Favard half
        the extent of a periodic motion is at most jerk·(π³/24)·(T/2π)³.
        """
        rate, acceleration, jerk = self.limits.completed(self.extent)
        bounds = []
        for joint in np.flatnonzero(self.moves).tolist():
            v, a = float(rate[joint]), float(acceleration[joint])
            runs = _runs(self.places[:, joint])
            times = 2.0 * np.sqrt(runs / a)
            if math.isfinite(v):
                times = np.where(runs * a > v * v, runs / v + v / a, times)
            by_jerk = np.cbrt(96.0 * self.extent[joint] / jerk[joint])
            alone = max(float(times.sum()), float(by_jerk))
            bounds.append(_Bound(alone, f"α{joint + 1} alone needs"))
        step = np.abs(self.gait.ends - self.gait.alpha)[:, : self.joints]
        times = (step[:, self.moves] / rate[self.moves]).max(axis=1)
        bounds.append(_Bound(float(times.sum()), "any law along this path needs"))
        return max(bounds, key=lambda bound: bound.period)

    def standing(self, period: float) -> LimitedGait:
        """Return the law of a point, which stands still for a period [s]."""
        timed = self.with_law(np.array([period]), self.places[None, :1])
        return replace(timed, law="paced")

    def kept(self, law: LimitedGait, legs: Sequence[int] = (0,)) -> LimitedGait:
        """Return a law whose time is stretched or shortened until its peaks meet the limits, on each leg for itself.

        `legs` are the first intervals of all legs; by default there is one.
        """
        factors = np.zeros(len(legs))
        for order, limit in enumerate(self.lowest_limits, start=1):
            peaks = law.peaks_between_knots(order)[:, self.moves]
            shares = (peaks / limit[self.moves]).max(axis=1)
            largest = np.maximum.reduceat(shares, legs)
            factors = np.maximum(factors, largest ** (1.0 / order))
        intervals = np.diff([*legs, len(law.widths)])
        widths = law.widths * (np.repeat(factors, intervals) * (1.0 + _ROUND_OFF))
        stretch = float(factors.max()) - 1.0
        return replace(self.with_law(widths, law.tilts), stretch=stretch)

    def with_law(self, widths: FloatArray, tilts: FloatArray) -> LimitedGait:
        """Return the gait with a law given as `tilts` on intervals of time; its table has one interval."""
        return LimitedGait(
            gait=self.gait,
            period=float(widths.sum()),
            law="least-period",
            samples=1,
            curve=self.curve,
            widths=widths,
            tilts=tilts,
            limits=self.lowest_limits,
            rounding=self.rounding,
        )


def _runs(values: FloatArray) -> FloatArray:
    """Return how far a periodic sequence runs from turn to turn, without noise."""
    values = values[np.abs(values - np.roll(values, 1)) > _STILL]
    rises = np.roll(values, -1) > values
    turns = values[rises != np.roll(rises, 1)]
    return np.asarray(np.abs(turns - np.roll(turns, 1)))


def _routes(
    path: GaitLike | Curve, limits: Limits | None, rounding: float | str | None
) -> list[_Route]:
    """Return what may be run: with rounded corners the curve, and the polyline with rests in case that is quicker."""
    if limits is not None and not isinstance(limits, Limits):
        raise wrong(
            "limits", "must be a Limits object, as in Limits(acceleration=60)", limits
        )
    if isinstance(path, Curve):
        if rounding is not None:
            raise wrong(
                "rounding", "must be None for a curve, which has no corners", rounding
            )
        gait = path.polyline()
        bend = _Bend(path.breaks, path.pieces)
        known = limits or limits_of(gait.vehicle)
        return [_Route(gait=gait, limits=known, bend=bend, curve=path)]
    tolerance = None
    if rounding is not None:
        tolerance = angle_within(rounding, "rounding", least=SMALLEST)
    origin = origin_of(path)
    gait = origin.gait
    known = limits or limits_of(gait.vehicle, origin.limits)
    if tolerance is None:
        tolerance = origin.rounding
    if tolerance is None and gait.vehicle.asymmetry is not None:
        return [_resting(gait, known)]
    made = rounded(gait, SMALLEST if tolerance is None else tolerance)
    is_on_line = made.deviation == 0  # it turns back on its line, and need not rest
    bend = _Bend(made.curve.breaks, made.curve.pieces)
    if tolerance is None and is_on_line:
        corners = replace(made.gait, request=gait.request)
        return [_Route(gait=corners, limits=known, bend=bend)]
    if tolerance is None:
        return [_resting(gait, known)]
    smooth = _Route(
        gait=replace(made.curve.polyline(), request=gait.request),
        limits=known,
        bend=bend,
        curve=made.curve,
        rounding=made,
    )
    if is_on_line:
        return [smooth]
    return [smooth, _resting(gait, known)]


def _resting(gait: Gait, limits: Limits) -> _Route:
    """Return a gait with a rest at each corner."""
    if is_lifted(gait):
        path = path_of(gait)
        bend = _Bend(path.breaks, path.pieces, path.corners.tolist())
        return _Route(gait=gait, limits=limits, bend=bend)
    corners = replace(gait.merged(), request=gait.request)
    return _Route(gait=corners, limits=limits)


# -- The fastest law


def _lower_bound(routes: list[_Route]) -> _Bound:
    """Return the lower bound of the period along whichever route is quicker."""
    bounds = [route.lower_bound() for route in routes]
    return min(bounds, key=lambda bound: bound.period)


def _least(
    routes: list[_Route], nodes: int | None, progress: Callable[[str], None] | None
) -> LeastPeriod:
    """Return the answer with the fastest law along the quickest route; its table has one interval."""
    first = routes[0]
    if nodes is None:
        nodes = _NODES if first.limits.jerk is None else _NODES_UNDER_JERK
    nodes = whole_number("nodes", nodes, 10, 100_000)
    if not first.moves.any():
        reason = "the gait is a point and stands still, so it has no least period"
        return first.answer("still", reason, least=0.0)
    blocked = first.blocked()
    if blocked is not None:
        return blocked
    bound = _lower_bound(routes).period
    if bound > LONGEST:
        return first.out_of_range(bound)
    if progress is not None:
        progress("looking for the fastest law")
    laws = [_fastest(route, nodes, progress) for route in routes]
    periods = [timed.period for timed, _ in laws]
    least = min(periods)
    quickest = periods.index(least)
    timed, note = laws[quickest]
    if quickest > 0:
        times = f"{least:.4f} s, against {periods[0]:.4f} s with rounded corners"
        notes = (f"rests at the corners: {times}", laws[0][1])
        note = "; ".join(filter(None, notes))
    if not SHORTEST <= least <= LONGEST:
        return routes[quickest].out_of_range(least)
    return routes[quickest].answer(
        "ok",
        note=note,
        timed=timed,
        least=least,
        at_rest=periods[1] if len(periods) > 1 else None,
        lower_bound=min(bound, least),
        stretch=timed.stretch,
    )


def _fastest(
    route: _Route, nodes: int, progress: Callable[[str], None] | None
) -> tuple[LimitedGait, str]:
    """Return the gait with the fastest law found, and a note if it was not optimised."""
    under_jerk = route.limits.jerk is not None
    bend = route.bend
    if bend is None:
        limits = route.lowest_limits.copy()
        limits[1] = route.limits.completed(route.extent)[1]
        return route.kept(route.with_law(*rest_to_rest(route.places, limits))), ""
    if under_jerk and bend.rests:
        motion: Any = gait_with_law(route.gait, 1.0, "smooth", 1)
        law = route.kept(route.with_law(motion.widths, motion.tilts), bend.rests)
        return replace(law, stretch=0.0), _ALONG_SHEET
    grid = grid_along(bend.breaks, bend.pieces, nodes, bend.rests)
    # A joint that stands still keeps any limit.
    limits = np.where(route.moves, route.limits.completed(route.extent), 1.0)
    count = len(grid.width)
    even = np.ones(count), np.zeros(count)

    def fastest(_: FloatArray, lowered: FloatArray) -> Speeds:
        return fastest_speeds(grid, lowered)

    def settled(squared: FloatArray, lowered: FloatArray) -> Speeds | None:
        return speeds_under_jerk(grid, squared, lowered, progress)

    if not under_jerk:
        return _corrected(route, grid, limits, fastest, even[0]), ""
    # Programmes begin with the speeds without a jerk limit, slower, or with even ones: the least jerk along the path.
    starts = [fastest_speeds(grid, np.repeat(limits[:, None], count, axis=1)), even]
    laws = [route.kept(route.with_law(*grid.law(speeds))) for speeds in starts]
    slow = min(laws, key=lambda law: law.period)
    if count > _MOST_NODES_UNDER_JERK:
        return slow, _not_optimised(count, len(bend.breaks) - 1)
    squared, _ = starts[laws.index(slow)]
    squared = squared / (1 + slow.stretch) ** 2
    return _corrected(route, grid, limits, settled, squared, [slow]), ""


def _corrected(
    route: _Route,
    grid: Grid,
    limits: FloatArray,
    speeds_under: Callable[[FloatArray, FloatArray], Speeds | None],
    squared: FloatArray,
    known: Sequence[LimitedGait] = (),
) -> LimitedGait:
    """Return the fastest of known laws and of those under limits at nodes, lowered where the law before exceeds one.

    `speeds_under` takes ṡ² of the law before, at first `squared`, and the limits. It may find no speeds.
    """
    laws = list(known)
    lowered = np.repeat(limits[:, None], len(grid.width), axis=1)
    for _ in range(_CORRECTIONS + 1):
        speeds = speeds_under(squared, lowered)
        if speeds is None:
            break
        law = route.with_law(*grid.law(speeds))
        laws.append(route.kept(law))
        if laws[-1].stretch <= _ENOUGH:
            break
        squared, _ = speeds
        # An interval on which a limit is exceeded lowers it at both of its nodes.
        peaks = np.stack([law.peaks_between_knots(order) for order in (1, 2, 3)])
        excess = np.maximum(peaks / limits[:, None], 1.0)
        lowered = lowered / np.maximum(excess, np.roll(excess, 1, axis=1))
    return min(laws, key=lambda law: law.period)


def _not_optimised(nodes: int, pieces: int) -> str:
    """Return the note of a law that no programmes improved."""
    many = f"{nodes} nodes on {pieces} pieces are more than {_MOST_NODES_UNDER_JERK}"
    advice = "for a faster law thin out the table, ask for fewer nodes, or drop the jerk limit"
    return f"not optimised under the jerk limit: {many}; {advice}"


def _too_short(
    answer: LeastPeriod, timed: LimitedGait, period: float, bound: _Bound
) -> LeastPeriod:
    """Return the answer for a period that is below the least found, that of a law."""
    least = timed.period
    touch = max(timed.limits_touched(), key=lambda touch: touch.share)
    order = 1 + list(RATE_UNITS).index(touch.limit)
    reached = touch.value * (least / period) ** order
    why = (
        f"the least found is {least:.4f} s; at T the {touch.limit} of {touch.angles} "
        f"would reach {reached:.3g} {RATE_UNITS[touch.limit]}, limit {touch.value:.3g}"
    )
    if period < answer.lower_bound:
        why = f"{bound.reason} at least {bound.period:.4f} s under the limits"
    return replace(
        answer,
        status="too short",
        reason=f"T = {period:g} s is too short: {why}",
        timed=None,
        limit=touch.limit,
        where=touch.where,
    )
