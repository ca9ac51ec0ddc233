"""CSV and JSON files of gait tables.

A CSV file is read in pieces, and fast where nothing is unusual. Its last column `made_by` states in the first rows
what made it, since other readers of CSV fail at comment lines: one short text a row, a name and a value as in TOML,
such as ``law = "smooth"``. Parts of a long value have own texts, such as ``corners.2 = [0.4, -0.4, 0.4, -0.4]``. With
few rows a field holds several texts. What such texts do not state exactly is one text of JSON.
"""

from __future__ import annotations

import csv
import json
import math
import re
from contextlib import suppress
from io import TextIOWrapper
from itertools import chain, repeat
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitgraph.errors import InputError, shown
from gaitgraph.files import pass_interruption, text_of, value_from_json
from gaitgraph.gait.table import (
    ANGLES,
    TEXTS,
    checked_about,
    provenance_of,
    provenance_text,
)
from gaitgraph.io.columns import MADE_BY, SHARED, about_from_texts, states_making
from gaitgraph.vehicle import vehicle_from_mapping

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from gaitgraph.gait.table import Table
    from gaitgraph.io.columns import TableBuilder

_WHAT = "gait file"
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?|nan|inf", re.IGNORECASE)
_LONG = 60  # characters of a value
_BLOCK = 1 << 22  # characters of lines that are read at once
_ROWS_AT_ONCE = 1 << 16  # that are written
_BESIDE_FIELDS = {",", "\n"}


def read_csv(path: Path, builder: TableBuilder) -> Table:
    """Return the table in a CSV file, with what made it."""
    with path.open("rb") as raw:
        stream = TextIOWrapper(raw, encoding="utf-8-sig")
        read, head = 1, stream.readline()  # lines until now
        while head == "\n" or (
            head.startswith("#") and "alpha" not in head
        ):  # comments
            read, head = read + 1, stream.readline()
        if not head:
            raise InputError(
                "it is empty; it must have a header line and at least one row"
            )
        try:  # numpy.savetxt begins a header with "# "
            names = [
                name.strip()
                for name in next(csv.reader([head.lstrip("# ")], strict=True))
            ]
        except csv.Error as error:
            raise InputError(
                f"line {read} must be comma-separated text: {error}"
            ) from error
        parts = names if "," in head else re.split(r"[\s;]+", head.strip())
        if any(map(_NUMBER.fullmatch, parts)) and set(names).isdisjoint(builder.used):
            example = "t,alpha1,alpha2,alpha3,alpha4"
            raise InputError(
                f"line {read} must be a header that names the columns, such as {example}, got numbers"
            )
        if len(names) == 1 and re.search(r"[;\s]", head.strip("# \n")):
            got = "semicolons, tabs or blanks"
            raise InputError(
                f"columns must be separated by commas, with points in numbers, got {got}"
            )
        lines = stream.readlines(_BLOCK)
        about = _about_taken_out(lines, names, stream)
        builder.begin(
            [name for name in names if name != MADE_BY or about is None], about or {}
        )
        blocks = []
        while lines:
            columns = _numeric_columns(lines, names, builder) or _text_columns(
                lines, names, read
            )
            blocks.append(
                {name: columns[name] for name in names if name in builder.used}
            )
            read += len(lines)
            lines = stream.readlines(_BLOCK)
    return builder.table(_joined(blocks))


def _joined(blocks: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the columns of consecutive blocks of lines as one: arrays where all of them are arrays, else lists."""
    joined: dict[str, Any] = {}
    for name in blocks[0] if blocks else ():
        parts = [block[name] for block in blocks]
        if all(isinstance(part, np.ndarray) for part in parts):
            joined[name] = np.concatenate(parts)
        else:
            lists = (p.tolist() if isinstance(p, np.ndarray) else p for p in parts)
            joined[name] = list(chain.from_iterable(lists))
    return joined


def _about_taken_out(
    lines: list[str], names: list[str], stream: TextIOWrapper
) -> dict[str, Any] | None:
    """Take what made the file out of its first lines, and return it; None if there is no column for it.

    Further lines are read where the last of these states it. Without these texts numpy reads all rows alike.
    """
    if MADE_BY not in names or not lines:
        return None
    texts: list[str] = []
    column, row = names.index(MADE_BY), 0
    with suppress(csv.Error):  # reading the line as a row says what is wrong
        while row < len(lines):
            fields: list[str] = []
            if column < len(names) - 1 or not lines[row].rstrip().endswith(","):
                fields = next(csv.reader([lines[row]], strict=True), [])
            if len(fields) == len(names) and fields[column]:
                if not (texts or states_making(fields[column])):
                    return None
                texts.append(fields[column])
                fields[column] = ""
                lines[row] = (
                    ",".join(f'"{text}"' if "," in text else text for text in fields)
                    + "\n"
                )
                if row == len(lines) - 1:
                    lines += stream.readlines(_BLOCK)
            row += 1
    return None if not texts and row < len(lines) else about_from_texts(texts)


def _texts_of(table: Table) -> list[str]:
    """Return what made a table as short texts, or as one text of JSON if they do not state it exactly."""
    provenance = provenance_of(table)
    about = {**provenance.pop("about")}
    if isinstance(request := about.get("request"), dict):
        about["request"] = {
            name: value
            for name, value in request.items()
            if name not in SHARED or value != about.get(name)
        }
    with suppress(InputError):
        if isinstance(about.get("vehicle"), dict):
            about["vehicle"] = vehicle_from_mapping(about["vehicle"]).as_short_mapping()
        texts = [*_parts(provenance | about)]
        texts[0] += f"; texts = {len(texts) + 1}"
        if about_from_texts(texts) == table.about:
            return texts
    return [provenance_text(table)]


_LONGEST_TEXT = 16  # characters; rows with a longer text are read by csv


def _parts(values: dict[str, Any], before: str = "") -> Iterator[str]:
    """Yield values as texts, name and JSON; long ones part by part, lists with numbers for names."""
    for name, value in values.items():
        text, parts = json.dumps(value, allow_nan=False), value
        if isinstance(value, list) and all(
            isinstance(one, (list, dict)) for one in value
        ):
            parts = {str(number): one for number, one in enumerate(value, start=1)}
        if len(text) > _LONG and isinstance(parts, dict):
            yield from _parts(parts, f"{before}{name}.")
        else:
            yield f"{before}{name} = {text}"


def _are_plain(lines: list[str]) -> bool:
    """Return whether numpy's reader takes or refuses the same of these lines as csv does."""
    text = "".join(lines)
    if not text.isascii() or "_" in text or not text.strip("\n"):
        return False
    if max(map(len, lines)) > csv.field_size_limit():
        return False  # csv refuses longer fields, and numpy's reader does not
    # numpy's reader takes quotation marks that csv refuses: other than around whole fields.
    parts = f"\n{text}\n".split('"')
    outside, inside = parts[::2], parts[1::2]
    return (
        len(outside) > len(inside)
        and not any("\n" in one for one in inside)
        and all(one[:1] in _BESIDE_FIELDS for one in outside[1:])
        and all(one[-1:] in _BESIDE_FIELDS for one in outside[:-1])
    )


def _numeric_columns(
    lines: list[str], names: list[str], builder: TableBuilder
) -> dict[str, Any] | None:
    """Return the columns of lines as numpy reads them, or None if anything about the lines is unusual."""
    if not _are_plain(lines):
        return None
    used = builder.used  # of others one character is read
    kinds = [
        (f"U{_LONGEST_TEXT}" if name in TEXTS else "f8") if name in used else "U1"
        for name in names
    ]
    dtype = [(f"f{k}", kind) for k, kind in enumerate(kinds)]
    try:
        rows = np.loadtxt(
            lines, dtype, delimiter=",", comments=None, quotechar='"', ndmin=1
        )
    except (ValueError, IndexError, OverflowError) as error:
        pass_interruption(error)
        return None
    columns = {name: rows[f"f{k}"] for k, name in enumerate(names)}
    for name, column in columns.items():
        if name not in used:
            continue
        if name in TEXTS:
            if (np.char.str_len(column) >= _LONGEST_TEXT).any():  # may have been cut
                return None
        elif not np.isfinite(column).all():
            return None
    return columns


def _text_columns(lines: list[str], names: list[str], offset: int) -> dict[str, Any]:
    """Return the columns of lines as texts, or raise InputError with the number of the line that is wrong."""
    reader = csv.reader(lines, strict=True)
    rows = []
    try:
        for row in filter(None, reader):
            if len(row) != len(names):
                wanted = f"must have {len(names)} fields, as the header has"
                raise InputError(
                    f"line {offset + reader.line_num} {wanted}, got {len(row)}"
                )
            rows.append(row)
    except csv.Error as error:
        raise InputError(
            f"line {offset + reader.line_num} must be comma-separated text: {error}"
        ) from error
    return {name: [row[k] for row in rows] for k, name in enumerate(names)}


def write_csv(table: Table, path: Path) -> None:
    """Write a new CSV file."""
    texts = _texts_of(table)
    share = math.ceil(len(texts) / len(table))
    stated = chain(
        ("; ".join(texts[k : k + share]) for k in range(0, len(texts), share)),
        repeat(""),
    )
    with path.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow([*table.columns, MADE_BY])
        for start in range(0, len(table), _ROWS_AT_ONCE):  # numbers take less as arrays
            some = table.rows(start, start + _ROWS_AT_ONCE).columns.values()
            columns = (
                one.tolist() if isinstance(one, np.ndarray) else one for one in some
            )
            writer.writerows(zip(*columns, stated, strict=False))


_JSON = "it must be an object of columns, a list of rows, or a plan"
_MOST_BRACKETS = 5_000_000


def read_json(path: Path, builder: TableBuilder) -> Table:
    """Return the table in a JSON file: of columns (beside or around them what made them), of rows, or of a plan."""
    text = text_of(path, _WHAT)
    if (
        text.count("[") + text.count("{") > _MOST_BRACKETS
    ):  # they take twenty times the memory of the text, and more
        raise InputError(
            f"it must have at most {_MOST_BRACKETS} lists and objects, got more; {_JSON}"
        )
    content = value_from_json(text, _JSON)
    about: dict[str, Any] = {}
    if isinstance(content, list):
        for number, row in enumerate(content, start=1):
            if not isinstance(row, dict) or row.keys() != content[0].keys():
                raise InputError(
                    f"row {number} must be an object with the fields of row 1, got {shown(row)}; {_JSON}"
                )
        columns = (
            {name: [row[name] for row in content] for name in content[0]}
            if content
            else {}
        )
    elif not isinstance(content, dict):
        raise InputError(f"{_JSON}, got {shown(content)}")
    elif "path" in content:
        columns, about = _columns_of_plan(content)
    elif "waypoints" in content and "columns" not in content:
        raise InputError("it holds a request, which is planned first")
    else:
        columns, about = (
            content.get("columns", content),
            checked_about(content.get("about", {})),
        )
        if not isinstance(columns, dict):
            raise InputError(
                f"columns must be an object of lists, got {shown(columns)}"
            )
    return builder.whole(columns, about)


def _columns_of_plan(content: dict[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the columns of a plan, and what made it."""
    if content.get("status") == "infeasible":
        raise InputError(f"it holds a plan without a gait: {content.get('reason')}")
    path, colors = content["path"], content.get("colors", [])
    if not (
        isinstance(path, list)
        and path
        and all(isinstance(row, list) and len(row) == 4 for row in path)
    ):
        raise InputError(
            f"path must be a list of [alpha1, alpha2, alpha3, alpha4], got {shown(path)}"
        )
    if not isinstance(colors, list):
        raise InputError(
            f"colors must be a list of 'red' and 'blue', got {shown(colors)}"
        )
    columns = {name: [row[k] for row in path] for k, name in enumerate(ANGLES)} | (
        {"color": colors} if colors else {}
    )
    request = content.get("request")
    about = (
        {key: request[key] for key in SHARED if key in request}
        if isinstance(request, dict)
        else {}
    )
    about |= {"request": request} if about else {}
    about |= {key: content[key] for key in ("crossing_tolerance",) if key in content}
    return columns, about


def write_json(table: Table, path: Path) -> None:
    """Write a new JSON file: format, version, about, and the columns as lists."""
    plain = {
        name: one.tolist() if isinstance(one, np.ndarray) else one
        for name, one in table.columns.items()
    }
    heads, columns = (
        [
            f"{indent}{json.dumps(name)}: {json.dumps(value, allow_nan=False)}"
            for name, value in content.items()
        ]
        for indent, content in (("  ", provenance_of(table)), ("    ", plain))
    )
    heads.append('  "columns": {\n' + ",\n".join(columns) + "\n  }")
    path.write_text("{\n" + ",\n".join(heads) + "\n}\n", encoding="utf-8")
