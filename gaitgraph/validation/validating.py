"""Judge a gait, a table or a file of any length: every rule, the clock, and the colourings of its loop, in one report.

A table is looked at piece by piece and never held whole. Its rows are joined by straight segments, from the last
back to the first too, and every check holds along the segments.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import number_of
from gaitgraph.errors import InputError, shown
from gaitgraph.gait.gait import Gait
from gaitgraph.gait.table import ACCELERATIONS, CLOSED_GAP, RATES, Table, setting_of
from gaitgraph.invertibility.matrices import Kind, level_determinant
from gaitgraph.io.frames import Frame, as_table
from gaitgraph.io.reading import read_pieces
from gaitgraph.surface.adjacency import types_from_text
from gaitgraph.surface.loop_colorings import SIGNS, ChainCount, ColoringListing, colorings, palette_of
from gaitgraph.surface.sheets import families_along, family_codes, family_of, sheet_angles, types_contradict
from gaitgraph.timing.timed_gait import TimedGait
from gaitgraph.validation.checks import Judge, check_gait, checked_limits
from gaitgraph.validation.pieces import Place, Setting, Stretch
from gaitgraph.validation.report import DEFAULT_FLOOR, DEFAULT_TOLERANCE, Check, Report
from gaitgraph.validation.rules import limit_check

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from gaitgraph.vehicle import Vehicle

__all__ = ["validate"]

FloatArray = npt.NDArray[np.float64]

MOST_LISTED_ROWS = 10_000
"""Up to this many rows a table's colourings are listed; longer ones are counted."""


def validate(
    gait: Gait | TimedGait | Table | Frame | str | Path,
    *,
    vehicle: Vehicle | None = None,
    coefficients: Kind | None = None,
    tolerance: float = DEFAULT_TOLERANCE,
    floor: float = DEFAULT_FLOOR,
    angle_rounding: float | None = None,
    crossing_tolerance: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> Report:
    """Return every check of a gait; with a clock, those of tilt rates and accelerations too.

    Parameters
    ----------
    gait
        A gait, a timed one, a table, a frame of pandas or polars, or the path of a gait file of any format that is
        read; a CSV or Parquet file may be larger than memory.
    vehicle, coefficients
        For tables and files: what the gait is for; by default what the table says, else the paper's vehicle.
    tolerance, floor, angle_rounding
        As for :func:`gaitgraph.validation.checks.check_gait`; angles of a CSV file that are printed with three to eight decimals
        are off by half a unit of the last one at least. Rows of a table without colors get the color of the sheet that
        they are within `tolerance` of, or else of the fibre.
    crossing_tolerance
        For tables and files: distance from a crossing line within which a plane type is `?` [rad]; π/32 by default.
    progress
        Called with the fraction of a file that was looked at.

    Returns
    -------
    Report
        Falsy when the gait is not valid; prints well; serialises by ``as_mapping``. For a table `where` tells the
        row, counted from 1, from which a segment starts, the fraction along it, the time and the tilt angles.

    Raises
    ------
    InputError, FileProblem
        If a value is not allowed, or a file cannot be read as a gait table.

    Notes
    -----
    Rates and accelerations of a table are the least that any motion through its rows must reach: slopes, and second
    divided differences; what the table states is taken if it is larger. Peaks between rows of a motion that is not
    straight there are not seen.

    Examples
    --------
    >>> from gaitgraph.gait.gait import lift
    >>> report = validate(lift([(0.4, -0.4), (1.1, -1.1)], "blue"))
    >>> bool(report), report.flyable, report["R_sign"].decided, report.listing.count
    (True, False, False, 2)
    """
    if isinstance(gait, (Gait, TimedGait)):
        given = {"vehicle": vehicle, "coefficients": coefficients, "crossing_tolerance": crossing_tolerance}
        for name, value in given.items():
            if value is not None:
                raise InputError(f"{name}: {shown(value)}; allowed is none beside a gait, which has its own")
        return _of_gait(gait, tolerance, floor, angle_rounding)
    gait = as_table(gait)
    checked_limits(tolerance, floor, angle_rounding)
    if crossing_tolerance is not None and not 0 <= number_of(crossing_tolerance) < math.inf:
        raise InputError(f"crossing_tolerance: {shown(crossing_tolerance)}; allowed is a finite number ≥ 0 (rad)")
    if isinstance(gait, Table):
        pieces: Iterator[Table] = iter([gait])
    elif isinstance(gait, (str, Path)):
        pieces = read_pieces(gait, progress=progress)
    else:
        raise InputError(f"gait: {shown(gait)}; allowed is a gait, a timed gait, a table, a frame or a file's path")
    first = next(pieces)
    try:
        vehicle, numbers, told = setting_of(first, vehicle, coefficients)
    except InputError as error:
        raise InputError(str(error) if isinstance(gait, Table) else f"gait file {str(gait)!r}: {error}") from error
    setting = Setting(
        vehicle=vehicle,
        coefficients=numbers,
        tolerance=tolerance,
        floor=floor,
        angle_rounding=angle_rounding,
        digits=first.rounding,
        crossing_tolerance=told if crossing_tolerance is None else float(crossing_tolerance),
        noun="row",
    )
    judging = _TableJudge(setting)
    if "transition" in first.about:
        judging.notes["transition"] = "this is a way from one place to another: its way back to row 1 is no part of it"
    judging.see(first)
    for piece in pieces:
        judging.see(piece)
    return judging.report()


def _of_gait(gait: Gait | TimedGait, tolerance: float, floor: float, angle_rounding: float | None) -> Report:
    timed = isinstance(gait, TimedGait)
    bare = gait.gait if isinstance(gait, TimedGait) else gait
    report = check_gait(bare, tolerance=tolerance, floor=floor, angle_rounding=angle_rounding)
    if timed:
        report = report.with_checks(gait.clock_checks())  # type: ignore[union-attr]
    if (np.abs(bare.alpha[:, :2]) > math.pi / 2).any():
        return report  # colourings are of loops in [−π/2, π/2]²
    loop = colorings(bare.alpha, coefficients=bare.coefficients, crossing_tolerance=bare.crossing_tolerance)
    return replace(report, listing=loop.listing())


class _TableJudge:
    """Sees a table piece by piece: closes it, finds the sheet of each row, and asks the rules."""

    def __init__(self, setting: Setting) -> None:
        self.setting = setting
        self.judge = Judge(setting)
        self.clock = _Clock(setting)
        self.chains = {sign: ChainCount(sign) for sign in SIGNS}
        self.rows = 0
        self.longest = 0.0
        self.first: Stretch | None = None
        self.last: Stretch | None = None
        self.plane: list[FloatArray] = []
        self.notes: dict[str, str] = {}

    def see(self, piece: Table) -> None:
        """Take in the next rows."""
        fresh = self._rows_of(piece)
        joined = fresh if self.last is None else _joined(self.last, fresh)
        self.first = self.first or fresh[:1]
        if len(joined.alpha) > 1:
            self.judge.see(joined)
            self.longest = max(self.longest, float(np.abs(np.diff(joined.alpha, axis=0)).max()))
            # The last row may turn out to be the first again, which is no point of its own.
            self._paint(joined.alpha[:-1, :2])
        if fresh.t is not None:
            self.clock.see(fresh, piece)
        self._compare(fresh, piece)
        self.rows += len(fresh.alpha)
        self.last = fresh[-1:]

    def _rows_of(self, piece: Table) -> Stretch:
        """Return the rows of a piece with the sheet that each is painted as, or lies on."""
        setting = self.setting
        a1, a2 = piece["alpha1"], piece["alpha2"]
        sheet = np.zeros(len(piece), dtype=np.int8)
        if "color" in piece:
            sheet = family_codes(piece["color"])
        if "alpha3" in piece:
            alpha = piece.alpha
        elif (sheet > 1).any():
            point = int(np.argmax(sheet > 1))
            raise InputError(
                f"row {self.rows + point + 1}: color is {family_of(sheet[point])!r}; allowed are 'red' and 'blue' "
                "without alpha3 and alpha4, of which a fibre leaves one open"
            )
        else:
            red, blue = (sheet_angles(color, a1, a2, setting.coefficients) for color in ("red", "blue"))
            alpha = np.column_stack([a1, a2, *(np.where(sheet > 0, r, b) for r, b in zip(red, blue, strict=True))])
        if "color" not in piece:
            before = 0 if self.last is None else int(self.last.sheet[0])
            sheet = families_along(alpha, setting.coefficients, setting.tolerance, before=before)
        return Stretch(alpha=alpha, sheet=sheet, first=self.rows, t=piece.columns.get("t"))

    def _paint(self, plane: FloatArray) -> None:
        palettes = palette_of(plane[:, 0], plane[:, 1], self.setting.coefficients, self.setting.crossing_tolerance)
        for sign, chain in self.chains.items():
            chain.see(palettes[sign])
        if self.rows <= MOST_LISTED_ROWS:
            self.plane.append(plane)

    def _compare(self, fresh: Stretch, piece: Table) -> None:
        """Note the first row whose stated types or R disagree with its angles."""
        if "types" in piece and "types" not in self.notes:
            texts = {text: types_from_text(text) for text in dict.fromkeys(piece["types"])}
            codes = np.array([texts[text] for text in piece["types"]])
            wrong = types_contradict(codes, fresh.sheet)
            if wrong.any():
                k = int(np.argmax(wrong))
                self.notes["types"] = (
                    f"row {fresh.number(k)} states the types {piece['types'][k]}, but it is "
                    f"{family_of(fresh.sheet[k])}; stated types are not used"
                )
        if "R" in piece and "R" not in self.notes:
            computed = np.asarray(level_determinant(fresh.alpha, self.setting.coefficients))
            wrong = np.abs(piece["R"] - computed) > 1e-2 * np.maximum(1.0, np.abs(computed))
            if wrong.any():
                k = int(np.argmax(wrong))
                self.notes["R"] = (
                    f"row {fresh.number(k)} states R = {piece['R'][k]:.4g}, computed is {computed[k]:.4g} "
                    f"({self.setting.coefficients.kind} coefficients); stated values are not used"
                )

    def report(self) -> Report:
        """Close the table and return what was found."""
        first, last = self.first, self.last
        assert first is not None and last is not None  # noqa: PT018, S101 - pieces have rows
        gap = float(np.abs(last.alpha[0] - first.alpha[0]).max())
        repeated = self.rows > 1 and gap <= CLOSED_GAP and last.sheet[0] == first.sheet[0]
        # A measured loop comes back to within its noise: a segment of that length, and no step in time.
        near = repeated or (self.rows > 1 and gap <= self.setting.tolerance and gap < self.longest / 4)
        if repeated:
            message = "the last row is the first again"
        else:
            closing = replace(
                _joined(last, first), first=self.rows - 1, after=0, t=self._closing_times(), after_t=_time_of(first)
            )
            self.judge.see(closing)
            self._paint(last.alpha[:, :2])
            message = f"closed by a straight segment of {gap:.4g} rad from row {self.rows} back to row 1"
            if near:
                message = f"the last row is the first again, to within {gap:.2g} rad"
            if self.rows == 1:
                message = "a single row is a gait that is a point"
            elif gap > 3 * self.longest and self.rows > 2:
                self.notes["closed"] = (
                    f"the way back from row {self.rows} to row 1 is {gap:.4g} rad, the longest step between rows only "
                    f"{self.longest:.4g}: is the end of the table missing?"
                )
        place = Place(point=self.rows - 1, fraction=0.0, alpha=tuple(last.alpha[0].tolist()), t=_time_of(last))
        closed = Check(
            name="closed",
            kind="valid",
            ok=True,
            value=0.0 if repeated else gap,
            where=place.as_mapping("row"),
            message=message,
        )
        report = self.judge.report(closed)
        if first.t is not None:
            report = report.with_checks(self.clock.checks(closed=near))
            self.notes |= self.clock.notes
        return replace(report, notes=tuple(self.notes.values()), rows=self.rows, listing=self._listing())

    def _closing_times(self) -> FloatArray | None:
        """Return the times of the closing segment, which takes one mean step."""
        if self.first is None or self.last is None or self.first.t is None or self.last.t is None:
            return None
        end = float(self.last.t[0])
        return np.array([end, end + (end - float(self.first.t[0])) / max(self.rows - 1, 1)])

    def _listing(self) -> ColoringListing:
        counts = {sign: chain.closed() for sign, chain in self.chains.items()}
        obstacles = {sign: chain.obstacle for sign, chain in self.chains.items() if chain.obstacle is not None}
        first: Any = ()
        if self.rows <= MOST_LISTED_ROWS:
            setting, plane = self.setting, np.concatenate(self.plane)
            loop = colorings(plane, coefficients=setting.coefficients, crossing_tolerance=setting.crossing_tolerance)
            first = loop.listing().first
        plain = {sign: chain.plain for sign, chain in self.chains.items()}
        return ColoringListing(counts=counts, plain=plain, first=first, obstacles=obstacles)


def _joined(before: Stretch, after: Stretch) -> Stretch:
    times = None if before.t is None or after.t is None else np.concatenate([before.t, after.t])
    return Stretch(
        alpha=np.concatenate([before.alpha, after.alpha]),
        sheet=np.concatenate([before.sheet, after.sheet]),
        first=before.first,
        t=times,
    )


def _time_of(row: Stretch) -> float | None:
    return None if row.t is None else float(row.t[0])


class _Clock:
    """The rates, accelerations and jerks that a motion through rows with times must reach, or that the table states."""

    def __init__(self, setting: Setting) -> None:
        self.setting = setting
        self.rate, self.acceleration, self.jerk = _Peak(), _Peak(), _Peak()
        self.notes: dict[str, str] = {}
        self._rows: Stretch | None = None  # the last three rows so far
        self._first: Stretch | None = None  # the first three
        self._turned, self._off = 0.0, 0.0
        self._stated: FloatArray | None = None
        self._start, self._end = 0.0, 0.0

    def see(self, fresh: Stretch, piece: Table) -> None:
        """Take in the next rows, with the rates and accelerations that they state."""
        rows = fresh if self._rows is None else _joined(self._rows, fresh)
        self._start = self._start if self._rows is not None else float(fresh.t[0])  # type: ignore[index]
        self._end = float(fresh.t[-1])  # type: ignore[index]
        self._slopes(rows)
        for names, peak in ((RATES, self.rate), (ACCELERATIONS, self.acceleration)):
            if all(name in piece for name in names):
                peak.take(np.column_stack([piece[name] for name in names]), fresh)
        if all(name in piece for name in RATES):
            self._compare(fresh, np.column_stack([piece[name] for name in RATES]))
        if self._first is None or len(self._first.alpha) < 3:
            self._first = rows[:3]
        self._rows = rows[-3:]

    def _slopes(self, rows: Stretch) -> None:
        if len(rows.alpha) < 2 or rows.t is None:
            return
        step = np.diff(rows.t)[:, None]
        slope = np.diff(rows.alpha, axis=0) / step
        self.rate.take(slope, rows)
        if len(slope) > 1:
            # A twice differentiable motion through three rows has this acceleration somewhere between them.
            second = 2 * np.diff(slope, axis=0) / (step[1:] + step[:-1])
            self.acceleration.take(second, rows, offset=1)
            if len(slope) > 2:
                # And one that is differentiable three times through four rows has this jerk.
                self.jerk.take(3 * np.diff(second, axis=0) / (step[2:] + step[1:-1] + step[:-2]), rows, offset=1)

    def _compare(self, fresh: Stretch, stated: FloatArray) -> None:
        """Add up how far the stated rates are from what the angles do."""
        before = self._rows[-1:] if self._rows is not None else fresh[:0]
        rows = _joined(before, fresh)
        rates = stated if self._stated is None else np.concatenate([self._stated, stated])
        self._stated = stated[-1:]
        if len(rows.alpha) > 1 and len(rates) == len(rows.alpha) and rows.t is not None:
            turned = np.diff(rows.alpha, axis=0)
            told = (rates[:-1] + rates[1:]) / 2 * np.diff(rows.t)[:, None]
            self._turned += float(np.abs(turned).sum() + np.abs(told).sum())
            self._off += float(np.abs(turned - told).sum())

    def checks(self, *, closed: bool) -> list[Check]:
        """Close the motion and return the checks of its rates and, where limited, accelerations and jerks."""
        self._close(closed=closed)
        if self._off > 0.5 * self._turned > 0:
            self.notes["rates"] = (
                "the stated rates do not fit the rows: allowed are rad/s in alpha1_rate to alpha4_rate; the larger of "
                "both is judged"
            )
        vehicle, period = self.setting.vehicle, self._end - self._start
        out = []
        for name, unit, peak, limit, order in (
            ("tilt_rate", "rad/s", self.rate, vehicle.max_tilt_rate, 1),
            ("tilt_acceleration", "rad/s²", self.acceleration, vehicle.max_tilt_acceleration, 2),
            ("tilt_jerk", "rad/s³", self.jerk, vehicle.max_tilt_jerk, 3),
        ):
            if order > 1 and limit is None:
                continue
            needed = period * (peak.value / limit) ** (1 / order) if limit else period
            where = None if peak.place is None else peak.place.as_mapping("row")
            advice = f"at {peak.place.told('row')}" if peak.place is not None else ""
            advice += f"; run over at least {needed:.4g} s instead of {period:.4g} s it would do"
            out.append(limit_check(name, unit, peak.value, peak.joint, limit, where, advice))
        return out

    def _close(self, *, closed: bool) -> None:
        """Look across the seam: from the last rows to the first ones."""
        rows, first = self._rows, self._first
        if rows is None or first is None or rows.t is None or first.t is None or len(rows.alpha) < 2:
            return
        count = rows.first + len(rows.alpha)
        step = (self._end - self._start) / (count - 1)
        shift = self._end - self._start + (0.0 if closed else step)
        onward = replace(first[1:] if closed else first, first=rows.first + len(rows.alpha))
        self._slopes(_joined(rows, replace(onward, t=onward.t + shift if onward.t is not None else None)))


class _Peak:
    """The largest size of a derivative of the four tilt angles, and where."""

    def __init__(self) -> None:
        self.value, self.joint = 0.0, 1
        self.place: Place | None = None

    def take(self, values: FloatArray, rows: Stretch, *, offset: int = 0) -> None:
        """Take in values of shape (k, 4), the first of which belongs to row `offset`."""
        size = np.abs(values)
        k, joint = divmod(int(np.argmax(size)), 4)
        if size[k, joint] > self.value or self.place is None:
            self.value, self.joint = float(size[k, joint]), joint + 1
            at = rows[k + offset : k + offset + 1]
            self.place = Place(point=at.first, fraction=0.0, alpha=tuple(at.alpha[0].tolist()), t=_time_of(at))
