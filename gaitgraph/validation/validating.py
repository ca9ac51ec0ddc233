"""Is a gait valid, and can it fly? Every rule, the rates and the colourings of its loop, in one report.

The rows of a table are joined by straight segments, also the last with the first, and by cubics where it has rates and
accelerations; every check holds along them. If the rows sample a motion that the table states, that is judged too, and
the worse of each check counts.
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from gaitgraph.errors import wrong
from gaitgraph.files import naming_file
from gaitgraph.gait.given import given_gait
from gaitgraph.gait.table import surface_of
from gaitgraph.surface.loop_colorings import colorings
from gaitgraph.tolerances import DEFAULT_FLOOR, DEFAULT_TOLERANCE
from gaitgraph.validation.judged import Criteria, JudgedGait, segments_of
from gaitgraph.validation.physics import report_of
from gaitgraph.validation.report import check_of
from gaitgraph.validation.rows import report_of_rows
from gaitgraph.validation.worst import both
from gaitgraph.vehicle import vehicle_within

if TYPE_CHECKING:
    from gaitgraph.gait.gait import Gait
    from gaitgraph.gait.given import GaitLike, GivenGait
    from gaitgraph.gait.table import Table
    from gaitgraph.invertibility.coefficients import CoefficientsLike
    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.timing.timed_gait import TimedGait
    from gaitgraph.validation.report import CheckOptions, Report
    from gaitgraph.vehicle import VehicleLike


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
    criteria = Criteria(
        vehicle=gait.vehicle,
        coefficients=gait.coefficients,
        crossing_tolerance=gait.crossing_tolerance,
        tolerance=tolerance,
        floor=floor,
        angle_rounding=angle_rounding,
        beside=beside,
        extremes=extremes,
    )
    closed = check_of("closed", True, "closed by construction", value=0.0, limit=0.0)
    noun = "chord" if beside else "corner"
    judged = JudgedGait(segments=segments_of(gait, noun), criteria=criteria)
    return report_of(judged, closed)


def validate(
    gait: GaitLike,
    *,
    vehicle: VehicleLike | None = None,
    coefficients: CoefficientsLike | None = None,
    tolerance: float = DEFAULT_TOLERANCE,
    floor: float = DEFAULT_FLOOR,
    angle_rounding: float | None = None,
    crossing_tolerance: float | None = None,
    format: str | None = None,
) -> Report:
    """Return every check of a gait; with times also those of tilt rates and accelerations.

    Parameters
    ----------
    gait
        A gait in any form, see :func:`gaitgraph.gait.given.given_gait`. Of a table both its rows and the motion that
        it states are judged, see :mod:`gaitgraph.timing.statement`.
    vehicle, coefficients
        For tables and files; by default those that the table states, else the paper's vehicle.
    tolerance, floor, angle_rounding
        As for :func:`check_gait`. Rows without colors get the color of the sheet, or else of the fibre, within
        `tolerance` of which they lie.
    crossing_tolerance
        For tables and files: distance from a crossing line within which a plane type is `?` [rad]; π/32 by default.
    format
        That of an open stream as the gait, "csv" say.

    Returns
    -------
    Report
        False in a condition if the gait is not valid. A vehicle that is not symmetric is judged by physics alone. For a
        table `where` holds the row, counted from 1, at which a segment starts, the fraction along it, the time and the
        tilt angles.

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
    given = given_gait(gait, vehicle=vehicle, coefficients=coefficients, format=format)
    limits: CheckOptions = {
        "tolerance": tolerance,
        "floor": floor,
        "angle_rounding": angle_rounding,
    }
    table = given.table
    if table is not None:
        with naming_file(given.file):
            return _report_of_table(given, table, crossing_tolerance, limits)
    if crossing_tolerance is not None:
        raise wrong(
            "crossing_tolerance",
            "must be None beside a gait, which has its own",
            crossing_tolerance,
        )
    bare = given.gait
    motion = given.motion
    if motion is not None and not motion.repeats:
        return motion.check(**limits)  # colourings are of loops
    report = check_gait(bare, **limits)
    if motion is not None:
        report = report.with_timing(motion)
    has_planes = bare.vehicle.asymmetry is None
    if not has_planes or (np.abs(bare.alpha[:, :2]) > math.pi / 2).any():
        return report  # colourings are of loops in [−π/2, π/2]²
    loop = colorings(
        bare.alpha,
        coefficients=bare.coefficients,
        crossing_tolerance=bare.crossing_tolerance,
    )
    return replace(report, listing=loop)


def _report_of_table(
    given: GivenGait,
    table: Table,
    crossing_tolerance: float | None,
    limits: CheckOptions,
) -> Report:
    """Return every check of a table: of its rows, and of the motion that it states."""
    body, numbers, stated = surface_of(table, given.vehicle, given.coefficients)
    if crossing_tolerance is not None:
        stated = crossing_tolerance
    criteria = Criteria(
        vehicle=body,
        coefficients=numbers,
        crossing_tolerance=stated,
        **limits,
    )
    if table.rounding:
        # The steps of servos put rows beside their sheet: each angle is off by the error, either way.
        frequencies, amplitudes = numbers.form.waves()
        signs = np.array(list(product((-1.0, 1.0), repeat=4)))
        steepest = (np.abs(signs @ frequencies.T) @ amplitudes[:, :2]).max()
        allowed = criteria.tolerance + float(steepest) * table.rounding
        criteria = replace(criteria, tolerance=allowed)
    report = report_of_rows(table, criteria)
    motion = given.motion
    if motion is not None:
        if crossing_tolerance is not None:
            judged = replace(motion.gait, crossing_tolerance=crossing_tolerance)
            motion = motion.with_gait(judged)
        report = both(_report_of_motion(table, motion, limits), report)
    elif "t" not in table and {"period", "law"} <= table.about.keys():
        # A saved plan: corners, with the timing of its request.
        timed = given.gait.parametrize(table.about["period"], law=table.about["law"])
        report = report.with_timing(timed)
    return replace(report, said=table.notes)


def _report_of_motion(table: Table, motion: TimedGait, limits: CheckOptions) -> Report:
    """Return every check of the motion that a table samples, under the limits that the table was made for too."""
    vehicle = vehicle_within(motion.gait.vehicle, table.limits)
    return motion.with_gait(replace(motion.gait, vehicle=vehicle)).check(**limits)
