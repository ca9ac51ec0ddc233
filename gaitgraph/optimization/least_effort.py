"""The smooth loop of least tilt-rate effort through discs, inside a polygon.

The loop is a periodic uniform cubic spline of (α1, α2). Piece j, local parameter t from 0 to 1, is a cubic of the
control points j to j + 3, counted modulo their number K, and lies in the convex hull of its Bézier points: what holds
for the hulls holds for the curve between any samples. A run of three equal control points makes the curve pass through
them, and hulls that touch such a point are segments.

The *effort* of a spline run once in the period T, at K/T pieces per second, is the integral over the period of the
squared rate of all four tilt angles, on red

    ∫ ‖α̇‖² dt = 2·∫ (α̇1² + α̇2²) dt = 2·(K/T)·Σ Pᵀ·G·P   [rad²/s],

where G, cyclic, holds the integrals of products of the derivatives of the basis: 2/3, −1/8, −1/5, −1/120 by distance.
By the Cauchy–Schwarz inequality it is at least (length in four dimensions)²/T, and equal to that at constant speed.

Inside a polygon the problem is not convex; it is solved as a sequence of convex ones. Two disjoint convex sets are
separated by the line across the shortest segment between them. So each side of the polygon that is near a piece gives a
half-plane with all of the side beyond it, and a few of them shut out all sides: they are a convex *cell* around the
hull, inside the polygon. While every hull stays in its cell the whole curve stays inside.

Sequential quadratic programming finds the best spline whose hulls stay in given cells, and when each disc is passed, in
unknowns scaled by the modes of the effort. The cells are then drawn anew around it. Each loop of the sequence is
admissible, and its effort is less than that of the one before. What it ends in is a local optimum.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from time import monotonic
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt
import shapely

from gaitgraph.arrays import read_only

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from shapely import Polygon

    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.invertibility.matrices import BoolArray, IntArray
    from gaitgraph.surface.region import Discs

FEWEST_PIECES = 8
"""Fewer control points would meet themselves around the loop."""

_BEZIER = (
    np.array([[1, 4, 1, 0], [0, 4, 2, 0], [0, 2, 4, 0], [0, 1, 4, 1]]) / 6.0
)  # points of a piece from its control
_PRODUCTS = np.array([2 / 3, -1 / 8, -1 / 5, -1 / 120])
_BEYOND = 1e-12
_REACH = 0.1  # of cells beyond their piece [rad]
_SETTLED = 1e-10  # relative decrease of the effort that ends the rounds
_MOST_ROUNDS = 40
_EVENED_ROUNDS = 3
_SLACK = 1e-10
_CHOSEN = 0.01  # sides of cells this near are constraints from the beginning, others when they are crossed [rad]
_MOST_CHOICES = 6  # of sides
_MOST_STEPS = 500
_ACTIVE = 1e-6
_STILL = 1e-2  # weight of moving the loop as a whole, which costs no effort, against that of its lowest mode


def basis_rows(s: npt.ArrayLike, count: int, derivative: int = 0) -> FloatArray:
    """Return the rows that give the spline, or a derivative, at parameters s from its control points, (m, count).

    >>> basis_rows([0.0], 8)[0, :4].round(4).tolist()
    [0.1667, 0.6667, 0.1667, 0.0]
    """
    from scipy.interpolate import BSpline

    around = np.eye(count)[np.arange(count + 3) % count]
    basis = BSpline(np.arange(-3, count + 4), around, 3)
    return np.asarray(basis(np.mod(s, count), derivative))


@cache
def hull_matrix(count: int) -> FloatArray:
    """Return the map from `count` control points to the Bézier points of every piece, (count, 4, count), read-only."""
    piece = np.arange(count)[:, None]
    points = np.zeros((count, 4, count))
    points[piece, :, (piece + np.arange(4)) % count] = _BEZIER.T
    return read_only(points)


def effort_matrix(count: int) -> FloatArray:
    """Return the cyclic matrix G of the effort, shape (count, count); its null space are the loops that stand still."""
    from scipy.linalg import circulant

    around = np.concatenate([_PRODUCTS, np.zeros(count - 7), _PRODUCTS[:0:-1]])
    return np.asarray(circulant(around))


def power_pieces(points: FloatArray, width: float) -> FloatArray:
    """Return the pieces as polynomials in powers of a local parameter from 0 to `width`, highest first, (4, K, 2)."""
    # From the first point, so that a spline that stands still does so exactly.
    count = len(points)
    moved = points - points[0]
    powers = []
    for order in (3, 2, 1, 0):
        derivative = basis_rows(np.arange(count), count, order) @ moved
        powers.append(derivative / (math.factorial(order) * width**order))
    pieces = np.stack(powers)
    pieces[3] += points[0]
    return pieces


def control_points_along(
    corners: FloatArray, pieces: int
) -> tuple[FloatArray, IntArray]:
    """Return control points of a spline that runs along a closed polygon exactly, resting at its corners.

    Three for each corner are the least; the others are shared among the sides by length. The first three are at the
    first corner. With them comes the parameter at which each corner is met, shape (m,).

    >>> points, knots = control_points_along(np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]), 12)
    >>> len(points), knots.tolist(), (basis_rows(knots, 12) @ points).round(12).tolist()
    (12, [0, 4, 9], [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    """
    m = len(corners)
    spare = max(pieces - 3 * m, FEWEST_PIECES - 3 * m, 0)
    ends: FloatArray = np.roll(corners, -1, axis=0)
    length = np.linalg.norm(ends - corners, axis=1)
    # A corner's own three count as half of each of its sides.
    share = length / max(length.sum(), 1e-300)
    wanted = np.maximum(share * (spare + 3 * m) - 3.0, 0.0)
    exact = np.full(m, spare / m)
    if wanted.any():
        exact = wanted / wanted.sum() * spare
    extra = np.floor(exact).astype(np.int64)
    most_lacking = np.argsort(extra - exact, kind="stable")
    extra[most_lacking[: spare - int(extra.sum())]] += 1
    points: list[FloatArray] = []
    for corner, end, count in zip(corners, ends, extra.tolist(), strict=True):
        points += [corner] * 3
        points += [
            corner + (end - corner) * k / (count + 1) for k in range(1, count + 1)
        ]
    knots = np.cumsum(3 + extra) - (3 + extra)
    return np.array(points), knots


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SmoothLoop:
    """A spline: control points, shape (K, 2) [rad], and the increasing parameters at which the discs are passed."""

    points: FloatArray
    passes: FloatArray

    @property
    def hulls(self) -> FloatArray:
        """The Bézier points of every piece, shape (K, 4, 2)."""
        return np.asarray(hull_matrix(len(self.points)) @ self.points)

    @property
    def effort(self) -> float:
        """∫ (α̇1² + α̇2²) dt over a period of one second [rad²/s]."""
        count = len(self.points)
        moved = self.points - self.points[0]
        return float(count * np.sum(moved * (effort_matrix(count) @ moved)))

    def passed(self) -> FloatArray:
        """Return the points at which the discs are passed, shape (n, 2) [rad]."""
        return np.asarray(basis_rows(self.passes, len(self.points)) @ self.points)


class HalfPlanes(NamedTuple):
    """Half-planes normal·x ≤ offset, each of the cell of one piece."""

    normals: FloatArray  # unit, shape (r, 2)
    offsets: FloatArray
    piece: IntArray
    on_border: (
        BoolArray  # whether a side of the polygon made it, or the reach of the cell
    )


class LeastEffort:
    """The problem: discs, a polygon, and how far the loop keeps from its border, positive [rad].

    A loop is improved until a time of :func:`time.monotonic`.
    """

    def __init__(
        self,
        polygon: Polygon,
        discs: Discs,
        clearance: float,
        until: float = math.inf,
    ) -> None:
        self.until = until
        self.polygon = polygon
        self.discs = discs
        self.clearance = clearance
        corners, ring = shapely.get_coordinates(
            shapely.get_rings(polygon), return_index=True
        )
        is_side = ring[1:] == ring[:-1]
        self._starts = corners[:-1][is_side]
        self._ends = corners[1:][is_side]
        lines: Any = shapely.linestrings(np.stack([self._starts, self._ends], axis=1))
        self._sides = lines
        self._tree = shapely.STRtree(lines)

    def keeps_inside(self, loop: SmoothLoop) -> bool:
        """Return whether the hull of every piece of the spline lies inside the polygon, clear of its border."""
        shapes: Any = shapely.convex_hull(shapely.multipoints(loop.hulls))
        # Each hull meets the next one: where none comes near the border all are inside if one is.
        if not shapely.covers(self.polygon, shapes[0]):
            return False
        return bool(
            shapely.distance(self.polygon.boundary, shapes).min()
            >= 0.9 * self.clearance
        )

    def cells(self, hulls: FloatArray) -> HalfPlanes:
        """Return a convex cell around each hull of four points, (h, 4, 2), inside the polygon, clear of its border.

        A cell goes 0.1 rad beyond the bounding box of its piece; sides farther away are not looked at.
        """
        count = len(hulls)
        low = hulls.min(axis=1) - _REACH
        high = hulls.max(axis=1) + _REACH
        corners = np.hstack([low - self.clearance, high + self.clearance])
        owner, side = self._tree.query(shapely.box(*corners.T))
        shapes: Any = shapely.convex_hull(shapely.multipoints(hulls))
        normals = []
        offsets = []
        piece = []
        for number in range(count):
            sides = np.sort(side[owner == number])
            for normal, offset in self._separating(shapes[number], sides):
                normals.append(normal)
                offsets.append(offset - self.clearance)
                piece.append(number)
        # The four sides of the box of each piece.
        axes = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
        reaches = np.concatenate([high, -low], axis=1).ravel()
        boxed = np.repeat(np.arange(count), 4)
        on_border = np.arange(len(offsets) + len(reaches)) < len(offsets)
        return HalfPlanes(
            normals=np.concatenate(
                [np.reshape(normals, (-1, 2)), np.tile(axes, (count, 1))]
            ),
            offsets=np.concatenate([offsets, reaches]),
            piece=np.concatenate([np.array(piece, dtype=np.int64), boxed]),
            on_border=on_border,
        )

    def _separating(
        self, hull: Any, sides: IntArray
    ) -> Iterator[tuple[FloatArray, float]]:
        """Yield half-planes, by normal and offset, that shut out all of some sides, from the nearest side outward."""
        shortest = shapely.shortest_line(hull, self._sides[sides])
        ends = shapely.get_coordinates(shortest).reshape(-1, 2, 2)
        on_side = ends[:, 1]
        away = on_side - ends[:, 0]
        distance = np.linalg.norm(away, axis=1)
        left = np.argsort(distance, kind="stable")
        while left.size:
            nearest = left[0]
            normal = away[nearest] / max(float(distance[nearest]), 1e-300)
            offset = float(normal @ on_side[nearest])
            yield normal, offset
            starts = self._starts[sides[left]] @ normal
            ends_beyond = self._ends[sides[left]] @ normal
            nearer = np.minimum(starts, ends_beyond)
            left = left[1:][nearer[1:] < offset - _BEYOND]

    def evened(self, loop: SmoothLoop) -> SmoothLoop | None:
        """Return a spline with points of a loop, evenly spaced, as control points, or None if it leaves the polygon."""
        count = len(loop.points)
        s = np.arange(16 * count + 1) / 16
        on_it = basis_rows(s, count) @ loop.points
        steps = np.linalg.norm(np.diff(on_it, axis=0), axis=1)
        gone = np.append(0.0, np.cumsum(steps))
        if not gone[-1] > 0:
            return None
        # The curve of equal control points P, P, P is at P in the middle one of them.
        at = np.mod((np.arange(count) - 1) / count, 1.0) * gone[-1]
        points = np.column_stack([np.interp(at, gone, on_it[:, k]) for k in range(2)])
        when = np.interp(loop.passes, s, gone) / gone[-1] * count
        even = SmoothLoop(points=points, passes=when - when[0])
        if not self.keeps_inside(even):
            return None
        return even

    def solve(
        self, loop: SmoothLoop, progress: Callable[[str], None] | None = None
    ) -> tuple[SmoothLoop, list[float]]:
        """Return the optimized loop, and the efforts of all loops on the way; none if the start is not admissible."""
        if not self._admits(loop):
            return loop, []
        best = loop
        history = [loop.effort]
        for number in range(_MOST_ROUNDS):
            before = history[-1]
            if progress is not None:
                progress(f"round {number + 1}, effort {2 * before:.4g} rad²/s in 1 s")
            starts = [best]
            # The first control points are unevenly spread; from even ones it ends up to 12 % lower.
            even = self.evened(best) if number < _EVENED_ROUNDS else None
            if even is not None:
                starts.insert(0, even)
            for start in starts:
                better = self.program(start).best()
                if better is None or not self._admits(better):
                    continue
                if better.effort < history[-1]:
                    best = better
                    history.append(better.effort)
            if not self.in_time or before - history[-1] <= _SETTLED * before:
                break
        return best, history

    @property
    def in_time(self) -> bool:
        """Whether there is time left to improve a loop."""
        return monotonic() <= self.until

    def _admits(self, loop: SmoothLoop) -> bool:
        return self.discs.misses(loop.passed()) <= 1e-9 and self.keeps_inside(loop)

    def program(self, loop: SmoothLoop) -> Program:
        """Return the problem in the cells around a loop."""
        return Program(loop, self.discs, self.cells(loop.hulls), self.until)


class _OutOfTime(Exception):
    """The time to improve a loop has passed."""


class Program:
    """The problem within given cells, in scaled unknowns.

    In the unknowns z the effort is ½‖z‖², but for the first two, which move the loop as a whole; the last n − 1
    unknowns move the parameters at which the discs are passed.
    """

    def __init__(
        self, loop: SmoothLoop, discs: Discs, cells: HalfPlanes, until: float
    ) -> None:
        count = len(loop.points)
        self.loop = loop
        self.discs = discs
        self.until = until
        self.count = count
        self.round = discs.radii > 0
        self.later = len(loop.passes) - 1
        self.shape, inverse = _modes(count)
        self.rows = hull_matrix(count)[cells.piece].reshape(-1, count)
        self.normals = np.repeat(cells.normals, 4, axis=0)
        self.offsets = np.repeat(cells.offsets, 4)
        self.on_border = np.repeat(cells.on_border, 4)
        self.origin = np.concatenate(
            [(inverse @ loop.points).ravel(), np.zeros(self.later)]
        )
        self.unit = 0.5 * count / len(loop.passes) / max(math.sqrt(loop.effort), 1e-9)
        # Passes may move by less than half the way to the next, so that they stay in order.
        half = np.diff(np.append(loop.passes, count)) / 2 / self.unit
        self.bounds = np.column_stack([-half[:-1], half[1:]])

    def loop_at(self, x: FloatArray) -> SmoothLoop:
        """Return the loop of given unknowns."""
        passes = self.loop.passes + self.unit * np.append(0.0, x[2 * self.count :])
        return SmoothLoop(
            points=self.shape @ x[: 2 * self.count].reshape(self.count, 2),
            passes=passes,
        )

    def effort(self, x: FloatArray) -> tuple[float, FloatArray]:
        """Return the effort in one second, and its slope."""
        slope = np.zeros_like(x)
        modes = slice(2, 2 * self.count)
        slope[modes] = x[modes]
        return 0.5 * float(slope @ slope), slope

    def slack(self, x: FloatArray) -> FloatArray:
        """Return by how much each Bézier point keeps inside each side of its cell."""
        points = self.rows @ self.loop_at(x).points
        return np.asarray(self.offsets - np.sum(self.normals * points, axis=1))

    def slack_slope(self, chosen: BoolArray) -> FloatArray:
        """Return the slopes of chosen slacks, which are constant."""
        of_points = self.rows[chosen] @ self.shape
        slopes = np.zeros((int(chosen.sum()), len(self.origin)))
        slopes[:, 0 : 2 * self.count : 2] = -of_points * self.normals[chosen, :1]
        slopes[:, 1 : 2 * self.count : 2] = -of_points * self.normals[chosen, 1:]
        return slopes

    def at_discs(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the points at the discs, from their centres, shape (n, 2), and the slopes of both coordinates."""
        loop = self.loop_at(x)
        slopes = np.zeros((2, len(loop.passes), len(x)))
        rows = basis_rows(loop.passes, self.count) @ self.shape
        speed = basis_rows(loop.passes, self.count, 1) @ loop.points
        later = np.arange(1, len(loop.passes))
        for axis in range(2):
            slopes[axis, :, axis : 2 * self.count : 2] = rows
            slopes[axis, later, 2 * self.count + later - 1] = (
                self.unit * speed[later, axis]
            )
        return loop.passed() - self.discs.centers, slopes

    def disc_slack(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return how far inside the discs with an interior the loop passes, r − d²/r, and the slopes."""
        off, slopes = self.at_discs(x)
        off = off[self.round]
        slopes = slopes[:, self.round]
        radii = self.discs.radii[self.round]
        scaled = -2.0 * off / radii[:, None]
        slope = scaled[:, :1] * slopes[0] + scaled[:, 1:] * slopes[1]
        return radii - np.sum(off**2, axis=1) / radii, np.asarray(slope)

    def point_gap(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return how far the loop passes from discs that are points, both coordinates, and the slopes."""
        off, slopes = self.at_discs(x)
        return off[~self.round].T.ravel(), slopes[:, ~self.round].reshape(-1, len(x))

    def best(self) -> SmoothLoop | None:
        """Return the best loop, by sequential quadratic programming from the loop itself, or None if it fails or is late."""
        chosen = self.slack(self.origin) < _CHOSEN
        for _ in range(_MOST_CHOICES):
            try:
                x = self._best_within(chosen)
            except _OutOfTime:
                return None
            crossed = self.slack(x) < -_SLACK
            if not (crossed & ~chosen).any():
                return self.loop_at(x)
            chosen |= crossed
        return None

    def _best_within(self, chosen: BoolArray) -> FloatArray:
        """Return the unknowns of the best loop that keeps within the chosen sides of cells, and passes the discs."""
        from scipy.optimize import minimize

        def effort(x: FloatArray) -> tuple[float, FloatArray]:
            if monotonic() > self.until:
                raise _OutOfTime
            return self.effort(x)

        slope = self.slack_slope(chosen)
        base = self.slack(np.zeros_like(self.origin))[chosen]
        constraints = []
        if chosen.any():
            constraints.append(_constraint("ineq", lambda x: (base + slope @ x, slope)))
        if self.round.any():
            constraints.append(_constraint("ineq", self.disc_slack))
        if not self.round.all():
            constraints.append(_constraint("eq", self.point_gap))
        free = np.tile([-np.inf, np.inf], (2 * self.count, 1))
        result: Any = minimize(  # type: ignore[call-overload]
            effort,
            self.origin,
            jac=True,
            method="SLSQP",
            bounds=np.vstack([free, self.bounds]),
            constraints=constraints,
            options={
                "maxiter": _MOST_STEPS,
                "ftol": 1e-12 * self.effort(self.origin)[0],
            },
        )
        return np.asarray(result.x)

    def stationarity(self) -> tuple[float, tuple[int, ...], bool]:
        """Return the residual of the first-order conditions, which discs hold the loop, and whether the border does.

        The residual is the distance from the slope of the effort to the nearest combination of the slopes of active
        constraints, nonnegative for inequalities, as a fraction; its square is about the relative decrease left.
        """
        x = self.origin
        slope = self.effort(x)[1]
        near = (self.slack(x) < _ACTIVE) & self.on_border
        inside, inside_slope = self.disc_slack(x)
        touched = inside < _ACTIVE
        _, equal = self.point_gap(x)
        columns = np.concatenate(
            [self.slack_slope(near), inside_slope[touched], equal, -equal]
        ).T
        size = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
        multipliers, remaining = _nonnegative(columns / size, slope)
        acting = multipliers > 1e-6 * np.linalg.norm(slope)
        borders = int(near.sum())
        of_discs = acting[borders : borders + int(touched.sum())]
        held = np.flatnonzero(self.round)[touched][of_discs]
        discs = np.union1d(held, np.flatnonzero(~self.round))
        residual = float(remaining / np.linalg.norm(slope))
        return residual, tuple(discs.tolist()), bool(acting[:borders].any())


def _constraint(
    kind: str, values: Callable[[FloatArray], tuple[FloatArray, FloatArray]]
) -> dict[str, Any]:
    """Return a constraint as scipy takes it, of a function that returns values and their slopes."""
    return {
        "type": kind,
        "fun": lambda x: values(x)[0],
        "jac": lambda x: values(x)[1],
    }


def _nonnegative(columns: FloatArray, target: FloatArray) -> tuple[FloatArray, float]:
    """Return the nonnegative combination of columns, some or none, that is nearest to a target, and how far it is."""
    from scipy.optimize import nnls

    if not columns.shape[1]:
        return np.zeros(0), float(np.linalg.norm(target))
    multipliers, remaining = nnls(
        columns, target, maxiter=10 * len(columns) + 10 * columns.shape[1]
    )
    return np.asarray(multipliers), float(remaining)


@cache
def _modes(count: int) -> tuple[FloatArray, FloatArray]:
    """Return the matrix that gives control points from unknowns in which the effort is ½‖z‖², and its inverse."""
    size, modes = np.linalg.eigh(effort_matrix(count))
    size[0] = _STILL * size[1]
    scale = np.sqrt(2 * count * size)
    return modes / scale, scale[:, None] * modes.T
