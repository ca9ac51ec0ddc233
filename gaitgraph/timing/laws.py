"""Laws over any period: closed formulas of how a polyline is run.

A timing law maps time to position along the loop. Three need no limits:

* ``smooth`` (the default): time in proportion to length, each segment from rest to rest by the minimum-jerk
  polynomial 10τ³ − 15τ⁴ + 6τ⁵, so that rates and accelerations are continuous and zero at the corners;
* ``constant-speed``: the point moves along the four-dimensional curve at constant speed;
* ``equal-time``: every segment takes the same time, at constant speed within it.

The last two turn the corners at full speed: their accelerations are zero between corners and impulses at them,
which no table shows; the rates of a sample at a corner are those just after it.

A name in :data:`LAWS` is how these are told from every other motion, which states its own times.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from gaitgraph.invertibility.forms import FloatArray


class Law(NamedTuple):
    """A law over any period, the same on each segment, as functions of the share τ of the segment's time."""

    by_length: bool  # whether segments take time in proportion to their length; otherwise all take the same time
    motion: Callable[
        [FloatArray], tuple[FloatArray, FloatArray, FloatArray]
    ]  # share of the length, two derivatives
    peaks: tuple[
        float, float, float, float
    ]  # largest first to fourth derivative; infinite: an impulse at a corner


def _from_rest_to_rest(tau: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    return (
        tau**3 * (10 - 15 * tau + 6 * tau**2),
        30 * tau**2 * (1 - tau) ** 2,
        60 * tau * (1 - tau) * (1 - 2 * tau),
    )


def _evenly(tau: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    return tau, np.ones_like(tau), np.zeros_like(tau)


STRAIGHT = Law(
    by_length=True, motion=_evenly, peaks=(1.0, math.inf, math.inf, math.inf)
)  # rows with own times too
LAWS = {
    # The slope of the minimum-jerk polynomial is 15/8 at τ = 1/2; its slope is 10/√3 at most, that one's 60, its 360.
    "smooth": Law(
        by_length=True,
        motion=_from_rest_to_rest,
        peaks=(15.0 / 8.0, 10.0 / math.sqrt(3.0), 60.0, 360.0),
    ),
    "constant-speed": STRAIGHT,
    "equal-time": STRAIGHT._replace(by_length=False),
}
"""The laws over any period, by name."""

LawName = Literal["smooth", "constant-speed", "equal-time"]

DEFAULT_LAW: LawName = "smooth"
