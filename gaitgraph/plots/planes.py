"""The (α1, α2) plane: roots over it, their types, and exact regions (Figures 2 to 16)."""

from __future__ import annotations

import math
from itertools import combinations, product
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import HALF_PI, wrapped
from gaitgraph.errors import checked_choice
from gaitgraph.graph.nodes import DEFAULT_DIVISIONS, grid_axis
from gaitgraph.invertibility import matrices
from gaitgraph.invertibility.coefficients import (
    Coefficients,
    CoefficientsLike,
    coefficients_of,
)
from gaitgraph.invertibility.error_margins import servo_margins_found
from gaitgraph.plots import axes as base
from gaitgraph.surface import sheets
from gaitgraph.surface.blocks import directions, roll_block, yaw_block
from gaitgraph.tolerances import DEFAULT_FLOOR
from gaitgraph.vehicle import PAPER, Vehicle, VehicleLike, vehicle_named

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes

    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.surface.blocks import Block
    from gaitgraph.surface.sheets import Color, Sign

    Marks = tuple[FloatArray, str, str, str]  # points, color, marker, label

IntArray = npt.NDArray[np.integer[Any]]
Which = Literal["first", "other", "both"]

_MARGINS = 65  # points along each axis of a map of servo margins
FINE = 201  # points along each axis of a contour plot; curves and borders are in closed form
_FINE_AXIS = np.linspace(-HALF_PI, HALF_PI, FINE)
_SHEET = {"red": 1, "blue": -1}
_SIGN = {"positive": 1, "negative": -1}
_SINGULAR = "R = 0 to rounding: singular"
_ELEVATION, _AZIMUTH = 16, -125  # of the viewer of a space [°]
_LAYERS = 12  # of marks in space, from far to near
_TIE = 12  # decimals [rad] to which α3 of two roots is compared
_ROUNDED_BOX = "round,pad=0.5,rounding_size=0.6"


class Roots(NamedTuple):
    """Roots of the 15² interior nodes of the grid, shape (k, ...), by node, and then by α3 and α4.

    Node (i, j) of α1 = −π/2 + iπ/16 and α2 = −π/2 + jπ/16 is 15(i − 1) + j − 1. `sheet` is +1 red and −1 blue. `sign` is
    that of R, and 0 where R is zero to rounding: on all of the blue sheet with exact coefficients.
    """

    node: IntArray
    alpha: FloatArray
    sheet: IntArray
    types: IntArray
    R: FloatArray
    sign: IntArray


def interior_roots(coefficients: Coefficients, which: Which = "both") -> Roots:
    """Return the roots of all interior nodes: the "first" of each, the "other" ones, or "both"."""
    axis = grid_axis(DEFAULT_DIVISIONS)[1:-1]
    a1, a2 = np.meshgrid(axis, axis, indexing="ij")
    tolerance = math.pi / (2 * DEFAULT_DIVISIONS)
    arrays = sheets.root_arrays(
        a1.ravel(), a2.ravel(), coefficients=coefficients, crossing_tolerance=tolerance
    )
    nodes, most = arrays.sheet.shape
    node = np.repeat(np.arange(nodes), most)
    alpha, R = arrays.alpha.reshape(-1, 4), arrays.R.ravel()
    sheet, types = arrays.sheet.ravel(), arrays.types.reshape(-1, 2)
    # What is no root is NaN, and comes last of its node.
    order = np.lexsort((np.round(alpha[:, 3], _TIE), np.round(alpha[:, 2], _TIE), node))
    number = np.tile(np.arange(most), nodes)
    if which == "first":
        order = order[number == 0]
    elif which == "other":
        order = order[number > 0]
    rows = order[sheet[order] != 0]
    is_zero = np.abs(R) <= matrices.noise_of(coefficients)
    if coefficients.kind == "exact":
        is_zero |= sheet < 0  # floating-point noise is not a sign
    sign = np.where(is_zero, 0.0, np.sign(R))[rows].astype(int)
    return Roots(node[rows], alpha[rows], sheet[rows], types[rows], R[rows], sign)


def root_counts(ax: Axes, coefficients: Coefficients) -> None:
    """Draw how many roots each node of the grid has (Figure 2), with one scatter for each count."""
    axis = grid_axis(DEFAULT_DIVISIONS)
    a1, a2 = np.meshgrid(axis, axis, indexing="ij")
    count = sheets.root_arrays(a1, a2, coefficients=coefficients).count
    looks = {
        1: (".", "black"),
        2: ("o", "white"),
        3: ("s", "0.6"),
        4: ("D", "0.35"),
        5: ("^", "black"),
    }
    for number in np.unique(count).tolist():
        here, (marker, face) = count == number, looks[number]
        look: dict[str, Any] = {
            "s": 16,
            "marker": marker,
            "facecolor": face,
            "edgecolor": "black",
            "linewidth": 0.6,
        }
        label = f"{number} root{'s' * (number > 1)}, {int(here.sum())} nodes"
        ax.scatter(a1[here], a2[here], label=label, clip_on=False, zorder=3, **look)
    base.plane_axes(ax, r"\alpha_1", r"\alpha_2")
    base.legend_above(ax, columns=2)


def root_angle(
    ax: Any, coefficients: Coefficients, *, angle: int, which: Which
) -> None:
    """Draw α3 or α4 over the interior nodes (Figures 3 to 8): red squares on its + plane, blue discs on its − plane."""
    roots = interior_roots(coefficients, which)
    marks: list[Marks] = []
    for color, label in zip(sheets.COLORS, ("+ plane", "− plane"), strict=True):
        alpha = roots.alpha[roots.sheet == _SHEET[color]]
        points = alpha[:, [0, 1, angle - 1]]
        marks.append((points, base.COLOR_OF[color], base.MARKER_OF[color], label))
        _draw_plane(ax, coefficients, angle, color)
    base.angle_axis(ax.zaxis, rf"\alpha_{angle}")
    _draw_marks(ax, marks)


def signed_roots(
    ax: Any, coefficients: Coefficients, *, sign: Sign, which: Which
) -> None:
    """Draw α3 and α4 of the roots with one sign of R over the interior nodes (Figures 9, 11, 13 and 14).

    As in the paper, red squares are α3 and blue discs α4. Roots with R = 0 are grey and hollow.
    """
    roots = interior_roots(coefficients, which)
    relation = sheets.RELATION[sign]
    marks: list[Marks] = []
    for angle, marker in ((3, "s"), (4, "o")):
        points = roots.alpha[roots.sign == 0][:, [0, 1, angle - 1]]
        marks.append((points, base.GREY, marker, _SINGULAR))
    for angle, color, marker in ((3, base.RED, "s"), (4, base.BLUE, "o")):
        points = roots.alpha[roots.sign == _SIGN[sign]][:, [0, 1, angle - 1]]
        marks.append((points, color, marker, rf"$\alpha_{angle}$, ${relation}$"))
        for sheet in sheets.COLORS:
            _draw_plane(ax, coefficients, angle, sheet, color)
    base.angle_axis(ax.zaxis, r"\alpha_3,\ \alpha_4")
    _draw_marks(ax, marks)


def level_determinants(
    ax: Any, coefficients: Coefficients, *, sign: Sign, which: Which
) -> None:
    """Draw R of the roots with one sign of R over the interior nodes, each sheet in its color (Figures 10 and 12)."""
    roots = interior_roots(coefficients, which)
    points = np.column_stack([roots.alpha[:, :2], roots.R])
    is_signed = roots.sign == _SIGN[sign]
    tops = points[is_signed]
    # Stems show which node a value belongs to; they are one line with gaps.
    gaps = np.full(tops.shape, np.nan)
    stems = np.stack([tops * [1.0, 1.0, 0.0], tops, gaps], axis=1)
    ax.plot(*stems.reshape(-1, 3).T, color="0.75", linewidth=0.4)
    grey = points[roots.sign == 0]
    marks: list[Marks] = [(grey, base.GREY, base.MARKER_OF["blue"], _SINGULAR)]
    for color in sheets.COLORS:
        here = points[is_signed & (roots.sheet == _SHEET[color])]
        look = base.COLOR_OF[color], base.MARKER_OF[color]
        marks.append((here, *look, f"{color} sheet"))
    ax.set_zlabel("$R$ (dimensionless)")
    ax.set_zlim(
        0.0, tops[:, 2].max(initial=0.0) or 1.0
    )  # a vehicle with a rotor height has no blue roots
    _draw_marks(ax, marks)


def _draw_plane(
    ax: Any, coefficients: Coefficients, angle: int, sheet: Color, color: str = ""
) -> None:
    """Draw the translucent plane of α3 over α1, or of α4 over α2, of a sheet; it ends where the angle wraps."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]

    height = sheets.sheet_angles(sheet, _FINE_AXIS, _FINE_AXIS, coefficients)[angle - 3]
    quads = []
    for run in np.split(
        np.arange(FINE), 1 + np.flatnonzero(np.abs(np.diff(height)) > HALF_PI)
    ):
        (x0, x1), (z0, z1) = _FINE_AXIS[run[[0, -1]]], height[run[[0, -1]]]
        quad = np.array(
            [
                [x0, -HALF_PI, z0],
                [x1, -HALF_PI, z1],
                [x1, HALF_PI, z1],
                [x0, HALF_PI, z0],
            ]
        )
        quads.append(quad if angle == 3 else quad[:, [1, 0, 2]])
    ink = color or base.COLOR_OF[sheet]
    ax.add_collection3d(
        Poly3DCollection(
            quads, facecolor=(ink, 0.1), edgecolor=(ink, 0.35), linewidth=0.5, zorder=1
        )
    )


def _draw_marks(ax: Any, marks: Sequence[Marks]) -> None:
    """Draw points over the (α1, α2) plane, with a legend above. Near ones are larger and over far ones; none fades."""
    from matplotlib.ticker import FixedLocator

    for axis, symbol in ((ax.xaxis, r"\alpha_1"), (ax.yaxis, r"\alpha_2")):
        base.angle_axis(axis, symbol)
        # At the ends the labels of two axes would meet.
        axis.set_major_locator(FixedLocator([-HALF_PI / 2, 0.0, HALF_PI / 2]))
    ax.view_init(elev=_ELEVATION, azim=_AZIMUTH)
    ax.set_box_aspect((1, 1, 0.9), zoom=0.93)
    around, up = math.radians(_AZIMUTH), math.radians(_ELEVATION)
    toward = np.array(
        [
            math.cos(up) * math.cos(around),
            math.cos(up) * math.sin(around),
            0.9 * math.sin(up),
        ]
    )
    spans = np.array([ax.get_xlim(), ax.get_ylim(), ax.get_zlim()])
    for points, color, marker, label in marks:
        depth = (
            (points - spans[:, 0]) / np.ptp(spans, axis=1) - 0.5
        ) @ toward  # about −0.7 to 0.7
        layer = np.clip(((depth + 0.7) / 1.4 * _LAYERS).astype(int), 0, _LAYERS - 1)
        grey = color == base.GREY
        look: dict[str, Any] = {
            "facecolor": "none" if grey else color,
            "edgecolor": color if grey else "white",
        }
        look |= {
            "marker": marker,
            "linewidth": 0.6 if grey else 0.3,
            "depthshade": False,
            "gid": label,
        }
        for k in np.unique(layer):
            named = label if k == layer.max() else "_"
            ax.scatter(
                *points[layer == k].T,
                s=5.0 + 12.0 * k / _LAYERS,
                zorder=2 + k,
                label=named,
                **look,
            )
    for axis in (ax.xaxis, ax.yaxis, ax.zaxis):
        axis.set_pane_color((0.97, 0.97, 0.97, 1.0))
    ax.zaxis.set_rotate_label(False)
    ax.zaxis.label.set_rotation(90)
    ax.tick_params(pad=-1)
    for axis in (ax.xaxis, ax.yaxis, ax.zaxis):
        axis.labelpad = 2.0
    base.legend_above(ax, columns=3, over=-20.0)


_AROUND_RULE = {
    "(+,+)": 180,
    "(+,?)": 120,
    "(?,-)": 60,
    "(-,-)": 0,
    "(-,?)": 300,
    "(?,+)": 240,
}
"""Places of the types in Figure 15 (b) [°]."""


def adjacency_rule(
    of: Literal["angle", "pair"] = "pair", *, ax: Axes | None = None
) -> Axes:
    """Draw the Two Color rule as a graph: types joined by a line may be neighbours (Figure 15).

    Each type may also be its own neighbour. As in the paper, (?,?) is left out: it may neighbour every type. Lines
    follow :func:`gaitgraph.surface.sheets.types_may_be_adjacent`; the ``gid`` of each is its two types.

    `of` is "angle" for the types of α3 or α4, Figure 15 (a), or "pair" for those of (α3, α4), Figure 15 (b). The frame
    of `ax` is removed.
    """
    checked_choice("of", of, ("angle", "pair"))
    ax = base.axes_or_new(ax)
    if of == "angle":
        places = {"+": (-1.0, 0.0), "?": (0.0, 0.0), "-": (1.0, 0.0)}
    else:
        places = {}
        for kind, degrees in _AROUND_RULE.items():
            angle = math.radians(degrees)
            places[kind] = (math.cos(angle), math.sin(angle))
    for pair in combinations(places, 2):
        types = pair
        if of == "angle":  # the other angle is ?, which forbids nothing
            types = (f"({pair[0]},?)", f"({pair[1]},?)")
        if sheets.types_may_be_adjacent(*types):
            line = np.array([places[kind] for kind in pair])
            ax.plot(*line.T, color="0.35", linewidth=1.2, zorder=1, gid=" ".join(pair))
    for kind, place in places.items():
        edge, face, ink, shape = "0.35", "white", "black", _ROUNDED_BOX
        if kind in ("(+,+)", "+"):
            edge, face, ink, shape = base.RED, base.RED, "white", "square,pad=0.5"
        elif kind in ("(-,-)", "-"):
            edge, face, ink = base.BLUE, base.BLUE, "white"
        box = {
            "boxstyle": shape,
            "edgecolor": edge,
            "facecolor": face,
            "linewidth": 1.0,
        }
        text = kind.replace("-", "−")
        base.draw_label(ax, place, text, ink, bbox=box, zorder=3)
    ax.set_axis_off()
    ax.set_aspect("equal")
    ax.set(xlim=(-1.45, 1.45), ylim=(-1.35, 1.35))
    return ax


def type_map(
    sign: Sign = "negative",
    *,
    vehicle: VehicleLike = PAPER,
    coefficients: CoefficientsLike | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw which types of roots with one sign of R each interior node has (Figure 16).

    A red square is (+,+), a blue disc (−,−), a mark half of each is both. Other types are written; the ``gid`` of the
    text is the node's (i, j). Roots with R = 0 are grey, and hollow where marked. A dot is a node without roots of the
    sign. `coefficients` are those of formula (1) for the `vehicle`; by default the paper's, published.
    """
    checked_choice("sign", sign, sheets.RELATION)
    roots = interior_roots(coefficients_of(vehicle, coefficients))
    ax = base.axes_or_new(ax, size=(170, 176))
    is_shown = (roots.sign == _SIGN[sign]) | (roots.sign == 0)
    axis = grid_axis(DEFAULT_DIVISIONS)[1:-1]
    marked: dict[tuple[int, int], list[tuple[float, float]]] = {}
    for node, place in enumerate(product(axis, axis)):
        here = np.flatnonzero(is_shown & (roots.node == node))
        if (roots.types[here] == 0).any():
            _write_types(ax, roots, here, place)
            continue
        state = {1: 0, -1: 0}
        for k in here:
            signed = 1 + abs(int(roots.sign[k]))
            state[roots.sheet[k]] = max(state[roots.sheet[k]], signed)
        marked.setdefault((state[1], state[-1]), []).append(place)
    for both in sorted(marked, reverse=True):
        _mark_nodes(ax, marked[both], both, sheets.RELATION[sign])
    base.plane_axes(ax, r"\alpha_1", r"\alpha_2", divisor=8)
    base.legend_above(ax, columns=3)
    return ax


def _write_types(
    ax: Axes, roots: Roots, here: IntArray, place: tuple[float, float]
) -> None:
    """Write the types of some roots at their node, each once, red ones first."""
    written = set()
    for k in here:
        types = sheets.text_from_types(*roots.types[k])
        written.add((-int(roots.sheet[k]), types, bool(roots.sign[k] == 0)))
    i, j = divmod(int(roots.node[here[0]]), DEFAULT_DIVISIONS - 1)
    for k, (side, types, is_singular) in enumerate(sorted(written)):
        ink = base.RED if side < 0 else base.BLUE
        if is_singular:
            ink = base.GREY
        ax.annotate(
            types.replace("-", "−"),
            place,
            xytext=(0, 7.0 * ((len(written) - 1) / 2 - k)),
            textcoords="offset points",
            color=ink,
            fontsize=6.0,
            ha="center",
            va="center",
            annotation_clip=False,
            gid=f"{i + 1},{j + 1}",
        )


def _mark_nodes(
    ax: Axes,
    places: list[tuple[float, float]],
    state: tuple[int, int],
    relation: str,
) -> None:
    """Mark nodes by the state of their red and of their blue root: 0 for none, 1 with R = 0, 2 with the sign of R."""
    from matplotlib.markers import MarkerStyle

    x, y = np.array(places).T
    names = ("no", "singular", "yes")
    red, blue = state
    look: dict[str, Any] = {"gid": f"{names[red]} {names[blue]}", "zorder": 3}
    look["label"] = _label_of(state, relation)
    if state == (0, 0):
        dot: dict[str, Any] = {"s": 3.5, "linewidth": 0.0, "facecolor": base.GREY}
        ax.scatter(x, y, marker="o", **dot, **look)
        return
    fills: list[Any] = ["full", "full"]
    if red and blue:  # the left half of a square and the right half of a disc
        fills = ["left", "right"]
    for color, value, fill in zip(sheets.COLORS, state, fills, strict=True):
        if value == 0:
            continue
        marker = MarkerStyle(base.MARKER_OF[color], fillstyle=fill)
        face, edge = base.COLOR_OF[color], base.COLOR_OF[color]
        if value == 1:
            face, edge = "white", base.GREY
        size: dict[str, Any] = {"s": 42.0, "linewidth": 0.6}
        size |= {"facecolor": face, "edgecolor": edge}
        ax.scatter(x, y, marker=marker, **size, **look)


def _label_of(state: tuple[int, int], relation: str) -> str:
    """Return what the mark of a state means."""
    words = ("", "$R = 0$", f"${relation}$")
    red, blue = state
    if red == blue == 0:
        return f"no root with ${relation}$"
    if red == blue:
        return f"(+,+) and (−,−): {words[red]}"
    parts = []
    if red:
        parts.append(f"(+,+): {words[red]}")
    if blue:
        parts.append(f"(−,−): {words[blue]}")
    return ", ".join(parts)


def regions_map(vehicle: VehicleLike = PAPER, *, ax: Axes | None = None) -> Axes:
    """Draw the regions of the (α1, α2) plane on the red sheet: signs of R, and hover.

    R = 0 on the lines α1 = δ ∓ π/2 and α2 = ±π/2 − δ and on the curve tan α1 − tan α2 = 2κ. All hover thrusts are
    positive in the hatched parts: α1 < δ and α2 > −δ, or both reversed. Coefficients are exact. Each curve has its
    equation as its ``gid``.
    """
    vehicle, ax = vehicle_named(vehicle), base.axes_or_new(ax)
    a1, a2 = np.meshgrid(_FINE_AXIS, _FINE_AXIS, indexing="ij")
    value = matrices.level_determinant(
        np.stack([a1, a2, a1, a2], axis=-1), coefficients_of(vehicle, "exact")
    )
    ax.contourf(
        a1,
        a2,
        value,
        levels=[value.min() - 1, 0.0, value.max() + 1],
        colors=[base.NEGATIVE, base.POSITIVE],
    )
    line1, line2 = coefficients_of(vehicle, "exact").crossings
    low, high = -HALF_PI, HALF_PI
    hatched: dict[str, Any] = {"edgecolor": "0.6", "hatch": "///", "linewidth": 0.0}
    for color, relation in (
        (base.POSITIVE, ">"),
        (base.NEGATIVE, "<"),
    ):  # for the legend, as are other empty lists
        ax.fill(
            [],
            [],
            facecolor=color,
            edgecolor="0.5",
            linewidth=0.5,
            label=f"$R{relation}0$",
        )
    for first, second in (
        ((low, line1), (line2, high)),
        ((line1, high), (low, line2)),
    ):
        corners = np.array(
            [[first[i], second[j]] for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))]
        )
        ax.fill(*corners.T, facecolor="none", gid="hover", **hatched)
    idle: dict[str, Any] = {"color": "0.25", "linewidth": 0.8, "linestyle": (0, (4, 2))}
    ax.axvline(line1, label="a pair of rotors idles", **idle)
    ax.axhline(line2, **idle)
    draw_zeros_of_R(ax, vehicle)
    ax.fill([], [], facecolor="white", label="hover, thrusts > 0", **hatched)
    ax.plot(0, 0, "k+", markersize=7, zorder=6, label="all upright")
    mirror = math.copysign(1.0, line1)
    for x, y in (
        (-1.05, -0.62),
        (1.08, 0.3),
    ):  # within the two large components, off the hatched parts
        at = (mirror * x, mirror * y)
        base.draw_label(
            ax, at, "$R>0$" if sheets.red_label(*at, vehicle).prod() > 0 else "$R<0$"
        )
    base.plane_axes(ax, r"\alpha_1", r"\alpha_2", grid=False)
    base.legend_below(ax, ncols=2)
    return ax


def draw_zeros_of_R(ax: Axes, vehicle: Vehicle) -> None:
    """Draw where R = 0 on the red sheet, in closed form: where the determinant of one of the two blocks vanishes."""
    look: dict[str, Any] = {"color": "black", "linewidth": 1.4, "zorder": 4}
    roll = roll_block(vehicle)
    if roll.is_product:
        # The determinant is a product of a factor of α1 and one of α2.
        (both, second), (first, _) = roll.form
        end = np.array([-HALF_PI, HALF_PI])
        line1, line2 = (float(wrapped(math.atan2(-both, x))) for x in (first, second))
        ax.plot(np.full(2, line1), end, **look, gid="cos(alpha1 - delta) = 0")
        ax.plot(end, np.full(2, line2), **look, gid="cos(alpha2 + delta) = 0")
    else:
        a2 = _where_singular(roll)
        ax.plot(_FINE_AXIS, a2, **look, gid="P = 0")
    a2 = _where_singular(yaw_block(vehicle))
    ax.plot(_FINE_AXIS, a2, **look, gid="D = 0", label="$R=0$")


def _where_singular(block: Block) -> FloatArray:
    """Return the α2 at which the determinant u1ᵀ·B·u2 vanishes, NaN where one branch ends and another begins."""
    rise, run = block.form.T @ directions(_FINE_AXIS)
    a2 = np.arctan2(-rise * np.sign(run), np.abs(run))
    a2[1:][np.diff(np.sign(run)) != 0] = np.nan
    return np.asarray(a2)


def servo_margin_map(vehicle: VehicleLike = PAPER, *, ax: Axes | None = None) -> Axes:
    """Draw the servo margin of each posture of the red sheet, with the default floor, to 0.1°, and a color bar.

    Raises MissingConstant if the vehicle states a largest thrust without a mass.
    """
    vehicle, ax = vehicle_named(vehicle), base.axes_or_new(ax)
    axis = np.linspace(-HALF_PI, HALF_PI, _MARGINS)
    a1, a2 = np.meshgrid(axis, axis, indexing="ij")
    red = sheets.sheet_angles("red", a1, a2, coefficients_of(vehicle, "exact"))
    postures = np.stack([a1, a2, *red], axis=-1).reshape(-1, 4)
    margins = np.degrees(servo_margins_found(postures, vehicle, DEFAULT_FLOOR, 10))
    levels = 5.0 * np.arange(math.ceil(float(margins.max()) / 5) + 1)
    value = margins.reshape(a1.shape)
    filled = ax.contourf(a1, a2, value, levels=levels, cmap="cividis")
    ax.contour(a1, a2, value, levels=levels[2::2], colors="white", linewidths=0.5)
    draw_zeros_of_R(ax, vehicle)
    ax.plot(0, 0, marker="+", markersize=7, color="white", linestyle="none", zorder=6)
    base.plane_axes(ax, r"\alpha_1", r"\alpha_2", grid=False)
    bar = ax.inset_axes((1.04, 0.0, 0.05, 1.0))
    ax.figure.colorbar(filled, cax=bar, label="servo margin (°)")
    return ax


def singular_value_map(vehicle: VehicleLike = PAPER, *, ax: Axes | None = None) -> Axes:
    """Draw the least singular value on the red sheet in level flight, with exact coefficients, and a color bar."""
    vehicle, ax = vehicle_named(vehicle), base.axes_or_new(ax)
    a1, a2 = np.meshgrid(_FINE_AXIS, _FINE_AXIS, indexing="ij")
    value = matrices.least_singular_value_on_red(a1, a2, vehicle)
    levels = 0.1 * np.arange(math.ceil(10 * float(value.max())) + 1)
    filled = ax.contourf(a1, a2, value, levels=levels, cmap="cividis")
    ink = ["white" if level < 0.65 else "black" for level in levels[2::2]]
    lines = ax.contour(a1, a2, value, levels=levels[2::2], colors=ink, linewidths=0.5)
    ax.clabel(
        lines, levels[4::2], fmt="%.1f", fontsize=6.0
    )  # the lowest runs along the border
    draw_zeros_of_R(ax, vehicle)
    ax.plot(0, 0, marker="+", markersize=7, color="white", linestyle="none", zorder=6)
    base.plane_axes(ax, r"\alpha_1", r"\alpha_2", grid=False)
    bar = ax.inset_axes((1.04, 0.0, 0.05, 1.0))  # as high as the map
    ax.figure.colorbar(filled, cax=bar, label="least singular value (dimensionless)")
    return ax
