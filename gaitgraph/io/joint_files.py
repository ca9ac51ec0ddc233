"""Maps by name, from plain values, and from a TOML file."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gaitgraph.errors import InputError, did_you_mean, shown
from gaitgraph.files import table_from_toml, text_of
from gaitgraph.io.joint import Joint
from gaitgraph.io.joint_map import JointMap
from gaitgraph.io.joint_presets import mapping_of_preset

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

__all__ = ["joint_map_from_mapping", "joint_map_named"]

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
    base = mapping_of_preset(stated.get("preset", "paper"))
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
