"""The least period of a square loop, beside toppra: time, period and seam. Needs the extra ``peers``."""

from __future__ import annotations

import logging
from typing import Any

import numpy as np
import pytest

from gaitgraph.gait.gait import lift
from gaitgraph.timing.curve import rounded
from gaitgraph.timing.limits import Limits
from gaitgraph.timing.time_optimal import least_period
from tests.published import GAITS

toppra = pytest.importorskip("toppra")
algorithm = pytest.importorskip("toppra.algorithm")
constraint = pytest.importorskip("toppra.constraint")
logging.getLogger("toppra").setLevel(logging.ERROR)

NODES = 1000
LIMITS = Limits(rate=6.0, acceleration=60.0)
CURVE = rounded(lift(GAITS[2].angles, "red"), 0.03).curve
GROUP = (
    "least period of a square loop under rate and acceleration limits against toppra"
)


class Path(toppra.interpolator.AbstractGeometricPath):  # type: ignore[misc, name-defined]
    """The very same curve; its end is not taken for its beginning."""

    dof = 4
    waypoints = None
    path_interval = np.array([0.0, CURVE.span])

    def __call__(self, s: Any, order: int = 0) -> Any:
        return CURVE.at(np.minimum(s, CURVE.span * (1 - 1e-15)), order)


def by_toppra(seam: float) -> float:
    """Return the period that toppra finds with a given speed at both ends, infinite if it finds none."""
    limits = [
        constraint.JointVelocityConstraint(np.full(4, 6.0)),
        constraint.JointAccelerationConstraint(np.full(4, 60.0)),
    ]
    grid = np.linspace(0.0, CURVE.span, NODES + 1)
    _, speed, _ = algorithm.TOPPRA(
        limits, Path(), gridpoints=grid
    ).compute_parameterization(seam, seam)
    return (
        np.inf
        if speed is None
        else float((2 * np.diff(grid) / (speed[1:] + speed[:-1])).sum())
    )


def best_seam() -> float:
    """Return the largest speed at both ends with which toppra finds a law; it cannot look for one itself."""
    low, high = 0.0, 20.0
    for _ in range(20):
        middle = (low + high) / 2
        low, high = (middle, high) if np.isfinite(by_toppra(middle)) else (low, middle)
    return low


def ours() -> float:
    """Return the least period found; rounding, certificate and the law itself included."""
    least = least_period(CURVE, LIMITS, nodes=NODES).least
    assert least is not None
    return least


@pytest.mark.benchmark(group=GROUP)
def test_least_period_ours(benchmark: Any) -> None:
    period = benchmark.pedantic(ours, rounds=15, warmup_rounds=2)
    assert period <= 1.002 * by_toppra(best_seam())
    timed = least_period(CURVE, LIMITS, nodes=NODES).timed
    assert timed is not None
    for order in range(3):
        before, after = (
            timed.derivative(timed.period * (1 - 1e-12), order),
            timed.derivative(0.0, order),
        )
        np.testing.assert_allclose(
            before, after, atol=1e-5 * (1 + timed.peaks(order).max())
        )
    assert (timed.peak_rates <= 6.0 * (1 + 1e-9)).all()
    assert (timed.peak_accelerations <= 60.0 * (1 + 1e-9)).all()


@pytest.mark.benchmark(group=GROUP)
def test_least_period_toppra(benchmark: Any) -> None:
    period = benchmark.pedantic(
        by_toppra, args=(best_seam(),), rounds=15, warmup_rounds=2
    )
    assert np.isfinite(period)
