"""What a study asks for: its axes, vehicles and gaits, and its cases, each known by its number alone.

On a *grid* a study has every combination, the vehicle changing slowest and the pitch fastest. A *random sample* draws
each quantity of a case by a generator that is keyed by the seed and the number of the case.
"""

from __future__ import annotations

import hashlib
import json
import math
import re
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gaitgraph.angles import HALF_PI, angle_from_text, number_of
from gaitgraph.errors import GaitgraphError, Infeasible, InputError, did_you_mean, shown
from gaitgraph.files import table_from_toml, text_of
from gaitgraph.flight.settings import FlightSettings, settings_from_mapping
from gaitgraph.gait.gait import PAPER_GAITS, paper_gait
from gaitgraph.invertibility.matrices import coefficients_of
from gaitgraph.io.reading import gait_of, read_table
from gaitgraph.planning.planner import plan
from gaitgraph.planning.request import REQUEST_FIELDS, holds_request, read_request, request_from_mapping
from gaitgraph.timing.timed_gait import LAWS
from gaitgraph.vehicle import Vehicle, vehicle_from_mapping, vehicle_named

if TYPE_CHECKING:
    from gaitgraph.gait.gait import Gait

MOST_CASES = 1_000_000

PACE = 20.0
"""Seconds of flight that one process is expected to fly in a second; only estimates use it."""

_MOST_OF_A_BATCH = 64
_BATCHES = 64
_REQUESTED = [name for name in REQUEST_FIELDS if name not in ("vehicle", "period")]  # the study's axes have these

Convert = Callable[[Any, str], Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Axis:
    """The values that one quantity takes in a study: `values` in their order, or a range `ends` to draw from.

    >>> Axis(values=(0.8, 1.0)).drawn(0.6), Axis(ends=(1.0, 2.0)).drawn(0.6)
    (1.0, 1.6)
    """

    values: tuple[Any, ...] = ()
    ends: tuple[float, float] | None = None

    def drawn(self, share: float) -> Any:
        """Return the value that a number drawn from [0, 1) stands for."""
        low, high = self.ends or (0.0, 0.0)
        return low + share * (high - low) if self.ends else self.values[int(share * len(self.values))]

    def as_mapping(self) -> Any:
        """Return the axis as plain values: a list, or a table of ``from`` and ``to``."""
        if self.ends is None:
            return [list(value) if isinstance(value, tuple) else value for value in self.values]
        return {"from": self.ends[0], "to": self.ends[1]}


def axis_of(content: Any, name: str, convert: Convert, *, random: bool) -> Axis:
    """Return the axis of an entry: a value, a list, or a table of ``from``, ``to`` (both included) and ``count``.

    `convert` reads a value. Where cases are drawn (`random`), a range without ``count`` is one to draw from.

    >>> axis_of({"from": 0, "to": "pi/2", "count": 3}, "roll", angle_from_text, random=False).values
    (0.0, 0.7853981633974483, 1.5707963267948966)
    """
    if not isinstance(content, dict):
        listed = list(content) if isinstance(content, (list, tuple)) else [content]
        if not listed:
            raise InputError(f"{name} must have at least one value, got []")
        values = tuple(convert(value, name) for value in listed)
        _check_distinct(values, name)
        return Axis(values=values)
    _check_keys(content, ("from", "to", "count"), name)
    for key in ("from", "to"):
        if key not in content:
            raise InputError(f"{name}.{key} is missing: a range has from and to")
    low, high = (convert(content[key], f"{name}.{key}") for key in ("from", "to"))
    if not (isinstance(low, float) and isinstance(high, float) and low < high):
        raise InputError(f"{name} must be a list or a rising range of numbers, got {shown(content)}")
    if "count" not in content and random:
        return Axis(ends=(low, high))
    count = _whole(content.get("count"), f"{name}.count", 2, MOST_CASES)
    return Axis(values=(*(low + (high - low) * k / (count - 1) for k in range(count - 1)), high))


def _check_keys(content: Any, known: Sequence[str], name: str) -> None:
    if not isinstance(content, dict):
        raise InputError(f"{name} must be a table of {', '.join(known)}, got {shown(content)}")
    for key in content:
        if key not in known:
            hint = did_you_mean(str(key), list(known)) or f"; allowed are {', '.join(known)}"
            raise InputError(f"{name} has no {str(key)!r}{hint}")


def _check_distinct(values: Sequence[Hashable], name: str) -> None:
    seen: set[Hashable] = set()
    for value in values:
        if value in seen:
            raise InputError(f"{name} must differ, got {shown(value)} twice")
        seen.add(value)


def _whole(value: Any, name: str, low: int, high: int) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise InputError(f"{name} must be a whole number from {low} to {high}, got {shown(value)}")
    return value


_RANGES: dict[str, tuple[str, Callable[[float], bool]]] = {
    "biases": ("above 0 and at most 1", lambda eta: 0 < eta <= 1),
    "periods": ("between 1e-6 and 1e6 s", lambda T: 1e-6 <= T <= 1e6),
    "roll": ("an angle from −π to π", lambda angle: abs(angle) <= math.pi),
    "pitch": ("an angle between −π/2 and π/2", lambda angle: abs(angle) < HALF_PI),
}


def _checked(value: Any, name: str) -> float:
    """Return the number or the angle that a value of an axis of :data:`_RANGES` means."""
    number = angle_from_text(value, name) if name.startswith("attitudes.") else number_of(value)
    what, allowed = _RANGES[name.removeprefix("attitudes.").partition(".")[0]]
    if not allowed(number):
        raise InputError(f"{name} must be {what}, got {shown(value)}")
    return number


@dataclass(frozen=True, slots=True, kw_only=True)
class Model:
    """A vehicle of a study, with the first value of each constant that varies, and the axes of those constants."""

    base: Vehicle
    varied: Mapping[str, Axis] = field(default_factory=dict)

    def __len__(self) -> int:
        return math.prod(len(axis.values) for axis in self.varied.values())

    def as_mapping(self) -> dict[str, Any]:
        """Return the entry as plain values."""
        return {**self.base.as_mapping(), "vary": {name: axis.as_mapping() for name, axis in self.varied.items()}}


def _model_of(entry: Any, place: str, folder: Path, random: bool) -> Model:
    """Return the vehicle of an entry: a preset, a file, or a table of constants in which lists and ranges vary."""
    constants = {"file" if entry.lower().endswith(".toml") else "preset": entry} if isinstance(entry, str) else entry
    if not isinstance(constants, dict):
        raise InputError(f"{place} must be a preset, a .toml file or a table of constants, got {shown(entry)}")
    constants = dict(constants)
    varied = constants.pop("vary", {})  # as Model.as_mapping writes them
    if not isinstance(varied, dict):
        raise InputError(f"{place} vary must be a table of constants, got {shown(varied)}")
    for name, value in list(constants.items()):
        # Three plain numbers are one inertia; a list of such lists varies it.
        one = name == "inertia" and isinstance(value, list) and not any(isinstance(part, list) for part in value)
        if name != "name" and isinstance(value, (list, dict)) and not (one and value):
            varied = {**varied, name: constants.pop(name)}
    first = {
        name: value.get("from") if isinstance(value, dict) else next(iter(value), None)
        for name, value in varied.items()
    }
    try:
        file = constants.pop("file", None)
        base = None if file is None else vehicle_named(str(folder / file))
        if varied and "name" not in constants:
            origin = constants.get("preset", "vehicle") if base is None else base.name
            constants["name"] = f"{origin}, {', '.join(name.replace('_', ' ') for name in varied)} varied"
        constants |= first
        start = vehicle_from_mapping(constants) if base is None else base.replace(**constants)

        def convert(value: Any, place: str) -> Any:
            name = place.partition(".")[0]
            return getattr(start.replace(**{name: value}), name)

        axes = {name: axis_of(value, name, convert, random=random) for name, value in varied.items()}
    except GaitgraphError as error:
        raise type(error)(f"{place}: {error}") from error
    return Model(base=start, varied=axes)


@dataclass(frozen=True, slots=True, kw_only=True)
class GaitSource:
    """One entry of a study's gaits: what makes the gait for a vehicle."""

    name: str
    kind: str  # "paper", a gait of the paper; "request", planned for each vehicle; or "corners", of a file
    content: Mapping[str, Any]  # the number, the fields of the request, or the columns; plain values
    law: str = LAWS[0]

    def gait(self, vehicle: Vehicle) -> Gait:
        """Return the gait for a vehicle; Infeasible with the plan's reason if there is none."""
        if self.kind == "paper":
            return paper_gait(self.content["number"], vehicle, coefficients_of(vehicle))
        if self.kind == "request":
            answer = plan(request_from_mapping({**self.content, "law": self.law, "vehicle": vehicle})[0])
            if answer.loop is None:
                raise Infeasible(answer.reason)
            return answer.gait
        return gait_of(dict(self.content), vehicle=vehicle)


def _source_of(entry: Any, place: str, folder: Path) -> GaitSource:
    """Return the source of an entry: a gait of the paper, a gait or request file, or a table of a request."""
    values = {"file": entry} if isinstance(entry, str) else entry
    if not isinstance(values, dict):
        raise InputError(f"{place} must be gait1 to gait4, a file or a table of a request, got {shown(entry)}")
    if set(values) == {"name", "kind", "content", "law"}:  # as Study.as_mapping writes it
        return GaitSource(**values)
    _check_keys(values, ["name", "file"] if "file" in values else ["name", *_REQUESTED], place)
    file = values.get("file", "")
    name = values.get("name", Path(file).stem if isinstance(file, str) and file else place)
    for text in (name, file or name):
        if not isinstance(text, str) or not text or not text.isprintable():
            raise InputError(f"{place} must have a printable name and file, got {shown(text)}")
    try:
        if not file:  # the request is checked here for the paper's vehicle
            request = request_from_mapping({key: values[key] for key in values if key != "name"})[0]
            plain = request.as_mapping()
            content = {key: plain[key] for key in values if key not in ("name", "law")}
            content["waypoints"] = [list(point) for point in request.waypoints]
            return GaitSource(name=name, kind="request", content=content, law=request.law)
        match = re.fullmatch(r"gait([1-4])", file)
        if match:
            return GaitSource(name=name, kind="paper", content={"number": int(match[1])})
        path = folder / file
        if not path.suffix:
            known = [f"gait{number}" for number in PAPER_GAITS]
            raise InputError(f"must be {', '.join(known)} or a file, got {shown(file)}{did_you_mean(file, known)}")
        if holds_request(path):
            plain = read_request(path, {})[0].as_mapping()
            content = {key: plain[key] for key in _REQUESTED if key not in ("coefficients", "law")}
            return GaitSource(name=name, kind="request", content=content, law=plain["law"])
        # The corners of a gait in a file, or its rows of alpha1, alpha2 and color.
        table = read_table(path)
        if "alpha3" in table:
            gait = gait_of(table)
            columns: dict[str, Any] = {f"alpha{k + 1}": gait.alpha[:, k].tolist() for k in range(4)}
            colors = list(gait.colors)
        else:
            columns = {key: table[key].tolist() for key in ("alpha1", "alpha2")}
            colors = list(table["color"])
    except GaitgraphError as error:
        raise type(error)(f"{place}: {error}") from error
    return GaitSource(name=name, kind="corners", content=columns | ({"color": colors} if colors else {}))


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One case of a study, with `number` from 0, bias `eta`, `period` [s] and initial `roll` and `pitch` [rad].

    `varied` holds the values of the constants that vary in the vehicle `model`.
    """

    number: int
    model: Model
    varied: Mapping[str, Any]
    source: GaitSource
    eta: float
    period: float
    roll: float
    pitch: float

    @property
    def vehicle(self) -> Vehicle:
        """The vehicle; InputError if the constants that vary contradict each other."""
        return self.model.base.replace(**self.varied) if self.varied else self.model.base


@dataclass(frozen=True, slots=True, kw_only=True)
class Study:
    """Everything that a study asks for; no file that it named is needed any more.

    Parameters
    ----------
    name
        What pages and messages call it.
    models, sources
        The vehicles and the gaits.
    biases, periods, roll, pitch
        Axes of η, T [s], and the initial attitude [rad].
    flight, anyway
        How every case is flown, and whether gaits that are refused before take-off are flown all the same.
    count, seed
        Of a random sample; None for a grid.

    Examples
    --------
    >>> study = study_from_mapping({"name": "two", "gaits": ["gait3"], "attitudes": {"roll": [0.1, 0.2]}})
    >>> len(study), study.case(1).roll, study.batches
    (2, 0.2, 2)
    """

    name: str
    models: tuple[Model, ...]
    sources: tuple[GaitSource, ...]
    biases: Axis
    periods: Axis
    roll: Axis
    pitch: Axis
    flight: FlightSettings
    anyway: bool = False
    count: int | None = None
    seed: int | None = None

    def __len__(self) -> int:
        if self.count is not None:
            return self.count
        axes = math.prod(len(axis.values) for axis in (self.biases, self.periods, self.roll, self.pitch))
        return sum(len(model) for model in self.models) * len(self.sources) * axes

    @property
    def batch(self) -> int:
        """How many cases are flown, and written, together; it follows from the number of cases alone."""
        return min(_MOST_OF_A_BATCH, math.ceil(len(self) / _BATCHES))

    @property
    def batches(self) -> int:
        """How many batches there are; the last may be short."""
        return math.ceil(len(self) / self.batch)

    def numbers(self, batch: int) -> range:
        """Return the numbers of the cases of a batch."""
        return range(batch * self.batch, min((batch + 1) * self.batch, len(self)))

    def case(self, number: int) -> Case:
        """Return a case by its number, from 0; InputError if there is no such case."""
        if not 0 <= number < len(self):
            raise InputError(f"case must be from 0 to {len(self) - 1}, got {shown(number)}")
        axes = {"pitch": self.pitch, "roll": self.roll, "period": self.periods, "eta": self.biases}
        varied: dict[str, Any] = {}
        if self.count is None:  # digits of the number, the pitch's the lowest
            rest, values = number, {}
            for name, axis in axes.items():
                rest, k = divmod(rest, len(axis.values))
                values[name] = axis.values[k]
            rest, k = divmod(rest, len(self.sources))
            source = self.sources[k]
            for model in self.models:
                if rest < len(model):
                    break
                rest -= len(model)
            for name, axis in reversed(tuple(model.varied.items())):
                rest, k = divmod(rest, len(axis.values))
                varied[name] = axis.values[k]
            varied = {name: varied[name] for name in model.varied}
        else:
            import numpy as np

            # A stored study is continued by later versions: the order of the draws is fixed.
            bits = np.random.Philox(key=np.array([self.seed or 0, number], dtype=np.uint64))
            draws = iter(bits.random_raw(6 + max(len(model.varied) for model in self.models)))
            shares = (int(draw >> np.uint64(11)) * 2.0**-53 for draw in draws)
            values = {name: axes[name].drawn(next(shares)) for name in ("roll", "pitch", "period", "eta")}
            source = self.sources[int(next(shares) * len(self.sources))]
            model = self.models[int(next(shares) * len(self.models))]
            varied = {name: axis.drawn(next(shares)) for name, axis in model.varied.items()}
        return Case(number=number, model=model, varied=varied, source=source, **values)

    def seconds(self, workers: int) -> float:
        """Return about how long the study takes on so many processes [s]."""
        return len(self) * self.flown_at_most / PACE / max(workers, 1)

    @property
    def flown_at_most(self) -> float:
        """How long the longest flight is [s]: a whole period where no duration is stated."""
        if self.flight.duration is not None:
            return self.flight.seconds
        return float(max(self.flight.seconds, *self.periods.values, *(self.periods.ends or ())))

    def as_mapping(self) -> dict[str, Any]:
        """Return the study as plain values, which :func:`study_from_mapping` reads back."""
        sample = {"kind": "grid"} if self.count is None else {"kind": "random", "count": self.count, "seed": self.seed}
        return {
            "name": self.name,
            "vehicles": [model.as_mapping() for model in self.models],
            "gaits": [asdict(source) for source in self.sources],
            "biases": self.biases.as_mapping(),
            "periods": self.periods.as_mapping(),
            "attitudes": {"roll": self.roll.as_mapping(), "pitch": self.pitch.as_mapping()},
            "flight": self.flight.as_mapping(),
            "anyway": self.anyway,
            "sample": sample,
        }

    @property
    def text(self) -> str:
        """The study as one line of JSON, the same for the same study."""
        return json.dumps(self.as_mapping(), allow_nan=False)

    @property
    def fingerprint(self) -> str:
        """The SHA-256 of :attr:`text`, in hexadecimal: two studies are the same if their fingerprints are."""
        return hashlib.sha256(self.text.encode()).hexdigest()

    def __str__(self) -> str:
        kind = "a grid" if self.count is None else f"drawn with seed {self.seed}"
        return f"Study {self.name}: {len(self)} cases, {kind}, in {self.batches} batches"


def read_study(path: str | Path) -> Study:
    """Read a study from a TOML file; files that it names are relative to it.

    Raises
    ------
    InputError, FileProblem
        If it is no study, or a file cannot be read; the message names file and field.
    """
    path = Path(path)
    if path.suffix.lower() != ".toml":
        raise InputError(f"study file must have the suffix .toml, got {str(path)!r}")
    text = text_of(path, "study file", "TOML")
    try:
        return study_from_mapping({"name": path.stem, **table_from_toml(text)}, folder=path.parent)
    except GaitgraphError as error:
        raise type(error)(f"study file {str(path)!r}: {error}") from error


def study_from_mapping(content: dict[str, Any], *, folder: str | Path = ".") -> Study:
    """Return the study that a table describes.

    Parameters
    ----------
    content
        `name`; `vehicles`, by default the paper's; `gaits`; `biases` η in (0, 1], by default 1; `periods` [s], by
        default 1; `attitudes`, a table of `roll` and `pitch`, each by default 0; `flight`, settings by name; `sample`:
        "grid", the default, or a table of `kind`, `count` and `seed`; `anyway`, to fly what is refused too.
    folder
        Where the files that it names are.

    Raises
    ------
    InputError, FileProblem
        If anything is malformed, or there are no cases or more than a million.
    """
    known = ("name", "vehicles", "gaits", "biases", "periods", "attitudes", "flight", "sample", "anyway")
    _check_keys(content, known, "the study")
    name, anyway, folder = content.get("name"), content.get("anyway", False), Path(folder)
    if not isinstance(name, str) or not name or not name.isprintable() or len(name) > 200:
        raise InputError(f"name must be a printable text of up to 200 letters, got {shown(name)}")
    if not isinstance(anyway, bool):
        raise InputError(f"anyway must be true or false, got {shown(anyway)}")
    attitudes = content.get("attitudes", {})
    _check_keys(attitudes, ("roll", "pitch"), "attitudes")
    vehicles, gaits = content.get("vehicles", ["paper"]), content.get("gaits")
    for place, entries in (("vehicles", vehicles), ("gaits", gaits)):
        if not isinstance(entries, list) or not entries:
            raise InputError(f"{place} must be a list with at least one entry, got {shown(entries)}")

    sample = content.get("sample", "grid")
    sample = {"kind": sample} if isinstance(sample, str) else sample
    _check_keys(sample, ("kind", "count", "seed"), "sample")
    kind = sample.get("kind", "random" if "count" in sample else "grid")
    if kind not in ("grid", "random"):
        raise InputError(f"sample.kind must be grid or random, got {shown(kind)}")
    random = kind == "random"
    if not random and len(sample) > 1:
        raise InputError(f"sample must have kind = 'random' to have a count or seed, got {shown(sample)}")
    count = _whole(sample.get("count"), "sample.count", 1, MOST_CASES) if random else None
    seed = _whole(sample.get("seed", 0), "sample.seed", 0, (1 << 64) - 1) if random else None

    models = tuple(_model_of(entry, f"vehicle {k}", folder, random) for k, entry in enumerate(vehicles, start=1))
    _check_distinct([model.base.name for model in models], "names of vehicles")
    sources = tuple(_source_of(entry, f"gait {k}", folder) for k, entry in enumerate(gaits or (), start=1))
    _check_distinct([source.name for source in sources], "names of gaits")
    try:
        flight = settings_from_mapping(content.get("flight", {}))
    except InputError as error:
        raise type(error)(f"flight: {str(error).removeprefix('flight: ')}") from error
    study = Study(
        name=name,
        models=models,
        sources=sources,
        biases=axis_of(content.get("biases", 1.0), "biases", _checked, random=random),
        periods=axis_of(content.get("periods", 1.0), "periods", _checked, random=random),
        roll=axis_of(attitudes.get("roll", 0.0), "attitudes.roll", _checked, random=random),
        pitch=axis_of(attitudes.get("pitch", 0.0), "attitudes.pitch", _checked, random=random),
        flight=flight,
        anyway=anyway,
        count=count,
        seed=seed,
    )
    if len(study) > MOST_CASES:
        raise InputError(f"study {name!r} must have at most {MOST_CASES} cases, got {len(study)}")
    return study
