"""The fibres: that they complete the set of solutions, what holds on them, and loops that use them."""

from __future__ import annotations

import itertools
import math
from collections import Counter
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.optimize import least_squares, root

import gaitgraph as gg
from gaitgraph.gait.gait import Gait, lift_to_fiber
from gaitgraph.invertibility.matrices import (
    coefficients_of,
    hover_thrust_shares,
    level_determinant,
    pitch_sensitivity,
    roll_sensitivity,
    rotor_directions,
    zero_moment_direction,
)
from gaitgraph.invertibility.segment_bounds import least_level_determinant
from gaitgraph.io.reading import read_table
from gaitgraph.surface.fibers import fiber_points, line_intervals, nearest_on_line, point_on_family, travel_of
from gaitgraph.surface.sheets import (
    FAMILIES,
    FIBERS,
    families_along,
    family_distances,
    family_jumps,
    family_types,
    red_label,
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
    from gaitgraph.timing.exporting import export

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
