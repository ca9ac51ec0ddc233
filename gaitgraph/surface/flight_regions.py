"""Where each condition of level flight holds on the red sheet: hover thrusts, least singular value, tilts.

Hover thrusts are positive in two rectangles, the quarters of the square in which both pairs of rotors have yaw torques
of one sign. A gait that can fly stays in one of them.
"""

from __future__ import annotations

import math
from functools import lru_cache, partial
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
import shapely

from gaitgraph.angles import HALF_PI, checked_floor, checked_number
from gaitgraph.invertibility import matrices
from gaitgraph.invertibility.forms import level_of, rotors_of
from gaitgraph.surface.blocks import directions, roll_block, yaw_block
from gaitgraph.surface.borders import Border, Waves, cut, negative_pair
from gaitgraph.surface.region import (
    DEFAULT_ACCURACY,
    NOWHERE,
    OPEN_MARGIN,
    SQUARE,
    Condition,
    Pair,
    Region,
    checked_accuracy,
    limit_condition,
    quarters,
    rectangle,
    region_of,
    union_of,
)
from gaitgraph.vehicle import PAPER, Vehicle, VehicleLike, vehicle_named

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt
    from shapely.geometry.base import BaseGeometry

    from gaitgraph.invertibility.forms import FloatArray, Rotors

Quarter = Literal["left", "right"]
QUARTERS: tuple[Quarter, ...] = get_args(Quarter)

_NARROWEST = 1e-6  # a band that rounding leaves two borders


def hover_region(vehicle: VehicleLike = PAPER) -> Region:
    """Return where all hover thrusts are positive on the red sheet: the yaw torques of the two pairs have one sign.

    These are two rectangles, for the paper's vehicle α1 < δ and α2 > −δ, and α1 > δ and α2 < −δ. Their borders, where a
    pair of rotors idles, are excluded.

    >>> round(hover_region().outer.area, 3)
    4.991
    """
    body = vehicle_named(vehicle)
    pair = union_of([*hover_quarters(body, OPEN_MARGIN).values()])
    return region_of(pair, OPEN_MARGIN, hovering(body))


def hover_quarters(vehicle: Vehicle, kept: float) -> dict[Quarter, Pair]:
    """Return the two rectangles where all hover thrusts are positive; `inner` keeps a margin from the lines [rad]."""
    left, right = quarters(*level_of(rotors_of(vehicle)).crossings, -1, kept)
    return {"left": left, "right": right}


def hover_quarter_of(points: npt.ArrayLike, vehicle: Vehicle) -> Quarter | None:
    """Return in which of the two rectangles of positive hover thrusts all points lie, shape (m, 2), if in one."""
    plane = shapely.points(np.asarray(points, dtype=float))
    for quarter, (inside, _) in hover_quarters(vehicle, OPEN_MARGIN).items():
        if shapely.covers(inside, plane).all():
            return quarter
    return None


def hovering(vehicle: Vehicle) -> Condition:
    """Return the condition that all hover thrusts are positive."""
    return Condition(name="hover thrusts > 0", broken_at=partial(_pulling, vehicle))


def _pulling(vehicle: Vehicle, alpha1: float, alpha2: float) -> str | None:
    shares = matrices.hover_thrust_shares([alpha1, alpha2, alpha1, alpha2], vehicle)
    if shares.min() > 0:
        return None
    return f"hover thrusts must be > 0, got {shares[0]:.3g} (rotors 1 and 3) and {shares[1]:.3g} (2 and 4) of m·g"


def thrust_region(
    share: float | None,
    vehicle: VehicleLike = PAPER,
    *,
    least: float = 0.0,
    accuracy: float = DEFAULT_ACCURACY,
) -> Region:
    """Return where each hover thrust is positive, at most `share` and at least `least` of the weight.

    With `share` None there is no upper limit. Curved borders are at most `accuracy` from their true place [rad].

    >>> [round(thrust_region(share).area, 3) for share in (0.3, 0.6, 3.0)]
    [0.169, 4.107, 4.962]
    >>> thrust_region(None, least=0.3).contains([[-0.2, 0.2], [-1.0, 1.0]]).tolist()
    [False, True]
    """
    vehicle = vehicle_named(vehicle)
    accuracy, region = checked_accuracy(accuracy), hover_region(vehicle)
    if share is not None:
        rule = "a number above 0, at most 1e12 (of m·g)"
        share = checked_number("share", share, rule, above=True, most=1e12)
        region = thrust_limited(region, share, vehicle, accuracy, largest=True)
    rule = "a number from 0 to 1e12 (of m·g)"
    least = checked_number("least", least, rule, most=1e12)
    if least:
        region = thrust_limited(region, least, vehicle, accuracy, largest=False)
    return region


def thrust_limited(
    region: Region, share: float, vehicle: Vehicle, accuracy: float, *, largest: bool
) -> Region:
    """Return where in a region of positive hover thrusts the largest is at most a share, or the least at least a share.

    Rotors 1 and 2 have the yaw torques T1(α1) and T2(α2). The share of rotor 1 is half of T2/(T2·cos α1 + T1·cos α2), and
    thrusts are positive where both torques have one sign (docs/theory.md, 11).
    """
    moments = level_of(rotors_of(vehicle)).moment[:2, 2]

    def excess(rotor: int, sign: int, *alpha: FloatArray) -> FloatArray:
        own, other = (moments[k] @ directions(alpha[k]) for k in (rotor, 1 - rotor))
        lift = other * np.cos(alpha[rotor]) + own * np.cos(alpha[1 - rotor])
        return np.asarray(sign * (other - 2 * share * lift))

    pairs = []
    for quarter in hover_quarters(vehicle, OPEN_MARGIN).values():
        middle = float(quarter[1].centroid.x)
        sign = int(np.sign(moments[0] @ directions(middle)))
        if largest:
            sign = -sign
        pair = np.asarray(shapely.intersection(region.pair, quarter))
        for rotor in (0, 1):
            border = Border(Waves.of(partial(excess, rotor, sign)))
            pair = cut(pair, border, accuracy)
        pairs.append(pair)
    word, symbol = ("largest", "≤") if largest else ("least", "≥")
    value = partial(_extreme_share, vehicle, largest)
    limit = limit_condition(
        "hover thrusts", symbol, share, value, " of m·g", f"{word} hover thrust"
    )
    accuracy = max(region.accuracy, accuracy)
    return region_of(union_of(pairs), accuracy, *region.conditions, limit)


def _extreme_share(
    vehicle: Vehicle, largest: bool, alpha1: float, alpha2: float
) -> Any:
    shares = matrices.hover_thrust_shares([alpha1, alpha2, alpha1, alpha2], vehicle)
    return shares.max() if largest else shares.min()


def singular_value_region(
    floor: float,
    vehicle: VehicleLike = PAPER,
    *,
    accuracy: float = DEFAULT_ACCURACY,
) -> Region:
    """Return where the least singular value of the scaled decoupling matrix, level, is at least a floor on red.

    It is nowhere above :func:`~gaitgraph.invertibility.matrices.largest_least_singular_value`. Below a floor of 1e-6
    `inner` keeps 1e-6. Curved borders are at most `accuracy` from their true place [rad].

    >>> [round(singular_value_region(floor).area, 3) for floor in (0.05, 0.5, 1.1, 1.2)]
    [9.138, 3.766, 0.061, 0.0]
    """
    floor, accuracy = checked_floor(floor), checked_accuracy(accuracy)
    vehicle = vehicle_named(vehicle)
    pair = singular_value_pair(floor, vehicle, accuracy)
    return region_of(pair, accuracy, singular_value_limit(floor, vehicle))


def singular_value_limit(floor: float, vehicle: Vehicle) -> Condition:
    """Return the condition that the least singular value is at least a floor."""
    return limit_condition(
        "least singular value", "≥", floor, partial(_singular_value, vehicle)
    )


def _singular_value(vehicle: Vehicle, alpha1: float, alpha2: float) -> Any:
    return matrices.least_singular_value([alpha1, alpha2, alpha1, alpha2], vehicle)


def singular_value_pair(
    floor: float, vehicle: Vehicle, accuracy: float, within: BaseGeometry = SQUARE
) -> Pair:
    """Return where in a rectangle the least singular value is at least a floor."""
    if within.is_empty or floor > matrices.largest_least_singular_value(vehicle):
        return NOWHERE
    if floor == 0:
        return np.array([within, within])
    return _outside_bands(floor, rotors_of(vehicle), accuracy, within)


@lru_cache(maxsize=64)
def _outside_bands(
    floor: float, rotors: Rotors, accuracy: float, within: BaseGeometry
) -> Pair:
    """Return where in a rectangle both blocks keep a positive floor; vehicles with the same rotors share it."""
    # A band around R = 0 that is narrower than the error of its polygons is enclosed by a wider band, and none.
    wide = max(floor, accuracy / 2, _NARROWEST)
    fine = wide / 8
    if wide == floor:
        fine = min(fine, accuracy)
    pair = np.array([within, within])
    for block in (yaw_block(rotors), roll_block(rotors)):
        g = wide**2 / 2
        squares = Waves.of(block.squares)
        determinant = Waves.of(block.determinant)
        border = Border(squares.scaled(-g, g**2), determinant, block.corner(g))
        also = Border(squares.scaled(1.0, -2 * g))
        band = negative_pair(border, fine, also=also, around=within)
        if wide > floor:
            band[0] = shapely.Polygon()
        pair = shapely.difference(pair, band[::-1])
    return pair


def tilt_region(tilt_range: Sequence[Sequence[float]]) -> Region:
    """Return where all tilts are within their ranges; opposite arms tilt alike on red."""
    ranges = np.array(tilt_range).reshape(2, 2, 2)
    low = np.maximum(ranges[..., 0].max(axis=0), -HALF_PI).tolist()
    high = np.minimum(ranges[..., 1].min(axis=0), HALF_PI).tolist()
    most = high[0]
    condition = limit_condition("tilt", "≤", math.degrees(most), _degrees_of_tilt, "°")
    if (low, high) != ([-most] * 2, [most] * 2):
        condition = Condition(
            name="tilts within their ranges", broken_at=partial(_beyond, low, high)
        )
    return region_of([rectangle(*low, *high)] * 2, 0.0, condition)


def _degrees_of_tilt(alpha1: float, alpha2: float) -> float:
    return math.degrees(max(abs(alpha1), abs(alpha2)))


def _beyond(low: Sequence[float], high: Sequence[float], *at: float) -> str | None:
    """Return which coordinate of a point is not in its range, None if both are."""
    for name, angle, least, most in zip(
        ("α1 = α3", "α2 = α4"), at, low, high, strict=True
    ):
        if not least <= angle <= most:
            wanted = f"within {math.degrees(least):.3g}° and {math.degrees(most):.3g}°"
            return f"tilt {name} must be {wanted}, got {math.degrees(angle):.3g}°"
    return None
