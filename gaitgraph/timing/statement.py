"""One truth in a table: its rows. What it states of where they come from is checked once, when it is read.

A table may state the motion that its rows sample: corners, law, period and number of samples, and limits for the laws
of ``pace``; the request of its plan; or these of each section of a path. :func:`checked` computes that motion again and
compares it with the rows, number by number, each to half a unit of the last digit that this number was printed with. If
all agree, the table keeps the motion (:attr:`Table.motion`). If one does not, or a row is missing, the whole statement
is dropped with one warning, and with it the columns that follow from the angles. Rates that do not fit the rows are
dropped too. No other place compares rows with a statement.
"""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely

from gaitgraph.angles import angles_from, checked_number, whole_number
from gaitgraph.errors import FileWarning, GaitgraphError, InputError, shown
from gaitgraph.gait.gait import Gait
from gaitgraph.gait.table import (
    ACCELERATIONS,
    ANGLES,
    RATES,
    THRUSTS,
    Table,
    colors_of,
    even_times,
    surface_of,
    tilt_angles,
    wrong_times,
    wrong_types,
)
from gaitgraph.surface.region import Zones
from gaitgraph.surface.sheets import color_codes
from gaitgraph.timing.curve import POLYLINE_CHORD
from gaitgraph.timing.joining import joined_again
from gaitgraph.timing.laws import LAWS
from gaitgraph.timing.limited_gait import LimitedGait
from gaitgraph.timing.time_optimal import timed_by_law
from gaitgraph.timing.timed_gait import MOST_SAMPLES, TimedGait, TimedPath

if TYPE_CHECKING:
    from gaitgraph.invertibility.coefficients import Coefficients
    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.vehicle import Each, Vehicle

_MADE_FROM = ("corners", "sections")
_STATED = (*_MADE_FROM, "rounding", "law", "period", "samples", "made_by", "request")
_DERIVATIVES = (*RATES, *ACCELERATIONS)
_COMPUTED = ("color", "types", "R", *_DERIVATIVES, *THRUSTS)
_MISSED = 1e-6  # a waypoint of a request, farther from the motion [rad]
_ROUND_OFF = 1e-11  # of a motion computed again, as a share of its largest value


def checked(table: Table, name: object = None) -> Table:
    """Return a table with the motion that it states, or without the statement if a number in its rows differs.

    `name` is the path of its file, for the warning. Tables that state no corners keep the rest of their statement if
    their times are those of the stated period and samples.
    """
    if table.motion is not None:
        return table
    limits = table.limits  # wrong ones are an error, and no difference
    motion, difference = _stated_motion(table, limits)
    if motion is not None and not difference:
        return table.with_motion(motion)
    if difference:
        dropped = _COMPUTED if "alpha3" in table else _DERIVATIVES
        consequence = (
            "what the file states of its motion is not used, and color, types, R, rates, accelerations and thrusts are those of "
            "the rows"
        )
        about = {key: value for key, value in table.about.items() if key not in _STATED}
        table = replace(table, about=about)
    else:
        difference = _first_misfit(table)
        dropped = _DERIVATIVES
        consequence = "stated rates and accelerations are not used"
    if not difference:
        return table
    note = f"{difference}: {consequence}"
    file = f"gait file {str(name)!r}" if isinstance(name, (str, Path)) else "table"
    warnings.warn(f"{file}: {note}", FileWarning, stacklevel=3)
    columns = {
        name: column for name, column in table.columns.items() if name not in dropped
    }
    return replace(table, columns=columns, notes=(*table.notes, note))


def _stated_motion(
    table: Table, limits: dict[str, Each]
) -> tuple[TimedGait | None, str]:
    """Return the motion that a table states, if it states one, and how its rows differ from it, "" if they agree."""
    about = table.about
    is_stated = any(name in about for name in _MADE_FROM)
    if "samples" not in about and not is_stated:
        return None, ""
    if "t" not in table or "alpha3" not in table:
        return None, "the file states a motion, but has no times or not all angles"
    try:
        samples = whole_number("samples", about.get("samples"), 1, MOST_SAMPLES)
        period = checked_number("period", about.get("period"), above=True)
    except InputError as error:
        return None, f"the stated {error}"
    difference = _first_wrong_time(table, samples, period)
    if difference or not is_stated:
        return None, difference
    surface = surface_of(table)  # wrong constants are an error, and no difference
    try:
        motion = _motion_of(table, surface, samples, period, limits)
    except (
        GaitgraphError,
        ArithmeticError,
        LookupError,
        TypeError,
        ValueError,
    ) as error:
        return None, f"the stated motion cannot be made: {error}"
    phases = [list(phase) for phase in motion.phases]
    if about.get("sections") is not None and about.get("phases", phases) != phases:
        return (
            motion,
            f"the stated phases are {shown(about['phases'])}, those of the stated motion {shown(phases)}",
        )
    try:
        difference = _difference_from_request(table, motion)
    except (InputError, TypeError, ValueError) as error:
        difference = f"the stated request is wrong: {error}"
    return motion, difference or _first_difference(table, motion)


def _motion_of(
    table: Table,
    surface: tuple[Vehicle, Coefficients, float],
    samples: int,
    period: float,
    limits: dict[str, Each],
) -> TimedGait:
    """Return the timed gait, or path, that a table states."""
    about: dict[str, Any] = table.about
    vehicle, coefficients, crossing_tolerance = surface
    sections = about.get("sections")
    corners = np.array(
        (about if sections is None else sections[0])["corners"], dtype=float
    )
    if not table.repeats and sections is None:  # the gait of a path leads out and back
        corners = np.vstack([corners, corners[-2:0:-1]])
        samples, period = 2 * samples, 2 * period
    colors = colors_of(corners, coefficients)
    if "color" in table:
        colors = tuple(table["color"][:1]) * len(corners)
    request = about.get("request")
    gait = Gait(
        alpha=corners,
        colors=colors,
        vehicle=vehicle,
        coefficients=coefficients,
        crossing_tolerance=crossing_tolerance,
        request=dict(request) if isinstance(request, dict) else {},
    )
    if sections is not None:
        joined = joined_again(sections, gait, samples)
        if table.repeats or abs(joined.period - period) > _ROUND_OFF * period:
            raise ValueError("sections must be of a path, and take its period")
        return joined
    motion = timed_by_law(
        gait,
        about.get("law", ""),
        period,
        samples=samples,
        limits=limits,
        rounding=about.get("rounding"),
    )
    return motion if table.repeats else TimedPath.of(motion)


def _first_wrong_time(table: Table, samples: int, period: float) -> str:
    """Return which row does not have the time that the stated samples give it, "" if all have."""
    t = table["t"]
    if len(t) > samples + 1:
        return f"the table has {len(t)} rows, stated are {samples + 1}"
    step = period / samples
    wrong = wrong_times(table, step)
    if wrong.any():
        row = int(np.argmax(wrong))
        stated = t[0] + row * step
        return f"row {row + 1} is at t = {t[row]:.15g} s, stated is {stated:.15g} s"
    if len(t) < samples + 1:
        return f"row {len(t) + 1} is missing, stated are {samples + 1} rows"
    return ""


def _first_difference(table: Table, motion: TimedGait) -> str:
    """Return which number of a table's rows differs first from a motion, "" if none does."""
    if not set(table.columns.get("color", ())) <= set(motion.gait.colors):
        return "the rows have more than one color, the stated motion has one"
    first = len(table)
    difference = ""
    columns = motion.columns
    for group in (ANGLES, RATES, ACCELERATIONS, ("R",), THRUSTS):
        names = [name for name in group if name in columns]
        largest = max((np.abs(columns[name]).max() for name in names), default=0.0)
        for name in names:
            if name not in table:
                continue
            expected = columns[name]
            off = np.abs(table[name] - expected)
            wrong = off > table.half_units(name) + _ROUND_OFF * (1.0 + largest)
            row = int(np.argmax(wrong))
            if wrong[row] and row < first:
                first = row
                difference = (
                    f"row {row + 1} has {name} = {table[name][row]:.9g}, the stated motion has {expected[row]:.9g} "
                    f"there ({off[row]:.2g} apart)"
                )
    if not difference and "types" in table and motion.gait.colors:
        wrong = wrong_types(table, color_codes(motion.gait.colors[:1] * len(table)))
        if wrong.any():
            row = int(np.argmax(wrong))
            difference = f"row {row + 1} has the types {table['types'][row]}, the stated motion is {motion.gait.color}"
    return difference


def _difference_from_request(table: Table, motion: TimedGait) -> str:
    """Return how the stated request differs from the motion beside it, "" if it does not.

    Compared are its timing, vehicle, coefficients, color, sign of R, polygons and waypoints.
    """
    about = table.about
    request = about.get("request")
    if not isinstance(request, dict):
        return ""
    names = ["vehicle", "coefficients"]
    if about.get("law") in LAWS:
        names += ["period", "law", "samples"]
    for name in names:
        if request.get(name, about.get(name)) != about.get(name):
            return (
                f"the stated request has {name} = {shown(request[name])}, the stated motion has "
                f"{shown(about.get(name))}"
            )
    gait = motion.gait
    color, sign = (request.get(name, "auto") for name in ("color", "sign"))
    if color not in ("auto", gait.color):
        return f"the stated request has the color {shown(color)}, the stated motion has {gait.color}"
    wanted = -1.0 if sign == "negative" else 1.0
    if sign != "auto" and (wanted * gait.R < 0).any():
        return f"the stated request has the sign {shown(sign)}, which R of the stated motion has not"
    zones = Zones(**{name: request.get(name, ()) for name in ("keep_out", "keep_in")})
    plane, ends = gait.alpha[:, :2], gait.ends[:, :2]
    if not zones.allow_segments(plane, ends).all():
        return "the stated motion leaves the polygons of the stated request"
    waypoints = angles_from(request.get("waypoints", []), "waypoints").reshape(-1, 2)
    loop = shapely.LineString(np.vstack([plane, plane[:1]]))
    off = shapely.distance(shapely.points(waypoints), loop)
    allowed = _MISSED
    if isinstance(motion, LimitedGait) and motion.rounding is not None:
        allowed += motion.rounding.tolerance + POLYLINE_CHORD
    if (off > allowed).any():
        number = int(np.argmax(off)) + 1
        return f"the stated motion passes {off.max():.2g} rad from waypoint {number} of the stated request"
    return ""


def _first_misfit(table: Table) -> str:
    """Return the first row whose stated rates do not fit the angles beside it, "" if all do.

    The smallest and the largest of the four slopes around a row, two before and two after it, bound its rate, widened
    by the largest of their sizes, by their range, and by what the digits allow; at the ends of an open table, where two
    of them are not known, by the largest slope of that angle too.
    """
    if len(table) < 2 or not all(name in table for name in ("t", *RATES)):
        return ""
    step = np.diff(even_times(table))
    pad = "wrap" if table.returns else "edge"
    for angle, name, values in zip(ANGLES, RATES, tilt_angles(table).T, strict=True):
        slope = np.diff(values) / step
        digits = table.half_units(angle)
        noise = (digits[1:] + digits[:-1]) / step
        slopes = _around_rows(slope, pad)
        low, high = slopes.min(axis=1), slopes.max(axis=1)
        slack = np.abs(slopes).max(axis=1) + (high - low)
        slack += _around_rows(noise, pad).max(axis=1) + table.half_units(name)
        if not table.returns:
            slack[[0, -1]] += np.abs(slope).max()
        slack += 1e-9 * (1.0 + slack)
        rate: FloatArray = table[name]
        wrong = (rate < low - slack) | (rate > high + slack)
        if wrong.any():
            row = int(np.argmax(wrong))
            _, before, after, _ = slopes[row]
            return (
                f"row {row + 1} states {name} = {rate[row]:.6g} rad/s, where the angle changes by {before:.6g} "
                f"rad/s before and {after:.6g} rad/s after it"
            )
    return ""


def _around_rows(segments: FloatArray, pad: Any) -> FloatArray:
    """Return the values of two segments before and two after each row, shape (rows, 4)."""
    padded = np.pad(segments, 2, mode=pad)
    return np.lib.stride_tricks.sliding_window_view(padded, 4)
