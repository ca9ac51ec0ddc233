"""What the explorer's server adds to a plan of eight waypoints: checks, series, drawing, JSON, threads and guards.

Every round plans other waypoints, so that nothing kept from before answers.
"""

from __future__ import annotations

import asyncio
import json
from itertools import count
from typing import Any

import pytest

import gaitgraph as gg
from tests.test_explorer import TOKEN, Client

LOOP = [(1.18, -1.18), (1.3, -0.8), (1.18, -0.39), (0.8, -0.3)]
LOOP += [(0.39, -0.39), (0.3, -0.7), (0.39, -1.18), (0.8, -1.3)]
numbers = count()


def moved() -> tuple[tuple[Any], dict[str, Any]]:
    """Return the arguments of a call: the loop, moved by a little that no round before had."""
    shift = 1e-5 * next(numbers)
    return ([[a + shift, b - shift] for a, b in LOOP],), {}


async def asked(client: Client, content: bytes) -> Any:
    headers = {"content-type": "application/json"}
    path = f"/{TOKEN}/api/plan"
    return await client.sent("POST", path, headers, [{"body": content}])


@pytest.mark.benchmark(group="a click in the explorer, server side, against plan_loop")
@pytest.mark.parametrize("side", ["ours", "theirs"])
def test_plan_answer(benchmark: Any, side: str) -> None:
    client, loop = Client(), asyncio.new_event_loop()

    def answered(stops: Any) -> Any:
        if side == "theirs":
            return gg.plan_loop(stops).report.flyable
        body = json.dumps({"waypoints": stops}).encode()
        answer = loop.run_until_complete(asked(client, body))
        return json.loads(answer[2])["flyable"]

    assert benchmark.pedantic(answered, setup=moved, rounds=40, warmup_rounds=5)
    loop.close()
