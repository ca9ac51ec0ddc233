"""A plan on one screen, for people."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gaitgraph.angles import text_from_angle

if TYPE_CHECKING:
    from gaitgraph.planning import Loop, Plan

__all__ = ["text_of_plan"]

_MOST_CORNERS = 12
_YES = {True: "yes", False: "no", None: "unknown"}


def text_of_plan(plan: Plan, *, written: tuple[str, ...] = ()) -> str:
    """Return the summary of a plan: what was planned, its corners, the checks, the warnings, what was written."""
    request = plan.request
    setting = (
        f"vehicle {request.vehicle.name} (κ = {request.vehicle.drag_ratio:.4f}), {request.coefficients} coefficients, "
        f"{request.divisions} divisions"
    )
    if plan.loop is None:
        lines = ["No gait.", *(f"  {obstacle.message}" for obstacle in plan.obstacles)]
        lines += [f"  but: {_alternative(loop)}" for loop in plan.alternatives]
        lines += [f"warning: {warning}" for warning in plan.warnings]
        return "\n".join([*lines, setting])
    loop = plan.loop
    report = loop.report
    relation = "R > 0" if loop.sign == "positive" else "R < 0"
    lines = [
        f"Planned a {loop.color} gait, {relation}: {len(loop.gait.alpha)} corners, {loop.length:.4f} rad around, "
        f"T = {request.period:g} s, {request.law}",
        setting,
        "",
        "   corner      α1        α2        α3        α4     types",
    ]
    types = loop.gait.types
    for k, alpha in enumerate(loop.gait.alpha[:_MOST_CORNERS]):
        angles = "".join(f"{text_from_angle(float(angle)):>10}" for angle in alpha)
        lines.append(f"   {k + 1:>4}  {angles}     {types[k]}")
    if len(loop.gait.alpha) > _MOST_CORNERS:
        lines.append(f"      … and {len(loop.gait.alpha) - _MOST_CORNERS} more")
    lines += [
        "",
        f"valid {_YES[report.valid]} · flyable {_YES[report.flyable]} · "
        f"reachable from hover {_YES[report.reachable_from_hover]}",
    ]
    for check in report.checks:
        mark = "ok" if check.ok and check.decided else "??" if check.ok else "NO"
        lines.append(f"  {mark}  {check.name.replace('_', ' '):<22}{check.message}")
    if plan.alternatives:
        lines += ["", "alternatives"]
        lines += [f"  {_alternative(other)}" for other in plan.alternatives]
    shown = [warning for warning in plan.warnings if warning not in report.warnings]
    if shown:
        lines += ["", *(f"warning: {warning}" for warning in shown)]
    if written:
        lines += ["", *(f"wrote {name}" for name in written)]
    return "\n".join(lines)


def _alternative(loop: Loop) -> str:
    relation = "R > 0" if loop.sign == "positive" else "R < 0"
    verdict = "flyable" if loop.report.flyable else "valid, not flyable" if loop.report.valid else "not valid"
    text = f"{loop.color}, {relation}, {loop.length:.4f} rad: {verdict}"
    return text if loop.report.flyable else f"{text} ({loop.report.reason})"
