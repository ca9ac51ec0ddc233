"""Flight in the physics engine by feedback linearisation of altitude, roll, pitch and yaw.

The thrusts are the only inputs; the tilt angles go their way as planned. At every control step, with z–y–x Euler
angles η = (φ, θ, ψ) and the body's angular velocity ω,

    η̈ = kp·(η_d − η) − kd·η̇,   z̈ = kp_z·(z_d − z) − kd_z·ż  (what is asked for),
    τ = I·ω̇(η, η̇, η̈) + ω × I·ω,   lift = m·(g + z̈)         (what that takes, without approximation),
    A(α, φ, θ)·T = (τ, lift)                                  (the thrusts, by :mod:`gaitgraph.flight.allocation`).

Places in the plane are followed by leaning: the attitude is asked for at which the force that the thrusts make
without torque, N(α), points along the acceleration that is wanted plus gravity. On the gait surfaces N is along body z
and this is the attitude–position decoupler of a quadrotor; off them (a biased gait) it is what replaces that one.
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
from gaitgraph.flight.courses import Course, refusal_and_warnings, repeated
from gaitgraph.flight.engine import Engine, engine_of, without_log
from gaitgraph.flight.records import COLUMNS, Flight, Outcome, is_settled, refused_flight
from gaitgraph.flight.references import Reference, reference_of
from gaitgraph.flight.servos import served
from gaitgraph.flight.settings import MOST_STEPS, FlightSettings
from gaitgraph.invertibility import arm_angles, thrust_signs
from gaitgraph.timing import TimedGait

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from gaitgraph.vehicle import Vehicle

    Ending = tuple[Outcome, str]

__all__ = ["DEFAULT_ATTITUDE", "Cockpit", "fly", "refusal_and_warnings"]

FloatArray = npt.NDArray[np.float64]

DEFAULT_ATTITUDE = (0.3, -0.2)
"""Roll and pitch at the start of a flight that only levels out [rad]."""

_TUMBLING = 200.0  # rad/s
_AWAY = 1e5  # m
_UPRIGHT = 1e-3  # cosine of a pitch at which Euler angles are no use
_LEAN = math.radians(45.0)
_LEAST_FLOOR = 1e-9
_GUST_TIME = 1.0  # s
_FARTHEST_AHEAD = 1.0  # s
_TOLD = 500  # control steps between two tellings of progress, and whose matrices are made plain numbers at once
_LOOKS = 50  # control steps between two looks at whether a flight has settled


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
        whole = settings.duration is None and math.isfinite(course.duration)
        seconds = course.duration if whole else min(settings.seconds, course.duration)
        if seconds / settings.step > MOST_STEPS:
            raise InputError(f"duration: {seconds:g} s; allowed is {MOST_STEPS} steps of {settings.step:g} s at most")
        self.controls = max(round(seconds * settings.control_rate), 1)
        # Roll and pitch lag behind what they are asked for by kd/kp, so places are followed by looking as far ahead.
        lead = min(settings.attitude_damping / settings.attitude_stiffness, _FARTHEST_AHEAD)
        self.ahead = round(lead * settings.control_rate) if settings.reference != "attitude" else 0
        steps: FloatArray = np.arange((self.controls + self.ahead) * every + 1, dtype=float) * settings.step
        lag = settings.servo_lag if settings.servo_lag is not None else vehicle.servo_lag or 0.0
        rate = settings.servo_rate or vehicle.max_tilt_rate or math.inf
        command = course.at(steps)
        self.planned: FloatArray = command[::every]
        self.actual: FloatArray = served(command, settings.step, lag=lag, rate=rate)
        self.servos: FloatArray = self.engine.servo_commands(self.actual)
        known = self.actual[::every] if settings.arms == "served" else self.planned
        self.allocation: Allocation = allocation_of(known, vehicle)  # and so many rows more
        limit = settings.thrust_limit if settings.thrust_limit is not None else vehicle.max_thrust
        self.limits = (0.0, limit or math.inf) if settings.saturation else (-math.inf, math.inf)

    @property
    def vehicle(self) -> Vehicle:
        """What flies."""
        return self.course.vehicle

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
        only off the surfaces, as a biased gait is, flies, and `warnings` say so.

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
    >>> from gaitgraph.gait import lift
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
    refusal, warnings = refusal_and_warnings(course.timed.check())
    if refusal and not anyway:
        reason = f"refused before take-off: {refusal}"
        return replace(refused_flight(course, settings, start, reason), warnings=warnings)
    return replace(Cockpit(course, settings).flown(start, progress), warnings=warnings)


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

    One flight is a loop of many thousand short steps, so this is written in plain numbers: arrays of three or four
    would take several times as long.
    """
    settings, engine, vehicle = cockpit.settings, cockpit.engine, cockpit.vehicle
    mass, (ix, iy, iz), length = vehicle.require("mass", "inertia", "arm_length", purpose="flight")
    gravity = vehicle.gravity
    kp, kd = settings.attitude_stiffness, settings.attitude_damping
    kp_z, kd_z = settings.altitude_stiffness, settings.altitude_damping
    kp_x, kd_x = settings.position_stiffness, settings.position_damping
    low, high = cockpit.limits
    floor_squared = max(settings.floor, _LEAST_FLOOR) ** 2
    every, count = settings.steps_per_control, cockpit.controls
    interval = every * settings.step
    tracks = settings.reference != "attitude"
    wanted = cockpit.reference.rows(np.arange(count + 1, dtype=float) * interval, ahead=cockpit.ahead * interval)
    leading = cockpit.allocation.direction[cockpit.ahead :].tolist() if tracks else []
    noise, gusts = _noise(settings, count), _gusts(settings, count)
    spin = _spin_of(vehicle)
    first = (cockpit.actual[1] - cockpit.actual[0]) / settings.step
    engine.place(cockpit.actual[0], roll=attitude[0], pitch=attitude[1], rates=first)
    model, data, mj_step = engine.model, engine.data, engine.mujoco.mj_step
    qpos, qvel, ctrl = data.qpos, data.qvel, data.ctrl
    servos, thrust, command = cockpit.servos, ctrl[:4], ctrl[4:]
    sin, cos, asin, atan2, hypot, sqrt = math.sin, math.cos, math.asin, math.atan2, math.hypot, math.sqrt
    sign = 0.0
    table = np.empty((count + 1, len(COLUMNS)))
    memory, width, keep = table.data, len(COLUMNS) * table.itemsize, struct.Struct(f"{len(COLUMNS)}d").pack_into
    kept = 0
    ending: Ending | None = None
    look = math.inf if until_settled is None else math.ceil(until_settled / interval)
    for k, row in enumerate(_plain_rows(cockpit.allocation)):
        if warnings and engine.gave_up:
            words = "thrusts or accelerations are beyond what the physics engine can follow"
            ending = "tumbling", f"it tumbles just before {k * interval:.3f} s: {words}"
            break
        place, speed = qpos.tolist(), qvel.tolist()
        x, y, z, qw, qx, qy, qz, *tilts = place
        vx, vy, vz, p, q, r, *_ = speed
        # The vertical in body axes, and Euler angles.
        v1, v2, v3 = 2 * (qx * qz - qw * qy), 2 * (qy * qz + qw * qx), 1 - 2 * (qx * qx + qy * qy)
        cp = hypot(v2, v3)
        roll, pitch = atan2(v2, v3), atan2(-v1, cp)
        yaw = atan2(2 * (qx * qy + qw * qz), 1 - 2 * (qy * qy + qz * qz))
        true = (x, y, z, roll, pitch, yaw, vx, vy, vz, p, q, r)
        if not abs(p) + abs(q) + abs(r) < _TUMBLING:
            ending = "tumbling", f"it tumbles at {k * interval:.3f} s: it turns by more than {_TUMBLING:g} rad/s"
            break
        if not abs(x) + abs(y) + abs(z) < _AWAY:
            ending = "tumbling", f"it is lost at {k * interval:.3f} s: it is farther than {_AWAY:g} m from the start"
            break
        if noise is not None:
            x, y, z, roll, pitch, yaw, vx, vy, vz, p, q, r = (a + b for a, b in zip(true, noise[k], strict=True))
            cp = cos(pitch)
            v1, v2, v3 = -sin(pitch), sin(roll) * cp, cos(roll) * cp
        if cp < _UPRIGHT:
            words = "where roll and yaw are not defined"
            ending = "upended", f"its nose points straight up or down at {k * interval:.3f} s, {words}"
            break
        sr, cr, sp = v2 / cp, v3 / cp, -v1
        # How near the decoupling matrix is to a singular one, before anything is divided by it.
        (
            f1, f2, f3, f4, f5, f6, f7, f8, f9, n1, n2, n3, squared,
            b1, b2, b3, b4, b5, b6, b7, b8, b9, b10, b11, b12, e1, e2, e3, e4,
        ) = row  # fmt: skip
        g1, g2, g3 = v1 * f1 + v2 * f4 + v3 * f7, v1 * f2 + v2 * f5 + v3 * f8, v1 * f3 + v2 * f6 + v3 * f9
        along = v1 * n1 + v2 * n2 + v3 * n3
        bottom = squared * along * along + g1 * g1 + g2 * g2 + g3 * g3 + 1.0
        near = along * along / bottom if along else 0.0
        if not sign:
            sign = along
        if near < floor_squared or along * sign < 0.0:
            ending = _singular(k * interval, near, settings.floor, along * sign < 0.0)
            break
        # What attitude is wanted.
        xd, yd, zd, ux, uy, ax, ay = wanted[k]
        roll_d = pitch_d = 0.0
        if tracks:
            ax += kp_x * (xd - x) + kd_x * (ux - vx)
            ay += kp_x * (yd - y) + kd_x * (uy - vy)
            roll_d, pitch_d = _lean(ax, ay, gravity, yaw, leading[k], (sin, cos, asin, atan2, hypot))
        # Rates of the Euler angles, what they are to become, and the torque and lift that this takes.
        turn = q * sr + r * cr
        roll_rate, pitch_rate, yaw_rate = p + turn * sp / cp, q * cr - r * sr, turn / cp
        a1 = kp * (roll_d - roll) - kd * roll_rate
        a2 = kp * (pitch_d - pitch) - kd * pitch_rate
        a3 = -kp * yaw - kd * yaw_rate
        w1 = a1 - a3 * sp - yaw_rate * pitch_rate * cp
        w2 = (
            a2 * cr
            - pitch_rate * roll_rate * sr
            + a3 * sr * cp
            + yaw_rate * (roll_rate * cr * cp - pitch_rate * sr * sp)
        )
        w3 = (
            -a2 * sr
            - pitch_rate * roll_rate * cr
            + a3 * cr * cp
            - yaw_rate * (roll_rate * sr * cp + pitch_rate * cr * sp)
        )
        t1 = (ix * w1 + (iz - iy) * q * r) / length
        t2 = (iy * w2 + (ix - iz) * r * p) / length
        t3 = (iz * w3 + (iy - ix) * p * q) / length
        lift = mass * (gravity + kp_z * (zd - z) - kd_z * vz)
        scale = (lift - g1 * t1 - g2 * t2 - g3 * t3) / along
        h1 = b1 * t1 + b2 * t2 + b3 * t3 + scale * e1
        h2 = b4 * t1 + b5 * t2 + b6 * t3 + scale * e2
        h3 = b7 * t1 + b8 * t2 + b9 * t3 + scale * e3
        h4 = b10 * t1 + b11 * t2 + b12 * t3 + scale * e4
        given: tuple[float, ...] = h1, h2, h3, h4
        cut = not (low <= h1 <= high and low <= h2 <= high and low <= h3 <= high and low <= h4 <= high)
        if cut:
            given = tuple([low if one < low else high if one > high else one for one in given])
        nearness = sqrt(near)
        keep(memory, kept * width, k * interval, *true, *tilts, *given, cut, nearness, xd, yd, zd, roll_d, pitch_d)
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
        if spin is not None:
            spin(engine, tilts, speed, given)
        for step in range(k * every, (k + 1) * every):
            command[:] = servos[step]
            mj_step(model, data)
        if progress is not None and (k + 1) % _TOLD == 0:
            progress((k + 1) / count)
    return table[:kept].copy(), ending


def _plain_rows(allocation: Allocation) -> Iterator[list[float]]:
    """Return F·P, N, |P|², P and w (see Allocation) at every control step as plain numbers, a block at a time."""
    count = len(allocation.squared)
    parts = (allocation.force, allocation.direction, allocation.squared, allocation.thrusts, allocation.free)
    flat = [part.reshape(count, -1) for part in parts]
    for begin in range(0, count, _TOLD):
        yield from np.hstack([part[begin : begin + _TOLD] for part in flat]).tolist()


def _lean(
    ax: float, ay: float, gravity: float, yaw: float, force: Sequence[float], functions: Any
) -> tuple[float, float]:
    """Return roll and pitch at which a body force points along an acceleration that is wanted, and against gravity."""
    sin, cos, asin, atan2, hypot = functions
    most = gravity * math.tan(_LEAN)
    size = hypot(ax, ay)
    if size > most:
        ax, ay = ax * most / size, ay * most / size
    cy, sy = cos(yaw), sin(yaw)
    n1, n2, n3 = force
    norm = math.sqrt(n1 * n1 + n2 * n2 + n3 * n3) / math.sqrt(ax * ax + ay * ay + gravity * gravity)
    forward, left, up = (cy * ax + sy * ay) * norm, (cy * ay - sy * ax) * norm, gravity * norm
    across = hypot(n2, n3)
    roll = atan2(n2, n3) - asin(max(-1.0, min(1.0, left / across if across else 0.0)))
    pitch = atan2(forward, up) - atan2(n1, sin(roll) * n2 + cos(roll) * n3)
    return roll, pitch


def _singular(t: float, near: float, floor: float, passed: bool) -> Ending:
    if passed:
        told = f"the decoupling matrix is singular just before {t:.3f} s: its determinant has changed sign"
        return "sign change", told
    size = math.sqrt(near)
    return "near singular", (
        f"the decoupling matrix nears singularity at {t:.3f} s: its least singular value is between {size:.2g} and "
        f"{2 * size:.2g}, and flight stops where it may be below {floor:g}"
    )


def _noise(settings: FlightSettings, count: int) -> list[list[float]] | None:
    sizes = (settings.position_noise, settings.attitude_noise, settings.velocity_noise, settings.rate_noise)
    if not any(sizes):
        return None
    drawn = np.random.default_rng([settings.seed, 0]).standard_normal((count + 1, 12))
    noise: list[list[float]] = (drawn * np.repeat(sizes, 3)).tolist()
    return noise


def _gusts(settings: FlightSettings, count: int) -> FloatArray | None:
    """Return the wind at every control step, or None if it does not change."""
    if settings.is_calm:
        return None
    from scipy.signal import lfilter

    keep = math.exp(-1.0 / (settings.control_rate * _GUST_TIME))
    drawn = np.random.default_rng([settings.seed, 1]).standard_normal((count + 1, 3))
    drawn[1:] *= math.sqrt(1.0 - keep * keep)
    gusts = settings.gust * lfilter([1.0], [1.0, -keep], drawn, axis=0)
    return np.asarray(np.asarray(settings.wind) + gusts)


def _spin_of(vehicle: Vehicle) -> Callable[[Engine, list[float], list[float], tuple[float, ...]], None] | None:
    """Return what puts the gyroscopic torques of the rotors on the body, where the vehicle states what they need.

    What is about a hinge is borne by its servo, which passes it on to the body too.
    """
    if vehicle.rotor_inertia is None:
        return None
    (coefficient,) = vehicle.require("thrust_coefficient", purpose="the gyroscopic torque of a rotor_inertia")
    momenta = (thrust_signs(vehicle) * vehicle.rotor_inertia).tolist()
    arms = [(math.cos(azimuth), math.sin(azimuth)) for azimuth in arm_angles(vehicle).tolist()]
    sin, cos, sqrt = math.sin, math.cos, math.sqrt

    def put(engine: Engine, tilts: list[float], speed: list[float], thrusts: tuple[float, ...]) -> None:
        _, _, _, p, q, r, *tilt_rates = speed
        t1 = t2 = t3 = 0.0
        for (cz, sz), momentum, tilt, rate, thrust in zip(arms, momenta, tilts, tilt_rates, thrusts, strict=True):
            spun = momentum * math.copysign(sqrt(abs(thrust) / coefficient), thrust)
            # −ω × h in body axes: ω of the arm, h along the tilted rotor axis.
            w1, w2, across, up = p + rate * cz, q + rate * sz, spun * sin(tilt), spun * cos(tilt)
            h1, h2 = sz * across, -cz * across
            t1, t2, t3 = t1 + r * h2 - w2 * up, t2 + w1 * up - r * h1, t3 + w2 * h1 - w1 * h2
        engine.data.qfrc_applied[3:6] = t1, t2, t3

    return put
