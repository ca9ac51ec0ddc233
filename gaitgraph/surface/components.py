"""Regions of the (α1, α2) plane: components of the red sheet, and the user's own polygons.

On the red sheet R is a product of three factors,

    R = (2/(κ cos²δ)) · cos β1 · cos β2 · (2κ cos α1 cos α2 − sin(α1 − α2)),

so inside [−π/2, π/2]² it vanishes on two lines and one curve, and the signs of the factors label the seven
components that remain. Two points with different labels cannot be joined without a singular matrix; the label
of α = 0, all three positive, is what ordinary hover can reach.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import angle_from_text
from gaitgraph.errors import InputError, shown
from gaitgraph.vehicle import PAPER, Vehicle

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from shapely import Polygon
    from shapely.geometry.base import BaseGeometry

__all__ = ["HOVER_LABEL", "Zones", "red_label", "separating_factor"]

FloatArray = npt.NDArray[np.float64]

HOVER_LABEL = (1, 1, 1)
"""The label of the component of α = 0, which ordinary hover can reach."""

_BORDER = 1e-9
_FARTHEST = 1e6  # beyond it the border would be lost in rounding


def red_label(alpha1: npt.ArrayLike, alpha2: npt.ArrayLike, vehicle: Vehicle = PAPER) -> npt.NDArray[np.int64]:
    """Return the signs of the three factors of R on the red sheet, exact coefficients, shape (..., 3).

    The third is positive on the side of α = 0. Their product is the sign of R; a zero is singular.

    >>> red_label(0.0, 0.0).tolist(), red_label(1.178, -0.393).tolist()
    ([1, 1, 1], [1, 1, -1])
    """
    a1, a2 = np.asarray(alpha1, dtype=float), np.asarray(alpha2, dtype=float)
    kappa = vehicle.signed_drag_ratio
    delta = math.atan(kappa)
    saddle = math.copysign(1.0, kappa) * (2 * kappa * np.cos(a1) * np.cos(a2) - np.sin(a1 - a2))
    factors = np.stack(np.broadcast_arrays(np.cos(a1 - delta), np.cos(a2 + delta), saddle), axis=-1)
    return np.asarray(np.sign(factors).astype(np.int64))


def separating_factor(first: Sequence[float], second: Sequence[float], vehicle: Vehicle = PAPER) -> str | None:
    """Return what separates two points (α1, α2) of the red sheet with R ≠ 0, in words, or None.

    >>> separating_factor((0.0, 0.0), (1.178, -0.393))
    'the curve tan α1 − tan α2 = 2κ = 0.3373'
    """
    a, b = red_label(first[0], first[1], vehicle), red_label(second[0], second[1], vehicle)
    kappa = vehicle.signed_drag_ratio
    delta = math.atan(kappa)
    edge = math.copysign(math.pi / 2, delta)
    names = (
        f"the line α1 = {delta - edge:.4f} (β1 = ∓π/2)",
        f"the line α2 = {edge - delta:.4f} (β2 = ±π/2)",
        f"the curve tan α1 − tan α2 = 2κ = {2 * kappa:.4f}",
    )
    differing = [name for name, x, y in zip(names, a, b, strict=True) if x != y]
    return " and ".join(differing) or None


@dataclass(frozen=True, slots=True)
class Zones:
    """The user's own polygons in the (α1, α2) plane: stay out of these, stay inside those.

    Polygons are exact: their boundary is allowed and no margin is added. A point within 1e-9 rad of a boundary
    counts as on it.

    Parameters
    ----------
    keep_out
        Polygons whose interior is forbidden, each a sequence of (α1, α2) [rad, or texts].
    keep_in
        If any are given, the loop must stay in their union.

    Raises
    ------
    InputError
        If a polygon is malformed, crosses itself or has no area.

    Examples
    --------
    >>> zones = Zones(keep_out=[[(0, 0), (1, 0), (1, 1), (0, 1)]])
    >>> zones.allow_points([[0.5, 0.5], [1.0, 0.5]]).tolist()
    [False, True]
    """

    keep_out: Any = ()
    keep_in: Any = ()
    _forbidden: BaseGeometry | None = field(default=None, init=False, repr=False, compare=False)
    _permitted: BaseGeometry | None = field(default=None, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        import shapely

        for name in ("keep_out", "keep_in"):
            polygons = _polygons(getattr(self, name), name)
            if name == "keep_out" and polygons:
                region = shapely.union_all([polygon.buffer(-_BORDER, join_style="mitre") for polygon in polygons])
                object.__setattr__(self, "_forbidden", region)
            elif polygons:
                region = shapely.union_all(polygons).buffer(_BORDER, join_style="mitre")
                object.__setattr__(self, "_permitted", region)
            for area in (self._forbidden, self._permitted):
                if area is not None:
                    shapely.prepare(area)
            corners = tuple(tuple((float(x), float(y)) for x, y in p.exterior.coords[:-1]) for p in polygons)
            object.__setattr__(self, name, corners)

    def allow_points(self, points: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        """Return whether each point (α1, α2) may be used, for points of shape (m, 2)."""
        import shapely

        return self._allow(shapely.points(np.asarray(points, dtype=float).reshape(-1, 2)))

    def allow_segments(self, starts: npt.ArrayLike, ends: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        """Return whether each straight segment may be used, for ends of shape (m, 2)."""
        import shapely

        lines = np.stack([np.asarray(starts, dtype=float), np.asarray(ends, dtype=float)], axis=1)
        return self._allow(shapely.linestrings(lines))

    def _allow(self, shapes: Any) -> npt.NDArray[np.bool_]:
        import shapely

        allowed = np.ones(len(shapes), dtype=bool)
        if self._forbidden is not None:
            allowed &= ~shapely.intersects(self._forbidden, shapes)
        if self._permitted is not None:
            allowed &= shapely.covers(self._permitted, shapes)
        return allowed


def _polygons(value: object, name: str) -> list[Polygon]:
    import shapely

    if not isinstance(value, (list, tuple, np.ndarray)):
        raise InputError(f"{name}: {shown(value)}; allowed is a list of polygons, each a list of [alpha1, alpha2]")
    polygons = []
    for number, corners in enumerate(value, start=1):
        label = f"{name} polygon {number}"
        points = [_corner(corner, label) for corner in _corners(corners, label)]
        if len(set(points)) < 3:
            raise InputError(f"{label}: {len(set(points))} different corners; allowed are three or more")
        polygon = shapely.Polygon(points)
        if not polygon.convex_hull.area > 1e-12:
            raise InputError(f"{label}: its corners lie on a line; allowed is a polygon with an interior")
        if not polygon.is_valid:
            raise InputError(f"{label}: {shapely.is_valid_reason(polygon)}; allowed is a simple polygon")
        if not polygon.area > 1e-12:
            raise InputError(f"{label}: area {polygon.area!r}; allowed is a polygon with an interior")
        polygons.append(polygon)
    return polygons


def _corners(value: object, label: str) -> Iterable[object]:
    if not isinstance(value, (list, tuple, np.ndarray)):
        raise InputError(f"{label}: {shown(value)}; allowed is a list of [alpha1, alpha2]")
    return value


def _corner(value: object, label: str) -> tuple[float, float]:
    if not isinstance(value, (list, tuple, np.ndarray)) or len(value) != 2:
        raise InputError(f"{label}: corner {shown(value)}; allowed is [alpha1, alpha2]")
    angles = angle_from_text(value[0], f"{label} alpha1"), angle_from_text(value[1], f"{label} alpha2")
    if max(map(abs, angles)) > _FARTHEST:
        raise InputError(f"{label}: corner {shown(value)}; allowed are angles up to {_FARTHEST:g} rad")
    return angles
