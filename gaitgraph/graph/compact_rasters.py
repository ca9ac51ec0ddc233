"""Which nodes of a grid the user's polygons allow, and which steps between them must be asked one by one.

A step from a node leads at most one grid step away in α1 and in α2. A node that is farther than that from the outline
of every polygon lies, with all its steps, wholly inside or wholly outside; and so does its neighbour if that one is
far from them too. So one question for each patch of such nodes settles it, whatever the grid's size.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from gaitgraph.surface.region import Zones

__all__ = ["zone_raster"]

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]

_MARGIN = 1e-6
"""What a node is kept farther from an outline than a step [rad]: zones count what is within 1e-9 rad as on it."""


def zone_raster(zones: Zones, axis: FloatArray) -> tuple[BoolArray, BoolArray]:
    """Return which grid nodes zones allow, and which of them have steps that must be asked, both (n, n).

    Parameters
    ----------
    zones
        The user's polygons.
    axis
        The values of α1, and of α2, of the grid's nodes, evenly spaced and increasing, shape (n,) [rad].

    Returns
    -------
    allowed
        As :meth:`Zones.allow_points` says.
    near
        Allowed, and within a step of an outline. A step between two allowed nodes that are not near is allowed, as
        :meth:`Zones.allow_segments` would say.

    Examples
    --------
    >>> from gaitgraph.surface.region import Zones
    >>> allowed, near = zone_raster(Zones(keep_out=[[(0, 0), (2, 0), (2, 2), (0, 2)]]), np.arange(-3.0, 6.0))
    >>> int((~allowed).sum()), int(near.sum())  # the inner node (1, 1); two rings about it
    (1, 24)
    """
    from scipy.ndimage import label

    near = _near_outlines(zones, axis)
    patches, number = label(~near)
    # Any node of a patch speaks for it: of repeated places one is kept.
    speaker = np.zeros(number + 1, dtype=np.int64)
    speaker[patches.ravel()] = np.arange(patches.size)
    row, column = np.divmod(speaker, len(axis))
    verdict = zones.allow_points(np.column_stack([axis[row], axis[column]]))
    verdict[0] = False
    allowed = verdict[patches]
    row, column = np.nonzero(near)
    allowed[row, column] = zones.allow_points(np.column_stack([axis[row], axis[column]]))
    return allowed, near & allowed


def _near_outlines(zones: Zones, axis: FloatArray) -> BoolArray:
    """Return which nodes lie within a step and a margin of a side of a polygon, in α1 and in α2, shape (n, n)."""
    size = len(axis)
    reach = float(np.max(np.diff(axis))) + _MARGIN
    change = np.zeros((size, size + 1), dtype=np.int32)
    for polygon in (*zones.keep_out, *zones.keep_in):
        for (x0, y0), (x1, y1) in zip(polygon, (*polygon[1:], polygon[0]), strict=True):
            first, last = np.searchsorted(axis, [min(x0, x1) - reach, max(x0, x1) + reach])
            row = np.arange(first, last)
            # The part of the side whose α1 is within reach of the row, and the columns within reach of that part.
            ends = np.stack([axis[row] - reach, axis[row] + reach])
            part = (ends - x0) / (x1 - x0) if abs(x1 - x0) > _MARGIN else np.array([[0.0], [1.0]]) + 0 * ends
            part = np.clip(np.sort(part, axis=0), 0.0, 1.0)
            heights = y0 + part * (y1 - y0)
            low = np.searchsorted(axis, heights.min(axis=0) - reach - _MARGIN)
            high = np.searchsorted(axis, heights.max(axis=0) + reach + _MARGIN)
            np.add.at(change, (row, low), 1)
            np.add.at(change, (row, high), -1)
    return np.asarray(np.cumsum(change, axis=1, dtype=np.int32)[:, :-1] > 0)
