"""The maps that come with the package, as plain values: how motors are numbered on the vehicles that are about."""

from __future__ import annotations

import math
from typing import Any

from gaitgraph.errors import InputError, shown
from gaitgraph.io.joint import hint_at

__all__ = ["joint_map_names", "mapping_of_preset", "preset_for_spin"]

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


def preset_for_spin(name: str, spin: str) -> str | None:
    """Return the preset of the same numbering for a vehicle of another spin, or None if there is none.

    >>> preset_for_spin("x_frame", "counterclockwise")
    'x_frame_counterclockwise'
    """
    other = name.removesuffix("_counterclockwise") + ("_counterclockwise" if spin == "counterclockwise" else "")
    return other if other != name and other in _PRESETS and name in _PRESETS else None


def joint_map_names() -> list[str]:
    """Return the names of the maps that come with the package, the paper's first.

    >>> joint_map_names()[:2]
    ['paper', 'x_frame']
    """
    return list(_PRESETS)


def mapping_of_preset(name: object) -> dict[str, Any]:
    """Return a preset as the values that :class:`gaitgraph.io.joint_map.JointMap` takes, its joints as mappings.

    Raises
    ------
    InputError
        If there is no preset of that name.

    Examples
    --------
    >>> mapping_of_preset("x_frame")["joint"][0]
    {'name': 'tilt1', 'rotor': 4}
    """
    if not isinstance(name, str) or name not in _PRESETS:
        hint = hint_at(name, joint_map_names())
        raise InputError(
            f"servos: {shown(name)} is neither a preset ({', '.join(joint_map_names())}) nor a .toml file{hint}"
        )
    stem, rotors, rest = _PRESETS[name]
    joints = [{"name": f"{stem}{k}", "rotor": rotor} for k, rotor in enumerate(rotors, start=1)]
    return {"name": name, **rest, "joint": joints}
