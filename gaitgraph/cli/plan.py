"""The commands plan and transition: find a way on the surface, and write it as a table."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from gaitgraph.cli.commands import command
from gaitgraph.cli.options import (
    a_file,
    force_option,
    json_option,
    keep_options,
    name_option,
    outputs_option,
    polygons_from_texts,
    require_option,
    sampling_options,
    setting_options,
    stated,
    vehicle_or_none,
    waypoints_from_texts,
)
from gaitgraph.cli.terminal import print_json, print_note, print_problem, print_text, working
from gaitgraph.errors import GaitgraphError, InputError, did_you_mean

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gaitgraph.planning.plan import Plan

__all__ = ["plan_command", "transition_command"]


@command("Plan a closed gait through (α1, α2) waypoints.")
@click.argument("request_file", metavar="[REQUEST.toml]", required=False, shell_complete=a_file())
@click.option("--waypoint", "waypoints", multiple=True, metavar="A1,A2", help="A waypoint; repeat in order.")
@name_option("--color", "auto, red or blue.  [default: auto]")
@name_option("--sign", "Sign of R: auto, positive or negative.  [default: auto]")
@click.option("--divisions", type=int, metavar="N", help="Grid pieces of [−π/2, π/2].  [default: 16]")
@name_option("--objective", "shortest or robust.  [default: shortest]")
@name_option(
    "--method", "exact: any angle, the shortest; grid: the paper's graph.  [default: exact; grid with --divisions]"
)
@click.option("--accuracy", type=float, metavar="ANGLE", help="Of curved borders, method exact, rad.  [default: 1e-6]")
@keep_options
@click.option("--any-order", is_flag=True, help="Visit the waypoints in the order that is shortest.")
@click.option("--reverse", is_flag=True, help="Run the loop the other way.")
@click.option("--watch", is_flag=True, help="Plan again whenever the request file, or its vehicle's, changes.")
@outputs_option
@sampling_options
@setting_options
@json_option
def plan_command(
    request_file: str | None,
    waypoints: Sequence[str],
    outputs: Sequence[str],
    force: bool,
    watch: bool,
    as_json: bool,
    **options: Any,
) -> int:
    """Plan a closed gait through (α1, α2) waypoints, in order and back to the first.

    The request comes from a TOML or JSON file, or from a gait file of any format, which tells what made it; from
    options, or from both: options replace what the file says.
    The exit code is 1, with the reason, if there is no such gait. With --watch it is planned again until you interrupt;
    outputs are then replaced as long as nobody else has changed them.
    """
    from gaitgraph.cli.watching import OwnOutputs, changes, files_of_request
    from gaitgraph.planning.planner import plan
    from gaitgraph.planning.request import read_request, request_from_mapping
    from gaitgraph.timing.timed_gait import checked_clock, pieces_of

    asked = stated(options)
    polygons_from_texts(asked)
    if waypoints:
        asked["waypoints"] = waypoints_from_texts(waypoints)
    if watch and request_file is None:
        raise InputError("--watch: no request file to watch; allowed is with REQUEST.toml")
    if request_file is None and not waypoints:
        raise InputError("waypoints: none given; allowed is a request file, or --waypoint A1,A2 at least once")
    own = OwnOutputs(outputs, force=force, apart_from=[request_file] if watch and request_file else [])

    def show(result: Plan, written: Sequence[str]) -> None:
        if as_json:
            print_json(result.as_mapping())
        else:
            print_text("\n".join([str(result), *([""] if written else []), *(f"wrote {name}" for name in written)]))

    result: Plan | None = None
    rounds = changes(files_of_request(request_file, options["vehicle"])) if watch and request_file else [None]
    for number, _ in enumerate(rounds):
        if number and not as_json:
            click.echo()
        result = None
        try:
            request, sampling = (
                request_from_mapping(asked) if request_file is None else read_request(request_file, asked)
            )
            checked_clock(request.period, request.law, **sampling)
            with working("planning") as progress:
                result = plan(request, progress=progress)
                if result and outputs:
                    progress(f"writing {', '.join(outputs)}")
                    own.write(partial(pieces_of, result.timed(**sampling)))
            show(result, outputs if result else ())
        except GaitgraphError as error:
            # What is wrong at the start is as wrong as without --watch; later the file is being edited.
            if not number:
                raise
            if result:
                show(result, ())
            print_problem(str(error))
        else:
            if not result and own.own:
                print_problem(f"{', '.join(own.own)} holds the gait before; this request has none")
        if watch:
            print_note(f"watching {request_file}; Ctrl-C ends it")
    return 0 if result else 1


@command("A way from hover to a gait, back, or from gait to gait.")
@click.argument("start", metavar="FROM", shell_complete=a_file("hover"))
@click.argument("end", metavar="TO", shell_complete=a_file("hover"))
@click.option("--duration", type=float, metavar="SECONDS", help="One way.  [default: 1, or what the limits need]")
@click.option("--samples", type=int, metavar="N", help="Even intervals.  [default: 100]")
@click.option("--rate", type=float, metavar="HZ", help="Samples per second, instead of --samples.")
@name_option("--law", "smooth, constant-speed or equal-time.  [default: smooth]")
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
    from gaitgraph.io.reading import read_gait
    from gaitgraph.io.writing import check_outputs
    from gaitgraph.planning.transitions import HOVER, transition

    check_outputs(outputs, force=force)
    setting = {"vehicle": vehicle_or_none(vehicle), "coefficients": coefficients}
    given = {name: value for name, value in options.items() if value is not None}
    for name, one in (("FROM", start), ("TO", end)):
        hint = did_you_mean(one.lower(), [HOVER])
        if hint and one.lower() != HOVER and not Path(one).exists():
            raise InputError(f"{name}: {one!r}; allowed is a gait file, or the word hover{hint}")
    with working("searching a way"):
        ends: list[Any] = [HOVER if one.lower() == HOVER else read_gait(one, **setting) for one in (start, end)]
        if ends == [HOVER, HOVER]:
            given |= setting
        result = transition(ends[0], ends[1], **given)
        if result and outputs:
            result.write(*outputs, force=force)
    if as_json:
        print_json(result.as_mapping())
    else:
        print_text(str(result))
        for name in outputs if result else ():
            click.echo(f"wrote {name}")
    meets = result.report is not None and (require == "valid" or result.report.flyable)
    return 0 if meets else 1
