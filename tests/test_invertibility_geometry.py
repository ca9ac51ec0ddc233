"""Rotors of any geometry: against numpy and the four-arm functions."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import gaitgraph as gg
from gaitgraph.invertibility.geometry import (
    LEAST_DECIDED,
    Geometry,
    geometry_from_mapping,
)
from gaitgraph.invertibility.matrices import (
    control_force_matrix,
    control_moment_matrix,
    hover_thrust_shares,
    least_singular_value,
    thrust_signs,
    zero_moment_direction,
)

if TYPE_CHECKING:
    from gaitgraph.invertibility.forms import FloatArray

RNG = np.random.default_rng(18)
START = RNG.bit_generator.state
PAPER = gg.PAPER
VEHICLES = [
    PAPER,
    PAPER.replace(
        first_arm_angle=0.7, first_rotor_spin="counterclockwise", rotor_height=0.06
    ),
]


@pytest.fixture(autouse=True)
def _the_same_numbers_whatever_ran_before() -> None:
    RNG.bit_generator.state = START


def drawn(count: int) -> Geometry:
    """Return a random geometry; its first rotor does not tilt."""
    tilt_axis = RNG.normal(size=(count, 3))
    tilt_axis[0] = 0.0
    return Geometry(
        position=RNG.normal(scale=0.3, size=(count, 3)),
        moment_ratio=RNG.normal(scale=0.05, size=count),
        thrust_axis=RNG.normal(size=(count, 3)),
        tilt_axis=tilt_axis,
        tilt_range=np.tile([-6.0, 6.0], (count, 1)),
    )


def wrench(geometry: Geometry, alpha: FloatArray) -> FloatArray:
    """Return force and moment per thrust, shape (6, N), rotor by rotor, with rotations of scipy."""
    columns = []
    for k, angle in enumerate(alpha):
        direction = Rotation.from_rotvec(angle * geometry.tilt_axis[k]).apply(
            geometry.thrust_axis[k].copy()
        )
        moment = (
            np.cross(geometry.position[k], direction)
            - geometry.moment_ratio[k] * direction
        )
        columns.append(np.concatenate([direction, moment]))
    return np.array(columns).T


@pytest.mark.parametrize("count", [1, 3, 4, 6, 8])
def test_matrices_by_brute_force(count: int) -> None:
    for _ in range(50):
        geometry, alpha = drawn(count), RNG.uniform(-4, 4, count)
        both = wrench(geometry, alpha)
        force, moment = geometry.force_matrix(alpha), geometry.moment_matrix(alpha)
        np.testing.assert_allclose(np.vstack([force, moment]), both, atol=1e-13)
        level = np.vstack(
            [both[3:] / np.hypot(*geometry.position[:, :2].T).mean(), both[2:3]]
        )
        expected = np.linalg.svd(level, compute_uv=False)
        least = float(geometry.least_singular_value(alpha))
        assert least == pytest.approx(expected[3] if count >= 4 else 0.0, abs=1e-12)
        if least > 1e-3:
            thrusts, short = geometry.hover_thrusts(alpha), np.linalg.pinv(level)[:, 3]
            np.testing.assert_allclose(level @ thrusts, [0, 0, 0, 1], atol=1e-8)
            if count == 4 or short.min() >= 0.5 / count:
                np.testing.assert_allclose(thrusts, short, atol=1e-8)
            elif (
                thrusts.min() < 1
            ):  # no thrusts beside it, along the null space, have a larger least
                null = np.linalg.svd(level)[2][4:]
                for step in RNG.normal(scale=0.1, size=(200, count - 4)) @ null:
                    assert (thrusts + step).min() <= thrusts.min() + 1e-9
        thrusts, forces = geometry.zero_moment_directions(alpha)
        assert len(thrusts) == max(count - 3, 0)
        np.testing.assert_allclose(both[3:] @ thrusts.T, 0.0, atol=1e-13)
        np.testing.assert_allclose(forces, thrusts @ both[:3].T, atol=1e-13)


@pytest.mark.parametrize("vehicle", VEHICLES, ids=["paper", "turned, mirrored, high"])
def test_four_arms_as_the_four_arm_functions(vehicle: gg.Vehicle) -> None:
    geometry, alpha = Geometry.of_vehicle(vehicle), RNG.uniform(-1.5, 1.5, (200, 4))
    per_thrust = thrust_signs(vehicle) / np.array(
        vehicle.require("thrust_coefficient", purpose="the test")
    )
    for found, expected in (
        (
            geometry.force_matrix(alpha),
            control_force_matrix(alpha, vehicle) * per_thrust,
        ),
        (
            geometry.moment_matrix(alpha),
            control_moment_matrix(alpha, vehicle) * per_thrust,
        ),
        (geometry.least_singular_value(alpha), least_singular_value(alpha, vehicle)),
    ):
        np.testing.assert_allclose(found, expected, atol=1e-12)
    red = np.tile(RNG.uniform(-1.2, 1.2, (100, 2)), 2)
    red = red[least_singular_value(red, vehicle) > 1e-2]
    np.testing.assert_allclose(
        geometry.hover_thrusts(red), hover_thrust_shares(red, vehicle), atol=1e-9
    )
    for row in alpha[:20]:
        (force,) = geometry.zero_moment_directions(row)[1]
        np.testing.assert_allclose(
            np.cross(force, zero_moment_direction(row, vehicle)), 0.0, atol=1e-12
        )


@pytest.mark.parametrize("count", [4, 6, 8])
def test_brackets_between_rows_hold(count: int) -> None:
    fractions = np.linspace(0, 1, 2001)[:, None]
    for _ in range(12):
        geometry, starts, ends = drawn(count), *RNG.uniform(-2, 2, (2, 3, count))
        found = geometry.least_singular_value_along(starts, ends)
        along = [
            geometry.least_singular_value(p + fractions * (q - p))
            for p, q in zip(starts, ends, strict=True)
        ]
        low, high, segment, fraction = found.worst()
        assert 0 <= high - low <= 1e-4
        assert (found.lower <= np.min(along, axis=1) + 1e-12).all()
        assert high <= np.min(along) + 1e-4
        at = starts[segment] + fraction * (ends - starts)[segment]
        assert high == pytest.approx(
            float(geometry.least_singular_value(at)), abs=1e-12
        )


@pytest.mark.parametrize(("count", "draws"), [(4, 60), (6, 8)])
def test_hover_thrusts_between_rows(count: int, draws: int) -> None:
    fractions, decided = np.linspace(0, 1, 61)[:, None], []
    turns = 2 * math.pi * np.arange(count) / count
    outward = np.stack([np.cos(turns), np.sin(turns), 0 * turns], axis=1)
    for _ in range(draws):
        star = Geometry(
            position=0.3 * outward,
            moment_ratio=np.asarray(
                RNG.uniform(0.03, 0.2) * (-1.0) ** np.arange(count), dtype=float
            ),
            thrust_axis=np.tile([0.0, 0.0, 1.0], (count, 1)),
            tilt_axis=outward,
            tilt_range=np.tile([-2.0, 2.0], (count, 1)),
        )
        starts = np.tile(RNG.uniform(-0.4, 0.4, 2), count // 2)[None]
        step = RNG.normal(scale=0.3, size=(1, count))
        if (
            star.least_singular_value_along(starts, starts + step).lower.min()
            < LEAST_DECIDED
        ):
            continue
        found = star.least_hover_thrust_along(starts, starts + step)
        least = star.hover_thrusts(starts + fractions * step).min()
        assert found.lower[0] <= least + 1e-9
        assert (found.lower[0] >= 0) == (least > 0) or abs(least) < 1e-3
        decided.append(bool(least > 0))
    assert {True, False} == set(decided)


ROTOR = {"position": [0.2, 0, 0], "moment_ratio": 0.02}


def test_a_mapping_has_defaults_and_angles_as_texts() -> None:
    one, two = geometry_from_mapping(
        {"rotor": [ROTOR, {**ROTOR, "tilt_range": ["-90deg", "pi/4"]}]}
    ).tilt_range
    assert one.tolist() == [-math.inf, math.inf]
    np.testing.assert_allclose(two, [-math.pi / 2, math.pi / 4])


@pytest.mark.parametrize(
    ("stated", "message"),
    [
        ({}, "rotor must be a list of tables"),
        ({"rotor": []}, "rotor must be a list of tables"),
        ({"rotor": [3]}, "rotor 1 must be a table"),
        ({"rotor": [{**ROTOR, "kappa": 1}]}, "rotor 1 has no field 'kappa'"),
        ({"rotor": [{"position": [0.2, 0, 0]}]}, "moment_ratio must be numbers"),
        ({"rotor": [{**ROTOR, "position": [0.2, 0]}]}, "position must be numbers"),
        ({"rotor": [{**ROTOR, "position": [0.2, "x", 0]}]}, "position must be numbers"),
        (
            {"rotor": [{**ROTOR, "position": [0.2, 1e4, 0]}]},
            "position must be numbers within ±1000",
        ),
        (
            {"rotor": [{**ROTOR, "thrust_axis": [0, 0, 0]}]},
            "thrust_axis of rotor 1 must not be zero",
        ),
        (
            {"rotor": [ROTOR, {**ROTOR, "tilt_range": [1, 1]}]},
            "tilt_range of rotor 2 must be two increasing angles",
        ),
        ({"rotor": [{**ROTOR, "tilt_range": [1]}]}, "tilt_range must be numbers"),
        (
            {"rotor": [{**ROTOR, "position": [0, 0, 1]}]},
            "position must have a rotor at least 1e-6 m away",
        ),
    ],
)
def test_refused(stated: dict[str, Any], message: str) -> None:
    with pytest.raises(gg.InputError, match=message):
        geometry_from_mapping(stated)
