"""Where waypoints lie: in which part of which region, and whether a loop can join them."""

from __future__ import annotations

from dataclasses import dataclass
from textwrap import fill
from typing import TYPE_CHECKING, Any, Literal

from gaitgraph.errors import InputError, shown
from gaitgraph.planning.any_angle import region_of
from gaitgraph.surface.sheets import RELATION, Sign

if TYPE_CHECKING:
    from gaitgraph.planning.request import PlanRequest, Point
    from gaitgraph.surface.region import Region
    from gaitgraph.surface.sheets import Color

_WIDTH = 110


@dataclass(frozen=True, slots=True, kw_only=True)
class WaypointLocation:
    """One waypoint: the number of its part, from 1; or why it is in none, and the nearest point that is in one."""

    point: Point
    part: int | None
    why_not: str | None = None
    nearest: Point | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class RegionLocation:
    """The region of one color and sign of R, and where the waypoints lie in it."""

    color: Color
    sign: Sign
    region: Region
    waypoints: tuple[WaypointLocation, ...]

    @property
    def joined(self) -> bool:
        """Whether one part of the region, or parts that touch, hold all waypoints."""
        first, *others = (waypoint.point for waypoint in self.waypoints)
        return self.waypoints[0].part is not None and all(self.region.joined(first, other) for other in others)


@dataclass(frozen=True, slots=True, kw_only=True)
class Location:
    """Where waypoints lie; truthy when, for a color and sign of R, one part of the region holds them all.

    Parameters
    ----------
    use
        "flyable" or "valid": what the region allows.
    accuracy
        How far inside its curved borders the region may be [rad].
    regions
        One for each color and sign of R that was asked for.
    """

    use: str
    accuracy: float
    regions: tuple[RegionLocation, ...]

    def __bool__(self) -> bool:
        return any(one.joined for one in self.regions)

    def as_mapping(self) -> dict[str, Any]:
        """Return plain values, ready for JSON."""
        return {
            "use": self.use,
            "accuracy": self.accuracy,
            "joined": bool(self),
            "regions": [
                {
                    "color": one.color,
                    "sign": one.sign,
                    "area": one.region.area,
                    "parts": [
                        {"area": part.area, "inside": list(part.representative_point().coords[0])}
                        for part in one.region.components
                    ],
                    "waypoints": [
                        {
                            "waypoint": list(waypoint.point),
                            "part": waypoint.part,
                            "reason": waypoint.why_not,
                            "nearest": None if waypoint.nearest is None else list(waypoint.nearest),
                        }
                        for waypoint in one.waypoints
                    ],
                    "joined": one.joined,
                }
                for one in self.regions
            ],
        }

    def __str__(self) -> str:
        lines = []
        for one in self.regions:
            areas = [f"{part.area:.4g}" for part in one.region.components]
            parts = f"{len(areas)} part{'s' * (len(areas) > 1)} of {', '.join(areas)} rad²" if areas else "empty"
            lines.append(f"{one.color}, {RELATION[one.sign]}: {parts}")
            for number, waypoint in enumerate(one.waypoints, start=1):
                text = f"waypoint {number} ({waypoint.point[0]:.4f}, {waypoint.point[1]:.4f}): "
                if waypoint.part is not None:
                    lines.append(f"  {text}in part {waypoint.part}")
                    continue
                nearest = one.region.nearest_as_text(waypoint.point)
                text += f"{waypoint.why_not}"
                if nearest is not None:
                    text += f"; the nearest admissible point is {nearest}"
                lines.append(fill(text, _WIDTH, initial_indent="  ", subsequent_indent="    "))
            if len(one.waypoints) > 1:
                lines.append("  a loop can join them all" if one.joined else "  no loop can join them")
        return "\n".join(lines)


def location_of(request: PlanRequest, *, use: Literal["flyable", "valid"] = "flyable") -> Location:
    """Return in which part of the admissible regions each waypoint lies, and whether a loop can join them all.

    Parameters
    ----------
    request
        Waypoints, color ("auto": red), sign ("auto": both), vehicle, floor, polygons and accuracy count.
    use
        "flyable": where the least singular value, hover thrusts and limits of the vehicle allow a gait; "valid": where
        R has the sign.

    Raises
    ------
    InputError
        If `use` is neither.

    Examples
    --------
    >>> from gaitgraph.planning.request import request_of
    >>> found = location_of(request_of([(-0.4, 0.4), (0.5, 0.5)], sign="positive"))
    >>> [waypoint.part for waypoint in found.regions[0].waypoints], bool(found)
    ([1, None], False)
    >>> [round(angle, 4) for angle in found.regions[0].waypoints[1].nearest]
    [0.1671, 0.5]
    """
    if use not in ("flyable", "valid"):
        raise InputError(f"use must be 'flyable' or 'valid', got {shown(use)}")
    color: Color = "blue" if request.color == "blue" else "red"
    signs: tuple[Sign, ...] = ("positive", "negative")
    regions = []
    for sign in signs:
        if request.sign not in ("auto", sign):
            continue
        region = region_of(request, color, sign, use)
        waypoints = []
        for point in request.waypoints:
            part = region.component_of(point)
            if part is not None:
                waypoints.append(WaypointLocation(point=point, part=part + 1))
            else:
                why, nearest = region.why_not(point), region.nearest(point)
                waypoints.append(WaypointLocation(point=point, part=None, why_not=why, nearest=nearest))
        regions.append(RegionLocation(color=color, sign=sign, region=region, waypoints=tuple(waypoints)))
    return Location(use=use, accuracy=request.accuracy, regions=tuple(regions))
