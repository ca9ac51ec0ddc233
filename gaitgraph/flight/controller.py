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
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.invertibility.matrices import rotor_directions, thrust_signs

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from gaitgraph.flight.flight import FlightSettings
    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.vehicle import Vehicle

_MOST_LEAN = math.radians(45.0)
DIRECTION = slice(9, 12)  # where N is in a row of an allocation
WANTED = slice(32, 35)  # where the wanted place is in what the controller knows


def allocation_of(alpha: npt.ArrayLike, vehicle: Vehicle) -> FloatArray:
    """Return the inverse of the decoupling matrix at tilt angles of shape (n, 4) [rad], shape (n, 29).

    A row has F·P (force per torque, 9 numbers), N (3; it points up where all thrusts can be positive), |P|², P (thrusts
    along the tilted axes per torque, in units of thrust times arm length, 12), and w (the unit thrusts that make no
    torque, 4). Where the moment matrix has lost rank, all are zero.
    """
    both = (
        part * thrust_signs(vehicle)
        for part in rotor_directions(np.atleast_2d(alpha), vehicle)
    )
    force, (first, second, third) = (
        np.ascontiguousarray(np.moveaxis(part, 0, -1)) for part in both
    )
    # The generalised cross product of the rows; without rank it is zero, and all is divided by infinity.
    free = _across(first, second, third)
    size = np.linalg.norm(free, axis=0)
    size = np.where(size > 1e-12, size, np.inf)
    free /= size
    # Column j of P is normal to w and to the other two rows, and its product with row j is 1.
    before, after = (
        np.stack([third, first, second], axis=1),
        np.stack([second, third, first], axis=1),
    )
    thrusts = _across(before, after, free[:, None]) / size
    # w is continuous along the course, so a sign that is right in its first row is right in all.
    direction = np.einsum("ikn,kn->in", force, free)
    sign = -1.0 if direction[2, 0] < 0 else 1.0
    squared = np.sum(thrusts**2, axis=(0, 1))
    parts = (
        np.einsum("ikn,kjn->ijn", force, thrusts),
        sign * direction,
        squared,
        thrusts,
        sign * free,
    )
    return np.vstack([part.reshape(-1, len(size)) for part in parts]).T


def _across(a: FloatArray, b: FloatArray, c: FloatArray) -> FloatArray:
    """Return the vectors normal to three, of shapes (4, ..., n); their products with others d are det(d, a, b, c)."""
    even = (1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1)
    turns = [((i, j, k), (j, k, i), (k, i, j)) for i, j, k in even]
    return np.stack(
        [
            sum(a[i] * (b[j] * c[k] - b[k] * c[j]) for i, j, k in three)
            for three in turns
        ]
    )


def observed(
    place: Any, speed: Any, noise: Sequence[float] | None, functions: Any = math
) -> tuple[Any, ...]:
    """Return what is true and what sensors measure of a place with a quaternion, and a velocity with body rates.

    These are: place, roll, pitch, yaw, velocity and body rates, twelve numbers, first the true ones, then the measured;
    the measured vertical in body axes, with the cosine of the pitch; and the sizes of body rates and place, as sums.
    """
    x, y, z, qw, qx, qy, qz, *_ = place
    vx, vy, vz, p, q, r, *_ = speed
    v1, v2, v3 = (
        2 * (qx * qz - qw * qy),
        2 * (qy * qz + qw * qx),
        1 - 2 * (qx * qx + qy * qy),
    )
    level = functions.sqrt(v2 * v2 + v3 * v3)
    yaw = functions.atan2(2 * (qx * qy + qw * qz), 1 - 2 * (qy * qy + qz * qz))
    state = measured = (
        x,
        y,
        z,
        functions.atan2(v2, v3),
        functions.atan2(-v1, level),
        yaw,
        vx,
        vy,
        vz,
        p,
        q,
        r,
    )
    if noise is not None:
        measured = tuple([a + b for a, b in zip(state, noise, strict=True)])
        roll, pitch = measured[3:5]
        level = functions.cos(pitch)
        v1, v2, v3 = (
            -functions.sin(pitch),
            functions.sin(roll) * level,
            functions.cos(roll) * level,
        )
    return (
        state,
        measured,
        (v1, v2, v3, level),
        abs(p) + abs(q) + abs(r),
        abs(x) + abs(y) + abs(z),
    )


def controller_of(
    settings: FlightSettings, vehicle: Vehicle, functions: Any = math
) -> Callable[..., tuple[Any, ...]]:
    """Return the controller of a flight, to be called at every control step.

    It takes the measured place, roll, pitch, yaw, velocity and body rates, twelve numbers; the vertical in body axes
    and the cosine of the pitch, four numbers; and what is known before the flight, 39 numbers: a row of
    :func:`allocation_of`, the direction N to lean by, and the wanted (x, y, z, ẋ, ẏ, ẍ, ÿ). It returns four thrusts
    [N]; v·N, which has the determinant's sign; the square of a number between half the least singular value and all of
    it; and the wanted roll and pitch. The thrusts mean nothing where that number or the cosine is zero.

    The measured numbers may be arrays of many flights, with `functions` of numpy. One flight uses plain numbers, which
    are more than ten times quicker than arrays of one.
    """
    mass, (ix, iy, iz), length = vehicle.require(
        "mass", "inertia", "arm_length", purpose="flight"
    )
    gravity = vehicle.gravity
    kp, kd = settings.attitude_stiffness, settings.attitude_damping
    kp_z, kd_z = settings.altitude_stiffness, settings.altitude_damping
    kp_x, kd_x = settings.position_stiffness, settings.position_damping
    tracks = settings.reference != "attitude"
    # Of the torque over the arm length.
    i1, i2, i3 = ix / length, iy / length, iz / length
    j1, j2, j3 = (iz - iy) / length, (ix - iz) / length, (iy - ix) / length

    def thrusts(
        state: Sequence[Any], vertical: Sequence[Any], known: Sequence[float]
    ) -> tuple[Any, ...]:
        x, y, z, roll, pitch, yaw, vx, vy, vz, p, q, r = state
        v1, v2, v3, cp = vertical
        (
            f1, f2, f3, f4, f5, f6, f7, f8, f9, n1, n2, n3, squared,
            b1, b2, b3, b4, b5, b6, b7, b8, b9, b10, b11, b12, e1, e2, e3, e4,
            l1, l2, l3, xd, yd, zd, ux, uy, ax, ay,
        ) = known  # fmt: skip
        # The decoupling matrix's distance to a singular one.
        g1, g2, g3 = (
            v1 * f1 + v2 * f4 + v3 * f7,
            v1 * f2 + v2 * f5 + v3 * f8,
            v1 * f3 + v2 * f6 + v3 * f9,
        )
        along = v1 * n1 + v2 * n2 + v3 * n3
        near = along * along
        near = near / (squared * near + g1 * g1 + g2 * g2 + g3 * g3 + 1.0)
        # The wanted attitude.
        roll_d = pitch_d = 0.0
        if tracks:
            ax = ax + kp_x * (xd - x) + kd_x * (ux - vx)
            ay = ay + kp_x * (yd - y) + kd_x * (uy - vy)
            roll_d, pitch_d = wanted_attitude(ax, ay, gravity, yaw, (l1, l2, l3))
        # Rates of the Euler angles, their wanted accelerations, and the torque and lift for these.
        level = cp + (cp == 0.0)  # nothing is divided by zero, here and below
        sp, sr, cr = -v1, v2 / level, v3 / level
        turn = q * sr + r * cr
        yaw_rate = turn / level
        roll_rate, pitch_rate = p + yaw_rate * sp, q * cr - r * sr
        a1 = kp * (roll_d - roll) - kd * roll_rate
        a2 = kp * (pitch_d - pitch) - kd * pitch_rate
        a3 = -kp * yaw - kd * yaw_rate
        # ω̇ in the body: along x, and along the other two axes before the roll turns them.
        ahead = a2 + turn * roll_rate
        upright = a3 * cp - pitch_rate * (yaw_rate * sp + roll_rate)
        t1 = i1 * (a1 - a3 * sp - turn * pitch_rate) + j1 * (q * r)
        t2 = i2 * (ahead * cr + upright * sr) + j2 * (r * p)
        t3 = i3 * (upright * cr - ahead * sr) + j3 * (p * q)
        lift = mass * (gravity + kp_z * (zd - z) - kd_z * vz)
        scale = (lift - g1 * t1 - g2 * t2 - g3 * t3) / (along + (along == 0.0))
        return (
            b1 * t1 + b2 * t2 + b3 * t3 + scale * e1,
            b4 * t1 + b5 * t2 + b6 * t3 + scale * e2,
            b7 * t1 + b8 * t2 + b9 * t3 + scale * e3,
            b10 * t1 + b11 * t2 + b12 * t3 + scale * e4,
            along,
            near,
            roll_d,
            pitch_d,
        )

    return thrusts


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
    forward, left, up = (
        (cy * ax + sy * ay) * norm,
        (cy * ay - sy * ax) * norm,
        gravity * norm,
    )
    across = hypot(n2, n3)
    roll = atan2(n2, n3) - math.asin(
        max(-1.0, min(1.0, left / across if across else 0.0))
    )
    pitch = atan2(forward, up) - atan2(n1, math.sin(roll) * n2 + math.cos(roll) * n3)
    return roll, pitch
