"""The flight controller and the servos against independent mathematics: linear loops, decompositions, quadratures."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from gaitgraph.errors import InputError
from gaitgraph.flight.controller import allocation_of, wanted_attitude
from gaitgraph.flight.course import repeated, servo_response
from gaitgraph.flight.engine import Engine
from gaitgraph.flight.flight import REFERENCES, FlightSettings, Reference, reference_at
from gaitgraph.flight.simulation import Simulation
from gaitgraph.invertibility.matrices import (
    body_vertical,
    scaled_decoupling_matrix,
    thrust_signs,
)
from gaitgraph.vehicle import PAPER, Vehicle
from tests.samples import ASCENDING, BEETLE, RED, flown_by

if TYPE_CHECKING:
    import numpy.typing as npt

    from gaitgraph.timing.timed_gait import TimedGait

    FloatArray = npt.NDArray[np.float64]

pytest.importorskip("mujoco")

VEHICLES = {
    "paper": PAPER,
    "beetle": BEETLE,
    "strong drag": PAPER.replace(drag_ratio=1.3, first_arm_angle=0.4),
}


class TestServos:
    T = np.linspace(0.0, 1.0, 401)
    COMMAND = np.sin(2 * math.pi * T)[:, None] * [1.0, 0.5, 0.2, -1.0] + [
        0.0,
        0.1,
        0.0,
        0.3,
    ]

    def test_a_lag_with_a_limit_is_right_to_first_order(self) -> None:
        def rate(t: float, angles: FloatArray) -> FloatArray:
            commanded = [np.interp(t, self.T, column) for column in self.COMMAND.T]
            return np.asarray(np.clip((commanded - angles) / 0.05, -3.0, 3.0))

        exact = solve_ivp(
            rate, (0.0, 1.0), self.COMMAND[0], t_eval=self.T, max_step=0.0025, rtol=1e-6
        ).y.T
        found = [
            servo_response(self.COMMAND[::k], 0.0025 * k, lag=0.05, rate=3.0)
            for k in (4, 1)
        ]
        coarse, fine = (
            np.abs(one - exact[::k]).max() for one, k in zip(found, (4, 1), strict=True)
        )
        assert 2 * fine < coarse < 0.01
        assert np.abs(np.diff(found[1], axis=0)).max() <= 3.0 * 0.0025 * (1 + 1e-12)

    def test_a_limit_alone_follows_as_fast_as_it_may(self) -> None:
        np.testing.assert_array_equal(
            servo_response(self.COMMAND, 0.0025, rate=100.0), self.COMMAND
        )
        out = servo_response(self.COMMAND, 0.0025, rate=2.0)
        moved, ahead = np.diff(out, axis=0), self.COMMAND[1:] - out[:-1]
        late = np.abs(out[1:] - self.COMMAND[1:]) >= 1e-12
        assert 0 < late.mean() < 1
        np.testing.assert_allclose(
            moved[late], 2.0 * 0.0025 * np.sign(ahead[late]), rtol=1e-9
        )


def allocated(alpha: FloatArray, vehicle: Vehicle) -> tuple[FloatArray, ...]:
    """Return F·P, N, |P|², P and w of an allocation."""
    lifts, thrusts, squared = allocation_of(alpha, vehicle)
    force = np.swapaxes(lifts[:, :3], 1, 2)
    return force, lifts[:, 3], squared, thrusts[..., :3], thrusts[..., 3]


def nearness(allocation: tuple[FloatArray, ...], vertical: FloatArray) -> FloatArray:
    """Return 1/|A⁻¹| (Frobenius) at n places, as the docstring of the simulation has it."""
    force, direction, squared, *_ = allocation
    along = np.sum(direction * vertical, axis=-1) ** 2
    across = np.sum((vertical[:, None, :] @ force) ** 2, axis=(1, 2))
    with np.errstate(invalid="ignore"):
        bottom = np.where(along > 0, squared * along, 0.0) + across + 1.0
    return np.asarray(np.sqrt(along / bottom))


@pytest.mark.parametrize("name", VEHICLES)
def test_an_allocation_inverts_the_decoupling_matrix(name: str) -> None:
    vehicle, rng, count = VEHICLES[name], np.random.default_rng(6), 2000
    alpha = rng.uniform(-math.pi, math.pi, (count, 4))
    roll, pitch = rng.uniform(-math.pi, math.pi, count), rng.uniform(-1.5, 1.5, count)
    force, direction, squared, thrusts, free = allocation = allocated(alpha, vehicle)
    matrix = scaled_decoupling_matrix(alpha, vehicle, roll, pitch) * thrust_signs(
        vehicle
    )
    moment, up = matrix[:, :3], body_vertical(roll, pitch)
    # The pseudo-inverse and the null direction.
    inverse = np.linalg.pinv(moment)
    scale = np.linalg.norm(inverse, axis=(1, 2))
    assert (np.abs(thrusts - inverse).max(axis=(1, 2)) <= 1e-11 * scale**2).all()
    np.testing.assert_allclose(squared, scale**2, rtol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(free, axis=1), 1.0, rtol=1e-12)
    np.testing.assert_allclose(
        (moment @ free[..., None])[..., 0], 0.0, atol=1e-12 * scale.max()
    )
    assert direction[0, 2] >= 0
    # Thrusts that make a torque and a lift.
    singular = np.linalg.svd(matrix, compute_uv=False)[:, -1]
    regular = singular > 1e-3
    assert regular.mean() > 0.9
    torque, lift = rng.normal(size=(count, 3)), rng.normal(size=count)
    rest = lift - np.sum((up[:, None] @ force)[:, 0] * torque, axis=-1)
    got = (thrusts @ torque[..., None])[..., 0] + (
        rest / np.sum(up * direction, axis=-1)
    )[:, None] * free
    expected = np.linalg.solve(matrix, np.hstack([torque, lift[:, None]])[..., None])[
        ..., 0
    ]
    np.testing.assert_allclose(got[regular], expected[regular], rtol=1e-6, atol=1e-6)
    # How near the matrix is to a singular one: between half the least singular value and all of it.
    near = nearness(allocation, up)
    assert (near <= singular * (1 + 1e-7)).all()
    assert (near >= singular / 2 * (1 - 1e-7)).all()
    np.testing.assert_allclose(
        near, 1.0 / np.linalg.norm(np.linalg.inv(matrix), axis=(1, 2)), rtol=1e-6
    )


def test_nothing_is_divided_where_the_moment_matrix_has_lost_rank() -> None:
    delta = math.atan(PAPER.drag_ratio)
    allocation = allocated(
        math.pi / 2 + delta * np.array([[1.0, -1.0, 1.0, -1.0]]), PAPER
    )
    _, _, squared, thrusts, free = allocation
    assert not squared.any()
    assert not free.any()
    assert not thrusts.any()
    assert nearness(allocation, np.array([[0.0, 0.0, 1.0]])) == 0.0


def sampled(
    stiffness: float, damping: float, start: float, step: float, count: int
) -> FloatArray:
    """Return the exact solution of ë = −kp·e − kd·ė from rest at each step, integrated as the engine does."""
    x, v, out = start, 0.0, [start]
    for _ in range(count):
        v += step * (-stiffness * x - damping * v)
        x += step * v
        out.append(x)
    return np.array(out)


@pytest.mark.parametrize(
    "timed", [RED, ASCENDING, flown_by(ASCENDING, BEETLE)], ids=["3", "4", "beetle"]
)
def test_each_error_obeys_its_own_linear_equation(
    monkeypatch: pytest.MonkeyPatch, timed: TimedGait
) -> None:
    """Roll, pitch, yaw and altitude are decoupled, whatever the gait does."""
    starts, place = {"roll": 0.3, "pitch": -0.2, "yaw": 0.25, "z": -0.15}, Engine.place

    def elsewhere(engine: Engine, alpha: Any, **others: Any) -> None:
        place(engine, alpha, **{**others, "yaw": starts["yaw"]})
        engine.data.qpos[2] = starts["z"]

    monkeypatch.setattr(Engine, "place", elsewhere)
    gains: dict[str, Any] = {
        "altitude_stiffness": 60.0,
        "altitude_damping": 9.0,
        "saturation": False,
    }
    worst: dict[str, list[float]] = {name: [] for name in starts}
    for step in (1e-3, 2.5e-4):
        settings = FlightSettings(
            duration=0.5, step=step, control_rate=1 / step, **gains
        )
        flight = Simulation(repeated(timed), settings).run(
            (starts["roll"], starts["pitch"])
        )
        for name, start in starts.items():
            expected = sampled(
                *((60.0, 9.0) if name == "z" else (100.0, 20.0)),
                start,
                step,
                len(flight.rows) - 1,
            )
            worst[name].append(float(np.abs(flight.column(name) - expected).max()))
    # What is left vanishes with the step, to first order at least.
    for name, (coarse, fine) in worst.items():
        assert fine / 0.3 < coarse < 2e-3, name


class TestDecoupler:
    def test_the_force_points_where_it_is_wanted(self) -> None:
        rng = np.random.default_rng(8)
        for _ in range(200):
            ax, ay, yaw = *rng.uniform(-5, 5, 2), rng.uniform(-3, 3)
            force = rng.normal(size=3) * 0.3 + [0, 0, 2]
            roll, pitch = wanted_attitude(ax, ay, 9.8, yaw, tuple(force))
            pushed = Rotation.from_euler("ZYX", [yaw, pitch, roll]).apply(force)
            np.testing.assert_allclose(
                pushed / pushed[2] * 9.8, [ax, ay, 9.8], rtol=1e-9, atol=1e-9
            )

        # It leans by 45° at most.
        roll, pitch = wanted_attitude(300.0, -400.0, 9.8, 0.0, (0.0, 0.0, 1.0))
        pushed = Rotation.from_euler("ZYX", [0.0, pitch, roll]).apply([0, 0, 1.0])
        np.testing.assert_allclose(
            pushed, np.array([0.6, -0.8, 1.0]) / math.sqrt(2), atol=1e-12
        )

    @pytest.mark.parametrize("eta", [1.0, 0.9])
    def test_red_and_biased_gaits_are_held_in_place(self, eta: float) -> None:
        timed = replace(ASCENDING, gait=ASCENDING.gait.biased(eta), period=4.0)
        flight = Simulation(
            repeated(timed),
            FlightSettings(reference="line", lap=2.0, size=0.5, duration=2.5),
        ).run()
        assert flight.tracking_error is not None
        assert flight.tracking_error < 0.03
        assert flight.column("x_wanted").max() == pytest.approx(0.5)
        assert flight.column("x")[-1] == pytest.approx(0.5, abs=0.02)
        if eta < 1:
            # N is not along body z: it hovers askew.
            assert (
                np.abs(flight.column("roll")[-300:]).max()
                + np.abs(flight.column("pitch")[-300:]).max()
                > 0.01
            )


@pytest.mark.parametrize("kind", REFERENCES)
def test_references_have_their_derivatives_and_rest_at_both_ends(
    kind: Reference,
) -> None:
    settings, h = FlightSettings(reference=kind, size=1.7, lap=5.0), 1e-4
    t = np.linspace(0.05, 4.95, 99)
    before, now, after = (reference_at(settings, t + by) for by in (-h, 0.0, h))
    np.testing.assert_allclose((after[0] - before[0]) / (2 * h), now[1], atol=1e-6)
    np.testing.assert_allclose(
        (after[0] - 2 * now[0] + before[0]) / h**2, now[2], atol=1e-5
    )
    place, velocity, acceleration = reference_at(settings, [0.0, 5.0, 9.0])
    first = 1.7 if kind == "step" else 0.0
    last = 1.7 if kind in ("step", "line") else 0.0
    np.testing.assert_allclose(
        place, [[first, 0, 0], [last, 0, 0], [last, 0, 0]], atol=1e-12
    )
    np.testing.assert_allclose([velocity, acceleration], 0, atol=1e-12)
    if kind == "circle":
        np.testing.assert_allclose(
            np.hypot(now[0][:, 0] - 1.7, now[0][:, 1]), 1.7, rtol=1e-12
        )


class TestGains:
    @pytest.mark.parametrize("every", [1, 4, 20])
    def test_the_limit_is_that_of_the_sampled_loop(self, every: int) -> None:
        """Poles of the map from one setting to the next, by brute force: steps of an engine under a held input.

        Of this engine, of one with a single step, and of one that has no steps: what is stable in all is allowed.
        """
        rng, rate = np.random.default_rng(10), 1000.0 / every
        maps = []
        for steps in (every, 1):
            h = 1 / (rate * steps)
            one = np.array([[1, h], [0, 1.0]]), np.array([h * h, h])
            move, push = np.eye(2), np.zeros(2)
            for _ in range(steps):
                move, push = one[0] @ move, one[0] @ push + one[1]
            maps.append((move, push))
        maps.append((maps[-1][0], np.array([0.5 / rate**2, 1 / rate])))
        allowed = 0
        for _ in range(200):
            kp, kd = (
                10 ** rng.uniform(0, math.log10(6 * rate**2)),
                rate * rng.uniform(0, 2.2),
            )
            radii = [
                np.abs(np.linalg.eigvals(move - np.outer(push, [kp, kd]))).max()
                for move, push in maps
            ]
            try:
                FlightSettings(
                    attitude_stiffness=kp,
                    attitude_damping=kd,
                    control_rate=rate,
                    saturation=False,
                )
            except InputError:
                assert max(radii) > 0.98
            else:
                allowed += 1
                assert max(radii) < 1
        assert allowed > 20

    def test_position_gains_must_be_slower_than_attitude(self) -> None:
        message = "position_damping must make x and y slower than roll and pitch: "
        with pytest.raises(
            InputError,
            match=f"^{message}30.0 with position_stiffness 900.0 is unstable at 1000 Hz",
        ):
            FlightSettings(
                reference="hover", position_stiffness=900.0, position_damping=30.0
            )
        assert (
            FlightSettings(position_stiffness=900.0, position_damping=30.0).reference
            == "attitude"
        )
        slow: dict[str, Any] = {
            "control_rate": 10.0, "attitude_stiffness": 100.0, "attitude_damping": 12.0, "altitude_stiffness": 4.0,
            "altitude_damping": 4.0, "position_stiffness": 4.9, "position_damping": 10.0,
        }  # fmt: skip
        with pytest.raises(
            InputError,
            match=message + "10.0 with position_stiffness 4.9 is unstable at 10 Hz",
        ):
            FlightSettings(reference="hover", **slow)
        assert FlightSettings(
            reference="hover", **{**slow, "control_rate": 100.0}
        ).is_calm
