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
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from gaitgraph.errors import InputError
from gaitgraph.gait.gait import Gait
from gaitgraph.gait.table import (
    ACCELERATIONS,
    ANGLES,
    RATES,
    Table,
    closed_rows,
    completed_table,
)
from gaitgraph.io.formats import given_gait, naming_file
from gaitgraph.timing.laws import LAWS
from gaitgraph.timing.time_optimal import law_stated, paced_again
from gaitgraph.timing.timed_gait import (
    SAME,
    Motion,
    RowTimedGait,
    TimedGait,
    TimedPath,
    pieces_of,
    timed_gait_of,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy.typing as npt

    from gaitgraph.invertibility.matrices import CoefficientsLike, FloatArray
    from gaitgraph.io.formats import GaitLike
    from gaitgraph.vehicle import Vehicle, VehicleLike

_RISE = 10.1  # k·N·T, at which the clock's rate is within 1e-9 of 1
_RUNS = ("run-up", "gait", "run-down")  # phases in which a gait runs
_NO_GAIT = "course must have a gait, got {}"
_AT_REST = 1e-6  # share of a gait's largest rate below which it rests

JOINED = "joined"
"""The law that tables of motions one after another state."""


def motion_of(
    gait: GaitLike,
    *,
    vehicle: VehicleLike | None = None,
    coefficients: CoefficientsLike | None = None,
) -> TimedGait:
    """Return the motion that a gait in any form states, between its rows too.

    That is its law, for a paced table the law found again; else cubics through the rows and their rates, if the table
    states rates and accelerations; else straight lines. The options are those of
    :func:`gaitgraph.timing.timed_gait.timed_gait_of`.
    """
    chosen: Any = {"vehicle": vehicle, "coefficients": coefficients}
    source = given_gait(gait, **chosen)
    if not isinstance(source, Table):
        return (
            source.parametrize()
            if isinstance(source, Gait)
            else cast("TimedGait", source)
        )
    with naming_file(gait):
        motion = timed_gait_of(source, **chosen)
        if not isinstance(motion, RowTimedGait):
            return motion
        law = paced_again(source, motion.gait)
    if law is not None:
        return replace(law, samples=motion.samples)
    names = (*RATES, *ACCELERATIONS)
    if any(name not in source for name in names):
        return motion
    if not any(source[name].any() for name in ACCELERATIONS):
        return motion
    rates = np.column_stack([source[name] for name in RATES])
    rates = np.vstack([rates, rates[:1]])[: len(motion.times)]
    return replace(motion, row_rates=rates)


@dataclass(frozen=True, slots=True, kw_only=True)
class RunUp:
    """The first periods of a gait whose clock starts slowly; or its last ones, whose clock stops slowly.

    `motion` is the gait, `periods` how many of it are run, and `stops` whether the clock stops instead of starting.
    """

    motion: TimedGait
    periods: int
    stops: bool = False

    def __repr__(self) -> str:
        kind = "stops" if self.stops else "starts"
        return f"<RunUp: {kind} in {self.duration:g} s, {self.periods} periods>"

    @property
    def gait(self) -> Gait:
        """The polyline of the gait."""
        return self.motion.gait

    @property
    def _slowness(self) -> float:
        """1/k [s]."""
        return self.periods * self.motion.period / _RISE

    @property
    def duration(self) -> float:
        """How long it takes [s]: a little more than its periods."""
        # φ = N·T where τ = N·T + u/k; the fixed point for u is found in one step to double precision.
        u = math.tanh(_RISE + 1.0)
        return self.periods * self.motion.period + u * self._slowness

    def at(self, t: npt.ArrayLike) -> Motion:
        """Return tilt angles, rates and accelerations at any times; before and after it those of its ends."""
        tau = np.clip(np.asarray(t, dtype=float), 0.0, self.duration)
        if self.stops:
            tau = self.duration - tau
        u = np.tanh(tau / self._slowness)
        clock = tau - u * self._slowness
        rate = u**2
        rise = 2.0 * u * (1.0 - u**2) / self._slowness
        # Where it meets the gait it is the gait.
        joins = tau >= self.duration
        clock, rate, rise = (
            np.where(joins, at_join, value)
            for at_join, value in ((0.0, clock), (1.0, rate), (0.0, rise))
        )
        if self.stops:
            clock, rise = -clock, -rise
        gait = self.motion.at(clock)
        rate, rise = rate[..., None], rise[..., None]
        return Motion(
            alpha=gait.alpha,
            rates=gait.rates * rate,
            accelerations=gait.accelerations * rate**2 + gait.rates * rise,
        )


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
    >>> moving.periods, round(moving.duration, 3), moving.at(0.0).rates.tolist()
    (1, 1.099, [0.0, 0.0, 0.0, 0.0])
    """
    speed, acceleration, jerk = (motion.peaks(order) for order in (1, 2, 3))
    if np.abs(motion.at(0.0).rates).max() <= _AT_REST * speed.max():
        return None
    steepest = math.inf
    for v, a, j in zip(
        speed.tolist(), acceleration.tolist(), jerk.tolist(), strict=True
    ):
        if v > 0 and math.isfinite(a):
            steepest = min(steepest, a / v)
            if math.isfinite(j):
                steepest = min(steepest, (math.sqrt(a**2 + 2 * v * j) - a) / (2 * v))
    periods = max(math.ceil(_RISE / (steepest * motion.period)), 1)
    return RunUp(motion=motion, periods=periods, stops=stops)


@dataclass(frozen=True, slots=True, kw_only=True)
class Course:
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
        return cast("TimedGait", self.sections[self.phases.index("gait")][2])

    @property
    def gait_times(self) -> tuple[float, float]:
        """When the gait runs, from the beginning of its run-up to the end of its run-down [s]; see :attr:`timed`."""
        begins = [begin for begin, _, _ in self.sections] + [self.duration]
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
        return self.timed.period if np.ptp(self.timed.gait.alpha, axis=0).any() else 0.0

    def at(self, t: FloatArray) -> Motion:
        """Return the motion at times of shape (n,) [s]; see :meth:`TimedGait.at`."""
        begins = np.array([begin for begin, _, _ in self.sections])
        which = np.maximum(np.searchsorted(begins, t, side="right") - 1, 0)
        motion = np.empty((3, len(t), 4))
        for k, (begin, own, timed) in enumerate(self.sections):
            mine = which == k
            if mine.any():
                motion[:, mine] = timed.at(t[mine] - begin + own)
        return Motion(*motion)

    @property
    def stated(self) -> list[dict[str, Any]] | None:
        """What :func:`course_again` makes the course from, as plain values; None if that is more than its rows."""
        parts: list[dict[str, Any]] = []
        for (begin, _, section), phase in zip(self.sections, self.phases, strict=True):
            part: dict[str, Any] = {"phase": phase, "begin": begin}
            if isinstance(section, RunUp):
                gait = _stated_motion(section.motion)
                if gait is None:
                    return None
                part |= {"periods": section.periods, "gait": gait}
            else:
                half = len(section.gait.alpha) // 2 + 1
                part |= {
                    "corners": section.gait.alpha[:half].tolist(),
                    "period": section.period,
                    "law": section.law,
                }
            parts.append(part)
        return parts

    def table(self, samples: int, about: Mapping[str, Any]) -> Table:
        """Return the table of a course that ends, run once, in even intervals; `about` is what made it."""
        t: FloatArray = np.arange(samples + 1, dtype=float) * (self.duration / samples)
        t[-1] = self.duration
        alpha, rates, accelerations = self.at(t)
        columns: dict[str, Any] = {"t": t}
        columns |= zip(ANGLES, alpha.T + 0.0, strict=True)  # no negative zeros
        gait = self.sections[0][2].gait
        if gait.colors:
            columns["color"] = gait.colors[:1] * len(t)
        columns |= zip(
            (*RATES, *ACCELERATIONS),
            (*(rates.T + 0.0), *(accelerations.T + 0.0)),
            strict=True,
        )
        stated = {
            "vehicle": gait.vehicle.as_mapping(),
            "coefficients": gait.coefficients.kind,
            "crossing_tolerance": gait.crossing_tolerance,
            "period": self.duration,
            "law": JOINED,
            "repeats": False,
            **about,
        }
        if (parts := self.stated) is not None:
            stated["course"] = parts
        return completed_table(Table(columns=columns, about=stated))


def course_again(
    table: Table,
    *,
    vehicle: VehicleLike | None = None,
    coefficients: CoefficientsLike | None = None,
) -> Course | None:
    """Return the course of a run-down, a path and a run-up that a table states; None without one, or if its rows differ."""
    parts = table.about.get("course")
    if table.repeats or not isinstance(parts, list) or not parts:
        return None
    like, _, _ = closed_rows(table, vehicle=vehicle, coefficients=coefficients)
    try:
        sections = [_section_from(part, like) for part in parts]
        begins = [float(part["begin"]) for part in parts]
        phases = tuple(str(part["phase"]) for part in parts)
    except (LookupError, TypeError, ValueError):  # not as a course states itself
        return None
    last = sections[-1]
    seconds = last.duration if isinstance(last, RunUp) else last.period
    course = Course(
        sections=tuple(
            (begin, 0.0, one) for begin, one in zip(begins, sections, strict=True)
        ),
        duration=begins[-1] + seconds,
        phases=phases,
    )
    off = np.abs(course.at(table["t"] - table["t"][0]).alpha - table.alpha).max()
    return course if off <= SAME + table.digit_error else None


def _stated_motion(motion: TimedGait) -> dict[str, Any] | None:
    """Return what a gait's law is made from, as a table states it; None if that is more than its corners."""
    about = next(pieces_of(replace(motion, samples=1))).about
    names = ("made_by", "corners", "rounding", "limits", "period", "law")
    return (
        {name: about[name] for name in names if name in about}
        if "corners" in about
        else None
    )


def _section_from(part: dict[str, Any], like: Gait) -> TimedGait | RunUp:
    """Return a section of a course as :attr:`Course.stated` states it; ValueError and others if it does not."""

    def gait(corners: Any) -> Gait:
        return replace(like, alpha=corners, colors=like.colors[:1] * len(corners))

    if "gait" not in part:
        path = np.array(part["corners"], dtype=float)
        loop = gait(np.vstack([path, path[-2:0:-1]]))
        return TimedPath.of(loop.parametrize(2 * part["period"], law=part["law"]))
    stated = part["gait"]
    closed = gait(np.array(stated["corners"], dtype=float))
    motion: TimedGait | None
    if stated["law"] in LAWS:
        motion = closed.parametrize(stated["period"], law=stated["law"])
    else:
        motion = law_stated(Table(columns={}, about=stated), closed)
    if motion is None:
        raise ValueError("gait must be one that pace finds again")
    return RunUp(
        motion=motion, periods=part["periods"], stops=part["phase"] == "run-down"
    )
