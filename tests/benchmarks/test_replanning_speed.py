"""Planning again in flight: one request beside plan_loop on the same, and how long the slowest of many take.

``python -m tests.benchmarks.test_replanning_speed 100000`` prints the times of so many replans, refused ones too.
"""

from __future__ import annotations

import gc
import sys
import time
from itertools import count
from typing import Any

import numpy as np
import pytest

import gaitgraph as gg
from gaitgraph.planning import Replanner
from tests.samples import replan_requests

STOPS = [(-0.3, 0.2), (-0.3, 1.0), (-1.1, 1.0), (-1.1, 0.2)]
KEEP_OUTS = [
    [(-0.8, 0.9), (-0.6, 0.9), (-0.6, 1.1), (-0.8, 1.1)],
    [(-1.2, 0.5), (-1.0, 0.5), (-1.0, 0.7), (-1.2, 0.7)],
]
numbers = count()


@pytest.mark.benchmark(group="a new keep-out in flight against plan_loop")
@pytest.mark.parametrize("side", ["ours", "theirs"])
def test_a_keep_out_in_flight(benchmark: Any, side: str) -> None:
    replanner = Replanner("paper", sign="positive", rate=3.0)

    def planned() -> Any:
        if side == "ours":
            return replanner.replan([-0.3, 0.2] * 2, STOPS, keep_out=KEEP_OUTS)
        shift = 1e-9 * next(numbers)  # its region is not kept from the plan before
        moved = [[(x + shift, y) for x, y in polygon] for polygon in KEEP_OUTS]
        return gg.plan_loop(STOPS, color="red", sign="positive", keep_out=moved)

    assert benchmark.pedantic(planned, rounds=20, warmup_rounds=1)


def main(most: int) -> None:
    replanner = Replanner("paper", sign="negative", rate=3.0)
    gc.collect()
    gc.freeze()  # so that a full collection has little to look through
    taken = []
    refused = 0
    requests = replan_requests(replanner.region, np.random.default_rng(0), most)
    for alpha, stops, keep_out in requests:
        begin = time.perf_counter()
        answer = replanner.replan(alpha, stops, keep_out=keep_out)
        taken.append(1e3 * (time.perf_counter() - begin))
        refused += not answer
    print(f"{most} replans, {refused} refused, by percentiles (ms):")
    for share in (50, 99, 99.9, 100):
        print(f"{share} %: {np.percentile(taken, share):.3f}")


if __name__ == "__main__":
    main(int(sys.argv[1]))
