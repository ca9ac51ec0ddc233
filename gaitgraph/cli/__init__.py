"""The command line: how commands are found, take options, print and end.

Exit codes: 0 done; 1 well-formed, and the answer is no; 2 wrong input or something missing, one line on standard
error, below warnings about files, and nothing on standard output; 130 interrupted. Data goes to standard output, messages to standard error.
Help and completion import neither numpy nor other commands.
"""

from __future__ import annotations

import io
import json
import os
import re
import sys
import warnings
from contextlib import contextmanager, suppress
from importlib import import_module
from threading import Event, Thread
from time import monotonic
from typing import TYPE_CHECKING, Any, NoReturn, Self

import click

from gaitgraph import __version__
from gaitgraph.errors import (
    FileWarning,
    GaitgraphError,
    Infeasible,
    InputError,
    checked_choice,
    did_you_mean,
    reworded,
    shown,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
    from pathlib import Path

    from click.shell_completion import CompletionItem

    from gaitgraph.gait.given import GaitLike
    from gaitgraph.gait.table import Table
    from gaitgraph.io.servo_map import ServoMap
    from gaitgraph.planning.request import PlanRequest

    Decorator = Callable[[Any], Any]
    Words = Iterable[str] | Callable[[], Iterable[str]]

Paths = tuple[str, ...]

GROUPS = {
    "Plan": {"plan": "plan", "region": "surface"},
    "Judge": {
        "validate": "judging",
        "colorings": "surface",
        "compare": "judging",
        "certify": "judging",
        "verify": "judging",
        "robustness": "judging",
    },
    "Change": {
        "pace": "gaits",
        "transition": "gaits",
        "optimize": "gaits",
        "retarget": "gaits",
    },
    "Write": {"export": "gaits"},
    "Fly": {"fly": "flights", "basin": "flights", "study": "study"},
    "Surfaces and the paper": {
        "roots": "surface",
        "cycles": "surface",
        "figures": "figures",
    },
    "Page and vehicles": {"explore": "explore", "vehicles": "vehicles"},
}
"""The commands in the order of the work. Each is the function NAME_command of the file that stands beside it."""

COMMANDS = {name: file for group in GROUPS.values() for name, file in group.items()}


class Group(click.Group):
    """The group of :data:`COMMANDS`, each loaded from its file when it is first asked for."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of the commands."""
        return list(COMMANDS)

    def format_commands(
        self, ctx: click.Context, formatter: click.HelpFormatter
    ) -> None:
        """Write the commands in their groups, each on one line."""
        for title, group in GROUPS.items():
            rows = []
            for name in group:
                command = self.get_command(ctx, name)
                short = command.get_short_help_str(limit=66) if command else ""
                rows.append((name.ljust(10), short))
            with formatter.section(title):
                formatter.write_dl(rows)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Return a command by its name, or None."""
        if cmd_name not in COMMANDS:
            return None
        found: click.Command = getattr(
            import_module(f"gaitgraph.cli.{COMMANDS[cmd_name]}"), f"{cmd_name}_command"
        )
        return found

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command, and print each warning once, when it arises; Abort, without an empty line, if interrupted."""
        said = set()

        def say(message: Warning | str, *_: object) -> None:
            if str(message) not in said:
                said.add(str(message))
                print_problem(f"warning: {message}")

        try:
            with warnings.catch_warnings():
                warnings.simplefilter("always", FileWarning)
                warnings.showwarning = say  # type: ignore[assignment]
                return super().invoke(ctx)
        except KeyboardInterrupt:
            if sys.stderr.isatty():  # which shows ^C on the line
                click.echo(err=True)
            raise click.Abort from None

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Find the command that the first argument names; UsageError with a hint if there is none."""
        if args[0] not in COMMANDS and not args[0].startswith("-"):
            hint = (
                did_you_mean(args[0], sorted(COMMANDS))
                or f"; the commands are {', '.join(sorted(COMMANDS))}"
            )
            raise click.UsageError(f"no command {args[0]!r}{hint}")
        return super().resolve_command(ctx, args)


@click.group(cls=Group, context_settings={"max_content_width": 100})
@click.version_option(__version__, prog_name="gaitgraph")
def cli() -> None:
    """Plan gaits of a tilt-rotor that keep its decoupling matrix invertible.

    Angles are numbers in radians or texts such as 3pi/8, -3*pi/8 or 67.5deg.
    """


def _stop(code: int, message: str = "") -> NoReturn:
    if message:
        print_problem(message)
    sys.exit(code)


def print_problem(message: str) -> None:
    """Print what is wrong as one line on standard error, in the place of a line of progress."""
    clear = "\r\x1b[K" if _shows_progress() else ""
    click.echo(f"{clear}gaitgraph: " + " ".join(message.split()), err=True)


def _shows_progress() -> bool:
    return sys.stderr.isatty() and os.environ.get("TERM") != "dumb"


def main(args: Sequence[str] | None = None) -> NoReturn:
    """Run the command line and exit with its code."""
    if sys.stderr is None:
        sys.stderr = io.StringIO()
    if sys.stdout is None:
        sys.stdout = io.StringIO()
        _stop(2, "standard output is closed")
    for stream in (sys.stdout, sys.stderr):
        # An encoding without Greek letters gets question marks instead of a traceback.
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
    stdout = sys.stdout
    try:
        code = cli.main(
            args=None if args is None else list(args),
            prog_name="gaitgraph",
            standalone_mode=False,
        )
        sys.stdout.flush()
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.format_message())
        _stop(2 if error.ctx and error.ctx.parent else 0)
    except click.UsageError as error:
        message = error.format_message().rstrip(".")
        message += " See" if message.endswith("?") else "; see"
        _stop(
            2,
            f"{message} {error.ctx.command_path if error.ctx else 'gaitgraph'} --help",
        )
    except (click.Abort, KeyboardInterrupt):
        _stop(130, "interrupted")
    except (BrokenPipeError, SystemExit) as error:
        # The reader of the output went away: click replaces standard output and exits with 1.
        if isinstance(error, SystemExit) and sys.stdout is stdout:
            raise
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        _stop(0)
    except Infeasible as error:  # of a request that stands for its gait
        if "--json" not in (sys.argv if args is None else args):
            _stop(1, error.on_command_line)
        print_json({"status": "infeasible", "reason": error.on_command_line})
        code = 1
    except GaitgraphError as error:
        _stop(2, error.on_command_line)
    except MemoryError:
        _stop(
            2,
            "not enough memory; use a smaller grid or file",
        )
    except OSError as error:
        # Every file is guarded in its own place: this is standard output itself, on a full disk for example.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        _stop(2, f"standard output cannot be written: {error.strerror or error}")
    sys.exit(code or 0)


# ---------------------------------------------------------------- commands and their options


class Command(click.Command):
    """A command without short options.

    The function gets what was given: an option without a default that was not given is not among its arguments.
    """

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse the arguments."""
        rest = super().parse_args(ctx, args)
        ctx.params = {
            name: one
            for name, one in ctx.params.items()
            if not (one is None or one is False or one == ())
        }
        return rest


def command(
    short_help: str, *options: str | Decorator, **settings: Any
) -> Callable[[Callable[..., int]], Command]:
    """Make a function a command: its docstring is the help, its value the exit code.

    Options are in the order of the help; a text names some that commands share. `settings` are for click's context.
    """
    named = [one.split() if isinstance(one, str) else [one] for one in options]
    flat = [
        _SHARED[one] if isinstance(one, str) else one for part in named for one in part
    ]

    def decorated(function: Any) -> Command:
        for one in reversed(flat):
            function = one(function)
        made: Command = click.command(
            cls=Command, short_help=short_help, context_settings=settings
        )(function)
        return made

    return decorated


class Kind(click.ParamType):  # type: ignore[type-arg]  # generic in new versions of click alone
    """A kind of value: what it must be, and what parses it; errors name the option."""

    def __init__(self, name: str, parse: Callable[[str], Any]) -> None:
        self.name, self._parse = name, parse

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> Any:
        """Return the value of a text."""
        try:
            return self._parse(value)
        except ValueError:
            raise InputError(
                f"{param.opts[0] if param else ''} must be {self.name}, got {shown(value)}"
            ) from None


def whole_from(low: int, high: int) -> Kind:
    """Return the kind of whole numbers in a range."""
    # index raises ValueError for a number outside.
    return Kind(
        f"a whole number from {low} to {high}",
        lambda text: low + range(low, high + 1).index(int(text)),
    )


def _angle(text: str) -> float:
    from gaitgraph.angles import angle_from_text

    angle = angle_from_text(text, "angle")
    if angle < 0:
        raise ValueError
    return angle


def pair_of(text: str, *more: int) -> list[str]:
    """Return the two parts of a text, or as many as `more` allows; else raise ValueError."""
    parts = [part.strip() for part in text.split(",")]
    if len(parts) not in (2, *more):
        raise ValueError
    return parts


_KINDS: dict[str, Any] = {
    "ANGLE": Kind("an angle ≥ 0, such as 0.3, pi/8 or 20deg", _angle),
    "A1,A2": Kind(
        "A1,A2, two angles", lambda text: pair_of(text, 4)
    ),  # the library says why not four
    "ROLL,PITCH": Kind("ROLL,PITCH, two angles", pair_of),
    "X,Y[,Z]": Kind(
        "two or three numbers (m/s)", lambda text: tuple(map(float, text.split(",")))
    ),
    "POLYGON": Kind(
        "'A1,A2 A1,A2 A1,A2 …'",
        lambda text: [pair_of(corner) for corner in text.split()],
    ),
    "N": Kind("a whole number", int),
    "SECONDS": Kind("a number of seconds", float),
    **dict.fromkeys(
        ("X", "ETA", "HZ", "METRES", "M/S", "NEWTON"), Kind("a number", float)
    ),
}


def _completion(words: Words, *, is_file: bool) -> Callable[..., list[CompletionItem]]:
    """Return the completion of a value by words, and by files."""

    def complete(
        _: click.Context, __: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        from click.shell_completion import CompletionItem

        # Files first, since bash drops what comes before them.
        found = [CompletionItem(incomplete, type="file")] if is_file else []
        known = words() if callable(words) else words
        return found + [
            CompletionItem(name) for name in known if name.startswith(incomplete)
        ]

    return complete


def option(
    flag: str,
    metavar: str,
    text: str,
    *,
    name: str = "",
    words: Words = (),
    **more: Any,
) -> Decorator:
    """Return an option whose metavar determines the kind of value; `words` complete it, and the library checks it."""
    completion = _completion(
        words, is_file=re.search("FILE|FOLDER|DIR", metavar) is not None
    )
    more = {
        "type": _KINDS.get(metavar, click.STRING),
        "shell_complete": completion,
        **more,
    }
    return click.option(
        flag, *([name] if name else []), metavar=metavar, help=text, **more
    )


def one_of(
    flag: str,
    *words: str,
    of: str = "",
    default: str = "",
    check: bool = False,
    **more: Any,
) -> Decorator:
    """Return an option that is one of some words, by default the first; `of` begins its help.

    With `check` the words are checked here, otherwise by the library.
    """
    if check:
        more["callback"] = lambda _, __, value: (
            value and checked_choice(flag, value, words)
        )
    text = (
        f"{of}{', '.join(words[:-1])} or {words[-1]}.  [default: {default or words[0]}]"
    )
    return option(flag, "NAME", text, words=words, **more)


def file(name: str, metavar: str, *words: str, **more: Any) -> Decorator:
    """Return an argument: the name of a file, or one of a few words."""

    def checked(_: click.Context, __: click.Parameter, value: Any) -> Any:
        from pathlib import Path

        if "" in (value if isinstance(value, tuple) else (value,)):
            raise InputError(
                f"{metavar.strip('[.]')} must be the name of a file, got ''"
            )
        if (
            words
            and value
            and value.lower() not in words
            and not Path(value).suffix
            and not Path(value).exists()
        ):
            hint = did_you_mean(value, words)
            raise InputError(
                f"{metavar} must be a file, or {' or '.join(words)}, got {shown(value)}{hint}"
            )
        return value

    completion = _completion(words, is_file=True)
    return click.argument(
        name, metavar=metavar, shell_complete=completion, callback=checked, **more
    )


def flag(flag: str, text: str) -> Decorator:
    """Return an option without a value."""
    return click.option(flag, is_flag=True, help=text)


def _preset_names() -> list[str]:
    from gaitgraph.vehicle import preset_names

    return preset_names()


def _vehicle(_: click.Context, __: click.Parameter, name: str | None) -> Any:
    if name is None:
        return None
    from gaitgraph.vehicle import vehicle_named

    return vehicle_named(name)


def _json(ctx: click.Context, _: click.Parameter, is_asked: bool) -> None:
    ctx.meta["json"] = is_asked


def wants_json() -> bool:
    """Return whether the command that runs was given --json."""
    return bool(click.get_current_context().meta["json"])


PAPER_GAITS = ("gait1", "gait2", "gait3", "gait4")  # of Section 5, instead of a file
LAWS = ("smooth", "constant-speed", "equal-time")
_COEFFICIENTS = "published for the paper's vehicle, exact for others"
_CROSSING = (
    "Distance from a crossing line within which a type is '?'.  [default: pi/32]"
)
_OUTPUT = "Write the answer, in the format of the suffix; repeatable."
_ROUNDING = "Error of each angle.  [default: the distance from its sheet]"
_VEHICLE = "A preset (see gaitgraph vehicles) or a TOML file."

_SHARED: dict[str, Decorator] = {
    "json": click.option(
        "--json",
        is_flag=True,
        expose_value=False,
        callback=_json,
        help="Print one JSON object and nothing else.",
    ),
    "force": flag("--force", "Overwrite outputs that exist."),
    "gait_file": file("gait_file", "GAIT_FILE", *PAPER_GAITS),
    "request_file": file("request_file", "[REQUEST.toml]", required=False),
    "certify": flag(
        "--certify",
        "Write a certificate beside each output: gait.cert.json beside gait.csv.",
    ),
    "outputs": option("--output", "FILE", _OUTPUT, name="outputs", multiple=True),
    "vehicle": option(
        "--vehicle", "NAME_OR_FILE", _VEHICLE, words=_preset_names, callback=_vehicle
    ),
    "coefficients": one_of(
        "--coefficients",
        "published",
        "printed",
        "exact",
        of="Coefficients of formula (1): ",
        default=_COEFFICIENTS,
        check=True,
    ),
    "color": one_of("--color", "auto", "red", "blue"),
    "sign": one_of("--sign", "auto", "positive", "negative", of="Sign of R: "),
    "divisions": option(
        "--divisions", "N", "Grid intervals in [−π/2, π/2].  [default: 16]"
    ),
    "floor": option(
        "--floor",
        "X",
        "Least singular value floor: the gait must stay above it.  [default: 0.05]",
    ),
    "accuracy": option(
        "--accuracy",
        "ANGLE",
        "Accuracy of curved borders, with --method exact.  [default: 1e-6]",
    ),
    "crossing_tolerance": option("--crossing-tolerance", "ANGLE", _CROSSING),
    "angle_rounding": option("--angle-rounding", "ANGLE", _ROUNDING),
    "period": option("--period", "SECONDS", "Period T.  [default: 1]"),
    "once": flag("--once", "The rows are a path: run once, not led back to row 1."),
    "law": one_of(
        "--law", *LAWS, of="Timing law (position along the loop over time): "
    ),
    "period_of_file": option(
        "--period", "SECONDS", "Period T.  [default: what the file says]"
    ),
    "law_of_file": one_of("--law", *LAWS, default="what the file says"),
    "samples": option("--samples", "N", "Even intervals per period.  [default: 100]"),
    "rate": option("--rate", "HZ", "Samples per second, instead of --samples."),
    "require": one_of(
        "--require", "flyable", "valid", of="Needed for exit code 0: ", check=True
    ),
    "keep_in": option(
        "--keep-in",
        "POLYGON",
        'Only inside: "A1,A2 A1,A2 A1,A2 …"; repeatable.',
        multiple=True,
    ),
    "keep_out": option(
        "--keep-out", "POLYGON", "Only outside; repeatable.", multiple=True
    ),
    "waypoints": option(
        "--waypoint",
        "A1,A2",
        "A waypoint; repeat in order.",
        name="waypoints",
        multiple=True,
    ),
}


def request_of(
    file: str | None, given: Mapping[str, Any]
) -> tuple[PlanRequest, dict[str, Any]]:
    """Return the request of a file, options or both, and its sampling; InputError if there are no waypoints."""
    from gaitgraph.planning.request import read_request, request_from_mapping

    if file is None and "waypoints" not in given:
        raise InputError(
            "waypoints must be in a request file or given with --waypoint A1,A2, got neither",
            field="waypoints",
        )
    with named_in_errors(given):
        return (
            request_from_mapping(given) if file is None else read_request(file, given)
        )


@contextmanager
def named_in_errors(given: Mapping[str, Any], **names: str) -> Iterator[None]:
    """Name the option, if that was given, in an InputError about a field; `names` are fields with other options."""
    try:
        yield
    except InputError as error:
        name = names.get(error.field or "", error.field)
        if name is None or given.get(name) is None:
            raise
        message = error.message.removeprefix(str(error.field))
        if message == error.message:
            raise
        raise reworded(error, f"--{name.replace('_', '-')}{message}") from error


def gait_in(
    gait_file: str,
    given: Mapping[str, Any],
    fields: Sequence[str] = ("vehicle", "coefficients"),
    *,
    once: bool = False,
    joints: ServoMap | None = None,
) -> GaitLike:
    """Return the gait that a GAIT_FILE stands for: of a request the one planned, else what its name says.

    The options of these `fields` replace those of a request. With `once` it is its table as a path, read with `joints`.
    """
    from gaitgraph.io.formats import holds_request, read_table

    if once:
        return read_table(gait_file, joints=joints).once()
    if gait_file in PAPER_GAITS or not holds_request(gait_file):
        return gait_file
    from gaitgraph.gait.given import GivenGait
    from gaitgraph.planning.planner import planned_gait

    chosen = {name: given[name] for name in fields if name in given}
    return GivenGait(source=planned_gait(gait_file, chosen))


TIMED = ("vehicle", "coefficients", "period", "law")
"""Fields of a request that the options of a command with a timed gait replace."""


def check_outputs(paths: Paths, *, force: bool) -> None:
    """Raise before any work is done if a gait cannot be written to one of these files, tables or films."""
    from gaitgraph.io.formats import check_outputs, tables_and_films
    from gaitgraph.plots.films import check_films

    tables, films = tables_and_films(paths)
    check_outputs(tables, force=force)
    check_films(films, force=force)


def certificates_beside(outputs: Paths, *, force: bool) -> list[Path]:
    """Return the certificates beside gait files, gait.cert.json beside gait.csv; raise if one cannot be written."""
    from pathlib import Path

    from gaitgraph.certificates.verifying import CERTIFICATE
    from gaitgraph.files import check_new_files

    paths = sorted({Path(output).with_suffix(CERTIFICATE) for output in outputs})
    if not paths:
        raise InputError(
            "--certify must be given with --output, beside which it writes, got no output"
        )
    check_new_files(
        [*paths, *(path for path in map(Path, outputs) if path in paths)], force=force
    )
    return paths


def write_outputs(
    table: Table,
    paths: Paths,
    *,
    force: bool,
    rate: float | None = None,
) -> None:
    """Write a gait to files, tables and films; warn if they lack the rate asked for."""
    from gaitgraph.io.formats import tables_and_films, write_tables
    from gaitgraph.plots.films import write_films

    tables, films = tables_and_films(paths)
    write_tables(table, tables, force=force)
    if films:
        write_films(table, films, force=force)
    if "t" in table:
        warn_of_rate(table["t"], rate)


def warn_of_rate(times: Sequence[float], rate: float | None) -> None:
    """Print a warning if rows at some times, from 0 on, do not have the rate that was asked for."""
    if rate is None or len(times) < 2:
        return
    found = 1 / times[1]
    if abs(found - rate) > 1e-6 * rate:
        print_problem(
            f"warning: a table has whole intervals: {found:.6g} rows per second, not {rate:g}; a period that is a "
            f"multiple of 1/{rate:g} s has {rate:g}"
        )


# ---------------------------------------------------------------- what commands print

_GRACE = 1.0  # s without progress
_TICK = 0.2  # s


def print_json(content: Any) -> None:
    """Print one JSON object on one line; a number that is not finite is refused."""
    click.echo(json.dumps(content, allow_nan=False))


def tell(content: Any, lines: Iterable[str]) -> int:
    """Print an object as JSON, or lines of text; return the exit code 0."""
    if wants_json():
        print_json(content)
    else:
        click.echo("\n".join(lines))
    return 0


def show(
    found: Any,
    *,
    more: Mapping[str, Any] | None = None,
    lines: Iterable[str] = (),
    ok: Any = None,
) -> int:
    """Print a result as JSON, with `more` keys, or as text, with more `lines`.

    Return the exit code: 0 if `ok`, by default the result itself, is true.
    """
    if wants_json():
        print_json({**found.as_mapping(), **(more or {})})
    else:
        click.echo("\n".join([str(found), *lines]))
    return 0 if (found if ok is None else ok) else 1


class Working:
    """Shows on a terminal what is being done and for how long, once it takes longer than a second.

    Calling it changes the words. Nothing is shown in a pipe, or where TERM is dumb.
    """

    def __init__(self, doing: str) -> None:
        self._words, self._line = doing, ""
        self._over = Event()
        # A thread of its own, since most of what takes long does not call back.
        self._clock = Thread(target=self._run, daemon=True)
        self._is_shown = _shows_progress()

    def __call__(self, words: str) -> None:
        """Change the words."""
        self._words = words

    def part(self, fraction: float) -> None:
        """Show the fraction of the work that is done, as a percentage."""
        self._words = (
            f"{re.sub(r' [0-9]+ %$', '', self._words)} {int(100 * fraction)} %"
        )

    def __enter__(self) -> Self:
        if self._is_shown:
            self._clock.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        if self._is_shown:
            self._clock.join()
        self._show("")

    def _run(self) -> None:
        start, pause = monotonic(), _GRACE
        while not self._over.wait(pause):
            pause = _TICK
            with suppress(OSError, ValueError):
                clock = f" … {monotonic() - start:.0f} s"
                width = os.get_terminal_size(sys.stderr.fileno()).columns or 80
                self._show(self._words[: max(width - 1 - len(clock), 0)] + clock)

    def _show(self, line: str) -> None:
        """Replace the line of progress; an empty text removes it."""
        if line != self._line:
            with suppress(
                OSError, ValueError
            ):  # the terminal may be gone; the work goes on
                click.echo(
                    "\r" + line.ljust(len(self._line)) + "\r" * (not line),
                    err=True,
                    nl=False,
                )
            self._line = line
