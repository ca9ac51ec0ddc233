"""The command region: where waypoints lie, and whether a loop can join them."""

from __future__ import annotations

from typing import Any

from gaitgraph.cli import Working, command, one_of, request_of, show


@command(
    "In which part of the admissible region waypoints lie, and whether they can be joined.",
    "request_file waypoints",
    one_of("--use", "flyable", "valid", of="Region where a gait can fly, or where R has the sign: ", check=True),
    one_of("--color", "red", "blue"),
    "sign floor accuracy keep_in keep_out vehicle coefficients json",
)
def region_command(request_file: str | None = None, use: Any = "flyable", **given: Any) -> int:
    """Report in which part of the admissible region each waypoint lies, or why in none and the nearest point of it.

    The exit code is 1 if no part holds them all: then no closed gait passes them.
    """
    from gaitgraph.planning.any_angle import location_of

    request, _ = request_of(request_file, given)
    with Working("computing the region"):
        found = location_of(request, use=use)
    return show(found)
