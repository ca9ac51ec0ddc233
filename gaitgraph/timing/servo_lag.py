"""Servo lag: the error between commanded and actual tilt angles of first-order servos.

Each servo obeys τ·dα/dt = α_commanded − α. Commands that are linear between even times, h apart, give the exact
recursion e(t + h) = d·e(t) + g·(α_c(t + h) − α_c(t)) of the error e = α_commanded − α, with d = exp(−h/τ) and
g = (1 − d)·τ/h. Under a periodic law the error settles to a periodic motion too: in the frequency domain each harmonic
of the commands is multiplied by the transfer function g·(z − 1)/(z − d).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import is_list, number_of
from gaitgraph.arrays import freeze_arrays, read_only
from gaitgraph.errors import wrong
from gaitgraph.invertibility.forms import FloatArray
from gaitgraph.invertibility.matrices import singular_value_rate
from gaitgraph.invertibility.segment_bounds import least_singular_value_along
from gaitgraph.records import Record
from gaitgraph.timing.timed_gait import TimedGait, timed_gait_of
from gaitgraph.tolerances import ROUND_OFF

if TYPE_CHECKING:
    from gaitgraph.gait.given import GaitLike

_STEPS = 256  # that the quickest servo's time constant is divided into, at least
_FEWEST, _MOST_STEPS = 1 << 14, 1 << 21  # of a period
_LONGEST = 1e6  # lag in periods; beyond it round-off is larger than the settled error


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ServoResponse(Record):
    """The settled motion of lagging servos under a timed gait.

    The error α_commanded − α_actual, shape (n + 1, 4) [rad], is given at the times `t`, shape (n + 1,) [s], from 0 to
    the period; its last row is the first.
    """

    timed: TimedGait  # the commands
    lag: FloatArray  # time constant of each servo, shape (4,) [s]
    t: FloatArray
    error: FloatArray
    slack: FloatArray  # how far each error may be from the straight line between two times, shape (4,) [rad]

    def __post_init__(self) -> None:
        freeze_arrays(self)

    def __repr__(self) -> str:
        return (
            f"<ServoResponse: error at most {self.peak.max():.3g} rad, {self.timed!r}>"
        )

    @property
    def actual(self) -> FloatArray:
        """The actual tilt angles at the times `t`, shape (n + 1, 4) [rad]."""
        return read_only(self.timed.at(self.t).alpha - self.error)

    @property
    def peak(self) -> FloatArray:
        """The largest |error| of each joint, shape (4,) [rad], a bound between the times `t` too."""
        return read_only(np.abs(self.error).max(axis=0) + self.slack)

    @property
    def peak_times(self) -> FloatArray:
        """When each joint's error is largest first, shape (4,) [s]."""
        size = np.abs(self.error)
        is_largest = size >= size.max(axis=0) - ROUND_OFF
        return read_only(self.t[is_largest.argmax(axis=0)])

    @property
    def rms(self) -> FloatArray:
        """The root mean square error of each joint, shape (4,) [rad]."""
        return read_only(np.sqrt((self.error[:-1] ** 2).mean(axis=0)))

    @property
    def distance_off_sheet(self) -> float | None:
        """The largest distance of the actual (α3, α4) from the sheet above the actual (α1, α2) [rad].

        It is zero where opposite servos have the same lag: then their errors are equal, on the blue sheet up to the
        sign. None for a gait that is not on one sheet.
        """
        if self.timed.gait.color not in ("red", "blue"):
            return None
        sign = -1.0 if self.timed.gait.color == "blue" else 1.0
        apart = np.abs(self.error[:, 2:] - sign * self.error[:, :2]).max(axis=0)
        between = apart + self.slack[2:] + self.slack[:2]
        return float(np.where(self.lag[2:] == self.lag[:2], 0.0, between).max())

    @property
    def least_singular_value(self) -> float:
        """A lower bound of the least singular value along the actual motion, between the times `t` too."""
        timed = self.timed
        vehicle = timed.gait.vehicle
        alpha = self.actual
        bounds = least_singular_value_along(
            alpha[:-1], alpha[1:], vehicle, tolerance=1e-5
        )
        # The actual acceleration is the commanded one averaged over the past, and it is (rate − error/lag)/lag.
        bend = np.minimum(2.0 * timed.peak_rates / self.lag, timed.peak_accelerations)
        step = self.t[1]
        off = bend * step**2 / 8.0 + 2.0 * _beside_commands(timed, step)
        lower = float(bounds.lower.min())
        return lower - singular_value_rate(vehicle) * float(np.linalg.norm(off))

    def as_mapping(self) -> dict[str, Any]:
        """Return it as plain values, ready for JSON."""
        lag = self.lag.tolist()
        if np.ptp(self.lag) == 0:
            lag = lag[0]
        return {
            "lag": lag,
            "peak_error": self.peak.tolist(),
            "peak_error_t": self.peak_times.tolist(),
            "rms_error": self.rms.tolist(),
            "distance_off_sheet": self.distance_off_sheet,
            "least_singular_value": self.least_singular_value,
        }

    def __str__(self) -> str:
        peak = self.peak
        worst = int(np.argmax(peak))
        off = ""
        if self.distance_off_sheet is not None:
            off = f"off the sheet by {self.distance_off_sheet:.2g} rad, "
        return (
            f"servo lag: error at most {peak[worst]:.4f} rad (α{worst + 1} at t = {self.peak_times[worst]:.3f} s), "
            f"rms {self.rms[worst]:.4f} rad; {off}least singular value {self.least_singular_value:.3f}"
        )


def servo_response(
    gait: GaitLike, lag: float | npt.ArrayLike | None = None
) -> ServoResponse:
    """Return the settled periodic response of first-order servos to a timed gait.

    Parameters
    ----------
    gait
        The commands: a timed gait, or a gait in any other form.
    lag
        Time constant, one for all servos or four [s]; the vehicle's `servo_lag` by default.

    Notes
    -----
    InputError if a lag is so short that a period takes millions of steps, or longer than a million periods;
    MissingConstant if there is none. No error exceeds the lag times the largest rate. Not modelled: saturation,
    backlash, load, delays.

    Examples
    --------
    >>> from gaitgraph.gait.gait import lift
    >>> timed = lift([(0.4, -0.4), (1.2, -0.4)], "red").parametrize(1.0)
    >>> response = servo_response(timed, 0.02)
    >>> response.distance_off_sheet, bool((response.peak <= 0.02 * timed.peak_rates + 1e-12)[0])
    (0.0, True)
    """
    timed = timed_gait_of(gait)
    if lag is None:
        (lag,) = timed.gait.vehicle.require(
            "servo_lag", purpose="the error of lagging servos"
        )
    parts: Any = lag if is_list(lag) else [lag] * 4
    tau = np.array([number_of(part) for part in parts])
    if tau.shape != (4,) or not ((tau > 0) & (tau < math.inf)).all():
        raise wrong("lag", "must be a positive finite number of seconds, or four", lag)
    wanted = _STEPS * timed.period / tau.min()
    if wanted > _MOST_STEPS or tau.max() > _LONGEST * timed.period:
        least = 1.001 * _STEPS * timed.period / _MOST_STEPS
        allowed = f"from {least:.4g} to {_LONGEST * timed.period:.4g} s"
        raise wrong(
            "lag", f"must be {allowed} for the period {timed.period:.4g} s", lag
        )
    count = 1 << math.ceil(math.log2(max(wanted, _FEWEST)))
    h = timed.period / count
    t: FloatArray = h * np.arange(count + 1, dtype=float)
    steps = np.diff(timed.at(t).alpha, axis=0)
    decay = np.exp(-h / tau)
    gain = -np.expm1(-h / tau) * tau / h
    z = np.exp(2j * math.pi * np.arange(count // 2 + 1) / count)[:, None]
    # A step leads to the time after it: one more factor z.
    spectrum = gain * z / (z - decay) * np.fft.rfft(steps, axis=0)
    after = np.fft.irfft(spectrum, count, axis=0)
    error = np.concatenate([after[-1:], after])
    inner = timed.peak_accelerations
    # Laws that turn corners at full speed have no acceleration between their knots.
    bend = np.where(np.isfinite(inner), inner, 0.0) + 2.0 * timed.peak_rates / tau
    slack = h**2 / 8.0 * bend + 2.0 * _beside_commands(timed, h)
    # No error exceeds the lag times the largest rate.
    most = np.maximum(tau * timed.peak_rates - np.abs(error).max(axis=0), 0.0)
    return ServoResponse(
        timed=timed, lag=tau, t=t, error=error, slack=np.minimum(slack, most)
    )


def _beside_commands(timed: TimedGait, step: float) -> FloatArray:
    """Return how far commands are at most from straight lines over steps [s], shape (4,) [rad]."""
    bent = timed.peak_accelerations * step**2 / 8.0
    turned = timed.peak_rates * step / 2.0  # where a corner is turned at full speed
    return np.minimum(bent, turned)
