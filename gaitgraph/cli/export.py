"""The commands export and figures: write files from a gait, or from none."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import click

from gaitgraph.cli.commands import command
from gaitgraph.cli.options import (
    a_file,
    a_word,
    columns_option,
    force_option,
    json_option,
    sampling_options,
    servo_map_or_none,
    servos_option,
    setting_options,
    vehicle_or_none,
)
from gaitgraph.cli.terminal import print_json, working

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from gaitgraph.io.formats import FormatOptions
    from gaitgraph.io.servo_map import ServoMap
    from gaitgraph.timing.exporting import Exported

__all__ = ["export_command", "figures_command"]


def _format_options(command: Callable[..., int]) -> Callable[..., int]:
    """Add the choices that the formats for robots and microcontrollers have."""
    options = (
        click.option("--periods", type=int, metavar="N", help="Periods in a bag or .yaml.  [default: 1]"),
        click.option("--joint-names", metavar="A,B,C,D", help="Joints that tilt rotors 1 to 4, in a bag, .yaml or .h."),
        click.option("--trajectory-topic", metavar="TOPIC", help="In a bag.  [default: /joint_trajectory]"),
        click.option("--states-topic", metavar="TOPIC", help="In a bag.  [default: /joint_states]"),
        click.option(
            "--number",
            metavar="NAME",
            shell_complete=a_word("float", "double", "fixed"),
            help="In a .h: float, double or fixed.  [default: float]",
        ),
        click.option("--c-name", metavar="WORD", help="What names in a .h begin with.  [default: the file's name]"),
    )
    for option in reversed(options):
        command = option(command)
    return command


def _taken_format_options(options: dict[str, Any]) -> Any:
    """Take the choices of formats out of a command's options, and return them as the library wants them."""
    from gaitgraph.io.formats import FormatOptions

    names = ("periods", "joint_names", "trajectory_topic", "states_topic", "number", "c_name")
    chosen = {name: value for name in names if (value := options.pop(name)) is not None}
    if "joint_names" in chosen:
        chosen["joint_names"] = tuple(name.strip() for name in chosen["joint_names"].split(","))
    return FormatOptions(**chosen)


def _told(name: str, done: Exported, chosen: FormatOptions, servo_map: ServoMap | None) -> str:
    """Return what an output holds, in a few words."""
    from gaitgraph.gait.table import ANGLES
    from gaitgraph.io.formats import known_format

    form = known_format(name, "output")
    if "joint_names" in form.options:
        joints = f"joints {', '.join(chosen.joint_names or (servo_map.joint_names if servo_map else ANGLES))}"
        if "periods" in form.options:
            return f"{(done.rows - 1) * chosen.periods + 1} points of {joints}"
        return f"{done.rows} rows of {joints}, and a function of time"
    if form.reads:
        return f"{done.rows} rows of {', '.join(servo_map.columns if servo_map else done.columns)}"
    if form.suffix == ".m":
        return "a function that loads and plots the .mat, .csv or .json file of its name"
    return "one period, drawn"


@command("Write a gait file in other formats, or with another clock.")
@click.argument("gait_file", metavar="GAIT_FILE", shell_complete=a_file())
@click.argument("outputs", metavar="OUTPUT...", nargs=-1, required=True, shell_complete=a_file())
@columns_option
@servos_option
@_format_options
@sampling_options
@setting_options
@json_option
def export_command(
    gait_file: str,
    outputs: Sequence[str],
    vehicle: str | None,
    columns: str | None,
    servos: str | None,
    as_json: bool,
    **options: Any,
) -> int:
    """Read a gait table or a saved plan and write it to OUTPUT files; their suffixes say the formats.

    A table with a clock keeps its rows. Without one, or with --period, --samples, --rate or --law, the closed
    polyline through the rows gets a new clock. With --servos it tells where the joints of the vehicle stand: order,
    sign, zero, degrees or pulse widths; such a file is read back without an option, one from elsewhere with --columns.
    """
    from gaitgraph.timing.exporting import export

    joints, servo_map = servo_map_or_none(columns), servo_map_or_none(servos)
    options |= {name: value for name, value in (("joints", joints), ("servos", servo_map)) if value is not None}
    chosen = options["options"] = _taken_format_options(options)
    with working(f"exporting {gait_file}") as work:
        done = export(gait_file, outputs, vehicle=vehicle_or_none(vehicle), progress=work.part, **options)
    if as_json:
        answer: dict[str, Any] = {"rows": done.rows, "columns": list(done.columns), "outputs": list(outputs)}
        if servo_map:
            answer |= {"servos": servo_map.as_mapping(), "clipped": done.clipped}
        print_json(answer)
        return 0
    for name in outputs:
        click.echo(f"wrote {name}: {_told(name, done, chosen, servo_map)}")
    for name, count in done.clipped.items():
        click.echo(f"clipped: joint {name!r} at its limit in {count} of {done.rows} rows")
    return 0


@command("Draw the figures of the paper, and two that it lacks.")
@click.option(
    "--only",
    multiple=True,
    metavar="N",
    shell_complete=a_word(*map(str, range(1, 23)), "regions", "gait"),
    help="1 to 22, 9-14, regions or gait; repeatable.  [default: all]",
)
@click.option(
    "--out",
    metavar="DIR",
    default="figures",
    shell_complete=a_file(),
    help="Folder, made if need be.  [default: figures]",
)
@click.option(
    "--format",
    "formats",
    multiple=True,
    metavar="NAME",
    shell_complete=a_word("png", "svg", "pdf"),
    help="png, svg or pdf; repeatable.  [default: png, svg]",
)
@click.option(
    "--gait",
    "gait_file",
    metavar="GAIT_FILE",
    shell_complete=a_file(),
    help="What the figure gait shows.  [default: Gait 3]",
)
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
    from gaitgraph.io.reading import read_gait, read_table
    from gaitgraph.plots.figures import FIGURES, write_figures

    os.environ["MPLBACKEND"] = "agg"  # no window is opened, and a notebook's backend may be missing here
    setting = {"vehicle": vehicle_or_none(vehicle), "coefficients": coefficients}
    given: dict[str, Any] = {"formats": tuple(name.lower() for name in formats)} if formats else {}
    if gait_file is not None:
        read_gait(gait_file, **setting)  # what is wrong with it is told with its name
        given["gait"] = read_table(gait_file)
    with working("drawing") as progress:
        written = write_figures(
            out,
            only=only or None,
            **setting,
            force=force,
            progress=progress,
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
