"""Servo maps: conversion between tilt angles and four joints with an order, signs, zeros, limits and units.

A joint turns one rotor about its arm. It is at q = sign·s + zero [rad] when the rotor is tilted by α, with s = α or the
servo angle that makes α through a linkage. Its column states q in radians or degrees, normalized (−1 and 1 at the two
limits of q, as PX4's ``actuator_servos``), or as the pulse width neutral + (µs per radian)·q that a servo takes.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from functools import partial
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, Literal, get_args

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import HALF_PI, angle_from_text, number_of
from gaitgraph.arrays import check_unmasked
from gaitgraph.errors import (
    InputError,
    check_fields,
    check_kind,
    did_you_mean,
    shown,
    wrong,
)
from gaitgraph.files import from_toml_file, is_stream
from gaitgraph.gait.digits import Digits, digits_of
from gaitgraph.gait.table import (
    ACCELERATIONS,
    ANGLES,
    RATES,
    TEXTS,
    THRUSTS,
    Table,
    surface_of,
)
from gaitgraph.records import Record
from gaitgraph.vehicle import Linkage, Spin, linkage_of, linked, vehicle_named

if TYPE_CHECKING:
    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.vehicle import VehicleLike

Unit = Literal["rad", "deg", "normalized", "us"]
TimeUnit = Literal["s", "ms", "us"]

_TIME_UNITS: dict[TimeUnit, float] = {"s": 1.0, "ms": 1e3, "us": 1e6}  # in one second
_UNITS = {
    "rad": ("", " rad"),
    "deg": ("_deg", " °"),
    "normalized": ("_normalized", ""),
    "us": ("_us", " µs"),
}  # how columns end by default, and the sign
_DERIVATIVES = {"_rate": RATES, "_acceleration": ACCELERATIONS}
_WITH_RATES = ("rad", "deg")
_THRUST = "_thrust"  # ends the column of the thrust of the rotor that a joint turns
_GROUPS = {"": ANGLES, **_DERIVATIVES, _THRUST: THRUSTS}
"""How the columns of joints end, and the columns of a gait table that they are made from."""
_OF_PULSES = ("us_per_rad", "neutral_us", "limits_us", "integer")
# What a clipped table still states: not how its rows were made.
_KEPT = (
    "vehicle",
    "coefficients",
    "crossing_tolerance",
    "repeats",
    "phases",
    "limits",
)
_NAME = "a printable text of 1 to 64 characters"
_ROUNDING = 1e-9  # of a limit: what floating point may add to a value that was stated as the limit

# Motors 1 to 4 of an X frame as rotors of the gait, rotor 1 at the front left (first arm at +45°, clockwise) or at the
# front right (−45°, counter-clockwise); rotors follow counter-clockwise seen from above.
_CLOCKWISE: dict[str, Any] = {
    "first_rotor_spin": "clockwise",
    "first_arm_angle": math.pi / 4,
}
_COUNTERCLOCKWISE: dict[str, Any] = {
    "first_rotor_spin": "counterclockwise",
    "first_arm_angle": -math.pi / 4,
}
PRESETS: dict[str, tuple[str, tuple[int, ...], dict[str, Any]]] = {
    "paper": ("alpha", (1, 2, 3, 4), {}),
    "x_frame": ("tilt", (4, 2, 1, 3), _CLOCKWISE),
    "x_frame_counterclockwise": ("tilt", (1, 3, 2, 4), _COUNTERCLOCKWISE),
    "betaflight": ("tilt", (3, 4, 2, 1), _CLOCKWISE),
    "betaflight_counterclockwise": ("tilt", (4, 1, 3, 2), _COUNTERCLOCKWISE),
}
"""Maps that come with the package: how joints are called, the rotor of each, and the vehicle that this is for."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Joint(Record):
    """One joint: which rotor it turns and how, as :func:`servo_map_from_mapping` makes it.

    Parameters
    ----------
    name, column
        What the vehicle calls it, and its column in tables.
    rotor
        Which of the gait's rotors it turns, 1 to 4.
    unit
        "rad", "deg", "normalized" (−1 at the least and 1 at the largest of the limits) or "us" (pulse width, µs).
    sign, zero
        1 if it turns as α does, right-handed about the arm's outward axis, else −1; its angle q at α = 0 [rad].
    limits
        Least and largest angle q [rad], not for the unit us; None for no limits, which the unit normalized needs.
    us_per_rad, neutral_us, limits_us, integer
        For the unit us: pulse width per angle [µs/rad], at q = 0 [µs], the least and the largest [µs], and whether
        pulse widths are whole numbers.
    linkage
        That of its arm, as :class:`~gaitgraph.vehicle.Vehicle` has it; in exports the vehicle's, if it has one.
    """

    name: str
    rotor: int
    column: str
    unit: Unit = "rad"
    sign: int = 1
    zero: float = 0.0
    limits: tuple[float, float] | None = None
    us_per_rad: float | None = None
    neutral_us: float = 1500.0
    limits_us: tuple[float, float] = (1000.0, 2000.0)
    integer: bool = False
    linkage: Linkage | None = None

    def __post_init__(self) -> None:
        must = partial(_must, self, f"joint {shown(self.name)}")
        is_pulses = self.unit == "us"
        must("name", _is_name(self.name), _NAME)
        must("unit", self.unit in get_args(Unit), "rad, deg, normalized or us")
        must("column", _is_name(self.column), _NAME)
        must(
            "rotor",
            hasattr(self.rotor, "__index__") and number_of(self.rotor) in (1, 2, 3, 4),
            "1, 2, 3 or 4",
        )
        must("sign", number_of(self.sign) in (1, -1), "1 or −1")
        must("zero", math.isfinite(number_of(self.zero)), "a finite angle (rad)")
        for field in fields(self):
            if field.name in self._of_other_units:
                must(
                    field.name,
                    getattr(self, field.name) in (None, field.default),
                    f"left out for the unit {self.unit!r}",
                )
        if is_pulses:
            low, high = _pair(self.limits_us)
            slope = number_of(self.us_per_rad)
            must("integer", isinstance(self.integer, bool), "true or false")
            must(
                "us_per_rad",
                1e-3 <= slope <= 1e9,
                "between 0.001 and 1e9 µs/rad (sign = −1 turns the other way)",
            )
            must(
                "limits_us",
                0 <= low < high <= 1e6,
                "the least and the largest, between 0 and 1e6 µs, in this order",
            )
            must(
                "neutral_us",
                low <= number_of(self.neutral_us) <= high,
                f"between {low:g} and {high:g} µs",
            )
        elif self.limits is not None or self.unit == "normalized":
            low, high = _pair(self.limits)
            must(
                "limits",
                -math.inf < low < high < math.inf,
                "the least and the largest angle (rad), in this order",
            )
        self._keep_plain_numbers()

    def _keep_plain_numbers(self) -> None:
        """Keep Python's own numbers instead of others, which JSON does not take."""
        plain: dict[str, Any] = {"rotor": int(self.rotor), "sign": int(self.sign)}
        for name in ("zero", "us_per_rad", "neutral_us"):
            value = getattr(self, name)
            if not isinstance(value, (int, float, type(None))):
                plain[name] = number_of(value)
        for name, number in plain.items():
            object.__setattr__(self, name, number)  # the record is frozen

    @property
    def _of_other_units(self) -> tuple[str, ...]:
        """The fields that its unit does not have."""
        if self.unit == "us":
            return ("limits",)
        return _OF_PULSES

    @property
    def scale(self) -> tuple[float, float]:
        """Units of the column in one radian, and its value where the joint is at q = 0."""
        if self.unit == "normalized":
            low, high = _pair(self.limits)
            return 2.0 / (high - low), -(low + high) / (high - low)
        if self.unit == "deg":
            return math.degrees(1.0), 0.0
        if self.unit == "us":
            return self.us_per_rad or 1.0, self.neutral_us
        return 1.0, 0.0

    @property
    def has_rates(self) -> bool:
        """Whether tables have its rate and acceleration: not in the units that servos are commanded in."""
        return self.unit in _WITH_RATES

    @property
    def decimals(self) -> int | None:
        """Decimals of its column: 0.1 µs, or finer where that is more than 1e-3 rad; None for full precision.

        >>> Joint(name="a", column="a", rotor=1, unit="us", us_per_rad=50.0).decimals
        2
        """
        if self.us_per_rad is None:
            return None
        if self.integer:
            return 0
        return max(1, 3 - math.floor(math.log10(self.us_per_rad)))

    @property
    def rounding(self) -> float:
        """The largest error of α by the decimals of its column [rad]."""
        if self.decimals is None:
            return 0.0
        turn = 0.5 * 10.0**-self.decimals / self.scale[0]
        if self.linkage is None:
            return turn
        servo, tilt = np.array(self.linkage).T
        return turn * float(np.abs(np.diff(tilt) / np.diff(servo)).max())

    @property
    def bounds(self) -> tuple[float, float]:
        """The least and the largest value of its column, in its unit; infinite where there is no limit."""
        low, high = self.limits or (-math.inf, math.inf)
        if self.unit == "us":
            low, high = self.limits_us
        elif self.unit == "normalized":
            low, high = -1.0, 1.0
        elif self.unit == "deg":
            low, high = math.degrees(1.0) * low, math.degrees(1.0) * high
        if self.linkage is not None:
            ends = [self.linkage[0][1], self.linkage[-1][1]]
            least, most = sorted(map(float, map(self.value_of, ends)))
            low, high = max(low, least), min(high, most)
        return low, high

    def value_of(self, tilt: Any) -> Any:
        """Return the values of the column, in its unit, at tilt angles α [rad], whatever the limits."""
        turn = tilt
        if self.linkage is not None:
            turn, _ = linked(self.linkage, tilt, to_servo=True)
        per_radian, at_zero = self.scale
        return at_zero + per_radian * (self.sign * turn + self.zero)

    def angle_of(self, value: Any) -> Any:
        """Return the joint's angle q [rad] of values of the column."""
        if self.unit == "deg":
            return np.radians(value)
        per_radian, at_zero = self.scale
        return (value - at_zero) / per_radian

    def tilt_of(self, value: Any) -> Any:
        """Return the tilt angle α [rad] of values of the column: the inverse of :meth:`value_of`."""
        turn = self.sign * (self.angle_of(value) - self.zero)
        if self.linkage is None:
            return turn
        return linked(self.linkage, turn)[0]

    def slope_at(self, tilt: Any) -> Any:
        """Return by what derivatives of the column exceed those of α, at tilt angles α [rad]."""
        slope: Any = 1.0
        if self.linkage is not None:
            _, slope = linked(self.linkage, tilt, to_servo=True)
        return self.sign * self.scale[0] * slope

    def is_beyond(self, values: FloatArray) -> npt.NDArray[np.bool_]:
        """Return which values of the column exceed the limits by more than rounding."""
        low, high = self.bounds
        near = _ROUNDING * np.maximum(1.0, np.abs(values))
        return (values < low - near) | (values > high + near)

    def as_mapping(self) -> dict[str, Any]:
        """Return the fields that its unit has, as plain values."""
        return _stated(self, self._of_other_units)


@dataclass(frozen=True, slots=True, kw_only=True)
class ServoMap(Record):
    """Four joints, one on each rotor, and the time beside them; see :func:`servo_map_from_mapping`.

    Parameters
    ----------
    name, joints
        What messages call the map; its joints in the order of the table's columns.
    time, time_unit
        The column of time, and "s", "ms" or "us".
    clip
        Whether values beyond a joint's limits are clipped; otherwise they are refused.
    first_rotor_spin, first_arm_angle
        The vehicle that the order of rotors is meant for, as :class:`~gaitgraph.vehicle.Vehicle` has them [rad]; None
        if it fits any.

    >>> [joint.rotor for joint in servo_map_named("x_frame").joints]
    [4, 2, 1, 3]
    """

    name: str
    joints: tuple[Joint, ...]
    time: str = "t"
    time_unit: TimeUnit = "s"
    clip: bool = False
    first_rotor_spin: Spin | None = None
    first_arm_angle: float | None = None

    def __repr__(self) -> str:
        names = ", ".join(joint.name for joint in self.joints)
        return f"<ServoMap: {self.name!r}, joints {names}>"

    def __post_init__(self) -> None:
        must = partial(_must, self, "servos")
        must("name", _is_name(self.name), _NAME)
        must("time", _is_name(self.time), _NAME)
        must("time_unit", self.time_unit in get_args(TimeUnit), "s, ms or us")
        must("clip", isinstance(self.clip, bool), "true or false")
        must(
            "first_rotor_spin",
            self.first_rotor_spin in (None, *get_args(Spin)),
            " or ".join(get_args(Spin)),
        )
        if self.first_arm_angle is not None:
            is_finite = math.isfinite(number_of(self.first_arm_angle))
            must("first_arm_angle", is_finite, "a finite angle (rad)")
        must("joints", isinstance(self.joints, tuple), "a tuple of joints")
        rotors = tuple(joint.rotor for joint in self.joints)
        _check_different("rotors", rotors)
        _check_different("names of joints", self.joint_names)
        _check_different("columns", self.columns + TEXTS)
        must("joints", len(self.joints) == len(ANGLES), "four, one on each rotor")

    @property
    def columns(self) -> tuple[str, ...]:
        """Columns of a table: time, joints, rates and accelerations of joints in rad or deg, thrusts of their rotors."""
        return (self.time, *(column for column, _, _ in self.places))

    @property
    def places(self) -> list[tuple[str, Joint, str]]:
        """The columns of joints, each with its joint and how it ends."""
        places = []
        for end in _GROUPS:
            for joint in self.joints:
                stem = joint.name if end == _THRUST else joint.column
                if joint.has_rates or end not in _DERIVATIVES:
                    places.append((stem + end, joint, end))
        return places

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints, in order."""
        return tuple(joint.name for joint in self.joints)

    def in_radians(self) -> ServoMap:
        """Return the same joints as alpha1 to alpha4, in their order [rad], for formats that name joints themselves."""
        joints = []
        for column, joint in zip(ANGLES, self.joints, strict=True):
            low, high = map(float, map(joint.angle_of, joint.bounds))
            in_radians = Joint(
                name=joint.name,
                rotor=joint.rotor,
                column=column,
                sign=joint.sign,
                zero=joint.zero,
                linkage=joint.linkage,
            )
            if math.isfinite(low):
                in_radians = replace(in_radians, limits=(low, high))
            joints.append(in_radians)
        return replace(self, joints=tuple(joints), time="t", time_unit="s")

    def linked_to(self, vehicle: VehicleLike) -> ServoMap:
        """Return the map with the vehicle's linkages where it has none of its own."""
        vehicle = vehicle_named(vehicle)
        if vehicle.linkage is None:
            return self
        joints = []
        for joint in self.joints:
            of_arm = vehicle.linkages[joint.rotor - 1]
            joints.append(replace(joint, linkage=joint.linkage or of_arm))
        return replace(self, joints=tuple(joints))

    def check_vehicle(self, vehicle: VehicleLike) -> None:
        """Raise InputError if the order of rotors is meant for another vehicle.

        A vehicle whose first arm points forward, as the paper's, fits any map: turning the arms changes no determinant.
        Others fit if the first arm is within 45° of that of the map, as in a rectangular frame.
        """
        vehicle = vehicle_named(vehicle)
        who = f"servos {self.name!r}: vehicle"
        spin = vehicle.first_rotor_spin
        turned = vehicle.first_arm_angle
        if self.first_rotor_spin not in (None, spin):
            fitting = []
            for name, (_, _, meant_for) in PRESETS.items():
                if meant_for.get("first_rotor_spin") == spin:
                    fitting.append(name)
            raise wrong(
                who,
                f"must have rotor 1 {self.first_rotor_spin}",
                spin,
                f"; presets for it are {', '.join(fitting)}",
                got=spin,
                field="servos",
            )
        meant = self.first_arm_angle
        if (
            turned
            and meant is not None
            and abs(math.remainder(turned - meant, math.tau)) > math.pi / 4
        ):
            wanted = f"within 45° of {math.degrees(meant):.6g}°, or at 0°"
            got = f"{math.degrees(turned):.6g}°"
            rule = f"must have its first arm {wanted}"
            raise wrong(who, rule, turned, got=got, field="servos")

    def check_columns(self, names: list[str]) -> None:
        """Raise InputError unless there are the columns of all joints, and of time if it has a name of its own."""
        for name in self.columns[:5]:
            if name not in names and name != "t":
                there = f"; there are {shown(', '.join(names))}"
                near = [other for other in names if did_you_mean(other, [name])]
                if near:
                    there = f": for {near[0]!r} did you mean {name!r}?"
                raise InputError(
                    f"servos {self.name!r}: column {name!r} is missing{there}",
                    field=name,
                )

    def as_mapping(self) -> dict[str, Any]:
        """Return the map as plain values; read back by :func:`servo_map_from_mapping`."""
        stated = _stated(self, ("joints",))
        stated["joint"] = [joint.as_mapping() for joint in self.joints]
        return stated


def _stated(record: Joint | ServoMap, without: tuple[str, ...]) -> dict[str, Any]:
    """Return the fields of a record that are not None, with lists for pairs."""
    stated = {}
    for field in fields(record):
        value = getattr(record, field.name)
        if value is not None and field.name not in without:
            stated[field.name] = list(value) if isinstance(value, tuple) else value
    return stated


_JOINT_FIELDS = tuple(one.name for one in fields(Joint))
_SHARED_FIELDS = _JOINT_FIELDS[3:]  # without name, rotor and column
_MAP_FIELDS = tuple(one.name for one in fields(ServoMap) if one.name != "joints")


def servo_map_from_mapping(stated: Mapping[str, Any]) -> ServoMap:
    """Return the map that a table of plain values describes.

    It has the field names of :class:`ServoMap`; angles may be texts. ``joint`` is a list of four tables with the field
    names of :class:`Joint`; whatever all four joints share (unit, sign, zero, limits, pulses) may stand beside it.
    ``preset`` names the map to start from, "paper" by default. Unknown names are refused.

    >>> stated = servo_map_from_mapping({"preset": "x_frame", "unit": "us", "us_per_rad": 400})
    >>> stated.joints[0].column, servo_map_from_mapping(stated.as_mapping()) == stated
    ('tilt1_us', True)
    """
    known = ("preset", *_MAP_FIELDS, "joint")
    check_fields("servos", stated, known + _SHARED_FIELDS)
    preset = stated.get("preset", "paper")
    if not isinstance(preset, str) or preset not in PRESETS:
        allowed = f"a preset ({', '.join(PRESETS)}) or a .toml file"
        raise wrong(
            "servos", f"must be {allowed}", preset, did_you_mean(preset, list(PRESETS))
        )
    stem, rotors, meant_for = PRESETS[preset]
    own = stated.get("joint", [{}] * 4)
    if not isinstance(own, (list, tuple)) or len(own) != 4:
        raise wrong("joint", "must be four tables [[joint]], one on each rotor", own)
    joints = []
    shared = {name: stated[name] for name in _SHARED_FIELDS if name in stated}
    for number, (rotor, of_joint) in enumerate(zip(rotors, own, strict=True), start=1):
        check_fields(f"joint {number}", of_joint, _JOINT_FIELDS)
        joint = {"name": f"{stem}{number}", "rotor": rotor} | shared | of_joint
        if not joint.get("column"):
            ending, _ = _UNITS.get(str(joint.get("unit")), ("", ""))
            joint["column"] = f"{joint['name']}{ending}"
        joints.append(Joint(**_parsed(joint)))
    if any("rotor" in of_joint for of_joint in own):
        meant_for = {}  # an order of the user's own is for the user's vehicle, not for the preset's
    values = {"name": preset} | meant_for
    values |= {name: stated[name] for name in _MAP_FIELDS if name in stated}
    if values.get("first_arm_angle") is not None:
        values["first_arm_angle"] = angle_from_text(
            values["first_arm_angle"], "first_arm_angle"
        )
    return ServoMap(**values, joints=tuple(joints))


def _parsed(joint: dict[str, Any]) -> dict[str, Any]:
    """Return the fields of a joint with texts as numbers and pairs; :class:`Joint` refuses what is left."""
    who = f"joint {shown(joint['name'])}"
    parsed = dict(joint)
    for name, value in joint.items():
        if isinstance(value, list):
            parsed[name] = tuple(value)
    if "zero" in parsed:
        parsed["zero"] = angle_from_text(parsed["zero"], f"{who}: zero")
    if parsed.get("linkage") is not None:
        parsed["linkage"] = linkage_of(f"{who}: linkage", parsed["linkage"])
    limits = parsed.get("limits")
    if isinstance(limits, tuple):
        parsed["limits"] = tuple(
            angle_from_text(one, f"{who}: limits") for one in limits
        )
    return parsed


def _must(
    record: Joint | ServoMap, who: str, name: str, holds: object, allowed: str
) -> None:
    if not holds:
        value = getattr(record, name)
        raise wrong(f"{who}: {name}", f"must be {allowed}", value, field=name)


def _check_different(what: str, names: tuple[object, ...]) -> None:
    if len(set(names)) < len(names):
        got = ", ".join(map(str, names))
        raise wrong(
            f"servos: {what}", "must all differ", names, got=got, field="joints"
        )


def _is_name(value: object) -> bool:
    return (
        isinstance(value, str)
        and value.strip() != ""
        and value.isprintable()
        and len(value) <= 64
    )


def _pair(value: object) -> tuple[float, float]:
    """Return a pair of numbers, or (1, 0), which no limits can be."""
    if isinstance(value, tuple) and len(value) == 2:
        low, high = map(number_of, value)
    else:
        low, high = (1.0, 0.0)
    return low, high


ServoMapLike = ServoMap | str | Path | Mapping[str, Any]
"""What may be given for a servo map: see :func:`servo_map_named`."""


def servo_map_named(servos: ServoMapLike | IO[Any]) -> ServoMap:
    """Return a preset by name, the map in a TOML file, that of a mapping of fields, or a ServoMap as it is.

    The file, or an open stream, holds what :func:`servo_map_from_mapping` takes, at the top level or in a ``[servos]`` table, with joints
    as ``[[joint]]``. Raises InputError, or FileProblem if the file cannot be read.
    """
    if isinstance(servos, ServoMap):
        return servos
    if isinstance(servos, Mapping):
        return servo_map_from_mapping(servos)
    if is_stream(servos):
        return from_toml_file(servos, "servos", servo_map_from_mapping)
    if not isinstance(servos, Path) and not str(servos).lower().endswith(".toml"):
        return servo_map_from_mapping({"preset": servos})
    path = Path(servos)
    return from_toml_file(
        path,
        "servos",
        lambda stated: servo_map_from_mapping({"name": path.stem, **stated}),
    )


# -- Tables of joints


def servos_of(table: Table) -> ServoMap:
    """Return the map of the joints that a table states, or that of the paper's rotors."""
    return servo_map_from_mapping(table.about.get("servos", {}))


def mapped_table(table: Table, servo_map: ServoMapLike) -> Table:
    """Return a gait table in the columns of a map, which it states in ``about["servos"]``.

    The table has alpha1 to alpha4. Where it has rates and accelerations, so have joints in radians or degrees. Where it
    has hover thrusts, each joint has that of its rotor, as NAME_thrust [N]. Pulse widths are rounded to 0.1 µs or 1 µs,
    and ``about["angle_rounding"]`` states the error [rad]. Raises InputError if a joint is beyond its limits, unless the
    map clips, or if the map is for another vehicle.
    """
    check_kind("table", table, Table)
    for name in ANGLES:
        if name not in table:
            raise InputError(
                f"column {name!r} is missing; a servo map needs four angles", field=name
            )
    vehicle = surface_of(table)[0]
    servo_map = servo_map_named(servo_map)
    servo_map.check_vehicle(vehicle)
    servo_map = servo_map.linked_to(vehicle)
    columns: dict[str, FloatArray] = {}
    if "t" in table:
        columns[servo_map.time] = (
            np.asarray(table["t"]) * _TIME_UNITS[servo_map.time_unit]
        )
    for column, joint, end in servo_map.places:
        names = _GROUPS[end]
        if not all(name in table for name in names):
            continue
        values = table[names[joint.rotor - 1]]
        if end == "":
            values = _positions(values, joint, servo_map)
        elif end in _DERIVATIVES:
            slope = joint.slope_at(table[ANGLES[joint.rotor - 1]])
            values = slope * values + 0.0
        columns[column] = values
    about = table.about | {"servos": servo_map.as_mapping()}
    rounding = table.rounding + max(joint.rounding for joint in servo_map.joints)
    if rounding:
        about["angle_rounding"] = rounding
    mapped = Table(columns=columns, about=about)
    if table.motion is None:
        return mapped
    return mapped.with_motion(table.motion)


def _positions(tilts: FloatArray, joint: Joint, servo_map: ServoMap) -> FloatArray:
    """Return the column of a joint, clipped and rounded as the map says; InputError beyond its limits."""
    values: FloatArray = joint.value_of(tilts)
    if servo_map.clip:
        values = np.clip(values, *joint.bounds)
    else:
        _check_limits(servo_map, joint, values, " (or clip = true)")
    if joint.decimals is not None:
        values = np.clip(np.round(values, joint.decimals), *joint.bounds)
    if joint.integer:
        return np.rint(values).astype(np.int64)
    return values


def clipped_table(table: Table, servo_map: ServoMap) -> tuple[Table, dict[str, int]]:
    """Return a gait table with all tilts within the joints' limits, and the number of rows beyond those of each joint.

    If there are such rows it is another motion, which no law states; joints without them are not counted.
    """
    columns: dict[str, Any] = {name: table[name] for name in ("t",) if name in table}
    counts = {}
    for joint in servo_map.linked_to(surface_of(table)[0]).joints:
        name = ANGLES[joint.rotor - 1]
        tilts = table[name].copy()
        values = joint.value_of(tilts)
        beyond = joint.is_beyond(values)
        if beyond.any():
            counts[joint.name] = int(beyond.sum())
        tilts[beyond] = joint.tilt_of(np.clip(values[beyond], *joint.bounds))
        columns[name] = tilts
    if not counts:
        return table, counts
    about = {name: table.about[name] for name in _KEPT if name in table.about}
    return Table(columns=columns, about=about), counts


def _check_limits(
    servo_map: ServoMap, joint: Joint, values: FloatArray, remedy: str = ""
) -> None:
    """Raise InputError for the first value beyond a joint's limits, if there is one."""
    beyond = joint.is_beyond(values)
    if not beyond.any():
        return
    k = int(np.argmax(beyond))
    low, high = joint.bounds
    unit = _UNITS[joint.unit][1]
    degrees = np.degrees(joint.tilt_of(values[k]))
    wanted = (
        f"joint {joint.name!r} must be between {low:.6g} and {high:.6g}{unit}{remedy}"
    )
    got = f"{values[k]:.6g}{unit} (rotor {joint.rotor} at {degrees:.4g}°)"
    raise InputError(
        f"servos {servo_map.name!r}: row {k + 1}: {wanted}, got {got}",
        field=joint.column,
        row=k + 1,
        value=float(values[k]),
    )


def tilts_from_joints(
    columns: Mapping[str, npt.ArrayLike], servo_map: ServoMapLike
) -> dict[str, FloatArray]:
    """Return the columns of a gait table from those of joints: the inverse of :func:`mapped_table`.

    These are t [s], alpha1 to alpha4 [rad], rates and accelerations where all joints state them, and thrusts [N]; other
    columns are ignored. Raises InputError if one is missing or a joint is beyond its limits.

    >>> servos = servo_map_from_mapping({"preset": "x_frame", "unit": "deg"})
    >>> found = tilts_from_joints({f"tilt{k}_deg": [10.0 * k] for k in (1, 2, 3, 4)}, servos)
    >>> [found[f"alpha{k}"].round(4).item() for k in (1, 2, 3, 4)]
    [0.5236, 0.3491, 0.6981, 0.1745]
    >>> turned = servo_map_from_mapping({"joint": [{"rotor": k, "sign": -1} for k in (1, 2, 3, 4)]})
    >>> tilts_from_joints({joint.column: [0.0] for joint in turned.joints}, turned)["alpha1"].tolist()
    [0.0]
    """
    servo_map = servo_map_named(servo_map)
    servo_map.check_columns(list(columns))
    for name, values in columns.items():
        check_unmasked(values, name)
    found: dict[str, FloatArray] = {}
    if servo_map.time in columns:
        times = np.asarray(columns[servo_map.time], dtype=float)
        found["t"] = times / _TIME_UNITS[servo_map.time_unit]
    for column, joint, end in servo_map.places:
        if column not in columns:
            continue
        values = np.asarray(columns[column], dtype=float)
        if end == "":
            _check_limits(servo_map, joint, values)
            values = _near_ends(joint.tilt_of(values) + 0.0, joint.rounding)
        elif end in _DERIVATIVES:
            values = values / joint.slope_at(found[ANGLES[joint.rotor - 1]]) + 0.0
        found[_GROUPS[end][joint.rotor - 1]] = values
    for names in _DERIVATIVES.values():
        if not all(name in found for name in names):
            for name in names:
                found.pop(name, None)
    order = ("t", *ANGLES, *RATES, *ACCELERATIONS, *THRUSTS)
    return {name: found[name] for name in order if name in found}


def _near_ends(tilts: FloatArray, rounding: float) -> FloatArray:
    """Return tilts with ±π/2 for what is beyond it by rounding: in another unit it may come back a digit beyond."""
    beyond = np.abs(tilts) - HALF_PI
    near = (beyond > 0) & (beyond < 1e-12 + rounding)
    return np.asarray(np.where(near, np.copysign(HALF_PI, tilts), tilts))


def digits_from_joints(
    columns: Mapping[str, FloatArray], servo_map: ServoMap
) -> dict[str, Digits]:
    """Return the digits of the columns that :func:`tilts_from_joints` returns, as printed in those of joints."""
    found = {}
    if servo_map.time in columns:
        unit = 1.0 / _TIME_UNITS[servo_map.time_unit]
        found["t"] = digits_of(columns[servo_map.time], unit)
    for column, joint, end in servo_map.places:
        if column not in columns:
            continue
        digits = digits_of(columns[column])
        if end != _THRUST:
            slopes = np.abs(joint.slope_at(joint.tilt_of(columns[joint.column])))
            unit = 1.0 / float(slopes.min())
            digits = Digits(digits.decimals, 99, unit, steps=True)
        found[_GROUPS[end][joint.rotor - 1]] = digits
    return found
