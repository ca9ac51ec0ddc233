"""Optimal gaits: the smooth loop through discs with the best worst case, of the least effort among these.

Let f be the quantity whose least value along the loop is maximised. A continuous loop through all discs can keep f ≥ c
exactly if one component of (admissible region) ∩ {f ≥ c} meets every disc. Polygons decide that: if no component of the
*outer* ones does, no loop keeps c. Halving the interval of c brackets the best worst case of all loops, however many
local optima there are. Among the loops that keep it, but for a small concession, one of locally least tilt-rate effort
is found (:mod:`gaitgraph.optimization.least_effort`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from itertools import combinations
from time import monotonic
from typing import TYPE_CHECKING, Any, Literal, Self

import numpy as np
import numpy.typing as npt
import shapely

from gaitgraph.angles import (
    HALF_PI,
    angle_within,
    checked_floor,
    checked_number,
    is_list,
    number_of,
    whole_number,
)
from gaitgraph.arrays import freeze_arrays, read_only
from gaitgraph.errors import Infeasible, checked_choice, wrong
from gaitgraph.graph.nodes import checked_waypoints
from gaitgraph.invertibility.coefficients import check_symmetric, coefficients_of
from gaitgraph.invertibility.error_margins import closest_servo_margin
from gaitgraph.invertibility.forms import FloatArray, rotors_of
from gaitgraph.invertibility.matrices import largest_least_singular_value
from gaitgraph.optimization.least_effort import (
    FEWEST_PIECES,
    LeastEffort,
    SmoothLoop,
    WithinCells,
    control_points_along,
    power_pieces,
)
from gaitgraph.pictured import Pictured
from gaitgraph.planning.request import groups_of_repeats, merge_notes
from gaitgraph.planning.shortest_paths import ShortestPaths
from gaitgraph.surface.admissible import admissible_region, why_empty
from gaitgraph.surface.flight_regions import singular_value_region, thrust_region
from gaitgraph.surface.red_components import separating_factor
from gaitgraph.surface.region import (
    DEFAULT_ACCURACY,
    Discs,
    Zones,
    component_meeting,
    offset,
)
from gaitgraph.surface.servo_regions import servo_margin_region
from gaitgraph.surface.sheets import RELATION, SIGNS, Sign
from gaitgraph.timing.curve import Curve
from gaitgraph.timing.polynomials import times_from
from gaitgraph.timing.timed_gait import Motion, TimedGait, checked_clock, table_of
from gaitgraph.tolerances import DEFAULT_FLOOR, ROUND_OFF, SAME_ANGLE
from gaitgraph.validation.report import Report, verdict_of
from gaitgraph.vehicle import PAPER, Angle, Vehicle, VehicleLike, vehicle_named

if TYPE_CHECKING:
    from collections.abc import Sequence

    from shapely import Polygon
    from shapely.geometry.base import BaseGeometry

    from gaitgraph.gait.gait import Gait
    from gaitgraph.gait.table import Table
    from gaitgraph.invertibility.coefficients import Coefficients, CoefficientsLike
    from gaitgraph.planning.request import Progress
    from gaitgraph.surface.region import Points, Region

Objective = Literal["singular_value", "hover_reserve", "servo_margin"]

OBJECTIVES = ("singular_value", "hover_reserve", "servo_margin")
"""The objectives, the default first."""

CLEARANCE = 1e-5
"""How far an optimal gait keeps from the borders of its region, at least; 3e-5 at most where it follows them [rad]."""

_CLOSE = 2e-5  # relative width to which levels are bracketed, about
_CLOSE_MARGIN = 4e-4  # the same for servo margins, which are proven to 0.5 %
_FOLLOWED = 1e-5  # accuracy of the levels' polygons [rad]
_MOST_WAYPOINTS = 40
_MOST_PIECES = 400  # of a spline
# How far the start of a loop keeps from the border, the first that has room [rad].
_EROSIONS = (1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1.5e-5)
_SETTLED = 1e-3  # first-order residual
_UNSETTLED = "the optimization has not converged: a loop of less effort exists; the worst case is not affected"
_LATE = (
    "the deadline passed: a loop with a better worst case, or of less effort, may exist"
)
_CHORD = 1e-4  # of the polyline whose servo margin is judged [rad]
_TEXTS = {  # name and unit of each objective, and one in these units
    "singular_value": ("least singular value along the gait", "", 1.0),
    "hover_reserve": ("hover reserve along the gait", " of m·g", 1.0),
    "servo_margin": ("servo margin of the gait", "°", math.degrees(1.0)),
}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OptimalGait(Pictured):
    """The answer to :func:`optimal_gait`: a smooth gait, or why there is none. Truthy if there is a gait.

    `waypoints`, shape (n, 2), and `radius`, shape (n,), are the discs [rad], repeated ones merged; the gait passes them
    at the tilt angles `passed`, shape (n, 4) [rad], and the `times`, shape (n,) [s]. `reason` says why there is no
    gait, or why it is not flyable. The parameter of `curve` is the time [s]. `judged` is the `report`, None if there is no
    gait.

    `value` is the certified least value of the objective along the whole curve, `bound` an upper bound of it for all
    gaits. `gap` is the largest possible improvement, as a fraction of `bound`. `effort` is ∫ ‖α̇‖² dt over the period
    [rad²/s]; `history` that of every loop on the path to it. `stationarity` is the first-order (Karush–Kuhn–Tucker)
    residual, as a fraction of the slope of the effort; `active` names the active constraints. `violation` is how far it
    passes outside a disc, at most [rad]; of the region it is never outside.
    """

    objective: Objective
    waypoints: FloatArray
    radius: FloatArray
    period: float
    reason: str | None
    sign: Sign | None = None
    curve: Curve | None = None
    judged: Report | None = None
    value: float | None = None
    bound: float | None = None
    effort: float | None = None
    gap: float | None = None
    stationarity: float | None = None
    violation: float | None = None
    active: tuple[str, ...] = ()
    passed: FloatArray = field(default_factory=lambda: np.empty((0, 4)))
    times: FloatArray = field(default_factory=lambda: np.empty(0))
    history: tuple[float, ...] = ()
    warnings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        freeze_arrays(self)

    def __bool__(self) -> bool:
        return self.curve is not None

    @property
    def _shown(self) -> Any:
        return None if self.curve is None else self.timed()

    @property
    def status(self) -> str:
        """Whether a gait was "found", or it is "infeasible"."""
        return "found" if self else "infeasible"

    @property
    def standstill(self) -> str | None:
        """Where the gait stands still, with advice; None if it moves."""
        if self.curve is None or self.curve.length > CLEARANCE:
            return None
        a1, a2 = self.passed[0, :2]
        advice = "for a gait that moves, use smaller radii or waypoints farther apart"
        return f"The best gait stands still at ({a1:.4f}, {a2:.4f}), a point of all discs; {advice}"

    @property
    def gait(self) -> Gait:
        """The gait as a closed polyline within 1e-4 rad of the curve; Infeasible, with the reason, if there is none."""
        return self.timed().gait

    @property
    def report(self) -> Report:
        """All checks along the curve; raises Infeasible, with the reason, if there is none."""
        if self.judged is None:
            raise Infeasible(self.reason)
        return self.judged

    def timed(
        self, *, samples: int | None = None, rate: float | None = None
    ) -> TimedGait:
        """Return the gait with its own timing; raises Infeasible, with the reason, if there is none."""
        if self.curve is None:
            raise Infeasible(self.reason)
        samples = checked_clock(self.period, "smooth", samples=samples, rate=rate)
        return _TimedCurve(
            gait=self.curve.polyline(_CHORD),
            period=self.period,
            law="optimal",
            samples=samples,
            curve=self.curve,
        )

    def table(self, *, samples: int | None = None, rate: float | None = None) -> Table:
        """Return even samples with exact rates, as :meth:`gaitgraph.gait.gait.Gait.parametrize` counts them."""
        discs = {"waypoints": self.waypoints.tolist(), "radius": self.radius.tolist()}
        about = {"made_by": "optimize", "objective": self.objective, **discs}
        table = table_of(self.timed(samples=samples, rate=rate), about)
        about = dict(table.about)
        del about["law"]
        return replace(table, about=about)

    def as_mapping(self) -> dict[str, Any]:
        """Return the answer as plain values, ready for JSON; a saved one can be read as a gait file."""
        answer: dict[str, Any] = {
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
            "length": None,
            "optimality": None,
            "passed": self.passed.tolist(),
            "times": self.times.tolist(),
            "path": [],
            "colors": [],
            "history": list(self.history),
            **verdict_of(self.judged),
            "warnings": self._warnings,
        }
        if self.curve is not None:
            path = self.curve.polyline(_CHORD)
            names = ("gap", "stationarity", "violation", "active")
            answer |= {
                "length": self.curve.length,
                "optimality": {name: getattr(self, name) for name in names},
                "path": path.alpha.tolist(),
                "colors": list(path.colors),
            }
        if self.standstill:
            answer["warnings"].insert(0, self.standstill)
        return answer

    @property
    def _warnings(self) -> list[str]:
        """All warnings, of the search and of the report."""
        warnings = list(self.warnings)
        if self.judged is not None:
            warnings += self.judged.warnings
        return warnings

    def __repr__(self) -> str:
        if not self:
            return f"<OptimalGait: infeasible, {len(self.waypoints)} discs>"
        return f"<OptimalGait: {str(self).splitlines()[0]}>"

    def __str__(self) -> str:
        if self.curve is None or self.judged is None or self.sign is None:
            return f"No gait: {self.reason}"
        what, unit, scale = _TEXTS[self.objective]
        value = scale * (self.value or 0.0)
        bound = scale * (self.bound or 0.0)
        lines = [
            f"{what} {value:.4f}{unit}; any gait through these discs has at most {bound:.4f}{unit}",
            f"{RELATION[self.sign]}, length {self.curve.length:.4f} rad, effort "
            f"{self.effort:.4f} rad²/s over {self.period:g} s; first-order residual "
            f"{self.stationarity:.1e}, active constraints: {', '.join(self.active) or 'none'}",
            *self.judged.lines,
            *(f"warning: {warning}" for warning in self._warnings),
        ]
        if self.standstill:
            lines.insert(0, self.standstill)
        return "\n".join(lines)


def optimal_gait(
    waypoints: Points,
    *,
    radius: Angle | Sequence[Angle] | npt.NDArray[np.float64] = 0.1,
    objective: Objective = "singular_value",
    sign: Literal["auto", "positive", "negative"] = "auto",
    vehicle: VehicleLike = PAPER,
    coefficients: CoefficientsLike | None = None,
    keep_out: Sequence[Points] = (),
    keep_in: Sequence[Points] = (),
    floor: float = DEFAULT_FLOOR,
    period: float = 1.0,
    pieces: int | None = None,
    concession: float = 1e-3,
    deadline: float | None = None,
    progress: Progress | None = None,
) -> OptimalGait:
    """Return a smooth closed gait on the red sheet that passes discs in order and is optimal in its worst case.

    The gait is a periodic cubic spline of even pieces, twice continuously differentiable, and stays in the flyable
    region: least singular value at least `floor`, hover thrusts positive, limits of tilt and thrust, polygons. The
    answer is falsy, with the reason, if there is none; InputError is raised if a value is not allowed.

    Parameters
    ----------
    waypoints, radius
        Centres (α1, α2) of up to 40 discs in [−π/2, π/2], numbers [rad] or texts, and one radius for all or one for
        each; 0, or less than 1e-9, passes the waypoint exactly. Waypoints that repeat in a row are merged; the smaller radius counts.
    objective
        "singular_value": the least singular value of the scaled decoupling matrix along the gait is maximised;
        "hover_reserve": the smallest change of a hover thrust, in units of m·g per rotor, until a rotor idles or
        reaches the vehicle's largest thrust, if it states one; "servo_margin": the errors of the tilt angles that the
        gait bears [rad], of which `value` is proven (:func:`gaitgraph.robustness.servo_margin`).
    sign, vehicle, coefficients, keep_out, keep_in, floor, period
        As for :func:`gaitgraph.planning.planner.plan_loop`; "auto" is the better sign. Physics is checked with exact
        coefficients, and the floor is kept with every objective.
    pieces
        Pieces of the spline, 8 to 400; by default 12 for each waypoint, from 36 to 240. More pieces turn sharper.
    concession
        Fraction of the best worst case given up for less effort, in (0, 0.5].
    deadline, progress
        Seconds after which the effort of a found gait is not improved further; a warning says so. And a function called
        with a line of text in each round.

    Notes
    -----
    A worst case is globally optimal to within the stated gap: `bound` holds for every continuous gait in the flyable
    region that passes the discs. Its effort is a local optimum among splines, on the side of each keep-out on which the
    initial loop runs; another may be better by far, and rounding may decide between two. Discs that share a point, or a
    single disc, give a gait that stands still there.

    Examples
    --------
    >>> found = optimal_gait([("3pi/8", "-3pi/8"), ("3pi/8", "-pi/8"), ("pi/8", "-pi/8"), ("pi/8", "-3pi/8")])
    >>> bool(found), round(found.value, 2), found.bound - found.value < 1e-3 * found.bound, found.report.flyable
    (True, 0.59, True, True)
    """
    checked_choice("objective", objective, OBJECTIVES)
    checked_choice("sign", sign, ("auto", "positive", "negative"))
    if not 0 < number_of(concession) <= 0.5:
        raise wrong("concession", "must be above 0 and at most 0.5", concession)
    vehicle = vehicle_named(vehicle)
    check_symmetric(rotors_of(vehicle))
    floor = checked_floor(floor)
    checked_clock(period, "smooth")
    discs, notes = _discs(waypoints, radius)
    pieces = min(max(36, 12 * len(discs.radii)), 240) if pieces is None else pieces
    pieces = whole_number("pieces", pieces, FEWEST_PIECES, _MOST_PIECES)
    zones = Zones(keep_out=keep_out, keep_in=keep_in)
    numbers = coefficients_of(vehicle, coefficients)
    base = OptimalGait(
        objective=objective,
        waypoints=discs.centers,
        radius=discs.radii,
        period=float(period),
        reason=None,
        warnings=notes + zones.notes,
    )
    until = math.inf
    if deadline is not None:
        until = monotonic() + checked_number("deadline", deadline)
    signs = SIGNS[::-1] if sign == "auto" else (sign,)
    answers = []
    for side in signs:
        search = _Search(
            base=replace(base, sign=side),
            quantity=Quantity(
                objective=objective, vehicle=vehicle, sign=side, floor=floor
            ),
            discs=discs,
            region=admissible_region(vehicle, sign=side, floor=floor, zones=zones),
            coefficients=numbers,
            pieces=pieces,
            until=until,
            progress=progress,
        )
        answers.append(search.answer(float(concession)))
    if not any(answers):
        both = zip(signs, answers, strict=True)
        reasons = [f"{RELATION[side]}: {answer.reason}" for side, answer in both]
        return replace(base, reason="; ".join(reasons))
    # Of equal ones the first, that with R > 0.
    return max(filter(None, answers), key=lambda answer: answer.value or 0.0)


def _discs(waypoints: Any, radius: Any) -> tuple[Discs, tuple[str, ...]]:
    """Return checked discs, a waypoint that repeats the one before merged, and notes."""
    points = checked_waypoints(waypoints, _MOST_WAYPOINTS)
    each = radius if is_list(radius) else [radius] * len(points)
    if len(each) != len(points):
        raise wrong(
            "radius",
            f"must be one for all waypoints or one for each of {len(points)}",
            len(each),
        )
    radii = np.array([angle_within(value, "radius", least=0.0) for value in each])
    groups = groups_of_repeats(points)
    notes = merge_notes(len(points) - len(groups))
    centers = np.array([points[group[0]] for group in groups])
    least = np.array([radii[group].min() for group in groups])
    least[least < SAME_ANGLE] = 0.0
    return Discs(read_only(centers), read_only(least)), notes


@dataclass(frozen=True, slots=True, kw_only=True)
class Quantity:
    """The quantity of an objective on the red sheet; the sign of R and the floor count for the servo margin alone."""

    objective: Objective
    vehicle: Vehicle
    sign: Sign | None = None
    floor: float = DEFAULT_FLOOR

    def region(self, level: float, accuracy: float = DEFAULT_ACCURACY) -> Region:
        """Return where the quantity is at least a level."""
        vehicle = self.vehicle
        if self.objective == "singular_value":
            return singular_value_region(level, vehicle, accuracy=accuracy)
        if self.objective == "servo_margin":
            return servo_margin_region(
                level, vehicle, sign=self.sign, floor=self.floor, accuracy=accuracy
            )
        most = vehicle.thrust_share
        if most is not None:
            most -= level
        return thrust_region(most, vehicle, least=level, accuracy=accuracy)

    def most(self) -> float:
        """Return a value that the quantity nowhere exceeds."""
        if self.objective == "singular_value":
            return largest_least_singular_value(self.vehicle)
        if self.objective == "servo_margin":
            return HALF_PI
        if self.vehicle.thrust_share is None:
            return 1e3
        return self.vehicle.thrust_share / 2

    def highest_level(self, region: Region, discs: Discs) -> tuple[float, float]:
        """Return a bracket of the highest level that a loop through discs can keep in a region, which joins them.

        A loop that keeps the lower end can stay 3e-5 rad away from every border.
        """
        close = _CLOSE
        if self.objective == "servo_margin":
            close = _CLOSE_MARGIN  # what is proven of a gait is not closer
        low = 0.0
        high = self.most()
        while high - low > 4 * close * max(high, 1e-3):
            middle = (low + high) / 2
            kept = self.region(middle, _FOLLOWED)
            if component_meeting(region.outer & kept.outer, discs) is not None:
                low = middle
            else:
                high = middle
        # What all loops cannot do is known; what one can, with polygons from within and clear of them, is a little less.
        for given_up in (close * 2.0 ** np.arange(16)).tolist():
            level = high * (1 - given_up)
            kept = self.region(level, _FOLLOWED)
            inner = offset(region.inner & kept.inner, -3 * CLEARANCE)
            if component_meeting(inner, discs) is not None:
                return level, high
        return 0.0, high

    def along(self, curve: Curve, report: Report) -> float:
        """Return the least value that is proven for a whole curve, by its report but for the servo margin."""
        if self.objective == "servo_margin":
            # No point of the curve is farther than this from its polyline.
            corners = curve.polyline(_CHORD).alpha
            closed = np.concatenate([corners, corners[:1]])
            margin = closest_servo_margin(closed, self.vehicle, floor=self.floor)
            return max(margin.proven - _CHORD, 0.0)
        values = {check.name: float(check.value or 0.0) for check in report.checks}
        if self.objective == "singular_value":
            return values["least_singular_value"]
        most = self.vehicle.thrust_share
        if most is None:
            return values["hover_thrust"]
        used = values["thrust_limit"] / float(self.vehicle.max_thrust or 1.0)
        return min(values["hover_thrust"], most * (1 - used))


@dataclass(frozen=True, slots=True, kw_only=True)
class _TimedCurve(TimedGait):
    """A smooth curve of cubic pieces whose parameter is the time [s], as a timed gait."""

    curve: Curve

    @property
    def made_from(self) -> dict[str, Any]:
        """Nothing that a table states: a curve has no corners."""
        return {}

    def with_period(self, period: float) -> Self:
        """Return the same curve over another period [s]."""
        slower = period / self.period
        powers = np.arange(len(self.curve.pieces))[::-1]
        curve = replace(
            self.curve,
            breaks=self.curve.breaks * slower,
            pieces=self.curve.pieces / slower ** powers[:, None, None],
        )
        return replace(self, period=float(period), curve=curve)

    @property
    def corner_times(self) -> FloatArray:
        """The times between which each angle is one polynomial, from 0 to the period [s]."""
        return self.curve.breaks

    def at(self, t: npt.ArrayLike) -> Motion:
        """Return tilt angles, rates and accelerations at any times."""
        t = times_from(t)
        return Motion(*(self.curve.at(t, order) for order in range(3)))

    def peaks(self, order: int) -> FloatArray:
        """Return the exact largest absolute value of a derivative of each angle."""
        turns = self.curve.turning_points(order)
        return np.asarray(np.abs(self.curve.at(turns, order)).max(axis=0))


@dataclass(frozen=True, slots=True, kw_only=True)
class _Search:
    """The search for one sign of R: `base` is the answer without a gait."""

    base: OptimalGait
    quantity: Quantity
    discs: Discs
    region: Region
    coefficients: Coefficients
    pieces: int
    until: float
    progress: Progress | None

    def answer(self, concession: float) -> OptimalGait:
        """Return the best gait, or why there is none."""
        within = component_meeting(self.region.inner, self.discs)
        if within is None:
            return replace(self.base, reason=self._why_apart())
        # The best worst case of all loops is bracketed; then the loop stays where the lower end is kept.
        lower, bound = self.quantity.highest_level(self.region, self.discs)
        # Discs that share a point are passed by standing still there.
        still = self._standing(self._keeping(lower))
        if still is not None:
            return self._described(still, bound)
        calm = component_meeting(self._keeping(lower * (1 - concession)), self.discs)
        # The border is drawn with fewer corners, all of it inside.
        inside = component_meeting(
            shapely.simplify(offset(calm or within, -CLEARANCE), CLEARANCE), self.discs
        )
        if inside is not None:
            problem = LeastEffort(inside, self.discs, CLEARANCE)
            start = self._start(problem)
            if start is not None:
                return self._optimized(problem, start, bound)
        narrow = (
            f"every path through the discs is within {CLEARANCE:.5f} rad of a border"
        )
        return replace(self.base, reason=narrow)

    def _keeping(self, level: float) -> BaseGeometry:
        """Return the part of the region where the objective is at least a level."""
        return self.region.inner & self.quantity.region(level).inner

    def _why_apart(self) -> str:
        """Return why no component of the region meets every disc: which disc misses it, or which two lie apart."""
        region, discs = self.region, self.discs
        vehicle = self.quantity.vehicle
        if not region.components:
            return why_empty(region, self.quantity.floor, vehicle)
        distance = shapely.distance(
            np.array(region.components)[:, None], shapely.points(discs.centers)
        )
        meets = distance <= discs.radii + ROUND_OFF
        for k, (x, y) in enumerate(discs.centers.tolist()):
            if not meets[:, k].any():
                ((a, b),) = region.nearest_joined([(x, y)])
                return (
                    f"waypoint {k + 1} ({x:.4f}, {y:.4f}) is not flyable ({region.why_not((x, y))}); the nearest "
                    f"flyable point, ({a:.4f}, {b:.4f}), is {distance[:, k].min():.4f} rad away, more than its radius "
                    f"{discs.radii[k]:.4g}"
                )
        for first, second in combinations(range(len(discs.radii)), 2):
            if not (meets[:, first] & meets[:, second]).any():
                apart = f"waypoints {first + 1} and {second + 1} lie in different parts of the flyable region"
                start, end = discs.centers[[first, second]].tolist()
                factor = separating_factor(start, end, vehicle)
                if factor:
                    apart += f", separated by {factor}"
                return apart
        return "any two of the waypoints share a part of the flyable region, but no part meets all discs"

    def _standing(self, shape: BaseGeometry) -> SmoothLoop | None:
        """Return the loop that stands still in a point of all discs and of a shape, clear of its border, if any."""
        centers: Any = shapely.points(self.discs.centers)
        radii = self.discs.radii
        # Polygons that lie inside the discs.
        inside = shapely.buffer(centers, radii * (1 - 1e-9), quad_segs=64)
        discs = np.where(radii > 0, inside, centers).tolist()
        shared = shapely.intersection_all([offset(shape, -2 * CLEARANCE), *discs])
        if shared.is_empty:
            return None
        point = shapely.get_coordinates(shapely.point_on_surface(shared))
        passes = np.linspace(0.0, self.pieces, len(radii), endpoint=False)
        return SmoothLoop(points=np.tile(point, (self.pieces, 1)), passes=passes)

    def _start(self, problem: LeastEffort) -> SmoothLoop | None:
        """Return a loop along shortest legs from one disc to the next, as a start."""
        for erosion in _EROSIONS:
            eroded = component_meeting(offset(problem.polygon, -erosion), self.discs)
            if eroded is not None:
                loop = self._along_legs(eroded, erosion / 2)
                if loop is not None and problem.admits(loop):
                    return loop
        return None

    def _along_legs(self, polygon: Polygon, tolerance: float) -> SmoothLoop | None:
        """Return a loop along shortest legs in a polygon, without nearly straight corners; None if it has too many."""
        # Each disc is passed where the polygon is nearest to its centre.
        centers, radii = self.discs
        lines = shapely.shortest_line(polygon, shapely.points(centers))
        nearest = shapely.get_coordinates(lines)[::2]
        stops = np.where(radii[:, None] > 0, nearest, centers)
        paths = ShortestPaths(polygon)
        corners: list[FloatArray] = []
        met = []  # the number of the corner at each stop
        for here, there in zip(stops, np.roll(stops, -1, axis=0), strict=True):
            leg: Any = paths.path(here, there)
            if len(leg) > 2:
                line = shapely.simplify(shapely.LineString(leg), tolerance)
                leg = shapely.get_coordinates(line)
            met.append(len(corners))
            corners += list(leg[:-1])
        corners = corners or [stops[0]]  # all stops may be one point
        if 3 * len(corners) > _MOST_PIECES:
            return None
        points, knots = control_points_along(np.array(corners), self.pieces)
        # The last stop may be the first again.
        passes = np.append(knots, len(points))[met].astype(float)
        return SmoothLoop(points=points, passes=passes)

    def _optimized(
        self, problem: LeastEffort, start: SmoothLoop, bound: float
    ) -> OptimalGait:
        """Return the answer that the loop of least effort is, from a start."""
        loop, efforts = problem.solve(start, self.until, self.progress)
        if loop.effort == 0:
            return self._described(loop, bound)
        residual, held, by_border = WithinCells(problem, loop).stationarity()
        active = [f"waypoint {number + 1}" for number in held]
        if by_border:
            active.append("the kept level, or the border of the flyable region")
        warnings = self.base.warnings
        if monotonic() > self.until:
            warnings += (_LATE,)
        elif residual > _SETTLED:
            warnings += (f"{_UNSETTLED} (first-order residual {residual:.1e})",)
        return self._described(
            loop,
            bound,
            history=tuple(2.0 / self.base.period * effort for effort in efforts),
            stationarity=residual,
            active=tuple(active),
            warnings=warnings,
        )

    def _described(
        self, loop: SmoothLoop, bound: float, **optimality: Any
    ) -> OptimalGait:
        """Return the answer that a loop is, every number of it taken from the loop itself."""
        period = self.base.period
        width = period / len(loop.points)
        curve = Curve(
            breaks=np.linspace(0.0, period, len(loop.points) + 1),
            pieces=power_pieces(loop.points, width),
            vehicle=self.quantity.vehicle,
            coefficients=self.coefficients,
        )
        answer = replace(self.base, curve=curve)
        report = curve.check(floor=self.quantity.floor).with_timing(answer.timed())
        value = self.quantity.along(curve, report)
        plane = loop.passed()
        at_rest: dict[str, Any] = {"history": (0.0,), "stationarity": 0.0}
        return replace(
            answer,
            reason=None if report.flyable else report.reason,
            judged=report,
            value=value,
            bound=bound,
            effort=2.0 / period * loop.effort,
            gap=abs(bound - value) / bound if bound > 0 else 0.0,
            violation=max(self.discs.misses(plane), 0.0),
            passed=np.hstack([plane, plane]),
            times=loop.passes * width,
            **(at_rest | optimality),
        )
