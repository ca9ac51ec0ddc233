"""Any-angle loops: the shortest closed loops through ordered waypoints, not on a grid.

On a sheet a straight line in (α1, α2) is straight in all four angles, and the admissible region is a plane figure with
known borders. So a shortest loop is straight wherever it can be and bends only at corners of that figure. Straight
borders, those of the user's polygons among them, are exact. A curved one is replaced by a polygon that keeps inside it
by at most the stated accuracy; a second polygon outside it bounds the length from below.

If the straight loop through the waypoints holds along its whole length it is the shortest, and no figure is needed.
Red and blue meet in isolated points, and only there does a loop change its color.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import HALF_PI, wrapped
from gaitgraph.gait import lift
from gaitgraph.invertibility import (
    Coefficients,
    coefficients_of,
    least_singular_value_on_red,
    level_determinant,
    noise_of,
)
from gaitgraph.obstacles import RELATION, Obstacle, rootless, waypoint_obstacle
from gaitgraph.plans import Candidates, Loop, heuristic_order, loop_of
from gaitgraph.regions import Zones, red_label, separating_factor
from gaitgraph.requests import Point
from gaitgraph.rules import jumps
from gaitgraph.search import best_order
from gaitgraph.segments import (
    keeps_singular_value_above,
    least_level_determinant,
    least_singular_value_along,
    thrust_shares_along,
)
from gaitgraph.surface import COLORS, sheet_angles
from gaitgraph.visibility import ShortestPaths

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from gaitgraph.areas import Region
    from gaitgraph.requests import PlanRequest
    from gaitgraph.vehicle import Vehicle

__all__ = [
    "Ground",
    "any_angle_candidates",
    "ground_of",
    "meeting_points",
    "region_of",
    "straight_loop_holds",
    "with_nearest",
]

FloatArray = npt.NDArray[np.float64]
Use = Literal["flyable", "valid"]
_Way = tuple[float, list[tuple[Point, str]]]

_ROBUST_STEPS = 22  # halvings of the range of least singular values: to better than 1e-6


@dataclass(frozen=True, slots=True, kw_only=True)
class Leg:
    """The shortest way between two points: its points, its length, and a length that none falls below [rad]."""

    points: tuple[Point, ...]
    length: float
    lower_bound: float


class Ground:
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
        length = _length(points)
        if len(points) == 2 or self._around is self.paths:
            return Leg(points=points, length=length, lower_bound=length)
        around = self._around.path(start, end)
        # An end that even the outer figure lacks is no point of the region: only the straight line is certain.
        bound = math.dist(start, end) if around is None else _length([(float(x), float(y)) for x, y in around])
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


def _length(points: Sequence[Point]) -> float:
    return sum(math.dist(a, b) for a, b in pairwise(points))


@lru_cache(maxsize=32)
def ground_of(
    vehicle: Vehicle,
    use: Use,
    color: Any,
    sign: Any,
    coefficients: Literal["published", "exact"],
    floor: float,
    zones: Zones | None,
    accuracy: float,
) -> Ground:
    """Return the admissible region of one color and sign of R, prepared; kept for the next request that needs it.

    With the use "valid" the floor is that of a robust loop, 0 for none.
    """
    from gaitgraph.areas import admissible_region, singular_value_region

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
    return Ground(region)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Asked:
    """One color, sign of R and use for which a loop is sought."""

    request: PlanRequest
    coefficients: Coefficients
    color: Any
    sign: str
    use: Use

    def ground(self, floor: float | None = None) -> Ground:
        request = self.request
        if floor is None:
            floor = request.floor if self.use == "flyable" else 0.0
        return ground_of(
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
    return _Asked(request=request, coefficients=coefficients, color=color, sign=sign, use=use).ground().region


@dataclass(frozen=True, slots=True, kw_only=True)
class _Chain:
    """A closed chain of points in the (α1, α2) plane, through the waypoints in an order."""

    points: tuple[Point, ...]
    order: tuple[int, ...]
    lower_bound: float | None
    straight: bool = False


def any_angle_candidates(
    request: PlanRequest,
    coefficients: Coefficients,
    sign: str,
    *,
    progress: Callable[[str], None] | None = None,
) -> Candidates:
    """Return the shortest loops with one sign of R, or what is in their way.

    Parameters
    ----------
    request, coefficients, sign
        What is asked for.
    progress
        Called with a line of text before each step.
    """
    found = Candidates()
    for color in COLORS if request.color == "auto" else (request.color,):
        if progress is not None:
            progress(f"searching {color} loops with {RELATION[sign]}")
        loops = _loops_of(request, coefficients, color, sign, found.notes, progress)
        if isinstance(loops, Obstacle):
            found.obstacles.append(loops)
        else:
            found.loops += loops
    straight = _length([*request.waypoints, request.waypoints[0]])
    if request.color == "auto" and all(loop.length > straight + 1e-9 for loop in found.loops):
        mixed = _mixed(request, coefficients, sign)
        if mixed is not None and all(mixed.length < loop.length - 1e-9 for loop in found.loops):
            found.loops.append(mixed)
    return found


def _loops_of(
    request: PlanRequest,
    coefficients: Coefficients,
    color: Any,
    sign: str,
    notes: dict[str, None],
    progress: Callable[[str], None] | None,
) -> list[Loop] | Obstacle:
    """Return the shortest flyable and the shortest valid loop of one color, or what is in the way."""
    lacking = rootless(request, coefficients, color, sign)
    asked = _Asked(request=request, coefficients=coefficients, color=color, sign=sign, use="valid")
    if lacking:
        return waypoint_obstacle(min(lacking), request, coefficients, color, sign)
    loops: list[Loop] = []
    uses: tuple[Use, ...] = ("flyable", "valid") if color == "red" else ("valid",)
    for use in uses:
        chain = _chain(replace(asked, use=use), notes, progress)
        if isinstance(chain, Obstacle):
            if use == "flyable":
                continue
            return loops or chain
        path = lift(chain.points, color, vehicle=request.vehicle, coefficients=coefficients)
        if not any(np.array_equal(path.alpha, loop.path.alpha) for loop in loops):
            loops.append(loop_of(path, chain.order, request, sign, lower_bound=chain.lower_bound))
        if chain.straight:
            break  # nothing is shorter
    return loops


def _chain(asked: _Asked, notes: dict[str, None], progress: Callable[[str], None] | None) -> _Chain | Obstacle:
    request = asked.request
    points, robust = request.waypoints, request.objective == "robust" and asked.color == "red"
    reorder = request.any_order and len(points) > 3
    straight = (asked.request, asked.coefficients, asked.color, asked.sign, asked.use)
    if not reorder and straight_loop_holds(*straight, robust=robust):
        length = _length([*points, points[0]])
        return _Chain(points=points, order=tuple(range(len(points))), lower_bound=length, straight=True)
    ground = _most_robust(asked) if robust else asked.ground()
    for k, point in enumerate(points):
        if ground.entry(point) is None:
            return _outside(k, ground, asked)
    order = tuple(range(len(points)))
    if reorder:
        best = _best_order(ground, points, progress)
        if isinstance(best, int):
            return _separation(best, points, ground, asked)
        order = best[0]
        if not best[1]:
            notes[heuristic_order(len(points))] = None
    ordered = [points[k] for k in order]
    legs = ground.loop(ordered)
    if isinstance(legs, int):
        return _separation(legs, ordered, ground, asked)
    chain = [point for leg in legs for point in leg.points[:-1]] or [ordered[0]]
    bound = None if robust else sum(leg.lower_bound for leg in legs)
    return _Chain(points=tuple(chain), order=order, lower_bound=bound)


def straight_loop_holds(
    request: PlanRequest, coefficients: Coefficients, color: Any, sign: str, use: Use, robust: bool = False
) -> bool:
    """Return whether the straight loop through a request's waypoints may be used along its whole length.

    With `robust`, also whether its least singular value is that of a waypoint, so that no other loop has a better one.
    """
    wanted = 1.0 if sign == "positive" else -1.0
    if use == "flyable":
        starts = np.array(request.waypoints)[:, [0, 1, 0, 1]]  # red, where α3 = α1 and α4 = α2
        ends = np.roll(starts, -1, axis=0)
        holds = _flies(starts, ends, wanted, request)
    else:
        gait = lift(request.waypoints, color, vehicle=request.vehicle, coefficients=coefficients)
        starts, ends = gait.alpha, gait.ends
        painted, noise = np.full(len(starts), color == "red"), noise_of(coefficients)
        holds = not jumps(starts, ends, painted, painted, coefficients).any()
        least = least_level_determinant(starts, ends, coefficients, sign=wanted, tolerance=0.0, floor=noise)
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


def _flies(starts: FloatArray, ends: FloatArray, wanted: float, request: PlanRequest) -> bool:
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


def _most_robust(asked: _Asked) -> Ground:
    """Return the region with the highest floor of the least singular value that still joins all waypoints."""
    points = asked.request.waypoints
    plane = np.array(points)
    high = float(np.min(least_singular_value_on_red(plane[:, 0], plane[:, 1], asked.request.vehicle)))
    low = asked.request.floor if asked.use == "flyable" else 0.0

    def joins(ground: Ground) -> bool:
        entries = [ground.entry(point) for point in points]
        first = entries[0]
        return first is not None and all(entry is not None and ground.region.joined(first, entry) for entry in entries)

    best = asked.ground()
    if high <= low or not joins(best):
        return best
    top = asked.ground(high)
    if joins(top):
        return top
    for _ in range(_ROBUST_STEPS):
        middle = (low + high) / 2
        ground = asked.ground(middle)
        if joins(ground):
            low, best = middle, ground
        else:
            high = middle
    return best


def _best_order(
    ground: Ground, points: Sequence[Point], progress: Callable[[str], None] | None
) -> tuple[tuple[int, ...], bool] | int:
    """Return the order of the shortest loop and whether that is proven, or a point that no way joins to the first."""
    import networkx as nx

    complete: nx.Graph[int] = nx.Graph()
    for a, (x, y) in enumerate(points):
        complete.add_node(a, alpha1=x, alpha2=y)
        if progress is not None and a and a % 50 == 0:
            progress(f"measured the ways between {a} of {len(points)} waypoints")
        for b in range(a):
            leg = ground.leg((x, y), points[b])
            if leg is None:
                return a - 1
            complete.add_edge(a, b, length=leg.length, flyable=True, continuous=True, keeps_sign=True)
    best = best_order(complete, list(range(len(points))), use="valid")
    if best is None:
        raise AssertionError("every two waypoints are joined")
    return best.order, best.exact


def _outside(k: int, ground: Ground, asked: _Asked) -> Obstacle:
    point = asked.request.waypoints[k]
    why = ground.region.why_not(point) or "it lies outside the admissible region"
    alpha = lift([point], asked.color, vehicle=asked.request.vehicle, coefficients=asked.coefficients).alpha[0]
    return Obstacle(
        color=asked.color,
        sign=asked.sign,
        kind="waypoint",
        message=f"{asked.color}, {RELATION[asked.sign]}: waypoint {k + 1} ({point[0]:.4f}, {point[1]:.4f}): {why}",
        waypoints=(k + 1,),
        R=float(level_determinant(alpha, asked.coefficients)),
    )


def with_nearest(obstacle: Obstacle, request: PlanRequest, coefficients: Coefficients) -> Obstacle:
    """Return an obstacle; at a waypoint, with the nearest point that a valid loop of its color and sign may pass."""
    if obstacle.kind != "waypoint":
        return obstacle
    asked = _Asked(request=request, coefficients=coefficients, color=obstacle.color, sign=obstacle.sign, use="valid")
    nearest = asked.ground().region.nearest(request.waypoints[obstacle.waypoints[0] - 1])
    if nearest is None:
        return obstacle
    message = f"{obstacle.message}; the nearest admissible point is ({nearest[0]:.4f}, {nearest[1]:.4f})"
    return replace(obstacle, message=message, nearest=nearest)


def _separation(leg: int, ordered: Sequence[Point], ground: Ground, asked: _Asked) -> Obstacle:
    ends = ordered[leg], ordered[(leg + 1) % len(ordered)]
    numbers = tuple(asked.request.waypoints.index(point) + 1 for point in ends)
    wall = separating_factor(*ends, asked.request.vehicle) if asked.color == "red" else None
    if wall is None:
        parts = [ground.region.component_of(point) for point in ends]
        areas = [f"{ground.region.components[part].area:.3g}" for part in parts if part is not None]
        wall = f"keep_out and keep_in: they lie in parts of the admissible region of {' and '.join(areas)} rad²"
        if asked.request.zones is None:
            wall = f"the border of the admissible region: they lie in parts of {' and '.join(areas)} rad²"
    return Obstacle(
        color=asked.color,
        sign=asked.sign,
        kind="separated",
        message=(
            f"{asked.color}, {RELATION[asked.sign]}: waypoints {numbers[0]} and {numbers[1]} are separated by {wall}"
        ),
        waypoints=numbers,
    )


def meeting_points(coefficients: Coefficients, sign: str) -> list[Point]:
    """Return the points (α1, α2) in [−π/2, π/2]² where red and blue meet with R of the given sign.

    With exact coefficients there is none: R = 0 at all four. With published ones their rounding leaves a sign.

    >>> [(round(a1, 4), round(a2, 4)) for a1, a2 in meeting_points(coefficients_of(), "negative")]
    [(0.1671, -0.1671)]
    >>> meeting_points(coefficients_of(kind="exact"), "negative")
    []
    """
    if coefficients.kind == "exact":
        return []
    delta, wanted = coefficients.delta, 1.0 if sign == "positive" else -1.0
    out: list[Point] = []
    for a1 in (delta, float(wrapped(delta + HALF_PI))):
        for a2 in (-delta, float(wrapped(HALF_PI - delta))):
            alpha = np.array([a1, a2, *map(float, sheet_angles("red", a1, a2, coefficients))])
            if wanted * level_determinant(alpha, coefficients) > noise_of(coefficients):
                out.append((a1, a2))
    return out


def _mixed(request: PlanRequest, coefficients: Coefficients, sign: str) -> Loop | None:
    """Return the shortest loop that changes its color where the sheets meet, or None."""
    meets = meeting_points(coefficients, sign)
    if not meets or request.any_order:
        return None
    points = request.waypoints
    lacking = {color: rootless(request, coefficients, color, sign) for color in COLORS}
    stops = [[color for color in COLORS if k not in lacking[color]] for k in range(len(points))]
    if not all(stops):
        return None
    grounds: dict[str, Ground] = {
        color: _Asked(request=request, coefficients=coefficients, color=color, sign=sign, use="valid").ground()
        for color in COLORS
    }

    def way(a: Point, b: Point, before: str, after: str) -> _Way | None:
        if before == after:
            leg = grounds[before].leg(a, b)
            return None if leg is None else (leg.length, [(point, before) for point in leg.points[:-1]])
        best: _Way | None = None
        for meet in meets:
            first, second = grounds[before].leg(a, meet), grounds[after].leg(meet, b)
            if first is None or second is None:
                continue
            length = first.length + second.length
            if best is None or length < best[0]:
                trail = [(point, before) for point in first.points]
                best = (length, trail + [(point, after) for point in second.points[:-1]])
        return best

    best: _Way | None = None
    for start in stops[0]:
        reached: dict[str, _Way] = {start: (0.0, [])}
        for (a, b), options in zip(pairwise([*points, points[0]]), [*stops[1:], [start]], strict=True):
            following: dict[str, _Way] = {}
            for before, (so_far, trail) in reached.items():
                for after in options:
                    step = way(a, b, before, after)
                    if step is not None and so_far + step[0] < following.get(after, (math.inf, []))[0]:
                        following[after] = (so_far + step[0], trail + step[1])
            reached = following
        if start in reached and (best is None or reached[start][0] < best[0]):
            best = reached[start]
    if best is None or len({color for _, color in best[1]}) < 2:
        return None
    path = lift(
        [point for point, _ in best[1]],
        [color for _, color in best[1]],
        vehicle=request.vehicle,
        coefficients=coefficients,
    )
    return loop_of(path, tuple(range(len(points))), request, sign, lower_bound=None)
