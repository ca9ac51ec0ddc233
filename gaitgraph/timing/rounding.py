"""Round the corners of a gait: a smooth curve on the same sheet, within a stated distance of the polyline.

A corner is replaced by a quintic Bézier blend whose first three control points lie evenly on the segment that arrives
and whose last three lie evenly on the segment that leaves. Its curvature vanishes at both ends, so that it joins the
straight segments with two continuous derivatives, and it lies in the triangle of the corner (convex hull property). A
gait that turns back on itself stays on its line: there the parameter slows down to zero at the tip.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import angle_from_text
from gaitgraph.errors import InputError, shown
from gaitgraph.timing.curve import Curve

if TYPE_CHECKING:
    from gaitgraph.gait.gait import Gait

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]

SMALLEST = 1e-5
"""The least tolerance, and the least distance between corners [rad]: smaller blends are beyond what floats carry."""

_STRAIGHT = 1e-9
# Distance between control points on a segment, as a share of the length that the blend takes.
_SPACING = 0.4
# Of the parameter that a turn back takes on each side, the share that it moves along the segment.
_TIP = 5.0 / 8.0


@dataclass(frozen=True, slots=True, kw_only=True)
class RoundedCorner:
    """What was done at one corner.

    Parameters
    ----------
    corner
        Its number in the merged gait, from 0.
    turn
        By how much the direction turns there, from 0 to π [rad].
    reach
        How much of each segment the blend takes [rad].
    deviation
        Distance from the corner to the curve [rad]; zero where the gait turns back on its line.
    shrunk
        Whether the tolerance would allow a larger blend than its segments do.
    """

    corner: int
    turn: float
    reach: float
    deviation: float
    shrunk: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Rounding:
    """A rounded gait: the curve, and what was done at each corner.

    Parameters
    ----------
    curve
        The smooth curve.
    gait
        The polyline, straight runs merged.
    tolerance
        What was asked for [rad].
    corners
        What was done where the direction turns.
    """

    curve: Curve
    gait: Gait
    tolerance: float
    corners: tuple[RoundedCorner, ...]

    @property
    def deviation(self) -> float:
        """Largest distance between curve and polyline, in either direction, in the (α1, α2) plane [rad]."""
        return max((corner.deviation for corner in self.corners), default=0.0)

    @property
    def merged(self) -> tuple[int, ...]:
        """Corners whose blends met their neighbours' and were shrunk to share a segment."""
        return tuple(corner.corner for corner in self.corners if corner.shrunk and corner.deviation > 0)

    def as_mapping(self) -> dict[str, Any]:
        """Return it as plain values, ready for JSON."""
        return {
            "tolerance": self.tolerance,
            "deviation": self.deviation,
            "shrunk": list(self.merged),
            "corners": [asdict(corner) for corner in self.corners],
        }

    def __repr__(self) -> str:
        return f"<Rounding: {self}>"

    def __str__(self) -> str:
        text = f"{len(self.corners)} corners rounded, at most {self.deviation:.4g} rad from the gait"
        return text + (f"; shrunk to share a leg: {', '.join(map(str, self.merged))}" if self.merged else "")


def rounded(gait: Gait, tolerance: float | str) -> Rounding:
    """Return a gait of one color with its corners rounded.

    Parameters
    ----------
    gait
        The closed polyline; straight runs are merged first, and corners nearer than :data:`SMALLEST` to the one before
        are taken for the same.
    tolerance
        Largest distance between the curve and the polyline, both ways, in the (α1, α2) plane; radians, or a text such
        as "2deg". In all four angles it is √2 times as far.

    Returns
    -------
    Rounding
        Blends that would overlap are shrunk in proportion until they share the segment, and marked; that is an answer,
        no error. The curve has the parameter of arc length on straight segments.

    Raises
    ------
    InputError
        If the gait is not of one color, or the tolerance below :data:`SMALLEST`.

    Notes
    -----
    Not guaranteed: that the curve is flyable wherever the polyline is. It lies in the triangles of the corners; ask
    :meth:`gaitgraph.timing.curve.Curve.check`.

    With segments along the unit vectors u and v, a blend that takes d of each, with control points 2d/5 apart, passes
    its corner at the distance (3/16)·d·‖v − u‖ = (3/8)·d·sin(turn/2), reached at its middle.

    Examples
    --------
    >>> from gaitgraph.gait.gait import lift
    >>> rounding = rounded(lift([(0.4, -1.2), (0.4, -0.4), (1.2, -0.4)], "red"), 0.02)
    >>> print(rounding)
    3 corners rounded, at most 0.02 rad from the gait
    """
    size = angle_from_text(tolerance, "tolerance")
    if not size >= SMALLEST:
        raise InputError(f"tolerance must be an angle of at least {SMALLEST:g} rad, got {shown(tolerance)}")
    if gait.color not in ("red", "blue"):
        raise InputError(
            f"gait must be on one sheet, red or blue, got the color {shown(gait.color)}; retarget moves it there"
        )
    merged = _without_near_corners(gait.merged())
    plane = np.array(merged.alpha[:, :2])
    step = np.roll(plane, -1, axis=0) - plane
    length = np.linalg.norm(step, axis=1)
    corners: tuple[RoundedCorner, ...] = ()
    if not length.sum() > 0:
        breaks, pieces = np.array([0.0, 1.0]), plane[None, :1]
    else:
        ahead = step / length[:, None]
        before = np.roll(ahead, 1, axis=0)
        sine, cosine = before[:, 0] * ahead[:, 1] - before[:, 1] * ahead[:, 0], (before * ahead).sum(axis=1)
        turn = np.arctan2(np.abs(sine), cosine)
        back = turn >= math.pi - _STRAIGHT
        bent = (turn > _STRAIGHT) & ~back
        per_reach = (16.0 - 25.0 * _SPACING) / 16.0 * np.sin(turn / 2)
        reach, shrunk = _reaches(length, np.where(bent, size / np.where(bent, per_reach, 1.0), 0.0), back)
        breaks, pieces = _blends(plane, ahead, length, reach, bent, back)
        corners = tuple(
            RoundedCorner(
                corner=int(k),
                turn=float(turn[k]),
                reach=float(reach[k]),
                deviation=float(per_reach[k] * reach[k]) if bent[k] else 0.0,
                shrunk=bool(shrunk[k]),
            )
            for k in np.flatnonzero(bent | back)
        )
    curve = Curve(
        breaks=breaks,
        pieces=pieces,
        color=gait.color,
        vehicle=gait.vehicle,
        coefficients=gait.coefficients,
        crossing_tolerance=gait.crossing_tolerance,
    )
    return Rounding(curve=curve, gait=merged, tolerance=size, corners=corners)


def _without_near_corners(gait: Gait) -> Gait:
    """Return a gait without the corners that nearly coincide with the one before."""
    plane = gait.alpha[:, :2]
    keep = [0]
    for k in range(1, len(plane)):
        if np.linalg.norm(plane[k] - plane[keep[-1]]) > SMALLEST:
            keep.append(k)
    while len(keep) > 1 and np.linalg.norm(plane[keep[-1]] - plane[0]) <= SMALLEST:
        keep.pop()
    if len(keep) == len(plane):
        return gait
    return replace(gait, alpha=gait.alpha[keep], colors=tuple(gait.colors[k] for k in keep)).merged()


def _reaches(length: FloatArray, wanted: FloatArray, back: BoolArray) -> tuple[FloatArray, BoolArray]:
    """Return how much of its segments each corner takes, so that two on one fit, and whether that is less than wanted.

    A turn back leaves no deviation, so it wants all that there is: up to half a segment.
    """
    behind = np.roll(length, 1)
    wanted = np.where(back, np.minimum(length, behind) / 2, wanted)
    # A blend never wants more than a whole segment, which keeps sums finite where the turn is slight.
    reach = np.minimum(wanted, np.minimum(length, behind))
    load = reach + np.roll(reach, -1)
    share = np.where(load > length, length / np.where(load > 0, load, 1.0), 1.0)
    reach = reach * np.minimum(share, np.roll(share, 1))
    return reach, reach < wanted * (1 - 1e-12)


def _blends(
    plane: FloatArray, ahead: FloatArray, length: FloatArray, reach: FloatArray, bent: BoolArray, back: BoolArray
) -> tuple[FloatArray, FloatArray]:
    """Return breaks and pieces of degree 5: around each corner a blend, then what is left of the segment that leaves.

    The curve starts where the blend of the first corner does.
    """
    before = np.roll(ahead, 1, axis=0)
    powers = np.arange(5, -1, -1)
    widths, parts = [], []
    for k, corner in enumerate(plane):
        d, zero = float(reach[k]), np.zeros(2)
        if bent[k]:
            along = np.array([d, (1 - _SPACING) * d, (1 - 2 * _SPACING) * d])
            control = np.vstack([corner - along[:, None] * before[k], corner + along[::-1, None] * ahead[k]])
            # From Bernstein coefficients to powers of the share of the blend.
            signs = ([(-1.0) ** (j - i) * math.comb(j, i) for i in range(j + 1)] for j in powers)
            blend = [math.comb(5, j) * (np.array(row) @ control[: j + 1]) for j, row in zip(powers, signs, strict=True)]
            widths.append(5.0 * _SPACING * d)
            parts.append(np.array(blend) / widths[-1] ** powers[:, None])
        elif back[k]:
            # The distance to the tip is r(x)·w with r = (6x² − x⁴)/8, x from −1 to 1: slope 1 and no curvature at ±1.
            w = d / _TIP
            c4, c2 = w / 8.0 * before[k], -6.0 * w / 8.0 * before[k]
            arriving = np.stack([zero, c4, -4 * c4, c2 + 6 * c4, -2 * c2 - 4 * c4, corner + c2 + c4])
            leaving = np.stack([zero, c4, zero, c2, zero, corner])
            widths += [w, w]
            parts += [part / w ** powers[:, None] for part in (arriving, leaving)]
        rest = float(length[k] - d - reach[(k + 1) % len(plane)])
        if rest > 1e-12 * length[k]:
            widths.append(rest)
            parts.append(np.stack([zero, zero, zero, zero, ahead[k], corner + d * ahead[k]]))
    return np.concatenate([[0.0], np.cumsum(widths)]), np.stack(parts, axis=1)
