"""The any-angle method: the shortest loop of a branch, or why there is none.

The straight loop through the waypoints is tried first: if it is admissible along its whole length, nothing is shorter.
Otherwise shortest paths are found in a polygon around the admissible region, which gives a lower bound of every loop,
and again in the polygon inside the true borders, by at most the accuracy, if they leave that.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from dataclasses import replace
from functools import cache, lru_cache
from itertools import groupby, pairwise
from time import monotonic
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import shapely

from gaitgraph._lazy import cached_property
from gaitgraph.errors import InputError
from gaitgraph.graph.walks import quanta_of, shortest_order
from gaitgraph.invertibility.matrices import (
    least_singular_value,
    level_determinant,
)
from gaitgraph.invertibility.segment_bounds import least_singular_value_along
from gaitgraph.planning.loop import Loop
from gaitgraph.planning.shortest_paths import ShortestPaths
from gaitgraph.surface.admissible import admissible_region
from gaitgraph.surface.flight_regions import hover_quarter_of, singular_value_region
from gaitgraph.surface.sheets import RELATION
from gaitgraph.tolerances import SAME_ANGLE

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from gaitgraph.planning.branch import Branch, Refusal
    from gaitgraph.planning.request import PlanRequest, Point
    from gaitgraph.surface.flight_regions import Quarter
    from gaitgraph.surface.region import Region

_KEPT = 256  # entries of waypoints
_TRIED = 100  # waypoints whose order is found in a tenth of a second
_ROBUST_STEPS = 2**22  # of the range of least singular values: to 1e-6


def any_angle_loop(branch: Branch) -> Loop | Refusal:
    """Return the shortest loop of a branch, or why there is none."""
    request = branch.request
    branch.search.progress(
        f"searching {branch.color} loops with {RELATION[branch.sign]}"
    )
    robust = request.objective == "robust" and branch.color == "red"
    if not _is_reordered(request):
        straight = straight_loop(branch)
        if straight is not None and (not robust or _is_most_robust(straight)):
            return straight
    if not robust:
        return _loop_in(_region_around(branch), branch)
    loop = _loop_in(_most_robust_region(branch), branch)
    if isinstance(loop, Loop):
        loop = replace(loop, lower_bound=None)  # a less robust one may be shorter
    return loop


def shortest_path(branch: Branch) -> list[Point] | None:
    """Return the shortest path from the first waypoint of a branch to the last, or None if there is none."""
    waypoints = branch.request.waypoints
    if straight_loop(branch) is not None:
        return list(waypoints)
    leg = _region_around(branch).leg(waypoints[0], waypoints[-1])
    return None if leg is None else leg.points


# -- The straight loop


def straight_loop(branch: Branch) -> Loop | None:
    """Return the loop straight from waypoint to waypoint if its checks say that it is what the branch requires."""
    request = branch.request
    points, zones = request.waypoints, request.zones
    ends = [*points[1:], points[0]]
    if zones is not None and not zones.allow_segments(points, ends).all():
        return None
    try:
        path = branch.lifted(points)
    except InputError:
        return None  # it leads through a fibre of a curved sheet
    # At α1 = ±π/2 both signs of R have a root, of which one is lifted.
    if branch.of_sign(path.R).min() <= 0:
        return None
    loop = Loop(
        path=path,
        sign=branch.sign,
        order=tuple(range(len(points))),
        request=request,
        lower_bound=sum(map(math.dist, points, ends)),
    )
    if not getattr(loop.checks, branch.require):
        return None
    if branch.servo_margin and not loop.bears_servo_errors:
        return None
    return loop


def _is_most_robust(loop: Loop) -> bool:
    """Return whether the least singular value along a straight loop is that of a waypoint: none has a higher one."""
    starts, ends, vehicle = loop.path.alpha, loop.path.ends, loop.path.vehicle
    along = least_singular_value_along(starts, ends, vehicle, tolerance=1e-7)
    at_waypoints = least_singular_value(starts, vehicle)
    return bool(along.lower.min() >= at_waypoints.min() - 1e-6)


# -- The loop in a region


def _is_reordered(request: PlanRequest) -> bool:
    """Return whether an order of the waypoints is sought: of up to three all orders are as long."""
    return request.any_order and len(request.waypoints) > 3


def _loop_in(region: PreparedRegion, branch: Branch) -> Loop | Refusal:
    """Return the shortest loop in a region, or why there is none."""
    waypoints = branch.request.waypoints
    outside = first_outside(branch, region)
    if outside is not None:
        return outside

    @cache
    def leg_between(first: int, second: int) -> Leg | None:
        return region.leg(waypoints[first], waypoints[second])

    order = tuple(range(len(waypoints)))
    in_time = True
    if _is_reordered(branch.request):
        order, in_time = _shortest_order(branch, leg_between)
    points: list[Point] = []
    lower_bound = 0.0
    for ends in pairwise([*order, order[0]]):
        leg = leg_between(*ends)
        if leg is None:
            return _separated(branch, region.region, ends)
        points += leg.points[:-1]
        lower_bound += leg.lower_bound
    return Loop(
        path=branch.lifted(points or waypoints[:1]),
        sign=branch.sign,
        order=order,
        request=branch.request,
        lower_bound=lower_bound,
        in_time=in_time,
    )


def _shortest_order(
    branch: Branch, leg_between: Callable[[int, int], Leg | None]
) -> tuple[tuple[int, ...], bool]:
    """Return the order of waypoints that makes a short loop, and whether the search for it ended in time.

    Half of the time until a deadline is for measuring paths; straight lines stand for those that are left.
    """
    search, waypoints = branch.search, branch.request.waypoints
    number = len(waypoints)
    half_time = (monotonic() + search.until) / 2
    lengths: dict[tuple[int, int], float] = {}
    is_measured = True
    for first in range(number):
        search.progress(f"measuring the paths from waypoint {first + 1} of {number}")
        for second in range(first + 1, number):
            length = math.dist(waypoints[first], waypoints[second])
            is_measured = monotonic() <= half_time
            if is_measured:
                leg = leg_between(first, second)
                if leg is None:
                    return tuple(range(number)), True
                length = length_of(leg.points)
            lengths[first, second] = quanta_of(length)
    is_hurried = _is_hurried(waypoints, search.until)
    order = shortest_order(number, lambda a, b: lengths[a, b], nearest_next=is_hurried)
    return order or tuple(range(number)), is_measured and not is_hurried


def _is_hurried(waypoints: Sequence[Point], until: float) -> bool:
    """Return whether the search for a good order, which cannot be stopped, would end after a deadline.

    It takes the cube of the number of waypoints, and is tried with a part of them.
    """
    if math.isinf(until) or len(waypoints) <= _TRIED:
        return False
    tried = waypoints[:_TRIED]
    begin = monotonic()
    shortest_order(_TRIED, lambda a, b: quanta_of(math.dist(tried[a], tried[b])))
    seconds = (monotonic() - begin) * (len(waypoints) / _TRIED) ** 3
    return monotonic() + seconds > until


def first_outside(branch: Branch, region: PreparedRegion) -> Refusal | None:
    """Return why the first waypoint outside a region cannot be passed, or None if all are in it."""
    for k, point in enumerate(branch.request.waypoints):
        if region.entry(point) is None:
            why = region.region.why_not(point)
            why = why or "it lies outside the admissible region"
            on_sheet = branch.lifted([point])
            R = level_determinant(on_sheet.alpha[0], on_sheet.coefficients)
            return branch.refused_at(k, f": {why}", float(R))
    return None


def _separated(branch: Branch, region: Region, ends: Sequence[int]) -> Refusal:
    """Return that two waypoints lie in different parts of a region."""
    sizes = []
    for k in ends:
        part = region.component_of(branch.request.waypoints[k])
        if part is not None:
            sizes.append(f"{region.components[part].area:.3g}")
    wall = "the border: move one"
    if branch.is_curved:  # in squares a narrow passage is closed
        wall = f"the border, which is known to {region.accuracy:g} rad: try the method grid, or move one"
    if branch.request.zones is not None:
        wall = "keep_out or keep_in: move these or one"
    parts = f"which lie in parts of {' and '.join(sizes)} rad²"
    return branch.separation(ends, f"{wall} of the waypoints, {parts}")


# -- Regions


class Leg(NamedTuple):
    """The shortest path between two points, and a lower bound of the length of all paths [rad]."""

    points: list[Point]
    lower_bound: float


class PreparedRegion:
    """An admissible region with what shortest paths in it need, which is kept for the next loop.

    With `strict` loops pass no point at which a condition of the region is broken.
    """

    def __init__(self, region: Region, *, strict: bool = False) -> None:
        self.region = region
        self.strict = strict
        self.entry = lru_cache(maxsize=_KEPT)(self._entry)

    @cached_property
    def _paths(self) -> ShortestPaths:
        """Shortest paths in the region."""
        return ShortestPaths(self.region.inner)

    @cached_property
    def _around(self) -> ShortestPaths:
        """Shortest paths in the polygon that encloses the region; the same ones if its borders are all straight."""
        if self.region.outer.equals(self.region.inner):
            return self._paths
        return ShortestPaths(self.region.outer)

    def _entry(self, point: Point) -> Point | None:
        """Return the point itself if loops may pass it, else the nearest that they may pass, or None if it is far."""
        nearest = self.region.nearest(point)
        if nearest is None or nearest == point:
            return nearest
        conditions = self.region.conditions
        if self.strict and any(limit.broken_at(*point) for limit in conditions):
            return None
        # The polygon of a curved border leaves this much out; the segment from there is checked with the loop.
        reach = 4 * self.region.accuracy
        if math.dist(nearest, point) > max(reach, SAME_ANGLE):
            return None
        return nearest

    def joins(self, points: Sequence[Point]) -> bool:
        """Return whether paths join points, one or more."""
        entries = list(filter(None, map(self.entry, points)))
        return len(entries) == len(points) and self.region.joined(*entries)

    def leg(self, start: Point, end: Point) -> Leg | None:
        """Return the shortest path from one point to another, or None."""
        first, last = self.entry(start), self.entry(end)
        if first is None or last is None:
            return None
        # Squares have so many corners that looking through all of them takes seconds.
        if self.strict and not self.region.joined(first, last):
            return None
        around = self._around.path(start, end)
        path = around
        # What is shortest in the polygon around the region is so in the region only if it lies there.
        if around is None or not self.region.inner.covers(
            shapely.linestrings([start, *around.tolist()])
        ):
            path = self._paths.path(first, last)
        if path is None:
            return None
        # An entry is within the accuracy of its waypoint: both as corners would make a step too short to be timed.
        inner = [(float(x), float(y)) for x, y in path[1:-1]]
        points = [point for point, _ in groupby([start, *inner, end])]
        # An end outside even that polygon is not in the region: only the straight line is certain.
        shortest = math.dist(start, end)
        if around is not None:
            shortest = length_of(around.tolist())
        return Leg(points, min(length_of(points), shortest))


def length_of(points: Sequence[Sequence[float]]) -> float:
    """Return the length of a path [rad]."""
    return sum(math.dist(a, b) for a, b in pairwise(points))


def _region_around(branch: Branch) -> PreparedRegion:
    """Return the part of the region of a branch in which all its loops are: no loop leaves a rectangle of hover thrusts."""
    if branch.require == "valid" or branch.is_curved:
        return prepared_region(branch)
    request = branch.request
    quarter = hover_quarter_of(request.waypoints, request.vehicle)
    return prepared_region(branch, quarter=quarter)


def prepared_region(
    branch: Branch,
    level: float = 0.0,
    quarter: Quarter | None = None,
) -> PreparedRegion:
    """Return the region in which loops of a branch are planned, or where they also keep a least singular value."""
    request = branch.request
    flyable = branch.require == "flyable"
    return _prepared(
        level,
        vehicle=request.vehicle,
        require=branch.require,
        color=branch.color,
        sign=branch.sign,
        coefficients=branch.search.coefficients,
        floor=request.floor if flyable else 0.0,
        zones=request.zones,
        accuracy=request.accuracy,
        servo_margin=0.0 if branch.is_curved else branch.servo_margin,
        quarter=quarter,
    )


@lru_cache(maxsize=32)
def _prepared(level: float, **asked: Any) -> PreparedRegion:
    """Return a prepared region, kept for the next request."""
    region = admissible_region(**asked)
    vehicle = asked["vehicle"]
    if level:
        region &= singular_value_region(level, vehicle, accuracy=asked["accuracy"])
    # Beside a fibre of a curved sheet segments from outside the region may lead through it.
    return PreparedRegion(region, strict=vehicle.asymmetry is not None)


def _most_robust_region(branch: Branch) -> PreparedRegion:
    """Return where the least singular value keeps the highest level that still joins all waypoints."""
    waypoints = branch.request.waypoints
    on_red = np.array(waypoints)[:, [0, 1, 0, 1]]
    at_waypoints = least_singular_value(on_red, branch.request.vehicle)
    low = branch.request.floor if branch.require == "flyable" else 0.0
    high = float(at_waypoints.min())
    lowest = prepared_region(branch)
    if high <= low or not lowest.joins(waypoints):
        return lowest
    step = (high - low) / _ROBUST_STEPS
    # Mostly a waypoint has the least value, and every step would go up: where that ends is tried first.
    for level in (high, high - step):
        region = prepared_region(branch, level)
        if region.joins(waypoints):
            return region

    def is_cut(number: int) -> bool:
        return not prepared_region(branch, low + number * step).joins(waypoints)

    joining = bisect_left(range(1, _ROBUST_STEPS), True, key=is_cut)
    return prepared_region(branch, low + joining * step)
