"""Motions that begin or end at rest, and motions one after another.

A gait that is in motion at its first row is begun by a *run-up*: its clock φ starts slowly, and its rate rises from 0
to 1 while the gait runs a whole number N of periods T. With u = tanh(kτ) the clock at the time τ since the start is

    φ = τ − u/k,   φ̇ = u²,   φ̈ = 2k·u·(1 − u²),

so rate and acceleration begin at zero, and at the end, where φ = N·T, the rate is 1 to within 1e-9. A run-down is the
same, backwards in time.

No rate, acceleration or jerk of a run-up exceeds the largest of the gait itself, for every gait. Let v, A and J be the
largest of an angle's |q̇|, |q̈| and |q⃛|. The rate is q̇·u². The acceleration q̈·u⁴ + q̇·φ̈ is at most A·u⁴ + 2vk·u·(1 − u²),
which for k ≤ A/v is at most A·(u⁴ − 2u³ + 2u) ≤ A, since the bracket grows with u and is 1 at u = 1. The jerk is at
most J·u⁶ + 6Ak·u³·(1 − u²) + 2vk²·(1 − u²)·|1 − 3u²|, which is at most J for 2Ak + 2vk² ≤ J. So k is chosen.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Self, Unpack

import numpy as np

from gaitgraph import later
from gaitgraph.arrays import read_only
from gaitgraph.errors import InputError
from gaitgraph.gait.gait import gait_through, there_and_back
from gaitgraph.gait.given import given_gait
from gaitgraph.gait.table import (
    RATES,
    accelerations_of,
    completed_table,
)
from gaitgraph.records import Record
from gaitgraph.timing.polynomials import quintics, times_from
from gaitgraph.timing.time_optimal import timed_by_law
from gaitgraph.timing.timed_gait import (
    JOINED,
    ROW_BY_ROW,
    Motion,
    RowTimedGait,
    TimedGait,
    TimedPath,
    timed_gait_of,
)
from gaitgraph.vehicle import four_of, lowest_limits

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import numpy.typing as npt

    from gaitgraph.gait.gait import Gait
    from gaitgraph.gait.given import GaitLike
    from gaitgraph.invertibility.coefficients import CoefficientsLike
    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.vehicle import Vehicle, VehicleLike

_RISE = 10.1  # k·N·T, at which the clock's rate is within 1e-9 of 1
_AT_REST = 1e-6  # share of a gait's largest rate below which it rests
_RUNS = ("run-up", "gait", "run-down")  # phases in which a gait runs
HOVER = "hover"
"""α = 0: ordinary hover, rotors upright. With axes of its own a vehicle hovers on its sheet above α1 = α2 = 0."""
_NO_GAIT = "course must have a gait, got {}"


def played(
    gait: GaitLike,
    *,
    vehicle: VehicleLike | None = None,
    coefficients: CoefficientsLike | None = None,
) -> TimedGait:
    """Return the motion of a gait in any form as it is played: that which its table states, or that of its rows.

    Rows with rates are joined by polynomials through these and their accelerations, others by straight lines. The
    options are those of :func:`gaitgraph.timing.timed_gait.timed_gait_of`.
    """
    given = given_gait(gait, vehicle=vehicle, coefficients=coefficients)
    motion = timed_gait_of(given)
    table = given.table
    if table is None or not table.joined_by_cubics:
        return motion
    if not isinstance(motion, RowTimedGait) or motion.law != ROW_BY_ROW:
        return motion
    rows = completed_table(table, vehicle=vehicle, coefficients=coefficients)
    rates = np.column_stack([rows[name] for name in RATES])
    known = np.stack(
        [
            np.vstack([motion.gait.alpha, motion.gait.alpha[:1]]),
            rates,
            accelerations_of(rows),
        ]
    )
    tilts = quintics(known[:, :-1], known[:, 1:], np.diff(motion.times))
    return replace(motion, tilts=tilts)


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class RunUp(Record):
    """The first periods of a gait whose clock starts slowly; or its last ones, whose clock stops slowly.

    `motion` is the gait, `periods` how many of it are run, and `stops` whether the clock stops instead of starting.
    """

    motion: TimedGait
    periods: int
    stops: bool = False

    def __repr__(self) -> str:
        return f"<RunUp: {self.phase} of {self.periods} periods in {self.period:g} s>"

    @property
    def gait(self) -> Gait:
        """The polyline of the gait."""
        return self.motion.gait

    @property
    def phase(self) -> str:
        """Its name in a course."""
        if self.stops:
            return "run-down"
        return "run-up"

    @property
    def made_for(self) -> dict[str, list[float]]:
        """The limits that the gait was made for."""
        return self.motion.made_for

    @property
    def line(self) -> FloatArray:
        """The corners that are passed, the first again at the end, shape (n + 1, 4) [rad]."""
        return read_only(np.vstack([self.gait.alpha, self.gait.alpha[:1]]))

    @property
    def statement(self) -> dict[str, Any]:
        """What it is made from, see :attr:`TimedGait.statement`."""
        stated = self.motion.statement
        if stated:
            stated |= {"periods": self.periods, "stops": self.stops}
        return stated

    def with_gait(self, gait: Gait) -> RunUp:
        """Return the run-up of the same timing of another gait."""
        return replace(self, motion=self.motion.with_gait(gait))

    def slowed(self, by: float) -> RunUp:
        """Return the run-up of the same gait in a multiple of its period."""
        return replace(self, motion=self.motion.slowed(by))

    def peaks(self, order: int) -> FloatArray:
        """Return upper bounds, those of the gait; the fourth derivative has none."""
        if order > 3:
            return np.full(4, np.inf)
        return self.motion.peaks(order)

    def check(self, **options: Unpack[later.CheckOptions]) -> later.Report:
        """Return every check of the whole gait."""
        return self.motion.check(**options)

    @property
    def _slowness(self) -> float:
        """1/k [s]."""
        return self.periods * self.motion.period / _RISE

    @property
    def period(self) -> float:
        """How long it takes [s]: a tenth more than its periods."""
        # φ = N·T where τ = N·T + u/k; one step finds the fixed point of u to double precision.
        u = math.tanh(_RISE + 1.0)
        return self.periods * self.motion.period + u * self._slowness

    @property
    def corner_times(self) -> FloatArray:
        """The times at which it passes the corners of its gait, from 0 to its period [s]."""
        motion = self.motion
        whole = self.periods * motion.period
        turns = np.arange(self.periods)[:, None] * motion.period
        clock = np.append(turns + motion.corner_times[:-1], whole)
        if self.stops:
            clock = whole - clock[::-1]
        # φ = τ − u/k grows with τ, and u is between 0 and 1.
        low, high = clock, clock + self._slowness
        for _ in range(60):
            tau = (low + high) / 2
            is_late = tau - np.tanh(tau / self._slowness) * self._slowness > clock
            low, high = np.where(is_late, low, tau), np.where(is_late, tau, high)
        times = np.array([0.0, *low[1:-1], self.period])
        if self.stops:
            times = self.period - times[::-1]
        return read_only(times)

    def at(self, t: npt.ArrayLike) -> Motion:
        """Return tilt angles, rates and accelerations at any times; before and after it those of its ends."""
        tau = np.clip(times_from(t), 0.0, self.period)
        if self.stops:
            tau = self.period - tau
        u = np.tanh(tau / self._slowness)
        # Where it meets the gait it is the gait; of rates that jump there those on its own side.
        joins = tau >= self.period
        clock = np.where(joins, -math.ulp(0.0), tau - u * self._slowness)
        rate = np.where(joins, 1.0, u**2)
        rise = np.where(joins, 0.0, 2.0 * u * (1.0 - u**2) / self._slowness)
        if self.stops:
            clock, rise = -clock, -rise
        gait = self.motion.at(clock)
        rate, rise = rate[..., None], rise[..., None]
        return Motion(
            alpha=gait.alpha,
            rates=gait.rates * rate,
            accelerations=gait.accelerations * rate**2 + gait.rates * rise,
        )


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Turns(RunUp):
    """Whole periods of a gait as it is, between a run-up and a run-down, or between two paths."""

    def __repr__(self) -> str:
        return f"<Turns: {self.periods} periods in {self.period:g} s>"

    @property
    def phase(self) -> str:
        """Its name in a course."""
        return "gait"

    @property
    def statement(self) -> dict[str, Any]:
        """What it is made from, see :attr:`TimedGait.statement`."""
        stated = super(Turns, self).statement  # slots make a new class
        if stated:
            stated["steady"] = True
        return stated

    @property
    def period(self) -> float:
        """How long it takes [s]."""
        return self.periods * self.motion.period

    def at(self, t: npt.ArrayLike) -> Motion:
        """Return tilt angles, rates and accelerations at any times; before and after it those of its ends."""
        tau = np.clip(times_from(t), 0.0, self.period)
        # Of rates that jump where it ends those on its own side.
        return self.motion.at(np.where(tau >= self.period, -math.ulp(0.0), tau))


def run_up(motion: TimedGait, *, stops: bool = False) -> RunUp | None:
    """Return the run-up to a gait, or with `stops` its run-down; None if the gait rests at its first row.

    It runs the fewest periods in which no rate, acceleration or jerk exceeds the largest of the gait itself. Of a law
    that turns corners at full speed only the rates are meant, and it runs one period.

    Examples
    --------
    >>> from gaitgraph.gait.gait import lift
    >>> gait = lift([(-0.4, 0.4), (-0.4, 1.2), (-1.2, 1.2), (-1.2, 0.4)], "red")
    >>> run_up(gait.parametrize(1.0)) is None
    True
    >>> moving = run_up(gait.parametrize(1.0, law="constant-speed"))
    >>> moving.periods, round(moving.period, 3), moving.at(0.0).rates.tolist()
    (1, 1.099, [0.0, 0.0, 0.0, 0.0])
    """
    peaks = [motion.peaks(order).tolist() for order in (1, 2, 3)]
    if np.abs(motion.at(0.0).rates).max() <= _AT_REST * max(peaks[0]):
        return None
    steepest = math.inf  # the largest k
    for v, a, j in zip(*peaks, strict=True):
        if v > 0 and math.isfinite(a):
            steepest = min(steepest, a / v)
            if math.isfinite(j):
                root = math.sqrt(a**2 + 2 * v * j)
                steepest = min(steepest, (root - a) / (2 * v))
    periods = max(math.ceil(_RISE / (steepest * motion.period)), 1)
    return RunUp(motion=motion, periods=periods, stops=stops)


@dataclass(frozen=True, slots=True, kw_only=True)
class Course(Record):
    """Motions one after another for a `duration` [s], infinite for a gait that is repeated.

    `sections` are timed gaits and run-ups, each with the time of the course and its own time at which it begins [s];
    `phases` are their names: "hover", "entry", "run-up", "gait", "run-down", "exit".
    """

    sections: tuple[tuple[float, float, TimedGait | RunUp], ...]
    duration: float
    phases: tuple[str, ...]

    def __repr__(self) -> str:
        return f"<Course: {', '.join(self.phases)} over {self.duration:g} s>"

    @property
    def timed(self) -> TimedGait:
        """The gait; raises InputError if the course has none, as that of a transition."""
        if "gait" not in self.phases:
            raise InputError(_NO_GAIT.format(", ".join(self.phases)))
        _, _, section = self.sections[self.phases.index("gait")]
        if isinstance(section, RunUp):
            return section.motion
        return section

    @property
    def begins(self) -> list[float]:
        """When each section begins, and the duration [s]."""
        return [begin for begin, _, _ in self.sections] + [self.duration]

    @property
    def gait_times(self) -> tuple[float, float]:
        """When the gait runs, from the beginning of its run-up to the end of its run-down [s]; see :attr:`timed`."""
        begins = self.begins
        runs = [k for k, phase in enumerate(self.phases) if phase in _RUNS]
        if not runs:
            raise InputError(_NO_GAIT.format(", ".join(self.phases)))
        return begins[runs[0]], begins[runs[-1] + 1]

    @property
    def vehicle(self) -> Vehicle:
        """The vehicle."""
        return self.sections[0][2].gait.vehicle

    @property
    def moving_period(self) -> float:
        """The period of the gait [s]; 0 if its arms stand still."""
        timed = self.timed
        if not np.ptp(timed.gait.alpha, axis=0).any():
            return 0.0
        return timed.period

    def at(self, t: FloatArray) -> Motion:
        """Return the motion at times of any shape [s]; see :meth:`TimedGait.at`."""
        which = np.searchsorted(self.begins[1:-1], t, side="right")
        motion = np.empty((3, *t.shape, 4))
        for k, (begin, own, timed) in enumerate(self.sections):
            mine = which == k
            if mine.any():
                motion[:, mine] = timed.at(t[mine] - begin + own)
        return Motion(*motion)


@dataclass(frozen=True, slots=True, kw_only=True, repr=False, eq=False)
class JoinedPath(TimedGait):
    """Paths and run-ups one after another, run once; a table of it states what they are made from.

    `sections` are TimedPath and RunUp, in order. `gait` leads along all of them and back.
    """

    sections: tuple[TimedPath | RunUp, ...]

    @classmethod
    def of(cls, sections: Sequence[TimedPath | RunUp], samples: int) -> JoinedPath:
        """Return the motion of some sections."""
        return cls(
            gait=_gait_along(sections),
            period=sum(section.period for section in sections),
            law=JOINED,
            samples=samples,
            sections=tuple(sections),
        )

    @property
    def repeats(self) -> bool:
        """False."""
        return False

    @property
    def course(self) -> Course:
        """The sections with their times."""
        names = [section.phase for section in self.sections]
        if "gait" in names:  # a mission
            gait = names.index("gait")
            for k, section in enumerate(self.sections):
                if len(section.line) == 1:
                    names[k] = HOVER
                elif names[k] == "path":
                    names[k] = "entry" if k < gait else "exit"
        ends = np.cumsum([section.period for section in self.sections]).tolist()
        begins = [0.0, *ends[:-1]]
        sections = [*zip(begins, [0.0] * len(begins), self.sections, strict=True)]
        return Course(sections=tuple(sections), duration=ends[-1], phases=tuple(names))

    @property
    def phases(self) -> tuple[tuple[str, float], ...]:
        """The parts of a mission by name, and when each begins [s]; none of a path to a gait or from one."""
        course = self.course
        if "gait" not in course.phases:
            return ()
        return tuple(zip(course.phases, course.begins, strict=False))

    @property
    def made_for(self) -> dict[str, list[float]]:
        """The lower of the limits that the gaits were made for; see :attr:`TimedGait.made_for`."""
        lowest = lowest_limits(section.made_for for section in self.sections)
        return {kind: list(four_of(limit)) for kind, limit in lowest.items()}

    @property
    def made_from(self) -> dict[str, Any]:
        """What the sections are made from, as a table states it; empty if that is more than corners, laws and limits."""
        sections = [section.statement for section in self.sections]
        if not all(sections):
            return {}
        return {"sections": sections}

    def with_gait(self, gait: Gait) -> Self:
        """Return the same motion for the vehicle and the coefficients of a gait."""
        of: dict[str, Any] = {
            "vehicle": gait.vehicle,
            "coefficients": gait.coefficients,
            "crossing_tolerance": gait.crossing_tolerance,
        }
        sections = [
            section.with_gait(replace(section.gait, **of)) for section in self.sections
        ]
        return replace(self, gait=gait, sections=tuple(sections))

    def with_period(self, period: float) -> Self:
        """Return the same motion in another duration [s]."""
        slower = period / self.period
        sections = [section.slowed(slower) for section in self.sections]
        return replace(self, period=float(period), sections=tuple(sections))

    @property
    def corner_times(self) -> FloatArray:
        """The times at which sections begin, and the duration [s]."""
        begins = self.course.begins
        begins[-1] = self.period
        return read_only(np.array(begins))

    def at(self, t: npt.ArrayLike) -> Motion:
        """Return tilt angles, rates and accelerations at any times; before and after the path those of its ends."""
        times = times_from(t)
        motion = self.course.at(np.clip(times, 0.0, self.period))
        return motion.moving((times >= 0.0) & (times <= self.period))

    def peaks(self, order: int) -> FloatArray:
        """Return upper bounds: those of the paths and the gaits; the fourth derivative of a run-up has none."""
        peaks = [section.peaks(order) for section in self.sections]
        return np.asarray(np.max(peaks, axis=0))

    def check(self, **options: Unpack[later.CheckOptions]) -> later.Report:
        """Return every check of the paths and of the whole gaits that are begun or left, the worse of each."""
        report = later.worst_of([section.check(**options) for section in self.sections])
        power = report.hover_power
        if power is not None:
            power = self.hover_power
        return replace(report, hover_power=power, hover_power_over="time")


def _gait_along(sections: Sequence[TimedPath | RunUp]) -> Gait:
    """Return the closed polyline that leads along some sections and back."""
    line = np.vstack([section.line for section in sections])
    return there_and_back(line, sections[0].gait)


def joined_again(
    parts: Sequence[Mapping[str, Any]], like: Gait, samples: int
) -> JoinedPath:
    """Return the motion that :attr:`JoinedPath.made_from` states; `like` has vehicle, coefficients and color.

    Raises LookupError, TypeError, ValueError or InputError if it states none.
    """
    sections: list[TimedPath | RunUp] = []
    for part in parts:
        corners = np.array(part["corners"], dtype=float)
        law, period = part["law"], part["period"]
        if "periods" not in part:
            gait = there_and_back(corners, like)
            sections.append(TimedPath.of(gait.parametrize(2 * period, law=law)))
            continue
        motion = timed_by_law(
            gait_through(corners, like),
            law,
            period,
            samples=1,
            limits=part.get("limits", {}),
            rounding=part.get("rounding"),
        )
        kind = Turns if part.get("steady") else RunUp
        run = kind(motion=motion, periods=part["periods"], stops=part["stops"])
        sections.append(run)
    return JoinedPath.of(sections, samples)
