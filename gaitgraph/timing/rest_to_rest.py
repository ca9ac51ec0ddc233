"""From rest to rest along straight segments: the fastest motion under limits, in closed form.

A path with a sharp corner has no smooth law that does not stop there. Along a straight segment the limits of the joints
become limits along it, and the fastest motion has seven phases at most: the acceleration rises to its limit at the
limit of jerk, stays, falls to zero, the speed stays, and the same the other way round.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from gaitgraph.timing.timing_laws import tilts_between

FloatArray = npt.NDArray[np.float64]

# Without a jerk limit the acceleration still takes this share of a segment's time to rise, so that it is continuous.
_RISE = 1e-3
# What takes less than this share of a segment's time is beyond what floats carry: the limits are lowered to it.
_BRIEF = 1e-6


def phases(distance: float, rate: float, acceleration: float, jerk: float) -> list[tuple[float, float, float]]:
    """Return the phases of the fastest motion over a distance from rest to rest: duration, s̈ at its start and its end.

    The limits are positive; the rate may be infinite, and so may the acceleration if the jerk is not. An infinite jerk
    is replaced by one that lets the acceleration rise in a thousandth of the time. Limits so loose that they would be
    met for less than a millionth of the time are lowered to what is met that long.

    >>> [round(sum(phase[0] for phase in phases(1.0, *limits)), 6) for limits in ((9, 99, 32.0), (1, 2, 4))]
    [1.0, 2.0]
    """
    if math.isinf(jerk):
        cruise = distance * acceleration >= rate**2
        total = distance / rate + rate / acceleration if cruise else 2.0 * math.sqrt(distance / acceleration)
        jerk = acceleration / (_RISE * total)
    slow = max(distance / rate, 2.0 * math.sqrt(distance / acceleration))
    acceleration = min(acceleration, rate / (_BRIEF * slow)) if slow > 0 else acceleration
    jerk = min(jerk, acceleration / (_BRIEF * slow)) if slow > 0 else jerk
    top = min(rate, (distance * math.sqrt(jerk) / 2.0) ** (2.0 / 3.0))
    if math.isfinite(acceleration) and top * jerk > acceleration**2:
        # The acceleration meets its limit, so that speeding up and slowing down over v takes v(v/a + a/j).
        rise = acceleration / jerk
        top = min(rate, acceleration * (math.sqrt(rise**2 + 4.0 * distance / acceleration) - rise) / 2.0)
    highest = min(acceleration, math.sqrt(top * jerk))
    ramp = highest / jerk
    hold, cruise_time = max(top / highest - ramp, 0.0), max(distance / top - top / highest - ramp, 0.0)
    up = [(ramp, 0.0, highest), (hold, highest, highest), (ramp, highest, 0.0)]
    down = [(ramp, 0.0, -highest), (hold, -highest, -highest), (ramp, -highest, 0.0)]
    out = [*up, (cruise_time, 0.0, 0.0), *down]
    whole = sum(duration for duration, _, _ in out)
    return [phase for phase in out if phase[0] > 1e-12 * whole]


def rest_to_rest(
    plane: FloatArray, rate: FloatArray, acceleration: FloatArray, jerk: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the law of a closed polyline that rests at every corner, as intervals of time and (α1, α2) on them.

    The corners have shape (n, 2), no two neighbours equal [rad]; the limits of α1 and α2 have shape (2,), infinite
    where there is none. What is returned is as in :func:`gaitgraph.timing.timing_laws.tilts_over_time`.
    """
    step = np.roll(plane, -1, axis=0) - plane
    lengths = np.linalg.norm(step, axis=1)
    widths, local, speed, rise, piece = [], [], [0.0], [], []
    for k, length in enumerate(lengths.tolist()):
        share = np.abs(step[k]) / length
        moving = share > 1e-12
        along = [float((limit[moving] / share[moving]).min()) for limit in (rate, acceleration, jerk)]
        s, v = 0.0, 0.0
        for h, a0, a1 in phases(length, *along):
            widths.append(h)
            local.append(s)
            piece.append(k)
            s += v * h + h**2 * (2 * a0 + a1) / 6
            v = max(v + h * (a0 + a1) / 2, 0.0)
            speed.append(v)
            rise.append(a0)
        speed[-1] = 0.0
    pieces = np.stack([step / lengths[:, None], plane])[:, piece]
    # The acceleration is continuous: at the end of a phase it is that at the start of the next.
    out = np.array(widths)
    return out, tilts_between(out, np.array(local), np.array(speed), np.array([*rise, 0.0]), pieces)
