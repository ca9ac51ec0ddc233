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

**Rotor lag.** A rotor with a time constant follows its command u as Ṫ = (u − T)/lag. Its thrust depends on the commands
alone, so the controller knows it without measuring, and commands what brings it to the wanted thrust.

**References** in x and y are followed by leaning: at the wanted attitude the force of thrusts without torque, N(α),
points along the wanted acceleration plus gravity. On the gait surfaces N is along body z and this is the
attitude–position decoupler of a quadrotor; for a biased gait it generalises that one.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from gaitgraph.invertibility.matrices import (
    rotor_directions,
    thrust_signs,
    zero_moment_inputs,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from gaitgraph.flight.flight import FlightSettings
    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.vehicle import Vehicle

_MOST_LEAN = math.radians(45.0)


class Motion(NamedTuple):
    """How a body moves in the world: numbers of one flight, or arrays of many [m, rad, s]; angles are z–y–x."""

    x: Any
    y: Any
    z: Any
    roll: Any
    pitch: Any
    yaw: Any
    x_rate: Any
    y_rate: Any
    z_rate: Any
    body_rate_x: Any
    body_rate_y: Any
    body_rate_z: Any


class Allocation(NamedTuple):
    """The inverse of the decoupling matrix along a course, at n control steps.

    `lifts` (n, 4, 3) has the force in body axes of a unit torque about each axis, and N, which points up where all
    thrusts can be positive; `thrusts` (n, 4, 4) has in its columns the thrusts along the tilted axes for these three
    torques, in units of thrust times arm length, and w; `squared` (n,) is |P|². Where the moment matrix has lost rank,
    all are zero.
    """

    lifts: FloatArray
    thrusts: FloatArray
    squared: FloatArray


Step = tuple[list[list[float]], list[list[float]], float]
"""The parts of an allocation at one control step."""


class Wanted(NamedTuple):
    """The reference, and the force in body axes that is to point along the wanted acceleration."""

    place: Sequence[float]
    velocity: Sequence[float]
    acceleration: Sequence[float]
    force: Sequence[float]


LEVEL = Wanted(*[(0.0, 0.0, 0.0)] * 4)


class Command(NamedTuple):
    """What the controller wants, and how near the decoupling matrix is to a singular one."""

    thrusts: Sequence[Any]  # of the four rotors [N]
    along: Any  # v·N, with the sign of the determinant
    nearness: Any  # between half the least singular value and all of it
    roll: Any
    pitch: Any


def allocation_of(alpha: npt.ArrayLike, vehicle: Vehicle) -> Allocation:
    """Return the inverse of the decoupling matrix at tilt angles of shape (n, 4) [rad]."""
    signs = thrust_signs(vehicle)
    directions = rotor_directions(np.atleast_2d(alpha), vehicle)
    force, moment = (np.asarray(part) * signs for part in directions)
    free = signs * zero_moment_inputs(np.atleast_2d(alpha), vehicle)
    size = np.linalg.norm(free, axis=-1, keepdims=True)
    has_rank = size > 1e-12
    free = np.where(has_rank, free / np.where(has_rank, size, 1.0), 0.0)
    # w is continuous along the course, so a sign that is right in its first row is right in all.
    if force[0, 2] @ free[0] < 0.0:
        free = -free
    # w is across the rows of the moment matrix, so their common inverse is (P, w).
    rows = np.concatenate([moment, free[:, None]], axis=1)
    rows = np.where(has_rank[..., None], rows, np.eye(4))
    thrusts = np.where(has_rank[..., None], np.linalg.inv(rows), 0.0)
    lifts = np.swapaxes(force @ thrusts, -1, -2)
    squared = np.sum(thrusts[..., :3] ** 2, axis=(-2, -1))
    return Allocation(lifts, thrusts, squared)


def motion_of(
    place: Sequence[Any], speed: Sequence[Any], functions: Any = math
) -> Motion:
    """Return the motion of a body from the engine's position and quaternion, and its velocity and body rates."""
    x, y, z, qw, qx, qy, qz = place[:7]
    across, ahead = qy * qz + qw * qx, qw * qy - qx * qz
    up = 0.5 - (qx * qx + qy * qy)
    roll = functions.atan2(across, up)
    pitch = functions.atan2(ahead, functions.sqrt(across * across + up * up))
    yaw = functions.atan2(qx * qy + qw * qz, 0.5 - (qy * qy + qz * qz))
    return Motion(x, y, z, roll, pitch, yaw, *speed[:6])


def controller_of(
    settings: FlightSettings, vehicle: Vehicle, functions: Any = math
) -> Callable[[Motion, Step, Wanted], Command]:
    """Return the controller of a flight, to be called with what is measured and known at every control step.

    The motion may have arrays of many flights, with `functions` of numpy; one flight uses plain numbers, which are ten
    times quicker than arrays of one. Thrusts mean nothing where the nearness is zero.
    """
    mass, (ix, iy, iz), length = vehicle.require(
        "mass", "inertia", "arm_length", purpose="flight"
    )
    gravity = vehicle.gravity
    kp, kd = settings.attitude_stiffness, settings.attitude_damping
    kp_z, kd_z = settings.altitude_stiffness, settings.altitude_damping
    kp_x, kd_x = settings.position_stiffness, settings.position_damping
    tracks = settings.reference != "attitude"
    sin, cos, sqrt = functions.sin, functions.cos, functions.sqrt

    def command(motion: Motion, allocation: Step, wanted: Wanted) -> Command:
        lifts, thrusts_of, squared = allocation
        x, y, z, roll, pitch, yaw, vx, vy, vz, p, q, r = motion
        sr, cr, sp, cp = sin(roll), cos(roll), sin(pitch), cos(pitch)
        # The decoupling matrix's distance to a singular one.
        v2, v3 = sr * cp, cr * cp
        g1, g2, g3, along = [v2 * b + v3 * c - sp * a for a, b, c in lifts]
        near = along * along
        across = g1 * g1 + g2 * g2 + g3 * g3 + 1.0
        nearness = sqrt(near / (squared * near + across))
        # The wanted attitude.
        roll_d = pitch_d = 0.0
        if tracks:
            (xd, yd, _), (ux, uy, _), (ax, ay, _), force = wanted
            ax += kp_x * (xd - x) + kd_x * (ux - vx)
            ay += kp_x * (yd - y) + kd_x * (uy - vy)
            roll_d, pitch_d = wanted_attitude(ax, ay, gravity, yaw, force)
        # Rates of the Euler angles, and their wanted accelerations.
        turn = q * sr + r * cr
        yaw_rate = turn / cp
        roll_rate, pitch_rate = p + yaw_rate * sp, q * cr - r * sr
        a1 = kp * (roll_d - roll) - kd * roll_rate
        a2 = kp * (pitch_d - pitch) - kd * pitch_rate
        a3 = -kp * yaw - kd * yaw_rate
        # ω̇ in the body: along x, and along the other two axes before the roll turns them.
        forward = a1 - a3 * sp - turn * pitch_rate
        left = a2 + turn * roll_rate
        upward = a3 * cp - pitch_rate * (yaw_rate * sp + roll_rate)
        # The torque over the arm length, and the lift.
        t1 = (ix * forward + (iz - iy) * q * r) / length
        t2 = (iy * (left * cr + upward * sr) + (ix - iz) * r * p) / length
        t3 = (iz * (upward * cr - left * sr) + (iy - ix) * p * q) / length
        lift = mass * (gravity + kp_z * (wanted.place[2] - z) - kd_z * vz)
        free = (lift - g1 * t1 - g2 * t2 - g3 * t3) / (along + (along == 0.0))
        thrusts = [a * t1 + b * t2 + c * t3 + d * free for a, b, c, d in thrusts_of]
        return Command(thrusts, along, nearness, roll_d, pitch_d)

    return command


def wanted_attitude(
    ax: float, ay: float, gravity: float, yaw: float, force: Sequence[float]
) -> tuple[float, float]:
    """Return the roll and pitch at which a body force points along a wanted acceleration, and against gravity."""
    hypot, atan2 = math.hypot, math.atan2
    most = gravity * math.tan(_MOST_LEAN)
    size = hypot(ax, ay)
    if size > most:
        ax, ay = ax * most / size, ay * most / size
    cy, sy = math.cos(yaw), math.sin(yaw)
    n1, n2, n3 = force
    norm = math.sqrt(n1 * n1 + n2 * n2 + n3 * n3) / math.sqrt(
        ax * ax + ay * ay + gravity * gravity
    )
    forward = (cy * ax + sy * ay) * norm
    left = (cy * ay - sy * ax) * norm
    up = gravity * norm
    across = hypot(n2, n3)
    roll = atan2(n2, n3) - math.asin(
        max(-1.0, min(1.0, left / across if across else 0.0))
    )
    pitch = atan2(forward, up) - atan2(n1, math.sin(roll) * n2 + math.cos(roll) * n3)
    return roll, pitch
