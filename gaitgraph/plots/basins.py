"""Basins: from which attitudes a gait settled, over the roll–pitch diagram of what its determinant says."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from gaitgraph.errors import InputError
from gaitgraph.invertibility.matrices import coefficients_of
from gaitgraph.plots.axes import COLOR_OF, GREY, axes_or_new, blank_figure, legend_below, paper_style
from gaitgraph.plots.gaits import singular_attitudes

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from gaitgraph.flight.basins import Basin
    from gaitgraph.flight.record import Outcome

__all__ = ["basin_map", "basins_figure"]

# Each outcome has its own shape, so that colors, which those see alike who lack a cone, are not needed; in the order of
# flight.records.OUTCOMES, whose codes count them.
_LOOKS: dict[Outcome, dict[str, Any]] = {
    "settled": {"marker": "o", "color": "#009e73", "markersize": 3.0},
    "not settled": {"marker": "D", "color": "#e69f00", "markersize": 3.4},
    "near singular": {"marker": "x", "color": "black", "markersize": 4.2, "markeredgewidth": 1.1},
    "sign change": {"marker": "*", "color": "black", "markersize": 5.2, "markeredgewidth": 0.0},
    "tumbling": {"marker": "v", "color": "#cc79a7", "markersize": 4.0},
    "upended": {"marker": "^", "color": "#56b4e9", "markersize": 4.0},
    "refused": {"marker": "s", "color": "#8a8a8a", "markersize": 3.0},
}
_MOST = 17  # attitudes along a side whose marks have full size
# Of a panel [mm]: its width, its height without a legend, and of each line of that.
_WIDTH, _HEIGHT, _LINE = 68.0, 73.0, 4.2


def basin_map(basin: Basin, *, name: str = "", ax: Axes | None = None) -> Axes:
    """Draw how flights from each attitude ended, over the roll–pitch diagram of the gait.

    Thin lines are the attitudes at which the gait is singular at even times of its period, with exact coefficients; the
    thick line borders the basin's acceptable attitudes, those at which it never is. They have the color of the gait's
    sheet, or are grey where it is on neither, as a biased gait is. Numbers are of the grid's attitudes. An attitude has
    the mark of the first of its flights, in the order of take-off, that did not settle; a green disc where all did.

    Parameters
    ----------
    basin
        What was flown.
    name
        What the title calls the gait; by default what the basin does.
    ax
        Plane axes; by default those of a new figure. Marks have "outcome" as their ``gid``.
    """
    ax = axes_or_new(ax, size=(85, 105))
    gait = basin.timed.gait
    exact = replace(gait, coefficients=coefficients_of(gait.vehicle, "exact"))
    told = f"acceptable: {int(basin.inside.sum())} of {basin.inside.size} attitudes"
    color = COLOR_OF.get(gait.color or "", GREY)
    singular_attitudes(exact, basin.acceptable, label=told, color=color, count=24, ax=ax)
    worst = basin.worst
    smaller = min(1.0, _MOST / len(basin.angles))
    for code, outcome in enumerate(_LOOKS):
        roll, pitch = (worst == code).nonzero()
        if len(roll):
            look = _LOOKS[outcome]
            ax.plot(
                basin.angles[roll],
                basin.angles[pitch],
                linestyle="none",
                label=f"{_WORDS.get(outcome, outcome)}: {len(roll)}",
                gid="outcome",
                zorder=4,
                **{**look, "markersize": look["markersize"] * smaller},
            )
    ax.set_title(f"{name or basin.name}\n{100 * basin.fraction:.1f} % of {worst.size} attitudes settled")
    legend_below(ax)
    return ax


_WORDS: dict[Outcome, str] = {"sign change": "determinant changed sign", "near singular": "stopped near singularity"}


def basins_figure(basins: Sequence[Basin]) -> Figure:
    """Return a figure of basins side by side, four in a row at most.

    Raises
    ------
    InputError
        If there are none.
    MissingExtra
        If matplotlib is not installed.
    """
    if not basins:
        raise InputError("basins: none; allowed is one or more")
    with paper_style():
        columns = min(len(basins), 4)
        rows = math.ceil(len(basins) / columns)
        figure = blank_figure(_WIDTH * columns, _HEIGHT * rows)
        panels: np.ndarray[Any, Any] = figure.subplots(rows, columns, squeeze=False)
        for ax, basin in zip(panels.flat, basins, strict=False):
            basin_map(basin, ax=ax)
        for ax in panels.flat[len(basins) :]:
            ax.set_axis_off()
        lines = [max(map(_lines_of_legend, row)) for row in panels]
        figure.set_size_inches(_WIDTH * columns / 25.4, sum(_HEIGHT + _LINE * count for count in lines) / 25.4)
    return figure


def _lines_of_legend(ax: Axes) -> int:
    legend = ax.get_legend()
    return 0 if legend is None else len(legend.get_texts())
