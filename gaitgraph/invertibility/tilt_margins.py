r"""How far a configuration is from a singular matrix: tilt margin and worst attitude.

Formula (1) is v·n with v = (−Rθ, Rφ, R) and n the upward vertical in body axes, so the matrix is singular exactly where
the vertical lies in the plane across v. The least tilt from upright that brings it there, in any direction, is the

    tilt margin = asin(|R|/‖v‖) = atan(|R|/√(Rφ² + Rθ²)),

90° on the gait surfaces and 0° where R = 0. Where v = 0 the matrix is singular at every attitude and there is no
margin: NaN is returned wherever v is within the errors of the coefficients, of the angles and of floating point.

How well the matrix can be inverted is measured by its least singular value, not by the determinant.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import (
    HALF_PI,
    angle_from_text,
    angle_within,
    in_degrees,
    number_of,
)
from gaitgraph.errors import wrong
from gaitgraph.invertibility.coefficients import (
    Coefficients,
    CoefficientsLike,
    coefficients_of,
)
from gaitgraph.invertibility.forms import FloatArray, Level, Sines
from gaitgraph.invertibility.matrices import (
    attitude_of,
    attitude_sensitivities,
    least_singular_value,
    level_determinant,
    level_of_vehicle,
    noise_of,
    sines_of,
    tilt_angles,
)
from gaitgraph.invertibility.segment_bounds import (
    Points,
    bends_of,
    least_of_each,
    least_root,
)
from gaitgraph.records import Record
from gaitgraph.vehicle import PAPER, Vehicle, VehicleLike, vehicle_named

_BLOCK = 1 << 13
EVERYWHERE = "the matrix is singular at every attitude, within the rounding of the coefficients and the angles"
"""Why a gait has no tilt margin and no acceptable attitudes."""

_TINY = float(np.finfo(float).tiny)
_MINORS_ROUNDED = 1000 * float(np.finfo(float).eps)  # more than a sum of minors is off
_LARGEST_ERROR = (
    0.1  # more than the error of v from coefficients of four digits and angles of three
)


def tilt_margin(
    alpha: npt.ArrayLike,
    coefficients: CoefficientsLike | None = None,
    *,
    vehicle: VehicleLike = PAPER,
    angle_rounding: float = 0.0,
) -> Any:
    """Return the least tilt from upright, in any direction, at which the matrix is singular, shape (...) in [0, π/2].

    The coefficients are those of :func:`coefficients_of` for the vehicle, unless they are a record; the physical margin
    takes exact ones. `angle_rounding` is the assumed error of each angle [rad]. NaN where there is no margin, because
    the matrix is singular at every attitude within the errors. The matrix may be badly conditioned within the margin;
    see :func:`least_singular_value_within`.

    >>> biased = [[1.178, -0.393, 1.178, -0.393], [1.178, -0.393, 0.9424, -0.3144]]
    >>> np.degrees(tilt_margin(biased, "exact")).round(2)
    array([90.  , 86.79])
    """
    coefficients = coefficients_of(vehicle, coefficients)
    angles = tilt_angles(alpha)
    rounding = angle_within(angle_rounding, "angle_rounding", least=0.0)
    rows = angles.reshape(-1, 4)
    margin = np.empty(len(rows))
    for k in range(0, len(rows), _BLOCK):
        margin[k : k + _BLOCK] = np.abs(
            _signed_margin(rows[k : k + _BLOCK], coefficients, rounding)[0]
        )
    return margin.reshape(angles.shape[:-1])[()]


def _signed_margin(
    rows: FloatArray, coefficients: Coefficients, angle_rounding: float
) -> tuple[FloatArray, ...]:
    """Return, for rows (m, 4), the margin with the sign of R, NaN where there is none, √(Rφ² + Rθ²) and R."""
    sines = Sines.of(rows)
    v = coefficients.sensitivities(sines)
    across, level = np.hypot(v[0], v[1]), v[2]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        margin = np.arctan(level / across)
    small = _LARGEST_ERROR
    if coefficients.kind != "published" and not angle_rounding:
        small = float(coefficients.noise.max())
    near = np.flatnonzero((np.abs(v) <= small).all(axis=0))
    if near.size:
        errors = coefficients.errors(Sines.of(rows[near]), angle_rounding)
        vanishing = (np.abs(v[:, near]) <= errors).all(axis=0)
        margin[near[vanishing]] = np.nan
    return margin, across, level


def singular_everywhere(
    alpha: npt.ArrayLike, coefficients: Coefficients, *, angle_rounding: float = 0.0
) -> npt.NDArray[np.bool_]:
    """Return whether Rφ, Rθ and R all vanish within the errors of coefficients and angles, as on blue, shape (...)."""
    shape, sines = sines_of(alpha)
    v = np.abs(coefficients.form.at(sines))
    vanishing = (v <= coefficients.errors(sines, angle_rounding)).all(axis=0)
    return np.asarray(vanishing.reshape(shape))


def nearest_singular_attitude(
    alpha: npt.ArrayLike,
    coefficients: CoefficientsLike | None = None,
    *,
    vehicle: VehicleLike = PAPER,
) -> FloatArray:
    """Return the (roll, pitch) of least tilt at which the matrix is singular, shape (..., 2) [rad].

    On the gait surfaces every direction is the same, 90° away, and NaN is returned, as it is where v = 0. The
    coefficients are those of :func:`coefficients_of` for the vehicle, unless they are a record.

    >>> from gaitgraph.invertibility.matrices import coefficients_of, determinant
    >>> exact, alpha = coefficients_of(kind="exact"), [0.4, -1.1, 0.3, -0.9]
    >>> roll, pitch = nearest_singular_attitude(alpha, exact)
    >>> bool(abs(determinant(alpha, exact, roll, pitch)) < 1e-12)
    True
    """
    coefficients = coefficients_of(vehicle, coefficients)
    v = attitude_sensitivities(tilt_angles(alpha), coefficients)
    across = np.hypot(v[..., 0], v[..., 1])
    noise = noise_of(coefficients)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        # n = cos(margin)·z + sin(margin)·h with v·n = 0: h points against the horizontal part of v if R > 0.
        unit = (
            -np.where(v[..., 2] < 0, -1.0, 1.0)[..., None]
            * v[..., :2]
            / across[..., None]
        )
        margin = np.arctan(np.abs(v[..., 2]) / across)
    up = np.concatenate(
        [np.sin(margin)[..., None] * unit, np.cos(margin)[..., None]], axis=-1
    )
    return np.where((across > noise)[..., None], attitude_of(up), np.nan)


def sensitivity_deviations(
    starts: FloatArray, ends: FloatArray, coefficients: Coefficients
) -> tuple[FloatArray, FloatArray]:
    """Return how far (−Rθ, Rφ) and R can be from the chords between their ends, along segments, both of shape (m,)."""
    first, second, level = bends_of(coefficients.form).along(ends - starts) / 8
    across = np.hypot(first, second)
    across[coefficients.holds_plane(starts.T, ends.T)] = 0.0  # Rφ = Rθ = 0
    return across, level


@dataclass(frozen=True, slots=True, kw_only=True)
class LeastMargin(Record):
    """The least tilt margin along segments [rad], proven to be in [lower, upper]; both NaN if there is no margin.

    `upper` is attained at `fraction` of `segment`. `reason` says why the margin is zero or why there is none, else "".
    """

    lower: float
    upper: float
    segment: int
    fraction: float
    reason: str = ""

    @property
    def exists(self) -> bool:
        """Whether there is a margin at all."""
        return not math.isnan(self.upper)


@dataclass(frozen=True)
class _Margin:
    """The tilt margin, at least 0: where R has the other sign it is 0."""

    coefficients: Coefficients
    sign: float
    angle_rounding: float
    count = 1

    def state(self, points: Points, least: FloatArray) -> FloatArray:
        """Return the margin, √(Rφ² + Rθ²) and R with the sign."""
        margin, across, level = _signed_margin(
            points.rows, self.coefficients, self.angle_rounding
        )
        positive = np.where(self.sign * margin > 0, np.abs(margin), 0.0)
        return np.array([positive, across, self.sign * level])

    def bounds(
        self, first: FloatArray, last: FloatArray, p0: FloatArray, p1: FloatArray
    ) -> FloatArray:
        """Return lower bounds, the larger of two."""
        across, rise = sensitivity_deviations(p0, p1, self.coefficients)
        # The widest (Rφ, Rθ) and the least R: all that counts on the surfaces, where (Rφ, Rθ) vanishes and R may bend.
        widest = np.maximum(first[1], last[1]) + across
        lowest = np.minimum(first[2], last[2]) - rise
        apart = np.arctan2(np.maximum(lowest, 0.0), widest)
        near, off = np.full(len(rise), np.inf), np.hypot(across, rise)
        for margin, *v in (first, last):
            # R·cos m − ‖(Rφ, Rθ)‖·sin m is ‖v‖·sin(margin − m) at an end, above its chord but for `off` in between, and
            # the margin is at least m where it is not negative.
            with np.errstate(divide="ignore", invalid="ignore"):
                ratio = off / np.hypot(*v)
            turned = margin - np.arcsin(np.minimum(ratio, 1.0))
            near = np.minimum(near, np.where(ratio < 1, turned, -1.0))
        return np.asarray(np.maximum(near, apart)[None])


def least_tilt_margin(
    points: npt.ArrayLike,
    coefficients: Coefficients,
    *,
    angle_rounding: float = 0.0,
    tolerance: float = 1e-7,
) -> LeastMargin:
    """Bracket the least tilt margin along the m segments through finite angles, shape (m + 1, 4), to a tolerance [rad].

    Zero where R changes its sign, or where v vanishes at an isolated point. There is none if v vanishes along a whole
    segment, if there is only one point, or if v cannot be distinguished from zero somewhere because of rounding.
    """
    points = np.asarray(tilt_angles(points))
    starts, ends = points[:-1], points[1:]
    held = _segment_singular_everywhere(starts, ends, coefficients, angle_rounding)
    if held is not None:
        return _no_margin(held, 0.0)
    level = np.asarray(level_determinant(starts, coefficients))
    sign = math.copysign(1.0, level[np.argmax(np.abs(level))])
    quantity = _Margin(coefficients, sign, angle_rounding)
    (margins,) = least_of_each(starts, ends, [quantity], [tolerance])
    lower, upper, segment, fraction = margins.worst()
    if upper > 0:
        return LeastMargin(lower=lower, upper=upper, segment=segment, fraction=fraction)
    crossing = _first_crossing(points, coefficients, sign, segment, fraction)
    if crossing is not None:
        segment, fraction = crossing
        reason = "R changes its sign"
    else:
        at = starts[segment] + fraction * (ends - starts)[segment]
        reason = "R vanishes there"
        if singular_everywhere(at, coefficients, angle_rounding=angle_rounding):
            if not singular_everywhere(at, coefficients.as_they_stand):
                return _no_margin(segment, fraction)  # v may not vanish here
            reason = "the matrix is singular at every attitude, at this point only"
    return LeastMargin(
        lower=0.0, upper=0.0, segment=segment, fraction=fraction, reason=reason
    )


def _no_margin(segment: int, fraction: float) -> LeastMargin:
    """Return that v cannot be told from zero at a place."""
    return LeastMargin(
        lower=math.nan,
        upper=math.nan,
        segment=segment,
        fraction=fraction,
        reason=EVERYWHERE,
    )


def _segment_singular_everywhere(
    starts: FloatArray, ends: FloatArray, coefficients: Coefficients, rounding: float
) -> int | None:
    """Return the first segment along which v vanishes, if there is one."""
    held = np.arange(len(starts))
    for fraction in (0.0, 1.0, 0.5, 0.381966):
        at = starts[held] + fraction * (ends - starts)[held]
        held = held[singular_everywhere(at, coefficients, angle_rounding=rounding)]
    return int(held[0]) if held.size else None


def _first_crossing(
    points: FloatArray,
    coefficients: Coefficients,
    sign: float,
    segment: int,
    fraction: float,
) -> tuple[int, float] | None:
    """Return where R first changes its sign, at points or else before a fraction of a segment; None if it does not."""
    levels = sign * np.asarray(level_determinant(points, coefficients))
    noise = noise_of(coefficients)
    if levels[0] < -noise:
        sign = -sign
        levels = -levels
    lost = np.flatnonzero(levels[1:] < -noise)
    high = fraction
    if lost.size:
        segment = int(lost[0])
        high = 1.0
    start, step = points[segment], points[segment + 1] - points[segment]

    def level(share: float) -> float:
        return sign * float(level_determinant(start + share * step, coefficients))

    if not lost.size and not level(high) < -noise:
        return None
    low = 0.0
    middle = high / 2
    while low < middle < high:
        if level(middle) > 0:
            low = middle
        else:
            high = middle
        middle = (low + high) / 2
    return segment, high


def checked_tilt(tilt: object) -> float:
    """Return a tilt in [0, π/2) [rad], or raise InputError."""
    number = angle_from_text(tilt, "tilt") if isinstance(tilt, str) else number_of(tilt)
    if not 0 <= number < HALF_PI:
        raise wrong(
            "tilt", "must be at least 0 and less than π/2 rad", tilt, in_degrees(tilt)
        )
    return number


def least_singular_value_within(
    alpha: npt.ArrayLike, tilt: float, vehicle: VehicleLike = PAPER
) -> tuple[FloatArray, FloatArray]:
    """Return the least singular value at the worst attitude within a tilt, and that attitude.

    The tilt from upright, in any direction, is in [0, π/2) [rad]. The value, of the exact scaled decoupling matrix and
    shape (...), is zero where the tilt margin is not above `tilt`. The attitude is (roll, pitch), shape (..., 2) [rad].

    Notes
    -----
    A number λ ≥ 0 is below all squared singular values at a vertical n exactly if the characteristic polynomial is
    positive from 0 to λ. It is a quadratic form of n, the least of which within a tilt is on the rim (docs/theory.md,
    13), where it is a trigonometric polynomial of degree two. Each step computes λ of the best direction so far, then
    the best direction for that λ, until no direction is better.

    Examples
    --------
    >>> value, attitude = least_singular_value_within([0.3, -0.2, 0.1, 0.5], 0.5)
    >>> from gaitgraph.invertibility.matrices import least_singular_value
    >>> bool(abs(value - least_singular_value([0.3, -0.2, 0.1, 0.5], PAPER, *attitude)) < 1e-12)
    True
    """
    vehicle = vehicle_named(vehicle)
    tilt = checked_tilt(tilt)
    angles = tilt_angles(alpha)
    rows = angles.reshape(-1, 4)
    exact = coefficients_of(vehicle, "exact")
    within = tilt_margin(rows, exact) > tilt
    attitude = nearest_singular_attitude(rows, exact)
    _, ahead, aside = _worst_on_rim(rows, tilt, vehicle)
    verticals = np.array(
        [
            math.sin(tilt) * ahead,
            math.sin(tilt) * aside,
            np.full(len(rows), math.cos(tilt)),
        ]
    ).T
    attitude = np.where(
        within[:, None], attitude_of(verticals), np.nan_to_num(attitude)
    )
    value = np.where(within, least_singular_value(rows, vehicle, *attitude.T), 0.0)
    shape = angles.shape[:-1]
    return value.reshape(shape)[()], attitude.reshape(*shape, 2)


def least_singular_value_within_bound(
    rows: FloatArray, tilt: float, vehicle: Vehicle
) -> FloatArray:
    """Return lower bounds of :func:`least_singular_value_within`, within 1e-4 of it and cheaper, for rows (m, 4)."""
    squared, _, _ = _worst_on_rim(rows, tilt, vehicle)
    return singular_value_below(squared)


def _characteristic(
    sines: Sines, level: Level, v: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return forms and numbers of which nᵀ·form·n + number are e4 to e1 at the vertical n, (4, 3, 3, k) and (4, k).

    The squared singular values are the roots of λ⁴ − e1·λ³ + e2·λ² − e3·λ + e4. With the products K of torques, W
    of forces with torques and L of forces, a Schur complement gives the polynomial as det(K − λ)·(nᵀLn − λ) −
    nᵀW·adj(K − λ)·Wᵀn; e4 is the squared determinant. e3 is rounded up, which lowers the least root. `v` is that of
    the exact form.
    """
    force, moment = (
        np.moveaxis(part, 0, -1) for part in level.forces_and_moments(sines)
    )
    product = "ikm,jkm->ijm"
    L, W, K = (
        np.einsum(product, *pair)
        for pair in ((force, force), (force, moment), (moment, moment))
    )
    WW, WKW = np.einsum(product, W, W), np.einsum("ikm,klm,jlm->ijm", W, K, W)
    (a, b, c), (_, d, e), (_, _, f) = K
    size = level.rate_at_any_attitude**6
    one = a + d + f
    two = a * d + a * f + d * f - b * b - c * c - e * e
    three = a * (d * f - e * e) - b * (b * f - c * e) + c * (b * e - c * d)
    three = three + _MINORS_ROUNDED * size
    outer = (2 * level.rotors.drag_ratio) ** 2 * v[:, None] * v
    form = np.array([outer, two * L - one * WW + WKW, one * L - WW, L])
    return form, np.array([np.zeros_like(one), three, two, one])


def singular_value_below(squared: FloatArray) -> FloatArray:
    """Return the root of a least squared singular value, less what floating point may add to it."""
    return np.asarray(np.maximum(np.sqrt(squared) * (1 - 1e-6) - 1e-9, 0.0))


def _worst_on_rim(
    rows: FloatArray, tilt: float, vehicle: Vehicle
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the least squared singular value within a tilt, and the cosine and the sine of its direction, (m,)."""
    sines, level = Sines.of(rows), level_of_vehicle(vehicle)
    rim, height = math.sin(tilt), math.cos(tilt)
    v = level.direction.at(sines)
    form, number = _characteristic(sines, level, v)
    # On the rim e4 to e1 are a number and the factors of cos 2t, sin 2t, cos t and sin t: shape (5, 4, m).
    xx = rim**2 * form[:, 0, 0] / 2
    yy = rim**2 * form[:, 1, 1] / 2
    middle = height**2 * form[:, 2, 2] + number
    twice = rim**2 * form[:, 0, 1]
    once = 2 * rim * height * form[:, :2, 2].swapaxes(0, 1)
    forms = np.array([xx + yy + middle, xx - yy, twice, *once])
    # The first guess is the direction of the nearest singular attitude.
    size = np.hypot(v[0], v[1])
    across = np.where(v[2] < 0, size, -size)
    beyond = rim * size >= height * np.abs(v[2])
    flat = size == 0
    c, s = np.where(flat, [[1.0], [0.0]], v[:2] / np.where(flat, 1.0, across))
    best = np.array([c, s])
    squared = np.full(len(rows), np.inf)
    open_ = np.arange(len(rows))
    while open_.size:
        waves = np.array([np.ones(len(c)), c * c - s * s, 2 * c * s, c, s])
        _, e3, e2, e1 = np.einsum("ikm,im->km", forms, waves)
        value = (
            2 * level.rotors.drag_ratio * (rim * (v[0] * c + v[1] * s) + height * v[2])
        )
        tried = least_root(e1, e2, e3, value**2, steps=8)
        better = tried < squared[open_] * (1 - 1e-12)
        forms = forms[:, :, better]
        v = v[:, better]
        tried = tried[better]
        open_ = open_[better]
        squared[open_], best[:, open_] = tried, np.array([c, s])[:, better]
        _, *waves = forms[:, 0] - tried * (
            forms[:, 1] - tried * (forms[:, 2] - tried * forms[:, 3])
        )
        c, s = _least_direction(*waves)
    squared[beyond] = 0.0
    return squared, best[0], best[1]


def _least_direction(
    A: FloatArray, B: FloatArray, D: FloatArray, E: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the cosine and the sine of the t at which A·cos 2t + B·sin 2t + D·cos t + E·sin t is least.

    Along the direction in which the first two are least, and across it, D and E are b and c. The sum is then
    −a·cos 2u + b·cos u + c·sin u, least where both terms are negative and 4a·t/√(1 + t²) + |b|·t = |c| for t = |tan u|.
    The left side is concave, and Newton's iteration from below increases towards the only root.
    """
    a = np.sqrt(A * A + B * B)
    large = np.sqrt((1 + np.abs(A) / np.maximum(a, _TINY)) / 2)
    small = np.where(a > 0, np.abs(B) / np.maximum(2 * a * large, _TINY), large)
    flat = A < 0
    c1, s1 = np.where(flat, large, small), np.copysign(np.where(flat, small, large), -B)
    b, c = D * c1 + E * s1, E * c1 - D * s1
    a, across = 4 * a, np.abs(c)
    along = np.maximum(np.abs(b), 1e-15 * (a + across))  # without b, u may be 90°
    t = across / np.maximum(a + along, _TINY)
    for _ in range(11):
        squared = 1 / (1 + t * t)
        pull = a * np.sqrt(squared)
        t += (across - (pull + along) * t) / np.maximum(pull * squared + along, _TINY)
    x = 1 / np.sqrt(1 + t * t)
    x, y = -np.copysign(x, b), -np.copysign(x * t, c)
    return x * c1 - y * s1, x * s1 + y * c1
