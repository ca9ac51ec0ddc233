"""What the points of a loop offer: colors by sign of R and crossings, and how many colourings follow from them.

At each point of a loop the red and the blue root have the sign of R that is asked for, or not. Both share their
crossing lines: α3 is `?` for both or for neither, and so is α4. So between neighbours a color may always stay, and
may change exactly if α3 is `?` at one of the two, and α4 as well (Figure 15). The colourings of a loop are the
closed walks through a chain of 2×2 matrices of zeros and ones, their number is the trace of its product.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
import numpy.typing as npt

from gaitgraph.invertibility.matrices import Coefficients, level_determinant, noise_of
from gaitgraph.surface.solutions import (
    COLORS,
    DEFAULT_CROSSING_TOLERANCE,
    at_end_of_range,
    sheet_angles,
    text_from_types,
    types_of,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = [
    "RELATION",
    "SIGNS",
    "STEPS",
    "ChainCount",
    "ColoringObstacle",
    "Palette",
    "labels_of",
    "palette_of",
    "plain_colors",
]

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
