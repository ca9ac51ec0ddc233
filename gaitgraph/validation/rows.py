"""Every rule on the rows of a table: joined straight, with the rates that any motion through them must reach.

Where a table has rates, its rows are joined by cubics too, and these are judged by chords beside them.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitgraph.gait.table import (
    ACCELERATIONS,
    ANGLES,
    RATE_UNITS,
    RATES,
    Table,
    accelerations_of,
    closing_time,
    even_times,
    is_closed,
    lifted_rows,
    note_on_ends,
    wrong_types,
)
from gaitgraph.invertibility.matrices import level_determinant
from gaitgraph.surface.loop_colorings import Colorings, colorings
from gaitgraph.surface.sheets import color_of
from gaitgraph.validation.judged import (
    Criteria,
    JudgedGait,
    Segments,
    segments_of_rows,
)
from gaitgraph.validation.physics import report_of
from gaitgraph.validation.report import Check, Report, check_of, limit_check
from gaitgraph.validation.worst import both
from gaitgraph.validation.wrong_rows import LoneRows, lone_rows
from gaitgraph.vehicle import four_of, scale_of, tighter_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gaitgraph.invertibility.coefficients import Coefficients
    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.surface.sheets import CodeArray
    from gaitgraph.vehicle import Vehicle

_BESIDE_CUBIC = 1e-6  # largest distance of a cubic between rows from its chords [rad]
_MOST_PARTS = 1000  # of a cubic
_PASSING = 2e-4  # of limits, by cubics through samples of a motion [rad, or a share]
_MOST_SHARE = 0.01  # of a rate's limit that the digits of angles may explain

MOST_LISTED_ROWS = 10_000
"""Largest number of rows for which the colourings of a table are listed, not only counted."""


def report_of_rows(table: Table, criteria: Criteria) -> Report:
    """Return every check of a table's rows, joined straight, and by cubics where its rates and accelerations say so."""
    alpha, color = lifted_rows(table, criteria.coefficients, criteria.tolerance)
    report = _report_of_straight_rows(table, alpha, color, criteria)
    cubics = _segments_along_cubics(table, alpha, color)
    if cubics is None:
        return report
    if table.motion is not None:  # it keeps the limits, and the cubics are nearly it
        criteria = replace(criteria, passing=_PASSING)
    along_cubics = report_of(
        JudgedGait(segments=cubics, criteria=criteria), report["closed"]
    )
    worse = both(along_cubics, report)
    return replace(worse, reachability=report.reachability)


def _report_of_straight_rows(
    table: Table, alpha: FloatArray, color: CodeArray, criteria: Criteria
) -> Report:
    """Return every check of rows joined by straight segments, also the last with the first unless they are run once."""
    count = len(alpha)
    is_path = not table.repeats and count > 1
    # A last row of another color is a new point, with a segment to the first and no step in time.
    returns = is_closed(alpha) and color[-1] == color[0]
    gap = float(np.abs(alpha[-1] - alpha[0]).max())
    longest = float(np.abs(np.diff(alpha, axis=0)).max(initial=0.0))
    closes = not returns and not is_path
    t = table.columns.get("t")
    segments = segments_of_rows(alpha, color, t, closes=closes)
    lone = lone_rows(alpha, table.repeats)
    rates = []
    if "t" in table:
        rates = rates_of_rows(table, segments, criteria.vehicle, lone)
    closed = check_of(
        "closed",
        True,
        _closing_in_words(table, alpha, gap, is_path),
        value=gap if closes else 0.0,
        place=segments.place(count - 1),
    )
    gait = JudgedGait(segments=segments, criteria=criteria, lone=lone)
    report = report_of(gait, closed, rates=rates)
    notes = _notes_on_columns(table, alpha, color, criteria.coefficients)
    if gap == longest == 0:
        notes.append(
            "the table is a single posture, not a gait: its rows are all equal"
        )
    if not is_path and note_on_ends(alpha):
        notes.append(note_on_ends(alpha))
    if closes and gap > 3 * longest:
        notes.append(
            f"the closing segment from row {count} to row 1 is {gap:.4g} rad long, the longest step between "
            f"rows {longest:.4g} rad: is the end of the table missing? Or is it a path that is run once?"
        )
    listing = None
    if not is_path and criteria.vehicle.asymmetry is None:
        listing = _listing(segments, criteria)
    return replace(
        report,
        notes=report.notes + tuple(notes),
        rows=count,
        listing=listing,
        repeats=not is_path,
    )


def _closing_in_words(
    table: Table, alpha: FloatArray, gap: float, is_path: bool
) -> str:
    count = len(alpha)
    if is_path:
        return f"run once, from row 1 to row {count}: no segment leads back"
    if count == 1:
        return "the gait is a single point"
    if not is_closed(alpha):
        return f"not closed: the segment of {gap:.4g} rad from row {count} back to row 1 is judged too"
    if "t" not in table:
        return "the last row repeats the first"
    seconds = float(table["t"][-1] - table["t"][0])
    return f"the last row repeats the first, T = {seconds:g} s"


def _listing(segments: Segments, criteria: Criteria) -> Colorings | None:
    """Return the colourings of the loop of all rows, counted alone if there are many; None outside [−π/2, π/2]²."""
    plane = segments.starts[:, :2]  # the last point is the first again
    if (np.abs(plane) > math.pi / 2).any():
        return None
    found = colorings(
        plane,
        coefficients=criteria.coefficients,
        crossing_tolerance=criteria.crossing_tolerance,
    )
    if len(segments.alpha) > MOST_LISTED_ROWS:
        return replace(found, points=np.zeros((0, 2)), choices={})
    return found


def _notes_on_columns(
    table: Table, alpha: FloatArray, color: CodeArray, coefficients: Coefficients
) -> list[str]:
    """Return a note on the first row whose stated types, and on the first whose stated R, disagree with its angles."""
    notes = []
    if "types" in table and wrong_types(table, color).any():
        k = int(np.argmax(wrong_types(table, color)))
        notes.append(
            f"row {k + 1} states the types {table['types'][k]}, but it is {color_of(color[k])}; stated types are not used"
        )
    if "R" in table:
        computed = np.asarray(level_determinant(alpha, coefficients))
        off = np.abs(table["R"] - computed) - 1e-2 * np.maximum(1, np.abs(computed))
        doubted = np.flatnonzero(off > 0)
        for joint, name in enumerate(ANGLES):
            # What the digits of the angles explain.
            moved = alpha[doubted]
            moved[:, joint] += table.half_units(name)[doubted]
            change = level_determinant(moved, coefficients) - computed[doubted]
            off[doubted] -= 1.1 * np.abs(change)
        if (off > 0).any():
            k = int(np.argmax(off > 0))
            notes.append(
                f"row {k + 1} states R = {table['R'][k]:.4g}, but R is {computed[k]:.4g} there "
                f"({coefficients.kind} coefficients); stated values are not used"
            )
    return notes


# -- Rates


def rates_of_rows(
    table: Table, segments: Segments, vehicle: Vehicle, lone: LoneRows
) -> list[Check]:
    """Return the checks of rates, accelerations and, where limited, jerks that a motion through timed rows must reach.

    These are divided differences of the angles, or what the table states if that is larger. Times that are even to their
    digits count as even. Angles count as they stand, but for a table that states to be the samples of a motion: what the
    rounding of its angles explains does not count, of rates at most 1 % of the limit. What the steps of servos explain
    does not count at all. Limits are those of the vehicle, or lower ones that the table was made for.
    """
    stated_limits = table.limits
    limits = [
        tighter_of(getattr(vehicle, f"max_tilt_{kind}"), stated_limits.get(kind))
        for kind in RATE_UNITS
    ]
    t = even_times(table)
    sizes, least_slopes = _differences(
        table, segments.alpha[: len(table)], t, limits[0]
    )
    largest_slopes = sizes[0].max(axis=0)
    if not table.rounding:  # rates beside rounded rows are slopes of these
        _raise_to_stated(sizes, table, t)
    period = float(table["t"][-1] - table["t"][0])
    checks = []
    for order, kind in enumerate(RATE_UNITS, start=1):
        shares = sizes[order - 1] / scale_of(limits[order - 1])
        row, joint = divmod(int(np.argmax(shares)), 4)
        peak = float(sizes[order - 1, row, joint])
        place = segments.place(row)
        limit = four_of(limits[order - 1])[joint]
        if order == 3 and limit is None:
            continue
        needed = period
        if limit:
            needed = period * (peak / limit) ** (1 / order)
        advice = f"take at least {needed:.4g} s instead of {period:.4g} s"
        is_doubtful = limit and least_slopes[joint] <= limit < largest_slopes[joint]
        if lone.is_near(place.point + 1):
            advice = lone.note
        elif order == 1 and is_doubtful:
            advice = "a slope between rounded angles: write them with more decimals"
        checks.append(
            limit_check(f"tilt_{kind}", peak, joint + 1, limit, advice, place)
        )
    return checks


def _differences(
    table: Table, alpha: FloatArray, t: FloatArray, limit: Any
) -> tuple[FloatArray, FloatArray]:
    """Return divided differences of the angles, less what the rounding of each explains, of rates, accelerations and jerks.

    They are by rows, one more than the table has, shape (3, n + 1, 4). A smooth motion through n + 1 rows has an n-th
    derivative of n! times their divided difference somewhere. One of more than two rows belongs to the second of them.
    Also return the slopes that rounding leaves no doubt of, shape (4,).
    """
    sizes = np.zeros((3, len(alpha) + 1, 4))
    rounding = np.full((len(alpha), 1), table.rounding)
    if "samples" in table.about:
        digits = _half_units(table, ANGLES)
        rounding = np.maximum(rounding, digits)
    closed = is_closed(alpha)
    count = len(alpha) - closed
    if table.repeats and len(alpha) > 1:
        # On to the first rows, a period later; the last row of a closed table is the first again.
        onward = slice(int(closed), 3)
        period = t[-1] - t[0]
        later = period
        if not closed:
            later = closing_time(0.0, period, len(t))
        alpha = np.vstack([alpha, alpha[onward]])
        t = np.append(t, t[onward] + later)
        rounding = np.vstack([rounding, rounding[onward]])
    most = np.full(4, np.inf)  # servos step as they do
    if not table.rounding:
        most = _MOST_SHARE * np.array(four_of(limit or 0.0))
    values = alpha
    least_slopes = np.zeros(4)
    for order in range(1, 4):
        if len(values) < 2:
            break
        width = (t[order:] - t[:-order])[:, None] / order
        values = np.diff(values, axis=0) / width
        rounding = (rounding[1:] + rounding[:-1]) / width
        explained = rounding
        first = 1
        if order == 1:
            first = 0
            explained = np.minimum(rounding, most)
            least_slopes = (np.abs(values) - rounding).max(axis=0)
        size = np.maximum(np.abs(values) - explained, 0.0)[:count]
        sizes[order - 1, first : first + len(size)] = size
    return sizes, least_slopes


def _raise_to_stated(sizes: FloatArray, table: Table, t: FloatArray) -> None:
    """Raise the sizes of :func:`_differences` to the rates and accelerations that a table states or its rates need.

    What their digits explain does not count.
    """
    stated = {}
    for order, names in enumerate((RATES, ACCELERATIONS)):
        if all(name in table for name in names):
            values = np.column_stack([table[name] for name in names])
            stated[order] = np.abs(values) - _half_units(table, names)
    if ACCELERATIONS[0] not in table and table.joined_by_cubics:
        explained = _half_units(table, RATES) / np.diff(t).min()
        if not table.returns:  # an end has a step on one side alone
            explained[[0, -1]] *= 2
        stated[1] = np.abs(accelerations_of(table)) - explained
    for order, size in stated.items():
        np.maximum(sizes[order, :-1], size, out=sizes[order, :-1])


def _half_units(table: Table, names: Sequence[str]) -> FloatArray:
    """Return half a unit of the last digit of some columns, side by side."""
    return np.column_stack([table.half_units(name) for name in names])


# -- Cubics


def _segments_along_cubics(
    table: Table, alpha: FloatArray, color: CodeArray
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
    step = np.diff(alpha, axis=0)
    first = width * rates[:-1]
    last = width * rates[1:]
    square = 3 * step - 2 * first - last
    cube = first + last - 2 * step
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
    within = (np.arange(len(row)) - (np.cumsum(parts) - parts)[row]) / parts[row]
    x = within[:, None]
    points = alpha[row] + x * (first[row] + x * (square[row] + x * cube[row]))
    row = np.append(row, len(step))
    return Segments(
        alpha=np.vstack([points, alpha[-1:]]),
        color=color[row],
        number=row + 1,
        noun="row",
        t=np.append(t[row[:-1]] + within * width[row[:-1], 0], t[-1]),
        within=np.append(within, 0.0),
    )
