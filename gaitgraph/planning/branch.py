"""The search for the loops of a request by its branches, one for each color and sign of R, and why a branch has no loop."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from gaitgraph.gait.gait import Gait, lift
from gaitgraph.graph.build import surface_graph
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.invertibility.matrices import level_determinant, noise_of
from gaitgraph.planning.request import Point
from gaitgraph.records import Record
from gaitgraph.surface.red_components import separating_factor
from gaitgraph.surface.sheets import (
    COLORS,
    RAISED,
    RELATION,
    SIGNS,
    Color,
    Sign,
    at_end_of_range,
    root_arrays,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    import networkx as nx

    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.invertibility.matrices import BoolArray
    from gaitgraph.planning.request import PlanRequest, Progress
    from gaitgraph.surface.region import Requirement

_ZERO = 1e-9  # below it R is called zero in a message


@dataclass(frozen=True, slots=True, kw_only=True)
class Refusal(Record):
    """Why one color and sign of R has no loop that meets a request.

    `kind` is "waypoint" if a waypoint has no root of this color and sign, or lies where the request forbids it: `R` is
    its value there, `nearest` the nearest admissible (α1, α2) [rad]. It is "separated" if two waypoints cannot be
    joined; "color" if the color cannot fly; and "limit" if the loop that was found cannot fly, such as for its period. `waypoints` are numbers from 1. `moved` has
    for all waypoints the nearest places where a loop can join them; it is empty if there are none.
    """

    color: Color
    sign: Sign
    kind: Literal["waypoint", "separated", "color", "limit"]
    message: str
    waypoints: tuple[int, ...] = ()
    R: float | None = None
    nearest: Point | None = None
    moved: tuple[Point, ...] = ()


class Search:
    """The search for the loops of a request: what its branches share.

    The order of waypoints is sought until a time of :func:`time.monotonic`. `graph` returns the surface graph of the
    request for a sign of R, made when the first branch needs it.
    """

    def __init__(
        self,
        request: PlanRequest,
        progress: Progress | None = None,
        until: float = math.inf,
    ) -> None:
        self.request = request
        self.until = until
        self.coefficients = coefficients_of(request.vehicle, request.coefficients)
        self.graph = cache(self._graph)
        self._progress = progress

    def progress(self, text: str) -> None:
        """Pass a line of text to the progress function of the caller, if there is one."""
        if self._progress is not None:
            self._progress(text)

    def branches(self, require: Requirement) -> list[Branch]:
        """Return the branches that the request asks for and that may have a loop, R > 0 first."""
        request = self.request
        colors: Sequence[Color] = COLORS
        if request.color != "auto":
            colors = (request.color,)
        elif require == "flyable" or request.vehicle.asymmetry is not None:
            colors = ("red",)
        signs = [sign for sign in reversed(SIGNS) if request.sign in ("auto", sign)]
        return [
            Branch(search=self, color=color, sign=sign, require=require)
            for sign in signs
            for color in colors
        ]

    def _graph(self, sign: Sign) -> nx.Graph[Any]:
        request = self.request
        self.progress(
            f"building the graph of {request.divisions} divisions with {RELATION[sign]}"
        )
        return surface_graph(
            sign,
            divisions=request.divisions,
            vehicle=request.vehicle,
            coefficients=self.coefficients,
            waypoints=request.waypoints,
            zones=request.zones,
            floor=request.floor,
            servo_margins=request.servo_margin > 0 or request.weight is not None,
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class Branch:
    """One color and sign of R, and what its loop must be: "flyable" or "valid". Waypoints are counted from 0."""

    search: Search
    color: Color
    sign: Sign
    require: Requirement

    def __str__(self) -> str:
        if self.is_curved:
            return RELATION[self.sign]
        return f"{self.color}, {RELATION[self.sign]}"

    @property
    def request(self) -> PlanRequest:
        """The request whose loops are sought."""
        return self.search.request

    @property
    def servo_margin(self) -> float:
        """The servo margin that loops keep [rad]; 0 for those that only obey the paper's rules."""
        return self.request.servo_margin if self.require == "flyable" else 0.0

    @property
    def is_curved(self) -> bool:
        """Whether the sheet is not a plane, for a vehicle that is not symmetric."""
        return self.request.vehicle.asymmetry is not None

    def lifted(self, points: Sequence[Point]) -> Gait:
        """Return the gait above points (α1, α2) on the sheet; on a curved one with rows between them."""
        return lift(
            points,
            self.color,
            vehicle=self.request.vehicle,
            coefficients=self.search.coefficients,
        )

    def of_sign(self, R: FloatArray) -> FloatArray:
        """Return values of R, positive where they have the sign of the branch."""
        return R if self.sign == "positive" else -R

    def rootless(self) -> Refusal | None:
        """Return why the first waypoint without a root, or where polygons forbid it, cannot be passed; else None."""
        waypoints, zones = self.request.waypoints, self.request.zones
        is_exact = self.search.coefficients.kind == "exact"
        if self.color == "blue" and (self.require == "flyable" or is_exact):
            return self._singular()
        roots, of_color = self._roots()
        R = self.of_sign(roots)
        is_rooted = (of_color & (noise_of(self.search.coefficients) < R)).any(axis=1)
        is_allowed = np.ones(len(waypoints), dtype=bool)
        if zones is not None:
            is_allowed = zones.allow_points(np.array(waypoints))
        without = np.flatnonzero(~(is_rooted & is_allowed)).tolist()
        if not without:
            return None
        k = without[0]
        root = np.where(of_color[k], R[k], -math.inf).argmax()
        value = float(roots[k, root])
        why = f" has R = {value:.4g}"
        if abs(value) < _ZERO:
            why = " has R = 0, where the matrix is singular"
        if R[k, root] > 0 and zones is not None:
            why = " lies in keep_out or outside keep_in"
        return self.refused_at(k, why, value)

    def _roots(self) -> tuple[FloatArray, BoolArray]:
        """Return R of the roots above each waypoint, and whether they are of the color."""
        plane = np.array(self.request.waypoints)
        coefficients = self.search.coefficients
        has_one = self.color == "red" and not self.is_curved
        if has_one and not at_end_of_range(plane).any():
            R = level_determinant(plane[:, [0, 1, 0, 1]], coefficients)[:, None]
            return R, np.ones(R.shape, dtype=bool)
        roots = root_arrays(plane[:, 0], plane[:, 1], coefficients=coefficients)
        return roots.R, roots.sheet == (1 if self.color == "red" else -1)

    def _singular(self) -> Refusal:
        """Return that the matrix is singular on the whole blue sheet, in exact physics or with exact coefficients."""
        vehicle = self.request.vehicle
        if vehicle.has_raised_rotors:
            words = f"no gait surface {RAISED} {vehicle.heights_in_words}"
            return self._refused("color", f"blue: {words}")
        words = "with exact coefficients R = 0 on the whole blue sheet, so the matrix is singular there; use red"
        return self._refused("color", f"blue: {words}", R=0.0)

    def _refused(self, kind: Any, message: str, **details: Any) -> Refusal:
        return Refusal(
            color=self.color, sign=self.sign, kind=kind, message=message, **details
        )

    def refused_at(self, k: int, why: str, R: float) -> Refusal:
        """Return the refusal of a waypoint, with a reason that follows its place."""
        first, second = self.request.waypoints[k]
        message = f"{self}: waypoint {k + 1} ({first:.4f}, {second:.4f}){why}"
        return self._refused("waypoint", message, waypoints=(k + 1,), R=R)

    def separation(self, ends: Sequence[int], wall: str) -> Refusal:
        """Return that two waypoints are separated: by a factor of R, else by what `wall` names."""
        first, second = (self.request.waypoints[k] for k in ends)
        if self.color == "red" and not self.is_curved:
            factor = separating_factor(first, second, self.request.vehicle)
            if factor:
                wall = f"{factor}, where R = 0: move them to one side"
        numbers = (ends[0] + 1, ends[1] + 1)
        message = (
            f"{self}: waypoints {numbers[0]} and {numbers[1]} are separated by {wall}"
        )
        return self._refused("separated", message, waypoints=numbers)
