"""The fastest law under a jerk limit too: a few linear programmes, each inside the true constraints.

With b = ṡ² and s̈ continuous and linear in s between nodes, rates and accelerations are linear in the values of b and s̈
at the nodes, and the jerk is √b·(q‴b + 3q″s̈ + q′·ds̈/ds). So the jerk limit J reads |q‴b + 3q″s̈ + q′·ds̈/ds| ≤ J/√b. Its
right side is convex in b and lies above its tangents: with a tangent in its place the constraint is linear and
implies the true one. Programmes with tangents at the solution before improve step by step.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.timing.path_laws import Law, law_through_nodes
from gaitgraph.timing.polynomials import derivative_of, values_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from gaitgraph.timing.curve import Curve

__all__ = ["laws_under_jerk"]

FloatArray = npt.NDArray[np.float64]

_ROUNDS = 10
# Where the time 1/√b is replaced by tangents, as multiples of the solution before.
_TANGENTS = (0.5, 1.0, 1.6)
# Within what factors of the solution before b is looked for.
_LEAST, _MOST = 1e-2, 1e3


def laws_under_jerk(
    curve: Curve,
    s: FloatArray,
    start: FloatArray,
    limits: tuple[FloatArray, FloatArray, FloatArray],
    progress: Callable[[str], None] | None = None,
) -> Iterator[Law]:
    """Yield ever faster laws whose rates, accelerations and jerks keep the limits at nodes.

    Parameters
    ----------
    curve
        The path.
    s
        Nodes from 0 to the span, among them all breaks, shape (n + 1,).
    start
        ṡ² of some slower law at the nodes, positive, shape (n,).
    limits
        Rate, acceleration and jerk at the nodes, each of shape (n, 2); a rate may be infinite. They may be changed in
        place between one law and the next.
    progress
        Called with a line of text before each programme.

    Notes
    -----
    The laws are cubics of time between nodes, where limits may be exceeded a little: judge them. Nothing is yielded
    any more once a programme has no solution.
    """
    program = _Program(curve, s)
    b = start
    for k in range(_ROUNDS):
        if progress is not None:
            progress(f"programme {k + 1} of at most {_ROUNDS} under the jerk limit, {len(b)} nodes")
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

        self.s, self.width, n = s, np.diff(s), len(s) - 1
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
        rows, right = self._rows(b, limits)
        around = (self.width + np.roll(self.width, 1)) / 2
        # Relative to the solution before, so that the solver's absolute tolerances mean the same everywhere.
        unit = sparse.diags(np.concatenate([b, b / around, b**-0.5]))
        sides = np.concatenate(right)
        above: Any = sparse.csr_matrix(sparse.diags(1.0 / np.abs(sides)) @ sparse.vstack(rows) @ unit)
        equal: Any = sparse.csr_matrix(sparse.diags(1.0 / np.maximum(b, np.roll(b, -1))) @ self.grows @ unit)
        with np.errstate(divide="ignore"):
            fastest = np.minimum(((limits[0] / np.abs(self.first)) ** 2).min(axis=1) / b, _MOST)
        low = np.concatenate([np.full(n, _LEAST), np.full(n, -np.inf), np.zeros(n)])
        bounds: Any = np.column_stack([low, np.concatenate([fastest, np.full(2 * n, np.inf)])])
        time = around * b**-0.5
        found = linprog(
            np.concatenate([np.zeros(2 * n), time / time.sum()]),
            A_ub=above,
            b_ub=np.sign(sides),
            A_eq=equal,
            b_eq=np.zeros(n),
            bounds=bounds,
            method="highs",
        )
        if found.x is None:
            return None
        return np.asarray(found.x[:n] * b), np.asarray(found.x[n : 2 * n] * b / around)

    def _rows(
        self, b: FloatArray, limits: tuple[FloatArray, FloatArray, FloatArray]
    ) -> tuple[list[Any], list[FloatArray]]:
        """Return the rows of the inequalities and their right sides."""
        from scipy import sparse

        diagonal, here, after = sparse.diags, self.here, self.after
        rows: list[Any] = []
        right: list[FloatArray] = []
        slope = diagonal(1.0 / self.width) @ (after - here)
        at_end = np.roll(np.arange(len(b)), -1)
        for joint in range(2):
            first, second = self.first[:, joint], self.second[:, joint]
            gained = sparse.hstack([diagonal(second), diagonal(first), self.none])
            rows += [gained, -gained]
            right += [limits[1][:, joint]] * 2
            for third, node, pick in ((self.third[0], slice(None), here), (self.third[1], at_end, after)):
                jerk = sparse.hstack(
                    [
                        diagonal(third[:, joint]) @ pick,
                        3.0 * diagonal(second[node]) @ pick + diagonal(first[node]) @ slope,
                        self.none,
                    ]
                )
                limit, known = limits[2][node, joint], b[node]
                tangent = sparse.hstack([diagonal(0.5 * limit * known**-1.5) @ pick, self.none, self.none])
                rows += [jerk + tangent, tangent - jerk]
                right += [1.5 * limit * known**-0.5] * 2
        for share in _TANGENTS:
            at = share * b
            rows.append(sparse.hstack([diagonal(-0.5 * at**-1.5), self.none, -here]))
            right.append(-1.5 * at**-0.5)
        return rows, right
