"""The basin of a gait: the roll and pitch from which it settles, found by flying from each attitude of a grid.

The acceptable attitudes of a gait (:mod:`gaitgraph.robustness.attitudes`) are those at which it is not singular at any
time. The basin is another set, and neither contains the other:

* a flight leaves its first attitude at once, so the gait may be singular there later; and it may reach attitudes that
  are not acceptable, since rotors which cannot pull let it swing over;
* but no flight settles from an attitude beyond the singular ones *at take-off*: the determinant has the other sign
  there than in level flight, and is zero somewhere between.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import chain
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import (
    HALF_PI,
    angle_from_text,
    in_degrees,
    whole_number,
)
from gaitgraph.arrays import freeze_arrays, read_only, read_only_mapping
from gaitgraph.errors import wrong
from gaitgraph.flight.course import biased_timed_gait, repeated
from gaitgraph.flight.flight import (
    OUTCOMES,
    FlightSettings,
    about_table,
    arms_text,
    checked_settings,
)
from gaitgraph.flight.simulation import Simulation, before_take_off
from gaitgraph.gait.gait import checked_factors
from gaitgraph.gait.table import Table, check_repeats
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.invertibility.forms import FloatArray
from gaitgraph.invertibility.matrices import BoolArray, determinant
from gaitgraph.records import Record
from gaitgraph.robustness.attitudes import AcceptableAttitudes
from gaitgraph.robustness.biased import robustness_of
from gaitgraph.texts import table_lines
from gaitgraph.timing.timed_gait import TimedGait, timed_gait_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from gaitgraph.gait.given import GaitLike

DEFAULT_EXTENT = math.radians(80.0)  # largest roll and pitch at the start
DEFAULT_RESOLUTION = (
    17  # attitudes along each side of the grid: 10° apart with the default extent
)

# Whether an attitude is acceptable, and whether it settled.
CASES = ("inside_settled", "inside_lost", "outside_settled", "outside_lost")
_MOST_FLIGHTS = 100_000
_AFTER = 2.0  # s beyond the period, where no duration is stated


@dataclass(frozen=True, slots=True, repr=False, eq=False)
class Basin(Record):
    """Flights of one gait from a square grid of attitudes, at one or more moments of its period.

    Angles are in radians, times in seconds. Arrays of flights have shape (b, m, m): moment of take-off, roll, pitch.
    """

    timed: TimedGait
    bias: float  # factor η of α3 and α4, 1 for the gait itself
    settings: FlightSettings
    angles: FloatArray  # the grid's values of roll, and of pitch, shape (m,)
    begins: FloatArray  # moments of the gait at which flights take off, shape (b,)
    outcome: npt.NDArray[
        np.int8
    ]  # of each flight, an index into gaitgraph.flight.flight.OUTCOMES
    seconds: FloatArray  # the settling time, or the end of the flight
    peak_share: FloatArray  # the largest thrust over a quarter of the weight; 0 if it ended at once
    same_side: BoolArray  # whether the determinant at take-off has the same sign as in level flight
    acceptable: AcceptableAttitudes  # the attitudes at which the gait is never singular
    inside: BoolArray  # whether an attitude of the grid is acceptable, shape (m, m)
    refusal: str = ""  # why the gait was refused before take-off
    warnings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def settled(self) -> BoolArray:
        """Whether an attitude settled from every moment of take-off, shape (m, m): roll, pitch."""
        return read_only((self.outcome == 0).all(axis=0))

    @property
    def worst(self) -> npt.NDArray[np.int8]:
        """The outcome of the first flight from an attitude that did not settle, else 0, shape (m, m): see `outcome`."""
        first = (self.outcome != 0).argmax(axis=0, keepdims=True)
        return read_only(np.take_along_axis(self.outcome, first, axis=0)[0])

    @property
    def fraction(self) -> float:
        """Share of the grid's attitudes that settled."""
        return float(self.settled.mean())

    @property
    def acceptable_fraction(self) -> float:
        """Share of the grid's attitudes at which the gait is never singular."""
        return float(self.inside.mean())

    @property
    def cases(self) -> dict[str, int]:
        """Number of attitudes of each of :data:`CASES`."""
        counts = (
            self.inside & self.settled,
            self.inside & ~self.settled,
            ~self.inside & self.settled,
            ~self.inside & ~self.settled,
        )
        return dict(zip(CASES, map(int, map(np.sum, counts)), strict=True))

    @property
    def outcomes(self) -> dict[str, int]:
        """Number of flights with each outcome that occurred."""
        counts = {}
        for code in np.unique(self.outcome):
            counts[OUTCOMES[code]] = int((self.outcome == code).sum())
        return counts

    @property
    def name(self) -> str:
        """The gait that was flown."""
        if self.bias == 1.0:
            return "the gait itself"
        return f"biased by {self.bias:g}"

    @property
    def columns(self) -> dict[str, Any]:
        """A row for each flight; the predictions `acceptable` and `same_side` are 1 or 0."""
        begin, roll, pitch = np.meshgrid(
            self.begins, self.angles, self.angles, indexing="ij"
        )
        columns = {
            "eta": np.full(begin.size, self.bias),
            "begin": begin.ravel(),
            "roll": roll.ravel(),
            "pitch": pitch.ravel(),
            "outcome": tuple(map(OUTCOMES.__getitem__, self.outcome.flat)),
            "seconds": self.seconds.ravel(),
            "peak_share": self.peak_share.ravel(),
            "acceptable": np.tile(self.inside.ravel(), len(self.begins)).astype(float),
            "same_side": self.same_side.astype(float).ravel(),
        }
        return read_only_mapping(columns)

    def as_mapping(self) -> dict[str, Any]:
        """Return everything as plain values, ready for JSON."""
        flights = {}
        for name, values in self.columns.items():
            if name != "eta":
                flights[name] = np.asarray(values).tolist()
        return {
            "eta": self.bias,
            "refused": bool(self.refusal),
            "reason": self.refusal,
            "warnings": list(self.warnings),
            "arms": self.settings.arms_of(self.timed.gait.vehicle),
            "period": self.timed.period,
            "law": self.timed.law,
            "fraction": self.fraction,
            "acceptable_fraction": self.acceptable_fraction,
            **self.cases,
            "outcomes": self.outcomes,
            "flights": flights,
        }

    def __str__(self) -> str:
        m, span = len(self.angles), math.degrees(float(self.angles[-1]))
        head = f"Basin of {self.name}: {m} by {m} attitudes, roll and pitch up to {span:g}°"
        if self.refusal:
            return f"{head}: refused before take-off: {self.refusal}"
        inside, inside_lost, outside, outside_lost = self.cases.values()
        counts = [f"{count} {name}" for name, count in self.outcomes.items()]
        rows = [
            ("acceptable", f"{inside} settled, {inside_lost} lost"),
            ("singular once", f"{outside} settled, {outside_lost} lost"),
            ("flights", ", ".join(counts)),
            ("tilt angles", arms_text(self.settings, self.timed.gait.vehicle)),
        ]
        has_settled = self.outcome == 0
        if has_settled.any():
            last = self.seconds[has_settled].max()
            peak = self.peak_share[has_settled].max()
            thrust = f"{peak:.3g} times a quarter of the weight"
            rows.append(("settled", f"after {last:.2f} s at most, with {thrust}"))
        shares = f"{100 * self.fraction:.1f} % settled, {100 * self.acceptable_fraction:.1f} % acceptable"
        return "\n".join([f"{head}: {shares}", *table_lines(rows)])

    __repr__ = __str__


def basins_of(
    gait: GaitLike,
    *,
    bias: float | Iterable[float] = (1.0, 0.9, 0.8),
    settings: FlightSettings | None = None,
    resolution: int = DEFAULT_RESOLUTION,
    extent: float | str = DEFAULT_EXTENT,
    begins: int = 1,
    anyway: bool = False,
    progress: Callable[[float], None] | None = None,
) -> tuple[Basin, ...]:
    """Fly a gait and its biased gaits from every attitude of a grid, and return where each settled.

    Parameters
    ----------
    gait
        A gait in any form, see :func:`gaitgraph.timing.timed_gait.timed_gait_of`.
    bias
        One or more factors η of α3 and α4, different ones in (0, 1]; 1 is the gait itself.
    settings
        The settings of the flights. By default a flight lasts two seconds more than the gait's period, and 3 s at
        least. It ends once it has settled, but not before one period, since thrust limits and slow servos may matter
        only at some moment of the gait.
    resolution
        Attitudes along each side of the square grid, odd or even; 1 is level alone.
    extent
        Largest roll and pitch, above 0 and below π/2 [rad, or a text such as "60deg"].
    begins
        Number of moments, evenly over the period, at which flights take off.
    anyway, progress
        Whether to fly gaits that are not flyable; called with the fraction of the flights done.

    Notes
    -----
    Raises the errors of :func:`gaitgraph.flight.simulation.fly`.

    Nothing is known between the attitudes of the grid or the moments of take-off, nor for flights that start with an
    angular rate. Another controller, other gains or another period have another basin.

    Examples
    --------
    >>> from gaitgraph.gait.gait import lift
    >>> gait = lift([(1.178, -1.178), (1.178, -0.393), (0.393, -0.393), (0.393, -1.178)], "red")
    >>> (basin,) = basins_of(gait.parametrize(1.0), bias=1.0, resolution=3, extent="20deg")
    >>> basin.fraction, basin.cases["inside_settled"]
    (1.0, 9)
    """
    timed = timed_gait_of(gait)
    check_repeats(timed)
    biases = checked_factors("bias", bias)
    if not biases or len(set(biases)) < len(biases):
        raise wrong("bias", "must be different numbers in (0, 1]", biases)
    gaits = [timed if eta == 1 else biased_timed_gait(timed, eta) for eta in biases]
    angles = _grid_angles(resolution, extent)
    begins = whole_number("begins", begins, 1, _MOST_FLIGHTS)
    flights = len(biases) * begins * len(angles) ** 2
    if flights > _MOST_FLIGHTS:
        raise wrong("resolution", f"must make at most {_MOST_FLIGHTS} flights", flights)
    starts = timed.period * np.arange(begins) / begins
    settings = _settings_for(timed, checked_settings(settings))
    timed.gait.vehicle.require("mass", "inertia", "arm_length", purpose="flight")
    basins: list[Basin] = []
    for factor, flown in zip(biases, gaits, strict=True):

        def report(done: float) -> None:
            if progress is not None:
                progress((len(basins) + done) / len(biases))

        basins.append(
            _basin_of(flown, factor, settings, angles, starts, report, anyway=anyway)
        )
    return tuple(basins)


def _grid_angles(resolution: int, extent: float | str) -> FloatArray:
    """Return the angles of a grid, evenly from −extent to extent; the middle of an odd number is zero exactly."""
    resolution = whole_number("resolution", resolution, 1, _MOST_FLIGHTS)
    span = angle_from_text(extent, "extent")
    if not 0 < span < HALF_PI:
        raise wrong(
            "extent",
            "must be an angle above 0 and below pi/2",
            extent,
            in_degrees(extent),
        )
    steps = 2.0 * np.arange(resolution) - (resolution - 1)
    return np.asarray(span * steps / max(resolution - 1, 1))


def _settings_for(timed: TimedGait, settings: FlightSettings) -> FlightSettings:
    """Return the settings of the flights of a basin, with a duration; InputError if they do not suit one."""
    if settings.reference != "attitude":
        raise wrong("reference", "must be attitude for a basin", settings.reference)
    if settings.duration is None:
        duration = max(settings.seconds, timed.period + _AFTER)
        return replace(settings, duration=duration)
    if settings.duration < timed.period:
        wanted = f"at least the gait's period, {timed.period:g} s"
        raise wrong("duration", f"must be {wanted}", settings.duration, " s")
    return settings


def _basin_of(
    timed: TimedGait,
    bias: float,
    settings: FlightSettings,
    angles: FloatArray,
    starts: FloatArray,
    report: Callable[[float], None],
    *,
    anyway: bool,
) -> Basin:
    """Fly a gait from every attitude of a grid, taking off at each of some moments of its period."""
    import shapely

    vehicle = timed.gait.vehicle
    roll, pitch = np.meshgrid(angles, angles, indexing="ij")
    attitudes = np.column_stack([roll.ravel(), pitch.ravel()])
    shape = (len(starts), *roll.shape)
    outcome = np.full(shape, OUTCOMES.index("refused"), dtype=np.int8)
    seconds, peak = np.zeros(shape), np.zeros(shape)
    refusal, warnings = before_take_off(repeated(timed), settings, anyway=anyway)
    if not refusal:
        for k, start in enumerate(starts.tolist()):

            def part(done: float, before: int = k) -> None:
                report((before + done) / len(starts))

            simulation = Simulation(repeated(timed, begin=start), settings)
            flown = simulation.run_many(
                attitudes, until_settled=timed.period, progress=part
            )
            outcome[k], seconds[k], peak[k] = np.reshape(flown, (3, *roll.shape))
            warnings += simulation.warnings
    exact = coefficients_of(vehicle, "exact")
    alpha = timed.at(starts).alpha[:, None, None]
    at_start, level = determinant(alpha, exact, roll, pitch), determinant(alpha, exact)
    acceptable = robustness_of(timed, curves=0).gait.acceptable
    quarter: Any = vehicle.mass * vehicle.gravity / 4.0  # type: ignore[operator]
    return Basin(
        timed=timed,
        bias=bias,
        settings=settings,
        angles=angles,
        begins=starts,
        outcome=outcome,
        seconds=seconds,
        peak_share=peak / quarter,
        same_side=np.asarray(at_start * level > 0),
        acceptable=acceptable,
        inside=np.asarray(shapely.contains_xy(acceptable.polygon, roll, pitch)),
        refusal=refusal,
        warnings=tuple(dict.fromkeys(warnings)),
    )


def table_of_basins(every: Sequence[Basin]) -> Table:
    """Return one table of the flights of several basins, one row a flight; columns as :meth:`Basin.columns` has."""
    about = about_table("basin", every[0].timed, every[0].settings)
    columns: dict[str, Any] = {}
    for name in every[0].columns:
        parts = [basin.columns[name] for basin in every]
        if name == "outcome":
            columns[name] = tuple(chain.from_iterable(parts))
        else:
            columns[name] = np.concatenate(parts)
    return Table(columns=columns, about=about)
