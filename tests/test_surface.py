"""Roots, sheets, fibres and plane types, against solvers that know nothing of the closed form.

Two such solvers stand here. One hands equations (4) and (5), written out, to a general root finder from many
random starts. The other starts from forces and torques: the horizontal part of N = F·w₀, with w₀ from minors of
τ, is linear in (cos α3, sin α3) and in (cos α4, sin α4), so that all its zeros follow from one quadratic.
"""

from __future__ import annotations

import itertools
import math
from collections import Counter
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import assume, given, settings, strategies as st
from scipy.optimize import root as find_root

from gaitgraph.errors import InputError
from gaitgraph.invertibility.matrices import (
    Coefficients,
    coefficients_of,
    determinant,
    level_determinant,
    zero_moment_direction,
)
from gaitgraph.surface.adjacency import PLANE_TYPES, text_from_types
from gaitgraph.surface.closed_form_roots import root_arrays, roots, sheet_grid
from gaitgraph.surface.sheets import (
    COLORS,
    DEFAULT_CROSSING_TOLERANCE,
    at_end_of_range,
    families_along,
    family_distances,
    sheet_angles,
    types_of,
)
from gaitgraph.vehicle import PAPER, Vehicle, vehicle_named

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

FloatArray = npt.NDArray[np.float64]

PI = math.pi
HALF_PI = math.pi / 2
STEP = math.pi / 16
AXIS = np.linspace(-HALF_PI, HALF_PI, 17)
INTERIOR = AXIS[1:-1]

MIRRORED = PAPER.replace(name="mirrored", first_rotor_spin="counterclockwise")
HALF = Vehicle(name="half", drag_ratio=0.5)
# κ with which the two equations are written out here; 2.880 = (1/κ − κ)/2 is what the paper's digits mean.
PUBLISHED_KAPPA = math.hypot(2.880, 1.0) - 2.880
CASES: dict[str, tuple[Coefficients, float]] = {
    "published": (coefficients_of(), PUBLISHED_KAPPA),
    "exact": (coefficients_of(kind="exact"), 2.423e-7 / (8.048e-6 * 0.1785)),
    "beetle_omni": (coefficients_of(vehicle_named("beetle_omni")), -0.0165 / 0.2754),
    "mirrored": (coefficients_of(MIRRORED), -2.423e-7 / (8.048e-6 * 0.1785)),
    "half": (coefficients_of(HALF), 0.5),
}
every_case = pytest.mark.parametrize("case", CASES)
angle = st.floats(-HALF_PI, HALF_PI)


def equations_4_and_5(alpha: Sequence[float], kappa: float) -> tuple[float, float]:
    """Return (Rφ, Rθ) for arms along the body axes, term by term, 2.880 written as a function of κ."""
    (s1, s2, s3, s4), (c1, c2, c3, c4) = map(math.sin, alpha), map(math.cos, alpha)
    k = (1 / kappa - kappa) / 2
    roll = c1 * c2 * s3 * c4 - s1 * c2 * c3 * c4 - c1 * s2 * s3 * s4 + s1 * s2 * c3 * s4
    roll += k * (c1 * c2 * s3 * s4 + c1 * s2 * s3 * c4 - s1 * c2 * c3 * s4 - s1 * s2 * c3 * c4)
    pitch = c1 * c2 * c3 * s4 - c1 * s2 * c3 * c4 - s1 * c2 * s3 * s4 + s1 * s2 * s3 * c4
    pitch += k * (-c1 * c2 * s3 * s4 + c1 * s2 * s3 * c4 - s1 * c2 * c3 * s4 + s1 * s2 * c3 * c4)
    return roll, pitch


def equation_2(alpha: npt.ArrayLike, numbers: tuple[float, float, float]) -> FloatArray:
    """Return R from equation (2), which is printed without a misprint, at angles of shape (..., 4)."""
    angles = np.moveaxis(np.asarray(alpha, dtype=float), -1, 0)
    (s1, s2, s3, s4), (c1, c2, c3, c4) = np.sin(angles), np.cos(angles)
    single, double, triple = numbers
    return np.asarray(
        4 * c1 * c2 * c3 * c4
        + single * (c1 * c2 * c3 * s4 - c1 * c2 * s3 * c4 + c1 * s2 * c3 * c4 - s1 * c2 * c3 * c4)
        + double * (c1 * c2 * s3 * s4 + c1 * s2 * s3 * c4 + s1 * c2 * c3 * s4 + s1 * s2 * c3 * c4)
        + 2 * (-c1 * s2 * c3 * s4 - s1 * c2 * s3 * c4)
        + triple * (-c1 * s2 * s3 * s4 + s1 * c2 * s3 * s4 - s1 * s2 * c3 * s4 + s1 * s2 * s3 * c4)
    )


def distance_modulo_pi(first: Sequence[float], second: Sequence[float]) -> float:
    difference = np.subtract(first, second)
    return float(np.abs(difference - PI * np.rint(difference / PI)).max())


def without_repeats(found: list[tuple[float, float]], closer: float = 1e-7) -> list[tuple[float, float]]:
    kept: list[tuple[float, float]] = []
    for one in found:
        if all(distance_modulo_pi(one, other) > closer for other in kept):
            kept.append(one)
    return kept


def assert_same_solutions(
    ours: Sequence[tuple[float, float]], theirs: Sequence[tuple[float, float]], tolerance: float = 1e-8
) -> None:
    for some, others in ((ours, theirs), (theirs, ours)):
        for one in some:
            assert min(distance_modulo_pi(one, other) for other in others) <= tolerance, (ours, theirs)


def found_by_search(a1: float, a2: float, kappa: float, starts: FloatArray) -> list[tuple[float, float]]:
    """Return all (α3, α4), modulo π, that a general root finder reaches from the starts."""
    found = []

    def residual(x: FloatArray) -> FloatArray:
        return np.array(equations_4_and_5((a1, a2, float(x[0]), float(x[1])), kappa))

    for start in starts:
        answer = find_root(residual, start, tol=1e-14)
        # Where the two equations are nearly dependent a small residual alone proves nothing.
        if max(map(abs, answer.fun)) < 1e-11 / abs(kappa):
            found.append((float(answer.x[0]), float(answer.x[1])))
    return without_repeats(found)


def horizontal_direction(alpha: Sequence[float], kappa: float) -> FloatArray:
    """Return (N_x, N_y), N = F·w₀, with w₀ made of the 3×3 minors of τ."""
    (s1, s2, s3, s4), (c1, c2, c3, c4) = map(math.sin, alpha), map(math.cos, alpha)
    k = kappa
    force = np.array([[0, s2, 0, -s4], [s1, 0, -s3, 0]])
    moment = np.array(
        [
            [0, c2 - k * s2, 0, -c4 + k * s4],
            [c1 + k * s1, 0, -c3 - k * s3, 0],
            [s1 - k * c1, -s2 - k * c2, s3 - k * c3, -s4 - k * c4],
        ]
    )
    minors = []
    for i in range(4):
        first, second, third = np.delete(moment, i, axis=1)
        minors.append((-1) ** i * float(np.cross(first, second) @ third))
    return np.asarray(force @ np.array(minors) / kappa)


def found_by_elimination(a1: float, a2: float, kappa: float) -> list[tuple[float, float]]:
    """Return all (α3, α4), modulo π, with a horizontal force of zero: a quadratic has no more than two roots."""
    forms = np.empty((2, 2, 2))  # N_x or N_y, (cos, sin) of α3, (cos, sin) of α4
    for i, k in np.ndindex(2, 2):
        forms[:, i, k] = horizontal_direction((a1, a2, i * HALF_PI, k * HALF_PI), kappa)
    (x_cos, x_sin), (y_cos, y_sin) = forms

    def cross(first: FloatArray, second: FloatArray) -> float:
        return float(first[0] * second[1] - first[1] * second[0])

    cos_cos, sin_sin, sin_cos = cross(x_cos, y_cos), cross(x_sin, y_sin), cross(x_cos, y_sin) + cross(x_sin, y_cos)
    # a·cos² + b·sin·cos + c·sin² = (a + c)/2 + (a − c)/2·cos 2α + b/2·sin 2α
    size = math.hypot(cos_cos - sin_sin, sin_cos)
    assert size > 1e-12, "both equations share a factor: this is a fibre"
    middle = math.atan2(sin_cos, cos_cos - sin_sin)
    apart = math.acos(max(-1.0, min(1.0, -(cos_cos + sin_sin) / size)))
    found = []
    for double in (middle - apart, middle + apart):
        row = np.tensordot(forms, [math.cos(double / 2), math.sin(double / 2)], axes=(1, 0))
        cosine, sine = np.linalg.svd(row)[2][-1]
        found.append((double / 2, math.atan2(sine, cosine)))
    return found


def representations(found: list[tuple[float, float]]) -> int:
    """Return how many points of the closed square [−π/2, π/2]² the solutions modulo π are."""

    def times(angle: float) -> int:
        return 2 if distance_modulo_pi([angle], [HALF_PI]) < 1e-9 else 1

    return sum(times(a3) * times(a4) for a3, a4 in found)


def closed_form(a1: float, a2: float, numbers: Coefficients) -> list[tuple[float, float]]:
    return without_repeats([(root.alpha3, root.alpha4) for root in roots(a1, a2, numbers)])


class TestAgainstIndependentSolvers:
    @pytest.mark.no_cover
    @every_case
    def test_the_same_roots_as_a_general_root_finder(self, case: str) -> None:
        numbers, kappa = CASES[case]
        rng = np.random.default_rng(1)
        for a1, a2 in rng.uniform(-HALF_PI, HALF_PI, (20, 2)):
            theirs = found_by_search(a1, a2, kappa, rng.uniform(-HALF_PI, HALF_PI, (40, 2)))
            assert len(theirs) == 2
            assert_same_solutions(closed_form(a1, a2, numbers), theirs)

    @pytest.mark.no_cover
    @every_case
    @pytest.mark.parametrize("offset", [-1e-3, 1e-3])
    def test_the_same_roots_near_the_singular_lines(self, case: str, offset: float) -> None:
        numbers, kappa = CASES[case]
        delta = math.atan(kappa)
        rng = np.random.default_rng(2)
        firsts = [delta, delta - math.copysign(HALF_PI, delta), 0.7]
        seconds = [-delta, math.copysign(HALF_PI, delta) - delta, -1.1]
        for first, second in itertools.product(firsts, seconds):
            a1, a2 = first + offset, second + offset
            # Where red and blue nearly meet the root finder needs many starts to see both.
            theirs = found_by_search(a1, a2, kappa, rng.uniform(-HALF_PI, HALF_PI, (60, 2)))
            assert_same_solutions(closed_form(a1, a2, numbers), theirs, tolerance=1e-6)

    @pytest.mark.no_cover
    @every_case
    @settings(deadline=None, max_examples=100)
    @given(a1=angle, a2=angle)
    def test_the_same_roots_by_elimination(self, case: str, a1: float, a2: float) -> None:
        numbers, kappa = CASES[case]
        delta = math.atan(kappa)
        near = min(distance_modulo_pi([2 * a1], [2 * delta]), distance_modulo_pi([2 * a2], [-2 * delta]))
        assume(near > 1e-4)
        # The two roots of the quadratic are as near to each other as the point is to a line, and known so much less.
        tolerance = 1e-12 * (1 + 1 / near)
        assert_same_solutions(closed_form(a1, a2, numbers), found_by_elimination(a1, a2, kappa), tolerance)

    @pytest.mark.no_cover
    @every_case
    def test_counts_over_the_papers_grid(self, case: str) -> None:
        numbers, kappa = CASES[case]
        counts = np.array(
            [[representations(found_by_elimination(float(a1), float(a2), kappa)) for a2 in AXIS] for a1 in AXIS]
        )
        ours = np.array([[len(roots(float(a1), float(a2), numbers)) for a2 in AXIS] for a1 in AXIS])
        np.testing.assert_array_equal(ours, counts)

    def test_the_counts_are_figure_2(self) -> None:
        counts = root_arrays(AXIS[:, None], AXIS).count
        figure = np.full((17, 17), 2)
        figure[[0, -1], :] = figure[:, [0, -1]] = 3
        figure[np.ix_([0, -1], [0, -1])] = 5
        np.testing.assert_array_equal(counts, figure)
        assert counts.sum() == 650


class TestRoots:
    @every_case
    @settings(deadline=None, max_examples=60)
    @given(a1=angle, a2=angle)
    def test_each_root_solves_the_equations_and_carries_its_values(self, case: str, a1: float, a2: float) -> None:
        numbers, kappa = CASES[case]
        exact = ((1 / kappa - 2 * kappa), 1 - kappa**2, kappa)
        for root in roots(a1, a2, numbers):
            assert (root.alpha1, root.alpha2) == (a1, a2)
            assert abs(root.alpha3) <= HALF_PI
            assert abs(root.alpha4) <= HALF_PI
            roll, pitch = equations_4_and_5(root.alpha, kappa)
            assert max(abs(roll), abs(pitch)) < 1e-12 / abs(kappa)
            assert max(abs(root.R_phi), abs(root.R_theta)) < 1e-12 / abs(kappa)
            expected = equation_2(root.alpha, (5.592, 0.9716, 0.1687) if case == "published" else exact)
            assert pytest.approx(float(expected), abs=1e-12) == root.R
            assert root.types in PLANE_TYPES
            third, fourth = (a1, a2) if root.color == "red" else (2 * math.atan(kappa) - a1, -2 * math.atan(kappa) - a2)
            assert distance_modulo_pi([root.alpha3, root.alpha4], [third, fourth]) < 1e-12

    def test_R_belongs_to_the_coefficients_that_were_given(self) -> None:
        numbers = coefficients_of()
        other = replace(numbers, single=5.0, double=0.9, triple=0.2)
        for ours, theirs in zip(roots(0.9, -0.4, numbers), roots(0.9, -0.4, other), strict=True):
            assert ours.alpha == theirs.alpha
            assert pytest.approx(float(equation_2(ours.alpha, (5.592, 0.9716, 0.1687)))) == ours.R
            assert pytest.approx(float(equation_2(ours.alpha, (5.0, 0.9, 0.2)))) == theirs.R

    def test_red_comes_first_then_order_of_angles(self) -> None:
        corner = roots(HALF_PI, -HALF_PI)
        assert [root.color for root in corner] == ["red"] * 4 + ["blue"]
        pairs = [(root.alpha3, root.alpha4) for root in corner.of("red")]
        assert pairs == sorted(itertools.product((-HALF_PI, HALF_PI), repeat=2))
        assert corner.of("blue") == corner[4:]
        assert len(corner) == len(list(corner)) == 5

    @every_case
    def test_a_shift_by_pi_turns_the_sign_of_R(self, case: str) -> None:
        numbers, _ = CASES[case]
        for a2 in (-1.1, 0.2, 0.9):
            low, high, _ = roots(HALF_PI, a2, numbers)
            assert (low.alpha3, high.alpha3) == (-HALF_PI, HALF_PI)
            assert pytest.approx(-high.R, abs=1e-12) == low.R
            low, high, _ = roots(a2, -HALF_PI, numbers)
            assert (low.alpha4, high.alpha4) == (-HALF_PI, HALF_PI)
            assert pytest.approx(-high.R, abs=1e-12) == low.R

    @pytest.mark.parametrize("case", ["exact", "beetle_omni", "mirrored", "half"])
    def test_on_red_R_is_the_product_of_three_factors(self, case: str) -> None:
        numbers, kappa = CASES[case]
        delta = math.atan(kappa)
        for a1, a2 in np.random.default_rng(3).uniform(-HALF_PI, HALF_PI, (200, 2)):
            (red,) = roots(a1, a2, numbers).of("red")
            saddle = 2 * kappa * math.cos(a1) * math.cos(a2) - math.sin(a1 - a2)
            product = math.cos(a1 - delta) * math.cos(a2 + delta) * saddle * 2 / (kappa * math.cos(delta) ** 2)
            assert pytest.approx(product, abs=1e-11) == red.R

    def test_the_published_coefficients_stay_close_to_that_product(self) -> None:
        exact, published = coefficients_of(kind="exact"), coefficients_of()
        for a1, a2 in np.random.default_rng(4).uniform(-1.5, 1.5, (100, 2)):
            assert pytest.approx(roots(a1, a2, exact)[0].R, abs=4e-3) == roots(a1, a2, published)[0].R

    @pytest.mark.parametrize("case", ["exact", "beetle_omni", "mirrored", "half"])
    def test_on_blue_R_is_zero_and_published_coefficients_leave_a_residue(self, case: str) -> None:
        numbers, _ = CASES[case]
        first, second = np.random.default_rng(5).uniform(-HALF_PI, HALF_PI, (2, 300))
        answer = root_arrays(first, second, numbers)
        assert np.abs(answer.R[answer.sheet == -1]).max() < 1e-12
        residue = root_arrays(INTERIOR[:, None], INTERIOR)
        blue = residue.R[residue.sheet == -1]
        assert -4.34e-4 - 5e-7 <= blue.min() < -4e-4
        assert 2e-4 < blue.max() <= 2.11e-4 + 5e-7

    @pytest.mark.parametrize(
        ("a1", "a2", "name"),
        [
            (1.571, 0.0, "alpha1"),
            (-1.571, 0.0, "alpha1"),
            (math.nan, 0.0, "alpha1"),
            (math.inf, math.inf, "alpha1"),
            (0.0, 1.571, "alpha2"),
            (0.0, -4.0, "alpha2"),
            (0.0, math.nan, "alpha2"),
            (0.0, -math.inf, "alpha2"),
        ],
    )
    def test_angles_outside_are_refused_with_their_name(self, a1: float, a2: float, name: str) -> None:
        value = a1 if name == "alpha1" else a2
        calls: tuple[Callable[[], Any], ...] = (
            lambda: roots(a1, a2),
            lambda: root_arrays(a1, a2),
            lambda: root_arrays([0.0, a1], [a2, 0.0]),
            lambda: sheet_grid("red", [0.0, a1], [a2]),
            lambda: sheet_grid("blue", [a1], [0.0, a2]),
        )
        for call in calls:
            with pytest.raises(InputError) as caught:
                call()
            assert str(caught.value).startswith(f"{name}: {value!r} rad; allowed is −π/2 to π/2")

    @every_case
    def test_one_more_where_blue_lies_at_an_end_of_the_range(self, case: str) -> None:
        numbers, kappa = CASES[case]
        crossing, right = 2 * math.atan(kappa), math.copysign(HALF_PI, kappa)
        first, second = crossing - right, right - crossing
        for a1, a2, expected in ((first, 0.3, 2), (0.3, second, 2), (first, second, 4)):
            answer = roots(a1, a2, numbers)
            assert len(answer.of("red")) == 1
            assert len(answer.of("blue")) == expected
            assert root_arrays(a1, a2, numbers).count == 1 + expected
            for root in answer.of("blue"):
                assert max(map(abs, equations_4_and_5(root.alpha, kappa))) < 1e-12 / abs(kappa)
                assert max(abs(root.alpha3), abs(root.alpha4)) == pytest.approx(HALF_PI, abs=1e-12)
            assert len({(root.alpha3, root.alpha4) for root in answer}) == 1 + expected

    def test_the_ends_themselves_are_inside(self) -> None:
        for a1, a2 in itertools.product((-HALF_PI, HALF_PI), repeat=2):
            assert len(roots(a1, a2)) == 5


class TestManyAtOnce:
    @every_case
    @pytest.mark.parametrize("shape", [(), (0,), (7,), (3, 4), (2, 0, 3), (1, 2, 1, 3)])
    def test_arrays_agree_with_single_roots(self, case: str, shape: tuple[int, ...]) -> None:
        numbers, kappa = CASES[case]
        rng = np.random.default_rng(6)
        delta = math.atan(kappa)
        # Ends, corners and fibre lines among them.
        special = [-HALF_PI, HALF_PI, delta, -delta, 0.0, 0.4, -1.2]
        first, second = rng.choice(special, shape), rng.choice(special, shape)
        answer = root_arrays(first, second, numbers)
        assert answer.count.shape == shape
        assert answer.alpha.shape == (*shape, 5, 4)
        assert answer.types.shape == (*shape, 5, 2)
        for index in np.ndindex(*shape):
            self.compare(answer, index, roots(float(first[index]), float(second[index]), numbers))

    @staticmethod
    def compare(answer: Any, index: tuple[int, ...], one: Any) -> None:
        count = int(answer.count[index])
        assert count == len(one)
        for k, root in enumerate(one):
            assert answer.alpha[index][k].tolist() == list(root.alpha)
            assert answer.sheet[index][k] == {"red": 1, "blue": -1}[root.color]
            assert text_from_types(*answer.types[index][k]) == root.types
            assert answer.R[index][k] == pytest.approx(root.R, abs=1e-13)
        assert np.isnan(answer.alpha[index][count:]).all()
        assert np.isnan(answer.R[index][count:]).all()
        assert not answer.sheet[index][count:].any()
        assert not answer.types[index][count:].any()

    def test_the_two_angles_broadcast(self) -> None:
        answer = root_arrays(AXIS[:, None], AXIS)
        assert answer.count.shape == (17, 17)
        for i, j in ((0, 0), (0, 8), (16, 3), (8, 8), (9, 7)):
            self.compare(answer, (i, j), roots(float(AXIS[i]), float(AXIS[j])))

    @pytest.mark.no_cover
    @every_case
    @pytest.mark.parametrize(("rows", "columns"), [(17, 17), (5, 9), (1, 1), (0, 3), (64, 3)])
    def test_a_grid_is_an_outer_product_of_the_same_roots(self, case: str, rows: int, columns: int) -> None:
        numbers, _ = CASES[case]
        first, second = np.linspace(-HALF_PI, HALF_PI, rows), np.linspace(HALF_PI, -HALF_PI, columns)
        arrays = root_arrays(first[:, None], second, numbers, crossing_tolerance=0.05)
        total = 0
        for color in COLORS:
            grid = sheet_grid(color, first, second, numbers, crossing_tolerance=0.05)
            assert grid.color == color
            assert grid.R.shape == grid.types.shape == (len(grid.row), len(grid.column))
            total += grid.R.size
            at_node: dict[tuple[int, int], list[tuple[float, float, float, str]]] = {}
            for r, s in np.ndindex(*grid.R.shape):
                label = text_from_types(int(grid.types3[r]), int(grid.types4[s]))
                code = 3 * int(grid.types3[r]) + int(grid.types4[s])
                assert grid.types[r, s] == code
                entry = (float(grid.alpha3[r]), float(grid.alpha4[s]), float(grid.R[r, s]), label)
                at_node.setdefault((int(grid.row[r]), int(grid.column[s])), []).append(entry)
            for i, j in np.ndindex(rows, columns):
                ours = sorted(at_node[i, j])
                chosen = arrays.sheet[i, j] == {"red": 1, "blue": -1}[color]
                theirs = [
                    (*arrays.alpha[i, j, k, 2:].tolist(), arrays.R[i, j, k], text_from_types(*arrays.types[i, j, k]))
                    for k in np.flatnonzero(chosen)
                ]
                assert [one[:2] for one in ours] == [one[:2] for one in theirs]
                assert [one[3] for one in ours] == [one[3] for one in theirs]
                np.testing.assert_allclose([one[2] for one in ours], [one[2] for one in theirs], atol=1e-13 / 0.05)
        assert total == arrays.count.sum()

    @pytest.mark.parametrize(("first", "second"), [(0.3, [0.1]), ([0.1], 0.3), ([[0.1]], [0.1]), ([0.1], [[0.1]])])
    def test_axes_have_one_dimension(self, first: Any, second: Any) -> None:
        with pytest.raises(InputError, match=r"alpha1, alpha2: axes of .* dimensions; allowed is 1 and 1"):
            sheet_grid("red", first, second)

    @every_case
    @settings(deadline=None, max_examples=50)
    @given(a1=angle, a2=angle)
    def test_sheets_are_what_roots_lie_on(self, case: str, a1: float, a2: float) -> None:
        numbers, _ = CASES[case]
        for color in COLORS:
            on_sheet = [float(value) for value in sheet_angles(color, a1, a2, numbers)]
            assert max(map(abs, on_sheet)) <= HALF_PI
            for root in roots(a1, a2, numbers).of(color):
                assert distance_modulo_pi([root.alpha3, root.alpha4], on_sheet) < 1e-12


class TestWraps:
    @every_case
    def test_blue_wraps_where_it_leaves_the_square_and_nowhere_else(self, case: str) -> None:
        numbers, kappa = CASES[case]
        delta = math.atan(kappa)
        fine = np.linspace(-HALF_PI, HALF_PI, 1001)
        third, fourth = sheet_angles("blue", fine, fine, numbers)
        plain3, plain4 = 2 * delta - fine, -2 * delta - fine
        for plain, wrapped in ((plain3, third), (plain4, fourth)):
            inside = np.abs(plain) <= HALF_PI - 1e-9
            np.testing.assert_allclose(wrapped[inside], plain[inside], atol=1e-12)
            outside = np.abs(plain) > HALF_PI + 1e-9
            np.testing.assert_allclose(wrapped[outside], (plain - np.copysign(PI, plain))[outside], atol=1e-12)
            assert outside.any()

    def test_on_the_papers_grid_the_wrap_meets_two_lines_of_nodes(self) -> None:
        delta = math.atan(PUBLISHED_KAPPA)
        third, fourth = sheet_angles("blue", INTERIOR, INTERIOR, coefficients_of())
        wraps3 = np.abs(third - (2 * delta - INTERIOR)) > 1
        wraps4 = np.abs(fourth - (-2 * delta - INTERIOR)) > 1
        np.testing.assert_array_equal(np.round(INTERIOR[wraps3] / STEP), [-7])
        np.testing.assert_array_equal(np.round(INTERIOR[wraps4] / STEP), [7])

    def test_a_vertex_of_gait_1_tells_the_wrap_from_its_neighbours(self) -> None:
        # (5π/16, 3π/8) has α4 = −1.512 in the paper; one node further the same plane comes in from above.
        numbers = coefficients_of()
        (blue,) = roots(5 * STEP, 6 * STEP, numbers).of("blue")
        assert round(blue.alpha4, 3) == -1.512
        (wrapped,) = roots(5 * STEP, 7 * STEP, numbers).of("blue")
        assert wrapped.alpha4 == pytest.approx(blue.alpha4 - STEP + PI)


class TestFibers:
    @every_case
    def test_on_a_fiber_one_angle_is_free(self, case: str) -> None:
        numbers, kappa = CASES[case]
        delta = math.atan(kappa)
        rng = np.random.default_rng(7)
        exact = ((1 / kappa - 2 * kappa), 1 - kappa**2, kappa)
        published = (5.592, 0.9716, 0.1687)
        for a2 in rng.uniform(-1.5, 1.5, 3):
            answer = roots(delta, a2, numbers)
            (fiber,) = answer.fibers
            assert (fiber.name, fiber.fixed, fiber.free) == ("first", "alpha3", "alpha4")
            assert fiber.types == "(?,*)"
            assert not fiber.singular
            assert fiber.values == pytest.approx((delta,))
            assert {root.color for root in answer} == {"red", "blue"}
            for a4 in rng.uniform(-HALF_PI, HALF_PI, 20):
                alpha = (delta, a2, fiber.values[0], a4)
                assert max(map(abs, equations_4_and_5(alpha, kappa))) < 1e-12 / abs(kappa)
                expected = math.sin(a2 + a4 + 2 * delta) / (kappa * math.cos(delta) ** 2)
                assert float(equation_2(alpha, exact)) == pytest.approx(expected, abs=1e-12)
                if case == "published":
                    assert float(equation_2(alpha, published)) == pytest.approx(expected, abs=2e-3)
                assert float(level_determinant(alpha, numbers)) == pytest.approx(
                    expected, abs=2e-3 if case == "published" else 1e-12
                )
        for a1 in rng.uniform(-1.5, 1.5, 3):
            answer = roots(a1, -delta, numbers)
            (fiber,) = answer.fibers
            assert (fiber.name, fiber.fixed, fiber.free) == ("second", "alpha4", "alpha3")
            assert fiber.types == "(*,?)"
            assert not fiber.singular
            assert fiber.values == pytest.approx((-delta,))
            for a3 in rng.uniform(-HALF_PI, HALF_PI, 20):
                alpha = (a1, -delta, a3, fiber.values[0])
                assert max(map(abs, equations_4_and_5(alpha, kappa))) < 1e-12 / abs(kappa)
                expected = -math.sin(a1 + a3 - 2 * delta) / (kappa * math.cos(delta) ** 2)
                assert float(equation_2(alpha, exact)) == pytest.approx(expected, abs=1e-12)

    @pytest.mark.parametrize("case", ["exact", "beetle_omni", "mirrored", "half"])
    def test_the_copies_a_right_angle_away_are_singular_everywhere(self, case: str) -> None:
        numbers, kappa = CASES[case]
        vehicle = Vehicle(drag_ratio=abs(kappa), first_rotor_spin="clockwise" if kappa > 0 else "counterclockwise")
        delta = math.atan(kappa)
        copy1 = delta - math.copysign(HALF_PI, delta)
        rng = np.random.default_rng(8)
        for _ in range(5):
            other, *free = rng.uniform(-1.5, 1.5, 6)
            (first,) = roots(copy1, other, numbers).fibers
            (second,) = roots(other, -copy1, numbers).fibers
            assert (first.name, second.name) == ("first", "second")
            assert first.singular
            assert second.singular
            assert first.values == pytest.approx((copy1,))
            assert second.values == pytest.approx((-copy1,))
            for value in free:
                for alpha in ((copy1, other, first.values[0], value), (other, -copy1, value, second.values[0])):
                    assert max(map(abs, equations_4_and_5(alpha, kappa))) < 1e-12 / abs(kappa)
                    np.testing.assert_allclose(zero_moment_direction(alpha, vehicle), 0, atol=1e-14)
                    roll, pitch = rng.uniform(-1.4, 1.4, 2)
                    assert abs(determinant(alpha, coefficients_of(vehicle, "exact"), roll, pitch)) < 1e-12 / abs(kappa)

    @every_case
    def test_off_the_lines_there_are_none(self, case: str) -> None:
        numbers, kappa = CASES[case]
        delta = math.atan(kappa)
        assert [fiber.name for fiber in roots(delta, -delta, numbers).fibers] == ["first", "second"]
        for offset in (-1e-3, -1e-6, 1e-6, 1e-3):
            assert roots(delta + offset, -delta - offset, numbers).fibers == ()
            # A free angle would leave residuals in proportion to the offset, so "none" is the truth.
            assert max(map(abs, equations_4_and_5((delta + offset, 0.3, delta + offset, 1.0), kappa))) > abs(offset)

    def test_none_passes_through_a_node_of_the_papers_grid(self) -> None:
        assert not any(roots(a1, a2).fibers for a1, a2 in itertools.product(AXIS.tolist(), repeat=2))

    @every_case
    def test_red_and_blue_meet_where_both_fibers_cross(self, case: str) -> None:
        numbers, kappa = CASES[case]
        delta = math.atan(kappa)
        right = math.copysign(HALF_PI, delta)
        for a1, a2 in itertools.product((delta, delta - right), (-delta, right - delta)):
            red, blue = roots(a1, a2, numbers)
            assert distance_modulo_pi(red.alpha, blue.alpha) < 1e-12
            assert max(abs(red.R), abs(blue.R)) < (2e-3 if case == "published" else 1e-12 / abs(kappa))
        # Nowhere else: their distance is that to the lines.
        for a1, a2 in np.random.default_rng(9).uniform(-1.5, 1.5, (50, 2)):
            red, blue = roots(a1, a2, numbers)
            apart = max(distance_modulo_pi([2 * a1], [2 * delta]), distance_modulo_pi([2 * a2], [-2 * delta]))
            assert distance_modulo_pi(red.alpha, blue.alpha) == pytest.approx(apart, abs=1e-12)


class TestPlaneTypes:
    def nearest(self, axis: FloatArray, line: float) -> set[int]:
        """Return the nodes nearest to a line modulo π/2, one for each copy of the line that has one."""
        reach = (axis[1] - axis[0]) / 2
        copies = line + HALF_PI * np.arange(-4, 5)
        copies = copies[(axis[0] - reach <= copies) & (copies <= axis[-1] + reach)]
        return {int(np.argmin(np.abs(axis - copy))) for copy in copies}

    def test_on_the_papers_grid_the_question_marks_are_where_the_paper_has_them(self) -> None:
        numbers = coefficients_of()
        for color in COLORS:
            third, fourth = types_of(color, AXIS, AXIS, numbers)
            assert np.round(AXIS[third == 0] / STEP).tolist() == [-7, 1]
            assert np.round(AXIS[fourth == 0] / STEP).tolist() == [-1, 7]
            assert set(third.tolist()) == set(fourth.tolist()) == {0, 1 if color == "red" else -1}

    @every_case
    @pytest.mark.parametrize("divisions", [8, 16, 30, 64, 100])
    def test_half_a_step_marks_the_nearest_nodes_of_any_grid(self, case: str, divisions: int) -> None:
        numbers, kappa = CASES[case]
        delta = math.atan(kappa)
        axis = np.linspace(-HALF_PI, HALF_PI, divisions + 1)
        for color in COLORS:
            third, fourth = types_of(color, axis, axis, numbers, HALF_PI / divisions)
            assert set(np.flatnonzero(third == 0)) == self.nearest(axis, delta)
            assert set(np.flatnonzero(fourth == 0)) == self.nearest(axis, -delta)

    def test_a_line_halfway_between_two_nodes_marks_both(self) -> None:
        # δ = π/32: whichever way the distances are rounded, half a step is within half a step.
        numbers = coefficients_of(Vehicle(drag_ratio=math.tan(STEP / 2)))
        third, fourth = types_of("red", AXIS, AXIS, numbers, STEP / 2)
        assert np.round(AXIS[third == 0] / STEP).tolist() == [-8, -7, 0, 1, 8]
        assert np.round(AXIS[fourth == 0] / STEP).tolist() == [-8, -1, 0, 7, 8]

    def test_the_default_tolerance_is_half_a_step_of_the_papers_grid(self) -> None:
        assert DEFAULT_CROSSING_TOLERANCE == STEP / 2
        assert roots(0.9, -0.4, crossing_tolerance=2.0)[0].types == "(?,?)"
        assert roots(0.9, -0.4, crossing_tolerance=0.0)[0].types == "(+,+)"

    @every_case
    def test_seven_categories_and_no_other(self, case: str) -> None:
        numbers, _ = CASES[case]
        arrays = root_arrays(AXIS[:, None], AXIS, numbers)
        found = {text_from_types(*pair) for pair in arrays.types[arrays.sheet != 0]}
        assert found == {"(+,+)", "(-,-)", "(+,?)", "(?,+)", "(-,?)", "(?,-)", "(?,?)"} == set(PLANE_TYPES)

    def test_types_follow_the_slopes_of_the_planes(self) -> None:
        # "+" increases α3 with α1, "−" decreases it: the paper's definition, by finite differences.
        numbers = coefficients_of()
        for color, slope in (("red", 1.0), ("blue", -1.0)):
            for a1, a2 in ((0.9, -0.7), (-0.5, 0.6), (1.2, 1.0)):
                (here,) = roots(a1, a2, numbers).of(color)  # type: ignore[arg-type]
                (there,) = roots(a1 + 1e-3, a2 + 2e-3, numbers).of(color)  # type: ignore[arg-type]
                assert there.alpha3 - here.alpha3 == pytest.approx(slope * 1e-3)
                assert there.alpha4 - here.alpha4 == pytest.approx(slope * 2e-3)
                assert here.types == ("(+,+)" if slope > 0 else "(-,-)")


class TestFigures:
    """The pictures of negative and positive R over the interior of the paper's grid, four-digit coefficients."""

    @staticmethod
    def independent_picture() -> dict[tuple[int, int], dict[str, float]]:
        """Return R by color for the nodes (i, j)·π/16, with roots by elimination and R from equation (2)."""
        picture = {}
        for i, j in itertools.product(range(-7, 8), repeat=2):
            a1, a2 = i * STEP, j * STEP
            found = {}
            for third, fourth in found_by_elimination(a1, a2, PUBLISHED_KAPPA):
                a3, a4 = (x - PI * round(x / PI) for x in (third, fourth))
                color = "red" if distance_modulo_pi([a3, a4], [a1, a2]) < 1e-6 else "blue"
                found[color] = float(equation_2([a1, a2, a3, a4], (5.592, 0.9716, 0.1687)))
            picture[i, j] = found
        return picture

    @staticmethod
    def label(i: int, j: int, color: str) -> str:
        plane = "+" if color == "red" else "-"
        third = "?" if i in (1, -7) else plane
        fourth = "?" if j in (-1, 7) else plane
        return f"({third},{fourth})"

    def ours(self, sign: int) -> dict[tuple[int, int], dict[str, str]]:
        """Return the labels by color of the roots whose R has a sign."""
        picture: dict[tuple[int, int], dict[str, str]] = {}
        for i, j in itertools.product(range(-7, 8), repeat=2):
            answer = roots(i * STEP, j * STEP)
            assert len(answer) == 2
            picture[i, j] = {root.color: root.types for root in answer if root.R * sign > 0}
        return picture

    def test_both_signs_agree_with_the_independent_picture(self) -> None:
        expected = self.independent_picture()
        for sign in (1, -1):
            for node, labels in self.ours(sign).items():
                assert set(expected[node]) == {"red", "blue"}
                assert labels == {
                    color: self.label(*node, color) for color, value in expected[node].items() if value * sign > 0
                }

    def test_figure_16_has_red_only_together_with_blue(self) -> None:
        negative = self.ours(-1)
        kinds = Counter("+".join(sorted(labels)) or "none" for labels in negative.values())
        assert kinds == {"blue+red": 97, "blue": 100, "none": 28}
        # Blue alone in the upper left half, red and blue below the diagonal.
        for (i, j), labels in negative.items():
            if i - j >= 4 and i != -7 and j != 7:
                assert set(labels) == {"red", "blue"}
            if j > i:
                assert "red" not in labels
        types = Counter(label for labels in negative.values() for label in labels.values())
        assert set(types) == set(PLANE_TYPES)
        assert sum(types.values()) == 2 * 97 + 100

    def test_the_types_in_figure_16_add_up_from_its_lines(self) -> None:
        # Blue has R < 0 at 197 nodes, red at 97: what the lines of question marks take from each.
        negative = self.ours(-1)
        expected: Counter[str] = Counter()
        for node, values in self.independent_picture().items():
            expected.update(self.label(*node, color) for color, value in values.items() if value < 0)
        assert Counter(label for labels in negative.values() for label in labels.values()) == expected
        assert sum(expected.values()) == 97 + 197

    def test_positive_R(self) -> None:
        positive = self.ours(1)
        red = {node for node, labels in positive.items() if "red" in labels}
        blue = {node for node, labels in positive.items() if "blue" in labels}
        # The paper denies the 28 blue ones, which are rounding; its triangle holds 91 of the 128 red ones. It does not
        # list (?,?), the type of the triangle's own first vertex.
        assert (len(red), len(blue)) == (128, 28)
        triangle = {(i, j) for i, j in positive if j - i >= 2}
        assert len(triangle) == 91
        assert triangle <= red
        assert {positive[node]["red"] for node in red} == {"(+,+)", "(+,?)", "(?,+)", "(?,?)"}

    def test_with_exact_coefficients_no_blue_node_has_a_sign(self) -> None:
        arrays = root_arrays(INTERIOR[:, None], INTERIOR, coefficients_of(kind="exact"))
        assert np.abs(arrays.R[arrays.sheet == -1]).max() < 1e-13
        red = arrays.R[arrays.sheet == 1]
        assert ((red < 0).sum(), (red > 0).sum()) == (97, 128)


@pytest.mark.parametrize("value", ["x", [0.1, 0.2], 1j, None, np.zeros(2)])
def test_one_angle_is_asked_for(value: Any) -> None:
    with pytest.raises(InputError, match="^alpha1: "):
        roots(value, 0.1)
    with pytest.raises(InputError, match="^alpha2: "):
        roots(0.1, value)
    assert roots("pi/8", 0.1)[0].alpha1 == math.pi / 8  # type: ignore[arg-type]


def test_colors_are_checked() -> None:
    for refuse in (lambda: sheet_angles("green", 0.1, 0.2, coefficients_of()), lambda: sheet_grid("green", [0], [0])):  # type: ignore[arg-type]
        with pytest.raises(InputError, match="color: 'green'; allowed are 'red' and 'blue'"):
            refuse()


def test_what_are_no_angles_is_shown() -> None:
    with pytest.raises(InputError, match=r"^alpha1: \['x'\]; allowed are angles in radians$"):
        root_arrays(["x"], [0.0])
    with pytest.raises(InputError, match=r"^alpha2: \[1j\]; allowed are angles in radians$"):
        sheet_grid("red", [0.0], [1j])


@pytest.mark.parametrize("tolerance", [-1e-3, math.inf, math.nan, "0.1", None, True])
def test_the_crossing_tolerance_is_checked(tolerance: Any) -> None:
    for ask in (roots, root_arrays):
        with pytest.raises(InputError) as caught:
            ask(0.1, 0.2, crossing_tolerance=tolerance)
        assert str(caught.value) == f"crossing_tolerance: {tolerance!r}; allowed is a finite number ≥ 0 (rad)"


def test_residuals_of_zero_have_no_sign() -> None:
    """They are printed: −0.0 would make a reader look for a reason."""
    for a1, a2 in itertools.product(INTERIOR, INTERIOR):
        for root in roots(a1, a2):
            for residual in (root.R_phi, root.R_theta):
                assert residual != 0 or math.copysign(1.0, residual) == 1.0


def test_arrays_hold_whole_numbers_of_one_byte_and_angles_of_eight() -> None:
    arrays, grid = root_arrays(AXIS[:, None], AXIS), sheet_grid("blue", AXIS, AXIS)
    assert {part.dtype for part in (arrays.sheet, arrays.types, grid.types3, grid.types4)} == {np.dtype(np.int8)}
    assert {part.dtype for part in (arrays.alpha, arrays.R, grid.alpha3, grid.alpha4, grid.R)} == {np.dtype(float)}


@pytest.mark.parametrize("color", COLORS)
def test_angles_of_few_bits_are_computed_with_in_full(color: Any) -> None:
    for narrow in (np.int8, np.float32):
        for ours, expected in zip(
            sheet_angles(color, narrow(1), narrow(-1), coefficients_of()),
            sheet_angles(color, 1.0, -1.0, coefficients_of()),
            strict=True,
        ):
            assert (ours, ours.dtype) == (expected, np.dtype(float))
    delta = coefficients_of().delta
    for single in np.linspace(-1.5, 1.5, 40, dtype=np.float32):
        for which, line in enumerate((delta, -delta)):
            to_line = float(single) - line
            distance = abs(to_line - HALF_PI * round(to_line / HALF_PI))
            within, beyond = (
                types_of(color, single, single, coefficients_of(), distance + more)[which] for more in (1e-9, -1e-9)
            )
            assert (within == 0, beyond == 0) == (True, False)


class TestSheetsAlong:
    """Which sheet a row lies on, when nobody says."""

    EXACT = coefficients_of(kind="exact")

    @settings(deadline=None, max_examples=60)
    @given(
        points=st.lists(st.tuples(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5)), min_size=1, max_size=6),
        color=st.sampled_from(COLORS),
        turns=st.tuples(st.integers(-1, 1), st.integers(-1, 1)),
    )
    def test_rows_of_a_sheet_mod_pi_lie_on_it(
        self, points: list[tuple[float, float]], color: Any, turns: tuple[int, int]
    ) -> None:
        a1, a2 = np.array(points).T
        third, fourth = sheet_angles(color, a1, a2, self.EXACT)
        alpha = np.column_stack([a1, a2, third + turns[0] * np.pi, fourth + turns[1] * np.pi])
        red, blue = family_distances(alpha, self.EXACT)[..., :2].T
        assert ((red if color == "red" else blue) < 1e-9).all()
        # Distance from the other sheet: in the larger of the two angles, mod π.
        other = sheet_angles("blue" if color == "red" else "red", a1, a2, self.EXACT)
        expected = np.abs(np.sin(np.stack([third - other[0], fourth - other[1]]))).max(axis=0)
        np.testing.assert_allclose(np.sin(blue if color == "red" else red), expected, atol=1e-9)
        sheet = families_along(alpha, self.EXACT, 1e-6)
        apart = np.maximum(red, blue) > 1e-6
        assert (sheet[apart] == (1 if color == "red" else -1)).all()

    def test_rows_on_neither(self) -> None:
        alpha = [[0.9, -0.9, 0.9, -0.9], [0.9, -0.9, 0.95, -0.9], [0.9, -0.9, 0.9, -0.9 + 1e-3]]
        assert families_along(alpha, self.EXACT, 2e-3).tolist() == [1, 0, 1]
        assert families_along(alpha, self.EXACT, 0.1).tolist() == [1, 1, 1]
        assert families_along(alpha, self.EXACT, 1e-4).tolist() == [1, 0, 0]

    def test_rows_on_both_follow_their_neighbours(self) -> None:
        delta = self.EXACT.delta
        both = [delta, -delta, delta, -delta]
        red, blue = [0.9, -0.9, 0.9, -0.9], [0.9, -0.9, 2 * delta - 0.9, -2 * delta + 0.9]
        off = [0.9, -0.9, 0.0, 0.0]

        def sheets(*rows: list[float], before: int = 0) -> list[int]:
            return [int(one) for one in families_along(list(rows), self.EXACT, 1e-6, before=before)]

        assert sheets(both) == [1]
        assert sheets(both, before=-1) == [-1]
        assert sheets(both, both, blue, both, red, both) == [-1, -1, -1, -1, 1, 1]
        assert sheets(red, both, both, blue) == [1, 1, 1, -1]
        assert sheets(blue, off, both) == [-1, 0, 1]
        assert sheets(both, off, both, blue) == [1, 0, 1, -1]


def test_ends_of_the_range() -> None:
    angles = [-HALF_PI, HALF_PI - 1e-13, HALF_PI - 1e-11, 0.0]
    assert at_end_of_range(angles).tolist() == [True, True, False, False]


def test_sheets_are_small_integers_and_follow_nothing_unless_told() -> None:
    exact = coefficients_of(kind="exact")
    meeting, beside = (exact.delta, -exact.delta), (0.5, -0.7)
    for color, sign in zip(COLORS, (1, -1), strict=True):
        rows = []
        for a1, a2 in (meeting, beside):
            a3, a4 = sheet_angles(color, a1, a2, exact)
            rows.append([a1, a2, float(a3), float(a4)])
        for alpha, expected in ((rows, [sign, sign]), (rows[1:], [sign]), (rows[:1], [1]), (rows[::-1], [sign, sign])):
            sheet = families_along(alpha, exact, 1e-6)
            assert sheet.tolist() == expected
            assert sheet.dtype == np.int8


def test_distances_from_the_sheets_keep_the_shape_of_the_points() -> None:
    exact = coefficients_of(kind="exact")
    alpha = np.random.default_rng(3).uniform(-1.2, 1.2, (2, 3, 4))
    red, blue = np.moveaxis(family_distances(alpha, exact)[..., :2], -1, 0)
    assert red.shape == blue.shape == (2, 3)
    for k in np.ndindex(2, 3):
        np.testing.assert_allclose(family_distances(alpha[k], exact)[:2], [red[k], blue[k]])
    flat = alpha.reshape(-1, 4)
    off = np.abs(flat[:, 2:] - flat[:, :2])
    np.testing.assert_allclose(red.ravel(), np.minimum(off % np.pi, np.pi - off % np.pi).max(axis=1))
