"""The best loop within given convex cells: a projection, then sequential quadratic programming.

In unknowns scaled by the modes of the effort, the effort is half the squared distance from the origin. The best spline
whose hulls stay in given cells is then the point of a polyhedron that is nearest to the origin: Lawson and Hanson's
least distance programming, which nonnegative least squares solves. When a disc is passed is unknown too; it enters to
first order, within a trust region.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.optimization.splines import basis_rows, effort_matrix, hull_matrix

if TYPE_CHECKING:
    from gaitgraph.optimization.corridors import HalfPlanes

__all__ = ["PARTS", "Discs", "Program", "SmoothLoop"]

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]

PARTS = 1
"""Equal parts of each piece whose hulls stay in cells."""

_SLACK = 1e-10
_NEAR = 0.02  # sides of cells this near are constraints from the beginning, others when they are crossed [rad]
_MOST_ROUNDS = 30
_ACTIVE = 1e-6
_SIDES = 32  # discs count as polygons where they must be linear
_STILL = 1e-2  # weight of moving the loop as a whole, which costs no effort, against that of its lowest mode


@dataclass(frozen=True, slots=True, kw_only=True)
class Discs:
    """Discs to pass, in order; a radius of zero is a point.

    Parameters
    ----------
    centers
        Shape (n, 2) [rad].
    radii
        Shape (n,) [rad].
    """

    centers: FloatArray
    radii: FloatArray

    @property
    def round(self) -> BoolArray:
        """Which discs have an interior, shape (n,)."""
        return self.radii > 0

    def misses(self, points: FloatArray) -> float:
        """Return how far outside its disc the farthest of n points lies [rad]."""
        return float(np.max(np.linalg.norm(points - self.centers, axis=1) - self.radii))


@dataclass(frozen=True, slots=True, kw_only=True)
class SmoothLoop:
    """A spline and where it passes the discs.

    Parameters
    ----------
    points
        Control points, shape (K, 2) [rad].
    passes
        The parameter at which each disc is passed, increasing, the first 0, shape (n,).
    """

    points: FloatArray
    passes: FloatArray

    @property
    def effort(self) -> float:
        """∫ (α̇1² + α̇2²) dt over a period of one second [rad²/s]."""
        count, from_first = len(self.points), self.points - self.points[0]
        return float(count * np.sum(from_first * (effort_matrix(count) @ from_first)))

    def passed(self) -> FloatArray:
        """Return the points at which the discs are passed, shape (n, 2) [rad]."""
        return np.asarray(basis_rows(self.passes, len(self.points)) @ self.points)


class Program:
    """The problem within given cells, in scaled unknowns.

    In the unknowns z the effort is ½‖z‖², but for the first two, which move the loop as a whole; the last n − 1
    unknowns move the parameters at which the discs are passed.
    """

    def __init__(self, loop: SmoothLoop, discs: Discs, cells: HalfPlanes) -> None:
        count = len(loop.points)
        self.loop, self.discs, self.count = loop, discs, count
        self.later = len(loop.passes) - 1
        self.shape, inverse = _modes(count)
        self.rows = (hull_matrix(count, PARTS) @ self.shape)[cells.piece].reshape(-1, count)
        self.normals = np.repeat(cells.normals, 4, axis=0)
        self.offsets = np.repeat(cells.offsets, 4)
        self.on_border = np.repeat(cells.on_border, 4)
        self.origin = np.concatenate([(inverse @ loop.points).ravel(), np.zeros(self.later)])
        self.unit = 0.5 * count / len(loop.passes) / max(math.sqrt(loop.effort), 1e-9)

    def _split(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        z = x[: 2 * self.count].reshape(self.count, 2)
        passes = self.loop.passes.copy()
        passes[1:] += self.unit * x[2 * self.count :]
        return z, passes

    def loop_at(self, x: FloatArray) -> SmoothLoop:
        """Return the loop that unknowns mean."""
        z, passes = self._split(x)
        return SmoothLoop(points=self.shape @ z, passes=passes)

    def effort(self, x: FloatArray) -> float:
        """Return the effort in one second."""
        return 0.5 * float(np.sum(x[2 : 2 * self.count] ** 2))

    def effort_slope(self, x: FloatArray) -> FloatArray:
        """Return the slope of the effort."""
        slope = np.zeros_like(x)
        slope[2 : 2 * self.count] = x[2 : 2 * self.count]
        return slope

    def bounds(self) -> list[tuple[float, float]]:
        """Return how far passes may move: less than half the way to the next, so that they stay in order."""
        half = np.diff(np.append(self.loop.passes, self.count)) / 2 / self.unit
        return [(-before, after) for before, after in pairwise(half.tolist())]

    def slack(self, x: FloatArray) -> FloatArray:
        """Return by how much each Bézier point keeps inside each side of its cell."""
        return np.asarray(self.offsets - np.sum(self.normals * (self.rows @ self._split(x)[0]), axis=1))

    def slack_slope(self, chosen: BoolArray) -> FloatArray:
        """Return the slopes of chosen slacks, which are constant."""
        out = np.zeros((int(chosen.sum()), len(self.origin)))
        slopes = self.rows[chosen][:, :, None] * self.normals[chosen][:, None, :]
        out[:, : 2 * self.count] = -slopes.reshape(-1, 2 * self.count)
        return out

    def at_discs(self, x: FloatArray, chosen: BoolArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return points at chosen discs, from the centres, (k, 2), and their slopes in each direction, (2, k, …)."""
        z, passes = self._split(x)
        which = np.flatnonzero(chosen)
        rows = basis_rows(passes[which], self.count) @ self.shape
        speed = basis_rows(passes[which], self.count, 1) @ self.shape @ z
        slopes = np.zeros((2, len(which), len(x)))
        for axis in range(2):
            slopes[axis, :, axis : 2 * self.count : 2] = rows
            for k, disc in enumerate(which.tolist()):
                if disc:
                    slopes[axis, k, 2 * self.count + disc - 1] = self.unit * speed[k, axis]
        return rows @ z - self.discs.centers[which], slopes[0], slopes[1]

    def disc_slack(self, x: FloatArray) -> FloatArray:
        """Return how far inside the discs with an interior the loop passes: r − d²/r."""
        off = self.at_discs(x, self.discs.round)[0]
        radii = self.discs.radii[self.discs.round]
        return np.asarray(radii - np.sum(off**2, axis=1) / radii)

    def disc_slope(self, x: FloatArray) -> FloatArray:
        """Return the slopes of :meth:`disc_slack`."""
        off, first, second = self.at_discs(x, self.discs.round)
        scaled = -2.0 * off / self.discs.radii[self.discs.round][:, None]
        return np.asarray(scaled[:, :1] * first + scaled[:, 1:] * second)

    def point_gap(self, x: FloatArray) -> FloatArray:
        """Return how far the loop passes from discs that are points, both coordinates."""
        return np.asarray(self.at_discs(x, ~self.discs.round)[0].T.ravel())

    def point_slope(self, x: FloatArray) -> FloatArray:
        """Return the slopes of :meth:`point_gap`."""
        return np.concatenate(self.at_discs(x, ~self.discs.round)[1:])

    def projected(self, trust: float) -> SmoothLoop | None:
        """Return the best loop, to first order in the passes, each of which moves by at most `trust`; or None.

        Discs count as polygons inside them, with a corner where the loop passes now. Moving a pass costs as much as its
        square in units of twice the trust.
        """
        x, size = self.origin, 2 * self.count
        scale = np.ones(len(x))
        scale[size:] = 2 * trust / self.unit
        round_ = self.discs.round
        off, first, second = self.at_discs(x, round_)
        ways = np.arctan2(off[:, 1], off[:, 0]) + (np.arange(_SIDES) + 0.5)[:, None] * (2 * math.pi / _SIDES)
        cosine, sine = np.cos(ways), np.sin(ways)
        sides = (cosine[..., None] * first + sine[..., None] * second).reshape(-1, len(x))
        apothem = self.discs.radii[round_] * math.cos(math.pi / _SIDES)
        room = (apothem - cosine * off[:, 0] - sine * off[:, 1]).ravel()
        always, most = sides, room
        if trust and self.later:
            moves = np.eye(self.later, len(x), size)
            bounds = np.array(self.bounds())
            farthest = np.minimum(trust / self.unit, 0.9 * np.stack([bounds[:, 1], -bounds[:, 0]]))
            always, most = np.concatenate([sides, moves, -moves]), np.concatenate([room, *farthest])
        # In unknowns whose squared distance from the origin is to be least; the loop as a whole stays near where it is.
        equal, gap = self.point_slope(x) * scale, -self.point_gap(x)
        start = x / np.where(scale > 0, scale, 1.0)
        start[:2] = 0.0
        gap = gap + equal @ start
        free, base = np.eye(len(x)), np.zeros(len(x))
        if len(gap):
            across, triangle = np.linalg.qr(equal.T, mode="complete")
            k = len(gap)
            if np.abs(np.diag(triangle[:k])).min() < 1e-9 * np.abs(triangle).max():
                return None  # two points are to be passed at once
            base = across[:, :k] @ np.linalg.solve(triangle[:k].T, gap)
            free = across[:, k:]
        length = math.sqrt(2 * self.loop.effort) + 1e-9
        slack = self.slack(x)
        chosen = slack < _NEAR
        for _ in range(_MOST_ROUNDS):
            rows = np.concatenate([-self.slack_slope(chosen), always]) * scale
            limits = np.concatenate([slack[chosen], most]) + rows @ (start - base)
            lefts = np.vstack([-(rows @ free).T, -limits[None] / length])
            right = np.zeros(len(lefts))
            right[-1] = 1.0
            try:
                multipliers, remaining = _nonnegative(lefts, right)
            except RuntimeError:
                return None
            if remaining < 1e-7:
                return None  # no loop is in all cells and discs
            residual = lefts @ multipliers - right
            step = residual[:-1] * (-length / residual[-1])
            if np.max(rows @ (free @ step) - limits, initial=0.0) > _SLACK:
                return None
            best = (base + free @ step) * scale
            best[:2] += x[:2]
            crossed = self.slack(best) < -_SLACK
            if not (crossed & ~chosen).any():
                return self.loop_at(best)
            chosen |= crossed
        return None

    def refined(self) -> SmoothLoop | None:
        """Return the best loop, by sequential quadratic programming from the loop itself, or None if it fails."""
        from scipy.optimize import minimize

        chosen = self.slack(self.origin) < _NEAR / 2
        for _ in range(6):
            constraints: list[Any] = []
            if chosen.any():
                slope = self.slack_slope(chosen)
                base = self.slack(np.zeros_like(self.origin))[chosen]
                inside = {"type": "ineq", "fun": lambda x, b=base, a=slope: b + a @ x, "jac": lambda _, a=slope: a}
                constraints.append(inside)
            if self.discs.round.any():
                constraints.append({"type": "ineq", "fun": self.disc_slack, "jac": self.disc_slope})
            if not self.discs.round.all():
                constraints.append({"type": "eq", "fun": self.point_gap, "jac": self.point_slope})
            found: Any = minimize(  # type: ignore[call-overload]
                self.effort,
                self.origin,
                jac=self.effort_slope,
                method="SLSQP",
                bounds=[(None, None)] * (2 * self.count) + self.bounds(),
                constraints=constraints,
                options={"maxiter": 60, "ftol": 1e-12 * self.effort(self.origin)},
            )
            crossed = self.slack(found.x) < -_SLACK
            if not (crossed & ~chosen).any():
                return self.loop_at(found.x)
            chosen |= crossed
        return None

    def stationarity(self) -> tuple[float, tuple[int, ...], bool]:
        """Return the residual of the first-order conditions, which discs hold the loop, and whether the border does.

        The first-order (Karush–Kuhn–Tucker) conditions ask for multipliers, not negative for inequalities, with which
        the slope of the effort is a combination of the slopes of the active constraints. The nearest combination is
        found by nonnegative least squares, in the norm of the effort itself. What remains, as a fraction of the slope,
        is returned: its square is about the largest relative decrease that first order still promises.
        """
        x = self.origin
        slope = self.effort_slope(x)
        near = (self.slack(x) < _ACTIVE) & self.on_border
        touched = self.disc_slack(x) < _ACTIVE
        equal = self.point_slope(x)
        columns = np.concatenate([self.slack_slope(near), self.disc_slope(x)[touched], equal, -equal]).T
        size = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
        multipliers, remaining = _nonnegative(columns / size, slope)
        acting = multipliers > 1e-6 * np.linalg.norm(slope)
        borders = int(near.sum())
        held = np.flatnonzero(self.discs.round)[touched][acting[borders : borders + int(touched.sum())]]
        discs = (*held.tolist(), *np.flatnonzero(~self.discs.round).tolist())
        return float(remaining / np.linalg.norm(slope)), tuple(sorted(discs)), bool(acting[:borders].any())


def _nonnegative(columns: FloatArray, target: FloatArray) -> tuple[FloatArray, float]:
    """Return the nonnegative combination of columns, some or none, that is nearest to a target, and how far it is."""
    from scipy.optimize import nnls

    if not columns.shape[1]:
        return np.zeros(0), float(np.linalg.norm(target))
    multipliers, remaining = nnls(columns, target, maxiter=10 * len(columns) + 10 * columns.shape[1])
    return np.asarray(multipliers), float(remaining)


@cache
def _modes(count: int) -> tuple[FloatArray, FloatArray]:
    """Return the matrix that gives control points from unknowns in which the effort is ½‖z‖², and its inverse."""
    size, modes = np.linalg.eigh(effort_matrix(count))
    size[0] = _STILL * size[1]
    scale = np.sqrt(2 * count * size)
    return modes / scale, scale[:, None] * modes.T
