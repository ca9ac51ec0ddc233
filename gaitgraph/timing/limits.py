"""Limits: the largest rates, accelerations and jerks of the tilt angles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitgraph.angles import angle_from_text, figure, is_list, number_of
from gaitgraph.arrays import freeze_arrays, read_only
from gaitgraph.errors import Advice, InputError, wrong
from gaitgraph.gait.table import RATE_UNITS
from gaitgraph.invertibility.forms import FloatArray
from gaitgraph.records import Record
from gaitgraph.vehicle import four_of

if TYPE_CHECKING:
    from gaitgraph.vehicle import Each, Vehicle

Limit = float | str | Sequence[float | str] | FloatArray | None


@dataclass(frozen=True, slots=True, kw_only=True, init=False, eq=False)
class Limits(Record):
    """Largest sizes of the derivatives of the tilt angles.

    Parameters
    ----------
    rate, acceleration, jerk
        One number for all four joints or one for each, radians per second (per second squared, cubed) or texts such
        as "200deg"; None for no limit, zero for a joint that must stand still. Acceleration or jerk must be limited:
        under a rate limit alone there is no fastest smooth law.

    Examples
    --------
    >>> Limits(rate="180deg", acceleration=40).rate.round(4).tolist()
    [3.1416, 3.1416, 3.1416, 3.1416]
    """

    rate: FloatArray | None
    acceleration: FloatArray | None
    jerk: FloatArray | None

    def __init__(
        self, *, rate: Limit = None, acceleration: Limit = None, jerk: Limit = None
    ) -> None:
        if acceleration is None and jerk is None:
            raise _without_acceleration(rate, None)
        limits = (rate, acceleration, jerk)
        for kind, limit in zip(RATE_UNITS, limits, strict=True):
            # The record is frozen.
            object.__setattr__(self, kind, _four_limits(kind, limit))
        freeze_arrays(self)

    def __repr__(self) -> str:
        limits = ", ".join(f"{kind}={four.tolist()}" for kind, four in self._stated)
        return f"Limits({limits})"

    @property
    def _stated(self) -> list[tuple[str, FloatArray]]:
        """The limits that there are, each with its kind."""
        limits = [(kind, getattr(self, kind)) for kind in RATE_UNITS]
        return [(kind, four) for kind, four in limits if four is not None]

    def of_joints(self, count: int) -> FloatArray:
        """Return rate, acceleration and jerk limits of α1 and α2, shape (3, 2), or of four joints, infinite for none.

        Of two, opposite joints move by as much, so the lower of their limits counts.
        """
        rows = dict.fromkeys(RATE_UNITS, np.full(4, np.inf)) | dict(self._stated)
        limits = np.array([*rows.values()])
        return read_only(limits.reshape(3, -1, count).min(axis=1))

    def completed(self, extent: FloatArray) -> FloatArray:
        """Return the limits of two or four joints, completed by those that follow from them, shape (3, 2) or (3, 4).

        Landau's and Kolmogorov's inequalities relate the derivatives of a bounded motion, with x within ±extent/2:
        |ẋ|² ≤ extent·|ẍ|, |ẍ|² ≤ 2|ẋ|·|x⃛| and |ẍ|³ ≤ (3/2)·extent·|x⃛|². The extent is the range of each joint over
        the whole motion, shape (2,) or (4,) [rad].
        """
        rate, acceleration, jerk = self.of_joints(len(extent))
        with np.errstate(invalid="ignore", over="ignore"):
            acceleration = np.minimum(acceleration, np.cbrt(1.5 * extent * jerk**2))
            acceleration = np.fmin(acceleration, np.sqrt(2.0 * rate * jerk))
            rate = np.minimum(rate, np.sqrt(extent * acceleration))
        return np.stack([rate, acceleration, jerk])

    def as_mapping(self) -> dict[str, Any]:
        """Return the limits as plain values: a number where all joints share it."""
        mapping: dict[str, Any] = {}
        for kind, four in self._stated:
            mapping[kind] = four.tolist()
            if np.ptp(four) == 0:
                mapping[kind] = float(four[0])
        return mapping


def _four_limits(kind: str, limit: Limit) -> FloatArray | None:
    """Return the limits of the four joints; InputError if they are none."""
    if limit is None:
        return None
    parts: Any = limit if is_list(limit) else [limit] * 4
    try:
        four = np.array([angle_from_text(part, kind) for part in parts])
    except InputError:
        four = np.array([np.nan])
    allowed = (four == 0) | ((four >= 1e-9) & (four <= 1e12))
    if four.shape != (4,) or not allowed.all():
        rule = f"0, or 1e-9 to 1e12 {RATE_UNITS[kind]}, or four such numbers, or texts such as '200deg'"
        raise wrong(kind, f"must be {rule}", limit)
    return four


def limits_of(
    vehicle: Vehicle,
    made_for: Mapping[str, Limit] | None = None,
    **given: Limit,
) -> Limits:
    """Return the limits of a vehicle; limits that are `given` by the names of :class:`Limits` replace them.

    Where the vehicle states none those count that a table was `made_for`. Without a limit of acceleration or jerk the
    error proposes the rate over the servo lag of the vehicle [s].
    """
    limits: dict[str, Limit] = dict(made_for or {})
    for kind in RATE_UNITS:
        for limit in (getattr(vehicle, f"max_tilt_{kind}"), given.get(kind)):
            if limit is not None:
                limits[kind] = limit
    if "acceleration" not in limits and "jerk" not in limits:
        raise _without_acceleration(limits.get("rate"), vehicle.servo_lag)
    return Limits(**limits)


def _without_acceleration(rate: Limit, servo_lag: Each | None) -> InputError:
    """Return the error of limits without an acceleration; it proposes the rate over the slowest servo's time constant."""
    lags = np.array([number_of(lag) for lag in four_of(servo_lag)])
    rates = Limits(rate=rate, acceleration=1.0).rate
    stated = "state max_tilt_acceleration in the vehicle, or use"
    unknown = "if it is not known, take the rate over the servo's time constant"
    advice = Advice(
        f"{stated} Limits(acceleration=…); {unknown} (rate over servo_lag)",
        f"{stated} --max-acceleration; {unknown} (--max-rate over servo_lag)",
    )
    if rates is not None and (rates > 0).all() and (lags > 0).all():
        joint = int(np.argmin(rates / lags))
        quotient = f"{figure(rates[joint])} rad/s over {lags[joint]:g} s"
        proposed = f"{rates[joint] / lags[joint]:.3g}"
        advice = Advice(
            f"{stated} Limits(acceleration=…); {unknown}: {quotient}, acceleration={proposed}",
            f"{stated} --max-acceleration; {unknown}: {quotient}, --max-acceleration {proposed}",
        )
    return InputError(
        "limits must have an acceleration or a jerk, got neither",
        field="limits",
        advice=advice,
    )
