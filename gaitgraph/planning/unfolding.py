"""Shortest ways across the lines where the fibres meet the red sheet: the flat pages unfolded into one plane.

The red sheet and the fibres are flat pages in four dimensions, joined along straight lines: the red sheet with the
first fibre where α1 = δ, with the second where α2 = −δ. Turning a page about its line, as of paper, changes no length.
So what is shortest across a line is straight once the pages lie in one plane. Lengths are travel, four-dimensional
lengths over √2, in which the red sheet is the (α1, α2) plane itself; a point of a fibre is as far from its line as half
the difference of its free angles, beside their mean.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from gaitgraph.errors import InputError, shown
from gaitgraph.surface.fibers import FIXED_ANGLES, FREE_ANGLES, fiber_level, fiber_points, line_intervals
from gaitgraph.surface.sheets import FIBERS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gaitgraph.invertibility.matrices import Coefficients

__all__ = ["LegAcross", "shortest_leg_across", "shortest_leg_between_fibers"]

FloatArray = npt.NDArray[np.float64]

_EXACT = 1e-9
_MARGIN = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True)
class LegAcross:
    """The shortest way between two points on different pages, straight on each page.

    Parameters
    ----------
    points
        Start, each crossing of a line, and end, shape (3 or 4, 4) [rad].
    colors
        Of these points; crossings are on the red sheet too, and red.
    travel
        Length in four dimensions over √2 [rad].
    bent
        Whether the straight way in the unfolded plane would cross where it may not, so that the leg bends there.
    """

    points: FloatArray
    colors: tuple[str, ...]
    travel: float
    bent: bool

    def reversed(self) -> LegAcross:
        """Return the way back."""
        return LegAcross(points=self.points[::-1], colors=self.colors[::-1], travel=self.travel, bent=self.bent)


def shortest_leg_across(
    start: npt.ArrayLike,
    end: npt.ArrayLike,
    fiber: str,
    coefficients: Coefficients,
    *,
    admissible: Sequence[tuple[float, float]] | None = None,
) -> LegAcross | None:
    """Return the shortest way between a point of a fibre and one of the red sheet, either way round; None if none.

    With u the coordinate along the line and h the distance from it, the straight way in the unfolded plane crosses at
    (u₁h₂ + u₂h₁)/(h₁ + h₂). The travel is a convex function of the crossing, so if that point may not be passed, the
    best is the nearest one that may, on one side or on the other.

    Parameters
    ----------
    start, end
        (α1, α2, α3, α4), shape (4,) [rad]: one on the fibre, the other on the red sheet.
    fiber
        "fiber1" or "fiber2".
    coefficients
        The coefficients of the surfaces.
    admissible
        Closed intervals of the line's free angle that may be crossed [rad]; by default where R has the sign that it has
        at the point on the fibre, on the piece of that point, 1e-6 rad away from R = 0.

    Notes
    -----
    Not guaranteed: that the straight pieces are free of obstacles, or keep the sign of R on the red sheet.

    Raises
    ------
    InputError
        If the two points are not one on the fibre and one on the red sheet, to within 1e-9 rad.

    Examples
    --------
    >>> from gaitgraph.invertibility.matrices import coefficients_of
    >>> at = coefficients_of().delta
    >>> leg = shortest_leg_across([at, 0.4, at, 0.8], [at - 0.2, 0.8, at - 0.2, 0.8], "fiber1", coefficients_of())
    >>> round(float(leg.points[1, 1]), 6), round(leg.travel, 6)
    (0.7, 0.447214)
    """
    level = fiber_level(fiber, coefficients)
    first, last = _point(start, "start"), _point(end, "end")
    if not (_is_on(first, fiber, level) and _is_red(last)):
        if not (_is_on(last, fiber, level) and _is_red(first)):
            raise InputError(
                f"start, end: {shown(start)}, {shown(end)}; allowed are one point on {fiber} and one on the red sheet"
            )
        back = shortest_leg_across(last, first, fiber, coefficients, admissible=admissible)
        return None if back is None else back.reversed()
    u1, h1 = _place(first, fiber)
    u2, h2 = float(last[FREE_ANGLES[fiber][0]]), abs(float(last[FIXED_ANGLES[fiber][0]]) - level)
    straight = (u1 * h2 + u2 * h1) / (h1 + h2) if h1 + h2 > 0 else u1
    ways = [min(max(straight, low), high) for low, high in _allowed(fiber, coefficients, u1, admissible) if low <= high]
    if not ways:
        return None

    def travel(u: float) -> float:
        return math.hypot(u - u1, h1) + math.hypot(u - u2, h2)

    crossing = min(ways, key=lambda u: (travel(u), u))
    return LegAcross(
        points=np.stack([first, fiber_points(fiber, (crossing, crossing), coefficients), last]),
        colors=(fiber, "red", "red"),
        travel=travel(crossing),
        bent=crossing != straight,
    )


def shortest_leg_between_fibers(
    start: npt.ArrayLike,
    end: npt.ArrayLike,
    coefficients: Coefficients,
    *,
    admissible: dict[str, Sequence[tuple[float, float]]] | None = None,
) -> LegAcross | None:
    """Return the shortest way from a point of one fibre, over the red sheet, to a point of the other; None if none.

    Both pages are unfolded into the red plane, each to the side that the way does not take. The straight way counts if
    it crosses both lines, in order, where it may, within one quadrant of the lines. Otherwise the shortest ways come as
    near as one likes to where the lines meet, R = 0, or bend at the end of what is admissible: there is no answer here.

    Parameters
    ----------
    start, end
        (α1, α2, α3, α4), shape (4,) [rad], on different fibres.
    coefficients
        The coefficients of the surfaces.
    admissible
        For each fibre, the intervals of its line that may be crossed, as for :func:`shortest_leg_across`.

    Raises
    ------
    InputError
        If the two points are not on one fibre each, to within 1e-9 rad.

    Examples
    --------
    >>> from gaitgraph.invertibility.matrices import coefficients_of
    >>> at = coefficients_of().delta
    >>> leg = shortest_leg_between_fibers([at, 0.2, at, 0.4], [-0.6, -at, -0.4, -at], coefficients_of())
    >>> leg.colors, round(leg.travel, 4)
    (('fiber1', 'red', 'red', 'fiber2'), 0.954)
    """
    first, last = _point(start, "start"), _point(end, "end")
    level = coefficients.delta
    if not (_is_on(first, "fiber1", level) and _is_on(last, "fiber2", -level)):
        if not (_is_on(first, "fiber2", -level) and _is_on(last, "fiber1", level)):
            raise InputError(f"start, end: {shown(start)}, {shown(end)}; allowed is one point on each of the fibres")
        back = shortest_leg_between_fibers(last, first, coefficients, admissible=admissible)
        return None if back is None else back.reversed()
    (u1, h1), (u2, h2) = _place(first, "fiber1"), _place(last, "fiber2")
    given = admissible or {}
    along = [
        list(_allowed(fiber, coefficients, u, given.get(fiber))) for fiber, u in zip(FIBERS, (u1, u2), strict=True)
    ]
    best: LegAcross | None = None
    for left, up in product((1.0, -1.0), repeat=2):
        # The red part is where left·(δ − α1) ≥ 0 and up·(α2 + δ) ≥ 0; the pages are unfolded to the other sides.
        p, q = (level + left * h1, u1), (u2, -level - up * h2)
        if abs(q[0] - p[0]) <= _EXACT or abs(q[1] - p[1]) <= _EXACT:
            continue
        s1, s2 = (level - p[0]) / (q[0] - p[0]), (-level - p[1]) / (q[1] - p[1])
        t1, t2 = p[1] + s1 * (q[1] - p[1]), p[0] + s2 * (q[0] - p[0])
        in_order = 0 <= s1 <= s2 <= 1 and up * (t1 + level) >= 0 and left * (level - t2) >= 0
        passable = all(any(low <= t <= high for low, high in part) for t, part in zip((t1, t2), along, strict=True))
        if not (in_order and passable):
            continue
        found = LegAcross(
            points=np.stack(
                [
                    first,
                    fiber_points("fiber1", (t1, t1), coefficients),
                    fiber_points("fiber2", (t2, t2), coefficients),
                    last,
                ]
            ),
            colors=("fiber1", "red", "red", "fiber2"),
            travel=math.dist(p, q),
            bent=False,
        )
        best = found if best is None or found.travel < best.travel else best
    return best


def _point(value: npt.ArrayLike, name: str) -> FloatArray:
    try:
        point = np.array(value, dtype=float)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name}: {shown(value)}; allowed are four angles [rad]") from error
    if point.shape != (4,) or not np.isfinite(point).all():
        raise InputError(f"{name}: {shown(value)}; allowed are four finite angles [rad]")
    return point


def _is_on(point: FloatArray, fiber: str, level: float) -> bool:
    return bool(np.abs(point[list(FIXED_ANGLES[fiber])] - level).max() <= _EXACT)


def _is_red(point: FloatArray) -> bool:
    return bool(np.abs(point[2:] - point[:2]).max() <= _EXACT)


def _place(point: FloatArray, fiber: str) -> tuple[float, float]:
    """Return the place of a point of a fibre along its line, and its distance from it, as travel."""
    free = point[list(FREE_ANGLES[fiber])]
    return float(free.mean()), abs(float(free[1] - free[0])) / 2


def _allowed(
    fiber: str, coefficients: Coefficients, mean: float, given: Sequence[tuple[float, float]] | None
) -> Sequence[tuple[float, float]]:
    """Return where the line may be crossed; unless given, on the piece of a mean of the free angles."""
    if given is not None:
        return given
    out = []
    for sign in ("positive", "negative"):
        whole = line_intervals(fiber, coefficients, sign)
        inner = line_intervals(fiber, coefficients, sign, margin=_MARGIN)
        out += [inside for (low, high), inside in zip(whole, inner, strict=True) if low < mean < high]
    return out
