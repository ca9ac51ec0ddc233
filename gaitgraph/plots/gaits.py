"""Gaits: loops (Figure 17), singular attitudes (Figures 18 to 22), basins over them, and one in four dimensions."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import groupby
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely

from gaitgraph.angles import HALF_PI, percent, whole_number
from gaitgraph.errors import InputError, shown
from gaitgraph.gait.table import Table
from gaitgraph.invertibility.matrices import Coefficients, FloatArray, coefficients_of
from gaitgraph.io.formats import gait_of, given_gait
from gaitgraph.plots import axes as base
from gaitgraph.plots.planes import FINE, type_map
from gaitgraph.robustness.attitudes import acceptable_attitudes, singular_curve
from gaitgraph.surface.sheets import COLORS, RELATION, sheet_angles
from gaitgraph.timing.timed_gait import TimedGait

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from gaitgraph.flight.basins import Basin
    from gaitgraph.flight.flight import Outcome
    from gaitgraph.gait.gait import Gait
    from gaitgraph.io.formats import GaitLike
    from gaitgraph.surface.sheets import Sign

# Opposite rotors have the same angle on the red sheet: they differ in width, so that both curves are visible.
ANGLE_LOOKS: tuple[dict[str, Any], ...] = tuple(
    {
        "color": color,
        "linewidth": 3.4 if k < 2 else 1.6,
        "linestyle": ("-", (0, (3, 0.7)), (0, (5, 2)), (0, (1, 1.2)))[k],
    }
    for k, color in enumerate(base.ROTOR_COLORS)
)
_DASHES: dict[str, Any] = {"blue": (0, (3, 1.2)), "none": (0, (1, 1))}  # "none": off the surfaces
_PALE = {"red": "#fcd4cd", "blue": "#9fb3e8"}
_INSIDE = shapely.box(*(-HALF_PI + 1e-6,) * 2, *(HALF_PI - 1e-6,) * 2)  # the roll–pitch square without its sides


def gait_loop(
    gait: GaitLike,
    *,
    angles: tuple[int, int] = (1, 2),
    label: str | None = None,
    width: float = 1.6,
    band: bool = False,
    ax: Axes | None = None,
) -> Axes:
    """Draw the projection of a gait on the plane of two of its angles, with an arrow in its direction (Figure 17).

    Red segments are solid, blue ones dashed, segments off the surfaces black and dotted. A gait of one point is a mark.

    `angles` are two of 1 to 4, `label` is the text in a legend, `width` is in points. With `band` the loop is a pale
    band below all marks, for a map with labels. `ax` are axes such as those of :func:`type_map`; by default new ones.
    """
    if sorted(angles) != sorted(set(angles) & {1, 2, 3, 4}) or len(angles) != 2:
        raise InputError(f"angles must be two different ones of 1 to 4, got {shown(angles)}")
    gait, fresh = gait_of(gait), ax is None
    ax = base.axes_or_new(ax)
    columns = [angle - 1 for angle in angles]
    starts, ends = gait.alpha[:, columns], gait.ends[:, columns]
    colors = gait.colors or ("none",) * len(starts)
    ink = [base.COLOR_OF.get(color, "black") for color in colors]
    if len(starts) == 1:
        ax.plot(*starts[0], marker=base.MARKER_OF.get(colors[0], "D"), color=ink[0], linestyle="none", label=label)
    closed, k = len(set(colors)) == 1, 0
    for color, run in groupby(colors):
        stop = k + len(list(run))
        look = {"color": ink[k], "linestyle": _DASHES.get(color, "-"), "zorder": 4}
        if band:
            joints = {"solid_joinstyle": "round", "solid_capstyle": "butt"}
            look = {"color": _PALE.get(color, "0.8"), "zorder": 1.2, **joints}
        # A loop of one color ends at its second point, so that its first corner is joined too.
        points = np.concatenate([starts[k:stop], ends[stop - 1 : stop], ends[: int(closed)]])
        ax.plot(*points.T, linewidth=width, label=label if k == 0 else None, **look)
        k = stop
    steps = ends - starts
    lengths = np.linalg.norm(steps, axis=1)
    if lengths.max() > 0:
        # The arrow is on the first long segment, off its middle, where a grid node may be.
        longest = int(np.argmax(lengths > 0.75 * lengths.max()))
        tail = starts[longest] + 0.36 * steps[longest]
        base.draw_arrow(
            ax, tail, tail + 0.03 * steps[longest], ink[longest], width=0.0, size=14 if band else 6 + 4 * width
        )
    if fresh:
        base.plane_axes(ax, rf"\alpha_{angles[0]}", rf"\alpha_{angles[1]}")
    return ax


def roll_pitch_diagram(
    gait: GaitLike, *, eta: float | None = None, name: str = "gait", count: int = 48, ax: Axes | None = None
) -> Axes:
    """Draw the attitudes at which a gait is singular, and those of its biased gait (Figures 18 to 22).

    As in the paper the gait is red and solid, its biased gait blue and dashed. Thin lines are the singular attitudes at
    `count` equally spaced times of a period. Shaded are the attitudes around level flight at which it is
    never singular. The gait's coefficients are taken as exact: with the published ones blue gaits have a sign of R.

    `eta` is η of the biased gait, equations (14) and (15); without it only the gait is drawn. `name` is the gait's name
    in the legend. Singular curves have the ``gid`` "singular", shaded areas "acceptable", their borders "border".
    """
    whole_number("count", count, 1, 10_000)
    gait = gait_of(gait)
    ax = base.axes_or_new(ax)
    draw_attitudes(ax, gait, name, base.RED, count)
    if eta is not None:
        draw_attitudes(ax, gait.biased(eta), f"{name}, $\\eta$ = {eta:g}", base.BLUE, count, dash=(0, (3, 1.5)))
    finish_diagram(ax)
    return ax


def as_if_exact(coefficients: Coefficients) -> Coefficients:
    """Return coefficients whose digits are taken as exact, without rounding error."""
    return replace(coefficients, kind="exact")


def draw_attitudes(
    ax: Axes, gait: Gait, name: str, color: str, count: int, *, dash: Any = "-", basin: Basin | None = None
) -> None:
    """Draw the singular attitudes of a gait at `count` times of a period, and shade the acceptable ones, or a basin's.

    The square is hatched if the gait is singular at every attitude. The label states the result, or is a basin's name.
    """
    numbers = as_if_exact(gait.coefficients)
    around = basin.acceptable if basin else acceptable_attitudes(gait.alpha, numbers)
    alpha = gait.parametrize(1.0, law="constant-speed").at(np.arange(count) / count)[0]
    curves = [singular_curve(row, numbers) for row in alpha]
    kinds = {curve.kind for curve in curves}
    empty = around.polygon.is_empty
    words = f"{percent(around.fraction)} acceptable" if not empty else "singular in level flight"
    words = "no singular attitude" if kinds == {"none"} else words
    label = name if basin else f"{name}:\n{'singular at every attitude' if 'everywhere' in kinds else words}"
    if "everywhere" in kinds:
        corners = HALF_PI * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
        look: dict[str, Any] = {"facecolor": (color, 0.12), "edgecolor": (color, 0.5), "hatch": "xxx", "linewidth": 0.0}
        ax.fill(*corners.T, **look, gid="singular", label=label)
        return
    for curve in curves:
        if curve.kind == "curve":
            ax.plot(*curve.points().T, color=color, linestyle=dash, linewidth=0.5, alpha=0.8, gid="singular", zorder=2)
    if not empty:
        ax.fill(*np.asarray(around.polygon.exterior.coords).T, color=color, alpha=0.12, linewidth=0.0, gid="acceptable")
    # The border without the sides of the square, where nothing is singular.
    border = shapely.line_merge(around.polygon.exterior.intersection(_INSIDE)) if not empty else shapely.LineString()
    for part in shapely.get_parts(border):
        ax.plot(*np.asarray(part.coords).T, color=color, linestyle=dash, linewidth=2.0, gid="border", zorder=3)
    face = "none" if empty else (color, 0.12)
    ax.fill([], [], facecolor=face, edgecolor=color, linestyle=dash, linewidth=1.2, label=label)  # for the legend


def finish_diagram(ax: Axes) -> None:
    """Mark level flight, and label the axes with roll and pitch."""
    ax.plot(0, 0, marker="+", markersize=6, color="black", linestyle="none", zorder=6)
    base.plane_axes(ax, r"\phi", r"\theta", grid=False)
    ax.set(xlabel=r"roll $\phi$ (rad)", ylabel=r"pitch $\theta$ (rad)")
    base.legend_below(ax, ncols=2)


def gait_in_four_dimensions(
    timed: GaitLike, *, gait: Gait | None = None, axes: Sequence[Axes] | npt.NDArray[np.object_] | Figure | None = None
) -> npt.NDArray[np.object_]:
    """Draw a gait over one period: its angles in time, its loop on the map of types, and three projections.

    `timed` is a timed gait, a table, or a gait in any other form; without times it gets the smooth law and a period of
    1 s. `gait` is the closed polyline of a table, by default :func:`gaitgraph.io.formats.gait_of` of it. Returns the
    five `axes`: time, (α1, α2), (α1, α3), (α2, α4), (α3, α4); by default new ones of an empty figure, given or new.
    """
    given = given_gait(timed, name="timed")
    gait = gait or gait_of(given)
    if isinstance(given, Table) and "t" in given and "alpha3" in given:
        time, alpha = np.asarray(given["t"], dtype=float), given.alpha
    else:
        clock = given if isinstance(given, TimedGait) else gait.parametrize()
        time, alpha = clock.t, clock.alpha
    if axes is None or hasattr(axes, "subplot_mosaic"):
        figure: Any = axes or base.blank_figure(170, 118, pyplot=True)
        axes = list(figure.subplot_mosaic([["time", "time", "12"], ["13", "24", "34"]]).values())
    axes = np.ravel(np.asarray(axes, dtype=object))
    if len(axes) != 5:
        raise InputError(f"axes must be five, got {len(axes)}")
    for ax in axes:
        base.axes_or_new(ax)
    draw_angles(axes[0], time, alpha)
    sign: Sign = "positive" if gait.R[np.argmax(np.abs(gait.R))] > 0 else "negative"
    type_map(sign, coefficients=gait.coefficients, labels=False, ax=axes[1])
    gait_loop(gait, ax=axes[1])
    axes[1].set_title(f"nodes with ${RELATION[sign]}$")
    axis = np.linspace(-HALF_PI, HALF_PI, FINE)
    for k, (ax, angles) in enumerate(zip(axes[2:], ((1, 3), (2, 4), (3, 4)), strict=True)):
        for color in COLORS if k < 2 else ():
            # The + and the − plane of α3 over α1, and of α4 over α2.
            height = sheet_angles(color, axis, axis, gait.coefficients)[k].copy()
            height[1:][np.abs(np.diff(height)) > HALF_PI] = np.nan  # it wraps there
            dash = "-" if color == "red" else "--"
            ax.plot(axis, height, color=base.COLOR_OF[color], linewidth=0.5, alpha=0.7, linestyle=dash)
        gait_loop(gait, angles=angles, ax=ax)
        base.plane_axes(ax, rf"\alpha_{angles[0]}", rf"\alpha_{angles[1]}")
    return axes


def draw_angles(ax: Axes, time: FloatArray, alpha: FloatArray) -> None:
    """Draw four tilt angles over time [s]."""
    for k, look in enumerate(ANGLE_LOOKS):
        ax.plot(time, alpha[:, k], label=rf"$\alpha_{k + 1}$", **look)
    base.angle_axis(ax.yaxis, r"\alpha_i")
    ax.set(xlabel="$t$ (s)", xlim=(float(time[0]), float(time[-1])) if time[-1] > time[0] else None)
    ax.grid(True)
    base.legend_above(ax, columns=4)


# Each outcome has its own shape, so that no color is needed; the order is that of flight.flight.OUTCOMES.
OUTCOME_LOOKS: dict[Outcome, dict[str, Any]] = {
    "settled": {"marker": "o", "color": "#009e73", "markersize": 3.0},
    "not settled": {"marker": "D", "color": "#e69f00", "markersize": 3.4},
    "near singular": {"marker": "x", "color": "black", "markersize": 4.2, "markeredgewidth": 1.1},
    "sign change": {"marker": "*", "color": "black", "markersize": 5.2, "markeredgewidth": 0.0},
    "tumbling": {"marker": "v", "color": "#cc79a7", "markersize": 4.0},
    "upended": {"marker": "^", "color": "#56b4e9", "markersize": 4.0},
    "refused": {"marker": "s", "color": "#8a8a8a", "markersize": 3.0},
}
_WORDS: dict[Outcome, str] = {"sign change": "determinant changed sign", "near singular": "stopped near singularity"}
_FULL_SIZE = 17  # with more attitudes along a side, marks are smaller


def basin_map(basin: Basin, *, name: str = "", ax: Axes | None = None) -> Axes:
    """Draw how the flights from each attitude ended, over the roll–pitch diagram of the gait. `name` is in the title.

    Thin lines are attitudes at which the gait is singular at some time, with exact coefficients. The thick line borders
    the acceptable attitudes, at which it never is. Both have the color of the gait's sheet, or are grey. A green disc
    means that all flights from the attitude settled; otherwise the mark is that of the first flight that did not, in
    the order of take-off. Marks have the ``gid`` "outcome".
    """
    ax = base.axes_or_new(ax)
    gait = basin.timed.gait
    exact = coefficients_of(gait.vehicle, "exact")
    label = f"acceptable: {int(basin.inside.sum())} of {basin.inside.size} attitudes"
    color = base.COLOR_OF.get(gait.color or "", base.GREY)
    draw_attitudes(ax, replace(gait, coefficients=exact), label, color, 24, basin=basin)
    finish_diagram(ax)
    smaller = min(1.0, _FULL_SIZE / len(basin.angles))
    for code, (outcome, look) in enumerate(OUTCOME_LOOKS.items()):
        roll, pitch = (basin.worst == code).nonzero()
        if len(roll):
            drawn = look | {"markersize": look["markersize"] * smaller, "linestyle": "none", "zorder": 4}
            label = f"{_WORDS.get(outcome, outcome)}: {len(roll)}"
            ax.plot(basin.angles[roll], basin.angles[pitch], label=label, gid="outcome", **drawn)
    ax.set_title(f"{name or basin.name}\n{percent(basin.fraction)} of {basin.worst.size} attitudes settled")
    base.legend_below(ax)
    return ax


def basins_figure(basins: Sequence[Basin]) -> Figure:
    """Return a figure of basins side by side, four in a row at most."""
    width, height, legend_line = 68.0, 73.0, 4.2  # mm
    columns = min(len(basins), 4)
    figure = base.blank_figure(width * columns, height)
    panels: np.ndarray[Any, Any] = figure.subplots(math.ceil(len(basins) / columns), columns, squeeze=False)
    for ax, basin in zip(panels.flat, basins, strict=False):
        basin_map(basin, ax=ax)
    for ax in panels.flat[len(basins) :]:
        ax.set_axis_off()
    most = max(len(ax.get_legend().get_texts()) for ax in panels.flat[: len(basins)])
    figure.set_size_inches(width * columns / base.INCH, len(panels) * (height + legend_line * most) / base.INCH)
    return figure
