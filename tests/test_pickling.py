"""Public objects go to other processes, and are copied."""

from __future__ import annotations

import copy
import pickle
from functools import cache
from typing import TYPE_CHECKING, Any

import pytest

import gaitgraph as gg

if TYPE_CHECKING:
    from collections.abc import Callable

LOOP = [(-0.4, 0.4), (-0.4, 1.2), (-1.2, 1.2), (-1.2, 0.4)]
BAR = [(0.5, 0.5), (0.7, 0.5), (0.7, 0.7)]
LIMITED = gg.PAPER.replace(max_tilt=1.3, max_thrust=5.0, max_tilt_rate=9.0)
ZONES = gg.surface.Zones(keep_out=[BAR])


@cache
def plan() -> Any:
    return gg.plan_loop(LOOP, keep_out=[BAR])


MADE: dict[str, Callable[[], Any]] = {
    "vehicle": lambda: LIMITED,
    "region": lambda: gg.admissible_region(LIMITED, zones=ZONES),
    "hover region": gg.surface.hover_region,
    "plan": plan,
    "request": lambda: plan().request,
    "gait": lambda: plan().gait,
    "timed gait": lambda: plan().timed(),
    "table": lambda: gg.timing.table_of(plan().gait),
    "report": lambda: gg.validate(plan().gait),
    "robustness": lambda: gg.robustness_of(plan().gait),
    "certificate": lambda: gg.certify(plan().gait),
    "transition": lambda: gg.transition("hover", plan().gait),
    "retargeted": lambda: gg.retarget(plan().gait),
    "optimal gait": lambda: gg.optimal_gait(LOOP, radius=0.05),
    "least period": lambda: gg.least_period(
        plan().gait, gg.timing.Limits(rate=5, acceleration=50), rounding="2deg"
    ),
    "colourings": lambda: gg.surface.colorings(LOOP),
    "location": lambda: gg.location_of(LOOP, keep_out=[BAR]),
    "replanner": lambda: gg.planning.Replanner(LIMITED),
    "graph": lambda: gg.graph.surface_graph("negative"),
}


@pytest.mark.parametrize("name", MADE)
def test_it_is_pickled_and_copied(name: str) -> None:
    one = MADE[name]()
    for other in (
        pickle.loads(pickle.dumps(one)),
        copy.copy(one),
        copy.deepcopy(one),
    ):
        assert type(other) is type(one)
        assert str(other) == str(one) or " at 0x" in str(one)


def test_a_region_explains_itself_after_the_way() -> None:
    region = gg.admissible_region(LIMITED, zones=ZONES)
    again = pickle.loads(pickle.dumps(region))
    for point in ((0.65, 0.55), (1.4, 0.0), (-0.4, 0.4), (0.1, 0.1)):
        assert again.why_not(point) == region.why_not(point)
