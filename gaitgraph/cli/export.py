"""The command export: a gait file in other formats, or with another timing."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import click

from gaitgraph.cli.inputs import gait_in
from gaitgraph.cli.options import (
    COUNT,
    anyway_option,
    common_options,
    force_option,
    gait_file_argument,
    law_of_file_option,
    once_option,
    period_of_file_option,
    require_option,
    sampling_options,
)
from gaitgraph.cli.output import print_problem, tell, warn_of_rate, working

if TYPE_CHECKING:
    from gaitgraph.cli.options import Chosen
    from gaitgraph.io.exporting import Exported
    from gaitgraph.io.servo_map import ServoMap
    from gaitgraph.timing.laws import LawName


@click.command(
    "export", short_help="Write a gait file in other formats, or with another timing."
)
@gait_file_argument
@click.argument(
    "outputs", metavar="OUTPUT...", type=click.Path(), nargs=-1, required=True
)
@click.option(
    "--columns",
    metavar="NAME_OR_FILE",
    type=click.Path(),
    help="Servo map of the input, if it is a servo table from elsewhere.",
)
@click.option(
    "--servos",
    metavar="NAME_OR_FILE",
    type=click.Path(),
    help="Servo map of the outputs: a preset or a TOML file.",
)
@click.option(
    "--periods",
    type=COUNT,
    show_default="1; 2 with --from-hover",
    help="Number of periods to write; a C header and a film have one.",
)
@click.option(
    "--from-hover",
    is_flag=True,
    help="Enter the gait from hover, run --periods of it, and return to hover.",
)
@require_option
@anyway_option
@once_option
@period_of_file_option
@sampling_options
@law_of_file_option
@force_option
@common_options
def export_command(
    gait_file: str,
    outputs: tuple[str, ...],
    columns: str | None,
    servos: str | None,
    periods: int | None,
    from_hover: bool,
    require: Literal["flyable", "valid"],
    anyway: bool,
    once: bool,
    period: float | None,
    samples: int | None,
    rate: float | None,
    law: LawName | None,
    force: bool,
    chosen: Chosen,
) -> int:
    """Write a gait file, a saved plan, the gait of a request, or gait1 to gait4 to files in the formats of their suffixes.

    A table with times keeps its rows. --samples and --rate sample the motion that the table states: its law, or else
    what joins its rows. --period runs it faster or slower. A table without times, or with --law, gets a new timing along
    the polyline through its rows. A path, such as a transition or a table with --once, is not closed.

    A servo map says how joints follow from tilt angles: their order, signs, zeros, and degrees or pulse widths. Files
    written with --servos are read without an option, servo tables from elsewhere with --columns.

    With --from-hover the file holds the whole flight from hover to hover, which is run once; --period and --law are those
    of the gait.

    The written motion is judged. If it is not flyable (or not valid, with --require valid), nothing is written and the
    exit code is 1, unless --anyway is given.
    """
    from gaitgraph.gait.gait import PAPER_GAITS
    from gaitgraph.io.exporting import export
    from gaitgraph.io.formats import holds_request, tables_and_films
    from gaitgraph.io.servo_map import servo_map_named
    from gaitgraph.planning.missions import mission
    from gaitgraph.plots.films import check_films, write_films
    from gaitgraph.timing.joining import played
    from gaitgraph.timing.timed_gait import timed_gait_of

    joints = servo_map = None
    if columns is not None:
        joints = servo_map_named(columns)
        if gait_file in PAPER_GAITS or holds_request(gait_file):
            raise click.UsageError(
                f"--columns is of a servo table, and {gait_file} is none"
            )
    if servos is not None:
        servo_map = servo_map_named(servos)
    tables, films = tables_and_films(outputs)
    check_films(films, force=force)
    with working(f"exporting {gait_file}"):
        source = gait_in(
            gait_file,
            once=once,
            joints=joints,
            **chosen,
        )
        motion: dict[str, Any] = {**chosen, "period": period, "law": law}
        if from_hover:
            if period is None and law is None:
                timed = played(source, **chosen)
            else:
                timed = timed_gait_of(source, **motion)
            source = mission(timed, periods=periods or 2, rate=rate, anyway=anyway)
            motion = {}
            periods = None
        exported = export(
            source,
            tables,
            **motion,
            samples=samples,
            rate=rate,
            joints=joints,
            servos=servo_map,
            periods=periods or 1,
            force=force,
            require=require,
            anyway=anyway,
        )
        if films:
            write_films(exported.table, films, force=force)
        warn_of_rate(exported.table["t"], rate)
        _warn_of_phases(exported)
    return tell(
        _answer_of(exported, outputs, servo_map),
        _lines_of(exported, outputs, films, periods or 1),
    )


def _warn_of_phases(exported: Exported) -> None:
    """Print a warning if a part of a mission is shorter than the time between rows."""
    table = exported.table
    phases = table.about.get("phases", ())
    begins = [begin for _, begin in phases] + [float(table["t"][-1])]
    step = float(table["t"][1] - table["t"][0])
    for (phase, begin), end in zip(phases, begins[1:], strict=True):
        if end - begin < step * (1 - 1e-9):
            print_problem(
                f"warning: rows are {step:.4g} s apart, and the {phase} lasts {end - begin:.4g} s: set a higher --rate"
            )
            return


def _answer_of(
    exported: Exported, outputs: tuple[str, ...], servos: ServoMap | None
) -> dict[str, Any]:
    report = exported.report
    answer: dict[str, Any] = {
        "rows": len(exported.table),
        "columns": list(exported.table.columns),
        "outputs": list(outputs),
        "valid": report.valid,
        "flyable": report.flyable,
        "not_judged": list(report.not_judged),
        "hover_power": report.hover_power,
        "warnings": list(report.warnings),
    }
    if exported.rate_checks:
        answer["rate_checks"] = [check.as_mapping() for check in exported.rate_checks]
    if servos:
        answer["servos"] = servos.as_mapping()
        answer["clipped"] = exported.clipped
    return answer


def _lines_of(
    exported: Exported, outputs: tuple[str, ...], films: list[Any], periods: int
) -> list[str]:
    from gaitgraph.validation.report import lines_of_checks

    rows = len(exported.table)
    lines = []
    for name in outputs:
        if name in films:
            content = "one period, drawn"
        elif name.lower().endswith(".h"):  # it repeats by itself
            content = f"{rows} rows"
        else:
            content = f"{(rows - 1) * periods + 1} rows"
        lines.append(f"wrote {name}: {content}")
    lines += lines_of_checks(exported.rate_checks)
    lines += [exported.report.verdict, *exported.report.warning_lines]
    of_what = " of a period" if periods > 1 else ""
    for joint, count in exported.clipped.items():
        lines.append(
            f"clipped: joint {joint!r} at its limit in {count} of {rows} rows{of_what}"
        )
    return lines
