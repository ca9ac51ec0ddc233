"""The command cycles: list closed cycles of the graph, one by one."""

from __future__ import annotations

from typing import Any

import click

from gaitgraph.cli import Working, command, one_of, option, print_json, request_of, show, wants_json, whole_from


@command(
    "Closed cycles of the graph, shortest first.",
    "request_file",
    "keep_in keep_out",
    option("--max-length", "ANGLE", "Longest cycle to list, measured in the (α1, α2) plane."),
    option("--limit", "N", "Number of cycles to list.  [default: 20]", type=whole_from(1, 10**9), default=20),
    "color sign divisions",
    one_of("--require", "flyable", "valid", "two_color", of="Edges that count: ", default="valid", check=True),
    option("--effort", "STEPS", "Steps after which to stop and print the bound.", type=whole_from(1, 10**18)),
    "vehicle coefficients json",
)
def cycles_command(
    limit: int,
    require: Any = "valid",
    request_file: str | None = None,
    max_length: float | None = None,
    effort: int | None = None,
    **given: Any,
) -> int:
    """List simple closed cycles of the surface graph, the shortest first, each with its verdict.

    Each is printed as soon as it is found, as text or as one line of JSON. Polygons confine them to a region; waypoints
    of a request file are not used. The exit code is 1 if there is none.
    """
    from itertools import islice

    from gaitgraph.planning.grid import grid_cycles
    from gaitgraph.planning.request import stated_request

    if request_file is not None and "waypoints" in stated_request(request_file):
        click.echo("warning: cycles do not use waypoints; plan --method grid finds a loop through them", err=True)
    given["waypoints"] = [(0.0, 0.0)]  # a request needs one
    request, _ = request_of(request_file, given)
    with Working("building the graph") as progress:
        found = grid_cycles(request, max_length=max_length, use=require, effort=effort, progress=progress)
    listed = islice(found, limit)
    while True:
        with Working("searching cycles"):
            cycle = next(listed, None)
        if cycle is None:
            break
        show(cycle)
    with Working("searching cycles"):
        found.look_ahead()
    if found.found:
        click.echo(str(found), err=True)
        return 0
    within = "" if max_length is None else f" within {max_length:g} rad"
    status, reason = "none", f"the graph has none{within}"
    if not found.complete:
        status = "unfinished"
        reason = f"none found in {found.steps} steps; any cycle is at least {found.bound:.4f} rad long"
    if wants_json():
        print_json({"status": status, "reason": reason, **({} if found.complete else {"bound": found.bound})})
    else:
        click.echo(f"{'No cycle' if found.complete else 'Unfinished'}: {reason}")
    return 1
