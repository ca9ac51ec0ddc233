"""A gait with the criteria of its checks, and what several rules need of both.

A gait is a closed polyline or a path: points that are joined by straight segments. A smooth curve is judged by its
chords: each bound is reduced by the largest effect of the distance between them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gaitgraph._lazy import cached_property
from gaitgraph.angles import HALF_PI, angle_within, checked_floor, checked_number
from gaitgraph.arrays import freeze_arrays, read_only
from gaitgraph.gait.table import closing_time
from gaitgraph.invertibility.coefficients import coefficients_of, is_red
from gaitgraph.invertibility.forms import FloatArray, Sines
from gaitgraph.invertibility.matrices import (
    IntArray,
    level_of_vehicle,
    shares_at,
    singular_value_rate,
)
from gaitgraph.invertibility.segment_bounds import (
    Least,
    LevelSign,
    Quantity,
    Residual,
    least_of_each,
    share_quantity,
    singular_quantity,
    thrusts_push_up,
)
from gaitgraph.records import Record
from gaitgraph.surface.sheets import CodeArray, color_codes, of_color, sheet_distances
from gaitgraph.tolerances import (
    DEFAULT_CROSSING_TOLERANCE,
    DEFAULT_TOLERANCE,
    SAME_ANGLE,
)
from gaitgraph.validation.report import GaitPoint
from gaitgraph.validation.wrong_rows import LoneRows, Misreading, misreading_of

if TYPE_CHECKING:
    from gaitgraph.gait.gait import Gait
    from gaitgraph.invertibility.coefficients import Coefficients
    from gaitgraph.invertibility.matrices import BoolArray
    from gaitgraph.vehicle import Vehicle

_NO_LONE_ROWS = LoneRows()


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
        checked = {"floor": checked_floor(self.floor)}
        for name in ("tolerance", "crossing_tolerance"):
            checked[name] = checked_number(name, getattr(self, name))
        if self.angle_rounding is not None:
            rounding = angle_within(self.angle_rounding, "angle_rounding", least=0.0)
            checked["angle_rounding"] = rounding
        for name, value in checked.items():
            object.__setattr__(self, name, value)  # the record is frozen

    @property
    def has_planes(self) -> bool:
        """Whether the gait surfaces are planes, so that points have colors and types."""
        return self.vehicle.asymmetry is None

    @property
    def exact(self) -> Coefficients:
        """The exact coefficients of the vehicle."""
        return coefficients_of(self.vehicle, "exact")

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

    def worst_place(self, brackets: Least) -> GaitPoint:
        """Return the place at which a quantity is least."""
        _, _, segment, fraction = brackets.worst()
        return self.place(segment, fraction)


def _between(values: FloatArray, index: int, fraction: float) -> FloatArray:
    """Return a value of a segment, at a fraction of it."""
    value = values[index]
    if fraction:
        value = value + fraction * (values[index + 1] - value)
    return np.asarray(value)


def segments_of_rows(
    alpha: FloatArray, color: CodeArray, t: FloatArray | None, *, closes: bool
) -> Segments:
    """Return the segments between rows; the one that leads back to the first, if any, takes a mean step of time."""
    number = np.arange(1, len(alpha) + 1)
    if closes:
        alpha = np.concatenate([alpha, alpha[:1]])
        color = np.append(color, color[:1])
        number = np.append(number, 1)
        if t is not None:
            t = np.append(t, closing_time(t[0], t[-1], len(t)))
    return Segments(alpha=alpha, color=color, number=number, noun="row", t=t)


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


@dataclass(frozen=True, kw_only=True, eq=False)
class JudgedGait:
    """A gait with the criteria of its checks; what several rules need of both is computed once.

    `lone` are rows of a table that alone are far from their neighbours.
    """

    segments: Segments
    criteria: Criteria
    lone: LoneRows = _NO_LONE_ROWS

    @cached_property
    def distances(self) -> FloatArray:
        """How far the points are from red and blue, mod π, shape (n, 2) [rad]; infinite without planes."""
        alpha = self.segments.alpha
        if not self.criteria.has_planes:
            return np.full((len(alpha), 2), np.inf)
        return sheet_distances(alpha, self.criteria.coefficients)

    @cached_property
    def off(self) -> FloatArray:
        """How far each point is from the sheet of its color, 0 without one, shape (n,) [rad]."""
        color = self.segments.color
        return np.where(color == 0, 0.0, of_color(self.distances.T, color))

    @cached_property
    def on_blue(self) -> bool:
        """Whether a point is on blue alone, whatever its color, and the matrix singular there: without rotor height.

        A larger tolerance than the default takes rows for blue that are beside it, where the matrix is not singular.
        """
        near = self.distances <= min(self.criteria.tolerance, DEFAULT_TOLERANCE)
        is_blue = near[:, 1] & ~near[:, 0]
        return bool(is_blue.any()) and not self.criteria.coefficients.is_raised

    @property
    def angle_errors(self) -> FloatArray:
        """The assumed error of the angles at each point, shape (n,) [rad].

        By default it is what digits may explain: the distance from the sheet of its color within the tolerance.
        """
        if self.criteria.angle_rounding is not None:
            return np.full(len(self.off), self.criteria.angle_rounding)
        is_error = (self.off > SAME_ANGLE) & (self.off <= self.criteria.tolerance)
        return np.where(is_error, self.off, 0.0)

    @cached_property
    def level(self) -> FloatArray:
        """R at the points, shape (n,)."""
        form = self.criteria.coefficients.level_form
        return np.asarray(form.at(self.segments.sines)[0])

    @cached_property
    def shares(self) -> FloatArray:
        """The hover thrusts at the points, as shares of the weight, shape (4, n)."""
        return shares_at(self.segments.sines, level_of_vehicle(self.criteria.vehicle))

    @cached_property
    def sign(self) -> float:
        """The sign of the gait: that of R where |R| at a point is largest."""
        return _sign_of(self.level)

    @cached_property
    def exact_sign(self) -> float:
        """The same for exact coefficients."""
        return _sign_of(self.criteria.exact.level_form.at(self.segments.sines)[0])

    @cached_property
    def brackets(self) -> dict[str, Least]:
        """Brackets of the least of each quantity that is compared with a limit, along each segment, in one search.

        `level` and `exact_level` are of R times its sign, with the coefficients of the gait and with exact ones,
        `singular_value` of the least singular value, and `residual` of −max(|Rφ|, |Rθ|), which vanishes exactly where
        all points are red. `least_share` and `minus_largest_share` are of the hover thrusts, as shares of the weight;
        they are there if all are positive at the points.
        """
        criteria, segments = self.criteria, self.segments
        # Of a curve bounds are reported.
        width = 1e-6 if criteria.beside else 1e-4
        names = ["level", "exact_level", "singular_value"]
        quantities: list[Quantity] = [
            LevelSign(criteria.coefficients, self.sign),
            LevelSign(criteria.exact, self.exact_sign),
            singular_quantity(criteria.vehicle),
        ]
        tolerances = [1e-6, 1e-6, width]
        if criteria.has_planes and not segments.on_red:
            names.append("residual")
            quantities.append(Residual(criteria.coefficients))
            tolerances.append(criteria.tolerance / 100)
        if not self.on_blue and (self.shares > 0).all():
            names += ["least_share", "minus_largest_share"]
            quantities.append(share_quantity(criteria.vehicle))
            tolerances.append(width)
        brackets = least_of_each(segments.starts, segments.ends, quantities, tolerances)
        return dict(zip(names, brackets, strict=True))

    @cached_property
    def upward(self) -> BoolArray:
        """Whether all hover thrusts are positive along each segment, and no rotor is beyond π/2, shape (m,)."""
        segments = self.segments
        names = ("exact_level", "least_share")
        above_zero = [
            name in self.brackets and self.brackets[name].lower.min() > 0
            for name in names
        ]
        if all(above_zero) and np.abs(segments.alpha).max() <= HALF_PI:
            return np.ones(len(segments.starts), dtype=bool)
        # What is nearly zero is decided by finer brackets.
        return thrusts_push_up(segments.starts, segments.ends, self.criteria.vehicle)

    @cached_property
    def residual(self) -> tuple[float, GaitPoint]:
        """An upper bound of max(|Rφ|, |Rθ|) along the gait, and where it is nearly reached."""
        brackets = self.brackets.get("residual")
        if brackets is None:
            return 0.0, self.segments.place(0)
        largest = max(0.0, -float(brackets.lower.min()))
        return largest, self.segments.worst_place(brackets)

    @cached_property
    def misreading(self) -> Misreading:
        """How rows that are off the surface were misread."""
        alpha, criteria = self.segments.alpha, self.criteria
        if self.segments.noun != "row" or self.residual[0] <= criteria.tolerance:
            return Misreading()
        return misreading_of(alpha, criteria.coefficients, criteria.tolerance)


def _sign_of(level: FloatArray) -> float:
    """Return the sign of the value that is largest in size."""
    largest = level[np.argmax(np.abs(level))]
    return 1.0 if largest >= 0 else -1.0
