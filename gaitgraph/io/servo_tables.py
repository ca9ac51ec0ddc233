"""Servo tables: the columns that a servo map makes of a gait table, and the gait table of such columns."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import HALF_PI
from gaitgraph.errors import InputError, did_you_mean, shown
from gaitgraph.gait.table import ACCELERATIONS, ANGLES, RATES, Table, setting_of
from gaitgraph.io.servo_map import DERIVATIVE_ENDS, TIME_UNITS

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from gaitgraph.io.servo_map import Joint, ServoMap

FloatArray = npt.NDArray[np.float64]

_SHOWN_UNIT = {"rad": "rad", "deg": "°", "us": "µs"}


def mapped_columns(table: Table, servo_map: ServoMap, *, rows_before: int = 0) -> dict[str, FloatArray]:
    """Return the columns of a servo table: time, then each joint, then rates and accelerations if the table has them.

    Parameters
    ----------
    table
        Rows with alpha1 to alpha4.
    servo_map
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
    >>> from gaitgraph.gait.gait import lift
    >>> from gaitgraph.timing.timed_gait import table_of
    >>> from gaitgraph.io.servo_map import servo_map_from_mapping
    >>> table = table_of(lift([(0.4, -0.4), (0.8, -0.8)], "red").parametrize(samples=2))
    >>> servos = servo_map_from_mapping({"preset": "x_frame", "unit": "us", "us_per_rad": 500, "time_unit": "ms"})
    >>> for name, values in mapped_columns(table, servos).items():
    ...     print(name, values.tolist())
    t [0.0, 500.0, 1000.0]
    tilt1_us [1300.0, 1100.0, 1300.0]
    tilt2_us [1300.0, 1100.0, 1300.0]
    tilt3_us [1700.0, 1900.0, 1700.0]
    tilt4_us [1700.0, 1900.0, 1700.0]
    """
    servo_map.check_vehicle(setting_of(table)[0])
    columns: dict[str, FloatArray] = {}
    if "t" in table:
        columns[servo_map.time] = np.asarray(table["t"]) * TIME_UNITS[servo_map.time_unit]
    for joint in servo_map.joints:
        alpha = np.asarray(table[ANGLES[joint.rotor - 1]], dtype=float)
        angle, values = joint.sign * alpha + joint.zero, np.asarray(joint.value_of(alpha))
        if servo_map.clip:
            inside = np.clip(values, *joint.bounds)
            angle = np.where(inside == values, angle, joint.angle_of(inside))
        else:
            _check_limits(servo_map, joint, values, rows_before, " (or clip = true)")
        columns[joint.column] = np.asarray(joint.value_of_angle(angle + 0.0) + 0.0)
    for end, names in zip(DERIVATIVE_ENDS, (RATES, ACCELERATIONS), strict=True):
        if all(name in table for name in names):
            for joint in servo_map.joints:
                if joint.unit != "us":
                    columns[joint.column + end] = joint.sign * joint.per_radian * table[names[joint.rotor - 1]] + 0.0
    return columns


def mapped_table(table: Table, servo_map: ServoMap, *, rows_before: int = 0) -> Table:
    """Return :func:`mapped_columns` as a table that states its map in ``about["servos"]``."""
    columns = mapped_columns(table, servo_map, rows_before=rows_before)
    return Table(columns=columns, about={**table.about, "servos": servo_map.as_mapping()}, rounding=table.rounding)


def clipped_rows(table: Table, servo_map: ServoMap) -> dict[str, int]:
    """Return how many rows of a gait table lie beyond each joint's limits; joints within theirs are left out."""
    beyond = {}
    for joint in servo_map.joints:
        values = np.asarray(joint.value_of(np.asarray(table[ANGLES[joint.rotor - 1]], dtype=float)))
        beyond[joint.name] = int(joint.is_beyond(values).sum())
    return {name: count for name, count in beyond.items() if count}


def _check_limits(servo_map: ServoMap, joint: Joint, values: FloatArray, rows_before: int, remedy: str = "") -> None:
    """Raise InputError for the first value beyond a joint's limits, if there is one."""
    beyond = joint.is_beyond(values)
    if beyond.any():
        k = int(np.argmax(beyond))
        (low, high), unit = joint.bounds, _SHOWN_UNIT[joint.unit]
        tilt = float(np.degrees(joint.tilt_of(values[k])))
        raise InputError(
            f"servos {servo_map.name!r}: row {rows_before + k + 1}: joint {joint.name!r} must be between {low:.6g} and "
            f"{high:.6g} {unit}{remedy}, got {float(values[k]):.6g} {unit} (rotor {joint.rotor} at {tilt:.4g}°)"
        )


def check_joint_columns(names: Sequence[str], servo_map: ServoMap) -> None:
    """Raise InputError unless a table with these columns has those of all joints, and the time if that is named."""
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
    """Return the columns of a gait table from those of a servo table: the inverse of :func:`mapped_columns`.

    These are t [s], alpha1 to alpha4 [rad], and rates and accelerations where all joints state them.

    Parameters
    ----------
    columns
        Finite numbers by the map's names; others are ignored.
    servo_map
        What the columns are.
    rows_before
        Rows of the same table that came before these, for messages.

    Raises
    ------
    InputError
        If a column is missing or a joint is beyond its limits.

    Examples
    --------
    >>> from gaitgraph.io.servo_map import servo_map_from_mapping
    >>> servos = servo_map_from_mapping({"preset": "x_frame", "unit": "deg"})
    >>> found = tilts_from_joints({f"tilt{k}_deg": [10.0 * k] for k in (1, 2, 3, 4)}, servos)
    >>> [found[f"alpha{k}"].round(4).item() for k in (1, 2, 3, 4)]
    [0.5236, 0.3491, 0.6981, 0.1745]
    """
    check_joint_columns(list(columns), servo_map)
    found: dict[str, FloatArray] = {}
    by_rotor = sorted(servo_map.joints, key=lambda joint: joint.rotor)
    if servo_map.time in columns:
        found["t"] = np.asarray(columns[servo_map.time], dtype=float) / TIME_UNITS[servo_map.time_unit]
    for name, joint in zip(ANGLES, by_rotor, strict=True):
        values = np.asarray(columns[joint.column], dtype=float)
        _check_limits(servo_map, joint, values, rows_before)
        tilt = np.asarray(joint.tilt_of(values) + 0.0)
        # π/2 in another unit may come back a digit beyond it.
        near = np.abs(np.abs(tilt) - HALF_PI) < 1e-12
        found[name] = np.where(near, np.copysign(HALF_PI, tilt), tilt)
    for end, names in zip(DERIVATIVE_ENDS, (RATES, ACCELERATIONS), strict=True):
        if all(joint.unit != "us" and joint.column + end in columns for joint in by_rotor):
            for name, joint in zip(names, by_rotor, strict=True):
                values = np.asarray(columns[joint.column + end], dtype=float)
                found[name] = joint.sign * values / joint.per_radian + 0.0
    return found
