"""The command export: write a gait file in other formats."""

from __future__ import annotations

from typing import Any

import click

from gaitgraph.cli import Paths, Working, command, file, option, print_json, wants_json


def _map_names() -> list[str]:
    from gaitgraph.io.servo_map import PRESETS

    return list(PRESETS)


@command(
    "Write a gait file in other formats, or with another timing.",
    "gait_file",
    file("outputs", "OUTPUT...", nargs=-1, required=True),
    option("--columns", "NAME_OR_FILE", "Joints of a servo table from elsewhere, as for --servos.", words=_map_names),
    option("--servos", "NAME_OR_FILE", "Write positions of joints, by a preset or a TOML file.", words=_map_names),
    option("--periods", "N", "Periods in a bag or .yaml.  [default: 1]"),
    "period samples rate law force vehicle coefficients json",
)
def export_command(gait_file: str, outputs: Paths, force: bool = False, servos: str | None = None, **given: Any) -> int:
    """Write a gait file, a plan, a request's gait or gait1 to gait4 to OUTPUT files; their suffixes say the formats.

    A table with times keeps its rows. Without times, or with --period, --samples, --rate or --law, the closed
    polyline through the rows gets a new timing. With --servos the columns are positions of the vehicle's joints: order,
    sign, zero, degrees or pulse widths. Such files are read without an option, servo tables from elsewhere with
    --columns.
    """
    from gaitgraph.gait.table import merged
    from gaitgraph.io.formats import tables_and_films
    from gaitgraph.io.servo_map import servo_map_named
    from gaitgraph.plots.vehicles import check_films, write_films
    from gaitgraph.timing.timed_gait import export

    servo_map = None if servos is None else servo_map_named(servos)
    if "columns" in given:
        given["joints"] = servo_map_named(given.pop("columns"))
    tables, films = tables_and_films(outputs)
    check_films(films, force=force)
    with Working(f"exporting {gait_file}"):
        done = export(gait_file, tables, force=force, servos=servo_map, **given)
        if films:
            write_films(merged(done.pieces()), films, force=force)
    if wants_json():
        answer: dict[str, Any] = {"rows": done.rows, "columns": list(done.columns), "outputs": list(outputs)}
        if servo_map:
            answer |= {"servos": servo_map.as_mapping(), "clipped": done.clipped}
        print_json(answer)
        return 0
    for name in outputs:
        click.echo(f"wrote {name}: {'one period, drawn' if name in films else f'{done.rows} rows'}")
    for joint, count in done.clipped.items():
        click.echo(f"clipped: joint {joint!r} at its limit in {count} of {done.rows} rows")
    return 0
