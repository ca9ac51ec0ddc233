"""The picture of each object: gaits, timed gaits, plans, reports, regions and vehicles; and its HTML for notebooks.

Without matplotlib the HTML has no picture. All its text is escaped.
"""

from __future__ import annotations

import base64
import re
from dataclasses import replace
from html import escape
from textwrap import fill, shorten
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitgraph.errors import InputError, MissingConstant, MissingExtra, shown as shown_value
from gaitgraph.gait.gait import Gait, lift, name_of
from gaitgraph.invertibility.matrices import DEFAULT_FLOOR, coefficients_of, hover_thrust_shares, least_singular_value
from gaitgraph.planning.planner import Plan
from gaitgraph.plots import axes as base
from gaitgraph.plots.gaits import ANGLE_LOOKS, draw_angles, gait_loop, roll_pitch_diagram
from gaitgraph.plots.planes import draw_zeros_of_R
from gaitgraph.plots.vehicles import FROM_ABOVE, draw_vehicle, vehicle_view
from gaitgraph.surface.admissible import admissible_region
from gaitgraph.surface.region import Region
from gaitgraph.surface.sheets import COLORS, RELATION, red_label
from gaitgraph.timing.timed_gait import TimedGait
from gaitgraph.validation.report import Report, lines_of_checks
from gaitgraph.vehicle import Vehicle

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from gaitgraph.planning.any_angle import Location

    Shown = Gait | TimedGait | Plan | Report | Region | Vehicle

_MOST_CHECKED = 2000  # corners of a gait that is judged at once, in 0.1 s
_MOST_SHOWN = 60  # parts of a region
_FINE = 401  # points of a curve over a period
_SINGULAR = 1e-3  # least singular value below which hover thrusts are not drawn
_COARSE = 1e-3  # accuracy of the borders of a drawn region [rad]
_MARKS = {"ok": ("yes", "✓"), "NO": ("no", "✗"), "??": ("partly", "?")}


def plot(shown: Shown, *, ax: Axes | None = None) -> Axes:
    """Draw an object on two-dimensional axes, by default those of a new figure, 6 by 5 inches, and return the axes.

    A gait or plan is its loop on the map of (α1, α2), where the region for its sheet and sign of R is shaded; a plan
    also has its waypoints, its polygons, and arrows to the nearest admissible points if there is no loop. A timed gait
    is its four angles over time, a report the part of each limit that the gait uses.
    """
    ax = base.axes_or_new(ax)
    _draw(ax, shown, legend=True)
    title = shown.verdict if isinstance(shown, Report) else str(shown).partition("\n")[0].rstrip(":")
    ax.set_title(fill(re.sub(r"-(?=\d)", "−", title), 80), fontsize=9)
    return ax


PANELS = {
    "loop": "loop on the map",
    "angles": "tilt angles",
    "thrusts": "hover thrusts",
    "attitudes": "acceptable attitudes",
    "singular_value": "least singular value",
}
"""The pictures of a gait's own set, by name."""


def draw_panel(timed: TimedGait, panel: str, *, name: str = "", ax: Axes) -> None:
    """Draw one of :data:`PANELS` of a timed gait over a period; physics is exact, and level but for attitudes."""
    gait, vehicle = timed.gait, timed.gait.vehicle
    t = np.linspace(0.0, timed.period, _FINE)
    alpha = timed.at(t)[0]
    value = least_singular_value(alpha, vehicle)
    if panel == "loop":
        plot(gait, ax=ax)
    elif panel == "attitudes":
        exact = coefficients_of(vehicle, "exact")
        on_sheet = set(gait.colors) & {*COLORS} and lift(gait.alpha[:, :2], gait.colors, coefficients=exact)
        roll_pitch_diagram(on_sheet or replace(gait, coefficients=exact), name=name or name_of(gait), ax=ax)
    elif panel == "angles":
        draw_angles(ax, t, alpha)
    elif panel == "singular_value":
        ax.plot(t, value, color="black", linewidth=1.6, label="least singular value, level")
        ax.axhline(DEFAULT_FLOOR, color=base.RED, linewidth=0.9, linestyle="--", label=f"floor {DEFAULT_FLOOR:g}")
        ax.set(ylabel="least singular value (dimensionless)", ylim=(0.0, max(0.6, 1.1 * float(value.max()))))
    elif value.min() > _SINGULAR:
        for k, look in enumerate(ANGLE_LOOKS):
            ax.plot(t, 4.0 * hover_thrust_shares(alpha, vehicle)[:, k], label=f"rotor {k + 1}", **look)
        if vehicle.thrust_share is not None:
            ax.axhline(4.0 * vehicle.thrust_share, color=base.RED, linewidth=0.9, linestyle="--", label="limit")
        ax.set(ylabel="hover thrust (weight / 4)", ylim=(min(0.0, ax.get_ylim()[0]), None))
    else:
        words = "singular in level flight:\nno hover thrusts"
        ax.text(0.5, 0.5, words, transform=ax.transAxes, ha="center", va="center")
    if panel in ("angles", "thrusts", "singular_value"):
        ax.set(xlabel="$t$ (s)", xlim=(0.0, timed.period))
        ax.grid(True)
        if ax.lines:
            base.legend_below(ax, ncols=4)
    ax.set_title(f"{name or name_of(gait)}: {PANELS[panel]}", fontsize=9)


def compared(gaits: Sequence[tuple[str, TimedGait]]) -> Figure:
    """Return a figure with a row of all panels for each gait; the scales of a column are the same."""
    figure = base.blank_figure(80.0 * len(PANELS), 84.0 * len(gaits))
    axes = figure.subplots(len(gaits), len(PANELS), sharey="col", squeeze=False)
    for (name, timed), row in zip(gaits, axes, strict=True):
        for panel, ax in zip(PANELS, row, strict=True):
            draw_panel(timed, panel, name=name, ax=ax)
    return figure


def located(found: Location, vehicle: Vehicle) -> Figure:
    """Return a map of admissible regions, their parts with their numbers, and the waypoints as rings."""
    figure = base.blank_figure(130.0, 140.0)
    ax = figure.add_subplot()
    for one in found.regions:
        _draw_region(ax, one.region, vehicle if one.color == "red" else None, f"{found.use}, {one.color}")
        for number, part in enumerate(one.region.components, start=1):
            base.draw_label(ax, part.representative_point().coords[0], str(number))
    _draw_rings(ax, [waypoint.point for waypoint in found.regions[0].waypoints])
    ax.set_title(f"Admissible regions, vehicle {vehicle.name}")
    base.legend_below(ax, ncols=2)
    return figure


def _draw_rings(ax: Axes, points: Sequence[Sequence[float]]) -> None:
    look: dict[str, Any] = {"markersize": 7, "markerfacecolor": "none", "markeredgecolor": "black", "zorder": 5}
    for k, point in enumerate(points):
        ax.plot(*point[:2], "o", label="_" if k else "waypoints", **look)


def html_of(shown: Shown) -> str:
    """Return an object as HTML that can be put anywhere in a page."""
    text, picture, tables, gait, report, more = str(shown), "", "", None, None, []
    title = text.partition("\n")[0]
    if not isinstance(shown, Report):  # the table of its checks says more
        picture, words = _picture(shown)
        more = [words] if words != title else []
    if isinstance(shown, Gait):
        gait, more = shown, [*_judged(shown), *more]
    elif isinstance(shown, Report):
        report = shown
    elif isinstance(shown, Plan) and shown.loop is not None:
        gait, report = shown.loop.gait, shown.loop.report
    if gait is not None:
        text = text.replace("\n".join(gait.corner_lines()), "")
        tables += _table([line.split() for line in gait.corner_lines()])
    if report is not None:
        text = text.replace("\n".join(lines_of_checks(report.checks)), "")
        tables += _table([(check.mark, check.name.replace("_", " "), check.message) for check in report.checks])
    lines = [line for line in [*text.splitlines()[1:], *more] if line]
    body = f'<pre style="white-space:pre-wrap">{escape(chr(10).join(lines))}</pre>{tables}'
    box = f'<div style="flex:1 1 24em;min-width:0"><div><strong>{escape(title)}</strong></div>{body}</div>'
    return f'<div style="display:flex;flex-wrap:wrap;align-items:flex-start;gap:4px 20px">{picture}{box}</div>'


def _table(rows: Sequence[Sequence[str]]) -> str:
    cells = ["".join(f'<td style="text-align:left">{escape(text)}</td>' for text in row) for row in rows]
    return f"<table>{''.join(f'<tr>{row}</tr>' for row in cells)}</table>"


def _picture(shown: Shown) -> tuple[str, str]:
    """Return a small picture as an HTML element and what it shows, or twice "" without matplotlib."""
    try:
        with base.paper_style():
            figure = base.blank_figure(70, 62)
            words = _draw(figure.add_subplot(), shown, legend=False)
            content = base64.b64encode(base.picture_bytes(figure, "png")).decode("ascii")
    except MissingExtra:
        return "", ""
    # Half as wide as its pixels, to be sharp on screens of high resolution.
    return f'<img alt="{escape(words)}" width="276" src="data:image/png;base64,{content}">', words


def _judged(gait: Gait) -> list[str]:
    """Return the verdict on a gait and the first reason against it, or why there is no verdict."""
    if len(gait.alpha) > _MOST_CHECKED:
        return [f"not judged here, because it has more than {_MOST_CHECKED} corners; use check()"]
    try:
        report = gait.check()
    except MissingConstant as error:
        return [f"not judged: {error}"]
    return [report.verdict, *([report.reason] if report.reason else [])]


def _draw(ax: Axes, shown: Any, *, legend: bool) -> str:
    """Draw an object, with a legend where it has one and that is asked for, and return what the picture shows."""
    title = str(shown).partition("\n")[0]
    if isinstance(shown, (Gait, Plan)):
        title = _draw_loop(ax, shown)
        if legend:
            base.legend_below(ax, ncols=2)
    elif isinstance(shown, TimedGait):
        draw_angles(ax, shown.t, shown.alpha)
        base.legend_below(ax, ncols=4)
    elif isinstance(shown, Report):
        _draw_checks(ax, shown)
    elif isinstance(shown, Region):
        _draw_region(ax, shown)
    elif isinstance(shown, Vehicle):
        seen = vehicle_view(np.zeros(4), shown, view=FROM_ABOVE)
        low, high = seen.limits()
        ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
        ax.set_axis_off()
        draw_vehicle(ax, seen)
    else:
        raise InputError(f"only gaits, plans, reports, regions and vehicles can be plotted, got {shown_value(shown)}")
    return title


def _draw_region(ax: Axes, region: Region, vehicle: Vehicle | None = None, use: str = "") -> None:
    """Fill a region; with a vehicle in the color of the sign of R on its red sheet. `use` is for the legend."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    labels = set()
    for part in region.components[:_MOST_SHOWN]:
        rings = [np.asarray(ring.coords) for ring in (part.exterior, *part.interiors)]
        outline = Path.make_compound_path(*(Path(ring, closed=True) for ring in rings))
        face, label = "0.9", f"{use}, $R=0$ in exact physics" if use else ""
        if vehicle is not None:
            inside = part.representative_point()
            positive = red_label(inside.x, inside.y, vehicle).prod() > 0
            face, label = (base.POSITIVE, f"{use}, $R>0$") if positive else (base.NEGATIVE, f"{use}, $R<0$")
        named = "_" if label in labels else label
        labels.add(label)
        ax.add_patch(PathPatch(outline, facecolor=face, edgecolor=base.GREY, linewidth=0.5, label=named))
    base.plane_axes(ax, r"\alpha_1", r"\alpha_2")


def _draw_loop(ax: Axes, shown: Gait | Plan) -> str:
    """Draw a gait or a plan on the map of its sheet, and return what is shaded."""
    plan, gait = (None, shown) if isinstance(shown, Gait) else (shown, shown.loop.gait if shown.loop else None)
    sign: Any = None
    if gait is not None:
        vehicle, color, numbers = gait.vehicle, gait.color, gait.coefficients
        sign = "positive" if gait.R.min() > 0 else "negative" if gait.R.max() < 0 else None
    elif plan is not None:
        vehicle, color = plan.request.vehicle, "blue" if plan.request.color == "blue" else "red"
        sign, numbers = plan.request.sign, coefficients_of(vehicle, plan.request.coefficients)
    zones, waypoints = (None, ()) if plan is None else (plan.request.zones, plan.waypoints)
    words, which = "its loop in the plane of α1 and α2", f" with {RELATION[sign]}" if sign in RELATION else ""
    if color in ("red", "blue"):
        # Nothing is flyable on blue; limits of thrust need the mass.
        judged = color == "red" and (vehicle.max_thrust is None or vehicle.mass is not None)
        conditions: dict[str, Any] = {"use": "flyable" if judged else "valid", "color": color, "coefficients": numbers}
        region = admissible_region(vehicle, sign=sign if which else None, zones=zones, accuracy=_COARSE, **conditions)
        words = f"shaded: where a {color} gait{which} is {conditions['use']}"
        words += ", with the given polygons" if zones else ""
        _draw_region(ax, region, vehicle if color == "red" else None, conditions["use"])
    if color == "red":
        draw_zeros_of_R(ax, vehicle)
        ax.plot(0, 0, "k+", markersize=7, label="all upright")
    base.plane_axes(ax, r"\alpha_1", r"\alpha_2")
    for k, corners in enumerate(zones.keep_out if zones else ()):
        look: dict[str, Any] = {"facecolor": "white", "edgecolor": base.GREY, "hatch": "///"}
        ax.fill(*np.asarray(corners).T, label="_" if k else "keep out", **look)
    if gait is not None:
        gait_loop(gait, label=f"gait, {color or 'off the surfaces'}", width=2.2, ax=ax)
        end = max(np.pi / 2, float(np.abs(gait.alpha[:, :2]).max()))
        ax.set(xlim=(-end, end), ylim=(-end, end))
    if waypoints:
        words += "; rings: waypoints"
        _draw_rings(ax, waypoints)
    for obstacle in () if plan is None or gait is not None else plan.obstacles:
        if obstacle.nearest is not None:
            start = waypoints[obstacle.waypoints[0] - 1][:2]
            base.draw_arrow(ax, start, obstacle.nearest, base.PALETTE["no"][0])
    return words


def _draw_checks(ax: Axes, report: Report) -> None:
    """Draw the part of its limit that each check of a report uses, with its mark and its message."""
    from matplotlib.ticker import PercentFormatter

    for row, check in enumerate(report.checks):
        used, color, mark = 0.0, base.PALETTE[_MARKS[check.mark][0]][0], _MARKS[check.mark][1]
        if check.value is not None and check.limit:
            floor = check.name in ("R_sign", "least_singular_value")
            used = abs(check.limit / check.value) if floor and check.value else abs(check.value / check.limit)
        ax.barh(row + 0.2, min(used, 1.5), height=0.36, color=color)
        words = shorten(check.message.partition(": ")[0], 84, placeholder=" …")
        box = {"facecolor": "white", "edgecolor": "none", "pad": 0.5}
        ax.text(0.01, row - 0.22, words, fontsize=6.5, color="0.3", va="center", bbox=box, gid=check.name)
        ax.text(-0.02, row, f"{check.name.replace('_', ' ')}  {mark}", color=color, fontsize=8, ha="right", va="center")
    ax.axvline(1.0, color="black", linewidth=0.8, linestyle="--")
    ax.xaxis.set_major_formatter(PercentFormatter(1.0))
    ax.set(xlim=(0.0, 1.5), ylim=(len(report.checks) - 0.4, -0.6), yticks=[], xlabel="part of the limit that is used")
