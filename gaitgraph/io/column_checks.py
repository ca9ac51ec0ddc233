"""The columns of a table by name: which there must be, what each may hold, and how far its values may go.

Messages name the row, counted from 1 over the whole table, the column, the value and what is allowed.
"""

from __future__ import annotations

import math
from collections import Counter
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import HALF_PI, angle_from_text
from gaitgraph.errors import InputError, did_you_mean, shown
from gaitgraph.gait.table import ACCELERATIONS, ANGLES, DEGREES, ORDER, RATES, TEXTS, Table
from gaitgraph.io.servo_map import servo_map_from_mapping
from gaitgraph.io.servo_tables import check_joint_columns, tilts_from_joints
from gaitgraph.surface.adjacency import types_from_text
from gaitgraph.surface.sheets import FAMILIES

if TYPE_CHECKING:
    from gaitgraph.io.servo_map import ServoMap

FloatArray = npt.NDArray[np.float64]

_LARGEST = dict.fromkeys(ANGLES[:2], HALF_PI) | dict.fromkeys(ANGLES[2:], 1e6)  # beyond 1e6 a float carries no angle
_LARGEST |= dict.fromkeys(("R", *RATES, *ACCELERATIONS), 1e12)
_LONGEST_TIME, _SHORTEST_STEP = 1e9, 1e-9
_MOST_NAMED, _MOST_COMPARED = 5, 1000  # of other columns, in a message


class Header:
    """The names of a table's columns, checked; turns raw columns into those of a :class:`Table`.

    Parameters
    ----------
    names
        As they are in the file, in its order.
    plane_only
        Whether alpha1 and alpha2 are enough.
    joints
        What the columns of a servo table are; columns with the usual names of angles are then ignored.
    """

    def __init__(self, names: list[str], plane_only: bool, joints: ServoMap | None = None) -> None:
        self.names, self.joints = names, joints
        self.radians_per_unit = {joint.column: 1.0 / joint.per_radian for joint in joints.joints} if joints else {}
        for name, count in Counter(names).items():
            if count > 1:
                times = "twice" if count == 2 else f"{count} times"
                raise InputError(f"column {name!r} appears {times}; allowed is once")
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
                others = [other for other in names if other not in ORDER]
                there = ", ".join(map(shown, others[:_MOST_NAMED])) + (", …" if len(others) > _MOST_NAMED else "")
                hint = did_you_mean(name, others[:_MOST_COMPARED]) or (f"; there are {there}" if others else "")
                wanted = "alpha1 to alpha4 (rad) or alpha1_deg to alpha4_deg, or alpha1, alpha2 and color"
                raise InputError(f"column {name!r} is missing; allowed are {wanted}{hint}")

    def _dtype(self, name: str) -> str:
        """Return what numpy reads a column as; one that is ignored is read as one character."""
        if self.joints is not None and name in self.joints.columns:
            return "f8"
        if name in TEXTS:
            return "U8"
        return "f8" if name in ORDER or (name in DEGREES and self.joints is None) else "U1"

    def columns(self, raw: list[Any], row: int, *, angle_texts: bool = False) -> dict[str, Any]:
        """Return checked columns in order.

        Parameters
        ----------
        raw
            The values of each column: an array, a list, or None for what is no column of one value a row.
        row
            Rows of the table before these.
        angle_texts
            Whether texts such as "3pi/8" are angles, in radians.
        """
        found: dict[str, Any] = {}
        pairs = list(zip(self.names, raw, strict=True))
        if self.joints is not None:
            of_joints = {name: values for name, values in pairs if name in self.joints.columns}
            for name, values in of_joints.items():
                if values is None:
                    raise InputError(f"{name}: it is no column of numbers, one a row; allowed is one")
            numbers = {name: _numbers(name, values, row) for name, values in of_joints.items()}
            found |= tilts_from_joints(numbers, self.joints, rows_before=row)
            pairs = [pair for pair in pairs if pair[0] in ("color", "types", "R") and pair[0] not in of_joints]
        for name, values in pairs:
            if name in TEXTS:
                found[name] = _texts(name, values, row)
            elif name in DEGREES:
                found[DEGREES[name]] = np.radians(_numbers(name, values, row))
            elif name in ORDER:
                found[name] = _numbers(name, values, row, angle_texts=angle_texts and name in ANGLES)
        for name, largest in _LARGEST.items():
            beyond = np.abs(found.get(name, np.zeros(0))) > largest
            if beyond.any():
                k = int(np.argmax(beyond))
                which = f"{float(found[name][k])!r} rad" if largest == HALF_PI else repr(float(found[name][k]))
                limit = f"−π/2 to π/2 (±{HALF_PI!r})" if largest == HALF_PI else f"up to {largest:g}"
                raise InputError(f"row {row + k + 1}: {name} is {which}; allowed is {limit}")
        return {name: found[name] for name in ORDER if name in found}


def joints_of(about: dict[str, Any], joints: ServoMap | None) -> tuple[dict[str, Any], ServoMap | None]:
    """Return what made a file without its map of joints, and the map: as given, else as the file states it.

    What is read are tilt angles, so the map did not make them.
    """
    if "servos" not in about:
        return about, joints
    rest = {name: value for name, value in about.items() if name != "servos"}
    return rest, servo_map_from_mapping(about["servos"]) if joints is None else joints


def rows_of(columns: list[tuple[str, Any]]) -> int:
    """Return the number of rows that all columns have."""
    lengths = {len(values) for _, values in columns if values is not None}
    if len(lengths) > 1:
        raise InputError(f"columns have {min(lengths)} to {max(lengths)} rows; allowed are equally many")
    return max(lengths, default=0)


def table_from_columns(
    columns: list[tuple[str, Any]],
    about: dict[str, Any] | None = None,
    *,
    plane_only: bool = False,
    joints: ServoMap | None = None,
) -> Table:
    """Return a table of columns from elsewhere, checked and in order.

    Parameters
    ----------
    columns
        Names, each with an array or a list of values; angles in radians may be texts. Columns that a gait table does
        not have are ignored.
    about
        What made them.
    plane_only, joints
        As for :class:`Header`; a map of joints in `about` counts if none is given.

    Raises
    ------
    InputError
        If a column is missing, or a value is not allowed.

    Examples
    --------
    >>> table_from_columns([("alpha2", ["-pi/8"]), ("alpha1", [0.5]), ("color", ["red"])]).columns["alpha2"].round(4)
    array([-0.3927])
    """
    made, joints = joints_of(about or {}, joints)
    header = Header([name for name, _ in columns], plane_only, joints)
    if not rows_of(columns):
        raise InputError("it has no rows; allowed is at least one")
    found = header.columns([values for _, values in columns], 0, angle_texts=True)
    if "t" in found:
        check_times(found["t"], -math.inf, len(found["t"]))
    return Table(columns=found, about=made)


def _numbers(name: str, values: Any, row: int, *, angle_texts: bool = False) -> FloatArray:
    """Return the values of a column as finite numbers, in an array of their own."""
    if isinstance(values, np.ndarray) and values.dtype.kind == "f":
        numbers = np.array(values, dtype=np.float64)
    else:
        values = values.tolist() if isinstance(values, np.ndarray) else values
        plain = set(map(type, values)) <= {float}
        numbers = np.array(values if plain else [_number(value, angle_texts) for value in values], dtype=np.float64)
    odd = ~np.isfinite(numbers)
    if odd.any():
        k = int(np.argmax(odd))
        value = float(values[k]) if isinstance(values, np.ndarray) else values[k]
        allowed = "a finite number" + (", or a text such as '3pi/8'" if angle_texts else "")
        raise InputError(
            f"row {row + k + 1}: {name} is {'missing' if value is None else shown(value)}; allowed is {allowed}"
        )
    return numbers


def _number(value: Any, angle_texts: bool) -> float:
    """Return a number, or a text of one, as a float; NaN for what is none."""
    try:
        if isinstance(value, str):
            if angle_texts:
                return angle_from_text(value)
            # Python also reads 1_0, and the digits of other scripts.
            return float(value) if value.isascii() and "_" not in value else math.nan
        return math.nan if isinstance(value, (bool, list, dict)) else float(value)
    except (TypeError, ValueError, OverflowError):
        return math.nan


def _texts(name: str, values: Any, row: int) -> tuple[str, ...]:
    """Return the values of a column of colors or of plane types."""
    values = values.tolist() if isinstance(values, np.ndarray) else values
    texts = [text.strip() if isinstance(text, str) else text for text in values]
    try:
        distinct = list(dict.fromkeys(texts))
    except TypeError:  # a list or an object is among them
        distinct = texts
    for text in distinct:
        try:
            if name == "color" and text not in FAMILIES:
                which = "missing" if text is None else shown(text)
                raise InputError(f"color is {which}; allowed are {', '.join(map(repr, FAMILIES))}")
            if name == "types":
                types_from_text(text)
        except InputError as error:
            raise InputError(f"row {row + texts.index(text) + 1}: {error}") from error
    return tuple(texts)


def check_times(times: FloatArray, before: float, rows: int) -> None:
    """Raise InputError unless times increase; `rows` counts all rows up to the last one of these."""
    step = np.diff(times, prepend=before)
    for wrong, why in (
        (np.abs(times) > _LONGEST_TIME, f"; allowed are times up to {_LONGEST_TIME:g} s"),
        (step <= 0, " does not increase; allowed are increasing times"),
        (step < _SHORTEST_STEP, f" follows at once; allowed are steps of {_SHORTEST_STEP:g} s and more"),
    ):
        if wrong.any():
            k = int(np.argmax(wrong))
            raise InputError(f"row {rows - len(times) + k + 1}: t = {float(times[k])!r}{why}")
