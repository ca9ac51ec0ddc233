"""The fibres: that they complete the set of solutions, what holds on them, and loops that use them."""

from __future__ import annotations

import itertools
import math
from collections import Counter
from typing import TYPE_CHECKING, Any

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.optimize import least_squares, minimize_scalar, root

import gaitgraph as gg
from gaitgraph.gait.gait import Gait, lift_to_fiber
from gaitgraph.graph.build import nodes_above, surface_arrays, surface_graph
from gaitgraph.graph.walks import Blocked, closed_walk
from gaitgraph.invertibility.determinant_bounds import least_level_determinant
from gaitgraph.invertibility.matrices import (
    coefficients_of,
    hover_thrust_shares,
    level_determinant,
    pitch_sensitivity,
    roll_sensitivity,
    rotor_directions,
    zero_moment_direction,
)
from gaitgraph.io.reading import read_table
from gaitgraph.planning.fiberloops import fiber_candidates, gait_along
from gaitgraph.planning.request import PlanRequest
from gaitgraph.planning.unfolding import shortest_leg_across, shortest_leg_between_fibers
from gaitgraph.surface.components import red_label
from gaitgraph.surface.fibers import (
    fiber_points,
    line_intervals,
    nearest_on_line,
    point_on_family,
    stops_on_families,
    travel_of,
)
from gaitgraph.surface.region import Zones
from gaitgraph.surface.sheets import (
    FAMILIES,
    FIBERS,
    families_along,
    family_codes,
    family_distances,
    family_jumps,
    family_types,
    sheet_angles,
    types_contradict,
)

if TYPE_CHECKING:
    from pathlib import Path

HALF_PI = math.pi / 2
EXACT = coefficients_of(kind="exact")
DELTA = EXACT.delta
VEHICLES = {
    "paper": gg.PAPER,
    "small": gg.Vehicle(drag_ratio=0.02),
    "mirrored": gg.PAPER.replace(first_rotor_spin="counterclockwise"),
    "half": gg.Vehicle(drag_ratio=0.5),
    "large": gg.Vehicle(drag_ratio=1.4),
    "on grid": gg.Vehicle(drag_ratio=math.tan(math.pi / 16)),
}
free_angle = st.floats(-1.5, 1.5)


def exact_of(vehicle: gg.Vehicle) -> gg.Coefficients:
    return coefficients_of(vehicle, "exact")


# --- the theorem -------------------------------------------------------------------------------------------------


def horizontal_part(alpha: np.ndarray, vehicle: gg.Vehicle) -> np.ndarray:
    """Return the determinants of three torques and one horizontal force: forces and torques, no formula."""
    force, torque = rotor_directions(alpha, vehicle)
    return np.array([np.linalg.det(np.vstack([torque, force[k : k + 1]])) for k in (0, 1)])


def distance_modulo_pi(angles: Any) -> Any:
    return np.abs(angles - math.pi * np.rint(np.asarray(angles) / math.pi)).max(axis=-1)


def distances_to_all(alpha: np.ndarray, delta: float) -> dict[str, float]:
    """Return the distance to the four families, with the copies of the fibres, written out."""
    a1, a2, a3, a4 = alpha
    return {
        "red": distance_modulo_pi([(a3 - a1), (a4 - a2)]),
        "blue": distance_modulo_pi([a3 + a1 - 2 * delta, a4 + a2 + 2 * delta]),
        "fiber1": distance_modulo_pi([a1 - delta, a3 - delta]),
        "fiber2": distance_modulo_pi([a2 + delta, a4 + delta]),
        "copy1": distance_modulo_pi([a1 - delta - HALF_PI, a3 - delta - HALF_PI]),
        "copy2": distance_modulo_pi([a2 + delta - HALF_PI, a4 + delta - HALF_PI]),
    }


def solutions(vehicle: gg.Vehicle, count: int) -> list[np.ndarray]:
    """Return solutions from random starts: two angles stay, which two is drawn, and the other two are solved for."""
    rng = np.random.default_rng(11)
    found = []
    pairs = list(itertools.combinations(range(4), 2))
    for k in range(count):
        alpha = rng.uniform(-math.pi, math.pi, 4)
        unknown = list(pairs[k % len(pairs)])

        def residual(angles: Any, alpha: Any = alpha, unknown: Any = unknown) -> Any:
            alpha[unknown] = angles
            # The determinants are 2κ times N, so that small κ is not taken for a solution.
            return horizontal_part(alpha, vehicle) / (2 * vehicle.drag_ratio)

        answer = root(residual, alpha[unknown], tol=1e-13)
        if np.abs(residual(answer.x)).max() < 1e-12:  # where it stops otherwise is no solution
            found.append(alpha.copy())
    return found


def is_on_a_family(alpha: np.ndarray, vehicle: gg.Vehicle, tolerance: float) -> str:
    """Return the nearest family of a solution, which must be near, and R = N = 0 on those that are singular."""
    exact = exact_of(vehicle)
    apart = distances_to_all(alpha, exact.delta)
    nearest = min(apart, key=lambda family: apart[family])
    assert apart[nearest] < tolerance, (alpha, apart)
    if nearest in ("copy1", "copy2", "blue"):
        assert abs(float(level_determinant(alpha, exact))) < 10 * tolerance / vehicle.drag_ratio
        assert np.abs(zero_moment_direction(alpha, vehicle)).max() < 10 * tolerance
    return nearest


@pytest.mark.no_cover
@pytest.mark.parametrize("name", ["paper", "small", "mirrored", "half", "large"])
def test_a_solver_finds_no_solution_outside_the_four_families(name: str) -> None:
    found = solutions(VEHICLES[name], 180)
    assert len(found) > 120
    families = Counter(is_on_a_family(alpha, VEHICLES[name], 1e-8) for alpha in found)
    assert set(families) == {"red", "blue", "fiber1", "fiber2", "copy1", "copy2"}
    assert min(families.values()) > 5


def test_with_all_four_angles_unknown_the_families_are_the_same() -> None:
    families: Counter[str] = Counter()
    for start in np.random.default_rng(12).uniform(-math.pi, math.pi, (20, 4)):
        answer = least_squares(
            horizontal_part, start, args=(gg.PAPER,), xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=60
        )
        if np.abs(answer.fun).max() < 1e-14:
            # Where families cross, a residual of 1e-14 is met as far from both as its root.
            families[is_on_a_family(answer.x, gg.PAPER, 1e-6)] += 1
    assert sum(families.values()) > 8
    assert len(families) > 3


@pytest.mark.parametrize("name", VEHICLES)
def test_each_point_of_a_fibre_is_a_solution_and_R_is_its_closed_form(name: str) -> None:
    vehicle = VEHICLES[name]
    exact, kappa = exact_of(vehicle), vehicle.signed_drag_ratio
    free = np.random.default_rng(12).uniform(-math.pi, math.pi, (300, 2))
    for fiber, sign in zip(FIBERS, (1.0, -1.0), strict=True):
        alpha = fiber_points(fiber, free, exact)
        for residual in (roll_sensitivity, pitch_sensitivity):
            assert np.abs(residual(alpha, exact)).max() < 1e-12 / abs(kappa)
        expected = sign * np.sin(free.sum(axis=1) + sign * 2 * exact.delta) / (kappa * math.cos(exact.delta) ** 2)
        np.testing.assert_allclose(level_determinant(alpha, exact), expected, atol=1e-11 / abs(kappa))
        # The vertical part of N is what is left, and it is R up to a factor of one sign.
        N = zero_moment_direction(alpha, vehicle)
        assert np.abs(N[:, :2]).max() < 1e-12
        copy = alpha.copy()
        copy[:, [0, 2] if fiber == "fiber1" else [1, 3]] += HALF_PI
        assert np.abs(level_determinant(copy, exact)).max() < 1e-12 / abs(kappa)
        assert np.abs(zero_moment_direction(copy, vehicle)).max() < 1e-12


@pytest.mark.parametrize("name", VEHICLES)
def test_a_pair_idles_on_each_fibre_and_the_other_carries_the_weight(name: str) -> None:
    vehicle = VEHICLES[name]
    exact = exact_of(vehicle)
    free = np.random.default_rng(13).uniform(-1.2, 1.2, (200, 2))
    for fiber, idle in zip(FIBERS, ([1, 3], [0, 2]), strict=True):
        alpha = fiber_points(fiber, free, exact)
        alpha = alpha[np.abs(level_determinant(alpha, exact)) > 1e-3]
        shares = hover_thrust_shares(alpha, vehicle)
        assert np.abs(shares[:, idle]).max() < 1e-10
        np.testing.assert_allclose((shares * np.cos(alpha)).sum(axis=1), 1.0)


@pytest.mark.parametrize("name", VEHICLES)
def test_within_the_range_fibres_join_no_two_components_of_red(name: str) -> None:
    """A piece of a fibre is convex and holds one interval of the line, which has one label."""
    vehicle = VEHICLES[name]
    exact = exact_of(vehicle)
    free = np.random.default_rng(14).uniform(-HALF_PI, HALF_PI, (4000, 2))
    for fiber in FIBERS:
        intervals = [(*ends, s) for s in ("positive", "negative") for ends in line_intervals(fiber, exact, s)]
        assert sum(high - low for low, high, _ in intervals) == pytest.approx(math.pi)
        labels = []
        for low, high, sign in intervals:
            t = np.linspace(low, high, 41)[1:-1]
            line = fiber_points(fiber, np.column_stack([t, t]), exact)
            R = level_determinant(line, exact)
            assert (R > 0).all() if sign == "positive" else (R < 0).all()
            assert len({tuple(label) for label in red_label(line[:, 0], line[:, 1], vehicle).tolist()}) == 1
            labels.append(tuple(red_label(line[0, 0], line[0, 1], vehicle).tolist()))
        assert len(set(labels)) == len(labels)  # so no two pieces meet the same component, and none meets two
        alpha = fiber_points(fiber, free, exact)
        mean = free.mean(axis=1)
        for low, high, sign in intervals:
            within = (mean > low + 1e-9) & (mean < high - 1e-9)
            R = level_determinant(alpha[within], exact)
            assert (R > 0).all() if sign == "positive" else (R < 0).all()


@pytest.mark.parametrize("name", ["paper", "mirrored", "half"])
def test_beyond_the_range_a_fibre_joins_two_components(name: str) -> None:
    """Rotor 4 is turned over on the first fibre: the way ends on red again, shifted by π, with the sign of R kept."""
    vehicle = VEHICLES[name]
    exact = exact_of(vehicle)
    wanted = 1.0
    side = 1.0 if exact.delta > 0 else -1.0
    start = fiber_points("fiber1", (0.5 * side, 0.5 * side), exact)
    second = -1.2 * side
    end = fiber_points("fiber1", (second, second + side * math.pi), exact)
    assert least_level_determinant(start[None], end[None], exact, sign=wanted).worst()[0] > 0
    assert abs(end[3]) > HALF_PI
    assert family_distances(end, exact)[0] < 1e-12
    labels = [red_label(point[0], point[1], vehicle).tolist() for point in (start, end)]
    assert labels[0] == [1, 1, 1]
    assert labels[1] == [1, 1, -1]
    # Such a piece of the red sheet begins at the corner (−π/2, π/2) of the fibre, so the range is no accident.
    corner = fiber_points("fiber1", (-side * HALF_PI, side * HALF_PI), exact)
    assert float(level_determinant(corner, exact)) == pytest.approx(2.0)


@given(p=free_angle, q=free_angle, r=free_angle, s=free_angle, fiber=st.sampled_from(FIBERS))
def test_the_nearest_point_on_the_line_keeps_R_and_shortens_every_step(
    p: float, q: float, r: float, s: float, fiber: str
) -> None:
    points = fiber_points(fiber, [(p, q), (r, s)], EXACT)
    shadows = nearest_on_line(points, fiber, EXACT)
    np.testing.assert_allclose(level_determinant(shadows, EXACT), level_determinant(points, EXACT), atol=1e-12)
    assert travel_of(*shadows) <= travel_of(*points) + 1e-15
    assert family_distances(shadows, EXACT)[:, 0].max() < 1e-15
    for k in range(2):  # no point of the line is nearer
        others = fiber_points(fiber, np.repeat(np.linspace(-2, 2, 81)[:, None], 2, axis=1), EXACT)
        assert travel_of(points[k], shadows[k]) <= travel_of(points[k], others).min() + 1e-12


# --- families of points ------------------------------------------------------------------------------------------


@given(a1=free_angle, a2=free_angle, a3=free_angle, a4=free_angle)
def test_distances_agree_with_the_equations(a1: float, a2: float, a3: float, a4: float) -> None:
    apart = distances_to_all(np.array([a1, a2, a3, a4]), DELTA)
    np.testing.assert_allclose(
        family_distances([a1, a2, a3, a4], EXACT), [apart[name] for name in FAMILIES], atol=1e-12
    )


def test_points_follow_fibres_where_they_meet_blue_and_sheets_elsewhere() -> None:
    free = np.array([(0.4, 0.4), (0.4, 0.6), (0.2, -0.2 - 2 * DELTA), (0.1, 0.6)])
    alpha = fiber_points("fiber1", free, EXACT)
    assert families_along(alpha, EXACT, 1e-6).tolist() == [1, 2, 2, 2]
    assert families_along(alpha[2:], EXACT, 1e-6).tolist() == [-1, 2]
    assert families_along(alpha[2:], EXACT, 1e-6, before=2).tolist() == [2, 2]
    assert families_along(alpha[2:], EXACT, 1e-6, before=3).tolist() == [-1, 2]
    assert families_along(alpha + np.array([0, 0, 0.01, 0]), EXACT, 1e-6).tolist() == [0, 0, 0, 0]
    second = fiber_points("fiber2", free, EXACT)
    assert families_along(second, EXACT, 1e-6).tolist() == [1, 3, 3, 3]
    red = gg.lift([(0.3, 0.4), (0.2, 0.1)], "red", coefficients=EXACT).alpha
    assert families_along(red, EXACT, 1e-6).tolist() == [1, 1]


def test_types_on_fibres_hold_one_that_is_free() -> None:
    alpha = np.vstack([fiber_points("fiber1", (0.4, 0.9), EXACT), fiber_points("fiber2", (0.4, 0.9), EXACT)])
    third, fourth = family_types(alpha, [2, 3], EXACT, 0.1)
    assert list(zip(third.tolist(), fourth.tolist(), strict=True)) == [(0, 2), (2, 0)]
    pairs = [(1, 1), (-1, 0), (0, 0), (0, 2), (2, 0)]
    table = {code: types_contradict(pairs, [code] * 5).tolist() for code in (1, -1, 2, 3, 0)}
    assert table == {
        1: [False, True, False, True, True],
        -1: [True, False, False, True, True],
        2: [True, True, True, False, True],
        3: [True, True, True, True, False],
        0: [False] * 5,
    }
    assert all(
        gg.surface.types_may_be_adjacent("(?,*)", other) for other in ("(+,+)", "(-,-)", "(*,?)", "(?,?)", "(?,*)")
    )


def test_segments_leave_a_fibre_by_what_their_ends_do() -> None:
    on = fiber_points("fiber1", [(0.1, 0.8), (0.4, 0.2)], EXACT)
    two = np.array([2], dtype=np.int8)
    assert family_jumps(on[:1], on[1:], two, two, EXACT).max() < 1e-15
    off = on[1:] + np.array([0.01, 0, 0, 0])
    assert family_jumps(on[:1], off, two, two, EXACT)[0] == pytest.approx(0.01)
    turned = on[1:] + np.array([0, 0, math.pi, 0])
    assert family_jumps(on[:1], turned, two, two, EXACT)[0] == pytest.approx(math.pi)
    line = fiber_points("fiber1", [(0.3, 0.3)], EXACT)
    red = np.array([1], dtype=np.int8)
    assert family_jumps(line, on[:1], red, two, EXACT).max() < 1e-15
    beside = line - np.array([0.2, 0, 0.2, 0])
    assert family_jumps(beside, on[:1], red, two, EXACT)[0] == pytest.approx(0.2)


@pytest.mark.parametrize("color", FAMILIES)
def test_four_angles_are_moved_onto_their_family(color: str) -> None:
    rng = np.random.default_rng(15)
    for a, b in rng.uniform(-1.1, 1.1, (40, 2)):
        if color in FIBERS:
            exact = fiber_points(color, (a, b), EXACT)
        else:
            third, fourth = sheet_angles(color, a, b, EXACT)  # type: ignore[arg-type]
            exact = np.array([a, b, third, fourth])
        fixed = {"fiber1": [0, 2], "fiber2": [1, 3]}.get(color, [2, 3])
        rough = exact.copy()
        rough[fixed] += rng.uniform(-4e-4, 4e-4, 2)
        if np.abs(rough).max() > HALF_PI or np.sort(family_distances(rough, EXACT))[1] < 1e-2:
            continue
        point, found = point_on_family(rough, EXACT)
        assert found == color
        np.testing.assert_allclose(point, exact, atol=1e-15)


def test_ends_of_the_range_stay_where_they_are() -> None:
    ends = (HALF_PI, -0.2, -HALF_PI, -0.2)
    assert point_on_family(ends, EXACT) == (ends, "red")
    assert point_on_family((DELTA, 0.4, DELTA, 0.4), EXACT)[1] == "red"
    assert point_on_family((DELTA, 0.4, DELTA, 0.4005), EXACT)[1] == "fiber1"


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: fiber_points("fiber3", (0, 0), EXACT), "fiber: 'fiber3'; allowed are 'fiber1' and 'fiber2'"),
        (lambda: fiber_points("fiber1", (0, 0, 0), EXACT), "free: .* pairs of finite angles"),
        (lambda: fiber_points("fiber1", ("a", "b"), EXACT), "free: .*; allowed are pairs"),
        (lambda: fiber_points("fiber1", (0, math.nan), EXACT), "free: .* pairs of finite angles"),
        (lambda: point_on_family((0.1, 0.2, 0.3), EXACT), "point: .*; allowed are four angles"),
        (lambda: point_on_family((0.1, 0.2, 0.3, 2.0), EXACT), "point: .*; allowed are four angles"),
        (lambda: point_on_family((0.1, 0.2, 0.3, 0.4), EXACT, name="waypoint 3"), "waypoint 3: .* is on no sheet"),
        (lambda: line_intervals("fiber1", EXACT, "up"), "sign: 'up'; allowed are"),
        (lambda: lift_to_fiber([], "fiber1"), "free: "),
        (lambda: lift_to_fiber([(0.1, 0.2)], "red"), "fiber: 'red'"),
        (lambda: gg.lift([(DELTA, 0.2)], "fiber1"), "colors: 'fiber1'; allowed .* see lift_to_fiber"),
        (lambda: surface_graph(sheets="some"), "sheets: 'some'; allowed are 'planes' and 'all'"),  # type: ignore[arg-type]
        (lambda: surface_graph(sheets="all", waypoints=[(0.1, 0.2, 0.3, 0.4)]), "waypoints: .* is on no sheet"),
        (lambda: shortest_leg_across([0] * 4, [0] * 4, "fiber1", EXACT), "start, end: .* one point on fiber1"),
        (lambda: shortest_leg_across([0] * 3, [0] * 4, "fiber1", EXACT), "start: .*; allowed are four"),
        (lambda: shortest_leg_between_fibers([0] * 4, [0] * 4, EXACT), "start, end: .* each of the fibres"),
        (lambda: shortest_leg_between_fibers("x", [0] * 4, EXACT), "start: 'x'; allowed are four"),
    ],
)
def test_bad_input_is_refused_in_one_line(call: Any, message: str) -> None:
    with pytest.raises(gg.InputError, match=message) as caught:
        call()
    assert "\n" not in str(caught.value)


# --- gaits ---------------------------------------------------------------------------------------------------------


def test_a_gait_on_a_fibre_is_valid_and_not_flyable_and_says_why() -> None:
    corners = [(0.2, 0.4), (0.9, 0.3), (0.5, 0.8)]
    for fiber, idle, kind in itertools.product(FIBERS, ("2 and 4", "1 and 3"), ("published", "exact")):
        if (fiber == "fiber1") != (idle == "2 and 4"):
            continue
        free = corners if fiber == "fiber1" else [(-a, -b) for a, b in corners]
        gait = lift_to_fiber(free, fiber, coefficients=coefficients_of(kind=kind))  # type: ignore[arg-type]
        report = gait.check()
        assert (report.valid, report.two_color, report.flyable, report.reachable_from_hover) == (
            True,
            True,
            False,
            True,
        )
        assert [check.name for check in report.checks if not check.ok] == ["hover_thrust"]
        assert f"corner 1 is on the {'first' if fiber == 'fiber1' else 'second'} fibre" in report.reason
        assert f"rotors {idle} idle" in report.reason
        assert report["hover_thrust"].value == 0.0
        assert report["two_color"].message.endswith(f"({fiber})")
        assert "on a fibre that meets the component of α = 0" in report.reachability
        assert gait.color == fiber
        assert set(gait.types) == {"(?,*)" if fiber == "fiber1" else "(*,?)"}
        # Sampled densely it is what the report says.
        s = np.linspace(0, 1, 201)[:, None, None]
        along = gait.alpha + s * (gait.ends - gait.alpha)
        assert level_determinant(along, gait.coefficients).min() >= report["R_sign"].value - 1e-9  # type: ignore[operator]
        assert report["R_sign"].value > 0  # type: ignore[operator]


def test_the_plane_hides_what_moves_on_a_fibre() -> None:
    gait = lift_to_fiber([(0.4, 0.2), (0.4, 0.9)], "fiber1")
    assert gait.length == 0.0
    assert gait.travel == pytest.approx(2 * 0.7 / math.sqrt(2))
    red = gg.lift([(0.4, -1.2), (0.4, -0.4), (1.2, -0.4)], "red")
    assert red.travel == pytest.approx(red.length)
    timed = gait.parametrize(2.0, samples=8)
    assert timed.colors() == ("fiber1",) * 9


def mixed(coefficients: gg.Coefficients = EXACT) -> Gait:
    """From the red sheet onto both fibres and back, R > 0."""
    at = coefficients.delta
    alpha = [
        (-0.3, 0.5, -0.3, 0.5),
        (at, 0.5, at, 0.5),
        (at, 0.3, at, 0.9),
        (at, 0.2, at, 0.2),
        (-0.2, -at, -0.2, -at),
        (-0.6, -at, -0.1, -at),
        (-0.4, -at, -0.4, -at),
    ]
    colors = ("red", "red", "fiber1", "red", "red", "fiber2", "red")
    return Gait(alpha=np.array(alpha), colors=colors, coefficients=coefficients)


def test_a_gait_goes_from_red_onto_fibres_and_back() -> None:
    report = mixed().check()
    assert (report.valid, report.flyable, report.reachable_from_hover) == (True, False, True)
    assert report["two_color"].message.endswith("(mixed)")
    assert "corner 3 is on the first fibre" in report.reason
    assert mixed().color == "mixed"
    assert mixed().types[2] == "(?,*)"
    assert mixed().types[5] == "(*,?)"


@pytest.mark.parametrize(("corner", "shift"), [(1, (-0.2, 0, -0.2, 0)), (4, (0, 0.1, 0, 0.1))])
def test_off_the_line_the_step_onto_a_fibre_is_a_jump(corner: int, shift: tuple[float, ...]) -> None:
    gait = mixed()
    alpha = gait.alpha.copy()
    alpha[corner] += shift
    report = Gait(alpha=alpha, colors=gait.colors, coefficients=EXACT).check()
    assert report["two_color"].ok
    assert not report["continuous"].ok
    assert report["continuous"].value == pytest.approx(max(map(abs, shift)))
    assert "changes color" in report["continuous"].message


def test_wrong_paint_and_wraps_on_fibres_are_told() -> None:
    on = fiber_points("fiber1", [(0.3, 0.6), (0.5, 0.9)], EXACT)
    painted = Gait(alpha=on, colors=("fiber2",) * 2, coefficients=EXACT).check()["continuous"]
    assert not painted.ok
    assert "is colored fiber2 but lies off that fibre, on the fiber1 one" in painted.message
    as_red = Gait(alpha=on, colors=("red",) * 2, coefficients=EXACT).check()["continuous"]
    assert "is colored red but lies off that sheet, on the fiber1 one" in as_red.message
    turned = on.copy()
    turned[1, 0] += math.pi
    wrap = Gait(alpha=turned, colors=("fiber1",) * 2, coefficients=EXACT).check()["continuous"]
    assert wrap.value == pytest.approx(math.pi)
    assert not wrap.ok


def test_printed_digits_of_a_fibre_are_allowed_for() -> None:
    rounded = Gait(alpha=mixed().alpha.round(4), colors=mixed().colors, coefficients=EXACT)
    assert rounded.check().valid
    coarse = Gait(alpha=mixed().alpha.round(2), colors=mixed().colors, coefficients=EXACT)
    assert not coarse.check()["continuous"].ok


def test_where_R_is_zero_on_a_fibre_is_no_gait() -> None:
    over = lift_to_fiber([(0.3, 0.6), (-0.9, -0.2)], "fiber1", coefficients=EXACT).check()
    assert not over["R_sign"].ok
    assert "changes its sign" in over["R_sign"].message
    below = lift_to_fiber([(-0.9, -0.2), (-0.9, -0.8)], "fiber1", coefficients=EXACT).check()
    assert (below.valid, below.reachable_from_hover) == (True, False)
    beyond = lift_to_fiber([(0.3, 0.6), (-0.9, 2.0)], "fiber1", coefficients=EXACT).check()
    assert (beyond.valid, beyond.reachable_from_hover) == (True, None)
    assert "beyond ±π/2" in beyond.reachability


def test_a_fibre_crossed_straight_loses_the_red_point_between() -> None:
    points = fiber_points("fiber1", [(0.3, 0.6), (0.45, 0.45), (0.6, 0.3), (0.9, 0.9)], EXACT)
    gait = Gait(alpha=points, colors=("fiber1", "red", "fiber1", "fiber1"), coefficients=EXACT).merged()
    assert gait.colors == ("fiber1",) * 3
    kept = Gait(alpha=points, colors=("fiber1", "red", "fiber1", "red"), coefficients=EXACT)
    assert kept.merged().travel == pytest.approx(kept.travel)
    assert mixed().merged().colors == mixed().colors


# --- tables --------------------------------------------------------------------------------------------------------


def test_tables_on_a_fibre_are_recognised_with_and_without_colors(tmp_path: Path) -> None:
    gait = lift_to_fiber([(0.2, 0.4), (0.9, 0.3), (0.5, 0.8)], "fiber1")
    gait.parametrize(1.0, samples=24).write(tmp_path / "painted.csv")
    table = read_table(tmp_path / "painted.csv")
    assert set(table["color"]) == {"fiber1"}
    assert set(table["types"]) == {"(?,*)"}
    bare = tmp_path / "bare.csv"
    rows = [",".join(f"{angle:.4f}" for angle in row) for row in table.alpha]
    bare.write_text("\n".join(["alpha1,alpha2,alpha3,alpha4", *rows]) + "\n")
    for path in (tmp_path / "painted.csv", bare):
        report = gg.validate(path)
        assert (report.valid, report.flyable, report.two_color) == (True, False, True)
        assert "row 1 is on the first fibre" in report.reason
        assert not report.notes
    crossing = tmp_path / "crossing.csv"
    rows = [",".join(map(repr, row)) for row in mixed(coefficients_of()).alpha.tolist()]
    crossing.write_text("\n".join(["alpha1,alpha2,alpha3,alpha4", *rows]) + "\n")
    assert gg.validate(crossing).valid


def test_what_a_table_states_of_a_fibre_is_compared(tmp_path: Path) -> None:
    at = coefficients_of().delta
    path = tmp_path / "gait.csv"
    head = "alpha1,alpha2,alpha3,alpha4,color,types"
    path.write_text(f'{head}\n{at},0.3,{at},0.6,fiber1,"(*,?)"\n{at},0.5,{at},0.9,fiber1,"(?,*)"\n')
    (note,) = gg.validate(path).notes
    assert note.startswith("row 1 states the types (*,?), but it is fiber1")
    path.write_text("alpha1,alpha2,color\n0.1,0.2,red\n0.1,0.3,fiber2\n")
    with pytest.raises(gg.InputError, match="row 2: color is 'fiber2'; allowed are 'red' and 'blue' without"):
        gg.validate(path)
    path.write_text(f"{head}\n0.1,0.2,0.1,0.2,green,x\n")
    with pytest.raises(gg.InputError, match="color is 'green'; allowed are 'red', 'blue', 'fiber1', 'fiber2'"):
        gg.validate(path)


def test_gaits_on_fibres_are_written_read_and_drawn_and_no_way_leads_to_them(tmp_path: Path) -> None:
    from matplotlib import pyplot

    from gaitgraph import plots
    from gaitgraph.io.exchange import export

    gait = lift_to_fiber([(0.2, 0.4), (0.9, 0.3), (0.5, 0.8)], "fiber1")
    bare = tmp_path / "bare.csv"
    rows = [",".join(map(repr, row)) for row in gait.alpha.tolist()]
    bare.write_text("\n".join(["alpha1,alpha2,alpha3,alpha4", *rows]) + "\n")
    export(bare, [tmp_path / "full.csv"])
    table = read_table(tmp_path / "full.csv")
    assert set(table["color"]) == {"fiber1"}
    assert set(table["types"]) == {"(?,*)"}
    assert gg.gait_of(read_table(bare)).colors == gait.colors
    refused = gg.transition("hover", gait)
    assert not refused
    assert "on a fibre" in str(refused.reason)
    axes = plots.gait_loop(gait, angles=(2, 4))
    assert len(axes.lines) == 1
    pyplot.close("all")


# --- the graph -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("sign", ["negative", "positive"])
def test_all_sheets_hold_the_planes_as_they_were(sign: Any) -> None:
    waypoints = [(0.91, -0.33), (-0.2, 0.7)]
    planes = surface_graph(sign, 10, waypoints=waypoints)
    every = surface_graph(sign, 10, waypoints=waypoints, sheets="all")
    assert "sheets" not in planes.graph
    assert not any("travel" in data for *_, data in planes.edges(data=True))
    assert {frozenset(edge) for edge in planes.edges} <= {frozenset(edge) for edge in every.edges}
    for name, data in planes.nodes(data=True):
        assert every.nodes[name] == data
    for a, b, data in planes.edges(data=True):
        rest = dict(every.edges[a, b])
        travel = rest.pop("travel")
        assert rest == data
        p, q = ([planes.nodes[name][f"alpha{k}"] for k in range(1, 5)] for name in (a, b))
        assert travel == (data["length"] if data["continuous"] else float(travel_of(p, q)))
    assert every.graph == planes.graph | {"sheets": "all"}
    default = surface_graph(sign, 10, waypoints=waypoints, sheets="planes")
    assert list(default.nodes(data=True)) == list(planes.nodes(data=True))
    assert list(default.edges(data=True)) == list(planes.edges(data=True))


def brute_edges(graph: nx.Graph[Any]) -> set[frozenset[Any]]:
    """All pairs, word by word: on a fibre at most a step apart in both free angles, from a line to red in the plane."""
    out = set()
    step = graph.graph["step"] * (1 + 1e-9)
    at = coefficients_of(gg.vehicle.vehicle_from_mapping(graph.graph["vehicle"]), graph.graph["coefficients"]).delta
    angles = {name: np.array([data[f"alpha{k}"] for k in range(1, 5)]) for name, data in graph.nodes(data=True)}

    def is_red(name: Any) -> bool:
        return bool(graph.nodes[name]["color"] == "red" and np.abs(angles[name][2:] - angles[name][:2]).max() < 1e-9)

    def members(fiber: str) -> list[Any]:
        fixed, level = ([0, 2], at) if fiber == "fiber1" else ([1, 3], -at)
        near = [name for name in graph if np.abs(angles[name][fixed] - level).max() < 1e-9]
        return [name for name in near if graph.nodes[name]["color"] == fiber or is_red(name)]

    for fiber in FIBERS:
        for a, b in itertools.combinations(members(fiber), 2):
            if np.abs(angles[a] - angles[b]).max() <= step:
                out.add(frozenset((a, b)))
    for a, b in itertools.combinations([name for name in graph if is_red(name)], 2):
        if "line" in f"{a[0]}{b[0]}" and np.abs(angles[a] - angles[b]).max() <= step:
            out.add(frozenset((a, b)))
    return out


@pytest.mark.no_cover
@pytest.mark.parametrize("name", ["paper", "mirrored", "half", "on grid"])
@pytest.mark.parametrize("sign", ["negative", "positive"])
def test_edges_are_exactly_the_steps_on_fibres_and_from_their_lines(name: str, sign: Any) -> None:
    vehicle = VEHICLES[name]
    at = coefficients_of(vehicle).delta
    waypoints = [(at, 0.31, at, 0.77), (at, -0.9, at, -0.5), (-0.5, -at, -0.31, -at), (at, 0.44), (at - 0.1, 0.4)]
    planes = surface_graph(sign, 8, vehicle=vehicle, waypoints=[(at, 0.44), (at - 0.1, 0.4)])
    graph = surface_graph(sign, 8, vehicle=vehicle, waypoints=waypoints, sheets="all")
    gg.validate_graph(graph)
    expected = brute_edges(graph) | {frozenset(edge) for edge in planes.edges}
    assert {frozenset(edge) for edge in graph.edges} == expected
    wanted = 1 if sign == "positive" else -1
    numbers = coefficients_of(vehicle)
    fibered = [
        (graph.nodes[a], graph.nodes[b], data)
        for a, b, data in graph.edges(data=True)
        if {graph.nodes[a]["color"], graph.nodes[b]["color"]} & set(FIBERS)
    ]
    assert len(fibered) > 30
    for first, second, data in fibered:
        p, q = (np.array([node[f"alpha{k}"] for k in range(1, 5)]) for node in (first, second))
        along = p + np.linspace(0, 1, 33)[:, None] * (q - p)
        assert data["continuous"]
        assert not data["flyable"]
        assert np.abs(roll_sensitivity(along, numbers)).max() < 1e-11
        assert np.abs(pitch_sensitivity(along, numbers)).max() < 1e-11
        R = wanted * level_determinant(along, numbers)
        assert data["keeps_sign"] == (R.min() > 0)
        assert data["travel"] == pytest.approx(np.linalg.norm(q - p) / math.sqrt(2))
        if data["keeps_sign"]:
            sampled = gg.invertibility.least_singular_value(along, vehicle).min()
            assert sampled - 2e-2 <= data["least_singular_value"] <= sampled + 1e-12


def test_a_line_on_the_grid_needs_no_nodes_of_its_own() -> None:
    graph = surface_graph("positive", 16, vehicle=VEHICLES["on grid"], sheets="all")
    assert not any(name[0] in ("line1", "line2") for name in graph)
    assert graph.edges[(9, 10, "red"), (10, 11, "fiber1")]["continuous"]


def test_zones_cut_fibres_by_their_first_two_angles() -> None:
    at = coefficients_of().delta
    zones = Zones(keep_out=[[(0.0, 0.5), (0.5, 0.5), (0.5, 1.0), (0.0, 1.0)]])
    free, cut = (surface_graph("positive", 8, sheets="all", zones=zone) for zone in (None, zones))
    gg.validate_graph(cut)
    gone = set(free) - set(cut)
    assert gone
    for name in gone:
        data = free.nodes[name]
        assert 0 < data["alpha1"] < 0.5
        assert 0.5 < data["alpha2"] < 1.0
    assert all(abs(free.nodes[name]["alpha1"] - at) < 1e-12 for name in gone if name[2] == "fiber1")


def test_the_mirrored_vehicle_has_the_mirrored_fibres() -> None:
    graph, mirror = (
        surface_graph(sign, 8, vehicle=vehicle, coefficients=exact_of(vehicle), sheets="all")  # type: ignore[arg-type]
        for sign, vehicle in (("positive", gg.PAPER), ("positive", VEHICLES["mirrored"]))
    )

    def mirrored(name: Any) -> Any:
        return (name[0], 8 - name[1], "red") if isinstance(name[0], str) else (8 - name[0], 8 - name[1], name[2])

    # κ → −κ is α → −α; R is the same function of both.
    assert {mirrored(name) for name in graph} == set(mirror)
    assert {frozenset(map(mirrored, edge)) for edge in graph.edges} == {frozenset(edge) for edge in mirror.edges}


def breakages() -> list[tuple[str, Any]]:
    node, line, other = (5, 7, "fiber1"), ("line1", 5, "red"), (5, 6, "fiber1")

    def put(name: Any, key: str, value: object) -> Any:
        return lambda graph: graph.nodes[name].__setitem__(key, value)

    def edge(a: Any, b: Any, key: str, value: object) -> Any:
        return lambda graph: graph.edges[a, b].__setitem__(key, value)

    return [
        ("sheets is 'some'", lambda graph: graph.graph.__setitem__("sheets", "some")),
        ("disagrees with cell None", lambda graph: graph.graph.pop("sheets")),
        ("color is 'green'; allowed are 'red', 'blue', 'fiber1', 'fiber2'", put(node, "color", "green")),
        ("its id disagrees with the color 'fiber2'", put(node, "color", "fiber2")),
        ("its id disagrees with the color 'fiber1'", put(line, "color", "fiber1")),
        ("not on fiber1", put(node, "alpha1", 0.3)),
        ("not on the line of fiber1", put(line, "alpha4", 0.3)),
        ("cell is \\(1, 1\\)", put(node, "cell", (1, 1))),
        ("its free angles are", put(node, "alpha2", 0.3)),
        ("types are '\\(\\?,\\?\\)'", put(node, "types", "(?,?)")),
        ("R is 'x'", put(node, "R", "x")),
        ("travel is 1.0", edge(line, other, "travel", 1.0)),
        ("'travel' is missing", lambda graph: graph.edges[line, other].pop("travel")),
        ("flyable is True", edge(line, other, "flyable", True)),
        ("not neighbours", lambda graph: graph.add_edge(node, line, **graph.edges[line, other])),
        ("does not stay on the fibre", lambda graph: graph.add_edge((4, 5, "red"), other, **graph.edges[line, other])),
    ]


@pytest.mark.parametrize(("message", "break_it"), breakages())
def test_whatever_breaks_the_contract_of_fibres_is_named(message: str, break_it: Any) -> None:
    graph = surface_graph("positive", 8, sheets="all")
    break_it(graph)
    with pytest.raises(gg.errors.ContractError, match=message):
        gg.validate_graph(graph)


# --- loops ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(4))
def test_the_shortest_walk_is_the_one_with_the_least_travel(seed: int) -> None:
    rng = np.random.default_rng(seed)
    sign: Any = ("positive", "negative")[seed % 2]
    graph = surface_graph(sign, 8, sheets="all")
    usable = nx.subgraph_view(
        graph, filter_edge=lambda a, b: graph.edges[a, b]["continuous"] and graph.edges[a, b]["keeps_sign"]
    )
    parts: list[list[Any]] = [list(part) for part in nx.connected_components(usable)]
    largest: list[Any] = max(parts, key=len)
    component = sorted(largest, key=str)
    assert {name[2] for name in component} >= {"fiber1", "fiber2", "red"}
    stops = [component[k] for k in rng.choice(len(component), 4, replace=False)]
    walk = closed_walk(graph, [[stop] for stop in stops])
    assert not isinstance(walk, Blocked)
    legs = zip(stops, [*stops[1:], stops[0]], strict=True)
    assert walk.length == pytest.approx(
        sum(nx.dijkstra_path_length(usable, a, b, weight="travel") for a, b in legs), abs=1e-9
    )
    gait = gait_along(graph, walk.nodes)
    assert gait.travel == pytest.approx(walk.length, abs=1e-9)
    assert gait.check().valid
    robust = closed_walk(graph, [[stop] for stop in stops], objective="robust")
    assert not isinstance(robust, Blocked)
    assert robust.length >= walk.length - 1e-9


def test_between_red_points_fibres_shorten_nothing() -> None:
    """A step on a fibre is no longer on its line, so loops through red waypoints are those of the planes."""
    stops = [[(6, 10, "red")], [(3, 14, "red")], [(6, 14, "red")]]
    planes, every = (surface_graph("positive", sheets=sheets) for sheets in ("planes", "all"))
    walks = [closed_walk(graph, stops) for graph in (planes, every)]
    assert not isinstance(walks[0], Blocked)
    assert not isinstance(walks[1], Blocked)
    assert walks[0].length == walks[1].length
    assert walks[0].nodes == walks[1].nodes


@settings(deadline=None, max_examples=60)
@given(p2=free_angle, p4=free_angle, a1=free_angle, a2=free_angle, fiber=st.sampled_from(FIBERS))
def test_the_unfolded_crossing_is_the_least_of_all(p2: float, p4: float, a1: float, a2: float, fiber: str) -> None:
    start = fiber_points(fiber, (p2, p4), EXACT)
    end = np.array([a1, a2, a1, a2])
    leg = shortest_leg_across(start, end, fiber, EXACT, admissible=[(-4.0, 4.0)])
    assert leg is not None
    assert not leg.bent

    def travel(u: float) -> float:
        line = fiber_points(fiber, (u, u), EXACT)
        return float(travel_of(start, line) + travel_of(line, end))

    found = minimize_scalar(travel, bounds=(-4, 4), method="bounded", options={"xatol": 1e-10})
    assert leg.travel <= found.fun + 1e-12
    crossing = leg.points[1][[1, 3] if fiber == "fiber1" else [0, 2]]
    assert leg.travel == pytest.approx(travel(float(crossing[0])), abs=1e-12)
    assert family_distances(leg.points[1], EXACT)[[0, FAMILIES.index(fiber)]].max() < 1e-12
    back = shortest_leg_across(end, start, fiber, EXACT, admissible=[(-4.0, 4.0)])
    assert back is not None
    np.testing.assert_array_equal(back.points, leg.points[::-1])
    assert back.colors == leg.colors[::-1]
    # Where that point may not be passed, the best of the admissible ones is at an end.
    grid = np.linspace(-1.5, 1.5, 301)
    parts = [(-1.5, -0.8), (-0.1, 0.05), (1.1, 1.5)]
    inside = [u for u in grid if any(low - 1e-12 <= u <= high + 1e-12 for low, high in parts)]
    bent = shortest_leg_across(start, end, fiber, EXACT, admissible=parts)
    assert bent is not None
    least = min(travel(u) for u in inside)
    assert least - 0.01 <= bent.travel <= least + 1e-12
    assert bent.travel >= leg.travel - 1e-12
    assert shortest_leg_across(start, end, fiber, EXACT, admissible=[]) is None


def test_by_default_a_leg_crosses_where_R_has_the_sign_of_its_start() -> None:
    end = np.array([0.1, -0.2, 0.1, -0.2])  # in the component of α = 0, below the end of its part of the line
    assert red_label(*end[:2]).tolist() == [1, 1, 1]
    start = fiber_points("fiber1", (-0.4, 0.2), EXACT)
    leg = shortest_leg_across(start, end, "fiber1", EXACT)
    assert leg is not None
    assert leg.bent
    assert leg.points[1, 1] == pytest.approx(-DELTA + 1e-6, abs=1e-12)


@settings(deadline=None, max_examples=60)
@given(u1=st.floats(-0.1, 1.2), h1=st.floats(0.0, 0.3), u2=st.floats(-1.2, 0.1), h2=st.floats(0.0, 0.3))
def test_between_fibres_the_straight_way_is_the_least_of_all(u1: float, h1: float, u2: float, h2: float) -> None:
    start = fiber_points("fiber1", (u1 - h1, u1 + h1), EXACT)
    end = fiber_points("fiber2", (u2 + h2, u2 - h2), EXACT)
    leg = shortest_leg_between_fibers(start, end, EXACT)
    # Every pair of crossings of a grid where R > 0, on the sides of both lines that bound the component of α = 0.
    first, second = np.linspace(-DELTA, 1.5, 200)[:, None, None], np.linspace(DELTA, -1.5, 200)[:, None]
    one = fiber_points("fiber1", np.broadcast_to(first, (200, 1, 2)), EXACT)
    two = fiber_points("fiber2", np.broadcast_to(second, (200, 2)), EXACT)
    travel = travel_of(start, one) + travel_of(one, two) + travel_of(two, end)
    if leg is None:
        assert min(np.unravel_index(np.argmin(travel), travel.shape)) <= 1  # the least is where R = 0
        return
    assert travel.min() - 0.02 <= leg.travel <= travel.min() + 1e-12
    assert leg.travel == pytest.approx(float(travel_of(leg.points[:-1], leg.points[1:]).sum()), abs=1e-12)
    assert family_distances(leg.points[1:3], EXACT)[:, 0].max() < 1e-12
    back = shortest_leg_between_fibers(end, start, EXACT)
    assert back is not None
    assert back.travel == leg.travel
    np.testing.assert_array_equal(back.points, leg.points[::-1])


AT = coefficients_of().delta
STOPS = ((-0.4, 0.6), (AT, 0.2, AT, 0.9), (AT, 0.9, AT, 0.1), (-0.5, -AT, -0.1, -AT))


def asked(**fields: Any) -> PlanRequest:
    given: dict[str, Any] = {"method": "grid", "divisions": 8} | fields
    return PlanRequest(waypoints=[(0.0, 0.0)], **given)


def test_loops_on_the_grid_come_near_to_the_straight_one() -> None:
    (exact,) = fiber_candidates(asked(method="exact"), coefficients_of(), "positive", waypoints=STOPS).loops
    assert exact.report.valid
    assert not exact.report.flyable
    assert exact.color == "mixed"
    excess = []
    for divisions in (8, 20):
        found = fiber_candidates(asked(divisions=divisions), coefficients_of(), "positive", waypoints=STOPS)
        (loop,) = found.loops
        assert loop.report.valid
        for stop in STOPS:
            assert np.abs(loop.path.alpha[:, : len(stop)] - stop).max(axis=1).min() < 1e-12
        excess.append(loop.path.travel / exact.path.travel - 1)
    assert min(excess) > 0
    # Eight directions cost at most 1/cos(π/8) − 1 = 0.0824 on each page, and a little at waypoints off the grid.
    assert excess[1] < 0.09
    # Nothing nearby is shorter: the three crossings are the best ones.
    free = [(1, 3), (1, 3), (0, 2), (0, 2)]
    rows = [k for k, color in enumerate(exact.gait.colors) if color == "red"][1:]
    for row, (first, second) in zip(rows, free, strict=True):
        for shift in (-1e-4, 1e-4):
            alpha = exact.gait.alpha.copy()
            alpha[row, [first, second]] += shift
            assert Gait(alpha=alpha, colors=exact.gait.colors).travel >= exact.gait.travel


def test_orders_and_directions_of_loops_on_fibres() -> None:
    there = fiber_candidates(asked(any_order=True, divisions=8), coefficients_of(), "positive", waypoints=STOPS)
    plain = fiber_candidates(asked(divisions=8), coefficients_of(), "positive", waypoints=STOPS)
    assert there.loops[0].path.travel <= plain.loops[0].path.travel + 1e-9
    assert sorted(there.loops[0].order) == [0, 1, 2, 3]
    back = fiber_candidates(asked(reverse=True, divisions=8), coefficients_of(), "positive", waypoints=STOPS)
    assert back.loops[0].path.travel == pytest.approx(plain.loops[0].path.travel)
    assert back.loops[0].order == (0, 3, 2, 1)
    point = fiber_candidates(asked(method="exact"), coefficients_of(), "positive", waypoints=STOPS[1:2])
    assert point.loops[0].path.travel == 0


@pytest.mark.parametrize(
    ("waypoints", "sign", "fields", "kind", "message"),
    [
        (STOPS, "negative", {}, "waypoint", "red, R < 0: waypoint 1 .* has R = 8.13"),
        ([(AT, 0.1, AT, -0.1 - 2 * AT)], "positive", {}, "waypoint", "blue, .* on blue"),
        ([(1.2, -1.0), (-1.4, 1.52)], "negative", {}, "separated", "1 and 2 are separated by the line α2 .* the curve"),
        (
            STOPS,
            "positive",
            {"keep_out": [[(0, 0.1), (0.3, 0.1), (0.3, 0.3), (0, 0.3)]]},
            "waypoint",
            "fiber1, R > 0: waypoint 2 .* forbids it",
        ),
        (
            STOPS,
            "positive",
            {"keep_out": [[(-0.2, -0.5), (0.0, -0.5), (0.0, 1.57), (-0.2, 1.57)]]},
            "separated",
            "waypoints . and . are separated by the keep_out",
        ),
    ],
)
def test_what_is_in_the_way_of_a_loop_on_fibres(
    waypoints: Any, sign: Any, fields: dict[str, Any], kind: str, message: str
) -> None:
    for method in ("exact", "grid"):
        found = fiber_candidates(asked(method=method, **fields), coefficients_of(), sign, waypoints=waypoints)
        assert not found.loops
        (obstacle,) = found.obstacles
        assert obstacle.kind == kind
        with pytest.raises(gg.InputError, match=message):
            raise gg.InputError(obstacle.message)


def test_an_obstacle_sends_the_exact_method_to_the_grid_and_says_so() -> None:
    lines: list[str] = []
    keep_out = [[(-0.2, 0.5), (0.1, 0.5), (0.1, 0.65), (-0.2, 0.65)]]
    request = asked(method="exact", keep_out=keep_out)
    found = fiber_candidates(request, coefficients_of(), "positive", waypoints=STOPS, progress=lines.append)
    (loop,) = found.loops
    assert loop.report.valid
    assert list(found.notes) == ["across the fibres no straight loop holds: searched on a grid instead"]
    assert len(lines) == 2
    zones = Zones(keep_out=keep_out)
    assert zones.allow_segments(loop.gait.alpha[:, :2], loop.gait.ends[:, :2]).all()
    free = fiber_candidates(asked(method="exact"), coefficients_of(), "positive", waypoints=STOPS).loops[0]
    assert loop.path.travel > free.path.travel


def test_waypoints_of_four_angles_are_moved_and_told() -> None:
    rough = [(0.2, 0.3), (0.167, 0.2, 0.167, 0.9), (-0.5, -AT, -0.1, -AT)]
    points, notes = stops_on_families(rough, coefficients_of())
    assert points[0] == (0.2, 0.3)
    assert points[1] == (AT, 0.2, AT, 0.9)
    assert notes == (f"waypoint 2 moved by {AT - 0.167:.1e} rad onto fiber1",)
    graph = surface_graph("positive", sheets="all", waypoints=points)
    assert [len(nodes) for nodes in nodes_above(graph, points)] == [1, 1, 1]
    with pytest.raises(gg.InputError, match="waypoint 1: .* is on no sheet"):
        stops_on_families([(0.1, 0.2, 0.3, 0.4)], coefficients_of())


def test_arrays_carry_the_families() -> None:
    arrays = surface_arrays("positive", 8, sheets="all")
    assert Counter(arrays.codes.tolist()).keys() == {1, -1, 2, 3}
    assert (arrays.red == (arrays.codes == 1)).all()
    assert arrays.codes.tolist() == family_codes([name[2] for name in arrays.ids]).tolist()
    fibered = (arrays.codes[arrays.edge] > 1).any(axis=1)
    np.testing.assert_allclose(
        arrays.travel[fibered], travel_of(*(arrays.alpha[end] for end in arrays.edge[fibered].T)), atol=1e-15
    )
    again = surface_arrays("positive", 8, sheets="all")
    np.testing.assert_array_equal(arrays.edge, again.edge)
    np.testing.assert_array_equal(arrays.alpha, again.alpha)
