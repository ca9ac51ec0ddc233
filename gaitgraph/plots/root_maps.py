"""The roots over the (α1, α2) plane: how many, where, and with which R (Figures 2 to 14)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from gaitgraph.errors import InputError, shown
from gaitgraph.graph.build import DEFAULT_DIVISIONS, checked_divisions, grid_axis
from gaitgraph.invertibility.matrices import Coefficients, coefficients_of, noise_of
from gaitgraph.plots.axes import (
    BLUE,
    COLOR_OF,
    GREY,
    MARKER_OF,
    RED,
    SINGULAR,
    angle_axis,
    axes_or_new,
    legend_above,
    plane_axes,
    space_axes,
)
from gaitgraph.surface.adjacency import text_from_types
from gaitgraph.surface.sheets import COLORS, Sign, root_arrays

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FloatArray = npt.NDArray[np.float64]
Which = Literal["first", "other", "both"]
_SHEET = {"red": 1, "blue": -1}
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


def checked_sign(sign: Any) -> int:
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


def _scatter(ax: Any, points: FloatArray, color: str, marker: str, label: str) -> None:
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
    space_axes(ax)
    angle_axis(ax.zaxis, rf"\alpha_{angle[-1]}")
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

    As in the paper, and here alone, red squares are α3, blue discs α4. Roots without a sign of R are grey and hollow.

    Parameters
    ----------
    sign
        "positive" or "negative", the sign of R.
    which, coefficients, divisions, ax
        As for :func:`root_angle`.
    """
    wanted = checked_sign(sign)
    found = interior_roots(coefficients, divisions=divisions)
    chosen, none = found.chosen(which), found.sign == 0
    ax = axes_or_new(ax, size=(85, 74), in_space=True)
    looks = {2: (RED, "s"), 3: (BLUE, "o")}
    grey = found.alpha[chosen & none]
    for column, (_, marker) in looks.items():
        _scatter(ax, grey[:, [0, 1, column]], GREY, marker, SINGULAR if column == 2 else "_")
    for column, (color, marker) in looks.items():
        points = found.alpha[chosen & (found.sign == wanted)][:, [0, 1, column]]
        _scatter(ax, points, color, marker, rf"$\alpha_{column + 1}$, $R {'>' if wanted > 0 else '<'} 0$")
    space_axes(ax)
    angle_axis(ax.zaxis, r"\alpha_3,\ \alpha_4")
    legend_above(ax, columns=2 if len(grey) else 3, over=-16.0)
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

    Red squares are on the red sheet, blue discs on the blue one; roots without a sign of R are grey and hollow.

    Parameters
    ----------
    sign
        "positive" or "negative", the sign of R.
    which, coefficients, divisions, ax
        As for :func:`root_angle`.
    """
    wanted = checked_sign(sign)
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
        _scatter(
            ax, points[signed & (found.sheet == _SHEET[color])], COLOR_OF[color], MARKER_OF[color], f"{color} sheet"
        )
    space_axes(ax)
    ax.set_zlabel("$R$ (dimensionless)")
    legend_above(ax, columns=2, over=-16.0)
    return ax
