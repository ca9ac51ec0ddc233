"""Gait tables of raw columns, from files and from frames: which columns there must be, and what each may hold.

Frames are those of pandas or polars, tables of pyarrow, and mappings of names to columns. They are recognised by their
`columns` (pyarrow: `column_names`); none of these libraries is needed. Messages name the column and the row, counted
from 1 over the whole table.
"""

from __future__ import annotations

import json
import math
import re
import warnings
from collections import Counter
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitgraph.angles import (
    HALF_PI,
    angle_from_text,
    in_degrees,
    number_of,
)
from gaitgraph.arrays import check_unmasked
from gaitgraph.errors import FileWarning, InputError, did_you_mean, shown
from gaitgraph.files import pass_interruption
from gaitgraph.gait.digits import FLOAT_32, Digits, digits_of
from gaitgraph.gait.given import is_frame
from gaitgraph.gait.table import (
    ACCELERATIONS,
    ANGLES,
    FORMAT,
    ORDER,
    RATES,
    TEXTS,
    Table,
    about_from_text,
    checked_about,
)
from gaitgraph.io.servo_map import (
    digits_from_joints,
    servo_map_from_mapping,
    tilts_from_joints,
)
from gaitgraph.surface.sheets import COLORS, types_from_text
from gaitgraph.timing.statement import checked
from gaitgraph.vehicle import vehicle_in_gait_file

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from gaitgraph.gait.given import Frame
    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.io.servo_map import ServoMap

_LARGEST = dict.fromkeys(ANGLES[:2], HALF_PI) | dict.fromkeys(
    ANGLES[2:], 1e6
)  # beyond 1e6 a float carries no angle
_LARGEST |= dict.fromkeys(("R", *RATES, *ACCELERATIONS), 1e12) | {"t": 1e9}
_SHORTEST_STEP = 1e-9
_TIMES = {"time": 1.0, "t_ms": 1e3, "time_ms": 1e3, "t_us": 1e6, "time_us": 1e6}
"""Other names of the column t, and their units in one second."""
_UNITS_OF_TIME = "a time is t in s, t_ms or t_us"
_LIKELY_PERIOD = 60.0  # a longer one is probably in another unit [s]
_LIKELY_STEP = 10.0  # of time, in median steps
_BESIDE_JOINTS = ("color", "types", "R")
MADE_BY = "made_by"
SHARED = (
    "vehicle",
    "coefficients",
    "period",
    "law",
)  # of a request and its table, stated once where they agree
_TEXT = re.compile(r"\s*([\w.-]+) = ")
_MOST_NAMED, _MOST_COMPARED = 20, 1000  # of other columns, in a message


class TableBuilder:
    """Checks the names of a table's columns, and then makes a table of raw columns.

    With `plane_only` alpha1 and alpha2 are enough. With `joints` the columns are those of a servo table. With `angles`
    they are t and these angles alone, which may have any size. `tell` is called with each warning when it arises.
    """

    def __init__(
        self,
        *,
        plane_only: bool = False,
        joints: ServoMap | None = None,
        angles: tuple[str, ...] = (),
        tell: Callable[[str], None] | None = None,
    ) -> None:
        self.plane_only, self.joints, self.angles = plane_only, joints, angles
        self._tell = tell
        self._order = ("t", *angles) if angles else ORDER
        self._other_names = {f"{name}_deg": name for name in angles or ANGLES}
        self._other_names |= dict.fromkeys(_TIMES, "t")
        self.about: dict[str, Any] = {}
        self.names: Sequence[str] = ()
        self.notes: tuple[str, ...] = ()

    def begin(self, names: Sequence[str], about: dict[str, Any]) -> None:
        """Check the names of all columns of a file; `about`, what made it, may hold a map of joints."""
        self.names = names
        # What is read are tilt angles, so the map did not make them.
        self.about = {name: value for name, value in about.items() if name != "servos"}
        if self.joints is None and "servos" in about:
            self.joints = servo_map_from_mapping(about["servos"])
        for name, count in Counter(names).most_common(1):
            if count > 1:
                raise InputError(
                    f"columns must have different names, got {name!r} {count} times"
                )
        used = self.used
        others = [name for name in names if name not in used]
        self._check_one_name_each()
        if self.joints is not None:
            self.joints.check_columns(list(names))
        else:
            known = {self._other_names.get(name, name) for name in names}
            lifted = self.plane_only or (
                "color" in known and known.isdisjoint(ANGLES[2:])
            )
            for name in self.angles or (ANGLES[:2] if lifted else ANGLES):
                if name not in known:
                    wanted = "alpha1 to alpha4 (rad) or alpha1_deg to alpha4_deg, or alpha1, alpha2 and color"
                    if self.angles:
                        wanted = f"{', '.join(self.angles)} (rad), or these with _deg, one for each rotor that tilts"
                    there = (
                        f"; other columns are {self._listed(others)}" if others else ""
                    )
                    raise InputError(
                        f"column {name!r} is missing; columns must be {wanted}{there}"
                    )
        if others:
            self._note(f"columns not used: {self._listed(others)}")

    def _note(self, note: str) -> None:
        self.notes = (*self.notes, note)
        if self._tell is not None:
            self._tell(note)

    def _check_one_name_each(self) -> None:
        """Raise InputError if two columns are the same one under two names."""
        first: dict[str, str] = {}
        joints = () if self.joints is None else self.joints.columns
        for name in self.used:
            if name in self.names and name not in joints:
                meant = self._other_names.get(name, name)
                if meant in first:
                    raise InputError(
                        f"columns must have {first[meant]!r} or {name!r}, got both"
                    )
                first[meant] = name

    def _listed(self, names: Sequence[str]) -> str:
        """Return names of columns for a message, first those that resemble a known one, with a hint."""
        near = {name: self._hint(name) for name in names[:_MOST_COMPARED]}
        texts = [
            f"{name!r} ({hint.removeprefix('; ')})"
            for name, hint in near.items()
            if hint
        ]
        texts += [shown(name) for name in names if not near.get(name)]
        more = len(texts) - _MOST_NAMED
        return ", ".join(texts[:_MOST_NAMED]) + (
            f" and {more} more" if more > 0 else ""
        )

    def _hint(self, name: str) -> str:
        """Return the known name that another one may mean, for a message; of a time only one of the same unit."""
        plain = _plain_name(name)
        known = [one for one in self.used if one not in self.names]
        times = [one for one in known if one == "t" or one in _TIMES]
        hint = did_you_mean(plain, known)
        if plain not in times and hint and hint == did_you_mean(plain, times):
            return _UNITS_OF_TIME
        return hint

    @property
    def used(self) -> tuple[str, ...]:
        """Names of the columns that are read; others are listed in a warning."""
        if self.joints is None:
            return (*self._order, *self._other_names)
        joints = self.joints.columns
        if self.joints.time in self.names:
            return (*joints, *_BESIDE_JOINTS)
        times = [name for name in _TIMES if name not in joints]
        return (*joints, *times, *_BESIDE_JOINTS)

    def table(self, raw: Mapping[str, Any], *, angle_texts: bool = False) -> Table:
        """Return the table of raw columns, checked and in order; InputError if they have no rows.

        Columns are what :func:`column_of` takes. With `angle_texts` texts such as "3pi/8" are angles, in radians.
        """
        used = {name: column_of(name, raw[name]) for name in self.used if name in raw}
        lengths = {
            len(values) for values in used.values() if not isinstance(values, str)
        } or {0}
        if len(lengths) > 1:
            raise InputError(
                f"columns must have equally many rows, got {min(lengths)} to {max(lengths)}"
            )
        if lengths == {0}:
            raise InputError("it must have at least one row, got none")
        used = {
            name: values if not isinstance(values, str) else [values] * max(lengths)
            for name, values in used.items()
        }
        found: dict[str, Any] = {}
        digits: dict[str, Digits] = {}
        if self.joints is not None:
            numbers = {
                name: _numbers(name, used.pop(name))
                for name in self.joints.columns
                if name in used
            }
            found |= tilts_from_joints(numbers, self.joints)
            digits |= digits_from_joints(numbers, self.joints)
        for name, values in used.items():
            if name in TEXTS:
                found[name] = _texts(name, values)
            elif name in _TIMES:
                times = _numbers(name, values)
                found["t"] = times / _TIMES[name]
                digits["t"] = digits_of(times, 1.0 / _TIMES[name])
            elif name.endswith("_deg"):
                degrees = _numbers(name, values)
                found[self._other_names[name]] = np.radians(degrees)
                digits[self._other_names[name]] = digits_of(degrees, math.radians(1.0))
            else:
                as_texts = angle_texts and name in (self.angles or ANGLES)
                numbers_of_column = _numbers(name, values, angle_texts=as_texts)
                found[self._other_names.get(name, name)] = numbers_of_column
                digits[self._other_names.get(name, name)] = (
                    FLOAT_32
                    if getattr(values, "dtype", None) == np.float32
                    else digits_of(numbers_of_column)
                )
        for name, largest in (_LARGEST | dict.fromkeys(self.angles, 1e6)).items():
            beyond = np.abs(found.get(name, np.zeros(0))) > largest
            if beyond.any():
                k = int(np.argmax(beyond))
                limit = (
                    f"±π/2 rad (±{HALF_PI!r})"
                    if largest == HALF_PI
                    else f"±{largest:g}"
                )
                hint = (
                    largest == HALF_PI
                    and in_degrees(found[name][k])
                    and f"; in degrees the column is {name}_deg"
                )
                got = f"{float(found[name][k])!r}{hint or ''}"
                raise InputError(
                    f"row {k + 1}: {name} must be within {limit}, got {got}"
                )
        if "t" in found:
            self._check_times(found["t"])
        columns = {name: found[name] for name in self._order if name in found}
        return Table(columns=columns, about=self.about, digits=digits, notes=self.notes)

    def whole(self, columns: Mapping[str, Any], about: dict[str, Any]) -> Table:
        """Return the table of all columns, where angles may be texts."""
        self.begin(list(columns), about)
        return self.table(columns, angle_texts=True)

    def _check_times(self, t: FloatArray) -> None:
        """Raise InputError unless times increase; note those that are probably in another unit, and a gap."""
        steps = np.diff(t)
        if (steps < _SHORTEST_STEP).any():
            k = int(np.argmax(steps < _SHORTEST_STEP)) + 1
            wanted = f"t must be at least {_SHORTEST_STEP:g} s after the row before"
            got = float(t[k])
            raise InputError(f"row {k + 1}: {wanted}, got {got!r}", field="t")
        if len(t) < 2 or "made_by" in self.about:  # a command's table has no such times
            return
        duration, stated = float(t[-1] - t[0]), number_of(self.about.get("period"))
        if duration > _LIKELY_PERIOD and not stated > _LIKELY_PERIOD:
            self._note(
                f"row {len(t)} is {duration:.6g} s after row 1, more than a minute: is t in s? A column of ms is "
                "t_ms, one of µs is t_us"
            )
        k, usual = int(np.argmax(steps)), float(np.median(steps))
        if steps[k] > _LIKELY_STEP * usual:
            self._note(
                f"row {k + 2} is {steps[k]:.6g} s after the row before, {steps[k] / usual:.3g} times the median "
                "step: are rows missing there, or is a time wrong?"
            )


def checked_table(table: Table) -> Table:
    """Return a table as a reader leaves it, compared with what it states; InputError if no file could have held it."""
    if table.motion is not None:
        return table
    whole = TableBuilder().whole(table.columns, table.about)
    digits = whole.digits | table.digits
    return checked(replace(whole, digits=digits, notes=table.notes))


def column_of(name: str, given: Any) -> Any:
    """Return a column of a file or a frame as an array of numbers, a list, or one text, which holds for all rows.

    Raises InputError if it is neither numbers nor texts, or not one-dimensional.
    """
    check_unmasked(given, name)
    if isinstance(given, (list, tuple, str)):
        return given
    try:
        values = np.asarray(given)
        kind, size = values.dtype.kind, max(values.shape, default=1)
        # Arrays of objects are columns of pandas, where they have one dimension, or cells of MATLAB.
        if (
            kind in "fiuUSTO"
            and values.size == size
            and (kind != "O" or values.ndim == 1)
        ):
            flat = values.reshape(-1)
            if kind in "fiu":
                return flat
            texts = (flat.astype(np.str_) if kind == "S" else flat).tolist()
            return texts if kind == "O" or len(texts) != 1 else texts[0]
        got = (
            f"{values.dtype} of shape {values.shape}"
            if given is values or values.ndim
            else shown(given)
        )
    except (TypeError, ValueError) as error:
        pass_interruption(error)
        got = shown(given)
    raise InputError(f"{name} must be a column of numbers or of texts, got {got}")


def _numbers(name: str, values: Any, *, angle_texts: bool = False) -> FloatArray:
    """Return the values of a column as finite numbers, in an array of their own."""
    if isinstance(values, np.ndarray):
        numbers = np.array(values, dtype=np.float64)
    else:
        kinds = set(map(type, values))
        try:
            plain = kinds <= {float} or (
                kinds == {str} and not angle_texts and _is_plain("".join(values))
            )
            numbers = np.array(
                values if plain else [_number(value, angle_texts) for value in values],
                dtype=np.float64,
            )
        except ValueError:  # one of many plain texts is no number
            numbers = np.array([_number(value, angle_texts) for value in values])
    odd = ~np.isfinite(numbers)
    if odd.any():
        k = int(np.argmax(odd))
        value = float(values[k]) if isinstance(values, np.ndarray) else values[k]
        allowed = "a finite number" + (
            ", or a text such as '3pi/8'" if angle_texts else ""
        )
        got = "no value" if value is None else shown(value)
        hint = f"; in degrees the column is {name}_deg" * (
            name in ANGLES
            and isinstance(value, str)
            and value.rstrip().endswith(("deg", "°"))
        )
        raise InputError(f"row {k + 1}: {name} must be {allowed}, got {got}{hint}")
    return numbers


def _number(value: Any, angle_texts: bool) -> float:
    """Return a number, or a text of one, as a float; NaN for anything else."""
    try:
        if isinstance(value, str):
            return (
                angle_from_text(value)
                if angle_texts
                else float(value)
                if _is_plain(value)
                else math.nan
            )
        return (
            math.nan
            if isinstance(value, (bool, list, dict, np.ndarray))
            else float(value)
        )
    except (TypeError, ValueError, OverflowError):
        return math.nan


def _plain_name(name: str) -> str:
    """Return the name that a person may have meant by "Alpha1", "α1", "a1", "alpha1 [rad]" or "t (ms)"."""
    name = re.sub(r"\s*[\[(](rad|s)[\])]$", "", name.strip().lower())
    name = re.sub(r"\s*[\[(](ms|us)[\])]$", r"_\1", name)
    name = re.sub(r"^(t|time)_s(ec(onds)?)?$", r"\1", name)
    return re.sub(r"^(α|a(lpha)?)[ _]?(?=[1-4])", "alpha", name)


def _is_plain(text: str) -> bool:
    """Return whether a text may be a number: Python also reads 1_0, and the digits of other scripts."""
    return text.isascii() and "_" not in text


def _texts(name: str, values: Any) -> tuple[str, ...]:
    """Return the values of a column of colors or of plane types."""
    values = values.tolist() if isinstance(values, np.ndarray) else values
    texts = [text.strip() if isinstance(text, str) else shown(text) for text in values]
    for text in dict.fromkeys(texts):
        try:
            if name == "types":
                types_from_text(text)
            elif text not in COLORS:
                got = (
                    "no value"
                    if (found := values[texts.index(text)]) is None
                    else shown(found)
                )
                raise InputError(
                    f"color must be one of {', '.join(map(repr, COLORS))}, got {got}",
                    field="color",
                )
        except InputError as error:
            raise InputError(f"row {texts.index(text) + 1}: {error}") from error
    return tuple(texts)


# -- Frames


def table_from_frame(frame: Frame) -> Table:
    """Return the gait table in a frame of pandas or polars, a table of pyarrow, or a mapping of names to arrays.

    Columns are as in a file: alpha1 to alpha4 (rad), or alpha1, alpha2 and color; a warning lists others. An index of
    pandas that is named as a column of time, `t` or `time_ms` say, counts as that column. The table states what made it if `attrs` does, as
    :meth:`Table.to_pandas` and `pandas.read_parquet` leave it.

    >>> table = table_from_frame({"alpha1": [0.4, 0.8], "alpha2": [-0.4, -0.8], "color": ["red", "red"]})
    >>> len(table), list(table.columns)
    (2, ['alpha1', 'alpha2', 'color'])
    """
    if not is_frame(frame):
        raise InputError(
            f"frame must be a frame of pandas or polars, or a mapping of columns, got {shown(frame)}"
        )
    if hasattr(type(frame), "collect"):
        raise InputError(
            f"frame must have its rows there, got a {type(frame).__name__}: collect() it first"
        )
    given = (
        frame
        if isinstance(frame, Mapping)
        else getattr(frame, "column_names", None) or frame.columns
    )
    names = [name for name in given if isinstance(name, str)]
    attributes = getattr(frame, "attrs", None)
    stated = attributes.get("gaitgraph") if isinstance(attributes, dict) else None
    try:
        about = about_from_text(json.dumps(stated, allow_nan=False))
    except (RecursionError, TypeError, ValueError) as error:
        raise InputError(
            f"attrs must be as gaitgraph left them, got {shown(stated)}"
        ) from error
    texts = (
        [text for text in frame[MADE_BY] if isinstance(text, str) and text]
        if MADE_BY in names
        else []
    )
    if stated is None and MADE_BY in names and all(map(states_making, texts[:1])):
        # a CSV file of ours that pandas or polars has read
        names.remove(MADE_BY)
        about = about_from_texts(texts)
    index = getattr(frame, "index", None)
    columns = {name: frame[name] for name in names}
    time = getattr(index, "name", None)
    if time in ("t", *_TIMES) and {"t", *_TIMES}.isdisjoint(names):
        names.append(time)
        columns[time] = index
    builder = TableBuilder(
        tell=lambda note: warnings.warn(f"frame: {note}", FileWarning, stacklevel=5)
    )
    builder.begin(names, about)
    return checked(builder.table(columns, angle_texts=True))


def states_making(text: str) -> bool:
    """Return whether a text of the column `made_by` is one of ours."""
    return FORMAT in text or bool(_TEXT.match(text))


def about_from_texts(texts: list[str]) -> dict[str, Any]:
    """Return what made a table, as the column `made_by` states it: one JSON text, or short texts.

    The first of the short texts says how many there are. InputError if rows with others are missing: without them
    limits, the vehicle or its constants are lost.
    """
    whole, at, about = "; ".join(texts), 0, dict[str, Any]()
    if whole.startswith("{"):
        return about_from_text(texts[0])
    count = 0
    with suppress(AttributeError, RecursionError, TypeError, ValueError):
        while match := _TEXT.match(whole, at):
            *groups, last = match[1].split(".")
            inner = about
            for group in groups:
                inner = inner.setdefault(group, {})
            inner[last], end = json.JSONDecoder().raw_decode(whole, match.end())
            at = end + whole.startswith(";", end)
            count += 1
    if at < len(whole):
        raise InputError(
            f"{MADE_BY} must hold texts such as 'law = \"smooth\"', got {shown(whole[at:].strip())}"
        )
    if about.pop("format", None) != FORMAT or about.pop("texts", count) != count:
        raise InputError(
            f"rows are missing whose texts in {MADE_BY} state the vehicle or the motion; without this column the rows "
            "are a table of their own"
        )
    about = {
        name: one
        for name, one in _lists(checked_about(about)).items()
        if name != "version"
    }
    if isinstance(about.get("vehicle"), dict):
        about["vehicle"] = vehicle_in_gait_file(about["vehicle"]).as_mapping()
    if isinstance(about.get("request"), dict):
        about["request"] = {
            name: about[name] for name in SHARED if name in about
        } | about["request"]
    return about


def _lists(values: dict[str, Any]) -> Any:
    """Return values with lists in place of what has numbers for names."""
    inner = {
        name: _lists(value) if isinstance(value, dict) else value
        for name, value in values.items()
    }
    is_list = inner and [*inner] == [str(number) for number in range(1, len(inner) + 1)]
    return [*inner.values()] if is_list else inner
