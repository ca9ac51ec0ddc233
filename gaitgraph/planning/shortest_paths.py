"""Shortest paths inside polygons in the plane.

A shortest path bends only at reflex corners of the region, and is tangent there: both sides of the corner lie on one
side of each of its lines (Lozano-Pérez and Wesley, 1979). So it is the shortest path in the graph whose nodes are its
ends and the reflex corners, and whose edges are the tangent lines inside the region. A* searches that graph; the edges
of a corner are computed when the search first needs them, and kept.

Points are complex numbers x + iy here, and coordinates of the order of 1, as angles are.
"""

from __future__ import annotations

from functools import cache, lru_cache
from heapq import heapify, heappop, heappush
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import shapely

from gaitgraph.errors import InputError
from gaitgraph.tolerances import SAME_ANGLE

if TYPE_CHECKING:
    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.invertibility.matrices import BoolArray

Complexes = npt.NDArray[np.complex128]
View = tuple[tuple[int, float], ...]  # corners that can be seen, with distances

_ROUNDING = 1e-11  # rounding may put lines along a border so far outside
# Views from points that are not corners, a kilobyte each: more waypoints than this are ordered a tenth slower.
_KEPT = 256


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
        self._region = region
        self._enlarged = shapely.buffer(region, _ROUNDING, join_style="mitre")
        shapely.prepare([region, self._enlarged])
        self._corners, self._before, self._after = _reflex_corners(region)
        longest_side = np.maximum(np.abs(self._before), np.abs(self._after))
        self._noise = SAME_ANGLE * longest_side
        self._view = cache(self._corners_seen_from)
        self._view_from = lru_cache(maxsize=_KEPT)(self._seen_from)

    def __reduce__(self) -> tuple[type[ShortestPaths], tuple[Any]]:
        """Pickle the region alone, from which the rest is prepared again."""
        return type(self), (self._region,)

    def contains(self, point: npt.ArrayLike) -> bool:
        """Return whether a point lies in the region, to within 1e-9."""
        return self._nearest(point) is not None

    def path(self, start: npt.ArrayLike, end: npt.ArrayLike) -> FloatArray | None:
        """Return the shortest path between two points: the start, its bends and the end, shape (k, 2).

        None if an end lies outside or in another part.
        """
        first, last = self._nearest(start), self._nearest(end)
        if first is None or last is None:
            return None
        points = np.array([start, end], dtype=float)
        if (points[0] == points[1]).all():
            return points[:1]
        corners = self._bends(first, last)
        if corners is None:
            return None
        bends = self._corners[corners]
        bends = bends[(bends != first) & (bends != last)]
        between = np.column_stack([bends.real, bends.imag])
        return np.concatenate([points[:1], between, points[1:]])

    def _nearest(self, point: npt.ArrayLike) -> complex | None:
        """Return a point, or the nearest one in the region if that is within 1e-9; else None."""
        place = shapely.Point(np.asarray(point, dtype=float))
        if not shapely.dwithin(self._region, place, SAME_ANGLE):
            return None
        if not shapely.covers(self._region, place):
            place = shapely.get_point(shapely.shortest_line(self._region, place), 0)
        return complex(place.x, place.y)

    def _bends(self, start: complex, end: complex) -> list[int] | None:
        """Return the corners of the shortest path between two points, by A*; None if there is no path."""
        if self._sees(start, np.array([end]))[0]:
            return []
        last = {corner for corner, _ in self._view_from(end)}
        ahead = np.abs(self._corners - end).tolist()
        reached = set()
        # By the least length of a path through a corner: the corner, the length to it, and all corners up to it.
        waiting = [
            (length + ahead[corner], corner, length, [corner])
            for corner, length in self._view_from(start)
        ]
        heapify(waiting)
        while waiting:
            _, corner, length, corners = heappop(waiting)
            if corner in last:
                return corners  # and straight on to the end
            if corner in reached:
                continue  # by a shorter path
            reached.add(corner)
            for other, step in self._view(corner):
                if other not in reached:
                    least = length + step + ahead[other]
                    heappush(waiting, (least, other, length + step, [*corners, other]))
        return None

    def _corners_seen_from(self, corner: int) -> View:
        """Return the corners to which a path may go on from a corner."""
        lines = self._corners - self._corners[corner]
        sides = self._before[corner], self._after[corner]
        tangent = self._touches(lines)
        tangent &= _is_tangent(lines, *sides, self._noise[corner])
        tangent[corner] = False
        return self._seen(self._corners[corner], tangent)

    def _seen_from(self, point: complex) -> View:
        """Return the corners to which a path may go on from a point."""
        return self._seen(point, self._touches(self._corners - point))

    def _touches(self, lines: Complexes) -> BoolArray:
        """Return whether lines to the corners may bend around them."""
        return _is_tangent(lines, self._before, self._after, self._noise)

    def _seen(self, point: complex, chosen: BoolArray) -> View:
        """Return those of the chosen corners that a point sees, with their distances."""
        numbers = np.flatnonzero(chosen)
        numbers = numbers[self._sees(point, self._corners[numbers])]
        distances = np.abs(self._corners[numbers] - point)
        return tuple(zip(numbers.tolist(), distances.tolist(), strict=True))

    def _sees(self, point: complex, others: Complexes) -> BoolArray:
        """Return whether the straight lines from a point to others lie in the region."""
        lines = np.empty((len(others), 2, 2))
        lines[:, 0] = point.real, point.imag
        lines[:, 1, 0] = others.real
        lines[:, 1, 1] = others.imag
        return np.asarray(shapely.covers(self._enlarged, shapely.linestrings(lines)))


def _is_tangent(lines: Any, before: Any, after: Any, noise: Any) -> BoolArray:
    """Return whether both sides of a corner lie on one side of a line through it, or one lies along the line."""
    first = (np.conj(lines) * before).imag
    second = (np.conj(lines) * after).imag
    along = np.minimum(np.abs(first), np.abs(second)) <= noise
    return np.asarray((first * second >= 0) | along)


def _reflex_corners(region: Any) -> tuple[Complexes, Complexes, Complexes]:
    """Return the corners where a path may bend, and the vectors to the corners before and after on the border.

    Where borders meet these vectors are zero: a path may bend there in any direction.
    """
    rings = shapely.get_rings(shapely.get_parts(shapely.orient_polygons(region)))
    borders = [np.empty((3, 0), dtype=complex)]
    for ring in rings:
        # The last corner is the first again. The region is on the left.
        closed = shapely.get_coordinates(ring).view(complex)[:, 0]
        around = np.concatenate([closed[-2:-1], closed])
        borders.append(np.stack([around[:-2], around[1:-1], around[2:]]))
    before, corners, after = np.concatenate(borders, axis=1)
    corners, first, counts = np.unique(corners, return_index=True, return_counts=True)
    before = before[first] - corners
    after = after[first] - corners
    before[counts > 1] = after[counts > 1] = 0.0
    reflex = (np.conj(before) * after).imag >= 0
    return corners[reflex], before[reflex], after[reflex]
