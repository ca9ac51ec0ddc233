"""NumPy archives and Parquet, each read and written by its own library, and what binary formats share.

Libraries believe what a file says of itself. So all of them read behind :func:`gate`, which looks at stated sizes
first and turns any failure into one line.
"""

from __future__ import annotations

import json
import warnings
import zipfile
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.errors import FileProblem, GaitgraphError, InputError, shown
from gaitgraph.files import MOST_BYTES
from gaitgraph.gait.table import (
    FORMAT,
    ROWS_OF_A_PIECE,
    TEXTS,
    about_from_text,
    merged,
    provenance_of,
    provenance_text,
)
from gaitgraph.io.formats import KNOWN, check_names

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping
    from pathlib import Path

    from gaitgraph.gait.table import Table
    from gaitgraph.io.formats import Progress, RawPieces

    Array = npt.NDArray[Any]

PROVENANCE = "provenance"
"""The array of an archive, and the field of a struct, that state what made the file."""


@contextmanager
def gate(path: Path, what: str, most: int | None = None) -> Iterator[int]:
    """Let a library read a file or the files of a folder, and give their size in bytes.

    Parameters
    ----------
    path
        The file or folder.
    what
        What it must be, for messages.
    most
        How many bytes it may have; by default :data:`gaitgraph.files.MOST_BYTES`.

    Raises
    ------
    FileProblem
        If the file cannot be read.
    InputError
        If it is too large, or if the library fails, whatever it raises.
    """
    try:
        size = sum(one.stat().st_size for one in (path.iterdir() if path.is_dir() else [path]))
        check_size(size, "it", most)
        yield size
    except GaitgraphError:
        raise
    except Exception as error:  # libraries raise errors of many kinds on broken bytes, and each has its own
        if isinstance(error, OSError) and error.filename is not None:
            raise FileProblem(f"gait file: cannot read {shown(str(path))}: {error.strerror}") from error
        reason = shown(" ".join(str(error).split()) or type(error).__name__)[1:-1]
        raise InputError(f"it is not {what}, or it is broken ({reason})") from error


def check_size(size: int, what: str, most: int | None = None) -> None:
    """Raise InputError if something states more bytes than are read."""
    most = MOST_BYTES if most is None else most
    if size > most:
        raise InputError(f"{what} must have at most {most >> 20} MiB, got {size} bytes")


def as_column(array: object, name: str) -> Array | InputError:
    """Return an array as a column of floats or texts; if it is none, the error that a needed column raises."""
    if not isinstance(array, np.ndarray):
        return InputError(f"{name} must be a column, got a {type(array).__name__}")
    if array.dtype.kind not in "fiuUS":
        return InputError(f"{name} must be real numbers or texts, got values of the type {shown(str(array.dtype))}")
    if array.size != max(array.shape, default=1):
        return InputError(f"{name} must be a column, got an array of shape {array.shape}")
    values = array.reshape(-1)
    return np.char.rstrip(values.astype(np.str_)) if array.dtype.kind in "US" else values.astype(np.float64)


def column_pieces(columns: Mapping[str, Array | InputError], about: dict[str, Any], progress: Progress) -> RawPieces:
    """Yield columns some rows at a time: first their names alone, so that these are checked first.

    Columns of a gait table must be columns of one length; a single text counts for all rows. Others are None where they
    are something else.
    """
    yield [(name, []) for name in columns], about
    arrays = {}
    for name, column in columns.items():
        if not isinstance(column, InputError):
            arrays[name] = column
        elif name in KNOWN:
            raise column
    lengths = {len(one) for name, one in arrays.items() if name in KNOWN and (len(one) != 1 or one.dtype.kind == "f")}
    if len(lengths) > 1:
        raise InputError(f"columns must have equally many rows, got {min(lengths)} to {max(lengths)}")
    rows = next(iter(lengths), None)
    if rows is None:  # a table of joints alone
        rows = max((len(one) for one in arrays.values() if one.dtype.kind == "f"), default=0)
    used = {}
    for name, one in arrays.items():
        if name in KNOWN and len(one) == 1 != rows:
            used[name] = np.repeat(one, rows)
        elif name in KNOWN or (one.dtype.kind == "f" and len(one) == rows):
            used[name] = one
    for start in range(0, rows, ROWS_OF_A_PIECE):
        stop = min(start + ROWS_OF_A_PIECE, rows)
        piece = {name: one[start:stop] for name, one in used.items()}
        plain = {name: one if one.dtype.kind == "f" else one.tolist() for name, one in piece.items()}
        yield [(name, plain.get(name)) for name in columns], about
        if progress is not None:
            progress(stop / rows)


def about_of_array(array: object) -> dict[str, Any]:
    """Return what made a file, if an array of it is a text of ours that states it."""
    return about_from_text(array.item()) if isinstance(array, np.ndarray) and array.size == 1 else {}


def array_of(values: Any) -> Array:
    """Return a column of a table as an array, of texts too."""
    return values if isinstance(values, np.ndarray) else np.array(list(values))


# -- NumPy archives


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
    arrays = {name: array_of(values) for name, values in table.columns.items()}
    arrays[PROVENANCE] = np.array(provenance_text(table))
    with zipfile.ZipFile(path, "w") as archive:
        for name, array in arrays.items():  # numpy.savez would write the time
            member = zipfile.ZipInfo(f"{name}.npy", date_time=(1980, 1, 1, 0, 0, 0))
            member.create_system, member.external_attr = 3, 0o600 << 16
            with archive.open(member, "w", force_zip64=True) as stream:
                np.lib.format.write_array(stream, array, allow_pickle=False)


def pieces_of_npz(path: Path, progress: Progress) -> RawPieces:
    """Yield the columns of a NumPy archive, which is read whole."""
    with gate(path, "an archive that numpy.savez wrote, with one array for each column"):
        columns: dict[str, Array | InputError] = {}
        with (
            warnings.catch_warnings(action="ignore"),
            path.open("rb") as file,
            np.load(file, allow_pickle=False) as archive,
        ):
            check_size(sum(member.file_size for member in archive.zip.infolist()), "its arrays")
            for name in archive.files:
                try:
                    columns[name] = as_column(archive[name], name)
                except ValueError as error:  # objects, say, which are not loaded
                    columns[name] = InputError(f"{name} must be real numbers or texts ({error})")
        yield from column_pieces(columns, about_of_array(columns.pop(PROVENANCE, None)), progress)


# -- Parquet: numbers are 64-bit floats, `color` and `types` dictionaries of texts; every field states its unit. pandas
# keeps what it knows of a frame under a key of its own, which is written and understood too.

_PARQUET = "a Parquet file with one column of numbers for each column of the table"
_OURS, _OF_PANDAS = b"gaitgraph", b"PANDAS_ATTRS"
_MOST_UNPACKED = 1 << 32
_STEEPEST = 100
"""What a file may unpack to for each of its bytes, where it unpacks to more than that."""


def write_parquet(pieces: Iterable[Table], path: Path) -> None:
    """Write a new Parquet file, in row groups of 65,536 rows however the pieces are cut."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    writer: Any = None
    try:
        for piece in _regrouped(pieces):
            if writer is None:
                made = {_OURS: provenance_text(piece), _OF_PANDAS: json.dumps({"gaitgraph": provenance_of(piece)})}
                fields = []
                for name, unit in piece.units.items():
                    kind = pa.dictionary(pa.int32(), pa.string()) if _is_text(piece, name) else pa.float64()
                    fields.append(pa.field(name, kind, nullable=False, metadata={"unit": unit} if unit else None))
                schema = pa.schema(fields, metadata=made)
                writer = pq.ParquetWriter(path, schema, write_page_checksum=True)
            arrays = [
                pa.array(list(values)).dictionary_encode() if _is_text(piece, name) else pa.array(values, pa.float64())
                for name, values in piece.columns.items()
            ]
            writer.write_table(pa.Table.from_arrays(arrays, schema=schema), row_group_size=ROWS_OF_A_PIECE)
    finally:
        if writer is not None:
            writer.close()


def _is_text(table: Table, name: str) -> bool:
    return name in TEXTS or isinstance(table[name], tuple)


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


def pieces_of_parquet(path: Path, progress: Progress) -> RawPieces:
    """Yield the columns of a Parquet file, some rows at a time; first their names alone."""
    import pyarrow.parquet as pq

    with gate(path, _PARQUET, most=1 << 62) as size, path.open("rb", buffering=0) as stream:
        file = pq.ParquetFile(
            stream,
            buffer_size=1 << 20,
            pre_buffer=False,  # it would hold the whole file
            page_checksum_verification=True,
            arrow_extensions_enabled=False,
        )
        schema, rows = file.schema_arrow, file.metadata.num_rows
        about = _about_of_parquet(schema.metadata or {})
        yield [(name, []) for name in schema.names], about
        used = []
        for name, kind in zip(schema.names, map(_kind, schema.types), strict=True):
            wanted = "text" if name in TEXTS else "number"
            if name in KNOWN and kind != wanted:
                raise InputError(
                    f"column {name!r} must hold {wanted}s, got {shown(str(schema.field(name).type))[1:-1]}"
                )
            if kind == "number" or name in TEXTS:
                used.append(name)
        if not used:
            raise InputError(f"it must be {_PARQUET}, got no column of numbers")
        check_size(8 * rows * len(used), "its columns", max(_MOST_UNPACKED, _STEEPEST * size))
        done = 0
        for batch in file.iter_batches(batch_size=ROWS_OF_A_PIECE, columns=used, use_threads=False):
            found = dict(zip(batch.schema.names, batch.columns, strict=True))
            yield [(name, _values(found[name]) if name in found else None) for name in schema.names], about
            done += batch.num_rows
            if progress is not None:
                progress(min(done / rows, 1.0) if rows else 1.0)


def _kind(kind: Any) -> str | None:
    """Return whether a column holds numbers or texts, or None."""
    from pyarrow import types

    if types.is_dictionary(kind):
        kind = kind.value_type
    if types.is_floating(kind) or types.is_integer(kind):
        return "number"
    return "text" if types.is_string(kind) or types.is_large_string(kind) else None


def _values(column: Any) -> Any:
    """Return numbers as an array, texts as a list; a list, with None for what is missing, if anything is."""
    if _kind(column.type) == "text" or column.null_count:
        return column.to_pylist()
    if hasattr(column, "dictionary_decode"):
        column = column.dictionary_decode()
    return np.asarray(column.cast("float64").to_numpy(zero_copy_only=False), dtype=np.float64)


def _about_of_parquet(metadata: dict[bytes, bytes]) -> dict[str, Any]:
    """Return what made the file, where we or pandas keep it."""
    for text in (metadata.get(_OURS, b""), metadata.get(_OF_PANDAS, b"")):
        if FORMAT.encode() in text:
            try:
                content = json.loads(text)
            except (RecursionError, ValueError):
                continue
            stated = content.get("gaitgraph", content) if isinstance(content, dict) else None
            return about_from_text(json.dumps(stated))
    return {}
