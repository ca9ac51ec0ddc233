"""Options that several commands share, the kinds of values they take, and where their outputs go."""

from __future__ import annotations

import re
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import click

from gaitgraph.errors import InputError, did_you_mean, shown

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from click.shell_completion import CompletionItem

    from gaitgraph.gait.table import Table

    Decorator = Callable[[Any], Any]
    Words = Iterable[str] | Callable[[], Iterable[str]]


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
    """Return an option with a value.

    Parameters
    ----------
    flag
        Such as ``--max-rate``.
    metavar
        What the help calls the value. It says the kind of the value too: a number, an angle, a file.
    text
        The help.
    name
        The argument of the function, if it is not that of the flag.
    words
        Names that a shell completes. The library checks them.
    more
        As for :func:`click.option`: `multiple`, `default`, `callback`, `type`.
    """
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
outputs = option(
    "--output", "FILE", "Write the gait, in the format of the suffix; repeatable.", name="outputs", multiple=True
)
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
law = option(
    "--law",
    "NAME",
    "smooth, constant-speed or equal-time.  [default: smooth]",
    words=("smooth", "constant-speed", "equal-time"),
)
sampling = together(
    option("--samples", "N", "Even intervals per period.  [default: 100]"),
    option("--rate", "HZ", "Samples per second, instead of --samples."),
)
require = click.option(
    "--require",
    type=Choice(["valid", "flyable"]),
    default="valid",
    help="What decides the exit code.  [default: valid]",
)
keep = together(
    option("--keep-in", "POLYGON", 'Only inside: "A1,A2 A1,A2 A1,A2 …"; repeatable.', multiple=True),
    option("--keep-out", "POLYGON", "Only outside; repeatable.", multiple=True),
)


def waypoints(text: str = "A waypoint; repeat in order.") -> Decorator:
    """Return the option ``--waypoint``."""
    return option("--waypoint", "A1,A2", text, name="waypoints", multiple=True)


def field_of(error: InputError) -> str:
    """Return the field that a message begins with, such as "period must be …" or "period: …"; "" if there is none."""
    match = re.match(r"(\w+)(?=:| must | is )", str(error))
    return "" if match is None else match[0]


@contextmanager
def named_in_errors(given: Mapping[str, Any], **names: str) -> Iterator[None]:
    """Let an InputError about a field name the option that gave it: ``--max-rate``, not ``rate``.

    Parameters
    ----------
    given
        The options that were given; a field of any other is left as it is.
    names
        The option of each field that is named otherwise.
    """
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
