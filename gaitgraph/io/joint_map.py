"""Four joints, one on each rotor, with the time beside them: what turns a gait table into a servo table."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import angle_from_text
from gaitgraph.errors import InputError, shown
from gaitgraph.gait.table import ACCELERATIONS, ANGLES, RATES, TEXTS, Table, setting_of
from gaitgraph.io.joint import Joint, hint_at, is_column_name
from gaitgraph.io.joint_limits import beyond_limits, refused_value, values_of_joint
from gaitgraph.io.joint_presets import preset_for_spin

if TYPE_CHECKING:
    from gaitgraph.vehicle import Vehicle

__all__ = ["DERIVATIVE_ENDS", "TIME_UNITS", "JointMap", "clipped_rows", "mapped_columns", "mapped_table"]

FloatArray = npt.NDArray[np.float64]

TIME_UNITS = {"s": 1.0, "ms": 1e3, "us": 1e6}
"""Units of time in one second."""

DERIVATIVE_ENDS = ("_rate", "_acceleration")
"""What follows the name of a joint's column in those of its rates and accelerations."""


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
    >>> from gaitgraph import joint_map_named
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
        if not is_column_name(self.time):
            raise InputError(f"time: {shown(self.time)}; allowed is the name of a column")
        if self.time_unit not in TIME_UNITS:
            hint = hint_at(self.time_unit, tuple(TIME_UNITS))
            raise InputError(f"time_unit: {shown(self.time_unit)}; allowed are {', '.join(TIME_UNITS)}{hint}")
        if not isinstance(self.clip, bool):
            raise InputError(f"clip: {shown(self.clip)}; allowed are true and false")
        spins = ("clockwise", "counterclockwise")
        if self.first_rotor_spin is not None and self.first_rotor_spin not in spins:
            hint = hint_at(self.first_rotor_spin, spins)
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
        for name in self.columns:
            if name in TEXTS:
                raise InputError(f"column: {name!r} is one of texts in a gait table; allowed is another name")

    @property
    def columns(self) -> tuple[str, ...]:
        """Columns of a table: time, joints, then rates and accelerations of joints that are not told as pulses."""
        derived = (joint.column + end for end in DERIVATIVE_ENDS for joint in self.joints if joint.unit != "us")
        return (self.time, *(joint.column for joint in self.joints), *derived)

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints, in order."""
        return tuple(joint.name for joint in self.joints)

    def in_radians(self) -> JointMap:
        """Return the same joints as alpha1 to alpha4, in their order [rad], for formats that name joints on their own.

        >>> from gaitgraph import joint_map_named
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
            other = preset_for_spin(self.name, vehicle.first_rotor_spin)
            raise InputError(
                f"{who} has rotor 1 {vehicle.first_rotor_spin}; allowed is {self.first_rotor_spin}"
                + (f"; did you mean {other!r}?" if other else "")
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
    >>> from gaitgraph import joint_map_from_mapping
    >>> from gaitgraph.gait.gait import lift
    >>> from gaitgraph.gait.table import table_of
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
    for names, end in zip((RATES, ACCELERATIONS), DERIVATIVE_ENDS, strict=True):
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
    beyond = {joint.name: int(beyond_limits(joint, values_of_joint(table, joint)).sum()) for joint in joint_map.joints}
    return {name: count for name, count in beyond.items() if count}


def _angles(table: Table, joint_map: JointMap, rows_before: int) -> list[FloatArray]:
    """Return the angle q of each joint [rad], within its limits or refused."""
    angles = []
    for joint in joint_map.joints:
        alpha = np.asarray(table[ANGLES[joint.rotor - 1]], dtype=float)
        angle = joint.sign * alpha + joint.zero
        values = values_of_joint(table, joint)
        if joint_map.clip:
            inside = np.clip(values, *joint.bounds)
            angle = np.where(inside == values, angle, joint.angle_of(inside))
        elif problem := refused_value(joint, values, rows_before, ", or clip = true"):
            raise InputError(f"servos {joint_map.name!r}: {problem}")
        angles.append(angle + 0.0)
    return angles
