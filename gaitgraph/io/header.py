"""The columns of a table by their names: which there must be, what each becomes, how far its values may go."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitgraph.angles import HALF_PI
from gaitgraph.errors import InputError, did_you_mean, shown
from gaitgraph.gait.table import ACCELERATIONS, ANGLES, DEGREES, ORDER, RATES, TEXTS
from gaitgraph.io.servo_map import servo_map_from_mapping
from gaitgraph.io.servo_tables import check_joint_columns, tilts_from_joints
from gaitgraph.io.values import numbers_of, texts_of

if TYPE_CHECKING:
    from gaitgraph.io.servo_map import ServoMap

__all__ = ["Header", "joints_of", "rows_of"]

_FASTEST = 1e12
_FARTHEST = 1e6  # beyond it floating point carries no angle
_OTHERS_TOLD, _MOST_OTHERS = 5, 1000


class Header:
    """The names of a table's columns, checked; turns raw columns into those of a :class:`Table`."""

    def __init__(self, names: list[str], plane_only: bool, joints: ServoMap | None = None) -> None:
        self.names = names
        self.joints = joints
        # Of a map of joints, each with the radians in its unit; then angles under the usual names are none.
        self.of_joints = {joint.column: 1.0 / joint.per_radian for joint in joints.joints} if joints else {}
        for name, count in Counter(names).items():
            if count > 1:
                raise InputError(
                    f"column {name!r} appears {'twice' if count == 2 else f'{count} times'}; allowed is once"
                )
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
                hint = _others(name, [other for other in names if other not in ORDER])
                wanted = "alpha1 to alpha4 (rad) or alpha1_deg to alpha4_deg, or alpha1, alpha2 and color"
                raise InputError(f"column {name!r} is missing; allowed are {wanted}{hint}")

    def _dtype(self, name: str) -> str:
        if self.joints is not None and name in self.joints.columns:
            return "f8"
        if name in TEXTS:
            return "U8"
        return "f8" if name in ORDER or (name in DEGREES and self.joints is None) else "U1"

    def columns(self, raw: list[Any], row: int, *, angle_texts: bool = False) -> dict[str, Any]:
        """Return checked columns in order; `row` is the number of rows before these."""
        found: dict[str, Any] = {}
        if self.joints is not None:
            told = {name: values for name, values in zip(self.names, raw, strict=True) if name in self.joints.columns}
            for name, values in told.items():
                if values is None:
                    raise InputError(f"{name}: it is no column of numbers, one a row; allowed is one")
            numbers = {name: numbers_of(name, values, row) for name, values in told.items()}
            found |= tilts_from_joints(numbers, self.joints, rows_before=row)
        for name, values in zip(self.names, raw, strict=True):
            if self.joints is not None and (name in self.joints.columns or name not in ("color", "types", "R")):
                continue
            if name in TEXTS:
                found[name] = texts_of(name, values, row)
            elif name in DEGREES:
                found[DEGREES[name]] = np.radians(numbers_of(name, values, row))
            elif name in ORDER:
                found[name] = numbers_of(name, values, row, angle_texts=angle_texts and name in ANGLES)
        for name in ANGLES[:2]:
            beyond = np.abs(found[name]) > HALF_PI
            if beyond.any():
                k = int(np.argmax(beyond))
                value = float(found[name][k])
                raise InputError(f"row {row + k + 1}: {name} is {value!r} rad; allowed is −π/2 to π/2 (±{HALF_PI!r})")
        limits = dict.fromkeys(ANGLES[2:], _FARTHEST) | dict.fromkeys(("R", *RATES, *ACCELERATIONS), _FASTEST)
        for name, limit in limits.items():
            beyond = np.abs(found.get(name, np.zeros(0))) > limit
            if beyond.any():
                k = int(np.argmax(beyond))
                value = float(found[name][k])
                raise InputError(f"row {row + k + 1}: {name} is {value!r}; allowed is up to {limit:g}")
        return {name: found[name] for name in ORDER if name in found}


def _others(name: str, others: list[str]) -> str:
    """Return which other column may be meant, or else which there are."""
    told = ", ".join(map(shown, others[:_OTHERS_TOLD])) + (", …" if len(others) > _OTHERS_TOLD else "")
    return did_you_mean(name, others[:_MOST_OTHERS]) or (f"; there are {told}" if others else "")


def joints_of(about: dict[str, Any], joints: ServoMap | None) -> tuple[dict[str, Any], ServoMap | None]:
    """Return what made a file without its map of joints, and the map: as asked for, else as the file says, if it does.

    What is read is told of tilt angles, so the map is none of its making.
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
