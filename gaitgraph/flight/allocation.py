"""Thrusts for a torque and a lift: the inverse of the decoupling matrix, prepared for a whole course of tilt angles.

The control moment matrix depends on the tilt angles alone, which are known before the flight; so its pseudo-inverse P
and its null direction w (the zero-moment inputs) are too. Thrusts T = P·τ + λ·w make the torque τ, and

    lift = v·F·T  gives  λ = (lift − v·F·P·τ) / (v·N),   N = F·w,

with v the vertical in body axes: the decoupling matrix is singular where P does not exist or v·N = 0. How near it is
needs no division: the squared norm of its inverse is |P|² + (|v·F·P|² + 1)/(v·N)².
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from gaitgraph.invertibility.matrices import rotor_directions, thrust_signs

if TYPE_CHECKING:
    from collections.abc import Iterator

    from gaitgraph.vehicle import Vehicle

__all__ = ["Allocation", "allocation_of"]

FloatArray = npt.NDArray[np.float64]

_AT_ONCE = 500


@dataclass(frozen=True, slots=True, kw_only=True)
class Allocation:
    """The inverse of the decoupling matrix along a course of tilt angles; thrusts are along the tilted axes.

    Parameters
    ----------
    thrusts
        P, thrusts per torque in units of thrust times arm length, shape (n, 4, 3); zero where there is none.
    free
        w, the unit thrusts that make no torque, shape (n, 4); zero where the moment matrix has lost rank.
    force
        F·P, force per torque, shape (n, 3, 3).
    direction
        N = F·w, shape (n, 3). Where all thrusts can be positive it points up.
    squared
        |P|², shape (n,); infinite where there is none.
    """

    thrusts: FloatArray
    free: FloatArray
    force: FloatArray
    direction: FloatArray
    squared: FloatArray

    def rows(self) -> Iterator[list[float]]:
        """Yield F·P, N, |P|², P and w of each place as plain numbers, made some hundred places at a time."""
        count = len(self.squared)
        parts = (self.force, self.direction, self.squared, self.thrusts, self.free)
        flat = [part.reshape(count, -1) for part in parts]
        for begin in range(0, count, _AT_ONCE):
            yield from np.hstack([part[begin : begin + _AT_ONCE] for part in flat]).tolist()


def allocation_of(alpha: npt.ArrayLike, vehicle: Vehicle) -> Allocation:
    """Return what thrusts do at tilt angles of shape (n, 4) [rad].

    Examples
    --------
    >>> from gaitgraph.vehicle import PAPER
    >>> level = allocation_of([[0.0, 0.0, 0.0, 0.0]], PAPER)
    >>> level.free.tolist(), level.direction.round(12).tolist()[0][2]
    ([[0.5, 0.5, 0.5, 0.5]], 2.0)
    """
    force, moment = (part * thrust_signs(vehicle) for part in rotor_directions(np.atleast_2d(alpha), vehicle))
    first, second, third = (moment[:, k] for k in range(3))
    # The null vector is the generalised cross product of three rows.
    minors = [np.delete(np.arange(4), k) for k in range(4)]
    free = np.stack(
        [(-1) ** k * _triple(first[:, of], second[:, of], third[:, of]) for k, of in enumerate(minors)], axis=-1
    )
    size = np.linalg.norm(free, axis=-1)
    gram = moment @ np.swapaxes(moment, 1, 2)
    rows = [gram[:, k] for k in range(3)]
    adjugate = np.stack([np.cross(rows[1], rows[2]), np.cross(rows[2], rows[0]), np.cross(rows[0], rows[1])], axis=-1)
    has_rank = size > 1e-12
    squared_size = np.where(has_rank, size**2, 1.0)
    thrusts = np.where(has_rank, 1.0, 0.0)[:, None, None] * (np.swapaxes(moment, 1, 2) @ adjugate)
    thrusts = thrusts / squared_size[:, None, None]
    free = free / np.where(has_rank, size, 1.0)[:, None] * np.where(has_rank, 1.0, 0.0)[:, None]
    # Opposite at one place is opposite at all: the minors are continuous along the course.
    direction = (force @ free[..., None])[..., 0]
    if direction[0, 2] < 0:
        free, direction = -free, -direction
    return Allocation(
        thrusts=thrusts,
        free=free,
        force=force @ thrusts,
        direction=direction,
        squared=np.where(has_rank, np.sum(thrusts**2, axis=(1, 2)), np.inf),
    )


def _triple(first: FloatArray, second: FloatArray, third: FloatArray) -> FloatArray:
    return np.asarray(np.sum(first * np.cross(second, third), axis=-1))
