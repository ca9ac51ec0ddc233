"""The command compare: gaits side by side."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from gaitgraph.cli import PAPER_GAITS, Paths, Working, command, file, one_of, option, print_json, wants_json

if TYPE_CHECKING:
    from gaitgraph.timing.timed_gait import TimedGait

_ROWS = {
    "flyable": "flyable",
    "valid": "obeys the paper's rules",
    "reachable_from_hover": "reachable from hover",
    "color": "color",
    "length": "length (rad)",
    "period": "period (s)",
    "least_singular_value": "least singular value",
    "tilt_margin_deg": "tilt margin (°)",
    "acceptable_fraction": "acceptable attitudes",
    "least_hover_thrust": "least hover thrust (m·g)",
    "largest_hover_thrust": "largest hover thrust (m·g)",
    "peak_rate": "peak tilt rate (rad/s)",
    "peak_acceleration": "peak tilt acceleration (rad/s²)",
}


@command(
    "Two gaits side by side: verdicts, margins, thrusts, rates.",
    file("first", "A", *PAPER_GAITS),
    file("second", "B", *PAPER_GAITS),
    option("--period", "SECONDS", "Period T of both.  [default: what the files say, or 1]"),
    one_of("--law", "smooth", "constant-speed", "equal-time", default="what the files say"),
    option("--output", "FILE", "Draw both: .png, .svg or .pdf; repeatable.", name="outputs", multiple=True),
    "force vehicle coefficients json",
)
def compare_command(first: str, second: str, outputs: Paths = (), force: bool = False, **given: Any) -> int:
    """Compare two gaits, each in any form that the other commands take.

    Hover thrusts, in units of the weight, and the least singular value are in level flight.
    """
    from gaitgraph.plots.axes import check_pictures, write_pictures
    from gaitgraph.timing.timed_gait import timed_gait_of

    check_pictures(outputs, force=force)
    with Working("comparing") as progress:
        found = []
        for name in (first, second):
            progress(f"judging {name}")
            timed = timed_gait_of(name, **given)
            found.append((name, timed, _numbers(timed)))
        if outputs:
            from gaitgraph.plots.objects import compared

            progress(f"drawing {', '.join(outputs)}")
            write_pictures(lambda: compared([(name, timed) for name, timed, _ in found]), outputs, force=force)
    if wants_json():
        print_json({"gaits": [{"gait": name, **numbers} for name, _, numbers in found], "outputs": list(outputs)})
        return 0
    lines = [["", *(name for name, _, _ in found)]]
    lines += [[words, *(_text(numbers[key]) for *_, numbers in found)] for key, words in _ROWS.items()]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    for line in lines:
        click.echo("  ".join(text.ljust(width) for text, width in zip(line, widths, strict=True)).rstrip())
    reasons = [f"{name} is not flyable: {numbers['reason']}" for name, _, numbers in found if numbers["reason"]]
    for text in (*reasons, *(f"wrote {name}" for name in outputs)):
        click.echo(text)
    return 0


def _numbers(timed: TimedGait) -> dict[str, Any]:
    """Return what is compared of a gait as plain values; None for what does not exist."""
    from math import isfinite

    from gaitgraph.invertibility.segment_bounds import thrust_shares_along
    from gaitgraph.robustness.biased import robustness_of

    gait, report, robustness = timed.gait, timed.check(), robustness_of(timed, curves=1).gait.as_mapping()
    upward, least, largest = thrust_shares_along(gait.alpha, gait.ends, gait.vehicle)
    hovers = bool(upward.all()) and report["least_singular_value"].ok
    values = {
        "flyable": report.flyable,
        "valid": report.valid,
        "reachable_from_hover": report.reachable_from_hover,
        "reason": report.reason,
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
