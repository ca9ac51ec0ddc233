"""A flight as an animated GIF: the vehicle with its tilting rotors and thrusts, followed by the viewer.

Drawn as the animated pictures of gaits are, with the same scene turned to the body's attitude: no graphics card and no
window is needed, and the same flight gives the same bytes, as long as Pillow is the same.
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.errors import InputError, needs_extra, shown
from gaitgraph.flight.engine import rendered_frames
from gaitgraph.gait.table import provenance_text
from gaitgraph.plots.film_settings import CHART, GREY, HEIGHT, INK, PALE, PAPER, SCENE, WIDTH, Film
from gaitgraph.plots.gif_films import (
    draw_dot,
    draw_line,
    draw_text,
    frame_delays,
    frame_of,
    in_palette,
    save_gif,
    text_width,
)
from gaitgraph.plots.scenes import DEFAULT_VIEW, Scene, scene_of

if TYPE_CHECKING:
    from pathlib import Path

    from gaitgraph.flight.record import Flight

__all__ = ["write_film", "write_rendered_film"]

FloatArray = npt.NDArray[np.float64]

_OVER = 2  # drawn so much larger, then averaged: smooth edges
_ZOOM = 0.68  # of the largest scale at which a level vehicle fits
_MOST_SHARE = 2.4  # lines of thrust grow no longer
_GROUND = 1.8  # arm lengths below the start
_AROUND = 9.0  # arm lengths from the vehicle to the end of the grid
_HELD = 80  # the last frame [1/100 s]
_MAP = (380.0, 198.0, 88.0)  # left, top, side of the square seen from above
_CURVE_POINTS = 400
_VERDICT = 320.0  # px that a line of the verdict takes, at most
_MOST_FRAMES = 1000
_FEW = 2.0  # frames of a period; where there are fewer, they would show few phases of it, or always the same one
_SLOW = 25  # frames in which the arms then go through a period


def write_film(flight: Flight, path: Path, *, frames: int | None = None) -> None:
    """Write a flight as an animated GIF at its own pace; the text of what made it is its comment.

    Parameters
    ----------
    flight
        With at least one row; the last frame stays a little longer.
    path
        A new file.
    frames
        How many, 2 to 1000, for a smaller file or a smoother one; by default 25 a second, at most a hundred.

    Raises
    ------
    InputError
        If nothing was flown, or `frames` is not allowed.
    MissingExtra
        If Pillow is not there, or matplotlib, which brings the letters.

    Notes
    -----
    The viewer stands behind, right and above, and follows the vehicle; lines on the ground, 1.8 arm lengths below the
    start, show that it moves. Lines of thrust are as long as the thrust is large, up to 2.4 times a quarter of the
    weight, and lie on the other side of the disc where a rotor pulls.

    Frames are even in time. Only where a period has fewer than two of them they would show always the same moments of
    it: each is then taken up to half a period earlier or later, so that the arms go through the gait once in 25
    frames, slower than they are, and the frames say so.
    """
    try:
        import matplotlib as _  # noqa: F401
        from PIL import Image  # noqa: F401
    except ImportError as error:
        raise needs_extra(error.name or "Pillow", "animated GIF", "plot") from error

    times, delays = _clock_of(flight, frames)
    drawing = _Drawing(flight, slowed=_is_slowed(times, flight.course.timed.period))
    flat = in_palette(drawing.frame(float(t)) for t in times)
    save_gif(flat, delays, provenance_text(flight.table()), path)


def write_rendered_film(flight: Flight, path: Path, *, frames: int | None = None) -> None:
    """Write a flight as an animated GIF that the engine renders; see :func:`write_film`.

    The bytes are the same on the same machine only.

    Raises
    ------
    InputError
        If the engine cannot render here, nothing was flown, or `frames` is not allowed.
    MissingExtra
        If Pillow is not there.
    """
    try:
        from PIL import Image
    except ImportError as error:
        raise needs_extra(error.name or "Pillow", "animated GIF", "plot") from error

    times, delays = _clock_of(flight, frames)
    pictures = rendered_frames(flight, times, view=DEFAULT_VIEW)
    # One palette for all, from a few pictures side by side; dots of dither would flicker.
    some = np.concatenate(pictures[:: max(len(pictures) // 6, 1)], axis=0)
    palette = Image.fromarray(some).quantize(255, dither=Image.Dither.NONE)
    flat = [Image.fromarray(one).quantize(palette=palette, dither=Image.Dither.NONE) for one in pictures]
    save_gif(flat, delays, provenance_text(flight.table()), path)


def _clock_of(flight: Flight, frames: int | None) -> tuple[FloatArray, list[int]]:
    """Return when the frames of a film are [s], and how long each is shown [1/100 s]."""
    if not len(flight.rows):
        raise InputError("film: nothing was flown; allowed is a flight with rows")
    delays = _delays(flight.flown, frames)
    times = np.concatenate([[0.0], np.cumsum(delays)[:-1] / sum(delays)]) * flight.flown
    period = flight.course.timed.period
    if _is_slowed(times, period):
        phases = np.arange(len(times)) / _SLOW
        times = np.clip((np.round(times / period - phases) + phases) * period, 0.0, flight.flown)
    times[-1] = flight.flown
    delays[-1] += _HELD
    return times, delays


def _is_slowed(times: FloatArray, period: float) -> bool:
    """Return whether even frames are too few for a period."""
    return bool(times[-1] > (len(times) - 1) * period / _FEW)


def _delays(seconds: float, frames: int | None) -> list[int]:
    """Return how long each frame is shown [1/100 s]."""
    if frames is None:
        return frame_delays(max(seconds, 1e-6))
    if isinstance(frames, bool) or not isinstance(frames, int) or not 2 <= frames <= _MOST_FRAMES:
        raise InputError(f"frames: {shown(frames)}; allowed is a whole number from 2 to {_MOST_FRAMES}")
    total = max(round(100 * seconds), 2 * frames)
    ends = [round(total * k / frames) for k in range(frames + 1)]
    return [after - before for before, after in pairwise(ends)]


class _Drawing:
    """What all frames of a flight share."""

    def __init__(self, flight: Flight, *, slowed: bool = False) -> None:
        self.flight = flight
        self.slowed = slowed
        (mass, self.arm) = flight.vehicle.require("mass", "arm_length", purpose="a picture of flight")
        self.quarter = mass * flight.vehicle.gravity / 4.0
        azimuth, elevation = DEFAULT_VIEW
        self.right, self.up = _screen(azimuth, elevation)
        self.viewer = np.cross(self.right, self.up)
        level = scene_of(np.zeros((1, 4)), flight.vehicle, size=SCENE[2:])
        self.scale = _ZOOM * level.scale
        self.centre = np.array([SCENE[2] / 2, SCENE[3] / 2])
        self.place = np.stack([flight.column(name) for name in "xyz"], axis=-1)
        self.wanted = np.stack([flight.column(f"{name}_wanted") for name in "xyz"], axis=-1)
        self.tracks = flight.settings.reference != "attitude"
        self.most = _round_up(float(np.degrees(np.abs(self._attitudes()).max())))
        self.map_centre, self.map_half = self._map_extent()
        timed = flight.course.timed
        color = timed.gait.color
        head = f"{color.capitalize()} gait" if color else "Gait"
        roll, pitch = (f"{math.degrees(angle):.3g}°" for angle in flight.attitude)
        self.title = f"{head}, T = {timed.period:g} s · from roll {roll}, pitch {pitch}".replace("-", "−")

    def _attitudes(self) -> FloatArray:
        return np.stack([self.flight.column(name) for name in ("roll", "pitch")], axis=-1)

    def _map_extent(self) -> tuple[FloatArray, float]:
        points = np.concatenate([self.place[:, :2], self.wanted[:, :2]] if self.tracks else [self.place[:, :2]])
        low, high = points.min(axis=0), points.max(axis=0)
        return (low + high) / 2, max(float((high - low).max()) / 2 * 1.15, 1.5 * self.arm)

    def frame(self, t: float) -> Any:
        """Return the picture of one time."""
        flight = self.flight
        row = int(np.clip(np.searchsorted(flight.column("t"), t + 1e-12) - 1, 0, len(flight.rows) - 1))
        ground = self._ground(row)
        scene = self._scene(row)
        film = Film(scene=scene, title="", about="", alpha=np.zeros((2, 4)), most=1.0)
        share = t / flight.flown if flight.flown else 0.0
        # The drawing of gaits takes which of how many frames it is, for the cursor; here it is one of a thousand.
        picture = frame_of(film, ground, round(1000 * share), 1000)
        over, boxes = self._over(row)
        for box in boxes:
            picture.paste(over.crop(box), box)
        return picture

    def _scene(self, row: int) -> Scene:
        """Return the scene of a row: that of the body seen from where the viewer is for it, turned and moved."""
        flight = self.flight
        turned = _rotation(*(float(flight.column(name)[row]) for name in ("roll", "pitch", "yaw")))
        seen = turned.T @ self.viewer
        azimuth, elevation = math.atan2(seen[1], seen[0]), math.asin(max(-1.0, min(1.0, float(seen[2]))))
        alpha = np.array([float(flight.column(f"alpha{k + 1}")[row]) for k in range(4)])
        scene = scene_of(alpha, flight.vehicle, size=SCENE[2:], view=(azimuth, elevation))
        right, up = _screen(azimuth, elevation)
        # What is to the right and up for the body's scene lies aslant on the screen.
        aslant = np.array(
            [
                [self.right @ turned @ right, -(self.right @ turned @ up)],
                [-(self.up @ turned @ right), self.up @ turned @ up],
            ]
        )
        onto = aslant * (self.scale / scene.scale)

        def moved(points: FloatArray) -> FloatArray:
            return np.asarray((points - scene.hub) @ onto.T + self.centre)

        shares = np.clip(flight.thrusts[row] / self.quarter, -_MOST_SHARE, _MOST_SHARE)
        centres = scene.discs[:, :, 4:]
        tips = centres + (scene.thrusts - centres) * shares[None, :, None]
        discs = np.concatenate([scene.discs[:, :, :2] @ onto.T, scene.discs[:, :, 2:4] @ onto.T, moved(centres)], -1)
        frames = np.ones((1001, 1, 1))
        pulls = shares < 0.0
        return replace(
            scene,
            discs=frames * discs,
            thrusts=frames * moved(tips),
            facing=(frames[..., 0] * (scene.facing ^ pulls)) > 0,
            hub=self.centre,
            arms=moved(scene.arms),
            labels=moved(scene.labels),
            nose=moved(scene.nose),
        )

    def _on_screen(self, points: FloatArray, row: int) -> FloatArray:
        """Return places of the world [m] on the screen [px], shape (n, 2)."""
        from_here = (points - self.place[row]) / self.arm * self.scale
        offset = np.stack([from_here @ self.right, -(from_here @ self.up)], axis=-1)
        return np.asarray(self.centre + np.array(SCENE[:2]) + offset)

    def _ground(self, row: int) -> Any:
        """Return what is behind the vehicle, and all that is not of it."""
        from PIL import Image, ImageDraw

        image = Image.new("RGB", (WIDTH * _OVER, HEIGHT * _OVER), PAPER)
        draw = ImageDraw.Draw(image)
        here = self.place[row]
        level = -_GROUND * self.arm
        spacing = _nice(1.4 * self.arm)
        reach = _AROUND * self.arm
        for axis in (0, 1):
            first = math.ceil((here[axis] - reach) / spacing)
            last = math.floor((here[axis] + reach) / spacing)
            for k in range(first, last + 1):
                ends = np.zeros((2, 3))
                ends[:, axis], ends[:, 2] = k * spacing, level
                ends[:, 1 - axis] = here[1 - axis] + np.array([-reach, reach])
                draw_line(draw, self._on_screen(ends, row).tolist(), PALE, 1)
        shadow = np.array([here[0], here[1], level])
        around = np.linspace(0.0, math.tau, 25)
        ring = shadow + 0.35 * self.arm * np.stack([np.cos(around), np.sin(around), np.zeros(25)], axis=-1)
        draw.polygon([tuple(corner * _OVER) for corner in self._on_screen(ring, row)], fill=PALE)
        steps = np.unique(np.linspace(0, row, min(row + 1, _CURVE_POINTS)).astype(int))
        trail = self.place[steps]
        near = np.abs(trail - here).max(axis=1) < 3 * reach
        for k in np.flatnonzero(near[1:] & near[:-1]).tolist():
            draw_line(draw, self._on_screen(trail[k : k + 2], row).tolist(), GREY, 1.5)
        if self.tracks:
            place = self._on_screen(self.wanted[row : row + 1], row)[0]
            if np.abs(place).max() < 1e4:
                draw_dot(draw, place, 5, GREY)
                draw_dot(draw, place, 3.5, PAPER)
        draw.rectangle([0, 0, WIDTH * _OVER, SCENE[1] * _OVER], fill=PAPER)
        draw.rectangle([0, (SCENE[1] + SCENE[3]) * _OVER, WIDTH * _OVER, HEIGHT * _OVER], fill=PAPER)
        self._chart(draw)
        return image

    def _over(self, row: int) -> tuple[Any, list[tuple[int, int, int, int]]]:
        """Return a picture with what lies over the vehicle, and where in it that is [px]."""
        from PIL import Image, ImageDraw

        image = Image.new("RGB", (WIDTH * _OVER, HEIGHT * _OVER), PAPER)
        draw = ImageDraw.Draw(image)
        draw_text(draw, (16, 19), self.title, 14, INK, "lm")
        boxes = [(0, 0, WIDTH, int(SCENE[1])), *self._words(draw, row), *self._map(draw, row)]
        if row == len(self.flight.rows) - 1:
            boxes.append(self._verdict(draw))
        return image.reduce(_OVER), boxes

    def _words(self, draw: Any, row: int) -> list[tuple[int, int, int, int]]:
        flight = self.flight
        x, y, z = (f"{value + 0.0:.2f}".replace("-", "−") for value in np.round(self.place[row], 2))
        shares = flight.thrusts[row] / self.quarter
        lines = [
            f"t = {flight.column('t')[row]:.2f} s{', arms slowed down' if self.slowed else ''}",
            f"x {x} m   y {y} m   z {z} m",
            f"thrust {shares.min():.2f} to {shares.max():.2f} × weight/4".replace("-", "−"),
        ]
        for k, line in enumerate(lines):
            draw_text(draw, (16, 46 + 16 * k), line, 11, GREY, "lm")
        # Each has a ground of its own length, to cover as little as can be.
        ends = [19 + math.ceil(text_width(line, 11)) for line in lines]
        return [(12, 38 + 16 * k, end, 54 + 16 * k) for k, end in enumerate(ends)]

    def _verdict(self, draw: Any) -> tuple[int, int, int, int]:
        """Write how it ended, in two lines at most, on a ground of its own."""
        flight = self.flight
        told = f"settled after {flight.settling_time:.2f} s" if flight.settled else flight.reason
        lines = [""]
        for word in told.split():
            longer = f"{lines[-1]} {word}".strip()
            if text_width(longer + (" …" if len(lines) == 2 else ""), 11, bold=True) <= _VERDICT:
                lines[-1] = longer
            elif len(lines) == 2:
                lines[-1] += " …"
                break
            else:
                lines.append(word)
        bottom = int(SCENE[1] + SCENE[3]) - 4
        top = bottom - 8 - 15 * len(lines)
        width = math.ceil(max(text_width(line, 11, bold=True) for line in lines))
        box = (10, top, 22 + width, bottom)
        draw.rectangle([edge * _OVER for edge in box], fill=PALE)
        for k, line in enumerate(lines):
            draw_text(draw, (16, top + 12 + 15 * k), line, 11, INK, "lm", bold=True)
        return box

    def _map(self, draw: Any, row: int) -> list[tuple[int, int, int, int]]:
        """Draw the path seen from above, forward up the picture, left to the left."""
        left, top, side = _MAP
        middle = np.array([left + side / 2, top + side / 2])

        def seen(points: FloatArray) -> FloatArray:
            offset = (points[:, :2] - self.map_centre) / self.map_half * (side / 2)
            return np.asarray(middle + np.stack([-offset[:, 1], -offset[:, 0]], axis=-1))

        box = [left * _OVER, top * _OVER, (left + side) * _OVER, (top + side) * _OVER]
        draw.rectangle(box, fill=PAPER, outline=PALE, width=2)
        every = np.unique(np.linspace(0, len(self.place) - 1, min(len(self.place), _CURVE_POINTS)).astype(int))
        if self.tracks:
            draw_line(draw, seen(self.wanted[every]).tolist(), PALE, 3)
        draw_line(draw, seen(self.place[every[every <= row]]).tolist(), INK, 1.2)
        draw_dot(draw, seen(self.place[row : row + 1])[0], 3, INK)
        told = f"{2 * self.map_half:.3g} m, from above"
        right, under = left + side, int(top + side)
        draw_text(draw, (right, under + 10), told, 10, GREY, "rm")
        wide = math.ceil(text_width(told, 10))
        boxes = ((left - 1, top - 1, right + 2, under + 2), (right - wide - 3, under + 2, right + 3, under + 18))
        return [(round(a), round(b), round(c), round(d)) for a, b, c, d in boxes]

    def _chart(self, draw: Any) -> None:
        left, top, width, height = CHART
        draw_line(draw, [(left, top), (left, top + height)], PALE, 1)
        draw_line(draw, [(left, top + height / 2), (left + width, top + height / 2)], PALE, 1)
        degrees = f"{self.most:g}°"
        for place, text in ((top + 3, degrees), (top + height / 2, "0"), (top + height - 4, f"−{degrees}")):
            draw_text(draw, (left - 6, place), text, 11, GREY, "rm")
        draw_text(draw, (left + width, top + height + 16), f"{self.flight.flown:.3g} s", 11, GREY, "rm")
        draw_text(draw, (left, top + height + 16), "0", 11, GREY, "mm")
        every = np.unique(np.linspace(0, len(self.place) - 1, min(len(self.place), _CURVE_POINTS)).astype(int))
        t = self.flight.column("t")[every]
        x = left + (width * t / self.flight.flown if self.flight.flown else 0.0 * t)
        for k, (name, color, weight) in enumerate((("roll", INK, 2.0), ("pitch", GREY, 3.5))):
            y = top + height / 2 * (1.0 - np.degrees(self.flight.column(name)[every]) / self.most)
            draw_line(draw, np.stack([x, y], axis=-1).tolist(), color, weight)
            start = left + width / 2 - 60 + 90 * k
            draw_line(draw, [(start, top + height + 16), (start + 18, top + height + 16)], color, weight)
            draw_text(draw, (start + 24, top + height + 16), name, 11, GREY, "lm")


def _screen(azimuth: float, elevation: float) -> tuple[FloatArray, FloatArray]:
    """Return what is to the right and up for a viewer, as :func:`gaitgraph.plots.scenes.scene_of` has it."""
    right = np.array([-math.sin(azimuth), math.cos(azimuth), 0.0])
    viewer = np.array([math.cos(azimuth), math.sin(azimuth), 0.0]) * math.cos(elevation)
    viewer[2] = math.sin(elevation)
    return right, np.cross(viewer, right)


def _rotation(roll: float, pitch: float, yaw: float) -> FloatArray:
    """Return what turns body axes into those of the world, shape (3, 3)."""
    (cr, cp, cy), (sr, sp, sy) = ([f(angle) for angle in (roll, pitch, yaw)] for f in (math.cos, math.sin))
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def _nice(value: float) -> float:
    """Return the largest of 1, 2, 5, 10, … times a power of ten that is no more than a value.

    >>> _nice(0.43), _nice(7.0)
    (0.2, 5.0)
    """
    power = 10.0 ** math.floor(math.log10(value))
    return float(max(step for step in (1.0, 2.0, 5.0) if step * power <= value * (1 + 1e-12)) * power)


def _round_up(degrees: float) -> float:
    """Return the end of a chart of angles [°]."""
    return max(5.0 * math.ceil(degrees / 5.0 - 1e-9), 5.0)
