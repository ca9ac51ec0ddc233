"""The design of a study: its axes, vehicles and gaits, and its cases, each determined by its number.

A *grid* has every combination; the vehicle changes slowest, the pitch fastest. In a *random sample* the quantities of
a case are drawn by a generator that is seeded with the seed and the number of the case.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gaitgraph.angles import HALF_PI, angle_within, number_of, whole_number
from gaitgraph.errors import (
    GaitgraphError,
    InputError,
    check_fields,
    reworded,
    shown,
    wrong,
)
from gaitgraph.files import from_toml_file, is_stream, path_of
from gaitgraph.flight.flight import FlightSettings, settings_from_mapping
from gaitgraph.gait.gait import PAPER_GAITS, checked_factor
from gaitgraph.gait.given import gait_of
from gaitgraph.gait.table import ANGLES
from gaitgraph.io.formats import holds_request, read_table
from gaitgraph.planning.planner import plan
from gaitgraph.planning.request import (
    REQUEST_FIELDS,
    read_request,
    request_from_mapping,
)
from gaitgraph.records import Record
from gaitgraph.timing.laws import DEFAULT_LAW, LawName
from gaitgraph.vehicle import UNITS, Vehicle, vehicle_from_mapping, vehicle_named

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Sequence

    from gaitgraph.gait.gait import Gait

MOST_CASES = 1_000_000

_INERTIA = ("inertia_x", "inertia_y", "inertia_z")
_SPEED = 20.0  # seconds of flight that a process flies in a second, for estimates
_MOST_OF_A_BATCH = 64
_BATCHES = 64
_FIELDS = (
    "name", "vehicles", "gaits", "biases", "periods", "attitudes", "flight", "sample", "anyway",
)  # fmt: skip
_REQUESTED = [
    name for name in REQUEST_FIELDS if name not in ("vehicle", "period")
]  # these two are axes of a study

FLIGHT = {
    "duration": "s", "settling_time": "s", "peak_tilt": "rad", "peak_thrust": "N", "peak_thrust_share": "1",
    "least_singular_value": "1", "saturated_fraction": "1", "energy": "J", "final_roll": "rad", "final_pitch": "rad",
    "drift": "m", "tracking_error": "m",
}  # fmt: skip
"""The columns of a flight in a study's rows, and their units."""

_GAIT = {
    "gait": "string", "uncertified": "string", "eta": "1", "period": "s", "roll": "rad", "pitch": "rad",
    "outcome": "string", "reason": "string", "valid": "bool", "flyable": "bool", "reachable_from_hover": "bool",
    "gait_singular_value": "1", "gait_tilt_rate": "rad/s",
}  # fmt: skip


class Range(NamedTuple):
    """The range of a quantity of a random sample."""

    low: float
    high: float


Axis = tuple[Any, ...] | Range
"""The values of one quantity of a study, in order, or its range."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Model(Record):
    """A vehicle of a study, with the first value of each constant that varies, and the axes of those constants."""

    base: Vehicle
    varied: Mapping[str, Axis] = field(default_factory=dict)

    def __len__(self) -> int:
        return math.prod(map(len, self.varied.values()))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GaitSource(Record):
    """One entry of a study's gaits, from which the gait of each vehicle is made.

    `content` is the name of a gait of the paper; the fields of a request, which is planned for each vehicle; or the
    columns of a file's corners. Plain values.
    """

    name: str
    content: str | Mapping[str, Any]
    law: LawName = DEFAULT_LAW

    def gait(self, vehicle: Vehicle) -> Gait:
        """Return the gait for a vehicle; Infeasible with the plan's reason if there is none."""
        if isinstance(self.content, str) or "waypoints" not in self.content:
            return gait_of(self.content, vehicle=vehicle)
        asked = {"require": "valid", **self.content}
        asked |= {"law": self.law, "vehicle": vehicle}
        return plan(request_from_mapping(asked)[0]).gait


@dataclass(frozen=True, slots=True)
class Case:
    """One case of a study; `varied` holds the values of the constants that vary in its vehicle. SI units, radians."""

    number: int
    model: Model
    varied: Mapping[str, Any]
    source: GaitSource
    bias: float
    period: float
    roll: float
    pitch: float

    @property
    def vehicle(self) -> Vehicle:
        """The vehicle; InputError if the constants that vary contradict each other."""
        return self.model.base.replace(**self.varied)

    def known(self) -> dict[str, Any]:
        """Return the columns of the case that do not depend on its flight."""
        varied = dict(self.varied)
        varied |= zip(_INERTIA, varied.pop("inertia", ()), strict=False)
        return {
            "case": self.number,
            "vehicle": self.model.base.name,
            **varied,
            "gait": self.source.name,
            "eta": self.bias,
            "period": self.period,
            "roll": self.roll,
            "pitch": self.pitch,
        }


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Study(Record):
    """A study; it holds the content of the files that it named.

    `models` and `sources` are the vehicles and the gaits. `bias` is the axis of η, `period` that of T [s], `roll` and
    `pitch` those of the initial attitude [rad]. With `anyway` gaits fly that would be refused. `count` and `seed` are those of a random
    sample, None for a grid.

    >>> study = study_from_mapping({"name": "two", "gaits": ["gait3"], "attitudes": {"roll": [0.1, 0.2]}})
    >>> len(study), study.case(1).roll, study.batches
    (2, 0.2, [range(0, 1), range(1, 2)])
    """

    name: str
    models: tuple[Model, ...]
    sources: tuple[GaitSource, ...]
    bias: Axis
    period: Axis
    roll: Axis
    pitch: Axis
    flight: FlightSettings
    anyway: bool
    count: int | None
    seed: int | None

    def __repr__(self) -> str:
        return f"<Study: {self.name!r}, cases: {len(self)}>"

    def __str__(self) -> str:
        kind = "a grid" if self.count is None else f"drawn with seed {self.seed}"
        return f"Study {self.name}: {len(self)} cases, {kind}, in {len(self.batches)} batches"

    @property
    def _shape(self) -> tuple[int, ...]:
        """How many vehicles, gaits, biases, periods, rolls and pitches the grid has."""
        axes = (self.sources, self.bias, self.period, self.roll, self.pitch)
        return (sum(map(len, self.models)), *map(len, axes))

    def __len__(self) -> int:
        if self.count is None:
            return math.prod(self._shape)
        return self.count

    @property
    def batches(self) -> list[range]:
        """The numbers of the cases that are flown and written together; they depend on the number of cases only."""
        count = len(self)
        size = min(_MOST_OF_A_BATCH, math.ceil(count / _BATCHES))
        return [range(k, min(k + size, count)) for k in range(0, count, size)]

    def case(self, number: int) -> Case:
        """Return a case by its number, from 0."""
        if self.count is None:
            return self._case_of_grid(number)
        return self._case_of_sample(number)

    def _case_of_grid(self, number: int) -> Case:
        vehicle, *places = np.unravel_index(number, self._shape)
        axes = (self.sources, self.bias, self.period, self.roll, self.pitch)
        chosen = [axis[place] for axis, place in zip(axes, places, strict=True)]
        for model in self.models:
            if vehicle < len(model):
                break
            vehicle -= len(model)
        shape = tuple(map(len, model.varied.values()))
        varied = {}
        for name, place in zip(
            model.varied, np.unravel_index(vehicle, shape), strict=True
        ):
            varied[name] = model.varied[name][place]
        return Case(number, model, varied, *chosen)

    def _case_of_sample(self, number: int) -> Case:
        # The order of the draws is fixed: the same seed and number give the same case.
        key = np.array([self.seed, number], dtype=np.uint64)
        most = max(len(model.varied) for model in self.models)
        bits = np.random.Philox(key=key).random_raw(6 + most)
        shares = iter(((bits >> np.uint64(11)) * 2.0**-53).tolist())

        def drawn(axis: Axis) -> Any:
            share = next(shares)
            if isinstance(axis, Range):
                return axis.low + share * (axis.high - axis.low)
            return axis[int(share * len(axis))]

        roll, pitch = drawn(self.roll), drawn(self.pitch)
        period, bias = drawn(self.period), drawn(self.bias)
        source, model = drawn(self.sources), drawn(self.models)
        varied = {name: drawn(axis) for name, axis in model.varied.items()}
        return Case(number, model, varied, source, bias, period, roll, pitch)

    @property
    def seconds(self) -> float:
        """Estimated time for one process, if each flight is flown to its end [s]."""
        longest = self.flight.seconds
        if self.flight.duration is None:
            longest = max(longest, *self.period)
        return float(len(self) * longest / _SPEED)

    def as_mapping(self) -> dict[str, Any]:
        """Return the study as plain values."""
        vehicles = []
        for model in self.models:
            varied = _plain_axes(model.varied)
            vehicles.append(model.base.as_mapping() | {"vary": varied})
        sample: Any = "grid"
        if self.count is not None:
            sample = {"kind": "random", "count": self.count, "seed": self.seed}
        return {
            "name": self.name,
            "vehicles": vehicles,
            "gaits": [asdict(source) for source in self.sources],
            **_plain_axes({"biases": self.bias, "periods": self.period}),
            "attitudes": _plain_axes({"roll": self.roll, "pitch": self.pitch}),
            "flight": self.flight.as_mapping(),
            "anyway": self.anyway,
            "sample": sample,
        }

    @property
    def fingerprint(self) -> str:
        """The SHA-256 of the study as JSON, in hexadecimal; equal studies have equal fingerprints."""
        text = json.dumps(self.as_mapping(), allow_nan=False)
        return hashlib.sha256(text.encode()).hexdigest()


def _plain_axes(axes: Mapping[str, Axis]) -> dict[str, Any]:
    """Return axes as JSON holds them."""
    plain: dict[str, Any] = {}
    for name, axis in axes.items():
        plain[name] = list(axis)
        if isinstance(axis, Range):
            plain[name] = {"from": axis.low, "to": axis.high}
    return plain


def columns_of(study: Study) -> dict[str, str]:
    """Return the unit of each column of a study's rows, or its Arrow type (int64, string, bool) if it has no unit.

    A constant that varies in one of the vehicles has a column, empty for the others.
    """
    units = UNITS | {"first_arm_angle": "rad", "first_rotor_spin": "string"}
    columns = {"case": "int64", "vehicle": "string", "drag_ratio": "1"}
    for model in study.models:
        for name in model.varied:
            unit = units[name].replace("²", "^2").replace("³", "^3")
            if name == "inertia":
                columns |= dict.fromkeys(_INERTIA, unit)
            elif name != "drag_ratio":
                columns[name] = unit
    return columns | _GAIT | FLIGHT


def read_study(path: str | Path | IO[Any]) -> Study:
    """Read a study from a TOML file, with names of files relative to it; InputError or FileProblem if it is none.

    In an open stream names of files are relative to the working folder.
    """
    if is_stream(path):
        return from_toml_file(path, "study", study_from_mapping)
    path = path_of(path, "study file")

    def make(content: dict[str, Any]) -> Study:
        return study_from_mapping({"name": path.stem, **content}, folder=path.parent)

    return from_toml_file(path, "study", make)


def study_from_mapping(content: dict[str, Any], *, folder: str | Path = ".") -> Study:
    """Return the study that a table describes.

    Parameters
    ----------
    content
        `name`, by default "study"; `vehicles`, by default the paper's; `gaits`; `biases` η in (0, 1], by default 1; `periods` [s], by
        default 1; `attitudes`, a table of `roll` and `pitch`, each by default 0; `flight`, settings by name; `sample`:
        "grid", the default, or a table of `kind`, `count` and `seed`; `anyway`, to fly gaits that would be refused.
    folder
        The folder of the files that it names.

    Raises
    ------
    InputError, FileProblem
        If anything is malformed, or there are more than a million cases.
    """
    check_fields("the study", content, _FIELDS)
    name, anyway = str(content.get("name", "study")), content.get("anyway", False)
    if not isinstance(anyway, bool):
        raise wrong("anyway", "must be true or false", anyway)
    count, seed = _sample_of(content.get("sample", "grid"))
    random = count is not None
    models = _entries(content, "vehicles", partial(_model_of, Path(folder), random))
    _check_distinct([model.base.name for model in models], "names of vehicles")
    sources = _entries(content, "gaits", partial(_source_of, Path(folder)))
    _check_distinct([source.name for source in sources], "names of gaits")
    attitudes = content.get("attitudes", {})
    check_fields("attitudes", attitudes, ("roll", "pitch"))
    stated = {"biases": 1.0, "periods": 1.0, "roll": 0.0, "pitch": 0.0}
    stated |= content | attitudes
    biases, periods, roll, pitch = (
        _axis_of(stated[name], name, checked, random=random)
        for name, checked in _CHECKED.items()
    )
    study = Study(
        name=name,
        models=models,
        sources=sources,
        bias=biases,
        period=periods,
        roll=roll,
        pitch=pitch,
        flight=settings_from_mapping(content.get("flight", {})),
        anyway=anyway,
        count=count,
        seed=seed,
    )
    if len(study) > MOST_CASES:
        raise InputError(
            f"study {name!r} must have at most {MOST_CASES} cases, got {len(study)}"
        )
    return study


def _sample_of(sample: Any) -> tuple[int | None, int | None]:
    """Return the count and the seed of a random sample, None for a grid."""
    if sample == "grid":
        return None, None
    check_fields("sample", sample, ("kind", "count", "seed"))
    if sample in ({}, {"kind": "grid"}):
        return None, None
    if sample.get("kind", "random") != "random" or "count" not in sample:
        raise InputError(
            f"sample.kind must be grid, or random with a count and a seed, got {shown(sample)}"
        )
    count = whole_number("sample.count", sample["count"], 1, MOST_CASES)
    return count, whole_number("sample.seed", sample.get("seed", 0), 0, (1 << 64) - 1)


def _entries(
    content: dict[str, Any], key: str, read: Callable[[Any, int], Any]
) -> tuple[Any, ...]:
    """Return the entries of a list, read; errors name the entry."""
    listed = content.get(key, ["paper"] if key == "vehicles" else None)
    if not isinstance(listed, list) or not listed:
        raise wrong(key, "must be a list with at least one entry", listed)
    entries = []
    for number, entry in enumerate(listed, start=1):
        try:
            entries.append(read(entry, number))
        except GaitgraphError as error:
            text = f"{key[:-1]} {number}: {error.message}"
            raise reworded(error, text) from error
    return tuple(entries)


def _check_distinct(values: Sequence[Hashable], name: str) -> None:
    """Raise InputError if there are no values or one is repeated."""
    if not 0 < len(set(values)) == len(values):
        raise wrong(
            name, "must have at least one value, and no value twice", list(values)
        )


def _axis_of(
    content: Any, name: str, checked: Callable[[Any], Any], *, random: bool
) -> Axis:
    """Return the axis of an entry: a value, a list, or a table of ``from``, ``to`` (both included) and ``count``.

    In a `random` sample a table without ``count`` is a range.
    """
    if not isinstance(content, dict):
        listed = content if isinstance(content, list) else [content]
        values = tuple(map(checked, listed))
        _check_distinct(values, name)
        return values
    check_fields(name, content, ("from", "to", "count"))
    low, high = (checked(content.get(key)) for key in ("from", "to"))
    if not (isinstance(low, float) and isinstance(high, float) and low < high):
        raise wrong(name, "must be a list, or a table with from below to", content)
    if "count" not in content and random:
        return Range(low, high)
    count = whole_number(f"{name}.count", content.get("count"), 2, MOST_CASES)
    return tuple(np.linspace(low, high, count).tolist())


def _period_of(value: Any) -> float:
    period = number_of(value)
    if not 1e-6 <= period <= 1e6:
        raise wrong("periods", "must be between 1e-6 and 1e6 s", value)
    return period


# The four axes of every study, each with the function that checks a value.
_CHECKED: dict[str, Callable[[Any], float]] = {
    "biases": partial(checked_factor, "biases"),
    "periods": _period_of,
    "roll": lambda value: angle_within(value, "roll", math.pi),
    "pitch": lambda value: angle_within(value, "pitch", math.nextafter(HALF_PI, 0.0)),
}


def _model_of(folder: Path, random: bool, entry: Any, _: int) -> Model:
    """Return the vehicle of an entry: a preset, a file, or a table of constants in which lists and ranges vary."""
    if isinstance(entry, str):
        entry = {"file" if entry.lower().endswith(".toml") else "preset": entry}
    if not isinstance(entry, dict):
        raise wrong(
            "it", "must be a preset, a .toml file or a table of constants", entry
        )
    stated = {name: value for name, value in entry.items() if _varies(name, value)}
    constants = {name: entry[name] for name in entry if name not in stated}
    file = constants.pop("file", None)
    base = None
    if file is not None:
        base = vehicle_named(str(folder / file))
    if stated and "name" not in constants:
        origin = constants.get("preset", "vehicle") if base is None else base.name
        names = ", ".join(stated).replace("_", " ")
        constants["name"] = f"{origin}, {names} varied"
    for name, axis in stated.items():
        constants[name] = _first_of(axis)
    if base is None:
        base = vehicle_from_mapping(constants)
    else:
        base = base.replace(**constants)

    def checked(name: str, value: Any) -> Any:
        if name != "inertia" and isinstance(value, list):
            remedy = "a vehicle with one for each arm is a .toml file"
            raise wrong(
                name,
                "must be a list of numbers, which vary it",
                value,
                f" in it; {remedy}",
            )
        return getattr(base.replace(**{name: value}), name)

    varied = {}
    for name, axis in stated.items():
        varied[name] = _axis_of(axis, name, partial(checked, name), random=random)
    return Model(base=base, varied=varied)


def _first_of(axis: Any) -> Any:
    """Return the first value of an axis as it is stated, None if there is none."""
    if isinstance(axis, dict):
        return axis.get("from")
    return next(iter(axis), None)


def _varies(name: str, value: Any) -> bool:
    """Return whether a value of a vehicle's table is an axis; three plain numbers are one inertia."""
    if name in (
        "name",
        "linkage",
        "rotor_positions",
        "tilt_axes",
        "thrust_axes",
        "spins",
    ):
        return False
    if name == "inertia" and isinstance(value, list):
        return not value or isinstance(value[0], list)
    return isinstance(value, (list, dict))


def _source_of(folder: Path, entry: Any, number: int) -> GaitSource:
    """Return the source of an entry: a gait of the paper, a gait or request file, or a table of a request."""
    stated = {"file": entry} if isinstance(entry, str) else entry
    if isinstance(stated, dict) and "file" in stated:
        check_fields("it", stated, ("name", "file"))
        file = str(stated["file"])
        return _source_of_file(str(stated.get("name", Path(file).stem)), folder, file)
    check_fields("it", stated, ("name", *_REQUESTED))
    fields = dict(stated)
    name = str(fields.pop("name", f"gait {number}"))
    request = request_from_mapping(fields)[0]  # checked for the paper's vehicle
    content = request.as_mapping()
    for key in content.keys() - fields.keys() | {"law"}:
        content.pop(key, None)
    return GaitSource(name=name, content=content, law=request.law)


def _source_of_file(name: str, folder: Path, file: str) -> GaitSource:
    if file in PAPER_GAITS:
        return GaitSource(name=name, content=file)
    path = folder / file
    if holds_request(path):
        content = read_request(path, {})[0].as_mapping()
        law = content.pop("law")
        for key in ("coefficients", "vehicle", "period"):
            content.pop(key, None)
        return GaitSource(name=name, content=content, law=law)
    table = read_table(path)
    gait = gait_of(table)
    if "alpha3" in table:
        columns = dict(zip(ANGLES, gait.alpha.T.tolist(), strict=True))
        colors = list(gait.colors)
    else:  # rows of alpha1, alpha2 and color are lifted for each vehicle
        columns = {key: table[key].tolist() for key in ANGLES[:2]}
        colors = list(table["color"])
    if colors:
        columns["color"] = colors
    return GaitSource(name=name, content=columns)
