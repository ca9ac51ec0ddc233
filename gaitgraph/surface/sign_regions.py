"""Where R has a sign on a sheet.

The sign of R on a grid cannot separate the components of R ≠ 0: it joins them across the saddles, where two factors
of R (:func:`gaitgraph.surface.red_components.red_label`) vanish.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache, partial
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely

from gaitgraph.angles import HALF_PI, checked_number
from gaitgraph.errors import checked_choice
from gaitgraph.invertibility import matrices
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.invertibility.forms import Form, rotors_of
from gaitgraph.surface.blocks import Block, roll_block, yaw_block
from gaitgraph.surface.borders import Border, Waves, cut, negative_pair
from gaitgraph.surface.red_components import red_label
from gaitgraph.surface.region import (
    DEFAULT_ACCURACY,
    NOWHERE,
    OPEN_MARGIN,
    SQUARE,
    WHOLE,
    Condition,
    Pair,
    Region,
    checked_accuracy,
    quarters,
    region_of,
    union_of,
)
from gaitgraph.surface.sheets import COLORS, RAISED, SIGNS, Color, Sign, sheet_angles
from gaitgraph.vehicle import PAPER, Vehicle, VehicleLike, vehicle_named

if TYPE_CHECKING:
    from shapely import MultiPolygon
    from shapely.geometry.base import BaseGeometry

    from gaitgraph.invertibility.coefficients import Coefficients, CoefficientsLike
    from gaitgraph.invertibility.forms import FloatArray


def sign_region(
    sign: Sign,
    vehicle: VehicleLike = PAPER,
    *,
    color: Color = "red",
    coefficients: CoefficientsLike | None = None,
    least: float | None = None,
    accuracy: float = DEFAULT_ACCURACY,
) -> Region:
    """Return where R has a sign on a sheet, and |R| is at least `least`.

    On red R is exact, and `least` is 0 by default, which means R ≠ 0. On blue R is what rounded coefficients leave,
    zero with exact ones; by default `least` is what floating point can tell from 0. The region on blue is cut where α3
    or α4 wraps by π, and empty with a rotor height, for which blue is no gait surface. Curved borders are at most
    `accuracy` from their true place [rad], 1e-9 to 0.1.

    >>> round(sign_region("positive").area, 2), round(sign_region("negative").area, 2)
    (4.52, 5.35)
    >>> sign_region("negative", color="blue", coefficients="exact").area
    0.0
    """
    checked_choice("sign", sign, SIGNS)
    (wanted,), accuracy = checked_signs(color, sign), checked_accuracy(accuracy)
    vehicle = vehicle_named(vehicle)
    least = 0.0 if least is None else checked_number("least", least)
    judged = coefficients_of(vehicle, "exact" if color == "red" else coefficients)
    if color not in judged.colors:
        return none_on_blue(vehicle, accuracy)
    if color == "blue":
        least = least or matrices.noise_of(judged)
        pair = _blue_sign(wanted, least, judged, accuracy)
    elif least:
        pair = _determinant_above(wanted, least, vehicle, accuracy)
    else:
        pair = red_sign(wanted, vehicle, accuracy)
    return region_of(
        pair, accuracy, determinant_condition([wanted], least, color, judged)
    )


def red_sign(sign: int, vehicle: Vehicle, accuracy: float) -> Pair:
    """Return where R has a sign on red: where the determinants of both blocks have the same sign, or opposite ones."""
    turned = sign if vehicle.signed_drag_ratio > 0 else -sign
    yaw, roll = (
        _determinant_sides(block(rotors_of(vehicle)), accuracy)
        for block in (yaw_block, roll_block)
    )
    return union_of([shapely.intersection(yaw[k], roll[k * turned]) for k in (1, -1)])


def _determinant_sides(block: Block, accuracy: float) -> dict[int, Pair]:
    """Return where the determinant of a block is positive, and where it is negative."""
    border = Border(Waves.of(block.determinant))
    negative = negative_pair(border, accuracy, margin=OPEN_MARGIN)
    above = shapely.difference(SQUARE, negative[::-1])
    return {1: above, -1: shapely.intersection(SQUARE, negative)}


@lru_cache(maxsize=32)
def _determinant_above(
    sign: int, least: float, vehicle: Vehicle, accuracy: float
) -> Pair:
    """Return where R has a sign on red, and |R| is at least a positive value."""
    exact = coefficients_of(vehicle, "exact")

    def excess(alpha1: FloatArray, alpha2: FloatArray) -> Any:
        R = matrices.level_determinant(on_red(alpha1, alpha2), exact)
        return sign * R - least

    return cut(WHOLE, Border(Waves.of(excess)), accuracy)


def _blue_sign(
    sign: int, least: float, coefficients: Coefficients, accuracy: float
) -> Pair:
    """Return where R has a sign on blue, and |R| is at least a value; its sign turns where α3 or α4 is wrapped by π.

    Nothing is wrapped in the sums: there α3 = 2δ − α1 and α4 = −2δ − α2.
    """
    lines = np.array(coefficients.crossings)
    wraps = 2 * lines - np.copysign(HALF_PI, lines)
    parts = []
    for turned in (1, -1):

        def excess(alpha1: FloatArray, alpha2: FloatArray, turned: int = turned) -> Any:
            plane = np.column_stack([alpha1, alpha2])
            points = np.hstack([plane, 2 * lines - plane])
            R = matrices.level_determinant(points, coefficients)
            return turned * sign * R - least

        above = cut(WHOLE, Border(Waves.of(excess)), accuracy)
        unwrapped = union_of(quarters(wraps[0], wraps[1], -turned, OPEN_MARGIN))
        parts.append(shapely.intersection(unwrapped, above))
    return union_of(parts)


def none_on_blue(vehicle: Vehicle, accuracy: float) -> Region:
    """Return the empty region, with the reason why no gait on blue can be robust or flyable."""
    name = "an invertible decoupling matrix"
    reason = "on blue the decoupling matrix is singular in exact physics: use red"
    if vehicle.has_raised_rotors:
        name = "a vertical zero-moment direction"
        reason = f"blue is no gait surface {RAISED} {vehicle.heights_in_words}"
    return region_of(
        NOWHERE,
        accuracy,
        Condition(name=name, broken_at=partial(_everywhere, reason)),
    )


def _everywhere(reason: str, _alpha1: float, _alpha2: float) -> str:
    return reason


def checked_signs(color: object, sign: object) -> list[int]:
    """Return a sign as +1 or −1, or both for None; raise InputError for another sign or an unknown color."""
    checked_choice("color", color, COLORS)
    if sign is not None:
        checked_choice("sign", sign, SIGNS)
    return [
        number
        for name, number in (("positive", 1), ("negative", -1))
        if sign in (None, name)
    ]


def determinant_condition(
    signs: list[int], least: float, color: Color, coefficients: Coefficients
) -> Condition:
    """Return the condition that R on a sheet has one of some signs, and |R| is at least `least`."""
    symbols = {1: "≥", -1: "≤"} if least > 0 else {1: ">", -1: "<"}
    limits = [
        f"{symbols[sign]} {sign * least if least > 0 else 0:.2g}" for sign in signs
    ]
    return Condition(
        name=" or ".join(f"R {limit}" for limit in limits),
        broken_at=partial(
            _other_determinant, signs, least, color, coefficients, " or ".join(limits)
        ),
    )


def _other_determinant(
    signs: list[int],
    least: float,
    color: Color,
    coefficients: Coefficients,
    wanted: str,
    alpha1: float,
    alpha2: float,
) -> str | None:
    third, fourth = sheet_angles(color, alpha1, alpha2, coefficients)
    value = float(
        matrices.level_determinant(
            [alpha1, alpha2, float(third), float(fourth)], coefficients
        )
    )
    if value != 0 and any(sign * value >= least for sign in signs):
        return None
    return f"R at level attitude must be {wanted}, got {value:.4g}"


def certain_determinant(coefficients: Coefficients) -> float:
    """Return an |R| of the exact coefficients whose sign is certain with the given ones, everywhere on the red sheet.

    It covers their difference and the errors of the given ones.
    """
    exact = replace(coefficients, kind="exact")
    apart = Form(coefficients.form.table - exact.form.table).size[2]
    return float(apart + coefficients.largest_errors[2])


def parts_of_sign(sign: int, shape: MultiPolygon, vehicle: Vehicle) -> BaseGeometry:
    """Return the polygons of a shape in whose inside R has a sign on red."""
    parts = np.array(shape.geoms)
    points = shapely.point_on_surface(parts)
    labels = red_label(shapely.get_x(points), shapely.get_y(points), vehicle)
    return shapely.union_all(parts[labels.prod(axis=-1) == sign])


def on_red(alpha1: FloatArray, alpha2: FloatArray) -> FloatArray:
    """Return the points of red above (α1, α2), shape (k, 4) [rad]."""
    return np.column_stack([alpha1, alpha2, alpha1, alpha2])
