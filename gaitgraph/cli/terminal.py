"""What a command shows: its JSON on standard output, its progress on standard error."""

from __future__ import annotations

import sys
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

__all__ = ["MANY_DIVISIONS", "print_json", "progress_bar", "progress_notes"]

MANY_DIVISIONS = 128
"""A graph with more divisions than these is announced at once, for it takes a while."""


def print_json(content: Any) -> None:
    """Print one JSON object on one line; a number that is not finite is refused."""
    import json

    click.echo(json.dumps(content, allow_nan=False))


def progress_notes(*, at_once: bool = False) -> Callable[[str], None] | None:
    """Return what shows progress on a terminal once work takes longer than a second; nothing for a pipe."""
    if not sys.stderr.isatty():
        return None

    from time import monotonic

    start = monotonic()

    def show(text: str) -> None:
        if at_once or monotonic() - start > 1.0:
            click.echo(f"{text} …", err=True)

    return show


@contextmanager
def progress_bar(label: str) -> Iterator[Callable[[float], None] | None]:
    """Show a progress bar on a terminal once work takes longer than a second; nothing for a pipe."""
    if not sys.stderr.isatty():
        yield None
        return

    from time import monotonic

    start, steps = monotonic(), 1000
    with ExitStack() as stack:
        bars: list[Any] = []

        def show(fraction: float) -> None:
            if not bars and monotonic() - start > 1.0:
                bars.append(stack.enter_context(click.progressbar(length=steps, label=label, file=sys.stderr)))
            for bar in bars:
                bar.update(max(int(fraction * steps) - bar.pos, 0))

        yield show
