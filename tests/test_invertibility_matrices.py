"""Matrices and forms of level flight, against rotations of scipy, determinants, and formula (1) as the paper prints it.

The paper's formulas stand in tests/published_formulas.py as printed. Forces and torques decide both claims: that the
listed terms are misprinted, and that no other term is.
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import product
from typing import TYPE_CHECKING, Any

import mpmath
import numpy as np
import numpy.typing as npt
import pytest
from scipy.spatial.transform import Rotation

from gaitgraph.errors import InputError, MissingConstant
from gaitgraph.invertibility import matrices, tilt_margins
from gaitgraph.invertibility.coefficients import (
    _HALF_UNITS,
    _PARTS,
    Coefficients,
    coefficients_of,
)
from gaitgraph.invertibility.forms import Bends, Form, Sines, level_of, rotors_of
from gaitgraph.invertibility.geometry import Geometry
from gaitgraph.invertibility.matrices import (
    control_force_matrix,
    control_moment_matrix,
    decoupling_matrix,
    least_singular_value,
    level_determinant,
    level_determinant_resolution,
)
from gaitgraph.vehicle import PAPER, Vehicle
from tests.published_formulas import IN_KAPPA, corrected
from tests.samples import (
    BOTH,
    EVERY_KIND,
    EXACT,
    HALF_PI,
    PUBLISHED,
    RAISED,
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
UP = np.array([0.0, 0.0, 1.0])
SIGNS = np.array(list(product((-1.0, 1.0), repeat=4)))
CORNERS = np.array(list(product((0.0, HALF_PI), repeat=4)))
"""Where one monomial is 1 and the other fifteen are 0: a multilinear form is known once it is known here."""
every_vehicle = by_vehicle(*EVERY_KIND)


def wrench(
    places: Any, drags: Any, tilt_axes: Any, thrust_axes: Any, alpha: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return force and moment of a unit thrust of each of N rotors, shape (k, 3, N), by rotations of scipy."""
    turns = alpha[..., None] * tilt_axes
    thrusts = thrust_axes + 0 * turns  # scipy writes to what it is given
    turned = Rotation.from_rotvec(turns.reshape(-1, 3)).apply(thrusts.reshape(-1, 3))
    force = turned.reshape(turns.shape)
    moment = np.cross(places, force) - np.asarray(drags)[:, None] * force
    return np.swapaxes(force, -1, -2), np.swapaxes(moment, -1, -2)


def wrench_of(vehicle: Vehicle, alpha: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return that of a vehicle, in arm lengths."""
    drags = np.array(vehicle.scaled_drags) * vehicle.spin_signs
    return wrench(vehicle.scaled_positions, drags, *vehicle.axes, alpha)


def level_matrix(vehicle: Vehicle, alpha: FloatArray) -> FloatArray:
    force, moment = wrench_of(vehicle, alpha)
    return np.concatenate([moment, force[:, 2:]], axis=1)


# -- Matrices


@every_vehicle
def test_matrices_are_those_of_turned_thrusts(vehicle: Vehicle) -> None:
    """Positive w turns a rotor counterclockwise; the propeller of one that is meant to turn clockwise lifts for w < 0."""
    alpha = random_tilts(15, 20)
    force, moment = wrench_of(vehicle, alpha)
    signs = np.array(vehicle.spin_signs)
    roll, pitch = np.random.default_rng(11).uniform(-1.4, 1.4, (2, 20))
    seen = Rotation.from_euler("YX", np.stack([pitch, roll], axis=-1)).inv().apply(UP)
    lift = np.einsum("kf,kfi->ki", seen, force)[:, None]
    scaled = matrices.scaled_decoupling_matrix(alpha, vehicle, roll, pitch)
    expected = np.concatenate([moment, lift], axis=1) * signs
    np.testing.assert_allclose(scaled, expected, atol=1e-13)
    np.testing.assert_allclose(matrices.body_vertical(roll, pitch), seen, atol=1e-15)
    attitude = np.stack([roll, pitch], axis=-1)
    np.testing.assert_allclose(matrices.attitude_of(seen), attitude, atol=1e-12)

    level = level_matrix(vehicle, alpha)
    geometry = Geometry.of_vehicle(vehicle)
    arm = vehicle.arm_length or 1.0
    np.testing.assert_allclose(geometry.force_matrix(alpha), force, atol=1e-13)
    np.testing.assert_allclose(geometry.moment_matrix(alpha), arm * moment, atol=1e-13)
    np.testing.assert_allclose(geometry.level_matrix(alpha), level, atol=1e-13)
    values = np.linalg.svd(level, compute_uv=False)[:, 3]
    for found in (
        geometry.least_singular_value(alpha),
        least_singular_value(alpha, vehicle),
    ):
        np.testing.assert_allclose(found, values, atol=1e-13)
    assert values.max() <= matrices.largest_least_singular_value(vehicle)


@by_vehicle(PAPER, RAISED)
def test_the_decoupling_matrix_maps_inputs_to_what_euler_angles_do(
    vehicle: Vehicle,
) -> None:
    mass, inertia = vehicle.require("mass", "inertia", purpose="this test")
    attitudes = np.random.default_rng(9).uniform(-1.4, 1.4, (10, 3))
    for alpha, (yaw, pitch, roll) in zip(random_tilts(10, 10), attitudes, strict=True):
        to_world = Rotation.from_euler("ZYX", [yaw, pitch, roll]).as_matrix()
        altitude, *angular = decoupling_matrix(alpha, vehicle, roll, pitch)
        force = control_force_matrix(alpha, vehicle)
        moment = control_moment_matrix(alpha, vehicle)
        lift = (to_world @ force)[2] / mass
        np.testing.assert_allclose(altitude, lift, rtol=1e-9, atol=1e-18)
        # Body angular acceleration from rest: the axes of the three rotations, seen from the body.
        second = Rotation.from_euler("X", roll).as_matrix().T @ [0.0, 1.0, 0.0]
        axes = np.stack([[1.0, 0.0, 0.0], second, to_world.T @ UP], axis=-1)
        spin = moment / np.array(inertia)[:, None]
        np.testing.assert_allclose(axes @ angular, spin, rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize(
    ("function", "needed"),
    [
        (control_force_matrix, "thrust_coefficient"),
        (control_moment_matrix, "thrust_coefficient arm_length"),
        (decoupling_matrix, "mass inertia arm_length thrust_coefficient"),
    ],
)
def test_a_constant_that_is_not_stated_is_named(
    function: Callable[..., Any], needed: str
) -> None:
    for missing in needed.split():
        stated = {name: getattr(PAPER, name) for name in needed.split()}
        vehicle = Vehicle(drag_ratio=0.1, **{**stated, missing: None})
        with pytest.raises(MissingConstant, match=f" states no {missing} "):
            function([0, 0, 0, 0], vehicle)


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
def test_signs_of_other_conventions(axes: Any, z_up: bool, signs: Any) -> None:
    yours = np.array([0.3, -0.5, 0.7, 0.2])
    to_z_up = np.diag([1, 1, 1] if z_up else [1, -1, -1])
    pushes = matrices.rotor_directions(yours * signs, PAPER)[0] * [-1, 1, -1, 1]
    turns = Rotation.from_rotvec(yours[:, None] * np.array(axes))
    thrusts = to_z_up @ turns.apply(to_z_up @ UP).T
    np.testing.assert_allclose(pushes, thrusts, atol=1e-15)


# -- Forms


@every_vehicle
def test_zero_moment_inputs_make_the_force_v_and_R_is_the_determinant(
    vehicle: Vehicle,
) -> None:
    alpha, exact = random_tilts(23, 50), coefficients_of(vehicle, "exact")
    force, moment = matrices.rotor_directions(alpha, vehicle)
    inputs = matrices.zero_moment_inputs(alpha, vehicle)[..., None]
    v = matrices.attitude_sensitivities(alpha, exact)
    np.testing.assert_allclose(moment @ inputs, 0, atol=1e-11)
    np.testing.assert_allclose((force @ inputs)[..., 0], v, atol=1e-11)
    assert np.array_equal(v, matrices.zero_moment_direction(alpha, vehicle))
    assert np.array_equal(matrices.roll_sensitivity(alpha, exact), v[:, 1])
    assert np.array_equal(matrices.pitch_sensitivity(alpha, exact), -v[:, 0])
    np.testing.assert_allclose(level_determinant(alpha, exact), v[:, 2], atol=1e-12)

    roll, pitch = np.random.default_rng(5).uniform(-1.4, 1.4, (2, 50))
    scaled = matrices.scaled_decoupling_matrix(alpha, vehicle, roll, pitch)
    at_attitude = matrices.determinant(alpha, exact, roll, pitch)
    of_matrix = np.linalg.det(scaled) / (2 * exact.rotors.drag_ratio)
    # For axes and spins of its own the sign is that with which R > 0 at α = 0.
    upright = np.linalg.det(matrices.scaled_decoupling_matrix(np.zeros(4), vehicle))
    side = np.sign(upright / exact.rotors.drag_ratio)
    np.testing.assert_allclose(at_attitude, side * of_matrix, atol=1e-11)

    shares = matrices.hover_thrust_shares(alpha, vehicle)
    carried = np.squeeze(level_matrix(vehicle, alpha) @ shares[..., None], axis=-1)
    size = 1e-11 * np.abs(shares).max(axis=1, keepdims=True)
    assert (np.abs(carried - [0.0, 0.0, 0.0, 1.0]) <= size).all()


@every_vehicle
def test_slopes_are_derivatives_and_bends_bound_second_ones(vehicle: Vehicle) -> None:
    level, alpha, small = level_of(rotors_of(vehicle)), random_tilts(4, 100), 1e-6
    forms = [level.direction, *level.inputs]
    for form in forms:
        slopes = form.slopes(Sines.of(alpha))
        for joint, step in enumerate(small * np.eye(4)):
            change = form.at(Sines.of(alpha + step)) - form.at(Sines.of(alpha - step))
            np.testing.assert_allclose(slopes[joint], change / 2e-6, atol=1e-7)
            assert (np.abs(slopes[joint]) <= form.size[:, None] + 1e-9).all()
    random, s = np.random.default_rng(5), np.linspace(0, 1, 201)
    for _ in range(30):
        start, step = random.uniform(-2, 2, (2, 4))
        sines = Sines.of(start + s[:, None] * step)
        values = np.concatenate([form.at(sines) for form in forms])
        second = np.abs(np.diff(values, 2)).max(axis=1) * 200**2
        bound = Bends(*forms).along(step[None])[:, 0]
        assert (second <= bound * (1 + 1e-6) + 1e-6).all()
        assert (bound <= 100 * second + 100).all()  # of the same order


def test_the_bound_is_reached_by_a_single_sinusoid() -> None:
    """cos α1·cos α2 is half of cos(α1 + α2) and half of cos(α1 − α2): with one angle still it is reached at its peak."""
    table = np.zeros((2, 2, 1, 1, 1))
    table[0, 0] = 3.0
    bends = Bends(Form(table)).along(np.array([[0.5, 0.0, 9.0, 9.0]]))
    assert np.allclose(bends, 3.0 * 0.25)


@every_vehicle
def test_no_singular_value_changes_faster_than_the_longest_column(
    vehicle: Vehicle,
) -> None:
    alpha, step = random_tilts(6, 300), 0.3 * random_tilts(7, 300)
    roll, pitch = np.random.default_rng(5).uniform(-1.4, 1.4, (2, 300))
    for is_level, attitude in ((True, (0.0, 0.0)), (False, (roll, pitch))):
        rate = matrices.singular_value_rate(vehicle, level=is_level)
        scaled = matrices.scaled_decoupling_matrix(alpha, vehicle, *attitude)
        moved = matrices.scaled_decoupling_matrix(alpha + step, vehicle, *attitude)
        before, after = (np.linalg.svd(m, compute_uv=False) for m in (scaled, moved))
        change = np.abs(after - before).max(axis=1)
        assert (change <= rate * np.linalg.norm(step, axis=1) + 1e-12).all()
        longest = np.linalg.norm(scaled, axis=1).max()
        assert 0.9 * rate < longest <= rate + 1e-12


@by_vehicle(*EVERY_KIND[:5])
def test_on_red_roll_and_pitch_change_nothing_to_first_order(vehicle: Vehicle) -> None:
    red = on_red(*np.random.default_rng(1).uniform(-math.pi, math.pi, (2, 200)))
    v = matrices.attitude_sensitivities(red, coefficients_of(vehicle, "exact"))
    assert (v[:, :2] == 0).all()


@pytest.mark.parametrize("height", [0.0, 0.3, -2.0])
@pytest.mark.parametrize("kappa", KAPPAS)
def test_closed_forms_of_the_theory(kappa: float, height: float) -> None:
    """docs/theory.md, 6 and 7: zero-moment thrusts and their force of equal arms at a height, and R on red."""
    vehicle = Vehicle(drag_ratio=kappa, arm_length=1.0, rotor_height=height)
    delta, alpha = math.atan(kappa), random_tilts(8, 200)
    beta = alpha - delta * np.array([1, -1, 1, -1])
    (a1, a2, a3, a4), (b1, b2, b3, b4) = alpha.T, beta.T
    s1, s2, s3, s4 = np.sin(alpha).T
    x, y, u, v = np.sin(b1 + b3), np.sin(b2 + b4), np.sin(a1 - a3), np.sin(a2 - a4)
    first = 2 * s1 * s3 - kappa * np.sin(a1 + a3)
    second = 2 * s2 * s4 + kappa * np.sin(a2 + a4)
    lean, rise = (height**n * math.cos(delta) ** (n + 1) for n in (1, 2))
    thrusts = [
        -y * np.cos(b3) + lean * np.sin(b3) * v - rise * s3 * second,
        x * np.cos(b4) + lean * np.sin(b4) * u + rise * s4 * first,
        -y * np.cos(b1) - lean * np.sin(b1) * v - rise * s1 * second,
        x * np.cos(b2) - lean * np.sin(b2) * u + rise * s2 * first,
    ]
    scale = -1 / (2 * kappa * math.cos(delta) ** 3)
    found = matrices.zero_moment_inputs(alpha, vehicle) * [-1, 1, -1, 1]
    np.testing.assert_allclose(found, scale * np.transpose(thrusts), atol=1e-11 / kappa)
    across = [
        math.cos(delta) * (x * v + lean * u * second),
        math.cos(delta) * (y * u - lean * v * first),
    ]
    exact = coefficients_of(vehicle)
    force = matrices.attitude_sensitivities(alpha, exact)[:, :2]
    np.testing.assert_allclose(force, scale * np.transpose(across), atol=1e-11 / kappa)

    c1, c2 = np.cos(a1), np.cos(a2)
    blocks = (c1 + kappa * s1) * (c2 - kappa * s2) + height**2 * s1 * s2
    difference = 2 * kappa * c1 * c2 - np.sin(a1 - a2)
    R = level_determinant(on_red(a1, a2), exact)
    expected = 2 * blocks * difference / kappa
    np.testing.assert_allclose(R, expected, atol=1e-11 / kappa)


# -- Formula (1)


@pytest.mark.parametrize("kappa", [None, *KAPPAS])
@pytest.mark.parametrize(
    ("function", "equation"),
    [
        (matrices.roll_sensitivity, "(4)"),
        (matrices.pitch_sensitivity, "(5)"),
        (level_determinant, "(6)"),
    ],
)
def test_formula_1_term_by_term(
    function: Callable[..., Any], equation: str, kappa: float | None
) -> None:
    numbers = PUBLISHED
    if kappa is not None:
        numbers = coefficients_of(Vehicle(drag_ratio=kappa), "exact")
    expected = dict.fromkeys(product("cs", repeat=4), 0.0)
    for number, letters, _ in corrected(equation):
        size = float(number[1:]) if kappa is None else IN_KAPPA[number[1:]](kappa)
        expected[tuple(letters)] = size if number[0] == "+" else -size
    found = function(CORNERS, numbers)
    np.testing.assert_allclose(found, [*expected.values()], atol=1e-14 / (kappa or 0.1))


def test_formula_1_is_its_three_parts_and_equation_2_is_6() -> None:
    parts = [term for equation in ("(4)", "(5)", "(6)") for term in corrected(equation)]
    assert sorted(corrected("(1)")) == sorted(parts)
    assert sorted(corrected("(2)")) == sorted(corrected("(6)"))


@by_vehicle(PAPER, BOTH)
@pytest.mark.parametrize("kappa", KAPPAS)
def test_exact_coefficients_are_functions_of_kappa(
    vehicle: Vehicle, kappa: float
) -> None:
    vehicle = vehicle.replace(drag_ratio=kappa)
    numbers = coefficients_of(vehicle, "exact")
    signed = kappa if vehicle.first_rotor_spin == "clockwise" else -kappa
    assert math.tan(numbers.delta) == pytest.approx(signed, rel=1e-14)
    printed = ("2.880", "5.592", "0.9716", "0.1687")
    values = [IN_KAPPA[number](signed) for number in printed]
    table = _PARTS[0] + np.einsum("i,iabcdq->abcdq", values, _PARTS[1:])
    turn = Rotation.from_rotvec(vehicle.first_arm_angle * UP).as_matrix()
    found = Coefficients("exact", rotors_of(vehicle)).form.table
    np.testing.assert_allclose(found, table @ turn.T, rtol=1e-12, atol=1e-13 / kappa)


@pytest.mark.parametrize("kappa", KAPPAS)
def test_R_has_its_sign_to_fifty_digits_where_it_is_above_its_resolution(
    kappa: float,
) -> None:
    """Near blue all digits cancel, and at right angles the features: the resolution must cover what floats lose there."""
    vehicle, delta = Vehicle(drag_ratio=kappa), math.atan(kappa)
    numbers = coefficients_of(vehicle, "exact")
    rng = np.random.default_rng(13)
    first, second = rng.uniform(-1.5, 1.5, (2, 6))
    near = on_blue(first, second, delta) + rng.normal(0, 1e-9, (6, 4))
    right = np.array([[HALF_PI, -HALF_PI, 3.0, 3.0]])
    samples = [
        random_tilts(14, 6),
        CORNERS[[0, -1]],
        right,
        near,
        on_red(first, second),
    ]
    for alpha in np.concatenate(samples):
        with mpmath.workdps(50):
            s = [mpmath.sin(mpmath.mpf(angle)) for angle in alpha.tolist()]
            c = [mpmath.cos(mpmath.mpf(angle)) for angle in alpha.tolist()]
            k = mpmath.mpf(kappa)
            roll = [0, c[1] - k * s[1], 0, -c[3] + k * s[3]]
            pitch = [c[0] + k * s[0], 0, -c[2] - k * s[2], 0]
            yaw = [a + b * k * d for a, b, d in zip(s, (-1, 1, -1, 1), c, strict=True)]
            signs = (1, -1, 1, -1)
            yaw = [sign * entry for sign, entry in zip(signs, yaw, strict=True)]
            lift = [-c[0], c[1], -c[2], c[3]]
            rows = mpmath.matrix([roll, pitch, yaw, lift])
            exact = float(mpmath.det(rows) / (2 * k))
        resolution = float(level_determinant_resolution(alpha, numbers))
        assert abs(float(level_determinant(alpha, numbers)) - exact) <= resolution
        assert resolution <= 1e-12 / kappa


# -- What rounding hides


@by_kind
def test_on_the_papers_grid_red_is_decided_and_blue_is_not(numbers: Any) -> None:
    axis = np.arange(-7, 8) * math.pi / 16
    first, second = (side.ravel() for side in np.meshgrid(axis, axis))
    red, blue = on_red(first, second), on_blue(first, second, numbers.delta)
    wrapped = blue - math.pi * np.rint(blue / math.pi) * [0, 0, 1, 1]
    for alpha, decided in ((red, True), (blue, False), (wrapped, False)):
        size = np.abs(level_determinant(alpha, numbers))
        resolution = level_determinant_resolution(alpha, numbers)
        assert ((size > resolution) == decided).all()
        # A bound so wide that nothing is decided would pass on blue too.
        assert resolution.max() < (5e-3 if numbers.kind == "published" else 1e-12)
    printed = replace(numbers, kind="printed") if numbers is PUBLISHED else numbers
    assert numbers.as_they_stand == printed == printed.as_they_stand
    R = np.abs(level_determinant(blue, printed))
    is_above = R > level_determinant_resolution(blue, printed)
    assert (is_above == (numbers is PUBLISHED)).all()


@pytest.mark.parametrize("rounding", [0.0, 5e-4, 5e-2])
def test_the_resolution_covers_the_worst_that_rounding_can_do(rounding: float) -> None:
    """All numbers and all angles off by as much as they may be, in every combination of directions."""
    alpha = random_tilts(31, 60)
    derived = np.array([0.0, 0.0, 1.0, 1.0]) * PUBLISHED.sheet_error
    moved = (alpha[:, None] + SIGNS * (rounding + derived)).reshape(-1, 4)
    stated = level_determinant(alpha, PUBLISHED)[:, None]
    worst = np.zeros(60)
    for signs in product((-1.0, 1.0), repeat=3):
        meant = PUBLISHED.form.table.copy()
        for sign, off, part in zip(signs, _HALF_UNITS[1:], _PARTS[2:], strict=True):
            meant += sign * off * part
        values = Form(meant).at(Sines.of(moved))[2].reshape(60, 16)
        worst = np.maximum(worst, np.abs(values - stated).max(axis=1))
    resolution = level_determinant_resolution(alpha, PUBLISHED, rounding)
    assert (worst <= resolution).all()
    assert (resolution <= 10 * worst).all()


@pytest.mark.parametrize("rounding", [1e-4, 1e-3])
def test_where_all_slopes_vanish_the_second_order_is_covered(rounding: float) -> None:
    """At α = 0 the slopes of R are ±(1/κ − 2κ), and R is 4."""
    numbers = coefficients_of(Vehicle(drag_ratio=math.sqrt(0.5)), "exact")
    values = level_determinant(SIGNS * rounding, numbers)
    worst = float(np.abs(values - 4.0).max())
    resolution = level_determinant_resolution(np.zeros(4), numbers, rounding)
    assert rounding**2 < worst <= float(resolution)


def test_rounding_of_the_first_number_moves_the_sheets() -> None:
    """2.880 stands for anything from 2.8795 to 2.8805."""
    turns = [abs(math.atan2(1, a) - 2 * PUBLISHED.delta) for a in (2.8795, 2.8805)]
    assert PUBLISHED.sheet_error == pytest.approx(max(turns), rel=1e-3)
    assert 2 * PUBLISHED.crossing_error == pytest.approx(max(turns), rel=1e-3)
    assert EXACT.sheet_error == 0.0
    assert abs(EXACT.delta - PUBLISHED.delta) < PUBLISHED.crossing_error


def test_noise_is_above_what_floating_point_makes_of_zero() -> None:
    first, second = np.random.default_rng(2).uniform(-1.5, 1.5, (2, 2000))
    blue = on_blue(first, second, EXACT.delta)
    largest = np.abs(EXACT.form.at(Sines.of(blue))[2]).max()
    assert 0 < largest < matrices.noise_of(EXACT) < 1e-12
    assert (level_determinant(blue, EXACT) == 0).all()
    assert least_singular_value(blue, PAPER, 0.3, -0.2).max() < 1e-14


# -- Shapes


FUNCTIONS: dict[str, Callable[..., Any]] = {
    "sensitivities": lambda alpha: matrices.attitude_sensitivities(alpha, PUBLISHED),
    "R": lambda alpha: level_determinant(alpha, PUBLISHED),
    "resolution": lambda alpha: level_determinant_resolution(alpha, PUBLISHED, 1e-3),
    "determinant": lambda alpha: matrices.determinant(alpha, PUBLISHED, 0.3, -0.2),
    "moments": lambda alpha: control_moment_matrix(alpha) / (8.048e-6 * 0.1785),
    "decoupling": lambda alpha: decoupling_matrix(alpha, PAPER, 0.3, -0.2),
    "hover thrusts": matrices.hover_thrust_shares,
    "singular value": lambda alpha: least_singular_value(alpha, PAPER, 0.3, -0.2),
    "margin": lambda alpha: tilt_margins.tilt_margin(alpha, EXACT),
    "nearest": lambda alpha: tilt_margins.nearest_singular_attitude(alpha, EXACT),
    "everywhere": lambda alpha: 1.0 * tilt_margins.singular_everywhere(alpha, EXACT),
    "within": lambda alpha: tilt_margins.least_singular_value_within(alpha, 0.4)[0],
    "worst": lambda alpha: tilt_margins.least_singular_value_within(alpha, 0.4)[1],
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
            alone = function(alpha[index].tolist())
            np.testing.assert_allclose(together[index], alone, rtol=1e-12, atol=1e-12)
    wrong: list[Any] = [np.zeros(()), np.zeros(3), np.zeros((4, 1))]
    wrong += [[[bad, 0, 0, 0], [0.3, 0, 0, 0]] for bad in (math.nan, math.inf, 1e300)]
    for alpha in wrong:
        with pytest.raises(InputError, match="^alpha must be"):
            function(alpha)
