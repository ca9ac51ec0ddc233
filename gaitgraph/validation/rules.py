"""The rules of valid and flyable. Each holds along the segments of a gait, by closed form or a bound.

A rule sees a gait as stretches; see :mod:`gaitgraph.validation.pieces`.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import distance_to_multiple, wrapped
from gaitgraph.invertibility.branch_and_bound import Least
from gaitgraph.invertibility.determinant_bounds import least_level_determinant, range_of_level_determinant
from gaitgraph.invertibility.matrices import (
    Coefficients,
    coefficients_of,
    hover_thrust_shares,
    level_determinant,
    level_determinant_resolution,
    level_determinant_slopes,
)
from gaitgraph.invertibility.residual_bounds import largest_residual
from gaitgraph.invertibility.singular_value_bounds import keeps_singular_value_above, least_singular_value_of_all
from gaitgraph.invertibility.thrust_bounds import thrust_shares_along, where_thrusts_vanish
from gaitgraph.surface.adjacency import neighbors_allowed, text_from_types
from gaitgraph.surface.components import HOVER_LABEL, red_label
from gaitgraph.surface.sheets import (
    FAMILIES,
    FIRST,
    family_distances,
    family_jumps,
    family_of,
    family_types,
    sheet_angles,
)
from gaitgraph.validation.pieces import Place, Rule, Setting, Stretch, Worst
from gaitgraph.validation.report import DEFAULT_TOLERANCE, Check

__all__ = [
    "Continuous",
    "HoverThrust",
    "LevelSign",
    "OnSurface",
    "Reach",
    "SingularValue",
    "TiltRange",
    "TwoColor",
    "jumps",
    "limit_check",
]

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]

_EXACT = 1e-9

# The column of :func:`gaitgraph.surface.sheets.family_distances` by the code of a family; codes count from the end too.
_COLUMN = np.array([0, 0, 2, 3, 1])


class OnSurface(Rule):
    """Rφ and Rθ vanish, to within the tolerance."""

    def __init__(self, setting: Setting) -> None:
        super().__init__(setting)
        self.worst = Worst()

    def see(self, stretch: Stretch) -> None:
        """Take in the next stretch."""
        tolerance = self.setting.tolerance / 100
        coefficients, known = self.setting.coefficients, self.worst.upper
        least = largest_residual(stretch.starts, stretch.ends, coefficients, tolerance=tolerance, known=known)
        self.worst.take(least, stretch)

    def checks(self) -> list[Check]:
        """Return the check `on_surface`."""
        value, limit = max(-self.worst.lower, 0.0), self.setting.tolerance
        message = f"max(|Rφ|, |Rθ|) = {value:.2g}, allowed {limit:g}"
        ok = value <= limit
        if not ok:
            message += (
                f", worst at {self.tell(self.worst.place)}: take (α3, α4) from the roots of (α1, α2), or allow more"
            )
        where = self.at(self.worst.place)
        return [Check(name="on_surface", kind="valid", ok=ok, value=value, limit=limit, where=where, message=message)]


class TwoColor(Rule):
    """Figure 15: neither α3 nor α4 steps from its + plane to its − plane."""

    def __init__(self, setting: Setting) -> None:
        super().__init__(setting)
        self.broken: Check | None = None
        self.seen: set[int] = set()

    def see(self, stretch: Stretch) -> None:
        """Take in the next stretch."""
        self.seen |= set(np.unique(stretch.sheet).tolist()) - {0}
        if self.broken is not None:
            return
        setting, alpha = self.setting, stretch.alpha
        third, fourth = family_types(alpha, stretch.sheet, setting.coefficients, setting.crossing_tolerance)
        lacking = stretch.sheet == 0
        forbidden = ~neighbors_allowed((third[:-1], fourth[:-1]), (third[1:], fourth[1:]))
        if lacking.any() and (not forbidden.any() or np.argmax(lacking) <= np.argmax(forbidden)):
            point = int(np.argmax(lacking))
            message = (
                f"{setting.noun} {stretch.number(point)} lies off the surfaces, on neither sheet, so it has no color "
                "to compare: take (α3, α4) from the roots of (α1, α2)"
            )
            self.broken = self._refused(stretch, point, message)
        elif forbidden.any():
            point = int(np.argmax(forbidden))
            here, there = (text_from_types(int(third[k]), int(fourth[k])) for k in (point, point + 1))
            message = (
                f"{setting.noun}s {stretch.number(point)} {here} and {stretch.number(point + 1)} {there} may not be "
                "neighbours (Figure 15): paint both in one color, or pass a (?,?) point between them"
            )
            self.broken = self._refused(stretch, point, message)

    def _refused(self, stretch: Stretch, point: int, message: str) -> Check:
        where = self.at(stretch.place(point))
        return Check(name="two_color", kind="valid", ok=False, value=1.0, limit=0.0, where=where, message=message)

    def checks(self) -> list[Check]:
        """Return the check `two_color`."""
        if self.broken is not None:
            return [self.broken]
        color = family_of(*self.seen) if len(self.seen) == 1 else "mixed"
        message = f"all neighbours allowed by Figure 15 ({color})"
        return [Check(name="two_color", kind="valid", ok=True, value=0.0, limit=0.0, message=message)]


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
        self.uncolored: Place | None = None
        self.distance, self.painted = 0.0, ""
        self.rounding = 0.0  # the largest distance that the tolerance takes for rounding
        self.roundings = np.zeros(0)  # the same for each point of the latest stretch
        self.blue = False  # whether a point lies on the blue sheet alone, however it is painted
        self.fiber: tuple[int, int, Place] | None = None  # the first point painted as one of a fibre, and which
        self.farthest: Place | None = None
        self.ratio, self.jump, self.limit, self.changes = -1.0, 0.0, 0.0, False
        self.place: Place | None = None

    def see(self, stretch: Stretch) -> None:
        """Take in the next stretch."""
        sheet, setting = stretch.sheet, self.setting
        bare = sheet == 0
        self.roundings = np.zeros(len(sheet))
        if bare.any():
            point = int(np.argmax(bare))
            self.uncolored = self.uncolored or stretch.place(point)
            if bare.all():
                return
        distances = family_distances(stretch.alpha, setting.coefficients)
        on_red, on_blue = distances[:, 0], distances[:, 1]
        fibered = sheet > 1
        self.blue |= bool(((on_blue <= setting.tolerance) & (on_red > setting.tolerance) & ~fibered).any())
        self._see_fibers(stretch, fibered)
        column = _COLUMN[sheet]
        off = np.where(bare, 0.0, np.take_along_axis(distances, column[:, None], axis=1)[:, 0])
        self.roundings = np.where((off > _EXACT) & (off <= setting.tolerance), off, 0.0)
        self.rounding = max(self.rounding, float(self.roundings.max()))
        farthest = int(np.argmax(off))
        if off[farthest] > max(self.distance, _EXACT):
            self.distance, self.farthest = float(off[farthest]), stretch.place(farthest)
            painted = int(column[farthest])
            self.painted = (
                f"{setting.noun} {stretch.number(farthest)} is painted {FAMILIES[painted]} but lies off that "
            )
            self.painted += "fibre" if fibered[farthest] else "sheet"
            others = [
                name for k, name in enumerate(FAMILIES) if k != painted and distances[farthest, k] <= setting.tolerance
            ]
            if others:
                self.painted += f", on the {others[0]} one"
        red, after = sheet[:-1] > 0, sheet[1:] > 0
        sizes = jumps(stretch.starts, stretch.ends, red, after, setting.coefficients)
        by_fiber = fibered[:-1] | fibered[1:]
        if by_fiber.any():
            sizes[by_fiber] = family_jumps(
                stretch.starts[by_fiber],
                stretch.ends[by_fiber],
                sheet[:-1][by_fiber],
                sheet[1:][by_fiber],
                setting.coefficients,
            )
            sizes[sizes <= _EXACT] = 0.0
        # Within one color, printed digits may move a segment off its sheet as far as the surface check allows; along a
        # fibre too, whose line with the red sheet is on both.
        limits = np.where((red == after) | by_fiber, setting.tolerance, _EXACT)
        ratios = sizes / np.maximum(limits, _EXACT)
        worst = int(np.argmax(ratios))
        if ratios[worst] > self.ratio:
            self.ratio, self.jump, self.limit = float(ratios[worst]), float(sizes[worst]), float(limits[worst])
            self.place, self.changes = stretch.place(worst), bool(sheet[worst] != sheet[worst + 1])

    def _see_fibers(self, stretch: Stretch, fibered: BoolArray) -> None:
        """Note the first point on a fibre."""
        if fibered.any() and self.fiber is None:
            point = int(np.argmax(fibered))
            self.fiber = (int(stretch.sheet[point]), stretch.number(point), stretch.place(point))

    def checks(self) -> list[Check]:
        """Return the check `continuous`."""
        noun, limit = self.setting.noun, self.limit
        value: float | None = self.jump
        place, ok, message = self.place, False, "every segment stays on its sheet"
        if self.uncolored is not None:
            place, limit, value = self.uncolored, self.setting.tolerance, None
            message = f"at {noun} {place.point + 1} it is off the surfaces and follows no sheet"
        elif self.distance > self.setting.tolerance and (
            not self.changes or self.jump <= max(self.limit, self.distance + _EXACT)
        ):
            place, limit, value = self.farthest, self.setting.tolerance, self.distance
            message = f"{self.painted}, by {value:.4f} rad: paint it as it lies, or take (α3, α4) from its sheet"
        elif self.jump > self.limit and place is not None:
            cause = "changes color" if self.changes else "wraps by π or leaves its sheet"
            message = (
                f"(α3, α4) jumps by {self.jump:.4f} rad after {noun} {place.point + 1}, where it {cause}: stay on one "
                "sheet"
            )
        else:
            ok = True
        where = self.at(place)
        return [Check(name="continuous", kind="valid", ok=ok, value=value, limit=limit, where=where, message=message)]


class LevelSign(Rule):
    """Proposition 1: R has one sign, judged against what the digits of coefficients and angles carry."""

    def __init__(self, setting: Setting, continuous: Continuous) -> None:
        super().__init__(setting)
        self.continuous = continuous
        # Which sign R has is known at the end: that of the largest |R| at a point.
        self.worst = {1.0: Worst(), -1.0: Worst()}
        self.largest = 0.0
        self.digits, self.slope = 0.0, 0.0
        self.found = {1.0: False, -1.0: False}  # whether a point has this sign for certain

    def see(self, stretch: Stretch) -> None:
        """Take in the next stretch."""
        coefficients, alpha = self.setting.coefficients, stretch.alpha
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
        positive, negative = self.worst.values()
        both = range_of_level_determinant(
            stretch.starts,
            stretch.ends,
            coefficients,
            known=(positive.upper, negative.upper),
            at_ends=(value[:-1], value[1:]),
        )
        for (sign, worst), found in zip(self.worst.items(), both, strict=True):
            straddles = found.lower.min() <= resolution < min(found.upper.min(), worst.upper)
            settled = _settled(found, stretch, coefficients, sign, resolution) if straddles else found
            worst.take(settled, stretch)

    def resolution(self) -> float:
        """Return how large |R| must be for its sign to mean something anywhere on what was seen."""
        rounding = self.setting.angle_rounding
        rounding = max(self.continuous.rounding, self.setting.digits) if rounding is None else rounding
        return float(self.digits + self.slope * rounding + self._second_order(rounding))

    def _second_order(self, rounding: Any) -> Any:
        coefficients = self.setting.coefficients
        derived = coefficients.sheet_rounding
        return 8 * float(np.linalg.norm(coefficients.bilinear_form)) * ((rounding + derived) ** 2 - derived**2)

    def checks(self) -> list[Check]:
        """Return the check `R_sign`."""
        sign = 1.0 if self.largest >= 0 else -1.0
        worst, resolution = self.worst[sign], self.resolution()
        lower, upper, place = worst.lower, worst.upper, worst.place
        kind = self.setting.coefficients.kind
        ok, decided = True, True
        if self.continuous.blue and kind == "exact":
            ok = False
            message = "R = 0 on the whole blue sheet with exact coefficients, so it has no sign: use red"
        elif lower > resolution:
            relation = f"R ≥ {lower:.3g} > 0" if sign > 0 else f"R ≤ {-lower:.3g} < 0"
            message = f"{relation} along the whole gait ({kind} coefficients)"
        elif upper < -resolution or all(self.found.values()):
            ok = False
            message = (
                f"R changes its sign at {self.tell(place)} ({kind} coefficients): keep the loop in one region of R"
            )
        else:
            decided = False
            message = (
                f"sign of R undecided: |R| falls to {abs(upper):.2g}, within the {resolution:.2g} that the {kind} "
                "coefficients and the digits of the angles carry; it is an artefact of rounding, not a margin"
            )
        return [
            Check(
                name="R_sign",
                kind="valid",
                ok=ok,
                value=sign * upper,
                limit=resolution,
                where=self.at(place),
                message=message,
                decided=decided,
            )
        ]


def _settled(found: Least, stretch: Stretch, coefficients: Coefficients, sign: float, resolution: float) -> Least:
    """Narrow the brackets of sign·R that straddle the resolution until the comparison with it is settled."""
    near = found.lower <= resolution
    floor = resolution * (1 + 1e-9)
    narrow = least_level_determinant(
        stretch.starts[near], stretch.ends[near], coefficients, sign=sign, tolerance=0.0, floor=floor, each=True
    )
    lower, upper, fraction = found.lower.copy(), found.upper.copy(), found.fraction.copy()
    lower[near], upper[near], fraction[near] = narrow.lower, narrow.upper, narrow.fraction
    return Least(lower=lower, upper=upper, fraction=fraction)


class SingularValue(Rule):
    """The decoupling matrix of the exact physics is well invertible, level."""

    def __init__(self, setting: Setting, continuous: Continuous) -> None:
        super().__init__(setting)
        self.continuous = continuous
        self.worst = Worst()
        self.above = True

    def see(self, stretch: Stretch) -> None:
        """Take in the next stretch."""
        vehicle, floor = self.setting.vehicle, self.setting.floor
        found = least_singular_value_of_all(stretch.starts, stretch.ends, vehicle, known=self.worst.upper)
        self.worst.take(found, stretch)
        close = found.lower < floor
        if self.above and close.any():
            starts, ends = stretch.starts[close], stretch.ends[close]
            hopeless = self.worst.upper < floor
            self.above = not hopeless and bool(keeps_singular_value_above(starts, ends, floor, vehicle).all())

    def checks(self) -> list[Check]:
        """Return the check `least_singular_value`."""
        upper, floor = self.worst.upper, self.setting.floor
        message = f"least singular value {upper:.3f} (at least {max(self.worst.lower, 0.0):.3f}), floor {floor:g}"
        if not self.above:
            message = (
                f"the decoupling matrix is nearly singular: least singular value {upper:.2g}, floor {floor:g}, at "
                f"{self.tell(self.worst.place)}"
            )
            if self.continuous.blue:
                message += "; in exact physics the whole blue sheet is singular at every attitude: use red"
        return [
            Check(
                name="least_singular_value",
                kind="flyable",
                ok=self.above,
                value=upper,
                limit=floor,
                where=self.at(self.worst.place),
                message=message,
            )
        ]


class HoverThrust(Rule):
    """The thrusts that carry the weight without torque are positive, and within the vehicle's limit."""

    def __init__(self, setting: Setting, continuous: Continuous) -> None:
        super().__init__(setting)
        self.continuous = continuous
        self.least, self.largest = Worst(), Worst()
        self.broken: tuple[float | None, int, Place] | None = None

    def see(self, stretch: Stretch) -> None:
        """Take in the next stretch."""
        if self.continuous.blue or self.continuous.fiber is not None or self.broken is not None:
            return
        vehicle, known = self.setting.vehicle, (self.least.upper, self.largest.upper)
        upward, least, largest = thrust_shares_along(stretch.starts, stretch.ends, vehicle, known=known)
        if upward.all():
            self.least.take(least, stretch)
            self.largest.take(largest, stretch)
            return
        segment = int(np.argmin(upward))
        shares = hover_thrust_shares(stretch.alpha[segment : segment + 2], vehicle)
        worst = int(np.argmin(np.nan_to_num(shares, nan=-np.inf).min(axis=1)))
        if shares[worst].min() > 0:
            # Both ends are fine: something vanishes between them.
            fraction = where_thrusts_vanish(stretch.starts[segment], stretch.ends[segment], vehicle)
            self.broken = (None, stretch.number(segment), stretch.place(segment, fraction))
            return
        self.broken = (float(shares[worst].min()), stretch.number(segment), stretch.place(segment + worst))

    def checks(self) -> list[Check]:
        """Return the check `hover_thrust`, and `thrust_limit` if the vehicle states one."""
        if self.continuous.blue:
            # Floating point would give some ratio of two vanishing quantities.
            message = "no thrusts carry the weight without torque: on blue the control moment matrix has rank two"
            return [Check(name="hover_thrust", kind="flyable", ok=False, limit=0.0, message=message)]
        if self.continuous.fiber is not None:
            return [self._idle(*self.continuous.fiber)]
        if self.broken is not None:
            value, number, place = self.broken
            passing = "" if value is not None else f", where they vanish on the way, at {self.tell(place)}"
            message = (
                "a rotor pair would have to idle or push down to hover on the segment after "
                f"{self.setting.noun} {number}{passing}: "
                "stay where β1 and β2 have opposite signs (α1 < δ and α2 > −δ, or both the other way)"
            )
            where = self.at(place)
            return [
                Check(
                    name="hover_thrust", kind="flyable", ok=False, value=value, limit=0.0, where=where, message=message
                )
            ]
        low, peak = self.least.upper, -self.largest.lower
        message = f"hover thrusts {low:.3f} to {peak:.3f} of m·g per rotor, all positive"
        where = self.at(self.least.place)
        checks = [
            Check(name="hover_thrust", kind="flyable", ok=True, value=low, limit=0.0, where=where, message=message)
        ]
        vehicle = self.setting.vehicle
        if vehicle.max_thrust is not None:
            mass, gravity = vehicle.require("mass", "gravity", purpose="the check of the largest thrust")
            newtons = peak * mass * gravity
            ok = newtons <= vehicle.max_thrust
            message = f"largest hover thrust {newtons:.3g} N, limit {vehicle.max_thrust:.3g} N"
            checks.append(
                Check(
                    name="thrust_limit",
                    kind="flyable",
                    ok=ok,
                    value=newtons,
                    limit=vehicle.max_thrust,
                    where=self.at(self.largest.place),
                    message=message + ("" if ok else f", exceeded at {self.tell(self.largest.place)}: tilt less there"),
                )
            )
        return checks

    def _idle(self, code: int, number: int, place: Place) -> Check:
        """Return the check of a gait with a point on a fibre."""
        which, rotors = ("first", "2 and 4") if code == FIRST else ("second", "1 and 3")
        message = (
            f"{self.setting.noun} {number} is on the {which} fibre, where rotors {rotors} idle in hover: "
            "rotors that push one way only have no room for a torque there; leave it for the red sheet, off its line"
        )
        where = self.at(place)
        return Check(name="hover_thrust", kind="flyable", ok=False, value=0.0, limit=0.0, where=where, message=message)


class TiltRange(Rule):
    """No arm tilts beyond the vehicle's limit; along a straight segment each angle is largest at an end."""

    def __init__(self, setting: Setting) -> None:
        super().__init__(setting)
        self.value, self.joint = -1.0, 0
        self.place: Place | None = None

    def see(self, stretch: Stretch) -> None:
        """Take in the next stretch."""
        size = np.abs(stretch.alpha)
        point, joint = divmod(int(np.argmax(size)), 4)
        if size[point, joint] > self.value:
            self.value, self.joint, self.place = float(size[point, joint]), joint + 1, stretch.place(point)

    def checks(self) -> list[Check]:
        """Return the check `tilt_range`, if the vehicle states a limit."""
        limit = self.setting.vehicle.max_tilt
        if limit is None:
            return []
        ok, where = self.value <= limit + _EXACT, self.at(self.place)
        message = f"largest tilt {math.degrees(self.value):.1f}°, limit {math.degrees(limit):.1f}°"
        if not ok:
            message += f", exceeded by α{self.joint} at {self.tell(self.place)}: move the waypoints nearer to 0"
        return [
            Check(name="tilt_range", kind="flyable", ok=ok, value=self.value, limit=limit, where=where, message=message)
        ]


class Reach:
    """Whether ordinary hover can enter the gait, and leave it, without a singular matrix."""

    def __init__(self, setting: Setting, continuous: Continuous) -> None:
        self.vehicle, self.continuous = setting.vehicle, continuous
        self.exact = coefficients_of(setting.vehicle, "exact")
        self.positive, self.home, self.opposite, self.off_red = True, True, 0.0, 0.0
        self.confined = True  # whether points of fibres are within ±π/2

    def see(self, stretch: Stretch) -> None:
        """Take in the next stretch."""
        if not self.positive:
            return
        alpha = stretch.alpha
        value = np.asarray(level_determinant(alpha, self.exact))
        resolution = float(np.max(level_determinant_resolution(alpha, self.exact)))
        ends = (value[:-1], value[1:])
        least = least_level_determinant(
            stretch.starts,
            stretch.ends,
            self.exact,
            tolerance=0.0,
            floor=resolution * (1 + 1e-9),
            each=True,
            at_ends=ends,
        )
        self.positive = bool(least.lower.min() > resolution) and not self.continuous.blue
        fibered = stretch.sheet > 1
        if fibered.any():
            self.confined &= bool((np.abs(alpha[fibered]) <= math.pi / 2 + _EXACT).all())
            alpha = alpha[~fibered]
            if not len(alpha):
                return
        self.home &= bool((red_label(alpha[:, 0], alpha[:, 1], self.vehicle) == HOVER_LABEL).all())
        opposite = np.abs(alpha[:, 2:] - alpha[:, :2])
        self.opposite = max(self.opposite, float(opposite.max()))
        self.off_red = max(self.off_red, float(distance_to_multiple(opposite, math.pi).max()))

    def answer(self) -> tuple[bool | None, str]:
        """Return yes, no or unknown, and a sentence."""
        limit = 2 * self.vehicle.signed_drag_ratio
        home = f"the component of α = 0 (tan α1 − tan α2 {'<' if limit > 0 else '>'} {limit:.4f})"
        if not self.positive:
            return False, (
                "it cannot be entered from ordinary hover (R = +4 at α = 0) without a singular matrix: plan with R > 0 "
                f"in {home}, or start the flight in the gait"
            )
        if self.off_red <= DEFAULT_TOLERANCE:
            # An opposite arm shifted by π is on red too, but not on the part of it that hover is on.
            if self.home and self.opposite <= DEFAULT_TOLERANCE:
                if self.continuous.fiber is None:
                    return True, "in the component of α = 0, which ordinary hover can enter and leave"
                if self.confined:
                    return (
                        True,
                        "on a fibre that meets the component of α = 0, which ordinary hover can enter and leave",
                    )
                return None, "on a fibre, beyond ±π/2, with R > 0: whether hover can reach it is not decided here"
            return False, f"on the surface ordinary hover cannot reach this component of R > 0: plan in {home}"
        return None, "off the red sheet with R > 0: whether hover can reach it is not decided here"


def limit_check(
    name: str, unit: str, peak: float, joint: int, limit: float | None, where: dict[str, Any] | None, advice: str
) -> Check:
    """Return the check of a peak of one tilt angle's derivative against what the vehicle states."""
    message, ok = f"peak {peak:.3g} {unit} (α{joint})", limit is None or peak <= limit * (1 + 1e-12)
    if limit is None:
        message += "; the vehicle states no limit"
    elif math.isinf(peak):
        message = f"{advice} (limit {limit:.3g} {unit})"
    else:
        message += f", limit {limit:.3g}" + ("" if ok else f": {advice}")
    return Check(name=name, kind="flyable", ok=ok, value=peak, limit=limit, where=where, message=message)
