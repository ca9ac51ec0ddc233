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
from dataclasses import dataclass, field, replace
from itertools import product
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gaitgraph.angles import HALF_PI, checked_number, number_of
from gaitgraph.errors import Infeasible, InputError, shown
from gaitgraph.gait.gait import Gait, lift
from gaitgraph.gait.given import given_gait
from gaitgraph.gait.table import RATE_CHECKS, RATE_UNITS, Table
from gaitgraph.io.formats import write_tables
from gaitgraph.planning.any_angle import shortest_path
from gaitgraph.planning.refusal import Branch
from gaitgraph.planning.request import plan_request
from gaitgraph.surface.sheets import home_in_words, red_label, separating_factor
from gaitgraph.timing.joining import (
    JoinedPath,
    RunUp,
    lowest_limits,
    played,
    run_up,
    vehicle_within,
)
from gaitgraph.timing.laws import DEFAULT_LAW, LawName
from gaitgraph.timing.timed_gait import (
    MOST_SAMPLES,
    RowTimedGait,
    TimedPath,
    checked_clock,
    table_of,
)
from gaitgraph.tolerances import DEFAULT_FLOOR
from gaitgraph.validation.report import verdict_of
from gaitgraph.validation.validating import validate
from gaitgraph.vehicle import PAPER, four_of

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from gaitgraph.gait.given import GaitLike
    from gaitgraph.invertibility.coefficients import CoefficientsLike
    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.surface.sheets import Color, Sign
    from gaitgraph.timing.timed_gait import TimedGait
    from gaitgraph.validation.report import Report
    from gaitgraph.vehicle import Each, VehicleLike

HOVER = "hover"
"""α = 0: ordinary hover, rotors upright."""

_MOST_CORNERS = 16
_DURATION = 1.0
_LONGEST = 5e8
_STATEMENT = (
    "formula (1) is continuous in tilt angles and attitude. At both ends it is R·cos φ·cos θ, which has the sign of R "
    "for |φ|, |θ| < π/2. So every flight between them passes a zero of it, where the decoupling matrix is singular"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Transition:
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

    def write(self, *paths: str | Path, force: bool = False, periods: int = 1) -> None:
        """Write the table of the path; see :func:`gaitgraph.io.formats.write_tables`."""
        write_tables(self.table, paths, force=force, periods=periods)

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
        A gait in any form, or "hover" for α = 0. A gait without times is left and joined at one of its corners, where
        the law `smooth` rests; a gait with times, as a table, at its first row. If it is in motion there, its clock
        starts slowly after the path, or stops slowly before it, see :func:`gaitgraph.timing.joining.run_up`.
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
    ends = [
        None
        if isinstance(one, str) and one == HOVER
        else _end_of(one, name, vehicle, coefficients)
        for name, one in (("start", start), ("end", end))
    ]
    gaits = [one.gait for one in ends if one is not None]
    hover = (
        replace(gaits[0], alpha=np.zeros((1, 4)), colors=("red",), request={})
        if gaits
        else None
    )
    body = PAPER if vehicle is None else vehicle
    hover = hover or Gait(
        alpha=np.zeros((1, 4)), colors=("red",), vehicle=body, coefficients=coefficients
    )
    first, last = (hover if one is None else one.gait for one in ends)
    if (first.vehicle, first.coefficients) != (last.vehicle, last.coefficients):
        raise InputError(
            f"end must be a gait for {first.vehicle.name!r} ({first.coefficients.kind} coefficients), as the start is, "
            f"got one for {last.vehicle.name!r} ({last.coefficients.kind}); give one vehicle for both",
            field="end",
        )
    if duration is not None and not 1e-6 <= number_of(duration) <= _LONGEST:
        raise InputError(
            f"duration must be between 1e-6 and 5e8 s, got {shown(duration)}",
            field="duration",
        )
    seconds = _DURATION if duration is None else float(duration)
    count = _checked_samples(seconds, law, samples, rate)
    floor = checked_number("floor", floor)

    refused = Transition(
        there_and_back=None, reason=None, duration=seconds, law=law, samples=count
    )
    reason, proof = _refusal(first, last)
    if reason is not None:
        return replace(refused, reason=reason, proof=proof)
    leaves, joins = (hover if one is None else one.place for one in ends)
    found = _shortest(leaves, joins, floor)
    if isinstance(found, str):
        return replace(refused, reason=found)
    path, corners = found
    alpha = np.vstack([path, path[-2:0:-1]])
    gait = replace(
        first, alpha=alpha, colors=(first.colors[0],) * len(alpha), request={}
    )
    # Both those of the vehicle and those that the tables were made for.
    limits = lowest_limits(one.limits for one in ends if one is not None)
    limited = replace(gait, vehicle=vehicle_within(gait.vehicle, limits))
    if duration is None:
        # One second, or how long one way takes within the limits if that is more.
        once = limited.parametrize(2.0, law=law)
        for order, kind in enumerate(RATE_UNITS, start=1):
            limit = getattr(limited.vehicle, f"max_tilt_{kind}")
            if limit is not None and np.isfinite(
                share := float((once.peaks(order) / limit).max())
            ):
                seconds = max(seconds, share ** (1 / order))
        seconds = min(math.ceil(seconds * 1000) / 1000, _LONGEST)
    left, joined = (None if one is None else one.motion for one in ends)
    planned = replace(
        refused,
        there_and_back=gait,
        corners=(
            None if ends[0] is None else corners[0],
            None if ends[1] is None else corners[1],
        ),
        duration=seconds,
        run_down=None if left is None else run_up(left, stops=True),
        run_up=None if joined is None else run_up(joined),
        limits=limits,
    )
    count = _checked_samples(planned.timed.period, law, samples, rate)
    planned = replace(planned, samples=count)
    if planned.run_down is None and planned.run_up is None:
        timed = limited.parametrize(2 * seconds, law=law)
        report = gait.check(floor=floor).with_timing(TimedPath.of(timed))
    else:
        report = validate(
            planned.table,
            vehicle=limited.vehicle,
            coefficients=limited.coefficients.kind,
            floor=floor,
        )
    reason = None if report.flyable else report.reason
    broken = [check.name for check in report.checks if not check.ok]
    of_rows = any(isinstance(one, RowTimedGait) for one in (left, joined))
    if of_rows and broken and set(broken) <= set(RATE_CHECKS):
        reason = f"{reason}; the gait is known by its rows alone, and more of them may be enough"
    return replace(planned, reason=reason, judged=report)


class _End(NamedTuple):
    """A gait at an end of a path: the whole, the corners that may be joined, its motion, and its limits of rates."""

    gait: Gait
    place: Gait
    motion: TimedGait | None
    limits: Mapping[str, Each]


def _end_of(
    handed: GaitLike,
    name: str,
    vehicle: VehicleLike | None,
    coefficients: CoefficientsLike | None,
) -> _End:
    """Return what a path may join: the corners of a gait without times, the first row of one with times."""
    given = given_gait(
        handed, vehicle=vehicle, coefficients=coefficients, name=name, once=False
    )
    table = given.table
    has_times = given.motion is not None if table is None else "t" in table
    if not has_times:
        return _End(given.gait, given.gait, None, {})
    motion = played(given)
    made_for: Mapping[str, Any] = motion.made_for if table is None else table.limits
    limits: dict[str, Each] = {kind: tuple(one) for kind, one in made_for.items()}
    gait = motion.gait
    place = replace(
        gait, alpha=motion.at(0.0).alpha[None], colors=gait.colors[:1], request={}
    )
    return _End(gait, place, motion, limits)


def _checked_samples(
    duration: float, law: LawName, samples: int | None, rate: float | None
) -> int:
    """Return the number of intervals one way; there and back has twice as many."""
    count = checked_clock(duration, law, samples=samples, rate=rate)
    if count > MOST_SAMPLES // 2:
        name, value = ("samples", samples) if rate is None else ("rate", rate)
        raise InputError(
            f"{name} must give at most {MOST_SAMPLES // 2} samples, got {shown(value)}",
            field=name,
        )
    return count


def _refusal(first: Gait, last: Gait) -> tuple[str | None, dict[str, Any] | None]:
    """Return why there is certainly no path between two gaits, and the proof if the signs of R differ."""
    reports = [gait.check() for gait in (first, last)]
    for name, report in zip(("start", "end"), reports, strict=True):
        if not report.valid:
            return f"the {name} is not valid: {report.reason}", None
    values = [float(gait.R[np.argmax(np.abs(gait.R))]) for gait in (first, last)]
    proof = None
    if values[0] * values[1] < 0:
        proof = {"R_start": values[0], "R_end": values[1], "statement": _STATEMENT}
        if all(report["R_sign"].decided for report in reports):
            where = f"R = {values[0]:+.4g} at the start and {values[1]:+.4g} at the end"
            home = f"in the component of α = 0, {home_in_words(first.vehicle)}"
            advice = f"Plan with the same sign of R (hover has R > 0, {home}), or start the flight in the gait"
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


def _shortest(
    first: Gait, last: Gait, floor: float
) -> tuple[FloatArray, tuple[int, int]] | str:
    """Return the shortest path and the corners that it joins, or the reason why there is none."""
    color: Color = "red" if first.color == "red" else "blue"
    # The sign on the sheet itself: printed digits may turn that of a residue of rounding.
    on_sheet = lift(
        first.alpha[:, :2],
        first.colors,
        vehicle=first.vehicle,
        coefficients=first.coefficients,
    ).R
    sign: Sign = "positive" if on_sheet[np.argmax(np.abs(on_sheet))] > 0 else "negative"
    points, others = (
        np.clip(gait.alpha[:, :2], -HALF_PI, HALF_PI) for gait in (first, last)
    )
    turned = (
        last.alpha.tolist() < first.alpha.tolist()
    )  # of corners equally near, the path back joins the same
    corners = product(_nearest(points, others), _nearest(others, points))
    joined = [(math.dist(points[a], others[b]), a, b) for a, b in corners]
    if color == "red":
        # R with rounded coefficients leaks through the saddles; the signs of its factors do not.
        labels, goals = (
            red_label(plane[:, 0], plane[:, 1], first.vehicle)
            for plane in (points, others)
        )
        if not (
            one_part := [
                pair for pair in joined if (labels[pair[1]] == goals[pair[2]]).all()
            ]
        ):
            wall = separating_factor(
                points[0].tolist(), others[0].tolist(), first.vehicle
            )
            return f"both ends are on the red sheet, separated by {wall}, where R = 0; use gaits in one component"
        joined = one_part
    for use in ("flyable", "valid") if color == "red" else ("valid",):
        best: tuple[float, int, int, list[Any]] | None = None
        for distance, a, b in sorted(
            joined, key=lambda one: (one[0], one[::-1] if turned else one)
        ):
            if best is not None and distance >= best[0]:
                break  # no path is shorter than the straight line
            ends = sorted(
                [points[a].tolist(), others[b].tolist()]
            )  # the path back is the path there
            request = plan_request(
                ends,
                vehicle=first.vehicle,
                coefficients=first.coefficients.kind,
                floor=floor,
            )
            leg = shortest_path(Branch(request=request, color=color, sign=sign), use)
            if leg is not None and (best is None or leg.length < best[0]):
                bends = leg.points[1:-1]
                best = (
                    leg.length,
                    a,
                    b,
                    bends if ends[0] == points[a].tolist() else bends[::-1],
                )
        if best is not None:
            _, a, b, bends = best
            path = lift(
                [points[a], *bends, others[b]],
                color,
                vehicle=first.vehicle,
                coefficients=first.coefficients,
            )
            # A printed gait is a little beside its sheet: the path begins and ends at its own corners.
            return np.vstack([first.alpha[a], path.alpha[1:-1], last.alpha[b]]), (a, b)
    return f"none was found on the {color} sheet with this sign of R, between any of the corners tried"


def _nearest(corners: FloatArray, others: FloatArray) -> list[int]:
    """Return the indices of the corners nearest to any other, at most 16, in order."""
    if len(corners) <= _MOST_CORNERS:
        return list(range(len(corners)))
    from scipy.spatial import cKDTree

    distance, _ = cKDTree(others).query(corners)
    return sorted(np.argsort(distance, kind="stable")[:_MOST_CORNERS].tolist())
