"""The fastest speed along a closed curve: passes over a grid, and linear programmes where jerk is limited too.

With b = ṡ², rates and accelerations q″b + q′s̈ are linear in b and s̈. For a constant s̈ on every interval of a grid they
are linear in the values of b at its two ends. Each row bounds the later value from above by an increasing function of
the earlier one (how much the motion can speed up), or the earlier by the later (how much it must have slowed down), or
both at once. Such a set is closed under taking the larger of two solutions point by point, so there is a largest
solution; it is the fastest at every point, and one pass forwards and one backwards from the narrowest point find it,
as in the plane-sweep proofs of Consolini et al. (Optimal time-complexity speed planning for robot manipulators, 2019).

For s̈ linear between nodes the jerk is √b·(q‴b + 3q″s̈ + q′·ds̈/ds), and its limit J reads |q‴b + 3q″s̈ + q′·ds̈/ds| ≤
J/√b. The right side is convex in b and lies above its tangents: with a tangent in its place the constraint is linear
and implies the true one. Programmes with tangents at the solution before improve step by step.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.timing.curve import bernstein_from_power, derivative_of, values_of
from gaitgraph.timing.timing_laws import TimingLaw, law_through_nodes

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from gaitgraph.timing.curve import Curve

FloatArray = npt.NDArray[np.float64]

_FEWEST = 8  # intervals on a piece of a curve
_GROWTH = 0.3  # of the distance between nodes, from one to the next
_CAP = 1e30
_PASSES = 100
_PROGRAMMES = 10
# Where the time 1/√b is replaced by tangents, as multiples of the solution before.
_TANGENTS = (0.5, 1.0, 1.6)
# Within what factors of the solution before b is looked for.
_LEAST, _MOST = 1e-2, 1e3


def nodes_along(curve: Curve, nodes: int) -> FloatArray:
    """Return nodes from 0 to the span, all breaks among them, evenly within pieces.

    Half of them are shared out by width, half by how much a piece bends, where the limits of the joints change. Beside
    a short piece they lie nearer, from one to the next by 30 %, since speeds change much there.
    """
    width = np.diff(curve.breaks)
    control = bernstein_from_power(derivative_of(curve.pieces, 2), width)
    bend = width * np.linalg.norm(control, axis=-1).max(axis=0)
    share = width / width.sum()
    if bend.sum() > 0:
        share = (share + bend / bend.sum()) / 2
    steps = width / np.maximum(np.ceil(nodes * share * (1 - 1e-12)), _FEWEST)
    at_break = np.minimum(steps, np.roll(steps, 1))
    parts = []
    for k, (whole, step) in enumerate(zip(width.tolist(), steps.tolist(), strict=True)):
        sides: list[list[float]] = []
        for nearest in (float(at_break[k]), float(at_break[(k + 1) % len(steps)])):
            size, covered = nearest, 0.0
            side: list[float] = []
            while size < step / (1 + _GROWTH) and covered + size < whole / 2:
                side.append(size)
                covered += size
                size *= 1 + _GROWTH
            sides.append(side)
        middle = whole - sum(sides[0]) - sum(sides[1])
        count = max(math.ceil(middle / step * (1 - 1e-12)), 1)
        sizes = [*sides[0], *[middle / count] * count, *reversed(sides[1])]
        parts.append(curve.breaks[k] + np.concatenate([[0.0], np.cumsum(sizes)[:-1]]))
    return np.concatenate([*parts, [curve.span]])


def fastest_squared_speeds(
    first: FloatArray, second: FloatArray, width: FloatArray, rate: FloatArray, acceleration: FloatArray
) -> FloatArray:
    """Return the largest b = ṡ² at every node of a closed grid, shape (n + 1,), the last equal to the first.

    `first` and `second` are q′ and q″ of each joint at the nodes, shape (n + 1, m), `width` the widths of the
    intervals, `rate` and `acceleration` the limits of each joint, shape (m,), positive; a rate may be infinite.

    The limits hold at both ends of every interval. A row whose two coefficients have the same sign, where q′ nearly
    vanishes (|q′| ≤ 2·width·|q″|), is replaced by the bound b ≤ limit/|q″| at both ends, which implies it and loses no
    more than one interval of speeding up. Where an interval admits no pair of values beyond some point, that point is a
    bound too; then the two passes leave no row broken.
    """
    # Each joint gives |p·b_k + q·b_{k+1}| ≤ limit at either end of an interval: b_{k+1} ≤ (limit + |p|·b_k)/|q| and
    # b_k ≤ (limit + |q|·b_{k+1})/|p| if p and q have opposite signs.
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
        # Where two rows of an interval meet: beyond that point they admit no pair of values.
        gain = up_slope[:, :, None] * down_slope[:, None, :]
        rest = 1.0 - gain
        later = np.where(rest > 0, (up_at[:, :, None] + up_slope[:, :, None] * down_at[:, None, :]) / rest, _CAP)
        earlier = np.where(rest > 0, (down_at[:, None, :] + down_slope[:, None, :] * up_at[:, :, None]) / rest, _CAP)
    bounds[:-1] = np.minimum(bounds[:-1], np.minimum(box, earlier.min(axis=(1, 2))))
    bounds[1:] = np.minimum(bounds[1:], np.minimum(box, later.min(axis=(1, 2))))
    bounds[[0, -1]] = min(bounds[0], bounds[-1])
    # Forwards and backwards once round, from the narrowest node on, until that node stays as it is.
    n = len(width)
    start = int(np.argmin(bounds[:-1]))
    order = [(start + k) % n for k in range(n)]
    b = bounds[:-1].tolist()
    ahead = list(zip(up_at.tolist(), up_slope.tolist(), strict=True))
    behind = list(zip(down_at.tolist(), down_slope.tolist(), strict=True))
    for _ in range(_PASSES):
        known = x = b[start]
        for k in order:
            (i0, i1, i2, i3), (s0, s1, s2, s3) = ahead[k]
            after = k + 1 - n
            x = min(b[after], i0 + s0 * x, i1 + s1 * x, i2 + s2 * x, i3 + s3 * x)
            b[after] = x
        x = b[start]
        for k in reversed(order):
            (i0, i1, i2, i3), (s0, s1, s2, s3) = behind[k]
            x = min(b[k], i0 + s0 * x, i1 + s1 * x, i2 + s2 * x, i3 + s3 * x)
            b[k] = x
        if b[start] >= known * (1 - 1e-13):
            break
    return np.array([*b, b[0]])


def laws_under_jerk(
    curve: Curve,
    s: FloatArray,
    start: FloatArray,
    limits: tuple[FloatArray, FloatArray, FloatArray],
    progress: Callable[[str], None] | None = None,
) -> Iterator[TimingLaw]:
    """Yield ever faster laws whose rates, accelerations and jerks keep the limits at nodes.

    The nodes `s`, shape (n + 1,), go from 0 to the span of the curve, all its breaks among them; `start` is ṡ² of some
    slower law there, shape (n,). The limits are rate, acceleration and jerk at the nodes, each of shape (n, 2); a rate
    may be infinite, and they may be changed in place between one law and the next.

    The laws are cubics of time between nodes, where limits may be exceeded a little: judge them. Nothing is yielded any
    more once a programme has no solution.
    """
    program = _Program(curve, s)
    b = start
    for k in range(_PROGRAMMES):
        if progress is not None:
            progress(f"programme {k + 1} of at most {_PROGRAMMES} under the jerk limit, {len(b)} nodes")
        found = program.solved(b, limits)
        if found is None:
            return
        b, rise = found
        law = law_through_nodes(s, rise, float(np.sqrt(b[0])))
        if law is None:
            return
        yield law


class _Program:
    """The linear programme in b, s̈ and a bound of 1/√b, at the nodes of a closed grid."""

    def __init__(self, curve: Curve, s: FloatArray) -> None:
        from scipy import sparse

        self.width, n = np.diff(s), len(s) - 1
        self.first, self.second = (curve.at(s[:-1], order)[:, :2] for order in (1, 2))
        piece = np.searchsorted(curve.breaks, (s[:-1] + s[1:]) / 2, side="right") - 1
        third = derivative_of(curve.pieces, 3)[:, piece]
        self.third = [values_of(third, side - curve.breaks[piece]) for side in (s[:-1], s[1:])]
        self.here = sparse.identity(n, format="csr")
        self.after = sparse.csr_matrix((np.ones(n), (np.arange(n), (np.arange(n) + 1) % n)), shape=(n, n))
        self.none = sparse.csr_matrix((n, n))
        # b grows by the trapezoidal integral of 2s̈.
        grown = sparse.diags(self.width) @ (self.here + self.after)
        self.grows: Any = sparse.csr_matrix(sparse.hstack([self.after - self.here, -grown, self.none]))

    def solved(
        self, b: FloatArray, limits: tuple[FloatArray, FloatArray, FloatArray]
    ) -> tuple[FloatArray, FloatArray] | None:
        """Return b and s̈ of the programme with tangents at `b`, or None if it has no solution."""
        from scipy import sparse
        from scipy.optimize import linprog

        n = len(b)
        rows, sides = self._rows(b, limits)
        around = (self.width + np.roll(self.width, 1)) / 2
        # Relative to the solution before, so that the solver's absolute tolerances mean the same everywhere.
        unit = sparse.diags(np.concatenate([b, b / around, b**-0.5]))
        above: Any = sparse.csr_matrix(sparse.diags(1.0 / np.abs(sides)) @ rows @ unit)
        equal: Any = sparse.csr_matrix(sparse.diags(1.0 / np.maximum(b, np.roll(b, -1))) @ self.grows @ unit)
        with np.errstate(divide="ignore"):
            fastest = np.minimum(((limits[0] / np.abs(self.first)) ** 2).min(axis=1) / b, _MOST)
        low = np.concatenate([np.full(n, _LEAST), np.full(n, -np.inf), np.zeros(n)])
        bounds: Any = np.column_stack([low, np.concatenate([fastest, np.full(2 * n, np.inf)])])
        time = around * b**-0.5
        cost = np.concatenate([np.zeros(2 * n), time / time.sum()])
        found = linprog(
            cost, A_ub=above, b_ub=np.sign(sides), A_eq=equal, b_eq=np.zeros(n), bounds=bounds, method="highs"
        )
        if found.x is None:
            return None
        return np.asarray(found.x[:n] * b), np.asarray(found.x[n : 2 * n] * b / around)

    def _rows(self, b: FloatArray, limits: tuple[FloatArray, FloatArray, FloatArray]) -> tuple[Any, FloatArray]:
        """Return the rows of the inequalities and their right sides."""
        from scipy import sparse

        diagonal, here, after, none = sparse.diags, self.here, self.after, self.none
        rows: list[Any] = []
        right: list[FloatArray] = []
        slope = diagonal(1.0 / self.width) @ (after - here)
        at_end = np.roll(np.arange(len(b)), -1)
        for joint in range(2):
            first, second = self.first[:, joint], self.second[:, joint]
            gained = sparse.hstack([diagonal(second), diagonal(first), none])
            rows += [gained, -gained]
            right += [limits[1][:, joint]] * 2
            for third, node, pick in ((self.third[0], slice(None), here), (self.third[1], at_end, after)):
                bends = 3.0 * diagonal(second[node]) @ pick + diagonal(first[node]) @ slope
                jerk = sparse.hstack([diagonal(third[:, joint]) @ pick, bends, none])
                limit, known = limits[2][node, joint], b[node]
                tangent = sparse.hstack([diagonal(0.5 * limit * known**-1.5) @ pick, none, none])
                rows += [jerk + tangent, tangent - jerk]
                right += [1.5 * limit * known**-0.5] * 2
        for share in _TANGENTS:
            at = share * b
            rows.append(sparse.hstack([diagonal(-0.5 * at**-1.5), none, -here]))
            right.append(-1.5 * at**-0.5)
        return sparse.vstack(rows), np.concatenate(right)
