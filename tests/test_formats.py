"""The formats of gait files: read back bit for bit with what made them; frames."""

from __future__ import annotations

import re
import subprocess
import sys
from dataclasses import replace
from io import BytesIO, StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import gaitgraph as gg
from gaitgraph.errors import FileWarning
from gaitgraph.gait.gait import lift
from gaitgraph.gait.table import (
    ACCELERATIONS,
    ANGLES,
    RATES,
    Table,
    completed_table,
)
from gaitgraph.io.columns import table_from_frame
from gaitgraph.io.exporting import export
from gaitgraph.io.formats import FORMATS, read_table, write_tables
from gaitgraph.io.servo_map import servo_map_named
from gaitgraph.planning.planner import plan
from gaitgraph.planning.request import read_request
from gaitgraph.timing.laws import LAWS
from gaitgraph.timing.timed_gait import table_of, timed_gait_of
from tests.published import GAITS

if TYPE_CHECKING:
    from gaitgraph.timing.laws import LawName
    from gaitgraph.timing.timed_gait import TimedGait

G1, _, G3, _ = GAITS
SUFFIXES = [".csv", ".json", ".npz", ".mat", ".parquet"]


def assert_same(found: Table, expected: Table) -> None:
    assert list(found.columns) == list(expected.columns)
    for name, values in expected.columns.items():
        if isinstance(values, np.ndarray):
            assert found[name].tobytes() == values.tobytes(), name
        else:
            assert tuple(found[name]) == tuple(values), name


# Files as good as the plan --------------------------------------------------------------------------------------------

TRIANGLE = [(0.4, -1.2), (0.4, -0.4), (1.2, -0.4)]


@pytest.mark.parametrize(
    ("suffix", "law"),
    [
        *((".csv", law) for law in LAWS if law != "smooth"),
        *((suffix, "smooth") for suffix in [*SUFFIXES, ".mcap"]),
    ],
)
def test_a_file_is_as_good_as_the_plan(
    suffix: str, law: LawName, tmp_path: Path
) -> None:
    """With six intervals no row is at the second or the third corner."""
    timed = gg.plan_loop(TRIANGLE, law=law, period=3.0).timed(samples=7)
    judged = gg.validate(timed)
    path, servos, again = (
        tmp_path / f"{name}{suffix}" for name in ("gait", "servos", "again")
    )
    timed.write(path)
    if suffix in SUFFIXES:
        export(path, [servos], servos=servo_map_named("x_frame"))
    export(path, [again])
    for one in (path, again, *([servos] if servos.exists() else ())):
        read = timed_gait_of(one)
        assert (read.law, read.period, read.samples) == (law, 3.0, 7)
        assert (
            read.gait.alpha.tolist()
            == gg.gait_of(read_table(one)).alpha.tolist()
            == timed.gait.alpha.tolist()
        )
        report = gg.validate(one)
        assert report.checks[1:] == judged.checks[1:]
        assert (report["closed"].message, report.rows) == (
            "the last row repeats the first, T = 3 s",
            8,
        )
        export(one, [tmp_path / "finer.npz"], samples=12, force=True)
        finer = timed.gait.parametrize(3.0, law=law, samples=12)
        assert read_table(tmp_path / "finer.npz").alpha.tolist() == finer.alpha.tolist()


def test_a_paced_file_states_the_corners(tmp_path: Path) -> None:
    """No row is at a corner, but all lie between the corners; an edited row makes the rows count."""
    limits, path = gg.Limits(acceleration=40.0), tmp_path / "paced.csv"
    gait = gg.plan_loop(TRIANGLE).gait
    paced: Any = gg.least_period(gait, limits, samples=7)
    write_tables(table_of(paced), [path])
    assert gg.gait_of(path).alpha.tolist() == gait.alpha.tolist()
    assert gg.least_period(path, limits).least == pytest.approx(paced.least, rel=1e-3)
    table = read_table(path)
    alpha1 = table["alpha1"].copy()
    alpha1[2] += 1e-4
    table = replace(table, columns={**table.columns, "alpha1": alpha1})
    with pytest.warns(FileWarning, match="row 3 has alpha1"):
        assert len(gg.gait_of(table).alpha) > 3
    corners = gait.alpha.copy()
    corners[1, 3] += 0.01  # off the sheet, where no row lies
    stated = table_of(paced)
    stated = replace(stated, about=stated.about | {"corners": corners.tolist()})
    with pytest.warns(FileWarning, match="gait must be on its sheet"):
        assert gg.validate(stated).flyable
    rounded: Any = gg.least_period(gait, limits, rounding=0.05, samples=7)
    about = table_of(rounded).about
    assert about["corners"] == gait.alpha.tolist()
    assert about["rounding"] == 0.05
    assert len(gg.gait_of(table_of(rounded)).alpha) > 4  # the rows, not the corners


@pytest.mark.parametrize("suffix", [".csv", ".npz"])
def test_rows_that_were_edited_win_over_stated_corners(
    suffix: str, tmp_path: Path
) -> None:
    path, timed = tmp_path / f"gait{suffix}", gg.plan_loop(TRIANGLE).timed(samples=7)
    table = table_of(timed)
    moved, slower = table["alpha1"].copy(), table["t"] * 1.001
    moved[3] += 2e-6
    for columns in (
        {"alpha1": moved},
        {"t": slower},
        {"color": (*["red"] * 7, "blue")},
    ):
        write_tables(
            replace(table, columns=table.columns | columns), [path], force=True
        )
        with pytest.warns(FileWarning, match=f"^gait file {str(path)!r}: .* not used"):
            assert len(gg.gait_of(path).alpha) > 3
        with pytest.warns(FileWarning):
            assert "is not used" in gg.validate(path).warnings[-1]
    write_tables(table.rows(0, 5), [path], force=True)  # the end is missing
    with pytest.warns(FileWarning, match="row 6 is missing"):
        assert timed_gait_of(path).period == pytest.approx(5 / 7)
    # Rounded rows are those of the gait; rates that a table states count where they are larger.
    rounded = {
        name: np.round(one, 5) if isinstance(one, np.ndarray) else one
        for name, one in table.columns.items()
    }
    write_tables(Table(columns=rounded, about=table.about), [tmp_path / "rounded.csv"])
    assert (
        gg.gait_of(read_table(tmp_path / "rounded.csv")).alpha.tolist()
        == timed.gait.alpha.tolist()
    )
    faster = Table(
        columns=table.columns | {"alpha1_rate": np.full(8, 99.0)}, about=table.about
    )
    with pytest.warns(FileWarning, match="row 1 has alpha1_rate = 99"):
        assert (gg.validate(faster)["tilt_rate"].value or 0) < 99.0
    wrong = replace(table, about=table.about | {"corners": [[1]]})
    with pytest.warns(FileWarning, match="the stated motion cannot be made"):
        gg.gait_of(wrong)


# Round trips ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_plan_is_read_back_bit_for_bit_with_what_made_it(
    suffix: str, planned: TimedGait, tmp_path: Path
) -> None:
    path = tmp_path / f"gait{suffix}"
    planned.write(path)
    found, expected = read_table(path), table_of(planned)
    assert_same(found, expected)
    assert found.about == expected.about
    request, sampling = read_request(path, {})
    plan(request).timed(**sampling).write(tmp_path / f"planned{suffix}")
    export(path, [tmp_path / f"again{suffix}"])
    for name in ("planned", "again"):
        assert (tmp_path / f"{name}{suffix}").read_bytes() == path.read_bytes()
    assert read_request(path, {"period": 3.0, "rate": 5.0})[1] == {"rate": 5.0}
    export(path, [tmp_path / f"finer{suffix}"], rate=10.0)
    assert read_request(tmp_path / f"finer{suffix}", {})[1] == {"samples": 20}


# Streaming ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", [".csv", ".json", ".npz", ".mat", ".parquet"])
@pytest.mark.parametrize("servos", [None, "x_frame"])
def test_a_gait_is_repeated_in_tables(
    suffix: str, servos: str | None, tmp_path: Path, run: Any
) -> None:
    if suffix == ".parquet":
        pytest.importorskip("pyarrow", reason="install gaitgraph[table]")
    timed = gg.plan_loop(TRIANGLE, period=2.0).timed(samples=8)
    one = table_of(timed)
    timed.write(tmp_path / "one.csv")
    path = tmp_path / f"three{suffix}"
    map_of = () if servos is None else ("--servos", servos)
    done = run("export", "one.csv", path, "gait.h", "--periods", 3, *map_of)
    assert done.out.startswith(
        f"wrote {path}: 25 rows\nwrote gait.h: 9 rows\nFlyable: "
    )
    three = read_table(path)
    np.testing.assert_allclose(three["t"], np.arange(25) * 0.25, rtol=0, atol=1e-12)
    for k in range(3):
        rows = three.rows(8 * k, 8 * k + 9)
        np.testing.assert_allclose(rows.alpha, one.alpha, rtol=0, atol=1e-12)
        if servos is None:
            assert tuple(rows["color"]) == tuple(one["color"])
            assert (rows["alpha1_rate"] == one["alpha1_rate"]).all()
    assert (three.about["period"], three.repeats) == (6.0, True)
    report = gg.validate(path)
    assert report.flyable
    assert not any("not used" in one for one in report.warnings)
    assert run("export", path, "again.csv", "--periods", 2).code == 0
    assert len(read_table(tmp_path / "again.csv")) == 49


def test_a_path_is_not_repeated_in_a_table(tmp_path: Path) -> None:
    path = gg.transition("hover", "gait4").table
    with pytest.raises(gg.InputError, match="periods must be 1 for a table that does"):
        write_tables(path, [tmp_path / "two.csv"], periods=2)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("stated", ["", "color,types,R", "off"])
def test_a_table_is_completed(closed: bool, stated: str) -> None:
    timed = lift(G3.angles, "red").parametrize(samples=40, law="constant-speed")
    made = {
        name: values
        for name, values in table_of(timed).columns.items()
        if "_" not in name
    }
    for name in ("color", "types", "R"):
        if name not in stated:
            made.pop(name)
    if stated == "off":
        made["alpha4"] = made["alpha4"] + np.where(np.arange(41) == 25, 0.1, 0.0)
    whole = completed_table(Table(columns=made).rows(0, 41 if closed else 40))
    assert len(whole) == 41
    assert ("color" in whole) == ("types" in whole) == (stated != "off")
    if stated != "off":
        expected = table_of(timed)
        assert list(whole.columns) == list(expected.columns)
        for name, values in expected.columns.items():
            if not isinstance(values, np.ndarray):
                assert tuple(whole[name]) == tuple(values)
            else:
                np.testing.assert_allclose(whole[name], values, atol=1e-12)


@pytest.mark.parametrize("repeats", [True, False])
def test_rows_with_rates_alone_are_joined_by_cubics(
    repeats: bool, tmp_path: Path
) -> None:
    """A circle with the rates of its closed form, and no accelerations."""
    speed, count = np.pi, 61 if repeats else 31
    t = np.linspace(0.0, 2.0, 61)[:count]
    swing = 0.35 * np.column_stack([np.cos(speed * t), np.sin(speed * t)] * 2)
    turned = 0.35 * np.column_stack([-np.sin(speed * t), np.cos(speed * t)] * 2)
    alpha = swing + np.array([-0.8, 0.8, -0.8, 0.8])
    columns = {"t": t} | dict(zip(ANGLES, alpha.T, strict=True))
    columns |= zip(RATES, speed * turned.T, strict=True)
    table = Table(columns=columns, about={} if repeats else {"repeats": False})
    written = export(table, [tmp_path / "a.csv", tmp_path / "a.h"]).table
    for name, rates in zip(RATES, speed * turned.T, strict=True):
        np.testing.assert_allclose(written[name], rates, atol=1e-15)
    assert not set(ACCELERATIONS) & set(written.columns)
    needed = gg.validate(table)["tilt_acceleration"].value
    assert needed == pytest.approx(0.35 * speed**2, rel=3e-3)
    assert "cubic" in (tmp_path / "a.h").read_text()
    fine = export(table, [], samples=600).table
    exact = -0.8 + 0.35 * np.cos(speed * fine["t"])
    np.testing.assert_allclose(fine["alpha1"], exact, atol=2e-7)
    gg.io.write_tables(table, [tmp_path / "b.yaml", tmp_path / "b.h"])
    goal = (tmp_path / "b.yaml").read_text()
    assert "velocities" in goal
    assert "accelerations: " not in goal
    if repeats:
        entry = gg.transition("hover", table)
        assert entry.timed is not None
        motion = entry.timed.at(entry.timed.period)
        np.testing.assert_allclose(motion.rates, speed * turned[0], atol=1e-9)
    # A rate that is wrong shows in the accelerations that it needs, as far as it fits.
    columns[RATES[0]] = columns[RATES[0]] + np.where(np.arange(count) == 10, 0.5, 0.0)
    wrong = gg.validate(replace(table, columns=columns))
    assert wrong["tilt_acceleration"].value == pytest.approx(0.5 / (2 / 30), rel=0.5)


ZEROS: dict[str, Any] = {f"alpha{k}": np.zeros(3) for k in range(1, 5)}

# Frames ---------------------------------------------------------------------------------------------------------------


def taken(frame: Any, expected: Table) -> None:
    assert_same(table_from_frame(frame), expected)
    assert gg.validate(frame).flyable
    assert gg.gait_of(frame).color == gg.retarget(frame).gait.color == "red"
    assert gg.robustness_of(frame).gait.tilt == gg.robustness_of(expected).gait.tilt


def test_frames_of_pandas(planned: TimedGait, tmp_path: Path) -> None:
    pd = pytest.importorskip("pandas", reason="install pandas")
    frame, expected = planned.to_pandas(), table_of(planned)
    taken(frame, expected)
    taken(frame.set_index("t"), expected)
    assert table_from_frame(frame).about == expected.about
    assert frame.attrs["gaitgraph"]["about"]["request"]
    planned.write(tmp_path / "read.csv")
    assert (
        table_from_frame(pd.read_csv(tmp_path / "read.csv")).about == expected.about
    )  # by its column made_by
    for wrong, message in (
        (
            frame.rename(columns={"alpha4": "alpha_4"}),
            "'alpha_4' .did you mean 'alpha4'",
        ),
        (
            pd.concat([frame, frame[["alpha1"]]], axis=1),
            "columns must have different names, got 'alpha1' 2 times",
        ),
        (
            frame.assign(alpha1=None),
            "row 1: alpha1 must be a finite number, .* got no value",
        ),
        (
            frame.assign(t=pd.date_range("2020", periods=13)),
            "t must be a column of .*, got .*datetime64",
        ),
    ):
        with pytest.raises(gg.InputError, match=message):
            gg.validate(wrong)
    frame.attrs["gaitgraph"] = {
        "format": "gaitgraph gait table",
        "about": {"a": object()},
    }
    with pytest.raises(
        gg.InputError, match="attrs must be as gaitgraph left them, got"
    ):
        table_from_frame(frame)


def test_frames_of_polars_and_pyarrow(planned: TimedGait) -> None:
    pl = pytest.importorskip("polars", reason="install polars")
    frame = pl.DataFrame(table_of(planned).columns)
    taken(frame, table_of(planned))
    taken(frame.to_arrow(), table_of(planned))
    with pytest.raises(
        gg.InputError, match="row 1: alpha2 must be a finite number, .* got nan"
    ):
        gg.validate(frame.with_columns(pl.lit(None).alias("alpha2")))
    for take in (gg.validate, table_from_frame):
        with pytest.raises(
            gg.InputError,
            match=r"must have its rows there, got a LazyFrame: collect\(\) it first",
        ):
            take(frame.lazy())


def test_mappings_are_frames() -> None:
    assert gg.validate(
        {"alpha1": ["3pi/8", 1.0], "alpha2": ["-3pi/8", -0.5], "color": "red"}
    ).flyable
    for wrong, message in (
        ({}, "column 'alpha1' is missing"),
        (
            {**ZEROS, "alpha1": [True] * 3},
            "row 1: alpha1 must be a finite number, .* got True",
        ),
        (
            {**ZEROS, "alpha1": np.ones(3, dtype=bool)},
            "alpha1 must be a column of numbers .*, got bool",
        ),
        (
            {**ZEROS, "alpha1": np.full(3, np.nan)},
            "row 1: alpha1 must be a finite number, .* got nan",
        ),
        (
            {**ZEROS, "alpha1": np.zeros((3, 3))},
            r"alpha1 must be a column .*, got float64 of shape \(3, 3\)",
        ),
        ({**ZEROS, "alpha1": 3}, "columns must have equally many rows, got 1 to 3"),
    ):
        with pytest.raises(gg.InputError, match=message):
            gg.validate(wrong)
    with pytest.raises(
        gg.InputError, match="frame must be a frame of pandas or polars, .*, got 5"
    ):
        table_from_frame(5)  # type: ignore[arg-type]


def test_what_is_missing_is_named(
    planned: TimedGait, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(
        gg.InputError, match="^to_pandas needs .* with: pip install pandas$"
    ):
        planned.to_pandas()
    monkeypatch.setattr("gaitgraph.io.formats.find_spec", lambda _: None)
    for path, missing in (
        (
            tmp_path / "a.parquet",
            r"Parquet needs pyarrow. Install it with: pip install 'gaitgraph\[table\]'",
        ),
        (
            tmp_path / "a.mcap",
            r"ROS 2 bag .MCAP. needs rosbags. Install it with: pip install 'gaitgraph\[ros\]'",
        ),
    ):
        for ask in (read_table, planned.write):
            with pytest.raises(gg.errors.MissingExtra, match=f"^{missing}"):
                ask(path)
        assert re.match(missing, FORMATS[path.suffix].why_not() or "")
    planned.write(tmp_path / "a.yaml")  # needs none


def test_nothing_that_is_not_needed_is_loaded(
    planned: TimedGait, tmp_path: Path
) -> None:
    planned.write(tmp_path / "a.npz")
    code = (
        "import sys, gaitgraph as gg\n"
        "gg.validate('a.npz')\n"
        "from gaitgraph.io.exporting import export\n"
        "export('a.npz', ['b.csv', 'b.json', 'b.h'])\n"
        "print(*{'pandas', 'polars', 'pyarrow', 'scipy.io', 'rosbags'} & {*sys.modules})"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.strip() == ""


def test_the_page_lists_every_format() -> None:
    page = (Path(__file__).parent.parent / "docs" / "guide" / "files.md").read_text()
    rows = [
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in page.splitlines()
        if line.startswith("| `.")
    ]
    found = {row[0].strip("`"): row[1:4] for row in rows if len(row) == 5}
    assert list(found) == list(FORMATS)
    for suffix, one in FORMATS.items():
        extra = f"`{one.extra}`" if one.extra else "–"
        assert found[suffix] == [one.name, extra, "yes" if one.reads else "no"]


@pytest.mark.parametrize(
    ("suffix", "ours"),
    [
        *((suffix, "formats.table_of_columns") for suffix in (".npz", ".mat")),
        *((suffix, "formats.table_of_columns") for suffix in (".parquet", ".mcap")),
        (".npz", "binary_tables._about_of_array"),
        (".parquet", "binary_tables._about_of_parquet"),
    ],
)
@pytest.mark.parametrize("kind", [KeyError, MemoryError, ValueError])
def test_an_error_of_our_own_code_is_not_called_a_broken_file(
    suffix: str,
    ours: str,
    kind: type[Exception],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    if suffix == ".mcap":
        pytest.importorskip("rosbags", reason="install the extra 'ros'")
    path = tmp_path / f"gait{suffix}"
    write_tables(table_of(gg.plan_loop(TRIANGLE).timed(samples=7)), [path])

    def wrong(*_: object, **__: object) -> None:
        raise kind("ours")

    monkeypatch.setattr(f"gaitgraph.io.{ours}", wrong)
    with pytest.raises(kind, match="ours") as caught:
        read_table(path)
    assert type(caught.value) is kind


@pytest.mark.parametrize(
    "suffix", [s for s, form in FORMATS.items() if not form.folder]
)
def test_a_stream_takes_the_bytes_of_a_file(suffix: str, tmp_path: Path) -> None:
    if missing := FORMATS[suffix].why_not():
        pytest.skip(missing)
    timed = gg.lift([(0.4, -0.4), (0.8, -0.4)], "red").parametrize(samples=4)
    path = tmp_path / f"stream{suffix}"
    timed.write(path)
    stream = BytesIO()
    timed.write(stream, format=suffix)
    assert stream.getvalue() == path.read_bytes()
    if FORMATS[suffix].reads:
        again = gg.read_table(BytesIO(path.read_bytes()), format=suffix.strip("."))
        assert np.array_equal(again.alpha, gg.read_table(path).alpha)
        assert again.motion is not None


@pytest.mark.parametrize("suffix", ["csv", "json"])
def test_a_stream_of_text_is_written_and_read(suffix: str) -> None:
    timed = gg.lift([(0.4, -0.4), (0.8, -0.4)], "red").parametrize(samples=4)
    stream = StringIO()
    timed.write(stream, format=suffix)
    stream.seek(0)
    assert np.array_equal(gg.read_table(stream, format=suffix).alpha, timed.alpha)


def test_errors_about_a_stream_name_no_path() -> None:
    with pytest.raises(
        gg.InputError, match=r"^gait file 'stream.csv': column 'alpha1'"
    ):
        gg.read_table(StringIO("t,b\n1,2\n"), format="csv")
    with pytest.raises(gg.InputError, match="format must be one of .csv, .json"):
        gg.read_table(StringIO(""), format="mcap")
    with pytest.raises(
        gg.InputError, match="format is for an open stream, got the path"
    ):
        gg.read_table("gait.csv", format="csv")
    with pytest.raises(gg.InputError, match="a stream needs its format"):
        gg.read_table(StringIO(""))
    with pytest.raises(gg.InputError, match="format must be one of .csv, .json, .npz"):
        gg.read_table(BytesIO(), format="h")
    timed = gg.lift([(0.4, -0.4), (0.8, -0.4)], "red").parametrize(samples=4)
    with pytest.raises(gg.InputError, match=".npz file needs a stream of bytes"):
        timed.write(StringIO(), format="npz")
