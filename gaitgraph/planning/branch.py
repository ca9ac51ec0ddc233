"""The branches of a request, one for each color and sign of R, and why a branch has no loop."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Literal

import numpy as np

from gaitgraph.gait.gait import Gait, lift
from gaitgraph.invertibility.coefficients import Coefficients, coefficients_of
from gaitgraph.invertibility.matrices import level_determinant, noise_of
from gaitgraph.planning.request import Point
from gaitgraph.records import Record
from gaitgraph.surface.sheets import (
    COLORS,
    RAISED,
    RELATION,
    SIGNS,
    Color,
    Sign,
    at_end_of_range,
    root_arrays,
    separating_factor,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from gaitgraph.planning.request import PlanRequest
    from gaitgraph.surface.region import Requirement

_ZERO = 1e-9  # below it R is called zero in a message


@dataclass(frozen=True, slots=True, kw_only=True)
class Refusal(Record):
    """Why one color and sign of R has no loop that meets a request.

    `kind` is "waypoint" if a waypoint has no root of this color and sign, or lies where the request forbids it: `R` is
    its value there, `nearest` the nearest admissible (α1, α2) [rad]. It is "separated" if two waypoints cannot be
    joined: on the grid `components` has how many nodes can be reached from each; "color" if the color cannot fly; and
    "limit" if the loop that was found cannot fly, such as for its period. `waypoints` are numbers from 1. `moved` has
    for all waypoints the nearest places where a loop can join them; it is empty if there are none.
    """

    color: Color
    sign: Sign
    kind: Literal["waypoint", "separated", "color", "limit"]
    message: str
    waypoints: tuple[int, ...] = ()
    R: float | None = None
    components: tuple[int, ...] = ()
    nearest: Point | None = None
    moved: tuple[Point, ...] = ()


def branches_of(request: PlanRequest, require: Requirement) -> list[Branch]:
    """Return the branches that a request asks for and that may have a loop, R > 0 first."""
    colors: Sequence[Color] = COLORS
    if request.color != "auto":
        colors = (request.color,)
    elif require == "flyable" or request.vehicle.asymmetry is not None:
        colors = ("red",)
    signs = [sign for sign in reversed(SIGNS) if request.sign in ("auto", sign)]
    return [
        Branch(request=request, color=color, sign=sign, require=require)
        for sign in signs
        for color in colors
    ]


@dataclass(frozen=True, kw_only=True)
class Branch:
    """One color and sign of R, and what its loop must be: "flyable" or "valid". Waypoints are counted from 0."""

    request: PlanRequest
    color: Color
    sign: Sign
    require: Requirement

    def __str__(self) -> str:
        if self.is_curved:
            return RELATION[self.sign]
        return f"{self.color}, {RELATION[self.sign]}"

    @cached_property
    def coefficients(self) -> Coefficients:
        """The coefficients of formula (1) that the request asks for."""
        return coefficients_of(self.request.vehicle, self.request.coefficients)

    @property
    def wanted(self) -> float:
        """The sign of R as +1 or −1."""
        return 1.0 if self.sign == "positive" else -1.0

    @property
    def servo_margin(self) -> float:
        """The servo margin that loops keep [rad]; 0 for those that only obey the paper's rules."""
        return self.request.servo_margin if self.require == "flyable" else 0.0

    @property
    def is_curved(self) -> bool:
        """Whether the sheet is not a plane, for a vehicle that is not symmetric."""
        return self.coefficients.rotors.asymmetry is not None

    def lifted(self, points: Sequence[Point]) -> Gait:
        """Return the gait above points (α1, α2) on the sheet of this color; on a curved one with rows between them."""
        return lift(
            points,
            self.color,
            vehicle=self.request.vehicle,
            coefficients=self.coefficients,
        )

    @property
    def _is_singular(self) -> bool:
        """Whether R is zero on the whole sheet, in exact physics or with exact coefficients."""
        if self.color == "red":
            return False
        return self.require == "flyable" or self.coefficients.kind == "exact"

    @cached_property
    def _roots(self) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.bool_]]:
        """R of the roots above each waypoint, and whether they are of this color."""
        return _roots_above(self.request.waypoints, self.color, self.coefficients)

    def rootless(self) -> list[int]:
        """Return the waypoints that have no root of this color and sign, or lie where polygons forbid it."""
        waypoints, zones = self.request.waypoints, self.request.zones
        if self._is_singular:
            return list(range(len(waypoints)))
        R, of_color = self._roots
        of_sign = self.wanted * R > noise_of(self.coefficients)
        rooted = (of_color & of_sign).any(axis=1)
        if zones is not None:
            rooted &= zones.allow_points(np.array(waypoints))
        return np.flatnonzero(~rooted).tolist()

    def rootless_at(self, k: int) -> Refusal:
        """Return why a waypoint, one of :meth:`rootless`, cannot be passed."""
        if self._is_singular:
            return self._singular()
        values, of_color = (part[k] for part in self._roots)
        R = float(max(values[of_color], key=lambda value: self.wanted * value))
        why = f" has R = {R:.4g}"
        if abs(R) < _ZERO:
            why = " has R = 0, where the matrix is singular"
        if self.wanted * R > 0 and self.request.zones is not None:
            why = " lies in keep_out or outside keep_in"
        return self.refused_at(k, why, R)

    def _singular(self) -> Refusal:
        message = "with exact coefficients R = 0 on the whole blue sheet, so the matrix is singular there; use red"
        R: float | None = 0.0
        vehicle = self.request.vehicle
        if vehicle.has_raised_rotors:
            message = f"no gait surface {RAISED} {vehicle.heights_in_words}"
            R = None
        return Refusal(
            color=self.color,
            sign=self.sign,
            kind="color",
            message=f"blue: {message}",
            R=R,
        )

    def refused_at(self, k: int, why: str, R: float) -> Refusal:
        """Return the refusal of a waypoint, with a reason that follows its place."""
        first, second = self.request.waypoints[k]
        return Refusal(
            color=self.color,
            sign=self.sign,
            kind="waypoint",
            message=f"{self}: waypoint {k + 1} ({first:.4f}, {second:.4f}){why}",
            waypoints=(k + 1,),
            R=R,
        )

    def separation(
        self, ends: Sequence[int], wall: str, components: tuple[int, ...] = ()
    ) -> Refusal:
        """Return that two waypoints are separated: by a factor of R, else by what `wall` names."""
        waypoints = self.request.waypoints
        first, second = (waypoints[k] for k in ends)
        if self.color == "red" and not self.is_curved:
            factor = separating_factor(first, second, self.request.vehicle)
            if factor:
                wall = f"{factor}, where R = 0: move them to one side"
        numbers = ends[0] + 1, ends[1] + 1
        return Refusal(
            color=self.color,
            sign=self.sign,
            kind="separated",
            message=f"{self}: waypoints {numbers[0]} and {numbers[1]} are separated by {wall}",
            waypoints=numbers,
            components=components,
        )


@lru_cache(maxsize=2)
def _roots_above(
    waypoints: tuple[Point, ...], color: Color, coefficients: Coefficients
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.bool_]]:
    """Return R of the roots above waypoints, and whether they are of a color; both signs of R ask for them."""
    plane = np.array(waypoints)
    is_plane = coefficients.rotors.asymmetry is None
    if color == "red" and is_plane and not at_end_of_range(plane).any():  # the only one
        R = level_determinant(plane[:, [0, 1, 0, 1]], coefficients)[:, None]
        return R, np.ones(R.shape, dtype=bool)
    roots = root_arrays(plane[:, 0], plane[:, 1], coefficients=coefficients)
    return roots.R, roots.sheet == (1 if color == "red" else -1)
