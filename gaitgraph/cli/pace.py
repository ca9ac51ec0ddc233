"""The command pace: the shortest period of a gait under limits, and its table."""

from __future__ import annotations

from typing import Any

import click

from gaitgraph.cli import options
from gaitgraph.cli.terminal import Working, show
from gaitgraph.errors import InputError, did_you_mean


def _seconds(_: click.Context, __: click.Parameter, text: str) -> float | None:
    """Return the period, None for the least."""
    if text == "least":
        return None
    try:
        return float(text)
    except ValueError:
        hint = did_you_mean(text, ["least"])
        raise InputError(f"--period must be a number of seconds or the word least, got {text!r}{hint}") from None


@options.command("The least period of a gait under limits of rate, acceleration and jerk.")
@options.gait_file
@options.option(
    "--period",
    "SECONDS",
    "Period T, or least.  [default: least]",
    type=click.STRING,
    default="least",
    callback=_seconds,
    shell_complete=lambda _, __, word: ["least"] if "least".startswith(word) else [],
)
@options.option("--max-rate", "ANGLE", "Largest tilt rate per second.  [default: the vehicle's]")
@options.option("--max-acceleration", "ANGLE", "Per second squared.  [default: the vehicle's]")
@options.option("--max-jerk", "ANGLE", "Per second cubed.  [default: the vehicle's]")
@options.option("--rounding", "ANGLE", "Round corners by so much.  [default: rest at corners]")
@options.option("--servo-lag", "SECONDS", "Time constant.  [default: the vehicle's, if any]")
@options.sampling
@options.outputs
@options.force
@options.setting
@options.as_json
def pace_command(
    gait_file: str,
    period: float | None = None,
    outputs: tuple[str, ...] = (),
    force: bool = False,
    as_json: bool = False,
    **given: Any,
) -> int:
    """Find the fastest smooth law for a gait table of any format or a saved plan, or a law for a given period.

    The law is twice continuously differentiable, closed at the seam, and keeps its limits between samples too. It
    rests at every corner unless corners are rounded. The exit code is 1 if no law meets the limits in the period.
    """
    from gaitgraph.io.reading import read_gait
    from gaitgraph.timing.servo_lag import servo_response
    from gaitgraph.timing.time_optimal import least_period, limits_of, paced
    from gaitgraph.timing.timed_gait import pieces_of

    options.check_outputs(outputs, force=force)
    kinds = ("rate", "acceleration", "jerk")
    names = {kind: f"max_{kind}" for kind in kinds} | {"tolerance": "rounding", "lag": "servo_lag"}
    with Working(f"reading {gait_file}") as progress, options.named_in_errors(given, **names):
        gait = read_gait(gait_file, vehicle=given.get("vehicle"), coefficients=given.get("coefficients"))
        if gait.color not in ("red", "blue"):
            raise InputError(
                f"{gait_file} must be a gait on one sheet, red or blue; gaitgraph retarget {gait_file} moves it there"
            )
        limits = limits_of(gait.vehicle, **{kind: given.get(f"max_{kind}") for kind in kinds})
        asked = {name: given[name] for name in ("samples", "rate", "rounding") if name in given}
        progress("pacing")
        if period is None:
            pacing = least_period(gait, limits, progress=progress, **asked)
        else:
            pacing = paced(gait, limits, period, progress=progress, **asked)
        more: dict[str, Any] = {"valid": None, "flyable": None, "servo": None, "outputs": []}
        lines = []
        timed = pacing.timed
        if timed is not None:
            report = timed.check()
            more |= {"valid": report.valid, "flyable": report.flyable, "outputs": list(outputs)}
            if not report.flyable:
                lines.append(f"  not flyable: {report.reason}")
            lag = given.get("servo_lag", gait.vehicle.servo_lag)
            if lag is not None:
                response = servo_response(timed, lag)
                more["servo"] = response.as_mapping()
                lines.append(f"  {response}")
            if outputs:
                options.write_outputs(lambda: pieces_of(timed), outputs, force=force)
            lines += [f"wrote {name}: {timed.samples + 1} rows" for name in outputs]
    show(pacing, as_json=as_json, more=more, lines=lines)
    return 0 if pacing else 1
