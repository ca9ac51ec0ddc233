"""A gait piece by piece: what it is judged by, the pieces, places on them, and what every rule shares.

A gait is a chain of points joined by straight segments. It may be too long to be held at once, so a rule sees it as
*stretches*, one after the other, keeps what is worst, and says at the end what it found. Where the pieces are cut makes
no difference to a verdict.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.surface.sheets import DEFAULT_CROSSING_TOLERANCE

if TYPE_CHECKING:
    from gaitgraph.invertibility.branch_and_bound import Least
    from gaitgraph.invertibility.matrices import Coefficients
    from gaitgraph.validation.report import Check
    from gaitgraph.vehicle import Vehicle

__all__ = ["Place", "Rule", "Setting", "Stretch", "Worst"]

FloatArray = npt.NDArray[np.float64]
SheetArray = npt.NDArray[np.int8]


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """What a gait is judged for and by.

    Parameters
    ----------
    vehicle, coefficients, crossing_tolerance
        What the gait is for.
    tolerance, floor
        Limits of the checks.
    angle_rounding
        What each angle may be off by [rad]; None: what is seen, and at least `digits`.
    digits
        What each angle may be off by because it is printed with few digits [rad].
    noun
        What messages call a point of the gait: "corner" or "row".
    """

    vehicle: Vehicle
    coefficients: Coefficients
    tolerance: float
    floor: float
    angle_rounding: float | None = None
    digits: float = 0.0
    crossing_tolerance: float = DEFAULT_CROSSING_TOLERANCE
    noun: str = "corner"


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """A place on a gait: from which point, counted from 0, what fraction of the way to the next, and when."""

    point: int
    fraction: float
    alpha: tuple[float, ...]
    t: float | None = None

    def as_mapping(self, noun: str) -> dict[str, Any]:
        """Return the place as plain values: a row, counted from 1, with its time, or a segment, counted from 0."""
        head: dict[str, Any] = {"row": self.point + 1, "t": self.t} if noun == "row" else {"segment": self.point}
        return {**head, "fraction": self.fraction, "alpha": list(self.alpha)}

    def told(self, noun: str) -> str:
        """Return the place in words: a row with its time if it is one of a table, and the tilt angles."""
        alpha = "(" + ", ".join(f"{angle:.3f}" for angle in self.alpha) + ")"
        if noun != "row":
            return alpha
        between = f" and {self.fraction:.2f} of the way to the next" if self.fraction else ""
        return f"row {self.point + 1}{between}{'' if self.t is None else f' (t = {self.t:.6g} s)'}, {alpha}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Stretch:
    """Consecutive points of a gait, joined by straight segments.

    Parameters
    ----------
    alpha
        The points, shape (m + 1, 4) with m ≥ 1 [rad].
    sheet
        The sheet that each point is painted as: +1 red, −1 blue, 2 the first fibre, 3 the second, 0 none, shape
        (m + 1,).
    first
        Number of the first point, counted from 0.
    after
        Number of the last point if it does not follow from `first`: 0 for the segment that closes a gait.
    t
        Times, shape (m + 1,) [s], or None.
    after_t
        Time of the point `after`, which is not when the closing segment ends [s].
    """

    alpha: FloatArray
    sheet: SheetArray
    first: int = 0
    after: int | None = None
    t: FloatArray | None = None
    after_t: float | None = None

    def __getitem__(self, part: slice) -> Stretch:
        """Return some of the points, as a slice that begins somewhere and leaves none out."""
        start, stop, _ = part.indices(len(self.alpha))
        return Stretch(
            alpha=self.alpha[part],
            sheet=self.sheet[part],
            first=self.first + start,
            after=self.after if stop == len(self.alpha) else None,
            t=None if self.t is None else self.t[part],
            after_t=self.after_t,
        )

    @property
    def starts(self) -> FloatArray:
        """Where each segment starts, shape (m, 4) [rad]."""
        return self.alpha[:-1]

    @property
    def ends(self) -> FloatArray:
        """Where each segment ends, shape (m, 4) [rad]."""
        return self.alpha[1:]

    def place(self, segment: int, fraction: float = 0.0) -> Place:
        """Return the place a fraction of the way along a segment, counted from 0 within the stretch."""
        index, fraction = (segment + 1, 0.0) if fraction == 1.0 else (segment, float(fraction))
        at = self.alpha[index]
        t = None if self.t is None else float(self.t[index])
        if self.after is not None and index == len(self.alpha) - 1:
            t = self.after_t
        if fraction:
            at = at + fraction * (self.alpha[index + 1] - at)
            t = None if self.t is None else float(t + fraction * (self.t[index + 1] - t))
        return Place(point=self.number(index) - 1, fraction=fraction, alpha=tuple(float(angle) for angle in at), t=t)

    def number(self, index: int) -> int:
        """Return the number of a point as people count, from 1."""
        if self.after is not None and index == len(self.alpha) - 1:
            return self.after + 1
        return self.first + index + 1


class Worst:
    """The bracket of the least of a quantity over all stretches so far, and where its upper end is attained."""

    def __init__(self) -> None:
        self.lower, self.upper = math.inf, math.inf
        self.place: Place | None = None

    def take(self, least: Least, stretch: Stretch) -> None:
        """Take in what was found along the segments of a stretch."""
        lower, upper, segment, fraction = least.worst()
        self.lower = min(self.lower, lower)
        if upper < self.upper or self.place is None:
            self.upper, self.place = upper, stretch.place(segment, fraction)


class Rule(ABC):
    """What all rules share: :meth:`see` every stretch in order, then ask for :meth:`checks`."""

    def __init__(self, setting: Setting) -> None:
        self.setting = setting

    @abstractmethod
    def see(self, stretch: Stretch) -> None:
        """Take in the next stretch."""

    @abstractmethod
    def checks(self) -> list[Check]:
        """Return what was found; at least one stretch was seen."""

    def at(self, place: Place | None) -> dict[str, Any] | None:
        """Return a place as plain values."""
        return None if place is None else place.as_mapping(self.setting.noun)

    def tell(self, place: Place | None) -> str:
        """Return a place in words."""
        return "" if place is None else place.told(self.setting.noun)
