r"""The one sheet on which any four tilting rotors can fly, in closed form (docs/theory.md, 5).

Let Wᵢ·uᵢ be the wrench of rotor i, moment and force per thrust, with uᵢ = (cos αᵢ, sin αᵢ). Cramer's rule for the six
columns W1·u1, W2·u2, W3 and W4, in the five rows without the vertical force, gives four thrusts whose moments and
horizontal forces cancel: g(u2), h(u1), and the lengths of U3(u1, u2) and U4(u1, u2), where α3 and α4 are the directions of
U3 and U4. Their vertical force is ρ(u1, u2). U3, U4 and ρ are linear in u1 and in u2, so that the sheet, its
derivatives, its hover thrusts and its borders are rational.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import angles_from, wrapped
from gaitgraph.arrays import freeze_arrays
from gaitgraph.errors import InputError
from gaitgraph.invertibility.forms import FloatArray, level_of, rotors_of
from gaitgraph.records import Record
from gaitgraph.tolerances import SAME_ANGLE
from gaitgraph.vehicle import PAPER, vehicle_named

if TYPE_CHECKING:
    from gaitgraph.invertibility.forms import Rotors
    from gaitgraph.vehicle import VehicleLike

CHORD_DEVIATION = 1e-3
"""By how much chords between rows may be off the sheet [rad]."""
_ROOM = 1e-9  # share by which bounds are widened for rounding
_FEWEST = 16  # rows of each segment of a polyline
_MOST_HALVINGS = 24
_PIECE = 0.05  # of a segment whose distance from the sheet is bounded [rad]
_NO_SHEET = 1e-12  # share of its columns below which a determinant vanishes


class LiftedRows(NamedTuple):
    """Points of the sheet above a polyline, shape (n, 4), and how far the chords between them are from it at most [rad]."""

    alpha: FloatArray
    deviation: float


class LiftedChords(NamedTuple):
    """Chords of the sheet above segments of (α1, α2), those of each segment in order, and the segments' numbers.

    α3 and α4 of a segment begin in [−π/2, π/2] and are continuous. A segment through a fibre has no chord.
    """

    starts: FloatArray  # (p, 4) [rad]
    ends: FloatArray
    segment: npt.NDArray[np.intp]  # (p,)


class _Pieces(NamedTuple):
    """Pieces of segments in order, with bounds of their bends, and where other segments meet a fibre."""

    starts: FloatArray  # (p, 2) [rad]
    ends: FloatArray
    segment: npt.NDArray[np.intp]  # (p,)
    bends: FloatArray  # (p, 2)
    broken: FloatArray  # (k, 2)


@dataclass(frozen=True, slots=True, eq=False)
class CurvedSheet(Record):
    """The sheet of level flight of any four rotors over the (α1, α2) plane; tables of forms in u1 and u2.

    Parameters
    ----------
    opposite
        U3 and U4, shape (2, 2, 2, 2): of u1, of u2, the rotor, the component.
    inputs
        g as a form in u2 and h as one in u1, shape (2, 2).
    lift
        ρ, shape (2, 2).
    contact
        λ, of degree two in u1 and in u2, shape (2, 2, 2, 2): of u1, u2, u1, u2. Where it is zero the sheet meets the
        singular one, and all moments lie in a plane.
    waves
        The amplitudes of the waves of α1 + α2 and of α1 − α2 of which U3, and U4, are the sum, shape (2, 2).
    """

    opposite: FloatArray
    inputs: FloatArray
    lift: FloatArray
    contact: FloatArray
    waves: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(self)

    def angles(self, alpha1: npt.ArrayLike, alpha2: npt.ArrayLike) -> FloatArray:
        """Return α3 and α4 in [−π/2, π/2], shape (..., 2) [rad]."""
        directions = self._directions(alpha1, alpha2)
        angles = np.arctan2(directions[..., 1], directions[..., 0])
        return np.asarray(wrapped(angles))

    def slopes(self, alpha1: npt.ArrayLike, alpha2: npt.ArrayLike) -> FloatArray:
        """Return the derivatives of α3 and α4 (rows) with respect to α1 and α2 (columns), shape (..., 2, 2)."""
        U = self._directions(alpha1, alpha2)[..., None, :]
        turned = self._turned(alpha1, alpha2)
        return np.asarray(_across(U, turned) / np.sum(U * U, axis=-1))

    def second_derivatives(
        self, alpha1: npt.ArrayLike, alpha2: npt.ArrayLike
    ) -> FloatArray:
        """Return the second derivatives of α3 and α4 with respect to α1 and α2, shape (..., 2, 2, 2) [1/rad]."""
        U = self._directions(alpha1, alpha2)
        first = self._turned(alpha1, alpha2)
        quarter = np.add(alpha1, math.pi / 2)
        mixed = self._directions(quarter, np.add(alpha2, math.pi / 2))
        second = np.stack([np.stack([-U, mixed], -2), np.stack([mixed, -U], -2)], -3)
        size = np.sum(U * U, axis=-1)[..., None, None]
        U = U[..., None, None, :]
        by_row, by_column = first[..., :, None, :], first[..., None, :, :]
        slope = _across(U, by_row) / size
        bend = _across(by_column, by_row) + _across(U, second)
        return np.asarray((bend - 2 * slope * np.sum(U * by_column, axis=-1)) / size)

    def hover_thrusts(self, alpha1: npt.ArrayLike, alpha2: npt.ArrayLike) -> FloatArray:
        """Return the hover thrusts at :meth:`angles`, in units of m·g, shape (..., 4); not finite where ρ = 0."""
        u1, u2 = _directions_of(alpha1), _directions_of(alpha2)
        directions = self._directions(alpha1, alpha2)
        # An angle that is wrapped by π has the opposite thrust.
        sign = np.where(directions[..., 0] < 0, -1.0, 1.0)
        sizes = sign * np.linalg.norm(directions, axis=-1)
        own = np.broadcast_arrays(u2 @ self.inputs[0], u1 @ self.inputs[1])
        inputs = np.concatenate([np.stack(own, axis=-1), sizes], axis=-1)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(inputs / _bilinear(self.lift, u1, u2)[..., None])

    def factors_of_R(
        self, alpha1: npt.ArrayLike, alpha2: npt.ArrayLike
    ) -> tuple[FloatArray, FloatArray]:
        """Return ρ and λ, the factors of R that vanish where it does, both of shape (...)."""
        u1, u2 = _directions_of(alpha1), _directions_of(alpha2)
        contact = np.einsum(
            "abcd,...a,...b,...c,...d->...", self.contact, u1, u2, u1, u2
        )
        return _bilinear(self.lift, u1, u2), np.asarray(contact)

    def tilt_border(self, rotor: int, tilt: float) -> FloatArray:
        """Return the form in u1 and u2 that is zero where rotor 3 or 4 is at a tilt [rad], modulo π, shape (2, 2)."""
        table = self.opposite[:, :, rotor - 3]
        return np.asarray(
            math.cos(tilt) * table[..., 1] - math.sin(tilt) * table[..., 0]
        )

    def changes_within(
        self, alpha1: FloatArray, alpha2: FloatArray, reach: float
    ) -> FloatArray:
        """Return what α3 and α4 change by at most within `reach` of α1 and of α2 [rad], shape (m, 2); else infinity."""
        U = self._directions(alpha1, alpha2)
        turned = self._turned(alpha1, alpha2)
        lengths, shortened = self.lengths_within(alpha1, alpha2, reach)
        # det(U, ∂U) depends on one of the two angles, and changes by no more than 2·largest² per radian of it.
        turning = np.abs(_across(U[..., None, :], turned)).sum(axis=-1)
        turning += 4 * self.waves.sum(axis=1) ** 2 * reach
        with np.errstate(divide="ignore"):
            change = reach * turning / np.maximum(lengths - shortened, 0.0) ** 2
        return np.asarray(change)

    def lengths_within(
        self, alpha1: FloatArray, alpha2: FloatArray, reach: float
    ) -> tuple[FloatArray, FloatArray]:
        """Return |U3| and |U4|, and what they change by at most within `reach` of both angles, both of shape (m, 2)."""
        lengths = np.linalg.norm(self._directions(alpha1, alpha2), axis=-1)
        speed = np.linalg.norm(self._turned(alpha1, alpha2), axis=-1).sum(axis=-1)
        return lengths, reach * speed + 2 * reach**2 * self.waves.sum(axis=1)

    def rows(
        self, corners: npt.ArrayLike, deviation: float = CHORD_DEVIATION
    ) -> LiftedRows:
        """Return points of the sheet above a polyline of (α1, α2), shape (n, 2) [rad], dense enough for their chords.

        α3 and α4 begin in [−π/2, π/2] and are continuous. InputError where the polyline meets a fibre, beside which
        they have no bound.
        """
        plane = angles_from(corners, "corners")
        pieces = self._fine_pieces(plane[:-1], plane[1:], deviation)
        if len(pieces.broken):
            first, second = pieces.broken[0].tolist()
            raise InputError(
                "corners must not lead through a fibre, where α3 or α4 is free, got one near "
                f"α1 = {first:.4f}, α2 = {second:.4f}",
                field="corners",
            )
        points = np.concatenate([pieces.starts, plane[-1:]])
        opposite = np.unwrap(self.angles(*points.T), axis=0, period=math.pi)
        alpha = np.hstack([points, opposite])
        return LiftedRows(alpha, float(pieces.bends.max(initial=0.0) / 8))

    def chords(self, starts: FloatArray, ends: FloatArray) -> LiftedChords:
        """Return the chords between :meth:`rows` of each of m segments of (α1, α2), both of shape (m, 2) [rad]."""
        pieces = self._fine_pieces(starts, ends, CHORD_DEVIATION)
        segment = pieces.segment
        before = self.angles(*pieces.starts.T)
        steps = wrapped(self.angles(*pieces.ends.T) - before)
        # A piece begins where the one before it on its segment ends.
        passed = np.cumsum(steps, axis=0) - steps
        is_first = np.diff(segment, prepend=-1) != 0
        origins = (before - passed)[is_first]
        opposite = passed + origins[np.cumsum(is_first) - 1]
        return LiftedChords(
            starts=np.hstack([pieces.starts, opposite]),
            ends=np.hstack([pieces.ends, opposite + steps]),
            segment=segment,
        )

    def _fine_pieces(
        self, starts: FloatArray, ends: FloatArray, deviation: float
    ) -> _Pieces:
        """Return pieces of segments of (α1, α2), cut until the sheet is within a deviation of the chords [rad]."""
        shares = np.arange(_FEWEST + 1)[:, None] / _FEWEST
        points = starts[:, None] + shares * (ends - starts)[:, None]
        points[:, -1] = ends
        first, last = points[:, :-1].reshape(-1, 2), points[:, 1:].reshape(-1, 2)
        segment = np.repeat(np.arange(len(starts)), _FEWEST)
        broken = []
        while True:
            rates, bends = self.bounds_along(first, last)
            is_coarse = (bends.max(axis=1) > 8 * deviation) | (rates.max(axis=1) > 1)
            is_short = np.abs(last - first).max(axis=1) < 2.0**-_MOST_HALVINGS
            at_fibre = is_coarse & is_short
            if at_fibre.any():
                broken.append((first + last)[at_fibre] / 2)
                is_left = ~np.isin(segment, segment[at_fibre])
                first, last, segment = first[is_left], last[is_left], segment[is_left]
                continue
            if not is_coarse.any():
                break
            number = np.flatnonzero(is_coarse)
            middles = (first + last)[number] / 2
            first = np.insert(first, number + 1, middles, axis=0)
            last = np.insert(last, number, middles, axis=0)
            segment = np.insert(segment, number, segment[number])
        places = np.concatenate([*broken, np.empty((0, 2))])
        return _Pieces(first, last, segment, bends, places)

    def distances(self, alpha: FloatArray) -> FloatArray:
        """Return by how much α3 or α4 of points of shape (n, 4) are off the sheet, modulo π, shape (n,) [rad]."""
        off = wrapped(self.angles(*alpha[:, :2].T) - alpha[:, 2:])
        return np.asarray(np.abs(off).max(axis=1))

    def distances_along(self, starts: FloatArray, ends: FloatArray) -> FloatArray:
        """Return proven bounds of :meth:`distances` along straight segments, both of shape (m, 4), shape (m,) [rad].

        The second derivative of the distance along a segment is that of the sheet. Where α3 or α4 may turn by π between
        the ends the bound is π/2, as of any point. Long segments are bounded in pieces.
        """
        if not len(starts):
            return np.zeros(0)
        steps = ends - starts
        count = np.ceil(np.abs(steps).max(axis=1) / _PIECE).astype(int).clip(min=1)
        first = np.cumsum(count) - count  # the place of each segment's first piece
        segment = np.repeat(np.arange(len(starts)), count)
        number = np.arange(count.sum()) - first[segment]
        shares = np.stack([number, number + 1]) / count[segment]
        at = starts[segment] + shares[..., None] * steps[segment]
        at[1, first + count - 1] = ends  # without rounding
        return np.maximum.reduceat(self._distances_along_pieces(*at), first)

    def _distances_along_pieces(
        self, starts: FloatArray, ends: FloatArray
    ) -> FloatArray:
        """Return the bounds along short segments."""
        rates, bends = self.bounds_along(starts[:, :2], ends[:, :2])
        at_ends = np.maximum(self.distances(starts), self.distances(ends))
        turns = np.abs(ends - starts)[:, 2:] + rates
        bounds = at_ends + bends.max(axis=1) / 8
        may_turn = turns.max(axis=1) + 2 * at_ends >= math.pi
        return np.where(may_turn, math.pi / 2, np.minimum(bounds, math.pi / 2))

    def holds_chords(self, alpha: FloatArray) -> bool:
        """Return whether the points of a closed polyline, shape (n, 4), are on the sheet, and its segments as near as rows'."""
        ends = np.roll(alpha, -1, axis=0)
        moves = (ends != alpha)[:, :2].any(axis=1).all()
        if not moves or self.distances(alpha).max() > SAME_ANGLE:
            return False
        off = self.distances_along(alpha, ends)
        return bool(off.max() <= CHORD_DEVIATION + SAME_ANGLE)

    def bounds_along(
        self, starts: FloatArray, ends: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return what |dα/ds| and |d²α/ds²| of α3 and α4 do not exceed along m short segments of (α1, α2) [rad].

        Both have the shape (m, 2), and are infinite near a fibre; s is the share of a segment. U is a sum of two waves,
        which bound its derivatives. |U| is at least the distance of the chord from 0, less an eighth of |U″|. With
        n = U × U′ and p = |U|²·U × U″ − 2n·U·U′ the derivatives of the angle are n/|U|² and p/|U|⁴; n and p are known at
        both ends, and n′ and p′ have bounds.
        """
        steps = ends - starts
        turns = np.abs([steps.sum(axis=1), steps[:, 0] - steps[:, 1]])
        second, third = ((self.waves @ turns**power).T for power in (2, 3))
        first, last = self._directions(*starts.T), self._directions(*ends.T)
        chord = last - first
        square = np.sum(chord * chord, axis=-1)
        share = -np.sum(first * chord, axis=-1) / np.where(square > 0, square, 1.0)
        nearest = first + np.clip(share, 0.0, 1.0)[..., None] * chord
        largest = np.maximum(*(np.linalg.norm(U, axis=-1) for U in (first, last)))
        least = np.linalg.norm(nearest, axis=-1) - second / 8 - _ROOM * largest
        largest = largest + second / 8
        speed = np.sqrt(square) + second / 2

        turning, bending = np.zeros((2, *largest.shape))
        for U, place in ((first, starts), (last, ends)):
            velocity = np.einsum("mkvc,mv->mkc", self._turned(*place.T), steps)
            mixed = self._directions(*(place + math.pi / 2).T)
            n = _across(U, velocity)
            twist = 2 * steps.prod(axis=1)[:, None] * _across(U, mixed)
            p = np.sum(U * U, -1) * twist - 2 * n * np.sum(U * velocity, -1)
            turning = np.maximum(turning, np.abs(n))
            bending = np.maximum(bending, np.abs(p))
        turning += largest * second / 2
        bending += largest**2 * (speed * second + largest * third) / 2
        bending += turning * (speed**2 + largest * second)
        with np.errstate(divide="ignore", invalid="ignore"):
            rates = (1 + _ROOM) * turning / least**2
            bends = (1 + _ROOM) * bending / least**4
        is_bounded = least > 0
        return (
            np.where(is_bounded, rates, math.inf),
            np.where(is_bounded, bends, math.inf),
        )

    def _directions(self, alpha1: npt.ArrayLike, alpha2: npt.ArrayLike) -> FloatArray:
        """Return U3 and U4, shape (..., 2, 2)."""
        u1, u2 = _directions_of(alpha1), _directions_of(alpha2)
        products = u1[..., :, None] * u2[..., None, :]
        shape = products.shape[:-2]
        table = self.opposite.reshape(4, 4)
        return np.asarray((products.reshape(*shape, 4) @ table).reshape(*shape, 2, 2))

    def _turned(self, alpha1: npt.ArrayLike, alpha2: npt.ArrayLike) -> FloatArray:
        """Return the derivatives of U3 and U4 with respect to α1 and α2, shape (..., 2, 2, 2): rotor, angle, component."""
        quarter = math.pi / 2
        by_first = self._directions(np.add(alpha1, quarter), alpha2)
        by_second = self._directions(alpha1, np.add(alpha2, quarter))
        return np.stack([by_first, by_second], axis=-2)


def curved_sheet(vehicle: VehicleLike = PAPER) -> CurvedSheet:
    """Return the sheet of level flight of a vehicle: red if it is symmetric, and the plane of red then.

    >>> places = [[0.2, 0.2, 0.0], [-0.2, 0.2, 0.0], [-0.2, -0.2, 0.0], [0.2, -0.15, 0.0]]
    >>> sheet = curved_sheet({"drag_to_thrust": 0.02, "rotor_positions": places})
    >>> sheet.angles(-0.3, 0.3).round(4).tolist(), sheet.hover_thrusts(-0.3, 0.3).round(4).tolist()
    ([-0.2301, 0.2669], [0.2466, 0.2429, 0.2745, 0.2749])
    """
    return sheet_of(rotors_of(vehicle_named(vehicle)))


def hover_on_sheet(rotors: Rotors) -> FloatArray:
    """Return the point of the sheet above α1 = α2 = 0, shape (1, 4) [rad]: α = 0 with the default axes."""
    alpha = np.zeros((1, 4))
    if rotors.asymmetry is not None:
        alpha[0, 2:] = sheet_of(rotors).angles(0.0, 0.0)
    return alpha


@lru_cache(maxsize=64)
def sheet_of(rotors: Rotors) -> CurvedSheet:
    """Return the sheet of level flight of four rotors."""
    level = level_of(rotors)
    signs = rotors.thrust_signs[:, None, None]
    wrench = signs * np.concatenate([level.moment, level.force], axis=1)
    opposite, lift = np.zeros((2, 2, 2, 2)), np.zeros((2, 2))
    inputs, normals = np.zeros((2, 2)), np.zeros((2, 2, 2))
    for i, j in product((0, 1), repeat=2):
        first, second = wrench[0, :, i], wrench[1, :, j]
        columns = np.column_stack([first, second, wrench[2], wrench[3]])
        minors = np.array(
            [
                (-1) ** k * np.linalg.det(np.delete(columns[:5], k, axis=1))
                for k in range(6)
            ]
        )
        inputs[0, j], inputs[1, i] = minors[:2]
        opposite[i, j] = minors[2:].reshape(2, 2)
        lift[i, j] = columns[5] @ minors
        normals[i, j] = np.cross(first[:3], second[:3]) @ wrench[3, :3]
    size = np.abs(opposite).max()
    if size <= _NO_SHEET * np.prod(np.linalg.norm(wrench, axis=1).max(axis=1)):
        raise InputError(
            "vehicle must make every moment and horizontal force at some tilt angles, got four rotors that can not, as with "
            "one tilt axis for all",
            field="vehicle",
        )
    opposite, inputs, lift = opposite / size, inputs / size, lift / size
    return CurvedSheet(
        opposite=opposite,
        inputs=inputs,
        lift=lift,
        contact=np.einsum("abk,cdk->abcd", normals, opposite[:, :, 1]),
        waves=np.array([_wave_sizes(opposite[:, :, k]) for k in range(2)]),
    )


def _wave_sizes(table: FloatArray) -> list[float]:
    """Return the amplitudes of the waves of α1 + α2 and of α1 − α2 of which a vector of bilinear forms is the sum."""
    of_sum = [table[0, 0] - table[1, 1], table[1, 0] + table[0, 1]]
    of_difference = [table[0, 0] + table[1, 1], table[1, 0] - table[0, 1]]
    return [
        float(np.linalg.norm(np.array(wave) / 2, 2)) for wave in (of_sum, of_difference)
    ]


def _directions_of(alpha: npt.ArrayLike) -> FloatArray:
    """Return u = (cos α, sin α), shape (..., 2)."""
    return np.stack([np.cos(alpha), np.sin(alpha)], axis=-1)


def _bilinear(form: FloatArray, u1: FloatArray, u2: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("ab,...a,...b->...", form, u1, u2))


def _across(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the determinants of two vectors of two components, the last axis."""
    return np.asarray(first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0])
