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
from gaitgraph.timing.curve import rounded
from gaitgraph.timing.limits import Limits, limits_of
from gaitgraph.timing.node_laws import fastest_squared_speeds, grid_along
from gaitgraph.timing.polynomials import derivative_of
from gaitgraph.timing.timed_gait import table_of
from tests.published import GAITS

if TYPE_CHECKING:
    from pathlib import Path

    from gaitgraph.timing.limited_gait import LimitedGait

# Their answers have a law here, which types cannot know.
least_period: Any = time_optimal.least_period
paced: Any = time_optimal.paced

SQUARE = lift(GAITS[2].angles, "red")
FORTH_AND_BACK = lift([(0.4, -0.4), (1.2, -0.4)], "red")
TRIANGLE = [(0.4, -1.2), (0.4, -0.4), (1.2, -0.4)]
SLANTED = lift([(0.4, -0.4), (1.2, -0.8)], "red")
LIMITS = Limits(rate=6.0, acceleration=60.0)


def assert_lawful(found: Any) -> LimitedGait:
    """The law keeps the limits, sampled densely by itself and by its peaks, and is smooth at knots and the seam."""
    timed: LimitedGait = found.timed
    knots = timed.corner_times
    t = np.unique(
        np.concatenate(
            [np.linspace(0, timed.period, 20_001), knots, (knots[:-1] + knots[1:]) / 2]
        )
    )
    for order, kind in enumerate(("rate", "acceleration", "jerk"), start=1):
        values = np.abs(timed.derivative(t, order)).max(axis=0)
        peaks, limit = timed.peaks(order), getattr(found.limits, kind)
        assert (values <= peaks * (1 + 1e-9) + 1e-9).all()
        if limit is not None:
            assert (np.maximum(peaks, values) <= limit * (1 + 1e-9) + 1e-12).all()
    h = np.diff(knots)
    step = 1e-6 * np.minimum(h, np.roll(h, 1))
    for order in range(3):
        after, before = (
            timed.derivative(knots[:-1] - shift, order) for shift in (0.0, step)
        )
        allowed = 2 * timed.peaks(order + 1) * step[:, None] + 1e-9 * (
            1 + timed.peaks(order)
        )
        assert (np.abs(after - before) <= allowed).all()
    np.testing.assert_array_equal(timed.alpha[0], timed.alpha[-1])
    return timed


@pytest.mark.parametrize("gait", [FORTH_AND_BACK, SLANTED], ids=["along", "slanted"])
@pytest.mark.parametrize(
    ("limits", "exact"),
    [
        # Over 0.8 rad the rate is reached or not: 2(d/v + v/a), or 4√(d/a).
        *(
            ({"rate": v, "acceleration": 60.0}, 2 * (0.8 / v + v / 60))
            for v in (6.0, 1.0)
        ),
        ({"rate": 1.0, "acceleration": 3.0}, 2 * (0.8 + 1 / 3)),
        ({"rate": 6.0, "acceleration": 3.0}, 4 * sqrt(0.8 / 3)),
        *(({"acceleration": a}, 4 * sqrt(0.8 / a)) for a in (60.0, 3.0)),
        # The periodic motion of largest extent for a given jerk has a jerk of constant size: T³ = 96·extent/jerk.
        ({"jerk": 800.0}, (96 * 0.8 / 800) ** (1 / 3)),
    ],
)
def test_forth_and_back_takes_the_time_of_the_closed_form(
    gait: gg.Gait, limits: dict[str, Any], exact: float
) -> None:
    found = least_period(gait, Limits(**limits))
    assert found.lower_bound == pytest.approx(exact)
    assert exact <= found.least <= exact * 1.003
    assert_lawful(found)


@settings(deadline=None, max_examples=15)
@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(8, 40),
    rate=st.sampled_from([np.inf, 3.0]),
)
def test_no_other_speeds_within_the_limits_are_larger_anywhere(
    seed: int, n: int, rate: float
) -> None:
    # The largest solution point by point, against a linear programme over the very same rows.
    random = np.random.default_rng(seed)
    width = random.uniform(0.02, 0.2, n)
    first, second = random.normal(size=(n, 2)), 3 * random.normal(size=(n, 2))
    first, second = np.vstack([first, first[:1]]), np.vstack([second, second[:1]])
    limits = random.uniform(0.5, 2, 2)
    b = fastest_squared_speeds(first, second, width, np.full(2, rate), limits)
    assert b[0] == b[-1]
    assert (b > 0).all()
    rise = np.diff(b) / (2 * width)
    for side in (slice(None, -1), slice(1, None)):
        size = np.abs(second[side] * b[side, None] + first[side] * rise[:, None])
        assert (size <= limits * (1 + 1e-9)).all()
    rows, right = [], []
    box = np.full(n, np.inf)
    for k in range(n):
        ends = [k, (k + 1) % n]
        for node, joint in itertools.product((0, 1), (0, 1)):
            row = np.zeros(n)
            row[ends] = np.array([-1, 1]) * first[k + node, joint] / (2 * width[k])
            row[ends[node]] += second[k + node, joint]
            if row[ends].prod() > 0:
                # Rows that bound a sum are replaced by bounds of each.
                box[ends] = np.minimum(box[ends], limits[joint] / abs(row[ends].sum()))
            else:
                rows += [row, -row]
                right += [limits[joint]] * 2
    high = np.minimum(
        np.minimum(box, ((rate / np.abs(first[:-1])) ** 2).min(axis=1)), 1e12
    )
    found = linprog(
        -np.ones(n),
        A_ub=np.array(rows),
        b_ub=right,
        bounds=np.column_stack([np.zeros(n), high]),
    )  # type: ignore[call-overload]
    np.testing.assert_allclose(b[:-1], found.x, rtol=1e-5, atol=1e-7)


@settings(deadline=None, max_examples=10)
@given(
    points=st.lists(
        st.tuples(st.floats(0.3, 1.3), st.floats(-1.3, -0.3)), min_size=1, max_size=6
    ),
    rounding=st.sampled_from([None, 1e-4, 0.01, 0.2]),
    limits=st.sampled_from(
        [
            {"rate": 4.0, "acceleration": 30.0},
            {"rate": [1.0, 2.0, 3.0, 4.0], "acceleration": [10.0, 80.0, 20.0, 40.0]},
            {"acceleration": [10.0, 80.0, 20.0, 40.0]},
            {"jerk": 500.0},
            {"rate": 2.0, "acceleration": 20.0, "jerk": 1000.0},
        ]
    ),
)
def test_every_law_is_smooth_closed_and_within_its_limits(  # type: ignore[no-untyped-def]
    points, rounding, limits
) -> None:
    found = least_period(
        lift(points, "red"), Limits(**limits), rounding=rounding, nodes=60
    )
    if not found:
        assert found.status == "still"
        return
    timed = assert_lawful(found)
    assert found.lower_bound <= timed.period * (1 + 1e-9)
    alpha = timed.at(np.linspace(0, timed.period, 301)).alpha
    np.testing.assert_array_equal(alpha[:, :2], alpha[:, 2:])
    # At least one limit is met: nothing was stretched for nothing.
    assert timed.limits_touched(1e-6)


# Not by a formula, but by what the passes and programmes found when they agreed with independent ones: any change of
# nodes, tangents or corrections moves a digit.
@pytest.mark.parametrize(
    ("points", "limits", "rounding", "least", "bound", "stretch"),
    [
        (
            GAITS[2].angles,
            {"rate": 6.0, "acceleration": 60.0},
            0.03,
            0.728343577,
            0.495268332,
            0.0,
        ),
        (
            GAITS[2].angles,
            {"acceleration": [30, 20, 50, 25]},
            None,
            1.441314691,
            0.792665460,
            0.0,
        ),
        (
            GAITS[2].angles,
            {"rate": 6.0, "acceleration": 60.0, "jerk": 2000.0},
            0.03,
            0.873425037,
            0.495268332,
            3.1e-07,
        ),
        (
            TRIANGLE,
            {"acceleration": [30, 20, 50, 25]},
            0.03,
            1.016027525,
            0.786389445,
            5.6e-06,
        ),
        (TRIANGLE, {"jerk": 800.0}, None, 0.952440631, 0.457885697, 0.0),
        (TRIANGLE, {"jerk": 800.0}, 0.03, 0.899121141, 0.452677460, 1.099e-04),
        (
            [(0.4, -0.4), (1.2, -0.8)],
            {"acceleration": [30, 20, 50, 25]},
            None,
            0.655090072,
            0.653197265,
            0.0,
        ),
        (
            [(0.4, -0.4), (1.2, -0.8)],
            {"jerk": 800.0},
            None,
            0.459013695,
            0.457885697,
            5.1e-06,
        ),
    ],
)
def test_least_periods_to_six_digits(  # type: ignore[no-untyped-def]
    points, limits, rounding, least, bound, stretch
) -> None:
    found = least_period(
        lift(points, "red"), Limits(**limits), rounding=rounding, nodes=100
    )
    assert found.least == pytest.approx(least, rel=2e-6)
    assert found.lower_bound == pytest.approx(bound, rel=1e-8)
    assert found.stretch == pytest.approx(stretch, abs=2e-6)


@pytest.mark.parametrize(
    ("limits", "each", "rel"),
    [
        # The rate is reached: d/v + v/a + a/j.
        (
            {"rate": 6.0, "acceleration": 60.0, "jerk": 3000.0},
            lambda d: d / 6 + 6 / 60 + 60 / 3000,
            1e-11,
        ),
        # The acceleration is, the rate is not: 2√((a/2j)² + d/a) + a/j.
        (
            {"acceleration": 60.0, "jerk": 3000.0},
            lambda d: 2 * sqrt(0.01**2 + d / 60) + 0.02,
            1e-11,
        ),
        # Neither is: 4∛(d/2j). The rate is, the acceleration is not: d/v + 2√(v/j).
        ({"jerk": 800.0}, lambda d: 4 * (d / 1600) ** (1 / 3), 1e-11),
        ({"rate": 2.0, "jerk": 800.0}, lambda d: d / 2 + 2 * sqrt(2 / 800), 1e-11),
        # Without a jerk limit the acceleration takes a thousandth of the time to rise.
        (
            {"rate": 6.0, "acceleration": 60.0},
            lambda d: 1.001 * (d / 6 + 6 / 60),
            1e-11,
        ),
        # Limits far apart: what is brief beyond floats takes a millionth of the time.
        ({"rate": 1e-8, "acceleration": 1e12}, lambda d: d * 1e8, 1e-5),
        ({"rate": 1e-8, "jerk": 1e12}, lambda d: d * 1e8, 1e-5),
        ({"acceleration": 1e-9, "jerk": 1e12}, lambda d: 2 * sqrt(d * 1e9), 1e-5),
    ],
)
def test_legs_from_rest_to_rest_have_their_closed_form(limits, each, rel) -> None:  # type: ignore[no-untyped-def]
    found = least_period(SQUARE, Limits(**limits))
    assert found.least == pytest.approx(4 * each(pi / 4), rel=rel)
    timed = assert_lawful(found) if rel == 1e-11 else found.timed
    assert timed.vertices().shape == (4, 4)
    angles, rates, _ = timed.at(np.arange(4) * timed.period / 4)
    np.testing.assert_allclose(angles, SQUARE.alpha, atol=max(rel / 10, 1e-9))
    np.testing.assert_allclose(rates, 0, atol=1e-6)


def test_turning_the_loop_round_or_over_changes_nothing() -> None:
    base = least_period(SQUARE, LIMITS, rounding=0.05).least
    for gait in (
        SQUARE.reversed(),
        SQUARE.started_at(2),
        lift(-SQUARE.alpha[:, [1, 0]], "red"),
    ):
        assert least_period(gait, LIMITS, rounding=0.05).least == pytest.approx(
            base, rel=2e-3
        )


def test_a_period_that_is_asked_for_is_met_by_scaling_or_refused_with_the_limit_and_the_place() -> (
    None
):
    fast = least_period(SQUARE, LIMITS, rounding=0.03)
    found = paced(SQUARE, LIMITS, period=1.0, rounding=0.03, rate=200)
    timed = assert_lawful(found)
    assert (timed.period, timed.samples, timed.law, bool(found)) == (
        1.0,
        200,
        "paced",
        True,
    )
    for order in (1, 2, 3):
        np.testing.assert_allclose(
            timed.peaks(order), fast.timed.peaks(order) * fast.least**order
        )
    assert paced(SQUARE, LIMITS, period=fast.least, rounding=0.03)
    short = paced(SQUARE, LIMITS, period=0.7, rounding=0.03)
    assert (bool(short), short.status, short.timed, short.limit) == (
        False,
        "too short",
        None,
        "acceleration",
    )
    assert short.where is not None
    assert f"{fast.least:.4f} s" in short.reason
    assert (
        f"would reach {60 * (fast.least / 0.7) ** 2:.3g} rad/s², limit 60"
        in short.reason
    )
    # Below the lower bound it is certain.
    assert (
        "needs at least"
        in paced(SQUARE, LIMITS, period=0.9 * fast.lower_bound, rounding=0.03).reason
    )


@pytest.mark.parametrize(("tolerance", "nodes"), [(1e-5, 0), (0.03, 5000)])
def test_rounding_is_never_slower_than_resting_at_the_corners(
    monkeypatch: pytest.MonkeyPatch, tolerance: float, nodes: int
) -> None:
    monkeypatch.setattr(
        time_optimal, "_MOST_NODES_UNDER_JERK", nodes
    )  # without programmes it is quick
    limits = Limits(acceleration=60, jerk=2000)
    resting, both = (
        least_period(SQUARE, limits),
        least_period(SQUARE, limits, rounding=tolerance, nodes=50),
    )
    assert both.at_rest == resting.least
    rests = tolerance == 1e-5
    assert both.least == resting.least if rests else both.least < resting.least
    assert (both.rounding is None, both.note.startswith("rests at the corners")) == (
        rests,
        rests,
    )
    assert both.as_mapping()["note"] == (both.note or None)
    assert both.lower_bound <= resting.lower_bound
    assert_lawful(
        paced(SQUARE, limits, period=resting.least, rounding=tolerance, nodes=50)
    )


def test_work_under_a_jerk_limit_reports_and_is_bounded(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    limits = Limits(acceleration=60, jerk=2000)
    lines: list[str] = []
    assert not least_period(
        SQUARE, limits, rounding=0.03, nodes=50, progress=lines.append
    ).note
    assert [line for line in lines if line.startswith("programme 1 under")] == [
        lines[1]
    ]
    assert len(lines) > 2
    monkeypatch.setattr(time_optimal, "_MOST_NODES_UNDER_JERK", 60)
    bounded: list[str] = []
    found = least_period(
        SQUARE, limits, rounding=0.002, nodes=50, progress=bounded.append
    )
    assert len(bounded) == 1
    assert "not optimised under the jerk limit" in found.note
    assert "thin out the table" in str(found)
    assert_lawful(found)


@pytest.mark.parametrize("rounding", [None, 0.03])
@pytest.mark.parametrize(
    "more",
    [{"acceleration": 1e12}, {"acceleration": 1e-9, "jerk": 1e-9}],
    ids=["one", "all"],
)
def test_periods_that_no_clock_has_are_answered(
    more: dict[str, float], rounding: float | None
) -> None:
    limits = Limits(rate=1e-9, **more)
    for found in (
        least_period(SQUARE, limits, rounding=rounding),
        paced(SQUARE, limits, rounding=rounding),
    ):
        assert (bool(found), found.status) == (False, "no period")
        assert found.reason == "the least period under the limits would be above 1e9 s"


@settings(deadline=None, max_examples=20)
@given(seed=st.integers(0, 2**32 - 1), steep=st.sampled_from([0.1, 1.0, 1e3]))
def test_any_speeds_and_accelerations_at_nodes_are_a_closed_smooth_law(
    seed: int, steep: float
) -> None:
    random = np.random.default_rng(seed)
    curve = rounded(SQUARE, 0.05).curve
    grid = grid_along(curve.breaks, curve.pieces, 30)
    count = len(grid.width)
    squared = random.uniform(0.2, 3.0, count)
    law = grid.law(squared, steep * random.normal(size=count))
    assert (law.durations > 0).all()
    np.testing.assert_allclose(law.speed[:-1] ** 2, squared)
    # Position, velocity and acceleration at the end of each interval are those at the start of the next.
    tilts, h = law.tilts(), law.durations[:, None]
    place = curve.at(grid.s[:-1])[:, :2]
    np.testing.assert_allclose(tilts[-1], place, atol=1e-12)
    for order in range(3):
        derivative = derivative_of(tilts, order)
        starts, ends = derivative[-1] / h**order, derivative.sum(axis=0) / h**order
        scale = 1.0 + np.abs(starts).max()
        np.testing.assert_allclose(ends, np.roll(starts, -1, axis=0), atol=1e-9 * scale)


def test_a_limit_of_zero_is_met_by_joints_that_stand_still() -> None:
    found = least_period(SQUARE, Limits(rate=[6, 6, 0, 6], acceleration=60))
    first = int(np.flatnonzero(SQUARE.alpha[:, 2] != SQUARE.ends[:, 2])[0])
    assert (found.status, found.limit, found.where) == (
        "no period",
        "rate",
        {"alpha": SQUARE.alpha[first].tolist()},
    )
    assert "limit 0 of α3" in found.reason
    assert least_period(FORTH_AND_BACK, Limits(rate=[6, 0, 6, 0], acceleration=60))
    point = lift([(0.5, -0.5)], "red")
    still = least_period(point, LIMITS)
    assert (still.status, still.least) == ("still", 0.0)
    timed = paced(point, LIMITS, period=2.0).timed
    assert (timed.peak_rates.max(), timed.check().flyable) == (0, True)


def test_touched_limits_are_where_the_law_runs_at_them() -> None:
    timed = least_period(SQUARE, LIMITS, rounding=0.03, nodes=2000).timed
    touched = {
        (touch.limit, tuple(touch.joints)): touch for touch in timed.limits_touched()
    }
    assert set(touched) == set(
        itertools.product(("rate", "acceleration"), ((1, 3), (2, 4)))
    )
    t = (np.arange(20_000) + 0.5) * timed.period / 20_000
    at_some = np.zeros(len(t), dtype=bool)
    for (kind, (joint, _)), touch in touched.items():
        order = 1 if kind == "rate" else 2
        at_limit = (
            np.abs(timed.derivative(t, order)[:, joint - 1]) >= 0.99 * touch.value
        )
        assert touch.share == pytest.approx(at_limit.mean(), abs=0.01)
        assert (
            np.abs(timed.derivative(touch.where["t"], order)[joint - 1])
            >= 0.9 * touch.value
        )
        at_some |= at_limit
    # The fastest law is at some limit nearly always.
    assert at_some.mean() > 0.95


def test_a_paced_gait_is_a_timed_gait() -> None:
    vehicle = gg.PAPER.replace(
        max_tilt_rate=6.0, max_tilt_acceleration=60.0, max_tilt_jerk=1e4
    )
    found = least_period(
        lift(GAITS[2].angles, "red", vehicle=vehicle), rounding="2deg", samples=40
    )
    timed, answer = found.timed, found.as_mapping()
    assert isinstance(found.timed, gg.TimedGait)
    table, report = table_of(timed), timed.check()
    assert (len(table), table.about["law"], answer["status"], answer["reason"]) == (
        41,
        "least-period",
        "ok",
        None,
    )
    np.testing.assert_array_equal(table.alpha, timed.alpha)
    assert report.flyable
    assert [check.name for check in report.checks][-3:] == [
        "tilt_rate",
        "tilt_acceleration",
        "tilt_jerk",
    ]
    assert (
        not replace(timed, period=0.9 * timed.period, widths=0.9 * timed.widths)
        .check()
        .flyable
    )
    assert answer["peak_rate"] <= 6.0 * (1 + 1e-9)
    assert set(answer["touched"][0]) == {"limit", "joints", "value", "share", "where"}
    # Vertices need corners: a rounded loop has none, and the gait itself has four.
    assert len(timed.vertices()) == 0


def test_limits_come_from_the_vehicle_and_from_texts() -> None:
    vehicle = gg.PAPER.replace(max_tilt_rate="200deg", max_tilt_acceleration=40.0)
    plain = limits_of(vehicle, acceleration="1000deg").as_mapping()
    assert plain == pytest.approx(
        {"rate": np.radians(200), "acceleration": np.radians(1000)}
    )
    uneven = Limits(acceleration=[1, 2, 3, 4])
    assert uneven.as_mapping() == {"acceleration": [1.0, 2.0, 3.0, 4.0]}
    np.testing.assert_array_equal(uneven.in_plane, [[np.inf] * 2, [1, 2], [np.inf] * 2])


@pytest.mark.parametrize(
    ("vehicle", "options", "proposed"),
    [
        ("max_tilt_rate = 6.0\nservo_lag = 0.05", [], "120"),
        ("", ["--max-rate", "6", "--servo-lag", "0.04"], "150"),
        ("max_tilt_rate = [9, 4, 8, 8]\nservo_lag = [0.1, 0.05, 0.05, 0.2]", [], "40"),
        ("servo_lag = 0.05", [], None),
        ("max_tilt_rate = 6.0", [], None),
        ("max_tilt_rate = 6.0", ["--servo-lag", "0"], None),
    ],
)
def test_an_acceleration_that_is_not_known_is_proposed(
    vehicle: str, options: list[str], proposed: str | None, run: Any, tmp_path: Path
) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(f'preset = "paper"\n{vehicle}\n')
    refused = run("pace", "gait4", "--vehicle", file, *options)
    assert (refused.code, refused.out) == (2, "")
    assert "take the rate over the servo's time constant" in refused.err
    if proposed is None:
        assert refused.err.endswith("(--max-rate over --servo-lag)\n")
        return
    assert refused.err.endswith(f", --max-acceleration {proposed}\n")
    paced = run(
        "pace", "gait4", "--vehicle", file, *options, "--max-acceleration", proposed
    )
    assert paced.code == 0


@settings(deadline=None, max_examples=20)
@given(seed=st.integers(0, 2**32 - 1), harmonics=st.integers(1, 6))
def test_the_limits_that_follow_hold_for_periodic_motions(
    seed: int, harmonics: int
) -> None:
    # Landau's and Kolmogorov's inequalities, on random trigonometric polynomials.
    random = np.random.default_rng(seed)
    t = np.linspace(0, 2 * pi, 5000)
    k = np.arange(1, harmonics + 1)
    waves = random.normal(size=harmonics) / k**2, random.uniform(0, 2 * pi, harmonics)
    x, rate, acceleration, jerk = (
        (
            waves[0]
            * k**order
            * np.cos(np.multiply.outer(t, k) + waves[1] + order * pi / 2)
        ).sum(axis=1)
        for order in range(4)
    )
    extent = np.full(2, np.ptp(x))
    most = np.abs([rate, acceleration, jerk]).max(axis=1)
    for limits in (
        Limits(jerk=most[2]),
        Limits(rate=most[0], jerk=most[2]),
        Limits(acceleration=most[1]),
    ):
        assert (most <= limits.completed(extent)[:, 0] * 1.001).all()
