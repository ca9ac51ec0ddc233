"""What the explorer's server adds to a plan of eight waypoints: checks, series, scene, JSON, threads and guards.

Every round plans other waypoints, so that nothing kept from before answers. The aim for the server is 20 ms of
processor time; how fast the machine is at that moment shows in a fixed piece of work beside it.
"""

from __future__ import annotations

import asyncio
import json
import statistics
import time
from itertools import count
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import gaitgraph as gg
from tests.test_explorer import TOKEN, Client

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

LOOP = [(1.18, -1.18), (1.3, -0.8), (1.18, -0.39), (0.8, -0.3), (0.39, -0.39), (0.3, -0.7), (0.39, -1.18), (0.8, -1.3)]
GROUP = "a click in the explorer, server side, against plan_loop alone"
ROUNDS, WARM_UP = 40, 5
AIM = 20.0  # median [ms]
_number = count()


def waypoints() -> list[list[float]]:
    """Return the loop, moved by a little that no round before had."""
    shift = 1e-5 * next(_number)
    return [[a + shift, b - shift] for a, b in LOOP]


def body() -> bytes:
    return json.dumps({"waypoints": waypoints()}).encode()


@pytest.fixture
def ask() -> Iterator[Callable[[bytes], Any]]:
    """The server, without a socket: from the bytes of a question about a plan to its answer."""
    client, loop = Client(), asyncio.new_event_loop()

    def asked(content: bytes) -> Any:
        headers = {"content-type": "application/json"}
        return loop.run_until_complete(client.sent("POST", f"/{TOKEN}/api/plan", headers, [{"body": content}]))

    yield asked
    loop.close()


def fixed_work() -> None:
    """A thousand calls of numpy on small arrays, which is what most of a plan is made of."""
    points = np.linspace(0.1, 1.0, 32).reshape(8, 4)
    for _ in range(250):
        np.minimum(np.sin(points), np.cos(points)).sum(axis=1)


def processor_time(act: Callable[[], Any]) -> float:
    """Return the processor time that the whole process takes, its threads too [ms]."""
    start = time.process_time()
    act()
    return 1e3 * (time.process_time() - start)


def test_server_time(ask: Callable[[bytes], Any], capsys: pytest.CaptureFixture[str]) -> None:
    ours, fixed = [], []
    for number in range(WARM_UP + ROUNDS):
        content = body()
        taken, work = processor_time(lambda: ask(content)), processor_time(fixed_work)  # noqa: B023 - called at once
        if number >= WARM_UP:
            ours.append(taken)
            fixed.append(work)
    median, ratio = statistics.median(ours), statistics.median(a / b for a, b in zip(ours, fixed, strict=True))
    with capsys.disabled():
        print(
            f"\nserver, processor time of a plan of 8 waypoints: median {median:.1f} ms (aim: at most {AIM:.0f}), "
            f"{min(ours):.1f} to {max(ours):.1f}; a thousand small numpy calls beside it: "
            f"{statistics.median(fixed):.2f} ms; ratio {ratio:.1f}"
        )


@pytest.mark.benchmark(group=GROUP)
def test_plan_answer_ours(benchmark: Any, ask: Callable[[bytes], Any]) -> None:
    answer = benchmark.pedantic(ask, setup=lambda: ((body(),), {}), rounds=ROUNDS, warmup_rounds=WARM_UP)
    assert answer.json()["flyable"] is True


@pytest.mark.benchmark(group=GROUP)
def test_plan_loop_alone(benchmark: Any) -> None:
    plan = benchmark.pedantic(gg.plan_loop, setup=lambda: ((waypoints(),), {}), rounds=ROUNDS, warmup_rounds=WARM_UP)
    assert plan.report.flyable
