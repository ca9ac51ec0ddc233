r"""How wrong servos and drags may be: the largest errors that a gait bears (docs/theory.md, 19).

A gait bears errors of a size if, at each of its points and for any errors up to that size, each rotor's its own, the
level matrix keeps its least singular value, and the hover thrusts are positive and within the limit of the vehicle.

The errors of one rotor move one column of the matrix. Its determinant and all of its minors are sinusoids of each angle
and linear in each drag. So on a box of errors narrower than π

* the determinant is positive if it is at the corners of the box, since a sinusoid, or a linear function, that is positive
  at both ends of an arc shorter than π is positive between them;
* each entry of the inverse is a quotient of two such functions, and largest at a corner: it is monotone in each error, or
  a constant over a function that is least at an end. The last column of the inverse are the hover thrusts.

So hover is judged exactly by the corners. The least singular value is at least one over the norm of the largest entries;
and it is at least that of the corners, less what each column deviates from a mean of its ends.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import product
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from gaitgraph.angles import HALF_PI, checked_floor, checked_number
from gaitgraph.arrays import freeze_arrays
from gaitgraph.invertibility.forms import FloatArray, Sines, level_of, rotors_of
from gaitgraph.invertibility.matrices import tilt_angles
from gaitgraph.records import Record
from gaitgraph.tolerances import DEFAULT_FLOOR
from gaitgraph.vehicle import PAPER, vehicle_named

if TYPE_CHECKING:
    import numpy.typing as npt

    from gaitgraph.invertibility.matrices import BoolArray
    from gaitgraph.vehicle import Vehicle, VehicleLike

Kind = Literal["servo", "drag"]

_ANY_THRUST = 1e100  # of m·g, the limit of a vehicle that states none
_LARGEST = {"servo": math.radians(89), "drag": 1.0}
_BISECTIONS = 45
_SLACK = 1e-9  # relative, more than rounding is off
_LONGEST = math.radians(4)  # of the first pieces of a gait, in the maximum norm
_CLOSE = 1e-3  # to what share of it a margin is found by bisection
# By what share the proven margin may miss the found one before boxes are cut.
_NEAR = 0.2
_MOST_CUTS = 2
PROOF = 0.005
"""By what share of it a size of errors may be more than what a gait is proven to bear, to be called borne."""
_POSTURES = 1024  # that are judged at once
_MOST_BOXES = 20_000  # that one proof takes
_CORNERS = np.array(list(product((-1.0, 1.0), repeat=4)))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ErrorMargin(Record):
    """The largest errors that a gait bears, of angles [rad] or of drags, relative: at least `proven`, less than `found`.

    `errors`, shape (4,), of size `found`, break the condition in `reason` at a point of the gait, at `fraction` of
    `segment`. `found` is None if no errors were found that break one, up to 89° or 100 %.
    """

    proven: float
    found: float | None
    errors: FloatArray
    segment: int
    fraction: float
    reason: str

    def __post_init__(self) -> None:
        freeze_arrays(self)


def servo_margin(
    points: npt.ArrayLike,
    vehicle: VehicleLike = PAPER,
    *,
    floor: float = DEFAULT_FLOOR,
    tolerance: float = 0.02,
) -> ErrorMargin:
    """Return the largest errors of the tilt angles that a gait bears, each angle's its own, at any time.

    Parameters
    ----------
    points
        Corners of the gait, or rows of its table, joined by straight segments, shape (m + 1, 4) [rad].
    vehicle
        Any vehicle with four tilting rotors; its largest thrust counts where it is stated.
    floor
        The least singular value to keep; without one, 0, the margin is exact to the tolerance.
    tolerance
        How far apart `proven` and `found` are, in parts of the margin, unless the floor sets them apart.

    Raises
    ------
    InputError
        If points are not finite angles of that shape, the floor is no number from 0 on, or the tolerance none up to 1.
    MissingConstant
        If the vehicle states a largest thrust without a mass.

    Examples
    --------
    >>> margin = servo_margin(np.zeros((1, 4)), PAPER, floor=0.0)
    >>> round(math.degrees(margin.found), 2), round(math.degrees(math.atan(PAPER.drag_ratio)), 2)
    (9.57, 9.57)
    """
    return _Search(points, vehicle, floor, "servo").margin(tolerance)


def drag_margin(
    points: npt.ArrayLike,
    vehicle: VehicleLike = PAPER,
    *,
    floor: float = DEFAULT_FLOOR,
    tolerance: float = 0.02,
) -> ErrorMargin:
    """Return the largest relative errors of the drag ratios that a gait bears, each rotor's its own.

    The parameters are those of :func:`servo_margin`.
    """
    return _Search(points, vehicle, floor, "drag").margin(tolerance)


def bears_servo_errors(
    points: npt.ArrayLike,
    size: float,
    vehicle: VehicleLike = PAPER,
    *,
    floor: float = DEFAULT_FLOOR,
) -> bool:
    """Return whether a gait is proven to bear errors of the tilt angles of a size [rad], to within 0.5 % of the size.

    The other parameters are those of :func:`servo_margin`, whose `proven` may be smaller: here boxes are cut as often as
    it helps. False if an error of that size breaks a condition, or if the proof would take too long.

    >>> bears_servo_errors(np.zeros((1, 4)), 0.14), bears_servo_errors(np.zeros((1, 4)), 0.15)
    (True, False)
    """
    return _Search(points, vehicle, floor, "servo").bears((1 - PROOF) * size)


def closest_servo_margin(
    points: npt.ArrayLike,
    vehicle: VehicleLike = PAPER,
    *,
    floor: float = DEFAULT_FLOOR,
) -> ErrorMargin:
    """Return :func:`servo_margin`, where possible with what is proven within 1 % of what is found; a second at most."""
    margin = servo_margin(points, vehicle, floor=floor, tolerance=PROOF)
    if margin.found is None or margin.proven >= (1 - 2 * PROOF) * margin.found:
        return margin
    size = (1 - PROOF) * margin.found
    if bears_servo_errors(points, size, vehicle, floor=floor):
        margin = replace(margin, proven=max(margin.proven, (1 - PROOF) * size))
    return margin


def servo_margins_found(
    postures: FloatArray, vehicle: Vehicle, floor: float, bisections: int = 24
) -> FloatArray:
    """Return the smallest errors that were found to break a condition at each of some postures, (k, 4), shape (k,) [rad].

    They are the `found` of :func:`servo_margin` to 89° / 2ⁿ with n `bisections`, and 89° where none breaks one.
    """
    search = _Search(postures, vehicle, floor, "servo")
    parts = np.split(postures, range(_POSTURES, len(postures), _POSTURES))
    sizes = [
        search.sizes_found(part, bisections, search.signs_at(part)) for part in parts
    ]
    return np.concatenate(sizes)


class Boxes(NamedTuple):
    """Boxes of tilt angles and of relative errors of drags: their centers and half widths, each of shape (n, 4)."""

    angle: FloatArray
    drag: FloatArray
    half_angle: FloatArray
    half_drag: FloatArray

    def at(self, chosen: Any) -> Boxes:
        """Return some of the boxes."""
        return Boxes(*(part[chosen] for part in self))

    def cut(self, kind: Kind) -> Boxes:
        """Return the 16 parts of each box that are half as wide in what errs, one box after the other."""
        angle, drag, half_angle, half_drag = (
            np.repeat(part, 16, axis=0) for part in self
        )
        sides = np.tile(_CORNERS, (len(self.angle), 1))
        if kind == "servo":
            half_angle = half_angle / 2
            angle = angle + sides * half_angle
        else:
            half_drag = half_drag / 2
            drag = drag + sides * half_drag
        return Boxes(angle, drag, half_angle, half_drag)


class _Hover:
    """What level flight needs, judged for matrices and for boxes of errors."""

    def __init__(self, vehicle: Vehicle, floor: float) -> None:
        self.level = level_of(rotors_of(vehicle))
        self.floor = floor
        self.drag_ratio = vehicle.drag_ratio
        self.most = _ANY_THRUST
        if vehicle.thrust_share is not None:
            self.most = vehicle.thrust_share

    def matrices(self, angle: FloatArray, drag: FloatArray) -> FloatArray:
        """Return level matrices at angles and relative errors of drags, both of shape (k, 4), shape (k, 4, 4)."""
        sines = Sines.of(angle)
        torque = np.einsum("ifj,jik->kfi", self.level.drag_columns, sines.u)
        return np.asarray(self.level.matrix(sines) + torque * drag[:, None])

    def broken(self, matrices: FloatArray, sign: FloatArray | float) -> BoolArray:
        """Return which of the conditions in `reasons` matrices, shape (k, 4, 4), break, shape (4, k)."""
        rows = np.moveaxis(matrices, 0, -1).copy()
        thrusts = _minors_of_last_row(rows) * sign
        lift = (thrusts * rows[3]).sum(axis=0)
        thrusts *= self.level.rotors.thrust_signs[:, None]
        gram = np.einsum("ijk,ljk->ilk", rows, rows)
        gram[range(4), range(4)] -= self.floor**2
        return np.array(
            [
                lift <= 0,
                (thrusts <= 0).any(axis=0),
                (thrusts > self.most * lift).any(axis=0),
                ~_is_positive_definite(gram) & (self.floor > 0),
            ]
        )

    @property
    def reasons(self) -> tuple[str, ...]:
        """The conditions in words."""
        return (
            "the decoupling matrix is singular",
            "a hover thrust is not positive",
            f"a hover thrust is above {self.most:.3g} of m·g",
            f"the least singular value is below {self.floor:g}",
        )

    def _inverses(self, matrices: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return inverse matrices, and the hover thrusts in units of m·g, which their last columns are."""
        singular = np.linalg.det(matrices) == 0
        inverses = np.linalg.inv(
            np.where(singular[..., None, None], np.eye(4), matrices)
        )
        inverses[singular] = 1e100
        return inverses, inverses[..., 3] * self.level.rotors.thrust_signs

    def kept(self, boxes: Boxes) -> tuple[BoolArray, BoolArray]:
        """Return whether level flight is proven possible on whole boxes, and whether it is at their corners, (n,)."""
        ends = self._ends(boxes)
        count = ends.shape[1]
        corners = np.array(list(product(range(count), repeat=4)))
        matrices = ends[:, corners, :, np.arange(4)].transpose(2, 0, 3, 1)
        determinants = np.linalg.det(matrices)
        inverses, shares = self._inverses(matrices)
        squares = np.linalg.norm(inverses, 2, axis=(-2, -1)) ** -2.0
        one_sign = (determinants * determinants[:, :1] > 0).all(axis=1)
        in_range = ((shares > 0) & (shares <= self.most)).all(axis=(1, 2))
        at_corners = one_sign & in_range & (squares.min(axis=1) >= self.floor**2)
        # What holds at the corners holds between them on arcs shorter than π.
        at_corners &= (boxes.half_angle < HALF_PI).all(axis=1)
        # One over the norm of the largest entries, turned so that one column is large where the matrix is nearly singular.
        turned = np.linalg.svd(self.matrices(boxes.angle, boxes.drag))[0]
        largest = np.abs(inverses @ turned[:, None]).max(axis=1)
        first = np.linalg.norm(largest, 2, axis=(-2, -1)) ** -2.0
        # A mean of the squares at the corners, less the spread of the columns about their means.
        apart = ends - ends.mean(axis=1, keepdims=True)
        spread = np.einsum("npri,npsi->nrs", apart, apart) * count / 4
        second = squares.min(axis=1) - np.linalg.norm(spread, 2, axis=(-2, -1))
        proven = (1 - _SLACK) * np.maximum(first, second) >= self.floor**2
        return at_corners & (proven | (self.floor == 0)), at_corners

    def _ends(self, boxes: Boxes) -> FloatArray:
        """Return the columns at the corners of what each rotor's own errors are, shape (n, 1, 2 or 4, 4, 4)."""
        tilts = [-1.0, 1.0] if boxes.half_angle.any() else [0.0]
        drags = [-1.0, 1.0] if boxes.half_drag.any() else [0.0]
        ends = []
        for tilt, drag in product(tilts, drags):
            angle = boxes.angle + tilt * boxes.half_angle
            ends.append(self.matrices(angle, boxes.drag + drag * boxes.half_drag))
        return np.stack(ends, axis=1)


class _Found(NamedTuple):
    """Errors of a size that break the condition in `reason`, if any, at a place of the gait counted in segments."""

    size: float
    at: float
    errors: FloatArray
    reason: str


class _Search:
    """The search for the margin of a gait, a polyline in parts that are halved where they do not bear enough."""

    def __init__(
        self, points: npt.ArrayLike, vehicle: VehicleLike, floor: float, kind: Kind
    ) -> None:
        self.points = tilt_angles(points).reshape(-1, 4)
        self.hover = _Hover(vehicle_named(vehicle), checked_floor(floor))
        self.kind = kind
        self.sign = float(self.signs_at(self.points[:1])[0])

    def signs_at(self, points: FloatArray) -> FloatArray:
        """Return the sign of R at points, shape (k,)."""
        matrices = self.hover.matrices(points, np.zeros_like(points))
        return np.asarray(np.sign(np.linalg.det(matrices)))

    def margin(self, tolerance: float) -> ErrorMargin:
        """Return the margin; see :func:`servo_margin`."""
        allowed = "a number above 0, at most 1"
        tolerance = checked_number(
            "tolerance", tolerance, allowed, above=True, most=1.0
        )
        # An error of the drag is worth one of the angle that is smaller by the drag ratio.
        scale = 1.0 if self.kind == "servo" else self.hover.drag_ratio
        parts = self._first_parts()
        least = self._found(np.unique(parts))
        while least.size:
            target = least.size
            if least.reason:
                target *= 1 - tolerance
            parts = parts[~self._kept(parts, target)]
            if not len(parts) or self._half_width(parts) <= tolerance * target * scale:
                break
            parts = _halved(parts)
            least = min(least, self._found(parts[::2, 1]), key=lambda one: one.size)
        proven = target if least.size else 0.0
        if len(parts) and proven:
            proven = self._proven(parts, target)
        segment = min(int(least.at), max(len(self.points) - 2, 0))
        return ErrorMargin(
            proven=proven,
            found=least.size if least.reason else None,
            errors=least.errors,
            segment=segment,
            fraction=least.at - segment,
            reason=least.reason,
        )

    def bears(self, size: float) -> bool:
        """Return whether the gait is proven to bear errors of a size."""
        # Parts of the gait are halved until they are short beside what the proof may miss.
        parts = self._first_parts()
        while True:
            parts = parts[~self._kept(parts, size)]
            if not len(parts):
                return True
            at_ends = self._at(np.unique(parts))
            boxes = self._boxes(at_ends, np.zeros_like(at_ends), size)
            _, at_corners = self.hover.kept(boxes)
            if not at_corners.all():
                return False
            if self._half_width(parts) <= PROOF / 2 * size:
                break
            parts = _halved(parts)
        # Then boxes are cut where they are not proven, which is near few corners.
        boxes = self._boxes(*self._hulls(parts), size)
        left = _MOST_BOXES
        while len(boxes.angle) <= left:
            left -= len(boxes.angle)
            kept, at_corners = self.hover.kept(boxes)
            if not at_corners.all():
                return False
            if kept.all():
                return True
            boxes = boxes.at(~kept).cut("servo")
        return False

    def _first_parts(self) -> FloatArray:
        """Return the ends of parts of similar length, in segments, shape (k, 2)."""
        sizes = np.abs(np.diff(self.points, axis=0)).max(axis=1)
        passed = np.append(0.0, np.cumsum(sizes))
        count = max(math.ceil(passed[-1] / _LONGEST), 1)
        limits = np.interp(
            np.linspace(0.0, passed[-1], count + 1), passed, np.arange(len(passed))
        )
        return np.column_stack([limits[:-1], limits[1:]])

    def _at(self, places: FloatArray) -> FloatArray:
        """Return the points at places counted in segments, shape (k, 4)."""
        whole = np.minimum(places.astype(int), max(len(self.points) - 2, 0))
        following = self.points[np.minimum(whole + 1, len(self.points) - 1)]
        share = (places - whole)[:, None]
        return np.asarray(self.points[whole] * (1 - share) + following * share)

    def _hulls(self, parts: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the centers and the half widths of the smallest boxes around parts, both of shape (k, 4)."""
        low = np.minimum(*(self._at(ends) for ends in parts.T))
        high = np.maximum(*(self._at(ends) for ends in parts.T))
        for k, (start, end) in enumerate(parts):
            inside = self.points[math.ceil(start) : math.floor(end) + 1]
            low[k] = np.minimum(low[k], inside.min(axis=0, initial=math.inf))
            high[k] = np.maximum(high[k], inside.max(axis=0, initial=-math.inf))
        return (low + high) / 2, (high - low) / 2

    def _half_width(self, parts: FloatArray) -> float:
        return float(self._hulls(parts)[1].max())

    def _kept(self, parts: FloatArray, size: float, cuts: int = 0) -> BoolArray:
        """Return whether parts are proven to bear errors of a size, boxes being cut some times, shape (k,)."""
        return self._are_kept(self._boxes(*self._hulls(parts), size), cuts)

    def _boxes(self, center: FloatArray, half: FloatArray, size: float) -> Boxes:
        """Return boxes of postures, of which errors of a size are wider."""
        zero = np.zeros_like(center)
        if self.kind == "servo":
            return Boxes(center, zero, half + size, zero)
        return Boxes(center, zero, half, zero + size)

    def _are_kept(self, boxes: Boxes, cuts: int) -> BoolArray:
        kept, at_corners = self.hover.kept(boxes)
        open_ = np.flatnonzero(at_corners & ~kept)
        if cuts and open_.size:
            parts = self._are_kept(boxes.at(open_).cut(self.kind), cuts - 1)
            kept[open_] = parts.reshape(-1, 16).all(axis=1)
        return kept

    def _proven(self, parts: FloatArray, most: float) -> float:
        """Return the largest size, up to some, of which the errors are proven to be borne by parts."""
        for cuts in range(_MOST_CUTS + 1):
            low, high, open_ = 0.0, most, parts
            while high - low > _CLOSE * most:
                middle = (low + high) / 2
                kept = self._kept(open_, middle, cuts)
                if kept.all():
                    low = middle
                else:
                    high, open_ = middle, open_[~kept]  # the others bear any less
            if low >= (1 - _NEAR) * most:
                break
        return low

    def _found(self, places: FloatArray) -> _Found:
        """Return the smallest errors, of the corners of boxes, that were found to break a condition at some places."""
        points = self._at(places)
        sizes = self.sizes_found(points, _BISECTIONS, self.sign)
        worst = int(sizes.argmin())
        size = float(sizes[worst])
        beyond = size
        if size < _LARGEST[self.kind]:
            beyond *= 1 + _SLACK  # rounding hides it at the size itself
        broken = self._broken(points[[worst]], np.array([beyond]), self.sign)[:, 0]
        if not broken.any():
            return _Found(size, float(places[worst]), np.zeros(4), "")
        corner = int(broken.any(axis=0).argmax())
        reason = self.hover.reasons[int(broken[:, corner].argmax())]
        return _Found(size, float(places[worst]), size * _CORNERS[corner], reason)

    def sizes_found(
        self, points: FloatArray, bisections: int, sign: FloatArray | float
    ) -> FloatArray:
        """Return the smallest errors of corners of boxes that break a condition at points (k, 4), shape (k,).

        R has the `sign`, at each or at all of them.
        """
        low = np.zeros(len(points))
        high = np.full(len(points), _LARGEST[self.kind])
        middle = low
        for _ in range(bisections + 1):
            is_broken = self._broken(points, middle, sign).any(axis=(0, 2))
            high = np.where(is_broken, middle, high)
            low = np.where(is_broken, low, middle)
            middle = (low + high) / 2
        return high

    def _broken(
        self, points: FloatArray, sizes: FloatArray, sign: FloatArray | float
    ) -> BoolArray:
        """Return which conditions the corners of boxes around points break, shape (4, k, 16)."""
        angle = np.repeat(points, 16, axis=0)
        errors = (sizes[:, None, None] * _CORNERS).reshape(-1, 4)
        drag = np.zeros_like(errors)
        if self.kind == "servo":
            angle += errors
        else:
            drag = errors
        signs = np.repeat(np.broadcast_to(sign, len(points)), 16)
        broken = self.hover.broken(self.hover.matrices(angle, drag), signs)
        return broken.reshape(4, -1, 16)


def _minors_of_last_row(rows: FloatArray) -> FloatArray:
    """Return the cofactors of the last row of matrices, shape (4, 4, k), shape (4, k)."""
    cofactors = []
    for column in range(4):
        a, b, c = np.delete(rows[:3], column, axis=1)
        minor = (np.cross(a, b, axis=0) * c).sum(axis=0)
        cofactors.append(minor * (-1) ** (column + 1))
    return np.array(cofactors)


def _is_positive_definite(matrices: FloatArray) -> BoolArray:
    """Return whether symmetric matrices, shape (4, 4, k), are positive definite: by elimination, shape (k,)."""
    rest = matrices
    holds: BoolArray = np.ones(matrices.shape[2], dtype=bool)
    while len(rest):
        holds = np.asarray(holds & (rest[0, 0] > 0))
        pivot = np.where(holds, rest[0, 0], 1.0)
        rest = rest[1:, 1:] - rest[1:, :1] * rest[:1, 1:] / pivot
    return holds


def _halved(parts: FloatArray) -> FloatArray:
    """Return the halves of parts, one after the other, cut at a corner of the gait if one is inside."""
    middle = parts.mean(axis=1)
    corner = np.rint(middle)
    is_inside = (corner > parts[:, 0]) & (corner < parts[:, 1])
    middle = np.where(is_inside, corner, middle)
    halves = np.stack([parts[:, 0], middle, middle, parts[:, 1]], axis=1)
    return np.asarray(halves.reshape(-1, 2))
