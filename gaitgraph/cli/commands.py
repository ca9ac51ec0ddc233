"""What click lacks here: negative angles as arguments, a hint for a mistyped command, files loaded on demand."""

from __future__ import annotations

import re
import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

import click

from gaitgraph.errors import InputError, did_you_mean

if TYPE_CHECKING:
    from collections.abc import Callable

COMMANDS = (
    "plan", "validate", "colorings", "cycles", "region", "robustness", "transition", "optimize", "pace", "retarget",
    "fly", "basin", "study", "roots", "export", "vehicles", "figures", "explore",
)  # fmt: skip
"""Each is the function NAME_command in the file of its name."""

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
