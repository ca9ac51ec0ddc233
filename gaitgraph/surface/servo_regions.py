"""Where level flight on the red sheet bears errors of the tilt angles (docs/theory.md, 19)."""

from __future__ import annotations

import math
from functools import lru_cache, partial
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely

from gaitgraph.angles import HALF_PI, angle_within, checked_floor
from gaitgraph.errors import InputError
from gaitgraph.invertibility import error_margins
from gaitgraph.invertibility.forms import Form, Sines, level_of, rotors_of
from gaitgraph.surface.borders import Border, Waves, cut
from gaitgraph.surface.flight_regions import singular_value_region, thrust_region
from gaitgraph.surface.red_components import red_label
from gaitgraph.surface.region import (
    DEFAULT_ACCURACY,
    SQUARE,
    Pair,
    Region,
    Requirement,
    checked_accuracy,
    limit_condition,
    rectangle,
    region_of,
    union_of,
)
from gaitgraph.surface.sign_regions import checked_signs, on_red, red_sign
from gaitgraph.tolerances import DEFAULT_FLOOR
from gaitgraph.vehicle import PAPER, Angle, Vehicle, VehicleLike, vehicle_named

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.surface.borders import Function
    from gaitgraph.surface.sheets import Sign

_FINEST = 1e-5  # accuracy of the borders of a margin, which is an angle itself [rad]
_POSTURES = 33  # of each angle, among which the largest servo margin is searched


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
    `sign` is that of R, None for either. Curved borders are at most `accuracy` from their true place [rad], which counts
    as 1e-5 if it is less.

    >>> [round(servo_margin_region(angle, floor=0.0, sign="positive").area, 4) for angle in ("15deg", "22.5deg", "45deg")]
    [1.0966, 0.6169, 0.0]
    """
    signs = checked_signs("red", sign)
    margin = angle_within(margin, "servo_margin", HALF_PI, least=0.0)
    floor, accuracy = checked_floor(floor), checked_accuracy(accuracy)
    vehicle = vehicle_named(vehicle)
    accuracy = max(accuracy, _FINEST)
    bearing = [_bearing_thrusts(margin, wanted, vehicle, accuracy) for wanted in signs]
    pair = union_of(bearing)
    of_one = singular_value_region(floor, vehicle, accuracy=accuracy).pair
    for turn in product((-margin, margin), repeat=2):
        pair = shapely.intersection(pair, _moved(of_one, turn))
    limit = limit_condition(
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
    pair = np.array([nominal & red_sign(sign, vehicle, accuracy)[1]] * 2)

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

    # R is a sum of N_i times lifts: with N_i of one sign it has their sign where all lifts are positive, within 90°.
    reach = HALF_PI - margin
    upright = rectangle(-reach, -reach, reach, reach)
    if most is None and not upright.covers(pair[1]):
        lifts_of = [_moved_form(level.direction, errors, sign) for errors in corners]
        beyond = shapely.difference(pair, upright)
        lifting = _cut_by(lifts_of, beyond, accuracy)
        pair = shapely.union(shapely.intersection(pair, upright), lifting)
    return pair


def _moved_form(form: Form, errors: FloatArray, factor: float) -> Function:
    """Return the last of some forms on red with errors of the four angles [rad], times a factor."""

    def value(alpha1: FloatArray, alpha2: FloatArray) -> FloatArray:
        points = on_red(alpha1, alpha2) + errors
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
        pair = cut(pair, Border(Waves.of(function)), accuracy)
    return pair


def _moved(pair: Pair, turn: Sequence[float]) -> Pair:
    """Return polygons moved by an angle in α1 and in α2; what they are of comes again after π in each."""
    copies = []
    for whole in product((-math.pi, 0.0, math.pi), repeat=2):
        step = np.add(turn, whole)
        copies.append(shapely.transform(pair, partial(np.add, step)))
    return np.asarray(shapely.intersection(union_of(copies), SQUARE))


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
