"""Gait tables as files: read back bit for bit, written whole or not at all, and what is refused."""

from __future__ import annotations

import csv
import json
import os
import re
import warnings
from dataclasses import replace
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gaitgraph as gg
from gaitgraph.gait import table as tables
from gaitgraph.gait.gait import lift
from gaitgraph.gait.given import gait_of
from gaitgraph.gait.table import Table, provenance_text
from gaitgraph.invertibility.geometry import Geometry
from gaitgraph.io import formats
from gaitgraph.io.columns import table_from_frame
from gaitgraph.io.exporting import export
from gaitgraph.io.formats import read_table, write_tables
from gaitgraph.io.servo_map import servo_map_named
from gaitgraph.planning.request import read_request
from gaitgraph.timing.timed_gait import table_of
from gaitgraph.vehicle import vehicle_named
from tests.mutated import refusal
from tests.published import GAITS
from tests.samples import PUBLISHED

G1, _, G3, _ = GAITS
LIGHT = gg.PAPER.replace(name="light", mass=0.3)
TIMED = lift(G3.angles, "red").parametrize(samples=4)


def exported(source: Path, output: Path, **choices: Any) -> Table:
    export(source, [output], anyway=True, **choices)
    return read_table(output)


def test_degrees_order_bom_crlf_and_strange_columns(tmp_path: Path) -> None:
    path = tmp_path / "theirs.csv"
    lines = [
        "note,alpha4_deg,alpha2_deg,alpha1_deg,alpha3_deg",
        "x,-67.5,-67.5,67.5,67.5",
        "",
    ]
    lines.append("y,-22.5,-22.5,67.5,67.5")
    path.write_text("\r\n".join(lines), encoding="utf-8-sig", newline="")
    gait = gait_of(read_table(path))
    np.testing.assert_allclose(
        gait.alpha, [(3 * pi / 8, -3 * pi / 8) * 2, (3 * pi / 8, -pi / 8) * 2]
    )
    assert gait.colors == ("red", "red")
    path.write_text("alpha1,alpha2,alpha3,alpha4_deg\n0.1235,0.5000,0,20.25\n")
    table = read_table(path)
    assert table.half_units("alpha1") == pytest.approx(5e-5)
    assert table.half_units("alpha2") == pytest.approx(0.05)
    assert table.half_units("alpha4") == pytest.approx(np.radians(0.005))


def test_export_keeps_rows_that_have_a_clock(tmp_path: Path) -> None:
    path = tmp_path / "timed.csv"
    path.write_text(
        "t,alpha1,alpha2,alpha3,alpha4\n0,0.4,-0.4,0.4,-0.4\n0.3,0.9,-0.4,0.9,-0.4\n1,0.4,-0.4,0.4,-0.4\n"
    )
    full = exported(path, tmp_path / "full.json")
    assert full["t"].tolist() == [0, 0.3, 1]
    assert full["types"] == ("(+,+)",) * 3
    np.testing.assert_allclose(
        full["R"], gg.invertibility.level_determinant(full.alpha, PUBLISHED)
    )
    retimed = exported(
        path, tmp_path / "retimed.csv", period=2.0, samples=10, law="equal-time"
    )
    assert (len(retimed), retimed["t"][-1], retimed["alpha1"].max()) == (11, 2.0, 0.9)
    path.write_text(
        path.read_text().replace("\n1,", "\n3,")
    )  # the period is that of the rows
    assert exported(path, tmp_path / "sampled.csv", rate=10)["t"][[1, -1]].tolist() == [
        0.1,
        3.0,
    ]


def test_a_saved_plan_is_a_gait_file(tmp_path: Path) -> None:
    path = tmp_path / "plan.json"
    plan = gg.plan_loop(G3.waypoints, period=0.5, law="constant-speed")
    path.write_text(json.dumps(plan.as_mapping()))
    plan.timed().write(tmp_path / "a.csv")
    table = exported(path, tmp_path / "b.csv")
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()
    assert table["t"][-1] == 0.5
    saved, written = gg.validate(path), gg.validate(tmp_path / "a.csv")
    assert saved["tilt_rate"].value == pytest.approx(written["tilt_rate"].value)
    assert [check.name for check in saved.checks] == [
        check.name for check in written.checks
    ]
    refused = tmp_path / "refused.json"
    refused.write_text(
        json.dumps(gg.plan_loop(G1.waypoints, coefficients="exact").as_mapping())
    )
    with pytest.raises(gg.InputError, match="a plan without a gait: no flyable loop"):
        read_table(refused)


@pytest.mark.parametrize("suffix", [".csv", ".json"])
def test_a_warning_arises_before_the_error_of_a_row(run: Any, suffix: str) -> None:
    columns: dict[str, Any] = {
        "t": [0, 1],
        **{f"alpha{k}": [0.1, "x"] for k in range(1, 5)},
        "note": "a",
    }
    if suffix == ".csv":
        rows: list[list[Any]] = [list(columns), [0, *[0.1] * 4, "a"], [1, *"xxxx", "a"]]
        text = "\n".join(",".join(map(str, row)) for row in rows)
    else:
        text = json.dumps(columns)
    Path(f"rows{suffix}").write_text(text)
    for command in ("validate", "retarget"):
        done = run(command, f"rows{suffix}")
        said = done.err.splitlines()
        assert (done.code, done.out, len(said)) == (2, "", 2)
        assert said[0].endswith("columns not used: 'note'")
        assert "row 2: alpha1 must be a finite number" in said[1]


@pytest.mark.parametrize(
    ("head", "unused"),
    [
        ("time,{}", ""),
        ("# t,{}", ""),
        ("# of Monday\n# t,{}", ""),
        ("Time,{}", "'Time' (did you mean 'time'?)"),
        ("t [s],{}", "'t [s]' (did you mean 't'?)"),
        ("Time (ms),{}", "'Time (ms)' (did you mean 'time_ms'?)"),
        ("t_s,{}", "'t_s' (did you mean 't'?)"),
        ("time_sec,{}", "'time_sec' (did you mean 'time'?)"),
        ("t_ns,{}", "'t_ns' (a time is t in s, t_ms or t_us)"),
        ("timestamp,{}", "'timestamp' (a time is t in s, t_ms or t_us)"),
        (
            "foo,{},alpha1_rates,bar",
            "'alpha1_rates' (did you mean 'alpha1_rate'?), 'foo', 'bar'",
        ),
    ],
)
def test_columns_are_read_as_what_they_are_or_listed(
    tmp_path: Path, head: str, unused: str, run: Any
) -> None:
    path, more = tmp_path / "a.csv", head.count(",") - 1
    rows = np.column_stack([TIMED.t, TIMED.alpha, np.zeros((5, more))])
    np.savetxt(
        path,
        rows,
        delimiter=",",
        header=head.format("alpha1,alpha2,alpha3,alpha4"),
        comments="",
    )
    done = run("export", path, tmp_path / "b.json", "--period", 1)
    told_once = (
        f"gaitgraph: warning: gait file {str(path)!r}: columns not used: {unused}\n"
        * bool(unused)
    )
    assert (done.code, done.err) == (0, told_once)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        assert ("t" in read_table(path)) is (not unused)
    assert [str(one.message) for one in told] == [done.err[20:-1]] * bool(unused)


@pytest.mark.parametrize(
    ("name", "in_a_second"),
    [("t_ms", 1e3), ("time_ms", 1e3), ("t_us", 1e6), ("time_us", 1e6)],
)
@pytest.mark.parametrize("suffix", [".csv", ".json", ".npz", ".mat", ".parquet"])
def test_times_in_other_units_are_read_in_every_format(
    tmp_path: Path, suffix: str, name: str, in_a_second: float
) -> None:
    if suffix == ".parquet":
        pytest.importorskip("pyarrow", reason="install gaitgraph[table]")
    columns = dict(zip(tables.ANGLES, TIMED.alpha.T, strict=True))
    columns[name] = TIMED.t * in_a_second
    path = tmp_path / f"theirs{suffix}"
    write_tables(tables.Table(columns=columns, about={"vehicle": "paper"}), [path])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        table = read_table(path)
        frame = table_from_frame(columns)
    for found in (table, frame):
        assert name not in found
        np.testing.assert_allclose(found["t"], TIMED.t, rtol=1e-15)


def test_an_index_in_milliseconds_is_read() -> None:
    pd = pytest.importorskip("pandas", reason="install pandas")
    frame = TIMED.to_pandas().set_index("t")
    frame.index = pd.Index(frame.index * 1e3, name="t_ms")
    np.testing.assert_allclose(table_from_frame(frame)["t"], TIMED.t, rtol=1e-15)


def test_a_servo_table_from_elsewhere_may_have_its_time_in_milliseconds(
    tmp_path: Path,
) -> None:
    path = tmp_path / "log.csv"
    path.write_text("time_ms,tilt1,tilt2,tilt3,tilt4\n0,0,0,0,0\n20,0.1,0,0,0\n")
    table = read_table(path, joints=servo_map_named("x_frame"))
    assert table["t"].tolist() == [0.0, 0.02]


@pytest.mark.parametrize(
    ("t", "warning"),
    [
        (
            [0, 500, 1000, 1500],
            "row 4 is 1500 s after row 1, .* A column of ms is t_ms",
        ),
        ([0, 10, 20, 30], ""),
        ([0, 0.1, 0.2, 1.4, 1.5, 1.6], "row 4 is 1.2 s after the row before, 12 times"),
        ([0, 0.1, 0.2, 1.1, 1.2, 1.3], ""),
        ([5, 5.1, 5.2], ""),
        ([1000], ""),
    ],
)
def test_times_that_are_probably_wrong_are_told(
    tmp_path: Path, run: Any, t: list[float], warning: str
) -> None:
    path = tmp_path / "theirs.csv"
    lines = [f"{time},{0.4 + k / 100},-0.4,red" for k, time in enumerate(t)]
    path.write_text("\n".join(["t,alpha1,alpha2,color", *lines]))
    done = run("validate", path, "--json")
    told = [line for line in done.err.splitlines() if "theirs.csv" in line]
    assert len(told) == bool(warning)
    assert re.search(warning, done.err)
    with warnings.catch_warnings(record=True) as raised:
        warnings.simplefilter("always")
        noted = read_table(path).notes
    assert [str(one.message).split(": ", 1)[1] for one in raised] == [*noted]
    assert len(noted) == bool(warning)


def test_a_long_period_that_the_file_states_is_no_surprise(tmp_path: Path) -> None:
    path = tmp_path / "slow.csv"
    lift(G3.angles, "red").parametrize(period=300.0).write(path)
    assert read_table(path).notes == ()


HEAD = "alpha1,alpha2,alpha3,alpha4\n"
BAD_CSV = [
    ("", "it is empty"),
    (
        "0,0.4,-0.4,0.4,-0.4\n0.5,0.8,-0.4,0.8,-0.4\n",
        "line 1 must be a header .* such as t,alpha1,.* got numbers",
    ),
    ("0 0 0 0\n0 0 0 0\n", "line 1 must be a header"),
    (
        "# t alpha1 alpha2\n",
        "separated by commas, with points in numbers, got semicolons, tabs or blanks",
    ),
    ("t,time," + HEAD + "0,0,0,0,0,0\n", "columns must have 't' or 'time', got both"),
    (
        "t_us,time_ms," + HEAD + "0,0,0,0,0,0\n",
        "columns must have 'time_ms' or 't_us', got both",
    ),
    (HEAD, "it must have at least one row"),
    ("alpha1,alpha2,alpha3\n0,0,0\n", "column 'alpha4' is missing"),
    (
        "alpha1,alpha2,alpha3,alpha_4\n0,0,0,0\n",
        "column 'alpha4' is missing.*'alpha_4' .did you mean 'alpha4'",
    ),
    (
        "α1,a2,Alpha 3,alpha4 [rad]\n0,0,0,0\n",
        ".*".join(f"did you mean 'alpha{k}'" for k in range(1, 5)),
    ),
    (
        "a1 (deg),alpha 2,alpha 3,alpha 4\n0,0,0,0\n",
        "'a1 .deg.' .did you mean 'alpha1_deg'",
    ),
    (HEAD + "20deg,0,0,0\n", "got '20deg'; in degrees the column is alpha1_deg"),
    (
        "alpha1,alpha2,alpha3,alpha4,alpha1\n0,0,0,0,0\n",
        "columns must have different names, got 'alpha1' 2 times",
    ),
    (
        "alpha1,alpha2,alpha3,alpha4,alpha1_deg\n0,0,0,0,0\n",
        "columns must have 'alpha1' or 'alpha1_deg', got both",
    ),
    (HEAD + "0,0,0\n", "line 2 must have 4 fields, as the header has, got 3"),
    (HEAD + "0,0,0,0\n0,0,x,0\n", "row 2: alpha3 must be a finite number, got 'x'"),
    (HEAD + "0,0,0,\n", "row 1: alpha4 must be a finite number, got ''"),
    (HEAD + "0,0,inf,0\n", "row 1: alpha3 must be a finite number, got 'inf'"),
    (HEAD + "0,1.6,0,0\n", "row 1: alpha2 must be within ±π/2 rad .*, got 1.6"),
    (
        "alpha1;alpha2;alpha3;alpha4\n0;0;0;0\n",
        "separated by commas, with points in numbers, got semicolons",
    ),
    (HEAD + "0,0,1_0,0\n", "row 1: alpha3 must be a finite number, got '1_0'"),
    (HEAD + "0,0,١,0\n", "row 1: alpha3 must be a finite number, got '١'"),
    (HEAD + "0,0,1e300,0\n", "row 1: alpha3 must be within ±1e\\+06, got 1e\\+300"),
    ("t," + HEAD + "1e300,0,0,0,0\n", "row 1: t must be within ±1e\\+09, got 1e\\+300"),
    (
        "t," + HEAD + "0,0,0,0,0\n5e-324,0,0,0,0\n",
        "row 2: t must be at least 1e-09 s after the row before, got 5e-324",
    ),
    (
        HEAD.strip() + ",alpha1_rate\n0,0,0,0,1e308\n",
        "row 1: alpha1_rate must be within ±1e\\+12, got 1e\\+308",
    ),
    ("x," * 30_000 + HEAD + "0," * 30_003 + "0\n", "got 'x' 30000 times"),
    ("alpha1,alpha2,color\n0,0,green\n", "row 1: color must be one of .*, got 'green'"),
    (
        HEAD.strip() + ",types\n" + '0,0,0,0,"(+,-)"\n',
        "row 1: types must be one of .*, got '\\(\\+,-\\)'",
    ),
    ('alpha1,alpha2,alpha3,alpha4\n"0,0,0,0\n', "comma-separated text"),
]
BAD_JSON = [
    ("", "it is not JSON"),
    ("{", "it is not JSON"),
    ("[" * 2_000_000, "nested too deeply"),
    (
        '{"about": ' + '{"a": ' * 300 + "1" + "}" * 300 + "}",
        "about must have at most 100 levels of nesting",
    ),
    ('{"alpha1": [' + "9" * 5000 + "]}", "it is not JSON"),
    (
        '{"alpha1": [1' + "0" * 400 + '], "alpha2": [0], "color": "red"}',
        "alpha1 must be a finite number, .* got 10000",
    ),
    ("3", "it must be an object of columns, .* got 3"),
    ("[]", "column 'alpha1' is missing"),
    ("[1]", "row 1 must be an object with the fields of row 1, got 1"),
    (
        '[{"alpha1": 0}, {"alpha2": 0}]',
        "row 2 must be an object with the fields of row 1",
    ),
    (
        '{"alpha1": [0], "alpha1": [1], "alpha2": [0], "color": "red"}',
        "must differ, got 'alpha1' twice",
    ),
    ('{"columns": 3}', "columns must be an object of lists, got 3"),
    (
        '{"alpha1": [0, 1], "alpha2": [0], "color": "red"}',
        "columns must have equally many rows, got 1 to 2",
    ),
    (
        '{"alpha1": [true], "alpha2": [0], "alpha3": [0], "alpha4": [0]}',
        "alpha1 must be a finite number, .* got True",
    ),
    (
        '{"alpha1": [NaN], "alpha2": [0], "alpha3": [0], "alpha4": [0]}',
        "NaN is no number of JSON",
    ),
    (
        '{"alpha1": [1e999], "alpha2": [0], "alpha3": [0], "alpha4": [0]}',
        "alpha1 must be a finite number, .* got inf",
    ),
    ('{"path": [[1, -1, 1, -1]], "colors": 5}', "colors must be a list of .*, got 5"),
    (
        '{"alpha1": [[0]], "alpha2": [0], "alpha3": [0], "alpha4": [0]}',
        "alpha1 must be a finite number, .* got \\[0\\]",
    ),
    ('{"path": [[0, 0]]}', "path must be a list of .*, got \\[\\[0, 0\\]\\]"),
]


@pytest.mark.parametrize(("suffix", "cases"), [(".csv", BAD_CSV), (".json", BAD_JSON)])
def test_malformed_files_are_refused_in_one_line(
    tmp_path: Path, suffix: str, cases: list[tuple[str, str]]
) -> None:
    path = tmp_path / f"bad{suffix}"
    for text, message in cases:
        path.write_text(text)
        assert re.search(message, refusal(path))


@pytest.mark.parametrize("suffix", [".csv", ".json", ".npz", ".mat", ".parquet"])
def test_files_that_cannot_be_read(tmp_path: Path, suffix: str) -> None:
    with pytest.raises(gg.errors.FileProblem, match="No such file"):
        read_table(tmp_path / f"none{suffix}")
    (tmp_path / f"folder{suffix}").mkdir()
    with pytest.raises(gg.errors.FileProblem, match="Is a directory"):
        read_table(tmp_path / f"folder{suffix}")
    with pytest.raises(
        gg.InputError, match="gait file must have one of the suffixes .csv, .json"
    ):
        read_table(tmp_path / "gait.xlsx")
    if suffix in (".csv", ".json"):
        (tmp_path / f"a{suffix}").write_bytes(b"\xff\xfe\0")
        assert (
            "must be UTF-8 text, got other bytes; in Excel save it as CSV UTF-8"
            in refusal(tmp_path / f"a{suffix}")
        )


def test_outputs_that_exist_stay_unless_forced_and_then_links_and_permissions_do(
    tmp_path: Path,
) -> None:
    new, old, link = (tmp_path / name for name in ("new.csv", "old.json", "link.json"))
    old.write_text("mine")
    old.chmod(0o600)
    link.symlink_to(old)
    with pytest.raises(
        gg.errors.OutputExists, match="link.json' exists; overwrite it with force=True"
    ):
        TIMED.write(new, link)
    assert old.read_text() == "mine"
    assert not new.exists()
    TIMED.write(new, link, force=True)
    assert link.is_symlink()
    assert len(read_table(old)) == 5
    assert old.stat().st_mode & 0o777 == 0o600
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "link.json",
        "new.csv",
        "old.json",
    ]


@pytest.mark.parametrize("force", [False, True])
def test_outputs_that_cannot_be(tmp_path: Path, force: bool) -> None:
    (tmp_path / "d.csv").mkdir()
    os.mkfifo(tmp_path / "pipe.csv")
    (tmp_path / "link.csv").symlink_to(tmp_path / "pipe.csv")
    (tmp_path / "loop.csv").symlink_to(tmp_path / "loop.csv")
    (tmp_path / "file").write_text("mine")
    there = sorted(tmp_path.iterdir())
    for names, message in (
        (["x.txt"], "must have one of the suffixes"),
        (["x.m"], r"MATLAB and Octave load \.mat"),
        (["no/x.csv"], "does not exist"),
        (["file/x.csv"], "is not a folder"),
        (["x.csv", "./x.csv"], "outputs must differ"),
        (
            ["good.csv", "/proc/bad.csv"],
            "'/proc/bad.csv' cannot be written",
        ),  # if one cannot be written none is
        (["d.csv"], "must be a regular file, got a folder"),
        (["pipe.csv"], "got a special file"),
        (["link.csv"], "got a special file"),
        (["x" * 300 + ".csv"], "File name too long"),
        (["a\0.csv"], "cannot be written"),
        *([(["loop.csv"], "exists")] if not force else []),
    ):
        with pytest.raises(gg.GaitgraphError, match=message):
            TIMED.write(*(os.path.join(tmp_path, name) for name in names), force=force)  # noqa: PTH118
        assert sorted(tmp_path.iterdir()) == there
    TIMED.write(tmp_path / ("x" * 245 + ".csv"))
    with pytest.raises(gg.InputError, match=r"\.h, got .*; films are written by anim"):
        gg.export(TIMED, [tmp_path / "x.gif"])


@pytest.mark.parametrize("case", ["full disk", "appears"])
def test_a_file_of_somebody_else_stays_whole(
    case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(*_: object) -> None:
        raise OSError(28, "No space left on device")

    path = tmp_path / "gait.csv"
    if case == "full disk":
        path.write_text("mine")
        monkeypatch.setattr(Path, "replace", refused)
    else:
        monkeypatch.setattr(
            formats, "check_outputs", lambda *_, **__: path.write_text("mine")
        )
    message = "No space left on device" if case == "full disk" else "exists"
    with pytest.raises(gg.errors.FileProblem, match=message):
        TIMED.write(path, force=case == "full disk")
    assert path.read_text() == "mine"
    assert len(list(tmp_path.glob("*.csv"))) + len(list(tmp_path.glob(".*"))) == 1


def test_about_that_is_wrong_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "gait.json"
    TIMED.write(path)
    content = json.loads(path.read_text())
    for key, value, message in (
        ("vehicle", {"mass": -1}, "mass must be .*, got -1"),
        ("vehicle", 5, "vehicle must be a preset .*, got 5"),
        ("coefficients", "x", "coefficients must be .*, got 'x'"),
        (
            "crossing_tolerance",
            "x",
            "crossing_tolerance must be a number ≥ 0 .rad., got 'x'",
        ),
    ):
        path.write_text(
            json.dumps({**content, "about": {**content["about"], key: value}})
        )
        with pytest.raises(gg.InputError, match=message):
            export(path, [tmp_path / "out.csv"], samples=4)
    assert not (tmp_path / "out.csv").exists()
    for key, wrong in (("period", "x"), ("law", 3), ("samples", "4")):
        stated = {**content["about"], key: wrong}
        path.write_text(json.dumps({**content, "about": stated}))
        with pytest.warns(gg.errors.FileWarning, match=f"{key} must be .*not used"):
            assert read_table(path).motion is None
    path.write_text(json.dumps({**content, "about": {"vehicle": "beetle_omni"}}))
    assert gait_of(read_table(path)).vehicle.name == "beetle_omni"


@pytest.mark.parametrize("end", [".csv", ".json", ".npz", ".mat"])
@pytest.mark.parametrize("vehicle", ["own.toml", {"preset": "own.toml"}, "own"])
def test_a_gait_file_names_no_other_file(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    vehicle: Any,
    end: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("own.toml").write_text('secret = "never shown"')
    path = f"gait{end}"
    TIMED.write(path)
    table = read_table(path)
    for about, read in (
        ({"vehicle": vehicle}, gg.validate),
        ({"request": {"vehicle": vehicle}}, lambda path: read_request(path, {})),
    ):
        stated = replace(table, about={**table.about, **about})
        write_tables(stated, [path], force=True)
        with pytest.raises(gg.InputError, match="must be a preset .*, got") as refused:
            read(path)
        assert str(refused.value).count(".toml") == str(vehicle).count(".toml")
        assert "secret" not in str(refused.value)


def test_a_request_names_a_vehicle_by_its_file(tmp_path: Path) -> None:
    (tmp_path / "own.toml").write_text('preset = "beetle_omni"')
    request = tmp_path / "request.toml"
    request.write_text('waypoints = [[0.8, -0.8]]\nvehicle = "own.toml"')
    assert read_request(request, {})[0].vehicle.name == "beetle_omni"
    plan = gg.plan_loop([(0.8, -0.8), (0.4, -0.4)], sign="negative")
    mapping = plan.as_mapping()
    mapping["request"]["vehicle"] = "own.toml"
    saved = tmp_path / "plan.json"
    saved.write_text(json.dumps(mapping))
    with pytest.raises(gg.InputError, match="must be a preset .*, got 'own.toml'"):
        read_request(saved, {})
    with pytest.raises(gg.InputError, match="must be a preset .*, got 'own.toml'"):
        gg.validate(saved)


def test_another_vehicle_or_other_coefficients_change_types_and_r(
    tmp_path: Path,
) -> None:
    gg.plan_loop(G3.waypoints).timed(samples=4).write(tmp_path / "a.json")
    for options in (
        {"vehicle": gg.vehicle_named("beetle_omni")},
        {"coefficients": "exact"},
    ):
        table = exported(
            tmp_path / "a.json", tmp_path / "b.json", force=True, **options
        )
        vehicle: Any = options.get("vehicle", gg.PAPER)
        numbers = gg.invertibility.coefficients_of(vehicle, "exact")
        np.testing.assert_allclose(
            table["R"], gg.invertibility.level_determinant(table.alpha, numbers)
        )
        assert table.about["coefficients"] == "exact"


def test_stated_columns_that_disagree_with_the_angles_are_computed_anew(
    tmp_path: Path,
) -> None:
    path = tmp_path / "wrong.csv"
    head = "t,alpha1,alpha2,alpha3,alpha4,R,types,alpha1_rate"
    path.write_text(
        head + '\n0,0.4,-0.4,0.4,-0.4,7,"(-,-)",9\n1,0.8,-0.4,0.8,-0.4,7,"(-,-)",9\n'
    )
    table = exported(path, tmp_path / "out.csv")
    np.testing.assert_allclose(
        table["R"], gg.invertibility.level_determinant(table.alpha, PUBLISHED)
    )
    assert table["types"] == ("(+,+)",) * 3
    assert list(table.columns) == list(tables.ORDER)
    np.testing.assert_allclose(table["alpha1_rate"], [0.4, -0.4, 0.4])
    off = tmp_path / "off.csv"
    off.write_text(
        't,alpha1,alpha2,alpha3,alpha4,types\n0,0.4,-0.4,0.1,-0.4,"(-,-)"\n1,0.8,-0.4,0.8,-0.1,"(-,-)"\n'
    )
    assert "types" not in exported(off, tmp_path / "off_out.csv")


def test_a_gait_made_from_another_tells_no_request(tmp_path: Path) -> None:
    gait = gg.plan_loop(G3.waypoints).gait
    for k, other in enumerate((gait.reversed(), gait.started_at(1), gait.biased(0.9))):
        other.parametrize(samples=4).write(tmp_path / f"{k}.csv")
        with pytest.raises(gg.InputError, match=rf"{k}\.csv.*must hold a request"):
            read_request(tmp_path / f"{k}.csv", {})
    made: dict[str, Any] = {
        "optimize": gg.optimal_gait([(0.9, -0.9)], objective="hover_reserve").table(
            samples=4
        ),
        "retarget": gg.retarget(gait.alpha).table,
    }
    for maker, table in made.items():
        write_tables(table, [tmp_path / f"{maker}.csv"])
        with pytest.raises(
            gg.InputError, match=rf"got none \(it was made by {maker}\)"
        ):
            read_request(tmp_path / f"{maker}.csv", {})
    assert made["optimize"].about["waypoints"] == [[0.9, -0.9]]
    gait.parametrize(samples=4).write(tmp_path / "gait.csv")
    assert (
        gait_of(tmp_path / "gait.csv").request["waypoints"] == gait.request["waypoints"]
    )
    assert not gait_of(
        tmp_path / "gait.csv", vehicle=gg.vehicle_named("beetle_omni")
    ).request
    export(
        tmp_path / "gait.csv",
        [tmp_path / "other.csv"],
        vehicle=gg.vehicle_named("beetle_omni"),
        anyway=True,
    )
    with pytest.raises(gg.InputError, match="must hold a request"):
        read_request(tmp_path / "other.csv", {})


def test_what_made_a_csv_file_is_one_text_in_its_first_row(tmp_path: Path) -> None:
    path, table = (
        tmp_path / "a.csv",
        table_of(gg.plan_loop(G3.waypoints, vehicle=LIGHT).timed(samples=40)),
    )
    write_tables(table, [path])
    with path.open(newline="") as stream:
        told = [row["made_by"] for row in csv.DictReader(stream)]
    assert told == [provenance_text(table), *[""] * 40]
    assert read_table(path).about == table.about
    # Somebody else's column of that name is passed over, and a broken one of ours is refused.
    for content, message in (
        ("me", ""),
        (
            '"{""format"": ""gaitgraph gait table"""',
            "must be the JSON that gaitgraph writes",
        ),
    ):
        path.write_text(
            f"alpha1,alpha2,alpha3,alpha4,made_by\n0.4,-0.4,0.4,-0.4,{content}\n"
        )
        if message:
            assert message in refusal(path)
        else:
            assert read_table(path).about == {}


class TestLines:
    """Ends of lines, and their numbers in messages."""

    @pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
    def test_the_same_table_comes_back(self, tmp_path: Path, end: str) -> None:
        path = tmp_path / "gait.csv"
        lift(G3.angles, "red").parametrize(samples=30).write(path)
        whole = read_table(path)
        changed = tmp_path / "changed.csv"
        changed.write_bytes(
            b"\xef\xbb\xbf" + path.read_text().replace("\n", end).encode()
        )
        again = read_table(changed)
        for name, values in whole.columns.items():
            assert np.array_equal(values, again[name]), name
        assert len(again) == 31

    def test_rows_and_lines_are_counted_through(self, tmp_path: Path) -> None:
        path = tmp_path / "gait.csv"
        lines = [
            "",
            "t,alpha1,alpha2,alpha3,alpha4",
            "",
            *(f"{t},0.4,-0.4,0.4,-0.4" for t in range(40)),
        ]
        for text, message in (
            ("20,0.4,-0.4,x,-0.4", r"row 21: alpha3 must be a finite number, got 'x'"),
            (
                "20,0.4,-0.4,0.4",
                r"line 24 must have 5 fields, as the header has, got 4",
            ),
            (
                "20,0.4,1.6,0.4,0.1",
                r"row 21: alpha2 must be within ±π/2 rad .*, got 1.6",
            ),
            ('20,0.4,"0.4,0.4,0.1', r"line .* must be comma-separated text"),
            ('20,"0.4"1,0.4,0.4,0.1', r"line 24 must be comma-separated text"),
            (
                "19,0.4,-0.4,0.4,-0.4",
                r"row 21: t must be at least .* after the row before, got 19.0",
            ),
        ):
            path.write_text("\n".join([*lines[:23], text, *lines[24:]]))
            with pytest.raises(gg.InputError, match=message):
                gg.validate(path)


@pytest.mark.parametrize("row", [0, 1500, 2999])
def test_an_open_quotation_mark_swallows_nothing(tmp_path: Path, row: int) -> None:
    path = tmp_path / "gait.csv"
    lines = ["note,alpha1,alpha2,alpha3,alpha4"] + ["x,0.4,-0.4,0.4,-0.4"] * 3000
    lines[row + 1] = '"x' + lines[row + 1][1:]
    path.write_text("\n".join(lines) + "\n")
    with pytest.raises(gg.InputError, match="must be comma-separated text"):
        gg.validate(path)
    lines[row + 1] = '"x\n' + lines[row + 1][2:].replace(",", '",', 1)
    path.write_text("\n".join(lines) + "\n")
    assert gg.validate(path).rows == 3000  # a line break in quotation marks is no row


def test_a_table_is_shown_in_one_line_without_its_numbers() -> None:
    timed = gg.lift([(0.4, -0.4), (0.8, -0.4)], "red").parametrize(2.0, samples=4)
    shown = repr(gg.timing.table_of(timed))
    assert shown == "<Table: 5 rows, 20 columns, T = 2 s, smooth, vehicle 'paper'>"


def test_texts_of_a_csv_are_read_whole(tmp_path: Path) -> None:
    path = tmp_path / "gait.csv"
    head = "alpha1,alpha2,alpha3,alpha4,color,types\n"
    row = '0.4,-0.4,0.4,-0.4,{},{}\n0.8,-0.4,0.8,-0.4,red,"(+,+)"\n'
    path.write_text(head + row.format("red", '"( + , + )"'))
    assert gg.read_table(path)["types"][0] == "( + , + )"
    assert gg.validate(path).valid
    path.write_text(head + row.format("red     blue", '"(+,+)"'))
    with pytest.raises(gg.InputError, match="red     blue"):
        gg.read_table(path)


@pytest.mark.parametrize("preset", ["paper", "beetle_omni", "beetle_art"])
def test_thrusts_of_each_row_carry_the_weight_without_moment(preset: Any) -> None:
    vehicle = vehicle_named(preset)
    assert vehicle.mass is not None
    gait = gg.lift([(-0.4, 0.4), (-0.4, 0.9), (-0.9, 0.9)], "red", vehicle=vehicle)
    table = gg.timing.table_of(gait.parametrize(samples=12))
    thrusts = np.column_stack([table[f"thrust{k}"] for k in (1, 2, 3, 4)])
    geometry = Geometry.of_vehicle(vehicle)
    wrench = geometry.level_matrix(table.alpha) @ thrusts[..., None]
    weight = np.full(len(table), vehicle.mass * vehicle.gravity)
    assert wrench[:, :3, 0] == pytest.approx(0.0, abs=1e-12)
    assert wrench[:, 3, 0] == pytest.approx(weight)
    assert table.units["thrust3"] == "N"


def test_rows_that_no_thrusts_hold_have_no_columns_of_thrust() -> None:
    pulling = gg.lift([(0.5, 0.5), (0.8, 0.8)], "red")
    assert "thrust1" not in pulling.parametrize().columns
    massless = gg.PAPER.replace(mass=None)
    gait = gg.lift([(-0.4, 0.4), (-0.4, 0.9)], "red", vehicle=massless)
    assert "thrust1" not in gait.parametrize().columns


def test_edited_thrusts_are_computed_again_when_a_table_is_exported(
    tmp_path: Path,
) -> None:
    table = gg.timing.table_of("gait4")
    edited = dict(table.columns) | {"thrust2": np.full(len(table), 9.0)}
    path = tmp_path / "edited.csv"
    gg.io.write_tables(Table(columns=edited, about=table.about), [path])
    again = gg.export(path, tmp_path / "again.csv").table
    assert again["thrust2"] == pytest.approx(table["thrust2"])
