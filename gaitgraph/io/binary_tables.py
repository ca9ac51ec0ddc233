"""NumPy archives, Parquet and MATLAB files (.mat, level 5), each read and written by its own library.

The libraries trust the sizes that a file states. So they all read within :func:`gate`, which checks these first and
turns any failure into one line.
"""

from __future__ import annotations

import io
import json
import math
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
from gaitgraph.files import MOST_BYTES
from gaitgraph.gait.table import (
    ACCELERATIONS,
    ANGLES,
    FORMAT,
    RATES,
    ROWS_OF_A_PIECE,
    about_from_text,
    merged,
    provenance_of,
    provenance_text,
)
from gaitgraph.io.columns import column_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping
    from pathlib import Path

    from gaitgraph.gait.table import Table
    from gaitgraph.io.columns import FormatOptions, Progress, TableBuilder

    Array = npt.NDArray[Any]

_PROVENANCE = "provenance"  # the array of an archive, and the field of a struct, that state what made the file


@contextmanager
def gate(path: Path, what: str, most: int | None = None) -> Iterator[int]:
    """Let a library read a file or the files of a folder; yield their size in bytes.

    Raises OSError if it cannot be read, and InputError if it has more than `most` bytes (by default
    :data:`gaitgraph.files.MOST_BYTES`) or the library fails in any way; `what` the file must be, for messages.
    """
    try:
        size = sum(one.stat().st_size for one in (path.iterdir() if path.is_dir() else [path]))
        check_size(size, "it", most)
        yield size
    except Exception as error:  # libraries raise errors of many kinds on broken bytes, and each has its own
        if isinstance(error, GaitgraphError) or (isinstance(error, OSError) and error.filename is not None):
            raise
        reason = shown(" ".join(str(error).split()) or type(error).__name__)[1:-1]
        raise InputError(f"it is not {what}, or it is broken ({reason})") from error


def check_size(size: int, what: str, most: int | None = None) -> None:
    """Raise InputError if something states more bytes than are read."""
    most = MOST_BYTES if most is None else most
    if size > most:
        raise InputError(f"{what} must have at most {most >> 20} MiB, got {size} bytes")


def _tables_of(
    arrays: Mapping[str, Any], about: dict[str, Any], builder: TableBuilder, progress: Progress
) -> Iterator[Table]:
    """Yield the tables of arrays by name, some rows at a time."""
    builder.begin(list(arrays), about)
    columns = {name: column_of(name, arrays[name]) for name in builder.used if name in arrays}
    rows = max((len(values) for values in columns.values() if not isinstance(values, str)), default=1)
    for start in range(0, rows, ROWS_OF_A_PIECE):
        stop = min(start + ROWS_OF_A_PIECE, rows)
        cut = {name: one if isinstance(one, str) else one[start:stop] for name, one in columns.items()}
        yield from builder.pieces(cut)
        if progress is not None:
            progress(stop / rows)


def _about_of_array(array: object) -> dict[str, Any]:
    """Return what made a file, if an array of it is a text of ours that states it."""
    return about_from_text(array.item()) if isinstance(array, np.ndarray) and array.size == 1 else {}


# -- NumPy archives


def write_npz(pieces: Iterable[Table], path: Path, options: FormatOptions) -> None:
    """Write a new NumPy archive: one array for each column, and `provenance`, a text.

    It is not compressed and has no time stamps: the same table gives the same bytes everywhere.
    """
    import zipfile

    table = merged(pieces)
    arrays: dict[str, Array] = {name: np.asarray(values) for name, values in table.columns.items()}
    arrays[_PROVENANCE] = np.array(provenance_text(table))
    with zipfile.ZipFile(path, "w") as archive:
        for name, array in arrays.items():  # numpy.savez would write the time
            member = zipfile.ZipInfo(f"{name}.npy", date_time=(1980, 1, 1, 0, 0, 0))
            member.create_system, member.external_attr = 3, 0o600 << 16
            with archive.open(member, "w", force_zip64=True) as stream:
                np.lib.format.write_array(stream, array, allow_pickle=False)


def read_npz(path: Path, builder: TableBuilder, progress: Progress) -> Iterator[Table]:
    """Yield the tables of a NumPy archive, which is read whole."""
    with gate(path, "an archive that numpy.savez wrote, with one array for each column"):
        with warnings.catch_warnings(action="ignore"), path.open("rb") as file, np.load(file) as archive:
            check_size(sum(member.file_size for member in archive.zip.infolist()), "its arrays")
            arrays = {}
            for name in archive.files:
                try:
                    arrays[name] = archive[name]
                except ValueError as error:  # objects, say, which are not loaded
                    arrays[name] = error
        about = _about_of_array(arrays.pop(_PROVENANCE, None))
        yield from _tables_of(arrays, about, builder, progress)


# -- Parquet: numbers are 64-bit floats, `color` and `types` dictionaries of texts; every field states its unit. pandas
# keeps what it knows of a frame under a key of its own, which is written and understood too.

_PARQUET = "a Parquet file with one column of numbers for each column of the table"
_OURS, _OF_PANDAS = b"gaitgraph", b"PANDAS_ATTRS"
_MOST_UNPACKED, _STEEPEST = 1 << 32, 100  # bytes in all, or for each byte of the file, whichever is more


def write_parquet(pieces: Iterable[Table], path: Path, options: FormatOptions) -> None:
    """Write a new Parquet file, in row groups of 65,536 rows however the pieces are cut."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    writer: Any = None
    try:
        for piece in _regrouped(pieces):
            if writer is None:
                made = {_OURS: provenance_text(piece), _OF_PANDAS: json.dumps({"gaitgraph": provenance_of(piece)})}
                texts, fields = pa.dictionary(pa.int32(), pa.string()), []
                for name, unit in piece.units.items():
                    kind = pa.float64() if isinstance(piece[name], np.ndarray) else texts
                    fields.append(pa.field(name, kind, nullable=False, metadata={"unit": unit} if unit else None))
                schema = pa.schema(fields, metadata=made)
                writer = pq.ParquetWriter(path, schema, write_page_checksum=True)
            columns = {name: list(one) if isinstance(one, tuple) else one for name, one in piece.columns.items()}
            writer.write_table(pa.table(columns, schema), row_group_size=ROWS_OF_A_PIECE)
    finally:
        if writer is not None:
            writer.close()


def _regrouped(pieces: Iterable[Table]) -> Iterator[Table]:
    """Yield the same rows in pieces that all but the last have as many rows as a row group."""
    held: list[Table] = []
    for piece in pieces:
        held.append(piece)
        while sum(map(len, held)) >= ROWS_OF_A_PIECE:
            whole = merged(held)
            yield whole.rows(0, ROWS_OF_A_PIECE)
            held = [whole.rows(ROWS_OF_A_PIECE, len(whole))]
    if sum(map(len, held)):
        yield merged(held)


def read_parquet(path: Path, builder: TableBuilder, progress: Progress) -> Iterator[Table]:
    """Yield the tables of a Parquet file, some rows at a time."""
    import pyarrow.parquet as pq
    from pyarrow.types import is_nested

    with gate(path, _PARQUET, most=1 << 62) as size, path.open("rb", buffering=0) as stream:
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
                raise InputError(f"{name} must be a column of numbers or of texts, got {schema.field(name).type}")
        check_size(8 * rows * len(used), "its columns", max(_MOST_UNPACKED, _STEEPEST * size))
        done = 0
        for batch in file.iter_batches(batch_size=ROWS_OF_A_PIECE, columns=used, use_threads=False):
            yield from builder.pieces(dict(zip(batch.schema.names, batch.columns, strict=True)))
            done += batch.num_rows
            if progress is not None:
                progress(min(done / rows, 1.0) if rows else 1.0)


def _about_of_parquet(metadata: dict[bytes, bytes]) -> dict[str, Any]:
    """Return what made the file, where we or pandas keep it."""
    for text in (metadata.get(_OURS, b""), metadata.get(_OF_PANDAS, b"")):
        if FORMAT.encode() in text:
            try:
                content = json.loads(text)
            except (RecursionError, ValueError):
                continue
            return about_from_text(json.dumps(content.get("gaitgraph", content) if isinstance(content, dict) else None))
    return {}


# -- MATLAB files

_GAIT = "gait"  # the struct
_GROUPS = {"alpha": ANGLES, "alpha_rate": RATES, "alpha_acceleration": ACCELERATIONS}  # matrices, a column for a rotor
_ANGLES = frozenset({"alpha", "alpha1", "alpha1_deg"})
_MAT = "a MAT-file of level 5 in little-endian order, as save -v7 or save -v6 write it"
_HEADER, _TEXT_OF_HEADER = 128, 116
_MATRIX, _COMPRESSED = 14, 15
_TYPES = frozenset({1, 2, 3, 4, 5, 6, 7, 9, 12, 13, 16, 17, 18})
_CELL, _STRUCT, _TEXT = 1, 2, 4
_CLASSES = frozenset({_CELL, _STRUCT, _TEXT, *range(6, 16)})  # without objects, functions and sparse matrices
_DEEPEST = 100

_NAME = re.compile(r"[A-Za-z]\w{0,62}", re.ASCII)


def write_mat(pieces: Iterable[Table], path: Path, options: FormatOptions) -> None:
    """Write a new MATLAB file: every column as a variable, angles, rates and accelerations as matrices too.

    The struct `gait` has `t`, the matrices and the other columns, `names` and `units` of the columns, and `provenance`.
    """
    from scipy.io import savemat
    from scipy.io.matlab import MatWriteError

    table = merged(pieces)
    for name in table.columns:
        if not _NAME.fullmatch(name):
            raise InputError(f"column must be up to 63 letters, digits and _ in a .mat file, got {shown(name)}")
    columns = {name: np.asarray(values) for name, values in table.columns.items()}
    fields, groups = dict(columns), {}
    for group, names in _GROUPS.items():
        if all(name in columns for name in names):
            groups[group] = np.column_stack([fields.pop(name) for name in names])
    fields = {**({"t": fields["t"]} if "t" in fields else {}), **groups, **fields}
    fields["names"], fields["units"] = np.array(list(columns)), np.array(list(table.units.values()))
    fields[_PROVENANCE] = np.array(provenance_text(table))
    try:
        savemat(path, {**columns, **groups, _GAIT: fields}, oned_as="column", long_field_names=True)
    except MatWriteError as error:
        raise InputError(f"{len(table)} rows are too many for a .mat file ({error}); write a .parquet file") from error
    with path.open("r+b") as stream:  # scipy writes the time and the system there
        stream.write(f"MATLAB 5.0 MAT-file, written by gaitgraph {__version__}".ljust(_TEXT_OF_HEADER).encode())


def read_mat(path: Path, builder: TableBuilder, progress: Progress) -> Iterator[Table]:
    """Yield the tables of a MATLAB file, which is read whole: of its variables, or else of the fields of a struct."""
    with gate(path, _MAT):
        with warnings.catch_warnings(action="ignore"):
            variables = _mat_variables(path.read_bytes())
        plain = {name: one for name, one in variables.items() if not one.dtype.names}
        structs = [_fields(one) for name, one in variables.items() if one.dtype.names and name != _GAIT]
        ours = _fields(variables.get(_GAIT, np.zeros(0)))
        tables = [[one for one in some if one] for some in ([plain], [ours], structs)]
        # What has angles is preferred; joints may have any name.
        with_angles = [[one for one in some if not _ANGLES.isdisjoint(one)] for some in tables]
        found, *others = next(filter(None, with_angles + tables), [{}])
        if others:
            raise InputError(f"it must have one struct of angles, or one called {_GAIT!r}, got {1 + len(others)}")
        about = _about_of_array({**found, **ours}.get(_PROVENANCE))
        if about:
            found = {name: one for name, one in found.items() if name not in ("names", "units", _PROVENANCE)}
        for group, angles in _GROUPS.items():
            matrix = found.pop(group, None)
            if matrix is not None and found.keys().isdisjoint(angles):
                if not isinstance(matrix, np.ndarray) or matrix.ndim != 2 or matrix.shape[1] != len(angles):
                    raise InputError(f"{group} must be a matrix of 4 columns, got shape {np.shape(matrix)}")
                found |= dict(zip(angles, matrix.T, strict=True))
        yield from _tables_of(found, about, builder, progress)


def _fields(array: Array) -> dict[str, Any]:
    """Return the fields of a struct; nothing of another array."""
    return {name: array[name].item() for name in array.dtype.names or ()} if array.size == 1 else {}


def _mat_variables(content: bytes) -> dict[str, Array]:
    """Return the variables of a MATLAB file as scipy reads them, without objects and functions.

    scipy gets one variable at a time, inflated, so that nothing in it refers to another one.
    """
    from scipy.io import loadmat

    if content[_HEADER - 4 : _HEADER] != b"\0\1IM":
        raise InputError(f"it must be {_MAT}, got another kind of file (one of version 7.3 is HDF5)")
    variables: dict[str, Array] = {}
    place, inflated = _HEADER, 0
    while place < len(content):
        kind, size = struct.unpack_from("<II", content, place)
        element = content[place : place + 8 + size]
        if len(element) < 8 + size:
            raise InputError(f"it must be whole, got a variable that ends at byte {place + 8 + size} of {len(content)}")
        place += 8 + size
        if kind == _COMPRESSED:
            inflater = zlib.decompressobj()
            element = inflater.decompress(element[8:], MOST_BYTES - inflated + 1)
            inflated += len(element)
            check_size(inflated, "its variables")
            if not inflater.eof:  # behind the last byte is a checksum
                raise InputError("it must be whole, got a compressed variable that ends early")
        if len(element) > 16 and element[16] not in _CLASSES:
            continue
        name, end = _array_at(memoryview(element), 0)
        if not end == len(element) == 8 + struct.unpack_from("<I", element, 4)[0]:
            raise InputError(f"it must be whole, got a variable {name!r} of another size than it states")
        if name and not name.startswith("__"):  # others belong to objects and functions
            stream: Any = io.BytesIO(content[:_HEADER] + element)
            variables[name] = loadmat(stream)[name]
    return variables


def _array_at(content: memoryview, place: int, depth: int = 0) -> tuple[str, int]:
    """Return the name of an array of a MATLAB file and where it ends, without looking at values.

    scipy follows types, counts and nested arrays in C as a file states them; unknown types, or thousands of levels, end
    the process. So they are checked here, in the order in which scipy goes through them; struct.error is raised too.
    """

    def part() -> memoryview:
        nonlocal place
        kind, size = struct.unpack_from("<II", content, place)
        if kind >> 16:  # up to four bytes are in the tag itself
            kind, size, start, place = kind & 0xFFFF, kind >> 16, place + 4, place + 8
        else:
            start, place = place + 8, place + 8 + size + -size % 8
        if kind not in _TYPES or start + size > len(content):
            raise InputError(f"it must be whole, got a part of type {kind} and {size} bytes at byte {start}")
        return content[start : start + size]

    kind, size = struct.unpack_from("<II", content, place)
    if kind != _MATRIX or depth > _DEEPEST:
        raise InputError(f"it must hold arrays, at most {_DEEPEST} within each other, got type {kind} at level {depth}")
    if not size:
        return "", place + 8
    (flags,) = struct.unpack_from("<I", content, place + 16)
    class_, is_complex = flags & 0xFF, bool(flags & 0x0800)
    if class_ not in _CLASSES:
        raise InputError(f"it must hold numbers, texts, cells and structs, got an array of class {class_}")
    place += 24
    shape = [size for (size,) in struct.iter_unpack("<i", part())]
    if len(shape) < 2 or min(shape) < 0:
        raise InputError(f"it must be whole, got an array of shape {shown(shape)}")
    name, inner = bytes(part()).decode("latin-1"), math.prod(shape)
    if class_ == _STRUCT:
        (width,) = struct.unpack("<i", part())
        inner *= len(part()) // max(width, 1)
    elif class_ != _CELL:
        inner = 0
        for _ in range(1 + is_complex):
            part()
    for _ in range(inner):
        _, place = _array_at(content, place, depth + 1)
    return name, place
