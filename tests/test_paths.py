"""Motions that are run once, and other timings and samplings of tables that were made for limits."""

from __future__ import annotations

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
from gaitgraph.timing.timed_gait import timed_gait_of
from tests.samples import table_from

if TYPE_CHECKING:
    from pathlib import Path

LOOP = [(-0.4, 0.4), (-0.4, 1.2), (-1.2, 1.2), (-1.2, 0.4)]
GAIT = gg.lift(LOOP, "red")
ENTRY = gg.transition("hover", GAIT, duration=1.0)
END = ENTRY.path[-1]
LIMITS = gg.timing.Limits(rate=6, acceleration=150)
SLOW = gg.timing.Limits(rate=3, acceleration=150)


@pytest.fixture
def entry(tmp_path: Path) -> Path:
    path = tmp_path / "entry.csv"
    ENTRY.write(path)
    return path


# Paths


def test_a_path_is_judged_without_the_way_back(entry: Path) -> None:
    table = gg.read_table(entry)
    closed = gg.validate(gg.Table(columns=table.columns))
    assert closed.as_mapping()["repeats"] is True
    assert closed["tilt_rate"].value == pytest.approx(40.0, rel=0.1)  # in one step
    assert any("a path that is run once" in note for note in closed.notes)
    for report in (gg.validate(table), gg.validate(ENTRY), ENTRY.timed.check()):
        assert report.flyable
        assert report.as_mapping()["repeats"] is False
        assert report.listing is None  # colourings are of loops
        assert report["tilt_rate"].value == pytest.approx(0.75, rel=1e-3)


def test_rows_of_ones_own_are_a_path_if_that_is_said(run: Any, tmp_path: Path) -> None:
    t = np.linspace(0, 1, 40)
    rows = np.column_stack([-0.4 * t, 0.4 * t**2] * 2)
    table = table_from(rows, t=t)
    path = table.once()
    assert path.once() is path
    timed: Any = timed_gait_of(path)
    np.testing.assert_allclose(timed.at(t).alpha, rows, atol=1e-12)
    np.testing.assert_allclose(timed.at(5.0).alpha, rows[-1], atol=1e-12)
    gg.io.write_tables(table, [tmp_path / "own.csv"])
    assert run("validate", "own.csv", "--once", "--json").json["repeats"] is False
    assert run("export", "own.csv", "e.csv", "--once", "--rate", 50).code == 0
    written = gg.read_table(tmp_path / "e.csv")
    assert (written.repeats, len(written)) == (False, 51)


@pytest.mark.parametrize("law", ["smooth", "constant-speed"])
@pytest.mark.parametrize("duration", [None, 2.0])
def test_a_path_gets_another_timing(
    law: Any, duration: float | None, entry: Path
) -> None:
    table = export(entry, [], law=law, period=duration, samples=50).table
    assert (len(table), table["t"][-1]) == (51, pytest.approx(duration or 1.0))
    np.testing.assert_allclose(table.alpha[-1], END, atol=1e-12)
    ends = np.abs([table[name][[0, -1]] for name in RATES])
    assert (ends.max() < 1e-9) == (law == "smooth")


@pytest.mark.parametrize(
    "of_gaits",
    [
        gg.gait_of,
        gg.retarget,
        gg.least_period,
        lambda path: gg.transition(path, "hover"),
        lambda path: gg.transition("hover", path),
        basins_of,
        from_hover,
    ],
)
def test_what_is_of_gaits_alone_refuses_a_path(of_gaits: Any, entry: Path) -> None:
    for path in (entry, gg.read_table(entry), ENTRY):
        with pytest.raises(gg.errors.GaitgraphError, match="path that is run once"):
            of_gaits(path)


@pytest.mark.parametrize("wrong", [0, "false", None])
def test_what_repeats_is_said_by_true_or_false(wrong: Any) -> None:
    columns = {"alpha1": [0.0, 0.3]}
    with pytest.raises(gg.InputError, match="^repeats must be true or false"):
        gg.Table(columns=columns, about={"repeats": wrong})
    assert not gg.Table(columns=columns, about={"repeats": np.False_}).repeats


# Tables that were made for limits


@cache
def paced_gait(rounding: str | None = None, rate: float = 6.0) -> gg.timing.LimitedGait:
    limits = gg.timing.Limits(rate=rate, acceleration=150)
    timed = gg.least_period(GAIT, limits, rounding=rounding).timed
    assert timed is not None
    return timed


@pytest.fixture
def fast(tmp_path: Path) -> Path:
    paced_gait().write(tmp_path / "fast.csv")
    return tmp_path / "fast.csv"


def test_once_keeps_the_rows_and_rates_of_a_gait(fast: Path) -> None:
    gait = gg.read_table(fast)
    path = gait.once()
    assert (path.repeats, path.limits) == (False, gait.limits)
    kept = export(path, [fast.with_name("e.h")]).table
    for name in (*RATES, "alpha1_acceleration"):
        np.testing.assert_array_equal(kept[name], gait[name])
    assert "cubic" in fast.with_name("e.h").read_text()
    fine = export(path, [], samples=1000).table
    between = paced_gait().at(fine["t"]).alpha
    np.testing.assert_allclose(fine.alpha, between, atol=1e-3)


@pytest.mark.parametrize(("rounding", "suffix"), [(None, ".csv"), ("2deg", ".json")])
def test_another_sampling_of_a_paced_table_keeps_its_limits_and_its_law(
    rounding: str | None, suffix: str, tmp_path: Path
) -> None:
    paced = paced_gait(rounding)
    source, other = tmp_path / f"fast{suffix}", tmp_path / f"e{suffix}"
    paced.write(source)
    for slower, timing in ((2, {"period": 2 * paced.period}), (1, {"rate": 50.0})):
        export(source, other, force=True, **timing)  # type: ignore[arg-type]
        written = gg.read_table(other)
        assert written.limits == {"rate": (6.0,) * 4, "acceleration": (150.0,) * 4}
        assert written.about["samples"] == len(written) - 1
        report = gg.validate(written)
        assert report.flyable, report.reason
        peak: Any = report["tilt_rate"].value
        assert 5.5 < peak * slower <= 6.0 * (1 + 1e-6)
        at = paced.at(written["t"] / slower).alpha
        np.testing.assert_allclose(written.alpha, at, atol=1e-6)
    # The same period is found again, also from another sampling.
    for path in (source, other):
        again = gg.least_period(path)
        assert again.period == pytest.approx(paced.period, rel=1e-9)
    slow = gg.timing.paced(other, SLOW)
    expected = paced_gait(rounding, rate=3.0).period
    assert slow.least == pytest.approx(expected, rel=1e-9)


def test_pace_keeps_the_limits_and_the_rounding_of_a_table(
    run: Any, tmp_path: Path
) -> None:
    paced_gait("2deg").write(tmp_path / "r.csv")
    again = run("pace", "r.csv", "--json").json
    assert again["limits"] == {"rate": 6.0, "acceleration": 150.0}
    assert again["rounding"]["tolerance"] == pytest.approx(np.radians(2))
    sharper = run("pace", "r.csv", "--rounding", "1deg", "--json").json
    assert sharper["rounding"]["tolerance"] == pytest.approx(np.radians(1))


def test_a_new_timing_says_its_peaks_and_a_rate_that_does_not_fit(
    run: Any, fast: Path
) -> None:
    done = run("export", fast.name, "e.csv", "--period", 1.01, "--rate", 50)
    assert f"peak {6 * paced_gait().period / 1.01:.3g} rad/s" in done.out
    assert "50.495 rows per second, not 50" in done.err
    done = run("export", "gait3", "two.csv", "--period", 1.0, "--rate", 0.7)
    assert "1 rows per second, not 0.7" in done.err


@pytest.mark.parametrize("option", ["--law smooth", "--period 0.5"])
@pytest.mark.parametrize("stated", [None, 7.0])
def test_a_timing_that_breaks_limits_is_not_written_unless_anyway(
    option: str, stated: float | None, run: Any, tmp_path: Path
) -> None:
    """The limits of the table count also where those of its vehicle are higher."""
    gait = replace(GAIT, vehicle=gg.PAPER.replace(max_tilt_rate=stated))
    timed: Any = gg.least_period(gait, LIMITS).timed
    timed.write(tmp_path / "fast.csv")
    asked = ["export", "fast.csv", "e.csv", *option.split()]
    done = run(*asked)
    assert done.code == 1
    assert "nothing is written, since the motion is not flyable: peak " in done.err
    assert not (tmp_path / "e.csv").exists()
    forced = run(*asked, "--anyway", "--json").json
    (broken,) = [check for check in forced["rate_checks"] if not check["ok"]][:1]
    assert (broken["name"], broken["limit"]) == ("tilt_rate", 6.0)
    assert run("validate", "e.csv").code == 1
