"""Is a gait valid, and can it fly? Every rule with its value, its limit and the place where it is worst.

*Valid* is the paper's notion: closed, on the surface, two-color, continuous, R of one sign. *Flyable* adds the
physics, always with the exact coefficients of the vehicle: the decoupling matrix well invertible, hover thrusts
positive and within limits, tilt angles within limits. Each check holds along the segments between corners, by
closed form or a bound, not at samples alone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import distance_to_multiple, number_of
from gaitgraph.coloring import first_violation
from gaitgraph.errors import InputError, shown
from gaitgraph.invertibility import (
    Coefficients,
    coefficients_of,
    hover_thrust_shares,
    level_determinant_resolution,
)
from gaitgraph.regions import HOVER_LABEL, red_label
from gaitgraph.segments import (
    keeps_singular_value_above,
    largest_residual,
    least_level_determinant,
    least_singular_value_along,
    thrust_shares_along,
)
from gaitgraph.surface import COLORS, sheet_angles

if TYPE_CHECKING:
    from collections.abc import Iterable

    from gaitgraph.gait import Gait

__all__ = ["DEFAULT_FLOOR", "DEFAULT_TOLERANCE", "Check", "Report", "check_gait"]

FloatArray = npt.NDArray[np.float64]

DEFAULT_TOLERANCE = 2e-3
"""|Rφ| and |Rθ| up to this count as on the surface; the paper's printed vertices reach 1.4e-3."""

DEFAULT_FLOOR = 0.05
"""Least singular value of the scaled decoupling matrix that a flyable gait must keep."""

_JUMP = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class Check:
    """One rule, what was found, and where.

    Parameters
    ----------
    name
        The rule.
    kind
        "valid" if the paper's rules ask for it, "flyable" if the physics does.
    ok
        Whether it holds along the whole gait.
    value, limit
        What was found at the worst place and what is allowed there, in the unit that the message names; None
        where there is none.
    where
        The worst place: segment (from which corner on), fraction along it, and tilt angles [rad]; or None.
    message
        One sentence that says what was found and, if the rule is broken, what would help.
    decided
        False for a sign of R that the digits of coefficients and angles do not carry.
    """

    name: str
    kind: Literal["valid", "flyable"]
    ok: bool
    message: str
    value: float | None = None
    limit: float | None = None
    where: dict[str, Any] | None = None
    decided: bool = True

    @property
    def mark(self) -> str:
        """How a summary marks the check: "ok", "NO", or "??" for a sign that is not decided."""
        if not self.ok:
            return "NO"
        return "ok" if self.decided else "??"

    def as_mapping(self) -> dict[str, Any]:
        """Return the check as plain values, ready for JSON."""
        return {
            "name": self.name,
            "kind": self.kind,
            "ok": self.ok,
            "value": _finite_or_none(self.value),
            "limit": _finite_or_none(self.limit),
            "where": self.where,
            "message": self.message,
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class Report:
    """All checks of one gait; falsy when it is not valid, and it prints well."""

    checks: tuple[Check, ...]
    reachable_from_hover: bool | None
    reachability: str

    @property
    def valid(self) -> bool:
        """Whether every rule of the paper holds."""
        return all(check.ok for check in self.checks if check.kind == "valid")

    @property
    def two_color(self) -> bool:
        """Whether every adjacent pair obeys Figure 15."""
        return self["two_color"].ok

    @property
    def flyable(self) -> bool:
        """Whether the gait is valid, its sign of R decided, and every physical check holds."""
        return all(check.ok and check.decided for check in self.checks)

    @property
    def reason(self) -> str:
        """The first reason why the gait is not flyable, or not valid; empty if it is both."""
        broken = [check.message for check in self.checks if not check.ok and check.kind == "valid"]
        broken += [check.message for check in self.checks if not check.ok and check.kind == "flyable"]
        broken += [check.message for check in self.checks if check.ok and not check.decided]
        return broken[0] if broken else ""

    @property
    def warnings(self) -> tuple[str, ...]:
        """What holds but deserves attention."""
        return tuple(check.message for check in self.checks if check.ok and not check.decided)

    def __getitem__(self, name: str) -> Check:
        for check in self.checks:
            if check.name == name:
                return check
        raise KeyError(name)

    def __bool__(self) -> bool:
        return self.valid

    def with_checks(self, more: Iterable[Check]) -> Report:
        """Return the report with further checks appended."""
        return Report(
            checks=(*self.checks, *more),
            reachable_from_hover=self.reachable_from_hover,
            reachability=self.reachability,
        )

    def as_mapping(self) -> dict[str, Any]:
        """Return the report as plain values, ready for JSON."""
        return {
            "valid": self.valid,
            "two_color": self.two_color,
            "flyable": self.flyable,
            "reachable_from_hover": self.reachable_from_hover,
            "checks": [check.as_mapping() for check in self.checks],
            "warnings": list(self.warnings),
        }

    def __str__(self) -> str:
        yes = {True: "yes", False: "no", None: "unknown"}
        lines = [
            f"valid {yes[self.valid]}, flyable {yes[self.flyable]}, "
            f"reachable from hover {yes[self.reachable_from_hover]}"
        ]
        lines += [f"  {check.mark}  {check.name:<22} {check.message}" for check in self.checks]
        lines.append(
            f"  {'ok' if self.reachable_from_hover else '--'}  {'reachable_from_hover':<22} {self.reachability}"
        )
        return "\n".join(lines)


def check_gait(
    gait: Gait,
    *,
    tolerance: float = DEFAULT_TOLERANCE,
    floor: float = DEFAULT_FLOOR,
    angle_rounding: float | None = None,
) -> Report:
    """Return every check of valid and flyable for a gait, and whether it can be reached from hover.

    Parameters
    ----------
    gait
        The gait; limits of its vehicle are checked where the vehicle states them. Rates need a clock: see
        :meth:`gaitgraph.timing.TimedGait.check`.
    tolerance
        Largest |Rφ| and |Rθ| that count as on the surface, dimensionless.
    floor
        Least singular value that a flyable gait must keep, dimensionless.
    angle_rounding
        What each angle may be off by because it was printed or measured, e.g. 5e-4 for three decimals [rad]. By
        default what is seen: the largest distance of α3 and α4 from the sheet of their color.

    Examples
    --------
    >>> from gaitgraph.gait import lift
    >>> report = check_gait(lift([(0.4, -1.2), (0.4, -0.4), (1.2, -0.4)], "red"))
    >>> report.valid, report.flyable, report.reachable_from_hover
    (True, True, False)
    """
    for name, number in (("tolerance", tolerance), ("floor", floor), ("angle_rounding", angle_rounding)):
        if number is not None and not 0 <= number_of(number) < math.inf:
            raise InputError(f"{name}: {shown(number)}; allowed is a finite number ≥ 0")
    checks = [
        Check(name="closed", kind="valid", ok=True, value=0.0, limit=0.0, message="closed by construction"),
        _on_surface(gait, tolerance),
        _two_color(gait),
        _continuous(gait, tolerance),
        _sign(gait, _distance_from_sheet(gait) if angle_rounding is None else angle_rounding),
        _singular_value(gait, floor),
        *_thrusts(gait),
        *_tilt_range(gait),
    ]
    reachable, message = _reachable(gait)
    return Report(checks=tuple(checks), reachable_from_hover=reachable, reachability=message)


def _place(gait: Gait, segment: int, fraction: float) -> dict[str, Any]:
    alpha = gait.alpha[segment] + fraction * (gait.ends[segment] - gait.alpha[segment])
    return {"segment": int(segment), "fraction": float(fraction), "alpha": [float(a) for a in alpha]}


def _at(where: dict[str, Any]) -> str:
    return "(" + ", ".join(f"{a:.3f}" for a in where["alpha"]) + ")"


def _distance_from_sheet(gait: Gait) -> float:
    """Return how far α3 and α4 are, mod π, from the sheet of their corner's color; zero off the surfaces [rad]."""
    if not gait.colors:
        return 0.0
    red = np.array([color == "red" for color in gait.colors])
    plane = gait.alpha[:, 0], gait.alpha[:, 1]
    pairs = zip(*(sheet_angles(color, *plane, gait.coefficients) for color in COLORS), strict=True)
    sheet = np.column_stack([np.where(red, on_red, on_blue) for on_red, on_blue in pairs])
    distance = float(distance_to_multiple(sheet - gait.alpha[:, 2:], math.pi).max())
    return distance if distance > _JUMP else 0.0


def _finite_or_none(value: float | None) -> float | None:
    return None if value is None or not math.isfinite(value) else float(value)


def _on_surface(gait: Gait, tolerance: float) -> Check:
    least = largest_residual(gait.alpha, gait.ends, gait.coefficients, tolerance=tolerance / 100)
    lower, _, segment, fraction = least.worst()
    where = _place(gait, segment, fraction)
    ok = -lower <= tolerance
    message = f"max(|Rφ|, |Rθ|) = {max(-lower, 0.0):.2g}, allowed {tolerance:g}"
    if not ok:
        message += f", worst at {_at(where)}: take (α3, α4) from the roots of (α1, α2)"
    value = max(-lower, 0.0)
    return Check(name="on_surface", kind="valid", ok=ok, value=value, limit=tolerance, where=where, message=message)


def _two_color(gait: Gait) -> Check:
    if not gait.colors:
        return Check(
            name="two_color",
            kind="valid",
            ok=False,
            message="off the surfaces a gait has no colors to compare",
        )
    broken = first_violation(gait.types)
    if broken is None:
        message = f"all neighbours allowed by Figure 15 ({gait.color})"
        return Check(name="two_color", kind="valid", ok=True, value=0.0, limit=0.0, message=message)
    after = (broken + 1) % len(gait.types)
    message = (
        f"corners {broken + 1} {gait.types[broken]} and {after + 1} {gait.types[after]} may not be neighbours "
        "(Figure 15): paint both in one color, or pass a (?,?) point between them"
    )
    where = _place(gait, broken, 0.0)
    return Check(name="two_color", kind="valid", ok=False, value=1.0, limit=0.0, where=where, message=message)


def jumps(
    starts: FloatArray,
    ends: FloatArray,
    red: npt.NDArray[np.bool_],
    red_after: npt.NDArray[np.bool_],
    coefficients: Coefficients,
) -> FloatArray:
    """Return by how much (α3, α4) leave a continuous motion along segments, shape (m,) [rad].

    Along one sheet: π where an angle wraps, else zero. Between sheets the color changes at one of the two ends:
    the smaller of the distances between the sheets there, in the larger of the two angles.
    """
    sign = np.where(red, 1.0, -1.0)
    step = ends - starts
    along = np.maximum(np.abs(step[:, 2] - sign * step[:, 0]), np.abs(step[:, 3] - sign * step[:, 1]))

    def gap(at: FloatArray, is_red: npt.NDArray[np.bool_]) -> FloatArray:
        r3, r4 = sheet_angles("red", at[:, 0], at[:, 1], coefficients)
        b3, b4 = sheet_angles("blue", at[:, 0], at[:, 1], coefficients)
        other3, other4 = np.where(is_red, b3, r3), np.where(is_red, b4, r4)
        return np.maximum(np.abs(at[:, 2] - other3), np.abs(at[:, 3] - other4))

    between = np.minimum(gap(starts, red), gap(ends, red_after))
    out = np.where(red == red_after, along, between)
    return np.where(out > _JUMP, out, 0.0)


def _continuous(gait: Gait, tolerance: float) -> Check:
    if not gait.colors:
        return Check(name="continuous", kind="valid", ok=False, message="off the surfaces a gait follows no sheet")
    red = np.array([color == "red" for color in gait.colors])
    after = np.roll(red, -1)
    sizes = jumps(gait.alpha, gait.ends, red, after, gait.coefficients)
    # Within one color, printed digits may move a segment off its sheet as far as the surface check allows.
    limits = np.where(red == after, tolerance, _JUMP)
    worst = int(np.argmax(sizes / np.maximum(limits, _JUMP)))
    size, limit, where = float(sizes[worst]), float(limits[worst]), _place(gait, worst, 0.0)
    ok = size <= limit
    message = "every segment stays on its sheet"
    if not ok:
        cause = "changes color" if red[worst] != after[worst] else "wraps by π or leaves its sheet"
        message = f"(α3, α4) jumps by {size:.4f} rad after corner {worst + 1}, where it {cause}: stay on one sheet"
    return Check(name="continuous", kind="valid", ok=ok, value=size, limit=limit, where=where, message=message)


def _sign(gait: Gait, angle_rounding: float) -> Check:
    at_corners = gait.R
    sign = 1.0 if at_corners[int(np.argmax(np.abs(at_corners)))] >= 0 else -1.0
    least = least_level_determinant(gait.alpha, gait.ends, gait.coefficients, sign=sign)
    lower, upper, segment, fraction = least.worst()
    where = _place(gait, segment, fraction)
    points = np.vstack([gait.alpha, where["alpha"]])
    resolution = float(np.max(level_determinant_resolution(points, gait.coefficients, angle_rounding)))
    if lower <= resolution < upper:
        lower = _least_beyond(gait, gait.coefficients, sign, resolution)
    described = f"{gait.coefficients.kind} coefficients"
    ok, decided = True, True
    if "blue" in gait.colors and gait.coefficients.kind == "exact":
        ok, decided = False, True
        message = "R = 0 on the whole blue sheet with exact coefficients, so it has no sign: use red"
    elif lower > resolution:
        relation = f"R ≥ {lower:.3g} > 0" if sign > 0 else f"R ≤ {-lower:.3g} < 0"
        message = f"{relation} along the whole gait ({described})"
    elif upper < -resolution:
        ok = False
        message = f"R changes its sign at {_at(where)} ({described}): keep the loop in one region of R"
    else:
        decided = False
        message = (
            f"sign of R undecided: |R| falls to {abs(upper):.2g}, within the {resolution:.2g} that the {described} "
            "carry; it is an artefact of rounding, not a margin"
        )
    return Check(
        name="R_sign",
        kind="valid",
        ok=ok,
        value=sign * upper,
        limit=resolution,
        where=where,
        message=message,
        decided=decided,
    )


def _least_beyond(gait: Gait, coefficients: Coefficients, sign: float, resolution: float) -> float:
    """Return a lower bound of sign·R along the gait, narrowed until its comparison with the resolution is settled."""
    floor = resolution * (1 + 1e-9)
    least = least_level_determinant(
        gait.alpha, gait.ends, coefficients, sign=sign, tolerance=0.0, floor=floor, each=True
    )
    return least.worst()[0]


def _singular_value(gait: Gait, floor: float) -> Check:
    lower, upper, segment, fraction = least_singular_value_along(gait.alpha, gait.ends, gait.vehicle).worst()
    where = _place(gait, segment, fraction)
    ok = lower >= floor
    if not ok and upper >= floor:
        ok = bool(keeps_singular_value_above(gait.alpha, gait.ends, floor, gait.vehicle).all())
    message = f"least singular value {upper:.3f} (at least {max(lower, 0.0):.3f}), floor {floor:g}"
    if not ok:
        message = (
            f"the decoupling matrix is nearly singular: least singular value {upper:.2g} at {_at(where)}, "
            f"floor {floor:g}"
        )
        if "blue" in gait.colors:
            message += "; in exact physics the whole blue sheet is singular at every attitude: use red"
    return Check(
        name="least_singular_value",
        kind="flyable",
        ok=ok,
        value=upper,
        limit=floor,
        where=where,
        message=message,
    )


def _thrusts(gait: Gait) -> list[Check]:
    vehicle = gait.vehicle
    if "blue" in gait.colors:
        # Floating point would give some ratio of two vanishing quantities.
        message = "no thrusts carry the weight without torque: on blue the control moment matrix has rank two"
        return [Check(name="hover_thrust", kind="flyable", ok=False, limit=0.0, message=message)]
    upward, least, largest = thrust_shares_along(gait.alpha, gait.ends, vehicle)
    if not upward.all():
        segment = int(np.argmin(upward))
        points = np.stack([gait.alpha[segment], gait.ends[segment]])
        shares = hover_thrust_shares(points, vehicle)
        worst = int(np.argmin(np.nan_to_num(shares, nan=-np.inf).min(axis=1)))
        where = _place(gait, segment, float(worst))
        value = float(shares[worst].min())
        message = (
            f"a rotor pair would have to idle or push down to hover on the segment after corner {segment + 1}: "
            "stay where β1 and β2 have opposite signs (α1 < δ and α2 > −δ, or both the other way)"
        )
        return [
            Check(
                name="hover_thrust",
                kind="flyable",
                ok=False,
                value=value,
                limit=0.0,
                where=where,
                message=message,
            )
        ]
    _, low, segment, fraction = least.worst()
    peak, _, peak_segment, peak_fraction = largest.worst()
    message = f"hover thrusts {low:.3f} to {-peak:.3f} of m·g per rotor, all positive"
    where = _place(gait, segment, fraction)
    checks = [Check(name="hover_thrust", kind="flyable", ok=True, value=low, limit=0.0, where=where, message=message)]
    if vehicle.max_thrust is not None:
        mass, gravity = vehicle.require("mass", "gravity", purpose="the check of the largest thrust")
        newtons = -peak * mass * gravity
        ok = newtons <= vehicle.max_thrust
        message = f"largest hover thrust {newtons:.3g} N, limit {vehicle.max_thrust:.3g} N"
        where = _place(gait, peak_segment, peak_fraction)
        checks.append(
            Check(
                name="thrust_limit",
                kind="flyable",
                ok=ok,
                value=newtons,
                limit=vehicle.max_thrust,
                where=where,
                message=message + ("" if ok else f", exceeded at {_at(where)}: tilt less there"),
            )
        )
    return checks


def _tilt_range(gait: Gait) -> list[Check]:
    limit = gait.vehicle.max_tilt
    if limit is None:
        return []
    # Along a straight segment each angle is largest at an end.
    corner, angle = np.unravel_index(int(np.argmax(np.abs(gait.alpha))), gait.alpha.shape)
    value, where = float(np.abs(gait.alpha[corner, angle])), _place(gait, int(corner), 0.0)
    ok = value <= limit + _JUMP
    message = f"largest tilt {math.degrees(value):.1f}°, limit {math.degrees(limit):.1f}°"
    if not ok:
        message += f", exceeded by α{angle + 1} at corner {corner + 1}: move the waypoints nearer to 0"
    return [Check(name="tilt_range", kind="flyable", ok=ok, value=value, limit=limit, where=where, message=message)]


def _reachable(gait: Gait) -> tuple[bool | None, str]:
    exact = coefficients_of(gait.vehicle, "exact")
    resolution = float(np.max(level_determinant_resolution(gait.alpha, exact)))
    positive = _least_beyond(gait, exact, 1.0, resolution) > resolution
    limit = 2 * gait.vehicle.signed_drag_ratio
    home = f"the component of α = 0 (tan α1 − tan α2 {'<' if limit > 0 else '>'} {limit:.4f})"
    if not positive or "blue" in gait.colors:
        return False, (
            "it cannot be entered from ordinary hover (R = +4 at α = 0) without a singular matrix: plan with R > 0 in "
            f"{home}, or start the flight in the gait"
        )
    if gait.color == "red" and _distance_from_sheet(gait) <= DEFAULT_TOLERANCE:
        home_label = (red_label(gait.alpha[:, 0], gait.alpha[:, 1], gait.vehicle) == HOVER_LABEL).all()
        # An opposite arm shifted by π is on red too, but not on the part of it that hover is on.
        if home_label and np.abs(gait.alpha[:, 2:] - gait.alpha[:, :2]).max() <= DEFAULT_TOLERANCE:
            return True, "in the component of α = 0, which ordinary hover can enter and leave"
        return False, f"on the surface ordinary hover cannot reach this component of R > 0: plan in {home}"
    return None, "off the red sheet with R > 0: whether hover can reach it is not decided here"
