"""Why a plan was refused: the obstacle for each color and sign of R, as the certificate of a refusal."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from gaitgraph.invertibility.coefficients import Coefficients, coefficients_of
from gaitgraph.invertibility.matrices import level_determinant, noise_of
from gaitgraph.surface.sheets import (
    COLORS,
    RAISED,
    RELATION,
    SIGNS,
    at_end_of_range,
    root_arrays,
    separating_factor,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from gaitgraph.gait.gait import Gait
    from gaitgraph.planning.request import PlanRequest, Point, Requirement
    from gaitgraph.surface.sheets import Color, Sign
    from gaitgraph.validation.report import Report


class FoundPath(NamedTuple):
    """A loop through every node, the order of the waypoints (counted from 0), and a lower bound of its length [rad].

    `judged` has the same loop with straight runs merged and its checks without those of rates, if they are known.
    """

    path: Gait
    order: tuple[int, ...]
    lower_bound: float | None
    judged: tuple[Gait, Report] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Obstacle:
    """Why one color and sign of R has no loop that meets a request: the certificate of a refusal.

    `kind` is "waypoint" if a waypoint has no root of this color and sign, or lies where the request forbids it: `R` is
    its value there, `nearest` the nearest admissible (α1, α2) [rad]. It is "separated" if two waypoints cannot be
    joined: on the grid `components` has how many nodes can be reached from each; "color" if the color cannot fly; and
    "limit" if the loop that was found cannot fly, such as for its period. `waypoints` are numbers from 1. `moved` has
    for all waypoints the nearest places where a loop can join them; it is empty if there are none.
    """

    color: str
    sign: str
    kind: Literal["waypoint", "separated", "color", "limit"]
    message: str
    waypoints: tuple[int, ...] = ()
    R: float | None = None
    components: tuple[int, ...] = ()
    nearest: Point | None = None
    moved: tuple[Point, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Branch:
    """One color and sign of R for which a request is answered; waypoints are counted from 0."""

    request: PlanRequest
    color: Color
    sign: Sign
    uses: tuple[Requirement, ...] = ()
    """What loops are searched for, in order."""

    def __str__(self) -> str:
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
    def _is_singular(self) -> bool:
        return self.color == "blue" and (
            self.coefficients.kind == "exact" or self.request.require == "flyable"
        )

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
        rooted = (of_color & (self.wanted * R > noise_of(self.coefficients))).any(
            axis=1
        )
        if zones is not None:
            rooted &= zones.allow_points(np.array(waypoints))
        return np.flatnonzero(~rooted).tolist()

    def obstacle_at(
        self, k: int, why: str | None = None, R: float | None = None
    ) -> Obstacle:
        """Return the obstacle at a waypoint, one of :meth:`rootless` if neither a reason nor R is given."""
        if self._is_singular:
            message = "with exact coefficients R = 0 on the whole blue sheet, so the matrix is singular there; use red"
            is_raised = self.request.vehicle.has_raised_rotors
            if is_raised:
                message = (
                    f"no gait surface {RAISED} {self.request.vehicle.heights_in_words}"
                )
            return Obstacle(
                color=self.color,
                sign=self.sign,
                kind="color",
                message=f"blue: {message}",
                R=None if is_raised else 0.0,
            )
        if why is None:
            values, of_color = (part[k] for part in self._roots)
            R = float(max(values[of_color], key=lambda value: self.wanted * value))
            if self.wanted * R > 0 and self.request.zones is not None:
                why = " lies in keep_out or outside keep_in"
            else:
                why = (
                    " has R = 0, where the matrix is singular"
                    if abs(R) < 1e-9
                    else f" has R = {R:.4g}"
                )
        first, second = self.request.waypoints[k]
        message = f"{self}: waypoint {k + 1} ({first:.4f}, {second:.4f}){why}"
        return Obstacle(
            color=self.color,
            sign=self.sign,
            kind="waypoint",
            message=message,
            waypoints=(k + 1,),
            R=R,
        )

    def separation(
        self, ends: Sequence[int], otherwise: str, components: tuple[int, ...] = ()
    ) -> Obstacle:
        """Return the obstacle that separates two waypoints: a factor of R, or what `otherwise` names."""
        first, second = (self.request.waypoints[k] for k in ends)
        factor = (
            separating_factor(first, second, self.request.vehicle)
            if self.color == "red"
            else None
        )
        if factor:
            otherwise = f"{factor}, where R = 0: move them to one side"
        numbers = ends[0] + 1, ends[1] + 1
        return Obstacle(
            color=self.color,
            sign=self.sign,
            kind="separated",
            message=f"{self}: waypoints {numbers[0]} and {numbers[1]} are separated by {otherwise}",
            waypoints=numbers,
            components=components,
        )


@lru_cache(maxsize=2)
def _roots_above(
    waypoints: tuple[Point, ...], color: Color, coefficients: Coefficients
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.bool_]]:
    """Return R of the roots above waypoints, and whether they are of a color; both signs of R ask for them."""
    plane = np.array(waypoints)
    if color == "red" and not at_end_of_range(plane).any():  # the only one
        R = level_determinant(plane[:, [0, 1, 0, 1]], coefficients)[:, None]
        return R, np.ones(R.shape, dtype=bool)
    found = root_arrays(plane[:, 0], plane[:, 1], coefficients=coefficients)
    return found.R, found.sheet == (1 if color == "red" else -1)


def branches_of(
    request: PlanRequest, uses: tuple[Requirement, ...] = ("flyable",)
) -> list[Branch]:
    """Return the branches of color and sign of R that a request asks for and that can meet it, R > 0 first."""
    colors = (
        COLORS[:1]
        if (request.color, request.require) == ("auto", "flyable")
        else COLORS
    )
    return [
        # Only red can be flyable.
        Branch(
            request=request,
            color=color,
            sign=sign,
            uses=uses if color == "red" else uses[-1:],
        )
        for sign in reversed(SIGNS)
        if request.sign in ("auto", sign)
        for color in colors
        if request.color in ("auto", color)
    ]
