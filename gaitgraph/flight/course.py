"""The course of a flight: the commands over time, the servos' response, the rules of physics.

A course repeats a gait (:func:`repeated`), or leads from hover into a gait, around it, and back (:func:`from_hover`).
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import accumulate, pairwise
from typing import TYPE_CHECKING

import numpy as np

from gaitgraph.angles import whole_number
from gaitgraph.errors import InputError, shown
from gaitgraph.gait.table import check_repeats
from gaitgraph.planning.transitions import transition
from gaitgraph.timing.joining import Course, RunUp, course_of, played, run_up
from gaitgraph.timing.laws import LAWS
from gaitgraph.timing.timed_gait import ROW_BY_ROW, TimedGait
from gaitgraph.vehicle import four_of, linked

if TYPE_CHECKING:
    from gaitgraph.gait.given import GaitLike
    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.validation.report import Report
    from gaitgraph.vehicle import Each, Vehicle

_MOST_PERIODS = 10_000
_PAUSE = 1.0  # s in hover, before and after

# The paper's rules that flight does not need: on the surfaces no small tilt makes the matrix singular.
_SURFACE_RULES = frozenset({"closed", "on_surface", "two_color", "continuous"})


def biased_timed_gait(timed: TimedGait, bias: float) -> TimedGait:
    """Return the biased gait, equations (14) and (15), with the same times; InputError if η is not allowed."""
    if timed.law not in (*LAWS, ROW_BY_ROW):
        raise InputError(
            f"law must be one of {', '.join(LAWS)} for a bias, got {shown(timed.law)}",
            field="law",
        )
    return timed.with_gait(timed.gait.biased(bias))


def repeated(timed: TimedGait, *, begin: float = 0.0) -> Course:
    """Return the course that repeats a gait, from a moment of its period on [s]."""
    return Course(sections=((0.0, begin, timed),), duration=np.inf, phases=("gait",))


def arm_response(
    command: FloatArray,
    vehicle: Vehicle,
    step: float,
    *,
    lag: Each = 0.0,
    rate: Each = math.inf,
) -> FloatArray:
    """Return the tilt angles of arms whose servos follow commanded ones, shape (n, 4) [rad].

    A linkage is between servo and arm: the command passes back through it to the servo, whose response
    (:func:`servo_response`) passes through it to the arm. `rate` is of the tilt axis, which a servo whose own rate is
    that over the linkage's smallest slope reaches everywhere.
    """
    if (
        vehicle.linkage is None
        and not isinstance(lag, tuple)
        and not isinstance(rate, tuple)
    ):
        return servo_response(command, step, lag=lag, rate=rate)
    arms = []
    for angles, linkage, one, most in zip(
        command.T, vehicle.linkages, four_of(lag), four_of(rate), strict=True
    ):
        if linkage is None:
            arms.append(servo_response(angles[:, None], step, lag=one, rate=most))
            continue
        slowest = min(abs((b - d) / (a - c)) for (a, b), (c, d) in pairwise(linkage))
        servo = linked(linkage, angles, to_servo=True)[0][:, None]
        arms.append(
            linked(linkage, servo_response(servo, step, lag=one, rate=most / slowest))[
                0
            ]
        )
    return np.hstack(arms)


def servo_response(
    command: FloatArray, step: float, *, lag: float = 0.0, rate: float = math.inf
) -> FloatArray:
    """Return the angles of k servos that follow a command and begin on it, shape (n, k) [rad].

    The command is linear between even times, `step` apart [s]. `lag` is the time constant of a first-order lag [s],
    `rate` the largest rate [rad/s]. Without a rate limit the response is exact; where the lag alone would exceed the
    rate, the servo moves at that rate for the whole step.
    """
    command = np.asarray(command, dtype=float)
    angles = command.copy()
    keep = slope = 0.0
    if lag > 0.0:
        from scipy.signal import lfilter

        # The error e = command − angle obeys lag·ė = lag·(command's slope) − e, the slope constant within a step.
        keep = math.exp(-step / lag)
        slope = lag / step * (1.0 - keep)
        angles[1:] -= lfilter(
            [1.0], [1.0, -keep], slope * np.diff(command, axis=0), axis=0
        )
    most = rate * step
    if not np.any(np.abs(np.diff(angles, axis=0)) > most):
        return angles

    def following(angle: float, commands: tuple[float, float]) -> float:
        before, target = commands
        unlimited = target - slope * (target - before) + keep * (angle - before)
        return angle + min(max(unlimited - angle, -most), most)

    return np.array(
        [
            [*accumulate(pairwise(one), following, initial=one[0])]
            for one in command.T.tolist()
        ]
    ).T


def broken_rules(
    report: Report, *, pulling: bool = False
) -> tuple[list[str], list[str]]:
    """Return the messages of the rules that a gait breaks: those that forbid flight, and the others.

    Flight needs an invertible matrix when level, positive hover thrusts unless rotors may pull, and tilt angles and
    rates within the vehicle's limits. The gait need not be on the surfaces.
    """
    harmless = _SURFACE_RULES | {"hover_thrust"} if pulling else _SURFACE_RULES
    broken = [check for check in report.checks if not (check.ok and check.decided)]
    # What follows from another rule is said with that one, unless it alone forbids flight.
    forbidden = [
        check.message
        for check in broken
        if check.name not in harmless
        and (check.follows_from is None or check.follows_from in harmless)
    ]
    others = [
        check.message
        for check in broken
        if check.name in harmless and check.follows_from is None
    ]
    return forbidden, others


def from_hover(
    gait: GaitLike, *, periods: int = 2, anyway: bool = False
) -> Course | str:
    """Return the course from hover into a gait, around it, and back; or the reason why there is none.

    The gait is flown `periods` times, with a second in hover before and after. The path from hover is on the surface if
    possible; otherwise, as to a biased gait, it is straight if that is flyable, or `anyway`. It ends at the gait's first
    row. If the gait is in motion there, a run-up and a run-down join it, see :mod:`gaitgraph.timing.joining`, so that
    angles and rates are continuous.

    Examples
    --------
    >>> from gaitgraph.gait.gait import lift
    >>> gait = lift([(-0.4, 0.4), (-0.4, 1.2), (-1.2, 1.2), (-1.2, 0.4)], "red")
    >>> from_hover(gait.parametrize(1.0)).duration
    6.0
    >>> from_hover(lift([(1.2, -1.2), (1.2, -0.4), (0.4, -0.4)], "red").parametrize(1.0))[:40]
    'no flyable path from hover: R = +4 at th'
    """
    whole_number("periods", periods, 1, _MOST_PERIODS)
    timed = played(gait)
    check_repeats(timed)
    around = timed.gait
    path = transition("hover", timed)
    if path and path.report.flyable:
        entry, seconds = path.timed_path.loop, path.duration
    else:
        # Straight to the first row, within the largest tilt rate.
        ends = np.stack([np.zeros(4), timed.at(0.0).alpha])
        straight = replace(around, alpha=ends, colors=around.colors[:1] * 2, request={})
        limit, seconds = around.vehicle.max_tilt_rate, path.duration
        if limit is not None:
            seconds = max(
                seconds, float((straight.parametrize(2.0).peak_rates / limit).max())
            )
        entry = straight.parametrize(2 * seconds)
        forbidden, _ = broken_rules(entry.check())
        if forbidden and not anyway:
            # For a gait off the surfaces, paths on them do not matter.
            reason = (
                path.reason
                if around.check().valid
                else f"off the surfaces it is straight, and {forbidden[0]}"
            )
            return f"no flyable path from hover: {reason}"
    hover = replace(
        around, alpha=np.zeros((1, 4)), colors=around.colors[:1], request={}
    ).parametrize(1.0)
    starts, stops = run_up(timed), run_up(timed, stops=True)
    parts: list[tuple[str, float, float, TimedGait | RunUp]] = [
        ("hover", _PAUSE, 0.0, hover),
        ("entry", seconds, 0.0, entry),
        ("gait", periods * timed.period, 0.0, timed),
        ("exit", seconds, seconds, entry),
        ("hover", _PAUSE, 0.0, hover),
    ]
    if starts is not None and stops is not None:
        parts.insert(3, ("run-down", stops.period, 0.0, stops))
        parts.insert(2, ("run-up", starts.period, 0.0, starts))
    return course_of(parts)
