"""The command compare: two gaits side by side."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING, Any

import click

from gaitgraph.cli import PAPER_GAITS, Paths, Working, command, file, option, print_json, wants_json
from gaitgraph.cli.fly import CLOCK

if TYPE_CHECKING:
    from gaitgraph.timing.timed_gait import TimedGait

_UNITS = {"length": "rad", "period": "s", "peak_rate": "rad/s", "peak_acceleration": "rad/s²"}
_UNITS |= dict.fromkeys(("least_hover_thrust", "largest_hover_thrust"), "m·g")


@command(
    "Two gaits side by side: verdicts, margins, thrusts, rates.",
    file("first", "A", *PAPER_GAITS),
    file("second", "B", *PAPER_GAITS),
    *CLOCK,
    option("--output", "FILE", "Draw both: .png, .svg or .pdf; repeatable.", name="outputs", multiple=True),
    "force json",
)
def compare_command(first: str, second: str, outputs: Paths = (), force: bool = False, **given: Any) -> int:
    """Compare two gaits, each in any form that the other commands take.

    Hover thrusts, in units of the weight, and the least singular value are those of level flight.
    """
    from gaitgraph.timing.timed_gait import timed_gait_of

    with Working("comparing"):
        gaits = [timed_gait_of(name, **given) for name in (first, second)]
        found = [{"gait": name, **_numbers(timed)} for name, timed in zip((first, second), gaits, strict=True)]
        if outputs:
            from gaitgraph.plots.axes import blank_figure, write_pictures
            from gaitgraph.plots.gaits import draw_sheet

            figure = blank_figure(400.0, 168.0)
            draw_sheet(figure, gaits, (first, second))
            write_pictures(figure, outputs, force=force)
    if wants_json():
        print_json({"gaits": found, "outputs": list(outputs)})
        return 0
    for name in (name for name in found[0] if name != "reason"):
        unit = f" ({_UNITS[name]})" if name in _UNITS else ""
        left, right = (_text(numbers[name]) for numbers in found)
        click.echo(f"{name.replace('_', ' ') + unit:<34}{left:<22}  {right}")
    reasons = [f"{one['gait']} is not flyable: {one['reason']}" for one in found if one["reason"]]
    click.echo("\n".join([*reasons, *(f"wrote {name}" for name in outputs)]))
    return 0


def _numbers(timed: TimedGait) -> dict[str, Any]:
    """Return what is compared of a gait as plain values; None for what does not exist or is infinite."""
    from gaitgraph.invertibility.segment_bounds import thrust_shares_along
    from gaitgraph.robustness.biased import robustness_of

    gait, report, robustness = timed.gait, timed.check(), robustness_of(timed, curves=1).gait.as_mapping()
    upward, least, largest = thrust_shares_along(gait.alpha, gait.ends, gait.vehicle)
    hovers = bool(upward.all()) and report["least_singular_value"].ok
    values = {
        **{name: getattr(report, name) for name in ("flyable", "valid", "reachable_from_hover", "reason")},
        "color": gait.color,
        "length": gait.length,
        "period": timed.period,
        "least_singular_value": report["least_singular_value"].value,
        **{name: robustness[name] for name in ("tilt_margin_deg", "acceptable_fraction")},
        "least_hover_thrust": float(least.upper.min()) if hovers else None,
        "largest_hover_thrust": -float(largest.upper.min()) if hovers else None,
        "peak_rate": float(timed.peak_rates().max()),
        "peak_acceleration": float(timed.peak_accelerations().max()),
    }
    return {name: None if isinstance(one, float) and not isfinite(one) else one for name, one in values.items()}


def _text(value: Any) -> str:
    if value is None or isinstance(value, bool):
        return {None: "none", True: "yes", False: "no"}[value]
    return value if isinstance(value, str) else f"{value:.4g}"
