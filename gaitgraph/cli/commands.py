"""What click lacks here: negative angles as arguments, a hint for a mistyped command, files loaded on demand."""

from __future__ import annotations

import re
import sys
from collections.abc import MutableMapping
from importlib import import_module
from typing import TYPE_CHECKING, Any

import click

from gaitgraph.errors import InputError, did_you_mean

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

__all__ = ["Command", "CommandFiles", "Group", "as_typed", "command", "complete_after_equals_signs"]

_NEGATIVE_ANGLE = re.compile(r"-\s*(?:\d|\.|pi|π|inf|nan)", re.IGNORECASE)
_MINUS = "−"  # stands for the hyphen of a negative angle while the arguments are parsed


def as_typed(message: str) -> str:
    """Give the arguments that a message quotes their hyphens back."""
    return message.replace(_MINUS, "-")


def _unmarked(value: Any) -> Any:
    """Give a marked argument its hyphen back."""
    return "-" + value[1:] if isinstance(value, str) and value.startswith(_MINUS) else value


class Command(click.Command):
    """A command whose arguments may be negative angles as they stand; there are no short options."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse the arguments; a negative angle is never taken for an option."""
        valued = {
            name
            for option in self.params
            if isinstance(option, click.Option) and not option.is_flag
            for name in option.opts
        }
        marked = [
            _MINUS + arg[1:] if _NEGATIVE_ANGLE.match(arg) and before not in valued else arg
            for before, arg in zip(["", *args], args, strict=False)
        ]
        try:
            rest = super().parse_args(ctx, marked)
        except click.BadParameter as error:
            told = _told_of_number(error)
            if not told:
                raise
            raise InputError(as_typed(told)) from error
        for name, value in ctx.params.items():
            if isinstance(value, tuple):
                ctx.params[name] = tuple(map(_unmarked, value))
            else:
                ctx.params[name] = _unmarked(value)
        return rest


def _told_of_number(error: click.BadParameter) -> str:
    """Return what is told of an option whose text is not the number that it must be; "" of any other problem."""
    option = error.param
    text, said, _ = error.message.partition(" is not a valid ")
    if option is None or not said or option.type not in (click.FLOAT, click.INT):
        return ""
    number = "a whole number" if option.type is click.INT else "a number"
    unit = f" of {str(option.metavar).lower()}" if option.metavar in ("SECONDS", "METRES") else ""
    return f"{option.opts[0]}: {text}; allowed is {number}{unit}"


def command(short_help: str) -> Callable[[Callable[..., int]], Command]:
    """Make a function a command: ``export_command`` is ``export``, its docstring the help, its value the exit code."""
    return click.command(cls=Command, short_help=short_help)


class CommandFiles(MutableMapping[str, click.Command]):
    """The commands by name, each loaded from its file when it is first asked for.

    Parameters
    ----------
    package
        Where the files are.
    files
        The file of each command, which is its function ``NAME_command`` there.
    """

    def __init__(self, package: str, files: Mapping[str, str]) -> None:
        self._package = package
        self._commands: dict[str, str | click.Command] = dict(files)

    def __getitem__(self, name: str) -> click.Command:
        found = self._commands[name]
        if isinstance(found, str):
            module = import_module(f"{self._package}.{found}")
            loaded: click.Command = getattr(module, name.replace("-", "_") + "_command")
            self._commands[name] = found = loaded
        return found

    def __setitem__(self, name: str, command: click.Command) -> None:
        self._commands[name] = command

    def __delitem__(self, name: str) -> None:
        del self._commands[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._commands)

    def __len__(self) -> int:
        return len(self._commands)


class Group(click.Group):
    """A group that answers an unknown name with the one that was meant, or with all there are."""

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
        """Find the command that the first argument names; UsageError if there is none."""
        name = args[0]
        if self.get_command(ctx, name) is None and not name.startswith("-"):
            known = self.list_commands(ctx)
            hint = did_you_mean(name, known) or f"; allowed are {', '.join(known)}"
            raise click.UsageError(f"no command {name!r}{hint}")
        return super().resolve_command(ctx, args)


def complete_after_equals_signs() -> None:
    """Let bash complete ``--color=r`` too: it hands the name, the sign and the value over as three words."""
    from click.shell_completion import BashComplete, add_completion_class

    class Bash(BashComplete):
        def get_completion_args(self) -> tuple[list[str], str]:
            args, incomplete = super().get_completion_args()
            return (args[:-1] if args[-1:] == ["="] else args), incomplete

    add_completion_class(Bash)
