"""Pairs of benchmarks whose ratio of medians counts; run by ``python -m pytest tests/benchmarks``."""

from __future__ import annotations

import shutil
import subprocess
import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pytest
from scipy.optimize import root

import gaitgraph as gg
from gaitgraph.gait.table import ANGLES
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.invertibility.matrices import determinant
from gaitgraph.invertibility.tilt_margins import tilt_margin
from gaitgraph.robustness.attitudes import AcceptableAttitudes, acceptable_attitudes
from gaitgraph.robustness.biased import robustness_of

if TYPE_CHECKING:
    from collections.abc import Callable

REQUEST = str(Path(__file__).parents[2] / "examples" / "gait3.toml")
AXIS = np.linspace(-np.pi / 2, np.pi / 2, 1025)
EXACT = coefficients_of(kind="exact")
BIASED = gg.lift(
    [(1.178, -1.178), (1.178, -0.393), (0.393, -0.393), (0.393, -1.178)], "red"
).biased(0.8)
SAMPLES = BIASED.parametrize(law="constant-speed", samples=1000).alpha[:-1]
ATTITUDES = np.linspace(-np.pi / 2, np.pi / 2, 1001)
VALUES = np.random.default_rng(0).uniform(-2, 2, AXIS.size**2)
MATRICES = np.random.default_rng(1).uniform(-1.5, 1.5, (1 << 14, 4))
RANDOM = np.random.default_rng(7).uniform(
    [0.393, -1.178] * 2, [1.178, -0.393] * 2, (10_000, 4)
)
RANDOM_ROWS = {
    "on the sheet": RANDOM[:, [0, 1, 0, 1]],
    "off the sheets": RANDOM[:, [0, 1, 0, 1]] * [1, 1, 0.8, 0.8],
    "anywhere flyable": RANDOM,
}
TEN_MILLION = np.random.default_rng(3).uniform(-1.5, 1.5, (10_000_000, 4))


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
        pytest.param(
            "plan as a process",
            importing("numpy", "scipy.sparse.csgraph", "networkx", "shapely"),
            id="plan",
        ),
        pytest.param("--help as a process", program("--help"), id="help-ours"),
        pytest.param("--help as a process", importing("click"), id="help"),
    ],
)
def test_processes(benchmark: Any, group: str, command: list[str]) -> None:
    benchmark.group = group
    benchmark.pedantic(
        lambda: subprocess.run(command, check=True, capture_output=True),
        rounds=15,
        warmup_rounds=2,
    )


def all_roots() -> int:
    return int(gg.surface.root_arrays(AXIS[:, None], AXIS).count.sum())


def roots_by_a_solver() -> None:
    """Twenty starts at each node, the residuals as cheap as scalars can make them."""
    from math import cos, sin

    starts = np.random.default_rng(2).uniform(-1.5, 1.5, (20, 2))
    for a1, a2 in np.random.default_rng(1).uniform(-1.5, 1.5, (20, 2)).tolist():
        s1, c1, s2, c2 = sin(a1), cos(a1), sin(a2), cos(a2)

        def residuals(
            x: Any, s1: float = s1, c1: float = c1, s2: float = s2, c2: float = c2
        ) -> list[float]:
            s3, c3, s4, c4 = sin(x[0]), cos(x[0]), sin(x[1]), cos(x[1])
            roll = (c1 * s3 - s1 * c3) * (
                c2 * c4 - s2 * s4 + 2.880 * (c2 * s4 + s2 * c4)
            )
            pitch = (c2 * s4 - s2 * c4) * (
                c1 * c3 - s1 * s3 - 2.880 * (s1 * c3 + c1 * s3)
            )
            return [roll, pitch]

        for start in starts:
            root(residuals, start)


def is_near_the_finest(found: AcceptableAttitudes) -> bool:
    """A raster misses what its cells and its samples hide; this is nearer than one cell's width of the outline."""
    finest = acceptable_attitudes(BIASED.alpha, EXACT, tolerance=1e-6)
    return (
        found.met
        and abs(found.fraction - finest.fraction)
        <= found.error + finest.error
        < 1 / 1001
    )


def raster_of_formula_1() -> Any:
    """Five of the thousand samples, each at a million attitudes; sines and cosines of the raster are shared."""
    roll, pitch = np.meshgrid(ATTITUDES, ATTITUDES, indexing="ij", sparse=True)
    positive = negative = np.ones((1001, 1001), dtype=bool)
    for alpha in SAMPLES[::200]:
        values = determinant(alpha, EXACT, roll, pitch)
        positive, negative = positive & (values > 0), negative & (values < 0)
    return positive | negative


class Side(NamedTuple):
    """One of the two that are compared: what runs, what its answer must be, and how many items it works on."""

    run: Callable[[], Any]
    is_fine: Callable[[Any], Any]
    items: int = 1
    rounds: int = 15


PAIRS = {
    "roots on a 1025 x 1025 grid against numpy.sin": (
        Side(all_roots, lambda count: count == 1027**2 + 1025**2),
        Side(lambda: np.sin(VALUES), np.any),
    ),
    "roots per node against a numerical solver": (
        Side(all_roots, bool, items=AXIS.size**2),
        Side(roots_by_a_solver, lambda _: True, items=20, rounds=5),
    ),
    # A thousand samples, the path between them and the error included.
    "acceptable attitudes per sample against a raster of formula (1)": (
        Side(
            lambda: acceptable_attitudes(SAMPLES, EXACT),
            is_near_the_finest,
            items=len(SAMPLES),
            rounds=7,
        ),
        Side(
            raster_of_formula_1,
            lambda acceptable: 0.8 < acceptable.mean() < 1,
            items=5,
            rounds=3,
        ),
    ),
    "tilt margins of ten million samples against numpy.sin": (
        Side(
            lambda: tilt_margin(TEN_MILLION, EXACT),
            lambda margin: margin.max() <= np.pi / 2,
            rounds=3,
        ),
        Side(lambda: np.sin(TEN_MILLION), np.any, rounds=3),
    ),
}

PAIRS |= {
    f"robustness of 10,000 random rows against validate, {kind}": (
        Side(
            partial(robustness_of, table),
            lambda found: found.gait.acceptable.met,
            rounds=5,
        ),
        Side(partial(gg.validate, table), lambda found: found.rows == 10_000, rounds=5),
    )
    for kind, rows in RANDOM_ROWS.items()
    for table in [dict(zip(ANGLES, rows.T, strict=True))]
}


@pytest.mark.parametrize("group", PAIRS)
@pytest.mark.parametrize("number", [0, 1], ids=["ours", "theirs"])
def test_pairs(benchmark: Any, group: str, number: int) -> None:
    side = PAIRS[group][number]
    benchmark.group, benchmark.extra_info["items"] = group, side.items
    assert side.is_fine(
        benchmark.pedantic(side.run, rounds=side.rounds, warmup_rounds=1)
    )


ROWS = 1_000_000


@pytest.fixture(scope="module", params=["on the sheet", "off the sheets"])
def long_table(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[str, Path]:
    """Return a table of Gait 3 as measured: noise of 0.2 mrad, or α3 and α4 biased too."""
    corners = [(1.178, -1.178), (1.178, -0.393), (0.393, -0.393), (0.393, -1.178)]
    rows = (
        gg.lift(corners, "red")
        .parametrize(law="constant-speed", samples=ROWS)
        .alpha[:-1]
    )
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
    report = benchmark.pedantic(lambda: gg.validate(path), rounds=3, warmup_rounds=1)
    assert report.rows == ROWS


def test_reading(benchmark: Any, long_table: tuple[str, Path]) -> None:
    """The fastest reader that there is without another dependency: numpy's own."""
    kind, path = long_table
    benchmark.group = f"judging a table on disk against reading it, {kind}"
    rows = benchmark.pedantic(
        lambda: np.loadtxt(path, delimiter=",", skiprows=1), rounds=3, warmup_rounds=1
    )
    assert rows.shape == (ROWS, 4)
