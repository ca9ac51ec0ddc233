"""The engine against the package's matrices, and against mechanics derived here without it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from gaitgraph.errors import InputError
from gaitgraph.flight.engine import Engine, engine_warnings
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.invertibility.matrices import (
    decoupling_matrix,
    determinant,
    thrust_signs,
)
from gaitgraph.vehicle import PAPER, Vehicle
from tests.samples import BEETLE

if TYPE_CHECKING:
    from pathlib import Path

    import numpy.typing as npt

    FloatArray = npt.NDArray[np.float64]

pytest.importorskip("mujoco")


def drawn_vehicle(rng: np.random.Generator, **more: Any) -> Vehicle:
    sides = rng.uniform(0.2, 1.0, 3) ** 2
    mass, length = 10 ** rng.uniform(-1.5, 2.0), 10 ** rng.uniform(-1.0, 0.5)
    inertia = 0.1 * mass * length**2 * (sides.sum() - sides)
    return Vehicle(
        name="drawn",
        mass=mass,
        gravity=rng.uniform(1.0, 20.0),
        arm_length=length,
        thrust_coefficient=10 ** rng.uniform(-7, -4),
        drag_ratio=10 ** rng.uniform(-2, 0.7),
        inertia=tuple(inertia),
        first_arm_angle=rng.uniform(-math.pi, math.pi),
        first_rotor_spin="clockwise" if rng.random() < 0.5 else "counterclockwise",
        **more,
    )


RNG = np.random.default_rng(7)
_INERTIA = 0.02 * min(PAPER.inertia or (0.0,))
VEHICLES = {
    "paper": PAPER,
    "beetle": BEETLE.replace(rotor_lag=None),
    "paper with arms": PAPER.replace(arm_inertia=_INERTIA),
    **{f"drawn {k}": drawn_vehicle(RNG) for k in range(2)},
    **{
        f"drawn, raised {h} m": drawn_vehicle(RNG).replace(
            arm_length=1.0, rotor_height=h
        )
        for h in (0.3, -2.0)
    },
    "paper, raised, with arms": PAPER.replace(rotor_height=0.05, arm_inertia=_INERTIA),
    "drawn with arms": drawn_vehicle(RNG).replace(
        mass=2.0, inertia=(0.02, 0.03, 0.04), arm_inertia=1e-3
    ),
}


def held(engine: Engine) -> Engine:
    """Hold the arms: their hinges get an armature that nothing moves."""
    engine.model.dof_armature[6:] = 1e12
    return engine


def turned(engine: Engine) -> FloatArray:
    """Return the matrix that takes body axes to the world's."""
    matrix = np.empty(9)
    engine.mujoco.mju_quat2Mat(matrix, engine.data.qpos[3:7])
    return matrix.reshape(3, 3)


def step(engine: Engine) -> None:
    engine.mujoco.mj_step(engine.model, engine.data)


def accelerations(engine: Engine) -> FloatArray:
    engine.mujoco.mj_forward(engine.model, engine.data)
    return np.array(engine.data.qacc)


def angular_momentum(engine: Engine) -> FloatArray:
    """Return the whole vehicle's angular momentum about its centre of mass, in the world."""
    engine.mujoco.mj_subtreeVel(engine.model, engine.data)
    return np.array(engine.data.subtree_angmom[1])


def mass_matrix(engine: Engine) -> FloatArray:
    """Return the full mass matrix, by whichever arguments this version of the engine takes."""
    full = np.empty((10, 10))
    try:
        engine.mujoco.mj_fullM(engine.model, engine.data, full)
    except TypeError:
        engine.mujoco.mj_fullM(engine.model, full, engine.data.qM)
    return full


@pytest.mark.parametrize("name", VEHICLES)
class TestWrench:
    def test_the_body_obeys_newton_and_euler_when_the_arms_are_held(
        self, name: str
    ) -> None:
        vehicle, rng = VEHICLES[name], np.random.default_rng(2)
        mass, inertia, length = vehicle.require(
            "mass", "inertia", "arm_length", purpose="test"
        )
        engine = held(Engine(vehicle))
        arms = vehicle.first_arm_angle + np.arange(4) * math.pi / 2
        spins = np.array([1, -1, 1, -1]) * (
            1 if vehicle.first_rotor_spin == "clockwise" else -1
        )
        for _ in range(20):
            alpha, thrusts = (
                rng.uniform(-1.5, 1.5, 4),
                rng.uniform(-1, 4, 4) * mass * vehicle.gravity / 4,
            )
            omega, speed = rng.normal(size=3) * 3, rng.normal(size=3)
            engine.place(
                alpha,
                roll=rng.uniform(-3, 3),
                pitch=rng.uniform(-1.5, 1.5),
                yaw=rng.uniform(-3, 3),
            )
            engine.data.ctrl[:4] = thrusts
            engine.data.qvel[:3], engine.data.qvel[3:6] = speed, omega
            got = accelerations(engine)
            force, torque = np.zeros(3), np.zeros(3)
            for arm, tilt, thrust, sense in zip(
                arms, alpha, thrusts, spins, strict=True
            ):
                out = np.array([math.cos(arm), math.sin(arm), 0.0])
                axis = math.cos(tilt) * np.array([0, 0, 1.0]) + math.sin(
                    tilt
                ) * np.cross(out, [0, 0, 1.0])
                force += thrust * axis
                lever = length * out + [0.0, 0.0, vehicle.rotor_height]
                torque += thrust * (
                    np.cross(lever, axis) + sense * vehicle.drag_ratio * length * axis
                )
            moments = np.array(inertia)
            linear = turned(engine) @ force / mass - [0, 0, vehicle.gravity]
            angular = (torque - np.cross(omega, moments * omega)) / moments
            np.testing.assert_allclose(
                got[:3], linear, rtol=0, atol=1e-9 * float(np.linalg.norm(linear))
            )
            np.testing.assert_allclose(
                got[3:6], angular, rtol=0, atol=1e-9 * float(np.linalg.norm(angular))
            )

    def test_formula_1_is_the_determinant_of_the_engines_own_dynamics(
        self, name: str
    ) -> None:
        """∂(z̈, φ̈, θ̈, ψ̈)/∂w is measured; at rest Euler angles accelerate by the kinematic matrix times ω̇."""
        vehicle, rng = VEHICLES[name], np.random.default_rng(3)
        mass, inertia, length = vehicle.require(
            "mass", "inertia", "arm_length", purpose="test"
        )
        coefficient, kappa = (
            vehicle.thrust_coefficient or 0.0,
            vehicle.signed_drag_ratio,
        )
        engine = held(Engine(vehicle))
        for _ in range(10):
            alpha = rng.uniform(-math.pi / 2, math.pi / 2, 4)
            roll, pitch = rng.uniform(-1.2, 1.2, 2)
            engine.place(alpha, roll=roll, pitch=pitch, yaw=rng.uniform(-3, 3))
            unit = mass * vehicle.gravity / coefficient

            def outputs(
                inputs: FloatArray, roll: float = roll, pitch: float = pitch
            ) -> Any:
                engine.data.ctrl[:4] = thrust_signs(vehicle) * coefficient * inputs
                qacc = accelerations(engine)
                p, q, r = qacc[3:6]
                turn = math.sin(roll) * q + math.cos(roll) * r
                rates = (
                    p + turn * math.tan(pitch),
                    math.cos(roll) * q - math.sin(roll) * r,
                    turn / math.cos(pitch),
                )
                return np.array([qacc[2], *rates])

            at_rest = outputs(np.zeros(4))
            columns = [
                (outputs(unit * np.eye(4)[k]) - at_rest) / unit for k in range(4)
            ]
            measured = np.stack(columns, axis=-1)
            expected = decoupling_matrix(alpha, vehicle, roll, pitch)
            scale = np.abs(expected).max(axis=1, keepdims=True)
            np.testing.assert_allclose(
                measured / scale, expected / scale, rtol=0, atol=1e-9
            )
            constant = (
                -2
                * kappa
                * coefficient**4
                * length**3
                / (mass * np.prod(inertia) * math.cos(pitch))
            )
            formula = float(
                determinant(alpha, coefficients_of(vehicle, "exact"), roll, pitch)
            )
            rows = np.prod(np.linalg.norm(measured, axis=1))
            assert np.linalg.det(measured) / rows == pytest.approx(
                constant * formula / rows, rel=1e-9, abs=1e-9
            )

    def test_mass_inertia_and_centre_of_mass_are_the_vehicles(self, name: str) -> None:
        vehicle, rng = VEHICLES[name], np.random.default_rng(4)
        mass, inertia = vehicle.require("mass", "inertia", purpose="test")
        engine = Engine(vehicle)
        assert engine.model.body_mass.sum() == pytest.approx(mass, rel=1e-12)
        for _ in range(3):
            engine.place(rng.uniform(-1.5, 1.5, 4))
            np.testing.assert_allclose(engine.data.subtree_com[1], 0.0, atol=1e-12)
            # The upper left of the mass matrix is that of the whole with its arms held.
            block = np.diag([mass, mass, mass, *inertia])
            np.testing.assert_allclose(
                mass_matrix(engine)[:6, :6],
                block,
                rtol=0,
                atol=1e-12 * np.abs(block).max(),
            )


class TestMechanics:
    @pytest.mark.parametrize("arm_inertia", [None, 1e-4])
    def test_without_thrust_angular_momentum_stays_although_the_arms_swing(
        self, arm_inertia: float | None
    ) -> None:
        """Servos act between body and arms only; what is left is the engine's own error, of first order in its step."""
        lost = []
        for every in (1e-3, 5e-4):
            engine = Engine(PAPER.replace(arm_inertia=arm_inertia), step=every)
            engine.place([0.1, 0.2, -0.3, 0.4])
            engine.data.qvel[3:6] = 2.0, -1.0, 1.5
            accelerations(engine)
            before = angular_momentum(engine)
            for k in range(round(0.5 / every)):
                engine.data.ctrl[4:] = [
                    math.sin(6 * k * every),
                    0.2,
                    -0.3 + 0.5 * math.sin(9 * k * every),
                    0.4,
                ]
                step(engine)
            accelerations(engine)
            lost.append(
                np.linalg.norm(angular_momentum(engine) - before)
                / np.linalg.norm(before)
            )
        assert lost[1] < 0.7 * lost[0] < 0.01

    def test_a_swinging_arm_pushes_back_on_the_body(self) -> None:
        """Arms 1 and 3 swing alike in their own outward senses, arms 2 and 4 are held: I·ω̇ = −J·α̈·(axis), summed."""
        arm, (ix, iy, _) = 1e-4, PAPER.inertia or (0.0, 0.0, 0.0)
        engine = Engine(PAPER.replace(arm_inertia=arm))
        for k, axis in enumerate(([1, 0], [0, 1], [-1, 0], [0, -1])):
            engine.place(np.zeros(4))
            engine.data.ctrl[4 + k] = 1e-3
            qacc = accelerations(engine)
            swing = qacc[6:]
            # Held arms are carried along: they turn as the body does, about their own axes too.
            assert swing[k] > 10.0
            total = sum(
                swing[i] * np.array(a)
                for i, a in enumerate(([1, 0], [0, 1], [-1, 0], [0, -1]))
            )
            assert swing[k] == pytest.approx(np.dot(total, axis), rel=0.2)
            np.testing.assert_allclose(
                qacc[3:5] * [ix, iy], -arm * total, rtol=1e-9, atol=1e-12
            )


@pytest.mark.parametrize("every", [1e-3, 5e-4])
@pytest.mark.parametrize("arm_inertia", [None, 1e-5, 1e-4])
def test_hinges_are_where_they_are_planned(
    arm_inertia: float | None, every: float
) -> None:
    """Exactly, but for what the body's own angular acceleration ω̇ does to an arm: up to |ω̇|·step²/0.09."""
    engine, steps = (
        Engine(PAPER.replace(arm_inertia=arm_inertia), step=every),
        round(0.2 / every),
    )
    plan = np.sin(
        2 * math.pi * every * np.arange(steps + 1)[:, None] + np.arange(4)
    ) * [1.0, 0.5, 0.7, -0.9]
    commands = engine.servo_commands(plan)
    assert commands.shape == (steps, 4)
    engine.place(plan[0], rates=(plan[1] - plan[0]) / every)
    off = fastest = 0.0
    for k in range(steps):
        engine.data.ctrl[4:] = commands[k]
        engine.data.ctrl[:4] = np.array([1.0, -1.0, -1.0, 1.0]) * (
            1 if k * every % 0.04 < 0.02 else -1
        )
        step(engine)
        off = max(off, np.abs(engine.data.qpos[7:] - plan[k + 1]).max())
        fastest = max(fastest, float(np.linalg.norm(engine.data.qacc[3:5])))
    assert fastest > 100.0
    assert off < 1.15 * fastest * every**2 / 0.09


@pytest.mark.parametrize("inertia", [(2e-3, 2e-3, 4e-3), (1e-3, 7e-3, 8e-3)])
def test_a_flat_body_is_the_limit(inertia: tuple[float, float, float]) -> None:
    engine = Engine(PAPER.replace(inertia=inertia))
    moments = engine.model.body_inertia[1] + 4 * engine.model.body_inertia[2]
    np.testing.assert_allclose(np.sort(moments), np.sort(inertia), rtol=5e-6)
    with pytest.raises(InputError, match="is not that of a rigid body"):
        Engine(PAPER.replace(inertia=(*inertia[:2], 1.0005 * inertia[2])))
    with pytest.raises(InputError, match="for four arms is not that of a rigid body"):
        Engine(PAPER.replace(inertia=inertia, arm_inertia=1e-5))


class TestWarnings:
    """The engine writes a file into the working folder when something is too fast, unless they are collected."""

    @staticmethod
    def diverge(engine: Engine) -> None:
        engine.place(np.zeros(4))
        engine.data.ctrl[0] = 9e9
        step(engine)

    def test_they_are_written_nowhere(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.chdir(tmp_path)
        engine, calm = Engine(PAPER), Engine(PAPER)
        before = engine.mujoco.get_mju_user_warning()
        calm.place(np.zeros(4))
        with engine_warnings():
            self.diverge(engine)
            step(calm)
        assert engine.gave_up
        assert not calm.gave_up
        assert list(tmp_path.iterdir()) == []
        assert engine.mujoco.get_mju_user_warning() is before
        engine.place(np.zeros(4))
        assert not engine.gave_up

    def test_flights_that_overlap_do_not_disturb_each_other(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """The flight that began first is over first, as it may be in another thread."""
        monkeypatch.chdir(tmp_path)
        engine = Engine(PAPER)
        before = engine.mujoco.get_mju_user_warning()
        first, second = engine_warnings(), engine_warnings()
        first.__enter__()
        second.__enter__()
        first.__exit__(None, None, None)
        self.diverge(engine)
        second.__exit__(None, None, None)
        assert engine.mujoco.get_mju_user_warning() is before
        assert list(tmp_path.iterdir()) == []
