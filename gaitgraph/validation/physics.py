"""The rules of physics (sign of R, invertibility, hover thrusts, tilts), reachability from hover, and all rules."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal

import numpy as np

from gaitgraph.angles import distance_to_multiple, figure, figures_apart
from gaitgraph.gait.table import RATE_CHECKS
from gaitgraph.invertibility.matrices import (
    hover_thrust_shares,
    level_of_vehicle,
    mean_hover_powers,
    noise_of,
    power_of_shares,
)
from gaitgraph.invertibility.segment_bounds import (
    Least,
    keeps_singular_value_above,
    least_level_determinant,
    where_thrusts_vanish,
)
from gaitgraph.surface.curved import sheet_of
from gaitgraph.surface.curved_region import reached_from_hover
from gaitgraph.surface.red_components import HOVER_LABEL, home_in_words, red_label
from gaitgraph.surface.sheets import sheet_distances
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
    compared,
    continuous,
    idle_pair,
    on_surface,
    two_color,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gaitgraph.invertibility.coefficients import Coefficients
    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.validation.judged import JudgedGait, Segments
    from gaitgraph.validation.report import Check
    from gaitgraph.vehicle import Vehicle

_SHORT = 2e-3  # rad, of a segment whose mean power is taken as that of its ends
_STRONG = 0.5  # of m·g, the thrust of a rotor at a thrust-to-weight ratio of 2


def sign_of_R(gait: JudgedGait) -> Check:
    """Check that R has one sign (Proposition 1), beyond the error that digits of coefficients and angles leave."""
    segments, coefficients, sign = gait.segments, gait.criteria.coefficients, gait.sign
    kind = coefficients.kind
    rounding = gait.angle_errors
    assumed = "angles exact"
    if rounding.any():
        assumed = f"angles to {rounding.max():.2g} rad"
    errors = coefficients.level_errors(segments.sines, rounding)
    resolution = float(errors.max())
    level = _narrowed_at(gait, gait.brackets["level"], resolution, coefficients, sign)
    least, upper, _, _ = level.worst()
    place = segments.worst_place(level)
    slack = gait.criteria.level_slack(coefficients)
    lower = least - slack
    changes = (gait.level > errors).any() and (gait.level < -errors).any()
    state = State.UNDECIDED
    if gait.on_blue and kind == "exact":
        state = State.BROKEN
        message = "R = 0 on the whole blue sheet with exact coefficients, so it has no sign: use red"
    elif lower > resolution:
        state = State.HOLDS
        relation = f"R ≥ {lower:.3g} > 0"
        if sign < 0:
            relation = f"R ≤ {-lower:.3g} < 0"
        message = f"{relation} along the whole gait ({kind} coefficients, {assumed})"
    elif upper < -resolution or changes:
        state = State.BROKEN
        message = f"R changes its sign at {place} ({kind} coefficients): keep the loop in one region of R"
    elif least > resolution:
        message = (
            f"sign of R undecided: |R| may fall to {max(lower, 0.0):.2g} along the curve, error {resolution:.2g}: use "
            "shorter chords"
        )
    else:
        advice = "keep away from R = 0, or use more digits"
        if gait.on_blue:
            advice = "use red"
        message = (
            f"sign of R undecided: |R| falls to {abs(upper):.2g} at {place}, below the error {resolution:.2g} of the "
            f"{kind} coefficients ({assumed}): {advice}"
        )
    return check_of(
        "R_sign",
        state,
        message,
        value=sign * (upper - slack),
        limit=resolution,
        place=place,
    )


def _narrowed_at(
    gait: JudgedGait,
    level: Least,
    limit: float,
    coefficients: Coefficients,
    sign: float,
) -> Least:
    """Return brackets of R times a sign, narrower ones if these leave its comparison with a limit open."""
    lower, upper, _, _ = level.worst()
    if not lower <= limit < upper:
        return level
    return least_level_determinant(
        gait.segments.starts,
        gait.segments.ends,
        coefficients,
        sign=sign,
        tolerance=0.0,
        floor=float(np.nextafter(limit, math.inf)),
        each=True,
    )


def least_singular_value(gait: JudgedGait) -> Check:
    """Check that the decoupling matrix of the exact physics is well invertible, level."""
    segments, criteria = gait.segments, gait.criteria
    brackets = gait.brackets["singular_value"]
    slack = criteria.singular_value_slack
    least, upper, _, _ = brackets.worst()
    place = segments.worst_place(brackets)
    passed = criteria.floor * (1 - criteria.passing)
    needed = passed + slack
    close = brackets.lower < needed
    above = upper >= needed
    if above and close.any():
        # The brackets do not decide the comparison.
        above = bool(
            keeps_singular_value_above(
                segments.starts[close], segments.ends[close], needed, criteria.vehicle
            ).all()
        )
    value = upper - slack
    # Rounded down, as a bound must be.
    proven = max(math.floor(1e4 * (least - slack)) / 1e4, passed)
    message = f"least singular value {figure(value)} (proven lower bound {proven:.4f}, floor {criteria.floor:g})"
    if not above:
        advice = "move the loop away from R = 0, or lower the floor"
        if gait.on_blue:
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


def hover_thrust(gait: JudgedGait) -> Check:
    """Check that the thrusts that carry the weight without torque are positive."""
    shares = hover_shares(gait)
    if shares is not None:
        place = gait.segments.worst_place(gait.brackets["least_share"])
        text = hover_thrust_text(*shares)
        return check_of(
            "hover_thrust", True, text, value=shares[0], limit=0.0, place=place
        )
    if gait.on_blue:
        # Floating point would give some ratio of two vanishing quantities.
        message = "no thrusts carry the weight without torque: the moment matrix has rank two on blue; use red"
        return check_of("hover_thrust", False, message, limit=0.0)
    if not gait.upward.all():
        return _idle_or_down(gait)
    message = "a rotor may have to idle to hover along the curve: keep away from there"
    place = gait.segments.worst_place(gait.brackets["least_share"])
    return check_of("hover_thrust", False, message, limit=0.0, place=place)


def hover_shares(gait: JudgedGait) -> tuple[float, float] | None:
    """Return the least and the largest hover thrust as shares of m·g, of a curve bounds of both; None unless all are positive."""
    if gait.on_blue or not gait.upward.all():
        return None
    _, least, _, _ = gait.brackets["least_share"].worst()
    most = -gait.brackets["minus_largest_share"].worst()[0]
    off = _change_of_shares(gait, most)
    if not least > off:  # it may be no number
        return None
    return least - off, most + off


def _change_of_shares(gait: JudgedGait, most: float) -> float:
    """Return by how much hover thrusts of a curve differ at most from those of its chords, which are at most `most`.

    They are Nᵢ/R with the zero-moment inputs Nᵢ. The four angles move as for :meth:`Criteria.level_slack`.
    """
    criteria = gait.criteria
    if not criteria.beside:
        return 0.0
    slack = criteria.level_slack(criteria.exact)
    rest = float(gait.brackets["exact_level"].lower.min()) - slack
    if not rest > 0:
        return math.inf
    inputs = level_of_vehicle(criteria.vehicle).inputs
    largest = max(float(form.size[0]) for form in inputs)
    change = largest * math.sqrt(8.0) * criteria.beside
    return (change + most * slack) / rest


def _idle_or_down(gait: JudgedGait) -> Check:
    """Return the check of thrusts that are not all positive: the least share of the weight if it is known, and where."""
    segments, vehicle = gait.segments, gait.criteria.vehicle
    down = np.flatnonzero(~gait.upward)
    ends = np.union1d(down, down + 1)
    shares = hover_thrust_shares(segments.alpha[ends], vehicle).min(axis=1)
    worst = int(np.argmin(shares))  # the first that is not a number, if any
    least = float(shares[worst])
    value: float | None = least
    size = ""
    if shares[worst] > IDLE_SHARE:
        # All ends are fine: something vanishes between them.
        value = None
        first = int(down[0])
        start, stop = segments.starts[first], segments.ends[first]
        place = segments.place(first, where_thrusts_vanish(start, stop, vehicle))
    else:
        place = segments.place(int(ends[worst]))
        if abs(shares[worst]) <= IDLE_SHARE:
            least = value = 0.0
        if math.isfinite(shares[worst]):
            size = f" (least {figure(least)} of m·g)"
    idle = idle_pair(place, vehicle)
    if idle:
        idle = f", where {idle} idle"
    advice = "keep away from there"
    if gait.criteria.has_planes:
        line1, line2 = level_of_vehicle(vehicle).crossings
        sides = f"α1 < {line1:.4f} and α2 > {line2:.4f}"
        if math.isclose(line1, -line2):
            sides = "α1 < δ and α2 > −δ"
        advice = f"keep β1 and β2 of opposite signs ({sides}, or both the other way)"
    message = f"hover thrusts are not positive{size} at {place}{idle}: {advice}"
    return check_of("hover_thrust", False, message, value=value, limit=0.0, place=place)


def thrust_limit(gait: JudgedGait, largest: float) -> Check:
    """Check the largest hover thrust, as a share of m·g, against the limit that the vehicle states."""
    vehicle = gait.criteria.vehicle
    mass, gravity, limit = vehicle.require(
        "mass", "gravity", "max_thrust", purpose="the check of the largest thrust"
    )
    newtons = largest * mass * gravity
    place = gait.segments.worst_place(gait.brackets["minus_largest_share"])
    ok = newtons <= limit * (1 + gait.criteria.passing)
    text = f"largest hover thrust {newtons:.3g} N"
    message = compared(ok, text, f"{limit:.3g} N", place, "tilt less there")
    return check_of(
        "thrust_limit", ok, message, value=newtons, limit=limit, place=place
    )


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


def mean_hover_power(gait: JudgedGait) -> float | None:
    """Return the rotors' mean power in hover, relative to that at α = 0, over time or else length; None if not finite."""
    segments, vehicle = gait.segments, gait.criteria.vehicle
    starts, steps = segments.starts, segments.ends - segments.starts
    length = np.linalg.norm(steps, axis=-1)
    at_points = power_of_shares(gait.shares, level_of_vehicle(vehicle))
    powers = (at_points[:-1] + at_points[1:]) / 2
    long = length > _SHORT
    if long.any():
        starts, steps = starts[long, None], steps[long, None]

        def alpha_at(shares: FloatArray) -> FloatArray:
            return np.asarray(starts + shares[:, None] * steps)

        powers[long] = mean_hover_powers(alpha_at, len(steps), vehicle)
    weights = length
    if segments.t is not None:
        weights = np.diff(segments.t)
    mean = float(powers[0])
    if weights.any():
        mean = float(powers @ weights) / float(weights.sum())
    if not math.isfinite(mean):
        return None
    return mean


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


def reachability(gait: JudgedGait) -> tuple[bool | None, str]:
    """Return whether a flight from hover can enter the gait and leave it without a singular matrix, and the reason.

    None if it is not decided.
    """
    criteria, alpha = gait.criteria, gait.segments.alpha
    vehicle, exact = criteria.vehicle, criteria.exact
    advice = "plan with sign positive"
    if criteria.has_planes:
        home = f"in the component of α = 0 ({home_in_words(vehicle)})"
        advice += f", {home}"
    passes = f"entering from hover (R > 0) passes a singular matrix: {advice}, or start the flight in the gait"
    if gait.on_blue or gait.exact_sign < 0:
        return False, passes
    resolution, slack = noise_of(exact), criteria.level_slack(exact)
    limit = max(resolution, slack)
    level = _narrowed_at(gait, gait.brackets["exact_level"], limit, exact, 1.0)
    lower = level.lower.min()
    if not lower > resolution:
        return False, passes
    if not criteria.has_planes:
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
    gait: JudgedGait, closed: Check, *, rates: Sequence[Check] = ()
) -> Report:
    """Return all checks of a gait, in the order of the report.

    `closed` is the check of how it closes, `rates` are those of its times. Without planes, for a vehicle that is not
    symmetric, there are no types and no Figure 15: what is left is physics.
    """
    segments, criteria = gait.segments, gait.criteria
    vehicle = criteria.vehicle
    shares = hover_shares(gait)
    checks = [sign_of_R(gait), least_singular_value(gait), hover_thrust(gait)]
    if shares is not None and vehicle.max_thrust is not None:
        checks.append(thrust_limit(gait, shares[1]))
    if vehicle.tilt_range is not None:
        ranges, passing = np.array(vehicle.tilt_range), criteria.passing
        extremes = criteria.extremes
        checks.append(tilt_range(segments, ranges, extremes=extremes, passing=passing))
    checks += rates
    notes = [*vehicle.warnings, *_notes_on_thrust(shares, vehicle)]
    if criteria.has_planes:
        checks = [on_surface(gait), two_color(gait), continuous(gait), *checks]
        by_lone_rows = _broken_at_lone_rows(gait, checks)
        causes = _causes(gait, checks)
        for name in by_lone_rows[1:]:
            causes[name] = by_lone_rows[0]
        checks = following(checks, causes)
        if gait.lone.note and not by_lone_rows:
            notes.append(gait.lone.note)
    else:
        notes += _notes_on_sheet(gait)
    power: float | None = None
    over: Literal["time", "length"] = "length"
    if shares is not None:
        power = mean_hover_power(gait)
        if segments.t is not None:
            over = "time"
    unlimited = [
        name for name, stated in LIMITED.items() if getattr(vehicle, stated) is None
    ]
    reachable, reason = reachability(gait)
    return Report(
        checks=(closed, *checks),
        reachable_from_hover=reachable,
        reachability=reason,
        notes=tuple(notes),
        unlimited=tuple(unlimited),
        hover_power=power,
        hover_power_over=over,
        hover_thrusts=shares,
    )


def _notes_on_sheet(gait: JudgedGait) -> tuple[str, ...]:
    """Return a warning if segments may be off the curved sheet of a vehicle that is not symmetric."""
    segments = gait.segments
    sheet = sheet_of(gait.criteria.coefficients.rotors)
    off = sheet.distances_along(segments.starts, segments.ends)
    if off.max() <= DEFAULT_TOLERANCE:
        return ()
    place = segments.place(int(off.argmax()))
    return (
        f"up to {off.max():.2g} rad off the curved sheet after {place}: only on it the matrix is invertible at every roll "
        "and pitch",
    )


def _causes(gait: JudgedGait, checks: Sequence[Check]) -> dict[str, str]:
    """Return which rules are broken by which others."""
    broken = {check.name: check for check in checks if check.broken}
    convention = gait.misreading.convention
    if convention is not None:
        # Rows that were read in another convention break all that angles tell, in another unit rates too.
        followers = broken.keys() - {"on_surface"}
        if not convention.degrees:
            followers -= set(RATE_CHECKS)
        return dict.fromkeys(followers, "on_surface")
    causes: dict[str, str] = {}
    _, off_surface = gait.residual
    breaks = broken.get("continuous")
    is_off_sheets = breaks is not None and _is_off_sheets(gait, breaks)
    if "on_surface" in broken and is_off_sheets:
        causes["continuous"] = "on_surface"
    elif "continuous" in broken and off_surface.fraction:
        causes["on_surface"] = "continuous"
    colored = broken.get("two_color")
    is_bare = not gait.segments.color.all()
    if breaks and colored and is_bare and colored.where == breaks.where:
        causes["two_color"] = causes.get("continuous", "continuous")
    if "R_sign" in broken:
        causes |= {"least_singular_value": "R_sign", "hover_thrust": "R_sign"}
    elif gait.on_blue and "least_singular_value" in broken:
        causes["hover_thrust"] = "least_singular_value"
    return causes


def _is_off_sheets(gait: JudgedGait, check: Check) -> bool:
    """Return whether a check is broken at a point that lies on neither sheet."""
    if check.where is None:
        return False
    distances = sheet_distances(check.where["alpha"], gait.criteria.coefficients)
    return bool(distances.min() > gait.criteria.tolerance)


def _broken_at_lone_rows(gait: JudgedGait, checks: Sequence[Check]) -> list[str]:
    """Return the names of the checks that are broken at rows that are far from the others."""
    names = []
    for check in checks:
        place = check.where or {}
        by_rows = check.name in ("on_surface", *RATE_CHECKS)
        if by_rows and check.broken and gait.lone.is_near(place.get("row", 0)):
            names.append(check.name)
    return names
