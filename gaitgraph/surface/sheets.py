"""The four families that hold every solution of Rφ = Rθ = 0, and every root over points of the (α1, α2) plane.

Rφ and Rθ factorise (see :mod:`gaitgraph.invertibility.matrices`), so their common zeros are these and no other:

======= ================================= =========== ============================ ==============
family  equations (mod π)                 plane types R, exact coefficients        idle in hover
======= ================================= =========== ============================ ==============
red     α3 = α1,      α4 = α2             (+,+)       (2/(κ cos²δ))·cos β1·cos β2· none
                                                      (2κ cos α1 cos α2 −
                                                      sin(α1 − α2))
blue    α3 = 2δ − α1, α4 = −2δ − α2       (−,−)       0                            (singular)
fibre 1 α1 = α3 = δ,  α2 and α4 free      (?,*)       2C·sin(β2 + β4)              rotors 2 and 4
fibre 2 α2 = α4 = −δ, α1 and α3 free      (*,?)       −2C·sin(β1 + β3)             rotors 1 and 3
======= ================================= =========== ============================ ==============

with δ = atan κ, C = 1/sin 2δ, β1 = α1 − δ, β3 = α3 − δ, β2 = α2 + δ and β4 = α4 + δ. A family is a plane of the four
angles, so a straight segment between two of its points stays on it. On a sheet α3 depends on α1 alone and α4 on α2
alone. A fibre meets the red sheet where its free angles are equal, and within ±π/2 there alone; a pair of rotors idles
there in hover, so no gait on a fibre can fly: a point of a fibre has a color only where it is on a sheet too.

All this is for rotors at the height of the centre of mass. With a rotor height H red and the fibres stay solutions, and
their hover thrusts do not change; R does, and instead of the lines there is a curve. Blue is no solution then, and not
singular in level flight: its zero-moment direction leans (docs/theory.md, 9).

Plane types are neighbours on a loop as in Figure 15: an angle must not step from its + plane to its − plane, but may
pass through `?`, where the planes cross; (a) is for one angle, (b) for both.

In arrays a color is +1 red, −1 blue, 0 none.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import (
    HALF_PI,
    angle_from_text,
    angle_within,
    angles_from,
    checked_number,
    distance_to_multiple,
    wrapped,
)
from gaitgraph.arrays import freeze_arrays
from gaitgraph.errors import checked_choice, wrong
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.invertibility.forms import FloatArray, level_of
from gaitgraph.invertibility.matrices import (
    attitude_sensitivities,
    level_determinant,
    tilt_angles,
)
from gaitgraph.records import Record
from gaitgraph.surface.curved import sheet_of
from gaitgraph.tolerances import (
    DEFAULT_CROSSING_TOLERANCE,
    ROUND_OFF,
    SAME_ANGLE,
)
from gaitgraph.vehicle import PAPER, VehicleLike

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gaitgraph.invertibility.coefficients import Coefficients, CoefficientsLike

CodeArray = npt.NDArray[np.int8]
Color = Literal["red", "blue"]
Sign = Literal["positive", "negative"]
ColorChoice = Literal["auto", Color]
SignChoice = Literal["auto", Sign]

COLORS: tuple[Color, Color] = ("red", "blue")  # red is the + sheet, blue the − sheet
# The seven categories of roots; (+,−) and (−,+) never occur.
PLANE_TYPES = ("(+,+)", "(-,-)", "(+,?)", "(?,+)", "(-,?)", "(?,-)", "(?,?)")
_TYPE_MARKS = {1: "+", 0: "?", -1: "-"}
_TYPE_CODES = {"+": 1, "?": 0, "-": -1, "−": -1}
_TYPES_TEXT = re.compile(r"\(\s*([+?−-])\s*,\s*([+?−-])\s*\)")
_CODES = {"red": 1, "blue": -1}

# The two signs of R, in the order in which colourings are listed: the paper's Figure 16 is of R < 0.
SIGNS: tuple[Sign, Sign] = ("negative", "positive")
RAISED = "(use red), since its zero-moment direction leans for rotors at a height of"
RELATION = {"negative": "R < 0", "positive": "R > 0"}
_MOST_ROOTS = 5
# Both ends of the range for α3, and for α4, in the order of the roots.
_SIDES = np.array(
    [[-HALF_PI, -HALF_PI, HALF_PI, HALF_PI], [-HALF_PI, HALF_PI, -HALF_PI, HALF_PI]]
)


def sheet_angles(
    color: Color,
    alpha1: npt.ArrayLike,
    alpha2: npt.ArrayLike,
    coefficients: CoefficientsLike | None = None,
    *,
    vehicle: VehicleLike = PAPER,
) -> tuple[FloatArray, FloatArray]:
    """Return (α3, α4) on a sheet, wrapped into [−π/2, π/2], each of the shape of its own argument [rad].

    The coefficients are by default the vehicle's. "red" is the sheet on which a vehicle can fly, for any four rotors.

    >>> a3, a4 = sheet_angles("blue", 5 * np.pi / 16, np.pi / 8)
    >>> round(float(a3), 3), round(float(a4), 3)
    (-0.648, -0.727)
    """
    first, second = angles_from(alpha1, "alpha1"), angles_from(alpha2, "alpha2")
    checked_choice("color", color, COLORS)
    coefficients = coefficients_of(vehicle, coefficients)
    if color == "red" and coefficients.rotors.asymmetry is not None:
        others = sheet_of(coefficients.rotors).angles(first, second)
        return others[..., 0], others[..., 1]
    crossing1, crossing2 = coefficients.crossings
    if color == "red":
        return wrapped(first), wrapped(second)
    return wrapped(2 * crossing1 - first), wrapped(2 * crossing2 - second)


def types_of(
    color: Color,
    alpha1: npt.ArrayLike,
    alpha2: npt.ArrayLike,
    coefficients: Coefficients,
    crossing_tolerance: float = DEFAULT_CROSSING_TOLERANCE,
) -> tuple[CodeArray, CodeArray]:
    """Return the plane types of α3 and α4 on a sheet as +1, 0 (`?`) or −1, each of its argument's shape.

    A type is `?` where the planes cross: within `crossing_tolerance` [rad] of β1 ≡ 0 (mod π/2) for α3 and of
    β2 ≡ 0 (mod π/2) for α4. Half a grid step marks exactly the nodes nearest to the line.
    """
    reach = (
        checked_number(
            "crossing_tolerance", crossing_tolerance, "a finite number ≥ 0 (rad)"
        )
        + ROUND_OFF
    )
    lines = zip((alpha1, alpha2), coefficients.crossings, strict=True)
    third, fourth = (
        distance_to_multiple(angles_from(x) - line, HALF_PI) for x, line in lines
    )
    sign, zero = np.int8(_CODES[color]), np.int8(0)
    return np.where(third <= reach, zero, sign), np.where(fourth <= reach, zero, sign)


def at_end_of_range(angle: npt.ArrayLike) -> npt.NDArray[np.bool_]:
    """Return whether an angle in [−π/2, π/2] lies at an end, where it stands for both ends, shape (...)."""
    return np.asarray(HALF_PI - np.abs(np.asarray(angle, dtype=float)) <= ROUND_OFF)


def checked_plane_angles(alpha1: Any, alpha2: Any) -> tuple[FloatArray, FloatArray]:
    """Return α1 and α2 as arrays, or raise InputError naming the one that leaves [−π/2, π/2]."""
    first, second = angles_from(alpha1, "alpha1"), angles_from(alpha2, "alpha2")
    for name, angles in (("alpha1", first), ("alpha2", second)):
        for outside in angles[~(np.abs(angles) <= HALF_PI)][:1]:
            angle_within(float(outside), name)
    return first, second


@dataclass(frozen=True, slots=True, kw_only=True)
class Root(Record):
    """One solution of equations (7) and (8), angles in radians, `types` in ASCII such as ``(+,?)``.

    Where rotors lie above or below the centre of mass, the second root is on no plane: `types` and `color` are "none".

    `R`, `R_phi` and `R_theta` are computed from the solution, not assumed.
    """

    alpha1: float
    alpha2: float
    alpha3: float
    alpha4: float
    types: str
    color: Color | Literal["none"]
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

    The fibre called "first" (β1 ≡ 0 mod π/2) fixes alpha3, with the types ``(?,*)``; "second" (β2 ≡ 0 mod π/2) fixes
    alpha4, with ``(*,?)``. The fixed angle has one of `values`, in [−π/2, π/2] [rad]. `singular` is true at β = π/2
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


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RootArrays:
    """The roots of many (α1, α2) of the shape (...), padded to five along the last axis.

    `count` (...) is their number; the angles `alpha` (..., 5, 4) [rad] and equation (6) `R` (..., 5) are NaN beyond.
    `sheet` (..., 5) is +1 red, −1 blue, 0 none; `types` (..., 5, 2) of α3 and of α4 are +1, 0 (`?`) or −1.
    """

    count: npt.NDArray[np.int64]
    alpha: FloatArray
    sheet: CodeArray
    types: CodeArray
    R: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(self)

    def __repr__(self) -> str:
        return f"<RootArrays: {self.count.size} points, {self.count.sum()} roots>"


def roots(
    alpha1: float | str,
    alpha2: float | str,
    *,
    vehicle: VehicleLike = PAPER,
    coefficients: CoefficientsLike | None = None,
    crossing_tolerance: float = DEFAULT_CROSSING_TOLERANCE,
) -> RootSet:
    """Return every (α3, α4) in [−π/2, π/2]² with Rφ = Rθ = 0 for one (α1, α2).

    There are two inside the square, a red and a blue one. A solution at one end of the range is one at the other end
    too, with the opposite sign of R: three on the sides of the square, five at its corners (Figure 2), one more where
    blue lies at an end of the range, α1 = 2δ − π/2 or α2 = π/2 − 2δ. With a rotor height the second root is not blue: its
    types and color are "none", and the decoupling matrix is singular there at every attitude. On a fibre line the
    solutions are a continuum: `fibers` of the answer states it, beside the red and the blue root. R may be 0: look at
    `R` of each root. Of a vehicle that no half turn maps to itself the invertible root is called red, without types.

    Parameters
    ----------
    alpha1, alpha2
        Tilt angles of rotors 1 and 2, numbers [rad] or texts such as "pi/8"; InputError outside [−π/2, π/2].
    vehicle, coefficients
        The vehicle, and the coefficients of formula (1), by default the vehicle's: published ones for the paper's.
    crossing_tolerance
        Distance from a crossing line within which a type is `?` [rad].

    Examples
    --------
    >>> [(root.types, root.color, round(root.alpha3, 3)) for root in roots(0.9, -0.4)]
    [('(+,+)', 'red', 0.9), ('(-,-)', 'blue', -0.566)]
    >>> len(roots(np.pi / 2, 0.3)), len(roots(np.pi / 2, -np.pi / 2))
    (3, 5)
    """
    coefficients = coefficients_of(vehicle, coefficients)
    a1, a2 = angle_from_text(alpha1, "alpha1"), angle_from_text(alpha2, "alpha2")
    checked_plane_angles(a1, a2)
    fibers = _fibers_through(a1, a2, coefficients)
    colors: list[Color | Literal["none"]]
    if coefficients.rotors.asymmetry is not None:
        alpha = np.array(curved_roots(a1, a2, coefficients))
        types, colors = ["none", "none"], ["red", "none"]
    else:
        found = root_arrays(
            a1, a2, coefficients=coefficients, crossing_tolerance=crossing_tolerance
        )
        alpha = found.alpha[: found.count]
        codes = found.sheet[: found.count].tolist()
        types = [text_from_types(*pair) for pair in found.types.tolist()][: len(codes)]
        colors = [color_of(code) for code in codes]
        if coefficients.is_raised and not fibers:
            _, singular = curved_roots(a1, a2, coefficients)
            alpha = np.vstack([alpha, singular])
            types, colors = [*types, "none"], [*colors, "none"]
    v = attitude_sensitivities(alpha, coefficients)
    # A residual of −0.0 is printed as 0.0.
    values = np.column_stack([alpha[:, 2:], v[:, 2], v[:, 1], -v[:, 0]]) + 0.0
    answer = RootSet(
        Root(
            alpha1=a1,
            alpha2=a2,
            alpha3=a3,
            alpha4=a4,
            types=label,
            color=color,
            R=R,
            R_phi=roll,
            R_theta=pitch,
        )
        for label, color, (a3, a4, R, roll, pitch) in zip(
            types, colors, values.tolist(), strict=True
        )
    )
    answer.fibers = fibers
    return answer


def _fibers_through(
    alpha1: float, alpha2: float, coefficients: Coefficients
) -> tuple[Fiber, ...]:
    """Return the fibres above a point (α1, α2).

    Rφ and Rθ are u₃ᵀAu₄ and u₃ᵀBu₄. They vanish for every α4 where u₃ is a null vector of both from the left, and for
    every α3 where u₄ is one from the right. On a symmetric vehicle the fixed angle is that of the opposite arm.
    """
    u1, u2 = ([math.cos(angle), math.sin(angle)] for angle in (alpha1, alpha2))
    forms = np.einsum("abcdq,a,b->qcd", coefficients.form.table, u1, u2)
    surface, level = forms[:2], forms[2]
    is_symmetric = coefficients.rotors.asymmetry is None
    fibers = []
    for name, fixed, free, opposite, planes, sides, of_level in (
        ("first", "alpha3", "alpha4", alpha1, "(?,*)", surface.mT, level.T),
        ("second", "alpha4", "alpha3", alpha2, "(*,?)", surface, level),
    ):
        _, (size, least), (_, null) = np.linalg.svd(sides.reshape(4, 2))
        if least > SAME_ANGLE * size:
            continue
        if is_symmetric:
            value, types = opposite, planes
        else:
            value, types = float(wrapped(math.atan2(null[1], null[0]))), "none"
        none = 2 * SAME_ANGLE * size + coefficients.largest_errors[2]
        fiber = Fiber(
            name=name,
            fixed=fixed,
            values=(value,),
            free=free,
            singular=bool(np.abs(of_level @ null).max() <= none),
            types=types,
        )
        fibers.append(fiber)
    return tuple(fibers)


def curved_roots(
    alpha1: npt.ArrayLike, alpha2: npt.ArrayLike, coefficients: Coefficients
) -> tuple[FloatArray, FloatArray]:
    """Return both roots of every vehicle in closed form, shape (..., 4) [rad]: the invertible one, and the singular one.

    At the singular root all four moments lie in one plane, so R = 0; it is blue without rotor heights. The moments of
    rotors 1 and 2 span that plane, with the normal n, and those of the others lie in it where n·T₃u₃ = n·T₄u₄ = 0. The
    invertible root, red for symmetric vehicles, is that of :mod:`gaitgraph.surface.curved` (docs/theory.md, Theorem 1).
    """
    first, second = np.broadcast_arrays(alpha1, alpha2)
    level = level_of(coefficients.rotors)
    u1, u2 = (np.stack([np.cos(a), np.sin(a)], axis=-1) for a in (first, second))
    normal = np.cross(u1 @ level.moment[0].T, u2 @ level.moment[1].T)
    parts = np.einsum("...i,kij->...kj", normal, level.moment[2:])
    opposite = wrapped(np.arctan2(-parts[..., 0], parts[..., 1]))
    singular = np.concatenate([np.stack([first, second], axis=-1), opposite], axis=-1)

    invertible = singular.copy()
    invertible[..., 2:] = sheet_of(coefficients.rotors).angles(first, second)
    return invertible, singular


def root_arrays(
    alpha1: npt.ArrayLike,
    alpha2: npt.ArrayLike,
    *,
    vehicle: VehicleLike = PAPER,
    coefficients: CoefficientsLike | None = None,
    crossing_tolerance: float = DEFAULT_CROSSING_TOLERANCE,
) -> RootArrays:
    """Return the roots of many (α1, α2) at once, in the order of :func:`roots`; options and errors are the same.

    Of a half-turn symmetric vehicle with rotors above or below the centre of mass the singular root, which is on no
    plane, is left out.

    `alpha1` and `alpha2` are broadcast against each other to the shape (...).

    >>> root_arrays([0.3, np.pi / 2, np.pi / 2], [0.1, 0.1, -np.pi / 2]).count.tolist()
    [2, 3, 5]
    """
    coefficients = coefficients_of(vehicle, coefficients)
    first, second = checked_plane_angles(alpha1, alpha2)
    if coefficients.rotors.asymmetry is not None:
        return _curved_root_arrays(first, second, coefficients)
    # Four candidates on each sheet: both ends of the range for α3 and for α4. An angle elsewhere uses one end only.
    sheets = [
        sheet_angles(color, first, second, coefficients)
        for color in coefficients.colors
    ]
    third, fourth = (
        np.stack(angles, axis=-1)[..., None] for angles in zip(*sheets, strict=True)
    )
    end3, end4 = at_end_of_range(third), at_end_of_range(fourth)
    exist = (end3 | (_SIDES[0] < 0)) & (end4 | (_SIDES[1] < 0))
    codes = np.array([[_CODES[color]] for color in coefficients.colors], dtype=np.int8)
    third, fourth = np.where(end3, _SIDES[0], third), np.where(end4, _SIDES[1], fourth)
    parts = (codes, first[..., None, None], second[..., None, None], third, fourth)
    on_sheet, *angles = (np.broadcast_to(part, exist.shape)[exist] for part in parts)
    points, count = np.array(angles).T, exist.sum(axis=(-2, -1))
    taken = np.arange(_MOST_ROOTS) < count[..., None]
    alpha = np.full((*taken.shape, 4), np.nan)
    R = np.full(taken.shape, np.nan)
    sheet = np.zeros(taken.shape, np.int8)
    alpha[taken] = points
    R[taken] = level_determinant(points, coefficients)
    sheet[taken] = on_sheet
    on_red = np.stack(
        np.broadcast_arrays(
            *types_of("red", first, second, coefficients, crossing_tolerance)
        ),
        axis=-1,
    )
    return RootArrays(
        count=count,
        alpha=alpha,
        sheet=sheet,
        types=on_red[..., None, :] * sheet[..., None],
        R=R,
    )


def _curved_root_arrays(
    first: FloatArray, second: FloatArray, coefficients: Coefficients
) -> RootArrays:
    """Return the two roots of vehicles that no half turn maps to themselves: the invertible one is red, none is blue."""
    found = np.stack(curved_roots(first, second, coefficients), axis=-2)
    shape = found.shape[:-2]
    alpha = np.full((*shape, _MOST_ROOTS, 4), np.nan)
    alpha[..., :2, :] = found
    R = np.full((*shape, _MOST_ROOTS), np.nan)
    R[..., :2] = level_determinant(found, coefficients)
    sheet = np.zeros((*shape, _MOST_ROOTS), dtype=np.int8)
    sheet[..., 0] = _CODES["red"]
    return RootArrays(
        count=np.full(shape, 2),
        alpha=alpha,
        sheet=sheet,
        types=np.zeros((*shape, _MOST_ROOTS, 2), dtype=np.int8),
        R=R,
    )


def color_codes(colors: Sequence[str]) -> CodeArray:
    """Return colors as +1 red and −1 blue, shape (n,)."""
    return np.array([_CODES[color] for color in colors], dtype=np.int8)


def color_of(code: int) -> Color:
    """Return the color of +1 or −1."""
    return COLORS[0] if code > 0 else COLORS[1]


def sheet_forms(alpha: FloatArray, coefficients: Coefficients) -> FloatArray:
    """Return how far α3 and α4 of points, shape (..., 4) [rad], are above red and blue, mod π, shape (2, 2, ...)."""
    angles = np.ascontiguousarray(alpha.T)  # long rows are faster
    first, opposite = angles[:2], angles[2:]
    line = np.array(coefficients.crossings).reshape(2, *[1] * (alpha.ndim - 1))
    return np.array([opposite - first, first + opposite - 2 * line])


def sheet_distances(
    alpha: npt.ArrayLike,
    coefficients: CoefficientsLike | None = None,
    *,
    vehicle: VehicleLike = PAPER,
) -> FloatArray:
    """Return how far points are from the red and the blue sheet, mod π, shape (..., 2) [rad].

    The larger difference of α3 and α4 counts. The coefficients are by default the vehicle's.
    """
    forms = sheet_forms(tilt_angles(alpha), coefficients_of(vehicle, coefficients))
    return np.asarray(distance_to_multiple(forms, math.pi).max(axis=1).T)


def colors_along(
    alpha: npt.ArrayLike, coefficients: Coefficients, tolerance: float
) -> CodeArray:
    """Return the color of each of consecutive points of shape (n, 4) [rad], shape (n,).

    A point may be `tolerance` [rad] from a sheet, mod π. A point on both sheets takes the color of the point before, at
    the start that of the first point that is on one sheet only, else red.
    """
    if coefficients.rotors.asymmetry is not None:  # it has no planes
        return np.zeros(len(np.atleast_2d(alpha)), dtype=np.int8)
    near = sheet_distances(alpha, coefficients) <= tolerance
    both = near.all(axis=1)
    out = np.where(near[:, 0], 1, np.where(near[:, 1], -1, 0)).astype(np.int8)
    if both.any():
        alone = out[~both]
        start = alone[0] if alone[:1].any() else 1
        known = np.concatenate([[start], out])
        is_known = np.concatenate([[True], ~both])
        latest = np.maximum.accumulate(np.where(is_known, np.arange(len(known)), 0))[1:]
        # A point behind one on neither sheet is red.
        out[both] = np.where(known[latest] == 0, 1, known[latest])[both]
    return out


def types_at(
    alpha: npt.ArrayLike,
    codes: npt.ArrayLike,
    coefficients: Coefficients,
    crossing_tolerance: float,
) -> tuple[CodeArray, CodeArray]:
    """Return the plane types of α3 and α4 at points of given colors, +1, 0 (`?`) or −1, shape (n,); 0 without color."""
    alpha, codes = np.asarray(alpha, dtype=float), np.asarray(codes, dtype=np.int8)
    third, fourth = types_of(
        "red", alpha[..., 0], alpha[..., 1], coefficients, crossing_tolerance
    )
    return third * codes, fourth * codes


def types_contradict(
    types: npt.ArrayLike, codes: npt.ArrayLike
) -> npt.NDArray[np.bool_]:
    """Return whether stated types (n, 2) contradict the colors of points, codes (n,): + is not on blue, − not on red."""
    stated = np.asarray(types) * np.asarray(codes)[:, None]
    return np.asarray((stated < 0).any(axis=1))


def sheet_jumps(
    starts: FloatArray,
    ends: FloatArray,
    codes: CodeArray,
    after: CodeArray,
    coefficients: Coefficients,
) -> FloatArray:
    """Return by how much segments leave the sheets of their ends, shape (m,) [rad]; 0 where that is below 1e-9.

    A sheet is a plane, so a segment that starts on it is farthest off at its end: by π where an angle wraps. Between the
    two sheets the smaller distance counts.
    """
    at_start, at_end = (sheet_forms(x, coefficients) for x in (starts, ends))
    # The distance from a sheet changes linearly along the segment; whole wraps show at its other end.
    there = np.abs(wrapped(at_start) + at_end - at_start).max(axis=1)
    back = np.abs(wrapped(at_end) + at_start - at_end).max(axis=1)
    out = of_color(there, codes)
    out = np.where(codes == after, out, np.minimum(out, of_color(back, after)))
    return np.where(out > SAME_ANGLE, out, 0.0)


def of_color(values: FloatArray, codes: CodeArray) -> FloatArray:
    """Return the values of each point's color, given for red and blue, shape (2, n); infinity without color."""
    of_sheet = np.where(codes > 0, values[0], values[1])
    return np.where(codes == 0, math.inf, of_sheet)


def text_from_types(third: int, fourth: int) -> str:
    """Return the ASCII label, such as ``(+,?)``, of plane types given as +1, 0 or −1."""
    return f"({_TYPE_MARKS[int(third)]},{_TYPE_MARKS[int(fourth)]})"


def types_from_text(label: str) -> tuple[int, int]:
    """Return a label such as ``(+,?)`` as +1, 0 or −1 for α3 and for α4.

    InputError unless it is one of the seven categories.

    >>> types_from_text("(?,-)")
    (0, -1)
    """
    match = _TYPES_TEXT.fullmatch(label.strip()) if isinstance(label, str) else None
    codes = (_TYPE_CODES[match[1]], _TYPE_CODES[match[2]]) if match else (1, -1)
    if codes[0] * codes[1] < 0:
        raise wrong("types", f"must be one of {', '.join(PLANE_TYPES)}", label)
    return codes


def neighbors_allowed(
    first: tuple[npt.ArrayLike, npt.ArrayLike],
    second: tuple[npt.ArrayLike, npt.ArrayLike],
) -> Any:
    """Return whether types, given as +1, 0 or −1 for α3 and for α4, may be adjacent; arrays broadcast."""
    # Neither angle may have the types + and −.
    return (np.multiply(first[0], second[0]) != -1) & (
        np.multiply(first[1], second[1]) != -1
    )


def types_may_be_adjacent(first: str, second: str) -> bool:
    """Return whether Figure 15 joins two types by a line.

    >>> types_may_be_adjacent("(+,+)", "(+,?)"), types_may_be_adjacent("(+,+)", "(-,-)")
    (True, False)
    >>> all(types_may_be_adjacent("(?,?)", other) for other in PLANE_TYPES)
    True
    """
    return bool(neighbors_allowed(types_from_text(first), types_from_text(second)))
