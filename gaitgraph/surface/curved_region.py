"""Where any four rotors can fly on their sheet: squares of the (α1, α2) plane that are proven, small ones at the border.

On a square around a point a form in u1 and u2 changes by its slopes there and by its waves, a column of the level
matrix by its length and the change of its angle, and no singular value by more than the matrix (docs/theory.md, 18). A
square that is neither proven to fly nor not to is cut in four, down to the accuracy.
"""

from __future__ import annotations

import math
from functools import lru_cache, partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import shapely

from gaitgraph.angles import HALF_PI, angle_within, checked_floor
from gaitgraph.errors import checked_choice
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.invertibility.forms import level_of, rotors_of
from gaitgraph.invertibility.matrices import least_singular_value, level_determinant
from gaitgraph.invertibility.segment_bounds import (
    Points,
    segments_fly,
    singular_quantity,
)
from gaitgraph.surface.curved import sheet_of
from gaitgraph.surface.region import Condition, Region, region_of
from gaitgraph.surface.sheets import RELATION, SIGNS
from gaitgraph.tolerances import DEFAULT_FLOOR
from gaitgraph.vehicle import PAPER, vehicle_named

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.invertibility.matrices import BoolArray
    from gaitgraph.surface.sheets import Sign
    from gaitgraph.vehicle import Vehicle, VehicleLike

_SQUARES = 32  # across [−π/2, π/2], before they are cut


def sheet_region(
    vehicle: VehicleLike = PAPER,
    *,
    sign: Sign | None = "positive",
    floor: float = DEFAULT_FLOOR,
    accuracy: float = 0.01,
) -> Region:
    """Return where a vehicle of any four rotors can fly on its sheet, as squares whose sides are above a third of `accuracy`.

    There its hover thrusts are positive and within `max_thrust`, its tilts within their ranges and ±π/2, R has the
    `sign`, either for None, and the least singular value of the level matrix is at least `floor`. `inner` is proven; what is between it
    and `outer` is undecided, along borders mostly as wide as the accuracy.

    >>> region = sheet_region("paper", accuracy=0.02)
    >>> region.contains([(-0.4, 0.4), (0.5, -0.5)]).tolist(), region.inner.within(region.outer)
    ([True, False], True)
    """
    vehicle = vehicle_named(vehicle)
    if sign is not None:
        checked_choice("sign", sign, SIGNS)
    floor = checked_floor(floor)
    # A tenth of it takes ten times the squares: a thousandth of a radian takes some seconds.
    accuracy = angle_within(accuracy, "accuracy", 0.1, least=1e-3)
    return _region(vehicle, sign, floor, accuracy)


@lru_cache(maxsize=32)
def _region(
    vehicle: Vehicle, sign: Sign | None, floor: float, accuracy: float
) -> Region:
    inside, undecided, unit = _squares(vehicle, floor, accuracy)
    if sign is not None:
        wanted = 1 if sign == "positive" else -1
        inside = inside.at(inside.signs == wanted)
        undecided = undecided.at(undecided.signs != -wanted)
    inner = _union(inside.sides, unit)
    outer = _union(np.concatenate([inside.sides, undecided.sides]), unit)
    name = f"hover thrusts in range · tilts in range · least singular value ≥ {floor:g}"
    broken_at = partial(_Conditions(vehicle, floor).broken_at, sign)
    return region_of(
        [inner, outer], accuracy, Condition(name=name, broken_at=broken_at)
    )


class _Squares(NamedTuple):
    """Squares: their least and their largest α1 and α2, shape (m, 4) [rad], and the sign of R on them, 0 if unknown."""

    sides: FloatArray
    signs: FloatArray

    def at(self, chosen: BoolArray) -> _Squares:
        """Return some of the squares."""
        return _Squares(self.sides[chosen], self.signs[chosen])


@lru_cache(maxsize=32)
def _squares(
    vehicle: Vehicle, floor: float, accuracy: float
) -> tuple[_Squares, _Squares, float]:
    """Return the squares on which all conditions hold, the small ones that are not decided, and a divisor of their sides."""
    conditions = _Conditions(vehicle, floor)
    reach = HALF_PI / _SQUARES
    line = np.linspace(-HALF_PI, HALF_PI, 2 * _SQUARES + 1)[1::2]
    centers = np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)
    quarters = np.array([[-1, -1], [-1, 1], [1, -1], [1, 1]]) / 2
    inside = []
    while True:
        holds, fails, signs = conditions.decided(centers, reach)
        squares = _Squares(np.hstack([centers - reach, centers + reach]), signs)
        inside.append(squares.at(holds))
        is_open = ~holds & ~fails
        if 3 * reach < accuracy or not is_open.any():
            break
        centers = (centers[is_open, None] + quarters * reach).reshape(-1, 2)
        reach /= 2
    held = _Squares(*map(np.concatenate, zip(*inside, strict=True)))
    return held, squares.at(is_open), 2 * reach


def reached_from_hover(
    plane: FloatArray, vehicle: VehicleLike, floor: float
) -> tuple[bool | None, str]:
    """Return whether a flyable path on the sheet joins hover to one of some (α1, α2), shape (n, 2), and the reason.

    Hover is the point of the sheet above (0, 0). None if no path is found, which is no proof that there is none. The
    straight path to the nearest point is tried first.
    """
    vehicle = vehicle_named(vehicle)
    unknown = "not decided whether a flight from hover can enter the gait"
    reason = _Conditions(vehicle, floor).broken_at("positive", 0.0, 0.0)
    if reason is not None:
        return None, f"{unknown}: hover on the sheet cannot fly: {reason}"
    nearest = plane[np.linalg.norm(plane, axis=1).argmin()]
    way = sheet_of(rotors_of(vehicle)).chords(np.zeros((1, 2)), nearest[None])
    is_reached = len(way.starts) > 0
    is_reached &= bool(segments_fly(way.starts, way.ends, floor, vehicle).all())
    if not is_reached:
        region = sheet_region(vehicle, floor=floor)
        home = region.component_of((0.0, 0.0))
        if home is not None:
            points = shapely.points(plane)
            covered = shapely.covers(region.components[home], points)
            is_reached = bool(covered.any())
    if not is_reached:
        return None, f"{unknown}: no flyable path on the sheet was found"
    return True, "a flyable path on the sheet joins it to hover"


def _union(sides: FloatArray, unit: float) -> BaseGeometry:
    """Return the union of squares that do not overlap, whose sides are multiples of a unit.

    The squares are drawn on a grid of that unit, so that no gap is left between them. A rectangle for each run of
    covered cells is united much quicker than the squares.
    """
    count = round(math.pi / unit)
    left, bottom, right, top = np.rint((sides.T + HALF_PI) / unit).astype(int)
    corners = np.zeros((count + 1, count + 1), dtype=np.int8)
    np.add.at(corners, (left, bottom), 1)
    np.add.at(corners, (right, top), 1)
    np.add.at(corners, (left, top), -1)
    np.add.at(corners, (right, bottom), -1)
    covered = corners.cumsum(axis=0, dtype=np.int8).cumsum(axis=1, dtype=np.int8)
    ends = np.diff(covered, axis=1, prepend=0)
    column, first = np.nonzero(ends == 1)
    _, last = np.nonzero(ends == -1)
    runs = np.array([column, first, column + 1, last]) - count // 2
    return shapely.union_all(shapely.box(*(unit * runs)))


class _Conditions:
    """The conditions of level flight on the sheet, on squares of the (α1, α2) plane."""

    def __init__(self, vehicle: Vehicle, floor: float) -> None:
        rotors = rotors_of(vehicle)
        self.vehicle = vehicle
        self.floor = floor
        self.coefficients = coefficients_of(vehicle, "exact")
        self.sheet = sheet_of(rotors)
        self.rates = level_of(rotors).rates
        self.singular_value = singular_quantity(vehicle)
        self.largest_thrust = vehicle.thrust_share
        ranges = np.array(vehicle.tilt_range or [[-HALF_PI, HALF_PI]] * 4)
        self.ranges = np.clip(ranges, -HALF_PI, HALF_PI)
        # Forms that have the sign of ρ: ρ itself, and those of rotors 3 and 4 within their ranges.
        forms = [self.sheet.lift]
        for rotor, (low, high) in zip((3, 4), self.ranges[2:], strict=True):
            forms.append(self.sheet.tilt_border(rotor, low))
            forms.append(-self.sheet.tilt_border(rotor, high))
        self.forms = np.array(forms)

    def broken_at(self, sign: Sign | None, alpha1: float, alpha2: float) -> str | None:
        """Return why a point is not in the region of a sign of R, with numbers, or None if it is."""
        alpha = np.array([alpha1, alpha2, *self.sheet.angles(alpha1, alpha2)])
        R = float(level_determinant(alpha, self.coefficients))
        has_sign = {"positive": R > 0, "negative": R < 0}.get(str(sign), R != 0)
        if not has_sign:
            relation = RELATION.get(str(sign), "R ≠ 0")
            return f"R at level attitude must be {relation[2:]}, got {R:.4g}"
        size = float(least_singular_value(alpha, self.vehicle))
        if not size >= self.floor:
            return f"least singular value must be ≥ {self.floor:g}, got {size:.4g}"
        thrusts = self.sheet.hover_thrusts(alpha1, alpha2)
        if thrusts.min() <= 0:
            return f"hover thrusts must be positive, got {thrusts.min():.4g} of m·g"
        largest = self.largest_thrust
        if largest is not None and thrusts.max() > largest:
            return (
                f"hover thrusts must be ≤ {largest:.4g} of m·g, got {thrusts.max():.4g}"
            )
        low, high = self.ranges.T
        for rotor in np.flatnonzero((alpha < low) | (alpha > high)):
            got = f"{math.degrees(alpha[rotor]):.4g}°"
            return f"α{rotor + 1} must be within the range of its arm, got {got}"
        return None

    def decided(
        self, centers: FloatArray, reach: float
    ) -> tuple[BoolArray, BoolArray, FloatArray]:
        """Return on which squares around centers, shape (m, 2), all conditions hold, on which one fails, and the sign of R.

        All have the shape (m,). The sign is 0 where it is not known.
        """
        values, changes = self._forms_on(centers, reach)
        sign = np.sign(values[0])
        least = (sign * values - changes).min(axis=0)
        # Where ρ has one sign on the square, so has what fails.
        fails = ((sign * values + changes)[1:] < 0).any(axis=0)
        fails &= np.abs(values[0]) > changes[0]
        low, high = self.ranges[:2].T
        least = np.minimum(least, (centers - reach - low).min(axis=1) + 1e-12)
        least = np.minimum(least, (high - centers - reach).min(axis=1) + 1e-12)
        fails |= (centers + reach < low).any(axis=1) | (centers - reach > high).any(
            axis=1
        )

        holds = np.zeros(len(centers), dtype=bool)
        signs = np.zeros(len(centers))
        left = np.flatnonzero(~fails)
        centers, least = centers[left], least[left]
        opposite = self.sheet.changes_within(centers[:, 0], centers[:, 1], reach)
        alpha = np.hstack([centers, self.sheet.angles(*centers.T)])
        turned = np.hstack([np.full(centers.shape, reach), opposite])
        change = np.linalg.norm(self.rates * turned, axis=1)
        size, _ = self.singular_value.up_to(Points(alpha), self.floor + change)
        R = level_determinant(alpha, self.coefficients)
        # An angle that turns by π turns the sign of R, without which R keeps it where the matrix is invertible.
        signs[left] = np.sign(R) * ((least > 0) & (size > change))
        holds[left] = (signs[left] != 0) & (size - change >= self.floor)
        fails[left] = size + change < self.floor
        return holds, fails, signs

    def _forms_on(
        self, centers: FloatArray, reach: float
    ) -> tuple[FloatArray, FloatArray]:
        """Return what must have the sign of ρ at centers, and how much it changes on squares around them, shape (k, m)."""
        u, turned = (
            np.stack([np.cos(angles), np.sin(angles)])
            for angles in (centers.T, centers.T + math.pi / 2)
        )
        tables = self.forms.reshape(-1, 4)
        values, by_first, by_second = (
            tables @ (first[:, None] * second).reshape(4, -1)
            for first, second in (
                (u[:, 0], u[:, 1]),
                (turned[:, 0], u[:, 1]),
                (u[:, 0], turned[:, 1]),
            )
        )
        # A form is at most its Frobenius norm, and so is each of its second derivatives.
        bend = 2 * np.linalg.norm(self.forms, axis=(1, 2))[:, None] * reach**2
        changes = reach * (np.abs(by_first) + np.abs(by_second)) + bend
        own = np.einsum("xa,axm->xm", self.sheet.inputs, u[:, ::-1])
        slopes = np.einsum("xa,axm->xm", self.sheet.inputs, turned[:, ::-1])
        bend = np.linalg.norm(self.sheet.inputs, axis=1)[:, None] * reach**2 / 2
        own_changes = reach * np.abs(slopes) + bend
        conditions, bounds = [values, own], [changes, own_changes]
        if self.largest_thrust is not None:
            lengths, shortened = self.sheet.lengths_within(
                centers[:, 0], centers[:, 1], reach
            )
            opposite = np.sign(values[0]) * lengths.T
            thrusts = np.concatenate([own, opposite])
            conditions.append(self.largest_thrust * values[0] - thrusts)
            moved = np.concatenate([own_changes, shortened.T])
            bounds.append(self.largest_thrust * changes[0] + moved)
        return np.concatenate(conditions), (1 + 1e-9) * np.concatenate(bounds)
