"""The command cycles: list closed cycles of the graph, one by one."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from gaitgraph.cli.commands import command
from gaitgraph.cli.options import (
    Choice,
    a_file,
    angle_not_negative,
    json_option,
    keep_options,
    name_option,
    polygons_from_texts,
    setting_options,
    stated,
    waypoints_from_texts,
)
from gaitgraph.cli.terminal import print_json, working

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["cycles_command"]


@command("Closed cycles of the graph, shortest first.")
@click.argument("request_file", metavar="[REQUEST.toml]", required=False, shell_complete=a_file())
@click.option("--waypoint", "waypoints", multiple=True, metavar="A1,A2", help="Only through these; repeat in order.")
@click.option("--any-order", is_flag=True, help="Through the waypoints in any order.")
@keep_options
@click.option("--max-length", metavar="ANGLE", help="No longer ones, in the (α1, α2) plane.")
@click.option("--limit", type=click.IntRange(1, 10**9), default=20, metavar="N", help="So many.  [default: 20]")
@name_option("--color", "auto (both), red or blue.  [default: auto]")
@name_option("--sign", "Sign of R: auto (both), positive or negative.  [default: auto]")
@click.option("--divisions", type=int, metavar="N", help="Grid pieces of [−π/2, π/2].  [default: 16]")
@click.option(
    "--require",
    type=Choice(["flyable", "valid", "two_color"]),
    default="valid",
    help="Which edges of the graph count.  [default: valid]",
)
@click.option(
    "--effort", type=click.IntRange(min=1), metavar="STEPS", help="Give up then, telling the bound.  [default: none]"
)
@setting_options
@json_option
def cycles_command(
    request_file: str | None,
    waypoints: Sequence[str],
    max_length: str | None,
    limit: int,
    require: Any,
    effort: int | None,
    as_json: bool,
    **options: Any,
) -> int:
    """List simple closed cycles of the surface graph, the shortest first, each with its verdict.

    They are found one by one and printed at once, as text or as one JSON object a line; interrupt as you like. With
    waypoints, from options or a request file, only cycles that pass them. The exit code is 1 if there is none.
    """
    from itertools import islice
    from math import isfinite

    from gaitgraph.graph.catalog import catalog
    from gaitgraph.planning.request import read_request, request_from_mapping, stated_fields

    asked = stated(options)
    polygons_from_texts(asked)
    if waypoints:
        asked["waypoints"] = waypoints_from_texts(waypoints)
    through = bool(waypoints) or (request_file is not None and "waypoints" in stated_fields(request_file))
    if not through:
        # The whole region counts; a request has at least one waypoint, which then plays no part.
        asked["waypoints"] = [(0.0, 0.0)]
    request, _ = request_from_mapping(asked) if request_file is None else read_request(request_file, asked)
    longest = None if max_length is None else angle_not_negative(max_length, "max_length")
    with working("building the graph") as progress:
        found = catalog(
            request,
            through=through,
            max_length=longest,
            use=require,
            effort=effort,
            progress=progress,
        )
        for note in found.notes:
            with progress.aside():
                click.echo(f"warning: {note}", err=True)
        progress("searching cycles")
        for cycle in islice(found, limit):
            with progress.aside():
                if as_json:
                    print_json(cycle.as_mapping())
                else:
                    click.echo(str(cycle))
    if found.found:
        click.echo(found.told(), err=True)
        return 0
    with working("searching a shortest cycle"):
        best, bound, reason = found.best(effort=effort or 1_000_000)
    if best is not None:
        exact = best.length <= bound
        if as_json:
            print_json({**best.as_mapping(), "exact": exact, "bound": bound})
        else:
            click.echo(str(best))
        proof = "a shortest one" if exact else f"not proven shortest: none is shorter than {bound:.4f} rad"
        click.echo(f"the best one found, {proof}", err=True)
        return 0
    if as_json:
        unknown = {} if found.complete else {"bound": bound if isfinite(bound) else None}
        print_json({"status": "none" if found.complete else "unfinished", "reason": reason, **unknown})
    else:
        click.echo(f"{'No cycle' if found.complete else 'Unfinished'}: {reason}")
    return 1
