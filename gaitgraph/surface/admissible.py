"""Where a gait may be: the sign of R, each condition of flight on the red sheet, and all of them in one region.

The sign of R on a grid cannot separate the components of R ≠ 0: it joins them across the saddles, where two factors
of R (:func:`gaitgraph.surface.sheets.red_label`) vanish.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache, partial
from itertools import product
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
import shapely

from gaitgraph.angles import (
    HALF_PI,
    angle_within,
    checked_floor,
    checked_number,
    figures_apart,
)
from gaitgraph.arrays import read_only
from gaitgraph.errors import InputError, check_kind, checked_choice
from gaitgraph.invertibility import error_margins, matrices
from gaitgraph.invertibility.coefficients import check_symmetric, coefficients_of
from gaitgraph.invertibility.forms import Form, Sines, level_of, rotors_of
from gaitgraph.surface.blocks import Block, directions, roll_block, yaw_block
from gaitgraph.surface.borders import Border, Waves, where_negative
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
    offsets,
    rectangle,
    region_of,
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

    import numpy.typing as npt
    from shapely import MultiPolygon
    from shapely.geometry.base import BaseGeometry

    from gaitgraph.invertibility.coefficients import Coefficients, CoefficientsLike
    from gaitgraph.invertibility.forms import FloatArray, Rotors
    from gaitgraph.surface.borders import Function

Quarter = Literal["left", "right"]
QUARTERS: tuple[Quarter, ...] = get_args(Quarter)

_OPEN_MARGIN = (
    1e-9  # how far inside an open condition its straight border is drawn [rad]
)
# Around R = 0 the least singular value is below a floor within floor/(√2·rate), which outer shapes of up to twice the
# accuracy do not reach over.
_BAND = 4.0
_NARROWEST = 1e-6  # a band that rounding leaves two borders
_SEPARATING = 1e-6  # a floor that keeps polygons off R = 0 beyond rounding
# Nearer to a limit than this the checks of a gait cannot decide along segments, and count it as beyond the limit.
_DECIDED = 1.5e-6  # singular values; see invertibility.segment_bounds
_DECIDED_THRUST = 1.5e-4  # shares of the weight; see invertibility.segment_bounds
_IDLE_MARGIN = 1e-6  # distance from lines where rotors idle [rad]
_LEAST_OF_SQUARES = 0.01  # accuracy of regions made of squares at the finest [rad]
_FINEST = 1e-5  # accuracy of the borders of a margin, which is an angle itself [rad]
_POSTURES = 33  # of each angle, among which the largest servo margin is searched
_SQUARE = shapely.box(-HALF_PI, -HALF_PI, HALF_PI, HALF_PI)
_WHOLE: Pair = read_only(np.array([_SQUARE, _SQUARE]))
_NOWHERE: Pair = read_only(np.array([shapely.Polygon(), shapely.Polygon()]))


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
    judged = coefficients_of(vehicle, "exact" if color == "red" else coefficients)
    if color not in judged.colors:
        return _none_on_blue(vehicle, accuracy)
    if color == "blue":
        least = least or matrices.noise_of(judged)
        pair = _blue_sign(wanted, least, judged, accuracy)
    elif least:
        pair = _determinant_above(wanted, least, vehicle, accuracy)
    else:
        pair = _red_sign(wanted, vehicle, accuracy)
    return region_of(
        pair, accuracy, _determinant_condition([wanted], least, color, judged)
    )


def _negative(
    border: Border,
    accuracy: float,
    *,
    also: Border | None = None,
    margin: float = ROUND_OFF,
    around: BaseGeometry = _SQUARE,
) -> Pair:
    """Return where h of a border is certainly negative around a shape, and where it may be.

    Both keep `margin` from straight borders, `accuracy` / 2 from others [rad].
    """
    room = 2 * accuracy
    left, bottom, right, top = around.bounds
    drawn = where_negative(
        border,
        chord_tolerance(accuracy),
        also=also,
        bounds=(left - room, bottom - room, right + room, top + room),
    )
    reach = margin if drawn.is_straight else max(margin, accuracy / 2)
    return offsets(drawn.shape, reach)


def _cut(pair: Pair, border: Border, accuracy: float) -> Pair:
    """Return the parts of a pair where h of a border is not negative."""
    if pair[1].is_empty:
        return pair
    negative = _negative(border, accuracy, around=pair[1])
    return np.asarray(shapely.difference(pair, negative[::-1]))


def _on_red(alpha1: FloatArray, alpha2: FloatArray) -> FloatArray:
    """Return the points of red above (α1, α2), shape (k, 4) [rad]."""
    return np.column_stack([alpha1, alpha2, alpha1, alpha2])


def _red_sign(sign: int, vehicle: Vehicle, accuracy: float) -> Pair:
    """Return where R has a sign on red: where the determinants of both blocks have the same sign, or opposite ones."""
    turned = sign if vehicle.signed_drag_ratio > 0 else -sign
    yaw, roll = (
        _determinant_sides(block(rotors_of(vehicle)), accuracy)
        for block in (yaw_block, roll_block)
    )
    return _union([shapely.intersection(yaw[k], roll[k * turned]) for k in (1, -1)])


def _determinant_sides(block: Block, accuracy: float) -> dict[int, Pair]:
    """Return where the determinant of a block is positive, and where it is negative."""
    border = Border(Waves.of(block.determinant))
    negative = _negative(border, accuracy, margin=_OPEN_MARGIN)
    above = shapely.difference(_SQUARE, negative[::-1])
    return {1: above, -1: shapely.intersection(_SQUARE, negative)}


@lru_cache(maxsize=32)
def _determinant_above(
    sign: int, least: float, vehicle: Vehicle, accuracy: float
) -> Pair:
    """Return where R has a sign on red, and |R| is at least a positive value."""
    exact = coefficients_of(vehicle, "exact")

    def excess(alpha1: FloatArray, alpha2: FloatArray) -> Any:
        R = matrices.level_determinant(_on_red(alpha1, alpha2), exact)
        return sign * R - least

    return _cut(_WHOLE, Border(Waves.of(excess)), accuracy)


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

        above = _cut(_WHOLE, Border(Waves.of(excess)), accuracy)
        unwrapped = _union(_quarters(wraps[0], wraps[1], -turned, _OPEN_MARGIN))
        parts.append(shapely.intersection(unwrapped, above))
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


def _quarters(x: float, y: float, sign: int, kept: float) -> list[Pair]:
    """Return the two rectangles where (α1 − x)·(α2 − y) has a sign, that with the lower α1 first.

    `inner` keeps a margin from the lines [rad].
    """
    shapes = []
    for margin in (kept, 0.0):
        left, right = (-HALF_PI, x - margin), (x + margin, HALF_PI)
        below, above = (-HALF_PI, y - margin), (y + margin, HALF_PI)
        if sign < 0:
            below, above = above, below
        parts = [rectangle(left[0], below[0], left[1], below[1])]
        parts.append(rectangle(right[0], above[0], right[1], above[1]))
        shapes.append(parts)
    return list(np.array(shapes).T)


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
    pair = _union([*_hover_quarters(body, _OPEN_MARGIN).values()])
    return region_of(pair, _OPEN_MARGIN, _hovering(body))


def _hover_quarters(vehicle: Vehicle, kept: float) -> dict[Quarter, Pair]:
    """Return the two rectangles where all hover thrusts are positive; `inner` keeps a margin from the lines [rad]."""
    left, right = _quarters(*level_of(rotors_of(vehicle)).crossings, -1, kept)
    return {"left": left, "right": right}


def hover_quarter_of(points: npt.ArrayLike, vehicle: Vehicle) -> Quarter | None:
    """Return in which of the two rectangles of positive hover thrusts all points lie, shape (m, 2), if in one."""
    plane = shapely.points(np.asarray(points, dtype=float))
    for quarter, (inside, _) in _hover_quarters(vehicle, _OPEN_MARGIN).items():
        if shapely.covers(inside, plane).all():
            return quarter
    return None


def _hovering(vehicle: Vehicle) -> Condition:
    return Condition(name="hover thrusts > 0", broken_at=partial(_pulling, vehicle))


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
        region = _thrust_limited(region, share, vehicle, accuracy, largest=True)
    if checked_number("least", least, "a finite number ≥ 0 (of m·g)"):
        region = _thrust_limited(region, least, vehicle, accuracy, largest=False)
    return region


def _thrust_limited(
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
    for quarter in _hover_quarters(vehicle, _OPEN_MARGIN).values():
        middle = float(quarter[1].centroid.x)
        sign = int(np.sign(moments[0] @ directions(middle)))
        if largest:
            sign = -sign
        pair = np.asarray(shapely.intersection(region.pair, quarter))
        for rotor in (0, 1):
            border = Border(Waves.of(partial(excess, rotor, sign)))
            pair = _cut(pair, border, accuracy)
        pairs.append(pair)
    word, symbol = ("largest", "≤") if largest else ("least", "≥")
    value = partial(_extreme_share, vehicle, largest)
    limit = _bound(
        "hover thrusts", symbol, share, value, " of m·g", f"{word} hover thrust"
    )
    accuracy = max(region.accuracy, accuracy)
    return region_of(_union(pairs), accuracy, *region.conditions, limit)


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

    It is nowhere above :func:`largest_least_singular_value`. Below a floor of 1e-6 `inner` keeps 1e-6. `accuracy` as for :func:`sign_region`.

    >>> [round(singular_value_region(floor).area, 3) for floor in (0.05, 0.5, 1.1, 1.2)]
    [9.138, 3.766, 0.061, 0.0]
    """
    floor, accuracy = checked_floor(floor), checked_accuracy(accuracy)
    vehicle = vehicle_named(vehicle)
    pair = _singular_value_pair(floor, vehicle, accuracy)
    return region_of(pair, accuracy, _singular_value_limit(floor, vehicle))


def _singular_value_limit(floor: float, vehicle: Vehicle) -> Condition:
    return _bound("least singular value", "≥", floor, partial(_singular_value, vehicle))


def _singular_value(vehicle: Vehicle, alpha1: float, alpha2: float) -> Any:
    return matrices.least_singular_value([alpha1, alpha2, alpha1, alpha2], vehicle)


def _singular_value_pair(
    floor: float, vehicle: Vehicle, accuracy: float, within: BaseGeometry = _SQUARE
) -> Pair:
    """Return where in a rectangle the least singular value is at least a floor."""
    if within.is_empty or floor > matrices.largest_least_singular_value(vehicle):
        return _NOWHERE
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
        border = Border(squares.scaled(-g, g**2), Waves.of(block.determinant))
        also = Border(squares.scaled(1.0, -2 * g))
        band = _negative(border, fine, also=also, around=within)
        if wide > floor:
            band[0] = shapely.Polygon()
        pair = shapely.difference(pair, band[::-1])
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
    conditions: list[Function] = []
    for rotor in (0, 1):
        upward = sign * float(level.rotors.thrust_signs[rotor])
        for errors in corners:
            thrust = _moved_form(level.inputs[rotor], errors, upward)
            if errors[rotor] > 0:  # N_i does not depend on the angle of its own rotor
                conditions.append(thrust)
            if most is not None:
                lift = _moved_form(level.direction, errors, sign * most)
                conditions.append(partial(_difference, lift, thrust))
    pair = _cut_by(conditions, pair, accuracy)

    # R is a sum of N_i times lifts: with N_i of one sign it has their sign where all lifts are positive, within 90° of
    # the upright angles.
    lifts = level.force[:2, 2] * level.rotors.thrust_signs[:2, None]
    middle = np.arctan2(lifts[:, 1], lifts[:, 0])
    reach = HALF_PI - margin
    upright = rectangle(*(middle - reach).tolist(), *(middle + reach).tolist())
    if most is None and not upright.covers(pair[1]):
        lifts_of = [_moved_form(level.direction, errors, sign) for errors in corners]
        beyond = shapely.difference(pair, upright)
        lifting = _cut_by(lifts_of, beyond, accuracy)
        pair = shapely.union(shapely.intersection(pair, upright), lifting)
    return pair


def _moved_form(form: Form, errors: FloatArray, factor: float) -> Function:
    """Return the last of some forms on red with errors of the four angles [rad], times a factor."""

    def value(alpha1: FloatArray, alpha2: FloatArray) -> FloatArray:
        points = _on_red(alpha1, alpha2) + errors
        return np.asarray(factor * form.at(Sines.of(points))[-1])

    return value


def _difference(
    first: Function, second: Function, alpha1: FloatArray, alpha2: FloatArray
) -> FloatArray:
    return first(alpha1, alpha2) - second(alpha1, alpha2)


def _cut_by(functions: Sequence[Function], pair: Pair, accuracy: float) -> Pair:
    """Return the parts of a pair where no function is negative."""
    places = np.random.default_rng(0).uniform(-HALF_PI, HALF_PI, (2, 4))
    distinct = {tuple(np.round(one(*places), 9)): one for one in functions}
    for function in distinct.values():
        pair = _cut(pair, Border(Waves.of(function)), accuracy)
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
    _checked_signs(color, sign)
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
    quarter: Quarter | None,
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
    region = region_of(_WHOLE, accuracy)
    is_separated = False
    if require == "flyable":
        quarters = QUARTERS if quarter is None else (quarter,)
        parts = [_flyable_in(one, vehicle, floor, accuracy) for one in quarters]
        pair = _union([part.pair for part in parts])
        region = region_of(pair, accuracy, *parts[0].conditions)
        # Each polygon is off R = 0, so R has one sign on it, and |R| is at least a product of four singular values, over 2κ.
        band = _BAND * level_of(rotors_of(vehicle)).rate * accuracy
        certain = floor**4 / (2 * vehicle.drag_ratio)
        is_separated = floor > max(_SEPARATING, band) and certain >= least
    pairs: list[Any] = []
    for wanted in signs:
        if is_separated:
            pairs.append([_of_sign(wanted, shape, vehicle) for shape in region.pair])
            continue
        pairs.append(shapely.intersection(region.pair, signed(wanted)))
    return region_of(_union(pairs), region.accuracy, condition, *region.conditions)


def _of_sign(sign: int, shape: MultiPolygon, vehicle: Vehicle) -> BaseGeometry:
    """Return the polygons of a shape in whose inside R has a sign on red."""
    parts = np.array(shape.geoms)
    points = shapely.point_on_surface(parts)
    labels = red_label(shapely.get_x(points), shapely.get_y(points), vehicle)
    return shapely.union_all(parts[labels.prod(axis=-1) == sign])


@lru_cache(maxsize=64)
def _flyable_in(
    quarter: Quarter, vehicle: Vehicle, floor: float, accuracy: float
) -> Region:
    """Return where in a rectangle of positive hover thrusts singular values, hover thrusts and tilts keep their limits."""
    pair = _hover_quarters(vehicle, _IDLE_MARGIN)[quarter]
    region = region_of(pair, accuracy, _hovering(vehicle))
    share = vehicle.thrust_share
    if share is not None:
        share = max(share - _DECIDED_THRUST, share / 2)
        region = _thrust_limited(region, share, vehicle, accuracy, largest=True)
    if vehicle.tilt_range is not None:
        region &= _tilt_region(vehicle.tilt_range)
    # Borders of the least singular value are drawn where the other conditions leave something alone.
    decided = floor + _DECIDED if floor > 0 else 0.0
    within = shapely.envelope(region.outer)
    pair = _singular_value_pair(decided, vehicle, accuracy, within)
    above = region_of(pair, accuracy, _singular_value_limit(decided, vehicle))
    return above & region


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
