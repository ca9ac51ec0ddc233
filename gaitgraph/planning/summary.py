"""A plan on one screen, for people."""

from __future__ import annotations

from textwrap import fill
from typing import TYPE_CHECKING

from gaitgraph.validation.report import lines_of_checks, verdict_line

if TYPE_CHECKING:
    from gaitgraph.planning.plan import Loop, Plan

__all__ = ["headline_of_plan", "setting_of_plan", "text_of_plan"]

_WIDTH = 110


def text_of_plan(plan: Plan, *, written: tuple[str, ...] = ()) -> str:
    """Return the summary of a plan: what was planned, its corners, the checks, the warnings, what was written."""
    lines = _refused(plan) if plan.loop is None else _planned(plan, plan.loop)
    if plan.alternatives:
        lines += ["", "alternatives", *(_item(_alternative(other)) for other in plan.alternatives)]
    # What a check says already is not said again.
    told = plan.loop.report.warnings if plan.loop else ()
    shown = [f"warning: {warning}" for warning in plan.warnings if warning not in told]
    if shown:
        lines += ["", *(_item(warning, "") for warning in shown)]
    if written:
        lines += ["", *(f"wrote {name}" for name in written)]
    return "\n".join(lines)


def headline_of_plan(plan: Plan) -> str:
    """Return what was planned, in one line."""
    request, loop = plan.request, plan.loop
    if loop is None:
        return "No gait."
    corners = len(loop.gait.alpha)
    return (
        f"Planned a {loop.color} gait, {_relation(loop)}: {corners} corner{'s' * (corners > 1)}, "
        f"{loop.length:.4f} rad around, T = {request.period:g} s, {request.law}"
    )


def setting_of_plan(plan: Plan) -> str:
    """Return for which vehicle, with which coefficients and how it was planned, in one line."""
    request = plan.request
    method = "any angle" if (plan.loop or request).method == "exact" else f"{request.divisions} divisions"
    return (
        f"vehicle {request.vehicle.name} (κ = {request.vehicle.drag_ratio:.4f}), {request.coefficients} coefficients, "
        f"{method}"
    )


def _refused(plan: Plan) -> list[str]:
    return [
        headline_of_plan(plan),
        *map(_item, dict.fromkeys(obstacle.message for obstacle in plan.obstacles)),
        setting_of_plan(plan),
    ]


def _planned(plan: Plan, loop: Loop) -> list[str]:
    report = loop.report
    lines = [
        headline_of_plan(plan),
        setting_of_plan(plan),
        "",
        *loop.gait.corner_lines(),
    ]
    lines += ["", verdict_line(report.valid, report.flyable, report.reachable_from_hover)]
    lines += lines_of_checks(report.checks)
    return lines


def _item(text: str, indent: str = "  ") -> str:
    return fill(text, _WIDTH, initial_indent=indent, subsequent_indent=indent + "  ")


def _relation(loop: Loop) -> str:
    return "R > 0" if loop.sign == "positive" else "R < 0"


def _alternative(loop: Loop) -> str:
    report = loop.report
    text = f"{loop.color}, {_relation(loop)}, {loop.length:.4f} rad"
    if report.flyable:
        return f"{text}: flyable"
    broken = [check.name.replace("_", " ") for check in report.checks if check.mark != "ok"]
    return f"{text}: {'valid, not flyable' if report.valid else 'not valid'} ({', '.join(broken)})"
