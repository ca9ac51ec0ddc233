"""Is a gait valid, and can it fly? Every rule, the rates and the colourings of its loop, in one report.

The rows of a table are joined by straight segments, also the last with the first, and by cubics where it has rates and
accelerations; every check holds along them. If the rows sample a motion that the table states, that is judged too, and
the worse of each check counts.

Timing comes later in the import order, so a timed gait is recognised here by its `gait` and its `rate_checks`, which
follow from its law. Rates of a table follow from its rows.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import angles_from, checked_number, figure
from gaitgraph.errors import InputError, shown
from gaitgraph.gait.gait import Gait
from gaitgraph.gait.table import (
    ACCELERATIONS,
    ANGLES,
    RATES,
    Table,
    accelerations_of,
    closed_rows,
    closing_time,
    even_times,
    is_closed,
    lifted_rows,
    motion_of,
    note_on_ends,
    surface_of,
    wrong_types,
)
from gaitgraph.invertibility.geometry import IDLE_THRUST, LEAST_DECIDED, Geometry
from gaitgraph.invertibility.matrices import DEFAULT_FLOOR, level_determinant
from gaitgraph.io.formats import given_gait, naming_file, unchecked_table
from gaitgraph.surface.loop_colorings import (
    ColoringCount,
    color_choices,
    colorings,
    colorings_counted,
)
from gaitgraph.surface.sheets import DEFAULT_TOLERANCE, SIGNS, family_of
from gaitgraph.validation.physics import Checker
from gaitgraph.validation.report import (
    LIMITED,
    RATE_CHECKS,
    RATE_UNITS,
    Check,
    GaitPoint,
    Report,
    limit_check,
    lines_of_checks,
    not_judged_text,
)
from gaitgraph.validation.rules import Criteria, Peak, Segments, segments_of
from gaitgraph.validation.wrong_rows import LoneRows
from gaitgraph.vehicle import Vehicle, four_of, scale_of

if TYPE_CHECKING:
    from gaitgraph.invertibility.coefficients import CoefficientsLike
    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.io.formats import GaitLike
    from gaitgraph.vehicle import Each, VehicleLike

_PASSING = 2e-4  # of limits, by cubics through samples of a motion [rad, or a share]
_BESIDE_CUBIC = 1e-6  # largest distance of a cubic between rows from its chords [rad]
_MOST_PARTS = 1000  # of a cubic
_WORSE = dict.fromkeys((*RATE_CHECKS, "on_surface", "thrust_limit"), 1.0)
_WORSE |= dict.fromkeys(("least_singular_value", "hover_thrust"), -1.0)
_TIE = 1e-6  # share of a value by which another is no worse
_MOST_SHARE = 0.01  # of a rate's limit that the digits of angles may explain
_FLYABLE = {True: "yes", False: "no", None: "undecided"}

MOST_LISTED_ROWS = 10_000
"""Largest number of rows for which the colourings of a table are listed, not only counted."""


def check_gait(
    gait: Gait,
    *,
    tolerance: float = DEFAULT_TOLERANCE,
    floor: float = DEFAULT_FLOOR,
    angle_rounding: float | None = None,
    beside: float = 0.0,
    extremes: FloatArray | None = None,
) -> Report:
    """Return every check of valid and flyable for a gait, and whether hover can reach it.

    Parameters
    ----------
    gait
        The gait, checked against the limits that its vehicle states; limits of rates need timing.
    tolerance
        Largest |Rφ| and |Rθ| on the surface, dimensionless; also the largest distance of a corner from the sheet of its
        color [rad].
    floor
        Least singular value floor: a flyable gait keeps its least singular value above it, dimensionless.
    angle_rounding
        Error of each printed or measured angle, e.g. 5e-4 for three decimals [rad]. By default it is the largest
        distance of α3 and α4 from the sheet of their color: on the sheets, angles count as exact.
    beside, extremes
        For the chords of a curve: see :meth:`gaitgraph.timing.curve.Curve.check`.

    Examples
    --------
    >>> from gaitgraph.gait.gait import lift
    >>> report = check_gait(lift([(0.4, -1.2), (0.4, -0.4), (1.2, -0.4)], "red"))
    >>> report.valid, report.flyable, report.reachable_from_hover
    (True, True, False)
    """
    surface: Any = {
        name: getattr(gait, name)
        for name in ("vehicle", "coefficients", "crossing_tolerance")
    }
    limits: Any = {
        "tolerance": tolerance,
        "floor": floor,
        "angle_rounding": angle_rounding,
    }
    noun = "chord" if beside else "corner"
    checker = Checker(
        Criteria(**surface, **limits, noun=noun, beside=beside, extremes=extremes)
    )
    checker.update(segments_of(gait))
    closed = Check(
        name="closed",
        kind="valid",
        ok=True,
        value=0.0,
        limit=0.0,
        message="closed by construction",
    )
    return checker.report(closed)


def validate(
    gait: GaitLike,
    *,
    vehicle: VehicleLike | None = None,
    coefficients: CoefficientsLike | None = None,
    tolerance: float = DEFAULT_TOLERANCE,
    floor: float = DEFAULT_FLOOR,
    angle_rounding: float | None = None,
    crossing_tolerance: float | None = None,
) -> Report:
    """Return every check of a gait; with times also those of tilt rates and accelerations.

    Parameters
    ----------
    gait
        A gait in any form, see :func:`gaitgraph.io.formats.given_gait`. Of a table both its rows and the motion that
        it states are judged, see :mod:`gaitgraph.timing.statement`.
    vehicle, coefficients
        For tables and files; by default those that the table states, else the paper's vehicle.
    tolerance, floor, angle_rounding
        As for :func:`check_gait`. Rows without colors get the color of the sheet, or else of the fibre, within
        `tolerance` of which they lie.
    crossing_tolerance
        For tables and files: distance from a crossing line within which a plane type is `?` [rad]; π/32 by default.

    Returns
    -------
    Report
        False in a condition if the gait is not valid. For a table `where` holds the row, counted from 1, at which a
        segment starts, the fraction along it, the time and the tilt angles.

    Raises
    ------
    InputError, FileProblem
        If a value is wrong, or a file cannot be read as a gait table.

    Notes
    -----
    Rates and accelerations of a table are the least that any motion through its rows must reach: slopes, and second
    divided differences; stated ones count if they are larger. Higher peaks between rows are not found. Cubics are
    judged by chords at most 1e-6 rad beside them.

    Examples
    --------
    >>> from gaitgraph.gait.gait import lift
    >>> report = validate(lift([(0.4, -0.4), (1.1, -1.1)], "blue"))
    >>> bool(report), report.flyable, report["R_sign"].decided, report.listing.count
    (True, False, False, 2)
    """
    choices: Any = {
        "vehicle": vehicle,
        "coefficients": coefficients,
        "crossing_tolerance": crossing_tolerance,
    }
    source = given_gait(gait, **choices)
    limits: Any = {
        "tolerance": tolerance,
        "floor": floor,
        "angle_rounding": angle_rounding,
    }
    if not getattr(source, "repeats", True) and not isinstance(source, Table):
        path: Any = source  # colourings are of loops
        judged: Report = path.check(**limits)
        return judged
    if not isinstance(source, Table):
        bare = source if isinstance(source, Gait) else source.gait
        report = check_gait(bare, **limits)
        if bare is not source:
            report = report.with_timing(source)
        if (np.abs(bare.alpha[:, :2]) > math.pi / 2).any():
            return report  # colourings are of loops in [−π/2, π/2]²
        loop = colorings(
            bare.alpha,
            coefficients=bare.coefficients,
            crossing_tolerance=bare.crossing_tolerance,
        )
        return replace(report, listing=loop)
    with naming_file(gait):
        report = _report_of_rows(
            source, vehicle, coefficients, crossing_tolerance, limits
        )
        motion = motion_of(source, vehicle, coefficients)
        if motion is not None:
            if crossing_tolerance is not None:
                judged = replace(motion.gait, crossing_tolerance=crossing_tolerance)
                motion = motion.with_gait(judged)
            report = both(_report_of_motion(source, motion, limits), report)
        elif "t" not in source and {"period", "law"} <= source.about.keys():
            # A saved plan: corners, with the timing of its request.
            corners, _ = closed_rows(source, vehicle=vehicle, coefficients=coefficients)
            timed = corners.merged().parametrize(
                source.about["period"], law=source.about["law"]
            )
            report = report.with_timing(timed)
    return replace(report, said=source.notes)


def _report_of_rows(
    table: Table,
    vehicle: VehicleLike | None,
    coefficients: CoefficientsLike | None,
    crossing_tolerance: float | None,
    limits: dict[str, Any],
) -> Report:
    """Return every check of a table's rows, joined straight, and by cubics where its rates and accelerations say so."""
    vehicle, numbers, stated = surface_of(table, vehicle, coefficients)
    criteria = Criteria(
        vehicle=vehicle,
        coefficients=numbers,
        crossing_tolerance=stated if crossing_tolerance is None else crossing_tolerance,
        noun="row",
        **limits,
    )
    checker = _TableChecker(criteria, table.repeats, table.limits)
    alpha, sheet = lifted_rows(table, numbers, criteria.tolerance)
    checker.update(table, alpha, sheet)
    report = checker.report()
    cubics = _along_cubics(table, alpha, sheet)
    if cubics is None:
        return report
    if table.motion is not None:  # it keeps the limits, and the cubics are nearly it
        criteria = replace(criteria, passing=_PASSING)
    along = Checker(criteria)
    along.update(cubics)
    worse = both(along.report(report["closed"]), report)
    return replace(worse, reachability=report.reachability)


def _report_of_motion(table: Table, motion: Any, limits: dict[str, Any]) -> Report:
    """Return every check of the motion that a table samples, under the limits that the table was made for too."""
    vehicle = motion.gait.vehicle
    made_for: Any = {
        f"max_tilt_{kind}": limit
        for kind, limit in table.limits.items()
        if getattr(vehicle, f"max_tilt_{kind}") is None
    }
    limited = replace(motion.gait, vehicle=vehicle.replace(**made_for))
    report: Report = motion.with_gait(limited).check(**limits)
    return report


def both(first: Report, second: Report) -> Report:
    """Return the report of a gait of which two readings must hold; of each check the worse one, else the first.

    Closing, rows, colourings and notes are those of the second, power and thrusts in hover are those of the first.
    """
    checks = []
    others = {check.name: check for check in second.checks}
    for check in first.checks:
        other = others.pop(check.name, check)
        holds, other_holds = (one.ok and one.decided for one in (check, other))
        is_worse = holds and not other_holds
        if holds and other_holds and check.name in _WORSE:
            excess = (other.value or 0.0) - (check.value or 0.0)
            is_worse = _WORSE[check.name] * excess > _TIE * abs(check.value or 0.0)
        checks.append(other if is_worse or check.name == "closed" else check)
    reach = first
    if first.reachable_from_hover and not second.reachable_from_hover:
        reach = second
    return replace(
        second,
        checks=(*checks, *others.values()),
        reachable_from_hover=reach.reachable_from_hover,
        reachability=reach.reachability,
        hover_power=None if second.hover_power is None else first.hover_power,
        hover_power_over=first.hover_power_over,
        hover_thrusts=None if second.hover_thrusts is None else first.hover_thrusts,
    )


def _along_cubics(
    table: Table, alpha: FloatArray, sheet: npt.NDArray[np.int8]
) -> Segments | None:
    """Return chords of the cubics through a table's rows and rates, at most 1e-6 rad beside them; None if not needed.

    A cubic's second derivative is linear, so a chord of a share 1/m of it is off by at most max|f″|/(8m²). Of one that
    stays between the ends of its segment, as its Bernstein coefficients along it tell, only the part across leaves it.
    """
    if not table.joined_by_cubics:
        return None
    t = table["t"]
    width = np.diff(t)[:, None]
    rates = np.column_stack([table[name] for name in RATES])
    step, first, last = np.diff(alpha, axis=0), width * rates[:-1], width * rates[1:]
    square, cube = 3 * step - 2 * first - last, first + last - 2 * step
    length = np.linalg.norm(step, axis=1)
    unit = step / np.maximum(length, 1e-300)[:, None]
    is_straight = np.ones(len(step), dtype=bool)
    for end in (first, last):
        along = (end * unit).sum(axis=1)
        beyond = np.maximum(-along, along - 3 * length) / 3
        is_straight &= beyond <= _BESIDE_CUBIC
    bend = np.zeros(len(step))
    for second in (2 * square, 2 * square + 6 * cube):
        bend = np.maximum(bend, np.linalg.norm(second, axis=1))
        across = second - (second * unit).sum(axis=1, keepdims=True) * unit
        is_straight &= np.linalg.norm(across, axis=1) <= 8 * _BESIDE_CUBIC
    parts = np.ceil(np.sqrt(bend / (8 * _BESIDE_CUBIC))).astype(np.int64)
    parts = np.where(is_straight, 1, np.clip(parts, 1, _MOST_PARTS))
    if parts.max(initial=1) == 1:
        return None
    row = np.repeat(np.arange(len(step)), parts)
    within = np.concatenate([np.arange(count) / count for count in parts.tolist()])
    x = within[:, None]
    points = alpha[row] + x * (first[row] + x * (square[row] + x * cube[row]))
    row = np.append(row, len(step))
    return Segments(
        alpha=np.vstack([points, alpha[-1:]]),
        sheet=sheet[row],
        number=row + 1,
        t=np.append(t[row[:-1]] + within * width[row[:-1], 0], t[-1]),
        within=np.append(within, 0.0),
    )


class _TableChecker:
    """Checks the rows of a table: finds the sheet of each row, applies the rules, and closes the table."""

    def __init__(
        self,
        criteria: Criteria,
        repeats: bool,
        limits: dict[str, Each],
    ) -> None:
        self.lone = LoneRows()
        self.criteria, self.repeats = criteria, repeats
        self.checker = Checker(criteria, self.lone)
        self.rates = _RowRates(criteria.vehicle, limits)
        self.counts = {sign: ColoringCount(sign) for sign in SIGNS}
        self.rows = 0
        self.longest = 0.0  # step between rows [rad]
        self.head: Segments | None = None  # the first three rows
        self.tail: Segments | None = None  # the last three rows so far
        self.plane: list[FloatArray] = []
        self.is_beyond = False  # whether a row is outside [−π/2, π/2]², where no colouring is defined
        self.notes: dict[str, str] = {}

    def update(
        self, piece: Table, alpha: FloatArray, sheet: npt.NDArray[np.int8]
    ) -> None:
        """Examine the next rows, their tilt angles and families."""
        number = self.rows + 1 + np.arange(len(alpha))
        fresh = Segments(
            alpha=alpha, sheet=sheet, number=number, t=piece.columns.get("t")
        )
        rows = fresh if self.tail is None else self.tail.joined(fresh)
        joined = rows[-len(alpha) - 1 :]
        if len(joined.alpha) > 1:
            self.checker.update(joined)
            self.longest = max(
                self.longest, float(np.abs(np.diff(joined.alpha, axis=0)).max())
            )
            # The last row may repeat the first; then it is not a new point.
            self._count_colorings(joined.alpha[:-1, :2])
        if fresh.t is not None:
            self.rates.examine(piece, fresh)
        self.lone.update(alpha)
        self._compare(fresh, piece)
        self.rows += len(alpha)
        self.head = (
            rows[:3] if self.head is None or len(self.head.alpha) < 3 else self.head
        )
        self.tail = rows[-3:]

    def _count_colorings(self, plane: FloatArray) -> None:
        self.is_beyond |= bool((np.abs(plane) > math.pi / 2).any())
        choices = color_choices(
            plane[:, 0],
            plane[:, 1],
            self.criteria.coefficients,
            self.criteria.crossing_tolerance,
        )
        for sign, count_of_sign in self.counts.items():
            count_of_sign.add(choices[sign])
        if self.rows <= MOST_LISTED_ROWS:
            self.plane.append(plane)

    def _compare(self, fresh: Segments, piece: Table) -> None:
        """Note the first row whose stated types or R disagree with its angles."""
        if "types" in piece and "types" not in self.notes:
            wrong = wrong_types(piece, fresh.sheet)
            if wrong.any():
                k = int(np.argmax(wrong))
                self.notes["types"] = (
                    f"row {fresh.number[k]} states the types {piece['types'][k]}, but it is "
                    f"{family_of(fresh.sheet[k])}; stated types are not used"
                )
        if "R" in piece and "R" not in self.notes:
            determinant = partial(
                level_determinant, coefficients=self.criteria.coefficients
            )
            computed = np.asarray(determinant(fresh.alpha))
            off = np.abs(piece["R"] - computed) - 1e-2 * np.maximum(1, np.abs(computed))
            doubted = np.flatnonzero(off > 0)
            for joint, name in enumerate(ANGLES):
                # What the digits of the angles explain.
                moved = fresh.alpha[doubted]
                moved[:, joint] += piece.half_units(name)[doubted]
                off[doubted] -= 1.1 * np.abs(determinant(moved) - computed[doubted])
            if (off > 0).any():
                k = int(np.argmax(off > 0))
                self.notes["R"] = (
                    f"row {fresh.number[k]} states R = {piece['R'][k]:.4g}, but R is {computed[k]:.4g} there "
                    f"({self.criteria.coefficients.kind} coefficients); stated values are not used"
                )

    def report(self) -> Report:
        """Close the table, unless it is a path that is run once, and return what was found."""
        head, tail = self.head, self.tail
        assert head is not None and tail is not None  # noqa: PT018, S101 - pieces have rows
        first, last = head[:1], tail[-1:]
        gap = float(np.abs(last.alpha[0] - first.alpha[0]).max())
        ends = np.vstack([first.alpha, tail.alpha])
        near = self.rows > 1 and is_closed(ends)
        # A last row of another color is a new point, with a segment to the first and no step in time.
        repeated = near and last.sheet[0] == first.sheet[0]
        is_path = not self.repeats and self.rows > 1
        if is_path:
            self.lone.finish(last.alpha, self.rows)
        else:
            self.lone.finish(head.alpha[1 if near else 0 :], self.rows - near)
        if not repeated and not is_path:
            self._close(first, last)
        message = f"not closed: the segment of {gap:.4g} rad from row {self.rows} back to row 1 is judged too"
        if is_path:
            message = f"run once, from row 1 to row {self.rows}: no segment leads back"
        elif near:
            message = "the last row repeats the first"
            message += (
                ""
                if first.t is None or last.t is None
                else f", T = {float(last.t[0] - first.t[0]):g} s"
            )
        elif self.rows == 1:
            message = "the gait is a single point"
        if gap == self.longest == 0:
            self.notes["posture"] = (
                "the table is a single posture, not a gait: its rows are all equal"
            )
        if self.repeats and self.rows > 1 and (note := note_on_ends(ends)):
            self.notes["ends"] = note
        if not repeated and not is_path and gap > 3 * self.longest:
            self.notes["closed"] = (
                f"the closing segment from row {self.rows} to row 1 is {gap:.4g} rad long, the longest step between "
                f"rows {self.longest:.4g} rad: is the end of the table missing? Or is it a path that is run once?"
            )
        value, where = (
            0.0 if repeated or is_path else gap,
            last.place(0).as_mapping("row"),
        )
        closed = Check(
            name="closed",
            kind="valid",
            ok=True,
            value=value,
            where=where,
            message=message,
        )
        report = self.checker.report(closed).with_checks(self._rates(first, last))
        if self.is_beyond or is_path:  # colourings are of loops
            listing = None
        elif self.rows > MOST_LISTED_ROWS:
            listing = colorings_counted(self.counts)
        else:
            of, crossing = self.criteria.coefficients, self.criteria.crossing_tolerance
            listing = colorings(
                np.concatenate(self.plane), coefficients=of, crossing_tolerance=crossing
            )
        return replace(
            report,
            notes=(*report.notes, *self.notes.values()),
            rows=self.rows,
            listing=listing,
            repeats=not is_path,
        )

    def _close(self, first: Segments, last: Segments) -> None:
        """Examine the segment from the last row back to the first."""
        closing = last.joined(first)
        if first.t is not None and last.t is not None:
            # The closing segment takes one mean step of time.
            start, end = float(first.t[0]), float(last.t[0])
            closing = replace(
                closing,
                t=np.array([end, closing_time(start, end, self.rows)]),
                first_t=start,
            )
        self.checker.update(closing)
        self._count_colorings(last.alpha[:, :2])

    def _rates(self, first: Segments, last: Segments) -> list[Check]:
        """Return the checks of rates of a table with times, and note a lone row that no check names."""
        rates: list[Check] = []
        if first.t is not None and last.t is not None:
            rates = self.rates.checks(float(last.t[0] - first.t[0]), self.lone)
        if self.lone.note and not self.checker.broken_by_lone_rows(rates):
            self.notes["lone"] = self.lone.note
        return self.checker.rates_with_causes(rates)


class _RowRates:
    """Rates, accelerations and jerks that a motion through timed rows must reach, or that the table states.

    Times that are even to their digits count as even. Angles count as they stand, but for a table that states to be the
    samples of a motion: what the rounding of its angles explains does not count, of rates at most 1 % of the limit. What
    the steps of servos explain does not count at all.
    """

    def __init__(self, vehicle: Vehicle, made_for: dict[str, Each]) -> None:
        """Take the limits of the vehicle, and where it states none those that the table was made for."""
        stated = {kind: getattr(vehicle, f"max_tilt_{kind}") for kind in RATE_UNITS}
        self.limits = [
            made_for.get(kind) if limit is None else limit
            for kind, limit in stated.items()
        ]
        self.peaks = [Peak(scale=scale_of(limit)) for limit in self.limits]
        # Slopes of the rows as they count, and those that the rounding of angles leaves no doubt of.
        self.slopes, self.least_slopes = np.zeros(4), np.zeros(4)

    def examine(self, table: Table, rows: Segments) -> None:
        """Examine the rows of a table, from the first to the last, and over the seam of a motion that repeats."""
        alpha, t = rows.alpha, even_times(table)
        rounding = np.full_like(alpha, table.rounding)
        if "samples" in table.about:
            digits = np.column_stack([table.half_units(name) for name in ANGLES])
            rounding = np.maximum(rounding, digits)
        if table.repeats and len(alpha) > 1:
            # On to the first rows, a period later; the last row of a closed table is the first again.
            closed = is_closed(alpha)
            onward = slice(1, 3) if closed else slice(0, 3)
            period = t[-1] - t[0]
            later = period if closed else closing_time(0.0, period, len(t))
            alpha = np.vstack([alpha, alpha[onward]])
            t = np.append(t, t[onward] + later)
            rounding = np.vstack([rounding, rounding[onward]])
        most = np.full(4, np.inf)  # servos step as they do
        if not table.rounding:
            limits = [limit or 0.0 for limit in four_of(self.limits[0])]
            most = _MOST_SHARE * np.array(limits)
        self._differences(alpha, t, rounding, most, rows)
        for names, peak in zip((RATES, ACCELERATIONS), self.peaks, strict=False):
            # Rates beside rounded rows are slopes of these.
            if all(name in table for name in names) and not table.rounding:
                stated = np.column_stack([table[name] for name in names])
                digits = np.column_stack([table.half_units(name) for name in names])
                peak.update(np.maximum(np.abs(stated) - digits, 0.0), rows)
        has_rates_alone = ACCELERATIONS[0] not in table and table.joined_by_cubics
        if has_rates_alone and not table.rounding:
            digits = np.column_stack([table.half_units(name) for name in RATES])
            explained = digits / np.diff(t).min()  # of slopes over two steps
            size = np.abs(accelerations_of(table)) - explained
            self.peaks[1].update(np.maximum(size, 0.0), rows)

    def _differences(
        self,
        values: FloatArray,
        t: FloatArray,
        rounding: FloatArray,
        most: FloatArray,
        rows: Segments,
    ) -> None:
        """Examine divided differences of the angles, less what the rounding of each explains, of rates at most `most`.

        A smooth motion through n + 1 rows has an n-th derivative of n! times their divided difference somewhere.
        """
        # A difference of more than two rows belongs to the second of them; behind the last row comes the first again.
        inner = replace(rows[1:].joined(rows[:1]), first_t=float(t[0]))
        count = len(rows.alpha) - is_closed(rows.alpha)
        for order, peak in enumerate(self.peaks, start=1):
            if len(values) < 2:
                return
            width = (t[order:] - t[:-order])[:, None] / order
            values = np.diff(values, axis=0) / width
            rounding = (rounding[1:] + rounding[:-1]) / width
            explained = rounding
            if order == 1:
                explained = np.minimum(rounding, most)
                self.slopes = (np.abs(values) - explained).max(axis=0)
                self.least_slopes = (np.abs(values) - rounding).max(axis=0)
            size = np.maximum(np.abs(values) - explained, 0.0)
            peak.update(size[:count], rows if order == 1 else inner)

    def checks(self, period: float, lone: LoneRows) -> list[Check]:
        """Return the checks of rates, accelerations and, where limited, jerks; `lone` are wrong rows."""
        out = []
        for order, (kind, peak) in enumerate(
            zip(RATE_UNITS, self.peaks, strict=True), start=1
        ):
            limit = four_of(self.limits[order - 1])[peak.joint - 1]
            if order > 2 and limit is None:
                continue
            needed = period * (peak.value / limit) ** (1 / order) if limit else period
            advice = f"take at least {needed:.4g} s instead of {period:.4g} s"
            joint = peak.joint - 1
            if peak.place is not None and lone.is_near(peak.place.point + 1):
                advice = lone.note
            elif (
                order == 1
                and limit
                and self.least_slopes[joint] <= limit < self.slopes[joint]
            ):
                advice = "a slope between rounded angles: write them with more decimals"
            out.append(
                limit_check(
                    f"tilt_{kind}", peak.value, peak.joint, limit, advice, peak.place
                )
            )
        return out


# -- Rotors of any geometry


@dataclass(frozen=True, slots=True, kw_only=True)
class GeometryReport:
    """The checks of a tilt table of `rows` rows on a geometry; true in a condition if it can fly."""

    checks: tuple[Check, ...]
    rows: int

    @property
    def flyable(self) -> bool | None:
        """Whether every check holds; None if those that do not are undecided."""
        broken = [check.decided for check in self.checks if not check.ok]
        return None if broken and not any(broken) else not broken

    @property
    def not_judged(self) -> tuple[str, ...]:
        """The conditions of flyable that were not judged: a geometry states tilt ranges, and no other limits."""
        judged = {check.name for check in self.checks}
        return tuple(name for name in LIMITED if name not in judged)

    def __bool__(self) -> bool:
        return bool(self.flyable)

    def as_mapping(self) -> dict[str, Any]:
        """Return plain values, ready for JSON: those of a Report, None where a rule does not apply."""
        names = (
            "valid",
            "two_color",
            "reachable_from_hover",
            "colorings",
            "colorings_count",
            "hover_power",
        )
        checks = [check.as_mapping() for check in self.checks]
        return {
            **dict.fromkeys(names),
            "flyable": self.flyable,
            "not_judged": list(self.not_judged),
            "checks": checks,
            "warnings": [],
            "rows": self.rows,
        }

    def __repr__(self) -> str:
        verdict = _FLYABLE[self.flyable]
        return f"<GeometryReport: flyable {verdict}, {len(self.checks)} checks of {self.rows} rows>"

    def __str__(self) -> str:
        verdict = f"Flyable: {_FLYABLE[self.flyable]}. The paper's rules do not apply to this geometry."
        verdict = f"{verdict} {not_judged_text(self.not_judged)}".rstrip()
        return "\n".join([verdict, *lines_of_checks(self.checks)])


def _check_no_limits(vehicle: Vehicle) -> None:
    """Raise InputError if a vehicle states a limit that is not judged for rotors of any geometry."""
    for field in ("max_thrust", *(f"max_tilt_{kind}" for kind in RATE_UNITS)):
        stated = getattr(vehicle, field)
        if stated is not None:
            raise InputError(
                f"{field} must be omitted for rotors that no half turn maps to each other, since it is not judged, got "
                f"{shown(stated)}",
                field=field,
            )


def validate_geometry(
    table: str | Path | npt.ArrayLike,
    geometry: Geometry | Vehicle,
    *,
    floor: float = DEFAULT_FLOOR,
) -> GeometryReport:
    """Return whether rotors of any geometry can fly a tilt table, proven along the straight segments between its rows.

    Parameters
    ----------
    table
        A gait file with a column alpha1 … alphaN for each rotor that tilts (or with _deg), or an (n, N) array [rad].
        The last row is joined with the first.
    geometry
        The rotors; of a vehicle its tilt ranges count, and other limits are refused, since they are not judged.
    floor
        Least singular value floor of the level matrix, dimensionless.

    Returns
    -------
    GeometryReport
        With the checks `least_singular_value`, `hover_thrust`, unless the matrix is nearly singular, and
        `tilt_range`, if there are ranges.

    Raises
    ------
    InputError, FileProblem
        If no rotor tilts, a value is wrong, or a file cannot be read.

    Examples
    --------
    >>> from gaitgraph.invertibility.geometry import Geometry
    >>> from gaitgraph.vehicle import PAPER
    >>> report = validate_geometry([[0, 0, 0, 0], [-0.3, 0.3, -0.3, 0.3]], Geometry.of_vehicle(PAPER))
    >>> report.flyable, round(report.checks[0].value, 4)
    (True, 0.3373)
    """
    if isinstance(geometry, Vehicle):
        _check_no_limits(geometry)
        geometry = Geometry.of_vehicle(geometry)
    tilts = np.asarray(geometry.tilt_axis.any(axis=1))
    angles = tuple(f"alpha{k + 1}" for k in np.flatnonzero(tilts))
    if not angles:
        raise InputError(
            "tilt_axis must be other than zero for at least one rotor, got none that tilts"
        )
    floor = checked_number("floor", floor)
    if isinstance(table, (str, Path)):
        rows = unchecked_table(table, angles=angles)
        alpha = np.zeros((len(rows), len(tilts)))
        alpha[:, tilts] = np.column_stack([rows[name] for name in angles])
    else:
        alpha = np.atleast_2d(angles_from(table, "table"))
        if alpha.shape[1:] != tilts.shape:
            raise InputError(
                f"table must be angles of shape (n, {len(tilts)}), got shape {alpha.shape}"
            )
    starts = alpha[:-1] if is_closed(alpha) else alpha
    ends = np.roll(starts, -1, axis=0)

    def check(
        name: str,
        ok: bool,
        found: str,
        advice: str,
        segment: int,
        fraction: float,
        **numbers: Any,
    ) -> Check:
        if fraction == 1.0:
            segment, fraction = (segment + 1) % len(starts), 0.0
        at = tuple((starts[segment] + fraction * (ends - starts)[segment]).tolist())
        place = GaitPoint(point=segment, fraction=fraction, alpha=at)
        message = found if ok else f"{found} at {place.described('row')}: {advice}"
        return Check(
            name=name,
            kind="flyable",
            ok=ok,
            message=message,
            where=place.as_mapping("row"),
            **numbers,
        )

    lower, upper, segment, fraction = geometry.least_singular_value_along(
        starts, ends
    ).worst()
    if lower < floor <= upper:
        lower, upper, segment, fraction = geometry.least_singular_value_along(
            starts, ends, tolerance=1e-6
        ).worst()
    proven = math.floor(1e4 * lower) / 1e4
    found = f"least singular value {figure(upper)} (proven lower bound {proven:g}, floor {floor:g})"
    ok, advice = (
        lower >= floor,
        "the thrusts alone cannot make every moment and the vertical force there",
    )
    checks = [
        check(
            "least_singular_value",
            ok,
            found,
            advice,
            segment,
            fraction,
            value=upper,
            limit=floor,
        )
    ]
    if lower >= LEAST_DECIDED:
        lower, upper, segment, fraction = geometry.least_hover_thrust_along(
            starts, ends
        ).worst()
        found, advice = (
            f"least hover thrust {figure(upper)} of m·g",
            "a rotor would have to idle or to push down",
        )
        if not (decided := lower > 0 or upper < IDLE_THRUST):
            advice = "undecided between rows, more rows may decide it"
        numbers = {"value": upper, "limit": 0.0, "decided": decided}
        checks.append(
            check(
                "hover_thrust", lower > 0, found, advice, segment, fraction, **numbers
            )
        )
    beyond = np.maximum(
        geometry.tilt_range[:, 0] - starts, starts - geometry.tilt_range[:, 1]
    )
    row, rotor = np.unravel_index(np.argmax(beyond), beyond.shape)
    low, high = np.degrees(geometry.tilt_range[rotor])
    found = f"α{rotor + 1} = {math.degrees(starts[row, rotor]):.4g}°, range {low:.4g}° to {high:.4g}°"
    if math.isfinite(beyond.max()):
        ok, advice = bool(beyond.max() <= 1e-12), "beyond the range of its servo"
        checks.append(
            check(
                "tilt_range",
                ok,
                found,
                advice,
                int(row),
                0.0,
                value=float(starts[row, rotor]),
            )
        )
    return GeometryReport(checks=tuple(checks), rows=len(alpha))
