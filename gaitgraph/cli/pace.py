"""The command pace: the shortest period of a gait under limits, and its table."""

from __future__ import annotations

from typing import Any

from gaitgraph.cli import Kind, Paths, Working, check_outputs, command, named_in_errors, option, show, write_outputs
from gaitgraph.errors import InputError

_PERIOD = Kind("a number of seconds or the word least", lambda text: None if text == "least" else float(text))


@command(
    "The least period of a gait (time-optimal) under limits of rate, acceleration and jerk.",
    "gait_file",
    option("--period", "SECONDS", "Period T, or least.  [default: least]", type=_PERIOD, words=["least"]),
    option("--max-rate", "ANGLE", "Largest tilt rate per second.  [default: the vehicle's]"),
    option("--max-acceleration", "ANGLE", "Per second squared.  [default: the vehicle's]"),
    option("--max-jerk", "ANGLE", "Per second cubed.  [default: the vehicle's]"),
    option("--rounding", "ANGLE", "Largest distance from a rounded corner.  [default: rest at corners]"),
    option("--servo-lag", "SECONDS", "Time constant.  [default: the vehicle's, if any]"),
    "samples rate certify outputs force vehicle coefficients json",
)
def pace_command(
    gait_file: str, period: float | None = None, outputs: Paths = (), force: bool = False, **given: Any
) -> int:
    """Find the time-optimal timing law of a gait file, a request's gait or gait1 to gait4, or one for a given period.

    A timing law maps time to position along the loop. This one is twice continuously differentiable, periodic, and
    keeps the limits between samples too. It rests at every corner unless corners are rounded. The exit code is 1 if no
    law meets the limits in the period.
    """
    from gaitgraph.certificates.making import certificates_beside, certify
    from gaitgraph.io.formats import gait_of
    from gaitgraph.timing.servo_lag import servo_response
    from gaitgraph.timing.time_optimal import least_period, limits_of, paced
    from gaitgraph.timing.timed_gait import pieces_of
    from gaitgraph.validation.report import unlikely_limits

    check_outputs(outputs, force=force)
    beside = certificates_beside(outputs, force=force) if given.get("certify") else []
    kinds = ("rate", "acceleration", "jerk")
    names = {kind: f"max_{kind}" for kind in kinds} | {"tolerance": "rounding", "lag": "servo_lag"}
    with Working(f"reading {gait_file}") as progress, named_in_errors(given, **names):
        gait = gait_of(gait_file, vehicle=given.get("vehicle"), coefficients=given.get("coefficients"))
        if gait.color not in ("red", "blue"):
            remedy = f"gaitgraph retarget {gait_file} moves it there"
            raise InputError(f"{gait_file} must be a gait on one sheet, red or blue; {remedy}")
        limits = limits_of(gait.vehicle, **{kind: given.get(f"max_{kind}") for kind in kinds})
        asked = {name: given[name] for name in ("samples", "rate", "rounding") if name in given}
        progress("pacing")
        if period is None:
            pacing = least_period(gait, limits, progress=progress, **asked)
        else:
            pacing = paced(gait, limits, period=period, progress=progress, **asked)
        warnings = unlikely_limits(limits.as_mapping())
        more: dict[str, Any] = {"valid": None, "flyable": None, "servo": None, "outputs": [], "warnings": warnings}
        lines = [f"warning: {warning}" for warning in warnings]
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
            certified = [(path, certify(timed)) for path in beside]
            if outputs:
                write_outputs(lambda: pieces_of(timed), outputs, force=force, rate=given.get("rate"))
            lines += [f"wrote {name}: {timed.samples + 1} rows" for name in outputs]
            for path, one in certified:
                one.write(path, force=force)
                lines.append(f"wrote {path}")
    return show(pacing, more=more, lines=lines)
