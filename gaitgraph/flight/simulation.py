"""Flight in the physics engine: a course prepared, flown by the controller, and recorded.

The thrusts are the only inputs; the tilt angles go their way as planned. :mod:`gaitgraph.flight.controllers` has the
law, :mod:`gaitgraph.flight.records` what comes of it.
"""

from __future__ import annotations

import math
import struct
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import angle_from_text
from gaitgraph.errors import InputError, shown
from gaitgraph.flight.allocation import Allocation, allocation_of
from gaitgraph.flight.controllers import Stopped, controller_of
from gaitgraph.flight.courses import Course, before_take_off, repeated
from gaitgraph.flight.disturbances import gusts_of, gyroscopic_torque_of, noise_of
from gaitgraph.flight.engine import Engine, engine_of, without_log
from gaitgraph.flight.records import COLUMNS, Flight, Outcome, is_settled, refused_flight
from gaitgraph.flight.references import Reference, reference_of
from gaitgraph.flight.servos import served
from gaitgraph.flight.settings import MOST_STEPS, FlightSettings
from gaitgraph.timing.timed_gait import TimedGait

if TYPE_CHECKING:
    from collections.abc import Callable

    from gaitgraph.vehicle import Vehicle

    Ending = tuple[Outcome, str]

__all__ = ["DEFAULT_ATTITUDE", "Cockpit", "fly"]

FloatArray = npt.NDArray[np.float64]

DEFAULT_ATTITUDE = (0.3, -0.2)
"""Roll and pitch at the start of a flight that only levels out [rad]."""

_TUMBLING = 200.0  # rad/s
_AWAY = 1e5  # m
_FARTHEST_AHEAD = 1.0  # s
_TOLD = 500  # control steps between two tellings of progress
_LOOKS = 50  # control steps between two looks at whether a flight has settled
_LEAST_STEPS = 20  # of the engine in a period
_STILL = 1e-9  # rad by which an arm swings that stands still
_ENOUGH = 0.9  # of what an arm is to swing by


class Cockpit:
    """A course prepared for flights: the engine, the servos' way, and the inverse of the decoupling matrix along it.

    Preparing takes as long as some tenths of a second of flight, and serves any number of flights.
    """

    def __init__(self, course: Course, settings: FlightSettings) -> None:
        vehicle = course.vehicle
        self.course, self.settings = course, settings
        self.engine: Engine = engine_of(vehicle, step=settings.step, air=not settings.is_calm)
        self.reference: Reference = reference_of(settings)
        every = settings.steps_per_control
        seconds = course.seconds(settings)
        _check_steps(course, settings, seconds)
        self.controls = max(round(seconds * settings.control_rate), 1)
        # Roll and pitch lag behind what they are asked for by kd/kp, so places are followed by looking as far ahead.
        lead = min(settings.attitude_damping / settings.attitude_stiffness, _FARTHEST_AHEAD)
        self.ahead = round(lead * settings.control_rate) if settings.reference != "attitude" else 0
        steps: FloatArray = np.arange((self.controls + self.ahead) * every + 1, dtype=float) * settings.step
        lag = settings.servo_lag if settings.servo_lag is not None else vehicle.servo_lag or 0.0
        rate = settings.servo_rate or vehicle.max_tilt_rate or math.inf
        self.command: FloatArray = course.at(steps)
        self.planned: FloatArray = self.command[::every]
        self.actual: FloatArray = served(self.command, settings.step, lag=lag, rate=rate)
        self.servos: FloatArray = self.engine.servo_commands(self.actual)
        known = self.actual[::every] if settings.arms == "served" else self.planned
        self.allocation: Allocation = allocation_of(known, vehicle)  # and so many rows more
        limit = settings.thrust_limit if settings.thrust_limit is not None else vehicle.max_thrust
        self.limits = (0.0, limit or math.inf) if settings.saturation else (-math.inf, math.inf)

    @property
    def vehicle(self) -> Vehicle:
        """What flies."""
        return self.course.vehicle

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the servos make of the plan, if the arms swing by much less than they are told to."""
        flown = self.controls * self.settings.steps_per_control + 1
        planned, served = (np.ptp(angles[:flown], axis=0) for angles in (self.command, self.actual))
        share = np.where(planned > _STILL, served / np.where(planned > _STILL, planned, 1.0), 1.0)
        worst = int(np.argmin(share.round(6)))  # the first of those that rounding alone tells apart
        if share[worst] >= _ENOUGH:
            return ()
        return (
            f"the servos do not follow: arm {worst + 1} swings by {served[worst]:.3g} of the {planned[worst]:.3g} rad "
            "that are planned, so another gait is flown; a longer period would help",
        )

    def flown(
        self,
        attitude: tuple[float, float] = (0.0, 0.0),
        progress: Callable[[float], None] | None = None,
        *,
        until_settled: float | None = None,
    ) -> Flight:
        """Fly from rest at the origin with a roll and a pitch [rad], until the course or the settings end.

        Parameters
        ----------
        attitude
            Roll and pitch [rad].
        progress
            Called now and then with the part that is flown.
        until_settled
            Stop once the flight has settled, but not before so many seconds; None flies on to the end.
        """
        with without_log() as warnings:
            rows, ending = _flown(self, attitude, progress, until_settled, warnings)
        return Flight.of(rows, cockpit=self, attitude=attitude, ending=ending)


def fly(
    gait: TimedGait | Course,
    *,
    attitude: tuple[Any, Any] | None = None,
    settings: FlightSettings | None = None,
    anyway: bool = False,
    progress: Callable[[float], None] | None = None,
) -> Flight:
    """Fly a gait in the physics engine MuJoCo, by feedback linearisation with the thrusts as the only inputs.

    Parameters
    ----------
    gait
        A gait with a clock, which is flown again and again, or a course, as :func:`from_hover` makes one.
    attitude
        Roll and pitch at the start [rad, or texts such as "10deg"]; by default (0.3, −0.2) where the reference is
        "attitude" and a gait is flown, else level.
    settings
        How; see :class:`FlightSettings`.
    anyway
        Whether to fly what is not flyable.
    progress
        Called now and then with the part that is flown.

    Returns
    -------
    Flight
        Truthy when it settled. A gait that physics forbids is refused before take-off, with the reason; one that is
        only off the surfaces, as a biased gait is, flies, and `warnings` say so; they also say where only a part of
        the period, the lap or the course is flown, and where the servos do not follow.

    Raises
    ------
    InputError
        If a value is not allowed.
    MissingConstant
        If the vehicle states no mass, inertia or arm length.
    MissingExtra
        If mujoco is not installed.

    Notes
    -----
    Not modelled: rotors that take time to change their speed, ground effect, wakes, flexible arms, delays. The
    controller knows the vehicle's constants exactly, and the angles of the arms unless it goes by the plan.

    Examples
    --------
    >>> from gaitgraph.gait.gait import lift
    >>> gait = lift([(1.178, -1.178), (1.178, -0.393), (0.393, -0.393), (0.393, -1.178)], "red")
    >>> flight = fly(gait.parametrize(1.0), settings=FlightSettings(duration=1.5))
    >>> flight.settled, round(flight.settling_time, 1), round(flight.peak_thrust_share, 1)
    (True, 0.4, 2.9)
    """
    settings = FlightSettings() if settings is None else settings
    if not isinstance(settings, FlightSettings):
        raise InputError(f"settings: {shown(settings)}; allowed are FlightSettings")
    if isinstance(gait, TimedGait):
        course = repeated(gait)
    elif isinstance(gait, Course):
        course = gait
    else:
        raise InputError(f"gait: {shown(gait)}; allowed is a timed gait, as gait.parametrize(period) returns")
    if attitude is None:
        levels_out = settings.reference == "attitude" and isinstance(gait, TimedGait)
        attitude = DEFAULT_ATTITUDE if levels_out else (0.0, 0.0)
    start = checked_attitude(attitude)
    course.vehicle.require("mass", "inertia", "arm_length", purpose="flight")
    if not isinstance(anyway, bool):
        raise InputError(f"anyway: {shown(anyway)}; allowed are True and False")
    refusal, warnings = before_take_off(course, settings, anyway=anyway)
    if refusal:
        reason = f"refused before take-off: {refusal}"
        return replace(refused_flight(course, settings, start, reason), warnings=warnings)
    cockpit = Cockpit(course, settings)
    return replace(cockpit.flown(start, progress), warnings=(*warnings, *cockpit.warnings))


def _check_steps(course: Course, settings: FlightSettings, seconds: float) -> None:
    """Refuse what takes too many steps of the engine, or too few."""
    step, period = settings.step, course.turn
    if seconds / step > MOST_STEPS:
        if settings.duration is None and seconds == period:
            said = f"period: {period:g} s, which is flown whole where no duration is stated"
        else:
            said = f"duration: {seconds:g} s"
        raise InputError(f"{said}; allowed is {MOST_STEPS} steps of {step:g} s at most")
    if 0.0 < period < _LEAST_STEPS * step * (1.0 - 1e-9):
        raise InputError(
            f"period: {period:g} s at a step of {step:g} s; allowed is {_LEAST_STEPS} steps "
            f"({_LEAST_STEPS * step:g} s) and more, or a smaller step"
        )


def checked_attitude(attitude: Any) -> tuple[float, float]:
    """Return roll and pitch in radians, or raise InputError."""
    if not isinstance(attitude, (list, tuple, np.ndarray)) or len(attitude) != 2:
        raise InputError(f"attitude: {shown(attitude)}; allowed are roll and pitch, two angles")
    roll, pitch = (angle_from_text(part, "attitude") for part in attitude)
    if not abs(roll) <= math.pi or not abs(pitch) < math.pi / 2:
        raise InputError(
            f"attitude: {shown(attitude)}; allowed is a roll from -pi to pi and a pitch between -pi/2 and pi/2"
        )
    return roll, pitch


def _flown(
    cockpit: Cockpit,
    attitude: tuple[float, float],
    progress: Callable[[float], None] | None,
    until_settled: float | None,
    warnings: list[str],
) -> tuple[FloatArray, Ending | None]:
    """Return the rows of a flight (see records.COLUMNS) and why it failed, if it did.

    One flight is a loop of many thousand short steps, so this is written in plain numbers too.
    """
    settings, engine = cockpit.settings, cockpit.engine
    every, count = settings.steps_per_control, cockpit.controls
    interval = every * settings.step
    low, high = cockpit.limits
    wanted = cockpit.reference.rows(np.arange(count + 1, dtype=float) * interval, ahead=cockpit.ahead * interval)
    leading = cockpit.allocation.direction[cockpit.ahead :].tolist()
    noise, gusts = noise_of(settings, count), gusts_of(settings, count)
    steer, turn_rotors = controller_of(settings, cockpit.vehicle), gyroscopic_torque_of(cockpit.vehicle)
    first = (cockpit.actual[1] - cockpit.actual[0]) / settings.step
    engine.place(cockpit.actual[0], roll=attitude[0], pitch=attitude[1], rates=first)
    model, data, mj_step = engine.model, engine.data, engine.mujoco.mj_step
    qpos, qvel, ctrl = data.qpos, data.qvel, data.ctrl
    servos, thrust, command = cockpit.servos, ctrl[:4], ctrl[4:]
    table = np.empty((count + 1, len(COLUMNS)))
    memory, width, keep = table.data, len(COLUMNS) * table.itemsize, struct.Struct(f"{len(COLUMNS)}d").pack_into
    kept = 0
    look = math.inf if until_settled is None else math.ceil(until_settled / interval)
    try:
        for k, row in enumerate(cockpit.allocation.rows()):
            t = k * interval
            if warnings and engine.gave_up:
                words = "thrusts or accelerations are beyond what the physics engine can follow"
                raise Stopped("tumbling", f"it tumbles just before {t:.3f} s: {words}")
            speed = qvel.tolist()
            state, tilts = _state_of(t, qpos.tolist(), speed)
            seen = state if noise is None else [a + b for a, b in zip(state, noise[k], strict=True)]
            h1, h2, h3, h4, near, roll_d, pitch_d = steer(t, seen, row, leading[k], wanted[k])
            given: tuple[float, ...] = h1, h2, h3, h4
            cut = not (low <= h1 <= high and low <= h2 <= high and low <= h3 <= high and low <= h4 <= high)
            if cut:
                given = tuple([low if one < low else high if one > high else one for one in given])
            xd, yd, zd, *_ = wanted[k]
            keep(memory, kept * width, t, *state, *tilts, *given, cut, near, xd, yd, zd, roll_d, pitch_d)
            kept += 1
            if k == count:
                break
            if k >= look:
                look += _LOOKS
                if is_settled(table[:kept], settings):
                    break
            thrust[:] = given
            if gusts is not None:
                model.opt.wind[:] = gusts[k]
            if turn_rotors is not None:
                turn_rotors(engine, tilts, speed, given)
            for step in range(k * every, (k + 1) * every):
                command[:] = servos[step]
                mj_step(model, data)
            if progress is not None and (k + 1) % _TOLD == 0:
                progress((k + 1) / count)
    except Stopped as stop:
        return table[:kept].copy(), (stop.outcome, stop.words)
    return table[:kept].copy(), None


def _state_of(t: float, place: list[float], speed: list[float]) -> tuple[tuple[float, ...], list[float]]:
    """Return place, Euler angles, velocity and body rates, twelve numbers, and the tilt angles; or raise Stopped."""
    x, y, z, qw, qx, qy, qz, *tilts = place
    vx, vy, vz, p, q, r, *_ = speed
    if not abs(p) + abs(q) + abs(r) < _TUMBLING:
        raise Stopped("tumbling", f"it tumbles at {t:.3f} s: it turns by more than {_TUMBLING:g} rad/s")
    if not abs(x) + abs(y) + abs(z) < _AWAY:
        raise Stopped("tumbling", f"it is lost at {t:.3f} s: it is farther than {_AWAY:g} m from the start")
    v1, v2, v3 = 2 * (qx * qz - qw * qy), 2 * (qy * qz + qw * qx), 1 - 2 * (qx * qx + qy * qy)
    roll, pitch = math.atan2(v2, v3), math.atan2(-v1, math.hypot(v2, v3))
    yaw = math.atan2(2 * (qx * qy + qw * qz), 1 - 2 * (qy * qy + qz * qz))
    return (x, y, z, roll, pitch, yaw, vx, vy, vz, p, q, r), tilts
