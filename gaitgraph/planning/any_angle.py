"""The shortest loops of each color and sign of R, flyable and valid, or what is in their way.

The straight loop through the waypoints is tried first: if it is admissible along its whole length, nothing is shorter.
Otherwise shortest paths are found in the admissible region, whose polygon stays inside the true borders by the
accuracy at most; the same search in the polygon that encloses it gives a lower bound of every loop.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, Literal

import numpy as np

from gaitgraph.gait.gait import lift
from gaitgraph.graph.walks import order_by_lengths, quanta_of
from gaitgraph.invertibility.matrices import (
    Coefficients,
    Kind,
    coefficients_of,
    least_singular_value_on_red,
    level_determinant,
    noise_of,
)
from gaitgraph.invertibility.segment_bounds import (
    keeps_singular_value_above,
    least_level_determinant,
    least_singular_value_along,
    thrust_shares_along,
)
from gaitgraph.planning.plan import Candidates, Loop, loop_of
from gaitgraph.planning.refusal import Case, Obstacle, obstacle_at_waypoint, rootless_waypoints, separation
from gaitgraph.planning.shortest_paths import ShortestPaths
from gaitgraph.surface.sheets import COLORS, RELATION, Color, Sign, red_label
from gaitgraph.validation.rules import jumps

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import numpy.typing as npt

    from gaitgraph.planning.request import PlanRequest, Point
    from gaitgraph.surface.region import Region, Zones
    from gaitgraph.vehicle import Vehicle

Use = Literal["flyable", "valid"]

_FINE = 1e-7  # accuracy for which curved borders have so many corners that it takes a while [rad]
_ROBUST_STEPS = 22  # halvings of the range of least singular values: to better than 1e-6


def add_any_angle_loops(
    found: Candidates,
    request: PlanRequest,
    coefficients: Coefficients,
    sign: Sign,
    *,
    progress: Callable[[str], None] | None = None,
) -> None:
    """Add the shortest loops with one sign of R, or what is in their way, to what was found.

    Parameters
    ----------
    found
        Gains loops, obstacles and notes.
    request, coefficients, sign
        What is asked for.
    progress
        Called with a line of text before each step.
    """
    if progress is not None and request.accuracy < _FINE:
        progress(f"drawing regions to {request.accuracy:g} rad, which takes a while")
    for color in COLORS:
        if request.color not in ("auto", color):
            continue
        if progress is not None:
            progress(f"searching {color} loops with {RELATION[sign]}")
        case = Case(request=request, coefficients=coefficients, color=color, sign=sign)
        rootless = rootless_waypoints(case)
        answer = obstacle_at_waypoint(case, rootless[0]) if rootless else _loops_of_color(case, found, progress)
        if isinstance(answer, Obstacle):
            found.obstacles.append(answer)
        else:
            found.loops += answer


def _loops_of_color(case: Case, found: Candidates, progress: Callable[[str], None] | None) -> list[Loop] | Obstacle:
    """Return the shortest flyable and the shortest valid loop of one color, or what is in the way of a valid one."""
    request, loops = case.request, list[Loop]()
    uses: tuple[Use, ...] = ("flyable", "valid") if case.color == "red" else ("valid",)
    for use in uses:
        robust = request.objective == "robust" and case.color == "red"
        reorder = request.any_order and len(request.waypoints) > 3
        if not reorder and straight_loop_holds(case, use, robust=robust):
            points, order = request.waypoints, tuple(range(len(request.waypoints)))
            bound: float | None = length_of([*points, points[0]])
            straight = True
        else:
            region = _most_robust_region(case, use) if robust else prepared_region(case, use)
            answer = _shortest_chain(case, region, reorder, found, progress)
            if isinstance(answer, Obstacle):
                if use == "flyable":
                    continue
                return loops or answer
            points, order, bound = answer
            if robust:
                bound = None
            straight = False
        path = lift(points, case.color, vehicle=request.vehicle, coefficients=case.coefficients)
        if not any(np.array_equal(path.alpha, loop.path.alpha) for loop in loops):
            loops.append(loop_of(path, order, request, case.sign, method="exact", lower_bound=bound))
        if straight:
            break  # nothing is shorter
    return loops


def _shortest_chain(
    case: Case,
    region: PreparedRegion,
    reorder: bool,
    found: Candidates,
    progress: Callable[[str], None] | None,
) -> tuple[tuple[Point, ...], tuple[int, ...], float] | Obstacle:
    """Return the points of the shortest closed chain, the order of the waypoints and a lower bound, or an obstacle."""
    waypoints = case.request.waypoints
    for k, point in enumerate(waypoints):
        if region.entry(point) is None:
            why = region.region.why_not(point) or "it lies outside the admissible region"
            alpha = lift([point], case.color, vehicle=case.request.vehicle, coefficients=case.coefficients).alpha[0]
            return Obstacle(
                color=case.color,
                sign=case.sign,
                kind="waypoint",
                message=f"{case}: waypoint {k + 1} ({point[0]:.4f}, {point[1]:.4f}): {why}",
                waypoints=(k + 1,),
                R=float(level_determinant(alpha, case.coefficients)),
            )

    def apart(first: int, second: int) -> Obstacle:
        parts = [region.region.component_of(waypoints[k]) for k in (first, second)]
        areas = [f"{region.region.components[part].area:.3g}" for part in parts if part is not None]
        wall = "the border of the admissible region: they lie in parts"
        if case.request.zones is not None:
            wall = "keep_out and keep_in: they lie in parts of the admissible region"
        return separation(case, (first, second), f"{wall} of {' and '.join(areas)} rad²")

    order = tuple(range(len(waypoints)))
    if reorder:
        lengths: list[list[float]] = []
        for a in order:
            if progress is not None and a:
                progress(f"measured the paths between {a} of {len(waypoints)} waypoints")
            legs = [region.leg(waypoints[a], waypoints[b]) for b in range(a)]
            if None in legs:
                return apart(a - 1, a)
            lengths.append([quanta_of(leg.length) for leg in legs if leg is not None])
        best = order_by_lengths(lengths)
        assert best is not None  # noqa: S101 - every two waypoints are joined
        order = best.order
        if not best.exact:
            found.note_heuristic_order(len(order))
    chain: list[Point] = []
    bound = 0.0
    for first, second in pairwise([*order, order[0]]):
        leg = region.leg(waypoints[first], waypoints[second])
        if leg is None:
            return apart(first, second)
        chain += leg.points[:-1]
        bound += leg.lower_bound
    return tuple(chain) or (waypoints[0],), order, bound


def _most_robust_region(case: Case, use: Use) -> PreparedRegion:
    """Return the region with the highest floor of the least singular value that still joins all waypoints."""
    points = case.request.waypoints
    plane = np.array(points)
    high = float(np.min(least_singular_value_on_red(plane[:, 0], plane[:, 1], case.request.vehicle)))
    low = case.request.floor if use == "flyable" else 0.0

    def joins(prepared: PreparedRegion) -> bool:
        entries = [prepared.entry(point) for point in points]
        first = entries[0]
        return first is not None and all(
            entry is not None and prepared.region.joined(first, entry) for entry in entries
        )

    best = prepared_region(case, use)
    if high <= low or not joins(best):
        return best
    top = prepared_region(case, use, high)
    if joins(top):
        return top
    # Mostly a waypoint is the worst place, and every step would go up: where that ends is tried first.
    last = low
    for _ in range(_ROBUST_STEPS):
        last = (last + high) / 2
    nearly = prepared_region(case, use, last)
    if joins(nearly):
        return nearly
    for _ in range(_ROBUST_STEPS):
        middle = (low + high) / 2
        prepared = prepared_region(case, use, middle)
        if joins(prepared):
            low, best = middle, prepared
        else:
            high = middle
    return best


def with_nearest(obstacle: Obstacle, request: PlanRequest, coefficients: Coefficients) -> Obstacle:
    """Return an obstacle; at a waypoint, with the nearest point that a valid loop of its color and sign may pass."""
    if obstacle.kind != "waypoint":
        return obstacle
    region = region_of(request, obstacle.color, obstacle.sign, "valid")  # type: ignore[arg-type]
    point = request.waypoints[obstacle.waypoints[0] - 1]
    nearest = region.nearest(point)
    if nearest is None:
        return obstacle
    message = f"{obstacle.message}; the nearest admissible point is {region.nearest_as_text(point)}"
    return replace(obstacle, message=message, nearest=nearest)


def straight_loop_holds(case: Case, use: Use, *, robust: bool = False) -> bool:
    """Return whether the straight loop through a request's waypoints may be used along its whole length.

    With `robust`, also whether its least singular value is that of a waypoint, so that no other loop has a better one.
    """
    request, coefficients = case.request, case.coefficients
    if use == "flyable":
        starts = np.array(request.waypoints)[:, [0, 1, 0, 1]]  # red, where α3 = α1 and α4 = α2
        ends = np.roll(starts, -1, axis=0)
        holds = _straight_loop_flies(starts, ends, case.wanted, request)
    else:
        gait = lift(request.waypoints, case.color, vehicle=request.vehicle, coefficients=coefficients)
        starts, ends = gait.alpha, gait.ends
        red, noise = np.full(len(starts), case.color == "red"), noise_of(coefficients)
        holds = not jumps(starts, ends, red, red, coefficients).any()
        least = least_level_determinant(starts, ends, coefficients, sign=case.wanted, tolerance=0.0, floor=noise)
        holds = holds and bool(least.lower.min() >= noise)
    if not holds:
        return False
    if request.zones is not None and not request.zones.allow_segments(starts[:, :2], ends[:, :2]).all():
        return False
    if not robust:
        return True
    along = least_singular_value_along(starts, ends, request.vehicle, tolerance=1e-7)
    at_waypoints = least_singular_value_on_red(starts[:, 0], starts[:, 1], request.vehicle)
    return bool(along.lower.min() >= at_waypoints.min() - 1e-6)


def _straight_loop_flies(
    starts: npt.NDArray[np.float64], ends: npt.NDArray[np.float64], wanted: float, request: PlanRequest
) -> bool:
    """Return whether straight segments on red that form a closed chain are flyable, sign of R included.

    Where all thrusts push up, the borders of R are straight, so that R keeps its sign between points of one label;
    and positive thrusts are a matter of two quarter planes, each convex.
    """
    vehicle, (a1, a2) = request.vehicle, starts[:, :2].T
    delta = math.atan(vehicle.signed_drag_ratio)
    first, second = a1 - delta, a2 + delta
    up = ((first < 0) & (second > 0)).all() or ((first > 0) & (second < 0)).all()
    labels = red_label(a1, a2, vehicle)
    if not up or (labels != labels[0]).any() or labels[0].prod() != wanted:
        return False
    if vehicle.max_tilt is not None and np.abs(starts).max() > vehicle.max_tilt:
        return False
    if vehicle.max_thrust is not None:
        mass, gravity = vehicle.require("mass", "gravity", purpose="the limit of the largest thrust")
        _, _, largest = thrust_shares_along(starts, ends, vehicle)
        if -float(largest.lower.min()) * mass * gravity > vehicle.max_thrust:
            return False
    return bool(keeps_singular_value_above(starts, ends, request.floor, vehicle).all())


@dataclass(frozen=True, slots=True, kw_only=True)
class Leg:
    """The shortest path between two points: its points, its length, and a length that none falls below [rad]."""

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

        Near enough is what the polygon of a curved border leaves out; the segment from there to the point is judged
        with the whole loop.
        """
        if self.paths.contains(point):
            return point
        nearest = self.region.nearest(point)
        return nearest if nearest is not None and math.dist(nearest, point) <= 4 * self.region.accuracy else None

    def leg(self, start: Point, end: Point) -> Leg | None:
        """Return the shortest path from one point to another, or None."""
        first, last = self.entry(start), self.entry(end)
        if first is None or last is None:
            return None
        found = self.paths.path(first, last)
        if found is None:
            return None
        points = [start, *((float(x), float(y)) for x, y in found), end]
        points = [point for k, point in enumerate(points) if k == 0 or point != points[k - 1]]
        length = length_of(points)
        bound = length
        if len(points) > 2 and self._around is not self.paths:
            around = self._around.path(start, end)
            # An end that even the outer figure lacks is no point of the region: only the straight line is certain.
            shortest = math.dist(start, end) if around is None else length_of(around.tolist())
            bound = min(length, shortest)
        return Leg(points=tuple(points), length=length, lower_bound=bound)


def length_of(points: Sequence[Sequence[float]]) -> float:
    """Return the length of a chain of points [rad]."""
    return sum(math.dist(a, b) for a, b in pairwise(points))


def prepared_region(case: Case, use: Use, floor: float | None = None) -> PreparedRegion:
    """Return the region in which loops of a case are planned, with the request's floor or another one."""
    request = case.request
    if floor is None:
        floor = request.floor if use == "flyable" else 0.0
    return _prepared(
        request.vehicle,
        use,
        case.color,
        case.sign,
        request.coefficients,
        floor,
        request.zones,
        request.accuracy,
    )


@lru_cache(maxsize=32)
def _prepared(
    vehicle: Vehicle,
    use: Use,
    color: Color,
    sign: Sign,
    coefficients: Kind,
    floor: float,
    zones: Zones | None,
    accuracy: float,
) -> PreparedRegion:
    """Return a prepared region, kept for the next request that needs it.

    With the use "valid" the floor is that of a robust loop, 0 for none.
    """
    from gaitgraph.surface.admissible import admissible_region, singular_value_region  # loads shapely

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


def region_of(request: PlanRequest, color: Color, sign: Sign, use: Use) -> Region:
    """Return the region in which loops of one color and sign of R are planned for a request."""
    coefficients = coefficients_of(request.vehicle, request.coefficients)
    return prepared_region(Case(request=request, coefficients=coefficients, color=color, sign=sign), use).region
