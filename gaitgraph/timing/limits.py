"""Limits of tilt rate, acceleration and jerk, for each joint; and what follows for those that are not stated."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import angle_from_text
from gaitgraph.errors import InputError, shown

if TYPE_CHECKING:
    from gaitgraph.vehicle import Vehicle

__all__ = ["KINDS", "UNITS", "Limits", "limits_for", "limits_of"]

FloatArray = npt.NDArray[np.float64]

KINDS = ("rate", "acceleration", "jerk")
"""What is limited, by order of the derivative."""

UNITS = {"rate": "rad/s", "acceleration": "rad/s²", "jerk": "rad/s³"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """Largest sizes of the derivatives of the tilt angles.

    Parameters
    ----------
    rate, acceleration, jerk
        One number for all four joints or one for each, radians per second (per second squared, cubed) or texts such
        as "200deg"; None where there is no limit. At least one of acceleration and jerk: with a rate limit alone the
        least period of a smooth law is not attained. Zero is allowed: then a joint must stand still.

    Raises
    ------
    InputError
        If a value is no number that is at least zero, or neither acceleration nor jerk is limited.

    Examples
    --------
    >>> Limits(rate="180deg", acceleration=40).rate.round(4).tolist()
    [3.1416, 3.1416, 3.1416, 3.1416]
    """

    rate: Any = None
    acceleration: Any = None
    jerk: Any = None

    def __post_init__(self) -> None:
        for name in KINDS:
            value = getattr(self, name)
            object.__setattr__(self, name, None if value is None else _four(name, value))
        if self.acceleration is None and self.jerk is None:
            raise InputError(
                "limits: neither acceleration nor jerk; allowed is at least one, since with a rate limit alone no "
                "smooth law is the fastest"
            )

    def of(self, kind: str) -> FloatArray | None:
        """Return the limits of one kind, shape (4,), or None."""
        value: FloatArray | None = getattr(self, kind)
        return value

    def in_plane(self, kind: str) -> FloatArray:
        """Return what a kind's limits are for α1 and α2, shape (2,): on a sheet the opposite joints move as much.

        Infinite where there is none.
        """
        value = self.of(kind)
        return np.full(2, np.inf) if value is None else np.minimum(value[:2], value[2:])

    def completed(self, extent: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return rate, acceleration and jerk limits of α1 and α2 with the finite ones that follow, each of shape (2,).

        Parameters
        ----------
        extent
            By how much α1 and α2 vary over the whole motion, shape (2,) [rad].

        Notes
        -----
        Landau's and Kolmogorov's inequalities bound the derivatives of a bounded motion by each other, with x within
        ±extent/2: |ẋ|² ≤ extent·|ẍ|, |ẍ|² ≤ 2|ẋ|·|x⃛| and |ẍ|³ ≤ (3/2)·extent·|x⃛|². So these are no further limits.
        """
        rate, acceleration, jerk = (self.in_plane(kind) for kind in KINDS)
        with np.errstate(invalid="ignore", over="ignore"):
            acceleration = np.minimum(acceleration, np.cbrt(1.5 * extent * jerk**2))
            acceleration = np.fmin(acceleration, np.sqrt(2.0 * rate * jerk))
            rate = np.minimum(rate, np.sqrt(extent * acceleration))
        return rate, acceleration, jerk

    def as_mapping(self) -> dict[str, Any]:
        """Return the limits as plain values: a number where all joints share it."""
        out: dict[str, Any] = {}
        for kind in KINDS:
            value = self.of(kind)
            if value is not None:
                out[kind] = float(value[0]) if np.ptp(value) == 0 else value.tolist()
        return out

    def slowest(self, extent: FloatArray) -> tuple[str, str]:
        """Return the stated limit that alone makes a motion of given extents take longest: its kind, and it in words.

        Parameters
        ----------
        extent
            By how much α1 and α2 vary, shape (2,) [rad]; what varies has a positive limit.
        """
        bounds, words = [], []
        for order, kind in enumerate(KINDS, start=1):
            limit = self.in_plane(kind)
            for joint in np.flatnonzero((extent > 0) & np.isfinite(limit)):
                # Least periods of a motion forth and back: 2d/v, 4√(d/a) and ∛(96·d/j).
                ratio = float(extent[joint] / limit[joint])
                bounds.append(((2.0, 16.0, 96.0)[order - 1] * ratio) ** (1.0 / order))
                words.append((kind, f"{kind} limit {limit[joint]:g} {UNITS[kind]} of α{joint + 1} and α{joint + 3}"))
        return words[bounds.index(max(bounds))]


def limits_of(vehicle: Vehicle, **stated: Any) -> Limits:
    """Return the limits that a vehicle states, those given by name in their place.

    >>> from gaitgraph.vehicle import PAPER
    >>> limits_of(PAPER.replace(max_tilt_rate=6.0), acceleration=60).as_mapping()
    {'rate': 6.0, 'acceleration': 60.0}
    """
    unknown = sorted(set(stated) - set(KINDS))
    if unknown:
        raise InputError(f"{unknown[0]}: no kind of limit; allowed are {', '.join(KINDS)}")
    of_vehicle = {
        "rate": vehicle.max_tilt_rate,
        "acceleration": vehicle.max_tilt_acceleration,
        "jerk": vehicle.max_tilt_jerk,
    }
    return Limits(**(of_vehicle | {kind: value for kind, value in stated.items() if value is not None}))


def limits_for(limits: object, vehicle: Vehicle) -> Limits:
    """Return the limits asked for, those of the vehicle where there are none; InputError if they are something else."""
    if limits is None:
        return limits_of(vehicle)
    if not isinstance(limits, Limits):
        raise InputError(f"limits: {shown(limits)}; allowed is a Limits object, as in Limits(rate=5, acceleration=60)")
    return limits


def _four(name: str, value: object) -> FloatArray:
    allowed = "a finite number ≥ 0 or four of them, or texts such as '200deg'"
    single = isinstance(value, str) or np.ndim(value) == 0  # type: ignore[arg-type]
    parts = [value] * 4 if single else list(value)  # type: ignore[call-overload]
    if len(parts) != 4:
        raise InputError(f"{name}: {shown(value)}; allowed is {allowed}")
    try:
        numbers = [angle_from_text(part, name) for part in parts]
    except InputError as error:
        raise InputError(f"{name}: {shown(value)}; allowed is {allowed} ({UNITS[name]})") from error
    if min(numbers) < 0 or not all(number == 0 or 1e-9 <= number <= 1e12 for number in numbers):
        raise InputError(f"{name}: {shown(value)}; allowed is 0, or 1e-9 to 1e12 ({UNITS[name]})")
    array = np.array(numbers)
    if not math.isfinite(array.sum()):
        raise InputError(f"{name}: {shown(value)}; allowed is {allowed}")
    array.flags.writeable = False
    return array
