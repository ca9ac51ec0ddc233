"""From tilt angles to joints and back: order, sign, zero, units, limits; presets; our own files and foreign ones."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import gaitgraph as gg
from gaitgraph.gait.given import gait_of
from gaitgraph.gait.table import ACCELERATIONS, RATES, Table
from gaitgraph.io.exporting import export
from gaitgraph.io.formats import read_table, write_tables
from gaitgraph.io.servo_map import (
    PRESETS,
    ServoMap,
    clipped_rows,
    mapped_table,
    servo_map_from_mapping,
    servo_map_named,
    tilts_from_joints,
)
from gaitgraph.timing.timed_gait import table_of

if TYPE_CHECKING:
    from pathlib import Path

GAIT_3 = [
    ("3pi/8", "-3pi/8"),
    ("3pi/8", "-pi/8"),
    ("pi/8", "-pi/8"),
    ("pi/8", "-3pi/8"),
]
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


def mapped_columns(table: Table, servo_map: ServoMap) -> dict[str, Any]:
    return mapped_table(table, servo_map).columns


@pytest.fixture(scope="module")
def table() -> Table:
    plan = gg.plan_loop(GAIT_3)
    return table_of(
        plan.gait.parametrize(period=2.0, samples=40),
        {"request": plan.request.as_mapping()},
    )


@pytest.fixture
def servos(tmp_path: Path) -> Path:
    path = tmp_path / "bench.toml"
    path.write_text(SERVOS)
    return path


def test_a_map_does_what_it_says(table: Table, servos: Path) -> None:
    found = mapped_columns(table, servo_map_named(servos))
    assert list(found) == [
        "time_ms",
        "front_right_us",
        "rear_left_us",
        "front_left_us",
        "rear_right_us",
        "front_right_thrust",
        "rear_left_thrust",
        "front_left_thrust",
        "rear_right_thrust",
    ]
    assert found["front_right_thrust"].tolist() == table["thrust4"].tolist()
    a1, a2, a3, a4 = table.alpha.T
    assert np.allclose(found["time_ms"], 1000 * table["t"], rtol=1e-15)
    for name, exact in (
        ("front_right_us", 1500 - 390 * a4),
        ("rear_left_us", 1500 + 390 * a2),
        ("front_left_us", 1500 + 390 * (a1 + math.radians(5))),
        ("rear_right_us", 1480 + 390 * a3),
    ):
        np.testing.assert_allclose(found[name], exact, rtol=0, atol=0.05 + 1e-9)
        assert found[name].tolist() == found[name].round(1).tolist()


def test_the_papers_map_changes_no_bit(table: Table) -> None:
    found = mapped_columns(table, servo_map_named("paper"))
    assert list(found) == [
        "t",
        *(f"alpha{k}" for k in (1, 2, 3, 4)),
        *RATES,
        *ACCELERATIONS,
        *(f"alpha{k}_thrust" for k in (1, 2, 3, 4)),
    ]
    for name, values in found.items():
        of_table = name
        if name.endswith("_thrust"):
            of_table = f"thrust{name[5]}"
        assert np.array_equal(values, table[of_table])


@st.composite
def joint_maps(draw: st.DrawFn) -> ServoMap:
    joints = []
    for k, rotor in enumerate(draw(st.permutations([1, 2, 3, 4]))):
        unit = draw(st.sampled_from(["rad", "deg", "normalized", "us"]))
        one = {
            "name": f"joint {k}",
            "column": f"joint {k}",
            "rotor": rotor,
            "unit": unit,
        }
        one |= {"sign": draw(st.sampled_from([1, -1])), "zero": draw(st.floats(-1, 1))}
        pulses = {
            "us_per_rad": draw(st.floats(1, 1000)),
            "neutral_us": 4000.0,
            "limits_us": (0.0, 8000.0),
        }
        if unit == "us":
            one |= pulses
        elif unit == "normalized":
            one["limits"] = (draw(st.floats(-4, -3)), draw(st.floats(3, 4)))
        joints.append(one)
    time_unit = draw(st.sampled_from(["s", "ms", "us"]))
    return servo_map_from_mapping(
        {"name": "any", "joint": joints, "time": "time", "time_unit": time_unit}
    )


@settings(max_examples=20, deadline=None)
@given(
    joint_maps(),
    st.lists(
        st.lists(st.floats(-1.57, 1.57), min_size=4, max_size=4), min_size=1, max_size=5
    ),
)
def test_the_inverse_gives_back_what_was_mapped(
    servo_map: ServoMap, rows: list[list[float]]
) -> None:
    alpha = np.array(rows)
    columns: dict[str, Any] = {"t": np.arange(len(rows)) / 7.0}
    columns |= {f"alpha{k + 1}": alpha[:, k] for k in range(4)}
    columns |= {name: 3.0 * alpha[:, k] for k, name in enumerate(RATES)}
    table = Table(columns=columns)
    back = Table(columns=tilts_from_joints(mapped_columns(table, servo_map), servo_map))
    # Pulses are rounded; they are found around 4000 µs, of which floating point carries 1e-12 µs.
    by_rotor = sorted(servo_map.joints, key=lambda joint: joint.rotor)
    errors = np.array([joint.rounding for joint in by_rotor])
    assert errors.max() <= 5.01e-4
    assert (np.abs(back.alpha - alpha) <= errors + 1e-11).all()
    assert np.allclose(back["t"], columns["t"], rtol=1e-15, atol=0)
    if "alpha1_rate" in back:
        assert np.allclose(
            back["alpha1_rate"], columns["alpha1_rate"], rtol=0, atol=1e-13
        )
    assert (
        servo_map_from_mapping(json.loads(json.dumps(servo_map.as_mapping())))
        == servo_map
    )
    applied = mapped_table(table, servo_map.in_radians())
    own = servo_map_from_mapping(applied.about["servos"])
    assert np.allclose(
        Table(columns=tilts_from_joints(applied.columns, own)).alpha,
        alpha,
        rtol=0,
        atol=1e-13,
    )


def test_upright_and_ends_of_the_range_come_back_inside_it() -> None:
    """A digit beyond π/2 would be refused by every reader."""
    ends = np.array([[math.pi / 2, -math.pi / 2, 0.0, 0.0]])
    columns = {f"alpha{k + 1}": ends[:, k] for k in range(4)}
    for slope in np.linspace(100.1, 300.7, 37):
        one = servo_map_from_mapping(
            {"unit": "us", "us_per_rad": float(slope), "zero": "1deg"}
        )
        back = Table(
            columns=tilts_from_joints(mapped_columns(Table(columns=columns), one), one)
        )
        assert np.abs(back.alpha).max() <= math.pi / 2


@pytest.mark.parametrize("given", ["toml", "preset", "mapping", "map"])
def test_a_map_is_taken_in_every_form(
    given: str, table: Table, servos: Path, tmp_path: Path
) -> None:
    mapping: dict[str, Any] = {"preset": "x_frame", "unit": "us", "us_per_rad": 390}
    forms: dict[str, Any] = {
        "toml": str(servos),
        "preset": "x_frame",
        "mapping": mapping,
        "map": servo_map_from_mapping(mapping),
    }
    path = tmp_path / "servos.csv"
    write_tables(table, [path], servos=forms[given])
    export(table, [tmp_path / "exported.csv"], servos=forms[given])
    assert path.read_text() == (tmp_path / "exported.csv").read_text()
    bare = tmp_path / "bare.csv"
    lines = [line.split(",")[:5] for line in path.read_text().splitlines()]
    bare.write_text("\n".join(map(",".join, lines)))
    back = read_table(bare, joints=forms[given])
    np.testing.assert_allclose(back.alpha, table.alpha, rtol=0, atol=2e-4)


@pytest.mark.parametrize("servos", ["none.toml", "nope", 3, ["x_frame"]])
def test_what_is_no_map_is_refused_in_one_line(
    servos: Any, table: Table, tmp_path: Path
) -> None:
    with pytest.raises(gg.errors.GaitgraphError, match="^servos ") as refused:
        write_tables(table, [tmp_path / "servos.csv"], servos=servos)
    assert "\n" not in str(refused.value)


@cache
def paced_gait_and_entry(rounding: str | None) -> tuple[Table, Table]:
    limits = gg.Limits(rate=6.0, acceleration=150.0)
    paced = gg.least_period(gait_of("gait4"), limits, rounding=rounding, samples=400)
    assert paced.timed is not None
    return table_of(paced.timed), gg.transition("hover", "gait4", duration=0.3).table


@pytest.mark.parametrize(
    ("suffix", "rounding"),
    [(".csv", None), (".json", "2deg"), (".npz", None), (".parquet", "2deg")],
)
def test_peaks_of_rounded_pulses_are_never_above_those_of_the_gait(
    tmp_path: Path, suffix: str, rounding: str | None
) -> None:
    if suffix == ".parquet":
        pytest.importorskip("pyarrow", reason="install gaitgraph[table]")
    paced, entry = paced_gait_and_entry(rounding)
    joints = {"preset": "x_frame", "unit": "us", "us_per_rad": 390}
    joints |= {"limits_us": [500, 2500]}
    for source in (paced, entry):
        mapped, back = tmp_path / f"servos{suffix}", tmp_path / "back.csv"
        export(source, [mapped], servos=joints, force=True)
        export(mapped, [back], force=True)
        before = gg.validate(source)
        for file in (mapped, back):
            after = gg.validate(file)
            for name in ("tilt_rate", "tilt_acceleration"):
                assert (after[name].value or 0) <= (before[name].value or 0) * (
                    1 + 1e-9
                )
                assert after[name].ok


# Where motors 1 to 4 are, x forward, y left, and how they turn seen from above.
FRONT_LEFT, FRONT_RIGHT, REAR_LEFT, REAR_RIGHT = (1, 1), (1, -1), (-1, 1), (-1, -1)
PX4 = [(FRONT_RIGHT, "ccw"), (REAR_LEFT, "ccw"), (FRONT_LEFT, "cw"), (REAR_RIGHT, "cw")]
BETAFLIGHT = [
    (REAR_RIGHT, "cw"),
    (FRONT_RIGHT, "ccw"),
    (REAR_LEFT, "ccw"),
    (FRONT_LEFT, "cw"),
]


@pytest.mark.parametrize("end", ["", "_counterclockwise"])
@pytest.mark.parametrize(
    ("preset", "motors"), [("x_frame", PX4), ("betaflight", BETAFLIGHT)]
)
def test_presets_number_the_motors_as_the_flight_controllers_do(
    preset: str, end: str, motors: list[Any]
) -> None:
    """Where a rotor is, and how it turns, is read off the torques that it makes."""
    one = servo_map_named(preset + end)
    assert one.first_arm_angle is not None
    assert one.first_rotor_spin is not None
    vehicle = gg.PAPER.replace(
        first_arm_angle=one.first_arm_angle, first_rotor_spin=one.first_rotor_spin
    )
    one.check_vehicle(vehicle)
    upright = np.zeros(4)
    pushing_up = np.sign(gg.invertibility.control_force_matrix(upright, vehicle)[2])
    torque = gg.invertibility.control_moment_matrix(upright, vehicle) * pushing_up
    for joint, (place, spin) in zip(one.joints, motors, strict=True):
        x, y, z = torque[:, joint.rotor - 1]
        assert (
            np.sign(-y),
            np.sign(x),
        ) == place  # a push up at (px, py) turns about (py, −px)
        assert spin == (
            "cw" if z > 0 else "ccw"
        )  # the body is turned against the rotor
        assert joint.sign == 1
        assert joint.zero == 0


def test_a_map_for_another_vehicle_is_refused() -> None:
    mirrored = gg.PAPER.replace(first_rotor_spin="counterclockwise")
    for preset in PRESETS:
        servo_map_named(preset).check_vehicle(
            mirrored if "counter" in preset else gg.PAPER
        )
    with pytest.raises(
        gg.InputError,
        match="must have rotor 1 clockwise, got .* are x_frame_counterclockwise, b",
    ):
        servo_map_named("x_frame").check_vehicle(mirrored)
    with pytest.raises(
        gg.InputError, match="must have its first arm at 45°, or at 0°, got 135°"
    ):
        servo_map_named("x_frame").check_vehicle(
            gg.PAPER.replace(first_arm_angle="135deg")
        )
    # An order of one's own is for whatever vehicle one has.
    own = servo_map_from_mapping(
        {"preset": "x_frame", "joint": [{"rotor": k} for k in (1, 2, 3, 4)]}
    )
    own.check_vehicle(mirrored)


def test_limits_are_kept_or_refused_with_place_and_values(table: Table) -> None:
    stated = {"preset": "x_frame", "unit": "us", "us_per_rad": 600}
    with pytest.raises(gg.InputError) as refused:
        mapped_columns(table, servo_map_from_mapping(stated))
    assert str(refused.value) == (
        "servos 'x_frame': row 1: joint 'tilt1' must be between 1000 and 2000 µs (or clip = true), "
        "got 793.142 µs (rotor 4 at -67.5°)"
    )
    clipping = servo_map_from_mapping({**stated, "clip": True})
    found = mapped_columns(table, clipping)
    values = np.concatenate([found[f"tilt{k}_us"] for k in (1, 2, 3, 4)])
    assert values.min() == 1000
    assert values.max() == 2000
    beyond = {name: int((np.abs(table[f"alpha{rotor}"]) > 500 / 600).sum()) for name, rotor in
              zip(clipping.joint_names, (4, 2, 1, 3), strict=True)}  # fmt: skip
    assert clipped_rows(table, clipping) == beyond
    # In radians the same limits hold.
    assert np.abs(
        mapped_table(table, clipping.in_radians()).alpha
    ).max() == pytest.approx(500 / 600)
    assert clipping.in_radians().joints[0].limits == pytest.approx(
        (-500 / 600, 500 / 600)
    )
    in_degrees = servo_map_from_mapping({"unit": "deg", "limits": ["-70deg", "60deg"]})
    with pytest.raises(
        gg.InputError,
        match="joint 'alpha1' must be between -70 and 60 ° .*, got 67.5 °",
    ):
        mapped_columns(table, in_degrees)
    inside = {f"tilt{k}_us": [1500.0, 1500.0] for k in (1, 3, 4)}
    with pytest.raises(
        gg.InputError, match=r"row 2: joint 'tilt2' must be .*, got 2000\.5 µs"
    ):
        tilts_from_joints(
            {**inside, "tilt2_us": [1500.0, 2000.5]}, servo_map_from_mapping(stated)
        )


FOUR = [{"rotor": k} for k in (1, 2, 3, 4)]
REFUSED: list[tuple[dict[str, Any], str]] = [
    (
        {"preset": "x_fram"},
        "servos must be a preset .* or a .toml file, got 'x_fram'; did you mean 'x_frame'",
    ),
    ({"unti": "us"}, "servos has no field 'unti'; did you mean 'unit'"),
    ({"unit": "grad"}, "unit must be rad, deg, normalized or us, got 'grad'"),
    ({"unit": "us"}, "us_per_rad must be between 0.001 and 1e9 .*, got None"),
    (
        {"unit": "us", "us_per_rad": -400},
        "us_per_rad must be .*sign = −1 turns the other way.*, got -400",
    ),
    (
        {"unit": "us", "us_per_rad": 400, "limits_us": [2000, 1000]},
        "limits_us must be .*, in this order, got .2000",
    ),
    (
        {"unit": "us", "us_per_rad": 400, "limits_us": [-5, 1000]},
        "limits_us must be .* between 0 and 1e6 µs",
    ),
    (
        {"unit": "us", "us_per_rad": 400, "neutral_us": 900},
        "neutral_us must be between 1000 and 2000 µs.*, got 900",
    ),
    (
        {"unit": "us", "us_per_rad": 400, "limits": [-1, 1]},
        "limits must be left out for the unit 'us'",
    ),
    ({"unit": "normalized"}, "limits must be the least and the largest .*, got None"),
    ({"integer": True}, "integer must be left out for the unit 'rad'"),
    ({"us_per_rad": 400}, "us_per_rad must be left out for the unit 'rad'"),
    ({"limits": ["1rad", "-1rad"]}, "limits must be .*in this order"),
    ({"limits": 3}, "limits must be the least and the largest .*, got 3"),
    ({"sign": 2}, "sign must be 1 or −1, got 2"),
    ({"zero": "5dg"}, "zero must be a finite number in radians"),
    ({"clip": 1}, "clip must be true or false, got 1"),
    ({"time_unit": "msec"}, "time_unit must be s, ms or us, got 'msec'"),
    ({"time": ""}, "time must be a printable text of 1 to 64 characters, got ''"),
    ({"first_rotor_spin": "clockwize"}, "first_rotor_spin must be .*, got 'clockwize'"),
    ({"joint": FOUR[:3]}, "joint must be four tables .*, got "),
    ({"joint": [*FOUR[:3], {"rotor": 1}]}, "rotors must all differ, got 1, 2, 3, 1"),
    ({"joint": [*FOUR[:3], {"rotor": 5}]}, "rotor must be 1, 2, 3 or 4, got 5"),
    (
        {"joint": [*FOUR[:3], {"rotr": 4}]},
        "joint 4 has no field 'rotr'; did you mean 'rotor'",
    ),
    (
        {"joint": [*FOUR[:3], {"name": "alpha1"}]},
        "names of joints must all differ, got alpha1",
    ),
    ({"joint": [*FOUR[:3], {"column": "t"}]}, "columns must all differ, got t,"),
    (
        {"joint": [*FOUR[:3], {"column": "color"}]},
        "columns must all differ, got .*, color_",
    ),
    ({"time": "types"}, "columns must all differ, got types"),
    (
        {"joint": [*FOUR[:3], {"name": ""}]},
        "name must be a printable text of 1 to 64 characters, got ''",
    ),
]


def test_a_wrong_map_says_what_is_wrong() -> None:
    for stated, message in REFUSED:
        with pytest.raises(gg.InputError, match=message) as refused:
            servo_map_from_mapping(stated)
        assert "\n" not in str(refused.value)


def test_joints_and_maps_that_are_made_directly_are_checked_too() -> None:
    one = servo_map_named("x_frame")
    first: dict[str, Any] = {"name": "a", "column": "a", "rotor": 1}
    for name, value in (
        ("limits", ["-1rad", 1]),
        ("zero", "5deg"),
    ):  # texts and lists are for the reader
        with pytest.raises(gg.InputError, match=f"joint 'a': {name} must be "):
            gg.io.Joint(**first | {name: value})
    with pytest.raises(
        gg.InputError, match="column must be a printable text of 1 to 64 characters"
    ):
        gg.io.Joint(**first | {"column": "x" * 65})
    with pytest.raises(gg.InputError, match="joints must be four"):
        replace(one, joints=one.joints[:3])


def test_a_table_from_elsewhere_is_read_by_a_map(
    table: Table, servos: Path, tmp_path: Path
) -> None:
    found = mapped_columns(table, servo_map_named(servos))
    path = tmp_path / "log.csv"
    rows = np.column_stack([found[name] for name in reversed(found)])
    # An unknown column stands beside the pulses, which are printed with more digits than they have.
    lines = [",".join(f"{value:.3f}" for value in row) + ",on" for row in rows]
    path.write_text("\n".join([",".join([*reversed(found), "armed"]), *lines]))
    back = read_table(path, joints=servo_map_named(servos))
    assert np.allclose(back.alpha, table.alpha, rtol=0, atol=0.05 / 390 + 1e-12)
    assert back.half_units("alpha2") == pytest.approx(0.05 / 390)
    assert gg.validate(back).flyable
    content = [
        dict(zip(found, row, strict=True))
        for row in np.column_stack(list(found.values())).tolist()
    ]
    (tmp_path / "log.json").write_text(json.dumps(content))
    assert np.allclose(
        read_table(tmp_path / "log.json", joints=servo_map_named(servos)).alpha,
        table.alpha,
        rtol=0,
        atol=0.05 / 390 + 1e-12,
    )


@pytest.mark.parametrize(
    ("found", "replaced", "message"),
    [
        (
            "rear_left_us",
            "rear_lft_us",
            "is missing: for 'rear_lft_us' did you mean 'rear_left_us'",
        ),
        ("time_ms", "time", "column 'time_ms' is missing"),
        ("1500.0", "abc", "row 2: rear_left_us must be a finite number, got 'abc'"),
        (
            "1500.0",
            "2100",
            r"row 2: joint .rear_left. must be between 1000 and 2000 µs, got 2100 µs \(.* 88.15°\)",
        ),
        ("10.0", "0.0", "row 2: t must be at least .* got 0.0"),
    ],
)
def test_a_wrong_table_from_elsewhere_says_what_is_wrong(
    found: str, replaced: str, message: str, servos: Path, tmp_path: Path
) -> None:
    path = tmp_path / "log.csv"
    content = "time_ms,front_right_us,rear_left_us,front_left_us,rear_right_us\n0,1501,1501,1501,1501\n"
    content += "10.0,1501,1500.0,1501,1501\n"
    assert found in content
    path.write_text(content.replace(found, replaced))
    with pytest.raises(gg.InputError, match=message) as refused:
        read_table(path, joints=servo_map_named(servos))
    assert str(refused.value).startswith("gait file ")


def test_a_file_with_a_broken_map_is_refused(table: Table, tmp_path: Path) -> None:
    one = mapped_table(table, servo_map_named("x_frame"))
    one.about["servos"]["joint"][0]["rotor"] = 3
    write_tables(one, [tmp_path / "a.json"])
    with pytest.raises(gg.InputError, match=r"a.json.*rotors must all differ"):
        read_table(tmp_path / "a.json")


def test_a_map_file_may_have_a_table_of_its_own(servos: Path, tmp_path: Path) -> None:
    inside = tmp_path / "bench" / "bench.toml"
    inside.parent.mkdir()
    inside.write_text("[servos]\n" + SERVOS)
    assert servo_map_named(inside) == servo_map_named(servos)
    assert servo_map_named(inside).name == "bench"
    with pytest.raises(gg.errors.FileProblem, match="cannot be read"):
        servo_map_named(tmp_path / "none.toml")


def test_export_writes_for_servos_and_reads_back(
    table: Table, servos: Path, tmp_path: Path, run: Any
) -> None:
    gait, mapped, back, foreign = (
        tmp_path / name
        for name in ("gait.csv", "servos.csv", "back.csv", "foreign.csv")
    )
    write_tables(table, [gait])
    done = run("export", gait, mapped, "--servos", servos)
    assert done.code == 0
    ours = read_table(mapped)  # which states its map
    assert ("servos" in ours.about, ours.about["period"]) == (False, 2.0)
    assert ours.half_units("alpha1") == pytest.approx(ours.rounding)
    assert ours.rounding == pytest.approx(0.05 / 390)
    assert np.allclose(ours["t"], table["t"])
    assert run("export", mapped, back).code == 0
    again = read_table(back)
    assert np.allclose(again.alpha, table.alpha, rtol=0, atol=ours.rounding + 1e-12)
    assert again.rounding == 0  # the samples of the motion that the file states
    # Without what made it, it is a table from elsewhere.
    foreign.write_text(
        "\n".join(
            ",".join(line.split(",")[:5]) for line in mapped.read_text().splitlines()
        )
    )
    done = run(
        "export",
        foreign,
        back,
        "--columns",
        servos,
        "--servos",
        "x_frame",
        "--force",
        "--json",
    )
    assert (done.json["clipped"], done.json["servos"]["name"]) == ({}, "x_frame")
    servos.write_text("clip = true\n" + SERVOS.replace("390", "600"))
    done = run("export", gait, back, "--servos", servos, "--force")
    assert "clipped: joint 'front_right' at its limit in" in done.out
    assert run("plan", mapped, "--json").json["length"] == pytest.approx(
        math.pi
    )  # it states what made it


@pytest.mark.parametrize(
    ("suffix", "names"),
    [
        (".csv", ["made_by"]),
        (".npz", ["provenance", "file"]),
        (".mat", ["provenance", "names", "units", "alpha_rate"]),
    ],
)
def test_a_column_with_a_name_of_the_formats_own_is_refused(
    suffix: str, names: list[str], table: Table, tmp_path: Path
) -> None:
    for name in [
        "t",
        "made_by",
        "provenance",
        "names",
        "units",
        "gait",
        "alpha_rate",
        "servos",
        "about",
    ]:
        stated = servo_map_from_mapping(
            {"time": "time", "joint": [*FOUR[:3], {"rotor": 4, "column": name}]}
        )
        path = tmp_path / f"{name}{suffix}"
        if name in names:
            with pytest.raises(
                gg.InputError,
                match=f"column '{name}': a {suffix} file has something else there",
            ):
                write_tables(table, [path], servos=stated)
            assert not path.exists()
        else:
            write_tables(table, [path], servos=stated)
            assert (read_table(path).alpha == table.alpha).all()


@pytest.mark.parametrize("slope", [300, 400])
def test_whole_pulses_beside_a_zero_are_judged_as_what_they_are_made_from(
    slope: int, tmp_path: Path
) -> None:
    servos = servo_map_from_mapping(
        {
            "preset": "x_frame",
            "unit": "us",
            "us_per_rad": slope,
            "integer": True,
            "joint": [{}, {"sign": -1}, {"zero": "2deg"}, {"neutral_us": 1488}],
        }
    )
    path = tmp_path / "pulses.csv"
    exported = export("gait4", path, rate=50, servos=servos)
    columns = [name for name in read_columns(path) if name.endswith("_us")]
    assert len(columns) == 4
    assert exported.report.flyable
    judged = gg.validate(path)
    assert judged.flyable
    assert judged.valid
    for suffix in ("json", "npz", "mat"):
        export(path, tmp_path / f"again.{suffix}", servos=servos)
        assert gg.validate(tmp_path / f"again.{suffix}").valid
    # What the steps do not explain counts.
    lines = path.read_text().splitlines()
    names = lines[0].split(",")
    row = lines[20].split(",")
    pulse = row[names.index("tilt1_us")]
    assert pulse.isdigit()  # no decimals for a bus to read
    row[names.index("tilt1_us")] = str(int(pulse) - 30)
    lines[20] = ",".join(row)
    path.write_text("\n".join(lines) + "\n")
    with pytest.warns(gg.errors.FileWarning, match="is not used"):
        assert not gg.validate(path).valid


def read_columns(path: Path) -> list[str]:
    return path.read_text().partition("\n")[0].split(",")
