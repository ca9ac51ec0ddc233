"""What rules share, and the rules of the paper: on the surface, two-color, continuous.

A rule is a function from the segments of a gait and the criteria to a check. It holds along all segments, a closed
polyline, by closed form or a bound. A smooth curve is checked by its chords: each bound is reduced by the largest effect
of the distance between them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from gaitgraph.angles import angle_within, checked_floor, checked_number
from gaitgraph.arrays import freeze_arrays, read_only
from gaitgraph.invertibility.coefficients import is_red
from gaitgraph.invertibility.forms import FloatArray, Sines
from gaitgraph.invertibility.matrices import (
    IntArray,
    hover_thrust_shares,
    singular_value_rate,
)
from gaitgraph.invertibility.segment_bounds import largest_residual
from gaitgraph.records import Record
from gaitgraph.surface.sheets import (
    COLORS,
    CodeArray,
    color_codes,
    color_of,
    neighbors_allowed,
    of_color,
    sheet_distances,
    sheet_jumps,
    text_from_types,
    types_at,
)
from gaitgraph.tolerances import (
    DEFAULT_CROSSING_TOLERANCE,
    DEFAULT_TOLERANCE,
    SAME_ANGLE,
)
from gaitgraph.validation.report import Check, GaitPoint, check_of

if TYPE_CHECKING:
    from gaitgraph.gait.gait import Gait
    from gaitgraph.invertibility.coefficients import Coefficients
    from gaitgraph.invertibility.matrices import BoolArray
    from gaitgraph.validation.wrong_rows import LoneRows, Misreading
    from gaitgraph.vehicle import Vehicle

_TAKE_ROOTS = "take (α3, α4) from the roots of (α1, α2)"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Criteria:
    """Vehicle, coefficients and limits of the checks; see :func:`gaitgraph.validation.validating.check_gait`.

    Parameters
    ----------
    beside, extremes
        Of a curve: how far it may be from the segments, its chords, in the (α1, α2) plane [rad], and its least and
        largest tilt angles, shape (2, 4) [rad].
    passing
        By how much the ranges of tilt may be passed [rad], and by what share floor and thrust limit.
    """

    vehicle: Vehicle
    coefficients: Coefficients
    tolerance: float
    floor: float
    angle_rounding: float | None = None
    crossing_tolerance: float = DEFAULT_CROSSING_TOLERANCE
    beside: float = 0.0
    extremes: FloatArray | None = None
    passing: float = 0.0

    def __post_init__(self) -> None:
        checked_floor(self.floor)
        for name in ("tolerance", "crossing_tolerance"):
            checked_number(name, getattr(self, name))
        if self.angle_rounding is not None:
            rounding = angle_within(self.angle_rounding, "angle_rounding", least=0.0)
            object.__setattr__(self, "angle_rounding", rounding)  # the record is frozen

    @property
    def bracket(self) -> float:
        """Largest width of the brackets of singular values and thrusts; for a curve their bounds are reported."""
        return 1e-6 if self.beside else 1e-4

    @property
    def singular_value_slack(self) -> float:
        """The most that the least singular value is lower on a curve: its rate per radian of four angles."""
        return math.sqrt(2.0) * singular_value_rate(self.vehicle) * self.beside

    def level_slack(self, coefficients: Coefficients) -> float:
        """Return the most that R is lower on a curve than on its chords: the four angles move by 2√2·beside in sum."""
        size = float(coefficients.form.size[2])
        return size * math.sqrt(8.0) * self.beside


@dataclass(frozen=True, kw_only=True, eq=False)
class Segments(Record):
    """The straight segments of a gait, between consecutive points.

    Parameters
    ----------
    alpha
        The points, shape (m + 1, 4) [rad].
    color
        The color of each, shape (m + 1,): +1 red, −1 blue, 0 none.
    number
        The number of each point in the gait, from 1; 1 again at the end of a segment that leads back to the first.
    noun
        The word for a point in messages: "corner", "row", or "chord" of a curve.
    t
        Times, shape (m + 1,) [s], or None.
    within
        The share of the way to the next number that a point has passed, shape (m + 1,); None if each has its own.
    """

    alpha: FloatArray
    color: CodeArray
    number: IntArray
    noun: str
    t: FloatArray | None = None
    within: FloatArray | None = None

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def starts(self) -> FloatArray:
        """The start of each segment, shape (m, 4) [rad]."""
        return self.alpha[:-1]

    @property
    def ends(self) -> FloatArray:
        """The end of each segment, shape (m, 4) [rad]."""
        return self.alpha[1:]

    @cached_property
    def sines(self) -> Sines:
        """The sines of the tilt angles at the points."""
        return Sines(*map(read_only, Sines.of(self.alpha)))

    @cached_property
    def on_red(self) -> bool:
        """Whether all points lie exactly on the red sheet, as those of a lifted loop do."""
        return bool(is_red(self.alpha.T).all())

    def place(self, segment: int, fraction: float = 0.0) -> GaitPoint:
        """Return the place at a fraction of a segment, counted from 0."""
        index = int(segment)
        fraction = float(fraction)
        if fraction >= 1.0 - SAME_ANGLE:
            index += 1
            fraction = 0.0
        if index and self.number[index] == 1 and self.within is None:
            index = 0  # the first point again
        alpha = _between(self.alpha, index, fraction)
        t = None
        if self.t is not None:
            t = float(_between(self.t, index, fraction))
        passed = fraction
        if self.within is not None:
            passed = float(self.within[index])
            if fraction:
                following = float(self.within[index + 1]) or 1.0
                passed += fraction * (following - passed)
        return GaitPoint(
            point=int(self.number[index]) - 1,
            fraction=passed,
            alpha=tuple(alpha.tolist()),
            t=t,
            noun=self.noun,
        )


def _between(values: FloatArray, index: int, fraction: float) -> FloatArray:
    """Return a value of a segment, at a fraction of it."""
    value = values[index]
    if fraction:
        value = value + fraction * (values[index + 1] - value)
    return np.asarray(value)


def segments_of(
    gait: Gait, noun: str = "corner", t: FloatArray | None = None
) -> Segments:
    """Return all segments of a gait, from the last corner back to the first too."""
    count = len(gait.alpha)
    color: CodeArray = np.zeros(count, dtype=np.int8)
    if gait.colors:
        color = color_codes(gait.colors)
    point = np.arange(count + 1) % count
    return Segments(
        alpha=gait.alpha[point], color=color[point], number=point + 1, noun=noun, t=t
    )


def compared(
    ok: bool, found: str, limit: str, place: GaitPoint | None, advice: str
) -> str:
    """Return what was found and its limit in words; if it is not ok, the place and the advice too."""
    if ok:
        return f"{found}, limit {limit}"
    return f"{found} at {place}, limit {limit}: {advice}"


def idle_pair(place: GaitPoint, vehicle: Vehicle) -> str:
    """Return the pair of rotors that idles in hover at a place, such as "rotors 1 and 3", "" if none does."""
    shares = hover_thrust_shares(np.array(place.alpha), vehicle)
    idle = np.flatnonzero(np.abs(shares) <= DEFAULT_TOLERANCE)
    if len(idle) != 2:
        return ""
    return f"rotors {idle[0] + 1} and {idle[1] + 1}"


# -- How points lie to the sheets


@dataclass(frozen=True, kw_only=True, eq=False)
class Fit:
    """How the points of a gait lie to the sheets.

    Parameters
    ----------
    distances
        From red and blue, mod π, shape (n, 2) [rad].
    off
        From the sheet of its color, 0 without one, shape (n,) [rad].
    tolerance
        The distance within which a point is on a sheet [rad].
    on_blue
        Whether a point is on blue alone, whatever its color, and the matrix singular there: without rotor height.
    """

    distances: FloatArray
    off: FloatArray
    tolerance: float
    on_blue: bool

    @property
    def errors(self) -> FloatArray:
        """The distance of each point within the tolerance, shape (n,): what its digits may explain [rad]."""
        is_error = (self.off > SAME_ANGLE) & (self.off <= self.tolerance)
        return np.where(is_error, self.off, 0.0)


def fit_of(segments: Segments, criteria: Criteria) -> Fit:
    """Return how the points of a gait lie to the sheets of their colors."""
    color, coefficients = segments.color, criteria.coefficients
    distances = np.full((len(color), 2), np.inf)  # without planes
    if coefficients.rotors.asymmetry is None:
        distances = sheet_distances(segments.alpha, coefficients)
    near = distances <= criteria.tolerance
    on_blue = bool((near[:, 1] & ~near[:, 0]).any())
    return Fit(
        distances=distances,
        off=np.where(color == 0, 0.0, of_color(distances.T, color)),
        tolerance=criteria.tolerance,
        on_blue=on_blue and not coefficients.is_raised,
    )


# -- The rules


def residual_of(segments: Segments, criteria: Criteria) -> tuple[float, GaitPoint]:
    """Return an upper bound of max(|Rφ|, |Rθ|) along a gait, and where it is nearly reached."""
    if segments.on_red:  # both products of sines vanish
        return 0.0, segments.place(0)
    lower, _, segment, fraction = largest_residual(
        segments.starts,
        segments.ends,
        criteria.coefficients,
        tolerance=criteria.tolerance / 100,
    ).worst()
    return max(0.0, -lower), segments.place(segment, fraction)


def on_surface(
    segments: Segments,
    criteria: Criteria,
    residual: tuple[float, GaitPoint],
    misreading: Misreading,
    lone: LoneRows,
) -> Check:
    """Check that Rφ and Rθ vanish, to within the tolerance."""
    (value, place), limit = residual, criteria.tolerance
    bare = np.flatnonzero(segments.color == 0)
    advice = f"{_TAKE_ROOTS}, or raise the tolerance"
    if misreading.advice:
        advice = misreading.advice
    elif lone.is_near(place.point + 1):
        advice = lone.note
    elif (
        criteria.coefficients.is_raised
        and sheet_distances(place.alpha, criteria.coefficients)[1] <= limit
    ):
        height = criteria.vehicle.heights_in_words
        advice = f"use red, since on blue the zero-moment direction leans for rotors at a height of {height}"
    elif len(bare) and place.number != segments.number[bare[0]]:
        first = f"{segments.noun} {segments.number[bare[0]]}"
        advice = f"{first} lies on neither sheet: {advice}"
    found = f"max(|Rφ|, |Rθ|) = {value:.2g}"
    message = compared(value <= limit, found, f"{limit:g}", place, advice)
    return check_of(
        "on_surface",
        value <= limit,
        message,
        value=value,
        limit=limit,
        place=place,
    )


def two_color(segments: Segments, criteria: Criteria) -> tuple[Check, bool]:
    """Check Figure 15: neither α3 nor α4 steps from its + plane to its − plane; also whether a point has no color."""
    point, message = _first_wrong_pair(segments, criteria)
    if point is None:
        present = set(segments.color.tolist())
        color = "mixed"
        if len(present) == 1:
            color = color_of(present.pop())
        message = f"all neighbours allowed by Figure 15 of the paper ({color})"
        return check_of("two_color", True, message, value=0.0, limit=0.0), False
    place = segments.place(point)
    check = check_of("two_color", False, message, value=1.0, limit=0.0, place=place)
    return check, not segments.color[point]


def _first_wrong_pair(segments: Segments, criteria: Criteria) -> tuple[int | None, str]:
    """Return the first point without color, or that may not be the next one's neighbour, and why; None if all may be."""
    color, number = segments.color, segments.number
    if color.all() and (color == color[0]).all():
        return None, ""  # on one sheet no two types are + and −
    third, fourth = types_at(
        segments.alpha, color, criteria.coefficients, criteria.crossing_tolerance
    )
    allowed = neighbors_allowed((third[:-1], fourth[:-1]), (third[1:], fourth[1:]))
    bare, forbidden = np.flatnonzero(color == 0), np.flatnonzero(~allowed)
    if len(bare) and not (len(forbidden) and forbidden[0] < bare[0]):
        point = int(bare[0])
        message = f"{segments.place(point)} lies on neither sheet and has no color: {_TAKE_ROOTS}"
        return point, message
    if not len(forbidden):
        return None, ""
    point = int(forbidden[0])
    here = f"{number[point]} {text_from_types(third[point], fourth[point])}"
    after = point + 1
    there = f"{number[after]} {text_from_types(third[after], fourth[after])}"
    message = (
        f"{segments.noun}s {here} and {there} may not be neighbours (Figure 15): give both one color, or pass a (?,?) "
        "point between them"
    )
    return point, message


@dataclass(frozen=True, kw_only=True, eq=False)
class _Jump:
    """The segment that leaves the sheets of its ends most, in terms of its limit."""

    segment: int
    size: float
    limit: float
    changes_color: bool


def _largest_jump(segments: Segments, criteria: Criteria) -> _Jump:
    """Return by how much segments leave the sheets of their ends.

    Within one color printed digits may move a segment off its sheet by the tolerance.
    """
    color = segments.color
    sizes = sheet_jumps(
        segments.starts, segments.ends, color[:-1], color[1:], criteria.coefficients
    )
    changes: BoolArray = color[:-1] != color[1:]
    limits = np.where(changes, SAME_ANGLE, criteria.tolerance)
    worst = int(np.argmax(sizes / np.maximum(limits, SAME_ANGLE)))
    return _Jump(
        segment=worst,
        size=float(sizes[worst]),
        limit=float(limits[worst]),
        changes_color=bool(changes[worst]),
    )


def continuous(segments: Segments, criteria: Criteria, fit: Fit) -> tuple[Check, bool]:
    """Check that points are on the sheets of their colors, and segments too; also whether a point is on no sheet."""
    tolerance, bare = criteria.tolerance, np.flatnonzero(segments.color == 0)
    if len(bare):
        place = segments.place(bare[0])
        idle = idle_pair(place, criteria.vehicle)
        lies = f"{place} lies on neither sheet"
        if idle:
            lies = f"{idle} idle at {place}, which lies on neither sheet"
        message = f"{lies}: {_TAKE_ROOTS}"
        broken = check_of("continuous", False, message, limit=tolerance, place=place)
        return broken, True
    jump = _largest_jump(segments, criteria)
    farthest = int(np.argmax(fit.off))
    off = float(fit.off[farthest])
    breaks_by_jump = jump.changes_color and jump.size > max(
        jump.limit, off + SAME_ANGLE
    )
    if off > tolerance and not breaks_by_jump:
        color = color_of(segments.color[farthest])
        near = fit.distances[farthest] <= tolerance
        others = [name for name, yes in zip(COLORS, near, strict=True) if yes]
        where = "".join(f", on the {name} one" for name in others)
        place = segments.place(farthest)
        message = (
            f"{place} is colored {color} but lies off that sheet{where}, by {off:.4f} rad (limit {tolerance:g}): "
            "give it the color of its sheet, or take (α3, α4) from the sheet of its color"
        )
        broken = check_of(
            "continuous",
            False,
            message,
            value=off,
            limit=tolerance,
            place=place,
        )
        return broken, not others
    place, ok = segments.place(jump.segment), jump.size <= jump.limit
    message = "every segment stays on its sheet"
    if not ok:
        cause = "wraps by π or leaves its sheet"
        if jump.changes_color:
            cause = "changes color"
        size = f"{jump.size:.4f} rad (limit {jump.limit:g})"
        message = f"(α3, α4) jumps by {size} after {place}, where it {cause}: stay on one sheet"
    found = check_of(
        "continuous",
        ok,
        message,
        value=jump.size,
        limit=jump.limit,
        place=place,
    )
    return found, False
