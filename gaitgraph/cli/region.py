"""The command region: the admissible regions, where waypoints lie in them, and whether a loop can join them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from gaitgraph.cli import Paths, Working, command, one_of, option, request_of, show


@command(
    "The admissible regions, and in which part of them waypoints lie.",
    "request_file waypoints",
    one_of("--use", "flyable", "valid", of="Region where a gait can fly, or where R has the sign: ", check=True),
    one_of("--color", "red", "blue"),
    "sign floor accuracy keep_in keep_out",
    option("--output", "FILE", "Draw the map: .png, .svg or .pdf; repeatable.", name="outputs", multiple=True),
    "force vehicle coefficients json",
)
def region_command(
    request_file: str | None = None, use: Any = "flyable", outputs: Paths = (), force: bool = False, **given: Any
) -> int:
    """List the parts of the admissible regions, or, with waypoints, report in which part each of them lies.

    A waypoint in none gets the reason and the nearest admissible point. The exit code is 1 if no part holds all
    waypoints, so that no closed gait passes them, or if there is no part.
    """
    from gaitgraph.planning.any_angle import location_of
    from gaitgraph.plots.axes import check_pictures
    from gaitgraph.plots.gaits import write_regions

    check_pictures(outputs, force=force)
    request, _ = request_of(request_file, given if request_file else {"waypoints": [(0.0, 0.0)], **given})
    if request_file is None and "waypoints" not in given:
        request = replace(request, waypoints=())
    with Working("computing the region"):
        found = location_of(request, use=use)
        if outputs:
            write_regions(found, request.vehicle, outputs, force=force)
    return show(found, lines=[f"wrote {name}" for name in outputs], more={"outputs": list(outputs)})
