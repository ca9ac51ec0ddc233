"""Sheets, roots and plane types, against a solver that knows nothing of the closed form, and Figures 15 and 16.

It starts from forces and torques: the horizontal part of N = F·w₀, with w₀ from minors of τ, is linear in
(cos α3, sin α3) and in (cos α4, sin α4), so that all its zeros follow from one quadratic.
"""

from __future__ import annotations

import itertools
import math
from math import pi
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import assume, given, settings, strategies as st

import gaitgraph as gg
from gaitgraph.gait.gait import Gait
from gaitgraph.invertibility.coefficients import Coefficients, coefficients_of
from gaitgraph.invertibility.matrices import (
    determinant,
    level_determinant,
    pitch_sensitivity,
    roll_sensitivity,
    zero_moment_direction,
)
from gaitgraph.surface.sheets import (
    PLANE_TYPES,
    colors_along,
    neighbors_allowed,
    root_arrays,
    roots,
    sheet_distances,
    sheet_jumps,
    text_from_types,
    types_from_text,
    types_may_be_adjacent,
    types_of,
)
from gaitgraph.vehicle import Vehicle, vehicle_named
from tests.samples import EXACT, HALF_PI, MIRRORED, PUBLISHED

if TYPE_CHECKING:
    from collections.abc import Sequence

FloatArray = npt.NDArray[np.float64]

STEP = pi / 16
AXIS = np.linspace(-HALF_PI, HALF_PI, 17)

# κ with which the two equations are written out here; 2.880 = (1/κ − κ)/2 is what the paper's digits mean.
CASES: dict[str, tuple[Coefficients, float]] = {
    "published": (PUBLISHED, math.hypot(2.880, 1.0) - 2.880),
    "exact": (EXACT, 2.423e-7 / (8.048e-6 * 0.1785)),
    "beetle_omni": (
        coefficients_of(vehicle_named("beetle_omni").replace(rotor_height=0.0)),
        -0.0165 / 0.2754,
    ),
    "mirrored": (coefficients_of(MIRRORED), -2.423e-7 / (8.048e-6 * 0.1785)),
    "half": (coefficients_of(Vehicle(name="half", drag_ratio=0.5)), 0.5),
}
every_case = pytest.mark.parametrize("case", CASES)
angle = st.floats(-HALF_PI, HALF_PI)


def vehicle_with(kappa: float) -> Vehicle:
    spin: Any = "clockwise" if kappa > 0 else "counterclockwise"
    return Vehicle(drag_ratio=abs(kappa), first_rotor_spin=spin)


def residual(alpha: Any, numbers: Coefficients) -> float:
    """Return the larger of |Rφ| and |Rθ|; another test compares both with the paper, term by term."""
    roll, pitch = roll_sensitivity(alpha, numbers), pitch_sensitivity(alpha, numbers)
    return float(max(abs(roll), abs(pitch)))


def distance_modulo_pi(first: Any, second: Any) -> float:
    difference = np.subtract(first, second)
    return float(np.abs(difference - pi * np.rint(difference / pi)).max())


# Roots


def horizontal_direction(alpha: Sequence[float], k: float) -> FloatArray:
    """Return (N_x, N_y), N = F·w₀, with w₀ made of the 3×3 minors of τ."""
    (s1, s2, s3, s4), (c1, c2, c3, c4) = map(math.sin, alpha), map(math.cos, alpha)
    force = np.array([[0, s2, 0, -s4], [s1, 0, -s3, 0]])
    roll, pitch = [0, c2 - k * s2, 0, -c4 + k * s4], [c1 + k * s1, 0, -c3 - k * s3, 0]
    yaw = [s1 - k * c1, -s2 - k * c2, s3 - k * c3, -s4 - k * c4]
    moment = np.array([roll, pitch, yaw])
    minors = [(-1) ** i * np.linalg.det(np.delete(moment, i, axis=1)) for i in range(4)]
    return np.asarray(force @ np.array(minors) / k)


def found_by_elimination(a1: float, a2: float, kappa: float) -> list[list[float]]:
    """Return all (α3, α4), modulo π, with a horizontal force of zero: a quadratic has no more than two roots."""
    forms = np.empty((2, 2, 2))  # N_x or N_y, (cos, sin) of α3, (cos, sin) of α4
    for i, k in np.ndindex(2, 2):
        forms[:, i, k] = horizontal_direction((a1, a2, i * HALF_PI, k * HALF_PI), kappa)
    (x_cos, x_sin), (y_cos, y_sin) = forms

    def cross(first: FloatArray, second: FloatArray) -> float:
        return float(first[0] * second[1] - first[1] * second[0])

    # a·cos² + b·sin·cos + c·sin² = (a + c)/2 + (a − c)/2·cos 2α + b/2·sin 2α
    a, c = cross(x_cos, y_cos), cross(x_sin, y_sin)
    b = cross(x_cos, y_sin) + cross(x_sin, y_cos)
    middle = math.atan2(b, a - c)
    apart = math.acos(np.clip(-(a + c) / math.hypot(a - c, b), -1.0, 1.0))
    solutions = []
    for double in (middle - apart, middle + apart):
        turn = [math.cos(double / 2), math.sin(double / 2)]
        row = np.tensordot(forms, turn, axes=(1, 0))
        cosine, sine = np.linalg.svd(row)[2][-1]
        solutions.append([double / 2, math.atan2(sine, cosine)])
    return solutions


@pytest.mark.no_cover
@every_case
@settings(deadline=None, max_examples=50)
@given(a1=angle, a2=angle)
def test_the_same_roots_by_elimination(case: str, a1: float, a2: float) -> None:
    numbers, kappa = CASES[case]
    delta = math.atan(kappa)
    near = min(
        distance_modulo_pi([2 * a1], [2 * delta]),
        distance_modulo_pi([2 * a2], [-2 * delta]),
    )
    assume(near > 1e-4)
    # The two roots of the quadratic are as near to each other as the point is to a line, and known so much less.
    tolerance = 1e-12 * (1 + 1 / near)
    ours = [[root.alpha3, root.alpha4] for root in roots(a1, a2, coefficients=numbers)]
    theirs = found_by_elimination(a1, a2, kappa)
    for some, others in ((ours, theirs), (theirs, ours)):
        for root in some:
            apart = [distance_modulo_pi(root, other) for other in others]
            assert min(apart) <= tolerance, (ours, theirs)


@every_case
@settings(deadline=None, max_examples=30)
@given(a1=angle, a2=angle)
def test_each_root_carries_its_values(case: str, a1: float, a2: float) -> None:
    numbers, kappa = CASES[case]
    delta = math.atan(kappa)
    of_color = {"red": (a1, a2), "blue": (2 * delta - a1, -2 * delta - a2)}
    for root in roots(a1, a2, coefficients=numbers):
        assert root.alpha == (a1, a2, root.alpha3, root.alpha4)
        assert max(abs(root.alpha3), abs(root.alpha4)) <= HALF_PI
        opposite = root.alpha3, root.alpha4
        assert distance_modulo_pi(opposite, of_color[root.color]) < 1e-12
        assert max(abs(root.R_phi), abs(root.R_theta)) < 1e-12 / abs(kappa)
        assert "-0.0" not in (str(root.R_phi), str(root.R_theta))
        R = float(level_determinant(root.alpha, numbers))
        assert pytest.approx(R, abs=1e-12) == root.R
        assert root.types in PLANE_TYPES


@every_case
def test_one_more_where_blue_lies_at_an_end_of_the_range(case: str) -> None:
    numbers, kappa = CASES[case]
    end = 2 * math.atan(kappa) - math.copysign(HALF_PI, kappa)
    for point, expected in (((end, 0.3), 2), ((0.3, -end), 2), ((end, -end), 4)):
        red, *blue = roots(*point, coefficients=numbers)
        assert red.color == "red"
        assert len({root.alpha for root in blue}) == len(blue) == expected
        for root in blue:
            assert root.color == "blue"
            assert residual(root.alpha, numbers) < 1e-12 / abs(kappa)
            largest = max(abs(root.alpha3), abs(root.alpha4))
            assert largest == pytest.approx(HALF_PI, abs=1e-12)


@every_case
@pytest.mark.parametrize("shape", [(), (0,), (2, 0, 3), (1, 4, 1, 3)])
def test_arrays_agree_with_single_roots(case: str, shape: tuple[int, ...]) -> None:
    numbers, kappa = CASES[case]
    delta = math.atan(kappa)
    # Ends, corners and fibre lines among them.
    special = [-HALF_PI, HALF_PI, delta, -delta, 0.0, 0.4, -1.2]
    first, second = np.random.default_rng(6).choice(special, (2, *shape))
    arrays = root_arrays(first, second, coefficients=numbers)
    assert arrays.alpha.shape == (*shape, 5, 4)
    assert arrays.types.shape == (*shape, 5, 2)
    for index in np.ndindex(*shape):
        single = roots(float(first[index]), float(second[index]), coefficients=numbers)
        count = len(single)
        assert arrays.count[index] == count
        alpha, R = arrays.alpha[index], arrays.R[index]
        np.testing.assert_allclose(
            alpha[:count], [root.alpha for root in single], rtol=0, atol=1e-13
        )
        np.testing.assert_allclose(R[:count], [root.R for root in single], atol=1e-12)
        codes = [1 if root.color == "red" else -1 for root in single]
        assert arrays.sheet[index].tolist() == codes + [0] * (5 - count)
        types = [list(types_from_text(root.types)) for root in single]
        assert arrays.types[index].tolist() == types + [[0, 0]] * (5 - count)
        assert np.isnan(alpha[count:]).all()
        assert np.isnan(R[count:]).all()


# Fibres


def on_fiber(fiber: int, at: float, free: Any) -> FloatArray:
    """Return points of the first fibre with free angles (α2, α4), or of the second with (α1, α3)."""
    one, other = np.moveaxis(np.asarray(free, dtype=float), -1, 0)
    fixed = np.full_like(one, at)
    columns = [fixed, one, fixed, other] if fiber == 1 else [one, fixed, other, fixed]
    return np.stack(columns, axis=-1)


@every_case
def test_on_a_fibre_one_angle_is_free(case: str) -> None:
    numbers, kappa = CASES[case]
    delta, vehicle = math.atan(kappa), vehicle_with(kappa)
    exact = coefficients_of(vehicle, "exact")
    copy = delta - math.copysign(HALF_PI, delta)  # the matrix is singular there
    random = np.random.default_rng(7).uniform(-1.4, 1.4, (10, 4))
    for a, free, roll, pitch in random.tolist():
        for point, number, expected in (
            ((delta, a), 1, ("first", "alpha3", "alpha4", "(?,*)", False)),
            ((a, -delta), 2, ("second", "alpha4", "alpha3", "(*,?)", False)),
            ((copy, a), 1, ("first", "alpha3", "alpha4", "(?,*)", True)),
            ((a, -copy), 2, ("second", "alpha4", "alpha3", "(*,?)", True)),
        ):
            (fiber,) = roots(*point, coefficients=numbers).fibers
            name, fixed, open_, types, singular = expected
            assert (fiber.name, fiber.fixed, fiber.free) == (name, fixed, open_)
            assert (fiber.types, fiber.singular) == (types, singular)
            assert fiber.values == (point[number - 1],)
            alpha = on_fiber(number, point[number - 1], (point[2 - number], free))
            assert residual(alpha, numbers) < 1e-12 / abs(kappa)
            if singular:
                direction = zero_moment_direction(alpha, vehicle)
                np.testing.assert_allclose(direction, 0, atol=2e-14)
                tilted = determinant(alpha, exact, roll, pitch)
                assert abs(tilted) < 1e-12 / abs(kappa)


@every_case
def test_off_the_lines_there_are_no_fibres(case: str) -> None:
    numbers, kappa = CASES[case]
    delta = math.atan(kappa)
    both = roots(delta, -delta, coefficients=numbers).fibers
    assert [fiber.name for fiber in both] == ["first", "second"]
    for offset in (-1e-3, -1e-6, 1e-6, 1e-3):
        assert roots(delta + offset, -delta - offset, coefficients=numbers).fibers == ()
        # A free angle would leave residuals in proportion to the offset, so "none" is the truth.
        free = (delta + offset, 0.3, delta + offset, 1.0)
        assert residual(free, numbers) > abs(offset)


@pytest.mark.parametrize(
    ("fiber", "rotors"), [(1, "rotors 2 and 4 idle"), (2, "rotors 1 and 3 idle")]
)
def test_rows_along_a_fibre_have_no_color_and_a_pair_of_rotors_idles(
    fiber: int, rotors: str
) -> None:
    sign = 1 if fiber == 1 else -1
    free = sign * np.array([(0.2, 0.4), (0.9, 0.3), (0.5, 0.8)])
    alpha = on_fiber(fiber, sign * EXACT.delta, free)
    for gait in (Gait(alpha=alpha, coefficients=EXACT), alpha, alpha.round(4)):
        report = gg.validate(gait)
        broken = [check.name for check in report.checks if check.broken]
        assert broken == ["two_color", "continuous", "hover_thrust"]
        assert rotors in report["hover_thrust"].message
        assert report["hover_thrust"].value == pytest.approx(0.0, abs=1e-3)
        assert report.reason.startswith(f"{rotors} at ")


# Plane types


@pytest.mark.parametrize(
    ("drag_ratio", "third", "fourth"),
    [
        (gg.PAPER.drag_ratio, [-7, 1], [-1, 7]),
        # A line halfway between nodes: however rounded, both are within half a step.
        (math.tan(STEP / 2), [-8, -7, 0, 1, 8], [-8, -1, 0, 7, 8]),
    ],
)
def test_types_are_unknown_within_half_a_step(
    drag_ratio: float, third: list[int], fourth: list[int]
) -> None:
    numbers = coefficients_of(Vehicle(drag_ratio=drag_ratio))
    of_third, of_fourth = types_of("red", AXIS, AXIS, numbers)
    assert np.rint(AXIS[of_third == 0] / STEP).tolist() == third
    assert np.rint(AXIS[of_fourth == 0] / STEP).tolist() == fourth
    assert roots("pi/8", "-0.4", crossing_tolerance=2.0)[0].types == "(?,?)"
    assert roots(0.9, -0.4, crossing_tolerance=0.0)[0].types == "(+,+)"


# Figure 15 (b): which types of (α3, α4) are joined, with the row and the column of (?,?) that the paper leaves out
# because "it accommodates all types of adjacent roots".
ORDER = ("(+,+)", "(-,-)", "(+,?)", "(?,+)", "(-,?)", "(?,-)", "(?,?)")
FIGURE_15_B = """
    1 0 1 1 0 0 1
    0 1 0 0 1 1 1
    1 0 1 1 0 1 1
    1 0 1 1 1 0 1
    0 1 0 1 1 1 1
    0 1 1 0 1 1 1
    1 1 1 1 1 1 1
"""


def test_figure_15_by_labels_and_by_arrays() -> None:
    entries = np.array(FIGURE_15_B.split(), dtype=int).reshape(7, 7) == 1
    codes = np.array([types_from_text(label) for label in ORDER])
    rows, columns = codes[:, None], codes[None]
    table = neighbors_allowed(
        (rows[..., 0], rows[..., 1]), (columns[..., 0], columns[..., 1])
    )
    np.testing.assert_array_equal(table, entries)
    for (i, first), (k, second) in itertools.product(enumerate(ORDER), repeat=2):
        assert types_may_be_adjacent(first, second) == entries[i, k]


@pytest.mark.parametrize("label", ORDER)
def test_labels_mean_their_signs(label: str) -> None:
    signs = {"+": 1, "?": 0, "-": -1}
    codes = signs[label[1]], signs[label[3]]
    assert text_from_types(*codes) == label
    assert types_from_text(label) == codes
    assert types_from_text(label.replace("-", "−")) == codes  # as the paper prints it
    assert types_from_text(f"  ( {label[1]} , {label[3]} )\n") == codes


# Colors of rows, and jumps between them

RED, BOTH, OFF = [0.9, -0.9] * 2, [EXACT.delta, -EXACT.delta] * 2, [0.9, -0.9, 0, 0]
BLUE = [0.9, -0.9, 2 * EXACT.delta - 0.9, -2 * EXACT.delta + 0.9]


@pytest.mark.parametrize(
    ("rows", "tolerance", "sheets"),
    [
        ([RED, BLUE, OFF], 1e-6, [1, -1, 0]),
        (np.add([RED, BLUE], [0, 0, pi, -pi]), 1e-6, [1, -1]),  # whole turns
        (np.add([RED, RED], [[0, 0, 0.05, 0], [0, 0, 0, 1e-3]]), 2e-3, [0, 1]),
        (np.add([RED, RED], [[0, 0, 0.05, 0], [0, 0, 0, 1e-3]]), 0.1, [1, 1]),
        # Where both sheets meet a row takes the color of its neighbours.
        ([BOTH], 1e-6, [1]),
        ([BOTH, BOTH, BLUE, BOTH, RED, BOTH], 1e-6, [-1, -1, -1, -1, 1, 1]),
        ([RED, BOTH, BOTH, BLUE], 1e-6, [1, 1, 1, -1]),
        ([BLUE, OFF, BOTH], 1e-6, [-1, 0, 1]),
        ([BOTH, OFF, BOTH, BLUE], 1e-6, [1, 0, 1, -1]),
    ],
)
def test_the_colors_of_rows(rows: Any, tolerance: float, sheets: list[int]) -> None:
    assert colors_along(rows, EXACT, tolerance).tolist() == sheets


@every_case
def test_a_segment_is_continuous_if_samples_along_it_stay_on_a_sheet_of_its_ends(
    case: str,
) -> None:
    numbers, rng, n = CASES[case][0], np.random.default_rng(3), 6000
    crossing = np.array([1, -1]) * numbers.delta
    codes = rng.choice([1, -1], n)
    plane = crossing + rng.integers(-2, 3, (n, 2)) * HALF_PI  # where sheets meet
    plane[::2] = rng.uniform(-2, 2, (n // 2, 2))
    on_sheet = np.where(codes[:, None] > 0, plane, 2 * crossing - plane)
    alpha = np.hstack([plane, on_sheet + rng.integers(-1, 2, (n, 2)) * pi])
    samples = alpha[:-1] + np.linspace(0, 1, 18)[:, None, None] * np.diff(alpha, axis=0)
    farthest = sheet_distances(samples, numbers).max(axis=0)
    segments = np.arange(n - 1)
    of_start = farthest[segments, (codes[:-1] < 0).astype(int)]
    of_end = farthest[segments, (codes[1:] < 0).astype(int)]
    leaves = np.minimum(of_start, of_end) > 1e-9
    jumps = sheet_jumps(alpha[:-1], alpha[1:], codes[:-1], codes[1:], numbers)
    np.testing.assert_array_equal(jumps > 0, leaves)
    assert (jumps[codes[:-1] != codes[1:]] == 0).sum() > 50
