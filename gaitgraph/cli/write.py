"""The commands export and figures: write files from a gait, or from none."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import click

from gaitgraph.cli.commands import command
from gaitgraph.cli.options import force_option, json_option, sampling_options, setting_options, vehicle_or_none
from gaitgraph.cli.terminal import print_json, progress_notes

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["export_command", "figures_command"]


@command("Write a gait file in other formats, or with another clock.")
@click.argument("gait_file", metavar="GAIT_FILE")
@click.argument("outputs", metavar="OUTPUT...", nargs=-1, required=True)
@sampling_options
@setting_options
@json_option
def export_command(
    gait_file: str,
    outputs: Sequence[str],
    vehicle: str | None,
    as_json: bool,
    **options: Any,
) -> int:
    """Read a gait table or a saved plan and write it to OUTPUT files (.csv, .json).

    A table with a clock keeps its rows. Without one, or with --period, --samples, --rate or --law, the closed
    polyline through the rows gets a new clock.
    """
    from gaitgraph.exchange import export

    table = export(gait_file, outputs, vehicle=vehicle_or_none(vehicle), **options)
    if as_json:
        print_json({"rows": len(table), "columns": list(table.columns), "outputs": list(outputs)})
        return 0
    for name in outputs:
        click.echo(f"wrote {name}: {len(table)} rows of {', '.join(table.columns)}")
    return 0


@command("Draw the figures of the paper, and two that it lacks.")
@click.option("--only", multiple=True, metavar="N", help="1 to 22, 9-14, regions or gait; repeatable.  [default: all]")
@click.option("--out", metavar="DIR", default="figures", help="Folder, made if need be.  [default: figures]")
@click.option(
    "--format", "formats", multiple=True, metavar="NAME", help="png, svg or pdf; repeatable.  [default: png, svg]"
)
@click.option("--gait", "gait_file", metavar="GAIT_FILE", help="What the figure gait shows.  [default: Gait 3]")
@force_option
@setting_options
@json_option
def figures_command(
    only: Sequence[str],
    out: str,
    formats: Sequence[str],
    gait_file: str | None,
    vehicle: str | None,
    coefficients: Any,
    force: bool,
    as_json: bool,
) -> int:
    """Draw Figures 1 to 22 of the paper, the exact regions, and a gait in four dimensions.

    With exact coefficients, the default for any vehicle but the paper's, blue has R = 0 and is shown as singular.
    Needs matplotlib: pip install 'gaitgraph[plot]'.
    """
    from gaitgraph.exchange import read_gait
    from gaitgraph.figures import FIGURES, write_figures
    from gaitgraph.reading import read_table

    os.environ["MPLBACKEND"] = "agg"  # no window is opened, and a notebook's backend may be missing here
    setting = {"vehicle": vehicle_or_none(vehicle), "coefficients": coefficients}
    given: dict[str, Any] = {"formats": tuple(name.lower() for name in formats)} if formats else {}
    if gait_file is not None:
        read_gait(gait_file, **setting)  # what is wrong with it is told with its name
        given["gait"] = read_table(gait_file)
    written = write_figures(
        out,
        only=only or None,
        **setting,
        force=force,
        progress=progress_notes(),
        **given,
    )
    titles = {figure.stem: (name, figure.title, figure.caption) for name, figure in FIGURES.items()}
    if as_json:
        keys = ("figure", "title", "caption")
        rows = [{"file": str(path), **dict(zip(keys, titles[path.stem], strict=True))} for path in written]
        print_json({"files": rows})
        return 0
    for path in written:
        click.echo(f"wrote {path}: {titles[path.stem][1]}")
    return 0
