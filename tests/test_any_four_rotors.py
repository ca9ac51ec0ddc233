"""Surfaces of vehicles that no half turn maps to themselves: roots, their graph, and colourings."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import networkx as nx
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import gaitgraph as gg
from gaitgraph.graph import validate_graph
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.invertibility.geometry import Geometry
from gaitgraph.invertibility.matrices import (
    attitude_sensitivities,
    scaled_decoupling_matrix,
)
from gaitgraph.surface.sheets import curved_roots

if TYPE_CHECKING:
    from pathlib import Path

RNG = np.random.default_rng(4)


def random_vehicle() -> gg.Vehicle:
    cross = np.array([[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0.0]]) * 0.3
    places = cross + RNG.normal(0, 0.05, (4, 3))
    drags = RNG.uniform(0.01, 0.06, 4)
    return gg.Vehicle(
        mass=1.2, rotor_positions=places.tolist(), drag_to_thrust=drags.tolist()
    )


def vehicle_of_any_axes() -> gg.Vehicle:
    plain = random_vehicle()
    outward, upward = plain.axes
    return plain.replace(
        tilt_axes=outward + RNG.normal(0, 0.3, (4, 3)),
        thrust_axes=upward + RNG.normal(0, 0.3, (4, 3)),
        spins=RNG.choice(["clockwise", "counterclockwise"], 4).tolist(),
    )


VEHICLES = [random_vehicle() for _ in range(8)]
OF_ANY_AXES = [vehicle_of_any_axes() for _ in range(8)]


@pytest.mark.parametrize("vehicle", VEHICLES[:4] + OF_ANY_AXES[:4])
def test_arrays_of_roots_are_those_of_single_points(vehicle: gg.Vehicle) -> None:
    plane = RNG.uniform(-1.5, 1.5, (3, 5, 2))
    found = gg.surface.root_arrays(plane[..., 0], plane[..., 1], vehicle=vehicle)
    assert found.alpha.shape == (3, 5, 5, 4)
    assert (found.count == 2).all()
    exact = coefficients_of(vehicle, "exact")
    v = attitude_sensitivities(found.alpha[..., :2, :], exact)
    assert np.abs(v[..., :2]).max() < 1e-9 * np.abs(v).max()
    assert np.abs(found.R[..., 1]).max() < 1e-9 * np.abs(v).max()
    for i, j in np.ndindex(3, 5):
        roots = gg.roots(*plane[i, j].tolist(), vehicle=vehicle)
        np.testing.assert_allclose(
            [root.alpha for root in roots], found.alpha[i, j, :2], atol=1e-12
        )
        assert [root.color for root in roots] == ["red", "none"]


def test_the_curved_sheet_of_a_symmetric_vehicle_is_its_plane() -> None:
    plane = RNG.uniform(-1.5, 1.5, (200, 2))
    exact = coefficients_of(gg.PAPER, "exact")
    red, blue = curved_roots(plane[:, 0], plane[:, 1], exact)
    distances = gg.surface.sheet_distances(np.array([red, blue]), exact)
    assert distances[0, :, 0].max() < 1e-9
    assert distances[1, :, 1].max() < 1e-9


@pytest.mark.parametrize("sign", ["positive", "negative"])
@pytest.mark.parametrize("vehicle", VEHICLES[4:6] + OF_ANY_AXES[4:5])
def test_a_graph_keeps_its_contract_and_its_edges_are_those_of_the_physics(
    vehicle: gg.Vehicle, sign: Any
) -> None:
    places = [(0.11, 0.23)]
    graph = gg.surface_graph(sign, divisions=10, vehicle=vehicle, waypoints=places)
    validate_graph(graph)
    again = nx.node_link_graph(nx.node_link_data(graph, edges="links"), edges="links")
    validate_graph(again)
    assert all("types" not in data for _, data in graph.nodes(data=True))
    assert {data["color"] for _, data in graph.nodes(data=True)} == {"red"}
    geometry, flyable = Geometry.of_vehicle(vehicle), 0
    for a, b, data in graph.edges(data=True):
        ends = [
            np.array([graph.nodes[name][f"alpha{k}"] for k in range(1, 5)])
            for name in (a, b)
        ]
        chord = ends[0] + np.linspace(0, 1, 21)[:, None] * (ends[1] - ends[0])
        wraps = np.abs(ends[1] - ends[0]).max() > np.pi / 2
        assert data["continuous"] == (not wraps)
        if data["least_singular_value"]:
            least = geometry.least_singular_value(chord).min()
            assert least >= data["least_singular_value"] - 1e-5
            assert least <= data["least_singular_value"] * 1.05 + 1e-3
        if data["flyable"]:
            flyable += 1
            assert gg.validate(chord[:3], vehicle=vehicle).flyable
    assert flyable > 20 or sign == "negative"


def test_a_loop_is_colored_red_where_R_has_one_sign() -> None:
    for vehicle in VEHICLES:
        loop = RNG.uniform(-0.5, 0.5, (5, 2))
        exact = coefficients_of(vehicle, "exact")
        red, _ = curved_roots(loop[:, 0], loop[:, 1], exact)
        R = attitude_sensitivities(red, exact)[:, 2]
        found = gg.colorings(loop, vehicle=vehicle)
        assert found.counts["positive"] == (R > 0).all()
        assert found.counts["negative"] == (R < 0).all()
        assert {*found.first[0].colors} == {"red"} if found else True


def test_planes_are_refused_with_the_pair_that_differs() -> None:
    with pytest.raises(gg.InputError, match="rotors 1 and 3"):
        gg.admissible_region(VEHICLES[0])
    with pytest.raises(gg.InputError, match="rotors 1 and 3"):
        gg.cycles(gg.surface_graph("positive", vehicle=VEHICLES[0], divisions=4))


def test_a_pair_that_stays_symmetric_has_a_fibre() -> None:
    """Rotors 1 and 3 are opposite: where their moments are parallel, α4 is free."""
    places = [[0.15, 0.2, 0], [-0.15, 0.2, 0], [-0.15, -0.2, 0], [0.2, -0.2, 0]]
    vehicle = gg.Vehicle(mass=1.0, rotor_positions=places, drag_to_thrust=0.016)
    delta = np.arctan(0.016 / 0.25)
    (fiber,) = gg.roots(delta, 0.3, vehicle=vehicle).fibers
    assert (fiber.fixed, fiber.free, fiber.singular) == ("alpha3", "alpha4", False)
    assert fiber.values == pytest.approx((delta,))
    alpha = [[delta, 0.3, *fiber.values, free] for free in (-1.0, -0.3, 0.2, 0.9)]
    v = attitude_sensitivities(alpha, coefficients_of(vehicle, "exact"))
    assert np.abs(v[:, :2]).max() < 1e-12
    assert np.abs(v[:, 2]).min() > 1
    assert gg.roots(delta + 1e-6, 0.3, vehicle=vehicle).fibers == ()


def test_raised_rotors_have_no_copies_of_fibres() -> None:
    vehicle = gg.vehicle_named("beetle_art")
    line, _ = coefficients_of(vehicle, "exact").crossings
    assert len(gg.roots(line, 0.3, vehicle=vehicle).fibers) == 1
    found = gg.roots(line + np.pi / 2, 0.3, vehicle=vehicle)
    assert (found.fibers, len(found)) == ((), 2)


def test_a_table_that_is_run_once_is_judged_without_a_segment_back() -> None:
    rows = [[0.0, 0.0, 0.0, 0.0], [-0.8, 0.8, -0.8, 0.8], [-0.8, -0.5, -0.8, -0.5]]
    geometry = Geometry.of_vehicle(gg.PAPER)
    for once in (False, True):
        report = gg.validation.validate_geometry(rows[:2], geometry, once=once)
        assert report.as_mapping()["repeats"] == (not once)
    broken = gg.validation.validate_geometry([*rows[:2], rows[2], rows[0]], geometry)
    assert not broken.flyable


ODD = gg.Vehicle(
    name="odd",
    mass=1.6,
    thrust_coefficient=8e-6,
    drag_to_thrust=0.016,
    rotor_positions=[
        [0.15, 0.2, 0],
        [-0.15, 0.24, 0],
        [-0.15, -0.24, 0],
        [0.15, -0.2, 0],
    ],
)
RATES = ("tilt_rate", "tilt_acceleration")
ROWS = np.array(
    [[-0.3, 0.3, -0.3, 0.3], [-0.4, 0.3, -0.4, 0.3], [-0.4, 0.5, -0.4, 0.5]]
)


def test_every_form_of_a_gait_is_judged_by_physics() -> None:
    gait = gg.Gait(alpha=ROWS, vehicle=ODD)
    timed = gait.parametrize(2.0)
    names = {"closed", "R_sign", "least_singular_value", "hover_thrust"}
    for report in (
        gg.validate(gait),
        gg.validate(timed),
        gg.validate(ROWS, vehicle=ODD),
        gg.validate(ROWS, vehicle=ODD, coefficients="exact"),
    ):
        assert {check.name for check in report.checks} - {*RATES} == names
        assert (report.valid, report.two_color, report.flyable) == (None, None, True)
        assert bool(report)
        assert report.hover_thrusts is not None
    assert not gg.validate(ROWS - [0.0, 0.9, 0.0, 0.9], vehicle=ODD)
    with pytest.raises(gg.InputError, match="rotors 1 and 3"):
        gg.validate(
            {"alpha1": ROWS[:, 0], "alpha2": ROWS[:, 1], "color": "red"}, vehicle=ODD
        )


@pytest.mark.parametrize(
    ("limit", "check"),
    [
        ({"max_thrust": 4.0}, "thrust_limit"),
        ({"max_tilt": "20deg"}, "tilt_range"),
        ({"max_tilt_rate": [9, 0.01, 9, 9]}, "tilt_rate"),
        ({"max_tilt_acceleration": [9, 9, 0.01, 9]}, "tilt_acceleration"),
    ],
)
def test_every_limit_of_a_vehicle_is_judged(
    limit: dict[str, Any], check: str, tmp_path: Path
) -> None:
    timed = gg.Gait(alpha=ROWS, vehicle=ODD).parametrize(2.0)
    timed.write(tmp_path / "rows.csv")
    tight = ODD.replace(**limit)
    for report in (
        gg.validate(gg.Gait(alpha=ROWS, vehicle=tight).parametrize(2.0)),
        gg.validate(tmp_path / "rows.csv", vehicle=tight),
    ):
        broken = [one.name for one in report.checks if not one.ok]
        assert broken == [check]


def test_commands_refuse_the_vehicle_in_one_line_before_all_else(
    run: Any, tmp_path: Path
) -> None:
    """It is refused before limits are asked for, where planes are needed, and without a warning about the file's motion."""
    saved, colored = tmp_path / "saved.json", tmp_path / "colored.csv"
    gg.export(gg.lift([(-0.4, 0.4), (-0.4, 1.0), (-1.0, 0.4)], "red"), saved, samples=8)
    content = json.loads(saved.read_text())
    content["about"] |= {"vehicle": ODD.as_mapping(), "coefficients": "exact"}
    saved.write_text(json.dumps(content))
    lines = [
        f"{k},{','.join(map(str, row))},red" for k, row in enumerate(ROWS.tolist())
    ]
    colored.write_text("\n".join(["t,alpha1,alpha2,alpha3,alpha4,color", *lines, ""]))
    vehicle = tmp_path / "odd.toml"
    vehicle.write_text(
        "".join(
            f"{name} = {json.dumps(value)}\n"
            for name, value in ODD.as_mapping().items()
            if name != "drag_ratio"
        )
    )
    for words in (
        ("pace", saved),
        *((name, colored, "--vehicle", vehicle) for name in ("pace", "retarget")),
    ):
        answer = run(*words)
        assert (answer.code, answer.out) == (2, ""), words
        (line,) = answer.err.splitlines()
        assert "rotors 1 and 3" in line
    judged = run("validate", saved)
    assert (judged.code, judged.err) == (0, "")
    assert (
        "--require must be flyable" in run("validate", saved, "--require", "valid").err
    )


@pytest.mark.parametrize("vehicle", OF_ANY_AXES)
def test_matrices_of_any_axes_are_those_of_turned_thrusts(vehicle: gg.Vehicle) -> None:
    """Rotations of thrusts about tilt axes, by scipy, against the columns of the package."""
    alpha = RNG.uniform(-1.5, 1.5, 4)
    tilt, thrust = map(np.array, vehicle.axes)  # scipy writes to what it is given
    turns = Rotation.from_rotvec(alpha[:, None] * tilt)
    force = turns.apply(thrust)
    places = np.array(vehicle.rotor_positions)
    drags = np.array(vehicle.drag_to_thrust) * vehicle.spin_signs
    moment = np.cross(places, force) - drags[:, None] * force
    length = np.hypot(places[:, 0], places[:, 1]).mean()
    level = np.vstack([moment.T / length, force[:, 2]])

    # Inputs w thrust with the sign of the spin.
    expected = level * vehicle.spin_signs
    np.testing.assert_allclose(scaled_decoupling_matrix(alpha, vehicle), expected)
    geometry = Geometry.of_vehicle(vehicle)
    np.testing.assert_allclose(geometry.level_matrix(alpha), level, atol=1e-12)
    thrusts = np.linalg.solve(level, [0, 0, 0, 1])
    np.testing.assert_allclose(
        gg.invertibility.hover_thrust_shares(alpha, vehicle), thrusts
    )
    exact = coefficients_of(vehicle, "exact")
    at_zero, R = attitude_sensitivities([np.zeros(4), alpha], exact)[:, 2]
    assert at_zero >= 0
    upright = np.linalg.det(geometry.level_matrix(np.zeros(4)))
    assert np.isclose(R * upright, at_zero * np.linalg.det(level))


def test_vehicles_with_axes_of_their_own_are_judged() -> None:
    vehicle = OF_ANY_AXES[0]
    rows = np.column_stack([np.linspace(0, 0.1, 5)] * 4)
    report = gg.validate(rows, vehicle=vehicle)
    least = Geometry.of_vehicle(vehicle).least_singular_value(rows)
    found = report["least_singular_value"].value
    assert found is not None
    assert found <= least.min() + 1e-9


def test_a_certificate_cannot_state_spins_that_do_not_alternate() -> None:
    pairs = ["clockwise", "clockwise", "counterclockwise", "counterclockwise"]
    vehicle = ODD.replace(spins=pairs)
    with pytest.raises(gg.InputError, match="spins must be omitted for a certificate"):
        gg.certify(gg.Gait(alpha=ROWS, vehicle=vehicle).parametrize(2.0))
