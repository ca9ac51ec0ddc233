r"""Curved borders in the (α1, α2) plane as polygons that are certified to follow them, and the sets that they bound.

A border is where h = P² + Q vanishes, P and Q sums of cosines of linear functions of the two coordinates
(:class:`CosineSum`). Where it is also an explicit function of one coordinate it is sampled there, and every chord is
certified: across a rectangle around the chord the slope of h does not vanish,

    |∂h/∂n| ≥ m > 0,

so inside it the border is one graph over the chord, through both of its ends; and on a chord of length ℓ, with
|∂²h/∂t²| ≤ M, |h| ≤ e + M·ℓ²/8 where e is what is left of h at the ends. So the border is nowhere farther from the
chord than (e + M·ℓ²/8)/m. Chords for which that is too much are divided.

On the red sheet of a symmetric vehicle every condition is, for fixed α1, of degree one or two in u2 = (cos α2, sin α2), so
its border is an explicit function of α1 (docs/theory.md, 17):

* R is a constant times the determinants of two 2×2 blocks, each a form u1ᵀ·B·u2, which vanishes at one α2 modulo π;
* the squares of the singular values of a block have the product det² and the sum F of its squared entries. With
  g = floor²/2 both are at least g exactly where h = det² − gF + g² ≥ 0 and F ≥ 2g. On F = 2g, h = det² − F²/4 ≤ 0: so
  F is compared once a part. h is uᵀ·S·u with S a function of α1, and so is |R| above a level;
* the share of a pair of rotors in hover is above a limit where a product of a vector, a function of α1, with u2 is positive.

Each function of a set returns its polygons (:class:`Drawn`), whose sides are nowhere farther than `tolerance` [rad] from
its border inside [−π/2, π/2]²; beyond the square they end anywhere.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import groupby, pairwise
from operator import attrgetter
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt
import shapely

from gaitgraph.angles import HALF_PI
from gaitgraph.invertibility.forms import FloatArray
from gaitgraph.surface.blocks import directions
from gaitgraph.tolerances import ROUND_OFF

if TYPE_CHECKING:
    from shapely import Polygon
    from shapely.geometry.base import BaseGeometry

    from gaitgraph.invertibility.forms import Form
    from gaitgraph.surface.blocks import Block

Function = Callable[[FloatArray], FloatArray]
Condition = Callable[[FloatArray, FloatArray], npt.NDArray[np.bool_]]

_CHORDS = 8  # with which a curved edge is first tried
_MOST_ROUNDS = 40  # of dividing chords
_NARROW = 1e-3  # of the tolerance
_ON_CIRCLE = 1e-4  # how far from the unit circle a root may be that counts as on it
_RANK_ONE = 1e-13  # relative: below it a second singular value is rounding
_FULL = 2 * math.pi
# Beyond the square, so that its sides are no sides of the sets' polygons.
_END = HALF_PI + 0.3
# Ordinates that no curve crosses between two breaks.
_BREAKING = np.array([0.0, HALF_PI, -_END, _END])


@dataclass(frozen=True, slots=True, eq=False)
class CosineSum:
    """A sum of cosines, Σ size·cos(x·first + y·second − phase), a row (size, first, second, phase) of `terms` each."""

    terms: FloatArray

    def __add__(self, other: CosineSum | float) -> CosineSum:
        if isinstance(other, CosineSum):
            rest = other.terms
        else:
            rest = np.array([[other, 0.0, 0.0, 0.0]])
        return CosineSum(np.vstack([self.terms, rest]))

    def __mul__(self, other: CosineSum) -> CosineSum:
        one = np.repeat(self.terms, len(other.terms), axis=0)
        two = np.tile(other.terms, (len(self.terms), 1))
        size = one[:, :1] * two[:, :1] / 2
        parts = [
            np.hstack([size, one[:, 1:] + two[:, 1:]]),
            np.hstack([size, one[:, 1:] - two[:, 1:]]),
        ]
        return CosineSum(np.vstack(parts))

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
        return float(
            np.sum(
                np.abs(self.terms[:, 0])
                * np.hypot(self.terms[:, 1], self.terms[:, 2]) ** order
            )
        )


def cosine(
    first: float, second: float, phase: float = 0.0, size: float = 1.0
) -> CosineSum:
    """Return size·cos(first·x + second·y − phase); a sine has the phase π/2."""
    return CosineSum(np.array([[size, first, second, phase]]))


@dataclass(frozen=True, slots=True)
class Border:
    """Where h = squared² + rest vanishes, P² + Q.

    They are kept apart because along a border with small Q both P and its slope along the border are small, so that
    much longer chords can be certified than from bounds of h as a whole.
    """

    rest: CosineSum
    squared: CosineSum = CosineSum(np.zeros((1, 4)))

    def at(self, points: FloatArray) -> FloatArray:
        """Return h at points of shape (m, 2)."""
        return np.asarray(self.squared.at(points) ** 2 + self.rest.at(points))

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
        p_most2, p_most3, q_most2, q_most3 = (
            w.most(k) for w in (self.squared, self.rest) for k in (2, 3)
        )
        # The largest |P| and slopes of P on the rectangle: from their values in its middle, by Taylor's theorem.
        most_along = np.abs(p_along) + p_most2 * (half + reach)
        most_across = np.abs(p_across) + p_most2 * (half + reach)
        most = np.abs(p) + most_along * half + most_across * reach
        # m: |∂h/∂n| = |2P·∂P/∂n + ∂Q/∂n| in the middle, less what the second derivatives of h can take off it.
        common = 2 * most * p_most2 + q_most2
        slope = np.abs(2 * p * p_across + q_across)
        slope = (
            slope
            - (2 * most_along * most_across + common) * half
            - (2 * most_across**2 + common) * reach
        )
        # M: |∂²h/∂t²| = |2(∂P/∂t)² + 2P·∂²P/∂t² + ∂²Q/∂t²| in the middle, and what the third derivatives can add.
        bend = np.abs(2 * p_along**2 + 2 * p * p_bend + q_bend)
        bend = bend + half * (6 * most_along * p_most2 + 2 * most * p_most3 + q_most3)
        # e: what is left of h at the ends; then the bound of the module's docstring.
        left = (
            np.abs(self.at(np.concatenate([starts, ends]))).reshape(2, -1).max(axis=0)
        )
        with np.errstate(divide="ignore", invalid="ignore"):
            bound = (left + bend * length**2 / 8) / slope
        return np.asarray(np.where((slope > 0) & (bound <= reach), bound, np.inf))


class Edge(NamedTuple):
    """A side of polygons over an interval of α1, with its ordinate in the middle [rad].

    It is straight if `row` is None, else the part of a row of the curves that is near the ordinate.
    """

    low: float
    high: float
    ordinate: float
    row: int | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Drawn:
    """A set as polygons, which end anywhere beyond the square, and whether all of its border is straight."""

    shape: BaseGeometry
    is_straight: bool

    def transposed(self) -> Drawn:
        """Return the set with α1 and α2 in each other's place."""
        turned = shapely.transform(self.shape, lambda at: at[:, ::-1])
        return Drawn(turned, self.is_straight)


@dataclass(frozen=True, slots=True, eq=False)
class Curves:
    """Curves on which a condition changes: α2, modulo π, as functions of α1.

    `rows` maps α1 of shape (k,) to a row for each curve, shape (n, k). They exist where `exist` is true. `border`
    vanishes on all of them. Beside them there are straight `lines` of α2.
    """

    rows: Function | None = None
    border: Border | None = None
    exist: Callable[[FloatArray], npt.NDArray[np.bool_]] | None = None
    lines: Sequence[float] = ()

    def edges_over(self, intervals: Sequence[tuple[float, float]]) -> list[Edge]:
        """Return all edges over one interval of α1 after the other, from below to above."""
        middles = np.array(intervals).mean(axis=1)
        ordinates = np.empty((0, len(middles)))
        if self.rows is not None:
            ordinates = self.rows(middles)
        if self.exist is not None:
            ordinates = np.where(self.exist(middles), ordinates, np.nan)
        straight = [-_END, *_copies(self.lines), _END]
        edges: list[Edge] = []
        for (low, high), rows in zip(intervals, ordinates.T, strict=True):
            here = [Edge(low, high, ordinate) for ordinate in straight]
            for row, angle in enumerate(rows.tolist()):
                here += [Edge(low, high, copy, row) for copy in _copies([angle])]
            edges += sorted(here, key=attrgetter("ordinate"))
        return edges

    def points_on(
        self, edges: Sequence[Edge], number: npt.NDArray[np.int64], x: FloatArray
    ) -> FloatArray:
        """Return the points at x on the edges of some numbers, both of shape (k,), as an array of shape (k, 2)."""
        y = np.array([edge.ordinate for edge in edges])[number]
        row = np.array([-1 if edge.row is None else edge.row for edge in edges])[number]
        curved = np.flatnonzero(row >= 0)
        if self.rows is not None and curved.size:
            angle = self.rows(x[curved])[row[curved], np.arange(curved.size)]
            # Over its interval an edge crosses no multiple of π/2.
            center = (np.floor(y[curved] / HALF_PI) + 0.5) * HALF_PI
            angle -= math.pi * np.rint((angle - center) / math.pi)
            # At the ends of an interval rounding alone can take it out of the surroundings.
            y[curved] = np.clip(angle, -_END, _END)
        return np.column_stack([x, y])

    def traces(self, edges: Sequence[Edge], tolerance: float) -> list[FloatArray]:
        """Return the points of a polyline that follows each edge, shape (m, 2); all edges are traced at once."""
        low, high = np.array([(edge.low, edge.high) for edge in edges]).T
        is_straight = np.array([edge.row is None for edge in edges])
        ends, places = np.array([0.0, math.pi]), np.linspace(0.0, math.pi, _CHORDS + 1)
        first_places = [ends if edge.row is None else places for edge in edges]
        number = np.repeat(np.arange(len(edges)), list(map(len, first_places)))
        theta = np.concatenate(first_places)
        settled = is_straight[number[1:]] | (number[1:] != number[:-1])
        for _ in range(_MOST_ROUNDS):
            # Dense at both ends, where an explicit border may rise like a square root.
            first, last = low[number], high[number]
            x = (first + last) / 2 - (last - first) / 2 * np.cos(theta)
            x = np.where(theta <= 0, first, np.where(theta >= math.pi, last, x))
            points = self.points_on(edges, number, x)
            parts = np.ones(len(settled), dtype=int)
            if self.border is not None:
                starts, ends = points[:-1][~settled], points[1:][~settled]
                parts[~settled] = _parts_of(self.border, starts, ends, tolerance)
            if parts.max() == 1:
                break
            last = np.append(0, np.cumsum(parts))
            theta = np.interp(np.arange(last[-1] + 1), last, theta)
            number = np.append(np.repeat(number[:-1], parts), number[-1])
            settled = np.repeat(parts == 1, parts)
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


def _copies(angles: Iterable[float]) -> list[float]:
    """Return all angles in the surroundings of the square that equal some angles modulo π, sorted; none for NaN."""
    copies = {angle + turns * math.pi for angle in angles for turns in range(-2, 3)}
    return sorted(angle for angle in copies if abs(angle) < _END)


def _where(
    holds: Condition,
    curves: Curves,
    breaks: Sequence[npt.ArrayLike],
    tolerance: float,
    window: tuple[float, float] = (-_END, _END),
) -> Drawn:
    """Return where a condition on (α1, α2), both of shape (k,), holds in a window of α1.

    For a fixed α1 it changes at the curves and the lines alone, both α2 modulo π. Between two `breaks`, modulo π, none of
    them meets another, crosses a multiple of π/2 or an end of the surroundings of the square, or ceases to exist.
    """
    low, high = window
    inside = _copies(np.concatenate([np.ravel(part) for part in breaks]).tolist())
    limits = np.array([low, *(x for x in inside if low < x < high), high])
    kept = np.append(True, np.diff(limits) > ROUND_OFF)
    kept[-1] = True
    edges = curves.edges_over(list(pairwise(limits[kept].tolist())))

    # Of each two edges that follow each other over one interval: does the condition hold between them?
    gaps = [k for k, (one, two) in enumerate(pairwise(edges)) if one.low == two.low]
    middle = np.array([(edges[k].low + edges[k].high) / 2 for k in gaps])
    between = [(edges[k].ordinate + edges[k + 1].ordinate) / 2 for k in gaps]
    held = dict(zip(gaps, holds(middle, np.array(between)).tolist(), strict=True))

    # Each run of gaps over one interval in which it holds is one polygon.
    traces = curves.traces(edges, tolerance)
    polygons = []
    for (_, is_held), run in groupby(gaps, key=lambda k: (edges[k].low, held[k])):
        if not is_held:
            continue
        numbers = list(run)
        below, above = numbers[0], numbers[-1] + 1
        polygon = _polygon_between(traces[below], traces[above])
        if not polygon.is_valid:
            # The chords of a thin polygon may cross, unless both sides have the same abscissae.
            x = np.union1d(traces[below][:, 0], traces[above][:, 0])
            sides = [
                curves.points_on(edges, np.full(len(x), side), x)
                for side in (below, above)
            ]
            polygon = _polygon_between(*sides).buffer(0.0)
        polygons.append(polygon)
    return Drawn(shapely.union_all(polygons), curves.rows is None)


def _polygon_between(below: FloatArray, above: FloatArray) -> Polygon:
    return shapely.Polygon(np.concatenate([below, above[::-1]]))


def zeros_of_degree_two(function: Function, period: float) -> FloatArray:
    """Return where a trigonometric polynomial of degree two may vanish on [−period/2, period/2), sorted."""
    return _zeros_of_degree(2, function, period)


def _zeros_of_degree(degree: int, function: Function, period: float) -> FloatArray:
    """Return where a trigonometric polynomial may vanish on [−period/2, period/2), sorted.

    They are roots on the unit circle, or nearly on it, so that rounding loses no double zero.
    """
    # 4n samples determine the 2n + 1 Fourier coefficients; times zⁿ, z = exp(2πix/period), they are a polynomial.
    count = 4 * degree
    at = np.linspace(0.0, period, count, endpoint=False)
    parts = np.fft.fft(function(at)) / count
    polynomial = np.asarray(parts[np.arange(degree, -degree - 1, -1)], dtype=complex)
    polynomial[np.abs(polynomial) <= 1e-15 * np.abs(polynomial).max()] = 0.0
    roots = np.roots(polynomial)
    roots = roots[np.abs(np.abs(roots) - 1.0) < _ON_CIRCLE]
    return np.sort(np.angle(roots)) * period / (2 * math.pi)


def _wave(first: float, second: float, even: float, odd: float) -> CosineSum:
    """Return even·cos(t) + odd·sin(t), t = first·x + second·y."""
    return cosine(first, second, math.atan2(odd, even), math.hypot(odd, even))


def _bilinear(form: FloatArray) -> CosineSum:
    """Return the form u1ᵀ·form·u2."""
    (cc, cs), (sc, ss) = form / 2
    return _wave(1, 1, cc - ss, cs + sc) + _wave(1, -1, cc + ss, sc - cs)


def _quadratic(matrix: FloatArray, first: float, second: float) -> CosineSum:
    """Return uᵀ·matrix·u for a symmetric matrix, of u1 if (first, second) is (2, 0), of u2 if it is (0, 2)."""
    (cc, cs), (_, ss) = matrix
    return _wave(first, second, (cc - ss) / 2, cs) + float(cc + ss) / 2


class Matrices(NamedTuple):
    """Symmetric 2×2 matrices [[cc, cs], [cs, ss]] for several angles, and cs² − cc·ss without its cancellation."""

    cc: FloatArray
    cs: FloatArray
    ss: FloatArray
    discriminant: FloatArray

    def zeros(self) -> FloatArray:
        """Return both angles, modulo π, at which uᵀ·matrix·u vanishes, shape (2, ...)."""
        mean, even = (self.cc + self.ss) / 2, (self.cc - self.ss) / 2
        half = np.arctan2(np.sqrt(np.maximum(self.discriminant, 0.0)), -mean)
        middle = np.arctan2(self.cs, even)
        return np.array([middle - half, middle + half]) / 2


def _zeros_of_form(form: FloatArray, alpha: FloatArray) -> FloatArray:
    """Return the angles of u2, modulo π, at which u1ᵀ·form·u2 vanishes for u1 at `alpha`."""
    across = form.T @ directions(alpha)
    return np.asarray(np.arctan2(-across[0], across[1]))


def _product(form: FloatArray, x: FloatArray, y: FloatArray) -> FloatArray:
    """Return u1ᵀ·form·u2 at angles of the same shape."""
    return np.asarray(np.sum(directions(x) * (form @ directions(y)), axis=0))


def determinant_negative(block: Block, tolerance: float) -> Drawn:
    """Return where the determinant of a block is negative."""
    form = block.form

    def rows(x: FloatArray) -> FloatArray:
        return _zeros_of_form(form, x)[None]

    curves = Curves(rows, Border(_bilinear(form)))
    if block.is_product:
        curves = Curves(lines=rows(np.zeros(1))[0].tolist())
    breaks = _zeros_of_form(form.T, _BREAKING)
    return _where(lambda x, y: _product(form, x, y) < 0, curves, [breaks], tolerance)


def singular_value_below(floor: float, block: Block, tolerance: float) -> Drawn:
    """Return where the lesser singular value of a block, times √2, is below a positive floor.

    Around the curve where its determinant vanishes this is a band, as narrow as the floor.
    """
    g, form = floor**2 / 2, block.form
    grams = block.first.T @ block.first, block.second.T @ block.second

    def matrices(
        form: FloatArray, own: FloatArray, other: FloatArray
    ) -> Callable[[FloatArray], Matrices]:
        def at(alpha: FloatArray) -> Matrices:
            # h = (across·u)² + g·uᵀ·(rest − other)·u of the other pair
            first, second = form.T @ directions(alpha)
            rest = g - _product(own, alpha, alpha)
            cc, cs, ss = rest - other[0, 0], -other[0, 1], rest - other[1, 1]
            turned = cc * second**2 - 2 * cs * first * second + ss * first**2
            return Matrices(
                first**2 + g * cc,
                first * second + g * cs,
                second**2 + g * ss,
                -g * (turned + g * (cc * ss - cs**2)),
            )

        return at

    def holds(x: FloatArray, y: FloatArray) -> npt.NDArray[np.bool_]:
        squares = _product(grams[0], x, x) + _product(grams[1], y, y)
        height = _product(form, x, y) ** 2 - g * squares + g**2
        return (height < 0) | (squares < 2 * g)

    if block.has_orthogonal_columns:
        breaks, lines = (
            Matrices(
                gram[0, 0] - g, gram[0, 1], gram[1, 1] - g, g * (np.trace(gram) - g)
            ).zeros()
            for gram in grams
        )
        return _where(holds, Curves(lines=lines.tolist()), [breaks], tolerance)
    of_second, of_first = matrices(form, *grams), matrices(form.T, *grams[::-1])

    def discriminant(x: FloatArray) -> FloatArray:
        return of_second(x).discriminant

    squares = _quadratic(-g * grams[0], 2, 0) + _quadratic(-g * grams[1], 0, 2)
    curves = Curves(
        lambda x: of_second(x).zeros(),
        Border(squares + g**2, _bilinear(form)),
        lambda x: discriminant(x) > 0,
    )
    turning = zeros_of_degree_two(discriminant, math.pi)
    # not much above the width of the band
    narrow = min(tolerance, floor / 16 / max(1.0, float(np.linalg.norm(form, 2))))
    return _where(holds, curves, [turning, of_first(_BREAKING).zeros()], narrow)


def sum_on_plane(
    form: Form,
    offsets: FloatArray,
    factor: float,
    *,
    slope: float = 1.0,
    transposed: bool = False,
) -> CosineSum:
    """Return the last of some forms, times a factor, at α = (α1, α2, slope·α1, slope·α2) + offsets, shape (4,) [rad].

    The slope is 1 on red, and −1 on blue. Transposed, α1 and α2 are in each other's place.
    """
    frequencies, phasors = form.phasors()
    shifted = factor * phasors[:, -1] * np.exp(1j * (frequencies @ offsets))
    turns = frequencies[:, :2] + slope * frequencies[:, 2:]
    if transposed:
        turns = turns[:, ::-1]
    # Several sinusoids of four angles are one of two, also those that turn the other way.
    backward = (turns[:, 0] < 0) | ((turns[:, 0] == 0) & (turns[:, 1] < 0))
    turns[backward] *= -1
    shifted[backward] = shifted[backward].conj()
    common, which = np.unique(turns, axis=0, return_inverse=True)
    merged = np.zeros(len(common), dtype=complex)
    np.add.at(merged, which.ravel(), shifted)
    return CosineSum(np.column_stack([np.abs(merged), common, -np.angle(merged)]))


def sum_negative(
    form: CosineSum, tolerance: float, window: tuple[float, float] = (-_END, _END)
) -> Drawn:
    """Return where a sum of cosines is negative that is quadratic in u2, and in u1 of degree two or less.

    The polygons cover a window of α1 alone.
    """

    def at(x: FloatArray, y: FloatArray) -> FloatArray:
        return form.at(np.column_stack([x, y]))

    def matrices(x: FloatArray) -> Matrices:
        cc, middle, ss = (
            at(x, np.full(len(x), angle)) for angle in (0.0, HALF_PI / 2, HALF_PI)
        )
        cs = middle - (cc + ss) / 2
        return Matrices(cc, cs, ss, cs**2 - cc * ss)

    def holds(x: FloatArray, y: FloatArray) -> npt.NDArray[np.bool_]:
        return at(x, y) < 0

    # A product of a function of α1 and one of α2 vanishes on straight lines.
    sampled = np.array(matrices(np.linspace(0.0, _FULL, 8, endpoint=False))[:3])
    entries, sizes, _ = np.linalg.svd(sampled)
    if sizes[1] <= _RANK_ONE * sizes[0]:
        cc, cs, ss = entries[:, :1]
        common = Matrices(cc, cs, ss, cs**2 - cc * ss)
        lines: list[float] = []
        if common.discriminant[0] > 0:
            lines = common.zeros().ravel().tolist()

        def factor(x: FloatArray) -> FloatArray:
            return np.asarray(entries[:, 0] @ np.array(matrices(x)[:3]))

        breaks = [_zeros_of_degree(2, factor, _FULL)]
        return _where(holds, Curves(lines=lines), breaks, tolerance, window)

    def discriminant(x: FloatArray) -> FloatArray:
        return matrices(x).discriminant

    def crossing(y: float) -> FloatArray:
        return _zeros_of_degree(2, lambda x: at(x, np.full(len(x), y)), _FULL)

    curves = Curves(
        lambda x: matrices(x).zeros(), Border(form), lambda x: discriminant(x) > 0
    )
    breaks = [_zeros_of_degree(4, discriminant, _FULL)]
    breaks += map(crossing, _BREAKING.tolist())
    return _where(holds, curves, breaks, tolerance, window)


def product_below(
    level: float, first: FloatArray, second: FloatArray, tolerance: float
) -> Drawn:
    """Return where (u1ᵀ·first·u2)·(u1ᵀ·second·u2) is below a level."""
    product = _bilinear(first) * _bilinear(second)
    return sum_negative(product + -level, tolerance)


def _first_product(across: Function, u2: FloatArray, x: FloatArray) -> FloatArray:
    return np.asarray(u2 @ across(x))


def thrust_above(
    share: float, own: FloatArray, other: FloatArray, tolerance: float
) -> Drawn:
    """Return where all hover thrusts are positive and those of rotors 1 and 3 are more than a share of the weight.

    Rotors 1 and 2 have the yaw torques own·u1 and other·u2. The share of rotor 1 is half of other·u2 / (other·u2·cos α1 +
    own·u1·cos α2), and thrusts are positive where both torques have one sign (docs/theory.md, 11).
    """

    def across(x: FloatArray) -> FloatArray:
        # of (1 − 2s·cos α1)·other·u2 − 2s·own·u1·cos α2, a product with u2
        lever = np.outer(other, 1 - 2 * share * np.cos(x))
        lever[0] -= 2 * share * (own @ directions(x))
        return lever

    def rows(x: FloatArray) -> FloatArray:
        lever = across(x)
        return np.arctan2(-lever[:1], lever[1:])

    def holds(x: FloatArray, y: FloatArray) -> npt.NDArray[np.bool_]:
        u2 = directions(y)
        torque = other @ u2
        excess = np.sum(u2 * across(x), axis=0)
        upward = torque * (own @ directions(x)) > 0
        return np.asarray(upward & (torque * excess > 0))

    lift = np.array([1.0, 0.0])
    vanishing = _bilinear(-2 * share * (np.outer(lift, other) + np.outer(own, lift)))
    vanishing += _wave(0, 1, *other)
    crossing = [
        zeros_of_degree_two(partial(_first_product, across, u2), _FULL)
        for u2 in directions(_BREAKING).T
    ]
    free, idle = (math.atan2(-torque[0], torque[1]) for torque in (own, other))
    curves = Curves(rows, Border(vanishing), lines=[idle])
    return _where(holds, curves, [*crossing, [free]], tolerance)
