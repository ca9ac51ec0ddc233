"""A gait as straight segments: what it is judged by, runs of segments, places on them, and what every rule shares.

A gait is a chain of points joined by straight segments. It may be too long for memory, so it is judged run by run.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from gaitgraph.surface.sheets import DEFAULT_CROSSING_TOLERANCE, family_codes
from gaitgraph.validation.report import Check

if TYPE_CHECKING:
    from gaitgraph.gait.gait import Gait
    from gaitgraph.invertibility.branch_and_bound import Least
    from gaitgraph.invertibility.matrices import Coefficients
    from gaitgraph.vehicle import Vehicle

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """What a gait is for, and the limits it is judged by.

    Parameters
    ----------
    vehicle, coefficients, crossing_tolerance
        What the gait is for.
    tolerance, floor
        Limits of the checks; see :func:`gaitgraph.validation.checks.check_gait`.
    angle_rounding
        Assumed error of each angle [rad]; None: inferred from the distance to the sheets, and at least `digits`.
    digits
        Error of each angle that follows from the printed digits [rad].
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
    """A place on a gait: a point, counted from 0, the fraction of the segment to the next one, angles and time."""

    point: int
    fraction: float
    alpha: tuple[float, ...]
    t: float | None = None

    def as_mapping(self, noun: str) -> dict[str, Any]:
        """Return the place as plain values: a row, counted from 1, with its time, or a segment, counted from 0."""
        head: dict[str, Any] = {"row": self.point + 1, "t": self.t} if noun == "row" else {"segment": self.point}
        return {**head, "fraction": self.fraction, "alpha": list(self.alpha)}

    def described(self, noun: str) -> str:
        """Return the place in words: the tilt angles, and the row with its time for a table."""
        alpha = "(" + ", ".join(f"{angle:.3f}" for angle in self.alpha) + ")"
        if noun != "row":
            return alpha
        between = f" and {self.fraction:.2f} of the way to the next" if self.fraction else ""
        return f"row {self.point + 1}{between}{'' if self.t is None else f' (t = {self.t:.6g} s)'}, {alpha}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Segments:
    """A run of consecutive straight segments of a gait.

    Parameters
    ----------
    alpha
        The points, shape (m + 1, 4) [rad]; a single point has no segment.
    sheet
        The sheet or fibre that each point is colored as: +1 red, −1 blue, 2 the first fibre, 3 the second, 0 none,
        shape (m + 1,).
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
    sheet: npt.NDArray[np.int8]
    first: int = 0
    after: int | None = None
    t: FloatArray | None = None
    after_t: float | None = None

    def __getitem__(self, part: slice) -> Segments:
        """Return consecutive points, as a slice of step 1."""
        start, stop, _ = part.indices(len(self.alpha))
        return Segments(
            alpha=self.alpha[part],
            sheet=self.sheet[part],
            first=self.first + start,
            after=self.after if stop == len(self.alpha) else None,
            t=None if self.t is None else self.t[part],
            after_t=self.after_t,
        )

    def joined(self, following: Segments) -> Segments:
        """Return these points followed by others."""
        return Segments(
            alpha=np.concatenate([self.alpha, following.alpha]),
            sheet=np.concatenate([self.sheet, following.sheet]),
            first=self.first,
            t=None if self.t is None or following.t is None else np.concatenate([self.t, following.t]),
        )

    @property
    def starts(self) -> FloatArray:
        """The start of each segment, shape (m, 4) [rad]."""
        return self.alpha[:-1]

    @property
    def ends(self) -> FloatArray:
        """The end of each segment, shape (m, 4) [rad]."""
        return self.alpha[1:]

    def place(self, segment: int, fraction: float = 0.0) -> Place:
        """Return the place at a fraction of a segment, counted from 0 within the run."""
        index, fraction = (segment + 1, 0.0) if fraction == 1.0 else (segment, float(fraction))
        at = self.alpha[index]
        t = None if self.t is None else float(self.t[index])
        if self.after is not None and index == len(self.alpha) - 1:
            t = self.after_t
        if fraction:
            at = at + fraction * (self.alpha[index + 1] - at)
            t = None if self.t is None else float(t + fraction * (self.t[index + 1] - t))
        return Place(point=self.number(index) - 1, fraction=fraction, alpha=tuple(at.tolist()), t=t)

    def number(self, index: int) -> int:
        """Return the number of a point, counted from 1."""
        if self.after is not None and index == len(self.alpha) - 1:
            return self.after + 1
        return self.first + index + 1


def segments_of(gait: Gait) -> Segments:
    """Return all segments of a gait, from the last corner back to the first too."""
    sheet = family_codes(gait.colors) if gait.colors else np.zeros(len(gait.alpha), dtype=np.int8)
    return Segments(alpha=np.vstack([gait.alpha, gait.alpha[:1]]), sheet=np.append(sheet, sheet[0]), after=0)


class Worst:
    """The bracket of the least of a quantity over all segments so far, and where its upper end is attained."""

    def __init__(self) -> None:
        self.lower, self.upper = math.inf, math.inf
        self.place: Place | None = None

    def update(self, least: Least, run: Segments) -> None:
        """Include what was found along the segments of a run."""
        lower, upper, segment, fraction = least.worst()
        self.lower = min(self.lower, lower)
        if upper < self.upper or self.place is None:
            self.upper, self.place = upper, run.place(segment, fraction)


class Rule(ABC):
    """What all rules share: they are updated with runs of segments in order, and return their checks at the end.

    How the segments are split into runs makes no difference to a verdict.
    """

    def __init__(self, setting: Setting) -> None:
        self.setting = setting

    @abstractmethod
    def update(self, run: Segments) -> None:
        """Examine the next run of segments."""

    @abstractmethod
    def checks(self) -> list[Check]:
        """Return what was found, after at least one update."""

    def described(self, place: Place | None) -> str:
        """Return a place in words."""
        return "" if place is None else place.described(self.setting.noun)

    def check(
        self,
        name: str,
        kind: Literal["valid", "flyable"],
        ok: bool,
        message: str,
        *,
        value: float | None = None,
        limit: float | None = None,
        place: Place | None = None,
    ) -> Check:
        """Return a check with its place as plain values."""
        where = None if place is None else place.as_mapping(self.setting.noun)
        return Check(name=name, kind=kind, ok=ok, message=message, value=value, limit=limit, where=where)
