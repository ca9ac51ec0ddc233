"""Measure how cost grows, beside peers, and draw it: ``python -m tests.benchmarks.growth`` writes docs/images/growth.*

It needs the extras `peers`, `plot`, `sim` and `study`, two cores, some minutes, and 0.5 GB for temporary files. Times
are medians. The lines that are printed at the end are those of the table in docs/limitations.md.
"""

from __future__ import annotations

import json
import math
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np

import gaitgraph as gg
from gaitgraph.files import write_whole
from gaitgraph.plots.axes import PALETTE, blank_figure, paper_style, picture_bytes
from gaitgraph.study.running import run_study
from tests.benchmarks.test_pairs import GAIT3
from tests.benchmarks.test_peer_planners import leg_planner, legs

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    Work = Callable[[], Any]
    Curve = list[tuple[int, float]]  # sizes and seconds
    Measured = dict[str, dict[str, Curve]]  # by title and side

IMAGES = Path(__file__).parents[2] / "docs" / "images"
ROUNDS = 9
ENOUGH = 3.0  # s, after which no further round of a measurement begins
STEP = 0.01  # rad, at which OMPL looks for keep-outs; at its own 0.05 it jumps over small ones
STUDY = {
    "name": "200 flights",
    "gaits": ["gait3", "gait4"],
    "attitudes": {
        "roll": {"from": -0.5, "to": 0.5, "count": 10},
        "pitch": {"from": -0.5, "to": 0.5, "count": 10},
    },
    "flight": {"duration": 5.0},  # long beside the seconds in which workers start
}
TURN = 10_000  # rows of a table that repeat
IDEAL = "ideal"
ACROSS = [(0.21, -1.52), (1.5, -0.25), (1.5, -1.52), (0.21, -0.25)]


def points(size: int, case: int) -> list[Any]:
    sizes = np.random.default_rng(case).uniform(0.21, 1.5, (size, 2))
    return [*map(tuple, (sizes * [1, -1]).tolist())]


def loop(side: str, stops: Sequence[Any], polygons: Sequence[Any] = ()) -> Work:
    if side == "gaitgraph":
        return lambda: gg.plan_loop(stops, keep_out=polygons).report
    plan = leg_planner(polygons, step=STEP if polygons else 0.05, seconds=20.0)
    return lambda: [plan(a, b) for a, b in legs(stops)]


def waypoints(side: str, size: int, case: int, _: Path) -> Work:
    return loop(side, points(size, case))


def polygons(side: str, size: int, case: int, _: Path) -> Work:
    return loop(side, ACROSS, keep_outs(size, 6, case))


def keep_outs(
    count: int = 50, corners: int = 20, seed: int = 0
) -> list[list[tuple[float, float]]]:
    """Return star-shaped polygons, strewn over the part where Gait 3 flies; the more, the smaller."""
    rng = np.random.default_rng(seed)
    columns = math.ceil(math.sqrt(count))
    rows = math.ceil(count / columns)
    width, height = 1.24 / columns, 1.225 / rows
    places = [(i, j) for i in range(columns) for j in range(rows)]
    rng.shuffle(places)
    polygons = []
    for i, j in places[:count]:
        center = np.array([0.2225 + width * (i + 0.5), -0.2425 - height * (j + 0.5)])
        center += 0.13 * width * rng.uniform(-1, 1, 2)
        shares = np.arange(corners) + 0.8 * rng.uniform(0, 1, corners)
        turns = 2 * np.pi * shares / corners
        reach = 0.45 * min(width, height) * rng.uniform(0.6, 1.0, corners)
        around = np.column_stack([np.cos(turns), np.sin(turns)])
        polygons.append([*map(tuple, (center + reach[:, None] * around).tolist())])
    return polygons


def judged(side: str, rows: int, _: int, folder: Path) -> Work:
    """Gait 3 as measured, with noise of 0.2 mrad and six decimals: the same turn again and again."""
    path = folder / f"{rows}.csv"
    count = min(rows, TURN)
    turn = GAIT3.parametrize(law="constant-speed", samples=count).alpha[:-1]
    turn = turn + np.random.default_rng(0).normal(0, 2e-4, turn.shape)
    lines = StringIO()
    np.savetxt(lines, turn, "%.6f", ",")
    if not path.exists():
        header = "alpha1,alpha2,alpha3,alpha4\n"
        path.write_text(header + lines.getvalue() * (rows // count))
    if side == "gaitgraph":
        return lambda: gg.validate(path)
    return lambda: np.loadtxt(path, delimiter=",", skiprows=1)


def study(_: str, workers: int, case: int, folder: Path) -> Work:
    output = folder / f"{workers}-{case}"
    return lambda: run_study(STUDY, output, workers=workers)


SPREAD = [1, 3, 10, 30, 100, 300, 1000]
# By title: the peer, the sizes, and what a side does for a size and a case. Both sides have the same cases. Each is
# new, so that nothing that is kept from one serves another.
CASES: dict[str, tuple[str, list[int], Callable[[str, int, int, Path], Work]]] = {
    "Planning, 1 to 1,000 waypoints": ("OMPL Atlas", SPREAD, waypoints),
    "Planning, 1 to 1,000 keep-outs": ("OMPL Atlas", SPREAD, polygons),
    "Validation, 10³ to 10⁷ rows": (
        "numpy.loadtxt",
        [10**k for k in range(3, 8)],
        judged,
    ),
    "A study of 200 flights, 1 and 2 workers": (IDEAL, [1, 2], study),
}


def measured(title: str, folder: Path) -> dict[str, Curve]:
    """Return the times of both sides."""
    peer, sizes, work = CASES[title]
    curves: dict[str, Curve] = {"gaitgraph": [], peer: []}
    for side in curves.keys() - {IDEAL}:
        for size in sizes:
            if side == "OMPL Atlas" and work is waypoints and size == 1:
                continue  # it has no leg to plan
            times: list[float] = []
            while len(times) < ROUNDS and sum(times) < ENOUGH:
                run = work(side, size, len(times), folder)
                start = perf_counter()
                run()
                times.append(perf_counter() - start)
            curves[side].append((size, float(f"{np.median(times):.4g}")))
    if peer == IDEAL:
        curves[peer] = [(size, curves["gaitgraph"][0][1] / size) for size in sizes]
    return curves


def exponent(curve: Curve) -> float:
    """Return the power of the size with which the time grows, over the two largest decades."""
    sizes, times = np.log(np.transpose(curve))
    last = sizes > sizes[-1] - np.log(101)
    return float(np.polyfit(sizes[last], times[last], 1)[0])


def text_of(seconds: float) -> str:
    if seconds < 0.0995:
        return f"{1000 * seconds:#.2g} ms"
    return f"{seconds:#.2g} s" if seconds < 9.95 else f"{seconds:.0f} s"


def summary(measurements: Measured) -> str:
    """Return the lines of the table in docs/limitations.md."""
    lines = []
    for title, sides in measurements.items():
        cells = [title]
        for name, curve in sides.items():
            size, seconds = curve[-1]
            cells.append(f"{name}: {text_of(seconds)} at {size:,}")
            cells.append(f"{exponent(curve):.2f}")
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def picture(measurements: Measured) -> bytes:
    """Return a PNG with a panel for each, both axes logarithmic; each line has its name, last time and exponent."""
    with paper_style():
        figure = blank_figure(170, 120)
        panels = figure.subplots(2, 2).flat
        for ax, (title, sides) in zip(panels, measurements.items(), strict=True):
            highest = max(curve[-1][1] for curve in sides.values())
            looks = (("blue", "s-"), ("partly", "o--"))
            for (name, curve), (color, look) in zip(sides.items(), looks, strict=True):
                shade = PALETTE[color][0]
                seconds = curve[-1][1]
                ax.loglog(*np.transpose(curve), look, color=shade, ms=3.5)
                ax.annotate(
                    f"{name}\n{text_of(seconds)}\nexponent {exponent(curve):.2f}",
                    curve[-1],
                    xytext=(5, 0),
                    textcoords="offset points",
                    fontsize=7.5,
                    color=shade,
                    va="bottom" if seconds == highest else "top",
                )
            if IDEAL in sides:
                ax.set(xticks=[1, 2], xticklabels=["1", "2"])
                ax.set_ylim(highest / 20, highest * 5)
            ax.minorticks_off()
            ax.set(xlabel=title.split()[-1], ylabel="time (s)")
            ax.set_title(title.partition(",")[0])
            ax.spines[["top", "right"]].set_visible(False)
            ax.grid(True)
        return picture_bytes(figure, "png")


def main() -> None:
    """Measure, then write the picture and its numbers."""
    with TemporaryDirectory() as folder:
        found = {title: measured(title, Path(folder)) for title in CASES}
    numbers = json.dumps(found, indent=1, ensure_ascii=False).encode()
    files = [(IMAGES / "growth.json", numbers), (IMAGES / "growth.png", picture(found))]
    write_whole(files, force=True)
    print(summary(found))


if __name__ == "__main__":
    main()
