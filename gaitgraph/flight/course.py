"""The course of a flight: the commands over time, the servos' response, the rules of physics.

A course repeats a gait (:func:`repeated`), or leads from hover into a gait, around it, and back (:func:`from_hover`).
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from gaitgraph.errors import Infeasible, wrong
from gaitgraph.planning.missions import mission
from gaitgraph.timing.joining import Course
from gaitgraph.timing.laws import LAWS
from gaitgraph.timing.timed_gait import ROW_BY_ROW, TimedGait
from gaitgraph.vehicle import four_of, linked

if TYPE_CHECKING:
    from gaitgraph.gait.given import GaitLike
    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.vehicle import Each, Vehicle


def biased_timed_gait(timed: TimedGait, bias: float) -> TimedGait:
    """Return the biased gait, equations (14) and (15), with the same times; InputError if η is not allowed."""
    if timed.law not in (*LAWS, ROW_BY_ROW):
        raise wrong("law", f"must be one of {', '.join(LAWS)} for a bias", timed.law)
    return timed.with_gait(timed.gait.biased(bias))


def repeated(timed: TimedGait, *, begin: float = 0.0) -> Course:
    """Return the course that repeats a gait, from a moment of its period on [s]."""
    return Course(
        sections=((0.0, begin, timed),),
        duration=np.inf,
        phases=("gait",),
    )


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
    lags, rates = four_of(lag), four_of(rate)
    arms = np.empty_like(command)
    for k, linkage in enumerate(vehicle.linkages):
        servo = command[:, k]
        servo_rate = rates[k]
        if linkage is not None:
            servo, _ = linked(linkage, servo, to_servo=True)
            servos, tilts = np.transpose(linkage)
            slopes = np.diff(tilts) / np.diff(servos)
            servo_rate = rates[k] / np.abs(slopes).min()
        servo = servo_response(servo[:, None], step, lag=lags[k], rate=servo_rate)[:, 0]
        if linkage is not None:
            servo, _ = linked(linkage, servo)
        arms[:, k] = servo
    return arms


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
    if not (np.abs(np.diff(angles, axis=0)) > most).any():
        return angles
    for servo, commands in zip(angles.T, command.T.tolist(), strict=True):
        angle = commands[0]
        for k, (before, target) in enumerate(pairwise(commands), start=1):
            unlimited = target - slope * (target - before) + keep * (angle - before)
            angle += min(max(unlimited - angle, -most), most)
            servo[k] = angle
    return angles


def from_hover(
    gait: GaitLike, *, periods: int = 2, anyway: bool = False
) -> Course | str:
    """Return the course of a mission, see :func:`gaitgraph.planning.missions.mission`; or why there is none.

    Examples
    --------
    >>> from gaitgraph.gait.gait import lift
    >>> gait = lift([(-0.4, 0.4), (-0.4, 1.2), (-1.2, 1.2), (-1.2, 0.4)], "red")
    >>> from_hover(gait.parametrize(1.0)).duration
    6.0
    >>> from_hover(lift([(1.2, -1.2), (1.2, -0.4), (0.4, -0.4)], "red").parametrize(1.0))[:40]
    'no flyable path from hover: R = +4 at th'
    """
    try:
        return mission(gait, periods=periods, anyway=anyway).course
    except Infeasible as error:
        return error.message
