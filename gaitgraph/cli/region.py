"""The command region: where waypoints lie, and whether a loop can join them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from gaitgraph.cli.commands import command
from gaitgraph.cli.options import (
    Choice,
    a_file,
    json_option,
    keep_options,
    name_option,
    polygons_from_texts,
    setting_options,
    stated,
    waypoints_from_texts,
)
from gaitgraph.cli.terminal import print_json, print_text, working
from gaitgraph.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["region_command"]


@command("In which part of the admissible region waypoints lie, and whether they can be joined.")
@click.argument("request_file", metavar="[REQUEST.toml]", required=False, shell_complete=a_file())
@click.option("--waypoint", "waypoints", multiple=True, metavar="A1,A2", help="A waypoint; repeatable.")
@click.option(
    "--use",
    type=Choice(["flyable", "valid"]),
    default="flyable",
    help="Where a gait can fly, or where R has the sign alone.  [default: flyable]",
)
@name_option("--color", "red or blue.  [default: red]")
@name_option("--sign", "Sign of R: auto (both), positive or negative.  [default: auto]")
@click.option("--floor", type=float, metavar="X", help="Least singular value to keep.  [default: 0.05]")
@click.option("--accuracy", type=float, metavar="ANGLE", help="Of curved borders, rad.  [default: 1e-6]")
@keep_options
@setting_options
@json_option
def region_command(request_file: str | None, waypoints: Sequence[str], use: Any, as_json: bool, **options: Any) -> int:
    """Say in which part of the admissible region each waypoint lies, or why in none and which point is nearest.

    The exit code is 1 if no part holds them all, so that no closed gait can pass them.
    """
    from gaitgraph.planning.location import location_of
    from gaitgraph.planning.request import read_request, request_from_mapping

    asked = stated(options)
    polygons_from_texts(asked)
    if waypoints:
        asked["waypoints"] = waypoints_from_texts(waypoints)
    if request_file is not None:
        request = read_request(request_file, asked)[0]
    elif waypoints:
        request = request_from_mapping(asked)[0]
    else:
        raise InputError("waypoints: none given; allowed is a request file, or --waypoint A1,A2 at least once")
    with working("drawing the region"):
        found = location_of(request, use=use)
    if as_json:
        print_json(found.as_mapping())
    else:
        print_text(str(found))
    return 0 if found else 1
