"""From tables to gaits and back: closing, lifting, completing, and exporting files."""

from __future__ import annotations

from collections import deque
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.errors import GaitgraphError
from gaitgraph.gait.completing import completed_pieces
from gaitgraph.gait.gait import Gait, lift
from gaitgraph.gait.table import CLOSED_GAP, ROWS_OF_A_PIECE, Table, merged, pieces_of, setting_of
from gaitgraph.io.formats import known_format
from gaitgraph.io.frames import Frame, as_table
from gaitgraph.io.options import check_options
from gaitgraph.io.reading import read_pieces, read_table
from gaitgraph.io.servo_tables import clipped_rows
from gaitgraph.io.writing import check_outputs, write_pieces, write_tables
from gaitgraph.surface.sheets import DEFAULT_TOLERANCE, families_along, family_of
from gaitgraph.timing.timed_gait import LAWS, parametrize
from gaitgraph.validation.segments import Segments

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from gaitgraph.invertibility.matrices import Coefficients, Kind
    from gaitgraph.io.options import FormatOptions
    from gaitgraph.io.servo_map import ServoMap
    from gaitgraph.vehicle import Vehicle

__all__ = [
    "Exported",
    "closed_rows",
    "export",
    "export_file",
    "gait_of",
    "read_gait",
]

FloatArray = npt.NDArray[np.float64]

_ROWS_KEPT = 2 * ROWS_OF_A_PIECE


def gait_of(table: Table | Frame, *, vehicle: Vehicle | None = None, coefficients: Kind | None = None) -> Gait:
    """Return the closed polyline through a table's rows, straight runs merged.

    A last row that equals the first is the closing row. Rows of alpha1, alpha2 and color alone are lifted; where
    there is no color, rows get that of the sheet they lie on, if each lies on one to within 2e-3 rad.

    Parameters
    ----------
    table
        The rows; a frame of pandas or polars may have them.
    vehicle, coefficients
        What the gait is for; by default what the table says, else the paper's vehicle.
    """
    rows: Table = as_table(table)
    vehicle, numbers, tolerance = setting_of(rows, vehicle, coefficients)
    alpha = _alpha_of(rows, vehicle, numbers)
    colors = rows["color"] if "color" in rows else _sheet_of(alpha, numbers)
    if len(alpha) > 1 and np.abs(alpha[-1] - alpha[0]).max() <= CLOSED_GAP:
        alpha, colors = alpha[:-1], colors[:-1]
    gait = Gait(alpha=alpha, colors=colors, vehicle=vehicle, coefficients=numbers, crossing_tolerance=tolerance)
    return gait.merged()


def _alpha_of(table: Table, vehicle: Vehicle, coefficients: Coefficients) -> FloatArray:
    """Return the four tilt angles of each row, lifted where the table has (α1, α2) and colors alone."""
    if "alpha3" in table:
        return table.alpha
    plane = np.column_stack([table["alpha1"], table["alpha2"]])
    return lift(plane, table["color"], vehicle=vehicle, coefficients=coefficients).alpha


def closed_rows(
    table: Table, *, vehicle: Vehicle | None = None, coefficients: Kind | None = None, source: object = None
) -> tuple[Segments, Vehicle, Coefficients]:
    """Return a table's rows as one closed stretch, and what it is for.

    Rows of alpha1, alpha2 and color alone are lifted. A last row that equals the first closes the table; else the way
    back takes one mean step of time.

    Parameters
    ----------
    table, vehicle, coefficients
        As for :func:`gait_of`.
    source
        The file that it was read from, if any; messages name it.
    """
    with _of_file(source) if isinstance(source, (str, Path)) else nullcontext():
        vehicle, numbers, _ = setting_of(table, vehicle, coefficients)
        alpha = _alpha_of(table, vehicle, numbers)
    t = table.columns.get("t")
    if len(alpha) > 1 and np.abs(alpha[-1] - alpha[0]).max() <= CLOSED_GAP:
        alpha = np.vstack([alpha[:-1], alpha[:1]])
    else:
        alpha = np.vstack([alpha, alpha[:1]])
        t = None if t is None else np.append(t, t[-1] + (t[-1] - t[0]) / max(len(t) - 1, 1))
    sheet = np.zeros(len(alpha), dtype=np.int8)
    after_t = None if t is None else float(t[0])
    return Segments(alpha=alpha, sheet=sheet, after=0, t=t, after_t=after_t), vehicle, numbers


@contextmanager
def _of_file(path: str | Path) -> Iterator[None]:
    """Name the file in an error about what a table says."""
    try:
        yield
    except GaitgraphError as error:
        raise type(error)(f"gait file {str(path)!r}: {error}") from error


def read_gait(path: str | Path, *, vehicle: Vehicle | None = None, coefficients: Kind | None = None) -> Gait:
    """Return the gait in a file: the closed polyline through its rows; parameters and errors as for :func:`gait_of`.

    It keeps the request that made the file, if that tells one and no other vehicle or coefficients are asked for.
    """
    table = read_table(path)
    with _of_file(path):
        gait = gait_of(table, vehicle=vehicle, coefficients=coefficients)
    return replace(gait, request=_told_request(table, vehicle, coefficients))


def _sheet_of(alpha: FloatArray, coefficients: Coefficients) -> tuple[str, ...]:
    """Return the color of the sheet or fibre that each row lies on, or nothing if a row lies on none."""
    codes = families_along(alpha, coefficients, DEFAULT_TOLERANCE)
    return tuple(map(family_of, codes.tolist())) if codes.all() else ()


def export(source: str | Path, outputs: Iterable[str | Path], *, force: bool = False, **choices: Any) -> Table:
    """Read a gait file, write it to other files, and return what was written, whole.

    Parameters, errors and rules are those of :func:`export_file`, which holds no more than some rows at a time.
    """
    paths = list(outputs)
    options, servos = choices.pop("options", None), choices.pop("servos", None)
    _check_choices(options, paths, force)
    table = merged(_pieces_to_write(source, **choices)())
    write_tables(table, paths, force=force, options=options, servos=servos)
    return table


@dataclass(frozen=True, slots=True, kw_only=True)
class Exported:
    """What was written.

    Parameters
    ----------
    rows, columns
        How many rows, and which columns the gait has.
    clipped
        In how many rows each joint of a servo table that clips was beyond its limits.
    """

    rows: int
    columns: tuple[str, ...]
    clipped: dict[str, int]


def export_file(
    source: str | Path,
    outputs: Iterable[str | Path],
    *,
    force: bool = False,
    options: FormatOptions | None = None,
    servos: ServoMap | None = None,
    progress: Callable[[float], None] | None = None,
    **choices: Any,
) -> Exported:
    """Read a gait file and write it to other files, piece by piece.

    A table with a clock keeps its rows, counted from t = 0 and closed, and columns that follow from them are added: see
    :mod:`gaitgraph.gait.completing`. It is read twice or more, unless it is short, and no more than some rows are held at a
    time. A table without a clock, one of a single row, or any of `period`, `law`, `samples`, `rate`, puts a new clock
    on the closed polyline through the rows, which is held whole.

    Parameters
    ----------
    source, outputs
        Files; their suffixes say the formats.
    force
        Overwrite files that exist.
    options
        Choices that some formats have; one that none of the outputs has is refused.
    servos
        As for :func:`gaitgraph.io.writing.write_tables`.
    progress
        Called with the fraction of the work that is done.
    choices
        `joints`, what the columns of a servo table from elsewhere are; `vehicle` and `coefficients` that it is for,
        instead of what the table says; `period`, `law`, `samples`, `rate` as for
        :func:`gaitgraph.timing.timed_gait.parametrize`.

    Raises
    ------
    InputError, FileProblem, OutputExists
        As :func:`read_table` and :func:`write_tables` do.
    """
    paths = list(outputs)
    _check_choices(options, paths, force)
    formats = [known_format(path, "output") for path in paths]
    for_servos = any(one.reads or "joint_names" in one.options for one in formats)
    parts = len(paths) + 1
    reached = 0.0

    def report(share: float) -> None:
        nonlocal reached
        if progress is not None and share > reached:  # what is read again is no step back
            reached = share
            progress(share)

    pieces = _pieces_to_write(source, progress=lambda share: report(share / parts), **choices)
    seen: list[Exported] = []

    def counted() -> Iterator[Table]:
        rows, begun = 0, len(seen)
        clipped: dict[str, int] = {}
        total = max(seen[0].rows, 1) if seen else None
        columns: tuple[str, ...] = ()
        for piece in pieces():
            if servos is not None and for_servos and not begun:
                for name, count in clipped_rows(piece, servos).items():
                    clipped[name] = clipped.get(name, 0) + count
            rows, columns = rows + len(piece), tuple(piece.columns)
            yield piece
            if total is not None:
                report((begun + 1 + rows / total) / parts)
        seen.append(Exported(rows=rows, columns=columns, clipped=clipped))
        report((begun + 2) / parts)

    write_pieces(counted, paths, force=force, options=options, servos=servos)
    if not seen:  # formats that take the first piece alone have not counted the others
        deque(counted(), maxlen=0)
    return seen[0]


def _check_choices(options: FormatOptions | None, paths: list[str | Path], force: bool) -> None:
    if options is not None:
        check_options(options, [known_format(path, "output") for path in paths])
    check_outputs(paths, force=force)


def _pieces_to_write(
    source: str | Path,
    *,
    vehicle: Vehicle | None = None,
    coefficients: Kind | None = None,
    period: float | None = None,
    law: str | None = None,
    samples: int | None = None,
    rate: float | None = None,
    joints: ServoMap | None = None,
    progress: Callable[[float], None] | None = None,
) -> Callable[[], Iterator[Table]]:
    """Return what yields the rows to write, as often as it is called."""
    read = _replayed(source, partial(read_pieces, source, progress=progress, joints=joints))
    first = list(islice(read(), 2))
    retime = "t" not in first[0] or sum(map(len, first)) == 1
    if not retime and all(choice is None for choice in (period, law, samples, rate)):
        with _of_file(source):
            return completed_pieces(read, vehicle=vehicle, coefficients=coefficients)
    table = merged(read())
    with _of_file(source):
        gait = gait_of(table, vehicle=vehicle, coefficients=coefficients)
        gait = replace(gait, request=_told_request(table, vehicle, coefficients))
    timed = parametrize(
        gait,
        _default(period, table.about.get("period"), 1.0),
        law=_default(law, _stated_law(table), LAWS[0]),
        samples=samples,
        rate=rate,
    )
    return lambda: pieces_of(timed)


def _replayed(source: str | Path, read: Callable[[], Iterator[Table]]) -> Callable[[], Iterator[Table]]:
    """Return what yields the pieces of a file as often as it is called; those of a short one are kept, not read again.

    What is no regular file, a pipe say, is kept whole: it can be read once.
    """
    kept: list[Table] = []
    whole = not Path(source).is_file()
    if whole:
        kept.extend(read())

    def pieces() -> Iterator[Table]:
        nonlocal whole
        if whole:
            yield from kept
            return
        fresh: list[Table] | None = []
        for piece in read():
            if fresh is not None:
                fresh.append(piece)
                fresh = fresh if len(fresh) == 1 or sum(map(len, fresh)) <= _ROWS_KEPT else None
            yield piece
        if fresh is not None:
            kept.extend(fresh)
            whole = True

    return pieces


def _stated_law(table: Table) -> Any:
    """Return the law that a table tells, unless it is one that only pacing makes."""
    law = table.about.get("law")
    return None if table.about.get("made_by") == "pace" else law


def _told_request(table: Table, vehicle: Vehicle | None, coefficients: Kind | None) -> dict[str, Any]:
    """Return the request that made a table; empty if it tells none, or if the table is taken for something else."""
    request = table.about.get("request")
    return dict(request) if isinstance(request, dict) and vehicle is None and coefficients is None else {}


def _default(*values: Any) -> Any:
    return next(value for value in values if value is not None)
