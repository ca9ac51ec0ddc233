"""ROS 2: bags with MCAP in them, by rosbags, and the YAML goal of a joint_trajectory_controller.

A bag has three topics: what made it, in one String; the JointTrajectory, one message stamped 0, which makes a
controller start at once; and a JointState for each point, for plotting, from 1 s on, since tools take 0 for "not set".
Bags have version 8, since Humble cannot read version 9. A goal states in a comment what made it, and ends with another.
"""

from __future__ import annotations

import json
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.errors import InputError, shown
from gaitgraph.gait.table import (
    ACCELERATIONS,
    ANGLES,
    RATES,
    Table,
    about_from_text,
    is_closed,
    merged,
    provenance_of,
    provenance_text,
)
from gaitgraph.io.binary_tables import check_size, gate
from gaitgraph.io.formats import FORMATS, PROVENANCE_TOPIC

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path

    from rosbags.interfaces import Connection
    from rosbags.rosbag2 import Reader
    from rosbags.typesys.store import Typestore

    from gaitgraph.io.columns import TableBuilder
    from gaitgraph.io.formats import FormatOptions, Progress

FloatArray = npt.NDArray[np.float64]

TRAJECTORY = "trajectory_msgs/msg/JointTrajectory"
STATE = "sensor_msgs/msg/JointState"
STRING = "std_msgs/msg/String"

_MOST_POINTS = 100_000
_COLUMNS = {"positions": ANGLES, "velocities": RATES, "accelerations": ACCELERATIONS}
_NANOSECONDS = 1_000_000_000
_LAST_SECOND = 2**31 - 2  # seconds are whole numbers of 32 bits, and stamps begin a second later
_SHORTEST_STEP = 2
_Rows = tuple[list[int], list[str], dict[str, list[Any]]]


def merged_up_to(pieces: Iterable[Table], most: int, what: str) -> Table:
    """Return the pieces of a table with a clock as one; InputError as soon as there are more rows than `most`."""
    held: list[Table] = []
    for piece in pieces:
        held.append(piece)
        if sum(map(len, held)) > most:
            raise InputError(f"rows must be at most {most} in {what}, got more: use fewer samples, or a lower rate")
    table = merged(held)
    for name in ("t", "alpha3"):
        if name not in table:
            raise InputError(f"column {name!r} is missing; {what} needs a table with a clock and four angles")
    return table


def points_of(table: Table, periods: int = 1) -> tuple[npt.NDArray[np.int64], dict[str, FloatArray]]:
    """Return a table's rows, repeated; the row where one period ends and the next begins is there once.

    Returns times since the first point, shape (n,) [ns], strictly increasing, and rows: `positions`, and `velocities`
    and `accelerations` if the table has them, shape (n, 4) [rad], [rad/s], [rad/s²].
    """
    if periods > 1 and not is_closed(table):
        raise InputError(f"periods must be 1 for a table that does not end where it starts, got {periods}")
    rows = len(table)
    if (rows - 1) * periods + 1 > _MOST_POINTS:
        got = f"{periods} periods of {rows} rows: use fewer periods or samples"
        raise InputError(f"points must be at most {_MOST_POINTS}, got {got}")
    seconds = table["t"] - table["t"][0]
    if seconds[-1] * periods > _LAST_SECOND:
        raise InputError(f"time must be at most {_LAST_SECOND} s in all, got {periods} periods of {seconds[-1]:g} s")
    once = np.rint(seconds * _NANOSECONDS).astype(np.int64)
    times = np.concatenate([once, *(once[1:] + k * once[-1] for k in range(1, periods))])
    if len(times) > 1 and np.diff(times).min() < _SHORTEST_STEP:
        raise InputError(f"t must have steps of at least {_SHORTEST_STEP} ns, as ROS counts nanoseconds, got less")
    found = {}
    for what, names in _COLUMNS.items():
        if names[0] in table:
            values = np.column_stack([table[name] for name in names])
            found[what] = np.concatenate([values, *[values[1:]] * (periods - 1)])
    return times, found


# -- The goal of an action


def write_yaml(pieces: Iterable[Table], path: Path, options: FormatOptions) -> None:
    """Write a new file with the goal of an action, as ``ros2 action send_goal`` takes it; times are in nanoseconds."""
    table = merged_up_to(pieces, _MOST_POINTS, "a ROS 2 trajectory")
    times, rows = points_of(table, options.periods)
    lines = [
        "# A goal of control_msgs/action/FollowJointTrajectory; angles in rad, with rad/s and rad/s².",
        FORMATS[".yaml"].mark + provenance_text(table),
        "trajectory:",
        f"  joint_names: {json.dumps(options.joints_of(table)[0], ensure_ascii=False)}",
        "  points:",
    ]
    for time, *values in zip(times.tolist(), *(one.tolist() for one in rows.values()), strict=True):
        fields = [f"{what}: [{', '.join(map(_number, row))}]" for what, row in zip(rows, values, strict=True)]
        fields.append(f"time_from_start: {{sec: {time // _NANOSECONDS}, nanosec: {time % _NANOSECONDS}}}")
        lines.append(f"  - {{{', '.join(fields)}}}")
    path.write_text("\n".join([*lines, FORMATS[".yaml"].end]) + "\n", encoding="utf-8")


def _number(value: float) -> str:
    """Return a number as YAML 1.1 reads it: an exponent without a point before it would be a text."""
    text = repr(value)
    return text.replace("e", ".0e") if "e" in text and "." not in text else text


# -- Bags


def write_mcap(pieces: Iterable[Table], path: Path, options: FormatOptions) -> None:
    """Write a new folder: a bag with an MCAP file, which the library names after the folder."""
    from rosbags.rosbag2 import StoragePlugin, Writer

    table = merged_up_to(pieces, _MOST_POINTS, "a ROS 2 bag")
    times, rows = points_of(table, options.periods)
    names, none = list(options.joints_of(table)[0]), np.zeros(0)
    chosen = {name: getattr(options, name) for name in ("periods", "joint_names", "trajectory_topic", "states_topic")}
    made = json.dumps({**provenance_of(table), "bag": {**chosen, "joint_names": names}}, allow_nan=False)
    store = _store()

    def message(kind: str, **fields: Any) -> Any:
        return store.types[kind](**fields)

    def moment(kind: str, time: int) -> Any:
        return message(f"builtin_interfaces/msg/{kind}", sec=time // _NANOSECONDS, nanosec=time % _NANOSECONDS)

    def header(time: int) -> Any:
        return message("std_msgs/msg/Header", stamp=moment("Time", time), frame_id="")

    joined = [rows.get(what, [none] * len(times)) for what in _COLUMNS]
    points = []
    for time, position, rate, acceleration in zip(times.tolist(), *joined, strict=True):
        fields = {"positions": position, "velocities": rate, "accelerations": acceleration, "effort": none}
        points.append(message(f"{TRAJECTORY}Point", **fields, time_from_start=moment("Duration", time)))
    folder = path.with_suffix("")
    with Writer(folder, version=8, storage_plugin=StoragePlugin.MCAP) as bag:
        topics = {STRING: PROVENANCE_TOPIC, TRAJECTORY: options.trajectory_topic, STATE: options.states_topic}
        connections = {kind: bag.add_connection(topic, kind, typestore=store) for kind, topic in topics.items()}

        def write(kind: str, time: int, **fields: Any) -> None:
            bag.write(connections[kind], time, store.serialize_cdr(message(kind, **fields), kind))

        write(STRING, _NANOSECONDS, data=made)
        write(TRAJECTORY, _NANOSECONDS, header=header(0), joint_names=names, points=points)
        for time, position, rate in zip((times + _NANOSECONDS).tolist(), *joined[:2], strict=True):
            write(STATE, time, header=header(time), name=names, position=position, velocity=rate, effort=none)
    folder.rename(path)


@cache
def _store() -> Typestore:
    from rosbags.typesys import Stores, get_typestore

    return get_typestore(Stores.ROS2_HUMBLE)  # these messages are the same in all distributions


def read_mcap(path: Path, builder: TableBuilder, progress: Progress) -> Iterator[Table]:
    """Yield the gait of a bag or of its file: its JointTrajectory, else its JointStates; of ours, one period."""
    from rosbags.rosbag2 import Reader

    with gate(path, "a ROS 2 bag"):
        if path.is_dir() and not (path / "metadata.yaml").is_file():
            raise InputError("it must have a metadata.yaml, got none: ros2 bag reindex writes one")
        with Reader(path) as bag:
            storages = getattr(bag.storage, "storages", [bag.storage])
            chunks = (chunk for storage in storages for chunk in getattr(storage, "chunks", ()))
            check_size(sum(chunk.uncompressed_size for chunk in chunks), "its chunks")
            about, chosen = _provenance(bag)
            if connections := _of_kind(bag, TRAJECTORY, chosen.get("trajectory_topic", "/joint_trajectory")):
                columns = _columns(*_trajectory(bag, connections, chosen), chosen)
            elif connections := _of_kind(bag, STATE, chosen.get("states_topic", "/joint_states")):
                columns = _columns(*_states(bag, connections), chosen)
            else:
                there = sorted({f"{one.topic} ({one.msgtype})" for one in bag.connections})
                listed = ", ".join(there[:8]) + (" …" if len(there) > 8 else "") or "none"
                raise InputError(f"topics must have one of {TRAJECTORY} or {STATE}, got {listed}")
        yield from builder.whole(columns, about)
    if progress is not None:
        progress(1.0)


def _messages(bag: Reader, connections: list[Connection]) -> list[tuple[int, Any]]:
    """Return the messages of some topics, each with the time of its record [ns]."""
    found = bag.messages(connections) if connections else ()  # no connections would mean all
    return [(time, _store().deserialize_cdr(content, connection.msgtype)) for connection, time, content in found]


def _provenance(bag: Reader) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return what made a bag and which options it was written with; nothing, twice, of somebody else's."""
    ours = [one for one in bag.connections if (one.topic, one.msgtype) == (PROVENANCE_TOPIC, STRING)]
    for _, message in _messages(bag, ours)[:1]:
        about = about_from_text(message.data, required=True)
        chosen = json.loads(message.data).get("bag")
        return about, chosen if isinstance(chosen, dict) else {}
    return {}, {}


def _of_kind(bag: Reader, kind: str, usual: str) -> list[Connection]:
    """Return the topic of a kind, which may be recorded several times: the usual one of several."""
    found = [one for one in bag.connections if one.msgtype == kind]
    names = sorted({one.topic for one in found})
    if len(names) > 1:
        if usual not in names:
            raise InputError(f"topics of {kind} must be one, or {usual} among them, got {', '.join(names)}")
        found = [one for one in found if one.topic == usual]
    return found


def _trajectory(bag: Reader, connections: list[Connection], chosen: dict[str, Any]) -> _Rows:
    """Return times [ns], names and rows of a JointTrajectory: one period of our own, somebody else's as it is."""
    messages = _messages(bag, connections)
    if len(messages) != 1:
        raise InputError(f"topic {connections[0].topic!r} must have one message, got {len(messages)}")
    message = messages[0][1]
    points = message.points
    if not points:
        raise InputError("a trajectory must have at least one point, got none")
    periods = chosen.get("periods")
    if isinstance(periods, int) and periods > 0 and (len(points) - 1) % periods == 0:
        points = points[: (len(points) - 1) // periods + 1]
    times = [point.time_from_start.sec * _NANOSECONDS + point.time_from_start.nanosec for point in points]
    rows = {what: [getattr(point, what) for point in points] for what in _COLUMNS}
    there = {what: values for what, values in rows.items() if what == "positions" or any(map(len, values))}
    return times, message.joint_names, there


def _states(bag: Reader, connections: list[Connection]) -> _Rows:
    """Return times [ns], names and rows of JointStates, all periods of them; the time of records if none is stamped."""
    messages = _messages(bag, connections)
    if not messages:
        raise InputError(f"topic {connections[0].topic!r} must have messages, got 0")
    first = messages[0][1]
    stamps = [message.header.stamp.sec * _NANOSECONDS + message.header.stamp.nanosec for _, message in messages]
    if any(message.name != first.name for _, message in messages):
        raise InputError(f"joints must be the same in all messages, got others after {shown(first.name)}")
    rows = {"positions": [message.position for _, message in messages]}
    if len(first.velocity):
        rows["velocities"] = [message.velocity for _, message in messages]
    return stamps if stamps[0] else [time for time, _ in messages], first.name, rows


def _columns(times: list[int], names: list[str], rows: dict[str, list[Any]], chosen: dict[str, Any]) -> dict[str, Any]:
    """Return columns in the order of the rotors, with time from 0, from rows of numbers, one a joint."""
    if len(set(names)) < len(names):
        raise InputError(f"joints must have names that differ, got {shown(names)}")
    order = list(range(len(ANGLES)))
    for known in (chosen.get("joint_names"), list(ANGLES)):
        if isinstance(known, list) and len(known) == len(ANGLES) and all(name in names for name in known):
            order = [names.index(name) for name in known]
            break
    else:
        if len(names) != len(ANGLES):
            raise InputError(f"joints must be four, or alpha1 to alpha4 among them, got {shown(names)}")
    found: dict[str, Any] = {"t": np.array([(time - times[0]) / _NANOSECONDS for time in times])}
    for what, values in rows.items():
        for k, row in enumerate(values, start=1):
            if len(row) != len(names):
                raise InputError(f"row {k} must have {len(names)} {what}, one a joint, got {len(row)}")
        found |= zip(_COLUMNS[what], np.array(values, dtype=float)[:, order].T, strict=True)
    return found
