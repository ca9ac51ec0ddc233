"""Planning again in flight: a region is prepared once, and each request is answered within milliseconds.

New keep-outs are cut out of the region, which is then searched as :func:`gaitgraph.planning.planner.plan_loop` does.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, get_args

import numpy as np
import shapely

from gaitgraph.angles import angles_from, checked_floor, checked_number
from gaitgraph.arrays import freeze_arrays
from gaitgraph.errors import Infeasible, checked_choice, wrong
from gaitgraph.gait.gait import Gait
from gaitgraph.graph.nodes import checked_waypoints
from gaitgraph.invertibility.coefficients import check_symmetric
from gaitgraph.invertibility.forms import FloatArray, rotors_of
from gaitgraph.invertibility.segment_bounds import least_singular_value_along
from gaitgraph.planning.request import groups_of_repeats
from gaitgraph.planning.shortest_paths import ShortestPaths
from gaitgraph.records import Record
from gaitgraph.surface.admissible import admissible_region
from gaitgraph.surface.red_components import separating_factor
from gaitgraph.surface.region import (
    DEFAULT_ACCURACY,
    Zones,
    checked_polygons,
    region_of,
)
from gaitgraph.surface.sheets import SignChoice
from gaitgraph.timing.polynomials import times_from
from gaitgraph.timing.timed_gait import DEFAULT_SAMPLES, Motion, TimedGait
from gaitgraph.tolerances import DEFAULT_FLOOR, ROUND_OFF, SAME_ANGLE
from gaitgraph.vehicle import PAPER, Vehicle, four_of, vehicle_named

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from gaitgraph.planning.request import Point
    from gaitgraph.surface.region import Points, Region
    from gaitgraph.vehicle import VehicleLike

_ROUNDING = 1e-10  # of a time


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class Replan(Record):
    """A path from the present tilt angles to a loop, and the loop; falsy, with the `reason`, if there is none.

    `approach` leads from the present (α1, α2) to the first waypoint, shape (k, 2), one point if the angles are there
    already; `loop` has the corners of the closed loop from there on, shape (n, 2) [rad]. Both are run at one speed, in
    `duration` and `period` [s], so that no tilt rate exceeds its limit. `least_singular_value` is a proven lower bound
    along both, at level attitude.
    """

    vehicle: Vehicle
    reason: str | None = None
    approach: FloatArray
    loop: FloatArray
    least_singular_value: float = 0.0
    duration: float = 0.0
    period: float = 0.0

    def __post_init__(self) -> None:
        freeze_arrays(self)

    def __bool__(self) -> bool:
        return self.reason is None

    def __repr__(self) -> str:
        if self.reason is not None:
            return f"<Replan: none; {self.reason}>"
        times = f"{self.duration:.3f} s to the loop, {self.period:.3f} s around"
        return f"<Replan: {times}, least singular value at least {math.floor(1e3 * self.least_singular_value) / 1e3}>"

    @property
    def entry(self) -> TimedGait:
        """The approach there and back, timed; its first half is the approach; raises Infeasible if there is none."""
        back = self.approach[-2:0:-1]
        return self._timed(np.vstack([self.approach, back]), 2 * self.duration)

    @property
    def timed(self) -> TimedGait:
        """The loop as a timed gait, from the first waypoint on; raises Infeasible if there is none."""
        return self._timed(self.loop, self.period)

    def _timed(self, plane: FloatArray, period: float) -> TimedGait:
        if self.reason is not None:
            raise Infeasible(self.reason)
        gait = Gait(
            alpha=plane[:, [0, 1, 0, 1]],
            colors=("red",) * len(plane),
            vehicle=self.vehicle,
        )
        # Without a motion any period will do.
        return TimedGait(
            gait=gait,
            period=period or 1.0,
            law="constant-speed",
            samples=DEFAULT_SAMPLES,
        )

    def at(self, t: npt.ArrayLike) -> Motion:
        """Return the motion on the approach and then on the loop, at times from now; see :meth:`TimedGait.at`."""
        t = times_from(t, "t must be finite times of at least 0 s", 0.0)
        on_loop = (t >= self.duration)[..., None]
        both = zip(self.timed.at(t - self.duration), self.entry.at(t), strict=True)
        return Motion(*(np.where(on_loop, loop, entry) for loop, entry in both))


class Replanner:
    """A vehicle, a region and limits, prepared for planning again in flight; on red, where alone a gait can fly.

    Paths are the shortest in the region, a polygon inside the true borders by at most the accuracy. Corners are passed
    at full speed.

    Parameters
    ----------
    vehicle
        The vehicle; InputError if it limits tilt accelerations or jerks, which no path with corners keeps at speed.
    sign
        Sign of R of the region; no path leads from one to the other.
    keep_out, keep_in, floor, accuracy
        As for :func:`gaitgraph.planning.planner.plan_loop`.
    rate
        Largest tilt rate [rad/s], beside the vehicle's own limits; MissingConstant if neither is stated.

    Examples
    --------
    >>> replanner = Replanner("padova", sign="positive")
    >>> around = [(-0.3, 0.3), (-0.3, 0.9), (-0.9, 0.9), (-0.9, 0.3)]
    >>> found = replanner.replan([-0.3, 0.2, -0.3, 0.2], around, keep_out=[[(-0.4, 0.5), (-0.2, 0.5), (-0.3, 0.7)]])
    >>> found.loop.tolist(), round(found.period, 3), round(found.least_singular_value, 3)
    ([[-0.3, 0.3], [-0.4, 0.5], [-0.3, 0.9], [-0.9, 0.9], [-0.9, 0.3]], 0.406, 0.683)
    >>> replanner.replan([0.8, -0.8, 0.8, -0.8], around).reason[:59]
    'the present angles (0.8000, -0.8000): R at level attitude m'
    """

    def __init__(
        self,
        vehicle: VehicleLike = PAPER,
        *,
        sign: SignChoice = "auto",
        keep_out: Sequence[Points] = (),
        keep_in: Sequence[Points] = (),
        floor: float = DEFAULT_FLOOR,
        rate: float | None = None,
        accuracy: float = DEFAULT_ACCURACY,
    ) -> None:
        checked_choice("sign", sign, get_args(SignChoice))
        self.vehicle = vehicle_named(vehicle)
        check_symmetric(rotors_of(self.vehicle))
        for name in ("max_tilt_acceleration", "max_tilt_jerk"):
            limit = getattr(self.vehicle, name)
            if limit is not None:
                raise wrong(
                    "vehicle",
                    f"must state no {name}, since corners are passed at speed",
                    limit,
                )
        self.floor = checked_floor(floor)
        self._most_rates = _most_rates(self.vehicle, rate)
        self.region = admissible_region(
            self.vehicle,
            sign=None if sign == "auto" else sign,
            floor=floor,
            zones=Zones(keep_out=keep_out, keep_in=keep_in),
            accuracy=accuracy,
        )
        self._paths = ShortestPaths(self.region.inner)

    def __repr__(self) -> str:
        return f"<Replanner: {self.region!r}, vehicle {self.vehicle.name!r}>"

    def replan(
        self,
        alpha: npt.ArrayLike,
        waypoints: Points,
        *,
        keep_out: Sequence[Points] = (),
    ) -> Replan:
        """Return the path from the present tilt angles to a loop, and the loop, in the order of its waypoints.

        `alpha` are the present angles, as commanded, shape (4,) [rad]. The loop is joined at its first waypoint: state
        the one that comes next first. `keep_out` are polygons that appeared since; nothing is kept of them.
        """
        present = _four_angles(alpha)
        if isinstance(waypoints, np.ndarray):
            waypoints = waypoints.tolist()
        given = checked_waypoints(waypoints)
        new = checked_polygons(keep_out, "keep_out")
        off = max(abs(present[0] - present[2]), abs(present[1] - present[3]))
        if off > SAME_ANGLE:
            return self._refused(
                f"the present angles are {off:.3g} rad off red, where α3 = α1 and α4 = α2; give the commanded angles, "
                "which lie on it"
            )
        here = (present[0], present[1])

        def name_of(point: Point) -> str:
            if point == here:
                return "the present angles"
            return f"waypoint {given.index(point) + 1}"

        # The region is cut anew, and searched as plan_loop does.
        region, paths = self.region, self._paths
        if len(new):
            free = region.inner.difference(shapely.union_all(new))
            region = region_of([free, free], region.accuracy)
            paths = ShortestPaths(free)
        stops = [given[group[0]] for group in groups_of_repeats(given)]
        for point in (here, *stops):
            if not paths.contains(point):
                return self._refused(f"{name_of(point)} {self._why_not(point, region)}")
        ways = []
        for start, end in pairwise([here, *stops, stops[0]]):
            path = paths.path(start, end)
            if path is None:
                wall = separating_factor(start, end, self.vehicle)
                wall = wall or "keep_out or the border of the region"
                return self._refused(
                    f"{name_of(start)} and {name_of(end)} are separated by {wall}; move one of them"
                )
            ways.append(path)
        approach, *legs = ways
        loop = np.concatenate([leg[:-1] for leg in legs if len(leg) > 1] or legs)
        return self._timed(approach, loop)

    def _timed(self, approach: FloatArray, loop: FloatArray) -> Replan:
        """Return a path with its lower bound of the least singular value, as fast as the tilt rates allow."""
        path = np.concatenate([approach[:-1], loop, loop[:1]])
        moves = np.diff(path, axis=0)
        lengths = np.hypot(*moves.T)
        moving = lengths > 0
        # Seconds per radian of the path, for the arms that turn fastest; no rate exceeds its limit by rounding.
        paces = np.abs(moves[moving]) / self._most_rates / lengths[moving, None]
        slowest = paces.max(initial=0.0) * (1 + _ROUNDING)
        entered = len(approach) - 1
        on_red = path[:, [0, 1, 0, 1]]
        least = least_singular_value_along(
            on_red[:-1], on_red[1:], self.vehicle, tolerance=1e-3
        )
        return Replan(
            vehicle=self.vehicle,
            approach=approach,
            loop=loop,
            # The region keeps the floor itself.
            least_singular_value=max(float(least.lower.min()) - ROUND_OFF, self.floor),
            duration=float(lengths[:entered].sum() * slowest),
            period=float(lengths[entered:].sum() * slowest),
        )

    def _refused(self, reason: str) -> Replan:
        none = np.empty((0, 2))
        return Replan(vehicle=self.vehicle, reason=reason, approach=none, loop=none)

    def _why_not(self, point: Point, region: Region) -> str:
        """Return why a point is not admissible, and the nearest one that is, in the region with new keep-outs."""
        why = self.region.why_not(point) or "inside a new keep_out polygon"
        nearest = region.nearest(point)
        where = "no point is admissible"
        if nearest is not None:
            where = f"the nearest admissible point is {region.as_text(nearest)}"
        return f"({point[0]:.4f}, {point[1]:.4f}): {why}; {where}"


def _most_rates(vehicle: Vehicle, rate: float | None) -> FloatArray:
    """Return the largest rates of α1 and α2; opposite arms tilt alike."""
    if rate is None:
        (most,) = vehicle.require("max_tilt_rate", purpose="a replanner without a rate")
    else:
        most = checked_number(
            "rate", rate, "a positive finite number (rad/s)", above=True
        )
    limits: FloatArray = np.array(four_of(most))
    if vehicle.max_tilt_rate is not None:
        limits = np.minimum(limits, four_of(vehicle.max_tilt_rate))
    return np.asarray(np.minimum(limits[:2], limits[2:]))


def _four_angles(alpha: npt.ArrayLike) -> Sequence[float]:
    """Return tilt angles; InputError unless they are four within ±π."""
    tilts = angles_from(alpha, "alpha")
    if tilts.shape != (4,) or not (np.abs(tilts) <= math.pi).all():
        raise wrong("alpha", "must be four finite tilt angles within ±π rad", alpha)
    return [float(tilt) for tilt in tilts]
