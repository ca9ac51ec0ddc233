"""ROS 2: bags with MCAP in them, by rosbags, and the YAML goal of a joint_trajectory_controller.

A bag has three topics: what made it, in one String; the JointTrajectory, one message stamped 0, which makes a
controller start at once; and a JointState for each point, for plotting, from 1 s on, since tools take 0 for "not set".
That of a flight has a fourth, a PoseStamped of the body for each point. Bags have version 8, since Humble cannot read
version 9. A goal states in a comment what made it.
"""

from __future__ import annotations

import json
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.errors import InputError, shown, wrong
from gaitgraph.gait.table import (
    ACCELERATIONS,
    ANGLES,
    RATES,
    Table,
    about_from_text,
    check_periods,
    provenance_of,
    provenance_text,
)
from gaitgraph.io.binary_tables import library
from gaitgraph.io.columns import RawTable
from gaitgraph.io.servo_map import servos_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path

    from rosbags.rosbag2 import Reader
    from rosbags.typesys.store import Typestore

    from gaitgraph.invertibility.forms import FloatArray

TRAJECTORY = "trajectory_msgs/msg/JointTrajectory"
STATE = "sensor_msgs/msg/JointState"
STRING = "std_msgs/msg/String"
POSE = "geometry_msgs/msg/PoseStamped"
TOPICS = {
    STRING: "/gaitgraph",
    TRAJECTORY: "/joint_trajectory",
    STATE: "/joint_states",
    POSE: "/pose",
}

_BAG = "a ROS 2 bag"
_MOST_POINTS = 100_000
_PLACE = ("x", "y", "z")
_ATTITUDE = ("yaw", "pitch", "roll")  # in the order of the turns
_COLUMNS = {"positions": ANGLES, "velocities": RATES, "accelerations": ACCELERATIONS}
_NANOSECONDS = 1_000_000_000
_LAST_SECOND = (
    2**31 - 2
)  # seconds are whole numbers of 32 bits, and stamps begin a second later
_SHORTEST_STEP = 2
_NONE = np.zeros(0)


def check_rows(table: Table, most: int, what: str) -> None:
    """Raise InputError unless a table has times, four angles, and at most so many rows."""
    if len(table) > most:
        raise wrong(
            "rows",
            f"must be at most {most} in {what}",
            len(table),
            ": use fewer samples, or a lower rate",
        )
    for name in ("t", "alpha3"):
        if name not in table:
            raise InputError(
                f"column {name!r} is missing; {what} needs a table with times and four angles",
                field=name,
            )


def points_of(
    table: Table, periods: int = 1
) -> tuple[npt.NDArray[np.int64], dict[str, FloatArray]]:
    """Return a table's rows, repeated; the row where one period ends and the next begins is there once.

    Returns times since the first point, shape (n,) [ns], strictly increasing, and rows: `positions`, and `velocities`
    and `accelerations` if the table's rows are joined by cubics and has them, shape (n, 4) [rad], [rad/s], [rad/s²].
    """
    check_periods(table, periods)
    rows = len(table)
    if (rows - 1) * periods + 1 > _MOST_POINTS:
        raise wrong(
            "points",
            f"must be at most {_MOST_POINTS}",
            rows * periods,
            got=f"{periods} periods of {rows} rows: use fewer periods or samples",
        )
    seconds = table["t"] - table["t"][0]
    if seconds[-1] * periods > _LAST_SECOND:
        raise wrong(
            "time",
            f"must be at most {_LAST_SECOND} s in all",
            periods,
            f" periods of {seconds[-1]:g} s",
        )
    once = np.rint(seconds * _NANOSECONDS).astype(np.int64)
    begins = np.repeat(np.arange(periods), rows - 1) * once[-1]
    times = np.append(once[:1], np.tile(once[1:], periods) + begins)
    if len(times) > 1 and np.diff(times).min() < _SHORTEST_STEP:
        raise InputError(
            f"t must have steps of at least {_SHORTEST_STEP} ns, as ROS counts nanoseconds, got less"
        )
    points = {}
    for what, names in _COLUMNS.items():
        # A controller joins positions alone by straight lines, and with velocities by cubics.
        is_stated = all(name in table for name in names)
        if what == "positions" or (table.joined_by_cubics and is_stated):
            values = np.column_stack([table[name] for name in names])
            again = np.tile(values[1:], (periods - 1, 1))
            points[what] = np.concatenate([values, again])
    return times, points


# -- The goal of an action


def write_yaml(table: Table, path: Path, periods: int = 1) -> None:
    """Write a new file with the goal of an action, as ``ros2 action send_goal`` takes it; times are in nanoseconds."""
    check_rows(table, _MOST_POINTS, "a ROS 2 trajectory")
    times, rows = points_of(table, periods)
    lines = [
        "# A goal of control_msgs/action/FollowJointTrajectory; angles in rad, with rad/s and rad/s².",
        f"# made_by: {provenance_text(table)}",
        "trajectory:",
        f"  joint_names: {json.dumps(servos_of(table).joint_names, ensure_ascii=False)}",
        "  points:",
    ]
    for row, time in enumerate(times.tolist()):
        fields = []
        for what, values in rows.items():
            numbers = ", ".join(map(_number, values[row].tolist()))
            fields.append(f"{what}: [{numbers}]")
        seconds, nanoseconds = divmod(time, _NANOSECONDS)
        fields.append(f"time_from_start: {{sec: {seconds}, nanosec: {nanoseconds}}}")
        lines.append(f"  - {{{', '.join(fields)}}}")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _number(value: float) -> str:
    """Return a number as YAML 1.1 reads it: an exponent without a point before it would be a text."""
    text = repr(value)
    if "." in text:
        return text
    return text.replace("e", ".0e")


# -- Bags


def write_mcap(table: Table, path: Path, periods: int = 1) -> None:
    """Write a new folder: a bag with an MCAP file, which the library names after the folder."""
    from rosbags.rosbag2 import StoragePlugin, Writer

    check_rows(table, _MOST_POINTS, "a ROS 2 bag")
    times, stated = points_of(table, periods)
    rows = dict.fromkeys(_COLUMNS, np.zeros((len(times), 0))) | stated
    stamps = (times + _NANOSECONDS).tolist()
    names = list(servos_of(table).joint_names)
    chosen = {"periods": periods, "joint_names": names}
    made = json.dumps(provenance_of(table) | {"bag": chosen}, allow_nan=False)
    messages: dict[str, Iterable[Any]] = {
        STRING: [_message(STRING, data=made)],
        TRAJECTORY: [_trajectory(names, times, rows)],
        STATE: _states(names, stamps, rows),
    }
    if all(name in table for name in _PLACE + _ATTITUDE):
        messages[POSE] = _poses(table, stamps)
    folder = path.with_suffix("")
    with Writer(folder, version=8, storage_plugin=StoragePlugin.MCAP) as bag:
        connections = {}
        for kind in messages:
            topic = TOPICS[kind]
            connections[kind] = bag.add_connection(topic, kind, typestore=_store())
        for kind, some in messages.items():
            for time, message in zip(stamps, some, strict=False):
                content = _store().serialize_cdr(message, kind)
                bag.write(connections[kind], time, content)
    folder.rename(path)


def _trajectory(
    names: list[str], times: npt.NDArray[np.int64], rows: dict[str, FloatArray]
) -> Any:
    points = []
    for row, time in enumerate(times.tolist()):
        point = _message(
            f"{TRAJECTORY}Point",
            positions=rows["positions"][row],
            velocities=rows["velocities"][row],
            accelerations=rows["accelerations"][row],
            effort=_NONE,
            time_from_start=_moment("Duration", time),
        )
        points.append(point)
    header = _header(0)
    return _message(TRAJECTORY, header=header, joint_names=names, points=points)


def _states(
    names: list[str], stamps: list[int], rows: dict[str, FloatArray]
) -> Iterator[Any]:
    for row, time in enumerate(stamps):
        yield _message(
            STATE,
            header=_header(time),
            name=names,
            position=rows["positions"][row],
            velocity=rows["velocities"][row],
            effort=_NONE,
        )


def _poses(table: Table, stamps: list[int]) -> Iterator[Any]:
    from scipy.spatial.transform import Rotation

    turns = np.column_stack([table[name] for name in _ATTITUDE])
    quaternions = Rotation.from_euler("ZYX", turns).as_quat().tolist()
    for row, (time, quaternion) in enumerate(zip(stamps, quaternions, strict=False)):
        place = {name: float(table[name][row]) for name in _PLACE}
        turn = dict(zip("xyzw", quaternion, strict=True))
        pose = _message(
            "geometry_msgs/msg/Pose",
            position=_message("geometry_msgs/msg/Point", **place),
            orientation=_message("geometry_msgs/msg/Quaternion", **turn),
        )
        yield _message(POSE, header=_header(time, "world"), pose=pose)


def _header(time: int, frame: str = "") -> Any:
    stamp = _moment("Time", time)
    return _message("std_msgs/msg/Header", stamp=stamp, frame_id=frame)


def _moment(kind: str, time: int) -> Any:
    seconds, nanoseconds = divmod(time, _NANOSECONDS)
    name = f"builtin_interfaces/msg/{kind}"
    return _message(name, sec=seconds, nanosec=nanoseconds)


def _message(kind: str, **fields: Any) -> Any:
    return _store().types[kind](**fields)


@cache
def _store() -> Typestore:
    from rosbags.typesys import Stores, get_typestore

    return get_typestore(
        Stores.ROS2_HUMBLE
    )  # these messages are the same in all distributions


def read_mcap(path: Path) -> RawTable:
    """Return the gait of a bag or of its file: its JointTrajectory, else its JointStates; of ours, one period."""
    from rosbags.rosbag2 import Reader

    if path.is_dir() and not (path / "metadata.yaml").is_file():
        raise InputError(
            "it must have a metadata.yaml, got none: ros2 bag reindex writes one"
        )
    about: dict[str, Any] = {}
    chosen: dict[str, Any] = {}  # the options that a bag of ours was written with
    with library(_BAG), Reader(path) as bag:
        texts = _messages(bag, STRING, TOPICS[STRING])
        if texts:
            text = texts[0][1].data
            about = about_from_text(text, required=True)
            stated = json.loads(text).get("bag")
            if isinstance(stated, dict):
                chosen = stated
        names, times, rows = _recorded(bag, chosen.get("periods"))
    start = times[0]
    seconds = [(time - start) / _NANOSECONDS for time in times]
    columns: dict[str, Any] = {"t": np.array(seconds)}
    columns |= _columns(names, rows, chosen.get("joint_names"))
    return RawTable(columns=columns, about=about, angle_texts=True)


def _messages(bag: Reader, kind: str, topic: str) -> list[tuple[int, Any]]:
    """Return the messages of a kind in a topic, which may be recorded several times, with the times of their records [ns]."""
    connections = [
        connection
        for connection in bag.connections
        if (connection.msgtype, connection.topic) == (kind, topic)
    ]
    messages: list[tuple[int, Any]] = []
    if not connections:  # which would mean all
        return messages
    for _, time, content in bag.messages(connections):
        messages.append((time, _store().deserialize_cdr(content, kind)))
    return messages


def _recorded(
    bag: Reader, periods: object
) -> tuple[list[str], list[int], dict[str, list[FloatArray]]]:
    """Return names of joints, times [ns], and positions, velocities and accelerations of a bag.

    They are those of its JointTrajectory, of our own one period, else of its JointStates, all periods, by the time of
    their records if none is stamped.
    """
    topic = _topic_of(bag, TRAJECTORY)
    messages = _messages(bag, TRAJECTORY, topic)
    if messages:
        trajectory = messages[0][1]
        points = trajectory.points
        if len(messages) > 1 or not points:
            got = f"{len(messages)}, the first of {len(points)} points"
            rule = "must have one message, with points"
            raise wrong(f"topic {topic!r}", rule, topic, got=got, field="topics")
        last = len(points) - 1
        if isinstance(periods, int) and periods > 0 and last % periods == 0:
            points = points[: last // periods + 1]
        times = [_nanoseconds(point.time_from_start) for point in points]
        rows = {what: [getattr(point, what) for point in points] for what in _COLUMNS}
        return trajectory.joint_names, times, rows
    messages = _messages(bag, STATE, _topic_of(bag, STATE))
    if messages:
        states = [state for _, state in messages]
        names = states[0].name
        if any(state.name != names for state in states):
            got = f"others after {shown(names)}"
            raise wrong("joints", "must be the same in all messages", names, got=got)
        times = [_nanoseconds(state.header.stamp) for state in states]
        if times[0] <= 0:
            times = [time for time, _ in messages]
        positions = [state.position for state in states]
        velocities = [state.velocity for state in states]
        return names, times, {"positions": positions, "velocities": velocities}
    there = sorted({f"{one.topic} ({one.msgtype})" for one in bag.connections})
    listed = ", ".join(there[:8]) or "none"
    if len(there) > 8:
        listed += " …"
    rule = f"must have messages of {TRAJECTORY} or {STATE}"
    raise wrong("topics", rule, there, got=listed)


def _nanoseconds(moment: Any) -> int:
    return int(moment.sec * _NANOSECONDS + moment.nanosec)


def _topic_of(bag: Reader, kind: str) -> str:
    """Return the topic of a kind of messages: the usual one of several."""
    topics = sorted({one.topic for one in bag.connections if one.msgtype == kind})
    usual = TOPICS[kind]
    if len(topics) == 1:
        return topics[0]
    if topics and usual not in topics:
        rule = f"must be one, or {usual} among them"
        got = ", ".join(topics)
        raise wrong(f"topics of {kind}", rule, topics, got=got, field="topics")
    return usual


def _columns(
    names: list[str], rows: dict[str, list[FloatArray]], joint_names: object
) -> dict[str, FloatArray]:
    """Return angles and their derivatives in the order of the rotors."""
    if len(set(names)) < len(names):
        raise wrong("joints", "must have names that differ", names)
    own = joint_names if isinstance(joint_names, list) else []
    order = [0, 1, 2, 3]
    for known in (own, list(ANGLES)):
        if len(known) == len(ANGLES) and all(name in names for name in known):
            order = [names.index(name) for name in known]
            break
    else:
        if len(names) != len(ANGLES):
            raise wrong("joints", "must be four, or alpha1 to alpha4 among them", names)
    columns = {}
    for what, values in rows.items():
        if what != "positions" and not any(map(len, values)):
            continue
        for number, row in enumerate(values, start=1):
            if len(row) != len(names):
                rule = f"must have {len(names)} {what}, one a joint"
                raise wrong(f"row {number}", rule, len(row), field=what, row=number)
        by_joint = np.array(values, dtype=float).T
        for name, joint in zip(_COLUMNS[what], order, strict=True):
            columns[name] = by_joint[joint]
    return columns
