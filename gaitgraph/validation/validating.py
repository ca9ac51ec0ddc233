"""Is a gait valid, and can it fly? Every rule, the rates and the colourings of its loop, in one report.

A table is checked piece by piece. Its rows are joined by straight segments, also the last with the first, and every
check holds along the segments.

Timing comes later in the import order, so a timed gait is recognised here by its `gait` and its `rate_checks`, which
follow from its law. Rates of a table follow from its rows.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import angles_from, checked_number, figure
from gaitgraph.errors import InputError
from gaitgraph.files import reading, value_from_json
from gaitgraph.gait.gait import Gait
from gaitgraph.gait.table import (
    ACCELERATIONS,
    OTHER_ROWS,
    RATES,
    Table,
    closed_rows,
    closing_time,
    is_closed,
    lies_on,
    lifted_pieces,
    note_on_ends,
    row_texts,
    stated_gait,
    surface_of,
    takes_the_period,
    wrong_types,
)
from gaitgraph.invertibility.geometry import IDLE_THRUST, LEAST_DECIDED
from gaitgraph.invertibility.matrices import (
    DEFAULT_FLOOR,
    FloatArray,
    level_determinant,
)
from gaitgraph.io.formats import given_gait, naming_file, read_pieces
from gaitgraph.surface.loop_colorings import (
    ColoringCount,
    color_choices,
    colorings,
    colorings_counted,
)
from gaitgraph.surface.sheets import DEFAULT_TOLERANCE, SIGNS, family_of
from gaitgraph.validation.physics import Checker
from gaitgraph.validation.report import (
    RATE_CHECKS,
    RATE_UNITS,
    Check,
    GaitPoint,
    Report,
    limit_check,
    lines_of_checks,
)
from gaitgraph.validation.rules import Criteria, Peak, Segments, segments_of
from gaitgraph.validation.wrong_rows import LoneRows
from gaitgraph.vehicle import four_of, scale_of

if TYPE_CHECKING:
    from gaitgraph.invertibility.geometry import Geometry
    from gaitgraph.invertibility.matrices import CoefficientsLike
    from gaitgraph.io.formats import GaitLike
    from gaitgraph.vehicle import Each, Vehicle, VehicleLike

_FLYABLE = {True: "yes", False: "no", None: "undecided"}
_MORE = 1.0 + 1e-6

CERTIFICATE = ".cert.json"
"""The suffix of the certificate of a gait file, beside it."""

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
        A gait in any form, see :func:`gaitgraph.io.formats.given_gait`; a CSV or Parquet file may be larger than
        memory. A table that states corners, law and period is judged as that timed gait, as long as its rows lie on it.
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
    divided differences; stated ones count if they are larger. Higher peaks between rows are not found.

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
    source = given_gait(gait, whole=False, **choices)
    limits: Any = {
        "tolerance": tolerance,
        "floor": floor,
        "angle_rounding": angle_rounding,
    }
    if not isinstance(source, (Table, Path)):
        bare, rates = (
            (source, ())
            if isinstance(source, Gait)
            else (source.gait, source.rate_checks())
        )
        report = check_gait(bare, **limits).with_checks(rates)
        if (np.abs(bare.alpha[:, :2]) > math.pi / 2).any():
            return report  # colourings are of loops in [−π/2, π/2]²
        loop = colorings(
            bare.alpha,
            coefficients=bare.coefficients,
            crossing_tolerance=bare.crossing_tolerance,
        )
        return replace(report, listing=loop)
    from hashlib import sha256

    pieces = iter([source]) if isinstance(source, Table) else read_pieces(source)
    first = next(pieces)
    with naming_file(source):
        vehicle, numbers, stated = surface_of(first, vehicle, coefficients)
        crossing = stated if crossing_tolerance is None else crossing_tolerance
        timed = stated_gait(first, vehicle, numbers, crossing)
    surface: Any = {
        "vehicle": vehicle,
        "coefficients": numbers,
        "crossing_tolerance": crossing,
    }
    checker = _TableChecker(
        Criteria(**surface, **limits, noun="row"),
        first.repeats,
        first.limits,
        first.rounding,
    )
    beside = (
        source.with_suffix(CERTIFICATE)
        if isinstance(source, Path) and source.suffix
        else Path()
    )
    has_certificate, digest = beside.is_file(), sha256()
    holds = True
    for piece, alpha, sheet in lifted_pieces(
        chain([first], pieces), numbers, tolerance
    ):
        checker.update(piece, alpha, sheet)
        if has_certificate:
            digest.update(row_texts(piece))
        holds = holds and timed is not None and lies_on(timed, piece, first["t"][0])
    if has_certificate and (why := _why_another(beside, digest.hexdigest(), vehicle)):
        checker.notes["certificate"] = f"the certificate {beside.name!r} {why}"
    found = checker.report()
    if timed is None:
        timing: list[Any] = [first.about.get(name) for name in ("period", "law")]
        if (
            "t" in first
            or "corners" in first.about
            or None in timing
            or checker.rows > len(first)
        ):
            return found
        with naming_file(
            source
        ):  # a saved plan: corners, with the timing of its request
            closed = closed_rows(first, vehicle=vehicle, coefficients=numbers)[
                0
            ].merged()
            return found.with_checks(
                closed.parametrize(timing[0], law=timing[1]).rate_checks()
            )
    start, end = float(first["t"][0]), float(piece["t"][-1])
    if not holds or not takes_the_period(
        timed, start, end, checker.rows, first.digit_error
    ):
        return replace(found, notes=(*found.notes, OTHER_ROWS))
    made_for: Any = {
        f"max_tilt_{kind}": limit
        for kind, limit in first.limits.items()
        if getattr(vehicle, f"max_tilt_{kind}") is None
    }
    limited = replace(timed.gait, vehicle=vehicle.replace(**made_for))
    exact = validate(timed.with_gait(limited), **limits)
    # Closing and colourings are those of the rows; rates that the rows state count where they are larger.
    checks = []
    for check in exact.checks:
        of_rows = found[check.name]
        larger = check.name in RATE_CHECKS and (of_rows.value or 0.0) > _MORE * (
            check.value or 0.0
        )
        checks.append(of_rows if larger or check.name == "closed" else check)
    return replace(
        exact,
        checks=tuple(checks),
        notes=found.notes,
        rows=found.rows,
        listing=found.listing,
    )


def _why_another(path: Path, digest: str, vehicle: Vehicle) -> str:
    """Return why a file is not the certificate of rows with a digest and of a vehicle, or an empty text if it is."""

    def value(name: str) -> float:
        top, _, under = stated[name].partition("/")
        return float(top) / float(under or 1)

    with reading(path, "certificate"):
        content = path.read_bytes()
    try:
        document = value_from_json(content, "gaitgraph certify writes one")
        stated, of_rows = document["vehicle"], document["digest"] == digest
        sign = 1 if stated["first_rotor_spin"] == "clockwise" else -1
        kappa = (
            sign
            * value("drag_coefficient")
            / (value("thrust_coefficient") * value("arm_length"))
        )
        ratios = kappa, value("rotor_height") / value("arm_length")
    except (
        InputError,
        ArithmeticError,
        AttributeError,
        LookupError,
        TypeError,
        ValueError,
    ):
        return f"is no certificate; gaitgraph verify {path.name} says why"
    if not of_rows:
        return "does not belong to these rows"
    same = np.allclose(
        ratios, (vehicle.signed_drag_ratio, vehicle.height_ratio), rtol=1e-9, atol=0
    )
    return (
        ""
        if same
        else f"is of another vehicle: κ = {ratios[0]:.6g} and H = {ratios[1]:.6g}"
    )


class _TableChecker:
    """Checks a table piece by piece: finds the sheet of each row, applies the rules, and closes the table."""

    def __init__(
        self,
        criteria: Criteria,
        repeats: bool,
        limits: dict[str, Each],
        rounding: float,
    ) -> None:
        self.lone = LoneRows()
        self.criteria, self.repeats = criteria, repeats
        self.checker = Checker(criteria, self.lone)
        self.rates = _RowRates(criteria.vehicle, limits, rounding)
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
            self.rates.update(rows, fresh, piece)
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
            computed = np.asarray(
                level_determinant(fresh.alpha, self.criteria.coefficients)
            )
            wrong = np.abs(piece["R"] - computed) > 1e-2 * np.maximum(
                1.0, np.abs(computed)
            )
            if wrong.any():
                k = int(np.argmax(wrong))
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
        report = self.checker.report(closed).with_checks(
            self._rates(head, tail, closed=None if is_path else near)
        )
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

    def _rates(
        self, head: Segments, tail: Segments, *, closed: bool | None
    ) -> list[Check]:
        """Return the checks of rates of a table with times, and note a lone row that no check names."""
        rates: list[Check] = []
        if head.t is not None:
            rates = self.rates.checks(head, tail, closed=closed, lone=self.lone)
            self.notes |= self.rates.notes
        if self.lone.note and not self.checker.broken_by_lone_rows(rates):
            self.notes["lone"] = self.lone.note
        return self.checker.rates_with_causes(rates)


class _RowRates:
    """Rates, accelerations and jerks that a motion through timed rows must reach, or that the table states."""

    def __init__(
        self, vehicle: Vehicle, made_for: dict[str, Each], rounding: float
    ) -> None:
        """Take the limits of the vehicle, and where it states none those that the table was made for.

        Rates are less by what the `rounding` of the rows may add to them.
        """
        self.rounding = rounding
        stated = {kind: getattr(vehicle, f"max_tilt_{kind}") for kind in RATE_UNITS}
        self.limits = [
            made_for.get(kind) if limit is None else limit
            for kind, limit in stated.items()
        ]
        self.peaks = [Peak(scale=scale_of(limit)) for limit in self.limits]
        self.notes: dict[str, str] = {}
        self.moved, self.off = 0.0, 0.0
        self.stated = np.zeros((0, 4))  # the last row's rates

    def update(self, rows: Segments, fresh: Segments, piece: Table) -> None:
        """Examine fresh rows, and up to three before them, and the rates and accelerations that they state."""
        self._differences(rows)
        for names, peak in zip((RATES, ACCELERATIONS), self.peaks, strict=False):
            # Rates beside rounded rows are slopes of these.
            if all(name in piece for name in names) and not self.rounding:
                peak.update(np.column_stack([piece[name] for name in names]), fresh)
        if all(name in piece for name in RATES) and rows.t is not None:
            # Add up how far the stated rates are from the changes of the angles.
            rates = np.vstack(
                [self.stated, np.column_stack([piece[name] for name in RATES])]
            )
            moved = np.diff(rows.alpha[-len(rates) :], axis=0)
            expected = (
                (rates[:-1] + rates[1:]) / 2 * np.diff(rows.t[-len(rates) :])[:, None]
            )
            self.moved += float(np.abs(moved).sum() + np.abs(expected).sum())
            self.off += float(np.abs(moved - expected).sum())
            self.stated = rates[-1:]

    def _differences(self, rows: Segments, starts: int | None = None) -> None:
        """Examine divided differences, of the first `starts` rows if given.

        A smooth motion through n + 1 rows has an n-th derivative of n! times their divided difference somewhere.
        """
        assert rows.t is not None  # noqa: S101
        values = rows.alpha
        errors = np.full((len(values), 1), self.rounding)
        for order, peak in enumerate(self.peaks, start=1):
            if len(values) < 2:
                return
            times = (rows.t[order:] - rows.t[:-order])[:, None]
            values = order * np.diff(values, axis=0) / times
            errors = order * (errors[1:] + errors[:-1]) / times
            least = np.maximum(np.abs(values) - errors, 0.0)
            peak.update(least[:starts], rows[1:] if order > 1 else rows)

    def checks(
        self, head: Segments, tail: Segments, *, closed: bool | None, lone: LoneRows
    ) -> list[Check]:
        """Close the motion and return the checks of its rates, its accelerations and, where limited, jerks.

        `closed` is whether the last row repeats the first, None for a path, which is not closed; `lone` are wrong rows.
        """
        assert head.t is not None and tail.t is not None  # noqa: PT018, S101
        period = float(tail.t[-1] - head.t[0])
        if len(tail.alpha) > 1 and closed is not None:
            # Across the seam: from the last rows to the first ones, a period later.
            onward = head[1:] if closed else head
            later = (
                period if closed else closing_time(0.0, period, int(tail.number[-1]))
            )
            rows = tail.joined(replace(onward, t=head.t[-len(onward.alpha) :] + later))
            self._differences(
                replace(rows, first_t=float(head.t[0])), len(tail.alpha) - closed
            )
        if self.off > 0.5 * self.moved:
            self.notes["rates"] = (
                "the stated rates do not match the rows: alpha1_rate to alpha4_rate must be in rad/s; the larger "
                "values are checked"
            )
        out = []
        for order, (kind, peak) in enumerate(
            zip(RATE_UNITS, self.peaks, strict=True), start=1
        ):
            limit = four_of(self.limits[order - 1])[peak.joint - 1]
            if order > 2 and limit is None:
                continue
            needed = period * (peak.value / limit) ** (1 / order) if limit else period
            advice = f"take at least {needed:.4g} s instead of {period:.4g} s"
            if peak.place is not None and lone.is_near(peak.place.point + 1):
                advice = lone.note
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
        )
        checks = [check.as_mapping() for check in self.checks]
        return {
            **dict.fromkeys(names),
            "flyable": self.flyable,
            "checks": checks,
            "warnings": [],
            "rows": self.rows,
        }

    def __repr__(self) -> str:
        verdict = _FLYABLE[self.flyable]
        return f"<GeometryReport: flyable {verdict}, {len(self.checks)} checks of {self.rows} rows>"

    def __str__(self) -> str:
        verdict = f"Flyable: {_FLYABLE[self.flyable]}. The paper's rules do not apply to this geometry."
        return "\n".join([verdict, *lines_of_checks(self.checks)])


def validate_geometry(
    table: str | Path | npt.ArrayLike,
    geometry: Geometry,
    *,
    floor: float = DEFAULT_FLOOR,
) -> GeometryReport:
    """Return whether rotors of any geometry can fly a tilt table, proven along the straight segments between its rows.

    Parameters
    ----------
    table
        A gait file with a column alpha1 … alphaN for each rotor that tilts (or with _deg), or an (n, N) array [rad].
        The last row is joined with the first.
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
    tilts = np.asarray(geometry.tilt_axis.any(axis=1))
    angles = tuple(f"alpha{k + 1}" for k in np.flatnonzero(tilts))
    if not angles:
        raise InputError(
            "tilt_axis must be other than zero for at least one rotor, got none that tilts"
        )
    floor = checked_number("floor", floor)
    if isinstance(table, (str, Path)):
        pieces = list(read_pieces(table, angles=angles))
        alpha = np.zeros((sum(map(len, pieces)), len(tilts)))
        alpha[:, tilts] = np.vstack(
            [np.column_stack([piece[name] for name in angles]) for piece in pieces]
        )
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
