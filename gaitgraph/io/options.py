"""What the formats for robots and microcontrollers let one choose: periods, names of joints and topics, numbers."""

from __future__ import annotations

import re
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

from gaitgraph.errors import InputError, did_you_mean, shown
from gaitgraph.gait.table import ANGLES
from gaitgraph.io.servo_map import servo_map_from_mapping

if TYPE_CHECKING:
    from collections.abc import Iterable

    from gaitgraph.gait.table import Table
    from gaitgraph.io.formats import Format

__all__ = ["NUMBERS", "TOLD_TOPIC", "FormatOptions", "check_options"]

NUMBERS = ("float", "double", "fixed")
"""What the tables of a C header are made of, the default first."""

TOLD_TOPIC = "/gaitgraph"
"""The topic that tells what made a bag."""

MOST_PERIODS = 100_000
_LONGEST_NAME = 100
_TOPIC = re.compile(r"(?:/[A-Za-z_][A-Za-z0-9_]*)+")
_IDENTIFIER = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


@dataclass(frozen=True, slots=True, kw_only=True)
class FormatOptions:
    """Choices that some formats of gait files have.

    Parameters
    ----------
    periods
        How often the gait is repeated in a bag or a ROS 2 trajectory.
    joint_names
        What the robot calls the joints that tilt rotors 1 to 4; by default alpha1 to alpha4. Of a table of joints the
        names of its joints, in their order; by default as the table says.
    trajectory_topic, states_topic
        The topics of a bag: JointTrajectory and JointState.
    number
        What the table of a C header is made of: "float", "double", or "fixed", which is 16-bit fixed point.
    c_name
        What the names in a C header begin with; by default the file's name.

    Raises
    ------
    InputError
        If a value is not allowed.

    Examples
    --------
    >>> FormatOptions(periods=3, joint_names=["a", "b", "c", "d"]).chosen()
    ['periods', 'joint_names']
    """

    periods: int = 1
    joint_names: tuple[str, ...] | None = None
    trajectory_topic: str = "/joint_trajectory"
    states_topic: str = "/joint_states"
    number: str = NUMBERS[0]
    c_name: str | None = None

    def __post_init__(self) -> None:
        periods = self.periods
        if isinstance(periods, bool) or not isinstance(periods, int) or not 1 <= periods <= MOST_PERIODS:
            raise InputError(f"periods: {shown(periods)}; allowed is a whole number from 1 to {MOST_PERIODS}")
        if self.joint_names is not None:
            object.__setattr__(self, "joint_names", _checked_names(self.joint_names))
        for name in ("trajectory_topic", "states_topic"):
            topic = getattr(self, name)
            if not (isinstance(topic, str) and len(topic) <= 255 and _TOPIC.fullmatch(topic)):
                raise InputError(f"{name}: {shown(topic)}; allowed is a topic such as '/arm/joint_states'")
            if topic == TOLD_TOPIC:
                raise InputError(f"{name}: {topic!r} tells what made the bag; allowed is another topic")
        if self.trajectory_topic == self.states_topic:
            raise InputError(f"states_topic: {self.states_topic!r} is trajectory_topic too; allowed are two topics")
        if self.number not in NUMBERS:
            hint = did_you_mean(self.number, list(NUMBERS)) if isinstance(self.number, str) else ""
            raise InputError(f"number: {shown(self.number)}; allowed are {', '.join(NUMBERS)}{hint}")
        stem = self.c_name
        if stem is not None and not (isinstance(stem, str) and len(stem) <= 60 and _IDENTIFIER.fullmatch(stem)):
            raise InputError(
                f"c_name: {shown(stem)}; allowed are up to 60 letters, digits and underscores, a letter first"
            )

    def joints_of(self, table: Table) -> tuple[tuple[str, ...], tuple[int, ...]]:
        """Return the names of a table's four joints, and which rotor each of them tilts.

        The table tells, if it is of joints; the names asked for go before those.
        """
        names: tuple[str, ...] = ANGLES
        rotors: tuple[int, ...] = (1, 2, 3, 4)
        if "servos" in table.about:
            joints = servo_map_from_mapping(table.about["servos"]).joints
            names, rotors = tuple(joint.name for joint in joints), tuple(joint.rotor for joint in joints)
        return names if self.joint_names is None else self.joint_names, rotors

    def chosen(self) -> list[str]:
        """Return the names of the options that are not as by default."""
        return [one.name for one in fields(self) if getattr(self, one.name) != one.default]


def _checked_names(names: Iterable[str]) -> tuple[str, ...]:
    """Return four joint names as a tuple, or raise InputError."""
    if isinstance(names, str) or not isinstance(names, (list, tuple)) or len(names) != len(ANGLES):
        raise InputError(f"joint_names: {shown(names)}; allowed are four names, for rotors 1 to 4")
    for name in names:
        fits = isinstance(name, str) and 0 < len(name) <= _LONGEST_NAME and name.isprintable() and name == name.strip()
        if not fits:
            raise InputError(f"joint_names: {shown(name)}; allowed is a printable text of up to {_LONGEST_NAME}")
    if len(set(names)) < len(names):
        raise InputError(f"joint_names: {shown(list(names))}; allowed are four that differ")
    return tuple(names)


def check_options(options: FormatOptions, formats: Iterable[Format]) -> None:
    """Raise InputError if an option is chosen that none of the formats has."""
    there = {name for one in formats for name in one.options}
    for name in options.chosen():
        if name not in there:
            from gaitgraph.io.formats import FORMATS

            suffixes = ", ".join(suffix for suffix, one in FORMATS.items() if name in one.options)
            raise InputError(f"{name}: {shown(getattr(options, name))}; allowed is with an output {suffixes}")
