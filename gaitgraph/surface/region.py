"""A region of the (α1, α2) plane, and the user's own polygons.

A region is known by two shapes: one certainly lies in it, the other certainly encloses it. A pair is an array of both,
inner and outer, on which shapely's functions work at once.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache, partial
from typing import TYPE_CHECKING, Any, ClassVar, Literal, NamedTuple

import numpy as np
import numpy.typing as npt
import shapely
from shapely import MultiPolygon

from gaitgraph._lazy import cached_property
from gaitgraph.angles import HALF_PI, angle_within, angles_from, figures_apart, is_list
from gaitgraph.arrays import read_only
from gaitgraph.errors import of_field, shown, wrong
from gaitgraph.pictured import Pictured
from gaitgraph.records import Record
from gaitgraph.texts import table_lines
from gaitgraph.tolerances import ROUND_OFF, SAME_ANGLE
from gaitgraph.vehicle import Angle

if TYPE_CHECKING:
    from collections.abc import Callable

    import networkx as nx
    from shapely import Polygon
    from shapely.geometry.base import BaseGeometry

    from gaitgraph.invertibility.forms import FloatArray

Pair = npt.NDArray[np.object_]  # the inner and the outer shape of a region

Requirement = Literal["flyable", "valid"]
"""What a gait must be."""

DEFAULT_ACCURACY = 1e-6
"""Largest distance of a region's border from its true place [rad]."""

OPEN_MARGIN = 1e-9  # how far inside an open condition its straight border is [rad]
SQUARE = shapely.box(-HALF_PI, -HALF_PI, HALF_PI, HALF_PI)
shapely.prepare(SQUARE)
WHOLE: Pair = read_only(np.array([SQUARE, SQUARE]))
NOWHERE: Pair = read_only(np.array([shapely.Polygon(), shapely.Polygon()]))
_MOST_LISTED = 6  # components in the text of a region
_NO_AREA = 1e-12  # rad²


@dataclass(frozen=True, slots=True, kw_only=True)
class Condition:
    """One condition of a region; `broken_at` returns why it does not hold at (α1, α2) [rad], None if it does."""

    name: str
    broken_at: Callable[[float, float], str | None] = field(compare=False, repr=False)


@dataclass(frozen=True, kw_only=True)
class Region(Pictured):
    """A region of the (α1, α2) plane of one sheet, between two polygons.

    Every question is answered by `inner`, so what it contains is certainly in the region. ``&`` intersects two regions.

    Parameters
    ----------
    inner, outer
        Polygons inside the region and around it, borders included [rad]. A straight border of `inner` is exact, or 1e-9
        inside if the condition excludes it.
    accuracy
        The most by which a curved border of `inner` is inside, and of `outer` outside [rad]; zero if none is curved.
        Where two borders meet at an acute angle the corner may recede farther, and a passage not wider than twice the
        accuracy may be closed.
    conditions
        What was intersected.

    Examples
    --------
    >>> from gaitgraph.surface import admissible_region
    >>> region = admissible_region(sign="positive")
    >>> len(region.components), region.joined((0.1, 0.2), (-1.0, 1.0)), region.joined((0.1, 0.2), (1.5, -1.5))
    (2, True, False)
    >>> region.nearest((0.1, 0.2)), region.component_of((0.5, -0.5))
    ((0.1, 0.2), None)
    >>> region.why_not((0.5, -0.5))
    'R at level attitude must be ≥ 0.0026, got -6.336'
    >>> print(region)
    Region of the (α1, α2) plane: 2.374 rad² in 2 components, borders to 1e-06 rad
      1    2.36 rad²   α1 -1.3688 to 0.1671, α2 -0.1671 to 1.3688
      2  0.0162 rad²   α1 -1.5708 to -1.4386, α2 1.4386 to 1.5708
    R ≥ 0.0026 · least singular value ≥ 0.05 · hover thrusts > 0
    """

    not_stated: ClassVar[str] = "conditions are functions"

    inner: MultiPolygon
    outer: MultiPolygon
    accuracy: float
    conditions: tuple[Condition, ...] = ()

    def __post_init__(self) -> None:
        shapely.prepare(self.inner)

    @property
    def pair(self) -> Pair:
        """`inner` and `outer` as an array."""
        return read_only(np.array([self.inner, self.outer], dtype=object))

    @cached_property
    def components(self) -> tuple[Polygon, ...]:
        """The polygons of `inner`, the largest first, then by centroid; some may touch at points."""
        parts = sorted(
            self.inner.geoms,
            key=lambda part: (-part.area, part.centroid.x, part.centroid.y),
        )
        shapely.prepare(parts)
        return tuple(parts)

    @property
    def area(self) -> float:
        """Area of `inner` [rad²]."""
        return float(self.inner.area)

    def contains(self, points: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        """Return whether each point, shape (m, 2) [rad], is in `inner` or, because of rounding, within 1e-12 of it."""
        asked: Any = shapely.points(_points(points))
        inside = np.asarray(shapely.covers(self.inner, asked))
        inside[~inside] = shapely.dwithin(self.inner, asked[~inside], ROUND_OFF)
        return inside

    def component_of(self, point: npt.ArrayLike) -> int | None:
        """Return the index in `components` of the one that holds a point (α1, α2) [rad], or None."""
        parts = np.array(self.components, dtype=object)
        near = np.flatnonzero(
            shapely.dwithin(parts, shapely.Point(_points(point)[0]), ROUND_OFF)
        )
        return int(near[0]) if near.size else None

    @cached_property
    def _touching(self) -> nx.Graph[int]:
        """The components by their index, with an edge between any two that touch."""
        import networkx as nx

        parts = np.array(self.components, dtype=object)
        first, second = np.triu_indices(len(parts), 1)
        touch = shapely.intersects(parts[first], parts[second])
        graph: nx.Graph[int] = nx.empty_graph(len(parts))
        graph.add_edges_from(np.stack([first, second], axis=1)[touch].tolist())
        return graph

    def joined(self, *points: npt.ArrayLike) -> bool:
        """Return whether paths inside `inner`, borders and common points included, join some points [rad]."""
        import networkx as nx

        parts = {self.component_of(point) for point in points}
        if None in parts:
            return False
        groups = nx.connected_components(self._touching)
        return not parts or any(map(parts.issubset, groups))

    def nearest(self, point: npt.ArrayLike) -> tuple[float, float] | None:
        """Return the point of `inner` nearest to a point [rad], the point itself if it is inside; None if empty."""
        if self.inner.is_empty:
            return None
        return self._nearest_of(self.inner, _points(point))[0]

    def _nearest_of(
        self, part: BaseGeometry, points: FloatArray
    ) -> tuple[tuple[float, float], ...]:
        """Return the points of a part of `inner` nearest to points, shape (m, 2), those inside themselves."""
        asked: Any = shapely.points(points)
        nearest = shapely.get_coordinates(shapely.shortest_line(part, asked))[::2]
        is_inside = shapely.dwithin(part, asked, ROUND_OFF)
        nearest[is_inside] = points[is_inside]
        return tuple(map(tuple, nearest.tolist()))

    def nearest_joined(self, points: npt.ArrayLike) -> tuple[tuple[float, float], ...]:
        """Return for each of m points, shape (m, 2) [rad], the nearest one inside, all of which paths inside join.

        Of the parts of `inner`, where those that touch are one, the one with the least sum of distances is chosen.
        Empty if `inner` is.

        >>> from gaitgraph.surface import admissible_region
        >>> region = admissible_region(sign="positive")
        >>> [(round(x, 3), round(y, 3)) for x, y in region.nearest_joined([(-0.4, 0.4), (-0.2, 1.0), (-1.5, 1.5)])]
        [(-0.4, 0.4), (-0.2, 1.0), (-1.369, 1.369)]
        """
        import networkx as nx

        asked = _points(points)
        components = np.array(self.components, dtype=object)
        groups = nx.connected_components(self._touching)
        parts = [shapely.MultiPolygon(components[list(group)]) for group in groups]
        if not parts:
            return ()
        distances = shapely.distance(np.array(parts)[:, None], shapely.points(asked))
        return self._nearest_of(parts[distances.sum(axis=1).argmin()], asked)

    def as_text(self, point: tuple[float, float]) -> str:
        """Return a point of `inner` with as few digits as keep it inside, at least four."""
        for digits in range(4, 18):
            texts = [f"{round(angle, digits) + 0.0:.{digits}f}" for angle in point]
            if self.contains([float(text) for text in texts])[0]:
                return f"({texts[0]}, {texts[1]})"
        return f"({point[0]!r}, {point[1]!r})"

    def why_not(self, point: npt.ArrayLike) -> str | None:
        """Return the conditions that a point (α1, α2) [rad] breaks, with numbers, or None if it is in `inner`."""
        asked = _points(point)[0]
        if self.contains(asked)[0]:
            return None
        reasons = [
            condition.broken_at(float(asked[0]), float(asked[1]))
            for condition in self.conditions
        ]
        near = f"closer to the border than the accuracy of the region ({self.accuracy:.1g} rad)"
        return "; ".join(filter(None, reasons)) or near

    def as_dict(self) -> dict[str, Any]:
        """Return the polygons as corners, the accuracy and the names of the conditions."""
        rings = {
            name: [
                [
                    list(map(list, ring.coords))
                    for ring in (part.exterior, *part.interiors)
                ]
                for part in polygons_of(shape).geoms
            ]
            for name, shape in (("inner", self.inner), ("outer", self.outer))
        }
        names = [condition.name for condition in self.conditions]
        return {**rings, "accuracy": self.accuracy, "conditions": names}

    def __and__(self, other: Region) -> Region:
        pair = shapely.intersection(self.pair, other.pair)
        return region_of(
            pair,
            max(self.accuracy, other.accuracy),
            *self.conditions,
            *other.conditions,
        )

    def __repr__(self) -> str:
        size = f"{self.area:.4g} rad² in {len(self.components)} components"
        return f"<Region: {size}, accuracy {self.accuracy:.3g} rad, {len(self.conditions)} conditions>"

    def __str__(self) -> str:
        count = len(self.components)
        if self.accuracy:
            borders = f"borders to {self.accuracy:.3g} rad"
        else:
            borders = "exact borders"
        size = "empty"
        if count:
            size = f"{self.area:.4g} rad² in {count} component{'s' * (count > 1)}, {borders}"
        lines = [f"Region of the (α1, α2) plane: {size}"]
        rows = []
        for number, part in enumerate(self.components[:_MOST_LISTED], start=1):
            left, below, right, above = part.bounds
            bounds = f"α1 {left:.4f} to {right:.4f}, α2 {below:.4f} to {above:.4f}"
            rows.append((str(number), f"{part.area:.3g} rad²", bounds))
        lines += table_lines(rows, right={1})
        if count > _MOST_LISTED:
            lines.append(f"  … and {count - _MOST_LISTED} more")
        if self.conditions:
            lines.append(
                " · ".join(
                    dict.fromkeys(condition.name for condition in self.conditions)
                )
            )
        return "\n".join(lines)


def _points(points: npt.ArrayLike) -> FloatArray:
    """Return finite points, shape (m, 2)."""
    out: FloatArray = angles_from(points, "point")
    if out.ndim not in (1, 2) or out.shape[-1] != 2:
        raise wrong(
            "point", "must be (alpha1, alpha2) in radians, shape (m, 2)", points
        )
    return out.reshape(-1, 2)


def region_of(pair: Any, accuracy: float, *conditions: Condition) -> Region:
    """Return the region between the polygons of a pair of shapes."""
    inner, outer = map(polygons_of, pair)
    return Region(inner=inner, outer=outer, accuracy=accuracy, conditions=conditions)


def limit_condition(
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


class Discs(NamedTuple):
    """Discs to pass, in order: centres, shape (n, 2), and radii, shape (n,), zero for a point [rad]."""

    centers: FloatArray
    radii: FloatArray

    def misses(self, points: FloatArray) -> float:
        """Return how far outside its disc the farthest of n points lies [rad]."""
        return float(np.max(np.linalg.norm(points - self.centers, axis=1) - self.radii))


def component_meeting(shape: BaseGeometry, discs: Discs) -> Polygon | None:
    """Return the polygon, of several, that meets every disc, the largest if there are more; or None."""
    centers, parts = shapely.points(discs.centers), polygons_of(shape).geoms
    meeting = [
        part
        for part in parts
        if (shapely.distance(part, centers) <= discs.radii + ROUND_OFF).all()
    ]
    return max(meeting, key=lambda part: (part.area, part.bounds), default=None)


def polygons_of(shape: BaseGeometry) -> MultiPolygon:
    """Return the polygons of a shape, without the points and lines that overlaying leaves."""
    parts = shapely.get_parts(shapely.get_parts(shape))
    return shapely.MultiPolygon(parts[shapely.area(parts) > 0])


def rectangle(left: float, bottom: float, right: float, top: float) -> Polygon:
    """Return a rectangle, empty unless it has an inside."""
    if left < right and bottom < top:
        return shapely.box(left, bottom, right, top)
    return shapely.Polygon()


def quarters(x: float, y: float, sign: int, kept: float) -> list[Pair]:
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


def union_of(pairs: Sequence[Any]) -> Pair:
    """Return the unions of the inner and of the outer shapes of pairs."""
    return np.asarray(shapely.union_all(np.array(pairs, dtype=object), axis=0))


def offset(shape: BaseGeometry, distance: float) -> BaseGeometry:
    """Return a polygon with its border moved outward (or inward, if negative)."""
    return shape.buffer(distance, join_style="mitre")


def offsets(shape: BaseGeometry, reach: float) -> Pair:
    """Return what a shape certainly contains, and what it may contain, if its border is known to within `reach` [rad]."""
    return np.array([offset(shape, -reach), offset(shape, reach)])


def chord_tolerance(accuracy: float) -> float:
    """Return how far chords may be from a curved border for an accuracy [rad]; above 1e-3 nothing would be saved."""
    return min(0.45 * accuracy, 1e-3)


def checked_accuracy(accuracy: float) -> float:
    """Return an accuracy; raise InputError if it is not a number from 1e-9 to 0.1."""
    return angle_within(accuracy, "accuracy", 0.1, least=1e-9)


Corners = tuple[tuple[float, float], ...]
Points = Sequence[Sequence[Angle]] | npt.NDArray[np.float64]
"""Points (α1, α2), each angle a number [rad] or a text such as "3pi/8"."""


@dataclass(frozen=True, init=False)
class Zones(Record):
    """The user's own polygons in the (α1, α2) plane, each a sequence of (α1, α2) [rad, or texts].

    The interior of each polygon of `keep_out` is forbidden. If `keep_in` has polygons, the loop must stay in their
    union. Boundaries are allowed and no margin is added; a point within 1e-9 rad of a boundary counts as on it.
    InputError if a polygon is malformed, crosses itself or has no area, or if one of `keep_in` misses the square of
    ±π/2. One of `keep_out` that misses it forbids nothing; `notes` say so.

    >>> zones = Zones(keep_out=[[(0, 0), (1, 0), (1, 1), (0, 1)]])
    >>> zones.allow_points([[0.5, 0.5], [1.0, 0.5]]).tolist()
    [False, True]
    """

    keep_out: tuple[Corners, ...]
    keep_in: tuple[Corners, ...]

    def __init__(
        self, *, keep_out: Sequence[Points] = (), keep_in: Sequence[Points] = ()
    ) -> None:
        for name, value in (("keep_out", keep_out), ("keep_in", keep_in)):
            polygons = checked_polygons(value, name)
            corners = (
                shapely.get_coordinates(polygon)[:-1].tolist() for polygon in polygons
            )
            object.__setattr__(
                self, name, tuple(tuple(map(tuple, one)) for one in corners)
            )  # the record is frozen

    @property
    def notes(self) -> tuple[str, ...]:
        """A line for each polygon of `keep_out` that forbids nothing, because it misses the square of ±π/2."""
        return tuple(
            f"keep_out polygon {number} forbids nothing, because it misses the square of ±π/2 rad: {shown(corners)}; "
            "write degrees as '9deg'"
            for number, corners in enumerate(self.keep_out, start=1)
            if not shapely.Polygon(corners).intersects(SQUARE)
        )

    def allow_points(self, points: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        """Return whether each point (α1, α2) may be used, for points of shape (m, 2)."""
        return self._allow(
            shapely.points(np.asarray(points, dtype=float).reshape(-1, 2))
        )

    def allow_segments(
        self, starts: npt.ArrayLike, ends: npt.ArrayLike
    ) -> npt.NDArray[np.bool_]:
        """Return whether each straight segment may be used, for ends of shape (m, 2)."""
        lines = np.stack(
            [np.asarray(starts, dtype=float), np.asarray(ends, dtype=float)], axis=1
        )
        return self._allow(shapely.linestrings(lines))

    def _allow(self, shapes: Any) -> npt.NDArray[np.bool_]:
        allowed = ~shapely.intersects(_united(self.keep_out, -SAME_ANGLE), shapes)
        if self.keep_in:
            allowed &= shapely.covers(_united(self.keep_in, SAME_ANGLE), shapes)
        return np.asarray(allowed)


@lru_cache(maxsize=32)
def _united(polygons: tuple[Corners, ...], distance: float) -> BaseGeometry:
    """Return the union of polygons whose borders are moved outward, prepared, and kept for the next request."""
    shape = shapely.union_all(
        [offset(shapely.Polygon(corners), distance) for corners in polygons]
    )
    shapely.prepare(shape)
    return shape


def checked_polygons(value: Any, name: str) -> list[Polygon]:
    """Return the polygons of lists of corners [rad]; raise InputError, with its number, for one that is malformed."""
    if not is_list(value):
        raise wrong(
            name, "must be a list of polygons, each a list of [alpha1, alpha2]", value
        )
    polygons = []
    for number, corners in enumerate(value, start=1):
        label = f"{name} polygon {number}"
        with of_field(name, row=number):
            polygon = _checked_polygon(corners, label)
            if name == "keep_in" and not polygon.intersects(SQUARE):
                raise wrong(label, "must overlap the square of ±π/2 rad", corners)
        polygons.append(polygon)
    return polygons


def _checked_polygon(corners: Any, label: str) -> Polygon:
    """Return the polygon of corners (α1, α2) [rad]; the last corner may repeat the first."""
    if not is_list(corners) or any(
        not is_list(corner) or len(corner) != 2 for corner in corners
    ):
        raise wrong(label, "must be a list of corners [alpha1, alpha2]", corners)
    # A polygon may reach beyond the square of ±π/2; larger numbers are degrees by mistake.
    points = [
        (
            angle_within(x, f"{label} alpha1", math.pi),
            angle_within(y, f"{label} alpha2", math.pi),
        )
        for x, y in corners
    ]
    if len(points) > 3 and points[0] == points[-1]:
        points.pop()
    polygon = shapely.Polygon(points) if len(set(points)) > 2 else shapely.Polygon()
    if not polygon.convex_hull.area > _NO_AREA:
        raise wrong(
            label, "must have three or more corners that are not on a line", corners
        )
    if not polygon.is_valid:
        where = shapely.is_valid_reason(polygon)
        raise wrong(label, "must not cross or touch itself", corners, got=where)
    return polygon


def zones_region(zones: Zones) -> Region:
    """Return what the user's polygons allow: all outside every keep-out and in the union of the keep-ins.

    Borders are exact and belong to the region, also a corner that two keep-outs share, but not a side of both.

    >>> region = zones_region(Zones(keep_out=[[(0, 0), (1, 0), (1, 1), (0, 1)]]))
    >>> region.contains([[0.5, 0.5], [1.0, 0.5]]).tolist(), region.why_not((0.5, 0.5))
    ([False, True], 'inside keep_out polygon 1')
    """
    keep_in, keep_out = (
        [shapely.Polygon(corners) for corners in side]
        for side in (zones.keep_in, zones.keep_out)
    )
    allowed = SQUARE.intersection(shapely.union_all(keep_in)) if keep_in else SQUARE
    allowed = allowed.difference(shapely.union_all(keep_out))
    condition = Condition(
        name="the keep_out and keep_in polygons",
        broken_at=partial(_outside, keep_out, keep_in),
    )
    return region_of([allowed, allowed], 0.0, condition)


def _outside(
    keep_out: Sequence[Polygon],
    keep_in: Sequence[Polygon],
    alpha1: float,
    alpha2: float,
) -> str | None:
    point = shapely.Point(alpha1, alpha2)
    inside = [
        str(k)
        for k, polygon in enumerate(keep_out, start=1)
        if polygon.contains_properly(point)
    ]
    reasons = [f"inside keep_out polygon {', '.join(inside)}"] if inside else []
    if keep_in and not any(polygon.covers(point) for polygon in keep_in):
        reasons.append("outside the keep_in polygons")
    return " and ".join(reasons) or None
