"""The commands pace and transition: the least period of a gait, and paths between gaits and hover."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import click

from gaitgraph.cli.inputs import gait_in
from gaitgraph.cli.options import (
    PAPER_GAITS,
    SECONDS,
    Angle,
    FileOr,
    anyway_option,
    certify_option,
    common_options,
    gait_file_argument,
    gait_outputs_options,
    require_option,
    sampling_options,
)
from gaitgraph.cli.output import (
    certificates_beside,
    check_outputs,
    show,
    working,
    write_outputs,
)

if TYPE_CHECKING:
    from gaitgraph.cli.options import Chosen
    from gaitgraph.timing.servo_lag import ServoResponse
    from gaitgraph.timing.time_optimal import Origin
    from gaitgraph.timing.timed_gait import TimedGait


@click.command(
    "transition", short_help="A path from hover to a gait, back, or from gait to gait."
)
@click.argument("start", metavar="FROM", type=FileOr("hover", *PAPER_GAITS))
@click.argument("end", metavar="TO", type=FileOr("hover", *PAPER_GAITS))
@require_option
@gait_outputs_options
@common_options
def transition_command(
    start: str,
    end: str,
    require: str,
    outputs: tuple[str, ...],
    force: bool,
    chosen: Chosen,
) -> int:
    """Find a path on the surface from FROM to TO, each a gait file or the word hover.

    A table is left and joined at its first row, gait1 to gait4 at a corner. Where a gait is in motion at its first row,
    it speeds up gradually after the path, and slows down gradually before it. The exit code is 1, with the proof, if there is
    no path: between R > 0, where hover is, and R < 0 every path passes a singular matrix. It is also 1, and nothing is
    written, if the path is not flyable (or not valid, with --require valid).
    """
    from gaitgraph.planning.transitions import transition
    from gaitgraph.timing.joining import HOVER

    def end_of(name: str) -> Any:
        if name.lower() == HOVER:
            return HOVER
        return gait_in(name, **chosen)

    check_outputs(outputs, force=force)
    with working("searching a path"):
        answer = transition(end_of(start), end_of(end), **chosen)
        if not answer:
            return show(answer)
        is_wanted = getattr(answer.report, require)
        lines = []
        if outputs and is_wanted:
            write_outputs(answer.table, outputs, force=force)
            lines = [f"wrote {name}" for name in outputs]
    return show(answer, lines=lines, ok=is_wanted)


@click.command(
    "pace", short_help="The least period of a gait under limits of the servos."
)
@gait_file_argument
@click.option(
    "--period",
    type=SECONDS,
    metavar="SECONDS",
    show_default="the least",
    help="Period of the gait.",
)
@click.option(
    "--max-rate",
    type=Angle(is_positive=True),
    show_default="the vehicle's",
    help="Largest tilt rate, an angle per second.",
)
@click.option(
    "--max-acceleration",
    type=Angle(is_positive=True),
    show_default="the vehicle's",
    help="Largest tilt acceleration, an angle per second squared.",
)
@click.option(
    "--rounding",
    type=Angle(is_positive=True),
    show_default="what the file says, else rest at corners",
    help="Largest distance by which corners are rounded.",
)
@sampling_options
@certify_option
@gait_outputs_options
@require_option
@anyway_option
@common_options
def pace_command(
    gait_file: str,
    period: float | None,
    max_rate: float | None,
    max_acceleration: float | None,
    rounding: float | None,
    samples: int | None,
    rate: float | None,
    certify: bool,
    outputs: tuple[str, ...],
    force: bool,
    require: str,
    anyway: bool,
    chosen: Chosen,
) -> int:
    """Find the time-optimal timing law of a gait file, a request's gait or gait1 to gait4, or one for a given period.

    A timing law maps time to position along the loop. This one is twice continuously differentiable, periodic, and
    keeps the limits between samples too. It rests at every corner unless corners are rounded. The exit code is 1 if no
    law meets the limits in the period. It is also 1, and nothing is written, if the motion is not flyable (or not valid,
    with --require valid) and outputs are asked for without --anyway.
    """
    from gaitgraph.certificates import making
    from gaitgraph.timing.limits import limits_of
    from gaitgraph.timing.time_optimal import least_period, paced
    from gaitgraph.timing.timed_gait import table_of
    from gaitgraph.validation.report import unlikely_limits, verdict_of
    from gaitgraph.validation.validating import validate
    from gaitgraph.validation.worst import both

    check_outputs(outputs, force=force)
    certificates = certificates_beside(outputs, certify=certify, force=force)
    with working(f"reading {gait_file}") as progress:
        origin = _origin_of(gait_file, chosen)
        progress("pacing")
        limits = limits_of(
            origin.gait.vehicle,
            origin.limits,
            rate=max_rate,
            acceleration=max_acceleration,
        )
        find_law = least_period if period is None else partial(paced, period=period)
        if rounding is None:
            rounding = origin.rounding
        pacing = find_law(
            origin.gait,
            limits,
            rounding=rounding,
            samples=samples,
            rate=rate,
            progress=progress,
        )
        warnings = unlikely_limits(pacing.limits.as_mapping())
        lines = [f"warning: {warning}" for warning in warnings]
        timed = pacing.timed
        more: dict[str, Any] = {"servo": None, "outputs": [], "warnings": warnings}
        if timed is None:
            more |= dict.fromkeys(verdict_of(None))
            return show(pacing, more=more, lines=lines)
        table = table_of(timed)
        report = both(timed.check(), validate(table))
        is_refused = bool(outputs) and not (getattr(report, require) or anyway)
        if is_refused:
            lines.append("nothing is written")
            outputs = ()
            certificates = []
        lines.append(f"  {report.verdict}")
        new_warnings = [text for text in report.warnings if text not in warnings]
        lines += [f"warning: {warning}" for warning in new_warnings]
        if not report.flyable:
            lines.append(f"  not flyable: {report.reason}")
        response = _response_of(timed)
        if response is not None:
            lines.append(f"  {response}")
            more["servo"] = response.as_mapping()
        if certificates:
            certificate = making.certify(timed)
        if outputs:
            write_outputs(table, outputs, force=force, rate=rate)
        for path in certificates:
            certificate.write(path, force=force)
        lines += [f"wrote {name}: {timed.samples + 1} rows" for name in outputs]
        lines += [f"wrote {path}" for path in certificates]
    more |= verdict_of(report)
    more |= {"outputs": list(outputs), "warnings": warnings + new_warnings}
    return show(pacing, more=more, lines=lines, ok=bool(pacing) and not is_refused)


def _origin_of(gait_file: str, chosen: Chosen) -> Origin:
    """Return the path of a gait file and what it was made for; raise unless it is on one plane, if there are planes."""
    from gaitgraph.errors import InputError
    from gaitgraph.timing.time_optimal import origin_of

    source = gait_in(gait_file, **chosen)
    origin = origin_of(source, **chosen)
    has_planes = origin.gait.vehicle.asymmetry is None
    if has_planes and origin.gait.color not in ("red", "blue"):
        why = f"gaitgraph validate {gait_file} says why"
        remedy = f"{why}, gaitgraph retarget {gait_file} moves it there"
        raise InputError(
            f"{gait_file} must be a gait on one sheet, red or blue; {remedy}"
        )
    return origin


def _response_of(timed: TimedGait) -> ServoResponse | None:
    """Return how lagging servos follow; None if the vehicle does not state their time constant."""
    from gaitgraph.timing.servo_lag import servo_response

    lag: Any = timed.gait.vehicle.servo_lag
    if lag is None:
        return None
    return servo_response(timed, lag)
