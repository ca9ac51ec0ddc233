"""The command basin: from which roll and pitch a gait settles, found by flying from each."""

from __future__ import annotations

from typing import Any

import click

from gaitgraph.cli import Paths, Working, command, flag, named_in_errors, option, print_json, wants_json
from gaitgraph.cli.fly import CLOCK, SETTINGS, checked_settings


@command(
    "From which roll and pitch a gait settles, by flying from each.",
    "gait_file",
    option("--bias", "ETA", "Also α3 and α4 scaled by η; repeatable.", multiple=True),
    option("--resolution", "N", "Attitudes along each side of the grid.  [default: 17]"),
    option("--extent", "ANGLE", "Largest roll and pitch at the start.  [default: 80deg]"),
    option("--begins", "N", "Moments of the period to take off at.  [default: 1]"),
    flag("--anyway", "Fly even gaits that cannot fly."),
    *CLOCK,
    *SETTINGS,
    "outputs force json",
)
def basin_command(
    gait_file: str, bias: tuple[float, ...] = (), outputs: Paths = (), force: bool = False, **given: Any
) -> int:
    """Fly a gait, and its biased gaits, from rest at every attitude of a grid, and report from which it settles.

    GAIT_FILE is a gait table of any format, a saved plan, a request, which is planned first, or gait1 to gait4 of the
    paper. The acceptable attitudes, at which the gait is never singular, are reported too. The exit code is 1 if one of
    the gaits cannot fly. Needs mujoco: pip install 'gaitgraph[sim]'.
    """
    from gaitgraph.flight.basins import basins_of
    from gaitgraph.plots.flights import write_basins
    from gaitgraph.timing.timed_gait import timed_gait_of

    asked = {**given, "bias": bias or None}
    settings = checked_settings(given, outputs, of="basin", force=force)
    grid = {name: given.pop(name) for name in ("resolution", "extent", "begins", "anyway") if name in given}
    with Working(f"reading {gait_file}") as progress, named_in_errors(asked):
        timed = timed_gait_of(gait_file, **given)
        progress("flying")
        basins = basins_of(timed, biases=(1.0, *bias), settings=settings, progress=progress.part, **grid)
        if outputs:
            progress("writing")
            write_basins(basins, outputs, force=force)
    if wants_json():
        used = basins[0].settings.as_mapping()
        answers = [basin.as_mapping() for basin in basins]
        print_json({"basins": answers, "vehicle": timed.gait.vehicle.name, "settings": used, "outputs": list(outputs)})
    else:
        lines = [line for basin in basins for line in (str(basin), *(f"warning: {one}" for one in basin.warnings))]
        click.echo("\n".join([*lines, *(f"wrote {name}" for name in outputs)]))
    return 1 if any(basin.refusal for basin in basins) else 0
