"""Read gait tables: CSV, Parquet and bags piece by piece, so that any length fits in memory, the others whole.

Whatever the format, names, numbers, texts and times are checked here.
"""

from __future__ import annotations

import csv
import json
import math
import re
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import HALF_PI, angle_from_text
from gaitgraph.coloring import types_from_text
from gaitgraph.errors import InputError, MissingExtra, did_you_mean, shown
from gaitgraph.fibers import FAMILIES
from gaitgraph.files import blocks_of, decoded, text_of
from gaitgraph.formats import known_format, readable_suffixes
from gaitgraph.formats.texts import MADE_BY
from gaitgraph.joints.files import joint_map_from_mapping
from gaitgraph.joints.inverse import check_joint_columns, tilts_from_joints
from gaitgraph.tables import (
    ACCELERATIONS,
    ANGLES,
    DEGREES,
    FORMAT,
    ORDER,
    RATES,
    TEXTS,
    Table,
    about_of_provenance,
    is_deep,
    merged,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from gaitgraph.formats import Format
    from gaitgraph.joints.maps import JointMap

__all__ = ["provenance_in", "read_pieces", "read_table", "table_from_columns"]

FloatArray = npt.NDArray[np.float64]

_WHAT, _ALLOWED = "gait file", "a gait table: " + ", ".join(readable_suffixes())
_TEXT = "a gait table as text"
_LONGEST_LINE = 1 << 22
_QUOTED_FIELD = re.compile(r'^"[^"\n]*"(?=,|$)|(?<=,)"[^"\n]*"(?=,|$)', re.MULTILINE)
_LONGEST_TIME, _SHORTEST_STEP = 1e9, 1e-9
_FASTEST = 1e12
_FARTHEST = 1e6  # beyond it floating point carries no angle
_PRINTED_ROWS = 1000
_FEWEST, _FULL = 3, 9
_OTHERS_TOLD, _MOST_OTHERS = 5, 1000
_MOST_BRACKETS = 5_000_000
_COLORS = ", ".join(map(repr, FAMILIES))


def read_table(path: str | Path, *, joints: JointMap | None = None) -> Table:
    """Read a gait table, or a plan saved as JSON.

    Parameters
    ----------
    path
        A file of any format that :data:`gaitgraph.formats.FORMATS` reads; in texts a byte-order mark and CRLF are
        read too.
    joints
        What its columns are if it is a servo table from elsewhere; one of ours says so itself.

    Raises
    ------
    FileProblem
        If the file cannot be read.
    InputError
        If it holds no gait table; the message names file, place and what is allowed.
    """
    return merged(read_pieces(path, joints=joints))


def read_pieces(
    path: str | Path,
    *,
    progress: Callable[[float], None] | None = None,
    plane_only: bool = False,
    joints: JointMap | None = None,
) -> Iterator[Table]:
    """Yield a gait table as consecutive pieces, each at least one row; the first tells what made it.

    Parameters
    ----------
    path
        A file of any format that is read.
    progress
        Called with the fraction of the file that is read.
    plane_only
        Whether alpha1 and alpha2 are enough.
    joints
        As for :func:`read_table`.

    Raises
    ------
    FileProblem, InputError
        As :func:`read_table` does, when the piece in question is reached.
    """
    path = Path(path)
    form = known_format(path, _WHAT, reads=True)
    try:
        if form.suffix == ".json":
            yield _from_json(text_of(path, _WHAT, _TEXT), plane_only, joints)
        elif form.suffix == ".csv":
            yield from _from_csv(path, progress, plane_only, joints)
        else:
            yield from _from_format(form, path, progress, plane_only, joints)
    except MissingExtra:
        raise
    except InputError as error:
        raise _of_file(path, error) from error


def provenance_in(path: str | Path) -> dict[str, Any]:
    """Return what made a gait file of any format, those that hold no table to read among them: its `about`.

    Raises
    ------
    FileProblem, InputError
        If the file cannot be read or does not tell.
    """
    path = Path(path)
    form = known_format(path, _WHAT)
    if form.reads:
        return next(read_pieces(path)).about
    try:
        return about_of_provenance(form.provenance(path))
    except MissingExtra:
        raise
    except InputError as error:
        raise _of_file(path, error) from error


def _of_file(path: Path, error: InputError) -> InputError:
    """Return an error that names the file, once."""
    told = str(error)
    return error if told.startswith(_WHAT) else InputError(f"{_WHAT} {str(path)!r}: {told}")


def _from_format(
    form: Format,
    path: Path,
    progress: Callable[[float], None] | None,
    plane_only: bool,
    joints: JointMap | None,
) -> Iterator[Table]:
    """Check the raw columns that a format's own room yields."""
    header: _Header | None = None
    row, last_time = 0, -math.inf
    for columns, about in form.reader()(path, progress):
        made, joints = _joints_of(about, joints)
        if header is None:
            header = _Header([name for name, _ in columns], plane_only, joints)
        if not _rows_of(columns):
            continue
        found = header.columns([values for _, values in columns], row)
        row += len(found[ANGLES[0]])
        if "t" in found:
            _check_times(found["t"], last_time, row)
            last_time = found["t"][-1]
        yield Table(columns=found, about=made)
    if not row:
        raise InputError("it has no rows; allowed is at least one")


def _joints_of(about: dict[str, Any], joints: JointMap | None) -> tuple[dict[str, Any], JointMap | None]:
    """Return what made a file without its map of joints, and the map: as asked for, else as the file says, if it does.

    What is read is told of tilt angles, so the map is none of its making.
    """
    if "servos" not in about:
        return about, joints
    rest = {name: value for name, value in about.items() if name != "servos"}
    return rest, joint_map_from_mapping(about["servos"]) if joints is None else joints


def _lines_of(path: Path, progress: Callable[[float], None] | None) -> Iterator[list[str]]:
    """Yield the lines of a text file in groups; any kind of line end is one."""
    rest = b""
    for block, fraction in blocks_of(path, _WHAT, _ALLOWED):
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
    text = decoded(content, path, _WHAT, _TEXT)
    if "\r" in text:
        text = text.replace("\r\n", "\n").replace("\r", "\n")
    return text.removesuffix("\n").split("\n")


def _from_csv(
    path: Path, progress: Callable[[float], None] | None, plane_only: bool, joints: JointMap | None
) -> Iterator[Table]:
    header: _Header | None = None
    line, row, last_time = 0, 0, -math.inf
    rounding: float | None = None
    about: dict[str, Any] = {}
    names: list[str] | None = None
    for lines in _lines_of(path, progress):
        start = 0
        if names is None:
            start = next((k for k, text in enumerate(lines) if text), len(lines))
            if start == len(lines):
                line += start
                continue
            names = _names_of(lines[start], line + start + 1)
            start += 1
        made, joints = _joints_of(_taken_out(lines, start, names), joints)
        about = made or about
        header = header or _Header(names, plane_only, joints)
        raw = _numeric(lines[start:], header)
        if raw is None:
            raw = _textual(lines[start:], header, line + start)
        line += len(lines)
        if len(raw[0]):
            columns = header.columns(raw, row)
            row += len(raw[0])
            if "t" in columns:
                _check_times(columns["t"], last_time, row)
                last_time = columns["t"][-1]
            if rounding is None:
                rounding = header.rounding(lines[start:][:_PRINTED_ROWS])
            yield Table(columns=columns, about=about, rounding=rounding)
    if header is None:
        raise InputError("it is empty; allowed is a header line and at least one row")
    if not row:
        raise InputError("it has no rows; allowed is at least one")


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
            about = about_of_provenance(fields[place])
            fields[place] = ""
            lines[k] = ",".join(f'"{text}"' if "," in text else text for text in fields)
    return about


def _check_times(times: FloatArray, before: float, rows: int) -> None:
    """Raise InputError unless times increase; `rows` counts all rows up to the last one of these."""
    far = np.abs(times) > _LONGEST_TIME
    if far.any():
        k = int(np.argmax(far))
        row, time = rows - len(times) + k + 1, float(times[k])
        raise InputError(f"row {row}: t = {time!r}; allowed are times up to {_LONGEST_TIME:g} s")
    step = np.diff(times, prepend=before)
    if (step <= 0).any():
        k = int(np.argmax(step <= 0))
        row, time = rows - len(times) + k + 1, float(times[k])
        raise InputError(f"row {row}: t = {time!r} does not increase; allowed are increasing times")
    if (step < _SHORTEST_STEP).any():
        k = int(np.argmax(step < _SHORTEST_STEP))
        row, time = rows - len(times) + k + 1, float(times[k])
        raise InputError(f"row {row}: t = {time!r} follows at once; allowed are steps of {_SHORTEST_STEP:g} s and more")


class _Header:
    """The names of a table's columns, checked; turns raw columns into those of a :class:`Table`."""

    def __init__(self, names: list[str], plane_only: bool, joints: JointMap | None = None) -> None:
        self.names = names
        self.joints = joints
        # Of a map of joints, each with the radians in its unit; then angles under the usual names are none.
        self.of_joints = {joint.column: 1.0 / joint.per_radian for joint in joints.joints} if joints else {}
        for name, count in Counter(names).items():
            if count > 1:
                raise InputError(
                    f"column {name!r} appears {'twice' if count == 2 else f'{count} times'}; allowed is once"
                )
        self.dtype = [(f"f{k}", self._dtype(name)) for k, name in enumerate(names)]
        if joints is not None:
            check_joint_columns(names, joints)
            return
        for degrees, name in DEGREES.items():
            if degrees in names and name in names:
                raise InputError(f"columns {name!r} and {degrees!r} are both there; allowed is one of the two")
        known = [DEGREES.get(name, name) for name in names]
        lifted = plane_only or ("color" in known and "alpha3" not in known and "alpha4" not in known)
        for name in ANGLES[:2] if lifted else ANGLES:
            if name not in known:
                hint = _others(name, [other for other in names if other not in ORDER])
                wanted = "alpha1 to alpha4 (rad) or alpha1_deg to alpha4_deg, or alpha1, alpha2 and color"
                raise InputError(f"column {name!r} is missing; allowed are {wanted}{hint}")

    def _dtype(self, name: str) -> str:
        if self.joints is not None and name in self.joints.columns:
            return "f8"
        if name in TEXTS:
            return "U8"
        return "f8" if name in ORDER or (name in DEGREES and self.joints is None) else "U1"

    def rounding(self, lines: list[str]) -> float:
        """Return half a unit of the last decimal of the angles in lines, if they have three to eight decimals, else 0.

        With fewer they are taken as meant exactly: people type 0.4. With more, floating point says as much.
        """
        decimals, unit = 0, 1.0
        for row in csv.reader(lines):
            for name, text in zip(self.names, row, strict=False):
                if name in (self.of_joints if self.joints else (*ANGLES, *DEGREES)):
                    unit = self.of_joints.get(name, math.radians(1.0) if name in DEGREES else 1.0)
                    plain = "e" not in text.lower()
                    decimals = max(decimals, len(text.strip().partition(".")[2]) if plain else _FULL)
        return 0.5 * unit * 10.0**-decimals if _FEWEST <= decimals < _FULL else 0.0

    def columns(self, raw: list[Any], row: int, *, angle_texts: bool = False) -> dict[str, Any]:
        """Return checked columns in order; `row` is the number of rows before these."""
        found: dict[str, Any] = {}
        if self.joints is not None:
            told = {name: values for name, values in zip(self.names, raw, strict=True) if name in self.joints.columns}
            for name, values in told.items():
                if values is None:
                    raise InputError(f"{name}: it is no column of numbers, one a row; allowed is one")
            numbers = {name: _numbers(name, values, row) for name, values in told.items()}
            found |= tilts_from_joints(numbers, self.joints, rows_before=row)
        for name, values in zip(self.names, raw, strict=True):
            if self.joints is not None and (name in self.joints.columns or name not in ("color", "types", "R")):
                continue
            if name in TEXTS:
                found[name] = _texts(name, values, row)
            elif name in DEGREES:
                found[DEGREES[name]] = np.radians(_numbers(name, values, row))
            elif name in ORDER:
                found[name] = _numbers(name, values, row, angle_texts=angle_texts and name in ANGLES)
        for name in ANGLES[:2]:
            beyond = np.abs(found[name]) > HALF_PI
            if beyond.any():
                k = int(np.argmax(beyond))
                value = float(found[name][k])
                raise InputError(f"row {row + k + 1}: {name} is {value!r} rad; allowed is −π/2 to π/2 (±{HALF_PI!r})")
        limits = dict.fromkeys(ANGLES[2:], _FARTHEST) | dict.fromkeys(("R", *RATES, *ACCELERATIONS), _FASTEST)
        for name, limit in limits.items():
            beyond = np.abs(found.get(name, np.zeros(0))) > limit
            if beyond.any():
                k = int(np.argmax(beyond))
                value = float(found[name][k])
                raise InputError(f"row {row + k + 1}: {name} is {value!r}; allowed is up to {limit:g}")
        return {name: found[name] for name in ORDER if name in found}


def _others(name: str, others: list[str]) -> str:
    """Return which other column may be meant, or else which there are."""
    told = ", ".join(map(shown, others[:_OTHERS_TOLD])) + (", …" if len(others) > _OTHERS_TOLD else "")
    return did_you_mean(name, others[:_MOST_OTHERS]) or (f"; there are {told}" if others else "")


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


def _numeric(lines: list[str], header: _Header) -> list[Any] | None:
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


def _textual(lines: list[str], header: _Header, offset: int) -> list[Any]:
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


def _numbers(name: str, values: Any, row: int, *, angle_texts: bool = False) -> FloatArray:
    if isinstance(values, np.ndarray) and values.dtype.kind == "f":
        odd = ~np.isfinite(values)
        if odd.any():
            k = int(np.argmax(odd))
            raise InputError(f"row {row + k + 1}: {name} is {float(values[k])!r}; allowed is a finite number")
        return np.array(values, dtype=np.float64)
    if isinstance(values, np.ndarray):
        values = values.tolist()
    numbers = np.empty(len(values))
    for k, value in enumerate(values):
        try:
            if angle_texts and isinstance(value, str):
                numbers[k] = angle_from_text(value)
            elif isinstance(value, (bool, list, dict)) or (isinstance(value, str) and not _is_plain(value)):
                numbers[k] = math.nan
            else:
                numbers[k] = float(value)
        except (TypeError, ValueError, OverflowError):
            numbers[k] = math.nan
        if not math.isfinite(numbers[k]):
            allowed = "a finite number" + (", or a text such as '3pi/8'" if angle_texts else "")
            told = "missing" if value is None else shown(value)
            raise InputError(f"row {row + k + 1}: {name} is {told}; allowed is {allowed}")
    return numbers


def _is_plain(text: str) -> bool:
    """Return whether a text may be a number: Python also reads 1_0, and the digits of other scripts."""
    return text.isascii() and "_" not in text


def _texts(name: str, values: Any, row: int) -> tuple[str, ...]:
    texts = values.tolist() if isinstance(values, np.ndarray) else list(values)
    texts = [text.strip() if isinstance(text, str) else text for text in texts]
    try:
        unknown = set(texts) - set(FAMILIES if name == "color" else ())
    except TypeError:  # a list or an object
        unknown = set()
    else:
        if not unknown:
            return tuple(texts)
    seen: set[str] = set()
    for k, text in enumerate(texts):
        if name == "color" and text not in FAMILIES:
            told = "missing" if text is None else shown(text)
            raise InputError(f"row {row + k + 1}: color is {told}; allowed are {_COLORS}")
        if name == "types" and not (isinstance(text, str) and text in seen):
            try:
                types_from_text(text)
            except InputError as error:
                raise InputError(f"row {row + k + 1}: {error}") from error
            seen.add(text)
    return tuple(texts)


def _from_json(text: str, plane_only: bool, joints: JointMap | None) -> Table:
    if text.count("[") + text.count("{") > _MOST_BRACKETS:  # they take twenty times the memory of the text, and more
        raise InputError(f"it has more than {_MOST_BRACKETS} lists and objects; {_JSON}")
    try:
        content = json.loads(text, parse_constant=_no_constant, object_pairs_hook=_object)
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
        names = list(content[0])
        for number, row in enumerate(content, start=1):
            if row.keys() != content[0].keys():
                raise InputError(f"row {number} has other fields than row 1; {_JSON}")
        return _table([(name, [row[name] for row in content]) for name in names], {}, plane_only, joints)
    if not isinstance(content, dict):
        raise InputError(f"it holds {shown(content)}; {_JSON}")
    if "path" in content:
        return _from_plan(content)
    about = content.get("about", {})
    columns = content.get("columns", content)
    if not isinstance(about, dict) or not isinstance(columns, dict):
        raise InputError(f"'about' or 'columns' is no object; {_JSON}")
    try:
        json.dumps(about, allow_nan=False)
    except (RecursionError, ValueError) as error:
        raise InputError(f"about: {shown(about)}; allowed are finite numbers and texts") from error
    if is_deep(about):
        raise InputError("about: it is nested too deeply; allowed is what made the table")
    lists = {name: values for name, values in columns.items() if isinstance(values, list)}
    if isinstance(columns.get("color"), str) and lists:
        lists["color"] = [columns["color"]] * len(next(iter(lists.values())))
    about, joints = _joints_of(about, joints)
    return _table(list(lists.items()), about, plane_only, joints)


_JSON = "allowed is an object of columns, a list of rows, or a plan"


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return a JSON object, or raise InputError if a name appears twice in it."""
    content = dict(pairs)
    if len(content) < len(pairs):
        name = next(name for name, count in Counter(name for name, _ in pairs).items() if count > 1)
        raise InputError(f"{shown(name)} appears twice; allowed is once")
    return content


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
    if about:
        about["request"] = request
    if "crossing_tolerance" in content:
        about["crossing_tolerance"] = content["crossing_tolerance"]
    return _table(columns, about, plane_only=False)


def table_from_columns(
    columns: list[tuple[str, Any]], about: dict[str, Any] | None = None, *, plane_only: bool = False
) -> Table:
    """Return a table of columns that somebody else made, checked and in order.

    Parameters
    ----------
    columns
        Names, each with an array or a list of values; angles in radians may be texts. Others than those of a gait table
        are passed over.
    about
        What made them.
    plane_only
        Whether alpha1 and alpha2 are enough.

    Raises
    ------
    InputError
        If a column is missing, or a value is not allowed.

    Examples
    --------
    >>> table_from_columns([("alpha2", ["-pi/8"]), ("alpha1", [0.5]), ("color", ["red"])]).columns["alpha2"].round(4)
    array([-0.3927])
    """
    made, joints = _joints_of(about or {}, None)
    return _table(columns, made, plane_only, joints)


def _table(
    columns: list[tuple[str, Any]], about: dict[str, Any], plane_only: bool, joints: JointMap | None = None
) -> Table:
    """Check columns and bring them into order."""
    header = _Header([name for name, _ in columns], plane_only, joints)
    if not _rows_of(columns):
        raise InputError("it has no rows; allowed is at least one")
    found = header.columns([values for _, values in columns], 0, angle_texts=True)
    if "t" in found:
        _check_times(found["t"], -math.inf, len(found["t"]))
    return Table(columns=found, about=about)


def _rows_of(columns: list[tuple[str, Any]]) -> int:
    """Return the number of rows that all columns have."""
    lengths = {len(values) for _, values in columns if values is not None}
    if len(lengths) > 1:
        raise InputError(f"columns have {min(lengths)} to {max(lengths)} rows; allowed are equally many")
    return max(lengths, default=0)
