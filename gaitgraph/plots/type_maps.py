"""The adjacency rule, the map of plane types, and loops on it (Figures 15 to 17)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from gaitgraph.errors import InputError, shown
from gaitgraph.graph.build import DEFAULT_DIVISIONS
from gaitgraph.invertibility.matrices import Coefficients, coefficients_of
from gaitgraph.plots.axes import (
    BLUE,
    COLOR_OF,
    GREY,
    MARKER_OF,
    RED,
    axes_or_new,
    draw_arrow,
    half_markers,
    legend_above,
    plane_axes,
)
from gaitgraph.plots.root_maps import InteriorRoots, checked_sign, interior_roots
from gaitgraph.surface.adjacency import PLANE_TYPES, types_may_be_adjacent
from gaitgraph.surface.sheets import COLORS, Sign

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes

    from gaitgraph.gait.gait import Gait

__all__ = ["adjacency_rule", "gait_loop", "type_map"]

FloatArray = npt.NDArray[np.float64]


def adjacency_rule(of: Literal["angle", "pair"] = "pair", *, ax: Axes | None = None) -> Axes:
    """Draw the Two Color rule as a graph: the types that are lined may be neighbours (Figure 15).

    Each type may also be its own neighbour. As in the paper (?,?), a neighbour of every type, is left out. The lines
    are those that :func:`gaitgraph.surface.adjacency.types_may_be_adjacent` allows; each has the two types as its ``gid``.

    Parameters
    ----------
    of
        "angle" for the types of α3 or α4 alone, Figure 15 (a); "pair" for those of (α3, α4), Figure 15 (b).
    ax
        Plane axes, which lose their frame; by default those of a new figure.
    """
    if of not in ("angle", "pair"):
        raise InputError(f"of: {shown(of)}; allowed are 'angle' and 'pair'")
    ax = axes_or_new(ax, size=(85, 75))
    # A type of one angle is judged beside a ? of the other, which forbids nothing.
    names = {label: label for label in PLANE_TYPES} if of == "pair" else {t: f"({t},?)" for t in "+?-"}
    places = _RULE_PLACES if of == "pair" else {"+": (-1.0, 0.0), "?": (0.0, 0.0), "-": (1.0, 0.0)}
    labels = list(places)
    for k, first in enumerate(labels):
        for second in labels[k + 1 :]:
            if types_may_be_adjacent(names[first], names[second]):
                line = np.array([places[first], places[second]])
                ax.plot(*line.T, color="0.35", linewidth=1.2, zorder=1, gid=f"{first} {second}")
    for label, place in places.items():
        color = {"(+,+)": RED, "+": RED, "(-,-)": BLUE, "-": BLUE}.get(label, "0.35")
        shape = "square,pad=0.5" if color == RED else "round,pad=0.5,rounding_size=0.6"
        face, ink = ("white", "black") if color == "0.35" else (color, "white")
        box = {"boxstyle": shape, "edgecolor": color, "facecolor": face, "linewidth": 1.0}
        ax.text(*place, label.replace("-", "−"), color=ink, bbox=box, ha="center", va="center", zorder=3)
    ax.set_axis_off()
    ax.set_aspect("equal")
    ax.set(xlim=(-1.45, 1.45), ylim=(-1.35, 1.35))
    return ax


_RULE_PLACES = {
    label: (math.cos(math.radians(at)), math.sin(math.radians(at)))
    for label, at in {"(+,+)": 180, "(+,?)": 120, "(?,-)": 60, "(-,-)": 0, "(-,?)": 300, "(?,+)": 240}.items()
}


def type_map(
    sign: Sign = "negative",
    *,
    coefficients: Coefficients | None = None,
    divisions: int = DEFAULT_DIVISIONS,
    labels: bool = True,
    ax: Axes | None = None,
) -> Axes:
    """Draw which types of roots with one sign of R each interior node has (Figure 16).

    A red square is (+,+), a blue disc (−,−), a mark half of each both; other types are written. A root that has no sign
    of R is grey and hollow, and its type is written in grey; a dot is a node without any of these.

    Parameters
    ----------
    sign
        "positive" or "negative", the sign of R.
    coefficients
        Those of formula (1); by default the paper's published ones.
    divisions
        Pieces n into which [−π/2, π/2] is cut.
    labels
        Write the types with a ? in; otherwise they are painted as their sheet, smaller marks all, for small axes.
    ax
        Plane axes, 170 mm wide for 16 divisions with labels; by default those of a new figure. Each kind of node is one
        scatter; a written type has the node's (i, j) as its ``gid``.
    """
    wanted = checked_sign(sign)
    coefficients = coefficients or coefficients_of()
    found = interior_roots(coefficients, divisions=divisions)
    ax = axes_or_new(ax, size=(170, 176))
    painted: dict[tuple[str, str], list[FloatArray]] = {}
    starts = np.flatnonzero(found.number == 0).tolist()
    for start, stop in zip(starts, [*starts[1:], len(found.R)], strict=True):
        rows = [k for k in range(start, stop) if found.sign[k] in (wanted, 0)]
        place = found.alpha[start, :2]
        if labels and any("?" in found.types[k] for k in rows):
            _write_types(ax, place, rows, found)
        else:
            red, blue = (_state(found, rows, sheet, wanted) for sheet in (1, -1))
            painted.setdefault((red, blue), []).append(place)
    size = 42.0 if labels else 5.0
    for state in sorted(painted, reverse=True):
        _paint_nodes(ax, np.array(painted[state]), state, size, "R > 0" if wanted > 0 else "R < 0")
    plane_axes(ax, r"\alpha_1", r"\alpha_2", divisor=8 if labels else 4)
    if labels:
        legend_above(ax, columns=3)
    return ax


def _state(found: InteriorRoots, rows: Sequence[int], sheet: int, wanted: int) -> str:
    """Return "yes" if a node has a root of the sheet with the wanted sign of R, "singular" if without sign, or "no"."""
    signs = {int(found.sign[k]) for k in rows if found.sheet[k] == sheet}
    return "yes" if wanted in signs else "singular" if 0 in signs else "no"


def _write_types(ax: Axes, place: FloatArray, rows: Sequence[int], found: InteriorRoots) -> None:
    """Write the types of a node's roots, red ones above, a line each; a type on more than one root once."""
    node = ",".join(map(str, found.node[rows[0]]))
    lines = sorted({(-int(found.sheet[k]), found.types[k], int(found.sign[k]) == 0) for k in rows})
    for number, (sheet, kind, singular) in enumerate(lines):
        color = GREY if singular else RED if sheet < 0 else BLUE
        drop = (len(lines) - 1) / 2 - number
        ax.annotate(
            kind.replace("-", "−"), (place[0], place[1]), xytext=(0, 7.0 * drop), textcoords="offset points",
            color=color, fontsize=6.0, ha="center", va="center", gid=node, annotation_clip=False,
        )  # fmt: skip


def _paint_nodes(ax: Axes, places: FloatArray, state: tuple[str, str], size: float, sign: str) -> None:
    """Scatter the nodes of one kind, given by what there is on the red and on the blue sheet."""
    told = {"yes": sign, "singular": "R = 0"}
    types = [
        (kind, told[is_there]) for kind, is_there in zip(("(+,+)", "(−,−)"), state, strict=True) if is_there != "no"
    ]
    label = ", ".join(f"{kind}: ${compared}$" for kind, compared in types) or f"no root with ${sign}$"
    if len(types) == 2 and types[0][1] == types[1][1]:
        label = f"(+,+) and (−,−): ${types[0][1]}$"
    look: dict[str, Any] = {"linewidth": 0.6, "label": label, "gid": " ".join(state), "zorder": 3}
    x, y = places.T
    if not types:
        ax.scatter(x, y, s=size / 12, marker="o", facecolor=GREY, **(look | {"linewidth": 0.0}))
    markers: tuple[Any, Any] = half_markers() if len(types) == 2 else (MARKER_OF["red"], MARKER_OF["blue"])
    for color, is_there, marker in zip(COLORS, state, markers, strict=True):
        if is_there != "no":
            face, edge = (COLOR_OF[color],) * 2 if is_there == "yes" else ("white", GREY)
            ax.scatter(x, y, s=size, marker=marker, facecolor=face, edgecolor=edge, **look)


def gait_loop(
    gait: Gait,
    *,
    angles: tuple[int, int] = (1, 2),
    label: str | None = None,
    width: float = 1.6,
    band: bool = False,
    ax: Axes | None = None,
) -> Axes:
    """Draw the projection of a gait on the plane of two of its angles, with an arrow in its direction (Figure 17).

    Red segments are solid, blue ones dashed, those of a gait off the surfaces black and dotted.

    Parameters
    ----------
    gait
        The closed polyline. A gait that is a point is a mark.
    angles
        Which two, 1 to 4; (α1, α2) by default.
    label
        For a legend.
    width
        Of the line, in points.
    band
        Draw a pale solid band below all marks instead, for a map with labels.
    ax
        Plane axes, such as those of :func:`type_map`; by default those of a new figure.
    """
    if sorted(angles) != sorted(set(angles) & {1, 2, 3, 4}) or len(angles) != 2:
        raise InputError(f"angles: {shown(angles)}; allowed are two different ones of 1 to 4")
    fresh = ax is None
    ax = axes_or_new(ax)
    columns = [angles[0] - 1, angles[1] - 1]
    starts, ends = gait.alpha[:, columns], gait.ends[:, columns]
    colors = gait.colors or ("none",) * len(starts)
    if len(starts) == 1:
        look = _line_look(colors[0], band=band)
        ax.plot(*starts[0], marker=MARKER_OF.get(colors[0], "D"), color=look["color"], linestyle="none", label=label)
    closed = len(set(colors)) == 1
    breaks = [k for k in range(len(colors)) if k == 0 or colors[k] != colors[k - 1]]
    for k, stop in zip(breaks, [*breaks[1:], len(colors)], strict=True):
        # The second point again, where all is one line, so that its first corner is joined too.
        points = np.concatenate([starts[k:stop], ends[stop - 1 : stop], ends[: int(closed)]])
        ax.plot(*points.T, linewidth=width, label=label if k == 0 else None, **_line_look(colors[k], band=band))
    lengths = np.linalg.norm(ends - starts, axis=1)
    if lengths.max() > 0:
        # On the first of the long segments, off its middle, where a grid node may be.
        longest = int(np.argmax(lengths > 0.75 * lengths.max()))
        step = (ends - starts)[longest]
        tail, color = starts[longest] + 0.36 * step, _line_look(colors[longest], band=False)["color"]
        draw_arrow(ax, tail, tail + 0.03 * step, color, width=0.0, size=14 if band else 10)
    if fresh:
        plane_axes(ax, rf"\alpha_{angles[0]}", rf"\alpha_{angles[1]}")
    return ax


def _line_look(color: str, *, band: bool) -> dict[str, Any]:
    """Return how a gait's segments of a color are drawn; "none" is off the surfaces; fibres are black."""
    if band:
        pale = {"red": "#fcd4cd", "blue": "#9fb3e8", "none": "0.8"}
        return {
            "color": pale.get(color, "0.8"),
            "linestyle": "-",
            "solid_joinstyle": "round",
            "solid_capstyle": "butt",
            "zorder": 1.2,
        }
    dash: dict[str, Any] = {"red": "-", "blue": (0, (3, 1.2)), "none": (0, (1, 1))}
    return {"color": COLOR_OF.get(color, "black"), "linestyle": dash.get(color, "-"), "zorder": 4}
