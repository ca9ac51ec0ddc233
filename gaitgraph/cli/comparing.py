"""The command compare: two gaits side by side."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from gaitgraph.cli.inputs import gait_in
from gaitgraph.cli.options import (
    GAIT_FILE,
    common_options,
    period_of_file_option,
    picture_outputs_options,
)
from gaitgraph.cli.output import show, working

if TYPE_CHECKING:
    from gaitgraph.cli.options import Chosen


@click.command(
    "compare", short_help="Two gaits side by side: verdicts, margins, thrusts, rates."
)
@click.argument("first", metavar="A", type=GAIT_FILE)
@click.argument("second", metavar="B", type=GAIT_FILE)
@period_of_file_option
@picture_outputs_options
@common_options
def compare_command(
    first: str,
    second: str,
    period: float | None,
    outputs: tuple[str, ...],
    force: bool,
    chosen: Chosen,
) -> int:
    """Compare two gaits, each in any form that the other commands take.

    Hover thrusts and the least singular value are those of level flight, with exact coefficients, as the margins are.
    The exit code does not depend on the verdicts.
    """
    from gaitgraph.plots.axes import blank_figure, check_pictures, write_pictures
    from gaitgraph.plots.gaits import draw_sheet
    from gaitgraph.robustness.comparing import comparison_of

    check_pictures(outputs, force=force)
    options: dict[str, Any] = {**chosen, "period": period}
    with working("comparing"):
        sources = [gait_in(first, **options), gait_in(second, **options)]
        answer = comparison_of(sources, names=(first, second), **options)
        if outputs:
            figure = blank_figure(400.0, 172.0)
            draw_sheet(figure, answer.gaits, answer.names)
            write_pictures(figure, outputs, force=force)
    return show(answer, outputs=outputs, ok=True)
