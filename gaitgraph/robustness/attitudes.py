r"""Singular and acceptable attitudes in the roll–pitch diagram, in closed form.

An attitude with |φ|, |θ| < π/2 corresponds to one upward vertical n in body axes with n_z > 0. A configuration is
singular where v·n = 0, v = (−Rθ, Rφ, R): on half a great circle, one branch from border to border of the diagram,

    tan θ = −(Rφ·sin φ + R·cos φ)/Rθ.

A gait is singular at some time at every n that is perpendicular to some v(t). At all other n, v(t)·n has one sign for
all t. These n form two convex cones: all n with v(t)·n > 0, and the mirror image. So the acceptable attitudes around
(0, 0) are the dual of the cone that v sweeps: a spherical polygon with one side for each extreme v, found by a convex
hull in the plane.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, cast

import numpy as np
import numpy.typing as npt
import shapely

from gaitgraph.angles import HALF_PI, angle_within, angles_from, checked_number
from gaitgraph.arrays import freeze_arrays
from gaitgraph.errors import wrong
from gaitgraph.invertibility.coefficients import (
    Coefficients,
    CoefficientsLike,
    coefficients_of,
)
from gaitgraph.invertibility.forms import FloatArray
from gaitgraph.invertibility.matrices import (
    BoolArray,
    IntArray,
    attitude_of,
    attitude_sensitivities,
    noise_of,
)
from gaitgraph.invertibility.tilt_margins import (
    EVERYWHERE,
    LeastMargin,
    least_tilt_margin,
    sensitivity_deviations,
    singular_everywhere,
)
from gaitgraph.records import Record
from gaitgraph.surface.region import polygons_of
from gaitgraph.tolerances import ROUND_OFF, SAME_ANGLE
from gaitgraph.vehicle import PAPER, VehicleLike

DIAGRAM_AREA = math.pi**2  # rad², of the roll–pitch diagram (−π/2, π/2)²
_MOST_PIECES = 100_000
_SIDES = 64  # of a cone, against which pieces are tested
_FIRST_POINTS = 3  # of a side
_MOST_HALVINGS = 40
_DEEP = 0.1  # products of unit vectors of which a vertical is deep inside
_THIN = 1e-13  # of the length of points on a line: how far rounding leads them off it
_SAG = 1e-6  # rad, largest distance of straight sides of a polygon from the curves
_AT_POLE = 1e-12  # rad of pitch

_UP = np.array([0.0, 0.0, 1.0])
_NOT_LEVEL = "R changes its sign or vanishes: level flight itself is singular somewhere in the period"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SingularCurve(Record):
    """The attitudes at which one configuration is singular; `normal` is (−Rθ, Rφ, R), shape (3,), read-only.

    `kind` is "curve"; "none" inside ±π/2, as on the gait surfaces; or "everywhere", where Rφ = Rθ = R = 0.
    """

    kind: Literal["curve", "none", "everywhere"]
    normal: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(self)

    def points(self, count: int = 181) -> FloatArray:
        """Return points of the curve from border to border of the diagram, (roll, pitch), shape (count, 2) [rad].

        The points are spaced evenly on the unit sphere of verticals; both ends are on the border. Without a curve the
        shape is (0, 2).
        """
        if self.kind != "curve":
            return np.zeros((0, 2))
        x, y, _ = self.normal
        along = np.array([-y, x, 0.0]) / math.hypot(x, y)
        highest = np.cross(self.normal, along) / np.linalg.norm(self.normal)
        turn = np.linspace(0.0, math.pi, count)
        return _attitudes_of(_on_arc(along, highest, turn), highest)


def singular_curve(
    alpha: npt.ArrayLike,
    coefficients: CoefficientsLike | None = None,
    *,
    vehicle: VehicleLike = PAPER,
    angle_rounding: float = 0.0,
) -> SingularCurve:
    """Return the attitudes at which tilt angles, shape (4,) [rad], are singular; `angle_rounding` is their error [rad].

    The coefficients are those of formula (1), by default those of the vehicle.

    >>> singular_curve([0.4, -1.1, 0.4, -1.1]).kind
    'none'
    """
    coefficients = coefficients_of(vehicle, coefficients)
    angles = angles_from(alpha, "alpha")
    if angles.shape != (4,):
        raise wrong("alpha", "must be four tilt angles (rad)", alpha)
    rounding = angle_within(angle_rounding, "angle_rounding", least=0.0)
    normal = attitude_sensitivities(angles, coefficients)
    if singular_everywhere(angles, coefficients, angle_rounding=rounding):
        return SingularCurve(kind="everywhere", normal=normal)
    flat = math.hypot(normal[0], normal[1]) <= noise_of(coefficients)
    return SingularCurve(kind="none" if flat else "curve", normal=normal)


@dataclass(frozen=True, slots=True, kw_only=True)
class AcceptableAttitudes(Record):
    """The attitudes at which a gait is never singular, over its whole period.

    `polygon` holds those connected with (0, 0), as (roll, pitch) [rad]; if it is empty, `reason` says why. Every
    attitude in it is proven, and its straight sides are within 1e-6 rad of the curves. `error` bounds the fraction of
    the diagram that is acceptable around (0, 0) but missing in `polygon`; the requested bound is `tolerance`.

    The matrix may still be badly conditioned there; see
    :func:`gaitgraph.invertibility.tilt_margins.least_singular_value_within`.
    """

    polygon: shapely.Polygon
    error: float
    tolerance: float
    reason: str = ""

    @property
    def fraction(self) -> float:
        """Fraction of (−π/2, π/2)² that the polygon covers."""
        return min(float(self.polygon.area) / DIAGRAM_AREA, 1.0)

    @property
    def met(self) -> bool:
        """Whether the error is within the tolerance."""
        return self.error <= self.tolerance


def acceptable_attitudes(
    alpha: npt.ArrayLike,
    coefficients: CoefficientsLike | None = None,
    *,
    vehicle: VehicleLike = PAPER,
    tolerance: float = 1e-5,
    angle_rounding: float = 0.0,
) -> AcceptableAttitudes:
    """Return the attitudes at which a gait is never singular, at any time of its period.

    Parameters
    ----------
    alpha
        Corners or rows of the gait, shape (n, 4), n ≥ 1, joined by straight segments and closed [rad].
    coefficients, vehicle
        Coefficients of formula (1), by default those of the vehicle; the physical answer takes exact ones.
    tolerance
        Requested bound of the missing fraction of the diagram; the gait is cut finer until it is met, if possible.
    angle_rounding
        Assumed error of each angle [rad]; within it v may be zero.

    Examples
    --------
    >>> from gaitgraph.gait.gait import lift
    >>> gait = lift([(1.178, -1.178), (1.178, -0.393), (0.393, -0.393), (0.393, -1.178)], "red")
    >>> [round(acceptable_attitudes(one.alpha, "exact").fraction, 3) for one in (gait, gait.biased(0.8))]
    [1.0, 0.852]
    """
    coefficients = coefficients_of(vehicle, coefficients)
    points = angles_from(alpha, "alpha")
    if points.ndim != 2 or points.shape[1] != 4 or not len(points):
        raise wrong(
            "alpha", "must be tilt angles of shape (n, 4), n at least 1 (rad)", alpha
        )
    rounding = angle_within(angle_rounding, "angle_rounding", least=0.0)
    closed = np.concatenate([points, points[:1]])
    margin = least_tilt_margin(closed, coefficients, angle_rounding=rounding)
    return attitudes_within(closed, coefficients, margin, tolerance)


def attitudes_within(
    closed: FloatArray,
    coefficients: Coefficients,
    margin: LeastMargin,
    tolerance: float,
) -> AcceptableAttitudes:
    """Return :func:`acceptable_attitudes` of a polyline that ends where it starts, from its least tilt margin."""
    rule = "a finite number above 0"
    tolerance = checked_number("tolerance", tolerance, rule, above=True)
    polygon, error = shapely.Polygon(), 0.0
    reason = ""
    if not margin.exists:
        reason = EVERYWHERE
    elif margin.upper == 0:
        reason = _NOT_LEVEL
    else:
        polygon, error = _proven_polygon(closed, coefficients, tolerance)
        if polygon.is_empty:
            reason = "R is too near to zero to be decided"
    return AcceptableAttitudes(
        polygon=polygon, error=error, tolerance=float(tolerance), reason=reason
    )


def _proven_polygon(
    closed: FloatArray, coefficients: Coefficients, tolerance: float
) -> tuple[shapely.Polygon, float]:
    """Return a polygon in which all is acceptable, and a bound of what it lacks; empty if R cannot be told from zero.

    Samples of v alone give a polygon with all that is acceptable. Pieces of the gait on which v may leave the cone of
    the samples are cut until both polygons agree.
    """
    starts, ends = closed[:-1], closed[1:]
    sign = math.copysign(1.0, attitude_sensitivities(starts[0], coefficients)[2])
    samples = np.zeros((0, 3))
    most = max(_MOST_PIECES, 2 * len(starts))
    pieces = 0
    while True:
        first = sign * attitude_sensitivities(starts, coefficients)
        last = sign * attitude_sensitivities(ends, coefficients)
        # Where a piece ends, the next begins.
        samples = np.concatenate([samples, first])
        inside = _inside(samples)
        if inside is None:
            return shapely.Polygon(), 1.0
        samples = _extreme_rays(samples, inside)
        between = _rays_between(first, last, starts, ends, coefficients)
        may_leave = _may_leave(samples, first, last, between)
        pieces += len(starts)
        is_last = pieces + 4 * may_leave.sum() > most
        if (between @ inside > 0).all():
            rays = between[may_leave].reshape(-1, 3)
            rays = _extreme_rays(np.concatenate([samples, rays]), inside)
            polygon = _polygon_of(rays)
            lacks = max(_polygon_of(samples).area - polygon.area, 0.0) / DIAGRAM_AREA
            by_sides = 0.0
            if len(rays) > 1:
                by_sides = _SAG * float(polygon.length) / DIAGRAM_AREA
            # Finer pieces gain at most what the straight sides lose.
            if is_last or lacks <= 2 * _SAG or lacks + by_sides <= tolerance:
                return polygon, lacks + by_sides
        elif is_last:
            return shapely.Polygon(), 1.0
        nodes = np.linspace(starts[may_leave], ends[may_leave], 5)
        starts = np.concatenate(nodes[:-1])
        ends = np.concatenate(nodes[1:])


def _rays_between(
    first: FloatArray,
    last: FloatArray,
    starts: FloatArray,
    ends: FloatArray,
    coefficients: Coefficients,
) -> FloatArray:
    """Return four rays for each piece, (m, 4, 3): with v at both ends their cone holds v all along it.

    v differs from its chord by 4·s·(1 − s) of the deviation at most. That is a parabola, whose Bézier point in the
    middle is off by twice the deviation: in a square about the chord, and at the lower height, which is the stricter.
    """
    across, level = sensitivity_deviations(starts, ends, coefficients)
    corners = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
    rays = np.repeat((first + last)[:, None] / 2, 4, axis=1)
    rays[:, :, :2] += 2 * across[:, None, None] * corners
    rays[:, :, 2] -= 2 * level[:, None]
    return rays


def _may_leave(
    cone: FloatArray, first: FloatArray, last: FloatArray, between: FloatArray
) -> BoolArray:
    """Return whether v may leave a cone of extreme rays along each piece.

    Its products with the normals of the cone are above parabolas with Bézier points f0, f and f1, which are nowhere
    negative if f ≥ −√(f0·f1). Of many rays some are taken: a piece with an end beside their cone is in the whole one if
    f ≥ 0.
    """
    if len(cone) < 3:
        return np.ones(len(first), dtype=bool)
    some = cone[:: -(-len(cone) // _SIDES)]
    normals = np.cross(some, np.roll(some, -1, axis=0)).T
    at_first, at_last = first @ normals, last @ normals
    is_beside = (np.minimum(at_first, at_last) < -ROUND_OFF).any(axis=1)
    allowed = np.sqrt(np.maximum(at_first, 0.0) * np.maximum(at_last, 0.0))
    allowed[is_beside] = 0.0
    least = (between @ normals).min(axis=1)
    return np.asarray((least < -allowed).any(axis=1))


def _inside(rays: FloatArray) -> FloatArray | None:
    """Return a vertical with a positive product with the upright one and every ray: upright, or the deepest one."""
    rows = np.vstack([_UP, rays])
    rows /= np.linalg.norm(rows, axis=1, keepdims=True)
    if rows[:, 2].min() > _DEEP:
        return _UP
    from scipy.optimize import linprog  # which most gaits need not load

    # The unknowns are the vertical and the least of all products, which is to be large.
    solution = linprog(
        [0.0, 0.0, 0.0, -1.0],
        A_ub=np.column_stack([-rows, np.ones(len(rows))]),
        b_ub=np.zeros(len(rows)),
        bounds=[(-1.0, 1.0)] * 4,
    )
    best = np.asarray(solution.x)
    if best[3] <= SAME_ANGLE:
        return None
    return np.asarray(best[:3] / np.linalg.norm(best[:3]))


def _extreme_rays(rays: FloatArray, inside: FloatArray) -> FloatArray:
    """Return the extreme rays of a cone and the upright one's, unit vectors, counter-clockwise about `inside`.

    Rays within 1e-9 rad of each other are one. Qhull keeps its hulls convex where points are within rounding of each
    other, but may lose an end of points that are on a line but for rounding; only both ends are extreme then.
    """
    from scipy.spatial import ConvexHull

    everything = np.vstack([_UP, rays])
    everything /= np.linalg.norm(everything, axis=1, keepdims=True)
    points = _projected(everything, inside)
    offset = points - points[0]
    farthest = offset[np.argmax(np.sum(offset**2, axis=1))]
    along = offset @ farthest
    beside = offset @ [-farthest[1], farthest[0]]
    if np.abs(beside).max() <= _THIN * along.max():
        index = np.unique([np.argmin(along), np.argmax(along)])
    else:
        index = np.asarray(ConvexHull(points).vertices)
    extreme = everything[np.roll(index, -int(np.argmax(index == 0)))]
    kept = [extreme[0]]  # the upright one, if it is extreme
    for ray in extreme[1:]:
        apart = np.abs(ray - [kept[0], kept[-1]]).max(axis=1)
        if apart.min() > SAME_ANGLE:
            kept.append(ray)
    return np.array(kept)


def _projected(rays: FloatArray, inside: FloatArray) -> FloatArray:
    """Return the central projection of rays onto the plane at distance one along `inside`, shape (..., 2)."""
    axis = np.eye(3)[np.argmin(np.abs(inside))]
    first = np.cross(inside, axis)
    first /= np.linalg.norm(first)
    second = np.cross(inside, first)
    return np.asarray(
        rays @ np.column_stack([first, second]) / (rays @ inside)[:, None]
    )


def _polygon_of(rays: FloatArray) -> shapely.Polygon:
    """Return the verticals that have a positive product with all extreme rays, given counter-clockwise."""
    if len(rays) == 1:
        return shapely.box(-HALF_PI, -HALF_PI, HALF_PI, HALF_PI)
    polygon = shapely.Polygon(_ring_of(rays))
    if not polygon.is_valid:
        parts = polygons_of(shapely.make_valid(polygon)).geoms
        polygon = max(
            parts, key=lambda part: float(part.area), default=shapely.Polygon()
        )
    # The first corner is then the same wherever the sides were cut.
    return cast("shapely.Polygon", polygon.normalize())


def _ring_of(rays: FloatArray) -> FloatArray:
    """Return the border of the polygon of :func:`_polygon_of` as points (roll, pitch), shape (k, 2).

    Each ray has a side across it, an arc of a great circle; that of the upright ray is on the horizon.
    """
    upright = np.flatnonzero((rays == _UP).all(axis=1))
    has_horizon = len(upright) > 0
    if has_horizon:
        rays = np.roll(rays, -1 - int(upright[0]), axis=0)  # the horizon is last
    corners = np.cross(rays, np.roll(rays, -1, axis=0))
    corners /= np.linalg.norm(corners, axis=1, keepdims=True)
    starts = np.roll(corners, 1, axis=0)
    along = np.cross(rays, starts)
    turn = np.full(2, math.pi)
    if len(rays) > 2:
        cosine = np.sum(corners * starts, axis=1)
        turn = np.arctan2(np.sum(corners * along, axis=1), cosine) % (2 * math.pi)
        turn = np.where(turn > 1.5 * math.pi, 0.0, turn)  # rounding of none
    curved = len(rays) - has_horizon
    points = _arcs(starts[:curved], along[:curved], turn[:curved])
    if not has_horizon:
        return points
    border = _border(starts[-1], float(turn[-1]))
    # Its end is the first point again, except for rounding, which would make a ring cross itself.
    is_new = np.abs(border - points[0]).max(axis=1) > SAME_ANGLE
    return np.concatenate([points, border[is_new]])


def _arcs(starts: FloatArray, along: FloatArray, turn: FloatArray) -> FloatArray:
    """Return points of sides that are arcs of great circles; straight lines between them are within 1e-6 rad.

    The end of a side is left out, since the next begins there, but for pitch ±π/2, where the next has another roll.
    """
    middle = _on_arc(starts, along, turn / 2)

    def at(side: IntArray, angle: FloatArray) -> FloatArray:
        return _attitudes_of(_on_arc(starts[side], along[side], angle), middle[side])

    side = np.repeat(np.arange(len(turn)), _FIRST_POINTS)
    angle = np.linspace(0.0, turn, _FIRST_POINTS).T.ravel()
    points = at(side, angle)
    for _ in range(_MOST_HALVINGS):
        between = (angle[1:] + angle[:-1]) / 2
        new = at(side[1:], between)
        chord = np.diff(points, axis=0)
        beside = new - points[:-1]
        area = np.abs(chord[:, 0] * beside[:, 1] - chord[:, 1] * beside[:, 0])
        is_wide = area > _SAG * np.linalg.norm(chord, axis=1)
        wide = np.flatnonzero(is_wide & (side[1:] == side[:-1]))
        if not wide.size:
            break
        angle = np.insert(angle, wide + 1, between[wide])
        side = np.insert(side, wide + 1, side[wide])
        points = np.insert(points, wide + 1, new[wide], axis=0)
    is_inner = np.append(side[1:] == side[:-1], False)
    at_pole = np.abs(points[:, 1]) > HALF_PI - _AT_POLE
    return np.asarray(points[is_inner | at_pole])


def _on_arc(starts: FloatArray, along: FloatArray, angle: FloatArray) -> FloatArray:
    """Return unit vectors at angles from the starts of arcs of great circles, shape (k, 3)."""
    return starts * np.cos(angle)[:, None] + along * np.sin(angle)[:, None]


def _attitudes_of(verticals: FloatArray, middle: FloatArray) -> FloatArray:
    """Return (roll, pitch) of verticals, shape (k, 2) [rad]; at pitch ±π/2 roll is that of `middle`, which is near."""
    at_pole = np.hypot(verticals[:, 1], verticals[:, 2]) < _AT_POLE
    beside = np.where(at_pole[:, None], middle, verticals)
    roll = np.arctan2(beside[:, 1], np.maximum(beside[:, 2], 0.0))
    return np.column_stack([roll, attitude_of(verticals)[:, 1]])


def _border(start: FloatArray, turn: float) -> FloatArray:
    """Return the corners of a side along the border of the diagram, where the vertical is horizontal."""
    first = math.atan2(start[1], start[0])
    last = first + turn
    poles = math.pi * np.arange(math.ceil(first / math.pi), last // math.pi + 1)
    angles = np.concatenate([[first], poles, [last]])
    pitch = -np.arcsin(np.cos(angles))
    # At a pole the roll steps from one side of the diagram to the other.
    sides = [np.clip(angles + step, first, last) for step in (-1e-9, 1e-9)]
    roll = np.copysign(HALF_PI, np.sin(sides))
    corners = np.stack([roll, np.array([pitch, pitch])], axis=-1)
    return np.concatenate(corners.swapaxes(0, 1))
