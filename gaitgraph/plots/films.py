"""Films: the vehicle with its lines of thrust, and below it angles over time, of one period of a gait or of a flight.

A film is animated by matplotlib and written by Pillow, or by the program ffmpeg. The same gait or flight gives the
same GIF with the same versions of matplotlib and Pillow.
"""

from __future__ import annotations

import math
from functools import partial
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitgraph.errors import InputError, needs_extra
from gaitgraph.files import check_new_files, write_whole
from gaitgraph.gait.gait import name_of
from gaitgraph.gait.given import given_gait
from gaitgraph.gait.table import Table, provenance_text
from gaitgraph.io.formats import FILMS
from gaitgraph.plots.axes import ROTOR_COLORS, paper_style
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
    from gaitgraph.invertibility.forms import FloatArray

RATE = 25  # frames a second
_FEWEST, _MOST = 10, 1500  # frames of a film
_PAUSE = 20  # frames for which the end of a flight is shown
_WIDTH, _HEIGHT = 480, 420  # px, at 100 per inch
_PICTURE = (0.0, 112 / 420, 1.0, 272 / 420)  # axes: left, bottom, width, height
_CHART = (52 / 480, 28 / 420, 412 / 480, 66 / 420)
_MOST_SHARE = 2.4  # of the longest line of thrust
_BOX: dict[str, Any] = {"facecolor": "white", "edgecolor": "none", "pad": 1.5}


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
        figure, picture, chart = _blank_film(
            title + _speed(period), vehicle_view(np.zeros(4), vehicle)
        )
        times = np.linspace(0.0, period, 161)
        angles = np.degrees(timed.at(times).alpha.T)
        for k, color in enumerate(ROTOR_COLORS):
            # Opposite rotors move together on the red sheet: they differ in width.
            chart.plot(times, angles[k], color=color, linewidth=3.6 if k < 2 else 1.3)
        cursor = _finish_chart(chart, period, 10.0)

        def draw(k: int) -> list[Any]:
            cursor.set_xdata([period * k / count])
            return draw_vehicle(picture, vehicle_view(alpha[k], vehicle))

        write = partial(_animate, figure, draw, range(count), provenance_text(table))
        write_whole([(Path(path), write) for path in paths], force=force)


def write_flight_film(flight: Flight, path: Path) -> None:
    """Write a film of a flight that has rows, at a path where nothing is."""
    count = frames_of(flight.flown)
    frames = [*range(count), *[count] * _PAUSE]
    with paper_style():
        film = _FlightFilm(flight, count)
        about = provenance_text(flight.table)
        _animate(film.figure, film.draw, frames, about, path)


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
    (left, bottom), (right, top) = (low + high) / 2 - half, (low + high) / 2 + half
    picture.set(xlim=(left, right), ylim=(bottom, top))
    _write_at(figure, 16, _HEIGHT - 19, title, fontsize=10, color=INK, va="center")
    return figure, picture, figure.add_axes(_CHART)


def _write_at(figure: Figure, x: float, y: float, text: str, **look: Any) -> Any:
    """Write a text at a place of a film [px]."""
    return figure.text(x / _WIDTH, y / _HEIGHT, text, **look)


def _finish_chart(ax: Axes, end: float, step: float) -> Line2D:
    """Scale axes with curves of angles [°] over time, up to a multiple of `step`, and return the cursor."""
    largest = max(np.abs(np.asarray(line.get_ydata())).max() for line in ax.lines)
    most = step * max(math.ceil(largest / step - 1e-9), 1)
    ax.set(xlim=(0.0, end), ylim=(-most, most))
    ax.set_xticks([0.0, end], ["0", f"{end:.4g} s"])
    ax.set_yticks([-most, 0.0, most], [f"−{most:g}°", "0", f"{most:g}°"])
    ax.tick_params(length=0, labelcolor=LINE_GREY)
    ax.spines[["top", "right", "bottom"]].set_visible(False)
    ax.axhline(0.0, color=PALE, linewidth=0.8, zorder=0)
    return ax.axvline(0.0, color=INK, linewidth=0.9)


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
            *before, frame = self._frames
            palette = before[0] if before else None
            self._frames[-1] = frame.quantize(palette=palette, dither=0)

        def finish(self) -> None:
            first, *others = self._frames
            options = {"append_images": others, "duration": 1000 // RATE, "loop": 0}
            first.save(self.outfile, save_all=True, comment=about, **options)

    passing: list[Any] = []

    def update(k: int) -> list[Any]:
        for artist in passing:
            artist.remove()
        passing[:] = draw(k)
        return passing

    writer = FFMpegWriter if path.suffix.lower() == ".mp4" else GifWriter
    animation = FuncAnimation(figure, update, frames=frames)
    animation.save(path, writer=writer(fps=RATE, metadata={"comment": about}))
    for artist in passing:  # another film of the same figure may follow
        artist.remove()


class _FlightFilm:
    """The figure of a flight's film, and what draws its frames. The viewer follows the vehicle."""

    def __init__(self, flight: Flight, count: int) -> None:
        (self.arm,) = flight.vehicle.require(
            "arm_length", purpose="a picture of flight"
        )
        self.flight, self.count = flight, count
        self.t = flight.column("t")
        self.place = np.stack([flight.column(name) for name in "xyz"], axis=-1)
        self.screen = np.stack(screen_axes(DEFAULT_VIEW), axis=-1)
        self.shares = flight.thrusts / quarter_of_weight(flight)
        timed = flight.course.timed
        title = f"{name_of(timed.gait)}, T = {timed.period:g} s · {start_of(flight)}"
        seen = vehicle_view(np.zeros(4), flight.vehicle)
        self.figure, self.picture, chart = _blank_film(title, seen, zoom=0.68)
        for name, color, width in (("roll", INK, 1.5), ("pitch", LINE_GREY, 2.5)):
            angle = np.degrees(flight.column(name))
            chart.plot(
                self.t, angle, color=color, linewidth=width, label=f"body {name}"
            )
        self.cursor = _finish_chart(chart, max(flight.flown, 1e-9), 5.0)
        below: dict[str, Any] = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.02)}
        chart.legend(ncols=2, labelcolor=LINE_GREY, borderaxespad=0.2, **below)
        look: dict[str, Any] = {"fontsize": 8, "va": "top", "linespacing": 1.5}
        self.words = _write_at(
            self.figure, 16, _HEIGHT - 38, "", color=LINE_GREY, bbox=_BOX, **look
        )

    def draw(self, k: int) -> list[Any]:
        """Draw frame k of `count`; the last one has the verdict."""
        time = self.flight.flown * k / self.count
        row = max(int(np.searchsorted(self.t, time + 1e-12)) - 1, 0)
        here, shares = self.place[row], self.shares[row]
        x, y, z = np.round(here, 2) + 0.0
        text = (
            f"t = {self.t[row]:.2f} s{_speed(self.flight.flown)}\n"
            f"x {x:.2f} m   y {y:.2f} m   z {z:.2f} m\n"
            f"thrust {shares.min():.2f} to {shares.max():.2f} × weight/4"
        )
        self.words.set_text(text.replace("-", "−"))
        self.cursor.set_xdata([self.t[row]])
        drawn = self._draw_ground(here)
        track = self._seen(self.place[: row + 1], here)
        drawn += self.picture.plot(*track.T, color=LINE_GREY, linewidth=1.1, zorder=0.7)
        if self.flight.settings.reference != "attitude":
            wanted = [self.flight.column(f"{name}_wanted")[row] for name in "xyz"]
            ring: dict[str, Any] = {
                "markerfacecolor": "white",
                "markeredgecolor": LINE_GREY,
            }
            spot = self._seen(np.array(wanted), here)
            drawn += self.picture.plot(*spot, "o", markersize=6.0, zorder=0.8, **ring)
        drawn += draw_vehicle(self.picture, flight_view(self.flight, row))
        if k == self.count:
            drawn.append(self._write_verdict())
        return drawn

    def _seen(self, points: FloatArray, here: FloatArray) -> FloatArray:
        """Return points on the screen, in arm lengths from the vehicle."""
        return np.asarray((points - here) / self.arm @ self.screen)

    def _draw_ground(self, here: FloatArray) -> list[Any]:
        """Draw a grid on the ground around a position, and the shadow of the vehicle."""
        from matplotlib.ticker import MaxNLocator

        level, reach = -1.8 * self.arm, 12.0 * self.arm
        ticks = MaxNLocator(nbins=24, steps=[1, 2, 5, 10]).tick_values
        x, y = (ticks(place - reach, place + reach) for place in here[:2])
        crossings = np.stack(np.meshgrid(x, y, level), axis=-1)[:, :, 0]
        right, up = np.moveaxis(self._seen(crossings, here), -1, 0)
        look: dict[str, Any] = {"color": PALE, "linewidth": 0.8, "zorder": 0.5}
        around = np.linspace(0.0, math.tau, 25)
        ring = np.stack([np.cos(around), np.sin(around), 0 * around], axis=-1)
        shadow = [here[0], here[1], level] + 0.35 * self.arm * ring
        return [
            *self.picture.plot(right, up, **look),
            *self.picture.plot(right.T, up.T, **look),
            *self.picture.fill(*self._seen(shadow, here).T, color=PALE, zorder=0.6),
        ]

    def _write_verdict(self) -> Any:
        verdict = self.flight.reason or self.flight.verdict
        text = "\n".join(wrap(verdict, 52, max_lines=2, placeholder=" …"))
        look: dict[str, Any] = {"fontsize": 8, "weight": "bold", "va": "bottom"}
        box = _BOX | {"facecolor": PALE, "pad": 4}
        return _write_at(self.figure, 16, 118, text, color=INK, bbox=box, **look)


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
    roll, pitch = (f"{angle:.3g}°" for angle in np.degrees(flight.attitude))
    return f"from roll {roll}, pitch {pitch}".replace("-", "−")


def quarter_of_weight(flight: Flight) -> float:
    """Return a quarter of the weight [N], the unit of thrusts in pictures."""
    (mass,) = flight.vehicle.require("mass", purpose="a picture of flight")
    return float(mass * flight.vehicle.gravity / 4.0)
