"""Gait files of any format: as tables, whole or piece by piece, as gaits, and what made them."""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gaitgraph.errors import FileProblem, GaitgraphError, MissingExtra
from gaitgraph.files import text_of
from gaitgraph.gait.table import Table, about_from_text, closed_rows, merged
from gaitgraph.io.columns import TableBuilder, as_table
from gaitgraph.io.formats import known_format
from gaitgraph.io.text_files import pieces_of_csv, table_of_json

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from gaitgraph.gait.gait import Gait
    from gaitgraph.invertibility.matrices import Kind
    from gaitgraph.io.columns import Frame
    from gaitgraph.io.servo_map import ServoMap
    from gaitgraph.vehicle import Vehicle

_WHAT = "gait file"


def gait_of(table: Table | Frame, *, vehicle: Vehicle | None = None, coefficients: Kind | None = None) -> Gait:
    """Return the closed polyline through a table's rows, straight runs merged.

    A last row that repeats the first is the closing row. Rows of alpha1, alpha2 and color alone are lifted. Rows
    without a color get that of the sheet or fibre they lie on, if each lies on one to within 2e-3 rad.

    Parameters
    ----------
    table
        The rows, or a frame of pandas or polars that has them.
    vehicle, coefficients
        What the gait is for; by default what the table states, else the paper's vehicle.

    Returns
    -------
    Gait
        It keeps the request that the table states, if no other vehicle or coefficients are given.

    Raises
    ------
    InputError
        If the rows are no gait table.

    Examples
    --------
    >>> gait_of({"alpha1": [0.4, 0.6, 0.9], "alpha2": [-0.4, -0.4, -0.4], "color": "red"}).alpha[:, 0].tolist()
    [0.4, 0.9]
    """
    gait, _ = closed_rows(as_table(table), vehicle=vehicle, coefficients=coefficients)
    return replace(gait.merged(), request=gait.request)


def read_gait(path: str | Path, *, vehicle: Vehicle | None = None, coefficients: Kind | None = None) -> Gait:
    """Return the gait in a file; parameters and errors as for :func:`gait_of` and :func:`read_table`."""
    table = read_table(path)
    with naming_file(path):
        return gait_of(table, vehicle=vehicle, coefficients=coefficients)


def read_table(path: str | Path, *, joints: ServoMap | None = None) -> Table:
    """Read a gait table, or a plan saved as JSON.

    Parameters
    ----------
    path
        A file of any format that :data:`gaitgraph.io.formats.FORMATS` reads. In texts a byte-order mark and any kind of
        line end are read too.
    joints
        What its columns are if it is a servo table from elsewhere; one of ours states it.

    Raises
    ------
    FileProblem
        If the file cannot be read.
    InputError
        If it holds no gait table; the message names file, place and what is allowed.
    """
    return merged(read_pieces(path, joints=joints))


def read_pieces(
    path: str | Path,
    *,
    progress: Callable[[float], None] | None = None,
    plane_only: bool = False,
    joints: ServoMap | None = None,
) -> Iterator[Table]:
    """Yield a gait table as consecutive pieces, each at least one row; the first states what made it.

    `progress` is called with the fraction of the file that is read; with `plane_only` alpha1 and alpha2 are enough.
    Errors are those of :func:`read_table`, when the piece in question is reached.
    """
    path = Path(path)
    form = known_format(path, _WHAT, reads=True)
    with naming_file(path):
        if form.suffix == ".json":
            yield table_of_json(text_of(path, _WHAT, "a gait table as text"), plane_only, joints)
        elif form.suffix == ".csv":
            yield from pieces_of_csv(path, progress, plane_only, joints)
        else:
            builder: TableBuilder | None = None
            for columns, about in form.reader()(path, progress):  # the first has the names, and may have no rows
                if builder is None:
                    builder = TableBuilder([name for name, _ in columns], about, plane_only=plane_only, joints=joints)
                yield from builder.pieces([values for _, values in columns])
            if builder is not None:
                builder.check_rows()


def provenance_in(path: str | Path) -> dict[str, Any]:
    """Return what made a gait file of any format, also of those that are not read as tables: its `about`."""
    path = Path(path)
    form = known_format(path, _WHAT)
    if form.reads:
        return next(read_pieces(path)).about
    with naming_file(path):
        return about_from_text(form.provenance(path), required=True)


@contextmanager
def naming_file(source: object) -> Iterator[None]:
    """Name the file in an error about what it holds, once; if the source is no path, errors stay as they are."""
    try:
        yield
    except (MissingExtra, FileProblem):
        raise
    except GaitgraphError as error:
        if not isinstance(source, (str, Path)) or str(error).startswith(_WHAT):
            raise
        raise type(error)(f"{_WHAT} {str(source)!r}: {error}") from error
