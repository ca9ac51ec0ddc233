"""The exact regions of the (α1, α2) plane, which the paper lacks."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import HALF_PI
from gaitgraph.invertibility.matrices import (
    coefficients_of,
    hover_thrust_shares,
    least_singular_value_on_red,
    level_determinant,
)
from gaitgraph.plots.axes import axes_or_new, draw_label, legend_below, plane_axes
from gaitgraph.surface.sheets import red_label
from gaitgraph.vehicle import PAPER, Vehicle

if TYPE_CHECKING:
    from matplotlib.axes import Axes


__all__ = ["FINE", "regions_map", "singular_value_map"]

FloatArray = npt.NDArray[np.float64]
FINE = 201
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
    # Where all four thrusts are equal, 1/(4·cos α1) of the weight, each contour has a corner: room for its label.
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
