"""Gait tables as files: CSV and JSON, written whole or not at all, read back bit for bit.

A table has the columns ``t, alpha1, alpha2, alpha3, alpha4`` (s, rad), then ``color, types, R``, then
``alpha1_rate`` … (rad/s) and ``alpha1_acceleration`` … (rad/s²). Somebody else's table needs only alpha1 to
alpha4, or alpha1, alpha2 and color, in any order, with or without t, closed or to be closed; degrees are taken
from columns named ``alpha1_deg`` and so on. Unknown columns are passed over.
"""

from __future__ import annotations

import io
import json
import math
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph import __version__
from gaitgraph.coloring import types_from_text
from gaitgraph.errors import FileProblem, GaitgraphError, InputError, OutputExists, did_you_mean, shown
from gaitgraph.files import target_of, text_of, write_whole
from gaitgraph.surface import COLORS, checked_plane_angles

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from gaitgraph.timing import TimedGait

__all__ = ["Table", "check_outputs", "read_table", "table_of", "write_tables", "writer_for"]

FloatArray = npt.NDArray[np.float64]

FORMAT = "gaitgraph gait table"
ANGLES = ("alpha1", "alpha2", "alpha3", "alpha4")
RATES = tuple(f"{name}_rate" for name in ANGLES)
ACCELERATIONS = tuple(f"{name}_acceleration" for name in ANGLES)
_DEGREES = {f"{name}_deg": name for name in ANGLES}
_TEXTS = ("color", "types")
ORDER = ("t", *ANGLES, "color", "types", "R", *RATES, *ACCELERATIONS)


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """Rows of a gait: equally long columns by name, in the order of the module's docstring.

    Parameters
    ----------
    columns
        Arrays of floats (radians, seconds), and tuples of texts for `color` and `types`.
    about
        What made the table: vehicle, coefficients, period, law and so on; plain values.
    """

    columns: dict[str, Any]
    about: dict[str, Any] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(next(iter(self.columns.values())))

    def __contains__(self, name: str) -> bool:
        return name in self.columns

    def __getitem__(self, name: str) -> Any:
        return self.columns[name]

    @property
    def alpha(self) -> FloatArray:
        """The four tilt angles of each row, shape (n, 4) [rad]."""
        return np.column_stack([self.columns[name] for name in ANGLES])


def table_of(timed: TimedGait, about: Mapping[str, Any] | None = None) -> Table:
    """Return the table of a timed gait, and what made it.

    >>> from gaitgraph.gait import lift
    >>> table = table_of(lift([(0.4, -0.4), (0.8, -0.8)], "red").parametrize(samples=4))
    >>> len(table), list(table.columns)[:6]
    (5, ['t', 'alpha1', 'alpha2', 'alpha3', 'alpha4', 'color'])
    """
    gait = timed.gait
    made = {
        "vehicle": gait.vehicle.as_mapping(),
        "coefficients": gait.coefficients.kind,
        "crossing_tolerance": gait.crossing_tolerance,
        "period": timed.period,
        "law": timed.law,
        **(about or {}),
    }
    return Table(columns=timed.columns(), about=made)


def _plain(values: Any) -> list[Any]:
    return values.tolist() if isinstance(values, np.ndarray) else list(values)


def _csv_bytes(table: Table) -> bytes:
    import csv

    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(table.columns)
    writer.writerows(zip(*(_plain(values) for values in table.columns.values()), strict=True))
    return text.getvalue().encode()


def _json_bytes(table: Table) -> bytes:
    head = {"format": FORMAT, "version": __version__, "about": table.about}
    lines = [f"  {json.dumps(key)}: {json.dumps(value, allow_nan=False)}" for key, value in head.items()]
    columns = [
        f"    {json.dumps(name)}: {json.dumps(_plain(values), allow_nan=False)}"
        for name, values in table.columns.items()
    ]
    lines.append('  "columns": {\n' + ",\n".join(columns) + "\n  }")
    return ("{\n" + ",\n".join(lines) + "\n}\n").encode()


_WRITERS: dict[str, Callable[[Table], bytes]] = {".csv": _csv_bytes, ".json": _json_bytes}


def writer_for(path: str | Path) -> Callable[[Table], bytes]:
    """Return what turns a table into the bytes of a file, by its suffix.

    Raises
    ------
    InputError
        If the suffix is not known.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in _WRITERS:
        raise InputError(f"output: {str(path)!r}; allowed are the suffixes {', '.join(_WRITERS)}")
    return _WRITERS[suffix]


def check_outputs(paths: Sequence[str | Path], *, force: bool = False) -> None:
    """Raise before any work is done if an output has a wrong suffix, is named twice, exists or is a folder."""
    seen: set[Path] = set()
    for path in map(Path, paths):
        writer_for(path)
        try:
            resolved, folder = target_of(path), path.parent
            if resolved in seen:
                raise InputError(f"output: {str(path)!r} is named twice; allowed is once")
            seen.add(resolved)
            if path.is_dir():
                raise OutputExists(f"output: {str(path)!r} is a folder; allowed is a file")
            if os.path.lexists(path) and not force:
                raise OutputExists(f"output: {str(path)!r} exists; allowed is a new file, or --force (force=True)")
            if not folder.is_dir():
                what = "is no folder" if folder.exists() else "does not exist"
                raise FileProblem(f"output: folder {str(folder)!r} {what}; allowed is an existing folder")
            path.exists()  # a name that the file system refuses is refused here
        except GaitgraphError:
            raise
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or error
            raise FileProblem(f"output: cannot write {shown(str(path))}: {reason}") from error


def write_tables(table: Table, paths: Sequence[str | Path], *, force: bool = False) -> None:
    """Write a table to files, each whole or not at all; the format follows from the suffix.

    Parameters
    ----------
    table
        What to write.
    paths
        Files ending in .csv or .json.
    force
        Overwrite files that exist.

    Raises
    ------
    OutputExists
        If a file exists and `force` is not set; then none is written.
    FileProblem
        If a file cannot be written; the old one, if any, is whole.
    InputError
        If a suffix is not known or a file is named twice.
    """
    check_outputs(paths, force=force)
    write_whole([(Path(path), writer_for(path)(table)) for path in paths], force=force)


def read_table(path: str | Path) -> Table:
    """Read a gait table, or a plan saved as JSON.

    Parameters
    ----------
    path
        A .csv or .json file; a byte-order mark and CRLF are read too.

    Raises
    ------
    FileProblem
        If the file cannot be read.
    InputError
        If it holds no gait table; the message names file, place and what is allowed.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in _WRITERS:
        raise InputError(f"gait file: {str(path)!r}; allowed are the suffixes {', '.join(_WRITERS)}")
    text = text_of(path, "gait file", "a .csv or .json gait table")
    try:
        return _from_csv(text) if suffix == ".csv" else _from_json(text)
    except InputError as error:
        raise InputError(f"gait file {str(path)!r}: {error}") from error


def _from_csv(text: str) -> Table:
    import csv

    rows = csv.reader(io.StringIO(text, newline=""), strict=True)
    try:
        header = next(rows, None)
        while header == []:
            header = next(rows, None)
        if header is None:
            raise InputError("it is empty; allowed is a header line and at least one row")
        names = [name.strip() for name in header]
        if len(names) == 1 and ";" in names[0]:
            raise InputError("columns are separated by semicolons; allowed are commas")
        columns: list[list[str]] = [[] for _ in names]
        for row in rows:
            if not row:
                continue
            if len(row) != len(names):
                raise InputError(
                    f"line {rows.line_num} has {len(row)} fields; allowed are {len(names)}, as in the header"
                )
            for column, value in zip(columns, row, strict=True):
                column.append(value)
    except csv.Error as error:
        raise InputError(f"line {rows.line_num}: {error}; allowed is comma-separated text") from error
    return _table(list(zip(names, columns, strict=True)), {})


def _from_json(text: str) -> Table:
    try:
        content = json.loads(text, parse_constant=_no_constant)
    except RecursionError as error:
        raise InputError("it is nested too deeply; allowed is a gait table") from error
    except ValueError as error:
        raise InputError(f"it is not JSON ({str(error).splitlines()[0]})") from error
    allowed = "allowed is an object of columns, a list of rows, or a plan"
    if isinstance(content, list):
        if not all(isinstance(row, dict) for row in content):
            raise InputError(f"a list whose entries are not all objects; {allowed}")
        names = list(content[0]) if content else []
        for number, row in enumerate(content, start=1):
            if set(row) != set(names):
                raise InputError(f"row {number} has other fields than row 1; {allowed}")
        return _table([(name, [row[name] for row in content]) for name in names], {})
    if not isinstance(content, dict):
        raise InputError(f"it holds a {type(content).__name__}; {allowed}")
    if "path" in content:
        return _from_plan(content)
    about = content.get("about", {})
    columns = content.get("columns", content)
    if not isinstance(about, dict) or not isinstance(columns, dict):
        raise InputError(f"'about' or 'columns' is no object; {allowed}")
    try:
        json.dumps(about, allow_nan=False)
    except ValueError as error:
        raise InputError(f"about: {shown(about)}; allowed are finite numbers and texts") from error
    lists = [(name, values) for name, values in columns.items() if isinstance(values, list)]
    return _table(lists, about)


def _no_constant(name: str) -> None:
    raise ValueError(f"{name} is no number of JSON")


def _from_plan(content: dict[str, Any]) -> Table:
    if content.get("status") == "infeasible":
        raise InputError(f"it holds a plan without a gait: {content.get('reason')}")
    path, colors = content["path"], content.get("colors", [])
    rows = isinstance(path, list) and path and all(isinstance(row, list) and len(row) == 4 for row in path)
    if not rows:
        raise InputError(f"path: {shown(path)}; allowed is a list of [alpha1, alpha2, alpha3, alpha4]")
    columns = [(name, [row[k] for row in path]) for k, name in enumerate(ANGLES)]
    if not isinstance(colors, list):
        raise InputError(f"colors: {shown(colors)}; allowed is a list of 'red' and 'blue'")
    if colors:
        columns.append(("color", colors))
    request = content.get("request")
    keys = ("vehicle", "coefficients", "period", "law")
    about = {key: request[key] for key in keys if key in request} if isinstance(request, dict) else {}
    if "crossing_tolerance" in content:
        about["crossing_tolerance"] = content["crossing_tolerance"]
    return _table(columns, about)


def _table(columns: list[tuple[str, list[Any]]], about: dict[str, Any]) -> Table:
    """Check raw columns and bring them into order."""
    names = [name for name, _ in columns]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"column {name!r} appears twice; allowed is once")
    for degrees, name in _DEGREES.items():
        if degrees in names and name in names:
            raise InputError(f"columns {name!r} and {degrees!r} are both there; allowed is one of the two")
    lengths = {len(values) for _, values in columns}
    if len(lengths) > 1:
        raise InputError(f"columns have {min(lengths)} to {max(lengths)} rows; allowed are equally many")
    found: dict[str, Any] = {}
    for name, values in columns:
        if name in _TEXTS:
            found[name] = _texts(name, values)
        elif name in _DEGREES:
            found[_DEGREES[name]] = np.radians(_numbers(name, values))
        elif name in ORDER:
            found[name] = _numbers(name, values)
    _require_angles(found, names)
    if not lengths or not lengths.pop():
        raise InputError("it has no rows; allowed is at least one")
    if "t" in found:
        step = np.diff(found["t"])
        if (step <= 0).any():
            row = int(np.argmax(step <= 0)) + 2
            raise InputError(f"row {row}: t = {found['t'][row - 1]!r} does not increase; allowed are increasing times")
    checked_plane_angles(found["alpha1"], found["alpha2"])
    return Table(columns={name: found[name] for name in ORDER if name in found}, about=about)


def _require_angles(found: dict[str, Any], names: list[str]) -> None:
    lifted = "color" in found and "alpha3" not in found and "alpha4" not in found
    for name in ANGLES[:2] if lifted else ANGLES:
        if name not in found:
            hint = did_you_mean(name, [other for other in names if other not in ORDER])
            wanted = "alpha1 to alpha4 (rad) or alpha1_deg to alpha4_deg, or alpha1, alpha2 and color"
            raise InputError(f"column {name!r} is missing; allowed are {wanted}{hint}")


def _numbers(name: str, values: list[Any]) -> FloatArray:
    numbers = np.empty(len(values))
    for k, value in enumerate(values):
        try:
            numbers[k] = math.nan if isinstance(value, (bool, list, dict)) else float(value)
        except (TypeError, ValueError, OverflowError):
            numbers[k] = math.nan
    bad = ~np.isfinite(numbers)
    if bad.any():
        k = int(np.argmax(bad))
        raise InputError(f"row {k + 1}: {name} is {shown(values[k])}; allowed is a finite number")
    return numbers


def _texts(name: str, values: list[Any]) -> tuple[str, ...]:
    for k, value in enumerate(values):
        if name == "color" and value not in COLORS:
            raise InputError(f"row {k + 1}: color is {shown(value)}; allowed are 'red' and 'blue'")
        if name == "types":
            if not isinstance(value, str):
                raise InputError(f"row {k + 1}: types is {shown(value)}; allowed is a text such as '(+,?)'")
            try:
                types_from_text(value)
            except InputError as error:
                raise InputError(f"row {k + 1}: {error}") from error
    return tuple(values)
