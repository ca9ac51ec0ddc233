"""A plan on one screen, for people."""

from __future__ import annotations

from textwrap import fill
from typing import TYPE_CHECKING

from gaitgraph.angles import text_from_angle
from gaitgraph.reports import lines_of_checks, verdict_line

if TYPE_CHECKING:
    from gaitgraph.plans import Loop, Plan

__all__ = ["text_of_plan"]

_WIDTH = 110
_MOST_CORNERS = 12


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


def _setting(plan: Plan) -> str:
    request = plan.request
    method = "any angle" if (plan.loop or request).method == "exact" else f"{request.divisions} divisions"
    return (
        f"vehicle {request.vehicle.name} (κ = {request.vehicle.drag_ratio:.4f}), {request.coefficients} coefficients, "
        f"{method}"
    )


def _refused(plan: Plan) -> list[str]:
    return ["No gait.", *map(_item, dict.fromkeys(obstacle.message for obstacle in plan.obstacles)), _setting(plan)]


def _planned(plan: Plan, loop: Loop) -> list[str]:
    request, report, corners = plan.request, loop.report, len(loop.gait.alpha)
    lines = [
        f"Planned a {loop.color} gait, {_relation(loop)}: {corners} corner{'s' * (corners > 1)}, "
        f"{loop.length:.4f} rad around, T = {request.period:g} s, {request.law}",
        _setting(plan),
        "",
        "  corner      α1        α2        α3        α4     types",
    ]
    types = loop.gait.types
    for k, alpha in enumerate(loop.gait.alpha[:_MOST_CORNERS]):
        angles = "".join(f"{text_from_angle(float(angle)):>10}" for angle in alpha)
        lines.append(f"  {k + 1:>4}  {angles}     {types[k]}")
    if corners > _MOST_CORNERS:
        lines.append(f"     … and {corners - _MOST_CORNERS} more")
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
