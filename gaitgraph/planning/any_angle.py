"""The any-angle method: the shortest loops of each color and sign of R, flyable and valid, or their obstacles.

The straight loop through the waypoints is tried first: if it is admissible along its whole length, nothing is shorter.
Otherwise shortest paths are found in a polygon around the admissible region, which gives a lower bound of every loop,
and again in the polygon inside the true borders, by at most the accuracy, if they leave that.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache, cached_property, lru_cache
from itertools import groupby, pairwise, zip_longest
from textwrap import fill
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import shapely

from gaitgraph.errors import checked_choice
from gaitgraph.gait.gait import lift
from gaitgraph.graph.build import segments_fly
from gaitgraph.graph.walks import quanta_of, shortest_order
from gaitgraph.invertibility.matrices import (
    least_singular_value_on_red,
    level_determinant,
    noise_of,
)
from gaitgraph.invertibility.segment_bounds import (
    least_level_determinant,
    least_singular_value_along,
)
from gaitgraph.planning.refusal import Branch, FoundPath, Obstacle, branches_of
from gaitgraph.planning.request import plan_request
from gaitgraph.surface.region import DEFAULT_ACCURACY
from gaitgraph.surface.sheets import (
    COLORS,
    RELATION,
    Color,
    Sign,
    color_codes,
    red_label,
    sheet_jumps,
)
from gaitgraph.tolerances import DEFAULT_FLOOR
from gaitgraph.validation.validating import check_gait
from gaitgraph.vehicle import PAPER

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from gaitgraph.gait.gait import Gait
    from gaitgraph.invertibility.coefficients import CoefficientsLike
    from gaitgraph.planning.request import PlanRequest, Point, Requirement
    from gaitgraph.planning.shortest_paths import ShortestPaths
    from gaitgraph.surface.region import Points, Region
    from gaitgraph.surface.sheets import SignChoice
    from gaitgraph.validation.report import Report
    from gaitgraph.vehicle import VehicleLike

_WIDTH = 110
_MOST_NEAREST = 8
_ROBUST_STEPS = (
    22  # halvings of the range of least singular values: to better than 1e-6
)


def any_angle_paths(
    branch: Branch, progress: Callable[[str], None] | None
) -> list[FoundPath] | Obstacle:
    """Return the shortest loop of a branch for each use of it, or the obstacle."""
    request, found = branch.request, list[FoundPath]()
    if progress is not None:
        progress(f"searching {branch.color} loops with {RELATION[branch.sign]}")
    if rootless := branch.rootless():
        return branch.obstacle_at(rootless[0])
    robust = request.objective == "robust" and branch.color == "red"
    reorder = request.any_order and len(request.waypoints) > 3
    for use in branch.uses:
        judged = (
            straight_loop(branch)
            if use == "flyable" and not (reorder or robust)
            else None
        )
        straight = judged is not None or (
            (robust or use == "valid")
            and not reorder
            and straight_loop_holds(branch, use, robust=robust)
        )
        if straight:
            points = request.waypoints
            order = tuple(range(len(points)))
            bound: float | None = length_of([*points, points[0]])
        else:
            region = (
                _most_robust_region(branch, use)
                if robust
                else prepared_region(branch, use)
            )
            answer = _shortest_in_region(branch, region, reorder, progress)
            if isinstance(answer, Obstacle):
                if use != branch.uses[-1]:
                    continue
                return found or answer
            points, order, bound = answer
        path = _lifted(branch, points) if judged is None else judged[0]
        if not any(np.array_equal(path.alpha, other.path.alpha) for other in found):
            found.append(
                FoundPath(
                    path,
                    order,
                    None if robust and not straight else bound,
                    judged and judged[1],
                )
            )
        if straight:
            break  # nothing is shorter
    return found


def shortest_path(branch: Branch, use: Requirement) -> Leg | None:
    """Return the shortest path from the first waypoint of a branch to the last, or None if there is none."""
    start, end = branch.request.waypoints[0], branch.request.waypoints[-1]
    if straight_loop_holds(branch, use):
        return Leg([start, end], math.dist(start, end), math.dist(start, end))
    return prepared_region(branch, use).leg(start, end)


def _shortest_in_region(
    branch: Branch,
    region: PreparedRegion,
    reorder: bool,
    progress: Callable[[str], None] | None,
) -> tuple[tuple[Point, ...], tuple[int, ...], float] | Obstacle:
    """Return the points of the shortest closed path, as a :data:`FoundPath` has the rest; or an obstacle."""
    waypoints = branch.request.waypoints
    if outside := first_outside(branch, region):
        return outside

    @cache
    def leg_between(first: int, second: int) -> Leg | None:
        if progress is not None and (measured := leg_between.cache_info().currsize):
            progress(f"measured {measured} paths between {len(waypoints)} waypoints")
        return region.leg(waypoints[first], waypoints[second])

    def length(first: int, second: int) -> float:
        leg = leg_between(first, second)
        return math.inf if leg is None else quanta_of(leg.length)

    order = tuple(range(len(waypoints)))
    if reorder:
        order = shortest_order(len(waypoints), length) or order
    path: list[Point] = []
    bound = 0.0
    for first, second in pairwise([*order, order[0]]):
        leg = leg_between(first, second)
        if leg is None:
            parts = [region.region.component_of(waypoints[k]) for k in (first, second)]
            sizes = [
                f"{region.region.components[part].area:.3g}"
                for part in parts
                if part is not None
            ]
            wall = (
                "the border: move one"
                if branch.request.zones is None
                else "keep_out or keep_in: move these or one"
            )
            where = f"{wall} of the waypoints, which lie in parts of {' and '.join(sizes)} rad²"
            return branch.separation((first, second), where)
        path += leg.points[:-1]
        bound += leg.lower_bound
    return tuple(path) or (waypoints[0],), order, bound


def first_outside(branch: Branch, region: PreparedRegion) -> Obstacle | None:
    """Return the obstacle at the first waypoint outside a region, or None if all are in it."""
    for k, point in enumerate(branch.request.waypoints):
        if region.entry(point) is None:
            why = (
                region.region.why_not(point) or "it lies outside the admissible region"
            )
            numbers = branch.coefficients
            alpha = lift(
                [point],
                branch.color,
                vehicle=branch.request.vehicle,
                coefficients=numbers,
            ).alpha[0]
            return branch.obstacle_at(
                k, f": {why}", float(level_determinant(alpha, numbers))
            )
    return None


def _most_robust_region(branch: Branch, use: Requirement) -> PreparedRegion:
    """Return the region with the highest floor of the least singular value that still joins all waypoints."""
    points = branch.request.waypoints
    plane = np.array(points)
    high = float(
        np.min(
            least_singular_value_on_red(
                plane[:, 0], plane[:, 1], branch.request.vehicle
            )
        )
    )
    low = branch.request.floor if use == "flyable" else 0.0

    def joining(floor: float | None = None) -> PreparedRegion | None:
        prepared = prepared_region(branch, use, floor)
        entries = [entry for entry in map(prepared.entry, points) if entry is not None]
        joined = len(entries) == len(points) and all(
            prepared.region.joined(entries[0], entry) for entry in entries
        )
        return prepared if joined else None

    best = joining()
    if high <= low or best is None:
        return best or prepared_region(branch, use)
    # Mostly a waypoint has the least value, and every step would go up: where that ends is tried first.
    if found := joining(high) or joining(high - (high - low) / 2**_ROBUST_STEPS):
        return found
    for _ in range(_ROBUST_STEPS):
        middle = (low + high) / 2
        if found := joining(middle):
            low, best = middle, found
        else:
            high = middle
    return best


def with_nearest(obstacle: Obstacle, request: PlanRequest) -> Obstacle:
    """Return an obstacle with the nearest points that a loop can join; at a waypoint also in words, or why none."""
    from gaitgraph.surface.admissible import why_empty  # loads shapely

    if not obstacle.waypoints:
        return obstacle
    region = region_of(request, obstacle.color, obstacle.sign, request.require)  # type: ignore[arg-type]
    moved = region.nearest_joined(request.waypoints)
    if obstacle.kind != "waypoint":
        return replace(obstacle, moved=moved)
    if not moved:
        return replace(
            obstacle,
            message=f"{obstacle.message}; {why_empty(region, request.floor, request.vehicle)}",
        )
    nearest = moved[obstacle.waypoints[0] - 1]
    elsewhere = [k for k, point in enumerate(request.waypoints) if moved[k] != point]
    if len(elsewhere) < 2:
        message = f"the nearest admissible point is {region.as_text(nearest)}"
    else:
        listed = [f"{region.as_text(moved[k])} for waypoint {k + 1}" for k in elsewhere]
        more = [f"and {len(elsewhere) - _MOST_NEAREST} more"] * (
            len(elsewhere) > _MOST_NEAREST
        )
        message = f"the nearest admissible points are {', '.join([*listed[:_MOST_NEAREST], *more])}"
    return replace(
        obstacle, message=f"{obstacle.message}; {message}", nearest=nearest, moved=moved
    )


def _lifted(branch: Branch, points: Sequence[Point]) -> Gait:
    return lift(
        points,
        branch.color,
        vehicle=branch.request.vehicle,
        coefficients=branch.coefficients,
    )


def straight_loop(branch: Branch) -> tuple[Gait, tuple[Gait, Report]] | None:
    """Return the straight loop, and merged with its checks without those of rates; None unless all of it is flyable.

    No waypoint is rootless.
    """
    if not _zones_allow(branch):
        return None
    path = _lifted(branch, branch.request.waypoints)
    gait = path.merged()
    report = check_gait(gait, floor=branch.request.floor)
    return (path, (gait, report)) if report.flyable else None


def _zones_allow(branch: Branch) -> bool:
    """Return whether the request's polygons allow the straight loop."""
    points, zones = branch.request.waypoints, branch.request.zones
    return zones is None or bool(
        zones.allow_segments(points, [*points[1:], points[0]]).all()
    )


def straight_loop_holds(
    branch: Branch, use: Requirement, *, robust: bool = False
) -> bool:
    """Return whether the straight loop is admissible everywhere, and with `robust` whether no other is better."""
    request, coefficients = branch.request, branch.coefficients
    if not _zones_allow(branch):
        return False
    if use == "flyable":
        starts = np.array(request.waypoints)[
            :, [0, 1, 0, 1]
        ]  # red, where α3 = α1 and α4 = α2
        # Where all thrusts push up, the borders of R are straight: R keeps its sign between points of one label.
        labels = red_label(starts[:, 0], starts[:, 1], request.vehicle)
        if not (labels == labels[0]).all() or labels[0].prod() != branch.wanted:
            return False
        ends = np.roll(starts, -1, axis=0)
        holds = bool(segments_fly(starts, ends, request.floor, request.vehicle).all())
    else:
        gait = _lifted(branch, request.waypoints)
        starts, ends = gait.alpha, gait.ends
        codes, noise = color_codes(gait.colors), noise_of(coefficients)
        least = least_level_determinant(
            starts, ends, coefficients, sign=branch.wanted, tolerance=0.0, floor=noise
        )
        holds = (
            bool(least.lower.min() >= noise)
            and not sheet_jumps(starts, ends, codes, codes, coefficients).any()
        )
    if not holds or not robust:
        return holds
    # None is better if its least singular value is that of a waypoint.
    along = least_singular_value_along(starts, ends, request.vehicle, tolerance=1e-7)
    at_waypoints = least_singular_value_on_red(
        starts[:, 0], starts[:, 1], request.vehicle
    )
    return bool(along.lower.min() >= at_waypoints.min() - 1e-6)


class Leg(NamedTuple):
    """The shortest path between two points: its points, its length, and a lower bound of all lengths [rad]."""

    points: list[Point]
    length: float
    lower_bound: float


class PreparedRegion:
    """An admissible region with what shortest paths in it need, which is kept for the next loop."""

    def __init__(self, region: Region) -> None:
        self.region = region

    @cached_property
    def paths(self) -> ShortestPaths:
        """Shortest paths in the region."""
        from gaitgraph.planning.shortest_paths import ShortestPaths  # loads decimal

        return ShortestPaths(self.region.inner)

    @cached_property
    def _around(self) -> ShortestPaths:
        """Shortest paths in the polygon that encloses the region; the same ones if its borders are all straight."""
        same = self.region.outer.equals(self.region.inner)
        return self.paths if same else type(self.paths)(self.region.outer)

    def entry(self, point: Point) -> Point | None:
        """Return the point itself if loops may pass it, else the nearest that they may pass, or None if it is far."""
        if self.paths.contains(point):
            return point
        nearest = self.region.nearest(point)
        # The polygon of a curved border leaves this much out; the segment from there is checked with the loop.
        return (
            nearest
            if nearest is not None
            and math.dist(nearest, point) <= 4 * self.region.accuracy
            else None
        )

    def leg(self, start: Point, end: Point) -> Leg | None:
        """Return the shortest path from one point to another, or None."""
        found = around = self._around.path(start, end)
        if around is None or not self.region.inner.covers(
            shapely.linestrings([start, *around.tolist()])
        ):
            # What is shortest in the polygon around the region is so in the region only if it lies there.
            first, last = self.entry(start), self.entry(end)
            found = (
                None if first is None or last is None else self.paths.path(first, last)
            )
        if found is None:
            return None
        # An entry is within the accuracy of its waypoint: both as corners would make a step too short to be timed.
        inner = [(float(x), float(y)) for x, y in found[1:-1]]
        points = [point for point, _ in groupby([start, *inner, end])]
        # An end outside even that polygon is not in the region: only the straight line is certain.
        shortest = (
            math.dist(start, end) if around is None else length_of(around.tolist())
        )
        length = length_of(points)
        return Leg(points, length, min(length, shortest))


def length_of(points: Sequence[Sequence[float]]) -> float:
    """Return the length of a path [rad]."""
    return sum(math.dist(a, b) for a, b in pairwise(points))


def prepared_region(
    branch: Branch, use: Requirement, floor: float | None = None
) -> PreparedRegion:
    """Return the region in which loops of a branch are planned, with the request's floor or another one."""
    request = branch.request
    if floor is None:
        floor = request.floor if use == "flyable" else 0.0
    return _prepared(
        vehicle=request.vehicle,
        use=use,
        color=branch.color,
        sign=branch.sign,
        coefficients=branch.coefficients,
        floor=floor,
        zones=request.zones,
        accuracy=request.accuracy,
    )


@lru_cache(maxsize=32)
def _prepared(**asked: Any) -> PreparedRegion:
    """Return a prepared region, kept for the next request; with "valid" the floor is that of a robust loop or 0."""
    from gaitgraph.surface.admissible import (
        admissible_region,
        singular_value_region,
    )  # loads shapely

    region = admissible_region(**asked)
    if asked["use"] == "valid" and asked["floor"] > 0:
        region = region & singular_value_region(
            asked["floor"], asked["vehicle"], accuracy=asked["accuracy"]
        )
    return PreparedRegion(region)


def region_of(
    request: PlanRequest, color: Color, sign: Sign, use: Requirement
) -> Region:
    """Return the region in which loops of one color and sign of R are planned for a request."""
    return prepared_region(Branch(request=request, color=color, sign=sign), use).region


class WaypointLocation(NamedTuple):
    """One waypoint: the number of its part, from 1, or why it is in none.

    `nearest` is where a loop can join it to the others, if it is not there already: see ``Region.nearest_joined``.
    """

    point: Point
    part: int | None
    why_not: str | None
    nearest: Point | None


@dataclass(frozen=True, slots=True, kw_only=True)
class RegionLocation:
    """The region of one color and sign of R, and where the waypoints lie in it."""

    color: Color
    sign: Sign
    region: Region
    waypoints: tuple[WaypointLocation, ...]

    @property
    def joined(self) -> bool:
        """Whether there is one part of the region, or parts that touch, with all waypoints."""
        points = [waypoint.point for waypoint in self.waypoints]
        return bool(self.region.components) and all(
            self.region.joined(points[0], other) for other in points
        )

    def as_mapping(self) -> dict[str, Any]:
        """Return plain values, ready for JSON."""
        parts = self.region.components
        return {
            "color": self.color,
            "sign": self.sign,
            "area": self.region.area,
            "parts": [
                {
                    "area": part.area,
                    "inside": list(part.representative_point().coords[0]),
                }
                for part in parts
            ],
            "waypoints": [
                {
                    "waypoint": list(point),
                    "part": part,
                    "reason": why_not,
                    "nearest": nearest and list(nearest),
                }
                for point, part, why_not, nearest in self.waypoints
            ],
            "joined": self.joined,
        }

    def __str__(self) -> str:
        sizes = [f"{part.area:.4g}" for part in self.region.components]
        parts = (
            f"{len(sizes)} part{'s' * (len(sizes) > 1)} of {', '.join(sizes)} rad²"
            if sizes
            else "empty"
        )
        lines = [f"{self.color}, {RELATION[self.sign]}: {parts}"]
        for number, component in enumerate(
            () if self.waypoints else self.region.components, start=1
        ):
            a1, a2 = component.representative_point().coords[0]
            lines.append(
                f"  part {number}: {component.area:.4g} rad², around ({a1:.4f}, {a2:.4f})"
            )
        for number, (point, part, why_not, nearest) in enumerate(
            self.waypoints, start=1
        ):
            text = f"in part {part}" if part is not None else f"{why_not}"
            if nearest is not None:
                joined = (
                    "admissible point"
                    if part is None
                    else "point in one part with the others"
                )
                text += f"; the nearest {joined} is {self.region.as_text(nearest)}"
            text = f"waypoint {number} ({point[0]:.4f}, {point[1]:.4f}): {text}"
            lines.append(
                fill(text, _WIDTH, initial_indent="  ", subsequent_indent="    ")
            )
        if len(self.waypoints) > 1:
            lines.append(
                "  a loop can join them all"
                if self.joined
                else "  no loop can join them"
            )
        return "\n".join(lines)


@dataclass(frozen=True, slots=True, kw_only=True)
class Location:
    """Where waypoints lie; truthy if, for a color and sign of R, there is a part of the region that holds them all.

    The `regions`, one for each sign of R of the request, allow the `use` "flyable" or "valid", and lie inside their
    curved borders by at most the `accuracy` [rad].
    """

    use: str
    accuracy: float
    regions: tuple[RegionLocation, ...]

    def __bool__(self) -> bool:
        return any(one.joined for one in self.regions)

    def as_mapping(self) -> dict[str, Any]:
        """Return plain values, ready for JSON."""
        regions = [one.as_mapping() for one in self.regions]
        return {
            "use": self.use,
            "accuracy": self.accuracy,
            "joined": bool(self),
            "regions": regions,
        }

    def __repr__(self) -> str:
        joined = sum(one.joined for one in self.regions)
        return f"<Location: {len(self.regions)} {self.use} regions, {joined} with all waypoints in one part>"

    def __str__(self) -> str:
        return "\n".join(map(str, self.regions))


def location_of(
    waypoints: Points,
    *,
    use: Requirement = "flyable",
    color: Color = "red",
    sign: SignChoice = "auto",
    vehicle: VehicleLike = PAPER,
    coefficients: CoefficientsLike | None = None,
    floor: float = DEFAULT_FLOOR,
    keep_out: Sequence[Points] = (),
    keep_in: Sequence[Points] = (),
    accuracy: float = DEFAULT_ACCURACY,
) -> Location:
    """Return in which part of the admissible regions each waypoint lies, and whether a loop can join them all.

    Parameters
    ----------
    waypoints
        (α1, α2) pairs in [−π/2, π/2], numbers [rad] or texts such as "3pi/8".
    use
        "flyable", where the least singular value, hover thrusts and limits of the vehicle allow a gait, or "valid",
        where R has the sign.
    color, sign
        The sheet, "red" or "blue", and the sign of R: "positive", "negative" or "auto", which is both.
    vehicle, coefficients, floor, keep_out, keep_in, accuracy
        As for :func:`gaitgraph.planning.planner.plan_loop`.

    Raises
    ------
    InputError
        If a value is not allowed.

    Examples
    --------
    >>> found = location_of([(-0.4, 0.4), (0.5, 0.5)], sign="positive")
    >>> [waypoint.part for waypoint in found.regions[0].waypoints], bool(found)
    ([1, None], False)
    >>> [round(angle, 4) for angle in found.regions[0].waypoints[1].nearest]
    [0.1671, 0.5]
    """
    checked_choice("color", color, COLORS)
    request = plan_request(
        waypoints,
        color=color,
        sign=sign,
        vehicle=vehicle,
        coefficients=coefficients,
        floor=floor,
        keep_out=keep_out,
        keep_in=keep_in,
        accuracy=accuracy,
    )
    return located(request, use=use)


def located(request: PlanRequest, *, use: Requirement = "flyable") -> Location:
    """Return what :func:`location_of` does, for the waypoints of a request; its color "auto" is red.

    Without waypoints the answer has the parts of the regions alone.
    """
    checked_choice("use", use, ("flyable", "valid"))
    regions = []
    for branch in branches_of(
        replace(request, color="blue" if request.color == "blue" else "red")
    ):
        region = prepared_region(branch, use).region
        waypoints = []
        moved = region.nearest_joined(request.waypoints) if request.waypoints else ()
        for point, near in zip_longest(request.waypoints, moved):
            part, nearest = region.component_of(point), None if near == point else near
            number, why_not = (
                (None, region.why_not(point)) if part is None else (part + 1, None)
            )
            waypoints.append(WaypointLocation(point, number, why_not, nearest))
        location = RegionLocation(
            color=branch.color,
            sign=branch.sign,
            region=region,
            waypoints=tuple(waypoints),
        )
        regions.append(location)
    return Location(use=use, accuracy=request.accuracy, regions=tuple(regions))
