"""Motions that are run once, from their first row to their last: nothing leads them back to the start."""

from __future__ import annotations

import json
import shutil
import subprocess
import warnings
from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import gaitgraph as gg
from gaitgraph.flight.basins import basins_of
from gaitgraph.flight.course import from_hover
from gaitgraph.gait.table import RATES
from gaitgraph.io.exporting import export
from gaitgraph.io.formats import FORMATS
from gaitgraph.timing.timed_gait import table_of, timed_gait_of

if TYPE_CHECKING:
    from pathlib import Path

LOOP = [(-0.4, 0.4), (-0.4, 1.2), (-1.2, 1.2), (-1.2, 0.4)]
GAIT = gg.lift(LOOP, "red")
ENTRY = gg.transition("hover", GAIT, duration=1.0)
END = ENTRY.path[-1]
READ = [suffix for suffix, form in FORMATS.items() if form.reads]


# What a gait at rest in its corners adds does not depend on the format.
PACED = [(None, ".csv"), *(("2deg", suffix) for suffix in READ)]


@cache
def paced_gait(rounding: str | None, rate: float = 6.0) -> gg.timing.LimitedGait:
    limits = gg.timing.Limits(rate=rate, acceleration=150)
    timed = gg.least_period(GAIT, limits, rounding=rounding).timed
    assert timed is not None
    return timed


@cache
def pacing_of(rounding: str | None) -> gg.timing.LeastPeriod:
    limits = gg.timing.Limits(rate=6, acceleration=150)
    return gg.least_period(GAIT, limits, rounding=rounding, samples=60)


@pytest.fixture
def entry(tmp_path: Path) -> Path:
    path = tmp_path / "entry.csv"
    ENTRY.write(path)
    return path


def steps(table: gg.Table) -> float:
    """Return the largest step between rows [rad]."""
    return float(np.abs(np.diff(table.alpha, axis=0)).max())


@pytest.mark.parametrize(
    ("suffix", "timing"),
    [(".csv", {}), (".csv", {"rate": 60.0}), *((one, {"samples": 37}) for one in READ)],
)
def test_an_entry_ends_where_the_gait_begins_in_every_format(
    suffix: str, timing: dict[str, Any], entry: Path
) -> None:
    form = FORMATS[suffix]
    if form.library:
        pytest.importorskip(form.library, reason=f"install the extra {form.extra!r}")
    written = entry.with_name(f"e{suffix}")
    export(entry, written, **timing)
    table = gg.read_table(written)
    assert not table.repeats
    assert len(table) == timing.get("samples", timing.get("rate", 100)) + 1
    np.testing.assert_allclose(table["t"][[0, -1]], [0, 1], atol=1e-9)
    np.testing.assert_allclose(table.alpha[0], 0, atol=1e-12)
    np.testing.assert_allclose(table.alpha[-1], END, atol=1e-12)
    assert steps(table) < 0.05
    report = gg.validate(written)
    assert report.flyable
    assert report["tilt_rate"].value == pytest.approx(0.75, rel=2e-3)
    assert report["closed"].message.startswith("run once")
    again = entry.with_name("again.csv")
    export(written, again)
    assert np.abs(gg.read_table(again).alpha - table.alpha).max() < 1e-9


def test_a_header_stays_at_the_ends(entry: Path) -> None:
    if shutil.which("cc") is None:
        pytest.skip("install a C compiler")
    export(entry, [entry.with_name("entry.h"), entry.with_name("entry.yaml")])
    text = entry.with_name("entry.h").read_text()
    assert "repeats for ever" not in text
    program = entry.with_name("main.c")
    program.write_text(
        '#include <stdio.h>\n#include "entry.h"\nint main(void) { float a[4]; for (int k = -2; k < 16; ++k) '
        '{ entry_at(0.1f * (float)k, a); printf("%.7f %.7f\\n", a[0], a[1]); } return 0; }\n'
    )
    subprocess.run(["cc", "-o", program.with_suffix(""), program, "-lm"], check=True)
    done = subprocess.run(
        [program.with_suffix("")], capture_output=True, text=True, check=True
    )
    found = np.array([line.split() for line in done.stdout.splitlines()], dtype=float)
    times = np.clip(0.1 * np.arange(-2, 16), 0.0, 1.0)
    tau = times[:, None]
    expected = (10 * tau**3 - 15 * tau**4 + 6 * tau**5) * END[:2]
    np.testing.assert_allclose(found, expected, atol=1e-5)


def test_a_timed_path_stays_at_its_ends_and_states_what_it_does() -> None:
    timed = ENTRY.timed
    assert (timed.repeats, timed.period, timed.samples) == (False, 1.0, 100)
    angles, rates, accelerations = timed.at([-1.0, 0.5, 1.0, 7.0])
    np.testing.assert_allclose(angles, [0 * END, END / 2, END, END], atol=1e-12)
    np.testing.assert_allclose(np.abs(rates).max(axis=1), [0, 0.75, 0, 0], atol=1e-9)
    assert (accelerations[[0, 3]] == 0).all()
    assert timed.peak_rates.max() == pytest.approx(15 / 8 * 0.4)
    table = table_of(timed)
    assert not table.repeats
    np.testing.assert_array_equal(table.about["corners"], ENTRY.path)
    again: Any = timed_gait_of(table)
    assert (type(again), again.law) == (type(timed), "smooth")
    np.testing.assert_array_equal(again.at(timed.t).alpha, timed.alpha)


def test_a_path_is_judged_without_the_way_back(entry: Path) -> None:
    table = gg.read_table(entry)
    alone, closed = (
        gg.validate(table),
        gg.validate(gg.Table(columns=table.columns, about={})),
    )
    assert alone.flyable
    for report in (alone, gg.validate(ENTRY), ENTRY.timed.check()):
        assert (report.repeats, report.as_mapping()["repeats"]) == (False, False)
    assert closed.as_mapping()["repeats"] is True
    assert alone["tilt_rate"].value == pytest.approx(0.75, rel=1e-3)
    assert closed["tilt_rate"].value == pytest.approx(40.0, rel=0.1)  # in one step
    assert any("a path that is run once" in note for note in closed.notes)
    assert alone.listing is None  # colourings are of loops
    whole = gg.robustness_of(GAIT)
    assert gg.robustness_of(table).as_mapping()["tilt_margin_deg"] <= 90.0
    assert whole.as_mapping()["tilt_margin_deg"] is not None


def test_rows_of_ones_own_are_a_path_if_that_is_said() -> None:
    t = np.linspace(0, 1, 40)
    rows = np.column_stack([-0.4 * t, 0.4 * t**2, -0.4 * t, 0.4 * t**2])
    columns = {"t": t} | {f"alpha{k + 1}": rows[:, k] for k in range(4)}
    path = gg.Table(columns=columns).once()
    assert not path.repeats
    assert gg.validate(path)["tilt_rate"].value == pytest.approx(0.79, rel=0.02)
    timed: Any = timed_gait_of(path)
    np.testing.assert_allclose(timed.at(t).alpha, rows, atol=1e-12)
    np.testing.assert_allclose(timed.at(5.0).alpha, rows[-1], atol=1e-12)
    assert timed.check().flyable


@pytest.mark.parametrize("law", ["smooth", "constant-speed"])
@pytest.mark.parametrize("duration", [None, 2.0])
def test_a_path_gets_another_timing(
    law: Any, duration: float | None, entry: Path
) -> None:
    export(entry, entry.with_name("e.csv"), law=law, period=duration, samples=50)
    table = gg.read_table(entry.with_name("e.csv"))
    assert table["t"][-1] == pytest.approx(duration or 1.0)
    np.testing.assert_allclose(table.alpha[-1], END, atol=1e-12)
    ends = np.abs([table[name][[0, -1]] for name in RATES])
    still = law == "smooth"
    assert bool((ends < 1e-9).all()) is still
    assert steps(table) < 0.06


@pytest.mark.parametrize(
    "ask",
    [
        gg.gait_of,
        gg.retarget,
        gg.least_period,
        lambda path: gg.transition(path, "hover"),
        lambda path: gg.transition("hover", path),
        gg.certify,
        basins_of,
        from_hover,
    ],
)
def test_what_is_of_gaits_alone_refuses_a_path_in_one_line(
    ask: Any, entry: Path
) -> None:
    for path in (entry, gg.read_table(entry), ENTRY):
        with pytest.raises(
            gg.errors.GaitgraphError, match="path that is run once"
        ) as caught:
            ask(path)
        assert "\n" not in str(caught.value)


def test_a_flight_of_a_path_holds_its_end(entry: Path) -> None:
    mujoco = pytest.importorskip("mujoco", reason="install the extra 'sim'")
    assert mujoco
    settings = gg.flight.FlightSettings(duration=2.5)
    flight = gg.fly(entry, attitude=(0.0, 0.0), settings=settings)
    assert flight.settled
    np.testing.assert_allclose(flight.course.at(np.array([1.0, 2.4])).alpha, [END, END])


def test_a_bag_of_several_periods_is_of_a_gait(entry: Path) -> None:
    pytest.importorskip("rosbags", reason="install the extra 'ros'")
    with pytest.raises(gg.InputError, match="periods must be 1"):
        export(entry, entry.with_name("e.mcap"), periods=2)


def test_once_says_it_of_a_table_of_ones_own(run: Any, tmp_path: Path) -> None:
    t = np.linspace(0, 1, 21)
    rows = np.column_stack([t, -0.4 * t, 0.4 * t, -0.4 * t, 0.4 * t])
    head = "t,alpha1,alpha2,alpha3,alpha4"
    np.savetxt(tmp_path / "own.csv", rows, delimiter=",", header=head, comments="")
    closed, once = run("validate", "own.csv"), run("validate", "own.csv", "--once")
    assert (
        "not closed: the segment of 0.4 rad from row 21 back to row 1 is judged too"
        in closed.out.splitlines()[1]
    )
    assert "run once, from row 1 to row 21" in once.out.splitlines()[1]
    assert run("export", "own.csv", "e.csv", "e.h", "--once", "--rate", 50).code == 0
    assert not gg.read_table(tmp_path / "e.csv").repeats
    assert len(gg.read_table(tmp_path / "e.csv")) == 51
    assert run("validate", "e.csv").out.splitlines()[1] == once.out.splitlines()[
        1
    ].replace("row 21", "row 51")
    assert run("robustness", "own.csv", "--once").code == 0
    refused = run("pace", "e.csv", "--max-rate", 6)
    assert refused.code == 2
    assert "path that is run once" in refused.err


@pytest.mark.parametrize(("rounding", "suffix"), PACED)
def test_another_sampling_of_a_paced_table_keeps_its_limits(
    rounding: str | None, suffix: str, tmp_path: Path
) -> None:
    form = FORMATS[suffix]
    if form.library:
        pytest.importorskip(form.library, reason=f"install the extra {form.extra!r}")
    paced = paced_gait(rounding)
    paced.write(tmp_path / "fast.csv")
    table = gg.read_table(tmp_path / "fast.csv")
    assert table.limits == {"rate": (6.0,) * 4, "acceleration": (150.0,) * 4}
    fast = gg.validate(table)
    assert fast.flyable
    assert fast["tilt_rate"].limit == 6
    timings: list[dict[str, Any]] = [{"period": 2 * paced.period}]
    if suffix == ".csv":  # what is sampled does not depend on the format
        timings += [{}, {"samples": 40}, {"rate": 50.0}]
    for timing in timings:
        export(tmp_path / "fast.csv", tmp_path / f"e{suffix}", force=True, **timing)
        written = gg.read_table(tmp_path / f"e{suffix}")
        assert written.limits == table.limits
        report = gg.validate(written)
        assert report.flyable, (timing, report.reason)
        slower = 2 if "period" in timing else 1
        assert written["t"][-1] == pytest.approx(slower * paced.period, abs=2e-9)
        peak: Any = report["tilt_rate"].value
        assert 5.5 < peak * slower <= 6.0 * (1 + 1e-6)


@pytest.mark.parametrize(("rounding", "suffix"), PACED)
def test_pace_starts_again_from_the_gait_that_a_table_states(
    rounding: str | None, suffix: str, tmp_path: Path
) -> None:
    form = FORMATS[suffix]
    if form.library:
        pytest.importorskip(form.library, reason=f"install the extra {form.extra!r}")
    pacing = pacing_of(rounding)
    assert pacing.timed is not None
    pacing.timed.write(tmp_path / f"fast{suffix}")
    export(tmp_path / f"fast{suffix}", tmp_path / f"other{suffix}", rate=50.0)
    sources: list[Any] = [tmp_path / f"fast{suffix}", tmp_path / f"other{suffix}"]
    if suffix == ".csv":  # once is enough for what is not read
        sources.append(pacing.timed)
    for source in sources:
        again = gg.least_period(source)
        assert again.period == pytest.approx(pacing.period, rel=1e-9)
        assert again.lower_bound == pytest.approx(pacing.lower_bound)
        slower = gg.timing.paced(source, gg.timing.Limits(rate=3, acceleration=150))
        assert slower.least is not None
        expected = paced_gait(rounding, rate=3.0)
        assert slower.least == pytest.approx(expected.period, rel=1e-9)


def test_pace_keeps_the_limits_and_the_rounding_of_a_table(
    run: Any, tmp_path: Path
) -> None:
    gg.io.write_tables(table_of(GAIT), [tmp_path / "g.csv"])
    limits = ("--max-rate", 6, "--max-acceleration", 150)
    first = run("pace", "g.csv", *limits, "--rounding", "2deg", "--output", "r.csv")
    again = run("pace", "r.csv")
    assert (again.code, again.out) == (
        0,
        first.out.removesuffix("wrote r.csv: 101 rows\n"),
    )
    sharper = run("pace", "r.csv", "--rounding", "1deg", "--json").json
    assert sharper["rounding"]["tolerance"] == pytest.approx(np.radians(1))
    assert sharper["limits"] == {"rate": 6.0, "acceleration": 150.0}
    # Rows that were moved do not state the gait any more.
    table = gg.read_table(tmp_path / "r.csv")
    moved = table.columns | {"alpha1": table["alpha1"] + 1e-3 * (table["t"] > 0.2)}
    gg.io.write_tables(gg.Table(columns=moved, about=table.about), [tmp_path / "m.csv"])
    assert run("pace", "m.csv", *limits, "--json").json["rounding"] is None


@pytest.mark.parametrize("samples", [7, 1000])
def test_more_rows_of_a_rounded_table_lie_on_its_law(
    samples: int, tmp_path: Path
) -> None:
    limits = gg.timing.Limits(rate=6, acceleration=150)
    timed = gg.least_period(GAIT, limits, rounding="2deg").timed
    assert timed is not None
    timed.write(tmp_path / "r.csv")
    export(tmp_path / "r.csv", tmp_path / "e.csv", samples=samples)
    table = gg.read_table(tmp_path / "e.csv")
    np.testing.assert_allclose(table.alpha, timed.at(table["t"]).alpha, atol=1e-9)
    assert gg.validate(tmp_path / "e.csv").flyable


def test_a_new_timing_says_its_peaks_and_a_rate_that_does_not_fit(
    run: Any, tmp_path: Path
) -> None:
    timed = gg.least_period(GAIT, gg.timing.Limits(rate=6, acceleration=150)).timed
    assert timed is not None
    timed.write(tmp_path / "fast.csv")
    done = run("export", "fast.csv", "e.csv", "--period", 1.01, "--rate", 50)
    assert done.code == 0
    assert f"peak {6 * timed.period / 1.01:.3g} rad/s" in done.out
    assert ", limit 6" in done.out
    assert "50.495 rows per second, not 50" in done.err
    paced = run("pace", "fast.csv", "--period", 1.01, "--rate", 50, "--output", "p.csv")
    assert paced.err == done.err
    smooth = run("export", "fast.csv", "s.csv", "--law", "smooth", "--anyway", "--json")
    peaks = {one["name"]: one for one in smooth.json["rate_checks"]}
    assert not peaks["tilt_rate"]["ok"]
    assert peaks["tilt_rate"]["limit"] == 6.0


def test_a_timing_that_breaks_limits_is_not_written_unless_anyway(
    run: Any, tmp_path: Path
) -> None:
    paced = gg.least_period(GAIT, gg.timing.Limits(rate=6, acceleration=150)).timed
    assert paced is not None
    paced.write(tmp_path / "fast.csv")
    for option in (("--law", "smooth"), ("--period", 0.5)):
        done = run("export", "fast.csv", "e.csv", *option)
        assert done.code == 1
        assert "nothing is written, since the motion is not flyable: peak " in done.err
        assert "limit 6" in done.err
        assert not (tmp_path / "e.csv").exists()
        assert run("export", "fast.csv", "e.csv", *option, "--anyway").code == 0
        judged = run("validate", "e.csv", "--require", "flyable", "--json")
        assert judged.code == 1
        (tmp_path / "e.csv").unlink()


def test_what_repeats_is_said_by_true_or_false(run: Any, tmp_path: Path) -> None:
    columns = {f"alpha{k}": [0.0, (-1) ** k * 0.3] for k in range(1, 5)}
    path = tmp_path / "own.json"
    for wrong in (0, 1, "false", None):
        content = {"columns": columns, "about": {"repeats": wrong}}
        path.write_text(json.dumps(content))
        done = run("validate", "own.json")
        assert done.code == 2
        assert "own.json': repeats must be true or false, got " in done.err
    arrays = {name: np.array(one) for name, one in columns.items()}
    assert not gg.Table(columns=arrays, about={"repeats": np.False_}).repeats


def test_once_keeps_the_rows_and_rates_of_a_gait(run: Any, tmp_path: Path) -> None:
    paced = gg.least_period(GAIT, gg.timing.Limits(rate=6, acceleration=150)).timed
    assert paced is not None
    paced.write(tmp_path / "fast.csv")
    done = run("export", "fast.csv", "e.csv", "e.h", "--once")
    assert (done.code, done.err) == (0, "")
    table, gait = gg.read_table(tmp_path / "e.csv"), table_of(paced)
    assert not table.repeats
    assert table.limits == gait.limits
    for name in (*RATES, "alpha1_acceleration"):
        np.testing.assert_array_equal(table[name], gait[name])
    assert "cubic" in (tmp_path / "e.h").read_text()
    fine = export(gait.once(), [], samples=1000).table
    np.testing.assert_allclose(fine.alpha, paced.at(fine["t"]).alpha, atol=1e-3)
    assert table.once() is table


def test_another_timing_keeps_limits_below_those_of_the_vehicle(
    run: Any, tmp_path: Path
) -> None:
    vehicle = gg.PAPER.replace(max_tilt_rate=7, max_tilt_acceleration=200)
    gait = replace(GAIT, vehicle=vehicle)
    paced = gg.least_period(gait, gg.timing.Limits(rate=6, acceleration=150)).timed
    assert paced is not None
    paced.write(tmp_path / "fast.csv")
    for option in (("--period", 0.93 * paced.period), ("--law", "smooth")):
        done = run("export", "fast.csv", "e.csv", *option)
        assert done.code == 1
        assert "limit 6:" in done.err
        assert not (tmp_path / "e.csv").exists()
    slow = run("export", "fast.csv", "e.csv", "--period", 2, "--json")
    checks = {one["name"]: one["limit"] for one in slow.json["rate_checks"]}
    assert checks == {"tilt_rate": 6.0, "tilt_acceleration": 150.0}


def test_another_sampling_of_rows_states_its_own_number(tmp_path: Path) -> None:
    limits = gg.timing.Limits(rate=6, acceleration=150, jerk=9000)
    timed = gg.least_period(GAIT, limits, rounding="2deg", samples=400).timed
    assert timed is not None
    timed.write(tmp_path / "jerk.json")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        export(tmp_path / "jerk.json", tmp_path / "e.json", samples=40)
        again = gg.read_table(tmp_path / "e.json")
    assert again.about["samples"] == len(again) - 1 == 40
    assert again.joined_by_cubics


def test_another_sampling_keeps_rows_that_follow_no_law(tmp_path: Path) -> None:
    t = np.array([0.0, 0.3, 0.4, 0.9, 1.0])
    rows = np.vstack([GAIT.alpha, GAIT.alpha[:1]])
    columns = {"t": t} | {f"alpha{k + 1}": rows[:, k] for k in range(4)}
    export(gg.Table(columns=columns), tmp_path / "e.csv", samples=20)
    table = gg.read_table(tmp_path / "e.csv")
    expected = np.column_stack([np.interp(table["t"], t, one) for one in rows.T])
    np.testing.assert_allclose(table.alpha, expected, atol=1e-12)


def test_colourings_are_of_loops(run: Any, entry: Path) -> None:
    for command in ("colorings", "retarget", "pace", "certify"):
        done = run(command, entry.name)
        assert done.code == (1 if command == "certify" else 2)
        assert "path that is run once" in done.err
        assert "entry.csv" in done.err
    length = run("compare", entry.name, entry.name, "--json").json["gaits"][0]["length"]
    assert length == pytest.approx(ENTRY.length)
