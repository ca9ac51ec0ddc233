"""Smooth closed curves of tilt angles on one sheet, rounded gaits, and gaits timed by polynomials.

Both sheets are planes, so that a polynomial in (α1, α2) is one in all four angles, and lies on its sheet between
samples too. Checks of a whole curve run along chords: on an interval of width h a curve is within h²/8·max|q''| of
the chord, and max|q''| is at most that of its Bernstein coefficients (convex hull property).

A gait with rounded corners is such a curve. A corner is replaced by a quintic Bézier blend whose first three control
points lie evenly on the segment that arrives and whose last three lie evenly on the segment that leaves. Its curvature
vanishes at both ends, so that it joins the straight segments with two continuous derivatives, and it lies in the
triangle of the corner. A gait that turns back on itself stays on its line: there the parameter slows down to zero at
the tip.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any, Self, Unpack

import numpy as np
import numpy.typing as npt

from gaitgraph import later
from gaitgraph.angles import angle_within, figure
from gaitgraph.arrays import freeze_arrays, read_only
from gaitgraph.errors import InputError, shown
from gaitgraph.gait.gait import Gait
from gaitgraph.gait.given import gait_of
from gaitgraph.gait.table import RATE_UNITS
from gaitgraph.surface.sheets import sheet_angles
from gaitgraph.timing.laws import (
    bernstein_from_power,
    derivative_of,
    divided,
    located,
    peaks_of,
    values_of,
)
from gaitgraph.timing.timed_gait import Motion, TimedGait
from gaitgraph.tolerances import DEFAULT_CROSSING_TOLERANCE, SAME_ANGLE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gaitgraph.gait.given import GaitLike
    from gaitgraph.invertibility.coefficients import Coefficients
    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.vehicle import Vehicle

DEFAULT_CHORD = 1e-6
"""How far a curve may be from the chords that its checks look along [rad in the (α1, α2) plane]."""

SMALLEST = 1e-5
"""The least rounding, and the least distance between rounded corners [rad], limited by round-off."""

_SPACING = 0.4  # distance between control points of a blend on a segment, as a share of the length that it takes
# Finite differences that turn the control points of a blend into coefficients, from the fifth power down.
_DIFFERENCES = [
    np.array([(-1.0) ** (j - i) * math.comb(j, i) for i in range(j + 1)])
    for j in range(5, -1, -1)
]
_TIP = 5.0 / 8.0  # distance to the tip of a turn back, per parameter on each side
_FEWEST = 8  # intervals on a piece of a curve
_GROWTH = 0.3  # of the distance between nodes, from one to the next


@dataclass(frozen=True, slots=True, kw_only=True, repr=False, eq=False)
class Curve:
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
        (degree + 1, k, 2), as those of ``scipy.interpolate.PPoly`` [rad].
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
        piece, local = located(self.breaks, s, "s must be finite parameters")
        plane = values_of(derivative_of(self.pieces, derivative)[:, piece], local)
        return _lift(
            plane, self.color, self.pieces[-1, 0], self.coefficients, derivative
        )

    def turning_points(self, derivative: int = 0) -> FloatArray:
        """Return the breaks and where α1 or α2, or a derivative, may turn round, increasing parameters, shape (n,)."""
        from scipy.interpolate import PPoly

        slope = PPoly(derivative_of(self.pieces, derivative + 1), self.breaks)
        found = np.concatenate(
            [self.breaks[:-1], *slope.roots(discontinuity=False, extrapolate=False)]
        )
        return np.asarray(np.unique(found[(found >= 0) & (found < self.span)]))

    def polyline(self, tolerance: float = 1e-4) -> Gait:
        """Return a gait with corners on the curve, whose segments are proven to be within a tolerance of it [rad]."""
        width = np.diff(self.breaks)
        bend = np.linalg.norm(
            bernstein_from_power(derivative_of(self.pieces, 2), width), axis=-1
        ).max(axis=0)
        count = np.maximum(
            np.ceil(width * np.sqrt(bend / (8.0 * tolerance)) * (1 + 1e-9)), 1.0
        )
        alpha = self.at(divided(self.breaks, count)[0])
        return Gait(
            alpha=alpha,
            colors=(self.color,) * len(alpha),
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
class RoundedCorner:
    """The blend at one corner."""

    corner: int  # number in the merged gait, from 0
    turn: float  # change of direction, from 0 to π [rad]
    reach: float  # length that the blend takes of each segment [rad]
    deviation: float  # distance from the corner to the curve [rad]; 0 where the gait turns back on its line
    shrunk: bool  # whether short segments, not the tolerance, limit the blend


@dataclass(frozen=True, slots=True, kw_only=True)
class Rounding:
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
        return text + (
            f"; shrunk to share a leg: {', '.join(map(str, self.merged))}"
            if self.merged
            else ""
        )


def rounded(gait: GaitLike, tolerance: float | str) -> Rounding:
    """Return a gait of one color with its corners rounded.

    Parameters
    ----------
    gait
        The closed polyline. Straight runs are merged first; a corner nearer than :data:`SMALLEST` to the one before is
        dropped. Blends that would overlap are shrunk until they share the segment, and marked.
    tolerance
        Largest distance between the curve and the polyline, both ways, in the (α1, α2) plane; radians, or a text such
        as "2deg". In all four angles it is √2 times as far.

    Notes
    -----
    The curve of a flyable gait need not be flyable; see :meth:`Curve.check`.

    With segments along the unit vectors u and v, a blend that takes d of each, with control points 2d/5 apart, passes
    its corner at the distance (3/16)·d·‖v − u‖ = (3/8)·d·sin(turn/2), reached at its middle.
    """
    size = angle_within(tolerance, "tolerance", least=SMALLEST)
    gait = gait_of(gait)
    if gait.color not in ("red", "blue"):
        wanted = "gait must be on one sheet, red or blue"
        raise InputError(
            f"{wanted}, got the color {shown(gait.color)}; retarget moves it there"
        )
    merged = gait.merged()
    kept = [merged.alpha[0]]
    for corner in merged.alpha[1:]:
        if np.linalg.norm(corner[:2] - kept[-1][:2]) > SMALLEST:
            kept.append(corner)
    while len(kept) > 1 and np.linalg.norm(kept[-1][:2] - kept[0][:2]) <= SMALLEST:
        kept.pop()
    if len(kept) < len(merged.alpha):
        merged = replace(
            merged, alpha=np.array(kept), colors=merged.colors[: len(kept)]
        ).merged()
    plane = merged.alpha[:, :2]
    breaks, pieces, corners = (
        _blended(plane, size)
        if len(plane) > 1
        else (np.array([0.0, 1.0]), plane[None], ())
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


def _blended(
    plane: FloatArray, size: float
) -> tuple[FloatArray, FloatArray, tuple[RoundedCorner, ...]]:
    """Return the breaks and pieces of the closed polyline through two or more points with rounded corners."""
    step = np.roll(plane, -1, axis=0) - plane
    length = np.linalg.norm(step, axis=1)
    ahead = step / length[:, None]
    before = np.roll(ahead, 1, axis=0)
    sine, cosine = (
        before[:, 0] * ahead[:, 1] - before[:, 1] * ahead[:, 0],
        (before * ahead).sum(axis=1),
    )
    turn = np.arctan2(np.abs(sine), cosine)
    back = turn >= math.pi - SAME_ANGLE
    bent = (turn > SAME_ANGLE) & ~back
    per_reach = np.where(bent, (16.0 - 25.0 * _SPACING) / 16.0 * np.sin(turn / 2), 0.0)
    # A turn back leaves no deviation, so it takes all that there is: up to half a segment.
    shorter = np.minimum(length, np.roll(length, 1))
    wanted = np.where(
        back, shorter / 2, np.where(bent, size / np.where(bent, per_reach, 1.0), 0.0)
    )
    # A blend never takes more than a whole segment, which keeps sums finite where the turn is slight; and two
    # on one segment are shrunk until they fit.
    reach = np.minimum(wanted, shorter)
    load = reach + np.roll(reach, -1)
    share = np.where(load > length, length / np.where(load > 0, load, 1.0), 1.0)
    reach = reach * np.minimum(share, np.roll(share, 1))
    # Around each corner a blend, or both halves of a turn back; then what is left of the segment after it.
    powers = np.arange(5, -1, -1)
    made: list[
        tuple[float, FloatArray]
    ] = []  # widths, and coefficients in powers of the parameter
    for k, (corner, u, v, d) in enumerate(
        zip(plane, before, ahead, reach.tolist(), strict=True)
    ):
        parts: list[
            tuple[float, Any]
        ] = []  # coefficients in powers of the share of the width
        if bent[k]:
            along = np.array([d, (1 - _SPACING) * d, (1 - 2 * _SPACING) * d])[:, None]
            control = np.vstack([corner - along * u, corner + along[::-1] * v])
            blend = [
                math.comb(5, len(one) - 1) * (one @ control[: len(one)])
                for one in _DIFFERENCES
            ]
            parts = [(5.0 * _SPACING * d, blend)]
        elif back[k]:
            # The distance to the tip is r(x)·w, r = (6x² − x⁴)/8, x from −1 to 1: slope 1, no curvature at ±1.
            w = d / _TIP
            c4, c2 = w / 8.0 * u, -6.0 * w / 8.0 * u
            arriving = [
                0 * c4,
                c4,
                -4 * c4,
                c2 + 6 * c4,
                -2 * c2 - 4 * c4,
                corner + c2 + c4,
            ]
            parts = [(w, arriving), (w, [0 * c4, c4, 0 * c4, c2, 0 * c4, corner])]
        made += [
            (width, np.array(part) / width ** powers[:, None]) for width, part in parts
        ]
        rest = float(length[k] - d - reach[(k + 1) % len(plane)])
        if rest > 1e-12 * length[k]:
            made.append((rest, np.vstack([np.zeros((4, 2)), v, corner + d * v])))
    corners = tuple(
        RoundedCorner(
            corner=k,
            turn=float(turn[k]),
            reach=float(reach[k]),
            deviation=float(per_reach[k] * reach[k]),
            shrunk=bool(reach[k] < wanted[k] * (1 - 1e-12)),
        )
        for k in np.flatnonzero(bent | back).tolist()
    )
    widths, pieces = zip(*made, strict=True)
    return np.concatenate([[0.0], np.cumsum(widths)]), np.stack(pieces, axis=1), corners


@dataclass(frozen=True, slots=True, kw_only=True)
class TouchedLimit:
    """A limit that a law reaches."""

    limit: str  # "rate", "acceleration" or "jerk"
    joints: list[int]  # the opposite joints that move alike, 1 and 3 or 2 and 4
    value: float  # of the limit [rad/s, rad/s² or rad/s³]
    share: float  # share of the period spent at the limit
    where: dict[
        str, Any
    ]  # the first time at it, t [s], and the tilt angles then, alpha [rad]

    def __str__(self) -> str:
        joints, unit = (
            f"α{self.joints[0]} and α{self.joints[1]}",
            RATE_UNITS[self.limit],
        )
        during = f"during {100 * self.share:.0f} % of the period"
        return f"{self.limit} of {joints} at its limit {figure(self.value)} {unit} {during}"


@dataclass(frozen=True, slots=True, kw_only=True, repr=False, eq=False)
class LimitedGait(TimedGait):
    """A timed gait that keeps limits; its law is closed, twice differentiable, and polynomial between knots.

    Parameters
    ----------
    gait
        A polyline: the gait itself if the law rests at its corners, else points of the curve.
    period, law, samples
        As for a timed gait; the law is named "least-period" or "paced".
    curve
        The curve that is run, or None for a polyline.
    widths
        Widths of the intervals of time between knots, shape (m,) [s]; they add up to the period.
    tilts
        (α1, α2) on these intervals as polynomials of the share of the interval that has passed, highest power first,
        shape (degree + 1, m, 2) [rad].
    limits
        The limits that the law keeps: rate, acceleration and jerk of α1 and α2, shape (3, 2), infinite for none.
    stretch
        Factor, minus 1, by which time was stretched to keep the limits between samples too.
    rounding
        The gait whose rounded corners are the curve; None for a polyline, and for a curve of another kind.
    """

    curve: Curve | None
    widths: FloatArray
    tilts: FloatArray
    limits: FloatArray
    stretch: float = 0.0
    rounding: Rounding | None = None

    @property
    def stated_corners(self) -> FloatArray | None:
        """The corners from which the law follows, with its limits and rounding, shape (n, 4) [rad]; None for others.

        A law under a jerk limit along rounded corners takes too long to be found again.
        """
        if self.rounding is None:
            return self.gait.alpha if self.curve is None else None
        under_jerk = bool(np.isfinite(self.limits[2]).any())
        return None if under_jerk else self.rounding.gait.alpha

    def with_gait(self, gait: Gait) -> Self:
        """Return the same law for another vehicle, or other coefficients, of a gait; see :meth:`TimedGait.with_gait`."""
        curve = self.curve
        if curve is not None:
            curve = replace(
                curve,
                vehicle=gait.vehicle,
                coefficients=gait.coefficients,
                crossing_tolerance=gait.crossing_tolerance,
            )
        return replace(self, gait=gait, curve=curve)

    @property
    def made_for(self) -> dict[str, list[float]]:
        """The limits that the law keeps; see :attr:`TimedGait.made_for`."""
        return {
            kind: np.tile(limits, 2).tolist()
            for kind, limits in zip(RATE_UNITS, self.limits, strict=True)
            if np.isfinite(limits).all()
        }

    def with_period(self, period: float) -> Self:
        """Return the same law over another period [s], named "paced"; its limits are as they were, its peaks are not."""
        widths = self.widths * (period / self.period)
        return replace(self, law="paced", period=float(period), widths=widths)

    @property
    def corner_times(self) -> FloatArray:
        """The knots, between which the law is a polynomial, from 0 to the period, shape (m + 1,) [s]."""
        times = np.concatenate([[0.0], np.cumsum(self.widths[:-1]), [self.period]])
        return read_only(times)

    def at(self, t: npt.ArrayLike) -> Motion:
        """Return tilt angles, rates and accelerations at any times; see :meth:`TimedGait.at`."""
        return Motion(*(self.derivative(t, order) for order in range(3)))

    def derivative(self, t: npt.ArrayLike, order: int) -> FloatArray:
        """Return a derivative of the tilt angles at times of shape (...) [s]; the third one jumps at knots."""
        piece, local = located(self.corner_times, t)
        h, gait = self.widths[piece], self.gait
        plane = (
            values_of(derivative_of(self.tilts, order)[:, piece], local / h)
            / h[..., None] ** order
        )
        return _lift(
            plane, gait.color or "red", gait.alpha[0, :2], gait.coefficients, order
        )

    def _peaks(self, orders: Sequence[int]) -> list[FloatArray]:
        """Return upper bounds from Bernstein coefficients; they are the sharper the more knots there are."""
        return [
            np.tile(peaks_of(self.widths, self.tilts, order).max(axis=0), 2)
            for order in orders
        ]

    def limits_touched(self, within: float = 0.01) -> tuple[TouchedLimit, ...]:
        """Return the limits that the law comes within a share of, and for what share of the period."""
        out = []
        for order, (kind, limits) in enumerate(
            zip(RATE_UNITS, self.limits, strict=True), start=1
        ):
            peaks = peaks_of(self.widths, self.tilts, order)
            for joint, limit in enumerate(limits.tolist()):
                touched = (peaks[:, joint] >= limit * (1 - within)) & (
                    peaks[:, joint] > 0
                )
                if touched.any():
                    t = float(self.corner_times[int(np.argmax(touched))])
                    share = float(self.widths[touched].sum() / self.period)
                    joints, where = (
                        [joint + 1, joint + 3],
                        {"t": t, "alpha": self.derivative(t, 0).tolist()},
                    )
                    out.append(
                        TouchedLimit(
                            limit=kind,
                            joints=joints,
                            value=limit,
                            share=share,
                            where=where,
                        )
                    )
        return tuple(out)

    def vertices(self, tolerance: float = 1e-9) -> FloatArray:
        """Return the corners of the loop; a curve has them only where it turns back on its line."""
        if self.curve is None:
            return self.gait.vertices(tolerance)
        at = self.curve.turning_points()
        return self.curve.at(
            at[np.linalg.norm(self.curve.at(at, 1), axis=1) <= tolerance]
        )

    def check(self, **options: Unpack[later.CheckOptions]) -> later.Report:
        """Return every check of the path, along the curve itself, and those of rates, accelerations and jerks."""
        return (self.curve or self.gait).check(**options).with_timing(self)


def nodes_along(breaks: FloatArray, pieces: FloatArray, nodes: int) -> FloatArray:
    """Return nodes from 0 to the span of a path, all breaks among them, evenly within pieces.

    Half of the nodes are spread by width, half by how much a piece bends, where the limits of the joints change.
    Speeds change much beside a short piece: distances shrink towards it by 30 % from one node to the next.
    """
    width = np.diff(breaks)
    control = bernstein_from_power(derivative_of(pieces, 2), width)
    bend = width * np.linalg.norm(control, axis=-1).max(axis=0)
    share = width / width.sum()
    if bend.sum() > 0:
        share = (share + bend / bend.sum()) / 2
    steps = width / np.maximum(np.ceil(nodes * share * (1 - 1e-12)), _FEWEST)
    at_break = np.minimum(steps, np.roll(steps, 1))
    parts = []
    for k, (whole, step) in enumerate(zip(width.tolist(), steps.tolist(), strict=True)):
        sides: list[list[float]] = []
        for nearest in (float(at_break[k]), float(at_break[(k + 1) % len(steps)])):
            count = math.ceil(math.log(step / nearest) / math.log1p(_GROWTH))
            sizes = nearest * (1 + _GROWTH) ** np.arange(count)
            sides.append(
                sizes[
                    (sizes < step / (1 + _GROWTH)) & (np.cumsum(sizes) < whole / 2)
                ].tolist()
            )
        middle = whole - sum(sides[0]) - sum(sides[1])
        count = max(math.ceil(middle / step * (1 - 1e-12)), 1)
        parts.append(
            breaks[k]
            + np.cumsum([0.0, *sides[0], *[middle / count] * count, *sides[1][::-1]])[
                :-1
            ]
        )
    return np.concatenate([*parts, breaks[-1:]])


def _lift(
    plane: FloatArray,
    color: str,
    first: FloatArray,
    coefficients: Coefficients,
    derivative: int,
) -> FloatArray:
    """Return (α1, …, α4) on a sheet above points of the plane, or above a derivative of them, shape (..., 4) [rad].

    Never wrapped: (α3, α4) above `first` is taken from [−π/2, π/2], and the others follow without a jump.
    """
    sign = 1.0 if color == "red" else -1.0
    other = sign * plane
    if not derivative:
        above = sheet_angles(
            "red" if color == "red" else "blue", first[0], first[1], coefficients
        )
        other = np.array(above) - sign * first + other
    return np.concatenate([plane, other], axis=-1)
