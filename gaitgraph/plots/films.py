"""Films: the vehicle with its lines of thrust, and below it angles over time, of one period of a gait or of a flight.

Frames are drawn by matplotlib, and written by Pillow, or by the program ffmpeg. The same gait or flight gives the same
GIF with the same versions of matplotlib and Pillow.
"""

from __future__ import annotations

import math
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitgraph.errors import InputError, needs_extra
from gaitgraph.files import check_new_files, write_whole
from gaitgraph.gait.gait import name_of
from gaitgraph.gait.given import given_gait
from gaitgraph.gait.table import Table, provenance_text
from gaitgraph.io.formats import FILMS
from gaitgraph.plots.axes import draw_four, paper_style
from gaitgraph.plots.vehicles import (
    DEFAULT_VIEW,
    INK,
    LINE_GREY,
    PALE,
    VehicleView,
    draw_vehicle,
    screen_axes,
    vehicle_view,
)
from gaitgraph.timing.timed_gait import table_of, timed_gait_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from matplotlib.axes import Axes

    from gaitgraph.flight.flight import Flight
    from gaitgraph.gait.given import GaitLike
    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.vehicle import Vehicle

RATE = 25  # frames a second
_FEWEST, _MOST = 10, 1500  # frames of a film
_PAUSE = 20  # frames for which the end of a flight is shown
_WIDTH, _HEIGHT = 480, 420  # px, at 100 per inch
_PICTURE = (0.0, 112 / 420, 1.0, 272 / 420)  # axes: left, bottom, width, height
_CHART = (52 / 480, 28 / 420, 412 / 480, 66 / 420)
_MOST_SHARE = 2.4  # of the longest line of thrust
_GROUND = -1.8  # arm lengths
_SCREEN = np.stack(screen_axes(DEFAULT_VIEW), axis=-1)


def check_films(paths: Sequence[str | Path], *, force: bool = False) -> None:
    """Raise if a film cannot be written: wrong suffix, missing library, existing file."""
    for path in map(Path, paths):
        suffix = path.suffix.lower()
        if suffix not in FILMS:
            raise InputError(
                f"output of a film must be {' or '.join(FILMS)}, got {str(path)!r}"
            )
        try:
            from matplotlib import animation
        except ImportError as error:
            raise needs_extra("matplotlib", "a film", "plot") from error
        if suffix == ".mp4" and not animation.FFMpegWriter.isAvailable():
            raise InputError(
                f"output {str(path)!r}: MP4 needs the program ffmpeg. Install it, or write a .gif"
            )
    check_new_files(paths, force=force)


def write_films(
    gait: GaitLike, paths: Sequence[str | Path], *, force: bool = False
) -> None:
    """Write films of one period of a gait, whole or not at all.

    `gait` may have any form; rows without times take 1 s. `paths` end in .gif or .mp4, which needs ffmpeg. `force`
    overwrites existing files.
    """
    check_films(paths, force=force)
    source = given_gait(gait).source
    timed = timed_gait_of(source)
    table = source if isinstance(source, Table) else table_of(timed)
    period, vehicle = timed.period, timed.gait.vehicle
    title = (
        f"{name_of(timed.gait)} · vehicle {short_name(vehicle.name)} · T = {period:g} s"
    )
    if isinstance(table.about.get("law"), str):
        title += f" · {table.about['law']}"
    title += _speed(period)

    def write(path: Path) -> None:
        with paper_style():
            picture, chart = _film_axes(title, vehicle)
            t = np.linspace(0.0, period, 161)
            draw_four(chart, t, np.degrees(timed.at(t).alpha), "_")
            _finish_chart(chart, period, 10.0)

            def draw(time: float) -> None:
                draw_vehicle(picture, vehicle_view(timed.at(time).alpha, vehicle))

            count = frames_of(period)
            times = period * np.arange(count) / count
            _write(picture, chart, draw, times, provenance_text(table), path)

    write_whole([(Path(path), write) for path in paths], force=force)


def write_flight_film(flight: Flight, path: Path) -> None:
    """Write a film of a flight that has rows, at a path where nothing is. The viewer follows the vehicle."""
    (arm,) = flight.vehicle.require("arm_length", purpose="a picture of flight")
    t = flight.column("t")
    places = np.stack([flight.column(name) for name in "xyz"], axis=-1)
    wanted = np.stack([flight.column(f"{name}_wanted") for name in "xyz"], axis=-1)
    shares = flight.thrusts / quarter_of_weight(flight)
    timed = flight.course.timed
    title = f"{name_of(timed.gait)}, T = {timed.period:g} s · {start_of(flight)}"
    verdict = flight.reason or flight.verdict
    verdict = fill(verdict, 52, max_lines=2, placeholder=" …")
    with paper_style():
        picture, chart = _film_axes(title, flight.vehicle, zoom=0.68)
        for name, color, width in (("roll", INK, 1.5), ("pitch", LINE_GREY, 2.5)):
            angles = np.degrees(flight.column(name))
            label = f"body {name}"
            chart.plot(
                t,
                angles,
                color=color,
                linewidth=width,
                label=label,
            )
        _finish_chart(chart, max(flight.flown, 1e-9), 5.0)
        chart.legend(
            ncols=2,
            loc="upper center",
            bbox_to_anchor=(0.5, -0.02),
        )

        def draw(time: float) -> None:
            row = int(np.searchsorted(t, time + 1e-12)) - 1
            here = places[row]
            x, y, z = here
            low, high = shares[row].min(), shares[row].max()
            words = (
                f"t = {t[row]:.2f} s{_speed(flight.flown)}\n"
                f"x {x:z.2f} m   y {y:z.2f} m   z {z:z.2f} m\n"
                f"thrust {low:.2f} to {high:.2f} × weight/4"
            )
            _write_on(picture, 0.857, words, color=LINE_GREY)
            _draw_ground(picture, here / arm)
            right, up = ((places[: row + 1] - here) / arm @ _SCREEN).T
            picture.plot(right, up, color=LINE_GREY, linewidth=1.1)
            if flight.settings.reference != "attitude":
                right, up = (wanted[row] - here) / arm @ _SCREEN
                picture.plot(right, up, "o", mfc="white", color=LINE_GREY)
            draw_vehicle(picture, flight_view(flight, row))
            if time == flight.flown:
                box = {"facecolor": PALE, "edgecolor": "none", "pad": 4}
                _write_on(picture, 0.059, verdict, bbox=box)

        count = frames_of(flight.flown)
        times = flight.flown * np.minimum(np.arange(count + _PAUSE) / count, 1.0)
        _write(picture, chart, draw, times, provenance_text(flight.table), path)


def frames_of(seconds: float) -> int:
    """Return the number of frames of a film that takes so long; one too short or too long is shown at another speed."""
    return round(min(max(RATE * seconds, _FEWEST), _MOST))


def _speed(seconds: float) -> str:
    """Return how long a film is shown, if that is not as long as it takes."""
    frames = frames_of(seconds)
    if abs(frames - RATE * seconds) <= 0.5:
        return ""
    shown = frames / RATE
    return f" (shown {'slower' if shown > seconds else 'faster'}: {shown:g} s)"


def short_name(name: str, most: int = 32) -> str:
    """Return a name that fits into a title."""
    if len(name) <= most:
        return name
    return f"{name[: most - 1]}…"


def _film_axes(title: str, vehicle: Vehicle, zoom: float = 1.0) -> tuple[Axes, Axes]:
    """Return axes for a vehicle, which fits at `zoom` 1, and below them axes for curves."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(_WIDTH / 100, _HEIGHT / 100), dpi=100)
    place = (16 / _WIDTH, 1 - 19 / _HEIGHT)
    figure.text(
        *place,
        title,
        va="center",
        fontsize=10,
        color=INK,
    )
    picture = figure.add_axes(_PICTURE)
    low, high = vehicle_view(np.zeros(4), vehicle).limits
    size = np.array([_PICTURE[2] * _WIDTH, _PICTURE[3] * _HEIGHT])
    half = size * max((high - low) / size) / 2 / zoom
    left, bottom = (low + high) / 2 - half
    right, top = (low + high) / 2 + half
    picture.set(xlim=(left, right), ylim=(bottom, top))
    return picture, figure.add_axes(_CHART)


def _write_on(picture: Axes, height: float, text: str, **look: Any) -> None:
    """Write a text at the left of a picture."""
    look |= {"va": "center", "fontsize": 8, "linespacing": 1.5}
    picture.text(16 / _WIDTH, height, text, transform=picture.transAxes, **look)


def _finish_chart(ax: Axes, end: float, step: float) -> None:
    """Scale axes with curves of angles [°] over time, up to a multiple of `step`."""
    most = step * math.ceil(np.abs(ax.dataLim.intervaly).max() / step) or step
    ax.set(xlim=(0.0, end), ylim=(-most, most))
    ax.set_xticks([0.0, end], ["0", f"{end:.4g} s"])
    ax.set_yticks([-most, 0.0, most], [f"−{most:g}°", "0", f"{most:g}°"])
    ax.tick_params(length=0, labelcolor=LINE_GREY)
    ax.spines[["top", "right", "bottom"]].set_visible(False)
    ax.axhline(
        0.0,
        color=PALE,
        linewidth=0.8,
        zorder=0,
    )


def _draw_ground(ax: Axes, here: Any) -> None:
    """Draw a grid on the ground around a position in arm lengths, and the shadow of the vehicle."""
    look: dict[str, Any] = {"color": PALE, "linewidth": 0.8, "zorder": 0.5}
    steps = np.arange(-12.0, 13.0)
    x, y = np.meshgrid(steps + np.round(here[0]), steps + np.round(here[1]))
    grid = np.stack([x, y, np.full_like(x, _GROUND)], axis=-1) - here
    right, up = np.moveaxis(grid @ _SCREEN, -1, 0)
    ax.plot(right, up, **look)
    ax.plot(right.T, up.T, **look)
    around = np.linspace(0.0, math.tau, 25)
    height = np.full_like(around, _GROUND - here[2])
    ring = np.stack([0.35 * np.cos(around), 0.35 * np.sin(around), height], axis=-1)
    ax.fill(*(ring @ _SCREEN).T, color=PALE, zorder=0.6)


def _frames(
    picture: Axes, chart: Axes, draw: Callable[[float], None], times: FloatArray
) -> Iterator[None]:
    """Draw one frame after the other: what `draw` draws at a time, and the time on the chart."""
    limits = {"xlim": picture.get_xlim(), "ylim": picture.get_ylim()}
    cursor = chart.axvline(0.0, color=INK, linewidth=0.9)
    for time in times.tolist():
        picture.clear()
        picture.set(**limits)
        picture.set_axis_off()
        cursor.set_xdata([time])
        draw(time)
        yield


def _write(
    picture: Axes,
    chart: Axes,
    draw: Callable[[float], None],
    times: FloatArray,
    about: str,
    path: Path,
) -> None:
    """Write a film, which states what it is about."""
    from matplotlib.animation import FFMpegWriter
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from PIL.Image import Dither, fromarray

    canvas: Any = FigureCanvasAgg(picture.figure)  # type: ignore[arg-type]
    frames = _frames(picture, chart, draw, times)
    if path.suffix.lower() == ".mp4":
        writer = FFMpegWriter(RATE, metadata={"comment": about})
        with writer.saving(canvas.figure, path, dpi=100):
            for _ in frames:
                writer.grab_frame()
        return
    images: list[Any] = []
    for _ in frames:
        canvas.draw()
        image = fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")
        # With the colors of the first frame in all less is stored of each.
        palette = images[0] if images else None
        images.append(image.quantize(palette=palette, dither=Dither.NONE))
    options = {"duration": 1000 // RATE, "loop": 0, "comment": about}
    images[0].save(
        path,
        save_all=True,
        append_images=images[1:],
        **options,
    )


def flight_view(flight: Flight, row: int) -> VehicleView:
    """Return the vehicle in a row of a flight, at its attitude, with lines as long as its thrusts."""
    from scipy.spatial.transform import Rotation

    shares = flight.thrusts[row] / quarter_of_weight(flight)
    angles = [float(flight.column(name)[row]) for name in ("yaw", "pitch", "roll")]
    return vehicle_view(
        flight.alpha[row],
        flight.vehicle,
        attitude=Rotation.from_euler("ZYX", angles).as_matrix(),
        thrusts=np.clip(shares, -_MOST_SHARE, _MOST_SHARE),
    )


def start_of(flight: Flight) -> str:
    """Return the attitude at the start in words."""
    roll, pitch = np.degrees(flight.attitude)
    return f"from roll {roll:.3g}°, pitch {pitch:.3g}°".replace("-", "−")


def quarter_of_weight(flight: Flight) -> float:
    """Return a quarter of the weight [N], the unit of thrusts in pictures."""
    (mass,) = flight.vehicle.require("mass", purpose="a picture of flight")
    return float(mass * flight.vehicle.gravity / 4.0)
