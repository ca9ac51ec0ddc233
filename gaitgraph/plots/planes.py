"""The (α1, α2) plane: adjacency rule, map of plane types and loops on it (Figures 15 to 17); exact regions."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import HALF_PI
from gaitgraph.errors import InputError, shown
from gaitgraph.graph.build import DEFAULT_DIVISIONS
from gaitgraph.invertibility.matrices import (
    Coefficients,
    coefficients_of,
    hover_thrust_shares,
    least_singular_value_on_red,
    level_determinant,
)
from gaitgraph.plots.axes import (
    BLUE,
    COLOR_OF,
    GREY,
    MARKER_OF,
    RED,
    axes_or_new,
    draw_arrow,
    draw_label,
    half_markers,
    legend_above,
    legend_below,
    plane_axes,
)
from gaitgraph.plots.root_maps import InteriorRoots, checked_sign, interior_roots
from gaitgraph.surface.adjacency import PLANE_TYPES, types_may_be_adjacent
from gaitgraph.surface.sheets import COLORS, Sign, red_label
from gaitgraph.vehicle import PAPER, Vehicle

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes

    from gaitgraph.gait.gait import Gait

FloatArray = npt.NDArray[np.float64]

FINE = 201
"""Points along each axis of a contoured region; curves and borders themselves are drawn in closed form."""
_POSITIVE, _NEGATIVE = "#fff1b8", "#dcdce6"  # where R > 0 and R < 0, in no color of a sheet


def adjacency_rule(of: Literal["angle", "pair"] = "pair", *, ax: Axes | None = None) -> Axes:
    """Draw the Two Color rule as a graph: the types that are lined may be neighbours (Figure 15).

    Each type may also be its own neighbour. As in the paper (?,?), a neighbour of every type, is left out. The lines
    follow :func:`gaitgraph.surface.adjacency.types_may_be_adjacent`; each has the two types as its ``gid``.

    Parameters
    ----------
    of
        "angle" for the types of α3 or α4 alone, Figure 15 (a); "pair" for those of (α3, α4), Figure 15 (b).
    ax
        Plane axes, which lose their frame; by default those of a new figure.
    """
    if of not in ("angle", "pair"):
        raise InputError(f"of must be 'angle' or 'pair', got {shown(of)}")
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
        Write the types with a ? in; otherwise they are marked as their sheet, all marks smaller, for small axes.
    ax
        Plane axes, 170 mm wide for 16 divisions with labels; by default those of a new figure. Each kind of node is one
        scatter; a written type has the node's (i, j) as its ``gid``.
    """
    wanted = checked_sign(sign)
    coefficients = coefficients or coefficients_of()
    found = interior_roots(coefficients, divisions=divisions)
    ax = axes_or_new(ax, size=(170, 176))
    marked: dict[tuple[str, str], list[FloatArray]] = {}
    starts = np.flatnonzero(found.number == 0).tolist()
    for start, stop in zip(starts, [*starts[1:], len(found.R)], strict=True):
        rows = [k for k in range(start, stop) if found.sign[k] in (wanted, 0)]
        place = found.alpha[start, :2]
        if labels and any("?" in found.types[k] for k in rows):
            _write_types(ax, place, rows, found)
        else:
            red, blue = (_state(found, rows, sheet, wanted) for sheet in (1, -1))
            marked.setdefault((red, blue), []).append(place)
    size = 42.0 if labels else 5.0
    for state in sorted(marked, reverse=True):
        _mark_nodes(ax, np.array(marked[state]), state, size, "R > 0" if wanted > 0 else "R < 0")
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


def _mark_nodes(ax: Axes, places: FloatArray, state: tuple[str, str], size: float, sign: str) -> None:
    """Scatter the nodes of one kind, given by what there is on the red and on the blue sheet."""
    words = {"yes": sign, "singular": "R = 0"}
    types = [(kind, words[one]) for kind, one in zip(("(+,+)", "(−,−)"), state, strict=True) if one != "no"]
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
        raise InputError(f"angles must be two different ones of 1 to 4, got {shown(angles)}")
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


def regions_map(vehicle: Vehicle = PAPER, *, ax: Axes | None = None) -> Axes:
    """Draw the exact regions of the (α1, α2) plane on the red sheet: signs of R, hover, and the thrust it takes.

    R = 0 on the lines α1 = δ ∓ π/2 and α2 = ±π/2 − δ and on the curve tan α1 − tan α2 = 2κ. Hover with every thrust
    positive, hatched, takes α1 < δ and α2 > −δ, or both reversed. Contours are the largest thrust of a rotor there, in
    units of the weight.

    Parameters
    ----------
    vehicle
        The physics is exact, whatever coefficients a gait is planned with.
    ax
        Plane axes; by default those of a new figure. Each curve has its equation as its ``gid``.
    """
    ax = axes_or_new(ax, size=(85, 96))
    axis = np.linspace(-HALF_PI, HALF_PI, FINE)
    a1, a2 = np.meshgrid(axis, axis, indexing="ij")
    value = level_determinant(np.stack([a1, a2, a1, a2], axis=-1), coefficients_of(vehicle, "exact"))
    ax.contourf(a1, a2, value, levels=[value.min() - 1, 0.0, value.max() + 1], colors=[_NEGATIVE, _POSITIVE])
    delta = math.atan(vehicle.signed_drag_ratio)
    low, high = -HALF_PI, HALF_PI
    for first, second in (((low, delta), (-delta, high)), ((delta, high), (low, -delta))):
        corners = np.array([[first[k], second[m]] for k, m in ((0, 0), (1, 0), (1, 1), (0, 1))])
        ax.fill(*corners.T, facecolor="none", edgecolor="0.6", hatch="///", linewidth=0.0, gid="hover")
        _contour_thrust(ax, first, second, vehicle)
    for line in (ax.axvline, ax.axhline):
        line(delta if line == ax.axvline else -delta, color="0.25", linewidth=0.8, linestyle=(0, (4, 2)))
    _draw_zeros_of_R(ax, vehicle)
    ax.plot(0, 0, marker="+", markersize=7, color="black", linestyle="none", zorder=6)
    _name_regions(ax, vehicle)
    plane_axes(ax, r"\alpha_1", r"\alpha_2", grid=False)
    _legend_of_regions(ax)
    return ax


def _contour_thrust(ax: Axes, first: tuple[float, float], second: tuple[float, float], vehicle: Vehicle) -> None:
    """Draw contours of the largest hover thrust within one rectangle of the (α1, α2) plane."""
    inside = np.linspace(0.0, 1.0, FINE // 2)[1:-1]
    inside = inside**2 * (3 - 2 * inside)  # denser at the ends: all contours meet in one corner
    a1, a2 = (low + (high - low) * inside for low, high in (first, second))
    b1, b2 = np.meshgrid(a1, a2, indexing="ij")
    largest = hover_thrust_shares(np.stack([b1, b2, b1, b2], axis=-1), vehicle).max(axis=-1)
    levels = [0.3, 0.4, 0.6]
    ax.contour(b1, b2, largest, levels=levels, colors="black", linewidths=0.7)
    # Where all four thrusts are equal, 1/(4·cos α1) of the weight, each contour has a corner: space for its label.
    side = 1.0 if first[0] > -HALF_PI else -1.0
    for level in levels:
        at = side * math.acos(0.25 / level)
        ground = _POSITIVE if red_label(at, -at, vehicle).prod() > 0 else _NEGATIVE
        box = {"facecolor": ground, "edgecolor": "none", "pad": 0.6}
        ax.text(at, -at, f"{level:.1f}", fontsize=6.0, ha="center", va="center", bbox=box, zorder=5)


def _draw_zeros_of_R(ax: Axes, vehicle: Vehicle) -> None:
    """Draw where R = 0 on the red sheet, in closed form."""
    kappa = vehicle.signed_drag_ratio
    delta = math.atan(kappa)
    look: dict[str, Any] = {"color": "black", "linewidth": 1.4, "zorder": 4}
    end = np.linspace(-HALF_PI, HALF_PI, 2)
    for edge in (delta - HALF_PI, delta + HALF_PI):
        if abs(edge) <= HALF_PI:
            ax.plot(np.full(2, edge), end, **look, gid="cos(alpha1 - delta) = 0")
            ax.plot(end, np.full(2, -edge), **look, gid="cos(alpha2 + delta) = 0")
    a1 = np.linspace(-HALF_PI, HALF_PI, FINE)
    # The same curve as tan α1 − tan α2 = 2κ, without infinite tangents.
    a2 = np.arctan2(np.sin(a1) - 2 * kappa * np.cos(a1), np.cos(a1))
    ax.plot(a1, a2, **look, gid="tan(alpha1) - tan(alpha2) = 2 kappa")


def _name_regions(ax: Axes, vehicle: Vehicle) -> None:
    """Write the sign of R into the two large components, off the hatched parts."""
    mirror = math.copysign(1.0, vehicle.signed_drag_ratio)
    for place in ((-1.05, -0.62), (1.08, 0.3)):
        at = (mirror * place[0], mirror * place[1])
        draw_label(ax, at, "$R>0$" if red_label(*at, vehicle).prod() > 0 else "$R<0$")


def _legend_of_regions(ax: Axes) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Any] = [
        Patch(facecolor=_POSITIVE, edgecolor="0.5", linewidth=0.5, label="$R>0$"),
        Patch(facecolor=_NEGATIVE, edgecolor="0.5", linewidth=0.5, label="$R<0$"),
        Line2D([], [], color="black", linewidth=1.4, label="$R=0$"),
        Patch(facecolor="white", edgecolor="0.6", hatch="///", linewidth=0.0, label="hover, thrusts > 0"),
        Line2D([], [], color="black", linewidth=0.7, label="largest thrust / weight"),
        Line2D([], [], color="0.25", linewidth=0.8, linestyle=(0, (4, 2)), label="a pair of rotors idles"),
        Line2D([], [], color="black", marker="+", linestyle="none", label="all upright"),
    ]
    legend_below(ax, handles=handles, ncols=2)


def singular_value_map(vehicle: Vehicle = PAPER, *, ax: Axes | None = None) -> Axes:
    """Draw contours of the least singular value on the red sheet, level, exact physics: how well it can be inverted.

    Parameters
    ----------
    vehicle
        The vehicle.
    ax
        Plane axes; by default those of a new figure. A color bar is drawn beside them.
    """
    ax = axes_or_new(ax, size=(95, 85))
    axis = np.linspace(-HALF_PI, HALF_PI, FINE)
    a1, a2 = np.meshgrid(axis, axis, indexing="ij")
    value = least_singular_value_on_red(a1, a2, vehicle)
    levels = 0.1 * np.arange(math.ceil(10 * float(value.max())) + 1)
    filled = ax.contourf(a1, a2, value, levels=levels, cmap="cividis")
    ink = ["white" if level < 0.65 else "black" for level in levels[2::2]]
    lines = ax.contour(a1, a2, value, levels=levels[2::2], colors=ink, linewidths=0.5)
    ax.clabel(lines, levels[4::2], fmt="%.1f", fontsize=6.0)  # the lowest runs along the border
    _draw_zeros_of_R(ax, vehicle)
    ax.plot(0, 0, marker="+", markersize=7, color="white", linestyle="none", zorder=6)
    plane_axes(ax, r"\alpha_1", r"\alpha_2", grid=False)
    bar = ax.figure.colorbar(filled, cax=ax.inset_axes((1.05, 0.0, 0.06, 1.0)))
    bar.set_label("least singular value (dimensionless)")
    return ax
