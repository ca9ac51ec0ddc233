"""The search for the loops of a request by its branches, one for each color and sign of R, and why a branch has no loop."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from gaitgraph.errors import InputError
from gaitgraph.gait.gait import Gait, lift
from gaitgraph.graph.build import surface_graph
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.invertibility.matrices import level_determinant, noise_of
from gaitgraph.planning.loop import Loop
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
    from collections.abc import Callable, Sequence

    import networkx as nx

    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.invertibility.matrices import BoolArray
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


class Search:
    """The search for the loops of a request: what several branches need is made when the first of them needs it.

    The order of waypoints is sought until a time of :func:`time.monotonic`.
    """

    def __init__(
        self,
        request: PlanRequest,
        progress: Callable[[str], None] | None = None,
        until: float | None = None,
    ) -> None:
        self.request = request
        self.until = until
        self.coefficients = coefficients_of(request.vehicle, request.coefficients)
        self.graph = cache(self._graph)
        self.straight_loop = cache(self._straight_loop)
        self.roots = cache(self._roots)
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

    def lifted(self, points: Sequence[Point], color: Color) -> Gait:
        """Return the gait above points (α1, α2) on the sheet of a color; on a curved one with rows between them."""
        return lift(
            points,
            color,
            vehicle=self.request.vehicle,
            coefficients=self.coefficients,
        )

    def _graph(self, sign: Sign) -> nx.Graph[Any]:
        """Return the surface graph of the request for one sign of R, its waypoints among the nodes."""
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

    def _straight_loop(self, color: Color, sign: Sign) -> Loop | None:
        """Return the loop straight from waypoint to waypoint, None if polygons forbid it, or the sheet has a gap there."""
        points, zones = self.request.waypoints, self.request.zones
        ends = [*points[1:], points[0]]
        if zones is not None and not zones.allow_segments(points, ends).all():
            return None
        try:
            path = self.lifted(points, color)
        except InputError:
            return None  # it leads through a fibre of a curved sheet
        return Loop(
            path=path,
            sign=sign,
            order=tuple(range(len(points))),
            request=self.request,
            lower_bound=sum(map(math.dist, points, ends)),
        )

    def _roots(self, color: Color) -> tuple[FloatArray, BoolArray]:
        """Return R of the roots above each waypoint, and whether they are of a color."""
        plane = np.array(self.request.waypoints)
        is_plane = self.coefficients.rotors.asymmetry is None
        if color == "red" and is_plane and not at_end_of_range(plane).any():
            # There is one.
            R = level_determinant(plane[:, [0, 1, 0, 1]], self.coefficients)[:, None]
            return R, np.ones(R.shape, dtype=bool)
        roots = root_arrays(plane[:, 0], plane[:, 1], coefficients=self.coefficients)
        return roots.R, roots.sheet == (1 if color == "red" else -1)


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
        return self.search.coefficients.rotors.asymmetry is not None

    @property
    def _is_singular(self) -> bool:
        """Whether R is zero on the whole sheet, in exact physics or with exact coefficients."""
        if self.color == "red":
            return False
        return self.require == "flyable" or self.search.coefficients.kind == "exact"

    def rootless(self) -> list[int]:
        """Return the waypoints that have no root of this color and sign, or lie where polygons forbid it."""
        waypoints, zones = self.request.waypoints, self.request.zones
        if self._is_singular:
            return list(range(len(waypoints)))
        R, of_color = self.search.roots(self.color)
        of_sign = self.wanted * R > noise_of(self.search.coefficients)
        rooted = (of_color & of_sign).any(axis=1)
        if zones is not None:
            rooted &= zones.allow_points(np.array(waypoints))
        return np.flatnonzero(~rooted).tolist()

    def rootless_at(self, k: int) -> Refusal:
        """Return why a waypoint, one of :meth:`rootless`, cannot be passed."""
        if self._is_singular:
            return self._singular()
        values, of_color = self.search.roots(self.color)
        here = values[k, of_color[k]]
        R = float(here[np.argmax(self.wanted * here)])
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
