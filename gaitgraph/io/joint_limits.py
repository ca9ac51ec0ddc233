"""Values beyond a joint's limits: which they are, and what is said of the first."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from gaitgraph.errors import InputError
from gaitgraph.gait.table import ANGLES

if TYPE_CHECKING:
    from gaitgraph.gait.table import Table
    from gaitgraph.io.joint import Joint

__all__ = ["beyond_limits", "refused_value", "values_of_joint"]

FloatArray = npt.NDArray[np.float64]

_SHOWN_UNIT = {"rad": "rad", "deg": "°", "us": "µs"}
_ROUNDING = 1e-9
"""Relative to a limit: what floating point may add to a value that was stated as the limit."""


def values_of_joint(table: Table, joint: Joint) -> FloatArray:
    """Return what the column of a joint says for the rows of a gait table, in its unit, whatever the limits."""
    return np.asarray(joint.value_of(np.asarray(table[ANGLES[joint.rotor - 1]], dtype=float)))


def beyond_limits(joint: Joint, values: FloatArray) -> npt.NDArray[np.bool_]:
    """Return which values of a joint's column are beyond its limits; rounding is not.

    >>> from gaitgraph.io.joint import Joint
    >>> beyond_limits(Joint(name="tilt", rotor=1, limits=(-0.5, 0.5)), np.array([0.5 + 1e-12, 0.6])).tolist()
    [False, True]
    """
    low, high = joint.bounds
    near = _ROUNDING * np.maximum(1.0, np.abs(values))
    return (values < low - near) | (values > high + near)


def refused_value(joint: Joint, values: FloatArray, rows_before: int, remedy: str = "") -> InputError | None:
    """Return what to raise for the first value beyond a joint's limits, if there is one."""
    beyond = beyond_limits(joint, values)
    if not beyond.any():
        return None
    k = int(np.argmax(beyond))
    (low, high), unit = joint.bounds, _SHOWN_UNIT[joint.unit]
    tilt = float(np.degrees(joint.tilt_of(values[k])))
    return InputError(
        f"row {rows_before + k + 1}: joint {joint.name!r} is at {float(values[k]):.6g} {unit} (rotor {joint.rotor} at "
        f"{tilt:.4g}°); allowed is {low:.6g} to {high:.6g} {unit}{remedy}"
    )
