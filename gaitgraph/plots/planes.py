"""The (α1, α2) plane: roots over it, their types, and exact regions (Figures 2 to 16)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import HALF_PI
from gaitgraph.errors import InputError, shown
from gaitgraph.graph.build import DEFAULT_DIVISIONS, checked_divisions, grid_axis
from gaitgraph.invertibility.matrices import (
    Coefficients,
    coefficients_of,
    hover_thrust_shares,
    least_singular_value_on_red,
    level_determinant,
    noise_of,
)
from gaitgraph.plots.axes import (
    BLUE,
    COLOR_OF,
    GREY,
    MARKER_OF,
    RED,
    SINGULAR,
    angle_axis,
    axes_or_new,
    draw_label,
    half_markers,
    legend_above,
    legend_below,
    plane_axes,
    space_axes,
)
from gaitgraph.surface.adjacency import PLANE_TYPES, text_from_types, types_may_be_adjacent
from gaitgraph.surface.sheets import COLORS, Sign, red_label, root_arrays
from gaitgraph.vehicle import PAPER, Vehicle

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes

FloatArray = npt.NDArray[np.float64]
Which = Literal["first", "other", "both"]

FINE = 201
"""Points along each axis of a contoured region; curves and borders themselves are drawn in closed form."""
_SHEET = {"red": 1, "blue": -1}
_TIE = 12  # decimals [rad] to which α3 of two roots is compared
_POSITIVE, _NEGATIVE = "#fff1b8", "#dcdce6"  # where R > 0 and R < 0, in no color of a sheet


@dataclass(frozen=True, slots=True, kw_only=True)
class InteriorRoots:
    """The roots at the interior nodes of a grid, one row each, node by node, ordered by α3, then α4.

    Parameters
    ----------
    node
        Grid indices (i, j) of α1 = −π/2 + iπ/n and α2 = −π/2 + jπ/n, shape (m, 2).
    number
        0 for a node's first root, then 1 and so on, shape (m,).
    alpha
        Tilt angles, shape (m, 4) [rad].
    sheet
        +1 red, −1 blue, shape (m,).
    types
        Labels such as ``(+,?)``, length m.
    R
        Equation (6), shape (m,).
    sign
        +1 or −1, and 0 where R is zero to rounding, as on all of the blue sheet with exact coefficients; shape (m,).
    """

    node: npt.NDArray[np.int64]
    number: npt.NDArray[np.int64]
    alpha: FloatArray
    sheet: npt.NDArray[np.int8]
    types: tuple[str, ...]
    R: FloatArray
    sign: npt.NDArray[np.int8]

    def chosen(self, which: Which) -> npt.NDArray[np.bool_]:
        """Return which rows are a node's first root, a further one, or either, shape (m,)."""
        if which not in ("first", "other", "both"):
            raise InputError(f"which must be 'first', 'other' or 'both', got {shown(which)}")
        chosen: npt.NDArray[np.bool_] = self.number == 0 if which == "first" else self.number > 0
        return np.ones_like(chosen) if which == "both" else chosen


def interior_roots(coefficients: Coefficients | None = None, *, divisions: int = DEFAULT_DIVISIONS) -> InteriorRoots:
    """Return every root at the interior nodes of the grid, as the paper lists them for Figures 3 to 14.

    Parameters
    ----------
    coefficients
        Those of formula (1); by default the paper's published ones, whose plain sign of R counts.
    divisions
        Pieces n into which [−π/2, π/2] is cut.

    Examples
    --------
    >>> found = interior_roots()
    >>> len(found.R), int((found.sign > 0).sum()), round(float(found.alpha[0, 2]), 4), found.types[0]
    (450, 156, -1.4329, '(?,-)')
    """
    coefficients = coefficients or coefficients_of()
    axis = grid_axis(checked_divisions(divisions))[1:-1]
    a1, a2 = np.meshgrid(axis, axis, indexing="ij")
    found = root_arrays(a1, a2, coefficients, crossing_tolerance=math.pi / (2 * divisions))
    i, j, k = np.nonzero(found.sheet)
    alpha, sheet, value = found.alpha[i, j, k], found.sheet[i, j, k], found.R[i, j, k]
    order = np.lexsort((np.round(alpha[:, 3], _TIE), np.round(alpha[:, 2], _TIE), j, i))
    cell = (i * len(axis) + j)[order]
    first = np.concatenate([[True], cell[1:] != cell[:-1]])
    number = np.arange(len(cell)) - np.maximum.accumulate(np.where(first, np.arange(len(cell)), 0))
    sign = np.where(np.abs(value) > noise_of(coefficients), np.sign(value), 0.0)
    if coefficients.kind == "exact":
        sign = np.where(sheet < 0, 0.0, sign)  # R = 0 there: floating-point noise is not a sign
    return InteriorRoots(
        node=np.column_stack([i, j])[order] + 1,
        number=number,
        alpha=alpha[order],
        sheet=sheet[order],
        types=tuple(text_from_types(*pair) for pair in found.types[i, j, k][order].tolist()),
        R=value[order],
        sign=sign[order].astype(np.int8),
    )


def _checked_sign(sign: Any) -> int:
    """Return +1 for "positive" and −1 for "negative", or raise InputError."""
    if sign not in ("positive", "negative"):
        raise InputError(f"sign must be 'positive' or 'negative', got {shown(sign)}")
    return 1 if sign == "positive" else -1


def root_counts(
    coefficients: Coefficients | None = None, *, divisions: int = DEFAULT_DIVISIONS, ax: Axes | None = None
) -> Axes:
    """Draw how many roots each node of the grid has (Figure 2): two inside, three on a side, five in a corner.

    Parameters
    ----------
    coefficients, divisions
        As for :func:`interior_roots`.
    ax
        Plane axes; by default those of a new figure. Each count is one scatter.
    """
    coefficients = coefficients or coefficients_of()
    axis = grid_axis(checked_divisions(divisions))
    ax = axes_or_new(ax)
    a1, a2 = np.meshgrid(axis, axis, indexing="ij")
    count = root_arrays(a1, a2, coefficients).count
    # Markers that differ in shape and darkness, in no color of a sheet.
    looks = {2: ("o", "white"), 3: ("s", "0.6"), 4: ("D", "0.35"), 5: ("^", "black")}
    for number in np.unique(count).tolist():
        here = count == number
        marker, face = looks[number]
        label = f"{number} roots, {int(here.sum())} nodes"
        ax.scatter(
            a1[here], a2[here], s=16, marker=marker, facecolor=face, edgecolor="black", linewidth=0.6, label=label,
            clip_on=False, zorder=3,
        )  # fmt: skip
    plane_axes(ax, r"\alpha_1", r"\alpha_2")
    legend_above(ax, columns=2)
    return ax


def root_angle(
    angle: Literal["alpha3", "alpha4"],
    *,
    which: Which = "both",
    coefficients: Coefficients | None = None,
    divisions: int = DEFAULT_DIVISIONS,
    ax: Any = None,
) -> Any:
    """Draw α3 or α4 over the interior nodes, for one root, the other, or both (Figures 3 to 8).

    Red squares are on the + plane, blue discs on the − plane: both show that two planes are all there is.

    Parameters
    ----------
    angle
        "alpha3" or "alpha4".
    which
        "first" is each node's root with the smaller α3 (then α4), "other" any further one.
    coefficients, divisions
        As for :func:`interior_roots`.
    ax
        Three-dimensional axes; by default those of a new figure.
    """
    if angle not in ("alpha3", "alpha4"):
        raise InputError(f"angle must be 'alpha3' or 'alpha4', got {shown(angle)}")
    found = interior_roots(coefficients, divisions=divisions)
    chosen = found.chosen(which)
    ax = axes_or_new(ax, size=(85, 74), in_space=True)
    for color, label in (("red", "+ plane"), ("blue", "− plane")):
        points = found.alpha[chosen & (found.sheet == _SHEET[color])]
        _scatter(ax, points[:, [0, 1, int(angle[-1]) - 1]], COLOR_OF[color], MARKER_OF[color], label)
    angle_axis(ax.zaxis, rf"\alpha_{angle[-1]}")
    return space_axes(ax)


def signed_roots(
    sign: Sign,
    *,
    which: Which = "both",
    coefficients: Coefficients | None = None,
    divisions: int = DEFAULT_DIVISIONS,
    ax: Any = None,
) -> Any:
    """Draw α3 and α4 of the roots with one sign of R over the interior nodes (Figures 9, 11, 13 and 14).

    As in the paper, and here alone, red squares are α3, blue discs α4. Roots without a sign of R are grey and hollow.

    Parameters
    ----------
    sign
        "positive" or "negative", the sign of R.
    which, coefficients, divisions, ax
        As for :func:`root_angle`.
    """
    wanted = _checked_sign(sign)
    found = interior_roots(coefficients, divisions=divisions)
    chosen = found.chosen(which)
    ax = axes_or_new(ax, size=(85, 74), in_space=True)
    grey, signed = found.alpha[chosen & (found.sign == 0)], found.alpha[chosen & (found.sign == wanted)]
    _scatter(ax, grey[:, :3], GREY, "s", SINGULAR)
    _scatter(ax, grey[:, [0, 1, 3]], GREY, "o", "_")
    for column, color, marker in ((2, RED, "s"), (3, BLUE, "o")):
        label = rf"$\alpha_{column + 1}$, $R {'>' if wanted > 0 else '<'} 0$"
        _scatter(ax, signed[:, [0, 1, column]], color, marker, label)
    angle_axis(ax.zaxis, r"\alpha_3,\ \alpha_4")
    return space_axes(ax, columns=2 if len(grey) else 3)


def level_determinants(
    sign: Sign,
    *,
    which: Which = "both",
    coefficients: Coefficients | None = None,
    divisions: int = DEFAULT_DIVISIONS,
    ax: Any = None,
) -> Any:
    """Draw the value of R of the roots with one sign of it over the interior nodes (Figures 10 and 12).

    Red squares are on the red sheet, blue discs on the blue one; roots without a sign of R are grey and hollow.

    Parameters
    ----------
    sign, which, coefficients, divisions, ax
        As for :func:`signed_roots`.
    """
    wanted = _checked_sign(sign)
    found = interior_roots(coefficients, divisions=divisions)
    chosen = found.chosen(which)
    ax = axes_or_new(ax, size=(85, 74), in_space=True)
    points = np.column_stack([found.alpha[:, :2], found.R])
    _scatter(ax, points[chosen & (found.sign == 0)], GREY, MARKER_OF["blue"], SINGULAR)
    signed = chosen & (found.sign == wanted)
    # Stems, one line with gaps, show which node a value belongs to.
    tops = points[signed]
    stems = np.stack([tops * [1.0, 1.0, 0.0], tops, np.full(tops.shape, np.nan)], axis=1).reshape(-1, 3)
    ax.plot(*stems.T, color="0.75", linewidth=0.4)
    for color in COLORS:
        here = points[signed & (found.sheet == _SHEET[color])]
        _scatter(ax, here, COLOR_OF[color], MARKER_OF[color], f"{color} sheet")
    ax.set_zlabel("$R$ (dimensionless)")
    return space_axes(ax)


def _scatter(ax: Any, points: FloatArray, color: str, marker: str, label: str) -> None:
    """Scatter points of shape (m, 3), without fading those farther away: red and blue stay what they are."""
    if len(points):
        grey = color == GREY
        look = {"facecolor": "none" if grey else color, "edgecolor": color if grey else "white"}
        width = 0.6 if grey else 0.25
        ax.scatter(*points.T, s=11, marker=marker, linewidth=width, depthshade=False, label=label, **look)


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
    places = {"+": (-1.0, 0.0), "?": (0.0, 0.0), "-": (1.0, 0.0)}
    if of == "pair":
        degrees = {"(+,+)": 180, "(+,?)": 120, "(?,-)": 60, "(-,-)": 0, "(-,?)": 300, "(?,+)": 240}
        places = {kind: (math.cos(math.radians(at)), math.sin(math.radians(at))) for kind, at in degrees.items()}
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
    wanted = _checked_sign(sign)
    coefficients = coefficients or coefficients_of()
    found = interior_roots(coefficients, divisions=divisions)
    ax = axes_or_new(ax, size=(170, 176))
    marked: dict[tuple[str, ...], list[FloatArray]] = {}
    starts = np.flatnonzero(found.number == 0).tolist()
    for start, stop in zip(starts, [*starts[1:], len(found.R)], strict=True):
        rows = [k for k in range(start, stop) if found.sign[k] in (wanted, 0)]
        place = found.alpha[start, :2]
        if labels and any("?" in found.types[k] for k in rows):
            _write_types(ax, place, rows, found)
        else:
            signs = [{int(found.sign[k]) for k in rows if found.sheet[k] == sheet} for sheet in (1, -1)]
            state = tuple("yes" if wanted in one else "singular" if 0 in one else "no" for one in signs)
            marked.setdefault(state, []).append(place)
    size = 42.0 if labels else 5.0
    for state in sorted(marked, reverse=True):
        _mark_nodes(ax, np.array(marked[state]), state, size, "R > 0" if wanted > 0 else "R < 0")
    plane_axes(ax, r"\alpha_1", r"\alpha_2", divisor=8 if labels else 4)
    if labels:
        legend_above(ax, columns=3)
    return ax


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


def _mark_nodes(ax: Axes, places: FloatArray, state: tuple[str, ...], size: float, sign: str) -> None:
    """Scatter nodes by what their root on the red and on the blue sheet has: the sign, no sign, or there is none."""
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
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

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
    ax.axvline(delta, color="0.25", linewidth=0.8, linestyle=(0, (4, 2)))
    ax.axhline(-delta, color="0.25", linewidth=0.8, linestyle=(0, (4, 2)))
    _draw_zeros_of_R(ax, vehicle)
    ax.plot(0, 0, marker="+", markersize=7, color="black", linestyle="none", zorder=6)
    mirror = math.copysign(1.0, delta)
    for x, y in ((-1.05, -0.62), (1.08, 0.3)):  # within the two large components, off the hatched parts
        at = (mirror * x, mirror * y)
        draw_label(ax, at, "$R>0$" if red_label(*at, vehicle).prod() > 0 else "$R<0$")
    plane_axes(ax, r"\alpha_1", r"\alpha_2", grid=False)
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
