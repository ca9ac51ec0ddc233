"""The two fibres: planes of solutions on which the free angle of one pair of opposite arms is the rotor's own.

With β1 = α1 − δ and so on, as in :mod:`gaitgraph.invertibility.matrices`, and C = 1/sin 2δ:

======== ============ ======================= ================= ==========================
color    equations    free angles             R                 idle in hover
======== ============ ======================= ================= ==========================
fiber1   α1 = α3 = δ  α2 and α4               2C·sin(β2 + β4)   rotors 2 and 4
fiber2   α2 = α4 = −δ α1 and α3               −2C·sin(β1 + β3)  rotors 1 and 3
======== ============ ======================= ================= ==========================

A fibre is a plane, and straight segments between its points stay on it. It meets the red sheet in the *line* where its
free angles are equal, and within ±π/2 there alone. R on the fibre depends on the sum of its free angles only.

The (α1, α2) plane hides the motion of the free α3 or α4, so lengths are compared in four dimensions. *Travel* is the
four-dimensional length over √2; on both sheets it is the length in the (α1, α2) plane.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import HALF_PI
from gaitgraph.errors import InputError, shown
from gaitgraph.surface.sheets import (
    _CODES,
    FAMILIES,
    FIBERS,
    FIRST,
    SECOND,
    _fixed_angle,
    family_distances,
    sheet_angles,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gaitgraph.invertibility.matrices import Coefficients

FloatArray = npt.NDArray[np.float64]

FREE_ANGLES = {"fiber1": (1, 3), "fiber2": (0, 2)}
"""Which two of the four angles are free on a fibre, counted from 0."""

FIXED_ANGLES = {"fiber1": (0, 2), "fiber2": (1, 3)}
"""Which two of the four angles are fixed on a fibre, counted from 0."""

_FIXED = {FIRST: (0, 2), SECOND: (1, 3)}
_EXACT = 1e-9


def _code(fiber: str) -> int:
    if not isinstance(fiber, str) or fiber not in FIBERS:
        raise InputError(f"fiber: {shown(fiber)}; allowed are 'fiber1' and 'fiber2'")
    return _CODES[fiber]


def fiber_level(fiber: str, coefficients: Coefficients) -> float:
    """Return the value of the two fixed angles of a fibre: δ on the first and −δ on the second [rad]."""
    return _fixed_angle(_code(fiber), coefficients)


def fiber_points(fiber: str, free: npt.ArrayLike, coefficients: Coefficients) -> FloatArray:
    """Return points of a fibre from its free angles.

    Parameters
    ----------
    fiber
        "fiber1", whose free angles are (α2, α4), or "fiber2", with (α1, α3).
    free
        The free angles, shape (..., 2) [rad].
    coefficients
        The coefficients of the surfaces.

    Returns
    -------
    array of shape (..., 4) [rad]

    Raises
    ------
    InputError
        If there is no such fibre, or the angles are no pairs of finite numbers.

    Examples
    --------
    >>> from gaitgraph.invertibility.matrices import coefficients_of
    >>> fiber_points("fiber2", [0.1, 0.5], coefficients_of()).round(3).tolist()
    [0.1, -0.167, 0.5, -0.167]
    """
    code = _code(fiber)
    try:
        angles = np.asarray(free, dtype=float)
    except (TypeError, ValueError) as error:
        raise InputError(f"free: {shown(free)}; allowed are pairs of angles in radians") from error
    if angles.shape[-1:] != (2,) or not np.isfinite(angles).all():
        raise InputError(f"free: {shown(free)}; allowed are pairs of finite angles in radians")
    out = np.full((*angles.shape[:-1], 4), _fixed_angle(code, coefficients))
    out[..., FREE_ANGLES[fiber]] = angles
    return out


def travel_of(starts: npt.ArrayLike, ends: npt.ArrayLike) -> FloatArray:
    """Return the lengths of segments in four dimensions over √2, shape (...) [rad].

    On both sheets that is the length in the (α1, α2) plane, which hides the motion of α3 or α4 on a fibre.

    >>> round(float(travel_of([0.0, 0.0, 0.0, 0.0], [0.3, 0.4, 0.3, 0.4])), 12)
    0.5
    """
    step = np.asarray(ends, dtype=float) - np.asarray(starts, dtype=float)
    return np.asarray(np.linalg.norm(step, axis=-1) / math.sqrt(2.0))


def point_on_family(
    point: Any, coefficients: Coefficients, *, tolerance: float = 2e-3, name: str = "point"
) -> tuple[tuple[float, ...], str]:
    """Return four tilt angles moved onto the family that they are nearest to, and its color.

    Parameters
    ----------
    point
        (α1, α2, α3, α4) in [−π/2, π/2], shape (4,) [rad].
    coefficients
        The coefficients of the surfaces.
    tolerance
        How far from a family a point may be, in the largest of the angles compared [rad]. On a sheet α3 and α4 are
        moved, on a fibre the fixed angles; the others stay.
    name
        What a message calls the point.

    Raises
    ------
    InputError
        If an angle is outside [−π/2, π/2], or the point is on no family.

    Examples
    --------
    >>> from gaitgraph.invertibility.matrices import coefficients_of
    >>> point_on_family((0.167, 0.3, 0.167, 0.9), coefficients_of())[1]
    'fiber1'
    """
    alpha = np.array(point, dtype=float)
    if alpha.shape != (4,) or not (np.abs(alpha) <= HALF_PI).all():
        raise InputError(f"{name}: {shown(point)}; allowed are four angles in [−π/2, π/2] [rad]")
    off = family_distances(alpha, coefficients)
    # A point where families meet is on a sheet rather than on a fibre, but for what is certainly nearer.
    nearest = int(np.argmax(off <= off.min() + _EXACT))
    if off[nearest] > tolerance:
        apart = ", ".join(f"{color} {away:.4g}" for color, away in zip(FAMILIES, off.tolist(), strict=True))
        delta = coefficients.delta
        raise InputError(
            f"{name}: {shown(point)} is on no sheet or fibre (rad from {apart}); allowed are four angles within "
            f"{tolerance:g} rad of one, such as α1 = α3 = {delta:.6f} or α2 = α4 = {-delta:.6f}"
        )
    color = FAMILIES[nearest]
    if color in FIBERS:
        columns = list(_FIXED[_CODES[color]])
        target = np.full(2, _fixed_angle(_CODES[color], coefficients))
    else:
        columns = [2, 3]
        target = np.array(sheet_angles(color, alpha[0], alpha[1], coefficients))  # type: ignore[arg-type]
    # The representative within the range that is nearest: at its ends there are two.
    turned = target + math.pi * np.rint((alpha[columns] - target) / math.pi)
    alpha[columns] = np.where(np.abs(turned) <= HALF_PI + 1e-12, np.clip(turned, -HALF_PI, HALF_PI), target)
    return tuple(alpha.tolist()), color


def nearest_on_line(alpha: npt.ArrayLike, fiber: str, coefficients: Coefficients) -> FloatArray:
    """Return the nearest points of a fibre's line to points of the fibre, shape (..., 4) [rad].

    Both free angles take their mean. R stays what it is, so a point and the nearest one on the line are joined through
    the same R; and no path gets longer by it.

    >>> from gaitgraph.invertibility.matrices import coefficients_of
    >>> at = coefficients_of().delta
    >>> nearest_on_line([at, 0.2, at, 0.6], "fiber1", coefficients_of()).round(3).tolist()
    [0.167, 0.4, 0.167, 0.4]
    """
    mean = np.asarray(alpha, dtype=float)[..., FREE_ANGLES[fiber]].mean(axis=-1)
    return fiber_points(fiber, np.stack([mean, mean], axis=-1), coefficients)


def line_intervals(
    fiber: str, coefficients: Coefficients, sign: str, *, margin: float = 0.0
) -> list[tuple[float, float]]:
    """Return where on a fibre's line R has a sign: intervals of its two equal free angles in [−π/2, π/2] [rad].

    Parameters
    ----------
    fiber
        "fiber1" or "fiber2".
    coefficients
        The coefficients of the surfaces; R is that of exact ones, with their δ.
    sign
        "positive" or "negative".
    margin
        How far to stay from R = 0 [rad].

    Notes
    -----
    Points of a fibre with free angles in [−π/2, π/2] and R of one sign can be joined with the line through such points
    exactly if the mean of both lies in one of these intervals: R depends on the mean alone.

    Examples
    --------
    >>> from gaitgraph.invertibility.matrices import coefficients_of
    >>> [[round(end, 3) for end in interval] for interval in line_intervals("fiber1", coefficients_of(), "positive")]
    [[-0.167, 1.404]]
    """
    code = _code(fiber)
    if sign not in ("positive", "negative"):
        raise InputError(f"sign: {shown(sign)}; allowed are 'positive' and 'negative'")
    wanted = 1 if sign == "positive" else -1
    return [_inside(piece[:2], margin) for piece in _pieces(code, coefficients) if piece[2] == wanted]


def _pieces(code: int, coefficients: Coefficients) -> list[tuple[float, float, int]]:
    """Return the pieces into which R = 0 cuts a fibre's line in [−π/2, π/2]: both ends and the sign of R."""
    # R = 2C·sin(2(t + δ)) on the first line and −2C·sin(2(t − δ)) on the second; C has the sign of δ.
    zero = -coefficients.delta if code == FIRST else coefficients.delta
    turn = math.copysign(1.0, coefficients.delta) * (1.0 if code == FIRST else -1.0)
    inner = {zero + k * HALF_PI for k in (-2, -1, 0, 1, 2)}
    cuts = sorted({-HALF_PI, HALF_PI, *(cut for cut in inner if abs(cut) < HALF_PI)})
    return [(low, high, 1 if turn * math.sin(low + high - 2 * zero) > 0 else -1) for low, high in pairwise(cuts)]


def _inside(piece: tuple[float, float], margin: float) -> tuple[float, float]:
    """Return a piece of a line without what is nearer than a margin to R = 0; its middle if nothing is left."""
    low, high = piece
    first = low + margin if low > -HALF_PI else low
    last = high - margin if high < HALF_PI else high
    return (first, last) if first <= last else ((low + high) / 2, (low + high) / 2)


def stops_on_families(
    waypoints: Sequence[Sequence[float]], coefficients: Coefficients
) -> tuple[tuple[tuple[float, ...], ...], tuple[str, ...]]:
    """Return waypoints with those of four angles moved onto the sheet or fibre that they are on, and notes about it.

    Parameters
    ----------
    waypoints
        (α1, α2), which stays as it is, or (α1, α2, α3, α4) on a sheet or a fibre to within 2e-3 rad, in [−π/2, π/2]
        [rad]; on red it becomes (α1, α2).
    coefficients
        The coefficients of the surfaces.

    Raises
    ------
    InputError
        If four angles are on no sheet or fibre; the message names the waypoint.

    Examples
    --------
    >>> from gaitgraph.invertibility.matrices import coefficients_of
    >>> stops_on_families([(0.1, 0.4), (0.167, 0.3, 0.167, 0.9)], coefficients_of())[1]
    ('waypoint 2 moved by 9.9e-05 rad onto fiber1',)
    """
    out: list[tuple[float, ...]] = []
    notes = []
    for number, point in enumerate(waypoints, start=1):
        if len(point) == 2:
            out.append((float(point[0]), float(point[1])))
            continue
        angles, color = point_on_family(point, coefficients, name=f"waypoint {number}")
        moved = float(np.abs(np.subtract(angles, point)).max())
        if moved > _EXACT:
            notes.append(f"waypoint {number} moved by {moved:.1e} rad onto {color}")
        # A red point is the red root above its (α1, α2), and planned as such.
        out.append(angles[:2] if color == "red" and angles[:2] == angles[2:] else angles)
    return tuple(out), tuple(notes)
