"""CSV and JSON files of gait tables.

A CSV file is read in pieces, fast where nothing is unusual, and written row by row. It has one more column than the
table, `made_by`: what made it, in the first row and in the last, which is the first again. Other readers of CSV would
stumble over a comment line.
"""

from __future__ import annotations

import csv
import json
import math
import re
from io import TextIOWrapper
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitgraph.errors import InputError, shown
from gaitgraph.files import reading, text_of
from gaitgraph.gait.table import (
    ANGLES,
    DEGREES,
    FORMAT,
    TEXTS,
    Table,
    about_from_text,
    checked_about,
    merged,
    provenance_of,
    provenance_text,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path

    from gaitgraph.io.columns import FormatOptions, Progress, TableBuilder

_WHAT = "gait file"
_MADE_BY = "made_by"
_BLOCK = 1 << 22
_QUOTED_FIELD = re.compile(r'^"[^"\n]*"(?=,|$)|(?<=,)"[^"\n]*"(?=,|$)', re.MULTILINE)
_PRINTED_ROWS = 1000
_FEWEST_DECIMALS, _FULL_PRECISION = 3, 9


def read_csv(path: Path, builder: TableBuilder, progress: Progress) -> Iterator[Table]:
    """Yield the pieces of a CSV file, each with what made it and how finely its angles are printed.

    A byte-order mark and any kind of line end are read.
    """
    with reading(path, _WHAT, "a gait table as text"), path.open("rb") as raw:
        stream, size = TextIOWrapper(raw, encoding="utf-8-sig"), path.stat().st_size
        read, head = 1, stream.readline()  # lines until now
        while head == "\n":
            read, head = read + 1, stream.readline()
        if not head:
            raise InputError("it is empty; allowed is a header line and at least one row")
        try:
            names = [name.strip() for name in next(csv.reader([head], strict=True))]
        except csv.Error as error:
            raise InputError(f"line {read}: {error}; allowed is comma-separated text") from error
        if len(names) == 1 and re.search(r"[;\t]", head):
            raise InputError("columns are separated by semicolons or tabs; allowed are commas, and points in numbers")
        lines = stream.readlines(_BLOCK)
        builder.begin(names, _provenance_taken_out(lines, names))
        digit_error: float | None = None
        while lines:
            columns = _numeric_columns(lines, names, builder) or _text_columns(lines, names, read)
            if digit_error is None and len(columns[names[0]]):
                digit_error = _digit_error_of(lines[:_PRINTED_ROWS], names, builder)
            if progress is not None and size:  # that of a pipe is 0
                progress(raw.tell() / size)
            yield from builder.pieces(columns, digit_error=digit_error or 0.0)
            read += len(lines)
            lines = stream.readlines(_BLOCK)
            _provenance_taken_out(lines, names)


def _provenance_taken_out(lines: list[str], names: list[str]) -> dict[str, Any]:
    """Take what made the file out of the first and the last of these lines, and return it; empty if it is not stated.

    Then all rows are alike, and the first and the last are read as fast as the others.
    """
    about: dict[str, Any] = {}
    for k in {0, len(lines) - 1} if lines and _MADE_BY in names else ():
        try:
            fields = next(csv.reader([lines[k]], strict=True), []) if FORMAT in lines[k] else []
        except csv.Error:
            continue  # reading the line as a row says what is wrong
        column = names.index(_MADE_BY)
        if len(fields) == len(names) and FORMAT in fields[column]:
            about = about_from_text(fields[column])
            fields[column] = ""
            lines[k] = ",".join(f'"{text}"' if "," in text else text for text in fields) + "\n"
    return about


def _numeric_columns(lines: list[str], names: list[str], builder: TableBuilder) -> dict[str, Any] | None:
    """Return the columns of lines as numpy reads them, or None if anything about the lines is unusual."""
    text = "".join(lines)
    if not text.isascii() or "_" in text or not text.strip("\n"):
        return None
    if max(map(len, lines)) > csv.field_size_limit():
        return None  # csv refuses longer fields, and numpy's reader does not
    if '"' in text and '"' in _QUOTED_FIELD.sub("", text):
        return None  # numpy's reader takes quotation marks that csv refuses
    # A column that is ignored is read as one character.
    kinds = ["U8" if name in TEXTS else "f8" if builder.uses(name) else "U1" for name in names]
    dtype = [(f"f{k}", kind) for k, kind in enumerate(kinds)]
    try:
        rows = np.loadtxt(lines, dtype, delimiter=",", comments=None, quotechar='"', ndmin=1)
    except (ValueError, IndexError, OverflowError):
        return None
    columns = {name: rows[f"f{k}"] for k, name in enumerate(names)}
    finite = all(np.isfinite(column).all() for column in columns.values() if column.dtype.kind == "f")
    return columns if finite else None


def _text_columns(lines: list[str], names: list[str], offset: int) -> dict[str, Any]:
    """Return the columns of lines as texts, or raise InputError with the number of the line that is wrong."""
    reader = csv.reader(lines, strict=True)
    rows = []
    try:
        for row in filter(None, reader):
            if len(row) != len(names):
                line = offset + reader.line_num
                raise InputError(f"line {line} has {len(row)} fields; allowed are {len(names)}, as in the header")
            rows.append(row)
    except csv.Error as error:
        raise InputError(f"line {offset + reader.line_num}: {error}; allowed is comma-separated text") from error
    return {name: [row[k] for row in rows] for k, name in enumerate(names)}


def _digit_error_of(lines: list[str], names: list[str], builder: TableBuilder) -> float:
    """Return half a unit of the last decimal of the angles in lines [rad], if they have three to eight, else 0.

    Angles with fewer decimals are exact: people type 0.4. Angles with more carry all that floating point does.
    """
    units = dict.fromkeys(ANGLES, 1.0) | dict.fromkeys(DEGREES, math.radians(1.0))
    if builder.joints is not None:
        units = {joint.column: 1.0 / joint.per_radian for joint in builder.joints.joints}
    decimals = dict.fromkeys(units.values(), 0)  # the most of each unit: columns of one are printed alike
    for row in csv.reader(lines):
        for name, text in zip(names, row, strict=False):
            if name in units:
                printed = len(text.strip().partition(".")[2]) if "e" not in text.lower() else _FULL_PRECISION
                decimals[units[name]] = max(decimals[units[name]], printed)
    coarse = [0.5 * unit * 10.0**-most for unit, most in decimals.items() if most >= _FEWEST_DECIMALS]
    return max(coarse, default=0.0) if max(decimals.values()) < _FULL_PRECISION else 0.0


def write_csv(pieces: Iterable[Table], path: Path, options: FormatOptions) -> None:
    """Write a new CSV file, piece by piece."""

    def rows() -> Iterator[Iterable[Any]]:
        stated = mark = ""
        before: tuple[Any, ...] | None = None  # a row is written when the next has come: the last one has a mark too
        for piece in pieces:
            if before is None:
                stated = mark = provenance_text(piece)
                yield (*piece.columns, _MADE_BY)
            columns = (one.tolist() if isinstance(one, np.ndarray) else one for one in piece.columns.values())
            for row in zip(*columns, strict=True):
                if before is not None:
                    yield (*before, mark)
                    mark = ""
                before = row
        if before is not None:
            yield (*before, stated)

    with path.open("w", encoding="utf-8", newline="") as stream:
        csv.writer(stream, lineterminator="\n").writerows(rows())


_JSON = "allowed is an object of columns, a list of rows, or a plan"
_MOST_BRACKETS = 5_000_000


def read_json(path: Path, builder: TableBuilder, progress: Progress) -> Iterator[Table]:
    """Yield the table in a JSON file: of columns (beside or around them what made them), of rows, or of a plan."""
    text = text_of(path, _WHAT, "a gait table as text")
    if text.count("[") + text.count("{") > _MOST_BRACKETS:  # they take twenty times the memory of the text, and more
        raise InputError(f"it has more than {_MOST_BRACKETS} lists and objects; {_JSON}")
    try:
        content = json.loads(text, parse_constant=_refused_constant, object_pairs_hook=_object)
    except RecursionError as error:
        raise InputError("it is nested too deeply; allowed is a gait table") from error
    except InputError:
        raise
    except ValueError as error:
        raise InputError(f"it is not JSON ({str(error).splitlines()[0]}); {_JSON}") from error
    about: dict[str, Any] = {}
    if isinstance(content, list):
        for number, row in enumerate(content, start=1):
            if not isinstance(row, dict) or row.keys() != content[0].keys():
                raise InputError(f"row {number} must be an object with the fields of row 1, got {shown(row)}; {_JSON}")
        columns = {name: [row[name] for row in content] for name in content[0]} if content else {}
    elif not isinstance(content, dict):
        raise InputError(f"it holds {shown(content)}; {_JSON}")
    elif "path" in content:
        columns, about = _columns_of_plan(content)
    else:
        columns, about = content.get("columns", content), checked_about(content.get("about", {}))
        if not isinstance(columns, dict):
            raise InputError(f"'columns' is no object; {_JSON}")
    yield from builder.whole(columns, about)


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return a JSON object, or raise InputError if a name appears twice in it."""
    content: dict[str, Any] = {}
    for name, value in pairs:
        if name in content:
            raise InputError(f"{shown(name)} appears twice; allowed is once")
        content[name] = value
    return content


def _refused_constant(name: str) -> None:
    raise ValueError(f"{name} is no number of JSON")


def _columns_of_plan(content: dict[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the columns of a plan, and what made it."""
    if content.get("status") == "infeasible":
        raise InputError(f"it holds a plan without a gait: {content.get('reason')}")
    path, colors = content["path"], content.get("colors", [])
    if not (isinstance(path, list) and path and all(isinstance(row, list) and len(row) == 4 for row in path)):
        raise InputError(f"path must be a list of [alpha1, alpha2, alpha3, alpha4], got {shown(path)}")
    if not isinstance(colors, list):
        raise InputError(f"colors must be a list of 'red' and 'blue', got {shown(colors)}")
    columns = {name: [row[k] for row in path] for k, name in enumerate(ANGLES)} | ({"color": colors} if colors else {})
    request = content.get("request")
    keys = ("vehicle", "coefficients", "period", "law")
    about = {key: request[key] for key in keys if key in request} if isinstance(request, dict) else {}
    about |= {"request": request} if about else {}
    about |= {key: content[key] for key in ("crossing_tolerance",) if key in content}
    return columns, about


def write_json(pieces: Iterable[Table], path: Path, options: FormatOptions) -> None:
    """Write a new JSON file: format, version, about, and the columns as lists."""
    table = merged(pieces)
    plain = {name: one.tolist() if isinstance(one, np.ndarray) else one for name, one in table.columns.items()}
    heads, columns = (
        [f"{indent}{json.dumps(name)}: {json.dumps(value, allow_nan=False)}" for name, value in content.items()]
        for indent, content in (("  ", provenance_of(table)), ("    ", plain))
    )
    heads.append('  "columns": {\n' + ",\n".join(columns) + "\n  }")
    path.write_text("{\n" + ",\n".join(heads) + "\n}\n", encoding="utf-8")
