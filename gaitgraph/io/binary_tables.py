"""NumPy archives, Parquet and MATLAB files (.mat, level 5), each read and written by its own library.

The libraries trust the sizes that a file states. So they all read within :func:`gate`, which checks these first and
turns any failure into one line.
"""

from __future__ import annotations

import io
import json
import re
import struct
import warnings
import zlib
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph import __version__
from gaitgraph.errors import GaitgraphError, InputError, shown
from gaitgraph.files import MOST_BYTES, pass_interruption
from gaitgraph.gait.table import (
    ACCELERATIONS,
    ANGLES,
    FORMAT,
    RATES,
    about_from_text,
    provenance_of,
    provenance_text,
)

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

    from gaitgraph.gait.table import Table
    from gaitgraph.io.columns import TableBuilder

    Array = npt.NDArray[Any]

_PROVENANCE = "provenance"  # the array that states what made the file


@contextmanager
def gate(path: Path, what: str, most: int | None = None) -> Iterator[int]:
    """Let a library read a file or the files of a folder; yield their size in bytes.

    Raises OSError if it cannot be read, and InputError if it has more than `most` bytes (by default
    :data:`gaitgraph.files.MOST_BYTES`) or the library fails in any way; `what` the file must be, for messages. Only calls
    of the library belong within: an error of our own code is no broken file. What interrupts the library, such as a
    signal handler's error, passes as it is.
    """
    try:
        size = sum(
            one.stat().st_size for one in (path.iterdir() if path.is_dir() else [path])
        )
        check_size(size, "it", most)
        yield size
    except MemoryError as error:
        got = "more memory than there is, or it states wrong sizes"
        raise InputError(f"it needs {got}") from error
    except Exception as error:  # libraries raise errors of many kinds on broken bytes, and each has its own
        of_system = isinstance(error, OSError) and error.filename is not None
        if isinstance(error, GaitgraphError) or of_system:
            raise
        pass_interruption(error)
        reason = shown(" ".join(str(error).split()) or type(error).__name__)[1:-1]
        raise InputError(f"it is not {what}, or it is broken ({reason})") from error


def check_size(size: int, what: str, most: int | None = None) -> None:
    """Raise InputError if something states more bytes than are read."""
    most = MOST_BYTES if most is None else most
    if size > most:
        raise InputError(f"{what} must have at most {most >> 20} MiB, got {size} bytes")


def _table_of(
    arrays: Mapping[str, Any], about: dict[str, Any], builder: TableBuilder
) -> Table:
    """Return the table of arrays by name."""
    builder.begin(list(arrays), about)
    return builder.table(arrays)


def _about_of_array(array: object) -> dict[str, Any]:
    """Return what made a file, if an array of it is a text of ours that states it."""
    return (
        about_from_text(array.item())
        if isinstance(array, np.ndarray) and array.size == 1
        else {}
    )


# -- NumPy archives


def write_npz(table: Table, path: Path) -> None:
    """Write a new NumPy archive: one array for each column, and `provenance`, a text.

    It is not compressed and has no time stamps: the same table gives the same bytes everywhere.
    """
    arrays: dict[str, Any] = {
        **table.columns,
        _PROVENANCE: np.array(provenance_text(table)),
    }
    with path.open("wb") as stream:
        np.savez(stream, **arrays)


def read_npz(path: Path, builder: TableBuilder) -> Table:
    """Return the table in a NumPy archive."""
    with (
        gate(path, "an archive that numpy.savez wrote, with one array for each column"),
        warnings.catch_warnings(action="ignore"),
        path.open("rb") as file,
        np.load(file) as archive,
    ):
        check_size(
            sum(member.file_size for member in archive.zip.infolist()), "its arrays"
        )
        arrays = {}
        for name in archive.files:
            try:
                arrays[name] = archive[name]
                if arrays[name].dtype.kind == "U":
                    arrays[name].tolist()  # wrong characters are found only now
            except (
                SystemError,
                ValueError,
            ) as error:  # objects, say, which are not loaded
                pass_interruption(error)
                arrays[name] = error
    about = _about_of_array(arrays.pop(_PROVENANCE, None))
    return _table_of(arrays, about, builder)


# -- Parquet: numbers are 64-bit floats, `color` and `types` dictionaries of texts; every field states its unit. pandas
# keeps what it knows of a frame under a key of its own, which is written and understood too.

_PARQUET = "a Parquet file with one column of numbers for each column of the table"
_OURS, _OF_PANDAS = b"gaitgraph", b"PANDAS_ATTRS"
_ROWS_OF_A_GROUP = 1 << 16
_MOST_UNPACKED, _STEEPEST = (
    1 << 32,
    100,
)  # bytes in all, or for each byte of the file, whichever is more


def write_parquet(table: Table, path: Path) -> None:
    """Write a new Parquet file, in row groups of 65,536 rows."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    made = {
        _OURS: provenance_text(table),
        _OF_PANDAS: json.dumps({"gaitgraph": provenance_of(table)}),
    }
    texts, fields = pa.dictionary(pa.int32(), pa.string()), []
    for name, unit in table.units.items():
        kind = pa.float64() if isinstance(table[name], np.ndarray) else texts
        metadata = {"unit": unit} if unit else None
        fields.append(pa.field(name, kind, nullable=False, metadata=metadata))
    columns = {
        name: list(one) if isinstance(one, tuple) else one
        for name, one in table.columns.items()
    }
    pq.write_table(
        pa.table(columns, pa.schema(fields, metadata=made)),
        path,
        row_group_size=_ROWS_OF_A_GROUP,
        write_page_checksum=True,
    )


def read_parquet(path: Path, builder: TableBuilder) -> Table:
    """Return the table in a Parquet file."""
    import pyarrow.parquet as pq
    from pyarrow.types import is_nested

    with path.open("rb", buffering=0) as stream:
        with gate(path, _PARQUET, most=1 << 62) as size:
            file = pq.ParquetFile(
                stream,
                buffer_size=1 << 20,
                pre_buffer=False,  # it would hold the whole file
                page_checksum_verification=True,
                arrow_extensions_enabled=False,
            )
            schema, rows = file.schema_arrow, file.metadata.num_rows
        builder.begin(schema.names, _about_of_parquet(schema.metadata or {}))
        used = [name for name in builder.used if name in schema.names]
        for name in used:
            if is_nested(schema.field(name).type):
                raise InputError(
                    f"{name} must be a column of numbers or of texts, got {schema.field(name).type}"
                )
        check_size(
            8 * rows * len(used), "its columns", max(_MOST_UNPACKED, _STEEPEST * size)
        )
        with gate(path, _PARQUET, most=1 << 62):
            read = file.read(columns=used, use_threads=False)
            columns = [one.combine_chunks() for one in read.columns]
    return builder.table(dict(zip(read.column_names, columns, strict=True)))


def _about_of_parquet(metadata: dict[bytes, bytes]) -> dict[str, Any]:
    """Return what made the file, where we or pandas keep it."""
    for text in (metadata.get(_OURS, b""), metadata.get(_OF_PANDAS, b"")):
        if FORMAT.encode() in text:
            try:
                content = json.loads(text)
            except (RecursionError, ValueError):
                continue
            return about_from_text(
                json.dumps(
                    content.get("gaitgraph", content)
                    if isinstance(content, dict)
                    else None
                )
            )
    return {}


# -- MATLAB files

_GROUPS = {
    "alpha": ANGLES,
    "alpha_rate": RATES,
    "alpha_acceleration": ACCELERATIONS,
}  # matrices, a column for a rotor
_MAT = "a MAT-file of level 5 in little-endian order, as save -v7 or save -v6 write it"
_HEADER, _TEXT_OF_HEADER = 128, 116
_MATRIX, _COMPRESSED = 14, 15
_TYPES = frozenset({1, 2, 3, 4, 5, 6, 7, 9, 12, 13, 16, 17, 18})
_CLASSES = frozenset({4, *range(6, 16)})  # texts and full arrays of numbers

_NAME = re.compile(r"[A-Za-z]\w{0,62}", re.ASCII)


def write_mat(table: Table, path: Path) -> None:
    """Write a new MATLAB file: every column as a variable, angles, rates and accelerations as matrices too.

    Beside them are `names` and `units` of the columns, and `provenance`, as texts.
    """
    from scipy.io import savemat
    from scipy.io.matlab import MatWriteError

    for name in table.columns:
        if not _NAME.fullmatch(name):
            raise InputError(
                f"column must be up to 63 letters, digits and _ in a .mat file, got {shown(name)}"
            )
    arrays = {name: np.asarray(values) for name, values in table.columns.items()}
    for group, names in _GROUPS.items():
        if all(name in table for name in names):
            arrays[group] = np.column_stack([table[name] for name in names])
    arrays["names"], arrays["units"] = (
        np.array(list(table.columns)),
        np.array(list(table.units.values())),
    )
    arrays[_PROVENANCE] = np.array(provenance_text(table))
    try:
        savemat(path, arrays, oned_as="column")
    except MatWriteError as error:
        raise InputError(
            f"{len(table)} rows are too many for a .mat file ({error}); write a .parquet file"
        ) from error
    with path.open("r+b") as stream:  # scipy writes the time and the system there
        stream.write(
            f"MATLAB 5.0 MAT-file, written by gaitgraph {__version__}".ljust(
                _TEXT_OF_HEADER
            ).encode()
        )


def read_mat(path: Path, builder: TableBuilder) -> Table:
    """Return the table in a MATLAB file."""
    found: dict[str, Any] = _mat_variables(path)
    if not found:
        raise InputError(
            "it must have variables of numbers; save -struct writes the fields of a struct as such"
        )
    about = _about_of_array(found.get(_PROVENANCE))
    if about:
        found = {
            name: one
            for name, one in found.items()
            if name not in ("names", "units", _PROVENANCE)
        }
    for group, angles in _GROUPS.items():
        matrix = found.pop(group, None)
        if matrix is not None and found.keys().isdisjoint(angles):
            if matrix.ndim != 2 or matrix.shape[1] != len(angles):
                raise InputError(
                    f"{group} must be a matrix of 4 columns, got shape {matrix.shape}"
                )
            found |= dict(zip(angles, matrix.T, strict=True))
    return _table_of(found, about, builder)


def _mat_variables(path: Path) -> dict[str, Array]:
    """Return the arrays of numbers and texts in a MATLAB file as scipy reads them; other variables are passed over.

    scipy follows in C the types and sizes that a file states; wrong ones end the process. So it gets one variable at a
    time, inflated and checked.
    """
    from scipy.io import loadmat

    with gate(path, _MAT):
        content = path.read_bytes()
    if content[_HEADER - 4 : _HEADER] != b"\0\1IM":
        raise InputError(
            f"it must be {_MAT}, got another kind of file (one of version 7.3 is HDF5)"
        )
    variables: dict[str, Array] = {}
    place, inflated = _HEADER, 0
    while place < len(content):
        with gate(path, _MAT):
            kind, size = struct.unpack_from("<II", content, place)
        element = content[place : place + 8 + size]
        if len(element) < 8 + size:
            raise InputError(
                f"it must be whole, got a variable that ends at byte {place + 8 + size} of {len(content)}"
            )
        place += 8 + size
        if kind == _COMPRESSED:
            inflater = zlib.decompressobj()
            with gate(path, _MAT):
                element = inflater.decompress(element[8:], MOST_BYTES - inflated + 1)
            inflated += len(element)
            check_size(inflated, "its variables")
            if not inflater.eof:  # behind the last byte is a checksum
                raise InputError(
                    "it must be whole, got a compressed variable that ends early"
                )
        if len(element) > 16 and element[16] not in _CLASSES:
            continue
        try:
            name = _checked_name(memoryview(element))
        except struct.error as error:
            raise InputError(f"it is not {_MAT}, or it is broken ({error})") from error
        if name and not name.startswith("__"):  # others belong to objects and functions
            stream: Any = io.BytesIO(content[:_HEADER] + element)
            with gate(path, _MAT), warnings.catch_warnings(action="ignore"):
                variables[name] = loadmat(stream)[name]
    return variables


def _checked_name(element: memoryview) -> str:
    """Return the name of an array in a MATLAB file; InputError, or struct.error, unless its parts are whole."""
    kind, size, flags = struct.unpack_from("<II8xI", element)
    if kind != _MATRIX:
        raise InputError(f"it must hold arrays, got an element of type {kind}")
    parts, place = [], 24
    for _ in range(
        4 if flags & 0x0800 else 3
    ):  # shape, name, values, and imaginary ones
        kind, length = struct.unpack_from("<II", element, place)
        start, place = place + 8, place + 8 + length + -length % 8
        if kind >> 16:  # up to four bytes are in the tag itself
            kind, length, start, place = kind & 0xFFFF, kind >> 16, start - 4, start
        if kind not in _TYPES or start + length > len(element):
            raise InputError(
                f"it must be whole, got a part of type {kind} and {length} bytes at byte {start}"
            )
        parts.append(element[start : start + length])
    name, shape = (
        bytes(parts[1]).decode("latin-1"),
        [size for (size,) in struct.iter_unpack("<i", parts[0])],
    )
    if not place == len(element) == 8 + size:
        raise InputError(
            f"it must be whole, got a variable {name!r} of another size than it states"
        )
    if len(shape) < 2 or min(shape) < 0:
        raise InputError(f"it must be whole, got an array of shape {shown(shape)}")
    return name
