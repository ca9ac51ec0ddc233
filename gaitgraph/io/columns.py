"""Gait tables of raw columns, from files and from frames: which columns there must be, and what each may hold.

Frames are those of pandas or polars, tables of pyarrow, and mappings of names to columns; none of these libraries is
needed. Messages name the column and the row, counted from 1.
"""

from __future__ import annotations

import json
import math
import re
import warnings
from collections import Counter
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitgraph.angles import (
    HALF_PI,
    angle_from_text,
    in_degrees,
    number_of,
)
from gaitgraph.arrays import check_unmasked
from gaitgraph.errors import FileWarning, InputError, did_you_mean, shown, wrong
from gaitgraph.gait.digits import FLOAT_32, Digits, digits_of
from gaitgraph.gait.given import is_frame
from gaitgraph.gait.table import (
    ACCELERATIONS,
    ANGLES,
    FORMAT,
    ORDER,
    RATES,
    TEXTS,
    THRUSTS,
    Table,
    about_from_text,
)
from gaitgraph.io.servo_map import (
    digits_from_joints,
    servo_map_from_mapping,
    tilts_from_joints,
)
from gaitgraph.surface.sheets import COLORS, types_from_text
from gaitgraph.timing.statement import checked

if TYPE_CHECKING:
    from collections.abc import Container, Iterable, Sequence

    from gaitgraph.gait.given import Frame
    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.io.servo_map import ServoMap

_LARGEST = dict.fromkeys(ANGLES[:2], HALF_PI) | dict.fromkeys(
    ANGLES[2:], 1e6
)  # beyond 1e6 a float carries no angle
_LARGEST |= dict.fromkeys(("R", *RATES, *ACCELERATIONS, *THRUSTS), 1e12)
_LARGEST |= {"t": 1e11}  # Unix time too
_SHORTEST_STEP = 1e-9
_TIMES = {"time": 1.0, "t_ms": 1e3, "time_ms": 1e3, "t_us": 1e6, "time_us": 1e6}
"""Other names of the column t, and their units in one second."""
_LIKELY_PERIOD = 60.0  # a longer one is probably in another unit [s]
_LIKELY_STEP = 10.0  # of time, in median steps
_BESIDE_JOINTS = ("color", "types", "R")
MADE_BY = "made_by"
_MOST_NAMED = 20  # of other columns, in a message


@dataclass(frozen=True, slots=True, kw_only=True)
class RawTable:
    """What a file holds: its columns, each as :func:`column_of` takes it, and what made them.

    With `angle_texts` texts such as "3pi/8" are angles [rad].
    """

    columns: Mapping[str, Any]
    about: dict[str, Any] = field(default_factory=dict)
    angle_texts: bool = False


def named_columns(names: Sequence[str], columns: Iterable[Any]) -> dict[str, Any]:
    """Return columns by their names; InputError if two have the same."""
    for name, count in Counter(names).most_common(1):
        if count > 1:
            raise wrong("columns", "must have different names", name, f" {count} times")
    return dict(zip(names, columns, strict=True))


@dataclass(frozen=True, slots=True, kw_only=True)
class Wanted:
    """Which columns are read.

    With `plane_only` alpha1 and alpha2 are enough. With `angles` the columns are t and these angles alone, which may
    have any size.
    """

    plane_only: bool = False
    angles: tuple[str, ...] = ()

    @property
    def order(self) -> tuple[str, ...]:
        """The columns of the table."""
        if self.angles:
            return ("t", *self.angles)
        return ORDER

    @property
    def other_names(self) -> dict[str, str]:
        """Other names of these, in other units."""
        names = dict.fromkeys(_TIMES, "t")
        for name in self.angles or ANGLES:
            names[f"{name}_deg"] = name
        return names

    @property
    def used(self) -> tuple[str, ...]:
        """All names of columns that are read."""
        return (*self.order, *self.other_names)


GAIT_COLUMNS = Wanted()


def table_of_columns(
    raw: RawTable,
    wanted: Wanted = GAIT_COLUMNS,
    *,
    joints: ServoMap | None = None,
    source: str | None = None,
) -> Table:
    """Return the table of raw columns, checked and in order; InputError if they are none of a gait.

    With `joints`, or a map that the columns state, they are those of a servo table. Notes on what is not used, or
    probably wrong, become warnings about the `source`, if that is given.
    """
    # What is read are tilt angles, so a map of joints did not make them.
    about = dict(raw.about)
    servos = about.pop("servos", None)
    if servos is not None and joints is None:
        joints = servo_map_from_mapping(servos)
    if joints is None:
        others = _check_names(list(raw.columns), wanted)
        used = _equally_long(raw.columns, wanted.used)
        digits: dict[str, Digits] = {}
    else:
        used, digits, others = _tilts_in(raw.columns, joints)
    notes = []
    if others:
        notes.append(f"columns not used: {others}")
    columns: dict[str, Any] = {}
    for name, values in used.items():
        meant = wanted.other_names.get(name, name)
        if name in TEXTS:
            columns[name] = _texts(name, values)
        else:
            as_texts = raw.angle_texts and name in (wanted.angles or ANGLES)
            stated = _numbers(name, values, angle_texts=as_texts)
            columns[meant], printed = _in_si(name, stated, values)
            digits.setdefault(meant, printed)
    _check_sizes(columns, wanted)
    if "t" in columns:
        notes += _notes_on_times(columns["t"], about)
    notes += _notes_on_rates(columns)
    if source:
        for note in notes:
            warnings.warn(f"{source}: {note}", FileWarning, stacklevel=4)
    columns = {name: columns[name] for name in wanted.order if name in columns}
    return Table(columns=columns, about=about, digits=digits, notes=tuple(notes))


def _tilts_in(
    raw: Mapping[str, Any], joints: ServoMap
) -> tuple[dict[str, Any], dict[str, Digits], str]:
    """Return the columns of a gait in those of joints and beside them, their digits, and a list of the others."""
    names = list(raw)
    beside: tuple[str, ...] = _BESIDE_JOINTS
    if joints.time not in names:
        beside += tuple(_TIMES)
    used = joints.columns + tuple(name for name in beside if name not in joints.columns)
    _check_one_name_each(names, beside, GAIT_COLUMNS)
    joints.check_columns(names)
    columns = _equally_long(raw, used)
    numbers = {}
    for name in joints.columns:
        if name in columns:
            numbers[name] = _numbers(name, columns.pop(name))
    columns = tilts_from_joints(numbers, joints) | columns
    return columns, digits_from_joints(numbers, joints), _others_in(names, used)


def _notes_on_rates(names: Container[str]) -> list[str]:
    """Return notes on rates, and accelerations, that are not there for all angles, or without times."""
    notes = []
    for kind in (RATES, ACCELERATIONS):
        stated = [name for name in kind if name in names]
        if stated and ("t" not in names or len(stated) < len(kind)):
            notes.append(
                f"columns not used: {', '.join(stated)}, which are used with t and for all four angles"
            )
    return notes


def _check_names(names: list[str], wanted: Wanted) -> str:
    """Raise InputError unless there are the columns that are wanted, each once; return a list of the others."""
    _check_one_name_each(names, wanted.used, wanted)
    others = _others_in(names, wanted.used)
    known = {wanted.other_names.get(name, name) for name in names}
    needed = wanted.angles or ANGLES
    columns = "alpha1 to alpha4 (rad) or alpha1_deg to alpha4_deg, or alpha1, alpha2 and color"
    if wanted.angles:
        columns = f"{', '.join(needed)} (rad), or these with _deg, one for each rotor that tilts"
    elif wanted.plane_only or ("color" in known and known.isdisjoint(ANGLES[2:])):
        needed = ANGLES[:2]
    for name in needed:
        if name not in known:
            if others:
                columns += f"; other columns are {others}"
            raise InputError(
                f"column {name!r} is missing; columns must be {columns}", field=name
            )
    return others


def _check_one_name_each(
    names: Sequence[str], used: Sequence[str], wanted: Wanted
) -> None:
    """Raise InputError if two of the columns that are used are the same one under two names."""
    first: dict[str, str] = {}
    for name in used:
        if name in names:
            meant = wanted.other_names.get(name, name)
            if meant in first:
                raise InputError(
                    f"columns must have {first[meant]!r} or {name!r}, got both",
                    field=name,
                )
            first[meant] = name


def _others_in(names: Sequence[str], used: Sequence[str]) -> str:
    """Return the names of columns that are not used for a message, each with the known name that it may mean."""
    others = [name for name in names if name not in used]
    missing = [name for name in used if name not in names]
    texts = []
    for name in others[:_MOST_NAMED]:
        hint = _hint(name, missing).removeprefix("; ")
        if hint:
            texts.append(f"{name!r} ({hint})")
        else:
            texts.append(shown(name))
    listed = ", ".join(texts)
    if len(others) > _MOST_NAMED:
        listed += f" and {len(others) - _MOST_NAMED} more"
    return listed


def _hint(name: str, known: list[str]) -> str:
    """Return the known name that another one may mean, for a message; of a time only one of the same unit."""
    plain = _plain_name(name)
    times = [one for one in known if one == "t" or one in _TIMES]
    hint = did_you_mean(plain, known)
    if plain not in times and hint and hint == did_you_mean(plain, times):
        return "a time is t in s, t_ms or t_us"
    return hint


def _plain_name(name: str) -> str:
    """Return the name that a person may have meant by "Alpha1", "α1", "a1", "alpha1 [rad]" or "t (ms)"."""
    name = re.sub(r"\s*[\[(](rad|s)[\])]$", "", name.strip().lower())
    name = re.sub(r"\s*[\[(](ms|us)[\])]$", r"_\1", name)
    name = re.sub(r"^(t|time)_s(ec(onds)?)?$", r"\1", name)
    return re.sub(r"^(α|a(lpha)?)[ _]?(?=[1-4])", "alpha", name)


def _equally_long(raw: Mapping[str, Any], used: Sequence[str]) -> dict[str, Any]:
    """Return the columns that are used, one text as often as there are rows; InputError unless all are as long."""
    columns = {name: column_of(name, raw[name]) for name in used if name in raw}
    lengths = {len(one) for one in columns.values() if not isinstance(one, str)}
    rows = max(lengths, default=0)
    if len(lengths) > 1:
        got = f"{min(lengths)} to {rows}"
        raise wrong("columns", "must have the same number of rows", lengths, got=got)
    if not rows:
        raise wrong("it", "must have at least one row", 0, got="none", field="columns")
    for name, values in columns.items():
        if isinstance(values, str):
            columns[name] = [values] * rows
    return columns


def _wrong_in_row(
    k: int, name: str, rule: str, value: object, hint: str = "", got: str = ""
) -> InputError:
    """Return the error that a value of a column breaks a rule, in a row counted from 0."""
    return wrong(
        f"row {k + 1}: {name}", rule, value, hint, got=got, field=name, row=k + 1
    )


def _in_si(name: str, numbers: FloatArray, values: Any) -> tuple[FloatArray, Digits]:
    """Return the numbers of a column in radians or seconds, and the digits that they were printed with."""
    if name in _TIMES:
        unit = 1.0 / _TIMES[name]
        return numbers / _TIMES[name], digits_of(numbers, unit)
    if name.endswith("_deg"):
        return np.radians(numbers), digits_of(numbers, math.radians(1.0))
    if getattr(values, "dtype", None) == np.float32:
        return numbers, FLOAT_32
    return numbers, digits_of(numbers)


def _check_sizes(columns: Mapping[str, Any], wanted: Wanted) -> None:
    """Raise InputError for the first number that no gait has."""
    largest_of = _LARGEST | dict.fromkeys(wanted.angles, 1e6)
    for name, largest in largest_of.items():
        beyond = np.abs(columns.get(name, np.zeros(0))) > largest
        if not beyond.any():
            continue
        k = int(np.argmax(beyond))
        limit, hint = f"±{largest:g}", ""
        if largest == HALF_PI:
            limit = f"±π/2 rad (±{HALF_PI!r})"
            if in_degrees(columns[name][k]):
                hint = f"; in degrees the column is {name}_deg"
        raise _wrong_in_row(
            k, name, f"must be within {limit}", float(columns[name][k]), hint
        )


def _notes_on_times(t: FloatArray, about: Mapping[str, Any]) -> list[str]:
    """Return notes on times that are probably in another unit, and on a gap; InputError unless times increase."""
    steps = np.diff(t)
    if (steps < _SHORTEST_STEP).any():
        k = int(np.argmax(steps < _SHORTEST_STEP)) + 1
        rule = f"must be at least {_SHORTEST_STEP:g} s after the row before"
        raise _wrong_in_row(k, "t", rule, float(t[k]))
    notes: list[str] = []
    if len(t) < 2 or "made_by" in about:  # a command's table has no such times
        return notes
    duration, stated = float(t[-1] - t[0]), number_of(about.get("period"))
    if duration > _LIKELY_PERIOD and not stated > _LIKELY_PERIOD:
        notes.append(
            f"row {len(t)} is {duration:.6g} s after row 1, more than a minute: is t in s? A column of ms is "
            "t_ms, one of µs is t_us"
        )
    k, usual = int(np.argmax(steps)), float(np.median(steps))
    if steps[k] > _LIKELY_STEP * usual:
        notes.append(
            f"row {k + 2} is {steps[k]:.6g} s after the row before, {steps[k] / usual:.3g} times the median "
            "step: are rows missing there, or is a time wrong?"
        )
    return notes


def checked_table(table: Table) -> Table:
    """Return a table as a reader leaves it, compared with what it states; InputError if no file could have held it."""
    if table.motion is not None:
        return table
    raw = RawTable(columns=table.columns, about=table.about, angle_texts=True)
    whole = table_of_columns(raw)
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
        if given is values or values.ndim:
            got = f"{values.dtype} of shape {values.shape}"
        else:
            got = ""
    except (TypeError, ValueError):
        got = ""
    raise wrong(name, "must be a column of numbers or of texts", given, got=got)


def _numbers(name: str, values: Any, *, angle_texts: bool = False) -> FloatArray:
    """Return the values of a column as finite numbers, in an array of their own."""
    if isinstance(values, np.ndarray):
        numbers = values.astype(np.float64)
    else:
        numbers = np.array(_floats(values, angle_texts), dtype=np.float64)
    odd = ~np.isfinite(numbers)
    if odd.any():
        k = int(np.argmax(odd))
        value = values[k]
        if isinstance(values, np.ndarray):
            value = float(value)
        raise _no_number(name, value, k, angle_texts=angle_texts)
    return numbers


def _floats(values: Sequence[Any], angle_texts: bool) -> Sequence[float]:
    """Return the values of a list, and texts of numbers, as floats; NaN for anything else."""
    kinds = set(map(type, values))
    if kinds == {float}:
        return values
    if kinds == {str} and not angle_texts and _is_plain("".join(values)):
        with suppress(ValueError):  # one of the texts is no number
            return list(map(float, values))
    return [_number(value, angle_texts) for value in values]


def _number(value: Any, angle_texts: bool) -> float:
    """Return a number, or a text of one, as a float; NaN for anything else."""
    try:
        if isinstance(value, str) and angle_texts:
            return angle_from_text(value)
        if isinstance(value, str) and not _is_plain(value):
            return math.nan
        if isinstance(value, (bool, list, dict, np.ndarray)):
            return math.nan
        return float(value)
    except (TypeError, ValueError, OverflowError):
        return math.nan


def _no_number(name: str, value: object, k: int, *, angle_texts: bool) -> InputError:
    """Return the error that a value of a column is no finite number."""
    rule = "must be a finite number"
    got = hint = ""
    if angle_texts:
        rule += ", or a text such as '3pi/8'"
    if value is None:
        got = "no value"
    elif name in ANGLES and str(value).rstrip().endswith(("deg", "°")):
        hint = f"; in degrees the column is {name}_deg"
    return _wrong_in_row(k, name, rule, value, hint, got)


def _is_plain(text: str) -> bool:
    """Return whether a text may be a number: Python also reads 1_0, and the digits of other scripts."""
    return text.isascii() and "_" not in text


def _texts(name: str, values: Any) -> tuple[str, ...]:
    """Return the values of a column of colors or of plane types."""
    texts = []
    known = set()
    for k, value in enumerate(values):
        text = value.strip() if isinstance(value, str) else shown(value)
        if text not in known:
            known.add(text)
            _check_text(name, text, value, k)
        texts.append(text)
    return tuple(texts)


def _check_text(name: str, text: str, value: object, k: int) -> None:
    """Raise InputError unless a text is a color, or plane types."""
    if name == "types":
        try:
            types_from_text(text)
        except InputError as error:
            raise InputError(
                f"row {k + 1}: {error}", field=name, row=k + 1, value=error.value
            ) from error
    elif text not in COLORS:
        got = "no value" if value is None else ""
        colors = ", ".join(map(repr, COLORS))
        raise _wrong_in_row(k, name, f"must be one of {colors}", value, got=got)


# -- Frames


def table_from_frame(frame: Frame) -> Table:
    """Return the gait table in a frame of pandas or polars, a table of pyarrow, or a mapping of names to arrays.

    Columns are as in a file: alpha1 to alpha4 (rad), or alpha1, alpha2 and color; a warning lists others. An index of
    pandas that is named as a column of time, `t` or `time_ms` say, counts as that column. The table states what made it
    if `attrs` does, as :meth:`Table.to_pandas` and `pandas.read_parquet` leave it.

    >>> table = table_from_frame({"alpha1": [0.4, 0.8], "alpha2": [-0.4, -0.8], "color": ["red", "red"]})
    >>> len(table), list(table.columns)
    (2, ['alpha1', 'alpha2', 'color'])
    """
    if not is_frame(frame):
        raise wrong(
            "frame",
            "must be a frame of pandas or polars, or a mapping of columns",
            frame,
        )
    columns = _columns_of(frame)
    stated = getattr(frame, "attrs", {}).get("gaitgraph")
    # What states nothing may be a CSV file of ours that pandas or polars has read.
    about = taken_about(columns) if stated is None else _about_of_attributes(stated)
    raw = RawTable(columns=columns, about=about, angle_texts=True)
    return checked(table_of_columns(raw, source="frame"))


def _columns_of(frame: Frame) -> dict[str, Any]:
    """Return the columns of a frame by name; of pandas also an index of times."""
    names: Iterable[Any]
    if isinstance(frame, Mapping):
        names = frame
    else:
        names = getattr(frame, "column_names", None) or frame.columns
    texts = [name for name in names if isinstance(name, str)]
    columns = named_columns(texts, (frame[name] for name in texts))
    index = getattr(frame, "index", None)
    time = getattr(index, "name", None)
    if time in ("t", *_TIMES) and {"t", *_TIMES}.isdisjoint(columns):
        columns[time] = index
    return columns


def _about_of_attributes(stated: object) -> dict[str, Any]:
    """Return what made a frame, as its `attrs` state it."""
    try:
        return about_from_text(json.dumps(stated, allow_nan=False))
    except (RecursionError, TypeError, ValueError) as error:
        raise wrong("attrs", "must be as gaitgraph left them", stated) from error


def taken_about(columns: dict[str, Any]) -> dict[str, Any]:
    """Take the column `made_by` out of columns, if it is ours, and return what its one text states; else nothing.

    InputError if the column is empty: the row with the text is missing, and with it limits, vehicle or its constants.
    """
    if MADE_BY not in columns:
        return {}
    texts = (text for text in columns[MADE_BY] if isinstance(text, str) and text)
    text = next(texts, None)
    if text is None:
        raise InputError(
            f"the row is missing whose text in {MADE_BY} states the vehicle or the motion; without this column the rows "
            "are a table of their own",
            field=MADE_BY,
        )
    if FORMAT not in text:
        return {}
    del columns[MADE_BY]
    return about_from_text(text)
