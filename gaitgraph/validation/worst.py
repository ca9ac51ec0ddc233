"""Reports of several readings of one gait, or of motions one after another, as one report: of each check the worst."""

from __future__ import annotations

from dataclasses import replace
from functools import reduce
from typing import TYPE_CHECKING

import numpy as np

from gaitgraph.validation.report import check_of, hover_thrust_text

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gaitgraph.validation.report import Check, Report

_TIE = 1e-4  # share of a value by which another is no worse
_LEAST = ("R_sign", "least_singular_value", "hover_thrust")
"""The checks of what must be large enough; that of all others must be small enough."""


def both(first: Report, second: Report) -> Report:
    """Return the report of a gait of which two readings must hold; of each check the worse one, else the first.

    Closing, rows, colourings and notes are those of the second, power and thrusts in hover are those of the first.
    """
    others = {check.name: check for check in second.checks}
    checks = []
    for check in first.checks:
        other = others.pop(check.name, check)
        takes_other = check.name == "closed" or _is_worse(other, check)
        checks.append(other if takes_other else check)
    checks += others.values()
    reach = first
    if first.reachable_from_hover and not second.reachable_from_hover:
        reach = second
    worse = replace(
        second,
        checks=tuple(checks),
        reachable_from_hover=reach.reachable_from_hover,
        reachability=reach.reachability,
        hover_power_over=first.hover_power_over,
    )
    if second.hover_power is not None:
        worse = replace(worse, hover_power=first.hover_power)
    if second.hover_thrusts is not None:
        worse = replace(worse, hover_thrusts=first.hover_thrusts)
    return worse


def _is_worse(other: Check, check: Check) -> bool:
    """Return whether a check is worse than another of the same name: not ok, or clearly nearer to its limit."""
    if not other.ok:
        return check.ok
    if not check.ok:
        return False
    tie = _TIE * abs(check.value or 0.0)
    return _nearness(other) - _nearness(check) > tie


def _nearness(check: Check) -> float:
    """Return a number that is the larger the nearer a check that holds is to its limit."""
    value = check.value or 0.0
    if check.name in _LEAST:
        return -abs(value)
    if check.limit is None:
        return value
    return -abs(check.limit - value)


def worst_of(reports: Sequence[Report]) -> Report:
    """Return the report of motions one after another, run once: of each check the worst, the hover thrusts of all."""
    report = reduce(both, reports)
    once = check_of(
        "closed", True, "run once: no segment leads back", value=0.0, limit=0.0
    )
    made = {"closed": once}
    notes = report.notes
    extremes = None
    thrusts = [part.hover_thrusts for part in reports if part.hover_thrusts]
    if len(thrusts) == len(reports):
        lowest, highest = np.transpose(thrusts)
        extremes = float(lowest.min()), float(highest.max())
        notes = reports[int(highest.argmax())].notes
        text = hover_thrust_text(*extremes)
        made["hover_thrust"] = replace(report["hover_thrust"], message=text)
    checks = tuple(made.get(check.name, check) for check in report.checks)
    return replace(
        report, checks=checks, notes=notes, hover_thrusts=extremes, repeats=False
    )
