"""The pictures of docs/theory.md, and its numbers that no other test computes."""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.testing.compare import compare_images

import gaitgraph as gg
from gaitgraph.surface.sheets import sheet_angles
from tests.published import GAITS

IMAGES = Path(__file__).parent.parent / "docs" / "images"
EXACT = gg.invertibility.coefficients_of(kind="exact")
PUBLISHED = gg.invertibility.coefficients_of(kind="published")
KAPPA = gg.PAPER.drag_ratio
DELTA = EXACT.delta


@pytest.mark.slow
def test_the_pictures_are_drawn_by_their_script(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plt.switch_backend("agg")
    monkeypatch.chdir(tmp_path)
    runpy.run_path(str(IMAGES / "theory.py"))
    for name in ("directions", "planes", "components"):
        picture = f"theory_{name}.png"
        different: Any = compare_images(str(IMAGES / picture), picture, tol=8.0)
        assert different is None


def test_thrusts_without_a_moment_of_a_symmetric_vehicle() -> None:
    """Theorem 5: the kernel (g, h, U3, U4) of wrenches by determinants, and its factor k = −2·ρ1·ρ2·sin² ψ."""
    rng = np.random.default_rng(3)
    for _ in range(5):
        first, second = rng.uniform(0.1, 0.3, (2, 3)) * [[1, 1, 1], [-1, 1, 1]]
        half_turn = [-1, -1, 1]
        rotors = gg.invertibility.Geometry.of_vehicle(
            gg.Vehicle(
                mass=1.0,
                drag_to_thrust=[0.02, 0.03, 0.02, 0.03],
                rotor_positions=[first, second, first * half_turn, second * half_turn],
            )
        )

        def wrenches(angles: Any, rotors: Any = rotors) -> Any:
            """Return moments and horizontal forces per thrust, a row for each rotor."""
            moments = rotors.moment_matrix(angles)
            return np.vstack([moments, rotors.force_matrix(angles)[:2]]).T

        alpha = rng.uniform(-np.pi, np.pi, 4)
        w1, w2 = wrenches(alpha)[:2]
        (a3, a4), (b3, b4) = (
            wrenches(np.zeros(4))[2:],
            wrenches(np.ones(4) * np.pi / 2)[2:],
        )
        kernel = [
            np.linalg.det([w2, a3, b3, a4, b4]),
            -np.linalg.det([w1, a3, b3, a4, b4]),
            np.linalg.det([w1, w2, b3, a4, b4]),
            -np.linalg.det([w1, w2, a3, a4, b4]),
            np.linalg.det([w1, w2, a3, b3, b4]),
            -np.linalg.det([w1, w2, a3, b3, a4]),
        ]
        yaw1, yaw2 = w1[2], w2[2]
        u1, u2 = np.stack([np.cos(alpha[:2]), np.sin(alpha[:2])], axis=1)
        k = -2 * np.linalg.det([first[:2], second[:2]]) ** 2
        k = k / np.hypot(*first[:2]) / np.hypot(*second[:2])
        expected = k * np.array([yaw2, -yaw1, *(yaw2 * u1), *(-yaw1 * u2)])
        np.testing.assert_allclose(kernel, expected, atol=1e-15)


def test_the_published_R_on_blue_is_a_line_in_two_cosines() -> None:
    """Section 9."""
    a, b = PUBLISHED.attitude, PUBLISHED.single
    c, d = PUBLISHED.double, PUBLISHED.triple
    slope = (2 * a - b - d) / (2 * np.sqrt(1 + a * a))
    offset = (2 * a * a - a * (b - d) - c) / (1 + a * a)
    assert (slope, offset) == pytest.approx((-1.15e-4, -2.05e-4), abs=5e-7)
    assert 2 * slope + offset == pytest.approx(-4.34e-4, abs=5e-7)
    a1, a2 = np.random.default_rng(4).uniform(-1.5, 1.5, (2, 300))
    delta = PUBLISHED.delta
    blue = np.stack([a1, a2, 2 * delta - a1, -2 * delta - a2], axis=-1)
    waves = np.cos(2 * (a1 - delta)) + np.cos(2 * (a2 + delta))
    R = gg.invertibility.level_determinant(blue, PUBLISHED)
    np.testing.assert_allclose(R, slope * waves + offset, atol=1e-14)
    # Wrapped angles turn the sign, in strips next to the sides of the square.
    axis = np.linspace(-np.pi / 2, np.pi / 2, 501)
    a1, a2 = (side.ravel() for side in np.meshgrid(axis, axis))
    wrapped = np.stack([a1, a2, *sheet_angles("blue", a1, a2, PUBLISHED)], axis=-1)
    R_on_blue = gg.invertibility.level_determinant(wrapped, PUBLISHED)
    assert R_on_blue.min() == pytest.approx(-4.34e-4, abs=5e-7)
    assert R_on_blue.max() == pytest.approx(2.11e-4, abs=5e-7)


def test_printed_blue_vertices_have_R_above_zero() -> None:
    """Section 9: seven of eight, by (6) corrected."""
    blue = [
        (*plane, *printed)
        for gait in GAITS[:2]
        for plane, printed in zip(gait.angles, gait.printed, strict=True)
    ]
    assert (gg.invertibility.level_determinant(blue, PUBLISHED) > 0).sum() == 7


def test_the_areas_of_the_seven_regions() -> None:
    """Section 10: heights of the regions above each α1, below, above and beside the curve R = 0."""
    n = 10_000
    a1 = ((np.arange(n) + 0.5) / n - 0.5) * np.pi
    line = np.pi / 2 - DELTA
    curve = np.arctan(np.tan(a1) - 2 * KAPPA)
    below = np.minimum(curve, line) + np.pi / 2
    above = np.maximum(line - curve, 0)
    right_of_curve = np.maximum(curve - line, 0)
    left_of_curve = np.pi - below - above - right_of_curve
    in_strip = a1 < -line
    areas = [
        heights[where].sum() * np.pi / n
        for where in (~in_strip, in_strip)
        for heights in (above, below, left_of_curve, right_of_curve)
    ]
    expected = [4.4647, 4.3829, 0.4836, 0.0135, 0.4836, 0.0135, DELTA**2, 0]
    assert areas == pytest.approx(expected, abs=2e-4)


def test_hover_thrusts_on_red() -> None:
    """Section 11."""
    a1, a2 = np.random.default_rng(6).uniform(-1.5, 1.5, (2, 1000))
    shares = gg.invertibility.hover_thrust_shares(np.stack([a1, a2, a1, a2], axis=-1))
    D = 2 * KAPPA * np.cos(a1) * np.cos(a2) - np.sin(a1 - a2)
    first = np.sin(a2 + DELTA) / (2 * np.cos(DELTA) * D)
    second = -np.sin(a1 - DELTA) / (2 * np.cos(DELTA) * D)
    np.testing.assert_allclose(shares.T, [first, second, first, second], rtol=1e-9)
    quadrant = (a1 < DELTA) & (a2 > -DELTA)
    opposite = (a1 > DELTA) & (a2 < -DELTA)
    assert ((shares > 0).all(axis=1) == (quadrant | opposite)).all()


@pytest.mark.parametrize("height", [0.0, 0.3])
def test_the_least_singular_value_on_red(height: float) -> None:
    """Section 14: by the determinants of two blocks and the sums of their squared entries."""
    vehicle = gg.Vehicle(drag_ratio=KAPPA, arm_length=1.0, rotor_height=height)
    a1, a2 = np.random.default_rng(8).uniform(-np.pi, np.pi, (2, 300))
    b1, b2 = a1 - DELTA, a2 + DELTA
    yaw = np.sin(b1) / np.cos(DELTA), np.sin(b2) / np.cos(DELTA)
    level = np.cos(b1) / np.cos(DELTA), np.cos(b2) / np.cos(DELTA)
    D = np.cos(a1) * yaw[1] - np.cos(a2) * yaw[0]
    P = level[0] * level[1] + height**2 * np.sin(a1) * np.sin(a2)
    squares_of_D = yaw[0] ** 2 + yaw[1] ** 2 + np.cos(a1) ** 2 + np.cos(a2) ** 2
    leaning = height**2 * (np.sin(a1) ** 2 + np.sin(a2) ** 2)
    squares_of_P = level[0] ** 2 + level[1] ** 2 + leaning

    def least(determinant: Any, squares: Any) -> Any:
        root = np.sqrt(np.maximum(squares**2 - 4 * determinant**2, 0))
        return np.abs(determinant) / np.sqrt((squares + root) / 2)

    expected = np.sqrt(2) * np.minimum(least(D, squares_of_D), least(P, squares_of_P))
    red = np.stack([a1, a2, a1, a2], axis=-1)
    found = gg.invertibility.least_singular_value(red, vehicle)
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_bounds_of_the_least_singular_value() -> None:
    """Section 14."""
    rng = np.random.default_rng(7)
    alpha = rng.uniform(-np.pi, np.pi, (2000, 4))
    roll, pitch = rng.uniform(-1.5, 1.5, (2, 2000))
    least = gg.invertibility.least_singular_value(alpha, gg.PAPER, roll, pitch)
    highest = 2 * np.sqrt((1 + KAPPA**2) / 3)
    assert highest == pytest.approx(1.171, abs=5e-4)
    assert (least <= highest).all()
    for a1, a2 in ((-0.448, 0.448), (0.783, -0.783)):
        red = gg.invertibility.least_singular_value([a1, a2, a1, a2])
        assert red > highest - 1e-3
    hover = gg.invertibility.least_singular_value([0, 0, 0, 0])
    assert hover == pytest.approx(2 * KAPPA, abs=1e-12)
    assert hover == pytest.approx(0.337, abs=5e-4)


def test_grid_loops_tend_to_the_octile_length() -> None:
    """Section 17."""
    loop = np.array([(0.3, -1.2), (1.2, -0.9), (0.9, -0.3)])
    steps = np.abs(np.roll(loop, -1, axis=0) - loop)
    octile = (steps.max(axis=1) + (np.sqrt(2) - 1) * steps.min(axis=1)).sum()
    fine = gg.plan_loop(loop, color="red", divisions=32).loop
    assert fine is not None
    assert fine.length == pytest.approx(octile, abs=5e-3)
