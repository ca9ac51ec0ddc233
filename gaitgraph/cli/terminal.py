"""What a command shows: its JSON and its text on standard output, its progress and its problems on standard error."""

from __future__ import annotations

import os
import re
import sys
from contextlib import contextmanager, nullcontext, suppress
from typing import TYPE_CHECKING, Any, Self

import click

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping
    from contextlib import AbstractContextManager
    from threading import Event, Thread

_GRACE = 1.0  # seconds without progress
_TICK = 0.2
_RARELY = 10.0  # seconds between two lines on a terminal that cannot write over a line

_COLORS = {"ok": "green", "yes": "green", "NO": "red", "no": "red", "??": "yellow", "unknown": "yellow"}
_MARK = re.compile(r"^(  )(ok|NO|\?\?)(?=  )", re.MULTILINE)
_VERDICT = re.compile(r"^valid (?:yes|no) · .*$", re.MULTILINE)
_ANSWER = re.compile(r"\b(yes|no|unknown)\b")
_REFUSAL = re.compile(r"^No [a-z]+(?=[.:])", re.MULTILINE)
_WARNING = re.compile(r"^warning(?=: )", re.MULTILINE)


def print_json(content: Any) -> None:
    """Print one JSON object on one line; a number that is not finite is refused."""
    import json

    click.echo(json.dumps(content, allow_nan=False))


def print_text(text: str) -> None:
    """Print text for people: on a terminal with its verdicts in color, unless the environment says otherwise."""
    # NO_COLOR forbids color and FORCE_COLOR asks for it, in a pipe too.
    forced = os.environ.get("FORCE_COLOR", "0") not in ("", "0")
    if os.environ.get("NO_COLOR") or not (forced or (sys.stdout.isatty() and not _is_dumb())):
        click.echo(text)
        return

    def colored(word: str) -> str:
        return click.style(word, fg=_COLORS[word])

    text = _MARK.sub(lambda found: found[1] + colored(found[2]), text)
    text = _VERDICT.sub(lambda line: _ANSWER.sub(lambda found: colored(found[0]), line[0]), text)
    text = _REFUSAL.sub(lambda found: click.style(found[0], fg="red"), text)
    click.echo(_WARNING.sub(lambda found: click.style(found[0], fg="yellow"), text), color=True)


def show(found: Any, *, as_json: bool, more: Mapping[str, Any] | None = None, lines: Iterable[str] = ()) -> None:
    """Print a result: its mapping with some more keys as JSON, or its text with some more lines."""
    if as_json:
        print_json({**found.as_mapping(), **(more or {})})
    else:
        print_text("\n".join([str(found), *lines]))


def print_problem(message: str) -> None:
    """Print what is wrong as one line on standard error."""
    click.echo("gaitgraph: " + " ".join(message.split()), err=True)


def _is_dumb() -> bool:
    return os.environ.get("TERM") == "dumb"


class Working:
    """A context that shows on a terminal what is being done and for how long, once it takes longer than a second.

    The words given are shown until it is called with others. Nothing is shown in a pipe. Where TERM is dumb, lines are
    added instead of written over, one in ten seconds.
    """

    def __init__(self, doing: str, *, live: bool | None = None) -> None:
        self._words, self._live = doing, sys.stderr.isatty() if live is None else live
        self._line = ""
        self._clock: tuple[Event, Thread] | None = None
        self._alone: AbstractContextManager[Any] = nullcontext()

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
            self._erase()
            yield

    def __enter__(self) -> Self:
        if self._live:
            # A thread of its own, since most of what takes long does not call back.
            from threading import Event, RLock, Thread

            self._alone = RLock()
            over = Event()
            self._clock = over, Thread(target=self._run, args=(over,), daemon=True)
            self._clock[1].start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._clock is not None:
            over, thread = self._clock
            over.set()
            thread.join()
            self._erase()

    def _run(self, over: Event) -> None:
        from time import monotonic

        start, pause = monotonic(), _GRACE
        with suppress(OSError, ValueError):  # the terminal may be gone; the work goes on
            while not over.wait(pause):
                if _is_dumb():
                    click.echo(f"{self._words} …", err=True)
                    pause = _RARELY
                    continue
                pause = _TICK
                with self._alone:
                    clock = f" … {monotonic() - start:.0f} s"
                    width = os.get_terminal_size(sys.stderr.fileno()).columns or 80
                    line = self._words[: max(width - 1 - len(clock), 0)] + clock
                    if line != self._line:
                        click.echo("\r" + line.ljust(len(self._line)), err=True, nl=False)
                        self._line = line

    def _erase(self) -> None:
        if self._line:
            with suppress(OSError, ValueError):
                click.echo("\r" + " " * len(self._line) + "\r", err=True, nl=False)
            self._line = ""
