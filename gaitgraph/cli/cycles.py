"""The command cycles: list closed cycles of the graph, one by one."""

from __future__ import annotations

from typing import Any

import click

from gaitgraph.cli import Working, command, flag, one_of, option, print_json, request_of, show, wants_json, whole_from


@command(
    "Closed cycles of the graph, shortest first.",
    "request_file waypoints",
    flag("--any-order", "Through the waypoints in any order."),
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

    Each is printed as soon as it is found, as text or as one line of JSON. With waypoints, from options or a request
    file, only cycles that pass them are listed. The exit code is 1 if there is none.
    """
    from itertools import islice
    from math import isfinite

    from gaitgraph.planning.grid import grid_cycles
    from gaitgraph.planning.request import stated_request

    through = "waypoints" in given or (request_file is not None and "waypoints" in stated_request(request_file))
    if not through:
        # A request needs a waypoint; it is not used.
        given["waypoints"] = [(0.0, 0.0)]
    request, _ = request_of(request_file, given)
    with Working("building the graph") as progress:
        found = grid_cycles(
            request, through=through, max_length=max_length, use=require, effort=effort, progress=progress
        )
        for note in found.notes:
            with progress.aside():
                click.echo(f"warning: {note}", err=True)
        progress("searching cycles")
        for cycle in islice(found.cycles, limit):
            with progress.aside():
                show(cycle)
        found.cycles.look_ahead()
    if found.cycles.found:
        click.echo(str(found.cycles), err=True)
        return 0
    with Working("searching a shortest cycle"):
        best, bound, reason = found.best(effort=effort or 1_000_000)
    if best is not None:
        exact = best.length <= bound
        show(best, more={"exact": exact, "bound": bound})
        proof = "proven shortest" if exact else f"not proven shortest; lower bound {bound:.4f} rad"
        click.echo(f"best cycle found: {proof}", err=True)
        return 0
    if wants_json():
        unknown = {} if found.cycles.complete else {"bound": bound if isfinite(bound) else None}
        print_json({"status": "none" if found.cycles.complete else "unfinished", "reason": reason, **unknown})
    else:
        click.echo(f"{'No cycle' if found.cycles.complete else 'Unfinished'}: {reason}")
    return 1
