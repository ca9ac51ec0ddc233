"""Back from a servo table to tilt angles, whoever wrote it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import HALF_PI
from gaitgraph.errors import InputError, did_you_mean, shown
from gaitgraph.gait.table import ACCELERATIONS, ANGLES, RATES, Table
from gaitgraph.io.joint_limits import refused_value
from gaitgraph.io.joint_map import DERIVATIVE_ENDS, TIME_UNITS

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from gaitgraph.io.joint_map import JointMap

__all__ = ["check_joint_columns", "table_from_joints", "tilts_from_joints"]

FloatArray = npt.NDArray[np.float64]


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
        if problem := refused_value(joint, values, rows_before):
            raise InputError(f"servos {joint_map.name!r}: {problem}")
        tilt = np.asarray(joint.tilt_of(values) + 0.0)
        # π/2 told in another unit may come back a digit beyond it.
        near = np.abs(np.abs(tilt) - HALF_PI) < 1e-12
        found[name] = np.where(near, np.copysign(HALF_PI, tilt), tilt)
    for names, end in zip((RATES, ACCELERATIONS), DERIVATIVE_ENDS, strict=True):
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
    """Return the gait table that a servo table tells: the inverse of :func:`~gaitgraph.io.joint_map.mapped_columns`.

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
    >>> from gaitgraph import joint_map_from_mapping
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
