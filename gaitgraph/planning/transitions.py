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
from functools import partial
from itertools import product
from types import MappingProxyType
from typing import IO, TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gaitgraph.angles import HALF_PI, checked_floor, number_of
from gaitgraph.errors import Infeasible, InputError, wrong
from gaitgraph.gait.gait import Gait, gait_through, lift, there_and_back
from gaitgraph.gait.given import given_gait
from gaitgraph.gait.table import RATE_CHECKS, RATE_UNITS, Table
from gaitgraph.io.formats import write_tables
from gaitgraph.pictured import Pictured
from gaitgraph.planning.any_angle import length_of, shortest_path
from gaitgraph.planning.branch import Branch, Search
from gaitgraph.planning.request import plan_request
from gaitgraph.surface.curved import hover_on_sheet, sheet_of
from gaitgraph.surface.red_components import home_in_words, separating_factor
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
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from gaitgraph.gait.given import GaitLike
    from gaitgraph.invertibility.coefficients import CoefficientsLike
    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.surface.region import Requirement
    from gaitgraph.surface.sheets import Color, Sign
    from gaitgraph.timing.timed_gait import TimedGait
    from gaitgraph.vehicle import VehicleLike

_MOST_CORNERS = 16  # of a gait, from which paths to the other are tried
_DURATION = 1.0  # by default [s]
_LONGEST = 5e8  # half of the longest period, since a path is half of a loop [s]
_STATEMENT = (
    "formula (1) is continuous in tilt angles and attitude. At both ends it is R·cos φ·cos θ, which has the sign of R "
    "for |φ|, |θ| < π/2. So every flight between them passes a zero of it, where the decoupling matrix is singular"
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Transition(Pictured):
    """A path from one end to the other, or the reason why there is none. Truthy when there is one.

    `motion` is the path alone, timed. `run_down` and `run_up` are of gaits that are in motion where the path leaves or
    joins them, else None. `reason` says why there is none, or why it is not flyable; `proof`, if the signs of R differ, has R at both
    ends and why every flight between them is singular somewhere. `corners` are those of the gait at either end that it
    leaves and joins, counted from 0, None for hover. `law` is that of the path, and `limits` are those of rates,
    accelerations and jerks that the gaits' tables were made for. `judged` is the `report`, None if there is no path: all
    checks of the path, there and back, with those of tilt rates; with a run-up or a run-down those of the whole table.
    """

    reason: str | None
    proof: dict[str, Any] | None = None
    motion: TimedPath | None = None
    run_down: RunUp | None = None
    run_up: RunUp | None = None
    corners: tuple[int | None, int | None] = (None, None)
    law: LawName = DEFAULT_LAW
    limits: Mapping[str, Each] = field(default_factory=dict)
    judged: Report | None = None

    def __bool__(self) -> bool:
        return self.motion is not None

    @property
    def _shown(self) -> Any:
        if self.motion is None:
            return None
        return self.timed

    @property
    def status(self) -> str:
        """Whether the transition is "planned" or "infeasible"."""
        return "planned" if self else "infeasible"

    @property
    def timed_path(self) -> TimedPath:
        """The path alone, timed; its `loop` leads there and back; raises Infeasible, with the reason, if there is none."""
        if self.motion is None:
            raise Infeasible(self.reason)
        return self.motion

    @property
    def timed(self) -> TimedPath | JoinedPath:
        """The path, timed, between the run-down and the run-up if there are any; raises Infeasible if there is none."""
        path = self.timed_path
        parts = (self.run_down, path, self.run_up)
        sections = [part for part in parts if part is not None]
        if len(sections) == 1:
            return path
        return JoinedPath.of(sections, path.samples)

    @property
    def report(self) -> Report:
        """All checks of the path, there and back, with those of tilt rates; raises Infeasible if there is none."""
        if self.judged is None:
            raise Infeasible(self.reason)
        return self.judged

    @property
    def gait(self) -> Gait:
        """The path there and back, as a gait; raises Infeasible if there is none."""
        return self.timed_path.gait

    @property
    def path(self) -> FloatArray:
        """The corners of the path, both ends included, shape (n, 4) [rad]; raises Infeasible if there is none."""
        return self.timed_path.line

    @property
    def duration(self) -> float:
        """Duration of the path in one direction [s]; raises Infeasible if there is none."""
        return self.timed_path.period

    @property
    def length(self) -> float:
        """Length of the path in the (α1, α2) plane [rad]; raises Infeasible if there is none."""
        return self.gait.length / 2

    @property
    def _ends(self) -> dict[str, Any]:
        """The corners that the path leaves and joins, counted from 1, and the run-down and the run-up, if any."""
        ends: dict[str, Any] = dict.fromkeys(("leaves_corner", "joins_corner"))
        for name, corner in zip(ends, self.corners, strict=True):
            if corner is not None:
                ends[name] = corner + 1
        for name in ("run_down", "run_up"):
            run = getattr(self, name)
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
        format: str | None = None,
    ) -> None:
        """Write the table of the path; see :func:`gaitgraph.io.formats.write_tables`."""
        write_tables(self.table, paths, force=force, format=format)

    def as_mapping(self) -> dict[str, Any]:
        """Return the transition as plain values, ready for JSON."""
        path: dict[str, Any] = {"path": [], "colors": [], "length": None}
        path["duration"] = None
        warnings: list[str] = []
        if self.judged is not None:
            path["path"] = self.path.tolist()
            path["colors"] = list(self.gait.colors[: len(self.path)])
            path["length"] = self.length
            path["duration"] = self.timed.period
            warnings = list(self.judged.warnings)
        return {
            "status": self.status,
            "reason": self.reason,
            **path,
            "law": self.law,
            **self._ends,
            "proof": self.proof,
            **verdict_of(self.judged),
            "warnings": warnings,
        }

    def __repr__(self) -> str:
        if not self:
            return "<Transition: infeasible>"
        return f"<Transition: {len(self.path)} corners, {self.length:.4f} rad, {self.duration:g} s, {self.law}>"

    def __str__(self) -> str:
        if self.judged is None:
            text = f"No path: {self.reason}"
            if self.proof:
                text += f"\nProof: {self.proof['statement']}."
            return text
        start, end = self.path[[0, -1]]
        ends = f"From {_place(self.corners[0], start, self.run_down)} to {_place(self.corners[1], end, self.run_up)}"
        size = f"{len(self.path)} corners, {self.length:.4f} rad, {self.duration:g} s, {self.law}"
        if not self.length:
            size += ", nothing moves"
        runs = [
            *_run_in_words("before it the clock of the gait stops", self.run_down),
            *_run_in_words("after it the clock of the gait starts", self.run_up),
        ]
        how = "as a table" if runs else "there and back"
        lines = [f"{ends}: {size}; checked {how}", *runs]
        if self.reason is not None and self.reason != self.judged.reason:
            lines.append(f"  not flyable: {self.reason}")
        return "\n".join([*lines, str(self.judged)])


def _place(corner: int | None, alpha: FloatArray, run: RunUp | None) -> str:
    """Return where a path leaves or joins a gait, in words."""
    if corner is None:
        return HOVER
    place = f"corner {corner + 1}" if run is None else "row 1"
    return f"{place} {tuple(alpha.round(3).tolist())}"


def _run_in_words(what: str, run: RunUp | None) -> list[str]:
    """Return the line that says what happens in a run-up or a run-down, if there is one."""
    if run is None:
        return []
    plural = "s" if run.periods > 1 else ""
    return [f"  {what}: {run.periods} period{plural} of it in {run.period:.4g} s"]


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
    leaving, joining = _ends_of(start, end, vehicle, coefficients)
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
    seconds = _DURATION if duration is None else float(duration)
    checked_clock(seconds, law, samples=samples, rate=rate)
    reason, proof = _refusal(first, last, floor)
    if reason is not None:
        return Transition(reason=reason, proof=proof, law=law)
    path = _shortest(leaving, joining, floor)
    if isinstance(path, str):
        return Transition(reason=path, law=law)

    gait = there_and_back(path.alpha, first)
    # Both those of the vehicle and those that the tables were made for.
    limits = lowest_limits([leaving.limits, joining.limits])
    limited = replace(gait, vehicle=vehicle_within(gait.vehicle, limits))
    if duration is None:
        seconds = _least_duration(limited, law)
    run_down, run_up = leaving.run_up(stops=True), joining.run_up()
    runs = [run.period for run in (run_down, run_up) if run is not None]
    count = checked_clock(seconds + sum(runs), law, samples=samples, rate=rate)
    motion = TimedPath.of(gait.parametrize(2 * seconds, law=law))
    answer = Transition(
        reason=None,
        motion=replace(motion, samples=count),
        run_down=run_down,
        run_up=run_up,
        corners=(leaving.numbers[path.leaves], joining.numbers[path.joins]),
        law=law,
        limits=limits,
    )
    return _judged(answer, limited, floor, leaving, joining)


class _End(NamedTuple):
    """An end of a path: a gait, its corners that a path may join, its motion if it has times, and its limits of rates.

    The corners are those of a gait, `place`, with their numbers in the whole one, None for hover.
    """

    gait: Gait
    place: Gait
    numbers: Sequence[int | None]
    motion: TimedGait | None = None
    limits: Mapping[str, Each] = MappingProxyType({})

    def run_up(self, *, stops: bool = False) -> RunUp | None:
        """Return the run-up of a gait in motion where the path joins it, or with `stops` its run-down; else None."""
        if self.motion is None:
            return None
        return run_up(self.motion, stops=stops)


def _ends_of(
    start: GaitLike,
    end: GaitLike,
    vehicle: VehicleLike | None,
    coefficients: CoefficientsLike | None,
) -> list[_End]:
    """Return both ends of a path; hover is that of the vehicle of the other end."""
    ends = {}
    for name, handed in (("start", start), ("end", end)):
        if not (isinstance(handed, str) and handed == HOVER):
            ends[name] = _end_of(handed, name, vehicle, coefficients)
    body = PAPER if vehicle is None else vehicle
    upright = np.zeros((1, 4))
    gaits = [known.gait for known in ends.values()]
    gaits.append(Gait(alpha=upright, vehicle=body, coefficients=coefficients))
    hover = _hover_like(gaits[0])
    return [ends.get(name, hover) for name in ("start", "end")]


def _hover_like(gait: Gait) -> _End:
    """Return hover as an end, for the vehicle and the coefficients of a gait."""
    rotors = gait.coefficients.rotors
    colors = gait.colors[:1]
    if rotors.asymmetry is None:
        colors = ("red",)
    hover = replace(gait, alpha=hover_on_sheet(rotors), colors=colors, request={})
    return _End(hover, hover, [None])


def _end_of(
    handed: GaitLike,
    name: str,
    vehicle: VehicleLike | None,
    coefficients: CoefficientsLike | None,
) -> _End:
    """Return a gait as an end: all its corners, or the first row of one with times."""
    given = given_gait(
        handed, vehicle=vehicle, coefficients=coefficients, name=name, once=False
    )
    table = given.table
    is_timed = given.motion is not None
    if table is not None:
        is_timed = "t" in table
    if is_timed:
        motion = played(given)
        limits: Mapping[str, Any] = motion.made_for if table is None else table.limits
        place = gait_through(motion.at(0.0).alpha[None], motion.gait)
        each = {kind: tuple(limit) for kind, limit in limits.items()}
        return _End(motion.gait, place, [0], motion, each)
    place = given.gait
    numbers = list(range(len(place.alpha)))
    if is_lifted(place):  # the law `smooth` rests at some of its rows
        numbers = path_of(place).corners.tolist()
        place = replace(place, alpha=place.alpha[numbers])
    return _End(given.gait, place, numbers)


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
    if ROW_BY_ROW in laws and broken and broken <= set(RATE_CHECKS):
        reason = f"{reason}; the gait is known by its rows alone, and more of them may be enough"
    return replace(answer, reason=reason, judged=report)


def _refusal(
    first: Gait, last: Gait, floor: float
) -> tuple[str | None, dict[str, Any] | None]:
    """Return why there is certainly no path between two gaits, and the proof if the signs of R differ."""
    is_decided = True
    for name, gait in (("start", first), ("end", last)):
        report = gait.check(floor=floor)
        fault = _fault_of(gait, report)
        if fault:
            return f"the {name} is {fault}", None
        is_decided &= report["R_sign"].decided
    at_start, at_end = _largest_R(first.R), _largest_R(last.R)
    proof = None
    if at_start * at_end < 0:
        proof = {"R_start": at_start, "R_end": at_end, "statement": _STATEMENT}
    reason = None
    if proof is not None and is_decided:
        home = "R > 0"
        if first.vehicle.asymmetry is None:
            home += f", in the component of α = 0, {home_in_words(first.vehicle)}"
        reason = (
            f"R = {at_start:+.4g} at the start and {at_end:+.4g} at the end, so every flight between them passes a "
            f"singular matrix, at any attitude. Plan with the same sign of R (hover has {home}), or start the flight in "
            "the gait"
        )
    elif first.color != last.color:
        reason = (
            f"the start is {first.color} and the end {last.color}, and the sheets meet in four points only, all with "
            "R = 0. In exact physics all of blue is singular; use red"
        )
    elif proof is not None:
        reason = (
            "the signs of R differ, as far as rounded coefficients decide them; use red"
        )
    return reason, proof


def _largest_R(values: FloatArray) -> float:
    """Return the R of a gait that is farthest from 0, whose sign is the most certain."""
    return float(values[np.argmax(np.abs(values))])


def _fault_of(gait: Gait, report: Report) -> str:
    """Return why a gait is no end of a path, "" if it is one: it must be valid, or on a curved sheet flyable."""
    if gait.vehicle.asymmetry is None:
        if report.valid:
            return ""
        return f"not valid: {report.reason}"
    off = sheet_of(gait.coefficients.rotors).distances(gait.alpha).max()
    if off > DEFAULT_TOLERANCE:
        return f"{off:.2g} rad off the curved sheet"
    if report.flyable:
        return ""
    return f"not flyable: {report.reason}"


class _Path(NamedTuple):
    """A path, shape (n, 4) [rad], and the corners of the gaits that it leaves and joins, counted from 0."""

    alpha: FloatArray
    leaves: int
    joins: int


def _shortest(leaving: _End, joining: _End, floor: float) -> _Path | str:
    """Return the shortest path between corners of two gaits, or the reason why there is none."""
    first, last = leaving.place, joining.place
    is_curved = first.vehicle.asymmetry is not None
    color: Color = "blue" if first.color == "blue" else "red"
    requirements: list[Requirement] = ["flyable", "valid"]
    if color == "blue":
        requirements = ["valid"]
    elif is_curved:
        requirements = ["flyable"]
    else:
        # R with rounded coefficients leaks through the saddles; the signs of its factors do not.
        ends = _plane_of(first)[0], _plane_of(last)[0]
        wall = separating_factor(*ends, first.vehicle)
        if wall:
            return f"both ends are on the red sheet, separated by {wall}, where R = 0; use gaits in one component"
    # The sign on the sheet itself: printed digits may turn that of a residue of rounding.
    on_sheet = first if is_curved else _on_sheet(first, first.alpha[:, :2])
    sign: Sign = "positive" if _largest_R(on_sheet.R) > 0 else "negative"
    for require in requirements:
        branch_of = partial(Branch, color=color, sign=sign, require=require)
        path = _shortest_of(first, last, floor, branch_of)
        if path is not None:
            return path
    return f"none was found on the {color} sheet with this sign of R, between any of the corners tried"


def _shortest_of(
    first: Gait, last: Gait, floor: float, branch_of: Callable[..., Branch]
) -> _Path | None:
    """Return the shortest path from a corner of one gait to one of another, in a branch of its own request; else None."""
    points, others = _plane_of(first), _plane_of(last)
    # Of corners equally near, the path back joins the same.
    is_backward = last.alpha.tolist() < first.alpha.tolist()
    pairs = []
    for leaves, joins in product(_nearest(points, others), _nearest(others, points)):
        order = (joins, leaves) if is_backward else (leaves, joins)
        pairs.append((math.dist(points[leaves], others[joins]), order, leaves, joins))
    shortest = None
    length = math.inf
    for distance, _, leaves, joins in sorted(pairs):
        if distance >= length:
            break  # no path is shorter than the straight line
        start, end = points[leaves], others[joins]
        request = plan_request(
            sorted([start, end]),  # so that the path back is the path there
            vehicle=first.vehicle,
            coefficients=first.coefficients.kind,
            floor=floor,
        )
        plane = shortest_path(branch_of(search=Search(request)))
        if plane is not None and length_of(plane) < length:
            length = length_of(plane)
            shortest = (plane if start <= end else plane[::-1]), leaves, joins
    if shortest is None:
        return None
    plane, leaves, joins = shortest
    inner = _on_sheet(first, plane).alpha[1:-1]
    # A printed gait is a little beside its sheet: the path begins and ends at its own corners.
    alpha = np.vstack([first.alpha[leaves], inner, last.alpha[joins]])
    return _Path(alpha, leaves, joins)


def _plane_of(gait: Gait) -> list[Any]:
    """Return the points (α1, α2) of the corners of a gait."""
    corners: list[Any] = np.clip(gait.alpha[:, :2], -HALF_PI, HALF_PI).tolist()
    return corners


def _nearest(corners: list[Any], others: list[Any]) -> list[int]:
    """Return the indices of the corners nearest to any other, at most 16, in order."""
    if len(corners) <= _MOST_CORNERS:
        return list(range(len(corners)))
    from scipy.spatial import cKDTree

    distance, _ = cKDTree(others).query(corners)
    return sorted(np.argsort(distance, kind="stable")[:_MOST_CORNERS].tolist())


def _on_sheet(gait: Gait, plane: Any) -> Gait:
    """Return points of the plane on the sheet of a gait's first corner; on a curved one with rows between them."""
    if gait.vehicle.asymmetry is not None:
        rows = sheet_of(gait.coefficients.rotors).rows(plane)
        return gait_through(rows.alpha, gait)
    return lift(
        plane,
        gait.colors[0],
        vehicle=gait.vehicle,
        coefficients=gait.coefficients,
    )
