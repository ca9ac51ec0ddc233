"""The commands about the surfaces over the (α1, α2) plane: roots, colorings, cycles and region."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import click

from gaitgraph.cli.inputs import request_of
from gaitgraph.cli.options import (
    COUNT,
    GAIT_FILE,
    Angle,
    common_options,
    picture_outputs_options,
    request_file_argument,
    servo_margin_option,
    sign_option,
    waypoints_option,
)
from gaitgraph.cli.output import (
    print_problem,
    show,
    tell,
    wants_json,
    working,
)

if TYPE_CHECKING:
    from gaitgraph.cli.options import Chosen
    from gaitgraph.graph.walks import EdgeRequirement
    from gaitgraph.invertibility.coefficients import Kind
    from gaitgraph.surface.sheets import RootSet
    from gaitgraph.vehicle import Vehicle


@click.command(
    "roots",
    short_help="Every (α3, α4) on the gait surfaces for one (α1, α2).",
    context_settings={"ignore_unknown_options": True},  # a negative angle
)
@click.argument("alpha1", metavar="A1")
@click.argument("alpha2", metavar="A2")
@common_options
def roots_command(alpha1: str, alpha2: str, chosen: Chosen) -> int:
    """Print every root (α3, α4) of Rφ = Rθ = 0 for one (α1, α2), with plane types, color and R."""
    from gaitgraph.surface.sheets import roots
    from gaitgraph.vehicle import PAPER

    vehicle = chosen["vehicle"] or PAPER
    coefficients = chosen["coefficients"]
    answer = roots(alpha1, alpha2, vehicle=vehicle, coefficients=coefficients)
    first, second = answer[0].alpha[:2]
    rows = []
    for root in answer:
        row = asdict(root)
        del row["alpha1"], row["alpha2"]
        rows.append(row)
    fibers = [asdict(fiber) for fiber in answer.fibers]
    return tell(
        {"alpha1": first, "alpha2": second, "roots": rows, "fibers": fibers},
        _lines_of_roots(answer, vehicle, coefficients),
    )


def _lines_of_roots(
    answer: RootSet, vehicle: Vehicle, coefficients: Kind | None
) -> list[str]:
    from gaitgraph.angles import text_from_angle
    from gaitgraph.invertibility.coefficients import coefficients_of
    from gaitgraph.invertibility.matrices import noise_of

    numbers = coefficients_of(vehicle, coefficients)
    point = ", ".join(text_from_angle(angle) for angle in answer[0].alpha[:2])
    lines = [
        f"(α1, α2) = ({point}), {numbers.kind} coefficients",
        "  color  types            α3            α4             R",
    ]
    for root in answer:
        R = root.R
        if abs(R) <= noise_of(numbers):  # what floating point leaves of R = 0
            R = 0.0
        angles = f"{root.alpha3:12.6f}  {root.alpha4:12.6f}"
        lines.append(f"  {root.color:<5}  {root.types}  {angles}  {R:12.6g}")
    for fiber in answer.fibers:
        fixed = ", ".join(f"{value:.6f}" for value in fiber.values)
        line = f"  and a continuum {fiber.types}: {fiber.fixed} = {fixed}, {fiber.free} free"
        if fiber.singular:
            line += "; singular at every attitude"
        lines.append(line)
    return lines


@click.command(
    "colorings", short_help="Every Two-Color-consistent colouring of a loop."
)
@click.argument("loop_file", metavar="GAIT_FILE_OR_REQUEST", type=GAIT_FILE)
@common_options
def colorings_command(loop_file: str, chosen: Chosen) -> int:
    """List every colouring of a closed loop of (α1, α2) that obeys the Two Color rule.

    The loop is that of a gait file, gait1 to gait4, a table of alpha1 and alpha2 alone, or a request's waypoints. The
    exit code is 1, with the first pair of neighbours that forbids it, if there is none.
    """
    from gaitgraph.planning.request import colorings_of_file

    with working(f"coloring {loop_file}"):
        answer = colorings_of_file(loop_file, **chosen)
    if wants_json():
        # Written one by one: there may be more than fit in memory.
        head = json.dumps(
            {"points": answer.points.tolist(), **answer.as_mapping()}, allow_nan=False
        )
        click.echo(f'{head[:-1]}, "colorings": [', nl=False)
        signs: list[str] = []
        for coloring in answer:
            separator = ", " if signs else ""
            click.echo(separator + json.dumps(list(coloring.colors)), nl=False)
            signs.append(coloring.sign)
        click.echo(f'], "coloring_signs": {json.dumps(signs)}}}')
    else:
        click.echo(str(answer))
        for coloring in answer:
            click.echo(f"  {coloring}")
    return 0 if answer else 1


@click.command("cycles", short_help="Closed cycles of the graph, shortest first.")
@request_file_argument
@click.option(
    "--max-length",
    type=Angle(),
    help="Longest cycle to list, measured in the (α1, α2) plane.",
)
@click.option(
    "--limit",
    type=COUNT,
    default=20,
    help="Largest number of cycles to list.",
)
@click.option(
    "--require",
    "edges",
    type=click.Choice(["flyable", "valid", "two_color"]),
    default="valid",
    help="Which edges of the graph a cycle may have.",
)
@common_options
def cycles_command(
    request_file: str | None,
    max_length: float | None,
    limit: int,
    edges: EdgeRequirement,
    **_: Any,  # fields of the request, which request_of reads
) -> int:
    """List simple closed cycles of the surface graph, the shortest first, each with its verdict.

    Each is printed as soon as it is found, as text or as one line of JSON. A request file may state their color and
    sign of R, the divisions of the grid, and polygons that confine them; its waypoints are not used. The exit code is 1
    if there is none.
    """
    from gaitgraph.planning.grid import grid_cycles

    request, _sampling = request_of(request_file)
    if request.waypoints:
        print_problem(
            "warning: cycles do not use waypoints; plan --method grid finds a loop through them"
        )
    for note in request.notes:
        print_problem(f"warning: {note}")
    with working("building the graph") as progress:
        cycles = grid_cycles(
            request, max_length=max_length, require=edges, progress=progress
        )
    listed = 0
    while True:
        with working("searching cycles"):
            cycle = next(cycles, None)
        if cycle is None or listed == limit:
            break
        show(cycle)
        listed += 1
    if not listed:
        reason = "the graph has none"
        if max_length is not None:
            reason += f" within {max_length:g} rad"
        tell({"status": "none", "reason": reason}, [f"No cycle: {reason}"])
        return 1
    which = "all there are"
    if cycle is not None:
        which = f"no others are shorter than {cycle.length:.4f} rad"
    noun = "cycle" if listed == 1 else "cycles"
    click.echo(f"{listed} {noun}: {which}", err=True)
    return 0


@click.command(
    "region",
    short_help="The admissible regions, and in which part of them waypoints lie.",
)
@request_file_argument
@waypoints_option
@click.option(
    "--require",
    type=click.Choice(["flyable", "valid"]),
    default="flyable",
    help="Region in which a gait can fly (flyable), or in which R has the sign (valid).",
)
@sign_option
@servo_margin_option
@picture_outputs_options
@common_options
def region_command(
    request_file: str | None,
    outputs: tuple[str, ...],
    force: bool,
    **_: Any,  # fields of the request, which request_of reads
) -> int:
    """List the parts of the admissible regions, or, with waypoints, report in which part each of them lies.

    For a waypoint in none of them the reason and the nearest admissible point are printed. A request file may also state the color,
    polygons, the floor of the least singular value and the accuracy of curved borders. The exit code is 1 if no part
    holds all waypoints, so that no closed gait passes them, or if there is no part.
    """
    from gaitgraph.planning.location import located
    from gaitgraph.plots.axes import blank_figure, check_pictures, write_pictures

    check_pictures(outputs, force=force)
    request, _sampling = request_of(request_file)
    for note in request.notes:
        print_problem(f"warning: {note}")
    with working("computing the region"):
        answer = located(request)
        if outputs:
            figure = blank_figure(130.0, 140.0)
            answer.plot(ax=figure.add_subplot())
            write_pictures(figure, outputs, force=force)
    return show(answer, outputs=outputs)
