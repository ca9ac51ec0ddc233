"""Films: the vehicle with its lines of thrust, and below it angles over time, of one period of a gait or of a flight.

A film is animated by matplotlib and written by Pillow, or by the program ffmpeg. The same gait or flight gives the
same GIF with the same versions of matplotlib and Pillow.
"""

from __future__ import annotations

import math
from functools import partial
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
    from collections.abc import Callable, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    from gaitgraph.flight.flight import Flight
    from gaitgraph.gait.given import GaitLike

RATE = 25  # frames a second
_FEWEST, _MOST = 10, 1500  # frames of a film
_PAUSE = 20  # frames for which the end of a flight is shown
_WIDTH, _HEIGHT = 480, 420  # px, at 100 per inch
_PICTURE = (0.0, 112 / 420, 1.0, 272 / 420)  # axes: left, bottom, width, height
_CHART = (52 / 480, 28 / 420, 412 / 480, 66 / 420)
_MOST_SHARE = 2.4  # of the longest line of thrust
_GROUND = -1.8  # arm lengths


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
    count = frames_of(period)
    title = (
        f"{name_of(timed.gait)} · vehicle {short_name(vehicle.name)} · T = {period:g} s"
    )
    if isinstance(table.about.get("law"), str):
        title += f" · {table.about['law']}"
    alpha = timed.at(period * np.arange(count) / count).alpha
    with paper_style():
        level = vehicle_view(np.zeros(4), vehicle)
        figure, picture, chart = _blank_film(title + _speed(period), level)
        times = np.linspace(0.0, period, 161)
        draw_four(chart, times, np.degrees(timed.at(times).alpha), "_")
        cursor = _finish_chart(chart, period, 10.0)

        def draw(k: int) -> list[Any]:
            cursor.set_xdata([period * k / count])
            return draw_vehicle(picture, vehicle_view(alpha[k], vehicle))

        write = partial(_animate, figure, draw, range(count), provenance_text(table))
        write_whole([(Path(path), write) for path in paths], force=force)


def write_flight_film(flight: Flight, path: Path) -> None:
    """Write a film of a flight that has rows, at a path where nothing is. The viewer follows the vehicle."""
    (arm,) = flight.vehicle.require("arm_length", purpose="a picture of flight")
    screen = np.stack(screen_axes(DEFAULT_VIEW), axis=-1)
    t = flight.column("t")
    places = np.stack([flight.column(name) for name in "xyz"], axis=-1)
    wanted = np.stack([flight.column(f"{name}_wanted") for name in "xyz"], axis=-1)
    shares = flight.thrusts / quarter_of_weight(flight)
    tracks = flight.settings.reference != "attitude"
    count = frames_of(flight.flown)
    timed = flight.course.timed
    title = f"{name_of(timed.gait)}, T = {timed.period:g} s · {start_of(flight)}"
    with paper_style():
        level = vehicle_view(np.zeros(4), flight.vehicle)
        figure, picture, chart = _blank_film(title, level, zoom=0.68)
        for name, color, width in (("roll", INK, 1.5), ("pitch", LINE_GREY, 2.5)):
            angles = np.degrees(flight.column(name))
            chart.plot(
                t,
                angles,
                color=color,
                linewidth=width,
                label=f"body {name}",
            )
        cursor = _finish_chart(chart, max(flight.flown, 1e-9), 5.0)
        chart.legend(
            ncols=2,
            loc="upper center",
            bbox_to_anchor=(0.5, -0.02),
        )
        look: dict[str, Any] = {"fontsize": 8, "linespacing": 1.5}
        words = _write_at(figure, 16, 345, "", color=LINE_GREY, **look)
        verdict = flight.reason or flight.verdict
        verdict = fill(verdict, 52, max_lines=2, placeholder=" …")
        box = {"facecolor": PALE, "edgecolor": "none", "pad": 4}

        def draw(k: int) -> list[Any]:
            row = int(np.searchsorted(t, flight.flown * k / count + 1e-12)) - 1
            here = places[row]
            x, y, z = here
            words.set_text(
                f"t = {t[row]:.2f} s{_speed(flight.flown)}\n"
                f"x {x:z.2f} m   y {y:z.2f} m   z {z:z.2f} m\n"
                f"thrust {shares[row].min():.2f} to {shares[row].max():.2f} × weight/4"
            )
            cursor.set_xdata([t[row]])
            drawn = _draw_ground(picture, here / arm, screen)
            right, up = ((places[: row + 1] - here) / arm @ screen).T
            drawn += picture.plot(right, up, color=LINE_GREY, linewidth=1.1)
            if tracks:
                right, up = (wanted[row] - here) / arm @ screen
                ring: dict[str, Any] = {"markerfacecolor": "white", "color": LINE_GREY}
                drawn += picture.plot(right, up, "o", **ring)
            drawn += draw_vehicle(picture, flight_view(flight, row))
            if k == count:
                drawn.append(_write_at(figure, 16, 128, verdict, bbox=box, **look))
            return drawn

        frames = [*range(count), *[count] * _PAUSE]
        _animate(figure, draw, frames, provenance_text(flight.table), path)


def frames_of(seconds: float) -> int:
    """Return the number of frames of a film that takes so long; one too short or too long is shown at another speed."""
    return round(min(max(RATE * seconds, _FEWEST), _MOST))


def _speed(seconds: float) -> str:
    """Return how long a film is shown, if that is not as long as it takes."""
    shown = frames_of(seconds) / RATE
    if abs(shown - seconds) <= 0.5 / RATE:
        return ""
    return f" (shown {'slower' if shown > seconds else 'faster'}: {shown:g} s)"


def short_name(name: str, most: int = 32) -> str:
    """Return a name that fits into a title."""
    if len(name) <= most:
        return name
    return f"{name[: most - 1]}…"


def _blank_film(
    title: str, seen: VehicleView, zoom: float = 1.0
) -> tuple[Figure, Axes, Axes]:
    """Return a figure with axes for a vehicle, which fits at `zoom` 1, and axes for curves."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(_WIDTH / 100, _HEIGHT / 100), dpi=100)
    picture = figure.add_axes(_PICTURE)
    picture.set_axis_off()
    low, high = seen.limits
    size = np.array([_PICTURE[2] * _WIDTH, _PICTURE[3] * _HEIGHT])
    half = size * float(max((high - low) / size)) / 2 / zoom
    left, bottom = (low + high) / 2 - half
    right, top = (low + high) / 2 + half
    picture.set(xlim=(left, right), ylim=(bottom, top))
    _write_at(figure, 16, _HEIGHT - 19, title, fontsize=10, color=INK)
    return figure, picture, figure.add_axes(_CHART)


def _write_at(figure: Figure, x: float, y: float, text: str, **look: Any) -> Any:
    """Write a text at a place of a film [px]."""
    return figure.text(x / _WIDTH, y / _HEIGHT, text, va="center", **look)


def _finish_chart(ax: Axes, end: float, step: float) -> Line2D:
    """Scale axes with curves of angles [°] over time, up to a multiple of `step`, and return the cursor."""
    most = step * math.ceil(np.abs(ax.dataLim.intervaly).max() / step) or step
    ax.set(xlim=(0.0, end), ylim=(-most, most))
    ax.set_xticks([0.0, end], ["0", f"{end:.4g} s"])
    ax.set_yticks([-most, 0.0, most], [f"−{most:g}°", "0", f"{most:g}°"])
    ax.tick_params(length=0, labelcolor=LINE_GREY)
    ax.spines[["top", "right", "bottom"]].set_visible(False)
    ax.axhline(0.0, color=PALE, linewidth=0.8, zorder=0)
    return ax.axvline(0.0, color=INK, linewidth=0.9)


def _draw_ground(ax: Axes, here: Any, screen: Any) -> list[Any]:
    """Draw a grid on the ground around a position in arm lengths, and the shadow of the vehicle."""
    steps = np.arange(-12.0, 13.0)
    level = np.full((25, 25), _GROUND)
    x, y = np.meshgrid(steps + np.round(here[0]), steps + np.round(here[1]))
    right, up = np.moveaxis((np.stack([x, y, level], axis=-1) - here) @ screen, -1, 0)
    drawn = []
    for lines in ((right, up), (right.T, up.T)):
        drawn += ax.plot(*lines, color=PALE, linewidth=0.8, zorder=0.5)
    around = np.linspace(0.0, math.tau, 25)
    ring = 0.35 * np.stack([np.cos(around), np.sin(around), 0 * around], axis=-1)
    ring[:, 2] = _GROUND - here[2]
    right, up = (ring @ screen).T
    return drawn + ax.fill(right, up, color=PALE, zorder=0.6)


def _animate(
    figure: Figure,
    draw: Callable[[int], list[Any]],
    frames: Sequence[int],
    about: str,
    path: Path,
) -> None:
    """Write a film. `draw` draws a frame and returns the artists to remove before the next one."""
    from matplotlib.animation import FFMpegWriter, FuncAnimation, PillowWriter

    class GifWriter(PillowWriter):
        """Pillow's writer, with a comment, and with the colors of the first frame in all: less is stored of each."""

        _frames: list[Any]

        def grab_frame(self, **options: Any) -> None:
            super().grab_frame(**options)
            palette = self._frames[0] if len(self._frames) > 1 else None
            self._frames[-1] = self._frames[-1].quantize(palette=palette, dither=0)

        def finish(self) -> None:
            self._frames[0].save(
                self.outfile,
                save_all=True,
                append_images=self._frames[1:],
                duration=1000 // RATE,
                loop=0,
                comment=about,
            )

    passing: list[Any] = []

    def remove() -> None:
        while passing:
            passing.pop().remove()

    def update(k: int) -> list[Any]:
        remove()
        passing.extend(draw(k))
        return passing

    writer = FFMpegWriter if path.suffix.lower() == ".mp4" else GifWriter
    animation = FuncAnimation(figure, update, frames=frames)
    animation.save(path, writer=writer(fps=RATE, metadata={"comment": about}))
    remove()  # another film of the same figure may follow


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
