"""What the explorer's server adds to a plan of eight waypoints: checks, series, scene, JSON, threads and guards.

Every round plans other waypoints, so that nothing kept from before answers. The aim for the server is 20 ms.
"""

from __future__ import annotations

import asyncio
import json
from itertools import count
from typing import Any

import pytest

import gaitgraph as gg
from tests.test_explorer import PORT, TOKEN, answer_to

LOOP = [(1.18, -1.18), (1.3, -0.8), (1.18, -0.39), (0.8, -0.3), (0.39, -0.39), (0.3, -0.7), (0.39, -1.18), (0.8, -1.3)]
GROUP = "a click in the explorer, server side, against plan_loop alone"
_number = count()


def waypoints() -> list[list[float]]:
    """Return the loop, moved by a little that no round before had."""
    shift = 1e-5 * next(_number)
    return [[a + shift, b - shift] for a, b in LOOP]


@pytest.mark.benchmark(group=GROUP)
def test_plan_answer_ours(benchmark: Any) -> None:
    from gaitgraph.explorer.server import application

    app = application(TOKEN, PORT)
    headers = [("content-type", "application/json")]
    loop = asyncio.new_event_loop()

    def body() -> tuple[tuple[list[dict[str, Any]]], dict[str, Any]]:
        content = json.dumps({"waypoints": waypoints()}).encode()
        return ([{"type": "http.request", "body": content, "more_body": False}],), {}

    def ask(messages: list[dict[str, Any]]) -> Any:
        return loop.run_until_complete(answer_to(app, "POST", f"/{TOKEN}/api/plan", headers, messages))

    answer = benchmark.pedantic(ask, setup=body, rounds=40, warmup_rounds=5)
    loop.close()
    assert answer.json()["flyable"] is True


@pytest.mark.benchmark(group=GROUP)
def test_plan_loop_alone(benchmark: Any) -> None:
    plan = benchmark.pedantic(gg.plan_loop, setup=lambda: ((waypoints(),), {}), rounds=40, warmup_rounds=5)
    assert plan.report.flyable
