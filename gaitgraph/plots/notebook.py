"""How gaits, timed gaits, plans, reports, regions and vehicles look in a notebook.

An object is its heading, a small table and a few lines, beside a picture where matplotlib is installed. Names and
messages are the user's text, which is escaped.
"""

from __future__ import annotations

import base64
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitgraph.angles import text_from_angle
from gaitgraph.errors import MissingConstant, MissingExtra
from gaitgraph.gait.gait import Gait
from gaitgraph.invertibility.matrices import coefficients_of
from gaitgraph.plots.axes import GREY, axes_or_new, blank_figure, paper_style, picture_bytes, plane_axes
from gaitgraph.plots.gaits import draw_angles, gait_loop
from gaitgraph.plots.vehicles import FROM_ABOVE, draw_vehicle, vehicle_view
from gaitgraph.surface.admissible import admissible_region
from gaitgraph.surface.region import Region
from gaitgraph.timing.timed_gait import TimedGait
from gaitgraph.validation.report import Report, verdict_line
from gaitgraph.vehicle import Vehicle, constants_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from matplotlib.axes import Axes

    from gaitgraph.planning.planner import Plan
    from gaitgraph.surface.region import Zones

_MOST_CHECKED = 2000  # corners that are judged in passing; that takes a tenth of a second
_MOST_ROWS = 6
_MOST_WAYPOINTS = 60
_COARSE = 1e-3  # of the borders of a region in a small picture [rad]


def html_of(shown: Gait | TimedGait | Plan | Report | Region | Vehicle) -> str:
    """Return an object as HTML that can stand anywhere in a page, and twice.

    >>> from gaitgraph.vehicle import PAPER
    >>> "<td>first rotor spin</td><td>clockwise</td>" in html_of(PAPER)
    True
    """
    title, *rest = str(shown).splitlines()
    lines: list[str] = []
    rows: list[tuple[str, ...]]
    if isinstance(shown, Vehicle):
        title += f", δ = {coefficients_of(shown, 'exact').delta:.6g} rad"
        table = _table(constants_of(shown))
        picture = _picture(lambda ax: _draw_from_above(ax, shown), "its arms from above")
    elif isinstance(shown, Region):
        rows = []
        for k, part in enumerate(shown.components, 1):
            left, below, right, above = part.bounds
            extent = f"α1 {left:.4f} to {right:.4f}, α2 {below:.4f} to {above:.4f}"
            rows.append((str(k), f"{part.area:.3g} rad²", extent))
        table, lines = _table(rows, ("component", "area", "extent [rad]")), rest[-1:] if shown.conditions else []
        picture = _picture(lambda ax: _draw_plane(ax, region=shown), title)
    elif isinstance(shown, Report):
        title, table, picture = _verdict(shown), _checks(shown), ""
        lines = [f"from hover: {shown.reachability}", *(f"warning: {note}" for note in shown.notes)]
        if shown.listing is not None:
            lines.insert(1, f"colorings: {shown.listing}")
    elif isinstance(shown, TimedGait):
        table, lines = f"<pre>{escape(chr(10).join(rest[2:-1]))}</pre>", [rest[0], rest[-1].strip()]
        picture = _picture(lambda ax: draw_angles(ax, shown.t, shown.alpha), "its tilt angles over one period")
    elif isinstance(shown, Gait):
        rows = [(str(k), *map(text_from_angle, alpha)) for k, alpha in enumerate(shown.alpha.tolist(), 1)]
        head: tuple[str, ...] = ("corner", "α1", "α2", "α3", "α4")
        if shown.colors:
            head, rows = (*head, "types"), [(*row, types) for row, types in zip(rows, shown.types, strict=True)]
        region, words = _region_under(shown)
        table, lines = _table(rows, head), [rest[0], *_judged(shown), words]
        picture = _picture(lambda ax: _draw_plane(ax, gait=shown, region=region), words)
    else:
        return _html_of_plan(shown)
    return _page(title, picture, table, lines)


def _html_of_plan(plan: Plan) -> str:
    title, setting, loop = plan.headline, plan.setting, plan.loop
    others = [_alternative(other) for other in plan.alternatives]
    request = plan.request
    if loop is None:
        color = "blue" if request.color == "blue" else "red"
        sign = None if request.sign == "auto" else request.sign
        coefficients = coefficients_of(request.vehicle, request.coefficients)
        region: Region | None
        region, words = _region_of(request.vehicle, color, sign, coefficients, request.zones)
        table, gait, warnings = "", None, list(plan.warnings)
        lines = list(dict.fromkeys(obstacle.message for obstacle in plan.obstacles))
    else:
        region, words = _region_under(loop.gait, request.zones)
        table, gait, lines = _checks(loop.report), loop.gait, [_verdict(loop.report)]
        # A warning that a check has already is not repeated.
        warnings = [warning for warning in plan.warnings if warning not in loop.report.warnings]
    picture = _picture(lambda ax: _draw_plane(ax, gait=gait, waypoints=plan.waypoints, region=region), words)
    lines = [setting, *lines, *others, *(f"warning: {warning}" for warning in warnings), f"{words}; rings: waypoints"]
    return _page(title, picture, table, lines)


def _alternative(loop: Any) -> str:
    verdict = "flyable" if loop.report.flyable else "valid, not flyable" if loop.report.valid else "not valid"
    sign = ">" if loop.sign == "positive" else "<"
    return f"alternative: {loop.color}, R {sign} 0, {loop.length:.4f} rad, {verdict}"


def _verdict(report: Report) -> str:
    return verdict_line(report.valid, report.flyable, report.reachable_from_hover)


def _judged(gait: Gait) -> list[str]:
    """Return the verdict on a gait and the first reason against it, or why it is not judged."""
    if len(gait.alpha) > _MOST_CHECKED:
        return [f"not judged here, with more than {_MOST_CHECKED} corners; check() does"]
    try:
        report = gait.check()
    except MissingConstant as error:
        return [f"not judged: {error}"]
    return [_verdict(report), *([report.reason] if report.reason else [])]


def _region_under(gait: Gait, zones: Zones | None = None) -> tuple[Region | None, str]:
    """Return the region to draw under a gait's loop, and what it is."""
    if gait.color not in ("red", "blue"):
        return None, "its loop in the plane of α1 and α2"
    sign = "positive" if gait.R.min() > 0 else "negative" if gait.R.max() < 0 else None
    return _region_of(gait.vehicle, gait.color, sign, gait.coefficients, zones)


def _region_of(vehicle: Vehicle, color: Any, sign: Any, coefficients: Any, zones: Zones | None) -> tuple[Region, str]:
    """Return where gaits of a color and sign are flyable, or at least valid, and what that is in words."""
    # On blue nothing is flyable; without a mass, limits of thrust cannot be judged.
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

    for part in () if region is None else region.components[:_MOST_WAYPOINTS]:
        rings = [np.asarray(ring.coords) for ring in (part.exterior, *part.interiors)]
        outline = Path.make_compound_path(*(Path(ring, closed=True) for ring in rings))
        ax.add_patch(PathPatch(outline, facecolor="0.9", edgecolor=GREY, linewidth=0.5))
    plane_axes(ax, r"\alpha_1", r"\alpha_2", divisor=2)
    if gait is not None:
        gait_loop(gait, ax=ax)
        end = max(np.pi / 2, float(np.abs(gait.alpha[:, :2]).max()))
        ax.set(xlim=(-end, end), ylim=(-end, end))
    if len(waypoints):
        points = np.array([point[:2] for point in waypoints[:_MOST_WAYPOINTS]], dtype=float)
        ax.plot(*points.T, "o", markersize=6, markerfacecolor="none", markeredgecolor="black", zorder=5)


def _draw_from_above(ax: Axes, vehicle: Vehicle) -> None:
    seen = vehicle_view(np.zeros(4), vehicle, view=FROM_ABOVE)
    low, high = seen.limits()
    ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    ax.set_aspect("equal")
    ax.set_axis_off()
    draw_vehicle(ax, seen)


def _picture(draw: Callable[[Axes], None], words: str) -> str:
    """Return a small picture as an element, "" where matplotlib is not installed."""
    try:
        with paper_style():
            figure = blank_figure(70, 62)
            draw(axes_or_new(figure.add_subplot()))
            content = base64.b64encode(picture_bytes(figure, "png")).decode("ascii")
    except MissingExtra:
        return ""
    # Half as wide as its pixels: sharp on screens of a high resolution too.
    return f'<img alt="{escape(words)}" width="276" src="data:image/png;base64,{content}">'


def _table(rows: Sequence[Sequence[str]], head: Sequence[str] = ()) -> str:
    """Return a table of the first rows; all of them where it has no head."""
    shown = rows[:_MOST_ROWS] if head else rows
    top = "".join(f'<th scope="col">{escape(name)}</th>' for name in head)
    body = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in shown)
    more = f"<div>… and {len(rows) - len(shown)} more</div>" if len(rows) > len(shown) else ""
    return f"<table>{f'<tr>{top}</tr>' if head else ''}{body}</table>{more}"


def _checks(report: Report) -> str:
    return _table([(check.mark, check.name.replace("_", " "), check.message) for check in report.checks])


def _page(title: str, picture: str, table: str, lines: Iterable[str]) -> str:
    text = "".join(f"<div>{escape(line)}</div>" for line in lines)
    box = f'<div style="flex:1 1 24em;min-width:0"><div><strong>{escape(title)}</strong></div>{table}{text}</div>'
    return f'<div style="display:flex;flex-wrap:wrap;gap:4px 20px">{picture}{box}</div>'
