"""Smooth closed curves of tilt angles on one sheet: piecewise polynomials in (α1, α2), lifted exactly.

Both sheets are planes, so that a polynomial in (α1, α2) is one in all four angles, and lies on its sheet between
samples too. What is said about a whole curve rests on chords: on an interval of width h a curve is within
h²/8·max|q''| of the chord, and max|q''| is at most that of its Bernstein coefficients (convex hull property).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import number_of
from gaitgraph.errors import InputError, shown
from gaitgraph.gait.gait import Gait
from gaitgraph.invertibility.matrices import DEFAULT_FLOOR, Coefficients, coefficients_of
from gaitgraph.surface.sheets import DEFAULT_CROSSING_TOLERANCE, DEFAULT_TOLERANCE, sheet_angles
from gaitgraph.timing.chords import Beside
from gaitgraph.timing.polynomials import bernstein_from_power, derivative_of, values_of
from gaitgraph.validation.checks import check_gait, checked_limits
from gaitgraph.validation.report import Report
from gaitgraph.vehicle import PAPER, Vehicle

if TYPE_CHECKING:
    from gaitgraph.validation.report import Report

__all__ = ["DEFAULT_CHORD", "Curve", "curve_through", "lifted"]

FloatArray = npt.NDArray[np.float64]

DEFAULT_CHORD = 1e-6
"""How far a curve may be from the chords that its checks look along [rad in the (α1, α2) plane]."""

_MOST_POINTS = 4_000_000
_SEAM = 1e-8


@dataclass(frozen=True, slots=True, kw_only=True)
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
    Not guaranteed by its existence: that a curve is flyable; :meth:`check` says so. Nor that it keeps its speed: where
    the first derivative vanishes it may turn back on itself, as in :mod:`gaitgraph.timing.rounding`.

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
    color: str = "red"
    vehicle: Vehicle = PAPER
    coefficients: Coefficients = field(default_factory=coefficients_of)
    crossing_tolerance: float = DEFAULT_CROSSING_TOLERANCE

    def __post_init__(self) -> None:
        breaks, pieces = _array("breaks", self.breaks), _array("pieces", self.pieces)
        if breaks.ndim != 1 or breaks.size < 2 or breaks[0] != 0 or not (np.diff(breaks) > 0).all():
            raise InputError(f"breaks: {shown(self.breaks)}; allowed are at least two increasing numbers from 0 on")
        k = breaks.size - 1
        if pieces.ndim != 3 or pieces.shape[1:] != (k, 2) or not len(pieces):
            raise InputError(f"pieces: an array of shape {pieces.shape}; allowed is (degree + 1, {k}, 2)")
        if self.color not in ("red", "blue"):
            raise InputError(f"color: {shown(self.color)}; allowed are 'red' and 'blue'")
        breaks.flags.writeable = pieces.flags.writeable = False
        object.__setattr__(self, "breaks", breaks)
        object.__setattr__(self, "pieces", pieces)
        self._check_joints()

    def __repr__(self) -> str:
        return (
            f"<Curve: {self.color}, {self.breaks.size - 1} pieces, span {self.span:.6g}, vehicle {self.vehicle.name!r}>"
        )

    def _check_joints(self) -> None:
        """Raise InputError where the curve, or its first or second derivative, jumps."""
        width = np.diff(self.breaks)
        for order, name in enumerate(("position", "first derivative", "second derivative")):
            coefficients = derivative_of(self.pieces, order)
            start, end = coefficients[-1], values_of(coefficients, width)
            # What floats carry of a derivative depends on the terms that it is a sum of.
            terms = values_of(np.abs(coefficients), width)
            size = float(terms.max())
            jump = np.abs(np.roll(end, 1, axis=0) - start).max(axis=1)
            bad = jump > _SEAM * max(size, 1e-300)
            if bad.any():
                at = int(np.argmax(bad))
                where = "the seam" if at == 0 else f"break {at}"
                raise InputError(
                    f"pieces: the {name} jumps by {jump[at]:.2g} at {where}; allowed is a closed curve, continuous to "
                    "the second derivative"
                )

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
            raise InputError(f"derivative: {shown(derivative)}; allowed is a whole number ≥ 0")
        phase = np.asarray(np.mod(np.asarray(s, dtype=float), self.span))
        piece = np.clip(np.searchsorted(self.breaks, phase, side="right") - 1, 0, len(self.breaks) - 2)
        coefficients = derivative_of(self.pieces, int(derivative))
        plane = values_of(coefficients[:, piece], phase - self.breaks[piece])
        return self.lifted(plane, derivative=int(derivative))

    def lifted(self, plane: FloatArray, *, derivative: int = 0) -> FloatArray:
        """Return (α1, …, α4) above points of the plane, or above a derivative of them, shape (..., 4).

        Never wrapped: on blue, the branch is that of the curve's first point.
        """
        return lifted(plane, self.color, self.pieces[-1, 0], self.coefficients, derivative=derivative)

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

        Parameters
        ----------
        tolerance
            Largest distance in the (α1, α2) plane between curve and chord at the same parameter [rad].
        """
        if not 0 < number_of(tolerance) < math.inf:
            raise InputError(f"tolerance: {shown(tolerance)}; allowed is a positive finite number (rad)")
        width = np.diff(self.breaks)
        bend = np.linalg.norm(bernstein_from_power(derivative_of(self.pieces, 2), width), axis=-1).max(axis=0)
        count = np.maximum(np.ceil(width * np.sqrt(bend / (8.0 * tolerance)) * (1 + 1e-9)), 1.0)
        if count.sum() > _MOST_POINTS:
            raise InputError(
                f"tolerance: {shown(tolerance)} takes {count.sum():.3g} chords; allowed are {_MOST_POINTS} at most"
            )
        number = count.astype(np.int64)
        first = np.repeat(np.cumsum(number) - number, number)
        step = np.arange(int(number.sum())) - first
        return np.asarray(np.repeat(self.breaks[:-1], number) + step * np.repeat(width / number, number))

    def polyline(self, tolerance: float = 1e-4) -> Gait:
        """Return a gait whose corners are points of the curve, the curve within a tolerance of its segments.

        Parameters
        ----------
        tolerance
            Largest distance in the (α1, α2) plane [rad]; certain, from a bound of the second derivative.
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
        beside = Beside(gait, self.extremes(), chord)
        checks = tuple(beside.tightened(check, floor) for check in report.checks)
        if report.reachable_from_hover and not beside.sign_kept(coefficients_of(self.vehicle, "exact"), 1.0):
            undecided = "too near R = 0 to be decided beside chords of this size"
            report = replace(report, reachable_from_hover=None, reachability=undecided)
        return replace(report, checks=checks)


def curve_through(
    points: npt.ArrayLike,
    color: str = "red",
    *,
    degree: int = 3,
    vehicle: Vehicle = PAPER,
    coefficients: Coefficients | None = None,
    crossing_tolerance: float = DEFAULT_CROSSING_TOLERANCE,
) -> Curve:
    """Return the closed interpolating spline through points of the (α1, α2) plane.

    Parameters
    ----------
    points
        Points in order, shape (n, 2), n ≥ 3 for cubics and n ≥ 6 for quintics; the way back is implied [rad].
    color
        "red" or "blue".
    degree
        3 (twice continuously differentiable) or 5 (four times).
    vehicle, coefficients, crossing_tolerance
        As for :class:`Curve`.

    Notes
    -----
    The parameter is the length of the polygon through the points, which keeps cubics from overshooting between points
    that are unevenly apart. A spline may still swing out between its points: see :meth:`Curve.extremes`.
    """
    plane = _array("points", points)
    if degree not in (3, 5) or isinstance(degree, bool):
        raise InputError(f"degree: {shown(degree)}; allowed are 3 and 5")
    fewest = 3 if degree == 3 else 6
    if plane.ndim != 2 or plane.shape[1] != 2 or len(plane) < fewest:
        raise InputError(f"points: an array of shape {plane.shape}; allowed is (n, 2) with n at least {fewest}")
    closed = np.vstack([plane, plane[:1]])
    size = np.linalg.norm(np.diff(closed, axis=0), axis=1)
    if not (size > 1e-12).all():
        again = int(np.argmin(size))
        raise InputError(f"points: point {again + 1} is repeated by the next; allowed are distinct neighbours")
    from scipy.interpolate import make_interp_spline

    breaks = np.concatenate([[0.0], np.cumsum(size)])
    spline = make_interp_spline(breaks, closed, k=degree, bc_type="periodic")
    # The knots of a periodic spline of odd degree are its points.
    orders = range(degree, -1, -1)
    pieces = np.stack([spline(breaks[:-1], nu=order) / math.factorial(order) for order in orders])
    return Curve(
        breaks=breaks,
        pieces=pieces,
        color=color,
        vehicle=vehicle,
        coefficients=coefficients or coefficients_of(vehicle),
        crossing_tolerance=crossing_tolerance,
    )


def lifted(
    plane: FloatArray, color: str, first: FloatArray, coefficients: Coefficients, *, derivative: int = 0
) -> FloatArray:
    """Return (α1, …, α4) on a sheet above points of the plane, or above a derivative of them, shape (..., 4) [rad].

    Parameters
    ----------
    plane
        (α1, α2) or a derivative of them, shape (..., 2).
    color
        "red" or "blue".
    first
        The point (α1, α2) whose (α3, α4) is taken from [−π/2, π/2]; the others follow without a jump.
    coefficients
        The coefficients of the sheets.
    derivative
        0 for points, more for derivatives.
    """
    if color == "red":
        return np.concatenate([plane, plane], axis=-1)
    if derivative:
        return np.concatenate([plane, -plane], axis=-1)
    third, fourth = sheet_angles("blue", first[0], first[1], coefficients)
    return np.concatenate([plane, np.array([third, fourth]) + first - plane], axis=-1)


def _array(name: str, value: Any) -> FloatArray:
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name}: {shown(value)}; allowed is an array of numbers") from error
    if not np.isfinite(array).all():
        raise InputError(f"{name}: {array[~np.isfinite(array)][0]!r}; allowed are finite numbers")
    return array
