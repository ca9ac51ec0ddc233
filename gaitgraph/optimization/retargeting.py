"""Retargeting: the flyable gait that is nearest to a given table of tilt angles, row by row.

A flyable gait lies on the red sheet, α3 = α1 and α4 = α2. For any row α and any point x of the (α1, α2) plane

    ‖α − (x, x)‖² = 2·‖x − m‖² + ½(α1 − α3)² + ½(α2 − α4)²,   m = ½(α1 + α3, α2 + α4),

so the nearest flyable tilt angles belong to the point of the flyable region that is nearest to m, and each row can be
moved by itself. A gait stays in one component of the region. So the rows of any flyable gait in that component are at
least as far from the given ones as the nearest points are: one by one, in the sum, the root mean square and the
largest. Where a straight segment from a row to the next leaves the component, rows are added along the shortest path
inside.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
import shapely
from shapely.affinity import translate

from gaitgraph.angles import angle_within, checked_floor, checked_number
from gaitgraph.arrays import freeze_arrays
from gaitgraph.errors import Advice, Infeasible, wrong
from gaitgraph.gait.gait import Gait
from gaitgraph.gait.given import gait_of, given_gait
from gaitgraph.gait.table import (
    ANGLES,
    Table,
    closing_time,
    is_closed,
    note_on_ends,
    surface_of,
    tilt_angles,
    warn_of_ends,
)
from gaitgraph.invertibility.coefficients import check_symmetric
from gaitgraph.invertibility.forms import FloatArray
from gaitgraph.invertibility.matrices import IntArray
from gaitgraph.pictured import Pictured
from gaitgraph.planning.shortest_paths import ShortestPaths
from gaitgraph.surface.admissible import admissible_region, why_empty
from gaitgraph.surface.region import Zones, offset, polygons_of
from gaitgraph.timing.timed_gait import table_of
from gaitgraph.tolerances import DEFAULT_FLOOR
from gaitgraph.validation.report import Report, verdict_of
from gaitgraph.validation.validating import validate

if TYPE_CHECKING:
    from collections.abc import Sequence

    from shapely import Polygon

    from gaitgraph.gait.given import GaitLike
    from gaitgraph.invertibility.coefficients import CoefficientsLike
    from gaitgraph.invertibility.matrices import BoolArray
    from gaitgraph.surface.region import Points, Region
    from gaitgraph.vehicle import VehicleLike

MOST_ROWS = 200_000
"""A longer table is refused: thin it out first."""

_ROUND_OFF = 1e-10  # what rounding may put a row, or a segment between two rows on a border, outside [rad]
_TURN = 2 * math.pi
_LITTLE = 0.5  # a smaller share of the motion is stated first
KEEP_HALF = Advice(
    f"to keep half of the motion, use keep={_LITTLE}",
    f"to keep half of the motion, use --keep {_LITTLE}",
)
_STILL = 1e-6  # a gait with a smaller share of the motion stands still
_THINNED = 1e-4  # how far a row may lie beside the corners by which a smaller loop is placed [rad]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Retargeted(Pictured):
    """The answer to :func:`retarget`: the nearest flyable gait, or why there is none. Truthy when there is one.

    `before` and `after` are the reports of the given and of the new gait; `reason` says why there is no gait, or why it
    is not flyable. `table` holds the new rows, with times if there were any. For each given row, `rows` has the number
    of its new row, from 0, and `moved` its distance in all four angles without whole turns, both of shape (n,) [rad];
    `unchanged` counts the rows that stayed as they were, bit by bit. `alternatives` are the summed distances to each
    component of the flyable region, the chosen one first [rad]. `share` is the length of the new loop of (α1, α2) over
    that of the given one, None if that is zero. Without `keep`, and with a share below one half, `advice` says how to
    keep half.
    """

    before: Report
    reason: str | None
    table: Table | None = None
    rows: IntArray = field(default_factory=lambda: np.empty(0, np.int64))
    moved: FloatArray = field(default_factory=lambda: np.empty(0))
    unchanged: int = 0
    after: Report | None = None
    alternatives: tuple[float, ...] = ()
    share: float | None = None
    advice: str | None = None
    warnings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def _shown(self) -> Any:
        return self.gait if self else None

    @property
    def status(self) -> Literal["unchanged", "retargeted", "infeasible"]:
        """Whether the gait is "unchanged" or "retargeted", or there is none: "infeasible"."""
        if self.table is None:
            return "infeasible"
        if self.added or self.unchanged < len(self.moved):
            return "retargeted"
        return "unchanged"

    def __bool__(self) -> bool:
        return self.table is not None

    @property
    def _moves(self) -> FloatArray:
        """How far each row was moved; Infeasible, with the reason, if there is no gait."""
        if self.table is None:
            raise Infeasible(self.reason)
        return self.moved

    @property
    def gait(self) -> Gait:
        """The new gait as a closed polyline, straight runs merged; Infeasible if there is none."""
        if self.table is None:
            raise Infeasible(self.reason)
        return gait_of(self.table)

    @property
    def total(self) -> float:
        """The sum of all rows' distances [rad]; no flyable gait in the same component has a smaller one."""
        return float(self._moves.sum())

    @property
    def rms(self) -> float:
        """The root mean square of the rows' distances [rad]."""
        return float(np.sqrt(np.mean(self._moves**2)))

    @property
    def largest(self) -> tuple[float, int]:
        """The largest distance [rad], and its row, counted from 1."""
        row = int(self._moves.argmax())
        return float(self.moved[row]), row + 1

    @property
    def added(self) -> int:
        """How many rows were added between the given ones."""
        if self.table is None:
            return 0
        return len(self.table) - len(self.rows)

    def as_mapping(self) -> dict[str, Any]:
        """Return the answer as plain values, ready for JSON; a saved one can be read as a gait file."""
        names = ("rows", "unchanged", "added", "total", "rms", "largest", "largest_row")
        answer: dict[str, Any] = {
            "status": self.status,
            "reason": self.reason,
            **dict.fromkeys(names),
            "share": self.share,
            "advice": self.advice,
            "moved": self.moved.tolist(),
            "new_rows": (self.rows + 1).tolist(),
            "path": [],
            "colors": [],
            "t": None,
            "alternatives": list(self.alternatives),
            "before": self.before.as_mapping(),
            **verdict_of(self.after),
            "warnings": list(self.warnings),
        }
        if self.table is not None and self.after is not None:
            counts = (len(self.moved), self.unchanged, self.added, self.total, self.rms)
            answer |= zip(names, counts + self.largest, strict=True)
            answer["path"] = self.table.alpha.tolist()
            answer["colors"] = list(self.table["color"])
            if "t" in self.table:
                answer["t"] = self.table["t"].tolist()
            answer["warnings"] += self.after.warnings
        return answer

    def __repr__(self) -> str:
        if not self:
            return "<Retargeted: infeasible>"
        return f"<Retargeted: {str(self).splitlines()[0]}>"

    def __str__(self) -> str:
        if self.after is None or self.table is None:
            return f"No gait: {self.reason}\nbefore: {self.before.verdict}"
        lines = []
        if _is_little(self.share):
            lines.append(self._little)
        lines.append(
            f"{self.status}: {self.unchanged} of {len(self.moved)} rows as they were, {self.added} added"
        )
        if self.status == "retargeted":
            far, row = self.largest
            moved = f"moved by {far:.4f} rad at most (row {row}), {self.rms:.4f} rad rms, {self.total:.4f} rad in sum"
            if self.share is not None:
                moved += f", {100 * self.share:.0f} % of the motion kept"
            lines.append(moved)
        for word, report in (("before: ", self.before), ("after:  ", self.after)):
            lines.append(word + report.verdict)
            if not report.flyable:
                lines.append(f"        {report.reason}")
        told = note_on_ends(self.table.alpha)
        notes = [note for note in self.after.notes if note != told]
        lines += [f"warning: {warning}" for warning in (*self.warnings, *notes)]
        return "\n".join(lines)

    @property
    def _little(self) -> str:
        """The line that says how little of the motion is kept."""
        share = self.share or 0.0
        kept = f"keeps {100 * share:.0f} % of the motion"
        if share < _STILL:
            kept = "stands still"
        text = f"The nearest flyable gait {kept}"
        if self.advice:
            text += f"; {self.advice}"
        return text


def retarget(
    source: GaitLike,
    *,
    vehicle: VehicleLike | None = None,
    coefficients: CoefficientsLike | None = None,
    sign: Literal["positive", "negative"] | None = None,
    floor: float = DEFAULT_FLOOR,
    keep_out: Sequence[Points] = (),
    keep_in: Sequence[Points] = (),
    margin: float = 0.0,
    keep: float | None = None,
) -> Retargeted:
    """Return the nearest flyable gait, row by row, and what was changed.

    The answer is falsy, with the reason, if nothing is flyable; InputError or FileProblem is raised if a value is not
    allowed, or a file holds no gait table.

    Parameters
    ----------
    source
        A gait in any form, see :func:`gaitgraph.gait.given.given_gait`. The segment back to the first row is implied.
    vehicle, coefficients
        Of the new gait; by default those of the source, else the paper's vehicle.
    sign, floor
        Sign of R, None for either; least singular value to keep.
    keep_out, keep_in
        Polygons as for :class:`gaitgraph.surface.region.Zones`.
    margin
        How far the new rows, and the paths between them, keep from the border of the flyable region [rad].
    keep
        Share of the motion to keep, above 0 and at most 1: the given loop of (α1, α2) is made smaller by this factor
        and moved into the region, by the least root mean square. None: rows move one by one.

    Notes
    -----
    A gait that is flyable inside the region is returned unchanged, bit by bit; so is an answer of this function. A row
    that is flyable by itself stays; one within the region's accuracy, 1e-6 rad, of its border may move by that.
    Whole turns of α3 or α4 against α1 or α2 are taken off, with a warning. Times stay; an added row has its time by its
    share of the path's length.

    Not guaranteed: that the whole curve is nearest in any sense, only its rows are; that no other component would need
    a shorter detour.

    Examples
    --------
    >>> rows = np.array([[0.4, -1.2, 0.5, -1.1], [0.4, -0.4, 0.4, -0.4], [1.2, -0.4, 1.1, -0.5]])
    >>> answer = retarget(rows)
    >>> answer.status, answer.unchanged, answer.largest[1], answer.after.flyable
    ('retargeted', 1, 1, True)
    >>> answer.table.alpha[0].round(3).tolist()
    [0.45, -1.15, 0.45, -1.15]
    """
    floor = checked_floor(floor)
    margin = angle_within(margin, "margin", least=0.0)
    if keep is not None:
        allowed = "above 0 and at most 1"
        keep = checked_number("keep", keep, allowed, above=True, most=1.0)
    table = _given_table(source)
    chosen, numbers, crossing_tolerance = surface_of(table, vehicle, coefficients)
    check_symmetric(numbers.rotors)
    zones = Zones(keep_out=keep_out, keep_in=keep_in)
    before = validate(table, vehicle=chosen, coefficients=numbers.kind, floor=floor)
    region = admissible_region(
        chosen, sign=sign, coefficients=numbers, floor=floor, zones=zones
    )
    refused = Retargeted(before=before, reason=None)
    if not region.components:
        return replace(refused, reason=why_empty(region, floor, chosen))
    if margin:
        region = replace(region, inner=polygons_of(offset(region.inner, -margin)))
    if not region.components:
        narrow = f"no point of the flyable region is {margin:g} rad from its border; use a smaller margin"
        return replace(refused, reason=narrow)

    given, turned = _without_turns(tilt_angles(table, numbers))
    loop = given[: len(given) - is_closed(given)]
    placements = _placements(loop, region.components, keep)
    if not placements:
        reason = f"{100 * (keep or 0.0):.3g} % of the motion fits nowhere; lower keep"
        return replace(refused, reason=reason)
    alpha, placed = given, np.arange(len(given))
    if not before.flyable or turned.any() or not _is_inside(loop, region):
        nearest = min(placements, key=lambda placement: placement.total)
        alpha, placed = _joined(nearest, closes=len(given) > len(loop))
    gait = Gait(
        alpha=alpha,
        colors=("red",) * len(alpha),
        vehicle=chosen,
        coefficients=numbers,
        crossing_tolerance=crossing_tolerance,
    )
    t = table.columns.get("t")
    if t is not None:
        t = _times(t, alpha, placed)
    new = _table_from(
        gait, t, made_by="retarget", sign=sign, floor=floor, margin=margin
    )
    after = validate(new, floor=floor)
    moved = np.linalg.norm(alpha[placed] - given, axis=1)
    share = _share(gait, loop)
    warnings = zones.notes
    if turned.any():
        warnings += (f"took whole turns off α3 or α4 in {turned.sum()} rows",)
    return Retargeted(
        before=before,
        reason=None if after.flyable else after.reason,
        table=new,
        rows=placed,
        moved=moved,
        unchanged=int(np.sum((moved == 0) & ~turned)),
        after=after,
        alternatives=tuple(sorted(placement.total for placement in placements)),
        share=share,
        advice=KEEP_HALF.python if keep is None and _is_little(share) else None,
        warnings=warnings,
    )


def _is_little(share: float | None) -> bool:
    return share is not None and share < _LITTLE


def _share(gait: Gait, loop: FloatArray) -> float | None:
    """Return the length of a gait over that of a loop, None if that is zero."""
    length = Gait(alpha=loop).length
    if length == 0:
        return None
    return gait.length / length


def _without_turns(alpha: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Return rows with α3 and α4 within half a turn of α1 and α2, and which rows lost whole turns; others stay."""
    turns = np.zeros(alpha.shape)
    turns[:, 2:] = np.rint((alpha[:, 2:] - alpha[:, :2]) / _TURN)
    turned = np.asarray(turns.any(axis=1))
    return np.where(turns == 0, alpha, alpha - _TURN * turns), turned


def _given_table(source: GaitLike) -> Table:
    """Return a gait in any form as a table of up to :data:`MOST_ROWS` rows that repeats; else InputError."""
    given = given_gait(source, once=False)
    if given.table is not None:
        table = given.table
    elif given.motion is not None:
        table = table_of(given.motion)
    else:
        table = _table_from(given.gait)
    warn_of_ends(table, given.file)
    if len(table) > MOST_ROWS:
        raise wrong("gait", f"must have at most {MOST_ROWS} rows", len(table))
    return table


def _table_from(gait: Gait, t: FloatArray | None = None, **about: Any) -> Table:
    """Return a gait's corners as the rows of a table, with times, and what made it."""
    columns: dict[str, Any] = {}
    if t is not None:
        columns["t"] = t
    columns |= zip(ANGLES, gait.alpha.T.copy(), strict=True)
    if gait.colors:
        columns |= {"color": gait.colors, "types": gait.types, "R": gait.R}
    shared = {
        "vehicle": gait.vehicle.as_mapping(),
        "coefficients": gait.coefficients.kind,
        "crossing_tolerance": gait.crossing_tolerance,
    }
    return Table(columns=columns, about=shared | about)


def _is_inside(rows: FloatArray, region: Region) -> bool:
    """Return whether the loop through rows lies in the region, to twice its accuracy."""
    loop = shapely.linestrings(np.vstack([rows, rows[:1]])[:, :2])
    return bool(shapely.covers(offset(region.inner, 2 * region.accuracy), loop))


class _Placement(NamedTuple):
    """Where the rows go in one component: points (α1, α2), and the sum of their distances in four dimensions [rad]."""

    part: Polygon
    plane: FloatArray
    total: float


def _placements(
    rows: FloatArray, parts: Sequence[Polygon], keep: float | None
) -> list[_Placement]:
    """Return where the rows go in each component, in which they fit: to the nearest points, or as a smaller loop."""
    placements = []
    middle = (rows[:, :2] + rows[:, 2:]) / 2
    for part in parts:
        wanted: FloatArray | None = middle
        if keep is not None:
            wanted = _smaller(rows[:, :2], keep, part, middle.mean(axis=0))
        if wanted is not None:
            plane = _nearest(wanted, part)
            moves = np.linalg.norm(np.hstack([plane, plane]) - rows, axis=1)
            placements.append(_Placement(part, plane, float(moves.sum())))
    return placements


def _nearest(plane: FloatArray, part: Polygon) -> FloatArray:
    """Return the points of a component nearest to given ones; those inside it stay, bit by bit."""
    points: Any = shapely.points(plane)
    nearest = shapely.get_coordinates(shapely.shortest_line(part, points))[::2]
    is_inside = shapely.dwithin(part, points, _ROUND_OFF)
    return np.where(is_inside[:, None], plane, nearest)


def _smaller(
    plane: FloatArray, share: float, part: Polygon, wanted: FloatArray
) -> FloatArray | None:
    """Return a loop made smaller by a factor, inside a component, with its mean as near to a wanted point as possible.

    The means that keep one row in the component form the component moved by minus the row. None if nothing fits.
    """
    shape = share * (plane - plane.mean(axis=0))
    corners = shapely.get_coordinates(
        shapely.simplify(shapely.linestrings(np.vstack([shape, shape[:1]])), _THINNED)
    )
    means = shapely.intersection_all([translate(part, *-by) for by in corners])
    if means.is_empty:
        return None
    line = shapely.shortest_line(means, shapely.Point(wanted))
    return np.asarray(shape + shapely.get_coordinates(line)[0])


def _joined(placement: _Placement, *, closes: bool) -> tuple[FloatArray, IntArray]:
    """Return red rows through points, and the points' numbers; `closes` is whether the first row follows the last.

    Rows are added where a segment leaves the component.
    """
    part, plane, _ = placement
    ends = np.roll(plane, -1, axis=0)
    around = offset(part, _ROUND_OFF)
    shapely.prepare(around)
    lines: Any = shapely.linestrings(np.stack([plane, ends], axis=1))
    leaves = ~shapely.covers(around, lines)
    paths = ShortestPaths(part)
    pieces = []
    for start, end, bends in zip(plane, ends, leaves, strict=True):
        piece: Any = start[None]
        if bends:
            path: Any = paths.path(start, end)
            piece = np.vstack([start, path[1:-1]])
        pieces.append(piece)
    if closes:
        pieces.append(plane[:1])
    new = np.concatenate(pieces)
    lengths = np.array(list(map(len, pieces)))
    return np.hstack([new, new]), np.cumsum(lengths) - lengths


def _times(t: FloatArray, alpha: FloatArray, placed: IntArray) -> FloatArray:
    """Return the time of each new row: given rows keep theirs, added ones get theirs by length."""
    steps = np.linalg.norm(np.diff(alpha, axis=0, append=alpha[:1]), axis=1)
    gone = np.append(0.0, np.cumsum(steps))
    # The way back to the first row takes until the time at which the period ends.
    ends = np.append(t, closing_time(t[0], t[-1], len(t)))
    times = np.interp(gone[:-1], gone[np.append(placed, -1)], ends)
    times[placed] = t
    return np.asarray(times)
