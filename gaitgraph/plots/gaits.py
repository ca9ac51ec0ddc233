"""Gaits: their singular attitudes (Figures 18 to 22), and one in four dimensions."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import HALF_PI
from gaitgraph.errors import InputError, shown
from gaitgraph.gait.table import Table
from gaitgraph.io.reading import gait_of
from gaitgraph.plots.axes import (
    BLUE,
    COLOR_OF,
    RED,
    angle_axis,
    axes_or_new,
    legend_above,
    legend_below,
    plane_axes,
    require_matplotlib,
)
from gaitgraph.plots.planes import FINE, gait_loop, type_map
from gaitgraph.robustness.attitudes import AcceptableAttitudes, SingularCurve, acceptable_attitudes, singular_curve
from gaitgraph.surface.sheets import COLORS, sheet_angles
from gaitgraph.timing.timed_gait import TimedGait

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes

    from gaitgraph.gait.gait import Gait
    from gaitgraph.invertibility.matrices import Coefficients
    from gaitgraph.surface.sheets import Sign

FloatArray = npt.NDArray[np.float64]


def roll_pitch_diagram(
    gait: Gait,
    *,
    eta: float | None = None,
    coefficients: Coefficients | None = None,
    name: str = "gait",
    count: int = 48,
    tolerance: float = 1e-5,
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
        curves = _curves_of(one, numbers, count)
        _draw_gait(ax, around, curves, color, dash, f"{label}:\n{_told(around, curves)}")
    _finish(ax)
    return ax


def singular_attitudes(
    gait: Gait, around: AcceptableAttitudes, *, label: str, color: str, count: int = 48, ax: Axes | None = None
) -> Axes:
    """Draw the attitudes at which a gait is singular, and the border of those which are known to be acceptable.

    Parameters
    ----------
    gait
        The closed polyline; its coefficients are taken at face value, as in :func:`roll_pitch_diagram`.
    around
        The attitudes that the thick line borders.
    label
        What the legend says of them.
    color
        Of all lines.
    count, ax
        As for :func:`roll_pitch_diagram`.
    """
    ax = axes_or_new(ax, size=(85, 95))
    _draw_gait(ax, around, _curves_of(gait, at_face_value(gait.coefficients), count), color, "-", label)
    _finish(ax)
    return ax


def _curves_of(gait: Gait, numbers: Coefficients, count: int) -> list[SingularCurve]:
    """Return the singular attitudes at even times of a period."""
    alpha = gait.parametrize(1.0, law="constant-speed").at(np.arange(count) / count)[0]
    return [singular_curve(row, numbers) for row in alpha]


def _draw_gait(
    ax: Axes, around: AcceptableAttitudes, curves: Sequence[SingularCurve], color: str, dash: Any, label: str
) -> None:
    if any(curve.kind == "everywhere" for curve in curves):
        _hatch_everything(ax, color, label)
    else:
        _draw_curves(ax, curves, color, dash)
        _draw_border(ax, around, color, dash, label)


def _finish(ax: Axes) -> None:
    """Mark level flight, and make axes those of roll and pitch."""
    ax.plot(0, 0, marker="+", markersize=6, color="black", linestyle="none", zorder=6)
    plane_axes(ax, r"\phi", r"\theta", grid=False)
    ax.set(xlabel=r"roll $\phi$ (rad)", ylabel=r"pitch $\theta$ (rad)")
    legend_below(ax)


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
        The closed polyline of a table; by default :func:`gaitgraph.io.reading.gait_of` finds it.
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
    draw_angles(axes[0], time, alpha)
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
ANGLE_LOOKS: tuple[dict[str, Any], ...] = (
    {"color": "#e69f00", "linewidth": 3.2},
    {"color": "#56b4e9", "linewidth": 3.2},
    {"color": "black", "linewidth": 1.1, "linestyle": (0, (5, 2))},
    {"color": "black", "linewidth": 1.1, "linestyle": (0, (1, 1.2))},
)


def draw_angles(ax: Axes, time: FloatArray, alpha: FloatArray) -> None:
    """Draw four tilt angles over time [s]."""
    for k, look in enumerate(ANGLE_LOOKS):
        ax.plot(time, alpha[:, k], label=rf"$\alpha_{k + 1}$", **look)
    angle_axis(ax.yaxis, r"\alpha_i")
    ax.set(xlabel="$t$ (s)", xlim=(float(time[0]), float(time[-1])) if time[-1] > time[0] else None)
    ax.grid(True)
    legend_above(ax, columns=4)


def _draw_planes(ax: Axes, angles: tuple[int, int], coefficients: Coefficients) -> None:
    """Draw the + and the − plane of α3 over α1, or of α4 over α2, as thin lines."""
    axis = np.linspace(-HALF_PI, HALF_PI, FINE)
    for color in COLORS:
        pair = sheet_angles(color, axis, axis, coefficients)
        height = pair[0 if angles == (1, 3) else 1].copy()
        height[np.concatenate([[False], np.abs(np.diff(height)) > HALF_PI])] = np.nan  # it wraps there
        ax.plot(
            axis, height, color=COLOR_OF[color], linewidth=0.5, alpha=0.7, linestyle="-" if color == "red" else "--"
        )
