r"""The level matrix on the red sheet of a symmetric vehicle: two blocks of two columns (docs/theory.md, 6).

Where α3 = α1 and α4 = α2, a half turn maps the columns of rotors 1 and 2 to those of 3 and 4. Sums of opposite columns
make yaw torque and lift alone, differences make roll and pitch torque alone. So the singular values of the matrix are
those of two 2×2 blocks, times √2, and with their determinants D and P

    R = (2/κ)·D·P,    D = u1ᵀ·B·u2,    uᵢ = (cos αᵢ, sin αᵢ),

and P with another matrix B.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gaitgraph.invertibility.coefficients import check_symmetric
from gaitgraph.invertibility.forms import level_of

if TYPE_CHECKING:
    from gaitgraph.invertibility.forms import FloatArray, Level, Rotors

_ROUNDED = 1e-15  # what rounding leaves of products of numbers near 1


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """A block whose columns are first·u1 and second·u2, both matrices of shape (2, 2)."""

    first: FloatArray
    second: FloatArray

    @property
    def form(self) -> FloatArray:
        """The matrix B of the determinant u1ᵀ·B·u2."""
        return np.asarray(
            np.outer(self.first[0], self.second[1])
            - np.outer(self.first[1], self.second[0])
        )

    @property
    def is_product(self) -> bool:
        """Whether the determinant is a function of α1 times one of α2, and so vanishes on straight lines."""
        return bool(abs(np.linalg.det(self.form)) <= _ROUNDED * np.sum(self.form**2))

    def corner(self, g: float) -> float:
        """Return how far the border where a squared singular value is g is from straight lines at most [rad], or ∞.

        It is where (g − |c1|²)·(g − |c2|²) = (c1·c2)², with columns c1 and c2. If these are across each other at all
        angles, two factors vanish on lines. If they nearly are, and each has one direction, the lines are asymptotes of
        hyperbolas: near a corner a column of size √g changes by more than half its largest size per radian.
        """
        sizes = np.linalg.norm([self.first, self.second], 2, axis=(1, 2))
        cosine = float(np.abs(self.first.T @ self.second).max() / sizes.prod())
        rounding = float(_ROUNDED * sizes.max() / math.sqrt(g))
        if cosine <= _ROUNDED:
            return rounding
        if not self.is_product or cosine > 0.5 or g > sizes.min() ** 2 / 4:
            return math.inf
        return max(rounding, float(math.sqrt(g / sizes.prod()) * cosine))

    def determinant(self, alpha1: FloatArray, alpha2: FloatArray) -> FloatArray:
        """Return the determinant at α1 and α2 of shape (k,)."""
        u1, u2 = directions(alpha1), directions(alpha2)
        return np.asarray(np.sum(u1 * (self.form @ u2), axis=0))

    def squares(self, alpha1: FloatArray, alpha2: FloatArray) -> FloatArray:
        """Return the sum of the squared singular values at α1 and α2 of shape (k,)."""
        columns = self.first @ directions(alpha1), self.second @ directions(alpha2)
        return np.asarray(np.sum(np.square(columns), axis=(0, 1)))


def yaw_block(rotors: Rotors) -> Block:
    """Return the block of yaw torque and lift, of determinant D."""
    level = _level_of_symmetric(rotors)
    rows = np.stack([level.moment[:2, 2], level.force[:2, 2]], axis=1)
    return Block(rows[0], rows[1])


def roll_block(rotors: Rotors) -> Block:
    """Return the block of roll and pitch torque, of determinant P."""
    moment = _level_of_symmetric(rotors).moment
    return Block(moment[0, :2], moment[1, :2])


def _level_of_symmetric(rotors: Rotors) -> Level:
    check_symmetric(rotors)
    return level_of(rotors)


def directions(alpha: FloatArray | float) -> FloatArray:
    """Return u = (cos α, sin α), shape (2, ...)."""
    return np.array([np.cos(alpha), np.sin(alpha)])
