"""What the tilt servos are told over a flight: a gait again and again, or hover, a way to the gait, and back."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from gaitgraph.errors import InputError, shown
from gaitgraph.timing import TimedGait, parametrize
from gaitgraph.transitions import transition

if TYPE_CHECKING:
    from gaitgraph.vehicle import Vehicle

__all__ = ["Course", "from_hover", "repeated"]

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Course:
    """Commands to the four tilt servos over a flight.

    Parameters
    ----------
    pieces
        Timed gaits, each with when it begins [s] and at which time of its own [s], in order of time.
    duration
        How long the course is [s]; infinite for a gait again and again.
    phases
        What each piece is, for people: "hover", "entry", "gait", "exit".
    """

    pieces: tuple[tuple[float, float, TimedGait], ...]
    duration: float
    phases: tuple[str, ...]

    @property
    def timed(self) -> TimedGait:
        """The gait."""
        return self.pieces[self.phases.index("gait")][2]

    @property
    def vehicle(self) -> Vehicle:
        """What flies it."""
        return self.timed.gait.vehicle

    def at(self, t: FloatArray) -> FloatArray:
        """Return the tilt angles at times of shape (n,), shape (n, 4) [rad]."""
        begins = np.array([begin for begin, _, _ in self.pieces])
        which = np.maximum(np.searchsorted(begins, t, side="right") - 1, 0)
        alpha = np.empty((len(t), 4))
        for k, (begin, own, timed) in enumerate(self.pieces):
            mine = which == k
            if mine.any():
                alpha[mine] = timed.at(t[mine] - begin + own)[0]
        return alpha

    def phase_at(self, t: float) -> str:
        """Return what the course does at a time."""
        begun = [phase for (begin, _, _), phase in zip(self.pieces, self.phases, strict=True) if begin <= t]
        return begun[-1] if begun else self.phases[0]


def repeated(timed: TimedGait) -> Course:
    """Return the course of a gait that is flown again and again from its begin."""
    return Course(pieces=((0.0, 0.0, timed),), duration=np.inf, phases=("gait",))


def from_hover(
    timed: TimedGait, *, periods: int = 2, pause: float = 1.0, duration: float | None = None, anyway: bool = False
) -> Course | str:
    """Return the course from hover into a gait, around it, and back; or the reason why there is none.

    Parameters
    ----------
    timed
        The gait.
    periods
        How often the gait is flown.
    pause
        In hover, before and after [s].
    duration
        Of the way in, and of the way out [s]; by default what :func:`gaitgraph.transitions.transition` takes.
    anyway
        Whether to take the straight way to the gait's first corner where there is no better one.
    """
    if isinstance(periods, bool) or not isinstance(periods, int) or not 1 <= periods <= 10_000:
        raise InputError(f"periods: {shown(periods)}; allowed is a whole number from 1 to 10000")
    gait = timed.gait
    way = transition("hover", gait, duration=duration)
    seconds = way.duration
    if not way or (way.report is not None and not way.report.flyable):
        if not anyway:
            return f"no flyable way from hover: {way.reason}"
        ends = np.stack([np.zeros(4), gait.alpha[0]])
        straight = replace(gait, alpha=ends, colors=(gait.colors[0],) * 2, request={})
        ways, corner = parametrize(straight, 2 * seconds), 0
    else:
        ways, corner = way.timed, way.corners[1] or 0
    still = replace(gait, alpha=np.zeros((1, 4)), colors=gait.colors[:1], request={})
    hover = parametrize(still, 1.0)
    joined = float(timed.corner_times[corner])
    entry, around = pause + seconds, pause + seconds + periods * timed.period
    return Course(
        pieces=(
            (0.0, 0.0, hover),
            (pause, 0.0, ways),
            (entry, joined, timed),
            (around, seconds, ways),
            (around + seconds, 0.0, hover),
        ),
        duration=around + seconds + pause,
        phases=("hover", "entry", "gait", "exit", "hover"),
    )

