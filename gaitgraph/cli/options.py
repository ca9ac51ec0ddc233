"""Options that several commands share, and the texts in them."""

from __future__ import annotations

import re
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import click

from gaitgraph.errors import InputError, did_you_mean

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from click.shell_completion import CompletionItem

    from gaitgraph.io.servo_map import ServoMap
    from gaitgraph.vehicle import Vehicle

    Completion = Callable[[click.Context, click.Parameter, str], list[CompletionItem]]

__all__ = [
    "NAMES",
    "Choice",
    "a_file",
    "a_word",
    "angle_not_negative",
    "as_options",
    "columns_option",
    "crossing_option",
    "field_of",
    "force_option",
    "json_option",
    "keep_options",
    "name_option",
    "outputs_option",
    "polygons_from_texts",
    "require_option",
    "sampling_options",
    "servo_map_or_none",
    "servos_option",
    "setting_options",
    "stated",
    "vehicle_or_none",
    "waypoints_from_texts",
]

NAMES = {
    "color": ("auto", "red", "blue"),
    "sign": ("auto", "positive", "negative"),
    "objective": ("shortest", "robust"),
    "goal": ("singular_value", "hover_reserve", "tilt_rate"),
    "method": ("grid", "exact"),
    "law": ("smooth", "constant-speed", "equal-time"),
    "arms": ("served", "planned"),
}
"""What a shell offers for options whose values the library checks; here too because the library takes long to load."""


class Choice(click.Choice[str]):
    """A choice that suggests the name that was meant."""

    def get_invalid_choice_message(self, value: Any, ctx: click.Context | None) -> str:
        """Return the message for a name that is none of them."""
        message = super().get_invalid_choice_message(value, ctx)
        return message.rstrip(".") + did_you_mean(str(value), list(self.choices))


def a_word(*words: str) -> Completion:
    """Return what completes one of a few words."""
    return _one_of(lambda: words)


def name_option(flag: str, text: str, kind: str = "") -> Callable[[Any], Any]:
    """Make an option whose value the library checks, and a shell completes: one of :data:`NAMES` of its kind."""
    names = NAMES[kind or flag.removeprefix("--")]
    return click.option(flag, metavar="NAME", shell_complete=a_word(*names), help=text)


def a_file(*words: str) -> Completion:
    """Return what completes the name of a file, or one of a few words that may stand for it."""
    return _one_of(lambda: words, files=True)


def _preset_names() -> list[str]:
    from gaitgraph.vehicle import preset_names

    return preset_names()


def _servo_map_names() -> list[str]:
    from gaitgraph.io.servo_map import PRESETS

    return list(PRESETS)


def _one_of(known: Callable[[], Iterable[str]], *, files: bool = False) -> Completion:
    def complete(ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        from click.shell_completion import CompletionItem

        # Bash drops what it was offered before files.
        found = [CompletionItem(incomplete, type="file")] if files else []
        return found + [CompletionItem(name) for name in known() if name.startswith(incomplete)]

    return complete


json_option = click.option("--json", "as_json", is_flag=True, help="Print one JSON object and nothing else.")

columns_option = click.option(
    "--columns",
    metavar="NAME_OR_FILE",
    shell_complete=_one_of(_servo_map_names, files=True),
    help="What the columns of a servo table from elsewhere are: a preset or a TOML file.",
)

servos_option = click.option(
    "--servos",
    metavar="NAME_OR_FILE",
    shell_complete=_one_of(_servo_map_names, files=True),
    help="Write what the joints do, not tilt angles: paper, x_frame, … or a TOML file.",
)

force_option = click.option("--force", is_flag=True, help="Overwrite outputs that exist.")

outputs_option = click.option(
    "--output",
    "outputs",
    multiple=True,
    metavar="FILE",
    shell_complete=a_file(),
    help="Write the gait table, in the format of the suffix; repeatable.",
)

crossing_option = click.option(
    "--crossing-tolerance",
    metavar="ANGLE",
    help="Distance from a crossing line within which a type is '?'.  [default: pi/32]",
)

require_option = click.option(
    "--require",
    type=Choice(["valid", "flyable"]),
    default="valid",
    help="What decides the exit code.  [default: valid]",
)


def setting_options(command: Callable[..., int]) -> Callable[..., int]:
    """Add the options that every command has."""
    command = click.option(
        "--coefficients",
        type=Choice(["published", "exact"]),
        help="Coefficients of formula (1); published for the paper's own vehicle, exact for any other.",
    )(command)
    return click.option(
        "--vehicle",
        metavar="NAME_OR_FILE",
        shell_complete=_one_of(_preset_names, files=True),
        help="A preset (see gaitgraph vehicles) or a TOML file.",
    )(command)


def sampling_options(command: Callable[..., int]) -> Callable[..., int]:
    """Add the options of a clock over one period, and ``--force`` for the files that get it."""
    options = (
        click.option("--period", type=float, metavar="SECONDS", help="Period T.  [default: 1]"),
        click.option("--samples", type=int, metavar="N", help="Even intervals per period.  [default: 100]"),
        click.option("--rate", type=float, metavar="HZ", help="Samples per second, instead of --samples."),
        name_option("--law", "smooth, constant-speed or equal-time.  [default: smooth]"),
        force_option,
    )
    for option in reversed(options):
        command = option(command)
    return command


def keep_options(command: Callable[..., int]) -> Callable[..., int]:
    """Add the options for the user's own polygons."""
    command = click.option("--keep-out", multiple=True, metavar="POLYGON", help="Only outside; repeatable.")(command)
    return click.option(
        "--keep-in", multiple=True, metavar="POLYGON", help='Only inside: "A1,A2 A1,A2 A1,A2 …"; repeatable.'
    )(command)


def stated(options: dict[str, Any]) -> dict[str, Any]:
    """Return the options that were given, flags and repeatable ones among them; a zero is given."""
    return {name: value for name, value in options.items() if value is not None and value is not False and value != ()}


def vehicle_or_none(name: str | None) -> Vehicle | None:
    """Return the vehicle of ``--vehicle``; None, which leaves the choice to the library, if it is not given."""
    from gaitgraph.vehicle import vehicle_named

    return None if name is None else vehicle_named(name)


@contextmanager
def as_options(**flags: Any) -> Iterator[None]:
    """Let an InputError that begins with the name of one of these fields name the option instead.

    Parameters
    ----------
    flags
        The option's value by the field's name, with the option's own name for hyphens: ``eta=("--bias", 0.8)``. One
        whose value is None was not given, so that the field is another's.
    """
    try:
        yield
    except InputError as error:
        field = field_of(error)
        flag, value = flags.get(field, ("", None))
        if value is None:
            raise
        raise type(error)(flag + str(error)[len(field) :]) from error


def field_of(error: InputError) -> str:
    """Return the field at the start of a message such as "period must be …" or "period: …", "" if there is none."""
    match = re.match(r"(\w+)(?=:| must | is )", str(error))
    return "" if match is None else match[0]


def servo_map_or_none(name: str | None) -> ServoMap | None:
    """Return the map of ``--servos`` or ``--columns``; None if it is not given."""
    from gaitgraph.io.servo_map import servo_map_named

    return None if name is None else servo_map_named(name)


def angle_not_negative(text: str, name: str) -> float:
    """Return an option's angle [rad]; InputError if it is none, or negative."""
    from gaitgraph.angles import angle_from_text

    flag = _flag(name)
    angle = angle_from_text(text, flag)
    if angle < 0:
        raise InputError(f"{flag}: {text!r}; allowed is an angle ≥ 0")
    return angle


def waypoints_from_texts(texts: Sequence[str]) -> list[list[str]]:
    """Split every ``A1,A2`` into angles, still texts; InputError, with the number, otherwise."""
    waypoints = []
    for number, text in enumerate(texts, start=1):
        parts = text.split(",")
        if len(parts) != 2:
            raise InputError(f"waypoint {number}: {text!r}; allowed is A1,A2")
        waypoints.append([part.strip() for part in parts])
    return waypoints


def polygons_from_texts(asked: dict[str, Any]) -> None:
    """Split every ``A1,A2 A1,A2 …`` under keep_in and keep_out into corners of two angles, still texts, in place.

    InputError if one is no pair.
    """
    for name in ("keep_in", "keep_out"):
        polygons = []
        for text in asked.get(name, ()):
            corners = [corner.split(",") for corner in text.split()]
            if any(len(corner) != 2 for corner in corners):
                raise InputError(f"{_flag(name)}: {text!r}; allowed is 'A1,A2 A1,A2 A1,A2 …'")
            polygons.append(corners)
        if name in asked:
            asked[name] = polygons


def _flag(name: str) -> str:
    return "--" + name.replace("_", "-")
