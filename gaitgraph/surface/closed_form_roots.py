"""Every root of Rφ = Rθ = 0 over one point, many points or a grid of the (α1, α2) plane, in closed form.

The formulas are those of :mod:`gaitgraph.surface.sheets`: a red and a blue root lie over every (α1, α2). α3 and α4 are
represented in [−π/2, π/2]. A solution at one end of that range is one at the other end too, with the opposite sign of
R, and both are counted as roots.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import HALF_PI, angle_from_text, distance_to_multiple, number_of
from gaitgraph.errors import InputError
from gaitgraph.invertibility.matrices import (
    Coefficients,
    coefficients_of,
    level_determinant,
    pair_features,
    pitch_sensitivity,
    roll_sensitivity,
)
from gaitgraph.surface.adjacency import FIBER_TYPES, text_from_types
from gaitgraph.surface.sheets import (
    COLORS,
    DEFAULT_CROSSING_TOLERANCE,
    Color,
    at_end_of_range,
    checked_plane_angles,
    sheet_angles,
    types_of,
)

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int8]

_FIBER_TOLERANCE = 1e-9
_MOST_ROOTS = 5


@dataclass(frozen=True, slots=True, kw_only=True)
class Root:
    """One solution (α3, α4) of equations (7) and (8) for one (α1, α2).

    Angles in radians; `types` is ASCII such as ``(+,?)``; `color` names the sheet; `R`, `R_phi` and `R_theta` are
    computed from the solution, not assumed.
    """

    alpha1: float
    alpha2: float
    alpha3: float
    alpha4: float
    types: str
    color: Color
    R: float
    R_phi: float
    R_theta: float

    @property
    def alpha(self) -> tuple[float, float, float, float]:
        """The four tilt angles [rad]."""
        return self.alpha1, self.alpha2, self.alpha3, self.alpha4


@dataclass(frozen=True, slots=True, kw_only=True)
class Fiber:
    """A continuum of solutions: at this (α1, α2) one of α3, α4 is free.

    The fibre called "first" (β1 ≡ 0 mod π/2) fixes alpha3, of the types ``(?,*)``; "second" (β2 ≡ 0 mod π/2) fixes
    alpha4, ``(*,?)``. `values` are those of the fixed angle in [−π/2, π/2] [rad]. `singular` are the copies at β = π/2
    (mod π), where the decoupling matrix is singular at every attitude whatever the free angle.
    """

    name: str
    fixed: str
    values: tuple[float, ...]
    free: str
    singular: bool
    types: str


class RootSet(tuple[Root, ...]):
    """All roots of one (α1, α2), red ones first, then by (α3, α4), with the fibres that pass through it."""

    fibers: tuple[Fiber, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class RootArrays:
    """The roots of many (α1, α2) of the shape (...), padded to five along the last axis.

    Beside their number `count` (...): the tilt angles `alpha` (..., 5, 4) [rad] and equation (6) `R` (..., 5), both NaN
    beyond `count`; the `sheet` (..., 5), +1 red, −1 blue, 0 none; and the `types` (..., 5, 2) of α3 and of α4, +1, 0
    (`?`) or −1.
    """

    count: npt.NDArray[np.int64]
    alpha: FloatArray
    sheet: IntArray
    types: IntArray
    R: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class SheetGrid:
    """The roots of one sheet over a grid of (α1, α2), as an outer product of n rows and m columns.

    Root (r, s) belongs to the grid node (`row[r]`, `column[s]`) and has tilt angles
    (α1[row[r]], α2[column[s]], alpha3[r], alpha4[s]) [rad], plane types (types3[r], types4[s]), each +1, 0 (`?`) or −1,
    and equation (6) R[r, s]. A grid value whose α3 (α4) lies at an end of [−π/2, π/2] appears as two rows (columns).
    """

    color: Color
    row: npt.NDArray[np.int64]
    column: npt.NDArray[np.int64]
    alpha3: FloatArray
    alpha4: FloatArray
    types3: IntArray
    types4: IntArray
    R: FloatArray

    @property
    def types(self) -> IntArray:
        """Plane types of every root, 3·(type of α3) + (type of α4) from −4 to 4, shape (n, m)."""
        return np.add.outer(3 * self.types3, self.types4)


def roots(
    alpha1: float | str,
    alpha2: float | str,
    coefficients: Coefficients | None = None,
    *,
    crossing_tolerance: float = DEFAULT_CROSSING_TOLERANCE,
) -> RootSet:
    """Return every (α3, α4) in [−π/2, π/2]² with Rφ = Rθ = 0 for one (α1, α2).

    Two inside the square, three on its sides, five at its corners (Figure 2); one more where blue lies at an end
    of the range, α1 = 2δ − π/2 or α2 = π/2 − 2δ. On a fibre line the solutions are a continuum: `fibers` of the
    answer states it, beside the red and the blue root, which are still there. R ≠ 0 is not guaranteed: look at `R`.

    Parameters
    ----------
    alpha1, alpha2
        Tilt angles of rotors 1 and 2 in [−π/2, π/2], numbers [rad] or texts such as "pi/8".
    coefficients
        The coefficients of formula (1); by default the paper's published ones.
    crossing_tolerance
        Distance from a crossing line within which a type is `?` [rad].

    Raises
    ------
    InputError
        If an angle is not finite or outside [−π/2, π/2].

    Examples
    --------
    >>> [(root.types, root.color, round(root.alpha3, 3)) for root in roots(0.9, -0.4)]
    [('(+,+)', 'red', 0.9), ('(-,-)', 'blue', -0.566)]
    >>> len(roots(np.pi / 2, 0.3)), len(roots(np.pi / 2, -np.pi / 2))
    (3, 5)
    """
    coefficients = coefficients or coefficients_of()
    a1, a2 = (
        # The range of a number is checked below; anything else is a text that means an angle, or refused.
        number_of(value) if isinstance(value, float) else angle_from_text(value, name)
        for name, value in (("alpha1", alpha1), ("alpha2", alpha2))
    )
    arrays = root_arrays(a1, a2, coefficients, crossing_tolerance=crossing_tolerance)
    found = []
    for k in range(int(arrays.count)):
        alpha = arrays.alpha[k]
        found.append(
            Root(
                alpha1=a1,
                alpha2=a2,
                alpha3=float(alpha[2]),
                alpha4=float(alpha[3]),
                types=text_from_types(*arrays.types[k]),
                color=COLORS[int(arrays.sheet[k] < 0)],
                R=float(level_determinant(alpha, coefficients)),
                # A residual of −0.0 is printed as 0.0.
                R_phi=float(roll_sensitivity(alpha, coefficients)) + 0.0,
                R_theta=float(pitch_sensitivity(alpha, coefficients)) + 0.0,
            )
        )
    fibers = []
    for name, angle, beta, types in (
        ("first", a1, a1 - coefficients.delta, FIBER_TYPES[0]),
        ("second", a2, a2 + coefficients.delta, FIBER_TYPES[1]),
    ):
        if distance_to_multiple(beta, HALF_PI) <= _FIBER_TOLERANCE:
            fixed, free = ("alpha3", "alpha4") if name == "first" else ("alpha4", "alpha3")
            values = (-HALF_PI, HALF_PI) if at_end_of_range(angle) else (angle,)
            singular = distance_to_multiple(beta, math.pi) > _FIBER_TOLERANCE
            fibers.append(Fiber(name=name, fixed=fixed, values=values, free=free, singular=singular, types=types))
    answer = RootSet(found)
    answer.fibers = tuple(fibers)
    return answer


def root_arrays(
    alpha1: npt.ArrayLike,
    alpha2: npt.ArrayLike,
    coefficients: Coefficients | None = None,
    *,
    crossing_tolerance: float = DEFAULT_CROSSING_TOLERANCE,
) -> RootArrays:
    """Return the roots of many (α1, α2) at once, in the order of :func:`roots`.

    Parameters
    ----------
    alpha1, alpha2
        Tilt angles in [−π/2, π/2] [rad], broadcast against each other to the shape (...).
    coefficients, crossing_tolerance
        As for :func:`roots`.

    Raises
    ------
    InputError
        If an angle is not finite or outside [−π/2, π/2].

    Examples
    --------
    >>> root_arrays([0.3, np.pi / 2, np.pi / 2], [0.1, 0.1, -np.pi / 2]).count.tolist()
    [2, 3, 5]
    """
    coefficients = coefficients or coefficients_of()
    a1, a2 = np.broadcast_arrays(*checked_plane_angles(alpha1, alpha2))
    # Eight candidates: on each sheet both ends of the range for α3 and for α4, where they lie at an end.
    exists, angles, kinds = [], [], []
    for color in COLORS:
        third, fourth = sheet_angles(color, a1, a2, coefficients)
        pair = np.stack(types_of(color, a1, a2, coefficients, crossing_tolerance), axis=-1)
        end3, end4 = at_end_of_range(third), at_end_of_range(fourth)
        for side3, side4 in product((-HALF_PI, HALF_PI), repeat=2):
            exists.append((end3 | (side3 < 0)) & (end4 | (side4 < 0)))
            angles.append(np.stack([a1, a2, np.where(end3, side3, third), np.where(end4, side4, fourth)], axis=-1))
            kinds.append(pair)
    exist = np.stack(exists, axis=-1)
    order = np.argsort(~exist, axis=-1, kind="stable")[..., :_MOST_ROOTS]
    taken = np.take_along_axis(exist, order, axis=-1)
    alpha = np.take_along_axis(np.stack(angles, axis=-2), order[..., None], axis=-2)
    types = np.take_along_axis(np.stack(kinds, axis=-2), order[..., None], axis=-2)
    alpha[~taken] = np.nan
    types[~taken] = 0
    return RootArrays(
        count=exist.sum(axis=-1),
        alpha=alpha,
        sheet=np.where(taken, np.where(order < 4, 1, -1), 0).astype(np.int8),
        types=types,
        R=level_determinant(alpha, coefficients),
    )


def sheet_grid(
    color: Color,
    alpha1: npt.ArrayLike,
    alpha2: npt.ArrayLike,
    coefficients: Coefficients | None = None,
    *,
    crossing_tolerance: float = DEFAULT_CROSSING_TOLERANCE,
) -> SheetGrid:
    """Return the roots of one sheet over the grid alpha1 × alpha2.

    Parameters
    ----------
    color
        "red" or "blue".
    alpha1, alpha2
        The grid's axes in [−π/2, π/2] [rad], one-dimensional.
    coefficients, crossing_tolerance
        As for :func:`roots`; for a grid of step h the paper's types have the tolerance h/2.

    Examples
    --------
    >>> axis = np.linspace(-np.pi / 2, np.pi / 2, 17)
    >>> sum(sheet_grid(color, axis, axis).R.size for color in COLORS)
    650
    """
    coefficients = coefficients or coefficients_of()
    a1, a2 = checked_plane_angles(alpha1, alpha2)
    if a1.ndim != 1 or a2.ndim != 1:
        raise InputError(f"alpha1 and alpha2 must be axes of one dimension, got {a1.ndim} and {a2.ndim}")

    def with_both_ends(angles: FloatArray) -> tuple[npt.NDArray[np.int64], FloatArray]:
        """Return each angle's index and its representations: two where it lies at an end of the range."""
        at_end = at_end_of_range(angles)
        index = np.repeat(np.arange(angles.size), np.where(at_end, 2, 1))
        second = np.diff(index, prepend=-1) == 0
        return index, np.where(at_end[index], np.where(second, HALF_PI, -HALF_PI), angles[index])

    third, fourth = sheet_angles(color, a1, a2, coefficients)
    row, alpha3 = with_both_ends(third)
    column, alpha4 = with_both_ends(fourth)
    types3, types4 = types_of(color, a1[row], a2[column], coefficients, crossing_tolerance)
    left = pair_features(a1[row], alpha3) @ coefficients.bilinear_form
    return SheetGrid(
        color=color,
        row=row,
        column=column,
        alpha3=alpha3,
        alpha4=alpha4,
        types3=types3,
        types4=types4,
        R=left @ pair_features(a2[column], alpha4).T,
    )
