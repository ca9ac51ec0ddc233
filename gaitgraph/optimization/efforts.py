"""The smooth loop of least tilt-rate effort through discs, inside a polygon.

The loop is a periodic cubic spline, its effort a convex quadratic form of the control points. Inside a polygon the
problem is not convex; it is solved as a sequence of convex ones. Around the hull of each piece of the curve lies a
convex cell inside the polygon (:mod:`gaitgraph.optimization.corridors`). While every hull stays in its cell the whole
curve stays inside, between samples too. The best spline within the cells is found
(:mod:`gaitgraph.optimization.programs`), and the cells are drawn anew around it. When each disc is passed is unknown too:
it moves a little, to first order, and is then held fixed for a second programme, which makes the loop admissible
again. Last, sequential quadratic programming settles discs and passes exactly. Each loop of the sequence is
admissible, and its effort is less than that of the one before. What it ends in is a local optimum.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from gaitgraph.optimization.corridors import Sides
from gaitgraph.optimization.programs import PARTS, Discs, Program, SmoothLoop
from gaitgraph.optimization.splines import basis_rows, control_points_along, hull_matrix

if TYPE_CHECKING:
    from shapely import Polygon

__all__ = ["LeastEffort"]

FloatArray = npt.NDArray[np.float64]

_FAR, _NEAR = 0.2, 0.03  # how far cells reach in the first rounds, and when the loop is settled [rad]
_PROGRESS, _SETTLED = 1e-4, 1e-10  # relative decrease that ends the first rounds, and the last
_MOST_ROUNDS, _LAST_ROUNDS = 40, 6


@dataclass(slots=True)
class LeastEffort:
    """The problem: discs, a polygon, and how far the loop keeps from its border.

    Parameters
    ----------
    polygon
        Where the loop must stay.
    discs
        What it must pass.
    clearance
        Distance that it keeps from the polygon's border, positive [rad].
    """

    polygon: Polygon
    discs: Discs
    clearance: float
    _sides: Sides = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self._sides = Sides(self.polygon)

    def keeps_inside(self, points: FloatArray) -> bool:
        """Return whether the hull of every part of the spline lies inside the polygon, clear of its border."""
        import shapely

        if not len(points):
            return False
        hulls = hull_matrix(len(points), PARTS) @ points
        shapes = shapely.convex_hull(shapely.multipoints(hulls))
        if not shapely.covers(self.polygon, shapes).all():
            return False
        return bool(shapely.distance(self.polygon.boundary, shapes).min() >= 0.9 * self.clearance)

    def start(self, corners: FloatArray, stops: npt.NDArray[np.int64], pieces: int) -> SmoothLoop | None:
        """Return a spline along a closed polygon of straight legs, or None if it comes too near to the border.

        Parameters
        ----------
        corners
            The legs' corners, shape (m, 2).
        stops
            Which corner is in each disc, shape (n,), the first 0.
        pieces
            Number of control points, at least; more are taken if the polygon has more than a third as many corners.
        """
        points, knots = control_points_along(corners, pieces)
        return SmoothLoop(points=points, passes=knots[stops].astype(float)) if self.keeps_inside(points) else None

    def evened(self, loop: SmoothLoop) -> SmoothLoop | None:
        """Return a spline near a loop that runs at even speed, or None if it leaves the polygon.

        Control points are points of the loop, an even length apart: corners are cut. It may miss its discs.
        """
        count = len(loop.points)
        fine = 16
        s = np.arange(count * fine) / fine
        on_it = basis_rows(s, count) @ loop.points
        step = np.linalg.norm(np.roll(on_it, -1, axis=0) - on_it, axis=1)
        gone = np.concatenate([[0.0], np.cumsum(step)])
        if not gone[-1] > 0:
            return None
        # The curve of equal control points P, P, P is at P in the middle one of them.
        at = np.mod((np.arange(count) - 1) / count, 1.0) * gone[-1]
        closed = np.vstack([on_it, on_it[:1]])
        points = np.column_stack([np.interp(at, gone, closed[:, k]) for k in range(2)])
        if not self.keeps_inside(points):
            return None
        when = np.interp(loop.passes, np.append(s, count), gone) / gone[-1] * count
        return SmoothLoop(points=points, passes=when - when[0])

    def solve(self, loop: SmoothLoop) -> tuple[SmoothLoop, list[float]]:
        """Return the loop that a start leads to, and the effort of every admissible loop on the way.

        If the start is not admissible itself, the history is empty.
        """
        if not self._admissible(loop):
            return loop, []
        best, history = loop, [loop.effort]

        def take(found: SmoothLoop | None) -> bool:
            nonlocal best
            if found is None or not self._admissible(found) or found.effort >= history[-1]:
                return False
            best = found
            history.append(found.effort)
            return True

        trust = 2.0
        for number in range(_MOST_ROUNDS):
            before = history[-1]
            ahead = self._projected(best, trust)
            moved = take(self._projected(ahead)) if ahead is not None else False
            trust = min(1.5 * trust, len(best.points) / 8) if moved else trust / 3
            even = self.evened(best) if number < 4 else None
            smoothed = take(self._projected(even)) if even is not None else False
            moved = moved or smoothed
            if trust < 1e-3 or (moved and before - history[-1] <= _PROGRESS * before):
                break
        for _ in range(_LAST_ROUNDS):
            before = history[-1]
            if not take(self._refined(best)) or before - history[-1] <= _SETTLED * before:
                break
        return best, history

    def _admissible(self, loop: SmoothLoop) -> bool:
        return self.discs.misses(loop.passed()) <= 1e-9 and self.keeps_inside(loop.points)

    def _step(self, loop: SmoothLoop, reach: float) -> Program:
        hulls = hull_matrix(len(loop.points), PARTS) @ loop.points
        return Program(loop, self.discs, self._sides.cells(hulls, clearance=self.clearance, reach=reach))

    def _projected(self, loop: SmoothLoop, trust: float = 0.0) -> SmoothLoop | None:
        """Return the best spline within the cells around a loop, its passes moved by at most `trust`, or None."""
        return self._step(loop, _FAR).projected(trust)

    def _refined(self, loop: SmoothLoop) -> SmoothLoop | None:
        """Return the best spline within small cells around a loop, discs and passes taken as they are."""
        return self._step(loop, _NEAR).refined()

    def stationarity(self, loop: SmoothLoop) -> tuple[float, tuple[int, ...], bool]:
        """Return what :meth:`gaitgraph.optimization.programs.Program.stationarity` does for a loop."""
        if not loop.effort > 0:
            return 0.0, (), False
        return self._step(loop, _NEAR).stationarity()
