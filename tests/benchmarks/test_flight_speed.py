"""A second of flight at 1 kHz beside the engine alone, which steps the same model; a basin beside single flights."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gaitgraph.flight.basins import basins_of
from gaitgraph.flight.engine import Engine
from gaitgraph.flight.flight import OUTCOMES, FlightSettings
from gaitgraph.flight.simulation import fly
from gaitgraph.vehicle import PAPER
from tests.samples import RED

pytest.importorskip("mujoco")

ENGINE = "one second of flight at 1 kHz against mujoco alone"
BASIN = "a basin of 17 x 17 attitudes against fly from each for the whole duration"
SECOND = FlightSettings(duration=1.0)


def flight() -> Any:
    """Fly for one second: the check before take-off, all preparation and the record included."""
    return fly(RED, settings=SECOND)


@pytest.mark.benchmark(group=ENGINE)
def test_a_second_of_flight_ours(benchmark: Any) -> None:
    flown = benchmark.pedantic(flight, rounds=40, warmup_rounds=3)
    assert flown.settled
    assert len(flown.rows) == 1001


@pytest.mark.benchmark(group=ENGINE)
def test_a_thousand_steps_of_the_engine(benchmark: Any) -> None:
    engine = Engine(PAPER)
    step, model, data = engine.mujoco.mj_step, engine.model, engine.data

    def steps() -> None:
        engine.place(RED.at(0.0).alpha)
        for _ in range(1000):
            step(model, data)

    benchmark.pedantic(steps, rounds=40, warmup_rounds=3)
    assert np.isfinite(data.qpos).all()


@pytest.fixture(scope="module")
def basins() -> list[Any]:
    return []


@pytest.mark.benchmark(group=BASIN)
def test_a_basin_ours(benchmark: Any, basins: list[Any]) -> None:
    basins += benchmark.pedantic(
        basins_of, args=(RED,), kwargs={"bias": 1.0}, rounds=5, warmup_rounds=1
    )
    assert basins[0].outcome.shape == (1, 17, 17)


@pytest.mark.benchmark(group=BASIN)
def test_a_flight_from_each_attitude(benchmark: Any, basins: list[Any]) -> None:
    angles, settings = basins[0].angles.tolist(), basins[0].settings

    def flights() -> list[str]:
        return [
            fly(RED, attitude=(roll, pitch), settings=settings).outcome
            for roll in angles
            for pitch in angles
        ]

    found = benchmark.pedantic(flights, rounds=1)
    assert found == [OUTCOMES[code] for code in basins[0].outcome.flat]
