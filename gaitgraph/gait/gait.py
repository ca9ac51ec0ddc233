"""A gait: a loop of (α1, α2) lifted to the four-dimensional surfaces, as a closed polyline.

Between its corners a gait is straight in all four angles, and the sheets are planes: a segment between two
points of one sheet lies on that sheet.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from gaitgraph import later
from gaitgraph.angles import (
    angles_from,
    checked_number,
    is_list,
    text_from_angle,
    whole_number,
)
from gaitgraph.arrays import read_only, read_only_mapping
from gaitgraph.errors import check_kind, wrong
from gaitgraph.invertibility.coefficients import (
    Coefficients,
    CoefficientsLike,
    coefficients_of,
)
from gaitgraph.invertibility.forms import FloatArray
from gaitgraph.invertibility.matrices import level_determinant
from gaitgraph.pictured import Pictured
from gaitgraph.surface.curved import sheet_of
from gaitgraph.surface.sheets import (
    COLORS,
    checked_plane_angles,
    color_codes,
    sheet_angles,
    text_from_types,
    types_at,
)
from gaitgraph.texts import table_lines
from gaitgraph.tolerances import (
    DEFAULT_CROSSING_TOLERANCE,
    DEFAULT_FLOOR,
    DEFAULT_TOLERANCE,
    SAME_ANGLE,
)
from gaitgraph.vehicle import PAPER, Vehicle, VehicleLike, vehicle_named


@dataclass(frozen=True, slots=True, kw_only=True, repr=False, init=False, eq=False)
class Gait(Pictured):
    """A closed polyline of tilt angles, with a color for each corner and a direction; :meth:`check` validates it.

    Parameters
    ----------
    alpha
        Corners (α1, α2, α3, α4), shape (n, 4), n ≥ 1 [rad]; the segment from the last to the first is implied.
        Copied and read-only.
    colors
        The sheet of each corner, "red" or "blue"; empty for a gait that is off the surfaces (a biased one).
    vehicle, coefficients
        The vehicle that flies the gait, and the coefficients of the surfaces it lies on; by default the vehicle's.
    crossing_tolerance
        Distance from a crossing line within which a plane type is `?` [rad].
    request
        The request of the plan that found the gait, as plain values, which its files then state. Empty if it was not
        planned, or made from another gait.

    Raises
    ------
    InputError
        If a shape, an angle or a color is wrong.

    Examples
    --------
    >>> gait = lift([(1.178, -1.178), (1.178, -0.393), (0.393, -0.393), (0.393, -1.178)], "blue")
    >>> gait.alpha[1].round(3).tolist(), round(gait.length, 2)
    ([1.178, -0.393, -0.844, 0.059], 3.14)
    >>> print(lift([(0.4, -1.2), (0.4, -0.4), (1.2, -0.4)], "red"))
    Gait, red: 3 corners, 2.7314 rad around, R -5.39 to -4.98 at its corners
    vehicle paper (κ = 0.1687), published coefficients
    <BLANKLINE>
      corner      α1        α2        α3        α4     types
         1      0.4000   -1.2000    0.4000   -1.2000     (+,+)
         2      0.4000   -0.4000    0.4000   -0.4000     (+,+)
         3      1.2000   -0.4000    1.2000   -0.4000     (+,+)
    """

    alpha: FloatArray
    colors: tuple[str, ...]
    vehicle: Vehicle
    coefficients: Coefficients
    crossing_tolerance: float
    request: Mapping[str, Any]

    def __init__(
        self,
        *,
        alpha: npt.ArrayLike,
        colors: Sequence[str] = (),
        vehicle: VehicleLike = PAPER,
        coefficients: CoefficientsLike | None = None,
        crossing_tolerance: float = DEFAULT_CROSSING_TOLERANCE,
        request: Mapping[str, Any] | None = None,
    ) -> None:
        corners = np.array(angles_from(alpha, "alpha"))
        check_kind("colors", colors, list, tuple)
        names = tuple(colors)
        if corners.ndim != 2 or corners.shape[1] != 4 or not len(corners):
            raise wrong(
                "alpha", "must have the shape (n, 4) with n at least 1", corners.shape
            )
        if names and len(names) != len(corners):
            raise wrong(
                "colors",
                f"must be one for each of the {len(corners)} corners",
                len(names),
            )
        if not all(color in COLORS for color in names):
            raise wrong("colors", f"must be {', '.join(map(repr, COLORS))}", names)
        reach = checked_number(
            "crossing_tolerance", crossing_tolerance, "a finite number ≥ 0 (rad)"
        )
        request = request or {}
        check_kind("request", request, Mapping)
        body = vehicle_named(vehicle)
        checked = (
            read_only(corners),
            names,
            body,
            coefficients_of(body, coefficients),
            reach,
            read_only_mapping(dict(request)),
        )
        for name, value in zip(self.__slots__, checked, strict=True):
            object.__setattr__(self, name, value)  # the record is frozen

    @property
    def ends(self) -> FloatArray:
        """The end of the segment that starts at each corner, shape (n, 4) [rad]."""
        return read_only(np.concatenate([self.alpha[1:], self.alpha[:1]]))

    @property
    def length(self) -> float:
        """Length of the loop in the (α1, α2) plane [rad]."""
        step = (self.ends - self.alpha)[:, :2]
        return float(np.sqrt((step**2).sum(axis=1)).sum())

    @property
    def color(self) -> str | None:
        """The one color of all corners, "mixed", or None off the surfaces."""
        if not self.colors:
            return None
        if len(set(self.colors)) > 1:
            return "mixed"
        return self.colors[0]

    @property
    def types(self) -> tuple[str, ...]:
        """The plane types of each corner; empty off the surfaces, and for vehicles whose sheet is curved."""
        if self.coefficients.rotors.asymmetry is not None:
            return ()
        codes = color_codes(self.colors)
        third, fourth = types_at(
            self.alpha[: len(codes)], codes, self.coefficients, self.crossing_tolerance
        )
        return tuple(map(text_from_types, third, fourth))

    @property
    def R(self) -> FloatArray:
        """Equation (6) at each corner, with the gait's own coefficients, shape (n,)."""
        return read_only(level_determinant(self.alpha, self.coefficients))

    def merged(self) -> Gait:
        """Return the gait without corners on straight runs; the first point stays, corner or not.

        A corner stays if the direction turns there (an out-and-back turn too), or the color changes.
        """
        if len(self.alpha) == 1:
            return self
        colors = np.array(self.colors or [""] * len(self.alpha))
        changed = colors != np.roll(colors, 1)
        changes = np.roll(changed, -1)
        ahead = self.ends - self.alpha
        # First drop points that repeat the one before, of which the direction is not known.
        kept = ahead.any(axis=1) | changes
        if not kept.all():
            kept[0] |= not kept.any()
            return self._reordered(np.flatnonzero(kept)).merged()
        size = np.linalg.norm(ahead, axis=1, keepdims=True)
        unit = ahead / np.maximum(size, 1e-300)
        turn = np.linalg.norm(unit - np.roll(unit, 1, axis=0), axis=1)
        corner = (turn > SAME_ANGLE) | changes | changed
        corner[0] = True
        return self._reordered(np.flatnonzero(corner))

    def reversed(self) -> Gait:
        """Return the gait run the other way from the same start."""
        return self._reordered(-np.arange(len(self.alpha)))

    def started_at(self, corner: int) -> Gait:
        """Return the same loop started at another of its corners (0 ≤ corner < n)."""
        start = whole_number("corner", corner, 0, len(self.alpha) - 1)
        return self._reordered(np.roll(np.arange(len(self.alpha)), -start))

    def _reordered(self, order: npt.NDArray[np.int64]) -> Gait:
        colors = self.colors
        if colors:
            colors = tuple(np.array(colors)[order].tolist())
        return replace(self, alpha=self.alpha[order], colors=colors, request={})

    def biased(self, bias: float) -> Gait:
        """Return the gait with α3 and α4 scaled by η in (0, 1], equations (12) to (15); it leaves the surfaces."""
        bias = checked_factor("bias", bias)
        alpha = self.alpha * np.array([1, 1, bias, bias])
        colors = self.colors if bias == 1 else ()
        return replace(self, alpha=alpha, colors=colors, request={})

    def vertices(self, tolerance: float = 1e-9) -> FloatArray:
        """Return the corners of the loop, in order, shape (k, 4) [rad]; see :func:`vertices`."""
        return vertices(self.merged().alpha, tolerance)

    def parametrize(
        self,
        period: float = 1.0,
        *,
        law: later.LawName = "smooth",
        samples: int | None = None,
        rate: float | None = None,
    ) -> later.TimedGait:
        """Return the gait with a timing law over a period.

        Parameters
        ----------
        period
            T [s].
        law
            One of :data:`gaitgraph.timing.laws.LAWS`.
        samples
            Even intervals per period, 1 to 10 million; 100 if neither this nor `rate` is given.
        rate
            Samples per second [Hz], instead of `samples`; the count is rounded up, so that the table closes.

        Notes
        -----
        Samples lie on the gait, but may miss its corners.
        """
        count = later.checked_clock(period, law, samples=samples, rate=rate)
        return later.gait_with_law(self, float(period), law, count)

    def check(
        self,
        *,
        tolerance: float = DEFAULT_TOLERANCE,
        floor: float = DEFAULT_FLOOR,
        angle_rounding: float | None = None,
    ) -> later.Report:
        """Return every check of valid and flyable; see :func:`gaitgraph.validation.validating.check_gait`."""
        return later.check_gait(
            self, tolerance=tolerance, floor=floor, angle_rounding=angle_rounding
        )

    def __repr__(self) -> str:
        return f"<Gait: {self.sheet_in_words}, {self.size_text}, vehicle {self.vehicle.name!r}>"

    def __str__(self) -> str:
        """Return a title, and the first corners as a table.

        >>> lines = str(lift([(0.1 * k, -0.4) for k in range(13)], "red")).splitlines()
        >>> lines[-1]
        '  … and 1 more'
        >>> str(lift([(0.4, -0.4), (0.8, -0.4)], "red")).splitlines()[0]
        'Gait, red: 2 corners, 0.8000 rad around, R -6.85 to -4.98 at its corners'
        """
        signs = f"R {self.R.min():.3g}"
        if len(self.alpha) > 1:
            signs += f" to {self.R.max():.3g} at its corners"
        title = f"Gait, {self.sheet_in_words}: {self.size_text}, {signs}"
        setting = setting_line(self.vehicle, self.coefficients.kind)
        return "\n".join([title, setting, "", *corner_lines(self)])

    @property
    def sheet_in_words(self) -> str:
        """Its color, or why it has none."""
        if self.vehicle.asymmetry is not None:
            return "without planes"
        return self.color or "off the surfaces"

    @property
    def size_text(self) -> str:
        """The number of corners and the length."""
        count = f"{len(self.alpha)} corners"
        if len(self.alpha) == 1:
            count = "1 corner"
        return f"{count}, {self.length:.4f} rad around"


def lift(
    points: npt.ArrayLike,
    colors: str | Sequence[str],
    *,
    vehicle: VehicleLike = PAPER,
    coefficients: CoefficientsLike | None = None,
    crossing_tolerance: float = DEFAULT_CROSSING_TOLERANCE,
) -> Gait:
    """Return the gait above a loop of (α1, α2): each point is raised to the sheet of its color.

    On a curved sheet, of a vehicle that is not symmetric, the color is "red", and there are rows between the points.

    Parameters
    ----------
    points
        The loop, shape (n, 2), numbers [rad] or texts such as "pi/8"; closed by itself.
    colors
        "red" or "blue" for all, or one for each point.
    vehicle, coefficients, crossing_tolerance
        As for :class:`Gait`.

    Raises
    ------
    InputError
        If a point is not finite or outside [−π/2, π/2]², or a color is unknown.
    """
    plane = angles_from(points, "points")
    if plane.ndim != 2 or plane.shape[1] != 2 or not len(plane):
        raise wrong(
            "points", "must have the shape (n, 2) with n at least 1", plane.shape
        )
    names: tuple[Any, ...] = (colors,) * len(plane)
    if is_list(colors):
        names = tuple(colors)
    if len(names) != len(plane) or not all(
        isinstance(name, str) and name in COLORS for name in names
    ):
        allowed = f"'red' or 'blue', one for all or for each of the {len(plane)} points"
        raise wrong("colors", f"must be {allowed}", colors)
    numbers = coefficients_of(vehicle, coefficients)
    if numbers.rotors.asymmetry is not None:
        _check_red(names)
        closed = np.vstack([plane, plane[:1]])
        rows = sheet_of(numbers.rotors).rows(closed).alpha[:-1]
        return Gait(alpha=rows, vehicle=vehicle, coefficients=numbers)
    alpha = points_on_sheets(plane[:, 0], plane[:, 1], names, numbers)
    return Gait(
        alpha=alpha,
        colors=names,
        vehicle=vehicle,
        coefficients=numbers,
        crossing_tolerance=crossing_tolerance,
    )


def gait_through(corners: FloatArray, like: Gait) -> Gait:
    """Return the gait through some corners, with the vehicle, the coefficients and the first color of another."""
    colors = like.colors[:1] * len(corners)
    return replace(like, alpha=corners, colors=colors, request={})


def there_and_back(line: FloatArray, like: Gait) -> Gait:
    """Return the gait along a line and back, with the vehicle, the coefficients and the first color of another."""
    return gait_through(np.vstack([line, line[-2:0:-1]]), like)


def setting_line(vehicle: Vehicle, kind: str | None) -> str:
    """Return a vehicle and the kind of its coefficients in one line."""
    return f"vehicle {vehicle.name} (κ = {vehicle.drag_ratio:.4f}), {kind} coefficients"


def corner_lines(gait: Gait) -> list[str]:
    """Return the first corners of a gait as lines of a table."""
    types = gait.types
    rows = [["corner", "α1", "α2", "α3", "α4"]]
    if types:
        rows[0].append("types")
    for number, angles in enumerate(gait.alpha[:_MOST_LISTED].tolist()):
        row = [str(number + 1), *map(text_from_angle, angles)]
        if types:
            row.append(types[number])
        rows.append(row)
    lines = table_lines(rows, right=range(5))
    more = len(gait.alpha) - _MOST_LISTED
    if more > 0:
        lines.append(f"  … and {more} more")
    return lines


def _check_red(colors: Sequence[str]) -> None:
    """Raise InputError unless all colors are red, the only ones of a curved sheet."""
    if set(colors) != {"red"}:
        raise wrong(
            "colors", "must be red for a vehicle that is not symmetric", list(colors)
        )


def points_on_sheets(
    alpha1: npt.ArrayLike,
    alpha2: npt.ArrayLike,
    colors: Sequence[str],
    coefficients: Coefficients,
) -> FloatArray:
    """Return the points of the sheets above (α1, α2), each on that of its color, shape (n, 4) [rad]."""
    a1, a2 = checked_plane_angles(alpha1, alpha2)
    if coefficients.rotors.asymmetry is not None:
        _check_red(colors)
        opposite = sheet_of(coefficients.rotors).angles(a1, a2)
        continuous = np.unwrap(opposite, axis=0, period=math.pi)
        return np.column_stack([a1, a2, continuous])
    # Within ±π/2 red has α3 = α1 and α4 = α2; adding zero turns negative zeros into zeros.
    alpha = np.column_stack([a1, a2, a1 + 0.0, a2 + 0.0])
    is_blue = np.array(colors) == "blue"
    blue = sheet_angles("blue", a1[is_blue], a2[is_blue], coefficients)
    alpha[is_blue, 2:] = np.column_stack(blue)
    return alpha


def checked_factor(name: str, factor: object) -> float:
    """Return a factor η by which tilt angles are scaled; raise InputError with its name if it is not in (0, 1]."""
    return checked_number(name, factor, "a number in (0, 1]", above=True, most=1.0)


def checked_factors(name: str, value: float | Iterable[float]) -> list[float]:
    """Return one factor η or several as a list; raise InputError with its name if one is not in (0, 1]."""
    several = (
        isinstance(value, Iterable)
        and not isinstance(value, (str, bytes))
        and getattr(value, "ndim", 1) == 1
    )
    factors: list[Any] = list(value) if several else [value]  # type: ignore[arg-type]
    return [checked_factor(name, factor) for factor in factors]


def vertices(alpha: npt.ArrayLike, tolerance: float = 1e-9) -> FloatArray:
    """Return the vertices of a closed loop through rows of tilt angles, shape (n, 4) [rad]: its corners, in order.

    A row is a corner if it is farther than the tolerance [rad] from the straight line between its neighbours. The rows
    of a curve are all corners, unless the tolerance exceeds the bend between rows. A point has one vertex, an
    out-and-back loop two. The paper's equations (16) to (19) take the extremes of each angle; for its rectangles the
    result is the same.

    >>> vertices([[0, 0, 0, 0], [1, 0, 1, 0], [1, 0.5, 1, 0.5], [1, 1, 1, 1]]).tolist()
    [[0.0, 0.0, 0.0, 0.0], [1.0, 0.0, 1.0, 0.0], [1.0, 1.0, 1.0, 1.0]]
    """
    points = Gait(alpha=alpha).alpha
    tolerance = checked_number("tolerance", tolerance, "a number ≥ 0 (rad)")
    moves = np.abs(np.roll(points, -1, axis=0) - points).max(axis=1) > tolerance
    moves[0] |= not moves.any()
    points = points[moves]
    before = np.roll(points, 1, axis=0)
    chord = np.roll(points, -1, axis=0) - before
    size = np.maximum((chord**2).sum(axis=1), 1e-300)
    share = np.clip(((points - before) * chord).sum(axis=1) / size, 0, 1)
    off = np.linalg.norm(points - before - share[:, None] * chord, axis=1)
    return np.asarray(points[(off > tolerance) | (len(points) == 1)])


_MOST_LISTED = 12  # corners
_AROUND_3 = ((6, -6), (6, -2), (2, -2), (2, -6))
# By number: the color, and the corners (α1, α2) in multiples of π/16.
_LOOPS = {
    1: ("blue", ((5, 2), (5, 6), (1, 6), (1, 2))),
    2: ("blue", _AROUND_3),
    3: ("red", _AROUND_3),
    4: ("red", ((-2, 2), (-2, 6), (-6, 6), (-6, 2))),
}

PAPER_GAITS = {f"gait{number}": number for number in _LOOPS}
"""Names of the paper's gaits, accepted instead of a file, and their numbers."""


def paper_gait(number: int, vehicle: Vehicle, coefficients: Coefficients) -> Gait:
    """Return Gait 1 to 4 for a vehicle; for the other rotor spin the loop is mirrored in the origin.

    >>> for number in (1, 2, 4):
    ...     loop = paper_gait(number, PAPER, coefficients_of(PAPER)).alpha[:, :2]
    ...     print(*[f"({text_from_angle(x)}, {text_from_angle(y)})" for x, y in loop])
    (5π/16, π/8) (5π/16, 3π/8) (π/16, 3π/8) (π/16, π/8)
    (3π/8, -3π/8) (3π/8, -π/8) (π/8, -π/8) (π/8, -3π/8)
    (-π/8, π/8) (-π/8, 3π/8) (-3π/8, 3π/8) (-3π/8, π/8)
    """
    color, points = _LOOPS[number]
    side = 1 if vehicle.signed_drag_ratio > 0 else -1
    return lift(
        side * np.array(points) * (math.pi / 16),
        color,
        vehicle=vehicle,
        coefficients=coefficients,
    )


def name_of(gait: Gait) -> str:
    """Return the name of a gait in pictures: "Gait 3", "Gait 3 biased by 0.8", or else its color.

    >>> third = paper_gait(3, PAPER, coefficients_of(PAPER))
    >>> name_of(third), name_of(third.biased(0.8)), name_of(lift([(0.4, -0.4)], "red"))
    ('Gait 3', 'Gait 3 biased by 0.8', 'Red gait')
    """
    if gait.vehicle.asymmetry is not None:
        return "Gait on a curved sheet"
    rows = gait.alpha
    if len(rows) > 4:
        rows = gait.vertices(1e-6)
    rows = _sorted(rows)
    for number in _LOOPS:
        known = _sorted(paper_gait(number, gait.vehicle, gait.coefficients).alpha)
        eta = 0.0
        if rows.shape == known.shape:
            eta = (rows * known)[:, 2:].sum() / (known[:, 2:] ** 2).sum()
        if eta > 0 and np.allclose(rows, known * [1, 1, eta, eta], atol=2e-3):
            if eta < 0.998:
                return f"Gait {number} biased by {eta:.3g}"
            return f"Gait {number}"
    if gait.color is None:
        return "Gait on neither sheet"
    return f"{gait.color.capitalize()} gait"


def _sorted(rows: FloatArray) -> FloatArray:
    """Return rows by their α1, then α2, to three decimals."""
    return rows[np.lexsort(rows[:, 1::-1].round(3).T)]


def printed_gait(number: int, coefficients: Coefficients) -> Gait:
    """Return a gait through the vertices as the paper prints them, three decimals for α3 and α4: off the surfaces."""
    alpha = np.array(paper_gait(number, PAPER, coefficients_of(PAPER)).alpha)
    return Gait(
        alpha=np.column_stack([alpha[:, :2], alpha[:, 2:].round(3)]),
        coefficients=coefficients,
    )
