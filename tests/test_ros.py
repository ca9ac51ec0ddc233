"""ROS 2: bags and action goals, read by ROS's own readers; bags from elsewhere, and broken ones."""

from __future__ import annotations

import shutil
from dataclasses import replace
from math import nan
from typing import TYPE_CHECKING, Any

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
from gaitgraph.gait.gait import lift
from gaitgraph.gait.table import ACCELERATIONS, ANGLES, RATES, Table
from gaitgraph.io.formats import read_table, write_tables
from gaitgraph.io.ros import STATE, STRING, TRAJECTORY, points_of
from gaitgraph.io.servo_map import servo_map_from_mapping, servo_map_named
from gaitgraph.timing.timed_gait import table_of
from tests.mutated import check_mutations, refusal
from tests.published import GAITS

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

SECOND = 1_000_000_000
STORE = get_typestore(
    Stores.LATEST
)  # gaitgraph writes with that of an older distribution
TYPES = STORE.types
NAMES = ("tilt_front", "tilt_left", "tilt_rear", "tilt_right")
FOUR, STILL = ["a", "b", "c", "d"], [0.0] * 4

TIMED = lift(GAITS[2].angles, "red").parametrize(0.7, samples=20)
TABLE = table_of(TIMED)
SLOW = TIMED.with_period(5.0)
ROWS = [(k * SECOND // 4, TIMED.alpha[k], SLOW.rates[k]) for k in range(21)]
OPEN = Table(
    columns={
        "t": np.arange(3.0),
        **{name: np.array([0.0, 0.1, 0.2]) for name in ANGLES},
    }
)
SERVOS = servo_map_from_mapping({"joint": [{"name": name} for name in NAMES]})


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Gait 3, three periods of it, in both kinds of file."""
    folder = tmp_path_factory.mktemp("written")
    paths = {suffix: folder / f"gait3{suffix}" for suffix in (".mcap", ".yaml")}
    write_tables(TABLE, list(paths.values()), servos=SERVOS, periods=3)
    return paths


def messages_of(path: Path, topic: str) -> list[tuple[int, Any]]:
    with Reader(path) as bag:
        there = [one for one in bag.connections if one.topic == topic]
        return [
            (time, STORE.deserialize_cdr(content, one.msgtype))
            for one, time, content in bag.messages(connections=there)
        ]


def ns(stamp: Any) -> int:
    return int(stamp.sec) * SECOND + int(stamp.nanosec)


def header_of(nanosecond: int) -> Any:
    stamp = TYPES["builtin_interfaces/msg/Time"](
        sec=nanosecond // SECOND, nanosec=nanosecond % SECOND
    )
    return TYPES["std_msgs/msg/Header"](stamp=stamp, frame_id="")


def trajectory(names: list[str], rows: list[tuple[int, Any, Any]]) -> Any:
    """Make a JointTrajectory of rows: nanoseconds, positions, velocities."""
    duration, point = (
        TYPES["builtin_interfaces/msg/Duration"],
        TYPES["trajectory_msgs/msg/JointTrajectoryPoint"],
    )
    none = np.zeros(0)
    points = []
    for time, positions, velocities in rows:
        values = {
            "positions": np.array(positions, dtype=float),
            "velocities": np.array(velocities, dtype=float),
        }
        after = duration(sec=time // SECOND, nanosec=time % SECOND)
        points.append(
            point(**values, accelerations=none, effort=none, time_from_start=after)
        )
    return TYPES[TRAJECTORY](header=header_of(0), joint_names=names, points=points)


def state(time: int, names: list[str], positions: Any, velocities: Any = ()) -> Any:
    position, velocity = (
        np.array(positions, dtype=float),
        np.array(velocities, dtype=float),
    )
    return TYPES[STATE](
        header=header_of(time),
        name=names,
        position=position,
        velocity=velocity,
        effort=np.zeros(0),
    )


def bag_of(
    path: Path,
    messages: list[tuple[str, int, Any]],
    mode: CompressionMode | None = None,
) -> Path:
    """Write a bag of somebody else: topic, time, message."""
    writer = Writer(path, version=9, storage_plugin=StoragePlugin.MCAP)
    if mode is not None:
        writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer as bag:
        connections: dict[tuple[str, str], Any] = {}
        for topic, time, message in messages:
            kind = message.__msgtype__
            if (topic, kind) not in connections:
                connections[topic, kind] = bag.add_connection(
                    topic, kind, typestore=STORE
                )
            bag.write(
                connections[topic, kind], time, STORE.serialize_cdr(message, kind)
            )
    return path


def test_a_bag_holds_the_trajectory_unwrapped_and_joint_states(
    written: dict[str, Path],
) -> None:
    path = written[".mcap"]
    ((logged, message),) = messages_of(path, "/joint_trajectory")
    assert (logged, ns(message.header.stamp)) == (
        SECOND,
        0,
    )  # 0 tells a controller to start at once
    assert tuple(message.joint_names) == NAMES
    times = np.array([ns(point.time_from_start) for point in message.points])
    assert (len(times), times[0], times[-1]) == (3 * 20 + 1, 0, 2_100_000_000)
    for name, values in zip(
        ("positions", "velocities", "accelerations"),
        TIMED.at(times / SECOND),
        strict=True,
    ):
        found = np.array([getattr(point, name) for point in message.points])
        assert np.abs(found - values).max() < 1e-6  # a nanosecond later or earlier
    messages = messages_of(path, "/joint_states")
    assert len(messages) == 61
    for k, (logged, message) in enumerate(messages):
        assert logged == ns(message.header.stamp) == SECOND + k * 35_000_000
        assert tuple(message.name) == NAMES
        assert (message.position == TIMED.alpha[k % 20]).all()
        assert (message.velocity == TIMED.rates[k % 20]).all()
    content = yaml.safe_load((path / "metadata.yaml").read_text())[
        "rosbag2_bagfile_information"
    ]
    assert content["version"] == 8  # Humble reads versions up to 8
    assert content["storage_identifier"] == "mcap"
    topics = [one["topic_metadata"] for one in content["topics_with_message_count"]]
    kinds = {one["name"]: one["type"] for one in topics}
    assert kinds == {
        "/gaitgraph": STRING,
        "/joint_trajectory": TRAJECTORY,
        "/joint_states": STATE,
    }


def test_a_bag_is_read_back_as_one_period(written: dict[str, Path]) -> None:
    path = written[".mcap"]
    inner = next(path.glob("*.mcap"))
    assert sorted(one.name for one in path.iterdir()) == sorted(
        [inner.name, "metadata.yaml"]
    )
    for source in (path, inner):
        table = read_table(source)
        assert table.about == TABLE.about
        assert np.abs(table["t"] - TABLE["t"]).max() <= 0.5e-9
        for name in (*ANGLES, *RATES, *ACCELERATIONS):
            assert table[name].tobytes() == TABLE[name].tobytes()
    assert gg.validate(path).flyable


def test_the_same_table_gives_the_same_bytes_under_any_name(
    written: dict[str, Path], tmp_path: Path
) -> None:
    folder = tmp_path / "100% ?mode=ro#ä"
    folder.mkdir()
    write_tables(
        TABLE, [folder / "gait3.mcap", folder / "gait3.yaml"], servos=SERVOS, periods=3
    )
    for path in folder.rglob("*.*"):
        if path.is_file():
            assert (
                path.read_bytes()
                == (written[".mcap"].parent / path.relative_to(folder)).read_bytes()
            )
    path = folder / "a.b α%.mcap"
    TIMED.write(path)
    assert len(read_table(path)) == 21
    with pytest.raises(gg.errors.OutputExists):
        TIMED.write(path)
    TIMED.write(path, force=True)
    assert sorted(one.name for one in folder.iterdir()) == [
        "a.b α%.mcap",
        "gait3.mcap",
        "gait3.yaml",
    ]


def test_a_bag_plans_again_and_a_goal_and_a_header_do_not(
    run: Callable[..., Any], tmp_path: Path
) -> None:
    waypoints = [
        f"--waypoint={a},{b}" for a, b in ((0.4, -1.2), (0.4, -0.4), (1.2, -0.4))
    ]
    names = ["g.csv", "g.mcap", "g.yaml", "g.h"]
    run(
        "plan",
        *waypoints,
        "--samples",
        10,
        "--period",
        2,
        *[f"--output={name}" for name in names],
    )
    assert run("plan", "g.mcap", "--output", "g.mcap.csv").code == 0
    assert (tmp_path / "g.mcap.csv").read_bytes() == (tmp_path / "g.csv").read_bytes()
    for name in names[2:]:
        assert '"waypoints": [[0.4, -1.2]' in (tmp_path / name).read_text()
        refused = run("plan", name)
        assert refused.code == 2
        assert (
            f"got '{name}'; this format is not read: use the gait table or the request"
            in refused.err
        )


def test_the_yaml_is_a_goal_that_ros_takes(written: dict[str, Path]) -> None:
    """Keys and types are those of the messages, and the numbers are those of the bag."""
    text = written[".yaml"].read_text()
    goal = yaml.safe_load(text)
    assert list(goal) == ["trajectory"]
    content = goal["trajectory"]
    fields = {
        kind: [name for name, _ in STORE.fielddefs[kind][1]] for kind in STORE.fielddefs
    }
    assert set(content) <= set(fields[TRAJECTORY])
    ((_, message),) = messages_of(written[".mcap"], "/joint_trajectory")
    assert content["joint_names"] == list(NAMES)
    assert len(content["points"]) == len(message.points)
    for found, point in zip(content["points"], message.points, strict=True):
        assert set(found) <= set(fields["trajectory_msgs/msg/JointTrajectoryPoint"])
        assert found["time_from_start"] == {
            "sec": point.time_from_start.sec,
            "nanosec": point.time_from_start.nanosec,
        }
        for name in ("positions", "velocities", "accelerations"):
            assert all(type(value) is float for value in found[name])
            assert found[name] == getattr(point, name).tolist()


def test_numbers_and_names_of_the_yaml_are_kept_as_they_are(tmp_path: Path) -> None:
    numbers, names = [1e-05, -2e-17, 1e5], ('a"b\\c', "it's: #1", "ä", "[x]")
    table = Table(columns={**OPEN.columns, "alpha3": np.array(numbers)})
    servos = servo_map_from_mapping({"joint": [{"name": name} for name in names]})
    write_tables(table, [tmp_path / "g.yaml"], servos=servos)
    content = yaml.safe_load((tmp_path / "g.yaml").read_text())["trajectory"]
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
    exact = timed.at(times / 1e9).alpha
    assert np.abs(points["positions"] - exact).max() <= 1e-8 * (
        1 + timed.peak_rates.max()
    )


@pytest.mark.parametrize(
    ("table", "periods", "message"),
    [
        (TABLE, 5000, "points must be at most 100000, got 5000 periods of 21 rows"),
        (
            table_of(replace(TIMED, period=1e9, samples=9)),
            3,
            "time must be at most 2147483646 s .*, got 3 periods",
        ),
        (
            table_of(replace(TIMED, period=1e-6, samples=1000)),
            1,
            "t must have steps of at least 2 ns",
        ),
        (
            OPEN,
            2,
            "periods must be 1 for a table that does not end where it starts, got 2",
        ),
        (
            Table(columns={name: OPEN[name] for name in ANGLES}),
            1,
            "column 't' is missing",
        ),
    ],
)
def test_what_ros_cannot_hold_is_refused(
    table: Table, periods: int, message: str, tmp_path: Path
) -> None:
    for suffix in (".mcap", ".yaml"):
        with pytest.raises(gg.InputError, match=message):
            write_tables(table, [tmp_path / f"g{suffix}"], periods=periods)
    assert not list(tmp_path.iterdir())
    write_tables(OPEN, [tmp_path / "open.mcap"])
    assert (read_table(tmp_path / "open.mcap").alpha == OPEN.alpha).all()


@pytest.mark.parametrize(
    "packed",
    [None, CompressionMode.STORAGE, CompressionMode.MESSAGE, CompressionMode.FILE],
)
def test_somebody_elses_trajectory_is_read_as_it_is(
    tmp_path: Path, packed: CompressionMode | None
) -> None:
    path = bag_of(
        tmp_path / "theirs.mcap",
        [("/anything", 5, trajectory(["w", "x", "y", "z"], ROWS))],
        packed,
    )
    table = read_table(path)
    assert table.about == {}
    assert (table.alpha == TIMED.alpha).all()
    assert (table["t"] == np.arange(21) / 4).all()
    assert list(table.columns) == ["t", *ANGLES, *RATES]
    assert gg.validate(path).valid


def test_joints_are_known_by_their_names(tmp_path: Path) -> None:
    names = ["arm", "alpha3", "alpha1", "alpha4", "alpha2"]
    rows: list[Any] = [(time, [9.0, p[2], p[0], p[3], p[1]], []) for time, p, _ in ROWS]
    assert (
        read_table(
            bag_of(tmp_path / "a.mcap", [("/j", 1, trajectory(names, rows))])
        ).alpha
        == TIMED.alpha
    ).all()
    assert (
        "joints must be four, or alpha1 to alpha4 among them, got ['arm', 'x']"
        in refusal(
            bag_of(tmp_path / "b.mcap", [("/j", 1, trajectory(["arm", "x"], rows))])
        )
    )


@pytest.mark.parametrize("stamped", [True, False])
def test_joint_states_alone_are_read(tmp_path: Path, stamped: bool) -> None:
    start = 1_700_000_000_123_456_789
    messages: list[Any] = [("/chatter", 3, TYPES[STRING](data="x"))]
    for k, (time, p, v) in enumerate(ROWS):
        recorded = start + time + 7 * (k > 0) * stamped
        messages.append(
            ("/joint_states", recorded, state((start + time) * stamped, FOUR, p, v))
        )
    table = read_table(bag_of(tmp_path / "states.mcap", messages))
    assert (table.alpha == TIMED.alpha).all()
    assert (table["t"] == np.arange(21) / 4).all()
    assert np.array_equal(np.column_stack([table[name] for name in RATES]), SLOW.rates)


def test_a_split_bag_is_read_in_order_and_its_folder_needs_no_suffix(
    tmp_path: Path,
) -> None:
    whole = tmp_path / "rosbag2_2024"
    whole.mkdir()
    for k, (time, p, _) in enumerate(ROWS[:12]):
        one = bag_of(
            tmp_path / f"p{k}", [("/joint_states", 1 + time, state(1 + time, FOUR, p))]
        )
        shutil.move(next(one.glob("*.mcap")), whole / f"rosbag2_2024_{k}.mcap")
    assert (
        "it must have a metadata.yaml, got none: ros2 bag reindex writes one"
        in refusal(whole)
    )
    names = [f"rosbag2_2024_{k}.mcap" for k in range(12)]
    text = (tmp_path / "p0" / "metadata.yaml").read_text()
    (whole / "metadata.yaml").write_text(
        text.replace("- p0.mcap", "\n  - ".join(["", *names]).lstrip())
    )
    assert (read_table(whole).alpha == TIMED.alpha[:12]).all()
    assert len(read_table(whole / "rosbag2_2024_3.mcap")) == 1
    (whole / names[5]).unlink()
    assert "files are missing" in refusal(whole)
    assert ", a folder without a .mcap file" in refusal(
        tmp_path / "p3"
    )  # its file is gone


@pytest.mark.parametrize(
    ("messages", "message"),
    [
        ([("/odom", 1, TYPES[STRING](data="x"))], "msg/JointState, got /odom (std_msgs/msg/String)"),
        ([("/joint_trajectory", 1, TYPES[STRING](data="x"))], "got /joint_trajectory (std_msgs/msg/String)"),
        ([("/j", 1, trajectory(FOUR, ROWS)), ("/j", 2, trajectory(FOUR, ROWS))], "message, with points, got 2"),
        ([("/j", 1, trajectory(FOUR, ROWS)), ("/k", 2, trajectory(FOUR, ROWS))], "among them, got /j, /k"),
        ([("/j", 1, trajectory(FOUR, []))], "must have one message, with points, got 1, the first of 0"),
        ([("/j", 1, trajectory(FOUR, [(0, [0, 0, nan, 0], [])]))], "row 1: alpha3"),
        ([("/j", 1, trajectory(FOUR, [(0, [0, 0, 0], [])]))], "row 1 must have 4 positions, one a joint, got 3"),
        ([("/j", 1, trajectory(FOUR, [(0, [0] * 4, []), (9, [0] * 4, [1] * 4)]))], "row 1 must have 4 velocities"),
        ([("/j", 1, trajectory(FOUR, [(0, [2, 0, 0, 0], [])]))], "row 1: alpha1"),
        ([("/j", 1, trajectory(FOUR, [ROWS[1], ROWS[0]]))], "row 2: t"),
        ([("/s", 1, state(1, FOUR, STILL)), ("/s", 2, state(2, FOUR[::-1], STILL))], "joints must be the same"),
        ([("/s", 2, state(5, FOUR, STILL)), ("/s", 3, state(4, FOUR, STILL))], "row 2: t"),
        ([("/gaitgraph", 1, TYPES[STRING](data="{}"))], "gaitgraph"),
        (
            [("/joint_states", 1, state(1, ["alpha1"] * 4, [0.1] * 4))],
            "joints must have names that differ, got ['alpha1', 'alpha1', 'alpha1', 'alpha1']",
        ),
    ],
)  # fmt: skip
def test_bags_of_something_else_are_refused(
    tmp_path: Path, messages: list[tuple[str, int, Any]], message: str
) -> None:
    assert message in refusal(bag_of(tmp_path / "theirs.mcap", messages))


def test_no_bag_at_all(tmp_path: Path) -> None:
    assert "No such file" in refusal(tmp_path / "none.mcap")
    for content in (b"", b"t,alpha1"):
        (tmp_path / "a.mcap").write_bytes(content)
        assert "it is not a ROS 2 bag, or it is broken (" in refusal(
            tmp_path / "a.mcap"
        )


def test_a_bag_that_is_cut_off_or_changed_is_read_or_refused_in_one_line(
    tmp_path: Path,
) -> None:
    path = tmp_path / "small.mcap"
    replace(TIMED, period=1.0, samples=3).write(tmp_path / "bag.mcap")
    content = next((tmp_path / "bag.mcap").glob("*.mcap")).read_bytes()
    for length in np.linspace(0, len(content) - 1, 20).astype(int).tolist():
        path.write_bytes(content[:length])
        refusal(path)
    assert check_mutations(content, path, count=150) > 25


def test_a_bag_of_joints_says_their_names_and_is_read_back_as_rotors(
    tmp_path: Path,
) -> None:
    """Joints of an X frame have another order; what is read is tilt angles again."""
    path = tmp_path / "g.mcap"
    write_tables(TABLE, [path], servos=servo_map_named("x_frame"))
    ((_, message),) = messages_of(path, "/joint_trajectory")
    assert list(message.joint_names) == ["tilt1", "tilt2", "tilt3", "tilt4"]
    assert (
        np.array([point.positions for point in message.points])
        == TIMED.alpha[:, [3, 1, 0, 2]]
    ).all()
    assert (read_table(path).alpha == TIMED.alpha).all()
