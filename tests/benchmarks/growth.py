"""Measure how cost grows, beside peers, and draw it: ``python -m tests.benchmarks.growth`` writes docs/images/growth.*

It needs the extras `peers`, `plot`, `sim` and `study`, two cores, four minutes, and 0.5 GB for temporary files. Sizes
that would take a peer more than 20 s, or more than the budget, are left out. Times are medians. The lines that are
printed at the end are those of the table in docs/limitations.md.
"""

from __future__ import annotations

import argparse
import json
import sys
from io import StringIO
from itertools import pairwise, product
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic, perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np

import gaitgraph as gg
from gaitgraph.files import write_whole
from gaitgraph.plots.axes import PALETTE, blank_figure, paper_style, picture_bytes
from gaitgraph.study.running import run_study
from tests.benchmarks.test_peer_planners import ACROSS, keep_outs, leg_planner
from tests.benchmarks.test_study_speed import STUDY

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    Work = Callable[[], Any]
    Curve = list[tuple[int, float]]  # sizes and seconds
    Measured = dict[str, dict[str, Curve]]  # by title and side

IMAGES = Path(__file__).parents[2] / "docs" / "images"
MOST = 20.0  # s, of a peer
ROUNDS, ENOUGH = (
    9,
    3.0,
)  # of one measurement, and after how many seconds no further round begins
STEP = 0.01  # rad, at which OMPL looks for keep-outs; at its own 0.05 it jumps over small ones
TURN = 10_000  # rows of a table that repeat


def points(size: int, case: int) -> list[tuple[float, float]]:
    return [
        (float(a), -float(b))
        for a, b in np.random.default_rng(case).uniform(0.21, 1.5, (size, 2))
    ]


def loop(side: str, stops: Sequence[Any], polygons: Sequence[Any] = ()) -> Work | None:
    if side == "gaitgraph":
        return lambda: gg.plan_loop(stops, keep_out=polygons).report
    plan = leg_planner(
        "AtlasStateSpace",
        polygons,
        **({"step": STEP} if polygons else {}),
        seconds=MOST,
    )
    return (
        (lambda: [plan(a, b) for a, b in pairwise([*stops, stops[0]])])
        if len(stops) > 1
        else None
    )


def judged(side: str, rows: int, folder: Path, _: int) -> Work:
    """Gait 3 as measured, with noise of 0.2 mrad and six decimals: the same turn again and again."""
    path = folder / f"{rows}.csv"
    if not path.exists():
        corners = [(1.178, -1.178), (1.178, -0.393), (0.393, -0.393), (0.393, -1.178)]
        turn = (
            gg.lift(corners, "red")
            .parametrize(law="constant-speed", samples=min(rows, TURN))
            .alpha[:-1]
        )
        lines = StringIO()
        np.savetxt(
            lines,
            turn + np.random.default_rng(0).normal(0, 2e-4, turn.shape),
            "%.6f",
            delimiter=",",
        )
        with path.open("w") as file:
            file.write("alpha1,alpha2,alpha3,alpha4\n")
            file.writelines(lines.getvalue() for _ in range(rows // len(turn)))
    return lambda: (
        gg.validate(path)
        if side == "gaitgraph"
        else np.loadtxt(path, delimiter=",", skiprows=1)
    )


SPREAD = [1, 3, 10, 30, 100, 300, 1000]
# By title: the peer, the sizes, and what a side does at a size in a folder; None if there is nothing to do. Both sides
# have the same cases. Each is new, so that nothing that is kept from one serves another.
CASES: dict[str, tuple[str, list[int], Callable[[str, int, Path, int], Work | None]]] = {
    "Planning, 1 to 1,000 waypoints": (
        "OMPL Atlas", SPREAD, lambda side, size, _, case: loop(side, points(size, case))
    ),
    "Planning, 1 to 1,000 keep-outs": (
        "OMPL Atlas", SPREAD, lambda side, size, _, case: loop(side, ACROSS, keep_outs(size, 6, case))
    ),
    "Validation, 10³ to 10⁷ rows": ("numpy.loadtxt", [10**k for k in range(3, 8)], judged),
    "A study of 200 flights, 1 and 2 workers": (
        "ideal", [1, 2], lambda _, size, folder, case: lambda: run_study(STUDY, folder / f"{size}-{case}", workers=size)
    ),
}  # fmt: skip


def measured(title: str, deadline: float, folder: Path) -> dict[str, Curve]:
    """Return the times of both sides, who take turns; a side ends before the first size that takes too long."""
    peer, sizes, work = CASES[title]
    found: dict[str, Curve] = {"gaitgraph": [], peer: []}
    sides = ["gaitgraph"] if peer == "ideal" else [*found]
    for size in sizes:
        left = deadline - monotonic()
        room = {side: min(left, MOST) if side == peer else left for side in sides}
        sides = [
            side
            for side in sides
            if not found[side] or expected(found[side], size) < room[side]
        ]
        times: dict[str, list[float]] = {side: [] for side in sides}
        for case, side in product(range(ROUNDS), [*sides]):
            if (
                side in sides
                and sum(times[side]) < ENOUGH
                and (run := work(side, size, folder, case))
            ):
                start = perf_counter()
                try:
                    run()
                except AssertionError:  # the planner gave up
                    sides.remove(side)
                times[side].append(perf_counter() - start)
        for side in sides:
            if times[side]:
                found[side].append((size, float(f"{np.median(times[side]):.4g}")))
                print(
                    f"{title}: {side} {size:,}: {found[side][-1][1]} s",
                    file=sys.stderr,
                    flush=True,
                )
    if peer == "ideal":
        found[peer] = [(size, found["gaitgraph"][0][1] / size) for size in sizes]
    return found


def expected(curve: Curve, size: int) -> float:
    """Return the seconds that a size may take, by the last two, at least in proportion."""
    slope = max(1.0, exponent(curve[-2:])) if len(curve) > 1 else 0.0
    return curve[-1][1] * (size / curve[-1][0]) ** slope if curve else 0.0


def exponent(curve: Curve) -> float:
    """Return the power of the size with which the time grows, over the two largest decades."""
    sizes, times = np.log(np.transpose(curve))
    last = sizes > sizes[-1] - np.log(101)
    return (
        float(np.polyfit(sizes[last], times[last], 1)[0]) if last.sum() > 1 else np.nan
    )


def text_of(seconds: float) -> str:
    value, unit = (seconds, "s") if seconds >= 0.0995 else (seconds * 1000, "ms")
    return f"{value:.{0 if value >= 9.95 else 1 if value >= 0.995 else 2}f} {unit}"


def summary(found: Measured) -> str:
    """Return the lines of the table in docs/limitations.md."""
    lines = []
    for title, sides in found.items():
        ends = ((name, *curve[-1], exponent(curve)) for name, curve in sides.items())
        cells = [
            f"{name}: {text_of(seconds)} at {size:,} | {power:.2f}"
            for name, size, seconds, power in ends
        ]
        lines.append(f"| {title} | {' | '.join(cells)} |")
    return "\n".join(lines)


def picture(found: Measured) -> bytes:
    """Return a PNG with a panel for each, both axes logarithmic; each line has its name, last time and exponent."""
    with paper_style():
        figure = blank_figure(170, 120)
        for ax, (title, sides) in zip(
            figure.subplots(2, 2).flat, found.items(), strict=True
        ):
            largest = max(size for curve in sides.values() for size, _ in curve)
            highest = max(curve[-1][1] for curve in sides.values())
            for (name, curve), color, look in zip(
                sides.items(), ("blue", "partly"), ("s-", "o--"), strict=True
            ):
                size, seconds = curve[-1]
                text = f"{name}\n{text_of(seconds)}\nexponent {exponent(curve):.2f}"
                text += "\nlarger: left out" * (size < largest)
                ax.loglog(*np.transpose(curve), look, color=PALETTE[color][0], ms=3.5)
                look_of: dict[str, Any] = {
                    "va": "bottom" if seconds == highest else "top",
                    "color": PALETTE[color][0],
                }
                ax.annotate(
                    text,
                    curve[-1],
                    xytext=(5, 0),
                    textcoords="offset points",
                    fontsize=7.5,
                    **look_of,
                )
            if largest < 10:
                ax.set(
                    xticks=[1, 2],
                    xticklabels=["1", "2"],
                    ylim=(highest / 20, highest * 5),
                )
            ax.minorticks_off()
            ax.set(
                xlabel=title.split()[-1],
                ylabel="time (s)",
                title=title.partition(",")[0],
            )
            ax.spines[["top", "right"]].set_visible(False)
            ax.grid(True)
        return picture_bytes(figure, "png")


def main() -> int:
    """Measure, then write the picture and its numbers; an interrupt writes nothing."""
    parser = argparse.ArgumentParser(description=str(__doc__).partition("\n\n")[0])
    parser.add_argument("--budget", type=float, default=8.0, help="minutes")
    parser.add_argument(
        "--folder",
        type=Path,
        default=IMAGES,
        help="where growth.png and growth.json go",
    )
    given = parser.parse_args()
    deadline = monotonic() + 60 * given.budget
    try:
        with TemporaryDirectory() as folder:
            found = {title: measured(title, deadline, Path(folder)) for title in CASES}
    except KeyboardInterrupt:
        print("interrupted: nothing is written", file=sys.stderr)
        return 130
    numbers = json.dumps(found, indent=1, ensure_ascii=False).encode()
    write_whole(
        [
            (given.folder / "growth.json", numbers),
            (given.folder / "growth.png", picture(found)),
        ],
        force=True,
    )
    print(summary(found))
    return 0


if __name__ == "__main__":
    sys.exit(main())
