"""Print for each group of benchmarks the median of ours, and its ratio to that of theirs, beside the aim."""

from __future__ import annotations

from typing import Any

AIMS = {
    "plan as a process": "at most 0.8",
    "--help as a process": "at most 2",
    "roots on a 1025 x 1025 grid against numpy.sin": "at most 80",
    "robustness of 10,000 random rows against validate": "at most 3",
    "acceptable attitudes per sample against a raster of formula (1)": "at most 1/50",
    "the loop of Gait 3 against OMPL": "at most 0.6",
    "a new vehicle each time, planned": "at most 10 ms",
    "a new vehicle each time, planned round a keep-out": "at most 10 ms",
    "a new vehicle each time, planned along a curved border": "none: some 400 corners to 1e-6 rad",
    "a new vehicle each time, refused with the nearest points": "at most 20 ms",
    "a new vehicle each time, region": "at most 20 ms",
    "a new keep-out in flight against plan_loop": "ours at most 5 ms",
    "least period of a square loop against toppra": "at most 1",
    "a click in the explorer, server side, against plan_loop": "ours at most 20 ms",
    "one second of flight at 1 kHz against mujoco alone": "at most 5",
    "a basin of 17 x 17 attitudes against fly from each for the whole duration": "at most 1/5",
}


def pytest_terminal_summary(terminalreporter: Any, config: Any) -> None:
    session = getattr(config, "_benchmarksession", None)
    medians: dict[str, dict[str, float]] = {}
    for bench in session.benchmarks if session else []:
        side = "ours" if "ours" in bench.name else "theirs"
        per_item = bench.extra_info.get("items", 1)
        medians.setdefault(bench.group, {})[side] = bench.stats.median / per_item
    for group, sides in medians.items():
        shown = f"{1000 * sides['ours']:.2f} ms"
        if len(sides) == 2:
            ratio = sides["ours"] / sides["theirs"]
            shown += f", {ratio:.2f}" if ratio > 0.01 else f", 1/{1 / ratio:,.0f}"
            shown += " of theirs"
        terminalreporter.write_line(f"{group}: {shown} (aim: {AIMS[group]})")
