"""Where red and blue meet, and loops that change their color there."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from gaitgraph.angles import HALF_PI, wrapped
from gaitgraph.gait.gait import lift
from gaitgraph.invertibility.matrices import Coefficients, level_determinant, noise_of
from gaitgraph.planning.plan import Loop, loop_of
from gaitgraph.planning.prepared import Asked, PreparedRegion
from gaitgraph.planning.refusal import rootless
from gaitgraph.planning.request import Point
from gaitgraph.surface.sheets import COLORS, sheet_angles

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gaitgraph.planning.request import PlanRequest

__all__ = ["meeting_points", "mixed_loop"]

_Way = tuple[float, list[tuple[Point, str]]]


def meeting_points(coefficients: Coefficients, sign: str) -> list[Point]:
    """Return the points (α1, α2) in [−π/2, π/2]² where red and blue meet with R of the given sign.

    With exact coefficients there is none: R = 0 at all four. With published ones their rounding leaves a sign.

    >>> from gaitgraph.invertibility.matrices import coefficients_of
    >>> [(round(a1, 4), round(a2, 4)) for a1, a2 in meeting_points(coefficients_of(), "negative")]
    [(0.1671, -0.1671)]
    >>> meeting_points(coefficients_of(kind="exact"), "negative")
    []
    """
    if coefficients.kind == "exact":
        return []
    delta, wanted = coefficients.delta, 1.0 if sign == "positive" else -1.0
    first, second = (delta, float(wrapped(delta + HALF_PI))), (-delta, float(wrapped(HALF_PI - delta)))
    points = [(a1, a2) for a1 in first for a2 in second]
    a1, a2 = np.array(points).T
    values = level_determinant(np.stack([a1, a2, *sheet_angles("red", a1, a2, coefficients)], axis=-1), coefficients)
    kept = wanted * values > noise_of(coefficients)
    return [point for point, keep in zip(points, kept, strict=True) if keep]


def _least_length(points: Sequence[Point], meets: Sequence[Point]) -> float:
    """Return a length that no mixed loop falls below: two legs at least go by way of a meeting point."""
    legs = list(pairwise([*points, points[0]]))
    ways = sorted(min(math.dist(a, meet) + math.dist(meet, b) for meet in meets) - math.dist(a, b) for a, b in legs)
    return sum(math.dist(a, b) for a, b in legs) + sum(ways[:2])


def mixed_loop(request: PlanRequest, coefficients: Coefficients, sign: str, *, below: float = math.inf) -> Loop | None:
    """Return the shortest loop that changes its color where the sheets meet, or None if none is shorter than `below`.

    Parameters
    ----------
    request, coefficients, sign
        What is asked for.
    below
        The length of a loop that is known already [rad].
    """
    meets = meeting_points(coefficients, sign)
    if not meets or request.any_order:
        return None
    points = request.waypoints
    if _least_length(points, meets) >= below:
        return None
    lacking = {color: rootless(request, coefficients, color, sign) for color in COLORS}
    stops = [[color for color in COLORS if k not in lacking[color]] for k in range(len(points))]
    if not all(stops):
        return None
    regions: dict[str, PreparedRegion] = {
        color: Asked(request=request, coefficients=coefficients, color=color, sign=sign, use="valid").prepared()
        for color in COLORS
    }

    def way(a: Point, b: Point, before: str, after: str) -> _Way | None:
        if before == after:
            leg = regions[before].leg(a, b)
            return None if leg is None else (leg.length, [(point, before) for point in leg.points[:-1]])
        best: _Way | None = None
        for meet in meets:
            first, second = regions[before].leg(a, meet), regions[after].leg(meet, b)
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
    loop = loop_of(path, tuple(range(len(points))), request, sign, method="exact")
    return loop if loop.length < below else None
