"""Timed gaits: gaits with a timing law over a period, their samples, checks and tables; files with another timing."""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass, replace
from typing import IO, TYPE_CHECKING, Any, NamedTuple, Self, Unpack

import numpy as np
import numpy.typing as npt

from gaitgraph import later
from gaitgraph.angles import number_of, whole_number
from gaitgraph.arrays import freeze_arrays, read_only, read_only_mapping
from gaitgraph.errors import (
    Advice,
    InputError,
    check_kind,
    checked_choice,
    shown,
    wrong,
)
from gaitgraph.files import is_stream, naming_file, path_of
from gaitgraph.gait.gait import Gait, setting_line
from gaitgraph.gait.given import given_gait
from gaitgraph.gait.table import (
    ACCELERATIONS,
    ANGLES,
    RATE_CHECKS,
    RATE_UNITS,
    RATES,
    Table,
    hover_thrust_columns,
)
from gaitgraph.invertibility.forms import FloatArray
from gaitgraph.invertibility.matrices import level_determinant, mean_hover_powers
from gaitgraph.pictured import Pictured
from gaitgraph.surface.sheets import color_codes, text_from_types, types_at
from gaitgraph.timing.laws import (
    DEFAULT_LAW,
    LAWS,
    STRAIGHT,
    LawName,
)
from gaitgraph.timing.polynomials import (
    located,
    peaks_of,
    times_from,
    value_at,
)
from gaitgraph.tolerances import ROUND_OFF
from gaitgraph.vehicle import four_of, scale_of, tighter_of

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from gaitgraph.gait.given import GaitLike, GivenGait
    from gaitgraph.invertibility.coefficients import CoefficientsLike
    from gaitgraph.vehicle import VehicleLike

DEFAULT_SAMPLES = 100
"""Intervals per period by default."""

MOST_SAMPLES = 10_000_000

SHORTEST = 1e-6
LONGEST = 1e9
"""Bounds of the period of a timed gait [s]."""

MOST_CORNERS = 1000
"""Largest number of corners that a table states beside its rows."""

ROW_BY_ROW = "row-by-row"  # the law of a RowTimedGait
JOINED = "joined"  # that of motions one after another, see gaitgraph.timing.joining


class Motion(NamedTuple):
    """Tilt angles [rad], rates [rad/s] and accelerations [rad/s²] at some times, each of shape (..., 4)."""

    alpha: FloatArray
    rates: FloatArray
    accelerations: FloatArray

    def moving(self, moves: npt.NDArray[np.bool_]) -> Motion:
        """Return the motion at rest where it does not move; `moves` has the shape of the times."""
        at_all = moves[..., None]
        return self._replace(
            rates=self.rates * at_all, accelerations=self.accelerations * at_all
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TimedGait(Pictured):
    """A gait with a timing law: exact at every time, and sampled evenly over one period.

    Parameters
    ----------
    gait
        The closed polyline.
    period
        T [s].
    law
        One of :data:`gaitgraph.timing.laws.LAWS`.
    samples
        Number N of even intervals; tables have N + 1 rows, from t = 0 to T, the last equal to the first.

    Examples
    --------
    >>> from gaitgraph.gait.gait import lift
    >>> timed = lift([(0.4, -1.2), (0.4, -0.4), (1.2, -0.4)], "red").parametrize(2.0, samples=4)
    >>> timed.t.tolist(), timed.alpha.shape, bool((timed.alpha[0] == timed.alpha[-1]).all())
    ([0.0, 0.5, 1.0, 1.5, 2.0], (5, 4), True)
    """

    gait: Gait
    period: float
    law: str
    samples: int

    def __post_init__(self) -> None:
        """Check the gait, the period, the law and the count of samples."""
        if not isinstance(self.gait, Gait):
            raise wrong("gait", "must be a Gait", self.gait)
        if not 0.0 < number_of(self.period) < math.inf:
            raise wrong("period", "must be a positive number of seconds", self.period)
        most = sys.maxsize
        if type(self) is TimedGait:  # other motions have laws and rows of their own
            checked_choice("law", self.law, LAWS)
            most = MOST_SAMPLES
        samples = whole_number("samples", self.samples, 1, most)
        object.__setattr__(self, "samples", samples)  # the record is frozen
        object.__setattr__(self, "period", float(self.period))
        freeze_arrays(self)

    @property
    def repeats(self) -> bool:
        """Whether the motion repeats; False for a path, see :class:`TimedPath`."""
        return True

    @property
    def made_for(self) -> dict[str, list[float]]:
        """The limits that the timing was made to keep, four values of each: rate, acceleration, jerk; else empty."""
        return {}

    @property
    def made_from(self) -> dict[str, Any]:
        """What law, period and limits give the motion from, as a table states it; empty if it is more than corners."""
        return {"corners": self.gait.alpha.tolist()}

    @property
    def phases(self) -> tuple[tuple[str, float], ...]:
        """The parts of a mission by name, and when each begins [s]; none of any other motion."""
        return ()

    @property
    def statement(self) -> dict[str, Any]:
        """What a section of a joined path states, as plain values; empty if it is made from more than corners."""
        made_from = self.made_from
        corners = made_from.get("corners")
        if corners is None:
            return {}
        stated = {"corners": corners, "law": self.law, "period": self.period}
        stated |= made_from
        if self.made_for:
            stated["limits"] = self.made_for
        return stated

    def with_gait(self, gait: Gait) -> Self:
        """Return the same timing of another gait with as many corners."""
        return replace(self, gait=gait)

    def with_period(self, period: float) -> Self:
        """Return the same law over another period [s]."""
        return replace(self, period=number_of(period))

    def slowed(self, by: float) -> Self:
        """Return the same law over a multiple of the period."""
        return self.with_period(by * self.period)

    @property
    def corner_times(self) -> FloatArray:
        """The times of the corners, from 0 to T, shape (n + 1,) [s]."""
        step = self.gait.ends - self.gait.alpha
        length = np.sqrt((step * step).sum(axis=1))
        total = length.sum()
        if not LAWS[self.law].by_length or not total > 0:
            length, total = np.ones(len(length)), len(length)
        times = np.concatenate([[0.0], (length / total).cumsum() * self.period])
        times[-1] = self.period
        return read_only(times)

    @property
    def t(self) -> FloatArray:
        """Sample times, shape (N + 1,) [s]."""
        t = np.arange(self.samples + 1) * (self.period / self.samples)
        t[-1] = self.period
        return read_only(t)

    @property
    def alpha(self) -> FloatArray:
        """Tilt angles at the samples, shape (N + 1, 4) [rad]."""
        return read_only(self.at(self.t).alpha)

    @property
    def rates(self) -> FloatArray:
        """Tilt rates at the samples, shape (N + 1, 4) [rad/s]."""
        return read_only(self.at(self.t).rates)

    @property
    def accelerations(self) -> FloatArray:
        """Tilt accelerations at the samples, shape (N + 1, 4) [rad/s²]."""
        return read_only(self.at(self.t).accelerations)

    def at(self, t: npt.ArrayLike) -> Motion:
        """Return tilt angles, rates and accelerations at any times; the gait repeats with its period.

        Times of shape (...) [s] give arrays of shape (..., 4).

        >>> from gaitgraph.gait.gait import lift
        >>> timed = lift([(0.4, -1.2), (0.4, -0.4), (1.2, -0.4)], "red").parametrize(2.0)
        >>> timed.at(0.25).alpha.round(3).tolist(), timed.at([0.0, 0.5]).rates.shape
        ([0.4, -0.908, 0.4, -0.908], (2, 4))
        """
        times, gait = self.corner_times, self.gait
        segment, local = located(times, t)
        duration = np.diff(times)[segment]
        moving, divisor = duration > 0, np.where(duration > 0, duration, 1.0)
        tau = np.where(moving, local / divisor, 0.0)
        per_second = np.where(moving, 1.0 / divisor, 0.0)
        progress, speed, acceleration = LAWS.get(self.law, STRAIGHT).motion(tau)
        step = (gait.ends - gait.alpha)[segment]
        return Motion(
            alpha=gait.alpha[segment] + progress[..., None] * step,
            rates=(speed * per_second)[..., None] * step,
            # In this order: the square of the rate of a tiny segment may overflow.
            accelerations=(acceleration * per_second)[..., None]
            * (per_second[..., None] * step),
        )

    @property
    def columns(self) -> dict[str, Any]:
        """The gait table: t, angles, color, types, R, rates, accelerations, hover thrusts, in this order.

        Off planes there are no color and types. R is computed with the gait's own coefficients.
        """
        t = self.t
        angles, rates, accelerations = self.at(t)
        columns: dict[str, Any] = {"t": t}
        columns |= zip(ANGLES, angles.T, strict=True)
        gait = self.gait
        if gait.colors and gait.vehicle.asymmetry is None:
            # The sheet of a sample is that of the corner last passed.
            last = np.zeros(len(t), dtype=np.int64)
            if gait.color == "mixed":
                last = np.searchsorted(self.corner_times, t, side="right") - 1
            colors = [gait.colors[k % len(gait.colors)] for k in last]
            third, fourth = types_at(
                angles, color_codes(colors), gait.coefficients, gait.crossing_tolerance
            )
            columns["color"] = colors
            columns["types"] = list(map(text_from_types, third, fourth))
        columns["R"] = np.asarray(level_determinant(angles, gait.coefficients))
        columns |= zip(RATES, rates.T, strict=True)
        columns |= zip(ACCELERATIONS, accelerations.T, strict=True)
        columns |= hover_thrust_columns(angles, gait.vehicle)
        for name, values in columns.items():
            if isinstance(values, np.ndarray):
                columns[name] = values + 0.0  # turns negative zeros into zeros
        return read_only_mapping(columns)

    def vertices(self, tolerance: float = 1e-9) -> FloatArray:
        """Return the corners of the loop, not of its samples; see :func:`gaitgraph.gait.gait.vertices`."""
        return self.gait.vertices(tolerance)

    def peaks(self, order: int) -> FloatArray:
        """Return the largest size of a derivative of each angle over the period, between samples too, shape (4,).

        The order is 1 for rates [rad/s], 2 for accelerations [rad/s²], 3 for jerks [rad/s³], 4 for their slopes
        between corners. From 2 on they are infinite where a law turns a corner at full speed. Jerks of the law `smooth`
        jump at the corners.
        """
        order = whole_number("order", order, 1, 4)
        factor = LAWS.get(self.law, STRAIGHT).peaks[order - 1]
        duration = np.diff(self.corner_times)
        moving = duration > 0
        if not moving.any():
            return np.zeros(4)
        step = (self.gait.ends - self.gait.alpha)[moving]
        velocity = step / duration[moving, None]
        speed = np.abs(velocity)
        if math.isfinite(factor):
            per_second = 1.0 / duration[moving, None]
            largest = (speed * per_second ** (order - 1)).max(axis=0)
            return np.asarray(factor * largest)
        change = np.abs(velocity - np.roll(velocity, 1, axis=0))
        turns = change > ROUND_OFF * (1.0 + speed.max())
        return np.where(turns.any(axis=0), np.inf, 0.0)

    @property
    def peak_rates(self) -> FloatArray:
        """The largest |dαᵢ/dt|, as :meth:`peaks` does [rad/s]."""
        return read_only(self.peaks(1))

    @property
    def peak_accelerations(self) -> FloatArray:
        """The largest |d²αᵢ/dt²|, as :meth:`peaks` does [rad/s²]."""
        return read_only(self.peaks(2))

    @property
    def hover_power(self) -> float | None:
        """The mean of :func:`gaitgraph.invertibility.hover_power` over time; None if a hover thrust is not positive."""
        times, widths = self.corner_times[:-1], np.diff(self.corner_times)

        def alpha_at(shares: FloatArray) -> FloatArray:
            return self.at(times[:, None] + shares * widths[:, None]).alpha

        powers = mean_hover_powers(alpha_at, len(widths), self.gait.vehicle)
        mean = float(powers @ widths / widths.sum())
        return mean if math.isfinite(mean) else None

    def check(self, **options: Unpack[later.CheckOptions]) -> later.Report:
        """Return every check of the gait and its rates, accelerations and jerks; options as for :meth:`Gait.check`."""
        return self.gait.check(**options).with_timing(self)

    def rate_checks(
        self, noun: str = "period", share: float = 1.0
    ) -> tuple[later.Check, ...]:
        """Return the checks of tilt rates and accelerations, and of jerks where the vehicle limits them.

        A failed check states the `noun` that would keep the limit, a time that is a `share` of the period.
        """
        checks = []
        for order, (name, kind) in enumerate(
            zip(RATE_CHECKS, RATE_UNITS, strict=True), start=1
        ):
            limits = getattr(self.gait.vehicle, f"max_{name}")
            if kind in self.made_for:
                limits = tighter_of(limits, tuple(self.made_for[kind]))
            if limits is None and kind == "jerk":
                continue
            peaks = self.peaks(order)
            joint = int((peaks / scale_of(limits)).argmax())
            peak = float(peaks[joint])
            limit = four_of(limits)[joint]
            advice = ""
            if math.isinf(peak):
                advice = f"the law {shown(self.law)} turns corners at full speed: use the law 'smooth'"
            elif limit is not None and peak > limit:
                needed = self.period * share * (peak / limit) ** (1 / order)
                advice = f"this law needs a {noun} of at least {math.ceil(needed * 1000) / 1000:.3f} s"
            checks.append(later.limit_check(name, peak, joint + 1, limit, advice))
        return tuple(checks)

    def write(
        self,
        *paths: str | Path | IO[Any],
        force: bool = False,
        periods: int = 1,
        format: str | None = None,
    ) -> None:
        """Write the gait table to files, or to a stream; see :func:`gaitgraph.io.formats.write_tables`.

        Films (.gif, .mp4) are written by :meth:`animate`.
        """
        if format is not None or any(map(is_stream, paths)):
            later.write_tables(table_of(self), paths, periods=periods, format=format)
            return
        named = [path_of(path, "output") for path in paths]
        tables, films = later.tables_and_films(named)
        later.check_outputs(tables, force=force)
        if films:
            self.animate(*films, force=force)
        later.write_tables(table_of(self), tables, force=force, periods=periods)

    def animate(self, *paths: str | Path, force: bool = False) -> None:
        """Write films of one period, .gif or .mp4; see :func:`gaitgraph.plots.films.write_films`."""
        later.write_films(table_of(self), paths, force=force)

    def to_pandas(self) -> Any:
        """Return the gait table as a pandas frame; see :meth:`gaitgraph.gait.table.Table.to_pandas`."""
        return table_of(self).to_pandas()

    def __repr__(self) -> str:
        return (
            f"<{type(self).__name__}: {self.gait.sheet_in_words}, T = {self.period:.6g} s, {self.law}, "
            f"{self.samples} samples, vehicle {self.gait.vehicle.name!r}>"
        )

    def __str__(self) -> str:
        gait = self.gait
        title = (
            f"{type(self).__name__}, {gait.sheet_in_words}: T = {self.period:.6g} s, {self.law}, "
            f"{self.samples} samples, {gait.length:.4f} rad around"
        )
        lines = [title, setting_line(gait.vehicle, gait.coefficients.kind), ""]
        lines += [
            f"  {check.name.replace('_', ' ')}: {check.message}"
            for check in self.rate_checks()
        ]
        return "\n".join(lines)


@dataclass(frozen=True, slots=True, kw_only=True, repr=False, eq=False)
class RowTimedGait(TimedGait):
    """A gait that passes each row of a table at the row's own time, straight between them; each row is a corner.

    `times` are those of the rows, the first again at the end, shape (n + 1,), from 0 to the period [s]. Where the
    table is not `closed`, its last row not the first again, one more segment leads back. `law_stated` is whether the
    file states the law that its rows sample, as that of ``pace`` does, and their period. `tilts` are the angles between
    rows as polynomials of the share of time that has passed, highest power first, shape (6, n, 4); None where they are
    straight. The rows of a gait along a curved sheet follow from its law, which is one of
    :data:`gaitgraph.timing.laws.LAWS`; the law of other rows is :data:`ROW_BY_ROW`.
    """

    times: FloatArray
    closed: bool = True
    law_stated: bool = False
    tilts: FloatArray | None = None

    @property
    def made_from(self) -> dict[str, Any]:
        """The rows, if law and period give their times; see :attr:`TimedGait.made_from`."""
        if self.law not in LAWS:
            return {}
        return super(RowTimedGait, self).made_from  # slots make a new class

    def with_period(self, period: float) -> Self:
        """Return the rows at times in proportion, over another period [s]."""
        times = self.times * (period / self.period)
        return replace(self, period=float(period), times=times)

    @property
    def corner_times(self) -> FloatArray:
        """The times of the rows, from 0 to T, shape (n + 1,) [s]."""
        return self.times

    @property
    def widths(self) -> FloatArray:
        """How long each row lasts, shape (n,) [s]."""
        return np.diff(self.times)

    def at(self, t: npt.ArrayLike) -> Motion:
        """Return tilt angles, rates and accelerations at any times; see :meth:`TimedGait.at`."""
        if self.tilts is None:
            return TimedGait.at(self, t)
        tilts, times, widths = self.tilts, self.times, self.widths
        return Motion(*(value_at(tilts, times, widths, t, k) for k in range(3)))

    def peaks(self, order: int) -> FloatArray:
        """Return the largest size of a derivative of each angle, or a bound of it; see :meth:`TimedGait.peaks`."""
        if self.tilts is None:
            return TimedGait.peaks(self, order)
        return np.asarray(peaks_of(self.tilts, self.widths, order).max(axis=0))

    def check(self, **options: Unpack[later.CheckOptions]) -> later.Report:
        """Return every check of the rows; see :func:`gaitgraph.validation.validating.validate`.

        Where they follow from the law, those of the chords between them, and of the motion's rates.
        """
        if self.law in LAWS:
            return TimedGait.check(self, **options)
        gait = self.gait
        columns: dict[str, Any] = {"t": self.times}
        rows = np.vstack([gait.alpha, gait.alpha[:1]])
        columns |= zip(ANGLES, rows.T, strict=True)
        if gait.colors:
            columns["color"] = (*gait.colors, gait.colors[0])
        if self.tilts is not None:
            _, rates, accelerations = self.at(self.times)
            columns |= zip(RATES, rates.T, strict=True)
            columns |= zip(ACCELERATIONS, accelerations.T, strict=True)
        return later.validate(
            Table(columns=columns),
            vehicle=gait.vehicle,
            coefficients=gait.coefficients.kind,
            **options,
        )


@dataclass(frozen=True, slots=True, kw_only=True, repr=False, eq=False)
class TimedPath(TimedGait):
    """A motion that is run once, from its start to its end, at which it then stays.

    `loop` leads out and back: its first half is the path, and `gait` is its closed polyline, whose segments are those of
    the path. `period` is the duration of the path [s], and `samples` are its intervals. `phases` are those of the
    mission whose rows it joins.
    """

    loop: TimedGait
    phases: tuple[tuple[str, float], ...] = ()

    @classmethod
    def of(cls, loop: TimedGait) -> TimedPath:
        """Return the first half of a timed gait that leads out and back the same way."""
        return cls(
            gait=loop.gait,
            period=loop.period / 2,
            law=loop.law,
            samples=max(loop.samples // 2, 1),
            loop=loop,
        )

    @property
    def repeats(self) -> bool:
        """False."""
        return False

    @property
    def phase(self) -> str:
        """Its name among motions one after another."""
        return "path"

    @property
    def line(self) -> FloatArray:
        """The corners that are passed, both ends included, shape (n, 4) [rad]."""
        return read_only(self.gait.alpha[: len(self.gait.alpha) // 2 + 1])

    @property
    def made_from(self) -> dict[str, Any]:
        """The corners of the path, both ends included; see :attr:`TimedGait.made_from`."""
        corners = self.loop.made_from.get("corners")
        if corners is None:
            return {}
        return {"corners": corners[: len(corners) // 2 + 1]}

    def with_gait(self, gait: Gait) -> Self:
        """Return the same timing of another gait with as many corners, out and back."""
        return replace(self, gait=gait, loop=self.loop.with_gait(gait))

    def with_period(self, period: float) -> Self:
        """Return the path in another duration [s]."""
        loop = self.loop.with_period(2 * period)
        slower = period / self.period
        phases = tuple((name, begin * slower) for name, begin in self.phases)
        return replace(self, period=float(period), loop=loop, phases=phases)

    @property
    def corner_times(self) -> FloatArray:
        """The times of the corners of the path, from 0 to its duration [s]."""
        times = self.loop.corner_times
        # A single corner is left and reached again at the end of the loop.
        return read_only(np.minimum(times[: len(times) // 2 + 1], self.period))

    def at(self, t: npt.ArrayLike) -> Motion:
        """Return tilt angles, rates and accelerations at any times; before and after the path those of its ends."""
        times = times_from(t)
        # At the end the rates are those just before it; a law may stop there at full speed.
        last = math.nextafter(self.period, 0.0)
        motion = self.loop.at(np.clip(times, 0.0, last))
        is_over = (times >= self.period)[..., None]
        motion = motion._replace(alpha=np.where(is_over, self.line[-1], motion.alpha))
        return motion.moving((times >= 0.0) & (times <= self.period))

    def peaks(self, order: int) -> FloatArray:
        """Return those of the loop; see :meth:`TimedGait.peaks`."""
        return self.loop.peaks(order)

    def check(self, **options: Unpack[later.CheckOptions]) -> later.Report:
        """Return every check of the path; options as for :meth:`Gait.check`."""
        if self.law == ROW_BY_ROW:
            return later.validate(table_of(self), **options)
        report = self.gait.check(**options).with_timing(self)
        return replace(report, repeats=False)

    def rate_checks(
        self, noun: str = "duration", share: float = 1.0
    ) -> tuple[later.Check, ...]:
        """Return the checks of tilt rates, accelerations and jerks; see :meth:`TimedGait.rate_checks`."""
        return self.loop.rate_checks(noun, share / 2)


def timed_gait_of(
    gait: GaitLike,
    *,
    vehicle: VehicleLike | None = None,
    coefficients: CoefficientsLike | None = None,
    period: float | None = None,
    law: LawName | None = None,
) -> TimedGait:
    """Return the timed gait of a gait in any form; see :func:`gaitgraph.gait.given.given_gait`.

    By default the vehicle and the coefficients are those that a file states, and so is the motion if its rows are those
    of it, see :mod:`gaitgraph.timing.statement`. Otherwise rows are joined by straight segments, each at its own time.
    Without times the period is 1 s; a file needs a `period`
    then. Raises InputError, FileProblem or Infeasible if it is not a gait, cannot be read, or is the table of a flight.
    """
    given = given_gait(gait, vehicle=vehicle, coefficients=coefficients)
    source = given.source
    if isinstance(source, TimedGait):
        if period in (None, source.period) and law in (None, source.law):
            return source
        if period is None:
            period = source.period
        choice: Any = source.law if law is None else law
        return source.gait.parametrize(period, law=choice)
    if isinstance(source, Gait):
        if period is None:
            period = 1.0
        return source.parametrize(period, law=law or DEFAULT_LAW)
    _refuse_flight(source, given.file)
    motion = given.motion
    if motion is not None and law is None:
        if period is None:
            return motion
        if motion.law == JOINED:
            checked_clock(period, DEFAULT_LAW)
            return motion.with_period(period)
    if source.repeats or len(source) == 1:
        return _timed_rows(given, source, period, law)
    with naming_file(given.file):
        return _timed_path(given, source, period, law)


def _refuse_flight(table: Table, file: str | Path | None) -> None:
    """Raise InputError for the table of a flight."""
    if table.about.get("made_by") != "fly":
        return
    name, advice = str(file or "FILE"), ""
    if "request" in table.about:
        advice = f"; gaitgraph plan {name} --output gait.csv writes its gait"
    raise InputError(
        f"gait file {name!r} must be the table of a gait, got that of a flight{advice}",
        path=name,
    )


def _timed_rows(
    given: GivenGait, table: Table, period: float | None, law: LawName | None
) -> TimedGait:
    """Return the rows of a table that repeats at their own times; with a new timing, or without times, by a law."""
    rows, times = given.rows
    corners = given.gait
    if len(table) == 1:
        times = None
    if times is not None and period is None and law is None:
        colors: tuple[str, ...] = ()
        if len(set(corners.colors)) == 1:
            colors = corners.colors[:1] * len(rows.alpha)
        is_closed = len(rows.alpha) < len(table)
        return _row_by_row(
            table,
            replace(corners, alpha=rows.alpha, colors=colors),
            times,
            closed=is_closed,
        )
    if period is None:
        period = table.about.get("period")
    if period is None and times is not None:
        period = float(times[-1] - times[0])
    if period is None and len(corners.alpha) > 1 and given.file is not None:
        raise InputError(
            f"gait file {str(given.file)!r} has no column t",
            path=str(given.file),
            advice=Advice(
                "set period= (s)", "gaitgraph export FILE --period SECONDS adds one"
            ),
        )
    if period is None:
        period = 1.0
    if law is None:
        law = DEFAULT_LAW
        if table.about.get("law") in list(LAWS):  # it may be anything
            law = table.about["law"]
    return corners.parametrize(period, law=law)


def _timed_path(
    given: GivenGait, table: Table, duration: float | None, law: LawName | None
) -> TimedPath:
    """Return the motion of a table that is run once; its rows, straight between them, or with a new timing by a law."""
    rows, times = given.rows
    corners = given.gait
    if times is not None and duration is None and law is None:
        out_and_back = replace(corners, alpha=rows.alpha, colors=rows.colors)
        loop = _row_by_row(table, out_and_back, times, closed=True)
        path = TimedPath.of(loop)
        return replace(path, phases=_stated_phases(table, path.period))
    if duration is None and times is not None:
        duration = float(table["t"][-1] - table["t"][0])
    if duration is None:
        raise InputError("t must be a column of a path, got none; set a period")
    samples = 2 * (len(table) - 1)
    return TimedPath.of(
        corners.parametrize(2 * duration, law=law or DEFAULT_LAW, samples=samples)
    )


def _row_by_row(
    table: Table, gait: Gait, times: FloatArray, *, closed: bool
) -> RowTimedGait:
    """Return the rows of a table, straight between them, at their own times."""
    return RowTimedGait(
        gait=gait,
        period=float(times[-1] - times[0]),
        law=ROW_BY_ROW,
        samples=len(times) - 1,
        times=times - times[0],
        closed=closed,
        law_stated="law" in table.about,
    )


def _stated_phases(table: Table, duration: float) -> tuple[tuple[str, float], ...]:
    """Return the phases of the mission that a table states, none if it states none that fit its times."""
    try:
        names, begins = zip(*table.about.get("phases", ()), strict=True)
        times = np.array([*begins, duration], dtype=float)
    except (TypeError, ValueError):
        return ()
    if "gait" not in names or times[0] != 0 or not (np.diff(times) > 0).all():
        return ()
    return tuple(zip(map(str, names), times.tolist(), strict=False))


def checked_clock(
    period: float, law: str, *, samples: int | None = None, rate: float | None = None
) -> int:
    """Return the number of sample intervals, or raise InputError; see :meth:`Gait.parametrize`.

    >>> checked_clock(2.0, "smooth", rate=50)
    100
    """
    seconds = number_of(period)
    if not SHORTEST <= seconds <= LONGEST:
        raise wrong("period", "must be between 1e-6 and 1e9 s", period)
    checked_choice("law", law, LAWS)
    if samples is not None and rate is not None:
        raise InputError(
            f"samples and rate must not both be given, got {shown(samples)} and {shown(rate)}",
            field="samples",
            value=samples,
        )
    if rate is not None:
        exact = seconds * number_of(rate)
        if not 0 < exact <= MOST_SAMPLES:
            rule = f"positive and give at most {MOST_SAMPLES} samples"
            raise wrong("rate", f"must be {rule}", rate, f" Hz over {shown(period)} s")
        samples = max(1, math.ceil(exact * (1 - 1e-12)))
    if samples is None:
        samples = DEFAULT_SAMPLES
    return whole_number("samples", samples, 1, MOST_SAMPLES)


def table_of(gait: GaitLike, about: Mapping[str, Any] | None = None) -> Table:
    """Return the table of a gait in any form, with what made it.

    >>> from gaitgraph.gait.gait import lift
    >>> table = table_of(lift([(0.4, -0.4), (0.8, -0.8)], "red").parametrize(samples=4))
    >>> len(table), list(table.columns)[:6]
    (5, ['t', 'alpha1', 'alpha2', 'alpha3', 'alpha4', 'color'])
    """
    check_kind("about", about, dict, type(None))
    timed = timed_gait_of(gait)
    gait = timed.gait
    made: dict[str, Any] = {
        "vehicle": gait.vehicle.as_mapping(),
        "coefficients": gait.coefficients.kind,
        "crossing_tolerance": gait.crossing_tolerance,
        "period": timed.period,
        "law": timed.law,
    }
    by_law = timed.law in LAWS
    if not timed.repeats:
        made["repeats"] = False
    if timed.made_for:
        made["limits"] = timed.made_for
    if not by_law and timed.law != JOINED:
        made["made_by"] = "optimize" if timed.law == "optimal" else "pace"
    made["samples"] = timed.samples
    made_from = timed.made_from
    is_short = len(made_from.get("corners", ())) <= MOST_CORNERS
    if gait.color != "mixed" and is_short:
        made |= made_from
    if timed.phases:
        made["phases"] = [list(phase) for phase in timed.phases]
    if gait.request:
        made["request"] = dict(gait.request)
        if by_law:  # requests know no other laws
            for name in ("period", "law", "samples"):
                made["request"][name] = made[name]
    made |= about or {}
    whole = Table(columns=timed.columns, about=made)
    if timed.law == ROW_BY_ROW:
        return whole
    return whole.with_motion(timed)
