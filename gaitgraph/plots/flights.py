"""Plots of flights over time, and the files of flights and basins."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from gaitgraph.errors import InputError, checked_choice, wrong
from gaitgraph.files import check_new_files, write_whole
from gaitgraph.flight.basins import Basin, table_of_basins
from gaitgraph.flight.flight import TABLES
from gaitgraph.gait.gait import name_of
from gaitgraph.invertibility.matrices import least_singular_value
from gaitgraph.io.formats import FILMS, FORMATS, check_outputs
from gaitgraph.plots import axes as base
from gaitgraph.plots.films import (
    check_films,
    quarter_of_weight,
    short_name,
    start_of,
    write_flight_film,
)
from gaitgraph.plots.gaits import basins_figure
from gaitgraph.plots.vehicles import INK

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import numpy.typing as npt
    from matplotlib.axes import Axes

    from gaitgraph.flight.flight import Flight
    from gaitgraph.gait.table import Table

_WIDTH = 170.0  # of the figure [mm]
_ENDS = 20.0  # height of its title and of the time below it [mm]
_WANTED: dict[str, Any] = {
    "color": "#7b3294",
    "linestyle": "--",
    "linewidth": 0.8,
    "label": "asked for",
}
_CURVES: tuple[dict[str, Any], ...] = (
    {"color": INK},
    {"color": "#0072b2"},
    {"color": "#d55e00", "linestyle": (0, (5, 1.5))},
)
_MOST_SHARES = 8.0  # larger thrusts have a logarithmic scale


def plot_flight(
    flight: Flight,
    *,
    axes: Sequence[Axes] | npt.NDArray[np.object_] | None = None,
    panels: Sequence[str] | None = None,
) -> npt.NDArray[np.object_]:
    """Draw a flight over time and return the axes. The title states what was flown and the verdict.

    `panels` are some of :data:`PANELS`, by default all: roll, pitch and yaw [°]; x, y and z [m]; thrusts as multiples
    of a quarter of the weight, with their limits; tilt angles [°]; and the least singular value of the scaled
    decoupling matrix, with the lower bound that the controller computes, and the floor below which the flight stops.
    References are dashed. Panels of a refused flight are empty. A red line of ``gid`` "stop" marks the time of a stop.
    `axes` are as many as panels, by default new ones.
    """
    names = [checked_choice("panels", name, PANELS) for name in panels or PANELS]
    if axes is None:
        axes = _panel_axes(names, pyplot=True)
    axes = np.ravel(np.asarray(axes, dtype=object))
    if len(axes) != len(names):
        raise wrong("axes", f"must be {len(names)}, one a panel", len(axes))
    end = flight.settings.seconds_of(flight.course)
    if flight.failed:  # show a little beyond the stop
        end = min(end, 1.25 * flight.flown + 0.02)
    for ax, name in zip(axes, names, strict=True):
        panel = _PANELS[name]
        panel.draw(base.axes_or_new(ax), flight)
        ax.set(ylabel=panel.label, xlim=(0.0, end))
        ax.grid(True)
        base.legend_above(ax, columns=panel.columns)
        if not len(flight.rows):
            base.draw_note(ax, "nothing flown")
        elif len(flight.course.sections) > 1:
            _mark_phases(ax, flight, end, named=ax is axes[0])
        if flight.failed:
            ax.axvline(
                flight.flown,
                gid="stop",
                color=base.RED,
                linewidth=1.6,
            )
    axes[-1].set(xlabel="$t$ (s)")
    title = f"{fill(_what_was_flown(flight), 96)}\n{fill(flight.verdict, 96)}"
    axes[0].set_title(title, pad=20.0)
    return axes


def _panel_axes(
    names: Sequence[str], *, pyplot: bool = False
) -> npt.NDArray[np.object_]:
    """Return axes of a new figure for panels, one below another."""
    heights = [_PANELS[name].height for name in names]
    figure = base.blank_figure(_WIDTH, _ENDS + sum(heights), pyplot=pyplot)
    axes = figure.subplots(
        len(names), sharex=True, squeeze=False, height_ratios=heights
    )
    return axes[:, 0]


def _what_was_flown(flight: Flight) -> str:
    """Return the gait's name, the vehicle, T, the reference and entry if any, and the attitude at the start."""
    course, settings = flight.course, flight.settings
    vehicle = short_name(flight.vehicle.name, 24)
    parts = [name_of(course.timed.gait), f"vehicle {vehicle}"]
    parts.append(f"T = {course.timed.period:g} s")
    reference = f"{settings.reference} of {settings.size:g} m"
    if settings.reference == "step":
        parts.append(reference)
    elif settings.reference in ("line", "circle"):
        parts.append(f"{reference} in {settings.lap:g} s")
    elif settings.reference != "attitude":
        parts.append(settings.reference)
    if len(course.sections) > 1:
        parts.append("entered from hover")
    return " · ".join([*parts, start_of(flight)]).replace("-", "−")


def _mark_phases(ax: Axes, flight: Flight, end: float, *, named: bool) -> None:
    """Shade every other phase of a flight from hover."""
    course = flight.course
    begins = [begin for begin, _, _ in course.sections]
    ends = [*begins[1:], course.duration]
    phases = zip(course.phases, begins, np.minimum(ends, end), strict=True)
    for number, (phase, begin, until) in enumerate(phases):
        if begin < until and number % 2:
            ax.axvspan(
                begin,
                until,
                color="0.94",
                linewidth=0.0,
                zorder=0,
            )
        if begin < until and named:
            place = ax.get_xaxis_transform()
            ax.text(begin, 0.03, f" {phase}", color=base.GREY, transform=place)


def _draw_attitude(ax: Axes, flight: Flight) -> None:
    t = flight.column("t")
    if flight.settings.reference != "attitude":
        for name in ("roll_wanted", "pitch_wanted"):
            ax.plot(t, np.degrees(flight.column(name)), **_WANTED)
    for name, look in zip(("roll", "pitch", "yaw"), _CURVES, strict=True):
        ax.plot(t, np.degrees(flight.column(name)), label=name, **look)
    _reach(ax, 1.0)


def _draw_place(ax: Axes, flight: Flight) -> None:
    t = flight.column("t")
    for name, look in zip("xyz", _CURVES, strict=True):
        label = f"${name}$"
        if name != "z" and flight.settings.reference == "attitude":
            label += ", free"
        else:
            ax.plot(t, flight.column(f"{name}_wanted"), **_WANTED)
        ax.plot(t, flight.column(name), label=label, **look)
    _reach(ax, 0.01)


def _reach(ax: Axes, least: float) -> None:
    """Let an axis reach to at least ± `least`, so that rounding errors stay small."""
    low, high = ax.get_ylim()
    ax.set_ylim(min(low, -least), max(high, least))


def _draw_thrusts(ax: Axes, flight: Flight) -> None:
    quarter, settings = quarter_of_weight(flight), flight.settings
    shares = flight.thrusts / quarter
    base.draw_four(ax, flight.column("t"), shares, "rotor {}")
    if settings.saturation:
        base.draw_limit(ax, 0.0, "limits")
        most = settings.thrust_limit or flight.vehicle.max_thrust
        if most is not None:
            base.draw_limit(ax, most / quarter, "limits")
    if np.abs(shares).max(initial=0.0) > _MOST_SHARES:
        ax.set_yscale("symlog", linthresh=4.0)
    ax.axhline(
        1.0,
        color=base.GREY,
        linewidth=0.7,
        zorder=0,
    )


def _draw_tilts(ax: Axes, flight: Flight) -> None:
    base.draw_four(ax, flight.column("t"), np.degrees(flight.alpha), r"$\alpha_{}$")


def _draw_singular_value(ax: Axes, flight: Flight) -> None:
    t, near = flight.column("t"), flight.column("nearness")
    roll, pitch = flight.column("roll"), flight.column("pitch")
    values = least_singular_value(flight.alpha, flight.vehicle, roll, pitch)
    ax.plot(t, values, color=INK, label="least singular value")
    look: dict[str, Any] = {"color": base.GREY, "linestyle": ":"}
    ax.plot(t, near, label="the controller's lower bound", **look)
    floor = flight.settings.floor
    if floor > 0:
        base.draw_limit(ax, floor, f"flight stops below {floor:g}")
    lowest = 0.6 * near.min(initial=floor or 1.0)
    ax.set(yscale="log", ylim=(max(lowest, 1e-10), 3.0))


class _Panel(NamedTuple):
    height: float  # with the legend [mm]
    label: str
    columns: int  # of the legend
    draw: Callable[[Axes, Flight], None]


_PANELS = {
    "attitude": _Panel(40.0, "body attitude (°)", 4, _draw_attitude),
    "place": _Panel(38.0, "place (m)", 4, _draw_place),
    "thrusts": _Panel(42.0, "thrust\n(weight / 4)", 5, _draw_thrusts),
    "tilts": _Panel(38.0, "tilt (°)", 4, _draw_tilts),
    "singular_value": _Panel(
        38.0, "least singular\nvalue (1)", 3, _draw_singular_value
    ),
}
PANELS = tuple(_PANELS)  # from the top

_PLOTS = tuple(f".{name}" for name in base.FORMATS)


def check_flight_outputs(
    paths: Sequence[str | Path],
    *,
    of: Literal["flight", "basin"] = "flight",
    force: bool = False,
) -> None:
    """Raise before a flight if an output cannot be written: wrong suffix, missing library or folder, existing file."""
    known = [*TABLES, *_PLOTS]
    if of == "flight":
        known += [".mcap", *FILMS]
    bags = []
    for path in map(Path, paths):
        suffix = path.suffix.lower()
        checked_choice(f"suffix of the {of} output {str(path)!r}", suffix, known)
        if suffix in FILMS:
            check_films([path], force=force)
        elif suffix in _PLOTS:
            base.require_matplotlib()
        else:
            FORMATS[suffix].function("write")  # MissingExtra, if that is so
        if suffix == ".mcap":
            bags.append(path)
    check_outputs(bags, force=force)
    check_new_files(paths, force=force, folders=bags)


def write_flight(
    flight: Flight, paths: Sequence[str | Path], *, force: bool = False
) -> None:
    """Write a flight that has rows to files, whole or not at all; `force` overwrites existing files.

    The suffix selects a table (.csv, .json, .npz, .mat, .parquet), a ROS 2 bag (.mcap), a plot over time (.png, .svg,
    .pdf), or a film (.gif, .mp4). The viewer of a film is behind, right and above, and follows the vehicle; the grid on the ground is
    1.8 arm lengths below the start. Lines of thrust are proportional to the thrust up to 2.4 times a quarter of the
    weight, on the other side of the disc where a rotor pulls. A flight of more than a minute is shown in a minute.
    """
    check_flight_outputs(paths, force=force)
    if paths and not len(flight.rows):
        raise InputError(
            f"output {str(paths[0])!r} cannot be written, because nothing was flown"
        )

    def draw() -> Any:
        return plot_flight(flight, axes=_panel_axes(PANELS))[0].figure

    film = partial(write_flight_film, flight)
    _write(paths, lambda: flight.table, draw, film, force=force)


def write_basins(
    basins: Sequence[Basin], paths: Sequence[str | Path], *, force: bool = False
) -> None:
    """Write basins of a gait and its biased gaits: tables with a row a flight, or one picture (.png, .svg, .pdf)."""
    check_flight_outputs(paths, of="basin", force=force)
    draw = partial(basins_figure, basins)
    _write(paths, partial(table_of_basins, basins), draw, force=force)


def _write(
    paths: Sequence[str | Path],
    table: Callable[[], Table],
    draw: Callable[[], Any],
    film: Callable[[Path], None] | None = None,
    *,
    force: bool,
) -> None:
    """Write files whose suffixes select a table, a picture or a film."""
    contents: list[tuple[Path, Any]] = []
    for path in map(Path, paths):
        suffix: Any = path.suffix.lower()
        if suffix in FILMS:
            contents.append((path, film))
        elif suffix in _PLOTS:
            with base.paper_style():
                contents.append((path, base.picture_bytes(draw(), suffix[1:])))
        else:
            write = FORMATS[suffix].function("write")
            contents.append((path, partial(write, table())))
    write_whole(contents, force=force)
