"""ROS 2 bags, rosbag2 folders with MCAP or sqlite3 in them.

A bag has three topics:

* ``/gaitgraph`` (std_msgs/msg/String): one message, what made the bag;
* ``/joint_trajectory`` (trajectory_msgs/msg/JointTrajectory): one message, all points from time 0, stamped 0, which
  tells a controller to start at once;
* ``/joint_states`` (sensor_msgs/msg/JointState): a message a point, for plotting.

The time of records and stamps is 1 s at the first point, for tools take 0 for "not set". Bags are written in version 8,
for Humble cannot read version 9.
"""

from __future__ import annotations

import json
import re
import shutil
import sqlite3
import tempfile
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from gaitgraph.errors import FileProblem, InputError, shown
from gaitgraph.gait.table import ACCELERATIONS, ANGLES, RATES, about_from_text, provenance_of
from gaitgraph.io.bag_storage import Topic, messages_in, topics_in
from gaitgraph.io.options import TOLD_TOPIC, FormatOptions
from gaitgraph.io.trajectory import MOST_POINTS, NANOSECONDS, merged_up_to, points_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from rosbags.rosbag2 import StoragePlugin
    from rosbags.typesys.store import Typestore

    from gaitgraph.gait.table import Table
    from gaitgraph.io.trajectory import Points

    Progress = Callable[[float], None] | None
    Raw = tuple[list[tuple[str, Any]], dict[str, Any]]
    Place = tuple[Path, Topic]

__all__ = ["TOLD_TOPIC", "pieces_of_db3", "pieces_of_mcap", "write_db3", "write_mcap"]

TRAJECTORY = "trajectory_msgs/msg/JointTrajectory"
STATE = "sensor_msgs/msg/JointState"
STRING = "std_msgs/msg/String"

_START = NANOSECONDS
_VERSION: Final = 8
_ROWS = 1 << 16
_PLAIN = re.compile(r"[\w./ -]*", re.ASCII)
_ZSTD = b"\x28\xb5\x2f\xfd"


def write_mcap(pieces: Iterable[Table], path: Path, options: FormatOptions | None = None) -> None:
    """Write a new folder: a bag with an MCAP file."""
    from rosbags.rosbag2 import StoragePlugin

    _write(pieces, path, options or FormatOptions(), StoragePlugin.MCAP)


def write_db3(pieces: Iterable[Table], path: Path, options: FormatOptions | None = None) -> None:
    """Write a new folder: a bag with a database of sqlite3."""
    from rosbags.rosbag2 import StoragePlugin

    _write(pieces, path, options or FormatOptions(), StoragePlugin.SQLITE3)


def _write(pieces: Iterable[Table], path: Path, options: FormatOptions, plugin: StoragePlugin) -> None:
    table = merged_up_to(pieces, MOST_POINTS, "a ROS 2 bag")
    points = points_of(table, options.periods)
    names = list(options.joints_of(table)[0])
    chosen = {
        "periods": options.periods,
        "joint_names": names,
        "trajectory_topic": options.trajectory_topic,
        "states_topic": options.states_topic,
    }
    told = json.dumps({**provenance_of(table), "bag": chosen}, allow_nan=False)
    # The library puts the path into an address as it stands, and names the file after the folder.
    beside = path.parent if _PLAIN.fullmatch(str(path.parent)) else None
    with tempfile.TemporaryDirectory(prefix=".gaitgraph-", dir=beside) as scratch:
        folder = Path(scratch) / (re.sub(r"[^\w.-]", "_", path.stem, flags=re.ASCII) or "gait")
        try:
            _write_bag(folder, plugin, points, names, told, options)
        except sqlite3.Error as error:
            raise OSError(f"the database says: {error}") from error
        if path.exists():
            raise FileExistsError(str(path))
        shutil.move(folder, path)


def _write_bag(
    folder: Path, plugin: StoragePlugin, points: Points, names: list[str], told: str, options: FormatOptions
) -> None:
    from rosbags.rosbag2 import Writer

    store = _store()
    types = store.types
    time, header = types["builtin_interfaces/msg/Time"], types["std_msgs/msg/Header"]
    duration, point = types["builtin_interfaces/msg/Duration"], types["trajectory_msgs/msg/JointTrajectoryPoint"]
    none = np.zeros(0)
    rates = [none] * len(points) if points.velocities is None else list(points.velocities)
    accelerations = [none] * len(points) if points.accelerations is None else list(points.accelerations)
    trajectory = types[TRAJECTORY](
        header=header(stamp=time(sec=0, nanosec=0), frame_id=""),
        joint_names=names,
        points=[
            point(
                positions=position,
                velocities=rate,
                accelerations=acceleration,
                effort=none,
                time_from_start=duration(sec=moment // NANOSECONDS, nanosec=moment % NANOSECONDS),
            )
            for moment, position, rate, acceleration in zip(
                points.times.tolist(), points.positions, rates, accelerations, strict=True
            )
        ],
    )
    with Writer(folder, version=_VERSION, storage_plugin=plugin) as bag:
        tells = bag.add_connection(TOLD_TOPIC, STRING, typestore=store)
        commands = bag.add_connection(options.trajectory_topic, TRAJECTORY, typestore=store)
        states = bag.add_connection(options.states_topic, STATE, typestore=store)
        bag.write(tells, _START, store.serialize_cdr(types[STRING](data=told), STRING))
        bag.write(commands, _START, store.serialize_cdr(trajectory, TRAJECTORY))
        for moment, position, rate in zip((points.times + _START).tolist(), points.positions, rates, strict=True):
            stamp = time(sec=moment // NANOSECONDS, nanosec=moment % NANOSECONDS)
            state = types[STATE](
                header=header(stamp=stamp, frame_id=""), name=names, position=position, velocity=rate, effort=none
            )
            bag.write(states, moment, store.serialize_cdr(state, STATE))


@cache
def _store() -> Typestore:
    from rosbags.typesys import Stores, get_typestore

    return get_typestore(Stores.ROS2_HUMBLE)  # these messages are the same in all distributions


def pieces_of_mcap(path: Path, progress: Progress) -> Iterator[Raw]:
    """Yield the gait in a bag of MCAP files, or in one such file."""
    yield from _pieces(path, ".mcap", progress)


def pieces_of_db3(path: Path, progress: Progress) -> Iterator[Raw]:
    """Yield the gait in a bag of sqlite3 databases, or in one of them."""
    yield from _pieces(path, ".db3", progress)


def _pieces(path: Path, suffix: str, progress: Progress) -> Iterator[Raw]:
    """Yield the gait of a bag: its JointTrajectory, else its JointStates; of our own, one period."""
    files = _files(path, suffix)
    places = [(file, topic) for file in files for topic in topics_in(file)]
    about, chosen = _told(places)
    store = _store()
    found = _of_kind(places, TRAJECTORY, chosen.get("trajectory_topic", "/joint_trajectory"))
    if found:
        columns = _trajectory(_only_message(found), store, chosen)
        yield columns, about
    else:
        found = _of_kind(places, STATE, chosen.get("states_topic", "/joint_states"))
        if not found:
            there = sorted({f"{topic.name} ({topic.kind})" for _, topic in places})
            listed = ", ".join(there[:8]) + (" …" if len(there) > 8 else "") or "none"
            raise InputError(f"topics: {listed}; allowed is a bag with one of {TRAJECTORY} or {STATE}")
        yield from ((columns, about) for columns in _states(found, store, chosen))
    if progress is not None:
        progress(1.0)


def _files(path: Path, suffix: str) -> list[Path]:
    """Return the storage files of a bag in the order in which they were recorded."""
    try:
        if not path.is_dir():
            return [path]
        there = [file for file in path.iterdir() if file.is_file()]
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise FileProblem(f"gait file: cannot read {str(path)!r}: {reason}; allowed is a ROS 2 bag") from error
    found = [file for file in there if file.suffix.lower() == suffix]
    if not found:
        packed = any(file.suffix == ".zstd" for file in there)
        hint = "; its files are compressed: zstd -d unpacks them" if packed else ""
        raise InputError(f"a folder without a {suffix} file; allowed is a ROS 2 bag{hint}")
    return sorted(found, key=lambda file: [int(part) if part.isdigit() else part for part in _split(file.stem)])


def _split(name: str) -> list[str]:
    """Return the texts and the digits of a name in turn.

    >>> _split("gait_12")
    ['gait_', '12', '']
    """
    return re.split(r"([0-9]+)", name)


def _told(places: list[Place]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return what made a bag and which options it was written with; nothing, twice, of somebody else's."""
    for file, topic in places:
        if topic.name == TOLD_TOPIC and topic.kind == STRING:
            for _, _, content in messages_in(file, [topic]):
                text = _read(content, STRING, _store()).data
                about = about_from_text(text, required=True)
                chosen = json.loads(text).get("bag")
                return about, chosen if isinstance(chosen, dict) else {}
    return {}, {}


def _of_kind(places: list[Place], kind: str, usual: str) -> list[Place]:
    """Return the topic of a kind, in each file that has it: the usual one of several."""
    found = [(file, topic) for file, topic in places if topic.kind == kind]
    names = sorted({topic.name for _, topic in found})
    if len(names) > 1:
        if usual not in names:
            raise InputError(f"topics: {', '.join(names)} are all of {kind}; allowed is one, or {usual} among them")
        found = [(file, topic) for file, topic in found if topic.name == usual]
    for _, topic in found:
        if topic.encoding != "cdr":
            raise InputError(f"topic {topic.name!r}: serialised as {shown(topic.encoding)}; allowed is 'cdr'")
    return found


def _messages(places: list[Place]) -> Iterator[tuple[int, bytes]]:
    for file in dict.fromkeys(file for file, _ in places):
        yield from ((time, content) for _, time, content in messages_in(file, [t for one, t in places if one == file]))


def _only_message(places: list[Place]) -> bytes:
    messages = _messages(places)
    name = places[0][1].name
    first = next(messages, None)
    if first is None:
        raise InputError(f"topic {name!r}: no messages; allowed is one")
    if next(messages, None) is not None:
        raise InputError(f"topic {name!r}: several messages; allowed is one trajectory")
    return first[1]


def _read(content: bytes, kind: str, store: Typestore) -> Any:
    """Return a message; whatever the library makes of broken bytes, InputError is what it raises."""
    if content.startswith(_ZSTD):
        raise InputError(
            "its messages are compressed one by one; allowed are plain ones: ros2 bag convert unpacks them"
        )
    try:
        return store.deserialize_cdr(content, kind)
    except Exception as error:
        raise InputError(f"a message of {len(content)} bytes is no {kind}; allowed is a whole bag") from error


def _order(names: list[str], chosen: dict[str, Any]) -> list[int]:
    """Return which joint tilts each of the rotors 1 to 4."""
    if len(set(names)) < len(names):
        raise InputError(f"joints: {shown(names)}; allowed are names that differ")
    for known in (chosen.get("joint_names"), list(ANGLES)):
        if isinstance(known, list) and len(known) == len(ANGLES) and all(name in names for name in known):
            return [names.index(name) for name in known]
    if len(names) != len(ANGLES):
        raise InputError(f"joints: {shown(names)}; allowed are four, or alpha1 to alpha4 among them")
    return list(range(len(ANGLES)))


def _rows(rows: list[Any], order: list[int], joints: int, what: str) -> Any:
    """Return rows of numbers, one a joint, in the order of the rotors."""
    for k, row in enumerate(rows, start=1):
        if len(row) != joints:
            raise InputError(f"row {k}: {len(row)} {what} of {joints} joints; allowed is one a joint")
    values = np.array(rows, dtype=float)[:, order]
    finite = np.isfinite(values)
    if not finite.all():
        row, column = np.argwhere(~finite)[0].tolist()
        value = float(values[row, column])
        raise InputError(f"row {row + 1}: {what} of alpha{column + 1} is {value!r}; allowed is a finite number")
    return values


def _columns(
    times: list[int], names: list[str], rows: dict[tuple[str, ...], list[Any]], chosen: dict[str, Any]
) -> list[tuple[str, Any]]:
    order = _order(names, chosen)
    found: list[tuple[str, Any]] = [("t", np.array([time / NANOSECONDS for time in times]))]
    words = {ANGLES: "positions", RATES: "velocities", ACCELERATIONS: "accelerations"}
    for columns, values in rows.items():
        found.extend(zip(columns, _rows(values, order, len(names), words[columns]).T, strict=True))
    return found


def _trajectory(content: bytes, store: Typestore, chosen: dict[str, Any]) -> list[tuple[str, Any]]:
    """Return the columns of a JointTrajectory: one period of our own, somebody else's as it is."""
    message = _read(content, TRAJECTORY, store)
    points = message.points
    if not points:
        raise InputError("a trajectory without points; allowed is one or more")
    points = points[: _once(len(points), chosen)]
    times = [point.time_from_start.sec * NANOSECONDS + point.time_from_start.nanosec for point in points]
    rows = {
        ANGLES: [point.positions for point in points],
        RATES: [point.velocities for point in points],
        ACCELERATIONS: [point.accelerations for point in points],
    }
    there = {names: values for names, values in rows.items() if names == ANGLES or any(map(len, values))}
    return _columns([time - times[0] for time in times], message.joint_names, there, chosen)


def _once(points: int, chosen: dict[str, Any]) -> int:
    """Return how many points one period has."""
    periods = chosen.get("periods")
    if isinstance(periods, int) and periods > 0 and (points - 1) % periods == 0:
        return (points - 1) // periods + 1
    return points


def _states(places: list[Place], store: Typestore, chosen: dict[str, Any]) -> Iterator[list[tuple[str, Any]]]:
    """Yield the columns of JointStates, piece by piece, all periods of them."""
    start: int | None = None
    times: list[int] = []
    names: list[str] = []
    rows: dict[tuple[str, ...], list[Any]] = {}
    stamped = True
    for time, content in _messages(places):
        message = _read(content, STATE, store)
        stamp = message.header.stamp.sec * NANOSECONDS + message.header.stamp.nanosec
        if start is None:
            stamped, names = stamp > 0, message.name
            start = stamp if stamped else time
            rows = {ANGLES: [], RATES: []} if len(message.velocity) else {ANGLES: []}
        if message.name != names:
            raise InputError(
                f"joints: {shown(message.name)} after {shown(names)}; allowed are the same in all messages"
            )
        times.append((stamp if stamped else time) - start)
        for columns, values in rows.items():
            values.append(message.position if columns == ANGLES else message.velocity)
        if len(times) == _ROWS:
            yield _columns(times, names, rows, chosen)
            times, rows = [], {columns: [] for columns in rows}
    if times:
        yield _columns(times, names, rows, chosen)
    if start is None:
        raise InputError(f"topic {places[0][1].name!r}: no messages; allowed is one or more")
