r"""Is the decoupling matrix invertible? Formula (1) of the paper and the physics it comes from.

With outputs (altitude, roll, pitch, yaw) and rotor inputs wᵢ = ωᵢ|ωᵢ|, the determinant of the 4×4 decoupling
matrix is formula (1) of Shen, Ma and Tsuchiya (2022), its misprints corrected, times a constant. Formula (1) is
linear in the vertical seen from the body,

    (1) = Rθ·sin θ + Rφ·sin φ·cos θ + R·cos φ·cos θ,

and with β1 = α1 − δ, β3 = α3 − δ, β2 = α2 + δ, β4 = α4 + δ, tan δ = κ, its first two terms factorise:

    Rφ = −sin(β1 − β3)·sin(β2 + β4) / sin 2δ,
    Rθ = +sin(β1 + β3)·sin(β2 − β4) / sin 2δ.

R is a bilinear form in the pair features p(αᵢ, αₖ) = (cos αᵢ cos αₖ, sin αᵢ sin αₖ, sin(αᵢ + αₖ)) of the two
pairs of opposite arms, which makes it an outer product on a grid.

All this is for rotors at the height of the centre of mass. Rotors H arm lengths above it change two coefficients of
the form and add terms with sin(α1 − α3) and sin(α2 − α4), which vanish on the red sheet (docs/theory.md, 19).

Arrays of tilt angles have shape (..., 4): (α1, α2, α3, α4) in radians; leading axes broadcast. Functions of the
tilt angles alone take :class:`Coefficients`; functions of forces and torques take a :class:`Vehicle`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache, reduce
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, get_args

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import angles_from
from gaitgraph.arrays import read_only
from gaitgraph.errors import InputError, checked_choice
from gaitgraph.vehicle import PAPER, Vehicle, VehicleLike, vehicle_named

if TYPE_CHECKING:
    from collections.abc import Callable

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]
Kind = Literal["published", "printed", "exact"]
KINDS: tuple[Kind, ...] = get_args(Kind)

DEFAULT_FLOOR = 0.05
"""Least singular value of the scaled decoupling matrix that a flyable gait must keep."""

_PUBLISHED = (2.880, 5.592, 0.9716, 0.1687)
_PUBLISHED_ROUNDING = (5e-4, 5e-4, 5e-5, 5e-5)
_EPSILON = float(np.finfo(float).eps)
_TINY = float(np.finfo(float).tiny)
_POWER_PARTS = 256  # of a loop, in the mean of the power in hover
_MINORS_ROUNDED = 1000 * _EPSILON  # more than a sum of minors of order three is off


@dataclass(frozen=True, kw_only=True)
class Coefficients:
    """The four numbers of formula (1) and the crossing angle δ that follows from the first.

    Parameters
    ----------
    kind
        "exact" (functions of κ), "published" (the paper's four digits, as rounded numbers) or "printed" (the same
        digits as they stand, as exact numbers: the sign of R on blue is then what rounding left of zero).
    attitude, single, double, triple
        (1/κ − κ)/2 = cot 2δ, which alone shapes Rφ and Rθ; and the factors of the terms of R with one sine, 1/κ − 2κ,
        with two, 1 − κ² + H², and with three, κ − H²/κ. In the paper, H = 0: 2.880, 5.592, 0.9716 and 0.1687.
    delta
        Crossing angle δ [rad]: the planes of α3 cross at α1 = δ, those of α4 at α2 = −δ.
    first_arm_angle
        Angle of the first arm from body x [rad]; turns Rφ and Rθ, moves no surface.
    cross
        H/κ, the factor of sin(α1 − α3)·sin(α2 − α4) in R; 0 for rotors at the height of the centre of mass.
    """

    kind: Kind
    attitude: float
    single: float
    double: float
    triple: float
    delta: float
    first_arm_angle: float = 0.0
    cross: float = 0.0

    @property
    def colors(self) -> tuple[Literal["red", "blue"], ...]:
        """The sheets on which Rφ = Rθ = 0: red, and for rotors at the height of the centre of mass blue."""
        return ("red",) if self.cross else ("red", "blue")

    @property
    def as_they_stand(self) -> Coefficients:
        """The same numbers without errors of rounding: printed ones instead of published ones."""
        return replace(self, kind="printed") if self.kind == "published" else self

    @cached_property
    def bilinear_form(self) -> FloatArray:
        """The 3×3 matrix K of R = p(α1, α3)ᵀ·K·p(α2, α4) + cross·sin(α1 − α3)·sin(α2 − α4)."""
        form = [
            [4.0, -2.0, self.single],
            [-2.0, 0.0, self.triple],
            [-self.single, -self.triple, self.double],
        ]
        return read_only(np.array(form))

    @cached_property
    def form_norm(self) -> float:
        """The Frobenius norm of the bilinear form."""
        return float(np.linalg.norm(self.bilinear_form))

    @cached_property
    def rounding(self) -> tuple[float, float, float, float]:
        """How far each of the four numbers may be from the exact one: half a unit of its last digit."""
        if self.kind != "exact":
            return _PUBLISHED_ROUNDING
        a, b, c, d = (
            abs(x) * _EPSILON
            for x in (self.attitude, self.single, self.double, self.triple)
        )
        return a, b, c, d

    @cached_property
    def digit_errors(self) -> tuple[float, float, float, float]:
        """Assumed error of each of the four numbers: its rounding, unless the digits count as they stand."""
        return (
            replace(self, kind="exact").rounding
            if self.kind == "printed"
            else self.rounding
        )

    @property
    def delta_error(self) -> float:
        """Assumed error of δ from the rounding of `attitude` [rad]."""
        return 0.5 * self.digit_errors[0] / (1.0 + self.attitude**2) + _EPSILON

    @property
    def sheet_error(self) -> float:
        """Assumed error of α3 and α4 of the blue sheet, 2δ away, from the rounding of `attitude` [rad]."""
        return 2.0 * self.delta_error if self.kind == "published" else 0.0


CoefficientsLike = Coefficients | Kind
"""What may be given for coefficients: see :func:`coefficients_of`."""


def coefficients_of(
    vehicle: VehicleLike = PAPER, kind: CoefficientsLike | None = None
) -> Coefficients:
    """Return the coefficients of formula (1) for a vehicle: κ, spin, rotor height and the first arm's angle matter.

    `kind` is "published", "printed", "exact", or None: published for the paper's vehicle, exact for any other.
    Coefficients are returned unchanged. InputError if the paper's are requested for another vehicle.

    >>> coefficients_of().kind, round(coefficients_of(kind="exact").single, 4)
    ('published', 5.5915)
    """
    if isinstance(kind, Coefficients):
        return kind
    if kind is not None:
        checked_choice("coefficients", kind, KINDS)
    return _coefficients(vehicle_named(vehicle), kind)


@lru_cache(maxsize=64)
def _coefficients(vehicle: Vehicle, kind: Kind | None) -> Coefficients:
    if vehicle.rotor_positions is not None or isinstance(vehicle.drag_to_thrust, tuple):
        raise InputError("vehicle must have four equal arms at right angles as yet")
    if kind is None:
        kind = "published" if vehicle.carries_published_coefficients else "exact"
    if kind != "exact":
        if not vehicle.carries_published_coefficients:
            raised = (
                f", rotor height {vehicle.rotor_height:g} m"
                if vehicle.rotor_height
                else ""
            )
            raise InputError(
                f"coefficients must be 'exact' for {vehicle.name!r} (κ = {vehicle.drag_ratio:.6g}{raised}), got "
                f"{kind!r}, which belong to the paper's vehicle (κ = {PAPER.drag_ratio:.6f})",
                field="coefficients",
            )
        a, b, c, d = _PUBLISHED
        return Coefficients(
            kind=kind,
            attitude=a,
            single=b,
            double=c,
            triple=d,
            delta=0.5 * math.atan2(1.0, a),
        )
    k, height = vehicle.signed_drag_ratio, vehicle.height_ratio
    return Coefficients(
        kind="exact",
        attitude=(1.0 / k - k) / 2.0,
        single=1.0 / k - 2.0 * k,
        double=1.0 - k * k + height**2,
        triple=k - height**2 / k,
        delta=math.atan(k),
        first_arm_angle=vehicle.first_arm_angle,
        cross=height / k,
    )


def tilt_angles(alpha: npt.ArrayLike) -> FloatArray:
    """Return tilt angles as an array of shape (..., 4), or raise InputError."""
    angles: FloatArray = angles_from(alpha, "alpha")
    if angles.ndim == 0 or angles.shape[-1] != 4:
        raise InputError(
            f"alpha must be an array of shape (..., 4), got shape {angles.shape}",
            field="alpha",
        )
    return angles


class Sines(NamedTuple):
    """Tilt angles [rad], their cosines and sines, shape (4, k), and the features of both pairs of arms, (3, 2, k).

    The features of opposite arms are cos·cos, sin·sin and the sine of the sum. What depends on the angles at level
    attitude is made of these, so that each sine is computed once.
    """

    alpha: FloatArray
    cosine: FloatArray
    sine: FloatArray
    features: FloatArray

    @classmethod
    def of(cls, alpha: FloatArray) -> Sines:
        """Return those of points, shape (k, 4) [rad]."""
        rows = alpha.T
        c, s = np.cos(rows), np.sin(rows)
        return cls(
            rows,
            c,
            s,
            np.array([c[:2] * c[2:], s[:2] * s[2:], s[:2] * c[2:] + c[:2] * s[2:]]),
        )

    def level_determinant(self, coefficients: Coefficients) -> FloatArray:
        """Return R of equation (6), shape (k,); see :func:`level_determinant`."""
        first, second = self.features[:, 0], self.features[:, 1]
        level = ((coefficients.bilinear_form.T @ first) * second).sum(axis=0)
        if coefficients.cross:
            level = level + coefficients.cross * np.prod(self.differences(), axis=0)
        return np.asarray(level)

    def level_slopes(self, coefficients: Coefficients) -> FloatArray:
        """Return |∂R/∂αᵢ| for each angle, per radian, shape (4, k)."""
        form, (first, second) = coefficients.bilinear_form, self.features.swapaxes(0, 1)
        rest = np.array([form @ second, form.T @ first]).swapaxes(0, 1)  # for each pair
        # The derivative of the pair features with respect to each angle, its opposite one fixed; shape (2, 2, k).
        across = self.sine.reshape(2, 2, -1) * self.cosine.reshape(2, 2, -1)[::-1]
        along = self.features[0] - self.features[1]
        slopes = rest[1] * across[::-1] - rest[0] * across + rest[2] * along
        if coefficients.cross:
            turned = (self.features[0] + self.features[1]) * self.differences()[::-1]
            slopes += coefficients.cross * np.array([turned, -turned])
        return np.asarray(np.abs(slopes.reshape(4, -1)))

    def level_resolution(
        self, coefficients: Coefficients, slopes: FloatArray, rounding: float = 0.0
    ) -> FloatArray:
        """Return the |R| above which its sign is certain, shape (k,); see :func:`level_determinant_resolution`."""
        first, second = self.features[:, 0], self.features[:, 1]
        form, cross = np.abs(coefficients.bilinear_form), abs(coefficients.cross)
        # single·|p₀q₂ − p₂q₀| + double·|p₂q₂| + triple·|p₁q₂ − p₂q₁| of the features p and q of both pairs.
        _, single, double, triple = coefficients.digit_errors
        crossed = np.abs(first[:2] * second[2] - first[2] * second[:2])
        resolution = (
            single * crossed[0]
            + triple * crossed[1]
            + double * np.abs(first[2] * second[2])
        )
        sizes = np.abs(self.features)
        rounded = 4 * ((form.T @ sizes[:, 0]) * sizes[:, 1]).sum(axis=0)
        resolution += 8 * _EPSILON * (rounded + form.sum() + 4 * cross)
        derived = coefficients.sheet_error
        if derived or rounding:
            resolution += rounding * slopes.sum(axis=0) + derived * slopes[2:].sum(
                axis=0
            )
            resolution += (
                8 * (coefficients.form_norm + cross) * (rounding + derived) ** 2
            )
        return np.asarray(resolution)

    def differences(self) -> FloatArray:
        """Return the sines of α1 − α3 and α2 − α4, shape (2, k)."""
        c, s = self.cosine, self.sine
        return np.asarray(s[:2] * c[2:] - c[:2] * s[2:])

    def totals(self, delta: float) -> FloatArray:
        """Return the sines of β1 + β3 and of β2 + β4, shape (2, k)."""
        beta = self.alpha - delta * _TURNS
        return np.asarray(
            np.sin(beta[:2] + beta[2:])
        )  # exactly zero on fibres, as a product is not

    def leaning(self, delta: float) -> FloatArray:
        """Return E = 2·sin α1·sin α3 − κ·sin(α1 + α3), E′ = 2·sin α2·sin α4 + κ·sin(α2 + α4), κ = tan δ, (2, k).

        A rotor height H adds H/(2κ)·sin(α2 − α4)·E to Rφ and H/(2κ)·sin(α1 − α3)·E′ to Rθ: nothing on red and fibres.
        """
        return np.asarray(
            2.0 * self.features[1] - math.tan(delta) * _TURNS[:2] * self.features[2]
        )

    def sensitivities(
        self, coefficients: Coefficients
    ) -> tuple[FloatArray, FloatArray]:
        """Return Rφ and Rθ by the factorised form of (4) and (5), turned by the angle of the first arm, shape (k,)."""
        (first, fourth), (third, second) = (
            self.totals(coefficients.delta),
            self.differences(),
        )
        scale, half = 1.0 / math.sin(2.0 * coefficients.delta), coefficients.cross / 2
        roll, pitch = -scale * third * fourth, scale * first * second
        if half:
            leaning, other = self.leaning(coefficients.delta)
            roll, pitch = roll + half * second * leaning, pitch + half * third * other
        turn = coefficients.first_arm_angle
        if turn == 0.0:
            return roll, pitch
        sine, cosine = math.sin(turn), math.cos(turn)
        return roll * cosine - pitch * sine, pitch * cosine + roll * sine

    def attitude_sensitivities(self, coefficients: Coefficients) -> FloatArray:
        """Return v, shape (3, k); see :func:`attitude_sensitivities`."""
        roll, pitch = self.sensitivities(coefficients)
        return np.array([-pitch, roll, self.level_determinant(coefficients)]) + 0.0

    def zero_moment_inputs(self, vehicle: Vehicle) -> FloatArray:
        """Return w₀, shape (4, k); see :func:`zero_moment_inputs`."""
        delta = math.atan(vehicle.signed_drag_ratio)
        turned = math.sin(delta) * _TURNS
        cosines = math.cos(delta) * self.cosine + turned * self.sine  # of β1 to β4
        inputs = (self.totals(delta)[::-1] * cosines.reshape(2, 2, -1)[::-1]).reshape(
            4, -1
        )
        height = vehicle.height_ratio * math.cos(delta)
        if height:
            sines = (math.cos(delta) * self.sine - turned * self.cosine).reshape(
                2, 2, -1
            )
            raised = (
                height * (self.sine.reshape(2, 2, -1) * self.leaning(delta)[::-1])[::-1]
            )
            apart = self.differences()[::-1] * _TURNS[:2]
            more = raised + sines[::-1] * np.array([-apart, apart])
            inputs = inputs + height * math.cos(delta) * more.reshape(4, -1)
        return np.asarray(inputs)

    def hover_power(self, vehicle: Vehicle) -> FloatArray:
        """Return the power in hover relative to that at α = 0, shape (k,); see :func:`hover_power`."""
        thrust = thrust_signs(vehicle)[:, None] * self.zero_moment_inputs(vehicle)
        with np.errstate(divide="ignore", invalid="ignore"):
            shares = thrust / np.sum(thrust * self.cosine, axis=0)
        upward = np.maximum(shares, 0.0)
        power = np.sum(upward * np.sqrt(upward), axis=0) / (4 * 0.25**1.5)
        return np.where((shares > 0).all(axis=0), power, np.nan)

    def rotor_directions(self, vehicle: Vehicle) -> tuple[FloatArray, FloatArray]:
        """Return thrust directions, w > 0, and their dimensionless torques, both of shape (3, 4, k)."""
        arms, lift = arm_angles(vehicle)[:, None], thrust_signs(vehicle)[:, None]
        ahead, aside, height, kappa = (
            np.cos(arms),
            np.sin(arms),
            vehicle.height_ratio,
            vehicle.drag_ratio,
        )
        c, s = self.cosine, self.sine
        # Torques are the products of the places (ahead, aside, height) with the directions, less κ times those.
        roll = lift * aside * c + (height * lift * ahead - kappa * aside) * s
        pitch = (height * lift * aside + kappa * ahead) * s - lift * ahead * c
        return np.array([lift * aside * s, -lift * ahead * s, lift * c]), np.array(
            [roll, pitch, -lift * s - kappa * c]
        )

    def characteristic(
        self, vehicle: Vehicle, v: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return forms and numbers of which nᵀ·form·n + number are e4 to e1 at the vertical n, (4, 3, 3, k) and (4, k).

        The squared singular values are the roots of λ⁴ − e1·λ³ + e2·λ² − e3·λ + e4. With the products K of torques, W
        of forces with torques and L of forces, a Schur complement gives the polynomial as det(K − λ)·(nᵀLn − λ) −
        nᵀW·adj(K − λ)·Wᵀn; e4 is the squared determinant. e3 is rounded up, which lowers the least root. `v` is that of
        :meth:`attitude_sensitivities` with exact coefficients, or R alone for n = z, and forms of shape (4, 1, 1, k).
        """
        size = 1 + vehicle.drag_ratio**2 + vehicle.height_ratio**2
        (force, moment), product = self.rotor_directions(vehicle), "ikm,jkm->ijm"
        force = force[-len(v) :]
        L, W, K = (
            np.einsum(product, *pair)
            for pair in ((force, force), (force, moment), (moment, moment))
        )
        WW, WKW = np.einsum(product, W, W), np.einsum("ikm,klm,jlm->ijm", W, K, W)
        (a, b, c), (_, d, e), (_, _, f) = K
        one, two = a + d + f, a * d + a * f + d * f - b * b - c * c - e * e
        three = (
            a * (d * f - e * e)
            - b * (b * f - c * e)
            + c * (b * e - c * d)
            + _MINORS_ROUNDED * size**3
        )
        outer = (2 * vehicle.drag_ratio) ** 2 * v[:, None] * v
        form = np.array([outer, two * L - one * WW + WKW, one * L - WW, L])
        return form, np.array([np.zeros_like(one), three, two, one])

    def least_singular_value_bound(self, vehicle: Vehicle) -> FloatArray:
        """Return lower bounds of :func:`least_singular_value`, level, within 2e-5 of it and much cheaper, shape (k,).

        It is the least root of the characteristic polynomial by a few steps of Laguerre's iteration.
        """
        form, number = self.characteristic(
            vehicle, self.level_determinant(coefficients_of(vehicle, "exact"))[None]
        )
        e4, e3, e2, e1 = form[:, 0, 0] + number
        return singular_value_below(least_root(e1, e2, e3, e4))


def singular_value_below(squared: FloatArray) -> FloatArray:
    """Return the root of a least squared singular value, less what floating point may add to it."""
    return np.asarray(np.maximum(np.sqrt(squared) * (1 - 1e-6) - 1e-9, 0.0))


def least_root(e1: Any, e2: Any, e3: Any, e4: Any) -> FloatArray:
    """Return lower bounds of the least roots of x⁴ − e1·x³ + e2·x² − e3·x + e4, whose roots are real and at least 0.

    Laguerre's iteration from 0 increases towards the least root: each step more than triples the correct digits, or
    leaves 27 % of the distance from a double root.
    """
    slope, height, bend, root = -e3, e4, 2 * e2, np.zeros_like(e1)
    for left in reversed(range(8)):
        steep = np.sqrt(np.maximum(9 * slope * slope - 12 * height * bend, 0.0)) - slope
        root = root + 4 * np.where(slope < 0, height, 0.0) / np.maximum(steep, _TINY)
        if left:
            height = np.maximum(
                (((root - e1) * root + e2) * root - e3) * root + e4, 0.0
            )
            slope = ((4 * root - 3 * e1) * root + 2 * e2) * root - e3
            bend = (12 * root - 6 * e1) * root + 2 * e2
    return np.asarray(root)


def _sines_of(alpha: npt.ArrayLike) -> tuple[FloatArray, Sines]:
    """Return tilt angles as an array of shape (..., 4), and their sines as rows of all points."""
    angles = tilt_angles(alpha)
    return angles, Sines.of(angles.reshape(-1, 4))


_TURNS = np.array([[1.0], [-1.0], [1.0], [-1.0]])  # the signs of δ in β1 to β4, negated


def sensitivity_phases(alpha: npt.ArrayLike, coefficients: Coefficients) -> FloatArray:
    """Return the angles whose sines are the factors of Rθ, then those of Rφ: β1 + β3, β2 − β4, β1 − β3, β2 + β4.

    The first axis has these four, the others are the leading axes of `alpha`; the angle of the first arm is left out.
    """
    angles = tilt_angles(alpha)
    a1, a2, a3, a4 = (angles[..., k] for k in range(4))  # moveaxis takes longer
    twice = 2.0 * coefficients.delta
    return np.array([a1 + a3 - twice, a2 - a4, a1 - a3, a2 + a4 + twice])


def sensitivities(alpha: npt.ArrayLike, coefficients: Coefficients) -> tuple[Any, Any]:
    """Return Rφ and Rθ of equations (4) and (5), each of shape (...)."""
    angles, sines = _sines_of(alpha)
    roll, pitch = (
        one.reshape(angles.shape[:-1]) for one in sines.sensitivities(coefficients)
    )
    return roll, pitch


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
    -0.0
    """
    return sensitivities(alpha, coefficients_of(vehicle, coefficients))[0]


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
    return sensitivities(alpha, coefficients_of(vehicle, coefficients))[1]


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
    angles, sines = _sines_of(alpha)
    return sines.level_determinant(coefficients).reshape(angles.shape[:-1])


def level_determinant_resolution(
    alpha: npt.ArrayLike, coefficients: Coefficients, angle_rounding: float = 0.0
) -> Any:
    """Return the |R| above which its sign is certain, shape (...); `angle_rounding` is the error of each angle [rad].

    It covers rounded coefficients, δ in α3 and α4, rounded angles and floating point.
    """
    angles, sines = _sines_of(alpha)
    slopes = sines.level_slopes(coefficients)
    return sines.level_resolution(coefficients, slopes, angle_rounding).reshape(
        angles.shape[:-1]
    )


@lru_cache(maxsize=64)
def noise_of(coefficients: Coefficients) -> float:
    """Return a bound of the |R| that floating point alone makes where R = 0."""
    return (
        64
        * _EPSILON
        * float(np.abs(coefficients.bilinear_form).sum() + abs(coefficients.cross))
    )


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


def attitude_sensitivities(
    alpha: npt.ArrayLike,
    coefficients: CoefficientsLike | None = None,
    *,
    vehicle: VehicleLike = PAPER,
) -> FloatArray:
    """Return v = (−Rθ, Rφ, R), the normal of the plane of singular verticals in body axes, shape (..., 3).

    Formula (1) at an attitude is v·n, with n of :func:`body_vertical`. The coefficients are those of
    :func:`coefficients_of` for the vehicle, unless they are a record.

    >>> attitude_sensitivities([0, 0, 0, 0]).round(12).tolist()
    [0.0, 0.0, 4.0]
    """
    coefficients = coefficients_of(vehicle, coefficients)
    angles, sines = _sines_of(alpha)
    return sines.attitude_sensitivities(coefficients).T.reshape(*angles.shape[:-1], 3)


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


def arm_angles(vehicle: Vehicle) -> FloatArray:
    """Return each arm's angle from body x, shape (4,) [rad]."""
    return np.asarray(
        vehicle.first_arm_angle + np.arange(4) * (math.pi / 2), dtype=float
    )


def thrust_signs(vehicle: Vehicle) -> FloatArray:
    """Return the sign with which w > 0 thrusts along each upright rotor's axis, and with which it spins, shape (4,)."""
    return np.array([-1.0, 1.0, -1.0, 1.0]) * (
        1.0 if vehicle.first_rotor_spin == "clockwise" else -1.0
    )


def rotor_directions(
    alpha: npt.ArrayLike, vehicle: Vehicle
) -> tuple[FloatArray, FloatArray]:
    """Return thrust directions, w > 0, and their dimensionless torques, both of shape (..., 3, 4)."""
    angles, sines = _sines_of(alpha)
    force, moment = (np.moveaxis(one, -1, 0) for one in sines.rotor_directions(vehicle))
    shape = (*angles.shape[:-1], 3, 4)
    return force.reshape(shape), moment.reshape(shape)


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
    """Return w₀, rotor inputs without torque, up to a common factor, shape (..., 4).

    They are zero where the control moment matrix has rank two or less. On red and on fibres their ratios do not depend
    on the rotor height.
    """
    vehicle = vehicle_named(vehicle)
    angles, sines = _sines_of(alpha)
    return sines.zero_moment_inputs(vehicle).T.reshape(angles.shape)


def zero_moment_direction(
    alpha: npt.ArrayLike, vehicle: VehicleLike = PAPER
) -> FloatArray:
    """Return N = F(α)·w₀/Kf, the force that remains when the thrusts make no torque, shape (..., 3).

    A configuration is singular at an attitude exactly where N is horizontal there, or zero. On the gait surfaces
    N is parallel to body z. Its length has no meaning; its direction is that of the hover thrust, or opposite.
    """
    vehicle = vehicle_named(vehicle)
    force, _ = rotor_directions(alpha, vehicle)
    return np.squeeze(force @ zero_moment_inputs(alpha, vehicle)[..., None], axis=-1)


def hover_thrust_shares(
    alpha: npt.ArrayLike, vehicle: VehicleLike = PAPER
) -> FloatArray:
    """Return the thrusts that carry the weight without torque in level flight, in units of m·g, shape (..., 4).

    Positive pushes up along the tilted rotor axis. Not finite where the matrix is singular in level flight. Off the
    gait surfaces a horizontal force remains, which is not included.

    >>> hover_thrust_shares([0, 0, 0, 0]).round(12).tolist()
    [0.25, 0.25, 0.25, 0.25]
    """
    vehicle = vehicle_named(vehicle)
    angles = tilt_angles(alpha)
    thrust = thrust_signs(vehicle) * zero_moment_inputs(angles, vehicle)
    vertical = np.sum(thrust * np.cos(angles), axis=-1, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(thrust / vertical)


def hover_power(alpha: npt.ArrayLike, vehicle: VehicleLike = PAPER) -> FloatArray:
    """Return the rotors' power in level flight relative to that at α = 0, shape (...), by momentum theory.

    A rotor of thrust f takes a power in proportion to f^1.5. NaN where hover thrusts are not all positive.

    >>> hover_power([[0, 0, 0, 0], [-0.6, 0.6, -0.6, 0.6]]).round(4).tolist()
    [1.0, 1.3337]
    """
    angles, sines = _sines_of(alpha)
    return sines.hover_power(vehicle_named(vehicle)).reshape(angles.shape[:-1])


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
    """Return what no least singular value of a vehicle exceeds, 2·√((1 + κ² + H²)/3) (docs/theory.md, 14 and 19)."""
    return 2 * math.sqrt((1 + vehicle.drag_ratio**2 + vehicle.height_ratio**2) / 3)


def blocks_on_red(
    cosine: FloatArray, sine: FloatArray, vehicle: Vehicle
) -> tuple[list[tuple[FloatArray, FloatArray]], list[FloatArray]]:
    """Return pairs (D, G), and e, of α1 and α2 on red: √8·|D|/G and √2·|e| are singular values, level, the least too.

    At α = (α1, α2, α1, α2) the scaled decoupling matrix is √2 times two blocks [[w, y], [−z, x]]: of yaw torque and
    lift, of sums of opposite thrusts; and of roll and pitch torque, of differences. The singular values of a block have
    the product |D|, D = wx + yz, and the larger one is G/2, the lengths of (w + x, y + z) and (w − x, y − z) together.
    So the smaller one is 2·|D|/G. Without a rotor height the second block has y and z alone: they are e, of α2 and of
    α1 alone. With one there are two pairs, and no e.
    """
    kappa, height, (c1, c2), (s1, s2) = (
        vehicle.signed_drag_ratio,
        vehicle.height_ratio,
        cosine,
        sine,
    )
    alone = [c2 - kappa * s2, c1 + kappa * s1]  # cos β2 and cos β1 over cos δ
    blocks = [(c1, s2 + kappa * c2, c2, kappa * c1 - s1)]
    if height:
        blocks.append((height * s1, height * s2, *alone))
    found = []
    for w, x, y, z in blocks:
        a, b, c, d = w + x, y + z, w - x, y - z
        found.append(
            (
                w * x + y * z,
                np.maximum(np.sqrt(a * a + b * b) + np.sqrt(c * c + d * d), _TINY),
            )
        )
    return found, [] if height else alone


def least_of_blocks(
    blocks: list[tuple[FloatArray, FloatArray]], alone: list[FloatArray]
) -> FloatArray:
    """Return the least singular value on red from what :func:`blocks_on_red` returns."""
    values = [
        *(2.0 * np.abs(product) / size for product, size in blocks),
        *map(np.abs, alone),
    ]
    return np.asarray(math.sqrt(2.0) * reduce(np.minimum, values))


def least_singular_value_on_red(
    alpha1: npt.ArrayLike, alpha2: npt.ArrayLike, vehicle: VehicleLike = PAPER
) -> Any:
    """Return the least singular value at α = (α1, α2, α1, α2), level, in closed form, shape (...)."""
    vehicle = vehicle_named(vehicle)
    angles = np.array(
        np.broadcast_arrays(
            angles_from(alpha1, "alpha1"), angles_from(alpha2, "alpha2")
        )
    )
    return least_of_blocks(*blocks_on_red(np.cos(angles), np.sin(angles), vehicle))


def singular_value_rate(vehicle: Vehicle, *, level: bool = True) -> float:
    """Return a Lipschitz constant of all singular values per radian of ‖Δα‖, √(1 + κ² + max(1, H²)) in level flight.

    For any attitude it is √(2 + κ² + H²).
    """
    squared = vehicle.height_ratio**2
    return math.sqrt(
        1.0 + (max(1.0, squared) if level else 1.0 + squared) + vehicle.drag_ratio**2
    )
