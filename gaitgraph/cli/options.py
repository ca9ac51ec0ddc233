"""Options that several commands share, and the texts in them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from gaitgraph.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from gaitgraph.vehicle import Vehicle

__all__ = [
    "angle_not_negative",
    "crossing_option",
    "force_option",
    "json_option",
    "keep_options",
    "outputs_option",
    "polygons_from_texts",
    "require_option",
    "sampling_options",
    "setting_options",
    "stated",
    "vehicle_or_none",
    "waypoints_from_texts",
]

json_option = click.option("--json", "as_json", is_flag=True, help="Print one JSON object and nothing else.")

force_option = click.option("--force", is_flag=True, help="Overwrite outputs that exist.")

outputs_option = click.option(
    "--output",
    "outputs",
    multiple=True,
    metavar="FILE",
    help="Write the gait table (.csv, .json); repeatable.",
)

crossing_option = click.option(
    "--crossing-tolerance",
    metavar="ANGLE",
    help="Distance from a crossing line within which a type is '?'.  [default: pi/32]",
)

require_option = click.option(
    "--require",
    type=click.Choice(["valid", "flyable"]),
    default="valid",
    help="What decides the exit code.  [default: valid]",
)


def setting_options(command: Callable[..., int]) -> Callable[..., int]:
    """Add the options that every command has."""
    command = click.option(
        "--coefficients",
        type=click.Choice(["published", "exact"]),
        help="Coefficients of formula (1); published for the paper's own vehicle, exact for any other.",
    )(command)
    return click.option("--vehicle", metavar="NAME_OR_FILE", help="A preset (see gaitgraph vehicles) or a TOML file.")(
        command
    )


def sampling_options(command: Callable[..., int]) -> Callable[..., int]:
    """Add the options of a clock over one period, and ``--force`` for the files that get it."""
    options = (
        click.option("--period", type=float, metavar="SECONDS", help="Period T.  [default: 1]"),
        click.option("--samples", type=int, metavar="N", help="Even intervals per period.  [default: 100]"),
        click.option("--rate", type=float, metavar="HZ", help="Samples per second, instead of --samples."),
        click.option("--law", metavar="NAME", help="smooth, constant-speed or equal-time.  [default: smooth]"),
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


def angle_not_negative(text: str, name: str) -> float:
    """Return an option's angle [rad]; InputError if it is none, or negative."""
    from gaitgraph.angles import angle_from_text

    flag = _flag(name)
    angle = angle_from_text(text, flag)
    if angle < 0:
        raise InputError(f"{flag}: {text!r}; allowed is an angle ≥ 0")
    return angle


def waypoints_from_texts(texts: Sequence[str]) -> list[list[str]]:
    """Split every ``A1,A2`` or ``A1,A2,A3,A4`` into angles, still texts; InputError, with the number, otherwise."""
    waypoints = []
    for number, text in enumerate(texts, start=1):
        parts = text.split(",")
        if len(parts) not in (2, 4):
            raise InputError(f"waypoint {number}: {text!r}; allowed is A1,A2, or A1,A2,A3,A4 with all sheets")
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
