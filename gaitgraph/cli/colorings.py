"""The command colorings: every coloring of a loop that obeys the Two Color rule."""

from __future__ import annotations

import json
from typing import Any

import click

from gaitgraph.cli import PAPER_GAITS, Working, command, file, option, wants_json, whole_from


@command(
    "Every Two-Color-consistent colouring of a loop.",
    file("loop_file", "GAIT_FILE_OR_REQUEST", *PAPER_GAITS),
    "sign",
    option("--limit", "N", "Colourings to list at most; all are counted.", type=whole_from(0, 10**9)),
    "crossing_tolerance vehicle coefficients json",
)
def colorings_command(loop_file: str, limit: int | None = None, **given: Any) -> int:
    """List every colouring of a closed loop of (α1, α2) that obeys the Two Color rule.

    The loop is that of a gait file, gait1 to gait4, a table of alpha1 and alpha2 alone, or a request's waypoints. The
    exit code is 1, with the first pair of neighbours that forbids it, if there is none.
    """
    from itertools import islice

    from gaitgraph.planning.request import colorings_of_file

    with Working(f"coloring {loop_file}"):
        found = colorings_of_file(loop_file, **given)
    listed = islice(found, limit)
    if wants_json():
        # Written one by one: there may be more than fit in memory.
        head = json.dumps({"points": found.points.tolist(), **found.as_mapping()}, allow_nan=False)
        click.echo(f'{head[:-1]}, "colorings": [', nl=False)
        signs: list[str] = []
        for coloring in listed:
            click.echo((", " if signs else "") + json.dumps(list(coloring.colors)), nl=False)
            signs.append(coloring.sign)
        click.echo(f'], "coloring_signs": {json.dumps(signs)}}}')
    else:
        click.echo(str(found))
        for coloring in listed:
            click.echo(f"  {coloring}")
        if limit is not None and found.count > limit:
            click.echo(f"  … {limit} of them shown")
    return 0 if found else 1
