"""Where a single condition holds on the red sheet: on thrusts, singular values or tilts, or of the user's polygons."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from gaitgraph.angles import HALF_PI
from gaitgraph.invertibility.matrices import hover_thrust_shares, least_singular_value_on_red
from gaitgraph.surface.outlines import mirrored, thrust_above, weak_block
from gaitgraph.surface.region import (
    DEFAULT_ACCURACY,
    OPEN_MARGIN,
    TOUCH,
    Condition,
    Region,
    centered_square,
    checked_accuracy,
    checked_number,
    chord_tolerance,
    domain_without,
    offset,
    polygons_of,
    rectangle,
    region_between,
    union_of,
)
from gaitgraph.vehicle import PAPER, Vehicle

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

    from gaitgraph.surface.components import Zones

__all__ = [
    "hover_region",
    "singular_value_region",
    "thrust_region",
    "tilt_region",
    "two_floor_region",
    "zones_region",
]


def hover_region(vehicle: Vehicle = PAPER) -> Region:
    """Return where all hover thrusts are positive on the red sheet: two rectangles that meet at (δ, −δ).

    α1 < δ and α2 > −δ, or α1 > δ and α2 < −δ. The borders, where a pair of rotors idles, are excluded.

    >>> round(hover_region().outer.area, 3)
    4.991
    """
    inner, outer = (_hover_rectangles(vehicle, margin) for margin in (OPEN_MARGIN, 0.0))
    return region_between(_hover_condition(vehicle), inner, outer, OPEN_MARGIN)


def _hover_rectangles(vehicle: Vehicle, margin: float) -> BaseGeometry:
    delta = math.atan(vehicle.signed_drag_ratio)
    first = rectangle(-HALF_PI, margin - delta, delta - margin, HALF_PI)
    return union_of([first, rectangle(delta + margin, -HALF_PI, HALF_PI, -delta - margin)])


def _hover_condition(vehicle: Vehicle) -> Condition:
    def broken_at(alpha1: float, alpha2: float) -> str | None:
        shares = hover_thrust_shares([alpha1, alpha2, alpha1, alpha2], vehicle)
        if shares.min() > 0:
            return None
        values = f"{float(shares[0]):.3g} and {float(shares[1]):.3g} of m·g"
        return f"hover thrusts of {values} (rotors 1 and 3, 2 and 4), wanted is > 0"

    return Condition(name="hover thrusts > 0", broken_at=broken_at)


def thrust_region(share: float, vehicle: Vehicle = PAPER, *, accuracy: float = DEFAULT_ACCURACY) -> Region:
    """Return where hover needs of no rotor more than a share of the weight, all hover thrusts being positive.

    Parameters
    ----------
    share
        The largest thrust of one rotor in units of m·g; 0.25 at α = 0, below that the region is small or empty.
    vehicle
        All that counts is κ and the spin sense.
    accuracy
        How far curved borders may be from where they are [rad], 1e-9 to 0.1.

    Examples
    --------
    >>> [round(thrust_region(share).area, 3) for share in (0.3, 0.6, 3.0)]
    [0.169, 4.107, 4.962]
    """
    share, accuracy = checked_number("share", share, "a positive finite number (of m·g)"), checked_accuracy(accuracy)
    inner, outer = _thrust_polygons(share, vehicle.signed_drag_ratio, accuracy)

    def broken_at(alpha1: float, alpha2: float) -> str | None:
        peak = float(np.max(hover_thrust_shares([alpha1, alpha2, alpha1, alpha2], vehicle)))
        return None if peak <= share else f"largest hover thrust {peak:.3g} of m·g, wanted is ≤ {share:.3g}"

    limit = Condition(name=f"hover thrusts ≤ {share:.3g} of m·g", broken_at=broken_at)
    hover = hover_region(vehicle)
    return Region(
        inner=polygons_of(inner.intersection(hover.inner)),
        outer=polygons_of(outer.intersection(hover.outer)),
        accuracy=accuracy,
        conditions=(*hover.conditions, limit),
    )


@lru_cache(maxsize=32)
def _thrust_polygons(share: float, kappa: float, accuracy: float) -> tuple[BaseGeometry, BaseGeometry]:
    return domain_without(thrust_above(share, kappa, chord_tolerance(accuracy)), centered_square(), accuracy / 2)


def singular_value_region(floor: float, vehicle: Vehicle = PAPER, *, accuracy: float = DEFAULT_ACCURACY) -> Region:
    """Return where the least singular value of the scaled decoupling matrix, level, is at least a floor on red.

    Two of the singular values bound straight strips; the border of the third is explicit in u = α1 − α2.

    Parameters
    ----------
    floor
        The floor, dimensionless; above 2·√((1+κ²)/3) nothing reaches it.
    vehicle
        All that counts is κ and the spin sense.
    accuracy
        How far curved borders may be from where they are [rad], 1e-9 to 0.1.

    Examples
    --------
    >>> [round(singular_value_region(floor).area, 3) for floor in (0.05, 0.5, 1.1, 1.2)]
    [9.138, 3.766, 0.061, 0.0]
    """
    floor, accuracy = checked_number("floor", floor, "a finite number ≥ 0", zero=True), checked_accuracy(accuracy)
    return two_floor_region(floor, floor, vehicle, accuracy)


def two_floor_region(floor: float, block: float, vehicle: Vehicle, accuracy: float) -> Region:
    """Return where the least singular value is at least `floor`, with `inner` keeping more.

    There the third singular value is at least `block`, which is not below `floor`; both are taken as checked.
    """
    kappa = vehicle.signed_drag_ratio
    inner = _singular_value_polygon(floor, block, kappa, accuracy, inside=True)
    outer = _singular_value_polygon(floor, floor, kappa, accuracy, inside=False)

    def broken_at(alpha1: float, alpha2: float) -> str | None:
        value = float(least_singular_value_on_red(alpha1, alpha2, vehicle))
        return None if value >= floor else f"least singular value {value:.3g}, wanted is ≥ {floor:.3g}"

    condition = Condition(name=f"least singular value ≥ {floor:.3g}", broken_at=broken_at)
    return region_between(condition, inner, outer, accuracy)


@lru_cache(maxsize=64)
def _singular_value_polygon(floor: float, block: float, kappa: float, accuracy: float, *, inside: bool) -> BaseGeometry:
    delta = math.atan(kappa)
    alone = floor * math.cos(delta) / math.sqrt(2.0)
    if alone > 1:
        return rectangle(0, 0, 0, 0)
    strips = _strips(delta, math.acos(alone) - (TOUCH if floor and inside else 0.0))
    if floor >= accuracy / 2:
        band = weak_block(block, kappa, min(chord_tolerance(accuracy), block / 16))
        return strips.difference(offset(band, accuracy / 2 if inside else -accuracy / 2))
    if floor == 0 or not inside:
        return strips
    # The band around R = 0 is narrower than what its polygons may be off by: a wider one, and none, enclose it.
    return strips.difference(offset(weak_block(accuracy / 2, kappa, accuracy / 32), accuracy / 16))


def _strips(delta: float, reach: float) -> BaseGeometry:
    """Return where |cos β1| and |cos β2| are at least cos(reach)."""
    centers = (delta - math.pi, delta, delta + math.pi)
    found = union_of(rectangle(max(c - reach, -HALF_PI), -HALF_PI, min(c + reach, HALF_PI), HALF_PI) for c in centers)
    return found.intersection(mirrored(found))


def tilt_region(limit: float) -> Region:
    """Return where no arm tilts beyond a limit [rad], on the red sheet.

    >>> tilt_region(0.5).inner.bounds
    (-0.5, -0.5, 0.5, 0.5)
    """
    limit = checked_number("limit", limit, "a positive finite number (rad)")

    def broken_at(alpha1: float, alpha2: float) -> str | None:
        tilt = max(abs(alpha1), abs(alpha2))
        return None if tilt <= min(limit, HALF_PI) else f"tilt {tilt:.4f} rad, wanted is ≤ {min(limit, HALF_PI):.4f}"

    square = centered_square(min(limit, HALF_PI))
    return region_between(Condition(name=f"tilt ≤ {limit:.4g} rad", broken_at=broken_at), square, square, 0.0)


def zones_region(zones: Zones) -> Region:
    """Return where the user's polygons allow to be: outside every keep-out and in the union of the keep-ins.

    Borders are exact, and allowed. A passage without width, between keep-outs that touch, is not in the region.

    >>> from gaitgraph.surface.components import Zones
    >>> region = zones_region(Zones(keep_out=[[(0, 0), (1, 0), (1, 1), (0, 1)]]))
    >>> region.contains([[0.5, 0.5], [1.0, 0.5]]).tolist(), region.why_not((0.5, 0.5))
    ([False, True], 'inside keep_out polygon 1')
    """
    import shapely

    keep_in, keep_out = ([shapely.Polygon(corners) for corners in side] for side in (zones.keep_in, zones.keep_out))
    allowed: BaseGeometry = centered_square()
    if keep_in:
        allowed = allowed.intersection(shapely.union_all(keep_in))
    if keep_out:
        allowed = allowed.difference(shapely.union_all(keep_out))

    def broken_at(alpha1: float, alpha2: float) -> str | None:
        point = shapely.Point(alpha1, alpha2)
        inside = [str(k) for k, polygon in enumerate(keep_out, start=1) if polygon.contains_properly(point)]
        told = [f"inside keep_out polygon {', '.join(inside)}"] if inside else []
        if keep_in and not any(polygon.covers(point) for polygon in keep_in):
            told.append("outside the keep_in polygons")
        return " and ".join(told) or None

    condition = Condition(name="the keep_out and keep_in polygons", broken_at=broken_at)
    return region_between(condition, allowed, allowed, 0.0)
