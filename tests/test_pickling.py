"""Public objects go to other processes and are copied, and no number in them is changed from outside."""

from __future__ import annotations

import copy
import inspect
import pickle
from functools import cache
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from shapely import Polygon

import gaitgraph as gg
from gaitgraph.certificates.check import check
from gaitgraph.flight.engine import engine_warnings
from gaitgraph.study.design import study_from_mapping
from tests.samples import public_callables

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

LOOP = [(-0.4, 0.4), (-0.4, 1.2), (-1.2, 1.2), (-1.2, 0.4)]
BAR = [(0.5, 0.5), (0.7, 0.5), (0.7, 0.7)]
LIMITED = gg.PAPER.replace(max_tilt=1.3, max_thrust=5.0, max_tilt_rate=9.0)
LIMITS = gg.Limits(rate=5, acceleration=50)
ZONES = gg.surface.Zones(keep_out=[BAR])


@cache
def plan() -> Any:
    return gg.plan_loop(LOOP, keep_out=[BAR])


@cache
def gait() -> Any:
    return gg.lift(LOOP, "red")


@cache
def timed() -> Any:
    return gait().parametrize(1.0)


@cache
def rounded() -> Any:
    return gg.timing.rounded(gait(), "2deg")


@cache
def course() -> Any:
    return gg.flight.from_hover(timed())


@cache
def joined() -> Any:
    return gg.transition("hover", timed().gait.parametrize(law="constant-speed")).timed


@cache
def basin() -> Any:
    return gg.basins_of(timed(), bias=0.9, resolution=1)[0]


def cycles() -> Any:
    return gg.cycles(gg.surface_graph("positive", divisions=4))


def exported() -> Any:
    with TemporaryDirectory() as folder:
        return gg.export(gait(), f"{folder}/a.csv", period=1.0)


STUDY: dict[str, Any] = {"name": "s", "gaits": ["gait4"], "flight": {"duration": 1.0}}
SQUARE = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]


def study() -> Any:
    return study_from_mapping(STUDY)


MADE: dict[str, Callable[[], Any]] = {
    "AcceptableAttitudes": lambda: gg.robustness_of(gait()).gait.acceptable,
    "Basin": basin,
    "Certified": lambda: gg.certify(gait()),
    "Verified": lambda: gg.certificates.Verified(found=check(gg.certify(gait()).text)),
    "Check": lambda: gg.validate(gait()).checks[0],
    "Coefficients": gg.invertibility.coefficients_of,
    "Coloring": lambda: next(iter(gg.colorings(LOOP))),
    "ColoringObstacle": lambda: next(iter(gg.colorings(LOOP).obstacles.values())),
    "Colorings": lambda: gg.colorings(LOOP),
    "Condition": lambda: gg.admissible_region(LIMITED).conditions[0],
    "Course": course,
    "Curve": lambda: rounded().curve,
    "CurvedSheet": lambda: gg.surface.curved_sheet("paper"),
    "Cycle": lambda: next(cycles()),
    "Engine": lambda: gg.flight.Engine(gg.PAPER),
    "Exported": exported,
    "ErrorMargin": lambda: gg.robustness.servo_margin(gait().alpha),
    "Flight": lambda: gg.fly(timed()),
    "FlightSettings": gg.FlightSettings,
    "Gait": gait,
    "Geometry": lambda: gg.invertibility.Geometry.of_vehicle(gg.PAPER),
    "JoinedPath": joined,
    "Joint": lambda: gg.io.servo_map_named("x_frame").joints[0],
    "LeastPeriod": lambda: gg.least_period(gait(), LIMITS, rounding="2deg"),
    "LimitedGait": lambda: gg.least_period(gait(), LIMITS).timed,
    "Limits": lambda: LIMITS,
    "Motion": lambda: timed().at(0.3),
    "OptimalGait": lambda: gg.optimal_gait(
        LOOP, radius=0.05, objective="hover_reserve"
    ),
    "Plan": plan,
    "PlanRequest": lambda: plan().request,
    "Region": lambda: gg.admissible_region(LIMITED, zones=ZONES),
    "Replan": lambda: gg.planning.Replanner(LIMITED).replan([-0.4, 0.4] * 2, LOOP),
    "Replanner": lambda: gg.planning.Replanner(LIMITED),
    "Report": lambda: gg.validate(gait()),
    "Retargeted": lambda: gg.retarget(gait()),
    "Robustness": lambda: gg.robustness_of(gait()).gait,
    "RobustnessReport": lambda: gg.robustness_of(gait()),
    "Rounding": rounded,
    "RunUp": lambda: joined().sections[-1],
    "ServoMap": lambda: gg.io.servo_map_named("x_frame"),
    "ServoResponse": lambda: gg.timing.servo_response(timed(), 0.02),
    "ShortestPaths": lambda: gg.planning.ShortestPaths(Polygon(SQUARE)),
    "Simulation": lambda: gg.flight.Simulation(course(), gg.FlightSettings()),
    "SingularCurve": lambda: gg.robustness.singular_curve([0.3, -0.2, 0.1, 0.4]),
    "Study": study,
    "Table": lambda: gg.timing.table_of(gait()),
    "TimedGait": timed,
    "TimedPath": lambda: gg.transition("hover", gait()).timed,
    "Transition": lambda: gg.transition("hover", gait()),
    "Vehicle": lambda: LIMITED,
    "VehicleView": lambda: gg.plots.vehicle_view(gait().alpha[0]),
    "Zones": lambda: ZONES,
}
OTHERS: dict[str, Callable[[], Any]] = {  # that functions return
    "graph": lambda: gg.surface_graph("negative", divisions=4),
    "hover region": gg.surface.hover_region,
    "location": lambda: gg.location_of(LOOP, keep_out=[BAR]),
    "refusal": lambda: gg.plan_loop([(1.5, 1.5)]),
    "root arrays": lambda: gg.surface.root_arrays(0.3, 0.2),
    "roots": lambda: gg.roots(0.3, 0.2),
}


MADE = {name: cache(make) for name, make in MADE.items()}


def test_every_public_class_is_tried() -> None:
    classes = {
        name.rpartition(".")[2] for name, one in public_callables() if is_made(one)
    }
    assert classes == {*MADE}


def is_made(one: Any) -> bool:
    """Return whether a public name is a class of objects other than errors."""
    return inspect.isclass(one) and not issubclass(one, (Exception, Warning))


@pytest.mark.parametrize("name", [*MADE, *OTHERS])
def test_it_is_pickled_and_copied(name: str) -> None:
    one = (MADE | OTHERS)[name]()
    assert name in OTHERS or type(one).__name__ == name
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
RECORDS: dict[str, Callable[[], Any]] = (
    MADE
    | OTHERS
    | {
        "row by row": lambda: gg.timing.timed_gait_of(
            {"t": [0.0, 0.4], "alpha1": [0.4, 0.8], "alpha2": [-0.4, -0.4]}
            | {"color": "red"}
        ),
        "paced": lambda: gg.paced(gait(), LIMITS),
    }
)
for name in (
    "Motion",
    "Engine",
    "Simulation",
):  # the arrays are the caller's, or change
    del RECORDS[name]
WITHOUT_ARRAYS = {
    "AcceptableAttitudes",
    "Certified",
    "Check",
    "Coloring",
    "ColoringObstacle",
    "Condition",
    "Cycles",
    "Verified",
    "FlightSettings",
    "Joint",
    "ServoMap",
    "ShortestPaths",
    "Zones",
    "graph",
    "roots",
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
            if field.startswith("_") or callable(inspect.getattr_static(one, field)):
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
    assert bool(found) != (name in WITHOUT_ARRAYS)


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


def test_an_engine_and_a_simulation_fly_the_same_after_the_way() -> None:
    engine = gg.flight.Engine(gg.PAPER)
    engine.place([0.1, 0.2, 0.1, 0.2])
    again = pickle.loads(pickle.dumps(engine))
    for one in (engine, again):
        one.data.ctrl[:4] = 1.0
        one.mujoco.mj_step(one.model, one.data)
    assert (engine.data.qpos == again.data.qpos).all()
    again.data.qvel[:] = 1e12
    with engine_warnings():  # else they are written into the working folder
        again.mujoco.mj_step(again.model, again.data)
    assert (engine.gave_up, again.gave_up) == (False, True)
    simulation = gg.flight.Simulation(course(), gg.FlightSettings())
    flights = [
        one.run((0.1, 0.0))
        for one in (simulation, pickle.loads(pickle.dumps(simulation)))
    ]
    assert (flights[0].rows == flights[1].rows).all()
