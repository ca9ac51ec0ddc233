"""What commands read: requests, from files and options, and gaits."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from gaitgraph.cli.options import PAPER_GAITS

if TYPE_CHECKING:
    from gaitgraph.gait.given import GaitLike
    from gaitgraph.io.servo_map import ServoMap
    from gaitgraph.planning.request import PlanRequest


def stated_options() -> dict[str, Any]:
    """Return the options and arguments of the command that runs which the user stated; the others are at their defaults."""
    ctx = click.get_current_context()
    return {
        name: value
        for name, value in ctx.params.items()
        if ctx.get_parameter_source(name) is ParameterSource.COMMANDLINE
    }


def request_of(
    request_file: str | None, *, needs_waypoints: bool = False
) -> tuple[PlanRequest, dict[str, Any]]:
    """Return the request of a file, whose fields the options that are stated replace, and its sampling."""
    from gaitgraph.planning.request import (
        REQUEST_FIELDS,
        read_request,
        request_from_mapping,
        stated_request,
    )

    in_file = {}
    if request_file is not None:
        in_file = stated_request(request_file)
    fields = {*REQUEST_FIELDS, "samples", "rate"}
    stated = {name: value for name, value in stated_options().items() if name in fields}
    has_waypoints = "waypoints" in in_file or "waypoints" in stated
    if needs_waypoints and request_file is None and not has_waypoints:
        raise click.UsageError("a request file or --waypoint A1,A2 must be given")
    if not (needs_waypoints or has_waypoints):
        stated["waypoints"] = [(0.0, 0.0)]  # a request needs one to be read
    if request_file is None:
        request, sampling = request_from_mapping(stated)
    else:
        request, sampling = read_request(request_file, stated)
    if not (needs_waypoints or has_waypoints):
        request = replace(request, waypoints=())
    return request, sampling


def gait_in(
    gait_file: str,
    *,
    once: bool = False,
    joints: ServoMap | None = None,
    **fields: Any,
) -> GaitLike:
    """Return the gait that a GAIT_FILE stands for: of a request the one planned, else what its name says.

    Those of the `fields` that are not None replace those of a request. With `once` it is its table as a path, read with
    `joints`.
    """
    from gaitgraph.gait.given import GivenGait
    from gaitgraph.io.formats import holds_request, read_table
    from gaitgraph.planning.planner import planned_gait

    if once:
        check_is_table(gait_file, "--once")
        return read_table(gait_file, joints=joints).once()
    if gait_file in PAPER_GAITS or not holds_request(gait_file):
        return gait_file
    stated = {name: value for name, value in fields.items() if value is not None}
    return GivenGait(source=planned_gait(gait_file, stated))


def check_is_table(gait_file: str, flag: str) -> None:
    """Raise UsageError if a flag that needs the rows of a table is given with a gait of the paper."""
    if gait_file in PAPER_GAITS:
        raise click.UsageError(
            f"{flag} must be given with a table of rows, got {gait_file}"
        )
