"""Retargeting: the flyable gait that is nearest to a given table of tilt angles, row by row.

A flyable gait lies on the red sheet, α3 = α1 and α4 = α2. For any row α and any point x of the (α1, α2) plane

    ‖α − (x, x)‖² = 2·‖x − m‖² + ½(α1 − α3)² + ½(α2 − α4)²,   m = ½(α1 + α3, α2 + α4),

so the nearest flyable tilt angles belong to the point of the flyable region that is nearest to m, and each row can be
moved by itself. A gait stays in one component of the region. So the rows of any flyable gait in that component are at
least as far from the given ones as the nearest points are: one by one, in the sum, the root mean square and the
largest. Where a straight way from a row to the next leaves the component, rows are added along the shortest way inside.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import number_of
from gaitgraph.errors import InputError, did_you_mean, shown
from gaitgraph.gait.gait import Gait
from gaitgraph.gait.rows import closing_time, is_closed, tilt_angles
from gaitgraph.gait.table import ANGLES, Table, setting_of
from gaitgraph.invertibility.matrices import DEFAULT_FLOOR, Kind, coefficients_of, level_determinant
from gaitgraph.io.frames import as_table
from gaitgraph.io.reading import read_table
from gaitgraph.optimization.retargeted import Retargeted
from gaitgraph.planning.shortest_paths import ShortestPaths
from gaitgraph.surface.adjacency import text_from_types
from gaitgraph.surface.admissible import admissible_region, why_empty
from gaitgraph.surface.region import Zones
from gaitgraph.surface.sheets import types_of
from gaitgraph.timing.timed_gait import TimedGait, table_of
from gaitgraph.validation.checks import checked_limits
from gaitgraph.validation.validating import validate

if TYPE_CHECKING:
    from shapely import Polygon

    from gaitgraph.surface.region import Region
    from gaitgraph.vehicle import Vehicle

__all__ = ["MOST_ROWS", "retarget"]

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]

MOST_ROWS = 200_000
"""A longer table is refused: thin it out first."""

_TOUCH = 1e-10  # what rounding may put a row, or a segment between two rows on a border, outside [rad]
_TURN = 2 * math.pi


def retarget(
    source: Gait | TimedGait | Table | str | Path | npt.ArrayLike,
    *,
    vehicle: Vehicle | None = None,
    coefficients: Kind | None = None,
    sign: Literal["positive", "negative"] | None = None,
    floor: float = DEFAULT_FLOOR,
    keep_out: Any = (),
    keep_in: Any = (),
    margin: float = 0.0,
) -> Retargeted:
    """Return the flyable gait whose rows are nearest to those of a table, and what was changed.

    Parameters
    ----------
    source
        Rows (α1, α2, α3, α4), shape (n, 4) [rad]; a table, or the path of one; a gait or a timed one. The way back to
        the first row is implied.
    vehicle, coefficients
        What the gait is to be for; by default what the source says, else the paper's vehicle.
    sign
        Sign of R, or None for either.
    floor
        Least singular value to keep.
    keep_out, keep_in
        Polygons as for :class:`gaitgraph.surface.region.Zones`.
    margin
        How far the new rows, and the ways between them, keep from the border of the flyable region [rad].

    Returns
    -------
    Retargeted
        Falsy, with the reason, if nothing is flyable.

    Raises
    ------
    InputError, FileProblem
        If a value is not allowed, or a file holds no gait table.

    Notes
    -----
    What is flyable already, and where it may be, comes back unchanged, bit by bit; so does what this function returned.
    A row that is flyable by itself stays; one within the region's accuracy, 1e-6 rad, of its border may move by that.
    A row whose opposite arms differ by about half a turn is on the red sheet too, but one of the two rotors would push
    down; it moves far. Whole turns of α3 or α4 against α1 or α2 are taken off, and told.

    Times stay. An added row has the time at which its share of the way's length is gone. If the vehicle's limits of
    rates then fail, the report says so, and which period would do.

    Not guaranteed: that the whole curve is nearest in any sense, only its rows are; that no other component would need
    a shorter way around.

    Examples
    --------
    >>> rows = np.array([[0.4, -1.2, 0.5, -1.1], [0.4, -0.4, 0.4, -0.4], [1.2, -0.4, 1.1, -0.5]])
    >>> answer = retarget(rows)
    >>> answer.status, answer.unchanged, answer.largest[1], answer.after.flyable
    ('retargeted', 1, 1, True)
    >>> answer.table.alpha[0].round(3).tolist()
    [0.45, -1.15, 0.45, -1.15]
    """
    checked_limits(0.0, floor, None)
    if not 0 <= number_of(margin) < math.inf:
        raise InputError(f"margin: {shown(margin)}; allowed is a finite number ≥ 0 (rad)")
    if sign not in (None, "positive", "negative"):
        hint = did_you_mean(sign, ["positive", "negative"]) if isinstance(sign, str) else ""
        raise InputError(f"sign: {shown(sign)}; allowed are 'positive', 'negative' and None{hint}")
    table = _table_of(source, vehicle, coefficients)
    if len(table) > MOST_ROWS:
        raise InputError(f"gait: {len(table)} rows; allowed are {MOST_ROWS} at most")
    chosen, numbers, _ = setting_of(table, vehicle, coefficients)
    given = any(not isinstance(part, (list, tuple)) or part for part in (keep_out, keep_in))
    zones = Zones(keep_out=keep_out, keep_in=keep_in) if given else None
    before = validate(table, vehicle=chosen, coefficients=numbers.kind, floor=floor)
    region = admissible_region(chosen, use="flyable", sign=sign, coefficients=numbers, floor=floor, zones=zones)
    parts = _parts(region, float(margin))
    if not parts:
        return Retargeted(before=before, reason=_why_empty(region, float(margin), floor, chosen))
    original, closing = _open_rows(table)
    rows, turned = _without_turns(original)
    notes = () if not turned.any() else (f"took whole turns off α3 or α4 in {int(turned.any(axis=1).sum())} rows",)
    flown = before.flyable and not turned.any()
    best, totals = _nearest_part(parts, rows)
    if flown and _may_stay(region, rows, margin, sign, chosen):
        placed, new = np.arange(len(rows)), rows
    else:
        on_sheet = _moved(rows, parts[best])
        new, placed = _joined(on_sheet, parts[best])
    distance = np.linalg.norm(new[placed] - rows, axis=1)
    middle = (rows[:, :2] + rows[:, 2:]) / 2
    made = {"made_by": "retarget", "sign": sign, "floor": float(floor), "margin": float(margin)}
    fresh = _as_table(table, new, placed, closing, chosen, numbers, made)
    after = validate(fresh, vehicle=chosen, coefficients=numbers.kind, floor=floor)
    order = [best, *(k for k in np.argsort(totals, kind="stable").tolist() if k != best)]
    return Retargeted(
        before=before,
        reason=None if after.flyable else after.reason,
        table=fresh,
        rows=np.append(placed, len(fresh) - 1) if closing else placed,
        moved=np.append(distance, distance[0]) if closing else distance,
        plane_moved=_again(np.linalg.norm(new[placed][:, :2] - middle, axis=1), closing),
        after=after,
        alternatives=tuple(float(totals[k]) for k in order),
        warnings=notes,
    )


def _again(values: FloatArray, closing: bool) -> FloatArray:
    return np.append(values, values[0]) if closing else values


def _table_of(source: Any, vehicle: Vehicle | None, coefficients: Kind | None) -> Table:
    """Return what was given as a table with all four angles."""
    source = as_table(source)
    if isinstance(source, (str, Path)):
        source = read_table(source)
    if isinstance(source, Table):
        if "alpha3" in source:
            return source
        _, numbers, _ = setting_of(source, vehicle, coefficients)
        names = dict(zip(ANGLES, tilt_angles(source, numbers).T.copy(), strict=True))
        return replace(source, columns={"t": source["t"], **names} if "t" in source else names)
    if isinstance(source, TimedGait):
        return table_of(source)
    if isinstance(source, Gait):
        about = {
            "vehicle": source.vehicle.as_mapping(),
            "coefficients": source.coefficients.kind,
            "crossing_tolerance": source.crossing_tolerance,
        }
        columns: dict[str, Any] = dict(zip(ANGLES, source.alpha.T.copy(), strict=True))
        if source.colors:
            columns["color"] = source.colors
        return Table(columns=columns, about=about)
    try:
        rows = np.array(source, dtype=float)
    except (TypeError, ValueError) as error:
        raise InputError(
            f"gait: {shown(source)}; allowed are rows of four angles, a table, a gait or a path"
        ) from error
    if rows.ndim != 2 or rows.shape[1] != 4 or not len(rows):
        raise InputError(f"gait: an array of shape {rows.shape}; allowed is (n, 4) with n at least 1")
    if not np.isfinite(rows).all():
        raise InputError(f"gait: {float(rows[~np.isfinite(rows)][0])!r}; allowed are finite angles in radians")
    return Table(columns=dict(zip(ANGLES, rows.T.copy(), strict=True)))


def _open_rows(table: Table) -> tuple[FloatArray, bool]:
    """Return the rows without one that closes the table, and whether there is one."""
    rows, closing = table.alpha, is_closed(table)
    return (rows[:-1] if closing else rows), closing


def _without_turns(rows: FloatArray) -> tuple[FloatArray, npt.NDArray[np.int64]]:
    """Return rows whose α3 and α4 are within half a turn of α1 and α2, and the turns that were taken off."""
    turns = np.rint((rows[:, 2:] - rows[:, :2]) / _TURN)
    fresh = rows.copy()
    fresh[:, 2:] -= _TURN * turns
    return np.where(np.tile(turns != 0, 2), fresh, rows), turns.astype(np.int64)


def _parts(region: Region, margin: float) -> list[Polygon]:
    """Return the components of the flyable region, clear of its border."""
    if margin == 0:
        return list(region.components)
    import shapely

    shrunk = shapely.get_parts(shapely.buffer(region.inner, -margin, join_style="mitre"))
    kept = [part for part in shrunk if part.geom_type == "Polygon" and part.area > 0]
    return sorted(kept, key=lambda part: (-part.area, part.bounds))


def _why_empty(region: Region, margin: float, floor: float, vehicle: Vehicle) -> str:
    if region.components:
        return f"no point of the flyable region is {margin:g} rad from its border: allow a smaller margin"
    return why_empty(region, floor, vehicle)


def _nearest_part(parts: list[Polygon], rows: FloatArray) -> tuple[int, FloatArray]:
    """Return the component with the least summed distance in four dimensions, and the sums."""
    import shapely

    middle: Any = shapely.points((rows[:, :2] + rows[:, 2:]) / 2)
    off = np.sum((rows[:, :2] - rows[:, 2:]) ** 2, axis=1) / 2
    totals = np.array([np.sqrt(2 * shapely.distance(part, middle) ** 2 + off).sum() for part in parts])
    return int(np.argmin(totals)), totals


def _may_stay(region: Region, rows: FloatArray, margin: float, sign: str | None, vehicle: Vehicle) -> bool:
    """Return whether rows that are flyable are where they may be."""
    import shapely

    if sign is not None:
        positive = bool(level_determinant(rows[0], coefficients_of(vehicle, "exact")) > 0)
        if positive != (sign == "positive"):
            return False
    closed = np.vstack([rows[:, :2], rows[:1, :2]])
    line = shapely.linestrings(closed) if len(rows) > 1 else shapely.points(rows[0, :2])
    room = shapely.buffer(region.inner, -margin, join_style="mitre") if margin else region.inner
    return bool(shapely.covers(shapely.buffer(room, 2 * region.accuracy, join_style="mitre"), line))


def _moved(rows: FloatArray, part: Polygon) -> FloatArray:
    """Return the nearest rows on the red sheet above a component; rows that are there stay, bit by bit."""
    import shapely

    plane = (rows[:, :2] + rows[:, 2:]) / 2
    points: Any = shapely.points(plane)
    outside = shapely.distance(part, points) > _TOUCH
    if outside.any():
        ways = shapely.get_coordinates(shapely.shortest_line(part, points[outside])).reshape(-1, 2, 2)
        plane[outside] = ways[:, 0]
    return np.asarray(np.hstack([plane, plane]))


def _joined(rows: FloatArray, part: Polygon) -> tuple[FloatArray, npt.NDArray[np.int64]]:
    """Return rows with others added where a straight way leaves the component, and the numbers of the given ones."""
    import shapely

    ends = np.roll(rows, -1, axis=0)
    room = shapely.buffer(part, _TOUCH, join_style="mitre")
    shapely.prepare(room)
    lines = shapely.linestrings(np.stack([rows[:, :2], ends[:, :2]], axis=1))
    straight = np.asarray(shapely.covers(room, lines)) | (rows == ends).all(axis=1)
    ways = None if straight.all() else ShortestPaths(part)
    new: list[FloatArray] = []
    numbers = []
    count = 0
    for row, end, is_straight in zip(rows, ends, straight.tolist(), strict=True):
        numbers.append(count)
        new.append(row[None])
        count += 1
        bends = np.zeros((0, 2)) if is_straight or ways is None else _bends(ways, row[:2], end[:2])
        new.append(np.hstack([bends, bends]))
        count += len(bends)
    return np.concatenate(new), np.array(numbers, dtype=np.int64)


def _bends(paths: ShortestPaths, start: FloatArray, end: FloatArray) -> FloatArray:
    """Return the corners at which the shortest way bends, shape (k, 2)."""
    way = paths.path(start, end)
    return np.zeros((0, 2)) if way is None else np.asarray(way[1:-1])


def _as_table(
    table: Table,
    rows: FloatArray,
    placed: npt.NDArray[np.int64],
    closing: bool,
    vehicle: Vehicle,
    numbers: Any,
    made: dict[str, Any],
) -> Table:
    """Return the new rows as a table, with times if there were any, closed if it was."""
    _, _, tolerance = setting_of(table, vehicle, numbers.kind)
    columns: dict[str, Any] = {}
    if "t" in table:
        columns["t"] = _times(table["t"], rows, placed, closing)
    closed = np.vstack([rows, rows[:1]]) if closing else rows
    third, fourth = types_of("red", closed[:, 0], closed[:, 1], numbers, tolerance)
    columns |= dict(zip(ANGLES, closed.T.copy(), strict=True))
    columns |= {
        "color": ("red",) * len(closed),
        "types": tuple(text_from_types(int(a), int(b)) for a, b in zip(third, fourth, strict=True)),
        "R": np.asarray(level_determinant(closed, numbers)),
    }
    about = {"vehicle": vehicle.as_mapping(), "coefficients": numbers.kind, "crossing_tolerance": tolerance}
    return Table(columns=columns, about={**about, **made})


def _times(t: FloatArray, rows: FloatArray, placed: npt.NDArray[np.int64], closing: bool) -> FloatArray:
    """Return the time of each new row: given rows keep theirs, added ones share what lies between by length."""
    total = len(rows)
    known = np.append(placed, total)
    end = t[-1] if closing else closing_time(t[0], t[-1], len(t))
    times = np.append(t[: len(placed)], end)
    size = np.linalg.norm(np.roll(rows, -1, axis=0) - rows, axis=1)
    gone = np.concatenate([[0.0], np.cumsum(size)])
    out = np.empty(total + 1)
    for first, last, start, stop in zip(known[:-1], known[1:], times[:-1], times[1:], strict=True):
        length = gone[last] - gone[first]
        share = (gone[first:last] - gone[first]) / length if length > 0 else np.arange(last - first) / (last - first)
        out[first:last] = start + share * (stop - start)
    out[-1] = end
    return out if closing else out[:-1]
