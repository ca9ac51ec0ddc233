"""Time-optimal laws: limits, the least period under them, and a law for a given period.

The largest rate, acceleration and jerk of a law are bounded between samples too. Where one exceeds its limit, time is
stretched by the exact factor.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from operator import itemgetter
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gaitgraph.angles import (
    angle_from_text,
    figure,
    is_list,
    number_of,
    whole_number,
)
from gaitgraph.arrays import freeze_arrays, read_only
from gaitgraph.errors import Advice, InputError, shown
from gaitgraph.gait.given import given_gait
from gaitgraph.gait.table import RATE_UNITS
from gaitgraph.invertibility.forms import FloatArray
from gaitgraph.timing.curve import Curve, LimitedGait, Rounding, nodes_along, rounded
from gaitgraph.timing.laws import (
    LAWS,
    fastest_squared_speeds,
    laws_under_jerk,
    peaks_of,
    rest_to_rest,
    smoothed_law,
    tilts_over_time,
)
from gaitgraph.timing.timed_gait import checked_clock
from gaitgraph.vehicle import four_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from gaitgraph.gait.gait import Gait
    from gaitgraph.gait.given import GaitLike
    from gaitgraph.invertibility.coefficients import CoefficientsLike
    from gaitgraph.timing.timed_gait import TimedGait
    from gaitgraph.vehicle import Each, Vehicle, VehicleLike

Limit = float | str | Sequence[float | str] | FloatArray | None

_NODES, _NODES_UNDER_JERK = 1000, 300
_MOST_NODES_UNDER_JERK = 5000  # with more, programmes take minutes
_SHORTEST, _LONGEST = 1e-6, 1e9  # limits of the period of a timed gait [s]
# Windows of the averages, as shares of the period; the first one with a stretch of at most `_ENOUGH` is used.
_WINDOWS = (1e-3, 3e-4, 1e-4)
_ENOUGH = 5e-4
_WINDOWS_UNDER_JERK = (0.3, 0.2, 0.1, 0.05, 0.02, 0.01, 5e-3, 2e-3, 1e-3)
_BRIEF = 1e-3  # least share of the period spent at a limit
_CORRECTIONS = 4
_SETTLED = 1e-3
_STILL = _ROUND_OFF = 1e-12


@dataclass(frozen=True, slots=True, kw_only=True, init=False, eq=False)
class Limits:
    """Largest sizes of the derivatives of the tilt angles.

    Parameters
    ----------
    rate, acceleration, jerk
        One number for all four joints or one for each, radians per second (per second squared, cubed) or texts such
        as "200deg"; None for no limit, zero for a joint that must stand still. Acceleration or jerk must be limited:
        under a rate limit alone there is no fastest smooth law.

    Examples
    --------
    >>> Limits(rate="180deg", acceleration=40).rate.round(4).tolist()
    [3.1416, 3.1416, 3.1416, 3.1416]
    """

    rate: FloatArray | None
    acceleration: FloatArray | None
    jerk: FloatArray | None

    def __init__(
        self, *, rate: Limit = None, acceleration: Limit = None, jerk: Limit = None
    ) -> None:
        if acceleration is None and jerk is None:
            raise _without_acceleration(rate, None)
        for (kind, unit), value in zip(
            RATE_UNITS.items(), (rate, acceleration, jerk), strict=True
        ):
            numbers = None
            if value is not None:
                parts: Any = value if is_list(value) else [value] * 4
                try:
                    numbers = np.array([angle_from_text(part, kind) for part in parts])
                except InputError:
                    numbers = np.array([np.nan])
                if (
                    numbers.shape != (4,)
                    or not (
                        (numbers == 0) | ((numbers >= 1e-9) & (numbers <= 1e12))
                    ).all()
                ):
                    rule = f"0, or 1e-9 to 1e12 {unit}, or four such numbers, or texts such as '200deg'"
                    raise InputError(
                        f"{kind} must be {rule}, got {shown(value)}", field=kind
                    )
            object.__setattr__(self, kind, numbers)  # the record is frozen
        freeze_arrays(self)

    def __repr__(self) -> str:
        stated = {name: getattr(self, name) for name in RATE_UNITS}
        texts = [
            f"{name}={one.tolist()}" for name, one in stated.items() if one is not None
        ]
        return f"Limits({', '.join(texts)})"

    @property
    def in_plane(self) -> FloatArray:
        """Rate, acceleration and jerk limits of α1 and α2, shape (3, 2), infinite for none.

        Opposite joints move by as much, so the lower of their limits counts.
        """
        values = (
            np.full(4, np.inf) if value is None else value
            for value in (self.rate, self.acceleration, self.jerk)
        )
        return read_only(
            np.array([np.minimum(value[:2], value[2:]) for value in values])
        )

    def completed(self, extent: FloatArray) -> FloatArray:
        """Return the limits of α1 and α2, completed by those that follow from them, shape (3, 2).

        Landau's and Kolmogorov's inequalities relate the derivatives of a bounded motion, with x within ±extent/2:
        |ẋ|² ≤ extent·|ẍ|, |ẍ|² ≤ 2|ẋ|·|x⃛| and |ẍ|³ ≤ (3/2)·extent·|x⃛|². The extent is the range of α1 and α2 over
        the whole motion, shape (2,) [rad].
        """
        rate, acceleration, jerk = self.in_plane
        with np.errstate(invalid="ignore", over="ignore"):
            acceleration = np.minimum(acceleration, np.cbrt(1.5 * extent * jerk**2))
            acceleration = np.fmin(acceleration, np.sqrt(2.0 * rate * jerk))
            rate = np.minimum(rate, np.sqrt(extent * acceleration))
        return np.stack([rate, acceleration, jerk])

    def as_mapping(self) -> dict[str, Any]:
        """Return the limits as plain values: a number where all joints share it."""
        return {
            kind: float(value[0]) if np.ptp(value) == 0 else value.tolist()
            for kind in RATE_UNITS
            if (value := getattr(self, kind)) is not None
        }


def limits_of(
    vehicle: Vehicle,
    made_for: Mapping[str, Limit] | None = None,
    *,
    servo_lag: float | None = None,
    **given: Limit,
) -> Limits:
    """Return the limits of a vehicle; limits that are `given` by the names of :class:`Limits` replace them.

    Where the vehicle states none those count that a table was `made_for`. Without a limit of acceleration or jerk the
    error proposes the rate over the `servo_lag` [s], by default the vehicle's.
    """
    limits: dict[str, Limit] = dict(made_for or {})
    for kind in RATE_UNITS:
        stated = getattr(vehicle, f"max_tilt_{kind}")
        limit = stated if given.get(kind) is None else given[kind]
        if limit is not None:
            limits[kind] = limit
    if "acceleration" not in limits and "jerk" not in limits:
        lag = vehicle.servo_lag if servo_lag is None else servo_lag
        raise _without_acceleration(limits.get("rate"), lag)
    return Limits(**limits)


def _without_acceleration(rate: Limit, servo_lag: Each | None) -> InputError:
    """Return the error of limits without an acceleration; it proposes the rate over the slowest servo's time constant."""
    lags = np.array([number_of(one) for one in four_of(servo_lag)])
    rates = Limits(rate=rate, acceleration=1.0).rate
    stated = "state max_tilt_acceleration in the vehicle, or use"
    unknown = "if it is not known, take the rate over the servo's time constant"
    if rates is None or not (rates > 0).all() or not (lags > 0).all():
        advice = Advice(
            f"{stated} Limits(acceleration=…); {unknown} (rate over servo_lag)",
            f"{stated} --max-acceleration; {unknown} (--max-rate over --servo-lag)",
        )
    else:
        joint = int(np.argmin(rates / lags))
        quotient = f"{figure(rates[joint])} rad/s over {lags[joint]:g} s"
        proposed = f"{rates[joint] / lags[joint]:.3g}"
        advice = Advice(
            f"{stated} Limits(acceleration=…); {unknown}: {quotient}, acceleration={proposed}",
            f"{stated} --max-acceleration; {unknown}: {quotient}, --max-acceleration {proposed}",
        )
    return InputError(
        "limits must have an acceleration or a jerk, got neither",
        field="limits",
        advice=advice,
    )


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
    gait, made = given.gait, given.motion
    if not isinstance(made, LimitedGait):
        return Origin(gait)
    limits = made.made_for
    if made.rounding is None:
        return Origin(made.gait if made.curve is None else gait, None, limits)
    return Origin(made.rounding.gait, made.rounding.tolerance, limits)


@dataclass(frozen=True, slots=True, kw_only=True)
class LeastPeriod:
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
        return f"<{type(self).__name__}: {self.status if self.timed is None else str(self).splitlines()[0]}>"

    def __str__(self) -> str:
        lines = [self.reason]
        if self.timed is not None:
            found = f"period {self.timed.period:.4f} s; least found {self.least:.4f} s"
            if self.rounding is not None:
                found += " with rounded corners"
                found += (
                    f" ({self.at_rest:.4f} s with rests at them)"
                    if self.at_rest
                    else ""
                )
            elif self.timed.curve is None:
                found += " with a rest at each corner"
            touched = (f"  {touch}" for touch in self.timed.limits_touched())
            lines = [f"{found}, none below {self.lower_bound:.4f} s", *touched]
        if self.rounding is not None:
            lines.append(f"  {self.rounding}")
        return "\n".join(lines + ([f"  {self.note}"] if self.note else []))


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
        the vehicle states none, its limits.
    rounding
        For a gait: round its corners by this tolerance first, see :func:`gaitgraph.timing.curve.rounded`. Otherwise
        the law rests at every corner, except for a gait that only turns back on its line. Where resting is quicker, as
        it can be with tiny blends, the law rests, and a note says so.
    samples, rate
        Of tables, as for :meth:`gaitgraph.gait.gait.Gait.parametrize`.
    nodes, progress
        Nodes along a curve, 1000 by default, 300 under a jerk limit, at least eight on each of its pieces; and a
        function called with lines of text, since a jerk limit may take a minute.

    Notes
    -----
    The law is the fastest of those with constant s̈ between nodes; under a jerk limit, the best of a few linear
    programmes of at most 5000 nodes. No law is faster than `lower_bound`. Without a jerk limit the acceleration changes
    over 0.1 % of the period (of a segment's time, where the law rests). Looser limits need not take less time.

    Examples
    --------
    >>> from gaitgraph.gait.gait import lift
    >>> there_and_back = lift([(0.4, -0.4), (1.2, -0.4)], "red")
    >>> found = least_period(there_and_back, Limits(acceleration=20.0))
    >>> bool(found), round(found.lower_bound, 6), 0.8 <= found.period < 0.801
    (True, 0.8, True)
    """
    checked_clock(1.0, "smooth", samples=samples, rate=rate)
    answer = _Task(path, limits, rounding).least(nodes, progress)
    if answer.timed is not None:
        count = checked_clock(answer.timed.period, "smooth", samples=samples, rate=rate)
        answer = replace(answer, timed=replace(answer.timed, samples=count))
    return answer


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
    task = _Task(path, limits, rounding)
    if task.still:
        timed = task.timed(np.array([float(period)]), task.gait.alpha[None, :1, :2])
        return task.answer(
            "ok", timed=replace(timed, law="paced", samples=count), least=0.0
        )
    found = task.least(nodes, progress)
    if found.timed is None or found.least is None:
        return found
    if period >= found.least:
        timed = replace(found.timed.with_period(period), samples=count)
        return replace(found, timed=timed)
    touch = max(found.timed.limits_touched(), key=lambda touch: touch.share)
    reason = f"T = {period:g} s is too short: "
    if period < found.lower_bound:
        bound, joint = task.lower_bound()
        reason += f"α{joint} alone needs" if joint else "any law along this path needs"
        reason += f" at least {bound:.4f} s under the limits"
    else:
        reached = touch.value * (found.least / period) ** (
            1 + list(RATE_UNITS).index(touch.limit)
        )
        reason += (
            f"the least found is {found.least:.4f} s; at T the {touch.limit} of α{touch.joints[0]} and "
            f"α{touch.joints[1]} would reach {reached:.3g} {RATE_UNITS[touch.limit]}, limit {touch.value:.3g}"
        )
    return replace(
        found,
        status="too short",
        reason=reason,
        timed=None,
        limit=touch.limit,
        where=touch.where,
    )


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
    if law in LAWS or not limits:
        return gait.parametrize(period, law=law, samples=samples)
    kept = Limits(**limits)
    task = _Task(gait, kept, rounding)
    found = paced(gait, kept, period=period) if task.still else task.least(None, None)
    if found.timed is None:
        raise InputError(f"limits must allow a law, got none: {found.reason}")
    return replace(found.timed.with_period(period), law=law, samples=samples)


class _Task:
    """A path and the limits to keep: a smooth curve, or if `curve` is None a polyline with a rest at each corner."""

    def __init__(
        self,
        path: GaitLike | Curve,
        limits: Limits | None,
        rounding: float | str | None = None,
    ) -> None:
        if limits is not None and not isinstance(limits, Limits):
            raise InputError(
                f"limits must be a Limits object, as in Limits(acceleration=60), got {shown(limits)}",
                field="limits",
            )
        made_for: Mapping[str, Limit] = {}
        if isinstance(path, Curve):
            if rounding is not None:
                raise InputError(
                    f"rounding must be None for a curve, which has no corners, got {shown(rounding)}",
                    field="rounding",
                )
            gait, curve, made = path.polyline(), path, None
        else:
            origin = origin_of(path)
            gait = origin.gait
            made_for = origin.limits
            if rounding is None:
                rounding = origin.rounding
            made = rounded(gait, 1e-3 if rounding is None else rounding)
            curve = made.curve
        self.rounding = None if rounding is None else made
        # A gait that only turns back on its line is smooth as it is, whatever the tolerance.
        rests = made is not None and rounding is None and made.deviation > 0
        self.curve = None if rests else curve
        self.gait = replace(
            gait.merged() if rests else curve.polyline(), request=gait.request
        )
        self.plane = (self.gait.alpha if rests else curve.at(curve.turning_points()))[
            :, :2
        ]
        if limits is None:
            limits = limits_of(self.gait.vehicle, made_for)
        self.limits = limits
        self.limited = self.limits.in_plane
        self.extent = np.ptp(self.plane, axis=0)
        self.moves = self.extent > _STILL
        self.still = not self.moves.any()
        # The same gait with rests at its corners, if this one rounds them.
        rounds = self.rounding is not None and self.rounding.deviation > 0
        self.resting: _Task | None = _Task(gait, self.limits) if rounds else None

    def answer(self, status: str, reason: str = "", **found: Any) -> LeastPeriod:
        return LeastPeriod(
            status=status,
            reason=reason,
            limits=self.limits,
            rounding=self.rounding,
            **found,
        )

    def timed(
        self, widths: FloatArray, tilts: FloatArray, stretch: float = 0.0
    ) -> LimitedGait:
        """Return the gait with a law given as (α1, α2) on intervals of time; its table has one interval."""
        return LimitedGait(
            gait=self.gait,
            period=float(widths.sum()),
            law="least-period",
            samples=1,
            curve=self.curve,
            widths=widths,
            tilts=tilts,
            limits=self.limited,
            stretch=stretch,
            rounding=self.rounding,
        )

    def least(
        self, nodes: int | None, progress: Callable[[str], None] | None
    ) -> LeastPeriod:
        """Return the answer with the fastest law; its table has one interval."""
        if nodes is None:
            nodes = _NODES if self.limits.jerk is None else _NODES_UNDER_JERK
        nodes = whole_number("nodes", nodes, 10, 100_000)
        if self.still:
            reason = "the gait is a point and stands still, so it has no least period"
            return self.answer("still", reason, least=0.0)
        for kind, limit in zip(RATE_UNITS, self.limited, strict=True):
            for joint in np.flatnonzero((limit == 0) & self.moves).tolist():
                number = (
                    joint + 1 if getattr(self.limits, kind)[joint] == 0 else joint + 3
                )
                alpha = self.gait.alpha[
                    int(np.argmax((self.gait.ends != self.gait.alpha)[:, joint]))
                ].tolist()
                place = ", ".join(f"{angle:.3f}" for angle in alpha)
                reason = f"no period keeps the {kind} limit 0 of α{number}, which must move after ({place})"
                return self.answer(
                    "no period", reason, limit=kind, where={"alpha": alpha}
                )
        bound, _ = self.lower_bound()
        if bound > _LONGEST:
            return self._out_of_range(bound)
        if progress is not None:
            progress("looking for the fastest law")
        task, (timed, note), at_rest = self, self._fastest(nodes, progress), None
        if self.resting is not None:
            slow, _ = self.resting._fastest(nodes, None)
            at_rest = slow.period
            if at_rest < timed.period:
                times = f"{at_rest:.4f} s, against {timed.period:.4f} s with rounded corners"
                note = "; ".join(filter(None, (f"rests at the corners: {times}", note)))
                task, timed = self.resting, slow
        least = timed.period
        if not _SHORTEST <= least <= _LONGEST:
            return task._out_of_range(least)
        bound = min(bound, least)
        found: dict[str, Any] = {
            "timed": timed,
            "least": least,
            "at_rest": at_rest,
            "stretch": timed.stretch,
        }
        return task.answer("ok", note=note, lower_bound=bound, **found)

    def _out_of_range(self, period: float) -> LeastPeriod:
        """Return the answer for a least period that a timed gait cannot have."""
        beyond = "above 1e9 s" if period > _LONGEST else "below 1e-6 s"
        return self.answer(
            "no period", f"the least period under the limits would be {beyond}"
        )

    def lower_bound(self) -> tuple[float, int]:
        """Return a proven lower bound of the period, and the joint (1 or 2) that decides it, 0 for both.

        Between two turns, where its rate is zero, a joint takes at least as long as the fastest motion from rest to
        rest. Over any part of the path a law takes at least |Δαᵢ|/rate. And by the inequality of Bohr and Favard half
        the extent of a periodic motion is at most jerk·(π³/24)·(T/2π)³.
        """
        rate, acceleration, jerk = self.limits.completed(self.extent)
        bounds = [0.0, 0.0]
        for joint in np.flatnonzero(self.moves).tolist():
            # The values at which the angle turns round, in order, without noise.
            values = self.plane[:, joint]
            values = values[np.abs(values - np.roll(values, 1)) > _STILL]
            rises = np.roll(values, -1) > values
            values = values[rises != np.roll(rises, 1)]
            runs = np.abs(values - np.roll(values, 1))
            v, a = float(rate[joint]), float(acceleration[joint])
            cruise = (
                runs / v + v / a if math.isfinite(v) else np.full_like(runs, np.inf)
            )
            alone = float(
                np.where(runs * a > v * v, cruise, 2.0 * np.sqrt(runs / a)).sum()
            )
            bounds[joint] = max(
                alone, float(np.cbrt(96.0 * self.extent[joint] / jerk[joint]))
            )
        step = np.abs(self.gait.ends - self.gait.alpha)[:, :2]
        together = float((step[:, self.moves] / rate[self.moves]).max(axis=1).sum())
        answers = [
            max(((bounds[0], 1), (bounds[1], 2), (together, 0)), key=itemgetter(0))
        ]
        if self.resting is not None:
            answers.append(self.resting.lower_bound())
        return min(answers, key=itemgetter(0))

    def _fastest(
        self, nodes: int, progress: Callable[[str], None] | None
    ) -> tuple[LimitedGait, str]:
        """Return the gait with the fastest law found, and a note if it was not optimised."""
        completed = self.limits.completed(self.extent)
        if self.curve is None:
            return self._kept(
                *rest_to_rest(
                    self.plane, self.limited[0], completed[1], self.limited[2]
                )
            ), ""
        # A joint that stands still keeps any limit.
        rate, acceleration, jerk = np.where(self.moves, completed, 1.0)
        path = (self.curve.breaks, self.curve.pieces)
        s = nodes_along(*path, nodes)
        width, first, second = (
            np.diff(s),
            *(self.curve.at(s, order)[:, :2] for order in (1, 2)),
        )
        squared = fastest_squared_speeds(first, second, width, rate, acceleration)
        # Averages and nodes cannot resolve limits that are reached for less than a thousandth of the period.
        period = float(
            (2 * width / (np.sqrt(squared[1:]) + np.sqrt(squared[:-1]))).sum()
        )
        acceleration = np.minimum(acceleration, rate / (_BRIEF * period))
        jerk = np.minimum(jerk, acceleration / (_BRIEF * period))
        squared = fastest_squared_speeds(first, second, width, rate, acceleration)
        if self.limits.jerk is None:
            for window in _WINDOWS:
                found = self._kept(
                    *tilts_over_time(smoothed_law(s, squared, window), *path)
                )
                if found.stretch <= _ENOUGH:
                    break
            return found, ""
        laws = [smoothed_law(s, squared, window) for window in _WINDOWS_UNDER_JERK]
        candidates = [(self._kept(*tilts_over_time(law, *path)), law) for law in laws]
        found, law = min(candidates, key=lambda one: one[0].period)
        if len(width) > _MOST_NODES_UNDER_JERK:
            many = f"{len(width)} nodes on {len(self.curve.breaks) - 1} pieces are more than {_MOST_NODES_UNDER_JERK}"
            advice = "for a faster law thin out the table, ask for fewer nodes, or drop the jerk limit"
            return found, f"not optimised under the jerk limit: {many}; {advice}"
        # Programmes start from the speeds of the best law, over three turns so that they cover the path from s = 0.
        turns = np.concatenate(
            [law.s[:-1] + turn * float(s[-1]) for turn in (-1, 0, 1)]
        )
        known = (
            np.interp(s[:-1], turns, np.tile(law.speed[:-1] / (1.0 + found.stretch), 3))
            ** 2
        )
        # A programme keeps the limits at nodes only. Once it no longer gains, limits are lowered a few times beside the
        # nodes where its law exceeds them, which leaves less to stretch.
        limits = np.stack([rate, acceleration, jerk])
        at_nodes = np.repeat(limits[:, None], len(width), axis=1)
        corrections, before = 0, math.inf
        for law in laws_under_jerk(*path, s, known, at_nodes, progress):
            widths, tilts = tilts_over_time(law, *path)
            candidate = self._kept(widths, tilts)
            found = min(found, candidate, key=lambda one: one.period)
            taken = float(law.t[-1])
            gains, before = taken < before * (1 - _SETTLED), taken
            if gains and not corrections:
                continue
            if corrections == _CORRECTIONS or abs(candidate.stretch) < _ENOUGH:
                break
            corrections += 1
            interval = np.clip(
                np.searchsorted(law.t, np.cumsum(widths) - widths / 2) - 1,
                0,
                len(width) - 1,
            )
            for order in (2, 3):
                excess = np.ones((len(width), 2))
                np.maximum.at(
                    excess, interval, peaks_of(widths, tilts, order) / limits[order - 1]
                )
                at_nodes[order - 1] /= np.maximum(excess, np.roll(excess, 1, axis=0))
        return found, ""

    def _kept(self, widths: FloatArray, tilts: FloatArray) -> LimitedGait:
        """Return the gait with a law whose time is stretched or shortened until its peaks meet the limits."""
        factor = 0.0
        for order, limit in enumerate(self.limited, start=1):
            peak = peaks_of(widths, tilts, order).max(axis=0)
            of = np.isfinite(limit) & self.moves
            if of.any():
                factor = max(
                    factor, float((peak[of] / limit[of]).max()) ** (1.0 / order)
                )
        return self.timed(widths * (factor * (1.0 + _ROUND_OFF)), tilts, factor - 1.0)
