"""A gait: a loop of (α1, α2) lifted to the four-dimensional surfaces, as a closed polyline.

Between its corners a gait is straight in all four angles, and the sheets are planes: a segment between two
points of one sheet lies on that sheet.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import number_of, text_from_angle
from gaitgraph.errors import InputError, shown
from gaitgraph.invertibility.matrices import Coefficients, coefficients_of, level_determinant
from gaitgraph.surface.adjacency import text_from_types
from gaitgraph.surface.sheets import (
    COLORS,
    DEFAULT_CROSSING_TOLERANCE,
    FAMILIES,
    FIBERS,
    checked_plane_angles,
    family_codes,
    family_distances,
    family_types,
    sheet_angles,
)
from gaitgraph.vehicle import PAPER, Vehicle

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gaitgraph.timing.timed_gait import TimedGait
    from gaitgraph.validation.report import Report

__all__ = ["Gait", "color_of_all", "lift", "vertices"]

FloatArray = npt.NDArray[np.float64]

_STRAIGHT = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class Gait:
    """A closed polyline of tilt angles with the color of each corner and a direction.

    Parameters
    ----------
    alpha
        Corners (α1, α2, α3, α4), shape (n, 4), n ≥ 1 [rad]; the way back from the last to the first is implied.
        Copied and read-only.
    colors
        The sheet of each corner, "red" or "blue", or the fibre, "fiber1" or "fiber2"; empty for a gait that is off the
        surfaces (a biased one).
    vehicle, coefficients
        What the gait is for, and the coefficients of the surfaces it lies on.
    crossing_tolerance
        Distance from a crossing line within which a plane type is `?` [rad].
    request
        The request that the gait was planned for, as plain values, so that its files tell it; empty if it was not
        planned. A gait that is made from another has none.

    Notes
    -----
    Nothing about a gait is guaranteed by its existence: :meth:`check` says what holds.

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
    colors: tuple[str, ...] = ()
    vehicle: Vehicle = PAPER
    coefficients: Coefficients = field(default_factory=coefficients_of)
    crossing_tolerance: float = DEFAULT_CROSSING_TOLERANCE
    request: Mapping[str, Any] = field(default_factory=dict, compare=False, repr=False)

    def __post_init__(self) -> None:
        alpha = np.array(self.alpha, dtype=float)
        if alpha.ndim != 2 or alpha.shape[1] != 4 or not len(alpha):
            raise InputError(f"alpha: an array of shape {alpha.shape}; allowed is (n, 4) with n at least 1")
        if not np.isfinite(alpha).all():
            raise InputError(f"alpha: {alpha[~np.isfinite(alpha)][0]!r}; allowed are finite angles in radians")
        if self.colors and len(self.colors) != len(alpha):
            raise InputError(f"colors: {len(self.colors)} for {len(alpha)} corners; allowed is one for each")
        for color in self.colors:
            if color not in FAMILIES:
                raise InputError(f"colors: {shown(color)}; allowed are {', '.join(map(repr, FAMILIES))}")
        alpha.flags.writeable = False
        object.__setattr__(self, "alpha", alpha)
        object.__setattr__(self, "colors", tuple(self.colors))

    @property
    def ends(self) -> FloatArray:
        """The end of the segment that starts at each corner, shape (n, 4) [rad]."""
        return np.roll(self.alpha, -1, axis=0)

    @property
    def length(self) -> float:
        """Length of the loop in the (α1, α2) plane [rad]."""
        return float(np.linalg.norm((self.ends - self.alpha)[:, :2], axis=1).sum())

    @property
    def color(self) -> str | None:
        """The one color of all corners, "mixed", or None off the surfaces."""
        return color_of_all(self.colors)

    @property
    def types(self) -> tuple[str, ...]:
        """The plane types of each corner; empty off the surfaces."""
        codes = family_codes(self.colors)
        pairs = family_types(self.alpha[: len(codes)], codes, self.coefficients, self.crossing_tolerance)
        return tuple(text_from_types(*pair) for pair in zip(*pairs, strict=True))

    @property
    def R(self) -> FloatArray:
        """Equation (6) at each corner, with the gait's own coefficients, shape (n,)."""
        return np.asarray(level_determinant(self.alpha, self.coefficients))

    def merged(self) -> Gait:
        """Return the gait with straight runs merged; the first point stays, corner or not.

        A corner stays if the direction turns there (an out-and-back turn too), or the color changes. Where a fibre
        only crosses the red sheet, the point gets the color of the fibre.
        """
        if len(self.alpha) == 1:
            return self
        keep = np.linalg.norm(self.ends - self.alpha, axis=1) > 0
        colors = np.array(self._painted_across()) if self.colors else np.zeros(len(self.alpha), dtype=int)
        keep |= np.roll(colors, -1) != colors
        keep[0] |= not keep.any()
        points, colors = self.alpha[keep], colors[keep]
        step = np.roll(points, -1, axis=0) - points
        size = np.linalg.norm(step, axis=1, keepdims=True)
        unit = step / np.where(size > 0, size, 1.0)
        turned = np.linalg.norm(unit - np.roll(unit, 1, axis=0), axis=1) > _STRAIGHT
        painted = (colors != np.roll(colors, 1)) | (colors != np.roll(colors, -1))
        corner = turned | painted
        corner[0] = True
        kept = tuple(map(str, colors[corner])) if self.colors else ()
        return replace(self, alpha=points[corner], colors=kept, request={})

    def _painted_across(self) -> tuple[str, ...]:
        """Return the colors, with that of a fibre where a point is on it as those before and after are."""
        if not set(self.colors) & set(FIBERS):
            return self.colors
        on = (family_distances(self.alpha, self.coefficients) <= _STRAIGHT).tolist()
        colors = self.colors
        out = list(colors)
        for k, color in enumerate(colors):
            before, after = colors[k - 1], colors[(k + 1) % len(colors)]
            if color in COLORS and before == after and before in FIBERS and on[k][FAMILIES.index(before)]:
                out[k] = before
        return tuple(out)

    def reversed(self) -> Gait:
        """Return the gait run the other way from the same start.

        >>> gait = lift([(0.4, -0.4), (0.8, -0.4), (0.8, -0.8)], "red")
        >>> np.array_equal(gait.reversed().reversed().alpha, gait.alpha)
        True
        """
        order = [0, *range(len(self.alpha) - 1, 0, -1)]
        return self._reordered(order)

    def started_at(self, corner: int) -> Gait:
        """Return the same loop started at another of its corners (0 ≤ corner < n)."""
        n = len(self.alpha)
        if isinstance(corner, bool) or not isinstance(corner, (int, np.integer)) or not 0 <= corner < n:
            raise InputError(f"corner: {corner!r}; allowed is 0 to {n - 1}")
        return self._reordered([(corner + k) % n for k in range(n)])

    def _reordered(self, order: list[int]) -> Gait:
        colors = tuple(self.colors[k] for k in order) if self.colors else ()
        return replace(self, alpha=self.alpha[order], colors=colors, request={})

    def biased(self, eta: float) -> Gait:
        """Return the gait with α3 and α4 scaled by η, equations (12) to (15); it leaves the surfaces.

        Parameters
        ----------
        eta
            Scaling coefficient η, in (0, 1].
        """
        return self._scaled(eta, [1.0, 1.0, eta, eta])

    def scaled(self, eta: float) -> Gait:
        """Return the gait with all four angles scaled by η, in (0, 1].

        The red sheet is a plane through the origin: a red gait stays on it. A blue one leaves its sheet.
        """
        gait = self._scaled(eta, [eta] * 4)
        return replace(gait, colors=self.colors) if self.color == "red" else gait

    def _scaled(self, eta: float, factors: list[float]) -> Gait:
        if not 0 < number_of(eta) <= 1:
            raise InputError(f"eta: {shown(eta)}; allowed is a number in (0, 1]")
        colors = self.colors if eta == 1 else ()
        return replace(self, alpha=self.alpha * np.array(factors, dtype=float), colors=colors, request={})

    def vertices(self, tolerance: float = 1e-9) -> FloatArray:
        """Return the vertices by equations (16) to (19), shape (k, 4) [rad]; see :func:`vertices`.

        A polyline takes its least and largest angles at corners, so corners suffice.
        """
        return vertices(self.alpha, tolerance)

    def parametrize(
        self,
        period: float = 1.0,
        *,
        law: str = "smooth",
        samples: int | None = None,
        rate: float | None = None,
    ) -> TimedGait:
        """Return the gait with a clock; see :func:`gaitgraph.timing.timed_gait.parametrize`."""
        from gaitgraph.timing.timed_gait import parametrize

        return parametrize(self, period, law=law, samples=samples, rate=rate)

    def check(self, **limits: Any) -> Report:
        """Return every check of valid and flyable; see :func:`gaitgraph.validation.checks.check_gait`."""
        from gaitgraph.validation.checks import check_gait

        return check_gait(self, **limits)

    def __repr__(self) -> str:
        count = len(self.alpha)
        size = f"{count} corner{'s' * (count > 1)}, {self.length:.4f} rad around"
        return f"<Gait: {self.color or 'off the surfaces'}, {size}, vehicle {self.vehicle.name!r}>"

    def __str__(self) -> str:
        count = len(self.alpha)
        low, high = float(self.R.min()), float(self.R.max())
        signs = f"R {low:.3g} to {high:.3g} at its corners" if count > 1 else f"R {low:.3g}"
        color = self.color or "off the surfaces"
        return "\n".join(
            [
                f"Gait, {color}: {count} corner{'s' * (count > 1)}, {self.length:.4f} rad around, {signs}",
                self.setting_text(),
                "",
                *self.corner_lines(),
            ]
        )

    def setting_text(self) -> str:
        """Return for which vehicle and with which coefficients the gait is, in one line."""
        return f"vehicle {self.vehicle.name} (κ = {self.vehicle.drag_ratio:.4f}), {self.coefficients.kind} coefficients"

    def corner_lines(self, most: int = 12) -> list[str]:
        """Return the first corners as lines of a table for people."""
        corners, types = len(self.alpha), self.types
        lines = ["  corner      α1        α2        α3        α4" + "     types" * bool(types)]
        for k, alpha in enumerate(self.alpha[:most]):
            angles = "".join(f"{text_from_angle(float(angle)):>10}" for angle in alpha)
            lines.append(f"  {k + 1:>4}  {angles}" + (f"     {types[k]}" if types else ""))
        return lines if corners <= most else [*lines, f"     … and {corners - most} more"]

    def _repr_html_(self) -> str:
        from gaitgraph.plots.showing import html_of_gait

        return html_of_gait(self)


def color_of_all(colors: Sequence[str]) -> str | None:
    """Return the one color of a sequence, "mixed" if there are both, None if it is empty."""
    if not colors:
        return None
    return colors[0] if len(set(colors)) == 1 else "mixed"


def lift(
    points: npt.ArrayLike,
    colors: str | Sequence[str],
    *,
    vehicle: Vehicle = PAPER,
    coefficients: Coefficients | None = None,
    crossing_tolerance: float = DEFAULT_CROSSING_TOLERANCE,
) -> Gait:
    """Return the gait above a loop of (α1, α2): each point is raised to the sheet of its color.

    Parameters
    ----------
    points
        The loop, shape (n, 2) [rad]; closed by itself.
    colors
        "red" or "blue" for all, or one for each point.
    vehicle, coefficients
        What the gait is for; by default the paper's vehicle with its published coefficients.

    Raises
    ------
    InputError
        If a point is not finite or outside [−π/2, π/2]², or a color is unknown.
    """
    try:
        plane = np.asarray(points, dtype=float)
    except (TypeError, ValueError) as error:
        raise InputError(f"points: {shown(points)}; allowed are pairs (α1, α2) of numbers [rad]") from error
    if plane.ndim != 2 or plane.shape[1] != 2 or not len(plane):
        raise InputError(f"points: an array of shape {plane.shape}; allowed is (n, 2) with n at least 1")
    coefficients = coefficients or coefficients_of(vehicle)
    checked_plane_angles(plane[:, 0], plane[:, 1])
    if not isinstance(colors, Iterable):
        raise InputError(f"colors: {shown(colors)}; allowed is one for all, or one for each point")
    names = (colors,) * len(plane) if isinstance(colors, str) else tuple(colors)
    if len(names) != len(plane):
        raise InputError(f"colors: {len(names)} for {len(plane)} points; allowed is one for all, or one for each")
    for name in names:
        if isinstance(name, str) and name in FIBERS:
            raise InputError(
                f"colors: {shown(name)}; allowed are 'red' and 'blue' above (α1, α2): a fibre leaves α3 or α4 open"
            )
    return Gait(
        alpha=points_on_sheets(plane[:, 0], plane[:, 1], names, coefficients),
        colors=names,
        vehicle=vehicle,
        coefficients=coefficients,
        crossing_tolerance=crossing_tolerance,
    )


def points_on_sheets(
    alpha1: npt.ArrayLike, alpha2: npt.ArrayLike, colors: Sequence[str], coefficients: Coefficients
) -> FloatArray:
    """Return the points of the sheets above (α1, α2), each on that of its color, shape (n, 4) [rad].

    >>> points_on_sheets([0.4, 0.4], [-0.4, -0.4], ["red", "blue"], coefficients_of()).round(3).tolist()
    [[0.4, -0.4, 0.4, -0.4], [0.4, -0.4, -0.066, 0.066]]
    """
    a1, a2 = checked_plane_angles(alpha1, alpha2)
    is_red = np.array([color == "red" for color in colors])
    sheets = (sheet_angles("red", a1, a2, coefficients), sheet_angles("blue", a1, a2, coefficients))
    return np.column_stack([a1, a2, *(np.where(is_red, red, blue) for red, blue in zip(*sheets, strict=True))])


def vertices(alpha: npt.ArrayLike, tolerance: float = 1e-9) -> FloatArray:
    """Return the vertices of a curve of tilt angles by equations (16) to (19).

    A point is a vertex if each of its four angles is the least or the largest that this angle takes on the
    curve, to within the tolerance. Vertices are returned once each, in the order in which the curve first meets
    them, with the extreme values themselves.

    Parameters
    ----------
    alpha
        Points of the curve, shape (n, 4) [rad].
    tolerance
        How far an angle may be from its extreme [rad]; for a sampled table, what its samples may miss.

    Returns
    -------
    array of shape (k, 4), 0 ≤ k ≤ 16

    Examples
    --------
    >>> vertices([[0, 0, 0, 0], [1, 0, 1, 0], [1, 1, 1, 1], [0, 1, 0, 1]]).shape
    (4, 4)
    """
    points = np.asarray(alpha, dtype=float)
    if points.ndim != 2 or points.shape[1] != 4 or not len(points):
        raise InputError(f"alpha: an array of shape {points.shape}; allowed is (n, 4) with n at least 1")
    if not 0 <= number_of(tolerance) < math.inf:
        raise InputError(f"tolerance: {shown(tolerance)}; allowed is a number ≥ 0 (rad)")
    low, high = points.min(axis=0), points.max(axis=0)
    at_high = points >= high - tolerance
    extreme = (at_high | (points <= low + tolerance)).all(axis=1)
    # Where an angle is near both of its ends (a constant one), the nearer end decides.
    at_high &= np.abs(points - high) <= np.abs(points - low)
    met = dict.fromkeys(map(tuple, at_high[extreme].tolist()))
    return np.array([np.where(row, high, low) for row in met]).reshape(-1, 4)
