"""Servo maps: from the tilt angles of a gait to four joints with an order, signs, zeros, limits and units, and back.

A joint turns one rotor about its arm. It is at q = sign·α + zero [rad] when the rotor is tilted by α, and its column
states q in radians, in degrees, or as the pulse width neutral + (µs per radian)·q that a servo takes.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import HALF_PI, angle_from_text, number_of
from gaitgraph.errors import InputError, did_you_mean, shown
from gaitgraph.files import table_from_toml, text_of
from gaitgraph.gait.table import ACCELERATIONS, ANGLES, RATES, TEXTS, Table, setting_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from gaitgraph.vehicle import Vehicle

FloatArray = npt.NDArray[np.float64]

_TIME_UNITS = {"s": 1.0, "ms": 1e3, "us": 1e6}
"""Units of time in one second."""

_COLUMN_ENDS = {"rad": "", "deg": "_deg", "us": "_us"}
_DERIVATIVE_ENDS = ("_rate", "_acceleration")
_LONGEST_PULSE = 1e6
_LONGEST_NAME = 64
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
    """One joint: which rotor it turns, how, and the column that states its position.

    Parameters
    ----------
    name
        What the vehicle calls it.
    rotor
        Which of the gait's rotors it turns, 1 to 4.
    column
        Its column in tables.
    unit
        "rad", "deg" or "us" (pulse width, µs).
    sign
        1 if it turns as α does, right-handed about the arm's outward axis, else −1.
    zero
        Its angle q while the rotor is upright [rad].
    limits
        Least and largest angle q [rad], for the units rad and deg; None for no limits.
    us_per_rad
        Pulse width per angle [µs/rad]; needed for the unit us, and None for the others.
    neutral_us
        Pulse width at q = 0 [µs], for the unit us.
    limits_us
        Least and largest pulse width [µs], for the unit us.

    Examples
    --------
    >>> servo = Joint(name="servo1", rotor=2, column="servo1_us", unit="us", sign=-1, us_per_rad=600.0)
    >>> servo.value_of(-0.5), servo.tilt_of(1200.0)
    (1200.0, 0.5)
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

    def __post_init__(self) -> None:
        _check_name(self.name, "joint: name")
        _check_name(self.column, f"joint {self.name!r}: column")
        check_choice(self.unit, _COLUMN_ENDS, f"joint {self.name!r}: unit")
        if number_of(self.rotor) not in (1, 2, 3, 4):
            raise self._refused("rotor", "1, 2, 3 or 4")
        if number_of(self.sign) not in (1, -1):
            raise self._refused("sign", "1 or −1")
        if not math.isfinite(number_of(self.zero)):
            raise self._refused("zero", "a finite angle (rad)")
        if self.unit != "us" and self.us_per_rad is not None:
            raise self._refused("us_per_rad", f"left out for the unit {self.unit!r}; it is of the unit 'us'")
        if self.unit == "us":
            if self.limits is not None:
                raise self._refused("limits", "left out for the unit 'us', which has limits_us")
            if self.us_per_rad is None:
                raise InputError(f"joint {self.name!r}: us_per_rad is missing; it must be a positive number (µs/rad)")
            if not 1e-3 <= number_of(self.us_per_rad) <= 1e9:
                raise self._refused("us_per_rad", "between 0.001 and 1e9 µs/rad (sign = −1 turns the other way)")
        if self.unit == "us" or self.limits is not None:
            name, unit = ("limits_us", "µs") if self.unit == "us" else ("limits", "rad")
            pair = getattr(self, name)
            numbers = [number_of(value) for value in pair] if isinstance(pair, tuple) else []
            if len(numbers) != 2 or not -math.inf < numbers[0] < numbers[1] < math.inf:
                raise self._refused(name, f"the least and the largest value ({unit}), in this order")
        if self.unit == "us":
            low, high = self.limits_us
            if low < 0 or high > _LONGEST_PULSE:
                raise self._refused("limits_us", f"between 0 and {_LONGEST_PULSE:g} µs")
            if not low <= number_of(self.neutral_us) <= high:
                raise self._refused("neutral_us", f"between {low:g} and {high:g} µs, within limits_us")

    def _refused(self, name: str, allowed: str) -> InputError:
        return InputError(f"joint {self.name!r}: {name} must be {allowed}, got {shown(getattr(self, name))}")

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

    def value_of(self, angle: Any) -> Any:
        """Return the values of the column, in its unit, at angles q of the joint [rad], whatever the limits."""
        return (self.neutral_us if self.unit == "us" else 0.0) + self.per_radian * angle

    def angle_of(self, value: Any) -> Any:
        """Return the angle q [rad] of values of the column: the inverse of :meth:`value_of`."""
        if self.unit == "us":
            return (value - self.neutral_us) / self.per_radian
        return np.radians(value) if self.unit == "deg" else value

    def tilt_of(self, value: Any) -> Any:
        """Return the tilt angle α [rad] of values of the column."""
        return self.sign * (self.angle_of(value) - self.zero)

    def is_beyond(self, values: npt.NDArray[np.float64]) -> npt.NDArray[np.bool_]:
        """Return which values of the column exceed the limits by more than rounding."""
        low, high = self.bounds
        near = _ROUNDING * np.maximum(1.0, np.abs(values))
        return (values < low - near) | (values > high + near)

    def as_mapping(self) -> dict[str, Any]:
        """Return the fields that its unit has, as plain values."""
        left_out = ("limits",) if self.unit == "us" else ("us_per_rad", "neutral_us", "limits_us")
        stated = {one.name: getattr(self, one.name) for one in fields(self) if one.name not in left_out}
        plain = {name: list(value) if isinstance(value, tuple) else value for name, value in stated.items()}
        return {name: value for name, value in plain.items() if value is not None}


@dataclass(frozen=True, slots=True, kw_only=True)
class ServoMap:
    """Four joints, one on each rotor, and the time beside them.

    Parameters
    ----------
    name
        What messages call the map.
    joints
        In the order of the table's columns.
    time
        The column of time.
    time_unit
        "s", "ms" or "us".
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

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name or not self.name.isprintable():
            raise InputError(f"name must be a printable text that is not empty, got {shown(self.name)}")
        _check_name(self.time, "time")
        check_choice(self.time_unit, _TIME_UNITS, "time_unit")
        if not isinstance(self.clip, bool):
            raise InputError(f"clip must be true or false, got {shown(self.clip)}")
        if self.first_rotor_spin is not None:
            check_choice(self.first_rotor_spin, ("clockwise", "counterclockwise"), "first_rotor_spin")
        if len(self.joints) != 4:
            raise InputError(f"joint: there must be 4, one on each rotor, got {len(self.joints)}")
        on: dict[int, str] = {}
        for joint in self.joints:
            if joint.rotor in on:
                both = f"{on[joint.rotor]!r} and {joint.name!r}"
                raise InputError(f"joint: {both} are both on rotor {joint.rotor}; each rotor must have one joint")
            on[joint.rotor] = joint.name
        for what, names in (("name", self.joint_names), ("column", self.columns)):
            name, count = Counter(names).most_common(1)[0]
            if count > 1:
                raise InputError(f"{what}: {name!r} is given twice; all must differ")
        for name in self.columns:
            if name in TEXTS:
                raise InputError(f"column: {name!r} is a column of texts in a gait table; use another name")

    @property
    def columns(self) -> tuple[str, ...]:
        """Columns of a table: time, joints, then rates and accelerations of joints that are not in pulse widths."""
        derived = (joint.column + end for end in _DERIVATIVE_ENDS for joint in self.joints if joint.unit != "us")
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
            end = "_counterclockwise"
            other = self.name.removesuffix(end) + (end if vehicle.first_rotor_spin == "counterclockwise" else "")
            hint = f"; did you mean {other!r}?" if self.name in PRESETS and other in PRESETS else ""
            raise InputError(
                f"{who} has rotor 1 {vehicle.first_rotor_spin}; it must be {self.first_rotor_spin} for this map{hint}"
            )
        if self.first_arm_angle is None or vehicle.first_arm_angle == 0.0:
            return
        if abs(math.remainder(vehicle.first_arm_angle - self.first_arm_angle, math.tau)) > 1e-6:
            actual, meant = math.degrees(vehicle.first_arm_angle), math.degrees(self.first_arm_angle)
            raise InputError(f"{who} has its first arm at {actual:.6g}°; it must be at {meant:.6g}°, or at 0°")

    def as_mapping(self) -> dict[str, Any]:
        """Return the map as plain values; read back by :func:`servo_map_from_mapping`."""
        stated = {one.name: getattr(self, one.name) for one in fields(self) if one.name != "joints"}
        plain = {name: value for name, value in stated.items() if value is not None}
        return {**plain, "joint": [joint.as_mapping() for joint in self.joints]}


def check_choice(value: object, allowed: Iterable[str], what: str) -> None:
    """Raise InputError unless a value is one of the texts allowed."""
    known = list(allowed)
    if value not in known:
        hint = did_you_mean(value, known) if isinstance(value, str) else ""
        raise InputError(f"{what} must be {', '.join(known[:-1])} or {known[-1]}, got {shown(value)}{hint}")


def _check_name(value: object, what: str) -> None:
    if not (isinstance(value, str) and value.strip() and value.isprintable() and len(value) <= _LONGEST_NAME):
        raise InputError(f"{what} must be a printable text of 1 to {_LONGEST_NAME} characters, got {shown(value)}")


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
    _check_fields("servos", stated, (*_MAP_FIELDS, *_SHARED_FIELDS))
    preset = stated.get("preset", "paper")
    if not isinstance(preset, str) or preset not in PRESETS:
        hint = did_you_mean(preset, list(PRESETS)) if isinstance(preset, str) else ""
        raise InputError(f"servos must be a preset ({', '.join(PRESETS)}) or a .toml file, got {shown(preset)}{hint}")
    stem, rotors, meant_for = PRESETS[preset]
    own = stated.get("joint", [{}] * 4)
    if not isinstance(own, (list, tuple)) or not all(isinstance(one, dict) for one in own):
        raise InputError(f"joint must be four tables [[joint]], got {shown(own)}")
    if len(own) != 4:
        raise InputError(f"joint: there must be 4, one on each rotor, got {len(own)}")
    shared = {name: stated[name] for name in _SHARED_FIELDS if name in stated}
    joints = []
    for number, (rotor, one) in enumerate(zip(rotors, own, strict=True), start=1):
        _check_fields(f"joint {number}", one, _JOINT_FIELDS)
        joints.append(_joint_from_mapping({"name": f"{stem}{number}", "rotor": rotor, **shared, **one}))
    if any("rotor" in one for one in own):
        meant_for = {}  # an order of the user's own is for the user's vehicle, not for the preset's
    rest = {name: stated[name] for name in _MAP_FIELDS if name in stated and name not in ("preset", "joint")}
    whole = {"name": preset, **meant_for, **rest}
    if "first_arm_angle" in rest:
        whole["first_arm_angle"] = angle_from_text(rest["first_arm_angle"], "first_arm_angle")
    return ServoMap(**whole, joints=tuple(joints))


def _joint_from_mapping(stated: dict[str, Any]) -> Joint:
    """Return a joint: texts become angles, pairs tuples, numbers floats; the record refuses what is left."""
    unit, values = stated.get("unit", "rad"), dict(stated)
    who = f"joint {values['name']!r}"
    for name in ("neutral_us", "limits_us"):
        if name in values and unit in ("rad", "deg"):
            raise InputError(f"{who}: {name} must be left out for the unit {unit!r}, got {shown(values[name])}")
    for name in ("rotor", "sign"):
        if number_of(values.get(name)).is_integer():
            values[name] = int(number_of(values[name]))
    for name in ("us_per_rad", "neutral_us"):
        if not math.isnan(number_of(values.get(name))):
            values[name] = number_of(values[name])
    for name in ("limits", "limits_us"):
        if isinstance(values.get(name), (list, tuple)):
            read = angle_from_text if name == "limits" else lambda value, _: number_of(value)
            values[name] = tuple(read(value, f"{who}: {name}") for value in values[name])
    if "zero" in values:
        values["zero"] = angle_from_text(values["zero"], f"{who}: zero")
    if not values.get("column"):
        values["column"] = f"{values['name']}{_COLUMN_ENDS.get(unit, '') if isinstance(unit, str) else ''}"
    return Joint(**values)


def _check_fields(what: str, stated: object, known: Sequence[str]) -> None:
    if not isinstance(stated, dict) or not all(isinstance(name, str) for name in stated):
        raise InputError(f"{what} must be a table of values by name, got {shown(stated)}")
    for name in stated:
        if name not in known:
            hint = did_you_mean(name, list(known)) or f"; the fields are {', '.join(known)}"
            raise InputError(f"{what}: {name!r} is no field{hint}")


def servo_map_named(name_or_file: str | Path) -> ServoMap:
    """Return a preset by name, or the map in a TOML file.

    The file holds what :func:`servo_map_from_mapping` takes, at the top level or in a ``[servos]`` table, with joints
    as ``[[joint]]``. Raises InputError, or FileProblem if the file cannot be read.
    """
    if isinstance(name_or_file, str) and not name_or_file.lower().endswith(".toml"):
        return servo_map_from_mapping({"preset": name_or_file})
    path = Path(name_or_file)
    text = text_of(path, "servos", "a TOML file")
    try:
        content = table_from_toml(text)
        inner = content.get("servos", content)
        if inner is not content and len(content) > 1:
            beside = next(name for name in content if name != "servos")
            raise InputError(f"{beside} must be inside the [servos] table, got it beside that")
        return servo_map_from_mapping({"name": path.stem, **inner} if isinstance(inner, dict) else inner)
    except InputError as error:
        raise InputError(f"servos file {str(path)!r}: {error}") from error


# -- Tables of joints


def mapped_table(table: Table, servo_map: ServoMap, *, rows_before: int = 0) -> Table:
    """Return a gait table in the columns of a map, which it states in ``about["servos"]``.

    These are time, then each joint, then rates and accelerations if the table has them: ``_rate`` and
    ``_acceleration`` of a joint in its unit per second and per second squared. Pulse widths have neither.

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
        angle = joint.sign * np.asarray(table[ANGLES[joint.rotor - 1]], dtype=float) + joint.zero
        values = joint.value_of(angle)
        if servo_map.clip:
            inside = np.clip(values, *joint.bounds)
            angle = np.where(inside == values, angle, joint.angle_of(inside))
        else:
            _check_limits(servo_map, joint, values, rows_before, " (or clip = true)")
        columns[joint.column] = joint.value_of(angle + 0.0) + 0.0
    for end, names in zip(_DERIVATIVE_ENDS, (RATES, ACCELERATIONS), strict=True):
        for joint in servo_map.joints if all(name in table for name in names) else ():
            if joint.unit != "us":
                columns[joint.column + end] = joint.sign * joint.per_radian * table[names[joint.rotor - 1]] + 0.0
    return Table(columns=columns, about={**table.about, "servos": servo_map.as_mapping()}, rounding=table.rounding)


def clipped_rows(table: Table, servo_map: ServoMap) -> dict[str, int]:
    """Return how many rows of a gait table lie beyond each joint's limits; joints within theirs are left out."""
    beyond = {}
    for joint in servo_map.joints:
        angle = joint.sign * np.asarray(table[ANGLES[joint.rotor - 1]], dtype=float) + joint.zero
        beyond[joint.name] = int(joint.is_beyond(joint.value_of(angle)).sum())
    return {name: count for name, count in beyond.items() if count}


def _check_limits(servo_map: ServoMap, joint: Joint, values: FloatArray, rows_before: int, remedy: str = "") -> None:
    """Raise InputError for the first value beyond a joint's limits, if there is one."""
    beyond = joint.is_beyond(values)
    if beyond.any():
        k = int(np.argmax(beyond))
        (low, high), unit = joint.bounds, {"rad": "rad", "deg": "°", "us": "µs"}[joint.unit]
        tilt = float(np.degrees(joint.tilt_of(values[k])))
        raise InputError(
            f"servos {servo_map.name!r}: row {rows_before + k + 1}: joint {joint.name!r} must be between {low:.6g} and "
            f"{high:.6g} {unit}{remedy}, got {float(values[k]):.6g} {unit} (rotor {joint.rotor} at {tilt:.4g}°)"
        )


def check_joint_columns(names: Sequence[str], servo_map: ServoMap) -> None:
    """Raise InputError unless there are the columns of all joints, and of time if it has a name of its own."""
    wanted = [(joint.column, f"of joint {joint.name!r}") for joint in servo_map.joints]
    if servo_map.time != "t":
        wanted.insert(0, (servo_map.time, "of time"))
    for column, of_what in wanted:
        if column not in names:
            hint = did_you_mean(column, list(names)) or f"; there are {shown(', '.join(names))}"
            raise InputError(f"servos {servo_map.name!r}: column {column!r} {of_what} is missing{hint}")


def tilts_from_joints(
    columns: Mapping[str, npt.ArrayLike], servo_map: ServoMap, *, rows_before: int = 0
) -> dict[str, FloatArray]:
    """Return the columns of a gait table from those of joints: the inverse of :func:`mapped_table`.

    These are t [s], alpha1 to alpha4 [rad], and rates and accelerations where all joints state them.

    Other columns are ignored. Raises InputError if one is missing or a joint is beyond its limits.

    Examples
    --------
    >>> servos = servo_map_from_mapping({"preset": "x_frame", "unit": "deg"})
    >>> found = tilts_from_joints({f"tilt{k}_deg": [10.0 * k] for k in (1, 2, 3, 4)}, servos)
    >>> [found[f"alpha{k}"].round(4).item() for k in (1, 2, 3, 4)]
    [0.5236, 0.3491, 0.6981, 0.1745]
    """
    check_joint_columns(list(columns), servo_map)
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
    for end, names in zip(_DERIVATIVE_ENDS, (RATES, ACCELERATIONS), strict=True):
        if all(joint.unit != "us" and joint.column + end in columns for joint in by_rotor):
            for name, joint in zip(names, by_rotor, strict=True):
                values = np.asarray(columns[joint.column + end], dtype=float)
                found[name] = joint.sign * values / joint.per_radian + 0.0
    return found
