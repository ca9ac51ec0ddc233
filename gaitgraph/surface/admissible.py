"""Where a gait may be: all conditions of a gait on its sheet in one region, or why there is none."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import shapely

from gaitgraph.angles import checked_floor
from gaitgraph.errors import check_kind, checked_choice
from gaitgraph.invertibility import matrices
from gaitgraph.invertibility.coefficients import check_symmetric, coefficients_of
from gaitgraph.invertibility.forms import level_of, rotors_of
from gaitgraph.surface.curved_region import sheet_region
from gaitgraph.surface.flight_regions import (
    QUARTERS,
    Quarter,
    hover_quarters,
    hovering,
    singular_value_limit,
    singular_value_pair,
    thrust_limited,
    tilt_region,
)
from gaitgraph.surface.region import (
    DEFAULT_ACCURACY,
    WHOLE,
    Pair,
    Region,
    Requirement,
    Zones,
    checked_accuracy,
    region_of,
    union_of,
    zones_region,
)
from gaitgraph.surface.servo_regions import (
    checked_servo_margin,
    largest_servo_margin,
    servo_margin_region,
)
from gaitgraph.surface.sign_regions import (
    certain_determinant,
    checked_signs,
    determinant_condition,
    none_on_blue,
    parts_of_sign,
    sign_region,
)
from gaitgraph.tolerances import DEFAULT_FLOOR
from gaitgraph.vehicle import PAPER, Angle, Vehicle, VehicleLike, vehicle_named

if TYPE_CHECKING:
    from gaitgraph.invertibility.coefficients import Coefficients, CoefficientsLike
    from gaitgraph.surface.sheets import Color, Sign

# Around R = 0 the least singular value is below a floor within floor/(√2·rate), which outer shapes of up to twice the
# accuracy do not reach over.
_BAND = 4.0
_SEPARATING = 1e-6  # a floor that keeps polygons off R = 0 beyond rounding
# Nearer to a limit than this the checks of a gait cannot decide along segments, and count it as beyond the limit.
_DECIDED = 1.5e-6  # singular values; see invertibility.segment_bounds
_DECIDED_THRUST = 1.5e-4  # shares of the weight; see invertibility.segment_bounds
_IDLE_MARGIN = 1e-6  # distance from lines where rotors idle [rad]
_LEAST_OF_SQUARES = 0.01  # accuracy of regions made of squares at the finest [rad]


def admissible_region(
    vehicle: VehicleLike = PAPER,
    *,
    require: Requirement = "flyable",
    color: Color = "red",
    sign: Sign | None = None,
    coefficients: CoefficientsLike | None = None,
    floor: float = DEFAULT_FLOOR,
    zones: Zones | None = None,
    accuracy: float = DEFAULT_ACCURACY,
    servo_margin: Angle = 0.0,
    quarter: Quarter | None = None,
) -> Region:
    """Return where a gait may be, an empty region if nowhere.

    For a vehicle that is not symmetric this is :func:`gaitgraph.surface.curved_region.sheet_region`, with "flyable"
    alone and an accuracy of at least 0.01 rad.

    Parameters
    ----------
    vehicle
        The vehicle; its tilt ranges and `max_thrust` count where they are stated. MissingConstant if it states a thrust
        limit without the mass.
    require
        "valid": R has the sign. "flyable": also the least singular value is at least the floor, all hover thrusts are
        positive and within the limit, and so are the tilts. Nothing on blue is flyable. So that checks can decide along
        segments, the region keeps 1.5e-6 above the floor and 1.5e-4 of m·g below the limit of thrust, and `inner` 1e-6 rad
        off lines where rotors idle.
    color, sign
        The sheet, and the sign of R, None for either; no component holds both.
    coefficients
        The coefficients with which R is judged; by default those of :func:`coefficients_of`. |R| is so large that its
        sign is certain with them.
    floor, zones
        The least singular value floor, and the user's own polygons.
    accuracy
        How far curved borders may be from their true place [rad], 1e-9 to 0.1.
    servo_margin
        The errors of the tilt angles that level flight is to bear [rad]; with "flyable" alone. See
        :func:`servo_margin_region`.
    quarter
        The rectangle of :func:`hover_region` in which alone a flyable region is drawn on planes: "left", with the lower
        α1, or "right"; None for both. A gait that can fly stays in one of them.

    Examples
    --------
    >>> round(admissible_region().area, 3), round(admissible_region(require="valid").area, 3)
    (4.748, 9.823)
    """
    checked_choice("require", require, ("valid", "flyable"))
    if quarter is not None:
        checked_choice("quarter", quarter, QUARTERS)
    check_kind("zones", zones, Zones, type(None))
    checked_signs(color, sign)
    vehicle = vehicle_named(vehicle)
    coefficients = coefficients_of(vehicle, coefficients)
    floor, accuracy = checked_floor(floor), checked_accuracy(accuracy)
    if vehicle.asymmetry is None:
        region = _admissible(
            vehicle, require, color, sign, coefficients, floor, accuracy, quarter
        )
    else:
        region = _curved(vehicle, require, color, sign, floor, accuracy)
    margin = checked_servo_margin(servo_margin, require)
    if margin:
        region &= servo_margin_region(
            margin, vehicle, sign=sign, floor=floor, accuracy=accuracy
        )
    if zones is not None and (zones.keep_out or zones.keep_in):
        region &= zones_region(zones)
    return region


def _curved(
    vehicle: Vehicle,
    require: Requirement,
    color: Color,
    sign: Sign | None,
    floor: float,
    accuracy: float,
) -> Region:
    """Return where a gait can fly on a curved sheet; InputError for what needs planes."""
    if require != "flyable" or color != "red":
        check_symmetric(rotors_of(vehicle))
    accuracy = max(accuracy, _LEAST_OF_SQUARES)
    return sheet_region(vehicle, sign=sign, floor=floor, accuracy=accuracy)


@lru_cache(maxsize=32)
def _admissible(
    vehicle: Vehicle,
    require: Requirement,
    color: Color,
    sign: Sign | None,
    coefficients: Coefficients,
    floor: float,
    accuracy: float,
    quarter: Quarter | None,
) -> Region:
    signs = checked_signs(color, sign)
    judged = coefficients_of(vehicle, "exact") if color == "red" else coefficients
    if color == "blue" and (require == "flyable" or color not in judged.colors):
        return none_on_blue(vehicle, accuracy)
    least = matrices.noise_of(coefficients)
    if color == "red":
        least = certain_determinant(coefficients)

    def signed(wanted: int) -> Pair:
        name: Sign = "positive" if wanted > 0 else "negative"
        return sign_region(
            name,
            vehicle,
            color=color,
            coefficients=coefficients,
            least=least,
            accuracy=accuracy,
        ).pair

    condition = determinant_condition(signs, least, color, judged)
    region = region_of(WHOLE, accuracy)
    is_separated = False
    if require == "flyable":
        quarters = QUARTERS if quarter is None else (quarter,)
        parts = [_flyable_in(one, vehicle, floor, accuracy) for one in quarters]
        pair = union_of([part.pair for part in parts])
        region = region_of(pair, accuracy, *parts[0].conditions)
        # Each polygon is off R = 0, so R has one sign on it, and |R| is at least a product of four singular values, over 2κ.
        band = _BAND * level_of(rotors_of(vehicle)).rate * accuracy
        certain = floor**4 / (2 * vehicle.drag_ratio)
        is_separated = floor > max(_SEPARATING, band) and certain >= least
    pairs: list[Any] = []
    for wanted in signs:
        if is_separated:
            pairs.append(
                [parts_of_sign(wanted, shape, vehicle) for shape in region.pair]
            )
            continue
        pairs.append(shapely.intersection(region.pair, signed(wanted)))
    return region_of(union_of(pairs), region.accuracy, condition, *region.conditions)


@lru_cache(maxsize=64)
def _flyable_in(
    quarter: Quarter, vehicle: Vehicle, floor: float, accuracy: float
) -> Region:
    """Return where in a rectangle of positive hover thrusts singular values, hover thrusts and tilts keep their limits."""
    pair = hover_quarters(vehicle, _IDLE_MARGIN)[quarter]
    region = region_of(pair, accuracy, hovering(vehicle))
    share = vehicle.thrust_share
    if share is not None:
        share = max(share - _DECIDED_THRUST, share / 2)
        region = thrust_limited(region, share, vehicle, accuracy, largest=True)
    if vehicle.tilt_range is not None:
        region &= tilt_region(vehicle.tilt_range)
    # Borders of the least singular value are drawn where the other conditions leave something alone.
    decided = floor + _DECIDED if floor > 0 else 0.0
    within = shapely.envelope(region.outer)
    pair = singular_value_pair(decided, vehicle, accuracy, within)
    above = region_of(pair, accuracy, singular_value_limit(decided, vehicle))
    return above & region


def why_empty(
    region: Region,
    floor: float,
    vehicle: Vehicle,
    servo_margin: float = 0.0,
    sign: Sign | None = None,
) -> str:
    """Return why a region is empty, of a sign of R and postures that bear errors of a servo margin [rad]."""
    cap = matrices.largest_least_singular_value(vehicle)
    if floor > cap:
        return f"the least singular value of this vehicle is at most {cap:.4f}, below the floor {floor:g}; lower it"
    if vehicle.max_thrust and vehicle.mass:
        lift, weight = 4 * vehicle.max_thrust, vehicle.mass * vehicle.gravity
        if lift < weight:
            return f"four rotors lift {lift:.4g} N at most, and the vehicle weighs {weight:.4g} N; correct the vehicle"
    if servo_margin:
        largest = largest_servo_margin(floor, vehicle, sign)
        if servo_margin > largest:
            return f"no posture bears errors of the servos above about {math.degrees(largest):.1f}°; lower the servo margin"
    names = ", ".join(dict.fromkeys(condition.name for condition in region.conditions))
    return f"no tilt angles meet all conditions ({names}); lower the floor, or widen the limits or the polygons"
