"""MATLAB files (.mat, level 5), by scipy, and a function for MATLAB and Octave (.m) that loads and plots a gait.

The text of the function is `gait_function.m`. It needs no toolbox and no Python, and reads the .mat, .csv or .json file
of its own name.
"""

from __future__ import annotations

import io
import math
import re
import struct
import warnings
import zlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitgraph import __version__
from gaitgraph.errors import InputError, shown
from gaitgraph.gait.table import ACCELERATIONS, ANGLES, RATES, merged, provenance_text
from gaitgraph.io.binary_tables import (
    PROVENANCE,
    about_of_array,
    array_of,
    as_column,
    check_size,
    column_pieces,
    gate,
)
from gaitgraph.io.formats import check_names

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from gaitgraph.gait.table import Table
    from gaitgraph.io.binary_tables import Array
    from gaitgraph.io.formats import Progress, RawPieces

GAIT = "gait"
"""The struct of a MATLAB file."""

_GROUPS = {"alpha": ANGLES, "alpha_rate": RATES, "alpha_acceleration": ACCELERATIONS}
"""Matrices with one column for each rotor."""

_NO_COLUMNS = ("names", "units", PROVENANCE)
"""Fields of the struct that are no columns."""

_MAT = "a MAT-file of level 5, as save -v7 or save -v6 write it"
_HEADER, _TEXT_OF_HEADER = 128, 116
_MATRIX, _COMPRESSED = 14, 15
_TYPES = frozenset({1, 2, 3, 4, 5, 6, 7, 9, 12, 13, 16, 17, 18})
_CELL, _STRUCT, _OBJECT, _FUNCTION, _OPAQUE = 1, 2, 3, 16, 17
_PARTS = {4: 1, 5: 3} | dict.fromkeys(range(6, 16), 1)
"""Classes of texts, sparse and real numbers, and how many parts their values have; one more if they are complex."""
_MOST_VARIABLES = 1000
_DEEPEST = 100

MARK = "% made by: "
END = "% end"

_NAME = re.compile(r"[A-Za-z]\w{0,62}", re.ASCII)
_KEYWORDS = frozenset(
    {"break", "case", "catch", "classdef", "continue", "else", "elseif", "end", "for", "function", "global", "if"}
    | {"otherwise", "parfor", "persistent", "return", "spmd", "switch", "try", "while"}
)
_NOT_NAMES = re.compile(r"^%.*|(?<![\w)\]}.'])'(?:[^'\n]|'')*'|<<[\w ]+>>", re.MULTILINE)


def is_matlab_name(name: str) -> bool:
    """Return whether MATLAB takes a name for a variable or a function.

    >>> is_matlab_name("gait3"), is_matlab_name("3rd-gait"), is_matlab_name("end")
    (True, False, False)
    """
    return bool(_NAME.fullmatch(name)) and name not in _KEYWORDS


def write_mat(pieces: Iterable[Table], path: Path) -> None:
    """Write a new MATLAB file.

    Every column is a variable, numbers as column vectors, texts as the rows of a character matrix. The angles, and if
    there are any the rates and accelerations, are there as matrices with four columns too: `alpha`, `alpha_rate`,
    `alpha_acceleration`. The struct `gait` has `t`, the matrices and the other columns, `names` and `units` of the
    columns, and `provenance`.

    Raises
    ------
    InputError
        If a column's name is none for MATLAB, or that of something else in the file, or if the table is too long for
        such a file.
    """
    from scipy.io import savemat
    from scipy.io.matlab import MatWriteError

    table = merged(pieces)
    check_names(table.columns, [GAIT, *_GROUPS, *_NO_COLUMNS], ".mat")
    for name in table.columns:
        if not is_matlab_name(name):
            raise InputError(f"column must be letters, digits and _ and no keyword in a .mat file, got {shown(name)}")
    columns = {name: array_of(values) for name, values in table.columns.items()}
    groups = {
        group: np.column_stack([columns[name] for name in names])
        for group, names in _GROUPS.items()
        if all(name in columns for name in names)
    }
    grouped = {name for group in groups for name in _GROUPS[group]}
    fields: dict[str, Any] = {name: values for name, values in columns.items() if name not in grouped}
    fields = {"t": fields["t"], **groups, **fields} if "t" in fields else {**groups, **fields}
    fields["names"], fields["units"] = np.array(list(columns)), np.array(list(table.units.values()))
    fields[PROVENANCE] = provenance_text(table)
    try:
        savemat(path, {**columns, **groups, GAIT: fields}, oned_as="column", long_field_names=True)
    except MatWriteError as error:
        raise InputError(f"{len(table)} rows are too many for a .mat file ({error}); write a .parquet file") from error
    with path.open("r+b") as stream:  # scipy writes the time and the system there
        stream.write(f"MATLAB 5.0 MAT-file, written by gaitgraph {__version__}".ljust(_TEXT_OF_HEADER).encode())


def pieces_of_mat(path: Path, progress: Progress) -> RawPieces:
    """Yield the columns of a MATLAB file, which is read whole: of its variables, or else of the fields of a struct."""
    with gate(path, _MAT):
        with warnings.catch_warnings(action="ignore"):
            variables = _mat_variables(path.read_bytes())
        arrays = {name: one for name, one in variables.items() if isinstance(one, np.ndarray)}
        structs = {name: one for name, one in arrays.items() if one.dtype.names and one.size == 1}
        plain = {name: one for name, one in variables.items() if name not in structs}
        chosen = [GAIT] if GAIT in structs else list(structs)
        if len(chosen) > 1 and not any(one.dtype.kind in "fiu" and one.size > 1 for one in arrays.values()):
            names = ", ".join(map(repr, chosen[:4])) + (", …" if len(chosen) > 4 else "")
            raise InputError(f"it must have one struct, or one called {GAIT!r}, got {len(chosen)}, {names}")
        fields = {}
        if len(chosen) == 1:
            fields = {name: structs[chosen[0]][name].item() for name in structs[chosen[0]].dtype.names}
        about = about_of_array({**plain, **fields}.get(PROVENANCE))
        inside = fields and (not plain or (_has_angles(fields) and not _has_angles(plain)))
        yield from column_pieces(_mat_columns(fields if inside else plain), about, progress)


def _has_angles(found: Mapping[str, Any]) -> bool:
    return not found.keys().isdisjoint(("alpha", "alpha1", "alpha1_deg"))


def _mat_columns(found: Mapping[str, Any]) -> dict[str, Array | InputError]:
    """Return the columns that variables or fields are, or why they are none; matrices have one for each rotor."""
    columns: dict[str, Array | InputError] = {}
    for name, one in found.items():
        group = _GROUPS.get(name, ())
        if group and found.keys().isdisjoint(group):
            is_matrix = isinstance(one, np.ndarray) and one.ndim == 2 and one.shape[1] == len(group)
            for k, angle in enumerate(group):
                if is_matrix:
                    columns[angle] = as_column(one[:, k], angle)
                else:
                    got = f"shape {one.shape}" if isinstance(one, np.ndarray) else type(one).__name__
                    columns[angle] = InputError(f"{angle}: {name} must be a matrix of 4 columns, got {got}")
        elif not group and name not in _NO_COLUMNS:
            columns[name] = as_column(one, name)
    return columns


def _mat_variables(content: bytes) -> dict[str, Any]:
    """Return the variables of a MATLAB file as scipy reads them.

    scipy gets one variable at a time, inflated up to the size that it states, so that nothing in it leads elsewhere.
    """
    from scipy.io import loadmat
    from scipy.io.matlab import matfile_version

    stream: Any = io.BytesIO(content)
    version = matfile_version(stream)[0]
    if version != 1:
        raise InputError(f"it must be {_MAT}, got {'version 7.3 (HDF5)' if version == 2 else 'level 4'}")
    header, order = content[:_HEADER], "<" if content[_HEADER - 2 : _HEADER] == b"IM" else ">"
    variables: dict[str, Any] = {}
    place, inflated = _HEADER, 0
    for count in range(_MOST_VARIABLES + 1):
        if place >= len(content):
            break
        if count == _MOST_VARIABLES:
            raise InputError(f"it must have at most {_MOST_VARIABLES} variables, got more")
        kind, size = struct.unpack_from(f"{order}II", content, place)
        element = content[place : place + 8 + size]
        if len(element) < 8 + size:
            raise InputError(f"it must be whole, got a variable that ends at byte {place + 8 + size} of {len(content)}")
        place += 8 + size
        if kind == _COMPRESSED:
            inflater = zlib.decompressobj()
            element = inflater.decompress(element[8:], 8)
            size = struct.unpack(f"{order}II", element)[1]
            inflated += size
            check_size(inflated, "its variables")
            element += inflater.decompress(inflater.unconsumed_tail, size + 1)
            if len(element) != 8 + size or not inflater.eof:  # behind the last byte is a checksum
                raise InputError("it must be whole, got a variable of another size than it states")
        name, end = _array_at(memoryview(element), 0, order)
        if end > len(element):
            raise InputError(f"it must be whole, got a variable {name!r} that ends early")
        if name and not name.startswith("__"):  # others are objects, and what belongs to functions
            stream = io.BytesIO(header + element)
            variables[name] = loadmat(stream)[name]
    return variables


def _array_at(content: memoryview, place: int, order: str, depth: int = 0) -> tuple[str, int]:
    """Return the name of an array of a MATLAB file and where it ends, without looking at values.

    scipy follows types, counts and nested arrays in C as a file states them; unknown types, or thousands of levels, end
    the process. So they are checked here, in the order in which scipy goes through them.

    Raises
    ------
    InputError, struct.error
        If the array is broken or nested too deeply.
    """

    def part() -> memoryview:
        nonlocal place
        kind, size = struct.unpack_from(f"{order}II", content, place)
        if kind >> 16:  # up to four bytes are in the tag itself
            kind, size, start, place = kind & 0xFFFF, kind >> 16, place + 4, place + 8
        else:
            start, place = place + 8, place + 8 + size + -size % 8
        if kind not in _TYPES or start + size > len(content):
            raise InputError(f"it must be whole, got a part of type {kind} and {size} bytes at byte {start}")
        return content[start : start + size]

    kind, size = struct.unpack_from(f"{order}II", content, place)
    if kind != _MATRIX or depth > _DEEPEST:
        raise InputError(f"it must hold arrays, at most {_DEEPEST} within each other, got type {kind} at level {depth}")
    if not size:
        return "", place + 8
    (flags,) = struct.unpack_from(f"{order}I", content, place + 16)
    class_, is_complex = flags & 0xFF, bool(flags & 0x0800)
    place += 24
    name, arrays = "", 1
    if class_ == _OPAQUE:
        for _ in range(3):
            part()
    else:
        shape = [size for (size,) in struct.iter_unpack(f"{order}i", part())]
        if len(shape) < 2 or min(shape) < 0:
            raise InputError(f"it must be whole, got an array of shape {shown(shape)}")
        arrays = math.prod(shape)
        name = bytes(part()).decode("latin-1")
    if class_ in _PARTS:
        arrays = 0
        for _ in range(_PARTS[class_] + is_complex):
            part()
    elif class_ in (_STRUCT, _OBJECT):
        if class_ == _OBJECT:
            part()
        (width,) = struct.unpack(f"{order}i", part())
        if width < 1:
            raise InputError(f"it must be whole, got a struct whose names have {width} characters")
        arrays *= len(part()) // width
    elif class_ == _FUNCTION:
        arrays = 1
    elif class_ not in (_CELL, _OPAQUE):
        raise InputError(f"it must hold arrays, got class {class_}")
    for _ in range(arrays):
        _, place = _array_at(content, place, order, depth + 1)
    return name, place


def write_m(pieces: Iterable[Table], path: Path) -> None:
    """Write a new MATLAB function: it loads and plots the .mat, .csv or .json file of its own name.

    Raises
    ------
    InputError
        If the file's name is none that MATLAB can call, or one that the function itself calls.
    """
    name = path.stem
    if not is_matlab_name(name):
        raise InputError(
            "output must be named by letters, digits and _, a letter first, and by no keyword, for a MATLAB function, "
            f"got {shown(path.name)}"
        )
    text = Path(__file__).with_name("gait_function.m").read_text(encoding="ascii")
    # In a file of the name of one of its functions or variables it would call itself.
    if name in {"alpha", *re.findall(r"(?<![\w.])[A-Za-z]\w*", _NOT_NAMES.sub(" ", text))}:
        raise InputError(
            f"output must have another name than {shown(path.name)}: the script has a function or a variable {name}"
        )
    made = MARK + provenance_text(next(iter(pieces)))
    path.write_text(text.replace("<<name>>", name).replace("<<made by>>", made), encoding="ascii")
