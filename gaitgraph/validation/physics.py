"""The rules of physics (sign of R, invertibility, hover thrusts, tilts), reachability from hover, and all rules."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from gaitgraph.angles import distance_to_multiple, figure, figures_apart
from gaitgraph.invertibility.coefficients import coefficients_of, is_red
from gaitgraph.invertibility.forms import Form, Sines
from gaitgraph.invertibility.matrices import (
    hover_power,
    hover_thrust_shares,
    level_determinant,
    level_determinant_resolution,
    level_of_vehicle,
    mean_hover_powers,
)
from gaitgraph.invertibility.segment_bounds import (
    Least,
    LevelSign,
    Quantity,
    keeps_singular_value_above,
    least_level_determinant,
    least_of_each,
    share_quantity,
    singular_quantity,
    thrusts_push_up,
    where_thrusts_vanish,
)
from gaitgraph.surface.blocks import yaw_block
from gaitgraph.surface.sheets import (
    DEFAULT_TOLERANCE,
    FIRST,
    HOVER_LABEL,
    home_in_words,
    red_label,
)
from gaitgraph.validation.report import (
    LIMITED,
    RATE_CHECKS,
    Report,
    following,
    hover_thrust_text,
)
from gaitgraph.validation.rules import (
    EXACT,
    Continuous,
    Criteria,
    OnSurface,
    Peak,
    Rule,
    Segments,
    TwoColor,
    Worst,
)
from gaitgraph.validation.wrong_rows import LoneRows

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.invertibility.matrices import BoolArray
    from gaitgraph.validation.report import Check, GaitPoint
    from gaitgraph.vehicle import Vehicle

_SHORT = 2e-3  # rad, of a segment whose mean power is taken as that of its ends
_STRONG = 0.5  # of m·g, the thrust of a rotor at a thrust-to-weight ratio of 2


@dataclass
class _Brackets(Rule):
    """The brackets of R, of the least singular value and of the hover thrusts along the latest block, for other rules.

    They are found in one search.
    """

    continuous: Continuous
    value: FloatArray = field(init=False)  # R at the points
    of_one_sign: bool = False  # whether the latest block is a whole gait, and R has one sign at its points
    largest: float = (
        0.0  # R at the point where |R| is largest so far, of whose sign a gait is
    )
    level: dict[float, Least] = field(
        init=False
    )  # of R and of −R; of a whole gait only of that with its sign
    singular: Least = field(init=False)
    hovers: bool = True  # whether all thrusts are positive so far
    upward: BoolArray = field(init=False)
    shares: tuple[
        Least, ...
    ] = ()  # of the least share of the weight and of minus the largest, where all are positive

    def update(self, block: Segments) -> None:
        """Bracket all quantities that the rules compare with their limits."""
        criteria, vehicle, starts, ends = (
            self.criteria,
            self.criteria.vehicle,
            block.starts,
            block.ends,
        )
        self.value = level_determinant(block.alpha, criteria.coefficients)
        low, high = float(self.value.min()), float(self.value.max())
        self.largest = max(self.largest, low, high, key=abs)
        # Of a whole gait no check states how large |R| becomes.
        whole = bool(block.number[0] == block.number[-1])
        self.of_one_sign = whole and not low < 0 < high
        signs: tuple[float, ...] = (1.0, -1.0)
        if whole:
            signs = (1.0,) if self.largest >= 0 else (-1.0,)
        quantities: list[Quantity] = [
            LevelSign(criteria.coefficients, signs),
            singular_quantity(vehicle),
        ]
        tolerances = [1e-6, criteria.bracket]
        if self.continuous.blue or self.continuous.fiber is not None:
            self.hovers = False
        if self.hovers:
            self.upward = thrusts_push_up(starts, ends, vehicle)
            self.hovers = bool(self.upward.all())
        if self.hovers:
            quantities.append(share_quantity(vehicle))
            tolerances.append(criteria.bracket)
        found = least_of_each(starts, ends, quantities, tolerances)
        self.level = dict(zip(signs, found, strict=False))
        self.singular, *shares = found[len(signs) :]
        self.shares = tuple(shares)

    def checks(self) -> Iterator[Check]:
        """Yield no check."""
        return iter(())


@dataclass
class _LevelSign(Rule):
    """Proposition 1: R has one sign, beyond the error that the digits of coefficients and angles leave."""

    name = "R_sign"
    continuous: Continuous
    brackets: _Brackets
    # The sign of R is that of the largest |R| at a point, known at the end.
    worst: dict[float, Worst] = field(
        default_factory=lambda: {1.0: Worst(), -1.0: Worst()}
    )
    found: dict[float, bool] = field(
        default_factory=lambda: {1.0: False, -1.0: False}
    )  # for certain, at a point
    digits: float = 0.0
    slope: float = 0.0

    def update(self, block: Segments) -> None:
        """Bracket R and −R along the segments, as narrowly as the comparison with the resolution needs."""
        coefficients, inferred = (
            self.criteria.coefficients,
            self.continuous.inferred_errors,
        )
        sines = Sines.of(block.alpha)
        slope = np.abs(coefficients.level_form.slopes(sines)[:, 0]).sum(axis=0)
        digits = coefficients.errors(sines)[2]
        self.digits, self.slope = (
            max(self.digits, float(digits.max())),
            max(self.slope, float(slope.max())),
        )
        if not self.brackets.of_one_sign:
            carried = self._carried(digits, slope, inferred)
            for sign in self.found:
                self.found[sign] |= bool((sign * self.brackets.value > carried).any())
        resolution = self._resolution()
        for sign, found in self.brackets.level.items():
            least, worst = found.worst(), self.worst[sign]
            if least[0] <= resolution < min(least[1], worst.upper):
                # Narrow the brackets that straddle the resolution until the comparison with it is settled.
                near, floor = (
                    found.lower <= resolution,
                    float(np.nextafter(resolution, math.inf)),
                )
                narrow = least_level_determinant(
                    block.starts[near],
                    block.ends[near],
                    coefficients,
                    sign=sign,
                    tolerance=0.0,
                    floor=floor,
                    each=True,
                )
                lower, upper, fraction = (
                    found.lower.copy(),
                    found.upper.copy(),
                    found.fraction.copy(),
                )
                lower[near], upper[near], fraction[near] = (
                    narrow.lower,
                    narrow.upper,
                    narrow.fraction,
                )
                least = Least(lower=lower, upper=upper, fraction=fraction).worst()
            worst.update(least, block)

    def _carried(self, digits: Any, slope: Any, inferred: Any) -> Any:
        """Return the error of R, to second order in the rounding of angles; |R| must exceed it to have a sign."""
        coefficients, known = self.criteria.coefficients, self.criteria.angle_rounding
        rounding = inferred if known is None else known
        derived = coefficients.sheet_error
        size = float(coefficients.form.size()[2])
        second = 8 * size * ((rounding + derived) ** 2 - derived**2)
        return digits + slope * rounding + second

    def _resolution(self) -> float:
        rounding = self.continuous.inferred_error
        return float(self._carried(self.digits, self.slope, rounding))

    def _assumed(self) -> str:
        known = self.criteria.angle_rounding
        error = self.continuous.inferred_error if known is None else known
        return f"angles to {error:.2g} rad" if error else "angles exact"

    def checks(self) -> Iterator[Check]:
        sign = 1.0 if self.brackets.largest >= 0 else -1.0
        worst, resolution, kind = (
            self.worst[sign],
            self._resolution(),
            self.criteria.coefficients.kind,
        )
        lower = worst.lower - self.criteria.level_slack(self.criteria.coefficients)
        ok, decided, undecided = True, True, "sign of R undecided: |R|"
        if self.continuous.blue and kind == "exact":
            ok = False
            message = "R = 0 on the whole blue sheet with exact coefficients, so it has no sign: use red"
        elif lower > resolution:
            relation = f"R ≥ {lower:.3g} > 0" if sign > 0 else f"R ≤ {-lower:.3g} < 0"
            message = f"{relation} along the whole gait ({kind} coefficients, {self._assumed()})"
        elif worst.upper < -resolution or all(self.found.values()):
            ok = False
            message = f"R changes its sign at {self.described(worst.place)} ({kind} coefficients)"
            message += ": keep the loop in one region of R"
        elif worst.lower > resolution:
            decided, least = False, max(lower, 0.0)
            message = f"{undecided} may fall to {least:.2g} along the curve, error {resolution:.2g}: use shorter chords"
        else:
            decided = False
            error = f"below the error {resolution:.2g} of the {kind} coefficients ({self._assumed()})"
            advice = (
                "use red"
                if self.continuous.blue
                else "keep away from R = 0, or use more digits"
            )
            message = f"{undecided} falls to {abs(worst.upper):.2g} at {self.described(worst.place)}, {error}: {advice}"
        value = sign * (lower if self.criteria.beside else worst.upper)
        yield self.check(
            ok,
            message,
            value=value,
            limit=resolution,
            place=worst.place,
            decided=decided,
        )


@dataclass
class _SingularValue(Rule):
    """The decoupling matrix of the exact physics is well invertible, level."""

    name = "least_singular_value"
    kind = "flyable"
    continuous: Continuous
    brackets: _Brackets
    worst: Worst = field(default_factory=Worst)
    above: bool = True

    def update(self, block: Segments) -> None:
        """Bracket the least singular value, and decide the comparison with the floor where the bracket does not."""
        criteria = self.criteria
        floor = criteria.floor * (1 - criteria.passing) + criteria.singular_value_slack
        found = self.brackets.singular
        self.worst.update(found.worst(), block)
        close = found.lower < floor
        if self.above and close.any():
            self.above = self.worst.upper >= floor and bool(
                keeps_singular_value_above(
                    block.starts[close], block.ends[close], floor, criteria.vehicle
                ).all()
            )

    def checks(self) -> Iterator[Check]:
        criteria, place = self.criteria, self.worst.place
        floor, lower = criteria.floor, self.worst.lower - criteria.singular_value_slack
        value = lower if criteria.beside else self.worst.upper
        # Rounded down, as a bound must be.
        proven = max(math.floor(1e4 * lower) / 1e4, floor * (1 - criteria.passing))
        message = f"least singular value {figure(value)} (proven lower bound {proven:.4f}, floor {floor:g})"
        if not self.above:
            advice = "move the loop away from R = 0, or lower the floor"
            if self.continuous.blue:
                advice = "use red, since the whole blue sheet is singular at every attitude in exact physics"
            message = f"least singular value {value:.3g} at {self.described(place)}, floor {floor:g}: {advice}"
        yield self.check(self.above, message, value=value, limit=floor, place=place)


def _lift_on_red(vehicle: Vehicle) -> Form:
    """Return the form of D = m₁f₂ − f₁m₂ with yaw torques m and lifts f of rotors 1 and 2."""
    return Form(yaw_block(vehicle).form[:, :, None, None, None])


@dataclass
class _HoverThrust(Rule):
    """The thrusts that carry the weight without torque are positive and within the vehicle's limit."""

    name = "hover_thrust"
    kind = "flyable"
    continuous: Continuous
    brackets: _Brackets
    least: Worst = field(default_factory=Worst)
    largest: Worst = field(default_factory=Worst)
    lift: float = math.inf  # the least |D| of a curve's chords, see `shares`
    broken: tuple[float | None, GaitPoint] | None = None

    def update(self, block: Segments) -> None:
        """Bracket the least and the largest thrust, up to the first segment where one is not positive."""
        if (
            self.continuous.blue
            or self.continuous.fiber is not None
            or self.broken is not None
        ):
            return
        criteria, vehicle = self.criteria, self.criteria.vehicle
        if self.brackets.hovers:
            self.least.update(self.brackets.shares[0].worst(), block)
            self.largest.update(self.brackets.shares[1].worst(), block)
            if criteria.beside and block.on_red:
                form = _lift_on_red(vehicle)
                found = least_of_each(
                    block.starts, block.ends, [LevelSign(form)], [1e-6]
                )
                self.lift = min(self.lift, max(float(one.lower.min()) for one in found))
            return
        segment = int(np.argmin(self.brackets.upward))
        shares = hover_thrust_shares(block.alpha[segment : segment + 2], vehicle)
        worst = int(
            np.argmin(shares.min(axis=1))
        )  # the first that is not a number, if there is one
        if shares[worst].min() > 0:
            # Both ends are fine: something vanishes between them.
            fraction = where_thrusts_vanish(
                block.starts[segment], block.ends[segment], vehicle
            )
            self.broken = (None, block.place(segment, fraction))
        else:
            self.broken = (float(shares[worst].min()), block.place(segment + worst))

    @property
    def shares(self) -> tuple[float, float]:
        """The least and the largest share of m·g; for a curve their bounds, and 0 if a rotor may idle.

        On red the yaw torque m₁ of rotors 1 and 3 depends on α1 alone, m₂ of the others on α2 alone, and so do their lifts
        f₁ and f₂. The shares are m₂/(2D) and −m₁/(2D) in size, with D = m₁f₂ − f₁m₂. So the diagonal of the box around a
        curve decides for all of it whether a rotor idles, and the slopes of m and D how far shares differ from those of
        the chords.
        """
        criteria, beside = self.criteria, self.criteria.beside
        box = criteria.extremes
        if box is None:
            return self.least.upper, -self.largest.lower
        if (
            not is_red(box.T).all()
            or not thrusts_push_up(box[:1], box[1:], criteria.vehicle).all()
        ):
            return 0.0, math.inf
        level = level_of_vehicle(criteria.vehicle)
        yaw = float(np.linalg.norm(level.moment[:, 2], axis=1).max())
        moved = (
            math.sqrt(2.0) * float(_lift_on_red(criteria.vehicle).size()[0]) * beside
        )
        lift = self.lift - moved
        if not lift > 0:
            return 0.0, math.inf
        off = yaw * beside / (2 * lift)
        low = self.least.lower * self.lift / (self.lift + moved) - off
        return low, (-self.largest.lower + off) * self.lift / lift

    def checks(self) -> Iterator[Check]:
        refusal, value, place = "", None, None
        if self.continuous.blue:
            # Floating point would give some ratio of two vanishing quantities.
            refusal = "no thrusts carry the weight without torque: the moment matrix has rank two on blue; use red"
        elif self.continuous.fiber is not None:
            (code, place), value = self.continuous.fiber, 0.0
            which, rotors = (
                ("first", "2 and 4") if code == FIRST else ("second", "1 and 3")
            )
            idle = f"on the {which} fibre, where rotors {rotors} idle in hover and cannot make a torque"
            refusal = f"{self.described(place)} is {idle}: use the red sheet, away from the fibre"
        elif self.broken is not None:
            value, place = self.broken
            least = (
                f" (least {figure(value)} of m·g)"
                if value is not None and math.isfinite(value)
                else ""
            )
            refusal = (
                f"hover thrusts are not positive{least} at {self.described(place)}: keep β1 and β2 of opposite signs "
                "(α1 < δ and α2 > −δ, or both the other way)"
            )
        else:
            (low, peak), place = self.shares, self.least.place
            if not low > 0:  # it may be no number
                refusal = "a rotor may have to idle to hover along the curve: keep away from β1 = 0 and β2 = 0"
        if refusal:
            yield self.check(False, refusal, value=value, limit=0.0, place=place)
            return
        message = hover_thrust_text(low, peak)
        yield self.check(True, message, value=low, limit=0.0, place=place)
        limit = self.criteria.vehicle.max_thrust
        if limit is not None:
            mass, gravity = self.criteria.vehicle.require(
                "mass", "gravity", purpose="the check of the largest thrust"
            )
            newtons, at = peak * mass * gravity, self.largest.place
            most = limit * (1 + self.criteria.passing)
            ok, found = newtons <= most, f"largest hover thrust {newtons:.3g} N"
            message = self.compared(ok, found, f"{limit:.3g} N", at, "tilt less there")
            yield self.check(
                ok, message, value=newtons, limit=limit, place=at, name="thrust_limit"
            )

    @property
    def notes(self) -> tuple[str, ...]:
        """A warning if a rotor pushes with more than half of the weight and the vehicle limits no thrust."""
        if not self.brackets.hovers or self.criteria.vehicle.max_thrust is not None:
            return ()
        peak = self.shares[1]
        if not _STRONG < peak < math.inf:
            return ()
        ratio = f"a thrust-to-weight ratio of {figure(4 * peak)}"
        return (
            f"a rotor pushes with up to {figure(peak)} of m·g in hover, {ratio}; the vehicle states no max_thrust",
        )


@dataclass
class _HoverPower(Rule):
    """The rotors' mean power in hover, over time or else over the length of the gait; it is no check."""

    name = "hover_power"
    kind = "flyable"
    brackets: _Brackets
    total: float = 0.0
    weight: float = 0.0
    still: float = math.nan  # the power at the start, which counts where nothing moves
    over: Literal["time", "length"] = "length"

    def update(self, block: Segments) -> None:
        """Add the power along the segments, where all thrusts are positive so far."""
        if not self.brackets.hovers:
            return
        vehicle, starts, steps = (
            self.criteria.vehicle,
            block.starts,
            block.ends - block.starts,
        )
        weights = np.linalg.norm(steps, axis=-1)
        at_points = hover_power(block.alpha, vehicle)
        powers = (at_points[:-1] + at_points[1:]) / 2
        long = weights > _SHORT
        if long.any():
            starts, steps = starts[long, None], steps[long, None]

            def alpha_at(shares: FloatArray) -> FloatArray:
                return np.asarray(starts + shares[:, None] * steps)

            powers[long] = mean_hover_powers(alpha_at, len(steps), vehicle)
        if block.t is not None:
            self.over, weights = "time", np.diff(block.t)
        if not self.weight:
            self.still = float(powers[0])
        self.total += float(powers @ weights)
        self.weight += float(weights.sum())

    def checks(self) -> Iterator[Check]:
        """Yield nothing."""
        return iter(())

    @property
    def mean(self) -> float | None:
        """The mean, relative to the power at α = 0; None unless all thrusts are positive."""
        if not self.brackets.hovers:
            return None
        mean = self.total / self.weight if self.weight else self.still
        return mean if math.isfinite(mean) else None


@dataclass
class _TiltRange(Rule):
    """All tilts are within their arms' ranges; along a straight segment each angle is extreme at an end."""

    name = "tilt_range"
    kind = "flyable"
    peak: Peak = field(default_factory=Peak)

    def __post_init__(self) -> None:
        self.low, self.high = np.array(self.criteria.vehicle.tilt_range).T

    def _sizes(self, alpha: FloatArray) -> FloatArray:
        """Return distances from the middles of the ranges, the more the narrower; exact |α| if all are ±one limit."""
        half = (self.high - self.low) / 2
        return np.asarray(
            np.abs(alpha - (self.low + self.high) / 2) + (half.max() - half)
        )

    def update(self, block: Segments) -> None:
        self.peak.update(self._sizes(block.alpha), block)

    def checks(self) -> Iterator[Check]:
        place, low, high = self.peak.place, self.low, self.high
        if place is None:
            return
        rows = (
            np.array([place.alpha])
            if self.criteria.extremes is None
            else self.criteria.extremes
        )
        sizes = self._sizes(rows)
        row, arm = divmod(int(np.argmax(sizes)), 4)
        value = float(rows[row, arm])
        limit = float(high[arm] if 2 * value >= low[arm] + high[arm] else low[arm])
        room = EXACT + self.criteria.passing
        ok = bool(sizes[row, arm] <= ((high - low) / 2).max() + room)
        is_one = (high == high[0]).all() and (low == -high).all()
        value, limit = (abs(value), abs(limit)) if is_one else (value, limit)
        in_degrees = math.degrees(value), math.degrees(limit)
        tilt, allowed = (f"{angle:.4g}" for angle in in_degrees)
        if not ok:
            tilt, allowed = figures_apart(*in_degrees, digits=4)
        found = (
            f"largest tilt {tilt}° (α{arm + 1})"
            if is_one
            else f"tilt {tilt}° of arm {arm + 1}"
        )
        advice = (
            "move the waypoints nearer to 0"
            if is_one
            else "move the waypoints into its range"
        )
        message = self.compared(ok, found, f"{allowed}°", place, advice)
        yield self.check(ok, message, value=value, limit=limit, place=place)


class Checker:
    """Applies all rules, in the order of the report, to the segments of a gait; `lone` are wrong rows of a table."""

    def __init__(self, criteria: Criteria, lone: LoneRows | None = None) -> None:
        self.lone = LoneRows() if lone is None else lone
        self.surface = OnSurface(criteria, self.lone)
        self.two_color = TwoColor(criteria)
        self.continuous = continuous = Continuous(criteria)
        brackets = _Brackets(criteria, continuous)
        self.hover = _HoverThrust(criteria, continuous, brackets)
        self.power = _HoverPower(criteria, brackets)
        self.rules: list[Rule] = [
            self.surface,
            self.two_color,
            continuous,
            brackets,
            _LevelSign(criteria, continuous, brackets),
            _SingularValue(criteria, continuous, brackets),
            self.hover,
            self.power,
        ]
        if criteria.vehicle.tilt_range is not None:
            self.rules.append(_TiltRange(criteria))
        self.reachability = _Reachability(criteria, continuous, brackets)

    def update(self, segments: Segments) -> None:
        """Examine the next segments."""
        if len(segments.alpha) < 2:
            return
        for rule in self.rules:
            rule.update(segments)
        self.reachability.update(segments)

    def report(self, closed: Check) -> Report:
        """Return what was found; `closed` is the check of how the gait closes."""
        reachable, reachability = self.reachability.answer()
        found = [check for rule in self.rules for check in rule.checks()]
        checks = (closed, *following(found, self._causes(found)))
        vehicle = self.reachability.vehicle
        hovers = any(check.name == "hover_thrust" and check.ok for check in found)
        return Report(
            checks=checks,
            reachable_from_hover=reachable,
            reachability=reachability,
            notes=vehicle.warnings + self.hover.notes,
            unlimited=tuple(
                name
                for name, stated in LIMITED.items()
                if getattr(vehicle, stated) is None
            ),
            hover_power=self.power.mean if hovers else None,
            hover_power_over=self.power.over,
            hover_thrusts=self.hover.shares if hovers else None,
        )

    def broken_by_lone_rows(self, rates: Sequence[Check]) -> list[str]:
        """Return the names of the broken ones of on_surface and of checks of rates that are worst at a lone row."""
        of_rates = [
            check.name
            for check in rates
            if not check.ok and check.where and self.lone.is_near(check.where["row"])
        ]
        return ["on_surface"] * self.surface.is_broken_by_lone_row + of_rates

    def rates_with_causes(self, rates: Sequence[Check]) -> list[Check]:
        """Return checks of rates, those that are broken by angles in degrees or by a lone row with that cause."""
        convention = self.surface.convention
        if convention is not None and convention.degrees:
            return following(rates, dict.fromkeys(RATE_CHECKS, "on_surface"))
        names = self.broken_by_lone_rows(rates)
        return following(rates, dict.fromkeys(names[1:], *names[:1]))

    def _causes(self, checks: Sequence[Check]) -> dict[str, str]:
        """Return which rules, if they are broken, are broken by which others."""
        broken = {check.name for check in checks if not check.ok}
        if self.surface.convention is not None:
            return dict.fromkeys(broken - {"on_surface"}, "on_surface")
        causes: dict[str, str] = {}
        if "on_surface" in broken and self.continuous.is_off_sheets:
            causes["continuous"] = "on_surface"
        elif "continuous" in broken and self.surface.is_between_points:
            causes["on_surface"] = "continuous"
        if self.two_color.is_bare:
            causes["two_color"] = causes.get("continuous", "continuous")
        if "R_sign" in broken:
            causes |= {"least_singular_value": "R_sign", "hover_thrust": "R_sign"}
        elif self.continuous.blue and "least_singular_value" in broken:
            causes["hover_thrust"] = "least_singular_value"
        return causes


class _Reachability:
    """Whether a flight from hover can enter the gait, and leave it, without a singular matrix."""

    def __init__(
        self, criteria: Criteria, continuous: Continuous, brackets: _Brackets
    ) -> None:
        self.vehicle, self.continuous, self.brackets = (
            criteria.vehicle,
            continuous,
            brackets,
        )
        self.exact = coefficients_of(criteria.vehicle, "exact")
        self.slack = criteria.level_slack(self.exact)
        self.positive, self.decided, self.home, self.opposite, self.off_red = (
            True,
            True,
            True,
            0.0,
            0.0,
        )
        self.confined = True  # whether points of fibres are within ±π/2

    def update(self, block: Segments) -> None:
        """Decide whether R > 0 along the segments, and whether the points are in the component of α = 0."""
        if not self.positive:
            return
        alpha = block.alpha
        value = level_determinant(alpha, self.exact)
        if value.min() <= 0:
            self.positive = False
            return
        resolution = float(level_determinant_resolution(alpha, self.exact).max())
        floor = float(np.nextafter(max(resolution, self.slack), math.inf))
        least = least_level_determinant(
            block.starts, block.ends, self.exact, tolerance=0.0, floor=floor, each=True
        )
        lower = float(least.lower.min())
        self.positive = lower > resolution and not self.continuous.blue
        self.decided &= lower > self.slack
        fibered = block.sheet > 1
        if fibered.any():
            self.confined &= bool((np.abs(alpha[fibered]) <= math.pi / 2 + 1e-9).all())
            alpha = alpha[~fibered]
            if not len(alpha):
                return
        self.home &= bool(
            (red_label(alpha[:, 0], alpha[:, 1], self.vehicle) == HOVER_LABEL).all()
        )
        opposite = np.abs(alpha[:, 2:] - alpha[:, :2])
        self.opposite = max(self.opposite, float(opposite.max()))
        self.off_red = max(
            self.off_red, float(distance_to_multiple(opposite, math.pi).max())
        )

    def answer(self) -> tuple[bool | None, str]:
        """Return True, False or None for undecided, and the reason."""
        home = f"the component of α = 0 ({home_in_words(self.vehicle)})"
        enters = "the component of α = 0: a flight from hover can enter and leave it"
        if not self.positive:
            way = f"plan with sign positive, in {home}, or start the flight in the gait"
            return False, f"entering from hover (R > 0) passes a singular matrix: {way}"
        if self.vehicle.hover_exclusions:
            excluded = self.vehicle.hover_exclusions[0]
            return False, f"{excluded}: start the flight in the gait"
        if self.off_red > DEFAULT_TOLERANCE:
            return None, "not decided: off the red sheet, with R > 0"
        # An opposite arm shifted by π is on red too, but not on the part of it that hover is on.
        if not self.home or self.opposite > DEFAULT_TOLERANCE:
            return (
                False,
                f"no path on the surface from hover to this component of R > 0: plan in {home}",
            )
        if not self.decided:
            return None, "not decided: too close to R = 0 for chords of this size"
        if self.continuous.fiber is None:
            return True, f"in {enters}"
        if self.confined:
            return True, f"on a fibre that meets {enters}"
        return None, "not decided: on a fibre, beyond ±π/2, with R > 0"
