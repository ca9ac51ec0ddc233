"""Formula (1), its misprints, and the physics behind it.

The paper's formulas stand here as printed, one term a line, with the misprints listed beside them, so that both
the claim "misprinted" and the claim "nothing else is" are decided by forces and torques.
"""

from __future__ import annotations

import itertools
import math
import re
from collections import Counter
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import mpmath
import numpy as np
import numpy.typing as npt
import pytest
import sympy
from hypothesis import example, given, settings, strategies as st
from scipy.spatial.transform import Rotation

import gaitgraph as gg
from gaitgraph.errors import InputError, MissingConstant
from gaitgraph.invertibility.matrices import (
    Kind,
    body_vertical,
    coefficients_of,
    control_force_matrix,
    control_moment_matrix,
    decoupling_matrix,
    determinant,
    hover_thrust_shares,
    least_singular_value,
    least_singular_value_bound,
    least_singular_value_on_red,
    level_determinant,
    level_determinant_resolution,
    level_determinant_slopes,
    noise_of,
    pitch_sensitivity,
    roll_sensitivity,
    scaled_decoupling_matrix,
    zero_moment_direction,
    zero_moment_inputs,
)
from gaitgraph.vehicle import PAPER, Vehicle, vehicle_named
from tests.published import GAITS

if TYPE_CHECKING:
    from collections.abc import Callable

FloatArray = npt.NDArray[np.float64]
Term = tuple[str, str, str]
"""Signed number as printed, "c" or "s" for each of the four angles, attitude factor."""

HALF_PI = math.pi / 2

PRINTED = {
    "(1)": """
        +1.000 c1 c2 c3 s4 sθ
        -1.000 c1 s2 c3 c4 sθ
        -2.880 c1 c2 s3 s4 sθ
        +2.880 c1 s2 s3 c4 sθ
        -2.880 s1 c2 c3 s4 sθ
        +2.880 s1 s2 c3 c4 sθ
        -1.000 s1 c2 s3 s4 sθ
        +1.000 s1 s2 s3 c4 sθ
        +4.000 c1 c2 c3 c4 cφcθ
        +5.592 c1 c2 c3 s4 cφcθ
        -5.592 c1 c2 s3 c4 cφcθ
        +5.592 c1 s2 c3 c4 cφcθ
        -5.592 s1 c2 c3 c4 cφcθ
        +1.000 c1 c2 s3 c4 sφcθ
        +0.9716 c1 c2 s3 s4 cφcθ
        -2.000 c1 s2 c3 s4 cφcθ
        +0.9716 c1 s2 s3 c4 cφcθ
        -1.000 s1 c2 c3 c4 sφcθ
        +0.9716 s1 c2 c3 s4 cφcθ
        -2.000 s1 c2 s3 c4 cφcθ
        +0.9716 s1 s2 c3 c4 cφcθ
        +2.880 c1 c2 s3 s4 sφcθ
        +2.880 c1 s2 s3 c4 sφcθ
        -0.1687 c1 s2 s3 s4 cφcθ
        -2.880 s1 c2 s3 s4 sφcθ
        +0.1687 s1 c2 s3 s4 cφcθ
        -2.880 s1 s2 s3 c4 sφcθ
        -0.1687 s1 s2 c3 s4 cφcθ
        +0.1687 s1 s2 s3 c4 cφcθ
        -1.000 c1 s2 s3 s4 sφcθ
        +1.000 s1 s2 s3 s4 sφcθ
    """,
    "(2)": """
        +4.000 c1 c2 c3 c4 cφcθ
        +5.592 c1 c2 c3 s4 cφcθ
        -5.592 c1 c2 s3 c4 cφcθ
        +5.592 c1 s2 c3 c4 cφcθ
        -5.592 s1 c2 c3 c4 cφcθ
        +0.9716 c1 c2 s3 s4 cφcθ
        +0.9716 c1 s2 s3 c4 cφcθ
        +0.9716 s1 c2 c3 s4 cφcθ
        +0.9716 s1 s2 c3 c4 cφcθ
        -2.000 c1 s2 c3 s4 cφcθ
        -2.000 s1 c2 s3 c4 cφcθ
        -0.1687 c1 s2 s3 s4 cφcθ
        +0.1687 s1 c2 s3 s4 cφcθ
        -0.1687 s1 s2 c3 s4 cφcθ
        +0.1687 s1 s2 s3 c4 cφcθ
    """,
    "(4)": """
        +1.000 c1 c2 s3 c4 sφcθ
        -1.000 s1 c2 c3 c4 sφcθ
        -1.000 c1 s2 s3 s4 sφcθ
        +1.000 s1 s2 c3 s4 sφcθ
        +2.880 c1 c2 s3 s4 sφcθ
        +2.880 c1 s2 s3 c4 sφcθ
        -2.880 s1 c2 c3 s4 sφcθ
        -2.880 s1 s2 c3 c4 sφcθ
    """,
    "(5)": """
        +1.000 c1 c2 c3 s4 sθ
        -1.000 c1 s2 c3 c4 sθ
        -1.000 s1 c2 s3 s4 sθ
        +1.000 s1 s2 s3 c4 sθ
        -2.880 c1 c2 c3 s4 sθ
        +2.880 c1 s2 s3 c4 sθ
        -2.880 s1 c2 c3 s4 sθ
        +2.880 s1 s2 c3 c4 sθ
    """,
    "(6)": """
        +4.000 c1 c2 c3 c4 cφcθ
        +5.592 c1 c2 c3 s4 cφcθ
        -5.592 c1 c2 s3 c4 cφcθ
        +5.592 c1 s2 c3 c4 cφcθ
        -5.592 s1 c2 c3 c4 cφcθ
        +0.9716 c1 c2 s3 s4 cφcθ
        +0.9716 c1 s2 s3 c4 cφcθ
        +0.9716 s1 c2 s3 c4 cφcθ
        +0.9716 s1 s2 c3 c4 cφcθ
        -2.000 c1 s2 c3 s4 cφcθ
        -2.000 s1 c2 c3 s4 cφcθ
        -0.1687 c1 s2 s3 s4 cφcθ
        +0.1687 s1 c2 s3 s4 cφcθ
        -0.1687 s1 s2 c3 s4 cφcθ
        +0.1687 s1 s2 s3 c4 cφcθ
    """,
}
"""The left sides of (1), (2), (4), (5), (6) as printed; (2) and (4)-(6) with the factor that they have in (1)."""

MISPRINTS = [
    ("(1)", "-2.880 s1 c2 s3 s4 sφcθ", "-2.880 s1 c2 c3 s4 sφcθ"),
    ("(1)", "-2.880 s1 s2 s3 c4 sφcθ", "-2.880 s1 s2 c3 c4 sφcθ"),
    ("(1)", "+1.000 s1 s2 s3 s4 sφcθ", "+1.000 s1 s2 c3 s4 sφcθ"),
    ("(5)", "-2.880 c1 c2 c3 s4 sθ", "-2.880 c1 c2 s3 s4 sθ"),
    ("(6)", "+0.9716 s1 c2 s3 c4 cφcθ", "+0.9716 s1 c2 c3 s4 cφcθ"),
    ("(6)", "-2.000 s1 c2 c3 s4 cφcθ", "-2.000 s1 c2 s3 c4 cφcθ"),
]

IN_KAPPA: dict[str, Callable[[Any], Any]] = {
    "1.000": lambda kappa: 1,
    "2.000": lambda kappa: 2,
    "4.000": lambda kappa: 4,
    "2.880": lambda kappa: (1 / kappa - kappa) / 2,
    "5.592": lambda kappa: 1 / kappa - 2 * kappa,
    "0.9716": lambda kappa: 1 - kappa**2,
    "0.1687": lambda kappa: kappa,
}
"""What the printed numbers are rounded from."""

PART = {"(2)": "cφcθ", "(4)": "sφcθ", "(5)": "sθ", "(6)": "cφcθ"}
"""The attitude factor of the part of (1) that each equation repeats."""


def term_of(line: str) -> Term:
    match = re.fullmatch(r"([+-][\d.]+) ([cs])1 ([cs])2 ([cs])3 ([cs])4 (sθ|sφcθ|cφcθ)", line.strip())
    assert match is not None, line
    number, *letters, attitude = match.groups()
    return number, "".join(letters), attitude


def terms_of(text: str) -> list[Term]:
    return [term_of(line) for line in text.strip().splitlines()]


def mended(equation: str) -> list[Term]:
    """Return an equation's terms with the listed misprints replaced, each of which must occur once."""
    terms = terms_of(PRINTED[equation])
    for where, wrong, right in MISPRINTS:
        if where == equation:
            place = terms.index(term_of(wrong))
            terms[place] = term_of(right)
    return terms


def coefficients_by_monomial(terms: list[Term]) -> dict[tuple[str, str], float]:
    sums: Counter[tuple[str, str]] = Counter()
    for number, letters, attitude in terms:
        sums[letters, attitude] += float(number)  # type: ignore[assignment]
    return dict(sums)


def evaluated(terms: list[Term], alpha: npt.ArrayLike) -> FloatArray:
    """Return the sum of terms at tilt angles of shape (..., 4), attitude factors left out."""
    angles = np.asarray(alpha, dtype=float)
    factors = {"c": np.cos(angles), "s": np.sin(angles)}
    total = np.zeros(angles.shape[:-1])
    for number, letters, _ in terms:
        total += float(number) * np.prod([factors[which][..., i] for i, which in enumerate(letters)], axis=0)
    return total


def plain_matrices(alpha: npt.ArrayLike, kappa: float) -> tuple[FloatArray, FloatArray]:
    """Return F/Kf and τ/(L·Kf) of one configuration, arms along x, y, −x, −y, entry by entry."""
    (s1, s2, s3, s4), (c1, c2, c3, c4) = np.sin(np.asarray(alpha)), np.cos(np.asarray(alpha))
    k = kappa
    force = [[0, s2, 0, -s4], [s1, 0, -s3, 0], [-c1, c2, -c3, c4]]
    moment = [
        [0, c2 - k * s2, 0, -c4 + k * s4],
        [c1 + k * s1, 0, -c3 - k * s3, 0],
        [s1 - k * c1, -s2 - k * c2, s3 - k * c3, -s4 - k * c4],
    ]
    return np.array(force, dtype=float), np.array(moment, dtype=float)


LETTERS = ["".join(letters) for letters in itertools.product("cs", repeat=4)]
CORNERS = np.array([[HALF_PI if which == "s" else 0.0 for which in letters] for letters in LETTERS])
"""Where one monomial is 1 and the other fifteen are 0: a multilinear form is known once it is known here."""


def true_coefficients(kappa: float) -> dict[tuple[str, str], float]:
    """Return the coefficient of every monomial of (1), from determinants of forces and torques alone."""
    upward = {"sθ": (-1.0, 0.0, 0.0), "sφcθ": (0.0, 1.0, 0.0), "cφcθ": (0.0, 0.0, 1.0)}
    truth = {}
    for letters, corner in zip(LETTERS, CORNERS, strict=True):
        force, moment = plain_matrices(corner, kappa)
        for attitude, vertical in upward.items():
            matrix = np.vstack([moment, np.array(vertical) @ force])
            truth[letters, attitude] = float(np.linalg.det(matrix)) / (2 * kappa)
    return truth


PUBLISHED = coefficients_of()
EXACT = coefficients_of(kind="exact")
TURNED = PAPER.replace(name="turned", first_arm_angle=0.7)
MIRRORED = PAPER.replace(name="mirrored", first_rotor_spin="counterclockwise")
BOTH = PAPER.replace(name="both", first_arm_angle=-2.1, first_rotor_spin="counterclockwise", arm_length=0.05)
VEHICLES = [PAPER, TURNED, MIRRORED, BOTH]
by_name = pytest.mark.parametrize("vehicle", VEHICLES, ids=lambda vehicle: vehicle.name)
KAPPAS = [1e-4, 1e-3, 1e-2, 0.0599, 0.168666, 0.5, 1 / math.sqrt(2), 1.0, 2.0]

tilts = st.tuples(*[st.floats(-math.pi, math.pi)] * 4)
rolls = st.floats(-math.pi, math.pi)
pitches = st.floats(-1.5, 1.5)
ratios = st.floats(1e-4, 1.0)


def random_tilts(seed: int, *shape: int, reach: float = math.pi) -> FloatArray:
    return np.random.default_rng(seed).uniform(-reach, reach, (*shape, 4))


def on_red(first: FloatArray, second: FloatArray) -> FloatArray:
    return np.stack([first, second, first, second], axis=-1)


def on_blue(first: FloatArray, second: FloatArray, vehicle: Vehicle) -> FloatArray:
    crossing = 2 * math.atan(vehicle.signed_drag_ratio)
    return np.stack([first, second, crossing - first, -crossing - second], axis=-1)


class TestFormulaOneIsTheDeterminant:
    """Proved for every κ and every angle: c and s are symbols, so no identity between them is even needed."""

    kappa = sympy.Symbol("kappa", positive=True)
    cosines = sympy.symbols("c1:5")
    sines = sympy.symbols("s1:5")
    # The upward vertical in the body is (−sin θ, sin φ cos θ, cos φ cos θ).
    upward = sympy.symbols("nx ny nz")

    def symbolic(self, terms: list[Term]) -> Any:
        nx, ny, nz = self.upward
        attitude_factors = {"sθ": -nx, "sφcθ": ny, "cφcθ": nz}
        total = sympy.Integer(0)
        for number, letters, attitude in terms:
            term = (-1 if number[0] == "-" else 1) * IN_KAPPA[number[1:]](self.kappa) * attitude_factors[attitude]
            for i, which in enumerate(letters):
                term *= self.cosines[i] if which == "c" else self.sines[i]
            total += term
        return total

    def part(self, equation: str) -> Any:
        """Return the mended equation, its attitude factor taken away."""
        nx, ny, nz = self.upward
        one = {"sθ": {nx: -1}, "sφcθ": {ny: 1}, "cφcθ": {nz: 1}}[PART[equation]]
        return self.symbolic(mended(equation)).subs(one)

    def sine_of_sum(self, i: int, k: int) -> Any:
        return self.sines[i - 1] * self.cosines[k - 1] + self.cosines[i - 1] * self.sines[k - 1]

    def sine_of_difference(self, i: int, k: int) -> Any:
        return self.sines[i - 1] * self.cosines[k - 1] - self.cosines[i - 1] * self.sines[k - 1]

    def cosine_of_sum(self, i: int, k: int) -> Any:
        return self.cosines[i - 1] * self.cosines[k - 1] - self.sines[i - 1] * self.sines[k - 1]

    def vanishes(self, expression: Any) -> bool:
        return bool(sympy.expand(expression) == 0)

    def test_the_mended_formula_is_the_determinant_over_twice_kappa(self) -> None:
        k = self.kappa
        nx, ny, nz = self.upward
        (c1, c2, c3, c4), (s1, s2, s3, s4) = self.cosines, self.sines
        matrix = sympy.Matrix(
            [
                [0, c2 - k * s2, 0, -c4 + k * s4],
                [c1 + k * s1, 0, -c3 - k * s3, 0],
                [s1 - k * c1, -s2 - k * c2, s3 - k * c3, -s4 - k * c4],
                [s1 * ny - c1 * nz, s2 * nx + c2 * nz, -s3 * ny - c3 * nz, -s4 * nx + c4 * nz],
            ]
        )
        assert self.vanishes(matrix.det(method="berkowitz") - 2 * k * self.symbolic(mended("(1)")))

    def test_its_three_parts_are_the_mended_equations(self) -> None:
        nx, ny, nz = self.upward
        assert self.vanishes(
            self.symbolic(mended("(1)")) - (ny * self.part("(4)") - nx * self.part("(5)") + nz * self.part("(6)"))
        )
        assert self.vanishes(self.part("(6)") - self.part("(2)"))

    def test_the_first_two_parts_factorise(self) -> None:
        # sin(x + 2δ)/sin 2δ = sin x·cot 2δ + cos x, and cot 2δ is the coefficient 2.880.
        cotangent = IN_KAPPA["2.880"](self.kappa)
        odd = self.sine_of_sum(1, 3) * cotangent - self.cosine_of_sum(1, 3)
        even = self.sine_of_sum(2, 4) * cotangent + self.cosine_of_sum(2, 4)
        assert self.vanishes(self.part("(4)") + self.sine_of_difference(1, 3) * even)
        assert self.vanishes(self.part("(5)") - self.sine_of_difference(2, 4) * odd)

    def test_the_third_part_is_a_bilinear_form_and_a_difference_of_products(self) -> None:
        k = self.kappa
        c, s = self.cosines, self.sines
        first = sympy.Matrix([c[0] * c[2], s[0] * s[2], self.sine_of_sum(1, 3)])
        second = sympy.Matrix([c[1] * c[3], s[1] * s[3], self.sine_of_sum(2, 4)])
        single, double = 1 / k - 2 * k, 1 - k**2
        form = sympy.Matrix([[4, -2, single], [-2, 0, k], [-single, -k, double]])
        assert self.vanishes(self.part("(6)") - (first.T * form * second)[0, 0])
        # cos β/cos δ of an odd and of an even arm, sin(β + β')/sin 2δ of the odd and of the even pair.
        cos_odd: list[Any] = [c[i] + k * s[i] for i in range(4)]
        cos_even: list[Any] = [c[i] - k * s[i] for i in range(4)]
        cotangent = (1 / k - k) / 2
        odd = self.sine_of_sum(1, 3) * cotangent - self.cosine_of_sum(1, 3)
        even = self.sine_of_sum(2, 4) * cotangent + self.cosine_of_sum(2, 4)
        product = even * (c[0] * cos_odd[2] + c[2] * cos_odd[0]) - odd * (c[1] * cos_even[3] + c[3] * cos_even[1])
        assert self.vanishes(self.part("(6)") - product)

    def test_the_printed_numbers_are_those_functions_of_the_papers_kappa(self) -> None:
        kappa = 2.423e-7 / (8.048e-6 * 0.1785)
        for printed, function in IN_KAPPA.items():
            decimals = len(printed.split(".")[1])
            assert f"{float(function(kappa)):.{decimals}f}" == printed


class TestMisprints:
    TRUTH = true_coefficients(PAPER.drag_ratio)

    def agrees(self, terms: list[Term], monomial: tuple[str, str]) -> bool:
        stated = coefficients_by_monomial(terms).get(monomial, 0.0)
        return abs(stated - self.TRUTH[monomial]) <= 6e-4

    @pytest.mark.parametrize(("equation", "wrong", "right"), MISPRINTS, ids=lambda text: text.replace(" ", ""))
    def test_the_printed_term_disagrees_with_the_physics_and_the_mended_one_agrees(
        self, equation: str, wrong: str, right: str
    ) -> None:
        printed = terms_of(PRINTED[equation])
        assert printed.count(term_of(wrong)) == 1
        assert term_of(right) not in printed
        for line in (wrong, right):
            monomial = term_of(line)[1:]
            assert not self.agrees(printed, monomial)
            assert self.agrees(mended(equation), monomial)
        # The mended term alone is that coefficient; the printed one alone is not.
        for line, is_true in ((wrong, False), (right, True)):
            number, *monomial_parts = term_of(line)
            assert (abs(float(number) - self.TRUTH[monomial_parts[0], monomial_parts[1]]) <= 6e-4) is is_true

    @pytest.mark.parametrize("equation", list(PRINTED))
    def test_the_list_is_complete(self, equation: str) -> None:
        monomials = [key for key in self.TRUTH if equation == "(1)" or key[1] == PART[equation]]
        assert all(self.agrees(mended(equation), monomial) for monomial in monomials)
        astray = {monomial for monomial in monomials if not self.agrees(terms_of(PRINTED[equation]), monomial)}
        listed = {term_of(line)[1:] for where, *lines in MISPRINTS if where == equation for line in lines}
        assert astray == listed

    def test_as_printed_no_printed_vertex_lies_on_the_surface(self) -> None:
        worst = 0.0
        for gait in GAITS:
            for angles, printed in zip(gait.angles, gait.printed, strict=True):
                vertex = [*angles, *printed]
                off = abs(float(evaluated(terms_of(PRINTED["(5)"]), vertex)))
                assert off > 0.05, (gait.number, vertex)
                worst = max(worst, off)
                assert abs(float(evaluated(mended("(4)"), vertex))) <= 2e-3
                assert abs(float(evaluated(mended("(5)"), vertex))) <= 2e-3
        assert worst == pytest.approx(1.5, abs=0.05)

    def test_for_the_code_every_printed_vertex_lies_on_the_surface(self) -> None:
        vertices = np.array([[*a, *p] for gait in GAITS for a, p in zip(gait.angles, gait.printed, strict=True)])
        assert vertices.shape == (16, 4)
        for numbers in (PUBLISHED, EXACT):
            assert np.abs(roll_sensitivity(vertices, numbers)).max() <= 2e-3
            assert np.abs(pitch_sensitivity(vertices, numbers)).max() <= 2e-3

    def test_equation_6_as_printed_has_another_sign_than_equation_2_somewhere(self) -> None:
        alpha = random_tilts(1, 2000, reach=HALF_PI)
        as_printed, in_two = evaluated(terms_of(PRINTED["(6)"]), alpha), evaluated(terms_of(PRINTED["(2)"]), alpha)
        assert np.abs(as_printed - in_two).max() > 1
        assert (np.sign(as_printed) != np.sign(in_two)).any()
        np.testing.assert_allclose(level_determinant(alpha, PUBLISHED), in_two, atol=1e-12)


class TestCodeAgainstThePaper:
    @pytest.mark.parametrize(
        ("function", "equation"),
        [(roll_sensitivity, "(4)"), (pitch_sensitivity, "(5)"), (level_determinant, "(6)")],
    )
    def test_published_coefficients_term_by_term(self, function: Callable[..., Any], equation: str) -> None:
        stated = coefficients_by_monomial(mended(equation))
        expected = [stated.get((letters, PART[equation]), 0.0) for letters in LETTERS]
        np.testing.assert_allclose(function(CORNERS, PUBLISHED), expected, atol=1e-13)
        alpha = random_tilts(2, 500)
        np.testing.assert_allclose(function(alpha, PUBLISHED), evaluated(mended(equation), alpha), atol=1e-13)

    @pytest.mark.parametrize("kappa", KAPPAS)
    @pytest.mark.parametrize(
        ("function", "equation"),
        [(roll_sensitivity, "(4)"), (pitch_sensitivity, "(5)"), (level_determinant, "(6)")],
    )
    def test_exact_coefficients_term_by_term(self, function: Callable[..., Any], equation: str, kappa: float) -> None:
        numbers = coefficients_of(Vehicle(drag_ratio=kappa), "exact")
        expected = np.zeros(16)
        for number, letters, _ in mended(equation):
            expected[LETTERS.index(letters)] = (-1 if number[0] == "-" else 1) * IN_KAPPA[number[1:]](kappa)
        np.testing.assert_allclose(function(CORNERS, numbers), expected, atol=1e-14 / kappa)

    def test_the_determinant_is_formula_1(self) -> None:
        rng = np.random.default_rng(3)
        alpha, roll, pitch = random_tilts(4, 300), *rng.uniform(-1.5, 1.5, (2, 300))
        attitude_factors = {
            "sθ": np.sin(pitch),
            "sφcθ": np.sin(roll) * np.cos(pitch),
            "cφcθ": np.cos(roll) * np.cos(pitch),
        }
        expected = sum(evaluated([term], alpha) * attitude_factors[term[2]] for term in mended("(1)"))
        np.testing.assert_allclose(determinant(alpha, PUBLISHED, roll, pitch), expected, atol=1e-12)
        np.testing.assert_allclose(determinant(alpha, PUBLISHED), evaluated(mended("(6)"), alpha), atol=1e-13)


class TestCoefficients:
    def test_published_ones_are_the_printed_digits_and_the_angle_that_follows_from_the_first(self) -> None:
        for numbers in (coefficients_of(), coefficients_of(PAPER), coefficients_of(PAPER, "published")):
            assert numbers.kind == "published"
            assert (numbers.attitude, numbers.single, numbers.double, numbers.triple) == (2.880, 5.592, 0.9716, 0.1687)
            assert 1 / math.tan(2 * numbers.delta) == pytest.approx(2.880, rel=1e-15)
            assert numbers.first_arm_angle == 0.0

    @by_name
    @pytest.mark.parametrize("kappa", KAPPAS)
    def test_exact_ones_are_functions_of_kappa(self, vehicle: Vehicle, kappa: float) -> None:
        numbers = coefficients_of(vehicle.replace(drag_ratio=kappa), "exact")
        signed = kappa if vehicle.first_rotor_spin == "clockwise" else -kappa
        for name, printed in (("attitude", "2.880"), ("single", "5.592"), ("double", "0.9716"), ("triple", "0.1687")):
            assert getattr(numbers, name) == pytest.approx(IN_KAPPA[printed](signed), rel=1e-15, abs=1e-15)
        # The factorised forms rest on cot 2δ being the coefficient of (4) and (5).
        assert math.tan(numbers.delta) == pytest.approx(signed, rel=1e-15)
        assert math.cos(2 * numbers.delta) == pytest.approx(numbers.attitude * math.sin(2 * numbers.delta), abs=1e-15)
        assert numbers.first_arm_angle == vehicle.first_arm_angle

    def test_the_papers_digits_are_refused_for_another_vehicle_with_both_kappas(self) -> None:
        with pytest.raises(InputError) as caught:
            coefficients_of(vehicle_named("beetle_omni"), "published")
        assert str(caught.value) == (
            "coefficients: 'published' belong to the paper's vehicle (κ = 0.168666), not to 'beetle_omni' "
            "(κ = 0.0599129); allowed is 'exact'"
        )


class TestDeterminantAgainstTheMatrix:
    @by_name
    def test_the_decoupling_matrix_in_si_units(self, vehicle: Vehicle) -> None:
        rng = np.random.default_rng(5)
        alpha, roll, pitch = random_tilts(6, 400), rng.uniform(-3, 3, 400), rng.uniform(-1.5, 1.5, 400)
        mass, (ix, iy, iz), arm, thrust = vehicle.require(
            "mass", "inertia", "arm_length", "thrust_coefficient", purpose="this test"
        )
        constant = -2 * vehicle.signed_drag_ratio * thrust**4 * arm**3 / (mass * ix * iy * iz)
        value = np.linalg.det(decoupling_matrix(alpha, vehicle, roll, pitch)) / constant * np.cos(pitch)
        expected = determinant(alpha, coefficients_of(vehicle, "exact"), roll, pitch)
        np.testing.assert_allclose(value, expected, atol=1e-10)

    @by_name
    def test_the_scaled_matrix(self, vehicle: Vehicle) -> None:
        rng = np.random.default_rng(7)
        alpha, roll, pitch = random_tilts(8, 400), rng.uniform(-3, 3, 400), rng.uniform(-3, 3, 400)
        value = np.linalg.det(scaled_decoupling_matrix(alpha, vehicle, roll, pitch))
        expected = determinant(alpha, coefficients_of(vehicle, "exact"), roll, pitch)
        np.testing.assert_allclose(value, 2 * vehicle.signed_drag_ratio * expected, atol=1e-13)

    @by_name
    def test_the_matrix_maps_inputs_to_what_euler_angles_do(self, vehicle: Vehicle) -> None:
        # Rows: altitude, roll, pitch, yaw. Rebuilt with a rotation matrix and the rates of its angles.
        rng = np.random.default_rng(9)
        for alpha, (yaw, pitch, roll) in zip(random_tilts(10, 20), rng.uniform(-1.4, 1.4, (20, 3)), strict=True):
            to_world = Rotation.from_euler("ZYX", [yaw, pitch, roll]).as_matrix()
            inputs = rng.normal(size=4)
            altitude, *angular = decoupling_matrix(alpha, vehicle, roll, pitch) @ inputs
            mass, inertia = vehicle.require("mass", "inertia", purpose="this test")
            force, moment = control_force_matrix(alpha, vehicle), control_moment_matrix(alpha, vehicle)
            assert altitude == pytest.approx(float((to_world @ force @ inputs)[2]) / mass)
            # Body angular acceleration from rest: the axes of the three rotations, seen from the body.
            axes = np.stack(
                [
                    np.array([1.0, 0.0, 0.0]),
                    Rotation.from_euler("X", roll).as_matrix().T @ [0.0, 1.0, 0.0],
                    to_world.T @ [0.0, 0.0, 1.0],
                ],
                axis=-1,
            )
            np.testing.assert_allclose(axes @ angular, moment @ inputs / np.array(inertia), rtol=1e-9, atol=1e-12)

    @pytest.mark.parametrize("kappa", KAPPAS)
    def test_any_drag_ratio_to_fifty_digits(self, kappa: float) -> None:
        # Near the singular sheet all digits cancel: the stated resolution must cover what floats lose there.
        numbers = coefficients_of(Vehicle(drag_ratio=kappa), "exact")
        delta = math.atan(kappa)
        rng = np.random.default_rng(13)
        # Right angles: the pair features all but vanish there, and what is left of them is rounding.
        samples = [*random_tilts(14, 6), *CORNERS[[0, -1]], np.array([HALF_PI, -HALF_PI, 3.0, 3.0])]
        for first, second in rng.uniform(-1.5, 1.5, (6, 2)):
            samples += [np.array([first, second, 2 * delta - first, -2 * delta - second]) + rng.normal(0, 1e-9, 4)]
            samples += [np.array([first, second, first, second])]
        with mpmath.workdps(50):
            for alpha in samples:
                exact = self.to_fifty_digits(alpha, kappa)
                computed = float(level_determinant(alpha, numbers))
                resolution = float(level_determinant_resolution(alpha, numbers))
                assert abs(computed - exact) <= resolution, (alpha, computed, exact)
                assert resolution <= 1e-12 / kappa

    @staticmethod
    def to_fifty_digits(alpha: FloatArray, kappa: float) -> Any:
        k = mpmath.mpf(kappa)
        s, c = [mpmath.sin(mpmath.mpf(float(a))) for a in alpha], [mpmath.cos(mpmath.mpf(float(a))) for a in alpha]
        matrix = mpmath.matrix(
            [
                [0, c[1] - k * s[1], 0, -c[3] + k * s[3]],
                [c[0] + k * s[0], 0, -c[2] - k * s[2], 0],
                [s[0] - k * c[0], -s[1] - k * c[1], s[2] - k * c[2], -s[3] - k * c[3]],
                [-c[0], c[1], -c[2], c[3]],
            ]
        )
        return mpmath.det(matrix) / (2 * k)


class TestForcesAndTorques:
    @by_name
    def test_each_rotor_rebuilt_from_its_axis(self, vehicle: Vehicle) -> None:
        thrust, drag = vehicle.require("thrust_coefficient", "drag_coefficient", purpose="this test")
        (arm,) = vehicle.require("arm_length", purpose="this test")
        for alpha in random_tilts(15, 10):
            force, moment = control_force_matrix(alpha, vehicle), control_moment_matrix(alpha, vehicle)
            for i in range(4):
                angle = vehicle.first_arm_angle + i * HALF_PI
                outward = np.array([math.cos(angle), math.sin(angle), 0.0])
                axis = Rotation.from_rotvec(alpha[i] * outward).apply([0.0, 0.0, 1.0])
                # Positive w turns a rotor counter-clockwise about its axis, and the air pulls it back. The
                # propeller of a rotor that is meant to turn clockwise lifts when w is negative.
                clockwise = (i % 2 == 0) == (vehicle.first_rotor_spin == "clockwise")
                push = thrust * axis * (-1.0 if clockwise else 1.0)
                np.testing.assert_allclose(force[:, i], push, atol=1e-15 * thrust)
                torque = np.cross(arm * outward, push) - drag * axis
                np.testing.assert_allclose(moment[:, i], torque, atol=1e-14 * thrust * arm)

    def test_the_papers_matrices_entry_by_entry(self) -> None:
        thrust, arm = PAPER.require("thrust_coefficient", "arm_length", purpose="this test")
        for alpha in random_tilts(16, 20):
            force, moment = plain_matrices(alpha, PAPER.drag_ratio)
            np.testing.assert_allclose(control_force_matrix(alpha) / thrust, force, atol=1e-15)
            np.testing.assert_allclose(control_moment_matrix(alpha) / (thrust * arm), moment, atol=1e-14)
            np.testing.assert_allclose(scaled_decoupling_matrix(alpha)[:3], moment, atol=1e-15)
            np.testing.assert_allclose(scaled_decoupling_matrix(alpha)[3], force[2], atol=1e-15)

    @pytest.mark.parametrize(
        ("function", "what", "constants"),
        [
            (control_force_matrix, "the control force matrix", ["thrust_coefficient"]),
            (control_moment_matrix, "the control moment matrix", ["thrust_coefficient", "arm_length"]),
            (decoupling_matrix, "the decoupling matrix", ["mass", "inertia", "arm_length", "thrust_coefficient"]),
        ],
    )
    def test_a_constant_that_is_not_stated_is_named_with_what_needs_it(
        self, function: Callable[..., Any], what: str, constants: list[str]
    ) -> None:
        whole = {name: getattr(PAPER, name) for name in ("drag_ratio", "mass", "inertia", *constants)}
        for missing in constants:
            vehicle = Vehicle(**{name: value for name, value in whole.items() if name != missing})
            with pytest.raises(MissingConstant, match=rf" states no {missing} \(.*\), which {what} needs$"):
                function([0, 0, 0, 0], vehicle)

    @given(roll=rolls, pitch=pitches)
    @settings(deadline=None, max_examples=50)
    def test_the_vertical_seen_from_the_body(self, roll: float, pitch: float) -> None:
        to_world = Rotation.from_euler("ZYX", [0.4, pitch, roll]).as_matrix()
        np.testing.assert_allclose(body_vertical(roll, pitch), to_world.T @ [0.0, 0.0, 1.0], atol=1e-15)


class TestTurningAndMirroring:
    @given(alpha=tilts, turn=st.floats(-7, 7), roll=rolls, pitch=pitches)
    @example(alpha=(0.3, -0.9, 1.1, 0.4), turn=1.0, roll=0.2, pitch=-0.5)
    @settings(deadline=None, max_examples=100)
    def test_turned_arms_see_a_turned_attitude(
        self, alpha: tuple[float, ...], turn: float, roll: float, pitch: float
    ) -> None:
        turned = coefficients_of(PAPER.replace(first_arm_angle=turn), "exact")
        assert level_determinant(alpha, turned) == level_determinant(alpha, EXACT)
        # The same vertical in the frame that turned with the arms is another roll and pitch.
        x, y, z = Rotation.from_euler("Z", turn).inv().apply(body_vertical(roll, pitch))
        same = {"roll": math.atan2(y, z), "pitch": math.asin(max(-1.0, min(1.0, -x)))}
        assert determinant(alpha, turned, roll, pitch) == pytest.approx(determinant(alpha, EXACT, **same), abs=1e-12)
        # (Rθ, Rφ) turn, so their length stays: the condition that both vanish does not move.
        before = math.hypot(pitch_sensitivity(alpha, EXACT), roll_sensitivity(alpha, EXACT))
        after = math.hypot(pitch_sensitivity(alpha, turned), roll_sensitivity(alpha, turned))
        assert after == pytest.approx(before, abs=1e-13)

    @given(alpha=tilts, roll=rolls, pitch=pitches)
    @settings(deadline=None, max_examples=50)
    def test_mirrored_spins_are_mirrored_tilts(self, alpha: tuple[float, ...], roll: float, pitch: float) -> None:
        mirrored = coefficients_of(MIRRORED, "exact")
        opposite = [-angle for angle in alpha]
        assert level_determinant(alpha, mirrored) == pytest.approx(level_determinant(opposite, EXACT), abs=1e-13)
        assert roll_sensitivity(alpha, mirrored) == pytest.approx(-roll_sensitivity(opposite, EXACT), abs=1e-13)
        assert pitch_sensitivity(alpha, mirrored) == pytest.approx(-pitch_sensitivity(opposite, EXACT), abs=1e-13)
        assert determinant(alpha, mirrored, roll, pitch) == pytest.approx(
            determinant(opposite, EXACT, -roll, -pitch), abs=1e-13
        )
        assert least_singular_value(alpha, MIRRORED, roll, pitch) == pytest.approx(
            least_singular_value(opposite, PAPER, -roll, -pitch), abs=1e-13
        )

    @given(alpha=tilts, turn=st.floats(-7, 7))
    @settings(deadline=None, max_examples=50)
    def test_turning_turns_forces_torques_and_the_zero_moment_direction(
        self, alpha: tuple[float, ...], turn: float
    ) -> None:
        turned = PAPER.replace(first_arm_angle=turn)
        rotation = Rotation.from_euler("Z", turn).as_matrix()
        for matrix in (control_force_matrix, control_moment_matrix):
            np.testing.assert_allclose(matrix(alpha, turned), rotation @ matrix(alpha), atol=1e-20)
        np.testing.assert_allclose(
            zero_moment_direction(alpha, turned), rotation @ zero_moment_direction(alpha), atol=1e-14
        )

    @pytest.mark.parametrize("name", ["paper", "beetle_omni"])
    def test_the_surfaces_do_not_turn(self, name: str) -> None:
        vehicle = vehicle_named(name).replace(first_arm_angle=0.3)
        numbers = coefficients_of(vehicle, "exact")
        first, second = np.random.default_rng(17).uniform(-1.5, 1.5, (2, 50))
        for alpha in (on_red(first, second), on_blue(first, second, vehicle)):
            assert np.abs(roll_sensitivity(alpha, numbers)).max() < 1e-13
            assert np.abs(pitch_sensitivity(alpha, numbers)).max() < 1e-13


class TestZeroMomentDirection:
    @by_name
    def test_the_inputs_make_no_torque(self, vehicle: Vehicle) -> None:
        alpha = random_tilts(18, 200)
        inputs = zero_moment_inputs(alpha, vehicle)
        torque = scaled_decoupling_matrix(alpha, vehicle)[..., :3, :] @ inputs[..., None]
        np.testing.assert_allclose(torque, 0, atol=1e-14)
        # Not by being zero: away from blue the torques have rank three and w₀ spans what remains.
        for sample, found in zip(alpha, inputs, strict=True):
            *_, singular, rows = np.linalg.svd(scaled_decoupling_matrix(sample, vehicle)[:3])
            assert singular[-1] > 1e-6
            assert abs(float(rows[-1] @ found)) == pytest.approx(float(np.linalg.norm(found)), rel=1e-8)
            assert np.linalg.norm(found) > 1e-6

    @by_name
    def test_formula_1_is_its_height(self, vehicle: Vehicle) -> None:
        rng = np.random.default_rng(19)
        alpha, roll, pitch = random_tilts(20, 200), rng.uniform(-3, 3, 200), rng.uniform(-3, 3, 200)
        kappa = vehicle.signed_drag_ratio
        height = np.sum(zero_moment_direction(alpha, vehicle) * body_vertical(roll, pitch), axis=-1)
        expected = determinant(alpha, coefficients_of(vehicle, "exact"), roll, pitch)
        # The thrust of a mirrored rotor is reversed, which takes the sign away again.
        sense = 1.0 if vehicle.first_rotor_spin == "clockwise" else -1.0
        scale = 2 * abs(kappa) * math.cos(math.atan(kappa)) ** 3
        np.testing.assert_allclose(height, -sense * np.sign(kappa) * scale * expected, atol=1e-13)

    @by_name
    def test_it_is_the_body_vertical_on_red_and_nothing_on_blue(self, vehicle: Vehicle) -> None:
        first, second = np.random.default_rng(21).uniform(-HALF_PI, HALF_PI, (2, 200))
        red, blue = on_red(first, second), on_blue(first, second, vehicle)
        direction = zero_moment_direction(red, vehicle)
        np.testing.assert_allclose(direction[:, :2], 0, atol=1e-15)
        assert (np.abs(direction[:, 2]) > 1e-6).all()
        np.testing.assert_allclose(zero_moment_inputs(blue, vehicle), 0, atol=1e-15)
        for sample in blue:
            singular = np.linalg.svd(scaled_decoupling_matrix(sample, vehicle)[:3], compute_uv=False)
            assert singular[2] < 1e-14 < singular[1]

    def test_off_the_surfaces_it_leans(self) -> None:
        alpha = random_tilts(22, 200, reach=1.5)
        direction = zero_moment_direction(alpha)
        sensitivity = np.hypot(roll_sensitivity(alpha, EXACT), pitch_sensitivity(alpha, EXACT))
        scale = 2 * PAPER.drag_ratio * math.cos(math.atan(PAPER.drag_ratio)) ** 3
        np.testing.assert_allclose(np.hypot(direction[:, 0], direction[:, 1]), scale * sensitivity, atol=1e-14)
        assert sensitivity.min() > 1e-3


class TestHoverThrusts:
    @by_name
    def test_they_carry_the_weight_and_make_no_torque(self, vehicle: Vehicle) -> None:
        alpha = random_tilts(23, 200)
        arms = vehicle.first_arm_angle + HALF_PI * np.arange(4)
        for sample, shares in zip(alpha, hover_thrust_shares(alpha, vehicle), strict=True):
            force, torque = np.zeros(3), np.zeros(3)
            for i in range(4):
                outward = np.array([math.cos(arms[i]), math.sin(arms[i]), 0.0])
                axis = Rotation.from_rotvec(sample[i] * outward).apply([0.0, 0.0, 1.0])
                clockwise = (i % 2 == 0) == (vehicle.first_rotor_spin == "clockwise")
                force += shares[i] * axis
                # A rotor that turns clockwise turns the body counter-clockwise.
                torque += np.cross(outward, shares[i] * axis)
                torque += (1 if clockwise else -1) * vehicle.drag_ratio * shares[i] * axis
            size = float(np.abs(shares).max())
            assert force[2] == pytest.approx(1.0, abs=1e-12 * size)
            np.testing.assert_allclose(torque, 0, atol=1e-12 * size)

    @by_name
    def test_on_red_no_horizontal_force_remains_and_opposite_rotors_share_alike(self, vehicle: Vehicle) -> None:
        delta = math.atan(vehicle.signed_drag_ratio)
        first, second = np.random.default_rng(24).uniform(-1.4, 1.4, (2, 300))
        alpha = on_red(first, second)
        shares = hover_thrust_shares(alpha, vehicle)
        np.testing.assert_allclose(shares[:, :2], shares[:, 2:], rtol=1e-12)
        odd, even = np.abs(np.sin(second + delta)), np.abs(np.sin(first - delta))
        np.testing.assert_allclose(np.abs(shares[:, 0]) * even, np.abs(shares[:, 1]) * odd, rtol=1e-10)
        # m·g = 2(T1 cos α1 + T2 cos α2)
        weight = 2 * (shares[:, 0] * np.cos(first) + shares[:, 1] * np.cos(second))
        np.testing.assert_allclose(weight, 1, atol=1e-9)
        upward = (shares > 0).all(axis=-1)
        expected = ((first < delta) & (second > -delta)) | ((first > delta) & (second < -delta))
        assert (upward == expected).all()
        assert 0 < np.count_nonzero(upward) < 300

    @pytest.mark.parametrize("vehicle", [PAPER, vehicle_named("beetle_omni")], ids=lambda vehicle: vehicle.name)
    def test_with_all_rotors_lying_flat_no_thrust_is_enough(self, vehicle: Vehicle) -> None:
        # R = 0 there. Up to rounding nothing pushes up: the answer is huge or infinite, and is given without a warning.
        for alpha in ([HALF_PI] * 4, [-HALF_PI] * 4):
            assert abs(float(level_determinant(alpha, coefficients_of(vehicle, "exact")))) < 1e-13
            assert (np.abs(hover_thrust_shares(alpha, vehicle)) > 1e12).all()

    def test_on_blue_there_are_none(self) -> None:
        # β is a whole number of right angles, so that the zeros are exact and the answer is not a ratio of noise.
        delta = math.atan(PAPER.drag_ratio)
        assert np.isnan(hover_thrust_shares([delta, -delta, delta, -delta])).all()


class TestLeastSingularValue:
    @pytest.mark.parametrize("kappa", KAPPAS)
    def test_upright_it_is_twice_kappa_while_kappa_is_small(self, kappa: float) -> None:
        # The other three are √2, √2 and 2: rolling, pitching and lifting.
        value = float(least_singular_value([0, 0, 0, 0], Vehicle(drag_ratio=kappa)))
        assert value == pytest.approx(min(2 * kappa, math.sqrt(2)), rel=1e-12)

    @given(alpha=tilts, roll=rolls, pitch=pitches, kappa=ratios, turn=st.floats(-7, 7))
    @settings(deadline=None, max_examples=150)
    def test_it_stays_between_its_bounds(
        self, alpha: tuple[float, ...], roll: float, pitch: float, kappa: float, turn: float
    ) -> None:
        vehicle = Vehicle(drag_ratio=kappa, first_arm_angle=turn)
        value = float(least_singular_value(alpha, vehicle, roll, pitch))
        assert 0 <= value <= 2 * math.sqrt((1 + kappa**2) / 3) + 1e-12
        arms = turn + HALF_PI * np.arange(4)
        outward = np.stack([np.cos(arms), np.sin(arms), np.zeros(4)], axis=-1)
        axes = Rotation.from_rotvec(np.array(alpha)[:, None] * outward).apply([0.0, 0.0, 1.0])
        # The squares of all entries: the columns of τ have length √(1 + κ²).
        squares = float(np.sum((axes @ body_vertical(roll, pitch)) ** 2)) + 4 * (1 + kappa**2)
        volume = 2 * kappa * abs(float(determinant(alpha, coefficients_of(vehicle, "exact"), roll, pitch)))
        assert value >= volume * (3 / squares) ** 1.5 - 1e-12

    @pytest.mark.parametrize("sample", [(-0.448, 0.448), (0.783, -0.783)])
    def test_the_cap_is_reached_on_red(self, sample: tuple[float, float]) -> None:
        cap = 2 * math.sqrt((1 + PAPER.drag_ratio**2) / 3)
        assert round(cap, 2) == 1.17
        assert float(least_singular_value([*sample, *sample])) == pytest.approx(cap, abs=2e-3)

    @given(
        first=st.floats(-math.pi, math.pi),
        second=st.floats(-math.pi, math.pi),
        kappa=ratios,
        spin=st.sampled_from(["clockwise", "counterclockwise"]),
        turn=st.floats(-7, 7),
    )
    @settings(deadline=None, max_examples=200)
    def test_the_closed_form_on_red(self, first: float, second: float, kappa: float, spin: Any, turn: float) -> None:
        vehicle = Vehicle(drag_ratio=kappa, first_rotor_spin=spin, first_arm_angle=turn)
        expected = float(least_singular_value([first, second, first, second], vehicle))
        assert float(least_singular_value_on_red(first, second, vehicle)) == pytest.approx(expected, abs=1e-13)

    @pytest.mark.parametrize("kappa", [1e-4, 0.168666, 1.0])
    @pytest.mark.parametrize("offset", [0.0, 1e-12, 1e-8, 1e-3])
    def test_the_closed_form_near_the_singular_lines_of_red(self, kappa: float, offset: float) -> None:
        vehicle = Vehicle(drag_ratio=kappa)
        delta = math.atan(kappa)
        for first, second in itertools.product((delta, delta - HALF_PI), (-delta, HALF_PI - delta, 0.3)):
            a1, a2 = first + offset, second - offset
            expected = float(least_singular_value([a1, a2, a1, a2], vehicle))
            assert float(least_singular_value_on_red(a1, a2, vehicle)) == pytest.approx(expected, abs=1e-14)

    @given(alpha=tilts, direction=tilts, size=st.floats(1e-6, 1.0), roll=rolls, pitch=pitches, kappa=ratios)
    @settings(deadline=None, max_examples=150)
    def test_it_is_lipschitz_in_the_tilts(
        self,
        alpha: tuple[float, ...],
        direction: tuple[float, ...],
        size: float,
        roll: float,
        pitch: float,
        kappa: float,
    ) -> None:
        vehicle = Vehicle(drag_ratio=kappa)
        step = size * np.array(direction)
        change = float(
            least_singular_value(alpha + step, vehicle, roll, pitch) - least_singular_value(alpha, vehicle, roll, pitch)
        )
        assert abs(change) <= math.sqrt(2 + kappa**2) * float(np.linalg.norm(step)) + 1e-12

    def test_on_blue_it_vanishes_at_every_attitude(self) -> None:
        rng = np.random.default_rng(25)
        first, second, roll, pitch = rng.uniform(-1.5, 1.5, (4, 200))
        for vehicle in VEHICLES:
            assert least_singular_value(on_blue(first, second, vehicle), vehicle, roll, pitch).max() < 1e-14


class TestResolution:
    AXIS = np.arange(-7, 8) * math.pi / 16

    def grid(self, delta: float, color: str) -> FloatArray:
        first, second = np.meshgrid(self.AXIS, self.AXIS, indexing="ij")
        if color == "red":
            return np.stack([first, second, first, second], axis=-1).reshape(-1, 4)
        return np.stack([first, second, 2 * delta - first, -2 * delta - second], axis=-1).reshape(-1, 4)

    @pytest.mark.parametrize("numbers", [PUBLISHED, EXACT], ids=lambda numbers: numbers.kind)
    def test_on_the_papers_grid_red_is_decided_and_blue_is_not(self, numbers: Any) -> None:
        red, blue = self.grid(numbers.delta, "red"), self.grid(numbers.delta, "blue")
        assert red.shape == blue.shape == (225, 4)
        assert (np.abs(level_determinant(blue, numbers)) <= level_determinant_resolution(blue, numbers)).all()
        assert (np.abs(level_determinant(red, numbers)) > level_determinant_resolution(red, numbers)).all()
        # With a bound so wide that nothing is ever decided, the first half would say nothing.
        limit = 5e-3 if numbers.kind == "published" else 1e-12
        assert level_determinant_resolution(np.concatenate([red, blue]), numbers).max() < limit

    def test_wrapping_blue_by_pi_changes_neither_verdict(self) -> None:
        blue = self.grid(PUBLISHED.delta, "blue")
        blue[:, 2:] -= math.pi * np.rint(blue[:, 2:] / math.pi)
        assert (np.abs(level_determinant(blue, PUBLISHED)) <= level_determinant_resolution(blue, PUBLISHED)).all()

    def test_rounded_angles_leave_the_printed_blue_vertices_undecided(self) -> None:
        for gait in GAITS:
            vertices = np.array([[*a, *p] for a, p in zip(gait.angles, gait.printed, strict=True)])
            for numbers in (PUBLISHED, EXACT):
                value = np.abs(level_determinant(vertices, numbers))
                resolution = level_determinant_resolution(vertices, numbers, 5e-4)
                assert (value <= resolution).all() if gait.color == "blue" else (value > resolution).all()

    @given(
        alpha=tilts,
        angle_shifts=st.tuples(*[st.floats(-1, 1)] * 4),
        number_shifts=st.tuples(*[st.floats(-1, 1)] * 3),
        rounding=st.sampled_from([0.0, 1e-6, 5e-4, 5e-3]),
    )
    @settings(deadline=None, max_examples=200)
    def test_it_covers_what_rounding_can_do(
        self,
        alpha: tuple[float, ...],
        angle_shifts: tuple[float, ...],
        number_shifts: tuple[float, ...],
        rounding: float,
    ) -> None:
        _, single, double, triple = PUBLISHED.rounding
        meant = replace(
            PUBLISHED,
            single=PUBLISHED.single + single * number_shifts[0],
            double=PUBLISHED.double + double * number_shifts[1],
            triple=PUBLISHED.triple + triple * number_shifts[2],
        )
        # α3 and α4 may have been computed with a rounded 2δ.
        reach = rounding + np.array([0.0, 0.0, 1.0, 1.0]) * 2 * PUBLISHED.delta_rounding
        true_value = level_determinant(np.array(alpha) + np.array(angle_shifts) * reach, meant)
        change = abs(float(true_value - level_determinant(alpha, PUBLISHED)))
        assert change <= float(level_determinant_resolution(alpha, PUBLISHED, rounding))

    @pytest.mark.parametrize("rounding", [0.0, 5e-4, 5e-2])
    def test_it_covers_the_worst_that_rounding_can_do(self, rounding: float) -> None:
        # All numbers and all angles off by as much as they may be, in every combination of directions.
        reach = rounding + np.array([0.0, 0.0, 1.0, 1.0]) * 2 * PUBLISHED.delta_rounding
        directions = np.array(list(itertools.product((-1.0, 1.0), repeat=4)))
        alpha = random_tilts(31, 60)
        resolution = level_determinant_resolution(alpha, PUBLISHED, rounding)
        worst = np.zeros(60)
        for signs in itertools.product((-1.0, 1.0), repeat=3):
            single, double, triple = np.array(signs) * PUBLISHED.rounding[1:]
            meant = replace(
                PUBLISHED,
                single=PUBLISHED.single + single,
                double=PUBLISHED.double + double,
                triple=PUBLISHED.triple + triple,
            )
            true_value = level_determinant(alpha[:, None] + directions * reach, meant)
            change = np.abs(true_value - level_determinant(alpha, PUBLISHED)[:, None])
            worst = np.maximum(worst, change.max(axis=1))
        assert (worst <= resolution).all()
        # And is not far beyond it.
        assert (resolution <= 10 * worst).all()

    def test_to_first_order_it_is_the_sum_of_slopes_times_roundings(self) -> None:
        # R is linear in its numbers, so that differences give its slopes there; those in the angles are central ones.
        for alpha in random_tilts(33, 40):
            value = float(level_determinant(alpha, PUBLISHED))
            expected = 0.0
            for name, off in zip(("single", "double", "triple"), PUBLISHED.rounding[1:], strict=True):
                more = replace(PUBLISHED, **{name: getattr(PUBLISHED, name) + 1})
                expected += off * abs(float(level_determinant(alpha, more)) - value)
            for i, off in enumerate(1e-7 + np.array([0.0, 0.0, 1.0, 1.0]) * 2 * PUBLISHED.delta_rounding):
                step = 1e-5 * np.eye(4)[i]
                difference = level_determinant(alpha + step, PUBLISHED) - level_determinant(alpha - step, PUBLISHED)
                expected += off * abs(float(difference)) / 2e-5
            resolution = float(level_determinant_resolution(alpha, PUBLISHED, 1e-7))
            second_order = 100 * (1e-7 + 2 * PUBLISHED.delta_rounding) ** 2
            assert expected - 1e-9 <= resolution <= expected + second_order

    def test_where_all_slopes_vanish_the_second_order_is_covered(self) -> None:
        # Without `single`, R = 4 at α = 0 is stationary in all angles and does not depend on the other numbers.
        numbers = replace(PUBLISHED, single=0.0)
        derived = 2 * numbers.delta_rounding
        for rounding in (0.0, derived, 1e-3):
            reach = rounding + np.array([0.0, 0.0, 1.0, 1.0]) * derived
            moved = np.array(list(itertools.product((-1.0, 1.0), repeat=4))) * reach
            worst = float(np.abs(level_determinant(moved, numbers) - 4.0).max())
            assert worst > (rounding + derived) ** 2
            assert worst <= float(level_determinant_resolution(np.zeros(4), numbers, rounding))

    def test_the_rounding_of_the_crossing_angle_is_that_of_its_cotangent(self) -> None:
        ends = [0.5 * math.atan2(1.0, 2.880 + shift) for shift in (-5e-4, 5e-4)]
        assert max(abs(end - PUBLISHED.delta) for end in ends) == pytest.approx(PUBLISHED.delta_rounding, rel=1e-3)
        assert abs(EXACT.delta - PUBLISHED.delta) < PUBLISHED.delta_rounding


FUNCTIONS: dict[str, Callable[[Any], Any]] = {
    "roll_sensitivity": lambda alpha: roll_sensitivity(alpha, PUBLISHED),
    "pitch_sensitivity": lambda alpha: pitch_sensitivity(alpha, PUBLISHED),
    "pitch_sensitivity, turned": lambda alpha: pitch_sensitivity(alpha, coefficients_of(TURNED)),
    "level_determinant": lambda alpha: level_determinant(alpha, PUBLISHED),
    "level_determinant_resolution": lambda alpha: level_determinant_resolution(alpha, PUBLISHED, 1e-3),
    "level_determinant_resolution, exact": lambda alpha: level_determinant_resolution(alpha, EXACT),
    "determinant": lambda alpha: determinant(alpha, PUBLISHED, 0.2, -0.1),
    "control_force_matrix": lambda alpha: control_force_matrix(alpha) / 8.048e-6,
    "control_moment_matrix": lambda alpha: control_moment_matrix(alpha) / (8.048e-6 * 0.1785),
    "scaled_decoupling_matrix": lambda alpha: scaled_decoupling_matrix(alpha, BOTH, 0.2, -0.1),
    "decoupling_matrix": lambda alpha: decoupling_matrix(alpha, PAPER, 0.2, -0.1),
    "zero_moment_inputs": zero_moment_inputs,
    "zero_moment_direction": zero_moment_direction,
    "hover_thrust_shares": hover_thrust_shares,
    "least_singular_value": lambda alpha: least_singular_value(alpha, PAPER, 0.2, -0.1),
}
WITH_ATTITUDE: dict[str, Callable[[Any, Any, Any], Any]] = {
    "determinant": lambda alpha, roll, pitch: determinant(alpha, EXACT, roll, pitch),
    "scaled_decoupling_matrix": lambda alpha, roll, pitch: scaled_decoupling_matrix(alpha, TURNED, roll, pitch),
    "decoupling_matrix": lambda alpha, roll, pitch: decoupling_matrix(alpha, TURNED, roll, pitch),
    "least_singular_value": lambda alpha, roll, pitch: least_singular_value(alpha, TURNED, roll, pitch),
}


class TestShapes:
    @pytest.mark.parametrize("function", FUNCTIONS.values(), ids=FUNCTIONS.keys())
    @pytest.mark.parametrize("shape", [(), (1,), (5,), (0,), (2, 3), (2, 0), (1, 2, 1, 3)])
    def test_leading_axes_broadcast(self, function: Callable[[Any], Any], shape: tuple[int, ...]) -> None:
        alpha = random_tilts(26, *shape, reach=1.4)
        together = np.asarray(function(alpha))
        tail = np.asarray(function(np.zeros(4))).shape
        assert together.shape == shape + tail
        assert together.dtype == float
        for index in np.ndindex(*shape):
            np.testing.assert_allclose(together[index], function(alpha[index]), rtol=1e-12, atol=1e-12)

    @pytest.mark.parametrize("function", FUNCTIONS.values(), ids=FUNCTIONS.keys())
    def test_lists_and_whole_numbers_are_taken_and_arrays_left_alone(self, function: Callable[[Any], Any]) -> None:
        expected = function(np.array([1.0, 0.0, 1.0, -1.0]))
        np.testing.assert_array_equal(function([1, 0, 1, -1]), expected)
        np.testing.assert_array_equal(function(np.array([1, 0, 1, -1])), expected)
        alpha = random_tilts(27, 3)
        before = alpha.copy()
        function(alpha)
        np.testing.assert_array_equal(alpha, before)

    def test_level_flight_is_the_default_attitude(self) -> None:
        alpha = random_tilts(34, 5)
        for function in (scaled_decoupling_matrix, decoupling_matrix, least_singular_value):
            np.testing.assert_array_equal(function(alpha), function(alpha, PAPER, 0.0, 0.0))
        np.testing.assert_array_equal(determinant(alpha, EXACT), determinant(alpha, EXACT, 0.0, 0.0))

    @pytest.mark.parametrize("function", FUNCTIONS.values(), ids=FUNCTIONS.keys())
    @pytest.mark.parametrize("shape", [(), (0,), (3,), (5,), (4, 3), (4, 1), (2, 4, 5)])
    def test_another_last_axis_is_refused_with_the_shape(
        self, function: Callable[[Any], Any], shape: tuple[int, ...]
    ) -> None:
        with pytest.raises(InputError, match=r"^alpha: an array of shape .*; allowed is \(\.\.\., 4\)$") as caught:
            function(np.zeros(shape))
        assert str(shape) in str(caught.value)

    @pytest.mark.parametrize("function", WITH_ATTITUDE.values(), ids=WITH_ATTITUDE.keys())
    @pytest.mark.parametrize(
        ("lead", "roll_shape", "pitch_shape"),
        [
            ((), (), ()),
            ((), (3,), ()),
            ((), (), (3,)),
            ((), (5, 1), (3,)),
            ((3,), (), ()),
            ((3,), (5, 1), ()),
            ((5, 1), (3,), (3,)),
            ((5, 3), (5, 3), (1, 3)),
            ((2, 1, 1), (5, 1), (3,)),
            ((0,), (), (1,)),
        ],
    )
    def test_attitudes_broadcast_against_leading_axes(
        self,
        function: Callable[[Any, Any, Any], Any],
        lead: tuple[int, ...],
        roll_shape: tuple[int, ...],
        pitch_shape: tuple[int, ...],
    ) -> None:
        rng = np.random.default_rng(28)
        alpha = random_tilts(29, *lead, reach=1.4)
        roll, pitch = rng.uniform(-1, 1, roll_shape), rng.uniform(-1, 1, pitch_shape)
        together = np.asarray(function(alpha, roll, pitch))
        shape = np.broadcast_shapes(lead, roll_shape, pitch_shape)
        tail = np.asarray(function(np.zeros(4), 0.0, 0.0)).shape
        assert together.shape == shape + tail
        tilt, rolled, pitched = (
            np.broadcast_to(alpha, (*shape, 4)),
            np.broadcast_to(roll, shape),
            np.broadcast_to(pitch, shape),
        )
        for index in np.ndindex(*shape):
            one = function(tilt[index], float(rolled[index]), float(pitched[index]))
            np.testing.assert_allclose(together[index], one, rtol=1e-12, atol=1e-14)

    def test_coefficients_have_two_kinds(self) -> None:
        assert coefficients_of().kind == "published"
        assert coefficients_of(PAPER, "exact").kind == "exact"
        with pytest.raises(InputError, match="coefficients: 'rounded'; allowed are 'published' and 'exact'"):
            coefficients_of(PAPER, "rounded")  # type: ignore[arg-type]


class TestBoundOfTheLeastSingularValue:
    """The bound from arithmetic alone against the decomposition."""

    VEHICLES = (
        PAPER,
        PAPER.replace(first_rotor_spin="counterclockwise"),
        gg.Vehicle(drag_ratio=1e-3),
        gg.Vehicle(drag_ratio=0.9),
        gg.Vehicle(drag_ratio=5.0),
    )

    @pytest.mark.parametrize("vehicle", VEHICLES, ids=lambda vehicle: f"{vehicle.signed_drag_ratio:.3g}")
    def test_it_is_a_bound_and_near(self, vehicle: gg.Vehicle) -> None:
        rng = np.random.default_rng(7)
        alpha = rng.uniform(-np.pi, np.pi, (4000, 4))
        alpha[:1000, 2:] = alpha[:1000, :2]
        alpha[1000:1500] = np.round(alpha[1000:1500] / (np.pi / 4)) * np.pi / 4
        bound, value = least_singular_value_bound(alpha, vehicle), least_singular_value(alpha, vehicle)
        assert (bound <= value + 1e-7).all()
        assert (bound >= 0.85 * value - 1e-7).all()
        assert (bound[1500:] <= value[1500:]).all()
        assert np.quantile(bound[1500:] / value[1500:], 0.1) > 0.99
        assert np.median(bound[1500:] / value[1500:]) > 1 - 2e-6

    def test_it_vanishes_where_the_matrix_is_singular(self) -> None:
        exact = coefficients_of(kind="exact")
        rng = np.random.default_rng(8)
        blue = gg.lift(rng.uniform(-1, 1, (50, 2)), "blue", coefficients=exact).alpha
        assert least_singular_value_bound(blue).max() < 1e-7


@pytest.mark.parametrize("kind", ["published", "exact"])
def test_slopes_of_R_against_differences(kind: Kind) -> None:
    coefficients, step = coefficients_of(kind=kind), 1e-6
    alpha = np.random.default_rng(9).uniform(-2, 2, (40, 4))
    slopes = level_determinant_slopes(alpha, coefficients)
    for k, unit in enumerate(np.eye(4)):
        ahead, behind = (level_determinant(alpha + sign * step * unit, coefficients) for sign in (1, -1))
        np.testing.assert_allclose(slopes[:, k], np.abs(ahead - behind) / (2 * step), atol=1e-7)


def test_what_the_rounding_of_delta_moves() -> None:
    """2.880 stands for anything from 2.8795 to 2.8805: 2δ = arccot of it moves by at most `sheet_rounding`."""
    published = coefficients_of()
    for attitude in (2.8795, 2.8805):
        assert abs(np.arctan2(1, attitude) - 2 * published.delta) <= published.sheet_rounding * 1.001
    assert published.sheet_rounding < 1.1 * abs(np.arctan2(1, 2.8795) - 2 * published.delta)
    assert coefficients_of(kind="exact").sheet_rounding == 0.0


@pytest.mark.parametrize("kind", ["published", "exact"])
def test_noise_is_above_what_floating_point_makes_of_zero(kind: Kind) -> None:
    """On the exact blue sheet R is zero but for rounding."""
    coefficients = coefficients_of(kind=kind)
    exact = coefficients_of(kind="exact")
    blue = gg.lift(np.random.default_rng(2).uniform(-1.5, 1.5, (2000, 2)), "blue", coefficients=exact).alpha
    assert np.abs(level_determinant(blue, exact)).max() < noise_of(exact) < 1e-12
    assert noise_of(coefficients) == pytest.approx(noise_of(exact), rel=1e-3)
