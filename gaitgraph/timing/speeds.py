"""The fastest speed along a closed path under rate and acceleration limits: passes over a lattice.

With b = ṡ² and a constant s̈ on every interval of a grid, rates and accelerations q″b + q′s̈ are linear in the values of
b at the two ends. Each row bounds the later value from above by an increasing function of the earlier one (how much
the motion can speed up), or the earlier by the later (how much it must have slowed down), or both at once. Such a set
is closed under taking the larger of two solutions point by point, so there is a largest solution; it is the fastest
at every point, and one pass forwards and one backwards from the narrowest point find it, as in the plane-sweep
proofs of Consolini et al. (Optimal time-complexity speed planning for robot manipulators, 2019).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

__all__ = ["fastest_squared_speeds"]

FloatArray = npt.NDArray[np.float64]

_CAP = 1e30
_ROUNDS = 100


def fastest_squared_speeds(
    first: FloatArray, second: FloatArray, width: FloatArray, rate: FloatArray, acceleration: FloatArray
) -> FloatArray:
    """Return the largest b = ṡ² at every node of a closed grid, shape (n + 1,), the last equal to the first.

    Parameters
    ----------
    first, second
        q′ and q″ of each joint at the nodes, shape (n + 1, m); the last node is the first again.
    width
        Widths of the intervals, shape (n,), positive.
    rate, acceleration
        Limits of each joint, shape (m,), positive; a rate may be infinite.

    Notes
    -----
    The limits hold at both ends of every interval. A row whose two coefficients have the same sign, where q′ nearly
    vanishes (|q′| ≤ 2·width·|q″|), is replaced by the bound b ≤ limit/|q″| at both ends, which implies it and loses no
    more than one interval of speeding up. Where an interval admits no pair of values beyond some point, that point is
    a bound too; then the two passes leave no row broken.
    """
    bounds, forward, backward = _rows(first, second, width, rate, acceleration)
    n = len(width)
    start = int(np.argmin(bounds[:-1]))
    order = [(start + k) % n for k in range(n)]
    b = bounds[:-1].tolist()
    up = list(zip(*(part.tolist() for part in forward), strict=True))
    down = list(zip(*(part.tolist() for part in backward), strict=True))
    for _ in range(_ROUNDS):
        known = x = b[start]
        for k in order:
            (i0, i1, i2, i3), (s0, s1, s2, s3) = up[k]
            after = k + 1 - n
            x = min(b[after], i0 + s0 * x, i1 + s1 * x, i2 + s2 * x, i3 + s3 * x)
            b[after] = x
        x = b[start]
        for k in reversed(order):
            (i0, i1, i2, i3), (s0, s1, s2, s3) = down[k]
            x = min(b[k], i0 + s0 * x, i1 + s1 * x, i2 + s2 * x, i3 + s3 * x)
            b[k] = x
        if b[start] >= known * (1 - 1e-13):
            break
    return np.array([*b, b[0]])


def _rows(
    first: FloatArray, second: FloatArray, width: FloatArray, rate: FloatArray, acceleration: FloatArray
) -> tuple[FloatArray, tuple[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]:
    """Return bounds at the nodes, and the intercepts and slopes of the rows forwards and backwards.

    Each joint gives |p·b_k + q·b_{k+1}| ≤ limit at either end of an interval: b_{k+1} ≤ (limit + |p|·b_k)/|q| and
    b_k ≤ (limit + |q|·b_{k+1})/|p| if p and q have opposite signs.
    """
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        bounds = np.minimum(((rate / np.abs(first)) ** 2).min(axis=1), _CAP)
        per = 0.5 / width[:, None]
        p = np.concatenate([second[:-1] - first[:-1] * per, -first[1:] * per], axis=1)
        q = np.concatenate([first[:-1] * per, second[1:] + first[1:] * per], axis=1)
        limit = np.tile(acceleration, 2)
        size_p, size_q = np.abs(p), np.abs(q)
        opposite = p * q <= 0
        up, down = opposite & (q != 0), opposite & (p != 0)
        up_at, up_slope = np.where(up, limit / size_q, _CAP), np.where(up, size_p / size_q, 0.0)
        down_at, down_slope = np.where(down, limit / size_p, _CAP), np.where(down, size_q / size_p, 0.0)
        box = np.where(p * q > 0, limit / np.abs(p + q), _CAP).min(axis=1)
        gain = up_slope[:, :, None] * down_slope[:, None, :]
        rest = 1.0 - gain
        later = np.where(rest > 0, (up_at[:, :, None] + up_slope[:, :, None] * down_at[:, None, :]) / rest, _CAP)
        earlier = np.where(rest > 0, (down_at[:, None, :] + down_slope[:, None, :] * up_at[:, :, None]) / rest, _CAP)
    bounds[:-1] = np.minimum(bounds[:-1], np.minimum(box, earlier.min(axis=(1, 2))))
    bounds[1:] = np.minimum(bounds[1:], np.minimum(box, later.min(axis=(1, 2))))
    bounds[[0, -1]] = min(bounds[0], bounds[-1])
    return bounds, (up_at, up_slope), (down_at, down_slope)
