"""The design questions of docs/guide/studies.md: their numbers are computed again."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest

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

SIDE = math.pi / 8 * np.array([(1, -1), (1, 1), (-1, 1), (-1, -1)])
DOWN = np.array([1, -1])
THIRD, FOURTH = gait_of_paper(3, "exact"), gait_of_paper(4, "exact")


@pytest.mark.parametrize(
    ("kappa", "area"), [(0.05, 0.65), (gg.PAPER.drag_ratio, 0.89), (0.7, 1.67)]
)
def test_where_no_rotor_hovers_with_much(kappa: float, area: float) -> None:
    vehicle = gg.Vehicle(drag_ratio=kappa)
    positive = gg.admissible_region(vehicle, sign="positive", accuracy=1e-4)
    part = positive.component_of((0, 0))
    assert part is not None
    light = thrust_region(0.4, vehicle, accuracy=1e-4).inner
    reached = positive.components[part].intersection(light)
    assert reached.area == pytest.approx(area, abs=6e-3)


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
    assert gg.least_period(gait, limits).least == pytest.approx(0.950, abs=6e-4)
    assert gg.least_period(gait, with_jerk).least == pytest.approx(1.069, abs=6e-4)
    period = gg.least_period(gait, limits, rounding="2deg")
    assert period.least == pytest.approx(0.729, abs=6e-4)
    if gait is THIRD:
        period = gg.least_period(gait, with_jerk, rounding="2deg")
        assert period.least == pytest.approx(0.845, abs=6e-4)


@pytest.mark.parametrize(
    ("period", "error", "least"), [(1.0, 0.24, 0.500), (0.25, 0.46, 0.783)]
)
def test_servos_that_lag_alike_stay_on_the_sheet(
    period: float, error: float, least: float
) -> None:
    timed = THIRD.parametrize(period)
    response = servo_response(timed, 0.05)
    assert response.distance_off_sheet == 0
    assert response.peak.max() == pytest.approx(error, abs=6e-3)
    assert response.least_singular_value == pytest.approx(least, abs=6e-4)
    unlike = servo_response(timed, [0.05, 0.05, 0.06, 0.05])
    assert unlike.distance_off_sheet == pytest.approx(0.04, abs=6e-3)


@pytest.mark.parametrize(
    ("lags", "yaw", "lift"),
    [(80, 0.06, (-5, 6)), (40, 0.12, (-10, 12)), (20, 0.21, (-16, 23))],
)
def test_what_a_controller_makes_that_knows_only_the_commands(
    lags: int, yaw: float, lift: tuple[int, int]
) -> None:
    response = servo_response(THIRD.parametrize(0.05 * lags), 0.05)
    planned = response.timed.at(response.t).alpha
    thrusts = hover_thrust_shares(planned) * thrust_signs(gg.PAPER)
    matrix = scaled_decoupling_matrix(response.actual)
    made = np.einsum("kij,kj->ki", matrix, thrusts)
    errors = 100 * (np.abs(made[:, 3]) - 1.0)
    assert np.abs(made[:, :2]).max() < 1e-12
    assert np.abs(made[:, 2]).max() == pytest.approx(yaw, abs=6e-3)
    assert (errors.min(), errors.max()) == pytest.approx(lift, abs=0.6)


@pytest.mark.slow
@pytest.mark.parametrize(("lag", "yaw"), [(0.005, 0.022), (0.05, 0.209)])
def test_flights_of_a_controller_that_knows_only_the_commands(
    lag: float, yaw: float
) -> None:
    settings = FlightSettings(servo_lag=lag, arms="planned")
    flight = fly(THIRD.parametrize(1.0), settings=settings)
    later = flight.column("t") >= 1.0
    assert np.abs(flight.column("yaw")[later]).max() == pytest.approx(yaw, abs=6e-4)


def peak(timed: TimedGait) -> float | None:
    """Return the largest thrust of a flight from level, in quarters of the weight."""
    settings = FlightSettings(duration=1.0, servo_lag=0.0)
    flight = fly(timed, attitude=(0, 0), settings=settings)
    assert flight.settled
    assert not flight.saturated_fraction
    return flight.peak_thrust_share


@pytest.mark.slow
def test_the_best_hover_reserve() -> None:
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
    moved = gg.lift(SIDE - 0.5366 * DOWN, "red", vehicle=weak)
    assert gg.validate(moved).flyable
    loops = [gait.parametrize(1.0), near, moved.parametrize(1.0)]
    for timed, quarters in zip(loops, (2.613, 1.964, 1.673), strict=True):
        dense = timed.at(np.linspace(0, 1, 401)).alpha
        largest = 4 * hover_thrust_shares(dense, strong).max()
        assert largest == pytest.approx(quarters, abs=6e-4)
        assert peak(timed) == pytest.approx(quarters, abs=6e-4)


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
