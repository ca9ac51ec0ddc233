"""The commands validate, colorings and robustness: say how good a given gait or loop is."""

from __future__ import annotations

import json
from typing import Any

import click

from gaitgraph.cli.commands import command
from gaitgraph.cli.options import (
    a_file,
    angle_not_negative,
    crossing_option,
    json_option,
    name_option,
    require_option,
    setting_options,
    vehicle_or_none,
)
from gaitgraph.cli.terminal import print_json, print_text, working

__all__ = ["colorings_command", "robustness_command", "validate_command"]


@command("Judge a gait file: every rule, with value, limit and place.")
@click.argument("gait_file", metavar="GAIT_FILE", shell_complete=a_file())
@require_option
@click.option("--tolerance", type=float, metavar="X", help="Largest |Rφ|, |Rθ| on the surface.  [default: 0.002]")
@click.option("--floor", type=float, metavar="X", help="Least singular value to keep.  [default: 0.05]")
@click.option("--angle-rounding", metavar="ANGLE", help="What each angle may be off by.  [default: what is seen]")
@crossing_option
@setting_options
@json_option
def validate_command(
    gait_file: str, require: str, vehicle: str | None, coefficients: Any, as_json: bool, **limits: Any
) -> int:
    """Judge a gait table of any format or a saved plan, along its whole length.

    Rows need alpha1 to alpha4, or alpha1, alpha2 and color; the way back to the first row is implied. The exit code
    is 1 if the gait is not valid (or not flyable, with --require flyable). CSV and Parquet files of any length are
    read piece by piece.
    """
    from gaitgraph.validation.validating import validate

    for name in ("angle_rounding", "crossing_tolerance"):
        if limits[name] is not None:
            limits[name] = angle_not_negative(limits[name], name)
    given = {name: value for name, value in limits.items() if value is not None}
    with working(f"judging {gait_file}") as progress:
        report = validate(
            gait_file,
            vehicle=vehicle_or_none(vehicle),
            coefficients=coefficients,
            progress=progress.part,
            **given,
        )
    if as_json:
        print_json(report.as_mapping())
    else:
        print_text(str(report))
    return 0 if (report.flyable if require == "flyable" else report.valid) else 1


@command("Every Two-Color-consistent colouring of a loop.")
@click.argument("loop_file", metavar="GAIT_FILE_OR_REQUEST", shell_complete=a_file())
@name_option("--sign", "Sign of R: auto (both), positive or negative.  [default: auto]")
@click.option("--limit", type=click.IntRange(0, 10**9), metavar="N", help="List so many at most; all are counted.")
@crossing_option
@setting_options
@json_option
def colorings_command(
    loop_file: str,
    sign: str | None,
    limit: int | None,
    crossing_tolerance: str | None,
    vehicle: str | None,
    coefficients: Any,
    as_json: bool,
) -> int:
    """List every colouring of a closed loop of (α1, α2) that obeys the Two Color rule.

    The loop is that of a gait table, of a table of alpha1 and alpha2 alone, or of a request's waypoints. The exit
    code is 1, with the first pair of neighbours that forbids it, if there is none.
    """
    from itertools import islice

    from gaitgraph.planning.request import colorings_of_file

    reach = None if crossing_tolerance is None else angle_not_negative(crossing_tolerance, "crossing_tolerance")
    with working(f"coloring {loop_file}"):
        found = colorings_of_file(
            loop_file,
            sign=sign,
            vehicle=vehicle_or_none(vehicle),
            coefficients=coefficients,
            crossing_tolerance=reach,
        )
    shown = islice(found, limit)
    if as_json:
        # Written one by one: there may be more than fit in memory.
        head = json.dumps({"points": found.points.tolist(), **found.as_mapping()}, allow_nan=False)
        click.echo(f'{head[:-1]}, "colorings": [', nl=False)
        signs: list[str] = []
        for coloring in shown:
            click.echo((", " if signs else "") + json.dumps(list(coloring.colors)), nl=False)
            signs.append(coloring.sign)
        click.echo(f'], "coloring_signs": {json.dumps(signs)}}}')
    else:
        print_text(str(found))
        for coloring in shown:
            click.echo(f"  {coloring}")
        if limit is not None and found.count > limit:
            click.echo(f"  … {limit} of them shown")
    return 0 if found else 1


@command("Tilt margin and acceptable attitudes, beside biased gaits.")
@click.argument("gait_file", metavar="GAIT_FILE", shell_complete=a_file())
@click.option("--bias", type=float, multiple=True, metavar="ETA", help="Scale α3 and α4 by η in (0, 1]; repeatable.")
@click.option("--scale", type=float, multiple=True, metavar="ETA", help="Scale all four by η; repeatable.")
@click.option("--tilt", metavar="ANGLE", help="Tilt to ask the least singular value within.  [default: 30deg]")
@click.option("--tolerance", type=float, metavar="X", help="Fraction of attitudes that may be missed.  [default: 1e-5]")
@click.option("--curves", type=int, metavar="N", help="Singular curves at so many places.  [default: 24]")
@click.option("--angle-rounding", metavar="ANGLE", help="What each angle may be off by.  [default: what is seen]")
@setting_options
@json_option
def robustness_command(
    gait_file: str,
    tilt: str | None,
    angle_rounding: str | None,
    vehicle: str | None,
    as_json: bool,
    **options: Any,
) -> int:
    """Say how far a gait can be tilted before its decoupling matrix is singular.

    Works on any table of alpha1 to alpha4, on the gait surfaces or not. Judged with exact coefficients unless published
    ones are asked for. The file's rows are joined by straight segments, and the last with the first.
    """
    from gaitgraph.angles import angle_from_text
    from gaitgraph.robustness.biased import robustness_of

    if tilt is not None:
        options["tilt"] = angle_from_text(tilt, "--tilt")
    if angle_rounding is not None:
        options["angle_rounding"] = angle_not_negative(angle_rounding, "angle_rounding")
    with working(f"tilting {gait_file}") as progress:
        report = robustness_of(
            gait_file,
            progress=progress,
            vehicle=vehicle_or_none(vehicle),
            **{name: value for name, value in options.items() if value is not None},
        )
    if as_json:
        print_json(report.as_mapping())
    else:
        print_text(str(report))
    return 0
