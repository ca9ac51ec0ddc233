"""Mixed requests of many clients: the bytes of one thread, how long each takes, and what stays in memory."""

from __future__ import annotations

import json
import random
import resource
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import gaitgraph as gg

if TYPE_CHECKING:
    from collections.abc import Callable

LOOP = np.array([(-0.4, 0.4), (-0.4, 0.9), (-0.9, 0.9)])
OUTSIDE = [(1.2, 1.2), (-0.4, 0.4)]


def vehicle_of(chance: random.Random) -> gg.Vehicle:
    """Return a vehicle that no other request has."""
    return gg.Vehicle(drag_ratio=chance.uniform(0.05, 0.3), max_tilt=1.4)


def planned(chance: random.Random) -> Any:
    shift = [chance.uniform(-0.1, 0.1), chance.uniform(-0.1, 0.1)]
    return gg.plan_loop(LOOP + shift, vehicle=vehicle_of(chance)).as_dict()


def refused(chance: random.Random) -> Any:
    return gg.plan_loop(OUTSIDE, vehicle=vehicle_of(chance)).as_dict()


def along_a_border(chance: random.Random) -> Any:
    across = [(-0.2, 1.3), (-1.3, 1.3), (-1.3, 0.2)]
    return gg.plan_loop(across, vehicle=vehicle_of(chance)).as_dict()


def region(chance: random.Random) -> Any:
    return gg.admissible_region(vehicle_of(chance)).as_dict()


def gait_of(chance: random.Random) -> Any:
    corners = LOOP + chance.uniform(-0.1, 0.1)
    return gg.lift(corners, "red", vehicle=vehicle_of(chance)).parametrize(2.0)


def validated(chance: random.Random) -> Any:
    return gg.validate(gait_of(chance)).as_dict()


def flown_once(chance: random.Random) -> Any:
    return gg.mission(gait_of(chance), periods=2).alpha.tolist()


KINDS: list[Callable[[random.Random], Any]] = [
    planned,
    refused,
    along_a_border,
    region,
    validated,
    flown_once,
]


def answer(number: int) -> tuple[str, float, float]:
    """Return the answer of a request as JSON, and how long it took, by the clock and by its thread [s]."""
    kind = KINDS[number % len(KINDS)]
    start, worked = time.perf_counter(), time.thread_time()
    text = json.dumps(kind(random.Random(number)))
    return text, time.perf_counter() - start, time.thread_time() - worked


@pytest.mark.parametrize("count", [24, pytest.param(1000, marks=pytest.mark.slow)])
def test_sixteen_clients_get_the_bytes_of_one(count: int) -> None:
    with ThreadPoolExecutor(16) as clients:
        together = [text for text, _, _ in clients.map(answer, range(count))]
    alone = [answer(number)[0] for number in range(count)]
    assert together == alone
    assert len({*alone}) == count


def resident() -> float:
    """Return the memory that the process has now [MB]."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() / 1e6


@pytest.mark.slow
def test_memory_is_flat_over_new_vehicles() -> None:
    """From 2,000 plans to 4,000 as little is added as from 2,000 to 20,000: no more than noise."""
    marks = []
    for number in range(4_000):
        planned(random.Random(number))
        if number in (2_000, 3_999):
            marks.append(resident())
    assert marks[1] - marks[0] < 2, marks


def main() -> None:
    """Print how long mixed requests take, by percentiles [ms]."""
    timed = [answer(number)[1:] for number in range(1000)]
    for name, seconds in zip(("clock", "CPU"), zip(*timed, strict=True), strict=True):
        values = np.percentile(seconds, [50, 95, 99, 100]) * 1000
        print(name, *(f"{value:.0f}" for value in values))
    for k, kind in enumerate(KINDS):
        worked = np.array([spent for _, spent in timed[k :: len(KINDS)]]) * 1000
        print(f"{kind.__name__:15}", np.percentile(worked, [50, 99]).round(1))


if __name__ == "__main__":
    main()
