r"""Curved borders in a plane as polygons that are certified to follow them.

A border is where h = P² + Q vanishes, P and Q sums of cosines of linear functions of the two coordinates
(:class:`Waves`). Where it is also an explicit function of one coordinate it is sampled there, and every chord is
certified: across a rectangle around the chord the slope of h does not vanish,

    |∂h/∂n| ≥ m > 0,

so inside it the border is one graph over the chord, through both of its ends; and on a chord of length ℓ, with
|∂²h/∂t²| ≤ M, |h| ≤ e + M·ℓ²/8 where e is what is left of h at the ends. So the border is nowhere farther from the
chord than (e + M·ℓ²/8)/m. Chords for which that is too much are divided.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import shapely

if TYPE_CHECKING:
    from shapely import Polygon
    from shapely.geometry.base import BaseGeometry

FloatArray = npt.NDArray[np.float64]
Function = Callable[[FloatArray], FloatArray]

_FIRST_CHORDS = 8
_MOST_ROUNDS = 40
_ON_CIRCLE = 1e-4
_SAME = 1e-12


@dataclass(frozen=True, slots=True)
class Waves:
    """A sum of cosines, Σ size·cos(x·first + y·second − phase), a row (size, first, second, phase) of `terms` each.

    >>> product = cosine(1.0, 0.0) * cosine(0.0, 1.0)
    >>> round(float(product.at(np.array([[0.3, 0.4]]))[0] - math.cos(0.3) * math.cos(0.4)), 12)
    0.0
    """

    terms: FloatArray

    def __add__(self, other: Waves | float) -> Waves:
        rest = other.terms if isinstance(other, Waves) else np.array([[other, 0.0, 0.0, 0.0]])
        return Waves(np.vstack([self.terms, rest]))

    def __mul__(self, other: Waves | float) -> Waves:
        if not isinstance(other, Waves):
            return Waves(self.terms * np.array([other, 1.0, 1.0, 1.0]))
        one, two = np.repeat(self.terms, len(other.terms), axis=0), np.tile(other.terms, (len(self.terms), 1))
        size = one[:, :1] * two[:, :1] / 2
        parts = [np.hstack([size, one[:, 1:] + two[:, 1:]]), np.hstack([size, one[:, 1:] - two[:, 1:]])]
        return Waves(np.vstack(parts))

    def _phases(self, points: FloatArray) -> FloatArray:
        return np.asarray(points @ self.terms[:, 1:3].T - self.terms[:, 3])

    def at(self, points: FloatArray) -> FloatArray:
        """Return the values at points of shape (m, 2)."""
        return np.asarray(np.cos(self._phases(points)) @ self.terms[:, 0])

    def along(self, points: FloatArray, direction: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return values, slopes along directions of length one and across them (to the left), and bends along them.

        Points and directions have the shape (m, 2), what is returned (m,). The bend is the second derivative.
        """
        phases, size = self._phases(points), self.terms[:, 0]
        falls, values = -np.sin(phases), np.cos(phases)
        rates = direction @ self.terms[:, 1:3].T
        side = direction @ np.stack([self.terms[:, 2], -self.terms[:, 1]])
        return values @ size, (falls * rates) @ size, (falls * side) @ size, -(values * rates**2) @ size

    def most(self, order: int) -> float:
        """Return what no derivative of an order, along any directions of length one, can exceed."""
        return float(np.sum(np.abs(self.terms[:, 0]) * np.hypot(self.terms[:, 1], self.terms[:, 2]) ** order))


def cosine(first: float, second: float, phase: float = 0.0, size: float = 1.0) -> Waves:
    """Return size·cos(first·x + second·y − phase); a sine has the phase π/2."""
    return Waves(np.array([[size, first, second, phase]]))


@dataclass(frozen=True, slots=True)
class Border:
    """Where h = squared² + rest vanishes, P² + Q.

    They are kept apart because along a border with small Q both P and its slope along the border are small, so that
    much longer chords can be certified than from bounds of h as a whole.
    """

    rest: Waves
    squared: Waves = Waves(np.zeros((1, 4)))

    def at(self, points: FloatArray) -> FloatArray:
        """Return h at points of shape (m, 2)."""
        return np.asarray(self.squared.at(points) ** 2 + self.rest.at(points))

    def deviation(self, starts: FloatArray, ends: FloatArray, reach: float) -> FloatArray:
        """Return a bound of how far the border may be from chords between points on it, shape (m,).

        `starts` and `ends` have the shape (m, 2); `reach` is half the width of the rectangles that are looked at. The
        bound is infinite where none up to `reach` is certain.
        """
        chord = ends - starts
        length = np.hypot(chord[:, 0], chord[:, 1])
        along = chord / np.maximum(length, 1e-300)[:, None]
        middle, half = (starts + ends) / 2, length / 2
        p, p_along, p_across, p_bend = self.squared.along(middle, along)
        _, _, q_across, q_bend = self.rest.along(middle, along)
        p_most2, p_most3, q_most2, q_most3 = (w.most(k) for w in (self.squared, self.rest) for k in (2, 3))
        # The largest of |P| and of its slopes on the rectangle, from the middle and what may change from there.
        most_along = np.abs(p_along) + p_most2 * (half + reach)
        most_across = np.abs(p_across) + p_most2 * (half + reach)
        most = np.abs(p) + most_along * half + most_across * reach
        common = 2 * most * p_most2 + q_most2
        slope = np.abs(2 * p * p_across + q_across)
        slope = slope - (2 * most_along * most_across + common) * half - (2 * most_across**2 + common) * reach
        bend = np.abs(2 * p_along**2 + 2 * p * p_bend + q_bend)
        bend = bend + half * (6 * most_along * p_most2 + 2 * most * p_most3 + q_most3)
        left = np.abs(self.at(np.concatenate([starts, ends]))).reshape(2, -1).max(axis=0)
        with np.errstate(divide="ignore", invalid="ignore"):
            bound = (left + bend * length**2 / 8) / slope
        return np.asarray(np.where((slope > 0) & (bound <= reach), bound, np.inf))


def zeros_of_degree_two(function: Function, period: float) -> FloatArray:
    """Return where a trigonometric polynomial of degree two may vanish on [−period/2, period/2), sorted.

    The zeros are those roots of a polynomial of degree four that lie on the unit circle; some that only nearly do
    are returned too, so that rounding loses no double zero.

    >>> zeros_of_degree_two(lambda x: np.cos(x) - 0.5, 2 * math.pi).round(6).tolist()
    [-1.047198, 1.047198]
    """
    parts = np.fft.fft(function(np.linspace(0.0, period, 8, endpoint=False))) / 8
    polynomial = np.asarray(parts[[2, 1, 0, -1, -2]], dtype=complex)
    polynomial[np.abs(polynomial) <= 1e-15 * np.abs(polynomial).max()] = 0.0
    roots = np.roots(polynomial)
    roots = roots[np.abs(np.abs(roots) - 1.0) < _ON_CIRCLE]
    return np.sort(np.angle(roots)) * period / (2 * math.pi)


def _abscissae(low: float, high: float, function: Function, border: Border | None, tolerance: float) -> FloatArray:
    """Return abscissae on an interval such that the chords between a function's values there follow the border.

    A straight side needs both ends only.
    """
    if border is None:
        return np.array([low, high])

    def at(theta: FloatArray) -> FloatArray:
        # Dense at both ends, where an explicit border may rise like a square root.
        x = (low + high) / 2 - (high - low) / 2 * np.cos(theta)
        return np.where(theta <= 0, low, np.where(theta >= math.pi, high, x))

    theta = np.linspace(0.0, math.pi, _FIRST_CHORDS + 1)
    kept, starts, ends = [theta], theta[:-1], theta[1:]
    for _ in range(_MOST_ROUNDS):
        x = at(np.concatenate([starts, ends]))
        first, second = np.split(np.column_stack([x, function(x)]), 2)
        bound = border.deviation(first, second, 2 * tolerance)
        # A chord shorter than the tolerance is as good as the border.
        bound[np.hypot(*(second - first).T) < tolerance / 2] = 0.0
        pieces = np.where(np.isfinite(bound), np.ceil(np.sqrt(bound / tolerance)), 4.0)
        open_ = pieces > 1
        if not open_.any():
            break
        count = pieces[open_].astype(int)
        number = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
        begin, step = np.repeat(starts[open_], count), np.repeat((ends - starts)[open_] / count, count)
        closing = np.repeat(ends[open_], count)
        starts, ends = (
            begin + number * step,
            np.where(number + 1 == np.repeat(count, count), closing, begin + (number + 1) * step),
        )
        kept.append(starts[number > 0])
    return at(np.sort(np.concatenate(kept)))


def bands_between(
    breaks: FloatArray,
    roots: Sequence[Function],
    holds: Callable[[float, float], bool],
    border: Border,
    tolerance: float,
    *,
    ends: tuple[float, float] = (-1.0, 1.0),
    ordinate: Function = np.arccos,
) -> BaseGeometry:
    """Return where a condition holds, as polygons whose borders follow the true ones.

    For every abscissa x the condition changes only at a few values of w, its roots, which are explicit functions of
    x; the second coordinate is a monotone function of w.

    Parameters
    ----------
    breaks
        Abscissae between which no root enters or leaves `ends`, meets another, or ceases to exist; sorted.
    roots
        Functions of x, ascending; NaN where they do not exist.
    holds
        Whether the condition holds at (x, w).
    border
        What vanishes on the roots, in the coordinates of the polygons.
    tolerance
        How far a border may be from the polygons' sides.
    ends
        The range of w.
    ordinate
        The second coordinate for given w.
    """
    first, last = ends
    kept = np.concatenate([[True], np.diff(breaks) > _SAME])
    kept[-1] = True
    polygons: list[Polygon | None] = []
    for low, high in pairwise(breaks[kept].tolist()):
        middle = np.array([(low + high) / 2])
        with np.errstate(invalid="ignore"):
            here = [(float(root(middle)[0]), root) for root in roots]
        edges: list[tuple[float, Function | None]] = [(first, None)]
        edges += [(w, root) for w, root in here if first < w < last]
        edges.append((last, None))
        inside = [holds(float(middle[0]), (a[0] + b[0]) / 2) for a, b in pairwise(edges)]
        # Each run of intervals in which the condition holds is one polygon.
        for held, run in groupby(range(len(inside)), key=inside.__getitem__):
            if held:
                numbers = list(run)
                bottom, top = edges[numbers[0]], edges[numbers[-1] + 1]
                polygons.append(_band(low, high, bottom, top, border, tolerance, ends, ordinate))
    return shapely.union_all([polygon for polygon in polygons if polygon is not None])


def _band(
    low: float,
    high: float,
    bottom: tuple[float, Function | None],
    top: tuple[float, Function | None],
    border: Border,
    tolerance: float,
    ends: tuple[float, float],
    ordinate: Function,
) -> Polygon | None:
    """Return the polygon between two roots, or ends, on an interval."""

    def side(edge: tuple[float, Function | None]) -> tuple[Function, Border | None]:
        value, root = edge
        if root is None:
            return (lambda x: ordinate(np.full(x.shape, value))), None
        # At the ends of the interval rounding alone can take a root out of the range.
        return (lambda x: ordinate(np.clip(root(x), *ends))), border

    (lower, lower_border), (upper, upper_border) = side(bottom), side(top)

    def between(below: FloatArray, above: FloatArray) -> Polygon | None:
        ring = np.vstack([np.column_stack([below, lower(below)]), np.column_stack([above, upper(above)])[::-1]])
        ring = ring[np.any(ring != np.roll(ring, 1, axis=0), axis=1)]
        return shapely.Polygon(ring) if len(ring) > 2 else None

    below = _abscissae(low, high, lower, lower_border, tolerance)
    above = _abscissae(low, high, upper, upper_border, tolerance)
    polygon = between(below, above)
    if polygon is not None and not polygon.is_valid:
        # The chords of a thin band may cross, unless both sides have the same abscissae.
        common = np.union1d(below, above)
        polygon = between(common, common)
    return polygon
