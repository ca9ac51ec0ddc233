"""The commands optimize and retarget: the best gait through discs, and the nearest flyable gait."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from gaitgraph.cli.inputs import gait_in
from gaitgraph.cli.options import (
    SECONDS,
    SHARE,
    Angle,
    common_options,
    gait_file_argument,
    gait_outputs_options,
    polygon_options,
    sign_option,
    waypoints_option,
)
from gaitgraph.cli.output import check_outputs, show, working, write_outputs

if TYPE_CHECKING:
    from gaitgraph.cli.options import Chosen
    from gaitgraph.optimization.optimize import Objective
    from gaitgraph.surface.sheets import SignChoice

    Corners = list[tuple[float, float]]


@click.command(
    "optimize", short_help="The smooth gait through discs with the best worst case."
)
@waypoints_option
@click.option(
    "--radius",
    type=Angle(),
    multiple=True,
    default=["0.1"],
    help="Radius of the discs around the waypoints: one for all, or one for each.",
)
@click.option(
    "--objective",
    type=click.Choice(["singular_value", "hover_reserve", "servo_margin"]),
    default="singular_value",
    help="The quantity to maximise at the worst place of the gait.",
)
@sign_option
@click.option(
    "--period", type=SECONDS, metavar="SECONDS", default=1.0, help="Period of the gait."
)
@polygon_options
@gait_outputs_options
@common_options
def optimize_command(
    waypoints: tuple[tuple[float, float], ...],
    radius: tuple[float, ...],
    objective: Objective,
    sign: SignChoice,
    period: float,
    keep_in: tuple[Corners, ...],
    keep_out: tuple[Corners, ...],
    outputs: tuple[str, ...],
    force: bool,
    chosen: Chosen,
) -> int:
    """Find the smooth closed gait that passes discs in order and is optimal along all of it.

    The answer says how far from the best possible it may be, and is checked between samples too. The exit code is 1,
    with the reason, if no flyable gait passes the discs.
    """
    from gaitgraph.optimization.optimize import optimal_gait
    from gaitgraph.timing.timed_gait import checked_clock
    from gaitgraph.vehicle import PAPER

    if not waypoints:
        raise click.UsageError("--waypoint A1,A2 must be given")
    check_outputs(outputs, force=force)
    checked_clock(period, "smooth")
    with working("optimising") as progress:
        answer = optimal_gait(
            waypoints,
            radius=radius[0] if len(radius) == 1 else radius,
            objective=objective,
            sign=sign,
            vehicle=chosen["vehicle"] or PAPER,
            coefficients=chosen["coefficients"],
            keep_in=keep_in,
            keep_out=keep_out,
            period=period,
            progress=progress,
        )
        if answer and outputs:
            write_outputs(answer.table(), outputs, force=force)
    return show(answer)


@click.command(
    "retarget",
    short_help="The nearest flyable gait: rows moved as little as possible.",
)
@gait_file_argument
@sign_option
@click.option(
    "--margin",
    type=Angle(),
    default=0.0,
    help="Distance to keep from the flyable region's border.",
)
@click.option(
    "--keep",
    type=SHARE,
    show_default="move each row as little as possible",
    help="Keep the shape of the motion, scaled by this factor.",
)
@polygon_options
@gait_outputs_options
@common_options
def retarget_command(
    gait_file: str,
    sign: SignChoice,
    margin: float,
    keep: float | None,
    keep_in: tuple[Corners, ...],
    keep_out: tuple[Corners, ...],
    outputs: tuple[str, ...],
    force: bool,
    chosen: Chosen,
) -> int:
    """Move the rows of a gait table as little as possible so that the gait is valid and flyable.

    Rows need alpha1 to alpha4. A table with times keeps them. The exit code is 1, with the reason, if nothing is
    flyable, or if the vehicle's limits of tilt rate forbid the new gait at the given times.
    """
    from gaitgraph.optimization.retargeting import KEEP_HALF, retarget

    check_outputs(outputs, force=force)
    with working(f"retargeting {gait_file}"):
        answer = retarget(
            gait_in(gait_file),
            **chosen,
            sign=None if sign == "auto" else sign,
            keep_in=keep_in,
            keep_out=keep_out,
            margin=margin,
            keep=keep,
        )
        table: Any = answer.table
        if table is not None and outputs:
            write_outputs(table, outputs, force=force)
    if answer.advice is not None:
        answer = replace(answer, advice=KEEP_HALF.command_line)
    return show(answer, ok=answer.after is not None and answer.after.flyable)
