"""The commands that fly gaits in the physics engine: fly, and basin, which flies from many attitudes."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from gaitgraph.cli import (
    TIMED,
    Paths,
    Working,
    command,
    flag,
    gait_in,
    named_in_errors,
    one_of,
    option,
    show,
    tell,
)
from gaitgraph.errors import InputError

if TYPE_CHECKING:
    from gaitgraph.flight.flight import FlightSettings
    from gaitgraph.timing.timed_gait import TimedGait

_REFERENCES = ("attitude", "hover", "step", "line", "circle")
# From which of the references on a setting has an effect.
_SERVES = {"size": 2, "lap": 3, "position_stiffness": 1, "position_damping": 1}

SETTINGS = (
    option(
        "--settings",
        "FILE",
        "A TOML file with a table [flight] of settings; options replace them.",
    ),
    option(
        "--duration",
        "SECONDS",
        "Duration of the flight.  [default: a period, at least 3]",
    ),
    option(
        "--tolerance",
        "X",
        "Largest error that counts as settled (rad, m).  [default: 0.02]",
    ),
    option(
        "--attitude-stiffness", "X", "kp of roll, pitch, yaw, per s².  [default: 100]"
    ),
    option("--attitude-damping", "X", "kd of roll, pitch, yaw, per s.  [default: 20]"),
    option("--altitude-stiffness", "X", "kp of altitude, per s².  [default: 100]"),
    option("--altitude-damping", "X", "kd of altitude, per s.  [default: 20]"),
    flag("--no-saturation", "No limits of thrust: negative thrust too."),
    option(
        "--thrust-limit",
        "NEWTON",
        "Largest thrust of a rotor.  [default: the vehicle's, if any]",
    ),
    option(
        "--servo-lag", "SECONDS", "Time constant.  [default: the vehicle's, if any]"
    ),
    option(
        "--servo-rate",
        "ANGLE",
        "Largest tilt rate per second.  [default: the vehicle's]",
    ),
    one_of(
        "--arms",
        "planned",
        "served",
        of="Tilt angles that the controller assumes: ",
        default="planned; served if the vehicle's servos report theirs",
    ),
    option(
        "--floor",
        "X",
        "Abort when the least singular value falls below this.  [default: 0.01]",
    ),
    option("--step", "SECONDS", "Time step of the engine.  [default: 0.001]"),
    option("--control-rate", "HZ", "Rate of the controller.  [default: 1000]"),
)


@command(
    "Fly a gait in a physics engine.",
    "gait_file once",
    option(
        "--attitude",
        "ROLL,PITCH",
        "Attitude at the start.  [default: 0.3,-0.2; level with another --reference]",
    ),
    "period_of_file law_of_file vehicle coefficients",
    option("--bias", "ETA", "Fly with α3 and α4 scaled by η in (0, 1]."),
    click.option(
        "--from-hover",
        "hovers",
        is_flag=True,
        help="Start from hover, enter the gait, and return to hover.",
    ),
    option("--periods", "N", "Periods of the gait, with --from-hover.  [default: 2]"),
    flag("--anyway", "Fly even if the gait is not flyable."),
    one_of("--reference", *_REFERENCES),
    option(
        "--size",
        "METRES",
        "Distance to a step, a line's end, a circle's centre.  [default: 1]",
    ),
    option(
        "--lap",
        "SECONDS",
        "Duration of a line or a circle, from rest to rest.  [default: 6]",
    ),
    option("--position-stiffness", "X", "kp of x and y, per s².  [default: 2.25]"),
    option("--position-damping", "X", "kd of x and y, per s.  [default: 3]"),
    option(
        "--attitude-noise",
        "ANGLE",
        "Standard deviation of the sensors' error.  [default: 0]",
    ),
    option(
        "--rate-noise", "ANGLE", "The same of angular rates, per second.  [default: 0]"
    ),
    option("--position-noise", "METRES", "The same of positions.  [default: 0]"),
    option("--velocity-noise", "M/S", "The same of velocities.  [default: 0]"),
    option("--gust", "M/S", "Standard deviation of the wind.  [default: 0]"),
    option("--seed", "N", "Seed of noise and gusts.  [default: 0]"),
    option("--wind", "X,Y[,Z]", "Mean wind in m/s.  [default: 0,0]"),
    *SETTINGS,
    "outputs force",
    "json",
)
def fly_command(
    gait_file: str,
    bias: float | None = None,
    hovers: bool = False,
    periods: int | None = None,
    anyway: bool = False,
    outputs: Paths = (),
    force: bool = False,
    once: bool = False,
    **given: Any,
) -> int:
    """Fly a gait by feedback linearisation: level out from an attitude, or follow a reference.

    GAIT_FILE is a gait table of any format, a saved plan, a request, which is planned first, or gait1 to gait4 of the
    paper. The exit code is 1 if the flight does not settle, or is refused before take-off because the gait cannot
    fly, with the reason. Needs mujoco: pip install 'gaitgraph[sim]'.
    """
    from gaitgraph.flight.course import from_hover, repeated
    from gaitgraph.flight.flight import record_of
    from gaitgraph.flight.simulation import checked_attitude, fly

    asked = {**given, "bias": bias, "periods": periods}
    settings = checked_settings(given, outputs, of="flight", force=force)
    if periods is not None and not hovers:
        raise InputError(
            "--periods has an effect with --from-hover only; --duration SECONDS flies for longer"
        )
    for name in asked.keys() & _SERVES.keys():
        if settings.reference not in (serves := _REFERENCES[_SERVES[name] :]):
            raise InputError(
                f"--{name.replace('_', '-')} has an effect with --reference {', '.join(serves)} only"
            )
    with Working("planning") as progress, named_in_errors(asked):
        attitude = given.pop("attitude", None)
        start = None if attitude is None else checked_attitude(attitude)
        source = gait_in(gait_file, given, TIMED, once=once)
        timed = _flown(source, bias, joined=hovers, **given)
        course: Any = timed
        if hovers:
            course = from_hover(
                timed,
                anyway=anyway,
                **({} if periods is None else {"periods": periods}),
            )
            course = (
                f"refused before take-off: {course}"
                if isinstance(course, str)
                else course
            )
        if isinstance(course, str):  # why there is none
            flight = record_of(
                repeated(timed),
                settings,
                start or (0.0, 0.0),
                failure=("refused", course),
            )
        else:
            progress("flying")
            if hovers and settings.duration is None:
                settings = replace(settings, duration=course.duration)
            flight = fly(course, attitude=start, settings=settings, anyway=anyway)
        warnings, written = list(flight.warnings), outputs if len(flight.rows) else ()
        if outputs and not written:
            warnings.append(
                f"nothing was flown, so {', '.join(outputs)} is not written"
            )
        if written:
            progress(f"writing {', '.join(written)}")
            flight.write(*written, force=force)
    lines = [
        *(f"warning: {one}" for one in warnings),
        *(f"wrote {name}" for name in written),
    ]
    return show(
        flight, more={"warnings": warnings, "outputs": list(written)}, lines=lines
    )


def _flown(source: Any, bias: float | None, *, joined: bool, **given: Any) -> TimedGait:
    """Return the gait to fly; one that is `joined` from hover, as its table states it between its rows too."""
    from gaitgraph.flight.course import biased_timed_gait
    from gaitgraph.timing.joining import played
    from gaitgraph.timing.timed_gait import timed_gait_of

    if joined and bias is None and not {"period", "law"} & given.keys():
        return played(source, **given)
    timed = timed_gait_of(source, **given)
    return timed if bias is None else biased_timed_gait(timed, bias)


def checked_settings(
    given: dict[str, Any],
    outputs: Paths,
    *,
    of: Literal["flight", "basin"],
    force: bool,
) -> FlightSettings:
    """Check outputs and mujoco, and return the settings, which are taken out of the options.

    Errors of the settings name the option or the file.
    """
    from gaitgraph.files import from_toml_file
    from gaitgraph.flight.engine import mujoco_library
    from gaitgraph.flight.flight import FlightSettings, settings_from_mapping
    from gaitgraph.plots.flights import check_flight_outputs

    check_flight_outputs(outputs, of=of, force=force)
    mujoco_library()
    file = given.pop("settings", None)
    stated = {
        field.name: given.pop(field.name)
        for field in fields(FlightSettings)
        if field.name in given
    }
    if given.pop("no_saturation", False):
        if "thrust_limit" in stated:
            raise InputError(
                f"--thrust-limit {stated['thrust_limit']:g} cannot be combined with --no-saturation"
            )
        stated["saturation"] = False
    values = {} if file is None else from_toml_file(Path(file), "flight", dict)
    try:
        # Judged together: an option may replace what is wrong in the file.
        with named_in_errors(stated):
            return settings_from_mapping(values | stated)
    except InputError as error:
        if file is None or error.field in stated:
            raise
        raise InputError(f"flight file {file!r}: {error}") from error


@command(
    "From which roll and pitch a gait settles, by flying from each.",
    "gait_file",
    option("--bias", "ETA", "Also α3 and α4 scaled by η; repeatable.", multiple=True),
    option(
        "--resolution", "N", "Attitudes along each side of the grid.  [default: 17]"
    ),
    option(
        "--extent", "ANGLE", "Largest roll and pitch at the start.  [default: 80deg]"
    ),
    option("--begins", "N", "Moments of the period to take off at.  [default: 1]"),
    flag("--anyway", "Fly even gaits that cannot fly."),
    "period_of_file law_of_file vehicle coefficients",
    *SETTINGS,
    "outputs force json",
)
def basin_command(
    gait_file: str,
    bias: tuple[float, ...] = (),
    outputs: Paths = (),
    force: bool = False,
    **given: Any,
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
    grid = {
        name: given.pop(name)
        for name in ("resolution", "extent", "begins", "anyway")
        if name in given
    }
    with Working(f"reading {gait_file}") as progress, named_in_errors(asked):
        source = gait_in(gait_file, given, TIMED)
        timed = timed_gait_of(source, **given)
        progress("flying")
        basins = basins_of(
            timed,
            bias=(1.0, *bias),
            settings=settings,
            progress=progress.part,
            **grid,
        )
        if outputs:
            progress("writing")
            write_basins(basins, outputs, force=force)
    answer = {
        "basins": [basin.as_mapping() for basin in basins],
        "vehicle": timed.gait.vehicle.name,
    }
    lines = [
        line
        for basin in basins
        for line in (str(basin), *(f"warning: {one}" for one in basin.warnings))
    ]
    lines += [f"wrote {name}" for name in outputs]
    tell(
        {
            **answer,
            "settings": basins[0].settings.as_mapping(),
            "outputs": list(outputs),
        },
        lines,
    )
    return 1 if any(basin.refusal for basin in basins) else 0
