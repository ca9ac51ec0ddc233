"""Timed gaits: tables close, rates and accelerations are derivatives, peaks have closed forms, limits are judged."""

from __future__ import annotations

from math import ceil, inf, pi, sqrt
from typing import TYPE_CHECKING, Any, get_args

import numpy as np
import pytest
from hypothesis import example, given, settings, strategies as st

import gaitgraph as gg
from gaitgraph.gait.gait import lift
from gaitgraph.timing.laws import LAWS, LawName
from gaitgraph.timing.timed_gait import ROW_BY_ROW, checked_clock, timed_gait_of
from tests.published import GAITS
from tests.samples import on_red, table_from, write_rows

if TYPE_CHECKING:
    from pathlib import Path

angle = st.floats(-1.5, 1.5)
LONG_AND_SHORT = [(0.2, -0.2), (1.2, -0.2), (1.2, -0.4), (0.2, -0.4)]
SQUARE = GAITS[2].angles
SMOOTH = [(15 / 8, 15 / 8), (10 / sqrt(3), 50 / sqrt(3)), (60, 1500)]
JUMPS = [(inf, inf), (inf, inf)]


@settings(deadline=None, max_examples=30)
@example([(0.0, 0.0), (0.0, 7.5e-155), (0.0, 1.0)], "smooth", 1.0, 1)
@given(
    points=st.lists(st.tuples(angle, angle), min_size=1, max_size=6),
    law=st.sampled_from([*LAWS]),
    period=st.floats(0.05, 20),
    samples=st.integers(1, 300),
)
def test_a_table_closes(points: Any, law: LawName, period: float, samples: int) -> None:
    timed = lift(points, "red").parametrize(period, law=law, samples=samples)
    np.testing.assert_allclose(timed.t, np.linspace(0, period, samples + 1))
    for name, values in timed.columns.items():
        assert len(values) == samples + 1
        assert name == "t" or values[0] == values[-1]


@pytest.mark.parametrize("law", LAWS)
def test_rates_and_accelerations_are_the_derivatives(law: LawName) -> None:
    loop = lift([(0.2, -0.3), (0.9, -0.4), (1.2, -1.3)], "red")
    timed = loop.parametrize(2.0, law=law)
    h, t = 1e-4, np.random.default_rng(3).uniform(0.0, 2.0, 60)
    t = t[np.abs(timed.corner_times[:, None] - t).min(axis=0) > 2 * h]
    here, ahead, back = (timed.at(t + shift) for shift in (0.0, h, -h))
    for value, later, earlier in (
        (here.rates, ahead.alpha, back.alpha),
        (here.accelerations, ahead.rates, back.rates),
    ):
        slope = (later - earlier) / (2 * h)
        np.testing.assert_allclose(value, slope, atol=1e-5)
    assert (np.abs(here.rates) <= timed.peaks(1) * (1 + 1e-9)).all()


def test_the_laws_spend_time_as_they_say() -> None:
    assert (*LAWS,) == get_args(LawName)
    gait = lift(LONG_AND_SHORT, "red")
    share = [0, 2.0, 2.4, 4.4, 4.8]
    law: Any
    for law, times in (
        ("equal-time", [0, 1.2, 2.4, 3.6, 4.8]),
        ("constant-speed", share),
        ("smooth", share),
    ):
        np.testing.assert_allclose(gait.parametrize(4.8, law=law).corner_times, times)


@pytest.mark.parametrize(
    ("law", "points", "period", "peaks"),
    [
        # Legs of 1 rad along α1 in 1 s, and of 0.2 rad along α2 in 0.2 s; or each in 0.6 s. Rate, acceleration, jerk.
        ("smooth", LONG_AND_SHORT, 2.4, SMOOTH),
        ("constant-speed", LONG_AND_SHORT, 2.4, [(1, 1), *JUMPS]),
        ("equal-time", LONG_AND_SHORT, 2.4, [(1 / 0.6, 0.2 / 0.6), *JUMPS]),
        # α1 turns back at full speed; α2 goes on evenly, without an impulse.
        ("constant-speed", LONG_AND_SHORT[:2], 1.0, [(2, 0), (inf, 0), (inf, 0)]),
        *((law, [(0.5, -0.6)], 1.0, [(0, 0)] * 3) for law in LAWS),
    ],
)
def test_peaks_have_their_closed_form(
    law: LawName, points: Any, period: float, peaks: Any
) -> None:
    timed = lift(points, "red").parametrize(period, law=law)
    for order, (first, second) in enumerate(peaks, start=1):
        expected = [first, second, first, second]
        np.testing.assert_allclose(timed.peaks(order), expected, rtol=1e-12)


def test_before_the_first_row_it_is_where_it_ends() -> None:
    for law in get_args(LawName):
        gait = lift([(0.5, -0.6), (0.9, -0.6), (0.5, -0.6)], "red")
        timed = gait.parametrize(law=law)  # its last segment has no length
        np.testing.assert_array_equal(timed.at(-1e-300).alpha, timed.alpha[0])


def test_every_time_must_be_finite() -> None:
    timed = lift(SQUARE, "red").parametrize()
    with pytest.raises(gg.InputError, match="^t must be finite times"):
        timed.at([0.5, inf])


@pytest.mark.parametrize("law", LAWS)
def test_the_sheet_of_a_sample_is_that_of_the_corner_last_passed(law: LawName) -> None:
    gait = lift(LONG_AND_SHORT, ["red", "blue", "red", "blue"])
    timed = gait.parametrize(2.4, law=law, samples=12)
    passed = np.searchsorted(timed.corner_times, timed.t, side="right") - 1
    colors = [gait.colors[k % 4] for k in passed]
    assert timed.columns["color"] == colors
    assert colors[:4] == ["red"] * 3 + ["blue"] or law != "equal-time"
    for types, color in zip(timed.columns["types"], colors, strict=True):
        assert "+" not in types or color == "red"
    biased = gait.biased(0.8).parametrize(samples=2)  # off the surfaces
    assert not {"color", "types"} & set(biased.columns)


@pytest.mark.parametrize(
    ("period", "options", "count"),
    [
        (1.0, {}, 100),
        # A rate that does not fit the period is raised so that the table closes.
        (2.0, {"rate": 50}, 100),
        (1.0, {"rate": 2.5}, 3),
        (0.1, {"rate": 1.0}, 1),
        (1e9, {}, 100),
        (1e-6, {"samples": 1}, 1),
        (2.0, {"rate": 5_000_000}, 10_000_000),
        (1.0, {"samples": 10_000_000}, 10_000_000),
    ],
)
def test_samples_by_count_and_by_rate(period: float, options: Any, count: int) -> None:
    assert checked_clock(period, "smooth", **options) == count


def test_a_rate_that_asks_for_too_many_samples_is_refused() -> None:
    with pytest.raises(gg.InputError):
        checked_clock(2.0, "smooth", rate=5_000_001)


@pytest.mark.parametrize(
    ("limits", "needed"),
    [
        ({"max_tilt_rate": 3.0}, 15 / 8 * pi / 3.0),
        ({"max_tilt_acceleration": 40.0}, sqrt(10 / sqrt(3) * 4 * pi / 40.0)),
        ({"max_tilt_jerk": 60 * 16 * pi}, 1.0),
        # Each arm has its own limit.
        ({"max_tilt_rate": [9.0, 9.0, 9.0, 3.0]}, 15 / 8 * pi / 3.0),
    ],
)
def test_limits_decide_flyable_and_the_period_that_they_need_is_told(
    limits: Any, needed: float
) -> None:
    gait = lift(SQUARE, "red", vehicle=gg.PAPER.replace(**limits))
    for factor, flies in ((1.0001, True), (0.999, False)):
        assert gait.parametrize(needed * factor).check().flyable is flies
    report = gait.parametrize(0.9).check()
    (broken,) = [check for check in report.checks if not check.ok]
    assert f"max_{broken.name}" in limits
    told = f"period of at least {ceil(needed * 1000 - 1e-6) / 1000:.3f} s"
    assert (report.valid, told in broken.message) == (True, True)
    names = [check.name for check in report.checks]
    assert ("tilt_jerk" in names) is ("max_tilt_jerk" in limits)


def test_a_law_that_turns_corners_at_full_speed_keeps_no_limit_of_acceleration() -> (
    None
):
    vehicle = gg.PAPER.replace(max_tilt_acceleration=1e6)
    timed = lift(SQUARE, "red", vehicle=vehicle).parametrize(10.0, law="equal-time")
    check = timed.check()["tilt_acceleration"]
    assert (check.ok, check.value) == (False, inf)
    assert "use the law 'smooth'" in check.message


def test_a_file_without_times_is_timed_by_a_period_alone(tmp_path: Path) -> None:
    write_rows(tmp_path / "a.csv", lift(LONG_AND_SHORT[:2], "red").alpha)
    with pytest.raises(gg.InputError, match="has no column t"):
        timed_gait_of(tmp_path / "a.csv")
    timed = timed_gait_of(tmp_path / "a.csv", period=3.0)
    assert (timed.period, timed.samples, len(timed.vertices())) == (3.0, 100, 2)
    assert timed_gait_of(timed, period=4.0).period == 4.0


@pytest.mark.parametrize("ratio", [1.0, 0.5])
def test_rows_that_are_all_corners_keep_their_own_times(ratio: float) -> None:
    """Every law that rests at corners fits the rows of a circle; it would say nothing of the motion between them."""
    t = np.linspace(0.0, 2.0, 101)
    moves = 0.3 * np.cos(pi * t), 0.3 * ratio * np.sin(pi * t)
    timed = timed_gait_of(table_from(on_red(0.8 + moves[0], moves[1] - 0.8), t=t))
    assert timed.law == ROW_BY_ROW
    assert timed.peak_rates.max() == pytest.approx(0.3 * pi, rel=1e-3)
