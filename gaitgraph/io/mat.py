"""MATLAB files (.mat, level 5): every column as a column vector, and all of them in the struct `gait`.

They are written by scipy and read here: scipy's reader believes the sizes that a file claims, and follows it as deep as
it is nested. Here one level of one struct is looked at; cells, objects and functions are never built.
"""

from __future__ import annotations

import io
import math
import re
import struct
import zlib
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from gaitgraph import __version__
from gaitgraph.errors import InputError, shown
from gaitgraph.files import MOST_BYTES
from gaitgraph.gait.table import ACCELERATIONS, ANGLES, RATES, about_from_text, merged, provenance_text
from gaitgraph.io.columns import LONGEST_TEXT, Column, check_names, numbers_or_texts, opened, pieces_of_columns

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence
    from pathlib import Path

    from gaitgraph.gait.table import Table
    from gaitgraph.io.columns import Array, Progress, RawPiece

__all__ = ["GAIT", "is_matlab_name", "pieces_of_mat", "write_mat"]

GAIT = "gait"
"""The struct."""

PROVENANCE = "provenance"
"""Its field that tells what made it."""

_ALLOWED = "allowed is a MAT-file of level 5, as save -v7 or save -v6 write it"
_TOLD = ("names", "units", PROVENANCE)
"""Fields of the struct that are no columns."""

_GROUPS = {"alpha": ANGLES, "alpha_rate": RATES, "alpha_acceleration": ACCELERATIONS}
"""Matrices with one column for each rotor."""

_NAME = re.compile(r"[A-Za-z]\w{0,62}", re.ASCII)
_KEYWORDS = frozenset(
    {"break", "case", "catch", "classdef", "continue", "else", "elseif", "end", "for", "function", "global", "if"}
    | {"otherwise", "parfor", "persistent", "return", "spmd", "switch", "try", "while"}
)
_HEADER, _TEXT_OF_HEADER = 128, 116
_HDF5 = b"\x89HDF\r\n\x1a\n"
_HEAD = 4096  # what precedes the values of a variable fits in it
_BLOCK = 1 << 16
_SHORT = 1 << 24  # bytes of a compressed variable that is inflated whole
_MOST_VARIABLES = 1000
_MOST_DIMENSIONS = 32
_LONGEST_PROVENANCE = 1 << 24
_MOST_OF_ONE = 1 << 32
_MOST_TOLD = 4
_MATRIX, _COMPRESSED = 14, 15
_INT32, _UINT32, _INT8 = 5, 6, 1
_DTYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_CODECS = {1: "latin-1", 2: "latin-1", 4: "utf-16", 16: "utf-8", 17: "utf-16", 18: "utf-32"}
_CELL, _STRUCT, _CHAR, _OPAQUE = 1, 2, 4, 17
_CLASSES = {_CELL: "a cell array", _STRUCT: "a struct", 3: "an object", 5: "a sparse matrix", 16: "a function"}
_CLASSES |= {_OPAQUE: "an object"}
_NUMERIC = range(6, 16)
_COMPLEX, _LOGICAL = 0x0800, 0x0200


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
    check_names(table.columns, [GAIT, *_GROUPS, *_TOLD], ".mat")
    for name in table.columns:
        if not is_matlab_name(name):
            raise InputError(f"column {shown(name)}: allowed in a .mat file are letters, digits and _, and no keyword")
    columns = {name: _plain(values) for name, values in table.columns.items()}
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
        raise InputError(f"{len(table)} rows: too many for a .mat file ({error}); .parquet is allowed") from error
    with path.open("r+b") as stream:  # scipy tells the time and the system there
        stream.write(f"MATLAB 5.0 MAT-file, written by gaitgraph {__version__}".ljust(_TEXT_OF_HEADER).encode())


def _plain(values: Any) -> Array:
    return values if isinstance(values, np.ndarray) else np.array(list(values))


class _Stream(Protocol):
    def seek(self, place: int, /) -> object: ...

    def read(self, count: int, /) -> bytes: ...


@dataclass(frozen=True, slots=True, kw_only=True)
class _Element:
    """What a tag announces: its type, and where its bytes are, in a file or in what is inflated from it."""

    stream: _Stream
    order: str
    kind: int
    start: int
    stop: int
    after: int

    def content(self, longest: int) -> bytes:
        """Return its bytes."""
        if self.stop - self.start > longest:
            raise _broken(f"a part of {self.stop - self.start} bytes where {longest} would do")
        return _read(self.stream, self.start, self.stop - self.start)

    def whole_numbers(self, kind: int, most: int) -> list[int]:
        """Return its bytes as whole numbers of four bytes."""
        content = self.content(4 * most)
        if self.kind != kind or len(content) % 4:
            raise _broken("a part of another kind than belongs there")
        return list(struct.unpack(f"{self.order}{len(content) // 4}{'i' if kind == _INT32 else 'I'}", content))

    def inner(self, start: int) -> _Element:
        """Return the element within this one that begins somewhere."""
        return _element(self.stream, self.order, start, self.stop)

    def anew(self) -> _Element:
        """Return the same element for somebody else who reads it forwards."""
        return replace(self, stream=self.stream.anew()) if isinstance(self.stream, _Inflated) else self


@dataclass(frozen=True, slots=True, kw_only=True)
class _Matrix:
    """A variable or a field: name, class, size, the element that holds it, where its values begin.

    Of a compressed one `whole` has only the first bytes inflated, and `packed` is the element in the file.
    """

    name: str
    kind: int
    flags: int
    shape: tuple[int, ...]
    whole: _Element
    body: int
    packed: _Element | None = None

    @property
    def is_vector(self) -> bool:
        """Whether its values stand in a row or a column."""
        return len(self.shape) == 2 and 1 in self.shape

    @property
    def is_numeric(self) -> bool:
        """Whether it holds real numbers."""
        return self.kind in _NUMERIC and not self.flags & (_COMPLEX | _LOGICAL)


def _broken(why: str) -> InputError:
    return InputError(f"it is broken ({why}); {_ALLOWED}")


def _read(stream: _Stream, start: int, count: int) -> bytes:
    stream.seek(start)
    content = stream.read(count)
    if len(content) < count:
        raise _broken("it ends early")
    return content


def _element(stream: _Stream, order: str, start: int, end: int) -> _Element:
    """Return the element whose tag begins somewhere, within what ends somewhere."""
    if start + 8 > end:
        raise _broken("a part ends early")
    kind, size = struct.unpack(f"{order}II", _read(stream, start, 8))
    if kind >> 16:  # up to four bytes stand in the tag itself
        kind, size, first, after = kind & 0xFFFF, kind >> 16, start + 4, start + 8
        end = after
    else:
        first = start + 8
        after = first + size + (0 if kind == _COMPRESSED else -size % 8)
    if first + size > end:
        raise _broken("a part claims more bytes than there are")
    return _Element(stream=stream, order=order, kind=kind, start=first, stop=first + size, after=min(after, end))


def _matrix(whole: _Element) -> _Matrix:
    """Return what a matrix is called and what it is; its values are not looked at."""
    if whole.kind != _MATRIX:
        raise _broken("a part that is no array where one belongs")
    if whole.start == whole.stop:  # an empty one
        return _Matrix(name="", kind=_NUMERIC[0], flags=0, shape=(0, 0), whole=whole, body=whole.stop)
    first = whole.inner(whole.start)
    flags = first.whole_numbers(_UINT32, 2)
    if not flags:
        raise _broken("an array without flags")
    kind, second = flags[0] & 0xFF, whole.inner(first.after)
    shape: tuple[int, ...] = ()
    if kind != _OPAQUE:
        shape = tuple(second.whole_numbers(_INT32, _MOST_DIMENSIONS))
        if len(shape) < 2 or min(shape) < 0:
            raise _broken("an array without a size")
        second = whole.inner(second.after)
    name = second.content(_HEAD).decode("latin-1")
    return _Matrix(name=name, kind=kind, flags=flags[0], shape=shape, whole=whole, body=second.after)


def _fields(matrix: _Matrix) -> list[_Matrix]:
    """Return the fields of a struct, one level deep."""
    if math.prod(matrix.shape) != 1:
        raise InputError(f"{matrix.name}: it is an array of structs; allowed is one struct")
    whole = matrix.whole
    width = whole.inner(matrix.body)
    length = (width.whole_numbers(_INT32, 1) or [0])[0]
    listed = whole.inner(width.after)
    names = listed.content(_MOST_VARIABLES * LONGEST_TEXT)
    if not 0 < length <= LONGEST_TEXT or len(names) % length:
        raise _broken("a struct without names of fields")
    found, place = [], listed.after
    for start in range(0, len(names), length):
        inner = whole.inner(place)
        name = names[start : start + length].partition(b"\0")[0].decode("latin-1")
        found.append(replace(_matrix(inner), name=name))
        place = inner.after
    return found


def pieces_of_mat(path: Path, progress: Progress) -> Iterator[RawPiece]:
    """Yield the columns of a MATLAB file, some rows at a time: of its variables, or else of the fields of a struct."""
    with opened(path, _ALLOWED) as (stream, size):
        order = _byte_order(stream.read(1024))
        variables = list(_variables(stream, order, size))
        structs = [one for one in variables if one.kind == _STRUCT]
        plain = [one for one in variables if one.kind != _STRUCT]
        chosen = [one for one in structs if one.name == GAIT] or structs
        if len(chosen) > 1 and not any(one.is_numeric and math.prod(one.shape) > 1 for one in plain):
            told = ", ".join(shown(one.name) for one in chosen[:_MOST_TOLD]) + (
                ", …" if len(chosen) > _MOST_TOLD else ""
            )
            raise InputError(f"it has {len(chosen)} structs, {told}; allowed is one, or one called {GAIT!r} among them")
        fields = _fields(_unpacked(chosen[0], max(MOST_BYTES, size))) if len(chosen) == 1 else []
        about = next((_told(one) for one in (*fields, *plain) if one.name == PROVENANCE), {})
        used = fields if fields and (not plain or (_has_angles(fields) and not _has_angles(plain))) else plain
        columns = [column for one in used for column in _columns(one, used)]
        yield from pieces_of_columns(columns, about, size, progress)


def _byte_order(head: bytes) -> str:
    """Return the byte order of a MATLAB file, by its first bytes."""
    if head.startswith(b"MATLAB 7.3") or _HDF5 in head:
        raise InputError(f"it is a MAT-file of version 7.3 (HDF5); {_ALLOWED}")
    order = {b"IM": "<", b"MI": ">"}.get(head[_HEADER - 2 : _HEADER])
    if order is None or struct.unpack(f"{order}H", head[_HEADER - 4 : _HEADER - 2]) != (0x0100,):
        raise InputError(f"it is no MAT-file of level 5; {_ALLOWED}")
    return order


def _variables(stream: _Stream, order: str, size: int) -> Iterator[_Matrix]:
    """Yield the variables of a file; of a compressed one no more is inflated than what precedes its values."""
    place = _HEADER
    for _ in range(_MOST_VARIABLES):
        if place >= size:
            return
        element = _element(stream, order, place, size)
        yield _matrix_in(element, _head_of(element)) if element.kind == _COMPRESSED else _matrix(element)
        place = element.after
    raise InputError(f"it has more than {_MOST_VARIABLES} variables; {_ALLOWED}")


def _head_of(packed: _Element) -> _Stream:
    """Return the first bytes of a compressed element, which may be all that are looked at."""
    return io.BytesIO(_Inflated(packed).read(_HEAD))


def _matrix_in(packed: _Element, stream: _Stream) -> _Matrix:
    """Return the matrix in a compressed element, of which at least the first bytes are in a stream."""
    stream.seek(0)
    head = stream.read(8)
    if len(head) < 8:
        raise _broken("a compressed part ends early")
    kind, size = struct.unpack(f"{packed.order}II", head)
    whole = _Element(stream=stream, order=packed.order, kind=kind, start=8, stop=8 + size, after=8 + size)
    return replace(_matrix(whole), packed=packed)


def _unpacked(matrix: _Matrix, most: int) -> _Matrix:
    """Return a matrix all of whose bytes can be read: a short one is inflated whole, a long one on the way."""
    if matrix.packed is None:
        return replace(matrix, whole=matrix.whole.anew())
    if matrix.whole.stop > most:
        raise InputError(f"{shown(matrix.name)} takes {matrix.whole.stop} bytes; allowed are {most} if compressed")
    stream: _Stream = _Inflated(matrix.packed)
    if matrix.whole.stop <= _SHORT:
        stream = io.BytesIO(stream.read(_SHORT))
    return replace(_matrix_in(matrix.packed, stream), packed=None)


class _Inflated:
    """The bytes of a compressed element, inflated on the way: forwards, for whoever goes back begins anew."""

    def __init__(self, packed: _Element) -> None:
        self._packed = packed
        self._place = 0
        self._begin()

    def _begin(self) -> None:
        self._inflater = zlib.decompressobj()
        self._taken = self._packed.start
        self._held, self._before = bytearray(), 0  # what is inflated and not yet forgotten, and how much was before it

    def anew(self) -> _Inflated:
        """Return the same bytes from the first one on."""
        return _Inflated(self._packed)

    def seek(self, place: int, /) -> object:
        """Go to a place, counted from the first byte."""
        self._place = place
        return place

    def read(self, count: int, /) -> bytes:
        """Return the next bytes; fewer if there are no more."""
        if self._place < self._before:
            self._begin()
        # A byte more than asked for: the checksum is only looked at behind the last one.
        while self._before + len(self._held) <= self._place + count and (block := self._next()):
            self._held += block
            over = min(self._place - self._before, len(self._held)) - _HEAD
            if over > 0:
                del self._held[:over]
                self._before += over
        start = self._place - self._before
        content = bytes(self._held[start : start + count])
        self._place += len(content)
        return content

    def _next(self) -> bytes:
        while not self._inflater.eof:
            block = self._inflater.unconsumed_tail
            if not block:
                block = _read(self._packed.stream, self._taken, min(_BLOCK, self._packed.stop - self._taken))
                self._taken += len(block)
            try:
                fresh = self._inflater.decompress(block, _BLOCK)
            except zlib.error as error:
                raise _broken(str(error)) from error
            if fresh or not block:
                return fresh
        return b""


def _has_angles(matrices: Sequence[_Matrix]) -> bool:
    names = {one.name for one in matrices}
    return bool(names & {"alpha", "alpha1", "alpha1_deg"})


def _columns(matrix: _Matrix, beside: Sequence[_Matrix]) -> Iterator[Column]:
    """Yield the columns that a variable or a field is, or why it is none."""
    group = _GROUPS.get(matrix.name)
    if group and not {one.name for one in beside} & set(group):
        if not matrix.is_numeric or len(matrix.shape) != 2 or matrix.shape[1] != len(group):
            why = f"{matrix.name} is {_described(matrix)}; allowed is a matrix of 4 columns"
            yield from (Column(name=name, why=why) for name in group)
            return
        for k, name in enumerate(group):
            yield _numbers(matrix, name, k)
    elif matrix.kind == _CHAR and len(matrix.shape) == 2:
        yield _texts(matrix)
    elif matrix.is_numeric and matrix.is_vector:
        yield _numbers(matrix, matrix.name, 0)
    elif matrix.name not in _OURS:
        yield Column(name=matrix.name, why=f"it is {_described(matrix)}; allowed is a column of real numbers")


_OURS = {*_GROUPS, *_TOLD}


def _described(matrix: _Matrix) -> str:
    """Return what a matrix is, in words."""
    size = " by ".join(map(str, matrix.shape[:_MOST_TOLD]))
    if matrix.kind in _CLASSES:
        return _CLASSES[matrix.kind]
    return f"{'' if matrix.is_numeric or matrix.kind == _CHAR else 'complex or logical, '}{size}"


def _numbers(matrix: _Matrix, name: str, column: int) -> Column:
    """Return one column of a matrix; a vector has one, whichever way it stands."""
    rows = math.prod(matrix.shape) if matrix.is_vector else matrix.shape[0]
    held: list[tuple[_Element, np.dtype[Any]]] = []

    def values(start: int, count: int) -> Array:
        if not held:
            held.append(_values_of(_unpacked(matrix, _MOST_OF_ONE)))
        element, dtype = held[0]
        place = element.start + (column * rows + start) * dtype.itemsize
        content = _read(element.stream, place, count * dtype.itemsize)
        return numbers_or_texts(np.frombuffer(content, dtype=dtype), name)

    return Column(name=name, rows=rows, size=rows * 8, values=values)


def _values_of(matrix: _Matrix) -> tuple[_Element, np.dtype[Any]]:
    """Return where the real numbers of a matrix are, and of what kind."""
    element = matrix.whole.inner(matrix.body)
    if element.kind not in _DTYPES:
        raise _broken(f"{shown(matrix.name)} has values of an unknown kind")
    dtype = np.dtype(f"{matrix.whole.order}{_DTYPES[element.kind]}")
    if element.stop - element.start != math.prod(matrix.shape) * dtype.itemsize:
        held = element.stop - element.start
        raise _broken(f"{shown(matrix.name)} claims {_described(matrix)}, and holds {held} bytes")
    return element, dtype


def _texts(matrix: _Matrix) -> Column:
    """Return the rows of a matrix of characters as texts."""
    rows, width = matrix.shape
    if width > LONGEST_TEXT:
        return Column(name=matrix.name, why=f"it is a text of {width} characters; allowed is {LONGEST_TEXT} at most")
    held: list[Array] = []

    def values(start: int, count: int) -> Array:
        if not held:
            codes = _codes_of(matrix, _MOST_OF_ONE).reshape(width, rows).T
            held.append(np.ascontiguousarray(codes).view(f"<U{width}").reshape(rows))
        return np.char.rstrip(held[0][start : start + count])

    if not width:
        return Column(name=matrix.name, why="it has no characters; allowed are texts")
    return Column(name=matrix.name, rows=rows, size=4 * rows * width, values=values, texts=True, single=rows == 1)


def _codes_of(matrix: _Matrix, most: int) -> Array:
    """Return the characters of a matrix as numbers, column after column."""
    matrix = _unpacked(matrix, most)
    element = matrix.whole.inner(matrix.body)
    codec = _CODECS.get(element.kind, "")
    if codec.startswith("utf-") and codec != "utf-8":
        codec += "-le" if matrix.whole.order == "<" else "-be"
    content = element.content(8 * math.prod(matrix.shape))
    try:
        codes = np.frombuffer(content.decode(codec).encode("utf-32-le"), dtype="<u4")
    except (LookupError, UnicodeError) as error:
        raise _broken(f"{shown(matrix.name)} has characters that cannot be read") from error
    if codes.size != math.prod(matrix.shape):
        raise _broken(f"{shown(matrix.name)} claims {_described(matrix)}, and holds {codes.size} characters")
    return codes


def _told(matrix: _Matrix) -> dict[str, Any]:
    """Return what made the file, if a text of ours tells it."""
    if matrix.kind != _CHAR or len(matrix.shape) != 2 or matrix.shape[0] != 1 or matrix.shape[1] > _LONGEST_PROVENANCE:
        return {}
    return about_from_text(_codes_of(matrix, 8 * _LONGEST_PROVENANCE).tobytes().decode("utf-32-le"))
