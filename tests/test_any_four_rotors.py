"""Vehicles whose rotors stand anywhere: roots, graphs, colourings, checks, commands, and what is refused by name."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import gaitgraph as gg
from gaitgraph.certificates.verifying import note_on_certificate
from gaitgraph.graph import validate_graph
from gaitgraph.invertibility import attitude_sensitivities
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.invertibility.geometry import Geometry
from gaitgraph.surface.sheets import curved_roots
from tests.samples import (
    BOTH,
    EVERY_KIND,
    LEANING,
    ODD,
    STANDING,
    by_vehicle,
    small_gait,
)

if TYPE_CHECKING:
    from pathlib import Path
LOOP = [(0.4, -0.4), (0.4, -1.0), (1.0, -1.0), (1.0, -0.4)]
ROWS = np.array(
    [[-0.3, 0.3, -0.3, 0.3], [-0.4, 0.3, -0.4, 0.3], [-0.4, 0.5, -0.4, 0.5]]
)


# -- Surfaces


@by_vehicle(*EVERY_KIND[3:], STANDING)
def test_roots_are_those_of_an_independent_search(vehicle: gg.Vehicle) -> None:
    """Of two roots one is singular at every attitude, and a fine grid has no other."""
    exact = coefficients_of(vehicle, "exact")
    axis = np.linspace(-math.pi / 2, math.pi / 2, 401, endpoint=False)
    grid = np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1)
    plane = np.random.default_rng(7).uniform(-1.3, 1.3, (6, 2))
    arrays = gg.surface.root_arrays(plane[:, 0], plane[:, 1], vehicle=vehicle)
    size = exact.form.size.max()
    for point, alone, count in zip(plane, arrays.alpha, arrays.count, strict=True):
        roots = gg.roots(*point.tolist(), vehicle=vehicle)
        assert [root.color for root in roots] == ["red", "none"]
        expected = [root.alpha for root in roots][:count]
        np.testing.assert_allclose(alone[:count], expected, atol=1e-12)
        assert count == 2 or not exact.rotors.asymmetry
        for root in roots:
            assert max(abs(root.R_phi), abs(root.R_theta)) < 1e-9 * size
        assert abs(roots[1].R) < 1e-9 * size < abs(roots[0].R)
        alpha = np.concatenate([np.broadcast_to(point, grid.shape), grid], axis=-1)
        v = attitude_sensitivities(alpha, exact)
        zeros = grid[np.hypot(v[..., 0], v[..., 1]) < 1e-3 * size]
        off = zeros[:, None] - [root.alpha[2:] for root in roots]
        off -= math.pi * np.rint(off / math.pi)
        assert (np.abs(off).max(axis=2).min(axis=1) < 0.2).all()


@pytest.mark.parametrize("sign", ["positive", "negative"])
@by_vehicle(ODD, LEANING)
def test_a_graph_keeps_its_contract_and_its_edges_are_those_of_the_physics(
    vehicle: gg.Vehicle, sign: Any
) -> None:
    waypoints = [(0.11, 0.23)]
    graph = gg.surface_graph(sign, divisions=10, vehicle=vehicle, waypoints=waypoints)
    validate_graph(graph)
    assert all("types" not in data for _, data in graph.nodes(data=True))
    geometry, flyable = Geometry.of_vehicle(vehicle), 0
    sheet, shares = gg.surface.curved_sheet(vehicle), np.linspace(0, 1, 801)[:, None]
    alpha = {
        name: np.array([data[f"alpha{k}"] for k in range(1, 5)])
        for name, data in graph.nodes(data=True)
    }
    for a, b, data in graph.edges(data=True):
        plane = alpha[a][:2] + shares * (alpha[b] - alpha[a])[:2]
        opposite = np.unwrap(sheet.angles(*plane.T), axis=0, period=np.pi)
        opposite += alpha[a][2:] - opposite[0]
        if np.abs(np.diff(opposite, axis=0)).max() > 0.1:
            continue  # it turns beside a fibre, too fast for these samples
        jump = np.abs(opposite[-1] - alpha[b][2:]).max()
        assert data["jump"] == pytest.approx(np.rint(jump / np.pi) * np.pi)
        rows = np.hstack([plane, opposite])
        if data["least_singular_value"]:
            least = geometry.least_singular_value(rows).min()
            assert least == pytest.approx(data["least_singular_value"], abs=2e-3)
        if data["flyable"]:
            flyable += 1
            assert gg.validate(rows[:400:40], vehicle=vehicle).flyable
    assert flyable > 20 or sign == "negative"


def test_a_loop_is_colored_red_where_R_has_one_sign() -> None:
    exact = coefficients_of(ODD, "exact")
    for loop in np.random.default_rng(4).uniform(-0.5, 0.5, (8, 5, 2)):
        red, _ = curved_roots(loop[:, 0], loop[:, 1], exact)
        R = attitude_sensitivities(red, exact)[:, 2]
        answer = gg.colorings(loop, vehicle=ODD)
        assert answer.counts["positive"] == (R > 0).all()
        assert answer.counts["negative"] == (R < 0).all()
        assert not answer or {*answer.first[0].colors} == {"red"}


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


# -- Judged and flown


def test_every_form_of_a_gait_is_judged_by_physics() -> None:
    gait = gg.Gait(alpha=ROWS, vehicle=ODD)
    of_rows = gg.validate(ROWS, vehicle=ODD)
    for report in (gg.validate(gait), gg.validate(gait.parametrize(2.0)), of_rows):
        assert (report.valid, report.two_color, report.flyable) == (None, None, True)
        assert report.hover_thrusts is not None
    rows = np.column_stack([np.linspace(0, 0.1, 5)] * 4)
    least = Geometry.of_vehicle(LEANING).least_singular_value(rows).min()
    value = gg.validate(rows, vehicle=LEANING)["least_singular_value"].value
    assert value == pytest.approx(least, abs=1e-3)
    assert not gg.validate(ROWS - [0.0, 0.9, 0.0, 0.9], vehicle=ODD)


@pytest.mark.parametrize(
    ("limit", "name"),
    [
        ({"max_thrust": 4.0}, "thrust_limit"),
        ({"max_tilt": "20deg"}, "tilt_range"),
        ({"max_tilt_rate": [9, 0.01, 9, 9]}, "tilt_rate"),
    ],
)
def test_every_limit_of_a_vehicle_is_judged(limit: dict[str, Any], name: str) -> None:
    gait = gg.Gait(alpha=ROWS, vehicle=ODD.replace(**limit))
    report = gg.validate(gait.parametrize(2.0))
    assert [check.name for check in report.checks if not check.ok] == [name]


def test_a_table_that_is_run_once_is_judged_without_a_segment_back() -> None:
    geometry = Geometry.of_vehicle(gg.PAPER)
    rows = [[0.0] * 4, [-0.8, 0.8, -0.8, 0.8]]
    for once in (False, True):
        report = gg.validation.validate_geometry(rows, geometry, once=once)
        assert report.as_mapping()["repeats"] == (not once)
    with pytest.raises(gg.errors.InputError, match="geometry must be a Geometry"):
        gg.validation.validate_geometry(rows, "paper")  # type: ignore[arg-type]


# -- Refused


@pytest.mark.parametrize(
    "make",
    [
        lambda: gg.admissible_region(ODD, require="valid"),
        lambda: gg.admissible_region(ODD, color="blue"),
        lambda: gg.optimal_gait(LOOP, vehicle=ODD),
        lambda: gg.planning.Replanner(ODD),
    ],
)
def test_planes_are_refused_with_the_pair_that_differs(make: Any) -> None:
    with pytest.raises(gg.InputError, match="rotors 1 and 3") as caught:
        make()
    assert caught.value.field == "vehicle"


def test_points_are_lifted_to_the_curved_sheet() -> None:
    table = {"alpha1": [-0.4, -0.4, -1.0], "alpha2": [0.4, 1.0, 0.4], "color": "red"}
    assert gg.validate(table, vehicle=ODD).flyable
    alpha = gg.gait_of(table, vehicle=ODD).alpha
    assert gg.surface.curved_sheet(ODD).distances(alpha).max() < 1e-12
    with pytest.raises(gg.InputError, match="colors must be red"):
        gg.validate(table | {"color": "blue"}, vehicle=ODD)
    with pytest.raises(gg.InputError, match="colors must be red"):
        gg.lift(LOOP, "blue", vehicle=ODD)


@by_vehicle(LEANING, BOTH.replace(spins=["clockwise"] * 4))
def test_a_certificate_belongs_to_the_axes_and_spins_of_its_vehicle(
    vehicle: gg.Vehicle, tmp_path: Path
) -> None:
    timed = small_gait(vehicle).parametrize(3.0, samples=100)
    certified = gg.certify(timed)
    path = tmp_path / "gait.csv"
    timed.write(path)
    certified.write(tmp_path / "gait.cert.json")
    verified = gg.certificates.verify(tmp_path / "gait.cert.json")
    assert (bool(verified), verified.flyable, verified.rows) == (True, True, 101)
    table = gg.read_table(path)
    assert not note_on_certificate(path, table, vehicle)
    leaning = vehicle.replace(tilt_axes=np.add(vehicle.axes[0], [0, 0, 0.1]))
    note = note_on_certificate(path, table, leaning)
    assert "is of another vehicle: moments of rotors differ" in note


@pytest.mark.parametrize("turned", [False, True])
def test_rotors_whose_angles_turn_the_other_way_are_named(turned: bool) -> None:
    rotors = Geometry.of_vehicle(gg.PAPER)
    axes = rotors.tilt_axis * [[1], [1], [-1 if turned else 1], [1]]
    geometry = replace(rotors, tilt_axis=axes)
    report = gg.validation.validate_geometry(np.zeros((2, 4)), geometry)
    assert ("of rotors 3:" in str(report.notes)) is turned
