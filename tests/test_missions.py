"""Whole flights from hover to hover: continuous, written as they are, read back as the same motion, and flown."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import gaitgraph as gg
from gaitgraph.flight.course import from_hover
from gaitgraph.gait.table import ANGLES, RATES
from gaitgraph.timing.joining import JoinedPath
from gaitgraph.timing.timed_gait import timed_gait_of

if TYPE_CHECKING:
    from pathlib import Path

LOOP = [(-0.4, 0.4), (-0.4, 1.2), (-1.2, 1.2), (-1.2, 0.4)]
LIMITED = gg.PAPER.replace(max_tilt_rate=6.0, max_tilt_acceleration=150.0)


def timed(kind: str) -> Any:
    gait = gg.lift(LOOP, "red", vehicle=LIMITED)
    if kind in ("paced", "rounded"):
        rounding = "5deg" if kind == "rounded" else None
        return gg.least_period(gait, rounding=rounding).timed
    law: Any = kind
    return gait.parametrize(2.0, law=law)


@pytest.mark.parametrize("rate", [50.0, 47.3])
def test_its_rows_fill_whole_frames(rate: float) -> None:
    flight = gg.mission(timed("paced"), rate=rate)
    assert flight.period * rate == pytest.approx(flight.samples, abs=1e-9)
    assert 1.0 <= flight.sections[-1].period < 1.0 + 1.0 / rate
    assert not flight.at(flight.period).alpha.any()


def test_rows_that_state_no_sections_keep_the_phases(tmp_path: Path) -> None:
    """As those of a gait that is run by rows of its own."""
    pytest.importorskip("mujoco")
    table = gg.timing.table_of(timed("smooth"))
    rows = gg.Table(columns={name: table[name] for name in ("t", *ANGLES, *RATES)})
    flight = gg.mission(rows, vehicle=LIMITED)
    flight.write(tmp_path / "flight.csv")
    again = timed_gait_of(tmp_path / "flight.csv")
    assert not isinstance(again, JoinedPath)
    assert again.phases == flight.phases
    gg.export(tmp_path / "flight.csv", tmp_path / "slow.csv", period=2 * flight.period)
    slow = timed_gait_of(tmp_path / "slow.csv")
    assert slow.phases == flight.with_period(2 * flight.period).phases
    flown = gg.fly(tmp_path / "flight.csv")
    assert (flown.settled, flown.course.phases) == (True, flight.course.phases)


WRONG: list[Any] = [1, [["gait"]], [["gait", 1.0]], [["gait", 0.0], ["exit", 99.0]]]


@pytest.mark.parametrize("phases", WRONG)
def test_phases_that_do_not_fit_are_not_used(phases: Any) -> None:
    table = gg.timing.table_of(gg.transition("hover", gg.lift(LOOP, "red")))
    columns = {name: table[name] for name in ("t", *ANGLES)}
    rows = gg.Table(columns=columns, about={"repeats": False, "phases": phases})
    assert timed_gait_of(rows).phases == ()


def test_a_gait_that_hover_cannot_reach_is_refused_with_the_nearest_that_it_can() -> (
    None
):
    with pytest.raises(gg.Infeasible, match="rows are up to 119° away") as refused:
        gg.mission("gait3")
    assert "passes a singular matrix" in str(refused.value)
    nearest = gg.retarget("gait3", sign="positive")
    assert np.degrees(nearest.largest[0]) == pytest.approx(118.7, abs=0.1)
    assert gg.mission(nearest.gait.parametrize(1.0)).check().flyable


def test_what_is_off_the_surfaces_is_entered_straight() -> None:
    biased = gg.lift(LOOP, "red", vehicle=LIMITED).biased(0.9).parametrize(2.0)
    flight = gg.mission(biased)
    entry: Any = flight.sections[1]
    np.testing.assert_allclose(entry.line, [[0] * 4, biased.alpha[0]])
    assert entry.peaks(1).max() <= 6.0 * (1 + 1e-9)
    anyway = gg.mission("gait3", anyway=True)
    straight: Any = anyway.sections[1]
    assert (len(straight.line), straight.period) == (2, 1.0)
    assert not anyway.check().flyable


def test_export_writes_it(run: Any, tmp_path: Path) -> None:
    options = ("--from-hover", "--periods", "3", "--law", "equal-time", "--period", "2")
    written = run("export", "gait4", "out.csv", *options, "--json")
    assert (written.code, written.json["flyable"]) == (0, True)
    table = gg.read_table(tmp_path / "out.csv")
    begins = dict(table.about["phases"])
    assert begins["exit"] - begins["gait"] >= 3 * 2.0
    assert not table.repeats
    refused = run("export", "gait3", "no.csv", "--from-hover")
    assert (refused.code, (tmp_path / "no.csv").exists()) == (1, False)
    sparse = run("export", "gait4", "m.csv", "--from-hover", "--rate", "0.1")
    assert sparse.err.count("set a higher --rate") == 1
    for rate in ("1.5", "1"):
        dense = run("export", "gait4", f"{rate}.csv", "--from-hover", "--rate", rate)
        assert dense.err == ""  # no part is shorter than 1 s


@pytest.mark.parametrize("kind", ["equal-time", "rounded"])
def test_it_is_the_gait_between_entry_and_exit(kind: str, tmp_path: Path) -> None:
    gait = timed(kind)
    flight = gg.mission(gait, periods=3)
    begins = dict(flight.phases)
    assert [*begins] == [*dict.fromkeys(flight.course.phases)]
    inside = np.linspace(0, 3 * gait.period, 500, endpoint=False)
    turns = flight.at(begins["gait"] + inside).alpha
    np.testing.assert_allclose(turns, gait.at(inside).alpha, atol=1e-9)
    first, last = flight.course.gait_times
    runs = [part.period for part in flight.sections if part.phase in RUNS]
    assert last - first == pytest.approx(sum(runs))
    widths = [part.period for part in flight.sections]
    assert np.diff(flight.corner_times) == pytest.approx(widths)
    # A flight from hover is that of the mission.
    t = np.linspace(0, flight.period, 997)
    course: Any = from_hover(gait, periods=3)
    np.testing.assert_array_equal(course.at(t).alpha, flight.at(t).alpha)
    # Its table is read back as the same motion in another time.
    flight.write(tmp_path / "flight.csv")
    slow: Any = timed_gait_of(tmp_path / "flight.csv", period=2 * flight.period)
    np.testing.assert_allclose(slow.at(2 * t).alpha, flight.at(t).alpha, atol=1e-8)
    assert slow.phases == flight.with_period(2 * flight.period).phases


RUNS = ("gait", "run-up", "run-down")
