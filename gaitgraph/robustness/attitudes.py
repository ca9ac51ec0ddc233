r"""Singular and acceptable attitudes in the roll–pitch diagram.

An attitude with |φ|, |θ| < π/2 corresponds to one upward vertical n in body axes with n_z > 0. A configuration is
singular where v·n = 0, v = (−Rθ, Rφ, R): on half a great circle, one branch from border to border of the diagram,

    tan θ = −(Rφ·sin φ + R·cos φ)/Rθ.

If level flight is nowhere singular, the attitudes at which a gait is not singular around (0, 0) are those with
v(t)·n > 0 at all times, R > 0. These n form a convex cone. So at each roll the pitch is in one interval, between the
highest and the lowest of the curves above, and what is between two acceptable attitudes on a great circle is acceptable.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

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
    attitude_of,
    attitude_sensitivities,
    noise_of,
)
from gaitgraph.invertibility.tilt_margins import (
    EVERYWHERE,
    least_tilt_margin,
    sensitivity_deviations,
    singular_everywhere,
)
from gaitgraph.records import Record
from gaitgraph.vehicle import PAPER, VehicleLike

DIAGRAM_AREA = math.pi**2  # rad², of the roll–pitch diagram (−π/2, π/2)²
_MOST_PIECES = 100_000
_FIRST_ROLLS = 65
_MOST_HALVINGS = 30
_SAG = 1e-6  # rad, largest distance of straight sides of a polygon from the curves
_LOW = 1e-3  # an R below this share of ‖v‖ is too small to divide by for a hull

# Upright rays do not matter. A little square about them keeps points on a line from a hull without an area.
_SQUARE = 1e-8 * np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])

_NOT_LEVEL = "R changes its sign or vanishes: level flight itself is singular somewhere in the period"
_UNDECIDED = "R is too near to zero to be decided"


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
        highest = np.cross(self.normal, along) / math.hypot(across, z)
        turn = np.linspace(0.0, math.pi, count)[:, None]
        verticals = along * np.cos(turn) + highest * np.sin(turn)
        # At pitch ±π/2 any roll is that of the vertical: the one of the curve beside it is drawn.
        at_pole = np.hypot(verticals[:, 1], verticals[:, 2]) < 1e-12
        beside = np.where(at_pole[:, None], highest, verticals)
        roll = np.arctan2(beside[:, 1], np.maximum(beside[:, 2], 0.0))
        return np.column_stack([roll, attitude_of(verticals)[:, 1]])


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
    closed = np.concatenate([points, points[:1]])
    margin = least_tilt_margin(closed, coefficients, angle_rounding=rounding)
    polygon = shapely.Polygon()
    error = 0.0
    reason = ""
    if not margin.exists:
        reason = EVERYWHERE
    elif margin.upper == 0:
        reason = _NOT_LEVEL
    else:
        polygon, error = _proven_polygon(closed, coefficients, tolerance)
        if polygon.is_empty:
            reason = _UNDECIDED
    return AcceptableAttitudes(
        polygon=polygon, error=error, tolerance=float(tolerance), reason=reason
    )


def _proven_polygon(
    closed: FloatArray, coefficients: Coefficients, tolerance: float
) -> tuple[shapely.Polygon, float]:
    """Return a polygon in which all is acceptable, and a bound of what it lacks; empty if R cannot be told from zero.

    Samples of v alone give a polygon with all that is acceptable. Pieces between samples are cut until both agree.
    """
    starts = closed[:-1]
    ends = closed[1:]
    sign = math.copysign(1.0, attitude_sensitivities(starts[0], coefficients)[2])
    samples = np.zeros((0, 3))
    polygon = shapely.Polygon()
    error = 1.0
    while len(starts) <= _MOST_PIECES:
        first = sign * attitude_sensitivities(starts, coefficients)
        last = sign * attitude_sensitivities(ends, coefficients)
        samples = _extreme(np.concatenate([samples, first, last]))
        between = _between(first, last, starts, ends, coefficients)
        is_low = (between[:, :, 2] <= 0).any(axis=1)
        counts = np.array(is_low)
        counts[~is_low] = _are_outside(samples, between[~is_low])
        if not is_low.any():
            rays = _extreme(np.concatenate([samples, *between[counts]]))
            if not len(rays):
                return shapely.box(-HALF_PI, -HALF_PI, HALF_PI, HALF_PI), 0.0
            polygon = _polygon_of(rays)
            lacks = max(_polygon_of(samples).area - polygon.area, 0.0)
            by_sides = _SAG * polygon.length
            error = float(lacks + by_sides) / DIAGRAM_AREA
            if error <= tolerance or lacks <= by_sides / 10:
                break
        nodes = np.linspace(starts[counts], ends[counts], 5)
        starts = np.concatenate(nodes[:-1])
        ends = np.concatenate(nodes[1:])
    return polygon, error


def _between(
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


def _extreme(rays: FloatArray) -> FloatArray:
    """Return the rays, all above the horizon, that matter for the polygon of :func:`_polygon_of`."""
    from scipy.spatial import ConvexHull

    is_high = _is_high(rays)
    high = rays[is_high]
    vertices = ConvexHull(np.concatenate([_projected(high), _SQUARE])).vertices
    return np.concatenate([rays[~is_high], high[vertices[vertices < len(high)]]])


def _are_outside(rays: FloatArray, pieces: FloatArray) -> npt.NDArray[np.bool_]:
    """Return whether some of the four rays of each piece are outside the cone of rays."""
    from scipy.spatial import Delaunay

    high = rays[_is_high(rays)]
    cone = Delaunay(np.concatenate([_projected(high), _SQUARE]))
    return np.asarray((cone.find_simplex(_projected(pieces)) < 0).any(axis=1))


def _is_high(rays: FloatArray) -> npt.NDArray[np.bool_]:
    """Return which rays are high enough to be divided by their height."""
    return np.asarray(rays[:, 2] > _LOW * np.linalg.norm(rays, axis=1))


def _projected(rays: FloatArray) -> FloatArray:
    """Return where rays meet the plane at the height one, shape (..., 2)."""
    return np.asarray(rays[..., :2] / rays[..., 2:])


def _polygon_of(rays: FloatArray) -> shapely.Polygon:
    """Return the attitudes whose verticals have a positive product with all rays, which are above the horizon."""
    rolls = np.linspace(-HALF_PI, HALF_PI, _FIRST_ROLLS)
    pitches = _pitches(rays, rolls)
    for _ in range(_MOST_HALVINGS):
        middles = (rolls[1:] + rolls[:-1]) / 2
        new = _pitches(rays, middles)
        step = np.diff(rolls)
        rise = np.diff(pitches)
        off = np.abs(new - (pitches[:, 1:] + pitches[:, :-1]) / 2)
        bent = (off * step > _SAG * np.hypot(step, rise)).any(axis=0)
        # Without an interval of pitch both are NaN: the border is where one ends.
        is_open = ~np.isnan(pitches[0])
        is_border = (is_open[1:] != is_open[:-1]) & (step > _SAG)
        cut = np.flatnonzero(bent | is_border)
        if not cut.size:
            break
        rolls = np.insert(rolls, cut + 1, middles[cut])
        pitches = np.insert(pitches, cut + 1, new[:, cut], axis=1)
    is_open = ~np.isnan(pitches[0])
    if is_open.sum() < 2:
        return shapely.Polygon()
    rolls = rolls[is_open]
    lower, upper = pitches[:, is_open]
    outline = np.column_stack(
        [np.append(rolls, rolls[::-1]), np.append(lower, upper[::-1])]
    )
    return shapely.Polygon(outline)


def _pitches(rays: FloatArray, rolls: FloatArray) -> FloatArray:
    """Return the ends of the interval of pitch at some rolls, shape (2, k) [rad], NaN where it is empty.

    v·n/cos θ = −v_x·tan θ + v_y·sin φ + v_z·cos φ.
    """
    x, y, z = rays.T + 0.0  # no negative zeros
    height = np.outer(y, np.sin(rolls)) + np.outer(z, np.cos(rolls))
    with np.errstate(divide="ignore", invalid="ignore"):
        slopes = height / x[:, None]
    lower = slopes[x < 0].max(axis=0, initial=-np.inf)
    upper = slopes[x >= 0].min(axis=0, initial=np.inf)
    pitches = np.arctan([lower, upper])
    pitches[:, ~(lower < upper)] = np.nan
    return pitches
