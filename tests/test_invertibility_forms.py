"""Forms of level flight: against the matrices they come from, and their bounds against dense sampling."""

from __future__ import annotations

import numpy as np
import pytest

from gaitgraph.invertibility.forms import Bends, Form, Level, Sines, level_of, rotors_of
from gaitgraph.vehicle import PAPER, Vehicle

PLACES = [[0.3, 0.2, 0.05], [-0.25, 0.25, 0.0], [-0.3, -0.2, 0.05], [0.25, -0.25, 0.0]]
LEANING = [[0.3, 0.2, 0.1], [-0.25, 0.2, -0.05], [-0.3, -0.15, 0.0], [0.2, -0.3, 0.02]]
VEHICLES = [
    PAPER,
    PAPER.replace(rotor_height=-0.04, first_rotor_spin="counterclockwise"),
    Vehicle(drag_ratio=1.3, first_arm_angle=0.4),
    Vehicle(drag_to_thrust=[0.01, 0.03, 0.01, 0.03], rotor_positions=PLACES),
    Vehicle(drag_to_thrust=[0.01, 0.03, 0.02, 0.05], rotor_positions=LEANING),
]


@pytest.fixture(params=VEHICLES, ids=["paper", "below", "heavy drag", "H", "odd"])
def level(request: pytest.FixtureRequest) -> Level:
    return level_of(rotors_of(request.param))


def angles(seed: int, count: int = 200) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-3, 3, (count, 4))


def forms(level: Level) -> list[Form]:
    return [level.direction, *level.inputs]


def test_force_and_moment_are_those_of_a_thrust_at_its_place(level: Level) -> None:
    alpha = angles(1)
    force, moment = level.forces_and_moments(Sines.of(alpha))
    for rotor, (place, drag) in enumerate(
        zip(level.rotors.positions, level.rotors.drags, strict=True)
    ):
        x, y, _ = place
        ahead, aside = np.array([x, y]) / np.hypot(x, y)
        sine, cosine = np.sin(alpha[:, rotor]), np.cos(alpha[:, rotor])
        thrust = np.column_stack([aside * sine, -ahead * sine, cosine])
        sign = level.rotors.thrust_signs[rotor]
        np.testing.assert_allclose(force[:, :, rotor], sign * thrust, atol=1e-14)
        torque = sign * np.cross(place, thrust) - drag * thrust
        np.testing.assert_allclose(moment[:, :, rotor], torque, atol=1e-14)


def test_zero_moment_inputs_make_no_moment_and_the_force_is_the_direction(
    level: Level,
) -> None:
    sines = Sines.of(angles(2))
    force, moment = level.forces_and_moments(sines)
    inputs = np.concatenate([form.at(sines) for form in level.inputs]).T[..., None]
    np.testing.assert_allclose(moment @ inputs, 0, atol=1e-11)
    direction = level.direction.at(sines).T
    np.testing.assert_allclose((force @ inputs)[..., 0], direction, atol=1e-11)


def test_the_determinant_of_the_level_matrix_is_proportional_to_R(
    level: Level,
) -> None:
    sines = Sines.of(angles(3))
    determinant = np.linalg.det(level.matrix(sines))
    expected = 2 * level.rotors.drag_ratio * level.direction.at(sines)[2]
    np.testing.assert_allclose(determinant, expected, atol=1e-10)


def test_slopes_are_derivatives(level: Level) -> None:
    alpha, small = angles(4), 1e-6
    for form in forms(level):
        slopes = form.slopes(Sines.of(alpha))
        for joint in range(4):
            ahead = form.at(Sines.of(alpha + small * np.eye(4)[joint]))
            behind = form.at(Sines.of(alpha - small * np.eye(4)[joint]))
            expected = (ahead - behind) / (2 * small)
            np.testing.assert_allclose(slopes[joint], expected, atol=1e-7)
            assert (np.abs(slopes[joint]) <= form.size[:, None] + 1e-9).all()


def test_second_derivatives_are_within_their_bounds(level: Level) -> None:
    random, s = np.random.default_rng(5), np.linspace(0, 1, 201)
    bends = Bends(*forms(level))
    for _ in range(50):
        start, step = random.uniform(-2, 2, (2, 4))
        sines = Sines.of(start + s[:, None] * step)
        values = np.concatenate([form.at(sines) for form in forms(level)])
        second = np.abs(np.diff(values, 2)).max(axis=1) / (s[1] - s[0]) ** 2
        bound = bends.along(step[None])[:, 0]
        assert (second <= bound * (1 + 1e-6) + 1e-6).all()
        assert (bound <= 100 * second + 100).all()  # of the same order


def test_the_bound_is_reached_by_a_single_sinusoid() -> None:
    """cos α1·cos α2 is half of cos(α1 + α2) and half of cos(α1 − α2): with one angle still it is reached at its peak."""
    table = np.zeros((2, 2, 1, 1, 1))
    table[0, 0] = 3.0
    bends = Bends(Form(table))
    assert np.allclose(bends.along(np.array([[0.5, 0.0, 9.0, 9.0]])), 3.0 * 0.25)


def test_the_largest_column_bounds_how_fast_singular_values_change(
    level: Level,
) -> None:
    first, second = angles(6), angles(7)
    values = [
        np.linalg.svd(level.matrix(Sines.of(alpha)), compute_uv=False)
        for alpha in (first, second)
    ]
    change = np.abs(values[1] - values[0]).max(axis=1)
    moved = np.linalg.norm(second - first, axis=1)
    assert (change <= level.rate * moved + 1e-12).all()
    columns = np.linalg.norm(level.matrix(Sines.of(first)), axis=1)
    assert columns.max() <= level.rate + 1e-12
    assert columns.max() > 0.98 * level.rate
