"""The four families that hold every solution of Rφ = Rθ = 0: the red sheet, the blue sheet and two fibres.

Rφ and Rθ factorise (see :mod:`gaitgraph.invertibility.matrices`), so their common zeros are these and no other:

======= ================================= =========== ============================ ==============
color   equations (mod π)                 plane types R, exact coefficients        idle in hover
======= ================================= =========== ============================ ==============
red     α3 = α1,      α4 = α2             (+,+)       (2/(κ cos²δ))·cos β1·cos β2· none
                                                      (2κ cos α1 cos α2 −
                                                      sin(α1 − α2))
blue    α3 = 2δ − α1, α4 = −2δ − α2       (−,−)       0                            (singular)
fiber1  α1 = α3 = δ,  α2 and α4 free      (?,*)       2C·sin(β2 + β4)              rotors 2 and 4
fiber2  α2 = α4 = −δ, α1 and α3 free      (*,?)       −2C·sin(β1 + β3)             rotors 1 and 3
======= ================================= =========== ============================ ==============

with δ = atan κ, C = 1/sin 2δ, β1 = α1 − δ, β3 = α3 − δ, β2 = α2 + δ and β4 = α4 + δ. A family is a plane of the four
angles, so a straight segment between two of its points stays on it. On a sheet α3 depends on α1 alone and α4 on α2
alone. A fibre meets the red sheet where its free angles are equal, and within ±π/2 there alone; a pair of rotors idles
there in hover, so no gait on a fibre can fly.

On the red sheet R = 0 on two lines and one curve. Inside [−π/2, π/2]² the signs of the three factors label the seven
components that remain. Two points with different labels cannot be joined without a singular matrix.

In arrays a family is +1 red, −1 blue, 2 the first fibre, 3 the second, 0 none.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import HALF_PI, distance_to_multiple, number_of, wrapped
from gaitgraph.errors import InputError, shown
from gaitgraph.surface.adjacency import FREE
from gaitgraph.vehicle import PAPER, Vehicle

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gaitgraph.invertibility.matrices import Coefficients

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int8]
Color = Literal["red", "blue"]

COLORS: tuple[Color, Color] = ("red", "blue")
"""The two sheets: red is the + sheet, blue the − sheet."""

FIBERS = ("fiber1", "fiber2")
"""Colors of the two fibres: α1 = α3 = δ, and α2 = α4 = −δ."""

FAMILIES = (*COLORS, *FIBERS)
"""The four families, in the order of the columns of :func:`family_distances`."""

FIRST, SECOND = 2, 3
"""The codes of the two fibres."""

_CODES = {"red": 1, "blue": -1, "fiber1": FIRST, "fiber2": SECOND}
_COLORS = {code: color for color, code in _CODES.items()}
_FIXED = {FIRST: [0, 2], SECOND: [1, 3]}  # which two of the four angles a fibre fixes

DEFAULT_CROSSING_TOLERANCE = math.pi / 32
"""Within this distance of a crossing line [rad] a plane type is `?`: half a step of the paper's grid."""

DEFAULT_TOLERANCE = 2e-3
"""|Rφ| and |Rθ| up to this count as on the surface; the paper's printed vertices reach 1.4e-3."""

Sign = Literal["positive", "negative"]

SIGNS: tuple[Sign, Sign] = ("negative", "positive")
"""The two signs of R, in the order in which colourings are listed: the paper's Figure 16 is of R < 0."""

RELATION = {"negative": "R < 0", "positive": "R > 0"}
"""The two signs in symbols."""

HOVER_LABEL = (1, 1, 1)
"""The label of the component of α = 0, which ordinary hover can reach; see :func:`red_label`."""

_ROUND_OFF = 1e-12


def family_codes(colors: Sequence[str]) -> IntArray:
    """Return colors as +1 red, −1 blue, 2 the first and 3 the second fibre, shape (n,).

    >>> family_codes(["red", "blue", "fiber1", "fiber2"]).tolist()
    [1, -1, 2, 3]
    """
    return np.array([_CODES[color] for color in colors], dtype=np.int8)


def family_of(code: int) -> str:
    """Return the color of a code; see :func:`family_codes`."""
    return _COLORS[int(code)]


def sheet_angles(
    color: Color, alpha1: npt.ArrayLike, alpha2: npt.ArrayLike, coefficients: Coefficients
) -> tuple[FloatArray, FloatArray]:
    """Return (α3, α4) on a sheet, wrapped into [−π/2, π/2], each of the shape of its own argument [rad].

    >>> from gaitgraph.invertibility.matrices import coefficients_of
    >>> a3, a4 = sheet_angles("blue", 5 * np.pi / 16, np.pi / 8, coefficients_of())
    >>> round(float(a3), 3), round(float(a4), 3)
    (-0.648, -0.727)
    """
    alpha1, alpha2 = np.asarray(alpha1, dtype=float), np.asarray(alpha2, dtype=float)
    if color not in COLORS:
        raise InputError(f"color must be 'red' or 'blue', got {shown(color)}")
    if color == "red":
        return wrapped(alpha1), wrapped(alpha2)
    return wrapped(2 * coefficients.delta - alpha1), wrapped(-2 * coefficients.delta - alpha2)


def types_of(
    color: Color,
    alpha1: npt.ArrayLike,
    alpha2: npt.ArrayLike,
    coefficients: Coefficients,
    crossing_tolerance: float = DEFAULT_CROSSING_TOLERANCE,
) -> tuple[IntArray, IntArray]:
    """Return the plane types of α3 and α4 on a sheet as +1, 0 (`?`) or −1, each of its argument's shape.

    A type is `?` where the planes cross: within `crossing_tolerance` [rad] of β1 ≡ 0 (mod π/2) for α3 and of
    β2 ≡ 0 (mod π/2) for α4. Half a grid step marks exactly the nodes nearest to the line.
    """
    if not 0 <= number_of(crossing_tolerance) < math.inf:
        raise InputError(f"crossing_tolerance must be a finite number ≥ 0 (rad), got {shown(crossing_tolerance)}")
    sign, zero = np.int8(_CODES[color]), np.int8(0)
    reach = crossing_tolerance + _ROUND_OFF
    near3 = distance_to_multiple(np.asarray(alpha1, dtype=float) - coefficients.delta, HALF_PI) <= reach
    near4 = distance_to_multiple(np.asarray(alpha2, dtype=float) + coefficients.delta, HALF_PI) <= reach
    return np.where(near3, zero, sign), np.where(near4, zero, sign)


def at_end_of_range(angle: npt.ArrayLike) -> npt.NDArray[np.bool_]:
    """Return whether an angle in [−π/2, π/2] lies at an end, where it stands for both ends, shape (...)."""
    return np.asarray(HALF_PI - np.abs(np.asarray(angle, dtype=float)) <= _ROUND_OFF)


def checked_plane_angles(alpha1: Any, alpha2: Any) -> tuple[FloatArray, FloatArray]:
    """Return α1 and α2 as arrays, or raise InputError naming the one that leaves [−π/2, π/2]."""
    out = []
    for name, value in (("alpha1", alpha1), ("alpha2", alpha2)):
        try:
            angles = np.asarray(value, dtype=float)
        except (TypeError, ValueError) as error:
            raise InputError(f"{name} must be angles in radians, got {shown(value)}") from error
        bad = ~(np.abs(angles) <= HALF_PI)
        if bad.any():
            first = float(angles[bad].flat[0])
            raise InputError(f"{name} must be from −π/2 to π/2 (±{HALF_PI!r} rad), got {first!r}")
        out.append(angles)
    return out[0], out[1]


def _fixed_angle(code: int, coefficients: Coefficients) -> float:
    """Return the value of the two angles that a fibre fixes: δ on the first, −δ on the second [rad]."""
    return coefficients.delta if code == FIRST else -coefficients.delta


def family_distances(alpha: npt.ArrayLike, coefficients: Coefficients) -> FloatArray:
    """Return how far points are from red, blue, the first and the second fibre, mod π, shape (..., 4) [rad].

    On a sheet α3 and α4 are compared, on a fibre its two fixed angles; the larger difference counts. The copies of the
    fibres at β = π/2 (mod π), where R = 0, are not counted as fibres.

    >>> from gaitgraph.invertibility.matrices import coefficients_of
    >>> delta = coefficients_of().delta
    >>> family_distances([delta, 0.3, delta, 0.5], coefficients_of()).round(3).tolist()
    [0.2, 1.134, 0.0, 0.667]
    """
    alpha = np.asarray(alpha, dtype=float)
    differences = []
    for color in COLORS:
        third, fourth = sheet_angles(color, alpha[..., 0], alpha[..., 1], coefficients)
        differences.append(np.stack([alpha[..., 2] - third, alpha[..., 3] - fourth], axis=-1))
    for code, fixed in _FIXED.items():
        differences.append(alpha[..., fixed] - _fixed_angle(code, coefficients))
    return np.asarray(distance_to_multiple(np.stack(differences, axis=-2), math.pi).max(axis=-1))


def families_along(alpha: npt.ArrayLike, coefficients: Coefficients, tolerance: float, *, before: int = 0) -> IntArray:
    """Return which family each of consecutive points lies on: +1 red, −1 blue, 2 and 3 the fibres, 0 none, shape (n,).

    Parameters
    ----------
    alpha, coefficients
        The points, shape (n, 4) [rad], and the coefficients of the surfaces.
    tolerance
        How far from a family, mod π, a point may be [rad]. A sheet goes before a fibre.
    before
        The family of the point before. A point on both sheets, near where they meet, follows the one before; at the
        beginning, the first that is on one alone; if there is none, it is red. A point where a fibre meets the blue
        sheet, R = 0, follows the fibre if the one before was on it.

    Examples
    --------
    >>> from gaitgraph.invertibility.matrices import coefficients_of
    >>> at = coefficients_of().delta
    >>> families_along([[at, 0.3, at, 0.3], [at, 0.3, at, 0.4]], coefficients_of(), 2e-3).tolist()
    [1, 2]
    """
    near = family_distances(alpha, coefficients) <= tolerance
    on_red, on_blue = near[:, 0], near[:, 1]
    both = on_red & on_blue
    out = np.where(on_red, 1, np.where(on_blue, -1, 0)).astype(np.int8)
    if both.any():
        single = np.flatnonzero(~both)
        start = (before if before in (-1, 1) else 0) or (int(out[single[0]]) if single.size else 0) or 1
        # Each point on both sheets takes the last known one; those that are on neither count as known.
        known = np.concatenate([[start], out])
        latest = np.maximum.accumulate(np.where(np.concatenate([[True], ~both]), np.arange(len(known)), 0))[1:]
        out[both] = np.where(known[latest] == 0, 1, known[latest])[both]
    for code, column in ((SECOND, 3), (FIRST, 2)):
        out[(out == 0) & near[:, column]] = code
    meets_blue = on_blue & ~on_red & near[:, 2:].any(axis=1)
    for point in np.flatnonzero(meets_blue).tolist():
        previous = before if point == 0 else int(out[point - 1])
        if previous > 1 and near[point, previous]:
            out[point] = previous
    return out


def family_types(
    alpha: npt.ArrayLike, codes: npt.ArrayLike, coefficients: Coefficients, crossing_tolerance: float
) -> tuple[IntArray, IntArray]:
    """Return the plane types of α3 and α4 at points of families, each +1, 0 (`?`), −1 or `FREE` (`*`), shape (n,).

    On a sheet they are those of :func:`types_of`. On a fibre the fixed angle is where its planes cross, `?`, and the
    free one is on neither plane, `*`. Off the surfaces both are 0.

    >>> from gaitgraph.invertibility.matrices import coefficients_of
    >>> at = coefficients_of().delta
    >>> [part.tolist() for part in family_types([[at, 0.3, at, 0.4]], [2], coefficients_of(), 0.1)]
    [[0], [2]]
    """
    alpha, codes = np.asarray(alpha, dtype=float), np.asarray(codes, dtype=np.int8)
    crossing = types_of("red", alpha[..., 0], alpha[..., 1], coefficients, crossing_tolerance)
    sheet = np.where(codes > 1, 0, codes)
    third, fourth = (np.where(part == 0, 0, sheet).astype(np.int8) for part in crossing)
    third[codes == SECOND], fourth[codes == FIRST] = FREE, FREE
    return third, fourth


def types_contradict(types: npt.ArrayLike, codes: npt.ArrayLike) -> npt.NDArray[np.bool_]:
    """Return whether stated types, codes of shape (n, 2), contradict the families of points, codes (n,); shape (n,).

    A type `+` is not on blue, − not on red; `*` is on a fibre alone, and on a fibre the types are its own. A point on
    no family has no types to contradict.

    >>> types_contradict([[1, 0], [1, 0], [0, 2], [2, 0]], [1, -1, 2, 2]).tolist()
    [False, True, False, True]
    """
    stated, codes = np.asarray(types), np.asarray(codes)
    third, fourth = stated[:, 0], stated[:, 1]
    sheet = np.where(codes > 1, 0, codes)[:, None]
    free = (stated == FREE).any(axis=1)
    on_sheets = (stated * sheet < 0).any(axis=1) | (free & (codes != 0))
    own = np.where(codes == FIRST, (third == 0) & (fourth == FREE), (third == FREE) & (fourth == 0))
    return np.asarray(np.where(codes > 1, ~own, on_sheets))


def family_jumps(
    starts: FloatArray, ends: FloatArray, codes: IntArray, after: IntArray, coefficients: Coefficients
) -> FloatArray:
    """Return by how much segments leave the families of both their ends, shape (m,) [rad]; one of them is a fibre.

    A segment stays on a family if both its ends are on it and no angle wraps: families are planes. Of the families of
    its two ends the one that it leaves less counts; the distance from it is linear along the segment, so that the ends
    decide.
    """

    def distance(of: IntArray) -> FloatArray:
        out = np.full(len(starts), math.inf)
        for code in np.unique(of[of != 0]).tolist():
            here = of == code
            p, step = starts[here], ends[here] - starts[here]
            if code in _FIXED:
                fixed = _FIXED[code]
                apart = wrapped(p[:, fixed] - _fixed_angle(code, coefficients))
                change = step[:, fixed]
            else:
                third, fourth = sheet_angles(COLORS[code < 0], p[:, 0], p[:, 1], coefficients)
                apart = wrapped(p[:, 2:] - np.column_stack([third, fourth]))
                change = step[:, 2:] - code * step[:, :2]
            out[here] = np.maximum(np.abs(apart), np.abs(apart + change)).max(axis=1)
        return out

    return np.minimum(distance(codes), distance(after))


def red_label(alpha1: npt.ArrayLike, alpha2: npt.ArrayLike, vehicle: Vehicle = PAPER) -> npt.NDArray[np.int64]:
    """Return the signs of the three factors of R on the red sheet, exact coefficients, shape (..., 3).

    The third is positive on the side of α = 0. Their product is the sign of R; a zero is singular.

    >>> red_label(0.0, 0.0).tolist(), red_label(1.178, -0.393).tolist()
    ([1, 1, 1], [1, 1, -1])
    """
    a1, a2 = np.asarray(alpha1, dtype=float), np.asarray(alpha2, dtype=float)
    kappa = vehicle.signed_drag_ratio
    delta = math.atan(kappa)
    saddle = math.copysign(1.0, kappa) * (2 * kappa * np.cos(a1) * np.cos(a2) - np.sin(a1 - a2))
    factors = np.stack(np.broadcast_arrays(np.cos(a1 - delta), np.cos(a2 + delta), saddle), axis=-1)
    return np.asarray(np.sign(factors).astype(np.int64))


def separating_factor(first: Sequence[float], second: Sequence[float], vehicle: Vehicle = PAPER) -> str | None:
    """Return what separates two points (α1, α2) of the red sheet with R ≠ 0, in words, or None.

    >>> separating_factor((0.0, 0.0), (1.178, -0.393))
    'the curve tan α1 − tan α2 = 2κ = 0.3373'
    """
    a, b = red_label(first[0], first[1], vehicle), red_label(second[0], second[1], vehicle)
    kappa = vehicle.signed_drag_ratio
    delta = math.atan(kappa)
    edge = math.copysign(math.pi / 2, delta)
    names = (
        f"the line α1 = {delta - edge:.4f} (β1 = ∓π/2)",
        f"the line α2 = {edge - delta:.4f} (β2 = ±π/2)",
        f"the curve tan α1 − tan α2 = 2κ = {2 * kappa:.4f}",
    )
    differing = [name for name, x, y in zip(names, a, b, strict=True) if x != y]
    return " and ".join(differing) or None
