r"""The matrices of level flight and at an attitude, and what follows from them: thrusts in hover, power, singular values.

Arrays of tilt angles have shape (..., 4): (α1, α2, α3, α4) in radians; leading axes broadcast. Functions of Rφ, Rθ and R
take :class:`~gaitgraph.invertibility.coefficients.Coefficients`; functions of forces and torques take a
:class:`~gaitgraph.vehicle.Vehicle`. Both are forms of the same columns, see :mod:`gaitgraph.invertibility.forms`.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import angles_from
from gaitgraph.errors import wrong
from gaitgraph.invertibility.coefficients import (
    Coefficients,
    CoefficientsLike,
    coefficients_of,
)
from gaitgraph.invertibility.forms import FloatArray, Level, Sines, level_of, rotors_of
from gaitgraph.vehicle import PAPER, Vehicle, VehicleLike, vehicle_named

if TYPE_CHECKING:
    from collections.abc import Callable

IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]

_POWER_PARTS = 256  # of a loop, in the mean of the power in hover


def tilt_angles(alpha: npt.ArrayLike) -> FloatArray:
    """Return tilt angles as an array of shape (..., 4), or raise InputError."""
    angles: FloatArray = angles_from(alpha, "alpha")
    if angles.ndim == 0 or angles.shape[-1] != 4:
        raise wrong("alpha", "must be an array of shape (..., 4)", angles.shape)
    return angles


def sines_of(alpha: npt.ArrayLike) -> tuple[tuple[int, ...], Sines]:
    """Return the leading shape of tilt angles (..., 4), and their sines as rows of all points."""
    angles = tilt_angles(alpha)
    return angles.shape[:-1], Sines.of(angles.reshape(-1, 4))


def level_of_vehicle(vehicle: VehicleLike) -> Level:
    """Return the matrices and forms of a vehicle."""
    return level_of(rotors_of(vehicle_named(vehicle)))


def attitude_sensitivities(
    alpha: npt.ArrayLike,
    coefficients: CoefficientsLike | None = None,
    *,
    vehicle: VehicleLike = PAPER,
) -> FloatArray:
    """Return v = (−Rθ, Rφ, R), the normal of the plane of singular verticals in body axes, shape (..., 3).

    Formula (1) at an attitude is v·n, with n of :func:`body_vertical`. What floating point alone may make of zero is
    zero. The coefficients are those of :func:`coefficients_of` for the vehicle, unless they are a record.

    >>> attitude_sensitivities([0, 0, 0, 0]).round(12).tolist()
    [0.0, 0.0, 4.0]
    """
    coefficients = coefficients_of(vehicle, coefficients)
    shape, sines = sines_of(alpha)
    values = coefficients.sensitivities(sines)
    values[np.abs(values) <= coefficients.noise[:, None]] = 0.0
    return values.T.reshape(*shape, 3)


def roll_sensitivity(
    alpha: npt.ArrayLike,
    coefficients: CoefficientsLike | None = None,
    *,
    vehicle: VehicleLike = PAPER,
) -> Any:
    """Return Rφ of equation (4), dimensionless, shape (...).

    Zero Rφ and Rθ make the determinant insensitive, to first order, to roll and pitch. Coefficients and vehicle are as
    for :func:`attitude_sensitivities`.

    >>> float(roll_sensitivity([0.3, -0.2, 0.3, 0.1]))
    0.0
    """
    return attitude_sensitivities(alpha, coefficients, vehicle=vehicle)[..., 1]


def pitch_sensitivity(
    alpha: npt.ArrayLike,
    coefficients: CoefficientsLike | None = None,
    *,
    vehicle: VehicleLike = PAPER,
) -> Any:
    """Return Rθ of equation (5), its misprint corrected, dimensionless, shape (...).

    Coefficients and vehicle are as for :func:`attitude_sensitivities`.

    >>> float(pitch_sensitivity([0.3, -0.2, 0.1, -0.2]))
    0.0
    """
    return 0.0 - attitude_sensitivities(alpha, coefficients, vehicle=vehicle)[..., 0]


def level_determinant(
    alpha: npt.ArrayLike,
    coefficients: CoefficientsLike | None = None,
    *,
    vehicle: VehicleLike = PAPER,
) -> Any:
    """Return R of equation (6), its misprints corrected, dimensionless, shape (...).

    In level flight the determinant of the decoupling matrix is proportional to R: R = 0 is singular. Coefficients and
    vehicle are as for :func:`attitude_sensitivities`.

    >>> float(level_determinant([0, 0, 0, 0]))
    4.0
    """
    coefficients = coefficients_of(vehicle, coefficients)
    shape, sines = sines_of(alpha)
    values = coefficients.level_form.at(sines)[0]
    values[np.abs(values) <= coefficients.noise[2]] = 0.0
    return values.reshape(shape)[()]


def level_determinant_resolution(
    alpha: npt.ArrayLike, coefficients: Coefficients, angle_rounding: float = 0.0
) -> Any:
    """Return the |R| above which its sign is certain, shape (...); see :meth:`Coefficients.errors`."""
    shape, sines = sines_of(alpha)
    return coefficients.level_errors(sines, angle_rounding).reshape(shape)


def noise_of(coefficients: Coefficients) -> float:
    """Return a bound of the |R| that floating point alone makes where R = 0."""
    return float(coefficients.noise[2])


def body_vertical(roll: npt.ArrayLike, pitch: npt.ArrayLike) -> FloatArray:
    """Return the upward vertical in body axes for roll φ and pitch θ [rad] (z–y–x Euler angles), shape (..., 3)."""
    roll, pitch = np.broadcast_arrays(
        angles_from(roll, "roll"), angles_from(pitch, "pitch")
    )
    return np.stack(
        [-np.sin(pitch), np.sin(roll) * np.cos(pitch), np.cos(roll) * np.cos(pitch)],
        axis=-1,
    )


def attitude_of(vertical: FloatArray) -> FloatArray:
    """Return the (roll, pitch) at which the upward vertical in body axes is `vertical`, shape (..., 2) [rad]."""
    x, y, z = np.moveaxis(vertical, -1, 0)
    return np.stack([np.arctan2(y, z), -np.arctan2(x, np.hypot(y, z))], axis=-1)


def determinant(
    alpha: npt.ArrayLike,
    coefficients: CoefficientsLike | None = None,
    roll: npt.ArrayLike = 0.0,
    pitch: npt.ArrayLike = 0.0,
    *,
    vehicle: VehicleLike = PAPER,
) -> Any:
    """Return the left side of formula (1), its misprints corrected, dimensionless: zero where the matrix is singular.

    Tilt angles have the shape (..., 4) [rad]; the attitude [rad] is broadcast against their leading axes. Coefficients
    and vehicle are as for :func:`attitude_sensitivities`.

    >>> round(float(determinant([0.4, -0.4, 0.4, -0.4], roll=0.3, pitch=-0.2)), 3)
    -4.662
    """
    return np.sum(
        attitude_sensitivities(alpha, coefficients, vehicle=vehicle)
        * body_vertical(roll, pitch),
        axis=-1,
    )


def thrust_signs(vehicle: Vehicle) -> FloatArray:
    """Return the sign with which w > 0 thrusts along each upright rotor's axis, and with which it spins, shape (4,)."""
    return rotors_of(vehicle).thrust_signs


def rotor_directions(
    alpha: npt.ArrayLike, vehicle: Vehicle
) -> tuple[FloatArray, FloatArray]:
    """Return thrust directions, w > 0, and their dimensionless torques, both of shape (..., 3, 4)."""
    shape, sines = sines_of(alpha)
    force, moment = level_of_vehicle(vehicle).forces_and_moments(sines)
    return force.reshape(*shape, 3, 4), moment.reshape(*shape, 3, 4)


def control_force_matrix(
    alpha: npt.ArrayLike, vehicle: VehicleLike = PAPER
) -> FloatArray:
    """Return F(α): body force [N] per rotor input w = ω|ω| [rad²/s²], shape (..., 3, 4).

    MissingConstant if the vehicle states no thrust coefficient.
    """
    vehicle = vehicle_named(vehicle)
    (thrust,) = vehicle.require(
        "thrust_coefficient", purpose="the control force matrix"
    )
    return np.asarray(thrust * rotor_directions(alpha, vehicle)[0])


def control_moment_matrix(
    alpha: npt.ArrayLike, vehicle: VehicleLike = PAPER
) -> FloatArray:
    """Return τ(α): body torque [N m] per rotor input w = ω|ω| [rad²/s²], shape (..., 3, 4).

    MissingConstant if the vehicle states no thrust coefficient or arm length.
    """
    vehicle = vehicle_named(vehicle)
    thrust, arm = vehicle.require(
        "thrust_coefficient", "arm_length", purpose="the control moment matrix"
    )
    return np.asarray(arm * thrust * rotor_directions(alpha, vehicle)[1])


def scaled_decoupling_matrix(
    alpha: npt.ArrayLike,
    vehicle: VehicleLike = PAPER,
    roll: npt.ArrayLike = 0.0,
    pitch: npt.ArrayLike = 0.0,
) -> FloatArray:
    """Return the dimensionless 4×4 matrix with rows τ(α)/(L·Kf) and F(α)·vertical/Kf, shape (..., 4, 4).

    It is the decoupling matrix without mass, inertia and Euler kinematics, none of which is singular for |pitch| < π/2.
    """
    vehicle = vehicle_named(vehicle)
    force, moment = rotor_directions(alpha, vehicle)
    lift = np.sum(body_vertical(roll, pitch)[..., :, None] * force, axis=-2)[
        ..., None, :
    ]
    shape = np.broadcast_shapes(moment.shape[:-2], lift.shape[:-2])
    return np.concatenate(
        [np.broadcast_to(rows, (*shape, *rows.shape[-2:])) for rows in (moment, lift)],
        axis=-2,
    )


def decoupling_matrix(
    alpha: npt.ArrayLike,
    vehicle: VehicleLike = PAPER,
    roll: npt.ArrayLike = 0.0,
    pitch: npt.ArrayLike = 0.0,
) -> FloatArray:
    """Return ∂(z̈, φ̈, θ̈, ψ̈)/∂w, the decoupling matrix in SI units, shape (..., 4, 4).

    Its determinant is −2κ·Kf⁴L³/(m·Ix·Iy·Iz·cos θ) times formula (1) with exact coefficients, for the paper's
    spin sense (the sign of κ turns with the spin). MissingConstant if mass, inertia, arm length or thrust coefficient
    is not stated.
    """
    vehicle = vehicle_named(vehicle)
    needed = ("mass", "inertia", "arm_length", "thrust_coefficient")
    mass, inertia, arm, thrust = vehicle.require(
        *needed, purpose="the decoupling matrix"
    )
    sizes = thrust * np.array([*(arm / np.array(inertia)), 1 / mass])
    roll, pitch = np.broadcast_arrays(
        angles_from(roll, "roll"), angles_from(pitch, "pitch")
    )
    zero, one = np.zeros(roll.shape), np.ones(roll.shape)
    sine, cosine = np.sin(roll), np.cos(roll)
    with np.errstate(divide="ignore", invalid="ignore"):
        tangent, secant = np.tan(pitch), 1.0 / np.cos(pitch)
        kinematics = [[one, sine * tangent, cosine * tangent], [zero, cosine, -sine]]
        kinematics.append([zero, sine * secant, cosine * secant])
    rows = [[zero, zero, zero, one], *([*row, zero] for row in kinematics)]
    scaled = sizes[:, None] * scaled_decoupling_matrix(alpha, vehicle, roll, pitch)
    return np.asarray(np.moveaxis(np.array(rows), (0, 1), (-2, -1)) @ scaled)


def zero_moment_inputs(
    alpha: npt.ArrayLike, vehicle: VehicleLike = PAPER
) -> FloatArray:
    """Return w₀, rotor inputs without torque whose force is v of :func:`attitude_sensitivities`, shape (..., 4).

    They are zero where the control moment matrix has rank two or less.
    """
    shape, sines = sines_of(alpha)
    return level_of_vehicle(vehicle).inputs_at(sines).T.reshape(*shape, 4)


def zero_moment_direction(
    alpha: npt.ArrayLike, vehicle: VehicleLike = PAPER
) -> FloatArray:
    """Return N = F(α)·w₀/Kf, the force that remains when the thrusts make no torque, shape (..., 3).

    A configuration is singular at an attitude exactly where N is horizontal there, or zero. On the gait surfaces
    N is parallel to body z. It is v of :func:`attitude_sensitivities` with exact coefficients, so that its length has
    no meaning; its direction is that of the hover thrust, or opposite.
    """
    return attitude_sensitivities(alpha, "exact", vehicle=vehicle)


def hover_thrust_shares(
    alpha: npt.ArrayLike, vehicle: VehicleLike = PAPER
) -> FloatArray:
    """Return the thrusts that carry the weight without torque in level flight, in units of m·g, shape (..., 4).

    Positive pushes up along the tilted rotor axis. Not finite where the matrix is singular in level flight. Off the
    gait surfaces a horizontal force remains, which is not included.

    >>> hover_thrust_shares([0, 0, 0, 0]).round(12).tolist()
    [0.25, 0.25, 0.25, 0.25]
    """
    shape, sines = sines_of(alpha)
    shares = shares_at(sines, level_of_vehicle(vehicle))
    return shares.T.reshape(*shape, 4)


def shares_at(sines: Sines, level: Level) -> FloatArray:
    """Return :func:`hover_thrust_shares` at points, shape (4, k)."""
    thrust = level.rotors.thrust_signs[:, None] * level.inputs_at(sines)
    # What floating point alone may make of zero is zero.
    thrust[np.abs(thrust) <= level.input_noise[:, None]] = 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(thrust / level.lift.at(sines)[0])


def hover_power(alpha: npt.ArrayLike, vehicle: VehicleLike = PAPER) -> FloatArray:
    """Return the rotors' power in level flight relative to that at α = 0, shape (...), by momentum theory.

    A rotor of thrust f takes a power in proportion to f^1.5. NaN where hover thrusts are not all positive.

    >>> hover_power([[0, 0, 0, 0], [-0.6, 0.6, -0.6, 0.6]]).round(4).tolist()
    [1.0, 1.3337]
    """
    vehicle = vehicle_named(vehicle)
    shares = np.moveaxis(hover_thrust_shares(alpha, vehicle), -1, 0)
    return np.asarray(power_of_shares(shares, level_of_vehicle(vehicle)))


def power_of_shares(shares: FloatArray, level: Level) -> FloatArray:
    """Return :func:`hover_power` of hover thrusts in units of m·g, shape (4, ...)."""
    return np.asarray(_power_of(shares) / _power_upright(level))


@lru_cache(maxsize=32)
def _power_upright(level: Level) -> float:
    return float(_power_of(shares_at(Sines.of(np.zeros((1, 4))), level))[0])


def _power_of(shares: FloatArray) -> FloatArray:
    """Return Σ f^1.5 of thrusts f, NaN where they are not all positive."""
    upward = np.where(shares > 0, shares, np.nan)
    return np.asarray(np.sum(upward * np.sqrt(upward), axis=0))


def mean_hover_powers(
    alpha_at: Callable[[FloatArray], FloatArray], count: int, vehicle: Vehicle
) -> FloatArray:
    """Return the mean of :func:`hover_power` on each of `count` smooth segments of a motion, shape (count,).

    `alpha_at` returns tilt angles at shares of all segments of shape (k,), shape (count, k, 4). Gauss's rule with two
    points is applied to parts of the segments, of which there are 256 or more in all. Along flyable gaits its relative
    error is below 1e-6.
    """
    parts = math.ceil(_POWER_PARTS / count)
    middles = np.arange(parts)[:, None] + 0.5
    gauss = np.array([-0.5, 0.5]) / math.sqrt(3.0)
    shares = (middles + gauss).ravel() / parts
    return np.asarray(hover_power(alpha_at(shares), vehicle).mean(axis=-1))


def least_singular_value(
    alpha: npt.ArrayLike,
    vehicle: VehicleLike = PAPER,
    roll: npt.ArrayLike = 0.0,
    pitch: npt.ArrayLike = 0.0,
) -> Any:
    """Return the least singular value of :func:`scaled_decoupling_matrix`, dimensionless, shape (...).

    It measures how well the matrix can be inverted, which the determinant does not: min(2κ, √2) at α = 0, and at most
    :func:`largest_least_singular_value`.

    >>> round(float(least_singular_value([0, 0, 0, 0])), 4)
    0.3373
    """
    vehicle = vehicle_named(vehicle)
    angles = tilt_angles(alpha)
    matrix = scaled_decoupling_matrix(angles, vehicle, roll, pitch)
    return np.linalg.svd(matrix, compute_uv=False)[..., -1]


def largest_least_singular_value(vehicle: Vehicle) -> float:
    """Return what no least singular value of a vehicle exceeds, by the sizes of its moments (docs/theory.md, 14).

    It is 2·√((1 + κ² + H²)/3) for four equal arms.
    """
    moment = level_of_vehicle(vehicle).moment
    squares = np.linalg.norm(moment, 2, axis=(1, 2)) ** 2
    return math.sqrt(float(squares.sum()) / 3)


def singular_value_rate(vehicle: Vehicle, *, level: bool = True) -> float:
    """Return a Lipschitz constant of all singular values per radian of ‖Δα‖: the largest length of a column.

    It is √(1 + κ² + max(1, H²)) for four equal arms in level flight, and √(2 + κ² + H²) at any attitude.
    """
    of_vehicle = level_of_vehicle(vehicle)
    return of_vehicle.rate if level else of_vehicle.rate_at_any_attitude
