"""The law `smooth` along the curved sheet of a vehicle that is not symmetric: from rest to rest between corners.

A lifted gait has rows between its corners, which follow the sheet (:meth:`gaitgraph.surface.curved.CurvedSheet.rows`).
(α1, α2) is straight from corner to corner and runs as on a plane; rates and accelerations of α3 and α4 follow by the
derivatives of the sheet. Between rows the motion is the polynomial of degree five through these.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gaitgraph.surface.curved import sheet_of
from gaitgraph.timing.laws import LAWS
from gaitgraph.timing.polynomials import derivative_of, located, quintics, values_of
from gaitgraph.timing.timed_gait import RowTimedGait, TimedGait

if TYPE_CHECKING:
    import numpy.typing as npt

    from gaitgraph.gait.gait import Gait
    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.surface.curved import CurvedSheet

_STRAIGHT = 1e-6  # change of the direction of (α1, α2) that is no corner


def gait_with_law(gait: Gait, period: float, law: str, samples: int) -> TimedGait:
    """Return a gait with a law over a period; `smooth` runs along its sheet if the rows of the gait follow that."""
    if law != "smooth" or not is_lifted(gait):
        return TimedGait(gait=gait, period=period, law=law, samples=samples)
    times, tilts = _motion_of(gait, period)
    return RowTimedGait(
        gait=gait,
        period=period,
        law=law,
        samples=samples,
        times=times,
        law_stated=True,
        tilts=tilts,
    )


def is_lifted(gait: Gait) -> bool:
    """Return whether the rows of a gait follow the curved sheet of its vehicle."""
    rotors = gait.coefficients.rotors
    if rotors.asymmetry is None or len(gait.alpha) == 1:
        return False
    return sheet_of(rotors).holds_chords(gait.alpha)


class LiftedPath(NamedTuple):
    """The n segments of a lifted gait, along which s is the distance in the (α1, α2) plane [rad]."""

    corners: npt.NDArray[np.intp]  # rows at which (α1, α2) turns, and the first one
    breaks: FloatArray  # s at the rows, the first again at the end
    starts: FloatArray  # all angles and two derivatives by s, shape (3, n, 4)
    ends: FloatArray

    @property
    def pieces(self) -> FloatArray:
        """Polynomials through these in powers of s since each row, highest first, shape (6, n, 4)."""
        return _through(self.breaks, self.starts, self.ends)


def path_of(gait: Gait) -> LiftedPath:
    """Return the path of a lifted gait along its sheet."""
    steps = (gait.ends - gait.alpha)[:, :2]
    widths = np.linalg.norm(steps, axis=1)
    ahead = steps / widths[:, None]
    turns = np.linalg.norm(ahead - np.roll(ahead, 1, axis=0), axis=1)
    sheet = sheet_of(gait.coefficients.rotors)
    starts, ends = (
        _derivatives(sheet, alpha, ahead, np.zeros_like(ahead))
        for alpha in (gait.alpha, gait.ends)
    )
    return LiftedPath(
        corners=np.union1d([0], np.flatnonzero(turns > _STRAIGHT)),
        breaks=np.concatenate([[0.0], np.cumsum(widths)]),
        starts=starts,
        ends=ends,
    )


def lifted_curve(
    sheet: CurvedSheet, breaks: FloatArray, pieces: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return breaks and polynomials of all four angles, shape (6, n, 4), above a closed curve of (α1, α2).

    The curve has two continuous derivatives. `breaks` and `pieces` are those of :class:`gaitgraph.timing.curve.Curve`.
    Between rows that are as dense as those of a gait, angles and derivatives at the rows give the polynomials.
    """
    corners = np.concatenate([pieces[-1], pieces[-1, :1]])
    rows = sheet.rows(corners).alpha[:-1, :2]
    s = np.interp(_distances_along(rows), _distances_along(corners), breaks)
    piece, local = located(breaks, s)
    plane, velocity, change = (
        values_of(derivative_of(pieces, order)[:, piece], local) for order in range(3)
    )
    opposite = np.unwrap(sheet.angles(*plane.T), axis=0, period=math.pi)
    alpha = np.hstack([plane, opposite])
    starts = _derivatives(sheet, alpha, velocity, change)
    s = np.append(s, breaks[-1])
    return s, _through(s, starts, np.roll(starts, -1, axis=1))


def _distances_along(points: FloatArray) -> FloatArray:
    """Return the distance along a polyline at each of its points, shape (n,)."""
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(steps)])


def _derivatives(
    sheet: CurvedSheet, alpha: FloatArray, velocity: FloatArray, change: FloatArray
) -> FloatArray:
    """Return angles and two derivatives by s on the sheet, shape (3, n, 4), from those of (α1, α2), shape (n, 2)."""
    slopes = sheet.slopes(*alpha[:, :2].T)
    bends = sheet.second_derivatives(*alpha[:, :2].T)
    first = np.einsum("nij,nj->ni", slopes, velocity)
    second = np.einsum("nijk,nj,nk->ni", bends, velocity, velocity)
    second += np.einsum("nij,nj->ni", slopes, change)
    return np.stack([alpha, np.hstack([velocity, first]), np.hstack([change, second])])


def _through(breaks: FloatArray, starts: FloatArray, ends: FloatArray) -> FloatArray:
    """Return the polynomials of degree five in powers of s with angles and two derivatives at both ends."""
    width = np.diff(breaks)
    powers = np.arange(5, -1, -1)[:, None]
    return quintics(starts, ends, width) / (width**powers)[..., None]


def _motion_of(gait: Gait, period: float) -> tuple[FloatArray, FloatArray]:
    """Return the times of rows, the first again at the end, and all angles between them, see :class:`RowTimedGait`."""
    from scipy.special import betaincinv

    path = path_of(gait)
    corners = path.corners
    lengths = np.linalg.norm(gait.ends - gait.alpha, axis=1)
    durations = np.add.reduceat(lengths, corners) * (period / lengths.sum())
    ends = np.append(corners, len(lengths))
    legs = np.diff(path.breaks[ends])
    leg = np.repeat(np.arange(len(corners)), np.diff(ends))
    share = (path.breaks[:-1] - path.breaks[corners][leg]) / legs[leg]
    # The minimum-jerk polynomial is the beta distribution with both parameters 3.
    tau = betaincinv(3, 3, share)
    _, speed, rise = LAWS["smooth"].motion(tau)
    speed = (speed * legs[leg] / durations[leg])[:, None]
    rise = (rise * legs[leg] / durations[leg] ** 2)[:, None]
    alpha, slope, bend = path.starts
    starts = np.stack([alpha, slope * speed, slope * rise + bend * speed**2])
    begins = np.cumsum(durations) - durations
    times = np.append(begins[leg] + tau * durations[leg], period)
    return times, quintics(starts, np.roll(starts, -1, axis=1), np.diff(times))
