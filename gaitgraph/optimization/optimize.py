"""Optimal gaits: the smooth loop through discs whose worst place is best, or whose tilting costs least.

The worst case first: the highest level that any loop through the discs can keep is bracketed, with a proof, by the
components of regions (:mod:`gaitgraph.optimization.bounds`). Of the loops that keep this level but for a small
concession, one of locally least tilt-rate effort is found (:mod:`gaitgraph.optimization.least_effort`). So the worst
case is optimal among all loops, to within a stated gap, and the form of the loop is a local optimum. If the effort
itself is the objective the loop is a local optimum, stated with a lower bound of all loops' effort.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt
import shapely

from gaitgraph.angles import angle_from_text, number_of
from gaitgraph.errors import Infeasible, InputError, did_you_mean, shown
from gaitgraph.gait.table import ROWS_OF_A_PIECE, Table, merged
from gaitgraph.invertibility.matrices import DEFAULT_FLOOR, Coefficients, Kind, coefficients_of
from gaitgraph.optimization.bounds import (
    Discs,
    component_meeting,
    highest_level,
    largest_share,
    least_loop_length,
    level_region,
    shortest_loop,
    why_apart,
)
from gaitgraph.optimization.least_effort import FEWEST_PIECES, LeastEffort, SmoothLoop, power_pieces
from gaitgraph.planning.request import checked_waypoints
from gaitgraph.planning.shortest_paths import ShortestPaths
from gaitgraph.surface.admissible import admissible_region
from gaitgraph.surface.region import Zones, offset
from gaitgraph.timing.curve import Curve
from gaitgraph.timing.timed_gait import TimedGait, checked_clock, pieces_of
from gaitgraph.timing.timing_laws import derivative_of
from gaitgraph.validation.report import Report, lines_of_checks, verdict_line
from gaitgraph.validation.rules import checked_limits
from gaitgraph.vehicle import PAPER, Vehicle

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from shapely import Polygon

    from gaitgraph.gait.gait import Gait
    from gaitgraph.planning.request import Angle, Points

FloatArray = npt.NDArray[np.float64]
Objective = Literal["singular_value", "hover_reserve", "tilt_rate"]
Sign = Literal["positive", "negative"]

OBJECTIVES = ("singular_value", "hover_reserve", "tilt_rate")
"""What a gait can be optimal in, the default first."""

CLEARANCE = 1e-5
"""How far an optimal gait keeps from the borders of its region, at least; 3e-5 at most where it follows them [rad]."""

_MOST_WAYPOINTS = 40
_MOST_PIECES = 400
_EROSIONS = (1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1.5e-5)
_SETTLED = 1e-3  # first-order residual
_UNSETTLED = "the form of the loop is not settled: its effort can still be lowered, its worst case stands"
_CHORD = 1e-4
_TEXTS = {  # name, unit, and which side of the value the bound is on
    "singular_value": ("least singular value along the gait", "", "at most"),
    "hover_reserve": ("hover reserve along the gait", " of m·g", "at most"),
    "tilt_rate": ("tilt-rate effort", " rad²/s", "at least"),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Optimality:
    """How good a gait is; everything here can be checked without the search.

    Parameters
    ----------
    gap
        What a better gait could gain at most, as a fraction of the bound (a worst case), or of the value (effort).
    stationarity
        What is left of the slope of the effort when the active constraints are taken off, as a fraction of it: zero at
        a point that meets the first-order (Karush–Kuhn–Tucker) conditions; 0 for a gait that stands still.
    violation
        How far the gait passes outside a disc, at most [rad]; of the region it is never outside.
    active
        What holds the gait, in words.
    """

    gap: float
    stationarity: float
    violation: float
    active: tuple[str, ...]

    def as_mapping(self) -> dict[str, Any]:
        """Return plain values, ready for JSON."""
        return asdict(self) | {"active": list(self.active)}


@dataclass(frozen=True, slots=True, kw_only=True)
class OptimalGait:
    """The answer to :func:`optimal_gait`: a smooth gait with its own measures, or why there is none. Truthy with one.

    Parameters
    ----------
    objective
        One of :data:`OBJECTIVES`.
    waypoints, radius
        Centres, shape (n, 2), and radii, shape (n,), of the discs to pass [rad]; repeated ones merged.
    period
        T [s].
    reason
        Why there is no gait, or why it is not flyable; None if it is.
    sign
        Sign of R: "positive" or "negative"; None without a gait.
    curve
        The gait as a smooth curve; its parameter is the time [s].
    report
        All checks, along the whole curve.
    value, bound
        What was reached, certain along the whole curve; and what no gait can better: an upper bound of a worst case,
        a lower bound of effort.
    effort
        ∫ ‖α̇‖² dt over the period [rad²/s].
    optimality
        How good the gait is.
    passed, times
        Where, shape (n, 4) [rad], and when, shape (n,) [s], the discs are passed.
    history
        The effort of every loop on the way, the last one the gait's [rad²/s].
    warnings
        What deserves attention.
    """

    objective: Objective
    waypoints: FloatArray
    radius: FloatArray
    period: float
    reason: str | None
    sign: str | None = None
    curve: Curve | None = None
    report: Report | None = None
    value: float | None = None
    bound: float | None = None
    effort: float | None = None
    optimality: Optimality | None = None
    passed: FloatArray | None = None
    times: FloatArray | None = None
    history: tuple[float, ...] = ()
    warnings: tuple[str, ...] = ()

    @property
    def status(self) -> str:
        """Whether a gait was "found", or it is "infeasible"."""
        return "found" if self else "infeasible"

    def __bool__(self) -> bool:
        return self.curve is not None

    def _found(self) -> Curve:
        if self.curve is None:
            raise Infeasible(self.reason)
        return self.curve

    @property
    def gait(self) -> Gait:
        """The gait as a closed polyline within 1e-4 rad of the curve; Infeasible, with the reason, if there is none."""
        return self._found().polyline(_CHORD)

    def table(self, *, samples: int | None = None, rate: float | None = None) -> Table:
        """Return even samples of the curve with exact rates and accelerations, as a table; Infeasible if there is none.

        `samples` and `rate` are as for :func:`gaitgraph.timing.timed_gait.parametrize`.
        """
        return merged(self.pieces(samples=samples, rate=rate))

    def pieces(
        self, *, samples: int | None = None, rate: float | None = None, rows: int = ROWS_OF_A_PIECE
    ) -> Iterator[Table]:
        """Yield :meth:`table` as consecutive pieces of at least 2 rows, so that any length fits in memory."""
        curve = self._found()
        count = checked_clock(self.period, "smooth", samples=samples, rate=rate)
        about = {
            "vehicle": curve.vehicle.as_mapping(),
            "coefficients": curve.coefficients.kind,
            "crossing_tolerance": curve.crossing_tolerance,
            "period": self.period,
            "made_by": "optimize",
            "objective": self.objective,
            "waypoints": self.waypoints.tolist(),
            "radius": self.radius.tolist(),
        }
        for piece in pieces_of(_timed(curve, count), rows=rows):
            yield replace(piece, about=about)

    def as_mapping(self) -> dict[str, Any]:
        """Return the answer as plain values, ready for JSON; a saved one can be read as a gait file."""
        verdict = self.report.as_mapping() if self.report is not None else {}
        gait = self.gait if self.curve is not None else None
        return {
            "status": self.status,
            "reason": self.reason,
            "objective": self.objective,
            "sign": self.sign,
            "waypoints": self.waypoints.tolist(),
            "radius": self.radius.tolist(),
            "period": self.period,
            "value": self.value,
            "bound": self.bound,
            "effort": self.effort,
            "length": self.curve.length if self.curve is not None else None,
            "optimality": None if self.optimality is None else self.optimality.as_mapping(),
            "passed": [] if self.passed is None else self.passed.tolist(),
            "times": [] if self.times is None else self.times.tolist(),
            "history": list(self.history),
            "path": [] if gait is None else gait.alpha.tolist(),
            "colors": [] if gait is None else list(gait.colors),
            "valid": verdict.get("valid", False),
            "flyable": verdict.get("flyable", False),
            "reachable_from_hover": verdict.get("reachable_from_hover", False),
            "checks": verdict.get("checks", []),
            "warnings": [*self.warnings, *verdict.get("warnings", [])],
        }

    def __repr__(self) -> str:
        head = str(self).splitlines()[0] if self else f"infeasible, {len(self.waypoints)} discs"
        return f"<OptimalGait: {head}>"

    def __str__(self) -> str:
        if self.curve is None or self.report is None or self.optimality is None:
            return f"no gait: {self.reason}"
        what, unit, comparison = _TEXTS[self.objective]
        lines = [
            f"{what} {self.value:.4f}{unit}; any gait through these discs has {comparison} {self.bound:.4f}{unit}",
            f"R {'> 0' if self.sign == 'positive' else '< 0'}, length {self.curve.length:.4f} rad, effort "
            f"{self.effort:.4f} rad²/s over {self.period:g} s; first-order residual "
            f"{self.optimality.stationarity:.1e}, held by {', '.join(self.optimality.active) or 'nothing'}",
            verdict_line(self.report.valid, self.report.flyable, self.report.reachable_from_hover),
            *lines_of_checks(self.report.checks),
            *(f"warning: {warning}" for warning in self.warnings),
        ]
        return "\n".join(lines)


def optimal_gait(
    waypoints: Points,
    *,
    radius: Angle | Sequence[Angle] | npt.NDArray[np.float64] = 0.1,
    objective: Objective = "singular_value",
    sign: Literal["auto", "positive", "negative"] = "auto",
    vehicle: Vehicle = PAPER,
    coefficients: Kind | None = None,
    keep_out: Sequence[Points] = (),
    keep_in: Sequence[Points] = (),
    floor: float = DEFAULT_FLOOR,
    period: float = 1.0,
    pieces: int | None = None,
    concession: float = 1e-3,
) -> OptimalGait:
    """Return a smooth closed gait on the red sheet that passes discs in order and is optimal in its worst case.

    The gait is a periodic cubic spline of even pieces, twice continuously differentiable, and stays in the flyable
    region: least singular value at least `floor`, hover thrusts positive, limits of tilt and thrust, polygons.

    Parameters
    ----------
    waypoints
        Centres (α1, α2) of the discs in [−π/2, π/2], numbers [rad] or texts, up to 40. A waypoint that repeats the one
        before is merged with it; the smaller radius counts.
    radius
        Radius of the discs, one for all or one for each; 0 passes the waypoint exactly [rad, or text].
    objective
        "singular_value": the least singular value of the scaled decoupling matrix along the gait is maximised;
        "hover_reserve": what the hover thrusts, in units of m·g per rotor, can fall by until a rotor idles, and grow by
        until one reaches the vehicle's largest thrust, if it states one;
        "tilt_rate": the effort ∫ (α̇1² + α̇2² + α̇3² + α̇4²) dt over the period is minimised [rad²/s].
    sign
        Sign of R: "positive", "negative" or "auto", the better of both.
    vehicle, coefficients
        What the gait is for. Everything physical is judged with the vehicle's exact coefficients.
    keep_out, keep_in
        Polygons as for :class:`gaitgraph.surface.region.Zones`.
    floor
        Least singular value to keep, whatever the objective.
    period
        T [s].
    pieces
        Pieces of the spline, 8 to 400; by default 12 for each waypoint, from 36 to 240. More pieces turn sharper.
    concession
        What fraction of the best worst case is given up for less effort, in (0, 0.5].

    Returns
    -------
    OptimalGait
        Falsy, with the reason, if there is no such gait.

    Raises
    ------
    InputError
        If a value is not allowed; the message names it and what is.

    Notes
    -----
    A worst case is globally optimal to within the stated gap: `bound` holds for every continuous gait in the
    flyable region that passes the discs, whatever its form. That its effort is the least of all gaits that keep
    this level is not guaranteed: it is a local optimum among splines, on the side of each obstacle on which the
    loop that it starts from runs; another side may be better by far. Discs that share a point, or a single disc,
    give a gait that stands still there. With "tilt_rate" the bound is (shortest length in four dimensions)²/T; with
    a radius it takes no notice of the region. No smooth loop attains it where the shortest loop has corners: more
    pieces come nearer, and turn sharper.

    Examples
    --------
    >>> found = optimal_gait([("3pi/8", "-3pi/8"), ("3pi/8", "-pi/8"), ("pi/8", "-pi/8"), ("pi/8", "-3pi/8")])
    >>> bool(found), round(found.value, 2), found.bound - found.value < 1e-3 * found.bound, found.report.flyable
    (True, 0.59, True, True)
    """
    for name, value, known in (("objective", objective, OBJECTIVES), ("sign", sign, ("auto", "positive", "negative"))):
        if not isinstance(value, str) or value not in known:
            hint = did_you_mean(value, list(known)) if isinstance(value, str) else ""
            raise InputError(f"{name} must be {', '.join(known[:-1])} or {known[-1]}, got {shown(value)}{hint}")
    if not 0 < number_of(concession) <= 0.5:
        raise InputError(f"concession must be above 0 and at most 0.5, got {shown(concession)}")
    if not isinstance(vehicle, Vehicle):
        raise InputError(f"vehicle must be a Vehicle, got {shown(vehicle)}")
    checked_limits(floor=floor)
    checked_clock(period, "smooth")
    discs, notes = _discs(waypoints, radius)
    if pieces is None:
        pieces = min(max(36, 12 * len(discs.radii)), 240)
    whole = isinstance(pieces, (int, np.integer)) and not isinstance(pieces, bool)
    if not whole or not FEWEST_PIECES <= pieces <= _MOST_PIECES:
        raise InputError(f"pieces must be a whole number from {FEWEST_PIECES} to {_MOST_PIECES}, got {shown(pieces)}")
    polygons = Zones(keep_out=keep_out, keep_in=keep_in)
    search = _Search(
        discs=discs,
        objective=objective,
        vehicle=vehicle,
        coefficients=coefficients_of(vehicle, coefficients),
        floor=float(floor),
        period=float(period),
        pieces=int(pieces),
        concession=float(concession),
        zones=polygons if polygons.keep_out or polygons.keep_in else None,
    )
    signs: tuple[Sign, ...] = ("positive", "negative") if sign == "auto" else (sign,)
    answers = [search.answer(one) for one in signs]
    found = [answer for answer in answers if answer]
    if not found:
        reason = "; ".join(f"R {'>' if a.sign == 'positive' else '<'} 0: {a.reason}" for a in answers)
        return replace(answers[0], sign=None, reason=reason, warnings=notes)
    better = 1.0 if objective == "tilt_rate" else -1.0
    best = min(found, key=lambda answer: (better * (answer.value or 0.0), answer.sign == "negative"))
    return replace(best, warnings=notes + best.warnings)


def _discs(waypoints: Any, radius: Any) -> tuple[Discs, tuple[str, ...]]:
    """Return checked discs, a waypoint that repeats the one before merged, and notes."""
    centers = checked_waypoints(waypoints, _MOST_WAYPOINTS)
    each = radius if isinstance(radius, (list, tuple, np.ndarray)) and np.ndim(radius) else [radius] * len(centers)
    if len(each) != len(centers):
        raise InputError(f"radius must be one for all waypoints or one for each of {len(centers)}, got {len(each)}")
    radii = [angle_from_text(value, "radius") for value in each]
    for value, given in zip(radii, each, strict=True):
        if not 0 <= value <= 2 * math.pi:
            raise InputError(f"radius must be an angle from 0 to 2π (rad), got {shown(given)}")
    kept: list[int] = []
    for k, center in enumerate(centers):
        if kept and center == centers[kept[-1]]:
            radii[kept[-1]] = min(radii[kept[-1]], radii[k])
        else:
            kept.append(k)
    if len(kept) > 1 and centers[kept[-1]] == centers[kept[0]]:
        radii[kept[0]] = min(radii[kept[0]], radii[kept[-1]])
        kept.pop()
    merged = len(centers) - len(kept)
    notes = (f"merged {merged} waypoint{'s' * (merged > 1)} that repeated the one before",) if merged else ()
    discs = Discs(centers=np.array([centers[k] for k in kept]), radii=np.array([radii[k] for k in kept]))
    discs.centers.flags.writeable = discs.radii.flags.writeable = False
    return discs, notes


@dataclass(frozen=True, slots=True, kw_only=True)
class _TimedCurve(TimedGait):
    """A smooth curve of cubic pieces whose parameter is the time [s], as a timed gait."""

    curve: Curve

    def at(self, t: npt.ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return tilt angles, rates and accelerations at any times."""
        return self.curve.at(t, 0), self.curve.at(t, 1), self.curve.at(t, 2)

    def peaks(self, order: int) -> FloatArray:
        """Return the largest size of a derivative of each angle, exact, shape (4,).

        On a piece a rate is a parabola, largest at an end or at its tip, an acceleration is linear, a jerk constant.
        """
        pieces, width = self.curve.pieces, np.diff(self.curve.breaks)[:, None]
        with np.errstate(divide="ignore", invalid="ignore"):
            tip = -pieces[1] / (3 * pieces[0])
        tip = np.clip(np.nan_to_num(tip, nan=0.0, posinf=0.0, neginf=0.0), 0.0, width)
        derivative = derivative_of(pieces, order)
        peaks = np.max([np.abs(np.polyval(derivative, at)) for at in (0 * width, tip, width)], axis=0)
        return np.tile(peaks.max(axis=0), 2)


def _timed(curve: Curve, samples: int) -> _TimedCurve:
    return _TimedCurve(gait=curve.polyline(_CHORD), period=curve.span, law="optimal", samples=samples, curve=curve)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Search:
    """One request, checked; finds the answer for one sign of R."""

    discs: Discs
    objective: Objective
    vehicle: Vehicle
    coefficients: Coefficients
    floor: float
    period: float
    pieces: int
    concession: float
    zones: Zones | None

    def answer(self, sign: Sign) -> OptimalGait:
        """Return the best gait with one sign of R, or why there is none; either way with the sign."""
        region = admissible_region(self.vehicle, use="flyable", sign=sign, floor=self.floor, zones=self.zones)
        base = OptimalGait(
            objective=self.objective,
            waypoints=self.discs.centers,
            radius=self.discs.radii,
            period=self.period,
            sign=sign,
            reason=None,
        )
        within = component_meeting(region.inner, self.discs)
        if within is None:
            return replace(base, reason=why_apart(region, self.discs, self.floor, self.vehicle))

        # The best worst case of all loops is bracketed; then the loop stays where the lower end is kept.
        bound, polygon = None, within
        shape: Any = region.inner
        if self.objective != "tilt_rate":
            bracket = highest_level(region, self.objective, self.discs, self.vehicle, clearance=3 * CLEARANCE)
            bound = bracket.upper
            shape = region.inner & level_region(self.objective, bracket.lower, self.vehicle).inner
            lower = bracket.lower * (1 - self.concession)
            kept = region.inner & level_region(self.objective, lower, self.vehicle).inner
            polygon = component_meeting(kept, self.discs) or within

        # Discs that share a point are passed by standing still there.
        here = self._standing(shape)
        if here is not None:
            return self._described(base, here, [0.0], None, 0.0 if bound is None else bound)

        # The loop of least effort, from the shortest polygon or the one through the centres: the better one counts.
        # Where a level counts, it is known; the effort only chooses among loops that keep it, and one start is enough.
        best: tuple[SmoothLoop, list[float], LeastEffort] | None = None
        starts = [shortest_loop(self.discs)[0], self.discs.centers]
        for targets in starts if self.objective == "tilt_rate" else starts[1:]:
            started = self._start(polygon, targets)
            if started is None:
                continue
            problem, start = started
            loop, history = problem.solve(start)
            if history and (best is None or loop.effort < best[0].effort * (1 - 1e-9)):
                best = loop, history, problem
        if best is None:
            return replace(base, reason=f"every path through the discs comes within {CLEARANCE:g} rad of a border")
        loop, history, problem = best
        if bound is None:
            bound = 2 * least_loop_length(self.discs, region) ** 2 / self.period
        return self._described(base, loop, history, problem, bound)

    def _standing(self, shape: Any) -> SmoothLoop | None:
        """Return the loop that stands still in a point of all discs and of a shape, clear of its border, if any."""
        shared = offset(shape, -2 * CLEARANCE)
        for center, radius in zip(self.discs.centers, self.discs.radii, strict=True):
            at = shapely.Point(center)
            # The polygon lies inside the disc.
            shared = shared & (shapely.buffer(at, radius * (1 - 1e-9), quad_segs=64) if radius > 0 else at)
        if shared.is_empty:
            return None
        middle = shapely.Point(self.discs.centers.mean(axis=0))
        point = shapely.shortest_line(middle, shared).coords[-1]
        if self.objective != "tilt_rate":
            point = shapely.point_on_surface(shared).coords[0]
        passes = np.linspace(0.0, self.pieces, len(self.discs.radii), endpoint=False)
        return SmoothLoop(points=np.tile(np.array(point), (self.pieces, 1)), passes=passes)

    def _start(self, polygon: Polygon, targets: FloatArray) -> tuple[LeastEffort, SmoothLoop] | None:
        """Return the problem in a polygon and a loop of shortest legs, from one disc to the next, as its start."""
        # Drawn with fewer corners, all of it inside.
        plain = shapely.simplify(offset(polygon, -CLEARANCE), CLEARANCE)
        inside = component_meeting(plain, self.discs)
        if inside is None:
            return None
        problem = LeastEffort(inside, self.discs, CLEARANCE)
        for erosion in _EROSIONS:
            eroded = component_meeting(offset(inside, -erosion), self.discs)
            if eroded is None:
                continue
            # Each disc is passed where the eroded polygon is nearest to its target, or else to its centre.
            for aims in (targets, self.discs.centers):
                nearest = shapely.get_coordinates(shapely.shortest_line(eroded, shapely.points(aims)))
                stops = np.where(self.discs.round[:, None], nearest.reshape(-1, 2, 2)[:, 0], aims)
                if self.discs.misses(stops) <= 0:
                    break
            # Shortest legs from one to the next, nearly straight corners left out.
            paths = ShortestPaths(eroded)
            corners: list[FloatArray] = []
            at = []
            for here, there in zip(stops, np.roll(stops, -1, axis=0), strict=True):
                path = paths.path(here, there)
                leg = np.array([here, there]) if path is None else path
                if len(leg) > 2:
                    leg = np.asarray(shapely.simplify(shapely.LineString(leg), erosion / 2).coords)
                at.append(len(corners))
                corners += list(leg[:-1])
            if 3 * len(corners) > _MOST_PIECES:
                continue
            start = problem.start(np.array(corners), np.array(at), self.pieces)
            if start is not None:
                return problem, start
        return None

    def _described(
        self, base: OptimalGait, loop: SmoothLoop, history: Iterable[float], problem: LeastEffort | None, bound: float
    ) -> OptimalGait:
        """Return the answer that a loop is, every number of it taken from the loop itself."""
        width = self.period / len(loop.points)
        curve = Curve(
            breaks=np.linspace(0.0, self.period, len(loop.points) + 1),
            pieces=power_pieces(loop.points, width),
            vehicle=self.vehicle,
            coefficients=self.coefficients,
        )
        report = curve.check(floor=self.floor).with_checks(_timed(curve, 1).rate_checks())
        scale = 2.0 / self.period
        effort = scale * loop.effort
        value = effort if self.objective == "tilt_rate" else self._worst(report)
        active: list[str] = []
        stationarity = 0.0
        if problem is not None:
            stationarity, held, by_border = problem.stationarity(loop)
            active = [f"waypoint {number + 1}" for number in held]
            level = "" if self.objective == "tilt_rate" else "the level that it keeps, or "
            active += [f"{level}the border of the flyable region"] * by_border
        plane = loop.passed()
        size = value if self.objective == "tilt_rate" else bound
        gap = abs(bound - value) / size if size > 0 else 0.0
        passed, times = np.hstack([plane, plane]), loop.passes * width
        passed.flags.writeable = times.flags.writeable = False
        return replace(
            base,
            reason=None if report.flyable else report.reason,
            curve=curve,
            report=report,
            value=value,
            bound=bound,
            effort=effort,
            optimality=Optimality(
                gap=gap,
                stationarity=stationarity,
                violation=max(self.discs.misses(plane), 0.0),
                active=tuple(active),
            ),
            passed=passed,
            times=times,
            history=tuple(scale * one for one in history),
            warnings=() if stationarity <= _SETTLED else (f"{_UNSETTLED} (first-order residual {stationarity:.1e})",),
        )

    def _worst(self, report: Report) -> float:
        """Return the worst case that a report of the whole curve certifies."""
        if self.objective == "singular_value":
            return float(report["least_singular_value"].value or 0.0)
        least = float(report["hover_thrust"].value or 0.0)
        most = largest_share(self.vehicle)
        if most is None:
            return least
        mass, gravity = self.vehicle.require("mass", "gravity", purpose="the hover reserve")
        return min(least, float(most) - float(report["thrust_limit"].value or 0.0) / float(mass * gravity))
