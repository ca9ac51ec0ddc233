"""The command fly: a gait in the physics engine, with its report, its tables, plots and film."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from gaitgraph.cli.commands import command
from gaitgraph.cli.flight_options import (
    PAPER_NAMES,
    angles_from_text,
    clock_options,
    flight_options,
    refuse_two_limits,
    settings_from_options,
    timed_of_argument,
    told_warnings,
)
from gaitgraph.cli.options import a_file, a_word, as_options, force_option, json_option, vehicle_or_none
from gaitgraph.cli.terminal import print_json, print_text, working
from gaitgraph.errors import InputError, shown

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from gaitgraph.flight.course import Course
    from gaitgraph.timing.timed_gait import TimedGait

__all__ = ["fly_command"]

_REFERENCES = ("attitude", "hover", "step", "line", "circle")
_PLACES = _REFERENCES[1:]
_IDLE = {
    "size": ("step", "line", "circle"),
    "lap": ("line", "circle"),
    "position_stiffness": _PLACES,
    "position_damping": _PLACES,
}
"""Settings that do nothing but with some references."""


def _own_settings(command: Callable[..., int]) -> Callable[..., int]:
    """Add the settings that a single flight has beside those of every flight."""
    number, angle = {"type": float}, {"metavar": "ANGLE"}
    named: tuple[tuple[str, dict[str, Any], str], ...] = (
        ("--size", number | {"metavar": "METRES"}, "Ahead to a step, a line's end, a circle's centre.  [default: 1]"),
        ("--lap", number | {"metavar": "SECONDS"}, "Of a line or a circle, from rest to rest.  [default: 6]"),
        ("--position-stiffness", number | {"metavar": "X"}, "kp of x and y, per s².  [default: 2.25]"),
        ("--position-damping", number | {"metavar": "X"}, "kd of x and y, per s.  [default: 3]"),
        ("--attitude-noise", angle, "Standard deviation of the sensors' error.  [default: 0]"),
        ("--rate-noise", angle, "The same of angular rates, per second.  [default: 0]"),
        ("--position-noise", number | {"metavar": "METRES"}, "The same of places.  [default: 0]"),
        ("--velocity-noise", number | {"metavar": "M/S"}, "The same of velocities.  [default: 0]"),
        ("--gust", number | {"metavar": "M/S"}, "Standard deviation of the wind.  [default: 0]"),
        ("--seed", {"type": int, "metavar": "N"}, "Of noise and gusts.  [default: 0]"),
    )
    options = [click.option(flag, help=text, **given) for flag, given, text in named]
    wind = click.option("--wind", metavar="X,Y[,Z]", help="Mean wind in m/s.  [default: 0,0]")
    reference = click.option(
        "--reference",
        metavar="NAME",
        shell_complete=a_word(*_REFERENCES),
        help="attitude, hover, step, line or circle.  [default: attitude]",
    )
    for option in reversed([reference, *options, wind]):
        command = option(command)
    return command


@command("Fly a gait in a physics engine.")
@click.argument("gait_file", metavar="GAIT_FILE", shell_complete=a_file(*PAPER_NAMES))
@click.option("--attitude", metavar="ROLL,PITCH", help="At the start.  [default: 0.3,-0.2 to level out, else level]")
@clock_options
@click.option("--bias", type=float, metavar="ETA", help="Fly with α3 and α4 scaled by η in (0, 1].")
@click.option("--from-hover", "hovers", is_flag=True, help="From hover into the gait, around it, and back.")
@click.option("--periods", type=int, metavar="N", help="How often around it, with --from-hover.  [default: 2]")
@click.option("--anyway", is_flag=True, help="Fly what is not flyable.")
@_own_settings
@flight_options
@click.option(
    "--output",
    "outputs",
    multiple=True,
    metavar="FILE",
    shell_complete=a_file(),
    help="Write a table, a plot (.png, .svg, .pdf) or a film (.gif); repeatable.",
)
@force_option
@click.option("--render", is_flag=True, help="Let the engine render the film, where it can.  [default: drawn]")
@click.option("--view", is_flag=True, help="Then show the flight in the engine's viewer.")
@json_option
def fly_command(
    gait_file: str,
    attitude: str | None,
    vehicle: str | None,
    coefficients: Any,
    period: float | None,
    law: str | None,
    bias: float | None,
    hovers: bool,
    periods: int | None,
    anyway: bool,
    outputs: Sequence[str],
    force: bool,
    render: bool,
    view: bool,
    as_json: bool,
    **options: Any,
) -> int:
    """Fly a gait by feedback linearisation, from an attitude that it is to level out, or along a reference.

    GAIT_FILE is a gait table of any format, a saved plan, a request, which is planned first, or gait1 to gait4 of the
    paper. The exit code is 1 if the flight does not settle, or is refused before take-off because the gait cannot
    fly, with the reason. Needs mujoco: pip install 'gaitgraph[sim]'.
    """
    from gaitgraph.errors import Infeasible
    from gaitgraph.flight.course import from_hover
    from gaitgraph.flight.engine import mujoco_library
    from gaitgraph.flight.gait_file import biased_timed_gait
    from gaitgraph.flight.record import record_of
    from gaitgraph.flight.simulation import checked_attitude, fly
    from gaitgraph.plots.flight_outputs import FILM, check_flight_outputs, write_flight

    check_flight_outputs(outputs, force=force)
    if periods is not None and not hovers:
        raise InputError(f"--periods: {periods}; allowed is with --from-hover; --duration SECONDS flies for longer")
    if options.get("wind") is not None:
        options["wind"] = _numbers(options["wind"], "--wind")
    refuse_two_limits(options)
    asked = {name: options.get(name) for name in _IDLE}
    settings = settings_from_options(options)
    for name, serves in _IDLE.items():
        if asked[name] is not None and settings.reference not in serves:
            raise InputError(
                f"--{name.replace('_', '-')}: {asked[name]:g} with the reference {settings.reference}; "
                f"allowed is with --reference {', '.join(serves)}"
            )
    with as_options(attitude=("--attitude", attitude)):
        start = None if attitude is None else checked_attitude(angles_from_text(attitude, "--attitude", "ROLL,PITCH"))
    mujoco_library()
    if render:
        from gaitgraph.flight.engine import check_rendering
        from gaitgraph.vehicle import PAPER

        if not any(name.lower().endswith(FILM) for name in outputs):
            raise InputError(f"--render: no film to render; allowed is with --output FILE{FILM}")
        check_rendering(PAPER)
    if view:
        from gaitgraph.flight.engine import check_screen

        check_screen()
    flags = {
        "period": ("--period", period),
        "law": ("--law", law),
        "eta": ("--bias", bias),
        "periods": ("--periods", periods),
    }
    with working("planning") as progress, as_options(**flags):
        try:
            timed = timed_of_argument(gait_file, vehicle=vehicle, coefficients=coefficients, period=period, law=law)
        except Infeasible as error:
            nothing = _hovering(vehicle)
            flight = record_of(
                nothing, settings, start or (0.0, 0.0), failure=("refused", f"there is no gait to fly: {error}")
            )
        else:
            flown: Course | TimedGait = timed if bias is None else biased_timed_gait(timed, bias)
            timed.gait.vehicle.require("mass", "inertia", "arm_length", purpose="flight")
            refusal = ""
            if hovers:
                given = {} if periods is None else {"periods": periods}
                way = from_hover(flown, anyway=anyway, **given)  # type: ignore[arg-type]
                if isinstance(way, str):
                    refusal = way
                else:
                    flown = way
                    settings = settings if settings.duration is not None else replace(settings, duration=way.duration)
            progress("flying")
            if refusal:
                flight = record_of(
                    _course(flown),
                    settings,
                    start or (0.0, 0.0),
                    failure=("refused", f"refused before take-off: {refusal}"),
                )
            else:
                flight = fly(flown, attitude=start, settings=settings, anyway=anyway, progress=progress.part)
        warnings = told_warnings(flight.course.timed, flight.warnings, bias)
        if not len(flight.rows):
            warnings = [one.replace("flown although it is not flyable", "it is not flyable") for one in warnings]
        written: Sequence[str] = outputs if len(flight.rows) else ()
        if written:
            progress(f"writing {', '.join(written)}")
            write_flight(flight, written, force=force, rendered=render)
        elif outputs:
            warnings.append(f"nothing was flown, so {', '.join(outputs)} is not written")
    if as_json:
        print_json({**flight.as_mapping(), "warnings": warnings, "outputs": list(written)})
    else:
        lines = [str(flight), *(f"warning: {one}" for one in warnings)]
        print_text("\n".join([*lines, *(f"wrote {name}" for name in written)]))
    if view and len(flight.rows):
        from gaitgraph.flight.engine import show_flight

        show_flight(flight)
    return 0 if flight else 1


def _hovering(vehicle: str | None) -> Course:
    """Return what stands for a gait that there is none of, in the record of a flight that was not begun."""
    import numpy as np

    from gaitgraph.gait.gait import Gait
    from gaitgraph.invertibility.matrices import coefficients_of
    from gaitgraph.timing.timed_gait import parametrize
    from gaitgraph.vehicle import PAPER

    model = vehicle_or_none(vehicle) or PAPER
    still = Gait(alpha=np.zeros((1, 4)), vehicle=model, coefficients=coefficients_of(model))
    return _course(parametrize(still, 1.0))


def _course(flown: Course | TimedGait) -> Course:
    from gaitgraph.flight.course import Course, repeated

    return flown if isinstance(flown, Course) else repeated(flown)


def _numbers(text: str, flag: str) -> tuple[float, ...]:
    """Return the numbers of an option such as ``X,Y``; InputError if a part is none, or there are not two or three."""
    try:
        numbers = tuple(float(part) for part in text.split(","))
    except ValueError:
        numbers = ()
    if len(numbers) not in (2, 3):
        raise InputError(f"{flag}: {shown(text)}; allowed are two or three numbers with commas between (m/s)")
    return numbers
