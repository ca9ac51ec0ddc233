"""What a study is: its cases, counted before any is flown, each known by its number alone.

A study crosses vehicles, gaits, biases, periods and initial attitudes. On a *grid* it has every combination, the
vehicle running slowest and the pitch fastest. A *random sample* draws each quantity of each case by a generator that
is keyed by the seed and the number of the case: case 17 is the same whoever flies it, when, and however many there are.
"""

from __future__ import annotations

import hashlib
import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gaitgraph.errors import FileProblem, InputError, did_you_mean, shown
from gaitgraph.files import table_from_toml, text_of
from gaitgraph.flight.settings import FlightSettings, settings_from_mapping
from gaitgraph.study.axes import Axis, axis_of, pitch_of, real_of, roll_of
from gaitgraph.study.fleets import Model, models_of
from gaitgraph.study.sources import GaitSource, sources_of

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from gaitgraph.vehicle import Vehicle

__all__ = ["Case", "Study", "read_study", "study_from_mapping"]

MOST_CASES = 1_000_000
FREE_CASES = 10_000
FREE_SECONDS = 3600.0
"""More cases, or a longer estimate, are run only when asked for twice."""

PACE = 20.0
"""Seconds of flight that one process is expected to fly in a second; only estimates use it."""

_MOST_OF_A_BATCH = 64
_BATCHES = 64
_RESOLUTION = 2.0**-53
_NAMES = ("name", "vehicles", "gaits", "biases", "periods", "attitudes", "flight", "sample", "anyway")


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One case of a study.

    Parameters
    ----------
    number
        Counted from 0.
    model, varied
        The entry of the vehicles, and the values of what varies in it.
    source
        The entry of the gaits.
    eta
        The bias, 1 for the gait itself.
    period
        [s].
    roll, pitch
        The initial attitude [rad].
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
        return self.model.vehicle(self.varied)


@dataclass(frozen=True, slots=True, kw_only=True)
class Study:
    """Everything that a study asks for, resolved: no file is needed any more.

    Parameters
    ----------
    name
        What pages and messages call it.
    models, sources
        The vehicles and the gaits.
    biases, periods, roll, pitch
        Axes of η, T [s], and the initial attitude [rad].
    flight
        How every case is flown.
    anyway
        Whether gaits that are refused before take-off are flown all the same.
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
        axes = math.prod(len(axis) for axis in (self.biases, self.periods, self.roll, self.pitch))
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
        """Return a case by its number, from 0.

        Raises
        ------
        InputError
            If there is no such case.
        """
        if not 0 <= number < len(self):
            raise InputError(f"case: {shown(number)}; allowed is 0 to {len(self) - 1}")
        return self._listed(number) if self.count is None else self._drawn(number)

    def _listed(self, number: int) -> Case:
        rest, values = number, []
        for axis in (self.pitch, self.roll, self.periods, self.biases):
            rest, k = divmod(rest, len(axis))
            values.append(axis.values[k])
        rest, k = divmod(rest, len(self.sources))
        source = self.sources[k]
        for model in self.models:
            if rest < len(model):
                break
            rest -= len(model)
        pitch, roll, period, eta = values
        return Case(
            number=number, model=model, varied=model.listed(rest), source=source, eta=eta, period=period, roll=roll,
            pitch=pitch,
        )  # fmt: skip

    def _drawn(self, number: int) -> Case:
        shares = _shares(self.seed or 0, number, 6 + max(len(model.varied) for model in self.models))
        roll, pitch, period, eta = (
            axis.drawn(share)
            for axis, share in zip((self.roll, self.pitch, self.periods, self.biases), shares, strict=False)
        )
        source = self.sources[int(shares[4] * len(self.sources))]
        model = self.models[int(shares[5] * len(self.models))]
        varied = {
            name: axis.drawn(share) for (name, axis), share in zip(model.varied.items(), shares[6:], strict=False)
        }
        return Case(
            number=number, model=model, varied=varied, source=source, eta=eta, period=period, roll=roll, pitch=pitch
        )

    def seconds(self, workers: int) -> float:
        """Return about how long the study takes on so many processes [s]; no promise."""
        return len(self) * self.flown_at_most / PACE / max(workers, 1)

    @property
    def flown_at_most(self) -> float:
        """How long the longest flight is [s]: a whole period where no duration is stated."""
        seconds = self.flight.seconds
        return seconds if self.flight.duration is not None else max(seconds, *self.periods.extremes)

    def as_mapping(self) -> dict[str, Any]:
        """Return the study as plain values, which :func:`study_from_mapping` reads back."""
        sample = {"kind": "grid"} if self.count is None else {"kind": "random", "count": self.count, "seed": self.seed}
        return {
            "name": self.name,
            "vehicles": [model.as_mapping() for model in self.models],
            "gaits": [source.as_mapping() for source in self.sources],
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
        """What tells studies apart: the SHA-256 of :attr:`text`, in hexadecimal."""
        return hashlib.sha256(self.text.encode()).hexdigest()

    def __str__(self) -> str:
        kind = "a grid" if self.count is None else f"drawn with seed {self.seed}"
        return f"Study {self.name}: {len(self)} cases, {kind}, in {self.batches} batches"


def _shares(seed: int, number: int, count: int) -> Sequence[float]:
    """Return numbers in [0, 1) that depend on the seed and the number of the case alone."""
    import numpy as np

    raw = np.random.Philox(key=np.array([seed, number], dtype=np.uint64)).random_raw(count)
    return [int(one >> np.uint64(11)) * _RESOLUTION for one in raw]


def read_study(path: str | Path) -> Study:
    """Read a study from a TOML file; files that it names are relative to it.

    Raises
    ------
    FileProblem
        If a file cannot be read.
    InputError
        If it is no study; the message names file, field, value and what is allowed.
    """
    path = Path(path)
    if path.suffix.lower() != ".toml":
        hint = did_you_mean(path.suffix.lower(), [".toml"])
        raise InputError(f"study file: {str(path)!r}; allowed is the suffix .toml{hint}")
    text = text_of(path, "study file", "TOML")
    try:
        content = table_from_toml(text)
        return study_from_mapping({"name": path.stem, **content}, folder=path.parent)
    except (FileProblem, InputError) as error:
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
    if not isinstance(content, dict):
        raise InputError(f"study: {shown(content)}; allowed is a table")
    for key in content:
        if key not in _NAMES:
            hint = did_you_mean(str(key), list(_NAMES))
            raise InputError(f"{key}: no part of a study{hint or '; allowed are ' + ', '.join(_NAMES)}")
    name = content.get("name")
    if not isinstance(name, str) or not name or not name.isprintable() or len(name) > 200:
        raise InputError(f"name: {shown(name)}; allowed is a printable text of up to 200 letters")
    count, seed = _sample_of(content.get("sample", "grid"))
    random = count is not None
    if "gaits" not in content:
        raise InputError("gaits: missing; allowed is a list of gait1 to gait4, files and tables")
    attitudes = content.get("attitudes", {})
    if not isinstance(attitudes, dict):
        raise InputError(f"attitudes: {shown(attitudes)}; allowed is a table of roll and pitch")
    for key in attitudes:
        if key not in ("roll", "pitch"):
            hint = did_you_mean(str(key), ["roll", "pitch"])
            raise InputError(f"attitudes.{key}: no part of an attitude{hint or '; allowed are roll and pitch'}")
    anyway = content.get("anyway", False)
    if not isinstance(anyway, bool):
        raise InputError(f"anyway: {shown(anyway)}; allowed are true and false")
    folder = Path(folder)
    eta, period = real_of(0, 1, "dimensionless", low_included=False), real_of(1e-6, 1e6, "s")
    study = Study(
        name=name,
        models=models_of(content.get("vehicles", ["paper"]), folder, random=random),
        sources=sources_of(content["gaits"], folder),
        biases=axis_of(content.get("biases", 1.0), "biases", eta, random=random),
        periods=axis_of(content.get("periods", 1.0), "periods", period, random=random),
        roll=axis_of(attitudes.get("roll", 0.0), "attitudes.roll", roll_of, random=random),
        pitch=axis_of(attitudes.get("pitch", 0.0), "attitudes.pitch", pitch_of, random=random),
        flight=_flight_of(content.get("flight", {})),
        anyway=anyway,
        count=count,
        seed=seed,
    )
    if len(study) > MOST_CASES:
        raise InputError(f"study {name!r}: {len(study)} cases; allowed are {MOST_CASES} at most")
    return study


def _flight_of(content: Any) -> FlightSettings:
    try:
        return settings_from_mapping(content)
    except InputError as error:
        raise type(error)(f"flight: {str(error).removeprefix('flight: ')}") from error


def _sample_of(content: Any) -> tuple[int | None, int | None]:
    """Return the number of cases and the seed of a random sample; None twice for a grid."""
    if content == "random":
        raise InputError(
            "sample: 'random'; allowed is a table for it, which says how many: { kind = 'random', count = …, seed = … }"
        )
    table = {"kind": content} if isinstance(content, str) else content
    if not isinstance(table, dict):
        raise InputError(f"sample: {shown(content)}; allowed is 'grid', or a table of kind, count and seed")
    for key in table:
        if key not in ("kind", "count", "seed"):
            hint = did_you_mean(str(key), ["kind", "count", "seed"])
            raise InputError(f"sample.{key}: no part of a sample{hint or '; allowed are kind, count and seed'}")
    kind = table.get("kind", "random" if "count" in table else "grid")
    if kind not in ("grid", "random"):
        hint = did_you_mean(kind, ["grid", "random"]) if isinstance(kind, str) else ""
        raise InputError(f"sample.kind: {shown(kind)}; allowed are grid and random{hint}")
    if kind == "grid":
        for key in ("count", "seed"):
            if key in table:
                raise InputError(f"sample.{key}: {shown(table[key])}; allowed is with kind = 'random'")
        return None, None
    count, seed = table.get("count"), table.get("seed", 0)
    if isinstance(count, bool) or not isinstance(count, int) or not 1 <= count <= MOST_CASES:
        raise InputError(f"sample.count: {shown(count)}; allowed is a whole number from 1 to {MOST_CASES}")
    if isinstance(seed, bool) or not isinstance(seed, int) or not 0 <= seed < 1 << 64:
        raise InputError(f"sample.seed: {shown(seed)}; allowed is a whole number from 0 to {(1 << 64) - 1}")
    return count, seed
