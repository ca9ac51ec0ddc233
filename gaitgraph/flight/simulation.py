"""Flights: a course in the physics engine with servos, noise and wind, or refused before take-off."""

from __future__ import annotations

import math
import struct
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitgraph.angles import angle_from_text, in_degrees
from gaitgraph.errors import InputError, shown
from gaitgraph.flight.controller import DIRECTION, Stopped, allocation_of, controller_of
from gaitgraph.flight.course import Course, broken_rules, repeated, servo_response
from gaitgraph.flight.engine import Engine, engine_warnings
from gaitgraph.flight.flight import COLUMNS, Flight, FlightSettings, record_of, reference_at, settled_since
from gaitgraph.invertibility.matrices import FloatArray, arm_angles, thrust_signs
from gaitgraph.timing.timed_gait import RowTimedGait, timed_gait_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from gaitgraph.io.formats import GaitLike
    from gaitgraph.vehicle import Vehicle

    ApplyTorque = Callable[[Engine, list[float], list[float], tuple[float, ...]], None]

_DEFAULT_ATTITUDE = (0.3, -0.2)  # roll and pitch at the start of a flight that only levels out [rad]
_TUMBLING = 200.0  # rad/s
_FARTHEST = 1e5  # m
_MOST_LEAD = 1.0  # s by which the controller looks ahead on a reference
_GUST_TIME = 1.0  # s over which gusts are correlated
_SETTLED_EVERY = 50  # control steps between two checks whether a flight has settled
_MOST_STEPS = 1_000_000  # they take about 1.5 GB
_LEAST_STEPS = 20  # of the engine in a period
_STILL = 1e-9  # rad of swing below which an arm stands still
_ENOUGH = 0.9  # share of its commanded swing that an arm must reach
_ROWS_AT_ONCE = 500  # of an allocation converted to plain numbers


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
            raise InputError(f"duration must be at most {_MOST_STEPS} steps of {step:g} s, got {seconds:g} s")
        if 0.0 < period < _LEAST_STEPS * step * (1.0 - 1e-9):
            least = f"{_LEAST_STEPS} steps of {step:g} s ({_LEAST_STEPS * step:g} s)"
            raise InputError(f"period must be at least {least}, got {period:g} s; a smaller step helps too")
        self.controls = max(round(seconds * settings.control_rate), 1)
        # Roll and pitch lag behind their wanted values by kd/kp, so references are read that much ahead.
        lead = min(settings.attitude_damping / settings.attitude_stiffness, _MOST_LEAD)
        self._ahead = round(lead * settings.control_rate) if settings.reference != "attitude" else 0
        steps: FloatArray = np.arange((self.controls + self._ahead) * every + 1, dtype=float) * settings.step
        lag = settings.servo_lag if settings.servo_lag is not None else vehicle.servo_lag or 0.0
        rate = settings.servo_rate or vehicle.max_tilt_rate or math.inf
        self.command: FloatArray = course.at(steps)
        self.actual: FloatArray = servo_response(self.command, settings.step, lag=lag, rate=rate)
        self._hinge_commands = self.engine.servo_commands(self.actual)
        assumed = self.actual if settings.arms == "served" else self.command
        self._allocation = allocation_of(assumed[::every], vehicle)
        limit = settings.thrust_limit if settings.thrust_limit is not None else vehicle.max_thrust
        self._limits = (0.0, limit or math.inf) if settings.saturation else (-math.inf, math.inf)

    @property
    def warnings(self) -> tuple[str, ...]:
        """A line if an arm swings by much less than commanded."""
        flown = self.controls * self.settings.steps_per_control + 1
        planned, reached = (np.ptp(angles[:flown], axis=0) for angles in (self.command, self.actual))
        share = np.where(planned > _STILL, reached / np.maximum(planned, _STILL), 1.0)
        worst = int(np.argmin(share.round(6)))  # the first of those that differ by rounding alone
        if share[worst] >= _ENOUGH:
            return ()
        return (
            f"the servos do not follow: arm {worst + 1} swings by {reached[worst]:.3g} of the planned "
            f"{planned[worst]:.3g} rad, so another gait is flown; a longer period helps",
        )

    def run(
        self,
        attitude: tuple[float, float] = (0.0, 0.0),
        *,
        until_settled: float | None = None,
    ) -> Flight:
        """Fly from rest at the origin with a roll and a pitch [rad], until the course or the settings end.

        With `until_settled` the flight ends once it has settled, but not before so many seconds.
        """
        settings, engine, count = self.settings, self.engine, self.controls
        every = settings.steps_per_control
        interval = every * settings.step
        low, high = self._limits
        t_wanted = np.arange(count + 1, dtype=float) * interval
        place, velocity, _ = reference_at(settings, t_wanted)
        acceleration = reference_at(settings, t_wanted + self._ahead * interval)[2]
        wanted = np.hstack([place, velocity[:, :2], acceleration[:, :2]]).tolist()
        leading = self._allocation[self._ahead :, DIRECTION].tolist()
        blocks = range(0, len(self._allocation), _ROWS_AT_ONCE)
        rows = (row for begin in blocks for row in self._allocation[begin : begin + _ROWS_AT_ONCE].tolist())
        noise, gusts = sensor_noise(settings, count), gusts_of(settings, count)
        thrusts_of, apply_gyroscopic = controller_of(settings, self.course.vehicle), gyroscopic_of(self.course.vehicle)
        first_rates = (self.actual[1] - self.actual[0]) / settings.step
        model, data, mj_step = engine.model, engine.data, engine.mujoco.mj_step
        qpos, qvel, ctrl = data.qpos, data.qvel, data.ctrl
        hinge_commands, thrust, hinges = self._hinge_commands, ctrl[:4], ctrl[4:]
        # A flight is many thousand short steps, so it uses plain numbers, as the controller does.
        table = np.empty((count + 1, len(COLUMNS)))
        memory, width, pack = table.data, len(COLUMNS) * table.itemsize, struct.Struct(f"{len(COLUMNS)}d").pack_into
        kept = 0
        check_at = math.inf if until_settled is None else math.ceil(until_settled / interval)
        failure: tuple[Any, ...] = ()
        with engine_warnings() as warnings:
            engine.place(self.actual[0], roll=attitude[0], pitch=attitude[1], rates=first_rates)
            try:
                for k, row in enumerate(rows):
                    t = k * interval
                    if warnings and engine.gave_up:
                        reason = "thrusts or accelerations exceed the range of the physics engine"
                        raise Stopped("tumbling", f"it tumbles just before {t:.3f} s: {reason}")
                    speed = qvel.tolist()
                    state, tilts = _state_of(t, qpos.tolist(), speed)
                    measured = state if noise is None else [a + b for a, b in zip(state, noise[k], strict=True)]
                    h1, h2, h3, h4, near, roll_d, pitch_d = thrusts_of(t, measured, row, leading[k], wanted[k])
                    given: tuple[float, ...] = h1, h2, h3, h4
                    cut = not (low <= h1 <= high and low <= h2 <= high and low <= h3 <= high and low <= h4 <= high)
                    if cut:
                        given = tuple([low if one < low else high if one > high else one for one in given])
                    xd, yd, zd, *_ = wanted[k]
                    pack(memory, kept * width, t, *state, *tilts, *given, cut, near, xd, yd, zd, roll_d, pitch_d)
                    kept += 1
                    if k == count:
                        break
                    if k >= check_at:
                        check_at += _SETTLED_EVERY
                        if settled_since(table[:kept], settings)[0] is not None:
                            break
                    thrust[:] = given
                    if gusts is not None:
                        model.opt.wind[:] = gusts[k]
                    if apply_gyroscopic is not None:
                        apply_gyroscopic(engine, tilts, speed, given)
                    for step in range(k * every, (k + 1) * every):
                        hinges[:] = hinge_commands[step]
                        mj_step(model, data)
            except Stopped as stop:
                failure = stop.args
        return record_of(self.course, settings, attitude, rows=table[:kept].copy(), failure=failure)


def _state_of(t: float, place: list[float], speed: list[float]) -> tuple[tuple[float, ...], list[float]]:
    """Return place, Euler angles, velocity and body rates, twelve numbers, and the tilt angles; or raise Stopped."""
    x, y, z, qw, qx, qy, qz, *tilts = place
    vx, vy, vz, p, q, r, *_ = speed
    if not abs(p) + abs(q) + abs(r) < _TUMBLING:
        raise Stopped("tumbling", f"it tumbles at {t:.3f} s: it turns by more than {_TUMBLING:g} rad/s")
    if not abs(x) + abs(y) + abs(z) < _FARTHEST:
        raise Stopped("tumbling", f"it is more than {_FARTHEST:g} m from the start at {t:.3f} s")
    v1, v2, v3 = 2 * (qx * qz - qw * qy), 2 * (qy * qz + qw * qx), 1 - 2 * (qx * qx + qy * qy)
    roll, pitch = math.atan2(v2, v3), math.atan2(-v1, math.hypot(v2, v3))
    yaw = math.atan2(2 * (qx * qy + qw * qz), 1 - 2 * (qy * qy + qz * qz))
    return (x, y, z, roll, pitch, yaw, vx, vy, vz, p, q, r), tilts


def sensor_noise(settings: FlightSettings, count: int) -> list[list[float]] | None:
    """Return the sensors' errors at every control step (place, attitude, velocity, rates), or None for none."""
    sizes = (settings.position_noise, settings.attitude_noise, settings.velocity_noise, settings.rate_noise)
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
    return np.asarray(settings.wind + settings.gust * lfilter([1.0], [1.0, -keep], drawn, axis=0))


def gyroscopic_of(vehicle: Vehicle) -> ApplyTorque | None:
    """Return a function that applies the rotors' gyroscopic torques to the body; None without a rotor inertia.

    The part about a hinge acts on the body through the servo.
    """
    if vehicle.rotor_inertia is None:
        return None
    (coefficient,) = vehicle.require("thrust_coefficient", purpose="the gyroscopic torque of a rotor_inertia")
    momenta = (thrust_signs(vehicle) * vehicle.rotor_inertia).tolist()
    arms = [(math.cos(azimuth), math.sin(azimuth)) for azimuth in arm_angles(vehicle).tolist()]
    sin, cos, sqrt = math.sin, math.cos, math.sqrt

    def apply(engine: Engine, tilts: list[float], speed: list[float], thrusts: tuple[float, ...]) -> None:
        _, _, _, p, q, r, *tilt_rates = speed
        t1 = t2 = t3 = 0.0
        for (cz, sz), momentum, tilt, rate, thrust in zip(arms, momenta, tilts, tilt_rates, thrusts, strict=True):
            spun = momentum * math.copysign(sqrt(abs(thrust) / coefficient), thrust)
            # −ω × h in body axes: ω of the arm, h along the tilted rotor axis.
            w1, w2, across, up = p + rate * cz, q + rate * sz, spun * sin(tilt), spun * cos(tilt)
            h1, h2 = sz * across, -cz * across
            t1, t2, t3 = t1 + r * h2 - w2 * up, t2 + w1 * up - r * h1, t3 + w2 * h1 - w1 * h2
        engine.data.qfrc_applied[3:6] = t1, t2, t3

    return apply


def before_take_off(course: Course, settings: FlightSettings, *, anyway: bool = False) -> tuple[str, tuple[str, ...]]:
    """Return why a course's gait cannot fly with given settings, "" if it can, and the warnings.

    The limits of thrusts and tilt rates are those of the flight, which may differ from the vehicle's. With `anyway`
    reasons become warnings.
    """
    timed, vehicle = course.timed, course.vehicle
    thrust = (settings.thrust_limit or vehicle.max_thrust) if settings.saturation else None
    limited = vehicle.replace(max_thrust=thrust, max_tilt_rate=settings.servo_rate or vehicle.max_tilt_rate)
    judged = replace(timed, gait=replace(timed.gait, vehicle=limited))
    forbidden, warnings = broken_rules(judged.check(), pulling=not settings.saturation)
    if isinstance(timed, RowTimedGait):
        if not timed.closed:
            jump, last = np.linalg.norm(timed.gait.alpha[-1] - timed.gait.alpha[0]), timed.times[-1] - timed.times[-2]
            back = f"the {jump:.3g} rad from its last row back to the first are flown within {last:.3g} s"
            warnings.append(f"the table is not closed: {back}")
        if not timed.law_stated:
            straight = f"{timed.samples} rows are flown straight from one to the next"
            warnings.append(f"the timing matches no built-in law: {straight}")
    # Whether only a part of the course, the period or the lap is flown.
    seconds, is_finite = settings.seconds_of(course), math.isfinite(course.duration)
    for name, whole, meaning in (
        ("course", course.duration if is_finite else 0.0, "the rest is not flown"),
        ("period", course.moving_period * (not is_finite), "the rest of the gait is not tested"),
        ("lap", settings.lap * (settings.reference in ("line", "circle")), "the reference is not followed to its end"),
    ):
        if seconds < whole * (1 - 1e-9):
            part = f"{100 * seconds / whole:.3g} % of a {name} of {whole:g} s"
            warnings.append(f"the flight of {seconds:g} s is {part}: {meaning}")
    if anyway:
        return "", (*(f"flown although it is not flyable: {message}" for message in forbidden), *warnings)
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
    Not modelled: rotor speed dynamics, ground effect, wakes, flexible arms, delays. The controller knows the vehicle's
    constants exactly, and the tilt angles unless it assumes the planned ones.

    Examples
    --------
    >>> from gaitgraph.gait.gait import lift
    >>> gait = lift([(1.178, -1.178), (1.178, -0.393), (0.393, -0.393), (0.393, -1.178)], "red")
    >>> flight = fly(gait.parametrize(1.0), settings=FlightSettings(duration=1.5))
    >>> flight.settled, round(flight.settling_time, 1), round(flight.peak_thrust_share, 1)
    (True, 0.4, 2.9)
    """
    settings = FlightSettings() if settings is None else settings
    course = gait if isinstance(gait, Course) else repeated(timed_gait_of(gait))
    if attitude is None:
        levels_out = settings.reference == "attitude" and not isinstance(gait, Course)
        attitude = _DEFAULT_ATTITUDE if levels_out else (0.0, 0.0)
    start = checked_attitude(attitude)
    course.vehicle.require("mass", "inertia", "arm_length", purpose="flight")
    refusal, warnings = before_take_off(course, settings, anyway=anyway)
    if refusal:
        failure = "refused", f"refused before take-off: {refusal}"
        return record_of(course, settings, start, failure=failure, warnings=warnings)
    simulation = Simulation(course, settings)
    return replace(simulation.run(start), warnings=(*warnings, *simulation.warnings))


def checked_attitude(attitude: Any) -> tuple[float, float]:
    """Return roll and pitch in radians, or raise InputError."""
    parts = attitude if isinstance(attitude, (list, tuple, np.ndarray)) else ()
    angles = [angle_from_text(part, "attitude") for part in parts]
    if len(angles) != 2 or not abs(angles[0]) <= math.pi or not abs(angles[1]) < math.pi / 2:
        wanted = "a roll from -pi to pi and a pitch between -pi/2 and pi/2"
        hint = next(filter(None, map(in_degrees, parts)), "")
        raise InputError(f"attitude must be {wanted}, got {shown(attitude)}{hint}")
    return angles[0], angles[1]
