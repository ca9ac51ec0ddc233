"""Shortest paths in the plane around polygonal obstacles, exact to machine precision.

In a polygonal region a shortest path is a polyline that bends only at reflex corners of the region. The region is cut
into triangles whose corners are its own (a constrained Delaunay triangulation). What a point can see is found by
widening cones through them, with exact orientations of three points. The path is then searched among the reflex corners
by A*; what a corner sees is computed when the search first needs it, and kept. Between corners only lines that are
tangent at both ends matter; where these are few, shapely tests whether they lie in the region. Polygons that appear
later bring their corners into the search; the triangles stay.
"""

from __future__ import annotations

import math
from fractions import Fraction
from functools import cached_property, lru_cache
from heapq import heapify, heappop, heappush
from itertools import chain, compress
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import shapely

from gaitgraph.arrays import read_only
from gaitgraph.errors import InputError
from gaitgraph.tolerances import ROUND_OFF

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from gaitgraph.invertibility.forms import FloatArray

Point = tuple[float, float]
Complexes = npt.NDArray[np.complex128]  # points x + iy

_ORIENTATION_ERROR = 3.3306690738754716e-16  # (3 + 16·2⁻⁵³)·2⁻⁵³, Shewchuk's bound for the determinant below
_TOLERANCE = 1e-9
_DIRECT = -1
_MOST_CORNERS = 400  # of polygons that appear later; around more, cutting the region anew takes less time
_FEW = 12  # lines, up to which it is quicker to test each in shapely than to widen cones around a corner
_ROUNDING = 1e-14  # of an orientation, per square of the largest coordinate: more than floating point leaves
_UNSURE = 3e-14  # the same of coordinates within ±π, by the bound above


def orientation(a: Point, b: Point, c: Point) -> float:
    """Return a number that is positive if a, b, c turn left, negative if right, zero if they lie on a line.

    The sign is exact, whatever the coordinates.

    >>> orientation((0.0, 0.0), (1.0, 0.0), (0.0, 1.0)), orientation((0.1, 0.1), (0.2, 0.2), (0.3, 0.3))
    (1.0, 0.0)
    """
    left = (a[0] - c[0]) * (b[1] - c[1])
    right = (a[1] - c[1]) * (b[0] - c[0])
    value = left - right
    if abs(value) > _ORIENTATION_ERROR * (abs(left) + abs(right)):
        return value
    if (
        not left
        and not right
        and (a[0] == c[0] or b[1] == c[1])
        and (a[1] == c[1] or b[0] == c[0])
    ):
        return 0.0
    (ax, ay), (bx, by), (cx, cy) = ((Fraction(x), Fraction(y)) for x, y in (a, b, c))
    exact = (ax - cx) * (by - cy) - (ay - cy) * (bx - cx)
    return float(exact) or math.copysign(math.ulp(0.0), exact) * bool(exact)


def orientations(a: Complexes, b: Complexes, c: Complexes) -> FloatArray:
    """Return :func:`orientation` of points x + iy within ±π, in arrays that broadcast; the signs are exact."""
    first, second = a - c, b - c
    left = first.real * second.imag
    value = left - first.imag * second.real
    # Where both products vanish a coordinate is the same, and zero is exact.
    unsure = (np.abs(value) <= _UNSURE) & (left != 0)
    if unsure.any():
        rows = [np.broadcast_to(one, value.shape)[unsure].tolist() for one in (a, b, c)]
        value[unsure] = [
            orientation(*((z.real, z.imag) for z in three))
            for three in zip(*rows, strict=True)
        ]
    return np.asarray(value)


def _pair(point: npt.ArrayLike) -> Point:
    x, y = np.asarray(point, dtype=float).tolist()
    return x, y


class ShortestPaths:
    """A polygonal region, prepared for shortest paths inside it.

    `region` is a valid shapely Polygon or MultiPolygon. It is closed: paths may run along its border and through its
    corners, and parts that touch in a corner are joined there. A point is taken as inside if it is within 1e-9 of the
    region. Not guaranteed: which of two paths of the same length is taken; the same input gives the same one.

    Examples
    --------
    >>> from shapely import Polygon
    >>> square = [(0, 0), (4, 0), (4, 4), (0, 4)]
    >>> paths = ShortestPaths(Polygon(square, [[(1, 1), (3, 1), (3, 3), (1, 3)]]))
    >>> paths.path((0.5, 1.8), (3.5, 1.8)).tolist()
    [[0.5, 1.8], [1.0, 1.0], [3.0, 1.0], [3.5, 1.8]]
    """

    def __init__(self, region: Any) -> None:
        if shapely.get_dimensions(region) != 2 and not region.is_empty:
            raise InputError(
                f"region must consist of polygons, got a {region.geom_type}"
            )
        self._points: list[Point] = []
        self._triangles: list[tuple[int, int, int]] = []
        self._triangulate(region)
        # By each edge, counterclockwise, its triangle and the opposite corner; the triangle of (b, a) is behind (a, b).
        self._at_edge: dict[tuple[int, int], tuple[int, int]] = {}
        for t, (a, b, c) in enumerate(self._triangles):
            self._at_edge |= {(a, b): (t, c), (b, c): (t, a), (c, a): (t, b)}
        self._sides = self._reflex_corners(region)
        self._region = region
        shapely.prepare(region)
        # The reflex corners, each one's place, and from there its neighbours on its border (itself where several meet).
        self._reflex = np.array(sorted(self._sides), dtype=int)
        rows = [
            (place := self._points[k], *(self._sides[k] or (place, place)))
            for k in self._reflex.tolist()
        ]
        corners = np.array(rows).reshape(-1, 3, 2)
        self._places, *sides = (corners @ [1, 1j]).T
        self._offsets = np.array([side - self._places for side in sides])
        rounding = _ROUNDING * float(np.abs(corners).max(initial=1.0)) ** 2
        self._noise = rounding + 2 * _TOLERANCE * np.abs(self._offsets).max(axis=0)
        self._views: dict[int, tuple[tuple[int, float], ...]] = {}
        self._bends_from = lru_cache(maxsize=1 << 12)(self._bends_at)
        self._enclosing = shapely.buffer(region, 4 * _TOLERANCE, join_style="mitre")
        shapely.prepare(self._enclosing)
        corners = np.array(self._points).reshape(-1, 2)[
            np.array(self._triangles, dtype=int).reshape(-1, 3)
        ]
        self._tree = shapely.STRtree(shapely.polygons(corners))

    def __reduce__(self) -> tuple[type[ShortestPaths], tuple[Any]]:
        """Pickle the region alone, from which the rest is prepared again."""
        return type(self), (self._region,)

    def _triangulate(self, region: Any) -> None:
        if region.is_empty:
            return
        pieces = shapely.get_parts(shapely.constrained_delaunay_triangles(region))
        rings = shapely.get_coordinates(pieces).reshape(-1, 4, 2)[:, :3]
        numbers: dict[Point, int] = {}
        for ring in rings.tolist():
            a, b, c = (numbers.setdefault((x, y), len(numbers)) for x, y in ring)
            turn = orientation(*(tuple(corner) for corner in ring))
            if turn:
                self._triangles.append((a, b, c) if turn > 0 else (c, b, a))
        self._points = list(numbers)

    def _reflex_corners(self, region: Any) -> dict[int, tuple[Point, Point] | None]:
        """Return the neighbours on the border of each corner where a path may bend; None where several borders meet."""
        numbers = {point: number for number, point in enumerate(self._points)}
        sides: dict[int, tuple[Point, Point] | None] = {}
        met: set[int] = set()
        for ring in shapely.get_rings(
            shapely.get_parts(shapely.orient_polygons(region))
        ):
            points = [(x, y) for x, y in ring.coords[:-1]]
            for before, point, after in zip(
                points[-1:] + points[:-1], points, points[1:] + points[:1], strict=True
            ):
                if (number := numbers.get(point)) is None:
                    continue
                if number in met:
                    sides[number] = None
                elif orientation(before, point, after) <= _TOLERANCE * math.dist(
                    before, after
                ):
                    # Nearly straight ones too: points of a side may be outside of it, and see no farther.
                    sides[number] = (before, after)
                met.add(number)
        return sides

    def _containers(self, point: Point) -> list[int]:
        """Return the triangles that hold a point, to within the tolerance."""
        return sorted(
            self._tree.query(shapely.Point(point), "dwithin", _TOLERANCE).tolist()
        )

    def contains(self, point: npt.ArrayLike) -> bool:
        """Return whether a point lies in the region, to within 1e-9."""
        return bool(
            shapely.dwithin(self._region, shapely.Point(_pair(point)), _TOLERANCE)
        )

    def _seen(
        self,
        point: Point,
        containers: Iterable[int],
        goal: tuple[Point, frozenset[int]] | None,
    ) -> set[int]:
        """Return the reflex corners that a point sees, and −1 if it sees the goal, by widening cones."""
        points, triangles, at_edge, sides = (
            self._points,
            self._triangles,
            self._at_edge,
            self._sides,
        )
        target, holding = goal or (point, frozenset())
        seen: set[int] = set()
        # Into the triangle behind the edge (right, left), within the cone of the points `low` and `high`.
        stack: list[tuple[int, int, Point, Point]] = []
        for t in containers:
            if t in holding:
                seen.add(_DIRECT)
            for k in range(3):
                right, left = triangles[t][k], triangles[t][(k + 1) % 3]
                a, b = points[right], points[left]
                if orientation(point, a, b) > 0:
                    seen.update(number for number in (right, left) if number in sides)
                    stack.append((right, left, a, b))
        while stack:
            right, left, low, high = stack.pop()
            if (left, right) not in at_edge:
                continue
            behind, apex = at_edge[left, right]
            if (
                behind in holding
                and orientation(point, low, target) >= 0
                and orientation(point, target, high) >= 0
            ):
                seen.add(_DIRECT)
            place = points[apex]
            above, below = (
                orientation(point, low, place),
                orientation(point, place, high),
            )
            if apex in sides and above >= 0 and below >= 0:
                seen.add(apex)
            if above > 0:
                stack.append((right, apex, low, place if below >= 0 else high))
            if below > 0:
                stack.append((apex, left, place if above >= 0 else low, high))
        return seen

    def _bends(
        self, line: Complexes, corners: Any = slice(None)
    ) -> npt.NDArray[np.bool_]:
        """Return whether lines may bend around reflex corners: both sides of a corner lie on one side of its line.

        Also if a line is along a side, to within the tolerance.
        """
        first, second = (
            line.real * side.imag - line.imag * side.real
            for side in self._offsets[:, corners]
        )
        near = np.minimum(np.abs(first), np.abs(second)) <= self._noise[corners]
        return np.asarray((first * second >= 0) | near)

    def _tangent(self, corner: int) -> list[int]:
        """Return the corners whose line to a given one may bend around both: few along a fine curve."""
        row = np.searchsorted(self._reflex, corner)
        line = self._places - self._places[row]
        both = self._bends(line, row) & self._bends(line)
        both[row] = False
        return [*map(int, self._reflex[both])]

    def _in_region(self, lines: Any) -> npt.NDArray[np.bool_]:
        """Return whether straight lines, shape (k, 2, 2), lie in the region; one along its border may be missed."""
        return np.asarray(
            shapely.covers(
                self._region, shapely.linestrings(np.asarray(lines).reshape(-1, 2, 2))
            )
        )

    def _view(self, corner: int) -> tuple[tuple[int, float], ...]:
        """Return the corners to which a path may go on from a corner, with distances."""
        if corner not in self._views:
            place, others = self._points[corner], self._tangent(corner)
            if len(others) > _FEW:
                around = [
                    t for t in self._containers(place) if corner in self._triangles[t]
                ]
                seen = self._seen(place, around, None)
                inside = np.array([other in seen for other in others])
            else:
                inside = self._in_region(
                    [(place, self._points[other]) for other in others]
                )
            self._views[corner] = tuple(
                (k, math.dist(place, self._points[k])) for k in compress(others, inside)
            )
        return self._views[corner]

    def _bends_at(self, point: Point) -> tuple[list[int], dict[int, float]]:
        """Return the triangles that hold a point, and the corners at which a path from there may bend, with distances.

        Each point of a loop is the end of one leg and the start of the next, and often of the next request too.
        """
        holding = self._containers(point)
        seen, touched = (
            self._seen(point, holding, None),
            self._reflex[self._bends(self._places - complex(*point))],
        )
        return holding, {
            k: math.dist(point, self._points[k]) for k in touched.tolist() if k in seen
        }

    def path(self, start: npt.ArrayLike, end: npt.ArrayLike) -> FloatArray | None:
        """Return the shortest path between two points: the start, its bends and the end, shape (k, 2).

        None if an end lies outside or in another part.
        """
        start, end = _pair(start), _pair(end)
        if start != end and self._in_region([(start, end)])[0]:
            return np.array([start, end])
        (here, first), (there, last) = self._bends_from(start), self._bends_from(end)
        if not here or not there:
            return None
        if start == end:
            return np.array([start])
        along = shapely.covers(
            self._enclosing, shapely.linestrings([start, end])
        )  # perhaps along the border
        if along and _DIRECT in self._seen(start, here, (end, frozenset(there))):
            return np.array([start, end])
        if not last:
            return None
        visited = _cheapest(
            first, last, self._view, lambda corner: math.dist(self._points[corner], end)
        )
        if visited is None:
            return None
        bends = [self._points[corner] for corner in visited]
        return np.array(
            [start, *(bend for bend in bends if bend not in (start, end)), end]
        )

    def paths_around(
        self, legs: Sequence[tuple[Point, Point]], polygons: npt.NDArray[np.object_]
    ) -> list[FloatArray | None]:
        """Return the shortest paths, as :meth:`path` does, between pairs of points, that do not enter polygons either.

        The points, within ±π, lie in the region and are clear of the polygons, which are clear of each other; those of
        a pair differ. Where the path in the region meets a polygon, a path in the plane bends at corners of polygons
        alone; if it lies inside the region, it is the shortest there. For other pairs the region's own corners join the
        search. Polygons count once a path meets them. Some paths along borders, around many corners or polygons with
        holes are None.
        """
        ends = np.array(legs).reshape(-1, 2, 2)
        lines: Any = shapely.linestrings(ends)
        found: list[FloatArray | None] = [*ends]
        for k in compress(
            range(len(legs)), np.logical_not(shapely.covers(self._region, lines))
        ):
            found[k] = self.path(*ends[k])
            lines[k] = _line_of(found[k])
        self._bends_from.cache_clear()  # in flight the points are other ones each time
        if not len(polygons):
            return found
        near: Any = shapely.dwithin(
            polygons[:, None], lines, ROUND_OFF
        )  # twice as fast as whether they intersect
        left, met = [*compress(range(len(legs)), near.any(axis=0))], near.any(axis=1)
        for in_region in (False, True):
            left, blocked = [], left
            while blocked:
                around = polygons[met]
                again: list[FloatArray | None] = [None] * len(blocked)
                few = shapely.get_num_coordinates(around).sum() <= _MOST_CORNERS
                if few and not shapely.get_num_interior_rings(around).any():
                    again = self._searched(
                        [legs[k] for k in blocked], around, in_region
                    )
                for k, path in zip(blocked, again, strict=True):
                    found[k] = path
                lines = [*map(_line_of, again)]
                near = shapely.dwithin(polygons[~met, None], lines, ROUND_OFF)
                met[~met], meets = near.any(axis=1), near.any(axis=0)
                left += compress(
                    blocked, ~(meets | shapely.contains_properly(self._region, lines))
                )
                blocked = [*compress(blocked, meets)]
        return found

    @cached_property
    def sights(self) -> npt.NDArray[np.int_]:
        """The lines between reflex corners that see each other, by their numbers among these, shape (2, n)."""
        number = {corner: k for k, corner in enumerate(self._reflex.tolist())}
        lines = [
            (k, number[other])
            for corner, k in number.items()
            for other, _ in self._view(corner)
        ]
        pairs = np.array([line for line in lines if line[0] < line[1]], dtype=int)
        return read_only(pairs.reshape(-1, 2).T)

    def _searched(
        self, legs: Sequence[tuple[Point, Point]], polygons: Any, in_region: bool
    ) -> list[FloatArray | None]:
        """Return the shortest paths around polygons, in the region or in the whole plane."""
        number = {
            end: k for k, end in enumerate(dict.fromkeys(chain.from_iterable(legs)))
        }
        around = _Around(
            polygons,
            [complex(*end) for end in number],
            self._places[: None if in_region else 0],
        )
        points, count, own = around.points, len(number), len(number) + around.count
        linked = around.touches[:own]
        if in_region:
            linked = np.hstack([linked, self._bends(points[:own, None] - self._places)])
        linked[count:] &= around.touches[count:].T
        start, end = linked.nonzero()
        end += count
        once = start < end
        pairs = [(number[a], number[b]) for a, b in legs]
        lines = np.concatenate([np.array(pairs).T, [start[once], end[once]]], axis=1)
        lines = lines[:, ~around.entered(lines)]
        if in_region:
            ends = points[lines]
            lines = lines[
                :, shapely.covers(self._region, _straight(ends)) | (ends[0] == ends[1])
            ]
            sights = self.sights + own
            lines = np.hstack([lines, sights[:, ~around.entered(sights)]])
            # Nothing passes between a polygon and a border of the region along which it lies.
            seam = shapely.intersection(
                self._region.boundary, shapely.multipolygons(polygons).boundary
            )
            if seam.length:
                inside = shapely.get_parts(
                    shapely.intersection(self._region, polygons)
                )  # not those behind the border
                seam = shapely.intersection(
                    seam, shapely.union_all(shapely.boundary(inside))
                )
                along = shapely.intersection(seam, _straight(points[lines]))
                lines = lines[:, shapely.length(along) <= _TOLERANCE]
        views: list[list[tuple[int, float]]] = [[] for _ in points]
        lengths = np.abs(points[lines[1]] - points[lines[0]])
        for a, b, length in zip(*lines.tolist(), lengths.tolist(), strict=True):
            views[a].append((b, length))
            if a >= count:
                views[b].append((a, length))
        found: list[FloatArray | None] = []
        for first, last in pairs:
            ahead = np.abs(points - points[last]).tolist()
            nodes = _cheapest(
                dict(views[first]),
                dict(views[last]) | {last: 0.0},
                views.__getitem__,
                ahead.__getitem__,
            )
            bends = [
                node
                for node in nodes or ()
                if points[node] not in (points[first], points[last])
            ]
            found.append(
                None
                if nodes is None
                else points[[first, *bends, last]].view(float).reshape(-1, 2)
            )
        return found


def _line_of(path: FloatArray | None) -> Any:
    """Return a path as a line, None if there is none."""
    return None if path is None else shapely.linestrings(path)


def _straight(ends: Complexes) -> Any:
    """Return the lines between points x + iy, shape (2, n)."""
    return shapely.linestrings(np.stack([ends.T.real, ends.T.imag], axis=-1))


class _Around:
    """Points outside polygons without holes that do not overlap, and exact tests of lines between them, within ±π.

    `points`, x + iy, are the first given ones, the `count` corners of the polygons, and more. `touches`, shape
    (n, count), is whether a line from a point may bend around a corner: both its sides lie on one side of the line.
    """

    def __init__(
        self,
        polygons: npt.NDArray[np.object_],
        first: Sequence[complex],
        more: Complexes,
    ) -> None:
        borders = shapely.get_exterior_ring(shapely.orient_polygons(polygons))
        corners, ring = shapely.get_coordinates(borders, return_index=True)
        places = corners.view(complex)[:, 0]
        # A border ends with its first point, and may repeat others; its inside is on the left.
        begins = ((ring[1:] == ring[:-1]) & (places[1:] != places[:-1])).nonzero()[0]
        self._corners, self.count, self._first = places[begins], len(begins), len(first)
        self.points: Complexes = np.concatenate([first, self._corners, more])
        corner, counts = np.arange(self.count), np.bincount(ring[begins])
        self._before, after_last = corner - 1, counts.cumsum()
        self._before[after_last - counts] = after_last - 1
        following = places[begins + 1]
        sides = orientations(self._corners, following, self.points[:, None])
        self._convex = sides[len(first) + self._before, corner] > 0
        self.touches = (sides * sides[:, self._before] <= 0) & self._convex
        # Whether a point is left of the side before a corner, and of the one after it; given ones are outside, and
        # inside by rounding only.
        sides[: len(first)] -= ROUND_OFF * np.abs(following - self._corners)
        self._left = sides[:, self._before] > 0, sides > 0

    def entered(self, lines: npt.NDArray[np.int_]) -> npt.NDArray[np.bool_]:
        """Return whether lines between points, by their numbers, shape (2, k), enter a polygon; they touch corners."""
        points, (before, after), (start, end) = self.points, self._left, lines
        turns = orientations(points[start, None], points[end, None], self._corners)
        found = (
            (turns * turns[:, self._before] < 0) & (before[start] != before[end])
        ).any(axis=1)
        # From a corner on the line into the angle between its sides; lines that end at a corner touch it there.
        straight = turns == 0
        if np.count_nonzero(straight) == np.count_nonzero(
            (lines >= self._first) & (lines < self._first + self.count)
        ):
            return np.asarray(found)
        line, corner = straight.nonzero()
        ends = lines[:, line]
        here, there = points[ends] - self._corners[corner]
        first, second = before[ends, corner], after[ends, corner]
        into = np.where(self._convex[corner], first & second, first | second).any(
            axis=0
        )
        found[line[into & (here.real * there.real + here.imag * there.imag <= 0)]] = (
            True
        )
        return np.asarray(found)


def _cheapest(
    first: dict[int, float],
    last: dict[int, float],
    onward: Callable[[int], Iterable[tuple[int, float]]],
    ahead: Callable[[int], float],
) -> list[int] | None:
    """Return the corners of the shortest path by A*, None if there is no path.

    `first` and `last` are the lengths of the lines from the start, and to the end; `onward` returns the corners after a
    corner with distances, `ahead` a lower bound of what is left.
    """
    best, parent, final, shortest = dict(first), dict[int, int](), _DIRECT, math.inf
    heap = [
        (length + ahead(corner), corner, length) for corner, length in first.items()
    ]
    heapify(heap)
    while heap and heap[0][0] < shortest:
        _, corner, reached = heappop(heap)
        if reached > best[corner]:
            continue
        if corner in last and reached + last[corner] < shortest:
            shortest, final = reached + last[corner], corner
        for other, length in onward(corner):
            total = reached + length
            if total < best.get(other, math.inf):
                best[other], parent[other] = total, corner
                heappush(heap, (total + ahead(other), other, total))
    if final == _DIRECT:
        return None
    visited = [final]
    while visited[-1] in parent:
        visited.append(parent[visited[-1]])
    return visited[::-1]
