"""The command figures: draw the figures of the paper."""

from __future__ import annotations

import os
from typing import Any

from gaitgraph.cli import (
    PAPER_GAITS,
    Paths,
    Working,
    command,
    file,
    gait_in,
    one_of,
    option,
    tell,
)

_NAMES = [*map(str, range(1, 23)), "18b", "19b", "22b", "regions", "set"]


@command(
    "Draw the figures of the paper, or the set of a gait.",
    file("gait_file", "[GAIT_FILE]", *PAPER_GAITS, required=False),
    option(
        "--only",
        "NAME",
        "1 to 22, 18b, 19b, 22b, regions or set; repeatable.",
        words=_NAMES,
        multiple=True,
    ),
    option(
        "--output",
        "DIR",
        "Folder, created if missing.  [default: figures]",
        default="figures",
    ),
    one_of(
        "--format",
        "png",
        "svg",
        "pdf",
        of="Repeatable: ",
        default="png, svg",
        name="formats",
        multiple=True,
    ),
    "force vehicle coefficients json",
)
def figures_command(
    output: str, formats: Paths = (), gait_file: str | None = None, **given: Any
) -> int:
    """Draw Figures 1 to 22 of the paper, the exact regions, and the set of Gait 3.

    With GAIT_FILE draw its set: loop on the map, angles, hover thrusts, attitudes and least singular value.
    With exact coefficients, the default for any vehicle but the paper's, blue has R = 0 and is shown as
    singular; with a rotor height it is not shown. Figures 18 to 22 take printed coefficients for the paper's vehicle.
    Needs matplotlib: pip install 'gaitgraph[plot]'.
    """
    from gaitgraph.plots.figures import FIGURES, write_figures

    os.environ["MPLBACKEND"] = (
        "agg"  # no window is opened, and a notebook's backend may be missing here
    )
    if formats:
        given["formats"] = [name.lower() for name in formats]
    if gait_file is not None:
        given = {"only": ("set",), "gait": gait_in(gait_file, given)} | given
    with Working("drawing") as progress:
        written = write_figures(output, progress=progress, **given)
    known = {figure.stem: figure for figure in FIGURES.values()}
    drawn = [(str(path), known[path.stem]) for path in written]
    rows = [
        {"file": path, "figure": one.name, "title": one.title} for path, one in drawn
    ]
    return tell({"files": rows}, [f"wrote {path}: {one.title}" for path, one in drawn])
