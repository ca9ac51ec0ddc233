"""Periodic uniform cubic splines of (α1, α2), and convex cells that keep them inside a polygon.

Piece j, local parameter t from 0 to 1, is a cubic of the control points j to j + 3, counted modulo their number K. Each
piece lies in the convex hull of its Bézier points: what holds for the hulls holds for the curve between any samples. A
run of three equal control points makes the curve pass through them, and hulls that touch such a point are segments.

The *effort* of a spline run once in the period T, at K/T pieces per second, is the integral over the period of the
squared rate of all four tilt angles, on red

    ∫ ‖α̇‖² dt = 2·∫ (α̇1² + α̇2²) dt = 2·(K/T)·Σ Pᵀ·G·P   [rad²/s],

where G, cyclic, holds the integrals of products of the derivatives of the basis: 2/3, −1/8, −1/5, −1/120 by distance.
By the Cauchy–Schwarz inequality it is at least (length in four dimensions)²/T, and equal to that at constant speed.

Two disjoint convex sets are separated by the line across the shortest segment between them. So each side of a polygon
that is near a piece gives a half-plane with all of the side beyond it; a few of them shut out all sides. Whatever moves
within its cell stays inside the polygon: the cell meets no side, and holds a piece that is inside.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import shapely

if TYPE_CHECKING:
    from shapely import Polygon

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

FEWEST_PIECES = 8
"""Fewer control points would meet themselves around the loop."""

# Coefficients of the four basis functions of a piece in powers of t, constant first.
_BASIS = np.array([[1, -3, 3, -1], [4, 0, -6, 3], [1, 3, 3, -3], [0, 0, 0, 1]]) / 6.0
_PRODUCTS = (2 / 3, -1 / 8, -1 / 5, -1 / 120)
_BEYOND = 1e-12
_PAIRS = ((0, 1), (1, 2), (2, 3), (0, 2), (1, 3), (0, 3))


def basis_rows(s: npt.ArrayLike, count: int, derivative: int = 0) -> FloatArray:
    """Return the rows that give the spline, or a derivative of it by s, from its control points.

    Parameters
    ----------
    s
        Parameters, shape (m,): piece j runs from s = j to j + 1; periodic with `count`.
    count
        Number K of control points.
    derivative
        0 to 3.

    Returns
    -------
    array of shape (m, count)
        Times control points of shape (count, 2) these are points, or derivatives.

    Examples
    --------
    >>> basis_rows([0.0], 8)[0, :4].round(4).tolist()
    [0.1667, 0.6667, 0.1667, 0.0]
    """
    at = np.mod(np.atleast_1d(np.asarray(s, dtype=float)), count)
    piece = np.minimum(at.astype(np.int64), count - 1)
    powers = np.zeros((at.size, 4))
    for k in range(derivative, 4):
        powers[:, k] = math.perm(k, derivative) * (at - piece) ** (k - derivative)
    rows = np.zeros((at.size, count))
    columns = (piece[:, None] + np.arange(4)) % count
    np.put_along_axis(rows, columns, powers @ _BASIS.T, axis=1)
    return rows


@lru_cache(maxsize=16)
def hull_matrix(count: int) -> FloatArray:
    """Return what gives the Bézier points of every piece from `count` control points, (count, 4, count), read-only."""
    # The blossom of a cubic, its symmetric form in three parameters, gives Bézier points: [0,0,0], [0,0,1], …
    x, y, z = np.array([[0.0] * (3 - k) + [1.0] * k for k in range(4)]).T
    bezier = np.stack([np.ones(4), (x + y + z) / 3, (x * y + y * z + z * x) / 3, x * y * z], axis=-1) @ _BASIS.T
    out = np.zeros((count, 4, count))
    for piece in range(count):
        for k in range(4):
            out[piece, :, (piece + k) % count] += bezier[:, k]
    out.flags.writeable = False
    return out


def effort_matrix(count: int) -> FloatArray:
    """Return the cyclic matrix G of the effort, shape (count, count); its null space are the loops that stand still."""
    first = np.zeros(count)
    for distance, product in enumerate(_PRODUCTS):
        first[distance] += product
        if distance:
            first[-distance] += product
    index = np.arange(count)
    return np.asarray(first[(index[None, :] - index[:, None]) % count])


def power_pieces(points: FloatArray, width: float) -> FloatArray:
    """Return the pieces as polynomials in powers of a local parameter from 0 to `width`, highest first, (4, K, 2)."""
    # From the first point, so that a spline that stands still does so exactly.
    around = np.stack([np.roll(points - points[0], -k, axis=0) for k in range(4)])
    rising = np.einsum("kp,kjd->pjd", _BASIS, around)
    rising[0] += points[0]
    return np.asarray(rising[::-1] / width ** np.arange(3, -1, -1).reshape(4, 1, 1))


def control_points_along(corners: FloatArray, pieces: int) -> tuple[FloatArray, npt.NDArray[np.int64]]:
    """Return control points of a spline that runs along a closed polygon exactly, resting at its corners.

    Parameters
    ----------
    corners
        The polygon, shape (m, 2), m ≥ 1.
    pieces
        Number of control points wanted; three for each corner are the least. The others are shared among the sides
        by length.

    Returns
    -------
    points
        Shape (K, 2), the first three at the first corner.
    knots
        The parameter at which each corner is met, shape (m,).

    Examples
    --------
    >>> points, knots = control_points_along(np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]), 12)
    >>> len(points), knots.tolist(), (basis_rows(knots, 12) @ points).round(12).tolist()
    (12, [0, 4, 9], [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    """
    m = len(corners)
    total = max(pieces, 3 * m, FEWEST_PIECES)
    ends: FloatArray = np.roll(corners, -1, axis=0)
    length = np.linalg.norm(ends - corners, axis=1)
    share = length / length.sum() if length.sum() > 0 else np.full(m, 1.0 / m)
    # A corner's own three count as half of each of its sides.
    wanted = np.maximum(share * total - 3.0, 0.0)
    spare = total - 3 * m
    exact = wanted / wanted.sum() * spare if wanted.sum() > 0 else np.full(m, spare / m)
    inside = np.floor(exact).astype(np.int64)
    for k in np.argsort(inside - exact, kind="stable")[: spare - int(inside.sum())]:
        inside[k] += 1
    out, knots = [], []
    count = 0
    for corner, end, extra in zip(corners, ends, inside.tolist(), strict=True):
        knots.append(count)
        out += [corner] * 3 + [corner + (end - corner) * k / (extra + 1) for k in range(1, extra + 1)]
        count += 3 + extra
    return np.array(out), np.array(knots, dtype=np.int64)


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
    def round(self) -> npt.NDArray[np.bool_]:
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


@dataclass(frozen=True, slots=True, kw_only=True)
class HalfPlanes:
    """Half-planes normal·x ≤ offset, each of the cell of one piece.

    Parameters
    ----------
    normals, offsets
        Unit normals, shape (r, 2), and offsets, shape (r,).
    piece
        The piece that each belongs to, shape (r,).
    on_border
        Whether a side of the polygon made it, or the reach of the cell, shape (r,).
    """

    normals: FloatArray
    offsets: FloatArray
    piece: IntArray
    on_border: npt.NDArray[np.bool_]


class Sides:
    """The sides of a polygon with holes, prepared for cells.

    Examples
    --------
    >>> from shapely import box
    >>> sides = Sides(box(0, 0, 1, 1))
    >>> hull = np.array([[[0.4, 0.5], [0.5, 0.5], [0.6, 0.5], [0.6, 0.6]]])
    >>> cells = sides.cells(hull, clearance=0.0, reach=1.0)
    >>> sorted(zip(cells.normals[cells.on_border].tolist(), cells.offsets[cells.on_border].tolist()))
    [([-1.0, 0.0], 0.0), ([0.0, -1.0], 0.0), ([0.0, 1.0], 1.0), ([1.0, 0.0], 1.0)]
    """

    def __init__(self, polygon: Polygon) -> None:
        rings = [np.asarray(ring.coords) for ring in (polygon.exterior, *polygon.interiors)]
        self.starts = np.concatenate([ring[:-1] for ring in rings])
        self.ends = np.concatenate([ring[1:] for ring in rings])
        lines: Any = shapely.linestrings(np.stack([self.starts, self.ends], axis=1))
        self._tree = shapely.STRtree(lines)

    def cells(self, hulls: FloatArray, *, clearance: float, reach: float) -> HalfPlanes:
        """Return a convex cell around each piece.

        Parameters
        ----------
        hulls
            Four points each, whose convex hull lies inside the polygon, at least about `clearance` from the border,
            shape (h, 4, 2).
        clearance
            Distance that a cell keeps from the border, positive unless no piece touches it.
        reach
            How far a cell goes beyond the bounding box of its piece; sides farther away are not looked at.
        """
        low, high = hulls.min(axis=1) - reach, hulls.max(axis=1) + reach
        boxes = shapely.box(
            low[:, 0] - clearance, low[:, 1] - clearance, high[:, 0] + clearance, high[:, 1] + clearance
        )
        owner, side = self._tree.query(boxes)
        order = np.lexsort((side, owner))
        owner, side = owner[order], side[order]
        on_hull, on_side, distance = _shortest_segments(hulls[owner], self.starts[side], self.ends[side])
        normals, offsets, piece = [], [], []
        bounds = np.searchsorted(owner, np.arange(len(hulls) + 1))
        for number in range(len(hulls)):
            first, last = int(bounds[number]), int(bounds[number + 1])
            left = first + np.argsort(distance[first:last], kind="stable")
            while left.size:
                nearest = left[0]
                normal = (on_side[nearest] - on_hull[nearest]) / max(float(distance[nearest]), 1e-300)
                offset = float(normal @ on_side[nearest])
                normals.append(normal)
                offsets.append(offset - clearance)
                piece.append(number)
                sides = side[left]
                nearer = np.minimum(self.starts[sides] @ normal, self.ends[sides] @ normal)
                left = left[1:][nearer[1:] < offset - _BEYOND]
        count = len(hulls)
        axes = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
        boxed = np.concatenate([high, -low], axis=1)
        return HalfPlanes(
            normals=np.concatenate([np.array(normals).reshape(-1, 2), np.tile(axes, (count, 1))]),
            offsets=np.concatenate([np.array(offsets), boxed.ravel()]),
            piece=np.concatenate([np.array(piece, dtype=np.int64), np.repeat(np.arange(count), 4)]),
            on_border=np.arange(len(offsets) + 4 * count) < len(offsets),
        )


def _shortest_segments(
    hulls: FloatArray, starts: FloatArray, ends: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return both ends of the shortest segment from each hull of four points to a side beside it, and its length.

    Between disjoint convex polygons, segments included, the shortest segment ends at a corner of one of the two.
    """
    tried = [(hulls[:, k], _nearest(hulls[:, k], starts, ends)) for k in range(4)]
    tried += [(_nearest(tip, hulls[:, i], hulls[:, j]), tip) for i, j in _PAIRS for tip in (starts, ends)]
    from_hull, to_side = (np.stack([pair[k] for pair in tried]) for k in range(2))
    step = to_side - from_hull
    length = np.sqrt(np.einsum("wmk,wmk->wm", step, step))
    best, each = np.argmin(length, axis=0), np.arange(length.shape[1])
    return from_hull[best, each], to_side[best, each], length[best, each]


def _nearest(points: FloatArray, starts: FloatArray, ends: FloatArray) -> FloatArray:
    """Return the nearest points on segments, shape (m, 2)."""
    step = ends - starts
    size = np.maximum(np.einsum("mk,mk->m", step, step), 1e-300)
    fraction = np.clip(np.einsum("mk,mk->m", points - starts, step) / size, 0.0, 1.0)
    return np.asarray(starts + fraction[:, None] * step)
