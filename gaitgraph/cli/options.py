"""What makes a function a command, the options that several share, the kinds of values, and where outputs go."""

from __future__ import annotations

import re
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import click

from gaitgraph.errors import InputError, checked_choice, did_you_mean, shown

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from click.shell_completion import CompletionItem

    from gaitgraph.gait.table import Table
    from gaitgraph.planning.request import PlanRequest

    Decorator = Callable[[Any], Any]
    Words = Iterable[str] | Callable[[], Iterable[str]]

Paths = tuple[str, ...]

REMOVED = {
    "--render": "A film is drawn: --output flight.gif",
    "--view": "Write a film: --output flight.gif",
    "--watch": "Run the command again when the file changes, for example with: entr, watchexec",
    "--sheets": "No gait on a fibre can fly; gaitgraph roots lists the fibres",
    "--divisions": "Only plan and cycles use a grid; a transition is found at any angle",
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
        for name, given in list(ctx.params.items()):
            if given is None or given is False or given == ():
                del ctx.params[name]
            else:
                ctx.params[name] = tuple(map(_unmarked, given)) if isinstance(given, tuple) else _unmarked(given)
        return rest


def _unmarked(value: Any) -> Any:
    return "-" + value[1:] if isinstance(value, str) and value.startswith(_MINUS) else value


def command(short_help: str, *options: str | Decorator) -> Callable[[Callable[..., int]], Command]:
    """Make a function a command: ``export_command`` is ``export``, its docstring the help, its value the exit code.

    The options come in the order of the help; one text names any number of those that commands share.
    """
    named = [one.split() if isinstance(one, str) else [one] for one in options]
    flat = [_SHARED[one] if isinstance(one, str) else one for part in named for one in part]

    def decorated(function: Any) -> Command:
        for one in reversed(flat):
            function = one(function)
        made: Command = click.command(cls=Command, short_help=short_help)(function)
        return made

    return decorated


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


def _angle(text: str) -> float:
    from gaitgraph.angles import angle_from_text

    angle = angle_from_text(text, "angle")
    if angle < 0:
        raise ValueError
    return angle


def pair_of(text: str) -> list[str]:
    """Return the two parts of a text, or raise ValueError."""
    first, second = text.split(",")
    return [first.strip(), second.strip()]


_KINDS: dict[str, Any] = {
    "ANGLE": Kind("an angle ≥ 0, such as 0.3, pi/8 or 20deg", _angle),
    "A1,A2": Kind("A1,A2, two angles", pair_of),
    "POLYGON": Kind("'A1,A2 A1,A2 A1,A2 …'", lambda text: [pair_of(corner) for corner in text.split()]),
    "N": Kind("a whole number", int),
    "SECONDS": Kind("a number of seconds", float),
    **dict.fromkeys(("X", "ETA", "HZ", "METRES", "M/S", "NEWTON"), Kind("a number", float)),
}


def _completion(words: Words, *, is_file: bool) -> Callable[..., list[CompletionItem]]:
    """Return what offers a shell the words that may stand for a value, and files."""

    def complete(_: click.Context, __: click.Parameter, incomplete: str) -> list[CompletionItem]:
        from click.shell_completion import CompletionItem

        # Files first, since bash drops what comes before them.
        found = [CompletionItem(incomplete, type="file")] if is_file else []
        known = words() if callable(words) else words
        return found + [CompletionItem(name) for name in known if name.startswith(incomplete)]

    return complete


def option(flag: str, metavar: str, text: str, *, name: str = "", words: Words = (), **more: Any) -> Decorator:
    """Return an option with a value, whose kind the metavar says; a shell completes the words, the library checks."""
    completion = _completion(words, is_file=re.search("FILE|FOLDER|DIR", metavar) is not None)
    more = {"type": _KINDS.get(metavar, click.STRING), "shell_complete": completion, **more}
    return click.option(flag, *([name] if name else []), metavar=metavar, help=text, **more)


def one_of(flag: str, *words: str, of: str = "", default: str = "", **more: Any) -> Decorator:
    """Return an option that is one of some words, by default the first; `of` says in the help of what."""
    text = f"{of}{', '.join(words[:-1])} or {words[-1]}.  [default: {default or words[0]}]"
    return option(flag, "NAME", text, words=words, **more)


def file(name: str, metavar: str, *words: str, **more: Any) -> Decorator:
    """Return an argument that is the name of a file, or one of a few words."""

    def checked(_: click.Context, __: click.Parameter, value: Any) -> Any:
        from pathlib import Path

        if words and value.lower() not in words and not Path(value).suffix and not Path(value).exists():
            hint = did_you_mean(value, words)
            raise InputError(f"{metavar} must be a file, or {' or '.join(words)}, got {shown(value)}{hint}")
        return value

    completion = _completion(words, is_file=True)
    return click.argument(name, metavar=metavar, shell_complete=completion, callback=checked, **more)


def flag(flag: str, text: str) -> Decorator:
    """Return an option without a value."""
    return click.option(flag, is_flag=True, help=text)


def choice(flag: str, names: Sequence[str], default: str | None, text: str) -> Decorator:
    """Return an option that takes one of some names, and is checked here."""

    def checked(_: click.Context, __: click.Parameter, value: str | None) -> Any:
        return value and checked_choice(flag, value, names)

    text += f"  [default: {default}]" if default else ""
    return option(flag, f"[{'|'.join(names)}]", text, words=names, default=default, callback=checked)


def _preset_names() -> list[str]:
    from gaitgraph.vehicle import preset_names

    return preset_names()


def _vehicle(_: click.Context, __: click.Parameter, name: str | None) -> Any:
    if name is None:
        return None
    from gaitgraph.vehicle import vehicle_named

    return vehicle_named(name)


LAWS = ("smooth", "constant-speed", "equal-time")
_COEFFICIENTS = "Coefficients of formula (1); published for the paper's own vehicle, exact for any other."
_CROSSING = "Distance from a crossing line within which a type is '?'.  [default: pi/32]"
_OUTPUT = "Write the answer, in the format of the suffix; repeatable."
_ROUNDING = "Assumed error of each angle.  [default: inferred from the file]"
_VEHICLE = "A preset (see gaitgraph vehicles) or a TOML file."

_SHARED: dict[str, Decorator] = {
    "json": click.option("--json", "as_json", is_flag=True, help="Print one JSON object and nothing else."),
    "force": flag("--force", "Overwrite outputs that exist."),
    "gait_file": file("gait_file", "GAIT_FILE"),
    "request_file": file("request_file", "[REQUEST.toml]", required=False),
    "outputs": option("--output", "FILE", _OUTPUT, name="outputs", multiple=True),
    "vehicle": option("--vehicle", "NAME_OR_FILE", _VEHICLE, words=_preset_names, callback=_vehicle),
    "coefficients": choice("--coefficients", ["published", "exact"], None, _COEFFICIENTS),
    "color": one_of("--color", "auto", "red", "blue"),
    "sign": one_of("--sign", "auto", "positive", "negative", of="Sign of R: "),
    "divisions": option("--divisions", "N", "Grid pieces of [−π/2, π/2].  [default: 16]"),
    "floor": option("--floor", "X", "Least singular value to keep.  [default: 0.05]"),
    "accuracy": option("--accuracy", "ANGLE", "Of curved borders, with the method exact.  [default: 1e-6]"),
    "crossing_tolerance": option("--crossing-tolerance", "ANGLE", _CROSSING),
    "angle_rounding": option("--angle-rounding", "ANGLE", _ROUNDING),
    "period": option("--period", "SECONDS", "Period T.  [default: 1]"),
    "law": one_of("--law", *LAWS),
    "samples": option("--samples", "N", "Even intervals per period.  [default: 100]"),
    "rate": option("--rate", "HZ", "Samples per second, instead of --samples."),
    "require": choice("--require", ["valid", "flyable"], "valid", "What decides the exit code."),
    "keep_in": option("--keep-in", "POLYGON", 'Only inside: "A1,A2 A1,A2 A1,A2 …"; repeatable.', multiple=True),
    "keep_out": option("--keep-out", "POLYGON", "Only outside; repeatable.", multiple=True),
    "waypoints": option("--waypoint", "A1,A2", "A waypoint; repeat in order.", name="waypoints", multiple=True),
}


def request_of(file: str | None, given: Mapping[str, Any]) -> tuple[PlanRequest, dict[str, Any]]:
    """Return the request of a file, options or both, and its sampling; InputError if there are no waypoints."""
    from gaitgraph.planning.request import read_request, request_from_mapping

    if file is None and "waypoints" not in given:
        raise InputError("waypoints: none given; name a request file, or --waypoint A1,A2 at least once")
    return request_from_mapping(given) if file is None else read_request(file, given)


@contextmanager
def named_in_errors(given: Mapping[str, Any], **names: str) -> Iterator[None]:
    """Let an InputError that begins with a field name the option that was given for it; `names` has other names."""
    try:
        yield
    except InputError as error:
        match = re.match(r"\w+(?=:| must | is )", str(error))
        field = match[0] if match else ""
        name = names.get(field, field)
        if given.get(name) is None:
            raise
        raise type(error)(f"--{name.replace('_', '-')}{str(error)[len(field) :]}") from error


def films_in(paths: Sequence[str]) -> list[str]:
    """Return those of some outputs that are films."""
    from gaitgraph.io.formats import FILMS

    return [path for path in paths if path.lower().endswith(FILMS)]


def check_outputs(paths: Sequence[str], *, force: bool) -> None:
    """Raise before any work is done if a gait cannot be written to one of these files, tables or films."""
    from gaitgraph.io.formats import check_outputs
    from gaitgraph.plots.vehicles import check_films

    films = films_in(paths)
    check_outputs([path for path in paths if path not in films], force=force)
    check_films(films, force=force)


def write_outputs(pieces: Callable[[], Iterable[Table]], paths: Sequence[str], *, force: bool) -> None:
    """Write a gait that comes piece by piece to files, tables and films."""
    from gaitgraph.gait.table import merged
    from gaitgraph.io.formats import write_tables
    from gaitgraph.plots.vehicles import write_films

    films = films_in(paths)
    write_tables(pieces, [path for path in paths if path not in films], force=force)
    if films:
        write_films(merged(pieces()), films, force=force)
