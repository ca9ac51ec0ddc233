"""The controller: thrusts by feedback linearisation of altitude, roll, pitch and yaw.

The thrusts are the only inputs; the tilt angles go their way as planned. At every control step, with z–y–x Euler
angles η = (φ, θ, ψ) and the body's angular velocity ω,

    η̈ = kp·(η_d − η) − kd·η̇,   z̈ = kp_z·(z_d − z) − kd_z·ż  (what is asked for),
    τ = I·ω̇(η, η̇, η̈) + ω × I·ω,   lift = m·(g + z̈)         (what that takes, without approximation),
    A(α, φ, θ)·T = (τ, lift)                                  (the thrusts, by :mod:`gaitgraph.flight.allocation`).

Places in the plane are followed by leaning: the attitude is asked for at which the force that the thrusts make
without torque, N(α), points along the acceleration that is wanted plus gravity. On the gait surfaces N is along body z
and this is the attitude–position decoupler of a quadrotor; off them (a biased gait) it is what replaces that one.

All is written in plain numbers: arrays of three or four would take several times as long.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from gaitgraph.flight.records import Outcome
    from gaitgraph.flight.settings import FlightSettings
    from gaitgraph.vehicle import Vehicle

__all__ = ["Stopped", "controller_of", "wanted_attitude"]

_UPRIGHT = 1e-3  # cosine of a pitch at which Euler angles are no use
_LEAN = math.radians(45.0)
_LEAST_FLOOR = 1e-9


class Stopped(Exception):
    """A flight cannot go on: how it ended, and why."""

    def __init__(self, outcome: Outcome, words: str) -> None:
        super().__init__(words)
        self.outcome, self.words = outcome, words


def controller_of(settings: FlightSettings, vehicle: Vehicle) -> Callable[..., tuple[float, ...]]:
    """Return the controller of one flight, to be called at every control step.

    It takes the time [s]; what the sensors say: place, roll, pitch, yaw, velocity, body rates, twelve numbers; a row of
    :meth:`gaitgraph.flight.allocation.Allocation.rows`; the direction N to lean; and a row of
    :meth:`gaitgraph.flight.references.Reference.rows`. It returns four thrusts [N], a number between half the least
    singular value and all of it, and the roll and pitch that are wanted.

    It raises :class:`Stopped` where the decoupling matrix nears a singular one or its determinant has changed sign
    since the first call, before anything is divided by it, and where the nose points straight up or down.
    """
    mass, (ix, iy, iz), length = vehicle.require("mass", "inertia", "arm_length", purpose="flight")
    gravity = vehicle.gravity
    kp, kd = settings.attitude_stiffness, settings.attitude_damping
    kp_z, kd_z = settings.altitude_stiffness, settings.altitude_damping
    kp_x, kd_x = settings.position_stiffness, settings.position_damping
    floor_squared = max(settings.floor, _LEAST_FLOOR) ** 2
    tracks = settings.reference != "attitude"
    sin, cos, sqrt = math.sin, math.cos, math.sqrt
    sign = 0.0

    def steer(
        t: float, state: Sequence[float], row: Sequence[float], leading: Sequence[float], wanted: Sequence[float]
    ) -> tuple[float, ...]:
        nonlocal sign
        x, y, z, roll, pitch, yaw, vx, vy, vz, p, q, r = state
        sr, cr, sp, cp = sin(roll), cos(roll), sin(pitch), cos(pitch)
        if cp < _UPRIGHT:
            words = "where roll and yaw are not defined"
            raise Stopped("upended", f"its nose points straight up or down at {t:.3f} s, {words}")
        # How near the decoupling matrix is to a singular one.
        (
            f1, f2, f3, f4, f5, f6, f7, f8, f9, n1, n2, n3, squared,
            b1, b2, b3, b4, b5, b6, b7, b8, b9, b10, b11, b12, e1, e2, e3, e4,
        ) = row  # fmt: skip
        v1, v2, v3 = -sp, sr * cp, cr * cp
        g1, g2, g3 = v1 * f1 + v2 * f4 + v3 * f7, v1 * f2 + v2 * f5 + v3 * f8, v1 * f3 + v2 * f6 + v3 * f9
        along = v1 * n1 + v2 * n2 + v3 * n3
        bottom = squared * along * along + g1 * g1 + g2 * g2 + g3 * g3 + 1.0
        near = along * along / bottom if along else 0.0
        sign = sign or along
        if near < floor_squared or along * sign < 0.0:
            raise _singular(t, near, settings.floor, along * sign < 0.0)
        # What attitude is wanted.
        xd, yd, zd, ux, uy, ax, ay = wanted
        roll_d = pitch_d = 0.0
        if tracks:
            ax += kp_x * (xd - x) + kd_x * (ux - vx)
            ay += kp_x * (yd - y) + kd_x * (uy - vy)
            roll_d, pitch_d = wanted_attitude(ax, ay, gravity, yaw, leading)
        # Rates of the Euler angles, what they are to become, and the torque and lift that this takes.
        turn = q * sr + r * cr
        roll_rate, pitch_rate, yaw_rate = p + turn * sp / cp, q * cr - r * sr, turn / cp
        a1 = kp * (roll_d - roll) - kd * roll_rate
        a2 = kp * (pitch_d - pitch) - kd * pitch_rate
        a3 = -kp * yaw - kd * yaw_rate
        # ω̇ in the body: along x, and along the other two axes before the roll turns them.
        level = a2 + yaw_rate * roll_rate * cp
        upright = a3 * cp - yaw_rate * pitch_rate * sp - pitch_rate * roll_rate
        w1 = a1 - a3 * sp - yaw_rate * pitch_rate * cp
        w2 = level * cr + upright * sr
        w3 = upright * cr - level * sr
        t1 = (ix * w1 + (iz - iy) * q * r) / length
        t2 = (iy * w2 + (ix - iz) * r * p) / length
        t3 = (iz * w3 + (iy - ix) * p * q) / length
        lift = mass * (gravity + kp_z * (zd - z) - kd_z * vz)
        scale = (lift - g1 * t1 - g2 * t2 - g3 * t3) / along
        return (
            b1 * t1 + b2 * t2 + b3 * t3 + scale * e1,
            b4 * t1 + b5 * t2 + b6 * t3 + scale * e2,
            b7 * t1 + b8 * t2 + b9 * t3 + scale * e3,
            b10 * t1 + b11 * t2 + b12 * t3 + scale * e4,
            sqrt(near),
            roll_d,
            pitch_d,
        )

    return steer


def wanted_attitude(ax: float, ay: float, gravity: float, yaw: float, force: Sequence[float]) -> tuple[float, float]:
    """Return roll and pitch at which a body force points along an acceleration that is wanted, and against gravity."""
    hypot, atan2 = math.hypot, math.atan2
    most = gravity * math.tan(_LEAN)
    size = hypot(ax, ay)
    if size > most:
        ax, ay = ax * most / size, ay * most / size
    cy, sy = math.cos(yaw), math.sin(yaw)
    n1, n2, n3 = force
    norm = math.sqrt(n1 * n1 + n2 * n2 + n3 * n3) / math.sqrt(ax * ax + ay * ay + gravity * gravity)
    forward, left, up = (cy * ax + sy * ay) * norm, (cy * ay - sy * ax) * norm, gravity * norm
    across = hypot(n2, n3)
    roll = atan2(n2, n3) - math.asin(max(-1.0, min(1.0, left / across if across else 0.0)))
    pitch = atan2(forward, up) - atan2(n1, math.sin(roll) * n2 + math.cos(roll) * n3)
    return roll, pitch


def _singular(t: float, near: float, floor: float, passed: bool) -> Stopped:
    if passed:
        told = f"the decoupling matrix is singular just before {t:.3f} s: its determinant has changed sign"
        return Stopped("sign change", told)
    size = math.sqrt(near)
    told = (
        f"the decoupling matrix nears singularity at {t:.3f} s: its least singular value is between {size:.2g} and "
        f"{2 * size:.2g}, and flight stops where it may be below {floor:g}"
    )
    return Stopped("near singular", told)
