"""The law `smooth` along the curved sheet of a vehicle that is not symmetric: from rest to rest between corners.

A lifted gait has rows between its corners, which follow the sheet (:meth:`gaitgraph.surface.curved.CurvedSheet.rows`).
(α1, α2) is straight from corner to corner and runs as on a plane; rates and accelerations of α3 and α4 follow by the
derivatives of the sheet. Between rows the motion is the polynomial of degree five through these.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from gaitgraph.arrays import read_only
from gaitgraph.surface.curved import sheet_of
from gaitgraph.timing.laws import LAWS
from gaitgraph.timing.timed_gait import RowTimedGait, TimedGait

if TYPE_CHECKING:
    import numpy.typing as npt

    from gaitgraph import later
    from gaitgraph.gait.gait import Gait
    from gaitgraph.invertibility.forms import FloatArray

_STRAIGHT = 1e-6  # change of the direction of (α1, α2) that is no corner
_HALVINGS = 60  # of a share of time, down to rounding


@dataclass(frozen=True, slots=True, kw_only=True, repr=False, eq=False)
class LiftedTimedGait(RowTimedGait):
    """A gait along its curved sheet that rests at its corners alone; `times` are those of its rows."""

    @property
    def stated_corners(self) -> Any:
        """The rows, from which law and period give the motion, shape (n, 4) [rad]."""
        return self.gait.alpha

    def check(self, **options: Unpack[later.CheckOptions]) -> later.Report:
        """Return every check of the chords between rows, and those of the motion's rates."""
        return TimedGait.check(self, **options)


def gait_with_law(gait: Gait, period: float, law: str, samples: int) -> TimedGait:
    """Return a gait with a law over a period; `smooth` runs along its sheet if the rows of the gait follow that."""
    if law != "smooth" or not is_lifted(gait):
        return TimedGait(gait=gait, period=period, law=law, samples=samples)
    times, derivatives = _motion_of(gait, period)
    return LiftedTimedGait(
        gait=gait,
        period=period,
        law=law,
        samples=samples,
        times=read_only(times),
        law_stated=True,
        row_derivatives=derivatives,
    )


def is_lifted(gait: Gait) -> bool:
    """Return whether the rows of a gait follow the curved sheet of its vehicle."""
    rotors = gait.coefficients.rotors
    if rotors.asymmetry is None or len(gait.alpha) == 1:
        return False
    return sheet_of(rotors).holds_chords(gait.alpha)


def corners_of(gait: Gait) -> npt.NDArray[np.intp]:
    """Return the rows of a lifted gait at which (α1, α2) turns, and the first one."""
    steps = (gait.ends - gait.alpha)[:, :2]
    ahead = steps / np.linalg.norm(steps, axis=1)[:, None]
    turns = np.linalg.norm(ahead - np.roll(ahead, 1, axis=0), axis=1)
    return np.union1d([0], np.flatnonzero(turns > _STRAIGHT))


def _motion_of(gait: Gait, period: float) -> tuple[FloatArray, FloatArray]:
    """Return the times of rows, the first again at the end, shape (n + 1,), and both derivatives, shape (n + 1, 2, 4)."""
    steps = gait.ends - gait.alpha
    lengths = np.linalg.norm(steps, axis=1)
    in_plane = np.linalg.norm(steps[:, :2], axis=1)
    ahead = steps[:, :2] / in_plane[:, None]
    corners = corners_of(gait)
    durations = np.add.reduceat(lengths, corners) * (period / lengths.sum())
    legs = np.add.reduceat(in_plane, corners)
    leg = np.repeat(np.arange(len(corners)), np.diff([*corners, len(steps)]))
    before = np.cumsum(in_plane) - in_plane
    share = np.maximum(before - before[corners][leg], 0.0) / legs[leg]
    tau = _time_share(share)
    _, speed, rise = LAWS["smooth"].motion(tau)
    velocity = (speed * legs[leg] / durations[leg])[:, None] * ahead
    acceleration = (rise * legs[leg] / durations[leg] ** 2)[:, None] * ahead

    sheet = sheet_of(gait.coefficients.rotors)
    slopes = sheet.slopes(*gait.alpha[:, :2].T)
    bends = sheet.second_derivatives(*gait.alpha[:, :2].T)
    rates = np.einsum("nij,nj->ni", slopes, velocity)
    rises = np.einsum("nij,nj->ni", slopes, acceleration)
    rises += np.einsum("nijk,nj,nk->ni", bends, velocity, velocity)
    derivatives = np.stack(
        [np.hstack([velocity, rates]), np.hstack([acceleration, rises])], axis=1
    )
    starts = np.cumsum(durations) - durations
    times = np.append(starts[leg] + tau * durations[leg], period)
    return times, np.concatenate([derivatives, derivatives[:1]])


def _time_share(share: FloatArray) -> FloatArray:
    """Return the shares of the time from rest to rest at which shares of the way are passed."""
    low, high = np.zeros(len(share)), np.ones(len(share))
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        is_early = LAWS["smooth"].motion(middle)[0] < share
        low = np.where(is_early, middle, low)
        high = np.where(is_early, high, middle)
    return np.where(share > 0, high, 0.0)
