"""The command basin: from which roll and pitch a gait settles, found by flying from each."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from gaitgraph.cli.commands import command
from gaitgraph.cli.flight_options import (
    PAPER_NAMES,
    clock_options,
    flight_options,
    refuse_two_limits,
    settings_from_options,
    timed_of_argument,
    told_warnings,
)
from gaitgraph.cli.options import a_file, as_options, force_option, json_option
from gaitgraph.cli.terminal import print_json, print_text, working
from gaitgraph.errors import Infeasible, InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["basin_command"]


@command("From which roll and pitch a gait settles, by flight.")
@click.argument("gait_file", metavar="GAIT_FILE", shell_complete=a_file(*PAPER_NAMES))
@click.option("--bias", type=float, multiple=True, metavar="ETA", help="Also α3 and α4 scaled by η; repeatable.")
@click.option("--resolution", type=int, metavar="N", help="Attitudes along each side of the grid.  [default: 17]")
@click.option("--extent", metavar="ANGLE", help="Largest roll and pitch at the start.  [default: 80deg]")
@click.option("--begins", type=int, metavar="N", help="Moments of the period to take off at.  [default: 1]")
@click.option("--anyway", is_flag=True, help="Fly what physics forbids.")
@clock_options
@flight_options
@click.option(
    "--output",
    "outputs",
    multiple=True,
    metavar="FILE",
    shell_complete=a_file(),
    help="Write one row a flight (.csv, .json, .npz, .mat, .parquet) or the picture (.png, .svg, .pdf); repeatable.",
)
@force_option
@json_option
def basin_command(
    gait_file: str,
    bias: Sequence[float],
    anyway: bool,
    vehicle: str | None,
    coefficients: Any,
    period: float | None,
    law: str | None,
    outputs: Sequence[str],
    force: bool,
    as_json: bool,
    **options: Any,
) -> int:
    """Fly a gait, and its biased gaits, from rest at every attitude of a grid, and say from which it settles.

    GAIT_FILE is a gait table of any format, a saved plan, a request, which is planned first, or gait1 to gait4 of the
    paper. Beside what settled stands what the determinant says: the acceptable attitudes, at which the gait is never
    singular. The exit code is 1 if physics forbids one of the gaits. Needs mujoco: pip install 'gaitgraph[sim]'.
    """
    from gaitgraph.flight.basins import basins_of
    from gaitgraph.flight.engine import mujoco_library
    from gaitgraph.plots.flight_outputs import check_basin_outputs, write_basins

    check_basin_outputs(outputs, force=force)
    mujoco_library()  # MissingExtra, before anything is read
    refuse_two_limits(options)
    file, duration = options.get("settings_file"), options.get("duration")
    settings = settings_from_options(options)
    if settings.reference != "attitude":
        raise InputError(f"settings file {file!r}: reference: {settings.reference!r}; allowed for a basin is attitude")
    if 1.0 in bias:
        raise InputError("--bias: 1; allowed are others, for the gait itself, which η = 1 is, is flown in any case")
    asked = {name: value for name, value in options.items() if value is not None}
    given = {**asked, "period": period, "law": law, "duration": duration, "bias": bias or None}
    flags = {name: (f"--{name}", value) for name, value in given.items()}
    with working(f"reading {gait_file}") as progress, as_options(**flags):
        try:
            timed = timed_of_argument(gait_file, vehicle=vehicle, coefficients=coefficients, period=period, law=law)
        except Infeasible as error:
            return _refused(f"there is no gait to fly: {error}", as_json=as_json)
        progress("flying")
        basins = basins_of(
            timed, biases=(1.0, *bias), settings=settings, anyway=anyway, progress=progress.part, **asked
        )
        if outputs:
            progress("writing")
            write_basins(basins, outputs, force=force)
    warnings = [told_warnings(basin.timed, basin.warnings, basin.eta) for basin in basins]
    if as_json:
        about = {
            "vehicle": timed.gait.vehicle.name,
            "settings": basins[0].settings.as_mapping(),
            "outputs": list(outputs),
        }
        told = [basin.as_mapping() | {"warnings": one} for basin, one in zip(basins, warnings, strict=True)]
        print_json({"basins": told, **about})
    else:
        lines = []
        for basin, one in zip(basins, warnings, strict=True):
            lines += [str(basin), *(f"warning: {warning}" for warning in one)]
        print_text("\n".join([*lines, *(f"wrote {name}" for name in outputs)]))
    return 1 if any(basin.refusal for basin in basins) else 0


def _refused(reason: str, *, as_json: bool) -> int:
    if as_json:
        print_json({"basins": [], "reason": reason})
    else:
        print_text(reason)
    return 1
