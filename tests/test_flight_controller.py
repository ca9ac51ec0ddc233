"""The flight controller and the servos against independent mathematics: linear loops, decompositions, quadratures."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from gaitgraph.errors import InputError
from gaitgraph.flight.controller import allocation_of, wanted_attitude
from gaitgraph.flight.course import repeated, servo_response
from gaitgraph.flight.engine import Engine
from gaitgraph.flight.flight import REFERENCES, FlightSettings, Reference, reference_at
from gaitgraph.flight.simulation import Simulation, fly
from gaitgraph.invertibility.matrices import (
    body_vertical,
    scaled_decoupling_matrix,
    thrust_signs,
)
from gaitgraph.vehicle import PAPER, Vehicle
from tests.samples import ASCENDING, BEETLE, RED, by_vehicle, flown_by

if TYPE_CHECKING:
    from gaitgraph.timing.timed_gait import TimedGait

pytest.importorskip("mujoco")

STRONG = PAPER.replace(
    name="strong drag",
    drag_ratio=1.3,
    first_arm_angle=0.4,
)


def test_servos_obey_their_lag_and_their_largest_rate() -> None:
    """Right to first order in the step."""
    sizes = np.array([1.0, 0.5, 0.2, -1.0])
    t = np.linspace(0.0, 1.0, 401)
    command = np.outer(np.sin(2 * math.pi * t), sizes)

    def rate(now: float, angles: Any) -> Any:
        target = math.sin(2 * math.pi * now) * sizes
        return np.clip((target - angles) / 0.05, -3.0, 3.0)

    exact = solve_ivp(rate, (0.0, 1.0), [0.0] * 4, t_eval=t, max_step=0.0025).y.T
    fine = servo_response(command, 0.0025, lag=0.05, rate=3.0)
    coarse = servo_response(command[::4], 0.01, lag=0.05, rate=3.0)
    error = np.abs(fine - exact).max()
    assert 2 * error < np.abs(coarse - exact[::4]).max() < 0.01
    assert np.abs(np.diff(fine, axis=0)).max() <= 3.0 * 0.0025 * (1 + 1e-12)


@by_vehicle(PAPER, BEETLE, STRONG)
def test_an_allocation_inverts_the_decoupling_matrix(vehicle: Vehicle) -> None:
    rng = np.random.default_rng(6)
    count = 2000
    alpha = rng.uniform(-math.pi, math.pi, (count, 4))
    roll, pitch = rng.uniform(-1.5, 1.5, (2, count))
    torque, lift = rng.normal(size=(count, 3)), rng.normal(size=count)
    scaled = scaled_decoupling_matrix(alpha, vehicle, roll, pitch)
    matrix = scaled * thrust_signs(vehicle)
    up = body_vertical(roll, pitch)

    lifts, thrusts, squared = allocation_of(alpha, vehicle)
    inverse, free = thrusts[..., :3], thrusts[..., 3]
    along = np.sum(up * lifts[:, 3], axis=1)
    across = (lifts[:, :3] @ up[..., None])[..., 0]
    share = (lift - np.sum(across * torque, axis=1)) / along
    found = (inverse @ torque[..., None])[..., 0] + share[:, None] * free

    least = np.linalg.svd(matrix, compute_uv=False)[:, -1]
    regular = least > 1e-3
    wanted = np.column_stack([torque, lift])[..., None]
    expected = np.linalg.solve(matrix[regular], wanted[regular])[..., 0]
    assert regular.mean() > 0.9
    assert found[regular] == pytest.approx(expected, rel=1e-6, abs=1e-6)
    size = np.linalg.norm(np.linalg.inv(matrix), axis=(1, 2))
    square = squared + (np.sum(across**2, axis=1) + 1) / along**2
    assert np.sqrt(square) == pytest.approx(size, rel=1e-6)
    assert lifts[0, 3, 2] >= 0


def test_nothing_is_divided_where_the_moment_matrix_has_lost_rank() -> None:
    delta = math.atan(PAPER.drag_ratio)
    alpha = math.pi / 2 + delta * np.array([1.0, -1.0, 1.0, -1.0])
    assert not any(part.any() for part in allocation_of(alpha, PAPER))


def sampled(stiffness: float, damping: float, start: float, t: Any) -> Any:
    """Return the solution of ë = −kp·e − kd·ė from rest at each step, integrated as the engine does."""
    value, rate, values = start, 0.0, [start]
    for step in np.diff(t):
        rate -= step * (stiffness * value + damping * rate)
        value += step * rate
        values.append(value)
    return np.array(values)


@pytest.mark.parametrize("timed", [RED, ASCENDING, flown_by(ASCENDING, BEETLE)])
def test_each_error_obeys_its_own_linear_equation(
    monkeypatch: pytest.MonkeyPatch, timed: TimedGait
) -> None:
    """Roll, pitch, yaw and altitude are decoupled, whatever the gait does; but for the step, to first order."""
    place = Engine.place

    def elsewhere(engine: Engine, alpha: Any, **others: Any) -> None:
        place(engine, alpha, **others, yaw=0.25)
        engine.data.qpos[2] = -0.15

    monkeypatch.setattr(Engine, "place", elsewhere)
    errors = []
    for step in (1e-3, 2.5e-4):
        settings = FlightSettings(
            duration=0.5,
            step=step,
            control_rate=1 / step,
            altitude_stiffness=60.0,
            altitude_damping=9.0,
            saturation=False,
        )
        flight = Simulation(repeated(timed), settings).run((0.3, -0.2))
        t = flight.column("t")
        expected = {
            "roll": sampled(100.0, 20.0, 0.3, t),
            "pitch": sampled(100.0, 20.0, -0.2, t),
            "yaw": sampled(100.0, 20.0, 0.25, t),
            "z": sampled(60.0, 9.0, -0.15, t),
        }
        errors.append(
            [np.abs(flight.column(name) - expected[name]).max() for name in expected]
        )
    coarse, fine = np.array(errors)
    assert (fine / 0.3 < coarse).all()
    assert (coarse < 2e-3).all()


def test_the_force_points_where_it_is_wanted() -> None:
    rng = np.random.default_rng(8)
    for _ in range(100):
        ax, ay, yaw = rng.uniform(-3, 3, 3)
        force = rng.normal(size=3) * 0.3 + [0, 0, 2]
        pushed = pushed_by(ax, ay, yaw, force)
        assert pushed / pushed[2] * 9.8 == pytest.approx([ax, ay, 9.8])


def pushed_by(ax: float, ay: float, yaw: float, force: Any) -> Any:
    """Return the force of a vehicle in the attitude that is wanted, in the axes of the world."""
    roll, pitch = wanted_attitude(ax, ay, 9.8, yaw, tuple(force))
    return Rotation.from_euler("ZYX", [yaw, pitch, roll]).apply(force)


def test_it_leans_by_45_degrees_at_most() -> None:
    pushed = pushed_by(300.0, -400.0, 0.0, [0.0, 0.0, 1.0])
    assert pushed * math.sqrt(2) == pytest.approx([0.6, -0.8, 1.0])


@pytest.mark.parametrize("eta", [1.0, 0.9])
def test_red_and_biased_gaits_follow_a_line(eta: float) -> None:
    timed = replace(ASCENDING, gait=ASCENDING.gait.biased(eta), period=4.0)
    settings = FlightSettings(
        reference="line",
        lap=2.0,
        size=0.5,
        duration=2.5,
    )
    flight = fly(timed, settings=settings)
    assert flight.tracking_error is not None
    assert flight.tracking_error < 0.03
    assert flight.column("x_wanted").max() == pytest.approx(0.5)
    assert flight.column("x")[-1] == pytest.approx(0.5, abs=0.02)


@pytest.mark.parametrize("kind", REFERENCES)
def test_references_have_their_derivatives_and_rest_at_both_ends(
    kind: Reference,
) -> None:
    settings = FlightSettings(reference=kind, size=1.7, lap=5.0)
    h = 1e-4
    t = np.linspace(0.05, 4.95, 99)
    before, now, after = (reference_at(settings, t + by) for by in (-h, 0.0, h))
    for order in (0, 1):
        change = (after[order] - before[order]) / (2 * h)
        assert change == pytest.approx(now[order + 1], abs=1e-6)
    places, velocities, accelerations = reference_at(settings, [0.0, 5.0, 9.0])
    assert not velocities.any()
    assert accelerations == pytest.approx(0, abs=1e-12)
    x = {"step": [1.7] * 3, "line": [0, 1.7, 1.7]}.get(kind, [0] * 3)
    assert places == pytest.approx(np.outer(x, [1, 0, 0]), abs=1e-12)
    if kind == "circle":
        radii = np.hypot(now[0][:, 0] - 1.7, now[0][:, 1])
        assert radii == pytest.approx(1.7, rel=1e-12)


@pytest.mark.parametrize("every", [1, 4, 20])
def test_gains_are_limited_by_the_poles_of_the_sampled_loop(every: int) -> None:
    """Of a map from one setting to the next: steps of an engine under a held input, a single step, and none."""
    rate = 1000.0 / every
    maps = []
    for steps in (every, 1):
        h = 1 / (rate * steps)
        step = np.array([[1, h], [0, 1]])
        move, push = np.eye(2), np.zeros(2)
        for _ in range(steps):
            move = step @ move
            push = step @ push + [h * h, h]
        maps.append((move, push))
    maps.append((move, np.array([0.5 / rate**2, 1 / rate])))
    rng = np.random.default_rng(10)
    allowed = 0
    for _ in range(200):
        kp = 10 ** rng.uniform(0, math.log10(6 * rate**2))
        kd = rate * rng.uniform(0, 2.2)
        poles = [
            np.linalg.eigvals(move - np.outer(push, [kp, kd])) for move, push in maps
        ]
        radius = np.abs(poles).max()
        try:
            FlightSettings(
                attitude_stiffness=kp, attitude_damping=kd, control_rate=rate
            )
        except InputError:
            assert radius > 0.98
        else:
            allowed += 1
            assert radius < 1
    assert allowed > 20


def test_position_gains_must_be_slower_than_attitude() -> None:
    """At 10 Hz gains of the place are refused that are stable at 100 Hz; without a place they do not count."""
    gains: dict[str, Any] = {
        "attitude_stiffness": 100.0,
        "attitude_damping": 12.0,
        "altitude_stiffness": 4.0,
        "altitude_damping": 4.0,
        "position_stiffness": 4.9,
        "position_damping": 10.0,
    }
    FlightSettings(control_rate=10.0, **gains)
    FlightSettings(reference="hover", control_rate=100.0, **gains)
    with pytest.raises(InputError) as caught:
        FlightSettings(reference="hover", control_rate=10.0, **gains)
    assert caught.value.field == "position_damping"
