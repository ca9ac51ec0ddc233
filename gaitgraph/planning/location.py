"""Where waypoints lie: in which part of the admissible region of each sign of R, and whether a loop can join them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from textwrap import fill
from typing import TYPE_CHECKING, Any

from gaitgraph._lazy import cached_property
from gaitgraph.pictured import Pictured
from gaitgraph.planning.any_angle import prepared_region
from gaitgraph.planning.branch import Branch, Refusal, Search
from gaitgraph.planning.request import PlanRequest, plan_request
from gaitgraph.surface.admissible import why_empty
from gaitgraph.surface.sheets import RELATION, Color, Sign

if TYPE_CHECKING:
    from gaitgraph.planning.request import Point
    from gaitgraph.surface.region import Points, Region

_WIDTH = 110
_MOST_NEAREST = 8  # in the words of a refusal


def location_of(waypoints: Points, **fields: Any) -> Location:
    """Return in which part of the admissible regions each waypoint lies, and whether a loop can join them all.

    Parameters
    ----------
    waypoints
        (α1, α2) pairs in [−π/2, π/2], numbers [rad] or texts such as "3pi/8".
    fields
        Others of :class:`gaitgraph.planning.request.PlanRequest`, as for :func:`gaitgraph.planning.planner.plan_loop`,
        of which `require`, `color`, `sign`, `vehicle`, `coefficients`, `floor`, `keep_out`, `keep_in`, `accuracy` and
        `servo_margin` count. The color "auto" is red; the sign "auto" is both.

    Raises
    ------
    InputError
        If a value is not allowed.

    Examples
    --------
    >>> location = location_of([(-0.4, 0.4), (0.5, 0.5)], sign="positive")
    >>> location.regions[0].parts, bool(location)
    ((1, None), False)
    >>> [round(angle, 4) for angle in location.regions[0].nearest[1]]
    [0.1671, 0.5]
    """
    return located(plan_request(waypoints, **fields))


def located(request: PlanRequest) -> Location:
    """Return what :func:`location_of` does, for the waypoints of a request.

    Without waypoints the answer has the parts of the regions alone.
    """
    if request.color == "auto":
        request = replace(request, color="red")
    location = Location(request=request)
    _ = location.regions  # what the request lacks is said here
    return location


@dataclass(frozen=True, kw_only=True, eq=False)
class Location(Pictured):
    """Where the waypoints of a request lie; truthy if, for a color and sign of R, there is a part of the region that holds them all.

    The `regions`, one for each sign of R of the request, allow what it requires, "flyable" or "valid", and lie inside
    their curved borders by at most its `accuracy` [rad].
    """

    request: PlanRequest

    @cached_property
    def regions(self) -> tuple[RegionLocation, ...]:
        """Where the waypoints lie in the region of each branch of the request."""
        branches = Search(self.request).branches(self.request.require)
        return tuple(map(_located_in, branches))

    def __bool__(self) -> bool:
        return any(location.joined for location in self.regions)

    def as_mapping(self) -> dict[str, Any]:
        """Return plain values, ready for JSON."""
        return {
            "use": self.request.require,
            "accuracy": self.request.accuracy,
            "joined": bool(self),
            "regions": [location.as_mapping() for location in self.regions],
        }

    def __repr__(self) -> str:
        joined = sum(location.joined for location in self.regions)
        return f"<Location: {len(self.regions)} {self.request.require} regions, {joined} with all waypoints in one part>"

    def __str__(self) -> str:
        return "\n".join(map(str, self.regions))


@dataclass(frozen=True, kw_only=True)
class RegionLocation:
    """The region of one color and sign of R, and where the waypoints of a request lie in it.

    `why_empty` says why the region is empty, "" if it is not. For each waypoint `parts` has the number of its part of the
    region, from 1, or None if it is in none, and `reasons` why it is in none. `moved` has the nearest places where a loop
    can join them all; it is empty if the region is. `joined` is whether one part, or parts that touch, hold all waypoints.
    """

    color: Color
    sign: Sign
    region: Region
    why_empty: str
    waypoints: tuple[Point, ...]
    parts: tuple[int | None, ...]
    reasons: tuple[str | None, ...]
    moved: tuple[Point, ...]
    joined: bool

    @property
    def nearest(self) -> tuple[Point | None, ...]:
        """For each waypoint its place of `moved`; None if it is there, or if the region is empty."""
        if not self.moved:
            return (None,) * len(self.waypoints)
        pairs = zip(self.waypoints, self.moved, strict=True)
        return tuple(None if place == point else place for point, place in pairs)

    def as_mapping(self) -> dict[str, Any]:
        """Return plain values, ready for JSON."""
        parts = []
        for part in self.region.components:
            inside = list(part.representative_point().coords[0])
            parts.append({"area": part.area, "inside": inside})
        names = ("waypoint", "part", "reason", "nearest")
        columns = (self.waypoints, self.parts, self.reasons, self.nearest)
        return {
            "color": self.color,
            "sign": self.sign,
            "area": self.region.area,
            "parts": parts,
            "waypoints": [
                dict(zip(names, values, strict=True))
                for values in zip(*columns, strict=True)
            ],
            "joined": self.joined,
        }

    def __str__(self) -> str:
        components = self.region.components
        size = f"empty: {self.why_empty}"
        if components:
            areas = ", ".join(f"{part.area:.4g}" for part in components)
            plural = "s" if len(components) > 1 else ""
            size = f"{len(components)} part{plural} of {areas} rad²"
        lines = [f"{self.color}, {RELATION[self.sign]}: {size}"]
        if not self.waypoints:
            for number, part in enumerate(components, start=1):
                a1, a2 = part.representative_point().coords[0]
                lines.append(
                    f"  part {number}: {part.area:.4g} rad², around ({a1:.4f}, {a2:.4f})"
                )
        numbers = range(len(self.waypoints))
        lines += [as_item(self._waypoint_in_words(k)) for k in numbers]
        if len(self.waypoints) > 1:
            verdict = (
                "a loop can join them all" if self.joined else "no loop can join them"
            )
            lines.append(f"  {verdict}")
        return "\n".join(lines)

    def _waypoint_in_words(self, k: int) -> str:
        text = f"in part {self.parts[k]}"
        joining = "point in one part with the others"
        if self.parts[k] is None:
            text = f"{self.reasons[k]}"
            joining = "admissible point"
        nearest = self.nearest[k]
        if nearest is not None:
            text += f"; the nearest {joining} is {self.region.as_text(nearest)}"
        alpha1, alpha2 = self.waypoints[k]
        return f"waypoint {k + 1} ({alpha1:.4f}, {alpha2:.4f}): {text}"


def _located_in(branch: Branch) -> RegionLocation:
    """Return where the waypoints of a request lie in the region of a branch."""
    request = branch.request
    waypoints = request.waypoints
    region = prepared_region(branch).region
    is_empty = not region.components
    reason = ""
    if is_empty:
        reason = why_empty(
            region, request.floor, request.vehicle, branch.servo_margin, branch.sign
        )
    indices = [region.component_of(point) for point in waypoints]
    return RegionLocation(
        color=branch.color,
        sign=branch.sign,
        region=region,
        why_empty=reason,
        waypoints=waypoints,
        parts=tuple(None if index is None else index + 1 for index in indices),
        reasons=tuple(map(region.why_not, waypoints)),
        moved=region.nearest_joined(waypoints) if waypoints else (),
        joined=not is_empty and region.joined(*waypoints),
    )


def as_item(text: object) -> str:
    """Return a text as an item of a list, with lines that are not too long."""
    return fill(str(text), _WIDTH, initial_indent="  ", subsequent_indent="    ")


def with_nearest(refusal: Refusal, request: PlanRequest) -> Refusal:
    """Return a refusal with the nearest points that a loop can join; at a waypoint also in words, or why none."""
    if not refusal.waypoints:
        return refusal
    branch = Branch(
        search=Search(request),
        color=refusal.color,
        sign=refusal.sign,
        require=request.require,
    )
    location = _located_in(branch)
    moved = location.moved
    if refusal.kind != "waypoint":
        return replace(refusal, moved=moved)
    if not moved:
        message = f"{refusal.message}; {location.why_empty}"
        return replace(refusal, message=message)
    nearest = moved[refusal.waypoints[0] - 1]
    where = f"point is {location.region.as_text(nearest)}"
    elsewhere = [k for k, place in enumerate(location.nearest) if place is not None]
    if len(elsewhere) > 1:
        listed = [
            f"{location.region.as_text(moved[k])} for waypoint {k + 1}"
            for k in elsewhere[:_MOST_NEAREST]
        ]
        if len(elsewhere) > _MOST_NEAREST:
            listed.append(f"and {len(elsewhere) - _MOST_NEAREST} more")
        where = f"points are {', '.join(listed)}"
    message = f"{refusal.message}; the nearest admissible {where}"
    return replace(refusal, message=message, nearest=nearest, moved=moved)
