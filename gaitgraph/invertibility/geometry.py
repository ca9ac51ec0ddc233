"""Rotors at any place, with any tilt axes: their matrices, and the least singular value along a tilt table.

Rotor i is at pᵢ from the centre of mass. Its thrust of Tᵢ newtons acts along dᵢ(αᵢ), its thrust axis turned by αᵢ about
its tilt axis, right-handed. It gives the force Tᵢ·dᵢ and the moment Tᵢ·(pᵢ × dᵢ − κᵢ·dᵢ). The moment ratio κᵢ [m] is
positive for a rotor that turns counterclockwise seen from where it pushes to. Body axes: x forward, y left, z up.

The rules of the paper hold for four arms that tilt about themselves, see :mod:`gaitgraph.invertibility.matrices`. Here
the thrusts alone control the vehicle, and nothing but their matrices is judged. Arrays of tilt angles have shape
(..., N) [rad].
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Self

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import angle_within, angles_from
from gaitgraph.arrays import check_unmasked, read_only
from gaitgraph.errors import InputError, check_fields, wrong
from gaitgraph.invertibility.forms import FloatArray, rotors_of
from gaitgraph.invertibility.segment_bounds import (
    Least,
    Points,
    checked_segments,
    least_along,
    least_of_each,
)
from gaitgraph.records import Record
from gaitgraph.vehicle import vehicle_named

if TYPE_CHECKING:
    from gaitgraph.vehicle import VehicleLike

_ROTOR: dict[str, Any] = {
    "position": None,
    "moment_ratio": None,
    "thrust_axis": (0.0, 0.0, 1.0),
    "tilt_axis": (0.0, 0.0, 0.0),
    "tilt_range": (-math.inf, math.inf),
}  # the fields of a rotor, and their defaults in a file
LEAST_DECIDED = 0.01
"""Least singular value from which hover thrusts are bounded between rows."""
IDLE_THRUST = 1e-7
"""A hover thrust below this, in units of m·g, is none, to the accuracy of a linear program."""
_MOST_PROGRAMS = 8000  # points, each with a linear program or more


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Geometry(Record):
    """N rotors, each with a place, a moment ratio, a thrust axis and a tilt axis; immutable.

    Parameters
    ----------
    position
        Places of the rotors from the centre of mass, shape (N, 3) [m].
    moment_ratio
        Drag torque over thrust κᵢ, signed by the spin, shape (N,) [m].
    thrust_axis
        Directions of their thrusts at α = 0, of any length, shape (N, 3).
    tilt_axis
        Axes about which they tilt, of any length, shape (N, 3); zero for a rotor that does not tilt.
    tilt_range
        The least and the largest tilt angle of each, shape (N, 2) [rad]; may be infinite.

    Raises
    ------
    InputError
        If an array has another shape or numbers beyond ±1000, a thrust axis is zero, a range is empty, or no rotor is
        away from body z.

    Examples
    --------
    >>> from gaitgraph.vehicle import PAPER
    >>> round(float(Geometry.of_vehicle(PAPER).least_singular_value([0, 0, 0, 0])), 4)
    0.3373
    """

    position: FloatArray
    moment_ratio: FloatArray
    thrust_axis: FloatArray
    tilt_axis: FloatArray
    tilt_range: FloatArray

    def __repr__(self) -> str:
        return f"<Geometry: {len(self.position)} rotors, L = {self.length:.4g} m>"

    def __post_init__(self) -> None:
        count = len(self.position)
        for field, rest in zip(_ROTOR, ((3,), (), (3,), (3,), (2,)), strict=True):
            shape = (count, *rest)
            check_unmasked(getattr(self, field), field)
            try:
                values = np.array(getattr(self, field), dtype=float)
            except (TypeError, ValueError, OverflowError):
                values = np.full(shape, np.nan)
            largest = math.inf if field == "tilt_range" else 1e3
            if values.shape != shape or not (np.abs(values) <= largest).all():
                rule = f"must be numbers within ±1000 of shape {shape}, a row for each rotor"
                raise wrong(field, rule, getattr(self, field))
            if field.endswith("axis"):
                size = np.linalg.norm(values, axis=1, keepdims=True)
                values = values / np.where(size > 0, size, 1.0)
            object.__setattr__(self, field, read_only(values))  # the record is frozen
        for number, (axis, (low, high)) in enumerate(
            zip(self.thrust_axis, self.tilt_range, strict=True), start=1
        ):
            if not axis.any():
                raise InputError(
                    f"thrust_axis of rotor {number} must not be zero",
                    field="thrust_axis",
                    row=number,
                )
            if not low < high:
                raise wrong(
                    f"tilt_range of rotor {number}",
                    "must be two increasing angles",
                    (low, high),
                    got=f"{low:g}, {high:g}",
                    field="tilt_range",
                    row=number,
                )
        if not self.length > 1e-6:
            raise InputError(
                "position must have a rotor at least 1e-6 m away from body z, got none",
                field="position",
            )

    @classmethod
    def of_vehicle(cls, vehicle: VehicleLike) -> Self:
        """Return the geometry of a vehicle of four arms; in arm lengths instead of metres if it states none."""
        vehicle = vehicle_named(vehicle)
        rotors, length = rotors_of(vehicle), vehicle.arm_length or 1.0
        places = length * np.array(rotors.positions)
        tilt_axes = places * np.array([1.0, 1.0, 0.0])
        if vehicle.has_own_axes:
            tilt_axes = np.array(rotors.tilt_axes)
        return cls(
            position=places,
            moment_ratio=length * np.array(rotors.drags) * rotors.thrust_signs,
            thrust_axis=np.array(rotors.thrust_axes),
            tilt_axis=tilt_axes,
            tilt_range=np.array(vehicle.tilt_range or [[-math.inf, math.inf]] * 4),
        )

    @property
    def length(self) -> float:
        """The length L by which moments are divided: the mean distance of the rotors from body z [m]."""
        return float(np.hypot(self.position[:, 0], self.position[:, 1]).mean())

    def _parts(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return A, B and C of dᵢ = A + B·cos αᵢ + C·sin αᵢ (Rodrigues), each of shape (N, 3)."""
        along = self.tilt_axis * np.sum(
            self.tilt_axis * self.thrust_axis, axis=1, keepdims=True
        )
        along = np.where(
            self.tilt_axis.any(axis=1, keepdims=True), along, self.thrust_axis
        )
        return (
            along,
            self.thrust_axis - along,
            np.cross(self.tilt_axis, self.thrust_axis),
        )

    def force_matrix(self, alpha: npt.ArrayLike) -> FloatArray:
        """Return the body force per thrust, dimensionless, shape (..., 3, N)."""
        angles = angles_from(alpha, "alpha")[..., None]
        if angles.shape[-2:-1] != self.moment_ratio.shape:
            raise wrong(
                "alpha",
                f"must have shape (..., {len(self.position)})",
                angles.shape[:-1],
            )
        still, cosine, sine = self._parts()
        return np.swapaxes(
            still + np.cos(angles) * cosine + np.sin(angles) * sine, -1, -2
        )

    def moment_matrix(self, alpha: npt.ArrayLike) -> FloatArray:
        """Return the body moment per thrust [m], shape (..., 3, N)."""
        return self._moments(self.force_matrix(alpha))

    def _moments(self, force: FloatArray) -> FloatArray:
        return np.asarray(
            np.cross(self.position.T, force, axis=-2) - self.moment_ratio * force
        )

    def _level(self, force: FloatArray) -> FloatArray:
        return np.concatenate(
            [self._moments(force) / self.length, force[..., 2:, :]], axis=-2
        )

    def level_matrix(self, alpha: npt.ArrayLike) -> FloatArray:
        """Return the dimensionless matrix with rows moments/L and vertical force, shape (..., 4, N).

        For four arms it is :func:`gaitgraph.invertibility.matrices.scaled_decoupling_matrix`, level, up to the signs of
        its columns: the inputs are thrusts.
        """
        return self._level(self.force_matrix(alpha))

    def least_singular_value(self, alpha: npt.ArrayLike) -> FloatArray:
        """Return the least singular value of the level matrix, shape (...); 0 with fewer than four rotors."""
        size = np.linalg.svd(self.level_matrix(alpha), compute_uv=False)
        return np.asarray(
            size[..., -1] if size.shape[-1] == 4 else np.zeros(size.shape[:-1])
        )

    def hover_thrusts(self, alpha: npt.ArrayLike) -> FloatArray:
        """Return thrusts of four or more rotors that carry the weight without moment, in units of m·g, shape (..., N).

        They are those of least norm, or where one of these is below 1/(2·N), those whose least is largest. They have no
        meaning where the level matrix is nearly singular. A horizontal force may remain, which is not included.
        """
        level = self.level_matrix(alpha)
        thrusts, count = np.linalg.pinv(level)[..., 3], level.shape[-1]
        for at in np.argwhere(thrusts.min(axis=-1) < 0.5 / count) if count > 4 else ():
            thrusts[tuple(at)] = _best_thrusts(level[tuple(at)])
        return np.asarray(thrusts)

    def zero_moment_directions(
        self, alpha: npt.ArrayLike
    ) -> tuple[FloatArray, FloatArray]:
        """Return thrusts without moment, and their forces, at one configuration: shapes (k, N) and (k, 3).

        The thrusts are an orthonormal basis of the null space of the moment matrix; k is N minus its rank.

        >>> from gaitgraph.vehicle import PAPER
        >>> thrusts, forces = Geometry.of_vehicle(PAPER).zero_moment_directions([0, 0, 0, 0])
        >>> abs(thrusts).round(3).tolist(), abs(forces).round(3).tolist()
        ([[0.5, 0.5, 0.5, 0.5]], [[0.0, 0.0, 2.0]])
        """
        force = self.force_matrix(np.ravel(alpha))
        _, size, right = np.linalg.svd(self._moments(force))
        thrusts = right[np.count_nonzero(size > 1e-10 * size[0]) :]
        return thrusts, thrusts @ force.T

    def _change(self, starts: FloatArray, ends: FloatArray) -> FloatArray:
        """Return a bound of how much the level matrix changes along segments, in Frobenius norm, shape (m,).

        Column i depends on αᵢ alone. Its slope is −B·sin αᵢ + C·cos αᵢ, at most the largest singular value of (B, C).
        """
        slopes = np.stack(
            [self._level(part.T).T for part in self._parts()[1:]], axis=-1
        )
        rates = np.linalg.svd(slopes, compute_uv=False)[:, 0]
        return np.asarray(np.linalg.norm(rates * (ends - starts), axis=1))

    def least_singular_value_along(
        self, starts: npt.ArrayLike, ends: npt.ArrayLike, *, tolerance: float = 1e-4
    ) -> Least:
        """Bracket the least singular value along straight segments of tilt angles, shape (m, N), to a tolerance.

        InputError without a segment. The brackets are proven: a singular value changes by no more than the matrix does.

        >>> from gaitgraph.vehicle import PAPER
        >>> start, end = np.array([[0.0, 0, 0, 0]]), np.array([[0.5, 0.5, 0.5, 0.5]])
        >>> found = Geometry.of_vehicle(PAPER).least_singular_value_along(start, end)
        >>> found.upper.round(3).tolist(), bool(found.lower[0] > found.upper[0] - 1e-4)
        ([0.259], True)
        """
        first, last = checked_segments(starts, ends, len(self.position))

        def bound(
            f0: FloatArray, f1: FloatArray, p0: FloatArray, p1: FloatArray
        ) -> FloatArray:
            return np.asarray(np.maximum((f0 + f1 - self._change(p0, p1)) / 2, 0.0))

        return least_along(
            first, last, self.least_singular_value, bound, tolerance=tolerance
        )

    def least_hover_thrust_along(
        self, starts: npt.ArrayLike, ends: npt.ArrayLike
    ) -> Least:
        """Bracket the least hover thrust along segments, as far as its sign needs, in units of m·g.

        `upper` is that of :meth:`hover_thrusts` somewhere; everywhere some thrusts are all at least `lower`. With more
        than four rotors the work is bounded, and 1e-7 may stay between the two. The least singular value must be above
        0.01. Thrusts T of one point become those of another by adding −M⁺·(M·T − e), with e = (0, 0, 0, 1), so that
        none falls by more than ‖ΔM‖·‖T‖/σ. InputError without a segment.
        """
        first, last = checked_segments(starts, ends, len(self.position))

        most = _MOST_PROGRAMS if len(self.position) > 4 else None
        quantity = _LeastThrust(self)
        return least_of_each(
            first, last, [quantity], [1e-4], floor=IDLE_THRUST, most=most
        )[0]


@dataclass(frozen=True)
class _LeastThrust:
    """The least hover thrust of rotors of any geometry, in units of m·g."""

    geometry: Geometry
    count = 1

    def state(self, points: Points, least: FloatArray) -> FloatArray:
        """Return the least thrusts, the least singular values and the norms of the thrusts."""
        thrusts = self.geometry.hover_thrusts(points.rows)
        values = self.geometry.least_singular_value(points.rows)
        norms = np.linalg.norm(thrusts, axis=-1)
        return np.array([thrusts.min(axis=-1), values, norms])

    def bounds(
        self, first: FloatArray, last: FloatArray, p0: FloatArray, p1: FloatArray
    ) -> FloatArray:
        """Return lower bounds."""
        change = self.geometry._change(p0, p1)
        size = np.maximum((first[1] + last[1] - change) / 2, LEAST_DECIDED)
        falls = change * np.maximum(first[2], last[2]) / size
        return np.asarray((first[:1] + last[:1] - falls) / 2)


def _best_thrusts(level: FloatArray) -> FloatArray:
    """Return the thrusts T with level·T = (0, 0, 0, 1) whose least is largest, up to 1, shape (N,)."""
    from scipy.optimize import linprog

    count = level.shape[
        1
    ]  # the unknowns are what each thrust is above the least, and the least
    both = np.column_stack([level, level.sum(axis=1)])
    limits = [(0, None)] * count + [(None, 1)]
    found = linprog(
        np.append(np.zeros(count), -1.0), A_eq=both, b_eq=[0, 0, 0, 1], bounds=limits
    ).x
    if found is None:
        return np.full(count, np.nan)
    return np.asarray(found[:count] + found[count])


def geometry_from_mapping(stated: dict[str, Any]) -> Geometry:
    """Return the geometry that a list `rotor` of tables describes, beside a `name`; InputError if it is none.

    >>> places = ((1, 1), (-1, 1), (-1, -1), (1, -1))
    >>> arms = [{"position": [x, y, 0], "tilt_axis": [x, y, 0], "moment_ratio": x * y / 50} for x, y in places]
    >>> round(geometry_from_mapping({"rotor": arms}).length, 4)
    1.4142
    """
    check_fields("geometry", stated, ["name", "rotor"])
    rotors = stated.get("rotor")
    if not isinstance(rotors, list) or not rotors:
        raise wrong("rotor", "must be a list of tables, one for each rotor", rotors)
    tables = []
    for number, rotor in enumerate(rotors, start=1):
        check_fields(f"rotor {number}", rotor, list(_ROTOR))
        table, name = _ROTOR | rotor, f"tilt_range of rotor {number}"
        limits = rotor.get("tilt_range")
        if isinstance(limits, list):
            table["tilt_range"] = [
                angle_within(one, name, 2 * math.pi) for one in limits
            ]
        tables.append(table)
    columns: dict[str, Any] = {
        field: [table[field] for table in tables] for field in _ROTOR
    }
    return Geometry(**columns)
