r"""Formula (1) of the paper as a table of numbers: exact for a vehicle, or with the paper's four digits.

With outputs (altitude, roll, pitch, yaw) and rotor inputs wᵢ = ωᵢ|ωᵢ|, the determinant of the 4×4 decoupling
matrix is, times a constant, formula (1) of Shen, Ma and Tsuchiya (2022), its misprints corrected. It is linear in the
vertical seen from the body,

    (1) = Rθ·sin θ + Rφ·sin φ·cos θ + R·cos φ·cos θ,

and (−Rθ, Rφ, R) are multilinear forms in the tilt angles, see :mod:`gaitgraph.invertibility.forms`. For the paper's
vehicle, with the four numbers a, b, c, d of its equations (4) to (6),

    Rφ = −sin(α1 − α3)·(a·sin(α2 + α4) + cos(α2 + α4)),
    Rθ = +sin(α2 − α4)·(a·sin(α1 + α3) − cos(α1 + α3)),

and R is a bilinear form in the features (cos αᵢ cos αₖ, sin αᵢ sin αₖ, sin(αᵢ + αₖ)) of the two pairs of opposite arms.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import product
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np
import numpy.typing as npt

from gaitgraph._lazy import cached_property
from gaitgraph.arrays import read_only
from gaitgraph.errors import InputError, checked_choice, wrong
from gaitgraph.invertibility.forms import (
    FloatArray,
    Form,
    Rotors,
    Sines,
    level_of,
    rotors_of,
)
from gaitgraph.records import Record
from gaitgraph.tolerances import ON_PLANE
from gaitgraph.vehicle import PAPER, Vehicle, VehicleLike, vehicle_named

if TYPE_CHECKING:
    from collections.abc import Sequence

Kind = Literal["published", "printed", "exact"]
KINDS: tuple[Kind, ...] = get_args(Kind)

# The factors a of the attitude, and b, c, d of the terms of R with one sine, with two and with three.
_PUBLISHED = (2.880, 5.592, 0.9716, 0.1687)
_HALF_UNITS = (5e-4, 5e-4, 5e-5, 5e-5)
_EPSILON = float(np.finfo(float).eps)


@dataclass(frozen=True)
class Coefficients(Record):
    """The coefficients of formula (1): those of a vehicle's rotors, or the paper's with four digits.

    Parameters
    ----------
    kind
        "exact", "published" (the paper's four digits, as rounded numbers) or "printed" (the same digits as they stand,
        as exact numbers: the sign of R on blue is then what rounding left of zero).
    rotors
        The rotors of the vehicle.
    """

    kind: Kind
    rotors: Rotors

    @property
    def colors(self) -> tuple[Literal["red", "blue"], ...]:
        """The sheets on which Rφ = Rθ = 0: red, and for rotors at the height of the centre of mass blue."""
        return ("red",) if self.is_raised else ("red", "blue")

    @property
    def is_raised(self) -> bool:
        """Whether a rotor is above or below the centre of mass, so that blue is no sheet."""
        return any(z != 0.0 for _, _, z in self.rotors.positions)

    @property
    def as_they_stand(self) -> Coefficients:
        """The same numbers without errors of rounding: printed ones instead of published ones."""
        return replace(self, kind="printed") if self.kind == "published" else self

    @cached_property
    def form(self) -> Form:
        """The form of v = (−Rθ, Rφ, R)."""
        if self.kind == "exact":
            return level_of(self.rotors).direction
        return paper_form(_PUBLISHED)

    # The four numbers of the paper's formulas, for equal arms with rotors at the height of the centre of mass.

    @property
    def attitude(self) -> float:
        """The number of Rφ and Rθ, (1/κ − κ)/2 = cot 2δ; in the paper 2.880."""
        return -float(self.surface_form.table[0, 1, 1, 0, 0])

    @property
    def single(self) -> float:
        """The number of the terms of R with one sine, 1/κ − 2κ; in the paper 5.592."""
        return float(self.form.table[0, 0, 0, 1, 2])

    @property
    def double(self) -> float:
        """The number of the term of R with two sines, 1 − κ²; in the paper 0.9716."""
        return float(self.form.table[0, 0, 1, 1, 2])

    @property
    def triple(self) -> float:
        """The number of the terms of R with three sines, κ; in the paper 0.1687."""
        return float(self.form.table[1, 0, 1, 1, 2])

    @cached_property
    def level_form(self) -> Form:
        """The form of R."""
        if self.kind == "exact":
            return level_of(self.rotors).lift
        return Form(self.form.table[..., 2:])

    @cached_property
    def surface_form(self) -> Form:
        """The form of (−Rθ, Rφ) in axes of which the first is along arm 1, so that turning all arms changes nothing."""
        ahead, aside, _ = self.rotors.positions[0]
        length = math.hypot(ahead, aside)
        table = self.form.table
        along = (ahead * table[..., 0] + aside * table[..., 1]) / length
        across = (ahead * table[..., 1] - aside * table[..., 0]) / length
        return Form(np.stack([along, across], axis=-1))

    @cached_property
    def crossings(self) -> tuple[float, float]:
        """The lines of α1 and of α2 where the planes of α3, and those of α4, cross; (δ, −δ) for equal arms [rad]."""
        check_symmetric(self.rotors)
        if self.kind == "exact":
            return level_of(self.rotors).crossings
        delta = 0.5 * math.atan2(1.0, _PUBLISHED[0])
        return delta, -delta

    @property
    def delta(self) -> float:
        """Crossing angle δ [rad]: the planes of α3 cross at α1 = δ, and for equal arms those of α4 at α2 = −δ."""
        return self.crossings[0]

    @property
    def crossing_error(self) -> float:
        """Assumed error of the crossing lines from the rounding of a [rad]."""
        if self.kind != "published":
            return _EPSILON
        return 0.5 * _HALF_UNITS[0] / (1.0 + _PUBLISHED[0] ** 2) + _EPSILON

    @property
    def sheet_error(self) -> float:
        """Assumed error of α3 and α4 of the blue sheet, 2δ away, from the rounding of a [rad]."""
        return 2.0 * self.crossing_error if self.kind == "published" else 0.0

    @cached_property
    def noise(self) -> FloatArray:
        """Bounds of what floating point alone makes of −Rθ, Rφ and R where they vanish, shape (3,)."""
        return self.form.rounding()

    def sensitivities(self, sines: Sines) -> FloatArray:
        """Return v = (−Rθ, Rφ, R) at points, shape (3, k).

        On the planes of red and blue Rφ = Rθ = 0, which is not left to rounding.
        """
        values = self.form.at(sines)
        values[:2, self.holds_plane(sines.alpha, sines.alpha)] = 0.0
        return values

    def holds_plane(
        self, starts: FloatArray, ends: FloatArray
    ) -> npt.NDArray[np.bool_]:
        """Return whether segments, or points, shape (4, k), lie on the plane of red, or of blue to 1e-14 rad, shape (k,)."""
        if self.rotors.asymmetry is not None:
            return np.zeros(starts.shape[1], dtype=bool)
        held = is_red(starts) & is_red(ends)
        if not self.is_raised:
            lines = 2 * np.array(self.crossings)[:, None]
            first, last = (side[:2] + side[2:] - lines for side in (starts, ends))
            off = np.abs(first - math.pi * np.rint(first / math.pi))
            off = np.maximum(off, np.abs(last - first))
            held |= (off <= ON_PLANE).all(axis=0)
        return np.asarray(held)

    def errors(self, sines: Sines, angle_rounding: npt.ArrayLike = 0.0) -> FloatArray:
        """Return bounds of the errors of −Rθ, Rφ and R at points, shape (3, k); `angle_rounding` is that of angles [rad].

        They are those of the digits of the coefficients, of δ in α3 and α4, of the angles to second order, and of
        floating point.
        """
        return self._errors_of(self.form, self.noise, _PART_FORM, sines, angle_rounding)

    def level_errors(
        self, sines: Sines, angle_rounding: npt.ArrayLike = 0.0
    ) -> FloatArray:
        """Return the bounds of the errors of R alone, shape (k,); see :meth:`errors`."""
        errors = self._errors_of(
            self.level_form, self.noise[2:], _LEVEL_PARTS, sines, angle_rounding
        )
        return np.asarray(errors[0])

    def _errors_of(
        self,
        form: Form,
        noise: FloatArray,
        parts: Form,
        sines: Sines,
        angle_rounding: npt.ArrayLike,
    ) -> FloatArray:
        """Return the errors of forms, whose `parts` have the factors of the four numbers of the paper."""
        rounding, derived = np.asarray(angle_rounding), self.sheet_error
        errors = np.repeat(noise[:, None], sines.alpha.shape[1], axis=1)
        if self.kind == "published":
            factors = np.abs(parts.at(sines)).reshape(4, *errors.shape)
            errors += np.tensordot(_HALF_UNITS, factors, 1)
        if derived or rounding.any():
            slopes = np.abs(form.slopes(sines))
            errors += rounding * slopes.sum(axis=0)
            errors += derived * slopes[2:].sum(axis=0)
            moved = 4 * rounding + 2 * derived
            errors += form.size[:, None] * moved**2 / 2
        return np.asarray(errors)

    @cached_property
    def largest_errors(self) -> FloatArray:
        """Return what :meth:`errors` never exceeds with exact angles, shape (3,)."""
        errors = self.noise
        if self.kind == "published":
            errors = errors + np.dot(_HALF_UNITS, _PART_FORM.size.reshape(4, 3))
            moved = 2 * self.sheet_error
            errors = errors + self.form.size * (moved + moved**2 / 2)
        return read_only(errors)


def check_symmetric(rotors: Rotors) -> None:
    """Raise InputError unless a half turn about body z maps the rotors to themselves, so that red is a plane."""
    if rotors.asymmetry is not None:
        raise InputError(
            "vehicle must be mapped to itself by a half turn about body z, with the default axes and spins, to have planes "
            f"of gaits, got {rotors.asymmetry}; on its curved sheet there are plans, cycles, their timing, transitions and missions",
            field="vehicle",
        )


def is_red(rows: FloatArray) -> npt.NDArray[np.bool_]:
    """Return whether points, shape (4, k), lie exactly on red, where α3 = α1 and α4 = α2, shape (k,)."""
    return np.asarray((rows[:2] == rows[2:]).all(axis=0))


CoefficientsLike = Coefficients | Kind
"""What may be given for coefficients: see :func:`coefficients_of`."""


def _parts() -> FloatArray:
    """Return the form of the paper's (−Rθ, Rφ, R) without its four numbers, and the factor of each, (5, 2, 2, 2, 2, 3)."""
    parts = np.zeros((5, 2, 2, 2, 2, 3))
    for corner in product((0, 1), repeat=4):
        cosine, sine = 1.0 - np.array(corner), np.array(corner, dtype=float)
        # Of each pair of opposite arms: the features, and the cosine of the sum and the sine of the difference.
        both = cosine[:2] * cosine[2:]
        neither = sine[:2] * sine[2:]
        sums = sine[:2] * cosine[2:] + cosine[:2] * sine[2:]
        apart = sine[:2] * cosine[2:] - cosine[:2] * sine[2:]
        cosines = both - neither
        a1, a2, a3, a4 = corner
        known, attitude, single, double, triple = parts[:, a1, a2, a3, a4]
        known[0] = apart[1] * cosines[0]
        known[1] = -apart[0] * cosines[1]
        known[2] = 4 * both[0] * both[1] - 2 * both[0] * neither[1]
        known[2] -= 2 * neither[0] * both[1]
        attitude[0] = -apart[1] * sums[0]
        attitude[1] = -apart[0] * sums[1]
        single[2] = both[0] * sums[1] - sums[0] * both[1]
        double[2] = sums[0] * sums[1]
        triple[2] = neither[0] * sums[1] - sums[0] * neither[1]
    return parts


_PARTS = _parts()
_PART_FORM = Form(np.concatenate(_PARTS[1:], axis=-1))
_LEVEL_PARTS = Form(_PART_FORM.table[..., 2::3])


def paper_form(numbers: Sequence[float]) -> Form:
    """Return the form of v = (−Rθ, Rφ, R) of the paper's formulas with other numbers a, b, c and d."""
    return Form(_PARTS[0] + np.einsum("i,iabcdq->abcdq", numbers, _PARTS[1:]))


def coefficients_of(
    vehicle: VehicleLike = PAPER, kind: CoefficientsLike | None = None
) -> Coefficients:
    """Return the coefficients of formula (1) for a vehicle: the places, drags and spins of its rotors matter.

    `kind` is "published", "printed", "exact", or None: published for the paper's vehicle, exact for any other.
    Coefficients are returned unchanged. InputError if the paper's are requested for another vehicle.

    >>> coefficients_of().kind, coefficients_of("padova").kind
    ('published', 'exact')
    """
    if isinstance(kind, Coefficients):
        return kind
    if kind is not None:
        checked_choice("coefficients", kind, KINDS)
    return _coefficients(vehicle_named(vehicle), kind)


@lru_cache(maxsize=64)
def _coefficients(vehicle: Vehicle, kind: Kind | None) -> Coefficients:
    if kind is None:
        kind = "published" if vehicle.carries_published_coefficients else "exact"
    if kind != "exact" and not vehicle.carries_published_coefficients:
        about = f"κ = {vehicle.drag_ratio:.6g}"
        if vehicle.rotor_positions is not None:
            about += ", rotor_positions"
        elif vehicle.asymmetry:
            about += f", {vehicle.asymmetry}"
        elif vehicle.rotor_height:
            about += f", rotor height {vehicle.rotor_height:g} m"
        raise wrong(
            "coefficients",
            f"must be 'exact' for {vehicle.name!r} ({about})",
            kind,
            f", which belong to the paper's vehicle (κ = {PAPER.drag_ratio:.6f})",
        )
    return Coefficients(kind, rotors_of(vehicle))
