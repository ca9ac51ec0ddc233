"""The commands plan and transition: find a way on the surface, and write it as a table."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from gaitgraph.cli.commands import command
from gaitgraph.cli.options import (
    force_option,
    json_option,
    keep_options,
    outputs_option,
    polygons_from_texts,
    require_option,
    sampling_options,
    setting_options,
    stated,
    vehicle_or_none,
    waypoints_from_texts,
)
from gaitgraph.cli.terminal import MANY_DIVISIONS, print_json, progress_notes
from gaitgraph.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["plan_command", "transition_command"]


@command("Plan a closed gait through (α1, α2) waypoints.")
@click.argument("request_file", metavar="[REQUEST.toml]", required=False)
@click.option("--waypoint", "waypoints", multiple=True, metavar="A1,A2", help="A waypoint; repeat in order.")
@click.option("--color", metavar="NAME", help="auto, red or blue.  [default: auto]")
@click.option("--sign", metavar="NAME", help="Sign of R: auto, positive or negative.  [default: auto]")
@click.option("--divisions", type=int, metavar="N", help="Grid pieces of [−π/2, π/2].  [default: 16]")
@click.option("--objective", metavar="NAME", help="shortest, robust or thrust.  [default: shortest]")
@click.option(
    "--method",
    metavar="NAME",
    help="exact: any angle, the shortest; grid: the paper's graph.  [default: exact; grid with --divisions]",
)
@click.option("--sheets", metavar="NAME", help="planes, or all: fibres too, for A1,A2,A3,A4.  [default: planes]")
@click.option("--accuracy", type=float, metavar="ANGLE", help="Of curved borders, method exact, rad.  [default: 1e-6]")
@keep_options
@click.option("--any-order", is_flag=True, help="Visit the waypoints in the order that is shortest.")
@click.option("--reverse", is_flag=True, help="Run the loop the other way.")
@outputs_option
@sampling_options
@setting_options
@json_option
def plan_command(
    request_file: str | None,
    waypoints: Sequence[str],
    outputs: Sequence[str],
    force: bool,
    as_json: bool,
    **options: Any,
) -> int:
    """Plan a closed gait through (α1, α2) waypoints, in order and back to the first.

    The request comes from a TOML or JSON file, from options, or from both: options replace what the file says.
    The exit code is 1, with the reason, if there is no such gait.
    """
    from gaitgraph.planning import plan
    from gaitgraph.requests import read_request, request_from_mapping
    from gaitgraph.summary import text_of_plan
    from gaitgraph.tables import check_outputs, table_of, write_tables
    from gaitgraph.timing import checked_clock

    asked = stated(options)
    polygons_from_texts(asked)
    if waypoints:
        asked["waypoints"] = waypoints_from_texts(waypoints)
    if request_file is not None:
        request, sampling = read_request(request_file, asked)
    elif waypoints:
        request, sampling = request_from_mapping(asked)
    else:
        raise InputError("waypoints: none given; allowed is a request file, or --waypoint A1,A2 at least once")
    check_outputs(outputs, force=force)
    checked_clock(request.period, request.law, **sampling)
    result = plan(request, progress=progress_notes(at_once=request.divisions > MANY_DIVISIONS))
    if result and outputs:
        write_tables(table_of(result.timed(**sampling), {"request": request.as_mapping()}), outputs, force=force)
    if as_json:
        print_json(result.as_mapping())
    else:
        click.echo(text_of_plan(result, written=tuple(outputs) if result else ()))
    return 0 if result else 1


@command("A way from hover to a gait, back, or from gait to gait.")
@click.argument("start", metavar="FROM")
@click.argument("end", metavar="TO")
@click.option("--duration", type=float, metavar="SECONDS", help="One way.  [default: 1, or what the limits need]")
@click.option("--samples", type=int, metavar="N", help="Even intervals.  [default: 100]")
@click.option("--rate", type=float, metavar="HZ", help="Samples per second, instead of --samples.")
@click.option("--law", metavar="NAME", help="smooth, constant-speed or equal-time.  [default: smooth]")
@click.option("--divisions", type=int, metavar="N", help="Grid pieces of [−π/2, π/2].  [default: 16]")
@require_option
@outputs_option
@force_option
@setting_options
@json_option
def transition_command(
    start: str,
    end: str,
    require: str,
    outputs: Sequence[str],
    force: bool,
    vehicle: str | None,
    coefficients: Any,
    as_json: bool,
    **options: Any,
) -> int:
    """Find a way on the surface from FROM to TO, each a gait file or the word hover.

    A gait is left and joined at a corner. The exit code is 1, with the proof, if there is no way: between R > 0, where
    hover is, and R < 0 every flight passes a singular matrix.
    """
    from gaitgraph.exchange import read_gait
    from gaitgraph.tables import check_outputs
    from gaitgraph.transitions import HOVER, transition

    check_outputs(outputs, force=force)
    setting = {"vehicle": vehicle_or_none(vehicle), "coefficients": coefficients}
    ends: list[Any] = [HOVER if one.lower() == HOVER else read_gait(one, **setting) for one in (start, end)]
    given = {name: value for name, value in options.items() if value is not None}
    if ends == [HOVER, HOVER]:
        given |= setting
    result = transition(ends[0], ends[1], **given)
    if result and outputs:
        result.write(*outputs, force=force)
    if as_json:
        print_json(result.as_mapping())
    else:
        click.echo(str(result))
        for name in outputs if result else ():
            click.echo(f"wrote {name}")
    meets = result.report is not None and (require == "valid" or result.report.flyable)
    return 0 if meets else 1
