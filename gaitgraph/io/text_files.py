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
from collections import Counter
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitgraph.errors import InputError, shown
from gaitgraph.files import blocks_of, decoded
from gaitgraph.gait.table import (
    ANGLES,
    DEGREES,
    FORMAT,
    Table,
    about_from_text,
    checked_about,
    merged,
    provenance_of,
    provenance_text,
)
from gaitgraph.io.columns import TableBuilder, table_from_columns
from gaitgraph.io.formats import check_names

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator
    from pathlib import Path

    from gaitgraph.io.servo_map import ServoMap


MADE_BY = "made_by"
"""The column of a CSV file that states what made it."""

_LONGEST_LINE = 1 << 22
_QUOTED_FIELD = re.compile(r'^"[^"\n]*"(?=,|$)|(?<=,)"[^"\n]*"(?=,|$)', re.MULTILINE)
_PRINTED_ROWS = 1000
_FEWEST_DECIMALS, _FULL_PRECISION = 3, 9


def pieces_of_csv(
    path: Path, progress: Callable[[float], None] | None, plane_only: bool, joints: ServoMap | None
) -> Iterator[Table]:
    """Yield the pieces of a CSV file, each with what made it and how finely its angles are printed."""
    names: list[str] = []
    builder: TableBuilder | None = None
    line = 0  # lines before these
    rounding: float | None = None
    for lines in _lines(path, progress):
        start = 0
        if not names:
            start = next((k for k, text in enumerate(lines) if text), len(lines))
            if start == len(lines):
                line += start
                continue
            names = _names_of(lines[start], line + start + 1)
            start += 1
        about = _provenance_taken_out(lines, start, names)
        builder = builder or TableBuilder(names, about, plane_only=plane_only, joints=joints)
        rows = lines[start:]
        raw = _numeric_columns(rows, builder) or _text_columns(rows, builder, line + start)
        if rounding is None and len(raw[0]):
            rounding = _rounding_of(rows[:_PRINTED_ROWS], builder)
        line += len(lines)
        yield from builder.pieces(raw, rounding=rounding or 0.0)
    if builder is None:
        raise InputError("it is empty; allowed is a header line and at least one row")
    builder.check_rows()


def _lines(path: Path, progress: Callable[[float], None] | None) -> Iterator[list[str]]:
    """Yield the lines of a file in groups, whatever its size; a byte-order mark and any kind of line end are read."""
    rest = b""
    for block, fraction in blocks_of(path, "gait file", "a gait table"):
        content = rest + block
        # A carriage return at the end may be half of a line end.
        end = max(content.rfind(b"\n"), content.rfind(b"\r", 0, len(content) - 1)) + 1
        if not end and len(content) > _LONGEST_LINE:
            raise InputError(f"a line is longer than {_LONGEST_LINE} bytes; allowed are a header line and rows")
        content, rest = content[:end], content[end:]
        if progress is not None:
            progress(fraction)
        if content:
            yield _split(content, path)
    if rest:
        yield _split(rest, path)


def _split(content: bytes, path: Path) -> list[str]:
    text = decoded(content, path, "gait file", "a gait table as text")
    if "\r" in text:
        text = text.replace("\r\n", "\n").replace("\r", "\n")
    return text.removesuffix("\n").split("\n")


def _names_of(text: str, line: int) -> list[str]:
    """Return the names in the header line."""
    try:
        names = [name.strip() for name in next(csv.reader([text], strict=True))]
    except csv.Error as error:
        raise InputError(f"line {line}: {error}; allowed is comma-separated text") from error
    for mark, what in ((";", "semicolons"), ("\t", "tabs")):
        if len(names) == 1 and mark in text:
            raise InputError(f"columns are separated by {what}; allowed are commas, and points in numbers")
    return names


def _provenance_taken_out(lines: list[str], start: int, names: list[str]) -> dict[str, Any]:
    """Take what made the file out of the first and the last of these lines, and return it; empty if it is not stated.

    Then all rows are alike, and the first and the last are read as fast as the others.
    """
    about: dict[str, Any] = {}
    for k in {start, len(lines) - 1} if MADE_BY in names else ():
        if not start <= k < len(lines) or FORMAT not in lines[k]:
            continue
        try:
            fields = next(csv.reader([lines[k]], strict=True), [])
        except csv.Error:
            continue  # reading the line as a row says what is wrong
        column = names.index(MADE_BY)
        if len(fields) == len(names) and FORMAT in fields[column]:
            about = about_from_text(fields[column])
            fields[column] = ""
            lines[k] = ",".join(f'"{text}"' if "," in text else text for text in fields)
    return about


def _numeric_columns(lines: list[str], builder: TableBuilder) -> list[Any] | None:
    """Return the columns of lines as numpy reads them, or None if anything about the lines is unusual."""
    text = "\n".join(lines)
    if not text.strip("\n"):
        return [[] for _ in builder.names]
    if not text.isascii() or "_" in text:
        return None
    if '"' in text and '"' in _QUOTED_FIELD.sub("", text):
        return None  # numpy's reader takes quotation marks that csv refuses
    try:
        rows = np.loadtxt(lines, dtype=builder.dtype, delimiter=",", comments=None, quotechar='"', ndmin=1)
    except (ValueError, IndexError, OverflowError):
        return None
    columns = [rows[name] for name in rows.dtype.names or ()]
    finite = all(np.isfinite(column).all() for column in columns if column.dtype.kind == "f")
    return columns if finite else None


def _text_columns(lines: list[str], builder: TableBuilder, offset: int) -> list[list[str]]:
    """Return the columns of lines as texts, or raise InputError with the number of the line that is wrong."""
    wanted = len(builder.names)
    reader = csv.reader(lines, strict=True)
    rows = []
    try:
        for row in reader:
            if row and len(row) != wanted:
                line = offset + reader.line_num
                raise InputError(f"line {line} has {len(row)} fields; allowed are {wanted}, as in the header")
            if row:
                rows.append(row)
    except csv.Error as error:
        raise InputError(f"line {offset + reader.line_num}: {error}; allowed is comma-separated text") from error
    return [list(column) for column in zip(*rows, strict=True)] or [[] for _ in builder.names]


def _rounding_of(lines: list[str], builder: TableBuilder) -> float:
    """Return half a unit of the last decimal of the angles in lines [rad], if they have three to eight, else 0.

    Angles with fewer decimals are exact: people type 0.4. Angles with more carry all that floating point does.
    """
    decimals, unit = 0, 1.0
    for row in csv.reader(lines):
        for name, text in zip(builder.names, row, strict=False):
            if name in (builder.radians_per_unit if builder.joints else (*ANGLES, *DEGREES)):
                unit = builder.radians_per_unit.get(name, math.radians(1.0) if name in DEGREES else 1.0)
                printed = len(text.strip().partition(".")[2]) if "e" not in text.lower() else _FULL_PRECISION
                decimals = max(decimals, printed)
    return 0.5 * unit * 10.0**-decimals if _FEWEST_DECIMALS <= decimals < _FULL_PRECISION else 0.0


def write_csv(pieces: Iterable[Table], path: Path) -> None:
    """Write a new CSV file, piece by piece; InputError if a column of joints is named `made_by`."""

    def rows() -> Iterator[Iterable[Any]]:
        stated = mark = ""
        before: tuple[Any, ...] | None = None  # a row is written when the next has come: the last one has a mark too
        for piece in pieces:
            if before is None:
                check_names(piece.columns, [MADE_BY], ".csv")
                stated = mark = provenance_text(piece)
                yield (*piece.columns, MADE_BY)
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


def table_of_json(text: str, plane_only: bool, joints: ServoMap | None) -> Table:
    """Return the table in a JSON text: of columns (beside or around them what made them), of rows, or of a plan.

    >>> table_of_json('[{"alpha1": "pi/4", "alpha2": 0, "color": "red"}]', False, None).columns["alpha1"].round(4)
    array([0.7854])
    """
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
    if isinstance(content, list):
        if not all(isinstance(row, dict) for row in content):
            raise InputError(f"a list whose entries are not all objects; {_JSON}")
        if not content:
            raise InputError(f"it has no rows; {_JSON}")
        for number, row in enumerate(content, start=1):
            if row.keys() != content[0].keys():
                raise InputError(f"row {number} has other fields than row 1; {_JSON}")
        raw = [(name, [row[name] for row in content]) for name in content[0]]
        return table_from_columns(raw, plane_only=plane_only, joints=joints)
    if not isinstance(content, dict):
        raise InputError(f"it holds {shown(content)}; {_JSON}")
    if "path" in content:
        return _table_of_plan(content)
    columns = content.get("columns", content)
    if not isinstance(columns, dict):
        raise InputError(f"'columns' is no object; {_JSON}")
    about = checked_about(content.get("about", {}))
    lists = {name: values for name, values in columns.items() if isinstance(values, list)}
    if isinstance(columns.get("color"), str) and lists:
        lists["color"] = [columns["color"]] * len(next(iter(lists.values())))
    return table_from_columns(list(lists.items()), about, plane_only=plane_only, joints=joints)


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return a JSON object, or raise InputError if a name appears twice in it."""
    content = dict(pairs)
    if len(content) < len(pairs):
        name = next(name for name, count in Counter(name for name, _ in pairs).items() if count > 1)
        raise InputError(f"{shown(name)} appears twice; allowed is once")
    return content


def _refused_constant(name: str) -> None:
    raise ValueError(f"{name} is no number of JSON")


def _table_of_plan(content: dict[str, Any]) -> Table:
    if content.get("status") == "infeasible":
        raise InputError(f"it holds a plan without a gait: {content.get('reason')}")
    path, colors = content["path"], content.get("colors", [])
    if not (isinstance(path, list) and path and all(isinstance(row, list) and len(row) == 4 for row in path)):
        raise InputError(f"path: {shown(path)}; allowed is a list of [alpha1, alpha2, alpha3, alpha4]")
    if not isinstance(colors, list):
        raise InputError(f"colors: {shown(colors)}; allowed is a list of 'red' and 'blue'")
    columns: list[tuple[str, Any]] = [(name, [row[k] for row in path]) for k, name in enumerate(ANGLES)]
    if colors:
        columns.append(("color", colors))
    request = content.get("request")
    keys = ("vehicle", "coefficients", "period", "law")
    about = {key: request[key] for key in keys if key in request} if isinstance(request, dict) else {}
    if about:
        about["request"] = request
    if "crossing_tolerance" in content:
        about["crossing_tolerance"] = content["crossing_tolerance"]
    return table_from_columns(columns, about)


def write_json(pieces: Iterable[Table], path: Path) -> None:
    """Write a new JSON file: format, version, about, and the columns as lists."""
    table = merged(pieces)
    plain = {name: one.tolist() if isinstance(one, np.ndarray) else one for name, one in table.columns.items()}
    heads, columns = (
        [f"{indent}{json.dumps(name)}: {json.dumps(value, allow_nan=False)}" for name, value in content.items()]
        for indent, content in (("  ", provenance_of(table)), ("    ", plain))
    )
    heads.append('  "columns": {\n' + ",\n".join(columns) + "\n  }")
    path.write_text("{\n" + ",\n".join(heads) + "\n}\n", encoding="utf-8")
