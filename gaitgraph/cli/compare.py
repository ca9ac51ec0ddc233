"""The command compare: two gaits side by side."""

from __future__ import annotations

from math import isfinite, isnan
from typing import TYPE_CHECKING, Any

import click

from gaitgraph.cli import PAPER_GAITS, Paths, Working, command, file, option, print_json, wants_json
from gaitgraph.cli.fly import CLOCK

if TYPE_CHECKING:
    from gaitgraph.timing.timed_gait import TimedGait

_UNITS = {
    "length": "rad", "period": "s", "tilt_margin_deg": "degrees", "acceptable_fraction": "of attitudes",
    "least_hover_thrust": "m·g", "largest_hover_thrust": "m·g", "peak_rate": "rad/s", "peak_acceleration": "rad/s²",
}  # fmt: skip


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

    Hover thrusts and the least singular value are those of level flight, with exact coefficients, as the margins are.
    The exit code does not depend on the verdicts.
    """
    from gaitgraph.plots.axes import blank_figure, check_pictures, write_pictures
    from gaitgraph.plots.gaits import draw_sheet
    from gaitgraph.timing.timed_gait import timed_gait_of

    check_pictures(outputs, force=force)
    names = (first, second)
    with Working("comparing"):
        gaits = [timed_gait_of(name, **given) for name in names]
        found = [{"gait": name, **_numbers(timed)} for name, timed in zip(names, gaits, strict=True)]
        if outputs:
            draw_sheet(figure := blank_figure(400.0, 172.0), gaits, names)
            write_pictures(figure, outputs, force=force)
    if wants_json():
        plain = [
            {name: None if isinstance(value, float) and not isfinite(value) else value for name, value in one.items()}
            for one in found
        ]
        print_json({"gaits": plain, "outputs": list(outputs)})
        return 0
    rows = [(name, *(_text(one[name]) for one in found)) for name in found[0] if name != "reason"]
    width = 2 + max(len(left) for _, left, _ in rows)
    for name, left, right in rows:
        unit = f" ({_UNITS[name]})" if name in _UNITS else ""
        click.echo(f"{name.removesuffix('_deg').replace('_', ' ') + unit:<36}{left:<{width}}{right}")
    for one in found:
        if one["reason"]:
            click.echo(f"{one['gait']} is not flyable: {one['reason']}")
    for name in outputs:
        click.echo(f"wrote {name}")
    return 0


def _numbers(timed: TimedGait) -> dict[str, Any]:
    """Return what is compared of a gait as plain values; None or NaN for what does not exist."""
    from gaitgraph.invertibility.segment_bounds import thrust_shares_along
    from gaitgraph.robustness.biased import robustness_of

    gait, report, robustness = timed.gait, timed.check(), robustness_of(timed, curves=1).gait.as_mapping()
    least, (_, _, largest) = report["hover_thrust"].value, thrust_shares_along(gait.alpha, gait.ends, gait.vehicle)
    return {
        **{name: getattr(report, name) for name in ("flyable", "valid", "reachable_from_hover", "reason")},
        "vehicle": gait.vehicle.name,
        "color": gait.color,
        "length": gait.length,
        "period": timed.period,
        "least_singular_value": report["least_singular_value"].value,
        **{name: robustness[name] for name in ("tilt_margin_deg", "acceptable_fraction")},
        "least_hover_thrust": least,
        "largest_hover_thrust": None if least is None else -float(largest.upper.min()),  # NaN unless all are positive
        "peak_rate": report["tilt_rate"].value,
        "peak_acceleration": report["tilt_acceleration"].value,
    }


def _text(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return value if isinstance(value, str) else "none" if value is None or isnan(value) else f"{value:.4g}"
