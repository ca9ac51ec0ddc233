"""Is a gait valid, and can it fly? Every rule, the rates and the colourings of its loop, in one report.

A table is judged piece by piece and never held whole. Its rows are joined by straight segments, from the last back to
the first too, and every check holds along the segments.

Timing comes after this package in the import order. A timed gait is therefore known here by what it has: a `gait`, and
:meth:`rate_checks`, which it computes from its own law. The rates of a table need no law: they follow from its rows.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, TypeGuard

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import distance_to_multiple, number_of
from gaitgraph.errors import InputError, shown
from gaitgraph.gait.gait import Gait
from gaitgraph.gait.rows import CLOSED_GAP, closing_time, tilt_angles
from gaitgraph.gait.table import ACCELERATIONS, RATES, Table, setting_of
from gaitgraph.invertibility.matrices import (
    DEFAULT_FLOOR,
    Kind,
    coefficients_of,
    level_determinant,
    level_determinant_resolution,
)
from gaitgraph.invertibility.segment_bounds import least_level_determinant
from gaitgraph.io.columns import Frame, as_table
from gaitgraph.io.reading import read_pieces
from gaitgraph.surface.adjacency import types_from_text
from gaitgraph.surface.loop_colorings import ColoringCount, ColoringListing, color_choices, colorings, listing_of
from gaitgraph.surface.sheets import (
    DEFAULT_TOLERANCE,
    HOVER_LABEL,
    SIGNS,
    families_along,
    family_codes,
    family_of,
    red_label,
    types_contradict,
)
from gaitgraph.validation.report import RATE_UNITS, Check, Place, Report, limit_check
from gaitgraph.validation.rules import (
    Continuous,
    HoverThrust,
    LevelSign,
    OnSurface,
    Rule,
    Segments,
    Setting,
    SingularValue,
    TiltRange,
    TwoColor,
    segments_of,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from gaitgraph.vehicle import Vehicle

FloatArray = npt.NDArray[np.float64]

_BLOCK = 1 << 14

MOST_LISTED_ROWS = 10_000
"""Up to this many rows a table's colourings are listed; longer ones are counted."""


class Reach:
    """Whether ordinary hover can enter the gait, and leave it, without a singular matrix."""

    def __init__(self, setting: Setting, continuous: Continuous) -> None:
        self.vehicle, self.continuous = setting.vehicle, continuous
        self.exact = coefficients_of(setting.vehicle, "exact")
        self.positive, self.home, self.opposite, self.off_red = True, True, 0.0, 0.0
        self.confined = True  # whether points of fibres are within ±π/2

    def update(self, run: Segments) -> None:
        """Decide whether R > 0 along the segments, and whether the points are in the component of α = 0."""
        if not self.positive:
            return
        alpha = run.alpha
        value = np.asarray(level_determinant(alpha, self.exact))
        resolution = float(np.max(level_determinant_resolution(alpha, self.exact)))
        floor, ends = resolution * (1 + 1e-9), (value[:-1], value[1:])
        least = least_level_determinant(
            run.starts, run.ends, self.exact, tolerance=0.0, floor=floor, each=True, at_ends=ends
        )
        self.positive = bool(least.lower.min() > resolution) and not self.continuous.blue
        fibered = run.sheet > 1
        if fibered.any():
            self.confined &= bool((np.abs(alpha[fibered]) <= math.pi / 2 + 1e-9).all())
            alpha = alpha[~fibered]
            if not len(alpha):
                return
        self.home &= bool((red_label(alpha[:, 0], alpha[:, 1], self.vehicle) == HOVER_LABEL).all())
        opposite = np.abs(alpha[:, 2:] - alpha[:, :2])
        self.opposite = max(self.opposite, float(opposite.max()))
        self.off_red = max(self.off_red, float(distance_to_multiple(opposite, math.pi).max()))

    def answer(self) -> tuple[bool | None, str]:
        """Return yes, no or unknown, and a sentence."""
        limit = 2 * self.vehicle.signed_drag_ratio
        home = f"the component of α = 0 (tan α1 − tan α2 {'<' if limit > 0 else '>'} {limit:.4f})"
        enters = "the component of α = 0, which ordinary hover can enter and leave"
        if not self.positive:
            return False, (
                "it cannot be entered from ordinary hover (R = +4 at α = 0) without a singular matrix: plan with R > 0 "
                f"in {home}, or start the flight in the gait"
            )
        if self.off_red > DEFAULT_TOLERANCE:
            return None, "off the red sheet with R > 0: whether hover can reach it is not decided here"
        # An opposite arm shifted by π is on red too, but not on the part of it that hover is on.
        if not self.home or self.opposite > DEFAULT_TOLERANCE:
            return False, f"on the surface ordinary hover cannot reach this component of R > 0: plan in {home}"
        if self.continuous.fiber is None:
            return True, f"in {enters}"
        if self.confined:
            return True, f"on a fibre that meets {enters}"
        return None, "on a fibre, beyond ±π/2, with R > 0: whether hover can reach it is not decided here"


class Checker:
    """Applies all rules to the segments of a gait, in order, and returns the report."""

    def __init__(self, setting: Setting) -> None:
        continuous = Continuous(setting)
        self.rules: list[Rule] = [
            OnSurface(setting),
            TwoColor(setting),
            continuous,
            LevelSign(setting, continuous),
            SingularValue(setting, continuous),
            HoverThrust(setting, continuous),
            TiltRange(setting),
        ]
        self.reach = Reach(setting, continuous)

    def update(self, run: Segments) -> None:
        """Examine the next run of segments, in blocks so that memory stays bounded."""
        for start in range(0, len(run.alpha) - 1, _BLOCK):
            block = run[start : start + _BLOCK + 1]
            for rule in self.rules:
                rule.update(block)
            self.reach.update(block)

    def report(self, closed: Check) -> Report:
        """Return what was found; `closed` is the check of how the gait closes."""
        reachable, reachability = self.reach.answer()
        checks = (closed, *(check for rule in self.rules for check in rule.checks()))
        return Report(checks=checks, reachable_from_hover=reachable, reachability=reachability)


def checked_limits(tolerance: float, floor: float, angle_rounding: float | None) -> None:
    """Raise InputError unless the limits that a gait is judged by are finite and not negative."""
    for name, number in (("tolerance", tolerance), ("floor", floor), ("angle_rounding", angle_rounding)):
        if number is not None and not 0 <= number_of(number) < math.inf:
            raise InputError(f"{name} must be a finite number ≥ 0, got {shown(number)}")


def check_gait(
    gait: Gait,
    *,
    tolerance: float = DEFAULT_TOLERANCE,
    floor: float = DEFAULT_FLOOR,
    angle_rounding: float | None = None,
) -> Report:
    """Return every check of valid and flyable for a gait, and whether it can be reached from hover.

    Parameters
    ----------
    gait
        The gait; limits of its vehicle are checked where the vehicle states them. Rates need timing: see
        :meth:`gaitgraph.timing.timed_gait.TimedGait.check`.
    tolerance
        Largest |Rφ| and |Rθ| that count as on the surface, dimensionless; and how far from the sheet of its color
        a corner may lie [rad].
    floor
        Least singular value that a flyable gait must keep, dimensionless.
    angle_rounding
        Assumed error of each angle because it was printed or measured, e.g. 5e-4 for three decimals [rad]. By
        default it is inferred: the largest distance of α3 and α4 from the sheet of their color.

    Examples
    --------
    >>> from gaitgraph.gait.gait import lift
    >>> report = check_gait(lift([(0.4, -1.2), (0.4, -0.4), (1.2, -0.4)], "red"))
    >>> report.valid, report.flyable, report.reachable_from_hover
    (True, True, False)
    """
    checked_limits(tolerance, floor, angle_rounding)
    checker = Checker(
        Setting(
            vehicle=gait.vehicle,
            coefficients=gait.coefficients,
            tolerance=tolerance,
            floor=floor,
            angle_rounding=angle_rounding,
            crossing_tolerance=gait.crossing_tolerance,
        )
    )
    checker.update(segments_of(gait))
    return checker.report(
        Check(name="closed", kind="valid", ok=True, value=0.0, limit=0.0, message="closed by construction")
    )


class Timed(Protocol):
    """A gait with timing, as :class:`gaitgraph.timing.timed_gait.TimedGait` is."""

    @property
    def gait(self) -> Gait:
        """The closed polyline."""

    def rate_checks(self) -> tuple[Check, ...]:
        """Return the checks of tilt rates, accelerations and jerks."""


def _is_timed(gait: object) -> TypeGuard[Timed]:
    return hasattr(type(gait), "rate_checks")


def validate(
    gait: Gait | Timed | Table | Frame | str | Path,
    *,
    vehicle: Vehicle | None = None,
    coefficients: Kind | None = None,
    tolerance: float = DEFAULT_TOLERANCE,
    floor: float = DEFAULT_FLOOR,
    angle_rounding: float | None = None,
    crossing_tolerance: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> Report:
    """Return every check of a gait; with times, those of tilt rates and accelerations too.

    Parameters
    ----------
    gait
        A gait, a timed one, a table, a frame of pandas or polars, or the path of a gait file of any format that is
        read; a CSV or Parquet file may be larger than memory.
    vehicle, coefficients
        For tables and files: what the gait is for; by default what the table says, else the paper's vehicle.
    tolerance, floor, angle_rounding
        As for :func:`check_gait`; angles of a CSV file that are printed with three to eight
        decimals have an error of at least half a unit of the last one. Rows of a table without colors get the color of
        the sheet that they are within `tolerance` of, or else of the fibre.
    crossing_tolerance
        For tables and files: distance from a crossing line within which a plane type is `?` [rad]; π/32 by default.
    progress
        Called with the fraction of a file that was read.

    Returns
    -------
    Report
        Falsy when the gait is not valid; prints well; serialises by ``as_mapping``. For a table `where` holds the
        row, counted from 1, from which a segment starts, the fraction along it, the time and the tilt angles.

    Raises
    ------
    InputError, FileProblem
        If a value is not allowed, or a file cannot be read as a gait table.

    Notes
    -----
    Rates and accelerations of a table are the least that any motion through its rows must reach: slopes, and second
    divided differences; what the table states counts if it is larger. Not guaranteed: peaks between rows of a motion
    that is not straight there are not found.

    Examples
    --------
    >>> from gaitgraph.gait.gait import lift
    >>> report = validate(lift([(0.4, -0.4), (1.1, -1.1)], "blue"))
    >>> bool(report), report.flyable, report["R_sign"].decided, report.listing.count
    (True, False, False, 2)
    """
    if isinstance(gait, Gait) or _is_timed(gait):
        given = {"vehicle": vehicle, "coefficients": coefficients, "crossing_tolerance": crossing_tolerance}
        for name, value in given.items():
            if value is not None:
                raise InputError(f"{name} must be None beside a gait, which has its own, got {shown(value)}")
        bare, rates = (gait, ()) if isinstance(gait, Gait) else (gait.gait, gait.rate_checks())
        report = check_gait(bare, tolerance=tolerance, floor=floor, angle_rounding=angle_rounding).with_checks(rates)
        if (np.abs(bare.alpha[:, :2]) > math.pi / 2).any():
            return report  # colourings are of loops in [−π/2, π/2]²
        loop = colorings(bare.alpha, coefficients=bare.coefficients, crossing_tolerance=bare.crossing_tolerance)
        return replace(report, listing=loop.listing())
    gait = as_table(gait)
    checked_limits(tolerance, floor, angle_rounding)
    if crossing_tolerance is not None and not 0 <= number_of(crossing_tolerance) < math.inf:
        raise InputError(f"crossing_tolerance must be a finite number ≥ 0 (rad), got {shown(crossing_tolerance)}")
    if isinstance(gait, Table):
        pieces: Iterator[Table] = iter([gait])
    elif isinstance(gait, (str, Path)):
        pieces = read_pieces(gait, progress=progress)
    else:
        raise InputError(f"gait must be a gait, a timed gait, a table, a frame or a file's path, got {shown(gait)}")
    first = next(pieces)
    try:
        vehicle, numbers, stated = setting_of(first, vehicle, coefficients)
    except InputError as error:
        raise InputError(str(error) if isinstance(gait, Table) else f"gait file {str(gait)!r}: {error}") from error
    checker = _TableChecker(
        Setting(
            vehicle=vehicle,
            coefficients=numbers,
            tolerance=tolerance,
            floor=floor,
            angle_rounding=angle_rounding,
            digits=first.rounding,
            crossing_tolerance=stated if crossing_tolerance is None else float(crossing_tolerance),
            noun="row",
        )
    )
    if "transition" in first.about:
        checker.notes["transition"] = "this is a path from one place to another: the way back to row 1 is no part of it"
    checker.update(first)
    for piece in pieces:
        checker.update(piece)
    return checker.report()


class _TableChecker:
    """Judges a table piece by piece: finds the sheet of each row, applies the rules, and closes the table."""

    def __init__(self, setting: Setting) -> None:
        self.setting = setting
        self.checker = Checker(setting)
        self.rates = _RowRates(setting)
        self.chains = {sign: ColoringCount(sign) for sign in SIGNS}
        self.rows = 0
        self.longest = 0.0  # step between rows [rad]
        self.first: Segments | None = None
        self.last: Segments | None = None
        self.plane: list[FloatArray] = []
        self.notes: dict[str, str] = {}

    def update(self, piece: Table) -> None:
        """Examine the next rows."""
        fresh = self._rows_of(piece)
        run = fresh if self.last is None else self.last.joined(fresh)
        self.first = self.first or fresh[:1]
        if len(run.alpha) > 1:
            self.checker.update(run)
            self.longest = max(self.longest, float(np.abs(np.diff(run.alpha, axis=0)).max()))
            # The last row may turn out to be the first again, which is no point of its own.
            self._count_colorings(run.alpha[:-1, :2])
        if fresh.t is not None:
            self.rates.update(fresh, piece)
        self._compare(fresh, piece)
        self.rows += len(fresh.alpha)
        self.last = fresh[-1:]

    def _rows_of(self, piece: Table) -> Segments:
        """Return the rows of a piece with the sheet of their color, or on which they lie."""
        setting = self.setting
        sheet = family_codes(piece["color"]) if "color" in piece else np.zeros(len(piece), dtype=np.int8)
        alpha = tilt_angles(piece, setting.coefficients, rows_before=self.rows)
        if "color" not in piece:
            before = 0 if self.last is None else int(self.last.sheet[0])
            sheet = families_along(alpha, setting.coefficients, setting.tolerance, before=before)
        return Segments(alpha=alpha, sheet=sheet, first=self.rows, t=piece.columns.get("t"))

    def _count_colorings(self, plane: FloatArray) -> None:
        choices = color_choices(plane[:, 0], plane[:, 1], self.setting.coefficients, self.setting.crossing_tolerance)
        for sign, chain in self.chains.items():
            chain.add(choices[sign])
        if self.rows <= MOST_LISTED_ROWS:
            self.plane.append(plane)

    def _compare(self, fresh: Segments, piece: Table) -> None:
        """Note the first row whose stated types or R disagree with its angles."""
        if "types" in piece and "types" not in self.notes:
            texts = {text: types_from_text(text) for text in dict.fromkeys(piece["types"])}
            wrong = types_contradict(np.array([texts[text] for text in piece["types"]]), fresh.sheet)
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
        t = None if first.t is None or last.t is None else (float(first.t[0]), float(last.t[0]))
        if not repeated:
            closing = replace(last.joined(first), first=self.rows - 1, after=0)
            if t is not None:
                # The closing segment takes one mean step of time.
                end = closing_time(t[0], t[1], self.rows)
                closing = replace(closing, t=np.array([t[1], end]), after_t=t[0])
            self.checker.update(closing)
            self._count_colorings(last.alpha[:, :2])
        if repeated:
            message = "the last row is the first again"
        elif self.rows == 1:
            message = "a single row is a gait that is a point"
        elif near:
            message = f"the last row is the first again, to within {gap:.2g} rad"
        else:
            message = f"closed by a straight segment of {gap:.4g} rad from row {self.rows} back to row 1"
        if not repeated and gap > 3 * self.longest and self.rows > 2:
            self.notes["closed"] = (
                f"the segment from row {self.rows} back to row 1 is {gap:.4g} rad, the longest step between rows only "
                f"{self.longest:.4g}: is the end of the table missing?"
            )
        value, where = 0.0 if repeated else gap, last.place(0).as_mapping("row")
        report = self.checker.report(
            Check(name="closed", kind="valid", ok=True, value=value, where=where, message=message)
        )
        if t is not None:
            report = report.with_checks(self.rates.checks(closed=near))
            self.notes |= self.rates.notes
        return replace(report, notes=tuple(self.notes.values()), rows=self.rows, listing=self._listing())

    def _listing(self) -> ColoringListing:
        if self.rows > MOST_LISTED_ROWS:
            return listing_of(self.chains)
        setting, plane = self.setting, np.concatenate(self.plane)
        loop = colorings(plane, coefficients=setting.coefficients, crossing_tolerance=setting.crossing_tolerance)
        return loop.listing()


class _RowRates:
    """Rates, accelerations and jerks that a motion through rows with times must reach, or that the table states."""

    def __init__(self, setting: Setting) -> None:
        self.setting = setting
        self.peaks = (_Peak(), _Peak(), _Peak())  # of rate, acceleration and jerk
        self.notes: dict[str, str] = {}
        self._first: Segments | None = None  # the first three rows
        self._rows: Segments | None = None  # the last three rows so far
        self._moved, self._off = 0.0, 0.0
        self._stated: FloatArray | None = None  # the last row's rates

    def update(self, fresh: Segments, piece: Table) -> None:
        """Examine the next rows, and the rates and accelerations that they state."""
        rows = fresh if self._rows is None else self._rows.joined(fresh)
        self._differences(rows)
        for names, peak in ((RATES, self.peaks[0]), (ACCELERATIONS, self.peaks[1])):
            if all(name in piece for name in names):
                peak.update(np.column_stack([piece[name] for name in names]), fresh)
        if all(name in piece for name in RATES):
            self._compare(fresh, np.column_stack([piece[name] for name in RATES]))
        if self._first is None or len(self._first.alpha) < 3:
            self._first = rows[:3]
        self._rows = rows[-3:]

    def _differences(self, rows: Segments) -> None:
        """Examine divided differences: a smooth motion through n + 1 rows has their n-th one somewhere, over n!."""
        if len(rows.alpha) < 2 or rows.t is None:
            return
        step = np.diff(rows.t)[:, None]
        rate = np.diff(rows.alpha, axis=0) / step
        self.peaks[0].update(rate, rows)
        if len(rate) > 1:
            acceleration = 2 * np.diff(rate, axis=0) / (step[1:] + step[:-1])
            self.peaks[1].update(acceleration, rows[1:])
            if len(rate) > 2:
                self.peaks[2].update(3 * np.diff(acceleration, axis=0) / (step[2:] + step[1:-1] + step[:-2]), rows[1:])

    def _compare(self, fresh: Segments, stated: FloatArray) -> None:
        """Add up how far the stated rates are from the changes of the angles."""
        if self._rows is None or self._stated is None:
            rows, rates = fresh, stated
        else:
            rows, rates = self._rows[-1:].joined(fresh), np.concatenate([self._stated, stated])
        self._stated = stated[-1:]
        if len(rows.alpha) > 1 and rows.t is not None:
            moved = np.diff(rows.alpha, axis=0)
            expected = (rates[:-1] + rates[1:]) / 2 * np.diff(rows.t)[:, None]
            self._moved += float(np.abs(moved).sum() + np.abs(expected).sum())
            self._off += float(np.abs(moved - expected).sum())

    def checks(self, *, closed: bool) -> list[Check]:
        """Close the motion and return the checks of its rates and, where limited, accelerations and jerks."""
        first, rows, vehicle, period = self._first, self._rows, self.setting.vehicle, 0.0
        if first is not None and rows is not None and first.t is not None and rows.t is not None:
            period = float(rows.t[-1] - first.t[0])
            if len(rows.alpha) > 1:
                # Across the seam: from the last rows to the first ones, a period later.
                count = rows.first + len(rows.alpha)
                onward = first[1:] if closed else first
                later = period if closed else period + period / (count - 1)
                assert onward.t is not None  # noqa: S101
                self._differences(rows.joined(replace(onward, first=count, t=onward.t + later)))
        if self._off > 0.5 * self._moved > 0:
            self.notes["rates"] = (
                "the stated rates do not fit the rows: alpha1_rate to alpha4_rate must be in rad/s; the larger of both "
                "is judged"
            )
        out = []
        for order, ((kind, unit), peak) in enumerate(zip(RATE_UNITS.items(), self.peaks, strict=True), start=1):
            limit: float | None = getattr(vehicle, f"max_tilt_{kind}")
            if order > 1 and limit is None:
                continue
            needed = period * (peak.value / limit) ** (1 / order) if limit else period
            where = None if peak.place is None else peak.place.as_mapping("row")
            advice = "" if peak.place is None else f"at {peak.place.described('row')}"
            advice += f"; run over at least {needed:.4g} s instead of {period:.4g} s it would do"
            out.append(limit_check(f"tilt_{kind}", unit, peak.value, peak.joint, limit, where, advice))
        return out


class _Peak:
    """The largest size of a derivative of the four tilt angles, and where."""

    def __init__(self) -> None:
        self.value, self.joint = 0.0, 1
        self.place: Place | None = None

    def update(self, values: FloatArray, rows: Segments) -> None:
        """Examine values of shape (k, 4) that belong to the first k rows."""
        size = np.abs(values)
        k, joint = divmod(int(np.argmax(size)), 4)
        if size[k, joint] > self.value or self.place is None:
            self.value, self.joint, self.place = float(size[k, joint]), joint + 1, rows.place(k)
