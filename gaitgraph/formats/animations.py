"""The vehicle tilting through its gait, as an animated picture: SVG (no library needed) and GIF (Pillow).

Both show one period and loop for ever, at the gait's own pace: above the vehicle with its discs and lines of thrust,
below its four angles over time. The same table gives the same bytes, as long as Pillow is the same.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import escape

import numpy as np
import numpy.typing as npt

from gaitgraph.errors import InputError, needs_extra
from gaitgraph.files import blocks_of
from gaitgraph.scenes import ROTOR_COLORS, Scene, scene_of
from gaitgraph.tables import Table, provenance_text, setting_of

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

__all__ = ["MOST_FRAMES", "frame_delays", "provenance_of_gif", "provenance_of_svg", "write_gif", "write_svg"]

FloatArray = npt.NDArray[np.float64]

MOST_FRAMES = 100
"""Frames of a period at most; a longer table is sampled."""

_WIDTH, _HEIGHT = 480, 420
_SCENE = (0.0, 36.0, 480.0, 272.0)  # left, top, width, height
_CHART = (52.0, 326.0, 412.0, 66.0)
_INK, _GREY, _PALE, _PAPER = "#23262b", "#767b85", "#dfe2e7", "#ffffff"
_THICK, _THIN = 5.0, 1.8  # of opposite rotors, which move together on the red sheet
_CURVE_POINTS = 160
_LEAST_SIDE = 0.03  # a disc seen on edge is still a line
_HEAD = 9.0

_SHORTEST, _LONGEST = 0.2, 655.35 * MOST_FRAMES  # seconds that a GIF of ten frames or more can last
_DELAY = 4  # centiseconds; browsers take those under 2 for 10
_FEWEST = 10

_WHAT = "gait file"
_MOST_BYTES = 1 << 26


@dataclass(frozen=True, slots=True, kw_only=True)
class _Film:
    """What both kinds of picture draw: a scene with its frames, and the angles below it."""

    scene: Scene
    title: str
    about: str
    alpha: FloatArray  # of the curves, shape (n, 4)
    most: float  # of the chart's angles [rad]

    def curve(self, rotor: int) -> FloatArray:
        """Return the corners of an angle's curve in the chart, shape (n, 2) [px]."""
        left, top, width, height = _CHART
        x = left + np.linspace(0.0, width, len(self.alpha))
        y = top + height / 2 * (1.0 - self.alpha[:, rotor] / self.most)
        return np.stack([x, y], axis=-1)


def _film_of(pieces: Iterable[Table], fractions: FloatArray | None) -> tuple[_Film, float]:
    """Return the film of a table at fractions of its period (None: as a GIF has them), and the period [s]."""
    rows: list[FloatArray] = []
    first: Table | None = None
    for piece in pieces:
        first = first or piece
        rows.append(np.column_stack([piece["t"] if "t" in piece else np.zeros(len(piece)), piece.alpha]))
    if first is None:
        raise InputError("a picture needs rows; allowed is at least one")
    table = np.concatenate(rows)
    t, alpha = table[:, 0] - table[0, 0], table[:, 1:]
    period = float(t[-1])
    if not period > 0:
        period, t = 1.0, np.linspace(0.0, 1.0, len(t))
    if fractions is None:
        delays = frame_delays(period)
        fractions = np.concatenate([[0.0], np.cumsum(delays)[:-1] / sum(delays)])

    def angles(at: FloatArray) -> FloatArray:
        return np.stack([np.interp(at * period, t, alpha[:, k]) for k in range(4)], axis=-1)

    vehicle = setting_of(first)[0]
    curves = angles(np.linspace(0.0, 1.0, _CURVE_POINTS + 1))
    name = vehicle.name if len(vehicle.name) <= 32 else vehicle.name[:31] + "…"
    law = first.about.get("law")
    film = _Film(
        scene=scene_of(angles(fractions), vehicle, size=_SCENE[2:]),
        title=" · ".join([f"Vehicle {name}", f"T = {period:g} s", *([law] if isinstance(law, str) else [])]),
        about=provenance_text(first),
        alpha=curves,
        most=max(math.radians(10.0) * math.ceil(math.degrees(float(np.abs(curves).max())) / 10.0), math.radians(10.0)),
    )
    return film, period


def frame_delays(period: float) -> list[int]:
    """Return how long each frame of a GIF is shown [1/100 s].

    They add up to the period, rounded to 1/100 s, from 0.2 s to 65535 s; a shorter one is shown slower, a longer one
    faster, because the format can do no better. At most :data:`MOST_FRAMES`.

    >>> frame_delays(1.0) == [4] * 25, sum(frame_delays(1.237)), len(frame_delays(60.0))
    (True, 124, 100)
    """
    total = round(100 * min(max(period, _SHORTEST), _LONGEST))
    count = min(max(round(total / _DELAY), _FEWEST), MOST_FRAMES)
    ends = [round(total * k / count) for k in range(count + 1)]
    return [after - before for before, after in pairwise(ends)]


def write_svg(pieces: Iterable[Table], path: Path) -> None:
    """Write a table as an animated SVG: no script, nothing loaded from elsewhere; text of what made it in metadata."""
    film, period = _film_of(pieces, np.linspace(0.0, 1.0, MOST_FRAMES + 1))
    path.write_text(_svg_text(film, period), encoding="utf-8", newline="\n")


def _svg_text(film: _Film, period: float) -> str:
    seconds = max(period, _SHORTEST)
    dur = f'dur="{np.format_float_positional(seconds, trim="-")}s" repeatCount="indefinite"'
    left, top, width, height = _CHART
    degrees = f"{math.degrees(film.most):.0f}°"
    title = escape(film.title + _pace(period, seconds))
    out = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{_WIDTH}" height="{_HEIGHT}" viewBox="0 0 {_WIDTH} {_HEIGHT}" '
        'role="img" aria-labelledby="title desc" font-family="DejaVu Sans, Verdana, sans-serif" font-size="12">',
        f'<title id="title">{title}</title>',
        '<desc id="desc">A vehicle with four tilting rotors, and their tilt angles over one period.</desc>',
        f"<metadata>{escape(film.about)}</metadata>",
        '<marker id="tip" markerUnits="userSpaceOnUse" markerWidth="10" markerHeight="10" viewBox="-9 -5 10 10" '
        f'orient="auto"><path d="M0 0L-9 4.5V-4.5z" fill="{_INK}"/></marker>',
        f'<rect width="{_WIDTH}" height="{_HEIGHT}" fill="{_PAPER}"/>',
        f'<text x="16" y="24" font-size="14" fill="{_INK}">{title}</text>',
        f'<g transform="translate({_SCENE[0]:g},{_SCENE[1]:g})" stroke-linecap="round">',
        *_svg_body(film.scene),
        *(line for rotor in film.scene.order for line in _svg_rotor(film.scene, rotor, dur)),
        *(line for rotor in range(4) for line in _svg_label(film.scene, rotor)),
        "</g>",
        f'<g fill="none" stroke-linejoin="round"><path d="M{left:g} {top:g}v{height:g}m0 {-height / 2:g}h{width:g}" '
        f'stroke="{_PALE}"/>',
    ]
    for rotor in range(4):
        points = _joined(film.curve(rotor), ",", " ")
        weight = _THICK if rotor < 2 else _THIN
        out.append(f'<polyline points="{points}" stroke="{ROTOR_COLORS[rotor]}" stroke-width="{weight}"/>')
    out += [
        f'<path d="M{left:g} {top - 4:g}v{height + 8:g}" stroke="{_INK}"><animateTransform attributeName="transform" '
        f'type="translate" values="0;{width:g}" {dur}/></path></g>',
        f'<g fill="{_GREY}" font-size="11" text-anchor="end">',
        f'<text x="{left - 6:g}" y="{top + 8:g}">{degrees}</text>',
        f'<text x="{left - 6:g}" y="{top + height / 2 + 4:g}">0</text>',
        f'<text x="{left - 6:g}" y="{top + height:g}">−{degrees}</text>',
        f'<text x="{left + width:g}" y="{top + height + 20:g}">{period:g} s</text>',
        f'<text x="{left + 6:g}" y="{top + height + 20:g}">0</text></g>',
        "</svg>",
    ]
    return "\n".join(out) + "\n"


def _pace(period: float, seconds: float) -> str:
    """Return what a title says if the picture does not keep the gait's own pace."""
    if abs(seconds - period) <= max(0.005, 1e-9 * period):
        return ""
    return f" (shown {'slower' if seconds > period else 'faster'}: {seconds:g} s)"


def _number(value: float, decimals: int = 1) -> str:
    text = f"{value:.{decimals}f}"
    text = text.rstrip("0").rstrip(".") if "." in text else text
    return "0" if text == "-0" else text


def _joined(points: FloatArray, within: str = ",", between: str = ";", decimals: int = 1) -> str:
    rows = np.atleast_2d(points.T).T
    return between.join(within.join(_number(float(value), decimals) for value in row) for row in rows)


def _svg_body(scene: Scene) -> list[str]:
    x, y = scene.hub
    arms = "".join(f"M{_number(x)} {_number(y)}L{_number(end[0])} {_number(end[1])}" for end in scene.arms)
    tip = f"{_number(scene.nose[0])} {_number(scene.nose[1])}"
    head = _joined(_arrow_head(scene.hub, scene.nose), ",", " ")
    return [
        f'<path d="{arms}" stroke="{_GREY}" stroke-width="5"/>',
        f'<path d="M{_number(x)} {_number(y)}L{tip}" stroke="{_INK}" stroke-width="2"/>',
        f'<polygon points="{head}" fill="{_INK}"/>',
        f'<circle cx="{_number(x)}" cy="{_number(y)}" r="6" fill="{_INK}"/>',
    ]


def _svg_rotor(scene: Scene, rotor: int, dur: str) -> list[str]:
    """Draw one rotor: the disc's affine map as fixed axes times a scaling and a skew, which blend between frames."""
    discs, facing = scene.discs[:, rotor], scene.facing[:, rotor]
    across, along, centre = discs[0, :2], discs[:, 2:4], discs[:, 4:]
    normal = np.array([-across[1], across[0]])
    size = float(across @ across)
    squeeze, slant = along @ normal / size, np.degrees(np.arctan(along @ across / size))
    squeeze = np.where(np.abs(squeeze) < _LEAST_SIDE, np.copysign(_LEAST_SIDE, squeeze), squeeze)
    basis = ",".join(_number(value, 3) for value in (*across, *normal, 0.0, 0.0))
    pushed = scene.thrusts[:, rotor] - centre
    # The stalk from the arm's end to the disc is on the line of thrust, on its other side.
    stalk = scene.arms[rotor] - centre

    def moved(kind: str, values: FloatArray, decimals: int = 1) -> str:
        told = _joined(values, ",", ";", decimals)
        return f'<animateTransform attributeName="transform" type="{kind}" values="{told}" {dur}/>'

    def led(name: str, values: FloatArray) -> str:
        return f'<animate attributeName="{name}" values="{_joined(values[:, None])}" {dur}/>'

    def line(ends: FloatArray, look: str, shown: str = "") -> str:
        return f"<line {look}>{led('x2', ends[:, 0])}{led('y2', ends[:, 1])}{shown}</line>"

    def switched(name: str, front: str, back: str) -> str:
        turns = [0, *(np.flatnonzero(np.diff(facing)) + 1).tolist()]
        if len(turns) == 1:
            return ""
        keys = ";".join(_number(k / (len(facing) - 1), 4) for k in turns)
        values = ";".join(front if facing[k] else back for k in turns)
        return f'<animate attributeName="{name}" calcMode="discrete" values="{values}" keyTimes="{keys}" {dur}/>'

    stroke = f'stroke="{_INK}" stroke-width="2.5" marker-end="url(#tip)"'
    out = [f"<g>{moved('translate', centre)}", line(stalk, f'stroke="{_GREY}" stroke-width="4"')]
    if not facing.all():
        behind = "hidden" if facing[0] else "visible"
        out.append(line(pushed, f'{stroke} visibility="{behind}"', switched("visibility", "hidden", "visible")))
    color = ROTOR_COLORS[rotor]
    fill = color if facing[0] else _under(color)
    out += [
        f'<g transform="matrix({basis})"><g>{moved("scale", np.stack([np.ones_like(squeeze), squeeze], -1), 3)}'
        f"<g>{moved('skewX', slant[:, None], 1)}",
        f'<circle r="1" fill="{fill}" stroke="{_INK}" stroke-width="1.2" '
        f'vector-effect="non-scaling-stroke">{switched("fill", color, _under(color))}</circle></g></g></g>',
    ]
    if facing.any():
        before = "visible" if facing[0] else "hidden"
        out.append(line(pushed, f'{stroke} visibility="{before}"', switched("visibility", "visible", "hidden")))
    out.append(f'<circle r="2.5" fill="{_INK}"/></g>')
    return out


def _svg_label(scene: Scene, rotor: int) -> list[str]:
    x, y = (_number(value) for value in scene.labels[rotor])
    return [
        f'<circle cx="{x}" cy="{y}" r="9" fill="{ROTOR_COLORS[rotor]}" stroke="{_PAPER}" stroke-width="2"/>',
        f'<text x="{x}" y="{y}" dy="4" text-anchor="middle" font-weight="bold" fill="{_INK}">{rotor + 1}</text>',
    ]


def _under(color: str) -> str:
    """Return the color of a disc's underside: half way to the ink."""
    mixed = ((int(color[k : k + 2], 16) * 11 + int(_INK[k : k + 2], 16) * 9) // 20 for k in (1, 3, 5))
    return "#" + "".join(f"{part:02x}" for part in mixed)


def _arrow_head(start: FloatArray, end: FloatArray) -> FloatArray:
    """Return the corners of the head of an arrow, shape (3, 2)."""
    along = (end - start) / max(float(np.hypot(*(end - start))), 1e-9)
    side = 0.5 * np.array([-along[1], along[0]])
    return np.stack([end, end - _HEAD * (along + side), end - _HEAD * (along - side)])


def write_gif(pieces: Iterable[Table], path: Path) -> None:
    """Write a table as an animated GIF; the text of what made it is its comment.

    Raises
    ------
    MissingExtra
        If Pillow is not there, or matplotlib, which brings the letters.
    """
    try:
        import matplotlib as _  # noqa: F401
        from PIL import Image
    except ImportError as error:
        raise needs_extra(error.name or "Pillow", "animated GIF", "plot") from error

    film, period = _film_of(pieces, None)
    delays = frame_delays(period)
    ground = _gif_ground(film, period, sum(delays) / 100)
    frames = [_gif_frame(film, ground, k, len(delays)) for k in range(len(delays))]
    colors = _palette()
    nearest = _nearest(colors)
    flat = []
    for frame in frames:
        red, green, blue = np.moveaxis(np.asarray(frame) >> _DROPPED, -1, 0).astype(np.intp)
        flat.append(Image.fromarray(nearest[red, green, blue]))
        flat[-1].putpalette(colors.astype(np.uint8).tobytes())
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
            comment=film.about.encode("ascii"),
        )


_DROPPED = 3  # bits of each channel that do not count for which color of the palette is nearest


def _palette() -> FloatArray:
    """Return the colors of all frames: those drawn with, then blends of them where edges are, shape (n, 3)."""
    plain = [_PAPER, _INK, _GREY, _PALE, *ROTOR_COLORS, *map(_under, ROTOR_COLORS)]
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


def _gif_ground(film: _Film, period: float, seconds: float) -> Any:
    """Return what no frame changes: title, chart, labels of the axes."""
    from PIL import Image, ImageDraw

    image = Image.new("RGB", (_WIDTH * _OVER, _HEIGHT * _OVER), _PAPER)
    draw = ImageDraw.Draw(image)
    left, top, width, height = _CHART
    _text(draw, (16, 19), film.title + _pace(period, seconds), 14, _INK, "lm")
    _line(draw, [(left, top), (left, top + height)], _PALE, 1)
    _line(draw, [(left, top + height / 2), (left + width, top + height / 2)], _PALE, 1)
    degrees = f"{math.degrees(film.most):.0f}°"
    for place, text in ((top + 3, degrees), (top + height / 2, "0"), (top + height - 4, f"−{degrees}")):
        _text(draw, (left - 6, place), text, 11, _GREY, "rm")
    _text(draw, (left + width, top + height + 16), f"{period:g} s", 11, _GREY, "rm")
    _text(draw, (left, top + height + 16), "0", 11, _GREY, "mm")
    for rotor in range(4):
        _line(draw, film.curve(rotor).tolist(), ROTOR_COLORS[rotor], _THICK if rotor < 2 else _THIN)
    return image


def _gif_frame(film: _Film, ground: Any, k: int, count: int) -> Any:
    from PIL import ImageDraw

    image = ground.copy()
    draw = ImageDraw.Draw(image)
    scene, offset = film.scene, np.array(_SCENE[:2])

    def push(start: FloatArray, end: FloatArray, width: float) -> None:
        head = _arrow_head(start, end)
        _line(draw, [start, head[1:].mean(axis=0)], _INK, width)
        draw.polygon([tuple(corner * _OVER) for corner in head], fill=_INK)

    hub, nose = scene.hub + offset, scene.nose + offset
    for end in scene.arms + offset:
        _line(draw, [hub, end], _GREY, 5)
    push(hub, nose, 2)
    _dot(draw, hub, 6, _INK)
    around = np.linspace(0.0, math.tau, 73)
    circle = np.stack([np.cos(around), np.sin(around)])
    for rotor in scene.order:
        disc, facing = scene.discs[k, rotor], bool(scene.facing[k, rotor])
        centre, tip = disc[4:] + offset, scene.thrusts[k, rotor] + offset
        rim = (disc[:4].reshape(2, 2).T @ circle).T + centre
        _line(draw, [scene.arms[rotor] + offset, centre], _GREY, 4)
        if not facing:
            push(centre, tip, 2.5)
        color = ROTOR_COLORS[rotor]
        draw.polygon([tuple(corner * _OVER) for corner in rim], fill=color if facing else _under(color))
        _line(draw, rim.tolist(), _INK, 1.2)
        _dot(draw, centre, 2.5, _INK)
        if facing:
            push(centre, tip, 2.5)
    for rotor, place in enumerate(scene.labels + offset):
        _dot(draw, place, 10, _PAPER)
        _dot(draw, place, 8.5, ROTOR_COLORS[rotor])
        _text(draw, tuple(place), str(rotor + 1), 12, _INK, "mm", bold=True)
    left, top, width, height = _CHART
    x = left + width * k / count
    _line(draw, [(x, top - 4), (x, top + height + 4)], _INK, 1.2)
    return image.reduce(_OVER)


def _line(draw: Any, points: Any, color: str, width: float) -> None:
    corners = [(float(x) * _OVER, float(y) * _OVER) for x, y in points]
    draw.line(corners, fill=color, width=max(1, round(width * _OVER)), joint="curve")


def _dot(draw: Any, place: Any, radius: float, color: str) -> None:
    x, y, r = float(place[0]) * _OVER, float(place[1]) * _OVER, radius * _OVER
    draw.ellipse([x - r, y - r, x + r, y + r], fill=color)


def _text(draw: Any, place: Any, text: str, size: int, color: str, anchor: str, *, bold: bool = False) -> None:
    """Write a text in the font that comes with matplotlib: the same letters on every machine."""
    from matplotlib import get_data_path
    from PIL import ImageFont

    file = f"{get_data_path()}/fonts/ttf/DejaVuSans{'-Bold' if bold else ''}.ttf"
    font = ImageFont.truetype(file, size * _OVER)
    draw.text((float(place[0]) * _OVER, float(place[1]) * _OVER), text, fill=color, font=font, anchor=anchor)


def _content(path: Path, allowed: str) -> bytes:
    size, blocks = 0, []
    for block, _ in blocks_of(path, _WHAT, allowed):
        size += len(block)
        if size > _MOST_BYTES:
            raise InputError(f"it has more than {_MOST_BYTES >> 20} MiB; allowed is {allowed} up to that")
        blocks.append(block)
    return b"".join(blocks)


def provenance_of_svg(path: Path) -> str:
    """Return the text in the metadata of an SVG, or raise InputError; nothing of it is followed or expanded."""
    from xml.parsers import expat

    allowed = "an animated SVG that gaitgraph wrote"
    content = _content(path, allowed)
    found: list[str] = []
    open_elements: list[str] = []

    def begin(name: str, attributes: dict[str, str]) -> None:
        open_elements.append(name)

    def text(part: str) -> None:
        if open_elements[-1] == "metadata":
            found.append(part)

    def end(name: str) -> None:
        open_elements.pop()

    def declared(*told: Any) -> None:
        raise InputError(f"it declares a document type; allowed is {allowed}")

    parser = expat.ParserCreate()
    parser.StartElementHandler, parser.EndElementHandler = begin, end
    parser.CharacterDataHandler, parser.StartDoctypeDeclHandler = text, declared
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        raise InputError(f"it is not whole XML ({error}); allowed is {allowed}") from error
    if not found:
        raise InputError(f"it does not tell what made it; allowed is {allowed}")
    return "".join(found).strip()


def provenance_of_gif(path: Path) -> str:
    """Return the first comment of a GIF, or raise InputError; needs no library."""
    allowed = "an animated GIF that gaitgraph wrote"
    content = _content(path, allowed)
    if not re.match(rb"GIF8[79]a", content):
        raise InputError(f"it is no GIF; allowed is {allowed}")
    try:
        place = 13 + _colors(content[10])
        while (mark := content[place]) != _TRAILER:
            if mark == _EXTENSION:
                told, after = _sub_blocks(content, place + 2)
                if content[place + 1] == _COMMENT:
                    return told.decode("ascii", errors="replace")
                place = after
            elif mark == _IMAGE:
                _, place = _sub_blocks(content, place + 11 + _colors(content[place + 9]))
            else:
                raise InputError(f"it is no whole GIF; allowed is {allowed}")
    except IndexError as error:
        raise InputError(f"it is no whole GIF; allowed is {allowed}") from error
    raise InputError(f"it does not tell what made it; allowed is {allowed}")


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
