"""The any-angle method: the shortest loop of a branch, or why there is none.

The straight loop through the waypoints is tried first: if it is admissible along its whole length, nothing is shorter.
Otherwise shortest paths are found in a polygon around the admissible region, which gives a lower bound of every loop,
and again in the polygon inside the true borders, by at most the accuracy, if they leave that.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache, cached_property, lru_cache
from itertools import groupby, pairwise
from time import monotonic
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import shapely

from gaitgraph.errors import InputError
from gaitgraph.graph.walks import (
    MOST_IN_TIME,
    QUANTA_PER_RADIAN,
    quanta_of,
    shortest_order,
)
from gaitgraph.invertibility.matrices import (
    least_singular_value,
    level_determinant,
    noise_of,
)
from gaitgraph.invertibility.segment_bounds import (
    least_level_determinant,
    least_singular_value_along,
    segments_fly,
)
from gaitgraph.planning.branch import Branch, Refusal
from gaitgraph.planning.loop import Loop
from gaitgraph.surface.region import region_of
from gaitgraph.surface.sheets import RELATION, color_codes, red_label, sheet_jumps

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from gaitgraph.planning.request import PlanRequest, Point
    from gaitgraph.planning.shortest_paths import ShortestPaths
    from gaitgraph.surface.region import Region

_MOST_NEAREST = 8
_ROBUST_STEPS = 22  # halvings of the range of least singular values: to 1e-6
_COARSE = 1e-3  # accuracy of the regions that decide most of these steps [rad]


def any_angle_loop(
    branch: Branch, progress: Callable[[str], None] | None, until: float | None = None
) -> Loop | Refusal:
    """Return the shortest loop of a branch, or why there is none."""
    request = branch.request
    if progress is not None:
        progress(f"searching {branch.color} loops with {RELATION[branch.sign]}")
    rootless = branch.rootless()
    if rootless:
        return branch.rootless_at(rootless[0])
    reorders = request.any_order and len(request.waypoints) > 3
    robust = request.objective == "robust" and branch.color == "red"
    if not reorders:
        straight = _straight_loop(branch, robust=robust)
        if straight is not None:
            return straight
    if robust:
        region = _most_robust_region(branch)
        loop = _loop_in(region, branch, reorders, progress, until)
        if isinstance(loop, Loop):
            loop = replace(loop, lower_bound=None)  # a less robust one may be shorter
        return loop
    return _loop_in(prepared_region(branch), branch, reorders, progress, until)


def shortest_path(branch: Branch) -> Leg | None:
    """Return the shortest path from the first waypoint of a branch to the last, or None if there is none."""
    start, end = branch.request.waypoints[0], branch.request.waypoints[-1]
    if not branch.is_curved and straight_loop_holds(branch):
        return Leg([start, end], math.dist(start, end))
    return prepared_region(branch).leg(start, end)


# -- The straight loop


def _straight_loop(branch: Branch, *, robust: bool) -> Loop | None:
    """Return the straight loop, None unless it meets what is required and no other is better."""
    request = branch.request
    if not _zones_allow(branch):
        return None
    points = request.waypoints
    try:
        path = branch.lifted(points)
    except InputError:
        return None  # it leads through a fibre of a curved sheet
    loop = Loop(
        path=path,
        sign=branch.sign,
        order=tuple(range(len(points))),
        request=request,
        lower_bound=length_of([*points, points[0]]),
    )
    if branch.require == "flyable" and not robust:
        # Which the answer needs anyway. At α1 = ±π/2 both signs of R have a root, of which one is lifted.
        has_sign = (branch.wanted * loop.path.R > 0).all()
        holds = bool(has_sign) and loop.checks.flyable
    else:
        holds = straight_loop_holds(branch)
    if holds and robust:
        holds = _is_most_robust(loop)
    if holds and branch.servo_margin:
        holds = loop.bears_servo_errors
    return loop if holds else None


def _zones_allow(branch: Branch) -> bool:
    """Return whether the request's polygons allow the straight loop."""
    points, zones = branch.request.waypoints, branch.request.zones
    if zones is None:
        return True
    return bool(zones.allow_segments(points, [*points[1:], points[0]]).all())


def straight_loop_holds(branch: Branch) -> bool:
    """Return whether the straight loop meets what is required along its whole length."""
    if not _zones_allow(branch):
        return False
    if branch.require == "flyable":
        return _straight_loop_flies(branch)
    gait = branch.lifted(branch.request.waypoints)
    codes, noise = color_codes(gait.colors), noise_of(branch.coefficients)
    jumps = sheet_jumps(gait.alpha, gait.ends, codes, codes, branch.coefficients)
    least = least_level_determinant(
        gait.alpha,
        gait.ends,
        branch.coefficients,
        sign=branch.wanted,
        tolerance=0.0,
        floor=noise,
    )
    return bool(least.lower.min() >= noise) and not jumps.any()


def _straight_loop_flies(branch: Branch) -> bool:
    request = branch.request
    starts = np.array(request.waypoints)[:, [0, 1, 0, 1]]  # red: α3 = α1 and α4 = α2
    ends = np.roll(starts, -1, axis=0)
    # Where all thrusts push up, the borders of R are straight: R keeps its sign between points of one label.
    labels = red_label(starts[:, 0], starts[:, 1], request.vehicle)
    if not (labels == labels[0]).all() or labels[0].prod() != branch.wanted:
        return False
    return bool(segments_fly(starts, ends, request.floor, request.vehicle).all())


def _is_most_robust(loop: Loop) -> bool:
    """Return whether the least singular value along a straight loop is that of a waypoint: none has a higher one."""
    starts, ends, vehicle = loop.path.alpha, loop.path.ends, loop.path.vehicle
    along = least_singular_value_along(starts, ends, vehicle, tolerance=1e-7)
    at_waypoints = least_singular_value(starts, vehicle)
    return bool(along.lower.min() >= at_waypoints.min() - 1e-6)


# -- The loop in a region


def _loop_in(
    region: PreparedRegion,
    branch: Branch,
    reorders: bool,
    progress: Callable[[str], None] | None,
    until: float | None = None,
) -> Loop | Refusal:
    """Return the shortest loop in a region, or why there is none; the order of waypoints is sought `until` a time."""
    waypoints = branch.request.waypoints
    outside = first_outside(branch, region)
    if outside is not None:
        return outside

    @cache
    def leg_between(first: int, second: int) -> Leg | None:
        measured = leg_between.cache_info().currsize
        if progress is not None and measured:
            progress(f"measured {measured} paths between {len(waypoints)} waypoints")
        return region.leg(waypoints[first], waypoints[second])

    def length_between(first: int, second: int) -> float:
        leg = leg_between(first, second)
        return math.inf if leg is None else quanta_of(leg.length)

    order = tuple(range(len(waypoints)))
    in_time = True
    if reorders:
        apart = np.array(waypoints)[:, None] - np.array(waypoints)
        straight = np.floor(np.linalg.norm(apart, axis=2) * QUANTA_PER_RADIAN)
        order = shortest_order(len(waypoints), length_between, straight, until) or order
        if until is not None:
            in_time = len(waypoints) <= MOST_IN_TIME and monotonic() <= until
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


def first_outside(branch: Branch, region: PreparedRegion) -> Refusal | None:
    """Return why the first waypoint outside a region cannot be passed, or None if all are in it."""
    for k, point in enumerate(branch.request.waypoints):
        if region.entry(point) is None:
            why = region.region.why_not(point)
            why = why or "it lies outside the admissible region"
            R = level_determinant(branch.lifted([point]).alpha[0], branch.coefficients)
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

    @property
    def length(self) -> float:
        """Length of the path [rad]."""
        return length_of(self.points)


class PreparedRegion:
    """An admissible region with what shortest paths in it need, which is kept for the next loop.

    With `strict` loops pass no point at which a condition of the region is broken.
    """

    def __init__(self, region: Region, *, strict: bool = False) -> None:
        self.region = region
        self.strict = strict

    @cached_property
    def paths(self) -> ShortestPaths:
        """Shortest paths in the region."""
        from gaitgraph.planning.shortest_paths import ShortestPaths

        return ShortestPaths(self.region.inner)

    @cached_property
    def _around(self) -> ShortestPaths:
        """Shortest paths in the polygon that encloses the region; the same ones if its borders are all straight."""
        if self.region.outer.equals(self.region.inner):
            return self.paths
        return type(self.paths)(self.region.outer)

    def entry(self, point: Point) -> Point | None:
        """Return the point itself if loops may pass it, else the nearest that they may pass, or None if it is far."""
        if self.paths.contains(point):
            return point
        conditions = self.region.conditions
        if self.strict and any(limit.broken_at(*point) for limit in conditions):
            return None
        nearest = self.region.nearest(point)
        # The polygon of a curved border leaves this much out; the segment from there is checked with the loop.
        reach = 4 * self.region.accuracy
        if nearest is None or math.dist(nearest, point) > reach:
            return None
        return nearest

    def leg(self, start: Point, end: Point) -> Leg | None:
        """Return the shortest path from one point to another, or None."""
        if self.strict:
            # Squares have so many corners that looking through all of them takes seconds.
            first, last = self.region.nearest(start), self.region.nearest(end)
            if first is None or last is None or not self.region.joined(first, last):
                return None
        around = self._around.path(start, end)
        path = around
        if around is None or not self._covers([start, *around.tolist()]):
            # What is shortest in the polygon around the region is so in the region only if it lies there.
            first, last = self.entry(start), self.entry(end)
            if first is None or last is None:
                return None
            path = self.paths.path(first, last)
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

    def _covers(self, points: Any) -> bool:
        return bool(self.region.inner.covers(shapely.linestrings(points)))


def length_of(points: Sequence[Sequence[float]]) -> float:
    """Return the length of a path [rad]."""
    return sum(math.dist(a, b) for a, b in pairwise(points))


def prepared_region(
    branch: Branch, floor: float | None = None, accuracy: float | None = None
) -> PreparedRegion:
    """Return the region in which loops of a branch are planned, with the request's floor or another one."""
    request = branch.request
    if floor is None:
        floor = request.floor if branch.require == "flyable" else 0.0
    return _prepared(
        vehicle=request.vehicle,
        require=branch.require,
        color=branch.color,
        sign=branch.sign,
        coefficients=branch.coefficients,
        floor=floor,
        zones=request.zones,
        accuracy=accuracy or request.accuracy,
        margin=branch.servo_margin,
        margin_floor=request.floor,
    )


@lru_cache(maxsize=32)
def _prepared(margin: float, margin_floor: float, **asked: Any) -> PreparedRegion:
    """Return a prepared region, kept for the next request; with "valid" the floor is that of a robust loop or 0."""
    from gaitgraph.surface.admissible import (
        admissible_region,
        servo_margin_region,
        singular_value_region,
    )

    region = admissible_region(**asked)
    is_plane = asked["vehicle"].asymmetry is None
    if margin and is_plane:
        # Without errors a robust loop keeps more than the floor, with errors the floor.
        region &= servo_margin_region(
            margin,
            asked["vehicle"],
            sign=asked["sign"],
            floor=margin_floor,
            accuracy=asked["accuracy"],
        )
    if asked["require"] == "valid" and asked["floor"] > 0:
        region = region & singular_value_region(
            asked["floor"], asked["vehicle"], accuracy=asked["accuracy"]
        )
    # Beside a fibre of a curved sheet segments from outside the region may lead through it.
    return PreparedRegion(region, strict=not is_plane)


def _most_robust_region(branch: Branch) -> PreparedRegion:
    """Return the region with the highest floor of the least singular value that still joins all waypoints."""
    points = np.array(branch.request.waypoints)
    on_red = points[:, [0, 1, 0, 1]]
    at_waypoints = least_singular_value(on_red, branch.request.vehicle)
    low = branch.request.floor if branch.require == "flyable" else 0.0
    high = float(at_waypoints.min())
    if high <= low or not _joins_all(prepared_region(branch), branch):
        return prepared_region(branch)
    # Mostly a waypoint has the least value, and every step would go up: where that ends is tried first.
    for floor in (high, high - (high - low) / 2**_ROBUST_STEPS):
        if _joins_all(prepared_region(branch, floor), branch):
            return prepared_region(branch, floor)
    for _ in range(_ROBUST_STEPS):
        middle = (low + high) / 2
        if _floor_joins_all(branch, middle):
            low = middle
        else:
            high = middle
    return prepared_region(branch, low)


def _floor_joins_all(branch: Branch, floor: float) -> bool:
    """Return whether the region with a floor joins all waypoints; coarse polygons decide that far from the border."""
    accuracy = max(_COARSE, branch.request.accuracy)
    coarse = prepared_region(branch, floor, accuracy).region
    around = region_of([coarse.outer] * 2, accuracy)
    first, *others = branch.request.waypoints
    if all(coarse.joined(first, point) for point in others):
        return True
    if not all(around.joined(first, point) for point in others):
        return False
    return _joins_all(prepared_region(branch, floor), branch)


def _joins_all(prepared: PreparedRegion, branch: Branch) -> bool:
    """Return whether paths in a region join all waypoints."""
    entries = [prepared.entry(point) for point in branch.request.waypoints]
    first = entries[0]
    return first is not None and all(
        entry is not None and prepared.region.joined(first, entry) for entry in entries
    )


# -- The nearest places


def with_nearest(refusal: Refusal, request: PlanRequest) -> Refusal:
    """Return a refusal with the nearest points that a loop can join; at a waypoint also in words, or why none."""
    from gaitgraph.surface.admissible import why_empty

    if not refusal.waypoints:
        return refusal
    branch = Branch(
        request=request,
        color=refusal.color,
        sign=refusal.sign,
        require=request.require,
    )
    region = prepared_region(branch).region
    moved = region.nearest_joined(request.waypoints)
    if refusal.kind != "waypoint":
        return replace(refusal, moved=moved)
    if not moved:
        margin = branch.servo_margin
        why = why_empty(region, request.floor, request.vehicle, margin, branch.sign)
        return replace(refusal, message=f"{refusal.message}; {why}")
    number = refusal.waypoints[0] - 1
    return replace(
        refusal,
        message=f"{refusal.message}; {_nearest_in_words(region, request, moved, number)}",
        nearest=moved[number],
        moved=moved,
    )


def _nearest_in_words(
    region: Region, request: PlanRequest, moved: Sequence[Point], number: int
) -> str:
    """Return where the nearest admissible points are: of one waypoint, or of all that must move."""
    elsewhere = [k for k, point in enumerate(request.waypoints) if moved[k] != point]
    if len(elsewhere) < 2:
        return f"the nearest admissible point is {region.as_text(moved[number])}"
    listed = [
        f"{region.as_text(moved[k])} for waypoint {k + 1}"
        for k in elsewhere[:_MOST_NEAREST]
    ]
    if len(elsewhere) > _MOST_NEAREST:
        listed.append(f"and {len(elsewhere) - _MOST_NEAREST} more")
    return f"the nearest admissible points are {', '.join(listed)}"
