"""The command region: where waypoints lie, and whether a loop can join them."""

from __future__ import annotations

from typing import Any

from gaitgraph.cli import options
from gaitgraph.cli.terminal import Working, show


@options.command("In which part of the admissible region waypoints lie, and whether they can be joined.")
@options.request_file
@options.waypoints("A waypoint; repeatable.")
@options.choice("--use", ["flyable", "valid"], "flyable", "Where a gait can fly, or where R has the sign alone.")
@options.option("--color", "NAME", "red or blue.  [default: red]", words=("red", "blue"))
@options.sign
@options.floor
@options.accuracy
@options.keep
@options.setting
@options.as_json
def region_command(use: Any, request_file: str | None = None, as_json: bool = False, **given: Any) -> int:
    """Say in which part of the admissible region each waypoint lies, or why in none and which point is nearest.

    The exit code is 1 if no part holds them all, so that no closed gait can pass them.
    """
    from gaitgraph.planning.any_angle import location_of

    request, _ = options.request_of(request_file, given)
    with Working("computing the region"):
        found = location_of(request, use=use)
    show(found, as_json=as_json)
    return 0 if found else 1
