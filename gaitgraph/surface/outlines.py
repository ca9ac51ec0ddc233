r"""Sets of the (α1, α2) plane with curved borders, as polygons: what the sheets' closed forms exclude.

With u = α1 − α2, v = α1 + α2 and w = cos v the conditions of the red sheet are quadratic in w for fixed u:

* R = (w + cos(u − 2δ))·D/(κ cos²δ) with the bracket D = κw + κ cos u − sin u;
* the 2×2 block of the scaled decoupling matrix has the singular values √2·√λ, where the two λ have the product D²
  and the sum F = 2 + κ² + κw·(κ cos u − 2 sin u). With g = floor²/2 both λ are at least g exactly where
  h = D² − gF + g² ≥ 0 and F ≥ 2g. On F = 2g, h = D² − F²/4 ≤ 0: so F is compared once for each piece of h ≥ 0.

Each function returns polygons whose sides are nowhere farther than `tolerance` [rad] from the border of the set,
inside [−π/2, π/2]²; beyond the square they end anywhere. `kappa` is the signed drag ratio.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import shapely

from gaitgraph.angles import HALF_PI
from gaitgraph.surface.borders import Border, Function, Waves, bands_between, cosine, zeros_of_degree_two

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

    from gaitgraph.invertibility.matrices import Coefficients

FloatArray = npt.NDArray[np.float64]

_FAR = 20.0  # farther than any root
_FULL = 2 * math.pi
_BEYOND = 0.3  # beyond the square, so that its sides are no sides of these polygons
_ROOT_TWO = math.sqrt(2.0)


def mirrored(shape: BaseGeometry) -> BaseGeometry:
    """Return the mirror image in α2 = −α1, which swaps the two pairs of arms."""
    return shapely.transform(shape, lambda at: -at[:, ::-1])


def _bracket(kappa: float) -> Waves:
    """Return D as a function of (u, v)."""
    return cosine(1, 0, size=kappa) + cosine(0, 1, size=kappa) + cosine(1, 0, HALF_PI, -1.0)


def _real_root(square: FloatArray, scale: float) -> FloatArray:
    """Return the root of what may be negative by rounding, NaN where it is negative by more."""
    with np.errstate(invalid="ignore"):
        return np.sqrt(np.where(square > -1e-9 * scale, np.maximum(square, 0.0), np.nan))


def _turned(shape: BaseGeometry) -> BaseGeometry:
    """Return a shape of 0 ≤ v ≤ π in the (u, v) plane, continued by cos v, in the (α1, α2) plane."""
    end = math.pi + _BEYOND
    beyond = shapely.transform(shape, lambda at: np.column_stack([at[:, 0], 2 * math.pi - at[:, 1]]))
    upper = shape.union(shapely.clip_by_rect(beyond, -end, 0.0, end, end))
    both = upper.union(shapely.transform(upper, lambda at: at * np.array([1.0, -1.0])))
    return shapely.transform(both, lambda at: np.column_stack([at[:, 1] + at[:, 0], at[:, 1] - at[:, 0]]) / 2)


def _breaks(*functions: Function) -> FloatArray:
    """Return where functions of u of degree two vanish, somewhat beyond [−π, π]."""
    end = math.pi + _BEYOND
    zeros = np.concatenate([zeros_of_degree_two(function, _FULL) for function in functions])
    zeros = np.concatenate([zeros - _FULL, zeros, zeros + _FULL])
    return np.unique(np.concatenate([[-end, end], zeros[np.abs(zeros) < end]]))


def weak_block(floor: float, kappa: float, tolerance: float) -> BaseGeometry:
    """Return where the lesser singular value of the 2×2 block on the red sheet is below a positive floor.

    Around the curve R = 0 this is a band, as narrow as the floor; `tolerance` must not be much above it.
    """
    half = floor**2 / 2

    def bracket(u: FloatArray) -> FloatArray:
        return np.asarray(kappa * np.cos(u) - np.sin(u))

    def lean(u: FloatArray) -> FloatArray:
        return np.asarray(kappa * np.cos(u) - 2 * np.sin(u))

    def discriminant(u: FloatArray) -> FloatArray:
        return half * (-4 * bracket(u) * lean(u) + half * lean(u) ** 2 + 4 * (2 + kappa**2 - half))

    def root(side: float) -> Function:
        scale = half * (8 + 12 * kappa**2 + half)
        return lambda u: (
            (side * _real_root(discriminant(u), scale) - math.copysign(1, kappa) * (2 * bracket(u) - half * lean(u)))
            / (2 * abs(kappa))
        )

    def height(u: FloatArray, w: float) -> FloatArray:
        determinant = kappa * w + bracket(u)
        return np.asarray(determinant**2 - half * (2 + kappa**2 + kappa * w * lean(u)) + half**2)

    def weak(u: float, w: float) -> bool:
        at = np.array([u])
        return bool(height(at, w)[0] < 0) or 2 + kappa**2 + kappa * w * float(lean(at)[0]) < 2 * half

    squares = cosine(1, 0, size=kappa**2) * cosine(0, 1) + cosine(1, 0, HALF_PI, -2 * kappa) * cosine(0, 1)
    border = Border(rest=squares * -half + (half**2 - half * (2 + kappa**2)), squared=_bracket(kappa))
    breaks = _breaks(discriminant, lambda u: height(u, 1.0), lambda u: height(u, -1.0))
    return _turned(bands_between(breaks, (root(-1.0), root(1.0)), weak, border, _ROOT_TWO * tolerance))


def determinant_below(level: float, sign: int, kappa: float, tolerance: float) -> BaseGeometry:
    """Return where sign·R is below a positive level on the red sheet, exact coefficients."""
    delta = math.atan(kappa)
    small = sign * level * math.cos(delta) ** 2

    def line(u: FloatArray) -> FloatArray:
        return np.cos(u - 2 * delta)

    def bracket(u: FloatArray) -> FloatArray:
        return np.asarray(kappa * np.cos(u) - np.sin(u))

    def discriminant(u: FloatArray) -> FloatArray:
        return (kappa * line(u) - bracket(u)) ** 2 + 4 * small * kappa**2

    def root(side: float) -> Function:
        scale = 4 * (1 + kappa**2)
        return lambda u: (
            side * _real_root(discriminant(u), scale) / (2 * abs(kappa)) - (line(u) + bracket(u) / kappa) / 2
        )

    def height(u: FloatArray, w: float) -> FloatArray:
        return (w + line(u)) * (kappa * w + bracket(u)) - small * kappa

    def below(u: float, w: float) -> bool:
        return sign * math.copysign(1, kappa) * float(height(np.array([u]), w)[0]) < 0

    border = Border(rest=(cosine(0, 1) + cosine(1, 0, 2 * delta)) * _bracket(kappa) + -small * kappa)
    breaks = _breaks(discriminant, lambda u: height(u, 1.0), lambda u: height(u, -1.0))
    return _turned(bands_between(breaks, (root(-1.0), root(1.0)), below, border, _ROOT_TWO * tolerance))


def bracket_negative(kappa: float, tolerance: float) -> BaseGeometry:
    """Return where the bracket D is negative inside the square: tan α1 − tan α2 > 2κ.

    On the border α1 − α2 is the angle from 1 + κ sin 2α2 to 2κ cos² α2, a smooth function of α2. D vanishes in the
    corners (π/2, −π/2) and (−π/2, π/2) too, but changes no sign inside the square there.
    """

    def root(y: FloatArray) -> FloatArray:
        return np.asarray(y + np.arctan2(2 * kappa * np.cos(y) ** 2, 1 + kappa * np.sin(2 * y)))

    # D = 2κ cos α1 cos α2 − sin(α1 − α2), with α2 as the first coordinate.
    bracket = cosine(1, 0) * cosine(0, 1, 0.0, 2 * kappa) + cosine(-1, 1, HALF_PI, -1.0)
    found = bands_between(
        np.array([-HALF_PI - _BEYOND, 0.0, HALF_PI + _BEYOND]),
        (root,),
        lambda y, x: x > float(root(np.array([y]))[0]),
        Border(rest=bracket),
        tolerance,
        ends=(-_FAR, _FAR),
        ordinate=lambda x: x,
    )
    return shapely.transform(found, lambda at: at[:, ::-1])


def thrust_above(share: float, kappa: float, tolerance: float) -> BaseGeometry:
    """Return where, with all hover thrusts positive, one of them is more than a share of the weight.

    T1 = T3 is within the bound where |sin β2|·(1 − 2s cos α1) ≤ 2s·|sin β1|·cos α2, which is explicit in tan α2; the
    other pair is the mirror image.
    """
    delta = math.atan(kappa)

    def border(x: FloatArray) -> FloatArray:
        rest = np.maximum(1 - 2 * share * np.cos(x), 0.0)
        return np.arctan2(-2 * share * np.sin(x - delta) - rest * math.sin(delta), rest * math.cos(delta))

    def above(x: float, y: float) -> bool:
        if 2 * share * math.cos(x) >= 1:
            return False
        limit = float(border(np.array([x]))[0])
        return y > limit if x < delta else y < limit

    vanishing = cosine(0, 1, HALF_PI - delta) * (cosine(1, 0, 0.0, -2 * share) + 1.0)
    vanishing = vanishing + cosine(1, 0, HALF_PI + delta) * cosine(0, 1, 0.0, 2 * share)
    free = math.acos(1 / (2 * share)) if share > 0.5 else 0.0
    breaks = np.unique([-HALF_PI - _BEYOND, -free, free, delta, HALF_PI + _BEYOND])
    found = bands_between(
        breaks, (border,), above, Border(rest=vanishing), tolerance, ends=(-_FAR, _FAR), ordinate=lambda y: y
    )
    return found.union(mirrored(found))


def blue_determinant_below(level: float, sign: int, coefficients: Coefficients, tolerance: float) -> BaseGeometry:
    """Return where sign·R is below a positive level on the blue sheet, with the given, rounded coefficients.

    R is bilinear in cos 2β1 and cos 2β2 there, up to the sign that each wrap of α3 and of α4 by π turns. Nothing is
    wrapped here: R is that of α3 = 2δ − α1 and α4 = −2δ − α2.
    """
    delta, form = coefficients.delta, coefficients.bilinear_form
    # Pair features (cos·cos, sin·sin, sin of the sum) in terms of (cos 2β, 1), for both pairs of arms.
    turn = 2 * delta
    first = np.array([[0.5, math.cos(turn) / 2], [0.5, -math.cos(turn) / 2], [0.0, math.sin(turn)]])
    second = first * np.array([[1.0], [1.0], [-1.0]])
    (both, one), (other, none) = sign * first.T @ form @ second

    def border(x: FloatArray) -> FloatArray:
        turned = np.cos(2 * x)
        with np.errstate(divide="ignore", invalid="ignore"):
            w = (level - none - one * turned) / (other + both * turned)
        return np.asarray(np.where(np.isfinite(w), w, _FAR))

    def below(x: float, w: float) -> bool:
        c = math.cos(2 * x)
        return bool(both * c * w + one * c + other * w + none < level)

    def height(w: float) -> Function:
        return lambda x: (both * w + one) * np.cos(2 * x) + other * w + none - level

    vanishing = cosine(2, 0) * (cosine(0, 2, 0.0, both) + one) + cosine(0, 2, 0.0, other) + (none - level)
    zeros = [zeros_of_degree_two(height(w), math.pi) for w in (1.0, -1.0)]
    breaks = np.unique(np.concatenate([[-HALF_PI, 0.0, HALF_PI], *zeros]))
    found = bands_between(
        breaks, (border,), below, Border(rest=vanishing), tolerance, ordinate=lambda w: np.arccos(w) / 2
    )
    found = found.union(shapely.transform(found, lambda at: at * np.array([1.0, -1.0])))
    end = HALF_PI + _BEYOND
    near = shapely.box(-end, -end, end, end)
    shifts = [np.array([i * math.pi + delta, j * math.pi - delta]) for i in (-1, 0, 1) for j in (-1, 0, 1)]
    return shapely.union_all([shapely.transform(found, shift.__add__).intersection(near) for shift in shifts])
