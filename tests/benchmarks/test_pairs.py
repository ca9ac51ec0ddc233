"""Pairs of what is compared, whose ratio of medians counts; run by ``python -m pytest tests/benchmarks``."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pytest

import gaitgraph as gg
from gaitgraph.flight.engine import Engine
from gaitgraph.flight.flight import FlightSettings
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.invertibility.matrices import determinant
from gaitgraph.robustness.attitudes import acceptable_attitudes
from tests.published import GAITS
from tests.samples import RED

if TYPE_CHECKING:
    from collections.abc import Callable

REQUEST = str(Path(__file__).parents[2] / "examples" / "gait3.toml")
AXIS = np.linspace(-np.pi / 2, np.pi / 2, 1025)
EXACT = coefficients_of(kind="exact")
GAIT3 = gg.lift(GAITS[2].angles, "red")
SAMPLES = GAIT3.biased(0.8).parametrize(law="constant-speed", samples=1000).alpha[:-1]
LOW, HIGH = (0.393, -1.178), (1.178, -0.393)
PACKAGES = "numpy, scipy.sparse.csgraph, networkx, shapely"


class Side(NamedTuple):
    """One of the two that are compared: what runs, how many items it works on, and how often."""

    run: Callable[[], Any]
    items: int = 1
    rounds: int = 15


def command(arguments: list[str], names: str) -> tuple[Side, Side]:
    """Compare the installed command with a process that imports other packages, both compiled before."""
    script = shutil.which("gaitgraph", path=str(Path(sys.executable).parent))
    assert script is not None
    ours = [script, *arguments]
    theirs = [sys.executable, "-c", f"import {names}"]
    environment = os.environ | {"PYTHONDONTWRITEBYTECODE": ""}
    run = partial(subprocess.run, check=True, capture_output=True, env=environment)
    return Side(partial(run, ours)), Side(partial(run, theirs))


def roots() -> tuple[Side, Side]:
    values = np.random.default_rng(0).uniform(-2, 2, AXIS.size**2)
    ours = Side(lambda: gg.surface.root_arrays(AXIS[:, None], AXIS))
    return ours, Side(lambda: np.sin(values))


def attitudes() -> tuple[Side, Side]:
    """A thousand samples, the path between them and the error included; a raster of a million for five samples."""
    axis = np.linspace(-np.pi / 2, np.pi / 2, 1001)
    roll, pitch = np.meshgrid(axis, axis, indexing="ij", sparse=True)

    def raster() -> None:
        for alpha in SAMPLES[::200]:
            determinant(alpha, EXACT, roll, pitch)

    ours = Side(lambda: acceptable_attitudes(SAMPLES, EXACT), len(SAMPLES), 7)
    return ours, Side(raster, 5, 3)


def robustness() -> tuple[Side, Side]:
    rows = np.random.default_rng(7).uniform(LOW * 2, HIGH * 2, (10_000, 4))
    table = {f"alpha{k + 1}": column for k, column in enumerate(rows.T)}
    ours = Side(lambda: gg.robustness_of(table), rounds=5)
    return ours, Side(lambda: gg.validate(table), rounds=5)


def flight() -> tuple[Side, Side]:
    """A second of flight, with the check before take-off, all preparation and the record; the engine's steps alone."""
    engine = Engine(gg.PAPER)

    def steps() -> None:
        engine.place(RED.at(0.0).alpha)
        for _ in range(1000):
            engine.mujoco.mj_step(engine.model, engine.data)

    second = FlightSettings(duration=1.0)
    return Side(lambda: gg.fly(RED, settings=second), rounds=40), Side(steps, rounds=40)


def basin() -> tuple[Side, Side]:
    first = gg.basins_of(RED, bias=1.0)[0]

    def flights() -> None:
        for roll in first.angles.tolist():
            for pitch in first.angles.tolist():
                gg.fly(RED, attitude=(roll, pitch), settings=first.settings)

    ours = Side(lambda: gg.basins_of(RED, bias=1.0), rounds=5)
    return ours, Side(flights, rounds=1)


def least_period() -> tuple[Side, Side]:
    """The very same curve; rounding, certificate and the law itself included in ours."""
    toppra: Any = pytest.importorskip("toppra", reason="install gaitgraph[peers]")
    curve = gg.timing.rounded(GAIT3, 0.03).curve
    limits = gg.Limits(rate=6.0, acceleration=60.0)
    grid = np.linspace(0.0, curve.span, 1001)
    velocity = toppra.constraint.JointVelocityConstraint(np.full(4, 6.0))
    acceleration = toppra.constraint.JointAccelerationConstraint(np.full(4, 60.0))

    class Course(toppra.interpolator.AbstractGeometricPath):  # type: ignore[misc]
        dof = 4
        waypoints = None
        path_interval = grid[[0, -1]]

        def __call__(self, s: Any, order: int = 0) -> Any:
            # Its end is not taken for its beginning.
            return curve.at(np.minimum(s, curve.span * (1 - 1e-15)), order)

    def theirs() -> None:
        law = toppra.algorithm.TOPPRA(
            [velocity, acceleration], Course(), gridpoints=grid
        )
        law.compute_parameterization(0.0, 0.0)

    return Side(lambda: gg.least_period(curve, limits, nodes=1000)), Side(theirs)


PAIRS: dict[str, Callable[[], tuple[Side, Side]]] = {
    "plan as a process": partial(command, ["plan", REQUEST], PACKAGES),
    "--help as a process": partial(command, ["--help"], "click"),
    "roots on a 1025 x 1025 grid against numpy.sin": roots,
    "acceptable attitudes per sample against a raster of formula (1)": attitudes,
    "robustness of 10,000 random rows against validate": robustness,
    "one second of flight at 1 kHz against mujoco alone": flight,
    "a basin of 17 x 17 attitudes against fly from each for the whole duration": basin,
    "least period of a square loop against toppra": least_period,
}


@pytest.fixture(scope="module", params=PAIRS)
def pair(request: pytest.FixtureRequest) -> tuple[str, tuple[Side, Side]]:
    return request.param, PAIRS[request.param]()


@pytest.mark.parametrize("number", [0, 1], ids=["ours", "theirs"])
def test_pairs(benchmark: Any, pair: Any, number: int) -> None:
    benchmark.group, sides = pair
    side = sides[number]
    benchmark.extra_info["items"] = side.items
    benchmark.pedantic(side.run, rounds=side.rounds, warmup_rounds=min(side.rounds, 2))
