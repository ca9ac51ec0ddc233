"""The command pace: how quickly a gait can be run under limits, and the table of the law that does."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import click

from gaitgraph.cli.commands import command
from gaitgraph.cli.options import (
    a_file,
    a_word,
    force_option,
    json_option,
    outputs_option,
    setting_options,
    vehicle_or_none,
)
from gaitgraph.cli.terminal import print_json, print_text, working
from gaitgraph.errors import InputError, did_you_mean

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

__all__ = ["pace_command"]


@command("The least period of a gait under limits of rate, acceleration and jerk.")
@click.argument("gait_file", metavar="GAIT_FILE", shell_complete=a_file())
@click.option(
    "--period",
    metavar="SECONDS",
    default="least",
    shell_complete=a_word("least"),
    help="Period T, or least.  [default: least]",
)
@click.option("--max-rate", metavar="ANGLE", help="Largest tilt rate per second.  [default: the vehicle's]")
@click.option("--max-acceleration", metavar="ANGLE", help="Per second squared.  [default: the vehicle's]")
@click.option("--max-jerk", metavar="ANGLE", help="Per second cubed.  [default: the vehicle's]")
@click.option("--rounding", metavar="ANGLE", help="Round corners by so much.  [default: rest at corners]")
@click.option("--servo-lag", type=float, metavar="SECONDS", help="Time constant.  [default: the vehicle's, if any]")
@click.option("--samples", type=int, metavar="N", help="Even intervals per period.  [default: 100]")
@click.option("--rate", type=float, metavar="HZ", help="Samples per second, instead of --samples.")
@outputs_option
@force_option
@setting_options
@json_option
def pace_command(
    gait_file: str,
    period: str,
    max_rate: str | None,
    max_acceleration: str | None,
    max_jerk: str | None,
    rounding: str | None,
    servo_lag: float | None,
    samples: int | None,
    rate: float | None,
    outputs: Sequence[str],
    force: bool,
    vehicle: str | None,
    coefficients: Any,
    as_json: bool,
) -> int:
    """Find the fastest smooth law for a gait table of any format or a saved plan, or a law for a given period.

    The law is twice continuously differentiable, closed at the seam, and keeps its limits between samples too. It
    rests at every corner unless corners are rounded. The exit code is 1 if no law meets the limits in the period.
    """
    from gaitgraph.angles import angle_from_text
    from gaitgraph.io.reading import read_gait
    from gaitgraph.io.writing import check_outputs
    from gaitgraph.timing.limits import limits_of
    from gaitgraph.timing.servo_lag import servo_response
    from gaitgraph.timing.time_optimal import least_period, paced

    check_outputs(outputs, force=force)
    seconds = _seconds(period)
    with working(f"reading {gait_file}") as progress:
        gait = read_gait(gait_file, vehicle=vehicle_or_none(vehicle), coefficients=coefficients)
        if gait.color not in ("red", "blue"):
            raise InputError(
                f"{gait_file}: not on one sheet; allowed is a gait on the red or the blue one: "
                f"gaitgraph retarget {gait_file} moves a table there"
            )
        stated = {"rate": max_rate, "acceleration": max_acceleration, "jerk": max_jerk}
        with _named(**{f"max_{kind}": (kind, value) for kind, value in stated.items()}):
            limits = limits_of(gait.vehicle, **stated)
        asked: dict[str, Any] = {"samples": samples, "rate": rate, "progress": progress}
        progress("pacing")
        if rounding is not None:
            asked["rounding"] = angle_from_text(rounding, "--rounding")
        with _named(rounding=("tolerance", rounding)):
            pacing = least_period(gait, limits, **asked) if seconds is None else paced(gait, limits, seconds, **asked)
        answer: dict[str, Any] = {**pacing.as_mapping(), "valid": None, "flyable": None, "servo": None, "outputs": []}
        lines = [str(pacing)]
        if pacing.timed is not None:
            report = pacing.timed.check()
            answer |= {"valid": report.valid, "flyable": report.flyable}
            if not report.flyable:
                lines.append(f"  not flyable: {report.reason}")
            lag = gait.vehicle.servo_lag if servo_lag is None else servo_lag
            if lag is not None:
                with _named(servo_lag=("lag", servo_lag)):
                    response = servo_response(pacing.timed, lag)
                answer["servo"] = response.as_mapping()
                lines.append(f"  {response}")
            if outputs:
                pacing.timed.write(*outputs, force=force)
                answer["outputs"] = list(outputs)
                lines += [f"wrote {name}: {pacing.timed.samples + 1} rows" for name in outputs]
    if as_json:
        print_json(answer)
    else:
        print_text("\n".join(lines))
    return 0 if pacing else 1


@contextmanager
def _named(**options: tuple[str, object]) -> Iterator[None]:
    """Let a message about a field name the option that gave it: ``--max-rate``, not ``rate``."""
    try:
        yield
    except InputError as error:
        for option, (field, value) in options.items():
            if value is not None and str(error).startswith(f"{field}: "):
                raise InputError(f"--{option.replace('_', '-')}{str(error)[len(field) :]}") from error
        raise


def _seconds(text: str) -> float | None:
    """Return the period of ``--period``, None for the least; InputError if it is neither."""
    if text == "least":
        return None
    try:
        return float(text)
    except ValueError:
        hint = did_you_mean(text, ["least"])
        raise InputError(f"--period: {text!r}; allowed is 'least' or a number of seconds{hint}") from None
