"""Paths that are run once, from rest to rest, as the exact polynomial pieces of a certificate.

Each piece is of the fifth degree and has the angles, rates and accelerations of the path at both ends. That is the path
itself where its law is such a polynomial. The run-up to a gait is none: its pieces are halved until they are near enough.
"""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise
from math import comb
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitgraph.errors import Advice, Infeasible
from gaitgraph.timing.joining import RunUp, Turns

if TYPE_CHECKING:
    from collections.abc import Iterator

    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.timing.timed_gait import TimedGait

_NEAR = 1e-12  # of pieces to a run-up [rad]
_SHORTEST = 1e-4  # piece of a run-up, a share of it
_INSIDE = 1e-13  # share of a motion; how far from the ends of a piece its rates are taken, since they may jump there
_AT_REST = 1e-9  # share of the largest rate
GRID = 15
"""Digits of angles [rad]."""
_DEGREE = 5


def pieces_along(path: TimedGait) -> tuple[list[dict[str, Any]], float]:
    """Return a path as exact pieces, and how far they are from it at most [rad].

    Raises Infeasible if it is not at rest at both ends.
    """
    controls = []
    widths = []
    off = 0.0
    for motion in _motions_of(path):
        for start, end in _intervals(motion):
            control, away = _fitted(motion, start, end)
            controls.append(control)
            widths.append(end - start)
            off = max(off, away)
    points = np.array(controls)
    largest = np.abs(path.peaks(1)).max()
    for end, next_to_it, width in ((0, 1, widths[0]), (-1, -2, widths[-1])):
        rates = _DEGREE * (points[end, next_to_it] - points[end, end]) / width
        if np.abs(rates).max() > _AT_REST * largest:
            raise Infeasible(
                "no certificate, since the path is run once and is not at rest at both ends",
                advice=Advice("use the law 'smooth'", "use --law smooth"),
            )
        points[end, next_to_it] = points[end, end]
    ends = (points[:-1, -1] + points[1:, 0]) / 2
    points[:-1, -1] = points[1:, 0] = ends
    pieces = []
    for control, width in zip(points, widths, strict=True):
        alpha = opposite_once(_curves_of(control))
        pieces.append({"alpha": alpha, "duration": decimal(width)})
    return pieces, off


def _motions_of(path: Any) -> Iterator[TimedGait | RunUp]:
    """Yield the motions that make a path, one after another; a gait for each of its periods."""
    for section in getattr(path, "sections", (path,)):
        if isinstance(section, Turns):
            yield from [section.motion] * section.periods
        else:
            yield section


def _intervals(motion: TimedGait | RunUp) -> Iterator[tuple[float, float]]:
    """Yield the intervals of a motion that become pieces [s]."""
    corners = pairwise(motion.corner_times.tolist())
    todo = [(start, end) for start, end in corners if end > start][::-1]
    while todo:
        start, end = todo.pop()
        is_long = end - start > _SHORTEST * motion.period
        if is_long and _fitted(motion, start, end)[1] > _NEAR:
            middle = (start + end) / 2
            todo += [(middle, end), (start, middle)]
        else:
            yield start, end


def _fitted(
    motion: TimedGait | RunUp, start: float, end: float
) -> tuple[FloatArray, float]:
    """Return the Bernstein coefficients (6, 4) of a piece, and how far it is from the motion at samples [rad]."""
    from scipy.interpolate import BPoly

    inside = _INSIDE * motion.period
    times = np.linspace(start, end, 17)
    alpha = motion.at(times).alpha
    _, rates, accelerations = motion.at(np.array([start + inside, end - inside]))
    known = np.stack([alpha[[0, -1]], rates, accelerations], axis=1)
    curve = BPoly.from_derivatives([start, end], known)
    return curve.c[:, 0], float(np.abs(curve(times) - alpha).max())


def _curves_of(control: FloatArray) -> list[list[Fraction]]:
    """Return the exact polynomials of angles, the lowest power first, of their Bernstein coefficients (6, 4)."""
    curves = []
    for points in control.T.tolist():
        curve = []
        # The power basis has the differences of the points, 0 to 5 of them in a row.
        differences = [decimal(point, GRID) for point in points]
        for power in range(_DEGREE + 1):
            curve.append(comb(_DEGREE, power) * differences[0])
            differences = [b - a for a, b in pairwise(differences)]
        while len(curve) > 1 and curve[-1] == 0:
            curve.pop()
        curves.append(curve)
    return curves


def opposite_once(curves: list[list[Fraction]]) -> list[list[Fraction]]:
    """Return the polynomials of four angles, or of two if opposite ones are equal."""
    if curves[:2] == curves[2:]:
        return curves[:2]
    return curves


def decimal(value: float, digits: int | None = None) -> Fraction:
    """Return the exact value of a float's shortest decimal, rounded to some digits."""
    if digits is not None:
        value = round(value, digits)
    return Fraction(repr(float(value)))
