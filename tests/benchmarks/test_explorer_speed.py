"""What the explorer's server adds to a plan of eight waypoints: checks, series, drawing, JSON, threads and guards.

Every round plans other waypoints, so that nothing kept from before answers. The aim for the server is 20 ms.
"""

from __future__ import annotations

import asyncio
import json
from itertools import count
from typing import TYPE_CHECKING, Any

import pytest

import gaitgraph as gg
from tests.test_explorer import TOKEN, Client

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

LOOP = [
    (1.18, -1.18),
    (1.3, -0.8),
    (1.18, -0.39),
    (0.8, -0.3),
    (0.39, -0.39),
    (0.3, -0.7),
    (0.39, -1.18),
    (0.8, -1.3),
]
GROUP = "a click in the explorer, server side, against plan_loop alone"
ROUNDS, WARM_UP = 40, 5
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
        return loop.run_until_complete(
            client.sent("POST", f"/{TOKEN}/api/plan", headers, [{"body": content}])
        )

    yield asked
    loop.close()


@pytest.mark.benchmark(group=GROUP)
def test_plan_answer_ours(benchmark: Any, ask: Callable[[bytes], Any]) -> None:
    status, _, answer = benchmark.pedantic(
        ask, setup=lambda: ((body(),), {}), rounds=ROUNDS, warmup_rounds=WARM_UP
    )
    assert (status, json.loads(answer)["flyable"]) == (200, True)


@pytest.mark.benchmark(group=GROUP)
def test_plan_loop_alone(benchmark: Any) -> None:
    plan = benchmark.pedantic(
        gg.plan_loop,
        setup=lambda: ((waypoints(),), {}),
        rounds=ROUNDS,
        warmup_rounds=WARM_UP,
    )
    assert plan.report.flyable
