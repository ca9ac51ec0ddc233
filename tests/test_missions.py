"""Whole flights from hover to hover: continuous, written as they are, read back as the same motion, and flown."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import gaitgraph as gg
from gaitgraph.flight.course import from_hover
from gaitgraph.gait.table import ANGLES, RATES
from gaitgraph.timing.joining import JoinedPath, played

if TYPE_CHECKING:
    from pathlib import Path

LOOP = [(-0.4, 0.4), (-0.4, 1.2), (-1.2, 1.2), (-1.2, 0.4)]
LIMITED = gg.PAPER.replace(max_tilt_rate=6.0, max_tilt_acceleration=150.0)
KINDS = ["smooth", "equal-time", "constant-speed", "paced", "rounded"]


def timed(kind: str) -> Any:
    gait = gg.lift(LOOP, "red", vehicle=LIMITED)
    if kind in ("paced", "rounded"):
        rounding = "5deg" if kind == "rounded" else None
        return gg.least_period(gait, rounding=rounding).timed
    law: Any = kind
    return gait.parametrize(2.0, law=law)


@pytest.mark.parametrize("kind", KINDS)
def test_it_is_one_motion_from_rest_in_hover_to_rest_in_hover(
    kind: str, tmp_path: Path
) -> None:
    gait = timed(kind)
    flight = gg.mission(gait, periods=3)
    t = np.linspace(0, flight.period, 20_001)
    motion, step = flight.at(t), t[1]
    for values in (motion.alpha, motion.rates):
        assert not values[[0, -1]].any()
    fastest, steepest = (np.max(flight.peaks(order)) for order in (1, 2))
    assert np.abs(motion.rates).max() <= fastest + 1e-9
    assert np.abs(np.diff(motion.alpha, axis=0)).max() <= fastest * step * (1 + 1e-9)
    if kind != "constant-speed":  # which turns corners at full speed
        jumps = np.abs(np.diff(motion.rates, axis=0)).max()
        assert jumps <= steepest * step * (1 + 1e-6)
    # Between the paths it is the gait, three times.
    begins = dict(flight.phases)
    assert [*begins] == [*dict.fromkeys(flight.course.phases)]
    inside = np.linspace(0, 3 * gait.period, 500, endpoint=False)
    turns = flight.at(begins["gait"] + inside).alpha
    np.testing.assert_allclose(turns, gait.at(inside).alpha, atol=1e-9)
    first, last = flight.course.gait_times
    runs = [
        section.period
        for section in flight.sections
        if section.phase in ("gait", "run-up", "run-down")
    ]
    assert last - first == pytest.approx(sum(runs))
    # Its table is read back as the same motion.
    flight.write(tmp_path / "flight.csv")
    again = played(tmp_path / "flight.csv")
    assert isinstance(again, JoinedPath)
    assert again.phases == flight.phases
    np.testing.assert_allclose(again.at(t).alpha, motion.alpha, atol=1e-8)
    assert gg.validate(tmp_path / "flight.csv").flyable == flight.check().flyable
    # A flight from hover is that of the mission.
    course: Any = from_hover(gait, periods=3)
    np.testing.assert_array_equal(course.at(t).alpha, motion.alpha)


def test_every_format_holds_it(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    flight = gg.mission(timed("smooth"))
    t = np.linspace(0, flight.period, 997)
    for suffix in ("json", "npz", "mat", "parquet"):
        flight.write(tmp_path / f"flight.{suffix}")
        again: Any = played(tmp_path / f"flight.{suffix}")
        assert again.course.phases == flight.course.phases
        np.testing.assert_allclose(again.at(t).alpha, flight.at(t).alpha, atol=1e-8)


@pytest.mark.parametrize("rate", [50.0, 47.3])
def test_its_rows_fill_whole_frames(rate: float) -> None:
    flight = gg.mission(timed("paced"), rate=rate)
    assert flight.period * rate == pytest.approx(flight.samples, abs=1e-9)
    assert 1.0 <= flight.sections[-1].period < 1.0 + 1.0 / rate
    assert not flight.at(flight.period).alpha.any()


def test_flying_its_table_is_flying_from_hover(run: Any) -> None:
    pytest.importorskip("mujoco")
    once = ("--from-hover", "--periods", "1")
    assert run("export", "gait4", "flight.csv", *once).code == 0
    table, gait = (
        run("fly", *given, "--json").json
        for given in (["flight.csv"], ["gait4", *once])
    )
    assert (table["settled"], gait["settled"]) == (True, True)
    for name in ("duration", "attitude", "peak_thrust", "energy"):
        assert table[name] == pytest.approx(gait[name], rel=1e-6), name


def test_in_another_duration_it_is_the_same_motion(tmp_path: Path) -> None:
    flight = gg.mission(timed("smooth"))
    flight.write(tmp_path / "flight.csv")
    slow = gg.timing.timed_gait_of(tmp_path / "flight.csv", period=2 * flight.period)
    t = np.linspace(0, flight.period, 301)
    np.testing.assert_allclose(slow.at(2 * t).alpha, flight.at(t).alpha, atol=1e-8)
    assert dict(slow.phases)["gait"] == 2 * dict(flight.phases)["gait"]
    with pytest.raises(gg.InputError, match="^period must be"):
        gg.timing.timed_gait_of(tmp_path / "flight.csv", period=0.0)
    gg.export(tmp_path / "flight.csv", tmp_path / "slow.csv", period=slow.period)
    assert len(gg.read_table(tmp_path / "slow.csv")) == len(flight.t)


def test_rows_that_state_no_sections_keep_the_phases(tmp_path: Path) -> None:
    """As those of a gait that is run by rows of its own."""
    pytest.importorskip("mujoco")
    table = gg.timing.table_of(timed("smooth"))
    rows = gg.Table(columns={name: table[name] for name in ("t", *ANGLES, *RATES)})
    flight = gg.mission(rows, vehicle=LIMITED)
    flight.write(tmp_path / "flight.csv")
    again = gg.timing.timed_gait_of(tmp_path / "flight.csv")
    assert not isinstance(again, JoinedPath)
    assert again.phases == flight.phases
    gg.export(tmp_path / "flight.csv", tmp_path / "slow.csv", period=2 * flight.period)
    slow = gg.timing.timed_gait_of(tmp_path / "slow.csv")
    assert slow.phases == flight.with_period(2 * flight.period).phases
    flown = gg.fly(tmp_path / "flight.csv")
    assert (flown.settled, flown.settling_time) == (True, 0.0)
    assert flown.course.phases == flight.course.phases


@pytest.mark.parametrize(
    "phases", [1, [["gait"]], [["gait", 1.0]], [["gait", 0.0], ["exit", 99.0]]]
)
def test_phases_that_do_not_fit_are_not_used(phases: Any) -> None:
    table = gg.timing.table_of(gg.mission(timed("smooth"), periods=1))
    rows = gg.Table(
        columns={name: table[name] for name in ("t", *ANGLES)},
        about={"repeats": False, "phases": phases},
    )
    assert gg.timing.timed_gait_of(rows).phases == ()


def test_edited_rows_of_a_mission_are_judged_as_they_stand(tmp_path: Path) -> None:
    table = gg.timing.table_of(gg.mission(timed("smooth"), periods=1))
    bent = table["alpha1"].copy()
    bent[len(bent) // 2] = 1.4
    edited = gg.Table(columns=table.columns | {"alpha1": bent}, about=table.about)
    gg.io.write_tables(edited, [tmp_path / "flight.csv"])
    with pytest.warns(gg.errors.FileWarning, match="is not used"):
        assert not gg.validate(tmp_path / "flight.csv").valid


def test_a_gait_that_hover_cannot_reach_is_refused_with_the_nearest_that_it_can() -> (
    None
):
    with pytest.raises(gg.Infeasible, match="rows are up to 119° away") as refused:
        gg.mission("gait3")
    assert "passes a singular matrix" in str(refused.value)
    nearest = gg.retarget("gait3", sign="positive")
    assert np.degrees(nearest.largest[0]) == pytest.approx(118.7, abs=0.1)
    assert gg.mission(nearest.gait.parametrize(1.0)).check().flyable
    for periods in (0, 10_001):
        with pytest.raises(gg.InputError, match="^periods must be"):
            gg.mission("gait4", periods=periods)


def test_what_is_off_the_surfaces_is_entered_straight() -> None:
    biased = gg.lift(LOOP, "red", vehicle=LIMITED).biased(0.9).parametrize(2.0)
    flight = gg.mission(biased)
    entry: Any = flight.sections[1]
    np.testing.assert_allclose(entry.line, [[0] * 4, biased.alpha[0]])
    assert entry.peaks(1).max() <= 6.0 * (1 + 1e-9)
    anyway = gg.mission("gait3", anyway=True)
    assert len(anyway.sections[1].line) == 2
    assert not anyway.check().flyable


def test_export_writes_it(run: Any, tmp_path: Path) -> None:
    once = ("--from-hover", "--periods", "3", "--law", "equal-time", "--period", "2")
    written = run("export", "gait4", "out.csv", *once, "--json")
    assert (written.code, written.json["flyable"]) == (0, True)
    table = gg.read_table(tmp_path / "out.csv")
    names, begins = zip(*table.about["phases"], strict=True)
    gait = names.index("gait")
    assert begins[gait + 1] - begins[gait] == pytest.approx(3 * 2.0)
    assert not table.repeats
    refused = run("export", "gait3", "no.csv", "--from-hover")
    assert (refused.code, (tmp_path / "no.csv").exists()) == (1, False)
