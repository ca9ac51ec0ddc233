"""NumPy archives (.npz): one array for each column.

They are read here and not by numpy, which believes the sizes that a file claims: some rows at a time, nothing allocated
by a claim that the file cannot keep, nothing built but numbers and texts.
"""

from __future__ import annotations

import io
import re
import zipfile
import zlib
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitgraph.errors import InputError, shown
from gaitgraph.gait.table import about_from_text, merged, provenance_text
from gaitgraph.io.columns import LONGEST_TEXT, Column, check_names, numbers_or_texts, opened, pieces_of_columns

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path

    from gaitgraph.gait.table import Table
    from gaitgraph.io.columns import Array, Progress, RawPiece

__all__ = ["pieces_of_npz", "write_npz"]

PROVENANCE = "provenance"
"""The array that tells what made the archive, a text."""

_ALLOWED = "allowed is an archive that numpy.savez wrote, with one array for each column"
_MOST_MEMBERS = 1000
_LONGEST_DIRECTORY = 1 << 20
_LONGEST_HEADER = 10_000
_LONGEST_PROVENANCE = 1 << 24
_MAGIC = b"\x93NUMPY"
_HEADER = re.compile(
    r"\{\s*'descr':\s*'([<>|=])([a-zA-Z])(\d{1,9})',\s*'fortran_order':\s*(?:True|False),"
    r"\s*'shape':\s*\(([\d, ]{0,200})\),?\s*\}\s*"
)
_WIDTHS = range(LONGEST_TEXT + 1)
_SIZES = {"f": (2, 4, 8), "i": (1, 2, 4, 8), "u": (1, 2, 4, 8), "U": _WIDTHS, "S": _WIDTHS}
_BROKEN = (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, OSError, RuntimeError, ValueError)
"""What zipfile raises where an archive is broken, or of a kind that it does not know."""


def write_npz(pieces: Iterable[Table], path: Path) -> None:
    """Write a new NumPy archive: one array for each column, and `provenance`, a text.

    It is not compressed and has no time stamps: the same table gives the same bytes everywhere.

    Raises
    ------
    InputError
        If a column has the name of that text.
    """
    table = merged(pieces)
    check_names(table.columns, [PROVENANCE], ".npz")
    arrays: dict[str, Array] = {}
    for name, values in table.columns.items():
        arrays[name] = np.asarray(values, dtype="<f8") if isinstance(values, np.ndarray) else np.array(list(values))
    arrays[PROVENANCE] = np.array(provenance_text(table))
    with zipfile.ZipFile(path, "w") as archive:
        for name, array in arrays.items():
            member = zipfile.ZipInfo(f"{name}.npy", date_time=(1980, 1, 1, 0, 0, 0))
            member.create_system, member.external_attr = 3, 0o600 << 16
            with archive.open(member, "w", force_zip64=True) as stream:
                np.lib.format.write_array(stream, array, allow_pickle=False)


class _Careful(io.BufferedReader):
    """A file whose reads are short while the archive's directory is read, so that no claim about it is believed."""

    longest = _LONGEST_DIRECTORY

    def read(self, size: int | None = -1, /) -> bytes:
        if not self.longest:
            return super().read(size)
        whole = size is None or not 0 <= size <= self.longest
        content = super().read(self.longest + 1 if whole else size)
        if len(content) > self.longest:
            raise InputError(f"its directory is longer than {self.longest} bytes; {_ALLOWED}")
        return content


def pieces_of_npz(path: Path, progress: Progress) -> Iterator[RawPiece]:
    """Yield the columns of a NumPy archive, some rows at a time."""
    with opened(path, _ALLOWED) as (raw, size), ExitStack() as stack:
        try:
            file = stack.enter_context(_Careful(raw))
            archive = stack.enter_context(zipfile.ZipFile(file))
            file.longest = 0
            infos = archive.infolist()
            if len(infos) > _MOST_MEMBERS:
                raise InputError(f"it has {len(infos)} members; allowed are {_MOST_MEMBERS} at most")
            columns, about = [], {}
            for info in infos:
                name = info.filename.removesuffix(".npy")
                if name == PROVENANCE:
                    about = _told(archive, info, stack)
                elif name != info.filename:
                    columns.append(_column(archive, info, name, stack))
            yield from pieces_of_columns(columns, about, size, progress)
        except InputError:
            raise
        except _BROKEN as error:
            reason = " ".join(str(error).split()) or type(error).__name__
            raise InputError(f"it is no archive, or a broken one ({reason}); {_ALLOWED}") from error


def _column(archive: zipfile.ZipFile, info: zipfile.ZipInfo, name: str, stack: ExitStack) -> Column:
    """Return an array as a column, or why it is none."""
    stream, dtype, shape, size = _member(archive, info, stack)
    if dtype is None:
        return Column(name=name, why="its values are of a kind that is not read; allowed are real numbers and texts")
    single = not shape and dtype.kind in "US"
    if single:
        shape = (1,)
    if len(shape) != 1:
        return Column(name=name, why=f"it is an array of shape {shown(shape)}; allowed is one dimension")
    if shape[0] * dtype.itemsize != size:
        return Column(name=name, why=f"it claims {shape[0]} values, and holds {size} bytes; {_ALLOWED}")

    held: list[Array] = []

    def values(start: int, count: int) -> Array:
        del start  # one after the other
        if single and held:
            return held[0]
        content = stream.read(count * dtype.itemsize)
        if len(content) < count * dtype.itemsize:
            raise InputError(f"{name}: it ends early; {_ALLOWED}")
        held[:] = [numbers_or_texts(np.frombuffer(content, dtype=dtype), name)]
        return held[0]

    return Column(name=name, rows=shape[0], size=size, values=values, texts=dtype.kind in "US", single=single)


def _told(archive: zipfile.ZipFile, info: zipfile.ZipInfo, stack: ExitStack) -> dict[str, Any]:
    """Return what made the archive, if a text of ours tells it."""
    stream, dtype, shape, size = _member(archive, info, stack, longest=_LONGEST_PROVENANCE)
    if dtype is None or dtype.kind != "U" or shape or not 0 < size == dtype.itemsize <= _LONGEST_PROVENANCE:
        return {}
    content = stream.read(size)
    if len(content) < size:
        raise InputError(f"{PROVENANCE}: it ends early; {_ALLOWED}")
    return about_from_text(str(numbers_or_texts(np.frombuffer(content, dtype=dtype), PROVENANCE)[0]))


def _member(
    archive: zipfile.ZipFile, info: zipfile.ZipInfo, stack: ExitStack, longest: int = LONGEST_TEXT
) -> tuple[Any, np.dtype[Any] | None, tuple[int, ...], int]:
    """Return an array's stream, dtype, shape, and the number of bytes that it still claims; no dtype if it is odd."""
    if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        raise InputError(f"{shown(info.filename)} is compressed by method {info.compress_type}; {_ALLOWED}")
    stream = stack.enter_context(archive.open(info))
    head = stream.read(8)
    width = 2 if head[6:7] == b"\1" else 4
    length = int.from_bytes(stream.read(width), "little")
    if head[:6] != _MAGIC or not length <= _LONGEST_HEADER:
        return stream, None, (), 0
    text = stream.read(length).decode("latin-1")
    found = _HEADER.fullmatch(text)
    if found is None:
        return stream, None, (), 0
    order, kind, digits, dimensions = found.groups()
    items = int(digits)
    if items not in _SIZES.get(kind, ()) and not (kind == "U" and 0 < items <= longest):
        return stream, None, (), 0
    shape = tuple(int(one) for one in dimensions.split(",") if one.strip())
    return stream, np.dtype(f"{order}{kind}{items}"), shape, info.file_size - len(head) - width - length
