"""The rules of physics (sign of R, invertibility, hover thrusts, tilts), reachability from hover, and all rules."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from gaitgraph.angles import distance_to_multiple, figure, figures_apart
from gaitgraph.gait.table import RATE_CHECKS
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.invertibility.forms import Form
from gaitgraph.invertibility.matrices import (
    hover_power_at,
    hover_thrust_shares,
    level_of_vehicle,
    mean_hover_powers,
    noise_of,
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
from gaitgraph.surface.curved import sheet_of
from gaitgraph.surface.curved_region import reached_from_hover
from gaitgraph.surface.sheets import HOVER_LABEL, home_in_words, red_label
from gaitgraph.tolerances import DEFAULT_TOLERANCE, IDLE_SHARE, SAME_ANGLE
from gaitgraph.validation.report import (
    LIMITED,
    Report,
    State,
    check_of,
    following,
    hover_thrust_text,
)
from gaitgraph.validation.rules import (
    Criteria,
    Fit,
    Segments,
    compared,
    continuous,
    fit_of,
    idle_pair,
    on_surface,
    residual_of,
    two_color,
)
from gaitgraph.validation.wrong_rows import LoneRows, Misreading, misreading_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.invertibility.matrices import BoolArray
    from gaitgraph.validation.report import Check, GaitPoint
    from gaitgraph.validation.wrong_rows import Convention
    from gaitgraph.vehicle import Vehicle

_SHORT = 2e-3  # rad, of a segment whose mean power is taken as that of its ends
_STRONG = 0.5  # of m·g, the thrust of a rotor at a thrust-to-weight ratio of 2
_NO_LONE_ROWS = LoneRows()


@dataclass(frozen=True, kw_only=True, eq=False)
class Brackets:
    """Brackets along each segment of a gait, found in one search.

    Parameters
    ----------
    value
        R at the points, shape (m + 1,).
    sign
        The sign of a gait: that of R where |R| at a point is largest.
    level
        Of sign·R.
    singular
        Of the least singular value.
    upward
        Whether all thrusts are positive along each segment, shape (m,).
    shares
        Of the least share of the weight, and of minus the largest; empty unless all thrusts are positive.
    """

    value: FloatArray
    sign: float
    level: Least
    singular: Least
    upward: BoolArray
    shares: tuple[Least, ...]


def brackets_of(segments: Segments, criteria: Criteria, fit: Fit) -> Brackets:
    """Bracket all quantities that the rules compare with their limits."""
    starts = segments.starts
    ends = segments.ends
    vehicle = criteria.vehicle
    value = criteria.coefficients.level_form.at(segments.sines)[0]
    sign = 1.0 if value[np.argmax(np.abs(value))] >= 0 else -1.0
    quantities: list[Quantity] = [
        LevelSign(criteria.coefficients, (sign,)),
        singular_quantity(vehicle),
    ]
    tolerances = [1e-6, criteria.bracket]
    upward = np.zeros(len(starts), dtype=bool)
    if not fit.on_blue:
        upward = thrusts_push_up(starts, ends, vehicle)
    if upward.all():
        quantities.append(share_quantity(vehicle))
        tolerances.append(criteria.bracket)
    level, singular, *shares = least_of_each(starts, ends, quantities, tolerances)
    return Brackets(
        value=value,
        sign=sign,
        level=level,
        singular=singular,
        upward=upward,
        shares=tuple(shares),
    )


def _resolution_of(
    segments: Segments, criteria: Criteria, fit: Fit
) -> tuple[FloatArray, str]:
    """Return what |R| must exceed at each point for its sign to be known, and what is assumed of angles, in words."""
    coefficients = criteria.coefficients
    rounding = fit.errors
    if criteria.angle_rounding is not None:
        rounding = np.full(len(segments.alpha), criteria.angle_rounding)
    assumed = "angles exact"
    if rounding.any():
        assumed = f"angles to {rounding.max():.2g} rad"
    return coefficients.level_errors(segments.sines, rounding), assumed


def sign_of_R(
    segments: Segments, criteria: Criteria, fit: Fit, brackets: Brackets
) -> Check:
    """Check that R has one sign (Proposition 1), beyond the error that digits of coefficients and angles leave."""
    coefficients, sign = criteria.coefficients, brackets.sign
    kind = coefficients.kind
    errors, assumed = _resolution_of(segments, criteria, fit)
    resolution = float(errors.max())
    is_above = brackets.value > errors
    is_below = -brackets.value > errors
    level = _compared_with(brackets.level, resolution, segments, criteria, sign)
    least, upper, segment, fraction = level.worst()
    place = segments.place(segment, fraction)
    lower = least - criteria.level_slack(coefficients)
    state = State.UNDECIDED
    if fit.on_blue and kind == "exact":
        state = State.BROKEN
        message = "R = 0 on the whole blue sheet with exact coefficients, so it has no sign: use red"
    elif lower > resolution:
        state = State.HOLDS
        relation = f"R ≥ {lower:.3g} > 0"
        if sign < 0:
            relation = f"R ≤ {-lower:.3g} < 0"
        message = f"{relation} along the whole gait ({kind} coefficients, {assumed})"
    elif upper < -resolution or (is_above.any() and is_below.any()):
        state = State.BROKEN
        message = f"R changes its sign at {place} ({kind} coefficients): keep the loop in one region of R"
    elif least > resolution:
        message = (
            f"sign of R undecided: |R| may fall to {max(lower, 0.0):.2g} along the curve, error {resolution:.2g}: use "
            "shorter chords"
        )
    else:
        advice = "keep away from R = 0, or use more digits"
        if fit.on_blue:
            advice = "use red"
        message = (
            f"sign of R undecided: |R| falls to {abs(upper):.2g} at {place}, below the error {resolution:.2g} of the "
            f"{kind} coefficients ({assumed}): {advice}"
        )
    return check_of(
        "R_sign",
        state,
        message,
        value=sign * (lower if criteria.beside else upper),
        limit=resolution,
        place=place,
    )


def _compared_with(
    level: Least,
    resolution: float,
    segments: Segments,
    criteria: Criteria,
    sign: float,
) -> Least:
    """Return brackets of sign·R, those that straddle the resolution narrowed until the comparison is settled."""
    lower, upper, _, _ = level.worst()
    if not lower <= resolution < upper:
        return level
    near = level.lower <= resolution
    narrow = least_level_determinant(
        segments.starts[near],
        segments.ends[near],
        criteria.coefficients,
        sign=sign,
        tolerance=0.0,
        floor=float(np.nextafter(resolution, math.inf)),
        each=True,
    )
    parts = {}
    for name in ("lower", "upper", "fraction"):
        parts[name] = getattr(level, name).copy()
        parts[name][near] = getattr(narrow, name)
    return Least(**parts)


def least_singular_value(
    segments: Segments, criteria: Criteria, fit: Fit, brackets: Brackets
) -> Check:
    """Check that the decoupling matrix of the exact physics is well invertible, level."""
    slack, found = criteria.singular_value_slack, brackets.singular
    least, upper, segment, fraction = found.worst()
    passed = criteria.floor * (1 - criteria.passing)
    needed = passed + slack
    close = found.lower < needed
    above = upper >= needed
    if above and close.any():
        # The brackets do not decide the comparison.
        above = bool(
            keeps_singular_value_above(
                segments.starts[close], segments.ends[close], needed, criteria.vehicle
            ).all()
        )
    place = segments.place(segment, fraction)
    value = least - slack if criteria.beside else upper
    # Rounded down, as a bound must be.
    proven = max(math.floor(1e4 * (least - slack)) / 1e4, passed)
    message = f"least singular value {figure(value)} (proven lower bound {proven:.4f}, floor {criteria.floor:g})"
    if not above:
        advice = "move the loop away from R = 0, or lower the floor"
        if fit.on_blue:
            advice = "use red, since the whole blue sheet is singular at every attitude in exact physics"
        message = f"least singular value {value:.3g} at {place}, floor {criteria.floor:g}: {advice}"
    return check_of(
        "least_singular_value",
        above,
        message,
        value=value,
        limit=criteria.floor,
        place=place,
    )


# -- Hover


def hover_thrust(
    segments: Segments, criteria: Criteria, fit: Fit, brackets: Brackets
) -> tuple[list[Check], tuple[float, float] | None]:
    """Check the thrusts that carry the weight without torque; also return the least and the largest as shares of m·g.

    They must be positive and, if the vehicle states it, within a limit. The shares are None where that is not so.
    """
    refusal = ""
    value = None
    place = None
    low = high = 0.0
    if fit.on_blue:
        # Floating point would give some ratio of two vanishing quantities.
        refusal = "no thrusts carry the weight without torque: the moment matrix has rank two on blue; use red"
    elif not brackets.shares:
        refusal, value, place = _idle_or_down(segments, criteria.vehicle, brackets)
    else:
        low, high = _shares_along(segments, criteria, brackets)
        place = _worst_place(segments, brackets.shares[0])
        if not low > 0:  # it may be no number
            refusal = "a rotor may have to idle to hover along the curve: keep away from β1 = 0 and β2 = 0"
            if criteria.vehicle.asymmetry is not None:
                refusal = f"hover thrusts may fall to {figure(low)} of m·g: keep away from there"
    if refusal:
        check = check_of(
            "hover_thrust", False, refusal, value=value, limit=0.0, place=place
        )
        return [check], None
    text = hover_thrust_text(low, high)
    checks = [check_of("hover_thrust", True, text, value=low, limit=0.0, place=place)]
    limit = criteria.vehicle.max_thrust
    if limit is not None:
        mass, gravity = criteria.vehicle.require(
            "mass", "gravity", purpose="the check of the largest thrust"
        )
        newtons = high * mass * gravity
        at = _worst_place(segments, brackets.shares[1])
        ok = newtons <= limit * (1 + criteria.passing)
        text = f"largest hover thrust {newtons:.3g} N"
        message = compared(ok, text, f"{limit:.3g} N", at, "tilt less there")
        checks.append(
            check_of(
                "thrust_limit",
                ok,
                message,
                value=newtons,
                limit=limit,
                place=at,
            )
        )
    return checks, (low, high)


def _worst_place(segments: Segments, found: Least) -> GaitPoint:
    _, _, segment, fraction = found.worst()
    return segments.place(segment, fraction)


def _idle_or_down(
    segments: Segments, vehicle: Vehicle, brackets: Brackets
) -> tuple[str, float | None, GaitPoint]:
    """Return that thrusts are not positive, in words, the least share of the weight if it is known, and where."""
    down = np.flatnonzero(~brackets.upward)
    ends = np.union1d(down, down + 1)
    shares = hover_thrust_shares(segments.alpha[ends], vehicle).min(axis=1)
    worst = int(np.argmin(shares))  # the first that is not a number, if any
    least = float(shares[worst])
    value = None
    size = ""
    if least > 0:
        # All ends are fine: something vanishes between them.
        first = int(down[0])
        start, stop = segments.starts[first], segments.ends[first]
        place = segments.place(first, where_thrusts_vanish(start, stop, vehicle))
    else:
        place = segments.place(int(ends[worst]))
        value = least
        if math.isfinite(least):
            printed = 0.0 if abs(least) <= IDLE_SHARE else least
            size = f" (least {figure(printed)} of m·g)"
    idle = idle_pair(place, vehicle)
    if idle:
        idle = f", where {idle} idle"
    advice = "keep away from there"
    if vehicle.asymmetry is None:
        line1, line2 = level_of_vehicle(vehicle).crossings
        sides = f"α1 < {line1:.4f} and α2 > {line2:.4f}"
        if math.isclose(line1, -line2):
            sides = "α1 < δ and α2 > −δ"
        advice = f"keep β1 and β2 of opposite signs ({sides}, or both the other way)"
    refusal = f"hover thrusts are not positive{size} at {place}{idle}: {advice}"
    return refusal, value, place


def _shares_along(
    segments: Segments, criteria: Criteria, brackets: Brackets
) -> tuple[float, float]:
    """Return the least and the largest share of m·g; for a curve their bounds, and 0 if a rotor may idle.

    On red the yaw torque m₁ of rotors 1 and 3 depends on α1 alone, m₂ of the others on α2 alone, and so do their lifts
    f₁ and f₂. The shares are m₂/(2D) and −m₁/(2D) in size, with D = m₁f₂ − f₁m₂. So the slopes of m and D say how far
    the shares differ from those of the chords.
    """
    beside = criteria.beside
    vehicle = criteria.vehicle
    least, upper, _, _ = brackets.shares[0].worst()
    most = brackets.shares[1].worst()[0]
    if criteria.extremes is None:
        return upper, -most
    if vehicle.asymmetry is not None:
        off = _change_of_shares(-most, criteria, brackets)
        return least - off, off - most
    if not segments.on_red:
        return 0.0, math.inf
    form = Form(yaw_block(vehicle).form[:, :, None, None, None])  # D
    found = least_of_each(segments.starts, segments.ends, [LevelSign(form)], [1e-6])
    lift = max(float(bracket.lower.min()) for bracket in found)
    moved = math.sqrt(2.0) * float(form.size[0]) * beside
    if not lift > moved:
        return 0.0, math.inf
    yaw = np.linalg.norm(level_of_vehicle(vehicle).moment[:, 2], axis=1).max()
    off = float(yaw) * beside / (2 * (lift - moved))
    low = least * lift / (lift + moved) - off
    return low, (-most + off) * lift / (lift - moved)


def _change_of_shares(most: float, criteria: Criteria, brackets: Brackets) -> float:
    """Return by how much hover thrusts of a curve differ at most from those of its chords, which are at most `most`.

    They are Nᵢ/R with the zero-moment inputs Nᵢ. The four angles move as for :meth:`Criteria.level_slack`.
    """
    slack = criteria.level_slack(criteria.coefficients)
    rest = float(brackets.level.lower.min()) - slack
    if not rest > 0:
        return math.inf
    inputs = level_of_vehicle(criteria.vehicle).inputs
    largest = max(float(form.size[0]) for form in inputs)
    change = largest * math.sqrt(8.0) * criteria.beside
    return (change + most * slack) / rest


def _notes_on_thrust(
    shares: tuple[float, float] | None, vehicle: Vehicle
) -> tuple[str, ...]:
    """Return a warning if a rotor pushes with more than half of the weight and the vehicle limits no thrust."""
    if shares is None or vehicle.max_thrust is not None:
        return ()
    if not _STRONG < shares[1] < math.inf:
        return ()
    ratio = f"a thrust-to-weight ratio of {figure(4 * shares[1])}"
    return (
        f"a rotor pushes with up to {figure(shares[1])} of m·g in hover, {ratio}; the vehicle states no max_thrust",
    )


def mean_hover_power(
    segments: Segments, vehicle: Vehicle
) -> tuple[float | None, Literal["time", "length"]]:
    """Return the rotors' mean power in hover, relative to that at α = 0, over time or else length; None if not finite."""
    over: Literal["time", "length"] = "length"
    starts, steps = segments.starts, segments.ends - segments.starts
    weights = np.linalg.norm(steps, axis=-1)
    powers = np.zeros(len(weights))
    long = weights > _SHORT
    if not long.all():
        at_points = hover_power_at(segments.sines, level_of_vehicle(vehicle))
        powers = (at_points[:-1] + at_points[1:]) / 2
    if long.any():
        starts, steps = starts[long, None], steps[long, None]

        def alpha_at(shares: FloatArray) -> FloatArray:
            return np.asarray(starts + shares[:, None] * steps)

        powers[long] = mean_hover_powers(alpha_at, len(steps), vehicle)
    if segments.t is not None:
        over, weights = "time", np.diff(segments.t)
    mean = float(powers[0])
    if weights.any():
        mean = float(powers @ weights) / float(weights.sum())
    if not math.isfinite(mean):
        return None, over
    return mean, over


def tilt_range(
    segments: Segments,
    ranges: FloatArray,
    *,
    extremes: FloatArray | None = None,
    passing: float = 0.0,
) -> Check:
    """Check that tilts are within the ranges of their servos, shape (N, 2) [rad].

    Along a straight segment each angle is extreme at an end; of a curve the `extremes` count. `passing` may be beyond.
    """
    low, high = ranges.T
    beyond = np.maximum(low - segments.alpha, segments.alpha - high)
    place = segments.place(int(np.argmax(beyond.max(axis=1))))
    rows = segments.alpha
    if extremes is not None:
        rows = extremes
        beyond = np.maximum(low - rows, rows - high)
    row, arm = divmod(int(np.argmax(beyond)), len(ranges))
    value = float(rows[row, arm])
    limit = float(high[arm])
    if low[arm] - value > value - high[arm]:
        limit = float(low[arm])
    ok = bool(beyond[row, arm] <= SAME_ANGLE + passing)
    is_one = bool((high == high[0]).all() and (low == -high).all())
    if is_one:
        value = abs(value)
        limit = abs(limit)
    tilt = f"{math.degrees(value):.4g}"
    allowed = f"{math.degrees(limit):.4g}"
    if not ok:
        tilt, allowed = figures_apart(
            math.degrees(value), math.degrees(limit), digits=4
        )
    text = f"tilt {tilt}° of arm {arm + 1}"
    advice = "move the waypoints into its range"
    if is_one:
        text = f"largest tilt {tilt}° (α{arm + 1})"
        advice = "move the waypoints nearer to 0"
    message = compared(ok, text, f"{allowed}°", place, advice)
    return check_of("tilt_range", ok, message, value=value, limit=limit, place=place)


def reachability(
    segments: Segments, criteria: Criteria, fit: Fit
) -> tuple[bool | None, str]:
    """Return whether a flight from hover can enter the gait and leave it without a singular matrix, and the reason.

    None if it is not decided.
    """
    vehicle, alpha = criteria.vehicle, segments.alpha
    exact = coefficients_of(vehicle, "exact")
    advice = "plan with sign positive"
    if vehicle.asymmetry is None:
        home = f"in the component of α = 0 ({home_in_words(vehicle)})"
        advice += f", {home}"
    passes = f"entering from hover (R > 0) passes a singular matrix: {advice}, or start the flight in the gait"
    if fit.on_blue:
        return False, passes
    resolution = noise_of(exact)
    slack = criteria.level_slack(exact)
    floor = float(np.nextafter(max(resolution, slack), math.inf))
    lower = least_level_determinant(
        segments.starts, segments.ends, exact, tolerance=0.0, floor=floor, each=True
    ).lower.min()
    if not lower > resolution:
        return False, passes
    if vehicle.asymmetry is not None:
        if sheet_of(exact.rotors).distances(alpha).max() > DEFAULT_TOLERANCE:
            return None, "not decided: off the curved sheet, with R > 0"
        return reached_from_hover(alpha[:, :2], vehicle, criteria.floor)
    if vehicle.hover_exclusions:
        return False, f"{vehicle.hover_exclusions[0]}: start the flight in the gait"
    opposite = np.abs(alpha[:, 2:] - alpha[:, :2])
    if distance_to_multiple(opposite, math.pi).max() > DEFAULT_TOLERANCE:
        return None, "not decided: off the red sheet, with R > 0"
    # An opposite arm shifted by π is on red too, but not on the part of it that hover is on.
    at_home = (red_label(alpha[:, 0], alpha[:, 1], vehicle) == HOVER_LABEL).all()
    if not at_home or opposite.max() > DEFAULT_TOLERANCE:
        way = (
            f"no path on the surface from hover to this component of R > 0: plan {home}"
        )
        return False, way
    if not lower > slack:
        return None, "not decided: too close to R = 0 for chords of this size"
    return True, "in the component of α = 0: a flight from hover can enter and leave it"


# -- All rules


def report_of(
    segments: Segments,
    criteria: Criteria,
    closed: Check,
    *,
    rates: Sequence[Check] = (),
    lone: LoneRows = _NO_LONE_ROWS,
) -> Report:
    """Return all checks of a gait, in the order of the report.

    `closed` is the check of how it closes, `rates` are those of its times, and `lone` rows that are far from the others.
    Without planes, for a vehicle that is not symmetric, there are no types and no Figure 15: what is left is physics.
    """
    fit = fit_of(segments, criteria)
    brackets = brackets_of(segments, criteria, fit)
    sign = sign_of_R(segments, criteria, fit, brackets)
    physics = _physics_of(segments, criteria, fit, brackets)
    reachable, reason = reachability(segments, criteria, fit)
    physics = replace(physics, reachable_from_hover=reachable, reachability=reason)
    if criteria.vehicle.asymmetry is not None:
        notes = physics.notes + _notes_on_sheet(segments, criteria)
        checks = [closed, sign, *physics.checks, *rates]
        return replace(physics, checks=tuple(checks), notes=notes)
    residual = residual_of(segments, criteria)
    misreading = Misreading()
    if segments.noun == "row" and residual[0] > criteria.tolerance:  # people bring rows
        misreading = misreading_of(
            segments.alpha, criteria.coefficients, criteria.tolerance
        )
    surface = on_surface(segments, criteria, residual, misreading, lone)
    colored, has_bare = two_color(segments, criteria)
    stays, is_off_sheets = continuous(segments, criteria, fit)
    checks = [surface, colored, stays, sign, *physics.checks]
    causes = _causes(checks, fit, residual[1], is_off_sheets, has_bare)
    if misreading.convention is not None:
        causes = _causes_of_convention(checks, misreading.convention)
    by_lone_rows = _broken_at([surface, *rates], lone)
    for name in by_lone_rows[1:]:
        causes[name] = by_lone_rows[0]
    notes = physics.notes
    if lone.note and not by_lone_rows:
        notes += (lone.note,)
    return replace(
        physics,
        checks=(closed, *following(checks + list(rates), causes)),
        notes=notes,
    )


def _notes_on_sheet(segments: Segments, criteria: Criteria) -> tuple[str, ...]:
    """Return a warning if segments may be off the curved sheet of a vehicle that is not symmetric."""
    sheet = sheet_of(criteria.coefficients.rotors)
    off = sheet.distances_along(segments.starts, segments.ends)
    if off.max() <= DEFAULT_TOLERANCE:
        return ()
    place = segments.place(int(off.argmax()))
    return (
        f"up to {off.max():.2g} rad off the curved sheet after {place}: only on it the matrix is invertible at every roll "
        "and pitch",
    )


def _physics_of(
    segments: Segments, criteria: Criteria, fit: Fit, brackets: Brackets
) -> Report:
    """Return the report of physics on any vehicle, without rates."""
    vehicle = criteria.vehicle
    thrusts, shares = hover_thrust(segments, criteria, fit, brackets)
    checks = [least_singular_value(segments, criteria, fit, brackets), *thrusts]
    if vehicle.tilt_range is not None:
        ranges, passing = np.array(vehicle.tilt_range), criteria.passing
        extremes = criteria.extremes
        checks.append(tilt_range(segments, ranges, extremes=extremes, passing=passing))
    unlimited = [
        name for name, stated in LIMITED.items() if getattr(vehicle, stated) is None
    ]
    power: float | None = None
    over: Literal["time", "length"] = "length"
    if shares is not None:
        power, over = mean_hover_power(segments, vehicle)
    return Report(
        checks=tuple(checks),
        notes=tuple(vehicle.warnings) + _notes_on_thrust(shares, vehicle),
        unlimited=tuple(unlimited),
        hover_power=power,
        hover_power_over=over,
        hover_thrusts=shares,
    )


def _causes(
    checks: Sequence[Check],
    fit: Fit,
    off_surface: GaitPoint,
    is_off_sheets: bool,
    has_bare: bool,
) -> dict[str, str]:
    """Return which rules, if they are broken, are broken by which others."""
    broken = {check.name for check in checks if check.broken}
    causes: dict[str, str] = {}
    if "on_surface" in broken and is_off_sheets:
        causes["continuous"] = "on_surface"
    elif "continuous" in broken and off_surface.fraction:
        causes["on_surface"] = "continuous"
    if has_bare:
        causes["two_color"] = causes.get("continuous", "continuous")
    if "R_sign" in broken:
        causes |= {"least_singular_value": "R_sign", "hover_thrust": "R_sign"}
    elif fit.on_blue and "least_singular_value" in broken:
        causes["hover_thrust"] = "least_singular_value"
    return causes


def _causes_of_convention(
    checks: Sequence[Check], convention: Convention
) -> dict[str, str]:
    """Return which rules are broken because the rows were read in another convention: all that angles tell."""
    names = {check.name for check in checks} - {"on_surface"}
    if convention.degrees:
        names |= set(RATE_CHECKS)
    return dict.fromkeys(names, "on_surface")


def _broken_at(checks: Sequence[Check], lone: LoneRows) -> list[str]:
    """Return the names of the checks that are broken at rows that are far from the others."""
    names = []
    for check in checks:
        place = check.where or {}
        if check.broken and lone.is_near(place.get("row", 0)):
            names.append(check.name)
    return names
