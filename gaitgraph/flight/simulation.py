"""Flights: a course in the physics engine with servos, noise and wind, or refused before take-off."""

from __future__ import annotations

import math
import os
import struct
from dataclasses import replace
from itertools import repeat
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitgraph.angles import angle_from_text, in_degrees, is_list
from gaitgraph.errors import InputError, shown
from gaitgraph.flight.controller import (
    DIRECTION,
    WANTED,
    allocation_of,
    controller_of,
    observed,
)
from gaitgraph.flight.course import arm_response, repeated
from gaitgraph.flight.engine import Engine, engine_warnings, quaternions
from gaitgraph.flight.flight import (
    COLUMNS,
    OUTCOMES,
    Flight,
    FlightSettings,
    record_of,
    reference_at,
)
from gaitgraph.invertibility.matrices import thrust_signs
from gaitgraph.timing.joining import HOVER, Course, JoinedPath
from gaitgraph.timing.timed_gait import RowTimedGait, timed_gait_of
from gaitgraph.validation.report import broken_rules

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    import numpy.typing as npt

    from gaitgraph.gait.given import GaitLike
    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.timing.timed_gait import TimedGait
    from gaitgraph.vehicle import Vehicle

_DEFAULT_ATTITUDE = (
    0.3,
    -0.2,
)  # roll and pitch at the start of a flight that only levels out [rad]
_TUMBLING = 200.0  # rad/s
_LEAST_FLOOR = 1e-9
_LARGEST = 1e10  # of the engine's numbers
_UPRIGHT = 1e-3  # cosine of the pitch below which Euler angles are too inaccurate
_FARTHEST = 1e5  # m
_MOST_LEAD = 1.0  # s by which the controller looks ahead on a reference
_GUST_TIME = 1.0  # s over which gusts are correlated
_SETTLED_EVERY = 50  # control steps between two checks whether a flight has settled
_JOINED_EVERY = 10  # the same, whether it has joined level flight
_DECOUPLED = [
    3,
    4,
    5,
    2,
    9,
    10,
    11,
    8,
]  # roll, pitch, yaw, altitude, and their rates, among the numbers of a state
_FLIGHTS_OF_A_THREAD = 64  # or more
_FAILURES = (
    (
        "tumbling",
        "it tumbles just before {t:.3f} s: thrusts or accelerations exceed the range of the physics engine",
    ),
    (
        "tumbling",
        f"it tumbles at {{t:.3f}} s: it turns by more than {_TUMBLING:g} rad/s",
    ),
    ("tumbling", f"it is more than {_FARTHEST:g} m from the start at {{t:.3f}} s"),
    (
        "upended",
        "its nose points straight up or down at {t:.3f} s, where roll and yaw are not defined",
    ),
    (
        "sign change",
        "the decoupling matrix is singular just before {t:.3f} s: its determinant has changed sign",
    ),
    (
        "near singular",
        "the decoupling matrix nears singularity at {t:.3f} s: its least singular value is between {least:.2g} and "
        "{most:.2g}, and the floor is {floor:g}",
    ),
)
_CODES = np.array([OUTCOMES.index(name) for name, _ in _FAILURES])
_MOST_STEPS = 1_000_000  # they take about 1.5 GB
_LEAST_STEPS = 20  # of the engine in a period
_SMALL = 0.05  # rad and m: errors whose squares change thrusts by much less than they do themselves
_STILL = 1e-9  # rad of swing below which an arm stands still
_ENOUGH = 0.9  # share of its commanded swing that an arm must reach


class Simulation:
    """A course prepared for any number of flights: the engine, the servos' angles, and the allocation along them.

    `command` and `actual` are the commanded and reached tilt angles at every step of the engine, shape (n, 4) [rad];
    `controls` is the number of control steps.
    """

    def __init__(self, course: Course, settings: FlightSettings) -> None:
        vehicle = course.vehicle
        self.course, self.settings = course, settings
        self.engine = Engine(vehicle, step=settings.step, air=not settings.is_calm)
        seconds, every = settings.seconds_of(course), settings.steps_per_control
        step, period = settings.step, course.moving_period
        if seconds / step > _MOST_STEPS:
            raise InputError(
                f"duration must be at most {_MOST_STEPS} steps of {step:g} s, got {seconds:g} s",
                field="duration",
            )
        if 0.0 < period < _LEAST_STEPS * step * (1.0 - 1e-9):
            least = f"{_LEAST_STEPS} steps of {step:g} s ({_LEAST_STEPS * step:g} s)"
            raise InputError(
                f"period must be at least {least}, got {period:g} s; a smaller step helps too",
                field="period",
            )
        self.controls = max(round(seconds * settings.control_rate), 1)
        # Roll and pitch lag behind their wanted values by kd/kp, so references are read that much ahead.
        lead = min(settings.attitude_damping / settings.attitude_stiffness, _MOST_LEAD)
        ahead = (
            round(lead * settings.control_rate)
            if settings.reference != "attitude"
            else 0
        )
        steps: FloatArray = (
            np.arange((self.controls + ahead) * every + 1, dtype=float) * settings.step
        )
        lag = (
            settings.servo_lag
            if settings.servo_lag is not None
            else vehicle.servo_lag or 0.0
        )
        rate = settings.servo_rate or vehicle.max_tilt_rate or math.inf
        self.command: FloatArray = course.at(steps).alpha
        self.actual: FloatArray = arm_response(
            self.command, vehicle, settings.step, lag=lag, rate=rate
        )
        self._hinges = self.engine.servo_commands(self.actual)
        is_known = settings.arms_of(vehicle) == "served"
        assumed = self.actual if is_known else self.command
        self._knows_arms = is_known or np.array_equal(self.actual, self.command)
        self._interval, self._floor_squared = (
            every * step,
            max(settings.floor, _LEAST_FLOOR) ** 2,
        )
        allocation, t = (
            allocation_of(assumed[::every], vehicle),
            np.arange(self.controls + 1) * self._interval,
        )
        place, velocity, _ = reference_at(settings, t)
        acceleration = reference_at(settings, t + ahead * self._interval)[2]
        wanted = (
            allocation[ahead:, DIRECTION],
            place,
            velocity[:, :2],
            acceleration[:, :2],
        )
        self._known = np.hstack(
            [allocation[: self.controls + 1], *wanted]
        )  # to the controller, before the flight
        limit = (
            settings.thrust_limit
            if settings.thrust_limit is not None
            else vehicle.max_thrust
        )
        self._limits = (
            (0.0, limit or math.inf) if settings.saturation else (-math.inf, math.inf)
        )
        self._first_rates = (self.actual[1] - self.actual[0]) / step
        self._noise, self._gusts = (
            sensor_noise(settings, self.controls),
            gusts_of(settings, self.controls),
        )

    @property
    def warnings(self) -> tuple[str, ...]:
        """A line if an arm swings by much less than commanded while the gait runs."""
        flown = self.controls * self.settings.steps_per_control + 1
        t = np.arange(flown) * self.settings.step
        begin, end = self.course.gait_times
        runs = np.flatnonzero((t >= begin) & (t <= end))
        if not len(runs):
            return ()
        low, high = self.command[runs].min(axis=0), self.command[runs].max(axis=0)
        # An arm that enters the gait late comes from outside of its range, which is no part of its swing.
        reached = np.ptp(np.clip(self.actual[runs], low, high), axis=0)
        planned = high - low
        share = np.where(planned > _STILL, reached / np.maximum(planned, _STILL), 1.0)
        worst = int(
            np.argmin(share.round(6))
        )  # the first of those that differ by rounding alone
        if share[worst] >= _ENOUGH:
            return ()
        return (
            f"the servos do not follow: arm {worst + 1} swings by {reached[worst]:.3g} of the planned "
            f"{planned[worst]:.3g} rad, so another gait is flown; a longer period helps",
        )

    def run(self, attitude: tuple[float, float] = (0.0, 0.0)) -> Flight:
        """Fly from rest at the origin with a roll and a pitch [rad], until the course or the settings end."""
        settings, engine, vehicle, last = (
            self.settings,
            self.engine,
            self.course.vehicle,
            self.controls,
        )
        every, interval, (low, high) = (
            settings.steps_per_control,
            self._interval,
            self._limits,
        )
        thrusts_of, torque_of, lagging = (
            controller_of(settings, vehicle),
            gyroscopic_of(vehicle),
            vehicle.rotor_lag,
        )
        model, data, mj_step = engine.model, engine.data, engine.mujoco.mj_step
        place_of, speed_of, control = data.qpos.tolist, data.qvel.tolist, data.ctrl.data
        # A flight is many thousand short steps, so it uses plain numbers, as the controller does.
        table, hinges = np.zeros((last + 1, len(COLUMNS))), self._hinges.ravel().data
        memory, width = table.data, table.strides[0]
        record, set_thrusts = (
            struct.Struct("8x22d24x2d").pack_into,
            struct.Struct("4d").pack_into,
        )
        sign, floor_squared, sqrt, kept = 0.0, self._floor_squared, math.sqrt, last + 1
        failure: tuple[str, ...] = ()
        with engine_warnings() as warnings:
            engine.place(
                self.actual[0],
                roll=attitude[0],
                pitch=attitude[1],
                rates=self._first_rates,
            )
            for k, (known, noise) in enumerate(self._steps()):
                place, speed = place_of(), speed_of()
                state, measured, vertical, turning, distance = observed(
                    place, speed, noise
                )
                h1, h2, h3, h4, along, near, roll_d, pitch_d = thrusts_of(
                    measured, vertical, known
                )
                sign = sign or along
                fine = (
                    not (warnings and engine.gave_up), turning < _TUMBLING, distance < _FARTHEST,
                    vertical[3] >= _UPRIGHT, along * sign >= 0.0, near >= floor_squared,
                )  # fmt: skip
                if not all(fine):
                    end, why = _FAILURES[fine.index(False)]
                    failure = (
                        end,
                        why.format(
                            t=k * interval,
                            least=sqrt(near),
                            most=2 * sqrt(near),
                            floor=settings.floor,
                        ),
                    )
                    kept = k
                    break
                cut = not (
                    low <= h1 <= high
                    and low <= h2 <= high
                    and low <= h3 <= high
                    and low <= h4 <= high
                )
                if cut:
                    h1, h2, h3, h4 = (
                        low if one < low else high if one > high else one
                        for one in (h1, h2, h3, h4)
                    )
                record(
                    memory,
                    k * width,
                    *state,
                    *place[7:],
                    h1,
                    h2,
                    h3,
                    h4,
                    cut,
                    sqrt(near),
                    roll_d,
                    pitch_d,
                )
                if k == last:
                    break
                set_thrusts(control, 0, h1, h2, h3, h4)
                if lagging is not None and k == 0:
                    data.act[:] = (
                        h1,
                        h2,
                        h3,
                        h4,
                    )  # the rotors turn before the flight begins
                if self._gusts is not None:
                    model.opt.wind[:] = self._gusts[k]
                if torque_of is not None:
                    acting = (
                        data.act.tolist() if lagging is not None else (h1, h2, h3, h4)
                    )
                    data.qfrc_applied[3:6] = torque_of(
                        place[7:], speed[3:6], speed[6:], acting
                    )
                for step in range(4 * k * every, 4 * (k + 1) * every, 4):
                    control[4:] = hinges[step : step + 4]
                    mj_step(model, data)
        table[:, 0], table[:, -5:-2] = (
            np.arange(last + 1) * interval,
            self._known[:, WANTED],
        )
        return record_of(
            self.course, settings, attitude, rows=table[:kept].copy(), failure=failure
        )

    def _steps(self) -> Iterator[tuple[tuple[float, ...], list[float] | None]]:
        """Yield what the controller knows before the flight, and the errors of its sensors, at each control step."""
        known = struct.iter_unpack(f"{self._known.shape[1]}d", self._known.tobytes())
        return zip(known, self._noise or repeat(None), strict=False)

    def run_many(
        self,
        attitudes: FloatArray,
        *,
        until_settled: float,
        progress: Callable[[float], None],
    ) -> tuple[npt.NDArray[np.int8], FloatArray, FloatArray]:
        """Fly from many attitudes, shape (n, 2) [rad], each until it has settled, but not before so many seconds.

        Return the outcomes, as indices of :data:`gaitgraph.flight.flight.OUTCOMES`; the settling times, or the ends of
        the flights [s]; and the largest thrusts [N]. They do not depend on the number of cores: the controller computes
        one array of all flights at a time, and the engine steps them on all cores. The reference must be "attitude".

        A flight ends before its time once it has certainly settled: the guide to flight says when, and why.
        """
        from mujoco.rollout import Rollout

        settings, engine, vehicle, mujoco = (
            self.settings,
            self.engine,
            self.course.vehicle,
            self.engine.mujoco,
        )
        every, interval, last, (low, high) = (
            settings.steps_per_control,
            self._interval,
            self.controls,
            self._limits,
        )
        thrusts_of, torque_of = (
            controller_of(settings, vehicle, np),
            gyroscopic_of(vehicle, np),
        )
        model, kinds, lagging = (
            engine.model,
            mujoco.mjtState,
            vehicle.rotor_lag is not None,
        )
        inputs = kinds.mjSTATE_CTRL.value | kinds.mjSTATE_QFRC_APPLIED.value
        engine.place(self.actual[0], rates=self._first_rates)
        # The time starts at 1 s; where the engine gives up it starts again at 0 s.
        state = np.concatenate(
            [[1.0], engine.data.qpos, engine.data.qvel, engine.data.act]
        )
        states = np.tile(state, (len(attitudes), 1))
        states[:, 4:8] = quaternions(*attitudes.T)
        outcomes, (seconds, largest) = (
            np.zeros(len(states), np.int8),
            np.zeros((2, len(states))),
        )
        # Of those that fly: their numbers, the rows since which they are within tolerance, their largest thrusts.
        flights, since, peak, sign = np.arange(len(states)), *np.zeros((3, len(states)))
        check_at = math.ceil(until_settled / interval)
        joins = self._joining_level_flight(check_at)
        threads = min(os.cpu_count() or 1, len(states) // _FLIGHTS_OF_A_THREAD)
        copies = [mujoco.MjData(model) for _ in range(max(threads, 1))]
        same: dict[str, Any] = {
            "control_spec": inputs,
            "nstep": every,
            "skip_checks": True,
        }
        with engine_warnings(), Rollout(nthread=threads if threads > 1 else 0) as pool:
            for k, (known, noise) in enumerate(self._steps()):
                columns = np.ascontiguousarray(states.T)
                state, measured, vertical, turning, distance = observed(
                    columns[1:12], columns[12:], noise, np
                )
                *asked, along, near, _, _ = thrusts_of(measured, vertical, known)
                given, sign = np.clip(asked, low, high), along if k == 0 else sign
                fine = np.array([
                    (columns[0] >= 1.0) & (peak <= _LARGEST), turning < _TUMBLING, distance < _FARTHEST,
                    vertical[3] >= _UPRIGHT, along * sign >= 0.0, near >= self._floor_squared,
                ])  # fmt: skip
                ended = failed = ~fine.all(axis=0)
                peak = np.where(
                    failed, peak, np.maximum(peak, np.abs(given).max(axis=0))
                )
                since[np.abs(state[2:6]).max(axis=0) > settings.tolerance] = k + 1
                settled = (k - since) * interval >= settings.held - 1e-9
                if k == last or k >= check_at:
                    check_at, joins = check_at + _SETTLED_EVERY, None
                    ended = failed | settled | (k == last)
                elif joins is not None and k % _JOINED_EVERY == 0:
                    settled, later = joins(k, np.array(state), peak)
                    settled &= (
                        min(check_at, last) - since
                    ) * interval >= settings.held - 1e-9
                    peak, ended = (
                        np.where(settled, np.maximum(peak, later), peak),
                        failed | settled,
                    )
                if ended.any():
                    at, going = flights[ended], ~ended
                    codes = np.where(
                        failed, _CODES[fine.argmin(axis=0)], np.where(settled, 0, 1)
                    )
                    rows = np.where(failed, max(k - 1, 0), np.where(settled, since, k))
                    outcomes[at], seconds[at], largest[at] = (
                        codes[ended],
                        rows[ended] * interval,
                        peak[ended],
                    )
                    if not going.any():
                        break
                    left: list[Any] = [
                        one[going] for one in (flights, states, since, peak, sign)
                    ]
                    flights, states, since, peak, sign = left
                    columns, given = columns[:, going], given[:, going]
                control = np.zeros((len(flights), every, model.nu + model.nv))
                control[:, :, :4], control[:, :, 4:8] = (
                    given.T[:, None],
                    self._hinges[k * every : (k + 1) * every],
                )
                if lagging and k == 0:
                    states[:, 22:] = given.T
                if self._gusts is not None:
                    model.opt.wind[:] = self._gusts[k]
                if torque_of is not None:
                    acting = states[:, 22:].T if lagging else given
                    torque = torque_of(
                        columns[8:12], columns[15:18], columns[18:22], acting
                    )
                    control[:, :, 11:14] = np.transpose(torque)[:, None]
                moved = np.empty((len(flights), every, states.shape[1]))
                pool.rollout(
                    [model] * len(flights),
                    copies,
                    np.ascontiguousarray(states),
                    control,
                    state=moved,
                    **same,
                )
                states = moved[:, -1]
                if k % _SETTLED_EVERY == 0:
                    progress(k / last)
        progress(1.0)
        return outcomes, seconds, largest

    def _joining_level_flight(
        self, until: int
    ) -> (
        Callable[[int, FloatArray, FloatArray], tuple[npt.NDArray[np.bool_], float]]
        | None
    ):
        """Return which flights have joined level flight, whose thrusts are those of hover, and stay up to a step.

        The function takes a control step, the states of flights as rows, and their largest thrusts so far; it returns
        which have joined, and the largest thrust of hover from then on.

        The errors e in roll, pitch, yaw and altitude obey ë = −kp·e − kd·ė while no thrust is cut, so e² + ė²/kp never
        grows, nor does it in steps h of the engine, since kp·h² ≤ kd·h·(2 − kd·h) with all gains that join. With its
        root r, |ë| is at most √(kp² + kd²·kp)·r from then on, which bounds to first order how far thrusts go from those
        of hover; a tilt adds its square of them. A flight has joined once r is at most nine tenths of the tolerance,
        and small; twice that bound is at most what thrusts of hover are away from their limits from then on; the
        largest thrust is known to 1 part in 5000; and the bound of the least singular value stays above the floor by
        twice the tilt, which is the most that a tilt takes from it, since the norm of the rotors' four axes is 2. None
        joins where the controller does not cancel all else: with wind, noise, gains that are too high for the step,
        thrusts that are held for more than a step of the engine, rotor lag, or inertia of rotors or arms.
        """
        settings, vehicle, interval, (low, high) = (
            self.settings,
            self.course.vehicle,
            self._interval,
            self._limits,
        )
        stiffness, damping = np.array([
            [settings.attitude_stiffness] * 3 + [settings.altitude_stiffness],
            [settings.attitude_damping] * 3 + [settings.altitude_damping],
        ])  # fmt: skip
        calm = self._noise is None and self._gusts is None and self._knows_arms
        light = not (vehicle.rotor_lag or vehicle.arm_inertia or vehicle.rotor_inertia)
        # An accurate step is short beside the swing and the decay of an error.
        fine = (stiffness * interval**2).max() <= 0.01 and (
            damping * interval
        ).max() <= 0.1
        if not (calm and light and fine and settings.steps_per_control == 1):
            return None
        mass, inertia, length = vehicle.require(
            "mass", "inertia", "arm_length", purpose="flight"
        )
        level = self._known[: until + 1]
        upward = np.maximum(level[:, DIRECTION][:, 2], 1e-12)
        hover = (mass * vehicle.gravity / upward)[:, None] * level[:, 25:29]
        nearness = 1.0 / np.sqrt(
            level[:, 12] + (1.0 + np.sum(level[:, 6:9] ** 2, axis=1)) / upward**2
        )
        # From each control step on: how far hover stays from the limits, its largest thrust, and the largest change of
        # each thrust, per root of each error, then per tilt.
        room = np.minimum(hover - low, min(high, _LARGEST) - hover).min(axis=1)
        room, clear = np.minimum.accumulate(
            np.stack([room, nearness - settings.floor])[:, ::-1], axis=1
        )[:, ::-1]
        later = np.maximum.accumulate(np.abs(hover).max(axis=1)[::-1])[::-1]
        steepest, share = (
            np.sqrt(stiffness**2 + damping**2 * stiffness),
            upward[:, None, None],
        )
        free = level[:, 25:29, None] / share
        turning = (
            (level[:, 13:25].reshape(-1, 4, 3) - free * level[:, None, 6:9])
            * inertia
            / length
            * steepest[:3]
        )
        climbing, leaning = (
            free * mass * steepest[3],
            hover[:, :, None] * level[:, None, 10:8:-1] / share,
        )
        change = np.abs(np.concatenate([turning, climbing, leaning], axis=2))
        change = np.maximum.accumulate(change[::-1])[::-1]
        small = min(0.9 * settings.tolerance, _SMALL)

        def joins(
            k: int, state: FloatArray, peak: FloatArray
        ) -> tuple[npt.NDArray[np.bool_], float]:
            off = state[_DECOUPLED] ** 2
            root = np.sqrt(off[:4] + off[4:] / stiffness[:, None])
            tilt = np.hypot(root[0], root[1])
            apart = (
                2.0 * (change[k] @ np.concatenate([root, root[:2]])).max(axis=0)
                + later[k] * tilt**2
            )
            known = (apart <= 2e-4 * later[k]) | (apart <= peak - later[k])
            known &= 2.0 * tilt <= clear[k]
            return (root.max(axis=0) <= small) & (apart <= room[k]) & known, float(
                later[k]
            )

        return joins


def sensor_noise(settings: FlightSettings, count: int) -> list[list[float]] | None:
    """Return the sensors' errors at every control step (place, attitude, velocity, rates), or None for none."""
    sizes = (
        settings.position_noise,
        settings.attitude_noise,
        settings.velocity_noise,
        settings.rate_noise,
    )
    if not any(sizes):
        return None
    drawn = np.random.default_rng([settings.seed, 0]).standard_normal((count + 1, 12))
    return (drawn * np.repeat(sizes, 3)).tolist()  # type: ignore[no-any-return]


def gusts_of(settings: FlightSettings, count: int) -> FloatArray | None:
    """Return the wind at every control step, shape (count + 1, 3) [m/s], or None if the air is calm."""
    if settings.is_calm:
        return None
    from scipy.signal import lfilter

    keep = math.exp(-1.0 / (settings.control_rate * _GUST_TIME))
    drawn = np.random.default_rng([settings.seed, 1]).standard_normal((count + 1, 3))
    drawn[1:] *= math.sqrt(1.0 - keep * keep)
    return np.asarray(
        settings.wind + settings.gust * lfilter([1.0], [1.0, -keep], drawn, axis=0)
    )


def gyroscopic_of(
    vehicle: Vehicle, functions: Any = math
) -> Callable[..., tuple[Any, ...]] | None:
    """Return a function that computes the rotors' gyroscopic torque on the body [N m]; None without a rotor inertia.

    It takes tilt angles, body rates, tilt rates and thrusts: numbers, or arrays with `functions` of numpy. The part
    about a hinge acts on the body through the servo.
    """
    if vehicle.rotor_inertia is None:
        return None
    (coefficient,) = vehicle.require(
        "thrust_coefficient", purpose="the gyroscopic torque of a rotor_inertia"
    )
    momenta = (thrust_signs(vehicle) * vehicle.rotor_inertia).tolist()
    arms = [(math.cos(azimuth), math.sin(azimuth)) for azimuth in vehicle.arm_angles]
    sin, cos, sqrt, copysign = (
        functions.sin,
        functions.cos,
        functions.sqrt,
        functions.copysign,
    )

    def torque(
        tilts: Any, body_rates: Any, rates: Any, thrusts: Any
    ) -> tuple[Any, ...]:
        p, q, r = body_rates
        t1 = t2 = t3 = 0.0
        for (cz, sz), momentum, tilt, rate, thrust in zip(
            arms, momenta, tilts, rates, thrusts, strict=True
        ):
            spun = momentum * copysign(sqrt(abs(thrust) / coefficient), thrust)
            # −ω × h in body axes: ω of the arm, h along the tilted rotor axis.
            w1, w2, across, up = (
                p + rate * cz,
                q + rate * sz,
                spun * sin(tilt),
                spun * cos(tilt),
            )
            h1, h2 = sz * across, -cz * across
            t1, t2, t3 = (
                t1 + r * h2 - w2 * up,
                t2 + w1 * up - r * h1,
                t3 + w2 * h1 - w1 * h2,
            )
        return t1, t2, t3

    return torque


def before_take_off(
    course: Course, settings: FlightSettings, *, anyway: bool = False
) -> tuple[str, tuple[str, ...]]:
    """Return why a course's gait cannot fly with given settings, "" if it can, and the warnings.

    The limits of thrusts and tilt rates are those of the flight, which may differ from the vehicle's. With `anyway`
    reasons become warnings.
    """
    timed, vehicle = course.timed, course.vehicle
    thrust = (
        (settings.thrust_limit or vehicle.max_thrust) if settings.saturation else None
    )
    limited = vehicle.replace(
        max_thrust=thrust, max_tilt_rate=settings.servo_rate or vehicle.max_tilt_rate
    )
    judged = timed.with_gait(replace(timed.gait, vehicle=limited))
    forbidden, warnings = broken_rules(judged.check(), pulling=not settings.saturation)
    if isinstance(timed, RowTimedGait):
        if not timed.closed:
            jump, last = (
                np.linalg.norm(timed.gait.alpha[-1] - timed.gait.alpha[0]),
                timed.times[-1] - timed.times[-2],
            )
            back = f"the {jump:.3g} rad from its last row back to the first are flown within {last:.3g} s"
            warnings.append(f"the table is not closed: {back}")
        if not timed.law_stated:
            straight = f"{timed.samples} rows are flown straight from one to the next"
            warnings.append(f"the timing matches no built-in law: {straight}")
    # Whether only a part of the course, the period or the lap is flown.
    seconds, is_finite = settings.seconds_of(course), math.isfinite(course.duration)
    for name, whole, meaning in (
        ("course", course.duration if is_finite else 0.0, "the rest is not flown"),
        (
            "period",
            course.moving_period * (not is_finite),
            "the rest of the gait is not tested",
        ),
        (
            "lap",
            settings.lap * (settings.reference in ("line", "circle")),
            "the reference is not followed to its end",
        ),
    ):
        if seconds < whole * (1 - 1e-9):
            part = f"{100 * seconds / whole:.3g} % of a {name} of {whole:g} s"
            warnings.append(f"the flight of {seconds:g} s is {part}: {meaning}")
    if anyway:
        return "", (
            *(f"flown although it is not flyable: {message}" for message in forbidden),
            *warnings,
        )
    return forbidden[0] if forbidden else "", tuple(warnings)


def fly(
    gait: GaitLike | Course,
    *,
    attitude: tuple[float | str, float | str] | None = None,
    settings: FlightSettings | None = None,
    anyway: bool = False,
) -> Flight:
    """Fly a gait in the physics engine MuJoCo, by feedback linearisation with the thrusts as the only inputs.

    Parameters
    ----------
    gait
        A gait in any form, which is repeated; or a course, see :func:`~gaitgraph.flight.course.from_hover`.
    attitude
        Roll and pitch at the start [rad, or texts such as "10deg"]; by default (0.3, −0.2) for a gait with the
        reference "attitude", else level.
    settings, anyway
        See :class:`~gaitgraph.flight.flight.FlightSettings`; whether to fly a gait that is not flyable.

    Returns
    -------
    Flight
        Truthy when it settled. A gait that cannot fly is refused before take-off, with the reason. There is a warning
        for a gait that is only off the surfaces, as a biased gait is, for a flight of a part of the period, the lap or
        the course, and for servos that do not follow.

    Raises
    ------
    InputError, MissingConstant, MissingExtra
        If a value is wrong, the vehicle states no mass, inertia or arm length, or mujoco is not installed.

    Notes
    -----
    Rotors follow their commands at once, or with the vehicle's `rotor_lag`; the thrusts of a record are the commands,
    and the controller does not know the lag. Not modelled: ground effect, wakes, flexible arms, delays. The controller
    knows the vehicle's constants exactly. It assumes the planned tilt angles, unless the vehicle has `servo_feedback`
    or the settings say otherwise.

    Examples
    --------
    >>> from gaitgraph.gait.gait import lift
    >>> gait = lift([(1.178, -1.178), (1.178, -0.393), (0.393, -0.393), (0.393, -1.178)], "red")
    >>> flight = fly(gait.parametrize(1.0), settings=FlightSettings(duration=1.5))
    >>> flight.settled, round(flight.settling_time, 1), round(flight.peak_thrust_share, 1)
    (True, 0.4, 2.9)
    """
    settings = FlightSettings() if settings is None else settings
    course = gait if isinstance(gait, Course) else _course_of(timed_gait_of(gait))
    if attitude is None:
        levels_out = settings.reference == "attitude" and HOVER not in course.phases
        attitude = _DEFAULT_ATTITUDE if levels_out else (0.0, 0.0)
    start = checked_attitude(attitude)
    course.vehicle.require("mass", "inertia", "arm_length", purpose="flight")
    refusal, warnings = before_take_off(course, settings, anyway=anyway)
    if refusal:
        failure = "refused", f"refused before take-off: {refusal}"
        return record_of(course, settings, start, failure=failure, warnings=warnings)
    simulation = Simulation(course, settings)
    return replace(simulation.run(start), warnings=(*warnings, *simulation.warnings))


def _course_of(motion: TimedGait) -> Course:
    """Return the course of a mission, or that which repeats a gait, or runs a path once."""
    if isinstance(motion, JoinedPath) and motion.course.phases[0] == HOVER:
        return motion.course
    return repeated(motion)


def checked_attitude(attitude: Any) -> tuple[float, float]:
    """Return roll and pitch in radians, or raise InputError."""
    parts = attitude if is_list(attitude) else ()
    angles = [angle_from_text(part, "attitude") for part in parts]
    if (
        len(angles) != 2
        or not abs(angles[0]) <= math.pi
        or not abs(angles[1]) < math.pi / 2
    ):
        wanted = "a roll from -pi to pi and a pitch between -pi/2 and pi/2"
        hint = next(filter(None, map(in_degrees, parts)), "")
        raise InputError(
            f"attitude must be {wanted}, got {shown(attitude)}{hint}", field="attitude"
        )
    return angles[0], angles[1]
