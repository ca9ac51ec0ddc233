"""The kinds of values that options take, and the options that several commands share."""

from __future__ import annotations

import math
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict

import click

from gaitgraph.cli.output import JSON, print_problem
from gaitgraph.explorer.words import CHOICES_IN_WORDS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from click.decorators import FC
    from click.shell_completion import CompletionItem

    from gaitgraph.invertibility.coefficients import Kind
    from gaitgraph.invertibility.geometry import Geometry
    from gaitgraph.vehicle import Vehicle

PAPER_GAITS = ("gait1", "gait2", "gait3", "gait4")  # of Section 5, instead of a file
LAWS = ("smooth", "constant-speed", "equal-time")
"""The timing laws, stated here again since help loads no numpy."""


# ---------------------------------------------------------------- kinds of values


class Angle(click.ParamType[float]):
    """An angle that is not negative, or is positive, as a number of radians or a text such as 20deg."""

    name = "angle"

    def __init__(self, *, is_positive: bool = False) -> None:
        self.is_positive = is_positive

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """Return the angle [rad]."""
        angle = _angle_or_nan(value)
        if not angle >= 0 or (self.is_positive and angle == 0):
            sign = "> 0" if self.is_positive else "≥ 0"
            allowed = f"an angle {sign}, such as 0.3, pi/8 or 20deg"
            self.fail(f"{value!r} is not {allowed}.", param, ctx)
        return angle


class Pair(click.ParamType[tuple[float, float]]):
    """Two angles with a comma between them."""

    name = "A1,A2"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[float, float]:
        """Return the two angles [rad]."""
        angles = [_angle_or_nan(part) for part in value.split(",")]
        if len(angles) != 2 or any(map(math.isnan, angles)):
            allowed = "two angles with a comma between them, such as pi/8,-20deg"
            self.fail(f"{value!r} is not {allowed}.", param, ctx)
        return angles[0], angles[1]


class Polygon(click.ParamType[list[tuple[float, float]]]):
    """The corners of a polygon: pairs of angles with spaces between them."""

    name = "polygon"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> list[tuple[float, float]]:
        """Return the corners [rad]."""
        return [Pair().convert(corner, param, ctx) for corner in value.split()]


def _angle_or_nan(value: Any) -> float:
    from gaitgraph.angles import angle_from_text
    from gaitgraph.errors import InputError

    try:
        return angle_from_text(value)
    except InputError:
        return math.nan


class Number(click.FloatRange):
    """A number in a range."""

    name = "number"


class Whole(click.IntRange):
    """A whole number in a range."""

    name = "integer"


SECONDS = Number(min=0, min_open=True)
SHARE = Number(0, 1, min_open=True)
COUNT = Whole(min=1)


class FileOr(click.Path):
    """The name of a file, or one of a few words; the shell completes both."""

    def __init__(self, *words: str) -> None:
        super().__init__(dir_okay=True)  # a bag of ROS 2 is a folder
        self.words = words

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> str:
        """Return the name or the word."""
        is_word = value.lower() in self.words
        if not (is_word or Path(value).suffix or Path(value).exists()):
            from gaitgraph.errors import did_you_mean

            hint = did_you_mean(value, self.words)
            words = ", ".join(self.words)
            self.fail(
                f"{value!r} is neither a file nor one of {words}{hint}", param, ctx
            )
        return str(value)

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        """Offer files, and the words."""
        return _files_and(self.words, incomplete)


class VehicleName(click.ParamType["Vehicle | Geometry"]):
    """A vehicle: a preset or a TOML file."""

    name = "name_or_file"

    def read(self, name: str) -> Vehicle | Geometry:
        """Return the vehicle of a name."""
        from gaitgraph.vehicle import vehicle_named

        return vehicle_named(name)

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> Vehicle | Geometry:
        """Return the vehicle."""
        return self.read(value)

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        """Offer files, and the presets."""
        from gaitgraph.vehicle import preset_names

        return _files_and(preset_names(), incomplete)


class VehicleOrGeometry(VehicleName):
    """A vehicle, or rotors of any geometry in a file."""

    def read(self, name: str) -> Vehicle | Geometry:
        """Return the vehicle or the geometry; print the warnings about its file."""
        from gaitgraph.flight.vehicle_files import vehicle_or_geometry

        return vehicle_or_geometry(name, lambda note: print_problem(f"warning: {note}"))


def _files_and(words: Iterable[str], incomplete: str) -> list[CompletionItem]:
    from click.shell_completion import CompletionItem

    # Files first, since bash drops what comes before them.
    files = [CompletionItem(incomplete, type="file")]
    return files + [
        CompletionItem(word) for word in words if word.startswith(incomplete)
    ]


# ---------------------------------------------------------------- shared options


def _keep_json(ctx: click.Context, _: click.Parameter, is_asked: bool) -> None:
    ctx.meta[JSON] = is_asked


json_option = click.option(
    "--json",
    is_flag=True,
    expose_value=False,
    callback=_keep_json,
    help="Print one JSON object and nothing else.",
)
coefficients_option = click.option(
    "--coefficients",
    type=click.Choice(["published", "printed", "exact"]),
    show_default="the vehicle's",
    help="Coefficients of the paper's formula (1).",
)


class Chosen(TypedDict):
    """The vehicle and the coefficients of a command line; None for those of the file, or the default ones."""

    vehicle: Vehicle | None
    coefficients: Kind | None


def common_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """Add --vehicle and --coefficients, which the function gets as one argument `chosen`, and --json."""

    @wraps(function)
    def command(
        vehicle: Vehicle | None, coefficients: Kind | None, **options: Any
    ) -> Any:
        return function(
            chosen=Chosen(vehicle=vehicle, coefficients=coefficients), **options
        )

    vehicle_option = click.option(
        "--vehicle",
        type=VehicleName(),
        help="A preset or a TOML file; see vehicles.",
    )
    return vehicle_option(coefficients_option(json_option(command)))


GAIT_FILE = FileOr(*PAPER_GAITS)
gait_file_argument = click.argument("gait_file", metavar="GAIT_FILE", type=GAIT_FILE)
request_file_argument = click.argument(
    "request_file", metavar="[REQUEST.toml]", type=click.Path(), required=False
)
force_option = click.option(
    "--force", is_flag=True, help="Overwrite outputs that exist."
)


def _outputs_options(help_text: str) -> Callable[[FC], FC]:
    """Return what adds --output, and --force."""
    output = click.option(
        "--output", "outputs", type=click.Path(), multiple=True, help=help_text
    )
    return lambda function: output(force_option(function))


gait_outputs_options = _outputs_options("Write a file (format by suffix); repeatable.")
picture_outputs_options = _outputs_options(
    "Draw the answer, as .png, .svg or .pdf; repeatable."
)


waypoints_option = click.option(
    "--waypoint",
    "waypoints",
    type=Pair(),
    multiple=True,
    help="A point of the (α1, α2) plane; repeat in order.",
)
sign_option = click.option(
    "--sign",
    type=click.Choice(["auto", "positive", "negative"]),
    default="auto",
    help="Sign of R.",
)
servo_margin_option = click.option(
    "--servo-margin",
    type=Angle(),
    show_default="none",
    help="Servo errors that level flight must tolerate, such as 15deg.",
)
certify_option = click.option(
    "--certify",
    is_flag=True,
    help="Write a certificate beside each output.",
)
once_option = click.option(
    "--once",
    is_flag=True,
    help="Take the rows as a path that is run once, not as a closed gait.",
)
require_option = click.option(
    "--require",
    type=click.Choice(["flyable", "valid"]),
    default="flyable",
    help=CHOICES_IN_WORDS["require"],
)
anyway_option = click.option(
    "--anyway", is_flag=True, help="Write it even if it is not flyable."
)
period_of_file_option = click.option(
    "--period",
    type=SECONDS,
    metavar="SECONDS",
    show_default="what the file says",
    help="Period of the gait.",
)
law_of_file_option = click.option(
    "--law",
    type=click.Choice(LAWS),
    show_default="what the file says",
    help="Timing law.",
)


def sampling_options(function: FC) -> FC:
    """Add --samples and --rate."""
    samples = click.option(
        "--samples",
        type=COUNT,
        metavar="N",
        show_default="100",
        help="Intervals per period.",
    )
    rate = click.option(
        "--rate",
        type=Number(min=0, min_open=True),
        metavar="HZ",
        help="Samples per second, instead of --samples.",
    )
    return samples(rate(function))


def polygon_options(function: FC) -> FC:
    """Add --keep-in and --keep-out."""
    keep_in = click.option(
        "--keep-in",
        type=Polygon(),
        multiple=True,
        help='Stay in a polygon "A1,A2 A1,A2 A1,A2 …"; repeatable.',
    )
    keep_out = click.option(
        "--keep-out",
        type=Polygon(),
        multiple=True,
        help="Stay out of a polygon; repeatable.",
    )
    return keep_in(keep_out(function))
