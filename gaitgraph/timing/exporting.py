"""A gait file in other formats, or with another timing."""

from __future__ import annotations

from collections import Counter, deque
from dataclasses import dataclass
from functools import partial
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING

from gaitgraph.gait.rows import completed_pieces
from gaitgraph.gait.table import ROWS_OF_A_PIECE, Table, merged
from gaitgraph.io.formats import check_options, check_outputs, known_format, write_pieces
from gaitgraph.io.reading import gait_of, naming_file, read_pieces
from gaitgraph.io.servo_map import clipped_rows
from gaitgraph.timing.timed_gait import LAWS, parametrize, pieces_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from gaitgraph.invertibility.matrices import Kind
    from gaitgraph.io.formats import FormatOptions
    from gaitgraph.io.servo_map import ServoMap
    from gaitgraph.vehicle import Vehicle

_ROWS_KEPT = 2 * ROWS_OF_A_PIECE


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


def export(
    source: str | Path,
    outputs: Iterable[str | Path],
    *,
    vehicle: Vehicle | None = None,
    coefficients: Kind | None = None,
    period: float | None = None,
    law: str | None = None,
    samples: int | None = None,
    rate: float | None = None,
    joints: ServoMap | None = None,
    servos: ServoMap | None = None,
    options: FormatOptions | None = None,
    force: bool = False,
    progress: Callable[[float], None] | None = None,
) -> Exported:
    """Read a gait file and write it to other files, piece by piece.

    A table with times keeps its rows, counted from t = 0 and closed, and gets the columns that follow from them, see
    :func:`gaitgraph.gait.rows.completed_pieces`. It is read twice or more, unless it is short, and only some rows are
    held at a time. A table without times, one of a single row, or any of `period`, `law`, `samples`, `rate`, puts a new
    timing on the closed polyline through the rows, which is held whole.

    Parameters
    ----------
    source, outputs
        Files; their suffixes are the formats.
    vehicle, coefficients
        What the gait is for, instead of what the file states.
    period, law, samples, rate
        As for :func:`gaitgraph.timing.timed_gait.parametrize`; by default what the file states, else 1 s and smooth.
    joints
        What the columns of a servo table from elsewhere are.
    servos, options
        As for :func:`gaitgraph.io.formats.write_tables`; an option that none of the outputs has is refused.
    force
        Overwrite files that exist.
    progress
        Called with the fraction of the work that is done.

    Raises
    ------
    InputError, FileProblem, OutputExists
        As :func:`gaitgraph.io.reading.read_table` and :func:`gaitgraph.io.formats.write_tables` do.
    """
    paths = list(outputs)
    formats = [known_format(path, "output") for path in paths]
    if options is not None:
        check_options(options, formats)
    check_outputs(paths, force=force)
    parts = len(paths) + 1  # reading, and each file written
    reached = 0.0

    def report(share: float) -> None:
        nonlocal reached
        if progress is not None and share / parts > reached:  # what is read again is no step back
            reached = share / parts
            progress(reached)

    read = _replayed(source, partial(read_pieces, source, progress=report, joints=joints))
    first = list(islice(read(), 2))
    retimed = "t" not in first[0] or sum(map(len, first)) == 1
    if retimed or any(choice is not None for choice in (period, law, samples, rate)):
        table = merged(read())
        with naming_file(source):
            gait = gait_of(table, vehicle=vehicle, coefficients=coefficients)
        stated = table.about
        stated_law = None if stated.get("made_by") == "pace" else stated.get("law")  # pacing follows no law
        timed = parametrize(
            gait,
            next(value for value in (period, stated.get("period"), 1.0) if value is not None),
            law=next(value for value in (law, stated_law, LAWS[0]) if value is not None),
            samples=samples,
            rate=rate,
        )
        pieces: Callable[[], Iterator[Table]] = partial(pieces_of, timed)
    else:
        with naming_file(source):
            pieces = completed_pieces(read, vehicle=vehicle, coefficients=coefficients)
    clips = servos if any(one.reads or "joint_names" in one.options for one in formats) else None
    done: list[Exported] = []

    def counted() -> Iterator[Table]:
        """Yield the pieces once for each file, and count them the first time."""
        files, rows = len(done), 0
        columns: tuple[str, ...] = ()
        clipped: Counter[str] = Counter()
        for piece in pieces():
            if clips is not None and not files:
                clipped.update(clipped_rows(piece, clips))
            rows, columns = rows + len(piece), tuple(piece.columns)
            yield piece
            if files:
                report(files + 1 + rows / done[0].rows)
        done.append(Exported(rows=rows, columns=columns, clipped=dict(clipped)))
        report(files + 2)

    write_pieces(counted, paths, force=force, options=options, servos=servos)
    if not done:  # formats that take the first piece alone have not counted the others
        deque(counted(), maxlen=0)
    return done[0]


def _replayed(source: str | Path, read: Callable[[], Iterator[Table]]) -> Callable[[], Iterator[Table]]:
    """Return what yields the pieces of a file as often as it is called; those of a short one are kept, not read again.

    What is no regular file, a pipe for example, can be read once, and is kept whole.
    """
    kept = None if Path(source).is_file() else list(read())

    def pieces() -> Iterator[Table]:
        nonlocal kept
        if kept is not None:
            yield from kept
            return
        fresh: list[Table] | None = []
        for piece in read():
            if fresh is not None:
                fresh.append(piece)
                if len(fresh) > 1 and sum(map(len, fresh)) > _ROWS_KEPT:
                    fresh = None
            yield piece
        kept = fresh

    return pieces
