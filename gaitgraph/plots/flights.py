"""Flights over time, basins over the roll–pitch diagram, and the files that both are written to."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from gaitgraph.errors import InputError, did_you_mean, shown
from gaitgraph.files import check_new_files, write_whole
from gaitgraph.flight.basins import Basin, table_of_basins
from gaitgraph.flight.record import TABLES
from gaitgraph.invertibility.matrices import coefficients_of
from gaitgraph.io.formats import FILMS, FORMATS, FormatOptions
from gaitgraph.plots.axes import (
    COLOR_OF,
    FORMATS as PICTURES,
    GREY,
    INCH,
    RED,
    axes_or_new,
    blank_figure,
    legend_above,
    legend_below,
    new_figure,
    paper_style,
    picture_bytes,
    require_matplotlib,
)
from gaitgraph.plots.films import check_films, quarter_of_weight, write_flight_film
from gaitgraph.plots.gaits import ANGLE_LOOKS, draw_attitudes, finish_diagram
from gaitgraph.plots.vehicles import INK

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from gaitgraph.flight.record import Flight, Outcome

_HEIGHTS = {"attitude": 40.0, "place": 38.0, "thrusts": 42.0, "tilts": 38.0, "singular_value": 38.0}  # mm
_WIDTH, _LEFT, _RIGHT, _TOP, _BOTTOM = 170.0, 19.0, 4.0, 13.0, 12.0
_LEGEND = 8.0  # above each panel, part of its height
_SECOND = "#0072b2"
_WANTED: dict[str, Any] = {"color": "#7b3294", "linestyle": "--", "linewidth": 0.8, "label": "asked for"}
_MOST_SHARES = 8.0  # beyond it thrusts are drawn to a logarithmic scale

PANELS = tuple(_HEIGHTS)
"""The panels of a flight, from the top."""


def plot_flight(flight: Flight, *, axes: Any = None, panels: Sequence[str] = PANELS) -> Any:
    """Draw what happened in a flight over time.

    Parameters
    ----------
    flight
        What :func:`gaitgraph.flight.simulation.fly` returns. The panels of a refused one are empty.
    axes
        As many plane axes as there are panels; by default those of a new figure, one below another.
    panels
        Which of :data:`PANELS`, in order: roll, pitch and yaw [°]; x, y and z [m]; thrusts as multiples of a quarter
        of the weight, with their limits; tilt angles [°]; and the band that holds the least singular value of the
        scaled decoupling matrix, with the value at which flight stops. References are dashed.

    Returns
    -------
    array of axes
        A red line at the time of a stop has "stop" as its ``gid``. The first title says what was flown, and the
        verdict.
    """
    for name in panels:
        if name not in PANELS:
            hint = did_you_mean(str(name), list(PANELS))
            raise InputError(f"panels must be some of {', '.join(PANELS)}, got {shown(name)}{hint}")
    if axes is None:
        axes = _panel_axes(new_figure(_WIDTH, _WIDTH), panels)
    axes = np.ravel(np.asarray(axes, dtype=object))
    if len(axes) != len(panels):
        raise InputError(f"axes must be {len(panels)}, one a panel, got {len(axes)}")
    for ax, name in zip(axes, panels, strict=True):
        _DRAWN[name](axes_or_new(ax), flight)
        ax.grid(True)
        ax.set(xlim=(0.0, max(_end_of(flight), 1e-9)))
        if not len(flight.rows):
            ax.text(0.5, 0.5, "nothing flown", color=GREY, ha="center", va="center", transform=ax.transAxes)
            continue
        _mark_phases(ax, flight, named=ax is axes[0])
        if flight.failed:
            ax.axvline(flight.flown, color=RED, linewidth=1.6, gid="stop", zorder=4)
    axes[-1].set(xlabel="$t$ (s)")
    lines = [part for line in (_name_of(flight), _verdict_of(flight)) for part in wrap(line, 96)]
    axes[0].set_title("\n".join(lines), pad=20.0)
    return axes


def _panel_axes(figure: Figure, panels: Sequence[str]) -> Any:
    """Return axes of a figure for panels, one below another.

    Their layout is fixed, because a solver's depends on the order in which it meets its variables, and so do bytes.
    """
    top = height = _TOP + _BOTTOM + sum(_HEIGHTS[name] for name in panels)
    figure.set_layout_engine("none")
    figure.set_size_inches(_WIDTH / INCH, height / INCH)
    axes: list[Any] = []
    top -= _TOP
    for name in panels:
        low = top - _HEIGHTS[name]
        box = (_LEFT / _WIDTH, low / height, (_WIDTH - _LEFT - _RIGHT) / _WIDTH, (_HEIGHTS[name] - _LEGEND) / height)
        axes.append(figure.add_axes(box, sharex=axes[0] if axes else None))
        axes[-1].tick_params(labelbottom=name == panels[-1])
        top = low
    return np.array(axes, dtype=object)


def _name_of(flight: Flight) -> str:
    """Return what was flown in a line: the gait's color, the vehicle, T, the reference, the attitude at the start."""
    timed, settings, name = flight.course.timed, flight.settings, flight.vehicle.name
    size, lap = f"{settings.size:g} m", f"{settings.lap:g} s"
    reference = {"step": f"step of {size}"} | {one: f"{one} of {size} in {lap}" for one in ("line", "circle")}
    roll, pitch = (f"{angle:.3g}°" for angle in np.degrees(flight.attitude))
    parts = [
        f"{timed.gait.color.capitalize()} gait" if timed.gait.color else "Gait on neither sheet",
        f"vehicle {name if len(name) <= 24 else name[:23] + '…'}",
        f"T = {timed.period:g} s",
        *([] if settings.reference == "attitude" else [reference.get(settings.reference, settings.reference)]),
        *(["entered from hover"] if len(flight.course.pieces) > 1 else []),
        f"from roll {roll}, pitch {pitch}",
    ]
    return " · ".join(parts).replace("-", "−")


def _verdict_of(flight: Flight) -> str:
    if flight.refused:
        return flight.reason
    if flight.settled:
        return f"settled after {flight.settling_time:.2f} s"
    return f"{'stopped' if flight.failed else 'not settled'}: {flight.reason}"


def _end_of(flight: Flight) -> float:
    """Return the end of the time axis: what was to be flown, or a little beyond a stop that came early."""
    asked = min(flight.settings.seconds, flight.course.duration)
    return asked if not flight.failed else min(asked, max(1.25 * flight.flown, flight.flown + 0.02))


def _mark_phases(ax: Axes, flight: Flight, *, named: bool) -> None:
    """Shade every other phase of a flight from hover."""
    course = flight.course
    if len(course.pieces) < 2:
        return
    begins = [begin for begin, _, _ in course.pieces] + [course.duration]
    for k, phase in enumerate(course.phases):
        begin, end = begins[k], min(begins[k + 1], ax.get_xlim()[1])
        if begin >= end:
            continue
        if k % 2:
            ax.axvspan(begin, end, color="0.94", linewidth=0.0, zorder=0)
        if named:
            at: dict[str, Any] = {"xycoords": ax.get_xaxis_transform(), "textcoords": "offset points", "color": GREY}
            ax.annotate(phase, (begin, 0.0), (3, 3), **at)


def _draw_attitude(ax: Axes, flight: Flight) -> None:
    t = flight.column("t")
    looks = {"roll": (INK, "-", 1.4), "pitch": (_SECOND, "-", 1.4), "yaw": (GREY, (0, (1, 1)), 1.1)}
    for wanted in () if flight.settings.reference == "attitude" else ("roll_wanted", "pitch_wanted"):
        ax.plot(t, np.degrees(flight.column(wanted)), **_WANTED)
    for name, (color, dash, width) in looks.items():
        angle = np.degrees(flight.column(name))
        angle[1:][np.abs(np.diff(angle)) > 180.0] = np.nan  # it wraps there
        ax.plot(t, angle, color=color, linestyle=dash, linewidth=width, label=name)
    _finish(ax, "attitude (°)", least=1.0)


def _draw_place(ax: Axes, flight: Flight) -> None:
    t = flight.column("t")
    looks = {"x": (INK, "-"), "y": (_SECOND, "-"), "z": ("#d55e00", (0, (5, 1.5)))}
    held = ("z",) if flight.settings.reference == "attitude" else tuple(looks)
    for name in held:
        ax.plot(t, flight.column(f"{name}_wanted"), **_WANTED)
    for name, (color, dash) in looks.items():
        label, width = (f"${name}$", 1.4) if name in held else (f"${name}$, free", 0.9)
        ax.plot(t, flight.column(name), color=color, linestyle=dash, linewidth=width, label=label)
    _finish(ax, "place (m)", least=0.01)


def _draw_thrusts(ax: Axes, flight: Flight) -> None:
    quarter, settings = quarter_of_weight(flight), flight.settings
    shares = flight.thrusts / quarter
    for k, look in enumerate(ANGLE_LOOKS):
        ax.plot(flight.column("t"), shares[:, k], label=f"rotor {k + 1}", **look)
    most = flight.vehicle.max_thrust if settings.thrust_limit is None else settings.thrust_limit
    for limit in (0.0, most) if settings.saturation else ():
        if limit is not None:
            ax.axhline(limit / quarter, color=RED, linewidth=0.9, linestyle="--", label="limits", zorder=1)
    if len(shares) and np.abs(shares).max() > _MOST_SHARES:
        ax.set_yscale("symlog", linthresh=4.0, linscale=1.5)
        tens = [10.0**k for k in range(1, 12)]
        ax.set_yticks([*(-ten for ten in reversed(tens)), 0.0, *tens])
        ax.set(ylim=(min(2.0 * shares.min(), -1.0), max(2.0 * shares.max(), 4.0)))
    ax.axhline(1.0, color=GREY, linewidth=0.7, zorder=0)
    _finish(ax, "thrust\n(weight / 4)", columns=5)


def _draw_tilts(ax: Axes, flight: Flight) -> None:
    for k, look in enumerate(ANGLE_LOOKS):
        tilt = np.degrees(flight.column(f"alpha{k + 1}"))
        ax.plot(flight.column("t"), tilt, label=rf"$\alpha_{k + 1}$", **look)
    _finish(ax, "tilt (°)")


def _draw_singular_value(ax: Axes, flight: Flight) -> None:
    near, floor = flight.column("nearness"), flight.settings.floor
    look: dict[str, Any] = {"color": "#009e73", "alpha": 0.45, "linewidth": 0.0, "label": "lies in this band"}
    ax.fill_between(flight.column("t"), near, 2.0 * near, **look)
    if floor > 0:
        ax.axhline(floor, color=RED, linewidth=0.9, linestyle="--", label=f"flight stops below {floor:g}")
    ax.set_yscale("log")
    lowest = min([*near[-1:], near.min(initial=np.inf), *([floor] if floor > 0 else [])], default=0.01)
    ax.set(ylim=(max(0.6 * float(lowest), 1e-10), 3.0))
    _finish(ax, "least singular\nvalue (1)", columns=2)


def _finish(ax: Axes, label: str, *, columns: int = 4, least: float | None = None) -> None:
    """Label an axis that reaches ±`least` at least, lest rounding be drawn large, with a legend above."""
    if least is not None:
        low, high = ax.get_ylim()
        ax.set(ylim=(min(low, -least), max(high, least)))
    ax.set(ylabel=label)
    legend_above(ax, columns=columns)


_DRAWN: dict[str, Callable[[Axes, Flight], None]] = {
    "attitude": _draw_attitude,
    "place": _draw_place,
    "thrusts": _draw_thrusts,
    "tilts": _draw_tilts,
    "singular_value": _draw_singular_value,
}

# ---------------------------------------------------------------- basins

# Each outcome has its own shape, so that colors, which colour-blind eyes confuse, are not needed; in the order of
# flight.record.OUTCOMES, whose codes count them.
OUTCOME_LOOKS: dict[Outcome, dict[str, Any]] = {
    "settled": {"marker": "o", "color": "#009e73", "markersize": 3.0},
    "not settled": {"marker": "D", "color": "#e69f00", "markersize": 3.4},
    "near singular": {"marker": "x", "color": "black", "markersize": 4.2, "markeredgewidth": 1.1},
    "sign change": {"marker": "*", "color": "black", "markersize": 5.2, "markeredgewidth": 0.0},
    "tumbling": {"marker": "v", "color": "#cc79a7", "markersize": 4.0},
    "upended": {"marker": "^", "color": "#56b4e9", "markersize": 4.0},
    "refused": {"marker": "s", "color": "#8a8a8a", "markersize": 3.0},
}
_WORDS: dict[Outcome, str] = {"sign change": "determinant changed sign", "near singular": "stopped near singularity"}
_FULL_SIZE = 17  # attitudes along a side whose marks have full size


def basin_map(basin: Basin, *, name: str = "", ax: Axes | None = None) -> Axes:
    """Draw how flights from each attitude ended, over the roll–pitch diagram of the gait.

    Thin lines are the attitudes at which the gait is singular at even times of its period, with exact coefficients; the
    thick line borders the basin's acceptable attitudes, those at which it never is. They have the color of the gait's
    sheet, or are grey where it is on neither, as a biased gait is. Numbers are of the grid's attitudes. An attitude has
    the mark of the first of its flights, in the order of take-off, that did not settle; a green disc where all did.

    Parameters
    ----------
    basin
        What was flown.
    name
        What the title calls the gait; by default the basin's name.
    ax
        Plane axes; by default those of a new figure. Marks have "outcome" as their ``gid``.
    """
    ax = axes_or_new(ax, size=(85, 105))
    gait = basin.timed.gait
    exact = coefficients_of(gait.vehicle, "exact")
    label = f"acceptable: {int(basin.inside.sum())} of {basin.inside.size} attitudes"
    color = COLOR_OF.get(gait.color or "", GREY)
    draw_attitudes(ax, replace(gait, coefficients=exact), exact, basin.acceptable, label=label, color=color, count=24)
    finish_diagram(ax)
    smaller = min(1.0, _FULL_SIZE / len(basin.angles))
    for code, (outcome, look) in enumerate(OUTCOME_LOOKS.items()):
        roll, pitch = (basin.worst == code).nonzero()
        if len(roll):
            drawn = look | {"markersize": look["markersize"] * smaller, "linestyle": "none", "zorder": 4}
            label = f"{_WORDS.get(outcome, outcome)}: {len(roll)}"
            ax.plot(basin.angles[roll], basin.angles[pitch], label=label, gid="outcome", **drawn)
    ax.set_title(f"{name or basin.name}\n{100 * basin.fraction:.1f} % of {basin.worst.size} attitudes settled")
    legend_below(ax)
    return ax


def _basins_figure(basins: Sequence[Basin]) -> Figure:
    """Return a figure of basins side by side, four in a row at most."""
    width, height, legend_line = 68.0, 73.0, 4.2  # mm
    columns = min(len(basins), 4)
    figure = blank_figure(width * columns, height)
    panels: np.ndarray[Any, Any] = figure.subplots(math.ceil(len(basins) / columns), columns, squeeze=False)
    for ax, basin in zip(panels.flat, basins, strict=False):
        basin_map(basin, ax=ax)
    for ax in panels.flat[len(basins) :]:
        ax.set_axis_off()
    legends = [[ax.get_legend() for ax in row] for row in panels]
    lines = [max(0 if one is None else len(one.get_texts()) for one in row) for row in legends]
    figure.set_size_inches(width * columns / INCH, sum(height + legend_line * count for count in lines) / INCH)
    return figure


# ---------------------------------------------------------------- files

_PLOTS = tuple(f".{name}" for name in PICTURES)


def check_flight_outputs(
    paths: Sequence[str | Path], *, of: Literal["flight", "basin"] = "flight", force: bool = False
) -> None:
    """Raise before a flight if an output cannot be written: its suffix, a library, a folder, a name that is taken."""
    known = [*TABLES, *_PLOTS, *(FILMS if of == "flight" else ())]
    for path in map(Path, paths):
        suffix = path.suffix.lower()
        if suffix not in known:
            why = f" is a {FORMATS[suffix].name}, which is of gaits alone" if suffix in FORMATS else ""
            hint = did_you_mean(suffix, known) if suffix and not why else ""
            raise InputError(f"output: {str(path)!r}{why}; the suffixes for a {of} are {', '.join(known)}{hint}")
        if suffix in FILMS:
            check_films([path], force=force)
        elif suffix in _PLOTS:
            require_matplotlib()
        else:
            FORMATS[suffix].function("write")  # MissingExtra, if that is so
    check_new_files(paths, force=force)


def write_flight(flight: Flight, paths: Sequence[str | Path], *, force: bool = False) -> None:
    """Write a flight to files, each whole or not at all; the suffix says what.

    Parameters
    ----------
    flight
        One with rows.
    paths
        Tables (.csv, .json, .npz, .mat, .parquet), plots over time (.png, .svg, .pdf), or films (.gif, .mp4).
    force
        Overwrite files that exist.

    Raises
    ------
    InputError, FileProblem, OutputExists, MissingExtra
        If a suffix is not known, a file cannot be written, a library is missing, or nothing was flown.
    """
    check_flight_outputs(paths, force=force)
    if paths and not len(flight.rows):
        raise InputError(f"output: {str(paths[0])!r}: nothing was flown, so there is nothing to write")

    def plotted() -> Figure:
        figure = blank_figure(_WIDTH, _WIDTH, layout=None)
        plot_flight(flight, axes=_panel_axes(figure, PANELS))
        return figure

    film = partial(write_flight_film, flight)
    write_whole([(Path(path), _content(path, flight.table, plotted, film)) for path in paths], force=force)


def write_basins(basins: Sequence[Basin], paths: Sequence[str | Path], *, force: bool = False) -> None:
    """Write basins of one gait to files: a row for each flight, or the picture of all (.png, .svg, .pdf).

    Parameters
    ----------
    basins
        Of one gait and its biased gaits, as :func:`gaitgraph.flight.basins.basins_of` returns them; one at least.
    paths, force
        As for :func:`write_flight`, which raises the same errors; there are no films.
    """
    check_flight_outputs(paths, of="basin", force=force)
    table, figure = partial(table_of_basins, basins), partial(_basins_figure, basins)
    write_whole([(Path(path), _content(path, table, figure)) for path in paths], force=force)


def _content(path: str | Path, table: Callable[[], Any], figure: Callable[[], Figure], film: Any = None) -> Any:
    """Return the bytes of a file, or what writes it."""
    suffix = Path(path).suffix.lower()
    if suffix in FILMS:
        return film
    if suffix in _PLOTS:
        with paper_style():
            return picture_bytes(figure(), suffix.removeprefix("."))  # type: ignore[arg-type]  # one of the formats
    return partial(FORMATS[suffix].function("write"), [table()], options=FormatOptions())
