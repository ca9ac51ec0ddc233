"""A study of 200 flights on two worker processes, against one; starting them and certifying the gaits included."""

from __future__ import annotations

import os
from itertools import count
from typing import TYPE_CHECKING, Any

import pytest

from gaitgraph.study.running import run_study

if TYPE_CHECKING:
    from pathlib import Path

pytest.importorskip("distributed", reason="install distributed")

GROUP = "a study of 200 flights on two workers against one"
STUDY = {
    "name": "200 flights",
    "gaits": ["gait3", "gait4"],
    "attitudes": {
        "roll": {"from": -0.5, "to": 0.5, "count": 10},
        "pitch": {"from": -0.5, "to": 0.5, "count": 10},
    },
    "flight": {"duration": 5.0},  # long beside the seconds in which workers start
}


def flown(folder: Path, workers: int, numbers: Any) -> int:
    return run_study(STUDY, folder / str(next(numbers)), workers=workers).flown


@pytest.mark.benchmark(group=GROUP)
@pytest.mark.parametrize(
    "workers", [pytest.param(2, id="ours"), pytest.param(1, id="theirs")]
)
def test_200_flights(benchmark: Any, tmp_path: Path, workers: int) -> None:
    if (os.cpu_count() or 1) < 2:
        pytest.skip("two workers need two cores")
    assert benchmark.pedantic(flown, args=(tmp_path, workers, count()), rounds=3) == 200
