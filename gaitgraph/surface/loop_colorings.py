"""Every colouring of a closed loop of (α1, α2) by the Figure 15 rule: listed lazily, counted exactly."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field
from itertools import chain, groupby, islice
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from gaitgraph.errors import InputError, did_you_mean, shown
from gaitgraph.invertibility.matrices import Coefficients, coefficients_of, level_determinant, noise_of
from gaitgraph.surface.adjacency import text_from_types
from gaitgraph.surface.sheets import (
    COLORS,
    DEFAULT_CROSSING_TOLERANCE,
    at_end_of_range,
    checked_plane_angles,
    sheet_angles,
    types_of,
)
from gaitgraph.vehicle import PAPER, Vehicle

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

BoolArray = npt.NDArray[np.bool_]
Sign = Literal["positive", "negative"]
Matrix = tuple[int, int, int, int]

SIGNS: tuple[Sign, Sign] = ("negative", "positive")
"""The two signs of R, in the order in which colourings are listed: the paper's Figure 16 is of R < 0."""

RELATION = {"negative": "R < 0", "positive": "R > 0"}
"""The two signs in symbols."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ColoringObstacle:
    """Why a loop has no colouring with one sign of R.

    Parameters
    ----------
    kind
        "point": a point has no root with this sign; "pair": two neighbours forbid it.
    points
        The numbers of the points concerned, from 1, in the order of the loop.
    types
        The types of the roots that they can have, e.g. ``("(+,+)", "(-,-)")``; empty for "point".
    message
        What is in the way, with the rule of Figure 15 that it breaks.
    """

    kind: Literal["point", "pair"]
    points: tuple[int, ...]
    types: tuple[str, ...]
    message: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Palette:
    """What points (α1, α2) offer for one sign of R.

    Parameters
    ----------
    available
        Whether the red and the blue root have that sign, shape (n, 2).
    crossing
        Whether the type of α3 and that of α4 is `?`, shape (n, 2).
    """

    available: BoolArray
    crossing: BoolArray

    def __len__(self) -> int:
        return len(self.available)

    def __getitem__(self, part: slice) -> Palette:
        return Palette(available=self.available[part], crossing=self.crossing[part])

    def followed_by(self, more: Palette) -> Palette:
        """Return these points and then more."""
        return Palette(
            available=np.concatenate([self.available, more.available]),
            crossing=np.concatenate([self.crossing, more.crossing]),
        )

    @property
    def codes(self) -> npt.NDArray[np.int64]:
        """The step from each point to the next as five bits: red, blue before; red, blue after; may change."""
        change = (self.crossing[:-1] | self.crossing[1:]).all(axis=1)
        bits = np.column_stack([self.available[:-1], self.available[1:], change])
        return np.asarray((bits << np.arange(5)).sum(axis=1))


def palette_of(
    alpha1: npt.ArrayLike,
    alpha2: npt.ArrayLike,
    coefficients: Coefficients,
    crossing_tolerance: float = DEFAULT_CROSSING_TOLERANCE,
) -> dict[Sign, Palette]:
    """Return what points offer, for each sign of R; angles of shape (n,) [rad].

    On the sides of [−π/2, π/2]² a root stands at both ends of its range, once with each sign. With exact
    coefficients blue has R = 0 and no sign.
    """
    a1, a2 = np.asarray(alpha1, dtype=float), np.asarray(alpha2, dtype=float)
    noise = noise_of(coefficients)
    has: dict[Sign, list[BoolArray]] = {sign: [] for sign in SIGNS}
    crossing = np.stack([part == 0 for part in types_of("red", a1, a2, coefficients, crossing_tolerance)], axis=-1)
    for color in COLORS:
        a3, a4 = sheet_angles(color, a1, a2, coefficients)
        value = np.asarray(level_determinant(np.stack([a1, a2, a3, a4], axis=-1), coefficients))
        exists = np.full(value.shape, color == "red" or coefficients.kind == "published")
        either = at_end_of_range(a3) | at_end_of_range(a4)
        for sign, wanted in (("negative", -1.0), ("positive", 1.0)):
            toward = np.where(either, np.abs(value), wanted * value)
            has[sign].append(exists & (toward > noise))  # type: ignore[index]
    return {sign: Palette(available=np.stack(parts, axis=-1), crossing=crossing) for sign, parts in has.items()}


def _product(a: Matrix, b: Matrix) -> Matrix:
    return (
        a[0] * b[0] + a[1] * b[2],
        a[0] * b[1] + a[1] * b[3],
        a[2] * b[0] + a[3] * b[2],
        a[2] * b[1] + a[3] * b[3],
    )


def _power(matrix: Matrix, exponent: int) -> Matrix:
    out: Matrix = (1, 0, 0, 1)
    while exponent:
        if exponent & 1:
            out = _product(out, matrix)
        exponent >>= 1
        if exponent:
            matrix = _product(matrix, matrix)
    return out


def _step(code: int) -> Matrix:
    """Return the transfer matrix of a step: which color (red, blue) may follow which."""
    red, blue, red_after, blue_after, change = (code >> bit & 1 for bit in range(5))
    return red & red_after, red & blue_after & change, blue & red_after & change, blue & blue_after


STEPS = tuple(_step(code) for code in range(32))
"""The transfer matrices by the code of a step; see :attr:`Palette.codes`."""


class ChainCount:
    """Counts the colourings of a loop whose points come in pieces, and finds the first obstacle.

    Equal steps in a row are one power, and products are balanced, so that long loops with many colourings are
    counted without multiplying large numbers by small ones over and over.
    """

    def __init__(self, sign: Sign) -> None:
        self.sign = sign
        self.points = 0
        self.obstacle: ColoringObstacle | None = None
        self.always = np.ones(2, dtype=bool)  # whether every point can be red, and blue
        self._first: Palette | None = None
        self._last: Palette | None = None
        self._parts: list[tuple[int, Matrix]] = []
        self._reach: Matrix = (1, 0, 0, 1)  # from each color of the first point to each of the last one

    def see(self, points: Palette) -> None:
        """Append points to the chain."""
        if len(points) and self.obstacle is None:
            self.always &= points.available.all(axis=0)
            if self._last is None:
                self._first, offset = points[:1], 0
                red, blue = points.available[0].tolist()
                self._reach = (int(red), 0, 0, int(blue))
            else:
                points, offset = self._last.followed_by(points), self.points - 1
            self._extend(points, offset)
            self._last, self.points = points[-1:], offset + len(points)

    @property
    def plain(self) -> tuple[str, ...]:
        """The colors in which the whole loop can be painted."""
        return plain_colors(self.always)

    def closed(self) -> int:
        """Close the loop and return the exact number of its colourings."""
        if self.obstacle is None and self._first is not None and self._last is not None:
            step = self._last.followed_by(self._first)
            closing = STEPS[int(step.codes[0])]
            round_trip = _product(self._reach, closing)
            if round_trip[0] + round_trip[3]:
                total = closing
                for _, part in reversed(self._parts):
                    total = _product(part, total)
                return total[0] + total[3]
            start, end = divmod([bool(entry) for entry in self._reach].index(True), 2)
            self.obstacle = self._pair((self.points, 1), (COLORS[end], COLORS[start]), step.crossing)
        return 0

    def _extend(self, points: Palette, offset: int) -> None:
        """Multiply the steps between consecutive points; `offset` is the number of the first, from 0."""
        lacking = np.flatnonzero(~points.available.any(axis=1))
        codes = points.codes[: max(lacking[0] - 1, 0) if lacking.size else None]
        starts = np.flatnonzero(np.diff(codes, prepend=-1)).tolist()
        for start, end in zip(starts, [*starts, len(codes)][1:], strict=True):
            matrix = STEPS[codes[start]]
            reach = _product(self._reach, matrix)
            if not any(reach):
                before = COLORS[0 if self._reach[0] or self._reach[2] else 1]
                after = COLORS[0 if points.available[start + 1, 0] else 1]
                numbers = (offset + start + 1, offset + start + 2)
                self.obstacle = self._pair(numbers, (before, after), points.crossing[start : start + 2])
                return
            self._reach = (min(reach[0], 1), min(reach[1], 1), min(reach[2], 1), min(reach[3], 1))
            self._append(_power(matrix, end - start), end - start)
        if lacking.size:
            number = offset + int(lacking[0]) + 1
            message = f"point {number} has no root with {RELATION[self.sign]}, neither red nor blue"
            self.obstacle = ColoringObstacle(kind="point", points=(number,), types=(), message=message)

    def _append(self, matrix: Matrix, weight: int) -> None:
        self._parts.append((weight, matrix))
        while len(self._parts) > 1 and self._parts[-2][0] <= self._parts[-1][0]:
            (more, left), (weight, right) = self._parts[-2:]
            self._parts[-2:] = [(more + weight, _product(left, right))]

    def _pair(self, numbers: tuple[int, int], colors: tuple[str, str], crossing: BoolArray) -> ColoringObstacle:
        types = tuple(labels_of(colors, crossing))
        broken = [f"α{k + 3}" for k in range(2) if not crossing[:, k].any()]
        message = (
            f"points {numbers[0]} {types[0]} and {numbers[1]} {types[1]} may not be neighbours: with "
            f"{RELATION[self.sign]} the first can only be {colors[0]}, the second only {colors[1]}, and by Figure 15 "
            f"{' and '.join(broken)} may change between + and - only where one of the two is ?"
        )
        return ColoringObstacle(kind="pair", points=numbers, types=types, message=message)


def plain_colors(everywhere: BoolArray) -> tuple[str, ...]:
    """Return the colors that every point can have, from whether every point can be red, and blue."""
    return tuple(color for color, yes in zip(COLORS, everywhere, strict=True) if yes)


def labels_of(colors: Sequence[str], crossing: BoolArray) -> list[str]:
    """Return the plane types, as texts, of points of these colors; `crossing` is that of :class:`Palette`."""
    signs = np.array([1 if color == "red" else -1 for color in colors])[:, None]
    return [text_from_types(*pair) for pair in np.where(crossing, 0, signs).tolist()]


FloatArray = npt.NDArray[np.float64]

MOST_LISTED = 16
"""As many colourings as a report lists; it counts all."""

_MOST_DIGITS = 4000


@dataclass(frozen=True, slots=True, kw_only=True)
class Coloring:
    """A color for each point of a loop, with the sign of R that the roots of these colors have."""

    colors: tuple[str, ...]
    sign: Sign

    def __str__(self) -> str:
        runs = [(color, len(list(run))) for color, run in groupby(self.colors)]
        if len(runs) == 1:
            return f"{RELATION[self.sign]}  all {runs[0][0]}"
        parts, start = [], 1
        for color, size in runs:
            parts.append(f"{color} {start}" + (f" to {start + size - 1}" if size > 1 else ""))
            start += size
        return f"{RELATION[self.sign]}  {', '.join(parts)} (jumps between the sheets)"


@dataclass(frozen=True, slots=True, kw_only=True)
class Colorings:
    """Every Two-Color-consistent colouring of a closed loop; iterate to list them, lazily.

    Colourings with R < 0 come first, then those with R > 0, each in lexicographic order with red before blue. Every
    iteration starts anew. Falsy when there is none.

    Parameters
    ----------
    points
        The loop, shape (n, 2) [rad]; closed by itself.
    palettes
        What its points offer, for each sign of R that was asked for.
    counts
        The exact number of colourings for each sign.
    obstacles
        Why there is none, for each sign without one.
    """

    points: FloatArray
    palettes: dict[Sign, Palette]
    counts: dict[Sign, int] = field(default_factory=dict)
    obstacles: dict[Sign, ColoringObstacle] = field(default_factory=dict)

    @property
    def count(self) -> int:
        """The exact number of colourings."""
        return sum(self.counts.values())

    def __bool__(self) -> bool:
        return self.count > 0

    def __iter__(self) -> Iterator[Coloring]:
        return chain.from_iterable(map(self.of, self.palettes))

    def of(self, sign: Sign) -> Iterator[Coloring]:
        """Return an iterator over the colourings with one sign of R."""
        if not self.counts[sign]:
            return
        palette = self.palettes[sign]
        codes, has = palette.followed_by(palette[:1]).codes.tolist(), palette.available
        for first in range(2):
            if has[0, first]:
                for path in _paths(codes, first):
                    yield Coloring(colors=tuple(COLORS[c] for c in path), sign=sign)

    def as_mapping(self) -> dict[str, Any]:
        """Return how many there are, and why there are none, as plain values, ready for JSON."""
        return {
            **_count_as_mapping(self.count),
            "counts": {sign: _count_as_mapping(count)["colorings_count"] for sign, count in self.counts.items()},
            "coloring_obstacles": {sign: asdict(obstacle) for sign, obstacle in self.obstacles.items()},
        }

    def __str__(self) -> str:
        n = len(self.points)
        lines = [
            f"{_count_as_text(self.count)} colouring{'s' * (self.count != 1)} of a loop of {n} point{'s' * (n > 1)}"
        ]
        lines += [f"  {RELATION[sign]}  none: {obstacle.message}" for sign, obstacle in self.obstacles.items()]
        return "\n".join(lines)

    def listing(self) -> ColoringListing:
        """Return the first colourings and their number."""
        plain = {
            sign: plain_colors(np.asarray(palette.available.all(axis=0))) for sign, palette in self.palettes.items()
        }
        first = tuple(islice(self, MOST_LISTED))
        return ColoringListing(counts=self.counts, plain=plain, first=first, obstacles=self.obstacles)

    def types_of(self, coloring: Coloring) -> list[str]:
        """Return the plane types of every point in a colouring."""
        return labels_of(coloring.colors, self.palettes[coloring.sign].crossing)


@dataclass(frozen=True, slots=True, kw_only=True)
class ColoringListing:
    """The first colourings of a loop, and how many there are.

    Parameters
    ----------
    counts
        The exact number of colourings for each sign of R.
    plain
        The colors in which the whole loop can be painted, for each sign.
    first
        The first of them, at most 16; none for a loop that is too long to be listed.
    obstacles
        Why there is none, for each sign without one.
    """

    counts: dict[Sign, int]
    plain: dict[Sign, tuple[str, ...]]
    first: tuple[Coloring, ...]
    obstacles: dict[Sign, ColoringObstacle]

    @property
    def count(self) -> int:
        """The exact number of colourings."""
        return sum(self.counts.values())

    def as_mapping(self) -> dict[str, Any]:
        """Return plain values, ready for JSON; a count of more than 4000 digits is given by its logarithm alone."""
        return {
            "colorings": [list(coloring.colors) for coloring in self.first],
            "coloring_signs": [coloring.sign for coloring in self.first],
            **_count_as_mapping(self.count),
            "coloring_obstacles": {sign: asdict(obstacle) for sign, obstacle in self.obstacles.items()},
        }

    def __str__(self) -> str:
        if not self.count:
            return "none: " + "; ".join(obstacle.message for obstacle in self.obstacles.values())
        parts = []
        for sign, count in self.counts.items():
            if count:
                plain = self.plain[sign]
                mixed = "" if len(plain) == count else " (those that change color jump between the sheets)"
                all_of = f", all {' or all '.join(plain)}" if plain else ""
                parts.append(f"{_count_as_text(count)} with {RELATION[sign]}{all_of}{mixed}")
        return "; ".join(parts)


def _digits(count: int) -> float:
    """Return the decimal logarithm of a count; 0 for none."""
    return math.log10(count) if count else 0.0


def _count_as_text(count: int) -> str:
    return str(count) if _digits(count) <= _MOST_DIGITS else f"about 10^{_digits(count):.0f}"


def _count_as_mapping(count: int) -> dict[str, Any]:
    if _digits(count) <= _MOST_DIGITS:
        return {"colorings_count": count}
    return {"colorings_count": None, "colorings_count_log10": _digits(count)}


def _paths(codes: Sequence[int], first: int) -> Iterator[list[int]]:
    """Yield every closed path of colors (0 or 1) that begins with one, in lexicographic order, without dead ends."""
    n = len(codes)
    # home[k] holds, as bits, the colors at point k from which the end can be the first color again.
    home = [0] * n + [1 << first]
    for k in range(n - 1, -1, -1):
        matrix = STEPS[codes[k]]
        for color in range(2):
            reached = matrix[2 * color] | matrix[2 * color + 1] << 1
            home[k] |= bool(reached & home[k + 1]) << color
    if not home[0] >> first & 1:
        return

    def onward(k: int, color: int) -> Iterator[int]:
        row = STEPS[codes[k]][2 * color : 2 * color + 2]
        return iter([after for after in range(2) if row[after] and home[k + 1] >> after & 1])

    path, open_ = [first], [onward(0, first)]
    if n == 1:
        yield path
        return
    while open_:
        following = next(open_[-1], None)
        if following is None:
            open_.pop()
            path.pop()
        elif len(path) == n - 1:
            yield [*path, following]
        else:
            path.append(following)
            open_.append(onward(len(path) - 1, following))


def colorings(
    points: npt.ArrayLike,
    *,
    sign: str = "auto",
    vehicle: Vehicle = PAPER,
    coefficients: Coefficients | None = None,
    crossing_tolerance: float = DEFAULT_CROSSING_TOLERANCE,
) -> Colorings:
    """Return every Two-Color-consistent colouring of a closed loop, counted and ready to be listed.

    Parameters
    ----------
    points
        The loop, shape (n, 2) or (n, 4), of which α1 and α2 count [rad]; closed by itself, so a last point that
        repeats the first is one more point.
    sign
        Sign of R that the roots must have: "negative", "positive", or "auto" for both, one after the other.
    vehicle, coefficients
        By default the paper's vehicle with its published coefficients. With exact coefficients blue has R = 0, so
        only all-red colourings remain.
    crossing_tolerance
        Distance from a crossing line within which a type is `?` [rad].

    Raises
    ------
    InputError
        If a point is not finite or outside [−π/2, π/2]², or a name is unknown.

    Notes
    -----
    The rule compares neighbours and nothing else, as Figure 15 does: a colouring that changes color at a `?` point
    jumps between the sheets, so it is two-color and not continuous. Whether R keeps its sign between the points is
    for :func:`gaitgraph.validate` to say.

    Examples
    --------
    >>> from math import pi
    >>> loop = [(3 * pi / 8, -3 * pi / 8), (3 * pi / 8, -pi / 8), (pi / 8, -pi / 8), (pi / 8, -3 * pi / 8)]
    >>> found = colorings(loop)
    >>> found.count, [coloring.colors[0] for coloring in found]
    (2, ['red', 'blue'])
    >>> colorings([(0.9, 0.3), (0.9, -0.9)], sign="positive").obstacles["positive"].message
    'point 1 has no root with R > 0, neither red nor blue'
    """
    try:
        plane = np.asarray(points, dtype=float)
    except (TypeError, ValueError) as error:
        raise InputError(f"points: {shown(points)}; allowed are pairs (α1, α2) of numbers [rad]") from error
    if plane.ndim != 2 or plane.shape[1] not in (2, 4) or not len(plane):
        raise InputError(f"points: an array of shape {plane.shape}; allowed is (n, 2) or (n, 4) with n at least 1")
    if not isinstance(sign, str) or sign not in ("auto", *SIGNS):
        hint = did_you_mean(sign, ["auto", "negative", "positive"]) if isinstance(sign, str) else ""
        raise InputError(f"sign: {shown(sign)}; allowed are auto, negative and positive{hint}")
    a1, a2 = checked_plane_angles(plane[:, 0], plane[:, 1])
    every = palette_of(a1, a2, coefficients or coefficients_of(vehicle), crossing_tolerance)
    palettes = {one: palette for one, palette in every.items() if sign in ("auto", one)}
    counts: dict[Sign, int] = {}
    obstacles: dict[Sign, ColoringObstacle] = {}
    for one, palette in palettes.items():
        counting = ChainCount(one)
        counting.see(palette)
        counts[one] = counting.closed()
        if counting.obstacle is not None:
            obstacles[one] = counting.obstacle
    return Colorings(points=plane[:, :2], palettes=palettes, counts=counts, obstacles=obstacles)
