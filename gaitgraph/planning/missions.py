"""Whole flights: from hover into a gait, some periods of it, and back to hover, as one motion that is run once."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from gaitgraph import later
from gaitgraph.angles import whole_number
from gaitgraph.errors import Advice, Infeasible
from gaitgraph.gait.gait import there_and_back
from gaitgraph.gait.table import check_repeats
from gaitgraph.invertibility.matrices import level_determinant
from gaitgraph.planning.transitions import transition
from gaitgraph.surface.curved import hover_on_sheet
from gaitgraph.timing.joining import HOVER, JoinedPath, Turns, played, run_up
from gaitgraph.timing.timed_gait import TimedPath, checked_clock
from gaitgraph.validation.report import broken_rules

if TYPE_CHECKING:
    from gaitgraph.gait.gait import Gait
    from gaitgraph.gait.given import GaitLike
    from gaitgraph.invertibility.coefficients import CoefficientsLike
    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.surface.sheets import Sign
    from gaitgraph.timing.joining import RunUp
    from gaitgraph.timing.laws import LawName
    from gaitgraph.timing.timed_gait import TimedGait
    from gaitgraph.vehicle import VehicleLike

_MOST_PERIODS = 10_000
_PAUSE = 1.0  # s in hover, before and after


def mission(
    gait: GaitLike,
    *,
    periods: int = 2,
    rate: float | None = None,
    vehicle: VehicleLike | None = None,
    coefficients: CoefficientsLike | None = None,
    anyway: bool = False,
) -> JoinedPath:
    """Return the motion from hover into a gait, around it, and back to hover, continuous in angles and rates.

    Parameters
    ----------
    gait
        A gait in any form, see :func:`gaitgraph.gait.given.given_gait`, with the timing that it states.
    periods
        How often it is run, 1 to 10,000. There is a second in hover before and after.
    rate
        Rows of its table in a second [Hz]; the last hover lasts until a whole number of frames is full. By default as
        dense as those of the gait.
    vehicle, coefficients
        Replace those of the gait.
    anyway
        Enter it along a straight line even if that is not flyable.

    Returns
    -------
    JoinedPath
        A timed path, run once; `course` names its phases, and when each begins. The path from hover is on the surface
        if possible; otherwise, as to a biased gait, it is straight if that is flyable. It ends at the first row of the
        gait. If the gait is in motion there, a run-up and a run-down join it, see :mod:`gaitgraph.timing.joining`.

    Raises
    ------
    Infeasible
        If no flyable path leads from hover to the gait, with the reason, and how far away the nearest gait is to which
        one leads.
    InputError
        If the gait is run once, or `periods` is out of range.

    Examples
    --------
    >>> from gaitgraph.gait.gait import lift
    >>> gait = lift([(-0.4, 0.4), (-0.4, 1.2), (-1.2, 1.2), (-1.2, 0.4)], "red")
    >>> flight = mission(gait.parametrize(1.0), periods=3)
    >>> flight.course.phases, flight.period
    (('hover', 'entry', 'gait', 'exit', 'hover'), 7.0)
    """
    periods = whole_number("periods", periods, 1, _MOST_PERIODS)
    timed = played(gait, vehicle=vehicle, coefficients=coefficients)
    check_repeats(timed)
    line, law, seconds = _entry(timed, anyway=anyway)
    hover = _path(timed.gait, line[:1], law, _PAUSE)
    starts, stops = run_up(timed), run_up(timed, stops=True)
    sections: list[TimedPath | RunUp | None] = [
        hover,
        _path(timed.gait, line, law, seconds),
        starts,
        Turns(motion=timed, periods=periods),
        stops,
        _path(timed.gait, line[::-1], law, seconds),
        hover,
    ]
    known = [section for section in sections if section is not None]
    whole = sum(section.period for section in known)
    if rate is None:
        return JoinedPath.of(known, round(timed.samples * whole / timed.period))
    frames = checked_clock(whole, law, rate=rate)
    pause = _PAUSE + frames / float(rate) - whole
    known[-1] = _path(timed.gait, line[:1], law, pause)
    return JoinedPath.of(known, frames)


def _entry(timed: TimedGait, *, anyway: bool) -> tuple[FloatArray, LawName, float]:
    """Return the corners of the path from hover to the first row of a gait, its law and its duration [s]."""
    joining = transition(HOVER, timed)
    if joining and joining.report.flyable:
        return joining.path, joining.law, joining.duration
    # Straight to the first row, within the largest tilt rate.
    around = timed.gait
    seconds = joining.duration if joining else 1.0
    hover = hover_on_sheet(around.coefficients.rotors)
    line = np.vstack([hover, timed.at(0.0).alpha])
    limit = around.vehicle.max_tilt_rate
    if limit is not None:
        peaks = _path(around, line, joining.law, 1.0).peaks(1)
        seconds = max(seconds, float((peaks / limit).max()))
    forbidden, _ = broken_rules(_path(around, line, joining.law, seconds).check())
    if forbidden and not anyway:
        # For a gait off the surfaces, paths on them do not matter.
        reason = f"off the surfaces it is straight, and {forbidden[0]}"
        if around.vehicle.asymmetry is not None or around.check().valid:
            reason = str(joining.reason)
        raise _unreachable(around, reason)
    return line, joining.law, seconds


def _unreachable(gait: Gait, reason: str) -> Infeasible:
    """Return the refusal of a gait that hover does not reach, with the nearest gait that it reaches, if there is one."""
    message = f"no flyable path from hover: {reason}"
    if gait.vehicle.asymmetry is not None:
        return Infeasible(message)
    at_hover = float(level_determinant(np.zeros(4), gait.coefficients))
    sign: Sign = "positive" if at_hover > 0 else "negative"
    nearest = later.retarget(gait, sign=sign)
    after = nearest.after
    if after is None or not (after.flyable and after.reachable_from_hover):
        return Infeasible(message)
    farthest = math.degrees(nearest.largest[0])
    return Infeasible(
        f"{message}. Hover reaches a gait whose rows are up to {farthest:.3g}° away",
        advice=Advice(
            f'gg.retarget(gait, sign="{sign}") .table is it',
            f"gaitgraph retarget --sign {sign} writes it",
        ),
    )


def _path(like: Gait, line: FloatArray, law: LawName, seconds: float) -> TimedPath:
    """Return the timed path along some corners, for the vehicle, coefficients and color of a gait."""
    gait = there_and_back(line, like)
    return TimedPath.of(gait.parametrize(2 * seconds, law=law))
