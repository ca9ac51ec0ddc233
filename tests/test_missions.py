"""Whole flights from hover to hover: continuous, written as they are, read back as the same motion, and flown."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import gaitgraph as gg
from gaitgraph.flight.course import from_hover
from gaitgraph.timing.joining import JoinedPath, played

if TYPE_CHECKING:
    from pathlib import Path

LOOP = [(-0.4, 0.4), (-0.4, 1.2), (-1.2, 1.2), (-1.2, 0.4)]
LIMITED = gg.PAPER.replace(max_tilt_rate=6.0, max_tilt_acceleration=150.0)


def timed(kind: str) -> Any:
    gait = gg.lift(LOOP, "red", vehicle=LIMITED)
    if kind == "paced":
        return gg.least_period(gait).timed
    if kind == "rounded":
        return gg.least_period(gait, rounding="5deg").timed
    law: Any = kind
    return gait.parametrize(2.0, law=law)


KINDS = ["smooth", "equal-time", "constant-speed", "paced", "rounded"]


@pytest.mark.parametrize("kind", KINDS)
def test_it_is_one_motion_from_rest_in_hover_to_rest_in_hover(kind: str) -> None:
    gait = timed(kind)
    flight = gg.mission(gait, periods=3)
    phases = flight.course.phases
    assert phases[0] == phases[-1] == "hover"
    assert (phases[1], phases[-2]) == ("entry", "exit")
    assert phases.count("gait") == 1
    for end in (0.0, flight.period):
        assert not flight.at(end).alpha.any()
        assert not flight.at(end).rates.any()

    t = np.linspace(0, flight.period, 20_001)
    motion, step = flight.at(t), t[1]
    largest = float(np.max(flight.peaks(1)))
    assert np.abs(np.diff(motion.alpha, axis=0)).max() <= largest * step * (1 + 1e-9)
    assert np.abs(motion.rates).max() <= largest + 1e-9
    if kind != "constant-speed":  # turns corners at full speed
        steepest = float(np.max(flight.peaks(2)))
        jumps = np.abs(np.diff(motion.rates, axis=0)).max()
        assert jumps <= steepest * step * (1 + 1e-6)
    # Between the paths it is the gait, three times.
    begins = dict(zip(phases, (at for at, _, _ in flight.course.sections), strict=True))
    inside = np.linspace(0, 3 * gait.period, 500, endpoint=False)
    found = flight.at(begins["gait"] + inside).alpha
    assert found == pytest.approx(gait.at(inside).alpha, abs=1e-9)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("suffix", ["csv", "json", "npz", "mat", "parquet"])
def test_its_table_is_read_back_as_the_same_motion(
    kind: str, suffix: str, tmp_path: Path
) -> None:
    if suffix == "parquet":
        pytest.importorskip("pyarrow")
    flight = gg.mission(timed(kind), periods=2)
    path = tmp_path / f"flight.{suffix}"
    flight.write(path)
    again = played(path)
    assert isinstance(again, JoinedPath)
    t = np.linspace(0, flight.period, 997)
    assert again.at(t).alpha == pytest.approx(flight.at(t).alpha, abs=1e-8)
    assert again.course.phases == flight.course.phases
    table = gg.read_table(path)
    assert table.about["phases"][1][0] == "entry"
    assert gg.validate(path).flyable == flight.check().flyable


def test_a_flight_from_hover_is_that_of_the_mission() -> None:
    gait = timed("paced")
    course = from_hover(gait, periods=3)
    assert not isinstance(course, str)
    flight = gg.mission(gait, periods=3)
    t = np.linspace(0, flight.period, 501)
    assert np.array_equal(course.at(t).alpha, flight.at(t).alpha)


def test_flying_its_table_is_flying_from_hover(run: Any, tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    path = str(tmp_path / "flight.csv")
    assert run("export", "gait4", path, "--from-hover", "--periods", "1").code == 0
    one = run("fly", path, "--json").json
    two = run("fly", "gait4", "--from-hover", "--periods", "1", "--json").json
    assert (one["settled"], two["settled"]) == (True, True)
    for name in ("duration", "attitude", "peak_thrust", "energy"):
        assert one[name] == pytest.approx(two[name], rel=1e-6), name


def test_edited_rows_of_a_mission_are_judged_as_they_stand(tmp_path: Path) -> None:
    path = tmp_path / "flight.csv"
    gg.mission(timed("smooth"), periods=1).write(path)
    lines = path.read_text().splitlines()
    names = lines[0].split(",")
    middle = lines[len(lines) // 2].split(",")
    middle[names.index("alpha1")] = "1.4"
    lines[len(lines) // 2] = ",".join(middle)
    path.write_text("\n".join(lines) + "\n")
    with pytest.warns(gg.errors.FileWarning, match="is not used"):
        report = gg.validate(path)
    assert not report.valid


def test_a_gait_that_hover_cannot_reach_is_refused_with_the_reason() -> None:
    with pytest.raises(gg.Infeasible, match="passes a singular matrix"):
        gg.mission("gait3")
    with pytest.raises(gg.InputError, match="periods must be"):
        gg.mission("gait4", periods=0)


def test_export_writes_it(
    run: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    given = ("export", "gait4", "out.csv", "--from-hover", "--periods", "3")
    result = run(*given, "--law", "equal-time", "--period", "2", "--json")
    assert (result.code, result.json["flyable"]) == (0, True)
    table = gg.read_table(tmp_path / "out.csv")
    names, begins = zip(*table.about["phases"], strict=True)
    gait = names.index("gait")
    assert begins[gait + 1] - begins[gait] == pytest.approx(3 * 2.0)
    assert not table.repeats
    assert run("validate", "out.csv").code == 0
    refused = run("export", "gait3", "no.csv", "--from-hover")
    assert refused.code == 1
    assert "no flyable path from hover" in refused.out + refused.err
    assert not (tmp_path / "no.csv").exists()


def test_the_refusal_names_the_nearest_gait_that_hover_reaches() -> None:
    with pytest.raises(gg.Infeasible, match="rows are up to 119° away") as refused:
        gg.mission("gait3")
    assert 'gg.retarget(gait, sign="positive")' in str(refused.value)
    nearest = gg.retarget("gait3", sign="positive")
    assert np.degrees(nearest.largest[0]) == pytest.approx(118.7, abs=0.1)
    assert gg.mission(nearest.gait.parametrize(1.0)).check().flyable


@pytest.mark.parametrize("rate", [50.0, 47.3, 400.0])
def test_its_rows_fill_whole_frames(rate: float) -> None:
    flight = gg.mission(timed("paced"), rate=rate)
    assert flight.period * rate == pytest.approx(flight.samples, abs=1e-9)
    assert 1.0 <= flight.sections[-1].period < 1.0 + 1.0 / rate
    assert not flight.at(flight.period).alpha.any()
