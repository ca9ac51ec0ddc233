"""Flights: repeatable, within limits, with the right outcome and record; courses and the checks before take-off."""

from __future__ import annotations

import json
import math
import re
from io import BytesIO
from typing import Any

import numpy as np
import pytest

from gaitgraph.errors import InputError
from gaitgraph.flight.controller import Command, Motion
from gaitgraph.flight.course import from_hover, repeated
from gaitgraph.flight.flight import COLUMNS, FlightSettings, settings_from_mapping
from gaitgraph.flight.simulation import (
    Simulation,
    fly,
    gusts_of,
    in_flight,
    sensor_noise,
)
from gaitgraph.invertibility.matrices import (
    least_singular_value,
    scaled_decoupling_matrix,
)
from gaitgraph.vehicle import PAPER
from tests.samples import HOVER, RED, cases, flown_by, gait_of_paper

pytest.importorskip("mujoco")

WEIGHT = (PAPER.mass or 0.0) * PAPER.gravity
ROUGH: dict[str, Any] = {
    "attitude_noise": 0.003,
    "rate_noise": 0.02,
    "position_noise": 0.01,
    "velocity_noise": 0.02,
    "wind": (2.0, -1.0, 0.5),
    "gust": 0.5,
    "servo_lag": 0.02,
    "servo_rate": 2.0,
}


def short(**changes: Any) -> FlightSettings:
    return FlightSettings(**{"duration": 0.3, **changes})


# Disturbances


def test_a_simulation_keeps_nothing_of_the_flights_before() -> None:
    simulation = Simulation(repeated(RED), short(**ROUGH))
    first = simulation.run((0.3, -0.2))
    simulation.run((-0.4, 0.1))
    np.testing.assert_array_equal(simulation.run((0.3, -0.2)).rows, first.rows)
    other = Simulation(repeated(RED), short(seed=1, **ROUGH)).run((0.3, -0.2))
    assert not np.array_equal(other.rows, first.rows)


def test_noise_and_gusts_have_their_stated_sizes() -> None:
    noise = sensor_noise(short(attitude_noise=0.1, velocity_noise=2.0), 4000)
    sizes = np.repeat([0, 0.1, 2.0, 0], 3)
    assert np.std(noise or [], axis=0) == pytest.approx(sizes, rel=0.05)
    gusts = gusts_of(short(wind=(5.0, 0.0, -1.0), gust=0.7), 400_000)
    assert gusts is not None
    assert gusts.mean(axis=0) == pytest.approx([5, 0, -1], abs=0.15)
    assert gusts.std(axis=0) == pytest.approx(0.7, rel=0.15)
    ahead = gusts[:, 0] - gusts[:, 0].mean()
    correlation = np.mean(ahead[1000:] * ahead[:-1000]) / ahead.var()
    assert correlation == pytest.approx(math.exp(-1), abs=0.12)  # after a second
    assert gusts_of(short(), 10) is None
    assert sensor_noise(short(), 10) is None


def test_wind_drives_the_vehicle() -> None:
    plain = fly(RED, settings=short())
    blown = fly(RED, settings=short(wind=(9.0, 0.0, 0.0)))
    assert blown.column("x")[-1] > plain.column("x")[-1] + 1e-3


@pytest.mark.parametrize("reports", [False, True])
@pytest.mark.parametrize("arms", [None, "served", "planned"])
def test_the_controller_knows_the_angles_of_servos_that_report_them(
    reports: bool, arms: Any
) -> None:
    """Otherwise the thrusts miss, and it yaws."""
    vehicle = PAPER.replace(servo_lag=0.03, servo_feedback=reports)
    knows = reports if arms is None else arms == "served"
    settings = short(duration=1.0, arms=arms)
    flight = fly(flown_by(RED, vehicle), settings=settings, attitude=(0.0, 0.0))
    assert bool(np.abs(flight.column("yaw")).max() < 1e-3) == knows
    assert flight.as_mapping()["arms"] == ("served" if knows else "planned")


def test_errors_of_servos_are_known_to_nobody() -> None:
    settings = FlightSettings(
        reference="hover", servo_errors=(-0.2, -0.2, -0.2, -0.2), duration=3.0
    )
    flight = fly(HOVER, settings=settings, attitude=(0.1, -0.1))
    assert flight.alpha == pytest.approx(-0.2, abs=0.02)
    assert not flight.settled
    assert flight.drift is not None
    assert flight.drift > 0.1


# Thrusts


def test_limits_of_thrusts_are_kept_and_counted() -> None:
    """The limit of the settings counts before the vehicle's."""
    strong = flown_by(RED, PAPER.replace(max_thrust=3.0))
    flight = fly(strong, settings=short(thrust_limit=2.5, duration=0.5), anyway=True)
    at_limit = (flight.thrusts <= 0.0) | (flight.thrusts >= 2.5)
    is_saturated = at_limit.any(axis=1)
    assert flight.thrusts.min() >= 0.0
    assert flight.peak_thrust == 2.5
    assert flight.peak_thrust_share == pytest.approx(10 / WEIGHT)
    np.testing.assert_array_equal(flight.column("saturated"), is_saturated)
    assert flight.saturated_fraction == pytest.approx(is_saturated.mean())
    assert 0 < is_saturated.mean() < 1
    gains = {"attitude_stiffness": 2500.0, "attitude_damping": 100.0}
    free = fly(RED, settings=short(saturation=False, **gains))
    assert free.thrusts.min() < 0
    assert free.saturated_fraction == 0
    assert fly(strong, settings=short(), anyway=True).peak_thrust == 3.0


def test_thrusts_change_at_the_control_rate_and_energy_counts_each() -> None:
    flight = fly(RED, settings=short(control_rate=100.0))
    assert flight.column("t") == pytest.approx(0.01 * np.arange(31))
    coefficient = PAPER.thrust_coefficient or 0.0
    power = (PAPER.drag_coefficient or 0.0) * (flight.thrusts / coefficient) ** 1.5
    assert flight.energy == pytest.approx(0.01 * power[:-1].sum())
    unknown = flown_by(HOVER, PAPER.replace(thrust_coefficient=None))
    assert fly(unknown, settings=short()).energy is None


# Outcomes

HEAVY = PAPER.replace(gravity=1e7)
HEAVIEST = PAPER.replace(gravity=1e12)
SPINNING = PAPER.replace(rotor_inertia=1e-2)
STRONG = PAPER.replace(drag_ratio=1.0)
WEAK = short(thrust_limit=1.0)
STEEP = (0.0, math.pi / 2 - 1e-4)


@pytest.mark.parametrize(
    ("flown", "outcome", "reason"),
    cases("""
fly(flown_by(RED, STRONG), settings=short(floor=0.3), anyway=True) | near singular | floor is 0.3
fly(RED, settings=short(attitude_noise=1.0, floor=0.0)) | sign change | changed sign
fly(flown_by(RED, SPINNING), settings=short()) | tumbling | more than 200 rad/s
fly(flown_by(HOVER, HEAVY), settings=WEAK, attitude=(0, 0), anyway=True) | tumbling | more than 100000 m from
fly(flown_by(HOVER, HEAVIEST), settings=WEAK, attitude=(0, 0), anyway=True) | tumbling | exceed the range
fly(HOVER, settings=short(), attitude=STEEP) | upended | straight up or down at 0.000 s
"""),
)
def test_each_way_to_stop_has_an_outcome_and_a_line(
    flown: str, outcome: str, reason: str
) -> None:
    """Sensors that err by a radian have the vertical on the other side of the singular plane."""
    flight = eval(flown)
    assert (flight.outcome, flight.settled, flight.failed) == (outcome, False, True)
    assert reason in flight.reason
    assert flight.verdict == f"stopped: {flight.reason}"
    assert flight.settling_time is None
    assert np.isfinite(flight.rows).all()


def test_the_reason_brackets_the_least_singular_value() -> None:
    flight = fly(RED, settings=short(floor=1.0))
    matrix = scaled_decoupling_matrix(RED.alpha[0], PAPER, *flight.attitude)
    told = re.search(r"at 0.000 s: .* between (\S+) and (\S+),", flight.reason)
    assert told is not None
    low, high = map(float, told.groups())
    assert high == pytest.approx(2 * low, rel=0.1)  # of two digits each
    assert 0.95 * low <= np.linalg.svd(matrix)[1][-1] <= 1.05 * high


LEVEL = Motion(*[0.0] * 12)
ABOVE = Command([], 1.0, 0.05, 0.0, 0.0)


@pytest.mark.parametrize(
    ("far", "number"),
    [({"x": 1e5}, 2), ({"y": -1e5}, 2), ({"z": 1e5}, 2)]
    + [({f"body_rate_{axis}": sign * 200.0}, 1) for axis in "xyz" for sign in (1, -1)],
)
def test_a_flight_ends_at_its_limits_in_each_direction(far: Any, number: int) -> None:
    """A part of a limit in every other direction does not make up for it."""
    others = {"x": -1.0, "y": 1.0, "z": -1.0, "body_rate_x": -1.0, "body_rate_y": 1.0}
    for motion, holds in ((far, False), (others | far, False), (others, True)):
        moved = LEVEL._replace(**motion)
        conditions = in_flight(1.0, moved, LEVEL, ABOVE, 1.0, 0.05)
        assert conditions[number] is holds
        assert sum(conditions) == 5 + holds


def test_the_last_row_is_still_allowed_and_the_next_one_was_not() -> None:
    flight = fly(flown_by(RED, STRONG), settings=short(floor=0.3), anyway=True)
    assert 0.3 <= flight.column("nearness").min() < 0.31


def test_to_settle_is_to_come_within_tolerance_and_stay() -> None:
    flight = fly(RED, settings=short(duration=1.0))
    t = flight.column("t")
    names = ("roll", "pitch", "yaw", "z")
    errors = np.abs([flight.column(name) for name in names]).max(axis=0)
    since = t[errors > 0.02].max() + 1e-3
    assert 0.2 < since < 0.7
    assert flight.settling_time == pytest.approx(since)
    assert flight.settled
    # A tenth of the flight it must stay.
    enough = math.ceil(1000 * since / 0.9) / 1000
    assert fly(RED, settings=short(duration=enough)).settled
    assert not fly(RED, settings=short(duration=enough - 0.001)).settled
    slow = fly(RED, settings=short(duration=0.1))
    assert (slow.outcome, slow.failed) == ("not settled", False)
    assert slow.tracking_error is None
    assert "within 0.1 s: roll (rad) is still off by" in slow.reason


# The record


def test_a_record_has_the_numbers_of_its_rows() -> None:
    settings = short(reference="hover")
    flight = fly(RED, settings=settings, attitude=(0.3, -0.2))
    roll, pitch = flight.column("roll"), flight.column("pitch")
    least = least_singular_value(flight.alpha, PAPER, roll, pitch)
    distances = np.linalg.norm(flight.rows[:, 1:4], axis=1)
    assert flight.least_singular_value == least.min()
    assert flight.peak_tilt == pytest.approx(np.arccos(np.cos(0.3) * np.cos(0.2)))
    assert flight.drift == math.hypot(flight.column("x")[-1], flight.column("y")[-1])
    assert flight.tracking_error == pytest.approx(distances.max())
    mapping = json.loads(json.dumps(flight.as_mapping(), allow_nan=False))
    assert (mapping["final_roll"], mapping["final_pitch"]) == (roll[-1], pitch[-1])
    errors = flight.gait_errors
    assert errors is not None
    for part in (
        f"attitude {errors['attitude']:.4f} rad, yaw {errors['yaw']:.4f} rad",
        f"{flight.energy:.4g} J",
        f"{flight.peak_thrust:.4g} N",
        f"{least.min():.3g} (stops below 0.01)",
        f"{flight.tracking_error:.3g} m from the reference",
        "the controller assumes the planned ones",
    ):
        assert part in str(flight)
    assert list(flight.table.columns) == list(COLUMNS)
    assert flight.table.about["flight"]["attitude"] == [0.3, -0.2]
    stream = BytesIO()
    flight.write(stream, format="npz")
    stream.seek(0)
    with np.load(stream) as archive:
        np.testing.assert_array_equal(archive["thrust3"], flight.column("thrust3"))


def test_a_flight_that_ends_at_once_has_no_rows() -> None:
    flight = fly(gait_of_paper(1, "exact").parametrize(1.0), anyway=True)
    assert flight.outcome == "near singular"
    assert (len(flight.rows), flight.flown, flight.peak_thrust) == (0, 0.0, None)
    assert flight.as_mapping()["energy"] is None
    assert "nears singularity at 0.000 s" in str(flight)


# Durations and warnings


@pytest.mark.parametrize(
    ("period", "reference", "seconds"),
    [
        (1.0, "attitude", 3.0),
        (9.0, "hover", 9.0),
        (1.0, "step", 8.0),
        (1.0, "line", 10.0),
    ],
)
def test_a_period_is_flown_where_no_duration_is_stated(
    period: float, reference: Any, seconds: float
) -> None:
    settings = FlightSettings(reference=reference)
    assert settings.seconds_of(repeated(RED.gait.parametrize(period))) == seconds
    still = repeated(HOVER.gait.parametrize(1e6))  # every moment is like the others
    assert settings.seconds_of(still) == settings.seconds


CIRCLE = short(duration=1.0, reference="circle", lap=2.0, size=0.1)


ASCENDING = gait_of_paper(4).parametrize(1.0)


@pytest.mark.parametrize(
    ("flown", "part"),
    cases("""
fly(RED.gait.parametrize(4.0), settings=short(duration=1.2)) | 1.2 s is 30 % of a period of 4 s
fly(RED, settings=CIRCLE) | 1 s is 50 % of a lap of 2 s
fly(from_hover(ASCENDING, periods=1), settings=short(duration=0.5)) | 0.5 s is 10 % of a course of 5 s
"""),
)
def test_a_flight_of_a_part_has_a_warning(flown: str, part: str) -> None:
    (warning,) = eval(flown).warnings
    assert f"the flight of {part}: " in warning
    assert fly(HOVER, settings=short(duration=0.05)).warnings == ()


def test_too_many_steps_and_too_few_are_refused() -> None:
    for period, field in ((2000.0, "duration"), (0.019, "period")):
        with pytest.raises(InputError) as caught:
            fly(RED.gait.parametrize(period))
        assert caught.value.field == field
    flight = fly(RED.gait.parametrize(0.02), settings=short(duration=0.02))
    assert len(flight.rows) == 21


@pytest.mark.parametrize("changes", [{"servo_lag": 0.3}, {"servo_rate": 0.1}])
def test_arms_that_do_not_follow_have_a_warning(changes: dict[str, Any]) -> None:
    flight = fly(RED, settings=short(duration=1.0, **changes), anyway=True)
    swing = np.ptp(flight.alpha, axis=0).min()
    planned = math.pi / 4
    stated = f"arm 1 swings by {swing:.3g} of the planned {planned:.3g} rad"
    assert stated in flight.warnings[-1]
    assert fly(RED, settings=short(servo_lag=0.01, duration=1.0)).warnings == ()


# Before take-off


@pytest.mark.parametrize(
    ("limits", "settings", "reason"),
    [
        ({"max_thrust": 1.5}, {}, "largest hover thrust 2.75 N"),
        ({"max_thrust": 1.5}, {"thrust_limit": 9.0}, ""),
        ({"max_thrust": 1.5}, {"saturation": False}, ""),
        ({"max_tilt_rate": 1.0}, {"servo_rate": 9.0}, ""),
        ({}, {"servo_rate": 2.0}, "limit 2"),
    ],
)
def test_limits_of_the_flight_are_checked_not_those_of_the_vehicle(
    limits: Any, settings: Any, reason: str
) -> None:
    flight = fly(flown_by(RED, PAPER.replace(**limits)), settings=short(**settings))
    assert flight.refused == bool(reason)
    assert reason in flight.reason


def test_physics_alone_refuses() -> None:
    """A biased gait is off the surfaces, which the paper forbids but physics does not."""
    flight = fly(gait_of_paper(3).biased(0.8).parametrize(1.0))
    assert flight.settled
    assert any("max(|Rφ|, |Rθ|) = 0.71" in warning for warning in flight.warnings)


# Courses


@pytest.mark.parametrize("hovers", [True, False])
def test_errors_and_servos_are_those_while_the_gait_runs(hovers: bool) -> None:
    """The level start from hover is over before the gait runs; without it the start counts."""
    timed = gait_of_paper(4).parametrize(1.0)
    course = from_hover(timed) if hovers else repeated(timed)
    settings = FlightSettings(servo_lag=0.3, arms="planned")
    flight = fly(course, settings=settings, attitude=(0.1, 0.0))
    t = flight.column("t")
    runs = t >= 0.0
    if hovers:
        runs = (t >= 2.0) & (t <= 4.0)
    assert flight.gait_errors == {
        "attitude": np.abs(flight.rows[runs, 4:6]).max(),
        "yaw": np.abs(flight.column("yaw")[runs]).max(),
        "altitude": np.abs(flight.column("z")[runs]).max(),
    }
    assert (flight.gait_errors["attitude"] > 0.09) is not hovers
    planned = np.ptp(timed.gait.alpha, axis=0).max()
    assert f"of the planned {planned:.3g} rad" in flight.warnings[-1]
    level = fly(from_hover(timed), settings=FlightSettings(duration=0.5))
    assert level.gait_errors is None  # it never ran


def test_settings_come_back_from_their_mapping() -> None:
    settings = FlightSettings(
        duration=3, reference="line", seed=2**64 - 1, saturation=False, **ROUGH
    )
    mapping = json.loads(json.dumps(settings.as_mapping()))
    assert settings_from_mapping(mapping) == settings
    stated = {"servo_errors": ["-12deg", 0, "1deg", 0.1], "attitude_noise": "1deg"}
    read = settings_from_mapping(stated | {"wind": [3.0, -1.0]})
    assert read.wind == (3.0, -1.0, 0.0)
    assert read.servo_errors == (math.radians(-12), 0.0, math.radians(1), 0.1)
    assert read.attitude_noise == math.radians(1)
