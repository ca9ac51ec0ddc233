"""The rules of valid and flyable. Each holds along the segments of a gait, by closed form or a bound.

A gait is a chain of points joined by straight segments. It may be too long for memory, so it is judged run by run.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import wrapped
from gaitgraph.invertibility.branch_and_bound import Least
from gaitgraph.invertibility.matrices import (
    Coefficients,
    hover_thrust_shares,
    level_determinant,
    level_determinant_resolution,
    level_determinant_slopes,
)
from gaitgraph.invertibility.segment_bounds import (
    keeps_singular_value_above,
    largest_residual,
    least_level_determinant,
    least_singular_value_of_all,
    range_of_level_determinant,
    thrust_shares_along,
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
    from gaitgraph.gait.gait import Gait
    from gaitgraph.vehicle import Vehicle

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]

_EXACT = 1e-9


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
        return Segments(
            alpha=self.alpha[part],
            sheet=self.sheet[part],
            first=self.first + start,
            after=self.after if stop == len(self.alpha) else None,
            t=None if self.t is None else self.t[part],
            after_t=self.after_t,
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


class Worst:
    """The bracket of the least of a quantity over all segments so far, and where its upper end is attained."""

    def __init__(self) -> None:
        self.lower, self.upper = math.inf, math.inf
        self.place: Place | None = None

    def update(self, least: Least, run: Segments) -> None:
        """Include what was found along the segments of a run."""
        lower, upper, segment, fraction = least.worst()
        self.lower = min(self.lower, lower)
        if upper < self.upper or self.place is None:
            self.upper, self.place = upper, run.place(segment, fraction)


class Rule(ABC):
    """What all rules share: they are updated with runs of segments in order, and return their checks at the end.

    How the segments are split into runs makes no difference to a verdict.
    """

    def __init__(self, setting: Setting) -> None:
        self.setting = setting

    @abstractmethod
    def update(self, run: Segments) -> None:
        """Examine the next run of segments."""

    @abstractmethod
    def checks(self) -> list[Check]:
        """Return what was found, after at least one update."""

    def described(self, place: Place | None) -> str:
        """Return a place in words."""
        return "" if place is None else place.described(self.setting.noun)

    def check(
        self,
        name: str,
        kind: Literal["valid", "flyable"],
        ok: bool,
        message: str,
        *,
        value: float | None = None,
        limit: float | None = None,
        place: Place | None = None,
    ) -> Check:
        """Return a check with its place as plain values."""
        where = None if place is None else place.as_mapping(self.setting.noun)
        return Check(name=name, kind=kind, ok=ok, message=message, value=value, limit=limit, where=where)


class OnSurface(Rule):
    """Rφ and Rθ vanish, to within the tolerance."""

    def __init__(self, setting: Setting) -> None:
        super().__init__(setting)
        self.worst = Worst()

    def update(self, run: Segments) -> None:
        """Bracket the largest residual along the segments."""
        tolerance, known = self.setting.tolerance / 100, self.worst.upper
        found = largest_residual(run.starts, run.ends, self.setting.coefficients, tolerance=tolerance, known=known)
        self.worst.update(found, run)

    def checks(self) -> list[Check]:
        """Return the check `on_surface`."""
        value, limit, place = max(-self.worst.lower, 0.0), self.setting.tolerance, self.worst.place
        ok = value <= limit
        message = f"max(|Rφ|, |Rθ|) = {value:.2g}, allowed {limit:g}"
        if not ok:
            message += f", worst at {self.described(place)}: take (α3, α4) from the roots of (α1, α2), or allow more"
        return [self.check("on_surface", "valid", ok, message, value=value, limit=limit, place=place)]


class TwoColor(Rule):
    """Figure 15: neither α3 nor α4 steps from its + plane to its − plane."""

    def __init__(self, setting: Setting) -> None:
        super().__init__(setting)
        self.broken: tuple[str, Place] | None = None
        self.families: set[int] = set()

    def update(self, run: Segments) -> None:
        """Look for the first point without a color, or pair of points that Figure 15 forbids."""
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

    def checks(self) -> list[Check]:
        """Return the check `two_color`."""
        if self.broken is not None:
            message, place = self.broken
            return [self.check("two_color", "valid", False, message, value=1.0, limit=0.0, place=place)]
        color = family_of(*self.families) if len(self.families) == 1 else "mixed"
        message = f"all neighbours allowed by Figure 15 ({color})"
        return [self.check("two_color", "valid", True, message, value=0.0, limit=0.0)]


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
            r3, r4 = sheet_angles("red", at[:, 0], at[:, 1], coefficients)
            b3, b4 = sheet_angles("blue", at[:, 0], at[:, 1], coefficients)
            other3, other4 = np.where(is_red, b3, r3), np.where(is_red, b4, r4)
            gaps.append(np.maximum(np.abs(at[:, 2] - other3), np.abs(at[:, 3] - other4)))
        out[between] = np.minimum(*gaps)
    return np.where(out > _EXACT, out, 0.0)


class Continuous(Rule):
    """Every point lies on the sheet of its color, and every segment stays there."""

    def __init__(self, setting: Setting) -> None:
        super().__init__(setting)
        self.bare: Place | None = None  # the first point off the surfaces
        self.rounding = 0.0  # the largest distance from a sheet that the tolerance takes for rounding
        self.roundings = np.zeros(0)  # the same for each point of the latest run
        self.blue = False  # whether a point lies on the blue sheet alone, whatever its color
        self.fiber: tuple[int, int, Place] | None = None  # the first point colored as a fibre: which, number, place
        self.distance, self.off_sheet = 0.0, ""  # the point that is farthest off the sheet of its color
        self.farthest: Place | None = None
        self.ratio, self.jump, self.limit, self.changes = -1.0, 0.0, 0.0, False  # the largest jump beside its limit
        self.place: Place | None = None

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

    def checks(self) -> list[Check]:
        """Return the check `continuous`."""
        noun, tolerance = self.setting.noun, self.setting.tolerance
        ok, value, limit, place = False, self.jump, self.limit, self.place
        if self.bare is not None:
            message = f"at {noun} {self.bare.point + 1} it is off the surfaces and follows no sheet"
            return [self.check("continuous", "valid", False, message, limit=tolerance, place=self.bare)]
        if self.distance > tolerance and (not self.changes or self.jump <= max(self.limit, self.distance + _EXACT)):
            value, limit, place = self.distance, tolerance, self.farthest
            message = (
                f"{self.off_sheet}, by {value:.4f} rad: give it the color of its sheet, or take (α3, α4) from the "
                "sheet of its color"
            )
        elif self.jump > self.limit and place is not None:
            cause = "changes color" if self.changes else "wraps by π or leaves its sheet"
            message = (
                f"(α3, α4) jumps by {self.jump:.4f} rad after {noun} {place.point + 1}, where it {cause}: stay on one "
                "sheet"
            )
        else:
            ok, message = True, "every segment stays on its sheet"
        return [self.check("continuous", "valid", ok, message, value=value, limit=limit, place=place)]


class LevelSign(Rule):
    """Proposition 1: R has one sign, judged against what the digits of coefficients and angles carry."""

    def __init__(self, setting: Setting, continuous: Continuous) -> None:
        super().__init__(setting)
        self.continuous = continuous
        # Which sign R has is known at the end: that of the largest |R| at a point.
        self.worst = {1.0: Worst(), -1.0: Worst()}
        self.largest, self.digits, self.slope = 0.0, 0.0, 0.0
        self.found = {1.0: False, -1.0: False}  # whether a point has this sign for certain

    def update(self, run: Segments) -> None:
        """Bracket R and −R along the segments, as narrowly as the comparison with the resolution needs."""
        coefficients, alpha = self.setting.coefficients, run.alpha
        value = np.asarray(level_determinant(alpha, coefficients))
        peak = float(value[np.argmax(np.abs(value))])
        self.largest = peak if abs(peak) > abs(self.largest) else self.largest
        digits = np.asarray(level_determinant_resolution(alpha, coefficients))
        slope = level_determinant_slopes(alpha, coefficients).sum(axis=1)
        self.digits, self.slope = max(self.digits, float(digits.max())), max(self.slope, float(slope.max()))
        known = self.setting.angle_rounding
        rounding = np.maximum(self.continuous.roundings, self.setting.digits) if known is None else known
        carried = digits + slope * rounding + self._second_order(rounding)
        for sign in self.found:
            self.found[sign] |= bool((sign * value > carried).any())
        resolution = self.resolution()
        known_values = (self.worst[1.0].upper, self.worst[-1.0].upper)
        both = range_of_level_determinant(
            run.starts, run.ends, coefficients, known=known_values, at_ends=(value[:-1], value[1:])
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

    def resolution(self) -> float:
        """Return how large |R| must be for its sign to mean something anywhere on the segments so far."""
        known = self.setting.angle_rounding
        rounding = max(self.continuous.rounding, self.setting.digits) if known is None else known
        return float(self.digits + self.slope * rounding + self._second_order(rounding))

    def _second_order(self, rounding: Any) -> Any:
        coefficients = self.setting.coefficients
        derived = coefficients.sheet_rounding
        return 8 * float(np.linalg.norm(coefficients.bilinear_form)) * ((rounding + derived) ** 2 - derived**2)

    def checks(self) -> list[Check]:
        """Return the check `R_sign`."""
        sign = 1.0 if self.largest >= 0 else -1.0
        worst, resolution, kind = self.worst[sign], self.resolution(), self.setting.coefficients.kind
        ok, decided = True, True
        if self.continuous.blue and kind == "exact":
            ok = False
            message = "R = 0 on the whole blue sheet with exact coefficients, so it has no sign: use red"
        elif worst.lower > resolution:
            relation = f"R ≥ {worst.lower:.3g} > 0" if sign > 0 else f"R ≤ {-worst.lower:.3g} < 0"
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
        value = sign * worst.upper
        check = self.check("R_sign", "valid", ok, message, value=value, limit=resolution, place=worst.place)
        return [replace(check, decided=decided)]


class SingularValue(Rule):
    """The decoupling matrix of the exact physics is well invertible, level."""

    def __init__(self, setting: Setting, continuous: Continuous) -> None:
        super().__init__(setting)
        self.continuous = continuous
        self.worst = Worst()
        self.above = True

    def update(self, run: Segments) -> None:
        """Bracket the least singular value, and decide the comparison with the floor where the bracket does not."""
        vehicle, floor = self.setting.vehicle, self.setting.floor
        found = least_singular_value_of_all(run.starts, run.ends, vehicle, known=self.worst.upper)
        self.worst.update(found, run)
        close = found.lower < floor
        if self.above and close.any():
            self.above = self.worst.upper >= floor and bool(
                keeps_singular_value_above(run.starts[close], run.ends[close], floor, vehicle).all()
            )

    def checks(self) -> list[Check]:
        """Return the check `least_singular_value`."""
        upper, floor, place = self.worst.upper, self.setting.floor, self.worst.place
        message = f"least singular value {upper:.3f} (at least {max(self.worst.lower, 0.0):.3f}), floor {floor:g}"
        if not self.above:
            message = (
                f"the decoupling matrix is nearly singular: least singular value {upper:.2g}, floor {floor:g}, at "
                f"{self.described(place)}"
            )
            if self.continuous.blue:
                message += "; in exact physics the whole blue sheet is singular at every attitude: use red"
        name = "least_singular_value"
        return [self.check(name, "flyable", self.above, message, value=upper, limit=floor, place=place)]


class HoverThrust(Rule):
    """The thrusts that carry the weight without torque are positive, and within the vehicle's limit."""

    def __init__(self, setting: Setting, continuous: Continuous) -> None:
        super().__init__(setting)
        self.continuous = continuous
        self.least, self.largest = Worst(), Worst()
        self.broken: tuple[float | None, int, Place] | None = None

    def update(self, run: Segments) -> None:
        """Bracket the least and the largest thrust, up to the first segment where one is not positive."""
        if self.continuous.blue or self.continuous.fiber is not None or self.broken is not None:
            return
        vehicle, known = self.setting.vehicle, (self.least.upper, self.largest.upper)
        upward, least, largest = thrust_shares_along(run.starts, run.ends, vehicle, known=known)
        if upward.all():
            self.least.update(least, run)
            self.largest.update(largest, run)
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

    def checks(self) -> list[Check]:
        """Return the check `hover_thrust`, and `thrust_limit` if the vehicle states one."""
        name, noun = "hover_thrust", self.setting.noun
        if self.continuous.blue:
            # Floating point would give some ratio of two vanishing quantities.
            message = "no thrusts carry the weight without torque: on blue the control moment matrix has rank two"
            return [self.check(name, "flyable", False, message, limit=0.0)]
        if self.continuous.fiber is not None:
            code, number, place = self.continuous.fiber
            which, rotors = ("first", "2 and 4") if code == FIRST else ("second", "1 and 3")
            message = (
                f"{noun} {number} is on the {which} fibre, where rotors {rotors} idle in hover: rotors that push one "
                "way only cannot make a torque there; leave it for the red sheet, off its line"
            )
            return [self.check(name, "flyable", False, message, value=0.0, limit=0.0, place=place)]
        if self.broken is not None:
            value, number, place = self.broken
            vanishing = "" if value is not None else f", where they vanish on the way, at {self.described(place)}"
            message = (
                f"a rotor pair would have to idle or push down to hover on the segment after {noun} {number}"
                f"{vanishing}: stay where β1 and β2 have opposite signs (α1 < δ and α2 > −δ, or both the other way)"
            )
            return [self.check(name, "flyable", False, message, value=value, limit=0.0, place=place)]
        low, peak = self.least.upper, -self.largest.lower
        message = f"hover thrusts {low:.3f} to {peak:.3f} of m·g per rotor, all positive"
        checks = [self.check(name, "flyable", True, message, value=low, limit=0.0, place=self.least.place)]
        limit = self.setting.vehicle.max_thrust
        if limit is not None:
            mass, gravity = self.setting.vehicle.require("mass", "gravity", purpose="the check of the largest thrust")
            newtons, at = peak * mass * gravity, self.largest.place
            ok = newtons <= limit
            message = f"largest hover thrust {newtons:.3g} N, limit {limit:.3g} N"
            message += "" if ok else f", exceeded at {self.described(at)}: tilt less there"
            checks.append(self.check("thrust_limit", "flyable", ok, message, value=newtons, limit=limit, place=at))
        return checks


class TiltRange(Rule):
    """No arm tilts beyond the vehicle's limit; along a straight segment each angle is largest at an end."""

    def __init__(self, setting: Setting) -> None:
        super().__init__(setting)
        self.value, self.joint = -1.0, 0
        self.place: Place | None = None

    def update(self, run: Segments) -> None:
        """Find the largest tilt at the points."""
        size = np.abs(run.alpha)
        point, joint = divmod(int(np.argmax(size)), 4)
        if size[point, joint] > self.value:
            self.value, self.joint, self.place = float(size[point, joint]), joint + 1, run.place(point)

    def checks(self) -> list[Check]:
        """Return the check `tilt_range`, if the vehicle states a limit."""
        limit = self.setting.vehicle.max_tilt
        if limit is None:
            return []
        ok = self.value <= limit + _EXACT
        message = f"largest tilt {math.degrees(self.value):.1f}°, limit {math.degrees(limit):.1f}°"
        if not ok:
            message += f", exceeded by α{self.joint} at {self.described(self.place)}: move the waypoints nearer to 0"
        return [self.check("tilt_range", "flyable", ok, message, value=self.value, limit=limit, place=self.place)]
