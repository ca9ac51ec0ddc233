"""Random vehicles, configurations, segments and closed gaits that several tests share, and the public names."""

from __future__ import annotations

import inspect
import math
import os
from dataclasses import replace
from itertools import combinations
from typing import TYPE_CHECKING, Any

import networkx as nx
import numpy as np
import numpy.typing as npt
import pytest
import shapely

import gaitgraph as gg
from gaitgraph.gait.gait import Gait, lift, paper_gait
from gaitgraph.gait.table import ANGLES, Table
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.invertibility.forms import rotors_of
from gaitgraph.planning.any_angle import prepared_region
from gaitgraph.planning.branch import Branch, Search
from gaitgraph.surface.curved import sheet_of
from gaitgraph.vehicle import PAPER, Vehicle, vehicle_named
from tests.published import GAITS

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from gaitgraph.planning.loop import Loop
    from gaitgraph.planning.planner import Plan
    from gaitgraph.planning.request import PlanRequest
    from gaitgraph.surface.region import Region, Requirement
    from gaitgraph.surface.sheets import Color, Sign
    from gaitgraph.timing.timed_gait import TimedGait

FloatArray = npt.NDArray[np.float64]

HALF_PI = math.pi / 2
PUBLISHED, EXACT = coefficients_of(), coefficients_of(kind="exact")
TURNED = PAPER.replace(name="turned", first_arm_angle=0.7)
MIRRORED = PAPER.replace(name="mirrored", first_rotor_spin="counterclockwise")
BOTH = PAPER.replace(
    name="both",
    first_arm_angle=-2.1,
    first_rotor_spin="counterclockwise",
    arm_length=0.05,
)
STRONG = Vehicle(name="strong", drag_ratio=0.8)
BEETLE = vehicle_named("beetle_omni").replace(
    thrust_coefficient=1e-5, rotor_lag=None
)  # lag has tests of its own

RAISED = PAPER.replace(
    name="raised", rotor_height=-0.04, first_rotor_spin="counterclockwise"
)
ODD = Vehicle(
    name="odd",
    mass=1.6,
    thrust_coefficient=8e-6,
    drag_to_thrust=[0.016, 0.02, 0.018, 0.03],
    rotor_positions=[
        [0.15, 0.2, 0.03],
        [-0.15, 0.24, -0.01],
        [-0.15, -0.24, 0.0],
        [0.2, -0.2, 0.02],
    ],
)
LEANING = ODD.replace(
    name="leaning",
    tilt_axes=[[0.2, 0.15, 0.05], [-0.2, 0.1, 0.0], [-0.2, -0.15, 0.0], [2, -1.5, 0.3]],
    thrust_axes=[[0.1, 0.0, 1.0], [0.0, 0.0, 5.0], [0.0, -0.3, 1.0], [0.0, 0.2, 3.0]],
    spins=["clockwise", "clockwise", "counterclockwise", "counterclockwise"],
)

STANDING = ODD.replace(
    name="standing",
    mass=1.2,
    rotor_positions=[[0.3, 0, 0.06], [0, 0.35, 0], [-0.2, -0.05, 0], [0.05, -0.3, 0.1]],
    spins=LEANING.spins,
)


def cases(text: str) -> list[tuple[str, ...]]:
    """Return the cases of a text, one a line, with bars between their parts."""
    lines = text.strip().splitlines()
    return [tuple(part.strip() for part in line.split(" | ")) for line in lines]


def seeds(few: int) -> range:
    """Return the seeds of random cases: a few, or as many as the variable CASES of the environment says."""
    return range(int(os.environ.get("CASES", few)))


RED, ASCENDING = (lift(GAITS[k].angles, "red").parametrize(1.0) for k in (2, 3))
HOVER = lift([(0.0, 0.0)], "red").parametrize(1.0)

by_kind = pytest.mark.parametrize(
    "numbers", [PUBLISHED, EXACT], ids=lambda numbers: numbers.kind
)


def by_vehicle(*vehicles: Vehicle) -> Any:
    return pytest.mark.parametrize(
        "vehicle", vehicles, ids=lambda vehicle: vehicle.name
    )


def gait_of_paper(
    number: int, kind: Any = "published", vehicle: Vehicle = PAPER
) -> Gait:
    return paper_gait(number, vehicle, coefficients_of(vehicle, kind))


def flown_by(timed: TimedGait, vehicle: Vehicle) -> TimedGait:
    """Return the same angles and times for another vehicle."""
    return replace(
        timed,
        gait=replace(
            timed.gait, vehicle=vehicle, coefficients=coefficients_of(vehicle, "exact")
        ),
    )


def table_from(alpha: Any, *, t: Any = None, **columns: Any) -> Table:
    times = {} if t is None else {"t": np.asarray(t, dtype=float)}
    return Table(
        columns={
            **times,
            **dict(zip(ANGLES, np.array(alpha, dtype=float).T, strict=True)),
            **columns,
        }
    )


def rows_of(table: Table, start: int, stop: int) -> Table:
    """Return some consecutive rows of a table, counted from 0."""
    chosen = {name: values[start:stop] for name, values in table.columns.items()}
    return replace(table, columns=chosen)


def write_rows(path: Path, rows: Any, **options: Any) -> None:
    """Write tilt angles as a table, with times if there is a fifth column before them."""
    header = ",".join(("t", *ANGLES)[-np.shape(rows)[1] :])
    np.savetxt(path, rows, delimiter=",", header=header, comments="", **options)


def loop_of(plan: Plan) -> Loop:
    assert plan.loop is not None, plan.reason
    return plan.loop


def random_vehicle(random: np.random.Generator) -> Vehicle:
    return Vehicle(
        drag_ratio=float(np.exp(random.uniform(math.log(0.01), math.log(3.0)))),
        first_arm_angle=float(random.choice([0.0, math.pi / 4, 1.0, -2.0])),
        first_rotor_spin="clockwise" if random.random() < 0.5 else "counterclockwise",
    )


def symmetric_vehicle(random: np.random.Generator) -> Vehicle:
    """Return a vehicle that a half turn maps to itself: pairs of rotors that differ in all that they may."""
    length, height = random.uniform([[0.1], [-0.1]], [[0.4], [0.1]], (2, 2))
    turn = random.uniform([0.1, 1.6], [1.4, 2.9])
    half = np.column_stack([length * np.cos(turn), length * np.sin(turn), height])
    return Vehicle(
        name="symmetric",
        mass=1.0,
        rotor_positions=np.concatenate([half, half * [-1, -1, 1]]),
        drag_to_thrust=np.tile(random.uniform(0.01, 0.06, 2), 2),
        first_rotor_spin=str(random.choice(["clockwise", "counterclockwise"])),
    )


EVERY_KIND = [PAPER, BOTH, STRONG, RAISED]
EVERY_KIND += [symmetric_vehicle(np.random.default_rng(7)), ODD, LEANING]
"""A vehicle of each kind, on which the laws of all four rotors are tested."""


def random_tilts(seed: int, *shape: int, reach: float = math.pi) -> FloatArray:
    return np.random.default_rng(seed).uniform(-reach, reach, (*shape, 4))


def small_gait(vehicle: Vehicle) -> Gait:
    """Return a small gait of three corners on the sheet of any vehicle, with straight segments."""
    first, second = np.array([[-0.8, -0.8, -0.9], [0.8, 0.7, 0.8]])
    others = sheet_of(rotors_of(vehicle)).angles(first, second)
    alpha = np.column_stack([first, second, others])
    return Gait(alpha=alpha, vehicle=vehicle)


def on_red(first: Any, second: Any) -> FloatArray:
    return np.stack([first, second, first, second], axis=-1)


def on_blue(first: Any, second: Any, delta: float) -> FloatArray:
    return np.stack([first, second, 2 * delta - first, -2 * delta - second], axis=-1)


KINDS = ("anywhere", "red", "blue", "short", "points", "near red", "one angle")


def random_segments(
    kind: str, seed: int, count: int = 10
) -> tuple[FloatArray, FloatArray]:
    """Return starts and ends of random segments of one kind, both of shape (count, 4)."""
    random = np.random.default_rng(seed)
    start, end = random.uniform(-1.5, 1.5, (2, count, 4))
    for side in (start, end):
        if kind in ("red", "near red"):
            side[:, 2:] = side[:, :2]
        if kind == "blue":
            side[:] = on_blue(side[:, 0], side[:, 1], PUBLISHED.delta)
        if kind == "near red":
            side[:] += random.normal(0, 1e-3, side.shape)
    if kind == "short":
        end = start + random.normal(0, 1e-3, start.shape)
    if kind == "points":
        end = start.copy()
    if kind == "one angle":
        end[:, :3] = start[:, :3]
    return start, end


def points_of(start: FloatArray, end: FloatArray, count: int = 401) -> FloatArray:
    """Return evenly spaced points of each segment, shape (m, count, 4)."""
    return np.asarray(
        start[:, None] + np.linspace(0.0, 1.0, count)[:, None] * (end - start)[:, None]
    )


def closed(corners: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return starts and ends of the segments of a closed polyline."""
    return corners, np.roll(corners, -1, axis=0)


def along(corners: FloatArray, count: int) -> FloatArray:
    """Return points all along a closed polyline, shape (m, 4)."""
    return points_of(*closed(corners), count).reshape(-1, 4)


def visibility_graph(region: Any, points: set[tuple[float, float]]) -> nx.Graph[Any]:
    """Join every two points between which a region holds the straight line, one by one."""
    # What is on the border but for rounding counts as inside.
    shell = region.buffer(1e-11, join_style="mitre")
    shapely.prepare(shell)
    graph: nx.Graph[Any] = nx.Graph()
    graph.add_nodes_from(sorted(points))
    lines = (
        (a, b)
        for a, b in combinations(graph, 2)
        if shell.covers(shapely.LineString([a, b]))
    )
    graph.add_edges_from((a, b, {"length": math.dist(a, b)}) for a, b in lines)
    return graph


def planning_region(
    request: PlanRequest, color: Color, sign: Sign, require: Requirement
) -> Region:
    """Return the region in which loops of one color and sign of R are planned."""
    branch = Branch(search=Search(request), color=color, sign=sign, require=require)
    return prepared_region(branch).region


def replan_requests(
    region: Region, rng: np.random.Generator, count: int
) -> Iterator[tuple[Any, Any, Any]]:
    """Yield present tilt angles, 3 to 8 waypoints and up to three keep-outs of 3 to 8 corners across the path."""
    part = region.components[0]
    low, high = np.array(part.bounds).reshape(2, 2)
    pool: Any = rng.uniform(low, high, (4000, 2))
    pool = pool[shapely.covers(part, shapely.points(pool))]
    for _ in range(count):
        here, *stops = pool[rng.integers(0, len(pool), rng.integers(4, 10))].tolist()
        path, keep_out = np.array([here, *stops, stops[0]]), []
        for k in rng.integers(0, len(path) - 1, rng.integers(0, 4)):
            center = path[k] + rng.uniform(0.2, 0.8) * (path[k + 1] - path[k])
            n = int(rng.integers(3, 9))
            turns = 2 * math.pi * (np.arange(n) + 0.8 * rng.uniform(0, 1, n)) / n
            reach = rng.uniform(0.03, 0.2) * rng.uniform(0.5, 1.0, n)
            keep_out.append(
                (
                    center
                    + reach[:, None] * np.column_stack([np.cos(turns), np.sin(turns)])
                ).tolist()
            )
        yield [*here, *here], stops, keep_out


def public_callables() -> Iterator[tuple[str, Any]]:
    """Yield the public functions, classes and methods, each with the shortest name."""
    packages = [getattr(gg, name) for name in dir(gg)]
    seen: set[int] = set()
    for home in [gg, *filter(inspect.ismodule, packages)]:
        for name in getattr(home, "__all__", ()):
            value = getattr(home, name)
            if not callable(value) or id(value) in seen:
                continue
            seen.add(id(value))
            whole = f"{home.__name__}.{name}".removeprefix("gaitgraph.")
            yield whole, value
            if inspect.isclass(value):
                for own in vars(value):
                    if not own.startswith("_") and callable(getattr(value, own)):
                        yield f"{whole}.{own}", getattr(value, own)
