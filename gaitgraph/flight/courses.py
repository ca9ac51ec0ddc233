"""What the tilt servos are told over a flight: a gait again and again, or hover, a way to the gait, and back."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import number_of
from gaitgraph.errors import InputError, shown
from gaitgraph.flight.clocks import RowTimedGait
from gaitgraph.planning.transitions import transition
from gaitgraph.timing.timed_gait import TimedGait, parametrize

if TYPE_CHECKING:
    from gaitgraph.flight.settings import FlightSettings
    from gaitgraph.gait.gait import Gait
    from gaitgraph.validation.report import Check, Report
    from gaitgraph.vehicle import Vehicle

__all__ = ["Course", "before_take_off", "from_hover", "refusal_and_warnings", "repeated"]

FloatArray = npt.NDArray[np.float64]

_MOST_PERIODS = 10_000
_LONGEST_PAUSE = 1e4
_SAME_PLACE = 1e-9  # rad

_SURFACE_RULES = frozenset({"closed", "on_surface", "two_color", "continuous"})
"""Rules that are the paper's way to a matrix which no small tilt makes singular; physics asks for none of them."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Course:
    """Commands to the four tilt servos over a flight.

    Parameters
    ----------
    pieces
        Timed gaits, each with when it begins [s] and at which time of its own [s], in order of time.
    duration
        How long the course is [s]; infinite for a gait again and again.
    phases
        What each piece is, for people: "hover", "entry", "gait", "exit".
    """

    pieces: tuple[tuple[float, float, TimedGait], ...]
    duration: float
    phases: tuple[str, ...]

    @property
    def timed(self) -> TimedGait:
        """The gait."""
        return self.pieces[self.phases.index("gait")][2]

    @property
    def vehicle(self) -> Vehicle:
        """What flies it."""
        return self.timed.gait.vehicle

    @property
    def turn(self) -> float:
        """The period of the gait [s]; 0 if its arms stand still, so that every moment of it is like the others."""
        return self.timed.period if np.ptp(self.timed.gait.alpha, axis=0).any() else 0.0

    def seconds(self, settings: FlightSettings) -> float:
        """Return how long it is flown with given settings [s]."""
        if settings.duration is not None:
            return min(settings.duration, self.duration)
        return self.duration if math.isfinite(self.duration) else max(settings.seconds, self.turn)

    def at(self, t: FloatArray) -> FloatArray:
        """Return the tilt angles at times of shape (n,), shape (n, 4) [rad]."""
        begins = np.array([begin for begin, _, _ in self.pieces])
        which = np.maximum(np.searchsorted(begins, t, side="right") - 1, 0)
        alpha = np.empty((len(t), 4))
        for k, (begin, own, timed) in enumerate(self.pieces):
            mine = which == k
            if mine.any():
                alpha[mine] = timed.at(t[mine] - begin + own)[0]
        return alpha

    def phase_at(self, t: float) -> str:
        """Return what the course does at a time."""
        begun = [phase for (begin, _, _), phase in zip(self.pieces, self.phases, strict=True) if begin <= t]
        return begun[-1] if begun else self.phases[0]


def repeated(timed: TimedGait, *, begin: float = 0.0) -> Course:
    """Return the course of a gait that is flown again and again, from a moment of it [s]; the first by default."""
    return Course(pieces=((0.0, begin, timed),), duration=np.inf, phases=("gait",))


def refusal_and_warnings(report: Report) -> tuple[str, tuple[str, ...]]:
    """Return why physics forbids to fly a gait, "" if it does not, and what the paper's rules have against it.

    Physics asks for a matrix that is invertible in level flight, for hover thrusts and tilt angles and rates within
    the vehicle's limits; not for a place on the surfaces.

    >>> from gaitgraph.gait.gait import lift
    >>> gait = lift([(1.178, -1.178), (1.178, -0.393), (0.393, -0.393), (0.393, -1.178)], "red")
    >>> refusal, warnings = refusal_and_warnings(gait.biased(0.8).parametrize(1.0).check())
    >>> refusal, len(warnings) > 0
    ('', True)
    """
    broken = _broken(report)
    forbidden = [check.message for check in broken if check.name not in _SURFACE_RULES]
    return forbidden[0] if forbidden else "", tuple(check.message for check in broken if check.name in _SURFACE_RULES)


def _broken(report: Report) -> list[Check]:
    return [check for check in report.checks if not (check.ok and check.decided)]


def before_take_off(course: Course, settings: FlightSettings, *, anyway: bool = False) -> tuple[str, tuple[str, ...]]:
    """Return why a course's gait must not be flown with given settings, "" if it may, and what a pilot should know.

    Thrusts and tilt rates are judged by the limits that the flight has, which may be others than the vehicle's.

    Parameters
    ----------
    course, settings
        What is to be flown, and how.
    anyway
        Whether it is flown in any case: then each reason against it is a warning.
    """
    timed, vehicle = course.timed, course.vehicle
    limits = {
        "max_thrust": (settings.thrust_limit or vehicle.max_thrust) if settings.saturation else None,
        "max_tilt_rate": settings.servo_rate or vehicle.max_tilt_rate,
    }
    judged = replace(timed, gait=replace(timed.gait, vehicle=vehicle.replace(**limits)))
    # Rotors without limits push down where they are asked to.
    harmless = _SURFACE_RULES if settings.saturation else _SURFACE_RULES | {"hover_thrust"}
    broken = _broken(judged.check())
    forbidden = [check.message for check in broken if check.name not in harmless]
    warnings = [check.message for check in broken if check.name in harmless]
    if isinstance(timed, RowTimedGait) and timed.gap:
        warnings.append(timed.gap)
    warnings += _parts(course, settings)
    if anyway:
        return "", (*(f"flown although it is not flyable: {message}" for message in forbidden), *warnings)
    return forbidden[0] if forbidden else "", tuple(warnings)


def _parts(course: Course, settings: FlightSettings) -> list[str]:
    """Return what is flown in part only."""
    seconds, parts = course.seconds(settings), []
    if math.isfinite(course.duration):
        wholes = {"course": (course.duration, "what comes after it is not flown")}
    else:
        wholes = {"period": (course.turn, "what holds at one moment of it need not hold at another")}
    if settings.reference in ("line", "circle"):
        wholes["lap"] = settings.lap, "the reference is not followed to its end"
    for name, (whole, said) in wholes.items():
        if seconds < whole * (1 - 1e-9):
            parts.append(f"{seconds:g} s are {seconds / whole:.3g} of a {name} of {whole:g} s: {said}")
    return parts


def from_hover(
    timed: TimedGait, *, periods: int = 2, pause: float = 1.0, duration: float | None = None, anyway: bool = False
) -> Course | str:
    """Return the course from hover into a gait, around it, and back; or the reason why there is none.

    The way is on the surface where there is one; otherwise, as to a biased gait, straight if physics allows that.

    Parameters
    ----------
    timed
        The gait.
    periods
        How often the gait is flown.
    pause
        In hover, before and after [s].
    duration
        Of the way in, and of the way out [s]; by default 1 s, or what the vehicle's limits of tilt rate and
        acceleration need if that is more.
    anyway
        Whether to take the straight way to the gait's first corner although physics forbids it.

    Returns
    -------
    Course or str
        The angles are continuous at all times. Where a gait does not rest at the corner at which it is joined, their
        rates jump there.

    Raises
    ------
    InputError
        If a value is not allowed.

    Examples
    --------
    >>> from gaitgraph.gait.gait import lift
    >>> gait = lift([(-0.4, 0.4), (-0.4, 1.2), (-1.2, 1.2), (-1.2, 0.4)], "red")
    >>> from_hover(gait.parametrize(1.0)).duration
    6.0
    >>> from_hover(lift([(1.2, -1.2), (1.2, -0.4), (0.4, -0.4)], "red").parametrize(1.0))[:40]
    'no flyable way from hover: R = +4 at the'
    """
    if not isinstance(timed, TimedGait):
        raise InputError(f"gait: {shown(timed)}; allowed is a timed gait, as gait.parametrize(period) returns")
    if not isinstance(anyway, bool):
        raise InputError(f"anyway: {shown(anyway)}; allowed are True and False")
    if isinstance(periods, bool) or not isinstance(periods, int) or not 1 <= periods <= _MOST_PERIODS:
        raise InputError(f"periods: {shown(periods)}; allowed is a whole number from 1 to {_MOST_PERIODS}")
    if not 0 <= number_of(pause) <= _LONGEST_PAUSE:
        raise InputError(f"pause: {shown(pause)}; allowed is a number of seconds from 0 to {_LONGEST_PAUSE:g}")
    gait, times = timed.gait, timed.corner_times
    passed = timed.at(times[:-1])[0]
    if passed.shape != gait.alpha.shape or np.abs(passed - gait.alpha).max() > _SAME_PLACE:
        # A law of its own is left and joined where it has its knots, which need not be corners of a polyline.
        gait = replace(gait, alpha=passed, colors=gait.colors[:1] * len(passed), request={})
    way = transition("hover", gait, duration=duration)
    flyable = bool(way) and way.report is not None and way.report.flyable
    straight, seconds = _straight_way(gait, way.duration, stated=duration is not None)
    refusal = "" if flyable or anyway else refusal_and_warnings(straight.check())[0]
    if refusal:
        # Off the surfaces no way on them is looked for, so its reason would be beside the point.
        reason = way.reason if gait.check().valid else f"off the surfaces it is straight, and {refusal}"
        return f"no flyable way from hover: {reason}"
    if flyable:
        ways, seconds, corner = way.timed, way.duration, way.corners[1] or 0
    else:
        ways, corner = straight, 0
    still = replace(gait, alpha=np.zeros((1, 4)), colors=gait.colors[:1], request={})
    hover = parametrize(still, 1.0)
    joined = float(times[corner])
    entry, around = pause + seconds, pause + seconds + periods * timed.period
    return Course(
        pieces=(
            (0.0, 0.0, hover),
            (pause, 0.0, ways),
            (entry, joined, timed),
            (around, seconds, ways),
            (around + seconds, 0.0, hover),
        ),
        duration=around + seconds + pause,
        phases=("hover", "entry", "gait", "exit", "hover"),
    )


def _straight_way(gait: Gait, duration: float, *, stated: bool) -> tuple[TimedGait, float]:
    """Return the straight way to a gait's first corner and back, and how long it takes one way [s].

    A duration that is not stated is stretched to what the vehicle's largest tilt rate needs.
    """
    ends = np.stack([np.zeros(4), gait.alpha[0]])
    straight = replace(gait, alpha=ends, colors=gait.colors[:1] * 2, request={})
    limit = gait.vehicle.max_tilt_rate
    if limit is not None and not stated:
        duration = max(duration, float(parametrize(straight, 2.0).peak_rates().max()) / limit)
    return parametrize(straight, 2 * duration), duration
