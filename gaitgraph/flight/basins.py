"""The basin of a gait: from which roll and pitch it settles, found by flying from each, beside what a determinant says.

The acceptable attitudes of a gait (:mod:`gaitgraph.robustness.attitudes`) are those at which it is never singular, at no moment of
its period. The basin is another set, and neither holds the other:

* a flight leaves its first attitude at once, so it need not wait for the moment at which that one is singular; and on
  its way it may come to attitudes that are not acceptable, since rotors which cannot pull let it swing over;
* but an attitude on the other side of the singular ones *of the moment of take-off* is lost for certain. The
  determinant has another sign there than in level flight, and on the way from one to the other it is zero.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import HALF_PI, angle_from_text, number_of
from gaitgraph.errors import InputError, did_you_mean, shown
from gaitgraph.files import write_whole
from gaitgraph.flight.clocks import biased
from gaitgraph.flight.courses import before_take_off, repeated
from gaitgraph.flight.outputs import PLOTS, TABLES, check_flight_outputs
from gaitgraph.flight.records import OUTCOMES
from gaitgraph.flight.settings import FlightSettings
from gaitgraph.flight.simulation import Cockpit
from gaitgraph.gait.table import Table
from gaitgraph.invertibility.matrices import coefficients_of
from gaitgraph.invertibility.tilt_margins import attitude_sensitivities
from gaitgraph.io.formats import FORMATS
from gaitgraph.robustness.biased import robustness_of
from gaitgraph.timing.timed_gait import TimedGait

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from gaitgraph.robustness.attitudes import AcceptableAttitudes

__all__ = [
    "CASES",
    "DEFAULT_EXTENT",
    "DEFAULT_RESOLUTION",
    "Basin",
    "basin_of",
    "basins_of",
    "check_basin_outputs",
    "table_of_basins",
    "write_basins",
]

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]

DEFAULT_EXTENT = math.radians(80.0)
"""Largest roll and pitch at the start [rad]."""

DEFAULT_RESOLUTION = 17
"""Attitudes along each side of the grid, with the default extent 10° apart."""

CASES = ("inside_settled", "inside_lost", "outside_settled", "outside_lost")
"""Whether an attitude is acceptable, and whether it settled."""

_MOST_FLIGHTS = 100_000
_AFTER = 2.0  # s beyond the period, where no duration is stated


@dataclass(frozen=True, slots=True, kw_only=True)
class Basin:
    """Flights of one gait from a square grid of attitudes, at one or more moments of its period.

    Parameters
    ----------
    timed
        The gait that was flown.
    eta
        By which its α3 and α4 are scaled, 1 for the gait itself.
    settings
        How it was flown.
    angles
        The grid's values of roll and of pitch, shape (m,) [rad].
    begins
        The moments of the gait at which flights take off, shape (b,) [s].
    outcome
        Index into :data:`gaitgraph.flight.records.OUTCOMES` of each flight, shape (b, m, m): begin, roll, pitch.
    seconds
        Since when a flight had settled, or when it ended, shape (b, m, m) [s].
    peak_share
        Largest thrust of a rotor over a quarter of the weight, shape (b, m, m); 0 where a flight ended as it began.
    same_side
        Whether the determinant at take-off has the sign that it has in level flight then, shape (b, m, m).
    acceptable
        The attitudes at which the gait is never singular, as :func:`gaitgraph.robustness.biased.robustness_of` finds them.
    inside
        Which of the grid are among them, shape (m, m).
    refusal
        Why the gait was refused before take-off, or "".
    warnings
        What deserves attention: what the paper's rules have against it, servos that do not follow, a table that is not
        closed, and, flown in any case, what physics has against it.
    """

    timed: TimedGait
    eta: float
    settings: FlightSettings
    angles: FloatArray
    begins: FloatArray
    outcome: npt.NDArray[np.int8]
    seconds: FloatArray
    peak_share: FloatArray
    same_side: BoolArray
    acceptable: AcceptableAttitudes
    inside: BoolArray
    refusal: str = ""
    warnings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name in ("angles", "begins", "outcome", "seconds", "peak_share", "same_side", "inside"):
            array = np.array(getattr(self, name))
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    @property
    def settled(self) -> BoolArray:
        """Whether an attitude settled from every moment that was tried, shape (m, m): roll, pitch."""
        return np.asarray((self.outcome == 0).all(axis=0))

    @property
    def worst(self) -> npt.NDArray[np.int8]:
        """How the first flight from an attitude ended that did not settle, else 0, shape (m, m): see `outcome`."""
        first = (self.outcome != 0).argmax(axis=0)
        return np.asarray(np.take_along_axis(self.outcome, first[None], axis=0)[0])

    @property
    def fraction(self) -> float:
        """Part of the grid's attitudes that settled."""
        return float(self.settled.mean())

    @property
    def acceptable_fraction(self) -> float:
        """Part of the grid's attitudes at which the gait is never singular."""
        return float(self.inside.mean())

    @property
    def cases(self) -> dict[str, int]:
        """How many attitudes are acceptable and settled, acceptable and lost, and so on: see :data:`CASES`."""
        counts = [(self.inside == here) & (self.settled == well) for here in (True, False) for well in (True, False)]
        return dict(zip(CASES, (int(count.sum()) for count in counts), strict=True))

    @property
    def outcomes(self) -> dict[str, int]:
        """How many flights ended in which way; those that none did are left out."""
        found = np.bincount(self.outcome.ravel(), minlength=len(OUTCOMES)).tolist()
        return {name: count for name, count in zip(OUTCOMES, found, strict=True) if count}

    @property
    def name(self) -> str:
        """What was flown."""
        return "the gait itself" if self.eta == 1.0 else f"biased by {self.eta:g}"

    def columns(self) -> dict[str, Any]:
        """Return one row a flight: eta, begin [s], roll, pitch [rad], outcome, seconds, peak_share and two predictions.

        `acceptable` and `same_side` are 1 or 0.
        """
        b, m = len(self.begins), len(self.angles)
        shape = (b, m, m)
        wide = {
            "eta": np.full(shape, self.eta),
            "begin": np.broadcast_to(self.begins[:, None, None], shape),
            "roll": np.broadcast_to(self.angles[None, :, None], shape),
            "pitch": np.broadcast_to(self.angles[None, None, :], shape),
            "outcome": self.outcome,
            "seconds": self.seconds,
            "peak_share": self.peak_share,
            "acceptable": np.broadcast_to(self.inside, shape).astype(float),
            "same_side": self.same_side.astype(float),
        }
        flat = {name: np.array(values).ravel() for name, values in wide.items()}
        return {**flat, "outcome": tuple(OUTCOMES[code] for code in flat["outcome"])}

    def as_mapping(self) -> dict[str, Any]:
        """Return everything as plain values, ready for JSON; angles in radians."""
        columns = self.columns()
        return {
            "eta": self.eta,
            "refused": bool(self.refusal),
            "reason": self.refusal,
            "warnings": list(self.warnings),
            "period": self.timed.period,
            "law": self.timed.law,
            "fraction": self.fraction,
            "acceptable_fraction": self.acceptable_fraction,
            **self.cases,
            "outcomes": self.outcomes,
            "flights": {
                name: list(values) if isinstance(values, tuple) else values.tolist()
                for name, values in columns.items()
                if name != "eta"
            },
        }

    def __repr__(self) -> str:
        return f"<Basin of {self.name}: {100 * self.fraction:.1f} % of {self.inside.size} attitudes settled>"

    def __str__(self) -> str:
        m, span = len(self.angles), math.degrees(float(self.angles[-1]))
        head = f"Basin of {self.name}: {m} by {m} attitudes, roll and pitch up to {span:g}°"
        if self.refusal:
            return f"{head}: refused before take-off: {self.refusal}"
        cases = self.cases
        told = [f"{count} {name}" for name, count in self.outcomes.items()]
        times = self.seconds[self.outcome == 0]
        lines = [
            f"{head}: {100 * self.fraction:.1f} % settled, {100 * self.acceptable_fraction:.1f} % acceptable",
            f"  acceptable    {cases['inside_settled']} settled, {cases['inside_lost']} lost",
            f"  singular once {cases['outside_settled']} settled, {cases['outside_lost']} lost",
            f"  flights       {', '.join(told)}",
        ]
        if times.size:
            peak = float(self.peak_share[self.outcome == 0].max())
            lines.append(
                f"  settled       after {times.max():.2f} s at most, with {peak:.3g} times a quarter of the weight"
            )
        return "\n".join(lines)


def basin_of(
    timed: TimedGait,
    *,
    eta: float = 1.0,
    settings: FlightSettings | None = None,
    resolution: int = DEFAULT_RESOLUTION,
    extent: Any = DEFAULT_EXTENT,
    begins: int = 1,
    anyway: bool = False,
    progress: Callable[[float], None] | None = None,
) -> Basin:
    """Fly a gait from every attitude of a grid, and return where it settled.

    Parameters
    ----------
    timed
        A gait with a clock.
    eta
        Fly the gait biased by it instead: α3 and α4 scaled, in (0, 1].
    settings
        How. Where they state no duration, a flight may take two seconds more than the gait's period, and 3 s at least.
        It ends once it has settled, but not before one period: what a thrust limit or a slow servo allows at one moment
        of the gait it may forbid at another.
    resolution
        Attitudes along each side of the square grid, odd or even, 1 for level alone.
    extent
        Largest roll and pitch, above 0 and below π/2 [rad, or a text such as "60deg"].
    begins
        At how many moments, evenly over the period, flights take off.
    anyway
        Whether to fly what physics forbids; see :func:`gaitgraph.flight.simulation.fly`.
    progress
        Called with the part of the flights that are done.

    Raises
    ------
    InputError
        If a value is not allowed.
    MissingConstant, MissingExtra
        As :func:`gaitgraph.flight.simulation.fly` does.

    Notes
    -----
    Not guaranteed: what lies between the grid's attitudes or between the moments of take-off; that another controller,
    other gains or another period have the same basin; anything about flights that start with a rate of turn.

    Examples
    --------
    >>> from gaitgraph.gait.gait import lift
    >>> gait = lift([(1.178, -1.178), (1.178, -0.393), (0.393, -0.393), (0.393, -1.178)], "red")
    >>> basin = basin_of(gait.parametrize(1.0), resolution=3, extent="20deg")
    >>> basin.fraction, basin.cases["inside_settled"]
    (1.0, 9)
    """
    (found,) = basins_of(
        timed,
        biases=[eta],
        settings=settings,
        resolution=resolution,
        extent=extent,
        begins=begins,
        anyway=anyway,
        progress=progress,
    )
    return found


def basins_of(
    timed: TimedGait,
    *,
    biases: Iterable[float] | float = (1.0, 0.9, 0.8),
    settings: FlightSettings | None = None,
    resolution: int = DEFAULT_RESOLUTION,
    extent: Any = DEFAULT_EXTENT,
    begins: int = 1,
    anyway: bool = False,
    progress: Callable[[float], None] | None = None,
) -> tuple[Basin, ...]:
    """Return the basin of a gait for each η of `biases`, 1 being the gait itself; the rest as for :func:`basin_of`.

    `biases` may be a single number, and has each number once.
    """
    if not isinstance(timed, TimedGait):
        raise InputError(f"gait: {shown(timed)}; allowed is a timed gait, as gait.parametrize(period) returns")
    if not isinstance(anyway, bool):
        raise InputError(f"anyway: {shown(anyway)}; allowed are True and False")
    etas = _checked_etas(biases)
    gaits = [timed if eta == 1.0 else biased(timed, eta) for eta in etas]
    count = _checked_count("resolution", resolution, 1)
    moments = _checked_count("begins", begins, 1)
    flights = len(etas) * moments * count**2
    if flights > _MOST_FLIGHTS:
        raise InputError(
            f"resolution: {count} by {count} attitudes, {moments} begins and {len(etas)} gaits are {flights} flights; "
            f"allowed are {_MOST_FLIGHTS}"
        )
    span = angle_from_text(extent, "extent")
    if not 0 < span < HALF_PI:
        raise InputError(f"extent: {shown(extent)}; allowed is an angle above 0 and below pi/2")
    settings = _settings_for(timed, FlightSettings() if settings is None else settings)
    if settings.reference != "attitude":
        raise InputError(f"reference: {settings.reference!r}; allowed for a basin is attitude")
    timed.gait.vehicle.require("mass", "inertia", "arm_length", purpose="flight")
    # The middle of an odd count is zero exactly.
    angles = span * (2.0 * np.arange(count) - (count - 1)) / max(count - 1, 1)
    starts = timed.period * np.arange(moments) / moments
    share = 1.0 / len(etas)

    def after(k: int) -> Callable[[float], None]:
        return lambda part: None if progress is None else progress((k + part) * share)

    return tuple(
        _flown(gait, eta, settings, angles, starts, anyway, after(k))
        for k, (gait, eta) in enumerate(zip(gaits, etas, strict=True))
    )


def table_of_basins(every: Sequence[Basin]) -> Table:
    """Return one table of the flights of several basins, one row a flight; columns as :meth:`Basin.columns` has."""
    parts = [basin.columns() for basin in every]
    columns: dict[str, Any] = {}
    for name in parts[0]:
        values = [part[name] for part in parts]
        columns[name] = sum(values, ()) if name == "outcome" else np.concatenate(values)
    timed, settings = every[0].timed, every[0].settings
    about = {
        "made_by": "basin",
        "vehicle": timed.gait.vehicle.as_mapping(),
        "coefficients": timed.gait.coefficients.kind,
        "period": timed.period,
        "law": timed.law,
        "flight": settings.as_mapping(),
    }
    return Table(columns=columns, about=about)


def check_basin_outputs(paths: Sequence[str | Path], *, force: bool = False) -> None:
    """Raise before any flight if an output cannot be; errors as :func:`gaitgraph.io.writing.check_outputs` has them."""
    known = [*TABLES, *PLOTS]
    for path in map(Path, paths):
        suffix = path.suffix.lower()
        if suffix not in known:
            hint = did_you_mean(suffix, known) if suffix else ""
            raise InputError(f"output: {str(path)!r}; allowed for a basin are {', '.join(known)}{hint}")
    check_flight_outputs(paths, force=force)


def write_basins(basins: Sequence[Basin], paths: Sequence[str | Path], *, force: bool = False) -> None:
    """Write basins to files, each whole or not at all: one row a flight, or the picture of all side by side.

    Parameters
    ----------
    basins
        Of one gait and its biased gaits, as :func:`basins_of` returns them.
    paths
        The suffix says what: a table (.csv, .json, .npz, .mat, .parquet) or a picture (.png, .svg, .pdf).
    force
        Overwrite files that exist.

    Raises
    ------
    InputError, FileProblem, OutputExists, MissingExtra
        As :func:`check_basin_outputs` does, or if the disk is full.
    """
    check_basin_outputs(paths, force=force)
    table = table_of_basins(basins)
    contents: list[tuple[Path, Any]] = []
    for path in map(Path, paths):
        suffix = path.suffix.lower()
        if suffix in PLOTS:
            from gaitgraph.plots.axes import picture_bytes
            from gaitgraph.plots.basins import basins_figure

            kind: Any = suffix.removeprefix(".")
            contents.append((path, picture_bytes(basins_figure(basins), kind)))
        else:
            contents.append((path, partial(FORMATS[suffix].writer(), [table])))
    write_whole(contents, force=force)


def _flown(
    timed: TimedGait,
    eta: float,
    settings: FlightSettings,
    angles: FloatArray,
    begins: FloatArray,
    anyway: bool,
    progress: Callable[[float], None],
) -> Basin:
    import shapely

    gait = timed.gait
    numbers = coefficients_of(gait.vehicle, "exact")
    acceptable = robustness_of(timed, curves=0).gait.acceptable
    roll, pitch = np.meshgrid(angles, angles, indexing="ij")
    refusal, warnings = before_take_off(repeated(timed), settings, anyway=anyway)
    shape = (len(begins), *roll.shape)
    outcome = np.full(shape, OUTCOMES.index("refused"), dtype=np.int8)
    seconds, peak = np.zeros(shape), np.zeros(shape)
    if not refusal:
        total = outcome.size
        for index in np.ndindex(shape):
            if index[1:] == (0, 0):
                cockpit = Cockpit(repeated(timed, begin=float(begins[index[0]])), settings)
                warnings += tuple(one for one in cockpit.warnings if one not in warnings)
            attitude = float(roll[index[1:]]), float(pitch[index[1:]])
            flight = cockpit.flown(attitude, until_settled=timed.period)
            outcome[index] = OUTCOMES.index(flight.outcome)
            seconds[index] = flight.flown if flight.settling_time is None else flight.settling_time
            peak[index] = flight.peak_thrust_share or 0.0
            progress((int(np.ravel_multi_index(index, shape)) + 1) / total)
    return Basin(
        timed=timed,
        eta=eta,
        settings=settings,
        angles=angles,
        begins=begins,
        outcome=outcome,
        seconds=seconds,
        peak_share=peak,
        same_side=np.stack([_same_side(row, roll, pitch, numbers) for row in timed.at(begins)[0]]),
        acceptable=acceptable,
        inside=np.asarray(shapely.contains_xy(acceptable.polygon, roll, pitch)),
        refusal=refusal,
        warnings=warnings,
    )


def _same_side(alpha: FloatArray, roll: FloatArray, pitch: FloatArray, numbers: Any) -> BoolArray:
    """Return whether the determinant at attitudes has the sign that it has in level flight."""
    x, y, z = attitude_sensitivities(alpha, numbers)
    tilted = -x * np.sin(pitch) + np.cos(pitch) * (y * np.sin(roll) + z * np.cos(roll))
    return np.asarray(tilted * z > 0)


def _settings_for(timed: TimedGait, settings: FlightSettings) -> FlightSettings:
    """Return settings under which a flight lasts a period at least."""
    if settings.duration is None:
        return settings.replace(duration=max(settings.seconds, timed.period + _AFTER))
    if settings.duration < timed.period:
        raise InputError(
            f"duration: {settings.duration!r} s; allowed is the gait's period, {timed.period:g} s, or more: what holds "
            "at one moment of it need not hold at another"
        )
    return settings


def _checked_etas(biases: Any) -> list[float]:
    alone = math.isfinite(number_of(biases))
    if not alone and (isinstance(biases, str) or not isinstance(biases, Iterable)):
        raise InputError(f"biases: {shown(biases)}; allowed are numbers above 0, up to 1")
    etas = [_checked_eta(eta) for eta in ([biases] if alone else biases)]
    if not etas:
        raise InputError("biases: none; allowed is one or more")
    twice = [eta for k, eta in enumerate(etas) if eta in etas[:k]]
    if twice:
        raise InputError(f"bias: {twice[0]:g} is there twice; allowed is each once")
    return etas


def _checked_eta(eta: Any) -> float:
    if not 0 < number_of(eta) <= 1:
        raise InputError(f"bias: {shown(eta)}; allowed is a number above 0, up to 1")
    return float(eta)


def _checked_count(name: str, value: Any, least: int) -> int:
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or not least <= value <= _MOST_FLIGHTS:
        raise InputError(f"{name}: {shown(value)}; allowed is a whole number from {least} to {_MOST_FLIGHTS}")
    return int(value)
