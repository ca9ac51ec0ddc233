"""ROS 2: bags and action goals, read by ROS's own readers; bags from elsewhere."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml  # type: ignore[import-untyped, unused-ignore]
from hypothesis import given, settings, strategies as st
from rosbags.rosbag2 import (
    CompressionFormat,
    CompressionMode,
    Reader,
    StoragePlugin,
    Writer,
)
from rosbags.typesys import Stores, get_typestore

import gaitgraph as gg
from gaitgraph.gait.table import ACCELERATIONS, ANGLES, RATES, Table
from gaitgraph.io.formats import read_table, write_tables
from gaitgraph.io.ros import STATE, STRING, TRAJECTORY, points_of
from gaitgraph.io.servo_map import servo_map_from_mapping
from gaitgraph.timing.timed_gait import table_of
from tests.mutated import refusal
from tests.published import GAITS
from tests.samples import cases, table_from

SECOND = 1_000_000_000
STORE = get_typestore(Stores.LATEST)  # gaitgraph writes with that of an older one
TYPES = STORE.types
NAMES = ("tilt_front", "tilt_left", "tilt_rear", "tilt_right")
FOUR, STILL, NONE = ["a", "b", "c", "d"], [0.0] * 4, np.zeros(0)

TIMED = gg.lift(GAITS[2].angles, "red").parametrize(0.7, samples=20)
TABLE = table_of(TIMED)
SLOW = TIMED.with_period(5.0)
ROWS = [(k * SECOND // 4, TIMED.alpha[k], SLOW.rates[k]) for k in range(21)]
OPEN = table_from([[0.0] * 4, [0.1] * 4, [0.2] * 4], t=np.arange(3.0))
SERVOS = servo_map_from_mapping({"joint": [{"name": name} for name in NAMES]})


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with three periods of gait 3 in both kinds of file."""
    folder = tmp_path_factory.mktemp("written")
    paths = [folder / "gait3.mcap", folder / "gait3.yaml"]
    write_tables(TABLE, paths, servos=SERVOS, periods=3)
    return folder


def messages_of(path: Path, topic: str) -> list[tuple[int, Any]]:
    with Reader(path) as bag:
        there = [one for one in bag.connections if one.topic == topic]
        return [
            (time, STORE.deserialize_cdr(content, one.msgtype))
            for one, time, content in bag.messages(connections=there)
        ]


def ns(stamp: Any) -> int:
    return int(stamp.sec) * SECOND + int(stamp.nanosec)


def header_of(time: int) -> Any:
    stamp = TYPES["builtin_interfaces/msg/Time"](*divmod(time, SECOND))
    return TYPES["std_msgs/msg/Header"](stamp=stamp, frame_id="")


def trajectory(names: list[str], rows: list[tuple[int, Any, Any]]) -> Any:
    """Make a JointTrajectory of rows: nanoseconds, positions, velocities."""
    points = []
    for time, positions, velocities in rows:
        after = TYPES["builtin_interfaces/msg/Duration"](*divmod(time, SECOND))
        point = TYPES["trajectory_msgs/msg/JointTrajectoryPoint"](
            positions=np.array(positions, dtype=float),
            velocities=np.array(velocities, dtype=float),
            accelerations=NONE,
            effort=NONE,
            time_from_start=after,
        )
        points.append(point)
    return TYPES[TRAJECTORY](header=header_of(0), joint_names=names, points=points)


def state(time: int, names: list[str], positions: Any, velocities: Any = ()) -> Any:
    return TYPES[STATE](
        header=header_of(time),
        name=names,
        position=np.array(positions, dtype=float),
        velocity=np.array(velocities, dtype=float),
        effort=NONE,
    )


def text(content: str) -> Any:
    return TYPES[STRING](data=content)


def bag_of(
    messages: list[tuple[str, int, Any]],
    mode: CompressionMode | None = None,
    name: str = "theirs.mcap",
) -> Path:
    """Write a bag of somebody else: topic, time, message."""
    writer = Writer(name, version=9, storage_plugin=StoragePlugin.MCAP)
    if mode is not None:
        writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer as bag:
        connections: dict[tuple[str, str], Any] = {}
        for topic, time, message in messages:
            kind = message.__msgtype__
            if (topic, kind) not in connections:
                added = bag.add_connection(topic, kind, typestore=STORE)
                connections[topic, kind] = added
            content = STORE.serialize_cdr(message, kind)
            bag.write(connections[topic, kind], time, content)
    return Path(name)


@pytest.fixture(autouse=True)
def _in_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_a_bag_holds_the_trajectory_unwrapped_and_joint_states(written: Path) -> None:
    path = written / "gait3.mcap"
    ((logged, message),) = messages_of(path, "/joint_trajectory")
    # A stamp of 0 tells a controller to start at once.
    assert (logged, ns(message.header.stamp)) == (SECOND, 0)
    assert tuple(message.joint_names) == NAMES
    times = np.array([ns(point.time_from_start) for point in message.points])
    assert (len(times), times[0], times[-1]) == (3 * 20 + 1, 0, 2_100_000_000)
    names = ("positions", "velocities", "accelerations")
    for name, values in zip(names, TIMED.at(times / SECOND), strict=True):
        stated = np.array([getattr(point, name) for point in message.points])
        assert np.abs(stated - values).max() < 1e-6  # a nanosecond later or earlier
    messages = messages_of(path, "/joint_states")
    assert len(messages) == 61
    for k, (logged, message) in enumerate(messages):
        assert logged == ns(message.header.stamp) == SECOND + k * 35_000_000
        assert tuple(message.name) == NAMES
        assert (message.position == TIMED.alpha[k % 20]).all()
        assert (message.velocity == TIMED.rates[k % 20]).all()
    metadata = yaml.safe_load((path / "metadata.yaml").read_text())
    content = metadata["rosbag2_bagfile_information"]
    assert content["version"] == 8  # Humble reads versions up to 8
    assert content["storage_identifier"] == "mcap"


def test_a_bag_is_read_back_as_one_period(written: Path) -> None:
    path = written / "gait3.mcap"
    (inner,) = path.glob("*.mcap")
    assert {one.name for one in path.iterdir()} == {inner.name, "metadata.yaml"}
    for source in (path, inner):
        table = read_table(source)
        assert table.about == TABLE.about
        assert np.abs(table["t"] - TABLE["t"]).max() <= 0.5e-9
        for name in (*ANGLES, *RATES, *ACCELERATIONS):
            assert table[name].tobytes() == TABLE[name].tobytes()
    assert gg.validate(path).flyable


def test_the_same_table_gives_the_same_bytes_under_any_name(
    written: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "100% ?mode=ro#ä"
    folder.mkdir()
    paths = [folder / "gait3.mcap", folder / "gait3.yaml"]
    write_tables(TABLE, paths, servos=SERVOS, periods=3)
    for path in filter(Path.is_file, folder.rglob("*")):
        twin = written / path.relative_to(folder)
        assert path.read_bytes() == twin.read_bytes()
    path = folder / "a.b α%.mcap"
    TIMED.write(path)
    assert len(read_table(path)) == 21
    with pytest.raises(gg.errors.OutputExists):
        TIMED.write(path)
    TIMED.write(path, force=True)
    assert {*folder.iterdir()} == {*paths, path}


def test_the_yaml_is_a_goal_that_ros_takes(written: Path) -> None:
    """Keys and types are those of the messages, and the numbers are those of the bag."""
    goal = yaml.safe_load((written / "gait3.yaml").read_text())
    assert [*goal] == ["trajectory"]
    content = goal["trajectory"]
    ((_, message),) = messages_of(written / "gait3.mcap", "/joint_trajectory")
    assert {*content} <= {*vars(message)}
    assert content["joint_names"] == [*NAMES]
    for stated, point in zip(content["points"], message.points, strict=True):
        assert {*stated} <= {*vars(point)}
        time = stated["time_from_start"]
        assert time["sec"] * SECOND + time["nanosec"] == ns(point.time_from_start)
        for name in ("positions", "velocities", "accelerations"):
            assert all(type(value) is float for value in stated[name])
            assert stated[name] == getattr(point, name).tolist()


def test_numbers_and_names_of_the_yaml_are_kept_as_they_are() -> None:
    numbers, names = [1e-05, -2e-17, 1e5], ('a"b\\c', "it's: #1", "ä", "[x]")
    table = Table(columns={**OPEN.columns, "alpha3": np.array(numbers)})
    servos = servo_map_from_mapping({"joint": [{"name": name} for name in names]})
    write_tables(table, ["g.yaml"], servos=servos)
    content = yaml.safe_load(Path("g.yaml").read_text())["trajectory"]
    assert [point["positions"][2] for point in content["points"]] == numbers
    assert "velocities" not in content["points"][0]
    assert tuple(content["joint_names"]) == names


@settings(deadline=None, max_examples=30)
@given(rows=st.integers(1, 30), periods=st.integers(1, 9), period=st.floats(1e-5, 1e4))
def test_times_increase_whatever_the_period(
    rows: int, periods: int, period: float
) -> None:
    timed = replace(TIMED, period=period, samples=rows)
    times, points = points_of(table_of(timed), periods)
    assert len(times) == len(points["positions"]) == rows * periods + 1
    assert (np.diff(times) > 0).all()
    assert abs(int(times[-1]) - periods * period * 1e9) <= periods
    off = np.abs(points["positions"] - timed.at(times / 1e9).alpha).max()
    assert off <= 1e-8 * (1 + timed.peak_rates.max())


def test_as_many_points_are_written_as_are_allowed() -> None:
    times, _ = points_of(TABLE, 4999)
    assert len(times) == 99_981


def with_clock(period: float, samples: int) -> Table:
    return table_of(replace(TIMED, period=period, samples=samples))


@pytest.mark.parametrize(
    ("table", "periods", "message"),
    [
        (TABLE, 5000, "points must be at most 100000, got 5000 periods of 21 rows"),
        (with_clock(1e9, 9), 3, "time must be at most 2147483646 s .*, got 3 periods"),
        (with_clock(1e-6, 1000), 1, "t must have steps of at least 2 ns"),
        (OPEN, 2, "periods must be 1 for a table that is run once, or does not end"),
        (table_from(OPEN.alpha), 1, "column 't' is missing"),
    ],
)
def test_what_ros_cannot_hold_is_refused(
    table: Table, periods: int, message: str, tmp_path: Path
) -> None:
    for name in ("g.mcap", "g.yaml"):
        with pytest.raises(gg.InputError, match=message):
            write_tables(table, [name], periods=periods)
    assert not [*tmp_path.iterdir()]


PACKED = (CompressionMode.STORAGE, CompressionMode.MESSAGE, CompressionMode.FILE)


@pytest.mark.parametrize("packed", [None, *PACKED])
def test_somebody_elses_trajectory_is_read_as_it_is(
    packed: CompressionMode | None,
) -> None:
    path = bag_of([("/anything", 5, trajectory(["w", "x", "y", "z"], ROWS))], packed)
    table = read_table(path)
    assert table.about == {}
    assert (table.alpha == TIMED.alpha).all()
    assert (table["t"] == np.arange(21) / 4).all()
    assert [*table.columns] == ["t", *ANGLES, *RATES]
    assert gg.validate(path).valid


def test_joints_are_known_by_their_names() -> None:
    names = ["arm", "alpha3", "alpha1", "alpha4", "alpha2"]
    rows: list[Any] = [(time, [9.0, *p[[2, 0, 3, 1]]], []) for time, p, _ in ROWS]
    path = bag_of([("/j", 1, trajectory(names, rows))])
    assert (read_table(path).alpha == TIMED.alpha).all()


@pytest.mark.parametrize("stamped", [True, False])
def test_joint_states_alone_are_read(stamped: bool) -> None:
    """By their stamps, or by when they were recorded where there are none."""
    start = 1_700_000_000_123_456_789
    messages: list[Any] = [("/chatter", 3, text("x"))]
    for time, positions, velocities in ROWS:
        at = start + time
        late = 7 if stamped and time else 0
        stamp = at if stamped else 0
        message = state(stamp, FOUR, positions, velocities)
        messages.append(("/joint_states", at + late, message))
    table = read_table(bag_of(messages))
    assert (table.alpha == TIMED.alpha).all()
    assert (table["t"] == np.arange(21) / 4).all()
    rates = np.column_stack([table[name] for name in RATES])
    assert (rates == SLOW.rates).all()


def test_a_split_bag_is_read_in_order_and_its_folder_needs_no_suffix() -> None:
    whole = Path("rosbag2_2024")
    whole.mkdir()
    names = [f"rosbag2_2024_{k}.mcap" for k in range(12)]
    for name, (time, positions, _) in zip(names, ROWS, strict=False):
        message = state(1 + time, FOUR, positions)
        part = bag_of([("/joint_states", 1 + time, message)], name=f"part_{time}")
        shutil.move(next(part.glob("*.mcap")), whole / name)
    assert "metadata.yaml, got none: ros2 bag reindex writes one" in refusal(whole)
    metadata = Path("part_0/metadata.yaml").read_text()
    listed = "\n  - ".join(["", *names]).lstrip()
    (whole / "metadata.yaml").write_text(metadata.replace("- part_0.mcap", listed))
    assert (read_table(whole).alpha == TIMED.alpha[:12]).all()
    assert len(read_table(whole / names[3])) == 1
    (whole / names[5]).unlink()
    assert "files are missing" in refusal(whole)
    assert ", a folder without a .mcap file" in refusal(Path("part_0"))


J, S = "/joint_trajectory", "/joint_states"


@pytest.mark.parametrize(
    ("messages", "message"),
    cases("""
[("/odom", 1, text("x"))] | msg/JointState, got /odom (std_msgs/msg/String)
[(J, 1, text("x"))] | got /joint_trajectory (std_msgs/msg/String)
[("/gaitgraph", 1, text("{}"))] | gaitgraph
[(J, 1, trajectory(FOUR, ROWS))] * 2 | message, with points, got 2
[("/j", 1, trajectory(FOUR, ROWS)), ("/k", 1, trajectory(FOUR, ROWS))] | among them, got /j, /k
[(J, 1, trajectory(FOUR, []))] | with points, got 1, the first of 0
[(J, 1, trajectory(["arm", "x"], ROWS))] | joints must be four, or alpha1
[(J, 1, trajectory(FOUR, [(0, [0, 0, np.nan, 0], [])]))] | row 1: alpha3
[(J, 1, trajectory(FOUR, [(0, [2, 0, 0, 0], [])]))] | row 1: alpha1
[(J, 1, trajectory(FOUR, [(0, [0, 0, 0], [])]))] | row 1 must have 4 positions
[(J, 1, trajectory(FOUR, [(0, STILL, []), (9, STILL, STILL)]))] | row 1 must have 4 velocities
[(J, 1, trajectory(FOUR, [ROWS[1], ROWS[0]]))] | row 2: t
[(S, 1, state(4, FOUR, STILL)), (S, 2, state(3, FOUR, STILL))] | row 2: t
[(S, 1, state(1, FOUR, STILL)), (S, 2, state(2, FOUR[::-1], STILL))] | joints must be the same
[(S, 1, state(1, ["alpha1"] * 4, STILL))] | joints must have names that differ
"""),
)
def test_bags_of_something_else_are_refused(messages: str, message: str) -> None:
    assert message in refusal(bag_of(eval(messages)))
