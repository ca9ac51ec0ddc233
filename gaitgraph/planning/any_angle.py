"""The shortest loops of each color and sign of R, flyable and valid, or what is in their way."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitgraph.gait.gait import lift
from gaitgraph.graph.walks import best_order
from gaitgraph.invertibility.matrices import Coefficients, least_singular_value_on_red, level_determinant
from gaitgraph.planning.meetings import mixed_loop
from gaitgraph.planning.plan import Candidates, Loop, heuristic_order, loop_of
from gaitgraph.planning.prepared import Asked, PreparedRegion, Use, length_of
from gaitgraph.planning.refusal import RELATION, Obstacle, rootless, waypoint_obstacle
from gaitgraph.planning.straight import straight_loop_holds
from gaitgraph.surface.sheets import COLORS, separating_factor

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from gaitgraph.planning.request import PlanRequest, Point

__all__ = ["any_angle_candidates", "with_nearest"]

_FINE = 1e-7  # accuracy for which curved borders have so many corners that it takes a while [rad]
_ROBUST_STEPS = 22  # halvings of the range of least singular values: to better than 1e-6


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
    if progress is not None and request.accuracy < _FINE:
        progress(f"drawing regions to {request.accuracy:g} rad, which takes a while")
    for color in COLORS if request.color == "auto" else (request.color,):
        if progress is not None:
            progress(f"searching {color} loops with {RELATION[sign]}")
        loops = _loops_of(request, coefficients, color, sign, found.notes, progress)
        if isinstance(loops, Obstacle):
            found.obstacles.append(loops)
        else:
            found.loops += loops
    straight = length_of([*request.waypoints, request.waypoints[0]])
    if request.color == "auto" and all(loop.length > straight + 1e-9 for loop in found.loops):
        shortest = min((loop.length for loop in found.loops), default=math.inf)
        mixed = mixed_loop(request, coefficients, sign, below=shortest - 1e-9)
        if mixed is not None:
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
    asked = Asked(request=request, coefficients=coefficients, color=color, sign=sign, use="valid")
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
            loops.append(loop_of(path, chain.order, request, sign, lower_bound=chain.lower_bound, method="exact"))
        if chain.straight:
            break  # nothing is shorter
    return loops


def _chain(asked: Asked, notes: dict[str, None], progress: Callable[[str], None] | None) -> _Chain | Obstacle:
    request = asked.request
    points, robust = request.waypoints, request.objective == "robust" and asked.color == "red"
    reorder = request.any_order and len(points) > 3
    straight = (asked.request, asked.coefficients, asked.color, asked.sign, asked.use)
    if not reorder and straight_loop_holds(*straight, robust=robust):
        length = length_of([*points, points[0]])
        return _Chain(points=points, order=tuple(range(len(points))), lower_bound=length, straight=True)
    prepared = _most_robust(asked) if robust else asked.prepared()
    for k, point in enumerate(points):
        if prepared.entry(point) is None:
            return _outside(k, prepared, asked)
    order = tuple(range(len(points)))
    if reorder:
        best = _best_order(prepared, points, progress)
        if isinstance(best, int):
            return _separation(best, points, prepared, asked)
        order = best[0]
        if not best[1]:
            notes[heuristic_order(len(points))] = None
    ordered = [points[k] for k in order]
    legs = prepared.loop(ordered)
    if isinstance(legs, int):
        return _separation(legs, ordered, prepared, asked)
    chain = [point for leg in legs for point in leg.points[:-1]] or [ordered[0]]
    bound = None if robust else sum(leg.lower_bound for leg in legs)
    return _Chain(points=tuple(chain), order=order, lower_bound=bound)


def _most_robust(asked: Asked) -> PreparedRegion:
    """Return the region with the highest floor of the least singular value that still joins all waypoints."""
    points = asked.request.waypoints
    plane = np.array(points)
    high = float(np.min(least_singular_value_on_red(plane[:, 0], plane[:, 1], asked.request.vehicle)))
    low = asked.request.floor if asked.use == "flyable" else 0.0

    def joins(prepared: PreparedRegion) -> bool:
        entries = [prepared.entry(point) for point in points]
        first = entries[0]
        return first is not None and all(
            entry is not None and prepared.region.joined(first, entry) for entry in entries
        )

    best = asked.prepared()
    if high <= low or not joins(best):
        return best
    top = asked.prepared(high)
    if joins(top):
        return top
    # Mostly a waypoint is the worst place, and every step would go up: where that ends is tried first.
    last = low
    for _ in range(_ROBUST_STEPS):
        last = (last + high) / 2
    nearly = asked.prepared(last)
    if joins(nearly):
        return nearly
    for _ in range(_ROBUST_STEPS):
        middle = (low + high) / 2
        prepared = asked.prepared(middle)
        if joins(prepared):
            low, best = middle, prepared
        else:
            high = middle
    return best


def _best_order(
    prepared: PreparedRegion, points: Sequence[Point], progress: Callable[[str], None] | None
) -> tuple[tuple[int, ...], bool] | int:
    """Return the order of the shortest loop and whether that is proven, or a point that no way joins to the first."""
    import networkx as nx

    complete: nx.Graph[int] = nx.Graph()
    for a, (x, y) in enumerate(points):
        complete.add_node(a, alpha1=x, alpha2=y)
        if progress is not None and a:
            progress(f"measured the ways between {a} of {len(points)} waypoints")
        for b in range(a):
            leg = prepared.leg((x, y), points[b])
            if leg is None:
                return a - 1
            complete.add_edge(a, b, length=leg.length, flyable=True, continuous=True, keeps_sign=True)
    best = best_order(complete, list(range(len(points))), use="valid")
    if best is None:
        raise AssertionError("every two waypoints are joined")
    return best.order, best.exact


def _outside(k: int, prepared: PreparedRegion, asked: Asked) -> Obstacle:
    point = asked.request.waypoints[k]
    why = prepared.region.why_not(point) or "it lies outside the admissible region"
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
    asked = Asked(request=request, coefficients=coefficients, color=obstacle.color, sign=obstacle.sign, use="valid")
    region, point = asked.prepared().region, request.waypoints[obstacle.waypoints[0] - 1]
    nearest = region.nearest(point)
    if nearest is None:
        return obstacle
    message = f"{obstacle.message}; the nearest admissible point is {region.nearest_as_text(point)}"
    return replace(obstacle, message=message, nearest=nearest)


def _separation(leg: int, ordered: Sequence[Point], prepared: PreparedRegion, asked: Asked) -> Obstacle:
    ends = ordered[leg], ordered[(leg + 1) % len(ordered)]
    numbers = tuple(asked.request.waypoints.index(point) + 1 for point in ends)
    wall = separating_factor(*ends, asked.request.vehicle) if asked.color == "red" else None
    if wall is None:
        parts = [prepared.region.component_of(point) for point in ends]
        areas = [f"{prepared.region.components[part].area:.3g}" for part in parts if part is not None]
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
