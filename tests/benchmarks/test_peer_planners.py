"""Any-angle planning against other planners; the peer OMPL is an extra, ``peers``, and left out where it is missing."""

from __future__ import annotations

import math
import time
from itertools import cycle, pairwise
from typing import TYPE_CHECKING, Any

import networkx as nx
import numpy as np
import pytest
import shapely

import gaitgraph as gg
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.planning.any_angle import PreparedRegion, straight_loop_holds
from gaitgraph.planning.branch import Branch
from gaitgraph.planning.request import plan_request
from tests.samples import planning_region, visibility_graph

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

GAIT_3 = [(3 * math.pi / 8, -3 * math.pi / 8), (3 * math.pi / 8, -math.pi / 8)]
GAIT_3 += [(math.pi / 8, -math.pi / 8), (math.pi / 8, -3 * math.pi / 8)]
COEFFICIENTS = coefficients_of()
SPACES = ["ProjectedStateSpace", "AtlasStateSpace"]


@pytest.mark.parametrize("space", SPACES)
def test_gait_3_ours(benchmark: Any, space: str) -> None:
    """From a request to a loop that is proven flyable and shortest, lifted to all four angles; without the report."""
    benchmark.group = f"the loop of Gait 3 against OMPL's {space}"
    request = plan_request(GAIT_3, color="red", sign="negative")
    branch = Branch(request=request, color="red", sign="negative", require="flyable")

    def planned() -> gg.Gait:
        assert straight_loop_holds(branch)
        return gg.lift(request.waypoints, "red", coefficients=COEFFICIENTS)

    assert benchmark(planned).length == pytest.approx(math.pi, abs=1e-12)


def leg_planner(
    space: str,
    polygons: Sequence[Any] = (),
    *,
    step: float = 0.05,
    seconds: float = 5.0,
) -> Callable[[Any, Any], Any]:
    """Return OMPL's planning of one leg: RRTConnect on equations (7) and (8), with a checker of color and sign of R.

    The checker keeps out of `polygons` too; it is asked along the way at steps, 0.05 rad if OMPL chooses.
    """
    base: Any = pytest.importorskip(
        "ompl.base", reason="OMPL is not installed: pip install gaitgraph[peers]"
    )
    geometric: Any = pytest.importorskip("ompl.geometric")
    util: Any = pytest.importorskip("ompl.util")
    util.setLogLevel(util.LogLevel.LOG_NONE)
    util.RNG.setSeed(1)
    delta = COEFFICIENTS.delta
    scale, kappa = 1 / math.sin(2 * delta), math.tan(delta)
    forbidden = shapely.union_all([shapely.Polygon(corners) for corners in polygons])
    shapely.prepare(forbidden)

    class Surfaces(base.Constraint):  # type: ignore[misc]  # OMPL has no types
        def __init__(self) -> None:
            super().__init__(4, 2, 1e-4)

        def function(self, x: Any, out: Any) -> None:
            a1, a2, a3, a4 = x
            out[0] = -scale * math.sin(a1 - a3) * math.sin(a2 + a4 + 2 * delta)
            out[1] = scale * math.sin(a1 + a3 - 2 * delta) * math.sin(a2 - a4)

        def jacobian(self, x: Any, out: Any) -> None:
            a1, a2, a3, a4 = x
            p, q, r, s = a1 - a3, a2 + a4 + 2 * delta, a1 + a3 - 2 * delta, a2 - a4
            out[0, 2] = scale * math.cos(p) * math.sin(q)
            out[0, 0] = -out[0, 2]
            out[0, 1] = out[0, 3] = -scale * math.sin(p) * math.cos(q)
            out[1, 0] = out[1, 2] = scale * math.cos(r) * math.sin(s)
            out[1, 1] = scale * math.sin(r) * math.cos(s)
            out[1, 3] = -out[1, 1]

    def red_with_negative_R(state: Any) -> bool:
        a1, a2, a3, a4 = (state[k] for k in range(4))
        if abs(a1 - a3) > 0.03 or abs(a2 - a4) > 0.03:
            return False
        if polygons and shapely.intersects_xy(forbidden, a1, a2):
            return False
        bracket = 2 * kappa * math.cos(a1) * math.cos(a2) - math.sin(a1 - a2)
        return math.cos(a1 - delta) * math.cos(a2 + delta) * bracket < 0

    def plan(first: Any, last: Any) -> Any:
        """Return the length of a path between two points (α1, α2) of red."""
        ambient, bounds = base.RealVectorStateSpace(4), base.RealVectorBounds(4)
        bounds.setLow(-math.pi / 2)
        bounds.setHigh(math.pi / 2)
        ambient.setBounds(bounds)
        constrained = getattr(base, space)(ambient, Surfaces())
        constrained.setDelta(step)
        information = base.ConstrainedSpaceInformation(constrained)
        setup = geometric.SimpleSetup(information)
        setup.setStateValidityChecker(red_with_negative_R)
        ends = constrained.allocState(), constrained.allocState()
        for end, point in zip(ends, (first, last), strict=True):
            end.copy([*point, *point])
            if space == "AtlasStateSpace":
                constrained.anchorChart(end)
        setup.setStartAndGoalStates(*ends)
        setup.setPlanner(geometric.RRTConnect(information))
        setup.setup()
        assert setup.solve(seconds)
        assert setup.haveExactSolutionPath()
        return setup.getSolutionPath().length()

    return plan


@pytest.mark.parametrize("space", SPACES)
def test_gait_3_ompl(benchmark: Any, space: str) -> None:
    """Leg by leg; each state space is built anew for each leg, as OMPL wants it."""
    benchmark.group = f"the loop of Gait 3 against OMPL's {space}"
    plan = leg_planner(space)
    lengths: list[float] = []

    def loop() -> None:
        lengths.append(sum(plan(a, b) for a, b in pairwise([*GAIT_3, GAIT_3[0]])))

    benchmark.pedantic(loop, **WARM)
    shares = np.array(lengths) / (
        math.sqrt(2) * math.pi
    )  # in four dimensions the shortest is √2 times as long
    benchmark.extra_info["times as long as the shortest"] = (
        f"{shares.min():.2f} to {shares.max():.2f}"
    )
    assert shares.min() >= 1 - 1e-3


ACROSS = [(0.21, -1.52), (1.5, -0.25), (1.5, -1.52), (0.21, -0.25)]


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
        turns = (
            2
            * np.pi
            * (np.arange(corners) + 0.8 * rng.uniform(0, 1, corners))
            / corners
        )
        reach = 0.45 * min(width, height) * rng.uniform(0.6, 1.0, corners)
        outline = center + reach[:, None] * np.column_stack(
            [np.cos(turns), np.sin(turns)]
        )
        polygons.append([(float(x), float(y)) for x, y in outline])
    return polygons


TEXTS = [("3pi/8", "-3pi/8"), ("3pi/8", "-pi/8"), ("pi/8", "-pi/8"), ("pi/8", "-3pi/8")]
STREWN = np.random.default_rng(7).uniform((0.25, -1.45), (1.45, -0.3), (2000, 2))
STREWN = STREWN[gg.surface.Zones(keep_out=keep_outs(10, 8)).allow_points(STREWN)]
EIGHTS = STREWN[:960].reshape(-1, 8, 2).tolist()
PLANS: dict[str, tuple[Any, Any, Any]] = {
    "a plan of Gait 3 with its report against OMPL's AtlasStateSpace": (
        [TEXTS],
        [GAIT_3],
        [],
    ),
    "a plan of 8 waypoints among 10 keep-outs against OMPL's AtlasStateSpace": (
        EIGHTS,
        EIGHTS,
        keep_outs(10, 8),
    ),
}
WARM = {"rounds": 100, "warmup_rounds": 150}
"""OMPL's first hundred loops of Gait 3 take up to ten times as long as later ones, so they do not count."""


@pytest.mark.parametrize("group", PLANS)
def test_a_whole_plan_ours(benchmark: Any, group: str) -> None:
    """From texts or numbers to a plan whose report is certified along the whole loop.

    The region of one request is kept for the next with the same keep-outs; the first call makes it. The eight waypoints
    are other ones each time.
    """
    benchmark.group = group
    waypoints, _, polygons = PLANS[group]
    loops = cycle(waypoints)
    started = time.perf_counter()
    gg.plan_loop(next(loops), keep_out=polygons)
    benchmark.extra_info["first call"] = (
        f"{1e3 * (time.perf_counter() - started):.1f} ms"
    )

    def planned() -> list[str]:
        plan = gg.plan_loop(next(loops), keep_out=polygons)
        assert plan.report.flyable
        return [check.message for check in plan.report.checks]

    assert len(benchmark.pedantic(planned, rounds=100, warmup_rounds=5)) == 9


@pytest.mark.parametrize("group", PLANS)
def test_a_whole_plan_ompl(benchmark: Any, group: str) -> None:
    """Leg by leg, without any verdict; fewer rounds among keep-outs, where a loop takes long."""
    benchmark.group = group
    _, points, polygons = PLANS[group]
    plan, loops = (
        leg_planner("AtlasStateSpace", polygons),
        cycle([*loop, loop[0]] for loop in points),
    )
    rounds = {"rounds": 30, "warmup_rounds": 5} if polygons else WARM
    benchmark.pedantic(lambda: [plan(a, b) for a, b in pairwise(next(loops))], **rounds)


COLD: dict[str, list[Any]] = {
    "planned": TEXTS,
    "planned along a border": [(-1.2, 1.2), (0.1, 0.9), (0.1, -0.1), (-1.2, -0.05)],
    "refused with the nearest points": [(-0.6, 0.6), (0.9, -0.6)],
    "region": [],
}


def cold_group(answer: str) -> str:
    return f"a new vehicle each time, {answer}, against OMPL's loop of Gait 3"


@pytest.mark.parametrize("answer", COLD)
def test_a_new_vehicle_each_time_ours(benchmark: Any, answer: str) -> None:
    """Nothing is kept from a vehicle before, as in a service or in a study over constants."""
    benchmark.group = cold_group(answer)
    rng = np.random.default_rng(3)
    ratios = gg.PAPER.drag_ratio * rng.uniform(0.9, 1.1, 100)
    vehicles = iter([gg.PAPER.replace(drag_ratio=float(ratio)) for ratio in ratios])
    outcomes = {
        "planned": "planned",
        "planned along a border": "planned",
        "refused with the nearest points": "infeasible",
    }

    def answered() -> str:
        vehicle = next(vehicles)
        if answer == "region":
            return str(len(gg.admissible_region(vehicle).components) > 0)
        return gg.plan_loop(COLD[answer], vehicle=vehicle).status

    found = benchmark.pedantic(answered, rounds=60, warmup_rounds=5)
    assert found == outcomes.get(answer, "True")


@pytest.mark.parametrize("answer", COLD)
def test_a_new_vehicle_each_time_ompl(benchmark: Any, answer: str) -> None:
    """OMPL has no vehicle: it plans the loop of Gait 3 for the paper's, whatever is answered beside it."""
    benchmark.group = cold_group(answer)
    plan = leg_planner("AtlasStateSpace")
    legs = list(pairwise([*GAIT_3, GAIT_3[0]]))
    benchmark.pedantic(lambda: [plan(a, b) for a, b in legs], **WARM)


@pytest.fixture(scope="module")
def ground() -> PreparedRegion:
    """Return the admissible region, triangulated, with what the corners on the way see."""
    request = plan_request(ACROSS, color="red", keep_out=keep_outs())
    prepared = PreparedRegion(planning_region(request, "red", "negative", "flyable"))
    legs_of(prepared)
    return prepared


def legs_of(ground: PreparedRegion) -> list[Any]:
    return [ground.leg(a, b) for a, b in pairwise([*ACROSS, ACROSS[0]])]


def length_of_full_graph(region: Any) -> float:
    """Build the visibility graph of all corners of the keep-outs and the waypoints, edge by edge, and search it."""
    graph = visibility_graph(
        region, {*ACROSS, *(corner for polygon in keep_outs() for corner in polygon)}
    )
    legs = pairwise([*ACROSS, ACROSS[0]])
    return sum(nx.dijkstra_path_length(graph, a, b, weight="length") for a, b in legs)


FIFTY = "4 waypoints among 50 keep-outs of 20 corners against a full visibility graph"


@pytest.mark.benchmark(group=FIFTY)
def test_among_fifty_polygons_ours(benchmark: Any, ground: PreparedRegion) -> None:
    legs = benchmark.pedantic(lambda: legs_of(ground), rounds=21, warmup_rounds=1)
    length = sum(leg.length for leg in legs)
    assert length == pytest.approx(sum(leg.lower_bound for leg in legs), abs=1e-12)
    assert max(len(leg.points) for leg in legs) > 10


@pytest.mark.benchmark(group=FIFTY)
def test_among_fifty_polygons_edge_by_edge(
    benchmark: Any, ground: PreparedRegion
) -> None:
    length = benchmark.pedantic(
        lambda: length_of_full_graph(ground.region.inner), rounds=1
    )
    legs = legs_of(ground)
    assert sum(leg.length for leg in legs) == pytest.approx(length, abs=1e-12)
