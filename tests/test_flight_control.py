"""The flight controller against mathematics that does not know it: linear loops, decompositions, quadratures."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import pytest
from hypothesis import given, settings as effort, strategies as st
from scipy.integrate import solve_ivp

from gaitgraph.errors import GaitgraphError, InputError, MissingConstant
from gaitgraph.flight.controller import Allocation, Reference, allocation_of, wanted_attitude
from gaitgraph.flight.course import Course, from_hover, repeated
from gaitgraph.flight.engine import Engine
from gaitgraph.flight.record import COLUMNS
from gaitgraph.flight.servos import servo_response
from gaitgraph.flight.settings import ARMS, REFERENCES, FlightSettings, settings_from_mapping
from gaitgraph.flight.simulation import Simulation, fly, gusts_of, gyroscopic_of, sensor_noise
from gaitgraph.gait.gait import lift
from gaitgraph.invertibility.matrices import (
    arm_angles,
    body_vertical,
    coefficients_of,
    control_moment_matrix,
    decoupling_matrix,
    least_singular_value,
    scaled_decoupling_matrix,
    thrust_signs,
)
from gaitgraph.vehicle import PAPER, Vehicle, vehicle_named
from tests.published import GAITS

if TYPE_CHECKING:
    from pathlib import Path

    import numpy.typing as npt

    from gaitgraph.timing.timed_gait import TimedGait

    FloatArray = npt.NDArray[np.float64]

pytest.importorskip("mujoco")

RED, ASCENDING = (lift(GAITS[k].angles, "red").parametrize(1.0) for k in (2, 3))
HOVER = lift([(0.0, 0.0)], "red").parametrize(1.0)
VEHICLES = {
    "paper": PAPER,
    "beetle": vehicle_named("beetle_omni").replace(thrust_coefficient=1e-5),
    "strong drag": PAPER.replace(drag_ratio=1.3, first_arm_angle=0.4),
}


def flown_by(timed: TimedGait, vehicle: Vehicle) -> TimedGait:
    """Return the same angles and clock for another vehicle."""
    return replace(timed, gait=replace(timed.gait, vehicle=vehicle, coefficients=coefficients_of(vehicle, "exact")))


def short(**changes: Any) -> FlightSettings:
    return FlightSettings(**{"duration": 0.3, **changes})


class TestServos:
    T = np.linspace(0.0, 1.0, 401)
    ASKED = np.sin(2 * math.pi * T)[:, None] * [1.0, 0.5, 0.2, -1.0] + [0.0, 0.1, 0.0, 0.3]

    def integrated(self, lag: float, rate: float, parts: int = 20) -> FloatArray:
        """Return the solution of lag·α̇ = asked − α, its rate limited, by Runge–Kutta in parts of a step."""

        def slope(asked: FloatArray, angle: FloatArray) -> FloatArray:
            return np.asarray(np.clip((asked - angle) / lag, -rate, rate))

        h, angle = 0.0025 / parts, self.ASKED[0]
        out = [angle]
        for before, after in zip(self.ASKED[:-1], self.ASKED[1:], strict=True):
            for k in range(parts):
                first, middle, last = (before + (after - before) * (k + part) / parts for part in (0, 0.5, 1))
                k1 = slope(first, angle)
                k2 = slope(middle, angle + h / 2 * k1)
                k3 = slope(middle, angle + h / 2 * k2)
                k4 = slope(last, angle + h * k3)
                angle = angle + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
            out.append(angle)
        return np.array(out)

    def test_a_lag_is_exact(self) -> None:
        np.testing.assert_allclose(
            servo_response(self.ASKED, 0.0025, lag=0.05), self.integrated(0.05, math.inf, 2), atol=1e-9
        )

    def test_a_lag_with_a_limit_is_right_to_first_order(self) -> None:
        exact = self.integrated(0.05, 3.0)
        coarse, fine = (
            np.abs(servo_response(self.ASKED[::k], 0.0025 * k, lag=0.05, rate=3.0) - exact[::k]).max() for k in (4, 1)
        )
        assert coarse < 0.01
        assert fine < 0.5 * coarse
        assert np.abs(np.diff(servo_response(self.ASKED, 0.0025, lag=0.05, rate=3.0), axis=0)).max() <= 3.0 * 0.0025 * (
            1 + 1e-12
        )

    def test_a_limit_alone_follows_as_fast_as_it_may(self) -> None:
        out = servo_response(self.ASKED, 0.0025, rate=2.0)
        moved = np.diff(out, axis=0)
        there = np.abs(out[1:] - self.ASKED[1:]) < 1e-12
        assert there.any()
        assert not there.all()
        np.testing.assert_allclose(np.abs(moved[~there]), 2.0 * 0.0025, rtol=1e-9)
        assert (np.sign(moved[~there]) == np.sign((self.ASKED[1:] - out[:-1])[~there])).all()

    def test_what_is_not_limited_passes_unchanged(self) -> None:
        np.testing.assert_array_equal(servo_response(self.ASKED, 0.0025), self.ASKED)
        np.testing.assert_array_equal(servo_response(self.ASKED, 0.0025, rate=100.0), self.ASKED)
        np.testing.assert_array_equal(
            servo_response(self.ASKED, 0.0025, lag=0.05, rate=100.0), servo_response(self.ASKED, 0.0025, lag=0.05)
        )

    def test_a_tiny_lag_is_none(self) -> None:
        np.testing.assert_allclose(servo_response(self.ASKED, 0.0025, lag=1e-9), self.ASKED, atol=1e-7)


def nearness(allocation: Allocation, vertical: FloatArray) -> FloatArray:
    """Return 1/|A⁻¹| (Frobenius) at n places, as the allocation's docstring has it."""
    along = np.sum(allocation.direction * vertical, axis=-1) ** 2
    across = np.sum((vertical[:, None, :] @ allocation.force) ** 2, axis=(1, 2))
    with np.errstate(invalid="ignore"):
        bottom = np.where(along > 0, allocation.squared * along, 0.0) + across + 1.0
    return np.asarray(np.sqrt(along / bottom))


@pytest.mark.parametrize("name", VEHICLES)
class TestAllocation:
    ALPHA = np.random.default_rng(5).uniform(-math.pi, math.pi, (2000, 4))

    def matrices(self, vehicle: Vehicle, roll: Any = 0.0, pitch: Any = 0.0) -> FloatArray:
        """Return the scaled decoupling matrix for thrusts along the axes instead of rotor inputs."""
        return np.asarray(scaled_decoupling_matrix(self.ALPHA, vehicle, roll, pitch) * thrust_signs(vehicle))

    def test_it_is_the_pseudo_inverse_and_the_null_direction(self, name: str) -> None:
        vehicle = VEHICLES[name]
        allocation, moment = allocation_of(self.ALPHA, vehicle), self.matrices(vehicle)[:, :3]
        inverse = np.linalg.pinv(moment)
        scale = np.linalg.norm(inverse, axis=(1, 2))
        assert (np.abs(allocation.thrusts - inverse).max(axis=(1, 2)) <= 1e-11 * scale**2).all()
        np.testing.assert_allclose(allocation.squared, scale**2, rtol=1e-6)
        np.testing.assert_allclose(np.linalg.norm(allocation.free, axis=1), 1.0, rtol=1e-12)
        np.testing.assert_allclose((moment @ allocation.free[..., None])[..., 0], 0.0, atol=1e-12 * scale.max())
        assert allocation.direction[0, 2] >= 0

    def test_thrusts_are_those_of_the_inverse(self, name: str) -> None:
        vehicle, rng = VEHICLES[name], np.random.default_rng(6)
        roll, pitch = rng.uniform(-1.5, 1.5, (2, len(self.ALPHA)))
        allocation, matrix = allocation_of(self.ALPHA, vehicle), self.matrices(vehicle, roll, pitch)
        regular = np.linalg.svd(matrix, compute_uv=False)[:, -1] > 1e-3
        assert regular.mean() > 0.9
        torque, lift = rng.normal(size=(len(self.ALPHA), 3)), rng.normal(size=len(self.ALPHA))
        up = body_vertical(roll, pitch)
        along = np.sum(up * allocation.direction, axis=-1)
        across = np.sum((up[:, None] @ allocation.force)[:, 0] * torque, axis=-1)
        got = (allocation.thrusts @ torque[..., None])[..., 0] + ((lift - across) / along)[:, None] * allocation.free
        expected = np.linalg.solve(matrix, np.hstack([torque, lift[:, None]])[..., None])[..., 0]
        np.testing.assert_allclose(got[regular], expected[regular], rtol=1e-6, atol=1e-6)

    def test_nearness_is_between_half_the_least_singular_value_and_all_of_it(self, name: str) -> None:
        vehicle, rng = VEHICLES[name], np.random.default_rng(7)
        roll, pitch = rng.uniform(-math.pi, math.pi, len(self.ALPHA)), rng.uniform(-1.5, 1.5, len(self.ALPHA))
        near = nearness(allocation_of(self.ALPHA, vehicle), body_vertical(roll, pitch))
        least = np.linalg.svd(self.matrices(vehicle, roll, pitch), compute_uv=False)[:, -1]
        assert (near <= least * (1 + 1e-7)).all()
        assert (near >= least / 2 * (1 - 1e-7)).all()
        inverse = 1.0 / np.linalg.norm(np.linalg.inv(self.matrices(vehicle, roll, pitch)), axis=(1, 2))
        np.testing.assert_allclose(near, inverse, rtol=1e-6)


def test_nothing_is_divided_where_the_moment_matrix_has_lost_rank() -> None:
    quarter = math.pi / 2
    delta = math.atan(PAPER.drag_ratio)
    alpha = np.array([[quarter + delta, quarter - delta, quarter + delta, quarter - delta]])
    allocation = allocation_of(alpha, PAPER)
    assert allocation.squared[0] == math.inf
    assert not allocation.free.any()
    assert not allocation.thrusts.any()
    assert nearness(allocation, np.array([[0.0, 0.0, 1.0]])) == 0.0


def sampled(stiffness: float, damping: float, start: float, speed: float, step: float, count: int) -> FloatArray:
    """Return the exact solution of ë = −kp·e − kd·ė, sampled at each step and integrated as the engine does."""
    x, v, out = start, speed, [start]
    for _ in range(count):
        v += step * (-stiffness * x - damping * v)
        x += step * v
        out.append(x)
    return np.array(out)


def continuous(stiffness: float, damping: float, start: float, t: FloatArray) -> FloatArray:
    done = solve_ivp(
        lambda _, e: [e[1], -stiffness * e[0] - damping * e[1]],
        (0, t[-1]),
        [start, 0.0],
        t_eval=t,
        rtol=1e-10,
        atol=1e-12,
    )
    return np.asarray(done.y[0])


class TestLinearisation:
    """Roll, pitch, yaw and altitude each obey their own linear equation, whatever the gait does."""

    START: ClassVar = {"roll": 0.3, "pitch": -0.2, "yaw": 0.25, "z": -0.15}

    def flight(self, monkeypatch: pytest.MonkeyPatch, timed: TimedGait, **changes: Any) -> Any:
        place = Engine.place

        def elsewhere(engine: Engine, alpha: Any, **others: Any) -> None:
            place(engine, alpha, **{**others, "yaw": self.START["yaw"]})
            engine.data.qpos[2] = self.START["z"]

        monkeypatch.setattr(Engine, "place", elsewhere)
        settings = FlightSettings(
            duration=0.5, saturation=False, altitude_stiffness=60.0, altitude_damping=9.0, **changes
        )
        return Simulation(repeated(timed), settings).run((self.START["roll"], self.START["pitch"]))

    @pytest.mark.parametrize(
        "timed", [RED, ASCENDING, flown_by(ASCENDING, VEHICLES["beetle"])], ids=["3", "4", "beetle"]
    )
    def test_each_error_obeys_its_own_linear_equation(self, monkeypatch: pytest.MonkeyPatch, timed: TimedGait) -> None:
        worst: dict[str, list[float]] = {name: [] for name in self.START}
        for every in (1e-3, 2.5e-4):
            flight = self.flight(monkeypatch, timed, step=every, control_rate=1 / every)
            t = flight.column("t")
            for name, start in self.START.items():
                gains = (60.0, 9.0) if name == "z" else (100.0, 20.0)
                off = np.abs(flight.column(name) - sampled(*gains, start, 0.0, every, len(t) - 1))
                worst[name].append(float(off.max()))
                exact = np.abs(flight.column(name) - continuous(*gains, start, t)).max()
                assert exact < 12 * every * abs(start)
        # What is left vanishes with the step, to first order at least.
        for name, (coarse, fine) in worst.items():
            assert coarse < 2e-3, name
            assert fine < 0.3 * coarse, name

    def test_a_slower_controller_still_does_to_first_order(self, monkeypatch: pytest.MonkeyPatch) -> None:
        flight = self.flight(monkeypatch, RED, control_rate=250.0)
        assert len(flight.rows) == 126
        for name in ("roll", "pitch", "yaw"):
            exact = continuous(100.0, 20.0, self.START[name], flight.column("t"))
            assert np.abs(flight.column(name) - exact).max() < 0.1 * abs(self.START[name])


def turned(roll: float, pitch: float, yaw: float) -> FloatArray:
    (cr, cp, cy), (sr, sp, sy) = ([f(a) for a in (roll, pitch, yaw)] for f in (math.cos, math.sin))
    about_x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    about_y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    about_z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    return np.asarray(about_z @ about_y @ about_x)


class TestDecoupler:
    def test_the_force_points_where_it_is_wanted(self) -> None:
        rng = np.random.default_rng(8)
        for _ in range(200):
            ax, ay, yaw = *rng.uniform(-5, 5, 2), rng.uniform(-3, 3)
            force = rng.normal(size=3) * 0.3 + [0, 0, 2]
            roll, pitch = wanted_attitude(ax, ay, 9.8, yaw, tuple(force))
            pushed = turned(roll, pitch, yaw) @ force
            np.testing.assert_allclose(pushed / pushed[2] * 9.8, [ax, ay, 9.8], rtol=1e-9, atol=1e-9)

    def test_it_leans_by_45_degrees_at_most(self) -> None:
        roll, pitch = wanted_attitude(300.0, -400.0, 9.8, 0.0, (0.0, 0.0, 1.0))
        pushed = turned(roll, pitch, 0.0) @ [0, 0, 1.0]
        np.testing.assert_allclose(pushed, np.array([0.6, -0.8, 1.0]) / math.sqrt(2), atol=1e-12)

    @pytest.mark.parametrize("eta", [1.0, 0.9])
    def test_red_and_biased_gaits_are_held_in_place(self, eta: float) -> None:
        timed = replace(ASCENDING, gait=ASCENDING.gait.biased(eta), period=4.0)
        flight = Simulation(repeated(timed), FlightSettings(reference="line", lap=2.0, size=0.5, duration=2.5)).run()
        assert flight.tracking_error is not None
        assert flight.tracking_error < 0.03
        assert flight.column("x_wanted").max() == pytest.approx(0.5)
        assert flight.column("x")[-1] == pytest.approx(0.5, abs=0.02)
        if eta < 1:
            # N is not along body z: it hovers askew.
            assert np.abs(flight.column("roll")[-300:]).max() + np.abs(flight.column("pitch")[-300:]).max() > 0.01


class TestReferences:
    @pytest.mark.parametrize("kind", REFERENCES)
    def test_derivatives_are_those_of_the_place(self, kind: str) -> None:
        reference, h = Reference(kind=kind, size=1.7, lap=5.0), 1e-4
        t = np.linspace(0.05, 4.95, 99)
        before, now, after = (reference.at(t + by) for by in (-h, 0.0, h))
        np.testing.assert_allclose((after[0] - before[0]) / (2 * h), now[1], atol=1e-6)
        np.testing.assert_allclose((after[0] - 2 * now[0] + before[0]) / h**2, now[2], atol=1e-5)

    @pytest.mark.parametrize("kind", ["line", "circle"])
    def test_laps_are_from_rest_to_rest(self, kind: str) -> None:
        reference = Reference(kind=kind, size=1.7, lap=5.0)
        place, velocity, acceleration = reference.at([0.0, 5.0, 9.0])
        end = [1.7 if kind == "line" else 0.0, 0.0, 0.0]
        np.testing.assert_allclose(place, np.array([[0.0, 0.0, 0.0], end, end]), atol=1e-12)
        np.testing.assert_allclose(velocity, 0, atol=1e-12)
        np.testing.assert_allclose(acceleration, 0, atol=1e-12)

    def test_a_circle_keeps_its_radius(self) -> None:
        place, _, _ = Reference(kind="circle", size=1.7, lap=5.0).at(np.linspace(0, 5, 50))
        np.testing.assert_allclose(np.hypot(place[:, 0] - 1.7, place[:, 1]), 1.7, rtol=1e-12)

    def test_only_accelerations_are_told_ahead(self) -> None:
        reference = Reference(kind="line", size=1.0, lap=5.0)
        rows = np.array(reference.rows(np.array([1.0, 2.0]), ahead=0.3))
        place, velocity, _ = reference.at([1.0, 2.0])
        np.testing.assert_array_equal(rows[:, :5], np.hstack([place, velocity[:, :2]]))
        np.testing.assert_array_equal(rows[:, 5:], reference.at([1.3, 2.3])[2][:, :2])


ROUGH = {
    "attitude_noise": 0.003, "rate_noise": 0.02, "position_noise": 0.01, "velocity_noise": 0.02,
    "wind": (2.0, -1.0, 0.5), "gust": 0.5, "servo_lag": 0.02, "servo_rate": 2.0,
}  # fmt: skip


class TestRepeatability:
    def test_a_seed_is_a_flight(self) -> None:
        first, again, other = (fly(RED, settings=short(seed=seed, **ROUGH), anyway=True) for seed in (3, 3, 4))
        np.testing.assert_array_equal(first.rows, again.rows)
        assert first.rows.shape == other.rows.shape
        assert not np.array_equal(first.rows, other.rows)

    def test_a_cockpit_forgets_what_it_flew(self) -> None:
        simulation = Simulation(repeated(RED), short(**ROUGH))
        first = simulation.run((0.3, -0.2))
        simulation.run((-0.4, 0.1))
        np.testing.assert_array_equal(simulation.run((0.3, -0.2)).rows, first.rows)

    @pytest.mark.parametrize("reference", ["attitude", "circle"])
    def test_a_longer_flight_begins_with_the_shorter_one(self, reference: str) -> None:
        changes = {**ROUGH, "reference": reference}
        brief, long = (fly(RED, settings=short(duration=seconds, **changes), anyway=True) for seconds in (0.2, 0.4))
        np.testing.assert_allclose(long.rows[: len(brief.rows)], brief.rows, rtol=0, atol=1e-12)

    def test_noise_and_gusts_have_the_size_that_is_asked_for(self) -> None:
        noise = np.array(sensor_noise(short(attitude_noise=0.1, velocity_noise=2.0), 4000))
        np.testing.assert_allclose(noise.std(axis=0), [0] * 3 + [0.1] * 3 + [2.0] * 3 + [0] * 3, rtol=0.05)
        gusts = gusts_of(short(wind=(5, 0, -1), gust=0.7, duration=400), 400_000)
        assert gusts is not None
        np.testing.assert_allclose(gusts.mean(axis=0), [5, 0, -1], atol=0.15)
        np.testing.assert_allclose(gusts.std(axis=0), 0.7, rtol=0.15)
        off = gusts[:, 0] - gusts[:, 0].mean()
        assert np.mean(off[1000:] * off[:-1000]) / off.var() == pytest.approx(math.exp(-1), abs=0.12)
        assert gusts_of(short(), 10) is None
        assert sensor_noise(short(), 10) is None

    def test_wind_carries_it_away(self) -> None:
        still, blown = (fly(HOVER, attitude=(0, 0), settings=short(wind=wind)) for wind in ((0, 0), (0, 8.0)))
        assert np.abs(still.rows[:, COLUMNS.index("y")]).max() < 1e-9
        assert blown.column("y")[-1] > 1e-3


def test_a_controller_that_goes_by_the_plan_is_off_by_what_the_lag_makes() -> None:
    lagging = {arms: Simulation(repeated(RED), short(servo_lag=0.0125, duration=1.5, arms=arms)) for arms in ARMS}
    flights = {arms: simulation.run((0.0, 0.0)) for arms, simulation in lagging.items()}
    assert flights["served"].settled
    np.testing.assert_array_equal(lagging["served"].actual, lagging["planned"].actual)
    # Held still, the yaw that the spring kp allows is the torque by which the plan's thrusts miss, over kp·Iz.
    planned = flights["planned"]
    inputs = thrust_signs(PAPER) * planned.thrusts / PAPER.require("thrust_coefficient", purpose="inputs")[0]
    missed = (control_moment_matrix(planned.rows[:, 13:17]) @ inputs[..., None])[:, 2, 0]
    yaw = np.abs(missed).max() / (100.0 * PAPER.inertia[2])  # type: ignore[index]
    assert 0.02 < np.abs(planned.column("yaw")).max() < 2.0 * yaw
    assert not planned.settled
    assert "yaw" in planned.reason
    everywhere = least_singular_value(planned.rows[:, 13:17], PAPER, planned.column("roll"), planned.column("pitch"))
    assert planned.least_singular_value == pytest.approx(everywhere.min(), rel=1e-12)


class TestThrusts:
    def test_limits_are_kept_and_counted(self) -> None:
        weight = PAPER.mass * PAPER.gravity if PAPER.mass else 0.0
        flight = fly(RED, settings=short(thrust_limit=0.6 * weight, duration=0.5), anyway=True)
        assert flight.thrusts.min() >= 0.0
        assert flight.peak_thrust == pytest.approx(0.6 * weight)
        at_limit = (flight.thrusts <= 0.0) | (flight.thrusts >= 0.6 * weight)
        np.testing.assert_array_equal(flight.column("saturated") == 1, at_limit.any(axis=1))
        assert flight.saturated_fraction == pytest.approx(at_limit.any(axis=1).mean())
        assert 0 < at_limit.any(axis=1).mean() < 1

    def test_the_vehicles_limit_counts_unless_another_is_given(self) -> None:
        strong = flown_by(RED, PAPER.replace(max_thrust=2.0))
        assert fly(strong, anyway=True, settings=short()).peak_thrust == 2.0
        assert fly(strong, anyway=True, settings=short(thrust_limit=1.9)).peak_thrust == 1.9

    def test_without_saturation_rotors_may_pull(self) -> None:
        flight = fly(RED, settings=short(saturation=False, attitude_stiffness=2500.0, attitude_damping=100.0))
        assert flight.thrusts.min() < 0
        assert flight.saturated_fraction == 0

    def test_thrusts_change_as_often_as_the_controller_runs(self) -> None:
        flight = fly(RED, settings=short(control_rate=100.0))
        np.testing.assert_allclose(np.diff(flight.column("t")), 0.01)
        assert len(flight.rows) == 31

    def test_energy_in_hover_is_that_of_the_drag(self) -> None:
        """Four rotors, a quarter of the weight each: T = Kf·ω², power Km·ω³ each."""
        assert PAPER.mass
        assert PAPER.thrust_coefficient
        assert PAPER.drag_coefficient
        omega = math.sqrt(PAPER.mass * PAPER.gravity / 4 / PAPER.thrust_coefficient)
        flight = fly(HOVER, attitude=(0, 0), settings=short())
        assert flight.energy == pytest.approx(0.3 * 4 * PAPER.drag_coefficient * omega**3, rel=1e-9)
        assert fly(flown_by(HOVER, PAPER.replace(thrust_coefficient=None)), settings=short()).energy is None

    def test_energy_counts_each_thrust_for_as_long_as_it_is_given(self) -> None:
        flight = fly(RED, settings=short(control_rate=100.0))
        speed = np.sqrt(flight.thrusts / (PAPER.thrust_coefficient or 1.0))
        power = (PAPER.drag_coefficient or 0.0) * (speed**3).sum(axis=1)
        assert flight.energy == pytest.approx(0.01 * power[:-1].sum(), rel=1e-12)


@pytest.mark.parametrize("spin", ["clockwise", "counterclockwise"])
def test_spinning_rotors_push_back_when_they_are_turned(spin: Any) -> None:
    """−ω × h of each arm, with h of the rotor along its tilted axis; servos pass on what is about a hinge."""
    inertia, coefficient = 3e-5, PAPER.thrust_coefficient or 0.0
    vehicle = PAPER.replace(rotor_inertia=inertia, first_rotor_spin=spin, first_arm_angle=0.3)
    engine, rng = Engine(vehicle), np.random.default_rng(9)
    put = gyroscopic_of(vehicle)
    assert put is not None
    for _ in range(5):
        alpha, rates, omega, thrusts = (rng.normal(size=size) for size in (4, 4, 3, 4))
        engine.place(alpha, rates=rates)
        engine.data.qvel[3:6] = omega
        put(engine, engine.data.qpos[7:].tolist(), engine.data.qvel.tolist(), tuple(thrusts))
        total = np.zeros(3)
        senses = np.array([-1, 1, -1, 1]) * (1 if spin == "clockwise" else -1)
        for k, arm in enumerate(arm_angles(vehicle)):
            out = np.array([math.cos(arm), math.sin(arm), 0.0])
            axis = math.cos(alpha[k]) * np.array([0, 0, 1.0]) + math.sin(alpha[k]) * np.cross(out, [0, 0, 1.0])
            speed = senses[k] * np.sign(thrusts[k]) * math.sqrt(abs(thrusts[k]) / coefficient)
            total -= np.cross(omega + rates[k] * out, inertia * speed * axis)
        np.testing.assert_allclose(engine.data.qfrc_applied, [0, 0, 0, *total, 0, 0, 0, 0], rtol=1e-12, atol=1e-12)
    assert gyroscopic_of(PAPER) is None
    turned = fly(flown_by(RED, vehicle), settings=short(), anyway=True)
    plain = fly(flown_by(RED, vehicle.replace(rotor_inertia=None)), settings=short(), anyway=True)
    assert 1e-6 < np.abs(turned.column("roll") - plain.column("roll")).max() < 0.05


class TestEndings:
    """Each way to stop, with one line that says which."""

    @staticmethod
    def check(flight: Any, outcome: str, said: str) -> None:
        assert (flight.outcome, flight.settled, flight.failed) == (outcome, False, True)
        assert said in flight.reason
        assert "\n" not in flight.reason
        assert flight.settling_time is None
        assert np.isfinite(flight.rows).all()

    def test_near_a_singularity(self) -> None:
        timed = flown_by(RED, PAPER.replace(drag_ratio=1.0))
        flight = fly(timed, settings=short(duration=1.0), anyway=True)
        self.check(flight, "near singular", "and flight stops where it may be below 0.01")
        later = fly(timed, settings=short(duration=1.0, floor=0.3), anyway=True)
        assert later.flown < flight.flown
        for flown, floor in ((flight, 0.01), (later, 0.3)):
            # The last row is still allowed, and the next one, a millisecond later, was not.
            assert floor <= flown.column("nearness").min() < floor + 0.01

    def test_at_once(self) -> None:
        flight = fly(
            lift(GAITS[1].angles, "blue", coefficients=coefficients_of(PAPER, "exact")).parametrize(1.0), anyway=True
        )
        self.check(flight, "near singular", "nears singularity at 0.000 s")
        assert len(flight.rows) == 0
        assert flight.peak_thrust is None
        assert flight.energy is None
        assert flight.flown == 0
        json.dumps(flight.as_mapping(), allow_nan=False)
        assert "nears singularity" in str(flight)

    def test_after_a_change_of_sign(self) -> None:
        """Sensors that err by a radian see the vertical on the other side of the singular plane."""
        flight = fly(RED, settings=short(attitude_noise=1.0, floor=0.0))
        self.check(flight, "sign change", "its determinant has changed sign")

    def test_when_it_tumbles(self) -> None:
        flight = fly(flown_by(RED, PAPER.replace(rotor_inertia=1e-2)), settings=short(), anyway=True)
        self.check(flight, "tumbling", "turns by more than 200 rad/s")

    def test_when_it_is_far_away(self) -> None:
        heavy = flown_by(HOVER, PAPER.replace(gravity=1e7))
        flight = fly(heavy, settings=short(thrust_limit=1.0), attitude=(0, 0), anyway=True)
        self.check(flight, "tumbling", "farther than 100000 m")

    def test_with_its_nose_up(self) -> None:
        self.check(
            fly(HOVER, attitude=(0.0, math.pi / 2 - 1e-4)), "upended", "nose points straight up or down at 0.000 s"
        )

    @pytest.mark.parametrize(
        "vehicle",
        [PAPER.replace(rotor_inertia=1e20), PAPER.replace(mass=1e20), PAPER.replace(gravity=1e20)],
        ids=["rotors", "mass", "gravity"],
    )
    def test_when_the_engine_gives_up_and_no_log_is_left(
        self, vehicle: Vehicle, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
    ) -> None:
        monkeypatch.chdir(tmp_path)
        flight = fly(flown_by(RED, vehicle), settings=short(), anyway=True)
        self.check(flight, "tumbling", "beyond what the physics engine can follow")
        assert list(tmp_path.iterdir()) == []
        assert capfd.readouterr() == ("", "")

    def test_upside_down_it_falls_until_the_sign_changes(self) -> None:
        flight = fly(HOVER, attitude=(math.pi, 0.0), settings=short(duration=3.0))
        assert not flight.settled
        assert flight.outcome in ("sign change", "near singular")

    def test_being_slow_is_no_failure(self) -> None:
        flight = fly(RED, settings=short(duration=0.1))
        assert (flight.outcome, flight.failed) == ("not settled", False)
        assert "did not settle within 0.1 s: roll (rad) is still off by" in flight.reason


class TestRecords:
    def test_settling_is_to_come_within_tolerance_and_stay(self) -> None:
        flight = fly(RED, settings=short(duration=1.0))
        errors = np.stack([np.abs(flight.column(name)) for name in ("roll", "pitch", "yaw", "z")])
        inside: list[bool] = (errors.max(axis=0) <= 0.02).tolist()
        since = next(k for k in range(len(inside)) if all(inside[k:]))
        last = float(flight.column("t")[since])
        assert flight.settling_time == last
        assert 0.2 < last < 0.7
        assert not fly(RED, settings=short(duration=last + 0.05 * last)).settled
        assert fly(RED, settings=short(duration=round(last + 0.21, 3))).settling_time == last

    @pytest.mark.parametrize("changes", [{}, {"attitude_noise": 0.02, "floor": 0.0}, {"servo_lag": 0.1}])
    @pytest.mark.parametrize("name", VEHICLES)
    def test_the_least_singular_value_is_that_of_all_rows(self, name: str, changes: dict[str, Any]) -> None:
        vehicle = VEHICLES[name]
        for gait in (HOVER, RED):
            if gait is RED and name == "strong drag":
                continue  # singular on the way
            flight = fly(flown_by(gait, vehicle), settings=short(**changes), attitude=(0.3, -0.2), anyway=True)
            alpha = flight.rows[:, COLUMNS.index("alpha1") : COLUMNS.index("alpha4") + 1]
            each = least_singular_value(alpha, vehicle, flight.column("roll"), flight.column("pitch"))
            assert flight.least_singular_value == float(each.min())
            if not changes.get("attitude_noise"):
                near = flight.column("nearness")
                assert (near <= each * (1 + 1e-3)).all()
                assert (near >= each / 2 * (1 - 1e-3)).all()

    def test_the_torque_asked_for_is_the_torque_made(self) -> None:
        """The thrusts of the first row, through the decoupling matrix, make the accelerations that were asked for."""
        flight = fly(RED, settings=short(saturation=False))
        coefficient = PAPER.thrust_coefficient or 0.0
        inputs = flight.thrusts[0] * thrust_signs(PAPER) / coefficient
        made = decoupling_matrix(RED.at(0.0)[0], PAPER, 0.3, -0.2) @ inputs - [PAPER.gravity, 0, 0, 0]
        np.testing.assert_allclose(made, [0.0, -30.0, 20.0, 0.0], atol=1e-9)

    def test_columns_are_in_the_table(self) -> None:
        flight = fly(RED, settings=short(duration=0.05))
        assert list(flight.table().columns) == list(COLUMNS)
        assert flight.rows.shape == (51, len(COLUMNS))


EXTREME = [
    Vehicle(
        name=f"{mass:g} kg, κ {ratio:g}",
        mass=mass,
        arm_length=length,
        drag_ratio=ratio,
        inertia=(0.1 * mass * length**2, 0.12 * mass * length**2, 0.18 * mass * length**2),
        thrust_coefficient=1e-6,
    )
    for mass, length in ((1e-6, 0.01), (1e-3, 0.05), (1e3, 10.0), (1e20, 1e3))
    for ratio in (0.01, 5.0)
]


@pytest.mark.parametrize("vehicle", EXTREME, ids=lambda vehicle: vehicle.name)
def test_extreme_vehicles_fly_or_say_why_not(vehicle: Vehicle) -> None:
    for gait in (RED, HOVER):
        try:
            flight = fly(flown_by(gait, vehicle), settings=short(duration=0.1), anyway=True)
        except InputError as error:
            assert vehicle.mass == 1e-6
            assert "too small for the physics engine" in str(error)
            assert "\n" not in str(error)
        else:
            json.dumps(flight.as_mapping(), allow_nan=False)
            assert np.isfinite(flight.rows).all()
            assert str(flight).count("\n") >= (5 if len(flight.rows) else 0)


class TestGains:
    @pytest.mark.parametrize("loop", ["attitude", "altitude"])
    @pytest.mark.parametrize(
        ("changes", "said"),
        [
            ({"damping": 2100.0}, "damping: 2100.0 is unstable at 1000 Hz; allowed is less than 19"),
            (
                {"stiffness": 5e6, "damping": 100.0},
                "stiffness: 5000000.0 is unstable at 1000 Hz; allowed is less than 1.95e+06",
            ),
            ({"stiffness": 3e6, "damping": 200.0}, "stiffness: 3000000.0 is unstable at 1000 Hz; allowed is less than"),
            ({"damping": 1e-3, "control_rate": 100.0}, "damping: 0.001 is unstable at 100 Hz with"),
            ({"damping": 0.6, "control_rate": 50.0}, "damping: 0.6 is unstable at 50 Hz with"),
            # As many steps as settings: the engine alone would hold it.
            ({"damping": 0.6, "control_rate": 50.0, "step": 0.02}, "damping: 0.6 is unstable at 50 Hz with"),
        ],
    )
    def test_unstable_ones_are_refused_by_name(self, loop: str, changes: dict[str, Any], said: str) -> None:
        plain = ("control_rate", "step")
        named = {name if name in plain else f"{loop}_{name}": value for name, value in changes.items()}
        with pytest.raises(InputError) as caught:
            FlightSettings(**named)
        assert f"{loop}_{said}" in str(caught.value)
        assert "\n" not in str(caught.value)

    @pytest.mark.parametrize("every", [1, 4, 20])
    def test_the_limit_is_that_of_the_sampled_loop(self, every: int) -> None:
        """Poles of the map from one setting to the next, by brute force: steps of an engine under a held input.

        Of this engine, of one with a single step, and of one that has no steps: what is stable in all is allowed.
        """
        rng, rate = np.random.default_rng(10), 1000.0 / every
        maps = []
        for steps in (every, 1):
            h = 1 / (rate * steps)
            one = np.array([[1, h], [0, 1.0]]), np.array([h * h, h])
            move, push = np.eye(2), np.zeros(2)
            for _ in range(steps):
                move, push = one[0] @ move, one[0] @ push + one[1]
            maps.append((move, push))
        maps.append((maps[-1][0], np.array([0.5 / rate**2, 1 / rate])))
        allowed = 0
        for _ in range(200):
            kp, kd = 10 ** rng.uniform(0, math.log10(6 * rate**2)), rate * rng.uniform(0, 2.2)
            radii = [np.abs(np.linalg.eigvals(move - np.outer(push, [kp, kd]))).max() for move, push in maps]
            try:
                FlightSettings(attitude_stiffness=kp, attitude_damping=kd, control_rate=rate, saturation=False)
            except InputError:
                assert max(radii) > 0.98
            else:
                allowed += 1
                assert max(radii) < 1
        assert allowed > 20

    @pytest.mark.parametrize(
        "changes",
        [
            {"attitude_damping": 1900.0},
            {"attitude_stiffness": 1.9e6, "attitude_damping": 1000.0},
            {"attitude_damping": 0.5, "altitude_damping": 0.5},
            {"control_rate": 50.0, "attitude_damping": 90.0},
        ],
    )
    def test_those_just_stable_fly(self, changes: dict[str, Any]) -> None:
        flight = Simulation(repeated(HOVER), short(saturation=False, **changes)).run((0.01, -0.01))
        assert flight.outcome in ("settled", "not settled")
        assert np.abs(flight.column("roll")).max() < 0.05

    def test_position_gains_must_be_slower_than_attitude(self) -> None:
        with pytest.raises(InputError, match="position_damping: 30.0 with position_stiffness 900.0 is unstable around"):
            FlightSettings(reference="hover", position_stiffness=900.0, position_damping=30.0)
        assert FlightSettings(position_stiffness=900.0, position_damping=30.0).reference == "attitude"
        slow: dict[str, Any] = {
            "control_rate": 10.0,
            "attitude_stiffness": 100.0,
            "attitude_damping": 12.0,
            "altitude_stiffness": 4.0,
            "altitude_damping": 4.0,
            "position_stiffness": 4.9,
            "position_damping": 10.0,
        }
        with pytest.raises(InputError, match=r"control_rate: 10 Hz is too slow for position_stiffness 4\.9"):
            FlightSettings(reference="hover", **slow)
        assert FlightSettings(reference="hover", **{**slow, "control_rate": 100.0}).is_calm


def fraction(warning: str) -> str:
    return warning.partition(":")[0]


class TestWholes:
    """A verdict on a gait is one on all of it, or it says on which part."""

    SLOW = RED.gait.parametrize(4.0)

    def test_a_period_is_flown_where_no_duration_is_stated(self) -> None:
        rough: dict[str, Any] = {"step": 0.005, "control_rate": 200.0}
        assert fly(self.SLOW, settings=FlightSettings(**rough)).flown == pytest.approx(4.0)
        assert fly(RED, settings=FlightSettings(**rough)).flown == pytest.approx(3.0)
        held = Simulation(repeated(RED.gait.parametrize(9.0)), FlightSettings(reference="hover", **rough))
        assert held.controls == 1800
        # Every moment of a point is like the others.
        assert Simulation(repeated(HOVER.gait.parametrize(1e6)), FlightSettings(**rough)).controls == 600

    def test_a_part_is_told(self) -> None:
        flight = fly(self.SLOW, settings=FlightSettings(duration=1.2))
        assert flight.settled
        assert flight.warnings == (
            "1.2 s are 0.3 of a period of 4 s: what holds at one moment of it need not hold at another",
        )
        (told,) = fly(RED, settings=FlightSettings(duration=1.0, reference="circle", lap=2.0, size=0.1)).warnings
        assert fraction(told) == "1 s are 0.5 of a lap of 2 s"
        assert fly(HOVER, settings=short(duration=0.05)).warnings == ()
        course = from_hover(ASCENDING, periods=1, pause=0.1)
        assert isinstance(course, Course)
        (told,) = fly(course, settings=short(duration=0.32)).warnings
        assert fraction(told) == "0.32 s are 0.1 of a course of 3.2 s"

    def test_too_many_steps_are_the_periods_doing(self) -> None:
        with pytest.raises(InputError, match=r"^period: 2000 s, which is flown whole .* allowed is 1000000 steps of"):
            fly(RED.gait.parametrize(2000.0))
        assert fly(RED.gait.parametrize(2000.0), settings=short(), attitude=(0, 0)).warnings
        with pytest.raises(InputError, match=r"^lap: 9000 s; allowed is 1000000 steps of 0.001 s at most"):
            FlightSettings(reference="line", lap=9000.0)

    def test_arms_faster_than_the_engine_are_refused(self) -> None:
        for period in (1e-3, 0.019):
            with pytest.raises(InputError, match=rf"^period: {period:g} s at a step of 0.001 s; allowed is 20 steps"):
                fly(RED.gait.parametrize(period), anyway=True)
        assert len(fly(RED.gait.parametrize(0.02), settings=short(duration=0.02)).rows) == 21
        assert len(fly(HOVER.gait.parametrize(1e-3), settings=short(duration=0.02)).rows) == 21

    @pytest.mark.parametrize("changes", [{"servo_lag": 0.3}, {"servo_rate": 0.1}])
    def test_arms_that_do_not_follow_are_told(self, changes: dict[str, Any]) -> None:
        flight = fly(RED, settings=short(duration=1.0, **changes), anyway=True)
        (told,) = [one for one in flight.warnings if "do not follow" in one]
        spans = np.ptp(flight.rows[:, 13:17], axis=0)
        planned = np.ptp(RED.gait.alpha, axis=0)
        numbers = re.search(r"arm (\d) swings by (\S+) of the (\S+) rad", told)
        assert numbers is not None
        arm, swing, plan = int(numbers[1]) - 1, float(numbers[2]), float(numbers[3])
        assert swing == pytest.approx(spans[arm], rel=0.01)
        assert plan == pytest.approx(planned[arm], rel=0.01)
        assert swing / plan == pytest.approx((spans / planned).min(), rel=0.01)
        quick = fly(RED, settings=short(duration=1.0, servo_lag=0.01))
        assert quick.warnings == ()


class TestTakeOff:
    """What is judged before take-off are the limits that the flight has."""

    def test_thrusts(self) -> None:
        weak = flown_by(RED, PAPER.replace(max_thrust=1.5))
        assert "largest hover thrust 2.75 N, limit 1.5 N" in fly(weak, settings=short()).reason
        assert not fly(weak, settings=short(thrust_limit=9.0)).refused
        assert not fly(weak, settings=short(saturation=False)).refused
        assert "limit 1 N" in fly(RED, settings=short(thrust_limit=1.0)).reason
        assert "limit 1 N" in fly(weak, settings=short(thrust_limit=1.0)).reason

    def test_tilt_rates(self) -> None:
        slow = flown_by(RED, PAPER.replace(max_tilt_rate=1.0))
        assert "limit 1" in fly(slow, settings=short()).reason
        assert not fly(slow, settings=short(servo_rate=9.0)).refused
        assert "limit 2" in fly(RED, settings=short(servo_rate=2.0)).reason

    def test_rotors_that_may_pull_need_no_positive_thrusts(self) -> None:
        pulling = replace(RED, gait=replace(RED.gait, alpha=np.array([[0.0, 0.0, 1.2, 0.0]]), colors=()))
        assert "push down" in fly(pulling, settings=short()).reason
        free = fly(pulling, settings=short(saturation=False))
        assert not free.refused
        assert any("push down" in one for one in free.warnings)

    def test_each_reason_is_told_of_what_flies_anyway(self) -> None:
        both = flown_by(RED, PAPER.replace(max_thrust=1.5, max_tilt_rate=1.0))
        told = fly(both, settings=short(duration=0.02), anyway=True).warnings
        flown = [one for one in told if one.startswith("flown although it is not flyable: ")]
        assert len(flown) == 2
        assert "limit 1.5 N" in flown[0]
        assert "limit 1" in flown[1]


class TestSettings:
    NUMBERS = (
        "duration", "tolerance", "step", "control_rate", "attitude_stiffness", "attitude_damping", "altitude_stiffness",
        "altitude_damping", "position_stiffness", "position_damping", "floor", "size", "lap", "thrust_limit",
        "servo_lag", "servo_rate", "attitude_noise", "rate_noise", "position_noise", "velocity_noise", "gust",
    )  # fmt: skip

    @given(
        st.sampled_from(NUMBERS),
        st.sampled_from(
            [math.nan, math.inf, -math.inf, -1.0, 1e300, True, "fast", [], 1j, b"1", {}, (1.0,), -(10**400)]
        ),
    )
    def test_bad_numbers_are_refused_by_name(self, name: str, value: object) -> None:
        with pytest.raises(GaitgraphError) as caught:
            settings_from_mapping({name: value})
        assert str(caught.value).startswith(name)
        assert "allowed" in str(caught.value)
        assert "\n" not in str(caught.value)

    @pytest.mark.parametrize(
        ("name", "value", "said"),
        [
            ("reference", "hoover", "allowed are attitude, hover, step, line, circle; did you mean 'hover'"),
            ("reference", 3, "allowed are attitude"),
            ("saturation", 1, "allowed are true and false"),
            ("seed", -1, "allowed is a whole number from 0"),
            ("seed", True, "allowed is a whole number from 0"),
            ("seed", 1.0, "allowed is a whole number from 0"),
            ("wind", 3.0, "allowed are two or three numbers"),
            ("wind", (1, math.nan), "allowed are two or three numbers"),
            ("wind", (1, 2, 101), "each up to 100"),
            ("wind", "12", "allowed are two or three numbers"),
            (
                "control_rate",
                300.0,
                "300 Hz does not fit steps of 0.001 s; allowed is 1000 Hz divided by a whole number",
            ),
            ("control_rate", 2000.0, "does not fit steps"),
            ("duration", 9000.0, "allowed is"),
        ],
    )
    def test_other_bad_ones_too(self, name: str, value: object, said: str) -> None:
        with pytest.raises(InputError) as caught:
            settings_from_mapping({name: value})
        assert str(caught.value).startswith(name)
        assert said in str(caught.value)
        assert "\n" not in str(caught.value)

    def test_unknown_names_are_refused_with_the_nearest(self) -> None:
        with pytest.raises(InputError, match=r"atitude_noise: no setting of a flight; did you mean 'attitude_noise'"):
            settings_from_mapping({"atitude_noise": 0.1})
        contents: tuple[Any, ...] = (None, [], {1: 2})
        for content in contents:
            with pytest.raises(InputError, match="flight: .*allowed is a table of settings by name"):
                settings_from_mapping(content)

    @effort(max_examples=30)
    @given(
        st.fixed_dictionaries(
            {},
            optional={
                "duration": st.floats(0.01, 100),
                "reference": st.sampled_from(REFERENCES),
                "wind": st.tuples(*[st.floats(-100, 100)] * 3),
                "seed": st.integers(0, 2**64 - 1),
                "servo_lag": st.none() | st.floats(0, 1),
                "saturation": st.booleans(),
                "attitude_noise": st.floats(0, 1),
            },
        )
    )
    def test_they_come_back_from_their_mapping(self, values: dict[str, Any]) -> None:
        settings = FlightSettings(**values)
        assert settings_from_mapping(json.loads(json.dumps(settings.as_mapping()))) == settings

    @pytest.mark.parametrize("attitude", [(0.1,), 0.1, "level", (math.nan, 0), (4.0, 0.0), (0.0, 1.6), (0, None)])
    def test_bad_attitudes_are_refused(self, attitude: Any) -> None:
        with pytest.raises(InputError, match="^attitude: ") as caught:
            fly(RED, attitude=attitude)
        assert "\n" not in str(caught.value)

    def test_only_timed_gaits_and_courses_fly(self) -> None:
        with pytest.raises(InputError, match="gait: .*allowed is a timed gait"):
            fly(RED.gait)  # type: ignore[arg-type]
        with pytest.raises(InputError, match="settings: .*allowed are FlightSettings"):
            fly(RED, settings={"duration": 1.0})  # type: ignore[arg-type]
        assert isinstance(repeated(RED), Course)

    @pytest.mark.parametrize("step", [0, -1, math.nan, math.inf, "a", None, True])
    def test_an_engine_says_what_is_wrong(self, step: Any) -> None:
        with pytest.raises(InputError, match="^step: .*; allowed is a number of seconds from 1e-06 to 1") as caught:
            Engine(PAPER, step=step)
        assert "\n" not in str(caught.value)

    def test_what_is_of_another_kind_is_named(self) -> None:
        with pytest.raises(InputError, match="^vehicle: None; allowed is a Vehicle"):
            Engine(None)  # type: ignore[arg-type]
        with pytest.raises(InputError, match="^air: 'yes'; allowed are True and False"):
            Engine(PAPER, air="yes")  # type: ignore[arg-type]
        with pytest.raises(InputError, match="^gait: None; allowed is a timed gait"):
            from_hover(None)  # type: ignore[arg-type]
        for call in (fly, from_hover):
            with pytest.raises(InputError, match="^anyway: 'yes'; allowed are True and False"):
                call(RED, anyway="yes")  # type: ignore[arg-type]

    @pytest.mark.parametrize("inertia", [(2e-3, 2e-3, 4e-3), (4e-3, 2e-3, 2e-3), (1e-3, 7e-3, 8e-3)])
    def test_a_flat_body_flies(self, inertia: tuple[float, float, float]) -> None:
        flat = PAPER.replace(inertia=inertia)
        engine = Engine(flat)
        moments = engine.model.body_inertia[1] + 4 * engine.model.body_inertia[2]
        np.testing.assert_allclose(np.sort(moments), np.sort(inertia), rtol=5e-6)
        assert fly(flown_by(HOVER, flat), settings=short(duration=0.8)).settled
        with pytest.raises(InputError, match="is not that of a rigid body; allowed are"):
            Engine(PAPER.replace(inertia=(2e-3, 2e-3, 4.001e-3)))
        with pytest.raises(InputError, match="is not that of a rigid body; four arms take"):
            Engine(PAPER.replace(inertia=(2e-3, 2e-3, 4e-3), arm_inertia=1e-5))

    @pytest.mark.parametrize(
        ("constant", "purpose"), [("mass", "flight"), ("inertia", "flight"), ("arm_length", "flight")]
    )
    def test_vehicles_must_state_what_flight_needs(self, constant: str, purpose: str) -> None:
        vehicle = PAPER.replace(**{constant: None, "drag_ratio": 0.17})
        with pytest.raises(MissingConstant, match=f"states no {constant} .*which {purpose} needs"):
            fly(flown_by(RED, vehicle), anyway=True)

    def test_spinning_rotors_need_their_thrust_coefficient(self) -> None:
        vehicle = PAPER.replace(thrust_coefficient=None, rotor_inertia=1e-5)
        with pytest.raises(MissingConstant, match="states no thrust_coefficient .*gyroscopic"):
            fly(flown_by(RED, vehicle), anyway=True)
