"""Least periods: closed forms, an independent linear programme, certain limits between samples, and answers."""

from __future__ import annotations

import itertools
from dataclasses import replace
from math import pi, sqrt
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.optimize import linprog

import gaitgraph as gg
from gaitgraph.gait.gait import lift
from gaitgraph.timing import time_optimal
from gaitgraph.timing.limits import Limits, limits_of
from gaitgraph.timing.node_laws import fastest_squared_speeds
from gaitgraph.timing.timed_gait import table_of
from tests.published import GAITS

if TYPE_CHECKING:
    from pathlib import Path

# Their answers have a law here, which types cannot know.
least_period: Any = time_optimal.least_period
paced: Any = time_optimal.paced

SQUARE = lift(GAITS[2].angles, "red")
SLANTED = lift([(0.4, -0.4), (1.2, -0.8)], "red")
SHORT = lift([(0.5, -0.5), (0.5001, -0.5)], "red")
ALONG = lift([(0.4, -0.4), (1.2, -0.4)], "red")
FAST = {"rate": 6.0, "acceleration": 60.0}
LIMITS = Limits(**FAST)
JERKY = Limits(acceleration=60, jerk=2000)
KINDS = ("rate", "acceleration", "jerk")


def check_lawful(answer: Any) -> None:
    """Check that a law keeps its limits between samples too, meets one, and goes on through knots and seam."""
    timed = answer.timed
    knots = timed.corner_times
    middles = (knots[:-1] + knots[1:]) / 2
    t = np.concatenate([np.linspace(0, timed.period, 20_001), knots, middles])
    for order, kind in enumerate(KINDS, start=1):
        values = np.abs(timed.derivative(t, order)).max(axis=0)
        peaks, limit = timed.peaks(order), getattr(answer.limits, kind)
        assert (values <= peaks * (1 + 1e-9) + 1e-9).all()
        assert limit is None or (peaks <= np.multiply(limit, 1 + 1e-9) + 1e-12).all()
    width = np.diff(knots)
    step = 1e-6 * np.minimum(width, np.roll(width, 1))
    for order in range(3):
        after = timed.derivative(knots[:-1], order)
        before = timed.derivative(knots[:-1] - step, order)
        most = 2 * timed.peaks(order + 1) * step[:, None]
        assert (np.abs(after - before) <= most + 1e-9 * (1 + timed.peaks(order))).all()
    assert timed.limits_touched(1e-6) or answer.timed.law == "paced"
    assert answer.lower_bound <= timed.period * (1 + 1e-9)


# -- The least period


@pytest.mark.parametrize("gait", [ALONG, SLANTED])
@pytest.mark.parametrize(
    ("limits", "exact"),
    [
        # Over 0.8 rad the rate is reached or not: 2(d/v + v/a), or 4√(d/a).
        ({"rate": 6.0, "acceleration": 60.0}, 2 * (0.8 / 6 + 6 / 60)),
        ({"rate": 1.0, "acceleration": 3.0}, 2 * (0.8 + 1 / 3)),
        ({"rate": 6.0, "acceleration": 3.0}, 4 * sqrt(0.8 / 3)),
        ({"acceleration": 60.0}, 4 * sqrt(0.8 / 60)),
        # The periodic motion of largest extent for a given jerk has a jerk of constant size: T³ = 96·extent/jerk.
        ({"jerk": 800.0}, (96 * 0.8 / 800) ** (1 / 3)),
    ],
)
def test_forth_and_back_takes_the_time_of_the_closed_form(
    gait: gg.Gait, limits: dict[str, Any], exact: float
) -> None:
    answer = least_period(gait, Limits(**limits))
    assert answer.lower_bound == pytest.approx(exact)
    assert exact <= answer.least <= exact * 1.003
    check_lawful(answer)


LEG = pi / 4


@pytest.mark.parametrize(
    ("limits", "each"),
    [
        # The rate is reached: d/v + v/a + a/j. The acceleration is, the rate is not: 2√((a/2j)² + d/a) + a/j.
        (
            {"rate": 6.0, "acceleration": 60.0, "jerk": 3000.0},
            LEG / 6 + 6 / 60 + 60 / 3000,
        ),
        ({"acceleration": 60.0, "jerk": 3000.0}, 2 * sqrt(0.01**2 + LEG / 60) + 0.02),
        # Neither is: 4∛(d/2j). The rate is, the acceleration is not: d/v + 2√(v/j).
        ({"jerk": 800.0}, 4 * (LEG / 1600) ** (1 / 3)),
        ({"rate": 2.0, "jerk": 800.0}, LEG / 2 + 2 * sqrt(2 / 800)),
        # Without a jerk limit the acceleration takes a thousandth of the time to rise.
        ({"rate": 6.0, "acceleration": 60.0}, 1.001 * (LEG / 6 + 6 / 60)),
    ],
)
def test_legs_from_rest_to_rest_have_their_closed_form(
    limits: dict[str, Any], each: float
) -> None:
    answer = least_period(SQUARE, Limits(**limits))
    assert answer.least == pytest.approx(4 * each, rel=1e-11)
    check_lawful(answer)
    angles, rates, _ = answer.timed.at(np.arange(4) * answer.least / 4)
    np.testing.assert_allclose(angles, SQUARE.alpha, atol=1e-9)
    np.testing.assert_allclose(rates, 0, atol=1e-6)


@pytest.mark.parametrize(
    ("limits", "least"),
    [
        # Limits far apart: what is brief beyond floats takes a millionth of the time.
        ({"rate": 1e-8, "acceleration": 1e12}, pi * 1e8),
        ({"rate": 1e-8, "jerk": 1e12}, pi * 1e8),
        ({"acceleration": 1e-9, "jerk": 1e12}, 8 * sqrt(LEG * 1e9)),
    ],
)
def test_limits_may_be_far_apart(limits: dict[str, Any], least: float) -> None:
    assert least_period(SQUARE, Limits(**limits)).least == pytest.approx(least, 1e-5)


@settings(deadline=None, max_examples=8)
@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(8, 40),
    rate=st.sampled_from([np.inf, 3.0]),
)
def test_no_other_speeds_within_the_limits_are_larger_anywhere(
    seed: int, n: int, rate: float
) -> None:
    """The largest solution point by point, against a linear programme over the very same rows."""
    random = np.random.default_rng(seed)
    width, limits = random.uniform(0.02, 0.2, n), random.uniform(0.5, 2, 2)
    first, second = random.normal(size=(2, n, 2)) * [[[1]], [[3]]]
    first, second = np.vstack([first, first[:1]]), np.vstack([second, second[:1]])
    b = fastest_squared_speeds(first, second, width, np.full(2, rate), limits)
    rows, right = [], []
    highest = np.minimum(1e12, (rate / np.abs(first[:-1])).min(axis=1) ** 2)
    for k, node, joint in itertools.product(range(n), (0, 1), (0, 1)):
        ends = [k, (k + 1) % n]
        row = np.zeros(n)
        row[ends] = np.array([-1, 1]) * first[k + node, joint] / (2 * width[k])
        row[ends[node]] += second[k + node, joint]
        if row[ends].prod() > 0:
            # A row that bounds a sum is replaced by bounds of each.
            most = limits[joint] / abs(row[ends].sum())
            highest[ends] = np.minimum(highest[ends], most)
        else:
            rows += [row, -row]
            right += [limits[joint]] * 2
    box: Any = np.column_stack([np.zeros(n), highest])
    best: Any = linprog(-np.ones(n), A_ub=np.array(rows), b_ub=right, bounds=box)
    np.testing.assert_allclose(b[:-1], best.x, rtol=1e-5, atol=1e-7)


@settings(deadline=None, max_examples=6)
@given(
    points=st.lists(
        st.tuples(st.floats(0.3, 1.3), st.floats(-1.3, -0.3)), min_size=1, max_size=6
    ),
    rounding=st.sampled_from([None, 1e-4, 0.01, 0.2]),
    limits=st.sampled_from(
        [
            {"rate": 4.0, "acceleration": 30.0},
            {"rate": [1.0, 2.0, 3.0, 4.0], "acceleration": [10.0, 80.0, 20.0, 40.0]},
            {"jerk": 500.0},
            {"rate": 2.0, "acceleration": 20.0, "jerk": 1000.0},
        ]
    ),
)
def test_every_law_is_smooth_closed_and_within_its_limits(
    points: Any, rounding: Any, limits: Any
) -> None:
    gait = lift(points, "red")
    answer = least_period(gait, Limits(**limits), rounding=rounding, nodes=50)
    if answer:
        check_lawful(answer)
    else:
        assert (answer.status, answer.least) == ("still", 0.0)


def test_a_low_limit_of_rate_is_met_nearly_everywhere_under_a_jerk_limit_too() -> None:
    answer = least_period(SQUARE, Limits(rate=1.0, jerk=3000.0), rounding=0.05)
    check_lawful(answer)
    assert answer.least <= 1.03 * answer.lower_bound


@settings(deadline=None, max_examples=20)
@given(seed=st.integers(0, 2**32 - 1), harmonics=st.integers(1, 6))
def test_the_limits_that_follow_hold_for_periodic_motions(
    seed: int, harmonics: int
) -> None:
    """Landau's and Kolmogorov's inequalities, on random trigonometric polynomials."""
    random = np.random.default_rng(seed)
    k = np.arange(1, harmonics + 1)
    size = random.normal(size=harmonics) / k**2
    phase = np.linspace(0, 2 * pi, 5000)[:, None] * k + random.uniform(0, 7, harmonics)
    waves = [np.cos(phase + order * pi / 2) @ (size * k**order) for order in range(4)]
    rate, acceleration, jerk = (np.abs(values).max() for values in waves[1:])
    for limits in (
        Limits(jerk=jerk),
        Limits(rate=rate, jerk=jerk),
        Limits(acceleration=acceleration),
    ):
        completed = limits.completed(np.full(2, np.ptp(waves[0])))[:, 0] * 1.001
        assert ([rate, acceleration, jerk] <= completed).all()


# -- A period that is asked for, and other answers


def test_a_period_is_met_by_scaling_or_refused_with_the_limit_and_the_place() -> None:
    fast = least_period(SQUARE, LIMITS, rounding=0.03)
    slow = paced(SQUARE, LIMITS, period=1.0, rounding=0.03, rate=200)
    check_lawful(slow)
    assert (slow.period, slow.timed.samples, slow.timed.law) == (1.0, 200, "paced")
    for order in (1, 2, 3):
        scaled = fast.timed.peaks(order) * fast.least**order
        np.testing.assert_allclose(slow.timed.peaks(order), scaled)
    assert paced(SQUARE, LIMITS, period=fast.least, rounding=0.03)
    short = paced(SQUARE, LIMITS, period=0.7, rounding=0.03)
    assert (short.status, short.limit) == ("too short", "acceleration")
    reached = 60 * (fast.least / 0.7) ** 2
    assert f"would reach {reached:.3g} rad/s², limit 60" in short.reason
    # Below the lower bound it is certain.
    below = paced(SQUARE, LIMITS, period=0.9 * fast.lower_bound, rounding=0.03)
    assert f"needs at least {fast.lower_bound:.4f} s" in below.reason
    framed = least_period(SQUARE, LIMITS, rate=100)
    assert framed.period * 100 == pytest.approx(framed.timed.samples)
    assert framed.least <= framed.period <= framed.least + 0.01


@pytest.mark.parametrize(("tolerance", "rests"), [(1e-5, True), (0.03, False)])
def test_rounding_is_never_slower_than_resting_at_the_corners(
    monkeypatch: pytest.MonkeyPatch, tolerance: float, rests: bool
) -> None:
    if rests:  # without programmes it is quick
        monkeypatch.setattr(time_optimal, "_MOST_NODES_UNDER_JERK", 0)
    resting = least_period(SQUARE, JERKY)
    both = least_period(SQUARE, JERKY, rounding=tolerance, nodes=50)
    assert both.at_rest == resting.least
    assert (both.least == resting.least) is rests
    assert both.least <= resting.least
    assert both.lower_bound <= resting.lower_bound
    assert (both.rounding is None, both.note.startswith("rests")) == (rests, rests)
    check_lawful(both)


def test_work_under_a_jerk_limit_reports_and_is_bounded(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: Any = {"rounding": 0.03, "nodes": 50}
    for most, optimised in ((5000, True), (60, False)):
        monkeypatch.setattr(time_optimal, "_MOST_NODES_UNDER_JERK", most)
        lines: list[str] = []
        answer = least_period(SQUARE, JERKY, progress=lines.append, **asked)
        assert any("programme 1 under" in line for line in lines) is optimised
        assert ("not optimised" in answer.note) is not optimised
        check_lawful(answer)


NO_RATE = {"rate": [6, 6, 0, 6], "acceleration": 60}


ONE_RATE = {"rate": [6, 0, 6, 0], "acceleration": 60}


POINT = lift([(0.5, -0.5)], "red")


ROUNDED: dict[str, Any] = {"rounding": 0.03}


@pytest.mark.parametrize(
    ("gait", "limits", "options", "status", "told"),
    [
        (SQUARE, {"rate": 1e-9, "acceleration": 1e12}, {}, "no period", "above 1e9 s"),
        (SQUARE, {"rate": 1e-9, "jerk": 1e-9}, ROUNDED, "no period", "above 1e9 s"),
        (SHORT, {"acceleration": 1e12}, {}, "no period", "below 1e-6 s"),
        (SQUARE, NO_RATE, {}, "no period", "limit 0 of α3"),
        (ALONG, ONE_RATE, {}, "ok", ""),
        (POINT, {"acceleration": 60}, {}, "still", "is a point"),
    ],
)
def test_answers_without_a_period_say_why(
    gait: gg.Gait, limits: Any, options: Any, status: str, told: str
) -> None:
    answer = least_period(gait, Limits(**limits), **options)
    assert (answer.status, bool(answer)) == (status, status == "ok")
    assert told in answer.reason
    assert answer.where is None or answer.where["alpha"] == gait.alpha[1].tolist()
    if answer:
        assert 0.0 not in [touch.value for touch in answer.timed.limits_touched()]
    still = paced(gait, Limits(**limits), period=2.0, **options)
    assert (still.timed is not None) is (status != "no period")


# -- The law as a timed gait


def test_touched_limits_are_where_the_law_runs_at_them() -> None:
    timed = least_period(SQUARE, LIMITS, rounding=0.03).timed
    touches = timed.limits_touched()
    t = (np.arange(20_000) + 0.5) * timed.period / 20_000
    at_some = np.zeros(len(t), dtype=bool)
    for touch in touches:
        order, joint = 1 + KINDS.index(touch.limit), touch.joints[0] - 1
        values = np.abs(timed.derivative(t, order)[:, joint])
        at_limit = values >= 0.99 * touch.value
        assert touch.share == pytest.approx(at_limit.mean(), abs=0.01)
        first = np.abs(timed.derivative(touch.where["t"], order)[joint])
        assert first >= 0.9 * touch.value
        at_some |= at_limit
    pairs = {(touch.limit, *touch.joints) for touch in touches}
    assert len(pairs) == len(touches) == 4
    assert at_some.mean() > 0.95  # the fastest law is at some limit nearly always


def test_a_paced_gait_is_a_timed_gait() -> None:
    limits: Any = dict(zip(NAMES, (6.0, 60.0, 1e4), strict=True))
    gait = lift(GAITS[2].angles, "red", vehicle=gg.PAPER.replace(**limits))
    answer = least_period(gait, rounding="2deg", samples=40)
    timed, plain = answer.timed, answer.as_mapping()
    table, report = table_of(timed), timed.check()
    assert (len(table), table.about["law"]) == (41, "least-period")
    assert report.flyable
    assert {f"max_{check.name}" for check in report.checks} > {*NAMES}
    faster = replace(timed, period=0.9 * timed.period, widths=0.9 * timed.widths)
    assert not faster.check().flyable
    assert plain["peak_rate"] == timed.peaks(1).max()
    # Vertices need corners: a rounded loop has none, and the gait itself has four.
    assert len(timed.vertices()) == 0
    assert len(least_period(gait).timed.vertices()) == 4


NAMES = ("max_tilt_rate", "max_tilt_acceleration", "max_tilt_jerk")


def test_limits_come_from_the_vehicle_and_from_texts() -> None:
    vehicle = gg.PAPER.replace(max_tilt_rate="200deg", max_tilt_acceleration=40.0)
    plain = limits_of(vehicle, acceleration="1000deg").as_mapping()
    expected = {"rate": np.radians(200), "acceleration": np.radians(1000)}
    assert plain == pytest.approx(expected)
    uneven = Limits(acceleration=[1, 2, 3, 1])
    assert uneven.as_mapping() == {"acceleration": [1.0, 2.0, 3.0, 1.0]}
    np.testing.assert_array_equal(uneven.of_joints(2)[1], [1, 1])


@pytest.mark.parametrize(
    ("vehicle", "options", "proposed"),
    [
        ("max_tilt_rate = 6.0\nservo_lag = 0.05", [], "120"),
        ("servo_lag = 0.04", ["--max-rate", "6"], "150"),
        ("max_tilt_rate = [9, 4, 8, 8]\nservo_lag = [0.1, 0.05, 0.05, 0.2]", [], "40"),
        ("max_tilt_rate = 6.0", [], None),
    ],
)
def test_an_acceleration_that_is_not_known_is_proposed(
    vehicle: str, options: list[str], proposed: str | None, run: Any, tmp_path: Path
) -> None:
    (tmp_path / "mine.toml").write_text(f'preset = "paper"\n{vehicle}\n')
    refused = run("pace", "gait4", "--vehicle", "mine.toml", *options)
    assert (refused.code, refused.out) == (2, "")
    ending = "(--max-rate over servo_lag)\n"
    if proposed is not None:
        ending = f", --max-acceleration {proposed}\n"
    assert refused.err.endswith(ending)
