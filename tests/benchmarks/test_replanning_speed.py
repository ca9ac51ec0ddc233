"""Planning again in flight: one request beside plan_loop on the same, and how long the slowest of many take.

``python -m tests.benchmarks.test_replanning_speed 100000`` prints the times of so many replans, refused ones too.
"""

from __future__ import annotations

import gc
import sys
import time
from typing import Any

import numpy as np
import pytest

import gaitgraph as gg
from gaitgraph.planning import Replanner
from tests.samples import replan_requests

GROUP = "a new keep-out in flight against plan_loop on the same request"
STOPS = [(-0.3, 0.2), (-0.3, 1.0), (-1.1, 1.0), (-1.1, 0.2)]
KEEP_OUTS = [
    [(-0.8, 0.9), (-0.6, 0.9), (-0.6, 1.1), (-0.8, 1.1)],
    [(-1.2, 0.5), (-1.0, 0.5), (-1.0, 0.7), (-1.2, 0.7)],
]


def milliseconds(count: int, seed: int = 0) -> tuple[np.ndarray[Any, Any], int]:
    """Return how long random requests take, one after the other, and how many are refused."""
    replanner = Replanner("paper", sign="negative", rate=3.0)
    gc.collect()
    gc.freeze()  # so that a full collection has little to look through
    taken, refused = np.empty(count), 0
    for k, (alpha, stops, keep_out) in enumerate(
        replan_requests(replanner.region, np.random.default_rng(seed), count)
    ):
        begin = time.perf_counter()
        found = replanner.replan(alpha, stops, keep_out=keep_out)
        taken[k] = 1e3 * (time.perf_counter() - begin)
        refused += not found
        assert found.reason or found.least_singular_value >= replanner.floor
    gc.unfreeze()
    return taken, refused


@pytest.mark.benchmark(group=GROUP)
def test_a_keep_out_in_flight_ours(benchmark: Any) -> None:
    replanner = Replanner("paper", sign="positive", rate=3.0)
    found = benchmark(
        replanner.replan, [-0.3, 0.2, -0.3, 0.2], STOPS, keep_out=KEEP_OUTS
    )
    assert len(found.loop) == 8
    taken, refused = milliseconds(2000)
    least, most = np.percentile(taken, [50, 99.9])
    benchmark.extra_info["2000 random requests"] = (
        f"median {least:.2f} ms, 99.9 % {most:.2f} ms, {refused} refused"
    )


@pytest.mark.benchmark(group=GROUP)
def test_a_keep_out_by_plan_loop(benchmark: Any) -> None:
    moved = iter(range(10**9))

    def plan() -> (
        gg.Plan
    ):  # a keep-out that is new: its region is not kept from the plan before
        shift = 1e-9 * next(moved)
        return gg.plan_loop(
            STOPS,
            color="red",
            sign="positive",
            keep_out=[[(x + shift, y) for x, y in one] for one in KEEP_OUTS],
        )

    assert benchmark.pedantic(plan, rounds=20, warmup_rounds=1)


if __name__ == "__main__":
    times, refusals = milliseconds(int(sys.argv[1]))
    names = ("median", "99 %", "99.9 %", "largest")
    parts = [
        f"{name} {value:.3f} ms"
        for name, value in zip(
            names, np.percentile(times, [50, 99, 99.9, 100]), strict=True
        )
    ]
    print(f"{len(times)} replans, {refusals} refused: {', '.join(parts)}")
