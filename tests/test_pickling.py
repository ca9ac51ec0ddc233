"""Public objects go to other processes and are copied, and no number in them is changed from outside."""

from __future__ import annotations

import copy
import pickle
from functools import cache
from inspect import getattr_static
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import gaitgraph as gg

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

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


ROWS = np.array([[0.4, -0.4, 0.4, -0.4], [0.8, -0.4, 0.8, -0.4]])
BRIEF = gg.FlightSettings(duration=1.0)
LIMITS = gg.timing.Limits(rate=5, acceleration=50)
RECORDS: dict[str, Callable[[], Any]] = MADE | {
    "row by row": lambda: gg.timing.timed_gait_of(
        {"t": [0.0, 0.4], **dict(zip(("alpha1", "alpha2"), ROWS.T[:2], strict=True))}
        | {"color": "red"}
    ),
    "paced": lambda: gg.paced(plan().gait, LIMITS),
    "limits": lambda: LIMITS,
    "servo response": lambda: gg.timing.servo_response(plan().timed(), 0.01),
    "view": lambda: gg.plots.vehicle_view(ROWS),
    "coefficients": lambda: plan().gait.coefficients,
    "geometry": lambda: gg.invertibility.Geometry.of_vehicle("paper"),
    "singular curve": lambda: gg.robustness.singular_curve(ROWS[0]),
    "root arrays": lambda: gg.surface.root_arrays(*ROWS.T[:2]),
    "replan": lambda: gg.planning.Replanner(LIMITED).replan([0.0] * 4, LOOP),
    "flight": lambda: gg.fly(plan().gait, settings=BRIEF),
    "basin": lambda: gg.basins_of(plan().gait, bias=1, settings=BRIEF, resolution=3),
}


def arrays_in(one: Any, name: str, seen: set[int]) -> Iterator[tuple[str, Any]]:
    """Yield every array that the fields and properties of an object hand out, with its name."""
    if isinstance(one, np.ndarray):
        yield name, one
        return
    if id(one) in seen or not type(one).__module__.startswith(
        ("gaitgraph", "builtins")
    ):
        return
    seen.add(id(one))
    if isinstance(one, dict):
        for key, value in one.items():
            yield from arrays_in(value, f"{name}[{key!r}]", seen)
    elif isinstance(one, (tuple, list)):
        for k, value in enumerate(one):
            yield from arrays_in(value, f"{name}[{k}]", seen)
    elif type(one).__module__ != "builtins":
        for field in dir(one):
            if field.startswith("_") or callable(getattr_static(one, field)):
                continue
            try:
                value = getattr(one, field)
            except gg.GaitgraphError:
                continue
            yield from arrays_in(value, f"{name}.{field}", seen)


@pytest.mark.parametrize("name", RECORDS)
def test_its_arrays_cannot_be_written_to(name: str) -> None:
    found = list(arrays_in(RECORDS[name](), name, set()))
    assert [place for place, array in found if array.flags.writeable] == []
    assert found or name in {
        "vehicle", "region", "hover region", "request", "report", "certificate", "location",
        "replanner", "graph",
    }  # fmt: skip


def test_a_number_written_into_an_answer_is_refused() -> None:
    timed = plan().timed()
    for array in (
        timed.alpha,
        timed.t,
        timed.gait.ends,
        gg.timing.table_of(timed)["t"],
    ):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.5


def test_an_array_that_was_given_stays_its_owners() -> None:
    alpha1 = np.array([0.4, 0.8])
    table = gg.Table(columns={"alpha1": alpha1})
    alpha1[0] = 0.5
    assert alpha1.flags.writeable
    assert not table["alpha1"].flags.writeable


def test_a_table_has_no_masked_values() -> None:
    masked = np.ma.array([0.4, 0.8], mask=[False, True])
    with pytest.raises(gg.InputError, match="alpha1 must have no masked .* row 2"):
        gg.Table(columns={"alpha1": masked})
