"""Gaits in motion are entered and left: run-ups within the gait's own peaks, and tables that join in angle and rate."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import gaitgraph as gg
from gaitgraph.gait.table import ACCELERATIONS, ANGLES, RATES
from gaitgraph.invertibility import hover_thrust_shares
from gaitgraph.timing import Limits, least_period
from gaitgraph.timing.joining import RunUp, played, run_up
from gaitgraph.timing.timed_gait import RowTimedGait, table_of
from tests.samples import on_red, table_from

if TYPE_CHECKING:
    from pathlib import Path

    from gaitgraph.timing import TimedGait

LOOP = [(-0.4, 0.4), (-0.4, 1.2), (-1.2, 1.2), (-1.2, 0.4)]
GAIT = gg.lift(LOOP, "red")
NAMES = (*ANGLES, *RATES, *ACCELERATIONS)


def fastest(rounding: Any = None, gait: gg.Gait = GAIT, **limits: Any) -> Any:
    asked = Limits(**{"rate": 6, "acceleration": 150, **limits})
    timed = least_period(gait, asked, rounding=rounding).timed
    assert timed is not None
    return timed


@cache
def rounded() -> Any:
    return fastest("2deg")


def circle(rows: int, *, rates: bool) -> gg.Table:
    """Return an open table around a circle that no law knows, with rates and accelerations if asked for."""
    t = np.arange(rows) / rows
    turn = 2 * np.pi * t + 1.0
    cosine, sine = 0.3 * np.cos(turn), 0.3 * np.sin(turn)
    columns: dict[str, Any] = {}
    if rates:
        rate = 2 * np.pi * on_red(-sine, cosine)
        steep = -4 * np.pi**2 * on_red(cosine, sine)
        columns = dict(zip(NAMES[4:], np.hstack([rate, steep]).T, strict=True))
    return table_from(on_red(cosine - 0.8, sine + 0.8), t=t, **columns)


@cache
def moving(kind: str) -> Any:
    """Return a gait of a kind that is in motion at its first row."""
    if kind == "rounded":
        return rounded()
    if kind == "slower":
        return rounded().with_period(1.7)
    if kind == "jerk":
        return fastest("2deg", jerk=9000)
    if kind == "acceleration":
        return fastest(0.02, rate=None, acceleration=40)
    if kind == "optimal":
        points = [(-0.5, 0.5), (-0.5, 1.0), (-1.0, 0.8)]
        return gg.optimal_gait(points, pieces=16).timed()
    if kind in ("rows", "straight"):
        return played(circle(60, rates=kind == "rows"))
    return GAIT.parametrize(1.0, law="constant-speed")


# How many of four angles, rates and accelerations are continuous at the first row.
KINDS = {
    "rounded": 12,
    "slower": 12,
    "jerk": 12,
    "acceleration": 12,
    "optimal": 12,
    "rows": 8,
    "straight": 4,
    "constant-speed": 4,
}


def row_of(table: gg.Table, row: int) -> np.ndarray:
    return np.array([table[name][row] for name in NAMES])


def check_within_peaks(run: RunUp, motion: TimedGait, *, jerk: bool) -> None:
    t = np.linspace(0.0, run.period, 20_001)
    found = run.at(t)
    peaks = [motion.peaks(order) for order in (1, 2, 3)]
    assert (np.abs(found.rates).max(axis=0) <= peaks[0] * (1 + 1e-12)).all()
    assert (np.abs(found.accelerations).max(axis=0) <= peaks[1] * (1 + 1e-9)).all()
    if jerk:
        slopes = np.abs(np.diff(found.accelerations, axis=0)).max(axis=0) / t[1]
        assert (slopes <= peaks[2] * (1 + 1e-6)).all()
        away = np.abs(np.gradient(found.alpha, t, axis=0) - found.rates)[1:-1].max()
        assert away < 1e-3 * peaks[0].max()
    # It runs along the gait: every angle is one of the gait's, at some time.
    gait = motion.at(np.linspace(0, motion.period, 4001)).alpha
    away = np.abs(found.alpha[::1000, None] - gait).max(axis=2).min(axis=1)
    assert away.max() < 1e-2


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("stops", [False, True])
def test_a_run_up_is_between_rest_and_the_gait_and_never_faster_than_it(
    kind: str, stops: bool
) -> None:
    motion = moving(kind)
    run = run_up(motion, stops=stops)
    assert run is not None
    rest, gait = (run.period, 0.0) if stops else (0.0, run.period)
    own = slice(KINDS[kind])
    joined, first = np.concatenate(run.at(gait)), np.concatenate(motion.at(0.0))
    np.testing.assert_allclose(joined[own], first[own], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(run.at(rest).alpha, first[:4], atol=1e-12)
    np.testing.assert_allclose(run.at(rest)[1:], 0.0, atol=1e-12)
    check_within_peaks(run, motion, jerk=KINDS[kind] == 12)
    # Of whole periods, each a tenth longer at most.
    assert run.periods * motion.period < run.period < 1.1 * run.periods * motion.period
    longer = replace(run, periods=2 * run.periods)
    assert longer.period == pytest.approx(2 * run.period)


def test_a_gait_that_rests_at_its_first_row_needs_no_run_up() -> None:
    still = gg.lift(LOOP[:1], "red").parametrize()
    for motion in (GAIT.parametrize(1.0), fastest(), still):
        assert run_up(motion) is None


# -- The motion of files


def test_the_motion_of_rows_passes_their_rates_and_accelerations() -> None:
    table = circle(40, rates=True)
    motion = played(table)
    assert isinstance(motion, RowTimedGait)
    np.testing.assert_allclose(np.concatenate(motion.at(0.0)), row_of(table, 0))
    t = np.linspace(0, 1, 20_001)
    turn, found = 2 * np.pi * t + 1.0, motion.at(t)
    np.testing.assert_allclose(found.alpha[:, 0], -0.8 + 0.3 * np.cos(turn), atol=1e-6)
    np.testing.assert_allclose(found.rates[:, 1], 0.6 * np.pi * np.cos(turn), atol=1e-6)
    # Its largest derivatives: a bound that is near those of many samples.
    for order, values in ((1, found.rates), (2, found.accelerations)):
        share = np.abs(values).max(axis=0) / motion.peaks(order)
        assert 0.98 < share.min() <= share.max() <= 1 + 1e-12
    slower = motion.with_period(2.0).at(2 * t)
    np.testing.assert_allclose(4 * slower.accelerations, found.accelerations, atol=1e-9)


# -- Entries and exits


def test_from_gait_to_gait_the_one_stops_and_the_other_starts() -> None:
    path = gg.transition(rounded(), moving("slower"), duration=0.7, rate=200)
    timed: Any = path.timed
    assert timed.course.phases == ("run-down", "path", "run-up")
    for row, motion in ((0, rounded()), (-1, moving("slower"))):
        first = np.concatenate(motion.at(0.0))
        np.testing.assert_allclose(row_of(path.table, row), first, atol=1e-9)
    assert path.table.limits == {"rate": (6.0,) * 4, "acceleration": (150.0,) * 4}
    assert 1 / path.table["t"][1] == pytest.approx(200, rel=0.01)
    told = path.as_mapping()
    assert {told[name]["periods"] for name in ("run_down", "run_up")} == {1}
    # In another time it is the same path, and it stays at its ends.
    t = np.linspace(0, timed.period, 301)
    slower = timed.with_period(2 * timed.period).at(2 * t)
    for order, values in enumerate(timed.at(t)):
        np.testing.assert_allclose(2**order * slower[order], values, atol=1e-9)
    assert not timed.at([-1.0, timed.period + 1.0]).rates.any()


def test_an_entry_takes_as_long_as_the_limits_of_table_and_vehicle_need() -> None:
    slow = fastest("2deg", rate=0.4, acceleration=10)
    turn = np.abs(slow.at(0.0).alpha).max()
    quick = gg.PAPER.replace(max_tilt_rate=2.0)
    for motion, vehicle in (
        (slow, None),
        (table_of(slow), None),
        (table_of(slow), quick),
    ):
        path = gg.transition("hover", motion, vehicle=vehicle)
        assert path.duration == pytest.approx(15 / 8 * turn / 0.4, abs=2e-3)
        assert (path.reason, path.report["tilt_rate"].limit) == (None, 0.4)
        fast = gg.transition("hover", motion, vehicle=vehicle, duration=1.0)
        assert "limit 0.4" in str(fast.reason)
    weak = gg.PAPER.replace(max_tilt_acceleration=0.5)
    rested = table_of(GAIT.parametrize(20.0))
    assert gg.transition("hover", rested).duration == 1.0
    assert gg.transition("hover", rested, vehicle=weak).duration > 2.0


def test_a_table_is_joined_at_its_first_row_and_a_gait_at_the_nearest_corner() -> None:
    turned = GAIT.started_at(2)
    assert gg.transition("hover", turned).corners == (None, 2)
    for with_times in (turned.parametrize(1.0), table_of(turned)):
        path = gg.transition("hover", with_times)
        assert (path.corners, path.run_up) == ((None, 0), None)
        np.testing.assert_array_equal(path.path[-1], turned.alpha[0])


@pytest.mark.parametrize("leaves", [False, True])
def test_the_report_of_a_joined_path_is_of_all_its_sections(leaves: bool) -> None:
    vehicle = gg.PAPER.replace(max_tilt="80deg")
    limited = rounded().with_gait(replace(rounded().gait, vehicle=vehicle))
    ends: Any = (limited, "hover") if leaves else ("hover", limited)
    path = gg.transition(*ends)
    alpha = path.table.alpha
    shares = hover_thrust_shares(alpha, vehicle)
    for report in (path.report, gg.validate(path.table)):
        least = report["R_sign"].value or 0.0
        assert 0.0 <= path.table["R"].min() - least < 0.05
        tilt = report["tilt_range"].value
        assert tilt == pytest.approx(np.abs(alpha).max(), abs=2e-3)
        extremes = (shares.min(), shares.max())
        assert report.hover_thrusts == pytest.approx(extremes, abs=5e-3)


def test_rows_that_were_moved_are_no_joined_path_any_more(tmp_path: Path) -> None:
    entry = gg.transition("hover", rounded())
    path = tmp_path / "entry.json"
    entry.write(path)
    table = gg.read_table(path)
    motion: Any = table.motion
    t = np.linspace(0, motion.period, 301)
    np.testing.assert_allclose(motion.at(t), entry.timed.at(t), atol=1e-9)
    moved = table.columns | {"alpha1": table["alpha1"] + 1e-4 * (table["t"] > 0.5)}
    stated = table.about["sections"]
    wrong: list[Any] = [[], [{}], stated[:1], [*stated, stated[0]], "path", 1]
    changed = [(table.columns, sections) for sections in wrong]
    for columns, sections in [(moved, stated), *changed]:
        about = table.about | {"sections": sections}
        gg.io.write_tables(gg.Table(columns=columns, about=about), [path], force=True)
        with pytest.warns(gg.errors.FileWarning, match="states of its motion is not"):
            assert gg.read_table(path).motion is None


def test_a_gait_that_only_its_rows_describe_may_need_more_of_them(
    tmp_path: Path,
) -> None:
    timed = fastest("2deg", jerk=20000)
    for samples, flyable in ((60, False), (400, True)):
        path = tmp_path / f"{samples}.json"
        replace(timed, samples=samples).write(path)
        entry = gg.transition("hover", path)
        assert entry.report.flyable is flyable
        assert ("more of them may be enough" in str(entry)) is not flyable
