"""What the commands of flight share: the gait, the settings and the warnings."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from gaitgraph.cli import options
from gaitgraph.cli.options import option
from gaitgraph.errors import InputError, did_you_mean, shown

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from gaitgraph.flight.settings import FlightSettings
    from gaitgraph.timing.timed_gait import TimedGait
    from gaitgraph.vehicle import Vehicle

PAPER_NAMES = ("gait1", "gait2", "gait3", "gait4")
"""The gaits of the paper's Section 5, which may be named instead of a file."""

gait_file = options.file("gait_file", "GAIT_FILE", *PAPER_NAMES)

clock = options.together(
    option("--period", "SECONDS", "Period T.  [default: what the file says]"),
    option(
        "--law",
        "NAME",
        "smooth, constant-speed or equal-time.  [default: what the file says]",
        words=("smooth", "constant-speed", "equal-time"),
    ),
    options.setting,
)

settings = options.together(
    option("--settings", "FILE", "A TOML file with a table [flight] of settings; options replace them."),
    option("--duration", "SECONDS", "How long is flown.  [default: a period, 3 at least]"),
    option("--tolerance", "X", "Settled within (rad, m).  [default: 0.02]"),
    option("--attitude-stiffness", "X", "kp of roll, pitch, yaw, per s².  [default: 100]"),
    option("--attitude-damping", "X", "kd of roll, pitch, yaw, per s.  [default: 20]"),
    option("--altitude-stiffness", "X", "kp of altitude, per s².  [default: 100]"),
    option("--altitude-damping", "X", "kd of altitude, per s.  [default: 20]"),
    options.flag("--no-saturation", "Let rotors push and pull without limit."),
    option("--thrust-limit", "NEWTON", "Of a rotor.  [default: the vehicle's, if any]"),
    option("--servo-lag", "SECONDS", "Time constant.  [default: the vehicle's, if any]"),
    option("--servo-rate", "ANGLE", "Largest tilt rate per second.  [default: the vehicle's]"),
    option(
        "--arms",
        "NAME",
        "Tilt angles that the controller assumes: served or planned.  [default: served]",
        words=("served", "planned"),
    ),
    option("--floor", "X", "Abort when the least singular value falls below this.  [default: 0.01]"),
    option("--step", "SECONDS", "Of the engine.  [default: 0.001]"),
    option("--control-rate", "HZ", "How often thrusts are set.  [default: 1000]"),
)


def settings_from_options(given: dict[str, Any]) -> FlightSettings:
    """Take the settings of a flight out of a command's options, and return them.

    Raises
    ------
    InputError, FileProblem
        If a value is not allowed, naming the option or the file that gave it.
    """
    from dataclasses import fields

    from gaitgraph.flight.settings import FlightSettings, settings_from_mapping

    file = given.pop("settings", None)
    in_file = {} if file is None else _settings_in(Path(file))
    stated = {field.name: given.pop(field.name) for field in fields(FlightSettings) if field.name in given}
    if given.pop("no_saturation", False):
        if "thrust_limit" in stated:
            raise InputError(f"--thrust-limit {stated['thrust_limit']:g} cannot be combined with --no-saturation")
        stated["saturation"] = False
    try:
        # Judged together: an option may replace what is wrong in the file.
        return settings_from_mapping(in_file | stated)
    except InputError as error:
        field = options.field_of(error)
        if not stated or (field in in_file and field not in stated):
            raise InputError(f"settings file {str(file)!r}: {error}") from error
        name = "--no-saturation" if field == "saturation" else f"--{field.replace('_', '-')}"
        raise InputError(name + str(error)[len(field) :]) from error


def _settings_in(path: Path) -> dict[str, Any]:
    """Return the table ``[flight]`` of a file, not checked."""
    from gaitgraph.files import table_from_toml, text_of

    text = text_of(path, "settings file", "a TOML file with a table [flight]")
    try:
        content = table_from_toml(text)
        for name in content:
            if name != "flight":
                raise InputError(f"it must have one table, [flight], got {shown(name)}{did_you_mean(name, ['flight'])}")
        settings = content.get("flight", {})
        if not isinstance(settings, dict):
            raise InputError(f"flight must be a table of settings by name, got {shown(settings)}")
    except InputError as error:
        raise InputError(f"settings file {str(path)!r}: {error}") from error
    return settings


def flight_warnings(timed: TimedGait, warnings: Iterable[str], eta: float | None) -> list[str]:
    """Return the warnings of a flight: those of its gait, and that a table has the timing of no law.

    A gait that was biased by η is off the surfaces, as was asked for; one line replaces what follows from that.
    """
    from gaitgraph.flight.course import ROW_BY_ROW, broken_rules

    found = list(warnings)
    if eta is not None and eta != 1.0 and found:
        report = timed.check()
        off = next((check for check in report.checks if check.name == "on_surface" and not check.ok), None)
        if off is not None:
            follows = broken_rules(report)[1]
            size = f"max(|Rφ|, |Rθ|) = {off.value:.2g}, allowed {off.limit:g}"
            found = [f"biased by {eta:g} it is off the surfaces: {size}", *(one for one in found if one not in follows)]
    if timed.law == ROW_BY_ROW:
        found.append(
            f"the timing matches no built-in law: {timed.samples} rows are flown straight from one to the next"
        )
    return found


def timed_gait(name: str, given: Mapping[str, Any]) -> TimedGait:
    """Return the gait of a file, a request or the paper with its timing, for the options of :data:`clock`.

    Raises
    ------
    InputError, FileProblem, Infeasible
        As :func:`gaitgraph.flight.course.timed_gait_from_file`; a paper's gait has T = 1 s and the law smooth.
    """
    from gaitgraph.flight.course import timed_gait_from_file
    from gaitgraph.gait.gait import paper_gait
    from gaitgraph.invertibility.matrices import coefficients_of
    from gaitgraph.vehicle import PAPER

    asked = {key: given[key] for key in ("vehicle", "coefficients", "period", "law") if key in given}
    if Path(name).suffix or Path(name).exists():
        return timed_gait_from_file(name, **asked)
    if name not in PAPER_NAMES:
        known = f"a gait file, a request, or {', '.join(PAPER_NAMES)}"
        raise InputError(f"GAIT_FILE must be {known}, got {shown(name)}{did_you_mean(name, list(PAPER_NAMES))}")
    vehicle: Vehicle = asked.pop("vehicle", PAPER)
    gait = paper_gait(int(name[-1]), vehicle, coefficients_of(vehicle, asked.pop("coefficients", None)))
    return gait.parametrize(**asked)
