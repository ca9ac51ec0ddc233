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
    from collections.abc import Iterator
    from pathlib import Path

    from rosbags.rosbag2 import Reader
    from rosbags.typesys.store import Typestore

    from gaitgraph.invertibility.forms import FloatArray

TRAJECTORY = "trajectory_msgs/msg/JointTrajectory"
STATE = "sensor_msgs/msg/JointState"
STRING = "std_msgs/msg/String"
TOPICS = {STRING: "/gaitgraph", TRAJECTORY: "/joint_trajectory", STATE: "/joint_states"}
POSE = "geometry_msgs/msg/PoseStamped"
POSE_TOPIC = "/pose"

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
    times = np.concatenate(
        [once, *(once[1:] + k * once[-1] for k in range(1, periods))]
    )
    if len(times) > 1 and np.diff(times).min() < _SHORTEST_STEP:
        raise InputError(
            f"t must have steps of at least {_SHORTEST_STEP} ns, as ROS counts nanoseconds, got less"
        )
    found = {}
    for what, names in _COLUMNS.items():
        # A controller joins positions alone by straight lines, and with velocities by cubics.
        is_stated = all(name in table for name in names)
        if what == "positions" or (table.joined_by_cubics and is_stated):
            values = np.column_stack([table[name] for name in names])
            found[what] = np.concatenate([values, *[values[1:]] * (periods - 1)])
    return times, found


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
    for time, *values in zip(
        times.tolist(), *(one.tolist() for one in rows.values()), strict=True
    ):
        fields = [
            f"{what}: [{', '.join(map(_number, row))}]"
            for what, row in zip(rows, values, strict=True)
        ]
        fields.append(
            f"time_from_start: {{sec: {time // _NANOSECONDS}, nanosec: {time % _NANOSECONDS}}}"
        )
        lines.append(f"  - {{{', '.join(fields)}}}")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _number(value: float) -> str:
    """Return a number as YAML 1.1 reads it: an exponent without a point before it would be a text."""
    text = repr(value)
    return text.replace("e", ".0e") if "e" in text and "." not in text else text


# -- Bags


def write_mcap(table: Table, path: Path, periods: int = 1) -> None:
    """Write a new folder: a bag with an MCAP file, which the library names after the folder."""
    from rosbags.rosbag2 import StoragePlugin, Writer
    from scipy.spatial.transform import Rotation

    check_rows(table, _MOST_POINTS, "a ROS 2 bag")
    times, rows = points_of(table, periods)
    names, none = list(servos_of(table).joint_names), np.zeros(0)
    chosen = {"periods": periods, "joint_names": names}
    made = json.dumps({**provenance_of(table), "bag": chosen}, allow_nan=False)
    store = _store()

    def message(kind: str, **fields: Any) -> Any:
        return store.types[kind](**fields)

    def moment(kind: str, time: int) -> Any:
        return message(
            f"builtin_interfaces/msg/{kind}",
            sec=time // _NANOSECONDS,
            nanosec=time % _NANOSECONDS,
        )

    def header(time: int, frame: str = "") -> Any:
        stamp = moment("Time", time)
        return message("std_msgs/msg/Header", stamp=stamp, frame_id=frame)

    def poses() -> Iterator[Any]:
        places = np.column_stack([table[name] for name in _PLACE])
        turns = np.column_stack([table[name] for name in _ATTITUDE])
        quaternions = Rotation.from_euler("ZYX", turns).as_quat()
        for place, quaternion in zip(places.tolist(), quaternions, strict=True):
            point = dict(zip("xyz", place, strict=True))
            turn = dict(zip("xyzw", quaternion.tolist(), strict=True))
            yield message(
                "geometry_msgs/msg/Pose",
                position=message("geometry_msgs/msg/Point", **point),
                orientation=message("geometry_msgs/msg/Quaternion", **turn),
            )

    joined = [rows.get(what, [none] * len(times)) for what in _COLUMNS]
    points = []
    for time, position, rate, acceleration in zip(times.tolist(), *joined, strict=True):
        fields = {
            "positions": position,
            "velocities": rate,
            "accelerations": acceleration,
            "effort": none,
        }
        points.append(
            message(
                f"{TRAJECTORY}Point", **fields, time_from_start=moment("Duration", time)
            )
        )
    folder = path.with_suffix("")
    with Writer(folder, version=8, storage_plugin=StoragePlugin.MCAP) as bag:
        flies = all(name in table for name in (*_PLACE, *_ATTITUDE))
        topics = TOPICS | {POSE: POSE_TOPIC} if flies else TOPICS
        connections = {
            kind: bag.add_connection(topic, kind, typestore=store)
            for kind, topic in topics.items()
        }

        def write(kind: str, time: int, **fields: Any) -> None:
            bag.write(
                connections[kind],
                time,
                store.serialize_cdr(message(kind, **fields), kind),
            )

        write(STRING, _NANOSECONDS, data=made)
        write(
            TRAJECTORY, _NANOSECONDS, header=header(0), joint_names=names, points=points
        )
        for time, position, rate in zip(
            (times + _NANOSECONDS).tolist(), *joined[:2], strict=True
        ):
            write(
                STATE,
                time,
                header=header(time),
                name=names,
                position=position,
                velocity=rate,
                effort=none,
            )
        stamps = (times + _NANOSECONDS).tolist()
        for time, pose in zip(stamps, poses() if flies else (), strict=False):
            write(POSE, time, header=header(time, "world"), pose=pose)
    folder.rename(path)


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
        for _, message in _messages(bag, STRING, [TOPICS[STRING]])[:1]:
            about = about_from_text(message.data, required=True)
            stated = json.loads(message.data).get("bag")
            chosen = stated if isinstance(stated, dict) else {}
        recorded = _recorded(bag, chosen)
    return RawTable(columns=_columns(*recorded, chosen), about=about, angle_texts=True)


def _messages(bag: Reader, kind: str, topics: list[str]) -> list[tuple[int, Any]]:
    """Return the messages of a kind in some topics, each with the time of its record [ns]."""
    connections = [
        one for one in bag.connections if one.msgtype == kind and one.topic in topics
    ]
    if not connections:  # which would mean all
        return []
    return [
        (time, _store().deserialize_cdr(content, kind))
        for _, time, content in bag.messages(connections)
    ]


def _recorded(
    bag: Reader, chosen: dict[str, Any]
) -> tuple[list[str], list[tuple[Any, ...]]]:
    """Return names of joints, and rows of time [ns], positions, velocities and accelerations, of a bag.

    They are those of its JointTrajectory, of our own one period, else of its JointStates, all periods, by the time of
    their records if none is stamped. A topic may be recorded several times; the usual one of several counts.
    """

    def nanoseconds(one: Any) -> int:
        return int(one.sec * _NANOSECONDS + one.nanosec)

    for kind, topic in [(TRAJECTORY, TOPICS[TRAJECTORY]), (STATE, TOPICS[STATE])]:
        topics = sorted({one.topic for one in bag.connections if one.msgtype == kind})
        if len(topics) > 1 and topic not in topics:
            raise wrong(
                f"topics of {kind}",
                f"must be one, or {topic} among them",
                topics,
                got=", ".join(topics),
                field="topics",
            )
        topics = [topic] if len(topics) > 1 else topics
        messages = _messages(bag, kind, topics)
        if not messages:
            continue
        first = messages[0][1]
        if kind == STATE:
            if any(message.name != first.name for _, message in messages):
                raise wrong(
                    "joints",
                    "must be the same in all messages",
                    first.name,
                    got=f"others after {shown(first.name)}",
                )
            stamped = nanoseconds(first.header.stamp) > 0
            return first.name, [
                (
                    nanoseconds(one.header.stamp) if stamped else time,
                    one.position,
                    one.velocity,
                )
                for time, one in messages
            ]
        if len(messages) > 1 or not first.points:
            got = f"{len(messages)}, the first of {len(first.points)} points"
            raise wrong(
                f"topic {topics[0]!r}",
                "must have one message, with points",
                topics[0],
                got=got,
                field="topics",
            )
        points, periods = first.points, chosen.get("periods")
        if (
            isinstance(periods, int)
            and periods > 0
            and (len(points) - 1) % periods == 0
        ):
            points = points[: (len(points) - 1) // periods + 1]
        return first.joint_names, [
            (
                nanoseconds(one.time_from_start),
                one.positions,
                one.velocities,
                one.accelerations,
            )
            for one in points
        ]
    there = sorted({f"{one.topic} ({one.msgtype})" for one in bag.connections})
    listed = ", ".join(there[:8]) + (" …" if len(there) > 8 else "") or "none"
    raise wrong(
        "topics", f"must have messages of {TRAJECTORY} or {STATE}", there, got=listed
    )


def _columns(
    names: list[str], rows: list[tuple[Any, ...]], chosen: dict[str, Any]
) -> dict[str, Any]:
    """Return columns in the order of the rotors, with time from 0, of rows as :func:`_recorded` returns them."""
    if len(set(names)) < len(names):
        raise wrong("joints", "must have names that differ", names)
    order = list(range(len(ANGLES)))
    for known in (chosen.get("joint_names"), list(ANGLES)):
        if (
            isinstance(known, list)
            and len(known) == len(ANGLES)
            and all(name in names for name in known)
        ):
            order = [names.index(name) for name in known]
            break
    else:
        if len(names) != len(ANGLES):
            raise wrong("joints", "must be four, or alpha1 to alpha4 among them", names)
    times, *groups = zip(*rows, strict=True)
    found: dict[str, Any] = {
        "t": np.array([(time - times[0]) / _NANOSECONDS for time in times])
    }
    for (what, columns), values in zip(_COLUMNS.items(), groups, strict=False):
        if what == "positions" or any(map(len, values)):
            for k, row in enumerate(values, start=1):
                if len(row) != len(names):
                    rule = f"must have {len(names)} {what}, one a joint"
                    raise wrong(f"row {k}", rule, len(row), field=what, row=k)
            found |= zip(
                columns, np.array(values, dtype=float)[:, order].T, strict=True
            )
    return found
