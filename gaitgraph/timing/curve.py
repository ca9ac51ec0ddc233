"""Smooth closed curves of tilt angles on one sheet: piecewise polynomials in (α1, α2), lifted exactly.

Both sheets are planes, so that a polynomial in (α1, α2) is one in all four angles, and lies on its sheet between
samples too. What is said about a whole curve rests on chords: on an interval of width h a curve is within
h²/8·max|q''| of the chord, and max|q''| is at most that of its Bernstein coefficients (convex hull property).

A gait with rounded corners is such a curve, within a stated distance of the polyline. A corner is replaced by a quintic
Bézier blend whose first three control points lie evenly on the segment that arrives and whose last three lie evenly on
the segment that leaves. Its curvature vanishes at both ends, so that it joins the straight segments with two continuous
derivatives, and it lies in the triangle of the corner. A gait that turns back on itself stays on its line: there the
parameter slows down to zero at the tip.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import angle_from_text, number_of
from gaitgraph.errors import InputError, shown
from gaitgraph.gait.gait import Gait
from gaitgraph.invertibility.matrices import DEFAULT_FLOOR, Coefficients, coefficients_of
from gaitgraph.invertibility.segment_bounds import (
    least_level_determinant,
    least_singular_value_of_all,
    thrust_shares_along,
    thrusts_push_up,
)
from gaitgraph.surface.sheets import DEFAULT_CROSSING_TOLERANCE, DEFAULT_TOLERANCE, sheet_angles
from gaitgraph.timing.timing_laws import bernstein_from_power, derivative_of, values_of
from gaitgraph.validation.validating import check_gait, checked_limits
from gaitgraph.vehicle import PAPER, Vehicle

if TYPE_CHECKING:
    from gaitgraph.validation.report import Check, Report

FloatArray = npt.NDArray[np.float64]

DEFAULT_CHORD = 1e-6
"""How far a curve may be from the chords that its checks look along [rad in the (α1, α2) plane]."""

SMALLEST = 1e-5
"""The least rounding, and the least distance between rounded corners [rad]: less is beyond what floats carry."""

_MOST_POINTS = 4_000_000
_SEAM = 1e-8
_SQRT2 = math.sqrt(2.0)

_STRAIGHT = 1e-9
# Distance between control points of a blend on a segment, as a share of the length that it takes.
_SPACING = 0.4
# Of the parameter that a turn back takes on each side, the share that it moves along the segment.
_TIP = 5.0 / 8.0


@dataclass(frozen=True, slots=True, kw_only=True, init=False)
class Curve:
    """A closed curve of tilt angles on one sheet, twice continuously differentiable in its parameter.

    Parameters
    ----------
    breaks
        Increasing parameter values from 0 to the span, shape (k + 1,); any parameter, not only arc length.
    pieces
        Coefficients of (α1, α2) on each piece in powers of s − breaks[j], highest power first, shape
        (degree + 1, k, 2), as those of ``scipy.interpolate.PPoly`` [rad].
    color
        "red" or "blue".
    vehicle, coefficients, crossing_tolerance
        What the curve is for, as for :class:`gaitgraph.gait.gait.Gait`.

    Raises
    ------
    InputError
        If the arrays do not fit, or if the curve or its first or second derivative jumps at a break or at the seam.

    Notes
    -----
    Not guaranteed: that a curve is flyable; :meth:`check` decides that. Nor that it keeps its speed: where the first
    derivative vanishes it may turn back on itself.

    Examples
    --------
    >>> curve = curve_through([(0.4, -1.2), (0.4, -0.4), (1.2, -0.4), (1.2, -1.2)])
    >>> curve.at(0.0).round(6).tolist(), bool(np.allclose(curve.at(curve.span), curve.at(0.0)))
    ([0.4, -1.2, 0.4, -1.2], True)
    >>> curve.check().flyable
    True
    """

    breaks: FloatArray
    pieces: FloatArray
    color: str
    vehicle: Vehicle
    coefficients: Coefficients
    crossing_tolerance: float

    def __init__(
        self,
        *,
        breaks: npt.ArrayLike,
        pieces: npt.ArrayLike,
        color: str = "red",
        vehicle: Vehicle = PAPER,
        coefficients: Coefficients | None = None,
        crossing_tolerance: float = DEFAULT_CROSSING_TOLERANCE,
    ) -> None:
        s, polynomials = _array("breaks", breaks), _array("pieces", pieces)
        if s.ndim != 1 or s.size < 2 or s[0] != 0 or not (np.diff(s) > 0).all():
            raise InputError(f"breaks must be at least two increasing numbers from 0 on, got {shown(breaks)}")
        k = s.size - 1
        if polynomials.ndim != 3 or polynomials.shape[1:] != (k, 2) or not len(polynomials):
            raise InputError(f"pieces must have the shape (degree + 1, {k}, 2), got {polynomials.shape}")
        if color not in ("red", "blue"):
            raise InputError(f"color must be 'red' or 'blue', got {shown(color)}")
        for order, name in enumerate(("position", "first derivative", "second derivative")):
            derivative, width = derivative_of(polynomials, order), np.diff(s)
            start, end = derivative[-1], values_of(derivative, width)
            # What floats carry of a derivative depends on the terms that it is a sum of.
            size = float(values_of(np.abs(derivative), width).max())
            jump = np.abs(np.roll(end, 1, axis=0) - start).max(axis=1)
            bad = jump > _SEAM * max(size, 1e-300)
            if bad.any():
                at = int(np.argmax(bad))
                raise InputError(
                    "pieces must be a closed curve, continuous to the second derivative, but the "
                    f"{name} jumps by {jump[at]:.2g} at {f'break {at}' if at else 'the seam'}"
                )
        s.flags.writeable = polynomials.flags.writeable = False
        numbers = coefficients_of() if coefficients is None else coefficients
        values = (s, polynomials, color, vehicle, numbers, crossing_tolerance)
        for field, value in zip(self.__slots__, values, strict=True):
            object.__setattr__(self, field, value)

    def __repr__(self) -> str:
        pieces = f"{len(self.breaks) - 1} pieces, span {self.span:.6g}"
        return f"<Curve: {self.color}, {pieces}, vehicle {self.vehicle.name!r}>"

    @property
    def span(self) -> float:
        """The parameter's range: the curve is periodic with it."""
        return float(self.breaks[-1])

    @property
    def length(self) -> float:
        """Length of the loop in the (α1, α2) plane [rad]; √2 times as long in all four angles."""
        nodes, weights = np.polynomial.legendre.leggauss(20)
        # Where the speed vanishes it has a kink; both angles turn round there.
        s = np.append(self.turning_points(), self.span)
        width = np.diff(s)
        velocity = self.at(s[:-1, None] + width[:, None] * (nodes + 1) / 2, 1)[..., :2]
        return float((np.linalg.norm(velocity, axis=-1) @ weights * width / 2).sum())

    def at(self, s: npt.ArrayLike, derivative: int = 0) -> FloatArray:
        """Return the tilt angles at any parameter values, or a derivative of them by s; the curve is periodic.

        Parameters of shape (...) give angles of shape (..., 4) [rad]. From the third derivative on, that at a break is
        of the piece that starts there.
        """
        if isinstance(derivative, bool) or not isinstance(derivative, (int, np.integer)) or derivative < 0:
            raise InputError(f"derivative must be a whole number ≥ 0, got {shown(derivative)}")
        phase = np.asarray(np.mod(np.asarray(s, dtype=float), self.span))
        piece = np.clip(np.searchsorted(self.breaks, phase, side="right") - 1, 0, len(self.breaks) - 2)
        coefficients = derivative_of(self.pieces, int(derivative))
        plane = values_of(coefficients[:, piece], phase - self.breaks[piece])
        return lifted(plane, self.color, self.pieces[-1, 0], self.coefficients, derivative=int(derivative))

    def turning_points(self) -> FloatArray:
        """Return the breaks and the parameter values at which α1 or α2 may turn round, increasing, shape (n,)."""
        from scipy.interpolate import PPoly

        at = [self.breaks[:-1]]
        slope = derivative_of(self.pieces, 1)
        for angle in range(2):
            found = PPoly(slope[:, :, angle], self.breaks).roots(discontinuity=False, extrapolate=False)
            at.append(found[np.isfinite(found) & (found >= 0) & (found < self.span)])
        return np.asarray(np.unique(np.concatenate(at)))

    def extremes(self) -> FloatArray:
        """Return the least and the largest value of each tilt angle over the whole curve, shape (2, 4) [rad]."""
        alpha = self.at(self.turning_points())
        return np.stack([alpha.min(axis=0), alpha.max(axis=0)])

    def chord_parameters(self, tolerance: float = DEFAULT_CHORD) -> FloatArray:
        """Return parameter values, from 0 to below the span, between which chords are within a tolerance [rad]."""
        if not 0 < number_of(tolerance) < math.inf:
            raise InputError(f"tolerance must be a positive finite number (rad), got {shown(tolerance)}")
        width = np.diff(self.breaks)
        bend = np.linalg.norm(bernstein_from_power(derivative_of(self.pieces, 2), width), axis=-1).max(axis=0)
        count = np.maximum(np.ceil(width * np.sqrt(bend / (8.0 * tolerance)) * (1 + 1e-9)), 1.0)
        if count.sum() > _MOST_POINTS:
            raise InputError(
                f"tolerance must be so large that {_MOST_POINTS} chords do, got {shown(tolerance)}: {count.sum():.3g}"
            )
        number = count.astype(np.int64)
        step = np.arange(int(number.sum())) - np.repeat(np.cumsum(number) - number, number)
        return np.asarray(np.repeat(self.breaks[:-1], number) + step * np.repeat(width / number, number))

    def polyline(self, tolerance: float = 1e-4) -> Gait:
        """Return a gait with corners on the curve, which is certainly within a tolerance of its segments [rad]."""
        alpha = self.at(self.chord_parameters(tolerance))
        return Gait(
            alpha=alpha,
            colors=(self.color,) * len(alpha),
            vehicle=self.vehicle,
            coefficients=self.coefficients,
            crossing_tolerance=self.crossing_tolerance,
        )

    def check(
        self, *, tolerance: float = DEFAULT_TOLERANCE, floor: float = DEFAULT_FLOOR, chord: float = DEFAULT_CHORD
    ) -> Report:
        """Return every check of valid and flyable for the curve itself, between samples too.

        Parameters
        ----------
        tolerance, floor
            As for :func:`gaitgraph.validation.validating.check_gait`.
        chord
            How far the chords that are looked along may be from the curve [rad].

        Notes
        -----
        The chords are judged as a gait. What the curve may differ from them by is then taken off: the least
        singular value changes by at most √(2+κ²)·√2·chord, R by its largest slope, and so on. A curve that touches a
        limit may therefore be refused where a finer chord would let it pass; never the other way.
        """
        checked_limits(tolerance, floor, None)
        gait, vehicle = self.polyline(chord), self.vehicle
        report = check_gait(gait, tolerance=tolerance, floor=floor)
        checks = tuple(self._beside_chords(check, gait, floor, chord) for check in report.checks)
        exact = coefficients_of(vehicle, "exact")
        if report.reachable_from_hover and _least_level(gait, exact, 1.0, chord) <= 0:
            undecided = "too near R = 0 to be decided beside chords of this size"
            report = replace(report, reachable_from_hover=None, reachability=undecided)
        return replace(report, checks=checks)

    def _beside_chords(self, check: Check, gait: Gait, floor: float, chord: float) -> Check:
        """Return a check of the chords as a check of the curve, with what the curve may differ by taken off."""
        vehicle, limit = self.vehicle, check.limit or 0.0
        if check.name == "tilt_range":
            value = float(np.abs(self.extremes()).max())
            ok = value <= limit + 1e-9
            message = f"largest tilt {math.degrees(value):.1f}°, limit {math.degrees(limit):.1f}°"
            return replace(check, ok=ok, value=value, message=message + ("" if ok else ": stay nearer to 0"))
        if not check.ok:
            return check
        if check.name == "least_singular_value":
            lower = float(least_singular_value_of_all(gait.alpha, gait.ends, vehicle, tolerance=1e-6).lower.min())
            lower -= math.sqrt(2.0 + vehicle.drag_ratio**2) * _SQRT2 * chord
            ok = lower >= floor
            message = f"least singular value at least {lower:.4f} along the whole curve, floor {floor:g}"
            if not ok:
                message = (
                    f"least singular value may fall to {max(lower, 0.0):.3g} along the curve, floor {floor:g}: keep "
                    "away from it, or try a smaller chord"
                )
            return replace(check, ok=ok, value=lower, message=message)
        if check.name == "R_sign" and check.decided:
            sign = 1.0 if (check.value or 0.0) > 0 else -1.0
            lower = _least_level(gait, self.coefficients, sign, chord)
            decided = lower > limit
            relation = f"R {'≥' if sign > 0 else '≤'} {sign * lower:.3g} along the whole curve"
            message = f"{relation} ({self.coefficients.kind} coefficients)"
            if not decided:
                message = (
                    f"sign of R undecided: along the curve |R| may fall to {max(lower, 0.0):.2g}: try a smaller chord"
                )
            return replace(check, value=sign * lower, message=message, decided=decided)
        if check.name not in ("hover_thrust", "thrust_limit"):
            return check
        shares = self._thrust_shares(gait, chord)
        if check.name == "hover_thrust":
            if shares is None or shares[0] <= 0:
                message = "a rotor may have to idle to hover beside the chords: keep away from β1 = 0 and β2 = 0"
                return replace(check, ok=False, value=None, message=message)
            low, high = shares
            message = f"hover thrusts {low:.3f} to {high:.3f} of m·g per rotor along the whole curve, all positive"
            return replace(check, value=low, message=message)
        if shares is None:
            return check
        mass, gravity = vehicle.require("mass", "gravity", purpose="the check of the largest thrust")
        newtons = shares[1] * mass * gravity
        message = f"largest hover thrust {newtons:.3g} N, limit {limit:.3g} N"
        return replace(check, ok=newtons <= limit, value=newtons, message=message)

    def _thrust_shares(self, gait: Gait, chord: float) -> tuple[float, float] | None:
        """Return bounds of the least and the largest thrust share on the curve, None where a rotor may idle.

        On red each factor of the zero-moment inputs depends on one coordinate, so the diagonal of the box around
        the curve decides for all of it. There T1/(m·g) = |sin β2|/(2D) with D = |sin β2| cos α1 + |sin β1| cos α2 =
        (κ cos³δ/2)·|R|/|cos β1 cos β2|, and D's slope is at most 2√2.
        """
        vehicle, extremes = self.vehicle, self.extremes()
        if self.color != "red" or not thrusts_push_up(extremes[:1], extremes[1:], vehicle).all():
            return None
        kappa, sign = vehicle.drag_ratio, 1.0 if gait.R[0] > 0 else -1.0
        level = _least_level(gait, coefficients_of(vehicle, "exact"), sign, chord)
        weight = level * kappa / (2.0 * (1.0 + kappa**2) ** 1.5)
        upward, least, largest = thrust_shares_along(gait.alpha, gait.ends, vehicle, tolerance=1e-6)
        steep = 2.0 * _SQRT2 * chord / weight if weight > 0 else math.inf
        if not upward.all() or steep >= 0.5:
            return None
        high = (-float(largest.lower.min()) + chord / (2.0 * weight)) / (1.0 - steep)
        return float(least.lower.min()) - chord / (2.0 * weight) - steep * high, high


def _least_level(gait: Gait, coefficients: Coefficients, sign: float, chord: float) -> float:
    """Return a lower bound of sign·R on a curve beside the chords that a gait consists of.

    R is bilinear in the features of both pairs, each of norm √2 at most, as their slopes are; four angles move, by
    2√2·chord in sum.
    """
    lower = least_level_determinant(gait.alpha, gait.ends, coefficients, sign=sign).lower.min()
    slope = 2.0 * float(np.linalg.norm(coefficients.bilinear_form, 2))
    return float(lower) - slope * 2.0 * _SQRT2 * chord


def curve_through(
    points: npt.ArrayLike,
    color: str = "red",
    *,
    vehicle: Vehicle = PAPER,
    coefficients: Coefficients | None = None,
    crossing_tolerance: float = DEFAULT_CROSSING_TOLERANCE,
) -> Curve:
    """Return the closed interpolating cubic spline through points of the (α1, α2) plane.

    Parameters
    ----------
    points
        Points in order, shape (n, 2), n ≥ 3; the curve returns from the last to the first [rad].
    color, vehicle, coefficients, crossing_tolerance
        As for :class:`Curve`.

    Notes
    -----
    The parameter is the length of the polygon through the points, which keeps cubics from overshooting between points
    that are unevenly apart. A spline may still swing out between its points: see :meth:`Curve.extremes`.
    """
    from scipy.interpolate import CubicSpline

    plane = _array("points", points)
    if plane.ndim != 2 or plane.shape[1] != 2 or len(plane) < 3:
        raise InputError(f"points must have the shape (n, 2) with n at least 3, got {plane.shape}")
    closed = np.vstack([plane, plane[:1]])
    size = np.linalg.norm(np.diff(closed, axis=0), axis=1)
    if not (size > 1e-12).all():
        raise InputError(
            f"points must differ from their neighbours, but point {int(np.argmin(size)) + 1} is repeated by the next"
        )
    breaks = np.concatenate([[0.0], np.cumsum(size)])
    return Curve(
        breaks=breaks,
        pieces=CubicSpline(breaks, closed, bc_type="periodic").c,
        color=color,
        vehicle=vehicle,
        coefficients=coefficients or coefficients_of(vehicle),
        crossing_tolerance=crossing_tolerance,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class RoundedCorner:
    """What was done at one corner; `corner` is its number in the merged gait, from 0."""

    corner: int
    turn: float  # by how much the direction turns there, from 0 to π [rad]
    reach: float  # how much of each segment the blend takes [rad]
    deviation: float  # distance from the corner to the curve [rad]; 0 where the gait turns back on its line
    shrunk: bool  # whether the tolerance would allow a larger blend than its segments do


@dataclass(frozen=True, slots=True, kw_only=True)
class Rounding:
    """A rounded gait: the curve, the polyline with straight runs merged, the tolerance [rad] and the corners."""

    curve: Curve
    gait: Gait
    tolerance: float
    corners: tuple[RoundedCorner, ...]

    @property
    def deviation(self) -> float:
        """Largest distance between curve and polyline, in either direction, in the (α1, α2) plane [rad]."""
        return max((corner.deviation for corner in self.corners), default=0.0)

    @property
    def merged(self) -> tuple[int, ...]:
        """Corners whose blends met their neighbours' and were shrunk to share a segment."""
        return tuple(corner.corner for corner in self.corners if corner.shrunk and corner.deviation > 0)

    def as_mapping(self) -> dict[str, Any]:
        """Return it as plain values, ready for JSON."""
        return {
            "tolerance": self.tolerance,
            "deviation": self.deviation,
            "shrunk": list(self.merged),
            "corners": [asdict(corner) for corner in self.corners],
        }

    def __repr__(self) -> str:
        return f"<Rounding: {self}>"

    def __str__(self) -> str:
        text = f"{len(self.corners)} corners rounded, at most {self.deviation:.4g} rad from the gait"
        return text + (f"; shrunk to share a leg: {', '.join(map(str, self.merged))}" if self.merged else "")


def rounded(gait: Gait, tolerance: float | str) -> Rounding:
    """Return a gait of one color with its corners rounded.

    Parameters
    ----------
    gait
        The closed polyline; straight runs are merged first, and corners nearer than :data:`SMALLEST` to the one before
        are taken for the same. Blends that would overlap are shrunk until they share the segment, and marked.
    tolerance
        Largest distance between the curve and the polyline, both ways, in the (α1, α2) plane; radians, or a text such
        as "2deg". In all four angles it is √2 times as far.

    Raises
    ------
    InputError
        If the gait is not of one color, or the tolerance below :data:`SMALLEST`.

    Notes
    -----
    Not guaranteed: that the curve is flyable wherever the polyline is; ask :meth:`Curve.check`.

    With segments along the unit vectors u and v, a blend that takes d of each, with control points 2d/5 apart, passes
    its corner at the distance (3/16)·d·‖v − u‖ = (3/8)·d·sin(turn/2), reached at its middle.

    Examples
    --------
    >>> from gaitgraph.gait.gait import lift
    >>> rounding = rounded(lift([(0.4, -1.2), (0.4, -0.4), (1.2, -0.4)], "red"), 0.02)
    >>> print(rounding)
    3 corners rounded, at most 0.02 rad from the gait
    """
    size = angle_from_text(tolerance, "tolerance")
    if not size >= SMALLEST:
        raise InputError(f"tolerance must be an angle of at least {SMALLEST:g} rad, got {shown(tolerance)}")
    if gait.color not in ("red", "blue"):
        raise InputError(
            f"gait must be on one sheet, red or blue, got the color {shown(gait.color)}; retarget moves it there"
        )
    merged = gait.merged()
    plane = np.array(merged.alpha[:, :2])
    keep = [0]
    for k in range(1, len(plane)):
        if np.linalg.norm(plane[k] - plane[keep[-1]]) > SMALLEST:
            keep.append(k)
    while len(keep) > 1 and np.linalg.norm(plane[keep[-1]] - plane[0]) <= SMALLEST:
        keep.pop()
    if len(keep) < len(plane):
        colors = tuple(merged.colors[k] for k in keep)
        merged = replace(merged, alpha=merged.alpha[keep], colors=colors).merged()
        plane = np.array(merged.alpha[:, :2])
    step = np.roll(plane, -1, axis=0) - plane
    length = np.linalg.norm(step, axis=1)
    corners: tuple[RoundedCorner, ...] = ()
    if not length.sum() > 0:
        breaks, pieces = np.array([0.0, 1.0]), plane[None, :1]
    else:
        ahead = step / length[:, None]
        before = np.roll(ahead, 1, axis=0)
        sine, cosine = before[:, 0] * ahead[:, 1] - before[:, 1] * ahead[:, 0], (before * ahead).sum(axis=1)
        turn = np.arctan2(np.abs(sine), cosine)
        back = turn >= math.pi - _STRAIGHT
        bent = (turn > _STRAIGHT) & ~back
        per_reach = (16.0 - 25.0 * _SPACING) / 16.0 * np.sin(turn / 2)
        # A turn back leaves no deviation, so it takes all that there is: up to half a segment.
        shorter = np.minimum(length, np.roll(length, 1))
        wanted = np.where(back, shorter / 2, np.where(bent, size / np.where(bent, per_reach, 1.0), 0.0))
        # A blend never takes more than a whole segment, which keeps sums finite where the turn is slight; and two
        # on one segment are shrunk until they fit.
        reach = np.minimum(wanted, shorter)
        load = reach + np.roll(reach, -1)
        share = np.where(load > length, length / np.where(load > 0, load, 1.0), 1.0)
        reach = reach * np.minimum(share, np.roll(share, 1))
        shrunk = reach < wanted * (1 - 1e-12)
        # Around each corner a blend, then what is left of the segment after it; all pieces have degree 5.
        powers, zero = np.arange(5, -1, -1), np.zeros(2)
        widths, parts = [], []
        for k, corner in enumerate(plane):
            d = float(reach[k])
            if bent[k]:
                along = np.array([d, (1 - _SPACING) * d, (1 - 2 * _SPACING) * d])
                control = np.vstack([corner - along[:, None] * before[k], corner + along[::-1, None] * ahead[k]])
                # From Bernstein coefficients to powers of the share of the blend.
                signs = [[(-1.0) ** (j - i) * math.comb(j, i) for i in range(j + 1)] for j in powers]
                blend = [math.comb(5, len(row) - 1) * (np.array(row) @ control[: len(row)]) for row in signs]
                widths.append(5.0 * _SPACING * d)
                parts.append(np.array(blend) / widths[-1] ** powers[:, None])
            elif back[k]:
                # The distance to the tip is r(x)·w, r = (6x² − x⁴)/8, x from −1 to 1: slope 1, no curvature at ±1.
                w = d / _TIP
                c4, c2 = w / 8.0 * before[k], -6.0 * w / 8.0 * before[k]
                arriving = np.stack([zero, c4, -4 * c4, c2 + 6 * c4, -2 * c2 - 4 * c4, corner + c2 + c4])
                leaving = np.stack([zero, c4, zero, c2, zero, corner])
                widths += [w, w]
                parts += [part / w ** powers[:, None] for part in (arriving, leaving)]
            rest = float(length[k] - d - reach[(k + 1) % len(plane)])
            if rest > 1e-12 * length[k]:
                widths.append(rest)
                parts.append(np.stack([zero, zero, zero, zero, ahead[k], corner + d * ahead[k]]))
        breaks, pieces = np.concatenate([[0.0], np.cumsum(widths)]), np.stack(parts, axis=1)
        corners = tuple(
            RoundedCorner(
                corner=int(k),
                turn=float(turn[k]),
                reach=float(reach[k]),
                deviation=float(per_reach[k] * reach[k]) if bent[k] else 0.0,
                shrunk=bool(shrunk[k]),
            )
            for k in np.flatnonzero(bent | back)
        )
    curve = Curve(
        breaks=breaks,
        pieces=pieces,
        color=gait.color,
        vehicle=gait.vehicle,
        coefficients=gait.coefficients,
        crossing_tolerance=gait.crossing_tolerance,
    )
    return Rounding(curve=curve, gait=merged, tolerance=size, corners=corners)


def lifted(
    plane: FloatArray, color: str, first: FloatArray, coefficients: Coefficients, *, derivative: int = 0
) -> FloatArray:
    """Return (α1, …, α4) on a sheet above points of the plane, or above a derivative of them, shape (..., 4) [rad].

    Never wrapped: (α3, α4) above `first` is taken from [−π/2, π/2], and the others follow without a jump.
    """
    if color == "red":
        return np.concatenate([plane, plane], axis=-1)
    if derivative:
        return np.concatenate([plane, -plane], axis=-1)
    third, fourth = sheet_angles("blue", first[0], first[1], coefficients)
    return np.concatenate([plane, np.array([third, fourth]) + first - plane], axis=-1)


def _array(name: str, value: npt.ArrayLike) -> FloatArray:
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name} must be an array of numbers, got {shown(value)}") from error
    if not np.isfinite(array).all():
        raise InputError(f"{name} must be finite, got {array[~np.isfinite(array)][0]!r}")
    return array
