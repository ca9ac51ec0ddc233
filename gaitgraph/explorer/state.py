"""What the page asks for: its state, an object of plain values, checked and turned into a request.

The state is the page's whole memory and comes back with every question, so it is taken for what anyone might send:
unknown names, wrong types, counts beyond :data:`LIMITS` and numbers outside :data:`RANGES` are refused, and a vehicle
is a preset's name, never a file.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from gaitgraph.angles import number_of
from gaitgraph.errors import InputError, did_you_mean, shown
from gaitgraph.planning.request import PlanRequest, request_of
from gaitgraph.timing.timed_gait import DEFAULT_SAMPLES, LAWS, checked_clock
from gaitgraph.vehicle import PAPER, Vehicle, preset_names, vehicle_from_mapping, vehicle_named

if TYPE_CHECKING:
    from collections.abc import Iterable

__all__ = [
    "DEFAULTS",
    "LIMITS",
    "RANGES",
    "Range",
    "State",
    "checked_choice",
    "checked_object",
    "state_of",
    "vehicle_of",
]

LIMITS: dict[str, int] = {
    "waypoints": 64,
    "polygons": 32,
    "corners": 64,
    "rows": 200_000,
    "table_bytes": 8 << 20,
    "request_bytes": 256 << 10,
}
"""How much the explorer takes at most; the library itself takes more."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Range:
    """What a number of the state may be.

    Parameters
    ----------
    low, high
        The ends, which are allowed themselves.
    whole
        Whether it is a whole number.
    above
        Whether `low` itself is not allowed.
    noun
        What a message calls it.
    """

    low: float
    high: float
    whole: bool = False
    above: bool = False
    noun: str = "a number"

    def holds(self, value: object) -> bool:
        """Return whether a value is one of these numbers."""
        number = number_of(value)
        if self.whole and not isinstance(value, int):
            return False
        return (self.low < number if self.above else self.low <= number) and number <= self.high

    @property
    def allowed(self) -> str:
        """What is allowed, in words.

        >>> Range(low=1e-5, high=0.1).allowed, Range(low=0, high=1, above=True).allowed
        ('a number from 1e-5 to 0.1', 'a number above 0, up to 1')
        """
        low, high = (f"{end:g}".replace("e-0", "e-").replace("e+0", "e") for end in (self.low, self.high))
        noun = "a whole number" if self.whole else self.noun
        return f"{noun} above {low}, up to {high}" if self.above else f"{noun} from {low} to {high}"


RANGES: dict[str, Range] = {
    "divisions": Range(low=2, high=64, whole=True),
    "drag_ratio": Range(low=0.02, high=1.0),
    "accuracy": Range(low=1e-5, high=0.1),
    "period": Range(low=1e-6, high=1e9, noun="a number of seconds"),
    "samples": Range(low=1, high=10_000, whole=True),
    "eta": Range(low=0.0, high=1.0, above=True),
}
"""What the numbers of a state may be; the library itself takes more divisions and samples, and a finer accuracy."""

DEFAULTS: dict[str, Any] = {
    "waypoints": [],
    "color": "auto",
    "sign": "auto",
    "objective": "shortest",
    "method": "exact",
    "divisions": 16,
    "any_order": False,
    "reverse": False,
    "keep_out": [],
    "keep_in": [],
    "vehicle": PAPER.name,
    "drag_ratio": None,
    "coefficients": None,
    "accuracy": 1e-4,
    "period": 1.0,
    "law": LAWS[0],
    "samples": DEFAULT_SAMPLES,
    "eta": 0.8,
}
"""The state of an empty page. Curved borders are followed less closely than elsewhere, so that dragging is smooth."""

_OF_THE_PAGE = "view"  # what the page alone needs stands under this name
_NOT_OF_A_REQUEST = ("drag_ratio", "samples", "eta")


@dataclass(frozen=True, slots=True, kw_only=True)
class State:
    """A checked state.

    Parameters
    ----------
    request
        What to plan; of a state without waypoints one that stands for its other fields, with the waypoint (0, 0).
    empty
        Whether there are no waypoints.
    samples
        Even intervals per period, of a table.
    eta
        η of the biased gait beside the planned one.
    key
        A text that two states share if and only if their plans are the same.
    """

    request: PlanRequest
    empty: bool
    samples: int
    eta: float
    key: str


def state_of(content: object) -> State:
    """Return the state that a JSON value describes.

    Parameters
    ----------
    content
        An object with any of the names of :data:`DEFAULTS`; what is missing has its default. ``view`` is passed over.

    Raises
    ------
    InputError
        If a name is unknown or a value is not allowed; the message names it, the value and what is allowed.

    Examples
    --------
    >>> state = state_of({"waypoints": [[1.178, -1.178]], "color": "red"})
    >>> state.empty, state.request.color, state.request.method
    (False, 'red', 'exact')
    """
    stated = checked_object(content, (*DEFAULTS, _OF_THE_PAGE))
    stated.pop(_OF_THE_PAGE, None)
    asked = DEFAULTS | stated
    _at_most("waypoints", asked["waypoints"], LIMITS["waypoints"])
    for name in ("keep_out", "keep_in"):
        _at_most(name, asked[name], LIMITS["polygons"])
        for number, polygon in enumerate(asked[name], start=1):
            _at_most(f"{name} polygon {number}", polygon, LIMITS["corners"], "corners")
    if asked["method"] == "exact":
        asked["divisions"] = DEFAULTS["divisions"]
    for name, allowed in RANGES.items():
        if name != "drag_ratio" and not allowed.holds(asked[name]):
            raise InputError(f"{name}: {shown(asked[name])}; allowed is {allowed.allowed}")
    samples = checked_clock(asked["period"], asked["law"], samples=asked["samples"])
    fields = {name: value for name, value in asked.items() if name not in _NOT_OF_A_REQUEST}
    fields["vehicle"] = vehicle_of(asked["vehicle"], asked["drag_ratio"])
    fields["coefficients"] = checked_choice("coefficients", asked["coefficients"], ("published", "exact", None))
    empty = not asked["waypoints"]
    request = request_of(**(fields | {"waypoints": [[0.0, 0.0]]} if empty else fields))
    key = "" if empty else json.dumps(request.as_mapping(), sort_keys=True)
    return State(request=request, empty=empty, samples=samples, eta=float(asked["eta"]), key=key)


def vehicle_of(preset: object, drag_ratio: object = None) -> Vehicle:
    """Return a preset, or a vehicle that differs from it by its drag ratio κ (and what contradicts that).

    >>> vehicle_of("paper", 0.3).drag_coefficient is None
    True
    """
    checked_choice("vehicle", preset, preset_names())
    vehicle = vehicle_named(str(preset))
    if drag_ratio is None or drag_ratio == vehicle.drag_ratio:
        return vehicle
    allowed = RANGES["drag_ratio"]
    if not allowed.holds(drag_ratio):
        raise InputError(f"drag_ratio: {shown(drag_ratio)}; allowed is {allowed.allowed}, or null for the preset's")
    return vehicle_from_mapping({"preset": preset, "drag_ratio": drag_ratio})


def checked_object(content: object, known: Iterable[str]) -> dict[str, Any]:
    """Return a copy of an object; InputError if it is none, or has a name that is not known."""
    names = list(known)
    if not isinstance(content, dict):
        raise InputError(f"request: {shown(content)}; allowed is an object with {', '.join(names)}")
    for name in content:
        if name not in names:
            hint = did_you_mean(name, names) or f"; allowed are {', '.join(names)}"
            raise InputError(f"{shown(name)}: no field of this request{hint}")
    return dict(content)


def checked_choice(name: str, value: object, allowed: Iterable[str | None]) -> Any:
    """Return a value that is one of a few; InputError otherwise."""
    choices = list(allowed)
    if (isinstance(value, str) or value is None) and value in choices:
        return value
    told = ", ".join("null" if choice is None else choice for choice in choices)
    texts = [choice for choice in choices if choice is not None]
    hint = did_you_mean(value, texts) if isinstance(value, str) else ""
    raise InputError(f"{name}: {shown(value)}; allowed are {told}{hint}")


def _at_most(name: str, value: object, most: int, noun: str = "") -> None:
    if not isinstance(value, list):
        raise InputError(f"{name}: {shown(value)}; allowed is a list")
    if len(value) > most:
        raise InputError(f"{name}: {len(value)} {noun or 'given'}; allowed are {most} at most")
