"""Smooth closed curves of tilt angles on one sheet, and gaits with rounded corners.

Both sheets are planes, so that a polynomial in (α1, α2) is one in all four angles, and lies on its sheet between
samples too. Checks of a whole curve run along chords: on an interval of width h a curve is within h²/8·max|q''| of
the chord, and max|q''| is at most that of its Bernstein coefficients (convex hull property).

A gait with rounded corners is such a curve. In a blend of width w from the direction u to v the direction is
u + (v − u)·(3x² − 2x³) at the share x of the width. Its curvature vanishes at both ends, so that it joins the straight
segments with two continuous derivatives, and it lies in the triangle of the corner. A gait that turns back on itself,
v = −u, stays on its line: there the parameter slows down to zero at the tip.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
import numpy.typing as npt

from gaitgraph import later
from gaitgraph.angles import angle_within, whole_number
from gaitgraph.arrays import freeze_arrays
from gaitgraph.errors import InputError, shown, wrong
from gaitgraph.gait.gait import Gait
from gaitgraph.gait.given import gait_of
from gaitgraph.invertibility.coefficients import Coefficients
from gaitgraph.invertibility.forms import FloatArray
from gaitgraph.records import Record
from gaitgraph.surface.curved import sheet_of
from gaitgraph.surface.sheets import COLORS, sheet_angles, sheet_distances
from gaitgraph.timing.lifted_gait import is_lifted, lifted_curve, path_of
from gaitgraph.timing.polynomials import (
    bends_of,
    derivative_of,
    located,
    values_of,
)
from gaitgraph.tolerances import (
    DEFAULT_CROSSING_TOLERANCE,
    DEFAULT_TOLERANCE,
    SAME_ANGLE,
)
from gaitgraph.vehicle import Vehicle

if TYPE_CHECKING:
    from gaitgraph.gait.given import GaitLike

DEFAULT_CHORD = 1e-6
"""How far a curve may be from the chords that its checks look along [rad in the (α1, α2) plane]."""

LEAST_CHORD = 1e-9
POLYLINE_CHORD = 1e-4
"""How far a curve may be from the polyline that is its gait [rad in the (α1, α2) plane]."""

SMALLEST = 1e-5
"""The least rounding, and the least distance between rounded corners [rad], limited by round-off."""

_LEFT = 1e-12  # share of a segment below which nothing of it is left between two blends

# A turn back reaches its tip after 5/16 of the width of its blend. Each half is its own piece, about the tip: the
# distance to the tip is (6z² − z⁴)/8 of half the width, z from −1 to 1. In powers of the share of a half:
_TO_TIP, _FROM_TIP = np.array([[-1, 4, 0, -8, 5], [-1, 0, 6, 0, 0]]) / 8.0
_TIP = 5.0 / 8.0


@dataclass(frozen=True, slots=True, kw_only=True, repr=False, eq=False)
class Curve(Record):
    """A closed curve of tilt angles on one sheet, twice continuously differentiable in its parameter.

    :func:`rounded` and :func:`gaitgraph.optimization.optimize.optimal_gait` make curves; nothing is checked here. A
    curve need not be flyable; :meth:`check` decides that. Where the first derivative vanishes it may turn back on
    itself.

    Parameters
    ----------
    breaks
        Increasing parameter values from 0 to the span, shape (k + 1,); any parameter, not only arc length.
    pieces
        Coefficients of (α1, α2) on each piece in powers of s − breaks[j], highest power first, shape
        (degree + 1, k, 2), as those of ``scipy.interpolate.PPoly`` [rad]; on a curved sheet of all four angles.
    vehicle, coefficients, color, crossing_tolerance
        As for :class:`gaitgraph.gait.gait.Gait`; the color is "red" or "blue".
    """

    breaks: FloatArray
    pieces: FloatArray
    vehicle: Vehicle
    coefficients: Coefficients
    color: str = "red"
    crossing_tolerance: float = DEFAULT_CROSSING_TOLERANCE

    def __post_init__(self) -> None:
        freeze_arrays(self)

    def __repr__(self) -> str:
        pieces = f"{len(self.breaks) - 1} pieces, span {self.span:.6g}"
        return f"<Curve: {self.color}, {pieces}, vehicle {self.vehicle.name!r}>"

    @property
    def span(self) -> float:
        """Length of the parameter's range; the curve is periodic with it."""
        return float(self.breaks[-1])

    @property
    def length(self) -> float:
        """Length of the loop in the (α1, α2) plane [rad]; √2 times as long in all four angles."""
        nodes, weights = np.polynomial.legendre.leggauss(20)
        # The speed has a kink where it vanishes, which is where both angles turn round.
        s = np.append(self.turning_points(), self.span)
        width = np.diff(s)
        velocity = self.at(s[:-1, None] + width[:, None] * (nodes + 1) / 2, 1)[..., :2]
        return float((np.linalg.norm(velocity, axis=-1) @ weights * width / 2).sum())

    def at(self, s: npt.ArrayLike, derivative: int = 0) -> FloatArray:
        """Return the tilt angles at any parameter values, or a derivative of them by s.

        Parameters of shape (...) give angles of shape (..., 4) [rad]. At a break, derivatives from the third on are
        those of the piece that starts there.
        """
        derivative = whole_number("derivative", derivative, 0, 9)
        piece, local = located(self.breaks, s, "s must be finite parameters")
        values = values_of(derivative_of(self.pieces, derivative)[:, piece], local)
        return lifted(
            values, self.color, self.pieces[-1, 0], self.coefficients, derivative
        )

    def turning_points(self, derivative: int = 0) -> FloatArray:
        """Return the breaks and where α1 or α2, or a derivative, may turn round, increasing parameters, shape (n,)."""
        from scipy.interpolate import PPoly

        slope = PPoly(derivative_of(self.pieces, derivative + 1), self.breaks)
        roots = slope.roots(discontinuity=False, extrapolate=False)
        turns = np.unique(np.concatenate([self.breaks[:-1], *roots]))
        return np.asarray(turns[(turns >= 0) & (turns < self.span)])

    def polyline(self, tolerance: float = POLYLINE_CHORD) -> Gait:
        """Return a gait with corners on the curve, whose segments are proven to be within a tolerance of it [rad]."""
        tolerance = angle_within(tolerance, "tolerance", least=LEAST_CHORD)
        width = np.diff(self.breaks)
        bend = bends_of(self.pieces, width)
        count = width * np.sqrt(bend / (8.0 * tolerance)) * (1 + 1e-9)
        count = np.maximum(np.ceil(count), 1.0).astype(int)
        starts = [
            first + step / number * np.arange(number)
            for first, step, number in zip(self.breaks, width, count, strict=False)
        ]
        alpha = self.at(np.concatenate(starts))
        colors: tuple[str, ...] = ()
        if self.vehicle.asymmetry is None:
            colors = (self.color,) * len(alpha)
        return Gait(
            alpha=alpha,
            colors=colors,
            vehicle=self.vehicle,
            coefficients=self.coefficients,
            crossing_tolerance=self.crossing_tolerance,
        )

    def check(
        self, *, chord: float = DEFAULT_CHORD, **options: Unpack[later.CheckOptions]
    ) -> later.Report:
        """Return every check of valid and flyable for the curve itself, between samples too; options as for a gait.

        :func:`gaitgraph.validation.validating.check_gait` checks chords within `chord` [rad] of the curve. Its results
        are then lowered by the largest difference of the curve: √(2+κ²)·√2·chord for the least singular value, the
        largest slope of R for R, and so on. So a curve that touches a limit may fail where it passes with a finer
        chord, but a curve that breaks a rule never passes.
        """
        alpha = self.at(self.turning_points())
        extremes = np.stack([alpha.min(axis=0), alpha.max(axis=0)])
        return later.check_gait(
            self.polyline(chord), beside=chord, extremes=extremes, **options
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class RoundedCorner(Record):
    """The blend at one corner."""

    corner: int  # number in the merged gait, from 0
    turn: float  # change of direction, from 0 to π [rad]
    reach: float  # length that the blend takes of each segment [rad]
    deviation: float  # distance from the corner to the curve [rad]; 0 where the gait turns back on its line
    shrunk: bool  # whether short segments, not the tolerance, limit the blend


@dataclass(frozen=True, slots=True, kw_only=True)
class Rounding(Record):
    """A rounded gait: the curve, the polyline with straight runs merged, the tolerance [rad] and the corners."""

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
        """Corners whose blends overlapped a neighbour's and were shrunk to share the segment."""
        return tuple(
            corner.corner
            for corner in self.corners
            if corner.shrunk and corner.deviation > 0
        )

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
        if self.merged:
            text += f"; shrunk to share a leg: {', '.join(str(corner + 1) for corner in self.merged)}"
        return text


def rounded(gait: GaitLike, tolerance: float | str) -> Rounding:
    """Return a gait of one color with its corners rounded.

    Parameters
    ----------
    gait
        The closed polyline, on a curved sheet with rows between its corners. Straight runs are merged first; a corner
        nearer than :data:`SMALLEST` to the one before is dropped. Blends that would overlap are shrunk until they share
        the segment, and marked.
    tolerance
        Largest distance between the curve and the polyline, both ways, in the (α1, α2) plane; radians, or a text such
        as "2deg". In all four angles it is √2 times as far.

    Notes
    -----
    The curve of a flyable gait need not be flyable; see :meth:`Curve.check`.

    With segments along the unit vectors u and v, a blend that takes d of each has the width 2d and passes its
    corner at the distance (3/16)·d·‖v − u‖ = (3/8)·d·sin(turn/2), reached at its middle.
    """
    size = angle_within(tolerance, "tolerance", least=SMALLEST)
    gait = gait_of(gait)
    is_curved = gait.vehicle.asymmetry is not None
    if is_curved:
        _check_follows_sheet(gait)
        corners = replace(gait, alpha=gait.alpha[path_of(gait).corners])
    else:
        _check_on_one_sheet(gait)
        corners = gait.merged()
    corners = _apart(corners)
    breaks, pieces, blends = _blended(corners.alpha[:, :2], size)
    if is_curved:
        sheet = sheet_of(gait.coefficients.rotors)
        breaks, pieces = lifted_curve(sheet, breaks, pieces)
        corners = gait  # with its rows
    curve = Curve(
        breaks=breaks,
        pieces=pieces,
        color=gait.color or "red",
        vehicle=gait.vehicle,
        coefficients=gait.coefficients,
        crossing_tolerance=gait.crossing_tolerance,
    )
    return Rounding(curve=curve, gait=corners, tolerance=size, corners=blends)


def _check_follows_sheet(gait: Gait) -> None:
    if not is_lifted(gait):
        raise InputError(
            "gait must have rows along its curved sheet, as those of plan and lift, to be rounded, got one without"
        )


def _check_on_one_sheet(gait: Gait) -> None:
    if gait.color not in ("red", "blue"):
        raise wrong(
            "gait",
            "must be on one sheet, red or blue",
            gait.color,
            "; retarget moves it there",
            got=f"the color {shown(gait.color)}",
        )
    # Between corners the curve is lifted anew: corners off the sheet would be another motion.
    distances = sheet_distances(gait.alpha, gait.coefficients)
    off = float(distances[:, COLORS.index(gait.color)].max())
    if off > DEFAULT_TOLERANCE:
        raise InputError(
            f"gait must be on its sheet, {gait.color}, to {DEFAULT_TOLERANCE:g} rad, got a corner {off:.2g} rad off; "
            "retarget moves it there",
            field="gait",
        )


def _apart(gait: Gait) -> Gait:
    """Return a merged gait without the corners that are nearer than :data:`SMALLEST` to the one before."""
    kept = [gait.alpha[0]]
    for corner in gait.alpha[1:]:
        if _are_apart(corner, kept[-1]):
            kept.append(corner)
    while len(kept) > 1 and not _are_apart(kept[-1], kept[0]):
        kept.pop()
    if len(kept) == len(gait.alpha):
        return gait
    fewer = replace(gait, alpha=np.array(kept), colors=gait.colors[: len(kept)])
    return fewer.merged()


def _are_apart(corner: FloatArray, other: FloatArray) -> bool:
    return bool(np.linalg.norm(corner[:2] - other[:2]) > SMALLEST)


def _blended(
    plane: FloatArray, size: float
) -> tuple[FloatArray, FloatArray, tuple[RoundedCorner, ...]]:
    """Return breaks, pieces and blends of a closed polyline, shape (n, 2), rounded by a tolerance [rad].

    Around each corner there is a blend, then what is left of the segment after it. A point has one piece.
    """
    if len(plane) == 1:
        return np.array([0.0, 1.0]), plane[None], ()
    step = np.roll(plane, -1, axis=0) - plane
    length = np.linalg.norm(step, axis=1)
    ahead = step / length[:, None]
    before = np.roll(ahead, 1, axis=0)
    sine = before[:, 0] * ahead[:, 1] - before[:, 1] * ahead[:, 0]
    turn = np.arctan2(np.abs(sine), (before * ahead).sum(axis=1))
    back = turn >= math.pi - SAME_ANGLE
    bent = (turn > SAME_ANGLE) & ~back
    deviation_per_reach = np.where(bent, 3.0 / 8.0 * np.sin(turn / 2), 0.0)
    # A turn back leaves no deviation, so it takes all that there is: up to half a segment.
    shorter = np.minimum(length, np.roll(length, 1))
    wanted = np.where(back, shorter / 2, 0.0)
    wanted[bent] = size / deviation_per_reach[bent]
    # A blend never takes more than a whole segment, which keeps sums finite where the turn is slight; and two on one
    # segment are shrunk until they fit.
    reach = np.minimum(wanted, shorter)
    share = length / np.maximum(reach + np.roll(reach, -1), length)
    reach = reach * np.minimum(share, np.roll(share, 1))
    left = length - reach - np.roll(reach, -1)

    widths: list[float] = []
    parts: list[FloatArray] = []  # in powers of the share of the width
    blends: list[RoundedCorner] = []
    for k, corner in enumerate(plane):
        u = before[k]
        v = ahead[k]
        d = float(reach[k])
        if bent[k]:
            turned = d * (v - u)
            widths.append(2 * d)
            parts.append(
                np.array([-turned, 2 * turned, 0 * u, 2 * d * u, corner - d * u])
            )
        elif back[k]:
            half = d / _TIP
            for distance in (_TO_TIP, _FROM_TIP):
                part = -np.outer(distance, half * u)
                part[-1] += corner
                widths.append(half)
                parts.append(part)
        if left[k] > _LEFT * length[k]:
            widths.append(float(left[k]))
            parts.append(np.array([0 * v, 0 * v, 0 * v, left[k] * v, corner + d * v]))
        if bent[k] or back[k]:
            blend = RoundedCorner(
                corner=k,
                turn=float(turn[k]),
                reach=d,
                deviation=float(deviation_per_reach[k] * d),
                shrunk=bool(d < wanted[k] * (1 - 1e-12)),
            )
            blends.append(blend)
    powers = np.arange(4, -1, -1)[:, None]
    pieces = np.stack(parts, axis=1) / (np.array(widths) ** powers)[..., None]
    return np.append(0.0, np.cumsum(widths)), pieces, tuple(blends)


def lifted(
    plane: FloatArray,
    color: str,
    first: FloatArray,
    coefficients: Coefficients,
    derivative: int,
) -> FloatArray:
    """Return (α1, …, α4) on a sheet above points of the plane, or above a derivative of them, shape (..., 4) [rad].

    All four angles, on a curved sheet, are returned as they are. Never wrapped: (α3, α4) above `first` is taken from
    [−π/2, π/2], and the others follow without a jump.
    """
    if plane.shape[-1] == 4:
        return plane
    sign = -1.0 if color == "blue" else 1.0
    other = sign * plane
    if derivative == 0:
        sheet: Any = "blue" if color == "blue" else "red"
        above = sheet_angles(sheet, first[0], first[1], coefficients)
        other = np.array(above) - sign * first + other
    return np.concatenate([plane, other], axis=-1)
