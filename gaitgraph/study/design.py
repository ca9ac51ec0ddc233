"""The design of a study: its axes, vehicles and gaits, and its cases, each determined by its number.

A *grid* has every combination; the vehicle changes slowest, the pitch fastest. In a *random sample* the quantities of
a case are drawn by a generator that is seeded with the seed and the number of the case.
"""

from __future__ import annotations

import hashlib
import json
import math
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gaitgraph.angles import HALF_PI, angle_within, number_of, whole_number
from gaitgraph.errors import (
    GaitgraphError,
    InputError,
    check_fields,
    did_you_mean,
    reworded,
    shown,
)
from gaitgraph.files import from_toml_file, path_of
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
from gaitgraph.timing.laws import DEFAULT_LAW, LawName
from gaitgraph.vehicle import UNITS, Vehicle, vehicle_from_mapping, vehicle_named

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Mapping, Sequence

    from gaitgraph.gait.gait import Gait

MOST_CASES = 1_000_000

_INERTIA = ("inertia_x", "inertia_y", "inertia_z")
_SPEED = 20.0  # seconds of flight that a process flies in a second, for estimates
_MOST_OF_A_BATCH = 64
_BATCHES = 64
_REQUESTED = [
    name for name in REQUEST_FIELDS if name not in ("vehicle", "period")
]  # these two are axes of a study


def _period_of(value: Any) -> float:
    if not 1e-6 <= number_of(value) <= 1e6:
        raise InputError(
            f"periods must be between 1e-6 and 1e6 s, got {shown(value)}",
            field="periods",
        )
    return number_of(value)


# The four axes of every study, in the order of a grid: the default, and the function that checks a value.
_AXES: dict[str, tuple[float, Callable[[Any], float]]] = {
    "biases": (1.0, partial(checked_factor, "biases")),
    "periods": (1.0, _period_of),
    "roll": (0.0, lambda value: angle_within(value, "roll", math.pi)),
    "pitch": (
        0.0,
        lambda value: angle_within(value, "pitch", math.nextafter(HALF_PI, 0.0)),
    ),
}

FLIGHT = {
    "duration": "s", "settling_time": "s", "peak_tilt": "rad", "peak_thrust": "N", "peak_thrust_share": "1",
    "least_singular_value": "1", "saturated_fraction": "1", "energy": "J", "final_roll": "rad", "final_pitch": "rad",
    "drift": "m", "tracking_error": "m",
}  # fmt: skip
"""The columns of a flight in a study's rows, and their units."""

_GAIT = {
    "gait": "string", "eta": "1", "period": "s", "roll": "rad", "pitch": "rad", "outcome": "string",
    "reason": "string", "valid": "bool", "flyable": "bool", "reachable_from_hover": "bool",
    "gait_singular_value": "1", "gait_tilt_rate": "rad/s",
}  # fmt: skip


class Range(NamedTuple):
    """The range of a quantity of a random sample."""

    low: float
    high: float


Axis = tuple[Any, ...] | Range
"""The values of one quantity of a study, in order, or its range."""


def _drawn(axis: Axis, share: float) -> Any:
    """Return the value for a number drawn from [0, 1)."""
    if isinstance(axis, Range):
        return axis.low + share * (axis.high - axis.low)
    return axis[int(share * len(axis))]


def _plain(axis: Axis) -> Any:
    """Return an axis as JSON holds it."""
    if isinstance(axis, Range):
        return {"from": axis.low, "to": axis.high}
    return [list(value) if isinstance(value, tuple) else value for value in axis]


def _axis_of(
    content: Any, name: str, convert: Callable[[Any], Any], *, random: bool
) -> Axis:
    """Return the axis of an entry: a value, a list, or a table of ``from``, ``to`` (both included) and ``count``.

    In a `random` sample a table without ``count`` is a range.
    """
    if not isinstance(content, dict):
        values = tuple(
            map(convert, content if isinstance(content, list) else [content])
        )
        _check_distinct(values, name)
        return values
    check_fields(name, content, ("from", "to", "count"))
    low, high = (convert(content.get(key)) for key in ("from", "to"))
    if not (isinstance(low, float) and isinstance(high, float) and low < high):
        raise InputError(
            f"{name} must be a list, or a table with from below to, got {shown(content)}"
        )
    if "count" not in content and random:
        return Range(low, high)
    count = whole_number(f"{name}.count", content.get("count"), 2, MOST_CASES)
    return *(low + (high - low) * k / (count - 1) for k in range(count - 1)), high


def _check_distinct(values: Sequence[Hashable], name: str) -> None:
    """Raise InputError if there are no values or one is repeated."""
    if not 0 < len(set(values)) == len(values):
        raise InputError(
            f"{name} must be different values, one at least, got {shown(list(values))}"
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Model:
    """A vehicle of a study, with the first value of each constant that varies, and the axes of those constants."""

    base: Vehicle
    varied: Mapping[str, Axis] = field(default_factory=dict)

    def __len__(self) -> int:
        return math.prod(len(axis) for axis in self.varied.values())


def _model_of(entry: Any, folder: Path, random: bool) -> Model:
    """Return the vehicle of an entry: a preset, a file, or a table of constants in which lists and ranges vary."""
    constants = (
        {"file" if entry.lower().endswith(".toml") else "preset": entry}
        if isinstance(entry, str)
        else entry
    )
    if not isinstance(constants, dict):
        raise InputError(
            f"it must be a preset, a .toml file or a table of constants, got {shown(entry)}"
        )
    constants, varied = dict[str, Any](constants), {}
    for name, value in list(constants.items()):
        # Three plain numbers are one inertia; a list of such lists varies it. Linkages do not vary.
        one = (
            name == "inertia"
            and isinstance(value, list)
            and value
            and not isinstance(value[0], list)
        )
        one = one or name in ("linkage", "rotor_positions")
        if name != "name" and isinstance(value, (list, dict)) and not one:
            varied[name] = constants.pop(name)
    file = constants.pop("file", None)
    base = None if file is None else vehicle_named(str(folder / file))
    if varied and "name" not in constants:
        origin = constants.get("preset", "vehicle") if base is None else base.name
        constants["name"] = (
            f"{origin}, {', '.join(name.replace('_', ' ') for name in varied)} varied"
        )
    for name, value in varied.items():
        constants[name] = (
            value.get("from") if isinstance(value, dict) else next(iter(value), None)
        )
    start = (
        vehicle_from_mapping(constants) if base is None else base.replace(**constants)
    )

    def checked(name: str, value: Any) -> Any:
        if name != "inertia" and isinstance(value, list):
            remedy = "a vehicle with one for each arm is a .toml file"
            raise InputError(
                f"{name} must be a list of numbers, which vary it, got {shown(value)} in it; {remedy}"
            )
        return getattr(start.replace(**{name: value}), name)

    axes = {
        name: _axis_of(value, name, partial(checked, name), random=random)
        for name, value in varied.items()
    }
    return Model(base=start, varied=axes)


@dataclass(frozen=True, slots=True, kw_only=True)
class GaitSource:
    """One entry of a study's gaits, from which the gait of each vehicle is made."""

    name: str
    kind: str  # "paper", a gait of the paper; "request", planned for each vehicle; or "corners", of a file
    content: Mapping[
        str, Any
    ]  # the number, the fields of the request, or the columns; plain values
    law: LawName = DEFAULT_LAW

    def gait(self, vehicle: Vehicle) -> Gait:
        """Return the gait for a vehicle; Infeasible with the plan's reason if there is none."""
        if self.kind == "paper":
            return gait_of(f"gait{self.content['number']}", vehicle=vehicle)
        if self.kind == "request":
            content = {
                "require": "valid",
                **self.content,
                "law": self.law,
                "vehicle": vehicle,
            }
            return plan(request_from_mapping(content)[0]).gait
        return gait_of(dict(self.content), vehicle=vehicle)


def _source_of(entry: Any, number: int, folder: Path) -> GaitSource:
    """Return the source of an entry: a gait of the paper, a gait or request file, or a table of a request."""
    values = {"file": entry} if isinstance(entry, str) else entry
    has_file = isinstance(values, dict) and "file" in values
    check_fields("it", values, ["name", "file"] if has_file else ["name", *_REQUESTED])
    file = values.get("file")
    name = values.get(
        "name", f"gait {number}" if file is None else Path(str(file)).stem
    )
    if not isinstance(name, str) or not name or not isinstance(file, str | None):
        raise InputError(
            f"name and file must be texts, got {shown(name)} and {shown(file)}"
        )
    if file is None:  # checked for the paper's vehicle
        request = request_from_mapping(
            {key: value for key, value in values.items() if key != "name"}
        )[0]
        plain = request.as_mapping() | {
            "waypoints": [list(point) for point in request.waypoints]
        }
        content = {key: plain[key] for key in values if key not in ("name", "law")}
        return GaitSource(name=name, kind="request", content=content, law=request.law)
    if file in PAPER_GAITS:
        return GaitSource(
            name=name, kind="paper", content={"number": PAPER_GAITS[file]}
        )
    path = folder / file
    if not path.suffix:
        hint = did_you_mean(file, list(PAPER_GAITS))
        raise InputError(
            f"file must be {', '.join(PAPER_GAITS)} or the name of a file, got {shown(file)}{hint}"
        )
    if holds_request(path):
        plain = read_request(path, {})[0].as_mapping()
        content = {
            key: plain[key] for key in _REQUESTED if key not in ("coefficients", "law")
        }
        return GaitSource(name=name, kind="request", content=content, law=plain["law"])
    table = read_table(path)
    gait, is_whole = gait_of(table), "alpha3" in table
    # The corners of a gait; or the rows of alpha1, alpha2 and color, to be lifted for each vehicle.
    columns = (
        gait.alpha.T.tolist()
        if is_whole
        else [table[name].tolist() for name in ANGLES[:2]]
    )
    colors = list(gait.colors if is_whole else table["color"])
    content = dict(zip(ANGLES, columns, strict=False)) | (
        {"color": colors} if colors else {}
    )
    return GaitSource(name=name, kind="corners", content=content)


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
        return (
            self.model.base.replace(**self.varied) if self.varied else self.model.base
        )

    def known(self) -> dict[str, Any]:
        """Return the columns of the case that do not depend on its flight."""
        varied = dict(self.varied)
        varied |= zip(_INERTIA, varied.pop("inertia", ()), strict=False)
        own = {
            "eta": self.bias,
            "period": self.period,
            "roll": self.roll,
            "pitch": self.pitch,
        }
        return (
            {
                "case": self.number,
                "vehicle": self.model.base.name,
                "gait": self.source.name,
            }
            | varied
            | own
        )


@dataclass(frozen=True, slots=True)
class Study:
    """A study; it holds the content of the files that it named.

    `models` and `sources` are the vehicles and the gaits. `axes` are those of η, T [s] and the initial roll and pitch
    [rad]. With `anyway` gaits fly that would be refused. `count` and `seed` are those of a random sample, None for a
    grid.

    >>> study = study_from_mapping({"name": "two", "gaits": ["gait3"], "attitudes": {"roll": [0.1, 0.2]}})
    >>> len(study), study.case(1).roll, study.batches
    (2, 0.2, [range(0, 1), range(1, 2)])
    """

    name: str
    models: tuple[Model, ...]
    sources: tuple[GaitSource, ...]
    axes: tuple[Axis, ...]
    flight: FlightSettings
    anyway: bool
    count: int | None
    seed: int | None

    def __repr__(self) -> str:
        return f"<Study: {self.name!r}, cases: {len(self)}>"

    @property
    def _shape(self) -> tuple[int, ...]:
        return (
            sum(map(len, self.models)),
            len(self.sources),
            *(len(axis) for axis in self.axes),
        )

    def __len__(self) -> int:
        return math.prod(self._shape) if self.count is None else self.count

    @property
    def batch(self) -> int:
        """Number of cases that are flown and written together; it depends on the number of cases only."""
        return min(_MOST_OF_A_BATCH, math.ceil(len(self) / _BATCHES))

    @property
    def batches(self) -> list[range]:
        """The numbers of the cases of each batch; the last may be short."""
        count, size = len(self), self.batch
        return [
            range(first, min(first + size, count)) for first in range(0, count, size)
        ]

    def case(self, number: int) -> Case:
        """Return a case by its number, from 0."""
        if self.count is None:
            rest, gait, *places = map(int, np.unravel_index(number, self._shape))
            bias, period, roll, pitch = (
                axis[k] for axis, k in zip(self.axes, places, strict=True)
            )
            for model in self.models:
                if rest < len(model):
                    break
                rest -= len(model)
            at = np.unravel_index(rest, [len(axis) for axis in model.varied.values()])
            varied = {
                name: axis[int(k)]
                for (name, axis), k in zip(model.varied.items(), at, strict=True)
            }
        else:
            # The order of the draws is fixed, since later versions continue a stored study.
            bits = np.random.Philox(
                key=np.array([self.seed or 0, number], dtype=np.uint64)
            )
            draws = bits.random_raw(6 + max(len(model.varied) for model in self.models))
            shares = iter(((draws >> np.uint64(11)) * 2.0**-53).tolist())
            roll, pitch, period, bias = (
                _drawn(self.axes[k], next(shares)) for k in (2, 3, 1, 0)
            )
            gait = int(next(shares) * len(self.sources))
            model = self.models[int(next(shares) * len(self.models))]
            varied = {
                name: _drawn(axis, next(shares)) for name, axis in model.varied.items()
            }
        return Case(
            number, model, varied, self.sources[gait], bias, period, roll, pitch
        )

    @property
    def seconds(self) -> float:
        """Estimated time for one process, if each flight is flown to its end [s]."""
        periods = self.axes[1] if self.flight.duration is None else ()
        return float(len(self) * max([self.flight.seconds, *periods]) / _SPEED)

    def as_mapping(self) -> dict[str, Any]:
        """Return the study as plain values."""
        sample = (
            {"kind": "grid"}
            if self.count is None
            else {"kind": "random", "count": self.count, "seed": self.seed}
        )
        biases, periods, roll, pitch = map(_plain, self.axes)
        varied = [
            {name: _plain(axis) for name, axis in model.varied.items()}
            for model in self.models
        ]
        return {
            "name": self.name,
            "vehicles": [
                one.base.as_mapping() | {"vary": vary}
                for one, vary in zip(self.models, varied, strict=True)
            ],
            "gaits": [asdict(source) for source in self.sources],
            "biases": biases,
            "periods": periods,
            "attitudes": {"roll": roll, "pitch": pitch},
            "flight": self.flight.as_mapping(),
            "anyway": self.anyway,
            "sample": sample,
        }

    @property
    def fingerprint(self) -> str:
        """The SHA-256 of the study as JSON, in hexadecimal; equal studies have equal fingerprints."""
        return hashlib.sha256(
            json.dumps(self.as_mapping(), allow_nan=False).encode()
        ).hexdigest()

    def __str__(self) -> str:
        kind = "a grid" if self.count is None else f"drawn with seed {self.seed}"
        return f"Study {self.name}: {len(self)} cases, {kind}, in {len(self.batches)} batches"


def columns_of(study: Study) -> dict[str, str]:
    """Return the unit of each column of a study's rows, or its Arrow type (int64, string, bool) if it has no unit.

    A constant that varies in one of the vehicles has a column, empty for the others.
    """
    varied: dict[str, str] = {}
    for name in dict.fromkeys(
        name for model in study.models for name in model.varied if name != "drag_ratio"
    ):
        unit = {"first_arm_angle": "rad", "first_rotor_spin": "string"}.get(
            name
        ) or UNITS[name]
        varied |= dict.fromkeys(
            _INERTIA if name == "inertia" else (name,),
            unit.replace("²", "^2").replace("³", "^3"),
        )
    return (
        {"case": "int64", "vehicle": "string", "drag_ratio": "1"}
        | varied
        | _GAIT
        | FLIGHT
    )


def read_study(path: str | Path) -> Study:
    """Read a study from a TOML file, with names of files relative to it; InputError or FileProblem if it is none."""
    path = path_of(path, "study file")
    return from_toml_file(
        path,
        "study",
        lambda one: study_from_mapping({"name": path.stem, **one}, folder=path.parent),
    )


def study_from_mapping(content: dict[str, Any], *, folder: str | Path = ".") -> Study:
    """Return the study that a table describes.

    Parameters
    ----------
    content
        `name`; `vehicles`, by default the paper's; `gaits`; `biases` η in (0, 1], by default 1; `periods` [s], by
        default 1; `attitudes`, a table of `roll` and `pitch`, each by default 0; `flight`, settings by name; `sample`:
        "grid", the default, or a table of `kind`, `count` and `seed`; `anyway`, to fly gaits that would be refused.
    folder
        The folder of the files that it names.

    Raises
    ------
    InputError, FileProblem
        If anything is malformed, or there are more than a million cases.
    """
    known = (
        "name",
        "vehicles",
        "gaits",
        "biases",
        "periods",
        "attitudes",
        "flight",
        "sample",
        "anyway",
    )
    check_fields("the study", content, known)
    name, anyway, folder = (
        content.get("name"),
        content.get("anyway", False),
        Path(folder),
    )
    if not isinstance(name, str) or not name or not isinstance(anyway, bool):
        raise InputError(
            f"name must be a text and anyway true or false, got {shown(name)} and {shown(anyway)}"
        )
    sample = content.get("sample", "grid")
    sample = {"kind": sample} if isinstance(sample, str) else sample
    check_fields("sample", sample, ("kind", "count", "seed"))
    random = sample.get("kind", "random" if "count" in sample else "grid") == "random"
    if not random and sample not in ({}, {"kind": "grid"}):
        raise InputError(
            f"sample.kind must be grid, or random with a count and a seed, got {shown(sample)}"
        )
    count = (
        whole_number("sample.count", sample.get("count"), 1, MOST_CASES)
        if random
        else None
    )
    seed = (
        whole_number("sample.seed", sample.get("seed", 0), 0, (1 << 64) - 1)
        if random
        else None
    )

    def entries(
        key: str, default: Any, read: Callable[[Any, int], Any]
    ) -> tuple[Any, ...]:
        """Return the entries of a list, read; errors name the entry."""
        listed, found = content.get(key, default), []
        if not isinstance(listed, list) or not listed:
            raise InputError(
                f"{key} must be a list with at least one entry, got {shown(listed)}"
            )
        for number, entry in enumerate(listed, start=1):
            try:
                found.append(read(entry, number))
            except GaitgraphError as error:
                raise reworded(
                    error, f"{key[:-1]} {number}: {error.message}"
                ) from error
        return tuple(found)

    models = entries(
        "vehicles", ["paper"], lambda entry, _: _model_of(entry, folder, random)
    )
    _check_distinct([model.base.name for model in models], "names of vehicles")
    sources = entries(
        "gaits", None, lambda entry, number: _source_of(entry, number, folder)
    )
    _check_distinct([source.name for source in sources], "names of gaits")

    attitudes = content.get("attitudes", {})
    check_fields("attitudes", attitudes, ("roll", "pitch"))
    axes = tuple(
        _axis_of((content | attitudes).get(key, default), key, convert, random=random)
        for key, (default, convert) in _AXES.items()
    )
    flight = settings_from_mapping(content.get("flight", {}))
    study = Study(name, models, sources, axes, flight, anyway, count, seed)
    if len(study) > MOST_CASES:
        raise InputError(
            f"study {name!r} must have at most {MOST_CASES} cases, got {len(study)}"
        )
    return study
