"""The state of the page, checked: what it asks of the planner, within the limits of the explorer.

Input is not trusted. Unknown names, wrong types and numbers outside :data:`RANGES` raise InputError. A vehicle is the name of a preset or its constants, never a file.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any

from gaitgraph.angles import number_of
from gaitgraph.errors import (
    GaitgraphError,
    check_fields,
    wrong,
)
from gaitgraph.planning.request import REQUEST_FIELDS, PlanRequest
from gaitgraph.timing.timed_gait import DEFAULT_SAMPLES
from gaitgraph.tolerances import DEFAULT_FLOOR
from gaitgraph.vehicle import (
    PAPER,
    Vehicle,
    preset_names,
    vehicle_in_gait_file,
)


@dataclass(frozen=True, slots=True)
class Range:
    """The range of a number, also in words."""

    low: float
    high: float
    allowed: str
    whole: bool = False

    def contains(self, value: object) -> bool:
        """Return whether a value is a number in the range."""
        if self.whole and not isinstance(value, int):
            return False
        return self.low <= number_of(value) <= self.high


RANGES: dict[str, Range] = {
    "divisions": Range(2, 64, "a whole number from 2 to 64", whole=True),
    "drag_ratio": Range(0.02, 1.0, "a number from 0.02 to 1"),
    "accuracy": Range(1e-5, 0.1, "a number from 1e-5 to 0.1"),
    "period": Range(1e-6, 1e9, "a number of seconds from 1e-6 to 1e9"),
    "samples": Range(1, 10_000, "a whole number from 1 to 10000", whole=True),
    "eta": Range(0.01, 1.0, "a number from 0.01 to 1"),
}
"""The ranges of the numbers of a state; the library allows more divisions and samples, and a finer accuracy."""

DEFAULTS: dict[str, Any] = {
    **REQUEST_FIELDS,
    "waypoints": [],
    "keep_out": [],
    "keep_in": [],
    "vehicle": PAPER.name,
    "drag_ratio": None,
    "accuracy": 1e-4,  # coarser than in the library, so that dragging is smooth
    "samples": DEFAULT_SAMPLES,
    "eta": 0.8,
}
del DEFAULTS["floor"]  # which the page does not let choose
"""The state of an empty page."""


@dataclass(frozen=True, slots=True, kw_only=True)
class State:
    """A checked state."""

    request: PlanRequest  # the page may have no waypoints yet
    samples: int  # even intervals per period, of a table
    eta: float  # bias of the gait in the second roll–pitch diagram


def state_of(content: Any) -> State:
    """Return the state of an object with names of :data:`DEFAULTS`; missing names have their defaults.

    ``view`` is ignored. InputError if a name is unknown or a value is out of range.
    """
    check_fields("request", content, (*DEFAULTS, "view"))
    values = DEFAULTS | content
    values.pop("view", None)
    if values["method"] == "exact":
        values["divisions"] = DEFAULTS["divisions"]  # not used
    vehicle = vehicle_of(values["vehicle"], values.pop("drag_ratio"))
    for name in ("divisions", "accuracy", "period", "samples", "eta"):
        _check(name, values[name])
    samples, eta = values.pop("samples"), float(values.pop("eta"))
    request = PlanRequest(**values | {"vehicle": vehicle})
    return State(request=request, samples=samples, eta=eta)


def _check(name: str, value: object, also: str = "") -> None:
    """Raise InputError if a number is outside of its range."""
    allowed = RANGES[name]
    if not allowed.contains(value):
        raise wrong(name, f"must be {allowed.allowed}{also}", value)


def vehicle_of(stated: object, drag_ratio: object = None) -> Vehicle:
    """Return a preset by its name, or a vehicle of constants, with another drag ratio κ if one is given."""
    vehicle = vehicle_in_gait_file(stated)
    if drag_ratio is None or drag_ratio == vehicle.drag_ratio:
        return vehicle
    _check("drag_ratio", drag_ratio, ", or null for the preset")
    name = f"{vehicle.name}, changed"
    return vehicle.replace(name=name, drag_ratio=drag_ratio)


def fields_of(vehicle: Vehicle) -> dict[str, Any]:
    """Return the fields of a state that stand for a vehicle: a preset, with another drag ratio, or its constants."""
    ratios: list[float | None] = [None]
    if RANGES["drag_ratio"].contains(vehicle.drag_ratio):
        ratios.append(vehicle.drag_ratio)
    for name, ratio in product(preset_names(), ratios):
        if vehicle_of(name, ratio) == vehicle:
            return {"vehicle": name, "drag_ratio": ratio}
    return {"vehicle": vehicle.as_mapping(), "drag_ratio": None}


def state_of_request(
    request: object, samples: int | None = None
) -> dict[str, Any] | None:
    """Return the request that a file states as the content of a state; None if the page cannot show it."""
    if not isinstance(request, dict):
        return None
    if request.get("floor", DEFAULT_FLOOR) != DEFAULT_FLOOR:
        return None  # the page has no control for it
    state = {name: value for name, value in request.items() if name != "floor"}
    if RANGES["samples"].contains(samples):
        state["samples"] = samples
    if state.get("method") == "exact":
        state.pop("divisions", None)  # not used, and may be out of range here
    if "accuracy" in state:  # finer would be too slow for the page
        finest = RANGES["accuracy"].low
        state["accuracy"] = max(number_of(state["accuracy"]), finest)
    try:
        vehicle = vehicle_of(state.get("vehicle", DEFAULTS["vehicle"]))
        state |= fields_of(vehicle)
        state_of(state)
    except GaitgraphError:
        return None
    return state
