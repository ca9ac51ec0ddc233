"""Flights of vehicles with axes of their own: their model in the engine, and a gait on their curved sheet."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import gaitgraph as gg
from gaitgraph.flight.simulation import gyroscopic_of
from gaitgraph.invertibility.matrices import (
    control_force_matrix,
    control_moment_matrix,
)
from gaitgraph.surface.curved_region import sheet_region
from tests.samples import LEANING, STANDING

if TYPE_CHECKING:
    from pathlib import Path

pytest.importorskip("mujoco")
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


def test_gyroscopic_torques_need_the_default_axes() -> None:
    vehicle = FLYING[0].replace(rotor_inertia=1e-5)
    with pytest.raises(gg.InputError, match="tilt_axes must be omitted for flights"):
        gyroscopic_of(vehicle)
