"""Optimal gaits: splines, cells and levels by laws; results re-checked without the search that found them."""

from __future__ import annotations

import json
import math
import re
from functools import cache
from typing import Any

import numpy as np
import pytest
import shapely

from gaitgraph.errors import Infeasible, MissingConstant
from gaitgraph.invertibility.matrices import (
    hover_thrust_shares,
    least_singular_value,
)
from gaitgraph.optimization import optimize
from gaitgraph.optimization.least_effort import (
    LeastEffort,
    SmoothLoop,
    control_points_along,
)
from gaitgraph.optimization.optimize import CLEARANCE
from gaitgraph.surface.admissible import admissible_region
from gaitgraph.surface.region import Discs, component_meeting
from gaitgraph.vehicle import PAPER, Vehicle
from tests.published import GAITS
from tests.samples import on_red

# It finds a gait here, which types cannot know.
optimal_gait: Any = optimize.optimal_gait
SQUARE = GAITS[2].angles


def discs_of(centers: Any, radius: Any) -> Discs:
    return Discs(np.array(centers, dtype=float), np.broadcast_to(radius, len(centers)))


def plane_of(found: Any, count: int = 4001) -> np.ndarray:
    return np.asarray(found.curve.at(np.linspace(0, found.period, count))[:, :2])


# -- Splines, cells and levels


# -- Results


BLOCK = shapely.box(0.6, -0.95, 0.95, -0.3)
WEAK = PAPER.replace(max_thrust=0.6 * 0.429 * 9.8)
CASES: dict[str, tuple[Any, dict[str, Any]]] = {
    "robust": (SQUARE, {"pieces": 32}),
    "reserve": (
        SQUARE[:2],
        {"pieces": 24, "period": 2.0, "objective": "hover_reserve"},
    ),
    "points": (SQUARE, {"pieces": 24, "radius": 0}),
    "block": (
        SQUARE[:3],
        {"radius": [0.05, 0.05, 0.0], "keep_out": [BLOCK.exterior.coords[:-1]]},
    ),
    # The first and the last disc are passed in one point.
    "seam": ([(-0.9, 0.8), (-0.5, 1.0), (-0.1, 0.6), (-0.9, 1.0)], {"radius": 0.3}),
    "weak": (
        [(-0.5, 0.4), (-0.8, 0.9)],
        {"vehicle": WEAK, "objective": "hover_reserve", "radius": 0.05, "pieces": 16},
    ),
    # Waypoints that repeat are merged, and the smaller radius counts.
    "merged": (
        [(-0.2, 0.2), (-0.2, 0.2), (-0.6, 0.6), (-0.2, 0.2)],
        {"radius": [0.1, 0.05, 0.1, 0.02], "pieces": 8},
    ),
    # A disc whose whole path is its nearest point.
    "one": (
        [(0.5939018424423272, -1.4776767733718355)],
        {
            "radius": 0.3,
            "objective": "hover_reserve",
            "vehicle": Vehicle(drag_ratio=0.21066889195787053),
        },
    ),
    "shared": ([(-0.6, 0.5), (-0.6, 0.45)], {"radius": 0.2, "pieces": 8}),
}


@cache
def found_in(name: str) -> Any:
    points, options = CASES[name]
    return optimal_gait(points, **options)


@pytest.mark.parametrize("name", CASES)
def test_a_found_gait_holds_between_samples(name: str) -> None:
    found, (_, options) = found_in(name), CASES[name]
    vehicle = options.get("vehicle", PAPER)
    assert found.report.flyable
    region = admissible_region(vehicle, sign=found.sign)
    assert region.contains(plane_of(found)).all()
    # What is kept is certain, near what is sampled, and near the bound of all loops.
    alpha = found.curve.at(np.linspace(0, found.period, 3000))
    values = least_singular_value(alpha, vehicle)
    if found.objective == "hover_reserve":
        values = hover_thrust_shares(alpha, vehicle)
        values = np.minimum(values, (vehicle.thrust_share or 99) - values)
    assert found.value - 1e-9 <= values.min() <= found.value + 1e-3
    assert 0.995 * found.bound <= found.value <= found.bound
    # The discs are passed in order.
    passed = found.curve.at(found.times)
    np.testing.assert_allclose(passed, found.passed, atol=1e-12)
    misses = np.linalg.norm(passed[:, :2] - found.waypoints, axis=1) - found.radius
    assert misses.max() <= 1e-9
    assert (np.diff(found.times) > 0).all()
    pieces = options.get("pieces", max(36, 12 * len(found.waypoints)))
    assert len(found.curve.breaks) == pieces + 1
    # The effort is that of the rates, and falls from loop to loop.
    rates = found.curve.at(np.linspace(0, found.period, 20_001), 1)
    effort = np.trapezoid((rates**2).sum(axis=1), dx=found.period / 20_000)
    assert found.effort == pytest.approx(effort, rel=1e-6, abs=1e-12)
    assert list(found.history) == sorted(found.history, reverse=True)
    assert found.history[-1] == pytest.approx(found.effort, abs=1e-12)
    assert found.stationarity < 1e-5
    line = shapely.LinearRing(found.gait.alpha[:, :2].repeat(2, axis=0))
    assert shapely.distance(line, shapely.points(plane_of(found))).max() <= 1e-4


def test_the_bound_is_the_best_point_of_the_worst_disc() -> None:
    turn, share = np.meshgrid(np.linspace(0, 2 * math.pi, 721), np.linspace(0, 0.1, 41))
    best = [
        least_singular_value(on_red(x + share * np.cos(turn), y + share * np.sin(turn)))
        for x, y in SQUARE
    ]
    expected = min(values.max() for values in best)
    assert found_in("robust").bound == pytest.approx(expected, abs=1e-4)


def test_what_binds_a_gait_is_named() -> None:
    assert found_in("points").active == tuple(f"waypoint {k}" for k in (1, 2, 3, 4))
    # A disc holds the loop that passes it on its rim.
    for name in ("robust", "seam", "weak"):
        found = found_in(name)
        misses = np.linalg.norm(found.passed[:, :2] - found.waypoints, axis=1)
        on_rim = np.flatnonzero(misses > found.radius - 1e-6)
        named = [text for text in found.active if "waypoint" in text]
        assert named == [f"waypoint {k + 1}" for k in on_rim]
    away = shapely.distance(BLOCK, shapely.LineString(plane_of(found_in("block"))))
    assert 0 < away < 0.02
    assert found_in("block").active[-1].startswith("the kept level, or the border")
    still = found_in("shared")
    assert (still.effort, still.active, still.times.tolist()) == (0, (), [0, 0.5])
    merged = found_in("merged")
    assert merged.radius.tolist() == [0.02, 0.1]
    assert any("merged 2 waypoints" in warning for warning in merged.warnings)


def test_the_same_is_asked_again_and_slower() -> None:
    points, options = CASES["reserve"]
    reserve, again = found_in("reserve"), optimal_gait(points, **options)
    slower = optimal_gait(points, **{**options, "period": 4.0})
    assert json.dumps(again.as_mapping()) == json.dumps(reserve.as_mapping())
    assert slower.value == reserve.value
    told = f"any gait through these discs has at most {reserve.bound:.4f}"
    assert told in str(reserve)
    assert slower.effort == pytest.approx(reserve.effort / 2, rel=1e-6)
    longer = reserve.timed().with_period(4.0).at(3.0).rates
    np.testing.assert_allclose(longer, reserve.curve.at(1.5, 1) / 2, atol=1e-12)
    # The Cauchy–Schwarz inequality, which is sharp at constant speed.
    constant = 2 * reserve.curve.length**2 / 2.0
    assert constant < reserve.effort < 1.05 * constant


def test_a_larger_concession_gives_a_calmer_gait() -> None:
    asked: Any = {"radius": 0.15, "sign": "positive", "pieces": 24}
    tight, loose = (
        optimal_gait([(-1.2, 0.2), (-0.1, 1.2)], concession=part, **asked)
        for part in (1e-3, 0.1)
    )
    assert tight.value >= 0.998 * tight.bound
    assert 0.899 * loose.bound <= loose.value < 0.99 * tight.value
    assert loose.effort < tight.effort


def test_rates_are_judged_along_the_curve() -> None:
    names = ("tilt_rate", "tilt_acceleration", "tilt_jerk")
    quick = PAPER.replace(**dict.fromkeys((f"max_{name}" for name in names), 1.0))
    asked: Any = {"vehicle": quick, "radius": 0, "pieces": 24, "sign": "negative"}
    found = optimal_gait(SQUARE, **asked)
    assert {check.name for check in found.report.checks if not check.ok} == set(names)
    t = np.linspace(0, 1, 50_001)
    for order, name in enumerate(names, start=1):
        peaks = np.abs(found.curve.at(t, order)).max(axis=0)
        np.testing.assert_allclose(found.timed().peaks(order), peaks, rtol=1e-3)
        assert found.report[name].value == pytest.approx(peaks.max(), rel=1e-3)
    assert optimal_gait(SQUARE, period=90.0, **asked).report.flyable


def test_a_deadline_ends_the_improvement_of_a_gait_and_says_so() -> None:
    discs = GAITS[3].angles
    rounds: list[str] = []
    late = optimal_gait(discs, deadline=0.0)
    whole = optimal_gait(discs, progress=rounds.append, deadline=1e6)
    assert rounds[0] == f"round 1, effort {whole.history[0]:.4g} rad²/s in 1 s"
    assert late.report.flyable
    assert late.value == pytest.approx(whole.value, rel=1e-2)
    assert late.effort > whole.effort
    assert any("the deadline passed" in warning for warning in late.warnings)


# -- The search for the least effort


def test_a_loop_with_even_control_points_passes_where_it_did() -> None:
    turn = np.linspace(0, 2 * math.pi, 40, endpoint=False)
    turn += 0.3 * np.sin(turn)  # uneven
    points = np.column_stack([np.cos(turn), np.sin(turn)])
    loop = SmoothLoop(points=points, passes=np.array([0.0, 11.3, 25.0]))
    even = loop.evened()
    np.testing.assert_allclose(even.passed(), loop.passed(), atol=0.02)
    steps = np.linalg.norm(np.diff(even.points, axis=0), axis=1)
    assert np.ptp(steps) < 1e-3 * steps.max()


def test_control_points_are_shared_by_length_at_any_scale() -> None:
    corners = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 0.3), (0.0, 0.3)])
    points, knots = control_points_along(corners, 52)
    assert np.diff([*knots, 52]).tolist() == [20, 6, 20, 6]
    smaller, same = control_points_along(0.1 * corners, 52)
    np.testing.assert_allclose(smaller, 0.1 * points, atol=1e-12)
    assert same.tolist() == knots.tolist()


def square_problem() -> tuple[LeastEffort, SmoothLoop]:
    discs = discs_of(SQUARE, 0.1)
    region = admissible_region(PAPER, sign="negative")
    within: Any = component_meeting(region.inner, discs)
    points, knots = control_points_along(np.array(SQUARE), 32)
    loop = SmoothLoop(points=points, passes=knots.astype(float))
    return LeastEffort(within, discs, CLEARANCE), loop


def test_no_small_change_needs_less_effort() -> None:
    problem, start = square_problem()
    loop, _ = problem.solve(start)
    rng = np.random.default_rng(4)
    slow = np.abs(np.fft.fftfreq(32))[:, None] < 0.15  # not all are lost to roughness
    tried = 0
    for _ in range(2000):
        noise = rng.normal(size=loop.points.shape) * 10.0 ** rng.uniform(-5, -2)
        step = np.fft.ifft(np.fft.fft(noise, axis=0) * slow, axis=0).real
        later = np.sort(loop.passes[1:] + rng.normal(size=3) * 0.1)
        other = SmoothLoop(points=loop.points + step, passes=np.append(0.0, later))
        if problem.discs.misses(other.passed()) <= 0 and problem.keeps_inside(other):
            tried += 1
            assert other.effort >= loop.effort * (1 - 1e-7)
    assert tried > 5


APART = [
    shapely.box(x, -x, x + 0.2, 0.2 - x).exterior.coords[:-1] for x in (-0.3, -1.1)
]


# -- Answers that are no


@pytest.mark.parametrize(
    ("points", "options", "told"),
    [
        ([(-0.2, 0.2), (0.8, -0.8)], {"radius": 0.05}, "R > 0: waypoint 2"),
        ([(-0.2, 0.2), (0.8, -0.8)], {"radius": 0.05}, "R < 0: waypoint 1"),
        ([(-0.2, 0.4), (-1.0, 1.2)], {"keep_in": APART}, "lie in different parts"),
        ([(0, 0)], {"floor": 2.0}, "of this vehicle is at most 1.1710"),
    ],
)
def test_why_there_is_none(points: Any, options: Any, told: str) -> None:
    none = optimal_gait(points, **options)
    assert (bool(none), none.status) == (False, "infeasible")
    plain = none.as_mapping()
    assert (plain["path"], plain["times"]) == ([], [])
    assert told in str(none.reason)
    away = r"\((\S+), (\S+)\) is not .*? point, \((\S+), (\S+)\), is (\S+) rad away"
    for numbers in re.findall(away, str(none.reason)):
        x, y, a, b, far = map(float, numbers)
        assert math.hypot(x - a, y - b) == pytest.approx(far, abs=2e-4)
    with pytest.raises(Infeasible):
        none.table()


def test_a_reserve_needs_a_mass_where_thrust_is_limited() -> None:
    massless = Vehicle(drag_ratio=0.1, max_thrust=1.0)
    with pytest.raises(MissingConstant):
        optimal_gait([(0, 0)], objective="hover_reserve", vehicle=massless)
