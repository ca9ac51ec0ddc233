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
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import shapely
from shapely.affinity import translate

from gaitgraph.angles import angle_within, checked_number, number_of
from gaitgraph.arrays import freeze_arrays
from gaitgraph.errors import Advice, Infeasible, InputError, shown
from gaitgraph.gait.gait import Gait
from gaitgraph.gait.table import (
    ANGLES,
    Table,
    check_repeats,
    closing_time,
    is_closed,
    surface_of,
    tilt_angles,
    warn_of_ends,
)
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.invertibility.matrices import level_determinant
from gaitgraph.io.formats import gait_of, given_gait, naming_file
from gaitgraph.planning.shortest_paths import ShortestPaths
from gaitgraph.surface.admissible import admissible_region, why_empty
from gaitgraph.surface.region import Zones, offset, polygons_of
from gaitgraph.timing.timed_gait import table_of
from gaitgraph.tolerances import DEFAULT_FLOOR
from gaitgraph.validation.report import verdict_of
from gaitgraph.validation.validating import validate

if TYPE_CHECKING:
    from collections.abc import Sequence

    from shapely import Polygon

    from gaitgraph.invertibility.coefficients import CoefficientsLike
    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.invertibility.matrices import IntArray
    from gaitgraph.io.formats import GaitLike
    from gaitgraph.surface.region import Points
    from gaitgraph.validation.report import Report
    from gaitgraph.vehicle import VehicleLike

MOST_ROWS = 200_000
"""A longer table is refused: thin it out first."""

_ROUND_OFF = 1e-10  # what rounding may put a row, or a segment between two rows on a border, outside [rad]
_TURN = 2 * math.pi
_LITTLE = (
    0.5  # a smaller share of the motion is said first, with what would keep as much
)
KEEP_HALF = Advice(f"for it, use keep={_LITTLE}", f"for it, use --keep {_LITTLE}")
_THINNED = 1e-4  # how far a row may lie beside the corners by which a smaller loop is placed [rad]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Retargeted:
    """The answer to :func:`retarget`: the nearest flyable gait, or why there is none. Truthy when there is one.

    `before` and `after` are the reports of the given and of the new gait; `reason` says why there is no gait, or why it
    is not flyable. `table` holds the new rows, with times if there were any. For each given row, `rows` has the number
    of its new row, from 0, and `moved` its distance in all four angles without whole turns, both of shape (n,) [rad];
    `unchanged` counts the rows that stayed as they were, bit by bit. `alternatives` are the summed distances to each
    component of the flyable region, the chosen one first [rad]. `share` is the length of the new loop of (α1, α2) over
    that of the given one, None if that is zero. Without `keep`, and with a share below one half, `moving` is the
    nearest gait that keeps half, and `advice` says how to ask for it.
    """

    before: Report
    reason: str | None
    table: Table | None = None
    rows: IntArray | None = None
    moved: FloatArray | None = None
    unchanged: int = 0
    after: Report | None = None
    alternatives: tuple[float, ...] = ()
    share: float | None = None
    moving: Retargeted | None = None
    advice: str | None = None
    warnings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def status(self) -> Literal["unchanged", "retargeted", "infeasible"]:
        """Whether the gait is "unchanged" or "retargeted", or there is none: "infeasible"."""
        if self.table is None:
            return "infeasible"
        return (
            "retargeted"
            if self.added or self.unchanged < len(self._moves())
            else "unchanged"
        )

    def __bool__(self) -> bool:
        return self.table is not None

    def _moves(self) -> FloatArray:
        if self.moved is None:
            raise Infeasible(self.reason)
        return self.moved

    @property
    def gait(self) -> Gait:
        """The new gait as a closed polyline, straight runs merged; Infeasible if there is none."""
        self._moves()
        return gait_of(self.table)  # type: ignore[arg-type]

    @property
    def total(self) -> float:
        """The sum of all rows' distances [rad]; no flyable gait in the same component has a smaller one."""
        return float(self._moves().sum())

    @property
    def rms(self) -> float:
        """The root mean square of the rows' distances [rad]."""
        return float(np.sqrt(np.mean(self._moves() ** 2)))

    @property
    def largest(self) -> tuple[float, int]:
        """The largest distance [rad], and its row, counted from 1."""
        row = int(np.argmax(self._moves()))
        return float(self._moves()[row]), row + 1

    @property
    def added(self) -> int:
        """How many rows were added between the given ones."""
        return (
            0
            if self.table is None or self.rows is None
            else len(self.table) - len(self.rows)
        )

    def as_mapping(self) -> dict[str, Any]:
        """Return the answer as plain values, ready for JSON; a saved one can be read as a gait file."""
        columns = self.table.columns if self.table is not None else {}
        largest, row = self.largest if self else (None, None)
        return {
            "status": self.status,
            "reason": self.reason,
            "rows": None if self.moved is None else len(self.moved),
            **{
                name: getattr(self, name) if self else None
                for name in ("unchanged", "added", "total", "rms")
            },
            "largest": largest,
            "largest_row": row,
            "share": self.share,
            "moving": None if self.moving is None else self.moving.as_mapping(),
            "advice": self.advice,
            "moved": [] if self.moved is None else self.moved.tolist(),
            "new_rows": [] if self.rows is None else (self.rows + 1).tolist(),
            "path": [] if self.table is None else self.table.alpha.tolist(),
            "colors": list(columns.get("color", ())),
            "t": columns["t"].tolist() if "t" in columns else None,
            "alternatives": list(self.alternatives),
            "before": self.before.as_mapping(),
            **verdict_of(self.after),
            "warnings": [
                *self.warnings,
                *(() if self.after is None else self.after.warnings),
            ],
        }

    def __repr__(self) -> str:
        return f"<Retargeted: {str(self).splitlines()[0] if self else 'infeasible'}>"

    def __str__(self) -> str:
        if self.after is None:
            return f"No gait: {self.reason}\nbefore: {self.before.verdict}"
        lines = [
            f"{self.status}: {self.unchanged} of {len(self._moves())} rows as they were, {self.added} added"
        ]
        if self.share is not None and self.share < _LITTLE:
            kept = (
                "stands still"
                if self.share < 1e-6
                else f"keeps {100 * self.share:.0f} % of the motion"
            )
            lines.insert(0, f"The nearest flyable gait {kept}.")
            if self.moving is not None:
                wanted = f"The nearest that keeps half is moved by {self.moving.largest[0]:.4f} rad at most"
                lines[0] += f" {wanted}; {self.advice}"
        if self.status == "retargeted":
            far, row = self.largest
            sums = f"{self.rms:.4f} rad rms, {self.total:.4f} rad in sum"
            kept = (
                ""
                if self.share is None
                else f", {100 * self.share:.0f} % of the motion kept"
            )
            lines.append(f"moved by {far:.4f} rad at most (row {row}), {sums}{kept}")
        for word, report in (("before: ", self.before), ("after:  ", self.after)):
            lines += [
                word + report.verdict,
                *([] if report.flyable else [f"        {report.reason}"]),
            ]
        return "\n".join(
            [*lines, *(f"warning: {warning}" for warning in self.warnings)]
        )


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
        A gait in any form, see :func:`gaitgraph.io.formats.given_gait`. The segment back to the first row is implied.
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
    floor, margin = (
        checked_number("floor", floor),
        angle_within(margin, "margin", least=0.0),
    )
    if keep is not None and not 0 < number_of(keep) <= 1:
        raise InputError(
            f"keep must be above 0 and at most 1, got {shown(keep)}", field="keep"
        )
    table = _given_table(source)
    chosen, numbers, crossing_tolerance = surface_of(table, vehicle, coefficients)
    zones = Zones(keep_out=keep_out, keep_in=keep_in)
    before = validate(table, vehicle=chosen, coefficients=numbers.kind, floor=floor)
    region = admissible_region(
        chosen, sign=sign, coefficients=numbers, floor=floor, zones=zones
    )
    inside = (
        replace(region, inner=polygons_of(offset(region.inner, -margin)))
        if margin
        else region
    )
    parts = inside.components
    if not parts:
        narrow = f"no point of the flyable region is {margin:g} rad from its border; use a smaller margin"
        return Retargeted(
            before=before,
            reason=narrow if region.components else why_empty(region, floor, chosen),
        )

    # The rows without the closing one, and with α3 and α4 within half a turn of α1 and α2.
    given = tilt_angles(table, numbers)
    turns = np.rint((given[:, 2:] - given[:, :2]) / _TURN)
    given = np.hstack(
        [given[:, :2], np.where(turns == 0, given[:, 2:], given[:, 2:] - _TURN * turns)]
    )
    turned, closing = turns.any(axis=1), is_closed(given)
    rows = given[: len(given) - closing]

    targets, totals = _targets(rows, parts, keep)
    if np.isnan(totals).all():
        return Retargeted(
            before=before,
            reason=f"{100 * number_of(keep):.3g} % of the motion fits nowhere; lower keep",
        )
    best = int(np.nanargmin(totals))
    middle = targets[best]
    points: Any = shapely.points(middle)

    # Rows that are flyable where they may be stay as they are.
    new, placed = rows, np.arange(len(rows))
    loop: Any = shapely.linestrings(np.vstack([rows, rows[:1]])[:, :2])
    if (
        turned.any()
        or not before.flyable
        or (
            sign
            and (sign == "positive")
            != (level_determinant(rows[0], coefficients_of(chosen, "exact")) > 0)
        )
        or not shapely.covers(offset(inside.inner, 2 * region.accuracy), loop)
    ):
        # Others go to the nearest point of the component; those on the red sheet above it stay, bit by bit.
        outside = shapely.distance(parts[best], points) > _ROUND_OFF
        segments = shapely.get_coordinates(
            shapely.shortest_line(parts[best], points[outside])
        ).reshape(-1, 2, 2)
        middle[outside] = segments[:, 0]
        new, placed = _joined(middle, parts[best])

    t = _times(table["t"], new, placed, closing) if "t" in table else None
    if closing:  # the closing row moves with the others, to the first
        new = given if new is rows else np.vstack([new, new[:1]])
        placed = np.append(placed, len(new) - 1)
    shared: Any = {
        "vehicle": chosen,
        "coefficients": numbers,
        "crossing_tolerance": crossing_tolerance,
    }
    gait = Gait(alpha=new, colors=("red",) * len(new), **shared)
    fresh = _table_from(
        gait, t, made_by="retarget", sign=sign, floor=floor, margin=margin
    )
    after = validate(fresh, vehicle=chosen, coefficients=numbers.kind, floor=floor)
    moved = np.linalg.norm(new[placed] - given, axis=1)
    length, moving = Gait(alpha=rows).length, None
    share = gait.length / length if length > 0 else None
    if keep is None and share is not None and share < _LITTLE:
        shared = {
            "vehicle": chosen,
            "coefficients": numbers.kind,
            "sign": sign,
            "floor": floor,
            "margin": margin,
        }
        moving = (
            retarget(table, **shared, keep_out=keep_out, keep_in=keep_in, keep=_LITTLE)
            or None
        )
    return Retargeted(
        before=before,
        reason=None if after.flyable else after.reason,
        table=fresh,
        rows=placed,
        moved=moved,
        unchanged=int(np.sum((moved == 0) & ~turned)),
        after=after,
        alternatives=tuple(np.sort(totals[~np.isnan(totals)]).tolist()),
        share=share,
        moving=moving,
        advice=None if moving is None else KEEP_HALF.python,
        warnings=(
            *zones.notes,
            *[f"took whole turns off α3 or α4 in {turned.sum()} rows"]
            * bool(turned.any()),
        ),
    )


def _targets(
    rows: FloatArray, parts: Sequence[Polygon], keep: float | None
) -> tuple[list[FloatArray], FloatArray]:
    """Return what rows are moved towards in each component, points (α1, α2), and the summed distances to it.

    Distances are in four dimensions. With `keep` the points are those of a smaller loop, NaN where it does not fit.
    """
    middle, off = (
        (rows[:, :2] + rows[:, 2:]) / 2,
        np.sum((rows[:, :2] - rows[:, 2:]) ** 2, axis=1) / 2,
    )
    targets = [
        middle
        if keep is None
        else _smaller(rows[:, :2], keep, part, middle.mean(axis=0))
        for part in parts
    ]
    squares = np.sum((np.array(targets) - middle) ** 2, axis=2)
    if keep is None:
        squares = (
            shapely.distance(np.array(parts)[:, None], shapely.points(middle)) ** 2
        )
    return targets, np.sqrt(2 * squares + off).sum(axis=1)


def _smaller(
    plane: FloatArray, share: float, part: Polygon, wanted: FloatArray
) -> FloatArray:
    """Return a loop made smaller by a factor, inside a component, with its mean as near to a wanted point as possible.

    The means that keep one row in the component form the component moved by minus the row. NaN if nothing fits.
    """
    shape = share * (plane - plane.mean(axis=0))
    corners = shapely.get_coordinates(
        shapely.simplify(shapely.linestrings(np.vstack([shape, shape[:1]])), _THINNED)
    )
    means = shapely.intersection_all([translate(part, *-by) for by in corners])
    if means.is_empty:
        return np.full_like(shape, np.nan)
    return np.asarray(
        shape
        + shapely.get_coordinates(shapely.shortest_line(means, shapely.Point(wanted)))[
            0
        ]
    )


def _given_table(source: GaitLike) -> Table:
    """Return a gait in any form as a table of up to :data:`MOST_ROWS` rows that repeats; else InputError."""
    given = given_gait(source)
    if isinstance(given, Table):
        table = given
    elif isinstance(given, Gait):
        table = _table_from(given)
    else:
        table = table_of(given)
    with naming_file(source):
        check_repeats(table)
    warn_of_ends(table, source)
    if len(table) > MOST_ROWS:
        raise InputError(f"gait must have at most {MOST_ROWS} rows, got {len(table)}")
    return table


def _table_from(gait: Gait, t: FloatArray | None = None, **about: Any) -> Table:
    """Return a gait's corners as the rows of a table, with times, and what made it."""
    columns: dict[str, Any] = {} if t is None else {"t": t}
    columns |= dict(zip(ANGLES, gait.alpha.T.copy(), strict=True))
    if gait.colors:
        columns |= {"color": gait.colors, "types": gait.types, "R": gait.R}
    shared = {
        "vehicle": gait.vehicle.as_mapping(),
        "coefficients": gait.coefficients.kind,
    }
    return Table(
        columns=columns,
        about={**shared, "crossing_tolerance": gait.crossing_tolerance, **about},
    )


def _joined(plane: FloatArray, part: Polygon) -> tuple[FloatArray, IntArray]:
    """Return red rows through points, others added where a segment leaves the component, and the points' numbers."""
    ends = np.roll(plane, -1, axis=0)
    around = offset(part, _ROUND_OFF)
    shapely.prepare(around)
    lines = shapely.linestrings(np.stack([plane, ends], axis=1))
    bent = np.flatnonzero(
        ~(shapely.covers(around, lines) | (plane == ends).all(axis=1))
    ).tolist()
    paths: Any = ShortestPaths(part) if bent else None
    pieces = [plane[k : k + 1] for k in range(len(plane))]
    for k in bent:
        if (path := paths.path(plane[k], ends[k])) is not None:
            pieces[k] = np.vstack([plane[k], path[1:-1]])
    new = np.concatenate(pieces)
    return np.hstack([new, new]), np.cumsum([0, *(len(piece) for piece in pieces[:-1])])


def _times(
    t: FloatArray, rows: FloatArray, placed: IntArray, closing: bool
) -> FloatArray:
    """Return the time of each new row: given rows keep theirs, added ones get theirs by length."""
    gone = np.concatenate(
        [[0.0], np.cumsum(np.linalg.norm(np.roll(rows, -1, axis=0) - rows, axis=1))]
    )
    given = t[: len(placed)]
    end = t[-1] if closing else closing_time(t[0], t[-1], len(t))
    times = np.interp(gone, gone[np.append(placed, len(rows))], np.append(given, end))
    times[placed] = given
    return np.asarray(times if closing else times[:-1])
