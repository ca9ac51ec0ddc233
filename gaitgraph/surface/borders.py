r"""Curved borders in the (α1, α2) plane as polygons that are certified to follow them, and the sets that they bound.

A border is where h = P² + Q vanishes, P and Q sums of cosines of linear functions of the two coordinates
(:class:`CosineSum`). Where it is also an explicit function of one coordinate it is sampled there, and every chord is
certified: across a rectangle around the chord the slope of h does not vanish,

    |∂h/∂n| ≥ m > 0,

so inside it the border is one graph over the chord, through both of its ends; and on a chord of length ℓ, with
|∂²h/∂t²| ≤ M, |h| ≤ e + M·ℓ²/8 where e is what is left of h at the ends. So the border is nowhere farther from the
chord than (e + M·ℓ²/8)/m. Chords for which that is too much are divided.

With u = α1 − α2, v = α1 + α2 and w = cos v the conditions of the red sheet are quadratic in w for fixed u:

* R = (w + cos(u − 2δ))·D/(κ cos²δ) with the bracket D = κw + κ cos u − sin u (equation (6) on red; docs/theory.md, 6);
* the 2×2 block of the scaled decoupling matrix has the singular values √2·√λ, where the two λ have the product D²
  and the sum F = 2 + κ² + κw·(κ cos u − 2 sin u). With g = floor²/2 both λ are at least g exactly where
  h = D² − gF + g² ≥ 0 and F ≥ 2g. On F = 2g, h = D² − F²/4 ≤ 0: so F is compared once a part (theory.md, 14);
* with rotors H arm lengths above the centre of mass, w + cos(u − 2δ) becomes 2P = Aw + cos(u − 2δ) + B cos u with
  B = H²cos²δ and A = 1 − B, and the other block has the product (P/cos²δ)² and the sum
  (1 + κ²)(1 + w cos(u − 2δ)) + H²(1 − w cos u) (theory.md, 19).

Each function of a set returns polygons whose sides are nowhere farther than `tolerance` [rad] from its border, inside
[−π/2, π/2]²; beyond the square they end anywhere. `kappa` is the signed drag ratio.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import groupby, pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely

from gaitgraph.angles import HALF_PI
from gaitgraph.invertibility.matrices import Coefficients, FloatArray

if TYPE_CHECKING:
    from shapely import Polygon
    from shapely.geometry.base import BaseGeometry

Function = Callable[[FloatArray], FloatArray]

_FIRST_CHORDS = 8
_MOST_ROUNDS = 40  # of dividing chords
_ON_CIRCLE = 1e-4  # how far from the unit circle a root may be that counts as on it
_SAME = 1e-12  # abscissae no farther apart are one [rad]
_FAR = 20.0  # farther than any root
_FULL = 2 * math.pi
_BEYOND = 0.3  # beyond the square, so that its sides are no sides of the sets' polygons


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


Edge = tuple[
    float, Function, Border | None
]  # of a band: w in its middle, its ordinates, and None if it is straight


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
        # A chord shorter than the tolerance is as good as the border.
        bound[np.hypot(*(second - first).T) < tolerance / 2] = 0.0
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
    roots: Sequence[Function],
    holds: Callable[[FloatArray, float], Any],
    border: Border,
    tolerance: float,
    *,
    ends: tuple[float, float] = (-_FAR, _FAR),
    ordinate: Function = np.asarray,
) -> BaseGeometry:
    """Return where a condition holds, as polygons whose borders follow the true ones.

    For every abscissa x the condition, which `holds` evaluates at (x, w) for x of shape (1,), changes only at a few
    values of w within `ends`: its `roots`, ascending functions of x, NaN where they do not exist. Between the sorted
    abscissae `breaks` no root enters or leaves that range, meets another, or ceases to exist. `ordinate` gives the
    second coordinate for w, a monotone function. `border` vanishes on the roots and may be `tolerance` from the sides
    of the polygons.
    """

    def edge(w: float, root: Function | None = None) -> Edge:
        if root is None:
            return w, lambda x: ordinate(np.full(x.shape, w)), None
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
        return between(common, common)

    kept = np.concatenate([[True], np.diff(breaks) > _SAME])
    kept[-1] = True
    polygons = []
    for low, high in pairwise(breaks[kept].tolist()):
        middle = np.array([(low + high) / 2])
        with np.errstate(invalid="ignore"):
            here = [(float(root(middle)[0]), root) for root in roots]
        edges = [
            edge(ends[0]),
            *(edge(w, root) for w, root in here if ends[0] < w < ends[1]),
            edge(ends[1]),
        ]
        inside = [bool(holds(middle, (a[0] + b[0]) / 2)) for a, b in pairwise(edges)]
        # Each run of intervals in which the condition holds is one polygon.
        for held, run in groupby(range(len(inside)), key=inside.__getitem__):
            if held:
                numbers = list(run)
                polygons.append(
                    band(low, high, (edges[numbers[0]], edges[numbers[-1] + 1]))
                )
    return shapely.union_all(polygons)


def mirrored(shape: BaseGeometry) -> BaseGeometry:
    """Return the mirror image in α2 = −α1, which swaps the two pairs of arms."""
    return shapely.transform(shape, lambda at: -at[:, ::-1])


Parts = tuple[float, float]  # factors of cos u and of sin u


@dataclass(frozen=True, slots=True)
class Block:
    """A 2×2 block of the scaled decoupling matrix on red, over √2.

    Its determinant is lead·w + line, and the squares of its entries add up to total + common·w·slope, where `line` and
    `slope` are functions of u. `steep` is about how steep the determinant is.
    """

    lead: float
    line: Parts
    total: float
    slope: Parts
    common: float = 1.0
    steep: float = 1.0


def yaw_block(kappa: float) -> Block:
    """Return the block of yaw torque and lift, of determinant D."""
    return Block(kappa, (kappa, -1.0), 2 + kappa**2, (kappa, -2.0), common=kappa)


def roll_block(kappa: float, raised: float) -> Block:
    """Return the block of roll and pitch torque, of determinant P/cos²δ, for rotors `raised` arm lengths high."""
    square, total = raised**2, 1 + kappa**2 + raised**2
    line, slope = (
        ((1 - kappa**2 + square) / 2, kappa),
        (1 - kappa**2 - square, 2 * kappa),
    )
    return Block(total / 2 - square, line, total, slope, steep=total)


def _at(parts: Parts, u: FloatArray) -> FloatArray:
    return np.asarray(parts[0] * np.cos(u) + parts[1] * np.sin(u))


def _in_uv(parts: Parts, size: float = 1.0) -> CosineSum:
    return cosine(1, 0, size=size * parts[0]) + cosine(1, 0, HALF_PI, size * parts[1])


def _where_it_holds(
    lead: float,
    tolerance: float,
    *,
    middle: Function,
    discriminant: Function,
    scale: float,
    height: Callable[[FloatArray, float], FloatArray],
    holds: Callable[[FloatArray, float], Any],
    border: Border,
    may_vanish: bool,
) -> BaseGeometry:
    """Return, in the (α1, α2) plane, where a condition on (u, w) `holds`, with a quadratic in w as border.

    `height` is the quadratic lead·w² + middle·w + rest at (u, w), up to a factor unless the `lead` may vanish, w =
    (±√discriminant − sgn lead·middle)/(2|lead|) are its roots, where `border`, a function of (u, v), vanishes. `height`
    and `discriminant`, zero within 1e-9·scale, are of degree two in u. A `lead` near zero makes one root large; the
    other is then 2·rest/(∓√discriminant − middle).
    """

    def root(side: float) -> Function:
        def at(u: FloatArray) -> FloatArray:
            square = discriminant(u)
            with np.errstate(invalid="ignore"):
                size = np.sqrt(
                    np.where(square > -1e-9 * scale, np.maximum(square, 0.0), np.nan)
                )
            half = math.copysign(1, lead) * middle(u)
            with np.errstate(divide="ignore", invalid="ignore"):
                direct = (side * size - half) / (2 * abs(lead))
                if not may_vanish:
                    return np.asarray(direct)
                other = (
                    2 * math.copysign(1, lead) * height(u, 0.0) / (-side * size - half)
                )
            return np.asarray(np.where(side * half > 0, other, direct))

        return at

    # Roots meet or cease where the discriminant vanishes, and leave −1 ≤ w ≤ 1 where the height at its ends does.
    end = math.pi + _BEYOND
    functions: list[Function] = [
        discriminant,
        lambda u: height(u, 1.0),
        lambda u: height(u, -1.0),
    ]
    zeros = np.concatenate(
        [zeros_of_degree_two(function, _FULL) for function in functions]
    )
    zeros = np.concatenate([zeros - _FULL, zeros, zeros + _FULL])
    breaks = np.unique(np.concatenate([[-end, end], zeros[np.abs(zeros) < end]]))
    roots, wide = (root(-1.0), root(1.0)), math.sqrt(2.0) * tolerance
    shape = bands_between(
        breaks, roots, holds, border, wide, ends=(-1.0, 1.0), ordinate=np.arccos
    )
    # w = cos v is even and has the period 2π: from 0 ≤ v ≤ π to v = 2π − v and −v; then α1 = (v + u)/2, α2 = (v − u)/2.
    beyond = shapely.transform(
        shape, lambda at: np.column_stack([at[:, 0], _FULL - at[:, 1]])
    )
    upper = shape.union(shapely.clip_by_rect(beyond, -end, 0.0, end, end))
    both = upper.union(shapely.transform(upper, lambda at: at * np.array([1.0, -1.0])))
    return shapely.transform(
        both, lambda at: np.column_stack([at[:, 1] + at[:, 0], at[:, 1] - at[:, 0]]) / 2
    )


def singular_value_below(floor: float, block: Block, tolerance: float) -> BaseGeometry:
    """Return where the lesser singular value of a block on the red sheet is below a positive floor.

    Around the curve where its determinant vanishes this is a band, as narrow as the floor.
    """
    g, ratio = floor**2 / 2, block.lead / block.common

    def squares(u: FloatArray, w: float) -> FloatArray:  # F
        return np.asarray(block.total + block.common * w * _at(block.slope, u))

    def height(u: FloatArray, w: float) -> FloatArray:  # h
        return np.asarray(
            (block.lead * w + _at(block.line, u)) ** 2 - g * squares(u, w) + g**2
        )

    def discriminant(u: FloatArray) -> FloatArray:
        line, slope = _at(block.line, u), _at(block.slope, u)
        return np.asarray(
            g
            * (
                -4 * ratio * line * slope
                + g * slope**2
                + 4 * ratio**2 * (block.total - g)
            )
        )

    # h = P² + Q with the determinant as P and Q = g² − gF, in (u, v).
    rest = _in_uv(block.slope, -g * block.common) * cosine(0, 1) + (
        g**2 - g * block.total
    )
    longest, steepest = math.hypot(*block.line), math.hypot(*block.slope)
    return _where_it_holds(
        block.lead * ratio,
        min(
            tolerance, floor / 16 / block.steep
        ),  # not much above the width of the band
        middle=lambda u: 2 * ratio * _at(block.line, u) - g * _at(block.slope, u),
        discriminant=discriminant,
        scale=g
        * (
            4 * abs(ratio) * longest * steepest
            + g * steepest**2
            + 4 * ratio**2 * block.total
        ),
        height=height,
        holds=lambda u, w: height(u, w) < 0 or squares(u, w) < 2 * g,
        border=Border(
            rest=rest, squared=_in_uv(block.line) + cosine(0, 1, size=block.lead)
        ),
        may_vanish=ratio != 1,
    )


def determinant_below(
    level: float, sign: int, kappa: float, raised: float, tolerance: float
) -> BaseGeometry:
    """Return where sign·R is below a positive level on the red sheet, exact coefficients; `raised` is H."""
    # sign·R < level, times κ cos²δ: 2P·D against small·κ, a quadratic in w.
    delta = math.atan(kappa)
    small, turned = sign * level * math.cos(delta) ** 2, (raised * math.cos(delta)) ** 2
    lead, bracket = 1 - turned, yaw_block(kappa).line

    def line(u: FloatArray) -> FloatArray:
        return np.cos(u - 2 * delta) + turned * np.cos(u)

    def height(u: FloatArray, w: float) -> FloatArray:
        return (lead * w + line(u)) * (kappa * w + _at(bracket, u)) - small * kappa

    double = (
        cosine(0, 1, size=lead) + cosine(1, 0, 2 * delta) + cosine(1, 0, size=turned)
    )
    return _where_it_holds(
        lead * kappa,
        tolerance,
        middle=lambda u: kappa * line(u) + lead * _at(bracket, u),
        discriminant=lambda u: (
            (kappa * line(u) - lead * _at(bracket, u)) ** 2
            + 4 * lead * small * kappa**2
        ),
        scale=4 * (1 + kappa**2) * (1 + turned) ** 2,
        height=height,
        holds=lambda u, w: sign * kappa * height(u, w) < 0,
        border=Border(
            rest=double * (_in_uv(bracket) + cosine(0, 1, size=kappa)) + -small * kappa
        ),
        may_vanish=raised != 0,
    )


def bracket_negative(kappa: float, tolerance: float) -> BaseGeometry:
    """Return where the bracket D is negative inside the square: tan α1 − tan α2 > 2κ.

    On the border α1 − α2 is the angle from 1 + κ sin 2α2 to 2κ cos² α2, a smooth function of α2. D vanishes in the
    corners (π/2, −π/2) and (−π/2, π/2) too, but changes no sign inside the square there.
    """

    def root(y: FloatArray) -> FloatArray:
        return np.asarray(
            y + np.arctan2(2 * kappa * np.cos(y) ** 2, 1 + kappa * np.sin(2 * y))
        )

    # D = 2κ cos α1 cos α2 − sin(α1 − α2), with α2 as the first coordinate.
    bracket = cosine(1, 0) * cosine(0, 1, 0.0, 2 * kappa) + cosine(-1, 1, HALF_PI, -1.0)
    breaks = np.array([-HALF_PI - _BEYOND, 0.0, HALF_PI + _BEYOND])
    found = bands_between(
        breaks, (root,), lambda y, x: x > root(y), Border(rest=bracket), tolerance
    )
    return shapely.transform(found, lambda at: at[:, ::-1])


def raised_negative(block: Block, tolerance: float) -> BaseGeometry:
    """Return where the determinant of the block of roll and pitch is negative inside the square, for a rotor height.

    It is p·cos α2 − q·sin α2 with p and q sums of cos α1 and sin α1, and vanishes at α2 = atan(p/q); where q does, one
    branch of that curve ends and another begins.
    """
    (even, odd), lead = block.line, block.lead

    def ratio(x: FloatArray) -> tuple[FloatArray, FloatArray]:
        return _at((lead + even, odd), x), _at((odd, lead - even), x)

    def root(x: FloatArray) -> FloatArray:
        above, below = ratio(x)
        return np.asarray(np.arctan2(above * np.sign(below), np.abs(below)))

    def holds(x: FloatArray, y: float) -> Any:
        return (y > root(x)) == (ratio(x)[1] > 0)

    determinant = (
        cosine(1, 1, size=lead) + cosine(1, -1, size=even) + cosine(1, -1, HALF_PI, odd)
    )
    end, poles = (
        HALF_PI + _BEYOND,
        math.atan2(odd, even - lead) + math.pi * np.arange(-2, 3),
    )
    breaks = np.unique(np.concatenate([[-end, end], poles[np.abs(poles) < end]]))
    return bands_between(breaks, (root,), holds, Border(rest=determinant), tolerance)


def thrust_above(share: float, kappa: float, tolerance: float) -> BaseGeometry:
    """Return where, with all hover thrusts positive, T1 = T3 is more than a share of the weight.

    By T1/(m·g) of docs/theory.md, 11, it is not where |sin β2|·(1 − 2s cos α1) ≤ 2s·|sin β1|·cos α2, which is explicit
    in tan α2. For the other two rotors the set is the mirror image.
    """
    delta = math.atan(kappa)

    def border(x: FloatArray) -> FloatArray:
        rest = np.maximum(1 - 2 * share * np.cos(x), 0.0)
        return np.arctan2(
            -2 * share * np.sin(x - delta) - rest * math.sin(delta),
            rest * math.cos(delta),
        )

    def above(x: FloatArray, y: float) -> Any:
        return (2 * share * np.cos(x) < 1) & np.where(
            x < delta, y > border(x), y < border(x)
        )

    vanishing = cosine(0, 1, HALF_PI - delta) * (cosine(1, 0, 0.0, -2 * share) + 1.0)
    vanishing = vanishing + cosine(1, 0, HALF_PI + delta) * cosine(0, 1, 0.0, 2 * share)
    free = math.acos(1 / (2 * share)) if share > 0.5 else 0.0
    breaks = np.unique([-HALF_PI - _BEYOND, -free, free, delta, HALF_PI + _BEYOND])
    return bands_between(breaks, (border,), above, Border(rest=vanishing), tolerance)


def blue_determinant_below(
    level: float, sign: int, coefficients: Coefficients, tolerance: float
) -> BaseGeometry:
    """Return where sign·R is below a positive level on the blue sheet, with the given, rounded coefficients.

    R is bilinear in cos 2β1 and cos 2β2 there, up to the sign that each wrap of α3 and of α4 by π turns. Nothing is
    wrapped here: R is that of α3 = 2δ − α1 and α4 = −2δ − α2.
    """
    delta, form = coefficients.delta, coefficients.bilinear_form
    # Pair features (cos·cos, sin·sin, sin of the sum) in terms of (cos 2β, 1), for both pairs of arms.
    turn = 2 * delta
    first = np.array(
        [[0.5, math.cos(turn) / 2], [0.5, -math.cos(turn) / 2], [0.0, math.sin(turn)]]
    )
    second = first * np.array([[1.0], [1.0], [-1.0]])
    (both, one), (other, none) = sign * first.T @ form @ second

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
        (border,),
        lambda x, w: height(x, w) < 0,
        Border(rest=vanishing),
        tolerance,
        ends=(-1.0, 1.0),
        ordinate=lambda w: np.arccos(w) / 2,
    )
    found = found.union(shapely.transform(found, lambda at: at * np.array([1.0, -1.0])))
    end = HALF_PI + _BEYOND
    near = shapely.box(-end, -end, end, end)
    shifts = [
        np.array([i * math.pi + delta, j * math.pi - delta])
        for i in (-1, 0, 1)
        for j in (-1, 0, 1)
    ]
    return shapely.union_all(
        [shapely.transform(found, shift.__add__).intersection(near) for shift in shifts]
    )
