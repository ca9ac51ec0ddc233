"""Optimal gaits: splines, cells and levels by laws; results re-checked without the search that found them."""

from __future__ import annotations

import json
import math
import re
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import shapely
from scipy import ndimage

from gaitgraph.errors import Infeasible, MissingConstant
from gaitgraph.invertibility.matrices import (
    hover_thrust_shares,
    least_singular_value,
    least_singular_value_on_red,
)
from gaitgraph.optimization import optimize
from gaitgraph.optimization.least_effort import (
    LeastEffort,
    SmoothLoop,
    basis_rows,
    control_points_along,
)
from gaitgraph.optimization.optimize import (
    CLEARANCE,
    highest_level,
    level_region,
)
from gaitgraph.surface.admissible import admissible_region
from gaitgraph.surface.region import Discs, Zones, component_meeting
from gaitgraph.validation.validating import validate
from gaitgraph.vehicle import PAPER, Vehicle

if TYPE_CHECKING:
    from pathlib import Path

optimal_gait: Any = (
    optimize.optimal_gait
)  # it finds a gait here, which types cannot know
reserve_gait: Any = partial(optimal_gait, objective="hover_reserve", sign="negative")

EIGHTH = math.pi / 8
SQUARE = [
    (3 * EIGHTH, -3 * EIGHTH),
    (3 * EIGHTH, -EIGHTH),
    (EIGHTH, -EIGHTH),
    (EIGHTH, -3 * EIGHTH),
]


def discs_of(centers: Any, radius: float) -> Discs:
    return Discs(
        centers=np.array(centers, dtype=float), radii=np.full(len(centers), radius)
    )


def plane_of(found: Any, count: int = 4001) -> np.ndarray:
    return np.asarray(found.curve.at(np.linspace(0, found.period, count))[:, :2])


# Splines


def test_control_points_run_along_a_polygon() -> None:
    corners = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 0.5], [0.0, 0.5]])
    points, knots = control_points_along(corners, 30)
    assert len(points) == 30
    np.testing.assert_allclose(basis_rows(knots, 30) @ points, corners, atol=1e-15)
    on_it = shapely.points(basis_rows(np.linspace(0, 30, 500), 30) @ points)
    assert shapely.distance(shapely.LinearRing(corners), on_it).max() < 1e-14
    # Three for each corner are the least; more go to long sides.
    for pieces, expected in (
        (3, [0, 3, 6, 9]),
        (14, [0, 4, 7, 11]),
        (30, [0, 12, 15, 27]),
    ):
        assert control_points_along(corners, pieces)[1].tolist() == expected


# Cells


@pytest.mark.parametrize("seed", range(4))
def test_cells_stay_inside_the_polygon(seed: int) -> None:
    rng = np.random.default_rng(seed)
    angles = np.sort(rng.uniform(0, 2 * math.pi, 25))
    outline = shapely.Polygon(
        np.column_stack([np.cos(angles), np.sin(angles)])
        * rng.uniform(0.6, 1.4, (25, 1))
    )
    holes = [
        shapely.Point(*rng.uniform(-0.6, 0.6, 2)).buffer(
            rng.uniform(0.03, 0.2), quad_segs=4
        )
        for _ in range(4)
    ]
    polygon = max(
        shapely.get_parts(outline.buffer(0) - shapely.union_all(holes)),
        key=lambda part: part.area,
    )
    clearance = 1e-3
    seeds = rng.uniform(-1, 1, (400, 2))
    hulls = seeds[:, None, :] + rng.normal(scale=0.03, size=(400, 4, 2))
    shapes = shapely.convex_hull(shapely.multipoints(hulls))
    hulls = hulls[shapely.covers(polygon.buffer(-2 * clearance), shapes)]
    assert len(hulls) > 20
    cells = LeastEffort(polygon, discs_of([(0, 0)], 0.1), clearance).cells(hulls, 0.3)
    for number, hull in enumerate(hulls):
        own = cells.piece == number
        normals, offsets = cells.normals[own], cells.offsets[own]
        assert (hull @ normals.T <= offsets + 1e-12).all()
        tried = hull.mean(axis=0) + rng.uniform(-0.5, 0.5, (300, 2))
        inside = shapely.points(tried[(tried @ normals.T <= offsets).all(axis=1)])
        assert shapely.covers(polygon, inside).all()
        assert np.min(
            shapely.distance(polygon.boundary, inside), initial=1.0
        ) >= clearance * (1 - 1e-9)


# Levels


def test_highest_level_is_that_of_the_pass_between_obstacles() -> None:
    """Two discs of high level, joined only through a gate where the level is lower; cells of a grid are joined too."""
    walls = [
        shapely.box(*box).exterior.coords[:-1]
        for box in ((-1.57, 0.6, -1.3, 0.7), (-1.25, 0.6, 0.2, 0.7))
    ]
    region = admissible_region(
        PAPER, sign="positive", floor=0.05, zones=Zones(keep_out=walls)
    )
    discs = discs_of([(-0.4, 0.45), (-0.4, 0.9)], 0.05)
    lower, upper = highest_level(region, "singular_value", discs, PAPER)
    assert 0 < lower <= upper <= lower * (1 + 1e-3)
    a1, a2 = np.meshgrid(
        np.linspace(-1.57, 0.2, 401), np.linspace(0.0, 1.57, 401), indexing="ij"
    )
    usable = region.contains(np.column_stack([a1.ravel(), a2.ravel()])).reshape(
        a1.shape
    )
    height = np.where(usable, least_singular_value_on_red(a1, a2), -np.inf)
    masks = [
        np.hypot(a1 - x, a2 - y) <= r
        for (x, y), r in zip(discs.centers, discs.radii, strict=True)
    ]
    assert upper < min(height[mask].max() for mask in masks) - 0.005
    for level, joined in ((upper * 0.98, True), (upper * 1.001, False)):
        labels, _ = ndimage.label(height >= level, structure=np.ones((3, 3)))
        assert bool(set(labels[masks[0]]) & set(labels[masks[1]]) - {0}) == joined


# Results


@pytest.fixture(scope="module")
def robust() -> Any:
    return optimal_gait(SQUARE, radius=0.1, sign="negative", pieces=32)


@pytest.fixture(scope="module")
def reserve() -> Any:
    return reserve_gait(SQUARE, radius=0.1, period=2.0, pieces=32)


def test_the_worst_case_is_the_best_of_all_loops(robust: Any) -> None:
    assert robust
    sampled = least_singular_value(robust.curve.at(np.linspace(0, 1, 3000)))
    assert robust.value - 1e-9 <= sampled.min() <= robust.value + 1e-3
    assert robust.value <= robust.bound <= robust.value * (1 + 2e-3)
    # No loop is better than the best point of its worst disc.
    best = []
    for x, y in SQUARE:
        turn, reach = np.meshgrid(
            np.linspace(0, 2 * math.pi, 721), np.linspace(0, 0.1, 41)
        )
        best.append(
            least_singular_value_on_red(
                x + reach * np.cos(turn), y + reach * np.sin(turn)
            ).max()
        )
    assert robust.bound == pytest.approx(min(best), abs=1e-4)


@pytest.mark.parametrize("name", ["robust", "reserve"])
def test_a_found_gait_holds_between_samples(
    name: str, request: pytest.FixtureRequest
) -> None:
    found: Any = request.getfixturevalue(name)
    assert found.report.flyable
    assert found.gait.check().flyable
    assert (
        shapely.distance(
            shapely.LinearRing(found.gait.alpha[:, :2]), shapely.points(plane_of(found))
        ).max()
        <= 1e-4
    )
    assert admissible_region(PAPER, sign="negative").contains(plane_of(found)).all()
    passes = found.curve.at(found.times)[:, :2]
    assert np.linalg.norm(passes - np.array(SQUARE), axis=1).max() <= 0.1 + 1e-9
    assert found.violation <= 1e-9
    assert found.stationarity < 1e-5
    assert (np.diff(found.times) > 0).all()
    rates = found.curve.at(np.linspace(0, found.period, 20_001), 1)
    effort = np.trapezoid((rates**2).sum(axis=1), dx=found.period / 20_000)
    assert effort == pytest.approx(found.effort, rel=1e-6)
    assert list(found.history) == sorted(found.history, reverse=True)
    assert found.history[-1] == pytest.approx(found.effort)


def test_effort_scales_with_the_period_and_again_is_the_same(reserve: Any) -> None:
    again, slower = (
        reserve_gait(SQUARE, radius=0.1, period=period, pieces=32)
        for period in (2.0, 4.0)
    )
    assert json.dumps(again.as_mapping()) == json.dumps(reserve.as_mapping())
    assert slower.value == reserve.value
    assert slower.effort == pytest.approx(reserve.effort / 2, rel=1e-6)
    # The Cauchy–Schwarz inequality, which is sharp at constant speed.
    at_constant_speed = 2 * reserve.curve.length**2 / 2.0
    assert at_constant_speed < reserve.effort < 1.05 * at_constant_speed


def square_problem() -> tuple[LeastEffort, SmoothLoop]:
    discs = discs_of(SQUARE, 0.1)
    within: Any = component_meeting(
        admissible_region(PAPER, sign="negative").inner, discs
    )
    points, knots = control_points_along(np.array(SQUARE), 32)
    return LeastEffort(within, discs, CLEARANCE), SmoothLoop(
        points=points, passes=knots.astype(float)
    )


def test_a_programme_gives_the_best_loop_in_its_cells() -> None:
    problem, start = square_problem()
    program, rng = problem.program(start, 0.2), np.random.default_rng(5)
    best: Any = program.projected(0.0)
    assert problem.keeps_inside(best)
    assert not problem.keeps_inside(
        SmoothLoop(points=best.points + 3, passes=best.passes)
    )
    assert problem.discs.misses(best.passed()) <= 1e-9
    for size in (
        0.0,
        *[3e-2] * 30,
    ):  # no step towards another loop in the cells and discs is better
        other = SmoothLoop(
            points=start.points + rng.normal(size=(32, 2)) * size, passes=start.passes
        )
        assert (
            program.offsets
            >= np.sum(program.normals * (program.rows @ other.points), axis=1)
        ).all()
        assert problem.discs.misses(other.passed()) < -5e-3
        step = SmoothLoop(
            points=best.points + 1e-4 * (other.points - best.points), passes=best.passes
        )
        assert step.effort >= best.effort * (1 - 1e-9)


def test_each_loop_on_the_way_is_the_best_in_its_cells() -> None:
    """Their efforts are those of convex problems, each with one answer; discs of all kinds are passed in order."""
    centers = np.array([(1.2, -1.2), (1.2, -0.4), (1.1, -0.35), (0.4, -0.4)])
    discs = Discs(centers=centers, radii=np.array([0.05, 0.02, 0.0, 0.1]))
    problem = LeastEffort(square_problem()[0].polygon, discs, CLEARANCE)
    points, knots = control_points_along(centers, 24)
    expected = [
        10.26325000,
        6.591767577,
        6.220517558,
        6.211068983,
        6.206025232,
        6.202684685,
        6.184999340,
        6.183333632,
    ]
    for seed in range(4):  # moved by rounding, as other processors do
        start = points * (
            1 + np.random.default_rng(seed).uniform(-2e-16, 2e-16, points.shape)
        )
        loop, history = problem.solve(
            SmoothLoop(points=start, passes=knots.astype(float))
        )
        assert history[:8] == pytest.approx(expected, rel=1e-6)
        assert history[-1] == pytest.approx(6.174707806, rel=1e-6)
    residual, held, by_border = problem.program(loop).stationarity()
    assert (residual < 1e-6, held, by_border) == (True, (0, 1, 2, 3), False)
    even: Any = problem.evened(loop)
    assert problem.evened(SmoothLoop(points=0 * points, passes=loop.passes)) is None
    program: Any = problem.program(even, 0.2)
    program.bounds *= 1e-2  # no pass moves by more than 0.9 of its bounds
    moved = (program.projected(10.0).passes - even.passes)[1:]
    most = 0.9 * program.unit * np.abs(program.bounds.T)
    assert (np.abs(moved) <= np.where(moved > 0, most[1], most[0]) * (1 + 1e-9)).all()


def test_no_small_change_needs_less_effort() -> None:
    problem, start = square_problem()
    discs = problem.discs
    loop, history = problem.solve(start)
    assert history == sorted(history, reverse=True)
    rng = np.random.default_rng(4)
    tried = 0
    for _ in range(2000):
        step = rng.normal(size=loop.points.shape) * 10.0 ** rng.uniform(-5, -2)
        # Slow changes, so that they are not all lost to roughness.
        step = np.fft.ifft(
            np.fft.fft(step, axis=0) * (np.abs(np.fft.fftfreq(32)) < 0.15)[:, None],
            axis=0,
        ).real
        moved = np.concatenate(
            [[0.0], np.sort(loop.passes[1:] + rng.normal(size=3) * 0.1)]
        )
        other = SmoothLoop(points=loop.points + step, passes=moved)
        if discs.misses(other.passed()) <= 0 and problem.keeps_inside(other):
            tried += 1
            assert other.effort >= loop.effort * (1 - 1e-7)
    assert tried > 5


def test_points_are_passed_exactly_and_more_pieces_need_less_effort() -> None:
    few, many = (
        optimal_gait(SQUARE, radius=0, pieces=pieces, sign="negative")
        for pieces in (24, 48)
    )
    np.testing.assert_allclose(many.passed[:, :2], SQUARE, atol=1e-12)
    assert many.stationarity < 1e-9
    assert many.active == tuple(f"waypoint {number}" for number in (1, 2, 3, 4))
    least = 2 * math.pi**2  # that of the square itself at constant speed
    assert 0 < many.effort - least < (few.effort - least) / 1.5


def test_a_loop_bends_around_an_obstacle() -> None:
    block = shapely.box(0.6, -0.95, 0.95, -0.3)
    found = optimal_gait(
        SQUARE[:3],
        sign="negative",
        radius=[0.05, 0.05, 0.0],
        keep_out=[list(block.exterior.coords)[:-1]],
    )
    assert 0 < shapely.distance(block, shapely.LineString(plane_of(found))) < 0.02
    assert found.active == (
        "waypoint 1",
        "waypoint 2",
        "waypoint 3",
        "the kept level, or the border of the flyable region",
    )
    assert found.stationarity < 1e-6


def test_the_first_and_the_last_disc_may_be_passed_in_one_point() -> None:
    found = optimal_gait(
        [(-0.9, 0.8), (-0.5, 1.0), (-0.1, 0.6), (-0.9, 1.0)], radius=0.3
    )
    assert found.value == pytest.approx(0.8783, abs=1e-3)
    assert found.violation <= 1e-9


def test_a_larger_concession_gives_a_calmer_gait() -> None:
    asked: Any = {"radius": 0.15, "sign": "positive", "pieces": 24}
    tight, loose = (
        optimal_gait([(-1.2, 0.2), (-0.1, 1.2)], **asked, concession=part)
        for part in (1e-3, 0.1)
    )
    assert tight.value >= 0.998 * tight.bound
    assert 0.899 * loose.bound <= loose.value < 0.99 * tight.value
    assert loose.effort < tight.effort


def test_hover_reserve_counts_both_limits() -> None:
    discs = discs_of([(-0.5, 0.4), (-0.8, 0.9)], 0.05)
    asked: Any = {
        "radius": 0.05,
        "objective": "hover_reserve",
        "sign": "positive",
        "pieces": 16,
    }
    free = optimal_gait(discs.centers, **asked)
    shares = hover_thrust_shares(free.curve.at(np.linspace(0, 1, 2000)))
    assert shares.min() == pytest.approx(free.value, abs=1e-3)
    limited = PAPER.replace(max_thrust=0.6 * 0.429 * 9.8)
    found = optimal_gait(discs.centers, **asked, vehicle=limited)
    shares = hover_thrust_shares(found.curve.at(np.linspace(0, 1, 2000)))
    reserve = min(shares.min(), 0.6 - shares.max())
    assert found.value - 1e-9 <= reserve <= found.bound + 1e-6
    assert found.value > 0.995 * found.bound
    assert found.bound <= 0.3
    level = level_region("hover_reserve", found.bound * 1.001, limited).outer
    assert component_meeting(level, discs) is None
    with pytest.raises(MissingConstant):
        optimal_gait(
            [(0, 0)],
            objective="hover_reserve",
            vehicle=Vehicle(drag_ratio=0.1, max_thrust=1.0),
        )


def test_discs_that_share_a_point_are_a_gait_that_stands_still() -> None:
    asked: Any = {"radius": 0.2, "sign": "positive", "pieces": 8}
    found = optimal_gait([(-0.6, 0.5), (-0.6, 0.45)], **asked)
    assert (found.effort, np.ptp(plane_of(found), axis=0).max()) == (0, 0)
    assert found.report.flyable
    assert ("active constraints: none" in str(found), found.times.tolist()) == (
        True,
        [0, 0.5],
    )
    x, y = plane_of(found, 2)[0]
    assert max(math.hypot(x + 0.6, y - 0.5), math.hypot(x + 0.6, y - 0.45)) <= 0.2
    turn, reach = np.meshgrid(np.linspace(0, 2 * math.pi, 361), np.linspace(0, 0.2, 81))
    a1, a2 = -0.6 + reach * np.cos(turn), 0.5 + reach * np.sin(turn)
    best = least_singular_value_on_red(a1, a2)[
        np.hypot(a1 + 0.6, a2 - 0.45) <= 0.2
    ].max()
    assert found.value == pytest.approx(best, rel=5e-3)
    assert found.bound >= best - 1e-12


@pytest.mark.parametrize(("count", "pieces"), [(1, 36), (4, 48), (25, 240)])
def test_there_are_so_many_pieces_by_default(count: int, pieces: int) -> None:
    points = [(-0.6, 0.5 + 1e-3 * k) for k in range(count)]
    found = optimal_gait(points, radius=0.2, objective="hover_reserve")
    assert len(found.curve.breaks) == pieces + 1


def test_answers_that_are_no() -> None:
    far = optimal_gait([(1.2, 1.2)], sign="positive")
    assert (bool(far), far.status, far.as_mapping()["path"]) == (
        False,
        "infeasible",
        [],
    )
    nearest = admissible_region(PAPER, sign="positive").nearest((1.2, 1.2))
    assert nearest is not None
    told = f"({nearest[0]:.4f}, {nearest[1]:.4f}), is {math.dist(nearest, (1.2, 1.2)):.4f} rad away"
    assert re.search(
        rf"waypoint 1 .*; the nearest flyable point, {re.escape(told)}", str(far.reason)
    )
    with pytest.raises(Infeasible):
        far.table()
    apart = optimal_gait([(-0.2, 0.2), (0.8, -0.8)], radius=0.05)
    assert "R > 0: waypoint 2" in str(apart.reason)
    assert "R < 0: waypoint 1" in str(apart.reason)
    islands = [
        list(shapely.box(x, -x, x + 0.2, 0.2 - x).exterior.coords)[:-1]
        for x in (-0.3, -1.1)
    ]
    walled = optimal_gait([(-0.2, 0.4), (-1.0, 1.2)], sign="positive", keep_in=islands)
    assert "waypoints 1 and 2 lie in different parts" in str(walled.reason)
    assert "of this vehicle is at most 1.1710" in str(
        optimal_gait([(0, 0)], floor=2.0, sign="positive").reason
    )


def test_repeated_waypoints_are_merged_with_the_smaller_radius() -> None:
    points = [(-0.2, 0.2), (-0.2, 0.2), (-0.6, 0.6), (-0.2, 0.2)]
    found = reserve_gait(
        points,
        radius=[0.1, 0.05, 0.1, 0.02],
        sign="positive",
        pieces=8,
        coefficients="exact",
    )
    assert found.curve.coefficients.kind == "exact"
    assert found.radius.tolist() == [0.02, 0.1]
    assert found.warnings == ("merged 2 waypoints that repeated the one before",)


def test_rates_are_judged_along_the_curve() -> None:
    quick = PAPER.replace(
        max_tilt_rate=1.0, max_tilt_acceleration=1.0, max_tilt_jerk=1.0
    )
    found = reserve_gait(SQUARE, vehicle=quick, radius=0, pieces=24)
    assert not found.report.flyable
    assert "tilt_rate" in [check.name for check in found.report.checks if not check.ok]
    t = np.linspace(0, 1, 50_001)
    for order, name in enumerate(
        ("tilt_rate", "tilt_acceleration", "tilt_jerk"), start=1
    ):
        peaks = np.abs(found.curve.at(t, order)).max(axis=0)
        np.testing.assert_allclose(found.timed().peaks(order), peaks, rtol=1e-3)
        assert (
            peaks.max() * (1 - 1e-12)
            <= found.report[name].value
            <= peaks.max() * (1 + 1e-3)
        )
    slow = reserve_gait(SQUARE, vehicle=quick, radius=0, pieces=24, period=90.0)
    assert slow.report.flyable
    assert slow.reason is None


def test_tables_and_json_are_read_again(reserve: Any, tmp_path: Path) -> None:
    table = reserve.table(samples=200)
    assert (table.alpha[0] == table.alpha[-1]).all()
    middle = (table["alpha1_rate"][1:] + table["alpha1_rate"][:-1]) / 2
    np.testing.assert_allclose(
        np.diff(table["alpha1"]) / np.diff(table["t"]), middle, atol=0.01
    )
    (tmp_path / "gait.json").write_text(json.dumps(reserve.as_mapping()))
    assert validate(tmp_path / "gait.json").flyable
    assert "any gait through these discs has at most" in str(reserve)


def test_one_disc_whose_whole_path_is_its_nearest_point_is_answered() -> None:
    found = optimize.optimal_gait(
        [(0.5939018424423272, -1.4776767733718355)],
        radius=0.3,
        objective="hover_reserve",
        vehicle=Vehicle(drag_ratio=0.21066889195787053),
    )
    assert found.status == "found"
    assert validate(found).flyable


def test_a_deadline_ends_the_improvement_of_a_gait_and_says_so() -> None:
    discs = [(-0.4, 0.4), (-0.4, 1.2), (-1.2, 1.2), (-1.2, 0.4)]
    late = optimal_gait(discs, deadline=0.0)
    whole = optimal_gait(discs)
    assert late.report.flyable
    assert late.value == pytest.approx(whole.value, rel=1e-2)
    assert late.effort is not None
    assert whole.effort is not None
    assert late.effort > whole.effort
    assert any("the deadline passed" in warning for warning in late.warnings)
