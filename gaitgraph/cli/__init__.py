"""The command line: parse, make one library call, print or write.

Exit codes: 0 done; 1 well-formed, and the answer is no; 2 wrong input or something missing, one line on standard
error and nothing on standard output; 130 interrupted. Data goes to standard output, messages to standard error.
Nothing heavy is imported before a command runs, and a command's file only for its own run or for the list of all.
"""

from __future__ import annotations

import io
import os
import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any, NoReturn

import click

from gaitgraph import __version__
from gaitgraph.cli.options import as_typed
from gaitgraph.cli.terminal import print_problem
from gaitgraph.errors import GaitgraphError, did_you_mean

if TYPE_CHECKING:
    from collections.abc import Sequence

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
