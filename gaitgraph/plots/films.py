"""Films of gaits and flights: GIF by Pillow, MP4 where ffmpeg is installed.

A film of a gait shows one period: above the vehicle with its discs and lines of thrust, below its four angles over
time. A film of a flight follows the vehicle. The same gait gives the same GIF with the same versions of matplotlib and
Pillow.
"""

from __future__ import annotations

import math
from functools import partial
from itertools import pairwise
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.errors import InputError, needs_extra
from gaitgraph.files import check_new_files, write_whole
from gaitgraph.gait.table import Table, provenance_text, setting_of
from gaitgraph.io.formats import FILMS
from gaitgraph.plots.axes import paper_style
from gaitgraph.plots.vehicles import (
    DEFAULT_VIEW,
    INK,
    LINE_GREY,
    ROTOR_COLORS,
    draw_vehicle,
    screen_axes,
    vehicle_view,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from gaitgraph.flight.record import Flight
    from gaitgraph.plots.vehicles import VehicleView

    Frame = Callable[[int], list[Any]]

FloatArray = npt.NDArray[np.float64]

MOST_FRAMES = 100
"""Frames of a film at most."""

_DELAY = 4  # 1/100 s between frames where that is enough
_SHORTEST, _FEWEST = 20, 10  # 1/100 s that a film lasts at least, and its frames
_LONGEST = 65535 * MOST_FRAMES  # 1/100 s that the format can state
_PALE = "#dfe2e7"
_WIDTH, _HEIGHT = 480, 420  # px, at 100 per inch
_PICTURE = (0.0, 112 / 420, 1.0, 272 / 420)  # axes: left, bottom, width, height
_CHART = (52 / 480, 28 / 420, 412 / 480, 66 / 420)
_MAP = (380 / 480, 134 / 420, 88 / 480, 88 / 420)
_WIDE, _THIN = 3.6, 1.3  # of opposite rotors, which move together on the red sheet


def check_films(paths: Sequence[str | Path], *, force: bool = False) -> None:
    """Raise before any work is done if a film cannot be written: its suffix, a library, a name that is taken."""
    for path in map(Path, paths):
        if path.suffix.lower() not in FILMS:
            raise InputError(f"output {str(path)!r}: a film must be {' or '.join(FILMS)}")
        try:
            from matplotlib import animation
            from PIL import Image as _  # noqa: F401
        except ImportError as error:
            raise needs_extra(error.name or "Pillow", "a film", "plot") from error
        if path.suffix.lower() == ".mp4" and not animation.FFMpegWriter.isAvailable():
            raise InputError(f"output {str(path)!r}: MP4 needs the program ffmpeg; write a .gif, or install it")
    check_new_files(paths, force=force)


def write_films(table: Table, paths: Sequence[str | Path], *, force: bool = False) -> None:
    """Write films of a gait, one period at its own pace, each whole or not at all.

    Parameters
    ----------
    table
        The gait's rows. Without times a period lasts a second.
    paths
        Files with the suffix .gif or .mp4.
    force
        Overwrite files that exist.

    Raises
    ------
    InputError, MissingExtra, FileProblem, OutputExists
        If the suffix is no film's, matplotlib, Pillow or ffmpeg is missing, or a file cannot be written.
    """
    check_films(paths, force=force)
    t = table["t"] - table["t"][0] if "t" in table else np.zeros(1)
    period, vehicle = float(t[-1]), setting_of(table)[0]
    if not period > 0:
        period, t = 1.0, np.linspace(0.0, 1.0, len(table))
    delays = frame_delays(period)
    phases = np.concatenate([[0.0], np.cumsum(delays)[:-1] / sum(delays)])

    def angles_at(times: FloatArray) -> FloatArray:
        return np.stack([np.interp(times, t, column) for column in table.alpha.T])

    seen = vehicle_view(angles_at(phases * period).T, vehicle)
    name = vehicle.name if len(vehicle.name) <= 32 else vehicle.name[:31] + "…"
    law, seconds = table.about.get("law"), sum(delays) / 100
    title = " · ".join([f"Vehicle {name}", f"T = {period:g} s", *([law] if isinstance(law, str) else [])])
    if abs(seconds - period) > max(0.005, 1e-9 * period):
        title += f" (shown {'slower' if seconds > period else 'faster'}: {seconds:g} s)"
    with paper_style():
        figure, picture, chart = _blank_film(title, seen, 1.0)
        times = np.linspace(0.0, period, 161)
        looks = [(color, _WIDE if k < 2 else _THIN, "") for k, color in enumerate(ROTOR_COLORS)]
        cursor = _draw_chart(chart, times, np.degrees(angles_at(times)), looks, 10.0)

        def frame(k: int) -> list[Any]:
            cursor.set_xdata([phases[k] * period])
            return draw_vehicle(picture, seen, k)

        write = partial(_write_frames, figure, frame, delays, provenance_text(table))
        write_whole([(Path(path), write) for path in paths], force=force)


def frame_delays(seconds: float) -> list[int]:
    """Return how long each frame is shown [1/100 s]: 25 a second, 10 to 100 in all.

    They add up to the time, rounded to 1/100 s, from 0.2 s to 65535 s: a shorter film is shown slower, a longer one
    faster, because GIF cannot state the time.

    >>> frame_delays(1.0) == [4] * 25, sum(frame_delays(1.237)), len(frame_delays(60.0))
    (True, 124, 100)
    """
    total = round(min(max(100 * seconds, _SHORTEST), _LONGEST))
    count = min(max(round(total / _DELAY), _FEWEST), MOST_FRAMES)
    return [after - before for before, after in pairwise(round(total * k / count) for k in range(count + 1))]


def _blank_film(title: str, seen: VehicleView, zoom: float) -> tuple[Figure, Axes, Axes]:
    """Return a figure with axes for a vehicle, at the largest scale at which it fits times a factor, and for curves."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(_WIDTH / 100, _HEIGHT / 100), dpi=100)
    picture = figure.add_axes(_PICTURE)
    picture.set_axis_off()
    low, high = seen.limits()
    size = np.array([_PICTURE[2] * _WIDTH, _PICTURE[3] * _HEIGHT])
    half = size * float(max((high - low) / size)) / 2 / zoom
    (left, bottom), (right, top) = (low + high) / 2 - half, (low + high) / 2 + half
    picture.set(xlim=(left, right), ylim=(bottom, top))
    figure.text(16 / _WIDTH, 1 - 19 / _HEIGHT, title, fontsize=10, color=INK, va="center")
    return figure, picture, figure.add_axes(_CHART)


def _draw_chart(
    ax: Axes, times: FloatArray, curves: FloatArray, looks: Sequence[tuple[str, float, str]], step: float
) -> Any:
    """Draw angles [°] over time, and return the cursor. The axis ends at a multiple of a step."""
    most = max(step * math.ceil(float(np.abs(curves).max()) / step - 1e-9), step)
    for curve, (color, width, label) in zip(curves, looks, strict=True):
        ax.plot(times, curve, color=color, linewidth=width, label=label)
    end = max(float(times[-1]), 1e-9)
    ax.set(xlim=(0.0, end), ylim=(-most, most), xticks=[0.0, end], yticks=[-most, 0.0, most])
    ax.set_xticklabels(["0", f"{end:.4g} s"])
    ax.set_yticklabels([f"−{most:g}°", "0", f"{most:g}°"])
    ax.tick_params(length=0, labelcolor=LINE_GREY)
    ax.spines[["top", "right", "bottom"]].set_visible(False)
    ax.axhline(0.0, color=_PALE, linewidth=0.8, zorder=0)
    return ax.axvline(0.0, color=INK, linewidth=0.9)


def _write_frames(figure: Figure, frame: Frame, delays: Sequence[int], about: str, path: Path) -> None:
    """Write a film; `frame` draws frame k and returns what has to go before the next one."""
    from matplotlib.animation import FFMpegWriter
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from PIL import Image

    def drawn() -> Iterator[None]:
        for k in range(len(delays)):
            passing = frame(k)
            yield
            for one in passing:
                one.remove()

    if path.suffix.lower() == ".mp4":
        writer: Any = FFMpegWriter(fps=100 * len(delays) / sum(delays), metadata={"comment": about})  # type: ignore[arg-type]
        with writer.saving(figure, path, dpi=100):
            for _ in drawn():
                writer.grab_frame()
        return
    canvas: Any = FigureCanvasAgg(figure)
    frames = []
    for _ in drawn():
        canvas.draw()
        frames.append(Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB"))
    # One palette for all frames, from a few of them, and no dither, which would flicker.
    some = [np.asarray(one) for one in frames[:: max(len(frames) // 6, 1)]]
    palette = Image.fromarray(np.concatenate(some)).quantize(255, dither=Image.Dither.NONE)
    first, *others = (one.quantize(palette=palette, dither=Image.Dither.NONE) for one in frames)
    times = [10 * delay for delay in delays]
    first.save(path, save_all=True, append_images=others, duration=times, loop=0, comment=about.encode("ascii"))


# ---------------------------------------------------------------- flights

_ZOOM = 0.68  # of the largest scale at which a level vehicle fits
_MOST_SHARE = 2.4  # lines of thrust grow no longer
_GROUND = 1.8  # arm lengths below the start
_AROUND = 9.0  # arm lengths from the vehicle to the end of the grid
_HELD = 80  # 1/100 s that the last frame stays longer
_SLOW = 25  # frames in which the arms go through a period where even frames would be too few
_CURVE_POINTS = 400


def write_flight_film(flight: Flight, path: Path) -> None:
    """Write a film of a flight at its own pace; the last frame stays a little longer.

    Parameters
    ----------
    flight
        With at least one row.
    path
        A new file.

    Raises
    ------
    InputError
        If nothing was flown.
    MissingExtra
        If matplotlib or Pillow is missing.

    Notes
    -----
    The viewer is behind, right and above, and follows the vehicle; lines on the ground, 1.8 arm lengths below the
    start, show that it moves. Lines of thrust are as long as the thrust is large, up to 2.4 times a quarter of the
    weight, and lie on the other side of the disc where a rotor pulls.

    Frames are even in time, except where a period has fewer than two of them: each is then taken up to half a period
    earlier or later, so that the arms go through the gait once in 25 frames, slower than they are, as the frames state.
    """
    times, delays, slowed = flight_frame_times(flight)
    with paper_style():
        figure, frame = _flight_film(flight, times, slowed)
        _write_frames(figure, frame, delays, provenance_text(flight.table()), path)


def flight_frame_times(flight: Flight) -> tuple[FloatArray, list[int], bool]:
    """Return when the frames of a film are [s], how long each is shown [1/100 s], and whether arms are slowed down."""
    if not len(flight.rows):
        raise InputError("a film needs a flight with rows, and nothing was flown")
    delays = frame_delays(max(flight.flown, 1e-6))
    times = np.concatenate([[0.0], np.cumsum(delays)[:-1] / sum(delays)]) * flight.flown
    period = flight.course.timed.period
    slowed = bool(times[-1] > (len(times) - 1) * period / 2)
    if slowed:
        phases = np.arange(len(times)) / _SLOW
        times = np.clip((np.round(times / period - phases) + phases) * period, 0.0, flight.flown)
    times[-1] = flight.flown
    delays[-1] += _HELD
    return times, delays, slowed


def flight_view(flight: Flight, row: int) -> VehicleView:
    """Return the vehicle in a row of a flight, at its attitude, with lines as long as its thrusts."""
    shares = np.clip(flight.thrusts[row] / quarter_of_weight(flight), -_MOST_SHARE, _MOST_SHARE)
    angles = [float(flight.column(name)[row]) for name in ("roll", "pitch", "yaw")]
    (cr, cp, cy), (sr, sp, sy) = np.cos(angles), np.sin(angles)
    attitude = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    alpha = [float(flight.column(f"alpha{k + 1}")[row]) for k in range(4)]
    return vehicle_view(alpha, flight.vehicle, attitude=attitude, thrusts=shares)


def quarter_of_weight(flight: Flight) -> float:
    """Return a quarter of the weight [N], the unit of thrusts in pictures."""
    (mass,) = flight.vehicle.require("mass", purpose="a picture of flight")
    return float(mass * flight.vehicle.gravity / 4.0)


def _flight_film(flight: Flight, times: FloatArray, slowed: bool) -> tuple[Figure, Frame]:
    """Return the figure of a flight's film, and what draws a frame of it."""
    (arm,) = flight.vehicle.require("arm_length", purpose="a picture of flight")
    t, timed, quarter = flight.column("t"), flight.course.timed, quarter_of_weight(flight)
    place = np.stack([flight.column(name) for name in "xyz"], axis=-1)
    tracks = flight.settings.reference != "attitude"
    wanted = np.stack([flight.column(f"{name}_wanted") for name in "xyz"], axis=-1) if tracks else place
    every = np.unique(np.linspace(0, len(place) - 1, min(len(place), _CURVE_POINTS)).astype(int))
    screen = np.stack(screen_axes(DEFAULT_VIEW), axis=-1)

    head = f"{timed.gait.color.capitalize()} gait" if timed.gait.color else "Gait"
    roll, pitch = (f"{math.degrees(angle):.3g}°" for angle in flight.attitude)
    title = f"{head}, T = {timed.period:g} s · from roll {roll}, pitch {pitch}".replace("-", "−")
    figure, picture, chart = _blank_film(title, vehicle_view(np.zeros(4), flight.vehicle), _ZOOM)
    angles = np.degrees([flight.column(name)[every] for name in ("roll", "pitch")])
    cursor = _draw_chart(chart, t[every], angles, [(INK, 1.5, "roll"), (LINE_GREY, 2.5, "pitch")], 5.0)
    chart.legend(loc="upper center", bbox_to_anchor=(0.5, -0.02), ncols=2, labelcolor=LINE_GREY, borderaxespad=0.2)
    path_seen, trail = _draw_map(figure, place[every], wanted[every] if tracks else None, arm)
    look: dict[str, Any] = {"fontsize": 8, "color": LINE_GREY, "va": "top", "linespacing": 1.5}
    box: dict[str, Any] = {"facecolor": "white", "edgecolor": "none", "pad": 1.5}
    words = figure.text(16 / _WIDTH, 1 - 38 / _HEIGHT, "", bbox=box, **look)

    def frame(k: int) -> list[Any]:
        row = int(np.clip(np.searchsorted(t, times[k] + 1e-12) - 1, 0, len(place) - 1))
        here, before = place[row], every[every <= row]

        def seen(points: FloatArray) -> FloatArray:
            return np.asarray((points - here) / arm @ screen)

        drawn = _draw_ground(picture, here, arm, seen)
        steps = np.unique(np.linspace(0, row, min(row + 1, _CURVE_POINTS)).astype(int))
        drawn += picture.plot(*seen(place[steps]).T, color=LINE_GREY, linewidth=1.1, zorder=0.7)
        if tracks:
            ring: dict[str, Any] = {"markersize": 6.0, "markerfacecolor": "white", "markeredgecolor": LINE_GREY}
            drawn += picture.plot(*seen(wanted[row]), "o", zorder=0.8, **ring)
        drawn += draw_vehicle(picture, flight_view(flight, row))
        shares = flight.thrusts[row] / quarter
        x, y, z = np.round(here, 2) + 0.0
        words.set_text(
            f"t = {t[row]:.2f} s{', arms slowed down' if slowed else ''}\n"
            f"x {x:.2f} m   y {y:.2f} m   z {z:.2f} m\n"
            f"thrust {shares.min():.2f} to {shares.max():.2f} × weight/4".replace("-", "−")
        )
        path_seen.set_data(-place[before, 1], place[before, 0])
        trail.set_data([-here[1]], [here[0]])
        cursor.set_xdata([t[row]])
        if k == len(times) - 1:
            verdict = f"settled after {flight.settling_time:.2f} s" if flight.settled else flight.reason
            text = "\n".join(wrap(verdict, 52, max_lines=2, placeholder=" …"))
            bold: dict[str, Any] = {"fontsize": 8, "weight": "bold", "color": INK, "va": "bottom"}
            drawn.append(
                figure.text(16 / _WIDTH, 118 / _HEIGHT, text, bbox=box | {"facecolor": _PALE, "pad": 4}, **bold)
            )
        return drawn

    return figure, frame


def _draw_ground(ax: Axes, here: FloatArray, arm: float, seen: Callable[[FloatArray], FloatArray]) -> list[Any]:
    """Draw a grid on the ground around a place, and the shadow of the vehicle."""
    level, reach = -_GROUND * arm, _AROUND * arm
    power = 10.0 ** math.floor(math.log10(1.4 * arm))
    spacing = max(step * power for step in (1.0, 2.0, 5.0) if step * power <= 1.4 * arm * (1 + 1e-12))
    lines = []
    for axis in (0, 1):
        for k in range(math.ceil((here[axis] - reach) / spacing), math.floor((here[axis] + reach) / spacing) + 1):
            line = np.full((3, 3), np.nan)  # the last row parts it from the next line
            line[:2, axis], line[:2, 2] = k * spacing, level
            line[:2, 1 - axis] = here[1 - axis] + np.array([-reach, reach])
            lines.append(line)
    around = np.linspace(0.0, math.tau, 25)
    ring = [here[0], here[1], level] + 0.35 * arm * np.stack([np.cos(around), np.sin(around), 0 * around], axis=-1)
    grid = ax.plot(*seen(np.concatenate(lines)).T, color=_PALE, linewidth=0.8, zorder=0.5)
    return [*grid, *ax.fill(*seen(ring).T, color=_PALE, zorder=0.6)]


def _draw_map(figure: Figure, place: FloatArray, wanted: FloatArray | None, arm: float) -> tuple[Any, Any]:
    """Draw the flight from above, forward up, and return the path so far and the mark of the vehicle."""
    points = np.concatenate([place[:, :2]] + ([] if wanted is None else [wanted[:, :2]]))
    low, high = points.min(axis=0), points.max(axis=0)
    middle, half = (low + high) / 2, max(float((high - low).max()) / 2 * 1.15, 1.5 * arm)
    ax = figure.add_axes(_MAP, xticks=[], yticks=[])
    ax.set(xlim=(-middle[1] - half, -middle[1] + half), ylim=(middle[0] - half, middle[0] + half))
    ax.spines[:].set_color(_PALE)
    if wanted is not None:
        ax.plot(-wanted[:, 1], wanted[:, 0], color=_PALE, linewidth=2.2)
    ax.set_xlabel(f"{2 * half:.3g} m, from above", color=LINE_GREY, fontsize=7.5, labelpad=2.0)
    path = ax.plot([], [], color=INK, linewidth=0.9)[0]
    return path, ax.plot([], [], "o", color=INK, markersize=4.3)[0]
