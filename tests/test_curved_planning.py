"""Plans of vehicles that are not symmetric: the region in which they fly, loops on their curved sheet, files, flights."""

from __future__ import annotations

import json
import math
import re
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import shapely

import gaitgraph as gg
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.invertibility.matrices import (
    hover_thrust_shares,
    least_singular_value,
    level_determinant,
)
from gaitgraph.surface.curved import curved_sheet
from gaitgraph.surface.curved_region import sheet_region
from tests import samples

if TYPE_CHECKING:
    from pathlib import Path

    from gaitgraph.surface.sheets import Sign

PAIRED = ["clockwise", "clockwise", "counterclockwise", "counterclockwise"]
ODD = samples.ODD.replace(inertia=[0.02, 0.02, 0.03])
KINDS = samples.by_vehicle(ODD, samples.LEANING, samples.STANDING)
SQUARE = [(-0.3, 0.3), (-0.6, 0.3), (-0.6, 0.6), (-0.3, 0.6)]


def flies(
    plane: np.ndarray, vehicle: gg.Vehicle, sign: str, floor: float
) -> np.ndarray:
    """Return whether points of the sheet fly, by the package's plain functions."""
    alpha = np.concatenate([plane, curved_sheet(vehicle).angles(*plane.T)], axis=1)
    R = level_determinant(alpha, coefficients_of(vehicle, "exact"))
    holds = (R > 0) == (sign == "positive")
    holds &= (hover_thrust_shares(alpha, vehicle) > 0).all(axis=1)
    holds &= least_singular_value(alpha, vehicle) >= floor
    if vehicle.thrust_share is not None:
        holds &= (hover_thrust_shares(alpha, vehicle) <= vehicle.thrust_share).all(
            axis=1
        )
    if vehicle.tilt_range is not None:
        low, high = np.array(vehicle.tilt_range).T
        holds &= ((alpha >= low) & (alpha <= high)).all(axis=1)
    return np.asarray(holds)


@pytest.mark.parametrize("sign", ["positive", "negative"])
@KINDS
def test_a_region_is_proven_inside_and_outside(vehicle: gg.Vehicle, sign: Sign) -> None:
    limited = vehicle.replace(
        min_tilt=["-50deg", "-70deg", "-40deg", "-80deg"],
        max_tilt="60deg",
        mass=1.0,
        max_thrust=3.4,
    )
    plane = np.random.default_rng(9).uniform(-math.pi / 2, math.pi / 2, (10_000, 2))
    for body, floor in ((vehicle, 0.05), (limited, 0.3)):
        region = sheet_region(body, sign=sign, floor=floor, accuracy=0.02)
        holds = flies(plane, body, sign, floor)
        outside = ~shapely.contains_xy(region.outer, *plane.T)
        assert not (shapely.contains_xy(region.inner, *plane.T) & ~holds).any()
        assert not (holds & outside).any()
        assert region.outer.area - region.inner.area < 1.2
        for point in plane[outside][:9]:
            assert re.search(
                "must be|closer to the border", region.why_not(point) or ""
            )
        assert holds.any() or region.inner.is_empty


def test_the_region_of_a_symmetric_vehicle_is_that_of_its_plane() -> None:
    region = sheet_region(gg.PAPER)
    plane = gg.admissible_region(gg.PAPER, coefficients="exact", sign="positive")
    assert region.inner.difference(plane.outer.buffer(1e-9)).area < 1e-9
    assert plane.inner.difference(region.outer.buffer(1e-9)).area < 1e-9


@KINDS
def test_loops_fly_along_the_curve_and_its_chords(vehicle: gg.Vehicle) -> None:
    part = sheet_region(vehicle).components[0].buffer(-0.02)
    places = np.random.default_rng(9).uniform(-math.pi / 2, math.pi / 2, (200, 2))
    points = places[shapely.contains_xy(part, *places.T)][:3]
    plan = gg.plan_loop(points, vehicle=vehicle, sign="positive")
    assert plan.report.flyable
    alpha = plan.gait.alpha
    for point in points:
        assert np.abs(alpha[:, :2] - point).max(axis=1).min() < 1e-12
    shares = np.linspace(0, 1, 60)[:, None, None]
    chords = (alpha + shares * (plan.gait.ends - alpha)).reshape(-1, 4)
    assert least_singular_value(chords, vehicle).min() >= 0.05
    assert hover_thrust_shares(chords, vehicle).min() > 0
    off = chords[:, 2:] - curved_sheet(vehicle).angles(*chords[:, :2].T)
    assert np.abs(np.angle(np.exp(2j * off))).max() / 2 <= 1e-3
    assert flies(chords[:, :2], vehicle, "positive", 0.05).all()
    assert plan.loop is not None
    assert plan.loop.lower_bound is not None
    assert plan.loop.lower_bound <= plan.loop.length + 1e-12


def test_points_of_two_parts_and_outside_points_are_refused_with_numbers() -> None:
    apart = gg.plan_loop([(-0.3, 0.3), (0.6, -0.3)], vehicle=ODD)
    assert not apart
    assert "waypoint 2 (0.6000, -0.3000) has R = -12" in str(apart.reason)
    low = gg.plan_loop([(-0.3, 0.3), (0.1, 0.1)], vehicle=ODD, sign="positive")
    assert "hover thrusts must be positive, got -" in str(low.reason)
    assert low.refusals[0].nearest is not None
    blue = gg.plan_loop([(-0.3, 0.3), (-0.5, 0.3)], vehicle=ODD, color="blue")
    assert "blue" in str(blue.reason)
    choices: dict[str, Any] = {
        "method": "grid",
        "objective": "robust",
        "require": "valid",
    }
    for name, value in choices.items():
        with pytest.raises(
            gg.InputError,
            match=f"{name} must be '.*' for a vehicle that is not symmetric",
        ):
            gg.plan_loop(SQUARE, vehicle=ODD, **{name: value})


def test_polygons_are_kept_out_of() -> None:
    block = [(-0.5, 0.2), (-0.4, 0.2), (-0.4, 0.35), (-0.5, 0.35)]
    free = gg.plan_loop(SQUARE[:2], vehicle=ODD)
    around = gg.plan_loop(SQUARE[:2], vehicle=ODD, keep_out=[block])
    assert around.report.flyable
    assert around.gait.length > free.gait.length + 0.01
    assert (
        not shapely.Polygon(block)
        .buffer(-1e-9)
        .intersects(shapely.LineString(around.gait.alpha[:, :2]))
    )


@pytest.mark.parametrize(
    ("suffix", "law", "vehicle"),
    [
        ("csv", "smooth", ODD),
        ("npz", "constant-speed", ODD),
        ("json", "smooth", ODD.replace(spins=PAIRED)),
    ],
)
def test_files_of_a_plan_are_judged_and_flown(
    suffix: str, law: Any, vehicle: gg.Vehicle, tmp_path: Path
) -> None:
    plan = gg.plan_loop(SQUARE, vehicle=vehicle, law=law, period=4.0)
    assert not plan.warnings
    path = tmp_path / f"odd.{suffix}"
    timed = plan.timed()
    timed.write(path)
    again = gg.timing.timed_gait_of(path)
    assert (type(again), again.law) == (type(timed), law)
    t = np.linspace(0, 4, 50)
    np.testing.assert_allclose(again.at(t).alpha, timed.at(t).alpha, atol=1e-12)
    assert gg.validate(path).flyable
    assert gg.fly(path).settled


@KINDS
def test_the_law_smooth_follows_the_sheet_and_rests_at_corners(
    vehicle: gg.Vehicle,
) -> None:
    sheet = curved_sheet(vehicle)
    region = sheet_region(vehicle)
    middle = region.components[0].representative_point()
    x, y = middle.x, middle.y
    size = 0.6 * middle.distance(region.inner.boundary) / math.sqrt(2)
    corners = [(x, y), (x + size, y), (x + size, y + size)]
    plan = gg.plan_loop(corners, vehicle=vehicle, sign="positive", period=3.0)
    timed = plan.timed()
    t, step = np.linspace(0, 3, 4001), 3 / 4000
    motion = timed.at(t)
    off = motion.alpha[:, 2:] - sheet.angles(*motion.alpha[:, :2].T)
    assert np.abs(np.angle(np.exp(2j * off))).max() / 2 < 1e-5
    slopes = np.diff(motion.alpha, axis=0) / step
    assert np.abs(slopes - (motion.rates[1:] + motion.rates[:-1]) / 2).max() < 1e-4
    at_rest = t[np.abs(motion.rates).max(axis=1) < 1e-3 * np.abs(motion.rates).max()]
    assert len(np.flatnonzero(np.diff(at_rest) > 0.1)) == 3
    for order, values in ((1, motion.rates), (2, motion.accelerations)):
        largest = np.abs(values).max(axis=0)
        peaks = timed.peaks(order)
        assert (peaks >= largest).all()
        assert (peaks <= 1.05 * largest + 1e-9).all()
    names = [check.name for check in plan.report.checks[-2:]]
    assert names == ["tilt_rate", "tilt_acceleration"]
    tight = vehicle.replace(max_tilt_acceleration=0.9 * timed.peaks(2).max())
    refused = gg.plan_loop(corners, vehicle=tight, sign="positive", period=3.0)
    assert "this law needs a period of at least 3.1" in str(refused.reason)


def test_a_certificate_proves_rates_along_the_sheet(run: Any, tmp_path: Path) -> None:
    vehicle = ODD.replace(max_tilt_rate=2.0, max_tilt_acceleration=12.0)
    timed = gg.plan_loop(SQUARE, vehicle=vehicle, period=2.0).timed()
    certified = gg.certify(timed)
    assert {
        "least_singular_value",
        "rate",
        "acceleration",
    } <= certified.intervals.keys()
    certified.write(tmp_path / "proof.json")
    timed.write(tmp_path / "odd.csv")
    assert run("verify", tmp_path / "proof.json", tmp_path / "odd.csv").code == 0


def test_attitudes_are_acceptable_on_the_sheet_and_not_on_the_plane() -> None:
    plan = gg.plan_loop(SQUARE, vehicle=ODD)
    plane = np.array(SQUARE)[:, [0, 1, 0, 1]]
    on_sheet, on_plane = (
        gg.robustness_of(gait, curves=0).as_mapping()["acceptable_fraction"]
        for gait in (plan.gait, gg.Gait(alpha=plane, vehicle=ODD))
    )
    assert on_sheet == pytest.approx(1.0, abs=1e-3)
    assert on_plane < 0.98


def test_the_command_plans_on_a_curved_sheet(run: Any, tmp_path: Path) -> None:
    constants = {
        name: ODD.as_mapping()[name] for name in ("drag_to_thrust", "rotor_positions")
    }
    lines = [f"{name} = {json.dumps(value)}" for name, value in constants.items()]
    (tmp_path / "own.toml").write_text("\n".join(lines), encoding="utf-8")
    places = [f"--waypoint={first},{second}" for first, second in SQUARE]
    options = ("--vehicle", "own.toml", "--json", "--output", "own.csv")
    answer = run("plan", *options, *places).json
    assert (answer["status"], answer["color"]) == ("planned", "red")
    assert (answer["types"], answer["flyable"]) == ([], True)
    assert run("validate", "own.csv").code == 0
    assert run("region", "--vehicle", "own.toml").code == 0


def test_a_margin_that_no_curved_region_keeps_is_refused() -> None:
    """A region of any four rotors does not know servo margins: an answer without one would not be what was asked."""
    with pytest.raises(gg.errors.InputError) as caught:
        gg.location_of([(-0.4, 0.4)], vehicle=ODD, servo_margin="5deg")
    assert caught.value.field == "servo_margin"
