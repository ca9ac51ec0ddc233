"""Flights of vehicles with axes of their own: their model in the engine, and a gait on their curved sheet."""

from __future__ import annotations

import json
import math
import re
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import gaitgraph as gg
from gaitgraph.flight.engine import mjcf_of
from gaitgraph.flight.simulation import gyroscopic_of
from gaitgraph.invertibility.matrices import (
    control_force_matrix,
    control_moment_matrix,
)
from gaitgraph.surface.curved_region import sheet_region
from gaitgraph.vehicle import PAPER
from tests.samples import BOTH, LEANING, STANDING, by_vehicle

if TYPE_CHECKING:
    from pathlib import Path

mujoco = pytest.importorskip("mujoco")
RNG = np.random.default_rng(3)
FLYING = [
    vehicle.replace(inertia=[0.02, 0.025, 0.03], thrust_coefficient=8e-6)
    for vehicle in (LEANING, STANDING)
]


@pytest.mark.parametrize("vehicle", FLYING)
@pytest.mark.parametrize("arm_inertia", [None, 1e-5])
def test_the_engine_gives_forces_and_moments_of_the_matrices(
    vehicle: gg.Vehicle, arm_inertia: float | None
) -> None:
    vehicle = vehicle.replace(arm_inertia=arm_inertia)
    engine = gg.flight.Engine(vehicle)
    alpha, thrusts = RNG.uniform(-0.8, 0.8, 4), RNG.uniform(1, 4, 4)
    engine.place(alpha)
    engine.data.ctrl[:4] = thrusts
    engine.mujoco.mj_forward(engine.model, engine.data)
    inputs = thrusts / 8e-6 * vehicle.spin_signs
    force = control_force_matrix(alpha, vehicle) @ inputs
    moment = control_moment_matrix(alpha, vehicle) @ inputs
    mass = vehicle.mass or 0.0
    weight = np.array([0, 0, mass * vehicle.gravity])
    acceleration = engine.data.qacc
    np.testing.assert_allclose(
        mass * acceleration[:3] + weight, force, rtol=1e-3, atol=1e-4
    )
    # Arms without a stated inertia hardly turn with their hinges; others do.
    tolerance = 1e-4 if arm_inertia is None else 0.02
    np.testing.assert_allclose(
        acceleration[3:6] * vehicle.inertia, moment, atol=tolerance
    )


@pytest.mark.parametrize("vehicle", FLYING)
def test_a_gait_on_the_sheet_settles_and_the_model_reads_back(
    vehicle: gg.Vehicle, tmp_path: Path, run: Any
) -> None:
    region = sheet_region(vehicle)
    place = region.components[0].representative_point()
    size = 0.3 * place.distance(region.inner.boundary)
    corners = [(place.x, place.y), (place.x + size, place.y)]
    corners.append((place.x + size, place.y + size))
    plan = gg.plan_loop(corners, vehicle=vehicle, sign="positive", period=3.0)
    flight = gg.fly(plan.timed())
    assert flight.settled

    plan.timed().write(tmp_path / "gait.json")
    model = tmp_path / "own.xml"
    toml = tmp_path / "own.toml"
    constants = vehicle.as_mapping()
    del constants["drag_ratio"]
    lines = [f"{name} = {json.dumps(value)}" for name, value in constants.items()]
    toml.write_text("\n".join(lines), encoding="utf-8")
    assert run("vehicles", toml, "--output", model).code == 0
    again = run("vehicles", "--from", model)
    assert again.code == 0
    back = tmp_path / "back.toml"
    back.write_text(again.out, encoding="utf-8")
    read = gg.vehicle_named(str(back))
    for mine, theirs in zip(vehicle.axes, read.axes, strict=True):
        np.testing.assert_allclose(theirs, mine, atol=1e-5)
    assert gg.validate(tmp_path / "gait.json", vehicle=read).flyable


@by_vehicle(PAPER, BOTH, *FLYING)
def test_gyroscopic_torques_are_those_of_spinning_rotors_in_the_engine(
    vehicle: gg.Vehicle,
) -> None:
    """Inverse dynamics of the same model with a body that spins on each arm, with and without its spin."""
    inertia = 1e-5
    vehicle = vehicle.replace(rotor_inertia=inertia)
    text = mjcf_of(vehicle, step=1e-3, air=False)
    spinning = f"""<body pos="REACH 0 0">
    <inertial pos="0 0 0" mass="1e-3" diaginertia="{inertia} {inertia} {inertia}"/>
    <joint name="spin" axis="0 0 1"/></body>"""
    parts = re.split(r'(?=<site name="rotor\d" pos="(\S+) )', text)
    text = parts[0]
    for number, (reach, site) in enumerate(
        zip(parts[1::2], parts[2::2], strict=True), start=1
    ):
        body = spinning.replace("REACH", reach).replace("spin", f"spin{number}")
        text += body + site
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    alpha, rates, thrusts = RNG.normal(size=(3, 4))
    omega = RNG.normal(size=3)
    speeds = vehicle.spin_signs * np.sign(thrusts) * np.sqrt(np.abs(thrusts))
    speeds /= math.sqrt(vehicle.thrust_coefficient or 0.0)
    torques = []
    for share in (0.0, 1.0):
        data.qpos[7::2] = alpha
        data.qvel[3:6], data.qvel[6::2], data.qvel[7::2] = omega, rates, share * speeds
        data.qacc[:] = 0.0
        mujoco.mj_inverse(model, data)
        torques.append(data.qfrc_inverse[3:6].copy())
    torque_of = gyroscopic_of(vehicle)
    assert torque_of is not None
    # The torque that keeps the body from turning faster is against that of its rotors.
    expected = torques[0] - torques[1]
    torque = torque_of(*(part.tolist() for part in (alpha, omega, rates, thrusts)))
    np.testing.assert_allclose(torque, expected, atol=1e-12, rtol=1e-9)
    many = (np.tile(part, (2, 1)).T for part in (alpha, omega, rates, thrusts))
    of_two = gyroscopic_of(vehicle, np)
    assert of_two is not None
    np.testing.assert_allclose(np.transpose(of_two(*many)), [torque] * 2, rtol=1e-12)
