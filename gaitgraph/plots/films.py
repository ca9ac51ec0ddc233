"""Films of gaits and flights: GIF by Pillow, MP4 where ffmpeg is installed.

A film of a gait shows one period: above the vehicle with its discs and lines of thrust, below its four angles over
time. A film of a flight follows the vehicle. The same gait gives the same GIF with the same versions of matplotlib and
Pillow.
"""

from __future__ import annotations

import math
from functools import partial
from io import BytesIO
from itertools import pairwise
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.errors import InputError, needs_extra, shown
from gaitgraph.files import blocks_of, check_new_files, write_whole
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
    from collections.abc import Callable, Iterable, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from gaitgraph.flight.record import Flight
    from gaitgraph.plots.vehicles import VehicleView

FloatArray = npt.NDArray[np.float64]

MOST_FRAMES = 100
"""Frames of a period, or of a flight by default, at most."""

_DELAY = 4  # 1/100 s between frames where that is enough
_SHORTEST, _FEWEST = 20, 10  # 1/100 s that a film lasts at least, and its frames
_LONGEST = 65535 * MOST_FRAMES  # 1/100 s that the format can state
_PALE = "#dfe2e7"
_SIZE = (480, 420)  # px, at 100 per inch
_PICTURE = (0.0, 112 / 420, 1.0, 272 / 420)  # axes: left, bottom, width, height
_TITLE = (16 / 480, 1 - 19 / 420)
_CHART = (52 / 480, 28 / 420, 412 / 480, 66 / 420)
_WIDE, _THIN = 3.6, 1.3  # of opposite rotors, which move together on the red sheet


def is_film(path: str | Path) -> bool:
    """Return whether a path has the suffix of a film, or of the animated SVG that earlier versions wrote."""
    return Path(path).suffix.lower() in (*FILMS, ".svg")


def check_films(paths: Sequence[str | Path], *, force: bool = False) -> None:
    """Raise before any work is done if a film cannot be written: its suffix, a library, a name that is taken."""
    for path in map(Path, paths):
        suffix = path.suffix.lower()
        if suffix not in FILMS:
            gone = "; the animated SVG was removed" if suffix == ".svg" else ""
            raise InputError(f"output {str(path)!r}: a film must be {' or '.join(FILMS)}{gone}")
        try:
            from matplotlib import animation
            from PIL import Image as _  # noqa: F401
        except ImportError as error:
            raise needs_extra(error.name or "Pillow", "a film", "plot") from error
        if suffix == ".mp4" and not animation.FFMpegWriter.isAvailable():
            raise InputError(f"output {str(path)!r}: MP4 needs the program ffmpeg; write a .gif, or install it")
    check_new_files(paths, force=force)


def write_films(pieces: Callable[[], Iterable[Table]], paths: Sequence[str | Path], *, force: bool = False) -> None:
    """Write films of a gait, one period at its own pace, each whole or not at all.

    Parameters
    ----------
    pieces
        Returns the gait's table, in pieces. Without times a period lasts a second.
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
    if not paths:
        return
    tables = list(pieces())
    rows = np.concatenate(
        [np.column_stack([one["t"] if "t" in one else np.zeros(len(one)), one.alpha]) for one in tables]
    )
    t, alpha = rows[:, 0] - rows[0, 0], rows[:, 1:]
    period = float(t[-1])
    if not period > 0:
        period, t = 1.0, np.linspace(0.0, 1.0, len(t))
    delays = frame_delays(period)
    phases = np.concatenate([[0.0], np.cumsum(delays)[:-1] / sum(delays)])
    vehicle, about = setting_of(tables[0])[0], tables[0].about
    angles = np.stack([np.interp(phases * period, t, column) for column in alpha.T], axis=-1)
    seen = vehicle_view(angles, vehicle)

    with paper_style():
        figure, picture, chart = _blank_film()
        _fit(picture, seen, 1.0)
        name = vehicle.name if len(vehicle.name) <= 32 else vehicle.name[:31] + "…"
        law, seconds = about.get("law"), sum(delays) / 100
        title = " · ".join([f"Vehicle {name}", f"T = {period:g} s", *([law] if isinstance(law, str) else [])])
        if abs(seconds - period) > max(0.005, 1e-9 * period):
            title += f" (shown {'slower' if seconds > period else 'faster'}: {seconds:g} s)"
        figure.text(*_TITLE, title, fontsize=10, color=INK, va="center")
        times = np.linspace(0.0, period, 161)
        curves = np.degrees([np.interp(times, t, column) for column in alpha.T])
        looks = [(color, _WIDE if k < 2 else _THIN, "") for k, color in enumerate(ROTOR_COLORS)]
        cursor = _draw_chart(chart, times, curves, looks, 10.0)
        drawn: list[Any] = []

        def draw(k: int) -> None:
            while drawn:
                drawn.pop().remove()
            drawn.extend(draw_vehicle(picture, seen, k))
            cursor.set_xdata([phases[k] * period])

        write = partial(_write_frames, figure, draw, delays, provenance_text(tables[0]))
        write_whole([(Path(path), write) for path in paths], force=force)


def frame_delays(seconds: float, frames: int | None = None) -> list[int]:
    """Return how long each frame is shown [1/100 s].

    They add up to the time, rounded to 1/100 s, from 0.2 s to 65535 s: a shorter film is shown slower, a longer one
    faster, because GIF cannot state the time. By default 25 frames a second, 10 to 100 in all.

    >>> frame_delays(1.0) == [4] * 25, sum(frame_delays(1.237)), len(frame_delays(60.0))
    (True, 124, 100)
    """
    total = round(min(max(100 * seconds, _SHORTEST), _LONGEST))
    count = frames or min(max(round(total / _DELAY), _FEWEST), MOST_FRAMES)
    ends = [round(max(total, 2 * count) * k / count) for k in range(count + 1)]
    return [after - before for before, after in pairwise(ends)]


def _blank_film() -> tuple[Figure, Axes, Axes]:
    """Return a figure with axes for the vehicle and for curves over time."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(_SIZE[0] / 100, _SIZE[1] / 100), dpi=100)
    picture = figure.add_axes(_PICTURE)
    picture.set_axis_off()
    return figure, picture, figure.add_axes(_CHART)


def _fit(ax: Axes, seen: VehicleView, zoom: float) -> None:
    """Let axes show a vehicle, at the largest equal scale at which it fits, times a factor."""
    low, high = seen.limits()
    size = np.array([_PICTURE[2] * _SIZE[0], _PICTURE[3] * _SIZE[1]])
    half = size * float(max((high - low) / size)) / 2 / zoom
    (left, bottom), (right, top) = (low + high) / 2 - half, (low + high) / 2 + half
    ax.set(xlim=(left, right), ylim=(bottom, top))


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


def _write_frames(figure: Figure, draw: Callable[[int], None], delays: Sequence[int], about: str, path: Path) -> None:
    """Draw frames one after the other into a film."""
    from matplotlib.animation import FFMpegWriter, PillowWriter

    class Gif(PillowWriter):
        """Writes frames that last differently, for ever, and what made them as the comment."""

        def finish(self) -> None:
            from PIL import Image

            # One palette for all frames, from a few of them, and no dither, which would flicker.
            frames = [frame.convert("RGB") for frame in self._frames]  # type: ignore[attr-defined]
            some = [np.asarray(frame) for frame in frames[:: max(len(frames) // 6, 1)]]
            palette = Image.fromarray(np.concatenate(some)).quantize(255, dither=Image.Dither.NONE)
            first, *others = (frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames)
            times = [10 * delay for delay in delays]
            first.save(
                self.outfile, save_all=True, append_images=others, duration=times, loop=0, comment=about.encode("ascii")
            )

    rate: Any = 100 * len(delays) / sum(delays)
    writer: Any = (
        Gif(fps=rate) if path.suffix.lower() == ".gif" else FFMpegWriter(fps=rate, metadata={"comment": about})
    )
    with writer.saving(figure, path, dpi=100):
        for k in range(len(delays)):
            draw(k)
            writer.grab_frame()


def provenance_of_gif(path: str | Path) -> str:
    """Return the text of what made a GIF; InputError if it is not whole or has none."""
    try:
        from PIL import Image, ImageSequence
    except ImportError as error:
        raise needs_extra("Pillow", "a film", "plot") from error
    allowed = "an animated GIF that gaitgraph wrote"
    content = b"".join(block for block, _ in blocks_of(Path(path), "gait file", allowed))
    try:
        with Image.open(BytesIO(content), formats=["GIF"]) as film:
            comment = film.info.get("comment")
            for frame in ImageSequence.Iterator(film):
                frame.load()
        if not content.endswith(b";"):
            raise EOFError
    except (OSError, EOFError, SyntaxError, ValueError) as error:
        raise InputError(f"it must be {allowed}, and is not whole") from error
    if comment is None:
        raise InputError(f"it must be {allowed}, and has no comment")
    return bytes(comment).decode("ascii", errors="replace")


# ---------------------------------------------------------------- flights

_ZOOM = 0.68  # of the largest scale at which a level vehicle fits
_MOST_SHARE = 2.4  # lines of thrust grow no longer
_GROUND = 1.8  # arm lengths below the start
_AROUND = 9.0  # arm lengths from the vehicle to the end of the grid
_HELD = 80  # 1/100 s that the last frame stays longer
_MOST_FLIGHT_FRAMES = 1000
_SLOW = 25  # frames in which the arms go through a period where even frames would be too few
_CURVE_POINTS = 400
_MAP = (380 / 480, 134 / 420, 88 / 480, 88 / 420)


def write_flight_film(flight: Flight, path: Path, *, frames: int | None = None, rendered: bool = False) -> None:
    """Write a film of a flight at its own pace; the last frame stays a little longer.

    Parameters
    ----------
    flight
        With at least one row.
    path
        A new file.
    frames
        How many, 2 to 1000; by default 25 a second, at most a hundred.
    rendered
        Whether the physics engine renders the frames. Their bytes are the same on the same machine only.

    Raises
    ------
    InputError
        If nothing was flown, `frames` is not allowed, or the engine cannot render here.
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
    times, delays, slowed = flight_frame_times(flight, frames)
    about = provenance_text(flight.table())
    if rendered:
        _write_rendered(flight, times, delays, about, path)
        return
    with paper_style():
        figure, draw = _flight_drawing(flight, times, slowed)
        _write_frames(figure, draw, delays, about, path)


def flight_frame_times(flight: Flight, frames: int | None = None) -> tuple[FloatArray, list[int], bool]:
    """Return when the frames of a film are [s], how long each is shown [1/100 s], and whether arms are slowed down."""
    if not len(flight.rows):
        raise InputError("a film needs a flight with rows, and nothing was flown")
    whole = isinstance(frames, int) and not isinstance(frames, bool)
    if frames is not None and not (whole and 2 <= frames <= _MOST_FLIGHT_FRAMES):
        raise InputError(f"frames must be a whole number from 2 to {_MOST_FLIGHT_FRAMES}, got {shown(frames)}")
    delays = frame_delays(max(flight.flown, 1e-6), frames)
    times = np.concatenate([[0.0], np.cumsum(delays)[:-1] / sum(delays)]) * flight.flown
    period = flight.course.timed.period
    slowed = bool(times[-1] > (len(times) - 1) * period / 2)
    if slowed:
        phases = np.arange(len(times)) / _SLOW
        times = np.clip((np.round(times / period - phases) + phases) * period, 0.0, flight.flown)
    times[-1] = flight.flown
    delays[-1] += _HELD
    return times, delays, slowed


def _write_rendered(flight: Flight, times: FloatArray, delays: Sequence[int], about: str, path: Path) -> None:
    from matplotlib.figure import Figure

    from gaitgraph.flight.engine import rendered_frames

    pictures = rendered_frames(flight, times, view=DEFAULT_VIEW)
    height, width = pictures.shape[1:3]
    figure = Figure(figsize=(width / 100, height / 100), dpi=100)
    image = figure.figimage(pictures[0])
    _write_frames(figure, lambda k: image.set_data(pictures[k]), delays, about, path)


def flight_view(flight: Flight, row: int) -> VehicleView:
    """Return the vehicle in a row of a flight, at its attitude, with lines as long as its thrusts."""
    mass, _ = flight.vehicle.require("mass", "arm_length", purpose="a picture of flight")
    shares = np.clip(4.0 * flight.thrusts[row] / (mass * flight.vehicle.gravity), -_MOST_SHARE, _MOST_SHARE)
    roll, pitch, yaw = (float(flight.column(name)[row]) for name in ("roll", "pitch", "yaw"))
    (cr, cp, cy), (sr, sp, sy) = ([f(angle) for angle in (roll, pitch, yaw)] for f in (math.cos, math.sin))
    attitude = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    alpha = [float(flight.column(f"alpha{k + 1}")[row]) for k in range(4)]
    return vehicle_view(alpha, flight.vehicle, attitude=attitude, thrusts=shares)


def _flight_drawing(flight: Flight, times: FloatArray, slowed: bool) -> tuple[Figure, Callable[[int], None]]:
    """Return the figure of a flight's film, and what draws a frame of it."""
    mass, arm = flight.vehicle.require("mass", "arm_length", purpose="a picture of flight")
    quarter = mass * flight.vehicle.gravity / 4.0
    t = flight.column("t")
    place = np.stack([flight.column(name) for name in "xyz"], axis=-1)
    tracks = flight.settings.reference != "attitude"
    wanted = np.stack([flight.column(f"{name}_wanted") for name in "xyz"], axis=-1) if tracks else place
    every = np.unique(np.linspace(0, len(place) - 1, min(len(place), _CURVE_POINTS)).astype(int))
    screen = np.stack(screen_axes(DEFAULT_VIEW), axis=-1)

    figure, picture, chart = _blank_film()
    _fit(picture, vehicle_view(np.zeros(4), flight.vehicle), _ZOOM)
    timed = flight.course.timed
    head = f"{timed.gait.color.capitalize()} gait" if timed.gait.color else "Gait"
    roll, pitch = (f"{math.degrees(angle):.3g}°" for angle in flight.attitude)
    title = f"{head}, T = {timed.period:g} s · from roll {roll}, pitch {pitch}".replace("-", "−")
    figure.text(*_TITLE, title, fontsize=10, color=INK, va="center")
    angles = np.degrees([flight.column(name)[every] for name in ("roll", "pitch")])
    cursor = _draw_chart(chart, t[every], angles, [(INK, 1.5, "roll"), (LINE_GREY, 2.5, "pitch")], 5.0)
    chart.legend(loc="upper center", bbox_to_anchor=(0.5, -0.02), ncols=2, labelcolor=LINE_GREY, borderaxespad=0.2)
    path_seen, trail = _draw_map(figure, place[every], wanted[every] if tracks else None, arm)
    ground: dict[str, Any] = {"facecolor": "white", "edgecolor": "none", "pad": 1.5}
    look: dict[str, Any] = {"fontsize": 8, "color": LINE_GREY, "va": "top", "linespacing": 1.5, "bbox": ground}
    words = figure.text(16 / _SIZE[0], 1 - 38 / _SIZE[1], "", **look)
    drawn: list[Any] = []

    def draw(k: int) -> None:
        row = int(np.clip(np.searchsorted(t, times[k] + 1e-12) - 1, 0, len(place) - 1))
        here = place[row]

        def seen(points: FloatArray) -> FloatArray:
            return np.asarray((points - here) / arm @ screen)

        while drawn:
            drawn.pop().remove()
        drawn.extend(_draw_ground(picture, here, arm, seen))
        steps = np.unique(np.linspace(0, row, min(row + 1, _CURVE_POINTS)).astype(int))
        drawn.extend(picture.plot(*seen(place[steps]).T, color=LINE_GREY, linewidth=1.1, zorder=0.7))
        if tracks:
            ring: dict[str, Any] = {"markersize": 6.0, "markerfacecolor": "white", "markeredgecolor": LINE_GREY}
            drawn.extend(picture.plot(*seen(wanted[row]), "o", zorder=0.8, **ring))
        drawn.extend(draw_vehicle(picture, flight_view(flight, row)))
        shares = flight.thrusts[row] / quarter
        x, y, z = np.round(here, 2) + 0.0
        words.set_text(
            f"t = {t[row]:.2f} s{', arms slowed down' if slowed else ''}\n"
            f"x {x:.2f} m   y {y:.2f} m   z {z:.2f} m\n"
            f"thrust {shares.min():.2f} to {shares.max():.2f} × weight/4".replace("-", "−")
        )
        path_seen.set_data(-place[every[every <= row], 1], place[every[every <= row], 0])
        trail.set_data([-here[1]], [here[0]])
        cursor.set_xdata([t[row]])
        if k == len(times) - 1:
            verdict = f"settled after {flight.settling_time:.2f} s" if flight.settled else flight.reason
            lines = wrap(verdict, 52)
            box = {"facecolor": _PALE, "edgecolor": "none", "pad": 4.0}
            text = "\n".join([*lines[:2][:-1], lines[:2][-1] + (" …" if len(lines) > 2 else "")])
            bold: dict[str, Any] = {"fontsize": 8, "weight": "bold", "color": INK, "va": "bottom", "bbox": box}
            drawn.append(figure.text(16 / _SIZE[0], 118 / _SIZE[1], text, **bold))

    return figure, draw


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
    drawn: list[Any] = ax.plot(*seen(np.concatenate(lines)).T, color=_PALE, linewidth=0.8, zorder=0.5)
    around = np.linspace(0.0, math.tau, 25)
    ring = [here[0], here[1], level] + 0.35 * arm * np.stack([np.cos(around), np.sin(around), 0 * around], axis=-1)
    drawn.extend(ax.fill(*seen(ring).T, color=_PALE, zorder=0.6))
    return drawn


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
