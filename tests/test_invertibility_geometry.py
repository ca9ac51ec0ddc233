"""Rotors of any number and geometry, against rotations of scipy and dense sampling, and their files."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from gaitgraph.errors import InputError
from gaitgraph.invertibility.geometry import (
    LEAST_DECIDED,
    Geometry,
    geometry_from_mapping,
)
from gaitgraph.validation.any_rotors import validate_geometry
from tests.test_invertibility_matrices import wrench


def drawn(random: np.random.Generator, count: int) -> Geometry:
    """Return a random geometry; its first rotor does not tilt."""
    tilt_axis = random.normal(size=(count, 3))
    tilt_axis[0] = 0.0
    return Geometry(
        position=random.normal(scale=0.3, size=(count, 3)),
        moment_ratio=random.normal(scale=0.05, size=count),
        thrust_axis=random.normal(size=(count, 3)),
        tilt_axis=tilt_axis,
        tilt_range=np.tile([-6.0, 6.0], (count, 1)),
    )


@pytest.mark.parametrize("count", [1, 3, 4, 6, 8])
def test_any_number_of_rotors(count: int) -> None:
    random = np.random.default_rng(18)
    for _ in range(40):
        geometry, alpha = drawn(random, count), random.uniform(-4, 4, count)
        places, axes = geometry.position, (geometry.tilt_axis, geometry.thrust_axis)
        both = wrench(places, geometry.moment_ratio, *axes, alpha[None])
        force, moment = (part[0] for part in both)
        np.testing.assert_allclose(geometry.force_matrix(alpha), force, atol=1e-13)
        np.testing.assert_allclose(geometry.moment_matrix(alpha), moment, atol=1e-13)
        length = np.hypot(*places[:, :2].T).mean()
        level = np.vstack([moment / length, force[2:]])
        least = float(geometry.least_singular_value(alpha))
        values = np.linalg.svd(level, compute_uv=False)
        assert least == pytest.approx(values[3] if count >= 4 else 0.0, abs=1e-12)
        thrusts, forces = geometry.zero_moment_directions(alpha)
        assert len(thrusts) == max(count - 3, 0)
        np.testing.assert_allclose(moment @ thrusts.T, 0.0, atol=1e-13)
        np.testing.assert_allclose(forces, thrusts @ force.T, atol=1e-13)
        if least <= 1e-3:
            continue
        thrusts, short = geometry.hover_thrusts(alpha), np.linalg.pinv(level)[:, 3]
        np.testing.assert_allclose(level @ thrusts, [0, 0, 0, 1], atol=1e-8)
        if count == 4 or short.min() >= 0.5 / count:
            np.testing.assert_allclose(thrusts, short, atol=1e-8)
        elif thrusts.min() < 1:
            # No thrusts beside it, along the null space, have a larger least.
            null = np.linalg.svd(level)[2][4:]
            steps = random.normal(scale=0.1, size=(200, count - 4)) @ null
            assert ((thrusts + steps).min(axis=1) <= thrusts.min() + 1e-9).all()


@pytest.mark.parametrize("count", [4, 6, 8])
def test_brackets_of_any_rotors_between_rows_hold(count: int) -> None:
    random, s = np.random.default_rng(18), np.linspace(0, 1, 1001)[:, None]
    for _ in range(6):
        geometry, starts, ends = (
            drawn(random, count),
            *random.uniform(-2, 2, (2, 3, count)),
        )
        bracket = geometry.least_singular_value_along(starts, ends)
        pairs = zip(starts, ends, strict=True)
        along = [geometry.least_singular_value(p + s * (q - p)) for p, q in pairs]
        low, high, segment, fraction = bracket.worst()
        assert 0 <= high - low <= 1e-4
        assert (bracket.lower <= np.min(along, axis=1) + 1e-12).all()
        assert high <= np.min(along) + 1e-4
        at = starts[segment] + fraction * (ends - starts)[segment]
        assert high == pytest.approx(
            float(geometry.least_singular_value(at)), abs=1e-12
        )


@pytest.mark.parametrize("apart", [3e-6, 4e-5, -3e-6, -4e-5])
@pytest.mark.parametrize("seed", range(5))
def test_floors_near_the_least_singular_value_are_decided(
    seed: int, apart: float
) -> None:
    random = np.random.default_rng(seed)
    geometry, rows = drawn(random, 6), random.uniform(-0.5, 0.5, (2, 6))
    along = geometry.least_singular_value(np.linspace(rows[0], rows[1], 10_001))
    least = float(along.min())
    floor = least - apart
    check = validate_geometry(rows, geometry, floor=floor, once=True).checks[0]
    assert check.ok is (apart > 0)
    proven = float(check.message.split("bound ")[1].split(",")[0])
    assert -1e-9 < least - proven < 2e-4


@pytest.mark.parametrize(("count", "draws"), [(4, 60), (6, 8)])
def test_hover_thrusts_of_any_rotors_between_rows(count: int, draws: int) -> None:
    random, s = np.random.default_rng(18), np.linspace(0, 1, 61)[:, None]
    turns = 2 * math.pi * np.arange(count) / count
    outward = np.stack([np.cos(turns), np.sin(turns), 0 * turns], axis=1)
    decided = set()
    for _ in range(draws):
        star = Geometry(
            position=0.3 * outward,
            moment_ratio=random.uniform(0.03, 0.2) * np.tile([1.0, -1.0], count // 2),
            thrust_axis=np.tile([0.0, 0.0, 1.0], (count, 1)),
            tilt_axis=outward,
            tilt_range=np.tile([-2.0, 2.0], (count, 1)),
        )
        starts = np.tile(random.uniform(-0.4, 0.4, 2), count // 2)[None]
        ends = starts + random.normal(scale=0.3, size=(1, count))
        if star.least_singular_value_along(starts, ends).lower.min() < LEAST_DECIDED:
            continue
        lower = star.least_hover_thrust_along(starts, ends).lower[0]
        least = star.hover_thrusts(starts + s * (ends - starts)).min()
        assert lower <= least + 1e-9
        assert (lower >= 0) == (least > 0) or abs(least) < 1e-3
        decided.add(bool(least > 0))
    assert decided == {True, False}


ROTOR = {"position": [0.2, 0, 0], "moment_ratio": 0.02}


def test_a_mapping_has_defaults_and_angles_as_texts() -> None:
    turned = {**ROTOR, "tilt_range": ["-90deg", "pi/4"]}
    geometry = geometry_from_mapping({"rotor": [ROTOR, turned]})
    assert geometry.thrust_axis.tolist() == [[0, 0, 1]] * 2
    assert geometry.tilt_range[0].tolist() == [-math.inf, math.inf]
    np.testing.assert_allclose(geometry.tilt_range[1], [-math.pi / 2, math.pi / 4])


@pytest.mark.parametrize(
    ("rotors", "message"),
    [
        (None, "rotor must be a list of tables"),
        ([3], "rotor 1 must be a table"),
        ([{**ROTOR, "kappa": 1}], "rotor 1 has no field 'kappa'"),
        ([{"position": [0.2, 0, 0]}], "moment_ratio must be numbers"),
        ([{**ROTOR, "position": [0.2, 0]}], "position must be numbers"),
        ([{**ROTOR, "position": [0.2, 1e4, 0]}], "position must be numbers within"),
        ([{**ROTOR, "position": [0, 0, 1]}], "position must have a rotor at least"),
        ([{**ROTOR, "thrust_axis": [0, 0, 0]}], "thrust_axis of rotor 1 must not be"),
        ([ROTOR, {**ROTOR, "tilt_range": [1, 1]}], "tilt_range of rotor 2 must be two"),
        ([{**ROTOR, "tilt_range": [1]}], "tilt_range must be numbers"),
    ],
)
def test_what_is_no_geometry_is_refused(rotors: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        geometry_from_mapping({"rotor": rotors})
