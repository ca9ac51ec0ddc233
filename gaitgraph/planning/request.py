"""Requests for plans, from options and from TOML, JSON and gait files.

A minimal file::

    waypoints = [["3pi/8", "-3pi/8"], ["3pi/8", "-pi/8"], ["pi/8", "-pi/8"], ["pi/8", "-3pi/8"]]

`vehicle` is a preset's name, a TOML file (relative to the request), or a table of constants. `samples` or `rate`
say how the gait table is sampled.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np

from gaitgraph._lazy import cached_property
from gaitgraph.angles import checked_floor
from gaitgraph.errors import (
    InputError,
    check_fields,
    checked_choice,
    shown,
    wrong,
)
from gaitgraph.files import naming_file, table_from_toml, text_of
from gaitgraph.gait.gait import PAPER_GAITS
from gaitgraph.gait.given import gait_of
from gaitgraph.gait.table import (
    ANGLES,
    check_repeats,
    is_closed,
    surface_of,
    warn_of_ends,
)
from gaitgraph.graph.nodes import (
    DEFAULT_DIVISIONS,
    checked_divisions,
    checked_waypoints,
)
from gaitgraph.graph.walks import Weight, check_weight
from gaitgraph.invertibility.coefficients import Kind, coefficients_of
from gaitgraph.io.formats import (
    holds_request,
    object_from_json,
    read_format,
    unchecked_table,
)
from gaitgraph.records import Record
from gaitgraph.surface.loop_colorings import colorings
from gaitgraph.surface.region import (
    Corners,
    Points,
    Requirement,
    Zones,
    checked_accuracy,
)
from gaitgraph.surface.servo_regions import checked_servo_margin
from gaitgraph.surface.sheets import ColorChoice, SignChoice
from gaitgraph.timing.laws import DEFAULT_LAW, LawName
from gaitgraph.timing.timed_gait import checked_clock
from gaitgraph.tolerances import DEFAULT_FLOOR
from gaitgraph.vehicle import (
    PAPER,
    Vehicle,
    VehicleLike,
    vehicle_in_gait_file,
    vehicle_named,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gaitgraph.invertibility.coefficients import CoefficientsLike
    from gaitgraph.surface.loop_colorings import Colorings

Point = tuple[float, float]
Progress = Callable[[str], None]
"""Is called with a line of text before each step of long work."""
Objective = Literal["shortest", "robust"]
Method = Literal["grid", "exact"]

CHOICES: dict[str, tuple[str, ...]] = {
    "color": get_args(ColorChoice),
    "sign": get_args(SignChoice),
    "objective": get_args(Objective),
    "method": get_args(Method),
    "require": get_args(Requirement),
}
"""What fields that are names may be."""

_SAMPLING = ("samples", "rate")


@dataclass(frozen=True, kw_only=True, eq=False)
class PlanRequest(Record):
    """A complete request for a plan: the one list of its fields, with their defaults and checks.

    :func:`gaitgraph.planning.planner.plan_loop` says what each field means. Texts and files are read and waypoints that
    repeat in a row merged, so that a request holds each value in one form; InputError if a value is malformed.
    `coefficients` None are those of the vehicle. `merged` counts the waypoints that were left out. With a function as
    `weight` the request, and its plan, have no `as_dict`, and are pickled only if the function can be imported.
    """

    waypoints: tuple[Point, ...] = ()
    color: ColorChoice = "auto"
    sign: SignChoice = "auto"
    objective: Objective = "shortest"
    divisions: int = DEFAULT_DIVISIONS
    vehicle: Vehicle = PAPER
    coefficients: Kind | None = None
    keep_out: tuple[Corners, ...] = ()
    keep_in: tuple[Corners, ...] = ()
    any_order: bool = False
    reverse: bool = False
    method: Method = "exact"
    accuracy: float = 1e-6
    period: float = 1.0
    law: LawName = DEFAULT_LAW
    floor: float = DEFAULT_FLOOR
    require: Requirement = "flyable"
    servo_margin: float = 0.0
    weight: Weight | None = None
    merged: int = 0

    def __post_init__(self) -> None:
        checked_clock(self.period, self.law)
        vehicle = vehicle_named(self.vehicle)
        points = checked_waypoints(self.waypoints, least=0)
        groups = groups_of_repeats(points)
        zones = Zones(keep_out=self.keep_out, keep_in=self.keep_in)
        checked = {
            "waypoints": tuple(points[group[0]] for group in groups),
            "divisions": checked_divisions(self.divisions),
            "vehicle": vehicle,
            "coefficients": coefficients_of(vehicle, self.coefficients).kind,
            "keep_out": zones.keep_out,
            "keep_in": zones.keep_in,
            "accuracy": checked_accuracy(self.accuracy),
            "period": float(self.period),
            "floor": checked_floor(self.floor),
            "servo_margin": checked_servo_margin(self.servo_margin, self.require),
            "merged": self.merged + len(points) - len(groups),
        }
        for name, words in CHOICES.items():
            checked_choice(name, getattr(self, name), words)
        for name in ("any_order", "reverse"):
            flag = getattr(self, name)
            if not isinstance(flag, bool):
                raise wrong(name, "must be true or false", flag)
        check_weight(self.weight)
        if self.weight is not None and self.method != "grid":
            raise InputError(
                "weight must be left out unless the method is grid", field="weight"
            )
        for name, value in checked.items():
            object.__setattr__(self, name, value)  # the record is frozen
        _check_curved(self)

    @cached_property
    def zones(self) -> Zones | None:
        """The polygons, None if there are none."""
        if not self.keep_out and not self.keep_in:
            return None
        return Zones(keep_out=self.keep_out, keep_in=self.keep_in)

    @property
    def notes(self) -> tuple[str, ...]:
        """What was changed, which polygons have no effect, and what files do not hold."""
        notes = merge_notes(self.merged)
        if callable(self.weight):
            notes += ("weight is a function, which files of this plan do not hold",)
        if self.zones is not None:
            notes += self.zones.notes
        return notes

    def as_mapping(self) -> dict[str, Any]:
        """Return the request as plain values, under the names that a request file uses."""
        plain = {name: getattr(self, name) for name in REQUEST_FIELDS}
        # What is not asked for is not stated, nor a function.
        if not self.servo_margin:
            del plain["servo_margin"]
        if not isinstance(self.weight, str):
            del plain["weight"]
        plain["waypoints"] = [list(point) for point in self.waypoints]
        plain["vehicle"] = self.vehicle.as_mapping()
        for name in ("keep_out", "keep_in"):
            plain[name] = [list(map(list, polygon)) for polygon in plain[name]]
        return plain


REQUEST_FIELDS = {
    field.name: field.default for field in fields(PlanRequest) if field.name != "merged"
}
"""The fields of a request by name, as files and Python use them, with their defaults."""


def _check_curved(request: PlanRequest) -> None:
    """Raise InputError for a choice that needs planes, if the vehicle is not symmetric and its sheet is curved."""
    if request.vehicle.asymmetry is None:
        return
    only: dict[str, Any] = {"require": "flyable"}
    if request.method == "exact":
        only |= {"objective": "shortest", "servo_margin": 0.0}
    for name, value in only.items():
        asked = getattr(request, name)
        if asked != value:
            rule = f"must be {value!r} for a vehicle that is not symmetric"
            hint = "" if name == "require" else "; the method grid takes others"
            raise wrong(name, rule, asked, hint)


def plan_request(
    waypoints: Points,
    *,
    divisions: int | None = None,
    method: Method | None = None,
    **options: Any,
) -> PlanRequest:
    """Return the request for a plan through one or more waypoints; divisions or a weight ask for the grid.

    The other options are those of :func:`gaitgraph.planning.planner.plan_loop`; InputError if one is malformed.

    >>> request = plan_request([("pi/8", "-pi/8"), ("pi/8", "-pi/8")], vehicle="paper")
    >>> len(request.waypoints), request.method, request.coefficients
    (1, 'exact', 'published')
    """
    if method is None:
        on_grid = divisions is not None or options.get("weight") is not None
        method = "grid" if on_grid else "exact"
    if divisions is None:
        divisions = DEFAULT_DIVISIONS
    given: Any = waypoints
    request = PlanRequest(
        waypoints=given, divisions=divisions, method=method, **options
    )
    checked_waypoints(request.waypoints or waypoints)  # at least one
    return request


def groups_of_repeats(points: Sequence[Point]) -> list[list[int]]:
    """Return the indices of waypoints, those together that repeat the one before, around the seam too."""
    groups = [
        list(group) for _, group in groupby(range(len(points)), key=points.__getitem__)
    ]
    if len(groups) > 1 and points[-1] == points[0]:
        groups[0] += groups.pop()
    return groups


def merge_notes(merged: int) -> tuple[str, ...]:
    """Return the note that waypoints were merged, none if none were."""
    if not merged:
        return ()
    plural = "s" if merged > 1 else ""
    return (f"merged {merged} waypoint{plural} that repeated the one before",)


def request_from_mapping(
    content: Mapping[str, Any],
) -> tuple[PlanRequest, dict[str, Any]]:
    """Return the request that a mapping describes, and its sampling (samples, rate); InputError if a name is unknown.

    >>> request, sampling = request_from_mapping({"waypoints": [["pi/8", "-pi/8"]], "samples": 50})
    >>> request.divisions, sampling
    (16, {'samples': 50})
    """
    if not isinstance(content, Mapping):
        raise wrong("request", "must be a mapping of its fields", content)
    content = dict(content)
    sampling = {name: content.pop(name) for name in _SAMPLING if name in content}
    check_fields("request", content, [*REQUEST_FIELDS, *_SAMPLING])
    return plan_request(content.pop("waypoints", ()), **content), sampling


def read_request(
    path: str | Path, overrides: Mapping[str, Any]
) -> tuple[PlanRequest, dict[str, Any]]:
    """Return the request in a TOML or JSON file, a saved plan or a gait file of any format, and its sampling.

    The overrides replace fields of the request, by their names. FileProblem or InputError if the file cannot be read,
    or holds no request.
    """
    content = stated_request(path)
    vehicle = content.get("vehicle")
    if isinstance(vehicle, str) and vehicle.lower().endswith(".toml"):
        content["vehicle"] = str(Path(path).parent / vehicle)
    if any(name in overrides for name in _SAMPLING):
        for name in _SAMPLING:  # one of them is stated at most
            content.pop(name, None)
    try:
        return request_from_mapping({**content, **overrides})
    except InputError as error:
        if error.field is not None and error.field.partition(".")[0] in overrides:
            raise  # it is not the file that is wrong
        with naming_file(path, _kind_of_file(path)):
            raise


def stated_request(path: str | Path) -> dict[str, Any]:
    """Return the fields that a file states, of those that :func:`read_request` reads, unchecked."""
    path, what = Path(path), _kind_of_file(path)
    is_toml = path.suffix.lower() == ".toml"
    if not is_toml:
        read_format(path, "request file", also=(".toml",))
    with naming_file(path, what):
        if is_toml:
            return table_from_toml(text_of(path, what))
        if what == "gait file":
            about: Any = unchecked_table(path).about
        else:
            content = object_from_json(text_of(path, what))
            about = content.get("about")
            if "status" in content and isinstance(content.get("request"), dict):
                about = content  # a saved plan
            elif not isinstance(content.get("columns"), dict):
                return content
        if not isinstance(about, dict):
            about = {}
        request = about.get("request")
        if isinstance(request, dict):
            if "vehicle" in request:
                vehicle_in_gait_file(request["vehicle"])  # it is no other file
            return dict(request)
        maker = about.get("made_by")
        why = ""
        if isinstance(maker, str):
            why = f" (it was made by {shown(maker)[1:-1]})"
        raise InputError(
            f"the file must hold a request, as gait files of plan do, got none{why}"
        )


def _kind_of_file(path: str | Path) -> str:
    """Return what messages call a file."""
    if Path(path).suffix.lower() in (".toml", ".json"):
        return "request file"
    return "gait file"


def colorings_of_file(
    path: str | Path,
    *,
    sign: SignChoice | None = None,
    vehicle: VehicleLike | None = None,
    coefficients: CoefficientsLike | None = None,
    crossing_tolerance: float | None = None,
) -> Colorings:
    """Return every colouring of the loop in a gait file, a table of alpha1 and alpha2, a request, or gait1 to gait4.

    A last row that equals the first is the closing row. By default the vehicle, the coefficients and the sign are what
    the file states, and for a request the crossing tolerance is half a step of its grid; else they are those of
    :func:`gaitgraph.surface.loop_colorings.colorings`. InputError or FileProblem if the file holds no loop.
    """
    if holds_request(path):
        given = {"vehicle": vehicle, "coefficients": coefficients, "sign": sign}
        request, _ = read_request(
            path, {name: value for name, value in given.items() if value is not None}
        )
        points: Any = request.waypoints
        numbers = coefficients_of(request.vehicle, request.coefficients)
        sign = request.sign
        stated_tolerance = math.pi / (2 * request.divisions)
    elif str(path) in PAPER_GAITS:
        gait = gait_of(path, vehicle=vehicle, coefficients=coefficients)
        points = gait.alpha
        numbers = gait.coefficients
        stated_tolerance = gait.crossing_tolerance
    else:
        table = unchecked_table(path, plane_only=True)
        with naming_file(path):
            check_repeats(table, "loop")
            warn_of_ends(table, path)
            _, numbers, stated_tolerance = surface_of(table, vehicle, coefficients)
        points = np.column_stack([table["alpha1"], table["alpha2"]])
        # As in validate a row that comes back with some noise, or in another color, is a point of its own.
        rows = np.column_stack([table[name] for name in ANGLES if name in table])
        colors = table.columns.get("color", [None])
        if is_closed(rows) and colors[0] == colors[-1]:
            points = points[:-1]
    if crossing_tolerance is None:
        crossing_tolerance = stated_tolerance
    return colorings(
        points,
        sign=sign or "auto",
        coefficients=numbers,
        crossing_tolerance=crossing_tolerance,
    )
