"""The controller of flights: feedback linearisation by the thrusts, with the tilt angles given.

The thrusts are the only inputs; the tilt angles follow the course, whatever the controller does. At every control step,
with z–y–x Euler angles η = (φ, θ, ψ) and the body's angular velocity ω,

    η̈ = kp·(η_d − η) − kd·η̇,   z̈ = kp_z·(z_d − z) − kd_z·ż  (the wanted accelerations),
    τ = I·ω̇(η, η̇, η̈) + ω × I·ω,   lift = m·(g + z̈)         (the exact torque and lift for them),
    A(α, φ, θ)·T = (τ, lift)                                  (thrusts by the inverse of the decoupling matrix).

**Allocation.** The control moment matrix depends on the tilt angles alone, which are known before the flight; so are
its pseudo-inverse P and its null direction w (the zero-moment inputs). Thrusts T = P·τ + λ·w make the torque τ, and

    lift = v·F·T  gives  λ = (lift − v·F·P·τ) / (v·N),   N = F·w,

with v the vertical in body axes: the decoupling matrix is singular where P does not exist or v·N = 0. Its distance to
that follows without division: the squared norm of its inverse is |P|² + (|v·F·P|² + 1)/(v·N)².

**References** in x and y are followed by leaning: at the wanted attitude the force of thrusts without torque, N(α),
points along the wanted acceleration plus gravity. On the gait surfaces N is along body z and this is the
attitude–position decoupler of a quadrotor; for a biased gait it generalises that one.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from gaitgraph.invertibility.matrices import FloatArray, rotor_directions, thrust_signs

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from gaitgraph.flight.flight import FlightSettings
    from gaitgraph.vehicle import Vehicle

_MOST_LEAN = math.radians(45.0)
_LEAST_FLOOR = 1e-9
_UPRIGHT = 1e-3  # cosine of the pitch below which Euler angles are too inaccurate
DIRECTION = slice(9, 12)  # where N is in a row of an allocation


class Stopped(Exception):
    """A flight must end; the arguments are its outcome and the reason."""


def allocation_of(alpha: npt.ArrayLike, vehicle: Vehicle) -> FloatArray:
    """Return the inverse of the decoupling matrix at tilt angles of shape (n, 4) [rad], shape (n, 29).

    A row has F·P (force per torque, 9 numbers), N (3; it points up where all thrusts can be positive), |P|², P (thrusts
    along the tilted axes per torque, in units of thrust times arm length, 12), and w (the unit thrusts that make no
    torque, 4). Where the moment matrix has lost rank, P and w are zero and |P|² is infinite.
    """
    force, moment = (part * thrust_signs(vehicle) for part in rotor_directions(np.atleast_2d(alpha), vehicle))
    # The null vector is the generalised cross product of the three rows: signed 3×3 minors as triple products.
    minors = []
    for k in range(4):
        first, second, third = (np.delete(moment[:, row], k, axis=1) for row in range(3))
        minors.append((-1) ** k * np.sum(first * np.cross(second, third), axis=-1))
    free = np.stack(minors, axis=-1)
    size = np.linalg.norm(free, axis=-1)
    # P = Mᵀ·adj(M·Mᵀ) / det(M·Mᵀ), and that determinant is the squared size of the null vector.
    gram = moment @ np.swapaxes(moment, 1, 2)
    adjugate = np.cross(np.roll(gram, -1, axis=1), np.roll(gram, -2, axis=1))  # symmetric, as gram is
    size = np.where(size > 1e-12, size, np.inf)  # without rank all is divided by infinity
    thrusts = np.swapaxes(moment, 1, 2) @ adjugate / size[:, None, None] ** 2
    free = free / size[:, None]
    # The minors are continuous along the course, so a sign that is right in its first row is right in all.
    direction = (force @ free[..., None])[..., 0]
    if direction[0, 2] < 0:
        free, direction = -free, -direction
    squared = np.where(np.isfinite(size), np.sum(thrusts**2, axis=(1, 2)), np.inf)
    parts = (force @ thrusts, direction, squared, thrusts, free)
    return np.hstack([part.reshape(len(squared), -1) for part in parts])


def controller_of(settings: FlightSettings, vehicle: Vehicle) -> Callable[..., tuple[float, ...]]:
    """Return the controller of one flight, to be called at every control step.

    It takes the time [s]; the measured place, roll, pitch, yaw, velocity and body rates, twelve numbers; a row of
    :func:`allocation_of`; the direction N to lean by; and the wanted (x, y, z, ẋ, ẏ, ẍ, ÿ). It returns four thrusts
    [N], a number between half the least singular value and all of it, and the wanted roll and pitch. It raises
    :class:`Stopped` before it would divide by a nearly singular matrix. It uses plain numbers, which are several times
    quicker than arrays of three or four.
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

    def thrusts(
        t: float, state: Sequence[float], row: Sequence[float], leading: Sequence[float], wanted: Sequence[float]
    ) -> tuple[float, ...]:
        nonlocal sign
        x, y, z, roll, pitch, yaw, vx, vy, vz, p, q, r = state
        sr, cr, sp, cp = sin(roll), cos(roll), sin(pitch), cos(pitch)
        if cp < _UPRIGHT:
            reason = f"its nose points straight up or down at {t:.3f} s, where roll and yaw are not defined"
            raise Stopped("upended", reason)
        # The decoupling matrix's distance to a singular one.
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
        if along * sign < 0.0:
            reason = f"the decoupling matrix is singular just before {t:.3f} s: its determinant has changed sign"
            raise Stopped("sign change", reason)
        if near < floor_squared:
            least = sqrt(near)
            between = f"between {least:.2g} and {2 * least:.2g}, and the floor is {settings.floor:g}"
            reason = f"the decoupling matrix nears singularity at {t:.3f} s: its least singular value is {between}"
            raise Stopped("near singular", reason)
        # The wanted attitude.
        xd, yd, zd, ux, uy, ax, ay = wanted
        roll_d = pitch_d = 0.0
        if tracks:
            ax += kp_x * (xd - x) + kd_x * (ux - vx)
            ay += kp_x * (yd - y) + kd_x * (uy - vy)
            roll_d, pitch_d = wanted_attitude(ax, ay, gravity, yaw, leading)
        # Rates of the Euler angles, their wanted accelerations, and the torque and lift for these.
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

    return thrusts


def wanted_attitude(ax: float, ay: float, gravity: float, yaw: float, force: Sequence[float]) -> tuple[float, float]:
    """Return the roll and pitch at which a body force points along a wanted acceleration, and against gravity."""
    hypot, atan2 = math.hypot, math.atan2
    most = gravity * math.tan(_MOST_LEAN)
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
