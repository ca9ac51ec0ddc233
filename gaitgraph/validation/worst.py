"""Reports of several readings of one gait, or of motions one after another, as one report: of each check the worst."""

from __future__ import annotations

import math
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
            tie = _TIE * abs(check.value or 0.0)
            is_worse = _badness(other) - _badness(check) > tie
        takes_other = is_worse or check.name == "closed"
        checks.append(other if takes_other else check)
    checks += others.values()
    reach = first
    if first.reachable_from_hover and not second.reachable_from_hover:
        reach = second
    power = second.hover_power
    if power is not None:
        power = first.hover_power
    thrusts = second.hover_thrusts
    if thrusts is not None:
        thrusts = first.hover_thrusts
    return replace(
        second,
        checks=tuple(checks),
        reachable_from_hover=reach.reachable_from_hover,
        reachability=reach.reachability,
        hover_power=power,
        hover_power_over=first.hover_power_over,
        hover_thrusts=thrusts,
    )


def _badness(check: Check) -> float:
    """Return a number that is the larger the nearer a check that holds is to its limit."""
    value = check.value or 0.0
    if check.name in RATE_CHECKS or check.name in ("on_surface", "thrust_limit"):
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
    least = math.inf
    largest = 0.0
    notes = report.notes
    for part in reports:
        if part.hover_thrusts is None:
            return replace(report, hover_thrusts=None)
        low, high = part.hover_thrusts
        least = min(least, low)
        if high > largest:
            largest = high
            notes = part.notes
    text = hover_thrust_text(least, largest)
    checks = list(report.checks)
    for number, check in enumerate(checks):
        if check.name == "hover_thrust":
            checks[number] = replace(check, message=text)
    return replace(
        report, checks=tuple(checks), notes=notes, hover_thrusts=(least, largest)
    )
