"""What a plan is asked for: the request, its cases of color and sign of R with their obstacles, and requests in files.

A minimal file::

    waypoints = [["3pi/8", "-3pi/8"], ["3pi/8", "-pi/8"], ["pi/8", "-pi/8"], ["pi/8", "-3pi/8"]]

`vehicle` is a preset's name, a TOML file (relative to the request), or a table of constants. `samples` or `rate`
say how the gait table is sampled.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import HALF_PI, angle_from_text, number_of
from gaitgraph.errors import InputError, did_you_mean, shown
from gaitgraph.files import table_from_toml, text_of
from gaitgraph.gait.table import is_closed, merged, setting_of
from gaitgraph.graph.build import DEFAULT_DIVISIONS, checked_divisions
from gaitgraph.invertibility.matrices import DEFAULT_FLOOR, Coefficients, Kind, coefficients_of, noise_of
from gaitgraph.io.formats import FORMATS, naming_file, provenance_in, read_pieces
from gaitgraph.surface.loop_colorings import colorings
from gaitgraph.surface.region import Zones
from gaitgraph.surface.sheets import COLORS, RELATION, SIGNS, Color, RootArrays, Sign, root_arrays, separating_factor
from gaitgraph.timing.timed_gait import LAWS, checked_clock
from gaitgraph.vehicle import PAPER, Vehicle, vehicle_from_mapping, vehicle_named

if TYPE_CHECKING:
    from gaitgraph.gait.gait import Gait
    from gaitgraph.surface.loop_colorings import Colorings

Point = tuple[float, float]
Angle = float | str
Points = Sequence[Sequence[Angle]] | npt.NDArray[np.float64]
"""Points (α1, α2), each angle a number [rad] or a text such as "3pi/8"."""
FoundPath = tuple["Gait", tuple[int, ...], float | None]
"""A loop through every node, the order of the waypoints (counted from 0), and a lower bound of its length [rad]."""

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
    """What a plan is asked for, complete and checked: made by :func:`request_of`.

    The fields are the options of :func:`gaitgraph.planning.planner.plan_loop`. `zones` has the polygons of `keep_out`
    and `keep_in`, if there are any; `notes` say what was changed.
    """

    waypoints: tuple[Point, ...]
    color: str = "auto"
    sign: str = "auto"
    objective: str = "shortest"
    divisions: int = DEFAULT_DIVISIONS
    vehicle: Vehicle = PAPER
    coefficients: Kind = "published"
    keep_out: tuple[tuple[Point, ...], ...] = ()
    keep_in: tuple[tuple[Point, ...], ...] = ()
    any_order: bool = False
    reverse: bool = False
    method: str = "exact"
    accuracy: float = 1e-6
    period: float = 1.0
    law: str = LAWS[0]
    floor: float = DEFAULT_FLOOR
    zones: Zones | None = None
    notes: tuple[str, ...] = ()

    def as_mapping(self) -> dict[str, Any]:
        """Return the request as plain values, under the names that a request file uses."""
        plain = {name: getattr(self, name) for name in REQUEST_FIELDS}
        plain |= {name: [[list(corner) for corner in polygon] for polygon in plain[name]] for name in _POLYGONS}
        return {**plain, "waypoints": [list(point) for point in self.waypoints], "vehicle": self.vehicle.as_mapping()}

    def cases(self) -> list[Case]:
        """Return the cases of color and sign of R that are asked for, R > 0 first."""
        coefficients = coefficients_of(self.vehicle, self.coefficients)
        return [
            Case(request=self, coefficients=coefficients, color=color, sign=sign)
            for sign in reversed(SIGNS)
            if self.sign in ("auto", sign)
            for color in COLORS
            if self.color in ("auto", color)
        ]


REQUEST_FIELDS = tuple(field.name for field in fields(PlanRequest))[:-2]
"""The names of the fields of a request, as files and Python use them."""
_POLYGONS = ("keep_out", "keep_in")


def request_of(waypoints: Points, **options: Any) -> PlanRequest:
    """Return a request, checked and complete; the options are those of :func:`gaitgraph.planning.planner.plan_loop`.

    Raises
    ------
    InputError
        If anything is malformed; the message names the field, the value and what it must be.

    Examples
    --------
    >>> request = request_of([("pi/8", "-pi/8"), ("pi/8", "-pi/8")], vehicle="paper")
    >>> len(request.waypoints), request.method, request.coefficients
    (1, 'exact', 'published')
    """
    for name in (name for name in options if name not in REQUEST_FIELDS):
        hint = did_you_mean(name, [*REQUEST_FIELDS, *_SAMPLING])
        raise InputError(f"{name}: no field of a request{hint or '; fields are ' + ', '.join(REQUEST_FIELDS)}")
    by_default = {name for name in ("divisions", "coefficients", "method") if options.get(name) is None}
    asked: dict[str, Any] = {field.name: field.default for field in fields(PlanRequest)}
    asked |= {name: value for name, value in options.items() if name not in by_default}
    if "method" in by_default:
        asked["method"] = "exact" if "divisions" in by_default else "grid"
    for name, choices in CHOICES.items():
        value = asked[name]
        if not isinstance(value, str) or value not in choices:
            hint = did_you_mean(value, list(choices)) if isinstance(value, str) else ""
            if (name, value) == ("objective", "thrust"):
                hint = "; for low thrusts use gaitgraph optimize --objective hover_reserve"
            raise InputError(f"{name} must be one of {', '.join(choices)}, got {shown(value)}{hint}")
    for name in ("any_order", "reverse"):
        if not isinstance(asked[name], bool):
            raise InputError(f"{name} must be true or false, got {shown(asked[name])}")
    asked["divisions"] = checked_divisions(asked["divisions"])
    checked_clock(asked["period"], asked["law"])
    if not 0 <= number_of(asked["floor"]) < math.inf:
        raise InputError(f"floor must be a finite number ≥ 0 (a singular value), got {shown(asked['floor'])}")
    if not 1e-9 <= number_of(asked["accuracy"]) <= 0.1:
        raise InputError(f"accuracy must be between 1e-9 and 0.1 rad, got {shown(asked['accuracy'])}")
    asked |= {name: float(asked[name]) for name in ("accuracy", "period", "floor")}
    vehicle = asked["vehicle"]
    if isinstance(vehicle, Mapping):
        vehicle = vehicle_from_mapping(dict(vehicle))
    elif isinstance(vehicle, (str, Path)):
        vehicle = vehicle_named(vehicle)
    elif not isinstance(vehicle, Vehicle):
        raise InputError(f"vehicle must be a preset's name, a .toml file or a table of constants, got {shown(vehicle)}")
    asked |= {"vehicle": vehicle, "coefficients": coefficients_of(vehicle, options.get("coefficients")).kind}

    points = checked_waypoints(waypoints)
    # A waypoint that equals the one before it is dropped, around the seam too.
    kept = [point for k, point in enumerate(points) if k == 0 or point != points[k - 1]]
    if len(kept) > 1 and kept[-1] == kept[0]:
        kept.pop()
    dropped = len(points) - len(kept)
    if dropped:
        asked["notes"] = (f"merged {dropped} waypoint{'s' * (dropped > 1)} that repeated the one before",)
    if any(not isinstance(asked[name], (list, tuple)) or asked[name] for name in _POLYGONS):
        zones = Zones(**{name: asked[name] for name in _POLYGONS})
        asked |= {"zones": zones, "keep_out": zones.keep_out, "keep_in": zones.keep_in}
    return PlanRequest(**{**asked, "waypoints": tuple(kept)})


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


@dataclass(frozen=True, slots=True, kw_only=True)
class Obstacle:
    """Why one color and sign of R has no loop: the certificate of a refusal.

    `kind` is "waypoint" if a waypoint has no root of this color and sign, or lies where the request forbids it: `R` is
    its value there, `nearest` (any-angle) the nearest (α1, α2) that is admissible [rad]. It is "separated" if two
    waypoints cannot be joined: on the grid `components` has how many nodes can be reached from each; and "color" if the
    color does not exist. `waypoints` are the numbers of those concerned, from 1.
    """

    color: str
    sign: str
    kind: Literal["waypoint", "separated", "color"]
    message: str
    waypoints: tuple[int, ...] = ()
    R: float | None = None
    components: tuple[int, ...] = ()
    nearest: Point | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One color and sign of R for which a request is answered; waypoints are counted from 0."""

    request: PlanRequest
    coefficients: Coefficients
    color: Color
    sign: Sign

    def __str__(self) -> str:
        return f"{self.color}, {RELATION[self.sign]}"

    @property
    def wanted(self) -> float:
        """The sign of R as +1 or −1."""
        return 1.0 if self.sign == "positive" else -1.0

    @property
    def _is_singular(self) -> bool:
        return self.color == "blue" and self.coefficients.kind == "exact"

    @property
    def _roots(self) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.bool_]]:
        """R of the roots above each waypoint, and whether they are of this color."""
        found = _roots_above(self.request.waypoints, self.coefficients)
        return found.R, found.sheet == (1 if self.color == "red" else -1)

    def rootless(self) -> list[int]:
        """Return the waypoints that have no root of this color and sign, or lie where polygons forbid it."""
        waypoints, zones = self.request.waypoints, self.request.zones
        if self._is_singular:
            return list(range(len(waypoints)))
        R, of_color = self._roots
        rooted = (of_color & (self.wanted * R > noise_of(self.coefficients))).any(axis=1)
        if zones is not None:
            rooted &= zones.allow_points(np.array(waypoints))
        return [int(k) for k in np.flatnonzero(~rooted)]

    def obstacle_at(self, k: int, why: str | None = None, R: float | None = None) -> Obstacle:
        """Return what is in the way at a waypoint, one of :meth:`rootless` if neither a reason nor R is given."""
        if self._is_singular:
            message = "blue: with exact coefficients R = 0 on the whole blue sheet, so the matrix is singular there"
            return Obstacle(color=self.color, sign=self.sign, kind="color", message=message, R=0.0)
        if why is None:
            values, of_color = (part[k] for part in self._roots)
            R = float(max(values[of_color], key=lambda value: self.wanted * value))
            if self.wanted * R > 0 and self.request.zones is not None:
                why = " lies where keep_out or keep_in forbids it"
            else:
                why = " has R = 0, the matrix is singular there" if abs(R) < 1e-9 else f" has R = {R:.4g}"
        first, second = self.request.waypoints[k]
        message = f"{self}: waypoint {k + 1} ({first:.4f}, {second:.4f}){why}"
        return Obstacle(color=self.color, sign=self.sign, kind="waypoint", message=message, waypoints=(k + 1,), R=R)

    def separation(self, ends: Sequence[int], otherwise: str, components: tuple[int, ...] = ()) -> Obstacle:
        """Return that two waypoints are separated by a factor of R, or by what `otherwise` names."""
        first, second = (self.request.waypoints[k] for k in ends)
        factor = separating_factor(first, second, self.request.vehicle) if self.color == "red" else None
        numbers = ends[0] + 1, ends[1] + 1
        return Obstacle(
            color=self.color,
            sign=self.sign,
            kind="separated",
            message=f"{self}: waypoints {numbers[0]} and {numbers[1]} are separated by {factor or otherwise}",
            waypoints=numbers,
            components=components,
        )


@lru_cache(maxsize=2)
def _roots_above(waypoints: tuple[Point, ...], coefficients: Coefficients) -> RootArrays:
    """Return the roots above waypoints; each color and sign of one request asks for them again."""
    plane = np.array(waypoints)
    return root_arrays(plane[:, 0], plane[:, 1], coefficients)


# --- requests in files -----------------------------------------------------------------------------------------------


def request_from_mapping(content: Mapping[str, Any]) -> tuple[PlanRequest, dict[str, Any]]:
    """Return the request that a mapping describes, and its sampling (samples, rate); InputError if a name is unknown.

    Examples
    --------
    >>> request, sampling = request_from_mapping({"waypoints": [["pi/8", "-pi/8"]], "samples": 50})
    >>> request.divisions, sampling
    (16, {'samples': 50})
    """
    # Requests of earlier versions state the sheets; "planes" is what there is.
    content = {name: value for name, value in content.items() if (name, value) != ("sheets", "planes")}
    if "sheets" in content:
        why = "since no gait on a fibre can fly: loops are planned on the red and the blue sheet"
        raise InputError(f"sheets: {shown(content['sheets'])}; no field any more, {why}")
    sampling = {name: content.pop(name) for name in _SAMPLING if name in content}
    return request_of(content.pop("waypoints", ()), **content), sampling


def read_request(path: str | Path, overrides: Mapping[str, Any]) -> tuple[PlanRequest, dict[str, Any]]:
    """Return the request in a TOML or JSON file, a saved plan or a gait file of any format, and its sampling.

    The overrides replace fields of the request, by their names. FileProblem or InputError if the file cannot be read,
    or holds no request.
    """
    content = stated_request(path)
    vehicle = content.get("vehicle")
    if isinstance(vehicle, str) and vehicle.lower().endswith(".toml") and "vehicle" not in overrides:
        content["vehicle"] = str(Path(path).parent / vehicle)
    if any(name in overrides for name in _SAMPLING):
        content = {name: value for name, value in content.items() if name not in _SAMPLING}
    with _named(Path(path)):
        return request_from_mapping({**content, **overrides})


def stated_request(path: str | Path) -> dict[str, Any]:
    """Return the fields that a file states, of those that :func:`read_request` reads, unchecked."""
    path = Path(path)
    suffix = path.suffix.lower()
    known = [".toml", *FORMATS]
    if suffix not in known:
        hint = did_you_mean(suffix, known)
        raise InputError(f"request file must end in one of {', '.join(known)}, got {str(path)!r}{hint}")
    if suffix not in (".toml", ".json"):
        about: Any = provenance_in(path)
    else:
        text = text_of(path, "request file", "TOML or JSON")
        with _named(path):
            content = table_from_toml(text) if suffix == ".toml" else _object_from_json(text)
        if "status" in content and isinstance(content.get("request"), dict):
            return dict(content["request"])  # a saved plan
        if not isinstance(content.get("columns"), dict):
            return content
        about = content.get("about")
    about = about if isinstance(about, dict) else {}
    if isinstance(about.get("request"), dict):
        return dict(about["request"])
    maker = about.get("made_by")
    why = f": {shown(maker)[1:-1]} made it, which plan does not repeat" if isinstance(maker, str) else ""
    with _named(path):
        raise InputError(
            f"it tells no request that made it{why}, so there is nothing to plan again: give a request, or "
            "the gait file of a planned gait"
        )


@contextmanager
def _named(path: Path) -> Iterator[None]:
    """Name the file in an error about what it holds."""
    try:
        yield
    except InputError as error:
        what = "request file" if path.suffix.lower() in (".toml", ".json") else "gait file"
        raise type(error)(f"{what} {str(path)!r}: {error}") from error


def _object_from_json(text: str) -> dict[str, Any]:
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
    if path.suffix.lower() != ".json":
        return path.suffix.lower() == ".toml"
    text = text_of(path, "file", "a gait table or a request")
    if '"waypoints"' not in text:
        return False
    try:
        content = _object_from_json(text)
    except InputError:
        return False  # reading it as a gait file says what is wrong
    return "waypoints" in content and not content.get("path") and "columns" not in content


def colorings_of_file(
    path: str | Path,
    *,
    sign: str | None = None,
    vehicle: Vehicle | None = None,
    coefficients: Kind | None = None,
    crossing_tolerance: float | None = None,
) -> Colorings:
    """Return every colouring of the loop in a gait table, a table of alpha1 and alpha2, a saved plan or a request.

    A last row that equals the first is the closing row. By default the vehicle, the coefficients and the sign are what
    the file states, and for a request the crossing tolerance is half a step of its grid; else they are those of
    :func:`gaitgraph.surface.loop_colorings.colorings`. InputError or FileProblem if the file holds no loop.
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
