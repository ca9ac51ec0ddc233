"""CSV piece by piece: lines, fast columns where nothing is unusual, else columns of texts; how finely it is printed."""

from __future__ import annotations

import csv
import math
import re
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitgraph.errors import InputError
from gaitgraph.gait.table import ANGLES, DEGREES, FORMAT, Table, about_from_text
from gaitgraph.io.header import Header, joints_of
from gaitgraph.io.text_lines import lines_of
from gaitgraph.io.texts import MADE_BY
from gaitgraph.io.values import check_times

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from gaitgraph.io.servo_map import ServoMap

__all__ = ["pieces_of_csv"]

_QUOTED_FIELD = re.compile(r'^"[^"\n]*"(?=,|$)|(?<=,)"[^"\n]*"(?=,|$)', re.MULTILINE)
_PRINTED_ROWS = 1000
_FEWEST, _FULL = 3, 9


def pieces_of_csv(
    path: Path, progress: Callable[[float], None] | None, plane_only: bool, joints: ServoMap | None
) -> Iterator[Table]:
    """Yield the pieces of a CSV file, each with what made it and how finely its angles are printed.

    Parameters
    ----------
    path, progress, plane_only, joints
        As for :func:`gaitgraph.io.reading.read_pieces`.

    Raises
    ------
    FileProblem, InputError
        If the file cannot be read, or a line or a value is wrong; the message names the line or the row.
    """
    header: Header | None = None
    line, row, last_time = 0, 0, -math.inf
    rounding: float | None = None
    about: dict[str, Any] = {}
    names: list[str] | None = None
    for lines in lines_of(path, progress):
        start = 0
        if names is None:
            start = next((k for k, text in enumerate(lines) if text), len(lines))
            if start == len(lines):
                line += start
                continue
            names = _names_of(lines[start], line + start + 1)
            start += 1
        made, joints = joints_of(_taken_out(lines, start, names), joints)
        about = made or about
        header = header or Header(names, plane_only, joints)
        raw = _numeric(lines[start:], header)
        if raw is None:
            raw = _textual(lines[start:], header, line + start)
        line += len(lines)
        if len(raw[0]):
            columns = header.columns(raw, row)
            row += len(raw[0])
            if "t" in columns:
                check_times(columns["t"], last_time, row)
                last_time = columns["t"][-1]
            if rounding is None:
                rounding = _rounding_of(lines[start:][:_PRINTED_ROWS], header)
            yield Table(columns=columns, about=about, rounding=rounding)
    if header is None:
        raise InputError("it is empty; allowed is a header line and at least one row")
    if not row:
        raise InputError("it has no rows; allowed is at least one")


def _names_of(text: str, line: int) -> list[str]:
    """Return the names in the header line of a CSV file."""
    names = [name.strip() for name in _fields([text], line - 1)[0]]
    if len(names) == 1:
        for mark, what in ((";", "semicolons"), ("\t", "tabs")):
            if mark in names[0] or mark in text:
                raise InputError(f"columns are separated by {what}; allowed are commas, and points in numbers")
    return names


def _fields(lines: list[str], offset: int) -> list[list[str]]:
    """Return the fields of lines that are not empty; `offset` is the number of lines before these."""
    rows = csv.reader(lines, strict=True)
    try:
        return [row for row in rows if row]
    except csv.Error as error:
        raise _refused(offset + rows.line_num, error) from error


def _taken_out(lines: list[str], start: int, names: list[str]) -> dict[str, Any]:
    """Take what made the file out of the first and the last of these lines, and return it; nothing if it is not told.

    The rest of a row that has it is read no other way than the rows without.
    """
    about: dict[str, Any] = {}
    if MADE_BY not in names:
        return about
    place = names.index(MADE_BY)
    for k in {start, len(lines) - 1}:
        if not start <= k < len(lines) or FORMAT not in lines[k]:
            continue
        try:
            fields = next(csv.reader([lines[k]], strict=True), [])
        except csv.Error:
            continue  # reading the line as a row says what is wrong
        if len(fields) == len(names) and FORMAT in fields[place]:
            about = about_from_text(fields[place], required=True)
            fields[place] = ""
            lines[k] = ",".join(f'"{text}"' if "," in text else text for text in fields)
    return about


def _rounding_of(lines: list[str], header: Header) -> float:
    """Return half a unit of the last decimal of the angles in lines, if they have three to eight decimals, else 0.

    With fewer they are taken as meant exactly: people type 0.4. With more, floating point says as much.
    """
    decimals, unit = 0, 1.0
    for row in csv.reader(lines):
        for name, text in zip(header.names, row, strict=False):
            if name in (header.of_joints if header.joints else (*ANGLES, *DEGREES)):
                unit = header.of_joints.get(name, math.radians(1.0) if name in DEGREES else 1.0)
                plain = "e" not in text.lower()
                decimals = max(decimals, len(text.strip().partition(".")[2]) if plain else _FULL)
    return 0.5 * unit * 10.0**-decimals if _FEWEST <= decimals < _FULL else 0.0


def _numeric(lines: list[str], header: Header) -> list[Any] | None:
    """Return the columns of lines, read fast, or None if anything about them is unusual."""
    text = "\n".join(lines)
    if not text.strip("\n"):
        return [[] for _ in header.names]
    if not text.isascii() or "_" in text:
        return None
    if '"' in text and '"' in _QUOTED_FIELD.sub("", text):
        return None  # numpy's reader takes quotation marks that csv refuses
    try:
        rows = np.loadtxt(lines, dtype=header.dtype, delimiter=",", comments=None, quotechar='"', ndmin=1)
    except (ValueError, IndexError, OverflowError):
        return None
    columns = [rows[name] for name in rows.dtype.names or ()]
    finite = all(np.isfinite(column).all() for column in columns if column.dtype.kind == "f")
    return columns if finite else None


def _textual(lines: list[str], header: Header, offset: int) -> list[Any]:
    """Return the columns of lines as texts, or say which line is wrong."""
    wanted = len(header.names)
    rows = csv.reader(lines, strict=True)
    columns: list[list[str]] = [[] for _ in header.names]
    try:
        for row in rows:
            if row and len(row) != wanted:
                line = offset + rows.line_num
                raise InputError(f"line {line} has {len(row)} fields; allowed are {wanted}, as in the header")
            for column, value in zip(columns, row, strict=False):
                column.append(value)
    except csv.Error as error:
        raise _refused(offset + rows.line_num, error) from error
    return columns


def _refused(line: int, error: csv.Error) -> InputError:
    """Return what to raise for a line that is no CSV."""
    return InputError(f"line {line}: {error}; allowed is comma-separated text")
