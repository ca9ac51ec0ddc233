"""Reports of several readings of one gait, or of motions one after another, as one report: of each check the worst."""

from __future__ import annotations

from dataclasses import replace
from functools import reduce
from typing import TYPE_CHECKING

from gaitgraph.gait.table import RATE_CHECKS
from gaitgraph.validation.report import hover_thrust_text

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gaitgraph.validation.report import Check, Report

_TIE = 1e-4  # share of a value by which another is no worse


def both(first: Report, second: Report) -> Report:
    """Return the report of a gait of which two readings must hold; of each check the worse one, else the first.

    Closing, rows, colourings and notes are those of the second, power and thrusts in hover are those of the first.
    """
    checks = []
    others = {check.name: check for check in second.checks}
    for check in first.checks:
        other = others.pop(check.name, check)
        is_worse = check.ok and not other.ok
        if check.ok and other.ok:
            badness, tie = _badness(check), _TIE * abs(check.value or 0.0)
            is_worse = _badness(other) - badness > tie
        checks.append(other if is_worse or check.name == "closed" else check)
    reach = first
    if first.reachable_from_hover and not second.reachable_from_hover:
        reach = second
    return replace(
        second,
        checks=(*checks, *others.values()),
        reachable_from_hover=reach.reachable_from_hover,
        reachability=reach.reachability,
        hover_power=None if second.hover_power is None else first.hover_power,
        hover_power_over=first.hover_power_over,
        hover_thrusts=None if second.hover_thrusts is None else first.hover_thrusts,
    )


def _badness(check: Check) -> float:
    """Return a number that is the larger the nearer a check that holds is to its limit."""
    value = check.value or 0.0
    if check.name in (*RATE_CHECKS, "on_surface", "thrust_limit"):
        return value
    if check.name in ("least_singular_value", "hover_thrust"):
        return -value
    if check.name == "R_sign":
        return -abs(value)
    if check.name == "tilt_range":
        return -abs((check.limit or 0.0) - value)
    return 0.0


def worst_of(reports: Sequence[Report]) -> Report:
    """Return the report of motions one after another: of each check the worst, and the hover thrusts of all of them."""
    report = reduce(both, reports)
    thrusts = [one.hover_thrusts for one in reports if one.hover_thrusts is not None]
    if len(thrusts) < len(reports):
        return replace(report, hover_thrusts=None)
    least = min(one[0] for one in thrusts)
    largest = max(one[1] for one in thrusts)
    strongest = next(one for one in reports if one.hover_thrusts[1] == largest)  # type: ignore[index]
    text = hover_thrust_text(least, largest)
    checks = [
        replace(check, message=text) if check.name == "hover_thrust" else check
        for check in report.checks
    ]
    return replace(
        report,
        checks=tuple(checks),
        notes=strongest.notes,
        hover_thrusts=(least, largest),
    )
