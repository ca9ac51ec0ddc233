"""NumPy archives, Parquet and MATLAB files (.mat, level 5), each read and written by its own library."""

from __future__ import annotations

import json
import re
import warnings
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitgraph import __version__
from gaitgraph.errors import GaitgraphError, InputError, shown, wrong
from gaitgraph.gait.table import (
    ACCELERATIONS,
    ANGLES,
    RATES,
    about_from_text,
    provenance_of,
    provenance_text,
)
from gaitgraph.io.columns import RawTable, named_columns

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from gaitgraph.gait.table import Table

_PROVENANCE = "provenance"  # the array that states what made the file


@contextmanager
def library(what: str) -> Iterator[None]:
    """Let a library read a file: whatever it raises at broken bytes becomes one line, with `what` the file must be.

    Only calls of the library belong within: an error of our own code is no broken file. An OSError of the system, and
    warnings of the library, are passed over.

    >>> with library("a list"):
    ...     raise ValueError("it is short")
    Traceback (most recent call last):
    gaitgraph.errors.InputError: it is not a list, or it is broken (it is short)
    """
    try:
        with warnings.catch_warnings(action="ignore"):
            yield
    except MemoryError as error:
        raise InputError(
            "it needs more memory than there is, or it states wrong sizes"
        ) from error
    except Exception as error:  # each library has errors of its own
        of_system = isinstance(error, OSError) and error.filename is not None
        if isinstance(error, GaitgraphError) or of_system:
            raise
        reason = shown(" ".join(str(error).split()) or type(error).__name__)[1:-1]
        raise InputError(f"it is not {what}, or it is broken ({reason})") from error


def _about_of_array(array: object) -> dict[str, Any]:
    """Return what made a file, if an array of it is a text of ours that states it."""
    if not isinstance(array, np.ndarray) or array.size != 1:
        return {}
    return about_from_text(array.item())


# -- NumPy archives


def write_npz(table: Table, path: Path) -> None:
    """Write a new NumPy archive: one array for each column, and `provenance`, a text.

    It is not compressed and has no time stamps: the same table gives the same bytes everywhere.
    """
    arrays = dict(table.columns)
    arrays[_PROVENANCE] = np.array(provenance_text(table))
    with path.open("wb") as stream:
        np.savez(stream, **arrays)


def read_npz(path: Path) -> RawTable:
    """Return the arrays in a NumPy archive; those that hold objects are not loaded."""
    what = "an archive that numpy.savez wrote, with one array for each column"
    arrays: dict[str, Any] = {}
    with (
        library(what),
        path.open("rb") as file,
        np.load(file, allow_pickle=False) as archive,
    ):
        for name in archive.files:
            try:
                arrays[name] = archive[name]
            except ValueError as error:  # of objects, which matters if it is a column
                arrays[name] = error
    about = _about_of_array(arrays.pop(_PROVENANCE, None))
    return RawTable(columns=arrays, about=about)


# -- Parquet: numbers are 64-bit floats, `color` and `types` dictionaries of texts; every field states its unit. pandas
# keeps what it knows of a frame under a key of its own, which is written and understood too.

_OURS, _OF_PANDAS = b"gaitgraph", b"PANDAS_ATTRS"


def write_parquet(table: Table, path: Path) -> None:
    """Write a new Parquet file."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    made = {
        _OURS: provenance_text(table),
        _OF_PANDAS: json.dumps({"gaitgraph": provenance_of(table)}),
    }
    texts = pa.dictionary(pa.int32(), pa.string())
    fields = []
    for name, unit in table.units.items():
        kind = pa.float64() if isinstance(table[name], np.ndarray) else texts
        field = pa.field(name, kind, nullable=False)
        if unit:
            field = field.with_metadata({"unit": unit})
        fields.append(field)
    schema = pa.schema(fields, metadata=made)
    columns = [pa.array(table[field.name], field.type) for field in fields]
    pq.write_table(pa.table(columns, schema=schema), path)


def read_parquet(path: Path) -> RawTable:
    """Return the columns in a Parquet file."""
    import pyarrow.parquet as pq

    what = "a Parquet file with one column of numbers for each column of the table"
    with library(what), path.open("rb") as stream:
        read = pq.ParquetFile(stream).read()
        read.validate(full=True)
    columns = named_columns(read.column_names, read.combine_chunks().columns)
    about = _about_of_parquet(read.schema.metadata or {})
    return RawTable(columns=columns, about=about)


def _about_of_parquet(metadata: dict[bytes, bytes]) -> dict[str, Any]:
    """Return what made the file, where we or pandas keep it."""
    if _OURS in metadata:
        return about_from_text(metadata[_OURS].decode())
    with suppress(ValueError, AttributeError):  # the attributes of somebody else
        attributes = json.loads(metadata.get(_OF_PANDAS, b"{}"))
        return about_from_text(json.dumps(attributes.get("gaitgraph")))
    return {}


# -- MATLAB files

_GROUPS = {
    "alpha": ANGLES,
    "alpha_rate": RATES,
    "alpha_acceleration": ACCELERATIONS,
}  # matrices, a column for a rotor
_MAT = "a MAT-file as save -v7 or save -v6 write it"
_TEXT_OF_HEADER = 116
_NAME = re.compile(r"[A-Za-z]\w{0,62}", re.ASCII)


def write_mat(table: Table, path: Path) -> None:
    """Write a new MATLAB file: every column as a variable, angles, rates and accelerations as matrices too.

    Beside them are `names` and `units` of the columns, and `provenance`, as texts.
    """
    from scipy.io import savemat
    from scipy.io.matlab import MatWriteError

    for name in table.columns:
        if not _NAME.fullmatch(name):
            raise wrong(
                "column", "must be up to 63 letters, digits and _ in a .mat file", name
            )
    arrays = dict(table.columns)
    for group, names in _GROUPS.items():
        if all(name in table for name in names):
            arrays[group] = np.column_stack([table[name] for name in names])
    arrays["names"] = list(table.columns)
    arrays["units"] = list(table.units.values())
    arrays[_PROVENANCE] = provenance_text(table)
    try:
        savemat(path, arrays, oned_as="column", do_compression=True)
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


def read_mat(path: Path) -> RawTable:
    """Return the variables in a MATLAB file."""
    from scipy.io import loadmat

    stream: Any  # scipy's types know paths alone
    with library(_MAT), path.open("rb") as stream:
        variables: dict[str, Any] = loadmat(stream)
    arrays = {
        name: values
        for name, values in variables.items()
        if not name.startswith("__") and values.dtype.kind in "biufcU"
    }
    if not arrays:
        raise InputError(
            "it must have variables of numbers; save -struct writes the fields of a struct as such"
        )
    about = _about_of_array(arrays.get(_PROVENANCE))
    if about:
        for name in ("names", "units", _PROVENANCE):
            arrays.pop(name, None)
    for group, names in _GROUPS.items():
        matrix = arrays.pop(group, None)
        if matrix is not None and arrays.keys().isdisjoint(names):
            if matrix.ndim != 2 or matrix.shape[1] != len(names):
                got = f"shape {matrix.shape}"
                raise wrong(
                    group, "must be a matrix of 4 columns", matrix.shape, got=got
                )
            arrays |= dict(zip(names, matrix.T, strict=True))
    return RawTable(columns=arrays, about=about)
