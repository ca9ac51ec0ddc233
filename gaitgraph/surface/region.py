"""A region of the (α1, α2) plane between two polygons, and how polygons for one are made.

One of the polygons certainly lies in the region, the other certainly encloses it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import HALF_PI, angle_from_text, number_of
from gaitgraph.errors import InputError, shown

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from shapely import MultiPolygon, Polygon
    from shapely.geometry.base import BaseGeometry

__all__ = [
    "DEFAULT_ACCURACY",
    "OPEN_MARGIN",
    "TOUCH",
    "Condition",
    "Region",
    "centered_square",
    "checked_accuracy",
    "checked_number",
    "chord_tolerance",
    "domain_without",
    "offset",
    "polygons_of",
    "rectangle",
    "region_between",
    "union_of",
]

FloatArray = npt.NDArray[np.float64]

DEFAULT_ACCURACY = 1e-6
"""How far a border of a region may be from where it truly is [rad]."""

OPEN_MARGIN = 1e-9
"""How far inside an open condition its straight border is drawn [rad]."""

TOUCH = 1e-12
"""What overlaying polygons may round off [rad]."""

_FOLLOWED = 0.45  # how far from a curved border its chords may be, as a share of the accuracy
_COARSEST = 1e-3  # coarser chords would save nothing
_BORDER = 1e-9
_FARTHEST = 1e6  # beyond it the border would be lost in rounding
_MOST_LISTED = 6


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
        The polygons of `inner`, the largest first, then by centroid. Polygons that only touch at points are
        separate components, and joined there, since borders are included.

    Examples
    --------
    >>> from gaitgraph.areas import admissible_region
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
        inside[~inside] = shapely.dwithin(self.inner, asked[~inside], TOUCH)
        return inside

    def component_of(self, point: npt.ArrayLike) -> int | None:
        """Return the index in `components` of the one that holds a point (α1, α2) [rad], or None."""
        import shapely

        if not self.components:
            return None
        distances = shapely.distance(np.array(self.components, dtype=object), shapely.Point(_points(point)[0]))
        nearest = int(np.argmin(distances))
        return nearest if distances[nearest] <= TOUCH else None

    def joined(self, first: npt.ArrayLike, second: npt.ArrayLike) -> bool:
        """Return whether a path inside `inner`, borders included, joins two points [rad].

        Components that touch at a point are joined there.
        """
        import shapely

        start, end = self.component_of(first), self.component_of(second)
        if start is None or end is None:
            return False
        parts = np.array(self.components, dtype=object)
        reached, fresh = {start}, [start]
        while fresh and end not in reached:
            touched = np.flatnonzero(shapely.intersects(parts, parts[fresh.pop()])).tolist()
            fresh += [part for part in touched if part not in reached]
            reached.update(touched)
        return end in reached

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

    def nearest_as_text(self, point: npt.ArrayLike) -> str | None:
        """Return the nearest point of `inner` with as few digits as keep it inside, at least four, or None.

        >>> from gaitgraph.areas import hover_region
        >>> hover_region().nearest_as_text((0.5, 0.5))
        '(0.16709, 0.5000)'
        """
        found = self.nearest(point)
        if found is None:
            return None
        for digits in range(4, 18):
            texts = [_fewest(angle, digits) for angle in found]
            if self.contains([float(text) for text in texts])[0]:
                return f"({texts[0]}, {texts[1]})"
        return f"({found[0]!r}, {found[1]!r})"

    def why_not(self, point: npt.ArrayLike) -> str | None:
        """Return what excludes a point (α1, α2) [rad], with numbers, or None if it is in `inner`.

        >>> from gaitgraph.areas import admissible_region
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
            inner=polygons_of(self.inner.intersection(other.inner)),
            outer=polygons_of(self.outer.intersection(other.outer)),
            accuracy=max(self.accuracy, other.accuracy),
            conditions=self.conditions + other.conditions,
        )

    def __repr__(self) -> str:
        size = f"{self.area:.4g} rad² in {len(self.components)} components"
        return f"<Region: {size}, accuracy {self.accuracy:.3g} rad, {len(self.conditions)} conditions>"

    def __str__(self) -> str:
        count = len(self.components)
        if not count:
            lines = ["Region of the (α1, α2) plane: empty"]
        else:
            borders = f"borders to {self.accuracy:.3g} rad" if self.accuracy else "exact borders"
            size = f"{self.area:.4g} rad² in {count} component{'s' * (count > 1)}"
            lines = [f"Region of the (α1, α2) plane: {size}, {borders}"]
        for number, part in enumerate(self.components[:_MOST_LISTED], start=1):
            left, below, right, above = (f"{value:.4f}" for value in part.bounds)
            area = f"{part.area:.3g} rad²"
            lines.append(f"  {number}  {area:>11}   α1 {left} to {right}, α2 {below} to {above}")
        if count > _MOST_LISTED:
            lines.append(f"  … and {count - _MOST_LISTED} more")
        if self.conditions:
            lines.append(" · ".join(dict.fromkeys(condition.name for condition in self.conditions)))
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        from gaitgraph.plots.showing import html_of_region

        return html_of_region(self)


def _fewest(angle: float, digits: int) -> str:
    """Return an angle with four decimals if that is all it has of so many, else with so many."""
    short = f"{angle:.4f}"
    return short if abs(float(short) - angle) < 10.0**-digits / 2 else f"{angle:.{digits}f}"


def _points(points: npt.ArrayLike) -> FloatArray:
    """Return finite points, shape (m, 2)."""
    try:
        out = np.asarray(points, dtype=float)
    except (TypeError, ValueError) as error:
        raise InputError(f"point: {shown(points)}; allowed are (alpha1, alpha2) in radians") from error
    if out.ndim not in (1, 2) or out.shape[-1] != 2 or not np.isfinite(out).all():
        raise InputError(f"point: {shown(points)}; allowed are finite (alpha1, alpha2) in radians, shape (m, 2)")
    return out.reshape(-1, 2)


def polygons_of(shape: BaseGeometry) -> MultiPolygon:
    """Return the polygons of a shape, without the points and lines that overlaying leaves."""
    import shapely

    parts = shapely.get_parts(shapely.get_parts(np.array([shape], dtype=object)))
    return shapely.MultiPolygon([part for part in parts if part.geom_type == "Polygon" and part.area > 0])


def union_of(shapes: Iterable[BaseGeometry]) -> BaseGeometry:
    """Return the union of shapes, empty if there is none."""
    import shapely

    return shapely.union_all(list(shapes))


def rectangle(left: float, bottom: float, right: float, top: float) -> Polygon:
    """Return a rectangle, empty unless it has an inside."""
    import shapely

    return shapely.box(left, bottom, right, top) if left < right and bottom < top else shapely.Polygon()


def centered_square(size: float = HALF_PI) -> Polygon:
    """Return the square [−size, size]², by default all of the plane that a region can be in."""
    return rectangle(-size, -size, size, size)


def offset(shape: BaseGeometry, distance: float) -> BaseGeometry:
    """Return a polygon with its border moved outward (or inward, if negative)."""
    return shape.buffer(distance, join_style="mitre")


def domain_without(forbidden: BaseGeometry, domain: BaseGeometry, reach: float) -> tuple[BaseGeometry, BaseGeometry]:
    """Return inner and outer polygons of a domain without a set that is known to within `reach`."""
    return domain.difference(offset(forbidden, reach)), domain.difference(offset(forbidden, -reach))


def region_between(condition: Condition, inner: BaseGeometry, outer: BaseGeometry, accuracy: float) -> Region:
    """Return the region of one condition between two polygons."""
    return Region(inner=polygons_of(inner), outer=polygons_of(outer), accuracy=accuracy, conditions=(condition,))


def checked_accuracy(accuracy: float) -> float:
    """Return an accuracy; raise InputError if it is not a number from 1e-9 to 0.1."""
    if not 1e-9 <= number_of(accuracy) <= 0.1:
        raise InputError(f"accuracy: {shown(accuracy)}; allowed is 1e-9 to 0.1 (rad)")
    return float(accuracy)


def checked_number(name: str, value: object, allowed: str, *, zero: bool = False) -> float:
    """Return a positive finite number, or also zero if `zero`; raise InputError, with what is allowed, for others."""
    number = number_of(value)
    if not 0 <= number < math.inf or (number == 0 and not zero):
        raise InputError(f"{name}: {shown(value)}; allowed is {allowed}")
    return number


def chord_tolerance(accuracy: float) -> float:
    """Return how far chords may be from a curved border for an accuracy [rad]."""
    return min(_FOLLOWED * accuracy, _COARSEST)


@dataclass(frozen=True, slots=True)
class Zones:
    """The user's own polygons in the (α1, α2) plane: stay out of these, stay inside those.

    Polygons are exact: their boundary is allowed and no margin is added. A point within 1e-9 rad of a boundary
    counts as on it.

    Parameters
    ----------
    keep_out
        Polygons whose interior is forbidden, each a sequence of (α1, α2) [rad, or texts].
    keep_in
        If any are given, the loop must stay in their union.

    Raises
    ------
    InputError
        If a polygon is malformed, crosses itself or has no area.

    Examples
    --------
    >>> zones = Zones(keep_out=[[(0, 0), (1, 0), (1, 1), (0, 1)]])
    >>> zones.allow_points([[0.5, 0.5], [1.0, 0.5]]).tolist()
    [False, True]
    """

    keep_out: Any = ()
    keep_in: Any = ()
    _forbidden: BaseGeometry | None = field(default=None, init=False, repr=False, compare=False)
    _permitted: BaseGeometry | None = field(default=None, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        import shapely

        for name in ("keep_out", "keep_in"):
            polygons = _polygons(getattr(self, name), name)
            if name == "keep_out" and polygons:
                region = shapely.union_all([polygon.buffer(-_BORDER, join_style="mitre") for polygon in polygons])
                object.__setattr__(self, "_forbidden", region)
            elif polygons:
                region = shapely.union_all(polygons).buffer(_BORDER, join_style="mitre")
                object.__setattr__(self, "_permitted", region)
            for area in (self._forbidden, self._permitted):
                if area is not None:
                    shapely.prepare(area)
            corners = tuple(tuple((float(x), float(y)) for x, y in p.exterior.coords[:-1]) for p in polygons)
            object.__setattr__(self, name, corners)

    def allow_points(self, points: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        """Return whether each point (α1, α2) may be used, for points of shape (m, 2)."""
        import shapely

        return self._allow(shapely.points(np.asarray(points, dtype=float).reshape(-1, 2)))

    def allow_segments(self, starts: npt.ArrayLike, ends: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        """Return whether each straight segment may be used, for ends of shape (m, 2)."""
        import shapely

        lines = np.stack([np.asarray(starts, dtype=float), np.asarray(ends, dtype=float)], axis=1)
        return self._allow(shapely.linestrings(lines))

    def _allow(self, shapes: Any) -> npt.NDArray[np.bool_]:
        import shapely

        allowed = np.ones(len(shapes), dtype=bool)
        if self._forbidden is not None:
            allowed &= ~shapely.intersects(self._forbidden, shapes)
        if self._permitted is not None:
            allowed &= shapely.covers(self._permitted, shapes)
        return allowed


def _polygons(value: object, name: str) -> list[Polygon]:
    import shapely

    if not isinstance(value, (list, tuple, np.ndarray)):
        raise InputError(f"{name}: {shown(value)}; allowed is a list of polygons, each a list of [alpha1, alpha2]")
    polygons = []
    for number, corners in enumerate(value, start=1):
        label = f"{name} polygon {number}"
        points = [_corner(corner, label) for corner in _corners(corners, label)]
        if len(set(points)) < 3:
            raise InputError(f"{label}: {len(set(points))} different corners; allowed are three or more")
        polygon = shapely.Polygon(points)
        if not polygon.convex_hull.area > 1e-12:
            raise InputError(f"{label}: its corners lie on a line; allowed is a polygon with an interior")
        if not polygon.is_valid:
            raise InputError(f"{label}: {shapely.is_valid_reason(polygon)}; allowed is a simple polygon")
        if not polygon.area > 1e-12:
            raise InputError(f"{label}: area {polygon.area!r}; allowed is a polygon with an interior")
        polygons.append(polygon)
    return polygons


def _corners(value: object, label: str) -> Iterable[object]:
    if not isinstance(value, (list, tuple, np.ndarray)):
        raise InputError(f"{label}: {shown(value)}; allowed is a list of [alpha1, alpha2]")
    return value


def _corner(value: object, label: str) -> tuple[float, float]:
    if not isinstance(value, (list, tuple, np.ndarray)) or len(value) != 2:
        raise InputError(f"{label}: corner {shown(value)}; allowed is [alpha1, alpha2]")
    angles = angle_from_text(value[0], f"{label} alpha1"), angle_from_text(value[1], f"{label} alpha2")
    if max(map(abs, angles)) > _FARTHEST:
        raise InputError(f"{label}: corner {shown(value)}; allowed are angles up to {_FARTHEST:g} rad")
    return angles


def zones_region(zones: Zones) -> Region:
    """Return where the user's polygons allow to be: outside every keep-out and in the union of the keep-ins.

    Borders are exact, and allowed. A passage without width, between keep-outs that touch, is not in the region.

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
