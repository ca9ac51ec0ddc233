"""What no loop through discs can better: the highest level of its worst place, and the least length.

Write f for what is to be as large as possible at the worst place of a loop. A loop keeps a level c if it stays where
f ≥ c. So some continuous loop through all discs keeps c exactly if one component of

    (admissible region) ∩ {f ≥ c}

meets every disc. That is decided by polygons: if no component of the *outer* ones does, no loop keeps c, whatever its
form. Halving the interval of c then brackets the best worst case of all loops, however many local optima there are.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt
import shapely

from gaitgraph.invertibility.matrices import hover_thrust_shares, least_singular_value_on_red
from gaitgraph.planning.shortest_paths import ShortestPaths
from gaitgraph.surface.admissible import singular_value_region, thrust_region, why_empty
from gaitgraph.surface.region import DEFAULT_ACCURACY, TOUCH, Region, offset
from gaitgraph.surface.sheets import separating_factor
from gaitgraph.vehicle import PAPER, Vehicle

if TYPE_CHECKING:
    from shapely import Polygon
    from shapely.geometry.base import BaseGeometry

FloatArray = npt.NDArray[np.float64]
Worst = Literal["singular_value", "hover_reserve"]

_CLOSE = 2e-5  # relative width to which levels are bracketed, about
_ROUNDS = 16
_FOLLOWED = 1e-5  # accuracy of the levels' polygons [rad]
_HIGHEST_SHARE = 1e3
_SMALL = 1e-7  # what a side of length zero counts as, so that lengths are smooth [rad]


@dataclass(frozen=True, slots=True, kw_only=True)
class Discs:
    """Discs to pass, in order: centres, shape (n, 2), and radii, shape (n,), zero for a point [rad]."""

    centers: FloatArray
    radii: FloatArray

    @property
    def round(self) -> npt.NDArray[np.bool_]:
        """Which discs have an interior, shape (n,)."""
        return self.radii > 0

    def misses(self, points: FloatArray) -> float:
        """Return how far outside its disc the farthest of n points lies [rad]."""
        return float(np.max(np.linalg.norm(points - self.centers, axis=1) - self.radii))


def level_region(
    objective: Worst, level: float, vehicle: Vehicle = PAPER, *, accuracy: float = DEFAULT_ACCURACY
) -> Region:
    """Return where the least singular value, or the hover reserve, is at least a level, on the red sheet.

    The hover reserve is what the thrusts that carry the weight, in units of m·g per rotor, can fall by until the first
    rotor idles and, if the vehicle states a largest thrust, grow by until the first one reaches it: the smaller one.
    """
    if objective == "singular_value":
        return singular_value_region(level, vehicle, accuracy=accuracy)
    most = vehicle.thrust_share
    return thrust_region(None if most is None else most - level, vehicle, least=level, accuracy=accuracy)


def component_meeting(shape: BaseGeometry, discs: Discs) -> Polygon | None:
    """Return the polygon, of several, that meets every disc, the largest if there are more; or None."""
    centers = shapely.points(discs.centers)
    meeting: list[Any] = [
        part
        for part in shapely.get_parts(shape)
        if part.geom_type == "Polygon" and (shapely.distance(part, centers) <= discs.radii + TOUCH).all()
    ]
    return max(meeting, key=lambda part: (part.area, part.bounds), default=None)


def why_apart(region: Region, discs: Discs, floor: float, vehicle: Vehicle) -> str:
    """Return why no component of a region meets every disc: which disc misses it, or which two lie apart."""
    if not region.components:
        return why_empty(region, floor, vehicle)
    meets = []
    for number, (center, radius) in enumerate(zip(discs.centers, discs.radii, strict=True), start=1):
        distance = shapely.distance(np.array(region.components, dtype=object), shapely.Point(center))
        meets.append(set(np.flatnonzero(distance <= radius + TOUCH).tolist()))
        if not meets[-1]:
            x, y = region.nearest(center) or center
            return (
                f"waypoint {number} ({center[0]:.4f}, {center[1]:.4f}) is not flyable "
                f"({region.why_not(center) or 'outside the region'}); the nearest flyable point, ({x:.4f}, {y:.4f}), "
                f"is {float(distance.min()):.4f} rad away, more than its radius {radius:.4g}"
            )
    for a, b in combinations(range(len(meets)), 2):
        if not meets[a] & meets[b]:
            factor = separating_factor(discs.centers[a].tolist(), discs.centers[b].tolist(), vehicle)
            separated = f", separated by {factor}" if factor else ""
            return f"waypoints {a + 1} and {b + 1} lie in different parts of the flyable region{separated}"
    return "each two of the waypoints share a part of the flyable region, but no part reaches all of them"


def highest_level(
    region: Region, objective: Worst, discs: Discs, vehicle: Vehicle, *, clearance: float
) -> tuple[float, float]:
    """Return a bracket of the highest level that a loop through discs can keep in a region, which joins them.

    A loop that keeps the lower end can stay `clearance` [rad] away from every border.
    """

    def joined(level: float) -> bool:
        polygons = level_region(objective, level, vehicle, accuracy=_FOLLOWED).outer
        return component_meeting(region.outer & polygons, discs) is not None

    most = vehicle.thrust_share
    top = _HIGHEST_SHARE if most is None else most / 2
    if objective == "singular_value":
        top = 2 * math.sqrt((1 + vehicle.drag_ratio**2) / 3)
    # Often a disc alone decides: then its best point is all there is to know. The polygons say whether it is so.
    low, high = 0.0, top
    each = zip(discs.centers, discs.radii, strict=True)
    best = min(_best_in_disc(region, objective, center, radius, vehicle) for center, radius in each)
    guesses = best * (1 - _CLOSE), best * (1 + 2 * _CLOSE)
    while high - low > 4 * _CLOSE * max(high, 1e-3):
        middle = next((guess for guess in guesses if low < guess < high), (low + high) / 2)
        low, high = (middle, high) if joined(middle) else (low, middle)
    # What all loops cannot do is known; what one can, with polygons from within and clear of them, is a little less.
    given = _CLOSE
    while given < 1:
        level = high * (1 - given)
        inner: Any = region.inner & level_region(objective, level, vehicle, accuracy=_FOLLOWED).inner
        if component_meeting(offset(inner, -clearance), discs) is not None:
            return level, high
        given *= 2
    return 0.0, high


def _best_in_disc(region: Region, objective: Worst, center: FloatArray, radius: float, vehicle: Vehicle) -> float:
    """Return nearly the highest level at points of a disc in a region: a guess, from samples that close in on it."""
    most = vehicle.thrust_share
    turn, reach = np.meshgrid(np.arange(24) * (math.pi / 12), np.linspace(0.0, 1.0, 7), indexing="ij")
    pattern = np.column_stack([(reach * np.cos(turn)).ravel(), (reach * np.sin(turn)).ravel()])
    best, at, size = 0.0, center, radius
    for _ in range(_ROUNDS):
        points = _within(at + size * pattern, center, radius)
        points = points[region.contains(points)]
        if len(points):
            if objective == "singular_value":
                values = np.asarray(least_singular_value_on_red(points[:, 0], points[:, 1], vehicle))
            else:
                shares = hover_thrust_shares(np.hstack([points, points]), vehicle)
                least = shares.min(axis=1)
                values = np.asarray(least if most is None else np.minimum(least, most - shares.max(axis=1)))
            top = int(np.argmax(values))
            if values[top] >= best:
                best, at = float(values[top]), points[top]
        size *= 0.5
    return best


def _within(points: FloatArray, centers: FloatArray, radii: Any) -> FloatArray:
    """Return points moved into discs, straight towards the centres."""
    off = points - centers
    return np.asarray(centers + off * np.minimum(1.0, radii / np.maximum(np.linalg.norm(off, axis=1), 1e-300))[:, None])


def least_loop_length(discs: Discs, region: Region | None = None) -> float:
    """Return a lower bound of the length of closed curves that pass discs in order [rad in the (α1, α2) plane].

    Whatever vectors y₁ … yₙ of length one or less are taken, with xᵢ where the curve passes disc i (centre cᵢ, radius
    rᵢ),

        length ≥ Σ ‖xᵢ₊₁ − xᵢ‖ ≥ Σ yᵢ·(xᵢ₊₁ − xᵢ) = Σ xᵢ·(yᵢ₋₁ − yᵢ) ≥ Σ cᵢ·(yᵢ₋₁ − yᵢ) − rᵢ·‖yᵢ₋₁ − yᵢ‖,

    and the directions of the shortest polygon make it sharp. If all radii are zero, the lengths of the shortest paths
    inside the region's outer polygons count instead.

    >>> square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    >>> round(least_loop_length(Discs(centers=square, radii=np.zeros(4))), 9)
    4.0
    """
    points, bound = shortest_loop(discs)
    if region is None or discs.radii.any():
        return bound
    outer = component_meeting(region.outer, discs)
    if outer is None:
        return bound
    paths = ShortestPaths(outer)
    legs = [paths.path(a, b) for a, b in zip(points, np.roll(points, -1, axis=0), strict=True)]
    lengths = [np.linalg.norm(np.diff(leg, axis=0), axis=1).sum() for leg in legs if leg is not None]
    return max(bound, float(sum(lengths)))  # without a leg that is not found, a lower bound still


def shortest_loop(discs: Discs) -> tuple[FloatArray, float]:
    """Return the corners of the shortest closed polygon through discs, without obstacles, and a bound of its length."""
    from scipy.optimize import minimize

    centers, radii = discs.centers, discs.radii
    points = centers.copy()
    if radii.any() and len(radii) > 1:

        def length(x: FloatArray) -> tuple[float, FloatArray]:
            at = x.reshape(-1, 2)
            step = np.roll(at, -1, axis=0) - at
            size = np.sqrt(np.sum(step**2, axis=1) + _SMALL**2)
            unit = step / size[:, None]
            return float(size.sum()), (np.roll(unit, 1, axis=0) - unit).ravel()

        def inside(x: FloatArray) -> FloatArray:
            return np.asarray(radii**2 - np.sum((x.reshape(-1, 2) - centers) ** 2, axis=1))

        def inside_slope(x: FloatArray) -> FloatArray:
            off = -2 * (x.reshape(-1, 2) - centers)
            return np.asarray((np.eye(len(radii))[:, :, None] * off[:, None, :]).reshape(len(radii), -1))

        found: Any = minimize(  # type: ignore[call-overload]
            length,
            points.ravel(),
            jac=True,
            method="SLSQP",
            constraints=[{"type": "ineq", "fun": inside, "jac": inside_slope}],
            options={"maxiter": 500, "ftol": 1e-14},
        )
        points = _within(found.x.reshape(-1, 2), centers, radii)
    # Where two corners coincide no unit vector is distinguished; shorter ones bound the length too.
    step = np.roll(points, -1, axis=0) - points
    pull = step / np.sqrt(np.sum(step**2, axis=1, keepdims=True) + (_SMALL**2 if radii.any() else 1e-300))
    turn = np.roll(pull, 1, axis=0) - pull
    bound = float(np.sum(centers * turn) - np.sum(radii * np.linalg.norm(turn, axis=1)))
    return points, max(bound * (1 - 1e-12), 0.0)
