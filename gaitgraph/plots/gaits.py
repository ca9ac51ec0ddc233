"""Pictures of gaits, plans, reports, regions and vehicles, singular attitudes (Figures 17 to 22), basins; and HTML.

Without matplotlib the HTML has no picture. All its text is escaped.
"""

from __future__ import annotations

import base64
import math
import re
from functools import singledispatch
from html import escape
from itertools import groupby, permutations
from textwrap import fill, shorten
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import shapely

from gaitgraph.angles import HALF_PI, checked_number, is_list, percent, whole_number
from gaitgraph.errors import InputError, shown as shown_value, wrong
from gaitgraph.flight.flight import Flight
from gaitgraph.gait.gait import Gait
from gaitgraph.gait.given import given_gait
from gaitgraph.gait.table import Table, surface_of, tilt_angles
from gaitgraph.invertibility import matrices
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.io.columns import checked_table
from gaitgraph.pictured import Pictured
from gaitgraph.planning.location import Location
from gaitgraph.planning.planner import Plan
from gaitgraph.plots import axes as base
from gaitgraph.plots.planes import FINE, draw_zeros_of_R
from gaitgraph.plots.vehicles import FROM_ABOVE, draw_vehicle, vehicle_view
from gaitgraph.robustness.biased import Robustness, RobustnessReport, robustness_of
from gaitgraph.robustness.comparing import Comparison
from gaitgraph.surface.admissible import admissible_region
from gaitgraph.surface.region import Region, Requirement, Zones
from gaitgraph.surface.sheets import RELATION, sheet_angles
from gaitgraph.timing.timed_gait import TimedGait
from gaitgraph.tolerances import DEFAULT_FLOOR
from gaitgraph.validation.report import Report
from gaitgraph.vehicle import Vehicle

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from gaitgraph.flight.basins import Basin
    from gaitgraph.flight.flight import Outcome
    from gaitgraph.gait.given import GaitLike
    from gaitgraph.invertibility.coefficients import Coefficients, CoefficientsLike
    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.surface.sheets import Color, Sign

    Shown = Pictured

_DASHES: dict[str, Any] = {
    "blue": (0, (3, 1.2)),
    "none": (0, (1, 1)),
}  # "none": off the surfaces
_PALE = {"red": "#fcd4cd", "blue": "#9fb3e8"}
_SIDE = HALF_PI - 1e-6
_INSIDE = shapely.box(-_SIDE, -_SIDE, _SIDE, _SIDE)
"""The roll–pitch square without its sides."""
_MOST_SHOWN = 60  # parts of a region
_COARSE = 1e-3  # accuracy of the borders of a drawn region [rad]
_MARKS = {"ok": ("yes", "✓"), "NO": ("no", "✗"), "??": ("partly", "?")}


def gait_loop(
    gait: GaitLike,
    *,
    angles: tuple[int, int] = (1, 2),
    label: str | None = None,
    width: float = 1.6,
    band: bool = False,
    ax: Axes | None = None,
) -> Axes:
    """Draw the projection of a gait on the plane of two of its angles, with an arrow in its direction (Figure 17).

    Red segments are solid, blue ones dashed, segments off the surfaces black and dotted. A gait of one point is a mark.

    `angles` are two of 1 to 4, `label` is the text in a legend, `width` is in points. With `band` the loop is a pale
    band below all marks, for a map with labels. `ax` are axes such as those of :func:`type_map`; by default new ones.
    """
    pairs: list[Any] = list(permutations((1, 2, 3, 4), 2))
    if not is_list(angles) or tuple(angles) not in pairs:
        raise wrong("angles", "must be a pair of different ones of 1 to 4", angles)
    checked_number("width", width)
    gait = given_gait(gait).gait
    is_new = ax is None
    ax = base.axes_or_new(ax)
    first, second = angles
    columns = [first - 1, second - 1]
    starts, ends = gait.alpha[:, columns], gait.ends[:, columns]
    colors = gait.colors or ("none",) * len(starts)
    inks = [base.COLOR_OF.get(color, "black") for color in colors]
    if len(starts) == 1:
        x, y = starts[0]
        marker = base.MARKER_OF.get(colors[0], "D")
        ax.plot(x, y, marker, color=inks[0], label=label)
    begin = 0
    for color, run in groupby(colors):
        end = begin + len(list(run))
        points = np.concatenate([starts[begin:end], ends[end - 1 : end]])
        look: dict[str, Any] = {"color": inks[begin], "zorder": 4}
        look["linestyle"] = _DASHES.get(color, "-")
        if band:
            look = {"color": _PALE.get(color, "0.8"), "zorder": 1.2}
        ax.plot(
            points[:, 0],
            points[:, 1],
            linewidth=width,
            label=label,
            **look,
        )
        label = None
        begin = end
    steps = ends - starts
    lengths = np.linalg.norm(steps, axis=1)
    longest = int(np.argmax(lengths.round(6)))
    if lengths[longest] > 0:
        # The arrow is off the middle, where a grid node may be.
        tail = starts[longest] + 0.36 * steps[longest]
        head = tail + 0.03 * steps[longest]
        size = 14 if band else 6 + 4 * width
        base.draw_arrow(ax, tail, head, inks[longest], width=0.0, size=size)
    if is_new:
        base.plane_axes(ax, rf"\alpha_{first}", rf"\alpha_{second}")
    return ax


def roll_pitch_diagram(
    gait: GaitLike,
    *,
    bias: float | None = None,
    name: str = "gait",
    count: int = 48,
    coefficients: CoefficientsLike | None = None,
    angle_rounding: float | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw the attitudes at which a gait is singular, and those of its biased gait (Figures 18 to 22).

    As in the paper the gait is red and solid, its biased gait blue and dashed. Thin lines are the singular attitudes at
    `count` places spread evenly over the gait. Shaded are the attitudes around level flight at which it is never
    singular. Numbers and words are those of :func:`gaitgraph.robustness_of`, which explains `coefficients` ("exact" by
    default, "printed" for those of the paper's figures) and `angle_rounding`.

    `bias` is η of the biased gait, equations (14) and (15); without it only the gait is drawn. `name` is the gait's name
    in the legend. Singular curves have the ``gid`` "singular", shaded areas "acceptable", their borders "border".
    """
    whole_number("count", count, 1, 10_000)
    report = robustness_of(
        gait,
        bias=() if bias is None else bias,
        tilt=0.0,
        curves=count,
        coefficients=coefficients,
        angle_rounding=angle_rounding,
    )
    ax = base.axes_or_new(ax)
    draw_robustness(ax, report, name)
    return ax


def draw_robustness(ax: Axes, report: RobustnessReport, name: str) -> None:
    """Draw the roll–pitch diagram of a gait, and of its biased and scaled gaits; labels say the verdicts."""
    own = report.gait
    draw_attitudes(ax, own, f"{name}:\n{own.verdict}", base.RED)
    for biased in report.sweep:
        scaling = f"$\\eta$ = {biased.factor:g}"
        if biased.scaling == "scaled":
            scaling = biased.name
        label = f"{name}, {scaling}:\n{biased.verdict}"
        draw_attitudes(ax, biased, label, base.BLUE, dash=(0, (3, 1.5)))
    _finish_diagram(ax)


def draw_attitudes(
    ax: Axes, robustness: Robustness, label: str, color: str, *, dash: Any = "-"
) -> None:
    """Draw the singular curves of a gait, and shade the acceptable attitudes.

    The square is hatched if the gait is singular at every attitude.
    """
    from shapely.plotting import patch_from_polygon

    look: dict[str, Any] = {"facecolor": (color, 0.12), "linewidth": 0.0}
    if robustness.tilt_margin is None:
        look |= {"hatch": "xxx", "edgecolor": (color, 0.5), "label": label}
        ax.add_patch(patch_from_polygon(_INSIDE, gid="singular", **look))
        return
    line: dict[str, Any] = {"color": color, "linestyle": dash}
    outline = {"facecolor": (color, 0.12), "edgecolor": color, "linestyle": dash}
    ax.fill([], [], label=label, **outline)  # for the legend
    for _, curve in robustness.curves:
        if curve.kind == "curve":
            roll, pitch = curve.points().T
            ax.plot(
                roll, pitch, linewidth=0.5, alpha=0.8, gid="singular", zorder=2, **line
            )
    polygon = robustness.acceptable.polygon
    ax.add_patch(patch_from_polygon(polygon, gid="acceptable", **look))
    # The border without the sides of the square, where nothing is singular.
    border = shapely.line_merge(polygon.exterior.intersection(_INSIDE))
    for part in shapely.get_parts(border):
        roll, pitch = shapely.get_coordinates(part).T
        ax.plot(
            roll,
            pitch,
            linewidth=2.0,
            gid="border",
            zorder=3,
            **line,
        )


def _finish_diagram(ax: Axes, *, columns: int = 2) -> None:
    """Mark level flight, and label the axes with roll and pitch."""
    ax.plot(0, 0, "k+", markersize=6, zorder=6)
    base.plane_axes(ax, r"\phi", r"\theta", grid=False)
    ax.set(xlabel=r"roll $\phi$ (rad)", ylabel=r"pitch $\theta$ (rad)")
    base.legend_below(ax, columns=columns)


def draw_angles(ax: Axes, time: FloatArray, alpha: FloatArray) -> None:
    """Draw four tilt angles over time [s]."""
    base.draw_four(ax, time, alpha, r"$\alpha_{}$")
    base.angle_axis(ax.yaxis, r"\alpha_i")
    ax.set(xlabel="$t$ (s)")
    ax.margins(x=0.0)
    ax.grid(True)


# Each outcome has its own shape, so that no color is needed; the order is that of flight.flight.OUTCOMES.
OUTCOME_LOOKS: dict[Outcome, dict[str, Any]] = {
    "settled": {"marker": "o", "color": "#009e73"},
    "not settled": {"marker": "D", "color": "#e69f00"},
    "near singular": {"marker": "x", "color": "black"},
    "sign change": {"marker": "*", "color": "black"},
    "tumbling": {"marker": "v", "color": "#cc79a7"},
    "upended": {"marker": "^", "color": "#56b4e9"},
    "refused": {"marker": "s", "color": "#8a8a8a"},
}


def basin_map(basin: Basin, *, name: str = "", ax: Axes | None = None) -> Axes:
    """Draw how the flights from each attitude ended, over the roll–pitch diagram of the gait. `name` is in the title.

    Thin lines are attitudes at which the gait is singular at some time, with exact coefficients. The thick line borders
    the acceptable attitudes, at which it never is. Both have the color of the gait's sheet, or are grey. A green disc
    means that all flights from the attitude settled; otherwise the mark is that of the first flight that did not, in
    the order of take-off. Marks have the ``gid`` "outcome".
    """
    ax = base.axes_or_new(ax)
    label = f"acceptable: {basin.inside.sum()} of {basin.inside.size} attitudes"
    color = base.COLOR_OF.get(basin.timed.gait.color or "", base.GREY)
    draw_attitudes(ax, robustness_of(basin.timed, tilt=0.0).gait, label, color)
    size = 4.0 * min(1.0, 17 / len(basin.angles))
    for code, (outcome, look) in enumerate(OUTCOME_LOOKS.items()):
        roll, pitch = np.nonzero(basin.worst == code)
        if len(roll):
            ax.plot(
                basin.angles[roll],
                basin.angles[pitch],
                linestyle="none",
                markersize=size,
                label=f"{outcome}: {len(roll)}",
                gid="outcome",
                zorder=4,
                **look,
            )
    settled = f"{percent(basin.fraction)} of {basin.worst.size} attitudes settled"
    ax.set_title(f"{name or basin.name}\n{settled}")
    _finish_diagram(ax, columns=1)
    return ax


def basins_figure(basins: Sequence[Basin]) -> Figure:
    """Return a figure of basins side by side, four in a row at most."""
    columns = min(len(basins), 4)
    rows = math.ceil(len(basins) / columns)
    figure = base.blank_figure(68.0 * columns, 94.0 * rows)
    for number, basin in enumerate(basins, start=1):
        basin_map(basin, ax=figure.add_subplot(rows, columns, number))
    return figure


def plot(shown: Shown, *, ax: Axes | None = None) -> Axes:
    """Draw an object on two-dimensional axes, by default those of a new figure, 6 by 5 inches, and return the axes.

    A gait or plan is its loop on the map of (α1, α2), where the region for its sheet and sign of R is shaded; a plan
    also has its waypoints, its polygons, and arrows to the nearest admissible points if there is no loop. A timed gait
    is its four angles over time, a table those of its rows over time or row number, a report the part of each limit that the gait uses.
    """
    ax = base.axes_or_new(ax)
    _draw(ax, shown, legend=True)
    title = re.sub(r"-(?=\d)", "−", _title_of(shown))
    ax.set_title(fill(title, 76), fontsize=9)
    return ax


def _title_of(shown: Shown) -> str:
    """Return a title: the first line of the object's text, unless that speaks of a part of the picture alone."""
    if isinstance(shown, Report):
        return shown.verdict
    if isinstance(shown, Comparison):
        return ", ".join(shown.names)
    if isinstance(shown, Location):
        is_empty = not any(place.region.components for place in shown.regions)
        none = ": none" if is_empty else ""
        return f"Admissible regions, vehicle {shown.request.vehicle.name}{none}"
    return str(shown).partition("\n")[0].rstrip(":")


def draw_sheet(
    figure: Figure, gaits: Sequence[TimedGait], names: Sequence[str]
) -> None:
    """Draw the pictures of gaits on an empty figure, a row for each; the scales of a column are the same.

    Physics is exact, and level but for attitudes.
    """
    axes = figure.subplots(len(gaits), len(_PANELS), squeeze=False)
    for (title, draw), column in zip(_PANELS.items(), axes.T, strict=True):
        for timed, name, ax in zip(gaits, names, column, strict=True):
            ax.set_title(fill(f"{name}: {title}", 46), fontsize=9)
            draw(ax, timed, name)
        limits = [ax.get_ylim() for ax in column]
        low, high = np.min(limits), np.max(limits)
        for ax in column:
            ax.set_ylim(low, high)


def _draw_loop(ax: Axes, timed: TimedGait, _: str) -> None:
    _draw_gait_on_map(ax, timed.gait)
    base.legend_below(ax, columns=2)


def _draw_diagram(ax: Axes, timed: TimedGait, name: str) -> None:
    roll_pitch_diagram(timed.gait, name=name, ax=ax)


def _draw_tilts(ax: Axes, timed: TimedGait, _: str) -> None:
    t, alpha = _over_a_period(timed)
    draw_angles(ax, t, alpha)
    base.legend_below(ax, columns=2)


def _draw_thrusts(ax: Axes, timed: TimedGait, _: str) -> None:
    t, alpha = _over_a_period(timed)
    vehicle = timed.gait.vehicle
    if matrices.least_singular_value(alpha, vehicle).min() > 1e-3:
        shares = matrices.hover_thrust_shares(alpha, vehicle)
        base.draw_four(ax, t, shares, "rotor {}")
        if vehicle.thrust_share:
            base.draw_limit(ax, vehicle.thrust_share, "limit")
        ax.set_ylim(bottom=min(0.0, ax.get_ylim()[0]))
    else:
        base.draw_note(ax, "singular in level flight")
    _finish_over_time(ax, timed, "hover thrust (m·g)")


def _draw_singular_value(ax: Axes, timed: TimedGait, _: str) -> None:
    t, alpha = _over_a_period(timed)
    values = matrices.least_singular_value(alpha, timed.gait.vehicle)
    ax.plot(t, values, "k", linewidth=1.6, label="least singular value, level")
    base.draw_limit(ax, DEFAULT_FLOOR, f"floor {DEFAULT_FLOOR:g}")
    ax.set_ylim(0.0, max(0.6, 1.1 * values.max()))
    _finish_over_time(ax, timed, "least singular value")


def _over_a_period(timed: TimedGait) -> tuple[FloatArray, FloatArray]:
    """Return times, and the tilt angles there."""
    t = np.linspace(0.0, timed.period, 2 * FINE)
    return t, timed.at(t).alpha


def _finish_over_time(ax: Axes, timed: TimedGait, label: str) -> None:
    ax.set(xlabel="$t$ (s)", ylabel=label, xlim=(0.0, timed.period))
    ax.grid(True)
    base.legend_below(ax, columns=2)


_PANELS = {
    "loop on the map": _draw_loop,
    "tilt angles": _draw_tilts,
    "hover thrusts": _draw_thrusts,
    "acceptable attitudes": _draw_diagram,
    "least singular value": _draw_singular_value,
}


def html_of(shown: Shown) -> str:
    """Return an object as HTML that can be put anywhere in a page: its text as a small table, and its picture.

    A report has none: its table says what the picture does.
    """
    title, _, text = str(shown).partition("\n")
    picture = ""
    if not isinstance(shown, Report):
        picture, words = _picture(shown)
        if words != title:
            text = f"{text}\n{words}"
    box = f'<div style="flex:1 1 24em;min-width:0"><strong>{escape(title)}</strong>{_table_of(text)}</div>'
    return f'<div style="display:flex;flex-wrap:wrap;align-items:flex-start;gap:4px 20px">{picture}{box}</div>'


def _table_of(text: str) -> str:
    """Return lines of text as an HTML table; two blanks are between cells, and four before a line that goes on."""
    rows: list[list[str]] = []
    for line in filter(str.strip, text.splitlines()):
        cells = re.split(" {2,}", line.strip())
        if not line.startswith("    "):
            rows.append(cells)
        elif len(cells) == 1 and rows:
            rows[-1][-1] += f" {cells[0]}"
        else:  # the first cell is empty
            rows.append(["", *cells])
    columns = max(map(len, rows), default=0)
    table = ""
    for cells in rows:
        span = columns - len(cells) + 1
        table += "<tr>"
        for cell in cells[:-1]:
            table += f"<td>{escape(cell)}</td>"
        last = escape(cells[-1])
        table += f'<td colspan="{span}" style="text-align:left">{last}</td></tr>'
    return f"<table>{table}</table>"


def _picture(shown: Shown) -> tuple[str, str]:
    """Return a small picture as an HTML element and what it shows, or twice "" without one."""
    try:
        with base.paper_style():
            figure = base.blank_figure(70, 62)
            words = _draw(figure.add_subplot(), shown, legend=False)
            content = base64.b64encode(base.picture_bytes(figure, "png")).decode()
    except InputError:  # no matplotlib, or a table without rows of tilt angles
        return "", ""
    # Half as wide as its pixels, to be sharp on screens of high resolution.
    source = f"data:image/png;base64,{content}"
    return f'<img alt="{escape(words)}" width="276" src="{source}">', words


def _draw(ax: Axes, shown: Any, *, legend: bool) -> str:
    """Draw an object, a gait or a plan with a legend if that is asked for, and return what the picture shows."""
    title = str(shown).partition("\n")[0]
    if isinstance(shown, Pictured):
        shown = shown._shown
        if shown is None:
            raise InputError(f"an answer must have a gait to be plotted, got: {title}")
    words = _drawn(shown, ax)
    if legend and isinstance(shown, (Gait, Plan)):
        base.legend_below(ax, columns=2)
    return words or title


@singledispatch
def _drawn(shown: Any, ax: Axes) -> str:
    """Draw an object of one of the kinds below; return what the picture shows, "" for the object's first line."""
    raise InputError(
        "only gaits, tables, plans, reports, other answers, regions and vehicles can be plotted, got "
        f"{shown_value(shown)}"
    )


@_drawn.register(Gait)
def _(gait: Gait, ax: Axes) -> str:
    return _draw_gait_on_map(ax, gait)


@_drawn.register(Plan)
def _(plan: Plan, ax: Axes) -> str:
    request = plan.request
    if plan.loop is not None:
        words = _draw_gait_on_map(ax, plan.loop.gait, request.zones)
    else:
        color: Color = "blue" if request.color == "blue" else "red"
        sign = None if request.sign == "auto" else request.sign
        coefficients = coefficients_of(request.vehicle, request.coefficients)
        words = _draw_map(ax, request.vehicle, color, sign, coefficients, request.zones)
        nearest = plan.refusals[0].moved
        for waypoint, place in zip(plan.waypoints, nearest, strict=False):
            if waypoint != place:
                base.draw_arrow(ax, waypoint, place, base.PALETTE["no"][0])
    for waypoint in plan.waypoints:
        ring: dict[str, Any] = {"markerfacecolor": "none", "label": "waypoints"}
        ax.plot(
            waypoint[0],
            waypoint[1],
            "ko",
            markersize=7,
            zorder=5,
            **ring,
        )
    return f"{words}; rings: waypoints"


@_drawn.register(TimedGait)
def _(timed: TimedGait, ax: Axes) -> str:
    draw_angles(ax, timed.t, timed.alpha)
    base.legend_below(ax, columns=4)
    return ""


@_drawn.register(Table)
def _(shown: Table, ax: Axes) -> str:
    table = checked_table(shown)
    alpha = tilt_angles(table, surface_of(table)[1])
    if "t" in table:
        draw_angles(ax, table["t"], alpha)
    else:
        draw_angles(ax, np.arange(1.0, len(alpha) + 1), alpha)
        ax.set_xlabel("row")
    base.legend_below(ax, columns=4)
    return ""


@_drawn.register(Flight)
def _(flight: Flight, ax: Axes) -> str:
    for name in ("roll", "pitch", "yaw"):
        ax.plot(flight.column("t"), np.degrees(flight.column(name)), label=name)
    ax.set(xlabel="$t$ (s)", ylabel="attitude (°)")
    base.legend_below(ax, columns=3)
    return ""


@_drawn.register(Report)
def _(report: Report, ax: Axes) -> str:
    _draw_checks(ax, report)
    return ""


@_drawn.register(RobustnessReport)
def _(report: RobustnessReport, ax: Axes) -> str:
    draw_robustness(ax, report, "gait")
    return ""


@_drawn.register(Comparison)
def _(comparison: Comparison, ax: Axes) -> str:
    for name, timed in zip(comparison.names, comparison.gaits, strict=True):
        gait_loop(timed.gait, label="_", ax=ax)
        middle = timed.gait.alpha[:, :2].mean(axis=0)
        base.draw_label(ax, middle, name)
    base.plane_axes(ax, r"\alpha_1", r"\alpha_2")
    return ""


@_drawn.register(Region)
def _(region: Region, ax: Axes) -> str:
    _draw_region(ax, region)
    return ""


@_drawn.register(Location)
def _(location: Location, ax: Axes) -> str:
    """Draw admissible regions, their parts with their numbers, and the waypoints."""
    request = location.request
    for place in location.regions:
        vehicle = request.vehicle if place.color == "red" else None
        use = f"{request.require}, {place.color}"
        _draw_region(ax, place.region, vehicle, use)
        for number, part in enumerate(place.region.components, start=1):
            inside = part.representative_point()
            base.draw_label(ax, (inside.x, inside.y), str(number))
    for number, (x, y) in enumerate(request.waypoints, start=1):
        ax.plot(x, y, "ko", markersize=4)
        base.draw_label(ax, (x, y), f"waypoint {number}", va="bottom")
    base.legend_below(ax, columns=2)
    return f"{request.require} regions with the waypoints"


@_drawn.register(Vehicle)
def _(vehicle: Vehicle, ax: Axes) -> str:
    seen = vehicle_view(np.zeros(4), vehicle, view=FROM_ABOVE)
    low, high = seen.limits
    ax.set(
        xlim=(low[0], high[0]),
        ylim=(low[1], high[1]),
        aspect="equal",
    )
    ax.set_axis_off()
    draw_vehicle(ax, seen)
    return ""


def _draw_region(
    ax: Axes, region: Region, vehicle: Vehicle | None = None, use: str = ""
) -> None:
    """Fill a region; with a vehicle in the color of the sign of R on its red sheet. `use` is for the legend."""
    from shapely.plotting import patch_from_polygon

    for part in region.components[:_MOST_SHOWN]:
        face, relation = "0.9", "$R=0$ in exact physics"
        if vehicle is not None:
            inside = part.representative_point()
            face, relation = base.NEGATIVE, "$R<0$"
            opposite = sheet_angles("red", inside.x, inside.y, "exact", vehicle=vehicle)
            alpha = [inside.x, inside.y, *map(float, opposite)]
            if matrices.level_determinant(alpha, "exact", vehicle=vehicle) > 0:
                face, relation = base.POSITIVE, "$R>0$"
        label = f"{use}, {relation}" if use else None
        look = {"facecolor": face, "edgecolor": base.GREY, "linewidth": 0.5}
        ax.add_patch(patch_from_polygon(part, label=label, **look))
    base.plane_axes(ax, r"\alpha_1", r"\alpha_2")


def _draw_gait_on_map(ax: Axes, gait: Gait, zones: Zones | None = None) -> str:
    """Draw a gait on the map of its sheet, and return what is shaded."""
    sign: Sign | None = None
    if gait.R.min() > 0:
        sign = "positive"
    elif gait.R.max() < 0:
        sign = "negative"
    color = gait.color
    if gait.vehicle.asymmetry is not None:
        color = "red"
    words = _draw_map(ax, gait.vehicle, color, sign, gait.coefficients, zones)
    label = f"gait, {gait.sheet_in_words}"
    gait_loop(gait, label=label, width=2.2, ax=ax)
    end = max(HALF_PI, float(np.abs(gait.alpha[:, :2]).max()))
    ax.set(xlim=(-end, end), ylim=(-end, end))
    return words


def _draw_map(
    ax: Axes,
    vehicle: Vehicle,
    color: str | None,
    sign: Sign | None,
    coefficients: Coefficients,
    zones: Zones | None,
) -> str:
    """Shade where a gait of a sheet is admissible, draw where R = 0 and polygons, and return what is shaded."""
    words = "its loop in the plane of α1 and α2"
    if color in ("red", "blue"):
        # Nothing is flyable on blue; limits of thrust need the mass.
        can_be_judged = vehicle.max_thrust is None or vehicle.mass is not None
        require: Requirement = "valid"
        if color == "red" and can_be_judged:
            require = "flyable"
        region = admissible_region(
            vehicle,
            color=cast("Color", color),
            sign=sign,
            coefficients=coefficients,
            require=require,
            zones=zones,
            accuracy=_COARSE,
        )
        words = f"shaded: where a {color} gait"
        if vehicle.asymmetry is not None:
            words = "shaded: where a gait"
        if sign is not None:
            words += f" with {RELATION[sign]}"
        words += f" is {require}"
        if zones:
            words += ", with the given polygons"
        _draw_region(ax, region, vehicle if color == "red" else None, require)
    if color == "red":
        draw_zeros_of_R(ax, vehicle)
        ax.plot(0, 0, "k+", markersize=7, label="all upright")
    base.plane_axes(ax, r"\alpha_1", r"\alpha_2")
    for corners in zones.keep_out if zones else ():
        x, y = np.transpose(corners)
        look: dict[str, Any] = {"facecolor": "white", "edgecolor": base.GREY}
        ax.fill(x, y, label="keep out", hatch="///", **look)
    return words


def _draw_checks(ax: Axes, report: Report) -> None:
    """Draw the part of its limit that each check of a report uses, with its mark and its message."""
    from matplotlib.ticker import PercentFormatter

    for row, check in enumerate(report.checks):
        verdict, mark = _MARKS[check.mark]
        color = base.PALETTE[verdict][0]
        used = 0.0
        if check.value is not None and check.limit:
            used = abs(check.value / check.limit)
            if check.name in ("R_sign", "least_singular_value") and used:
                used = 1.0 / used  # these limits are floors
        ax.barh(row + 0.2, min(used, 1.5), height=0.36, color=color)
        words = shorten(check.message.partition(": ")[0], 84, placeholder=" …")
        look: dict[str, Any] = {"fontsize": 6.5, "va": "center"}
        look["bbox"] = {"facecolor": "white", "edgecolor": "none", "pad": 0.5}
        ax.text(
            0.01,
            row - 0.22,
            words,
            color="0.3",
            gid=check.name,
            **look,
        )
        name = f"{check.name.replace('_', ' ')}  {mark}"
        ax.text(
            -0.02,
            row,
            name,
            color=color,
            fontsize=8,
            ha="right",
            va="center",
        )
    ax.axvline(
        1.0,
        color="black",
        linewidth=0.8,
        linestyle="--",
        zorder=0,
    )
    ax.xaxis.set_major_formatter(PercentFormatter(1.0))
    ax.set(
        xlim=(0.0, 1.5),
        ylim=(len(report.checks) - 0.4, -0.6),
        yticks=[],
        xlabel="part of the limit that is used",
    )
