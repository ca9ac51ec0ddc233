"""Planning again in flight: a region prepared once, and answers within a millisecond.

What does not change is computed once: the region, what its corners see of each other, the limits of tilt rates. New
keep-outs leave the region as it is and bring their corners into the search.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from itertools import accumulate, pairwise
from typing import TYPE_CHECKING, Any, get_args

import numpy as np
import shapely

from gaitgraph.angles import angles_from, checked_number
from gaitgraph.arrays import freeze_arrays
from gaitgraph.errors import Infeasible, InputError, checked_choice, shown
from gaitgraph.gait.gait import Gait
from gaitgraph.graph.build import checked_waypoints
from gaitgraph.invertibility.segment_bounds import bound_along_red_path
from gaitgraph.planning.shortest_paths import ShortestPaths
from gaitgraph.surface.admissible import admissible_region
from gaitgraph.surface.region import (
    DEFAULT_ACCURACY,
    Zones,
    checked_polygons,
    region_of,
)
from gaitgraph.surface.sheets import SignChoice, separating_factor
from gaitgraph.timing.laws import times_from
from gaitgraph.timing.timed_gait import DEFAULT_SAMPLES, Motion, TimedGait
from gaitgraph.tolerances import DEFAULT_FLOOR, ROUND_OFF, SAME_ANGLE
from gaitgraph.vehicle import PAPER, four_of, vehicle_named

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.planning.request import Point
    from gaitgraph.surface.region import Points
    from gaitgraph.vehicle import Vehicle, VehicleLike

_ROUNDING = 1e-10  # of a time
_STEP = 0.05  # rad between two points at which the singular values are computed


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class Replan:
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
        return self._timed(
            np.vstack([self.approach, self.approach[-2:0:-1]]), 2 * self.duration
        )

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
        self.vehicle = body = vehicle_named(vehicle)
        for name in ("max_tilt_acceleration", "max_tilt_jerk"):
            if (limit := getattr(body, name)) is not None:
                raise InputError(
                    f"vehicle must state no {name}, since corners are passed at speed, got {shown(limit)}",
                    field="vehicle",
                )
        if rate is None:
            (rate,) = body.require(
                "max_tilt_rate", purpose="a replanner without a rate"
            )
        else:
            rate = checked_number(
                "rate", rate, "a positive finite number (rad/s)", above=True
            )
        stated = math.inf if body.max_tilt_rate is None else body.max_tilt_rate
        limits = np.minimum(four_of(rate), four_of(stated)).tolist()
        self._limits = min(limits[::2]), min(limits[1::2])  # opposite arms tilt alike
        self.floor = checked_number("floor", floor)
        admissible = partial(
            admissible_region,
            body,
            sign=None if sign == "auto" else sign,
            floor=floor,
            accuracy=accuracy,
        )
        self.region = admissible(zones=Zones(keep_out=keep_out, keep_in=keep_in))
        self._kept_out = _apart(checked_polygons(keep_out, "keep_out"))
        shapely.prepare(self._kept_out)
        self._whole = self._paths = ShortestPaths(self.region.inner)
        if len(self._kept_out):  # which are searched as new ones are
            self._paths = ShortestPaths(admissible(zones=Zones(keep_in=keep_in)).inner)
        _ = self._paths.sights  # computed once, now

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
        tilts = angles_from(alpha, "alpha")
        if tilts.shape != (4,) or not (abs(tilts) <= math.pi).all():
            raise InputError(
                f"alpha must be four finite tilt angles within ±π rad, got {shown(alpha)}"
            )
        given = checked_waypoints(
            waypoints.tolist() if isinstance(waypoints, np.ndarray) else waypoints
        )
        new = checked_polygons(keep_out, "keep_out")
        first, second, third, fourth = tilts.tolist()
        if (off := max(abs(first - third), abs(second - fourth))) > SAME_ANGLE:
            advice = "give the commanded angles, which lie on it"
            return self._refused(
                f"the present angles are {off:.3g} rad off red, where α3 = α1 and α4 = α2; {advice}"
            )
        stops = [
            stop
            for stop, following in pairwise([*given, given[0]])
            if stop != following
        ] or given[:1]
        points: list[Point] = [(first, second), *stops]

        def name_of(point: Point) -> str:
            return (
                "the present angles"
                if point == points[0]
                else f"waypoint {given.index(point) + 1}"
            )

        places: Any = shapely.points(points)
        outside, polygons, touched = (
            ~shapely.covers(self.region.inner, places),
            new,
            False,
        )
        if len(new):
            # As one with old ones that they touch, so that no path leads between two that share a side.
            apart = ~shapely.dwithin(self._kept_out[:, None], new, ROUND_OFF).any(
                axis=1
            )
            new = _apart(np.concatenate([new, self._kept_out[~apart]]))
            polygons = np.concatenate([new, self._kept_out[apart]])
            if touched := bool(
                shapely.dwithin(polygons[:, None], places, ROUND_OFF).any()
            ):
                outside |= shapely.contains(polygons[:, None], places).any(axis=0)
        if outside.any():
            free = self._free_of(new)
            outside &= ~shapely.dwithin(free, places, ROUND_OFF)
            if outside.any():
                point = points[int(np.argmax(outside))]
                return self._refused(f"{name_of(point)} {self._why_not(point, free)}")
        legs = [leg for leg in pairwise([*points, points[1]]) if leg[0] != leg[1]]
        prepared = self._paths if len(new) else self._whole
        paths: list[Any] = (
            [None] * len(legs) if touched else prepared.paths_around(legs, polygons)
        )
        left = [k for k, path in enumerate(paths) if path is None]
        if left and len(new):
            # The search may miss lines along borders, and from a point on a side it is decided by rounding.
            cut = ShortestPaths(self._free_of(new))
            for k, path in zip(
                left, cut.paths_around([legs[k] for k in left], new[:0]), strict=True
            ):
                paths[k] = path
        for leg, path in zip(legs, paths, strict=True):
            if path is None:
                wall = (
                    separating_factor(*leg, self.vehicle)
                    or "keep_out or the border of the region"
                )
                return self._refused(
                    f"{' and '.join(map(name_of, leg))} are separated by {wall}; move one of them"
                )
        approach = paths.pop(0) if points[0] != points[1] else np.array(points[:1])
        return self._timed(
            approach,
            np.concatenate([path[:-1] for path in paths] or [np.array(points[1:])]),
        )

    def _timed(self, approach: FloatArray, loop: FloatArray) -> Replan:
        """Return a path with its lower bound of the least singular value, as fast as the tilt rates allow."""
        path = np.concatenate([approach[:-1], loop, loop[:1]])
        moves, (odd, even) = (
            [(c - a, d - b) for (a, b), (c, d) in pairwise(path.tolist())],
            self._limits,
        )
        lengths = [math.hypot(*move) for move in moves]
        numbers = [0, *accumulate(math.ceil(length / _STEP) or 1 for length in lengths)]
        nodes = np.arange(numbers[-1] + 1)
        between = np.interp(nodes, numbers, path.view(complex)[:, 0])
        # Seconds per radian of the path, for the arms that turn fastest; no rate exceeds its limit by rounding.
        steps = (
            max(abs(x) / odd, abs(y) / even) / math.hypot(x, y)
            for x, y in moves
            if x or y
        )
        slowest = max(steps, default=0.0) * (1 + _ROUNDING)
        entered, bound = (
            len(approach) - 1,
            bound_along_red_path(np.array([between.real, between.imag]), self.vehicle),
        )
        return Replan(
            vehicle=self.vehicle,
            approach=approach,
            loop=loop,
            # The region keeps the floor itself.
            least_singular_value=max(float(bound.min()), self.floor),
            duration=sum(lengths[:entered]) * slowest,
            period=sum(lengths[entered:]) * slowest,
        )

    def _refused(self, reason: str) -> Replan:
        return Replan(
            vehicle=self.vehicle,
            reason=reason,
            approach=np.empty((0, 2)),
            loop=np.empty((0, 2)),
        )

    def _why_not(self, point: Point, free: Any) -> str:
        """Return why a point is not admissible, and the nearest one that is."""
        left = region_of([free, free], self.region.accuracy)
        nearest = left.nearest(point)
        why = self.region.why_not(point) or "inside a new keep_out polygon"
        where = (
            f"the nearest admissible point is {left.as_text(nearest)}"
            if nearest
            else "no point is admissible"
        )
        return f"({point[0]:.4f}, {point[1]:.4f}): {why}; {where}"

    def _free_of(self, polygons: Any) -> Any:
        return self.region.inner.difference(shapely.union_all(polygons))


def _apart(polygons: npt.NDArray[np.object_]) -> npt.NDArray[np.object_]:
    """Return polygons with those that touch as one."""
    if np.count_nonzero(shapely.dwithin(polygons[:, None], polygons, ROUND_OFF)) > len(
        polygons
    ):
        return np.asarray(
            shapely.get_parts(shapely.disjoint_subset_union_all(polygons))
        )
    return polygons
