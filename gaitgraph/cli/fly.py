"""The command fly: a gait in the physics engine, with its report, its tables, plots and film."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from gaitgraph.cli import options
from gaitgraph.cli.options import Kind, option
from gaitgraph.cli.terminal import Working, show
from gaitgraph.errors import Infeasible, InputError

if TYPE_CHECKING:
    from gaitgraph.flight.course import Course

_REFERENCES = ("attitude", "hover", "step", "line", "circle")
# The references that a setting has an effect with.
_SERVES = {
    "size": _REFERENCES[2:],
    "lap": _REFERENCES[3:],
    "position_stiffness": _REFERENCES[1:],
    "position_damping": _REFERENCES[1:],
}


def _attitude(text: str) -> tuple[float, float]:
    from gaitgraph.angles import angle_from_text

    roll, pitch = (angle_from_text(part.strip(), "attitude") for part in text.split(","))
    return roll, pitch


def _wind(text: str) -> tuple[float, ...]:
    numbers = tuple(map(float, text.split(",")))
    if len(numbers) not in (2, 3):
        raise ValueError
    return numbers


@options.command("Fly a gait in a physics engine.")
@options.flown_gait_file
@option(
    "--attitude",
    "ROLL,PITCH",
    "At the start.  [default: 0.3,-0.2 to level out, else level]",
    type=Kind("ROLL,PITCH, two angles", _attitude),
)
@options.flight_clock
@option("--bias", "ETA", "Fly with α3 and α4 scaled by η in (0, 1].")
@click.option("--from-hover", "hovers", is_flag=True, help="From hover into the gait, around it, and back.")
@option("--periods", "N", "How often around it, with --from-hover.  [default: 2]")
@options.flag("--anyway", "Fly what is not flyable.")
@option("--reference", "NAME", "attitude, hover, step, line or circle.  [default: attitude]", words=_REFERENCES)
@option("--size", "METRES", "Ahead to a step, a line's end, a circle's centre.  [default: 1]")
@option("--lap", "SECONDS", "Of a line or a circle, from rest to rest.  [default: 6]")
@option("--position-stiffness", "X", "kp of x and y, per s².  [default: 2.25]")
@option("--position-damping", "X", "kd of x and y, per s.  [default: 3]")
@option("--attitude-noise", "ANGLE", "Standard deviation of the sensors' error.  [default: 0]")
@option("--rate-noise", "ANGLE", "The same of angular rates, per second.  [default: 0]")
@option("--position-noise", "METRES", "The same of positions.  [default: 0]")
@option("--velocity-noise", "M/S", "The same of velocities.  [default: 0]")
@option("--gust", "M/S", "Standard deviation of the wind.  [default: 0]")
@option("--seed", "N", "Of noise and gusts.  [default: 0]")
@option(
    "--wind", "X,Y[,Z]", "Mean wind in m/s.  [default: 0,0]", type=Kind("two or three numbers X,Y[,Z] (m/s)", _wind)
)
@options.flight_settings
@options.output("Write a table, a plot (.png, .svg, .pdf) or a film (.gif, .mp4); repeatable.")
@options.force
@options.flag("--render", "Let the engine render the film, where it can.  [default: drawn]")
@options.flag("--view", "Then show the flight in the engine's viewer.")
@options.as_json
def fly_command(
    gait_file: str,
    bias: float | None = None,
    hovers: bool = False,
    periods: int | None = None,
    anyway: bool = False,
    outputs: tuple[str, ...] = (),
    force: bool = False,
    render: bool = False,
    view: bool = False,
    as_json: bool = False,
    **given: Any,
) -> int:
    """Fly a gait by feedback linearisation, from an attitude that it is to level out, or along a reference.

    GAIT_FILE is a gait table of any format, a saved plan, a request, which is planned first, or gait1 to gait4 of the
    paper. The exit code is 1 if the flight does not settle, or is refused before take-off because the gait cannot
    fly, with the reason. Needs mujoco: pip install 'gaitgraph[sim]'.
    """
    from gaitgraph.flight.course import biased_timed_gait, from_hover, repeated
    from gaitgraph.flight.engine import check_rendering, check_screen, mujoco_library, show_flight
    from gaitgraph.flight.record import record_of
    from gaitgraph.flight.simulation import checked_attitude, fly
    from gaitgraph.gait.gait import Gait
    from gaitgraph.invertibility.matrices import coefficients_of
    from gaitgraph.plots.films import is_film
    from gaitgraph.plots.flights import check_flight_outputs, write_flight
    from gaitgraph.vehicle import PAPER

    check_flight_outputs(outputs, force=force)
    if periods is not None and not hovers:
        raise InputError("--periods has an effect with --from-hover only; --duration SECONDS flies for longer")
    asked = dict(given)
    settings = options.settings_from_options(given)
    for name, serves in _SERVES.items():
        if name in asked and settings.reference not in serves:
            raise InputError(
                f"--{name.replace('_', '-')} has an effect with --reference {', '.join(serves)} only, "
                f"got the reference {settings.reference}"
            )
    with options.named_in_errors(asked):
        start = checked_attitude(asked["attitude"]) if "attitude" in asked else None
    mujoco_library()
    if render:
        if not any(map(is_film, outputs)):
            raise InputError("--render needs a film, got no --output FILE.gif")
        check_rendering(PAPER)
    if view:
        check_screen()

    def refused(course: Course, reason: str) -> Any:
        return record_of(course, settings, start or (0.0, 0.0), failure=("refused", reason))

    with (
        Working("planning") as progress,
        options.named_in_errors({**asked, "bias": bias, "periods": periods}, eta="bias"),
    ):
        try:
            timed = options.timed_gait(gait_file, given)
        except Infeasible as error:
            # The record needs a gait: one that does not move.
            vehicle = asked.get("vehicle", PAPER)
            still = Gait(alpha=[[0.0] * 4], vehicle=vehicle, coefficients=coefficients_of(vehicle)).parametrize()
            flight = refused(repeated(still), f"there is no gait to fly: {error}")
        else:
            flown = timed if bias is None else biased_timed_gait(timed, bias)
            timed.gait.vehicle.require("mass", "inertia", "arm_length", purpose="flight")
            course: Any = flown
            if hovers:
                course = from_hover(flown, anyway=anyway, **({} if periods is None else {"periods": periods}))
            progress("flying")
            if isinstance(course, str):  # why there is none
                flight = refused(repeated(flown), f"refused before take-off: {course}")
            else:
                if hovers and settings.duration is None:
                    settings = replace(settings, duration=course.duration)
                flight = fly(course, attitude=start, settings=settings, anyway=anyway, progress=progress.part)
        warnings = options.flight_warnings(flight.course.timed, flight.warnings, bias)
        written: tuple[str, ...] = outputs if len(flight.rows) else ()
        if not len(flight.rows):
            warnings = [one.replace("flown although it is not flyable", "it is not flyable") for one in warnings]
            if outputs:
                warnings.append(f"nothing was flown, so {', '.join(outputs)} is not written")
        if written:
            progress(f"writing {', '.join(written)}")
            write_flight(flight, written, force=force, rendered=render)
    lines = [*(f"warning: {one}" for one in warnings), *(f"wrote {name}" for name in written)]
    show(flight, as_json=as_json, more={"warnings": warnings, "outputs": list(written)}, lines=lines)
    if view and len(flight.rows):
        show_flight(flight)
    return 0 if flight else 1
