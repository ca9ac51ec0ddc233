"""Convex room to move: for each of many small convex pieces of a curve, a convex cell inside a polygon around it.

Two disjoint convex sets are separated by the line across the shortest way between them. So each side of the polygon
that is near a piece gives a half-plane with all of the side beyond it; a few of them shut out all sides. Whatever moves
within its cell stays inside the polygon: the cell meets no side, and holds a piece that is inside.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from shapely import Polygon

__all__ = ["HalfPlanes", "Sides"]

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

_BEYOND = 1e-12
_PAIRS = ((0, 1), (1, 2), (2, 3), (0, 2), (1, 3), (0, 3))


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
        import shapely

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
        import shapely

        low, high = hulls.min(axis=1) - reach, hulls.max(axis=1) + reach
        boxes = shapely.box(
            low[:, 0] - clearance, low[:, 1] - clearance, high[:, 0] + clearance, high[:, 1] + clearance
        )
        owner, side = self._tree.query(boxes)
        order = np.lexsort((side, owner))
        owner, side = owner[order], side[order]
        on_hull, on_side, distance = _shortest_ways(hulls[owner], self.starts[side], self.ends[side])
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


def _shortest_ways(
    hulls: FloatArray, starts: FloatArray, ends: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return both ends of the shortest way from each hull of four points to a segment beside it, and its length.

    Between disjoint convex polygons, segments included, a shortest way ends at a corner of one of the two.
    """
    ways = [(hulls[:, k], _nearest(hulls[:, k], starts, ends)) for k in range(4)]
    ways += [(_nearest(tip, hulls[:, i], hulls[:, j]), tip) for i, j in _PAIRS for tip in (starts, ends)]
    from_hull, to_side = (np.stack([way[k] for way in ways]) for k in range(2))
    way = to_side - from_hull
    length = np.sqrt(np.einsum("wmk,wmk->wm", way, way))
    best = np.argmin(length, axis=0)[None, :]
    taken = best[..., None]
    return (
        np.take_along_axis(from_hull, taken, axis=0)[0],
        np.take_along_axis(to_side, taken, axis=0)[0],
        np.take_along_axis(length, best, axis=0)[0],
    )


def _nearest(points: FloatArray, starts: FloatArray, ends: FloatArray) -> FloatArray:
    """Return the nearest points on segments, shape (m, 2)."""
    step = ends - starts
    size = np.maximum(np.einsum("mk,mk->m", step, step), 1e-300)
    fraction = np.clip(np.einsum("mk,mk->m", points - starts, step) / size, 0.0, 1.0)
    return np.asarray(starts + fraction[:, None] * step)
