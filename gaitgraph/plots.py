"""Pictures of surfaces, graphs, gaits and attitudes; each takes axes and returns them.

Every function draws on the axes `ax`, or on those of a new pyplot figure if there are none, and returns them. None
shows, saves, or changes a setting. Red squares and blue discs are the two sheets, unless a docstring says otherwise;
angles are in radians, with ticks at multiples of π.

The paper's "one of the roots" and "the other root" are in the order of its solver, which nobody knows. Here the roots
of a node are ordered by α3, then α4: the first root is the one with the smaller α3. Like the paper's, this order hops
between the planes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import HALF_PI
from gaitgraph.attitudes import AcceptableAttitudes, SingularCurve, acceptable_attitudes, singular_curve
from gaitgraph.coloring import PLANE_TYPES, types_may_be_adjacent
from gaitgraph.drawing import (
    BLUE,
    COLOR_OF,
    GREY,
    MARKER_OF,
    RED,
    SINGULAR,
    angle_axis,
    axes_or_new,
    half_markers,
    legend_above,
    legend_below,
    plane_axes,
    require_matplotlib,
    space_axes,
)
from gaitgraph.errors import InputError, shown
from gaitgraph.exchange import gait_of
from gaitgraph.graph import DEFAULT_DIVISIONS, Sign, checked_divisions, grid_axis
from gaitgraph.invertibility import (
    Coefficients,
    coefficients_of,
    hover_thrust_shares,
    least_singular_value_on_red,
    level_determinant,
    noise_of,
)
from gaitgraph.regions import red_label
from gaitgraph.surface import COLORS, root_arrays, sheet_angles, text_from_types
from gaitgraph.tables import Table
from gaitgraph.timing import TimedGait
from gaitgraph.vehicle import PAPER, Vehicle

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes

    from gaitgraph.gait import Gait

__all__ = [
    "InteriorRoots",
    "adjacency_rule",
    "at_face_value",
    "axes_of_a_gait",
    "draw_singular_curves",
    "gait_in_four_dimensions",
    "gait_loop",
    "interior_roots",
    "level_determinants",
    "regions_map",
    "roll_pitch_diagram",
    "root_angle",
    "root_counts",
    "signed_roots",
    "singular_value_map",
    "type_map",
    "vehicle_sketch",
]

FloatArray = npt.NDArray[np.float64]
Which = Literal["first", "other", "both"]

_SYMBOL = {"alpha3": r"\alpha_3", "alpha4": r"\alpha_4"}
_SHEET = {"red": 1, "blue": -1}
_PLANE_NAME = {"red": "+ plane", "blue": "− plane"}
_TIE = 12  # decimals [rad] to which α3 of two roots is compared


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
            raise InputError(f"which: {shown(which)}; allowed are 'first', 'other' and 'both'")
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
    types = found.types[i, j, k][order].tolist()
    return InteriorRoots(
        node=np.column_stack([i, j])[order] + 1,
        number=number,
        alpha=alpha[order],
        sheet=sheet[order],
        types=tuple(text_from_types(*pair) for pair in types),
        R=value[order],
        sign=sign[order].astype(np.int8),
    )


def _checked_sign(sign: Any) -> int:
    if sign not in ("positive", "negative"):
        raise InputError(f"sign: {shown(sign)}; allowed are 'positive' and 'negative'")
    return 1 if sign == "positive" else -1


def vehicle_sketch(vehicle: Vehicle = PAPER, *, ax: Axes | None = None) -> Axes:
    """Draw a vehicle from above, and one of its rotors from the tip of its arm: axes, spins, positive tilts (Figure 1).

    Parameters
    ----------
    vehicle
        Its `first_arm_angle` and `first_rotor_spin` are all that shows.
    ax
        Plane axes, which lose their frame; by default those of a new figure. The arrow of the lean of rotor 1 has
        "lean 1" as its ``gid``, and so on.
    """
    ax = axes_or_new(ax, size=(170, 92))
    ax.set_axis_off()
    ax.set_aspect("equal")
    ax.set(xlim=(-2.75, 5.6), ylim=(-2.45, 2.3))
    _draw_from_above(ax, vehicle)
    _draw_from_the_tip(ax)
    return ax


_DISC = 0.42  # radius of a rotor in units of the arm's length
_LEAN = "#b35900"  # of tilts and what follows from them


def _draw_from_above(ax: Axes, vehicle: Vehicle) -> None:
    """Draw the vehicle from above, x up the page and y to the left."""
    from matplotlib.patches import Circle

    clockwise = vehicle.first_rotor_spin == "clockwise"
    for number in range(1, 5):
        arm = vehicle.first_arm_angle + (number - 1) * math.pi / 2
        outward = np.array([-math.sin(arm), math.cos(arm)])  # on the page, where body x is up and body y left
        leaning = np.array([math.cos(arm), math.sin(arm)])  # of the thrust, for a positive tilt
        turns_clockwise = clockwise == (number % 2 == 1)
        ax.plot(*np.array([0 * outward, (1 - _DISC) * outward]).T, color="0.35", linewidth=2.5, zorder=1)
        ax.add_patch(Circle(tuple(outward), _DISC, facecolor="0.94", edgecolor="0.35", linewidth=0.8, zorder=2))
        _draw_spin(ax, outward, turns_clockwise)
        _arrow(ax, (1 + _DISC) * outward, (1.62 + _DISC) * outward, "0.35")
        _label(ax, (1.82 + _DISC) * outward, rf"$e_{number}$")
        start = outward + _DISC * leaning
        _arrow(ax, start, start + 0.5 * leaning, _LEAN, width=1.8, gid=f"lean {number}")
        _label(
            ax, start + (0.5 + 0.42 * abs(leaning[0]) + 0.2 * abs(leaning[1])) * leaning, rf"$\alpha_{number}>0$", _LEAN
        )
        _label(ax, outward, f"{number}\n{'cw' if turns_clockwise else 'ccw'}")
    corner = np.array([-2.2, -2.2])
    _arrow(ax, corner, corner + np.array([0.0, 0.75]), "black")
    _arrow(ax, corner, corner + np.array([-0.5, 0.0]), "black")
    _label(ax, corner, "$x$ forward", offset=(0.0, 0.92))
    _label(ax, corner, "$y$ left", offset=(-0.3, -0.2))
    ax.plot(*corner, marker="o", markersize=5, markerfacecolor="white", markeredgecolor="black", zorder=4)
    ax.plot(*corner, marker=".", markersize=2.5, color="black", zorder=5)
    _label(ax, corner, "$z$ up", offset=(0.38, 0.0))


def _draw_spin(ax: Axes, center: FloatArray, clockwise: bool) -> None:
    """Draw an arrow around a rotor."""
    from matplotlib.patches import FancyArrowPatch
    from matplotlib.path import Path

    arc = Path.arc(200, 520) if not clockwise else Path.arc(20, 340)
    vertices = np.asarray(arc.vertices)[:: -1 if clockwise else 1] * 0.8 * _DISC + center
    head = FancyArrowPatch(
        path=Path(vertices, arc.codes), arrowstyle="-|>", mutation_scale=7, color="0.35", linewidth=0.9, zorder=3
    )
    ax.add_patch(head)


def _arrow(
    ax: Axes, start: Any, end: Any, color: str, width: float = 1.0, size: float = 9.0, gid: str | None = None
) -> None:
    style = {"arrowstyle": "-|>", "color": color, "linewidth": width, "shrinkA": 0, "shrinkB": 0}
    ax.annotate("", xy=tuple(end), xytext=tuple(start), arrowprops=style | {"mutation_scale": size}, zorder=5, gid=gid)


def _label(ax: Axes, place: Any, text: str, color: str = "black", offset: tuple[float, float] = (0.0, 0.0)) -> None:
    ax.text(place[0] + offset[0], place[1] + offset[1], text, color=color, ha="center", va="center", zorder=6)


def _draw_from_the_tip(ax: Axes) -> None:
    """Draw a rotor with a positive tilt, seen from outside along its arm."""
    from matplotlib.patches import FancyArrowPatch
    from matplotlib.path import Path

    hub, tilt = np.array([4.2, -0.75]), math.radians(32)
    up, lean = np.array([0.0, 1.0]), np.array([-math.sin(tilt), math.cos(tilt)])
    across = np.array([math.cos(tilt), math.sin(tilt)])
    ax.plot(*np.array([hub, hub + 2.0 * up]).T, color="0.35", linewidth=0.8, linestyle=(0, (4, 3)))
    rotor = hub + 0.45 * lean
    ax.plot(*np.array([hub, rotor]).T, color="0.35", linewidth=2.0)
    ax.plot(*np.array([rotor - 0.6 * across, rotor + 0.6 * across]).T, color="0.35", linewidth=3.0)
    _arrow(ax, rotor, hub + 1.9 * lean, _LEAN, width=1.8)
    _label(ax, hub + 2.12 * lean, "thrust", _LEAN)
    arc = Path.arc(90, 90 + math.degrees(tilt))
    swing = FancyArrowPatch(
        path=Path(np.asarray(arc.vertices) * 1.3 + hub, arc.codes),
        arrowstyle="-|>",
        mutation_scale=8,
        color=_LEAN,
        shrinkA=0,
        shrinkB=0,
    )
    ax.add_patch(swing)
    middle = np.array([-math.sin(tilt / 2), math.cos(tilt / 2)])
    _label(ax, hub + 1.52 * middle, r"$\alpha_i>0$", _LEAN)
    ax.plot(*hub, marker="o", markersize=8, markerfacecolor="white", markeredgecolor="black", zorder=4)
    ax.plot(*hub, marker=".", markersize=4, color="black", zorder=5)
    _label(ax, hub, "$e_i$", offset=(0.3, -0.02))
    _label(ax, hub + 2.2 * up, "$z$", offset=(0.1, 0.0))
    _label(
        ax,
        hub - 0.75 * up,
        "rotor $i$ from the tip of its arm:\npositive tilts are right-handed\nabout the outward axis $e_i$",
    )


def root_counts(
    coefficients: Coefficients | None = None, *, divisions: int = DEFAULT_DIVISIONS, ax: Axes | None = None
) -> Axes:
    """Draw how many roots (α3, α4) each grid node has, border and corners included (Figure 2).

    Parameters
    ----------
    coefficients
        Those of formula (1); by default the paper's published ones.
    divisions
        Pieces n into which [−π/2, π/2] is cut.
    ax
        Plane axes; by default those of a new figure. Each number of roots is one scatter on it.
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


def _points_in_space(ax: Any, points: FloatArray, color: str, marker: str, label: str) -> None:
    """Scatter points of shape (m, 3), without fading those farther away: red and blue stay what they are."""
    if not len(points):
        return
    hollow = color == GREY
    ax.scatter(
        *points.T, s=11, marker=marker, facecolor="none" if hollow else color, edgecolor=color if hollow else "white",
        linewidth=0.6 if hollow else 0.25, depthshade=False, label=label,
    )  # fmt: skip


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
    coefficients
        Those of formula (1); by default the paper's published ones.
    divisions
        Pieces n into which [−π/2, π/2] is cut.
    ax
        Three-dimensional axes; by default those of a new figure.
    """
    if angle not in _SYMBOL:
        raise InputError(f"angle: {shown(angle)}; allowed are 'alpha3' and 'alpha4'")
    found = interior_roots(coefficients, divisions=divisions)
    chosen = found.chosen(which)
    ax = axes_or_new(ax, size=(85, 74), in_space=True)
    for color in COLORS:
        points = found.alpha[chosen & (found.sheet == _SHEET[color])]
        heights = points[:, [0, 1, 2 if angle == "alpha3" else 3]]
        _points_in_space(ax, heights, COLOR_OF[color], MARKER_OF[color], _PLANE_NAME[color])
    space_axes(ax)
    angle_axis(ax.zaxis, _SYMBOL[angle])
    legend_above(ax, columns=2, over=-16.0)
    return ax


def signed_roots(
    sign: Sign,
    *,
    which: Which = "both",
    coefficients: Coefficients | None = None,
    divisions: int = DEFAULT_DIVISIONS,
    ax: Any = None,
) -> Any:
    """Draw α3 and α4 of the roots with one sign of R over the interior nodes (Figures 9, 11, 13 and 14).

    As in the paper, and here alone, red squares are α3 and blue discs α4. Roots that have no sign of R are grey and
    hollow.

    Parameters
    ----------
    sign
        "positive" or "negative", the sign of R.
    which, coefficients, divisions, ax
        As for :func:`root_angle`.
    """
    wanted = _checked_sign(sign)
    found = interior_roots(coefficients, divisions=divisions)
    chosen, none = found.chosen(which), found.sign == 0
    ax = axes_or_new(ax, size=(85, 74), in_space=True)
    columns = {2: (RED, "s"), 3: (BLUE, "o")}
    if (chosen & none).any():
        grey = found.alpha[chosen & none]
        for column, (_, marker) in columns.items():
            _points_in_space(ax, grey[:, [0, 1, column]], GREY, marker, SINGULAR if column == 2 else "_")
    for column, (color, marker) in columns.items():
        points = found.alpha[chosen & (found.sign == wanted)][:, [0, 1, column]]
        _points_in_space(ax, points, color, marker, rf"$\alpha_{column + 1}$, $R {'>' if wanted > 0 else '<'} 0$")
    space_axes(ax)
    angle_axis(ax.zaxis, r"\alpha_3,\ \alpha_4")
    legend_above(ax, columns=3 if not (chosen & none).any() else 2, over=-16.0)
    return ax


def level_determinants(
    sign: Sign,
    *,
    which: Which = "both",
    coefficients: Coefficients | None = None,
    divisions: int = DEFAULT_DIVISIONS,
    ax: Any = None,
) -> Any:
    """Draw the value of R of the roots with one sign of it over the interior nodes (Figures 10 and 12).

    Red squares are on the red sheet, blue discs on the blue one; roots that have no sign of R are grey and hollow.

    Parameters
    ----------
    sign
        "positive" or "negative", the sign of R.
    which, coefficients, divisions, ax
        As for :func:`root_angle`.
    """
    wanted = _checked_sign(sign)
    found = interior_roots(coefficients, divisions=divisions)
    chosen, none = found.chosen(which), found.sign == 0
    ax = axes_or_new(ax, size=(85, 74), in_space=True)
    places = np.column_stack([found.alpha[:, :2], found.R])
    if (chosen & none).any():
        _points_in_space(ax, places[chosen & none], GREY, MARKER_OF["blue"], SINGULAR)
    below = places[chosen & (found.sign == wanted)]
    # Stems, one line with gaps, show which node a value belongs to.
    stems = np.stack([below * [1.0, 1.0, 0.0], below, np.full(below.shape, np.nan)], axis=1).reshape(-1, 3)
    ax.plot(*stems.T, color="0.75", linewidth=0.4)
    for color in COLORS:
        points = places[chosen & (found.sign == wanted) & (found.sheet == _SHEET[color])]
        _points_in_space(ax, points, COLOR_OF[color], MARKER_OF[color], f"{color} sheet")
    space_axes(ax)
    ax.set_zlabel("$R$ (dimensionless)")
    legend_above(ax, columns=2, over=-16.0)
    return ax


def adjacency_rule(of: Literal["angle", "pair"] = "pair", *, ax: Axes | None = None) -> Axes:
    """Draw the Two Color rule as a graph: the types that are lined may be neighbours (Figure 15).

    Each type may also be its own neighbour. As in the paper (?,?), a neighbour of every type, is left out. The lines
    are those that :func:`gaitgraph.coloring.types_may_be_adjacent` allows; each has the two types as its ``gid``.

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
    wanted = _checked_sign(sign)
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
        _arrow(ax, tail, tail + 0.03 * step, color, width=0.0, size=14 if band else 10)
    if fresh:
        plane_axes(ax, rf"\alpha_{angles[0]}", rf"\alpha_{angles[1]}")
    return ax


def _line_look(color: str, *, band: bool) -> dict[str, Any]:
    """Return how a gait's segments of a color are drawn; "none" is off the surfaces."""
    if band:
        pale = {"red": "#fcd4cd", "blue": "#9fb3e8", "none": "0.8"}
        return {
            "color": pale[color],
            "linestyle": "-",
            "solid_joinstyle": "round",
            "solid_capstyle": "butt",
            "zorder": 1.2,
        }
    dash: dict[str, Any] = {"red": "-", "blue": (0, (3, 1.2)), "none": (0, (1, 1))}
    return {"color": COLOR_OF.get(color, "black"), "linestyle": dash[color], "zorder": 4}


_FINE = 201
"""Points along each axis of a contoured region; curves and borders themselves are drawn in closed form."""

_POSITIVE, _NEGATIVE = "#fff1b8", "#dcdce6"  # where R > 0 and R < 0, in no color of a sheet


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
    axis = np.linspace(-HALF_PI, HALF_PI, _FINE)
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
    draw_singular_curves(ax, vehicle)
    ax.plot(0, 0, marker="+", markersize=7, color="black", linestyle="none", zorder=6)
    _name_regions(ax, vehicle)
    plane_axes(ax, r"\alpha_1", r"\alpha_2", grid=False)
    _legend_of_regions(ax)
    return ax


def _contour_thrust(ax: Axes, first: tuple[float, float], second: tuple[float, float], vehicle: Vehicle) -> None:
    """Draw contours of the largest hover thrust within one rectangle of the (α1, α2) plane."""
    inside = np.linspace(0.0, 1.0, _FINE // 2)[1:-1]
    inside = inside**2 * (3 - 2 * inside)  # denser at the ends: all contours meet in one corner
    a1, a2 = (low + (high - low) * inside for low, high in (first, second))
    b1, b2 = np.meshgrid(a1, a2, indexing="ij")
    largest = hover_thrust_shares(np.stack([b1, b2, b1, b2], axis=-1), vehicle).max(axis=-1)
    levels = [0.3, 0.4, 0.6]
    ax.contour(b1, b2, largest, levels=levels, colors="black", linewidths=0.7)
    # Where all four thrusts are equal, 1/(4·cos α1) of the weight, each contour has a corner: room for its label.
    side = 1.0 if first[0] > -HALF_PI else -1.0
    for level in levels:
        at = side * math.acos(0.25 / level)
        ground = _POSITIVE if red_label(at, -at, vehicle).prod() > 0 else _NEGATIVE
        box = {"facecolor": ground, "edgecolor": "none", "pad": 0.6}
        ax.text(at, -at, f"{level:.1f}", fontsize=6.0, ha="center", va="center", bbox=box, zorder=5)


def draw_singular_curves(ax: Axes, vehicle: Vehicle) -> None:
    """Draw where R = 0 on the red sheet, in closed form."""
    kappa = vehicle.signed_drag_ratio
    delta = math.atan(kappa)
    look: dict[str, Any] = {"color": "black", "linewidth": 1.4, "zorder": 4}
    end = np.linspace(-HALF_PI, HALF_PI, 2)
    for edge in (delta - HALF_PI, delta + HALF_PI):
        if abs(edge) <= HALF_PI:
            ax.plot(np.full(2, edge), end, **look, gid="cos(alpha1 - delta) = 0")
            ax.plot(end, np.full(2, -edge), **look, gid="cos(alpha2 + delta) = 0")
    a1 = np.linspace(-HALF_PI, HALF_PI, _FINE)
    # The same curve as tan α1 − tan α2 = 2κ, without infinite tangents.
    a2 = np.arctan2(np.sin(a1) - 2 * kappa * np.cos(a1), np.cos(a1))
    ax.plot(a1, a2, **look, gid="tan(alpha1) - tan(alpha2) = 2 kappa")


def _name_regions(ax: Axes, vehicle: Vehicle) -> None:
    """Write the sign of R into the two large components, off the hatched parts."""
    mirror = math.copysign(1.0, vehicle.signed_drag_ratio)
    for place in ((-1.05, -0.62), (1.08, 0.3)):
        at = (mirror * place[0], mirror * place[1])
        _label(ax, at, "$R>0$" if red_label(*at, vehicle).prod() > 0 else "$R<0$")


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
    axis = np.linspace(-HALF_PI, HALF_PI, _FINE)
    a1, a2 = np.meshgrid(axis, axis, indexing="ij")
    value = least_singular_value_on_red(a1, a2, vehicle)
    levels = np.arange(0.0, 1.31, 0.1)
    levels = levels[: int(np.searchsorted(levels, float(value.max()))) + 1]
    filled = ax.contourf(a1, a2, value, levels=levels, cmap="cividis")
    ink = ["white" if level < 0.65 else "black" for level in levels[2::2]]
    lines = ax.contour(a1, a2, value, levels=levels[2::2], colors=ink, linewidths=0.5)
    ax.clabel(lines, levels[4::2], fmt="%.1f", fontsize=6.0)  # the lowest runs along the border
    draw_singular_curves(ax, vehicle)
    ax.plot(0, 0, marker="+", markersize=7, color="white", linestyle="none", zorder=6)
    plane_axes(ax, r"\alpha_1", r"\alpha_2", grid=False)
    bar = ax.figure.colorbar(filled, cax=ax.inset_axes((1.05, 0.0, 0.06, 1.0)))
    bar.set_label("least singular value (dimensionless)")
    return ax


def roll_pitch_diagram(
    gait: Gait,
    *,
    eta: float | None = None,
    coefficients: Coefficients | None = None,
    name: str = "gait",
    count: int = 48,
    tolerance: float = 1e-4,
    ax: Axes | None = None,
) -> Axes:
    """Draw the attitudes at which a gait is singular, and those of its biased gait (Figures 18 to 22).

    As in the paper the gait is red, solid, and its biased gait blue, dashed: thin lines are the singular attitudes at
    even times of a period, thick ones border the attitudes around level flight that are never singular.

    Parameters
    ----------
    gait
        The closed polyline.
    eta
        The biased gait's η, equations (14) and (15); without it there is none.
    coefficients
        Those of formula (1); by default the gait's own. They are taken at face value, as if all their further digits
        were zero: published ones then give the blue sheet a sign of R.
    name
        What the legend calls the gait.
    count
        How many singular curves of each gait.
    tolerance
        Largest fraction of the diagram that the bordered attitudes may lack.
    ax
        Plane axes; by default those of a new figure. Singular curves have "singular" as their ``gid``, borders
        "acceptable".
    """
    if isinstance(count, bool) or not isinstance(count, (int, np.integer)) or count < 1:
        raise InputError(f"count: {shown(count)}; allowed is a whole number from 1")
    ax = axes_or_new(ax, size=(85, 95))
    numbers = at_face_value(coefficients or gait.coefficients)
    gaits: list[tuple[Gait, str, str, Any]] = [(gait, name, RED, "-")]
    if eta is not None:
        gaits.append((gait.biased(eta), f"{name}, $\\eta$ = {eta:g}", BLUE, (0, (3, 1.5))))
    for one, label, color, dash in gaits:
        around = acceptable_attitudes(one.alpha, numbers, tolerance=tolerance)
        times = np.arange(count) / count
        alpha = one.parametrize(1.0, law="constant-speed").at(times)[0]
        curves = [singular_curve(row, numbers) for row in alpha]
        told = f"{label}:\n{_told(around, curves)}"
        if any(curve.kind == "everywhere" for curve in curves):
            _hatch_everything(ax, color, told)
        else:
            _draw_curves(ax, curves, color, dash)
            _draw_border(ax, around, color, dash, told)
    ax.plot(0, 0, marker="+", markersize=6, color="black", linestyle="none", zorder=6)
    plane_axes(ax, r"\phi", r"\theta", grid=False)
    ax.set(xlabel=r"roll $\phi$ (rad)", ylabel=r"pitch $\theta$ (rad)")
    legend_below(ax)
    return ax


def at_face_value(coefficients: Coefficients) -> Coefficients:
    """Return coefficients whose digits are taken as all there are, so that nothing is lost in their rounding."""
    return replace(coefficients, kind="exact")


def _told(around: AcceptableAttitudes, curves: Sequence[SingularCurve]) -> str:
    """Return what a gait's diagram shows, for its legend."""
    if any(curve.kind == "everywhere" for curve in curves):
        return "singular at every attitude"
    if all(curve.kind == "none" for curve in curves):
        return "no singular attitude"
    if around.polygon.is_empty:
        return "level flight singular at times"
    return f"{100 * around.fraction:.1f} % acceptable"


def _hatch_everything(ax: Axes, color: str, label: str) -> None:
    corners = HALF_PI * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    look: dict[str, Any] = {"facecolor": (color, 0.12), "edgecolor": (color, 0.5), "hatch": "xxx", "linewidth": 0.0}
    ax.fill(*corners.T, **look, gid="singular", label=label)


def _draw_curves(ax: Axes, curves: Sequence[SingularCurve], color: str, dash: Any) -> None:
    for curve in curves:
        if curve.kind == "curve":
            ax.plot(*curve.points().T, color=color, linestyle=dash, linewidth=0.5, alpha=0.8, gid="singular", zorder=2)


def _draw_border(ax: Axes, around: AcceptableAttitudes, color: str, dash: Any, label: str) -> None:
    corners = np.zeros((0, 2)) if around.polygon.is_empty else np.asarray(around.polygon.exterior.coords)
    ax.plot(*corners.T, color=color, linestyle=dash, linewidth=2.0, gid="acceptable", label=label, zorder=3)


def gait_in_four_dimensions(timed: TimedGait | Table, *, gait: Gait | None = None, axes: Any = None) -> Any:
    """Draw a gait over one period: its angles in time, its loop on the map of types, and three projections.

    Parameters
    ----------
    timed
        A gait with a clock, or a table with `t`.
    gait
        The closed polyline of a table; by default :func:`gaitgraph.exchange.gait_of` finds it.
    axes
        Five plane axes: time, (α1, α2), (α1, α3), (α2, α4), (α3, α4); by default those of a new figure.

    Returns
    -------
    array of five axes
    """
    time, alpha, gait = _in_time(timed, gait)
    axes = _five_axes() if axes is None else np.ravel(np.asarray(axes, dtype=object))
    if len(axes) != 5:
        raise InputError(f"axes: {len(axes)} of them; allowed are five")
    for ax in axes:
        axes_or_new(ax)
    _draw_angles(axes[0], time, alpha)
    sign: Sign = "positive" if gait.R[np.argmax(np.abs(gait.R))] > 0 else "negative"
    type_map(sign, coefficients=gait.coefficients, labels=False, ax=axes[1])
    gait_loop(gait, ax=axes[1])
    axes[1].set_title(f"nodes with $R {'>' if sign == 'positive' else '<'} 0$")
    for ax, angles in zip(axes[2:], ((1, 3), (2, 4), (3, 4)), strict=True):
        if angles != (3, 4):
            _draw_planes(ax, angles, gait.coefficients)
        gait_loop(gait, angles=angles, ax=ax)
        plane_axes(ax, rf"\alpha_{angles[0]}", rf"\alpha_{angles[1]}")
    return axes


def _in_time(timed: TimedGait | Table, gait: Gait | None) -> tuple[FloatArray, FloatArray, Gait]:
    """Return times [s], tilt angles and the polyline of a gait with a clock or of a table."""
    if isinstance(timed, TimedGait):
        return timed.t, timed.alpha, gait or timed.gait
    if not isinstance(timed, Table):
        raise InputError(f"timed: {shown(timed)}; allowed is a TimedGait, or a Table with t")
    gait = gait or gait_of(timed)
    if "t" in timed and "alpha3" in timed:
        return np.asarray(timed["t"], dtype=float), timed.alpha, gait
    clock = gait.parametrize()
    return clock.t, clock.alpha, gait


def _five_axes() -> Any:
    require_matplotlib()
    from matplotlib import pyplot

    figure = pyplot.figure(figsize=(170 / 25.4, 118 / 25.4), layout="constrained")
    return axes_of_a_gait(figure)


def axes_of_a_gait(figure: Any) -> Any:
    """Return the five axes that :func:`gait_in_four_dimensions` draws on, new ones of a figure."""
    named = figure.subplot_mosaic([["time", "time", "12"], ["13", "24", "34"]])
    return np.array([named[name] for name in ("time", "12", "13", "24", "34")], dtype=object)


# Of the angles, in no color of a sheet; opposite rotors, which move together on the red sheet, differ in width.
_ANGLE_LOOKS: tuple[dict[str, Any], ...] = (
    {"color": "#e69f00", "linewidth": 3.2},
    {"color": "#56b4e9", "linewidth": 3.2},
    {"color": "black", "linewidth": 1.1, "linestyle": (0, (5, 2))},
    {"color": "black", "linewidth": 1.1, "linestyle": (0, (1, 1.2))},
)


def _draw_angles(ax: Axes, time: FloatArray, alpha: FloatArray) -> None:
    for k, look in enumerate(_ANGLE_LOOKS):
        ax.plot(time, alpha[:, k], label=rf"$\alpha_{k + 1}$", **look)
    angle_axis(ax.yaxis, r"\alpha_i")
    ax.set(xlabel="$t$ (s)", xlim=(float(time[0]), float(time[-1])) if time[-1] > time[0] else None)
    ax.grid(True)
    legend_above(ax, columns=4)


def _draw_planes(ax: Axes, angles: tuple[int, int], coefficients: Coefficients) -> None:
    """Draw the + and the − plane of α3 over α1, or of α4 over α2, as thin lines."""
    axis = np.linspace(-HALF_PI, HALF_PI, _FINE)
    for color in COLORS:
        pair = sheet_angles(color, axis, axis, coefficients)
        height = pair[0 if angles == (1, 3) else 1].copy()
        height[np.concatenate([[False], np.abs(np.diff(height)) > HALF_PI])] = np.nan  # it wraps there
        ax.plot(
            axis, height, color=COLOR_OF[color], linewidth=0.5, alpha=0.7, linestyle="-" if color == "red" else "--"
        )
