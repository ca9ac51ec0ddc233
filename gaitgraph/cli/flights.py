"""The commands that fly gaits in the physics engine: fly, and basin, which flies from many attitudes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from gaitgraph.cli.inputs import gait_in
from gaitgraph.cli.options import (
    COUNT,
    SECONDS,
    SHARE,
    Pair,
    common_options,
    gait_file_argument,
    gait_outputs_options,
    once_option,
    period_of_file_option,
)
from gaitgraph.cli.output import show, tell, working

if TYPE_CHECKING:
    from gaitgraph.cli.options import Chosen
    from gaitgraph.flight.flight import Flight, FlightSettings
    from gaitgraph.gait.given import GaitLike
    from gaitgraph.timing.timed_gait import TimedGait


settings_option = click.option(
    "--settings",
    type=click.Path(),
    help="A TOML file with a table [flight]: gains, limits, servos, noise, wind.",
)


@click.command("fly", short_help="Fly a gait in a physics engine.")
@gait_file_argument
@once_option
@click.option(
    "--attitude",
    type=Pair(),
    metavar="ROLL,PITCH",
    show_default="0.3,-0.2; level with another --reference",
    help="Attitude at the start.",
)
@click.option(
    "--reference",
    type=click.Choice(["attitude", "hover", "step", "line", "circle"]),
    show_default="what --settings says, else attitude",
    help="What the controller holds or follows.",
)
@settings_option
@click.option(
    "--duration",
    type=SECONDS,
    metavar="SECONDS",
    show_default="what --settings says; else a period, at least 3, 8 or a lap and 4 by --reference",
    help="Duration of the flight.",
)
@period_of_file_option
@click.option(
    "--bias",
    type=SHARE,
    help="Scale α3 and α4 by this factor η.",
)
@click.option(
    "--from-hover",
    is_flag=True,
    help="Start in hover, enter the gait, run it twice, return to hover.",
)
@click.option("--anyway", is_flag=True, help="Fly even if the gait is not flyable.")
@gait_outputs_options
@common_options
def fly_command(
    gait_file: str,
    once: bool,
    attitude: tuple[float, float] | None,
    reference: str | None,
    settings: str | None,
    duration: float | None,
    period: float | None,
    bias: float | None,
    from_hover: bool,
    anyway: bool,
    outputs: tuple[str, ...],
    force: bool,
    chosen: Chosen,
) -> int:
    """Fly a gait by feedback linearisation: level out from an attitude, or follow a reference.

    GAIT_FILE is a gait table of any format, a saved plan, a request, which is planned first, or gait1 to gait4 of the
    paper. The exit code is 1 if the flight does not settle, or is refused before take-off because the gait cannot
    fly, with the reason. Needs mujoco: pip install 'gaitgraph[sim]'.
    """
    from gaitgraph.flight.simulation import checked_attitude, fly

    _check_flight(outputs, "flight", force=force)
    flight_settings = _settings_of(settings, reference=reference, duration=duration)
    if attitude is not None:
        attitude = checked_attitude(attitude)
    with working("planning") as progress:
        source = gait_in(
            gait_file,
            once=once,
            **chosen,
            period=period,
        )
        timed = _timed_gait_of(
            source,
            chosen=chosen,
            period=period,
            bias=bias,
            is_joined=from_hover,
        )
        progress("flying")
        if from_hover:
            flight = _flight_from_hover(timed, attitude, flight_settings, anyway=anyway)
        else:
            flight = fly(
                timed, attitude=attitude, settings=flight_settings, anyway=anyway
            )
        warnings = list(flight.warnings)
        if outputs and not len(flight.rows):
            not_written = ", ".join(outputs)
            warnings.append(f"nothing was flown, so {not_written} is not written")
            outputs = ()
        if outputs:
            progress(f"writing {', '.join(outputs)}")
            flight.write(*outputs, force=force)
    lines = [f"warning: {warning}" for warning in warnings]
    return show(flight, outputs=outputs, more={"warnings": warnings}, lines=lines)


def _timed_gait_of(
    source: GaitLike,
    *,
    chosen: Chosen,
    period: float | None,
    bias: float | None,
    is_joined: bool,
) -> TimedGait:
    """Return the gait to fly; one that is joined from hover, as its table states it between its rows too."""
    from gaitgraph.flight.course import biased_timed_gait
    from gaitgraph.timing.joining import played
    from gaitgraph.timing.timed_gait import timed_gait_of

    if is_joined and bias is None and period is None:
        return played(source, **chosen)
    timed = timed_gait_of(source, **chosen, period=period)
    if bias is not None:
        timed = biased_timed_gait(timed, bias)
    return timed


def _flight_from_hover(
    timed: TimedGait,
    attitude: tuple[float, float] | None,
    settings: FlightSettings,
    *,
    anyway: bool,
) -> Flight:
    """Return the flight from hover into a gait and back; one that has no way is refused before take-off."""
    from gaitgraph.flight.course import from_hover, repeated
    from gaitgraph.flight.flight import record_of
    from gaitgraph.flight.simulation import fly

    attitude = attitude or (0.0, 0.0)
    course = from_hover(timed, anyway=anyway)
    if isinstance(course, str):  # why there is none
        failure: Any = "refused", f"refused before take-off: {course}"
        return record_of(repeated(timed), settings, attitude, failure=failure)
    if settings.duration is None:
        settings = replace(settings, duration=course.duration)
    return fly(course, attitude=attitude, settings=settings, anyway=anyway)


def _check_flight(
    outputs: tuple[str, ...], of: Literal["flight", "basin"], *, force: bool
) -> None:
    """Raise before any work is done if an output cannot be written, or if the engine is missing."""
    from gaitgraph.flight.engine import mujoco_library
    from gaitgraph.plots.flights import check_flight_outputs

    check_flight_outputs(outputs, of=of, force=force)
    mujoco_library()


def _settings_of(
    file: str | None, *, reference: str | None = None, duration: float | None = None
) -> FlightSettings:
    """Return the settings of a file, or the default ones; options that are stated replace them."""
    from gaitgraph.files import from_toml_file
    from gaitgraph.flight.flight import settings_from_mapping

    options = {"reference": reference, "duration": duration}
    stated = {name: value for name, value in options.items() if value is not None}
    if file is None:
        return settings_from_mapping(stated)
    # Judged together: an option may replace what is wrong in the file.
    return from_toml_file(
        Path(file), "flight", lambda content: settings_from_mapping(content | stated)
    )


@click.command(
    "basin", short_help="From which roll and pitch a gait settles, by flying from each."
)
@gait_file_argument
@click.option(
    "--bias",
    type=SHARE,
    multiple=True,
    help="Fly also with α3 and α4 scaled by η; repeatable.",
)
@click.option(
    "--resolution",
    type=COUNT,
    default=17,
    help="Attitudes along each side of the grid.",
)
@click.option("--anyway", is_flag=True, help="Fly even gaits that are not flyable.")
@settings_option
@period_of_file_option
@gait_outputs_options
@common_options
def basin_command(
    gait_file: str,
    bias: tuple[float, ...],
    resolution: int,
    anyway: bool,
    settings: str | None,
    period: float | None,
    outputs: tuple[str, ...],
    force: bool,
    chosen: Chosen,
) -> int:
    """Fly a gait, and its biased gaits, from rest at every attitude of a grid, and report from which it settles.

    GAIT_FILE is a gait table of any format, a saved plan, a request, which is planned first, or gait1 to gait4 of the
    paper. The acceptable attitudes, at which the gait is never singular, are reported too. The exit code is 1 if one of
    the gaits cannot fly. Needs mujoco: pip install 'gaitgraph[sim]'.
    """
    from gaitgraph.flight.basins import basins_of
    from gaitgraph.plots.flights import write_basins
    from gaitgraph.timing.timed_gait import timed_gait_of

    _check_flight(outputs, "basin", force=force)
    flight_settings = _settings_of(settings)
    with working("flying") as progress:
        source = gait_in(gait_file, **chosen, period=period)
        timed = timed_gait_of(source, **chosen, period=period)
        basins = basins_of(
            timed,
            bias=(1.0, *bias),
            settings=flight_settings,
            resolution=resolution,
            anyway=anyway,
            progress=lambda fraction: progress(f"{100 * fraction:.0f} %"),
        )
        if outputs:
            progress("writing")
            write_basins(basins, outputs, force=force)
    lines = []
    for basin in basins:
        lines.append(str(basin))
        lines += [f"warning: {warning}" for warning in basin.warnings]
    lines += [f"wrote {name}" for name in outputs]
    content = {
        "basins": [basin.as_mapping() for basin in basins],
        "vehicle": timed.gait.vehicle.name,
        "settings": basins[0].settings.as_mapping(),
        "outputs": outputs,
    }
    tell(content, lines)
    return int(any(basin.refusal for basin in basins))
