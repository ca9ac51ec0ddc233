"""A second of flight at 1 kHz, beside the engine alone that steps the same model."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gaitgraph.flight.engine import Engine
from gaitgraph.flight.flight import FlightSettings
from gaitgraph.flight.simulation import fly
from gaitgraph.vehicle import PAPER
from tests.samples import RED

pytest.importorskip("mujoco")

ENGINE = "one second of flight at 1 kHz against mujoco alone"
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
        engine.place(RED.at(0.0)[0])
        for _ in range(1000):
            step(model, data)

    benchmark.pedantic(steps, rounds=40, warmup_rounds=3)
    assert np.isfinite(data.qpos).all()
