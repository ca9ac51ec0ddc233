"""Write gait tables to files of any format, each whole or not at all."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from gaitgraph.errors import OutputExists
from gaitgraph.files import check_new_files, write_whole
from gaitgraph.io.formats import known_format
from gaitgraph.io.servo_tables import mapped_table

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from gaitgraph.gait.table import Table
    from gaitgraph.io.formats import Format, FormatOptions
    from gaitgraph.io.servo_map import ServoMap


def write_tables(
    table: Table,
    paths: Sequence[str | Path],
    *,
    force: bool = False,
    options: FormatOptions | None = None,
    servos: ServoMap | None = None,
) -> None:
    """Write a table to files, each whole or not at all; the format follows from the suffix.

    Parameters
    ----------
    table
        What to write.
    paths
        Files, or folders for the formats that are folders; :data:`gaitgraph.io.formats.FORMATS` has the suffixes.
    force
        Overwrite files that exist.
    options
        Choices that some formats have; the others ignore them.
    servos
        What the columns are to be, in formats of tables; the joints' order, signs and zeros in formats of robots.
        Pictures and MATLAB functions do not change.

    Raises
    ------
    OutputExists
        If a file exists and `force` is not set; then none is written.
    FileProblem
        If a file cannot be written; the old one, if any, is whole.
    InputError
        If a suffix is not known or a file is named twice.
    MissingExtra
        If a format needs a library that is not installed.
    """
    write_pieces(lambda: [table], paths, force=force, options=options, servos=servos)


def write_pieces(
    pieces: Callable[[], Iterable[Table]],
    paths: Sequence[str | Path],
    *,
    force: bool = False,
    options: FormatOptions | None = None,
    servos: ServoMap | None = None,
) -> None:
    """Write a table that comes piece by piece, as :func:`write_tables` does.

    Parameters
    ----------
    pieces
        Called once a file; its pieces have the same columns, and the first states what made them.
    paths, force, options, servos
        As for :func:`write_tables`.
    """
    check_outputs(paths, force=force)

    def write(form: Format, scratch: Path) -> None:
        form.writer(options)(pieces() if servos is None else _for_servos(pieces(), servos, form), scratch)

    write_whole([(Path(path), partial(write, known_format(path, "output"))) for path in paths], force=force)


def _for_servos(pieces: Iterable[Table], servos: ServoMap, form: Format) -> Iterator[Table]:
    """Yield pieces as a format states joints: in its own radians, or in the columns of the map."""
    rows = 0
    for piece in pieces:
        if "joint_names" in form.options:
            yield mapped_table(piece, servos.in_radians(), rows_before=rows)
        else:
            yield mapped_table(piece, servos, rows_before=rows) if form.reads else piece
        rows += len(piece)


def check_outputs(paths: Sequence[str | Path], *, force: bool = False) -> None:
    """Raise before any work is done if an output cannot be: its suffix, an extra, a name taken or given twice."""
    folders = set()
    for path in map(Path, paths):
        form = known_format(path, "output")
        form.writer()  # MissingExtra, if that is so
        if form.folder:
            folders.add(path)
            for one in sorted(path.iterdir()) if path.is_dir() else ():
                if not one.is_file() or (one.name != "metadata.yaml" and one.suffix != form.suffix):
                    problem = f"is a folder with {one.name!r} in it; allowed is a new one, or a {form.name}"
                    raise OutputExists(f"output: {str(path)!r} {problem}")
    check_new_files(paths, force=force, folders=folders)
