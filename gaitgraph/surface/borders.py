r"""Curved borders in the (α1, α2) plane as polygons that are certified to follow them, and the sets that they bound.

A border is where h = P² + Q vanishes, P and Q sums of cosines of linear functions of the two coordinates
(:class:`CosineSum`). Where it is also an explicit function of one coordinate it is sampled there, and every chord is
certified: across a rectangle around the chord the slope of h does not vanish,

    |∂h/∂n| ≥ m > 0,

so inside it the border is one graph over the chord, through both of its ends; and on a chord of length ℓ, with
|∂²h/∂t²| ≤ M, |h| ≤ e + M·ℓ²/8 where e is what is left of h at the ends. So the border is nowhere farther from the
chord than (e + M·ℓ²/8)/m. Chords for which that is too much are divided.

On the red sheet of a symmetric vehicle every condition is, for fixed α1, of degree one or two in u2 = (cos α2, sin α2), so
its border is an explicit function of α1 (docs/theory.md, 18):

* R is a constant times the determinants of two 2×2 blocks, each a form u1ᵀ·B·u2, which vanishes at one α2 modulo π;
* the squares of the singular values of a block have the product det² and the sum F of its squared entries. With
  g = floor²/2 both are at least g exactly where h = det² − gF + g² ≥ 0 and F ≥ 2g. On F = 2g, h = det² − F²/4 ≤ 0: so
  F is compared once a part. h is uᵀ·S·u with S a function of α1, and so is |R| above a level;
* the share of a pair of rotors in hover is above a limit where a product of a vector, a function of α1, with u2 is positive.

Each function of a set returns polygons whose sides are nowhere farther than `tolerance` [rad] from its border, inside
[−π/2, π/2]²; beyond the square they end anywhere.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import groupby, pairwise
from operator import itemgetter
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import shapely

from gaitgraph.angles import HALF_PI, wrapped
from gaitgraph.invertibility.forms import FloatArray, Sines
from gaitgraph.surface.blocks import directions
from gaitgraph.tolerances import ROUND_OFF

if TYPE_CHECKING:
    from shapely import Polygon
    from shapely.geometry.base import BaseGeometry

    from gaitgraph.invertibility.coefficients import Coefficients
    from gaitgraph.surface.blocks import Block

Function = Callable[[FloatArray], FloatArray]

_FIRST_CHORDS = 8
_MOST_ROUNDS = 40  # of dividing chords
_NARROW = 1e-3  # of the tolerance
_ON_CIRCLE = 1e-4  # how far from the unit circle a root may be that counts as on it
_FAR = 20.0  # farther than any root
_FULL = 2 * math.pi
_END = (
    HALF_PI + 0.3
)  # beyond the square, so that its sides are no sides of the sets' polygons
_BREAKING = np.array(
    [0.0, HALF_PI, -_END, _END]
)  # ordinates that no root crosses inside a band


@dataclass(frozen=True, slots=True, eq=False)
class CosineSum:
    """A sum of cosines, Σ size·cos(x·first + y·second − phase), a row (size, first, second, phase) of `terms` each."""

    terms: FloatArray

    def __add__(self, other: CosineSum | float) -> CosineSum:
        rest = (
            other.terms
            if isinstance(other, CosineSum)
            else np.array([[other, 0.0, 0.0, 0.0]])
        )
        return CosineSum(np.vstack([self.terms, rest]))

    def __mul__(self, other: CosineSum) -> CosineSum:
        one, two = (
            np.repeat(self.terms, len(other.terms), axis=0),
            np.tile(other.terms, (len(self.terms), 1)),
        )
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


Root = tuple[Function, "Border | None"]  # ordinates, and None if they are on a line
Edge = tuple[
    float, Function, "Border | None"
]  # of a band: w in its middle, and its ordinates


def zeros_of_degree_two(function: Function, period: float) -> FloatArray:
    """Return where a trigonometric polynomial of degree two may vanish on [−period/2, period/2), sorted.

    They are roots on the unit circle, or nearly on it, so that rounding loses no double zero.
    """
    # Eight samples determine the five Fourier coefficients; times z², z = exp(2πix/period), they are a quartic.
    parts = np.fft.fft(function(np.linspace(0.0, period, 8, endpoint=False))) / 8
    polynomial = np.asarray(parts[[2, 1, 0, -1, -2]], dtype=complex)
    polynomial[np.abs(polynomial) <= 1e-15 * np.abs(polynomial).max()] = 0.0
    roots = np.roots(polynomial)
    roots = roots[np.abs(np.abs(roots) - 1.0) < _ON_CIRCLE]
    return np.sort(np.angle(roots)) * period / (2 * math.pi)


def _abscissae(
    low: float, high: float, function: Function, border: Border | None, tolerance: float
) -> FloatArray:
    """Return abscissae on an interval such that the chords between a function's values there follow the border."""
    if border is None:
        return np.array([low, high])

    def at(theta: FloatArray) -> FloatArray:
        # Dense at both ends, where an explicit border may rise like a square root.
        x = (low + high) / 2 - (high - low) / 2 * np.cos(theta)
        return np.where(theta <= 0, low, np.where(theta >= math.pi, high, x))

    theta, settled = (
        np.linspace(0.0, math.pi, _FIRST_CHORDS + 1),
        np.zeros(_FIRST_CHORDS, dtype=bool),
    )
    for _ in range(_MOST_ROUNDS):
        points = np.column_stack([at(theta), function(at(theta))])
        first, second = points[:-1][~settled], points[1:][~settled]
        bound = border.deviation(
            first, second, 2 * tolerance
        )  # infinite where nothing can be certified
        # A chord shorter than the tolerance is as good as the border; so is one across a strip that is much narrower,
        # beside an abscissa at which h vanishes whatever the ordinate.
        across = np.abs(second - first)
        bound[np.hypot(*across.T) < tolerance / 2] = 0.0
        bound[across[:, 0] < _NARROW * tolerance] = 0.0
        # The bound falls with the square of a chord's length; without a bound a chord is cut into four.
        parts = np.ones(len(settled), dtype=int)
        parts[~settled] = np.where(
            np.isfinite(bound),
            np.maximum(np.ceil(np.sqrt(bound / tolerance)), 1.0),
            4.0,
        )
        if parts.max() == 1:
            break
        theta = np.interp(
            np.arange(parts.sum() + 1), np.append(0, np.cumsum(parts)), theta
        )
        settled = np.repeat(parts == 1, parts)
    return at(theta)


def bands_between(
    breaks: FloatArray,
    roots: Callable[[FloatArray], Sequence[Root]],
    holds: Callable[[FloatArray, float], Any],
    tolerance: float,
    *,
    ends: tuple[float, float] = (-_FAR, _FAR),
    ordinate: Function = np.asarray,
) -> BaseGeometry:
    """Return where a condition holds, as polygons whose borders follow the true ones.

    For every abscissa x the condition, which `holds` evaluates at (x, w) for x of shape (1,), changes only at a few
    values of w within `ends`, functions of x. Between the sorted abscissae `breaks` no root enters or leaves that range,
    meets another, or ceases to exist; `roots` returns those between the breaks around an x, each with the border that
    vanishes on it. `ordinate` gives the second coordinate for w, a monotone function. Borders may be `tolerance` from
    the sides of the polygons.
    """

    def straight(w: float) -> Edge:
        return w, lambda x: ordinate(np.full(x.shape, w)), None

    def edge(w: float, root: Function, border: Border | None) -> Edge:
        # At the ends of an interval rounding alone can take a root out of the range.
        return w, lambda x: ordinate(np.clip(root(x), *ends)), border

    def band(low: float, high: float, sides: tuple[Edge, Edge]) -> Polygon:
        def between(below: FloatArray, above: FloatArray) -> Polygon:
            (_, lower, _), (_, upper, _) = sides
            ring = np.vstack(
                [
                    np.column_stack([below, lower(below)]),
                    np.column_stack([above, upper(above)])[::-1],
                ]
            )
            ring = ring[np.any(ring != np.roll(ring, 1, axis=0), axis=1)]
            return shapely.Polygon(ring if len(ring) > 2 else None)

        below, above = (
            _abscissae(low, high, function, line, tolerance)
            for _, function, line in sides
        )
        polygon = between(below, above)
        if polygon.is_valid:
            return polygon
        # The chords of a thin band may cross, unless both sides have the same abscissae.
        common = np.union1d(below, above)
        return between(common, common).buffer(0.0)

    kept = np.concatenate([[True], np.diff(breaks) > ROUND_OFF])
    kept[-1] = True
    polygons = []
    for low, high in pairwise(breaks[kept].tolist()):
        middle = np.array([(low + high) / 2])
        here = [
            (float(root(middle)[0]), root, border) for root, border in roots(middle)
        ]
        here.sort(key=itemgetter(0))
        edges = [edge(*found) for found in here if ends[0] < found[0] < ends[1]]
        edges = [straight(ends[0]), *edges, straight(ends[1])]
        inside = [bool(holds(middle, (a[0] + b[0]) / 2)) for a, b in pairwise(edges)]
        # Each run of intervals in which the condition holds is one polygon.
        for held, run in groupby(range(len(inside)), key=inside.__getitem__):
            if held:
                numbers = list(run)
                polygons.append(
                    band(low, high, (edges[numbers[0]], edges[numbers[-1] + 1]))
                )
    return shapely.union_all(polygons)


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

    def zeros(self, side: int) -> FloatArray:
        """Return the angles, modulo π, at which uᵀ·matrix·u vanishes, on one side of that between the two."""
        mean, even = (self.cc + self.ss) / 2, (self.cc - self.ss) / 2
        half = np.arctan2(np.sqrt(np.maximum(self.discriminant, 0.0)), -mean)
        return np.asarray((np.arctan2(self.cs, even) + side * half) / 2)


def _line(ordinate: float) -> Root:
    return lambda x: np.full(x.shape, ordinate), None


def _zeros_of_form(form: FloatArray, alpha: FloatArray) -> FloatArray:
    """Return the angles of u2, modulo π, at which u1ᵀ·form·u2 vanishes for u1 at `alpha`."""
    across = form.T @ directions(alpha)
    return np.asarray(np.arctan2(-across[0], across[1]))


def _where(
    holds: Callable[[FloatArray, float], Any],
    zeros_at: Callable[[FloatArray], Sequence[Root]],
    breaks: Sequence[FloatArray],
    tolerance: float,
) -> BaseGeometry:
    """Return where a condition on (α1, α2) holds.

    For α1 in a band around `middle` it changes only at `zeros_at(middle)`, functions of α1 that are α2 modulo π, with
    their borders. None of them crosses a multiple of π/2 or an end of the surroundings of the square between two
    `breaks`, modulo π.
    """

    def roots(middle: FloatArray) -> list[Root]:
        found: list[Root] = []
        for zero, border in zeros_at(middle):
            ordinates = float(zero(middle)[0]) + math.pi * np.arange(-2, 3)
            for ordinate in ordinates[np.abs(ordinates) < _END]:
                center = (math.floor(ordinate / HALF_PI) + 0.5) * HALF_PI
                found.append((partial(_nearest, zero, center), border))
        return found

    angles = np.concatenate([np.ravel(part) for part in breaks])
    angles = (wrapped(angles) + math.pi * np.arange(-1, 2)[:, None]).ravel()
    inside = np.unique(angles[np.abs(angles) < _END])
    limits = np.concatenate([[-_END], inside, [_END]])
    return bands_between(limits, roots, holds, tolerance, ends=(-_END, _END))


def _nearest(angle: Function, center: float, x: FloatArray) -> FloatArray:
    """Return the values of a function modulo π that are nearest to `center`."""
    ordinate = angle(x)
    return np.asarray(ordinate - math.pi * np.rint((ordinate - center) / math.pi))


def determinant_negative(block: Block, tolerance: float) -> BaseGeometry:
    """Return where the determinant of a block is negative."""
    form = block.form

    def holds(x: FloatArray, y: float) -> Any:
        return directions(x)[:, 0] @ form @ directions(y) < 0

    breaks = _zeros_of_form(form.T, _BREAKING)
    zero = partial(_zeros_of_form, form)
    if block.is_product:
        return _where(holds, lambda x: [_line(float(zero(x)[0]))], [breaks], tolerance)
    border = Border(_bilinear(form))
    return _where(holds, lambda _: [(zero, border)], [breaks], tolerance)


def _where_quadratic(
    holds: Callable[[FloatArray, float], Any],
    of_second: Callable[[FloatArray], Matrices],
    of_first: Callable[[FloatArray], Matrices],
    border: Border,
    tolerance: float,
) -> BaseGeometry:
    """Return where a condition holds whose border is quadratic in u1 and in u2.

    It is where u2ᵀ·S·u2 vanishes with S = `of_second` of α1, and u1ᵀ·S·u1 with S = `of_first` of α2.
    """

    def zero(side: int) -> Root:
        return lambda x: of_second(x).zeros(side), border

    def zeros_at(middle: FloatArray) -> Sequence[Root]:
        return (zero(-1), zero(1)) if of_second(middle).discriminant[0] > 0 else ()

    turning = zeros_of_degree_two(lambda x: of_second(x).discriminant, math.pi)
    ends = of_first(_BREAKING)
    return _where(holds, zeros_at, [turning, ends.zeros(-1), ends.zeros(1)], tolerance)


def singular_value_below(floor: float, block: Block, tolerance: float) -> BaseGeometry:
    """Return where the lesser singular value of a block, times √2, is below a positive floor.

    Around the curve where its determinant vanishes this is a band, as narrow as the floor.
    """
    g, form = floor**2 / 2, block.form
    grams = block.first.T @ block.first, block.second.T @ block.second

    def matrices(form: FloatArray, own: FloatArray, other: FloatArray) -> Any:
        def at(alpha: FloatArray) -> Matrices:
            # h = (across·u)² + g·uᵀ·(rest − other)·u of the other pair
            u = directions(alpha)
            first, second = form.T @ u
            rest = g - np.sum(u * (own @ u), axis=0)
            cc, cs, ss = rest - other[0, 0], -other[0, 1], rest - other[1, 1]
            turned = cc * second**2 - 2 * cs * first * second + ss * first**2
            return Matrices(
                first**2 + g * cc,
                first * second + g * cs,
                second**2 + g * ss,
                -g * (turned + g * (cc * ss - cs**2)),
            )

        return at

    def holds(x: FloatArray, y: float) -> Any:
        u1, u2 = directions(x)[:, 0], directions(y)
        squares = u1 @ grams[0] @ u1 + u2 @ grams[1] @ u2
        height = (u1 @ form @ u2) ** 2 - g * squares + g**2
        return height < 0 or squares < 2 * g

    if block.has_orthogonal_columns:
        lengths = [
            Matrices(
                gram[0, 0] - g, gram[0, 1], gram[1, 1] - g, g * (np.trace(gram) - g)
            )
            for gram in grams
        ]
        breaks, ordinates = ([part.zeros(-1), part.zeros(1)] for part in lengths)
        lines = [_line(float(ordinate)) for ordinate in ordinates]
        return _where(holds, lambda _: lines, breaks, tolerance)
    squares = _quadratic(-g * grams[0], 2, 0) + _quadratic(-g * grams[1], 0, 2)
    return _where_quadratic(
        holds,
        matrices(form, *grams),
        matrices(form.T, *grams[::-1]),
        Border(squares + g**2, _bilinear(form)),
        # not much above the width of the band
        min(tolerance, floor / 16 / max(1.0, float(np.linalg.norm(form, 2)))),
    )


def product_below(
    level: float, first: FloatArray, second: FloatArray, tolerance: float
) -> BaseGeometry:
    """Return where (u1ᵀ·first·u2)·(u1ᵀ·second·u2) is below a level."""

    def matrices(first: FloatArray, second: FloatArray) -> Any:
        def at(alpha: FloatArray) -> Matrices:
            u = directions(alpha)
            (a, b), (c, d) = first.T @ u, second.T @ u
            between = (a * d - b * c) ** 2 / 4 + level * (a * c + b * d - level)
            return Matrices(a * c - level, (a * d + b * c) / 2, b * d - level, between)

        return at

    def holds(x: FloatArray, y: float) -> Any:
        u1, u2 = directions(x)[:, 0], directions(y)
        return (u1 @ first @ u2) * (u1 @ second @ u2) < level

    return _where_quadratic(
        holds,
        matrices(first, second),
        matrices(first.T, second.T),
        Border(_bilinear(first) * _bilinear(second) + -level),
        tolerance,
    )


def thrust_above(
    share: float, own: FloatArray, other: FloatArray, tolerance: float
) -> BaseGeometry:
    """Return where all hover thrusts are positive and those of rotors 1 and 3 are more than a share of the weight.

    Rotors 1 and 2 have the yaw torques own·u1 and other·u2. The share of rotor 1 is half of other·u2 / (other·u2·cos α1 +
    own·u1·cos α2), and thrusts are positive where both torques have one sign (docs/theory.md, 11).
    """

    def across(x: FloatArray) -> FloatArray:
        # of (1 − 2s·cos α1)·other·u2 − 2s·own·u1·cos α2, a product with u2
        lever = np.outer(other, 1 - 2 * share * np.cos(x))
        lever[0] -= 2 * share * (own @ directions(x))
        return lever

    def border(x: FloatArray) -> FloatArray:
        lever = across(x)
        return np.asarray(np.arctan2(-lever[0], lever[1]))

    def holds(x: FloatArray, y: float) -> Any:
        u2 = directions(y)
        torque = other @ u2
        return (
            torque * (own @ directions(x))[0] > 0 and torque * (u2 @ across(x))[0] > 0
        )

    lift = np.array([1.0, 0.0])
    vanishing = _bilinear(-2 * share * (np.outer(lift, other) + np.outer(own, lift)))
    vanishing += _wave(0, 1, *other)
    zeros = []
    for u2 in directions(_BREAKING).T:
        product = partial(lambda u2, x: u2 @ across(x), u2)
        zeros.append(zeros_of_degree_two(product, _FULL))
    free = math.atan2(-own[0], own[1])
    idle = _line(math.atan2(-other[0], other[1]))
    found = [(border, Border(vanishing)), idle]
    return _where(holds, lambda _: found, [*zeros, np.array([free])], tolerance)


def blue_determinant_below(
    level: float, sign: int, coefficients: Coefficients, tolerance: float
) -> BaseGeometry:
    """Return where sign·R is below a positive level on the blue sheet, with the given, rounded coefficients.

    R is bilinear in cos 2β1 and cos 2β2 there, up to the sign that each wrap of α3 and of α4 by π turns. Nothing is
    wrapped here: R is that of α3 = 2δ − α1 and α4 = −2δ − α2.
    """
    delta = coefficients.crossings[0]
    # R at β1 and β2 of 0 and π/2, where cos 2β is 1 and −1.
    beta1, beta2 = np.array(
        [[0.0, 0.0, HALF_PI, HALF_PI], [0.0, HALF_PI, 0.0, HALF_PI]]
    )
    first, second = beta1 + delta, beta2 - delta
    corners = np.column_stack([first, second, delta - beta1, -delta - beta2])
    mixed = sign * coefficients.form.at(Sines.of(corners))[2].reshape(2, 2)
    change = np.array([[0.5, -0.5], [0.5, 0.5]])
    (both, one), (other, none) = change @ mixed @ change.T

    def border(x: FloatArray) -> FloatArray:
        turned = np.cos(2 * x)
        with np.errstate(divide="ignore", invalid="ignore"):
            w = (level - none - one * turned) / (other + both * turned)
        return np.asarray(np.where(np.isfinite(w), w, _FAR))

    def height(x: FloatArray, w: float) -> FloatArray:
        return np.asarray((both * w + one) * np.cos(2 * x) + other * w + none - level)

    vanishing = (
        cosine(2, 0) * (cosine(0, 2, 0.0, both) + one)
        + cosine(0, 2, 0.0, other)
        + (none - level)
    )
    zeros = [zeros_of_degree_two(partial(height, w=w), math.pi) for w in (1.0, -1.0)]
    found = bands_between(
        np.unique(np.concatenate([[-HALF_PI, 0.0, HALF_PI], *zeros])),
        lambda _: [(border, Border(rest=vanishing))],
        lambda x, w: height(x, w) < 0,
        tolerance,
        ends=(-1.0, 1.0),
        ordinate=lambda w: np.arccos(w) / 2,
    )
    found = found.union(shapely.transform(found, lambda at: at * np.array([1.0, -1.0])))
    near = shapely.box(-_END, -_END, _END, _END)
    shifts = [
        np.array([i * math.pi + delta, j * math.pi - delta])
        for i in (-1, 0, 1)
        for j in (-1, 0, 1)
    ]
    return shapely.union_all(
        [shapely.transform(found, shift.__add__).intersection(near) for shift in shifts]
    )
