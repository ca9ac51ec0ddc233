"""Transitions: paths on the surface between gaits, and between hover and a gait, as timed tables.

A path is the shortest there is, at any angle, between corners of two gaits, or the first rows of gaits with times. Run
there and back it is a gait, which is how it is checked and timed. A gait in motion at its first row is begun by a run-up,
and left by a run-down, see :mod:`gaitgraph.timing.joining`.

Between different signs of R there is none. Formula (1) is continuous in the tilt angles and the attitude; on a gait
of the surfaces it is R·cos φ·cos θ, which has the sign of R for |φ|, |θ| < π/2. A flight from one sign to the other
passes its zero, where the decoupling matrix is singular.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import product
from typing import IO, TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gaitgraph.angles import HALF_PI, checked_floor, number_of
from gaitgraph.errors import Infeasible, InputError, wrong
from gaitgraph.gait.gait import Gait, lift
from gaitgraph.gait.given import given_gait
from gaitgraph.gait.table import RATE_CHECKS, RATE_UNITS, Table
from gaitgraph.io.formats import write_tables
from gaitgraph.pictured import Pictured
from gaitgraph.planning.any_angle import Leg, shortest_path
from gaitgraph.planning.branch import Branch, Search
from gaitgraph.planning.request import plan_request
from gaitgraph.surface.curved import hover_on_sheet, sheet_of
from gaitgraph.surface.sheets import home_in_words, red_label, separating_factor
from gaitgraph.timing.joining import (
    HOVER,
    JoinedPath,
    RunUp,
    played,
    run_up,
)
from gaitgraph.timing.laws import DEFAULT_LAW, LawName
from gaitgraph.timing.lifted_gait import is_lifted, path_of
from gaitgraph.timing.timed_gait import (
    MOST_SAMPLES,
    ROW_BY_ROW,
    TimedPath,
    checked_clock,
    table_of,
)
from gaitgraph.tolerances import DEFAULT_FLOOR, DEFAULT_TOLERANCE
from gaitgraph.validation.report import Report, verdict_of
from gaitgraph.validation.validating import validate
from gaitgraph.vehicle import PAPER, Each, four_of, lowest_limits, vehicle_within

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from gaitgraph.gait.given import GaitLike
    from gaitgraph.invertibility.coefficients import CoefficientsLike
    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.surface.region import Requirement
    from gaitgraph.surface.sheets import Color
    from gaitgraph.timing.timed_gait import TimedGait
    from gaitgraph.vehicle import Vehicle, VehicleLike

_MOST_CORNERS = 16
_DURATION = 1.0
_LONGEST = 5e8
_STATEMENT = (
    "formula (1) is continuous in tilt angles and attitude. At both ends it is R·cos φ·cos θ, which has the sign of R "
    "for |φ|, |θ| < π/2. So every flight between them passes a zero of it, where the decoupling matrix is singular"
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Transition(Pictured):
    """A path from one end to the other, or the reason why there is none. Truthy when there is one.

    `there_and_back` is the path, from its start to its end and back, as a gait. `reason` says why there is none, or why
    it is not flyable; `proof`, if the signs of R differ, has R at both ends and why every flight between them is
    singular somewhere. `corners` are those of the gait at either end that it leaves and joins, counted from 0, None for
    hover. `duration` [s] and `law` are those of the path in one direction. `run_down` and `run_up` are of gaits that
    are in motion where the path leaves or joins them, else None; `samples` are of all, and `limits` those of rates,
    accelerations and jerks that the gaits' tables were made for. `judged` is the `report`, None if there is no path: all
    checks of the path, there and back, with those of tilt rates; with a run-up or a run-down those of the whole table.
    """

    there_and_back: Gait | None
    reason: str | None
    proof: dict[str, Any] | None = None
    corners: tuple[int | None, int | None] = (None, None)
    duration: float = _DURATION
    law: LawName = DEFAULT_LAW
    samples: int = 100
    run_down: RunUp | None = None
    run_up: RunUp | None = None
    limits: Mapping[str, Each] = field(default_factory=dict)
    judged: Report | None = None

    def __bool__(self) -> bool:
        return self.there_and_back is not None

    @property
    def _shown(self) -> Any:
        return self.timed if self else None

    @property
    def status(self) -> str:
        """Whether the transition is "planned" or "infeasible"."""
        return "planned" if self else "infeasible"

    @property
    def gait(self) -> Gait:
        """The path there and back, as a gait; raises Infeasible, with the reason, if there is none."""
        if self.there_and_back is None:
            raise Infeasible(self.reason)
        return self.there_and_back

    @property
    def report(self) -> Report:
        """All checks of the path, there and back, with those of tilt rates; raises Infeasible if there is none."""
        if self.judged is None:
            raise Infeasible(self.reason)
        return self.judged

    @property
    def path(self) -> FloatArray:
        """The corners of the path, both ends included, shape (n, 4) [rad]; raises Infeasible if there is none."""
        alpha = self.gait.alpha
        return alpha[: len(alpha) // 2 + 1]

    @property
    def length(self) -> float:
        """Length of the path in the (α1, α2) plane [rad]; raises Infeasible if there is none."""
        return self.gait.length / 2

    @property
    def timed_path(self) -> TimedPath:
        """The path alone, timed; its `loop` leads there and back."""
        return TimedPath.of(
            self.gait.parametrize(
                2 * self.duration, law=self.law, samples=2 * self.samples
            )
        )

    @property
    def timed(self) -> TimedPath | JoinedPath:
        """The whole motion, timed: the path, between the run-down and the run-up if there are any."""
        path = self.timed_path
        parts: list[TimedPath | RunUp | None] = [self.run_down, path, self.run_up]
        sections = [part for part in parts if part is not None]
        return path if len(sections) == 1 else JoinedPath.of(sections, self.samples)

    @property
    def _ends(self) -> dict[str, Any]:
        """The corners that the path leaves and joins, counted from 1, and the run-down and the run-up, if any."""
        numbers = (None if corner is None else corner + 1 for corner in self.corners)
        ends: dict[str, Any] = dict(
            zip(("leaves_corner", "joins_corner"), numbers, strict=True)
        )
        for name, run in (("run_down", self.run_down), ("run_up", self.run_up)):
            if run is not None:
                ends[name] = {"periods": run.periods, "duration": run.period}
        return ends

    @property
    def table(self) -> Table:
        """The table of the whole motion, from t = 0 to its duration; raises Infeasible if there is none."""
        about: dict[str, Any] = {"made_by": "transition", "transition": self._ends}
        if self.limits:
            about["limits"] = {
                kind: list(four_of(limit)) for kind, limit in self.limits.items()
            }
        return table_of(self.timed, about)

    def write(
        self,
        *paths: str | Path | IO[Any],
        force: bool = False,
        periods: int = 1,
        format: str | None = None,
    ) -> None:
        """Write the table of the path; see :func:`gaitgraph.io.formats.write_tables`."""
        write_tables(self.table, paths, force=force, periods=periods, format=format)

    def to_pandas(self) -> Any:
        """Return the table as a pandas frame; see :meth:`gaitgraph.gait.table.Table.to_pandas`."""
        return self.table.to_pandas()

    def as_mapping(self) -> dict[str, Any]:
        """Return the transition as plain values, ready for JSON."""
        return {
            "status": self.status,
            "reason": self.reason,
            "path": self.path.tolist() if self else [],
            "colors": list(self.gait.colors[: len(self.path)]) if self else [],
            "length": self.length if self else None,
            "duration": self.timed.period if self else None,
            "law": self.law,
            **self._ends,
            "proof": self.proof,
            **verdict_of(self.judged),
            "warnings": [] if self.judged is None else list(self.judged.warnings),
        }

    def __repr__(self) -> str:
        if not self:
            return "<Transition: infeasible>"
        return f"<Transition: {len(self.path)} corners, {self.length:.4f} rad, {self.duration:g} s, {self.law}>"

    def __str__(self) -> str:
        if self.judged is None:
            return f"No path: {self.reason}" + (
                f"\nProof: {self.proof['statement']}." if self.proof else ""
            )
        ends = []
        for corner, alpha, run in zip(
            self.corners,
            (self.path[0], self.path[-1]),
            (self.run_down, self.run_up),
            strict=True,
        ):
            angles = tuple(round(float(angle), 3) for angle in alpha)
            if corner is None:
                ends.append(HOVER)
            elif run is None:
                ends.append(f"corner {corner + 1} {angles}")
            else:
                ends.append(f"row 1 {angles}")
        size = f"{len(self.path)} corners, {self.length:.4f} rad, {self.duration:g} s, {self.law}"
        size += "" if self.length else ", nothing moves"
        lines = [f"From {ends[0]} to {ends[1]}: {size}; checked there and back"]
        if self.run_down is not None or self.run_up is not None:
            lines[0] = lines[0].replace("checked there and back", "checked as a table")
        for run, text in (
            (self.run_down, "before it the clock of the gait stops"),
            (self.run_up, "after it the clock of the gait starts"),
        ):
            if run is not None:
                number = f"{run.periods} period{'s' * (run.periods > 1)}"
                lines.append(f"  {text}: {number} of it in {run.period:.4g} s")
        if self.reason is not None and self.reason != self.report.reason:
            lines.append(f"  not flyable: {self.reason}")
        return "\n".join([*lines, str(self.report)])


def transition(
    start: GaitLike,
    end: GaitLike,
    *,
    duration: float | None = None,
    law: LawName = DEFAULT_LAW,
    samples: int | None = None,
    rate: float | None = None,
    floor: float = DEFAULT_FLOOR,
    vehicle: VehicleLike | None = None,
    coefficients: CoefficientsLike | None = None,
) -> Transition:
    """Return a path on the surface from hover to a gait, from a gait to hover, or from one gait to another.

    Parameters
    ----------
    start, end
        A gait in any form, or "hover" for α = 0; for a vehicle with axes of its own the point of its sheet above
        α1 = α2 = 0. A gait without times is left and joined at one of its corners, where the law `smooth` rests; a gait
        with times, as a table, at its first row. If it is in motion there, its clock starts slowly after the path, or
        stops slowly before it, see :func:`gaitgraph.timing.joining.run_up`.
    duration
        Duration of the path [s]; by default 1 s, or what the limits of tilt rate, acceleration and jerk need if that is
        more: those of the vehicle and those that the gaits' tables were made for.
    law, samples, rate
        Of the path, and the rows of the whole table, as for :meth:`gaitgraph.gait.gait.Gait.parametrize`.
    floor
        Least singular value that a flyable path keeps, dimensionless.
    vehicle, coefficients
        For which the path is checked, if both ends are hover or files; otherwise those of the gait.

    Notes
    -----
    No path is an answer, not an error: see `reason` and `proof`. InputError is raised if the gaits are for different
    vehicles or coefficients, or a value is not allowed.

    The path is flyable if there is a flyable one, else valid, with the reason. It is the shortest between any two
    corners, with curved borders as exact as those of :func:`gaitgraph.planning.planner.plan_loop`; of a gait with many
    corners the 16 nearest to the other end are tried.

    Examples
    --------
    >>> from gaitgraph.gait.gait import lift
    >>> gait = lift([(-0.4, 0.4), (-0.4, 1.2), (-1.2, 1.2), (-1.2, 0.4)], "red")
    >>> entry = transition("hover", gait)
    >>> entry.path.round(3).tolist(), entry.report.flyable
    ([[0.0, 0.0, 0.0, 0.0], [-0.4, 0.4, -0.4, 0.4]], True)
    >>> bool(transition("hover", lift([(1.2, -1.2)], "red")))
    False
    """
    leaving = _end_of(start, "start", vehicle, coefficients)
    joining = _end_of(end, "end", vehicle, coefficients)
    hover = _hover_for([leaving, joining], vehicle, coefficients)
    leaving, joining = leaving or hover, joining or hover
    first, last = leaving.gait, joining.gait
    if (first.vehicle, first.coefficients) != (last.vehicle, last.coefficients):
        raise InputError(
            f"end must be a gait for {first.vehicle.name!r} ({first.coefficients.kind} coefficients), as the start is, "
            f"got one for {last.vehicle.name!r} ({last.coefficients.kind}); give one vehicle for both",
            field="end",
        )
    if duration is not None and not 1e-6 <= number_of(duration) <= _LONGEST:
        raise wrong("duration", "must be between 1e-6 and 5e8 s", duration)
    floor = checked_floor(floor)
    answer = Transition(
        there_and_back=None,
        reason=None,
        duration=_DURATION if duration is None else float(duration),
        law=law,
        samples=100,
    )
    answer = replace(
        answer, samples=_checked_samples(answer.duration, law, samples, rate)
    )

    reason, proof = _refusal(first, last, floor)
    if reason is not None:
        return replace(answer, reason=reason, proof=proof)
    path = _shortest(leaving.place, joining.place, floor)
    if isinstance(path, str):
        return replace(answer, reason=path)

    alpha = np.vstack([path.alpha, path.alpha[-2:0:-1]])
    colors = first.colors[:1] * len(alpha)
    gait = replace(first, alpha=alpha, colors=colors, request={})
    # Both those of the vehicle and those that the tables were made for.
    limits = lowest_limits([leaving.limits, joining.limits])
    limited = replace(gait, vehicle=vehicle_within(gait.vehicle, limits))
    if duration is None:
        answer = replace(answer, duration=_least_duration(limited, law))
    answer = replace(
        answer,
        there_and_back=gait,
        corners=(
            None if leaving is hover else leaving.corners[path.leaves],
            None if joining is hover else joining.corners[path.joins],
        ),
        run_down=_run_up(leaving, stops=True),
        run_up=_run_up(joining),
        limits=limits,
    )
    count = _checked_samples(answer.timed.period, law, samples, rate)
    return _judged(replace(answer, samples=count), limited, floor, leaving, joining)


def _run_up(end: _End, *, stops: bool = False) -> RunUp | None:
    """Return the run-up of a gait in motion where the path joins it, or with `stops` its run-down; else None."""
    if end.motion is None:
        return None
    return run_up(end.motion, stops=stops)


def _least_duration(limited: Gait, law: LawName) -> float:
    """Return one second, or how long one way takes within the limits if that is more."""
    seconds = _DURATION
    once = limited.parametrize(2.0, law=law)
    for order, kind in enumerate(RATE_UNITS, start=1):
        limit = getattr(limited.vehicle, f"max_tilt_{kind}")
        if limit is not None:
            share = float((once.peaks(order) / limit).max())
            if np.isfinite(share):
                seconds = max(seconds, share ** (1 / order))
    return min(math.ceil(seconds * 1000) / 1000, _LONGEST)


def _judged(answer: Transition, limited: Gait, floor: float, *ends: _End) -> Transition:
    """Return a path with its report: of the path there and back, with a run-up or a run-down of the whole table."""
    if answer.run_down is None and answer.run_up is None:
        timed = limited.parametrize(2 * answer.duration, law=answer.law)
        report = answer.gait.check(floor=floor).with_timing(TimedPath.of(timed))
    else:
        report = validate(
            answer.table,
            vehicle=limited.vehicle,
            coefficients=limited.coefficients.kind,
            floor=floor,
        )
    if report.flyable:
        return replace(answer, judged=report)
    reason = report.reason
    broken = {check.name for check in report.checks if not check.ok}
    laws = [end.motion.law for end in ends if end.motion is not None]
    of_rows = ROW_BY_ROW in laws
    if of_rows and broken and broken <= set(RATE_CHECKS):
        reason = f"{reason}; the gait is known by its rows alone, and more of them may be enough"
    return replace(answer, reason=reason, judged=report)


class _End(NamedTuple):
    """A gait at an end of a path: the whole, the corners that may be joined, its motion, and its limits of rates."""

    gait: Gait
    place: Gait
    corners: Sequence[int]  # numbers of those of the place
    motion: TimedGait | None
    limits: Mapping[str, Each]


def _hover_for(
    ends: Sequence[_End | None],
    vehicle: VehicleLike | None,
    coefficients: CoefficientsLike | None,
) -> _End:
    """Return hover, for the vehicle and the coefficients of the first end that is a gait, if there is one."""
    gaits = [end.gait for end in ends if end is not None]
    if gaits:
        like = gaits[0]
    else:
        like = Gait(
            alpha=np.zeros((1, 4)),
            vehicle=PAPER if vehicle is None else vehicle,
            coefficients=coefficients,
        )
    rotors = like.coefficients.rotors
    hover = replace(
        like,
        alpha=hover_on_sheet(rotors),
        colors=("red",) if rotors.asymmetry is None else like.colors[:1],
        request={},
    )
    return _End(hover, hover, [0], None, {})


def _end_of(
    handed: GaitLike,
    name: str,
    vehicle: VehicleLike | None,
    coefficients: CoefficientsLike | None,
) -> _End | None:
    """Return what a path may join, None for hover: the corners of a gait, or the first row of one with times."""
    if isinstance(handed, str) and handed == HOVER:
        return None
    given = given_gait(
        handed, vehicle=vehicle, coefficients=coefficients, name=name, once=False
    )
    table = given.table
    has_times = given.motion is not None if table is None else "t" in table
    if not has_times:
        place = given.gait
        corners = range(len(place.alpha))
        if is_lifted(place):  # the law `smooth` rests at some of its rows
            corners = path_of(place).corners.tolist()
            place = replace(place, alpha=place.alpha[corners])
        return _End(given.gait, place, corners, None, {})
    motion = played(given)
    made_for: Mapping[str, Any] = motion.made_for if table is None else table.limits
    limits: dict[str, Each] = {kind: tuple(one) for kind, one in made_for.items()}
    gait = motion.gait
    place = replace(
        gait, alpha=motion.at(0.0).alpha[None], colors=gait.colors[:1], request={}
    )
    return _End(gait, place, [0], motion, limits)


def _checked_samples(
    duration: float, law: LawName, samples: int | None, rate: float | None
) -> int:
    """Return the number of intervals one way; there and back has twice as many."""
    count = checked_clock(duration, law, samples=samples, rate=rate)
    if count > MOST_SAMPLES // 2:
        name, value = ("samples", samples) if rate is None else ("rate", rate)
        raise wrong(name, f"must give at most {MOST_SAMPLES // 2} samples", value)
    return count


def _refusal(
    first: Gait, last: Gait, floor: float
) -> tuple[str | None, dict[str, Any] | None]:
    """Return why there is certainly no path between two gaits, and the proof if the signs of R differ."""
    reports = [gait.check(floor=floor) for gait in (first, last)]
    for name, gait, report in zip(
        ("start", "end"), (first, last), reports, strict=True
    ):
        fault = _fault_of(gait, report)
        if fault:
            return f"the {name} is {fault}", None
    values = [float(gait.R[np.argmax(np.abs(gait.R))]) for gait in (first, last)]
    proof = None
    if values[0] * values[1] < 0:
        proof = {"R_start": values[0], "R_end": values[1], "statement": _STATEMENT}
        if all(report["R_sign"].decided for report in reports):
            where = f"R = {values[0]:+.4g} at the start and {values[1]:+.4g} at the end"
            home = "R > 0"
            if first.vehicle.asymmetry is None:
                home += f", in the component of α = 0, {home_in_words(first.vehicle)}"
            advice = f"Plan with the same sign of R (hover has {home}), or start the flight in the gait"
            return (
                f"{where}, so every flight between them passes a singular matrix, at any attitude. {advice}",
                proof,
            )
    if first.color != last.color:
        meeting = "the sheets meet in four points only, all with R = 0"
        blue = "In exact physics all of blue is singular; use red"
        return (
            f"the start is {first.color} and the end {last.color}, and {meeting}. {blue}",
            proof,
        )
    if proof is not None:
        return (
            "the signs of R differ, as far as rounded coefficients decide them; use red",
            proof,
        )
    return None, None


def _fault_of(gait: Gait, report: Report) -> str:
    """Return why a gait is no end of a path, "" if it is one: it must be valid, or on a curved sheet flyable."""
    if gait.vehicle.asymmetry is None:
        return "" if report.valid else f"not valid: {report.reason}"
    off = sheet_of(gait.coefficients.rotors).distances(gait.alpha).max()
    if off > DEFAULT_TOLERANCE:
        return f"{off:.2g} rad off the curved sheet"
    return "" if report.flyable else f"not flyable: {report.reason}"


class _Path(NamedTuple):
    """A path, shape (n, 4) [rad], and the corners of the gaits that it leaves and joins, counted from 0."""

    alpha: FloatArray
    leaves: int
    joins: int


class _Corners(NamedTuple):
    """A corner of either gait, by their numbers, and the straight distance between them in the plane [rad]."""

    leaves: int
    joins: int
    distance: float


def _shortest(first: Gait, last: Gait, floor: float) -> _Path | str:
    """Return the shortest path between corners of two gaits, or the reason why there is none."""
    points, others = (
        np.clip(gait.alpha[:, :2], -HALF_PI, HALF_PI) for gait in (first, last)
    )
    color: Color = "blue" if first.color == "blue" else "red"
    pairs = _pairs_to_try(points, others)
    if color == "red" and first.vehicle.asymmetry is None:
        # R with rounded coefficients leaks through the saddles; the signs of its factors do not.
        vehicle = first.vehicle
        labels = red_label(points[:, 0], points[:, 1], vehicle)
        goals = red_label(others[:, 0], others[:, 1], vehicle)
        pairs = [pair for pair in pairs if (labels[pair[0]] == goals[pair[1]]).all()]
        if not pairs:
            wall = separating_factor(points[0].tolist(), others[0].tolist(), vehicle)
            return f"both ends are on the red sheet, separated by {wall}, where R = 0; use gaits in one component"
    if last.alpha.tolist() < first.alpha.tolist():
        # Of corners equally near, the path back joins the same.
        pairs.sort(key=lambda pair: (pair.distance, pair.joins, pair.leaves))
    else:
        pairs.sort(key=lambda pair: (pair.distance, pair.leaves, pair.joins))

    for require in _requirements(first.vehicle, color):
        best: Leg | None = None
        for pair in pairs:
            if best is not None and pair.distance >= best.length:
                break  # no path is shorter than the straight line
            start, end = points[pair.leaves].tolist(), others[pair.joins].tolist()
            leg = _leg(start, end, first, floor, require)
            if leg is not None and (best is None or leg.length < best.length):
                best, joined = leg, pair
        if best is not None:
            path = _on_sheet(first, best.points)
            # A printed gait is a little beside its sheet: the path begins and ends at its own corners.
            ends = first.alpha[[joined.leaves]], last.alpha[[joined.joins]]
            alpha = np.vstack([ends[0], path.alpha[1:-1], ends[1]])
            return _Path(alpha, joined.leaves, joined.joins)
    return f"none was found on the {color} sheet with this sign of R, between any of the corners tried"


def _requirements(vehicle: Vehicle, color: Color) -> list[Requirement]:
    """Return what paths must be, the best first."""
    if color == "blue":
        return ["valid"]
    if vehicle.asymmetry is not None:
        return ["flyable"]
    return ["flyable", "valid"]


def _leg(
    start: list[float],
    end: list[float],
    gait: Gait,
    floor: float,
    require: Requirement,
) -> Leg | None:
    """Return the shortest path between two points on the sheet and with the sign of R of a gait, or None."""
    R = gait.R
    if gait.vehicle.asymmetry is None:
        # The sign on the sheet itself: printed digits may turn that of a residue of rounding.
        R = _on_sheet(gait, gait.alpha[:, :2]).R
    request = plan_request(
        sorted([start, end]),  # so that the path back is the path there
        vehicle=gait.vehicle,
        coefficients=gait.coefficients.kind,
        floor=floor,
    )
    branch = Branch(
        search=Search(request),
        color="blue" if gait.color == "blue" else "red",
        sign="positive" if R[np.argmax(np.abs(R))] > 0 else "negative",
        require=require,
    )
    leg = shortest_path(branch)
    if leg is None or start <= end:
        return leg
    return Leg(leg.points[::-1], leg.lower_bound)


def _on_sheet(gait: Gait, plane: Any) -> Gait:
    """Return points of the plane on the sheet of a gait's first corner; on a curved one with rows between them."""
    if gait.vehicle.asymmetry is not None:
        rows = sheet_of(gait.coefficients.rotors).rows(plane)
        return replace(gait, alpha=rows.alpha, request={})
    return lift(
        plane,
        gait.colors[0],
        vehicle=gait.vehicle,
        coefficients=gait.coefficients,
    )


def _pairs_to_try(points: FloatArray, others: FloatArray) -> list[_Corners]:
    """Return the pairs of corners of two gaits that a path may join."""
    pairs = product(_nearest(points, others), _nearest(others, points))
    return [_Corners(a, b, math.dist(points[a], others[b])) for a, b in pairs]


def _nearest(corners: FloatArray, others: FloatArray) -> list[int]:
    """Return the indices of the corners nearest to any other, at most 16, in order."""
    if len(corners) <= _MOST_CORNERS:
        return list(range(len(corners)))
    from scipy.spatial import cKDTree

    distance, _ = cKDTree(others).query(corners)
    return sorted(np.argsort(distance, kind="stable")[:_MOST_CORNERS].tolist())
