"""From tilt angles to the joints of a real vehicle and back: order, sign, zero, and units down to pulse widths.

A joint turns one rotor about its arm. It stands at q = sign·α + zero [rad] when the rotor is tilted by α, and a table
tells q in radians, in degrees, or as the pulse width neutral + (µs per radian)·q that a servo takes. A
:class:`JointMap` says so for four joints, one on each rotor, and what the columns and the time are called.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import HALF_PI, angle_from_text, number_of
from gaitgraph.errors import InputError, did_you_mean, shown
from gaitgraph.files import table_from_toml, text_of
from gaitgraph.tables import ACCELERATIONS, ANGLES, RATES, Table, setting_of

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from gaitgraph.vehicle import Vehicle

__all__ = [
    "Joint",
    "JointMap",
    "check_joint_columns",
    "clipped_rows",
    "joint_map_from_mapping",
    "joint_map_named",
    "joint_map_names",
    "mapped_columns",
    "mapped_table",
    "table_from_joints",
    "tilts_from_joints",
]

FloatArray = npt.NDArray[np.float64]
Unit = Literal["rad", "deg", "us"]

UNITS = ("rad", "deg", "us")
TIME_UNITS = {"s": 1.0, "ms": 1e3, "us": 1e6}
_SHOWN_UNIT = {"rad": "rad", "deg": "°", "us": "µs"}
_COLUMN_ENDS = {"rad": "", "deg": "_deg", "us": "_us"}
_NEUTRAL, _PULSES = 1500.0, (1000.0, 2000.0)
_LONGEST_PULSE = 1e6
_LONGEST_NAME = 64
_ROUNDING = 1e-9
"""Relative to a limit: what floating point may add to a value that was stated as the limit."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Joint:
    """One joint: which rotor it turns, how, and the column that tells where it stands.

    Parameters
    ----------
    name
        What the vehicle calls it.
    rotor
        Which of the gait's rotors it turns, 1 to 4.
    column
        Its column in tables; by default the name, with ``_deg`` or ``_us`` for those units.
    unit
        "rad", "deg" or "us" (pulse width, µs).
    sign
        1 if it turns as α does, right-handed about the arm's outward axis, else −1.
    zero
        Where it stands while the rotor is upright [rad].
    limits
        Least and largest angle q [rad], for the units rad and deg; None for no limits.
    us_per_rad
        Pulse width per angle [µs/rad], for the unit us.
    neutral_us
        Pulse width at q = 0 [µs]; 1500 by default.
    limits_us
        Least and largest pulse width [µs]; 1000 and 2000 by default.

    Raises
    ------
    InputError
        If a value is not allowed, or one that the unit needs is missing.

    Examples
    --------
    >>> servo = Joint(name="servo1", rotor=2, unit="us", sign=-1, us_per_rad=600)
    >>> servo.column, servo.value_of(0.5), servo.tilt_of(1200.0)
    ('servo1_us', 1200.0, 0.5)
    """

    name: str
    rotor: int
    column: str = ""
    unit: Unit = "rad"
    sign: int = 1
    zero: float = 0.0
    limits: tuple[float, float] | None = None
    us_per_rad: float | None = None
    neutral_us: float | None = None
    limits_us: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        if not _is_name(self.name):
            raise InputError(
                f"name: {shown(self.name)}; allowed is a printable text of 1 to {_LONGEST_NAME} characters"
            )
        if self.unit not in UNITS:
            raise self._refused("unit", f"allowed are {', '.join(UNITS)}{_hint(self.unit, UNITS)}")
        for name, allowed in (("rotor", (1, 2, 3, 4)), ("sign", (1, -1))):
            number = number_of(getattr(self, name))
            if number not in allowed:
                raise self._refused(name, f"allowed are {', '.join(map(str, allowed))}".replace("-", "−"))
            object.__setattr__(self, name, int(number))
        object.__setattr__(self, "column", self.column or self.name + _COLUMN_ENDS[self.unit])
        if not _is_name(self.column):
            raise self._refused("column", f"allowed is a printable text of up to {_LONGEST_NAME} characters")
        object.__setattr__(self, "zero", angle_from_text(self.zero, f"joint {self.name!r}: zero"))
        self._check_units()

    def _check_units(self) -> None:
        pulses = ("us_per_rad", "neutral_us", "limits_us")
        for name in ("limits",) if self.unit == "us" else pulses:
            if getattr(self, name) is not None:
                instead = "limits_us" if name == "limits" else f"the unit 'us', not {self.unit!r}"
                raise self._refused(name, f"allowed is {instead}")
        if self.unit != "us":
            if self.limits is not None:
                self._set_pair("limits", lambda value: angle_from_text(value, f"joint {self.name!r}: limits"), "rad")
            return
        if self.us_per_rad is None:
            raise InputError(f"joint {self.name!r}: us_per_rad is missing; allowed is a positive number (µs/rad)")
        slope = number_of(self.us_per_rad)
        if not 1e-3 <= slope <= 1e9:
            raise self._refused("us_per_rad", "allowed is 0.001 to 1e9 (µs/rad); sign = −1 turns the other way")
        object.__setattr__(self, "us_per_rad", slope)
        if self.limits_us is None:
            object.__setattr__(self, "limits_us", _PULSES)
        self._set_pair("limits_us", number_of, "µs")
        low, high = self.bounds
        if low < 0 or high > _LONGEST_PULSE:
            raise self._refused("limits_us", f"allowed are pulses of 0 to {_LONGEST_PULSE:g} µs")
        neutral = number_of(_NEUTRAL if self.neutral_us is None else self.neutral_us)
        if not low <= neutral <= high:
            raise self._refused("neutral_us", f"allowed is {low:g} to {high:g} µs, within limits_us")
        object.__setattr__(self, "neutral_us", neutral)

    def _set_pair(self, name: str, read: Any, unit: str) -> None:
        value = getattr(self, name)
        if not isinstance(value, (list, tuple)) or len(value) != 2:
            raise self._refused(name, f"allowed are the least and the largest ({unit})")
        low, high = map(read, value)
        if not low < high or not math.isfinite(low) or not math.isfinite(high):
            raise self._refused(name, f"allowed are the least and the largest ({unit}), in this order")
        object.__setattr__(self, name, (low, high))

    def _refused(self, name: str, allowed: str) -> InputError:
        return InputError(f"joint {self.name!r}: {name}: {shown(getattr(self, name))}; {allowed}")

    @property
    def per_radian(self) -> float:
        """Units of the column in one radian."""
        return {"rad": 1.0, "deg": math.degrees(1.0), "us": self.us_per_rad or 0.0}[self.unit]

    @property
    def bounds(self) -> tuple[float, float]:
        """The least and the largest value of its column, in its unit; infinite where there is no limit."""
        if self.unit == "us":
            return self.limits_us or _PULSES
        low, high = self.limits or (-math.inf, math.inf)
        return (math.degrees(low), math.degrees(high)) if self.unit == "deg" else (low, high)

    def value_of(self, alpha: Any) -> Any:
        """Return what the column says, in its unit, for tilt angles [rad], whatever the limits."""
        return self.value_of_angle(self.sign * alpha + self.zero)

    def value_of_angle(self, angle: Any) -> Any:
        """Return what the column says, in its unit, for angles q of the joint [rad]."""
        if self.unit == "us":
            return (self.neutral_us or 0.0) + (self.us_per_rad or 0.0) * angle
        return np.degrees(angle) if self.unit == "deg" else angle

    def angle_of(self, value: Any) -> Any:
        """Return the angle q [rad] of values of the column: the inverse of :meth:`value_of_angle`."""
        if self.unit == "us":
            return (value - (self.neutral_us or 0.0)) / (self.us_per_rad or 1.0)
        return np.radians(value) if self.unit == "deg" else value

    def tilt_of(self, value: Any) -> Any:
        """Return the tilt angle [rad] of values of the column: the inverse of :meth:`value_of`."""
        return self.sign * (self.angle_of(value) - self.zero)

    def as_mapping(self) -> dict[str, Any]:
        """Return what is stated of the joint as plain values."""
        stated = {one.name: getattr(self, one.name) for one in fields(self)}
        plain = {name: list(value) if isinstance(value, tuple) else value for name, value in stated.items()}
        return {name: value for name, value in plain.items() if value is not None}


@dataclass(frozen=True, slots=True, kw_only=True)
class JointMap:
    """Four joints, one on each rotor, and the time beside them: all that turns a gait table into a servo table.

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
        Whether values beyond a joint's limits are set to the limit; without it they are errors.
    first_rotor_spin, first_arm_angle
        The vehicle that the order of rotors is meant for, as :class:`~gaitgraph.vehicle.Vehicle` has them [rad]; None
        if it fits any.

    Raises
    ------
    InputError
        If the joints are not one on each rotor, a column is named twice, or a value is not allowed.

    Examples
    --------
    >>> [joint.rotor for joint in joint_map_named("x_frame").joints]
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
        object.__setattr__(self, "joints", tuple(self.joints))
        if not isinstance(self.name, str) or not self.name or not self.name.isprintable():
            raise InputError(f"name: {shown(self.name)}; allowed is a printable text that is not empty")
        if not _is_name(self.time):
            raise InputError(f"time: {shown(self.time)}; allowed is the name of a column")
        if self.time_unit not in TIME_UNITS:
            hint = _hint(self.time_unit, tuple(TIME_UNITS))
            raise InputError(f"time_unit: {shown(self.time_unit)}; allowed are {', '.join(TIME_UNITS)}{hint}")
        if not isinstance(self.clip, bool):
            raise InputError(f"clip: {shown(self.clip)}; allowed are true and false")
        spins = ("clockwise", "counterclockwise")
        if self.first_rotor_spin is not None and self.first_rotor_spin not in spins:
            hint = _hint(self.first_rotor_spin, spins)
            raise InputError(
                f"first_rotor_spin: {shown(self.first_rotor_spin)}; allowed are {' and '.join(spins)}{hint}"
            )
        if self.first_arm_angle is not None:
            angle = angle_from_text(self.first_arm_angle, "first_arm_angle")
            object.__setattr__(self, "first_arm_angle", angle)
        self._check_joints()

    def _check_joints(self) -> None:
        on: dict[int, str] = {}
        if len(self.joints) != 4:
            raise InputError(f"joint: there are {len(self.joints)}; allowed are 4, one on each rotor")
        for joint in self.joints:
            if joint.rotor in on:
                both = f"{on[joint.rotor]!r} and {joint.name!r}"
                raise InputError(
                    f"joint: {both} are both on rotor {joint.rotor}; allowed is one joint on each of 1 to 4"
                )
            on[joint.rotor] = joint.name
        for what, names in (("name", self.joint_names), ("column", self.columns)):
            for name in names:
                if names.count(name) > 1:
                    raise InputError(f"{what}: {name!r} is given twice; allowed are different ones")

    @property
    def columns(self) -> tuple[str, ...]:
        """Columns of a table: time, joints, then rates and accelerations of joints that are not told as pulses."""
        derived = (joint.column + end for joint in self.joints if joint.unit != "us" for end in _DERIVATIVES)
        return (self.time, *(joint.column for joint in self.joints), *derived)

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints, in order."""
        return tuple(joint.name for joint in self.joints)

    def in_radians(self) -> JointMap:
        """Return the same joints as alpha1 to alpha4, in their order [rad], for formats that name joints on their own.

        >>> joint_map_named("x_frame").in_radians().joints[0].column
        'alpha1'
        """
        joints = []
        for column, joint in zip(ANGLES, self.joints, strict=True):
            low, high = (float(joint.angle_of(value)) for value in joint.bounds)
            limits = None if math.isinf(low) else (low, high)
            plain = replace(
                joint, column=column, unit="rad", us_per_rad=None, neutral_us=None, limits_us=None, limits=limits
            )
            joints.append(plain)
        return replace(self, joints=tuple(joints), time="t", time_unit="s")

    def apply(self, table: Table, *, rows_before: int = 0) -> Table:
        """Return a table whose alpha1 to alpha4 are the angles of the joints, in their order [rad].

        That is :func:`mapped_table` for :meth:`in_radians`; what is said of tilt angles (color, types, R) is left out.
        """
        return mapped_table(table, self.in_radians(), rows_before=rows_before)

    def check_vehicle(self, vehicle: Vehicle) -> None:
        """Raise InputError if the order of rotors is meant for another vehicle.

        One whose first arm points forward, as the paper's, is taken as turned by the map: that changes no
        determinant, only which body axes roll and pitch are about.
        """
        who = f"servos {self.name!r}: vehicle {vehicle.name!r}"
        if self.first_rotor_spin not in (None, vehicle.first_rotor_spin):
            raise InputError(
                f"{who} has rotor 1 {vehicle.first_rotor_spin}; allowed is "
                f"{self.first_rotor_spin}{_other_preset(self.name, vehicle.first_rotor_spin)}"
            )
        if self.first_arm_angle is None or vehicle.first_arm_angle == 0.0:
            return
        if abs(math.remainder(vehicle.first_arm_angle - self.first_arm_angle, math.tau)) > 1e-6:
            stands, meant = math.degrees(vehicle.first_arm_angle), math.degrees(self.first_arm_angle)
            raise InputError(f"{who} has its first arm at {stands:.6g}°; allowed is {meant:.6g}°, or 0°")

    def as_mapping(self) -> dict[str, Any]:
        """Return the map as plain values; read back by :func:`joint_map_from_mapping`."""
        stated = {one.name: getattr(self, one.name) for one in fields(self) if one.name != "joints"}
        plain = {name: value for name, value in stated.items() if value is not None}
        return {**plain, "joint": [joint.as_mapping() for joint in self.joints]}


_DERIVATIVES = ("_rate", "_acceleration")


def _is_name(value: object) -> bool:
    return isinstance(value, str) and bool(value.strip()) and value.isprintable() and len(value) <= _LONGEST_NAME


def _hint(value: object, known: Sequence[str]) -> str:
    return did_you_mean(value, list(known)) if isinstance(value, str) else ""


# Motors 1 to 4 of an X frame, each told as the gait's rotor when rotor 1 is at the front left (first arm at +45°,
# clockwise) or at the front right (−45°, counter-clockwise); rotors follow counter-clockwise seen from above.
_CLOCKWISE: dict[str, Any] = {"first_rotor_spin": "clockwise", "first_arm_angle": math.pi / 4}
_COUNTERCLOCKWISE: dict[str, Any] = {"first_rotor_spin": "counterclockwise", "first_arm_angle": -math.pi / 4}
_PRESETS: dict[str, tuple[str, tuple[int, ...], dict[str, Any]]] = {
    "paper": ("alpha", (1, 2, 3, 4), {}),
    "x_frame": ("tilt", (4, 2, 1, 3), _CLOCKWISE),
    "x_frame_counterclockwise": ("tilt", (1, 3, 2, 4), _COUNTERCLOCKWISE),
    "betaflight": ("tilt", (3, 4, 2, 1), _CLOCKWISE),
    "betaflight_counterclockwise": ("tilt", (4, 1, 3, 2), _COUNTERCLOCKWISE),
}


def _other_preset(name: str, spin: str) -> str:
    """Return the hint at the preset of the same numbering for the other spin."""
    other = name.removesuffix("_counterclockwise") + ("_counterclockwise" if spin == "counterclockwise" else "")
    return f"; did you mean {other!r}?" if other != name and other in _PRESETS and name in _PRESETS else ""


def joint_map_names() -> list[str]:
    """Return the names of the maps that come with the package, the paper's first.

    >>> joint_map_names()[:2]
    ['paper', 'x_frame']
    """
    return list(_PRESETS)


def _preset(name: object) -> dict[str, Any]:
    if not isinstance(name, str) or name not in _PRESETS:
        hint = _hint(name, joint_map_names())
        raise InputError(
            f"servos: {shown(name)} is neither a preset ({', '.join(joint_map_names())}) nor a .toml file{hint}"
        )
    stem, rotors, rest = _PRESETS[name]
    joints = [{"name": f"{stem}{k}", "rotor": rotor} for k, rotor in enumerate(rotors, start=1)]
    return {"name": name, **rest, "joint": joints}


_OF_JOINTS = tuple(one.name for one in fields(Joint))
_OF_ALL = tuple(name for name in _OF_JOINTS if name not in ("name", "rotor", "column"))
_OF_MAPS = ("preset", *(one.name for one in fields(JointMap) if one.name != "joints"), "joint")


def joint_map_from_mapping(stated: Mapping[str, Any]) -> JointMap:
    """Return the map that a table of plain values describes.

    Parameters
    ----------
    stated
        Field names of :class:`JointMap` to values; angles may be texts. ``joint`` is a list of four tables with the
        field names of :class:`Joint`; whatever all four joints share (unit, sign, zero, limits, pulses) may stand
        beside it. ``preset`` names the map to start from, "paper" by default.

    Raises
    ------
    InputError
        If a name is unknown or a value is not allowed.

    Examples
    --------
    >>> stated = joint_map_from_mapping({"preset": "x_frame", "unit": "us", "us_per_rad": 400})
    >>> stated.joints[0].column, joint_map_from_mapping(stated.as_mapping()) == stated
    ('tilt1_us', True)
    """
    _check_names("servos", stated, (*_OF_MAPS, *_OF_ALL))
    base = _preset(stated.get("preset", "paper"))
    shared = {name: stated[name] for name in _OF_ALL if name in stated}
    own = stated.get("joint", [{}] * 4)
    if not isinstance(own, (list, tuple)) or not all(isinstance(one, dict) for one in own):
        raise InputError(f"joint: {shown(own)}; allowed are four tables [[joint]]")
    if len(own) != 4:
        raise InputError(f"joint: there are {len(own)}; allowed are 4, one on each rotor")
    joints = []
    for number, (preset, one) in enumerate(zip(base["joint"], own, strict=True), start=1):
        _check_names(f"joint {number}", one, _OF_JOINTS)
        joints.append(Joint(**{**preset, **shared, **one}))
    rest = {name: stated[name] for name in _OF_MAPS if name in stated and name not in ("preset", "joint")}
    if any("rotor" in one for one in own):
        # An order of the user's own is for whatever vehicle the user says, not for the preset's.
        base = {**base, "first_rotor_spin": None, "first_arm_angle": None}
    whole = {name: value for name, value in {**base, **rest}.items() if name != "joint"}
    return JointMap(**whole, joints=tuple(joints))


def _check_names(what: str, stated: object, known: Sequence[str]) -> None:
    if not isinstance(stated, dict) or not all(isinstance(name, str) for name in stated):
        raise InputError(f"{what}: {shown(stated)}; allowed is a table of values by name")
    for name in stated:
        if name not in known:
            hint = did_you_mean(name, list(known)) or f"; allowed are {', '.join(known)}"
            raise InputError(f"{what}: {name!r} is no field{hint}")


def joint_map_named(name_or_file: str | Path) -> JointMap:
    """Return a preset by name, or the map in a TOML file.

    The file holds what :func:`joint_map_from_mapping` takes, at the top level or in a ``[servos]`` table, with joints
    as ``[[joint]]``.

    Raises
    ------
    InputError
        If the name is unknown or the file holds something else.
    FileProblem
        If the file cannot be read.
    """
    if isinstance(name_or_file, str) and not name_or_file.lower().endswith(".toml"):
        return joint_map_from_mapping({"preset": name_or_file})
    path = Path(name_or_file)
    text = text_of(path, "servos", "a TOML file")
    try:
        content = table_from_toml(text)
        inner = content.get("servos", content)
        if inner is not content and len(content) > 1:
            beside = next(name for name in content if name != "servos")
            raise InputError(f"{beside}: stands beside the [servos] table; allowed is inside it")
        named = {"name": path.stem, **inner} if isinstance(inner, dict) else inner
        return joint_map_from_mapping(named)
    except InputError as error:
        raise InputError(f"servos file {str(path)!r}: {error}") from error


def mapped_columns(table: Table, joint_map: JointMap, *, rows_before: int = 0) -> dict[str, FloatArray]:
    """Return the columns of a servo table: time, then each joint, then rates and accelerations if the table has them.

    Parameters
    ----------
    table
        Rows with alpha1 to alpha4.
    joint_map
        What the columns are.
    rows_before
        Rows of the same table that came before these, for messages.

    Returns
    -------
    dict
        Columns by the map's names, in its units; ``_rate`` and ``_acceleration`` of a joint in its unit per second and
        per second squared. Pulse widths have neither.

    Raises
    ------
    InputError
        If a joint leaves its limits and the map does not clip, or if the map is for another vehicle.

    Examples
    --------
    >>> from gaitgraph.gait import lift
    >>> from gaitgraph.tables import table_of
    >>> table = table_of(lift([(0.4, -0.4), (0.8, -0.8)], "red").parametrize(samples=2))
    >>> servos = joint_map_from_mapping({"preset": "x_frame", "unit": "us", "us_per_rad": 500, "time_unit": "ms"})
    >>> for name, values in mapped_columns(table, servos).items():
    ...     print(name, values.tolist())
    t [0.0, 500.0, 1000.0]
    tilt1_us [1300.0, 1100.0, 1300.0]
    tilt2_us [1300.0, 1100.0, 1300.0]
    tilt3_us [1700.0, 1900.0, 1700.0]
    tilt4_us [1700.0, 1900.0, 1700.0]
    """
    joint_map.check_vehicle(setting_of(table)[0])
    columns: dict[str, FloatArray] = {}
    if "t" in table:
        columns[joint_map.time] = np.asarray(table["t"]) * TIME_UNITS[joint_map.time_unit]
    for joint, angle in zip(joint_map.joints, _angles(table, joint_map, rows_before), strict=True):
        columns[joint.column] = np.asarray(joint.value_of_angle(angle) + 0.0)
    for names, end in zip((RATES, ACCELERATIONS), _DERIVATIVES, strict=True):
        if all(name in table for name in names):
            for joint in joint_map.joints:
                if joint.unit != "us":
                    columns[joint.column + end] = joint.sign * joint.per_radian * table[names[joint.rotor - 1]] + 0.0
    return columns


def mapped_table(table: Table, joint_map: JointMap, *, rows_before: int = 0) -> Table:
    """Return :func:`mapped_columns` as a table that says its map in ``about["servos"]``."""
    columns = mapped_columns(table, joint_map, rows_before=rows_before)
    return Table(columns=columns, about={**table.about, "servos": joint_map.as_mapping()}, rounding=table.rounding)


def clipped_rows(table: Table, joint_map: JointMap) -> dict[str, int]:
    """Return how many rows of a gait table lie beyond each joint's limits; joints that keep them are left out."""
    beyond = {joint.name: int(_beyond(joint, _values(table, joint)).sum()) for joint in joint_map.joints}
    return {name: count for name, count in beyond.items() if count}


def _values(table: Table, joint: Joint) -> FloatArray:
    return np.asarray(joint.value_of(np.asarray(table[ANGLES[joint.rotor - 1]], dtype=float)))


def _beyond(joint: Joint, values: FloatArray) -> npt.NDArray[np.bool_]:
    low, high = joint.bounds
    near = _ROUNDING * np.maximum(1.0, np.abs(values))
    return (values < low - near) | (values > high + near)


def _refused_value(joint: Joint, values: FloatArray, rows_before: int, remedy: str = "") -> InputError | None:
    """Return what to raise for the first value beyond a joint's limits, if there is one."""
    beyond = _beyond(joint, values)
    if not beyond.any():
        return None
    k = int(np.argmax(beyond))
    (low, high), unit = joint.bounds, _SHOWN_UNIT[joint.unit]
    tilt = float(np.degrees(joint.tilt_of(values[k])))
    return InputError(
        f"row {rows_before + k + 1}: joint {joint.name!r} is at {float(values[k]):.6g} {unit} (rotor {joint.rotor} at "
        f"{tilt:.4g}°); allowed is {low:.6g} to {high:.6g} {unit}{remedy}"
    )


def _angles(table: Table, joint_map: JointMap, rows_before: int) -> list[FloatArray]:
    """Return the angle q of each joint [rad], within its limits or refused."""
    angles = []
    for joint in joint_map.joints:
        alpha = np.asarray(table[ANGLES[joint.rotor - 1]], dtype=float)
        angle = joint.sign * alpha + joint.zero
        values = _values(table, joint)
        if joint_map.clip:
            inside = np.clip(values, *joint.bounds)
            angle = np.where(inside == values, angle, joint.angle_of(inside))
        elif problem := _refused_value(joint, values, rows_before, ", or clip = true"):
            raise InputError(f"servos {joint_map.name!r}: {problem}")
        angles.append(angle + 0.0)
    return angles


def check_joint_columns(names: Sequence[str], joint_map: JointMap) -> None:
    """Raise InputError unless a table with these columns has those of all joints, and the time if that is named."""
    wanted = [(joint.column, f"of joint {joint.name!r}") for joint in joint_map.joints]
    if joint_map.time != "t":
        wanted.insert(0, (joint_map.time, "of time"))
    for column, of_what in wanted:
        if column not in names:
            hint = did_you_mean(column, list(names)) or f"; there are {shown(', '.join(names))}"
            raise InputError(f"servos {joint_map.name!r}: column {column!r} {of_what} is missing{hint}")


def tilts_from_joints(
    columns: Mapping[str, npt.ArrayLike], joint_map: JointMap, *, rows_before: int = 0
) -> dict[str, FloatArray]:
    """Return t [s], alpha1 to alpha4 [rad], and rates and accelerations where all joints state them.

    Parameters
    ----------
    columns
        Finite numbers by the map's names; others are passed over.
    joint_map
        What the columns are.
    rows_before
        Rows of the same table that came before these, for messages.

    Raises
    ------
    InputError
        If a column is missing, a value is not finite, or a joint is beyond its limits.
    """
    check_joint_columns(list(columns), joint_map)
    found: dict[str, FloatArray] = {}
    by_rotor = sorted(joint_map.joints, key=lambda joint: joint.rotor)
    if joint_map.time in columns:
        found["t"] = _finite(columns, joint_map.time, rows_before) / TIME_UNITS[joint_map.time_unit]
    for name, joint in zip(ANGLES, by_rotor, strict=True):
        values = _finite(columns, joint.column, rows_before)
        if problem := _refused_value(joint, values, rows_before):
            raise InputError(f"servos {joint_map.name!r}: {problem}")
        tilt = np.asarray(joint.tilt_of(values) + 0.0)
        # π/2 told in another unit may come back a digit beyond it.
        near = np.abs(np.abs(tilt) - HALF_PI) < 1e-12
        found[name] = np.where(near, np.copysign(HALF_PI, tilt), tilt)
    for names, end in zip((RATES, ACCELERATIONS), _DERIVATIVES, strict=True):
        if all(joint.unit != "us" and joint.column + end in columns for joint in by_rotor):
            for name, joint in zip(names, by_rotor, strict=True):
                found[name] = joint.sign * _finite(columns, joint.column + end, rows_before) / joint.per_radian + 0.0
    return found


def _finite(columns: Mapping[str, npt.ArrayLike], name: str, rows_before: int) -> FloatArray:
    try:
        values = np.atleast_1d(np.asarray(columns[name], dtype=float))
    except (TypeError, ValueError) as error:
        raise InputError(f"column {name!r}: {shown(columns[name])}; allowed are finite numbers") from error
    if values.ndim != 1:
        raise InputError(f"column {name!r}: an array of shape {values.shape}; allowed is (n,)")
    wrong = ~np.isfinite(values)
    if wrong.any():
        k = int(np.argmax(wrong))
        raise InputError(f"row {rows_before + k + 1}: {name} is {float(values[k])!r}; allowed is a finite number")
    return values


def table_from_joints(
    columns: Mapping[str, Any], joint_map: JointMap, *, about: Mapping[str, Any] | None = None
) -> Table:
    """Return the gait table that a servo table tells: the inverse of :func:`mapped_columns`.

    Parameters
    ----------
    columns
        Equally long columns by the map's names; others are passed over.
    joint_map
        What the columns are.
    about
        What made the table, if that is known.

    Raises
    ------
    InputError
        As :func:`tilts_from_joints` does, or if columns are not equally long or empty.

    Examples
    --------
    >>> servos = joint_map_from_mapping({"preset": "x_frame", "unit": "deg"})
    >>> table_from_joints({f"tilt{k}_deg": [10.0 * k] for k in (1, 2, 3, 4)}, servos).alpha.round(4).tolist()
    [[0.5236, 0.3491, 0.6981, 0.1745]]
    """
    found = tilts_from_joints(columns, joint_map)
    lengths = {len(values) for values in found.values()}
    if len(lengths) > 1:
        raise InputError(f"columns have {min(lengths)} to {max(lengths)} rows; allowed are equally many")
    if 0 in lengths:
        raise InputError("columns have no rows; allowed is at least one")
    told = {name: value for name, value in (about or {}).items() if name != "servos"}
    return Table(columns=found, about=told)
