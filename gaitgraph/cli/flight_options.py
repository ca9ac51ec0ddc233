"""Options that the commands of flight share, and the settings of a flight that they make."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from gaitgraph.cli.options import a_file, field_of, name_option, setting_options, vehicle_or_none
from gaitgraph.errors import InputError, did_you_mean, shown

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from gaitgraph.flight.settings import FlightSettings
    from gaitgraph.timing.timed_gait import TimedGait

__all__ = [
    "PAPER_NAMES",
    "angles_from_text",
    "clock_options",
    "flight_options",
    "refuse_two_limits",
    "settings_from_options",
    "timed_of_argument",
    "told_warnings",
]

PAPER_NAMES = ("gait1", "gait2", "gait3", "gait4")
"""What stands for the gaits of the paper's Section 5 where a file is asked for."""


def clock_options(command: Callable[..., int]) -> Callable[..., int]:
    """Add the options of :func:`gaitgraph.flight.gait_file.timed_gait_from_file`."""
    options = (
        click.option("--period", type=float, metavar="SECONDS", help="Period T.  [default: what the file says]"),
        name_option("--law", "smooth, constant-speed or equal-time.  [default: what the file says]"),
        setting_options,
    )
    return _with(command, options)


def flight_options(command: Callable[..., int]) -> Callable[..., int]:
    """Add the settings that every flight has, and ``--settings``: what :func:`settings_from_options` takes.

    The reference, noise and wind are the command's own.
    """
    gains = {
        "attitude-stiffness": ("kp of roll, pitch, yaw, per s².", "100"),
        "attitude-damping": ("kd of roll, pitch, yaw, per s.", "20"),
        "altitude-stiffness": ("kp of altitude, per s².", "100"),
        "altitude-damping": ("kd of altitude, per s.", "20"),
    }
    options = (
        click.option(
            "--settings",
            "settings_file",
            metavar="FILE",
            shell_complete=a_file(),
            help="A TOML file with a table [flight] of settings; options go before it.",
        ),
        click.option(
            "--duration",
            type=float,
            metavar="SECONDS",
            help="How long is flown.  [default: a period, 3 at least]",
        ),
        click.option("--tolerance", type=float, metavar="X", help="Settled within (rad, m).  [default: 0.02]"),
        *(
            click.option(f"--{name}", type=float, metavar="X", help=f"{text}  [default: {default}]")
            for name, (text, default) in gains.items()
        ),
        click.option("--no-saturation", is_flag=True, help="Let rotors push and pull without limit."),
        click.option(
            "--thrust-limit", type=float, metavar="NEWTON", help="Of a rotor.  [default: the vehicle's, if any]"
        ),
        click.option(
            "--servo-lag", type=float, metavar="SECONDS", help="Time constant.  [default: the vehicle's, if any]"
        ),
        click.option("--servo-rate", metavar="ANGLE", help="Largest tilt rate per second.  [default: the vehicle's]"),
        name_option("--arms", "Where the controller takes the arms to be: served or planned.  [default: served]"),
        click.option("--floor", type=float, metavar="X", help="Stop near a least singular value of.  [default: 0.01]"),
        click.option("--step", type=float, metavar="SECONDS", help="Of the engine.  [default: 0.001]"),
        click.option("--control-rate", type=float, metavar="HZ", help="How often thrusts are set.  [default: 1000]"),
    )
    return _with(command, options)


def settings_from_options(options: dict[str, Any]) -> FlightSettings:
    """Take the settings of a flight out of a command's options, and return them.

    Parameters
    ----------
    options
        The command's options by name; those of :func:`flight_options`, and any other that is named as a field of
        :class:`~gaitgraph.flight.settings.FlightSettings`, are taken out. None, a flag that is not set, and no value of
        a repeatable option leave the field as it is.

    Raises
    ------
    InputError, FileProblem
        If a value is not allowed, naming the option or the file that gave it.
    """
    from gaitgraph.flight.settings import FlightSettings, settings_from_mapping

    file = options.pop("settings_file", None)
    in_file = {} if file is None else _settings_in(Path(file))
    stated = {field.name: options.pop(field.name, None) for field in fields(FlightSettings)}
    stated = {name: value for name, value in stated.items() if value is not None and value != ()}
    if options.pop("no_saturation", False):
        stated["saturation"] = False
    try:
        return settings_from_mapping(in_file | stated)  # judged together: an option may replace what is wrong in a file
    except InputError as error:
        field = field_of(error)
        if not stated or (field in in_file and field not in stated):
            raise InputError(f"settings file {str(file)!r}: {error}") from error
        flag = "--no-saturation" if field == "saturation" else f"--{field.replace('_', '-')}"
        raise InputError(flag + str(error)[len(field) :]) from error


def refuse_two_limits(options: dict[str, Any]) -> None:
    """Raise InputError if a command's options set a limit of thrust and lift it."""
    limit = options.get("thrust_limit")
    if limit is not None and options.get("no_saturation"):
        raise InputError(f"--thrust-limit: {limit:g} with --no-saturation; allowed is one of the two")


def told_warnings(timed: TimedGait, warnings: Iterable[str], eta: float | None) -> list[str]:
    """Return what a reader should know of a flight: its warnings, and that a clock is that of no law.

    A gait that was biased by η is off the surfaces, as was asked for; a line is enough for what follows from that.
    """
    from gaitgraph.flight.course import refusal_and_warnings
    from gaitgraph.flight.gait_file import ROW_BY_ROW

    told = list(warnings)
    if eta is not None and eta != 1.0 and told:
        report = timed.check()
        off = next((check for check in report.checks if check.name == "on_surface" and not check.ok), None)
        if off is not None:
            follows = refusal_and_warnings(report)[1]
            said = f"biased by {eta:g} it is off the surfaces: max(|Rφ|, |Rθ|) = {off.value:.2g}, allowed {off.limit:g}"
            told = [said, *(one for one in told if one not in follows)]
    if timed.law == ROW_BY_ROW:
        told.append(
            f"times of the table are those of no law: {timed.samples} rows are flown straight from one to the next"
        )
    return told


def timed_of_argument(
    gait_file: str, *, vehicle: str | None, coefficients: Any, period: float | None, law: str | None
) -> TimedGait:
    """Return the gait of a file, a request or the paper (:data:`PAPER_NAMES`) with its clock.

    Raises
    ------
    InputError, FileProblem, Infeasible
        As :func:`gaitgraph.flight.gait_file.timed_gait_from_file` does; a paper's gait has T = 1 s and the law smooth.
    """
    from gaitgraph.flight.gait_file import timed_gait_from_file
    from gaitgraph.gait.paper_gaits import paper_gait
    from gaitgraph.invertibility.matrices import coefficients_of
    from gaitgraph.timing.timed_gait import LAWS, parametrize
    from gaitgraph.vehicle import PAPER

    if Path(gait_file).suffix or Path(gait_file).exists():
        model = vehicle_or_none(vehicle)
        return timed_gait_from_file(gait_file, vehicle=model, coefficients=coefficients, period=period, law=law)
    if gait_file not in PAPER_NAMES:
        hint = did_you_mean(gait_file, list(PAPER_NAMES))
        raise InputError(
            f"GAIT_FILE: {shown(gait_file)}; allowed is a gait file, a request, or {', '.join(PAPER_NAMES)}{hint}"
        )
    model = vehicle_or_none(vehicle) or PAPER
    gait = paper_gait(int(gait_file[-1]), model, coefficients_of(model, coefficients))
    return parametrize(gait, 1.0 if period is None else period, law=law or LAWS[0])


def angles_from_text(text: str, flag: str, what: str) -> tuple[float, float]:
    """Return two angles [rad] of an option such as ``ROLL,PITCH``; InputError if it is none."""
    from gaitgraph.angles import angle_from_text

    parts = text.split(",")
    if len(parts) != 2:
        raise InputError(f"{flag}: {shown(text)}; allowed is {what}, two angles with a comma between")
    first, second = (angle_from_text(part.strip(), flag) for part in parts)
    return first, second


def _with(command: Callable[..., int], options: tuple[Callable[..., Any], ...]) -> Callable[..., int]:
    for option in reversed(options):
        command = option(command)
    return command


def _settings_in(path: Path) -> dict[str, Any]:
    """Return the table ``[flight]`` of a file, not checked."""
    from gaitgraph.files import table_from_toml, text_of

    try:
        content = table_from_toml(text_of(path, "settings file", "a TOML file with a table [flight]"))
        names = list(content)
        for name in names:
            if name != "flight":
                hint = did_you_mean(name, ["flight"])
                raise InputError(f"{shown(name)}; allowed is one table [flight]{hint or ', with settings in it'}")
        told = content.get("flight", {})
        if not isinstance(told, dict):
            raise InputError(f"flight: {shown(told)}; allowed is a table of settings by name")
    except InputError as error:
        if str(error).startswith("settings file"):
            raise
        raise InputError(f"settings file {str(path)!r}: {error}") from error
    return told
