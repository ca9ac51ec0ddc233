"""The commands optimize and retarget: the best gait through discs, and the flyable gait nearest to a table."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import click

from gaitgraph.cli.commands import command
from gaitgraph.cli.options import (
    a_file,
    angle_not_negative,
    force_option,
    json_option,
    keep_options,
    name_option,
    outputs_option,
    polygons_from_texts,
    setting_options,
    stated,
    vehicle_or_none,
    waypoints_from_texts,
)
from gaitgraph.cli.terminal import print_json, print_text, working
from gaitgraph.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["optimize_command", "retarget_command"]


@command("The smooth gait through discs with the best worst case, or the least tilt-rate effort.")
@click.option("--waypoint", "waypoints", multiple=True, metavar="A1,A2", help="Centre of a disc; repeat in order.")
@click.option(
    "--radius", "radii", multiple=True, metavar="ANGLE", help="Of all discs, or repeat, one for each.  [default: 0.1]"
)
@name_option("--objective", "singular_value, hover_reserve or tilt_rate.  [default: singular_value]", "goal")
@name_option("--sign", "Sign of R: auto, positive or negative.  [default: auto]")
@click.option("--floor", type=float, metavar="X", help="Least singular value to keep.  [default: 0.05]")
@click.option("--period", type=float, metavar="SECONDS", help="Period T.  [default: 1]")
@click.option("--pieces", type=int, metavar="N", help="Pieces of the spline.  [default: 12 for each waypoint]")
@click.option(
    "--concession", type=float, metavar="X", help="Part of the worst case given up for less effort.  [default: 0.001]"
)
@click.option("--samples", type=int, metavar="N", help="Even intervals per period.  [default: 100]")
@click.option("--rate", type=float, metavar="HZ", help="Samples per second, instead of --samples.")
@keep_options
@outputs_option
@force_option
@setting_options
@json_option
def optimize_command(
    waypoints: Sequence[str],
    radii: Sequence[str],
    outputs: Sequence[str],
    samples: int | None,
    rate: float | None,
    force: bool,
    vehicle: str | None,
    as_json: bool,
    **options: Any,
) -> int:
    """Find the smooth closed gait that passes discs in order and is optimal along all of it.

    The answer says how far from the best possible it may be, and is checked between samples too. The exit code is 1,
    with the reason, if no flyable gait passes the discs.
    """
    from gaitgraph.io.writing import check_outputs, write_pieces
    from gaitgraph.optimization.optimize import optimal_gait
    from gaitgraph.timing.timed_gait import checked_clock
    from gaitgraph.vehicle import PAPER

    if not waypoints:
        raise InputError("waypoints: none given; allowed is --waypoint A1,A2 at least once")
    asked = stated(options)
    polygons_from_texts(asked)
    if radii:
        each = [angle_not_negative(text, "radius") for text in radii]
        asked["radius"] = each[0] if len(each) == 1 else each
    check_outputs(outputs, force=force)
    checked_clock(asked.get("period", 1.0), "smooth", samples=samples, rate=rate)
    with working("optimising"):
        found = optimal_gait(waypoints_from_texts(waypoints), vehicle=vehicle_or_none(vehicle) or PAPER, **asked)
        if found and outputs:
            write_pieces(partial(found.pieces, samples=samples, rate=rate), outputs, force=force)
    if as_json:
        print_json(found.as_mapping())
    else:
        print_text(str(found))
    return 0 if found else 1


@command("The flyable gait nearest to a given table, and what was changed.")
@click.argument("gait_file", metavar="GAIT_FILE", shell_complete=a_file())
@name_option("--sign", "Sign of R: auto (either), positive or negative.  [default: auto]")
@click.option("--floor", type=float, metavar="X", help="Least singular value to keep.  [default: 0.05]")
@click.option("--margin", metavar="ANGLE", help="Distance to keep from the flyable region's border.  [default: 0]")
@keep_options
@outputs_option
@force_option
@setting_options
@json_option
def retarget_command(
    gait_file: str,
    sign: str | None,
    margin: str | None,
    outputs: Sequence[str],
    force: bool,
    vehicle: str | None,
    as_json: bool,
    **options: Any,
) -> int:
    """Move the rows of a gait table as little as possible so that the gait is valid and flyable.

    Rows need alpha1 to alpha4. A table with times keeps them. The exit code is 1, with the reason, if nothing is
    flyable, or if the vehicle's limits of tilt rate forbid the new gait at the given times.
    """
    from gaitgraph.io.writing import check_outputs, write_tables
    from gaitgraph.optimization.nearest import retarget

    asked = stated(options)
    polygons_from_texts(asked)
    if margin is not None:
        asked["margin"] = angle_not_negative(margin, "margin")
    if sign not in (None, "auto"):
        asked["sign"] = sign
    check_outputs(outputs, force=force)
    with working(f"retargeting {gait_file}"):
        answer = retarget(gait_file, vehicle=vehicle_or_none(vehicle), **asked)
        if answer.table is not None and outputs:
            write_tables(answer.table, outputs, force=force)
    if as_json:
        print_json(answer.as_mapping())
    else:
        print_text(str(answer))
    return 0 if answer.after is not None and answer.after.flyable else 1
