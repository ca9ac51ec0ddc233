r"""Where a gait may be: regions of the (α1, α2) plane as polygons, and what can be asked of them.

On a sheet a straight line in (α1, α2) is straight in all four angles, so a loop in the plane is a gait, and where it
may go is plane geometry. Straight borders are exact. Curved ones are known in closed form
(:mod:`gaitgraph.outlines`) and followed by certified chords (:mod:`gaitgraph.borders`); a :class:`Region` holds two
polygons: `inner`, which certainly lies in the region, and `outer`, which certainly encloses it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import HALF_PI, number_of
from gaitgraph.errors import InputError, shown
from gaitgraph.invertibility import (
    Coefficients,
    coefficients_of,
    hover_thrust_shares,
    least_singular_value_on_red,
    level_determinant,
    noise_of,
)
from gaitgraph.outlines import (
    blue_determinant_below,
    bracket_negative,
    determinant_below,
    mirrored,
    thrust_above,
    weak_block,
)
from gaitgraph.regions import red_label
from gaitgraph.segments import least_level_determinant
from gaitgraph.surface import COLORS, Color, sheet_angles
from gaitgraph.vehicle import PAPER, Vehicle

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from shapely import MultiPolygon, Polygon
    from shapely.geometry.base import BaseGeometry

    from gaitgraph.regions import Zones

__all__ = [
    "DEFAULT_ACCURACY",
    "Condition",
    "Region",
    "SignComponent",
    "admissible_region",
    "certain_determinant",
    "hover_region",
    "sign_components",
    "sign_region",
    "singular_value_region",
    "thrust_region",
    "tilt_region",
    "zones_region",
]

FloatArray = npt.NDArray[np.float64]
Use = Literal["valid", "flyable"]
Sign = Literal["positive", "negative"]

DEFAULT_ACCURACY = 1e-6
"""How far a border of a region may be from where it truly is [rad]."""

_TOUCH = 1e-12  # what overlaying polygons may round off
_OPEN = 1e-9  # how far inside an open condition its straight border is drawn
_FOLLOWED = 0.45  # how far from a curved border its chords may be, as a share of the accuracy
_SEPARATING = 1e-6  # a floor that keeps polygons off R = 0 beyond rounding
# What is closer to its limit than this is not decided along segments, and counts as beyond it.
_DECIDED = 1.5e-6  # singular values; see segments.keeps_singular_value_above
_DECIDED_THRUST = 1.5e-4  # shares of the weight; see segments.thrust_shares_along
_COARSEST = 1e-3  # coarser chords would save nothing
_EPSILON = float(np.finfo(float).eps)
_SIGNS: dict[str, int] = {"positive": 1, "negative": -1}


@dataclass(frozen=True, slots=True, kw_only=True)
class Condition:
    """One of the conditions of a region.

    Parameters
    ----------
    name
        What has to hold.
    broken_at
        What is the case at a point (α1, α2) [rad], in words and numbers, if the condition does not hold; else None.
    """

    name: str
    broken_at: Callable[[float, float], str | None] = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class Region:
    """A region of the (α1, α2) plane of one sheet, between two polygons.

    `inner` never leaves the region, `outer` never falls short of it. What is asked of a region is answered by `inner`,
    so that what it contains certainly is in the region. ``&`` intersects two regions.

    Parameters
    ----------
    inner
        Usable points, borders included [rad]. A straight border is exact, or 1e-9 inside if the condition excludes it;
        a curved one is at most `accuracy` inside.
    outer
        Encloses the region; its curved borders are at most `accuracy` outside.
    accuracy
        [rad]; zero if no border is curved. It bounds the distance from each border. Where two borders meet at an acute
        angle the corner may recede farther, and a passage not wider than twice the accuracy may be closed.
    conditions
        What was intersected.

    Attributes
    ----------
    components
        The polygons of `inner`, the largest first, then by centroid. Polygons that only touch at points are separate.

    Examples
    --------
    >>> region = admissible_region(sign="positive")
    >>> len(region.components), region.joined((0.1, 0.2), (-1.0, 1.0)), region.joined((0.1, 0.2), (1.5, -1.5))
    (2, True, False)
    >>> region.nearest((0.1, 0.2)), region.component_of((0.5, -0.5))
    ((0.1, 0.2), None)
    """

    inner: MultiPolygon
    outer: MultiPolygon
    accuracy: float
    conditions: tuple[Condition, ...] = ()
    components: tuple[Polygon, ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        import shapely

        parts = sorted(self.inner.geoms, key=lambda part: (-part.area, part.centroid.x, part.centroid.y))
        shapely.prepare(self.inner)
        shapely.prepare(parts)
        object.__setattr__(self, "components", tuple(parts))

    @property
    def area(self) -> float:
        """Area of `inner` [rad²]."""
        return float(self.inner.area)

    def contains(self, points: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        """Return whether each point is in `inner`, for points of shape (m, 2) [rad].

        What rounding puts beside an oblique border, up to 1e-12, counts as on it.
        """
        import shapely

        asked: Any = shapely.points(_points(points))
        inside = np.asarray(shapely.covers(self.inner, asked))
        inside[~inside] = shapely.dwithin(self.inner, asked[~inside], _TOUCH)
        return inside

    def component_of(self, point: npt.ArrayLike) -> int | None:
        """Return the index in `components` of the one that holds a point (α1, α2) [rad], or None."""
        import shapely

        if not self.components:
            return None
        distances = shapely.distance(np.array(self.components, dtype=object), shapely.Point(_points(point)[0]))
        nearest = int(np.argmin(distances))
        return nearest if distances[nearest] <= _TOUCH else None

    def joined(self, first: npt.ArrayLike, second: npt.ArrayLike) -> bool:
        """Return whether a path inside `inner` joins two points [rad], that is, whether one component holds both."""
        component = self.component_of(first)
        return component is not None and component == self.component_of(second)

    def nearest(self, point: npt.ArrayLike) -> tuple[float, float] | None:
        """Return the point of `inner` nearest to a point in the plane [rad], itself if it is in; None if all is empty.

        Distances in the four angles are √2 times as long as in the plane of a sheet, so it is the nearest there too.
        """
        import shapely

        if not self.components:
            return None
        asked = _points(point)[0]
        if self.contains(asked)[0]:
            return float(asked[0]), float(asked[1])
        line = shapely.shortest_line(self.inner, shapely.Point(asked))
        found = shapely.get_coordinates(line)[0]
        return float(found[0]), float(found[1])

    def why_not(self, point: npt.ArrayLike) -> str | None:
        """Return what excludes a point (α1, α2) [rad], with numbers, or None if it is in `inner`.

        >>> admissible_region(sign="positive").why_not((0.5, -0.5))
        'R = -6.336 at level attitude, wanted is R ≥ 0.0035'
        """
        asked = _points(point)[0]
        if self.contains(asked)[0]:
            return None
        told = [condition.broken_at(float(asked[0]), float(asked[1])) for condition in self.conditions]
        broken = [text for text in told if text is not None]
        return "; ".join(broken) or f"closer to the border than the accuracy of the region ({self.accuracy:.1g} rad)"

    def __and__(self, other: Region) -> Region:
        return Region(
            inner=_many(self.inner.intersection(other.inner)),
            outer=_many(self.outer.intersection(other.outer)),
            accuracy=max(self.accuracy, other.accuracy),
            conditions=self.conditions + other.conditions,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class SignComponent:
    """A component of R ≠ 0 on the red sheet inside [−π/2, π/2]².

    Parameters
    ----------
    label
        The signs of cos β1, cos β2 and the bracket; see :func:`gaitgraph.regions.red_label`.
    sign
        The sign of R, their product.
    region
        Where it is.
    """

    label: tuple[int, int, int]
    sign: int
    region: Region


def _points(points: npt.ArrayLike) -> FloatArray:
    """Return finite points, shape (m, 2)."""
    try:
        out = np.asarray(points, dtype=float)
    except (TypeError, ValueError) as error:
        raise InputError(f"point: {shown(points)}; allowed are (alpha1, alpha2) in radians") from error
    if out.ndim not in (1, 2) or out.shape[-1] != 2 or not np.isfinite(out).all():
        raise InputError(f"point: {shown(points)}; allowed are finite (alpha1, alpha2) in radians, shape (m, 2)")
    return out.reshape(-1, 2)


def _many(shape: BaseGeometry) -> MultiPolygon:
    """Return the polygons of a shape, without the points and lines that overlaying leaves."""
    import shapely

    parts = shapely.get_parts(shapely.get_parts(np.array([shape], dtype=object)))
    return shapely.MultiPolygon([part for part in parts if part.geom_type == "Polygon" and part.area > 0])


def _box(left: float, bottom: float, right: float, top: float) -> Polygon:
    import shapely

    return shapely.box(left, bottom, right, top) if left < right and bottom < top else shapely.Polygon()


def _square(size: float = HALF_PI) -> Polygon:
    return _box(-size, -size, size, size)


def _moved(shape: BaseGeometry, distance: float) -> BaseGeometry:
    """Return a polygon with its border moved outward (or inward, if negative)."""
    return shape.buffer(distance, join_style="mitre")


def _without(forbidden: BaseGeometry, domain: BaseGeometry, reach: float) -> tuple[BaseGeometry, BaseGeometry]:
    """Return inner and outer polygons of a domain without a set that is known to within `reach`."""
    return domain.difference(_moved(forbidden, reach)), domain.difference(_moved(forbidden, -reach))


def _only(condition: Condition, inner: BaseGeometry, outer: BaseGeometry, accuracy: float) -> Region:
    return Region(inner=_many(inner), outer=_many(outer), accuracy=accuracy, conditions=(condition,))


def _checked_accuracy(accuracy: float) -> float:
    if not 1e-9 <= number_of(accuracy) <= 0.1:
        raise InputError(f"accuracy: {shown(accuracy)}; allowed is 1e-9 to 0.1 (rad)")
    return float(accuracy)


def _checked(name: str, value: object, allowed: str, *, zero: bool = False) -> float:
    number = number_of(value)
    if not 0 <= number < math.inf or (number == 0 and not zero):
        raise InputError(f"{name}: {shown(value)}; allowed is {allowed}")
    return number


def _checked_sign(sign: object) -> int:
    if not isinstance(sign, str) or sign not in _SIGNS:
        raise InputError(f"sign: {shown(sign)}; allowed are 'positive' and 'negative'")
    return _SIGNS[sign]


def _tolerance(accuracy: float) -> float:
    return min(_FOLLOWED * accuracy, _COARSEST)


def _determinant_condition(sign: int, least: float, color: Color, coefficients: Coefficients) -> Condition:
    wanted = f"R {'≥' if sign > 0 else '≤'} {sign * least:.2g}" if least > 0 else f"R {'>' if sign > 0 else '<'} 0"

    def broken_at(alpha1: float, alpha2: float) -> str | None:
        third, fourth = sheet_angles(color, alpha1, alpha2, coefficients)
        value = float(level_determinant([alpha1, alpha2, float(third), float(fourth)], coefficients))
        if sign * value >= least and value != 0:
            return None
        return f"R = {value:.4g} at level attitude, wanted is {wanted}"

    return Condition(name=wanted, broken_at=broken_at)


def sign_components(vehicle: Vehicle = PAPER, *, accuracy: float = DEFAULT_ACCURACY) -> tuple[SignComponent, ...]:
    """Return the components of R ≠ 0 on the red sheet inside [−π/2, π/2]², with exact coefficients: seven.

    They are told apart by the signs of the three factors of R. A grid of signs of R cannot tell them apart: it joins
    them across the two saddles, where a line and the curve cross and R vanishes to second order.

    Parameters
    ----------
    vehicle
        All that counts is κ and the spin sense.
    accuracy
        How far the curved borders may be from where they are [rad], 1e-9 to 0.1. R = 0 is excluded: `inner` keeps
        1e-9 from straight borders.

    Examples
    --------
    >>> [(part.sign, round(part.region.area, 3)) for part in sign_components()]
    [(1, 4.465), (-1, 4.383), (-1, 0.484), (1, 0.013), (-1, 0.484), (1, 0.013), (1, 0.028)]
    """
    return _components(vehicle, _checked_accuracy(accuracy), _OPEN)


def _components(vehicle: Vehicle, accuracy: float, margin: float) -> tuple[SignComponent, ...]:
    """Return the components, those of `inner` with a margin to straight borders."""
    kappa = vehicle.signed_drag_ratio
    delta = math.atan(kappa)
    spin = 1 if kappa > 0 else -1
    edge = spin * HALF_PI
    exact = coefficients_of(vehicle, "exact")
    negative = bracket_negative(kappa, _tolerance(accuracy))
    # The bracket vanishes in two corners of the square too.
    corners = _union(
        _box(
            side * HALF_PI - accuracy / 2,
            -side * HALF_PI - accuracy / 2,
            side * HALF_PI + accuracy / 2,
            -side * HALF_PI + accuracy / 2,
        )
        for side in (1, -1)
    )
    wide, narrow = _moved(negative, accuracy / 2), _moved(negative, -accuracy / 2)
    found = []
    for first in (1, -1):
        for second in (1, -1):
            inner_cell, outer_cell = (_cell(delta - edge, first * spin, second * spin, kept) for kept in (margin, 0.0))
            for third in (1, -1):
                # The third sign is positive on the side of α = 0, whichever way the rotors spin.
                if third * spin > 0:
                    inner, outer = inner_cell.difference(wide), outer_cell.difference(narrow)
                else:
                    inner, outer = inner_cell.intersection(narrow), outer_cell.intersection(wide)
                inner = inner.difference(corners)
                if inner.is_empty:
                    continue
                sign = first * second * third
                region = _only(_determinant_condition(sign, 0.0, "red", exact), inner, outer, accuracy)
                found.append(SignComponent(label=(first, second, third), sign=sign, region=region))
    return tuple(found)


def _cell(border: float, first: int, second: int, margin: float) -> Polygon:
    """Return a quarter of the square: α1 beyond (+1) or short of a border, and −α2 likewise."""
    low, high = (border + margin, HALF_PI) if first > 0 else (-HALF_PI, border - margin)
    left, right = (border + margin, HALF_PI) if second > 0 else (-HALF_PI, border - margin)
    return _box(low, -right, high, -left)


def certain_determinant(coefficients: Coefficients) -> float:
    """Return an |R| of the exact coefficients whose sign is certain with the given ones, everywhere on the red sheet.

    It covers what the given coefficients differ from the exact ones, and more than
    :func:`gaitgraph.invertibility.level_determinant_resolution` can be on the red sheet, where the pair features
    (cos² α, sin² α, sin 2α) have at most the length √(3/2) and the slope 1.

    >>> round(certain_determinant(coefficients_of()), 4)
    0.0035
    """
    form = coefficients.bilinear_form
    size = float(np.linalg.norm(form))
    _, single, double, triple = coefficients.rounding
    # Each rounded number is off by no more than its rounding, and R with it.
    parts = 2 * single + double + 2 * triple
    derived = coefficients.sheet_rounding
    turned = 2 * math.sqrt(1.5) * size * derived + 8 * size * derived**2
    return 2 * parts + turned + 41 * _EPSILON * float(np.abs(form).sum())


def sign_region(
    sign: Sign,
    vehicle: Vehicle = PAPER,
    *,
    color: Color = "red",
    coefficients: Coefficients | None = None,
    least: float | None = None,
    accuracy: float = DEFAULT_ACCURACY,
) -> Region:
    """Return where R has a sign, and at least a size, on a sheet.

    Parameters
    ----------
    sign
        "positive" or "negative".
    vehicle
        The vehicle.
    color
        "red" or "blue". On blue R is zero with exact coefficients, and the region empty; with published ones it is
        what their rounding leaves, and where α3 or α4 wraps by π the region is cut.
    coefficients
        The coefficients of R on blue; on red R is exact. By default those of :func:`coefficients_of`.
    least
        The least |R|. By default 0 on red, where R ≠ 0 is meant, and what floating point can tell from 0 on blue.
    accuracy
        How far curved borders may be from where they are [rad], 1e-9 to 0.1.

    Raises
    ------
    InputError
        If the sign, the color, `least` or the accuracy is not allowed.

    Examples
    --------
    >>> round(sign_region("positive").area, 2), round(sign_region("negative").area, 2)
    (4.52, 5.35)
    >>> sign_region("negative", color="blue", coefficients=coefficients_of(kind="exact")).area
    0.0
    """
    wanted, accuracy = _checked_sign(sign), _checked_accuracy(accuracy)
    if color not in COLORS:
        raise InputError(f"color: {shown(color)}; allowed are 'red' and 'blue'")
    least = None if least is None else _checked("least", least, "a finite number ≥ 0", zero=True)
    if color == "blue":
        coefficients = coefficients or coefficients_of(vehicle)
        return _blue_sign_region(wanted, coefficients, least or noise_of(coefficients), accuracy)
    exact = coefficients_of(vehicle, "exact")
    condition = _determinant_condition(wanted, least or 0.0, "red", exact)
    margin = accuracy if least else _OPEN
    parts = [part.region for part in _components(vehicle, accuracy, margin) if part.sign == wanted]
    inner, outer = (_union(getattr(part, side) for part in parts) for side in ("inner", "outer"))
    if least and _falls_below(least, wanted, inner, exact):
        forbidden = determinant_below(least, wanted, vehicle.signed_drag_ratio, _tolerance(accuracy))
        inner, outer = _without(forbidden, _square(), accuracy / 2)
    return _only(condition, inner, outer, accuracy)


def _falls_below(least: float, sign: int, shape: BaseGeometry, exact: Coefficients) -> bool:
    """Return whether |R| may be below a value in polygons on which R has one sign.

    |R| is least on a border. Proof: but for a factor R is the product of P = cos β1·cos β2 and D, with ΔP = −2P and
    ΔD = −2D. Where the gradient of R vanishes, ∇D = −D·∇P/P, so that ΔR = −4R − 2R·|∇P|²/P² has the sign of −R: |R|
    has no least value inside.
    """
    import shapely

    if shape.is_empty:
        return False
    rings = shapely.get_rings(shapely.get_parts(_many(shape)))
    corners, ring = shapely.get_coordinates(rings, return_index=True)
    follows = ring[1:] == ring[:-1]
    ends = corners[:, [0, 1, 0, 1]]
    found = least_level_determinant(ends[:-1][follows], ends[1:][follows], exact, sign=sign, tolerance=0.0, floor=least)
    return bool(found.lower.min() < least)


def _union(shapes: Iterable[BaseGeometry]) -> BaseGeometry:
    import shapely

    return shapely.union_all(list(shapes))


def _blue_sign_region(sign: int, coefficients: Coefficients, least: float, accuracy: float) -> Region:
    condition = _determinant_condition(sign, least, "blue", coefficients)
    edge = 2 * coefficients.delta - math.copysign(HALF_PI, coefficients.delta)
    side = 1 if coefficients.delta > 0 else -1
    kept = {
        turn: _without(
            blue_determinant_below(least, turn * sign, coefficients, _tolerance(accuracy)), _square(), accuracy / 2
        )
        for turn in (1, -1)
    }
    parts: list[list[BaseGeometry]] = [[], []]
    for first in (1, -1):
        for second in (1, -1):
            # Beyond a border α3, or α4, is wrapped by π; each wrap turns the sign of R.
            for k, margin in enumerate((_OPEN, 0.0)):
                cell = _cell(edge, first * side, second * side, margin)
                parts[k].append(cell.intersection(kept[first * second][k]))
    return _only(condition, _union(parts[0]), _union(parts[1]), accuracy)


def hover_region(vehicle: Vehicle = PAPER) -> Region:
    """Return where all hover thrusts are positive on the red sheet: two rectangles that meet at (δ, −δ).

    α1 < δ and α2 > −δ, or α1 > δ and α2 < −δ. The borders, where a pair of rotors idles, are excluded.

    >>> round(hover_region().outer.area, 3)
    4.991
    """
    inner, outer = (_hover_rectangles(vehicle, margin) for margin in (_OPEN, 0.0))
    return _only(_hover_condition(vehicle), inner, outer, _OPEN)


def _hover_rectangles(vehicle: Vehicle, margin: float) -> BaseGeometry:
    delta = math.atan(vehicle.signed_drag_ratio)
    first = _box(-HALF_PI, margin - delta, delta - margin, HALF_PI)
    return _union([first, _box(delta + margin, -HALF_PI, HALF_PI, -delta - margin)])


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
    share, accuracy = _checked("share", share, "a positive finite number (of m·g)"), _checked_accuracy(accuracy)
    inner, outer = _thrust_polygons(share, vehicle.signed_drag_ratio, accuracy)

    def broken_at(alpha1: float, alpha2: float) -> str | None:
        peak = float(np.max(hover_thrust_shares([alpha1, alpha2, alpha1, alpha2], vehicle)))
        return None if peak <= share else f"largest hover thrust {peak:.3g} of m·g, wanted is ≤ {share:.3g}"

    limit = Condition(name=f"hover thrusts ≤ {share:.3g} of m·g", broken_at=broken_at)
    hover = hover_region(vehicle)
    return Region(
        inner=_many(inner.intersection(hover.inner)),
        outer=_many(outer.intersection(hover.outer)),
        accuracy=accuracy,
        conditions=(*hover.conditions, limit),
    )


@lru_cache(maxsize=32)
def _thrust_polygons(share: float, kappa: float, accuracy: float) -> tuple[BaseGeometry, BaseGeometry]:
    return _without(thrust_above(share, kappa, _tolerance(accuracy)), _square(), accuracy / 2)


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
    floor, accuracy = _checked("floor", floor, "a finite number ≥ 0", zero=True), _checked_accuracy(accuracy)
    return _singular_value_region(floor, floor, vehicle, accuracy)


def _singular_value_region(floor: float, block: float, vehicle: Vehicle, accuracy: float) -> Region:
    """Return the region, with `inner` holding the third singular value to a floor of its own, not below the other."""
    kappa = vehicle.signed_drag_ratio
    inner = _singular_value_polygon(floor, block, kappa, accuracy, inside=True)
    outer = _singular_value_polygon(floor, floor, kappa, accuracy, inside=False)

    def broken_at(alpha1: float, alpha2: float) -> str | None:
        value = float(least_singular_value_on_red(alpha1, alpha2, vehicle))
        return None if value >= floor else f"least singular value {value:.3g}, wanted is ≥ {floor:.3g}"

    return _only(Condition(name=f"least singular value ≥ {floor:.3g}", broken_at=broken_at), inner, outer, accuracy)


@lru_cache(maxsize=64)
def _singular_value_polygon(floor: float, block: float, kappa: float, accuracy: float, *, inside: bool) -> BaseGeometry:
    delta = math.atan(kappa)
    alone = floor * math.cos(delta) / math.sqrt(2.0)
    if alone > 1:
        return _box(0, 0, 0, 0)
    strips = _strips(delta, math.acos(alone) - (_TOUCH if floor and inside else 0.0))
    if floor >= accuracy / 2:
        band = weak_block(block, kappa, min(_tolerance(accuracy), block / 16))
        return strips.difference(_moved(band, accuracy / 2 if inside else -accuracy / 2))
    if floor == 0 or not inside:
        return strips
    # The band around R = 0 is narrower than what its polygons may be off by: a wider one, and none, enclose it.
    return strips.difference(_moved(weak_block(accuracy / 2, kappa, accuracy / 32), accuracy / 16))


def _strips(delta: float, reach: float) -> BaseGeometry:
    """Return where |cos β1| and |cos β2| are at least cos(reach)."""
    centers = (delta - math.pi, delta, delta + math.pi)
    found = _union(_box(max(c - reach, -HALF_PI), -HALF_PI, min(c + reach, HALF_PI), HALF_PI) for c in centers)
    return found.intersection(mirrored(found))


def tilt_region(limit: float) -> Region:
    """Return where no arm tilts beyond a limit [rad], on the red sheet.

    >>> tilt_region(0.5).inner.bounds
    (-0.5, -0.5, 0.5, 0.5)
    """
    limit = _checked("limit", limit, "a positive finite number (rad)")

    def broken_at(alpha1: float, alpha2: float) -> str | None:
        tilt = max(abs(alpha1), abs(alpha2))
        return None if tilt <= min(limit, HALF_PI) else f"tilt {tilt:.4f} rad, wanted is ≤ {min(limit, HALF_PI):.4f}"

    square = _square(min(limit, HALF_PI))
    return _only(Condition(name=f"tilt ≤ {limit:.4g} rad", broken_at=broken_at), square, square, 0.0)


def zones_region(zones: Zones) -> Region:
    """Return where the user's polygons allow to be: outside every keep-out and in the union of the keep-ins.

    Borders are exact, and allowed. A passage without width, between keep-outs that touch, is not in the region.

    >>> from gaitgraph.regions import Zones
    >>> region = zones_region(Zones(keep_out=[[(0, 0), (1, 0), (1, 1), (0, 1)]]))
    >>> region.contains([[0.5, 0.5], [1.0, 0.5]]).tolist(), region.why_not((0.5, 0.5))
    ([False, True], 'inside keep_out polygon 1')
    """
    import shapely

    keep_in, keep_out = ([shapely.Polygon(corners) for corners in side] for side in (zones.keep_in, zones.keep_out))
    allowed: BaseGeometry = _square()
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

    return _only(Condition(name="the keep_out and keep_in polygons", broken_at=broken_at), allowed, allowed, 0.0)


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
    """Return where a gait may be.

    Parameters
    ----------
    vehicle
        The vehicle; `max_tilt` and `max_thrust` count where they are stated.
    use
        "valid": R has the sign. "flyable": also the least singular value keeps the floor, all hover thrusts are
        positive and within the limit, and so are the tilts. Nothing on blue is flyable. `inner`
        keeps the floor by 1.5e-6 and the limit of thrust by 1.5e-4 of m·g, so that the checks of a gait can decide
        along its segments.
    color
        "red" or "blue".
    sign
        "positive", "negative", or None for either; no component holds both.
    coefficients
        With what R is judged; by default those of :func:`coefficients_of`.
    floor
        The floor of the least singular value.
    zones
        The user's own polygons.
    least
        The least |R|; by default on red :func:`certain_determinant`, so that the sign means something with the given
        coefficients too, and on blue :func:`gaitgraph.invertibility.noise_of`.
    accuracy
        How far curved borders may be from where they are [rad], 1e-9 to 0.1.

    Returns
    -------
    Region
        Empty if nothing is admissible.

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
        raise InputError(f"use: {shown(use)}; allowed are 'valid' and 'flyable'")
    if color not in COLORS:
        raise InputError(f"color: {shown(color)}; allowed are 'red' and 'blue'")
    if sign is not None:
        _checked_sign(sign)
    coefficients = coefficients or coefficients_of(vehicle)
    if least is None:
        least = certain_determinant(coefficients) if color == "red" else noise_of(coefficients)
    least = _checked("least", least, "a finite number ≥ 0", zero=True)
    floor, accuracy = _checked("floor", floor, "a finite number ≥ 0", zero=True), _checked_accuracy(accuracy)
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
    asked: dict[str, Any] = {"color": color, "coefficients": coefficients, "least": least, "accuracy": accuracy}
    if use == "valid":
        return _either([sign_region(one, vehicle, **asked) for one in signs])
    if color == "blue":
        condition = Condition(
            name="an invertible decoupling matrix",
            broken_at=lambda _first, _second: "on blue the decoupling matrix is singular in exact physics: use red",
        )
        return _only(condition, _box(0, 0, 0, 0), _box(0, 0, 0, 0), accuracy)
    region = _singular_value_region(floor, floor + _DECIDED if floor > 0 else 0.0, vehicle, accuracy)
    if vehicle.max_thrust is None:
        region &= hover_region(vehicle)
    else:
        mass, gravity = vehicle.require("mass", "gravity", purpose="the region within the largest thrust")
        share = vehicle.max_thrust / (mass * gravity)
        within = thrust_region(share, vehicle, accuracy=accuracy)
        kept = thrust_region(max(share - _DECIDED_THRUST, share / 2), vehicle, accuracy=accuracy)
        region &= Region(inner=kept.inner, outer=within.outer, accuracy=accuracy, conditions=within.conditions)
    if vehicle.max_tilt is not None:
        region &= tilt_region(vehicle.max_tilt)
    if floor < _SEPARATING:
        return _either([sign_region(one, vehicle, **asked) for one in signs]) & region
    return _of_sign(region, [_SIGNS[one] for one in signs], vehicle, asked)


def _of_sign(region: Region, signs: list[int], vehicle: Vehicle, asked: dict[str, Any]) -> Region:
    """Return the part of a region of hover with a positive floor where R has one of the signs, and its least size.

    The floor keeps each polygon off R = 0, so R has one sign on it.
    """
    exact, least = coefficients_of(vehicle, "exact"), asked["least"]
    conditions = [_determinant_condition(sign, least, "red", exact) for sign in signs]
    kept: list[BaseGeometry] = [_box(0, 0, 0, 0), _box(0, 0, 0, 0)]
    for sign in signs:
        sides = [
            _union(part for part in side.geoms if _sign_on(part, vehicle) == sign)
            for side in (region.inner, region.outer)
        ]
        if least > 0 and _falls_below(least, sign, sides[0], exact):
            cut = sign_region("positive" if sign > 0 else "negative", vehicle, **asked)
            sides = [sides[0].intersection(cut.inner), sides[1].intersection(cut.outer)]
        kept = [one.union(other) for one, other in zip(kept, sides, strict=True)]
    inner, outer = kept
    return Region(
        inner=_many(inner),
        outer=_many(outer),
        accuracy=region.accuracy,
        conditions=(_any_of(conditions), *region.conditions),
    )


def _sign_on(part: Polygon, vehicle: Vehicle) -> int:
    """Return the sign of R on a polygon where it has one."""
    point = part.representative_point()
    return int(red_label(point.x, point.y, vehicle).prod())


def _any_of(conditions: list[Condition]) -> Condition:
    """Return the condition that one of two holds, or the only one there is."""
    if len(conditions) == 1:
        return conditions[0]

    def broken_at(alpha1: float, alpha2: float) -> str | None:
        told = [condition.broken_at(alpha1, alpha2) for condition in conditions]
        return None if None in told else f"{(told[0] or '').split(',')[0]}, wanted is {name}"

    name = " or ".join(condition.name for condition in conditions)
    return Condition(name=name, broken_at=broken_at)


def _either(regions: list[Region]) -> Region:
    inner, outer = (_union(getattr(part, side) for part in regions) for side in ("inner", "outer"))
    condition = _any_of([part.conditions[0] for part in regions])
    return _only(condition, inner, outer, regions[0].accuracy)
