"""Texts of results: rows of cells as lines of a table."""

from __future__ import annotations

from textwrap import fill
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Sequence

WIDTH = 110  # characters of a line


def table_lines(
    rows: Iterable[Sequence[str]], *, right: Collection[int] = ()
) -> list[str]:
    """Return rows of cells as lines with aligned columns; the last cell of a row is wrapped.

    `right` are the numbers of the columns that are aligned to the right.

    >>> table_lines([("gait", "length"), ("3", "3.14"), ("biased", "12.6")], right={1})
    ['  gait    length', '  3         3.14', '  biased    12.6']
    """
    listed = list(rows)
    widths = [max(map(len, column)) for column in zip(*listed, strict=True)]
    lines = []
    for row in listed:
        cells = []
        for number, (cell, width) in enumerate(zip(row, widths, strict=True)):
            cells.append(cell.rjust(width) if number in right else cell.ljust(width))
        *head, last = cells
        begin = "  " + "".join(f"{cell}  " for cell in head)
        indent = " " * len(begin)
        wrapped = fill(last, WIDTH, initial_indent=begin, subsequent_indent=indent)
        lines.append(wrapped.rstrip())
    return lines
