"""Transitions: paths on the surface between gaits, and between hover and a gait, as timed tables.

A path is the shortest there is, at any angle, from a corner of one gait to a corner of the other. Run there and back it
is a gait, which is how it is checked and timed.

Between different signs of R there is none. Formula (1) is continuous in the tilt angles and the attitude; on a gait
of the surfaces it is R·cos φ·cos θ, which has the sign of R for |φ|, |θ| < π/2. A flight from one sign to the other
passes its zero, where the decoupling matrix is singular.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitgraph.angles import HALF_PI, checked_number, number_of
from gaitgraph.errors import Infeasible, InputError, shown
from gaitgraph.gait.gait import Gait, lift
from gaitgraph.gait.table import Table, merged
from gaitgraph.invertibility.matrices import DEFAULT_FLOOR, FloatArray
from gaitgraph.io.formats import gait_of, write_tables
from gaitgraph.planning.any_angle import shortest_path
from gaitgraph.planning.refusal import Branch
from gaitgraph.planning.request import plan_request
from gaitgraph.surface.sheets import FIBERS, red_label, separating_factor
from gaitgraph.timing.laws import DEFAULT_LAW, LawName
from gaitgraph.timing.timed_gait import (
    MOST_SAMPLES,
    TimedPath,
    checked_clock,
    pieces_of,
)
from gaitgraph.vehicle import PAPER

if TYPE_CHECKING:
    from pathlib import Path

    from gaitgraph.invertibility.matrices import CoefficientsLike
    from gaitgraph.io.formats import GaitLike
    from gaitgraph.surface.sheets import Color, Sign
    from gaitgraph.validation.report import Report
    from gaitgraph.vehicle import VehicleLike

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
    hover. `duration` [s], `law` and `samples` are those in one direction; `judged` is the `report`, None
    if there is no path.
    """

    there_and_back: Gait | None
    reason: str | None
    proof: dict[str, Any] | None = None
    corners: tuple[int | None, int | None] = (None, None)
    duration: float = _DURATION
    law: LawName = DEFAULT_LAW
    samples: int = 100
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
    def timed(self) -> TimedPath:
        """The path, timed; its `loop` leads there and back."""
        return TimedPath.of(
            self.gait.parametrize(
                2 * self.duration, law=self.law, samples=2 * self.samples
            )
        )

    @property
    def _ends(self) -> dict[str, int | None]:
        """The corners that the path leaves and joins, counted from 1."""
        numbers = (None if corner is None else corner + 1 for corner in self.corners)
        return dict(zip(("leaves_corner", "joins_corner"), numbers, strict=True))

    @property
    def table(self) -> Table:
        """The table of the path, from t = 0 to its duration; raises Infeasible if there is none."""
        about = {"made_by": "transition", "transition": self._ends}
        return merged(pieces_of(self.timed, about))

    def write(self, *paths: str | Path, force: bool = False, periods: int = 1) -> None:
        """Write the table of the path; see :func:`gaitgraph.io.formats.write_tables`."""
        write_tables(self.table, paths, force=force, periods=periods)

    def as_mapping(self) -> dict[str, Any]:
        """Return the transition as plain values, ready for JSON."""
        found = self.judged.as_mapping() if self.judged is not None else {}
        keys = (
            "valid",
            "two_color",
            "flyable",
            "reachable_from_hover",
            "checks",
            "warnings",
        )
        return {
            "status": self.status,
            "reason": self.reason,
            "path": self.path.tolist() if self else [],
            "colors": list(self.gait.colors[: len(self.path)]) if self else [],
            "length": self.length if self else None,
            "duration": self.duration if self else None,
            "law": self.law,
            **self._ends,
            "proof": self.proof,
            **{
                key: found.get(key, [] if key in ("checks", "warnings") else False)
                for key in keys
            },
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
        ends = [
            HOVER
            if corner is None
            else f"corner {corner + 1} {tuple(round(float(a), 3) for a in alpha)}"
            for corner, alpha in zip(
                self.corners, (self.path[0], self.path[-1]), strict=True
            )
        ]
        size = f"{len(self.path)} corners, {self.length:.4f} rad, {self.duration:g} s, {self.law}"
        size += "" if self.length else ", nothing moves"
        return f"From {ends[0]} to {ends[1]}: {size}; checked there and back\n{self.report}"


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
        A gait in any form, or "hover" for α = 0. A gait is left and joined at one of its corners, where the law
        `smooth` rests.
    duration
        Duration [s]; by default 1 s, or what the vehicle's limits of tilt rate and acceleration need if that is more.
    law, samples, rate
        As for :meth:`gaitgraph.gait.gait.Gait.parametrize`, over the duration.
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
        one
        if isinstance(one, str) and one == HOVER
        else gait_of(one, vehicle=vehicle, coefficients=coefficients, name=name)
        for name, one in (("start", start), ("end", end))
    ]
    gaits = [one for one in ends if isinstance(one, Gait)]
    hover = (
        replace(gaits[0], alpha=np.zeros((1, 4)), colors=("red",), request={})
        if gaits
        else None
    )
    body = PAPER if vehicle is None else vehicle
    hover = hover or Gait(
        alpha=np.zeros((1, 4)), colors=("red",), vehicle=body, coefficients=coefficients
    )
    first, last = (one if isinstance(one, Gait) else hover for one in ends)
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
    found = _shortest(first, last, floor)
    if isinstance(found, str):
        return replace(refused, reason=found)
    path, corners = found
    alpha = np.vstack([path, path[-2:0:-1]])
    gait = replace(
        first, alpha=alpha, colors=(first.colors[0],) * len(alpha), request={}
    )
    if duration is None:
        # One second, or how long one way takes within the vehicle's limits if that is more.
        once, body = gait.parametrize(2.0, law=law), gait.vehicle
        for order, limit in enumerate(
            (body.max_tilt_rate, body.max_tilt_acceleration, body.max_tilt_jerk),
            start=1,
        ):
            if limit is not None and np.isfinite(
                share := float((once.peaks(order) / limit).max())
            ):
                seconds = max(seconds, share ** (1 / order))
        seconds = min(math.ceil(seconds * 1000) / 1000, _LONGEST)
        count = _checked_samples(seconds, law, samples, rate)
    timed = gait.parametrize(2 * seconds, law=law)
    report = gait.check(floor=floor).with_checks(timed.rate_checks("duration", 0.5))
    return replace(
        refused,
        there_and_back=gait,
        reason=None if report.flyable else report.reason,
        corners=(
            None if ends[0] == HOVER else corners[0],
            None if ends[1] == HOVER else corners[1],
        ),
        duration=seconds,
        samples=count,
        judged=report,
    )


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
            limit = 2 * first.vehicle.signed_drag_ratio
            home = f"in the component of α = 0, tan α1 − tan α2 {'<' if limit > 0 else '>'} {limit:.4f}"
            advice = f"Plan with the same sign of R (hover has R > 0, {home}), or start the flight in the gait"
            return (
                f"{where}, so every flight between them passes a singular matrix, at any attitude. {advice}",
                proof,
            )
    if {*first.colors, *last.colors} & set(FIBERS):
        return (
            "one of the ends is on a fibre, and paths stay on one sheet; use gaits on the red sheet",
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
