"""The command plan: find a closed gait through waypoints, and write it as a table."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import click

from gaitgraph.cli.inputs import request_of
from gaitgraph.cli.options import (
    LAWS,
    SECONDS,
    certify_option,
    common_options,
    gait_outputs_options,
    request_file_argument,
    require_option,
    sampling_options,
    servo_margin_option,
    sign_option,
    waypoints_option,
)
from gaitgraph.cli.output import (
    certificates_beside,
    check_outputs,
    show,
    working,
    write_outputs,
)
from gaitgraph.explorer.words import CHOICES_IN_WORDS


@click.command("plan", short_help="Plan a closed gait through (α1, α2) waypoints.")
@request_file_argument
@waypoints_option
@click.option(
    "--color",
    type=click.Choice(["auto", "red", "blue"]),
    default="auto",
    help="Sheet of the surface.",
)
@sign_option
@click.option(
    "--divisions",
    type=int,
    default=16,
    help="Grid intervals in [−π/2, π/2].",
)
@click.option(
    "--objective",
    type=click.Choice(["shortest", "robust"]),
    default="shortest",
    help=CHOICES_IN_WORDS["objective"],
)
@click.option(
    "--method",
    type=click.Choice(["exact", "grid"]),
    show_default="exact; grid with --divisions",
    help=CHOICES_IN_WORDS["method"],
)
@require_option
@servo_margin_option
@click.option(
    "--any-order",
    is_flag=True,
    help="Visit the waypoints in the order of the shortest loop.",
)
@click.option("--reverse", is_flag=True, help="Run the loop in the other direction.")
@click.option(
    "--period", type=SECONDS, metavar="SECONDS", default=1.0, help="Period of the gait."
)
@sampling_options
@click.option(
    "--law",
    type=click.Choice(LAWS),
    default=LAWS[0],
    help=CHOICES_IN_WORDS["law"],
)
@certify_option
@gait_outputs_options
@common_options
def plan_command(
    request_file: str | None,
    outputs: tuple[str, ...],
    force: bool,
    certify: bool,
    **_: Any,  # fields of the request, which request_of reads
) -> int:
    """Plan a closed gait through (α1, α2) waypoints, in order and back to the first.

    The request is read from a TOML or JSON file, or from a gait file of any format, which holds the request that it was
    made from. Options replace what the file says; without a file they are the request. A file may also state polygons,
    the floor of the least singular value and the accuracy of curved borders.
    The exit code is 1, with the reason, if there is no such gait.
    """
    from gaitgraph.certificates import making
    from gaitgraph.planning.planner import VALID_LOOPS, plan
    from gaitgraph.timing.timed_gait import checked_clock, table_of

    check_outputs(outputs, force=force)
    certificates = certificates_beside(outputs, certify=certify, force=force)
    request, sampling = request_of(request_file, needs_waypoints=True)
    checked_clock(request.period, request.law, **sampling)
    written: list[object] = []
    with working("planning") as progress:
        answer = plan(request, progress=progress)
        if answer and outputs:
            progress(f"writing {', '.join(outputs)}")
            timed = answer.timed(**sampling)
            if certificates:
                certificate = making.certify(timed, floor=request.floor)
            table = table_of(timed)
            write_outputs(table, outputs, force=force, rate=sampling.get("rate"))
            for path in certificates:
                certificate.write(path, force=force)
            written = [*outputs, *certificates]
    if answer.advice == VALID_LOOPS.python:
        answer = replace(answer, advice=VALID_LOOPS.command_line)
    lines = [f"wrote {name}" for name in written]
    if written:
        lines.insert(0, "")
    return show(answer, lines=lines)
