r"""Every quantity of level flight as a multilinear form in the tilt angles (docs/theory.md, 2).

The force and the moment of a rotor are linear in u = (cos α, sin α), whatever its place, drag and spin. So are, in each of
the four u, the zero-moment inputs wᵢ (without uᵢ) and the zero-moment direction v = (−Rθ, Rφ, R). A form is a table of its
values at the corners α ∈ {0, π/2}⁴, and a sum of a few sinusoids, which bound its second derivative along a segment.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from gaitgraph._lazy import cached_property
from gaitgraph.arrays import read_only
from gaitgraph.records import Record
from gaitgraph.vehicle import Place, rotor_columns

if TYPE_CHECKING:
    from gaitgraph.vehicle import Vehicle

FloatArray = npt.NDArray[np.float64]

_EPSILON = float(np.finfo(float).eps)
_BLOCK = 1 << 14  # points that are evaluated at once, since larger arrays are slow


class Sines(NamedTuple):
    """Tilt angles [rad], shape (4, k), and u = (cos α, sin α) of each, shape (2, 4, k), so that each is computed once.

    `first` are the products of the entries of u1 and u2, `second` those of u3 and u4, both of shape (4, k).
    """

    alpha: FloatArray
    u: FloatArray
    first: FloatArray
    second: FloatArray

    @classmethod
    def of(cls, alpha: FloatArray) -> Sines:
        """Return those of points, shape (k, 4) [rad]."""
        rows = np.ascontiguousarray(alpha.T)
        u = np.array([np.cos(rows), np.sin(rows)])
        first = u[:, None, 0] * u[:, 1]
        second = u[:, None, 2] * u[:, 3]
        return cls(rows, u, first.reshape(4, -1), second.reshape(4, -1))


@dataclass(frozen=True, eq=False)
class Form:
    """Multilinear forms in the four u = (cos α, sin α), as many as the last axis of their table is long.

    The table has the shape (n₁, n₂, n₃, n₄, q): nᵢ is 2, and then holds the values at αᵢ = 0 and π/2, or 1 where the
    forms do not depend on αᵢ.
    """

    table: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "table", read_only(self.table))  # the record is frozen

    def at(self, sines: Sines) -> FloatArray:
        """Return the values at points, shape (q, k)."""
        n1, n2, n3, n4, _ = self.table.shape
        first = sines.first if n1 == n2 == 2 else _products(sines, (0, 1), (n1, n2))
        second = sines.second if n3 == n4 == 2 else _products(sines, (2, 3), (n3, n4))
        starts = range(_BLOCK, first.shape[1], _BLOCK)
        if not starts:
            return self._contracted(first, second)
        blocks = zip(
            np.split(first, starts, 1), np.split(second, starts, 1), strict=True
        )
        return np.concatenate([self._contracted(*block) for block in blocks], axis=1)

    def _contracted(self, first: FloatArray, second: FloatArray) -> FloatArray:
        """Return the values from products of u1 and u2 and from those of u3 and u4."""
        inner = self._matrix @ second
        inner = inner.reshape(self.table.shape[-1], len(first), -1)
        return np.asarray(np.einsum("qnk,nk->qk", inner, first))

    @cached_property
    def _matrix(self) -> FloatArray:
        """The table as a matrix that is applied to products of u3 and u4."""
        n1, n2, n3, n4, count = self.table.shape
        return np.moveaxis(self.table, -1, 0).reshape(count * n1 * n2, n3 * n4)

    def slopes(self, sines: Sines) -> FloatArray:
        """Return the derivatives with respect to each angle, per radian, shape (4, q, k)."""
        values = self._derivatives.at(sines)
        return values.reshape(4, self.table.shape[-1], -1)

    @cached_property
    def _derivatives(self) -> Form:
        """The form of the derivatives, side by side: that of c·cos α + s·sin α is s·cos α − c·sin α."""
        tables = []
        for joint in range(4):
            turned = np.flip(self.table, joint).swapaxes(0, joint).copy()
            turned[1:] *= -1.0
            if len(turned) == 1:
                turned[:] = 0.0
            tables.append(turned.swapaxes(0, joint))
        return Form(np.concatenate(tables, axis=-1))

    def phasors(self) -> tuple[FloatArray, npt.NDArray[np.complex128]]:
        """Return the sinusoids of which the forms are sums, Re a·exp(ik·α): k, shape (h, 4), and a, shape (h, q).

        With z = exp(iα), cos α is (z + 1/z)/2 and sin α is (z − 1/z)/2i. Of two conjugate terms one is returned, doubled.
        """
        change = np.array([[0.5, 0.5], [-0.5j, 0.5j]])
        terms = self.table.astype(complex)
        choices: list[tuple[float, ...]] = []
        for joint in range(4):
            if terms.shape[joint] == 2:
                terms = np.moveaxis(np.tensordot(terms, change, (joint, 0)), -1, joint)
                choices.append((1.0, -1.0))
            else:
                choices.append((0.0,))
        frequencies = np.array(list(product(*choices)))
        half = len(frequencies) // 2
        return frequencies[:half], 2 * terms.reshape(len(frequencies), -1)[:half]

    def waves(self) -> tuple[FloatArray, FloatArray]:
        """Return the frequencies of these sinusoids, shape (h, 4), and their amplitudes, shape (h, q)."""
        frequencies, phasors = self.phasors()
        return frequencies, np.abs(phasors)

    @cached_property
    def size(self) -> FloatArray:
        """What no value, and no derivative with respect to one angle, exceeds, shape (q,)."""
        return read_only(np.asarray(self.waves()[1].sum(axis=0)))

    def rounding(self) -> FloatArray:
        """Return a bound of what floating point adds to a value, shape (q,)."""
        return read_only(
            np.asarray(32 * _EPSILON * np.abs(self.table).sum(axis=(0, 1, 2, 3)))
        )


class Bends:
    """Bounds of the second derivatives of forms along segments."""

    def __init__(self, *forms: Form) -> None:
        waves = [form.waves() for form in forms]
        self._frequencies = np.concatenate([frequencies for frequencies, _ in waves])
        count = sum(amplitudes.shape[1] for _, amplitudes in waves)
        self._amplitudes = np.zeros((count, len(self._frequencies)))
        row = column = 0
        for frequencies, amplitudes in waves:
            rows = slice(row, row + amplitudes.shape[1])
            columns = slice(column, column + len(frequencies))
            self._amplitudes[rows, columns] = amplitudes.T
            row, column = rows.stop, columns.stop

    def along(self, steps: FloatArray) -> FloatArray:
        """Return bounds over the share s in [0, 1] of steps of shape (m, 4) [rad], one for each form, shape (q, m)."""
        turns = self._frequencies @ steps.T
        return np.asarray(self._amplitudes @ (turns * turns))


def _products(
    sines: Sines, joints: tuple[int, int], counts: tuple[int, int]
) -> FloatArray:
    """Return the entries of u of two joints of which a form depends on one at most, shape (n·n′, k)."""
    for joint, count in zip(joints, counts, strict=True):
        if count == 2:
            return sines.u[:, joint]
    return np.ones((1, sines.alpha.shape[1]))


@dataclass(frozen=True, slots=True)
class Rotors(Record):
    """What of a vehicle shapes its matrices, in units of the arm length L.

    Parameters
    ----------
    positions
        Places of the four rotors from the centre of mass.
    drags
        Km/(Kf·L) of each.
    spins
        The sign with which w > 0 thrusts along each upright rotor's axis, and with which it spins.
    tilt_axes, thrust_axes
        The unit vectors of :attr:`Vehicle.axes`.
    asymmetry
        Which rotors a half turn about body z does not map to each other, in words; None if there are none.
    """

    positions: tuple[Place, ...]
    drags: tuple[float, ...]
    spins: tuple[int, ...]
    tilt_axes: tuple[Place, ...]
    thrust_axes: tuple[Place, ...]
    asymmetry: str | None = None

    @property
    def thrust_signs(self) -> FloatArray:
        """The spins as an array of shape (4,)."""
        return read_only(np.array(self.spins, dtype=float))

    @property
    def drag_ratio(self) -> float:
        """The mean of the drags, negative where rotor 1 does not spin as the paper's."""
        return -self.spins[0] * sum(self.drags) / 4


@lru_cache(maxsize=128)
def rotors_of(vehicle: Vehicle) -> Rotors:
    """Return the rotors of a vehicle."""
    tilt_axes, thrust_axes = vehicle.axes
    return Rotors(
        positions=vehicle.scaled_positions,
        drags=vehicle.scaled_drags,
        spins=vehicle.spin_signs,
        tilt_axes=tuple(map(tuple, tilt_axes.tolist())),
        thrust_axes=tuple(map(tuple, thrust_axes.tolist())),
        asymmetry=vehicle.asymmetry,
    )


class Level:
    """The matrices of a vehicle's rotors, and the forms of level flight that follow from them.

    `force` and `moment` have the shape (4, 3, 2): of rotor i, input w, they are force[i]·uᵢ [Kf] and moment[i]·uᵢ [L·Kf].
    """

    def __init__(self, rotors: Rotors) -> None:
        self.rotors = rotors
        axes = (np.array(rotors.tilt_axes), np.array(rotors.thrust_axes))
        force, moment, drag = rotor_columns(
            rotors.positions, rotors.drags, rotors.thrust_signs, axes
        )
        self.force = read_only(force)
        self.moment = read_only(moment)
        # What the drag adds to the columns of the level matrix.
        self.drag_columns = read_only(np.concatenate([-drag, 0 * force[:, 2:]], axis=1))

    @cached_property
    def direction(self) -> Form:
        """The form of v = (−Rθ, Rφ, R), exact."""
        return Form(self._tables[1])

    @cached_property
    def lift(self) -> Form:
        """The form of R alone."""
        return Form(self.direction.table[..., 2:])

    @cached_property
    def inputs(self) -> tuple[Form, ...]:
        """The forms of the four zero-moment inputs, with which the force is v: each does not depend on its own angle."""
        table = self._tables[0]
        return tuple(
            Form(table[..., [rotor]].take([0], axis=rotor)) for rotor in range(4)
        )

    @cached_property
    def _tables(self) -> tuple[FloatArray, FloatArray]:
        """The zero-moment inputs and v at the corners: determinants of three moments, over 2κ.

        Spins and axes of its own may make R negative at α = 0, by more than 1e-12 of the size of its table; the sign of
        both is then turned, so that R > 0 there.
        """
        corners = np.array(list(product((0, 1), repeat=4)))
        moments = self.moment[np.arange(4), :, corners]
        forces = self.force[np.arange(4), :, corners]
        inputs = np.empty((16, 4))
        for rotor in range(4):
            a, b, c = np.delete(moments, rotor, axis=1).swapaxes(0, 1)
            minors = np.sum(a * np.cross(b, c), axis=1)
            inputs[:, rotor] = (-1) ** (rotor + 1) * minors
        inputs /= 2 * self.rotors.drag_ratio
        direction = np.einsum("kr,krf->kf", inputs, forces).reshape(2, 2, 2, 2, 3)
        inputs = inputs.reshape(2, 2, 2, 2, 4)
        lifts = direction[..., 2]
        if lifts[0, 0, 0, 0] < -1e-12 * np.linalg.norm(lifts):
            return -inputs, -direction
        return inputs, direction

    @cached_property
    def input_noise(self) -> FloatArray:
        """Bounds of what floating point alone makes of the zero-moment inputs where they vanish, shape (4,)."""
        return np.concatenate([form.rounding() for form in self.inputs])

    def inputs_at(self, sines: Sines) -> FloatArray:
        """Return the values of the four zero-moment inputs at points, shape (4, k)."""
        return np.concatenate([form.at(sines) for form in self.inputs])

    def forces_and_moments(self, sines: Sines) -> tuple[FloatArray, FloatArray]:
        """Return force and moment per input w of each rotor, both of shape (k, 3, 4)."""
        force = np.einsum("ifj,jik->kfi", self.force, sines.u)
        moment = np.einsum("ifj,jik->kfi", self.moment, sines.u)
        return force, moment

    def matrix(self, sines: Sines) -> FloatArray:
        """Return the scaled decoupling matrix in level flight, rows moments and vertical force, shape (k, 4, 4)."""
        matrices = np.einsum("ifj,jik->fik", self._columns, sines.u)
        return np.moveaxis(matrices, -1, 0)

    @cached_property
    def rate(self) -> float:
        """The largest length of a column of the level matrix: no singular value changes faster per radian of ‖Δα‖."""
        return float(self.rates.max())

    @cached_property
    def rates(self) -> FloatArray:
        """The largest length of each column, and of its derivative, shape (4,)."""
        return read_only(np.linalg.norm(self._columns, 2, axis=(1, 2)))

    @cached_property
    def _columns(self) -> FloatArray:
        """The columns of the level matrix, moment and vertical force, shape (4, 4, 2)."""
        return np.concatenate([self.moment, self.force[:, 2:]], axis=1)

    @cached_property
    def rate_at_any_attitude(self) -> float:
        """The same for the matrix at any attitude."""
        columns = np.concatenate([self.moment, self.force], axis=1)
        return float(np.linalg.norm(columns, 2, axis=(1, 2)).max())

    @cached_property
    def crossings(self) -> tuple[float, float]:
        """The α1 and the α2 where the moment of a rotor of that pair has no yaw torque, on a symmetric vehicle [rad]."""
        first, second = (-self.moment[rotor, 2] for rotor in (0, 1))
        return (
            math.atan(-first[0] / first[1]),
            math.atan(-second[0] / second[1]),
        )


@lru_cache(maxsize=128)
def level_of(rotors: Rotors) -> Level:
    """Return the matrices and forms of rotors."""
    return Level(rotors)
