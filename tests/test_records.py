"""Records go to JSON and come back equal; they are equal by value, and so are their copies."""

from __future__ import annotations

import copy
import json
import math
import pickle
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from shapely import Polygon

import gaitgraph as gg
from gaitgraph.records import Record, plain, rebuilt
from gaitgraph.vehicle import vehicle_named

if TYPE_CHECKING:
    from collections.abc import Callable

LOOP = [(-0.4, 0.4), (-0.4, 1.2), (-1.2, 1.2), (-1.2, 0.4)]
LIMITED = gg.PAPER.replace(max_tilt_rate=6.0, max_tilt_acceleration=150.0)


def gait() -> gg.Gait:
    return gg.lift(LOOP, "red", vehicle=LIMITED)


RECORDS: dict[str, Callable[[], Record]] = {
    "vehicle": lambda: gg.PAPER,
    "rectangular vehicle": lambda: vehicle_named("beetle_art"),
    "plan": lambda: gg.plan_loop(LOOP),
    "plan among keep-outs": lambda: gg.plan_loop(
        LOOP, keep_out=[[(-0.5, 0.7), (-0.3, 0.7), (-0.4, 0.9)]]
    ),
    "refusal": lambda: gg.plan_loop([(-0.6, 0.6), (0.9, -0.6)]),
    "request": lambda: (
        gg.plan_loop(LOOP, keep_in=[[(-2, 0), (0, 0), (0, 2), (-2, 2)]]).request
    ),
    "gait": gait,
    "timed gait": lambda: gait().parametrize(2.0, law="equal-time"),
    "paced gait": lambda: gg.least_period(gait(), rounding="5deg", nodes=60),
    "gait of rows": lambda: gg.timing.timed_gait_of(gait().parametrize().alpha),
    "mission": lambda: gg.mission(gait().parametrize(2.0)),
    "table": lambda: gg.timing.table_of("gait3"),
    "report": lambda: gg.validate("gait1"),
    "robustness": lambda: gg.robustness_of("gait4", bias=0.8),
    "retargeted": lambda: gg.retarget("gait3", sign="positive"),
    "transition": lambda: gg.transition("hover", "gait4"),
    "certificate": lambda: gg.certificates.certify("gait4"),
    "optimal gait": lambda: gg.optimal_gait(LOOP, radius=0.1),
}


@pytest.mark.parametrize("name", RECORDS)
def test_it_comes_back_equal_from_json_from_a_pickle_and_as_a_copy(name: str) -> None:
    record = RECORDS[name]()
    text = json.dumps(record.as_dict(), allow_nan=False)
    for again in (
        type(record).from_dict(json.loads(text)),
        pickle.loads(pickle.dumps(record)),
        copy.deepcopy(record),
        RECORDS[name](),
    ):
        assert again == record
        assert hash(again) == hash(record)
        assert str(again) == str(record)
    assert json.dumps(type(record).from_dict(json.loads(text)).as_dict()) == text
    assert record != object()


def test_another_value_is_not_equal() -> None:
    first = gait()
    moved = gg.lift([*LOOP[:3], (-1.2, 0.4 + 1e-15 + 1e-16)], "red", vehicle=LIMITED)
    assert first != moved
    assert first != gg.lift(LOOP, "red")
    timed = first.parametrize(1.0)
    assert timed != first.parametrize(1.0, samples=7)
    assert replace(timed, samples=7) == first.parametrize(1.0, samples=7)
    assert len({first, gait(), moved}) == 2


@pytest.mark.parametrize(
    "value",
    [
        (1, (2.5, None)),
        {"type": "tuple"},
        {3: math.inf},
        [np.float64(2.0)],
        np.array([[1.0, -math.inf]]),
        np.array([True, False]),
    ],
)
def test_values_that_json_does_not_tell_apart_stay_what_they_are(value: Any) -> None:
    again = rebuilt(json.loads(json.dumps(plain(value), allow_nan=False)))
    np.testing.assert_equal(again, value)
    assert type(again) is type(value)


def test_nan_comes_back() -> None:
    assert math.isnan(rebuilt(plain(math.nan)))


@pytest.mark.parametrize(
    "wrong",
    [
        {},
        {"type": "gaitgraph.gait.gait.Gait"},
        {"type": "os.system", "items": ["true"]},
        {"type": "gaitgraph.files.write_whole", "contents": [], "force": True},
        {"type": "gaitgraph.nothing.Nothing"},
        {"type": "array", "dtype": "float64", "items": "abc"},
        {"type": "tuple"},
        {"type": "geometry", "wkb": "00"},
        {"type": ["tuple"]},
        {"type": "array", "dtype": "<i8", "items": [10**30]},
    ],
)
def test_other_mappings_are_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(gg.InputError) as refused:
        gg.Gait.from_dict(wrong)
    assert "\n" not in str(refused.value)


def test_a_changed_field_is_checked_as_in_the_constructor() -> None:
    stated = gait().as_dict()
    stated["colors"] = ["green"] * 4
    with pytest.raises(gg.InputError, match="color"):
        gg.Gait.from_dict(stated)
    with pytest.raises(gg.InputError, match="must be that of a TimedGait"):
        gg.timing.TimedGait.from_dict(gait().as_dict())


def test_what_has_no_form_in_json_is_refused() -> None:
    with pytest.raises(gg.InputError, match="must have a form in JSON"):
        plain(print)


def test_answers_from_many_threads_are_those_of_one() -> None:
    rng = np.random.default_rng(5)

    def answer(k: int) -> str:
        vehicle = gg.PAPER.replace(drag_ratio=float(ratios[k]))
        plan = gg.plan_loop(loops[k].tolist(), vehicle=vehicle)
        return json.dumps(plan.as_dict())

    ratios = rng.uniform(0.1, 0.25, 24)
    loops = rng.uniform((-1.4, -0.5), (0.5, 1.4), (24, 3, 2))
    with ThreadPoolExecutor(8) as pool:
        together = list(pool.map(answer, range(24)))
    assert together == [answer(k) for k in range(24)]


def test_a_mapping_that_is_nested_too_deeply_is_refused() -> None:
    nested: dict[str, Any] = {}
    for _ in range(5000):
        nested = {"a": nested}
    with pytest.raises(gg.InputError, match="nested too deeply"):
        gg.Gait.from_dict(nested)


def test_a_region_is_stated_by_its_polygons() -> None:
    region = gg.admissible_region("paper")
    stated = json.loads(json.dumps(region.as_dict()))
    areas = [Polygon(shell, holes).area for shell, *holes in stated["inner"]]
    assert sum(areas) == pytest.approx(region.inner.area)
    assert stated["conditions"]
