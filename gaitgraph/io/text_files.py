"""CSV and JSON files of gait tables.

The last column of a CSV file, `made_by`, states in the first row what made it, as one text of JSON: other readers of
CSV fail at comment lines.
"""

from __future__ import annotations

import csv
import json
import re
from io import StringIO
from itertools import chain, repeat
from typing import TYPE_CHECKING, Any, TextIO

import numpy as np

from gaitgraph.errors import InputError, shown, wrong
from gaitgraph.files import value_from_json
from gaitgraph.gait.table import (
    ANGLES,
    checked_about,
    provenance_of,
    provenance_text,
)
from gaitgraph.io.columns import MADE_BY, RawTable, named_columns, taken_about

if TYPE_CHECKING:
    from pathlib import Path

    from gaitgraph.gait.table import Table
    from gaitgraph.invertibility.forms import FloatArray

_AT_ONCE = 16_384  # rows, as objects of Python
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?|nan|inf", re.IGNORECASE)
_SHARED = ("vehicle", "coefficients", "period", "law")
"""Fields of a request that a saved plan states for its table."""


def read_csv(path: Path) -> RawTable:
    """Return the columns of a CSV file, and what made it."""
    with path.open(encoding="utf-8-sig") as stream:
        names, line = _names_of(stream)
        body = stream.read()
    numbers = _numbers_in(body)
    if numbers is not None and numbers.shape[1] == len(names):
        return RawTable(columns=named_columns(names, numbers.T))
    rows = _rows_of(body, len(names), line)
    if not rows:
        return RawTable(columns=named_columns(names, [()] * len(names)))
    columns = named_columns(names, zip(*rows, strict=True))
    return RawTable(columns=columns, about=taken_about(columns))


def _names_of(stream: TextIO) -> tuple[list[str], int]:
    """Return the names in the header of a CSV file, and the number of its line, which comments may precede."""
    line, head = 1, stream.readline()
    while head == "\n" or (head.startswith("#") and "alpha" not in head):
        line, head = line + 1, stream.readline()
    if not head:
        raise InputError("it is empty; it must have a header line and at least one row")
    try:  # numpy.savetxt begins a header with "# "
        fields = next(csv.reader([head.lstrip("# ")], strict=True))
    except csv.Error as error:
        raise _no_text(line, error) from error
    names = [name.strip() for name in fields]
    parts = names if "," in head else re.split(r"[\s;]+", head.strip())
    if all(map(_NUMBER.fullmatch, parts)):
        example = "t,alpha1,alpha2,alpha3,alpha4"
        raise InputError(
            f"line {line} must be a header that names the columns, such as {example}, got numbers"
        )
    if len(names) == 1 and re.search(r"[;\s]", head.strip("# \n")):
        raise InputError(
            "columns must be separated by commas, with points in numbers, got semicolons, tabs or blanks"
        )
    return names, line


def _numbers_in(body: str) -> FloatArray | None:
    """Return lines that hold finite numbers alone as rows of an array; None where they hold anything else."""
    if not body.isascii() or not body or body.isspace():
        return None
    try:
        numbers = np.loadtxt(StringIO(body), delimiter=",", comments=None, ndmin=2)
    except ValueError:
        return None
    return numbers if np.isfinite(numbers).all() else None


def _rows_of(body: str, count: int, line: int) -> list[list[str]]:
    """Return the fields of each line below the header, which is in a line; InputError unless each has the count."""
    reader = csv.reader(StringIO(body), strict=True)
    rows: list[list[str]] = []
    try:
        for row in filter(None, reader):
            if len(row) != count:
                raise wrong(
                    f"line {line + reader.line_num}",
                    f"must have {count} fields, as the header has",
                    len(row),
                    field="columns",
                    row=len(rows) + 1,
                )
            rows.append(row)
    except csv.Error as error:
        problem = _no_text(line + reader.line_num, error)
        problem.row = len(rows) + 1
        raise problem from error
    return rows


def _no_text(line: int, error: csv.Error) -> InputError:
    return InputError(f"line {line} must be comma-separated text: {error}")


def write_csv(table: Table, path: Path) -> None:
    """Write a new CSV file."""
    made_by = chain([provenance_text(table)], repeat(""))
    with path.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow([*table.columns, MADE_BY])
        for start in range(0, len(table), _AT_ONCE):
            columns = [_values(column, start) for column in table.columns.values()]
            writer.writerows(zip(*columns, made_by, strict=False))


def _values(column: Any, start: int) -> list[Any]:
    """Return some values of a column as numbers and texts of Python, from a row on."""
    some: list[Any] = np.asarray(column[start : start + _AT_ONCE]).tolist()
    return some


_JSON = "it must be an object of columns, a list of rows, or a plan"


def read_json(path: Path) -> RawTable:
    """Return the columns in a JSON file: of columns (beside or around them what made them), of rows, or of a plan."""
    content = value_from_json(path.read_text(encoding="utf-8-sig"), _JSON)
    if isinstance(content, list):
        return RawTable(columns=_columns_of_rows(content), angle_texts=True)
    if not isinstance(content, dict):
        raise InputError(f"{_JSON}, got {shown(content)}", value=content)
    if "path" in content:
        return _columns_of_plan(content)
    if "waypoints" in content and "columns" not in content:
        raise InputError("it holds a request, which is planned first")
    columns = content.get("columns", content)
    if not isinstance(columns, dict):
        raise wrong("columns", "must be an object of lists", columns)
    about = checked_about(content.get("about", {}))
    return RawTable(columns=columns, about=about, angle_texts=True)


def _columns_of_rows(rows: list[Any]) -> dict[str, Any]:
    columns: dict[str, Any] = {}
    for number, row in enumerate(rows, start=1):
        if number == 1 and isinstance(row, dict):
            columns = {name: [] for name in row}
        if not isinstance(row, dict) or row.keys() != columns.keys():
            rule = "must be an object with the fields of row 1"
            raise wrong(
                f"row {number}", rule, row, f"; {_JSON}", field="columns", row=number
            )
        for name, value in row.items():
            columns[name].append(value)
    return columns


def _columns_of_plan(content: dict[str, Any]) -> RawTable:
    """Return the columns of a plan, and what made it."""
    if content.get("status") == "infeasible":
        raise InputError(f"it holds a plan without a gait: {content.get('reason')}")
    path, colors = content["path"], content.get("colors", [])
    rows = path if isinstance(path, list) else []
    are_rows = [isinstance(row, list) and len(row) == 4 for row in rows]
    if not rows or not all(are_rows):
        raise wrong("path", "must be a list of [alpha1, alpha2, alpha3, alpha4]", path)
    if not isinstance(colors, list):
        raise wrong("colors", "must be a list of 'red' and 'blue'", colors)
    columns: dict[str, Any] = dict(zip(ANGLES, zip(*rows, strict=True), strict=True))
    if colors:
        columns["color"] = colors
    about: dict[str, Any] = {}
    request = content.get("request")
    if isinstance(request, dict):
        for name in _SHARED:
            if name in request:
                about[name] = request[name]
        if about:
            about["request"] = request
    if "crossing_tolerance" in content:
        about["crossing_tolerance"] = content["crossing_tolerance"]
    return RawTable(columns=columns, about=about, angle_texts=True)


def write_json(table: Table, path: Path) -> None:
    """Write a new JSON file: format, version, about, and the columns as lists, each on a line of its own."""
    with path.open("w", encoding="utf-8") as stream:
        stream.write("{\n")
        for name, value in provenance_of(table).items():
            text = json.dumps(value, allow_nan=False)
            stream.write(f"  {json.dumps(name)}: {text},\n")
        stream.write('  "columns": {')
        between = "\n"
        for name, values in table.columns.items():
            stream.write(f"{between}    {json.dumps(name)}: ")
            _write_list(values, stream)
            between = ",\n"
        stream.write("\n  }\n}\n")


def _write_list(values: Any, stream: TextIO) -> None:
    """Write the values of a column as a list of JSON, in pieces."""
    stream.write("[")
    for start in range(0, len(values), _AT_ONCE):
        text = json.dumps(_values(values, start), allow_nan=False)
        if start:
            stream.write(", ")
        stream.write(text[1:-1])  # without its brackets
    stream.write("]")
