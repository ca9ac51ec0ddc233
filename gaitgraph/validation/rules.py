"""What rules share, and those of the paper's tables: on the surface, two-color, continuous.

Each rule holds along the segments of a gait, a closed polyline, by closed form or a bound. Rules examine consecutive
segments: all rows of a table, then the one that closes it. A smooth curve is checked by its chords: each bound is reduced
by the largest effect of the distance between them.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import angle_within, checked_number
from gaitgraph.invertibility.coefficients import is_red
from gaitgraph.invertibility.matrices import singular_value_rate
from gaitgraph.invertibility.segment_bounds import largest_residual
from gaitgraph.surface.sheets import (
    DEFAULT_CROSSING_TOLERANCE,
    FAMILIES,
    FAMILY_COLUMN,
    family_codes,
    family_distances,
    family_jumps,
    family_of,
    family_types,
    neighbors_allowed,
    text_from_types,
)
from gaitgraph.validation.report import Check, GaitPoint
from gaitgraph.validation.wrong_rows import Convention, LoneRows, Misreading

if TYPE_CHECKING:
    from collections.abc import Iterator

    from gaitgraph.gait.gait import Gait
    from gaitgraph.invertibility.coefficients import Coefficients
    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.invertibility.matrices import IntArray
    from gaitgraph.vehicle import Vehicle

EXACT = 1e-9
_TAKE_ROOTS = "take (α3, α4) from the roots of (α1, α2)"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Criteria:
    """Vehicle, coefficients and limits of the checks; see :func:`gaitgraph.validation.validating.check_gait`."""

    vehicle: Vehicle
    coefficients: Coefficients
    tolerance: float
    floor: float
    angle_rounding: float | None = (
        None  # None: the distance of each point from its sheet [rad]
    )
    crossing_tolerance: float = DEFAULT_CROSSING_TOLERANCE
    noun: str = (
        "corner"  # what messages call a point: "corner", "row", or "chord" of a curve
    )
    beside: float = 0.0  # how far a curve may be from the segments, its chords, in the (α1, α2) plane [rad]
    extremes: FloatArray | None = (
        None  # the least and the largest tilt angles of the curve, shape (2, 4) [rad]
    )
    passing: float = 0.0  # by how much the ranges of tilt may be passed [rad], and by what share floor and thrust limit

    def __post_init__(self) -> None:
        for name in ("tolerance", "floor", "crossing_tolerance"):
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
        size = float(coefficients.form.size()[2])
        return size * math.sqrt(8.0) * self.beside


@dataclass(frozen=True, kw_only=True, eq=False)
class Segments:
    """Consecutive straight segments of a gait."""

    alpha: (
        FloatArray  # the points, shape (m + 1, 4) [rad]; a single point has no segment
    )
    # The color of each point, shape (m + 1,): +1 red, −1 blue, 2 the first fibre, 3 the second, 0 none.
    sheet: npt.NDArray[np.int8]
    number: IntArray  # number of each point in the gait, from 1; 1 again at the end of the closing segment
    t: FloatArray | None = None  # times, shape (m + 1,) [s]
    first_t: float | None = None  # time of point 1; the closing segment ends later [s]
    # Share of the way to the next number that a point has passed, shape (m + 1,); None if each point has its own number.
    within: FloatArray | None = None

    def __getitem__(self, part: slice) -> Segments:
        """Return consecutive points, as a slice of step 1."""
        t, first = None if self.t is None else self.t[part], self.first_t
        within = None if self.within is None else self.within[part]
        return Segments(
            alpha=self.alpha[part],
            sheet=self.sheet[part],
            number=self.number[part],
            t=t,
            first_t=first,
            within=within,
        )

    def joined(self, following: Segments) -> Segments:
        """Return these points followed by others."""
        return Segments(
            alpha=np.concatenate([self.alpha, following.alpha]),
            sheet=np.concatenate([self.sheet, following.sheet]),
            number=np.concatenate([self.number, following.number]),
            t=None
            if self.t is None or following.t is None
            else np.concatenate([self.t, following.t]),
        )

    @property
    def starts(self) -> FloatArray:
        """The start of each segment, shape (m, 4) [rad]."""
        return self.alpha[:-1]

    @property
    def ends(self) -> FloatArray:
        """The end of each segment, shape (m, 4) [rad]."""
        return self.alpha[1:]

    @cached_property
    def on_red(self) -> bool:
        """Whether all points lie exactly on the red sheet, as those of a lifted loop do."""
        return bool(is_red(self.alpha.T).all())

    @cached_property
    def color(self) -> int:
        """The sheet, +1 or −1, if all points have the same, else 0."""
        first = int(self.sheet[0])
        return first if abs(first) == 1 and bool((self.sheet == first).all()) else 0

    def place(self, segment: int, fraction: float = 0.0) -> GaitPoint:
        """Return the place at a fraction of a segment, counted from 0 within these."""
        index, fraction = (
            (segment + 1, 0.0) if fraction == 1.0 else (segment, float(fraction))
        )
        at, t = self.alpha[index], None if self.t is None else float(self.t[index])
        closes = index > 0 and self.number[index] <= self.number[index - 1]
        if t is not None and closes and self.within is None:
            t = self.first_t
        if fraction:
            at = at + fraction * (self.alpha[index + 1] - at)
            t = (
                None
                if self.t is None
                else float(t + fraction * (self.t[index + 1] - t))
            )
        if self.within is not None:
            passed = float(self.within[index])
            following = float(self.within[index + 1]) if fraction else passed
            fraction = passed + fraction * ((following or 1.0) - passed)
        return GaitPoint(
            point=int(self.number[index]) - 1,
            fraction=fraction,
            alpha=tuple(at.tolist()),
            t=t,
        )


def segments_of(gait: Gait) -> Segments:
    """Return all segments of a gait, from the last corner back to the first too."""
    sheet = (
        family_codes(gait.colors)
        if gait.colors
        else np.zeros(len(gait.alpha), dtype=np.int8)
    )
    point = np.arange(len(gait.alpha) + 1) % len(gait.alpha)
    return Segments(alpha=gait.alpha[point], sheet=sheet[point], number=point + 1)


@dataclass
class Worst:
    """The bracket of the least value over all segments so far, and the place where its upper end is attained."""

    lower: float = math.inf
    upper: float = math.inf
    place: GaitPoint | None = None

    def update(self, worst: tuple[float, float, int, float], block: Segments) -> None:
        """Include the least value along further segments, as ``Least.worst`` returns it."""
        lower, upper, segment, fraction = worst
        self.lower = min(self.lower, lower)
        if upper < self.upper or self.place is None:
            self.upper, self.place = upper, block.place(segment, fraction)


@dataclass
class Peak:
    """The largest absolute angle or derivative, for its joint's `scale`, its joint (1 to 4) and place."""

    scale: FloatArray | float = 1.0
    share: float = 0.0
    value: float = 0.0
    joint: int = 1
    place: GaitPoint | None = None

    def update(self, values: FloatArray, block: Segments) -> None:
        """Examine values of shape (k, 4) that belong to the first k points."""
        size = np.abs(values) / self.scale
        k, joint = divmod(int(np.argmax(size)), 4)
        if size[k, joint] > self.share or self.place is None:
            self.share, self.joint, self.place = (
                float(size[k, joint]),
                joint + 1,
                block.place(k),
            )
            self.value = float(abs(values[k, joint]))


@dataclass
class Rule(ABC):
    """Base of the rules: they take blocks of segments in order, and yield their checks at the end.

    Rules of flyable also read the rule `continuous`, which knows the sheets of
    the points.
    """

    criteria: Criteria
    name: ClassVar[str]
    kind: ClassVar[Literal["valid", "flyable"]] = "valid"

    @abstractmethod
    def update(self, block: Segments) -> None:
        """Examine the next segments."""

    @abstractmethod
    def checks(self) -> Iterator[Check]:
        """Yield what was found, after at least one update."""

    def check(
        self,
        ok: bool,
        message: str,
        *,
        place: GaitPoint | None = None,
        name: str = "",
        **values: Any,
    ) -> Check:
        """Return the check of this rule, or of another name, with its place as plain values."""
        where = None if place is None else place.as_mapping(self.criteria.noun)
        return Check(
            name=name or self.name,
            kind=self.kind,
            ok=ok,
            message=message,
            where=where,
            **values,
        )

    def described(self, place: GaitPoint | None) -> str:
        """Return a place in words."""
        return "" if place is None else place.described(self.criteria.noun)

    def compared(
        self, ok: bool, found: str, limit: str, place: GaitPoint | None, advice: str
    ) -> str:
        """Return what was found and its limit in words; if it is not ok, the place and the advice too."""
        return (
            f"{found}, limit {limit}"
            if ok
            else f"{found} at {self.described(place)}, limit {limit}: {advice}"
        )


@dataclass
class OnSurface(Rule):
    """Rφ and Rθ vanish, to within the tolerance."""

    name = "on_surface"
    lone: LoneRows
    worst: Worst = field(default_factory=Worst)
    bare: int | None = None  # the number of the first point that is on no sheet
    misreading: Misreading = field(init=False)

    def __post_init__(self) -> None:
        criteria = self.criteria
        self.misreading = Misreading(criteria.coefficients, criteria.tolerance)

    def update(self, block: Segments) -> None:
        """Bracket the largest residual."""
        if self.criteria.noun == "row":  # of tables that people bring
            self.misreading.update(block.alpha)
        bare = block.number[block.sheet == 0]
        if self.bare is None and len(bare):
            self.bare = int(bare[0])
        if block.on_red:  # both products of sines vanish
            self.worst.update((0.0, 0.0, 0, 0.0), block)
            return
        criteria = self.criteria
        found = largest_residual(
            block.starts,
            block.ends,
            criteria.coefficients,
            tolerance=criteria.tolerance / 100,
        )
        self.worst.update(found.worst(), block)

    def checks(self) -> Iterator[Check]:
        """Yield the check `on_surface`."""
        limit, place = self.criteria.tolerance, self.worst.place
        value = self.value
        ok = value <= limit
        advice = "" if ok else self._advice(place)
        message = self.compared(
            ok, f"max(|Rφ|, |Rθ|) = {value:.2g}", f"{limit:g}", place, advice
        )
        yield self.check(ok, message, value=value, limit=limit, place=place)

    @property
    def value(self) -> float:
        """The largest residual."""
        return max(0.0, -self.worst.lower)

    @property
    def convention(self) -> Convention | None:
        """The convention that would put all points on one sheet, if they are on none."""
        if self.value <= self.criteria.tolerance:
            return None
        return self.misreading.convention

    @property
    def is_broken_by_lone_row(self) -> bool:
        """Whether the points are off the surfaces, and farthest at a row far from its neighbours."""
        place = self.worst.place
        if place is None or self.value <= self.criteria.tolerance:
            return False
        return self.lone.is_near(place.point + 1)

    @property
    def is_between_points(self) -> bool:
        """Whether the largest residual is between two points."""
        return self.worst.place is not None and self.worst.place.fraction > 0

    def _advice(self, place: GaitPoint | None) -> str:
        """Return what would help."""
        misread = self.misreading.advice()
        if misread:
            return misread
        if self.is_broken_by_lone_row:
            return self.lone.note
        coefficients = self.criteria.coefficients
        if (
            coefficients.is_raised
            and place
            and family_distances(place.alpha, coefficients)[1]
            <= self.criteria.tolerance
        ):
            height = f"rotors at a height of {self.criteria.vehicle.heights_in_words}"
            return (
                f"use red, since on blue the zero-moment direction leans for {height}"
            )
        advice = f"{_TAKE_ROOTS}, or raise the tolerance"
        if self.bare is None or (place and place.number == self.bare):
            return advice
        return f"{self.criteria.noun} {self.bare} lies on neither sheet: {advice}"


@dataclass
class TwoColor(Rule):
    """Figure 15: neither α3 nor α4 steps from its + plane to its − plane."""

    name = "two_color"
    broken: tuple[str, GaitPoint] | None = None
    is_bare: bool = False  # whether it is broken by a point that is on no sheet
    families: set[int] = field(default_factory=set)

    def update(self, block: Segments) -> None:
        """Find the first pair of points that may not be neighbours."""
        codes = [block.color] if block.color else family_codes(FAMILIES).tolist()
        self.families |= {
            code for code in codes if block.color or (block.sheet == code).any()
        }
        if (
            self.broken is not None or block.color
        ):  # on one sheet no two types are + and −
            return
        criteria = self.criteria
        third, fourth = family_types(
            block.alpha, block.sheet, criteria.coefficients, criteria.crossing_tolerance
        )
        bare = block.sheet == 0
        forbidden = ~neighbors_allowed(
            (third[:-1], fourth[:-1]), (third[1:], fourth[1:])
        )
        if bare.any() and (
            not forbidden.any() or np.argmax(bare) <= np.argmax(forbidden)
        ):
            point = int(np.argmax(bare))
            message = f"{self.described(block.place(point))} lies on neither sheet and has no color: {_TAKE_ROOTS}"
            self.is_bare = True
        elif forbidden.any():
            point = int(np.argmax(forbidden))
            here, there = (
                text_from_types(int(third[k]), int(fourth[k]))
                for k in (point, point + 1)
            )
            message = (
                f"{criteria.noun}s {block.number[point]} {here} and {block.number[point + 1]} {there} may not be "
                "neighbours (Figure 15): give both one color, or pass a (?,?) point between them"
            )
        else:
            return
        self.broken = (message, block.place(point))

    def checks(self) -> Iterator[Check]:
        """Yield the check `two_color`."""
        color = family_of(*self.families) if len(self.families) == 1 else "mixed"
        message, place = self.broken or (
            f"all neighbours allowed by Figure 15 of the paper ({color})",
            None,
        )
        ok = self.broken is None
        yield self.check(ok, message, value=float(not ok), limit=0.0, place=place)


@dataclass
class Continuous(Rule):
    """Every point lies on the sheet of its color, and every segment stays there. Other rules read the results."""

    name = "continuous"
    bare: GaitPoint | None = None  # the first point off the surfaces
    inferred_error: float = (
        0.0  # the largest distance from a sheet within the tolerance
    )
    inferred_errors: FloatArray = field(
        default_factory=lambda: np.zeros(0)
    )  # of each point of the latest block
    blue: bool = False  # whether a point is on blue alone, whatever its color, and the matrix singular: no rotor height
    fiber: tuple[int, GaitPoint] | None = (
        None  # the first point colored as a fibre: which, and its place
    )
    distance: float = 0.0  # the point that is farthest off the sheet of its color
    off_sheet: str = ""
    is_off_all: bool = False  # whether that point is on no other sheet either
    farthest: GaitPoint | None = None
    ratio: float = -1.0  # the largest jump divided by its limit
    jump: float = 0.0
    limit: float = 0.0
    changes: bool = False  # of color
    place: GaitPoint | None = None

    def update(self, block: Segments) -> None:
        """Compare points with the sheets of their colors, and segments with the sheets of their ends."""
        sheet, criteria = block.sheet, self.criteria
        self.inferred_errors = np.zeros(len(sheet))
        if block.on_red and block.color > 0:
            if self.ratio < 0:
                self.ratio, self.jump, self.limit, self.place = (
                    0.0,
                    0.0,
                    criteria.tolerance,
                    block.place(0),
                )
            return
        bare, fibered = sheet == 0, sheet > 1
        if bare.any():
            self.bare = self.bare or block.place(int(np.argmax(bare)))
            if bare.all():
                return
        if fibered.any() and self.fiber is None:
            point = int(np.argmax(fibered))
            self.fiber = (int(sheet[point]), block.place(point))
        distances = family_distances(block.alpha, criteria.coefficients)
        on_blue = (distances[:, 1] <= criteria.tolerance) & (
            distances[:, 0] > criteria.tolerance
        )
        self.blue |= (
            bool((on_blue & ~fibered).any()) and not criteria.coefficients.is_raised
        )
        # How far points are from the sheet or fibre of their color.
        column = FAMILY_COLUMN[sheet]
        off = np.where(
            bare, 0.0, np.take_along_axis(distances, column[:, None], axis=1)[:, 0]
        )
        self.inferred_errors = np.where(
            (off > EXACT) & (off <= criteria.tolerance), off, 0.0
        )
        self.inferred_error = max(
            self.inferred_error, float(self.inferred_errors.max())
        )
        farthest = int(np.argmax(off))
        if off[farthest] > max(self.distance, EXACT):
            self.distance, self.farthest = float(off[farthest]), block.place(farthest)
            color = FAMILIES[column[farthest]]
            self.off_sheet = f"is colored {color} but lies off that {'fibre' if fibered[farthest] else 'sheet'}"
            near = distances[farthest] <= criteria.tolerance
            others = [
                name
                for name, is_near in zip(FAMILIES, near, strict=True)
                if is_near and name != color
            ]
            self.is_off_all = not others
            if others:
                self.off_sheet += f", on the {others[0]} one"
        # How far segments leave the sheets of their ends.
        sizes = family_jumps(
            block.starts, block.ends, sheet[:-1], sheet[1:], criteria.coefficients
        )
        # Within one color, and along a fibre, whose line with the red sheet is on both, printed digits may move a
        # segment off its sheet by the tolerance.
        along = (sheet[:-1] == sheet[1:]) | fibered[:-1] | fibered[1:]
        limits = np.where(along, criteria.tolerance, EXACT)
        ratios = sizes / np.maximum(limits, EXACT)
        worst = int(np.argmax(ratios))
        if ratios[worst] > self.ratio:
            self.ratio, self.jump, self.limit = (
                float(ratios[worst]),
                float(sizes[worst]),
                float(limits[worst]),
            )
            self.place, self.changes = (
                block.place(worst),
                bool(sheet[worst] != sheet[worst + 1]),
            )

    @property
    def is_off_sheet(self) -> bool:
        """Whether a point is off the sheet of its color, and not by a jump alone."""
        jumps = self.changes and self.jump > max(self.limit, self.distance + EXACT)
        return self.distance > self.criteria.tolerance and not jumps

    @property
    def is_off_sheets(self) -> bool:
        """Whether a point is on no sheet, and breaks the rule by that."""
        return self.bare is not None or (self.is_off_sheet and self.is_off_all)

    def checks(self) -> Iterator[Check]:
        """Yield the check `continuous`."""
        tolerance = self.criteria.tolerance
        if self.bare is not None:
            message = (
                f"{self.described(self.bare)} lies on neither sheet: {_TAKE_ROOTS}"
            )
            yield self.check(False, message, limit=tolerance, place=self.bare)
        elif self.is_off_sheet:
            off = f"{self.off_sheet}, by {self.distance:.4f} rad (limit {tolerance:g})"
            advice = "give it the color of its sheet, or take (α3, α4) from the sheet of its color"
            message = f"{self.described(self.farthest)} {off}: {advice}"
            yield self.check(
                False,
                message,
                value=self.distance,
                limit=tolerance,
                place=self.farthest,
            )
        else:
            ok, message = self.jump <= self.limit, "every segment stays on its sheet"
            if not ok:
                cause = (
                    "changes color"
                    if self.changes
                    else "wraps by π or leaves its sheet"
                )
                jump = f"jumps by {self.jump:.4f} rad (limit {self.limit:g}) after {self.described(self.place)}"
                message = f"(α3, α4) {jump}, where it {cause}: stay on one sheet"
            yield self.check(
                ok, message, value=self.jump, limit=self.limit, place=self.place
            )
