"""The command compare: two gaits side by side."""

from __future__ import annotations

from math import isfinite, isnan
from typing import TYPE_CHECKING, Any

import click

from gaitgraph.cli.inputs import gait_in
from gaitgraph.cli.options import (
    PAPER_GAITS,
    FileOr,
    common_options,
    period_of_file_option,
    picture_outputs_options,
)
from gaitgraph.cli.output import lines_of_outputs, tell, working

if TYPE_CHECKING:
    from gaitgraph.invertibility.coefficients import Kind
    from gaitgraph.timing.timed_gait import TimedGait
    from gaitgraph.vehicle import Vehicle

_UNITS = {
    "length": "rad",
    "period": "s",
    "tilt_margin_deg": "degrees",
    "acceptable_fraction": "of attitudes",
    "servo_margin_deg": "degrees",
    "drag_margin": "of the drag ratio",
    "least_hover_thrust": "m·g",
    "largest_hover_thrust": "m·g",
    "hover_power": "of level hover",
    "peak_rate": "rad/s",
    "peak_acceleration": "rad/s²",
}


@click.command(
    "compare", short_help="Two gaits side by side: verdicts, margins, thrusts, rates."
)
@click.argument("first", metavar="A", type=FileOr(*PAPER_GAITS))
@click.argument("second", metavar="B", type=FileOr(*PAPER_GAITS))
@period_of_file_option
@picture_outputs_options
@common_options
def compare_command(
    first: str,
    second: str,
    period: float | None,
    outputs: tuple[str, ...],
    force: bool,
    vehicle: Vehicle | None,
    coefficients: Kind | None,
) -> int:
    """Compare two gaits, each in any form that the other commands take.

    Hover thrusts and the least singular value are those of level flight, with exact coefficients, as the margins are.
    The exit code does not depend on the verdicts.
    """
    from gaitgraph.plots.axes import blank_figure, check_pictures, write_pictures
    from gaitgraph.plots.gaits import draw_sheet
    from gaitgraph.timing.timed_gait import timed_gait_of

    check_pictures(outputs, force=force)
    names = (first, second)
    gaits = []
    rows = []
    with working("comparing"):
        for name in names:
            source = gait_in(
                name, vehicle=vehicle, coefficients=coefficients, period=period
            )
            gait = timed_gait_of(
                source, vehicle=vehicle, coefficients=coefficients, period=period
            )
            gaits.append(gait)
            rows.append({"gait": name, **_numbers(gait)})
        if outputs:
            figure = blank_figure(400.0, 172.0)
            draw_sheet(figure, gaits, names)
            write_pictures(figure, outputs, force=force)
    plain = [
        {name: _finite_or_none(value) for name, value in row.items()} for row in rows
    ]
    return tell(
        {"gaits": plain, "outputs": list(outputs)},
        [*_lines_of(*rows), *lines_of_outputs(outputs)],
    )


def _numbers(timed: TimedGait) -> dict[str, Any]:
    """Return what is compared of a gait as plain values; None or NaN for what does not exist."""
    from gaitgraph.invertibility.segment_bounds import thrust_shares_along
    from gaitgraph.robustness.biased import robustness_of

    gait = timed.gait
    report = timed.check()
    robustness = robustness_of(timed, curves=1).gait.as_mapping()
    least_thrust = report["hover_thrust"].value
    largest_thrust = None
    if least_thrust is not None:  # NaN unless all are positive
        _, _, largest = thrust_shares_along(gait.alpha, gait.ends, gait.vehicle)
        largest_thrust = -float(largest.upper.min())
    return {
        "flyable": report.flyable,
        "valid": report.valid,
        "reachable_from_hover": report.reachable_from_hover,
        "not_judged": report.not_judged,
        "reason": report.reason,
        "vehicle": gait.vehicle.name,
        "color": gait.color,
        "length": gait.length if timed.repeats else gait.length / 2,
        "period": timed.period,
        "least_singular_value": report["least_singular_value"].value,
        "tilt_margin_deg": robustness["tilt_margin_deg"],
        "acceptable_fraction": robustness["acceptable_fraction"],
        "servo_margin_deg": robustness["servo_margin_deg"],
        "drag_margin": robustness["drag_margin"],
        "least_hover_thrust": least_thrust,
        "largest_hover_thrust": largest_thrust,
        "hover_power": report.hover_power,
        "peak_rate": report["tilt_rate"].value,
        "peak_acceleration": report["tilt_acceleration"].value,
    }


def _finite_or_none(value: Any) -> Any:
    if isinstance(value, float) and not isfinite(value):
        return None
    return value


def _lines_of(left: dict[str, Any], right: dict[str, Any]) -> list[str]:
    """Return a line for each number of two gaits, and why one is not flyable."""
    texts = {
        name: (_text(left[name]), _text(right[name]))
        for name in left
        if name != "reason"
    }
    width = 2 + max(len(text) for text, _ in texts.values())
    lines = []
    for name, (text, other) in texts.items():
        title = name.removesuffix("_deg").replace("_", " ")
        if name in _UNITS:
            title += f" ({_UNITS[name]})"
        lines.append(f"{title:<36}{text:<{width}}{other}")
    refused = [row for row in (left, right) if row["reason"]]
    lines += [f"{row['gait']} is not flyable: {row['reason']}" for row in refused]
    return lines


def _text(value: Any) -> str:
    from gaitgraph.validation.report import limited_quantities

    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, tuple):
        return limited_quantities(value) or "nothing"
    if isinstance(value, str):
        return value
    if value is None or isnan(value):
        return "none"
    return f"{value:.4g}"
