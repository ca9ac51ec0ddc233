"""One joint: which rotor it turns, with which sign, zero and limits, and the unit that a table tells it in.

A joint turns one rotor about its arm. It stands at q = sign·α + zero [rad] when the rotor is tilted by α, and a table
tells q in radians, in degrees, or as the pulse width neutral + (µs per radian)·q that a servo takes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from gaitgraph.angles import angle_from_text, number_of
from gaitgraph.errors import InputError, did_you_mean, shown

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["UNITS", "Joint", "hint_at", "is_column_name"]

Unit = Literal["rad", "deg", "us"]

UNITS = ("rad", "deg", "us")
"""What a column may tell a joint in: radians, degrees, or pulse widths [µs]."""

_COLUMN_ENDS = {"rad": "", "deg": "_deg", "us": "_us"}
_NEUTRAL, _PULSES = 1500.0, (1000.0, 2000.0)
_LONGEST_PULSE = 1e6
_LONGEST_NAME = 64


@dataclass(frozen=True, slots=True, kw_only=True)
class Joint:
    """One joint: which rotor it turns, how, and the column that tells where it stands.

    Parameters
    ----------
    name
        What the vehicle calls it.
    rotor
        Which of the gait's rotors it turns, 1 to 4.
    column
        Its column in tables; by default the name, with ``_deg`` or ``_us`` for those units.
    unit
        "rad", "deg" or "us" (pulse width, µs).
    sign
        1 if it turns as α does, right-handed about the arm's outward axis, else −1.
    zero
        Where it stands while the rotor is upright [rad].
    limits
        Least and largest angle q [rad], for the units rad and deg; None for no limits.
    us_per_rad
        Pulse width per angle [µs/rad], for the unit us.
    neutral_us
        Pulse width at q = 0 [µs]; 1500 by default.
    limits_us
        Least and largest pulse width [µs]; 1000 and 2000 by default.

    Raises
    ------
    InputError
        If a value is not allowed, or one that the unit needs is missing.

    Examples
    --------
    >>> servo = Joint(name="servo1", rotor=2, unit="us", sign=-1, us_per_rad=600)
    >>> servo.column, servo.value_of(0.5), servo.tilt_of(1200.0)
    ('servo1_us', 1200.0, 0.5)
    """

    name: str
    rotor: int
    column: str = ""
    unit: Unit = "rad"
    sign: int = 1
    zero: float = 0.0
    limits: tuple[float, float] | None = None
    us_per_rad: float | None = None
    neutral_us: float | None = None
    limits_us: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        if not is_column_name(self.name):
            raise InputError(
                f"name: {shown(self.name)}; allowed is a printable text of 1 to {_LONGEST_NAME} characters"
            )
        if self.unit not in UNITS:
            raise self._refused("unit", f"allowed are {', '.join(UNITS)}{hint_at(self.unit, UNITS)}")
        for name, allowed in (("rotor", (1, 2, 3, 4)), ("sign", (1, -1))):
            number = number_of(getattr(self, name))
            if number not in allowed:
                raise self._refused(name, f"allowed are {', '.join(map(str, allowed))}".replace("-", "−"))
            object.__setattr__(self, name, int(number))
        object.__setattr__(self, "column", self.column or self.name + _COLUMN_ENDS[self.unit])
        if not is_column_name(self.column):
            raise self._refused("column", f"allowed is a printable text of up to {_LONGEST_NAME} characters")
        object.__setattr__(self, "zero", angle_from_text(self.zero, f"joint {self.name!r}: zero"))
        self._check_units()

    def _check_units(self) -> None:
        pulses = ("us_per_rad", "neutral_us", "limits_us")
        for name in ("limits",) if self.unit == "us" else pulses:
            if getattr(self, name) is not None:
                instead = "limits_us" if name == "limits" else f"the unit 'us', not {self.unit!r}"
                raise self._refused(name, f"allowed is {instead}")
        if self.unit != "us":
            if self.limits is not None:
                self._set_pair("limits", lambda value: angle_from_text(value, f"joint {self.name!r}: limits"), "rad")
            return
        if self.us_per_rad is None:
            raise InputError(f"joint {self.name!r}: us_per_rad is missing; allowed is a positive number (µs/rad)")
        slope = number_of(self.us_per_rad)
        if not 1e-3 <= slope <= 1e9:
            raise self._refused("us_per_rad", "allowed is 0.001 to 1e9 (µs/rad); sign = −1 turns the other way")
        object.__setattr__(self, "us_per_rad", slope)
        if self.limits_us is None:
            object.__setattr__(self, "limits_us", _PULSES)
        self._set_pair("limits_us", number_of, "µs")
        low, high = self.bounds
        if low < 0 or high > _LONGEST_PULSE:
            raise self._refused("limits_us", f"allowed are pulses of 0 to {_LONGEST_PULSE:g} µs")
        neutral = number_of(_NEUTRAL if self.neutral_us is None else self.neutral_us)
        if not low <= neutral <= high:
            raise self._refused("neutral_us", f"allowed is {low:g} to {high:g} µs, within limits_us")
        object.__setattr__(self, "neutral_us", neutral)

    def _set_pair(self, name: str, read: Any, unit: str) -> None:
        value = getattr(self, name)
        if not isinstance(value, (list, tuple)) or len(value) != 2:
            raise self._refused(name, f"allowed are the least and the largest ({unit})")
        low, high = map(read, value)
        if not low < high or not math.isfinite(low) or not math.isfinite(high):
            raise self._refused(name, f"allowed are the least and the largest ({unit}), in this order")
        object.__setattr__(self, name, (low, high))

    def _refused(self, name: str, allowed: str) -> InputError:
        return InputError(f"joint {self.name!r}: {name}: {shown(getattr(self, name))}; {allowed}")

    @property
    def per_radian(self) -> float:
        """Units of the column in one radian."""
        return {"rad": 1.0, "deg": math.degrees(1.0), "us": self.us_per_rad or 0.0}[self.unit]

    @property
    def bounds(self) -> tuple[float, float]:
        """The least and the largest value of its column, in its unit; infinite where there is no limit."""
        if self.unit == "us":
            return self.limits_us or _PULSES
        low, high = self.limits or (-math.inf, math.inf)
        return (math.degrees(low), math.degrees(high)) if self.unit == "deg" else (low, high)

    def value_of(self, alpha: Any) -> Any:
        """Return what the column says, in its unit, for tilt angles [rad], whatever the limits."""
        return self.value_of_angle(self.sign * alpha + self.zero)

    def value_of_angle(self, angle: Any) -> Any:
        """Return what the column says, in its unit, for angles q of the joint [rad]."""
        if self.unit == "us":
            return (self.neutral_us or 0.0) + (self.us_per_rad or 0.0) * angle
        return np.degrees(angle) if self.unit == "deg" else angle

    def angle_of(self, value: Any) -> Any:
        """Return the angle q [rad] of values of the column: the inverse of :meth:`value_of_angle`."""
        if self.unit == "us":
            return (value - (self.neutral_us or 0.0)) / (self.us_per_rad or 1.0)
        return np.radians(value) if self.unit == "deg" else value

    def tilt_of(self, value: Any) -> Any:
        """Return the tilt angle [rad] of values of the column: the inverse of :meth:`value_of`."""
        return self.sign * (self.angle_of(value) - self.zero)

    def as_mapping(self) -> dict[str, Any]:
        """Return what is stated of the joint as plain values."""
        stated = {one.name: getattr(self, one.name) for one in fields(self)}
        plain = {name: list(value) if isinstance(value, tuple) else value for name, value in stated.items()}
        return {name: value for name, value in plain.items() if value is not None}


def is_column_name(value: object) -> bool:
    """Return whether a value can name a joint or a column."""
    return isinstance(value, str) and bool(value.strip()) and value.isprintable() and len(value) <= _LONGEST_NAME


def hint_at(value: object, known: Sequence[str]) -> str:
    """Return what :func:`gaitgraph.errors.did_you_mean` does, and nothing for what is no text."""
    return did_you_mean(value, list(known)) if isinstance(value, str) else ""
