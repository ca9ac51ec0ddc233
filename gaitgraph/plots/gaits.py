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
from gaitgraph.plots.vehicles import (
    FROM_ABOVE,
    draw_vehicle,
    show_whole,
    vehicle_view,
)
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

# "none": off the surfaces
_DASHES: dict[str, Any] = {"red": "-", "blue": (0, (3, 1.2)), "none": (0, (1, 1))}
_PALE = {"red": "#fcd4cd", "blue": "#9fb3e8", "none": "0.8"}
_SIDE = HALF_PI - 1e-5
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
    width = checked_number("width", width)
    gait = given_gait(gait).gait
    is_new = ax is None
    ax = base.axes_or_new(ax)
    first, second = angles
    columns = [first - 1, second - 1]
    starts, ends = gait.alpha[:, columns], gait.ends[:, columns]
    colors = gait.colors or ("none",) * len(starts)
    inks = [base.COLOR_OF.get(color, "black") for color in colors]
    if len(starts) == 1:
        marker = base.MARKER_OF.get(colors[0], "D")
        ax.plot(*starts[0], marker, color=inks[0], label=label)
    begin = 0
    for color, run in groupby(colors):
        end = begin + len(list(run))
        x, y = np.vstack([starts[begin:end], ends[end - 1]]).T
        look: dict[str, Any] = {"color": inks[begin], "linestyle": _DASHES[color]}
        if band:
            look = {"color": _PALE[color]}
        height = 1.2 if band else 4
        ax.plot(
            x,
            y,
            linewidth=width,
            zorder=height,
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
    count = whole_number("count", count, 1, 10_000)
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


def draw_robustness(ax: Axes, report: RobustnessReport, name: str = "gait") -> None:
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
    # For the legend.
    ax.fill(
        [],
        [],
        fc=(color, 0.12),
        ec=color,
        linestyle=dash,
        label=label,
    )
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


# Each outcome has its own shape, so that no color is needed; the order is that of flight.flight.OUTCOMES.
OUTCOME_LOOKS: dict[Outcome, tuple[str, str]] = {
    "settled": ("o", "#009e73"),
    "not settled": ("D", "#e69f00"),
    "near singular": ("x", "black"),
    "sign change": ("*", "black"),
    "tumbling": ("v", "#cc79a7"),
    "upended": ("^", "#56b4e9"),
    "refused": ("s", "#8a8a8a"),
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
    for code, (outcome, (marker, ink)) in enumerate(OUTCOME_LOOKS.items()):
        roll, pitch = basin.angles[np.argwhere(basin.worst == code)].T
        if len(roll):
            ax.plot(
                roll,
                pitch,
                marker,
                color=ink,
                markersize=size,
                label=f"{outcome}: {len(roll)}",
                gid="outcome",
                zorder=4,
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


def draw_sheet(
    figure: Figure, gaits: Sequence[TimedGait], names: Sequence[str]
) -> None:
    """Draw the sets of gaits on an empty figure, a row for each; the scales of a column are the same."""
    axes = figure.subplots(len(gaits), 5, squeeze=False)
    for row, timed, name in zip(axes, gaits, names, strict=True):
        _draw_set(row, timed, name)
    for column in axes.T:
        limits = [ax.get_ylim() for ax in column]
        for ax in column:
            ax.set_ylim(np.min(limits), np.max(limits))


def _draw_set(axes: Sequence[Axes], timed: TimedGait, name: str) -> None:
    """Draw a gait on five axes. Physics is exact, and level but for attitudes."""
    loop, tilts, thrusts, attitudes, least = axes
    titles = {
        loop: "loop on the map",
        tilts: "tilt angles",
        thrusts: "hover thrusts",
        attitudes: "acceptable attitudes",
        least: "least singular value",
    }
    for ax, title in titles.items():
        ax.set_title(fill(f"{name}: {title}", 46), fontsize=9)
    vehicle = timed.gait.vehicle
    t = np.linspace(0.0, timed.period, 2 * FINE)
    alpha = timed.at(t).alpha
    values = matrices.least_singular_value(alpha, vehicle)
    _draw_gait_on_map(timed.gait, loop)
    _draw_angles(tilts, t, alpha)
    if values.min() > 1e-3:
        shares = matrices.hover_thrust_shares(alpha, vehicle)
        base.draw_four(thrusts, t, shares, "rotor {}")
        if vehicle.thrust_share:
            base.draw_limit(thrusts, vehicle.thrust_share, "limit")
        thrusts.set_ylim(bottom=min(0.0, thrusts.get_ylim()[0]))
    else:
        base.draw_note(thrusts, "singular in level flight")
    roll_pitch_diagram(timed.gait, name=name, ax=attitudes)
    least.plot(t, values, "k", linewidth=1.6, label="least singular value, level")
    base.draw_limit(least, DEFAULT_FLOOR, f"floor {DEFAULT_FLOOR:g}")
    least.set_ylim(0.0, max(0.6, 1.1 * values.max()))
    for ax, label in ((thrusts, "hover thrust (m·g)"), (least, "least singular value")):
        ax.set(
            xlabel="$t$ (s)",
            ylabel=label,
            xlim=(0.0, timed.period),
        )
        ax.grid(True)
    for ax in (loop, tilts, thrusts, least):
        base.legend_below(ax, columns=2)


def plot(shown: Shown, *, ax: Axes | None = None) -> Axes:
    """Draw an object on two-dimensional axes, by default those of a new figure, 6 by 5 inches, and return the axes.

    A gait or plan is its loop on the map of (α1, α2), where the region for its sheet and sign of R is shaded; a plan
    also has its waypoints, its polygons, and arrows to the nearest admissible points if there is no loop. A timed gait
    is its four angles over time, a table those of its rows over time or row number, a report the part of each limit that the gait uses.
    """
    ax = base.axes_or_new(ax)
    answer = _answer_of(shown)
    _drawn(answer, ax)
    if isinstance(answer, (Gait, Plan)):
        base.legend_below(ax, columns=2)
    title = str(shown).partition("\n")[0].rstrip(":")
    width = 76
    if isinstance(shown, Report):
        title = shown.verdict
        width = 64  # beside the names of the checks there is less room
    elif isinstance(shown, Comparison):
        title = ", ".join(shown.names)
    elif isinstance(shown, Location):
        title = f"Admissible regions, vehicle {shown.request.vehicle.name}"
        if not any(place.region.components for place in shown.regions):
            title += ": none"
    ax.set_title(fill(re.sub(r"-(?=\d)", "−", title), width), fontsize=9)
    return ax


def html_of(shown: Shown) -> str:
    """Return an object as HTML that can be put anywhere in a page: its text, and its picture.

    A report has no picture: its text says the same.
    """
    title, _, text = str(shown).partition("\n")
    picture = ""
    if not isinstance(shown, Report):
        picture, words = _picture(shown, title)
        if words != title:
            text = f"{text}\n{words}"
    lines = f'<pre style="white-space:pre-wrap">{escape(text)}</pre>'
    box = f'<div style="flex:1 1 24em;min-width:0"><strong>{escape(title)}</strong>{lines}</div>'
    return f'<div style="display:flex;flex-wrap:wrap;align-items:flex-start;gap:4px 20px">{picture}{box}</div>'


def _picture(shown: Shown, title: str) -> tuple[str, str]:
    """Return a small picture as an HTML element and what it shows, or "" and the title without one."""
    try:
        with base.paper_style():
            figure = base.blank_figure(70, 62)
            words = _drawn(_answer_of(shown), figure.add_subplot()) or title
            content = base64.b64encode(base.picture_bytes(figure, "png")).decode()
    except InputError:  # no matplotlib, or a table without rows of tilt angles
        return "", title
    # Half as wide as its pixels, to be sharp on screens of high resolution.
    source = f"data:image/png;base64,{content}"
    return f'<img alt="{escape(words)}" width="276" src="{source}">', words


def _answer_of(shown: Any) -> Any:
    """Return what the picture of an object shows: itself, or the gait that is its answer."""
    answer = shown
    if isinstance(shown, Pictured):
        answer = shown._shown
    if answer is None:
        title = str(shown).partition("\n")[0]
        raise InputError(f"an answer must have a gait to be plotted, got: {title}")
    return answer


@singledispatch
def _drawn(shown: Any, ax: Axes) -> str | None:
    """Draw an object of one of the kinds below; return what the picture shows, None for the object's first line."""
    raise InputError(
        "only gaits, tables, plans, reports, other answers, regions and vehicles can be plotted, got "
        f"{shown_value(shown)}"
    )


@_drawn.register(Gait)
def _draw_gait_on_map(gait: Gait, ax: Axes, zones: Zones | None = None) -> str:
    """Draw a gait on the map of its sheet, and return what is shaded."""
    sign: Sign | None = None
    if gait.R.min() > 0:
        sign = "positive"
    elif gait.R.max() < 0:
        sign = "negative"
    words = _draw_map(ax, gait.vehicle, gait.color, sign, gait.coefficients, zones)
    label = f"gait, {gait.sheet_in_words}"
    gait_loop(
        gait,
        label=label,
        width=2.2,
        ax=ax,
    )
    end = max(HALF_PI, float(np.abs(gait.alpha[:, :2]).max()))
    ax.set(xlim=(-end, end), ylim=(-end, end))
    return words


@_drawn.register(Plan)
def _(plan: Plan, ax: Axes) -> str:
    request = plan.request
    if plan.loop is not None:
        words = _draw_gait_on_map(plan.loop.gait, ax, request.zones)
    else:
        color = "blue" if request.color == "blue" else "red"
        sign = None if request.sign == "auto" else request.sign
        coefficients = coefficients_of(request.vehicle, request.coefficients)
        words = _draw_map(ax, request.vehicle, color, sign, coefficients, request.zones)
        nearest = plan.refusals[0].moved
        for waypoint, place in zip(plan.waypoints, nearest, strict=False):
            if waypoint != place:
                base.draw_arrow(ax, waypoint, place, base.PALETTE["no"][0])
    look: dict[str, Any] = {"fillstyle": "none", "label": "waypoints"}
    for x, y in plan.waypoints:
        ax.plot(
            x,
            y,
            "ko",
            markersize=7,
            zorder=5,
            **look,
        )
    return f"{words}; rings: waypoints"


@_drawn.register(TimedGait)
def _(timed: TimedGait, ax: Axes) -> None:
    _draw_angles(ax, timed.t, timed.alpha)
    base.legend_below(ax, columns=4)


@_drawn.register(Table)
def _(shown: Table, ax: Axes) -> None:
    table = checked_table(shown)
    alpha = tilt_angles(table, surface_of(table)[1])
    if "t" in table:
        _draw_angles(ax, table["t"], alpha)
    else:
        _draw_angles(ax, np.arange(1.0, len(alpha) + 1), alpha)
        ax.set_xlabel("row")
    base.legend_below(ax, columns=4)


def _draw_angles(ax: Axes, time: FloatArray, alpha: FloatArray) -> None:
    """Draw four tilt angles over time [s]."""
    base.draw_four(ax, time, alpha, r"$\alpha_{}$")
    base.angle_axis(ax.yaxis, r"\alpha_i")
    ax.set(xlabel="$t$ (s)")
    ax.margins(x=0.0)
    ax.grid(True)


@_drawn.register(Flight)
def _(flight: Flight, ax: Axes) -> None:
    for name in ("roll", "pitch", "yaw"):
        ax.plot(flight.column("t"), np.degrees(flight.column(name)), label=name)
    ax.set(xlabel="$t$ (s)", ylabel="attitude (°)")
    base.legend_below(ax, columns=3)


@_drawn.register(RobustnessReport)
def _(report: RobustnessReport, ax: Axes) -> None:
    draw_robustness(ax, report)


@_drawn.register(Comparison)
def _(comparison: Comparison, ax: Axes) -> None:
    for name, timed in zip(comparison.names, comparison.gaits, strict=True):
        gait_loop(timed.gait, label="_", ax=ax)
        base.draw_label(ax, timed.gait.alpha[:, :2].mean(axis=0), name)
    base.plane_axes(ax, r"\alpha_1", r"\alpha_2")


@_drawn.register(Location)
def _(location: Location, ax: Axes) -> str:
    """Draw admissible regions, their parts with their numbers, and the waypoints."""
    request = location.request
    for place in location.regions:
        vehicle = request.vehicle if place.color == "red" else None
        _draw_region(place.region, ax, vehicle, f"{request.require}, {place.color}")
        for number, part in enumerate(place.region.components, start=1):
            base.draw_label(ax, _inside(part), str(number))
    for number, (x, y) in enumerate(request.waypoints, start=1):
        ax.plot(x, y, "ko", markersize=4)
        base.draw_label(ax, (x, y), f"waypoint {number}", va="bottom")
    base.legend_below(ax, columns=2)
    return f"{request.require} regions with the waypoints"


@_drawn.register(Vehicle)
def _(vehicle: Vehicle, ax: Axes) -> None:
    seen = vehicle_view(np.zeros(4), vehicle, view=FROM_ABOVE)
    show_whole(ax, seen)
    draw_vehicle(ax, seen)


@_drawn.register(Region)
def _draw_region(
    region: Region, ax: Axes, vehicle: Vehicle | None = None, use: str = ""
) -> None:
    """Fill a region; with a vehicle in the color of the sign of R on its red sheet. `use` is for the legend."""
    from shapely.plotting import patch_from_polygon

    for part in region.components[:_MOST_SHOWN]:
        face, relation = "0.9", "$R=0$ in exact physics"
        if vehicle is not None:
            x, y = _inside(part)
            opposite = sheet_angles("red", x, y, "exact", vehicle=vehicle)
            alpha = np.array([x, y, *opposite])
            R = matrices.level_determinant(alpha, "exact", vehicle=vehicle)
            face, relation = base.NEGATIVE, "$R<0$"
            if R > 0:
                face, relation = base.POSITIVE, "$R>0$"
        label = f"{use}, {relation}" if use else None
        look = {"facecolor": face, "edgecolor": base.GREY, "linewidth": 0.5}
        ax.add_patch(patch_from_polygon(part, label=label, **look))
    base.plane_axes(ax, r"\alpha_1", r"\alpha_2")


def _inside(part: shapely.Polygon) -> tuple[float, float]:
    """Return a point inside of a part of a region."""
    point = part.representative_point()
    return point.x, point.y


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
    sheet = f"{color} "
    if vehicle.asymmetry is not None:  # it has one sheet
        color, sheet = "red", ""
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
        relation = f" with {RELATION[sign]}" if sign else ""
        words = f"shaded: where a {sheet}gait{relation} is {require}"
        if zones:
            words += ", with the given polygons"
        _draw_region(region, ax, vehicle if color == "red" else None, require)
    if color == "red":
        draw_zeros_of_R(ax, vehicle)
        ax.plot(0, 0, "k+", markersize=7, label="all upright")
    base.plane_axes(ax, r"\alpha_1", r"\alpha_2")
    for corners in zones.keep_out if zones else ():
        x, y = np.transpose(corners)
        ax.fill(
            x,
            y,
            fc="white",
            ec=base.GREY,
            hatch="///",
            label="keep out",
        )
    return words


@_drawn.register(Report)
def _draw_checks(report: Report, ax: Axes) -> None:
    """Draw the part of its limit that each check of a report uses, with its mark and its message."""
    from matplotlib.ticker import PercentFormatter

    names = []
    for row, check in enumerate(report.checks):
        verdict, mark = _MARKS[check.mark]
        used = 0.0
        if check.value is not None and check.limit:
            used = abs(check.value / check.limit)
            if check.name in ("R_sign", "least_singular_value") and used:
                used = 1.0 / used  # these limits are floors
        color = base.PALETTE[verdict][0]
        ax.barh(row + 0.2, min(used, 1.5), height=0.36, color=color)
        words = shorten(check.message.partition(": ")[0], 84, placeholder=" …")
        box: dict[str, Any] = {"fc": "white", "ec": "none", "pad": 0.5}
        ax.text(
            0.01,
            row - 0.22,
            words,
            color="0.3",
            fontsize=6.5,
            va="center",
            bbox=box,
            gid=check.name,
        )
        names.append(f"{check.name.replace('_', ' ')}  {mark}")
    ax.set_yticks(range(len(names)), names, fontsize=8)
    for label, check in zip(ax.get_yticklabels(), report.checks, strict=True):
        label.set_color(base.PALETTE[_MARKS[check.mark][0]][0])
    ax.tick_params(axis="y", length=0)
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
        ylim=(len(names) - 0.4, -0.6),
        xlabel="part of the limit that is used",
    )
