"""The rules of valid and flyable. Each holds along the segments of a gait, by closed form or a bound.

A gait is a chain of points joined by straight segments. It may be too long for memory, so it is judged run by run. A
smooth curve is judged by its chords: what it may differ from them by is taken off each bound.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import number_of, wrapped
from gaitgraph.errors import InputError, shown
from gaitgraph.invertibility.matrices import (
    Coefficients,
    coefficients_of,
    hover_thrust_shares,
    level_determinant,
    level_determinant_resolution,
    level_determinant_slopes,
)
from gaitgraph.invertibility.segment_bounds import (
    Least,
    keeps_singular_value_above,
    largest_residual,
    least_level_determinant,
    least_singular_value_of_all,
    range_of_level_determinant,
    thrust_shares_along,
    thrusts_push_up,
    where_thrusts_vanish,
)
from gaitgraph.surface.adjacency import neighbors_allowed, text_from_types
from gaitgraph.surface.sheets import (
    DEFAULT_CROSSING_TOLERANCE,
    FAMILIES,
    FAMILY_COLUMN,
    FIRST,
    family_codes,
    family_distances,
    family_jumps,
    family_of,
    family_types,
    sheet_angles,
)
from gaitgraph.validation.report import Check, Place

if TYPE_CHECKING:
    from collections.abc import Iterator

    from gaitgraph.gait.gait import Gait
    from gaitgraph.vehicle import Vehicle

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]

_EXACT = 1e-9
_SQRT2 = math.sqrt(2.0)


def checked_limits(**limits: float | None) -> None:
    """Raise InputError unless what a gait is judged by is finite and not negative."""
    for name, number in limits.items():
        if number is not None and not 0 <= number_of(number) < math.inf:
            raise InputError(f"{name} must be a finite number ≥ 0, got {shown(number)}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """What a gait is for, and the limits it is judged by, as in :func:`gaitgraph.validation.validating.check_gait`."""

    vehicle: Vehicle
    coefficients: Coefficients
    tolerance: float
    floor: float
    angle_rounding: float | None = None  # None: inferred from the distance to the sheets, and at least `digits` [rad]
    digits: float = 0.0  # error of each angle that follows from the printed digits [rad]
    crossing_tolerance: float = DEFAULT_CROSSING_TOLERANCE
    noun: str = "corner"  # what messages call a point of the gait: "corner" or "row"
    beside: float = 0.0  # how far a curve may be from the segments, its chords, in the (α1, α2) plane [rad]
    extremes: FloatArray | None = None  # the least and the largest tilt angles of the curve, shape (2, 4) [rad]

    def __post_init__(self) -> None:
        names = ("tolerance", "floor", "angle_rounding", "crossing_tolerance")
        checked_limits(**{name: getattr(self, name) for name in names})

    @property
    def bracket(self) -> float:
        """How narrow brackets of singular values and thrusts must be; those of a curve are reported."""
        return 1e-6 if self.beside else 1e-4

    @property
    def singular_value_slack(self) -> float:
        """By how much the least singular value may be less on a curve: at most √(2 + κ²) per radian of four angles."""
        return math.sqrt(2.0 + self.vehicle.drag_ratio**2) * _SQRT2 * self.beside

    def level_slack(self, coefficients: Coefficients) -> float:
        """Return by how much R may be less on a curve than on its chords.

        R is bilinear in the features of both pairs, each of norm √2 at most, as their slopes are; four angles move, by
        2√2·beside in sum.
        """
        return 2.0 * float(np.linalg.norm(coefficients.bilinear_form, 2)) * 2.0 * _SQRT2 * self.beside


@dataclass(frozen=True, slots=True, kw_only=True)
class Segments:
    """A run of consecutive straight segments of a gait."""

    alpha: FloatArray  # the points, shape (m + 1, 4) [rad]; a single point has no segment
    # As what each point is colored, shape (m + 1,): +1 red, −1 blue, 2 the first fibre, 3 the second, 0 none.
    sheet: npt.NDArray[np.int8]
    first: int = 0  # number of the first point, counted from 0
    after: int | None = None  # number of the last point, if it does not follow: 0 for the segment that closes a gait
    t: FloatArray | None = None  # times, shape (m + 1,) [s]
    after_t: float | None = None  # time of the point `after`, which is not when the closing segment ends [s]

    def __getitem__(self, part: slice) -> Segments:
        """Return consecutive points, as a slice of step 1."""
        start, stop, _ = part.indices(len(self.alpha))
        return replace(
            self,
            alpha=self.alpha[part],
            sheet=self.sheet[part],
            first=self.first + start,
            after=self.after if stop == len(self.alpha) else None,
            t=None if self.t is None else self.t[part],
        )

    def joined(self, following: Segments) -> Segments:
        """Return these points followed by others."""
        return Segments(
            alpha=np.concatenate([self.alpha, following.alpha]),
            sheet=np.concatenate([self.sheet, following.sheet]),
            first=self.first,
            t=None if self.t is None or following.t is None else np.concatenate([self.t, following.t]),
        )

    @property
    def starts(self) -> FloatArray:
        """The start of each segment, shape (m, 4) [rad]."""
        return self.alpha[:-1]

    @property
    def ends(self) -> FloatArray:
        """The end of each segment, shape (m, 4) [rad]."""
        return self.alpha[1:]

    def place(self, segment: int, fraction: float = 0.0) -> Place:
        """Return the place at a fraction of a segment, counted from 0 within the run."""
        index, fraction = (segment + 1, 0.0) if fraction == 1.0 else (segment, float(fraction))
        at = self.alpha[index]
        t = None if self.t is None else float(self.t[index])
        if self.after is not None and index == len(self.alpha) - 1:
            t = self.after_t
        if fraction:
            at = at + fraction * (self.alpha[index + 1] - at)
            t = None if self.t is None else float(t + fraction * (self.t[index + 1] - t))
        return Place(point=self.number(index) - 1, fraction=fraction, alpha=tuple(at.tolist()), t=t)

    def number(self, index: int) -> int:
        """Return the number of a point, counted from 1."""
        if self.after is not None and index == len(self.alpha) - 1:
            return self.after + 1
        return self.first + index + 1


def segments_of(gait: Gait) -> Segments:
    """Return all segments of a gait, from the last corner back to the first too."""
    sheet = family_codes(gait.colors) if gait.colors else np.zeros(len(gait.alpha), dtype=np.int8)
    return Segments(alpha=np.vstack([gait.alpha, gait.alpha[:1]]), sheet=np.append(sheet, sheet[0]), after=0)


@dataclass
class Worst:
    """The bracket of the least of a quantity over all segments so far, and where its upper end is attained."""

    lower: float = math.inf
    upper: float = math.inf
    place: Place | None = None

    def update(self, least: Least, run: Segments) -> None:
        """Include what was found along the segments of a run."""
        lower, upper, segment, fraction = least.worst()
        self.lower = min(self.lower, lower)
        if upper < self.upper or self.place is None:
            self.upper, self.place = upper, run.place(segment, fraction)


@dataclass
class Rule(ABC):
    """What all rules share: they are updated with runs of segments in order, and yield their checks at the end.

    How the segments are split into runs makes no difference to a verdict. A rule of flyable has the rule `continuous`
    beside it, which knows what the points lie on.
    """

    setting: Setting
    name: ClassVar[str]
    kind: ClassVar[Literal["valid", "flyable"]] = "valid"

    @abstractmethod
    def update(self, run: Segments) -> None:
        """Examine the next run of segments."""

    @abstractmethod
    def checks(self) -> Iterator[Check]:
        """Yield what was found, after at least one update."""

    def check(self, ok: bool, message: str, *, place: Place | None = None, **values: Any) -> Check:
        """Return the check of this name, unless the values have another, with its place as plain values."""
        where = None if place is None else place.as_mapping(self.setting.noun)
        return Check(**{"name": self.name, "kind": self.kind, "ok": ok, "message": message, "where": where, **values})

    def described(self, place: Place | None) -> str:
        """Return a place in words."""
        return "" if place is None else place.described(self.setting.noun)


@dataclass
class _OnSurface(Rule):
    """Rφ and Rθ vanish, to within the tolerance."""

    name = "on_surface"
    worst: Worst = field(default_factory=Worst)

    def update(self, run: Segments) -> None:
        tolerance, known = self.setting.tolerance / 100, self.worst.upper
        found = largest_residual(run.starts, run.ends, self.setting.coefficients, tolerance=tolerance, known=known)
        self.worst.update(found, run)

    def checks(self) -> Iterator[Check]:
        value, limit, place = max(-self.worst.lower, 0.0), self.setting.tolerance, self.worst.place
        message = f"max(|Rφ|, |Rθ|) = {value:.2g}, allowed {limit:g}"
        if value > limit:
            message += f", worst at {self.described(place)}: take (α3, α4) from the roots of (α1, α2), or allow more"
        yield self.check(value <= limit, message, value=value, limit=limit, place=place)


@dataclass
class _TwoColor(Rule):
    """Figure 15: neither α3 nor α4 steps from its + plane to its − plane."""

    name = "two_color"
    broken: tuple[str, Place] | None = None
    families: set[int] = field(default_factory=set)

    def update(self, run: Segments) -> None:
        self.families |= set(np.unique(run.sheet).tolist()) - {0}
        if self.broken is not None:
            return
        setting = self.setting
        third, fourth = family_types(run.alpha, run.sheet, setting.coefficients, setting.crossing_tolerance)
        bare = run.sheet == 0
        forbidden = ~neighbors_allowed((third[:-1], fourth[:-1]), (third[1:], fourth[1:]))
        if bare.any() and (not forbidden.any() or np.argmax(bare) <= np.argmax(forbidden)):
            point = int(np.argmax(bare))
            message = (
                f"{setting.noun} {run.number(point)} lies off the surfaces, on neither sheet, so it has no color "
                "to compare: take (α3, α4) from the roots of (α1, α2)"
            )
        elif forbidden.any():
            point = int(np.argmax(forbidden))
            here, there = (text_from_types(int(third[k]), int(fourth[k])) for k in (point, point + 1))
            message = (
                f"{setting.noun}s {run.number(point)} {here} and {run.number(point + 1)} {there} may not be "
                "neighbours (Figure 15): give both one color, or pass a (?,?) point between them"
            )
        else:
            return
        self.broken = (message, run.place(point))

    def checks(self) -> Iterator[Check]:
        if self.broken is not None:
            message, place = self.broken
            yield self.check(False, message, value=1.0, limit=0.0, place=place)
            return
        color = family_of(*self.families) if len(self.families) == 1 else "mixed"
        yield self.check(True, f"all neighbours allowed by Figure 15 ({color})", value=0.0, limit=0.0)


def jumps(
    starts: FloatArray, ends: FloatArray, red: BoolArray, red_after: BoolArray, coefficients: Coefficients
) -> FloatArray:
    """Return by how much (α3, α4) leave a continuous motion along segments, shape (m,) [rad].

    Along one sheet: π where an angle wraps, else how far the segment ends beside the sheet, zero on it. Between sheets
    the color changes at one of the two ends: the smaller of the distances between the sheets there, in the larger of
    the two angles.
    """
    sign = np.where(red, 1.0, -1.0)
    step = ends - starts
    # What the start is off its sheet by changes linearly along the segment; whole wraps show at its end.
    turn = np.where(red, 0.0, 2 * coefficients.delta)
    off = wrapped(starts[:, 2:] - sign[:, None] * starts[:, :2] - np.column_stack([turn, -turn]))
    out = np.abs(off + step[:, 2:] - sign[:, None] * step[:, :2]).max(axis=1)
    between = red != red_after
    if between.any():
        gaps = []
        for at, is_red in ((starts[between], red[between]), (ends[between], red_after[between])):
            on_red, on_blue = (
                np.column_stack(sheet_angles(color, at[:, 0], at[:, 1], coefficients)) for color in ("red", "blue")
            )
            gaps.append(np.abs(at[:, 2:] - np.where(is_red[:, None], on_blue, on_red)).max(axis=1))
        out[between] = np.minimum(*gaps)
    return np.where(out > _EXACT, out, 0.0)


@dataclass
class Continuous(Rule):
    """Every point lies on the sheet of its color, and every segment stays there. Other rules ask it what it found."""

    name = "continuous"
    bare: Place | None = None  # the first point off the surfaces
    rounding: float = 0.0  # the largest distance from a sheet that the tolerance takes for rounding
    roundings: FloatArray = field(default_factory=lambda: np.zeros(0))  # the same for each point of the latest run
    blue: bool = False  # whether a point lies on the blue sheet alone, whatever its color
    fiber: tuple[int, int, Place] | None = None  # the first point colored as a fibre: which, number, place
    distance: float = 0.0  # the point that is farthest off the sheet of its color
    off_sheet: str = ""
    farthest: Place | None = None
    ratio: float = -1.0  # the largest jump beside its limit
    jump: float = 0.0
    limit: float = 0.0
    changes: bool = False  # of color
    place: Place | None = None

    def update(self, run: Segments) -> None:
        """Compare points with the sheets of their colors, and segments with the sheets of their ends."""
        sheet, setting = run.sheet, self.setting
        bare, fibered = sheet == 0, sheet > 1
        self.roundings = np.zeros(len(sheet))
        if bare.any():
            self.bare = self.bare or run.place(int(np.argmax(bare)))
            if bare.all():
                return
        if fibered.any() and self.fiber is None:
            point = int(np.argmax(fibered))
            self.fiber = (int(sheet[point]), run.number(point), run.place(point))
        distances = family_distances(run.alpha, setting.coefficients)
        on_blue = (distances[:, 1] <= setting.tolerance) & (distances[:, 0] > setting.tolerance)
        self.blue |= bool((on_blue & ~fibered).any())
        # How far points are from the sheet or fibre of their color.
        column = FAMILY_COLUMN[sheet]
        off = np.where(bare, 0.0, np.take_along_axis(distances, column[:, None], axis=1)[:, 0])
        self.roundings = np.where((off > _EXACT) & (off <= setting.tolerance), off, 0.0)
        self.rounding = max(self.rounding, float(self.roundings.max()))
        farthest = int(np.argmax(off))
        if off[farthest] > max(self.distance, _EXACT):
            self.distance, self.farthest = float(off[farthest]), run.place(farthest)
            color = FAMILIES[column[farthest]]
            self.off_sheet = (
                f"{setting.noun} {run.number(farthest)} is colored {color} but lies off that "
                f"{'fibre' if fibered[farthest] else 'sheet'}"
            )
            near = distances[farthest] <= setting.tolerance
            others = [name for name, is_near in zip(FAMILIES, near, strict=True) if is_near and name != color]
            if others:
                self.off_sheet += f", on the {others[0]} one"
        # How far segments leave the sheets of their ends.
        starts, ends, red, after = run.starts, run.ends, sheet[:-1] > 0, sheet[1:] > 0
        sizes = jumps(starts, ends, red, after, setting.coefficients)
        by = fibered[:-1] | fibered[1:]
        if by.any():
            sizes[by] = family_jumps(starts[by], ends[by], sheet[:-1][by], sheet[1:][by], setting.coefficients)
            sizes[sizes <= _EXACT] = 0.0
        # Within one color, printed digits may move a segment off its sheet as far as the surface check allows; along a
        # fibre too, whose line with the red sheet is on both.
        limits = np.where((red == after) | by, setting.tolerance, _EXACT)
        ratios = sizes / np.maximum(limits, _EXACT)
        worst = int(np.argmax(ratios))
        if ratios[worst] > self.ratio:
            self.ratio, self.jump, self.limit = float(ratios[worst]), float(sizes[worst]), float(limits[worst])
            self.place, self.changes = run.place(worst), bool(sheet[worst] != sheet[worst + 1])

    def checks(self) -> Iterator[Check]:
        """Yield the check `continuous`."""
        noun, tolerance = self.setting.noun, self.setting.tolerance
        if self.bare is not None:
            message = f"at {noun} {self.bare.point + 1} it is off the surfaces and follows no sheet"
            yield self.check(False, message, limit=tolerance, place=self.bare)
        elif self.distance > tolerance and (not self.changes or self.jump <= max(self.limit, self.distance + _EXACT)):
            message = (
                f"{self.off_sheet}, by {self.distance:.4f} rad: give it the color of its sheet, or take (α3, α4) from "
                "the sheet of its color"
            )
            yield self.check(False, message, value=self.distance, limit=tolerance, place=self.farthest)
        else:
            ok, message = self.jump <= self.limit, "every segment stays on its sheet"
            if not ok and self.place is not None:
                cause = "changes color" if self.changes else "wraps by π or leaves its sheet"
                after = f"{noun} {self.place.point + 1}"
                message = f"(α3, α4) jumps by {self.jump:.4f} rad after {after}, where it {cause}: stay on one sheet"
            yield self.check(ok, message, value=self.jump, limit=self.limit, place=self.place)


@dataclass
class _LevelSign(Rule):
    """Proposition 1: R has one sign, judged against what the digits of coefficients and angles carry."""

    name = "R_sign"
    continuous: Continuous
    # Which sign R has is known at the end: that of the largest |R| at a point.
    worst: dict[float, Worst] = field(default_factory=lambda: {1.0: Worst(), -1.0: Worst()})
    found: dict[float, bool] = field(default_factory=lambda: {1.0: False, -1.0: False})  # for certain, at a point
    largest: float = 0.0
    digits: float = 0.0
    slope: float = 0.0

    def update(self, run: Segments) -> None:
        """Bracket R and −R along the segments, as narrowly as the comparison with the resolution needs."""
        coefficients, alpha = self.setting.coefficients, run.alpha
        value = np.asarray(level_determinant(alpha, coefficients))
        peak = float(value[np.argmax(np.abs(value))])
        self.largest = peak if abs(peak) > abs(self.largest) else self.largest
        digits = np.asarray(level_determinant_resolution(alpha, coefficients))
        slope = level_determinant_slopes(alpha, coefficients).sum(axis=1)
        self.digits, self.slope = max(self.digits, float(digits.max())), max(self.slope, float(slope.max()))
        carried = self._carried(digits, slope, self.continuous.roundings)
        for sign in self.found:
            self.found[sign] |= bool((sign * value > carried).any())
        resolution = self._resolution()
        known = (self.worst[1.0].upper, self.worst[-1.0].upper)
        both = range_of_level_determinant(
            run.starts, run.ends, coefficients, known=known, at_ends=(value[:-1], value[1:])
        )
        for (sign, worst), found in zip(self.worst.items(), both, strict=True):
            if found.lower.min() <= resolution < min(found.upper.min(), worst.upper):
                # Narrow the brackets that straddle the resolution until the comparison with it is settled.
                near, floor = found.lower <= resolution, resolution * (1 + 1e-9)
                narrow = least_level_determinant(
                    run.starts[near], run.ends[near], coefficients, sign=sign, tolerance=0.0, floor=floor, each=True
                )
                lower, upper, fraction = found.lower.copy(), found.upper.copy(), found.fraction.copy()
                lower[near], upper[near], fraction[near] = narrow.lower, narrow.upper, narrow.fraction
                found = Least(lower=lower, upper=upper, fraction=fraction)  # noqa: PLW2901
            worst.update(found, run)

    def _carried(self, digits: Any, slope: Any, inferred: Any) -> Any:
        """Return how large |R| must be for its sign to mean something, to second order in the rounding of angles."""
        coefficients, known = self.setting.coefficients, self.setting.angle_rounding
        rounding = np.maximum(inferred, self.setting.digits) if known is None else known
        derived = coefficients.sheet_rounding
        second = 8 * float(np.linalg.norm(coefficients.bilinear_form)) * ((rounding + derived) ** 2 - derived**2)
        return digits + slope * rounding + second

    def _resolution(self) -> float:
        return float(self._carried(self.digits, self.slope, self.continuous.rounding))

    def checks(self) -> Iterator[Check]:
        sign = 1.0 if self.largest >= 0 else -1.0
        worst, resolution, kind = self.worst[sign], self._resolution(), self.setting.coefficients.kind
        lower = worst.lower - self.setting.level_slack(self.setting.coefficients)
        ok, decided = True, True
        if self.continuous.blue and kind == "exact":
            ok = False
            message = "R = 0 on the whole blue sheet with exact coefficients, so it has no sign: use red"
        elif lower > resolution:
            relation = f"R ≥ {lower:.3g} > 0" if sign > 0 else f"R ≤ {-lower:.3g} < 0"
            message = f"{relation} along the whole gait ({kind} coefficients)"
        elif worst.upper < -resolution or all(self.found.values()):
            ok = False
            message = (
                f"R changes its sign at {self.described(worst.place)} ({kind} coefficients): keep the loop in one "
                "region of R"
            )
        else:
            decided = False
            message = (
                f"sign of R undecided: |R| falls to {abs(worst.upper):.2g}, within the {resolution:.2g} that the "
                f"{kind} coefficients and the digits of the angles carry; it is an artefact of rounding, not a margin"
            )
            if worst.lower > resolution:
                message = (
                    f"sign of R undecided: along the curve |R| may fall to {max(lower, 0.0):.2g}: try a smaller chord"
                )
        value = sign * (lower if self.setting.beside else worst.upper)
        yield self.check(ok, message, value=value, limit=resolution, place=worst.place, decided=decided)


@dataclass
class _SingularValue(Rule):
    """The decoupling matrix of the exact physics is well invertible, level."""

    name = "least_singular_value"
    kind = "flyable"
    continuous: Continuous
    worst: Worst = field(default_factory=Worst)
    above: bool = True

    def update(self, run: Segments) -> None:
        """Bracket the least singular value, and decide the comparison with the floor where the bracket does not."""
        setting, floor = self.setting, self.setting.floor + self.setting.singular_value_slack
        found = least_singular_value_of_all(
            run.starts, run.ends, setting.vehicle, tolerance=setting.bracket, known=self.worst.upper
        )
        self.worst.update(found, run)
        close = found.lower < floor
        if self.above and close.any():
            self.above = self.worst.upper >= floor and bool(
                keeps_singular_value_above(run.starts[close], run.ends[close], floor, setting.vehicle).all()
            )

    def checks(self) -> Iterator[Check]:
        floor, place, lower = self.setting.floor, self.worst.place, self.worst.lower - self.setting.singular_value_slack
        value = lower if self.setting.beside else self.worst.upper
        message = f"least singular value {value:.3f} (at least {max(lower, 0.0):.3f}), floor {floor:g}"
        if not self.above:
            message = (
                f"the decoupling matrix is nearly singular: least singular value {value:.2g}, floor {floor:g}, at "
                f"{self.described(place)}"
            )
            if self.continuous.blue:
                message += "; in exact physics the whole blue sheet is singular at every attitude: use red"
        yield self.check(self.above, message, value=value, limit=floor, place=place)


@dataclass
class _HoverThrust(Rule):
    """The thrusts that carry the weight without torque are positive, and within the vehicle's limit."""

    name = "hover_thrust"
    kind = "flyable"
    continuous: Continuous
    least: Worst = field(default_factory=Worst)
    largest: Worst = field(default_factory=Worst)
    level: float = math.inf  # the least |R| of a curve's chords, exact coefficients
    broken: tuple[float | None, int, Place] | None = None

    def update(self, run: Segments) -> None:
        """Bracket the least and the largest thrust, up to the first segment where one is not positive."""
        if self.continuous.blue or self.continuous.fiber is not None or self.broken is not None:
            return
        setting, vehicle, known = self.setting, self.setting.vehicle, (self.least.upper, self.largest.upper)
        upward, least, largest = thrust_shares_along(
            run.starts, run.ends, vehicle, tolerance=setting.bracket, known=known
        )
        if upward.all():
            self.least.update(least, run)
            self.largest.update(largest, run)
            if setting.beside:
                exact = coefficients_of(vehicle, "exact")
                sign = 1.0 if level_determinant(run.alpha[0], exact) > 0 else -1.0
                level = least_level_determinant(run.starts, run.ends, exact, sign=sign).lower.min()
                self.level = min(self.level, float(level))
            return
        segment = int(np.argmin(upward))
        shares = hover_thrust_shares(run.alpha[segment : segment + 2], vehicle)
        worst = int(np.argmin(np.nan_to_num(shares, nan=-np.inf).min(axis=1)))
        if shares[worst].min() > 0:
            # Both ends are fine: something vanishes between them.
            fraction = where_thrusts_vanish(run.starts[segment], run.ends[segment], vehicle)
            self.broken = (None, run.number(segment), run.place(segment, fraction))
        else:
            self.broken = (float(shares[worst].min()), run.number(segment), run.place(segment + worst))

    def _shares(self) -> tuple[float, float]:
        """Return the least and the largest share of m·g; of a curve bounds of them, and 0 where a rotor may idle.

        On red each factor of the zero-moment inputs depends on one coordinate, so the diagonal of the box around a
        curve decides for all of it. There T1/(m·g) = |sin β2|/(2D) with D = |sin β2| cos α1 + |sin β1| cos α2 =
        (κ cos³δ/2)·|R|/|cos β1 cos β2|, and D's slope is at most 2√2.
        """
        setting, vehicle, beside = self.setting, self.setting.vehicle, self.setting.beside
        if setting.extremes is None:
            return self.least.upper, -self.largest.lower
        kappa, box = vehicle.drag_ratio, setting.extremes
        level = self.level - setting.level_slack(coefficients_of(vehicle, "exact"))
        weight = level * kappa / (2.0 * (1.0 + kappa**2) ** 1.5)
        steep = 2.0 * _SQRT2 * beside / weight if weight > 0 else math.inf
        if steep >= 0.5 or not thrusts_push_up(box[:1], box[1:], vehicle).all():
            return 0.0, math.inf
        high = (-self.largest.lower + beside / (2.0 * weight)) / (1.0 - steep)
        return self.least.lower - beside / (2.0 * weight) - steep * high, high

    def checks(self) -> Iterator[Check]:
        noun = self.setting.noun
        if self.continuous.blue:
            # Floating point would give some ratio of two vanishing quantities.
            message = "no thrusts carry the weight without torque: on blue the control moment matrix has rank two"
            yield self.check(False, message, limit=0.0)
            return
        if self.continuous.fiber is not None:
            code, number, place = self.continuous.fiber
            which, rotors = ("first", "2 and 4") if code == FIRST else ("second", "1 and 3")
            message = (
                f"{noun} {number} is on the {which} fibre, where rotors {rotors} idle in hover: rotors that push one "
                "way only cannot make a torque there; leave it for the red sheet, off its line"
            )
            yield self.check(False, message, value=0.0, limit=0.0, place=place)
            return
        if self.broken is not None:
            value, number, place = self.broken
            vanishing = "" if value is not None else f", where they vanish on the way, at {self.described(place)}"
            message = (
                f"a rotor pair would have to idle or push down to hover on the segment after {noun} {number}"
                f"{vanishing}: stay where β1 and β2 have opposite signs (α1 < δ and α2 > −δ, or both the other way)"
            )
            yield self.check(False, message, value=value, limit=0.0, place=place)
            return
        low, peak = self._shares()
        if low <= 0:
            message = "a rotor may have to idle to hover along the curve: keep away from β1 = 0 and β2 = 0"
            yield self.check(False, message, limit=0.0, place=self.least.place)
            return
        message = f"hover thrusts {low:.3f} to {peak:.3f} of m·g per rotor, all positive"
        yield self.check(True, message, value=low, limit=0.0, place=self.least.place)
        limit = self.setting.vehicle.max_thrust
        if limit is not None:
            mass, gravity = self.setting.vehicle.require("mass", "gravity", purpose="the check of the largest thrust")
            newtons, at = peak * mass * gravity, self.largest.place
            ok = newtons <= limit
            message = f"largest hover thrust {newtons:.3g} N, limit {limit:.3g} N"
            message += "" if ok else f", exceeded at {self.described(at)}: tilt less there"
            yield self.check(ok, message, value=newtons, limit=limit, place=at, name="thrust_limit")


@dataclass
class _TiltRange(Rule):
    """No arm tilts beyond the vehicle's limit; along a straight segment each angle is largest at an end."""

    name = "tilt_range"
    kind = "flyable"
    value: float = -1.0
    joint: int = 0
    place: Place | None = None

    def update(self, run: Segments) -> None:
        size = np.abs(run.alpha)
        point, joint = divmod(int(np.argmax(size)), 4)
        if size[point, joint] > self.value:
            self.value, self.joint, self.place = float(size[point, joint]), joint + 1, run.place(point)

    def checks(self) -> Iterator[Check]:
        limit, extremes = self.setting.vehicle.max_tilt, self.setting.extremes
        if limit is None:
            return
        value = self.value if extremes is None else float(np.abs(extremes).max())
        ok = value <= limit + _EXACT
        message = f"largest tilt {math.degrees(value):.1f}°, limit {math.degrees(limit):.1f}°"
        if not ok:
            message += f", exceeded by α{self.joint} at {self.described(self.place)}: move the waypoints nearer to 0"
        yield self.check(ok, message, value=value, limit=limit, place=self.place)


def all_rules(setting: Setting) -> tuple[list[Rule], Continuous]:
    """Return the rules in the order of the report, and the one that knows what the points lie on."""
    continuous = Continuous(setting)
    flyable = [rule(setting, continuous) for rule in (_LevelSign, _SingularValue, _HoverThrust)]
    return [_OnSurface(setting), _TwoColor(setting), continuous, *flyable, _TiltRange(setting)], continuous
