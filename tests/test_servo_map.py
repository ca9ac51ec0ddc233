"""From tilt angles to joints and back: order, sign, zero, units, limits; presets; our own files and foreign ones."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import gaitgraph as gg
from gaitgraph.errors import Infeasible
from gaitgraph.gait.table import ACCELERATIONS, ANGLES, RATES, Table
from gaitgraph.io.exporting import export
from gaitgraph.io.formats import read_table, write_tables
from gaitgraph.io.servo_map import (
    PRESETS,
    ServoMap,
    clipped_table,
    mapped_table,
    servo_map_from_mapping,
    servo_map_named,
    tilts_from_joints,
)
from gaitgraph.planning.missions import mission
from tests.published import GAITS
from tests.samples import cases, table_from

NORMALIZED = {"unit": "normalized", "limits": (-3.5, 3.0)}
WIDE_PULSES = {
    "unit": "us",
    "us_per_rad": 100.0,
    "neutral_us": 4000.0,
    "limits_us": (0.0, 8000.0),
}
PULSES: dict[str, Any] = {"preset": "x_frame", "unit": "us", "us_per_rad": 390}
SERVOS = """
time = "time_ms"
time_unit = "ms"
unit = "us"
us_per_rad = 390
joint = [
    {name = "front_right", rotor = 4, sign = -1},
    {name = "rear_left", rotor = 2},
    {name = "front_left", rotor = 1, zero = "5deg"},
    {name = "rear_right", rotor = 3, neutral_us = 1480},
]
"""
TABLE = gg.timing.table_of(
    gg.lift(GAITS[2].angles, "red").parametrize(period=2.0, samples=40)
)


def mapped_columns(table: Table, servo_map: ServoMap) -> dict[str, Any]:
    return mapped_table(table, servo_map).columns


@pytest.fixture
def servos(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.chdir(tmp_path)
    Path("bench.toml").write_text(SERVOS)
    return "bench.toml"


def test_a_map_does_what_it_says(servos: str) -> None:
    columns = mapped_columns(TABLE, servo_map_named(servos))
    a1, a2, a3, a4 = TABLE.alpha.T
    pulses = {
        "front_right": 1500 - 390 * a4,
        "rear_left": 1500 + 390 * a2,
        "front_left": 1500 + 390 * (a1 + math.radians(5)),
        "rear_right": 1480 + 390 * a3,
    }
    names = [f"{name}_{kind}" for kind in ("us", "thrust") for name in pulses]
    assert [*columns] == ["time_ms", *names]
    assert columns["front_right_thrust"].tolist() == TABLE["thrust4"].tolist()
    np.testing.assert_allclose(columns["time_ms"], 1000 * TABLE["t"], rtol=1e-15)
    for name, exact in pulses.items():
        found = columns[f"{name}_us"]
        np.testing.assert_allclose(found, exact, rtol=0, atol=0.05 + 1e-9)
        assert found.tolist() == found.round(1).tolist()


def test_units_of_joints() -> None:
    """A normalized joint is −1 and 1 at its limits."""
    names: dict[str, Any] = {"name": "a", "column": "a", "rotor": 1}
    normalized = gg.io.Joint(**names, unit="normalized", limits=(-1.0, 3.0))
    assert normalized.value_of(np.array([-1.0, 1.0, 3.0])).tolist() == [-1, 0, 1]
    degrees = gg.io.Joint(**names, unit="deg", zero=0.5, sign=-1)
    assert degrees.value_of(0.1) == pytest.approx(math.degrees(0.5 - 0.1))


def test_the_papers_map_changes_no_bit() -> None:
    columns = mapped_columns(TABLE, servo_map_named("paper"))
    same = ["t", *ANGLES, *RATES, *ACCELERATIONS]
    assert [*columns] == [*same, *(f"{name}_thrust" for name in ANGLES)]
    for name in same:
        assert np.array_equal(columns[name], TABLE[name])
    assert np.array_equal(columns["alpha3_thrust"], TABLE["thrust3"])


@st.composite
def joint_maps(draw: st.DrawFn) -> ServoMap:
    joints = []
    for k, rotor in enumerate(draw(st.permutations([1, 2, 3, 4]))):
        joint = {
            "name": f"joint {k}",
            "column": f"joint {k}",
            "rotor": rotor,
            "sign": draw(st.sampled_from([1, -1])),
            "zero": draw(st.floats(-1, 1)),
        }
        ways = [{"unit": "rad"}, {"unit": "deg"}, NORMALIZED, WIDE_PULSES]
        joints.append(joint | draw(st.sampled_from(ways)))
    unit = draw(st.sampled_from(["s", "ms", "us"]))
    return servo_map_from_mapping({"joint": joints, "time": "time", "time_unit": unit})


@settings(max_examples=20, deadline=None)
@given(joint_maps(), st.integers(1, 5), st.integers(0, 2**32))
def test_the_inverse_gives_back_what_was_mapped(
    servo_map: ServoMap, count: int, seed: int
) -> None:
    alpha = np.random.default_rng(seed).uniform(-1.57, 1.57, (count, 4))
    rates = dict(zip(RATES, 3.0 * alpha.T, strict=True))
    table = table_from(alpha, t=np.arange(count) / 7.0, **rates)
    back = Table(columns=tilts_from_joints(mapped_columns(table, servo_map), servo_map))
    by_rotor = sorted(servo_map.joints, key=lambda joint: joint.rotor)
    # Pulses are rounded.
    errors = np.array([joint.rounding for joint in by_rotor])
    assert errors.max() <= 5.01e-4
    assert (np.abs(back.alpha - alpha) <= errors + 1e-11).all()
    np.testing.assert_allclose(back["t"], table["t"], rtol=1e-15)
    for name in {*RATES} & {*back.columns}:
        np.testing.assert_allclose(back[name], rates[name], atol=1e-13)
    stated = json.loads(json.dumps(servo_map.as_mapping()))
    assert servo_map_from_mapping(stated) == servo_map
    applied = mapped_table(table, servo_map.in_radians())
    own = servo_map_from_mapping(applied.about["servos"])
    exact = Table(columns=tilts_from_joints(applied.columns, own))
    np.testing.assert_allclose(exact.alpha, alpha, atol=1e-13)


def test_ends_of_the_range_come_back_inside_it() -> None:
    """A digit beyond π/2 would be refused by every reader."""
    ends = table_from([[math.pi / 2, -math.pi / 2, 0.0, 0.0]])
    for slope in np.linspace(100.1, 300.7, 37):
        stated = {"unit": "us", "us_per_rad": float(slope), "zero": "1deg"}
        servo_map = servo_map_from_mapping(stated)
        columns = tilts_from_joints(mapped_columns(ends, servo_map), servo_map)
        assert np.abs(Table(columns=columns).alpha).max() <= math.pi / 2


@pytest.mark.parametrize("rounding", [None, "2deg"])
def test_peaks_of_rounded_pulses_are_never_above_those_of_the_gait(
    rounding: str | None, servos: str
) -> None:
    limits = gg.Limits(rate=6.0, acceleration=150.0)
    paced: Any = gg.least_period("gait4", limits, rounding=rounding, samples=400)
    joints = PULSES | {"limits_us": [500, 2500]}
    export(paced, ["servos.csv"], servos=joints)
    export("servos.csv", ["back.csv"])
    before = gg.validate(gg.timing.table_of(paced))
    for file in ("servos.csv", "back.csv"):
        after = gg.validate(file)
        for name in ("tilt_rate", "tilt_acceleration"):
            assert after[name].ok
            most = (before[name].value or 0) * (1 + 1e-9)
            assert (after[name].value or 0) <= most


# Where motors 1 to 4 are, x forward, y left, and how they turn seen from above, by the controllers' manuals.
FRONT_LEFT, FRONT_RIGHT, REAR_LEFT, REAR_RIGHT = (1, 1), (1, -1), (-1, 1), (-1, -1)
MOTORS = {
    "x_frame": [FRONT_RIGHT, REAR_LEFT, FRONT_LEFT, REAR_RIGHT],  # PX4 and ArduPilot
    "betaflight": [REAR_RIGHT, FRONT_RIGHT, REAR_LEFT, FRONT_LEFT],
}
COUNTERCLOCKWISE = {FRONT_RIGHT, REAR_LEFT}


@pytest.mark.parametrize("preset", sorted({*PRESETS} - {"paper"}))
def test_presets_number_the_motors_as_the_flight_controllers_do(preset: str) -> None:
    """Where a rotor is, and how it turns, is read off the torques that it makes."""
    servo_map: Any = servo_map_named(preset)
    vehicle = gg.PAPER.replace(
        first_arm_angle=servo_map.first_arm_angle,
        first_rotor_spin=servo_map.first_rotor_spin,
    )
    assert abs(servo_map.first_arm_angle) == math.pi / 4
    servo_map.check_vehicle(vehicle)
    servo_map.check_vehicle(
        vehicle.replace(first_arm_angle=0.6 * servo_map.first_arm_angle)
    )  # as in a rectangular frame
    upward = np.sign(gg.invertibility.control_force_matrix([0] * 4, vehicle)[2])
    torque = gg.invertibility.control_moment_matrix([0] * 4, vehicle) * upward
    places = MOTORS[preset.removesuffix("_counterclockwise")]
    for joint, place in zip(servo_map.joints, places, strict=True):
        x, y, z = torque[:, joint.rotor - 1]
        # A push up at (px, py) turns about (py, −px), and the body is turned against the rotor.
        assert (np.sign(-y), np.sign(x)) == place
        assert (z < 0) == (place in COUNTERCLOCKWISE)
        assert (joint.sign, joint.zero) == (1, 0)


def test_a_map_for_another_vehicle_is_refused() -> None:
    mirrored = gg.PAPER.replace(first_rotor_spin="counterclockwise")
    turned = gg.PAPER.replace(first_arm_angle="135deg")
    x_frame = servo_map_named("x_frame")
    with pytest.raises(gg.InputError, match="rotor 1 clockwise, got .*_counterclockw"):
        x_frame.check_vehicle(mirrored)
    with pytest.raises(gg.InputError, match="within 45° of 45°, or at 0°, got 135°"):
        x_frame.check_vehicle(turned)
    # An order of one's own is for whatever vehicle one has.
    own = {"preset": "x_frame", "joint": [{"rotor": k} for k in (1, 2, 3, 4)]}
    servo_map_from_mapping(own).check_vehicle(mirrored)


def test_limits_are_kept_or_refused_with_place_and_values() -> None:
    wide = PULSES | {"us_per_rad": 600}
    servo_map = servo_map_from_mapping(wide)
    said = r"row 1: joint 'tilt1' .* 1000 and 2000 µs \(or clip = true\), got 793.142 µs \(rotor 4 at -67.5°\)"
    with pytest.raises(gg.InputError, match=said):
        mapped_columns(TABLE, servo_map)
    clipping = servo_map_from_mapping(wide | {"clip": True})
    columns = mapped_columns(TABLE, clipping)
    for joint in clipping.joints:
        exact = 1500 + 600 * TABLE.alpha[:, joint.rotor - 1]
        expected = np.clip(exact, 1000, 2000)
        np.testing.assert_allclose(columns[joint.column], expected, atol=0.051)
        beyond = int((expected != exact).sum())
        assert clipped_table(TABLE, clipping)[1][joint.name] == beyond
    radians = clipping.in_radians()  # where the same limits hold
    assert radians.joints[0].limits == pytest.approx((-500 / 600, 500 / 600))
    degrees = servo_map_from_mapping({"unit": "deg", "limits": ["-70deg", "60deg"]})
    with pytest.raises(gg.InputError, match="between -70 and 60 ° .*, got 67.5 °"):
        mapped_columns(TABLE, degrees)


FOUR = [{"rotor": k} for k in (1, 2, 3, 4)]
US = {"unit": "us", "us_per_rad": 400}


@pytest.mark.parametrize(
    ("stated", "message"),
    cases("""
preset="x_fram" | servos .* did you mean 'x_frame'
unti="us" | servos has no field 'unti'; did you mean 'unit'
unit="grad" | unit must be
unit="us" | us_per_rad must be .*, got None
unit="us", us_per_rad=-400 | us_per_rad must be .*sign = −1 turns
**US, limits_us=[2000, 1000] | limits_us must be
**US, limits_us=[-5, 1000] | limits_us must be
**US, neutral_us=900 | neutral_us must be between 1000 and 2000 µs
**US, limits=[-1, 1] | limits must be left out for the unit 'us'
unit="normalized" | limits must be .*, got None
integer=True | integer must be left out for the unit 'rad'
us_per_rad=400 | us_per_rad must be left out for the unit 'rad'
limits=["1rad", "-1rad"] | limits must be .*in this order
limits=3 | limits must be
sign=2 | sign must be 1 or −1
zero="5dg" | zero must be
clip=1 | clip must be
time_unit="msec" | time_unit must be
time="" | time must be a printable text
first_rotor_spin="clockwize" | first_rotor_spin must be
joint=FOUR[:3] | joint must be four tables
joint=[*FOUR[:3], {"rotor": 1}] | rotors must all differ
joint=[*FOUR[:3], {"rotor": 5}] | rotor must be
joint=[*FOUR[:3], {"rotr": 4}] | joint 4 has no field .* mean 'rotor'
joint=[*FOUR[:3], {"name": "alpha1"}] | names of joints must all differ
joint=[*FOUR[:3], {"name": ""}] | name must be a printable text
joint=[*FOUR[:3], {"column": "t"}] | columns must all differ
joint=[*FOUR[:3], {"column": "color"}] | columns must all differ
time="types" | columns must all differ
"""),
)
def test_a_wrong_map_says_what_is_wrong(stated: str, message: str) -> None:
    with pytest.raises(gg.InputError, match=message) as refused:
        servo_map_from_mapping(eval(f"dict({stated})"))
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("given", ["none.toml", "nope", 3, ["x_frame"]])
def test_what_is_no_map_is_refused_in_one_line(given: Any) -> None:
    with pytest.raises(gg.GaitgraphError, match="^servos .*$"):
        write_tables(TABLE, ["servos.csv"], servos=given)


def test_joints_and_maps_that_are_made_directly_are_checked_too() -> None:
    """Texts and lists are for the reader."""
    first: dict[str, Any] = {"name": "a", "column": "a", "rotor": 1}
    for change in ({"limits": ["-1rad", 1]}, {"zero": "5deg"}, {"column": "x" * 65}):
        with pytest.raises(gg.InputError, match=f"{next(iter(change))} must be "):
            gg.io.Joint(**first | change)
    x_frame = servo_map_named("x_frame")
    with pytest.raises(gg.InputError, match="joints must be four"):
        replace(x_frame, joints=x_frame.joints[:3])


def test_a_table_from_elsewhere_is_read_by_a_map(servos: str) -> None:
    columns = mapped_columns(TABLE, servo_map_named(servos))
    rows = np.column_stack([*columns.values()])
    # An unknown column stands beside the pulses, which are printed with more digits than they have.
    lines = [",".join(f"{value:.3f}" for value in row) + ",on" for row in rows]
    Path("log.csv").write_text("\n".join([",".join([*columns, "armed"]), *lines]))
    records = [dict(zip(columns, row, strict=True)) for row in rows.tolist()]
    Path("log.json").write_text(json.dumps(records))
    for name in ("log.csv", "log.json"):
        back = read_table(name, joints=servos)
        assert np.abs(back.alpha - TABLE.alpha).max() <= 0.05 / 390 + 1e-12
        assert back.half_units("alpha2") == pytest.approx(0.05 / 390)
        assert gg.validate(back).flyable
    milliseconds = read_table("log.csv", joints=servos).half_units("t")
    assert milliseconds[0] == pytest.approx(0.0005)


LOG = """time_ms,front_right_us,rear_left_us,front_left_us,rear_right_us
0,1501,1501,1501,1501
10.0,1501,1500.0,1501,1501
"""


@pytest.mark.parametrize(
    ("cell", "replaced", "message"),
    cases(r"""
rear_left_us | rear_lft_us | for 'rear_lft_us' did you mean 'rear_left_us'
time_ms | time | column 'time_ms' is missing
1500.0 | abc | row 2: rear_left_us must be a finite number, got 'abc'
1500.0 | 2100 | row 2: joint .rear_left. .* got 2100 µs \(.* 88.15°\)
10.0 | 0.0 | row 2: t must be at least .* got 0.0
"""),
)
def test_a_wrong_table_from_elsewhere_says_what_is_wrong(
    cell: str, replaced: str, message: str, servos: str
) -> None:
    Path("log.csv").write_text(LOG.replace(cell, replaced))
    with pytest.raises(gg.InputError, match=f"^gait file .*{message}"):
        read_table("log.csv", joints=servos)


def test_the_command_reads_the_columns_of_tables_alone(servos: str, run: Any) -> None:
    Path("log.csv").write_text(LOG)
    done = run("export", "log.csv", "gait.csv", "--columns", servos, "--anyway")
    assert done.code == 0
    expected = read_table("log.csv", joints=servos).alpha
    np.testing.assert_allclose(read_table("gait.csv").alpha[:2], expected, atol=1e-12)
    Path("plan.toml").write_text("waypoints = [[0.8, -0.8], [0.4, -0.4]]")
    for name in ("gait3", "plan.toml"):
        done = run("export", name, "other.csv", "--columns", servos)
        assert (done.code, f"and {name} is none" in done.err) == (2, True)


def test_a_file_with_a_broken_map_is_refused(servos: str) -> None:
    mapped = mapped_table(TABLE, servo_map_named("x_frame"))
    mapped.about["servos"]["joint"][0]["rotor"] = 3
    write_tables(mapped, ["a.json"])
    with pytest.raises(gg.InputError, match=r"a.json.*rotors must all differ"):
        read_table("a.json")


def test_a_map_file_may_have_a_table_of_its_own(servos: str) -> None:
    Path("own.toml").write_text("[servos]\n" + SERVOS)
    own = servo_map_named("own.toml")
    assert own.joints == servo_map_named(servos).joints
    assert own.name == "own"


def test_a_file_for_servos_states_its_map_and_its_rounding(
    servos: str, run: Any
) -> None:
    write_tables(TABLE, ["gait.csv"])
    assert run("export", "gait.csv", "servos.csv", "--servos", servos).code == 0
    ours = read_table("servos.csv")
    assert "servos" not in ours.about
    assert ours.half_units("alpha1") == pytest.approx(ours.rounding)
    assert ours.rounding == pytest.approx(0.05 / 390)
    export("servos.csv", ["back.csv"])
    again = read_table("back.csv")
    np.testing.assert_allclose(again.alpha, TABLE.alpha, atol=1e-12)
    assert again.rounding == 0  # the samples of the motion that the file states
    Path(servos).write_text("clip = true\n" + SERVOS.replace("390", "600"))
    done = run("export", "gait.csv", "clipped.csv", "--servos", servos, "--anyway")
    assert "clipped: joint 'front_right' at its limit in" in done.out
    other = run("export", "gait.csv", "x.csv", "--servos", "x_frame", "--json").json
    assert (other["clipped"], other["servos"]["name"]) == ({}, "x_frame")


def test_what_a_map_clips_is_judged_and_written_as_it_is_then(
    tmp_path: Path,
) -> None:
    """One arm that stops early leaves the surface; four that stop alike are another gait."""
    out = tmp_path / "servos.csv"
    joints = [{"rotor": k, "limits": [-0.3, 0.3]} for k in (1, 2, 3, 4)]
    alike = servo_map_from_mapping({"clip": True, "joint": joints})
    done = export("gait4", out, servos=alike)
    assert set(done.clipped) == set(ANGLES)
    assert np.abs(done.table.alpha).max() == 0.3
    assert read_table(out).alpha == pytest.approx(done.table.alpha)
    assert done.report.as_mapping()["checks"] == gg.validate(out).as_mapping()["checks"]
    one = servo_map_from_mapping(
        {"clip": True, "joint": [joints[0], *({"rotor": k} for k in (2, 3, 4))]}
    )
    with pytest.raises(Infeasible, match="not flyable"):
        export("gait4", tmp_path / "one.csv", servos=one)
    flight = mission("gait4")
    clipped = export(flight, tmp_path / "mission.csv", servos=alike).table
    assert [name for name, _ in clipped.about["phases"]] == [
        name for name, _ in flight.phases
    ]
    assert not (tmp_path / "one.csv").exists()


@pytest.mark.parametrize(
    ("suffix", "reserved"),
    [
        (".csv", "made_by"),
        (".npz", "provenance file"),
        (".mat", "provenance names units alpha_rate"),
    ],
)
def test_a_column_with_a_name_of_the_formats_own_is_refused(
    suffix: str, reserved: str, servos: str
) -> None:
    for name in ("gait", *reserved.split()):
        joint = [*FOUR[:3], {"rotor": 4, "column": name}]
        stated = servo_map_from_mapping({"time": "time", "joint": joint})
        path = f"{name}{suffix}"
        if name == "gait":
            write_tables(TABLE, [path], servos=stated)
            assert (read_table(path).alpha == TABLE.alpha).all()
            continue
        message = f"column '{name}': a {suffix} file"
        with pytest.raises(gg.InputError, match=message):
            write_tables(TABLE, [path], servos=stated)
        assert not Path(path).exists()


@pytest.mark.parametrize("slope", [300, 400])
def test_whole_pulses_are_judged_as_what_they_are_made_from(
    slope: int, servos: str
) -> None:
    joint = [{}, {"sign": -1}, {"zero": "2deg"}, {"neutral_us": 1488}]
    whole = PULSES | {"us_per_rad": slope, "integer": True, "joint": joint}
    assert export("gait4", "pulses.csv", rate=50, servos=whole).report.flyable
    for suffix in ("json", "npz", "mat"):
        export("pulses.csv", f"again.{suffix}", servos=whole)
        assert gg.validate(f"again.{suffix}").valid
    assert gg.validate("pulses.csv").valid
    # What the steps do not explain counts.
    lines = Path("pulses.csv").read_text().splitlines()
    row = lines[20].split(",")
    tilt1 = lines[0].split(",").index("tilt1_us")
    assert row[tilt1].isdigit()  # no decimals for a bus to read
    row[tilt1] = str(int(row[tilt1]) - 30)
    lines[20] = ",".join(row)
    Path("pulses.csv").write_text("\n".join(lines) + "\n")
    with pytest.warns(gg.errors.FileWarning, match="is not used"):
        assert not gg.validate("pulses.csv").valid
