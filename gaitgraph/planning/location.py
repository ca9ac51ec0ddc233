"""Where waypoints lie: in which part of which region, and whether a loop can join them."""

from __future__ import annotations

from dataclasses import dataclass
from textwrap import fill
from typing import TYPE_CHECKING, Any, Literal

from gaitgraph.errors import InputError, shown
from gaitgraph.planning.prepared import region_of
from gaitgraph.planning.refusal import RELATION

if TYPE_CHECKING:
    from gaitgraph.planning.request import PlanRequest, Point
    from gaitgraph.surface.region import Region

__all__ = ["Part", "Whereabouts", "whereabouts_of"]

_WIDTH = 110


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """One waypoint: the number of its part, from 1; or why it is in none, and the nearest point that is in one."""

    point: Point
    part: int | None
    why_not: str | None = None
    nearest: Point | None = None

    def as_mapping(self) -> dict[str, Any]:
        """Return plain values, ready for JSON."""
        return {
            "waypoint": list(self.point),
            "part": self.part,
            "reason": self.why_not,
            "nearest": None if self.nearest is None else list(self.nearest),
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """The region of one color and sign of R, and where the waypoints lie in it."""

    color: str
    sign: str
    region: Region
    places: tuple[Place, ...]

    @property
    def joined(self) -> bool:
        """Whether one part of the region, or parts that touch, hold all waypoints."""
        first, *others = (place.point for place in self.places)
        return self.places[0].part is not None and all(self.region.joined(first, other) for other in others)

    def as_mapping(self) -> dict[str, Any]:
        """Return plain values, ready for JSON."""
        return {
            "color": self.color,
            "sign": self.sign,
            "area": self.region.area,
            "parts": [
                {"area": part.area, "inside": list(part.representative_point().coords[0])}
                for part in self.region.components
            ],
            "waypoints": [place.as_mapping() for place in self.places],
            "joined": self.joined,
        }

    def lines(self) -> list[str]:
        """Return what there is to say, for people."""
        areas = [f"{part.area:.4g}" for part in self.region.components]
        told = f"{len(areas)} part{'s' * (len(areas) > 1)} of {', '.join(areas)} rad²" if areas else "empty"
        lines = [f"{self.color}, {RELATION[self.sign]}: {told}"]
        for number, place in enumerate(self.places, start=1):
            head = f"waypoint {number} ({place.point[0]:.4f}, {place.point[1]:.4f})"
            if place.part is not None:
                lines.append(f"  {head}: in part {place.part}")
                continue
            text = f"{head}: {place.why_not}"
            nearest = self.region.nearest_as_text(place.point)
            if nearest is not None:
                text += f"; the nearest admissible point is {nearest}"
            lines.append(fill(text, _WIDTH, initial_indent="  ", subsequent_indent="    "))
        if len(self.places) > 1:
            lines.append("  a loop can join them all" if self.joined else "  no loop can join them")
        return lines


@dataclass(frozen=True, slots=True, kw_only=True)
class Whereabouts:
    """Where waypoints lie; truthy when, for a color and sign of R, one part of the region holds them all.

    Parameters
    ----------
    use
        "flyable" or "valid": what the region allows.
    accuracy
        How far inside its curved borders the region may be [rad].
    answers
        One for each color and sign of R that was asked for.
    """

    use: str
    accuracy: float
    answers: tuple[Part, ...]

    def __bool__(self) -> bool:
        return any(answer.joined for answer in self.answers)

    def as_mapping(self) -> dict[str, Any]:
        """Return plain values, ready for JSON."""
        return {
            "use": self.use,
            "accuracy": self.accuracy,
            "joined": bool(self),
            "regions": [answer.as_mapping() for answer in self.answers],
        }

    def __str__(self) -> str:
        return "\n".join(line for answer in self.answers for line in answer.lines())


def whereabouts_of(request: PlanRequest, *, use: Literal["flyable", "valid"] = "flyable") -> Whereabouts:
    """Return in which part of the admissible regions each waypoint lies, and whether a loop can join them all.

    Parameters
    ----------
    request
        Waypoints, color ("auto": red), sign ("auto": both), vehicle, floor, polygons and accuracy count.
    use
        "flyable": where the least singular value, hover thrusts and limits of the vehicle allow a gait; "valid": where
        R has the sign.

    Examples
    --------
    >>> from gaitgraph.planning.request import request_of
    >>> found = whereabouts_of(request_of([(-0.4, 0.4), (0.5, 0.5)], sign="positive"))
    >>> [place.part for place in found.answers[0].places], bool(found)
    ([1, None], False)
    >>> [round(angle, 4) for angle in found.answers[0].places[1].nearest]
    [0.1671, 0.5]
    """
    if use not in ("flyable", "valid"):
        raise InputError(f"use: {shown(use)}; allowed are 'flyable' and 'valid'")
    color = "red" if request.color == "auto" else request.color
    answers = []
    for sign in ("positive", "negative") if request.sign == "auto" else (request.sign,):
        region = region_of(request, color, sign, use)
        places = []
        for point in request.waypoints:
            part = region.component_of(point)
            if part is not None:
                places.append(Place(point=point, part=part + 1))
            else:
                places.append(
                    Place(point=point, part=None, why_not=region.why_not(point), nearest=region.nearest(point))
                )
        answers.append(Part(color=color, sign=sign, region=region, places=tuple(places)))
    return Whereabouts(use=use, accuracy=request.accuracy, answers=tuple(answers))
