"""Gait files that are text: whole, or line by line. A byte-order mark and any kind of line end are read silently."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gaitgraph.errors import InputError
from gaitgraph.files import blocks_of, decoded, text_of
from gaitgraph.io.formats import readable_suffixes

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

__all__ = ["WHAT", "lines_of", "whole_text"]

WHAT = "gait file"
"""What messages call a file."""

_ALLOWED = "a gait table: " + ", ".join(readable_suffixes())
_TEXT = "a gait table as text"
_LONGEST_LINE = 1 << 22


def whole_text(path: Path) -> str:
    """Return the text of a file; FileProblem or InputError if there is none."""
    return text_of(path, WHAT, _TEXT)


def lines_of(path: Path, progress: Callable[[float], None] | None) -> Iterator[list[str]]:
    """Yield the lines of a text file in groups, whatever its size.

    Parameters
    ----------
    path
        The file, UTF-8.
    progress
        Called with the fraction of the file that is read.

    Raises
    ------
    FileProblem, InputError
        If it cannot be read, is no text, or has a line of more than 4 MiB.
    """
    rest = b""
    for block, fraction in blocks_of(path, WHAT, _ALLOWED):
        content = rest + block
        # A carriage return at the end may be half of a line end.
        end = max(content.rfind(b"\n"), content.rfind(b"\r", 0, len(content) - 1)) + 1
        if not end and len(content) > _LONGEST_LINE:
            raise InputError(f"a line is longer than {_LONGEST_LINE} bytes; allowed are a header line and rows")
        content, rest = content[:end], content[end:]
        if progress is not None:
            progress(fraction)
        if content:
            yield _split(content, path)
    if rest:
        yield _split(rest, path)


def _split(content: bytes, path: Path) -> list[str]:
    text = decoded(content, path, WHAT, _TEXT)
    if "\r" in text:
        text = text.replace("\r\n", "\n").replace("\r", "\n")
    return text.removesuffix("\n").split("\n")
