"""Gait tables as files: what is read, what is refused, and what is written."""

from __future__ import annotations

import csv
import json
import re
import warnings
from dataclasses import replace
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gaitgraph as gg
from gaitgraph.gait.gait import lift
from gaitgraph.gait.given import gait_of
from gaitgraph.gait.table import (
    ANGLES,
    ORDER,
    RATES,
    Table,
    accelerations_of,
    provenance_text,
)
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.invertibility.geometry import Geometry
from gaitgraph.invertibility.matrices import level_determinant
from gaitgraph.io import formats
from gaitgraph.io.columns import table_from_frame
from gaitgraph.io.exporting import export
from gaitgraph.io.formats import read_table, write_tables
from gaitgraph.planning.request import read_request
from gaitgraph.timing.timed_gait import table_of
from gaitgraph.vehicle import vehicle_named
from tests.mutated import refusal
from tests.published import GAITS
from tests.samples import PUBLISHED, table_from

G1, _, G3, _ = GAITS
TIMED = lift(G3.angles, "red").parametrize(samples=4)
HEAD = ",".join(ANGLES)


def written(path: Path, *lines: str) -> Path:
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


# Reading


def test_degrees_order_bom_line_ends_and_digits_are_read(tmp_path: Path) -> None:
    path = tmp_path / "theirs.csv"
    head = "note,alpha4_deg,alpha2_deg,alpha1_deg,alpha3_deg"
    rows = ["x,-67.5,-67.5,67.5,67.5", "", "y,-22.5,-22.5,67.5,67.5"]
    for end in ("\n", "\r\n", "\r"):
        path.write_text(end.join([head, *rows]), encoding="utf-8-sig", newline="")
        gait = gait_of(read_table(path))
        expected = np.array([(3, -3, 3, -3), (3, -1, 3, -1)]) * pi / 8
        np.testing.assert_allclose(gait.alpha, expected)
        assert gait.colors == ("red", "red")
    written(path, "alpha1,alpha2,alpha3,alpha4_deg", "0.1235,0.5000,0,20.25")
    table = read_table(path)
    half_units = [float(table.half_units(f"alpha{k}")[0]) for k in (1, 2, 4)]
    assert half_units == pytest.approx([5e-5, 0.05, np.radians(0.005)])


@pytest.mark.parametrize(
    ("head", "unused"),
    [
        ("time,{}", ""),
        ("# of Monday\n# t,{}", ""),
        ("t [s],{}", "'t [s]' (did you mean 't'?)"),
        ("Time (ms),{}", "'Time (ms)' (did you mean 'time_ms'?)"),
        ("t_ns,{}", "'t_ns' (a time is t in s, t_ms or t_us)"),
        (
            "foo,{},alpha1_rates,bar",
            "'foo', 'alpha1_rates' (did you mean 'alpha1_rate'?), 'bar'",
        ),
    ],
)
def test_columns_are_read_as_what_they_are_or_listed_once(
    tmp_path: Path, head: str, unused: str, run: Any
) -> None:
    path, more = tmp_path / "a.csv", head.count(",") - 1
    rows = np.column_stack([TIMED.t, TIMED.alpha, np.zeros((5, more))])
    np.savetxt(path, rows, delimiter=",", header=head.format(HEAD), comments="")
    done = run("export", path, tmp_path / "b.json", "--period", 1)
    told = f"gaitgraph: warning: gait file {str(path)!r}: columns not used: {unused}\n"
    assert (done.code, done.err) == (0, told if unused else "")


@pytest.mark.parametrize(
    ("name", "in_a_second"),
    [("t_ms", 1e3), ("time_ms", 1e3), ("t_us", 1e6), ("time_us", 1e6)],
)
@pytest.mark.parametrize("suffix", [".csv", ".npz"])
def test_times_in_other_units_are_read(
    tmp_path: Path, suffix: str, name: str, in_a_second: float
) -> None:
    columns = table_from(TIMED.alpha, **{name: TIMED.t * in_a_second}).columns
    path = tmp_path / f"theirs{suffix}"
    write_tables(Table(columns=columns), [path])
    for table in (read_table(path), table_from_frame(columns)):
        assert name not in table
        np.testing.assert_allclose(table["t"], TIMED.t, rtol=1e-15)


@pytest.mark.parametrize(
    ("t", "note"),
    [
        ([0, 20.2, 40.4, 60.6], "row 4 is 60.6 s after row 1, .* A column of ms is"),
        ([0, 0.1, 0.2, 1.25, 1.35], "row 4 is 1.05 s after the row before, 10.5 times"),
        ([0, 20, 40, 60], None),
        ([0, 0.1, 0.2, 1.1, 1.2, 1.3], None),
        ([1000], None),
    ],
)
def test_times_that_are_probably_wrong_are_told(
    tmp_path: Path, t: list[float], note: str | None
) -> None:
    lines = [f"{time},{0.4 + k / 100},-0.4,red" for k, time in enumerate(t)]
    path = written(tmp_path / "theirs.csv", "t,alpha1,alpha2,color", *lines)
    with warnings.catch_warnings(record=True) as raised:
        warnings.simplefilter("always")
        notes = read_table(path).notes
    assert len(notes) == len(raised) == (note is not None)
    assert note is None or re.search(note, str(raised[0].message))


def test_quotation_marks_hold_texts_whole_and_swallow_nothing(tmp_path: Path) -> None:
    path, row = tmp_path / "gait.csv", "0.4,-0.4,0.4,-0.4"
    written(path, f"{HEAD},types", f'{row},"( + , + )"', f'{row},"(+,+)"')
    assert read_table(path)["types"][0] == "( + , + )"
    rows = [f"x,{row}"] * 3000
    for place in (0, 1500, 2999):
        broken = [*rows[:place], f'"x,{row}', *rows[place + 1 :]]
        written(path, f"note,{HEAD}", *broken)
        with pytest.raises(gg.InputError, match="must be comma-separated text"):
            read_table(path)
        broken[place] = f'"x\ny",{row}'  # a line break in quotation marks is no row
        assert len(read_table(written(path, f"note,{HEAD}", *broken))) == 3000


@pytest.mark.parametrize(
    ("alpha", "expected"),
    [
        ([0.1, 0.2, 0.3, 0.4], [1, 1.5, -0.5, -3]),  # over one step at its ends
        ([0.1, 0.2, 0.3, 0.1], [-1, 1.5, -0.5, -1]),  # it goes on at its first row
    ],
)
def test_accelerations_are_slopes_of_rates_over_two_steps(
    alpha: list[float], expected: list[float]
) -> None:
    rates: dict[str, Any] = dict.fromkeys(RATES, np.array([0.0, 1.0, 3.0, 0.0]))
    table = table_from(np.transpose([alpha] * 4), t=np.arange(4.0), **rates)
    np.testing.assert_allclose(accelerations_of(table)[:, 2], expected)


# What is refused

NUMBER = "must be a finite number"
BAD_CSV = [
    ("", "it is empty"),
    ("0,0.4,-0.4,0.4,-0.4\n", "line 1 must be a header .* got numbers"),
    ("0 0 0 0\n", "line 1 must be a header"),
    ("alpha1;alpha2;alpha3;alpha4\n0;0;0;0\n", "separated by commas, .* semicolons"),
    ('@\n"0,0,0,0\n', "comma-separated text"),
    ("@\n", "it must have at least one row"),
    ("@\n0,0,0\n", "line 2 must have 4 fields, as the header has, got 3"),
    ("t,time,@\n0,0,0,0,0,0\n", "columns must have 't' or 'time', got both"),
    ("t_us,time_ms,@\n0,0,0,0,0,0\n", "must have 'time_ms' or 't_us', got both"),
    ("@,alpha1_deg\n0,0,0,0,0\n", "must have 'alpha1' or 'alpha1_deg', got both"),
    ("@,alpha1\n0,0,0,0,0\n", "must have different names, got 'alpha1' 2 times"),
    ("alpha1,alpha2,alpha3\n0,0,0\n", "column 'alpha4' is missing"),
    ("α1,a2,Alpha 3,alpha4 [rad]\n0,0,0,0\n", ".*".join(f"mean '{a}'" for a in ANGLES)),
    ("@\n0,0,x,0\n", f"row 1: alpha3 {NUMBER}, got 'x'"),
    ("@\n0,0,0,0\n20deg,0,0,0\n", "row 2: .* in degrees the column is alpha1_deg"),
    ("@\n0,0,0,\n", f"alpha4 {NUMBER}, got ''"),
    ("@\n0,0,inf,0\n", f"alpha3 {NUMBER}, got 'inf'"),
    ("@\n0,0,1_0,0\n", f"alpha3 {NUMBER}, got '1_0'"),
    ("@\n0,0,١,0\n", f"alpha3 {NUMBER}, got '١'"),
    ("@\n0,1.6,0,0\n", "alpha2 must be within ±π/2 rad .*, got 1.6"),
    ("@\n0,0,1e300,0\n", "alpha3 must be within ±1e\\+06"),
    ("t,@\n1e300,0,0,0,0\n", "t must be within ±1e\\+11"),
    ("t,@\n0,0,0,0,0\n5e-324,0,0,0,0\n", "row 2: t must be at least 1e-09 s after"),
    ("@,alpha1_rate\n0,0,0,0,1e308\n", "alpha1_rate must be within ±1e\\+12"),
    ("alpha1,alpha2,color\n0,0,green\n", "color must be one of .*, got 'green'"),
    ('@,types\n0,0,0,0,"(+,-)"\n', "types must be one of"),
    ("@,made_by\n0,0,0,0,gaitgraph gait table\n", "must be the JSON that gaitgraph"),
]
ZEROS = '"alpha2": [0], "alpha3": [0], "alpha4": [0]}'
BAD_JSON = [
    ("{", "it is not JSON"),
    ("[" * 2_000_000, "nested too deeply"),
    ('{"alpha1": [' + "9" * 5000 + "]}", "it is not JSON"),
    ("3", "it must be an object of columns, .* got 3"),
    ("[]", "column 'alpha1' is missing"),
    ('[{"alpha1": 0}, {"alpha2": 0}]', "row 2 must be .* with the fields of row 1"),
    ('{"alpha1": [0], "alpha1": [1], ' + ZEROS, "must differ, got 'alpha1' twice"),
    ('{"columns": 3}', "columns must be an object of lists, got 3"),
    ('{"alpha1": [0, 1], ' + ZEROS, "must have the same number of rows, got 1 to 2"),
    ('{"alpha1": [true], ' + ZEROS, f"alpha1 {NUMBER}, .* got True"),
    ('{"alpha1": [[0]], ' + ZEROS, f"alpha1 {NUMBER}, .* got \\[0\\]"),
    ('{"alpha1": [1e999], ' + ZEROS, f"alpha1 {NUMBER}, .* got inf"),
    ('{"alpha1": [NaN], ' + ZEROS, "NaN is no number of JSON"),
    ('{"path": [[1, -1, 1, -1]], "colors": 5}', "colors must be a list of .*, got 5"),
    ('{"path": [[0, 0]]}', "path must be a list of .*, got \\[\\[0, 0\\]\\]"),
]


@pytest.mark.parametrize(
    ("suffix", "text", "message"),
    [
        *((".csv", text.replace("@", HEAD), message) for text, message in BAD_CSV),
        *((".json", text, message) for text, message in BAD_JSON),
    ],
)
def test_malformed_files_are_refused_in_one_line(
    tmp_path: Path, suffix: str, text: str, message: str
) -> None:
    path = tmp_path / f"bad{suffix}"
    path.write_text(text)
    assert re.search(message, refusal(path))


def test_rows_and_lines_are_counted_through(tmp_path: Path) -> None:
    lines = ["", f"t,{HEAD}", "", *(f"{t},0.4,-0.4,0.4,-0.4" for t in range(40))]
    for text, message in (
        ("20,0.4,-0.4,x,-0.4", "row 21: alpha3"),
        ("20,0.4,-0.4,0.4", "line 24 must have 5 fields"),
        ('20,"0.4"1,0.4,0.4,0.1', "line 24 must be comma-separated"),
        ("19,0.4,-0.4,0.4,-0.4", "row 21: t must be at least"),
    ):
        path = written(tmp_path / "gait.csv", *lines[:23], text, *lines[24:])
        assert message in refusal(path)


# What a file states about its making


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("vehicle", {"mass": -1}, "mass must be .*, got -1"),
        ("vehicle", 5, "vehicle must be a preset .*, got 5"),
        ("coefficients", "x", "coefficients must be .*, got 'x'"),
        ("crossing_tolerance", "x", "crossing_tolerance must be a number ≥ 0 .rad."),
        ("period", "x", None),
        ("law", 3, None),
        ("samples", "4", None),
    ],
)
def test_about_that_is_wrong_is_refused_or_not_used(
    tmp_path: Path, key: str, value: Any, message: str | None
) -> None:
    table = table_of(TIMED)
    path = tmp_path / "gait.json"
    write_tables(Table(columns=table.columns, about=table.about | {key: value}), [path])
    if message is None:
        with pytest.warns(gg.errors.FileWarning, match=f"{key} must be .*not used"):
            assert read_table(path).motion is None
    else:
        with pytest.raises(gg.InputError, match=message):
            export(path, [])


@pytest.mark.parametrize("suffix", [".csv", ".json", ".npz", ".mat"])
@pytest.mark.parametrize("vehicle", ["own.toml", {"preset": "own.toml"}])
def test_a_gait_file_names_no_other_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, vehicle: Any, suffix: str
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("own.toml").write_text('secret = "never shown"')
    table, path = table_of(TIMED), f"gait{suffix}"
    for about, read in (
        ({"vehicle": vehicle}, gg.validate),
        ({"request": {"vehicle": vehicle}}, lambda path: read_request(path, {})),
    ):
        stated = replace(table, about={**table.about, **about})
        write_tables(stated, [path], force=True)
        with pytest.raises(gg.InputError, match="must be a preset .*, got") as refused:
            read(path)
        assert "secret" not in str(refused.value)


def test_a_request_names_a_vehicle_by_its_file_and_a_saved_plan_does_not(
    tmp_path: Path,
) -> None:
    written(tmp_path / "own.toml", 'preset = "beetle_omni"')
    lines = "waypoints = [[0.8, -0.8], [0.4, -0.4]]", 'vehicle = "own.toml"'
    request = written(tmp_path / "request.toml", *lines)
    assert read_request(request, {})[0].vehicle.name == "beetle_omni"
    plan = gg.plan_loop([(0.8, -0.8), (0.4, -0.4)]).as_mapping()
    plan["request"]["vehicle"] = "own.toml"
    saved = written(tmp_path / "plan.json", json.dumps(plan))
    for read in (gg.validate, lambda path: read_request(path, {})):
        with pytest.raises(gg.InputError, match="must be a preset .*, got 'own.toml'"):
            read(saved)


def test_a_saved_plan_is_a_gait_file(tmp_path: Path) -> None:
    plan = gg.plan_loop(G3.waypoints, period=0.5, law="constant-speed")
    saved = written(tmp_path / "plan.json", json.dumps(plan.as_mapping()))
    plan.timed().write(tmp_path / "a.csv")
    export(saved, tmp_path / "b.csv")
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()
    of_plan, of_table = gg.validate(saved), gg.validate(tmp_path / "a.csv")
    assert of_plan["tilt_rate"].value == pytest.approx(of_table["tilt_rate"].value)
    refused = gg.plan_loop(G1.waypoints, coefficients="exact").as_mapping()
    assert "a plan without a gait" in refusal(written(saved, json.dumps(refused)))


def test_a_gait_made_from_another_tells_no_request(tmp_path: Path) -> None:
    path, gait = tmp_path / "made.csv", gg.plan_loop(G3.waypoints).gait
    others = [gait.reversed(), gait.started_at(1), gait.biased(0.9)]
    made: list[tuple[Any, str]]
    made = [(table_of(other.parametrize()), "must hold a request") for other in others]
    optimal: Any = gg.optimal_gait([(0.9, -0.9)], objective="hover_reserve", pieces=8)
    made.append((optimal.table(samples=4), "got none .it was made by optimize"))
    made.append((gg.retarget(gait.alpha).table, "got none .it was made by retarget"))
    for table, message in made:
        write_tables(table, [path], force=True)
        with pytest.raises(gg.InputError, match=message):
            read_request(path, {})
    export(gait, path, period=1.0, force=True)
    assert gait_of(path).request["waypoints"] == gait.request["waypoints"]


def test_what_made_a_csv_file_is_one_text_in_its_first_row(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    vehicle = gg.PAPER.replace(name="light", mass=0.3)
    table = table_of(gg.plan_loop(G3.waypoints, vehicle=vehicle).timed(samples=40))
    write_tables(table, [path])
    with path.open(newline="") as stream:
        told = [row["made_by"] for row in csv.DictReader(stream)]
    assert told == [provenance_text(table), *[""] * 40]
    assert read_table(path).about == table.about
    # Somebody else's column of that name is passed over.
    written(path, f"{HEAD},made_by", "0.4,-0.4,0.4,-0.4,me")
    assert read_table(path).about == {}


# Writing


def test_export_keeps_rows_that_have_a_clock_or_samples_them(tmp_path: Path) -> None:
    rows = "0,0.4,-0.4,0.4,-0.4", "0.3,0.9,-0.4,0.9,-0.4", "3,0.4,-0.4,0.4,-0.4"
    path = written(tmp_path / "timed.csv", f"t,{HEAD}", *rows)
    assert export(path, []).table["t"].tolist() == [0, 0.3, 3]
    assert export(path, [], rate=10).table["t"][[1, -1]].tolist() == [0.1, 3.0]
    retimed = export(path, [], period=2.0, samples=10, law="equal-time").table
    assert (len(retimed), retimed["t"][-1], retimed["alpha1"].max()) == (11, 2.0, 0.9)


def test_columns_that_disagree_with_the_angles_are_computed_anew(
    tmp_path: Path,
) -> None:
    head = f"t,{HEAD},R,types,alpha1_rate,thrust2"
    rows = '0,0.4,-0.4,0.4,-0.4,7,"(-,-)",9,9', '1,0.8,-0.4,0.8,-0.4,7,"(-,-)",9,9'
    path = written(tmp_path / "a.csv", head, *rows)
    table = export(path, []).table
    np.testing.assert_allclose(table["R"], level_determinant(table.alpha, PUBLISHED))
    assert table["types"] == ("(+,+)",) * 3
    assert list(table.columns) == list(ORDER)
    np.testing.assert_allclose(table["alpha1_rate"], [0.4, -0.4, 0.4])
    vehicle = vehicle_named("beetle_omni")
    other = export(path, [], vehicle=vehicle, anyway=True).table
    exact = coefficients_of(vehicle, "exact")
    np.testing.assert_allclose(other["R"], level_determinant(other.alpha, exact))
    assert other.about["coefficients"] == "exact"


@pytest.mark.parametrize("preset", ["paper", "beetle_omni", "beetle_art"])
def test_thrusts_of_each_row_carry_the_weight_without_moment(preset: Any) -> None:
    vehicle = vehicle_named(preset)
    assert vehicle.mass is not None
    gait = gg.lift([(-0.4, 0.4), (-0.4, 0.9), (-0.9, 0.9)], "red", vehicle=vehicle)
    table = table_of(gait.parametrize(samples=12))
    thrusts = np.column_stack([table[f"thrust{k}"] for k in (1, 2, 3, 4)])
    level = Geometry.of_vehicle(vehicle).level_matrix(table.alpha)
    wrench = (level @ thrusts[..., None])[..., 0]
    expected = np.array([0, 0, 0, vehicle.mass * vehicle.gravity])
    np.testing.assert_allclose(wrench[:, :4], np.tile(expected, (13, 1)), atol=1e-11)
    assert table.units["thrust3"] == "N"


def test_rows_that_no_thrusts_hold_have_no_columns_of_thrust() -> None:
    pulling = gg.lift([(0.5, 0.5), (0.8, 0.8)], "red")
    massless = gg.PAPER.replace(mass=None)
    weightless = gg.lift([(-0.4, 0.4), (-0.4, 0.9)], "red", vehicle=massless)
    for gait in (pulling, weightless):
        assert "thrust1" not in gait.parametrize().columns


@pytest.mark.parametrize("force", [True, False])
def test_a_file_of_somebody_else_stays_whole(
    force: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The disk is full when it is replaced, or it appears after the outputs were checked."""

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    path = tmp_path / "gait.csv"

    def appears(*_: object, **__: object) -> None:
        path.write_text("mine")

    if force:
        path.write_text("mine")
        monkeypatch.setattr(Path, "replace", full)
    else:
        monkeypatch.setattr(formats, "check_outputs", appears)
    with pytest.raises(gg.errors.FileProblem, match="No space left|exists"):
        TIMED.write(path, force=force)
    assert path.read_text() == "mine"
    assert list(tmp_path.iterdir()) == [path]


def test_a_table_is_shown_in_one_line_without_its_numbers() -> None:
    timed = gg.lift([(0.4, -0.4), (0.8, -0.4)], "red").parametrize(2.0, samples=4)
    shown = repr(table_of(timed))
    assert shown == "<Table: 5 rows, 20 columns, T = 2 s, smooth, vehicle 'paper'>"


@pytest.mark.parametrize(
    ("options", "missing"), [({"periods": 2}, "t"), ({"servos": "x_frame"}, "alpha3")]
)
def test_a_column_that_writing_needs_is_named(
    tmp_path: Path, options: dict[str, Any], missing: str
) -> None:
    table = Table(columns={"alpha1": [0.4], "alpha2": [-0.4], "color": ("red",)})
    with pytest.raises(gg.InputError, match=f"column '{missing}' is missing") as caught:
        write_tables(table, [tmp_path / "gait.csv"], **options)
    assert caught.value.field == missing
