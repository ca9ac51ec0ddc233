"""What commands print and write: answers, warnings, progress, and gaits as files."""

from __future__ import annotations

import json
import os
import sys
from contextlib import contextmanager
from functools import partial
from itertools import repeat
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from gaitgraph.gait.table import Table

JSON = "gaitgraph.json"
"""Where the context of a command keeps whether --json was given."""


def wants_json(ctx: click.Context | None = None) -> bool:
    """Return whether the command that runs was given --json."""
    ctx = ctx or click.get_current_context()
    return bool(ctx.meta.get(JSON))


def print_json(content: Any) -> None:
    """Print one JSON object on one line; a number that is not finite is refused."""
    click.echo(json.dumps(content, allow_nan=False))


def tell(content: Any, lines: Iterable[str]) -> int:
    """Print an object as JSON, or lines of text; return the exit code 0."""
    if wants_json():
        print_json(content)
    else:
        click.echo("\n".join(lines))
    return 0


def show(
    answer: Any,
    *,
    outputs: Sequence[object] | None = None,
    more: Mapping[str, Any] | None = None,
    lines: Iterable[str] = (),
    ok: Any = None,
) -> int:
    """Print an answer as JSON, with the `outputs` that were written and `more` keys, or as text, with more `lines`.

    Return the exit code: 0 if `ok`, by default the answer itself, is true.
    """
    content = answer.as_mapping()
    text = [str(answer)]
    text.extend(lines)
    if outputs is not None:
        content["outputs"] = [str(name) for name in outputs]
        text += [f"wrote {name}" for name in outputs]
    if more is not None:
        content |= more
    tell(content, text)
    if ok is None:
        ok = answer
    return int(not ok)


def print_problem(message: str) -> None:
    """Print what is wrong as one line on standard error, in the place of a line of progress."""
    text = f"gaitgraph: {' '.join(message.split())}"
    if _shows_progress():
        text = f"\r\x1b[K{text}"
    click.echo(text, err=True)


def _shows_progress() -> bool:
    return sys.stderr.isatty() and os.environ.get("TERM") != "dumb"


@contextmanager
def working(label: str) -> Iterator[Callable[[str], None]]:
    """Show a bar on a terminal while something takes long, and remove it at the end; show nothing in a pipe.

    Yields a function that shows what is being done, and moves the bar.
    """
    bar = click.progressbar(
        repeat(""),  # how much there is to do is not known
        label=label,
        item_show_func=lambda doing: doing,
        width=10,
        file=sys.stderr,
        hidden=not _shows_progress(),
    )
    try:
        with bar:
            yield partial(bar.update, 1)
    finally:
        if _shows_progress():
            click.echo("\x1b[1A\x1b[2K", err=True, nl=False)


def check_outputs(paths: Sequence[str], *, force: bool) -> None:
    """Raise before any work is done if a gait cannot be written to one of these files, tables or films."""
    from gaitgraph.io.formats import check_outputs, tables_and_films
    from gaitgraph.plots.films import check_films

    tables, films = tables_and_films(paths)
    check_outputs(tables, force=force)
    check_films(films, force=force)


def certificates_beside(
    outputs: Sequence[str], *, certify: bool, force: bool
) -> list[Path]:
    """Return the certificates beside gait files, gait.cert.json beside gait.csv, if they are asked for; raise if one cannot be written."""
    if not certify:
        return []
    from gaitgraph.certificates.verifying import CERTIFICATE
    from gaitgraph.files import check_new_files

    if not outputs:
        raise click.UsageError(
            "--certify must be given with --output, beside which it writes"
        )
    paths = sorted({Path(output).with_suffix(CERTIFICATE) for output in outputs})
    named_alike = [path for path in paths if str(path) in outputs]
    check_new_files(paths + named_alike, force=force)
    return paths


def write_outputs(
    table: Table, paths: Sequence[str], *, force: bool, rate: float | None = None
) -> None:
    """Write a gait to files, tables and films; warn if they lack the rate asked for."""
    from gaitgraph.io.formats import tables_and_films, write_tables
    from gaitgraph.plots.films import write_films

    tables, films = tables_and_films(paths)
    write_tables(table, tables, force=force)
    if films:
        write_films(table, films, force=force)
    if "t" in table:
        warn_of_rate(table["t"], rate)


def warn_of_rate(times: Sequence[float], rate: float | None) -> None:
    """Print a warning if rows at some times, from 0 on, do not have the rate that was asked for."""
    if rate is None or len(times) < 2:
        return
    actual = 1 / times[1]
    if abs(actual - rate) > 1e-6 * rate:
        print_problem(
            f"warning: a table has whole intervals: {actual:.6g} rows per second, not {rate:g}; a period that is a "
            f"multiple of 1/{rate:g} s has {rate:g}"
        )
