"""The commands about the surfaces over the (α1, α2) plane: roots, colorings, cycles and region."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from gaitgraph.cli import (
    PAPER_GAITS,
    Working,
    command,
    file,
    one_of,
    option,
    print_problem,
    request_of,
    show,
    tell,
    wants_json,
    whole_from,
)
from gaitgraph.errors import InputError

if TYPE_CHECKING:
    from gaitgraph.cli import Paths


@command(
    "Every (α3, α4) on the gait surfaces for one (α1, α2).",
    click.argument("angles", metavar="A1 A2", nargs=-1),
    "crossing_tolerance vehicle coefficients json",
    ignore_unknown_options=True,  # a negative angle is an argument
)
def roots_command(
    angles: tuple[str, ...] = (),
    vehicle: Any = None,
    coefficients: Any = None,
    **given: Any,
) -> int:
    """Print every root (α3, α4) of Rφ = Rθ = 0 for one (α1, α2), with plane types, color and R."""
    from dataclasses import asdict

    from gaitgraph.angles import text_from_angle
    from gaitgraph.invertibility.coefficients import coefficients_of
    from gaitgraph.invertibility.matrices import noise_of
    from gaitgraph.surface.sheets import roots
    from gaitgraph.vehicle import PAPER

    pair, numbers = (
        ",".join(angles).split(","),
        coefficients_of(vehicle or PAPER, coefficients),
    )
    if len(pair) != 2:
        raise InputError(f"roots needs two angles A1 A2, got {' '.join(angles)!r}")
    found = roots(*pair, coefficients=numbers, **given)
    alpha1, alpha2 = found[0].alpha[:2]
    rows = [
        {k: value for k, value in asdict(root).items() if k not in ("alpha1", "alpha2")}
        for root in found
    ]
    lines = [
        f"(α1, α2) = ({text_from_angle(alpha1)}, {text_from_angle(alpha2)}), {numbers.kind} coefficients"
    ]
    lines.append("  color  types            α3            α4             R")
    for root in found:
        # What floating point leaves of a root with R = 0 is not printed.
        R = 0.0 if abs(root.R) <= noise_of(numbers) else root.R
        angles_text = f"{root.alpha3:12.6f}  {root.alpha4:12.6f}"
        lines.append(f"  {root.color:<5}  {root.types}  {angles_text}  {R:12.6g}")
    for fiber in found.fibers:
        fixed = ", ".join(f"{value:.6f}" for value in fiber.values)
        note = "; singular at every attitude" if fiber.singular else ""
        lines.append(
            f"  and a continuum {fiber.types}: {fiber.fixed} = {fixed}, {fiber.free} free{note}"
        )
    found_fibers = [*map(asdict, found.fibers)]
    return tell(
        {"alpha1": alpha1, "alpha2": alpha2, "roots": rows, "fibers": found_fibers},
        lines,
    )


@command(
    "Every Two-Color-consistent colouring of a loop.",
    file("loop_file", "GAIT_FILE_OR_REQUEST", *PAPER_GAITS),
    "sign",
    option(
        "--limit",
        "N",
        "Colourings to list at most; all are counted.",
        type=whole_from(0, 10**9),
    ),
    "crossing_tolerance vehicle coefficients json",
)
def colorings_command(loop_file: str, limit: int | None = None, **given: Any) -> int:
    """List every colouring of a closed loop of (α1, α2) that obeys the Two Color rule.

    The loop is that of a gait file, gait1 to gait4, a table of alpha1 and alpha2 alone, or a request's waypoints. The
    exit code is 1, with the first pair of neighbours that forbids it, if there is none.
    """
    from itertools import islice

    from gaitgraph.planning.request import colorings_of_file

    with Working(f"coloring {loop_file}"):
        found = colorings_of_file(loop_file, **given)
    listed = islice(found, limit)
    if wants_json():
        # Written one by one: there may be more than fit in memory.
        head = json.dumps(
            {"points": found.points.tolist(), **found.as_mapping()}, allow_nan=False
        )
        click.echo(f'{head[:-1]}, "colorings": [', nl=False)
        signs: list[str] = []
        for coloring in listed:
            click.echo(
                (", " if signs else "") + json.dumps(list(coloring.colors)), nl=False
            )
            signs.append(coloring.sign)
        click.echo(f'], "coloring_signs": {json.dumps(signs)}}}')
    else:
        click.echo(str(found))
        for coloring in listed:
            click.echo(f"  {coloring}")
        if limit is not None and found.count > limit:
            click.echo(f"  … {limit} of them shown")
    return 0 if found else 1


@command(
    "Closed cycles of the graph, shortest first.",
    "request_file",
    "keep_in keep_out",
    option(
        "--max-length",
        "ANGLE",
        "Longest cycle to list, measured in the (α1, α2) plane.",
    ),
    option(
        "--limit",
        "N",
        "Number of cycles to list.  [default: 20]",
        type=whole_from(1, 10**9),
        default=20,
    ),
    "color sign divisions",
    one_of(
        "--require",
        "flyable",
        "valid",
        "two_color",
        of="Edges that count: ",
        default="valid",
        check=True,
    ),
    "vehicle coefficients json",
)
def cycles_command(
    limit: int,
    require: Any = "valid",
    request_file: str | None = None,
    max_length: float | None = None,
    **given: Any,
) -> int:
    """List simple closed cycles of the surface graph, the shortest first, each with its verdict.

    Each is printed as soon as it is found, as text or as one line of JSON. Polygons confine them to a region; waypoints
    of a request file are not used. The exit code is 1 if there is none.
    """
    from gaitgraph.planning.grid import grid_cycles
    from gaitgraph.planning.request import stated_request

    if request_file is not None and "waypoints" in stated_request(request_file):
        click.echo(
            "warning: cycles do not use waypoints; plan --method grid finds a loop through them",
            err=True,
        )
    given["waypoints"] = [(0.0, 0.0)]  # a request needs one
    request, _ = request_of(request_file, given)
    for note in request.notes:
        print_problem(f"warning: {note}")
    with Working("building the graph") as progress:
        found = grid_cycles(
            request, max_length=max_length, require=require, progress=progress
        )
    listed = 0
    while True:
        with Working("searching cycles"):
            cycle = next(found, None)
        if cycle is None or listed == limit:
            break
        show(cycle)
        listed += 1
    if not listed:
        within = "" if max_length is None else f" within {max_length:g} rad"
        reason = f"the graph has none{within}"
        tell({"status": "none", "reason": reason}, [f"No cycle: {reason}"])
        return 1
    which = "all there are"
    if cycle is not None:
        which = f"all that are shorter than {cycle.length:.4f} rad"
    plural = "" if listed == 1 else "s"
    click.echo(f"{listed} cycle{plural}: {which}", err=True)
    return 0


@command(
    "The admissible regions, and in which part of them waypoints lie.",
    "request_file waypoints",
    one_of(
        "--use",
        "flyable",
        "valid",
        name="require",
        check=True,
        of="Region where a gait can fly, or where R has the sign: ",
    ),
    one_of("--color", "red", "blue"),
    "sign floor accuracy keep_in keep_out",
    option(
        "--output",
        "FILE",
        "Draw the map: .png, .svg or .pdf; repeatable.",
        name="outputs",
        multiple=True,
    ),
    "force vehicle coefficients json",
)
def region_command(
    request_file: str | None = None,
    outputs: Paths = (),
    force: bool = False,
    **given: Any,
) -> int:
    """List the parts of the admissible regions, or, with waypoints, report in which part each of them lies.

    A waypoint in none gets the reason and the nearest admissible point. The exit code is 1 if no part holds all
    waypoints, so that no closed gait passes them, or if there is no part.
    """
    from gaitgraph.planning.location import located
    from gaitgraph.plots.axes import check_pictures
    from gaitgraph.plots.gaits import write_regions

    check_pictures(outputs, force=force)
    request, _ = request_of(
        request_file, given if request_file else {"waypoints": [(0.0, 0.0)], **given}
    )
    if request_file is None and "waypoints" not in given:
        request = replace(request, waypoints=())
    for note in request.notes:
        print_problem(f"warning: {note}")
    with Working("computing the region"):
        found = located(request)
        if outputs:
            write_regions(found, request.vehicle, outputs, force=force)
    return show(
        found,
        lines=[f"wrote {name}" for name in outputs],
        more={"outputs": list(outputs)},
    )
