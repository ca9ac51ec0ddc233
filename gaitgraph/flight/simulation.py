"""Flights: a course in the physics engine with servos, noise and wind, or refused before take-off.

One flight and many are flown by the same functions: one with plain numbers, which are ten times quicker than arrays of
one number, and many with arrays.
"""

from __future__ import annotations

import math
from array import array
from dataclasses import replace
from itertools import repeat
from operator import add
from struct import Struct
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitgraph.angles import HALF_PI, angle_from_text, in_degrees, is_list
from gaitgraph.errors import wrong
from gaitgraph.flight.controller import (
    LEVEL,
    Command,
    Motion,
    Step,
    Wanted,
    allocation_of,
    controller_of,
    motion_of,
)
from gaitgraph.flight.course import arm_response, repeated
from gaitgraph.flight.engine import START, Engine, Fleet, engine_warnings
from gaitgraph.flight.flight import (
    OUTCOMES,
    Flight,
    FlightSettings,
    checked_settings,
    record_of,
    reference_at,
)
from gaitgraph.invertibility.matrices import BoolArray, thrust_signs
from gaitgraph.timing.joining import HOVER, Course, JoinedPath
from gaitgraph.timing.timed_gait import RowTimedGait, timed_gait_of
from gaitgraph.validation.report import broken_rules

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    import numpy.typing as npt

    from gaitgraph.flight.flight import Outcome
    from gaitgraph.gait.given import GaitLike
    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.timing.timed_gait import TimedGait
    from gaitgraph.vehicle import Vehicle

_DEFAULT_ATTITUDE = (0.3, -0.2)  # of a flight that only levels out [rad]
_TUMBLING = 200.0  # rad/s
_FARTHEST = 1e5  # m
_STEEPEST = math.acos(1e-3)  # pitch above which Euler angles are too inaccurate
_LARGEST = 1e10  # N, the engine takes no larger numbers
_LEAST_FLOOR = 1e-9
_MOST_LEAD = 1.0  # s by which the controller looks ahead on a reference
_GUST_TIME = 1.0  # s over which gusts are correlated
_MOST_STEPS = 1_000_000  # they take about 1.5 GB
_LEAST_STEPS = 20  # of the engine in a period
_STILL = 1e-9  # rad of swing below which an arm stands still
_ENOUGH = 0.9  # share of its commanded swing that an arm must reach
_FAILURES: tuple[tuple[Outcome, str], ...] = (
    (
        "tumbling",
        "it tumbles just before {t:.3f} s: accelerations exceed the range of the physics engine",
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
        "the decoupling matrix nears singularity at {t:.3f} s: its least singular value is between {near:.2g} and "
        "{twice:.2g}, and the floor is {floor:g}",
    ),
)
"""Outcome and reason of a flight that breaks a condition of :func:`in_flight`."""
_SETTLED, _NOT_SETTLED = OUTCOMES.index("settled"), OUTCOMES.index("not settled")
_CODES = np.array([OUTCOMES.index(outcome) for outcome, _ in _FAILURES])


class InAir:
    """The books of many flights: how each ended, and of those in the air an element of each of four arrays."""

    def __init__(self, count: int, simulation: Simulation, until: float) -> None:
        self.outcomes = np.zeros(count, np.int8)
        self.seconds, self.peaks = np.zeros(count), np.zeros(count)
        self.number = np.arange(count)
        self.sign: Any = np.zeros(count)  # of the determinant at the start
        self.since = np.zeros(count, int)  # control step since when it is in tolerance
        self.peak = np.zeros(count)  # largest thrust [N]
        self._simulation, self._until = simulation, until

    def end(
        self, k: int, motion: Motion, thrusts: FloatArray, conditions: BoolArray
    ) -> BoolArray:
        """Keep the books at a control step, and return which flights end there.

        `conditions` are those of :func:`in_flight`, shape (6, n).
        """
        settings, interval = self._simulation.settings, self._simulation.interval
        failed = ~conditions.all(axis=0)
        peak = np.maximum(self.peak, np.abs(thrusts).max(axis=0))
        self.peak = np.where(failed, self.peak, peak)
        errors = np.abs([motion.z, motion.roll, motion.pitch, motion.yaw])
        self.since[errors.max(axis=0) > settings.tolerance] = k + 1
        settled = (k - self.since) * interval >= settings.held - 1e-9
        may_end = k * interval >= self._until - 1e-9
        is_last = k == self._simulation.controls
        ended: BoolArray = failed | (settled & may_end) | np.full_like(failed, is_last)
        if ended.any():
            cases, number = [failed, settled], self.number[ended]
            reasons = _CODES[conditions.argmin(axis=0)]
            codes = np.select(cases, [reasons, _SETTLED], _NOT_SETTLED)
            steps = np.select(cases, [max(k - 1, 0), self.since], k)
            self.outcomes[number] = codes[ended]
            self.seconds[number] = steps[ended] * interval
            self.peaks[number] = self.peak[ended]
            self.number, self.sign = self.number[~ended], self.sign[~ended]
            self.since, self.peak = self.since[~ended], self.peak[~ended]
        return ended


def in_flight(
    time: Any,
    motion: Motion,
    measured: Motion,
    command: Command,
    sign: Any,
    floor: float,
) -> tuple[Any, ...]:
    """Return which of the conditions hold without which a flight ends; all are numbers, or arrays of many flights.

    `time` is that of the engine, `sign` has the sign of the determinant at the start, or is zero.
    """
    x, y, z, *_, p, q, r = motion
    return (
        time >= START,
        abs(p) + abs(q) + abs(r) < _TUMBLING,
        abs(x) + abs(y) + abs(z) < _FARTHEST,
        abs(measured.pitch) <= _STEEPEST,
        command.along * sign >= 0.0,
        command.nearness >= floor,
    )


def with_errors(motion: Motion, errors: Sequence[float] | None) -> Motion:
    """Return what sensors measure of a motion."""
    if errors is None:
        return motion
    return Motion(*map(add, motion, errors))


def leading(wanted: Sequence[Any], reached: Sequence[Any], reach: float) -> list[Any]:
    """Return the commands that bring rotors with a lag to wanted thrusts within a control step [N].

    `reach` is the part of the way to its command that a rotor goes in a control step.
    """
    return [
        thrust + (target - thrust) / reach
        for target, thrust in zip(wanted, reached, strict=True)
    ]


class Simulation:
    """A course prepared for any number of flights: the engine, the servos' angles, and the allocation along them.

    `command` and `actual` are the commanded and reached tilt angles at every step of the engine, shape (n, 4) [rad];
    `controls` is the number of control steps, `interval` the time between two [s].
    """

    def __init__(self, course: Course, settings: FlightSettings) -> None:
        _check_steps(course, settings)
        vehicle, every = course.vehicle, settings.steps_per_control
        self.course, self.settings = course, settings
        self.engine = Engine(vehicle, step=settings.step, air=not settings.is_calm)
        seconds = settings.seconds_of(course)
        self.controls = max(round(seconds * settings.control_rate), 1)
        self.interval = every * settings.step
        ahead = 0
        if settings.reference != "attitude":
            # Roll and pitch lag behind their wanted values by kd/kp, so references are read that much ahead.
            lead = settings.attitude_damping / settings.attitude_stiffness
            ahead = round(min(lead, _MOST_LEAD) * settings.control_rate)
        count = (self.controls + ahead) * every + 1
        steps: FloatArray = settings.step * np.arange(count, dtype=float)
        self.command: FloatArray = course.at(steps).alpha
        lag: Any = settings.servo_lag
        if lag is None:
            lag = vehicle.servo_lag
        rate = settings.servo_rate or vehicle.max_tilt_rate or math.inf
        served: FloatArray = arm_response(
            self.command, vehicle, settings.step, lag=lag or 0.0, rate=rate
        )
        self.actual: FloatArray = served + np.array(settings.servo_errors)
        hinges = self.engine.servo_commands(self.actual)
        self._hinges = hinges[: self.controls * every]  # none in the last control step
        self._first_rates = (self.actual[1] - self.actual[0]) / settings.step
        assumed = self.command
        if settings.arms_of(vehicle) == "served":
            assumed = served
        self._allocation = allocation_of(assumed[::every], vehicle)
        self._wanted = self._references(ahead)
        self._floor = max(settings.floor, _LEAST_FLOOR)
        self._reach = 1.0
        if vehicle.rotor_lag is not None:
            self._reach = -math.expm1(-self.interval / vehicle.rotor_lag)
        self._limits = (-_LARGEST, _LARGEST)
        if settings.saturation:
            limit = settings.thrust_limit or vehicle.max_thrust or _LARGEST
            self._limits = (0.0, limit)
        self._noise = sensor_noise(settings, self.controls)
        self._gusts = gusts_of(settings, self.controls)

    def _references(self, ahead: int) -> tuple[FloatArray, ...]:
        """Return what is wanted at every control step, the acceleration and its force some steps ahead."""
        t = np.arange(self.controls + 1) * self.interval
        place, velocity, _ = reference_at(self.settings, t)
        _, _, acceleration = reference_at(self.settings, t + ahead * self.interval)
        return place, velocity, acceleration, self._allocation.lifts[ahead:, 3]

    @property
    def warnings(self) -> tuple[str, ...]:
        """A line if an arm swings by much less than commanded while the gait runs."""
        if np.array_equal(self.actual, self.command):
            return ()
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
        worst = int(np.argmin(share.round(6)))  # the first of those that are alike
        if share[worst] >= _ENOUGH:
            return ()
        return (
            f"the servos do not follow: arm {worst + 1} swings by {reached[worst]:.3g} of the planned "
            f"{planned[worst]:.3g} rad, so another gait is flown; a longer period helps",
        )

    def run(self, attitude: tuple[float, float] = (0.0, 0.0)) -> Flight:
        """Fly from rest at the origin with a roll and a pitch [rad], until the course or the settings end."""
        settings, vehicle, engine = self.settings, self.course.vehicle, self.engine
        every = settings.steps_per_control
        command_of = controller_of(settings, vehicle)
        torque_of = gyroscopic_of(vehicle)
        model, data, mj_step = engine.model, engine.data, engine.mujoco.mj_step
        lags, gusts, floor = engine.lags, self._gusts, self._floor
        low, high = self._limits
        places, speeds = data.qpos, data.qvel  # views of what the engine holds
        set_inputs, control = Struct("8d").pack_into, data.ctrl  # faster than an array
        log = array("d")  # faster than lists of numbers
        roll, pitch = attitude
        engine.place(
            self.actual[0],
            roll=roll,
            pitch=pitch,
            rates=self._first_rates,
        )
        failure, sign = None, 0.0
        with engine_warnings():
            for k, (allocation, wanted, errors) in enumerate(self._known()):
                place, speed = places.tolist(), speeds.tolist()
                motion = motion_of(place, speed)
                measured = with_errors(motion, errors)
                command = command_of(measured, allocation, wanted)
                conditions = in_flight(
                    data.time, motion, measured, command, sign, floor
                )
                if not all(conditions):
                    failure = self._failure(conditions.index(False), k, command)
                    break
                sign = sign or command.along
                thrusts = command.thrusts
                if lags and k > 0:
                    thrusts = leading(thrusts, data.act, self._reach)
                if not low <= min(thrusts) <= max(thrusts) <= high:
                    thrusts = [min(max(thrust, low), high) for thrust in thrusts]
                log.fromlist([*motion, *place[7:], *thrusts, *command[2:]])
                if k == 0:
                    data.act[:] = thrusts[: model.na]  # the rotors turn already
                if torque_of is not None:
                    acting = data.act if lags else thrusts
                    torque = torque_of(place[7:], speed[3:6], speed[6:], acting)
                    data.qfrc_applied[3:6] = torque
                if gusts is not None:
                    model.opt.wind[:] = gusts[k]
                for angles in self._hinges[k * every : (k + 1) * every].tolist():
                    set_inputs(control, 0, *thrusts, *angles)
                    mj_step(model, data)
        return record_of(self.course, settings, attitude, self._table(log), failure)

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
        """
        settings, vehicle, engine = self.settings, self.course.vehicle, self.engine
        every = settings.steps_per_control
        command_of = controller_of(settings, vehicle, np)
        torque_of = gyroscopic_of(vehicle, np)
        engine.place(self.actual[0], rates=self._first_rates)
        air = InAir(len(attitudes), self, until_settled)
        with engine_warnings(), Fleet(engine, attitudes) as fleet:
            for k, (allocation, wanted, errors) in enumerate(self._known()):
                state = fleet.state()
                motion = motion_of(state.place, state.speed, np)
                measured = with_errors(motion, errors)
                command = command_of(measured, allocation, wanted)
                conditions = in_flight(
                    state.time, motion, measured, command, air.sign, self._floor
                )
                if k == 0:
                    air.sign = command.along
                thrusts: Any = command.thrusts
                if engine.lags and k > 0:
                    thrusts = leading(thrusts, state.thrusts, self._reach)
                thrusts = np.clip(thrusts, *self._limits)
                ended = air.end(k, motion, thrusts, np.array(conditions))
                if ended.all():
                    break
                fleet.keep(~ended)
                thrusts = thrusts[:, ~ended]
                if engine.lags and k == 0:
                    fleet.spin_rotors(thrusts)  # they turn already
                torque = None
                if torque_of is not None:
                    state = fleet.state()
                    acting = state.thrusts if engine.lags else thrusts
                    torque = torque_of(
                        state.tilts, state.speed[3:], state.tilt_rates, acting
                    )
                if self._gusts is not None:
                    engine.model.opt.wind[:] = self._gusts[k]
                hinges = self._hinges[k * every : (k + 1) * every]
                fleet.advance(thrusts, hinges, torque)
                progress(k / self.controls)
        progress(1.0)
        return air.outcomes, air.seconds, air.peaks

    def _known(self) -> Iterator[tuple[Step, Wanted, list[float] | None]]:
        """Yield what the controller knows before the flight, and the errors of its sensors, at each control step."""
        lifts, thrusts, squared = self._allocation
        to_lists = np.ndarray.tolist  # much faster than small arrays
        allocation: Iterator[Any] = zip(
            map(to_lists, lifts), map(to_lists, thrusts), squared.tolist(), strict=True
        )
        wanted: Iterator[Wanted] = repeat(LEVEL)
        if self.settings.reference != "attitude":
            wanted = map(Wanted, *(part.tolist() for part in self._wanted))
        noise = self._noise or repeat(None, self.controls + 1)
        return zip(allocation, wanted, noise, strict=False)

    def _failure(self, condition: int, k: int, command: Command) -> tuple[Outcome, str]:
        """Return outcome and reason of a flight in which a condition does not hold at a control step."""
        outcome, reason = _FAILURES[condition]
        near = command.nearness
        return outcome, reason.format(
            t=k * self.interval, near=near, twice=2 * near, floor=self.settings.floor
        )

    def _table(self, log: Sequence[float]) -> FloatArray:
        """Return the rows of a flight with all of its columns: the time, saturation and the wanted place too."""
        rows = np.array(log).reshape(-1, 23)
        moved, thrusts, nearness, leaning = np.split(rows, [16, 20, 21], axis=1)
        low, high = self._limits
        saturated = ((thrusts <= low) | (thrusts >= high)).any(axis=1)
        t = np.arange(len(rows)) * self.interval
        place = self._wanted[0][: len(rows)]
        return np.column_stack([t, moved, thrusts, saturated, nearness, place, leaning])


def _check_steps(course: Course, settings: FlightSettings) -> None:
    """Raise InputError if a flight takes too many steps of the engine, or a period too few."""
    seconds = settings.seconds_of(course)
    step = settings.step
    period = course.moving_period
    if seconds / step > _MOST_STEPS:
        most = f"must be at most {_MOST_STEPS} steps of {step:g} s"
        raise wrong("duration", most, seconds, got=f"{seconds:g} s")
    if 0.0 < period < _LEAST_STEPS * step * (1.0 - 1e-9):
        least = f"must be at least {_LEAST_STEPS} steps of {step:g} s ({_LEAST_STEPS * step:g} s)"
        hint = "; a smaller step helps too"
        raise wrong("period", least, period, hint, got=f"{period:g} s")


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
    tilt_axes, upright = vehicle.axes
    axes = np.stack([tilt_axes, upright, np.cross(tilt_axes, upright)], axis=1)
    rotors = axes.tolist()

    def torque(
        tilts: Any, body_rates: Any, rates: Any, thrusts: Any
    ) -> tuple[Any, ...]:
        t1 = t2 = t3 = 0.0
        for (tilt_axis, thrust_axis, turned), momentum, tilt, rate, thrust in zip(
            rotors, momenta, tilts, rates, thrusts, strict=True
        ):
            speed = functions.sqrt(abs(thrust) / coefficient)
            spun = momentum * functions.copysign(speed, thrust)
            across, up = spun * functions.sin(tilt), spun * functions.cos(tilt)
            # −ω × h in body axes: ω of the arm, h along the tilted rotor axis.
            pairs = zip(body_rates, tilt_axis, strict=True)
            w1, w2, w3 = (own + rate * part for own, part in pairs)
            pairs = zip(thrust_axis, turned, strict=True)
            h1, h2, h3 = (up * part + across * other for part, other in pairs)
            t1 += w3 * h2 - w2 * h3
            t2 += w1 * h3 - w3 * h1
            t3 += w2 * h1 - w1 * h2
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
    thrust = None
    if settings.saturation:
        thrust = settings.thrust_limit or vehicle.max_thrust
    limited = vehicle.replace(
        max_thrust=thrust, max_tilt_rate=settings.servo_rate or vehicle.max_tilt_rate
    )
    judged = timed.with_gait(replace(timed.gait, vehicle=limited))
    forbidden, warnings = broken_rules(judged.check(), pulling=not settings.saturation)
    if isinstance(timed, RowTimedGait):
        if not timed.closed:
            jump = np.linalg.norm(timed.gait.alpha[-1] - timed.gait.alpha[0])
            last = timed.times[-1] - timed.times[-2]
            back = f"the {jump:.3g} rad from its last row back to the first are flown within {last:.3g} s"
            warnings.append(f"the table is not closed: {back}")
        if not timed.law_stated:
            straight = f"{timed.samples} rows are flown straight from one to the next"
            warnings.append(f"the timing matches no built-in law: {straight}")
    seconds = settings.seconds_of(course)
    if math.isfinite(course.duration):
        _warn_of_part(warnings, seconds, "course", course.duration)
    else:
        _warn_of_part(warnings, seconds, "period", course.moving_period)
    if settings.reference in ("line", "circle"):
        _warn_of_part(warnings, seconds, "lap", settings.lap)
    if not forbidden:
        return "", tuple(warnings)
    if not anyway:
        return forbidden[0], tuple(warnings)
    flown = [f"flown although it is not flyable: {message}" for message in forbidden]
    return "", tuple(flown + warnings)


def _warn_of_part(warnings: list[str], seconds: float, name: str, whole: float) -> None:
    """Add a warning if only a part of something is flown."""
    if seconds < whole * (1 - 1e-9):
        part = f"{100 * seconds / whole:.3g} % of a {name} of {whole:g} s"
        warnings.append(
            f"the flight of {seconds:g} s is {part}: the rest is not tested"
        )


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
    and the controller inverts the lag. Not modelled: ground effect, wakes, flexible arms, delays. The controller
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
    settings = checked_settings(settings)
    course = gait if isinstance(gait, Course) else _course_of(timed_gait_of(gait))
    if attitude is None:
        levels_out = settings.reference == "attitude" and HOVER not in course.phases
        attitude = _DEFAULT_ATTITUDE if levels_out else (0.0, 0.0)
    start = checked_attitude(attitude)
    course.vehicle.require("mass", "inertia", "arm_length", purpose="flight")
    refusal, warnings = before_take_off(course, settings, anyway=anyway)
    if refusal:
        failure: tuple[Outcome, str] = (
            "refused",
            f"refused before take-off: {refusal}",
        )
        return record_of(course, settings, start, failure=failure, warnings=warnings)
    simulation = Simulation(course, settings)
    return replace(simulation.run(start), warnings=warnings + simulation.warnings)


def _course_of(motion: TimedGait) -> Course:
    """Return the course of a mission, or that which repeats a gait, or runs a path once."""
    if isinstance(motion, JoinedPath) and motion.phases:
        return motion.course
    if not motion.phases:
        return repeated(motion)
    # The rows of a mission, joined by straight lines.
    return Course(
        sections=tuple((begin, begin, motion) for _, begin in motion.phases),
        duration=motion.period,
        phases=tuple(name for name, _ in motion.phases),
    )


def checked_attitude(attitude: Any) -> tuple[float, float]:
    """Return roll and pitch in radians, or raise InputError."""
    wanted = "must be a roll from -pi to pi and a pitch between -pi/2 and pi/2"
    if not is_list(attitude) or len(attitude) != 2:
        raise wrong("attitude", wanted, attitude)
    roll, pitch = (angle_from_text(angle, "attitude") for angle in attitude)
    if abs(roll) > math.pi or abs(pitch) >= HALF_PI:
        hint = in_degrees(attitude[0]) or in_degrees(attitude[1])
        raise wrong("attitude", wanted, attitude, hint)
    return roll, pitch
