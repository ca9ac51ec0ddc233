"""Why rows lie on no sheet: another convention, a constant offset, or single wrong rows."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from gaitgraph.angles import wrapped
from gaitgraph.gait.table import is_closed
from gaitgraph.surface.sheets import COLORS, sheet_distances, sheet_forms

if TYPE_CHECKING:
    from gaitgraph.invertibility.coefficients import Coefficients
    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.invertibility.matrices import BoolArray

_FAR = 3.0  # times the steps nearby
_FEWEST_ROWS = 3  # of which an offset is called constant
_LEAST_MOTION = 10.0  # of a table with a constant offset, in tolerances
_FEWEST_DENSE_ROWS = 10  # of a table that is more than its corners
_LEAST_OFFSET = 0.1  # in tolerances
_LEAST_STEP = 0.01  # to a row that is far from its neighbours [rad]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Convention:
    """Another reading of four columns: its words, and the matrix that turns rows into tilt angles."""

    words: str
    matrix: FloatArray
    degrees: bool


def _conventions() -> tuple[Convention, ...]:
    """Return all conventions that are tried, those of few changes first."""
    orders = {
        "": (0, 1, 2, 3),
        "alpha2 and alpha3 exchanged": (0, 2, 1, 3),
        "alpha3 and alpha4 exchanged": (0, 1, 3, 2),
    }
    signs = {
        "": (1, 1, 1, 1),
        "the other sign of alpha3": (1, 1, -1, 1),
        "the other sign of alpha4": (1, 1, 1, -1),
        "the other sign of alpha3 and alpha4": (1, 1, -1, -1),
    }
    degree = math.radians(1.0)
    units = {
        "": (1, 1, 1, 1),
        "alpha3 and alpha4 in degrees (alpha3_deg, alpha4_deg)": (1, 1, degree, degree),
    }
    conventions = []
    for unit, order, sign in product(units, orders, signs):
        words = ", then ".join(filter(None, [unit, order, sign]))
        matrix = np.diag(units[unit])[:, orders[order]] * signs[sign]
        conventions.append(Convention(words=words, matrix=matrix, degrees=unit != ""))
    conventions.sort(key=lambda convention: convention.words.count(", then "))
    return tuple(conventions[1:])  # without the one that changes nothing


_CONVENTIONS = _conventions()


@dataclass(frozen=True, slots=True, kw_only=True)
class Misreading:
    """How rows that lie on no sheet were misread: the advice, empty if it is not known, and the convention if it is one."""

    advice: str = ""
    convention: Convention | None = None


def misreading_of(
    alpha: FloatArray, coefficients: Coefficients, tolerance: float
) -> Misreading:
    """Return which other reading puts all points, shape (n, 4) [rad], on one sheet."""
    colors = list(range(len(COLORS)))
    if coefficients.is_raised:  # with a rotor height blue is no gait surface
        colors = colors[:1]
    some = alpha[[0, len(alpha) // 2, -1]]  # which exclude most conventions
    for convention in _CONVENTIONS:
        near = _all_near(some, convention, coefficients, tolerance)
        if near[colors].any():
            near = _all_near(alpha, convention, coefficients, tolerance)
        fitting = [COLORS[k] for k in colors if near[k]]
        if fitting and _is_likely(alpha, convention, tolerance):
            advice = f"all rows would lie on {fitting[0]} with {convention.words}"
            return Misreading(advice=advice, convention=convention)
    return Misreading(advice=_advice_on_offset(alpha, coefficients, colors, tolerance))


def _all_near(
    alpha: FloatArray,
    convention: Convention,
    coefficients: Coefficients,
    tolerance: float,
) -> BoolArray:
    """Return whether all points, read by a convention, are on red, and on blue."""
    distances = sheet_distances(alpha @ convention.matrix, coefficients)
    return np.asarray((distances <= tolerance).all(axis=0))


def _is_likely(alpha: FloatArray, convention: Convention, tolerance: float) -> bool:
    """Return whether a convention is more than a coincidence.

    Degrees are larger than π. One of several changes must leave points with many different (α1, α2): some matrices put
    all points on a line.
    """
    if convention.degrees and np.abs(alpha[:, 2:]).max() <= math.pi:
        return False
    if ", then " not in convention.words:
        return True
    plane = (alpha @ convention.matrix)[:, :2]
    covariance = np.cov(plane.T, bias=True)
    least = max(float(np.linalg.eigvalsh(covariance)[0]), 0.0)
    return math.sqrt(least) > _LEAST_MOTION * tolerance


def _advice_on_offset(
    alpha: FloatArray, coefficients: Coefficients, colors: list[int], tolerance: float
) -> str:
    """Return by which constant angles all points are off one sheet, in words, else an empty text."""
    motion = float(np.ptp(alpha[:, :2], axis=0).max())
    if len(alpha) < _FEWEST_ROWS or motion < _LEAST_MOTION * tolerance:
        return ""
    forms = sheet_forms(alpha, coefficients)[colors]
    first = wrapped(forms[:, :, :1])
    apart = wrapped(forms - first)
    low, high = apart.min(axis=2), apart.max(axis=2)
    offsets = wrapped(first[:, :, 0] + (low + high) / 2)
    is_constant = (high - low).max(axis=1) <= 2 * tolerance
    sizes = np.where(is_constant, np.abs(offsets).max(axis=1), math.inf)
    sheet = int(np.argmin(sizes))
    if not _LEAST_OFFSET * tolerance <= sizes[sheet] < math.inf:
        return ""
    third, fourth = np.degrees(offsets[sheet]).tolist()
    return (
        f"all rows are off {COLORS[sheet]} by the same angles, α3 by {third:.2f}° and α4 by {fourth:.2f}°: "
        "is a zero of a servo wrong?"
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class LoneRows:
    """Rows that alone are far from their neighbours: their numbers, a note on the first, and how many rows there are."""

    numbers: tuple[int, ...] = ()
    note: str = ""
    count: int = 0

    def is_near(self, number: int) -> bool:
        """Return whether differences of rows at a row, counted from 1, contain one of these."""
        apart = [abs(row - number) for row in self.numbers]
        return any(min(size, self.count - size) <= 2 for size in apart)


def lone_rows(alpha: FloatArray, repeats: bool) -> LoneRows:
    """Return which rows, shape (n, 4) [rad], alone are far from their neighbours.

    Such a row is far from the middle of its neighbours: three times their distance from it, and from the rows beyond.
    """
    count = len(alpha)
    if repeats:
        count -= is_closed(alpha)
        around, first = alpha[np.arange(-2, count + 2) % count], 1
    else:  # the first and the last row of a path have one neighbour
        around, first = np.concatenate([alpha[:1], alpha, alpha[-1:]]), 2
    if count < _FEWEST_DENSE_ROWS:
        return LoneRows()
    around = np.ascontiguousarray(around.T)  # long rows are faster
    steps = np.abs(np.diff(around)).max(axis=0)
    before, at, after = around[:, 1:-3], around[:, 2:-2], around[:, 3:-1]
    apart = np.abs(after - before).max(axis=0)
    off = np.abs(at - (before + after) / 2).max(axis=0)
    usual = np.maximum(apart / 2, np.maximum(steps[:-3], steps[3:]))
    lone = np.flatnonzero(off > np.maximum(_FAR * usual, _LEAST_STEP))
    if not len(lone):
        return LoneRows()
    k = lone[0]
    note = (
        f"row {k + first} alone is {off[k]:.3g} rad from the middle of its neighbours, which are {apart[k]:.3g} rad "
        "apart: is a value wrong?"
    )
    numbers = tuple((lone + first).tolist())
    return LoneRows(numbers=numbers, note=note, count=count)
