"""Formula (1), its misprints, and the physics behind it.

The paper's formulas stand in tests/published_formulas.py as printed. Forces and torques decide both claims: that the
listed terms are misprinted, and that no other term is.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import mpmath
import numpy as np
import numpy.typing as npt
import pytest
import sympy
from scipy.spatial.transform import Rotation

from gaitgraph.errors import InputError, MissingConstant
from gaitgraph.invertibility.coefficients import (
    _HALF_UNITS,
    _PARTS,
    Coefficients,
    coefficients_of,
)
from gaitgraph.invertibility.forms import Form, Sines, rotors_of
from gaitgraph.invertibility.matrices import (
    attitude_of,
    body_vertical,
    control_force_matrix,
    control_moment_matrix,
    decoupling_matrix,
    determinant,
    hover_thrust_shares,
    least_singular_value,
    level_determinant,
    level_determinant_resolution,
    noise_of,
    pitch_sensitivity,
    roll_sensitivity,
    scaled_decoupling_matrix,
    zero_moment_direction,
)
from gaitgraph.invertibility.tilt_margins import (
    least_singular_value_within,
    nearest_singular_attitude,
    singular_everywhere,
    tilt_margin,
)
from gaitgraph.vehicle import PAPER, Vehicle
from tests.published_formulas import IN_KAPPA, PART, Term, corrected
from tests.samples import (
    BOTH,
    EXACT,
    HALF_PI,
    MIRRORED,
    PUBLISHED,
    TURNED,
    by_kind,
    by_vehicle,
    on_blue,
    on_red,
    random_tilts,
)

if TYPE_CHECKING:
    from collections.abc import Callable

FloatArray = npt.NDArray[np.float64]

KAPPAS = [1e-4, 0.0599, 0.168666, 1 / math.sqrt(2), 1.0, 2.0]
every_vehicle = by_vehicle(PAPER, TURNED, MIRRORED, BOTH)


def plain_matrices(s: Any, c: Any, k: Any) -> tuple[list[list[Any]], list[list[Any]]]:
    """Return F/Kf and τ/(L·Kf) from sines, cosines and κ of any kind, arms along x, y, −x, −y, entry by entry."""
    force = [[0, s[1], 0, -s[3]], [s[0], 0, -s[2], 0], [-c[0], c[1], -c[2], c[3]]]
    moment = [
        [0, c[1] - k * s[1], 0, -c[3] + k * s[3]],
        [c[0] + k * s[0], 0, -c[2] - k * s[2], 0],
        [s[0] - k * c[0], -s[1] - k * c[1], s[2] - k * c[2], -s[3] - k * c[3]],
    ]
    return force, moment


LETTERS = ["".join(letters) for letters in itertools.product("cs", repeat=4)]
CORNERS = np.array(
    [[HALF_PI if which == "s" else 0.0 for which in letters] for letters in LETTERS]
)
"""Where one monomial is 1 and the other fifteen are 0: a multilinear form is known once it is known here."""


def delta_of(vehicle: Vehicle) -> float:
    return math.atan(vehicle.signed_drag_ratio)


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
            term = (
                (-1 if number[0] == "-" else 1)
                * IN_KAPPA[number[1:]](self.kappa)
                * attitude_factors[attitude]
            )
            for i, which in enumerate(letters):
                term *= self.cosines[i] if which == "c" else self.sines[i]
            total += term
        return total

    def part(self, equation: str) -> Any:
        """Return the corrected equation, without its attitude factor."""
        nx, ny, nz = self.upward
        one = {"sθ": {nx: -1}, "sφcθ": {ny: 1}, "cφcθ": {nz: 1}}[PART[equation]]
        return self.symbolic(corrected(equation)).subs(one)

    def vanishes(self, expression: Any) -> bool:
        return bool(sympy.expand(expression) == 0)

    def test_the_corrected_formula_is_the_determinant_over_twice_kappa(self) -> None:
        force, moment = plain_matrices(self.sines, self.cosines, self.kappa)
        matrix = sympy.Matrix(
            [*moment, list(sympy.Matrix([self.upward]) * sympy.Matrix(force))]
        )
        assert self.vanishes(
            matrix.det(method="berkowitz")
            - 2 * self.kappa * self.symbolic(corrected("(1)"))
        )

    def test_its_three_parts_are_the_corrected_equations(self) -> None:
        nx, ny, nz = self.upward
        assert self.vanishes(
            self.symbolic(corrected("(1)"))
            - (ny * self.part("(4)") - nx * self.part("(5)") + nz * self.part("(6)"))
        )
        assert self.vanishes(self.part("(6)") - self.part("(2)"))

    def test_R_and_both_residuals_factorise(self) -> None:
        """On red R = 2/(κ cos²δ)·cos β1·cos β2·(2κ cos α1 cos α2 − sin(α1 − α2)), on blue 0."""
        k, (c1, c2, c3, c4), (s1, s2, s3, s4) = self.kappa, self.cosines, self.sines
        product = (c1 + k * s1) * (c2 - k * s2) * (2 * k * c1 * c2 - s1 * c2 + c1 * s2)
        red = self.part("(6)").subs({c3: c1, s3: s1, c4: c2, s4: s2})
        assert self.vanishes(k * red - 2 * product)
        # cos 2δ and sin 2δ times 1 + κ².
        C, S = 1 - k**2, 2 * k
        turned = {
            c3: C * c1 + S * s1,
            s3: S * c1 - C * s1,
            c4: C * c2 - S * s2,
            s4: -S * c2 - C * s2,
        }
        assert self.vanishes(
            sympy.expand(k * self.part("(6)").subs(turned, simultaneous=True))
        )
        # With sin 2δ·Rφ = −sin(β1 − β3)·sin(β2 + β4) and sin 2δ·Rθ = sin(β1 + β3)·sin(β2 − β4).
        even = (s2 * c4 + c2 * s4) * C + (c2 * c4 - s2 * s4) * S
        odd = (s1 * c3 + c1 * s3) * C - (c1 * c3 - s1 * s3) * S
        assert self.vanishes(S * self.part("(4)") + (s1 * c3 - c1 * s3) * even)
        assert self.vanishes(S * self.part("(5)") - odd * (s2 * c4 - c2 * s4))


@pytest.mark.parametrize("kappa", [None, *KAPPAS])
@pytest.mark.parametrize(
    ("function", "equation"),
    [(roll_sensitivity, "(4)"), (pitch_sensitivity, "(5)"), (level_determinant, "(6)")],
)
def test_term_by_term(
    function: Callable[..., Any], equation: str, kappa: float | None
) -> None:
    numbers = (
        PUBLISHED
        if kappa is None
        else coefficients_of(Vehicle(drag_ratio=kappa), "exact")
    )
    expected = np.zeros(16)
    for number, letters, _ in corrected(equation):
        value = float(number[1:]) if kappa is None else IN_KAPPA[number[1:]](kappa)
        expected[LETTERS.index(letters)] = value if number[0] == "+" else -value
    np.testing.assert_allclose(
        function(CORNERS, numbers), expected, atol=1e-14 / (kappa or 0.1)
    )


@every_vehicle
@pytest.mark.parametrize("kappa", KAPPAS)
def test_exact_coefficients_are_functions_of_kappa(
    vehicle: Vehicle, kappa: float
) -> None:
    numbers = coefficients_of(vehicle.replace(drag_ratio=kappa), "exact")
    signed = kappa if vehicle.first_rotor_spin == "clockwise" else -kappa
    assert math.tan(numbers.delta) == pytest.approx(signed, rel=1e-14)
    # The four numbers of the paper's formulas, with κ for the digits, give the table that is read off the rotors.
    values = [
        IN_KAPPA[printed](signed) for printed in ("2.880", "5.592", "0.9716", "0.1687")
    ]
    table = _PARTS[0] + np.einsum("i,iabcdq->abcdq", values, _PARTS[1:])
    expected = Coefficients("exact", rotors_of(vehicle.replace(drag_ratio=kappa)))
    turn = vehicle.first_arm_angle
    x, y, z = np.moveaxis(table, -1, 0)
    turned = [
        math.cos(turn) * x - math.sin(turn) * y,
        math.sin(turn) * x + math.cos(turn) * y,
        z,
    ]
    np.testing.assert_allclose(
        np.stack(turned, axis=-1),
        expected.form.table,
        rtol=1e-12,
        atol=1e-13 / kappa + 1e-13,
    )


class TestDeterminantAgainstTheMatrix:
    @every_vehicle
    def test_the_matrix_maps_inputs_to_what_euler_angles_do(
        self, vehicle: Vehicle
    ) -> None:
        # Rows: altitude, roll, pitch, yaw. Rebuilt with a rotation matrix and the rates of its angles.
        mass, inertia = vehicle.require("mass", "inertia", purpose="this test")
        attitudes = np.random.default_rng(9).uniform(-1.4, 1.4, (10, 3))
        for alpha, (yaw, pitch, roll) in zip(
            random_tilts(10, 10), attitudes, strict=True
        ):
            to_world = Rotation.from_euler("ZYX", [yaw, pitch, roll]).as_matrix()
            altitude, *angular = decoupling_matrix(alpha, vehicle, roll, pitch)
            force, moment = (
                control_force_matrix(alpha, vehicle),
                control_moment_matrix(alpha, vehicle),
            )
            np.testing.assert_allclose(
                altitude, (to_world @ force)[2] / mass, rtol=1e-9, atol=1e-18
            )
            # Body angular acceleration from rest: the axes of the three rotations, seen from the body.
            second = Rotation.from_euler("X", roll).as_matrix().T @ [0.0, 1.0, 0.0]
            axes = np.stack(
                [[1.0, 0.0, 0.0], second, to_world.T @ [0.0, 0.0, 1.0]], axis=-1
            )
            np.testing.assert_allclose(
                axes @ angular,
                moment / np.array(inertia)[:, None],
                rtol=1e-9,
                atol=1e-15,
            )

    @pytest.mark.parametrize("kappa", KAPPAS)
    def test_any_drag_ratio_to_fifty_digits(self, kappa: float) -> None:
        # Near the singular sheet all digits cancel: the stated resolution must cover what floats lose there.
        numbers = coefficients_of(Vehicle(drag_ratio=kappa), "exact")
        delta = math.atan(kappa)
        rng = np.random.default_rng(13)
        # Right angles: the pair features all but vanish there, and what is left of them is rounding.
        samples = [
            *random_tilts(14, 6),
            *CORNERS[[0, -1]],
            np.array([HALF_PI, -HALF_PI, 3.0, 3.0]),
        ]
        for first, second in rng.uniform(-1.5, 1.5, (6, 2)):
            samples += [
                np.array([first, second, 2 * delta - first, -2 * delta - second])
                + rng.normal(0, 1e-9, 4)
            ]
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
        angles, k = [mpmath.mpf(float(angle)) for angle in alpha], mpmath.mpf(kappa)
        force, moment = plain_matrices(
            [mpmath.sin(a) for a in angles], [mpmath.cos(a) for a in angles], k
        )
        return mpmath.det(mpmath.matrix([*moment, force[2]])) / (2 * k)


class TestForcesAndTorques:
    @every_vehicle
    def test_each_rotor_rebuilt_from_its_axis(self, vehicle: Vehicle) -> None:
        thrust, drag = vehicle.require(
            "thrust_coefficient", "drag_coefficient", purpose="this test"
        )
        (arm,) = vehicle.require("arm_length", purpose="this test")
        for alpha in random_tilts(15, 10):
            force, moment = (
                control_force_matrix(alpha, vehicle),
                control_moment_matrix(alpha, vehicle),
            )
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
                np.testing.assert_allclose(
                    moment[:, i], torque, atol=1e-14 * thrust * arm
                )

    @pytest.mark.parametrize(
        ("function", "what", "needed"),
        [
            (control_force_matrix, "the control force matrix", ["thrust_coefficient"]),
            (
                control_moment_matrix,
                "the control moment matrix",
                ["thrust_coefficient", "arm_length"],
            ),
            (
                decoupling_matrix,
                "the decoupling matrix",
                ["mass", "inertia", "arm_length", "thrust_coefficient"],
            ),
        ],
    )
    def test_a_constant_that_is_not_stated_is_named_with_what_needs_it(
        self, function: Callable[..., Any], what: str, needed: list[str]
    ) -> None:
        for missing in needed:
            stated = {
                name: getattr(PAPER, name)
                for name in ("drag_ratio", *needed)
                if name != missing
            }
            with pytest.raises(
                MissingConstant,
                match=rf" states no {missing} \(.*\), which {what} needs$",
            ):
                function([0, 0, 0, 0], Vehicle(**stated))

    def test_the_vertical_seen_from_the_body_and_back(self) -> None:
        roll, pitch = np.random.default_rng(11).uniform(-1.5, 1.5, (2, 50))
        up = (
            Rotation.from_euler("YX", np.stack([pitch, roll], axis=-1))
            .inv()
            .apply([0.0, 0.0, 1.0])
        )
        np.testing.assert_allclose(body_vertical(roll, pitch), up, atol=1e-15)
        np.testing.assert_allclose(
            attitude_of(up), np.stack([roll, pitch], axis=-1), atol=1e-12
        )


# Tilt axes of the rotors in front, left, back and right, whether z points up, and the signs that docs/guide/files.md states.
FRONT, LEFT, BACK, RIGHT = [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]


@pytest.mark.parametrize(
    ("axes", "z_up", "signs"),
    [
        ((FRONT, LEFT, BACK, RIGHT), True, (1, 1, 1, 1)),
        ((FRONT, RIGHT, BACK, LEFT), False, (1, 1, 1, 1)),
        ((BACK, RIGHT, FRONT, LEFT), True, (-1, -1, -1, -1)),
        ((FRONT, LEFT, FRONT, LEFT), True, (1, 1, -1, -1)),
        ((FRONT, LEFT, FRONT, LEFT), False, (1, -1, -1, 1)),
    ],
)
def test_signs_of_other_conventions(
    axes: tuple[list[int], ...], z_up: bool, signs: tuple[int, ...]
) -> None:
    yours = np.array([0.3, -0.5, 0.7, 0.2])
    to_z_up = np.diag([1, 1, 1] if z_up else [1, -1, -1])
    up = to_z_up @ [0, 0, 1]
    pushing_up = [-1, 1, -1, 1]
    force = control_force_matrix(yours * signs) * pushing_up
    for axis, angle, push in zip(axes, yours, force.T, strict=True):
        thrust = to_z_up @ Rotation.from_rotvec(angle * np.array(axis)).apply(up)
        np.testing.assert_allclose(push / np.linalg.norm(push), thrust, atol=1e-15)


@every_vehicle
def test_hover_thrusts_carry_the_weight_and_make_no_torque(vehicle: Vehicle) -> None:
    alpha = random_tilts(23, 50)
    sense = 1.0 if vehicle.first_rotor_spin == "clockwise" else -1.0
    shares = hover_thrust_shares(alpha, vehicle)
    # w < 0 makes a rotor lift that is meant to turn clockwise.
    inputs = shares * sense * np.array([-1.0, 1.0, -1.0, 1.0])
    carried = np.squeeze(
        scaled_decoupling_matrix(alpha, vehicle) @ inputs[..., None], axis=-1
    )
    size = 1e-12 * np.abs(shares).max(axis=1, keepdims=True)
    assert (np.abs(carried - [0.0, 0.0, 0.0, 1.0]) <= size).all()


class TestLeastSingularValue:
    @pytest.mark.parametrize("kappa", [1e-4, 0.168666, 1.0])
    def test_it_is_lipschitz_in_the_tilts(self, kappa: float) -> None:
        vehicle, alpha, (roll, pitch) = (
            Vehicle(drag_ratio=kappa),
            random_tilts(32, 300),
            np.zeros((2, 300)),
        )
        roll[:150], pitch[150:] = 0.7, -1.1
        step = random_tilts(33, 300) * np.random.default_rng(33).uniform(
            1e-6, 0.3, (300, 1)
        )
        change = least_singular_value(alpha + step, vehicle, roll, pitch)
        change -= least_singular_value(alpha, vehicle, roll, pitch)
        assert (
            np.abs(change)
            <= math.sqrt(2 + kappa**2) * np.linalg.norm(step, axis=1) + 1e-12
        ).all()

    @every_vehicle
    def test_on_blue_it_vanishes_at_every_attitude(self, vehicle: Vehicle) -> None:
        first, second, roll, pitch = np.random.default_rng(25).uniform(
            -1.5, 1.5, (4, 100)
        )
        blue = on_blue(first, second, delta_of(vehicle))
        assert least_singular_value(blue, vehicle, roll, pitch).max() < 1e-14


class TestResolution:
    DERIVED = np.array([0.0, 0.0, 1.0, 1.0]) * 2 * PUBLISHED.crossing_error
    """What α3 and α4 may be off by because 2δ is computed from a rounded number."""

    @by_kind
    def test_on_the_papers_grid_red_is_decided_and_blue_is_not(
        self, numbers: Any
    ) -> None:
        axis = np.arange(-7, 8) * math.pi / 16
        first, second = (side.ravel() for side in np.meshgrid(axis, axis))
        red, blue = on_red(first, second), on_blue(first, second, numbers.delta)
        wrapped = np.copy(blue)
        wrapped[:, 2:] -= math.pi * np.rint(blue[:, 2:] / math.pi)
        for alpha in (blue, wrapped):
            assert (
                np.abs(level_determinant(alpha, numbers))
                <= level_determinant_resolution(alpha, numbers)
            ).all()
        assert (
            np.abs(level_determinant(red, numbers))
            > level_determinant_resolution(red, numbers)
        ).all()
        # A bound so wide that nothing is decided would pass the first half too.
        limit = 5e-3 if numbers.kind == "published" else 1e-12
        assert (
            level_determinant_resolution(np.concatenate([red, blue]), numbers).max()
            < limit
        )

    def test_printed_digits_count_as_they_stand(self) -> None:
        """They are the published numbers, but R on blue, 0 in the physics, then has a sign."""
        published, printed = (coefficients_of(kind=k) for k in ("published", "printed"))
        assert replace(printed, kind="published") == published
        assert published.as_they_stand == printed == printed.as_they_stand
        assert EXACT.as_they_stand == EXACT
        axis = np.arange(-7, 8) * math.pi / 16
        a1, a2 = (angle.ravel() for angle in np.meshgrid(axis, axis))
        blue = on_blue(a1, a2, printed.delta)
        R = level_determinant(blue, printed)
        assert np.array_equal(R, level_determinant(blue, published))
        assert (np.abs(R) > level_determinant_resolution(blue, printed)).all()
        assert not (np.abs(R) > level_determinant_resolution(blue, published)).any()

    @pytest.mark.parametrize("rounding", [0.0, 5e-4, 5e-2])
    def test_it_covers_the_worst_that_rounding_can_do(self, rounding: float) -> None:
        # All numbers and all angles off by as much as they may be, in every combination of directions.
        alpha, directions = (
            random_tilts(31, 60),
            np.array(list(itertools.product((-1.0, 1.0), repeat=4))),
        )
        moved = alpha[:, None] + directions * (rounding + self.DERIVED)
        worst = np.zeros(60)
        for signs in itertools.product((-1.0, 1.0), repeat=3):
            meant = PUBLISHED.form.table.copy()
            for sign, off, part in zip(signs, _HALF_UNITS[1:], _PARTS[2:], strict=True):
                meant += sign * off * part
            sines = Sines.of(moved.reshape(-1, 4))
            values = Form(meant).at(sines)[2].reshape(moved.shape[:2])
            change = np.abs(values - level_determinant(alpha, PUBLISHED)[:, None])
            worst = np.maximum(worst, change.max(axis=1))
        resolution = level_determinant_resolution(alpha, PUBLISHED, rounding)
        assert (worst <= resolution).all()
        # And it is not far beyond it.
        assert (resolution <= 10 * worst).all()

    def test_where_all_slopes_vanish_the_second_order_is_covered(self) -> None:
        # With κ = 1 and no drag but in R = 4 at α = 0, exact numbers: the slopes of R there are ±single = ±(1/κ − 2κ).
        numbers = coefficients_of(Vehicle(drag_ratio=math.sqrt(0.5)), "exact")
        corners = np.array(list(itertools.product((-1.0, 1.0), repeat=4)))
        slopes = numbers.form.slopes(Sines.of(np.zeros((1, 4))))[:, 2]
        assert np.abs(slopes).max() < 1e-12
        for rounding in (1e-4, 1e-3):
            values = level_determinant(corners * rounding, numbers)
            worst = float(np.abs(values - 4.0).max())
            resolution = level_determinant_resolution(np.zeros(4), numbers, rounding)
            assert rounding**2 < worst <= float(resolution)

    def test_what_the_rounding_of_the_first_number_moves(self) -> None:
        # 2.880 stands for anything from 2.8795 to 2.8805.
        moved = max(
            abs(math.atan2(1.0, number) - 2 * PUBLISHED.delta)
            for number in (2.8795, 2.8805)
        )
        assert 2 * PUBLISHED.crossing_error == pytest.approx(moved, rel=1e-3)
        assert PUBLISHED.sheet_error == pytest.approx(moved, rel=1e-3)
        assert EXACT.sheet_error == 0.0
        assert abs(EXACT.delta - PUBLISHED.delta) < PUBLISHED.crossing_error

    def test_noise_is_above_what_floating_point_makes_of_zero(self) -> None:
        first, second = np.random.default_rng(2).uniform(-1.5, 1.5, (2, 2000))
        blue = on_blue(first, second, EXACT.delta)
        assert np.abs(level_determinant(blue, EXACT)).max() < noise_of(EXACT) < 1e-12
        assert noise_of(PUBLISHED) == pytest.approx(noise_of(EXACT), rel=1e-2)


FUNCTIONS: dict[str, Callable[..., Any]] = {
    "roll_sensitivity": lambda alpha: roll_sensitivity(alpha, PUBLISHED),
    "level_determinant_resolution": lambda alpha: level_determinant_resolution(
        alpha, PUBLISHED, 1e-3
    ),
    "determinant": lambda alpha: determinant(alpha, PUBLISHED, 0.3, -0.2),
    "control_moment_matrix": lambda alpha: (
        control_moment_matrix(alpha) / (8.048e-6 * 0.1785)
    ),
    "decoupling_matrix": lambda alpha: decoupling_matrix(alpha, PAPER, 0.3, -0.2),
    "zero_moment_direction": zero_moment_direction,
    "hover_thrust_shares": hover_thrust_shares,
    "least_singular_value": lambda alpha: least_singular_value(alpha, PAPER, 0.3, -0.2),
    "margin": lambda alpha: tilt_margin(alpha, EXACT),
    "nearest": lambda alpha: nearest_singular_attitude(alpha, EXACT),
    "everywhere": lambda alpha: 1.0 * singular_everywhere(alpha, EXACT),
    "value": lambda alpha: least_singular_value_within(alpha, 0.4)[0],
    "attitude": lambda alpha: least_singular_value_within(alpha, 0.4)[1],
}


@pytest.mark.parametrize("function", FUNCTIONS.values(), ids=FUNCTIONS.keys())
def test_leading_axes_broadcast_and_every_row_is_as_if_alone(
    function: Callable[..., Any],
) -> None:
    tail = np.asarray(function([0, 0, 0, 0])).shape
    for shape in ((), (0,), (2, 1, 3)):
        alpha = random_tilts(26, *shape, reach=1.6)
        together = np.asarray(function(alpha))
        assert together.shape == shape + tail
        assert together.dtype == float
        for index in np.ndindex(*shape):
            np.testing.assert_allclose(
                together[index], function(alpha[index].tolist()), rtol=1e-12, atol=1e-12
            )
    for wrong in ((), (3,), (4, 1)):
        with pytest.raises(
            InputError, match=r"^alpha must be an array of shape \(.*4\), got shape "
        ):
            function(np.zeros(wrong))
