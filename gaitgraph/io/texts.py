"""CSV and JSON: the formats that need no library. :mod:`gaitgraph.reading` reads them.

A CSV file has one more column than the table, `made_by`: what made it, in the first row and, since the last row is the
first again, there. A comment line would be in the way of everything else that reads CSV.
"""

from __future__ import annotations

import csv
import json
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitgraph.gait.table import merged, provenance_of, provenance_text
from gaitgraph.io.formats import check_names

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path

    from gaitgraph.gait.table import Table

__all__ = ["MADE_BY", "write_csv", "write_json"]

MADE_BY = "made_by"
"""The column of a CSV file that tells what made it."""


def _plain(values: Any) -> list[Any]:
    return values.tolist() if isinstance(values, np.ndarray) else list(values)


def write_csv(pieces: Iterable[Table], path: Path) -> None:
    """Write a new CSV file, piece by piece; InputError if a column has the name of the one that tells what made it."""
    with path.open("w", encoding="utf-8", newline="") as stream:
        csv.writer(stream, lineterminator="\n").writerows(_csv_rows(pieces))


def _csv_rows(pieces: Iterable[Table]) -> Iterator[Iterable[Any]]:
    told = mark = ""
    before: tuple[Any, ...] | None = None
    for piece in pieces:
        if before is None:
            check_names(piece.columns, [MADE_BY], ".csv")
            told = mark = provenance_text(piece)
            yield (*piece.columns, MADE_BY)
        for row in zip(*map(_plain, piece.columns.values()), strict=True):
            if before is not None:
                yield (*before, mark)
                mark = ""
            before = row
    if before is not None:
        yield (*before, told)


def write_json(pieces: Iterable[Table], path: Path) -> None:
    """Write a new JSON file: format, version, about, and the columns as lists."""
    table = merged(pieces)
    lines = [
        f"  {json.dumps(key)}: {json.dumps(value, allow_nan=False)}" for key, value in provenance_of(table).items()
    ]
    columns = [
        f"    {json.dumps(name)}: {json.dumps(_plain(values), allow_nan=False)}"
        for name, values in table.columns.items()
    ]
    lines.append('  "columns": {\n' + ",\n".join(columns) + "\n  }")
    path.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")
