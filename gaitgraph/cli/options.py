"""What makes a function a command, the options that several share, the kinds of values, and where outputs go."""

from __future__ import annotations

import re
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from gaitgraph.errors import InputError, did_you_mean, shown

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from click.shell_completion import CompletionItem

    from gaitgraph.flight.settings import FlightSettings
    from gaitgraph.gait.table import Table
    from gaitgraph.planning.request import PlanRequest
    from gaitgraph.timing.timed_gait import TimedGait
    from gaitgraph.vehicle import Vehicle

    Decorator = Callable[[Any], Any]
    Words = Iterable[str] | Callable[[], Iterable[str]]


REMOVED = {
    "--watch": "Run the command again when the file changes, for example with: entr, watchexec",
    "--sheets": "No gait on a fibre can fly; gaitgraph roots lists the fibres",
    "--objective thrust": "Use: gaitgraph optimize --objective hover_reserve",
}
"""Options that earlier versions had, and what to use instead."""

_NEGATIVE_ANGLE = re.compile(r"-\s*(?:\d|\.|pi|π|inf|nan)", re.IGNORECASE)
_MINUS = "−"  # stands for the hyphen of a negative angle while the arguments are parsed


def as_typed(message: str) -> str:
    """Return a message in which the arguments that it quotes have their hyphens again."""
    return message.replace(_MINUS, "-")


class Command(click.Command):
    """A command whose arguments may be negative angles as they stand; there are no short options.

    The function gets what was given: an option without a default that was not given is not among its arguments.
    """

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse the arguments; a negative angle is never an option."""
        known = {name: one for one in self.params if isinstance(one, click.Option) for name in one.opts}
        marked = []
        for before, arg, after in zip(["", *args], args, [*args[1:], ""], strict=False):
            name, _, value = arg.partition("=")
            for gone in (name, f"{name} {value or after}"):
                if gone in REMOVED and gone not in known:
                    raise InputError(f"{gone} was removed. {REMOVED[gone]}")
            is_value = before in known and not known[before].is_flag
            marked.append(_MINUS + arg[1:] if _NEGATIVE_ANGLE.match(arg) and not is_value else arg)
        rest = super().parse_args(ctx, marked)
        for name, value in list(ctx.params.items()):
            if value is None or value is False or value == ():
                del ctx.params[name]
            else:
                ctx.params[name] = tuple(map(_unmarked, value)) if isinstance(value, tuple) else _unmarked(value)
        return rest


def _unmarked(value: Any) -> Any:
    return "-" + value[1:] if isinstance(value, str) and value.startswith(_MINUS) else value


def command(short_help: str) -> Callable[[Callable[..., int]], Command]:
    """Make a function a command: ``export_command`` is ``export``, its docstring the help, its value the exit code."""
    return click.command(cls=Command, short_help=short_help)


class Choice(click.Choice[str]):
    """A choice that suggests the name that was meant."""

    def get_invalid_choice_message(self, value: Any, ctx: click.Context | None) -> str:
        """Return the message for a name that is none of them."""
        message = super().get_invalid_choice_message(value, ctx)
        return message.rstrip(".") + did_you_mean(str(value), list(self.choices))


class Kind(click.ParamType):  # type: ignore[type-arg]  # generic in new versions of click alone
    """A kind of value: what it must be, and what parses it. What is refused ends in one line that names the option."""

    def __init__(self, name: str, parse: Callable[[str], Any]) -> None:
        self.name, self._parse = name, parse

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return what a text stands for."""
        try:
            return self._parse(value)
        except ValueError:
            raise InputError(f"{param.opts[0] if param else ''} must be {self.name}, got {shown(value)}") from None


class File(click.Path):
    """The name of a file, or one of a few words that may stand for it."""

    def __init__(self, words: Words = ()) -> None:
        super().__init__()
        self._words = words

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        """Return what a shell offers; files first, since bash drops what comes before them."""
        return [*super().shell_complete(ctx, param, incomplete), *_items(self._words, incomplete)]


def _items(words: Words, incomplete: str) -> list[CompletionItem]:
    from click.shell_completion import CompletionItem

    known = words() if callable(words) else words
    return [CompletionItem(name) for name in known if name.startswith(incomplete)]


def _angle(text: str) -> float:
    from gaitgraph.angles import angle_from_text

    angle = angle_from_text(text, "angle")
    if angle < 0:
        raise ValueError
    return angle


def _pair(text: str) -> list[str]:
    first, second = text.split(",")
    return [first.strip(), second.strip()]


_KINDS: dict[str, Any] = {
    "ANGLE": Kind("an angle ≥ 0, such as 0.3, pi/8 or 20deg", _angle),
    "A1,A2": Kind("A1,A2, two angles", _pair),
    "POLYGON": Kind("'A1,A2 A1,A2 A1,A2 …'", lambda text: [_pair(corner) for corner in text.split()]),
    "N": Kind("a whole number", int),
    "SECONDS": Kind("a number of seconds", float),
    **dict.fromkeys(("X", "ETA", "HZ", "METRES", "M/S", "NEWTON"), Kind("a number", float)),
}


def option(flag: str, metavar: str, text: str, *, name: str = "", words: Words = (), **more: Any) -> Decorator:
    """Return an option with a value, whose kind the metavar says; a shell completes the words, the library checks."""
    if "type" not in more:
        is_file = re.search("FILE|FOLDER|DIR", metavar)
        more["type"] = _KINDS.get(metavar, File(words) if is_file else click.STRING)
        if words and not is_file:
            more["shell_complete"] = lambda ctx, param, incomplete: _items(words, incomplete)
    return click.option(flag, *([name] if name else []), metavar=metavar, help=text, **more)


def file(name: str, metavar: str, *words: str, **more: Any) -> Decorator:
    """Return an argument that is the name of a file, or one of a few words."""
    return click.argument(name, metavar=metavar, type=File(words), **more)


def flag(flag: str, text: str) -> Decorator:
    """Return an option without a value."""
    return click.option(flag, is_flag=True, help=text)


def choice(flag: str, names: Sequence[str], default: str, text: str) -> Decorator:
    """Return an option that takes one of some names."""
    return click.option(flag, type=Choice(names), default=default, help=f"{text}  [default: {default}]")


def output(text: str) -> Decorator:
    """Return the repeatable option ``--output``."""
    return option("--output", "FILE", text, name="outputs", multiple=True)


def together(*options: Decorator) -> Decorator:
    """Return options as one decorator, in the order in which the help lists them."""

    def decorated(command: Any) -> Any:
        for one in reversed(options):
            command = one(command)
        return command

    return decorated


def _preset_names() -> list[str]:
    from gaitgraph.vehicle import preset_names

    return preset_names()


def _vehicle(_: click.Context, __: click.Parameter, name: str | None) -> Any:
    if name is None:
        return None
    from gaitgraph.vehicle import vehicle_named

    return vehicle_named(name)


as_json = click.option("--json", "as_json", is_flag=True, help="Print one JSON object and nothing else.")
force = flag("--force", "Overwrite outputs that exist.")
gait_file = file("gait_file", "GAIT_FILE")
request_file = file("request_file", "[REQUEST.toml]", required=False)
outputs = output("Write the gait, in the format of the suffix; repeatable.")
setting = together(
    option(
        "--vehicle",
        "NAME_OR_FILE",
        "A preset (see gaitgraph vehicles) or a TOML file.",
        words=_preset_names,
        callback=_vehicle,
    ),
    click.option(
        "--coefficients",
        type=Choice(["published", "exact"]),
        help="Coefficients of formula (1); published for the paper's own vehicle, exact for any other.",
    ),
)
color = option("--color", "NAME", "auto, red or blue.  [default: auto]", words=("auto", "red", "blue"))
sign = option(
    "--sign", "NAME", "Sign of R: auto, positive or negative.  [default: auto]", words=("auto", "positive", "negative")
)
divisions = option("--divisions", "N", "Grid pieces of [−π/2, π/2].  [default: 16]")
floor = option("--floor", "X", "Least singular value to keep.  [default: 0.05]")
accuracy = option("--accuracy", "ANGLE", "Of curved borders, with the method exact.  [default: 1e-6]")
crossing_tolerance = option(
    "--crossing-tolerance", "ANGLE", "Distance from a crossing line within which a type is '?'.  [default: pi/32]"
)
angle_rounding = option("--angle-rounding", "ANGLE", "Assumed error of each angle.  [default: inferred from the file]")
period = option("--period", "SECONDS", "Period T.  [default: 1]")
_LAWS = ("smooth", "constant-speed", "equal-time")
law = option("--law", "NAME", "smooth, constant-speed or equal-time.  [default: smooth]", words=_LAWS)
sampling = together(
    option("--samples", "N", "Even intervals per period.  [default: 100]"),
    option("--rate", "HZ", "Samples per second, instead of --samples."),
)
require = choice("--require", ["valid", "flyable"], "valid", "What decides the exit code.")
keep = together(
    option("--keep-in", "POLYGON", 'Only inside: "A1,A2 A1,A2 A1,A2 …"; repeatable.', multiple=True),
    option("--keep-out", "POLYGON", "Only outside; repeatable.", multiple=True),
)


def waypoints(text: str = "A waypoint; repeat in order.") -> Decorator:
    """Return the option ``--waypoint``."""
    return option("--waypoint", "A1,A2", text, name="waypoints", multiple=True)


def request_of(file: str | None, given: Mapping[str, Any]) -> tuple[PlanRequest, dict[str, Any]]:
    """Return the request of a file, options or both, and its sampling; InputError if there are no waypoints."""
    from gaitgraph.planning.request import read_request, request_from_mapping

    if file is None and "waypoints" not in given:
        raise InputError("waypoints: none given; name a request file, or --waypoint A1,A2 at least once")
    return request_from_mapping(given) if file is None else read_request(file, given)


def field_of(error: InputError) -> str:
    """Return the field that a message begins with, such as "period must be …" or "period: …"; "" if there is none."""
    match = re.match(r"(\w+)(?=:| must | is )", str(error))
    return "" if match is None else match[0]


@contextmanager
def named_in_errors(given: Mapping[str, Any], **names: str) -> Iterator[None]:
    """Let an InputError name the option that was given for a field, which `names` has where it is another name."""
    try:
        yield
    except InputError as error:
        field = field_of(error)
        name = names.get(field, field)
        if given.get(name) is None:
            raise
        raise type(error)(f"--{name.replace('_', '-')}{str(error)[len(field) :]}") from error


def films_in(paths: Sequence[str]) -> list[str]:
    """Return those of some outputs that are films."""
    from gaitgraph.plots.films import is_film

    return [path for path in paths if is_film(path)]


def check_outputs(paths: Sequence[str], *, force: bool) -> None:
    """Raise before any work is done if a gait cannot be written to one of these files, tables or films."""
    from gaitgraph.io.formats import check_outputs
    from gaitgraph.plots.films import check_films

    films = films_in(paths)
    check_outputs([path for path in paths if path not in films], force=force)
    check_films(films, force=force)


def write_outputs(pieces: Callable[[], Iterable[Table]], paths: Sequence[str], *, force: bool) -> None:
    """Write a gait that comes piece by piece to files, tables and films."""
    from gaitgraph.io.formats import write_pieces
    from gaitgraph.plots.films import write_films

    films = films_in(paths)
    write_pieces(pieces, [path for path in paths if path not in films], force=force)
    write_films(pieces, films, force=force)


# ---------------------------------------------------------------- flights

PAPER_NAMES = ("gait1", "gait2", "gait3", "gait4")
"""The gaits of the paper's Section 5, which may be named instead of a file."""

flown_gait_file = file("gait_file", "GAIT_FILE", *PAPER_NAMES)

flight_clock = together(
    option("--period", "SECONDS", "Period T.  [default: what the file says]"),
    option("--law", "NAME", "smooth, constant-speed or equal-time.  [default: what the file says]", words=_LAWS),
    setting,
)

flight_settings = together(
    option("--settings", "FILE", "A TOML file with a table [flight] of settings; options replace them."),
    option("--duration", "SECONDS", "How long is flown.  [default: a period, 3 at least]"),
    option("--tolerance", "X", "Settled within (rad, m).  [default: 0.02]"),
    option("--attitude-stiffness", "X", "kp of roll, pitch, yaw, per s².  [default: 100]"),
    option("--attitude-damping", "X", "kd of roll, pitch, yaw, per s.  [default: 20]"),
    option("--altitude-stiffness", "X", "kp of altitude, per s².  [default: 100]"),
    option("--altitude-damping", "X", "kd of altitude, per s.  [default: 20]"),
    flag("--no-saturation", "Let rotors push and pull without limit."),
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
    """Take the settings of a flight out of a command's options; an error names the option or the file."""
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
        field = field_of(error)
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
    """Return the warnings of a flight; one line replaces what follows from a bias, which was asked for."""
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
    """Return the gait of a file, a request or the paper with its timing; a paper's has T = 1 s and the law smooth."""
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
