"""Any-angle planning against other planners; the peer OMPL is an extra, ``peers``, and left out where it is missing."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import shapely

import gaitgraph as gg
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.planning.any_angle import straight_loop
from gaitgraph.planning.branch import Branch, Search
from gaitgraph.planning.request import plan_request
from tests.published import GAITS

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

GAIT_3 = GAITS[2].angles
COEFFICIENTS = coefficients_of()
# OMPL's first hundred loops of Gait 3 take up to ten times as long as later ones, so they do not count.
WARM = {"rounds": 100, "warmup_rounds": 150}


def leg_planner(
    polygons: Sequence[Any] = (),
    *,
    sign: int = -1,
    step: float = 0.05,
    seconds: float = 5.0,
) -> Callable[[Any, Any], Any]:
    """Return OMPL's planning of one leg: RRTConnect on equations (7) and (8), with a checker of color and sign of R.

    The checker keeps out of `polygons` too; it is asked along the way at steps, 0.05 rad if OMPL chooses.
    """
    reason = "OMPL is not installed: pip install gaitgraph[peers]"
    base: Any = pytest.importorskip("ompl.base", reason=reason)
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

    def red_with_the_sign(state: Any) -> bool:
        a1, a2, a3, a4 = (state[k] for k in range(4))
        if abs(a1 - a3) > 0.03 or abs(a2 - a4) > 0.03:
            return False
        if polygons and shapely.intersects_xy(forbidden, a1, a2):
            return False
        bracket = 2 * kappa * math.cos(a1) * math.cos(a2) - math.sin(a1 - a2)
        return sign * math.cos(a1 - delta) * math.cos(a2 + delta) * bracket > 0

    def plan(first: Any, last: Any) -> Any:
        """Return the length of a path between two points (α1, α2) of red."""
        ambient, bounds = base.RealVectorStateSpace(4), base.RealVectorBounds(4)
        bounds.setLow(-math.pi / 2)
        bounds.setHigh(math.pi / 2)
        ambient.setBounds(bounds)
        constrained = base.AtlasStateSpace(ambient, Surfaces())
        constrained.setDelta(step)
        information = base.ConstrainedSpaceInformation(constrained)
        setup = geometric.SimpleSetup(information)
        setup.setStateValidityChecker(red_with_the_sign)
        ends = constrained.allocState(), constrained.allocState()
        for end, point in zip(ends, (first, last), strict=True):
            end.copy([*point, *point])
            constrained.anchorChart(end)
        setup.setStartAndGoalStates(*ends)
        setup.setPlanner(geometric.RRTConnect(information))
        setup.setup()
        assert setup.solve(seconds)
        assert setup.haveExactSolutionPath()
        return setup.getSolutionPath().length()

    return plan


def legs(stops: Sequence[Any]) -> list[tuple[Any, Any]]:
    return list(pairwise([*stops, stops[0]]))


@pytest.mark.benchmark(group="the loop of Gait 3 against OMPL")
def test_gait_3_ours(benchmark: Any) -> None:
    """From a request to a loop that is proven flyable and shortest, lifted to all four angles."""
    request = plan_request(GAIT_3, color="red", sign="negative")

    def planned() -> gg.Gait:
        branch = Branch(
            search=Search(request), color="red", sign="negative", require="flyable"
        )
        loop = straight_loop(branch)
        assert loop is not None
        return loop.path

    assert benchmark(planned).length == pytest.approx(math.pi, abs=1e-12)


@pytest.mark.benchmark(group="the loop of Gait 3 against OMPL")
def test_gait_3_ompl(benchmark: Any) -> None:
    """Leg by leg; each state space is built anew for each leg, as OMPL wants it."""
    plan = leg_planner()
    lengths: list[float] = []
    benchmark.pedantic(
        lambda: lengths.append(sum(plan(a, b) for a, b in legs(GAIT_3))), **WARM
    )
    # In four dimensions the shortest is √2 times as long.
    assert min(lengths) >= math.sqrt(2) * math.pi * (1 - 1e-3)


SQUARE = [(-0.4, 0.4), (-0.4, 1.2), (-1.2, 1.2), (-1.2, 0.4)]
ON_A_SIDE = [(-0.5, 0.7), (-0.3, 0.7), (-0.3, 0.9), (-0.5, 0.9)]
# Of a vehicle with raised rotors; on flat ones loops rarely follow a curved border.
CURVED = "planned along a curved border"
COLD: dict[str, dict[str, Any]] = {
    "planned": {"waypoints": GAIT_3},
    "planned round a keep-out": {"waypoints": SQUARE, "keep_out": [ON_A_SIDE]},
    CURVED: {"waypoints": [(-1.4, 1.4), (-1.5, 0.2), (-1.1, 1.4)]},
    "refused with the nearest points": {"waypoints": [(-0.6, 0.6), (0.9, -0.6)]},
    "region": {},
}


@pytest.mark.parametrize("answer", COLD)
def test_a_new_vehicle_each_time_ours(benchmark: Any, answer: str) -> None:
    """Nothing is kept from a vehicle before, as in a service or in a study over constants."""
    benchmark.group = f"a new vehicle each time, {answer}"
    ratios = gg.PAPER.drag_ratio * np.random.default_rng(3).uniform(0.9, 1.1, 100)
    like = gg.PAPER.replace(rotor_height=0.03 if answer == CURVED else 0.0)
    vehicles = iter([like.replace(drag_ratio=float(ratio)) for ratio in ratios])

    def answered() -> bool:
        vehicle = next(vehicles)
        if answer == "region":
            return len(gg.admissible_region(vehicle).components) > 0
        return bool(gg.plan_loop(vehicle=vehicle, **COLD[answer]))

    found = benchmark.pedantic(answered, rounds=60, warmup_rounds=5)
    assert found == (not answer.startswith("refused"))


@pytest.mark.parametrize(
    ("answer", "sign"), [("planned", -1), ("planned round a keep-out", 1)]
)
def test_a_new_vehicle_each_time_ompl(benchmark: Any, answer: str, sign: int) -> None:
    """The same loops leg by leg, on the paper's surface and with one sign of R alone."""
    benchmark.group = f"a new vehicle each time, {answer}"
    asked = COLD[answer]
    plan = leg_planner(asked.get("keep_out", ()), sign=sign)
    ends = legs(asked["waypoints"])
    benchmark.pedantic(lambda: [plan(a, b) for a, b in ends], **WARM)
