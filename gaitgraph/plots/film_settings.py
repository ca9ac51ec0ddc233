"""What the animated pictures of a gait share: what they show, where, in which colors, and how they are read.

All show one period: above the vehicle with its discs and lines of thrust, below its four angles over time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from gaitgraph.errors import InputError
from gaitgraph.files import blocks_of
from gaitgraph.gait.table import Table, provenance_text, setting_of
from gaitgraph.plots.scenes import Scene, scene_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from pathlib import Path

__all__ = [
    "CHART",
    "GREY",
    "HEIGHT",
    "INK",
    "MOST_FRAMES",
    "PALE",
    "PAPER",
    "SCENE",
    "SHORTEST",
    "THICK",
    "THIN",
    "WIDTH",
    "Film",
    "arrow_head",
    "content_of",
    "film_of",
    "pace_told",
    "underside",
]

FloatArray = npt.NDArray[np.float64]

MOST_FRAMES = 100
"""Frames of a period at most; a longer table is sampled."""

SHORTEST = 0.2
"""Seconds that a picture lasts at least; a shorter period is shown slower."""

WIDTH, HEIGHT = 480, 420
SCENE = (0.0, 36.0, 480.0, 272.0)  # left, top, width, height
CHART = (52.0, 326.0, 412.0, 66.0)
INK, GREY, PALE, PAPER = "#23262b", "#767b85", "#dfe2e7", "#ffffff"
THICK, THIN = 5.0, 1.8  # of opposite rotors, which move together on the red sheet
_CURVE_POINTS = 160
_HEAD = 9.0

_WHAT = "gait file"
_MOST_BYTES = 1 << 26


@dataclass(frozen=True, slots=True, kw_only=True)
class Film:
    """What both kinds of picture draw: a scene with its frames, and the angles below it."""

    scene: Scene
    title: str
    about: str
    alpha: FloatArray  # of the curves, shape (n, 4)
    most: float  # of the chart's angles [rad]

    def curve(self, rotor: int) -> FloatArray:
        """Return the corners of an angle's curve in the chart, shape (n, 2) [px]."""
        left, top, width, height = CHART
        x = left + np.linspace(0.0, width, len(self.alpha))
        y = top + height / 2 * (1.0 - self.alpha[:, rotor] / self.most)
        return np.stack([x, y], axis=-1)


def film_of(pieces: Iterable[Table], fractions_of: Callable[[float], FloatArray]) -> tuple[Film, float]:
    """Return the film of a table and its period [s]; `fractions_of` says for a period where in it frames are wanted."""
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

    def angles(at: FloatArray) -> FloatArray:
        return np.stack([np.interp(at * period, t, alpha[:, k]) for k in range(4)], axis=-1)

    vehicle = setting_of(first)[0]
    curves = angles(np.linspace(0.0, 1.0, _CURVE_POINTS + 1))
    name = vehicle.name if len(vehicle.name) <= 32 else vehicle.name[:31] + "…"
    law = first.about.get("law")
    film = Film(
        scene=scene_of(angles(fractions_of(period)), vehicle, size=SCENE[2:]),
        title=" · ".join([f"Vehicle {name}", f"T = {period:g} s", *([law] if isinstance(law, str) else [])]),
        about=provenance_text(first),
        alpha=curves,
        most=max(math.radians(10.0) * math.ceil(math.degrees(float(np.abs(curves).max())) / 10.0), math.radians(10.0)),
    )
    return film, period


def pace_told(period: float, seconds: float) -> str:
    """Return what a title says if the picture does not keep the gait's own pace."""
    if abs(seconds - period) <= max(0.005, 1e-9 * period):
        return ""
    return f" (shown {'slower' if seconds > period else 'faster'}: {seconds:g} s)"


def underside(color: str) -> str:
    """Return the color of a disc's underside: half way to the ink.

    >>> underside("#ffffff")
    '#9c9d9f'
    """
    mixed = ((int(color[k : k + 2], 16) * 11 + int(INK[k : k + 2], 16) * 9) // 20 for k in (1, 3, 5))
    return "#" + "".join(f"{part:02x}" for part in mixed)


def arrow_head(start: FloatArray, end: FloatArray) -> FloatArray:
    """Return the corners of the head of an arrow, shape (3, 2)."""
    along = (end - start) / max(float(np.hypot(*(end - start))), 1e-9)
    side = 0.5 * np.array([-along[1], along[0]])
    return np.stack([end, end - _HEAD * (along + side), end - _HEAD * (along - side)])


def content_of(path: Path, allowed: str) -> bytes:
    """Return the bytes of a picture, or raise InputError if there are more than one has."""
    size, blocks = 0, []
    for block, _ in blocks_of(path, _WHAT, allowed):
        size += len(block)
        if size > _MOST_BYTES:
            raise InputError(f"it has more than {_MOST_BYTES >> 20} MiB; allowed is {allowed} up to that")
        blocks.append(block)
    return b"".join(blocks)
