"""What a plan is asked for: the request, and requests in TOML, JSON and gait files.

A minimal file::

    waypoints = [["3pi/8", "-3pi/8"], ["3pi/8", "-pi/8"], ["pi/8", "-pi/8"], ["pi/8", "-3pi/8"]]

`vehicle` is a preset's name, a TOML file (relative to the request), or a table of constants. `samples` or `rate`
say how the gait table is sampled.
"""

from __future__ import annotations

import inspect
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import HALF_PI, angle_from_text, number_of
from gaitgraph.errors import GaitgraphError, InputError, did_you_mean, shown
from gaitgraph.files import table_from_toml, text_of
from gaitgraph.gait.table import is_closed, merged, setting_of
from gaitgraph.graph.build import DEFAULT_DIVISIONS, checked_divisions
from gaitgraph.invertibility.matrices import DEFAULT_FLOOR, Kind, coefficients_of
from gaitgraph.io.formats import FORMATS, naming_file, provenance_in, read_pieces
from gaitgraph.surface.loop_colorings import colorings
from gaitgraph.surface.region import Zones
from gaitgraph.timing.timed_gait import LAWS, checked_clock
from gaitgraph.vehicle import PAPER, Vehicle, vehicle_from_mapping, vehicle_named

if TYPE_CHECKING:
    from gaitgraph.surface.loop_colorings import Colorings

Point = tuple[float, float]
Angle = float | str
Points = Sequence[Sequence[Angle]] | npt.NDArray[np.float64]
"""Points (α1, α2), each angle a number [rad] or a text such as "3pi/8"."""

CHOICES: dict[str, tuple[str, ...]] = {
    "color": ("auto", "red", "blue"),
    "sign": ("auto", "positive", "negative"),
    "objective": ("shortest", "robust"),
    "method": ("grid", "exact"),
}
"""What fields that are names may be."""
MOST_WAYPOINTS = 1000

_SAMPLING = ("samples", "rate")


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanRequest:
    """What a plan is asked for, complete and checked: made by :func:`request_of`, which explains the fields.

    `zones` has the polygons of `keep_out` and `keep_in`, if there are any; `notes` say what was changed.
    """

    waypoints: tuple[Point, ...]
    color: str
    sign: str
    objective: str
    divisions: int
    vehicle: Vehicle
    coefficients: Kind
    zones: Zones | None
    any_order: bool
    reverse: bool
    method: str
    accuracy: float
    period: float
    law: str
    floor: float
    notes: tuple[str, ...] = ()

    def as_mapping(self) -> dict[str, Any]:
        """Return the request as plain values, under the names that a request file uses."""
        plain: dict[str, Any] = {
            "waypoints": [list(point) for point in self.waypoints],
            "vehicle": self.vehicle.as_mapping(),
        }
        for name in ("keep_out", "keep_in"):
            polygons = getattr(self.zones, name) if self.zones else ()
            plain[name] = [[list(corner) for corner in polygon] for polygon in polygons]
        return {name: plain[name] if name in plain else getattr(self, name) for name in REQUEST_FIELDS}


def request_of(
    waypoints: Points,
    *,
    color: Literal["auto", "red", "blue"] = "auto",
    sign: Literal["auto", "positive", "negative"] = "auto",
    objective: Literal["shortest", "robust"] = "shortest",
    divisions: int | None = None,
    vehicle: Vehicle | str | Path | Mapping[str, Any] = PAPER,
    coefficients: Kind | None = None,
    keep_out: Sequence[Points] = (),
    keep_in: Sequence[Points] = (),
    any_order: bool = False,
    reverse: bool = False,
    method: Literal["exact", "grid"] | None = None,
    accuracy: float = 1e-6,
    period: float = 1.0,
    law: str = LAWS[0],
    floor: float = DEFAULT_FLOOR,
) -> PlanRequest:
    """Return a request, checked and complete.

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
        "shortest", or "robust": the best worst-case least singular value, then the shortest.
    divisions
        Pieces into which [−π/2, π/2] is cut by the grid, at most 256; 16 if it is not given.
    vehicle
        A vehicle, a preset's name, a TOML file, or a mapping of constants.
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
        `divisions` are given, else exact.
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

    Examples
    --------
    >>> request = request_of([("pi/8", "-pi/8"), ("pi/8", "-pi/8")], vehicle="paper")
    >>> len(request.waypoints), request.method, request.coefficients
    (1, 'exact', 'published')
    """
    if method is None:
        method = "exact" if divisions is None else "grid"
    for name, value in {"color": color, "sign": sign, "objective": objective, "method": method}.items():
        if not isinstance(value, str) or value not in CHOICES[name]:
            hint = did_you_mean(value, list(CHOICES[name])) if isinstance(value, str) else ""
            if (name, value) == ("objective", "thrust"):
                hint = "; for low thrusts use gaitgraph optimize --objective hover_reserve"
            raise InputError(f"{name} must be one of {', '.join(CHOICES[name])}, got {shown(value)}{hint}")
    for name, flag in (("any_order", any_order), ("reverse", reverse)):
        if not isinstance(flag, bool):
            raise InputError(f"{name} must be true or false, got {shown(flag)}")
    divisions = checked_divisions(DEFAULT_DIVISIONS if divisions is None else divisions)
    checked_clock(period, law)
    if not 0 <= number_of(floor) < math.inf:
        raise InputError(f"floor must be a finite number ≥ 0 (a singular value), got {shown(floor)}")
    if not 1e-9 <= number_of(accuracy) <= 0.1:
        raise InputError(f"accuracy must be between 1e-9 and 0.1 rad, got {shown(accuracy)}")
    if isinstance(vehicle, Mapping):
        vehicle = vehicle_from_mapping(dict(vehicle))
    elif isinstance(vehicle, (str, Path)):
        vehicle = vehicle_named(vehicle)
    elif not isinstance(vehicle, Vehicle):
        raise InputError(f"vehicle must be a preset's name, a .toml file or a table of constants, got {shown(vehicle)}")

    points = checked_waypoints(waypoints)
    # A waypoint that equals the one before it is dropped, around the seam too.
    kept = [point for k, point in enumerate(points) if k == 0 or point != points[k - 1]]
    if len(kept) > 1 and kept[-1] == kept[0]:
        kept.pop()
    dropped = len(points) - len(kept)
    note = f"merged {dropped} waypoint{'s' * (dropped > 1)} that repeated the one before"
    given = any(not isinstance(part, (list, tuple)) or part for part in (keep_out, keep_in))
    return PlanRequest(
        waypoints=tuple(kept),
        color=color,
        sign=sign,
        objective=objective,
        divisions=divisions,
        vehicle=vehicle,
        coefficients=coefficients_of(vehicle, coefficients).kind,
        zones=Zones(keep_out=keep_out, keep_in=keep_in) if given else None,
        any_order=any_order,
        reverse=reverse,
        method=method,
        accuracy=float(accuracy),
        period=float(period),
        law=law,
        floor=float(floor),
        notes=(note,) if dropped else (),
    )


REQUEST_FIELDS = tuple(inspect.signature(request_of).parameters)
"""The names of the fields of a request, as files and Python use them."""


def checked_waypoints(value: object, most: int = MOST_WAYPOINTS) -> list[Point]:
    """Return waypoints as pairs of angles [rad]; InputError unless there are 1 to `most`, each in [−π/2, π/2]²."""
    allowed = "a list of [alpha1, alpha2], each in [−π/2, π/2]"
    if not isinstance(value, (list, tuple, np.ndarray)):
        raise InputError(f"waypoints must be {allowed}, got {shown(value)}")
    if not len(value):
        raise InputError(f"waypoints must be {allowed}, at least one; none given")
    if len(value) > most:
        raise InputError(f"waypoints must be at most {most}, got {len(value)}")
    points = []
    for number, angles in enumerate(value, start=1):
        if not isinstance(angles, (list, tuple, np.ndarray)) or len(angles) != 2:
            raise InputError(f"waypoint {number} must be [alpha1, alpha2], got {shown(angles)}")
        first, second = (angle_from_text(angles[k], f"waypoint {number} alpha{k + 1}") for k in range(2))
        for k, angle in enumerate((first, second)):
            if abs(angle) > HALF_PI:
                raise InputError(
                    f"waypoint {number} alpha{k + 1} must be in [−π/2, π/2] (±{HALF_PI!r} rad), got {shown(angles[k])}"
                )
        points.append((first, second))
    return points


def request_from_mapping(content: Mapping[str, Any]) -> tuple[PlanRequest, dict[str, Any]]:
    """Return the request that a mapping describes, and its sampling (samples, rate); InputError if a name is unknown.

    Examples
    --------
    >>> request, sampling = request_from_mapping({"waypoints": [["pi/8", "-pi/8"]], "samples": 50})
    >>> request.divisions, sampling
    (16, {'samples': 50})
    """
    known = (*REQUEST_FIELDS, *_SAMPLING)
    # Requests of earlier versions state the sheets; "planes" is what there is.
    content = {name: value for name, value in content.items() if (name, value) != ("sheets", "planes")}
    for name, value in content.items():
        if name == "sheets":
            why = "since no gait on a fibre can fly: loops are planned on the red and the blue sheet"
            raise InputError(f"sheets: {shown(value)}; no field any more, {why}")
        if name not in known:
            hint = did_you_mean(name, list(known))
            raise InputError(f"{name}: no field of a request{hint or '; fields are ' + ', '.join(REQUEST_FIELDS)}")
    if "waypoints" not in content:
        raise InputError("waypoints must be a list of [alpha1, alpha2], at least one; none given")
    sampling = {name: content.pop(name) for name in _SAMPLING if name in content}
    return request_of(**content), sampling


def read_request(path: str | Path, overrides: Mapping[str, Any]) -> tuple[PlanRequest, dict[str, Any]]:
    """Return the request in a request file, or the one that made a plan or a gait file, and its sampling.

    Parameters
    ----------
    path
        A TOML or JSON request, a saved plan, or a gait file of any format.
    overrides
        What replaces fields of the request, by their names.

    Raises
    ------
    FileProblem, InputError
        If the file cannot be read, or holds no request.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in (".toml", *FORMATS):
        hint = did_you_mean(suffix, [".toml", *FORMATS])
        allowed = ", ".join([".toml", *FORMATS])
        raise InputError(f"request file must end in one of {allowed}, got {str(path)!r}{hint}")
    source = _text_or_provenance(path)
    try:
        content = _stated_request(source, suffix)
        vehicle = content.get("vehicle")
        if isinstance(vehicle, str) and vehicle.lower().endswith(".toml") and "vehicle" not in overrides:
            content["vehicle"] = str(path.parent / vehicle)
        if any(name in overrides for name in _SAMPLING):
            content = {name: value for name, value in content.items() if name not in _SAMPLING}
        return request_from_mapping({**content, **overrides})
    except InputError as error:
        what = "request file" if isinstance(source, str) else "gait file"
        raise type(error)(f"{what} {str(path)!r}: {error}") from error


def _text_or_provenance(path: Path) -> str | dict[str, Any]:
    """Return the text of a TOML or JSON file, or what made a gait file of another format."""
    if path.suffix.lower() in (".toml", ".json"):
        return text_of(path, "request file", "TOML or JSON")
    return provenance_in(path)


def _stated_request(source: str | dict[str, Any], suffix: str) -> dict[str, Any]:
    """Return the fields of the request in the text of a file, or in what a gait file says of its making."""
    about: object = source
    if isinstance(source, str):
        content = _parsed(source, suffix)
        if "status" in content and isinstance(content.get("request"), dict):
            return dict(content["request"])  # a saved plan
        if not isinstance(content.get("columns"), dict):
            return content
        about = content.get("about")
    found = about.get("request") if isinstance(about, dict) else None
    if not isinstance(found, dict):
        maker = about.get("made_by") if isinstance(about, dict) else None
        why = f": {shown(maker)[1:-1]} made it, which plan does not repeat" if isinstance(maker, str) else ""
        raise InputError(
            f"it tells no request that made it{why}, so there is nothing to plan again: give a request, or "
            "the gait file of a planned gait"
        )
    return dict(found)


def _parsed(text: str, suffix: str) -> dict[str, Any]:
    if suffix == ".toml":
        return table_from_toml(text)
    try:
        content = json.loads(text)
    except RecursionError as error:
        raise InputError("it is nested too deeply for a table of fields") from error
    except ValueError as error:
        raise InputError(f"it is not JSON ({str(error).splitlines()[0]})") from error
    if not isinstance(content, dict):
        raise InputError(f"it must hold an object of fields, got a {type(content).__name__}")
    return content


def holds_request(path: str | Path) -> bool:
    """Return whether a file is a request, or a saved plan without a gait; FileProblem if it cannot be read."""
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
        return set(_stated_request(_text_or_provenance(path), path.suffix.lower()))
    except GaitgraphError:
        return set()


def colorings_of_file(
    path: str | Path,
    *,
    sign: str | None = None,
    vehicle: Vehicle | None = None,
    coefficients: Kind | None = None,
    crossing_tolerance: float | None = None,
) -> Colorings:
    """Return every colouring of the loop in a gait file, a table of alpha1 and alpha2, or a request's waypoints.

    A last row that equals the first is the closing row.

    Parameters
    ----------
    path
        A gait table of any format, a saved plan, or a .toml or .json request.
    sign
        "negative", "positive" or "auto"; by default what a request says, else "auto".
    vehicle, coefficients, crossing_tolerance
        By default what the file says, for a request half a step of its grid; else the paper's vehicle, its published
        coefficients, and π/32.

    Raises
    ------
    InputError, FileProblem
        If the file holds neither, or a value is not allowed.
    """
    if holds_request(path):
        given = {"vehicle": vehicle, "coefficients": coefficients, "sign": sign}
        request, _ = read_request(path, {name: value for name, value in given.items() if value is not None})
        points: Any = request.waypoints
        vehicle, numbers = request.vehicle, coefficients_of(request.vehicle, request.coefficients)
        stated_tolerance = math.pi / (2 * request.divisions)
        sign = request.sign
    else:
        table = merged(read_pieces(path, plane_only=True))
        with naming_file(path):
            vehicle, numbers, stated_tolerance = setting_of(table, vehicle, coefficients)
        points = np.column_stack([table["alpha1"], table["alpha2"]])
        if is_closed(table):
            points = points[:-1]
    return colorings(
        points,
        sign=sign or "auto",
        vehicle=vehicle,
        coefficients=numbers,
        crossing_tolerance=stated_tolerance if crossing_tolerance is None else crossing_tolerance,
    )
