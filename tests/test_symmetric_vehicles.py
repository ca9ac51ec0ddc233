"""Vehicles that a half turn maps to themselves are planned, judged, flown and certified; others are refused by name."""

from __future__ import annotations

import json
import math
import re
import subprocess
import sys
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import gaitgraph as gg
from gaitgraph.certificates import check as checker
from gaitgraph.errors import InputError
from gaitgraph.flight.engine import Engine
from gaitgraph.invertibility import (
    Geometry,
    attitude_sensitivities,
    control_force_matrix,
    control_moment_matrix,
    decoupling_matrix,
    least_singular_value,
)
from gaitgraph.invertibility.matrices import zero_moment_inputs
from gaitgraph.surface import admissible_region
from gaitgraph.surface.sheets import separating_factor

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

COMMON: dict[str, Any] = {
    "mass": 1.6,
    "thrust_coefficient": 8e-6,
    "inertia": (0.02, 0.03, 0.04),
    "max_tilt": "80deg",
    "max_thrust": 9.0,
}
WIDE = gg.Vehicle(
    name="wide X",
    drag_to_thrust=0.016,
    rotor_positions=[
        [0.15, 0.2, 0.0],
        [-0.15, 0.2, 0.0],
        [-0.15, -0.2, 0.0],
        [0.15, -0.2, 0.0],
    ],
    **COMMON,
)
STEPPED = gg.Vehicle(
    name="pairs at two heights",
    drag_to_thrust=[0.016, 0.02, 0.016, 0.02],
    first_rotor_spin="counterclockwise",
    rotor_positions=[
        [0.25, 0.1, 0.03],
        [-0.15, 0.2, -0.01],
        [-0.25, -0.1, 0.03],
        [0.15, -0.2, -0.01],
    ],
    **COMMON,
)
ODD = WIDE.replace(
    name="trapezoid",
    rotor_positions=[
        [0.15, 0.2, 0.0],
        [-0.15, 0.24, 0.0],
        [-0.15, -0.24, 0.0],
        [0.15, -0.2, 0.0],
    ],
)
SYMMETRIC = pytest.mark.parametrize("vehicle", [WIDE, STEPPED], ids=["wide", "stepped"])


def loop_of(vehicle: gg.Vehicle) -> list[tuple[float, float]]:
    side = 1 if vehicle.signed_drag_ratio > 0 else -1
    corners = [(-0.4, 0.4), (-0.4, 1.0), (-1.0, 1.0), (-1.0, 0.4)]
    return [(side * x, side * y) for x, y in corners]


@SYMMETRIC
def test_a_loop_is_planned_and_flyable_at_dense_samples(vehicle: gg.Vehicle) -> None:
    plan = gg.plan_loop(loop_of(vehicle), vehicle=vehicle, period=2.0)
    assert plan.gait is not None
    report = gg.validate(plan.gait)
    assert report.flyable
    assert report.reachable_from_hover
    share = np.linspace(0, 1, 101)[:, None, None]
    alpha = plan.gait.alpha + share * (plan.gait.ends - plan.gait.alpha)
    values = least_singular_value(alpha, vehicle)
    bracket = report["least_singular_value"]
    assert bracket.value == pytest.approx(values.min(), abs=2e-4)
    v = attitude_sensitivities(alpha, vehicle=vehicle)
    assert np.abs(v[..., :2]).max() == 0.0
    # On red the thrusts carry the weight alone, by the matrices in SI units.
    shares = gg.invertibility.hover_thrust_shares(alpha, vehicle)
    inputs = zero_moment_inputs(alpha, vehicle)[..., None]
    moment = control_moment_matrix(alpha, vehicle) @ inputs
    force = control_force_matrix(alpha, vehicle) @ inputs
    assert np.abs(moment).max() < 1e-12 * np.abs(force).max()
    assert np.abs(force[..., :2, :]).max() < 1e-12 * np.abs(force).max()
    assert shares.min() > 0
    assert report["hover_thrust"].value == pytest.approx(shares.min(), abs=2e-4)


@SYMMETRIC
def test_the_region_is_that_of_a_raster(vehicle: gg.Vehicle) -> None:
    region = admissible_region(vehicle, floor=0.1, accuracy=1e-4)
    points = np.random.default_rng(1).uniform(-1.5, 1.5, (4000, 2))
    red = np.concatenate([points, points], axis=1)
    shares = gg.invertibility.hover_thrust_shares(red, vehicle)
    most = vehicle.thrust_share
    assert most is not None
    inside = (shares > 0).all(axis=1) & (shares <= most).all(axis=1)
    inside &= least_singular_value(red, vehicle) >= 0.1
    inside &= np.abs(points).max(axis=1) <= math.radians(80)
    found = region.contains(points)
    assert (found <= inside).all()
    assert (found != inside).mean() < 1e-3


def test_the_engine_agrees_with_the_matrices_of_random_symmetric_vehicles() -> None:
    random = np.random.default_rng(5)
    for _ in range(10):
        first, second = (
            random.uniform([0.1, -0.1], [0.3, 0.2]),
            random.uniform([-0.3, 0.1], [-0.1, 0.3]),
        )
        heights = random.uniform(-0.05, 0.05, 2)
        places = [
            [*first, heights[0]],
            [*second, heights[1]],
            [*-first, heights[0]],
            [*-second, heights[1]],
        ]
        drags = random.uniform(0.005, 0.03, 2)
        vehicle = WIDE.replace(
            rotor_positions=places, drag_to_thrust=[*drags, *drags], max_tilt=None
        )
        alpha = random.uniform(-1.2, 1.2, 4)
        roll, pitch = random.uniform(-0.4, 0.4, 2)
        thrust = random.uniform(2.0, 6.0, 4)
        engine = Engine(vehicle)
        engine.place(alpha, roll=roll, pitch=pitch)
        engine.data.ctrl[:4] = thrust
        engine.mujoco.mj_forward(engine.model, engine.data)
        signs = gg.invertibility.matrices.thrust_signs(vehicle)
        inputs = signs * thrust / COMMON["thrust_coefficient"]
        # What the rotors do to the free body, in the world and about its axes.
        applied = engine.data.qfrc_actuator[:6]
        turned = engine.data.xmat[1].reshape(3, 3)
        force = control_force_matrix(alpha, vehicle) @ inputs
        moment = control_moment_matrix(alpha, vehicle) @ inputs
        np.testing.assert_allclose(applied[:3], turned @ force, atol=1e-9)
        np.testing.assert_allclose(applied[3:], moment, atol=1e-9)
        # The arms are light, and do not quite follow: so far for the accelerations.
        wanted = decoupling_matrix(alpha, vehicle, roll, pitch) @ inputs
        wanted[0] -= vehicle.gravity
        matrix = np.array([[1, math.sin(roll) * math.tan(pitch)], [0, math.cos(roll)]])
        spin = engine.data.qacc[3:6]
        assert engine.data.qacc[2] == pytest.approx(wanted[0], abs=1e-4)
        roll_rate = spin[0] + matrix[0, 1] * spin[1]
        roll_rate += math.cos(roll) * math.tan(pitch) * spin[2]
        pitch_rate = math.cos(roll) * spin[1] - math.sin(roll) * spin[2]
        found = [roll_rate, pitch_rate]
        np.testing.assert_allclose(found, wanted[1:3], rtol=1e-4, atol=1e-3)


@SYMMETRIC
def test_a_gait_is_flown_and_settles(vehicle: gg.Vehicle) -> None:
    gait = gg.plan_loop(loop_of(vehicle), vehicle=vehicle).gait
    assert gait is not None
    flight = gg.fly(gait.parametrize(period=2.0))
    assert flight.settled, flight.reason


@SYMMETRIC
def test_commands_take_the_file_of_a_vehicle(
    vehicle: gg.Vehicle, tmp_path: Path, run: Any
) -> None:
    stated = {
        name: value for name, value in vehicle.as_mapping().items() if name != "name"
    }
    lines = [f"{name} = {json.dumps(value)}" for name, value in stated.items()]
    file = tmp_path / "mine.toml"
    file.write_text("\n".join(lines), encoding="utf-8")
    table, certificate = tmp_path / "gait.csv", tmp_path / "gait.cert.json"
    waypoints: list[str] = []
    for x, y in loop_of(vehicle):
        waypoints += ["--waypoint", f"{x},{y}"]
    plan = ["plan", *waypoints, "--vehicle", str(file), "--period", "2"]
    commands: list[list[Any]] = [
        [*plan, "--output", table],
        ["validate", table],
        ["certify", table, "--output", certificate],
        ["verify", certificate, table],
    ]
    for command in commands:
        assert run(*command).code == 0, command
    proof = [sys.executable, "-I", checker.__file__, str(certificate), str(table)]
    assert subprocess.run(proof, capture_output=True, check=False).returncode == 0


def test_what_is_not_symmetric_is_refused_by_the_pair_that_differs() -> None:
    makers: list[Callable[[], object]] = [
        lambda: gg.lift([(-0.4, 0.4), (-0.4, 1.0)], "red", vehicle=ODD),
        lambda: admissible_region(ODD),
    ]
    for make in makers:
        with pytest.raises(InputError, match="got rotors 1 and 3 at") as caught:
            make()
        assert caught.value.field == "vehicle"


def test_its_table_is_still_judged_by_the_command(tmp_path: Path, run: Any) -> None:
    places = json.dumps([[*place] for place in ODD.rotor_positions or ()])
    file = tmp_path / "odd.toml"
    file.write_text(
        f"drag_to_thrust = 0.016\nrotor_positions = {places}\n", encoding="utf-8"
    )
    table = tmp_path / "table.csv"
    rows = ["alpha1,alpha2,alpha3,alpha4", "0,0,0,0", "-0.2,0.2,-0.2,0.2"]
    table.write_text("\n".join(rows), encoding="utf-8")
    result = run("validate", table, "--vehicle", file)
    assert result.code == 0
    assert "least singular value" in result.out
    # A gait file may state such a vehicle itself.
    vehicle = {"drag_to_thrust": 0.016, "rotor_positions": json.loads(places)}
    content = {"about": {"vehicle": vehicle}, "columns": {}}
    for k, angle in enumerate((-0.2, 0.2, -0.2, 0.2), start=1):
        content["columns"][f"alpha{k}"] = [0.0, angle]  # type: ignore[assignment]
    own = tmp_path / "own.json"
    own.write_text(json.dumps(content), encoding="utf-8")
    assert run("validate", own).code == 0
    limited = file.read_text(encoding="utf-8") + "max_thrust = 4.0\n"
    file.write_text(limited, encoding="utf-8")
    refused = run("validate", table, "--vehicle", file)
    assert (refused.code, "mass" in refused.err) == (2, True)
    file.write_text(limited + "mass = 2.0\n", encoding="utf-8")
    assert "thrust limit" in run("validate", table, "--vehicle", file).out
    value = Geometry.of_vehicle(ODD).least_singular_value([0, 0, 0, 0])
    assert value == pytest.approx(least_singular_value([0, 0, 0, 0], ODD))


@pytest.mark.parametrize(
    "vehicle", [WIDE, STEPPED, ODD], ids=["wide", "stepped", "odd"]
)
def test_roots_are_those_of_an_independent_search(vehicle: gg.Vehicle) -> None:
    random = np.random.default_rng(7)
    third = np.linspace(-math.pi / 2, math.pi / 2, 401, endpoint=False)
    grid = np.stack(np.meshgrid(third, third, indexing="ij"), axis=-1)
    for a1, a2 in random.uniform(-1.3, 1.3, (6, 2)).tolist():
        roots = gg.roots(a1, a2, vehicle=vehicle)
        assert len(roots) == 2
        for root in roots:
            assert max(abs(root.R_phi), abs(root.R_theta)) < 1e-10
        assert sum(abs(root.R) < 1e-10 for root in roots) == 1
        assert roots[0].color == "red"
        alpha = np.concatenate([np.broadcast_to([a1, a2], grid.shape), grid], axis=-1)
        v = attitude_sensitivities(alpha, vehicle=vehicle)
        near = grid[np.hypot(v[..., 0], v[..., 1]) < 5e-3]
        for place in near:
            off = [
                np.abs((place - root.alpha[2:] + math.pi / 2) % math.pi - math.pi / 2)
                for root in roots
            ]
            assert min(one.max() for one in off) < 0.2


def test_the_curve_that_separates_regions_has_signs_and_no_negative_terms() -> None:
    saddle = separating_factor((0, 0), (0.0, -1.55), STEPPED)
    assert saddle is not None
    assert "+ -" not in saddle
    assert re.search(r"1 [−+] [0-9.]+ tan α1 [−+] [0-9.]+ tan α2 [−+]", saddle)


def test_texts_of_export_and_retarget_have_the_warnings_of_their_answers(
    run: Any, tmp_path: Path
) -> None:
    gg.export(
        gg.lift([(-1.3, 1.3), (-1.3, 1.25), (-1.25, 1.3)], "red"), tmp_path / "a.csv"
    )
    for words in (
        ("export", tmp_path / "a.csv", tmp_path / "b.csv", "--force"),
        ("retarget", tmp_path / "a.csv"),
    ):
        (warning,) = run(*words, "--json").json["warnings"]
        assert warning.endswith("the vehicle states no max_thrust")
        assert f"warning: {warning}" in run(*words).out.splitlines()
