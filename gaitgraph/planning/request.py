"""What a plan is asked for: a request, checked on construction, and requests as TOML or JSON files.

A minimal file::

    waypoints = [["3pi/8", "-3pi/8"], ["3pi/8", "-pi/8"], ["pi/8", "-pi/8"], ["pi/8", "-3pi/8"]]

`vehicle` is a preset's name, a TOML file (relative to the request), or a table of constants. `samples` or `rate`
say how the gait table is sampled.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitgraph.angles import HALF_PI, angle_from_text, number_of
from gaitgraph.errors import GaitgraphError, InputError, did_you_mean, shown
from gaitgraph.files import table_from_toml, text_of
from gaitgraph.graph.build import DEFAULT_DIVISIONS
from gaitgraph.graph.compact_bits import checked_compact_divisions
from gaitgraph.invertibility.matrices import Kind, coefficients_of
from gaitgraph.surface.fibers import stops_on_families
from gaitgraph.surface.region import Zones
from gaitgraph.timing.timed_gait import LAWS, checked_clock
from gaitgraph.validation.report import DEFAULT_FLOOR
from gaitgraph.vehicle import PAPER, Vehicle, vehicle_from_mapping, vehicle_named

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = [
    "CHOICES",
    "PlanRequest",
    "Point",
    "holds_request",
    "planes_only",
    "read_request",
    "request_fields",
    "request_from_mapping",
    "request_of",
    "stated_fields",
]

Point = tuple[float, ...]

CHOICES: dict[str, tuple[str, ...]] = {
    "color": ("auto", "red", "blue"),
    "sign": ("auto", "positive", "negative"),
    "objective": ("shortest", "robust", "thrust"),
    "method": ("grid", "exact"),
    "sheets": ("planes", "all"),
}
"""What fields that are names may be."""
MOST_WAYPOINTS = 1000
MOST_DIVISIONS_OF_ALL_SHEETS = 128  # a fibre has as many nodes as a sheet, and each is an object


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanRequest:
    """What a plan is asked for; checked on construction.

    Parameters
    ----------
    waypoints
        (α1, α2) pairs in [−π/2, π/2], numbers [rad] or texts such as "3pi/8"; the loop passes through them
        exactly, in order, and back to the first. Waypoints that repeat in a row are merged.
    color
        "red", "blue" or "auto".
    sign
        Sign of R: "positive", "negative" or "auto".
    objective
        "shortest"; "robust": the best worst-case least singular value, then the shortest; or "thrust", on the grid:
        the least integral of the largest hover thrust share along the loop (:mod:`gaitgraph.graph.loads`).
    divisions
        Pieces into which [−π/2, π/2] is cut by the grid, at most 4096; 16 if it is not given.
    vehicle
        A vehicle, a preset's name, or a TOML file.
    coefficients
        "published", "exact", or None: published for the paper's own vehicle, exact for any other.
    keep_out, keep_in
        Polygons in the (α1, α2) plane, lists of (α1, α2).
    any_order
        Visit the waypoints in the order that makes the shortest loop: exact up to nine, beyond by a heuristic whose
        loop is at most 1.5 times as long (:func:`gaitgraph.graph.walks.best_order`).
    reverse
        Run the loop the other way.
    method
        "exact": any-angle loops, the shortest there are; "grid": the paper's grid graph. By default the grid if
        `divisions` or the objective "thrust" are given, else exact.
    sheets
        "planes": the red and the blue sheet; "all": the two fibres too, where a waypoint may be a point
        (α1, α2, α3, α4) on one of them. See :mod:`gaitgraph.planning.fiberloops`.
    accuracy
        With the method "exact": how far the polygon of a curved border may stay inside it [rad], 1e-9 to 0.1.
    period, law
        The clock with which tilt rates are judged; see :func:`gaitgraph.timing.timed_gait.parametrize`.
    floor
        Least singular value that a flyable loop keeps, dimensionless.

    Raises
    ------
    InputError
        If anything is malformed; the message names the field, the value and what is allowed.
    """

    waypoints: Any
    color: str = "auto"
    sign: str = "auto"
    objective: str = "shortest"
    divisions: int = None  # type: ignore[assignment]  # always known after construction
    vehicle: Any = PAPER
    coefficients: Kind | None = None
    keep_out: Any = ()
    keep_in: Any = ()
    any_order: bool = False
    reverse: bool = False
    method: str = None  # type: ignore[assignment]  # always known after construction
    sheets: str = "planes"
    accuracy: float = 1e-6
    period: float = 1.0
    law: str = LAWS[0]
    floor: float = DEFAULT_FLOOR
    zones: Zones | None = field(default=None, init=False, repr=False)
    notes: tuple[str, ...] = field(default=(), init=False, repr=False)

    def __post_init__(self) -> None:
        def put(name: str, value: Any) -> None:
            object.__setattr__(self, name, value)

        method: str | None = self.method
        divisions: int | None = self.divisions
        if method is None:
            put("method", "exact" if divisions is None and self.objective != "thrust" else "grid")
        if divisions is None:
            put("divisions", DEFAULT_DIVISIONS)
        for name, allowed in CHOICES.items():
            value = getattr(self, name)
            if not isinstance(value, str) or value not in allowed:
                hint = did_you_mean(value, list(allowed)) if isinstance(value, str) else ""
                raise InputError(f"{name}: {shown(value)}; allowed are {', '.join(allowed)}{hint}")
        if self.sheets == "all" and self.divisions > MOST_DIVISIONS_OF_ALL_SHEETS:
            most = MOST_DIVISIONS_OF_ALL_SHEETS
            raise InputError(f"divisions: {self.divisions}; allowed with all sheets are {most} at most")
        if self.objective == "thrust" and self.method == "exact":
            raise InputError("objective: 'thrust'; allowed with the method exact are shortest, robust")
        for name in ("any_order", "reverse"):
            if not isinstance(getattr(self, name), bool):
                raise InputError(f"{name}: {shown(getattr(self, name))}; allowed are true and false")
        put("divisions", checked_compact_divisions(self.divisions))
        checked_clock(self.period, self.law)
        if not 0 <= number_of(self.floor) < math.inf:
            raise InputError(f"floor: {shown(self.floor)}; allowed is a finite number ≥ 0 (a singular value)")
        if not 1e-9 <= number_of(self.accuracy) <= 0.1:
            raise InputError(f"accuracy: {shown(self.accuracy)}; allowed is 1e-9 to 0.1 (rad)")
        put("accuracy", float(self.accuracy))
        put("period", float(self.period))
        put("floor", float(self.floor))
        put("vehicle", _vehicle(self.vehicle))
        put("coefficients", coefficients_of(self.vehicle, self.coefficients).kind)
        points = _waypoints(self.waypoints, self.sheets)
        if self.sheets == "all":
            points, moved = stops_on_families(points, coefficients_of(self.vehicle, self.coefficients))
            put("notes", moved)
            if self.color == "blue" and any(len(point) == 4 for point in points):
                raise InputError("color: 'blue'; allowed with waypoints of four angles are auto, red")
        put("waypoints", _merged(points))
        if len(self.waypoints) < len(points):
            merged = len(points) - len(self.waypoints)
            note = f"merged {merged} waypoint{'s' * (merged > 1)} that repeated the one before"
            put("notes", (*self.notes, note))
        if any(not isinstance(part, (list, tuple)) or part for part in (self.keep_out, self.keep_in)):
            put("zones", Zones(keep_out=self.keep_out, keep_in=self.keep_in))

    def as_mapping(self) -> dict[str, Any]:
        """Return the request as plain values, under the names that a request file uses."""
        out = {name: getattr(self, name) for name in request_fields()}
        out["vehicle"] = self.vehicle.as_mapping()
        out["waypoints"] = [list(point) for point in self.waypoints]
        for name in ("keep_out", "keep_in"):
            polygons = getattr(self.zones, name) if self.zones else ()
            out[name] = [[list(corner) for corner in polygon] for polygon in polygons]
        return out


def _vehicle(value: object) -> Vehicle:
    if isinstance(value, Vehicle):
        return value
    if isinstance(value, dict):
        return vehicle_from_mapping(value)
    if isinstance(value, (str, Path)):
        return vehicle_named(value)
    raise InputError(f"vehicle: {shown(value)}; allowed is a preset's name, a .toml file or a table of constants")


def _waypoints(value: Any, sheets: str) -> tuple[Point, ...]:
    allowed = "a list of [alpha1, alpha2], each in [−π/2, π/2]"
    if not isinstance(value, (list, tuple, np.ndarray)):
        raise InputError(f"waypoints: {shown(value)}; allowed is {allowed}")
    if not len(value):
        raise InputError(f"waypoints: none given; allowed is {allowed}, at least one")
    if len(value) > MOST_WAYPOINTS:
        raise InputError(f"waypoints: {len(value)} given; allowed are {MOST_WAYPOINTS} at most")
    points = []
    for number, angles in enumerate(value, start=1):
        sizes = (2, 4) if sheets == "all" else (2,)
        if not isinstance(angles, (list, tuple, np.ndarray)) or len(angles) not in sizes:
            more = " or [alpha1, alpha2, alpha3, alpha4]" if sheets == "all" else ""
            if isinstance(angles, (list, tuple, np.ndarray)) and len(angles) == 4:
                more = "; four angles with sheets = 'all'"
            raise InputError(f"waypoint {number}: {shown(angles)}; allowed is [alpha1, alpha2]{more}")
        point = tuple(angle_from_text(angle, f"waypoint {number} alpha{k}") for k, angle in enumerate(angles, start=1))
        for k, angle in enumerate(point, start=1):
            if abs(angle) > HALF_PI:
                raise InputError(
                    f"waypoint {number} alpha{k}: {shown(angles[k - 1])}; allowed is −π/2 to π/2 (±{HALF_PI!r} rad)"
                )
        points.append(point)
    return tuple(points)


def _merged(points: Sequence[Point]) -> tuple[Point, ...]:
    """Drop points that equal the one before, around the seam too."""
    kept = [point for k, point in enumerate(points) if k == 0 or point != points[k - 1]]
    if len(kept) > 1 and kept[-1] == kept[0]:
        kept.pop()
    return tuple(kept)


def planes_only(request: PlanRequest, what: str) -> None:
    """Raise InputError if a request asks for the fibres, which `what` does not know."""
    if request.sheets != "planes":
        raise InputError(f"sheets: {shown(request.sheets)}; allowed for {what} is planes")


_SAMPLING = ("samples", "rate")


def request_fields() -> list[str]:
    """Return the names of the fields of a request, as files and Python use them.

    >>> request_fields()[:3]
    ['waypoints', 'color', 'sign']
    """
    return [one.name for one in fields(PlanRequest) if one.init]


def request_of(content: dict[str, Any]) -> PlanRequest:
    """Return the request that names and values describe; InputError if a name is unknown or waypoints are missing."""
    known = request_fields()
    for name in content:
        if name not in known:
            hint = did_you_mean(name, [*known, *_SAMPLING])
            raise InputError(f"{name}: no field of a request{hint or '; allowed are ' + ', '.join(known)}")
    if "waypoints" not in content:
        raise InputError("waypoints: missing; allowed is a list of [alpha1, alpha2], at least one")
    return PlanRequest(**content)


def request_from_mapping(content: dict[str, Any]) -> tuple[PlanRequest, dict[str, Any]]:
    """Return the request that a mapping describes, and its sampling (samples, rate).

    Raises
    ------
    InputError
        If a name is unknown or a value is not allowed.

    Examples
    --------
    >>> request, sampling = request_from_mapping({"waypoints": [["pi/8", "-pi/8"]], "samples": 50})
    >>> request.divisions, sampling
    (16, {'samples': 50})
    """
    content = dict(content)
    sampling = {name: content.pop(name) for name in _SAMPLING if name in content}
    return request_of(content), sampling


def read_request(path: str | Path, overrides: dict[str, Any]) -> tuple[PlanRequest, dict[str, Any]]:
    """Read a request file; overrides replace what it says.

    A plan or a gait table saved as JSON is read too: the request that made it is planned again.

    Raises
    ------
    FileProblem
        If the file cannot be read.
    InputError
        If it holds no request; the message names file, field, value and what is allowed.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in (".toml", ".json"):
        hint = did_you_mean(suffix, [".toml", ".json"])
        raise InputError(f"request file: {str(path)!r}; allowed are the suffixes .toml, .json{hint}")
    text = text_of(path, "request file", "TOML or JSON")
    try:
        content = _parsed(text, suffix)
        content = _request_in(content)
        vehicle = content.get("vehicle")
        if isinstance(vehicle, str) and vehicle.lower().endswith(".toml") and "vehicle" not in overrides:
            content["vehicle"] = str(path.parent / vehicle)
        if any(name in overrides for name in _SAMPLING):
            content = {name: value for name, value in content.items() if name not in _SAMPLING}
        return request_from_mapping({**content, **overrides})
    except InputError as error:
        raise type(error)(f"request file {str(path)!r}: {error}") from error


def _request_in(content: dict[str, Any]) -> dict[str, Any]:
    """Return the request that a plan or a gait table tells, or the content itself if it is neither."""
    if "status" in content and isinstance(content.get("request"), dict):
        found: dict[str, Any] = content["request"]
        return found
    if isinstance(content.get("columns"), dict):
        return request_in_about(content.get("about"))
    return content


def request_in_about(about: object) -> dict[str, Any]:
    """Return the request in what a gait table tells of its making; InputError if it tells none.

    >>> request_in_about({"request": {"waypoints": [[0.4, -0.4]]}})
    {'waypoints': [[0.4, -0.4]]}
    """
    found = about.get("request") if isinstance(about, dict) else None
    if not isinstance(found, dict):
        maker = about.get("made_by") if isinstance(about, dict) else None
        why = f": {shown(maker)[1:-1]} made it, which plan does not repeat" if isinstance(maker, str) else ""
        raise InputError(
            f"it tells no request that made it{why}, so there is nothing to plan again; allowed is a request, or a "
            "gait file of a planned gait"
        )
    return dict(found)


def holds_request(path: str | Path) -> bool:
    """Return whether a file is a request, or a saved plan without a gait, rather than a gait file.

    Raises
    ------
    FileProblem, InputError
        If a .json file cannot be read or is no JSON.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix != ".json":
        return suffix == ".toml"
    text = text_of(path, "file", "a gait table or a request")
    if '"waypoints"' not in text:
        return False
    try:
        content = _parsed(text, suffix)
    except InputError:
        return False  # reading it as a gait file says what is wrong
    return "waypoints" in content and not content.get("path") and "columns" not in content


def stated_fields(path: str | Path) -> set[str]:
    """Return the names that a request file states; empty if it cannot be read as one, which reading it explains."""
    path = Path(path)
    try:
        content = _parsed(text_of(path, "request file", "TOML or JSON"), path.suffix.lower())
    except GaitgraphError:
        return set()
    try:
        return set(_request_in(content))
    except InputError:
        return set()


def _parsed(text: str, suffix: str) -> dict[str, Any]:
    if suffix == ".toml":
        return table_from_toml(text)
    import json

    try:
        content = json.loads(text)
    except RecursionError as error:
        raise InputError("it is nested too deeply; allowed is a table of fields") from error
    except ValueError as error:
        raise InputError(f"it is not JSON ({str(error).splitlines()[0]})") from error
    if not isinstance(content, dict):
        raise InputError(f"it holds a {type(content).__name__}; allowed is an object of fields")
    return content
