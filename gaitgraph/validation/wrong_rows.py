"""Why rows lie on no sheet: another convention, a constant offset, or a single wrong row."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from gaitgraph.angles import wrapped
from gaitgraph.surface.sheets import COLORS, family_distances, sheet_forms

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
    found = []
    for unit, order, sign in product(units, orders, signs):
        words = [one for one in (unit, order, sign) if one]
        matrix = np.diag(units[unit])[:, orders[order]] * signs[sign]
        found.append(
            Convention(words=", then ".join(words), matrix=matrix, degrees=unit != "")
        )
    found.sort(key=lambda one: one.words.count(", then "))
    return tuple(one for one in found if one.words)


CONVENTIONS = _conventions()
_MATRICES = np.array([one.matrix for one in CONVENTIONS])
_IN_DEGREES = np.array([one.degrees for one in CONVENTIONS])
_OF_SEVERAL = np.array([", then " in one.words for one in CONVENTIONS])


class Misreading:
    """Which conventions put all points on one sheet, and whether all are off a sheet by the same angles."""

    def __init__(self, coefficients: Coefficients, tolerance: float) -> None:
        self.coefficients, self.tolerance = coefficients, tolerance
        self.fits = np.ones((len(CONVENTIONS), len(COLORS)), dtype=bool)
        if coefficients.is_raised:  # with a rotor height blue is no gait surface
            self.fits[:, 1] = False
        self.points = 0
        self.first = np.zeros(
            (len(COLORS), 2)
        )  # how far the first point is off each sheet
        self.low = np.zeros((len(COLORS), 2))  # of the differences from it
        self.high = np.zeros((len(COLORS), 2))
        self.least = np.full(4, math.inf)
        self.most = np.full(4, -math.inf)
        self.sum = np.zeros(4)
        self.products = np.zeros((4, 4))

    def update(self, alpha: FloatArray) -> None:
        """Examine further points, shape (n, 4) [rad]."""
        self._find_conventions(alpha)
        forms = sheet_forms(alpha, self.coefficients)
        if not self.points:
            self.first = wrapped(forms[:, :, 0])
        differences = wrapped(forms - self.first[:, :, None])
        self.low = np.minimum(self.low, differences.min(axis=2))
        self.high = np.maximum(self.high, differences.max(axis=2))
        self.least = np.minimum(self.least, alpha.min(axis=0))
        self.most = np.maximum(self.most, alpha.max(axis=0))
        self.sum += alpha.sum(axis=0)
        self.products += alpha.T @ alpha
        self.points += len(alpha)

    def _find_conventions(self, alpha: FloatArray) -> None:
        some = alpha[[0, len(alpha) // 2, -1]]  # which exclude most of them
        self.fits &= self._near(some @ _MATRICES).all(axis=1)
        for k in np.flatnonzero(self.fits.any(axis=1)).tolist():
            self.fits[k] &= self._near(alpha @ _MATRICES[k]).all(axis=0)

    def _near(self, alpha: FloatArray) -> BoolArray:
        distances = family_distances(alpha, self.coefficients)
        return np.asarray(distances[..., : len(COLORS)] <= self.tolerance)

    @property
    def convention(self) -> Convention | None:
        """The first convention that puts all points on one sheet, or None.

        One of several changes is none if it puts them on a line too, which points with few different angles allow.
        """
        if not self.points:
            return None
        fits: BoolArray = np.asarray(self.fits.any(axis=1))
        for k in np.flatnonzero(fits & _OF_SEVERAL).tolist():
            fits[k] = self._spread(_MATRICES[k]) > _LEAST_MOTION * self.tolerance
        if max(-self.least[2:].min(), self.most[2:].max()) <= math.pi:
            fits = fits & ~_IN_DEGREES
        found = np.flatnonzero(fits)
        return CONVENTIONS[int(found[0])] if len(found) else None

    def _spread(self, matrix: FloatArray) -> float:
        """Return the least standard deviation of α1 and α2, in any direction of the plane, of points that are read so."""
        mean = self.sum / self.points
        covariance = self.products / self.points - np.outer(mean, mean)
        plane = (matrix.T @ covariance @ matrix)[:2, :2]
        variances = np.linalg.eigvalsh(plane)
        return math.sqrt(max(float(variances[0]), 0.0))

    def advice(self) -> str:
        """Return what would put all points on one sheet, or an empty text."""
        convention = self.convention
        if convention is not None:
            fits = self.fits[CONVENTIONS.index(convention)]
            color = COLORS[int(np.argmax(fits))]
            return f"all rows would lie on {color} with {convention.words}"
        constant = (self.high - self.low).max(axis=1) <= 2 * self.tolerance
        if self.coefficients.is_raised:
            constant[1] = False
        motion = float((self.most - self.least)[:2].max())
        if (
            not constant.any()
            or self.points < _FEWEST_ROWS
            or motion < _LEAST_MOTION * self.tolerance
        ):
            return ""
        offsets = wrapped(self.first + (self.low + self.high) / 2)
        sizes = np.where(constant, np.abs(offsets).max(axis=1), math.inf)
        sheet = int(np.argmin(sizes))
        if sizes[sheet] < _LEAST_OFFSET * self.tolerance:
            return ""  # the points are on the sheet
        third, fourth = np.degrees(offsets[sheet]).tolist()
        return (
            f"all rows are off {COLORS[sheet]} by the same angles, α3 by {third:.2f}° and α4 by {fourth:.2f}°: "
            "is a zero of a servo wrong?"
        )


class LoneRows:
    """Rows that alone are far from their neighbours.

    Such a row is far from the middle of its neighbours: three times their distance from it, and from the rows beyond.
    """

    def __init__(self) -> None:
        self.rows: list[int] = []  # their numbers
        self.note = ""
        self._window = np.zeros(
            (0, 4)
        )  # the last rows, of which the last two are not judged yet
        self._next = 2  # the number of the first of these
        self._count = math.inf  # of different rows

    def update(self, alpha: FloatArray) -> None:
        """Examine the next rows, shape (n, 4) [rad]."""
        # Before row 1 stands a copy of it: row 2 may be judged, row 1 at the end of a gait.
        before = self._window if len(self._window) else alpha[:1]
        self._judge(np.concatenate([before, alpha]))

    def finish(self, following: FloatArray, count: int) -> None:
        """Judge the last rows, by what follows them: the first rows of a gait, or the last row of a path.

        `count` is the number of rows without a last one that repeats the first.
        """
        self._count = count
        self._judge(np.concatenate([self._window, following]))
        if count < _FEWEST_DENSE_ROWS:
            self.rows, self.note = [], ""

    def is_near(self, number: int) -> bool:
        """Return whether differences of rows at a row, counted from 1, contain one of these."""
        apart = [abs(row - number) for row in self.rows]
        return any(min(one, self._count - one) <= 2 for one in apart)

    def _judge(self, alpha: FloatArray) -> None:
        """Judge each row with two rows on both sides, and keep the last four rows."""
        steps = np.abs(np.diff(alpha, axis=0)).max(axis=1)
        before, at, after = alpha[1:-3], alpha[2:-2], alpha[3:-1]
        apart = np.abs(after - before).max(axis=1)
        off = np.abs(at - (before + after) / 2).max(axis=1)
        usual = np.maximum(apart / 2, np.maximum(steps[:-3], steps[3:]))
        lone = np.flatnonzero(off > np.maximum(_FAR * usual, _LEAST_STEP))
        for k in lone.tolist():
            row = self._next + k
            if row > self._count:  # row 1 follows the last one
                row -= int(self._count)
            self.rows.append(row)
            self.note = self.note or (
                f"row {row} alone is {off[k]:.3g} rad from the middle of its neighbours, which are {apart[k]:.3g} rad "
                "apart: is a value wrong?"
            )
        self._next += len(apart)
        self._window = alpha[-4:]
