"""HTML of gaits, timed gaits, plans, reports, regions and vehicles for notebooks: a picture, text and tables.

Without matplotlib there is no picture. All text is escaped.
"""

from __future__ import annotations

import base64
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitgraph.errors import MissingConstant, MissingExtra
from gaitgraph.gait.gait import Gait
from gaitgraph.invertibility.matrices import coefficients_of
from gaitgraph.plots.axes import GREY, blank_figure, paper_style, picture_bytes, plane_axes
from gaitgraph.plots.gaits import draw_angles, gait_loop
from gaitgraph.plots.vehicles import FROM_ABOVE, draw_vehicle, vehicle_view
from gaitgraph.surface.admissible import admissible_region
from gaitgraph.surface.region import Region
from gaitgraph.timing.timed_gait import TimedGait
from gaitgraph.validation.report import Report, lines_of_checks
from gaitgraph.vehicle import Vehicle

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from matplotlib.axes import Axes

    from gaitgraph.planning.planner import Plan
    from gaitgraph.surface.region import Zones

_MOST_CHECKED = 2000  # corners of a gait that is judged at once, in 0.1 s
_MOST_SHOWN = 60  # waypoints, and parts of a region
_COARSE = 1e-3  # of the borders of a region in a small picture [rad]


def html_of(shown: Gait | TimedGait | Plan | Report | Region | Vehicle) -> str:
    """Return an object as HTML that can be put anywhere in a page."""
    text, picture, tables, gait, report, more = str(shown), "", "", None, None, []
    title = text.partition("\n")[0]
    if isinstance(shown, Vehicle):
        picture = _picture(lambda ax: _draw_from_above(ax, shown), "its arms from above")
    elif isinstance(shown, Region):
        picture = _picture(lambda ax: _draw_plane(ax, region=shown), title)
    elif isinstance(shown, TimedGait):
        picture = _picture(lambda ax: draw_angles(ax, shown.t, shown.alpha), "its tilt angles over one period")
    elif isinstance(shown, Gait):
        gait, (region, words) = shown, _region_under(shown)
        more = [*_judged(gait), words]
        picture = _picture(lambda ax: _draw_plane(ax, gait=gait, region=region), words)
    elif isinstance(shown, Report):
        report = shown
    else:
        request = shown.request
        if shown.loop is not None:
            gait, report = shown.loop.gait, shown.loop.report
            region, words = _region_under(gait, request.zones)
        else:
            sign = None if request.sign == "auto" else request.sign
            numbers = coefficients_of(request.vehicle, request.coefficients)
            color = "blue" if request.color == "blue" else "red"
            region, words = _region_of(request.vehicle, color, sign, numbers, request.zones)
        more = [f"{words}; rings: waypoints"]
        picture = _picture(lambda ax: _draw_plane(ax, gait=gait, waypoints=shown.waypoints, region=region), words)
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


def _judged(gait: Gait) -> list[str]:
    """Return the verdict on a gait and the first reason against it, or why there is no verdict."""
    if len(gait.alpha) > _MOST_CHECKED:
        return [f"not judged here, because it has more than {_MOST_CHECKED} corners; use check()"]
    try:
        report = gait.check()
    except MissingConstant as error:
        return [f"not judged: {error}"]
    return [report.verdict, *([report.reason] if report.reason else [])]


def _region_under(gait: Gait, zones: Zones | None = None) -> tuple[Region | None, str]:
    """Return the region to draw below a gait's loop, and its description."""
    if gait.color not in ("red", "blue"):
        return None, "its loop in the plane of α1 and α2"
    sign = "positive" if gait.R.min() > 0 else "negative" if gait.R.max() < 0 else None
    return _region_of(gait.vehicle, gait.color, sign, gait.coefficients, zones)


def _region_of(vehicle: Vehicle, color: Any, sign: Any, coefficients: Any, zones: Zones | None) -> tuple[Region, str]:
    """Return where gaits of a color and sign are flyable, or at least valid, and its description."""
    # Nothing is flyable on blue; limits of thrust need the mass.
    judged = color == "red" and (vehicle.max_thrust is None or vehicle.mass is not None)
    use: Any = "flyable" if judged else "valid"
    found = admissible_region(
        vehicle, use=use, color=color, sign=sign, coefficients=coefficients, zones=zones, accuracy=_COARSE
    )
    which = {"positive": " with R > 0", "negative": " with R < 0", None: ""}[sign]
    return found, f"shaded: where a {color} gait{which} is {use}" + (", with the given polygons" if zones else "")


def _draw_plane(
    ax: Axes, *, gait: Gait | None = None, waypoints: Sequence[Sequence[float]] = (), region: Region | None = None
) -> None:
    """Draw a region, a gait's loop and waypoints in the (α1, α2) plane."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    for part in () if region is None else region.components[:_MOST_SHOWN]:
        rings = [np.asarray(ring.coords) for ring in (part.exterior, *part.interiors)]
        outline = Path.make_compound_path(*(Path(ring, closed=True) for ring in rings))
        ax.add_patch(PathPatch(outline, facecolor="0.9", edgecolor=GREY, linewidth=0.5))
    plane_axes(ax, r"\alpha_1", r"\alpha_2", divisor=2)
    if gait is not None:
        gait_loop(gait, ax=ax)
        end = max(np.pi / 2, float(np.abs(gait.alpha[:, :2]).max()))
        ax.set(xlim=(-end, end), ylim=(-end, end))
    if len(waypoints):
        points = np.array([point[:2] for point in waypoints[:_MOST_SHOWN]], dtype=float)
        ax.plot(*points.T, "o", markersize=6, markerfacecolor="none", markeredgecolor="black", zorder=5)


def _draw_from_above(ax: Axes, vehicle: Vehicle) -> None:
    seen = vehicle_view(np.zeros(4), vehicle, view=FROM_ABOVE)
    low, high = seen.limits()
    ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    ax.set_aspect("equal")
    ax.set_axis_off()
    draw_vehicle(ax, seen)


def _picture(draw: Callable[[Axes], None], words: str) -> str:
    """Return a small picture as an HTML element, or "" without matplotlib."""
    try:
        with paper_style():
            figure = blank_figure(70, 62)
            draw(figure.add_subplot())
            content = base64.b64encode(picture_bytes(figure, "png")).decode("ascii")
    except MissingExtra:
        return ""
    # Half as wide as its pixels, to be sharp on screens of high resolution.
    return f'<img alt="{escape(words)}" width="276" src="data:image/png;base64,{content}">'
