"""Parquet files (.parquet), written and read by pyarrow, row group by row group.

Numbers are 64-bit floats, `color` and `types` dictionaries of texts. Every field says its unit, and the file what made
it. pandas keeps what it knows of a frame under a key of its own, which is written and understood too.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitgraph.errors import GaitgraphError, InputError, needs_extra, shown
from gaitgraph.gait.table import FORMAT, ROWS_OF_A_PIECE, TEXTS, about_from_text, merged, provenance_of, provenance_text
from gaitgraph.io.columns import KNOWN, opened

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path

    from gaitgraph.gait.table import Table
    from gaitgraph.io.columns import Progress, RawPiece

__all__ = ["pieces_of_parquet", "write_parquet"]

_ALLOWED = "allowed is a Parquet file with one column of numbers for each column of the table"
_OURS, _OF_PANDAS = b"gaitgraph", b"PANDAS_ATTRS"
_MOST_COLUMNS = 1000
_BUFFER = 1 << 20
_MOST_UNPACKED = 1 << 32
_STEEPEST = 100
"""What a file may unpack to for each of its bytes, where it unpacks to more than that."""


def _pyarrow() -> Any:
    try:
        import pyarrow as pa
        import pyarrow.parquet
    except ImportError as error:
        raise needs_extra("pyarrow", "Parquet", "table") from error
    return pa


def write_parquet(pieces: Iterable[Table], path: Path) -> None:
    """Write a new Parquet file, in row groups of 65,536 rows however the pieces are cut."""
    pa = _pyarrow()
    writer: Any = None
    try:
        for piece in _regrouped(pieces):
            if writer is None:
                schema = _schema(piece, pa)
                writer = pa.parquet.ParquetWriter(path, schema, write_page_checksum=True)
            arrays = [
                pa.array(list(values)).dictionary_encode()
                if _holds_text(piece, name)
                else pa.array(values, pa.float64())
                for name, values in piece.columns.items()
            ]
            writer.write_table(pa.Table.from_arrays(arrays, schema=schema), row_group_size=ROWS_OF_A_PIECE)
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


def _holds_text(table: Table, name: str) -> bool:
    return name in TEXTS or isinstance(table[name], tuple)


def _schema(table: Table, pa: Any) -> Any:
    """Return the types and units of the columns, and what made them."""
    fields = []
    for name, unit in table.units.items():
        kind = pa.dictionary(pa.int32(), pa.string()) if _holds_text(table, name) else pa.float64()
        fields.append(pa.field(name, kind, nullable=False, metadata={"unit": unit} if unit else None))
    attributes = json.dumps({"gaitgraph": provenance_of(table)}, allow_nan=False)
    return pa.schema(fields, metadata={_OURS: provenance_text(table), _OF_PANDAS: attributes})


def pieces_of_parquet(path: Path, progress: Progress) -> Iterator[RawPiece]:
    """Yield the columns of a Parquet file, some rows at a time; first their names alone."""
    pa = _pyarrow()
    with opened(path, _ALLOWED) as (stream, size):
        try:
            file = pa.parquet.ParquetFile(
                pa.PythonFile(stream, mode="r"),
                buffer_size=_BUFFER,
                pre_buffer=False,  # it would hold the whole file
                page_checksum_verification=True,
                arrow_extensions_enabled=False,
            )
            yield from _pieces(file, size, progress, pa)
        except GaitgraphError:
            raise
        except (pa.ArrowException, MemoryError, OSError, OverflowError, TypeError, ValueError) as error:
            reason = shown(" ".join(str(error).split()) or type(error).__name__)[1:-1]
            raise InputError(f"it is no Parquet file, or a broken one ({reason}); {_ALLOWED}") from error


def _pieces(file: Any, size: int, progress: Progress, pa: Any) -> Iterator[RawPiece]:
    schema, rows = file.schema_arrow, file.metadata.num_rows
    if len(schema.names) > _MOST_COLUMNS:
        raise InputError(f"it has {len(schema.names)} columns; allowed are {_MOST_COLUMNS} at most")
    about = _about(schema.metadata or {})
    yield [(name, []) for name in schema.names], about
    kinds = {name: _kind(kind, pa) for name, kind in zip(schema.names, schema.types, strict=True)}
    for name, kind in kinds.items():
        wanted = "text" if name in TEXTS else "number"
        if name in KNOWN and kind != wanted:
            held = shown(str(schema.field(name).type))[1:-1]
            raise InputError(f"column {name!r} holds {held}; allowed are {wanted}s")
    used = [name for name, kind in kinds.items() if kind == "number" or name in TEXTS]
    if not used:
        raise InputError(f"it has no column of numbers; {_ALLOWED}")
    held = 8 * rows * len(used)
    if held > max(_MOST_UNPACKED, _STEEPEST * size):
        raise InputError(
            f"its {rows} rows of {len(used)} columns unpack to {held >> 20} MiB, and it has {size} bytes; allowed are "
            f"{_MOST_UNPACKED >> 20} MiB, or {_STEEPEST} times its size"
        )
    done = 0
    for batch in file.iter_batches(batch_size=ROWS_OF_A_PIECE, columns=used, use_threads=False):
        found = dict(zip(batch.schema.names, batch.columns, strict=True))
        yield [(name, _values(found[name], pa) if name in found else None) for name in schema.names], about
        done += batch.num_rows
        if progress is not None:
            progress(min(done / rows, 1.0) if rows else 1.0)


def _kind(kind: Any, pa: Any) -> str | None:
    """Return whether a column holds numbers or texts, or None."""
    if pa.types.is_dictionary(kind):
        kind = kind.value_type
    if pa.types.is_floating(kind) or pa.types.is_integer(kind):
        return "number"
    return "text" if pa.types.is_string(kind) or pa.types.is_large_string(kind) else None


def _values(column: Any, pa: Any) -> Any:
    """Return numbers as an array, texts as a list; a list, with None for what is missing, if anything is."""
    if _kind(column.type, pa) == "text" or column.null_count:
        return column.to_pylist()
    if pa.types.is_dictionary(column.type):
        column = column.dictionary_decode()
    return np.asarray(column.cast(pa.float64()).to_numpy(zero_copy_only=False), dtype=np.float64)


def _about(metadata: dict[bytes, bytes]) -> dict[str, Any]:
    """Return what made the file, where we or pandas keep it."""
    for text in (metadata.get(_OURS, b""), metadata.get(_OF_PANDAS, b"")):
        if FORMAT.encode() in text:
            try:
                content = json.loads(text)
            except (RecursionError, ValueError):
                continue
            told = content.get("gaitgraph", content) if isinstance(content, dict) else None
            return about_from_text(json.dumps(told))
    return {}
