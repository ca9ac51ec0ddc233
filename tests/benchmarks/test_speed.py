"""Pairs of benchmarks whose ratio of medians counts; run by ``python -m pytest tests/benchmarks``."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import networkx as nx
import numpy as np
import pytest
from scipy.optimize import root

import gaitgraph as gg
from gaitgraph.graph.walks import closed_walk
from gaitgraph.invertibility.matrices import coefficients_of, determinant, least_singular_value_bound
from gaitgraph.invertibility.tilt_margins import tilt_margin
from gaitgraph.robustness.attitudes import acceptable_attitudes
from gaitgraph.surface.sheets import COLORS

REQUEST = str(Path(__file__).parents[2] / "examples" / "gait3.toml")
CORNERS = [(14, 2, "red"), (14, 6, "red"), (10, 6, "red"), (10, 2, "red")]
AXIS = np.linspace(-np.pi / 2, np.pi / 2, 1025)


def program(*arguments: str) -> list[str]:
    """Return the installed command beside this interpreter."""
    script = shutil.which("gaitgraph", path=str(Path(sys.executable).parent))
    assert script is not None
    return [script, *arguments]


def importing(*names: str) -> list[str]:
    return [sys.executable, "-c", f"import {', '.join(names)}"]


@pytest.mark.parametrize(
    ("group", "command"),
    [
        pytest.param("plan as a process", program("plan", REQUEST), id="plan-ours"),
        pytest.param("plan as a process", importing("numpy", "scipy.sparse.csgraph", "networkx", "shapely"), id="plan"),
        pytest.param("--help as a process", program("--help"), id="help-ours"),
        pytest.param("--help as a process", importing("click"), id="help"),
    ],
)
def test_processes(benchmark: Any, group: str, command: list[str]) -> None:
    benchmark.group = group
    benchmark.pedantic(lambda: subprocess.run(command, check=True, capture_output=True), rounds=15, warmup_rounds=2)


def all_roots() -> int:
    return sum(grid.R.size for grid in (gg.surface.sheet_grid(color, AXIS, AXIS) for color in COLORS))


@pytest.mark.benchmark(group="roots on a 1025 x 1025 grid against numpy.sin")
def test_root_grid_ours(benchmark: Any) -> None:
    assert benchmark.pedantic(all_roots, rounds=15, warmup_rounds=2) == 1027**2 + 1025**2


@pytest.mark.benchmark(group="roots on a 1025 x 1025 grid against numpy.sin")
def test_numpy_sin(benchmark: Any) -> None:
    values = np.random.default_rng(0).uniform(-2, 2, AXIS.size**2)
    benchmark.pedantic(lambda: np.sin(values), rounds=15, warmup_rounds=2)


@pytest.mark.benchmark(group="roots per node against a numerical solver")
def test_roots_per_node_ours(benchmark: Any) -> None:
    benchmark.extra_info["items"] = AXIS.size**2
    benchmark.pedantic(all_roots, rounds=15, warmup_rounds=2)


@pytest.mark.benchmark(group="roots per node against a numerical solver")
def test_roots_per_node_solver(benchmark: Any) -> None:
    """Twenty starts at each node, the residuals as cheap as scalars can make them."""
    from math import cos, sin

    nodes = np.random.default_rng(1).uniform(-1.5, 1.5, (20, 2)).tolist()
    starts = np.random.default_rng(2).uniform(-1.5, 1.5, (20, 2))

    def solve() -> None:
        for a1, a2 in nodes:
            s1, c1, s2, c2 = sin(a1), cos(a1), sin(a2), cos(a2)

            def residuals(x: Any, s1: float = s1, c1: float = c1, s2: float = s2, c2: float = c2) -> list[float]:
                s3, c3, s4, c4 = sin(x[0]), cos(x[0]), sin(x[1]), cos(x[1])
                roll = (c1 * s3 - s1 * c3) * (c2 * c4 - s2 * s4 + 2.880 * (c2 * s4 + s2 * c4))
                pitch = (c2 * s4 - s2 * c4) * (c1 * c3 - s1 * s3 - 2.880 * (s1 * c3 + c1 * s3))
                return [roll, pitch]

            for start in starts:
                root(residuals, start)

    benchmark.extra_info["items"] = len(nodes)
    benchmark.pedantic(solve, rounds=5, warmup_rounds=1)


@pytest.fixture(scope="module")
def graph() -> nx.Graph[Any]:
    return gg.surface_graph("negative")


@pytest.mark.benchmark(group="closed walk on the built graph against networkx")
def test_closed_walk_ours(benchmark: Any, graph: nx.Graph[Any]) -> None:
    walk = benchmark(closed_walk, graph, [[corner] for corner in CORNERS], use="flyable")
    assert walk.length == pytest.approx(np.pi)


@pytest.mark.benchmark(group="closed walk on the built graph against networkx")
def test_closed_walk_networkx(benchmark: Any, graph: nx.Graph[Any]) -> None:
    def legs() -> float:
        return sum(
            nx.bidirectional_dijkstra(graph, CORNERS[k], CORNERS[(k + 1) % 4], weight="length")[0] for k in range(4)
        )

    assert benchmark(legs) == pytest.approx(np.pi)


ROWS = 300_000


@pytest.fixture(scope="module", params=["on the sheet", "off the sheets"])
def long_table(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Path]:
    """Return a table of Gait 3 as measured: noise of 0.2 mrad, or α3 and α4 biased too."""
    corners = [(1.178, -1.178), (1.178, -0.393), (0.393, -0.393), (0.393, -1.178)]
    rows = gg.lift(corners, "red").parametrize(law="constant-speed", samples=ROWS).alpha[:-1]
    rows = rows + np.random.default_rng(0).normal(0, 2e-4, rows.shape)
    if request.param == "off the sheets":
        rows *= [1, 1, 0.8, 0.8]
    path = tmp_path_factory.mktemp("tables") / "long.csv"
    lines = "\n".join(",".join(map(repr, row)) for row in rows.tolist())
    path.write_text(f"alpha1,alpha2,alpha3,alpha4\n{lines}\n")
    return request.param, path


def test_judging_ours(benchmark: Any, long_table: tuple[str, Path]) -> None:
    kind, path = long_table
    benchmark.group = f"judging a table on disk against reading it, {kind}"
    report = benchmark.pedantic(lambda: gg.validate(path), rounds=5, warmup_rounds=1)
    assert report.rows == ROWS


def test_reading(benchmark: Any, long_table: tuple[str, Path]) -> None:
    """The fastest reader that there is without another dependency: numpy's own."""
    kind, path = long_table
    benchmark.group = f"judging a table on disk against reading it, {kind}"
    rows = benchmark.pedantic(lambda: np.loadtxt(path, delimiter=",", skiprows=1), rounds=5, warmup_rounds=1)
    assert rows.shape == (ROWS, 4)


MATRICES = np.random.default_rng(1).uniform(-1.5, 1.5, (1 << 14, 4))


@pytest.mark.benchmark(group="least singular values against a decomposition of every matrix")
def test_singular_values_ours(benchmark: Any) -> None:
    assert (benchmark(least_singular_value_bound, MATRICES) > 0).all()


@pytest.mark.benchmark(group="least singular values against a decomposition of every matrix")
def test_singular_values(benchmark: Any) -> None:
    assert (benchmark(gg.invertibility.least_singular_value, MATRICES) > 0).all()


EXACT = coefficients_of(kind="exact")
BIASED = gg.lift([(1.178, -1.178), (1.178, -0.393), (0.393, -0.393), (0.393, -1.178)], "red").biased(0.8)
SAMPLES = BIASED.parametrize(law="constant-speed", samples=1000).alpha[:-1]
ATTITUDES = np.linspace(-np.pi / 2, np.pi / 2, 1001)


@pytest.mark.benchmark(group="acceptable attitudes per sample against a raster of formula (1)")
def test_acceptable_attitudes_ours(benchmark: Any) -> None:
    """A thousand samples, the way between them and the error included."""
    benchmark.extra_info["items"] = len(SAMPLES)
    found = benchmark.pedantic(lambda: acceptable_attitudes(SAMPLES, EXACT), rounds=7, warmup_rounds=1)
    finest = acceptable_attitudes(BIASED.alpha, EXACT, tolerance=1e-6)
    assert found.met
    # A raster misses what its cells and its samples hide; this is nearer than one cell's width of the outline.
    assert abs(found.fraction - finest.fraction) <= found.error + finest.error < 1 / 1001


@pytest.mark.benchmark(group="acceptable attitudes per sample against a raster of formula (1)")
def test_raster_of_formula_1(benchmark: Any) -> None:
    """Five of the thousand samples, each at a million attitudes; sines and cosines of the raster are shared."""
    roll, pitch = np.meshgrid(ATTITUDES, ATTITUDES, indexing="ij", sparse=True)
    some = SAMPLES[::200]

    def evaluate() -> Any:
        positive = negative = np.ones((1001, 1001), dtype=bool)
        for alpha in some:
            values = determinant(alpha, EXACT, roll, pitch)
            positive, negative = positive & (values > 0), negative & (values < 0)
        return positive | negative

    benchmark.extra_info["items"] = len(some)
    acceptable = benchmark.pedantic(evaluate, rounds=3, warmup_rounds=1)
    assert 0.8 < acceptable.mean() < 1


TEN_MILLION = np.random.default_rng(3).uniform(-1.5, 1.5, (10_000_000, 4))


@pytest.mark.benchmark(group="tilt margins of ten million samples against numpy.sin")
def test_tilt_margins_ours(benchmark: Any) -> None:
    margin = benchmark.pedantic(lambda: tilt_margin(TEN_MILLION, EXACT), rounds=3, warmup_rounds=1)
    assert ((margin >= 0) & (margin <= np.pi / 2)).all()


@pytest.mark.benchmark(group="tilt margins of ten million samples against numpy.sin")
def test_sines(benchmark: Any) -> None:
    assert benchmark.pedantic(lambda: np.sin(TEN_MILLION), rounds=3, warmup_rounds=1).shape == (10_000_000, 4)
