"""The vehicle tilting through its gait as an animated GIF, drawn with Pillow.

It loops for ever at the gait's own pace, as far as the format can. The same table gives the same bytes, as long as
Pillow is the same.
"""

from __future__ import annotations

import math
import re
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.errors import InputError, needs_extra
from gaitgraph.plots.film_settings import (
    CHART,
    GREY,
    HEIGHT,
    INK,
    MOST_FRAMES,
    PALE,
    PAPER,
    SCENE,
    SHORTEST,
    THICK,
    THIN,
    WIDTH,
    Film,
    arrow_head,
    content_of,
    film_of,
    pace_told,
    underside,
)
from gaitgraph.plots.scenes import ROTOR_COLORS

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from pathlib import Path

    from gaitgraph.gait.table import Table

__all__ = [
    "draw_dot",
    "draw_line",
    "draw_text",
    "frame_delays",
    "frame_of",
    "in_palette",
    "provenance_of_gif",
    "save_gif",
    "text_width",
    "write_gif",
]

FloatArray = npt.NDArray[np.float64]

_LONGEST = 655.35 * MOST_FRAMES  # seconds that a GIF of ten frames or more can last
_DELAY = 4  # centiseconds; browsers take those under 2 for 10
_FEWEST = 10


def frame_delays(period: float) -> list[int]:
    """Return how long each frame of a GIF is shown [1/100 s].

    They add up to the period, rounded to 1/100 s, from 0.2 s to 65535 s; a shorter one is shown slower, a longer one
    faster, because the format can do no better. At most :data:`~gaitgraph.plots.film_settings.MOST_FRAMES`.

    >>> frame_delays(1.0) == [4] * 25, sum(frame_delays(1.237)), len(frame_delays(60.0))
    (True, 124, 100)
    """
    total = round(100 * min(max(period, SHORTEST), _LONGEST))
    count = min(max(round(total / _DELAY), _FEWEST), MOST_FRAMES)
    ends = [round(total * k / count) for k in range(count + 1)]
    return [after - before for before, after in pairwise(ends)]


def _fractions(period: float) -> FloatArray:
    """Return at which fractions of the period the frames begin."""
    delays = frame_delays(period)
    return np.concatenate([[0.0], np.cumsum(delays)[:-1] / sum(delays)])


def write_gif(pieces: Iterable[Table], path: Path) -> None:
    """Write a table as an animated GIF; the text of what made it is its comment.

    Raises
    ------
    MissingExtra
        If Pillow is not there, or matplotlib, which brings the letters.
    """
    try:
        import matplotlib as _  # noqa: F401
        from PIL import Image  # noqa: F401
    except ImportError as error:
        raise needs_extra(error.name or "Pillow", "animated GIF", "plot") from error

    film, period = film_of(pieces, _fractions)
    delays = frame_delays(period)
    ground = _gif_ground(film, period, sum(delays) / 100)
    frames = [frame_of(film, ground, k, len(delays)) for k in range(len(delays))]
    save_gif(in_palette(frames), delays, film.about, path)


def in_palette(frames: Iterable[Any]) -> list[Any]:
    """Return RGB pictures of one size with one palette, that of :mod:`gaitgraph.plots.film_settings`."""
    from PIL import Image

    colors = _palette()
    nearest = _nearest(colors)
    flat = []
    for frame in frames:
        red, green, blue = np.moveaxis(np.asarray(frame) >> _DROPPED, -1, 0).astype(np.intp)
        flat.append(Image.fromarray(nearest[red, green, blue]))
        flat[-1].putpalette(colors.astype(np.uint8).tobytes())
    return flat


def save_gif(flat: Sequence[Any], delays: Sequence[int], about: str, path: Path) -> None:
    """Write pictures with palettes as an animated GIF that loops for ever.

    Parameters
    ----------
    flat
        Of one size, with a palette each.
    delays
        How long each is shown [1/100 s].
    about
        Its comment, in ASCII.
    path
        A new file.
    """
    with path.open("wb") as stream:
        flat[0].save(
            stream,
            format="GIF",
            save_all=True,
            append_images=flat[1:],
            duration=[10 * delay for delay in delays],
            loop=0,
            optimize=False,
            disposal=1,
            comment=about.encode("ascii"),
        )


_DROPPED = 3  # bits of each channel that do not count for which color of the palette is nearest


def _palette() -> FloatArray:
    """Return the colors of all frames: those drawn with, then blends of them where edges are, shape (n, 3)."""
    plain = [PAPER, INK, GREY, PALE, *ROTOR_COLORS, *map(underside, ROTOR_COLORS)]
    colors = [np.array([int(color[k : k + 2], 16) for k in (1, 3, 5)], dtype=float) for color in plain]
    steps = [(0, 6), (1, 5), (2, 3), (3, 1), (4, 3), (5, 3), (6, 3), (7, 3)]
    blends = [
        colors[one] + (other - colors[one]) * k / (count + 1)
        for one, count in steps
        for other in colors[one + 1 :]
        for k in range(1, count + 1)
    ]
    return np.round([*colors, *blends])


def _nearest(colors: FloatArray) -> npt.NDArray[np.uint8]:
    """Return which color of the palette is nearest, by the upper bits of red, green and blue."""
    count = 256 >> _DROPPED
    middle = (np.arange(count) + 0.5) * (1 << _DROPPED)
    distance = np.zeros((count, count, count, len(colors)), dtype=np.float32)
    for axis, channel in enumerate(np.eye(3, dtype=int)):
        shape = np.where(channel, count, 1)
        distance += ((middle[:, None] - colors[:, axis]) ** 2).reshape(*shape, len(colors)).astype(np.float32)
    nearest: npt.NDArray[np.uint8] = np.argmin(distance, axis=-1).astype(np.uint8)
    # What is drawn flat keeps its very color: the first twelve of the palette.
    for k, color in reversed(list(enumerate(colors[: 4 + 2 * len(ROTOR_COLORS)].astype(int) >> _DROPPED))):
        nearest[tuple(color)] = k
    return nearest


_OVER = 2  # drawn so much larger, then averaged: smooth edges


def _gif_ground(film: Film, period: float, seconds: float) -> Any:
    """Return what no frame changes: title, chart, labels of the axes."""
    from PIL import Image, ImageDraw

    image = Image.new("RGB", (WIDTH * _OVER, HEIGHT * _OVER), PAPER)
    draw = ImageDraw.Draw(image)
    left, top, width, height = CHART
    draw_text(draw, (16, 19), film.title + pace_told(period, seconds), 14, INK, "lm")
    draw_line(draw, [(left, top), (left, top + height)], PALE, 1)
    draw_line(draw, [(left, top + height / 2), (left + width, top + height / 2)], PALE, 1)
    degrees = f"{math.degrees(film.most):.0f}°"
    for place, text in ((top + 3, degrees), (top + height / 2, "0"), (top + height - 4, f"−{degrees}")):
        draw_text(draw, (left - 6, place), text, 11, GREY, "rm")
    draw_text(draw, (left + width, top + height + 16), f"{period:g} s", 11, GREY, "rm")
    draw_text(draw, (left, top + height + 16), "0", 11, GREY, "mm")
    for rotor in range(4):
        draw_line(draw, film.curve(rotor).tolist(), ROTOR_COLORS[rotor], THICK if rotor < 2 else THIN)
    return image


def frame_of(film: Film, ground: Any, k: int, count: int) -> Any:
    """Return the picture of frame k of so many, on a ground that is twice as large: the vehicle, and the cursor."""
    from PIL import ImageDraw

    image = ground.copy()
    draw = ImageDraw.Draw(image)
    scene, offset = film.scene, np.array(SCENE[:2])

    def push(start: FloatArray, end: FloatArray, width: float) -> None:
        head = arrow_head(start, end)
        draw_line(draw, [start, head[1:].mean(axis=0)], INK, width)
        draw.polygon([tuple(corner * _OVER) for corner in head], fill=INK)

    hub, nose = scene.hub + offset, scene.nose + offset
    for end in scene.arms + offset:
        draw_line(draw, [hub, end], GREY, 5)
    push(hub, nose, 2)
    draw_dot(draw, hub, 6, INK)
    around = np.linspace(0.0, math.tau, 73)
    circle = np.stack([np.cos(around), np.sin(around)])
    for rotor in scene.order:
        disc, facing = scene.discs[k, rotor], bool(scene.facing[k, rotor])
        centre, tip = disc[4:] + offset, scene.thrusts[k, rotor] + offset
        rim = (disc[:4].reshape(2, 2).T @ circle).T + centre
        draw_line(draw, [scene.arms[rotor] + offset, centre], GREY, 4)
        if not facing:
            push(centre, tip, 2.5)
        color = ROTOR_COLORS[rotor]
        draw.polygon([tuple(corner * _OVER) for corner in rim], fill=color if facing else underside(color))
        draw_line(draw, rim.tolist(), INK, 1.2)
        draw_dot(draw, centre, 2.5, INK)
        if facing:
            push(centre, tip, 2.5)
    for rotor, place in enumerate(scene.labels + offset):
        draw_dot(draw, place, 10, PAPER)
        draw_dot(draw, place, 8.5, ROTOR_COLORS[rotor])
        draw_text(draw, tuple(place), str(rotor + 1), 12, INK, "mm", bold=True)
    left, top, width, height = CHART
    x = left + width * k / count
    draw_line(draw, [(x, top - 4), (x, top + height + 4)], INK, 1.2)
    return image.reduce(_OVER)


def draw_line(draw: Any, points: Any, color: str, width: float) -> None:
    """Draw a line through places [px] into a picture that is twice as large."""
    corners = [(float(x) * _OVER, float(y) * _OVER) for x, y in points]
    draw.line(corners, fill=color, width=max(1, round(width * _OVER)), joint="curve")


def draw_dot(draw: Any, place: Any, radius: float, color: str) -> None:
    """Draw a disc at a place [px] into a picture that is twice as large."""
    x, y, r = float(place[0]) * _OVER, float(place[1]) * _OVER, radius * _OVER
    draw.ellipse([x - r, y - r, x + r, y + r], fill=color)


def draw_text(draw: Any, place: Any, text: str, size: int, color: str, anchor: str, *, bold: bool = False) -> None:
    """Write a text in the font that comes with matplotlib: the same letters on every machine."""
    font = _font(size, bold)
    draw.text((float(place[0]) * _OVER, float(place[1]) * _OVER), text, fill=color, font=font, anchor=anchor)


def text_width(text: str, size: int, *, bold: bool = False) -> float:
    """Return how wide :func:`draw_text` writes a text [px]."""
    return float(_font(size, bold).getlength(text)) / _OVER


def _font(size: int, bold: bool) -> Any:
    from matplotlib import get_data_path
    from PIL import ImageFont

    file = f"{get_data_path()}/fonts/ttf/DejaVuSans{'-Bold' if bold else ''}.ttf"
    return ImageFont.truetype(file, size * _OVER)


def provenance_of_gif(path: Path) -> str:
    """Return the first comment of a GIF, whose blocks are all there, or raise InputError; needs no library."""
    allowed = "an animated GIF that gaitgraph wrote"
    content = content_of(path, allowed)
    if not re.match(rb"GIF8[79]a", content):
        raise InputError(f"it is no GIF; allowed is {allowed}")
    comment: bytes | None = None
    try:
        place = 13 + _colors(content[10])
        while (mark := content[place]) != _TRAILER:
            if mark == _EXTENSION:
                told, after = _sub_blocks(content, place + 2)
                if content[place + 1] == _COMMENT and comment is None:
                    comment = told
                place = after
            elif mark == _IMAGE:
                _, place = _sub_blocks(content, place + 11 + _colors(content[place + 9]))
            else:
                raise InputError(f"it is no whole GIF; allowed is {allowed}")
    except IndexError as error:
        raise InputError(f"it is no whole GIF; allowed is {allowed}") from error
    if comment is None:
        raise InputError(f"it does not tell what made it; allowed is {allowed}")
    return comment.decode("ascii", errors="replace")


_EXTENSION, _COMMENT, _IMAGE, _TRAILER = 0x21, 0xFE, 0x2C, 0x3B


def _colors(flags: int) -> int:
    """Return how many bytes the color table has that a GIF's flags announce."""
    return 3 << ((flags & 7) + 1) if flags & 0x80 else 0


def _sub_blocks(content: bytes, place: int) -> tuple[bytes, int]:
    """Return the bytes of the blocks from a place on, and the place after them; IndexError if they do not end."""
    parts = []
    while length := content[place]:
        parts.append(content[place + 1 : place + 1 + length])
        place += 1 + length
    return b"".join(parts), place + 1
