"""The command line: how commands are found and how they end.

Exit codes: 0 done; 1 well-formed, and the answer is no; 2 wrong input or something missing, one line on standard
error, below warnings about files, and nothing on standard output; 130 interrupted. Data goes to standard output,
messages to standard error. Help and completion import neither numpy nor other commands.
"""

from __future__ import annotations

import io
import os
import sys
import warnings
from importlib import import_module
from typing import TYPE_CHECKING, Any, NoReturn

import click

from gaitgraph import __version__
from gaitgraph.cli.output import print_json, print_problem, wants_json
from gaitgraph.errors import FileWarning, GaitgraphError, Infeasible

if TYPE_CHECKING:
    from collections.abc import Sequence

GROUPS = {
    "Plan": {"plan": "plan", "region": "surface"},
    "Judge": {
        "validate": "judging",
        "colorings": "surface",
        "compare": "comparing",
        "certify": "certifying",
        "verify": "certifying",
        "robustness": "judging",
    },
    "Change and write": {
        "pace": "timing",
        "transition": "timing",
        "optimize": "gaits",
        "retarget": "gaits",
        "export": "export",
    },
    "Fly": {"fly": "flights", "basin": "flights", "study": "study"},
    "Look up and draw": {
        "roots": "surface",
        "cycles": "surface",
        "figures": "figures",
        "explore": "explore",
        "vehicles": "vehicles",
    },
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
                if command is not None:
                    short = command.get_short_help_str(limit=66)
                    rows.append((name.ljust(10), short))
            with formatter.section(title):
                formatter.write_dl(rows)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Return a command by its name, or None."""
        if cmd_name not in COMMANDS:
            return None
        module = import_module(f"gaitgraph.cli.{COMMANDS[cmd_name]}")
        command: click.Command = getattr(module, f"{cmd_name}_command")
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Find the command that the first argument names; NoSuchCommand, with the nearest name, if there is none."""
        try:
            return super().resolve_command(ctx, args)
        except click.exceptions.NoSuchCommand as error:
            raise click.exceptions.NoSuchCommand(
                error.command_name, possibilities=COMMANDS, ctx=ctx
            ) from None

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command and return its exit code; print each warning about files once, when it arises."""
        printed = set()

        def print_warning(message: Warning | str, *_: object) -> None:
            if str(message) not in printed:
                printed.add(str(message))
                print_problem(f"warning: {message}")

        try:
            with warnings.catch_warnings():
                warnings.simplefilter("always", FileWarning)
                warnings.showwarning = print_warning  # type: ignore[assignment]
                return super().invoke(ctx)
        except click.UsageError as error:
            name = ctx.invoked_subcommand
            command = name and self.get_command(ctx, name)
            if error.ctx is None and command:  # an option without its value
                error.ctx = click.Context(command, info_name=name, parent=ctx)
            raise
        except Infeasible as error:  # of a request that stands for its gait
            if wants_json(ctx):
                reason = error.on_command_line
                print_json({"status": "infeasible", "reason": reason})
            else:
                print_problem(error.on_command_line)
            return 1
        except KeyboardInterrupt:
            if sys.stderr.isatty():  # which shows ^C on the line
                click.echo(err=True)
            raise click.Abort from None  # click itself would print an empty line


@click.group(
    cls=Group,
    invoke_without_command=True,
    context_settings={"max_content_width": 100, "show_default": True},
)
@click.version_option(__version__, prog_name="gaitgraph")
@click.pass_context
def cli(ctx: click.Context) -> None:
    """Plan gaits of a tilt-rotor that keep its decoupling matrix invertible.

    Angles are numbers in radians or texts such as 3pi/8, -3*pi/8 or 67.5deg.
    """
    if ctx.invoked_subcommand is None:
        click.echo(ctx.get_help())


def main(args: Sequence[str] | None = None) -> NoReturn:
    """Run the command line and exit with its code."""
    _prepare_streams()
    stdout = sys.stdout
    try:
        code = cli.main(args, prog_name="gaitgraph", standalone_mode=False)
        sys.stdout.flush()
    except click.UsageError as error:
        _stop(2, _usage_problem(error))
    except (click.Abort, KeyboardInterrupt):
        _stop(130, "interrupted")
    except (BrokenPipeError, SystemExit) as error:
        # The reader of the output went away: click replaces standard output and exits with 1.
        if isinstance(error, SystemExit) and sys.stdout is stdout:
            raise
        _discard_output()
        sys.exit(0)
    except GaitgraphError as error:
        _stop(2, error.on_command_line)
    except MemoryError:
        _stop(2, "not enough memory; use a smaller grid or file")
    except OSError as error:
        # Every file is guarded in its own place: this is standard output itself, on a full disk for example.
        _discard_output()
        _stop(2, f"standard output cannot be written: {error.strerror or error}")
    sys.exit(code or 0)


def _prepare_streams() -> None:
    """Stop if standard output is closed; print question marks for Greek letters that an encoding does not have."""
    if sys.stderr is None:
        sys.stderr = io.StringIO()
    if sys.stdout is None:
        sys.stdout = io.StringIO()
        _stop(2, "standard output is closed")
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")


def _usage_problem(error: click.UsageError) -> str:
    """Return what is wrong with the arguments, and which help to read."""
    message = error.format_message().rstrip(".")
    command = "gaitgraph"
    if error.ctx is not None:
        command = error.ctx.command_path
    if message.endswith("?"):
        return f"{message} See {command} --help"
    return f"{message}; see {command} --help"


def _discard_output() -> None:
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _stop(code: int, message: str) -> NoReturn:
    print_problem(message)
    sys.exit(code)
