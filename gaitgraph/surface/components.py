"""Where R has a sign: the seven components of the red sheet, and what rounding leaves on the blue one.

On the red sheet the components are labelled by the signs of the three factors of R
(:func:`gaitgraph.surface.sheets.red_label`). The sign of R on a grid cannot separate them: it joins them across the
saddles, where a line and the curve cross and R vanishes to second order.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import shapely

from gaitgraph.angles import HALF_PI
from gaitgraph.errors import InputError, shown
from gaitgraph.invertibility.matrices import Coefficients, coefficients_of, level_determinant, noise_of
from gaitgraph.invertibility.segment_bounds import least_level_determinant
from gaitgraph.surface.outlines import blue_determinant_below, bracket_negative, determinant_below
from gaitgraph.surface.region import (
    DEFAULT_ACCURACY,
    OPEN_MARGIN,
    Condition,
    Region,
    checked_accuracy,
    checked_number,
    chord_tolerance,
    offset,
    polygons_of,
    rectangle,
    region_between,
    square_without,
    union_of,
)
from gaitgraph.surface.sheets import COLORS, SIGNS, Color, Sign, sheet_angles
from gaitgraph.vehicle import PAPER, Vehicle

if TYPE_CHECKING:
    from shapely import Polygon
    from shapely.geometry.base import BaseGeometry

_EPSILON = float(np.finfo(float).eps)


@dataclass(frozen=True, slots=True, kw_only=True)
class SignComponent:
    """A component of R ≠ 0 on the red sheet inside [−π/2, π/2]², and where it is.

    `label` holds the signs of cos β1, cos β2 and the bracket, see :func:`gaitgraph.surface.sheets.red_label`; `sign` is
    that of R, their product.
    """

    label: tuple[int, int, int]
    sign: int
    region: Region


def sign_components(vehicle: Vehicle = PAPER, *, accuracy: float = DEFAULT_ACCURACY) -> tuple[SignComponent, ...]:
    """Return the components of R ≠ 0 on the red sheet inside [−π/2, π/2]², with exact coefficients: seven.

    Parameters
    ----------
    vehicle
        The vehicle, of which κ and the spin sense count.
    accuracy
        How far the curved borders may be from where they are [rad], 1e-9 to 0.1. R = 0 is excluded: `inner` keeps
        1e-9 from straight borders.

    Examples
    --------
    >>> [(part.sign, round(part.region.area, 3)) for part in sign_components()]
    [(1, 4.465), (-1, 4.383), (-1, 0.484), (1, 0.013), (-1, 0.484), (1, 0.013), (1, 0.028)]
    """
    return _components(vehicle, checked_accuracy(accuracy), OPEN_MARGIN)


def _components(vehicle: Vehicle, accuracy: float, margin: float) -> tuple[SignComponent, ...]:
    """Return the components; `inner` keeps a margin to straight borders."""
    kappa = vehicle.signed_drag_ratio
    border = math.atan(kappa) - math.copysign(HALF_PI, kappa)
    spin = 1 if kappa > 0 else -1
    exact = coefficients_of(vehicle, "exact")
    half = accuracy / 2
    negative = bracket_negative(kappa, chord_tolerance(accuracy))
    wide, narrow = offset(negative, half), offset(negative, -half)
    # The bracket vanishes in two corners of the square too.
    corners = union_of(rectangle(x - half, -x - half, x + half, -x + half) for x in (HALF_PI, -HALF_PI))
    found = []
    for first in (1, -1):
        for second in (1, -1):
            inner_cell, outer_cell = (_cell(border, first * spin, second * spin, kept) for kept in (margin, 0.0))
            for third in (1, -1):
                # The third sign is positive on the side of α = 0, whichever way the rotors spin.
                if third * spin > 0:
                    inner, outer = inner_cell.difference(wide), outer_cell.difference(narrow)
                else:
                    inner, outer = inner_cell.intersection(narrow), outer_cell.intersection(wide)
                inner = inner.difference(corners)
                if inner.is_empty:
                    continue
                sign = first * second * third
                region = region_between(inner, outer, accuracy, determinant_condition(sign, 0.0, "red", exact))
                found.append(SignComponent(label=(first, second, third), sign=sign, region=region))
    return tuple(found)


def _cell(border: float, first: int, second: int, margin: float) -> Polygon:
    """Return a quarter of the square: α1 beyond (+1) or short of a border, and −α2 likewise."""
    low, high = (border + margin, HALF_PI) if first > 0 else (-HALF_PI, border - margin)
    left, right = (border + margin, HALF_PI) if second > 0 else (-HALF_PI, border - margin)
    return rectangle(low, -right, high, -left)


def sign_region(
    sign: Sign,
    vehicle: Vehicle = PAPER,
    *,
    color: Color = "red",
    coefficients: Coefficients | None = None,
    least: float | None = None,
    accuracy: float = DEFAULT_ACCURACY,
) -> Region:
    """Return where R has a sign, and at least a size, on a sheet.

    Parameters
    ----------
    vehicle
        The vehicle, of which κ and the spin sense count.
    color
        On blue R is zero with exact coefficients, and the region empty; with published ones it is
        what their rounding leaves, and where α3 or α4 wraps by π the region is cut.
    coefficients
        The coefficients of R on blue; on red R is exact. By default those of :func:`coefficients_of`.
    least
        The least |R|. By default 0 on red, where R ≠ 0 is meant, and what floating point can tell from 0 on blue.
    accuracy
        How far curved borders may be from where they are [rad], 1e-9 to 0.1.

    Raises
    ------
    InputError
        If the sign, the color, `least` or the accuracy is not allowed.

    Examples
    --------
    >>> round(sign_region("positive").area, 2), round(sign_region("negative").area, 2)
    (4.52, 5.35)
    >>> sign_region("negative", color="blue", coefficients=coefficients_of(kind="exact")).area
    0.0
    """
    wanted, accuracy = checked_sign(sign), checked_accuracy(accuracy)
    if color not in COLORS:
        raise InputError(f"color must be 'red' or 'blue', got {shown(color)}")
    least = None if least is None else checked_number("least", least, "a finite number ≥ 0", zero=True)
    if color == "blue":
        coefficients = coefficients or coefficients_of(vehicle)
        return _blue_sign_region(wanted, coefficients, least or noise_of(coefficients), accuracy)
    exact = coefficients_of(vehicle, "exact")
    margin = accuracy if least else OPEN_MARGIN
    parts = [part.region for part in _components(vehicle, accuracy, margin) if part.sign == wanted]
    inner, outer = union_of(part.inner for part in parts), union_of(part.outer for part in parts)
    if least and determinant_falls_below(least, wanted, inner, exact):
        forbidden = determinant_below(least, wanted, vehicle.signed_drag_ratio, chord_tolerance(accuracy))
        inner, outer = square_without(forbidden, accuracy / 2)
    return region_between(inner, outer, accuracy, determinant_condition(wanted, least or 0.0, "red", exact))


def _blue_sign_region(sign: int, coefficients: Coefficients, least: float, accuracy: float) -> Region:
    border = 2 * coefficients.delta - math.copysign(HALF_PI, coefficients.delta)
    side = 1 if coefficients.delta > 0 else -1
    kept = {
        turn: square_without(
            blue_determinant_below(least, turn * sign, coefficients, chord_tolerance(accuracy)), accuracy / 2
        )
        for turn in (1, -1)
    }
    parts: list[list[BaseGeometry]] = [[], []]
    for first in (1, -1):
        for second in (1, -1):
            # Beyond a border α3, or α4, is wrapped by π; each wrap turns the sign of R.
            for k, margin in enumerate((OPEN_MARGIN, 0.0)):
                cell = _cell(border, first * side, second * side, margin)
                parts[k].append(cell.intersection(kept[first * second][k]))
    condition = determinant_condition(sign, least, "blue", coefficients)
    return region_between(union_of(parts[0]), union_of(parts[1]), accuracy, condition)


def determinant_falls_below(least: float, sign: int, shape: BaseGeometry, exact: Coefficients) -> bool:
    """Return whether |R| may be below a value in polygons on which R has one sign.

    |R| is least on a border. Proof: but for a factor R is the product of P = cos β1·cos β2 and D, with ΔP = −2P and
    ΔD = −2D. Where the gradient of R vanishes, ∇D = −D·∇P/P, so that ΔR = −4R − 2R·|∇P|²/P² has the sign of −R: |R|
    has no least value inside.
    """
    if shape.is_empty:
        return False
    rings = shapely.get_rings(shapely.get_parts(polygons_of(shape)))
    corners, ring = shapely.get_coordinates(rings, return_index=True)
    follows = ring[1:] == ring[:-1]
    ends = corners[:, [0, 1, 0, 1]]
    found = least_level_determinant(ends[:-1][follows], ends[1:][follows], exact, sign=sign, tolerance=0.0, floor=least)
    return bool(found.lower.min() < least)


def determinant_condition(sign: int, least: float, color: Color, coefficients: Coefficients) -> Condition:
    """Return the condition that R has a sign and at least a size on a sheet."""
    wanted = f"R {'≥' if sign > 0 else '≤'} {sign * least:.2g}" if least > 0 else f"R {'>' if sign > 0 else '<'} 0"

    def broken_at(alpha1: float, alpha2: float) -> str | None:
        third, fourth = sheet_angles(color, alpha1, alpha2, coefficients)
        value = float(level_determinant([alpha1, alpha2, float(third), float(fourth)], coefficients))
        if sign * value >= least and value != 0:
            return None
        return f"R = {value:.4g} at level attitude, wanted is {wanted}"

    return Condition(name=wanted, broken_at=broken_at)


def certain_determinant(coefficients: Coefficients) -> float:
    """Return an |R| of the exact coefficients whose sign is certain with the given ones, everywhere on the red sheet.

    It covers the difference between the given coefficients and the exact ones, and more than
    :func:`gaitgraph.invertibility.matrices.level_determinant_resolution` can be on the red sheet, where the pair
    features (cos² α, sin² α, sin 2α) have at most the length √(3/2) and the slope 1.

    >>> round(certain_determinant(coefficients_of()), 4)
    0.0035
    """
    form = coefficients.bilinear_form
    size = float(np.linalg.norm(form))
    _, single, double, triple = coefficients.rounding
    # Each rounded number is off by no more than its rounding, and R with it.
    parts = 2 * single + double + 2 * triple
    derived = coefficients.sheet_rounding
    turned = 2 * math.sqrt(1.5) * size * derived + 8 * size * derived**2
    return 2 * parts + turned + 41 * _EPSILON * float(np.abs(form).sum())


def checked_sign(sign: object) -> int:
    """Return 1 or −1 for the name of a sign; raise InputError for what is none."""
    if not isinstance(sign, str) or sign not in SIGNS:
        raise InputError(f"sign must be 'positive' or 'negative', got {shown(sign)}")
    return 1 if sign == "positive" else -1
