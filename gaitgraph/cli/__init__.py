"""The command line: parse, make one library call, print or write. How commands are found, end, and print is here.

Exit codes: 0 done; 1 well-formed, and the answer is no; 2 wrong input or something missing, one line on standard
error and nothing on standard output; 130 interrupted. Data goes to standard output, messages to standard error.
Nothing heavy is imported before a command runs, and a command's file only for its own run or for the list of all.
"""

from __future__ import annotations

import io
import json
import os
import re
import sys
from contextlib import contextmanager, suppress
from importlib import import_module
from threading import Event, RLock, Thread
from time import monotonic
from typing import TYPE_CHECKING, Any, NoReturn, Self

import click

from gaitgraph import __version__
from gaitgraph.cli.options import as_typed
from gaitgraph.errors import GaitgraphError, did_you_mean

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

COMMANDS = (
    "plan", "validate", "colorings", "cycles", "region", "robustness", "transition", "optimize", "pace", "retarget",
    "fly", "basin", "study", "roots", "export", "vehicles", "figures", "explore",
)  # fmt: skip
"""Each is the function NAME_command in the file of its name."""


class Group(click.Group):
    """The group of :data:`COMMANDS`, each loaded from its file when it is first asked for."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of the commands."""
        return sorted(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Return a command by its name, or None."""
        if cmd_name not in COMMANDS:
            return None
        found: click.Command = getattr(import_module(f"gaitgraph.cli.{cmd_name}"), f"{cmd_name}_command")
        return found

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command; Abort if it is interrupted, without the empty line that click prints even into a pipe."""
        try:
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
            hint = did_you_mean(args[0], sorted(COMMANDS)) or f"; the commands are {', '.join(sorted(COMMANDS))}"
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
    """Print what is wrong as one line on standard error."""
    click.echo("gaitgraph: " + " ".join(message.split()), err=True)


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
    try:
        code = cli.main(args=None if args is None else list(args), prog_name="gaitgraph", standalone_mode=False)
        sys.stdout.flush()
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.format_message())
        _stop(2 if error.ctx and error.ctx.parent else 0)
    except click.UsageError as error:
        message = as_typed(error.format_message()).rstrip(".")
        _stop(2, f"{message}; see {error.ctx.command_path if error.ctx else 'gaitgraph'} --help")
    except (click.Abort, KeyboardInterrupt):
        _stop(130, "interrupted")
    except BrokenPipeError:  # the reader of the output went away
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        _stop(0)
    except GaitgraphError as error:
        _stop(2, str(error))
    except MemoryError:
        _stop(2, "not enough memory; use a smaller grid or file, or a table as CSV, which is read in pieces")
    except OSError as error:
        # Every file is guarded in its own place: this is standard output itself, on a full disk for example.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        _stop(2, f"standard output cannot be written: {error.strerror or error}")
    sys.exit(code or 0)


# ---------------------------------------------------------------- what commands print

_COLORS = {"ok": "green", "yes": "green", "??": "yellow", "unknown": "yellow", "warning": "yellow"}  # all others red
_COLORED = re.compile(
    r"^(?:  (?:ok|NO|\?\?)(?=  )|warning(?=: )|No [a-z]+(?=[.:])|valid (?:yes|no) · .*$)", re.MULTILINE
)
_WORDS = re.compile(r"\b(?:ok|NO|No [a-z]+|yes|no|unknown|warning)\b|\?\?")
_GRACE = 1.0  # s without progress
_TICK = 0.2  # s


def print_json(content: Any) -> None:
    """Print one JSON object on one line; a number that is not finite is refused."""
    click.echo(json.dumps(content, allow_nan=False))


def print_text(text: str) -> None:
    """Print text for people: on a terminal with its verdicts in color, unless the environment says otherwise."""
    # NO_COLOR forbids color, FORCE_COLOR asks for it, in a pipe too; otherwise click leaves it to terminals.
    forced = os.environ.get("FORCE_COLOR", "0") not in ("", "0")
    is_plain = os.environ.get("NO_COLOR") or (os.environ.get("TERM") == "dumb" and not forced)

    def colored(line: re.Match[str]) -> str:
        return _WORDS.sub(lambda word: click.style(word[0], fg=_COLORS.get(word[0], "red")), line[0])

    click.echo(_COLORED.sub(colored, text), color=False if is_plain else forced or None)


def show(
    found: Any,
    *,
    as_json: bool,
    more: Mapping[str, Any] | None = None,
    lines: Iterable[str] = (),
    ok: bool | None = None,
) -> int:
    """Print a result: its mapping with some more keys as JSON, or its text with some more lines.

    Return the exit code: whether the answer is yes says `ok`, or the result's own truth.
    """
    if as_json:
        print_json({**found.as_mapping(), **(more or {})})
    else:
        print_text("\n".join([str(found), *lines]))
    return 0 if (found if ok is None else ok) else 1


class Working:
    """A context that shows on a terminal what is being done and for how long, once it takes longer than a second.

    The words given are shown until it is called with others. Nothing is shown in a pipe, or where TERM is dumb.
    """

    def __init__(self, doing: str) -> None:
        self._words, self._line = doing, ""
        self._over, self._alone = Event(), RLock()
        # A thread of its own, since most of what takes long does not call back.
        self._clock = Thread(target=self._run, daemon=True)
        self._is_shown = sys.stderr.isatty() and os.environ.get("TERM") != "dumb"

    def __call__(self, words: str) -> None:
        """Show from now on what is being done now."""
        self._words = words

    def part(self, fraction: float) -> None:
        """Show which fraction of the work is done, as a percentage."""
        self._words = f"{re.sub(r' [0-9]+ %$', '', self._words)} {int(100 * fraction)} %"

    @contextmanager
    def aside(self) -> Iterator[None]:
        """Clear the line for a part of the answer while work goes on."""
        with self._alone:
            self._show("")
            yield

    def __enter__(self) -> Self:
        if self._is_shown:
            self._clock.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._is_shown:
            self._over.set()
            self._clock.join()
            self._show("")

    def _run(self) -> None:
        start, pause = monotonic(), _GRACE
        while not self._over.wait(pause):
            pause = _TICK
            with self._alone, suppress(OSError, ValueError):
                clock = f" … {monotonic() - start:.0f} s"
                width = os.get_terminal_size(sys.stderr.fileno()).columns or 80
                self._show(self._words[: max(width - 1 - len(clock), 0)] + clock)

    def _show(self, line: str) -> None:
        """Write over the line of progress; the empty line removes it."""
        if line != self._line:
            with suppress(OSError, ValueError):  # the terminal may be gone; the work goes on
                click.echo("\r" + line.ljust(len(self._line)) + "\r" * (not line), err=True, nl=False)
            self._line = line
