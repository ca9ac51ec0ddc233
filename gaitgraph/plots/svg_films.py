"""The vehicle tilting through its gait as an animated SVG: no library, no script, nothing loaded from elsewhere.

It loops for ever at the gait's own pace. The same table gives the same bytes.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import escape

import numpy as np
import numpy.typing as npt

from gaitgraph.errors import InputError
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
from gaitgraph.plots.scenes import ROTOR_COLORS, Scene

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from gaitgraph.gait.table import Table

__all__ = ["provenance_of_svg", "write_svg"]

FloatArray = npt.NDArray[np.float64]

_LEAST_SIDE = 0.03  # a disc seen on edge is still a line


def write_svg(pieces: Iterable[Table], path: Path) -> None:
    """Write a table as an animated SVG: no script, nothing loaded from elsewhere; text of what made it in metadata."""
    film, period = film_of(pieces, lambda _: np.linspace(0.0, 1.0, MOST_FRAMES + 1))
    path.write_text(_svg_text(film, period), encoding="utf-8", newline="\n")


def _svg_text(film: Film, period: float) -> str:
    seconds = max(period, SHORTEST)
    dur = f'dur="{np.format_float_positional(seconds, trim="-")}s" repeatCount="indefinite"'
    left, top, width, height = CHART
    degrees = f"{math.degrees(film.most):.0f}°"
    title = escape(film.title + pace_told(period, seconds))
    out = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{HEIGHT}" viewBox="0 0 {WIDTH} {HEIGHT}" '
        'role="img" aria-labelledby="title desc" font-family="DejaVu Sans, Verdana, sans-serif" font-size="12">',
        f'<title id="title">{title}</title>',
        '<desc id="desc">A vehicle with four tilting rotors, and their tilt angles over one period.</desc>',
        f"<metadata>{escape(film.about)}</metadata>",
        '<marker id="tip" markerUnits="userSpaceOnUse" markerWidth="10" markerHeight="10" viewBox="-9 -5 10 10" '
        f'orient="auto"><path d="M0 0L-9 4.5V-4.5z" fill="{INK}"/></marker>',
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="{PAPER}"/>',
        f'<text x="16" y="24" font-size="14" fill="{INK}">{title}</text>',
        f'<g transform="translate({SCENE[0]:g},{SCENE[1]:g})" stroke-linecap="round">',
        *_svg_body(film.scene),
        *(line for rotor in film.scene.order for line in _svg_rotor(film.scene, rotor, dur)),
        *(line for rotor in range(4) for line in _svg_label(film.scene, rotor)),
        "</g>",
        f'<g fill="none" stroke-linejoin="round"><path d="M{left:g} {top:g}v{height:g}m0 {-height / 2:g}h{width:g}" '
        f'stroke="{PALE}"/>',
    ]
    for rotor in range(4):
        points = _joined(film.curve(rotor), ",", " ")
        weight = THICK if rotor < 2 else THIN
        out.append(f'<polyline points="{points}" stroke="{ROTOR_COLORS[rotor]}" stroke-width="{weight}"/>')
    out += [
        f'<path d="M{left:g} {top - 4:g}v{height + 8:g}" stroke="{INK}"><animateTransform attributeName="transform" '
        f'type="translate" values="0;{width:g}" {dur}/></path></g>',
        f'<g fill="{GREY}" font-size="11" text-anchor="end">',
        f'<text x="{left - 6:g}" y="{top + 8:g}">{degrees}</text>',
        f'<text x="{left - 6:g}" y="{top + height / 2 + 4:g}">0</text>',
        f'<text x="{left - 6:g}" y="{top + height:g}">−{degrees}</text>',
        f'<text x="{left + width:g}" y="{top + height + 20:g}">{period:g} s</text>',
        f'<text x="{left + 6:g}" y="{top + height + 20:g}">0</text></g>',
        "</svg>",
    ]
    return "\n".join(out) + "\n"


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
    head = _joined(arrow_head(scene.hub, scene.nose), ",", " ")
    return [
        f'<path d="{arms}" stroke="{GREY}" stroke-width="5"/>',
        f'<path d="M{_number(x)} {_number(y)}L{tip}" stroke="{INK}" stroke-width="2"/>',
        f'<polygon points="{head}" fill="{INK}"/>',
        f'<circle cx="{_number(x)}" cy="{_number(y)}" r="6" fill="{INK}"/>',
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

    stroke = f'stroke="{INK}" stroke-width="2.5" marker-end="url(#tip)"'
    out = [f"<g>{moved('translate', centre)}", line(stalk, f'stroke="{GREY}" stroke-width="4"')]
    if not facing.all():
        behind = "hidden" if facing[0] else "visible"
        out.append(line(pushed, f'{stroke} visibility="{behind}"', switched("visibility", "hidden", "visible")))
    color = ROTOR_COLORS[rotor]
    fill = color if facing[0] else underside(color)
    out += [
        f'<g transform="matrix({basis})"><g>{moved("scale", np.stack([np.ones_like(squeeze), squeeze], -1), 3)}'
        f"<g>{moved('skewX', slant[:, None], 1)}",
        f'<circle r="1" fill="{fill}" stroke="{INK}" stroke-width="1.2" '
        f'vector-effect="non-scaling-stroke">{switched("fill", color, underside(color))}</circle></g></g></g>',
    ]
    if facing.any():
        before = "visible" if facing[0] else "hidden"
        out.append(line(pushed, f'{stroke} visibility="{before}"', switched("visibility", "visible", "hidden")))
    out.append(f'<circle r="2.5" fill="{INK}"/></g>')
    return out


def _svg_label(scene: Scene, rotor: int) -> list[str]:
    x, y = (_number(value) for value in scene.labels[rotor])
    return [
        f'<circle cx="{x}" cy="{y}" r="9" fill="{ROTOR_COLORS[rotor]}" stroke="{PAPER}" stroke-width="2"/>',
        f'<text x="{x}" y="{y}" dy="4" text-anchor="middle" font-weight="bold" fill="{INK}">{rotor + 1}</text>',
    ]


def provenance_of_svg(path: Path) -> str:
    """Return the text in the metadata of an SVG, or raise InputError; nothing of it is followed or expanded."""
    from xml.parsers import expat

    allowed = "an animated SVG that gaitgraph wrote"
    content = content_of(path, allowed)
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
