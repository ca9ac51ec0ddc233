"""Mixed requests of many clients: the bytes of one thread, and what stays in memory."""

from __future__ import annotations

import json
import random
import resource
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


def answer(number: int) -> str:
    """Return the answer of a request as JSON."""
    kind = KINDS[number % len(KINDS)]
    return json.dumps(kind(random.Random(number)))


@pytest.mark.parametrize("count", [24, pytest.param(1000, marks=pytest.mark.slow)])
def test_sixteen_clients_get_the_bytes_of_one(count: int) -> None:
    with ThreadPoolExecutor(16) as clients:
        together = [*clients.map(answer, range(count))]
    assert together == [answer(number) for number in range(count)]
    assert len({*together}) == count


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
