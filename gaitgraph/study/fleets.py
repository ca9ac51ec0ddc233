"""The vehicles of a study: presets, files, tables of constants, and constants that vary."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from math import prod
from typing import TYPE_CHECKING, Any

from gaitgraph.errors import InputError, did_you_mean, shown
from gaitgraph.study.axes import Axis, axis_of
from gaitgraph.vehicle import Vehicle, vehicle_from_mapping, vehicle_named

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

__all__ = ["Model", "columns_of_constant", "models_of"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Model:
    """One entry of a study's vehicles: a vehicle, and the constants of it that vary.

    Parameters
    ----------
    base
        The vehicle, with the first value of what varies; its name is that of the entry.
    varied
        The axis of each constant that varies, in the order of the entry.
    """

    base: Vehicle
    varied: Mapping[str, Axis] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """What rows call it."""
        return self.base.name

    def __len__(self) -> int:
        return prod(len(axis) for axis in self.varied.values())

    def listed(self, number: int) -> dict[str, Any]:
        """Return the values of the constants of variant `number`, the last constant running fastest."""
        values = {}
        for name, axis in reversed(tuple(self.varied.items())):
            number, k = divmod(number, len(axis))
            values[name] = axis.values[k]
        return {name: values[name] for name in self.varied}

    def vehicle(self, values: Mapping[str, Any]) -> Vehicle:
        """Return the vehicle with these values of what varies; InputError if they contradict each other."""
        return self.base.replace(**values) if values else self.base

    def as_mapping(self) -> dict[str, Any]:
        """Return the entry as plain values, read back by :func:`models_of`."""
        return {**self.base.as_mapping(), "vary": {name: axis.as_mapping() for name, axis in self.varied.items()}}


def columns_of_constant(name: str) -> tuple[str, ...]:
    """Return the columns that a constant has in the rows.

    >>> columns_of_constant("mass"), columns_of_constant("inertia")
    (('mass',), ('inertia_x', 'inertia_y', 'inertia_z'))
    """
    return ("inertia_x", "inertia_y", "inertia_z") if name == "inertia" else (name,)


def models_of(content: Any, folder: Path, *, random: bool) -> tuple[Model, ...]:
    """Return the vehicles that a study's entry describes.

    Parameters
    ----------
    content
        A list of names of presets, TOML files (relative to `folder`), or tables of constants, which may start from
        ``preset`` or ``file``. A constant that is a list, or a range of from, to and count, varies.
    folder
        Where the study is.
    random
        Whether cases are drawn.
    """
    if not isinstance(content, list) or not content:
        raise InputError(f"vehicles: {shown(content)}; allowed is a list of presets, files and tables, at least one")
    models = tuple(_model_of(entry, f"vehicle {k}", folder, random) for k, entry in enumerate(content, start=1))
    seen: set[str] = set()
    for model in models:
        if model.name in seen:
            raise InputError(f"vehicles: two are called {shown(model.name)}; allowed are names that differ (name = …)")
        seen.add(model.name)
    return models


def _model_of(entry: Any, told: str, folder: Path, random: bool) -> Model:
    if isinstance(entry, str):
        return Model(base=_named(entry, folder))
    if not isinstance(entry, dict):
        raise InputError(f"{told}: {shown(entry)}; allowed is a preset, a .toml file or a table of constants")
    constants, base = dict(entry), None
    more = constants.pop("vary", {})
    if not isinstance(more, dict):
        raise InputError(f"{told} vary: {shown(more)}; allowed is a table of constants and their values")
    file = constants.pop("file", None)
    if file is not None:
        if "preset" in constants or not isinstance(file, str):
            raise InputError(f"{told} file: {shown(file)}; allowed is a .toml file, and no preset beside it")
        base = _named(file, folder)
    # A list is one value only where the constant has three parts.
    varying = {name for name, value in constants.items() if _varies(name, value)}
    contents = {name: constants.pop(name) for name in entry if name in varying} | more
    try:
        return _varied(constants, base, contents, random)
    except InputError as error:
        raise type(error)(f"{told}: {error}") from error


def _named(name: str, folder: Path) -> Vehicle:
    return vehicle_named(str(folder / name) if name.lower().endswith(".toml") else name)


def _varies(name: str, value: Any) -> bool:
    if isinstance(value, dict):
        return True
    if name == "inertia" and isinstance(value, list):
        return not value or any(isinstance(part, (list, tuple)) for part in value)
    return isinstance(value, list)


def _varied(constants: dict[str, Any], base: Vehicle | None, contents: dict[str, Any], random: bool) -> Model:
    """Return the vehicle with what is the same in all its variants, and the axes of what is not."""
    known = [one.name for one in fields(Vehicle)]
    for name, value in contents.items():
        if name not in known or name == "name":
            hint = did_you_mean(name, known) if name != "name" else ""
            raise InputError(f"{name}: {shown(value)}; allowed are lists only of constants{hint}")
    first = {name: _first_of(value, name) for name, value in contents.items()}
    label = {} if "name" in constants or not contents else {"name": _label(constants, base, contents)}
    if base is None:
        base = vehicle_from_mapping({**constants, **first, **label})
    else:
        base = base.replace(**{**constants, **first, **label})
    start = base

    def convert(value: Any, name: str) -> Any:
        constant = name.partition(".")[0]
        return getattr(start.replace(**{constant: value}), constant)

    return Model(
        base=base,
        varied={name: axis_of(contents[name], name, convert, random=random) for name in contents},
    )


def _first_of(content: Any, name: str) -> Any:
    """Return the first value of what varies, with which the vehicle is made; the axis itself is read afterwards."""
    if isinstance(content, dict):
        if "from" not in content:
            raise InputError(f"{name}.from: missing; allowed is a range of from and to, or a list")
        return content["from"]
    if isinstance(content, (list, tuple)):
        if not content:
            raise InputError(f"{name}: [], which gives no case; allowed is at least one value")
        return content[0]
    return content


def _label(constants: dict[str, Any], base: Vehicle | None, contents: dict[str, Any]) -> str:
    origin = base.name if base is not None else str(constants.get("preset", "vehicle"))
    return f"{origin}, {', '.join(name.replace('_', ' ') for name in contents)} varied"
