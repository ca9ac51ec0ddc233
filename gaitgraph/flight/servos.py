"""Tilt servos in flight: the angles that they reach, with a first-order lag and a limited rate."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]


def servo_response(command: FloatArray, step: float, *, lag: float = 0.0, rate: float = math.inf) -> FloatArray:
    """Return the angles of four servos that follow a command and begin on it, shape (n, 4) [rad].

    Parameters
    ----------
    command
        Commanded angles at even times, linear between them, shape (n, 4) [rad].
    step
        Between two times [s].
    lag
        Time constant of the first-order lag [s]; 0 for none.
    rate
        Largest rate [rad/s].

    Notes
    -----
    Without a limit the response to the piecewise linear command is exact. Where the lag alone would ask for more than
    the rate, the servo moves at that rate for the whole step.

    Examples
    --------
    >>> ramp = np.linspace(0.0, 1.0, 11)[:, None] * np.ones(4)
    >>> servo_response(ramp, 0.1, rate=0.5)[-1].round(12).tolist()
    [0.5, 0.5, 0.5, 0.5]
    """
    command = np.asarray(command, dtype=float)
    angles = command.copy()
    keep, slope = 0.0, 1.0
    if lag > 0.0:
        from scipy.signal import lfilter

        # The error e = command − angle obeys lag·ė = lag·(command's slope) − e, the slope constant within a step.
        keep = math.exp(-step / lag)
        slope = lag / step * (1.0 - keep)
        angles[1:] -= lfilter([1.0], [1.0, -keep], slope * np.diff(command, axis=0), axis=0)
    most = rate * step
    if not np.any(np.abs(np.diff(angles, axis=0)) > most):
        return angles
    # With the limit each angle depends on the one before it: step by step, in plain numbers.
    columns = []
    for commanded in command.T.tolist():
        angle, before = commanded[0], commanded[0]
        reached = [angle]
        for target in commanded[1:]:
            unlimited = target - slope * (target - before) + keep * (angle - before) if lag > 0.0 else target
            angle += min(max(unlimited - angle, -most), most)
            before = target
            reached.append(angle)
        columns.append(reached)
    return np.asarray(columns).T
