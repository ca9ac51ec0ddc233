"""A region prepared for shortest ways in it, and what a loop is sought for."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Literal

from gaitgraph.invertibility.matrices import Coefficients, coefficients_of
from gaitgraph.planning.shortest_paths import ShortestPaths

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gaitgraph.planning.request import PlanRequest, Point
    from gaitgraph.surface.region import Region, Zones
    from gaitgraph.vehicle import Vehicle

__all__ = ["Asked", "Leg", "PreparedRegion", "Use", "length_of", "prepared_region", "region_of"]

Use = Literal["flyable", "valid"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Leg:
    """The shortest way between two points: its points, its length, and a length that none falls below [rad]."""

    points: tuple[Point, ...]
    length: float
    lower_bound: float


class PreparedRegion:
    """An admissible region, prepared for shortest paths: what is computed for one loop serves the next.

    Parameters
    ----------
    region
        The region in which loops are allowed.
    """

    def __init__(self, region: Region) -> None:
        self.region = region
        self.paths = ShortestPaths(region.inner)

    @cached_property
    def _around(self) -> ShortestPaths:
        """Shortest paths in the figure that encloses the region; the same ones if its borders are all straight."""
        same = self.region.outer.equals(self.region.inner)
        return self.paths if same else ShortestPaths(self.region.outer)

    def entry(self, point: Point) -> Point | None:
        """Return the point itself if loops may pass it, else the nearest that they may, if it is near enough, or None.

        Near enough is what the polygon of a curved border leaves out; the way from there to the point is judged with
        the whole loop.
        """
        if self.paths.contains(point):
            return point
        nearest = self.region.nearest(point)
        return nearest if nearest is not None and math.dist(nearest, point) <= 4 * self.region.accuracy else None

    def leg(self, start: Point, end: Point) -> Leg | None:
        """Return the shortest way from one point to another, or None."""
        first, last = self.entry(start), self.entry(end)
        if first is None or last is None:
            return None
        found = self.paths.path(first, last)
        if found is None:
            return None
        points = _without_repeats([start, *((float(x), float(y)) for x, y in found), end])
        length = length_of(points)
        if len(points) == 2 or self._around is self.paths:
            return Leg(points=points, length=length, lower_bound=length)
        around = self._around.path(start, end)
        # An end that even the outer figure lacks is no point of the region: only the straight line is certain.
        bound = math.dist(start, end) if around is None else length_of([(float(x), float(y)) for x, y in around])
        return Leg(points=points, length=length, lower_bound=min(length, bound))

    def loop(self, points: Sequence[Point]) -> list[Leg] | int:
        """Return the legs of the shortest closed loop through points in order, or which leg has none, from 0."""
        legs = []
        for k, (a, b) in enumerate(pairwise([*points, points[0]])):
            leg = self.leg(a, b)
            if leg is None:
                return k
            legs.append(leg)
        return legs


def _without_repeats(points: Sequence[Point]) -> tuple[Point, ...]:
    return tuple(point for k, point in enumerate(points) if k == 0 or point != points[k - 1])


def length_of(points: Sequence[Point]) -> float:
    """Return the length of a chain of points [rad]."""
    return sum(math.dist(a, b) for a, b in pairwise(points))


@lru_cache(maxsize=32)
def prepared_region(
    vehicle: Vehicle,
    use: Use,
    color: Any,
    sign: Any,
    coefficients: Literal["published", "exact"],
    floor: float,
    zones: Zones | None,
    accuracy: float,
) -> PreparedRegion:
    """Return the admissible region of one color and sign of R, prepared; kept for the next request that needs it.

    With the use "valid" the floor is that of a robust loop, 0 for none.
    """
    from gaitgraph.surface.admissible import admissible_region, singular_value_region

    region = admissible_region(
        vehicle,
        use=use,
        color=color,
        sign=sign,
        coefficients=coefficients_of(vehicle, coefficients),
        floor=floor,
        zones=zones,
        accuracy=accuracy,
    )
    if use == "valid" and floor > 0:
        region = region & singular_value_region(floor, vehicle, accuracy=accuracy)
    return PreparedRegion(region)


@dataclass(frozen=True, slots=True, kw_only=True)
class Asked:
    """One color, sign of R and use for which a loop is sought."""

    request: PlanRequest
    coefficients: Coefficients
    color: Any
    sign: str
    use: Use

    def prepared(self, floor: float | None = None) -> PreparedRegion:
        """Return the region, with the request's floor of the least singular value or another one."""
        request = self.request
        if floor is None:
            floor = request.floor if self.use == "flyable" else 0.0
        return prepared_region(
            request.vehicle,
            self.use,
            self.color,
            self.sign,
            self.coefficients.kind,
            floor,
            request.zones,
            request.accuracy,
        )


def region_of(request: PlanRequest, color: str, sign: str, use: Use) -> Region:
    """Return the region in which loops of one color and sign of R are planned for a request."""
    coefficients = coefficients_of(request.vehicle, request.coefficients)
    return Asked(request=request, coefficients=coefficients, color=color, sign=sign, use=use).prepared().region
