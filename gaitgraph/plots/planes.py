"""The (α1, α2) plane: roots over it, their types, and exact regions (Figures 2 to 16)."""

from __future__ import annotations

import math
from itertools import combinations, product
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import HALF_PI
from gaitgraph.errors import checked_choice
from gaitgraph.graph.nodes import DEFAULT_DIVISIONS, grid_axis
from gaitgraph.invertibility import matrices
from gaitgraph.invertibility.coefficients import (
    Coefficients,
    CoefficientsLike,
    coefficients_of,
)
from gaitgraph.invertibility.error_margins import servo_margins_found
from gaitgraph.invertibility.forms import rotors_of
from gaitgraph.plots import axes as base
from gaitgraph.surface import sheets
from gaitgraph.surface.blocks import directions, roll_block, yaw_block
from gaitgraph.surface.curved import curved_sheet
from gaitgraph.tolerances import DEFAULT_FLOOR
from gaitgraph.vehicle import PAPER, Vehicle, VehicleLike, vehicle_named

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.surface.sheets import Color, Sign

IntArray = npt.NDArray[np.integer[Any]]
Which = Literal["first", "other", "both"]

_MARGINS = 65  # points along each axis of a map of servo margins
FINE = 201  # points along each axis of other maps
_FINE_AXIS = np.linspace(-HALF_PI, HALF_PI, FINE)
_SHEET = {"red": 1, "blue": -1}
_SIGN = {"positive": 1, "negative": -1}
_PARTS = {"first": slice(1), "other": slice(1, None), "both": slice(None)}
_TIE = 12  # decimals [rad] to which α3 of two roots is compared
_COUNT_LOOKS = {
    1: (".", "black"),
    2: ("o", "white"),
    3: ("s", "0.6"),
    4: ("D", "0.35"),
    5: ("^", "black"),
}


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
    roots = sheets.root_arrays(
        a1.ravel(),
        a2.ravel(),
        coefficients=coefficients,
        crossing_tolerance=math.pi / (2 * DEFAULT_DIVISIONS),
    )
    # What is no root is NaN, and comes last of its node.
    third, fourth = np.moveaxis(np.round(roots.alpha[..., 2:], _TIE), -1, 0)
    order = np.lexsort((fourth, third))[:, _PARTS[which]]
    node, place = np.nonzero(np.take_along_axis(roots.sheet, order, axis=1))
    rows = (node, order[node, place])
    sheet, R = roots.sheet[rows], roots.R[rows]
    is_zero = np.abs(R) <= matrices.noise_of(coefficients)
    if coefficients.kind == "exact":
        is_zero |= sheet < 0  # floating-point noise is not a sign
    sign = np.where(is_zero, 0, np.sign(R)).astype(int)
    return Roots(node, roots.alpha[rows], sheet, roots.types[rows], R, sign)


def root_counts(ax: Axes, coefficients: Coefficients) -> None:
    """Draw how many roots each node of the grid has (Figure 2), with one scatter for each count."""
    axis = grid_axis(DEFAULT_DIVISIONS)
    a1, a2 = np.meshgrid(axis, axis, indexing="ij")
    count = sheets.root_arrays(a1, a2, coefficients=coefficients).count
    for number, (marker, face) in _COUNT_LOOKS.items():
        here = count == number
        if here.any():
            ax.scatter(
                a1[here],
                a2[here],
                s=16,
                marker=marker,
                facecolor=face,
                edgecolor="black",
                linewidth=0.6,
                label=f"{number} roots, {here.sum()} nodes",
                clip_on=False,
                zorder=3,
            )
    base.plane_axes(ax, r"\alpha_1", r"\alpha_2")
    base.legend_above(ax, columns=2)


def root_angle(
    ax: Any, coefficients: Coefficients, *, angle: int, which: Which
) -> None:
    """Draw α3 or α4 over the interior nodes (Figures 3 to 8): red squares on its + plane, blue discs on its − plane."""
    roots = interior_roots(coefficients, which)
    for color, label in zip(sheets.COLORS, ("+ plane", "− plane"), strict=True):
        here = roots.sheet == _SHEET[color]
        _draw_plane(ax, coefficients, angle, color, base.COLOR_OF[color])
        _draw_points(ax, roots, here, roots.alpha[:, angle - 1], color, label)
    _finish_space(ax, rf"\alpha_{angle}")


def signed_roots(
    ax: Any, coefficients: Coefficients, *, sign: Sign, which: Which
) -> None:
    """Draw α3 and α4 of the roots with one sign of R over the interior nodes (Figures 9, 11, 13 and 14).

    As in the paper, red squares are α3 and blue discs α4. Roots with R = 0 are grey and hollow.
    """
    roots = interior_roots(coefficients, which)
    for angle, color in ((3, "red"), (4, "blue")):
        label = rf"$\alpha_{angle}$, ${sheets.RELATION[sign]}$"
        height = roots.alpha[:, angle - 1]
        _draw_singular(ax, roots, height, color)
        _draw_points(ax, roots, roots.sign == _SIGN[sign], height, color, label)
        for sheet in sheets.COLORS:
            _draw_plane(ax, coefficients, angle, sheet, base.COLOR_OF[color])
    _finish_space(ax, r"\alpha_3,\ \alpha_4")


def level_determinants(
    ax: Any, coefficients: Coefficients, *, sign: Sign, which: Which
) -> None:
    """Draw R of the roots with one sign of R over the interior nodes, each sheet in its color (Figures 10 and 12)."""
    roots = interior_roots(coefficients, which)
    is_signed = roots.sign == _SIGN[sign]
    places, R = roots.alpha[is_signed, :2], roots.R[is_signed]
    # A stem shows which node a value belongs to.
    for (a1, a2), height in zip(places, R, strict=True):
        ax.plot([a1, a1], [a2, a2], [0.0, height], color="0.75", linewidth=0.4)
    _draw_singular(ax, roots, roots.R, "blue")
    for color in sheets.COLORS:
        here = is_signed & (roots.sheet == _SHEET[color])
        _draw_points(ax, roots, here, roots.R, color, f"{color} sheet")
    _finish_space(ax)
    ax.set_zlabel("$R$ (dimensionless)")
    # A vehicle with a rotor height has no blue roots.
    ax.set_zlim(0.0, R.max(initial=0.0) or 1.0)


def _draw_plane(
    ax: Any, coefficients: Coefficients, angle: int, sheet: Color, ink: str
) -> None:
    """Draw the translucent plane of α3 over α1, or of α4 over α2, of a sheet; it ends where the angle wraps."""
    height = sheets.sheet_angles(sheet, _FINE_AXIS, _FINE_AXIS, coefficients)[angle - 3]
    wraps = 1 + np.flatnonzero(np.abs(np.diff(height)) > HALF_PI)
    for run in np.split(np.arange(FINE), wraps):
        ends = run[[0, -1]]
        along, across = np.meshgrid(_FINE_AXIS[ends], [-HALF_PI, HALF_PI])
        if angle == 4:
            along, across = across, along
        ax.plot_surface(
            along,
            across,
            np.tile(height[ends], (2, 1)),
            color=(ink, 0.1),
            edgecolor=(ink, 0.35),
            shade=False,
            linewidth=0.5,
            zorder=1,
        )


def _draw_singular(ax: Any, roots: Roots, height: FloatArray, color: str) -> None:
    """Draw the roots with R = 0, grey and hollow, at a height, with the marks of a color."""
    label = "R = 0 to rounding: singular"
    look = {"facecolor": "none", "edgecolor": base.GREY}
    _draw_points(ax, roots, roots.sign == 0, height, color, label, **look)


def _draw_points(
    ax: Any,
    roots: Roots,
    here: npt.NDArray[np.bool_],
    height: FloatArray,
    color: str,
    label: str,
    **look: str,
) -> None:
    """Draw some roots at a height over their nodes, if there are any."""
    if here.any():
        look = {"facecolor": base.COLOR_OF[color], "edgecolor": "white"} | look
        ax.scatter(
            roots.alpha[here, 0],
            roots.alpha[here, 1],
            height[here],
            s=11.0,
            marker=base.MARKER_OF[color],
            linewidth=0.4,
            depthshade=False,
            label=label,
            zorder=3,
            **look,
        )


def _finish_space(ax: Any, height: str | None = None) -> None:
    """Label the axes of a space over the (α1, α2) plane, turn it, and put a legend above it."""
    base.angle_axis(ax.xaxis, r"\alpha_1")
    base.angle_axis(ax.yaxis, r"\alpha_2")
    if height is not None:
        base.angle_axis(ax.zaxis, height)
    for axis in (ax.xaxis, ax.yaxis):
        # At the ends the labels of two axes would meet.
        axis.set_ticks([-HALF_PI / 2, 0.0, HALF_PI / 2])
    for axis in (ax.xaxis, ax.yaxis, ax.zaxis):
        axis.labelpad = 2.0
    ax.view_init(elev=16, azim=-125)
    ax.set_box_aspect((1, 1, 0.9), zoom=0.93)
    ax.zaxis.set_rotate_label(False)
    ax.zaxis.label.set_rotation(90)
    ax.tick_params(pad=-1)
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
        types = {kind: f"({kind},?)" for kind in places}  # the other forbids nothing
    else:
        around = {kind: math.radians(angle) for kind, angle in _AROUND_RULE.items()}
        places = {kind: (math.cos(a), math.sin(a)) for kind, a in around.items()}
        types = {kind: kind for kind in places}
    for ends in combinations(types, 2):
        if sheets.types_may_be_adjacent(*(types[kind] for kind in ends)):
            x, y = np.transpose([places[kind] for kind in ends])
            ax.plot(
                x,
                y,
                color="0.35",
                linewidth=1.2,
                zorder=1,
                gid=" ".join(ends),
            )
    for kind, place in places.items():
        ink, face, shape = "black", "white", "round"
        if "+" in kind and "?" not in kind:
            ink, face, shape = "white", base.RED, "square"
        elif "-" in kind and "?" not in kind:
            ink, face = "white", base.BLUE
        box = {"boxstyle": f"{shape},pad=0.5", "edgecolor": "0.35", "facecolor": face}
        base.draw_label(ax, place, kind.replace("-", "−"), ink, bbox=box, zorder=3)
    ax.set_axis_off()
    ax.set(
        aspect="equal",
        xlim=(-1.45, 1.45),
        ylim=(-1.35, 1.35),
    )
    return ax


def type_map(
    sign: Sign = "negative",
    *,
    vehicle: VehicleLike = PAPER,
    coefficients: CoefficientsLike | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw which types of roots with one sign of R each interior node has (Figure 16).

    A red square is (+,+), a blue disc (−,−), a disc of two halves is both. Other types are written; the ``gid`` of the
    text is the node's (i, j). Roots with R = 0 are grey, and white where marked. A dot is a node without roots of the
    sign. `coefficients` are those of formula (1) for the `vehicle`; by default the paper's, published.
    """
    checked_choice("sign", sign, sheets.RELATION)
    roots = interior_roots(coefficients_of(vehicle, coefficients))
    ax = base.axes_or_new(ax, size=(170, 176))
    is_shown = (roots.sign == _SIGN[sign]) | (roots.sign == 0)
    axis = grid_axis(DEFAULT_DIVISIONS)[1:-1]
    marked: dict[tuple[str, str], list[tuple[float, float]]] = {}
    for node, place in enumerate(product(axis, axis)):
        here = np.flatnonzero(is_shown & (roots.node == node))
        if (roots.types[here] == 0).any():
            _write_types(ax, roots, here, place)
            continue
        state = {1: "no", -1: "no"}
        for k in here:
            state[roots.sheet[k]] = "yes" if roots.sign[k] else "singular"
        marked.setdefault((state[1], state[-1]), []).append(place)
    for states in sorted(marked, reverse=True):
        _mark_nodes(ax, marked[states], states, f"${sheets.RELATION[sign]}$")
    base.plane_axes(ax, r"\alpha_1", r"\alpha_2", divisor=8)
    base.legend_above(ax, columns=3)
    return ax


def _write_types(
    ax: Axes, roots: Roots, here: IntArray, place: tuple[float, float]
) -> None:
    """Write the types of some roots at their node, each once, red ones first."""
    written: dict[tuple[str, str], None] = {}
    for k in sorted(here, key=lambda k: -roots.sheet[k]):
        ink = base.BLUE
        if roots.sign[k] == 0:
            ink = base.GREY
        elif roots.sheet[k] > 0:
            ink = base.RED
        written[sheets.text_from_types(*roots.types[k].tolist()), ink] = None
    i, j = divmod(int(roots.node[here[0]]), DEFAULT_DIVISIONS - 1)
    for k, (types, ink) in enumerate(written):
        ax.annotate(
            types.replace("-", "−"),
            place,
            xytext=(0, 7.0 * ((len(written) - 1) / 2 - k)),
            textcoords="offset points",
            color=ink,
            fontsize=6.0,
            ha="center",
            va="center",
            gid=f"{i + 1},{j + 1}",
        )


def _mark_nodes(
    ax: Axes,
    places: list[tuple[float, float]],
    states: tuple[str, str],
    relation: str,
) -> None:
    """Mark nodes by whether they have a red and a blue root: "no", "yes", or "singular" for one with R = 0."""
    faces = []
    words = []
    inks = {"(+,+)": base.RED, "(−,−)": base.BLUE}
    for state, (types, ink) in zip(states, inks.items(), strict=True):
        if state == "yes":
            faces.append(ink)
            words.append(f"{types}: {relation}")
        elif state == "singular":
            faces.append("white")
            words.append(f"{types}: $R = 0$")
    marker, fill, size = "o", "full", 6.5
    if not faces:
        size = 1.0
        faces = [base.GREY]
        words = [f"no root with {relation}"]
    elif len(faces) == 2:
        fill = "left"
    elif states[0] != "no":
        marker = "s"
    ax.plot(
        *np.transpose(places),
        marker=marker,
        markersize=size,
        fillstyle=fill,
        linestyle="none",
        markerfacecolor=faces[0],
        markerfacecoloralt=faces[-1],
        markeredgecolor="0.35",
        markeredgewidth=0.5,
        label=", ".join(words),
        gid=" ".join(states),
    )


def regions_map(vehicle: VehicleLike = PAPER, *, ax: Axes | None = None) -> Axes:
    """Draw the regions of the (α1, α2) plane on the red sheet: signs of R, and hover.

    R = 0 on the lines α1 = δ ∓ π/2 and α2 = ±π/2 − δ and on the curve tan α1 − tan α2 = 2κ. All hover thrusts are
    positive in the hatched parts: α1 < δ and α2 > −δ, or both reversed. Coefficients are exact.
    """
    vehicle = vehicle_named(vehicle)
    ax = base.axes_or_new(ax)
    a1, a2 = np.meshgrid(_FINE_AXIS, _FINE_AXIS)
    exact = coefficients_of(vehicle, "exact")
    R = matrices.level_determinant(np.stack([a1, a2, a1, a2], axis=-1), exact)
    levels = [R.min() - 1, 0.0, R.max() + 1]
    ax.contourf(a1, a2, R, levels=levels, colors=[base.NEGATIVE, base.POSITIVE])
    for color, relation in ((base.POSITIVE, ">"), (base.NEGATIVE, "<")):
        ax.fill([], [], color=color, label=f"$R{relation}0$")
    line1, line2 = exact.crossings
    idle: dict[str, Any] = {"color": "0.25", "linewidth": 0.8, "linestyle": (0, (4, 2))}
    ax.axvline(line1, label="a pair of rotors idles", **idle)
    ax.axhline(line2, **idle)
    draw_zeros_of_R(ax, vehicle)
    corners = (((-HALF_PI, line1), HALF_PI), ((line1, HALF_PI), -HALF_PI))
    for sides, end in corners:
        ax.fill_between(
            sides,
            line2,
            end,
            facecolor="none",
            edgecolor="0.6",
            hatch="///",
            linewidth=0.0,
            label="hover, thrusts > 0",
            gid="hover",
        )
    ax.plot(
        0,
        0,
        "k+",
        markersize=7,
        zorder=6,
        label="all upright",
    )
    base.plane_axes(ax, r"\alpha_1", r"\alpha_2", grid=False)
    base.legend_below(ax, columns=2)
    return ax


def draw_zeros_of_R(ax: Axes, vehicle: Vehicle) -> None:
    """Draw where R = 0 on the red or curved sheet: where the determinant of a block, or a factor of R, vanishes."""
    axis = _FINE_AXIS
    if vehicle.asymmetry is None:
        u = directions(axis)
        rotors = rotors_of(vehicle)
        blocks = (roll_block(rotors), yaw_block(rotors))
        factors = [u.T @ block.form @ u for block in blocks]
    else:
        factors = [*curved_sheet(vehicle).factors_of_R(axis[:, None], axis)]
    for values in factors:
        ax.contour(
            axis, axis, values.T, [0.0], colors="black", linewidths=1.4, zorder=4
        )
    ax.plot(
        [],
        [],
        color="black",
        linewidth=1.4,
        label="$R=0$",
    )


def servo_margin_map(vehicle: VehicleLike = PAPER, *, ax: Axes | None = None) -> Axes:
    """Draw the servo margin of each posture of the red sheet, with the default floor, to 0.1°, and a color bar.

    Raises MissingConstant if the vehicle states a largest thrust without a mass.
    """
    vehicle = vehicle_named(vehicle)
    postures = _on_red(_MARGINS, vehicle).reshape(-1, 4)
    margins = np.degrees(servo_margins_found(postures, vehicle, DEFAULT_FLOOR, 10))
    values = margins.reshape(_MARGINS, _MARGINS)
    return _shaded_map(ax, vehicle, values, 5.0, "servo margin (°)")


def singular_value_map(vehicle: VehicleLike = PAPER, *, ax: Axes | None = None) -> Axes:
    """Draw the least singular value on the red sheet in level flight, with exact coefficients, and a color bar."""
    vehicle = vehicle_named(vehicle)
    values = matrices.least_singular_value(_on_red(FINE, vehicle), vehicle)
    label = "least singular value (dimensionless)"
    return _shaded_map(ax, vehicle, values, 0.1, label)


def _on_red(points: int, vehicle: Vehicle) -> FloatArray:
    """Return the tilt angles of the red sheet over a grid, rows of constant α2, shape (points, points, 4)."""
    axis = np.linspace(-HALF_PI, HALF_PI, points)
    a1, a2 = np.meshgrid(axis, axis)
    opposite = sheets.sheet_angles("red", a1, a2, coefficients_of(vehicle, "exact"))
    return np.stack([a1, a2, *opposite], axis=-1)


def _shaded_map(
    ax: Axes | None, vehicle: Vehicle, values: FloatArray, step: float, label: str
) -> Axes:
    """Shade values over the plane, rows of constant α2, with lines at every second level, and where R = 0."""
    ax = base.axes_or_new(ax)
    axis = np.linspace(-HALF_PI, HALF_PI, len(values))
    levels = step * np.arange(math.ceil(values.max() / step) + 1)
    filled = ax.contourf(axis, axis, values, levels=levels, cmap="cividis")
    inks = np.where(levels < 0.55 * levels[-1], "white", "black")[2::2].tolist()
    lines = ax.contour(axis, axis, values, levels[2::2], colors=inks, linewidths=0.5)
    # The lowest line runs along the border.
    ax.clabel(lines, levels[4::2], fmt="%.3g", fontsize=6.0)
    draw_zeros_of_R(ax, vehicle)
    ax.plot(0, 0, "w+", markersize=7, zorder=6)
    base.plane_axes(ax, r"\alpha_1", r"\alpha_2", grid=False)
    bar = ax.inset_axes((1.04, 0.0, 0.05, 1.0))  # as high as the map
    ax.figure.colorbar(filled, cax=bar, label=label)
    return ax
