"""The design questions of docs/guide/flight.md: every number of their tables is computed again."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import shapely

import gaitgraph as gg
from gaitgraph.invertibility.matrices import (
    hover_thrust_shares,
    least_singular_value,
    scaled_decoupling_matrix,
    thrust_signs,
)
from gaitgraph.surface import hover_region, sign_region, thrust_region
from gaitgraph.timing import servo_response
from tests.samples import gait_of_paper

if TYPE_CHECKING:
    from gaitgraph.timing.timed_gait import TimedGait

pytest.importorskip("mujoco")

from gaitgraph.flight import FlightSettings, fly

PAGE = (Path(__file__).parent.parent / "docs" / "guide" / "flight.md").read_text()
SIDE = math.pi / 8 * np.array([(1, -1), (1, 1), (-1, 1), (-1, -1)])
DOWN = np.array([1, -1])
THIRD, FOURTH = gait_of_paper(3, "exact"), gait_of_paper(4, "exact")


def table(header: str) -> list[list[str]]:
    """Return the cells of the table of the page that begins with a header."""
    _, found, below = PAGE.partition(f"\n| {header}")
    assert found, header
    rows = below.partition("\n\n")[0].splitlines()[2:]
    return [[cell.strip() for cell in row.strip("|").split("|")] for row in rows]


def numbers(cell: str) -> list[Any]:
    """Return the numbers of a cell, which others equal if they round to them."""
    shown = re.findall(r"[-+]?\d+(?:\.\d+)?", cell.replace("−", "-"))
    return [
        pytest.approx(float(text), abs=0.6 * 10.0 ** -len(text.partition(".")[2]))
        for text in shown
    ]


def number(cell: str) -> Any:
    return numbers(cell)[0]


def value(cell: str) -> float:
    return float(number(cell).expected)


@pytest.mark.parametrize("row", table("κ | δ"), ids=lambda row: row[0])
def test_how_the_drag_ratio_changes_what_can_be_flown(row: list[str]) -> None:
    kappa = gg.PAPER.drag_ratio if "paper" in row[0] else value(row[0])
    vehicle = gg.Vehicle(drag_ratio=kappa)
    positive = gg.admissible_region(vehicle, sign="positive", accuracy=1e-4)
    negative = gg.admissible_region(vehicle, sign="negative", accuracy=1e-4)
    assert math.degrees(math.atan(kappa)) == number(row[1])
    assert least_singular_value([0, 0, 0, 0], vehicle) == number(row[2])
    assert positive.area == number(row[3])
    assert negative.area == number(row[4])
    part = positive.component_of((0, 0))
    if part is None:
        assert row[5:] == ["none"] * 3
        return
    reached = positive.components[part]
    light = reached.intersection(thrust_region(0.4, vehicle, accuracy=1e-4).inner)
    assert reached.area == number(row[5])
    assert reached.boundary.distance(shapely.Point(0, 0)) == number(row[6])
    assert light.area == number(row[7])


@pytest.mark.parametrize("kappa", [0.02, 0.3, 1.2])
def test_without_a_floor_the_part_of_hover_is_equally_large(kappa: float) -> None:
    vehicle = gg.Vehicle(drag_ratio=kappa)
    positive = gg.admissible_region(vehicle, sign="positive", floor=0.0)
    negative = gg.admissible_region(vehicle, sign="negative", floor=0.0)
    whole = math.pi**2 / 4 + math.atan(kappa) ** 2
    assert positive.area == pytest.approx(whole, abs=1e-4)
    assert negative.area == pytest.approx(whole, abs=1e-4)
    assert positive.components[0].area == pytest.approx(math.pi**2 / 4, abs=1e-4)
    assert positive.component_of((0.0, 0.0)) == 0


@pytest.mark.parametrize(
    ("kappa", "sign", "parts"),
    [
        (0.0353, "negative", 1),
        (0.0354, "negative", 3),
        (0.0603, "positive", 1),
        (0.0605, "positive", 2),
    ],
)
def test_where_parts_vanish(kappa: float, sign: Any, parts: int) -> None:
    region = gg.admissible_region(gg.Vehicle(drag_ratio=kappa), sign=sign)
    assert len(region.components) == parts


def test_small_drag_ratios_and_long_arms() -> None:
    for kappa, flyable in ((0.0249, False), (0.0251, True)):
        region = gg.admissible_region(gg.Vehicle(drag_ratio=kappa))
        assert bool(region.contains([0, 0])[0]) == flyable
    leaning = [-0.6, 0.6, -0.6, 0.6]
    least = least_singular_value(leaning, gg.Vehicle(drag_ratio=0.02))
    assert least == pytest.approx(1.15, abs=5e-3)
    for name, longest in (("paper", 1.20), ("beetle_omni", 0.66)):
        vehicle = gg.vehicle_named(name)
        (arm,) = vehicle.require("arm_length", purpose="this test")
        drag_to_thrust = vehicle.drag_ratio * arm
        assert 2 * drag_to_thrust / 0.05 == pytest.approx(longest, abs=5e-3)


@pytest.mark.parametrize("kappa", [0.05, 0.35, 1.0])
def test_negative_R_costs_thrust(kappa: float) -> None:
    vehicle, delta = gg.Vehicle(drag_ratio=kappa), math.atan(kappa)
    points = np.random.default_rng(0).uniform(-np.pi / 2, np.pi / 2, (4000, 2))
    region, hover = sign_region("negative", vehicle), hover_region(vehicle)
    flown = points[region.contains(points) & hover.contains(points)]
    largest = hover_thrust_shares(flown[:, [0, 1, 0, 1]], vehicle).max(axis=1)
    in_square = flown[:, 0] > delta
    assert (largest[in_square] > 1 / (4 * math.cos(delta))).all()
    assert (largest[~in_square] > 1 / (2 * (1 + math.sin(delta)))).all()


@pytest.mark.parametrize("gait", [THIRD, FOURTH], ids=["Gait 3", "Gait 4"])
def test_the_least_periods_of_a_servo(gait: gg.Gait) -> None:
    limits = gg.Limits(rate="300deg", acceleration=60.0)
    with_jerk = gg.Limits(rate="300deg", acceleration=60.0, jerk=2000.0)
    resting, rounded = table("law | least period")
    assert gg.least_period(gait, limits).least == number(resting[1])
    assert gg.least_period(gait, with_jerk).least == number(resting[2])
    period = gg.least_period(gait, limits, rounding="2deg")
    assert period.least == number(rounded[1])
    if gait is THIRD:
        period = gg.least_period(gait, with_jerk, rounding="2deg")
        assert period.least == number(rounded[2])


@pytest.mark.parametrize(
    "row", table("$T$ | largest error")[1:], ids=lambda row: row[0]
)
def test_servos_that_lag_alike_stay_on_the_sheet(row: list[str]) -> None:
    for gait, least in ((THIRD, row[4]), (FOURTH, row[5])):
        response = servo_response(gait.parametrize(value(row[0])), 0.05)
        assert response.peak.max() == number(row[1])
        assert response.distance_off_sheet == value(row[2]) == 0
        assert response.least_singular_value == number(least)
    timed = THIRD.parametrize(value(row[0]))
    unlike = servo_response(timed, [0.05, 0.05, 0.06, 0.05])
    assert unlike.distance_off_sheet == number(row[3])


@pytest.mark.parametrize("row", table(r"$T/\text{lag}$"), ids=lambda row: row[0])
def test_what_a_controller_makes_that_knows_only_the_commands(row: list[str]) -> None:
    response = servo_response(THIRD.parametrize(0.05 * value(row[0])), 0.05)
    planned = response.timed.at(response.t).alpha
    thrusts = hover_thrust_shares(planned) * thrust_signs(gg.PAPER)
    matrix = scaled_decoupling_matrix(response.actual)
    made = np.einsum("kij,kj->ki", matrix, thrusts)
    lift = 100 * (np.abs(made[:, 3]) - 1.0)
    assert np.abs(made[:, :2]).max() < 1e-12
    assert np.abs(made[:, 2]).max() == number(row[1])
    assert [lift.min(), lift.max()] == numbers(row[2])


@pytest.mark.slow
@pytest.mark.parametrize("row", table("lag | yaw"), ids=lambda row: row[0])
def test_flights_of_a_controller_that_knows_only_the_commands(row: list[str]) -> None:
    settings = FlightSettings(servo_lag=1e-3 * value(row[0]), arms="planned")
    flight = fly(THIRD.parametrize(1.0), settings=settings)
    later = flight.column("t") >= 1.0
    assert flight.settled == (row[0] == "5 ms")
    assert np.abs(flight.column("yaw")[later]).max() == number(row[1])
    assert 1e3 * np.abs(flight.column("z")[later]).max() == number(row[2])


def peaks(timed: TimedGait) -> list[float | None]:
    """Return the largest thrusts of two flights, from level and from a tilted start."""
    settings = FlightSettings(duration=1.0, servo_lag=0.0)
    flights = [
        fly(timed, attitude=attitude, settings=settings)
        for attitude in ((0, 0), (0.3, -0.2))
    ]
    assert all(flight.settled for flight in flights)
    assert not any(flight.saturated_fraction for flight in flights)
    return [flight.peak_thrust_share for flight in flights]


@pytest.mark.slow
def test_the_best_hover_reserve() -> None:
    rows = table("loop | hover needs")
    strong = gg.PAPER.replace(rotor_lag=None)
    (mass,) = strong.require("mass", purpose="this test")
    weak = strong.replace(max_thrust=2.4 * mass * strong.gravity / 4)
    corners = SIDE - math.pi / 4 * DOWN
    gait = gg.lift(corners, "red", vehicle=strong)
    assert fly(gg.lift(corners, "red", vehicle=weak).parametrize(1.0)).refused
    best = gg.optimal_gait(
        corners, radius=0.2, objective="hover_reserve", vehicle=weak, pieces=24
    )
    assert best.value is not None
    assert best.curve is not None
    needs = 1 / math.cos(3 * math.pi / 8 - 0.2 / math.sqrt(2))
    assert needs == pytest.approx(1.9643, abs=5e-5)
    assert 2.4 - 4 * best.value == pytest.approx(needs, abs=1e-4)
    assert best.report.reachable_from_hover
    near = gg.paced(best.curve, gg.Limits(acceleration=1000.0), period=1.0).timed
    assert near is not None
    center = np.array([value(cell) for cell in rows[2][0].split(",")])
    moved = gg.lift(SIDE + center, "red", vehicle=weak)
    assert gg.validate(moved).flyable
    loops = [gait.parametrize(1.0), near, moved.parametrize(1.0)]
    for row, timed in zip(rows, loops, strict=True):
        dense = timed.at(np.linspace(0, 1, 401)).alpha
        assert 4 * hover_thrust_shares(dense, strong).max() == number(row[1])
        assert peaks(timed) == [number(row[2]), number(row[3])]
        assert least_singular_value(dense, strong).min() == number(row[4])


def test_the_price_of_negative_R() -> None:
    moved = gg.lift(SIDE + 0.6405 * DOWN, "red")
    worst = gg.validate(moved)["least_singular_value"].value
    assert worst == pytest.approx(0.164, abs=6e-4)
    alpha = moved.parametrize(1.0, samples=400).alpha
    assert 4 * hover_thrust_shares(alpha).max() == pytest.approx(1.954, abs=6e-4)


@pytest.mark.parametrize(("first", "peak"), [(0, 2.63), (2, 4.07)])
def test_when_the_upset_comes(first: int, peak: float) -> None:
    fourth = SIDE - math.pi / 4 * DOWN
    gait = gg.lift(np.roll(fourth, -first, axis=0), "red")
    flight = fly(gait.parametrize(1.0), settings=FlightSettings(duration=1.0))
    assert flight.peak_thrust_share == pytest.approx(peak, abs=5e-3)
