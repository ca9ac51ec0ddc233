"""Servo maps: from the tilt angles of a gait to four joints with an order, signs, zeros, limits and units, and back.

A joint turns one rotor about its arm. It is at q = sign·α + zero [rad] when the rotor is tilted by α, and its column
states q in radians, in degrees, or as the pulse width neutral + (µs per radian)·q that a servo takes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import HALF_PI, angle_from_text, number_of
from gaitgraph.errors import InputError, check_fields, did_you_mean, shown
from gaitgraph.files import from_toml_file
from gaitgraph.gait.table import ACCELERATIONS, ANGLES, RATES, TEXTS, Table, setting_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from gaitgraph.vehicle import Vehicle

FloatArray = npt.NDArray[np.float64]

_TIME_UNITS = {"s": 1.0, "ms": 1e3, "us": 1e6}
"""Units of time in one second."""

_UNITS = {"rad": ("", "rad"), "deg": ("_deg", "°"), "us": ("_us", "µs")}
"""How columns in a unit end by default, and the unit's sign."""

_DERIVATIVES = {"_rate": RATES, "_acceleration": ACCELERATIONS}
_OF_PULSES = ("us_per_rad", "neutral_us", "limits_us")
_NAME = "a printable text of 1 to 64 characters"
_ROUNDING = 1e-9
"""Relative to a limit: what floating point may add to a value that was stated as the limit."""

# Motors 1 to 4 of an X frame, each given as the gait's rotor when rotor 1 is at the front left (first arm at +45°,
# clockwise) or at the front right (−45°, counter-clockwise); rotors follow counter-clockwise seen from above.
_CLOCKWISE: dict[str, Any] = {"first_rotor_spin": "clockwise", "first_arm_angle": math.pi / 4}
_COUNTERCLOCKWISE: dict[str, Any] = {"first_rotor_spin": "counterclockwise", "first_arm_angle": -math.pi / 4}
PRESETS: dict[str, tuple[str, tuple[int, ...], dict[str, Any]]] = {
    "paper": ("alpha", (1, 2, 3, 4), {}),
    "x_frame": ("tilt", (4, 2, 1, 3), _CLOCKWISE),
    "x_frame_counterclockwise": ("tilt", (1, 3, 2, 4), _COUNTERCLOCKWISE),
    "betaflight": ("tilt", (3, 4, 2, 1), _CLOCKWISE),
    "betaflight_counterclockwise": ("tilt", (4, 1, 3, 2), _COUNTERCLOCKWISE),
}
"""Maps that come with the package: how joints are called, the rotor of each, and the vehicle that this is for."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Joint:
    """One joint: which rotor it turns and how, as :func:`servo_map_from_mapping` makes it.

    Parameters
    ----------
    name, column
        What the vehicle calls it, and its column in tables.
    rotor
        Which of the gait's rotors it turns, 1 to 4.
    unit
        "rad", "deg" or "us" (pulse width, µs).
    sign, zero
        1 if it turns as α does, right-handed about the arm's outward axis, else −1; its angle q at α = 0 [rad].
    limits
        Least and largest angle q [rad], for the units rad and deg; None for no limits.
    us_per_rad, neutral_us, limits_us
        For the unit us: pulse width per angle [µs/rad], at q = 0 [µs], and the least and the largest [µs].
    """

    name: str
    rotor: int
    column: str
    unit: Literal["rad", "deg", "us"] = "rad"
    sign: int = 1
    zero: float = 0.0
    limits: tuple[float, float] | None = None
    us_per_rad: float | None = None
    neutral_us: float = 1500.0
    limits_us: tuple[float, float] = (1000.0, 2000.0)

    @property
    def per_radian(self) -> float:
        """Units of the column in one radian."""
        return {"rad": 1.0, "deg": math.degrees(1.0), "us": self.us_per_rad or 0.0}[self.unit]

    @property
    def bounds(self) -> tuple[float, float]:
        """The least and the largest value of its column, in its unit; infinite where there is no limit."""
        if self.unit == "us":
            return self.limits_us
        low, high = self.limits or (-math.inf, math.inf)
        return (math.degrees(low), math.degrees(high)) if self.unit == "deg" else (low, high)

    def value_of(self, tilt: Any) -> Any:
        """Return the values of the column, in its unit, at tilt angles α [rad], whatever the limits."""
        return (self.neutral_us if self.unit == "us" else 0.0) + self.per_radian * (self.sign * tilt + self.zero)

    def angle_of(self, value: Any) -> Any:
        """Return the joint's angle q [rad] of values of the column."""
        if self.unit == "us":
            return (value - self.neutral_us) / self.per_radian
        return np.radians(value) if self.unit == "deg" else value

    def tilt_of(self, value: Any) -> Any:
        """Return the tilt angle α [rad] of values of the column: the inverse of :meth:`value_of`."""
        return self.sign * (self.angle_of(value) - self.zero)

    def is_beyond(self, values: FloatArray) -> npt.NDArray[np.bool_]:
        """Return which values of the column exceed the limits by more than rounding."""
        low, high = self.bounds
        near = _ROUNDING * np.maximum(1.0, np.abs(values))
        return (values < low - near) | (values > high + near)

    def as_mapping(self) -> dict[str, Any]:
        """Return the fields that its unit has, as plain values."""
        return _stated(self, without=("limits",) if self.unit == "us" else _OF_PULSES)


@dataclass(frozen=True, slots=True, kw_only=True)
class ServoMap:
    """Four joints, one on each rotor, and the time beside them; see :func:`servo_map_from_mapping`.

    Parameters
    ----------
    name, joints
        What messages call the map; its joints in the order of the table's columns.
    time, time_unit
        The column of time, and "s", "ms" or "us".
    clip
        Whether values beyond a joint's limits are set to the limit; otherwise they are errors.
    first_rotor_spin, first_arm_angle
        The vehicle that the order of rotors is meant for, as :class:`~gaitgraph.vehicle.Vehicle` has them [rad]; None
        if it fits any.

    Examples
    --------
    >>> [joint.rotor for joint in servo_map_named("x_frame").joints]
    [4, 2, 1, 3]
    """

    name: str
    joints: tuple[Joint, ...]
    time: str = "t"
    time_unit: str = "s"
    clip: bool = False
    first_rotor_spin: str | None = None
    first_arm_angle: float | None = None

    @property
    def columns(self) -> tuple[str, ...]:
        """Columns of a table: time, joints, then rates and accelerations of joints that are not in pulse widths."""
        derived = (joint.column + end for end in _DERIVATIVES for joint in self.joints if joint.unit != "us")
        return (self.time, *(joint.column for joint in self.joints), *derived)

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints, in order."""
        return tuple(joint.name for joint in self.joints)

    def in_radians(self) -> ServoMap:
        """Return the same joints as alpha1 to alpha4, in their order [rad], for formats that name joints themselves."""
        joints = []
        for column, joint in zip(ANGLES, self.joints, strict=True):
            low, high = (float(joint.angle_of(value)) for value in joint.bounds)
            limits = None if math.isinf(low) else (low, high)
            joints.append(replace(joint, column=column, unit="rad", us_per_rad=None, limits=limits))
        return replace(self, joints=tuple(joints), time="t", time_unit="s")

    def check_vehicle(self, vehicle: Vehicle) -> None:
        """Raise InputError if the order of rotors is meant for another vehicle.

        One whose first arm points forward, as the paper's, is taken as turned by the map: that changes no
        determinant, only which body axes roll and pitch are about.
        """
        who = f"servos {self.name!r}: vehicle {vehicle.name!r}"
        if self.first_rotor_spin not in (None, vehicle.first_rotor_spin):
            spin = f"rotor 1 {vehicle.first_rotor_spin}; it must be {self.first_rotor_spin} for this map"
            end = "_counterclockwise"  # of the presets for the other spin
            other = self.name.removesuffix(end) if self.name.endswith(end) else self.name + end
            raise InputError(f"{who} has {spin}" + (f"; did you mean {other!r}?" if other in PRESETS else ""))
        if self.first_arm_angle is None or vehicle.first_arm_angle == 0.0:
            return
        if abs(math.remainder(vehicle.first_arm_angle - self.first_arm_angle, math.tau)) > 1e-6:
            actual, meant = math.degrees(vehicle.first_arm_angle), math.degrees(self.first_arm_angle)
            raise InputError(f"{who} has its first arm at {actual:.6g}°; it must be at {meant:.6g}°, or at 0°")

    def check_columns(self, names: list[str]) -> None:
        """Raise InputError unless there are the columns of all joints, and of time if it has a name of its own."""
        for name in self.columns[:5]:
            if name not in names and name != "t":
                hint = did_you_mean(name, names) or f"; there are {shown(', '.join(names))}"
                raise InputError(f"servos {self.name!r}: column {name!r} is missing{hint}")

    def as_mapping(self) -> dict[str, Any]:
        """Return the map as plain values; read back by :func:`servo_map_from_mapping`."""
        return {**_stated(self, without=("joints",)), "joint": [joint.as_mapping() for joint in self.joints]}


def _stated(record: Joint | ServoMap, *, without: tuple[str, ...]) -> dict[str, Any]:
    """Return the fields of a record that are not None, with lists for pairs."""
    found = {one.name: getattr(record, one.name) for one in fields(record) if one.name not in without}
    plain = {name: list(value) if isinstance(value, tuple) else value for name, value in found.items()}
    return {name: value for name, value in plain.items() if value is not None}


# -- Maps as plain values


_JOINT_FIELDS = tuple(one.name for one in fields(Joint))
_SHARED_FIELDS = tuple(name for name in _JOINT_FIELDS if name not in ("name", "rotor", "column"))
_MAP_FIELDS = ("preset", *(one.name for one in fields(ServoMap) if one.name != "joints"), "joint")


def servo_map_from_mapping(stated: Mapping[str, Any]) -> ServoMap:
    """Return the map that a table of plain values describes.

    Parameters
    ----------
    stated
        Field names of :class:`ServoMap` to values; angles may be texts. ``joint`` is a list of four tables with the
        field names of :class:`Joint`; whatever all four joints share (unit, sign, zero, limits, pulses) may stand
        beside it. ``preset`` names the map to start from, "paper" by default. Unknown names are refused.

    Examples
    --------
    >>> stated = servo_map_from_mapping({"preset": "x_frame", "unit": "us", "us_per_rad": 400})
    >>> stated.joints[0].column, servo_map_from_mapping(stated.as_mapping()) == stated
    ('tilt1_us', True)
    """
    check_fields("servos", stated, (*_MAP_FIELDS, *_SHARED_FIELDS))
    preset = stated.get("preset", "paper")
    if not isinstance(preset, str) or preset not in PRESETS:
        allowed = f"a preset ({', '.join(PRESETS)}) or a .toml file"
        raise InputError(f"servos must be {allowed}, got {shown(preset)}{did_you_mean(preset, list(PRESETS))}")
    stem, rotors, meant_for = PRESETS[preset]
    own = stated.get("joint", [{}] * 4)
    if not isinstance(own, (list, tuple)) or len(own) != 4:
        raise InputError(f"joint must be four tables [[joint]], one on each rotor, got {shown(own)}")
    shared = {name: stated[name] for name in _SHARED_FIELDS if name in stated}
    joints = []
    for number, (rotor, one) in enumerate(zip(rotors, own, strict=True), start=1):
        check_fields(f"joint {number}", one, _JOINT_FIELDS)
        joints.append(_joint({"name": f"{stem}{number}", "rotor": rotor, **shared, **one}))
    if any("rotor" in one for one in own):
        meant_for = {}  # an order of the user's own is for the user's vehicle, not for the preset's
    defaults = {"name": preset, "time": "t", "time_unit": "s", "clip": False, "first_rotor_spin": None, **meant_for}
    values = defaults | {name: stated[name] for name in _MAP_FIELDS[1:-1] if name in stated}
    must = partial(_must, values, "servos")
    for name in ("name", "time"):
        must(name, _is_name(values[name]), _NAME)
    must("time_unit", values["time_unit"] in tuple(_TIME_UNITS), "s, ms or us")
    must("clip", isinstance(values["clip"], bool), "true or false")
    spins = (None, "clockwise", "counterclockwise")
    must("first_rotor_spin", values["first_rotor_spin"] in spins, "clockwise or counterclockwise")
    if "first_arm_angle" in stated:
        values["first_arm_angle"] = angle_from_text(stated["first_arm_angle"], "first_arm_angle")
    servo_map = ServoMap(**values, joints=tuple(joints))
    for what, names in (
        ("rotors", [joint.rotor for joint in joints]),
        ("names of joints", servo_map.joint_names),
        ("columns", (*servo_map.columns, *TEXTS)),
    ):
        if len(set(names)) < len(names):
            raise InputError(f"servos: {what} must all differ, got {', '.join(map(str, names))}")
    return servo_map


def _joint(stated: dict[str, Any]) -> Joint:
    """Return the joint of plain values, once all are as they must be."""
    values = {"unit": "rad", "sign": 1, "zero": 0.0, **stated}
    who, unit = f"joint {values['name']!r}", values["unit"]
    must = partial(_must, values, who)
    must("name", _is_name(values["name"]), _NAME)
    must("unit", unit in tuple(_UNITS), "rad, deg or us")
    values["column"] = values.get("column") or f"{values['name']}{_UNITS[unit][0]}"
    must("column", _is_name(values["column"]), _NAME)
    must("rotor", isinstance(values["rotor"], int) and number_of(values["rotor"]) in (1, 2, 3, 4), "1, 2, 3 or 4")
    must("sign", number_of(values["sign"]) in (1, -1), "1 or −1")
    values["zero"] = angle_from_text(values["zero"], f"{who}: zero")
    for name in ("limits",) if unit == "us" else _OF_PULSES:
        must(name, values.get(name) is None, f"left out for the unit {unit!r}")
    if unit == "us":
        values = {"us_per_rad": None, "neutral_us": 1500.0, "limits_us": (1000.0, 2000.0), **values}
        must = partial(_must, values, who)
        slope = "between 0.001 and 1e9 µs/rad (sign = −1 turns the other way)"
        must("us_per_rad", 1e-3 <= number_of(values["us_per_rad"]) <= 1e9, slope)
        low, high = _pair(values["limits_us"], number_of)
        must("limits_us", 0 <= low < high <= 1e6, "the least and the largest, between 0 and 1e6 µs, in this order")
        must("neutral_us", low <= number_of(values["neutral_us"]) <= high, f"between {low:g} and {high:g} µs")
        values |= {name: number_of(values[name]) for name in ("us_per_rad", "neutral_us")} | {"limits_us": (low, high)}
    elif values.get("limits") is not None:
        low, high = _pair(values["limits"], partial(angle_from_text, name=f"{who}: limits"))
        must("limits", low < high, "the least and the largest angle (rad), in this order")
        values["limits"] = (low, high)
    return Joint(**values)


def _must(values: dict[str, Any], who: str, name: str, holds: object, allowed: str) -> None:
    if not holds:
        raise InputError(f"{who}: {name} must be {allowed}, got {shown(values[name])}")


def _is_name(value: object) -> bool:
    return isinstance(value, str) and value.strip() != "" and value.isprintable() and len(value) <= 64


def _pair(value: object, read: Callable[[object], float]) -> tuple[float, float]:
    """Return two numbers, as read; twice NaN for what is no pair."""
    if not isinstance(value, (list, tuple)) or len(value) != 2:
        return math.nan, math.nan
    return read(value[0]), read(value[1])


def servo_map_named(name_or_file: str | Path) -> ServoMap:
    """Return a preset by name, or the map in a TOML file.

    The file holds what :func:`servo_map_from_mapping` takes, at the top level or in a ``[servos]`` table, with joints
    as ``[[joint]]``. Raises InputError, or FileProblem if the file cannot be read.
    """
    if isinstance(name_or_file, str) and not name_or_file.lower().endswith(".toml"):
        return servo_map_from_mapping({"preset": name_or_file})
    path = Path(name_or_file)
    return from_toml_file(path, "servos", lambda stated: servo_map_from_mapping({"name": path.stem, **stated}))


# -- Tables of joints


def mapped_table(table: Table, servo_map: ServoMap, *, rows_before: int = 0) -> Table:
    """Return a gait table in the columns of a map, which it states in ``about["servos"]``.

    These are time, then each joint, then its rates and accelerations in its unit per second and per second squared, if
    the table has them. Pulse widths have neither.

    Parameters
    ----------
    table
        Rows with alpha1 to alpha4.
    servo_map
        What the columns are. A joint beyond its limits is an error unless the map clips; a map for another vehicle is.
    rows_before
        Rows of the same table that came before these, for messages.

    Examples
    --------
    >>> from gaitgraph.gait.gait import lift
    >>> from gaitgraph.timing.timed_gait import table_of
    >>> table = table_of(lift([(0.4, -0.4), (0.8, -0.8)], "red").parametrize(samples=2))
    >>> servos = servo_map_from_mapping({"preset": "x_frame", "unit": "us", "us_per_rad": 500, "time_unit": "ms"})
    >>> servo_table = mapped_table(table, servos)
    >>> servo_table["t"].tolist(), servo_table["tilt1_us"].tolist()
    ([0.0, 500.0, 1000.0], [1300.0, 1100.0, 1300.0])
    """
    servo_map.check_vehicle(setting_of(table)[0])
    columns: dict[str, FloatArray] = {}
    if "t" in table:
        columns[servo_map.time] = np.asarray(table["t"]) * _TIME_UNITS[servo_map.time_unit]
    for joint in servo_map.joints:
        values = _values(table, joint)
        if servo_map.clip:
            values = np.clip(values, *joint.bounds)
        else:
            _check_limits(servo_map, joint, values, rows_before, " (or clip = true)")
        columns[joint.column] = values + 0.0
    for end, names in _DERIVATIVES.items():
        for joint in servo_map.joints if all(name in table for name in names) else ():
            if joint.unit != "us":
                columns[joint.column + end] = joint.sign * joint.per_radian * table[names[joint.rotor - 1]] + 0.0
    return Table(columns=columns, about={**table.about, "servos": servo_map.as_mapping()}, rounding=table.rounding)


def clipped_rows(table: Table, servo_map: ServoMap) -> dict[str, int]:
    """Return how many rows of a gait table lie beyond each joint's limits; joints within theirs are left out."""
    beyond = {joint.name: int(joint.is_beyond(_values(table, joint)).sum()) for joint in servo_map.joints}
    return {name: count for name, count in beyond.items() if count}


def _values(table: Table, joint: Joint) -> FloatArray:
    return np.asarray(joint.value_of(np.asarray(table[ANGLES[joint.rotor - 1]], dtype=float)))


def _check_limits(servo_map: ServoMap, joint: Joint, values: FloatArray, rows_before: int, remedy: str = "") -> None:
    """Raise InputError for the first value beyond a joint's limits, if there is one."""
    beyond = joint.is_beyond(values)
    if beyond.any():
        k = int(np.argmax(beyond))
        (low, high), unit = joint.bounds, _UNITS[joint.unit][1]
        tilt = float(np.degrees(joint.tilt_of(values[k])))
        raise InputError(
            f"servos {servo_map.name!r}: row {rows_before + k + 1}: joint {joint.name!r} must be between {low:.6g} and "
            f"{high:.6g} {unit}{remedy}, got {float(values[k]):.6g} {unit} (rotor {joint.rotor} at {tilt:.4g}°)"
        )


def tilts_from_joints(
    columns: Mapping[str, npt.ArrayLike], servo_map: ServoMap, *, rows_before: int = 0
) -> dict[str, FloatArray]:
    """Return the columns of a gait table from those of joints: the inverse of :func:`mapped_table`.

    These are t [s], alpha1 to alpha4 [rad], and rates and accelerations where all joints state them; other columns are
    ignored. Raises InputError if one is missing or a joint is beyond its limits.

    Examples
    --------
    >>> servos = servo_map_from_mapping({"preset": "x_frame", "unit": "deg"})
    >>> found = tilts_from_joints({f"tilt{k}_deg": [10.0 * k] for k in (1, 2, 3, 4)}, servos)
    >>> [found[f"alpha{k}"].round(4).item() for k in (1, 2, 3, 4)]
    [0.5236, 0.3491, 0.6981, 0.1745]
    """
    servo_map.check_columns(list(columns))
    found: dict[str, FloatArray] = {}
    by_rotor = sorted(servo_map.joints, key=lambda joint: joint.rotor)
    if servo_map.time in columns:
        found["t"] = np.asarray(columns[servo_map.time], dtype=float) / _TIME_UNITS[servo_map.time_unit]
    for name, joint in zip(ANGLES, by_rotor, strict=True):
        values = np.asarray(columns[joint.column], dtype=float)
        _check_limits(servo_map, joint, values, rows_before)
        tilt = joint.tilt_of(values) + 0.0
        # π/2 in another unit may come back a digit beyond it.
        near = np.abs(np.abs(tilt) - HALF_PI) < 1e-12
        found[name] = np.where(near, np.copysign(HALF_PI, tilt), tilt)
    for end, names in _DERIVATIVES.items():
        if all(joint.unit != "us" and joint.column + end in columns for joint in by_rotor):
            for name, joint in zip(names, by_rotor, strict=True):
                values = np.asarray(columns[joint.column + end], dtype=float)
                found[name] = joint.sign * values / joint.per_radian + 0.0
    return found
