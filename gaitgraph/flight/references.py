"""Where a flight is to be: references in x, y and altitude."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from gaitgraph.flight.settings import FlightSettings

__all__ = ["Reference", "reference_of"]

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Reference:
    """A place for every time; see :class:`FlightSettings` for what the kinds are.

    >>> Reference(kind="circle", size=2.0, lap=6.0).at([0.0, 3.0, 9.0])[0][:, 0].round(9).tolist()
    [0.0, 4.0, 0.0]
    """

    kind: str
    size: float
    lap: float

    def at(self, t: npt.ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return places [m], velocities [m/s] and accelerations [m/s²] at times of shape (n,), each of shape (n, 3)."""
        t = np.asarray(t, dtype=float)
        place, velocity, acceleration = (np.zeros((len(t), 3)) for _ in range(3))
        if self.kind == "step":
            place[:, 0] = self.size
        elif self.kind in ("line", "circle"):
            part = np.clip(t / self.lap, 0.0, 1.0)
            share = part**3 * (10 - 15 * part + 6 * part**2)
            first = 30 * part**2 * (1 - part) ** 2 / self.lap
            second = 60 * part * (1 - part) * (1 - 2 * part) / self.lap**2
            if self.kind == "line":
                place[:, 0], velocity[:, 0], acceleration[:, 0] = (self.size * one for one in (share, first, second))
            else:
                angle, turn, faster = (2 * math.pi * one for one in (share, first, second))
                sine, cosine = np.sin(angle), np.cos(angle)
                place[:, 0], place[:, 1] = self.size * (1 - cosine), self.size * sine
                velocity[:, 0], velocity[:, 1] = self.size * turn * sine, self.size * turn * cosine
                acceleration[:, 0] = self.size * (faster * sine + turn**2 * cosine)
                acceleration[:, 1] = self.size * (faster * cosine - turn**2 * sine)
        return place, velocity, acceleration

    def rows(self, t: FloatArray, ahead: float = 0.0) -> list[list[float]]:
        """Return (x, y, z, ẋ, ẏ, ẍ, ÿ) at times of shape (n,) as plain numbers; ẍ, ÿ are those of some time ahead."""
        place, velocity, _ = self.at(t)
        acceleration = self.at(t + ahead)[2]
        rows: list[list[float]] = np.hstack([place, velocity[:, :2], acceleration[:, :2]]).tolist()
        return rows


def reference_of(settings: FlightSettings) -> Reference:
    """Return the reference that settings ask for."""
    return Reference(kind=settings.reference, size=settings.size, lap=settings.lap)
