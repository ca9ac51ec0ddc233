"""Where a gait may be: the sign of R, each condition of flight on the red sheet, and all of them in one region.

The sign of R on a grid cannot separate the components of R ≠ 0: it joins them across the saddles, where two factors
of R (:func:`gaitgraph.surface.sheets.red_label`) vanish.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache, partial
from itertools import product
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import shapely

from gaitgraph.angles import (
    HALF_PI,
    angle_within,
    checked_floor,
    checked_number,
    figures_apart,
)
from gaitgraph.errors import InputError, check_kind, checked_choice
from gaitgraph.invertibility import error_margins, matrices
from gaitgraph.invertibility.coefficients import check_symmetric, coefficients_of
from gaitgraph.invertibility.forms import Form, level_of, rotors_of
from gaitgraph.invertibility.segment_bounds import least_level_determinant
from gaitgraph.surface import borders
from gaitgraph.surface.blocks import roll_block, yaw_block
from gaitgraph.surface.borders import CosineSum, sum_on_plane
from gaitgraph.surface.curved_region import sheet_region
from gaitgraph.surface.region import (
    DEFAULT_ACCURACY,
    Condition,
    Pair,
    Region,
    Requirement,
    Zones,
    checked_accuracy,
    chord_tolerance,
    offset,
    offsets,
    polygons_of,
    rectangle,
    region_of,
    sides_of,
    zones_region,
)
from gaitgraph.surface.sheets import (
    COLORS,
    RAISED,
    SIGNS,
    Color,
    Sign,
    red_label,
    sheet_angles,
)
from gaitgraph.tolerances import DEFAULT_FLOOR, ROUND_OFF
from gaitgraph.vehicle import PAPER, Angle, Vehicle, VehicleLike, vehicle_named

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from shapely import MultiPolygon
    from shapely.geometry.base import BaseGeometry

    from gaitgraph.invertibility.coefficients import Coefficients, CoefficientsLike
    from gaitgraph.invertibility.forms import FloatArray

_EPSILON = float(np.finfo(float).eps)
_OPEN_MARGIN = (
    1e-9  # how far inside an open condition its straight border is drawn [rad]
)
# Where R need only be certain in spite of rounding, which a distance of all of its borders mostly does.
_ROUNDED = 1e-11
_CERTAIN_MARGIN, _AT_SADDLE = 3e-7, 1e-6  # rad
# Around R = 0 the least singular value is below a floor within floor/(√2·rate), which outer shapes of up to twice the
# accuracy do not reach over.
_BAND = 4.0
_SEPARATING = 1e-6  # a floor that keeps polygons off R = 0 beyond rounding
# Nearer to a limit than this the checks of a gait cannot decide along segments, and count it as beyond the limit.
_DECIDED = 1.5e-6  # singular values; see invertibility.segment_bounds
_DECIDED_THRUST = 1.5e-4  # shares of the weight; see invertibility.segment_bounds
_IDLE_MARGIN = 1e-6  # distance from lines where rotors idle [rad]
_LEAST_OF_SQUARES = 0.01  # accuracy of regions made of squares at the finest [rad]
_FINEST = 1e-5  # accuracy of the borders of a margin, which is an angle itself [rad]
_POSTURES = 33  # of each angle, among which the largest servo margin is searched
_CUTS = 2  # of a region into cells, to see whether a border reaches it
_PARTS = np.array(list(product((-1.5, -0.5, 0.5, 1.5), repeat=2)))
_SQUARE = shapely.box(-HALF_PI, -HALF_PI, HALF_PI, HALF_PI)
_NOWHERE = np.array([shapely.Polygon(), shapely.Polygon()])


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
    (wanted,), accuracy = _checked_signs(color, sign), checked_accuracy(accuracy)
    vehicle = vehicle_named(vehicle)
    least = 0.0 if least is None else checked_number("least", least)
    if color == "red":
        judged = coefficients_of(vehicle, "exact")
        pair = _red_sign(wanted, vehicle, accuracy)
        if 0 < least <= _ROUNDED:
            margin = min(_CERTAIN_MARGIN, accuracy / 2)
            apart = _red_sign(wanted, vehicle, accuracy, margin)
            pair[0] = _without_saddles(apart[0], least, wanted, judged)
        if least and _determinant_falls_below(least, wanted, pair[0], judged):
            pair = _determinant_above(least, wanted, vehicle, accuracy)
    else:
        judged = coefficients_of(vehicle, coefficients)
        if color not in judged.colors:
            return _none_on_blue(vehicle, accuracy)
        least = least or matrices.noise_of(judged)
        pair = _blue_sign(least, wanted, judged, accuracy)
    return region_of(
        pair, accuracy, _determinant_condition([wanted], least, color, judged)
    )


def _red_sign(
    sign: int, vehicle: Vehicle, accuracy: float, margin: float = _OPEN_MARGIN
) -> Pair:
    """Return where R has a sign on red: where the determinants of both blocks have the same sign, or opposite ones.

    The inner shape keeps the margin from straight borders [rad].
    """
    turned = sign if vehicle.signed_drag_ratio > 0 else -sign
    yaw, roll = _determinant_sides(vehicle, accuracy, margin)
    return _union([shapely.intersection(yaw[k], roll[k * turned]) for k in (1, -1)])


def _without_saddles(
    shape: BaseGeometry, least: float, sign: int, exact: Coefficients
) -> BaseGeometry:
    """Return polygons without the corners where both blocks are so small that |R| is below a value."""
    alpha1, alpha2 = shapely.get_coordinates(shape).T
    points = np.array([alpha1, alpha2, alpha1, alpha2]).T
    low = sign * matrices.level_determinant(points, exact) < least
    corners = shapely.points(alpha1[low], alpha2[low])
    return shape.difference(shapely.union_all(shapely.buffer(corners, _AT_SADDLE)))


@lru_cache(maxsize=32)
def _determinant_sides(
    vehicle: Vehicle, accuracy: float, margin: float
) -> list[dict[int, Pair]]:
    """Return, for each block, where its determinant is positive and where it is negative."""
    found = []
    for block in (yaw_block(vehicle), roll_block(vehicle)):
        negative = borders.determinant_negative(block, chord_tolerance(accuracy))
        reach = margin if block.is_product else max(margin, accuracy / 2)
        below, above = sides_of(negative.shape, reach)
        found.append({1: above, -1: below})
    return found


def _determinant_above(
    least: float, sign: int, vehicle: Vehicle, accuracy: float
) -> Pair:
    """Return where R has a sign on red, and |R| is at least a value."""
    below = borders.product_below(
        least,
        sign * 2 / vehicle.signed_drag_ratio * yaw_block(vehicle).form,
        roll_block(vehicle).form,
        chord_tolerance(accuracy),
    )
    return sides_of(below.shape, accuracy / 2)[1]


def _blue_sign(
    least: float, sign: int, coefficients: Coefficients, accuracy: float
) -> Pair:
    """Return where R has a sign on blue, and |R| is at least a value; its sign turns where α3 or α4 is wrapped by π.

    Nothing is wrapped in the sums: there α3 = 2δ − α1 and α4 = −2δ − α2.
    """
    wraps = [2 * line - math.copysign(HALF_PI, line) for line in coefficients.crossings]
    offsets = np.array([0.0, 0.0, *np.multiply(2, coefficients.crossings)])
    parts = []
    for turned in (1, -1):
        level = sum_on_plane(coefficients.form, offsets, sign * turned, slope=-1.0)
        below = borders.sum_negative(level + -least, chord_tolerance(accuracy))
        cells = _quarters(wraps[0], wraps[1], -turned)
        above = sides_of(below.shape, accuracy / 2)[1]
        parts.append(shapely.intersection(cells, above))
    return _union(parts)


def _none_on_blue(vehicle: Vehicle, accuracy: float) -> Region:
    """Return the empty region, with the reason why no gait on blue can be robust or flyable."""
    name = "an invertible decoupling matrix"
    reason = "on blue the decoupling matrix is singular in exact physics: use red"
    if vehicle.has_raised_rotors:
        name = "a vertical zero-moment direction"
        reason = f"blue is no gait surface {RAISED} {vehicle.heights_in_words}"
    return region_of(
        _NOWHERE,
        accuracy,
        Condition(name=name, broken_at=partial(_everywhere, reason)),
    )


def _everywhere(reason: str, _alpha1: float, _alpha2: float) -> str:
    return reason


def _quarters(x: float, y: float, sign: int, kept: float = _OPEN_MARGIN) -> Pair:
    """Return where (α1 − x)·(α2 − y) has a sign; `inner` keeps a margin from the lines [rad]."""
    shapes = []
    for margin in (kept, 0.0):
        left, right = (-HALF_PI, x - margin), (x + margin, HALF_PI)
        below, above = (-HALF_PI, y - margin), (y + margin, HALF_PI)
        if sign < 0:
            below, above = above, below
        parts = [rectangle(left[0], below[0], left[1], below[1])]
        parts.append(rectangle(right[0], above[0], right[1], above[1]))
        shapes.append(shapely.union_all(parts))
    return np.array(shapes)


def _checked_signs(color: object, sign: object) -> list[int]:
    """Return a sign as +1 or −1, or both for None; raise InputError for another sign or an unknown color."""
    checked_choice("color", color, COLORS)
    if sign is not None:
        checked_choice("sign", sign, SIGNS)
    return [
        number
        for name, number in (("positive", 1), ("negative", -1))
        if sign in (None, name)
    ]


def _union(pairs: Sequence[Any]) -> Pair:
    return np.asarray(shapely.union_all(np.array(pairs, dtype=object), axis=0))


def _determinant_falls_below(
    least: float, sign: int, shape: BaseGeometry, exact: Coefficients
) -> bool:
    """Return whether |R| may be below a value in polygons on which R has one sign.

    |R| is least on a border: R is a constant times the determinants P and D of two blocks, with ΔP = −2P and ΔD = −2D.
    Where its gradient vanishes, ∇D = −D·∇P/P, so that ΔR = −4R − 2R·|∇P|²/P² has the sign of −R.
    """
    if shape.is_empty:
        return False
    rings = shapely.get_rings(shapely.get_parts(polygons_of(shape)))
    corners, ring = shapely.get_coordinates(rings, return_index=True)
    follows = ring[1:] == ring[:-1]
    ends = corners[:, [0, 1, 0, 1]]
    found = least_level_determinant(
        ends[:-1][follows],
        ends[1:][follows],
        exact,
        sign=sign,
        tolerance=0.0,
        floor=least,
    )
    return bool(found.lower.min() < least)


def _determinant_condition(
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


def hover_region(vehicle: VehicleLike = PAPER) -> Region:
    """Return where all hover thrusts are positive on the red sheet: the yaw torques of the two pairs have one sign.

    These are two rectangles, for the paper's vehicle α1 < δ and α2 > −δ, and α1 > δ and α2 < −δ. Their borders, where a
    pair of rotors idles, are excluded.

    >>> round(hover_region().outer.area, 3)
    4.991
    """
    body = vehicle_named(vehicle)
    pair = _quarters(*level_of(rotors_of(body)).crossings, -1)
    condition = Condition(name="hover thrusts > 0", broken_at=partial(_pulling, body))
    return region_of(pair, _OPEN_MARGIN, condition)


def _pulling(vehicle: Vehicle, alpha1: float, alpha2: float) -> str | None:
    shares = matrices.hover_thrust_shares([alpha1, alpha2, alpha1, alpha2], vehicle)
    if shares.min() > 0:
        return None
    return f"hover thrusts must be > 0, got {shares[0]:.3g} (rotors 1 and 3) and {shares[1]:.3g} (2 and 4) of m·g"


def _bound(
    name: str,
    sign: str,
    limit: float,
    value: Callable[..., Any],
    unit: str = "",
    what: str = "",
) -> Condition:
    """Return the condition that a value at (α1, α2) is at least ("≥") or at most ("≤") a limit.

    `name` is that of the condition, `what` that of the value where it differs.
    """
    condition = f"{name} {sign} {limit:.3g}{unit}"
    return Condition(
        name=condition,
        broken_at=partial(_beyond_limit, what or name, sign, limit, value, unit),
    )


def _beyond_limit(
    what: str,
    sign: str,
    limit: float,
    value: Callable[..., Any],
    unit: str,
    alpha1: float,
    alpha2: float,
) -> str | None:
    here = float(value(alpha1, alpha2))
    if here == limit or (here > limit) == (sign == "≥"):
        return None
    got, allowed = figures_apart(here, limit)
    return f"{what} must be {sign} {allowed}{unit}, got {got}{unit}"


def _degrees_of_tilt(alpha1: float, alpha2: float) -> float:
    return math.degrees(max(abs(alpha1), abs(alpha2)))


def thrust_region(
    share: float | None,
    vehicle: VehicleLike = PAPER,
    *,
    least: float = 0.0,
    accuracy: float = DEFAULT_ACCURACY,
) -> Region:
    """Return where each hover thrust is positive, at most `share` and at least `least` of the weight.

    With `share` None there is no upper limit. `accuracy` as for :func:`sign_region`.

    >>> [round(thrust_region(share).area, 3) for share in (0.3, 0.6, 3.0)]
    [0.169, 4.107, 4.962]
    >>> thrust_region(None, least=0.3).contains([[-0.2, 0.2], [-1.0, 1.0]]).tolist()
    [False, True]
    """
    vehicle = vehicle_named(vehicle)
    accuracy, region = checked_accuracy(accuracy), hover_region(vehicle)
    if share is not None:
        checked_number("share", share, "a positive finite number (of m·g)", above=True)
        region &= _thrust_limit(share, vehicle, accuracy, largest=True)
    if checked_number("least", least, "a finite number ≥ 0 (of m·g)"):
        region &= _thrust_limit(least, vehicle, accuracy, largest=False)
    return region


@lru_cache(maxsize=32)
def _thrust_limit(
    share: float, vehicle: Vehicle, accuracy: float, *, largest: bool
) -> Region:
    """Return where hover thrusts are positive and the largest is at most a share, or the least at least a share."""
    first, second = level_of(rotors_of(vehicle)).moment[:2, 2]
    tolerance = chord_tolerance(accuracy)
    above = borders.thrust_above(share, first, second, tolerance)
    other = borders.thrust_above(share, second, first, tolerance).transposed()
    # Each set is moved by itself: where both overlap by their errors alone, their union has no border to be moved.
    kept = 1 if largest else 0
    pair = shapely.intersection(
        sides_of(above.shape, accuracy / 2)[kept],
        sides_of(other.shape, accuracy / 2)[kept],
    )
    word, symbol = ("largest", "≤") if largest else ("least", "≥")
    value = partial(_extreme_share, vehicle, largest)
    limit = _bound(
        "hover thrusts", symbol, share, value, " of m·g", f"{word} hover thrust"
    )
    return region_of(pair, accuracy, limit)


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

    It is nowhere above :func:`largest_least_singular_value`. `accuracy` as for :func:`sign_region`.

    >>> [round(singular_value_region(floor).area, 3) for floor in (0.05, 0.5, 1.1, 1.2)]
    [9.138, 3.766, 0.061, 0.0]
    """
    floor, accuracy = checked_floor(floor), checked_accuracy(accuracy)
    vehicle = vehicle_named(vehicle)
    limit = _bound(
        "least singular value", "≥", floor, partial(_singular_value, vehicle)
    )
    return region_of(_singular_value_pair(floor, vehicle, accuracy), accuracy, limit)


def _singular_value(vehicle: Vehicle, alpha1: float, alpha2: float) -> Any:
    return matrices.least_singular_value([alpha1, alpha2, alpha1, alpha2], vehicle)


@lru_cache(maxsize=64)
def _singular_value_pair(floor: float, vehicle: Vehicle, accuracy: float) -> Pair:
    pair: Pair = np.array([_SQUARE, _SQUARE])
    if floor > matrices.largest_least_singular_value(vehicle):
        return _NOWHERE
    if floor == 0:
        return pair
    for block in (yaw_block(vehicle), roll_block(vehicle)):
        if not block.has_orthogonal_columns and floor < accuracy / 2:
            # The band around R = 0 is narrower than the error of its polygons: a wider band, and none, enclose it.
            band = borders.singular_value_below(accuracy / 2, block, accuracy / 32)
            pair[0] = pair[0].difference(offset(band.shape, accuracy / 16))
            continue
        band = borders.singular_value_below(floor, block, chord_tolerance(accuracy))
        reach = ROUND_OFF if block.has_orthogonal_columns else accuracy / 2
        pair = shapely.difference(pair, offsets(band.shape, reach)[::-1])
    return pair


def servo_margin_region(
    margin: Angle,
    vehicle: VehicleLike = PAPER,
    *,
    sign: Sign | None = None,
    floor: float = DEFAULT_FLOOR,
    accuracy: float = DEFAULT_ACCURACY,
) -> Region:
    """Return where level flight bears errors of the tilt angles on red (docs/theory.md, 19).

    A point bears them if, at the 16 corners of the box of errors, the hover thrusts are positive and within the
    vehicle's limit, and if at the four of these corners that lie on red the least singular value is at least the floor.
    Without a floor this is necessary and sufficient. With one it is necessary;
    :func:`gaitgraph.invertibility.error_margins.bears_servo_errors` proves that a gait bears all other errors too.
    `sign` is that of R, None for either; `accuracy` as for :func:`sign_region`.

    >>> [round(servo_margin_region(angle, floor=0.0, sign="positive").area, 4) for angle in ("15deg", "22.5deg", "45deg")]
    [1.0966, 0.6169, 0.0]
    """
    signs = _checked_signs("red", sign)
    margin = angle_within(margin, "servo_margin", HALF_PI, least=0.0)
    floor, accuracy = checked_floor(floor), checked_accuracy(accuracy)
    vehicle = vehicle_named(vehicle)
    accuracy = max(accuracy, _FINEST)
    bearing = [_bearing_thrusts(margin, wanted, vehicle, accuracy) for wanted in signs]
    pair = _union(bearing)
    of_one = singular_value_region(floor, vehicle, accuracy=accuracy).pair
    for turn in product((-margin, margin), repeat=2):
        pair = shapely.intersection(pair, _moved(of_one, turn))
    limit = _bound(
        "servo margin",
        "≥",
        math.degrees(margin),
        partial(_degrees_of_servo_margin, vehicle, floor),
        "°",
    )
    return region_of(pair, accuracy, limit)


def _degrees_of_servo_margin(
    vehicle: Vehicle, floor: float, alpha1: float, alpha2: float
) -> float:
    posture = [[alpha1, alpha2] * 2]
    found = error_margins.servo_margin(posture, vehicle, floor=floor).found
    return math.degrees(HALF_PI if found is None else found)


@lru_cache(maxsize=64)
def _bearing_thrusts(
    margin: float, sign: int, vehicle: Vehicle, accuracy: float
) -> Pair:
    """Return where R has a sign and the hover thrusts are in their range at all corners of the box of errors."""
    level = level_of(rotors_of(vehicle))
    most = vehicle.thrust_share
    corners = margin * np.array(list(product((1.0, -1.0), repeat=4)))
    # What errors leave is in what is left without them, so that fewer borders reach it.
    nominal = thrust_region(most, vehicle, accuracy=accuracy).outer
    pair = np.array([nominal & _red_sign(sign, vehicle, accuracy)[1]] * 2)

    # A thrust is N_i/R. A half turn maps the conditions of rotors 3 and 4 to those of 1 and 2 at other corners.
    conditions = []
    for rotor in (0, 1):
        transposed = rotor == 1  # N1 is quadratic in u2, N2 in u1
        upward = sign * float(level.rotors.thrust_signs[rotor])
        for errors in corners:
            of_plane = partial(sum_on_plane, offsets=errors, transposed=transposed)
            thrust = of_plane(level.inputs[rotor], factor=upward)
            if errors[rotor] > 0:  # N_i does not depend on the angle of its own rotor
                conditions.append(_Positive(thrust, transposed))
            if most is not None:
                left = of_plane(level.direction, factor=sign * most)
                left += of_plane(level.inputs[rotor], factor=-upward)
                conditions.append(_Positive(left, transposed))
    pair = _cut_by(conditions, pair, accuracy)

    # R is a sum of N_i times lifts: with N_i of one sign it has their sign where all lifts are positive, within 90° of
    # the upright angles.
    lifts = level.force[:2, 2] * level.rotors.thrust_signs[:2, None]
    middle = np.arctan2(lifts[:, 1], lifts[:, 0])
    reach = HALF_PI - margin
    upright = rectangle(*(middle - reach).tolist(), *(middle + reach).tolist())
    if most is None and not upright.covers(pair[1]):
        lifts_of = [sum_on_plane(level.direction, errors, sign) for errors in corners]
        beyond = shapely.difference(pair, upright)
        lifting = _cut_by([_Positive(lift) for lift in lifts_of], beyond, accuracy)
        pair = shapely.union(shapely.intersection(pair, upright), lifting)
    return pair


class _Positive(NamedTuple):
    """The condition that a form on red is not negative; transposed, it is one of (α2, α1)."""

    form: CosineSum
    transposed: bool = False

    def least_on(self, shape: BaseGeometry) -> float:
        """Return a lower bound on a shape, from values and slopes in the middle of square cells that cover it."""
        if shape.is_empty:
            return math.inf
        left, bottom, right, top = shape.bounds
        step = max(right - left, top - bottom)
        middles = np.array([[left + step / 2, bottom + step / 2]])
        for _ in range(_CUTS):
            # Each cell that may hold the least value is cut into 16 parts.
            step /= 4
            parts = (middles[:, None] + step * _PARTS).reshape(-1, 2)
            near = shapely.dwithin(shape, shapely.points(parts), step)
            middles = parts[near]
            bounds = self._bounds(middles, step / math.sqrt(2))
            middles = middles[bounds <= 0]
            if not len(middles):
                break
        return float(bounds.min(initial=math.inf))

    def at(self, points: FloatArray) -> FloatArray:
        """Return the values of the form at points (α1, α2), shape (k,)."""
        return self.form.at(points[:, ::-1] if self.transposed else points)

    def _bounds(self, middles: FloatArray, reach: float) -> FloatArray:
        """Return lower bounds within a distance of some points, shape (k,)."""
        points = middles[:, ::-1] if self.transposed else middles
        value, along, across, _ = self.form.along(points, np.array([[1.0, 0.0]]))
        fall = np.hypot(along, across) * reach + self.form.most(2) * reach**2 / 2
        return np.asarray(value - fall)

    def cut(self, pair: Pair, accuracy: float) -> Pair:
        """Return the parts of a pair where the condition holds."""
        left, bottom, right, top = pair[1].bounds
        low, high = (bottom, top) if self.transposed else (left, right)
        window = low - 2 * accuracy, high + 2 * accuracy
        negative = borders.sum_negative(self.form, chord_tolerance(accuracy), window)
        if self.transposed:
            negative = negative.transposed()
        reach = ROUND_OFF if negative.is_straight else accuracy / 2
        beyond = offsets(negative.shape, reach)[::-1]
        return np.asarray(shapely.difference(pair, beyond))


def _cut_by(conditions: Sequence[_Positive], pair: Pair, accuracy: float) -> Pair:
    """Return the parts of a pair where all conditions hold."""
    whole = pair[1]
    places = np.random.default_rng(0).uniform(-HALF_PI, HALF_PI, (4, 2))
    distinct = {tuple(np.round(one.at(places), 9)): one for one in conditions}
    # The most restrictive ones first: few borders reach what they leave.
    for condition in sorted(distinct.values(), key=lambda one: one.least_on(whole)):
        if condition.least_on(pair[1]) <= 0:
            pair = condition.cut(pair, accuracy)
    return pair


def _moved(pair: Pair, turn: Sequence[float]) -> Pair:
    """Return polygons moved by an angle in α1 and in α2; what they are of comes again after π in each."""
    copies = []
    for whole in product((-math.pi, 0.0, math.pi), repeat=2):
        step = np.add(turn, whole)
        copies.append(shapely.transform(pair, partial(np.add, step)))
    return np.asarray(shapely.intersection(_union(copies), _SQUARE))


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

    Examples
    --------
    >>> round(admissible_region().area, 3), round(admissible_region(require="valid").area, 3)
    (4.748, 9.823)
    """
    checked_choice("require", require, ("valid", "flyable"))
    check_kind("zones", zones, Zones, type(None))
    _checked_signs(color, sign)
    vehicle = vehicle_named(vehicle)
    coefficients = coefficients_of(vehicle, coefficients)
    floor, accuracy = checked_floor(floor), checked_accuracy(accuracy)
    if vehicle.asymmetry is None:
        region = _admissible(
            vehicle, require, color, sign, coefficients, floor, accuracy
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


def checked_servo_margin(margin: Any, require: Requirement) -> float:
    """Return a servo margin [rad]; InputError if it is none, or not 0 and asked of what need not be flyable."""
    checked: float = angle_within(margin, "servo_margin", HALF_PI, least=0.0)
    if checked and require != "flyable":
        raise InputError(
            f"servo_margin must be 0 with require 'valid', got {checked:.4g} rad: only what is flyable has one",
            field="servo_margin",
            value=margin,
        )
    return checked


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
) -> Region:
    signs = _checked_signs(color, sign)
    judged = coefficients_of(vehicle, "exact") if color == "red" else coefficients
    if color == "blue" and (require == "flyable" or color not in judged.colors):
        return _none_on_blue(vehicle, accuracy)
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

    condition = _determinant_condition(signs, least, color, judged)
    if require == "valid":
        pairs = [signed(wanted) for wanted in signs]
        return region_of(_union(pairs), accuracy, condition)
    region = _physical(vehicle, floor, accuracy)
    if floor < _SEPARATING:
        pairs = [signed(wanted) for wanted in signs]
        return region_of(_union(pairs), accuracy, condition) & region
    pairs = []
    for wanted in signs:
        # Each polygon of the inner shape is off R = 0, so R has one sign on it.
        pair = np.array([_of_sign(wanted, shape, vehicle) for shape in region.pair])
        if floor <= _BAND * level_of(rotors_of(vehicle)).rate * accuracy:
            # The outer shape may reach over R = 0.
            whole = _red_sign(wanted, vehicle, accuracy)[1]
            pair[1] = shapely.intersection(region.outer, whole)
        # |R| is at least a product of four singular values, over 2κ.
        certain = floor**4 / (2 * vehicle.drag_ratio)
        if certain < least and _determinant_falls_below(least, wanted, pair[0], judged):
            pair = shapely.intersection(pair, signed(wanted))
        pairs.append(pair)
    return region_of(_union(pairs), region.accuracy, condition, *region.conditions)


def _of_sign(sign: int, shape: MultiPolygon, vehicle: Vehicle) -> BaseGeometry:
    """Return the polygons of a shape in whose inside R has a sign on red."""
    parts = np.array(shape.geoms)
    points = shapely.point_on_surface(parts)
    labels = red_label(shapely.get_x(points), shapely.get_y(points), vehicle)
    return shapely.union_all(parts[labels.prod(axis=-1) == sign])


@lru_cache(maxsize=32)
def _physical(vehicle: Vehicle, floor: float, accuracy: float) -> Region:
    """Return where on red the least singular value, the hover thrusts and the tilts keep their limits."""
    decided = floor + _DECIDED if floor > 0 else 0.0
    region = singular_value_region(decided, vehicle, accuracy=accuracy)
    share = vehicle.thrust_share
    if share is not None:
        share = max(share - _DECIDED_THRUST, share / 2)
    region &= thrust_region(share, vehicle, accuracy=accuracy)
    lines = level_of(rotors_of(vehicle)).crossings
    region &= region_of(_quarters(*lines, -1, _IDLE_MARGIN), accuracy)
    if vehicle.tilt_range is not None:
        region &= _tilt_region(vehicle.tilt_range)
    return region


def _tilt_region(tilt_range: Sequence[Sequence[float]]) -> Region:
    """Return where all tilts are within their ranges; opposite arms tilt alike on red."""
    ranges = np.array(tilt_range).reshape(2, 2, 2)
    low = np.maximum(ranges[..., 0].max(axis=0), -HALF_PI).tolist()
    high = np.minimum(ranges[..., 1].min(axis=0), HALF_PI).tolist()
    most = high[0]
    condition = _bound("tilt", "≤", math.degrees(most), _degrees_of_tilt, "°")
    if (low, high) != ([-most] * 2, [most] * 2):
        condition = Condition(
            name="tilts within their ranges", broken_at=partial(_beyond, low, high)
        )
    return region_of([rectangle(*low, *high)] * 2, 0.0, condition)


def _beyond(low: Sequence[float], high: Sequence[float], *at: float) -> str | None:
    """Return which coordinate of a point is not in its range, None if both are."""
    for name, angle, least, most in zip(
        ("α1 = α3", "α2 = α4"), at, low, high, strict=True
    ):
        if not least <= angle <= most:
            wanted = f"within {math.degrees(least):.3g}° and {math.degrees(most):.3g}°"
            return f"tilt {name} must be {wanted}, got {math.degrees(angle):.3g}°"
    return None


def largest_servo_margin(floor: float, vehicle: Vehicle, sign: Sign | None) -> float:
    """Return about the largest servo margin of a posture on red, with R of a sign, or of either for None [rad]."""
    largest, best, reach = 0.0, np.zeros(2), HALF_PI
    for _ in range(2):  # everywhere, then around the best posture
        axis = np.linspace(-reach, reach, _POSTURES)
        plane = np.clip(best + np.array(list(product(axis, axis))), -HALF_PI, HALF_PI)
        postures = plane[:, [0, 1, 0, 1]]
        values = error_margins.servo_margins_found(postures, vehicle, floor, 10)
        if sign is not None:
            wanted = 1 if sign == "positive" else -1
            values[
                red_label(plane[:, 0], plane[:, 1], vehicle).prod(axis=-1) != wanted
            ] = 0.0
        largest = max(largest, float(values.max()))
        best, reach = plane[values.argmax()], 2 * reach / _POSTURES
    return largest


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
