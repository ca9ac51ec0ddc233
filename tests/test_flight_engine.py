"""The engine against the package's matrices, and against mechanics derived here without it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gaitgraph.errors import InputError
from gaitgraph.flight.engine import Engine, engine_warnings
from gaitgraph.invertibility.matrices import control_force_matrix, control_moment_matrix
from gaitgraph.vehicle import PAPER, Vehicle
from tests.samples import BEETLE, random_vehicle

if TYPE_CHECKING:
    from pathlib import Path

pytest.importorskip("mujoco")

RNG = np.random.default_rng(7)


def drawn_vehicle(height: float = 0.0, arm_share: float = 0.0) -> Vehicle:
    """Return a vehicle with random constants; its arms have a share of its least inertia."""
    mass = 10 ** RNG.uniform(-1.5, 2.0)
    length = 10 ** RNG.uniform(-1.0, 0.5)
    sides = RNG.uniform(0.2, 1.0, 3) ** 2
    inertia = 0.1 * mass * length**2 * (sides.sum() - sides)
    return random_vehicle(RNG).replace(
        mass=mass,
        gravity=RNG.uniform(1.0, 20.0),
        arm_length=length,
        inertia=tuple(inertia),
        thrust_coefficient=10 ** RNG.uniform(-7, -4),
        rotor_height=height * length,
        arm_inertia=arm_share * min(inertia) or None,
    )


VEHICLES = [
    PAPER,
    BEETLE,
    drawn_vehicle(),
    drawn_vehicle(arm_share=0.02),
    drawn_vehicle(height=0.3),
    drawn_vehicle(height=-2.0),
    PAPER.replace(rotor_height=0.05, arm_inertia=3e-5),
]


def step(engine: Engine) -> None:
    engine.mujoco.mj_step(engine.model, engine.data)


def accelerations(engine: Engine) -> Any:
    engine.mujoco.mj_forward(engine.model, engine.data)
    return np.array(engine.data.qacc)


@pytest.mark.parametrize("vehicle", VEHICLES)
def test_the_body_obeys_newton_and_euler_when_the_arms_are_held(
    vehicle: Vehicle,
) -> None:
    """With the package's matrices, so its mass, inertia, centre of mass and signs are the vehicle's."""
    mass, moments = vehicle.require("mass", "inertia", purpose="test")
    engine = Engine(vehicle)
    engine.model.dof_armature[6:] = 1e12  # holds the arms
    unit = mass * vehicle.gravity / vehicle.thrust_coefficient
    for _ in range(20):
        alpha = RNG.uniform(-1.5, 1.5, 4)
        inputs = RNG.uniform(-1, 1, 4) * unit
        omega = RNG.normal(size=3) * 3
        roll, pitch, yaw = RNG.uniform(-1.5, 1.5, 3)
        engine.place(alpha, roll=roll, pitch=pitch, yaw=yaw)
        upward = np.sign(control_force_matrix(np.zeros(4), vehicle)[2])
        engine.data.ctrl[:4] = upward * vehicle.thrust_coefficient * inputs
        engine.data.qvel[:3] = RNG.normal(size=3)
        engine.data.qvel[3:6] = omega
        found = accelerations(engine)
        force = control_force_matrix(alpha, vehicle) @ inputs
        torque = control_moment_matrix(alpha, vehicle) @ inputs
        turned = Rotation.from_euler("ZYX", [yaw, pitch, roll]).apply(force)
        linear = turned / mass - [0, 0, vehicle.gravity]
        spin = np.cross(omega, np.multiply(moments, omega))
        angular = (torque - spin) / moments
        off = np.linalg.norm(found[:3] - linear)
        assert off <= 1e-9 * np.linalg.norm(linear)
        off = np.linalg.norm(found[3:6] - angular)
        assert off <= 1e-9 * np.linalg.norm(angular)


def test_a_swinging_arm_pushes_back_on_the_body() -> None:
    """I·ω̇ = −J·α̈ about the arm's axis, summed over all arms; the held ones turn with the body."""
    arm = 1e-4
    inertia = np.array(PAPER.inertia)
    axes = np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])
    engine = Engine(PAPER.replace(arm_inertia=arm))
    for k, axis in enumerate(axes):
        engine.place(np.zeros(4))
        engine.data.ctrl[4 + k] = 1e-3
        found = accelerations(engine)
        swing = found[6:] @ axes
        assert swing @ axis == pytest.approx(found[6 + k], rel=0.2)
        assert found[6 + k] > 10.0
        assert found[3:5] * inertia[:2] == pytest.approx(-arm * swing, rel=1e-9)


@pytest.mark.parametrize("every", [1e-3, 5e-4])
@pytest.mark.parametrize("arm_inertia", [None, 1e-4])
def test_hinges_are_where_they_are_planned(
    arm_inertia: float | None, every: float
) -> None:
    """Exactly, but for what the body's own angular acceleration ω̇ does to an arm: up to |ω̇|·step²/0.09."""
    engine = Engine(PAPER.replace(arm_inertia=arm_inertia), step=every)
    t = every * np.arange(round(0.2 / every) + 1)
    plan = np.sin(2 * math.pi * t[:, None] + np.arange(4)) * [1.0, 0.5, 0.7, -0.9]
    engine.place(plan[0], rates=(plan[1] - plan[0]) / every)
    engine.data.ctrl[:4] = [1.0, -1.0, -1.0, 1.0]
    fastest = 0.0
    for k, command in enumerate(engine.servo_commands(plan)):
        engine.data.ctrl[4:] = command
        if k % 20 == 0:
            engine.data.ctrl[:4] *= -1
        step(engine)
        spin = float(np.linalg.norm(engine.data.qacc[3:5]))
        fastest = max(fastest, spin)
        off = np.abs(engine.data.qpos[7:] - plan[k + 1]).max()
        assert off < 1.15 * fastest * every**2 / 0.09
    assert fastest > 100.0


@pytest.mark.parametrize("inertia", [(2e-3, 2e-3, 4e-3), (1e-3, 7e-3, 8e-3)])
def test_a_flat_body_is_the_limit(inertia: tuple[float, float, float]) -> None:
    engine = Engine(PAPER.replace(inertia=inertia))
    moments = engine.model.body_inertia[1] + 4 * engine.model.body_inertia[2]
    assert sorted(moments) == pytest.approx(sorted(inertia), rel=5e-6)
    for changes in (
        {"inertia": (*inertia[:2], 1.0005 * inertia[2])},
        {"inertia": inertia, "arm_inertia": 1e-5},
    ):
        with pytest.raises(InputError, match="must be that of a rigid body"):
            Engine(PAPER.replace(**changes))


def test_warnings_are_written_nowhere_also_when_flights_overlap(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The engine writes a file into the working folder when something is too fast, unless they are collected."""
    monkeypatch.chdir(tmp_path)
    engine = Engine(PAPER)
    before = engine.mujoco.get_mju_user_warning()
    first = engine_warnings()
    first.__enter__()
    with engine_warnings():
        first.__exit__(None, None, None)  # as it may be in another thread
        engine.place(np.zeros(4))
        step(engine)
        gave_up = [engine.gave_up]
        engine.data.ctrl[0] = 9e9
        step(engine)
        gave_up.append(engine.gave_up)
    assert gave_up == [False, True]
    assert engine.mujoco.get_mju_user_warning() is before
    assert list(tmp_path.iterdir()) == []
