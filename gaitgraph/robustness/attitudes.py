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
from typing import Literal, NamedTuple, cast

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
    IntArray,
    attitude_of,
    attitude_sensitivities,
    noise_of,
)
from gaitgraph.invertibility.tilt_margins import (
    EVERYWHERE,
    segment_singular_everywhere,
    sensitivity_deviations,
    singular_everywhere,
)
from gaitgraph.records import Record
from gaitgraph.surface.region import polygons_of
from gaitgraph.tolerances import SAME_ANGLE
from gaitgraph.vehicle import PAPER, VehicleLike

DIAGRAM_AREA = math.pi**2  # rad², of the roll–pitch diagram (−π/2, π/2)²
_MOST_PIECES = 50_000
_SIDES = 64  # of a cone, against which pieces are tested
_LONGEST_PIECE = 0.5  # rad of the largest tilt angle, before any refinement
_MOST_HALVINGS = 40
_SAMPLES = 5  # of a piece
_SMALL = 0.1  # an |R| above what rounded coefficients make of zero
_FEW_RAYS = 64
_DEEP = 0.1  # products of unit vectors of which a vertical is deep inside
_THIN = 1e-13  # of the length of points on a line: how far rounding leads them off it
_SAG = 1e-6  # rad, largest distance of straight sides of a polygon from the curves

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
        x, y, z = self.normal
        across = math.hypot(x, y)
        along = np.array([-y, x, 0.0]) / across
        highest = np.array([-z * x / across, -z * y / across, across]) / math.hypot(
            across, z
        )
        turn = np.linspace(0.0, math.pi, count)[:, None]
        return _attitudes_of(along * np.cos(turn) + highest * np.sin(turn), highest)


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
    checked_number("tolerance", tolerance, "a finite number above 0", above=True)
    rounding = angle_within(angle_rounding, "angle_rounding", least=0.0)
    sweep = _sweep_of(points, coefficients)
    polygon, error, reason = shapely.Polygon(), 0.0, _NOT_LEVEL
    heights = np.concatenate([sweep.v0[:, 2], sweep.v1[:, 2]])
    vanishing = _vanishing(sweep, coefficients, rounding)
    if len(vanishing):
        exactly = singular_everywhere(vanishing, coefficients.as_they_stand).all()
        along = segment_singular_everywhere(
            sweep.starts, sweep.ends, coefficients, rounding
        )
        if along is not None or not exactly:
            reason = EVERYWHERE
    elif (heights > 0).all() or (heights < 0).all():
        # Level flight is nowhere singular at the samples.
        side = math.copysign(1.0, heights[0])
        inside = _inside(side * np.concatenate([sweep.v0, sweep.v1]))
        found = None
        if inside is not None:
            found = _narrowed(sweep, coefficients, side, inside, tolerance)
        if found is None:
            error, reason = 1.0, "R is too near to zero to be decided"
        elif not found[0].is_empty:
            (polygon, error), reason = found, ""
    return AcceptableAttitudes(
        polygon=polygon, error=error, tolerance=float(tolerance), reason=reason
    )


def _sweep_of(points: FloatArray, coefficients: Coefficients) -> _Sweep:
    """Return the closed polyline through points in short pieces."""
    step = np.roll(points, -1, axis=0) - points
    size = np.abs(step).max(axis=1)
    longest = max(_LONGEST_PIECE, float(size.sum()) / _MOST_PIECES)
    segment, number, count = _counted(np.maximum(np.ceil(size / longest), 1))
    starts = points[segment] + (number / count)[:, None] * step[segment]
    v = attitude_sensitivities(starts, coefficients)
    return _swept(
        starts, np.roll(starts, -1, axis=0), v, np.roll(v, -1, axis=0), coefficients
    )


def _vanishing(
    sweep: _Sweep, coefficients: Coefficients, rounding: float
) -> FloatArray:
    """Return samples at which v may vanish, of pieces on which R is small enough for that, shape (k, 4) [rad]."""
    height = np.minimum(np.abs(sweep.v0[:, 2]), np.abs(sweep.v1[:, 2]))
    near = height - sweep.level <= _SMALL + 50 * rounding
    ends = sweep.starts[near], sweep.ends[near]
    points = np.linspace(*ends, _SAMPLES, endpoint=False).reshape(-1, 4)
    vanishes = singular_everywhere(points, coefficients, angle_rounding=rounding)
    return np.asarray(points[vanishes])


class _Sweep(NamedTuple):
    """Pieces of a gait: their ends, v there, and how far (Rφ, Rθ) and R can be from the chords in between."""

    starts: FloatArray
    ends: FloatArray
    v0: FloatArray
    v1: FloatArray
    across: FloatArray
    level: FloatArray

    def only(self, where: npt.NDArray[np.bool_]) -> _Sweep:
        """Return some of the pieces."""
        return _Sweep(*(part[where] for part in self))

    def cut(self, where: npt.NDArray[np.bool_], coefficients: Coefficients) -> _Sweep:
        """Cut some of the pieces in four."""
        starts, ends = self.starts[where], self.ends[where]
        nodes = np.array([starts + k / 4 * (ends - starts) for k in range(4)] + [ends])
        v = attitude_sensitivities(nodes, coefficients)
        firsts, lasts = (
            [one[part].reshape(-1, one.shape[2]) for one in (nodes, v)]
            for part in (slice(4), slice(1, 5))
        )
        pieces = _swept(firsts[0], lasts[0], firsts[1], lasts[1], coefficients)
        return _Sweep(
            *(
                np.concatenate(pair)
                for pair in zip(self.only(~where), pieces, strict=True)
            )
        )

    def may_leave(self, sign: float, normals: FloatArray) -> npt.NDArray[np.bool_]:
        """Return whether sign·v may leave a cone along each piece, by its normals above the horizon, the columns.

        A product with a normal is f0 and f1 at the ends and, of a second derivative of no more than b, nowhere negative
        if √f0 + √f1 ≥ √(b/2): a parabola through both then touches zero at most.
        """
        bends = np.column_stack([self.across, self.level]) @ [
            4 * np.hypot(*normals[:2]),
            4 * normals[2],
        ]
        with np.errstate(
            invalid="ignore"
        ):  # an end that is outside by rounding gives NaN
            roots = np.sqrt(sign * self.v0 @ normals) + np.sqrt(
                sign * self.v1 @ normals
            )
            return np.asarray(~(roots >= np.sqrt(bends)).all(axis=1))

    def safe_rays(self, sign: float) -> FloatArray:
        """Return vectors whose cone holds sign·v all along each piece, for verticals above the horizon, (m, 8, 3).

        v is within a disc of radius `across` and a height of `level` about its chord. A square encloses the disc, and
        the lower height is the stricter one.
        """
        square = math.sqrt(2.0) * np.array(
            [[1.0, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]]
        )
        offsets = (
            self.across[:, None, None] * square
            - (self.level[:, None] * _UP)[:, None, :]
        )
        return np.concatenate(
            [sign * v[:, None, :] + offsets for v in (self.v0, self.v1)], axis=1
        )


def _swept(
    starts: FloatArray,
    ends: FloatArray,
    v0: FloatArray,
    v1: FloatArray,
    coefficients: Coefficients,
) -> _Sweep:
    return _Sweep(
        starts, ends, v0, v1, *sensitivity_deviations(starts, ends, coefficients)
    )


def _counted(counts: FloatArray) -> tuple[IntArray, IntArray, IntArray]:
    """Return, for groups of these sizes, the group of each member, its number from 0, and the size of its group."""
    each = counts.astype(int)
    which = np.repeat(np.arange(len(each)), each)
    return (
        which,
        np.arange(len(which)) - np.repeat(np.cumsum(each) - each, each),
        each[which],
    )


def _narrowed(
    sweep: _Sweep,
    coefficients: Coefficients,
    sign: float,
    inside: FloatArray,
    tolerance: float,
) -> tuple[shapely.Polygon, float] | None:
    """Return the polygon of verticals with sign·v > 0 all along, and its error; None if none is proven.

    The polygon is empty where R changes its sign: then level is not among these verticals.

    Pieces inside the cone of the samples are dropped; the others are cut finer.
    """
    pieces = len(sweep.starts)
    most = max(_MOST_PIECES, 2 * pieces)
    core = np.zeros((0, 3))
    while True:
        # Where a piece ends, the next begins.
        samples = np.concatenate([core, sign * sweep.v0])
        if (sign * sweep.v0[:, 2] < 0).any():
            return shapely.Polygon(), 0.0  # R changes its sign between first samples
        if (samples @ inside <= 0).any():
            return None
        # Some safe ray may have no positive product with `inside`.
        chord = np.minimum(sign * sweep.v0 @ inside, sign * sweep.v1 @ inside)
        beside = math.sqrt(2.0) * math.hypot(*inside[:2]) * sweep.across
        doubtful = chord <= beside + inside[2] * sweep.level
        if doubtful.any():
            if pieces + 3 * doubtful.sum() > most:
                return None
        else:
            core = _extreme_rays(samples, inside)
            sweep = sweep.only(_may_leave_cone(sweep, sign, core))
            rays = sweep.safe_rays(sign).reshape(-1, 3)
            extreme = _extreme_rays(np.concatenate([core, rays]), inside)
            polygon = _polygon_of(extreme)
            gap = max(_polygon_of(core).area - polygon.area, 0.0) / DIAGRAM_AREA
            chords = 0.0
            if len(extreme) > 1:
                chords = _SAG * float(polygon.length) / DIAGRAM_AREA
            # Finer pieces gain at most what the straight sides lose.
            is_last = gap <= 2 * _SAG or pieces + 3 * len(sweep.starts) > most
            if is_last or gap + chords <= tolerance:
                return polygon, gap + chords
            doubtful = np.ones(len(sweep.starts), dtype=bool)
        pieces += 3 * int(doubtful.sum())
        sweep = sweep.cut(doubtful, coefficients)


def _may_leave_cone(
    sweep: _Sweep, sign: float, outer: FloatArray
) -> npt.NDArray[np.bool_]:
    """Return whether sign·v may leave the cone of some extreme rays along each piece."""
    # Upright all along, v adds nothing to the horizon, as on red.
    leans = sweep.v0[:, :2].any(axis=1) | sweep.v1[:, :2].any(axis=1)
    out = (sweep.across > 0) | ((sweep.level > 0) & leans)
    if len(outer) < 3:
        return np.asarray(out)
    some = outer[:: -(-len(outer) // _SIDES)]  # by the normals of their sides
    normals = np.cross(some, np.roll(some, -1, axis=0)).T
    return np.asarray(out & sweep.may_leave(sign, normals))


def _inside(rays: FloatArray) -> FloatArray | None:
    """Return a vertical above the horizon with a positive product with every ray, upright or the deepest one."""
    rows = np.vstack([_UP, rays])
    rows /= np.linalg.norm(rows, axis=1, keepdims=True)
    if rows[:, 2].min() > _DEEP:
        return _UP
    from scipy.optimize import linprog  # which most gaits need not load

    # A few rays decide: start with some, and add those that the best vertical so far violates most.
    chosen = np.unique(
        np.linspace(0, len(rows) - 1, min(len(rows), _FEW_RAYS)).astype(int)
    )
    while True:
        found = linprog(
            [0.0, 0.0, 0.0, -1.0],
            A_ub=np.column_stack([-rows[chosen], np.ones(len(chosen))]),
            b_ub=np.zeros(len(chosen)),
            bounds=[(-1.0, 1.0)] * 4,
        )
        best = np.asarray(found.x)
        if best[3] <= SAME_ANGLE:
            return None
        depth = rows @ best[:3] - best[3]
        worst = np.argsort(depth, kind="stable")[:_FEW_RAYS]
        worst = np.setdiff1d(worst[depth[worst] < -SAME_ANGLE], chosen)
        if not worst.size:
            return np.asarray(best[:3] / np.linalg.norm(best[:3]))
        chosen = np.concatenate([chosen, worst])


def _projected(rays: FloatArray, inside: FloatArray) -> FloatArray:
    """Return the central projection of rays onto the plane at distance one along `inside`, shape (..., 2)."""
    first = np.cross(
        inside, [1.0, 0.0, 0.0] if abs(inside[0]) < 0.9 else [0.0, 1.0, 0.0]
    )
    first /= np.linalg.norm(first)
    return np.asarray(
        rays
        @ np.column_stack([first, np.cross(inside, first)])
        / (rays @ inside)[..., None]
    )


def _extreme_rays(rays: FloatArray, inside: FloatArray) -> FloatArray:
    """Return the extreme rays of a cone and the horizon's, unit vectors, counter-clockwise about `inside`.

    Rays within 1e-9 rad of each other are one. Qhull keeps its hulls convex where points are within rounding of each
    other, but may lose an end of points that are on a line but for rounding; only both ends are extreme then.
    """
    from scipy.spatial import ConvexHull

    everything = np.vstack([_UP, rays])
    everything /= np.linalg.norm(everything, axis=1, keepdims=True)
    points = _projected(everything, inside)
    offset = points - points[0]
    x, y = offset[np.argmax(np.sum(offset**2, axis=1))]
    along, beside = offset @ [x, y], offset @ [-y, x]
    thin = np.abs(beside).max() <= _THIN * along.max()
    if thin:
        index = np.unique([np.argmin(along), np.argmax(along)])
    else:
        index = np.asarray(ConvexHull(points).vertices)
    index = np.roll(index, -int(np.argmax(index == 0)))  # the horizon counts first
    kept = [index[0]]
    for k in index[1:]:
        if (
            np.abs(everything[k] - everything[[kept[-1], index[0]]]).max(axis=1).min()
            > SAME_ANGLE
        ):
            kept.append(k)
    return everything[kept]


def _polygon_of(rays: FloatArray) -> shapely.Polygon:
    """Return the verticals that have a positive product with all extreme rays, given counter-clockwise."""
    polygon = shapely.Polygon(_ring_of(rays))
    if not polygon.is_valid:
        parts = polygons_of(shapely.make_valid(polygon)).geoms
        polygon = max(
            parts, key=lambda part: float(part.area), default=shapely.Polygon()
        )
    # The first corner is then the same wherever the sides were cut.
    return cast("shapely.Polygon", polygon.normalize())


def _ring_of(rays: FloatArray, sag: float = _SAG) -> FloatArray:
    """Return the border of the polygon of :func:`_polygon_of` as points (roll, pitch), shape (k, 2)."""
    if len(rays) == 1:
        return HALF_PI * np.array([[-1.0, -1], [1, -1], [1, 1], [-1, 1]])
    horizon = np.flatnonzero((rays == _UP).all(axis=1))
    rays = np.roll(rays, -1 - int(horizon[0]), axis=0) if horizon.size else rays
    corners = np.cross(rays, np.roll(rays, -1, axis=0))
    corners /= np.linalg.norm(corners, axis=1, keepdims=True)
    starts = np.roll(corners, 1, axis=0)
    along = np.cross(rays, starts)
    turn = np.arctan2(
        np.sum(corners * along, axis=1), np.sum(corners * starts, axis=1)
    ) % (2 * math.pi)
    if len(rays) > 2:
        turn = np.where(turn > 1.5 * math.pi, 0.0, turn)
    else:
        turn = np.full(2, math.pi)
    curved = len(rays) - horizon.size
    points = _arcs(starts[:curved], along[:curved], turn[:curved], sag)
    border = _border(starts[-1], float(turn[-1])) if horizon.size else points[:0]
    # Its end is the first point again, except for rounding, which would make a ring cross itself.
    return np.concatenate(
        [points, border[np.abs(border - points[0]).max(axis=1) > SAME_ANGLE]]
    )


def _attitudes_of(verticals: FloatArray, middle: FloatArray) -> FloatArray:
    """Return (roll, pitch) of verticals, shape (k, 2) [rad]; at pitch ±π/2 roll is that of `middle`, which is near."""
    beside = np.where(
        (np.hypot(verticals[:, 1], verticals[:, 2]) < 1e-12)[:, None], middle, verticals
    )
    roll = np.arctan2(beside[:, 1], np.maximum(beside[:, 2], 0.0))
    return np.column_stack([roll, attitude_of(verticals)[:, 1]])


def _arcs(
    starts: FloatArray, along: FloatArray, turn: FloatArray, sag: float
) -> FloatArray:
    """Return points of sides that are arcs of great circles; straight lines between them are within `sag` [rad].

    The end of a side is left out, since the next begins there, but for pitch ±π/2, where the next has another roll.
    """
    middle = starts * np.cos(turn / 2)[:, None] + along * np.sin(turn / 2)[:, None]

    def at(side: IntArray, angle: FloatArray) -> FloatArray:
        vertical = (
            starts[side] * np.cos(angle)[:, None] + along[side] * np.sin(angle)[:, None]
        )
        return _attitudes_of(vertical, middle[side])

    side, number, count = _counted(np.where(turn < 1e-3, 2, 3 + np.ceil(turn / 0.02)))
    angle = number / (count - 1) * turn[side]
    points = at(side, angle)
    for _ in range(_MOST_HALVINGS):
        inner = side[1:] == side[:-1]
        between = (angle[1:] + angle[:-1]) / 2
        new = at(side[1:], between)
        chord = points[1:] - points[:-1]
        size = np.maximum(np.linalg.norm(chord, axis=1), 1e-300)
        beside = new - points[:-1]
        off = np.abs(chord[:, 0] * beside[:, 1] - chord[:, 1] * beside[:, 0]) / size
        wide = np.flatnonzero(inner & (off > sag))
        if not wide.size:
            break
        angle = np.insert(angle, wide + 1, between[wide])
        side = np.insert(side, wide + 1, side[wide])
        points = np.insert(points, wide + 1, new[wide], axis=0)
    return np.asarray(
        points[
            np.append(side[1:] == side[:-1], False)
            | (np.abs(points[:, 1]) > HALF_PI - 1e-12)
        ]
    )


def _border(start: FloatArray, turn: float) -> FloatArray:
    """Return the corners of a side along the border of the diagram, where the vertical is horizontal."""
    first = math.atan2(start[1], start[0])
    poles = np.pi * np.arange(
        math.ceil(first / math.pi), math.floor((first + turn) / math.pi) + 1
    )
    angles = np.array([first, *poles, first + turn])[:, None]
    roll = np.copysign(
        HALF_PI, np.sin(np.clip(angles + np.array([-1e-9, 1e-9]), first, first + turn))
    )
    return np.stack(
        [roll, np.broadcast_to(-np.arcsin(np.cos(angles)), roll.shape)], axis=-1
    ).reshape(-1, 2)
