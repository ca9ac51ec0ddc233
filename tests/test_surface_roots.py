"""Sheets, roots and plane types, against a solver that knows nothing of the closed form.

It starts from forces and torques: the horizontal part of N = F·w₀, with w₀ from minors of τ, is linear in
(cos α3, sin α3) and in (cos α4, sin α4), so that all its zeros follow from one quadratic.
"""

from __future__ import annotations

import itertools
import math
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
    hover_thrust_shares,
    level_determinant,
    pitch_sensitivity,
    roll_sensitivity,
    zero_moment_direction,
)
from gaitgraph.surface.sheets import (
    PLANE_TYPES,
    colors_along,
    root_arrays,
    roots,
    sheet_distances,
    sheet_jumps,
    text_from_types,
    types_at,
    types_contradict,
    types_of,
)
from gaitgraph.tolerances import DEFAULT_CROSSING_TOLERANCE
from gaitgraph.vehicle import Vehicle, vehicle_named
from tests.samples import EXACT, HALF_PI, MIRRORED, write_rows

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

FloatArray = npt.NDArray[np.float64]

PI = math.pi
STEP = math.pi / 16
AXIS = np.linspace(-HALF_PI, HALF_PI, 17)
INTERIOR = AXIS[1:-1]
SIGN = {"red": 1, "blue": -1}

# κ with which the two equations are written out here; 2.880 = (1/κ − κ)/2 is what the paper's digits mean.
PUBLISHED_KAPPA = math.hypot(2.880, 1.0) - 2.880
CASES: dict[str, tuple[Coefficients, float]] = {
    "published": (coefficients_of(), PUBLISHED_KAPPA),
    "exact": (coefficients_of(kind="exact"), 2.423e-7 / (8.048e-6 * 0.1785)),
    "beetle_omni": (
        coefficients_of(vehicle_named("beetle_omni").replace(rotor_height=0.0)),
        -0.0165 / 0.2754,
    ),
    "mirrored": (coefficients_of(MIRRORED), -2.423e-7 / (8.048e-6 * 0.1785)),
    "half": (coefficients_of(Vehicle(name="half", drag_ratio=0.5)), 0.5),
}
every_case = pytest.mark.parametrize("case", CASES)
angle = st.floats(-HALF_PI, HALF_PI)


def residual(alpha: Sequence[float], numbers: Coefficients) -> float:
    """Return the larger of |Rφ| and |Rθ|; another test compares both with the paper, term by term."""
    return float(
        max(
            abs(roll_sensitivity(alpha, numbers)),
            abs(pitch_sensitivity(alpha, numbers)),
        )
    )


def distance_modulo_pi(first: Sequence[float], second: Sequence[float]) -> float:
    difference = np.subtract(first, second)
    return float(np.abs(difference - PI * np.rint(difference / PI)).max())


def assert_same_solutions(
    ours: Sequence[tuple[float, float]],
    theirs: Sequence[tuple[float, float]],
    tolerance: float,
) -> None:
    for some, others in ((ours, theirs), (theirs, ours)):
        for one in some:
            assert (
                min(distance_modulo_pi(one, other) for other in others) <= tolerance
            ), (ours, theirs)


def horizontal_direction(alpha: Sequence[float], kappa: float) -> FloatArray:
    """Return (N_x, N_y), N = F·w₀, with w₀ made of the 3×3 minors of τ."""
    (s1, s2, s3, s4), (c1, c2, c3, c4) = map(math.sin, alpha), map(math.cos, alpha)
    k = kappa
    force = np.array([[0, s2, 0, -s4], [s1, 0, -s3, 0]])
    roll, pitch = [0, c2 - k * s2, 0, -c4 + k * s4], [c1 + k * s1, 0, -c3 - k * s3, 0]
    moment = np.array(
        [roll, pitch, [s1 - k * c1, -s2 - k * c2, s3 - k * c3, -s4 - k * c4]]
    )
    minors = []
    for i in range(4):
        first, second, third = np.delete(moment, i, axis=1)
        minors.append((-1) ** i * float(np.cross(first, second) @ third))
    return np.asarray(force @ np.array(minors) / kappa)


def found_by_elimination(
    a1: float, a2: float, kappa: float
) -> list[tuple[float, float]]:
    """Return all (α3, α4), modulo π, with a horizontal force of zero: a quadratic has no more than two roots."""
    forms = np.empty((2, 2, 2))  # N_x or N_y, (cos, sin) of α3, (cos, sin) of α4
    for i, k in np.ndindex(2, 2):
        forms[:, i, k] = horizontal_direction((a1, a2, i * HALF_PI, k * HALF_PI), kappa)
    (x_cos, x_sin), (y_cos, y_sin) = forms

    def cross(first: FloatArray, second: FloatArray) -> float:
        return float(first[0] * second[1] - first[1] * second[0])

    cos_cos, sin_sin, sin_cos = (
        cross(x_cos, y_cos),
        cross(x_sin, y_sin),
        cross(x_cos, y_sin) + cross(x_sin, y_cos),
    )
    # a·cos² + b·sin·cos + c·sin² = (a + c)/2 + (a − c)/2·cos 2α + b/2·sin 2α
    size = math.hypot(cos_cos - sin_sin, sin_cos)
    assert size > 1e-12, "both equations share a factor: this is a fibre"
    middle = math.atan2(sin_cos, cos_cos - sin_sin)
    apart = math.acos(max(-1.0, min(1.0, -(cos_cos + sin_sin) / size)))
    found = []
    for double in (middle - apart, middle + apart):
        row = np.tensordot(
            forms, [math.cos(double / 2), math.sin(double / 2)], axes=(1, 0)
        )
        cosine, sine = np.linalg.svd(row)[2][-1]
        found.append((double / 2, math.atan2(sine, cosine)))
    return found


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
    ours = [(root.alpha3, root.alpha4) for root in roots(a1, a2, coefficients=numbers)]
    assert_same_solutions(ours, found_by_elimination(a1, a2, kappa), tolerance)


@every_case
@settings(deadline=None, max_examples=30)
@given(a1=angle, a2=angle)
def test_each_root_carries_its_values(case: str, a1: float, a2: float) -> None:
    numbers, kappa = CASES[case]
    for root in roots(a1, a2, coefficients=numbers):
        assert root.alpha == (a1, a2, root.alpha3, root.alpha4)
        assert max(abs(root.alpha3), abs(root.alpha4)) <= HALF_PI
        for found in (root.R_phi, root.R_theta):
            assert abs(found) < 1e-12 / abs(kappa)
            assert found or math.copysign(1.0, found) == 1.0  # −0.0 would be printed
        assert (
            pytest.approx(float(level_determinant(root.alpha, numbers)), abs=1e-12)
            == root.R
        )
        assert root.types in PLANE_TYPES
        third, fourth = (
            (a1, a2)
            if root.color == "red"
            else (2 * math.atan(kappa) - a1, -2 * math.atan(kappa) - a2)
        )
        assert distance_modulo_pi([root.alpha3, root.alpha4], [third, fourth]) < 1e-12


@every_case
def test_one_more_where_blue_lies_at_an_end_of_the_range(case: str) -> None:
    numbers, kappa = CASES[case]
    crossing, right = 2 * math.atan(kappa), math.copysign(HALF_PI, kappa)
    first, second = crossing - right, right - crossing
    for a1, a2, expected in ((first, 0.3, 2), (0.3, second, 2), (first, second, 4)):
        answer = roots(a1, a2, coefficients=numbers)
        assert [root.color for root in answer] == ["red"] + ["blue"] * expected
        for root in answer[1:]:
            assert residual(root.alpha, numbers) < 1e-12 / abs(kappa)
            assert max(abs(root.alpha3), abs(root.alpha4)) == pytest.approx(
                HALF_PI, abs=1e-12
            )
        assert len({(root.alpha3, root.alpha4) for root in answer}) == 1 + expected


@every_case
@pytest.mark.parametrize("shape", [(), (0,), (7,), (2, 0, 3), (1, 4, 1, 3)])
def test_arrays_agree_with_single_roots(case: str, shape: tuple[int, ...]) -> None:
    numbers, kappa = CASES[case]
    delta = math.atan(kappa)
    special = [
        -HALF_PI,
        HALF_PI,
        delta,
        -delta,
        0.0,
        0.4,
        -1.2,
    ]  # ends, corners and fibre lines among them
    first, second = np.random.default_rng(6).choice(special, (2, *shape))
    answer = root_arrays(first, second, coefficients=numbers)
    assert answer.count.shape == shape
    assert (answer.alpha.shape, answer.types.shape) == ((*shape, 5, 4), (*shape, 5, 2))
    assert [part.dtype.name for part in (answer.alpha, answer.sheet, answer.types)] == [
        "float64",
        "int8",
        "int8",
    ]
    for index in np.ndindex(*shape):
        one, count = (
            root_arrays(first[index], second[index], coefficients=numbers),
            int(answer.count[index]),
        )
        for name in ("count", "alpha", "sheet", "types", "R"):
            np.testing.assert_allclose(
                getattr(answer, name)[index], getattr(one, name), rtol=0, atol=1e-13
            )
        assert np.isnan(answer.alpha[index][count:]).all()
        assert np.isnan(answer.R[index][count:]).all()
        assert not answer.sheet[index][count:].any()
        assert not answer.types[index][count:].any()


@every_case
def test_on_a_fibre_one_angle_is_free(case: str) -> None:
    numbers, kappa = CASES[case]
    delta = math.atan(kappa)
    copy = delta - math.copysign(HALF_PI, delta)
    vehicle = Vehicle(
        drag_ratio=abs(kappa),
        first_rotor_spin="clockwise" if kappa > 0 else "counterclockwise",
    )
    for a, free, roll, pitch in np.random.default_rng(7).uniform(-1.4, 1.4, (10, 4)):
        for a1, a2, expected in (
            (delta, a, ("first", "alpha3", "alpha4", "(?,*)", False)),
            (a, -delta, ("second", "alpha4", "alpha3", "(*,?)", False)),
            (copy, a, ("first", "alpha3", "alpha4", "(?,*)", True)),
            (a, -copy, ("second", "alpha4", "alpha3", "(*,?)", True)),
        ):
            answer = roots(a1, a2, coefficients=numbers)
            assert {root.color for root in answer} == {"red", "blue"}
            (fiber,) = answer.fibers
            assert (
                fiber.name,
                fiber.fixed,
                fiber.free,
                fiber.types,
                fiber.singular,
            ) == expected
            assert fiber.values == ((a1,) if fiber.name == "first" else (a2,))
            alpha = (
                (a1, a2, *fiber.values, free)
                if fiber.name == "first"
                else (a1, a2, free, *fiber.values)
            )
            assert residual(alpha, numbers) < 1e-12 / abs(kappa)
            if fiber.singular:
                np.testing.assert_allclose(
                    zero_moment_direction(alpha, vehicle), 0, atol=2e-14
                )
                assert abs(
                    determinant(alpha, coefficients_of(vehicle, "exact"), roll, pitch)
                ) < 1e-12 / abs(kappa)


@every_case
def test_off_the_lines_there_are_no_fibres(case: str) -> None:
    numbers, kappa = CASES[case]
    delta = math.atan(kappa)
    assert [
        fiber.name for fiber in roots(delta, -delta, coefficients=numbers).fibers
    ] == ["first", "second"]
    for offset in (-1e-3, -1e-6, 1e-6, 1e-3):
        assert roots(delta + offset, -delta - offset, coefficients=numbers).fibers == ()
        # A free angle would leave residuals in proportion to the offset, so "none" is the truth.
        assert residual((delta + offset, 0.3, delta + offset, 1.0), numbers) > abs(
            offset
        )
    assert not any(
        roots(a1, a2).fibers for a1, a2 in itertools.product(AXIS.tolist(), repeat=2)
    )
    # Where δ is nearly at an end of the range, both of its values are there.
    heavy = coefficients_of(Vehicle(drag_ratio=1e9))
    (fiber,) = roots(HALF_PI, 0.3, coefficients=heavy).fibers
    assert fiber.values == (-HALF_PI, HALF_PI)


def test_question_marks_of_the_papers_grid_and_of_a_line_halfway_between_nodes() -> (
    None
):
    assert DEFAULT_CROSSING_TOLERANCE == STEP / 2
    # However rounded, both nodes are within half a step.
    halfway = coefficients_of(Vehicle(drag_ratio=math.tan(STEP / 2)))
    cases = (
        (coefficients_of(), [-7, 1], [-1, 7]),
        (halfway, [-8, -7, 0, 1, 8], [-8, -1, 0, 7, 8]),
    )
    for numbers, third, fourth in cases:
        types = types_of("red", AXIS, AXIS, numbers)
        assert [np.round(AXIS[one == 0] / STEP).tolist() for one in types] == [
            third,
            fourth,
        ]
    assert roots("pi/8", "-0.4", crossing_tolerance=2.0)[0].types == "(?,?)"
    assert roots(0.9, -0.4, crossing_tolerance=0.0)[0].types == "(+,+)"


def test_the_signs_of_figure_16() -> None:
    found = root_arrays(INTERIOR[:, None], INTERIOR)
    (red, blue), labels = np.moveaxis(found.R[..., :2], -1, 0), found.types[..., :2, :]
    assert ((red < 0).sum(), (blue < 0).sum(), (red > 0).sum(), (blue > 0).sum()) == (
        97,
        197,
        128,
        28,
    )
    assert ((red >= 0) & (blue >= 0)).sum() == 28
    assert {
        text_from_types(*pair) for pair in labels[found.R[..., :2] < 0].tolist()
    } == set(PLANE_TYPES)
    # Blue carries what rounding leaves.
    assert np.abs(blue).max() < 4.4e-4


def test_rows_on_neither_and_rows_on_both() -> None:
    alpha = [
        [0.9, -0.9, 0.9, -0.9],
        [0.9, -0.9, 0.95, -0.9],
        [0.9, -0.9, 0.9, -0.9 + 1e-3],
    ]
    for tolerance, expected in ((2e-3, [1, 0, 1]), (0.1, [1, 1, 1]), (1e-4, [1, 0, 0])):
        assert colors_along(alpha, EXACT, tolerance).tolist() == expected
    delta = EXACT.delta
    both = [delta, -delta, delta, -delta]
    red, blue = [0.9, -0.9, 0.9, -0.9], [0.9, -0.9, 2 * delta - 0.9, -2 * delta + 0.9]
    turned = np.add([red, blue], [0.0, 0.0, PI, -PI])
    assert sheet_distances(turned, EXACT).argmin(axis=-1).tolist() == [0, 1]
    assert sheet_distances(turned, EXACT).min(axis=-1).max() < 1e-12
    assert colors_along(turned, EXACT, 1e-6).tolist() == [1, -1]
    off = [0.9, -0.9, 0.0, 0.0]
    for rows, sheets in (
        ([both], [1]),
        ([both, both, blue, both, red, both], [-1, -1, -1, -1, 1, 1]),
        ([red, both, both, blue], [1, 1, 1, -1]),
        ([blue, off, both], [-1, 0, 1]),
        ([both, off, both, blue], [1, 0, 1, -1]),
    ):
        found = colors_along(rows, EXACT, 1e-6)
        assert (found.tolist(), found.dtype.name) == (sheets, "int8")


def on_fiber(fiber: int, free: Any, coefficients: Coefficients = EXACT) -> FloatArray:
    """Return points of the first fibre with free angles (α2, α4), or of the second with (α1, α3)."""
    free = np.asarray(free, dtype=float)
    at = coefficients.delta if fiber == 1 else -coefficients.delta
    fixed = np.full(free.shape[:-1], at)
    if fiber == 1:
        return np.stack([fixed, free[..., 0], fixed, free[..., 1]], axis=-1)
    return np.stack([free[..., 0], fixed, free[..., 1], fixed], axis=-1)


@every_case
def test_on_a_fibre_R_is_its_closed_form_and_a_pair_idles(case: str) -> None:
    kappa = CASES[case][1]
    vehicle = Vehicle(
        drag_ratio=abs(kappa),
        first_rotor_spin="clockwise" if kappa > 0 else "counterclockwise",
    )
    exact, free = (
        coefficients_of(vehicle, "exact"),
        np.random.default_rng(12).uniform(-1.2, 1.2, (300, 2)),
    )
    for fiber, sign, idle in ((1, 1.0, [1, 3]), (2, -1.0, [0, 2])):
        alpha = on_fiber(fiber, free, exact)
        R = (
            sign
            * np.sin(free.sum(axis=1) + sign * 2 * exact.delta)
            / (kappa * math.cos(exact.delta) ** 2)
        )
        np.testing.assert_allclose(
            level_determinant(alpha, exact), R, atol=1e-11 / abs(kappa)
        )
        assert np.abs(zero_moment_direction(alpha, vehicle)[:, :2]).max() < 1e-12
        shares = hover_thrust_shares(alpha[np.abs(R) > 1e-3], vehicle)
        assert np.abs(shares[:, idle]).max() < 1e-10
        np.testing.assert_allclose(
            (shares * np.cos(alpha[np.abs(R) > 1e-3])).sum(axis=1), 1.0
        )


def test_types_have_the_sign_of_the_color() -> None:
    assert np.transpose(types_at([(0.5, 0.5, 0, 0)] * 3, [1, -1, 0], EXACT, 0.1)).tolist() == [
        [1, 1], [-1, -1], [0, 0],
    ]  # fmt: skip
    pairs = [(1, 1), (-1, 0), (0, 0)]
    table = {code: types_contradict(pairs, [code] * 3).tolist() for code in (1, -1, 0)}
    assert table == {1: [False, True, False], -1: [True, False, False], 0: [False] * 3}


@every_case
def test_a_segment_is_continuous_if_samples_along_it_stay_on_a_sheet_of_its_ends(
    case: str,
) -> None:
    numbers, rng, n = CASES[case][0], np.random.default_rng(3), 6000
    crossing, blue = np.array([1, -1]) * numbers.delta, rng.random((n, 1)) < 0.5
    plane = crossing + rng.integers(-2, 3, (n, 2)) * HALF_PI  # where sheets meet
    plane[::2] = rng.uniform(-2, 2, (n // 2, 2))
    opposite = (
        np.where(blue, 2 * crossing - plane, plane) + rng.integers(-1, 2, (n, 2)) * PI
    )
    alpha, codes, column = (
        np.hstack([plane, opposite]),
        np.where(blue, -1, 1)[:, 0],
        blue.astype(int),
    )
    samples = alpha[:-1] + np.linspace(0, 1, 18)[:, None, None] * np.diff(alpha, axis=0)
    farthest = sheet_distances(samples, numbers).max(axis=0)
    off = np.minimum(
        *(
            np.take_along_axis(farthest, at, axis=1)[:, 0]
            for at in (column[:-1], column[1:])
        )
    )
    jumps = sheet_jumps(alpha[:-1], alpha[1:], codes[:-1], codes[1:], numbers)
    assert ((jumps > 0) == (off > 1e-9)).all()
    assert (jumps[codes[:-1] != codes[1:]] == 0).sum() > 50


@pytest.mark.parametrize("fiber", [1, 2])
def test_rows_along_a_fibre_have_no_color_and_a_pair_of_rotors_idles(
    fiber: int, tmp_path: Path
) -> None:
    rotors = "rotors 2 and 4 idle" if fiber == 1 else "rotors 1 and 3 idle"
    free = np.array([(0.2, 0.4), (0.9, 0.3), (0.5, 0.8)]) * (1 if fiber == 1 else -1)
    alpha = on_fiber(fiber, free)
    write_rows(tmp_path / "rows.csv", alpha, fmt="%.4f")
    for gait in (Gait(alpha=alpha, coefficients=EXACT), alpha, tmp_path / "rows.csv"):
        report = gg.validate(gait)
        broken = [check.name for check in report.checks if check.broken]
        assert broken == ["two_color", "continuous", "hover_thrust"]
        assert report["on_surface"].ok
        assert rotors in report["hover_thrust"].message
        assert report["hover_thrust"].value == pytest.approx(0.0, abs=1e-3)
        assert report.reason.startswith(f"{rotors} at ")
        assert "which lies on neither sheet" in report.reason
    with pytest.raises(gg.InputError, match="colors must be 'red', 'blue', got"):
        Gait(alpha=alpha, colors=("fiber1",) * 3)
