"""What tilt servos make of a command: a first-order lag whose rate is limited."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

__all__ = ["served"]

FloatArray = npt.NDArray[np.float64]


def served(command: FloatArray, step: float, *, lag: float = 0.0, rate: float = math.inf) -> FloatArray:
    """Return the angles of four servos that follow a command, beginning on it, shape (n, 4) [rad].

    Parameters
    ----------
    command
        What is asked for at even times, linear between them, shape (n, 4) [rad].
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
    >>> served(ramp, 0.1, rate=0.5)[-1].round(12).tolist()
    [0.5, 0.5, 0.5, 0.5]
    """
    out = np.array(command, dtype=float)
    if lag > 0.0:
        out = _lagging(out, step, lag)
    most = rate * step
    if not np.any(np.abs(np.diff(out, axis=0)) > most):
        return out
    # Step by step in plain numbers: what is reached depends on what was reached.
    keep = math.exp(-step / lag) if lag > 0.0 else 0.0
    slope = lag / step * (1.0 - keep) if lag > 0.0 else 1.0
    columns = []
    for asked in np.asarray(command, dtype=float).T.tolist():
        now, before = asked[0], asked[0]
        reached = [now]
        for target in asked[1:]:
            to = target - slope * (target - before) + keep * (now - before) if lag > 0.0 else target
            now += min(max(to - now, -most), most)
            before = target
            reached.append(now)
        columns.append(reached)
    return np.asarray(columns).T


def _lagging(command: FloatArray, step: float, lag: float) -> FloatArray:
    """Return the exact response of first-order lags to a piecewise linear command, beginning on it."""
    from scipy.signal import lfilter

    # The error e = command − angle obeys lag·ė = lag·(command's slope) − e, the slope constant within a step.
    keep = math.exp(-step / lag)
    gained = lag / step * (1.0 - keep) * np.diff(command, axis=0)
    error = lfilter([1.0], [1.0, -keep], gained, axis=0)
    out = command.copy()
    out[1:] -= error
    return np.asarray(out)
