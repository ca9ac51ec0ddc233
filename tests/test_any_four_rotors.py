"""Theorems 4 and 5 of docs/theory.md, section 21, on random vehicles: in integers where that is possible.

All forms are homogeneous in each u = (cos α, sin α), so that any integers may stand for it; and a theorem that does not use how
force and moment belong together holds for any integer matrices F and T.
"""

from __future__ import annotations

import math
from itertools import product
from typing import Any

import numpy as np
import pytest

import gaitgraph as gg
from gaitgraph.invertibility import (
    attitude_sensitivities,
    coefficients_of,
    hover_thrust_shares,
)

QUARTER = np.array([[0, -1], [1, 0]], dtype=object)
HALF_TURN = np.diag([-1, -1, 1])
Matrix = Any  # of exact integers, dtype object


def integers(random: np.random.Generator, *shape: int) -> Matrix:
    return random.integers(-9, 10, shape).astype(object)


def cross(a: Matrix, b: Matrix) -> Matrix:
    return a[[1, 2, 0]] * b[[2, 0, 1]] - a[[2, 0, 1]] * b[[1, 2, 0]]


def zero_moment_thrusts(moments: Matrix) -> Matrix:
    """Return N, the determinants of three columns each, shape (4,)."""
    minors = []
    for i in range(4):
        a, b, c = (moments[:, j] for j in range(4) if j != i)
        minors.append((-1) ** i * (a @ cross(b, c)))
    return np.array(minors)


class Rotors:
    """Four rotors by the columns of their force and moment, each (4, 3, 2)."""

    def __init__(self, force: Matrix, moment: Matrix) -> None:
        self.force, self.moment = force, moment

    @classmethod
    def placed(
        cls, places: Matrix, tilt: Matrix, thrust: Matrix, drag: Matrix
    ) -> Rotors:
        """Return rotors at places that tilt about axes, with any directions of thrust across these."""
        force, moment = [], []
        for r, e, a, d in zip(places, tilt, thrust, drag, strict=True):
            columns = [cross(e, cross(a, e)), cross(e, a) * (e @ e)]
            # of one length only if the tilt axis is a unit vector, which no theorem needs
            force.append(np.column_stack(columns))
            moment.append(np.column_stack([cross(r, f) + d * f for f in columns]))
        return cls(np.array(force), np.array(moment))

    def moments(self, u: Matrix) -> Matrix:
        return np.column_stack([self.moment[i] @ u[i] for i in range(4)])

    def direction(self, u: Matrix) -> Matrix:
        """Return the zero-moment direction f = Σ Nᵢ fᵢ, shape (3,)."""
        thrusts = zero_moment_thrusts(self.moments(u))
        return sum(thrusts[i] * (self.force[i] @ u[i]) for i in range(4))

    def coplanar(self, u1: Matrix, u2: Matrix) -> Matrix:
        """Return u of the root at which all moments lie in one plane."""
        n = cross(self.moment[0] @ u1, self.moment[1] @ u2)
        return np.array([u1, u2, *(QUARTER @ (self.moment[i].T @ n) for i in (2, 3))])

    def other_root(self, u1: Matrix, u2: Matrix) -> Matrix:
        """Return u of the other root, by the closed form of Theorem 4."""
        unit = np.eye(2, dtype=int).astype(object)
        table = np.array([[self.direction([u1, u2, x, y]) for y in unit] for x in unit])
        a, b = table[..., 0], table[..., 1]
        form = -(a.T @ QUARTER @ b + (a.T @ QUARTER @ b).T)  # twice S
        v = self.coplanar(u1, u2)[3]
        turned = QUARTER @ v
        size, value = v @ v, turned @ form @ turned  # twice Q(Jv)
        w = 2 * size * (form @ turned) - value * turned
        u4 = QUARTER @ w
        u3 = QUARTER @ (a @ u4) if (a @ u4).any() else QUARTER @ (b @ u4)
        return np.array([u1, u2, u3, u4])


def random_rotors(random: np.random.Generator) -> Rotors:
    if random.random() < 0.5:
        return Rotors(integers(random, 4, 3, 2), integers(random, 4, 3, 2))
    places, tilt, thrust = integers(random, 3, 4, 3)
    return Rotors.placed(places, tilt, thrust, integers(random, 4))


def test_zero_moment_thrusts_make_no_torque_and_every_form_is_multilinear() -> None:
    random = np.random.default_rng(1)
    for _ in range(200):
        rotors, u = random_rotors(random), integers(random, 4, 2)
        assert not (rotors.moments(u) @ zero_moment_thrusts(rotors.moments(u))).any()
        for joint in range(4):
            changed, total = u.copy(), u.copy()
            changed[joint] = integers(random, 2)
            total[joint] = 3 * u[joint] - 2 * changed[joint]
            parts = 3 * rotors.direction(u) - 2 * rotors.direction(changed)
            assert (rotors.direction(total) == parts).all()


def test_of_two_roots_one_is_singular_at_every_attitude() -> None:
    random, invertible = np.random.default_rng(2), 0
    for _ in range(300):
        rotors = random_rotors(random)
        u1, u2 = integers(random, 2, 2)
        if not cross(rotors.moment[0] @ u1, rotors.moment[1] @ u2).any():
            continue
        first = rotors.coplanar(u1, u2)
        assert not zero_moment_thrusts(rotors.moments(first)).any()
        other = rotors.other_root(u1, u2)
        x, y, z = rotors.direction(other)
        assert x == 0
        assert y == 0
        invertible += z != 0
    assert invertible > 250  # so that the other root is another one


def test_there_is_no_third_root() -> None:
    """Beside an independent search: the sign of det(A·u4, B·u4) changes at the two roots alone."""
    random = np.random.default_rng(3)
    for _ in range(40):
        rotors = random_rotors(random)
        u1, u2 = integers(random, 2, 2)
        unit = np.eye(2, dtype=int).astype(object)
        table = np.array(
            [[rotors.direction([u1, u2, x, y]) for y in unit] for x in unit]
        )
        a, b = table[..., 0].astype(float), table[..., 1].astype(float)
        if not np.any(a) or not np.any(b):
            continue
        angle = np.linspace(0, np.pi, 100_001)
        u4 = np.array([np.cos(angle), np.sin(angle)])
        left, right = a @ u4, b @ u4
        value = left[0] * right[1] - left[1] * right[0]
        changes = angle[:-1][value[:-1] * value[1:] < 0]
        roots = (rotors.coplanar(u1, u2)[3], rotors.other_root(u1, u2)[3])
        if not all(root.any() for root in roots):
            continue  # a fibre
        known = [math.atan2(root[1], root[0]) % math.pi for root in roots]
        off = [min(abs(one - known) % np.pi) for one in changes[:, None]]
        assert len(changes) in (0, 2)  # or both within one step of the raster
        assert max(off, default=0) < 1e-4


def test_vehicles_that_a_half_turn_maps_to_themselves_have_the_red_sheet() -> None:
    random, invertible, off_red = np.random.default_rng(4), 0, 0
    for _ in range(200):
        places, tilt, thrust = integers(random, 3, 2, 3)
        drag = integers(random, 2)
        places, tilt, thrust = (
            np.vstack([one, one @ HALF_TURN]) for one in (places, tilt, thrust)
        )
        rotors = Rotors.placed(places, tilt, thrust, np.tile(drag, 2))
        u = np.tile(integers(random, 2, 2), (2, 1))
        x, y, z = rotors.direction(u)
        assert x == 0
        assert y == 0
        invertible += z != 0
        other = np.array([*drag, drag[0] + 1, drag[1]])
        uneven = Rotors.placed(places, tilt, thrust, other)
        off_red += uneven.direction(u)[:2].any()
    assert invertible > 150
    assert off_red > 150  # opposite rotors must be alike


@pytest.mark.parametrize("height", [0.0, 0.06])
@pytest.mark.parametrize("spin", ["clockwise", "counterclockwise"])
def test_the_forms_are_those_of_square_vehicles(height: float, spin: Any) -> None:
    vehicle = gg.Vehicle(
        mass=1.3,
        arm_length=0.2,
        drag_to_thrust=0.02,
        rotor_height=height,
        first_arm_angle="45deg",
        first_rotor_spin=spin,
    )
    turn = vehicle.first_arm_angle + np.arange(4) * np.pi / 2
    out = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(4)])
    up = np.tile([0.0, 0.0, 1.0], (4, 1))
    sense = np.array([1, -1, 1, -1]) * (1 if spin == "clockwise" else -1)
    rotors = Rotors.placed(0.2 * out + height * up, out, up, 0.02 * sense)
    random = np.random.default_rng(5)
    alpha = random.uniform(-np.pi / 2, np.pi / 2, (50, 4))
    exact = coefficients_of(vehicle, "exact")
    v = attitude_sensitivities(alpha, exact)
    shares = hover_thrust_shares(alpha, vehicle)
    scales = []
    for row, expected, share in zip(alpha, v, shares, strict=True):
        u = np.column_stack([np.cos(row), np.sin(row)])
        f, thrusts = rotors.direction(u), zero_moment_thrusts(rotors.moments(u))
        scales.append(f[2] / expected[2])
        np.testing.assert_allclose(f, scales[-1] * expected, atol=1e-9 * abs(f).max())
        np.testing.assert_allclose(thrusts / f[2], share, rtol=1e-9)
    np.testing.assert_allclose(scales, scales[0], rtol=1e-9)  # one constant


def test_second_derivatives_are_within_the_bound_of_the_sinusoids() -> None:
    random = np.random.default_rng(6)
    turns = np.array(list(product([1, -1], repeat=4)))
    change = np.array([[0.5, 0.5], [-0.5j, 0.5j]])
    for _ in range(30):
        rotors = random_rotors(random)
        unit = np.eye(2)
        corners = [unit[list(j)] for j in product((0, 1), repeat=4)]
        values = np.array([float(rotors.direction(u)[2]) for u in corners])
        table = values.reshape(2, 2, 2, 2)
        amplitude = np.einsum("abcd,ae,bf,cg,dh->efgh", table, *[change] * 4).ravel()
        start, step = random.uniform(-2, 2, (2, 4))
        s = np.linspace(0, 1, 401)
        alpha = start + s[:, None] * step
        phase = alpha @ turns.T
        value = (np.exp(1j * phase) @ amplitude).real
        u = np.stack([np.cos(alpha), np.sin(alpha)], -1)
        direct = [float(rotors.direction(row)[2]) for row in u[::50]]
        np.testing.assert_allclose(value[::50], direct, atol=1e-9 * abs(table).max())
        bound = (np.abs(amplitude) * (turns @ step) ** 2).sum()
        second = np.diff(value, 2) / (s[1] - s[0]) ** 2
        assert np.abs(second).max() <= bound * (1 + 1e-6)
