"""Requests as files: what `gaitgraph plan` reads, in TOML or JSON, with the names of PlanRequest.

A minimal file::

    waypoints = [["3pi/8", "-3pi/8"], ["3pi/8", "-pi/8"], ["pi/8", "-pi/8"], ["pi/8", "-3pi/8"]]

`vehicle` is a preset's name, a TOML file (relative to the request), or a table of constants. `samples` or `rate`
say how the gait table is sampled.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from gaitgraph.errors import FileProblem, InputError, did_you_mean
from gaitgraph.planning import PlanRequest
from gaitgraph.vehicle import vehicle_from_mapping

__all__ = ["read_request", "request_from_mapping"]

_SAMPLING = ("samples", "rate")


def _names() -> list[str]:
    return [name for name in PlanRequest.__slots__ if name not in ("zones", "notes")]


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
    known = _names()
    for name in content:
        if name not in known:
            hint = did_you_mean(name, [*known, *_SAMPLING])
            raise InputError(f"{name}: no field of a request{hint or '; allowed are ' + ', '.join(known)}")
    if "waypoints" not in content:
        raise InputError("waypoints: missing; allowed is a list of [alpha1, alpha2], at least one")
    vehicle = content.get("vehicle")
    if isinstance(vehicle, dict):
        content["vehicle"] = vehicle_from_mapping(vehicle)
    elif vehicle is not None and not isinstance(vehicle, str):
        raise InputError(f"vehicle: {vehicle!r}; allowed is a preset's name, a .toml file or a table of constants")
    return PlanRequest(**content), sampling


def read_request(path: str | Path, overrides: dict[str, Any]) -> tuple[PlanRequest, dict[str, Any]]:
    """Read a request file; overrides replace what it says.

    A plan saved as JSON is read too: its request is planned again.

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
        raise InputError(f"request file: {str(path)!r}; allowed are the suffixes .toml, .json")
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except OSError as error:
        raise FileProblem(f"request file: cannot read {str(path)!r}: {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        raise InputError(f"request file {str(path)!r}: not UTF-8 text; allowed is TOML or JSON") from error
    try:
        content = _parsed(text, suffix)
        if "status" in content and isinstance(content.get("request"), dict):
            content = content["request"]
        vehicle = content.get("vehicle")
        if isinstance(vehicle, str) and vehicle.lower().endswith(".toml") and "vehicle" not in overrides:
            content["vehicle"] = str(path.parent / vehicle)
        sampled = {name for name in _SAMPLING if name in overrides}
        if sampled:
            content = {name: value for name, value in content.items() if name not in _SAMPLING}
        return request_from_mapping({**content, **overrides})
    except InputError as error:
        raise type(error)(f"request file {str(path)!r}: {error}") from error


def _parsed(text: str, suffix: str) -> dict[str, Any]:
    try:
        if suffix == ".toml":
            import tomllib

            return tomllib.loads(text)
        import json

        content = json.loads(text)
    except RecursionError as error:
        raise InputError("it is nested too deeply; allowed is a table of fields") from error
    except ValueError as error:
        raise InputError(f"it is not {suffix[1:].upper()} ({str(error).splitlines()[0]})") from error
    if not isinstance(content, dict):
        raise InputError(f"it holds a {type(content).__name__}; allowed is an object of fields")
    return content
