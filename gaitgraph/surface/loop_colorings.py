"""Every way to paint a closed loop of (α1, α2) by the Two Color rule: listed lazily, counted without listing."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field
from itertools import chain, groupby, islice
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.errors import InputError, did_you_mean, shown
from gaitgraph.invertibility.matrices import Coefficients, coefficients_of
from gaitgraph.surface.color_choices import (
    RELATION,
    SIGNS,
    STEPS,
    ChainCount,
    ColoringObstacle,
    Palette,
    Sign,
    labels_of,
    palette_of,
    plain_colors,
)
from gaitgraph.surface.solutions import COLORS, DEFAULT_CROSSING_TOLERANCE, checked_plane_angles
from gaitgraph.vehicle import PAPER, Vehicle

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

__all__ = ["Coloring", "ColoringListing", "Colorings", "colorings"]

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
