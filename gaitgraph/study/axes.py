"""What one axis of a study may be: listed values, evenly spaced ones, or a range to draw from."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from gaitgraph.angles import HALF_PI, angle_from_text, number_of
from gaitgraph.errors import InputError, did_you_mean, shown

__all__ = ["Axis", "axis_of", "pitch_of", "real_of", "roll_of"]

MOST_VALUES = 100_000

Convert = Callable[[Any, str], Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Axis:
    """The values that one quantity takes in a study.

    Parameters
    ----------
    values
        Those listed, in their order; empty if `ends` are given.
    ends
        The range that a random sample is drawn from, uniformly.

    Examples
    --------
    >>> Axis(values=(0.8, 1.0)).drawn(0.6), Axis(ends=(1.0, 2.0)).drawn(0.6)
    (1.0, 1.6)
    """

    values: tuple[Any, ...] = ()
    ends: tuple[float, float] | None = None

    def __len__(self) -> int:
        return len(self.values)

    def drawn(self, share: float) -> Any:
        """Return the value that a number drawn from [0, 1) stands for."""
        if self.ends is None:
            return self.values[int(share * len(self.values))]
        low, high = self.ends
        return low + share * (high - low)

    @property
    def extremes(self) -> tuple[Any, ...]:
        """The values listed, or the ends of the range: what is checked before any case."""
        return self.values if self.ends is None else self.ends

    def as_mapping(self) -> Any:
        """Return the axis as plain values: a list, or a table of ``from`` and ``to``; read back by :func:`axis_of`."""
        if self.ends is None:
            return [list(value) if isinstance(value, tuple) else value for value in self.values]
        return {"from": self.ends[0], "to": self.ends[1]}


def axis_of(content: Any, name: str, convert: Convert, *, random: bool) -> Axis:
    """Return the axis that a study's entry describes.

    Parameters
    ----------
    content
        One value, a list of values, or a table of ``from``, ``to`` (both included) and ``count``.
    name
        What messages call the entry.
    convert
        Given a value and its name, returns what it means, or raises InputError.
    random
        Whether cases are drawn: a range without ``count`` is then one to draw from.

    Raises
    ------
    InputError
        If there is no value, one is given twice or not allowed, or a range is none.

    Examples
    --------
    >>> axis_of({"from": 0, "to": "pi/2", "count": 3}, "roll", roll_of, random=False).values
    (0.0, 0.7853981633974483, 1.5707963267948966)
    """
    if isinstance(content, dict):
        return _range_of(content, name, convert, random=random)
    listed = list(content) if isinstance(content, (list, tuple)) else [content]
    if not listed:
        raise InputError(f"{name}: [], which gives no case; allowed is at least one value")
    if len(listed) > MOST_VALUES:
        raise InputError(f"{name}: {len(listed)} values; allowed are {MOST_VALUES} at most")
    values = tuple(convert(value, name) for value in listed)
    seen: set[Any] = set()
    for value, told in zip(values, listed, strict=True):
        if value in seen:
            raise InputError(f"{name}: {shown(told)} is given twice; allowed are values that differ")
        seen.add(value)
    return Axis(values=values)


def _range_of(content: dict[str, Any], name: str, convert: Convert, *, random: bool) -> Axis:
    known = ["from", "to", "count"]
    for key in content:
        if key not in known:
            hint = did_you_mean(str(key), known)
            raise InputError(f"{name}.{key}: no part of a range{hint or '; allowed are from, to and count'}")
    ends = []
    for key in ("from", "to"):
        if key not in content:
            raise InputError(f"{name}.{key}: missing; allowed is a range of from and to, or a list")
        ends.append(convert(content[key], f"{name}.{key}"))
    low, high = ends
    if not all(isinstance(end, float) for end in ends):
        raise InputError(f"{name}: {shown(content)}; allowed is a list, since a range is of numbers")
    if not low < high:
        raise InputError(f"{name}: from {low!r} to {high!r}; allowed is a range that rises")
    count = content.get("count")
    if count is None:
        if not random:
            raise InputError(
                f"{name}.count: missing; allowed is a whole number from 2, or a random sample, which draws from ranges"
            )
        return Axis(ends=(low, high))
    if isinstance(count, bool) or not isinstance(count, int) or not 2 <= count <= MOST_VALUES:
        raise InputError(f"{name}.count: {shown(count)}; allowed is a whole number from 2 to {MOST_VALUES}")
    return Axis(values=(*(low + (high - low) * k / (count - 1) for k in range(count - 1)), high))


def roll_of(value: Any, name: str) -> float:
    """Return a roll angle [rad]; InputError unless it is at most half a turn."""
    angle = angle_from_text(value, name)
    if not abs(angle) <= math.pi:
        raise InputError(f"{name}: {shown(value)}; allowed is an angle from −π to π")
    return angle


def pitch_of(value: Any, name: str) -> float:
    """Return a pitch angle [rad]; InputError unless it is less than a quarter turn."""
    angle = angle_from_text(value, name)
    if not abs(angle) < HALF_PI:
        raise InputError(f"{name}: {shown(value)}; allowed is an angle between −π/2 and π/2")
    return angle


def real_of(low: float, high: float, unit: str, *, low_included: bool = True) -> Convert:
    """Return what reads a number from `low` to `high`."""

    def convert(value: Any, name: str) -> float:
        number = number_of(value)
        if not low <= number <= high or (number == low and not low_included):
            least = f"{low:g} or more" if low_included else f"more than {low:g}"
            raise InputError(f"{name}: {shown(value)}; allowed is {least} and {high:g} at most ({unit})")
        return number

    return convert
