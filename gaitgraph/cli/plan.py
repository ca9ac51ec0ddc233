"""The command plan: find a closed gait through waypoints, and write it as a table."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from gaitgraph.cli import (
    Paths,
    Working,
    certificates_beside,
    check_outputs,
    command,
    flag,
    one_of,
    option,
    request_of,
    show,
    write_outputs,
)


@command(
    "Plan a closed gait through (α1, α2) waypoints.",
    "request_file waypoints color sign divisions",
    one_of("--objective", "shortest", "robust"),
    option(
        "--method",
        "NAME",
        "exact: the any-angle method, straight lines in any direction; grid: the paper's graph.  [default: exact; grid "
        "with --divisions]",
        words=("grid", "exact"),
    ),
    one_of(
        "--require",
        "flyable",
        "valid",
        of="What the gait must be (valid: by the paper's rules alone): ",
    ),
    "floor accuracy keep_in keep_out",
    flag("--any-order", "Visit the waypoints in the order that is shortest."),
    flag("--reverse", "Run the loop in the other direction."),
    "certify outputs period samples rate law force vehicle coefficients json",
)
def plan_command(
    request_file: str | None = None,
    outputs: Paths = (),
    force: bool = False,
    **given: Any,
) -> int:
    """Plan a closed gait through (α1, α2) waypoints, in order and back to the first.

    The request comes from a TOML or JSON file, or from a gait file of any format, which holds the request that it was
    made from; from options, or from both: options replace what the file says.
    The exit code is 1, with the reason, if there is no such gait.
    """
    from gaitgraph.planning.planner import VALID_LOOPS, plan
    from gaitgraph.timing.timed_gait import checked_clock, table_of

    check_outputs(outputs, force=force)
    beside = []
    if given.pop("certify", False):
        from gaitgraph.certificates.making import certify

        beside = certificates_beside(outputs, force=force)
    request, sampling = request_of(request_file, given)
    checked_clock(request.period, request.law, **sampling)
    with Working("planning") as progress:
        found = plan(request, progress=progress)
        written = tuple(outputs) if found else ()
        if written:
            progress(f"writing {', '.join(written)}")
            certified = [
                (path, certify(found.timed(**sampling), floor=request.floor))
                for path in beside
            ]
            write_outputs(
                table_of(found.timed(**sampling)),
                written,
                force=force,
                rate=sampling.get("rate"),
            )
            for path, one in certified:
                one.write(path, force=force)
            written += tuple(map(str, beside))
    if found.advice is not None:
        found = replace(found, advice=VALID_LOOPS.command_line)
    return show(
        found,
        lines=[*([""] if written else []), *(f"wrote {name}" for name in written)],
    )
