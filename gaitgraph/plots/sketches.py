"""Small pictures as SVG text, a few lines each, for pages that show an object: loops, angles in time, arms, verdicts.

They need no drawing library, carry no ids, and so can stand on a page twice. Lines and letters take the colour of the
text around them, and the two colours of the sheets are midway between black and white: light and dark pages both do.
Texts are escaped by the XML library that builds them. The same object gives the same text.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any
from xml.etree.ElementTree import Element, SubElement

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import HALF_PI
from gaitgraph.surface.sheets import FIBERS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from shapely import MultiPolygon

    from gaitgraph.gait.gait import Gait
    from gaitgraph.timing.timed_gait import TimedGait
    from gaitgraph.vehicle import Vehicle

__all__ = ["HUES", "MOST_RINGS", "plane_of", "plane_sketch", "time_sketch", "vehicle_sketch", "verdict_sketch"]

FloatArray = npt.NDArray[np.float64]

HUES = {"red": "#e0301e", "blue": "#3d7eea", "yes": "#2e9a4b", "no": "#e0301e", "unknown": "#b8860b"}
"""What tells sheets and verdicts apart, beside marks and words: at least 3 : 1 on white and on near black."""

MOST_RINGS = 60
"""How many waypoints a picture shows."""

# Opposite rotors, which move together on the red sheet, differ in width: the thin line lies on the wide one.
_LOOKS = (("#c77700", 4.0, ""), ("#2b8fc7", 4.0, ""), ("currentColor", 1.2, "5 3"), ("currentColor", 1.2, "1.5 2"))
_MOST_POINTS = 400
_MOST_PARTS = 60
_MOST_CORNERS = 24
_SIDE = 150.0  # of the square of a plane


def _svg(width: float, height: float, title: str) -> Element:
    """Return an empty picture that says what it shows."""
    svg = Element(
        "svg",
        {
            "xmlns": "http://www.w3.org/2000/svg",
            "role": "img",
            "aria-label": title,
            "width": _number(width),
            "height": _number(height),
            "viewBox": f"0 0 {_number(width)} {_number(height)}",
            "style": "max-width:100%;font:10px sans-serif;flex:none",
        },
    )
    SubElement(svg, "title").text = title
    return svg


def _number(value: float) -> str:
    text = f"{value:.1f}".removesuffix(".0")
    return "0" if text == "-0" else text


def _draw(parent: Element, tag: str, **attributes: Any) -> Element:
    """Append an element; an underscore in a name stands for a hyphen, and numbers keep one decimal."""
    texts = {
        name.replace("_", "-"): value if isinstance(value, str) else _number(value)
        for name, value in attributes.items()
    }
    return SubElement(parent, tag, texts)


def _write(parent: Element, x: float, y: float, text: str, **attributes: Any) -> None:
    attributes = {"text_anchor": "middle", "fill": "currentColor"} | attributes
    _draw(parent, "text", x=x, y=y, **attributes).text = text


def _way(points: FloatArray, *, closed: bool = False) -> str:
    """Return the path through points on the page."""
    places = " ".join(f"{_number(x)},{_number(y)}" for x, y in points.tolist())
    return f"M{places}{'Z' if closed else ''}"


def _fewer(points: FloatArray) -> FloatArray:
    """Return points on the page without those that the eye would not miss, so few that pages stay small."""
    if len(points) <= _MOST_POINTS // 8:
        return points
    import shapely

    line, off = shapely.LineString(points), 0.2
    while True:
        kept = shapely.get_coordinates(line.simplify(off, preserve_topology=False))
        if len(kept) <= _MOST_POINTS:
            return np.asarray(kept)
        off *= 2


class _Square:
    """A square frame with both axes from −end to end [rad], and what is where in it."""

    def __init__(self, svg: Element, symbols: tuple[str, str], end: float) -> None:
        self.end = end
        self.left, self.top = 30.0, 8.0
        dim = {"stroke": "currentColor", "stroke_opacity": "0.25", "stroke_width": "1"}
        right, below, middle = self.left + _SIDE, self.top + _SIDE, _SIDE / 2
        _draw(svg, "rect", x=self.left, y=self.top, width=_SIDE, height=_SIDE, fill="none", **dim)
        _draw(svg, "line", x1=self.left, y1=self.top + middle, x2=right, y2=self.top + middle, **dim)
        _draw(svg, "line", x1=self.left + middle, y1=self.top, x2=self.left + middle, y2=below, **dim)
        far = "π/2" if end == HALF_PI else f"{end:.3g}"
        _write(svg, self.left, below + 12, f"−{far}")
        _write(svg, self.left + middle, below + 12, symbols[0])
        _write(svg, right, below + 12, far)
        _write(svg, self.left - 4, below, f"−{far}", text_anchor="end")
        _write(svg, self.left - 4, self.top + middle + 3, symbols[1], text_anchor="end")
        _write(svg, self.left - 4, self.top + 8, far, text_anchor="end")

    def __call__(self, points: npt.ArrayLike) -> FloatArray:
        """Return where points are on the page, shape (n, 2)."""
        places = np.asarray(points, dtype=float).reshape(-1, 2) / self.end
        return np.column_stack([self.left + (places[:, 0] + 1) * _SIDE / 2, self.top + (1 - places[:, 1]) * _SIDE / 2])


def plane_of(gait: Gait) -> tuple[int, int]:
    """Return which two angles, counted from 1, show a gait best: (1, 2), or those that are free on its fibre.

    >>> from gaitgraph.gait.gait import lift
    >>> plane_of(lift([(0.4, -0.4)], "red"))
    (1, 2)
    """
    if gait.color in FIBERS:
        return (2, 4) if gait.color == FIBERS[0] else (1, 3)
    return (1, 2)


def plane_sketch(
    title: str,
    *,
    gait: Gait | None = None,
    waypoints: Sequence[Sequence[float]] = (),
    region: MultiPolygon | None = None,
) -> Element:
    """Return a picture of the (α1, α2) plane: a region, a gait's loop, waypoints. Each may be left out.

    Parameters
    ----------
    title
        What the picture shows, for those who do not see it.
    gait
        Drawn in the color of its sheet, squares at red corners and discs at blue ones; a ring where it starts. On a
        fibre its two free angles are shown.
    waypoints
        (α1, α2), or all four tilt angles [rad], drawn as rings, the first :data:`MOST_RINGS` of them.
    region
        Shaded [rad]; the largest parts if there are very many.
    """
    angles = (1, 2) if gait is None else plane_of(gait)
    loop = np.zeros((0, 2)) if gait is None else gait.alpha[:, [angles[0] - 1, angles[1] - 1]]
    # A waypoint on a fibre has four angles; one of (α1, α2) has no place in another plane.
    rows = [[point[k - 1] for k in angles] for point in waypoints if max(angles) <= len(point)]
    asked = np.array(rows, dtype=float).reshape(-1, 2)
    end = float(np.abs(np.vstack([loop, asked, [[HALF_PI, 0.0]]])).max())
    svg = _svg(_SIDE + 44, _SIDE + 26, title)
    place = _Square(svg, (f"α{angles[0]}", f"α{angles[1]}"), HALF_PI if end < HALF_PI * (1 + 1e-9) else end)
    if region is not None and not region.is_empty and angles == (1, 2):
        _draw_region(svg, place, region)
    if gait is not None:
        _draw_loop(svg, place(loop), gait.colors)
    for x, y in place(asked[:MOST_RINGS]).tolist():
        _draw(svg, "circle", cx=x, cy=y, r=5, fill="none", stroke="currentColor", stroke_width="1.5")
    return svg


def _draw_region(svg: Element, place: _Square, region: MultiPolygon) -> None:
    import shapely

    parts = sorted(region.geoms, key=lambda part: -part.area)[:_MOST_PARTS]
    rings = [ring for part in parts for ring in (part.exterior, *part.interiors)][: 2 * _MOST_PARTS]
    shapes = np.array([shapely.linearrings(place(np.asarray(ring.coords))) for ring in rings], dtype=object)
    off = 0.2
    while shapely.get_num_coordinates(shapely.simplify(shapes, off)).sum() > 2 * _MOST_POINTS:
        off *= 2
    ways = [shapely.get_coordinates(ring) for ring in shapely.simplify(shapes, off)]
    look = {"fill": "currentColor", "fill_opacity": "0.14", "fill_rule": "evenodd"}
    way = "".join(_way(points[:-1], closed=True) for points in ways)
    _draw(svg, "path", d=way, stroke="currentColor", stroke_opacity="0.5", stroke_width="0.8", **look)


def _draw_loop(svg: Element, points: FloatArray, colors: Sequence[str]) -> None:
    """Draw a closed polyline on the page, a segment in the color of the corner that it starts from."""
    dash = {} if colors else {"stroke_dasharray": "5 3"}
    stroke = {"fill": "none", "stroke_width": "2", "stroke_linejoin": "round", **dash}
    if len(set(colors)) > 1 and len(points) <= _MOST_POINTS // 2:
        segments = np.stack([points, np.roll(points, -1, axis=0)], axis=1)
        for color in dict.fromkeys(colors):
            way = "".join(_way(segments[k]) for k, name in enumerate(colors) if name == color)
            _draw(svg, "path", d=way, stroke=HUES.get(color, "currentColor"), **stroke)
    else:
        hue = HUES.get(colors[0], "currentColor") if len(set(colors)) == 1 else "currentColor"
        way = _way(_fewer(np.vstack([points, points[:1]])), closed=True)
        _draw(svg, "path", d=way, stroke=hue, **stroke)
    if len(points) <= _MOST_CORNERS:
        for (x, y), color in zip(points.tolist(), colors or [""] * len(points), strict=True):
            hue = HUES.get(color, "currentColor")
            if color == "red":
                _draw(svg, "rect", x=x - 3, y=y - 3, width=6, height=6, fill=hue)
            else:
                _draw(svg, "circle", cx=x, cy=y, r=3, fill=hue)
    first = points[0]
    _draw(svg, "circle", cx=first[0], cy=first[1], r=6.5, fill="none", stroke="currentColor", stroke_width="1")
    _draw_heading(svg, points)


def _draw_heading(svg: Element, points: FloatArray) -> None:
    """Draw an arrow head on the first segment that is long enough for one."""
    steps = np.roll(points, -1, axis=0) - points
    lengths = np.hypot(*steps.T)
    if not (lengths >= 18).any():
        return
    k = int(np.argmax(lengths >= 18))
    ahead = steps[k] / lengths[k]
    across = np.array([-ahead[1], ahead[0]])
    tip = points[k] + 0.5 * steps[k] + 5 * ahead
    head = np.array([tip, tip - 9 * ahead + 5 * across, tip - 9 * ahead - 5 * across])
    _draw(svg, "path", d=_way(head, closed=True), fill="currentColor")


def time_sketch(timed: TimedGait, title: str) -> Element:
    """Return a picture of the four tilt angles over one period.

    Parameters
    ----------
    timed
        The gait with its clock.
    title
        What the picture shows, for those who do not see it.
    """
    width, left, top = 250.0, 34.0, 24.0
    svg = _svg(left + width + 12, top + _SIDE + 18, title)
    corners = timed.corner_times
    many = len(corners) > _MOST_POINTS
    times = np.linspace(0.0, timed.period, 4001) if many else np.union1d(corners, np.linspace(0.0, timed.period, 241))
    alpha = timed.at(times)[0]
    end = max(HALF_PI, float(np.abs(alpha).max()))
    far = "π/2" if end < HALF_PI * (1 + 1e-9) else f"{end:.3g}"
    for share, text in ((0.0, far), (0.5, "0"), (1.0, f"−{far}")):
        y = top + share * _SIDE
        dim = {"stroke": "currentColor", "stroke_opacity": "0.25", "stroke_width": "1"}
        _draw(svg, "line", x1=left, y1=y, x2=left + width, y2=y, **dim)
        _write(svg, left - 4, y + 3, text, text_anchor="end")
    for share in (0.0, 0.5, 1.0):
        text = "t" if share == 0.5 else f"{share * timed.period:.4g} s"
        _write(svg, left + share * width, top + _SIDE + 13, text, text_anchor="end" if share == 1 else "middle")
    for k, (hue, size, dash) in enumerate(_LOOKS):
        look = {"fill": "none", "stroke": hue, "stroke_width": size}
        look |= {"stroke_dasharray": dash} if dash else {}
        x = left + 6 + 62 * k
        _draw(svg, "line", x1=x, y1=10, x2=x + 22, y2=10, **look)
        _write(svg, x + 27, 13, f"α{k + 1}", text_anchor="start")
        places = np.column_stack([left + times / timed.period * width, top + (1 - alpha[:, k] / end) * _SIDE / 2])
        _draw(svg, "path", d=_way(_fewer(places)), **look)
    return svg


def vehicle_sketch(vehicle: Vehicle, title: str) -> Element:
    """Return a picture of a vehicle's arms from above: body x up the page, y to the left, rotors with their spins.

    Parameters
    ----------
    vehicle
        Its `first_arm_angle` and `first_rotor_spin` are all that shows.
    title
        What the picture shows, for those who do not see it.
    """
    size, arm, disc = 180.0, 52.0, 23.0
    svg = _svg(size, size, title)
    middle = size / 2
    clockwise = vehicle.first_rotor_spin == "clockwise"
    line = {"stroke": "currentColor", "fill": "none"}
    for number in range(1, 5):
        angle = vehicle.first_arm_angle + (number - 1) * HALF_PI
        x, y = middle - arm * math.sin(angle), middle - arm * math.cos(angle)
        inward = 1 - disc / arm
        tip = {"x2": middle + inward * (x - middle), "y2": middle + inward * (y - middle)}
        _draw(svg, "line", x1=middle, y1=middle, **tip, stroke_width="3", stroke_opacity="0.6", **line)
        turns_clockwise = clockwise == (number % 2 == 1)
        hue = _LOOKS[number % 2][0]
        _draw(svg, "circle", cx=x, cy=y, r=disc, fill=hue, fill_opacity="0.18", stroke=hue, stroke_width="1")
        _draw_spin(svg, x, y, disc - 6, clockwise=turns_clockwise, hue=hue)
        _write(svg, x, y + 4, str(number), font_weight="bold", font_size="12")
    _draw(svg, "circle", cx=middle, cy=middle, r=3, fill="currentColor")
    _draw(svg, "path", d="M14,40 14,16M9,23 14,14 19,23", stroke_width="1.5", **line)
    _write(svg, 22, 18, "x forward", text_anchor="start")
    return svg


def _draw_spin(svg: Element, x: float, y: float, radius: float, *, clockwise: bool, hue: str) -> None:
    """Draw three quarters of a turn with an arrow head at its end."""
    side = 1 if clockwise else -1
    start, end = (x - side * radius * 0.707, y + radius * 0.707), (x + side * radius * 0.707, y + radius * 0.707)
    arc = (
        f"M{_number(start[0])},{_number(start[1])}A{_number(radius)},{_number(radius)} 0 1 {int(clockwise)} "
        f"{_number(end[0])},{_number(end[1])}"
    )
    _draw(svg, "path", d=arc, fill="none", stroke=hue, stroke_width="2")
    head = np.array([end]) + np.array([[-side * 4.5, 4.5], [-side * 4.5, -3.5], [side * 3.5, 4.5]])
    _draw(svg, "path", d=_way(head, closed=True), fill=hue)


def verdict_sketch(answers: Sequence[tuple[str, bool | None]], title: str) -> Element:
    """Return a picture of answers: a tick, a cross or a question mark beside each name.

    >>> verdict_sketch([("valid", True)], "the verdict").attrib["aria-label"]
    'the verdict'
    """
    widths = [30 + 6.4 * len(name) for name, _ in answers]
    svg = _svg(sum(widths) + 4, 24, title)
    x = 2.0
    for (name, answer), width in zip(answers, widths, strict=True):
        hue = HUES[{True: "yes", False: "no", None: "unknown"}[answer]]
        look = {"fill": "none", "stroke": hue, "stroke_width": "2.4"}
        _draw(svg, "circle", cx=x + 10, cy=12, r=9, fill=hue, fill_opacity="0.15", stroke=hue, stroke_width="1")
        if answer is None:
            _write(svg, x + 10, 16, "?", font_weight="bold", font_size="12")
        else:
            shape = f"M{_number(x + 5.5)},12.5l3.5,3.5 6,-7.5" if answer else f"M{_number(x + 6.5)},8.5l7,7m0,-7l-7,7"
            _draw(svg, "path", d=shape, **look)
        _write(svg, x + 23, 16, name, text_anchor="start", font_size="12")
        x += width
    return svg
