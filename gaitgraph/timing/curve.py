"""Smooth closed curves of tilt angles on one sheet: piecewise polynomials in (α1, α2), lifted exactly.

Both sheets are planes, so that a polynomial in (α1, α2) is one in all four angles, and lies on its sheet between
samples too. What is said about a whole curve rests on chords: on an interval of width h a curve is within
h²/8·max|q''| of the chord, and max|q''| is at most that of its Bernstein coefficients (convex hull property).

Polynomial pieces are arrays of coefficients (degree + 1, k, …) of k pieces, highest power first, in powers of the
parameter that has passed since the piece started, as in ``scipy.interpolate.PPoly``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import number_of
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
from gaitgraph.validation.checks import check_gait, checked_limits
from gaitgraph.vehicle import PAPER, Vehicle

if TYPE_CHECKING:
    from gaitgraph.validation.report import Check, Report

FloatArray = npt.NDArray[np.float64]

DEFAULT_CHORD = 1e-6
"""How far a curve may be from the chords that its checks look along [rad in the (α1, α2) plane]."""

_MOST_POINTS = 4_000_000
_SEAM = 1e-8
_SQRT2 = math.sqrt(2.0)


def bernstein_from_power(pieces: FloatArray, width: FloatArray) -> FloatArray:
    """Return the Bernstein coefficients of polynomial pieces on intervals of given widths, shape as `pieces`.

    >>> bernstein_from_power(np.array([[1.0], [0.0], [0.0]]), np.array([2.0])).ravel().tolist()
    [0.0, 0.0, 4.0]
    """
    degree = len(pieces) - 1
    scale = width.reshape((-1,) + (1,) * (pieces.ndim - 2))
    rising = np.stack([pieces[degree - j] * scale**j for j in range(degree + 1)])
    mix = np.array([[math.comb(i, j) / math.comb(degree, j) for j in range(degree + 1)] for i in range(degree + 1)])
    return np.asarray(np.einsum("ij,j...->i...", mix, rising))


def derivative_of(pieces: FloatArray, order: int = 1) -> FloatArray:
    """Return the coefficients of a derivative of polynomial pieces.

    >>> derivative_of(np.array([[3.0], [2.0], [1.0]])).ravel().tolist()
    [6.0, 2.0]
    """
    for _ in range(order):
        degree = len(pieces) - 1
        if degree == 0:
            return np.zeros_like(pieces)
        pieces = pieces[:-1] * np.arange(degree, 0, -1).reshape((-1,) + (1,) * (pieces.ndim - 1))
    return pieces


def values_of(pieces: FloatArray, local: FloatArray) -> FloatArray:
    """Return polynomials at local parameters: coefficients (degree + 1, ..., d), parameters (...), out (..., d)."""
    out = np.broadcast_to(pieces[0], (*local.shape, pieces.shape[-1])).copy()
    for coefficient in pieces[1:]:
        out = out * local[..., None] + coefficient
    return np.asarray(out)


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
    derivative vanishes it may turn back on itself, as in :mod:`gaitgraph.timing.rounding`.

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

        Parameters
        ----------
        s
            Parameter values, shape (...).
        derivative
            0 for the angles, 1 for dα/ds and so on; from the third on, at a break, that of the piece that starts there.

        Returns
        -------
        array of shape (..., 4)
            [rad], or [rad] per unit of s to the power of the derivative's order.
        """
        if isinstance(derivative, bool) or not isinstance(derivative, (int, np.integer)) or derivative < 0:
            raise InputError(f"derivative must be a whole number ≥ 0, got {shown(derivative)}")
        phase = np.asarray(np.mod(np.asarray(s, dtype=float), self.span))
        piece = np.clip(np.searchsorted(self.breaks, phase, side="right") - 1, 0, len(self.breaks) - 2)
        coefficients = derivative_of(self.pieces, int(derivative))
        plane = values_of(coefficients[:, piece], phase - self.breaks[piece])
        return lifted(plane, self.color, self.pieces[-1, 0], self.coefficients, derivative=int(derivative))

    def turning_points(self) -> FloatArray:
        """Return the parameter values at which α1 or α2 may turn round, and the breaks, increasing, shape (n,).

        Between two of them all angles are monotone: the derivatives' zeros are roots of polynomials.
        """
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
        """Return parameter values, from 0 to below the span, between which chords are within a tolerance, shape (n,).

        The tolerance is the largest distance in the (α1, α2) plane between curve and chord at the same parameter [rad].
        """
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
        """Return a gait with corners on the curve; the curve is certainly within a tolerance of its segments.

        Parameters
        ----------
        tolerance
            Largest distance in the (α1, α2) plane [rad].
        """
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
            As for :func:`gaitgraph.validation.checks.check_gait`.
        chord
            How far the chords that are looked along may be from the curve [rad].

        Notes
        -----
        The chords are judged as a gait. What the curve may differ from them by is then taken off: the least
        singular value changes by at most √(2+κ²)·√2·chord, R by its largest slope, and so on. A curve that touches a
        limit may therefore be refused where a finer chord would let it pass; never the other way.
        """
        checked_limits(tolerance, floor, None)
        gait = self.polyline(chord)
        report = check_gait(gait, tolerance=tolerance, floor=floor)
        beside = _BesideChords(gait, self.extremes(), chord)
        checks = tuple(beside.check(check, floor) for check in report.checks)
        if report.reachable_from_hover and beside.least_level(coefficients_of(self.vehicle, "exact"), 1.0) <= 0:
            undecided = "too near R = 0 to be decided beside chords of this size"
            report = replace(report, reachable_from_hover=None, reachability=undecided)
        return replace(report, checks=checks)


class _BesideChords:
    """Checks of a curve from those of its chords, with what the curve may differ by taken off."""

    def __init__(self, gait: Gait, extremes: FloatArray, chord: float) -> None:
        self.gait, self.extremes, self.chord = gait, extremes, chord

    def check(self, check: Check, floor: float) -> Check:
        """Return a check of the chords as a check of the curve."""
        vehicle, limit = self.gait.vehicle, check.limit or 0.0
        if check.name == "tilt_range":
            value = float(np.abs(self.extremes).max())
            ok = value <= limit + 1e-9
            message = f"largest tilt {math.degrees(value):.1f}°, limit {math.degrees(limit):.1f}°"
            return replace(check, ok=ok, value=value, message=message + ("" if ok else ": stay nearer to 0"))
        if not check.ok:
            return check
        if check.name == "least_singular_value":
            return self._singular_value(check, floor)
        if check.name == "R_sign" and check.decided:
            return self._level_sign(check)
        if check.name == "hover_thrust":
            return self._hover_thrust(check)
        shares = self._shares() if check.name == "thrust_limit" else None
        if shares is None:
            return check
        mass, gravity = vehicle.require("mass", "gravity", purpose="the check of the largest thrust")
        newtons = shares[1] * mass * gravity
        message = f"largest hover thrust {newtons:.3g} N, limit {limit:.3g} N"
        return replace(check, ok=newtons <= limit, value=newtons, message=message)

    def least_level(self, coefficients: Coefficients, sign: float) -> float:
        """Return a lower bound of sign·R on the curve.

        R is bilinear in the features of both pairs, each of norm √2 at most, as their slopes are; four angles move,
        by 2√2·chord in sum.
        """
        lower = least_level_determinant(self.gait.alpha, self.gait.ends, coefficients, sign=sign).lower.min()
        slope = 2.0 * float(np.linalg.norm(coefficients.bilinear_form, 2))
        return float(lower) - slope * 2.0 * _SQRT2 * self.chord

    def _level_sign(self, check: Check) -> Check:
        sign = 1.0 if (check.value or 0.0) > 0 else -1.0
        lower, resolution = self.least_level(self.gait.coefficients, sign), check.limit or 0.0
        if lower > resolution:
            message = f"R {'≥' if sign > 0 else '≤'} {sign * lower:.3g} along the whole curve"
            return replace(check, value=sign * lower, message=f"{message} ({self.gait.coefficients.kind} coefficients)")
        message = f"sign of R undecided: along the curve |R| may fall to {max(lower, 0.0):.2g}: try a smaller chord"
        return replace(check, value=sign * lower, message=message, decided=False)

    def _singular_value(self, check: Check, floor: float) -> Check:
        vehicle = self.gait.vehicle
        lower = float(least_singular_value_of_all(self.gait.alpha, self.gait.ends, vehicle, tolerance=1e-6).lower.min())
        lower -= math.sqrt(2.0 + vehicle.drag_ratio**2) * _SQRT2 * self.chord
        if lower >= floor:
            message = f"least singular value at least {lower:.4f} along the whole curve, floor {floor:g}"
            return replace(check, value=lower, message=message)
        message = f"least singular value may fall to {max(lower, 0.0):.3g} along the curve, floor {floor:g}"
        return replace(check, ok=False, value=lower, message=f"{message}: keep away from it, or try a smaller chord")

    def _hover_thrust(self, check: Check) -> Check:
        shares = self._shares()
        if shares is None or shares[0] <= 0:
            message = "a rotor may have to idle to hover beside the chords: keep away from β1 = 0 and β2 = 0"
            return replace(check, ok=False, value=None, message=message)
        low, high = shares
        message = f"hover thrusts {low:.3f} to {high:.3f} of m·g per rotor along the whole curve, all positive"
        return replace(check, value=low, message=message)

    def _shares(self) -> tuple[float, float] | None:
        """Return bounds of the least and the largest thrust share on the curve, None where a rotor may idle.

        On red each factor of the zero-moment inputs depends on one coordinate, so the diagonal of the box around
        the curve decides for all of it. There T1/(m·g) = |sin β2|/(2D) with D = |sin β2| cos α1 + |sin β1| cos α2 =
        (κ cos³δ/2)·|R|/|cos β1 cos β2|, and D's slope is at most 2√2.
        """
        vehicle, gait = self.gait.vehicle, self.gait
        if gait.color != "red" or not thrusts_push_up(self.extremes[:1], self.extremes[1:], vehicle).all():
            return None
        kappa, sign = vehicle.drag_ratio, 1.0 if gait.R[0] > 0 else -1.0
        weight = self.least_level(coefficients_of(vehicle, "exact"), sign) * kappa / (2.0 * (1.0 + kappa**2) ** 1.5)
        upward, least, largest = thrust_shares_along(gait.alpha, gait.ends, vehicle, tolerance=1e-6)
        steep = 2.0 * _SQRT2 * self.chord / weight if weight > 0 else math.inf
        if not upward.all() or steep >= 0.5:
            return None
        high = (-float(largest.lower.min()) + self.chord / (2.0 * weight)) / (1.0 - steep)
        return float(least.lower.min()) - self.chord / (2.0 * weight) - steep * high, high


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
    color
        "red" or "blue".
    vehicle, coefficients, crossing_tolerance
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


def lifted(
    plane: FloatArray, color: str, first: FloatArray, coefficients: Coefficients, *, derivative: int = 0
) -> FloatArray:
    """Return (α1, …, α4) on a sheet above points of the plane, or above a derivative of them, shape (..., 4) [rad].

    Never wrapped: (α3, α4) above the point `first` is taken from [−π/2, π/2], and the others follow without a jump.
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
