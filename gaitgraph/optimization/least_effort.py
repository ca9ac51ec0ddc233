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
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import shapely

from gaitgraph.arrays import read_only
from gaitgraph.surface.region import polygons_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from shapely import Polygon

    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.invertibility.matrices import BoolArray, IntArray
    from gaitgraph.planning.request import Progress
    from gaitgraph.surface.region import Discs

    Constraint = Callable[[FloatArray], tuple[FloatArray, FloatArray]]

FEWEST_PIECES = 8
"""Fewer control points would meet themselves around the loop."""

_BEZIER = (
    np.array([[1, 4, 1, 0], [0, 4, 2, 0], [0, 2, 4, 0], [0, 1, 4, 1]]) / 6.0
)  # points of a piece from its control
_PRODUCTS = np.array([2 / 3, -1 / 8, -1 / 5, -1 / 120])
_BEYOND = (
    1e-12  # by which a side on a line counts as shut out, more than round-off [rad]
)
_REACH = 0.1  # of cells beyond their piece [rad]
_SETTLED = 1e-7  # relative decrease of the effort that ends the rounds
_MOST_ROUNDS = 40  # most loops settle within 20
_EVENED_ROUNDS = 3  # that also start from evenly spread points
_SLACK = 1e-10  # by which the solver's points may be beyond a side [rad]
_CHOSEN = 0.01  # sides of cells this near are constraints from the beginning, others when they are crossed [rad]
_MOST_STEPS = 500  # of the solver, which needs some tens
_ACTIVE = 1e-6  # distance below which a constraint acts [rad]
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


@cache
def effort_matrix(count: int) -> FloatArray:
    """Return the cyclic matrix G of the effort, (count, count), read-only; its null space are loops that stand still."""
    from scipy.linalg import circulant

    around = np.concatenate([_PRODUCTS, np.zeros(count - 7), _PRODUCTS[:0:-1]])
    return read_only(circulant(around))


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
    (12, [0, 3, 8], [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    """
    m = len(corners)
    ends: FloatArray = np.roll(corners, -1, axis=0)
    length = np.linalg.norm(ends - corners, axis=1)
    # A corner's own three count as half of each of its sides.
    spare = max(pieces, FEWEST_PIECES, 3 * m) - 3 * m
    even = (spare + 3 * m) * length / max(length.sum(), 1e-300)
    wanted = np.cumsum(np.maximum(even - 3.0, 0.0))
    shared = np.floor(spare * wanted / max(wanted[-1], 1e-300) + 1e-9)
    shared[-1] = spare
    count = 3 + np.diff(shared, prepend=0).astype(np.int64)
    points: list[FloatArray] = []
    for corner, end, number in zip(corners, ends, count.tolist(), strict=True):
        points += [corner, corner, *np.linspace(corner, end, number - 1)[:-1]]
    return np.array(points), np.cumsum(count) - count


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SmoothLoop:
    """A spline: control points, shape (K, 2) [rad], and the increasing parameters at which the discs are passed.

    The first disc is passed at parameter 0.
    """

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

    def evened(self) -> SmoothLoop:
        """Return the spline whose control points are points of this one, evenly spaced. It must not stand still."""
        count = len(self.points)
        s = np.arange(16 * count + 1) / 16
        curve = basis_rows(s, count) @ self.points
        steps = np.linalg.norm(np.diff(curve, axis=0), axis=1)
        gone = np.append(0.0, np.cumsum(steps))
        share = gone / gone[-1]
        # The curve of equal control points P, P, P is at P in the middle one of them.
        at = np.mod(np.arange(count) - 1, count) / count
        points = np.column_stack([np.interp(at, share, axis) for axis in curve.T])
        passes = count * np.interp(self.passes, s, share)
        return SmoothLoop(points=points, passes=passes)


class LeastEffort:
    """The problem: discs, a polygon, and how far the loop keeps from its border, positive [rad]."""

    def __init__(self, polygon: Polygon, discs: Discs, clearance: float) -> None:
        self.polygon = polygon
        self.discs = discs
        self.clearance = clearance
        self._clear = shapely.buffer(polygon, -0.9 * clearance)
        shapely.prepare(self._clear)

    def keeps_inside(self, loop: SmoothLoop) -> bool:
        """Return whether the hull of every piece lies inside the polygon, clear of its border."""
        hulls: Any = shapely.convex_hull(shapely.multipoints(loop.hulls))
        return bool(shapely.covers(self._clear, hulls).all())

    def admits(self, loop: SmoothLoop) -> bool:
        """Return whether a loop keeps inside the polygon and passes the discs."""
        return self.discs.misses(loop.passed()) <= 1e-9 and self.keeps_inside(loop)

    def solve(
        self,
        loop: SmoothLoop,
        until: float = math.inf,
        progress: Progress | None = None,
    ) -> tuple[SmoothLoop, list[float]]:
        """Return a loop of locally least effort, from an admissible one, and the efforts of all loops on the way.

        After a time of :func:`time.monotonic` it is improved no further.
        """
        history = [loop.effort]
        for number in range(_MOST_ROUNDS):
            before = history[-1]
            if before == 0:
                break
            if progress is not None:
                progress(f"round {number + 1}, effort {2 * before:.4g} rad²/s in 1 s")
            starts = [loop]
            # The first control points are unevenly spread; from even ones it ends up to 12 % lower.
            if number < _EVENED_ROUNDS:
                starts.insert(0, loop.evened())
            for start in filter(self.keeps_inside, starts):
                try:
                    better = WithinCells(self, start).best(until)
                except TimeoutError:
                    return loop, history
                if better.effort < history[-1] and self.admits(better):
                    loop = better
                    history.append(better.effort)
            if before - history[-1] <= _SETTLED * before:
                break
        return loop, history

    def half_planes(self, hull: FloatArray) -> Iterator[tuple[FloatArray, float]]:
        """Yield half-planes normal·x ≤ offset, a convex cell around a hull of points, (k, 2), inside the polygon.

        The cell goes 0.1 rad beyond the bounding box of the hull; what is farther away is not looked at.
        """
        low, high = hull.min(axis=0) - _REACH, hull.max(axis=0) + _REACH
        near = shapely.intersection(self.polygon, shapely.box(*low, *high))
        rings = shapely.get_parts(polygons_of(near).boundary)
        corners, ring = shapely.get_coordinates(rings, return_index=True)
        follows = ring[1:] == ring[:-1]
        sides = np.stack([corners[:-1], corners[1:]], axis=1)[follows]
        lines: Any = shapely.linestrings(sides)
        shape = shapely.convex_hull(shapely.multipoints(hull))
        shortest = shapely.get_coordinates(shapely.shortest_line(shape, lines))
        on_side = shortest[1::2]
        away = on_side - shortest[::2]
        distance = np.linalg.norm(away, axis=1)
        # From the nearest side outward, until all are shut out.
        open_ = np.ones(len(sides), dtype=bool)
        for k in np.argsort(distance, kind="stable"):
            if open_[k]:
                normal = away[k] / distance[k]
                offset = float(normal @ on_side[k])
                open_ &= (sides @ normal).min(axis=1) < offset - _BEYOND
                yield normal, offset - self.clearance


class WithinCells:
    """The problem within cells around a loop, in scaled unknowns.

    In the unknowns z the effort is ½‖z‖², but for the first two, which move the loop as a whole; the last n − 1
    unknowns move the parameters at which the discs are passed.
    """

    def __init__(self, problem: LeastEffort, loop: SmoothLoop) -> None:
        count = len(loop.points)
        later = len(loop.passes) - 1
        self.loop = loop
        self.discs = problem.discs
        self.is_round = problem.discs.radii > 0
        self.shape, inverse = _modes(count)
        self.origin = np.append(inverse @ loop.points, np.zeros(later))
        self.in_effort = np.zeros(len(self.origin))
        self.in_effort[2 : 2 * count] = 1.0
        # A side of a cell bounds the four Bézier points of its piece.
        slopes = []
        offsets = []
        for rows, hull in zip(hull_matrix(count), loop.hulls, strict=True):
            for normal, offset in problem.half_planes(hull):
                slopes.append(np.kron(rows @ self.shape, normal))
                offsets += [offset] * 4
        self.side_slopes = np.pad(-np.concatenate(slopes), [(0, 0), (0, later)])
        self.side_offsets = np.array(offsets)
        # Passes may move by less than half the way to the next, so that they stay in order.
        self.unit = 0.5 * count / len(loop.passes) / max(math.sqrt(loop.effort), 1e-9)
        half = np.diff(np.append(loop.passes, count)) / 2 / self.unit
        free = np.full((2 * count, 2), [-np.inf, np.inf])
        self.bounds = np.vstack([free, np.column_stack([-half[:-1], half[1:]])])

    def loop_at(self, x: FloatArray) -> SmoothLoop:
        """Return the loop of given unknowns."""
        modes, moves = np.split(x, [2 * len(self.shape)])
        return SmoothLoop(
            points=self.shape @ modes.reshape(-1, 2),
            passes=self.loop.passes + self.unit * np.append(0.0, moves),
        )

    def effort(self, x: FloatArray) -> tuple[float, FloatArray]:
        """Return the effort in one second, and its slope."""
        slope = self.in_effort * x
        return 0.5 * float(slope @ slope), slope

    def sides(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return by how much each Bézier point keeps inside each side of its cell, and the slopes."""
        return self.side_offsets + self.side_slopes @ x, self.side_slopes

    def _passes(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the points at the discs, from their centres, (n, 2), and the slopes of both coordinates, (n, 2, m)."""
        from scipy.linalg import block_diag

        loop = self.loop_at(x)
        count = len(loop.points)
        by_modes = np.kron(basis_rows(loop.passes, count) @ self.shape, np.eye(2))
        speed = basis_rows(loop.passes, count, 1) @ loop.points
        by_moves = self.unit * block_diag(*speed[:, :, None])[:, 1:]
        slopes = np.hstack([by_modes, by_moves])
        off = loop.passed() - self.discs.centers
        return off, slopes.reshape(*off.shape, -1)

    def disc_slack(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return how far inside the discs with an interior the loop passes, r − d²/r, and the slopes."""
        off, slopes = (values[self.is_round] for values in self._passes(x))
        radii = self.discs.radii[self.is_round]
        scaled = off / radii[:, None]
        slack = radii - np.sum(off * scaled, axis=1)
        return slack, -2.0 * np.einsum("na,nam->nm", scaled, slopes)

    def point_gap(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return how far the loop passes from discs that are points, both coordinates, and the slopes."""
        off, slopes = (values[~self.is_round] for values in self._passes(x))
        return off.ravel(), slopes.reshape(-1, len(x))

    def best(self, until: float) -> SmoothLoop:
        """Return the best loop, by sequential quadratic programming from the loop itself; TimeoutError if it is late."""
        chosen = self.sides(self.origin)[0] < _CHOSEN
        while True:
            x = self._best_within(chosen, until)
            crossed = self.sides(x)[0] < -_SLACK
            if not (crossed & ~chosen).any():
                return self.loop_at(x)
            chosen |= crossed

    def _best_within(self, chosen: BoolArray, until: float) -> FloatArray:
        """Return the unknowns of the best loop that keeps within the chosen sides of cells, and passes the discs."""
        from scipy.optimize import minimize

        def effort(x: FloatArray) -> tuple[float, FloatArray]:
            if monotonic() > until:
                raise TimeoutError
            return self.effort(x)

        offsets = self.side_offsets[chosen]
        slopes = self.side_slopes[chosen]
        result: Any = minimize(  # type: ignore[call-overload]
            effort,
            self.origin,
            jac=True,
            method="SLSQP",
            bounds=self.bounds,
            constraints=[
                _constraint("ineq", lambda x: (offsets + slopes @ x, slopes)),
                _constraint("ineq", self.disc_slack),
                _constraint("eq", self.point_gap),
            ],
            options={
                "maxiter": _MOST_STEPS,
                "ftol": 1e-12 * self.effort(self.origin)[0],
            },
        )
        return np.asarray(result.x)

    def stationarity(self) -> tuple[float, list[int], bool]:
        """Return the residual of the first-order conditions, which discs hold the loop, and whether the border does.

        The residual is the distance from the slope of the effort to the nearest combination of the slopes of active
        constraints, nonnegative for inequalities, as a fraction; its square is about the relative decrease left.
        """
        from scipy.optimize import nnls

        slope = self.effort(self.origin)[1]
        side, side_slopes = self.sides(self.origin)
        slack, slack_slopes = self.disc_slack(self.origin)
        _, gap_slopes = self.point_gap(self.origin)
        near = side_slopes[side < _ACTIVE]
        touched = slack < _ACTIVE
        columns = np.concatenate([near, slack_slopes[touched], gap_slopes, -gap_slopes])
        if not len(columns):
            return 1.0, [], False
        columns /= np.linalg.norm(columns, axis=1, keepdims=True)
        multipliers, remaining = nnls(columns.T, slope, maxiter=10 * sum(columns.shape))
        acting = multipliers > 1e-6 * np.linalg.norm(slope)
        by_border, by_discs, _ = np.split(
            acting, [len(near), len(near) + touched.sum()]
        )
        held = np.flatnonzero(self.is_round)[touched][by_discs]
        discs = np.union1d(held, np.flatnonzero(~self.is_round))
        residual = float(remaining / np.linalg.norm(slope))
        return residual, discs.tolist(), bool(by_border.any())


def _constraint(kind: str, values: Constraint) -> dict[str, Any]:
    """Return a constraint as scipy takes it, of a function that returns values and their slopes."""
    return {
        "type": kind,
        "fun": lambda x: values(x)[0],
        "jac": lambda x: values(x)[1],
    }


@cache
def _modes(count: int) -> tuple[FloatArray, FloatArray]:
    """Return the matrix that gives control points from unknowns in which the effort is ½‖z‖², and its inverse."""
    size, modes = np.linalg.eigh(effort_matrix(count))
    size[0] = _STILL * size[1]
    scale = np.sqrt(2 * count * size)
    return modes / scale, scale[:, None] * modes.T
