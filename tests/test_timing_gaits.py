"""Clocks: laws, samples, consistency of angles, rates and accelerations, checks against limits."""

from __future__ import annotations

import re
from functools import cache
from math import inf, pi, sqrt
from typing import Any, get_args

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import gaitgraph as gg
from gaitgraph.errors import shown
from gaitgraph.gait.gait import lift
from gaitgraph.timing.laws import LAWS, LawName
from gaitgraph.timing.timed_gait import (
    ROW_BY_ROW,
    checked_clock,
    timed_gait_of,
)
from tests.published import GAITS

angle = st.floats(-1.5, 1.5)
LONG_AND_SHORT = [(0.2, -0.2), (1.2, -0.2), (1.2, -0.4), (0.2, -0.4)]
loops = st.lists(st.tuples(angle, angle), min_size=1, max_size=6)


@settings(deadline=None, max_examples=30)
@given(
    points=loops,
    law=st.sampled_from([*LAWS]),
    period=st.floats(0.05, 20),
    samples=st.integers(1, 300),
)
def test_a_table_closes(
    points: list[tuple[float, float]], law: LawName, period: float, samples: int
) -> None:
    timed = lift(points, "red").parametrize(period, law=law, samples=samples)
    assert timed.t[0] == 0
    assert timed.t[-1] == period
    assert (np.diff(timed.t) > 0).all()
    for rows in (timed.alpha, timed.rates, timed.accelerations):
        assert rows.shape == (samples + 1, 4)
        np.testing.assert_array_equal(rows[0], rows[-1])
    for name, values in timed.columns.items():
        assert len(values) == samples + 1
        if name != "t":
            assert values[0] == values[-1]


@pytest.mark.parametrize("law", LAWS)
def test_rates_and_accelerations_are_the_derivatives(law: LawName) -> None:
    timed = lift([(0.2, -0.3), (0.9, -0.4), (1.2, -1.3)], "red").parametrize(
        2.0, law=law
    )
    h, t = 1e-4, np.random.default_rng(3).uniform(0.0, 2.0, 60)
    t = t[np.abs(timed.corner_times[:, None] - t).min(axis=0) > 2e-4]
    ahead, back = timed.at(t + h).alpha, timed.at(t - h).alpha
    here, rate, acceleration = timed.at(t)
    np.testing.assert_allclose(rate, (ahead - back) / (2 * h), atol=1e-5)
    np.testing.assert_allclose(
        acceleration, (ahead - 2 * here + back) / h**2, atol=1e-5
    )


def test_the_laws_spend_time_as_they_say() -> None:
    assert (*LAWS,) == get_args(LawName)
    gait = lift(LONG_AND_SHORT, "red")
    np.testing.assert_allclose(
        gait.parametrize(2.0, law="equal-time").corner_times, [0, 0.5, 1, 1.5, 2]
    )
    share = np.array([0, 1.0, 1.2, 2.2, 2.4]) / 2.4
    for law in ("constant-speed", "smooth"):
        np.testing.assert_allclose(
            gait.parametrize(2.0, law=law).corner_times, 2 * share
        )
    speed = np.linalg.norm(gait.parametrize(2.0, law="constant-speed").rates, axis=1)
    np.testing.assert_allclose(speed, gait.length * np.sqrt(2) / 2.0)


@pytest.mark.parametrize(
    ("law", "rates", "accelerations", "jerks"),
    [
        # Legs of 1 rad along α1 in 1 s, and of 0.2 rad along α2 in 0.2 s; or each in 0.6 s.
        ("smooth", (15 / 8, 15 / 8), (10 / sqrt(3), 50 / sqrt(3)), (60, 1500)),
        ("constant-speed", (1.0, 1.0), (inf, inf), (inf, inf)),
        ("equal-time", (1 / 0.6, 0.2 / 0.6), (inf, inf), (inf, inf)),
    ],
)
def test_peaks_have_their_closed_form(
    law: LawName, rates: Any, accelerations: Any, jerks: Any
) -> None:
    timed = lift(LONG_AND_SHORT, "red").parametrize(2.4, law=law)
    for order, expected in enumerate((rates, accelerations, jerks), start=1):
        np.testing.assert_allclose(
            timed.peaks(order), [*expected, *expected], rtol=1e-12
        )


def test_an_angle_that_keeps_its_rate_through_corners_has_no_impulse() -> None:
    # α1 turns back at full speed; α2 goes on evenly, and would at any straight corner.
    timed = lift([(0.2, -0.2), (0.7, -0.2), (1.2, -0.2)], "red").parametrize(
        law="constant-speed"
    )
    assert (
        timed.peak_accelerations.tolist() == timed.peaks(3).tolist() == [inf, 0, inf, 0]
    )
    np.testing.assert_allclose(timed.peak_rates, [2, 0, 2, 0])


@pytest.mark.parametrize("law", LAWS)
def test_the_sheet_of_a_sample_is_that_of_the_corner_last_passed(law: LawName) -> None:
    gait = lift(LONG_AND_SHORT, ["red", "blue", "red", "blue"])
    timed = gait.parametrize(2.4, law=law, samples=12)
    columns = timed.columns
    passed = [int(np.flatnonzero(timed.corner_times <= t)[-1]) % 4 for t in timed.t]
    assert columns["color"] == [gait.colors[k] for k in passed]
    assert law != "equal-time" or passed == [0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3, 3, 0]
    blue = {
        types
        for types, color in zip(columns["types"], columns["color"], strict=True)
        if color == "blue"
    }
    assert blue <= {"(-,-)", "(?,-)", "(-,?)", "(?,?)"}
    assert not {"color", "types"} & set(
        gait.biased(0.8).parametrize(samples=2).columns
    )  # off the surfaces


def test_a_gait_that_is_a_point_stands_still() -> None:
    for law in get_args(LawName):
        timed = lift([(0.5, -0.6)], "red").parametrize(law=law, samples=3)
        assert np.ptp(timed.alpha, axis=0).max() == 0
        assert timed.peak_rates.max() == timed.peak_accelerations.max() == 0
        assert timed.check().flyable
        timed = lift([(0.5, -0.6), (0.9, -0.6), (0.5, -0.6)], "red").parametrize(
            law=law
        )
        np.testing.assert_array_equal(
            timed.at(-1e-300).alpha, timed.alpha[0]
        )  # the last segment has no length


@cache
def gaits_of_every_kind() -> tuple[list[Any], Any]:
    timed: Any = lift(GAITS[2].angles, "red").parametrize()
    paced: Any = gg.paced(timed.gait, gg.Limits(rate=50.0, acceleration=500.0))
    optimal: Any = gg.optimal_gait(timed.gait.alpha[:, :2], pieces=12)
    return [timed, paced.timed, optimal.timed()], optimal


@pytest.mark.parametrize(
    "wrong",
    ["a", [[0.1], [0.2, 0.3]], None, 10**400, [0.0, inf], np.array([0.1, np.nan])],
)
def test_times_are_finite_numbers(wrong: Any) -> None:
    gaits, optimal = gaits_of_every_kind()
    for one in gaits:
        with pytest.raises(
            gg.errors.InputError,
            match=f"^{re.escape(f't must be finite times, got {shown(wrong)}')}$",
        ):
            one.at(wrong)
    with pytest.raises(gg.errors.InputError, match="s must be finite parameters, got "):
        optimal.curve.at(wrong)


def test_samples_by_count_and_by_rate() -> None:
    gait = lift(GAITS[2].angles, "red")
    default = gait.parametrize()
    assert (default.period, default.law, default.samples) == (1.0, "smooth", 100)
    # A rate that does not fit the period is raised so that the table closes.
    assert [
        gait.parametrize(T, rate=rate).samples
        for T, rate in ((2.0, 50), (0.3, 10), (1.0, 2.5))
    ] == [100, 3, 3]
    assert [checked_clock(period, "smooth") for period in (1e-6, 1e9)] == [100, 100]
    assert [checked_clock(1.0, "smooth", samples=n) for n in (1, 10_000_000)] == [
        1,
        10_000_000,
    ]
    assert checked_clock(2.0, "smooth", rate=5_000_000) == 10_000_000


def test_limits_of_rates_decide_flyable_and_name_the_period_needed() -> None:
    points, slow = (
        GAITS[2].angles,
        gg.PAPER.replace(max_tilt_rate=3.0, max_tilt_acceleration=40.0),
    )
    timed = lift(points, "red", vehicle=slow).parametrize(1.0)
    report = timed.check()
    assert (report.valid, report.flyable) == (True, False)
    peak = 15 / 8 * (pi / 4) / 0.25
    rate, acceleration = report["tilt_rate"], report["tilt_acceleration"]
    assert rate.value == pytest.approx(peak)
    assert (
        f"(α1), limit 3: this law needs a period of at least {np.ceil(peak / 3 * 1000) / 1000:.3f} s"
        in rate.message
    )
    assert (
        "a duration of at least 0.982 s"
        in timed.rate_checks("duration", 0.5)[0].message
    )
    assert (
        "(α2)"
        in lift([(0.4, -0.9), (0.5, -0.4)], "red", vehicle=slow)
        .parametrize(5.0)
        .rate_checks()[0]
        .message
    )
    # The period that the message names is enough, and a little less is not; so it is under a jerk limit.
    needed = max(peak / 3.0, np.sqrt(acceleration.value / 40.0))  # type: ignore[operator]
    jerky = gg.PAPER.replace(max_tilt_jerk=60 * (pi / 4) / 0.25**3)
    for vehicle, least in ((slow, needed), (jerky, 1.0)):
        for factor, ok in ((1.0001, True), (0.999, False)):
            report = (
                lift(points, "red", vehicle=vehicle).parametrize(least * factor).check()
            )
            assert report.flyable is ok
    assert not report["tilt_jerk"].ok
    assert "at least 1.000 s" in report["tilt_jerk"].message
    corner = (
        lift(points, "red", vehicle=slow)
        .parametrize(10.0, law="equal-time")
        .rate_checks()[1]
    )
    assert "use the law 'smooth'" in corner.message


@pytest.mark.parametrize("ratio", [1.0, 0.5])
def test_rows_that_are_all_corners_keep_their_own_times(ratio: float) -> None:
    """Every law that rests at corners fits the rows of a circle; it would say nothing of the motion between them."""
    t = np.linspace(0.0, 2.0, 101)
    alpha1, alpha2 = 0.8 + 0.3 * np.cos(pi * t), -0.8 + 0.3 * ratio * np.sin(pi * t)
    columns = dict(
        zip(
            ("t", "alpha1", "alpha2", "alpha3", "alpha4"),
            (t, alpha1, alpha2, alpha1, alpha2),
            strict=True,
        )
    )
    timed = timed_gait_of(gg.Table(columns=columns))
    assert timed.law == ROW_BY_ROW
    assert timed.peak_rates.max() == pytest.approx(0.3 * pi, rel=1e-3)
