"""Plots and films of flights, and the files of flights and basins."""

from __future__ import annotations

import math
from functools import partial
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from gaitgraph.errors import InputError, checked_choice
from gaitgraph.files import check_new_files, write_whole
from gaitgraph.flight.basins import Basin, table_of_basins
from gaitgraph.flight.flight import TABLES
from gaitgraph.gait.gait import name_of
from gaitgraph.gait.table import provenance_text
from gaitgraph.invertibility.matrices import least_singular_value
from gaitgraph.io.formats import FILMS, FORMATS, check_outputs
from gaitgraph.plots import axes as base, vehicles
from gaitgraph.plots.gaits import ANGLE_LOOKS, basins_figure
from gaitgraph.plots.vehicles import INK, LINE_GREY, PALE, VehicleView

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import numpy.typing as npt
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from gaitgraph.flight.flight import Flight
    from gaitgraph.invertibility.forms import FloatArray

# Height with the legend [mm], label, columns of the legend, and least end of the axis: rounding errors stay small.
_PANELS: dict[str, tuple[float, str, int, float]] = {
    "attitude": (40.0, "body attitude (°)", 4, 1.0),
    "place": (38.0, "place (m)", 4, 0.01),
    "thrusts": (42.0, "thrust\n(weight / 4)", 5, 0.0),
    "tilts": (38.0, "tilt (°)", 4, 0.0),
    "singular_value": (38.0, "least singular\nvalue (1)", 3, 0.0),
}
_WIDTH, _ENDS = (
    170.0,
    20.0,
)  # of the figure, and height of its title and the time below it [mm]
_WANTED: dict[str, Any] = {
    "color": "#7b3294",
    "linestyle": "--",
    "linewidth": 0.8,
    "label": "asked for",
}
_CURVES = {"attitude": ("roll", "pitch", "yaw"), "place": ("x", "y", "z")}
_CURVE_LOOKS: tuple[Any, ...] = (
    (INK, "-"),
    ("#0072b2", "-"),
    ("#d55e00", (0, (5, 1.5))),
)
_MOST_SHARES = 8.0  # larger thrusts have a logarithmic scale

PANELS = tuple(_PANELS)  # from the top


def plot_flight(
    flight: Flight,
    *,
    axes: Sequence[Axes] | npt.NDArray[np.object_] | None = None,
    panels: Sequence[str] = PANELS,
) -> npt.NDArray[np.object_]:
    """Draw a flight over time and return the axes. The title states what was flown and the verdict.

    `panels` are some of :data:`PANELS`: roll, pitch and yaw [°]; x, y and z [m]; thrusts as multiples of a quarter of
    the weight, with their limits; tilt angles [°]; and the least singular value of the scaled decoupling matrix, with
    the lower bound that the controller computes, and the floor below which the flight stops. References are dashed.
    Panels of a refused flight are empty. A red line of ``gid`` "stop" marks the time of a stop. `axes` are as many as
    panels, by default new ones.
    """
    for name in panels:
        checked_choice("panels", name, PANELS)
    if axes is None:
        axes = _panel_axes(panels, pyplot=True)
    axes = np.ravel(np.asarray(axes, dtype=object))
    if len(axes) != len(panels):
        raise InputError(f"axes must be {len(panels)}, one a panel, got {len(axes)}")
    end = flight.settings.seconds_of(flight.course)
    if flight.failed:  # show a little beyond the stop
        end = min(end, max(1.25 * flight.flown, flight.flown + 0.02))
    for ax, name in zip(axes, panels, strict=True):
        _draw_panel(base.axes_or_new(ax), flight, name)
        ax.grid(True)
        ax.set(xlim=(0.0, max(end, 1e-9)))
        if not len(flight.rows):
            ax.text(
                0.5,
                0.5,
                "nothing flown",
                color=base.GREY,
                ha="center",
                va="center",
                transform=ax.transAxes,
            )
            continue
        _mark_phases(ax, flight, named=ax is axes[0])
        if flight.failed:
            ax.axvline(
                flight.flown, color=base.RED, linewidth=1.6, gid="stop", zorder=4
            )
    axes[-1].set(xlabel="$t$ (s)")
    lines = [*wrap(" · ".join(_what_was_flown(flight)), 96), *wrap(flight.verdict, 96)]
    axes[0].set_title("\n".join(lines), pad=20.0)
    return axes


def _panel_axes(
    panels: Sequence[str], *, pyplot: bool = False
) -> npt.NDArray[np.object_]:
    """Return axes of a new figure for panels, one below another."""
    heights = [_PANELS[name][0] for name in panels]
    figure = base.blank_figure(_WIDTH, _ENDS + sum(heights), pyplot=pyplot)
    return figure.subplots(
        len(panels), sharex=True, squeeze=False, height_ratios=heights
    )[:, 0]


def _what_was_flown(flight: Flight) -> list[str]:
    """Return the gait's name, the vehicle, T, the reference and entry if any, and last the attitude at the start."""
    timed, settings, name = flight.course.timed, flight.settings, flight.vehicle.name
    reference: str = settings.reference
    if reference in ("step", "line", "circle"):
        reference += f" of {settings.size:g} m" + (
            "" if reference == "step" else f" in {settings.lap:g} s"
        )
    roll, pitch = (f"{angle:.3g}°" for angle in np.degrees(flight.attitude))
    parts = [
        name_of(timed.gait),
        f"vehicle {name if len(name) <= 24 else name[:23] + '…'}",
        f"T = {timed.period:g} s",
        *([] if settings.reference == "attitude" else [reference]),
        *(["entered from hover"] if len(flight.course.sections) > 1 else []),
        f"from roll {roll}, pitch {pitch}",
    ]
    return [part.replace("-", "−") for part in parts]


def _mark_phases(ax: Axes, flight: Flight, *, named: bool) -> None:
    """Shade every other phase of a flight from hover."""
    course = flight.course
    if len(course.sections) < 2:
        return
    begins = [begin for begin, _, _ in course.sections] + [course.duration]
    for k, phase in enumerate(course.phases):
        begin, end = begins[k], min(begins[k + 1], ax.get_xlim()[1])
        if k % 2 and begin < end:
            ax.axvspan(begin, end, color="0.94", linewidth=0.0, zorder=0)
        if named and begin < end:
            at: dict[str, Any] = {
                "xycoords": ax.get_xaxis_transform(),
                "textcoords": "offset points",
            }
            ax.annotate(phase, (begin, 0.0), (3, 3), color=base.GREY, **at)


def _draw_panel(ax: Axes, flight: Flight, name: str) -> None:
    """Draw the curves of a panel, with its label and legend."""
    t, column, settings, (_, label, columns, least) = (
        flight.column("t"),
        flight.column,
        flight.settings,
        _PANELS[name],
    )
    tracks = settings.reference != "attitude"
    if name in _CURVES:
        scale = np.degrees if name == "attitude" else np.array
        held = _CURVES[name][: 2 if name == "attitude" else 3] if tracks else ("z",)
        for curve, (color, dash) in zip(_CURVES[name], _CURVE_LOOKS, strict=True):
            if curve in held:
                ax.plot(t, scale(column(f"{curve}_wanted")), **_WANTED)
            values = scale(column(curve))
            values[1:][np.abs(np.diff(values)) > 180.0] = np.nan  # an angle wraps there
            text = (
                curve
                if name == "attitude"
                else f"${curve}$"
                if curve in held
                else f"${curve}$, free"
            )
            ax.plot(
                t,
                values,
                color=color,
                linestyle=dash,
                linewidth=0.9 if "free" in text else 1.4,
                label=text,
            )
    elif name == "thrusts":
        quarter = quarter_of_weight(flight)
        shares = flight.thrusts / quarter
        for k, look in enumerate(ANGLE_LOOKS):
            ax.plot(t, shares[:, k], label=f"rotor {k + 1}", **look)
        most = (
            flight.vehicle.max_thrust
            if settings.thrust_limit is None
            else settings.thrust_limit
        )
        for limit in (0.0, most) if settings.saturation else ():
            if limit is not None:
                ax.axhline(
                    limit / quarter,
                    color=base.RED,
                    linewidth=0.9,
                    linestyle="--",
                    label="limits",
                    zorder=1,
                )
        if np.abs(shares).max(initial=0.0) > _MOST_SHARES:
            ax.set_yscale("symlog", linthresh=4.0)
        ax.axhline(1.0, color=base.GREY, linewidth=0.7, zorder=0)
    elif name == "tilts":
        for k, look in enumerate(ANGLE_LOOKS):
            ax.plot(
                t, np.degrees(flight.alpha[:, k]), label=rf"$\alpha_{k + 1}$", **look
            )
    else:
        near, floor = column("nearness"), settings.floor
        value = least_singular_value(
            flight.alpha, flight.vehicle, column("roll"), column("pitch")
        )
        ax.plot(t, value, color=INK, linewidth=1.4, label="least singular value")
        ax.plot(
            t,
            near,
            color=base.GREY,
            linewidth=0.9,
            linestyle=":",
            label="the controller's lower bound",
        )
        if floor > 0:
            ax.axhline(
                floor,
                color=base.RED,
                linewidth=0.9,
                linestyle="--",
                label=f"flight stops below {floor:g}",
            )
        ax.set_yscale("log")
        ax.set(
            ylim=(max(0.6 * float(np.nanmin(near, initial=floor or 1.0)), 1e-10), 3.0)
        )
    if least:
        low, high = ax.get_ylim()
        ax.set(ylim=(min(low, -least), max(high, least)))
    ax.set(ylabel=label)
    base.legend_above(ax, columns=columns)


_MOST_SHARE = 2.4  # of the longest line of thrust
_CURVE_POINTS = 400


def flight_view(flight: Flight, row: int) -> VehicleView:
    """Return the vehicle in a row of a flight, at its attitude, with lines as long as its thrusts."""
    from scipy.spatial.transform import Rotation

    shares = np.clip(
        flight.thrusts[row] / quarter_of_weight(flight), -_MOST_SHARE, _MOST_SHARE
    )
    angles = [float(flight.column(name)[row]) for name in ("yaw", "pitch", "roll")]
    attitude = Rotation.from_euler("ZYX", angles).as_matrix()
    return vehicles.vehicle_view(
        flight.alpha[row], flight.vehicle, attitude=attitude, thrusts=shares
    )


def quarter_of_weight(flight: Flight) -> float:
    """Return a quarter of the weight [N], the unit of thrusts in pictures."""
    (mass,) = flight.vehicle.require("mass", purpose="a picture of flight")
    return float(mass * flight.vehicle.gravity / 4.0)


def _flight_film(
    flight: Flight, times: FloatArray
) -> tuple[Figure, Callable[[int], list[Any]]]:
    """Return the figure of a flight's film, and the function that draws a frame."""
    (arm,) = flight.vehicle.require("arm_length", purpose="a picture of flight")
    t, quarter = flight.column("t"), quarter_of_weight(flight)
    place = np.stack([flight.column(name) for name in "xyz"], axis=-1)
    tracks = flight.settings.reference != "attitude"
    wanted = (
        np.stack([flight.column(f"{name}_wanted") for name in "xyz"], axis=-1)
        if tracks
        else place
    )
    every = np.unique(
        np.linspace(0, len(place) - 1, min(len(place), _CURVE_POINTS)).astype(int)
    )
    screen = np.stack(vehicles.screen_axes(vehicles.DEFAULT_VIEW), axis=-1)

    gait, _, period, *_, start = _what_was_flown(flight)
    faster = (
        f", shown in {vehicles.LONGEST / 100:g} s"
        if 100 * flight.flown > vehicles.LONGEST
        else ""
    )
    figure, picture, chart = vehicles.blank_film(
        f"{gait}, {period} · {start}",
        vehicles.vehicle_view(np.zeros(4), flight.vehicle),
        0.68,
    )
    angles = np.degrees([flight.column(name)[every] for name in ("roll", "pitch")])
    cursor = vehicles.draw_chart(
        chart,
        t[every],
        angles,
        [(INK, 1.5, "body roll"), (LINE_GREY, 2.5, "body pitch")],
        5.0,
    )
    chart.legend(
        loc="upper center",
        bbox_to_anchor=(0.5, -0.02),
        ncols=2,
        labelcolor=LINE_GREY,
        borderaxespad=0.2,
    )
    look: dict[str, Any] = {
        "fontsize": 8,
        "color": LINE_GREY,
        "va": "top",
        "linespacing": 1.5,
    }
    box: dict[str, Any] = {"facecolor": "white", "edgecolor": "none", "pad": 1.5}
    words = figure.text(
        16 / vehicles.FILM_WIDTH, 1 - 38 / vehicles.FILM_HEIGHT, "", bbox=box, **look
    )

    def frame(k: int) -> list[Any]:
        row = int(np.clip(np.searchsorted(t, times[k] + 1e-12) - 1, 0, len(place) - 1))
        here = place[row]

        def seen(points: FloatArray) -> FloatArray:
            return np.asarray((points - here) / arm @ screen)

        drawn = _draw_ground(picture, here, arm, seen)
        steps = np.unique(np.linspace(0, row, min(row + 1, _CURVE_POINTS)).astype(int))
        drawn += picture.plot(
            *seen(place[steps]).T, color=LINE_GREY, linewidth=1.1, zorder=0.7
        )
        if tracks:
            ring: dict[str, Any] = {
                "markersize": 6.0,
                "markerfacecolor": "white",
                "markeredgecolor": LINE_GREY,
            }
            drawn += picture.plot(*seen(wanted[row]), "o", zorder=0.8, **ring)
        drawn += vehicles.draw_vehicle(picture, flight_view(flight, row))
        shares = flight.thrusts[row] / quarter
        x, y, z = np.round(here, 2) + 0.0
        words.set_text(
            f"t = {t[row]:.2f} s{faster}\n"
            f"x {x:.2f} m   y {y:.2f} m   z {z:.2f} m\n"
            f"thrust {shares.min():.2f} to {shares.max():.2f} × weight/4".replace(
                "-", "−"
            )
        )
        cursor.set_xdata([t[row]])
        if k == len(times) - 1:
            text = "\n".join(
                wrap(flight.reason or flight.verdict, 52, max_lines=2, placeholder=" …")
            )
            bold: dict[str, Any] = {
                "fontsize": 8,
                "weight": "bold",
                "color": INK,
                "va": "bottom",
            }
            bold["bbox"] = box | {"facecolor": PALE, "pad": 4}
            drawn.append(
                figure.text(
                    16 / vehicles.FILM_WIDTH, 118 / vehicles.FILM_HEIGHT, text, **bold
                )
            )
        return drawn

    return figure, frame


def _draw_ground(
    ax: Axes, here: FloatArray, arm: float, seen: Callable[[FloatArray], FloatArray]
) -> list[Any]:
    """Draw a grid on the ground around a position, and the shadow of the vehicle."""
    level, reach = -1.8 * arm, 9.0 * arm
    power = 10.0 ** math.floor(math.log10(1.4 * arm))
    spacing = max(
        step * power
        for step in (1.0, 2.0, 5.0)
        if step * power <= 1.4 * arm * (1 + 1e-12)
    )
    lines = []
    for axis in (0, 1):
        for k in range(
            math.ceil((here[axis] - reach) / spacing),
            math.floor((here[axis] + reach) / spacing) + 1,
        ):
            line = np.full((3, 3), np.nan)  # NaN in the last row ends the line
            line[:2, axis], line[:2, 2] = k * spacing, level
            line[:2, 1 - axis] = here[1 - axis] + np.array([-reach, reach])
            lines.append(line)
    around = np.linspace(0.0, math.tau, 25)
    ring = [here[0], here[1], level] + 0.35 * arm * np.stack(
        [np.cos(around), np.sin(around), 0 * around], axis=-1
    )
    grid = ax.plot(
        *seen(np.concatenate(lines)).T, color=PALE, linewidth=0.8, zorder=0.5
    )
    return [*grid, *ax.fill(*seen(ring).T, color=PALE, zorder=0.6)]


_PLOTS = tuple(f".{name}" for name in base.FORMATS)


def check_flight_outputs(
    paths: Sequence[str | Path],
    *,
    of: Literal["flight", "basin"] = "flight",
    force: bool = False,
) -> None:
    """Raise before a flight if an output cannot be written: wrong suffix, missing library or folder, existing file."""
    known = [*TABLES, *_PLOTS, *((".mcap", *FILMS) if of == "flight" else ())]
    bags = [Path(path) for path in paths if str(path).lower().endswith(".mcap")]
    for path in map(Path, paths):
        suffix = checked_choice(
            f"suffix of the {of} output {str(path)!r}", path.suffix.lower(), known
        )
        if suffix in FILMS:
            vehicles.check_films([path], force=force)
        elif suffix in _PLOTS:
            base.require_matplotlib()
        else:
            FORMATS[suffix].function("write")  # MissingExtra, if that is so
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

    def figure() -> Figure:
        return plot_flight(flight, axes=_panel_axes(PANELS))[0].figure  # type: ignore[no-any-return]

    def film(path: Path) -> None:
        phases, delays = vehicles.film_clock(max(flight.flown, 1e-6))
        delays[-1] += 80  # the end is read
        times = np.append(flight.flown * phases[:-1], flight.flown)
        with base.paper_style():
            vehicles.write_frames(
                *_flight_film(flight, times),
                delays,
                provenance_text(flight.table),
                path,
            )

    _write(paths, lambda: flight.table, figure, film, force=force)


def write_basins(
    basins: Sequence[Basin], paths: Sequence[str | Path], *, force: bool = False
) -> None:
    """Write basins of a gait and its biased gaits: tables with a row a flight, or one picture (.png, .svg, .pdf)."""
    check_flight_outputs(paths, of="basin", force=force)
    _write(
        paths,
        partial(table_of_basins, basins),
        partial(basins_figure, basins),
        force=force,
    )


def _write(
    paths: Sequence[str | Path],
    table: Callable[[], Any],
    figure: Callable[[], Figure],
    film: Callable[[Path], None] | None = None,
    *,
    force: bool,
) -> None:
    contents: list[tuple[Path, Any]] = []  # bytes, or the function that writes them
    for path in map(Path, paths):
        suffix = path.suffix.lower()
        if suffix in FILMS:
            contents.append((path, film))
        elif suffix in _PLOTS:
            with base.paper_style():
                contents.append((path, base.picture_bytes(figure(), suffix[1:])))  # type: ignore[arg-type]  # a format
        else:
            contents.append((path, partial(FORMATS[suffix].function("write"), table())))
    write_whole(contents, force=force)
