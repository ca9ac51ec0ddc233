"""Pictures of gaits, plans, reports, regions and vehicles, singular attitudes (Figures 17 to 22), basins; and HTML.

Without matplotlib the HTML has no picture. All its text is escaped.
"""

from __future__ import annotations

import base64
import math
import re
from functools import singledispatch
from html import escape
from itertools import groupby
from textwrap import fill, shorten
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import shapely

from gaitgraph.angles import HALF_PI, checked_number, percent, whole_number
from gaitgraph.errors import InputError, check_kind, shown as shown_value, wrong
from gaitgraph.flight.flight import Flight
from gaitgraph.gait.gait import Gait, name_of
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
from gaitgraph.surface.region import Region, Zones
from gaitgraph.surface.sheets import RELATION, red_label
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
    from gaitgraph.planning.request import PlanRequest

    Shown = Pictured

_DASHES: dict[str, Any] = {
    "blue": (0, (3, 1.2)),
    "none": (0, (1, 1)),
}  # "none": off the surfaces
_PALE = {"red": "#fcd4cd", "blue": "#9fb3e8"}
_INSIDE = shapely.box(
    *(-HALF_PI + 1e-6,) * 2, *(HALF_PI - 1e-6,) * 2
)  # the roll–pitch square without its sides
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
    check_kind("angles", angles, list, tuple)
    if (
        len(angles) != 2
        or angles[0] == angles[1]
        or any(angle not in (1, 2, 3, 4) for angle in angles)
    ):
        raise wrong("angles", "must be two different ones of 1 to 4", angles)
    checked_number("width", width)
    gait = given_gait(gait).gait
    fresh = ax is None
    ax = base.axes_or_new(ax)
    columns = [angle - 1 for angle in angles]
    starts, ends = gait.alpha[:, columns], gait.ends[:, columns]
    colors = gait.colors or ("none",) * len(starts)
    ink = [base.COLOR_OF.get(color, "black") for color in colors]
    if len(starts) == 1:
        ax.plot(
            *starts[0],
            marker=base.MARKER_OF.get(colors[0], "D"),
            color=ink[0],
            linestyle="none",
            label=label,
        )
    closed, k = len(set(colors)) == 1, 0
    for color, run in groupby(colors):
        stop = k + len(list(run))
        look = {"color": ink[k], "linestyle": _DASHES.get(color, "-"), "zorder": 4}
        if band:
            joints = {"solid_joinstyle": "round", "solid_capstyle": "butt"}
            look = {"color": _PALE.get(color, "0.8"), "zorder": 1.2, **joints}
        # A loop of one color ends at its second point, so that its first corner is joined too.
        points = np.concatenate(
            [starts[k:stop], ends[stop - 1 : stop], ends[: int(closed)]]
        )
        ax.plot(*points.T, linewidth=width, label=label if k == 0 else None, **look)
        k = stop
    steps = ends - starts
    lengths = np.linalg.norm(steps, axis=1)
    if lengths.max() > 0:
        # The arrow is on the first long segment, off its middle, where a grid node may be.
        longest = int(np.argmax(lengths > 0.75 * lengths.max()))
        tail = starts[longest] + 0.36 * steps[longest]
        base.draw_arrow(
            ax,
            tail,
            tail + 0.03 * steps[longest],
            ink[longest],
            width=0.0,
            size=14 if band else 6 + 4 * width,
        )
    if fresh:
        base.plane_axes(ax, rf"\alpha_{angles[0]}", rf"\alpha_{angles[1]}")
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
    finish_diagram(ax)


def draw_attitudes(
    ax: Axes, robustness: Robustness, label: str, color: str, *, dash: Any = "-"
) -> None:
    """Draw the singular curves of a gait, and shade the acceptable attitudes.

    The square is hatched if the gait is singular at every attitude.
    """
    if robustness.tilt_margin is None:
        everywhere = np.asarray(_INSIDE.exterior.coords)
        look: dict[str, Any] = {"facecolor": (color, 0.12), "edgecolor": (color, 0.5)}
        look |= {"hatch": "xxx", "linewidth": 0.0, "gid": "singular"}
        ax.fill(*everywhere.T, label=label, **look)
        return
    line: dict[str, Any] = {"color": color, "linestyle": dash}
    for _, curve in robustness.curves:
        if curve.kind == "curve":
            thin: dict[str, Any] = {
                "linewidth": 0.5,
                "alpha": 0.8,
                "gid": "singular",
                "zorder": 2,
            }
            ax.plot(*curve.points().T, **line, **thin)
    polygon = robustness.acceptable.polygon
    shade: Any = "none"
    if not polygon.is_empty:
        shade = (color, 0.12)
        ax.fill(
            *np.asarray(polygon.exterior.coords).T,
            facecolor=shade,
            linewidth=0.0,
            gid="acceptable",
        )
        # The border without the sides of the square, where nothing is singular.
        border = shapely.line_merge(polygon.exterior.intersection(_INSIDE))
        for part in shapely.get_parts(border):
            thick: dict[str, Any] = {"linewidth": 2.0, "gid": "border", "zorder": 3}
            ax.plot(*np.asarray(part.coords).T, **line, **thick)
    outline = {"edgecolor": color, "linestyle": dash, "linewidth": 1.2}
    ax.fill([], [], facecolor=shade, label=label, **outline)  # for the legend


def finish_diagram(ax: Axes) -> None:
    """Mark level flight, and label the axes with roll and pitch."""
    ax.plot(0, 0, marker="+", markersize=6, color="black", linestyle="none", zorder=6)
    base.plane_axes(ax, r"\phi", r"\theta", grid=False)
    ax.set(xlabel=r"roll $\phi$ (rad)", ylabel=r"pitch $\theta$ (rad)")
    base.legend_below(ax, ncols=2)


def draw_angles(ax: Axes, time: FloatArray, alpha: FloatArray) -> None:
    """Draw four tilt angles over time [s]."""
    base.draw_four(ax, time, alpha, r"$\alpha_{}$")
    base.angle_axis(ax.yaxis, r"\alpha_i")
    ax.set(
        xlabel="$t$ (s)",
        xlim=(float(time[0]), float(time[-1])) if time[-1] > time[0] else None,
    )
    ax.grid(True)


# Each outcome has its own shape, so that no color is needed; the order is that of flight.flight.OUTCOMES.
OUTCOME_LOOKS: dict[Outcome, dict[str, Any]] = {
    "settled": {"marker": "o", "color": "#009e73", "markersize": 3.0},
    "not settled": {"marker": "D", "color": "#e69f00", "markersize": 3.4},
    "near singular": {
        "marker": "x",
        "color": "black",
        "markersize": 4.2,
        "markeredgewidth": 1.1,
    },
    "sign change": {
        "marker": "*",
        "color": "black",
        "markersize": 5.2,
        "markeredgewidth": 0.0,
    },
    "tumbling": {"marker": "v", "color": "#cc79a7", "markersize": 4.0},
    "upended": {"marker": "^", "color": "#56b4e9", "markersize": 4.0},
    "refused": {"marker": "s", "color": "#8a8a8a", "markersize": 3.0},
}
_WORDS: dict[Outcome, str] = {
    "sign change": "determinant changed sign",
    "near singular": "stopped near singularity",
}
_FULL_SIZE = 17  # with more attitudes along a side, marks are smaller


def basin_map(basin: Basin, *, name: str = "", ax: Axes | None = None) -> Axes:
    """Draw how the flights from each attitude ended, over the roll–pitch diagram of the gait. `name` is in the title.

    Thin lines are attitudes at which the gait is singular at some time, with exact coefficients. The thick line borders
    the acceptable attitudes, at which it never is. Both have the color of the gait's sheet, or are grey. A green disc
    means that all flights from the attitude settled; otherwise the mark is that of the first flight that did not, in
    the order of take-off. Marks have the ``gid`` "outcome".
    """
    ax = base.axes_or_new(ax)
    label = f"acceptable: {int(basin.inside.sum())} of {basin.inside.size} attitudes"
    color = base.COLOR_OF.get(basin.timed.gait.color or "", base.GREY)
    robustness = robustness_of(basin.timed, tilt=0.0).gait
    draw_attitudes(ax, robustness, label, color)
    finish_diagram(ax)
    smaller = min(1.0, _FULL_SIZE / len(basin.angles))
    for code, (outcome, look) in enumerate(OUTCOME_LOOKS.items()):
        roll, pitch = (basin.worst == code).nonzero()
        if len(roll):
            drawn = look | {
                "markersize": look["markersize"] * smaller,
                "linestyle": "none",
                "zorder": 4,
            }
            label = f"{_WORDS.get(outcome, outcome)}: {len(roll)}"
            ax.plot(
                basin.angles[roll],
                basin.angles[pitch],
                label=label,
                gid="outcome",
                **drawn,
            )
    ax.set_title(
        f"{name or basin.name}\n{percent(basin.fraction)} of {basin.worst.size} attitudes settled"
    )
    base.legend_below(ax)
    return ax


def basins_figure(basins: Sequence[Basin]) -> Figure:
    """Return a figure of basins side by side, four in a row at most."""
    width, height, legend_line = 68.0, 73.0, 4.2  # mm
    columns = min(len(basins), 4)
    figure = base.blank_figure(width * columns, height)
    panels: np.ndarray[Any, Any] = figure.subplots(
        math.ceil(len(basins) / columns), columns, squeeze=False
    )
    for ax, basin in zip(panels.flat, basins, strict=False):
        basin_map(basin, ax=ax)
    for ax in panels.flat[len(basins) :]:
        ax.set_axis_off()
    most = max(len(ax.get_legend().get_texts()) for ax in panels.flat[: len(basins)])
    figure.set_size_inches(
        width * columns / base.INCH,
        len(panels) * (height + legend_line * most) / base.INCH,
    )
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


PANELS = (
    "loop on the map",
    "tilt angles",
    "hover thrusts",
    "acceptable attitudes",
    "least singular value",
)


def draw_panel(timed: TimedGait, panel: str, *, name: str, ax: Axes) -> None:
    """Draw one of the PANELS of a timed gait over a period; physics is exact, and level but for attitudes."""
    gait, vehicle = timed.gait, timed.gait.vehicle
    ax.set_title(fill(f"{name}: {panel}", 46), fontsize=9)
    if panel == "loop on the map":
        _draw(ax, gait, legend=True)
        return
    if panel == "acceptable attitudes":
        roll_pitch_diagram(gait, name=name, ax=ax)
        return
    t = np.linspace(0.0, timed.period, 2 * FINE)
    alpha = timed.at(t).alpha
    value = matrices.least_singular_value(alpha, vehicle)
    if panel == "tilt angles":
        draw_angles(ax, t, alpha)
    elif panel == "least singular value":
        line: dict[str, Any] = {"color": "black", "linewidth": 1.6}
        ax.plot(t, value, label="least singular value, level", **line)
        base.draw_limit(ax, DEFAULT_FLOOR, f"floor {DEFAULT_FLOOR:g}")
        most = max(0.6, 1.1 * float(value.max()))
        ax.set(ylabel="least singular value", ylim=(0.0, most))
    elif value.min() > 1e-3:
        shares = matrices.hover_thrust_shares(alpha, vehicle)
        base.draw_four(ax, t, shares, "rotor {}")
        if vehicle.thrust_share:
            base.draw_limit(ax, vehicle.thrust_share, "limit")
        ax.set(ylabel="hover thrust (m·g)", ylim=(min(0.0, ax.get_ylim()[0]), None))
    else:
        base.draw_note(ax, "singular in level flight")
    ax.set(xlabel="$t$ (s)", xlim=(0.0, timed.period))
    ax.grid(True)
    base.legend_below(ax, ncols=2)


def draw_sheet(
    figure: Figure, gaits: Sequence[TimedGait], names: Sequence[str] = ("",)
) -> None:
    """Draw the panels of gaits on an empty figure, a row for each; the scales of a column are the same."""
    axes = figure.subplots(len(gaits), len(PANELS), squeeze=False)
    for panel, column in zip(PANELS, axes.T, strict=True):
        for timed, name, ax in zip(gaits, names, column, strict=True):
            draw_panel(timed, panel, name=name or name_of(timed.gait), ax=ax)
        for ax in column:
            ax.set_ylim(
                min(one.get_ylim()[0] for one in column),
                max(one.get_ylim()[1] for one in column),
            )


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
    for *cells, last in rows:
        span = columns - len(cells)
        table += "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in cells)
        table += (
            f'<td colspan="{span}" style="text-align:left">{escape(last)}</td></tr>'
        )
    return f"<table>{table}</table>"


def _picture(shown: Shown) -> tuple[str, str]:
    """Return a small picture as an HTML element and what it shows, or twice "" without one."""
    try:
        with base.paper_style():
            figure = base.blank_figure(70, 62)
            words = _draw(figure.add_subplot(), shown, legend=False)
            content = base64.b64encode(base.picture_bytes(figure, "png")).decode(
                "ascii"
            )
    except InputError:  # no matplotlib, or a table without rows of tilt angles
        return "", ""
    # Half as wide as its pixels, to be sharp on screens of high resolution.
    return (
        f'<img alt="{escape(words)}" width="276" src="data:image/png;base64,{content}">',
        words,
    )


def _draw(ax: Axes, shown: Any, *, legend: bool) -> str:
    """Draw an object, a gait or a plan with a legend if that is asked for, and return what the picture shows."""
    title = str(shown).partition("\n")[0]
    if isinstance(shown, Pictured):
        shown = shown._shown
        if shown is None:
            raise InputError(f"an answer must have a gait to be plotted, got: {title}")
    words = _drawn(shown, ax)
    if legend and isinstance(shown, (Gait, Plan)):
        base.legend_below(ax, ncols=2)
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
        words = _draw_map(ax, _sheet_of_request(request), request.zones)
        nearest = plan.refusals[0].moved
        for waypoint, place in zip(plan.waypoints, nearest, strict=False):
            if waypoint != place:
                base.draw_arrow(ax, waypoint, place, base.PALETTE["no"][0])
    if not plan.waypoints:
        return words
    points = np.array([point[:2] for point in plan.waypoints], dtype=float)
    ring: dict[str, Any] = {"markerfacecolor": "none", "markeredgecolor": "black"}
    ax.plot(*points.T, "o", label="waypoints", markersize=7, zorder=5, **ring)
    return f"{words}; rings: waypoints"


@_drawn.register(TimedGait)
def _(timed: TimedGait, ax: Axes) -> str:
    draw_angles(ax, timed.t, timed.alpha)
    base.legend_below(ax, ncols=4)
    return ""


@_drawn.register(Table)
def _(shown: Table, ax: Axes) -> str:
    table = checked_table(shown)
    alpha = tilt_angles(table, surface_of(table)[1])
    places = table["t"] if "t" in table else np.arange(1.0, len(alpha) + 1)
    draw_angles(ax, places, alpha)
    ax.set_xlabel("$t$ (s)" if "t" in shown else "row")
    base.legend_below(ax, ncols=4)
    return ""


@_drawn.register(Flight)
def _(flight: Flight, ax: Axes) -> str:
    for name in ("roll", "pitch", "yaw"):
        ax.plot(flight.column("t"), np.degrees(flight.column(name)), label=name)
    ax.set(xlabel="$t$ (s)", ylabel="attitude (°)")
    base.legend_below(ax, ncols=3)
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
        _draw_region(
            ax,
            place.region,
            request.vehicle if place.color == "red" else None,
            f"{request.require}, {place.color}",
        )
        for number, part in enumerate(place.region.components, start=1):
            base.draw_label(ax, part.representative_point().coords[0], str(number))
    for number, waypoint in enumerate(request.waypoints, start=1):
        words = f"waypoint {number}"
        look: dict[str, Any] = {"textcoords": "offset points", "ha": "center"}
        ax.annotate(words, waypoint, (0, 6), **look)
        ax.plot(*waypoint, "ko", markersize=4)
    base.legend_below(ax, ncols=2)
    return f"{request.require} regions with the waypoints"


@_drawn.register(Vehicle)
def _(vehicle: Vehicle, ax: Axes) -> str:
    seen = vehicle_view(np.zeros(4), vehicle, view=FROM_ABOVE)
    low, high = seen.limits
    ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
    ax.set_axis_off()
    draw_vehicle(ax, seen)
    return ""


def _draw_region(
    ax: Axes, region: Region, vehicle: Vehicle | None = None, use: str = ""
) -> None:
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
            if positive:
                face, label = (base.POSITIVE, f"{use}, $R>0$")
            else:
                face, label = (base.NEGATIVE, f"{use}, $R<0$")
        named = "_" if label in labels else label
        labels.add(label)
        ax.add_patch(
            PathPatch(
                outline, facecolor=face, edgecolor=base.GREY, linewidth=0.5, label=named
            )
        )
    base.plane_axes(ax, r"\alpha_1", r"\alpha_2")


class _Sheet(NamedTuple):
    """The sheet over whose map a loop is drawn."""

    vehicle: Vehicle
    color: str | None
    sign: str | None  # of R, if it has one
    coefficients: Coefficients


def _sheet_of_gait(gait: Gait) -> _Sheet:
    sign = None
    if gait.R.min() > 0:
        sign = "positive"
    elif gait.R.max() < 0:
        sign = "negative"
    return _Sheet(gait.vehicle, gait.color, sign, gait.coefficients)


def _sheet_of_request(request: PlanRequest) -> _Sheet:
    vehicle = request.vehicle
    color = "blue" if request.color == "blue" else "red"
    sign = request.sign if request.sign in RELATION else None
    return _Sheet(vehicle, color, sign, coefficients_of(vehicle, request.coefficients))


def _draw_gait_on_map(ax: Axes, gait: Gait, zones: Zones | None = None) -> str:
    """Draw a gait on the map of its sheet, and return what is shaded."""
    words = _draw_map(ax, _sheet_of_gait(gait), zones)
    label = f"gait, {gait.sheet_in_words}"
    gait_loop(gait, label=label, width=2.2, ax=ax)
    end = max(HALF_PI, float(np.abs(gait.alpha[:, :2]).max()))
    ax.set(xlim=(-end, end), ylim=(-end, end))
    return words


def _draw_map(ax: Axes, sheet: _Sheet, zones: Zones | None) -> str:
    """Shade where a gait of a sheet is admissible, draw where R = 0 and polygons, and return what is shaded."""
    vehicle, color = sheet.vehicle, sheet.color
    words = "its loop in the plane of α1 and α2"
    if color in ("red", "blue"):
        # Nothing is flyable on blue; limits of thrust need the mass.
        can_be_judged = vehicle.max_thrust is None or vehicle.mass is not None
        require = "flyable" if color == "red" and can_be_judged else "valid"
        conditions: dict[str, Any] = sheet._asdict() | {"require": require}
        region = admissible_region(zones=zones, accuracy=_COARSE, **conditions)
        sign = "" if sheet.sign is None else f" with {RELATION[sheet.sign]}"
        words = f"shaded: where a {color} gait{sign} is {require}"
        words += ", with the given polygons" if zones else ""
        _draw_region(ax, region, vehicle if color == "red" else None, require)
    if color == "red":
        draw_zeros_of_R(ax, vehicle)
        ax.plot(0, 0, "k+", markersize=7, label="all upright")
    base.plane_axes(ax, r"\alpha_1", r"\alpha_2")
    for k, corners in enumerate(zones.keep_out if zones else ()):
        look: dict[str, Any] = {"facecolor": "white", "edgecolor": base.GREY}
        label = "_" if k else "keep out"
        ax.fill(*np.asarray(corners).T, label=label, hatch="///", **look)
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
        box = {"facecolor": "white", "edgecolor": "none", "pad": 0.5}
        look: dict[str, Any] = {"va": "center", "gid": check.name}
        ax.text(0.01, row - 0.22, words, fontsize=6.5, color="0.3", bbox=box, **look)
        name = f"{check.name.replace('_', ' ')}  {mark}"
        ax.text(-0.02, row, name, color=color, fontsize=8, ha="right", va="center")
    ax.axvline(1.0, color="black", linewidth=0.8, linestyle="--")
    ax.xaxis.set_major_formatter(PercentFormatter(1.0))
    ax.set(
        xlim=(0.0, 1.5),
        ylim=(len(report.checks) - 0.4, -0.6),
        yticks=[],
        xlabel="part of the limit that is used",
    )
