"""What a command shows: its JSON and its text on standard output, its progress and its problems on standard error."""

from __future__ import annotations

import os
import re
import sys
from contextlib import contextmanager, nullcontext, suppress
from typing import TYPE_CHECKING, Any, Self

import click

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from contextlib import AbstractContextManager
    from types import TracebackType

__all__ = ["Working", "print_json", "print_note", "print_problem", "print_text", "working"]

_GRACE = 1.0  # seconds without a word
_TICK = 0.2
_RARELY = 10.0  # seconds between two lines where a line cannot be written over

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
    """Print what people read: on a terminal its verdicts in color, unless the environment says otherwise."""
    if _is_colored():
        click.echo(_in_color(text), color=True)
    else:
        click.echo(text)


def print_note(text: str) -> None:
    """Print on standard error what helps at a terminal; nothing for a pipe."""
    if sys.stderr.isatty():
        click.echo(text, err=True)


def print_problem(message: str) -> None:
    """Print what is wrong as one line on standard error."""
    click.echo("gaitgraph: " + " ".join(message.split()), err=True)


def _is_colored() -> bool:
    """Return whether standard output is colored: NO_COLOR forbids it, FORCE_COLOR asks for it, else a terminal's is."""
    if os.environ.get("NO_COLOR"):
        return False
    if os.environ.get("FORCE_COLOR", "0") not in ("", "0"):
        return True
    return sys.stdout.isatty() and not _is_dumb()


def _is_dumb() -> bool:
    return os.environ.get("TERM") == "dumb"


def _in_color(text: str) -> str:
    def painted(word: str) -> str:
        return click.style(word, fg=_COLORS[word])

    text = _MARK.sub(lambda found: found[1] + painted(found[2]), text)
    text = _VERDICT.sub(lambda line: _ANSWER.sub(lambda found: painted(found[0]), line[0]), text)
    text = _REFUSAL.sub(lambda found: click.style(found[0], fg="red"), text)
    return _WARNING.sub(lambda found: click.style(found[0], fg="yellow"), text)


def working(doing: str) -> Working:
    """Return a context that says on a terminal what is being done, once it takes longer than a second.

    Parameters
    ----------
    doing
        A few words, such as "planning"; told until the work itself says more.

    Notes
    -----
    Nothing is shown in a pipe. Where TERM is dumb, lines are added instead of written over, one in ten seconds.
    """
    return Working(doing, live=sys.stderr.isatty())


class Working:
    """What :func:`working` gives: called with a few words, it shows them, and for how many seconds work has gone on."""

    def __init__(self, doing: str, *, live: bool) -> None:
        self._words, self._live = doing, live
        self._line = ""
        self._end: Callable[[], None] | None = None
        self._alone: AbstractContextManager[Any] = nullcontext()

    def __call__(self, words: str) -> None:
        """Say what is being done now."""
        self._words = words

    def part(self, fraction: float) -> None:
        """Say that a fraction of what is being done is done, so that the words end with a percentage."""
        words = re.sub(r" \d+ %$", "", self._words)
        self._words = f"{words} {int(100 * fraction)} %"

    @contextmanager
    def aside(self) -> Iterator[None]:
        """Make room for lines of the answer while work goes on."""
        with self._alone:
            self._erase()
            yield

    def __enter__(self) -> Self:
        if self._live:
            # A thread of its own, since most of what takes long does not call back.
            from threading import Event, RLock, Thread

            over, self._alone = Event(), RLock()
            thread = Thread(target=self._run, args=(over.wait,), daemon=True)
            thread.start()

            def end() -> None:
                over.set()
                thread.join()

            self._end = end
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._end is not None:
            self._end()
            self._erase()

    def _run(self, ended_within: Callable[[float], bool]) -> None:
        from time import monotonic

        start = monotonic()
        pause, dumb = _GRACE, _is_dumb()
        # The terminal may be gone; the work goes on.
        with suppress(OSError, ValueError):
            while not ended_within(pause):
                if dumb:
                    click.echo(f"{self._words} …", err=True)
                    pause = _RARELY
                else:
                    self._draw(monotonic() - start)
                    pause = _TICK

    def _draw(self, seconds: float) -> None:
        with self._alone:
            clock = f" … {seconds:.0f} s"
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
