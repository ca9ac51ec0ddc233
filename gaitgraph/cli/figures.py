"""The command figures: draw the figures of the paper."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Literal

import click

from gaitgraph.cli.inputs import gait_in
from gaitgraph.cli.options import GAIT_FILE, common_options, force_option
from gaitgraph.cli.output import tell, working

if TYPE_CHECKING:
    from gaitgraph.cli.options import Chosen

_NAMES = [*map(str, range(1, 23)), "18b", "19b", "22b", "regions", "margins", "set"]


@click.command(
    "figures", short_help="Draw the figures of the paper, or the set of a gait."
)
@click.argument("gait_file", metavar="[GAIT_FILE]", type=GAIT_FILE, required=False)
@click.option(
    "--only",
    type=click.Choice(_NAMES),
    metavar="NAME",
    multiple=True,
    show_default="all, or set with GAIT_FILE",
    help="Draw 1 to 22, 18b, 19b, 22b, regions, margins or set alone; repeatable.",
)
@click.option(
    "--output",
    type=click.Path(file_okay=False),
    metavar="FOLDER",
    default="figures",
    help="Folder, created if missing.",
)
@click.option(
    "--format",
    "formats",
    type=click.Choice(["png", "svg", "pdf"], case_sensitive=False),
    multiple=True,
    default=["png", "svg"],
    help="Format of the files; repeatable.",
)
@force_option
@common_options
def figures_command(
    gait_file: str | None,
    only: tuple[str, ...],
    output: str,
    formats: tuple[Literal["png", "svg", "pdf"], ...],
    force: bool,
    chosen: Chosen,
) -> int:
    """Draw Figures 1 to 22 of the paper, the exact regions, the servo margins, and the set of Gait 3.

    With GAIT_FILE draw its set: loop on the map, angles, hover thrusts, attitudes and least singular value.
    With exact coefficients, the default for any vehicle but the paper's, blue has R = 0 and is shown as
    singular; with a rotor height it is not shown. Figures 18 to 22 take printed coefficients for the paper's vehicle.
    Needs matplotlib: pip install 'gaitgraph[plot]'.
    """
    from gaitgraph.plots.figures import FIGURES, write_figures

    # No window is opened, and a notebook's backend may be missing here.
    os.environ["MPLBACKEND"] = "agg"
    gait = None
    if gait_file is not None:
        gait = gait_in(gait_file, **chosen)
        only = only or ("set",)
    with working("drawing") as progress:
        paths = write_figures(
            output,
            only=only or None,
            **chosen,
            gait=gait,
            formats=formats,
            force=force,
            progress=progress,
        )
    figure_of_stem = {figure.stem: figure for figure in FIGURES.values()}
    files = []
    lines = []
    for path in paths:
        figure = figure_of_stem[path.stem]
        files.append({"file": str(path), "figure": figure.name, "title": figure.title})
        lines.append(f"wrote {path}: {figure.title}")
    return tell({"files": files}, lines)
