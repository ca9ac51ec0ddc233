"""What the formats of arrays share: columns that are read some rows at a time, and what is no column and why."""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.errors import FileProblem, GaitgraphError, InputError, shown
from gaitgraph.files import MOST_BYTES
from gaitgraph.gait.table import DEGREES, ORDER, ROWS_OF_A_PIECE

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
    from io import FileIO
    from pathlib import Path

    Progress = Callable[[float], None] | None
    RawPiece = tuple[list[tuple[str, Any]], dict[str, Any]]

__all__ = ["KNOWN", "LONGEST_TEXT", "Column", "check_names", "numbers_or_texts", "opened", "pieces_of_columns"]

Array = npt.NDArray[Any]

KNOWN = frozenset(ORDER) | frozenset(DEGREES)
"""The names of a gait table's columns."""

LONGEST_TEXT = 64
"""Texts of columns have so many characters at most."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Column:
    """A column in a file, not read yet.

    Parameters
    ----------
    name
        Its name.
    rows, size
        How many values it has, and how many bytes these take.
    values
        Returns values by the number of those before and their own; called from the first to the last.
    texts
        Whether its values are texts.
    single
        Whether its one text counts for all rows.
    why
        Why it is no column, if it is none.
    """

    name: str
    rows: int = 0
    size: int = 0
    values: Callable[[int, int], Array] | None = None
    texts: bool = False
    single: bool = False
    why: str = ""

    def at(self, start: int, count: int) -> Array | None:
        """Return values by the number of those before and their own, or None if it is no column."""
        if self.values is None:
            return None
        return np.repeat(self.values(0, 1), count) if self.single else self.values(start, count)


def check_names(names: Iterable[str], own: Collection[str], suffix: str) -> None:
    """Raise InputError if a column of joints has a name that a format gives to something of its own.

    >>> check_names(["t", "alpha1"], ["made_by"], ".csv")
    """
    for name in names:
        if name in own:
            told = ", ".join(map(repr, own))
            raise InputError(f"column {name!r}: a {suffix} file has something else there; allowed is none of {told}")


@contextmanager
def opened(path: Path, allowed: str) -> Iterator[tuple[FileIO, int]]:
    """Open a file for reading, and tell its size; FileProblem, which says what is allowed, if it cannot be read."""
    try:
        with path.open("rb", buffering=0) as stream:
            size = stream.seek(0, 2)
            stream.seek(0)
            yield stream, size
    except GaitgraphError:
        raise
    except (OSError, ValueError) as error:  # a name with a null character is a ValueError
        reason = getattr(error, "strerror", None) or error
        raise FileProblem(f"gait file: cannot read {shown(str(path))}: {reason}; {allowed}") from error


def numbers_or_texts(array: Array, name: str) -> Array:
    """Return real numbers as floats, and texts as they are; InputError for what are no characters.

    >>> numbers_or_texts(np.array([1, 2], dtype=">i2"), "t")
    array([1., 2.])
    """
    if array.dtype.kind in "fiu":
        return array.astype(np.float64)
    if array.dtype.kind == "S":
        if array.size and int(array.view(np.uint8).max()) > 127:
            raise InputError(f"{name}: its texts are not ASCII; allowed is Unicode")
    elif array.size and array.dtype.itemsize:
        codes = array.view(np.dtype(np.uint32).newbyteorder(array.dtype.byteorder))
        if int(codes.max()) > 0x10FFFF:
            raise InputError(f"{name}: its texts have characters that do not exist; allowed is Unicode")
    return array.astype(np.str_)


def pieces_of_columns(
    columns: Sequence[Column], about: dict[str, Any], size: int, progress: Progress
) -> Iterator[RawPiece]:
    """Yield columns some rows at a time: first their names alone, so that these are checked before values are read.

    Parameters
    ----------
    columns
        All that may be columns. Those of a gait table must be; others have None for values if they are not.
    about
        What made the file.
    size
        Bytes of the file. Columns may take more, where they are compressed, but not more than 1 GiB.
    progress
        Called with the fraction of the rows that were read.

    Raises
    ------
    InputError
        If a column of a gait table is none, has another length than the others, or if they are too large.
    """
    yield [(one.name, []) for one in columns], about
    known = [one for one in columns if one.name in KNOWN]
    for one in known:
        if one.why:
            raise InputError(f"{one.name}: {one.why}")
    lengths = {one.rows for one in known if not one.single}
    if len(lengths) > 1:
        raise InputError(f"columns have {min(lengths)} to {max(lengths)} rows; allowed are equally many")
    rows = next(iter(lengths), None)
    if rows is None:
        rows = next((one.rows for one in columns if not one.why and not one.single), 0)
    wanted = [not one.why and (one.name in KNOWN or not one.texts) for one in columns]
    used = [one.single or one.rows == rows if want else False for one, want in zip(columns, wanted, strict=True)]
    total = sum(one.size for one, usable in zip(columns, used, strict=True) if usable)
    if total > max(MOST_BYTES, size):
        raise InputError(
            f"its columns take {total} bytes, and it has {size}; allowed are {MOST_BYTES >> 20} MiB if they are packed"
        )
    for start in range(0, rows, ROWS_OF_A_PIECE):
        count = min(ROWS_OF_A_PIECE, rows - start)
        pairs = zip(columns, used, strict=True)
        yield [(one.name, one.at(start, count) if usable else None) for one, usable in pairs], about
        if progress is not None:
            progress((start + count) / rows)
