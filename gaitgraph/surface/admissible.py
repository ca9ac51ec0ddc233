"""Where a gait may be: each condition on the red sheet as a region, and all of them in one."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, Literal

import numpy as np

from gaitgraph.angles import HALF_PI
from gaitgraph.errors import InputError, shown
from gaitgraph.invertibility.matrices import (
    Coefficients,
    coefficients_of,
    hover_thrust_shares,
    least_singular_value_on_red,
    noise_of,
)
from gaitgraph.surface.components import (
    certain_determinant,
    checked_sign,
    determinant_condition,
    determinant_falls_below,
    sign_region,
)
from gaitgraph.surface.outlines import mirrored, thrust_above, weak_block
from gaitgraph.surface.region import (
    DEFAULT_ACCURACY,
    OPEN_MARGIN,
    TOUCH,
    Condition,
    Region,
    Zones,
    centered_square,
    checked_accuracy,
    checked_number,
    chord_tolerance,
    offset,
    rectangle,
    region_between,
    square_without,
    union_of,
    zones_region,
)
from gaitgraph.surface.sheets import COLORS, Color, Sign, red_label
from gaitgraph.vehicle import PAPER, Vehicle

if TYPE_CHECKING:
    from shapely import Polygon
    from shapely.geometry.base import BaseGeometry

Use = Literal["valid", "flyable"]

_SEPARATING = 1e-6  # a floor that keeps polygons off R = 0 beyond rounding
# Nearer to a limit than this the checks of a gait cannot decide along segments, and count it as beyond the limit.
_DECIDED = 1.5e-6  # singular values; see invertibility.segment_bounds
_DECIDED_THRUST = 1.5e-4  # shares of the weight; see invertibility.segment_bounds


def hover_region(vehicle: Vehicle = PAPER) -> Region:
    """Return where all hover thrusts are positive on the red sheet: two rectangles that meet at (δ, −δ).

    α1 < δ and α2 > −δ, or α1 > δ and α2 < −δ. The borders, where a pair of rotors idles, are excluded.

    >>> round(hover_region().outer.area, 3)
    4.991
    """
    delta = math.atan(vehicle.signed_drag_ratio)

    def rectangles(margin: float) -> BaseGeometry:
        first = rectangle(-HALF_PI, margin - delta, delta - margin, HALF_PI)
        return union_of([first, rectangle(delta + margin, -HALF_PI, HALF_PI, -delta - margin)])

    def broken_at(alpha1: float, alpha2: float) -> str | None:
        shares = hover_thrust_shares([alpha1, alpha2, alpha1, alpha2], vehicle)
        if shares.min() > 0:
            return None
        values = f"{float(shares[0]):.3g} and {float(shares[1]):.3g} of m·g"
        return f"hover thrusts of {values} (rotors 1 and 3, 2 and 4), wanted is > 0"

    condition = Condition(name="hover thrusts > 0", broken_at=broken_at)
    return region_between(rectangles(OPEN_MARGIN), rectangles(0.0), OPEN_MARGIN, condition)


def thrust_region(share: float, vehicle: Vehicle = PAPER, *, accuracy: float = DEFAULT_ACCURACY) -> Region:
    """Return where hover needs of no rotor more than a share of the weight, all hover thrusts being positive.

    Parameters
    ----------
    share
        The largest thrust of one rotor in units of m·g; 0.25 at α = 0, below that the region is small or empty.
    vehicle, accuracy
        As for :func:`gaitgraph.surface.components.sign_region`.

    Examples
    --------
    >>> [round(thrust_region(share).area, 3) for share in (0.3, 0.6, 3.0)]
    [0.169, 4.107, 4.962]
    """
    share, accuracy = checked_number("share", share, "a positive finite number (of m·g)"), checked_accuracy(accuracy)

    def broken_at(alpha1: float, alpha2: float) -> str | None:
        peak = float(np.max(hover_thrust_shares([alpha1, alpha2, alpha1, alpha2], vehicle)))
        return None if peak <= share else f"largest hover thrust {peak:.3g} of m·g, wanted is ≤ {share:.3g}"

    limit = Condition(name=f"hover thrusts ≤ {share:.3g} of m·g", broken_at=broken_at)
    inner, outer = _thrust_polygons(share, vehicle.signed_drag_ratio, accuracy)
    hover = hover_region(vehicle)
    return region_between(
        inner.intersection(hover.inner), outer.intersection(hover.outer), accuracy, *hover.conditions, limit
    )


@lru_cache(maxsize=32)
def _thrust_polygons(share: float, kappa: float, accuracy: float) -> tuple[BaseGeometry, BaseGeometry]:
    return square_without(thrust_above(share, kappa, chord_tolerance(accuracy)), accuracy / 2)


def singular_value_region(floor: float, vehicle: Vehicle = PAPER, *, accuracy: float = DEFAULT_ACCURACY) -> Region:
    """Return where the least singular value of the scaled decoupling matrix, level, is at least a floor on red.

    Two of the singular values bound straight strips; the border of the third is explicit in u = α1 − α2.

    Parameters
    ----------
    floor
        The floor, dimensionless; above 2·√((1+κ²)/3) nothing reaches it.
    vehicle, accuracy
        As for :func:`gaitgraph.surface.components.sign_region`.

    Examples
    --------
    >>> [round(singular_value_region(floor).area, 3) for floor in (0.05, 0.5, 1.1, 1.2)]
    [9.138, 3.766, 0.061, 0.0]
    """
    floor, accuracy = checked_number("floor", floor, "a finite number ≥ 0", zero=True), checked_accuracy(accuracy)
    return _two_floor_region(floor, floor, vehicle, accuracy)


def _two_floor_region(floor: float, block: float, vehicle: Vehicle, accuracy: float) -> Region:
    """Return where the least singular value is at least `floor`, with `inner` keeping more.

    There the third singular value is at least `block`, which is not below `floor`; both are taken as checked.
    """
    kappa = vehicle.signed_drag_ratio

    def broken_at(alpha1: float, alpha2: float) -> str | None:
        value = float(least_singular_value_on_red(alpha1, alpha2, vehicle))
        return None if value >= floor else f"least singular value {value:.3g}, wanted is ≥ {floor:.3g}"

    inner = _singular_value_polygon(floor, block, kappa, accuracy, inside=True)
    outer = _singular_value_polygon(floor, floor, kappa, accuracy, inside=False)
    condition = Condition(name=f"least singular value ≥ {floor:.3g}", broken_at=broken_at)
    return region_between(inner, outer, accuracy, condition)


@lru_cache(maxsize=64)
def _singular_value_polygon(floor: float, block: float, kappa: float, accuracy: float, *, inside: bool) -> BaseGeometry:
    delta = math.atan(kappa)
    alone = floor * math.cos(delta) / math.sqrt(2.0)
    if alone > 1:
        return rectangle(0, 0, 0, 0)
    # Two singular values keep the floor where |cos β1| and |cos β2| are at least cos(reach).
    reach = math.acos(alone) - (TOUCH if floor and inside else 0.0)
    centers = (delta - math.pi, delta, delta + math.pi)
    strips = union_of(rectangle(max(c - reach, -HALF_PI), -HALF_PI, min(c + reach, HALF_PI), HALF_PI) for c in centers)
    strips = strips.intersection(mirrored(strips))
    if floor >= accuracy / 2:
        band = weak_block(block, kappa, min(chord_tolerance(accuracy), block / 16))
        return strips.difference(offset(band, accuracy / 2 if inside else -accuracy / 2))
    if floor == 0 or not inside:
        return strips
    # The band around R = 0 is narrower than what its polygons may be off by: a wider one, and none, enclose it.
    return strips.difference(offset(weak_block(accuracy / 2, kappa, accuracy / 32), accuracy / 16))


def tilt_region(limit: float) -> Region:
    """Return where no arm tilts beyond a limit [rad], on the red sheet.

    >>> tilt_region(0.5).inner.bounds
    (-0.5, -0.5, 0.5, 0.5)
    """
    limit = checked_number("limit", limit, "a positive finite number (rad)")
    within = min(limit, HALF_PI)

    def broken_at(alpha1: float, alpha2: float) -> str | None:
        tilt = max(abs(alpha1), abs(alpha2))
        return None if tilt <= within else f"tilt {tilt:.4f} rad, wanted is ≤ {within:.4f}"

    square = centered_square(within)
    return region_between(square, square, 0.0, Condition(name=f"tilt ≤ {limit:.4g} rad", broken_at=broken_at))


def admissible_region(
    vehicle: Vehicle = PAPER,
    *,
    use: Use = "flyable",
    color: Color = "red",
    sign: Sign | None = None,
    coefficients: Coefficients | None = None,
    floor: float = 0.05,
    zones: Zones | None = None,
    least: float | None = None,
    accuracy: float = DEFAULT_ACCURACY,
) -> Region:
    """Return where a gait may be, an empty region if nowhere.

    Parameters
    ----------
    vehicle
        The vehicle; `max_tilt` and `max_thrust` count where they are stated.
    use
        "valid": R has the sign. "flyable": also the least singular value keeps the floor, all hover thrusts are
        positive and within the limit, and so are the tilts. Nothing on blue is flyable. `inner`
        keeps the floor by 1.5e-6 and the limit of thrust by 1.5e-4 of m·g, so that the checks of a gait can decide
        along its segments.
    color, sign
        The sheet, and the sign of R, None for either; no component holds both.
    coefficients
        The coefficients with which R is judged; by default those of :func:`coefficients_of`.
    floor, zones
        The floor of the least singular value, and the user's own polygons.
    least
        The least |R|; by default on red :func:`certain_determinant`, so that the sign means something with the given
        coefficients too, and on blue :func:`gaitgraph.invertibility.matrices.noise_of`.
    accuracy
        How far curved borders may be from where they are [rad], 1e-9 to 0.1.

    Raises
    ------
    InputError
        If a value is not allowed; MissingConstant if a thrust limit is stated without the mass.

    Examples
    --------
    >>> round(admissible_region().area, 3), round(admissible_region(use="valid").area, 3)
    (4.748, 9.81)
    """
    if use not in ("valid", "flyable"):
        raise InputError(f"use must be 'valid' or 'flyable', got {shown(use)}")
    if color not in COLORS:
        raise InputError(f"color must be 'red' or 'blue', got {shown(color)}")
    if sign is not None:
        checked_sign(sign)
    coefficients = coefficients or coefficients_of(vehicle)
    if least is None:
        least = certain_determinant(coefficients) if color == "red" else noise_of(coefficients)
    least = checked_number("least", least, "a finite number ≥ 0", zero=True)
    floor, accuracy = checked_number("floor", floor, "a finite number ≥ 0", zero=True), checked_accuracy(accuracy)
    region = _admissible(vehicle, use, color, sign, coefficients, floor, least, accuracy)
    return region if zones is None else region & zones_region(zones)


@lru_cache(maxsize=32)
def _admissible(
    vehicle: Vehicle,
    use: Use,
    color: Color,
    sign: Sign | None,
    coefficients: Coefficients,
    floor: float,
    least: float,
    accuracy: float,
) -> Region:
    signs: tuple[Sign, ...] = ("positive", "negative") if sign is None else (sign,)

    def signed(one: Sign) -> Region:
        return sign_region(one, vehicle, color=color, coefficients=coefficients, least=least, accuracy=accuracy)

    if use == "valid":
        return _either([signed(one) for one in signs])
    if color == "blue":
        nothing = rectangle(0, 0, 0, 0)
        reason = "on blue the decoupling matrix is singular in exact physics: use red"
        condition = Condition(name="an invertible decoupling matrix", broken_at=lambda _first, _second: reason)
        return region_between(nothing, nothing, accuracy, condition)
    region = _two_floor_region(floor, floor + _DECIDED if floor > 0 else 0.0, vehicle, accuracy)
    if vehicle.max_thrust is None:
        region &= hover_region(vehicle)
    else:
        mass, gravity = vehicle.require("mass", "gravity", purpose="the region within the largest thrust")
        share = vehicle.max_thrust / (mass * gravity)
        within = thrust_region(share, vehicle, accuracy=accuracy)
        kept = thrust_region(max(share - _DECIDED_THRUST, share / 2), vehicle, accuracy=accuracy)
        region &= region_between(kept.inner, within.outer, accuracy, *within.conditions)
    if vehicle.max_tilt is not None:
        region &= tilt_region(vehicle.max_tilt)
    if floor < _SEPARATING:
        return _either([signed(one) for one in signs]) & region

    # The floor keeps each polygon off R = 0, so R has one sign on it: take those with one of the signs, and cut off
    # where |R| is less than asked for.
    exact = coefficients_of(vehicle, "exact")
    inner: BaseGeometry = rectangle(0, 0, 0, 0)
    outer: BaseGeometry = rectangle(0, 0, 0, 0)
    conditions = []
    for one in signs:
        wanted = checked_sign(one)
        conditions.append(determinant_condition(wanted, least, "red", exact))
        inside, around = (
            union_of(part for part in side.geoms if _sign_on(part, vehicle) == wanted)
            for side in (region.inner, region.outer)
        )
        if least > 0 and determinant_falls_below(least, wanted, inside, exact):
            cut = signed(one)
            inside, around = inside.intersection(cut.inner), around.intersection(cut.outer)
        inner, outer = inner.union(inside), outer.union(around)
    return region_between(inner, outer, region.accuracy, _any_of(conditions), *region.conditions)


def _sign_on(part: Polygon, vehicle: Vehicle) -> int:
    """Return the sign of R on a polygon where it has one."""
    point = part.representative_point()
    return int(red_label(point.x, point.y, vehicle).prod())


def _either(regions: list[Region]) -> Region:
    """Return the union of regions of one condition each."""
    inner, outer = union_of(part.inner for part in regions), union_of(part.outer for part in regions)
    return region_between(inner, outer, regions[0].accuracy, _any_of([part.conditions[0] for part in regions]))


def _any_of(conditions: list[Condition]) -> Condition:
    """Return the condition that one of two holds, or the only one there is."""
    if len(conditions) == 1:
        return conditions[0]
    name = " or ".join(condition.name for condition in conditions)

    def broken_at(alpha1: float, alpha2: float) -> str | None:
        reasons = [condition.broken_at(alpha1, alpha2) for condition in conditions]
        return None if None in reasons else f"{(reasons[0] or '').split(',')[0]}, wanted is {name}"

    return Condition(name=name, broken_at=broken_at)


def why_empty(region: Region, floor: float, vehicle: Vehicle) -> str:
    """Return why a flyable region without any point has none.

    >>> why_empty(admissible_region(floor=1.5), 1.5, PAPER)
    "nothing has a least singular value of 1.5: this vehicle's most is 1.1710; lower the floor"
    """
    cap = 2 * math.sqrt((1 + vehicle.drag_ratio**2) / 3)
    if floor > cap:
        return f"nothing has a least singular value of {floor:g}: this vehicle's most is {cap:.4f}; lower the floor"
    names = ", ".join(dict.fromkeys(condition.name for condition in region.conditions))
    return f"no tilt angles meet all of: {names}: lower the floor, widen the limits or the polygons"
