"""Can rotors of any geometry fly a tilt table? The rules of physics that need no surface, along straight segments."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gaitgraph import later
from gaitgraph.angles import angles_from, checked_floor, figure
from gaitgraph.errors import InputError, wrong
from gaitgraph.gait.table import is_closed
from gaitgraph.invertibility.geometry import IDLE_THRUST, LEAST_DECIDED, Geometry
from gaitgraph.tolerances import DEFAULT_FLOOR
from gaitgraph.validation.judged import segments_of_rows
from gaitgraph.validation.physics import tilt_range
from gaitgraph.validation.report import LIMITED, Check, Report, State, check_of

if TYPE_CHECKING:
    import numpy.typing as npt

    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.invertibility.segment_bounds import Least
    from gaitgraph.validation.judged import Segments


def validate_geometry(
    table: str | Path | npt.ArrayLike,
    geometry: Geometry,
    *,
    floor: float = DEFAULT_FLOOR,
    once: bool = False,
) -> Report:
    """Return whether rotors of any geometry can fly a tilt table, proven along the straight segments between its rows.

    Parameters
    ----------
    table
        A gait file with a column alpha1 … alphaN for each rotor that tilts (or with _deg), or an (n, N) array [rad].
        The last row is joined with the first, unless the file says that it is run once.
    geometry
        The rotors. A vehicle of four is judged by :func:`gaitgraph.validation.validating.validate`.
    floor
        Least singular value floor of the level matrix, dimensionless.
    once
        Whether the rows are run once, so that no segment leads back to the first.

    Returns
    -------
    Report
        Of physics alone, with the checks `least_singular_value`, `hover_thrust`, unless the matrix is nearly singular, and
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
    if not isinstance(geometry, Geometry):
        raise wrong(
            "geometry", "must be a Geometry", geometry, "; validate judges vehicles"
        )
    floor = checked_floor(floor)
    alpha, repeats = _rows_of(table, geometry)
    is_path = (once or not repeats) and len(alpha) > 1
    color = np.zeros(len(alpha), dtype=np.int8)
    closes = not is_path and not is_closed(alpha)
    segments = segments_of_rows(alpha, color, None, closes=closes)
    singular, lower = _least_singular_value(geometry, segments, floor)
    checks = [singular]
    if lower >= LEAST_DECIDED:
        checks.append(_hover_thrust(geometry, segments))
    if np.isfinite(geometry.tilt_range).any():
        checks.append(tilt_range(segments, geometry.tilt_range))
    judged = {check.name for check in checks}
    unlimited = [name for name in LIMITED if name not in judged]
    return Report(
        checks=tuple(checks),
        rows=len(alpha),
        repeats=not is_path,
        unlimited=tuple(unlimited),
        notes=_notes_on_axes(geometry),
    )


def _notes_on_axes(geometry: Geometry) -> tuple[str, ...]:
    """Return a note on the rotors whose angles have the other sign in a vehicle, where axes point outward."""
    outward = np.sum(geometry.position[:, :2] * geometry.tilt_axis[:, :2], axis=1)
    inward = np.flatnonzero(outward < -1e-9) + 1
    if not len(inward):
        return ()
    listed = ", ".join(map(str, inward))
    return (
        f"tilt axes that point inward, of rotors {listed}: their angles turn about these axes as they are described",
    )


def _rows_of(
    table: str | Path | npt.ArrayLike, geometry: Geometry
) -> tuple[FloatArray, bool]:
    """Return the tilt angles of a table, 0 for rotors that do not tilt, shape (n, N) [rad], and whether it repeats."""
    tilts = np.asarray(geometry.tilt_axis.any(axis=1))
    names = tuple(f"alpha{k + 1}" for k in np.flatnonzero(tilts))
    if not names:
        raise InputError(
            "tilt_axis must be other than zero for at least one rotor, got none that tilts",
            field="geometry",
        )
    if isinstance(table, (str, Path)):
        rows = later.unchecked_table(table, angles=names)
        alpha = np.zeros((len(rows), len(tilts)))
        alpha[:, tilts] = np.column_stack([rows[name] for name in names])
        return alpha, rows.repeats
    alpha = np.atleast_2d(angles_from(table, "table"))
    if alpha.shape[1:] != tilts.shape:
        rule = f"must be angles of shape (n, {len(tilts)})"
        raise wrong("table", rule, alpha.shape)
    return alpha, True


def _least_singular_value(
    geometry: Geometry, segments: Segments, floor: float
) -> tuple[Check, float]:
    """Check that the thrusts can make every moment and the vertical force; also return the proven least singular value."""
    starts, ends = segments.starts, segments.ends
    found: Least = geometry.least_singular_value_along(starts, ends)
    lower, upper, segment, fraction = found.worst()
    if lower < floor <= upper:
        found = geometry.least_singular_value_along(starts, ends, tolerance=1e-6)
        lower, upper, segment, fraction = found.worst()
    proven = math.floor(1e4 * lower) / 1e4
    message = f"least singular value {figure(upper)} (proven lower bound {proven:g}, floor {floor:g})"
    place = segments.place(segment, fraction)
    if lower < floor:
        advice = (
            "the thrusts alone cannot make every moment and the vertical force there"
        )
        message = f"{message} at {place}: {advice}"
    found_check = check_of(
        "least_singular_value",
        lower >= floor,
        message,
        value=upper,
        limit=floor,
        place=place,
    )
    return found_check, lower


def _hover_thrust(geometry: Geometry, segments: Segments) -> Check:
    """Check that some positive thrusts carry the weight without torque."""
    found: Least = geometry.least_hover_thrust_along(segments.starts, segments.ends)
    lower, upper, segment, fraction = found.worst()
    place = segments.place(segment, fraction)
    state, message = State.UNDECIDED, f"least hover thrust {figure(upper)} of m·g"
    if lower > 0:
        state = State.HOLDS
    elif upper < IDLE_THRUST:
        state = State.BROKEN
        message = f"{message} at {place}: a rotor would have to idle or to push down"
    else:
        message = (
            f"{message} at {place}: undecided between rows, more rows may decide it"
        )
    return check_of("hover_thrust", state, message, value=upper, limit=0.0, place=place)
