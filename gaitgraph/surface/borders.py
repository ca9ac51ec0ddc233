r"""Curved borders in the (α1, α2) plane as polygons that are certified to follow them.

A border is where h = P² + Q vanishes, with P and Q sums of cosines (:class:`Waves`). On the red sheet of a symmetric
vehicle every condition is such an h ≥ 0, and over each α1, or over each α2, h has one frequency k of the other angle:

    h = m + a·cos kα2 + b·sin kα2,    α2 = (atan2(b, a) ± atan2(√(a² + b² − m²), −m))/k,

with m, a and b functions of α1 (docs/theory.md, 17). So the border is sampled, and every chord is certified: across a
rectangle around the chord the slope of h does not vanish,

    |∂h/∂n| ≥ m > 0,

so inside it the border is one graph over the chord, through both of its ends; and on a chord of length ℓ, with
|∂²h/∂t²| ≤ M, |h| ≤ e + M·ℓ²/8 where e is what is left of h at the ends. So the border is nowhere farther from the
chord than (e + M·ℓ²/8)/m. Chords for which that is too much are divided.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise, product
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt
import shapely

from gaitgraph.angles import HALF_PI
from gaitgraph.arrays import read_only
from gaitgraph.invertibility.forms import FloatArray
from gaitgraph.surface.region import SQUARE, Pair, chord_tolerance, offsets
from gaitgraph.tolerances import ROUND_OFF

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

Function = Callable[[FloatArray, FloatArray], FloatArray]
Phasors = npt.NDArray[np.complex128]

_CHORDS = 8  # with which a curved edge is first tried
_MOST_ROUNDS = 40  # of dividing chords
_NARROW = 0.1  # of the tolerance
_ON_CIRCLE = 1e-4  # how far from the unit circle a root may be that counts as on it
# Relative sizes below which rounding leaves a wave, a frequency, a second singular value instead of zero.
_NO_WAVE = 1e-15
_NO_FREQUENCY = 1e-10
_RANK_ONE = 1e-14
_FULL = 2 * math.pi
_SAMPLES = 8  # of an angle, for waves of a degree below four
_WAVE_NUMBERS = np.fft.fftfreq(_SAMPLES, 1 / _SAMPLES)
_ORDERS = read_only(np.array(list(product(_WAVE_NUMBERS, repeat=2))).T)
_GRID = read_only(_FULL / _SAMPLES * np.array(list(product(range(_SAMPLES), repeat=2))))
_OF_CURVES = np.array([0, 1, 2, -2, -1])  # wave numbers of h in α1
_DEGREE = 4  # of a discriminant
# Beyond the square by more than its polygons are moved, so that its sides are no sides of theirs.
_END = HALF_PI + 0.1
_AROUND = (-_END, -_END, _END, _END)


@dataclass(frozen=True, slots=True, eq=False)
class Waves:
    """A sum of cosines, Σ size·cos(α1·first + α2·second − phase), a row (size, first, second, phase) of `terms` each."""

    terms: FloatArray

    @classmethod
    def of(cls, function: Function) -> Waves:
        """Return those of a trigonometric polynomial of (α1, α2), both of shape (k,), of degree two in each."""
        phasors = _phasors(function(*_GRID.T)).ravel()
        first, second = _ORDERS
        # Of two conjugate waves one counts, twice.
        counted = np.where((first > 0) | ((first == 0) & (second > 0)), 2.0, 0.0)
        counted[0] = 1.0
        sizes = counted * np.abs(phasors)
        terms = np.column_stack([sizes, first, second, -np.angle(phasors)])
        return cls(terms[sizes > _NO_WAVE * sizes.max()])

    def _phases(self, points: FloatArray) -> FloatArray:
        return np.asarray(points @ self.terms[:, 1:3].T - self.terms[:, 3])

    def at(self, points: FloatArray) -> FloatArray:
        """Return the values at points of shape (m, 2)."""
        return np.asarray(np.cos(self._phases(points)) @ self.terms[:, 0])

    def along(
        self, points: FloatArray, direction: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return values, slopes along unit directions and across them (to the left), and second derivatives along."""
        phases, size = self._phases(points), self.terms[:, 0]
        falls, values = -np.sin(phases), np.cos(phases)
        rates = direction @ self.terms[:, 1:3].T
        side = direction @ np.stack([self.terms[:, 2], -self.terms[:, 1]])
        return (
            values @ size,
            (falls * rates) @ size,
            (falls * side) @ size,
            -(values * rates**2) @ size,
        )

    def most(self, order: int) -> float:
        """Return what no derivative of an order, along any directions of length one, can exceed."""
        rates = np.hypot(self.terms[:, 1], self.terms[:, 2])
        return float(np.abs(self.terms[:, 0]) @ rates**order)

    def scaled(self, factor: float, shift: float) -> Waves:
        """Return these waves times a factor, plus a number."""
        terms = np.vstack([self.terms, [shift, 0.0, 0.0, 0.0]])
        terms[:-1, 0] *= factor
        return Waves(terms)

    def transposed(self) -> Waves:
        """Return the waves of (α2, α1)."""
        return Waves(self.terms[:, [0, 2, 1, 3]])


@dataclass(frozen=True, slots=True, eq=False)
class Border:
    """Where h = squared² + rest vanishes, P² + Q.

    They are kept apart because along a border with small Q both P and its slope along the border are small, so that
    much longer chords can be certified than from bounds of h as a whole. `corner` is how far the border is from
    those of a function of α1 times one of α2 at most [rad]; with None the values of h say whether it is such a product.
    """

    rest: Waves
    squared: Waves = Waves(np.zeros((1, 4)))
    corner: float | None = None

    def at(self, points: FloatArray) -> FloatArray:
        """Return h at points of shape (m, 2)."""
        return np.asarray(self.squared.at(points) ** 2 + self.rest.at(points))

    def transposed(self) -> Border:
        """Return the border of (α2, α1)."""
        squared = self.squared.transposed()
        return Border(self.rest.transposed(), squared, self.corner)

    def deviation(
        self, starts: FloatArray, ends: FloatArray, reach: float
    ) -> FloatArray:
        """Return how far the border may be from chords between points on it, infinite unless that is up to `reach`."""
        chord = ends - starts
        length = np.hypot(chord[:, 0], chord[:, 1])
        along = chord / np.maximum(length, 1e-300)[:, None]
        middle, half = (starts + ends) / 2, length / 2
        p, p_along, p_across, p_bend = self.squared.along(middle, along)
        _, _, q_across, q_bend = self.rest.along(middle, along)
        p_most2, p_most3 = self.squared.most(2), self.squared.most(3)
        q_most2, q_most3 = self.rest.most(2), self.rest.most(3)
        # The largest |P| and slopes of P on the rectangle: from their values in its middle, by Taylor's theorem.
        most_along = np.abs(p_along) + p_most2 * (half + reach)
        most_across = np.abs(p_across) + p_most2 * (half + reach)
        most = np.abs(p) + most_along * half + most_across * reach
        # m: |∂h/∂n| = |2P·∂P/∂n + ∂Q/∂n| in the middle, less what the second derivatives of h can take off it.
        common = 2 * most * p_most2 + q_most2
        slope = np.abs(2 * p * p_across + q_across)
        slope -= (2 * most_along * most_across + common) * half
        slope -= (2 * most_across**2 + common) * reach
        # M: |∂²h/∂t²| = |2(∂P/∂t)² + 2P·∂²P/∂t² + ∂²Q/∂t²| in the middle, and what the third derivatives can add.
        bend = np.abs(2 * p_along**2 + 2 * p * p_bend + q_bend)
        bend += half * (6 * most_along * p_most2 + 2 * most * p_most3 + q_most3)
        # e: what is left of h at the ends; then the bound of the module's docstring.
        left = np.abs(self.at(np.concatenate([starts, ends])))
        left = left.reshape(2, -1).max(axis=0)
        with np.errstate(divide="ignore", invalid="ignore"):
            bound = (left + bend * length**2 / 8) / slope
        return np.asarray(np.where((slope > 0) & (bound <= reach), bound, np.inf))


class _Edges(NamedTuple):
    """Sides of polygons over intervals of α1, in order, with their ordinates in the middle [rad].

    A side is one of the two zeros over each α1, or straight where `zero` is negative.
    """

    interval: npt.NDArray[np.intp]
    low: FloatArray
    high: FloatArray
    ordinate: FloatArray
    zero: npt.NDArray[np.int64]


class _Curve:
    """A border as two α2 over each α1, in a range of α2.

    Over each α1, h = m + 2·Re(c·exp(ikα2)) with polynomials m and c of exp(±iα1). `roots` are the phasors of P, `rest`
    those of Q.
    """

    def __init__(
        self,
        border: Border,
        roots: Phasors,
        rest: Phasors,
        frequency: int,
        bottom: float,
        top: float,
    ) -> None:
        self.border = border
        columns = [roots[:, 1], rest[:, 0], rest[:, frequency]]
        self.table = np.column_stack(columns)[_OF_CURVES]
        self.frequency = frequency
        self.bottom, self.middle, self.top = bottom, (bottom + top) / 2, top

    def _parts(self, alpha1: FloatArray) -> tuple[FloatArray, Phasors, FloatArray]:
        """Return m, c and 4|c|² − m².

        With P = 2·Re(b·exp(iα2)), m and c are 2|b|² and b² and those of Q. In the last |b|⁴ cancels, which may be much
        larger than what is left.
        """
        turns = np.exp(1j * np.outer(alpha1, _OF_CURVES))
        root, mean, wave = (turns @ self.table).T
        mean, square, size = mean.real, root**2, 2 * np.abs(root) ** 2
        excess = 4 * (wave * np.conj(2 * square + wave)).real
        excess -= mean * (2 * size + mean)
        return size + mean, square + wave, excess

    def _zeros(self, alpha1: FloatArray) -> FloatArray:
        """Return both α2, shape (2, k); one angle twice where there is none."""
        mean, wave, excess = self._parts(alpha1)
        rooted = np.sqrt(np.maximum(excess, 0.0))
        phase, half = -np.angle(wave), np.arctan2(rooted, -mean)
        return np.array([phase - half, phase + half]) / self.frequency

    def breaks(self) -> FloatArray:
        """Return the α1 in [−π, π] where one zero may meet the other, or an end or the middle of the range of α2."""
        at = _FULL * np.arange(4 * _DEGREE) / (4 * _DEGREE)
        mean, wave, excess = self._parts(at)
        samples = [excess]
        for alpha2 in (self.bottom, self.middle, self.top):
            turned = wave * np.exp(1j * self.frequency * alpha2)
            samples.append(mean + 2 * turned.real)
        return np.concatenate(list(map(zeros_of, samples)))

    def edges(self, limits: FloatArray) -> _Edges:
        """Return all edges over one interval of α1 after the other, from below to above."""
        middles = (limits[:-1] + limits[1:]) / 2
        has_zeros = self._parts(middles)[2] > 0
        zeros = np.where(has_zeros, self._zeros(middles), math.nan)
        turn = _FULL / self.frequency
        copies = np.concatenate([zeros - turn, zeros, zeros + turn])
        copies[~((self.bottom < copies) & (copies < self.top))] = math.nan
        ends = np.repeat([[self.bottom], [self.top]], len(middles), axis=1)
        ordinates = np.concatenate([copies, ends])
        order = np.argsort(ordinates, axis=0)
        ordered = np.take_along_axis(ordinates, order, axis=0).T
        interval, place = np.nonzero(np.isfinite(ordered))
        return _Edges(
            interval,
            limits[interval],
            limits[interval + 1],
            ordered[interval, place],
            np.array([0, 1, 0, 1, 0, 1, -1, -1])[order.T[interval, place]],
        )

    def _points(self, edges: _Edges, number: Any, theta: FloatArray) -> FloatArray:
        """Return points on the edges of some numbers, dense at both ends, where a border may rise like a square root."""
        low, high = edges.low[number], edges.high[number]
        x = (low + high) / 2 - (high - low) / 2 * np.cos(theta)
        x = np.where(theta <= 0, low, np.where(theta >= math.pi, high, x))
        y = edges.ordinate[number]
        curved = np.flatnonzero(edges.zero[number] >= 0)
        angle = self._zeros(x[curved])[edges.zero[number[curved]], range(len(curved))]
        # An edge stays in one half of the range, and at the ends of its interval rounding alone takes it out.
        turn, quarter = _FULL / self.frequency, (self.top - self.bottom) / 4
        center = self.middle + np.copysign(quarter, y[curved] - self.middle)
        angle -= turn * np.rint((angle - center) / turn)
        y[curved] = np.clip(angle, self.bottom, self.top)
        return np.column_stack([x, y])

    def traces(self, edges: _Edges, tolerance: float) -> list[FloatArray]:
        """Return the points of a polyline that follows each edge, shape (m, 2)."""
        is_straight = edges.zero < 0
        chords = np.where(is_straight, 1, _CHORDS)
        number = np.repeat(np.arange(len(chords)), chords + 1)
        first = np.cumsum(chords + 1) - chords - 1
        theta = math.pi * (np.arange(len(number)) - first[number]) / chords[number]
        settled = is_straight[number[1:]] | (number[1:] != number[:-1])
        points = self._points(edges, number, theta)
        for _ in range(_MOST_ROUNDS):
            starts, ends = points[:-1][~settled], points[1:][~settled]
            parts = np.ones(len(settled), dtype=int)
            parts[~settled] = _parts_of(self.border, starts, ends, tolerance)
            if parts.max() == 1:
                break
            last = np.append(0, np.cumsum(parts))
            theta = np.interp(np.arange(last[-1] + 1), last, theta)
            number = np.append(np.repeat(number[:-1], parts), number[-1])
            settled = np.repeat(parts == 1, parts)
            is_new = np.ones(len(theta), dtype=bool)
            is_new[last] = False
            known, points = points, np.empty((len(theta), 2))
            points[last] = known
            points[is_new] = self._points(edges, number[is_new], theta[is_new])
        return np.split(points, np.flatnonzero(np.diff(number)) + 1)


def _parts_of(
    border: Border, starts: FloatArray, ends: FloatArray, tolerance: float
) -> npt.NDArray[np.int64]:
    """Return into how many parts chords are to be cut, 1 if they follow the border to the tolerance."""
    bound = border.deviation(starts, ends, 2 * tolerance)
    # A chord shorter than the tolerance is as good as the border; so is one across a strip that is much narrower,
    # beside an abscissa at which the border vanishes whatever the ordinate.
    across = np.abs(ends - starts)
    bound[np.hypot(across[:, 0], across[:, 1]) < tolerance / 2] = 0.0
    bound[across[:, 0] < _NARROW * tolerance] = 0.0
    # The bound falls with the square of a chord's length; without a bound a chord is cut into four.
    parts = np.full(len(bound), 4)
    known = np.isfinite(bound)
    parts[known] = np.maximum(np.ceil(np.sqrt(bound[known] / tolerance)), 1)
    return parts


class Drawn(NamedTuple):
    """A set as polygons, which end anywhere beyond what was asked for, and whether all of its border is straight."""

    shape: BaseGeometry
    is_straight: bool


def where_negative(
    border: Border,
    tolerance: float,
    *,
    also: Border | None = None,
    bounds: tuple[float, float, float, float] = _AROUND,
) -> Drawn:
    """Return where h of a border, or another h, is negative, with sides that are within a tolerance of it [rad].

    Where `also` vanishes the first h must not be positive, so that no border is missed. `bounds` are those of a shape in
    the square, beyond which the polygons may end.
    """
    roots, rest = border.squared.at(_GRID), border.rest.at(_GRID)
    sizes = np.abs(_phasors(roots**2 + rest))
    has_frequency = sizes[:, 1:3].max(axis=0) > _NO_FREQUENCY * sizes.max()
    left, bottom, right, top = bounds
    if has_frequency.all():
        turned = where_negative(
            border.transposed(),
            tolerance,
            also=also and also.transposed(),
            bounds=(bottom, left, top, right),
        )
        shape = shapely.transform(turned.shape, lambda points: points[:, ::-1])
        return Drawn(shape, turned.is_straight)

    def is_held(points: FloatArray) -> npt.NDArray[np.bool_]:
        held = border.at(points) < 0
        return held if also is None else held | (also.at(points) < 0)

    # A product of a function of α1 and one of α2 vanishes on straight lines.
    corner = border.corner
    if corner is None or corner <= tolerance:
        values = (roots**2 + rest).reshape(_SAMPLES, _SAMPLES)
        of_first, factors, of_second = np.linalg.svd(values)
        if corner is None:
            corner = 0.0 if factors[1] <= _RANK_ONE * factors[0] else math.inf
    if corner <= tolerance:
        x, y = _limits(zeros_of(of_first[:, 0])), _limits(zeros_of(of_second[0]))
        boxes = np.array([(*a, *b) for a, b in product(pairwise(x), pairwise(y))])
        held = is_held(boxes.reshape(-1, 2, 2).mean(axis=2))
        shape = shapely.union_all(shapely.box(*boxes[held][:, [0, 2, 1, 3]].T))
        return Drawn(shape, corner <= ROUND_OFF)

    frequency = 1 if has_frequency[0] else 2
    curve = _Curve(
        border,
        _phasors(roots),
        _phasors(rest),
        frequency,
        max(bottom, -_END),
        min(top, _END),
    )
    edges = curve.edges(_limits(curve.breaks(), left, right))
    below = np.flatnonzero(np.diff(edges.interval) == 0)
    middle = (edges.low + edges.high)[below] / 2
    between = (edges.ordinate[below] + edges.ordinate[below + 1]) / 2
    traces = curve.traces(edges, tolerance)
    polygons = [
        shapely.Polygon(np.concatenate([traces[k], traces[k + 1][::-1]]))
        for k in below[is_held(np.column_stack([middle, between]))]
    ]
    # The chords of a thin polygon may cross.
    return Drawn(shapely.union_all(shapely.make_valid(polygons)), False)


def negative_pair(
    border: Border,
    accuracy: float,
    *,
    also: Border | None = None,
    margin: float = ROUND_OFF,
    around: BaseGeometry = SQUARE,
) -> Pair:
    """Return where h of a border is certainly negative around a shape, and where it may be.

    Both keep `margin` from straight borders, `accuracy` / 2 from others [rad].
    """
    room = 2 * accuracy
    left, bottom, right, top = around.bounds
    drawn = where_negative(
        border,
        chord_tolerance(accuracy),
        also=also,
        bounds=(left - room, bottom - room, right + room, top + room),
    )
    reach = margin if drawn.is_straight else max(margin, accuracy / 2)
    return offsets(drawn.shape, reach)


def cut(pair: Pair, border: Border, accuracy: float) -> Pair:
    """Return the parts of a pair where h of a border is not negative."""
    if pair[1].is_empty:
        return pair
    negative = negative_pair(border, accuracy, around=pair[1])
    return np.asarray(shapely.difference(pair, negative[::-1]))


def _limits(breaks: FloatArray, low: float = -_END, high: float = _END) -> FloatArray:
    """Return the ends of the intervals of a range between angles in [−π, π], in order."""
    low, high = max(low, -_END), min(high, _END)
    inside = np.sort(breaks[(low < breaks) & (breaks < high)])
    limits = np.concatenate([[low], inside, [high]])
    kept = np.append(np.diff(limits) > ROUND_OFF, True)
    kept[0] = True
    return np.asarray(limits[kept])


def _phasors(values: FloatArray) -> Phasors:
    """Return the Fourier coefficients of values at the points of the grid, shape (8, 8)."""
    grid = values.reshape(_SAMPLES, _SAMPLES)
    return np.asarray(np.fft.fft2(grid) / _SAMPLES**2)


def zeros_of(samples: FloatArray) -> FloatArray:
    """Return where a trigonometric polynomial may vanish in [−π, π]: of degree n for 4n samples of a turn, from 0 on.

    They are roots on the unit circle, or nearly on it, so that rounding loses no double zero.
    """
    # Twice as many samples as needed determine its Fourier coefficients; times zⁿ, z = exp(ix), it is a polynomial.
    degree = len(samples) // 4
    parts = np.fft.fft(samples)
    polynomial = parts[np.arange(degree, -degree - 1, -1)]
    polynomial[np.abs(polynomial) <= 1e-15 * np.abs(polynomial).max()] = 0.0
    roots = np.roots(polynomial)
    return np.asarray(np.angle(roots[np.abs(np.abs(roots) - 1.0) < _ON_CIRCLE]))
