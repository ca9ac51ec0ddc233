"""Gaits in motion are entered and left: run-ups within the gait's own peaks, and tables that join in angle and rate."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import gaitgraph as gg
from gaitgraph.gait.table import ACCELERATIONS, RATES
from gaitgraph.invertibility import hover_thrust_shares
from gaitgraph.io.exporting import export
from gaitgraph.io.formats import FORMATS
from gaitgraph.timing.joining import JoinedPath, RunUp, played, run_up
from gaitgraph.timing.timed_gait import RowTimedGait, table_of

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from gaitgraph.timing import TimedGait

LOOP = [(-0.4, 0.4), (-0.4, 1.2), (-1.2, 1.2), (-1.2, 0.4)]
GAIT = gg.lift(LOOP, "red")
LIMITS = gg.timing.Limits(rate=6, acceleration=150)
READ = [suffix for suffix, form in FORMATS.items() if form.reads]


def timed_of(found: gg.timing.LeastPeriod) -> gg.timing.LimitedGait:
    assert found.timed is not None
    return found.timed


@cache
def resting() -> gg.timing.LimitedGait:
    return timed_of(gg.least_period(GAIT, LIMITS))


@cache
def rounded() -> gg.timing.LimitedGait:
    return timed_of(gg.least_period(GAIT, LIMITS, rounding="2deg"))


@cache
def entry_of_rounded() -> gg.planning.Transition:
    return gg.transition("hover", rounded())


def circle(rows: int, *, rates: bool) -> gg.Table:
    """Return an open table around a circle that no law knows, with rates and accelerations if asked for."""
    t = np.arange(rows) / rows
    turn = 2 * np.pi * t + 1.0
    moves = 0.3 * np.stack([np.cos(turn), np.sin(turn)])
    places = moves + np.array([[-0.8], [0.8]])
    faster = 0.6 * np.pi * np.stack([-np.sin(turn), np.cos(turn)])
    columns: dict[str, Any] = {"t": t}
    for name, row, rate, second in zip(
        ("alpha1", "alpha2", "alpha3", "alpha4"),
        np.tile(places, (2, 1)),
        np.tile(faster, (2, 1)),
        np.tile(-4 * np.pi**2 * moves, (2, 1)),
        strict=True,
    ):
        columns[name] = row
        if rates:
            columns |= {f"{name}_rate": rate, f"{name}_acceleration": second}
    return gg.Table(columns=columns)


def slower() -> TimedGait:
    slow = gg.timing.paced(GAIT, LIMITS, period=1.7, rounding=0.1).timed
    assert slow is not None
    return slow


def jerky() -> TimedGait:
    limits = gg.timing.Limits(rate=6, acceleration=150, jerk=9000)
    return timed_of(gg.least_period(GAIT, limits, rounding="2deg"))


def accelerated() -> TimedGait:
    limits = gg.timing.Limits(acceleration=40)
    return timed_of(gg.least_period(GAIT, limits, rounding=0.02))


def optimal() -> TimedGait:
    points = [(-0.5, 0.5), (-0.5, 1.0), (-1.0, 0.8)]
    return gg.optimal_gait(points, objective="hover_reserve").timed()


KINDS: dict[str, Callable[[], TimedGait]] = {
    "rounded": rounded,
    "slower": slower,
    "jerk": jerky,
    "acceleration": accelerated,
    "optimal": optimal,
    "rows": lambda: played(circle(60, rates=True)),
    "straight": lambda: played(circle(60, rates=False)),
    "constant-speed": lambda: GAIT.parametrize(1.0, law="constant-speed"),
}


@cache
def moving(kind: str) -> TimedGait:
    """Return a gait of a kind that is in motion at its first row."""
    return KINDS[kind]()


# How many of angles, rates and accelerations are continuous at the first row, where not all twelve are.
CONTINUOUS = {"rows": 8, "straight": 4, "constant-speed": 4}


@pytest.mark.parametrize(
    ("kind", "stops"), [("jerk", True), *((kind, False) for kind in KINDS)]
)
def test_a_run_up_is_between_rest_and_the_gait_and_never_faster_than_it(
    kind: str, stops: bool
) -> None:
    motion = moving(kind)
    run = run_up(motion, stops=stops)
    assert run is not None
    rest, gait = (run.period, 0.0) if stops else (0.0, run.period)
    first = np.concatenate(motion.at(0.0))
    continuous = CONTINUOUS.get(kind, 12)
    joined = np.concatenate(run.at(gait))
    np.testing.assert_allclose(
        joined[:continuous], first[:continuous], rtol=1e-9, atol=1e-9
    )
    np.testing.assert_allclose(run.at(rest).alpha, motion.at(0.0).alpha, atol=1e-12)
    np.testing.assert_allclose(run.at(rest)[1:], 0.0, atol=1e-12)
    if continuous > 4:
        near = run.at(gait + (1e-7 if stops else -1e-7))
        np.testing.assert_allclose(near.rates, motion.at(0.0).rates, atol=1e-4)
    t = np.linspace(0.0, run.period, 20_001)
    found = run.at(t)
    peaks = [motion.peaks(order) for order in (1, 2, 3)]
    assert (np.abs(found.rates).max(axis=0) <= peaks[0] * (1 + 1e-12)).all()
    assert (np.abs(found.accelerations).max(axis=0) <= peaks[1] * (1 + 1e-9)).all()
    if kind not in ("rows", "straight", "constant-speed"):  # whose jerk has impulses
        jerk = np.abs(np.diff(found.accelerations, axis=0)).max(axis=0) / t[1]
        assert (jerk <= peaks[2] * (1 + 1e-6)).all()
        rates = np.gradient(found.alpha, t, axis=0)
        assert np.abs(rates - found.rates)[1:-1].max() < 1e-3 * peaks[0].max()
    # It runs along the gait: every angle is one of the gait's, at some time.
    phase = motion.at(np.linspace(0, motion.period, 4001)).alpha
    away = np.abs(found.alpha[::1000, None] - phase[None]).max(axis=2).min(axis=1)
    assert away.max() < 1e-2


@pytest.mark.parametrize("seed", range(4))
def test_run_ups_of_random_gaits_stay_within_their_peaks(seed: int) -> None:
    rng = np.random.default_rng(seed)
    turn = np.sort(rng.uniform(0, 2 * np.pi, rng.integers(3, 8)))
    loop = np.column_stack([-0.8 + 0.5 * np.cos(turn), 0.8 + 0.5 * np.sin(turn)])
    jerk = rng.uniform(500, 5000) if seed % 3 == 0 else None
    limits = gg.timing.Limits(
        rate=rng.uniform(1, 8), acceleration=rng.uniform(20, 200), jerk=jerk
    )
    rounding = rng.uniform(1e-3, 0.1)
    gait = gg.lift(loop, "red")
    motion = timed_of(gg.least_period(gait, limits, rounding=rounding, nodes=100))
    run = run_up(motion)
    if run is None:  # where resting at the corners is quicker
        assert motion.curve is None
        return
    t = np.linspace(0.0, run.period, 20_001)
    found = run.at(t)
    assert (np.abs(found.rates).max(axis=0) <= motion.peaks(1)).all()
    assert (np.abs(found.accelerations).max(axis=0) <= motion.peaks(2)).all()
    if jerk is not None:
        jerks = np.abs(np.diff(found.accelerations, axis=0)).max(axis=0) / t[1]
        assert (jerks <= motion.peaks(3) * (1 + 1e-6)).all()


def test_a_gait_that_rests_at_its_first_row_needs_no_run_up() -> None:
    for motion in (
        GAIT.parametrize(1.0),
        resting(),
        gg.lift(LOOP[:1], "red").parametrize(),
    ):
        assert run_up(motion) is None


@pytest.mark.parametrize("suffix", READ)
@pytest.mark.parametrize("rounding", [None, "2deg"])
def test_the_motion_of_a_paced_file_is_its_law(
    suffix: str, rounding: str | None, tmp_path: Path
) -> None:
    form = FORMATS[suffix]
    if form.library:
        pytest.importorskip(form.library, reason=f"install the extra {form.extra!r}")
    timed = rounded() if rounding else resting()
    replace(timed, samples=30).write(tmp_path / f"g{suffix}")
    motion = played(tmp_path / f"g{suffix}")
    t = np.linspace(0, timed.period, 997)
    for found, expected in zip(motion.at(t), timed.at(t), strict=True):
        np.testing.assert_allclose(found, expected, atol=1e-6)


def test_the_motion_of_rows_passes_their_rates_and_accelerations() -> None:
    table = circle(40, rates=True)
    motion = played(table)
    assert isinstance(motion, RowTimedGait)
    turn = 2 * np.pi * np.linspace(0, 1, 401)[:-1] + 1.0
    found = motion.at((turn - 1.0) / (2 * np.pi))
    np.testing.assert_allclose(found.alpha[:, 0], -0.8 + 0.3 * np.cos(turn), atol=1e-6)
    np.testing.assert_allclose(found.rates[:, 1], 0.6 * np.pi * np.cos(turn), atol=1e-6)
    for name, values in (("rate", found.rates), ("acceleration", found.accelerations)):
        np.testing.assert_allclose(values[0, 1], table[f"alpha2_{name}"][0], rtol=1e-12)
    # Its largest derivatives: those of many samples, and a bound that is near them.
    dense = motion.at(np.linspace(0, 1, 40_001))
    for order, values in ((1, dense.rates), (2, dense.accelerations)):
        peak = np.abs(values).max(axis=0)
        assert (peak <= motion.peaks(order) * (1 + 1e-12)).all()
        assert (motion.peaks(order) < 1.02 * peak).all()
    straight = played(circle(40, rates=False))
    assert np.abs(straight.at(0.0).rates[1] - table["alpha2_rate"][0]) > 0.05


def rows_of(table: gg.Table, row: int) -> np.ndarray:
    """Return angles, rates and accelerations of a row."""
    names = ("alpha1", "alpha2", "alpha3", "alpha4", *RATES, *ACCELERATIONS)
    return np.array([table[name][row] for name in names])


@pytest.mark.parametrize("kind", KINDS)
def test_entry_gait_and_exit_join_in_angle_and_rate(kind: str) -> None:
    motion = moving(kind)
    table = table_of(motion)
    if kind == "rows":
        table = circle(60, rates=True)
    entry, leaving = gg.transition("hover", motion), gg.transition(motion, "hover")
    first = np.concatenate(motion.at(0.0))
    own = slice(CONTINUOUS.get(kind, 12))
    np.testing.assert_allclose(rows_of(entry.table, -1)[own], first[own], atol=1e-9)
    np.testing.assert_allclose(rows_of(leaving.table, 0), first, atol=1e-9)
    np.testing.assert_allclose(rows_of(entry.table, -1)[:4], table.alpha[0], atol=1e-9)
    np.testing.assert_allclose(rows_of(entry.table, 0), 0.0, atol=1e-9)
    np.testing.assert_allclose(rows_of(leaving.table, -1), 0.0, atol=1e-9)
    for found in (entry, leaving):
        assert found.report is not None
        assert found.report.flyable, found.reason
        assert not found.table.repeats
        assert found.table["t"][-1] == found.timed.period
        assert found.as_mapping()["duration"] == found.timed.period
        # No step between rows is larger than the rates allow.
        t = found.table["t"]
        slopes = np.abs(np.diff(found.table.alpha, axis=0)).max() / t[1]
        assert slopes <= max(motion.peaks(1).max(), 15 / 8 * 1.2) * (1 + 1e-9)
    assert entry.run_up is not None
    assert entry.run_down is None
    assert leaving.run_up is None
    assert leaving.run_down is not None
    text = str(entry).splitlines()
    assert text[0].startswith("From hover to row 1 (")
    assert "the clock of the gait starts: " in text[1]


def test_from_gait_to_gait_the_one_stops_and_the_other_starts() -> None:
    found = gg.transition(rounded(), moving("slower"), duration=0.7, rate=200)
    assert isinstance(found.timed, JoinedPath)
    assert found.timed.course.phases == ("run-down", "path", "run-up")
    table = found.table
    np.testing.assert_allclose(
        rows_of(table, 0), np.concatenate(rounded().at(0.0)), atol=1e-9
    )
    np.testing.assert_allclose(
        rows_of(table, -1), np.concatenate(moving("slower").at(0.0)), atol=1e-9
    )
    assert table.limits == {"rate": (6.0,) * 4, "acceleration": (150.0,) * 4}
    assert 1 / table["t"][1] == pytest.approx(200, rel=0.01)
    told = found.as_mapping()
    assert {told[name]["periods"] for name in ("run_down", "run_up")} == {1}


def test_an_entry_takes_as_long_as_the_limits_of_the_table_need() -> None:
    limits = gg.timing.Limits(rate=0.4, acceleration=10)
    slow = timed_of(gg.least_period(GAIT, limits, rounding="2deg"))
    for motion in (slow, table_of(slow)):
        found = gg.transition("hover", motion)
        turn = np.abs(played(motion).at(0.0).alpha).max()
        assert found.duration == pytest.approx(15 / 8 * turn / 0.4, abs=2e-3)
        assert found.report is not None
        assert found.report["tilt_rate"].limit == 0.4
        assert found.report["tilt_rate"].ok
        fast = gg.transition("hover", motion, duration=1.0)
        assert "limit 0.4" in str(fast.reason)
    quick = gg.PAPER.replace(max_tilt_rate=2.0)
    both = gg.transition("hover", table_of(slow), vehicle=quick)
    assert (both.duration, both.reason) == (found.duration, None)
    slower = gg.PAPER.replace(max_tilt_acceleration=0.5)
    assert gg.transition("hover", GAIT.parametrize(20.0)).duration == 1.0
    rested = gg.transition("hover", table_of(GAIT.parametrize(20.0)), vehicle=slower)
    assert rested.duration > 2.0


def test_a_table_is_joined_at_its_first_row_and_a_gait_at_the_nearest_corner() -> None:
    turned = GAIT.started_at(2)
    assert gg.transition("hover", turned).corners == (None, 2)
    for with_times in (turned.parametrize(1.0), table_of(turned)):
        found = gg.transition("hover", with_times)
        assert found.corners == (None, 0)
        np.testing.assert_array_equal(found.path[-1], turned.alpha[0])
        assert found.run_up is None


@pytest.mark.parametrize(
    ("suffix", "timing"),
    [(".csv", {"rate": 500.0}), *((one, {"samples": 37}) for one in READ)],
)
def test_entries_are_sampled_anew_within_the_limits_in_every_format(
    suffix: str, timing: dict[str, Any], tmp_path: Path
) -> None:
    form = FORMATS[suffix]
    if form.library:
        pytest.importorskip(form.library, reason=f"install the extra {form.extra!r}")
    entry = entry_of_rounded()
    entry.write(tmp_path / "entry.csv")
    export(tmp_path / "entry.csv", tmp_path / f"e{suffix}", **timing)
    table = gg.read_table(tmp_path / f"e{suffix}")
    expected = entry.timed.at(table["t"])
    np.testing.assert_allclose(table.alpha, expected.alpha, atol=1e-7)
    report = gg.validate(tmp_path / f"e{suffix}")
    assert report.flyable, report.reason
    assert report["tilt_rate"].limit == 6.0
    assert isinstance(table.motion, JoinedPath)


@pytest.mark.parametrize("leaves", [False, True])
def test_the_report_of_a_joined_path_is_of_all_its_sections(leaves: bool) -> None:
    vehicle = gg.PAPER.replace(max_tilt="80deg")
    limited = rounded().with_gait(replace(rounded().gait, vehicle=vehicle))
    ends: tuple[Any, Any] = (limited, "hover") if leaves else ("hover", limited)
    found = gg.transition(*ends)
    table, whole = found.table, limited.check()
    for report in (found.report, gg.validate(table)):
        assert report["R_sign"].value == whole["R_sign"].value
        assert 0.0 <= table["R"].min() - report["R_sign"].value < 0.05
        assert report["tilt_range"].value == pytest.approx(
            np.abs(table.alpha).max(), abs=2e-3
        )
        shares = hover_thrust_shares(table.alpha, vehicle)
        assert report.hover_thrusts == pytest.approx(
            (shares.min(), shares.max()), abs=5e-3
        )
        least, largest = report.hover_thrusts or (0.0, 0.0)
        assert f"{least:.3f} to {largest:.3f}" in report["hover_thrust"].message
        assert "a rotor pushes with up to 0.6" in report.notes[0]


def test_rows_that_were_moved_are_no_joined_path_any_more(tmp_path: Path) -> None:
    entry_of_rounded().write(tmp_path / "entry.json")
    table = gg.read_table(tmp_path / "entry.json")
    assert isinstance(table.motion, JoinedPath)
    t = np.linspace(0, table.motion.period, 301)
    expected = entry_of_rounded().timed.at(t)
    for found, wanted in zip(table.motion.at(t), expected, strict=True):
        np.testing.assert_allclose(found, wanted, atol=1e-9)
    moved = table.columns | {"alpha1": table["alpha1"] + 1e-4 * (table["t"] > 0.5)}
    sections = table.about["sections"]
    wrongs: list[Any] = [[], [{}], [sections[0]], [*sections, sections[0]], "path", 1]
    tables = [gg.Table(columns=moved, about=table.about)]
    for wrong in wrongs:
        about = table.about | {"sections": wrong}
        tables.append(gg.Table(columns=table.columns, about=about))
    for changed in tables:
        gg.io.write_tables(changed, [tmp_path / "changed.json"], force=True)
        with pytest.warns(gg.errors.FileWarning, match="states of its motion is not"):
            again = gg.read_table(tmp_path / "changed.json")
        assert again.motion is None
        assert "sections" not in again.about


def test_a_joined_path_in_another_time_is_the_same_path() -> None:
    joined = gg.transition(rounded(), "hover").timed
    slower = joined.with_period(2.0 * joined.period)
    t = np.linspace(0, joined.period, 301)
    for order, (found, wanted) in enumerate(
        zip(slower.at(2 * t), joined.at(t), strict=True)
    ):
        np.testing.assert_allclose(2.0**order * found, wanted, atol=1e-9)
    ends = joined.at([-1.0, joined.period + 1.0])
    np.testing.assert_allclose(ends.alpha[0], rounded().at(0.0).alpha, atol=1e-12)
    assert not ends.rates.any()


def test_the_command_enters_and_leaves_a_rounded_file(run: Any, tmp_path: Path) -> None:
    rounded().write(tmp_path / "rounded.csv")
    done = run("transition", "hover", "rounded.csv", "--output", "entry.csv")
    assert done.code == 0
    assert "after it the clock of the gait starts: 1 period of it in " in done.out
    left = run("transition", "rounded.csv", "hover", "--output", "exit.csv", "--json")
    assert left.json["run_down"]["periods"] == 1
    gait, entry, leaving = (
        gg.read_table(tmp_path / f"{name}.csv") for name in ("rounded", "entry", "exit")
    )
    np.testing.assert_allclose(rows_of(entry, -1), rows_of(gait, 0), atol=1e-9)
    np.testing.assert_allclose(rows_of(leaving, 0), rows_of(gait, -1), atol=1e-9)
    for name in ("entry.csv", "exit.csv"):
        assert run("validate", name).code == 0
    limited = 'preset = "paper"\nmax_tilt_acceleration = 100\n'
    (tmp_path / "slow.toml").write_text(limited)
    refused = run("transition", "hover", "rounded.csv", "--vehicle", "slow.toml")
    assert refused.code == 1
    assert "limit 100" in refused.out


def test_a_gait_that_only_its_rows_describe_may_need_more_of_them(
    tmp_path: Path,
) -> None:
    limits = gg.timing.Limits(rate=6, acceleration=150, jerk=20000)
    timed = timed_of(gg.least_period(GAIT, limits, rounding="2deg"))
    for samples, flyable in ((60, False), (400, True)):
        path = tmp_path / f"{samples}.json"
        replace(timed, samples=samples).write(path)
        found = gg.transition("hover", path)
        assert found.report is not None
        assert found.report.flyable is flyable
        told = "known by its rows alone, and more of them may be enough"
        assert (told in str(found)) is not flyable
        assert (told in str(found.reason)) is not flyable


@pytest.mark.parametrize("kind", ["rounded", "rows", "constant-speed"])
def test_a_run_up_is_of_whole_periods(kind: str) -> None:
    run = run_up(moving(kind))
    assert isinstance(run, RunUp)
    longer = RunUp(motion=run.motion, periods=run.periods + 1)
    assert longer.period == pytest.approx(run.period * (run.periods + 1) / run.periods)
    assert run.periods * run.motion.period < run.period < 1.2 * longer.period
