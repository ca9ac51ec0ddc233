"""Public objects go to JSON, to other processes and into copies, equal by value; and nobody writes to their arrays."""

from __future__ import annotations

import copy
import inspect
import json
import math
import pickle
import sys
from enum import Enum
from functools import cache
from io import StringIO
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from shapely import Point, Polygon

import gaitgraph as gg
from gaitgraph.certificates.check import check
from gaitgraph.records import Record, plain, rebuilt
from gaitgraph.study.design import study_from_mapping
from tests.samples import public_callables

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

LOOP = [(-0.4, 0.4), (-0.4, 1.2), (-1.2, 1.2), (-1.2, 0.4)]
BAR = [(0.5, 0.5), (0.7, 0.5), (0.7, 0.7)]
LIMITED = gg.PAPER.replace(max_tilt=1.3, max_thrust=5.0, max_tilt_rate=9.0)
LIMITS = gg.Limits(rate=5, acceleration=50)
ZONES = gg.surface.Zones(keep_out=[BAR])
SQUARE = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
STUDY: dict[str, Any] = {"name": "s", "gaits": ["gait4"]}
GAIT = gg.lift(LOOP, "red")
TIMED = GAIT.parametrize(1.0)
X_FRAME = gg.io.servo_map_named("x_frame")
SETTINGS = gg.FlightSettings()


@cache
def graph() -> Any:
    return gg.surface_graph("negative", divisions=4)


@cache
def plan() -> Any:
    return gg.plan_loop(LOOP[:2], keep_out=[BAR])


@cache
def course() -> Any:
    return gg.flight.from_hover(TIMED)


@cache
def colorings() -> Any:
    return gg.colorings(LOOP)


@cache
def robustness() -> Any:
    return gg.robustness_of(gg.lift(LOOP[:2], "red"), bias=0.8, curves=0)


@cache
def rounding() -> Any:
    return gg.timing.rounded(GAIT, "2deg")


@cache
def transition() -> Any:
    return gg.transition("hover", GAIT.parametrize(law="constant-speed"))


MADE: dict[str, Callable[[], Any]] = {
    "AcceptableAttitudes": lambda: robustness().gait.acceptable,
    "Basin": lambda: gg.basins_of(TIMED, bias=0.9, resolution=1)[0],
    "Certified": lambda: gg.certify(GAIT),
    "Check": lambda: gg.validate(GAIT).checks[0],
    "Coefficients": gg.invertibility.coefficients_of,
    "Coloring": lambda: next(iter(colorings())),
    "ColoringRefusal": lambda: next(iter(colorings().refusals.values())),
    "Colorings": colorings,
    "Comparison": lambda: gg.robustness.comparison_of([gg.lift(LOOP[:2], "red")]),
    "Condition": lambda: gg.admissible_region(LIMITED).conditions[0],
    "Course": course,
    "Curve": lambda: rounding().curve,
    "CurvedSheet": lambda: gg.surface.curved_sheet("paper"),
    "Cycle": lambda: next(gg.cycles(gg.surface_graph("positive", divisions=4))),
    "Engine": lambda: gg.flight.Engine(gg.PAPER),
    "ErrorMargin": lambda: gg.robustness.servo_margin(GAIT.alpha),
    "Exported": lambda: gg.export(GAIT, [], period=1.0),
    "Flight": lambda: gg.fly(TIMED, settings=gg.FlightSettings(duration=0.1)),
    "FlightSettings": lambda: SETTINGS,
    "Gait": lambda: GAIT,
    "Geometry": lambda: gg.invertibility.Geometry.of_vehicle(gg.PAPER),
    "JoinedPath": lambda: transition().timed,
    "Joint": lambda: X_FRAME.joints[0],
    "LeastPeriod": lambda: gg.least_period(GAIT, LIMITS, nodes=30),
    "LimitedGait": lambda: gg.least_period(GAIT, LIMITS).timed,
    "Limits": lambda: LIMITS,
    "Motion": lambda: TIMED.at(0.3),
    "OptimalGait": lambda: gg.optimal_gait(
        LOOP[:1], objective="hover_reserve", pieces=8
    ),
    "Plan": plan,
    "PlanRequest": lambda: plan().request,
    "Region": lambda: gg.admissible_region(LIMITED, zones=ZONES),
    "Replan": lambda: gg.planning.Replanner(LIMITED).replan([-0.4, 0.4] * 2, LOOP),
    "Replanner": lambda: gg.planning.Replanner(LIMITED),
    "Report": lambda: gg.validate(GAIT),
    "Retargeted": lambda: gg.retarget(GAIT, sign="positive"),
    "Robustness": lambda: robustness().gait,
    "RobustnessReport": robustness,
    "Rounding": rounding,
    "RunUp": lambda: transition().timed.sections[-1],
    "ServoMap": lambda: X_FRAME,
    "ServoResponse": lambda: gg.timing.servo_response(TIMED, 0.02),
    "ShortestPaths": lambda: gg.planning.ShortestPaths(Polygon(SQUARE)),
    "Simulation": lambda: gg.flight.Simulation(course(), SETTINGS),
    "SingularCurve": lambda: gg.robustness.singular_curve([0.3, -0.2, 0.1, 0.4]),
    "Study": lambda: study_from_mapping(STUDY),
    "Table": lambda: gg.timing.table_of(GAIT),
    "TimedGait": lambda: TIMED,
    "TimedPath": lambda: gg.transition("hover", GAIT).timed,
    "Transition": transition,
    "Vehicle": lambda: LIMITED,
    "VehicleView": lambda: gg.plots.vehicle_view(GAIT.alpha[0]),
    "Verified": lambda: gg.certificates.Verified(found=check(gg.certify(GAIT).text)),
    "Zones": lambda: ZONES,
}
OTHERS: dict[str, Callable[[], Any]] = {  # that functions return
    "closed walk": lambda: gg.graph.closed_walk(graph(), [["003 002 red"]]),
    "gait of rows": lambda: gg.timing.timed_gait_of(GAIT.alpha, period=1.0),
    "graph": graph,
    "location": lambda: gg.location_of(LOOP, keep_out=[BAR]),
    "mission": lambda: gg.mission(TIMED),
    "paced": lambda: gg.paced(GAIT, LIMITS),
    "table of a file": lambda: gg.read_table(
        StringIO("alpha1,alpha2,alpha3,alpha4\n0.1,-0.2,0.1,-0.2"), format="csv"
    ),
    "rectangular vehicle": lambda: gg.vehicle_named("beetle_art"),
    "refusal": lambda: gg.plan_loop([(1.5, 1.5)]),
    "root arrays": lambda: gg.surface.root_arrays(0.3, 0.2),
    "roots": lambda: gg.roots(0.3, 0.2),
    "settings": lambda: gg.FlightSettings(reference="circle", size=2.0, lap=9.0),
}
ALL = {name: cache(make) for name, make in (MADE | OTHERS).items()}


def test_every_public_class_is_tried() -> None:
    classes = {
        name.rpartition(".")[2]
        for name, value in public_callables()
        if inspect.isclass(value) and not issubclass(value, (Exception, Warning))
    }
    assert classes == {*MADE}


@pytest.mark.parametrize("name", ALL)
def test_it_is_pickled_copied_and_if_it_is_a_record_comes_back_from_json(
    name: str,
) -> None:
    made = ALL[name]()
    assert name in OTHERS or type(made).__name__ == name
    others = [pickle.loads(pickle.dumps(made)), copy.copy(made), copy.deepcopy(made)]
    is_record = isinstance(made, Record)
    # A region is stated by its polygons, a cycle without its graph.
    if is_record and name not in ("Region", "Cycle"):
        text = json.dumps(made.as_dict(), allow_nan=False)
        again = type(made).from_dict(json.loads(text))
        assert json.dumps(again.as_dict()) == text
        others.append(again)
    elif is_record:
        with pytest.raises(gg.InputError, match="^mapping must not be that of a "):
            type(made).from_dict(made.as_dict())
    for other in others:
        assert type(other) is type(made)
        assert str(other) == str(made) or " at 0x" in str(made)
        if is_record:
            assert other == made
            assert hash(other) == hash(made)
            assert other != object()


def test_another_value_is_not_equal() -> None:
    moved = gg.lift([*LOOP[:3], (-1.2, math.nextafter(0.4, 1.0))], "red")
    for other in (moved, gg.lift(LOOP, "red", vehicle=LIMITED)):
        assert other != GAIT
    assert GAIT.parametrize(1.0, samples=7) != TIMED
    assert len({GAIT, gg.lift(LOOP, "red"), moved}) == 2
    assert gg.Gait(alpha=[[0.0] * 4]) == gg.Gait(alpha=[[-0.0] * 4])


SCALARS = st.none() | st.booleans() | st.integers() | st.text() | st.floats()
VALUES = st.recursive(
    SCALARS,
    lambda inner: (
        st.lists(inner)
        | st.tuples(inner, inner)
        | st.dictionaries(st.text() | st.just("type") | st.integers(), inner)
    ),
    max_leaves=8,
)
ARRAYS = [np.array([[1.0, -math.inf]]), np.array([True, False]), np.arange(3)]


@settings(max_examples=50, deadline=None)
@given(VALUES | st.sampled_from(ARRAYS))
def test_values_that_json_does_not_tell_apart_stay_what_they_are(value: Any) -> None:
    again = rebuilt(json.loads(json.dumps(plain(value), allow_nan=False)))
    assert type(again) is type(value)
    np.testing.assert_equal(again, value)


def test_geometries_and_numbers_of_numpy_have_a_form_and_functions_have_none() -> None:
    assert rebuilt(plain(Point(1.0, 2.0))) == Point(1.0, 2.0)
    assert plain(np.float64(2.0)) == 2.0
    assert type(plain(np.int64(2))) is int
    for value in (print, np.array(["a"]), Enum):
        with pytest.raises(gg.InputError, match="must have a form in JSON"):
            plain(value)
    for item in ("x", None, [0.5]):
        with pytest.raises(gg.InputError):
            rebuilt({"type": "array", "dtype": "<f8", "items": [0.5, item]})


GAIT_KIND = "gaitgraph.gait.gait.Gait"


@pytest.mark.parametrize(
    "wrong",
    [
        {},
        {"type": GAIT_KIND},
        {"type": "os.system", "items": ["true"]},
        {"type": "gaitgraph.files.write_whole", "contents": [], "force": True},
        {"type": "gaitgraph.records.Record"},
        {"type": "gaitgraph.nothing.Nothing"},
        {"type": "this.Zen"},
        {"type": "array", "dtype": "float64", "items": "abc"},
        {"type": "array", "dtype": "<i8", "items": [10**30]},
        {"type": "tuple"},
        {"type": "geometry", "wkb": "00"},
        {"type": ["tuple"]},
        GAIT.as_dict() | {"colors": ["green"] * 4},
        TIMED.as_dict(),
    ],
)
def test_other_mappings_are_refused_in_one_line(wrong: dict[str, Any]) -> None:
    with pytest.raises(gg.InputError) as refused:
        gg.Gait.from_dict(wrong)
    assert "\n" not in str(refused.value)
    assert "this" not in sys.modules  # no module of others is loaded


@pytest.mark.parametrize(
    ("field", "wrong", "said"),
    [
        ("hover_power", "1.0", r"hover_power must be float \| None, got '1.0'"),
        ("rows", True, r"rows must be int \| None, got True"),
        ("hover_power", 1 << 1000, r"hover_power must be float \| None, got 1071"),
        ("reachability", 1.0, "reachability must be str, got 1.0"),
        ("checks", {"type": "tuple", "items": "ok"}, "items must be a list, got 'ok'"),
    ],
)
def test_a_number_or_text_of_another_kind_is_named(
    field: str, wrong: Any, said: str
) -> None:
    stated = gg.validate(GAIT).as_dict()
    with pytest.raises(gg.InputError, match=f"^{said}"):
        gg.Report.from_dict(stated | {field: wrong})


@pytest.mark.parametrize("name", ["Gait", "Report", "Table", "Plan", "PlanRequest"])
def test_a_field_that_a_mapping_lacks_or_has_beside_is_named(name: str) -> None:
    made = ALL[name]()
    stated = made.as_dict()
    for field in stated.keys() - {"type"}:
        less = {key: value for key, value in stated.items() if key != field}
        with pytest.raises(gg.InputError) as caught:
            type(made).from_dict(less)
        assert caught.value.field == field
        assert f"must have {field}, got none" in str(caught.value)
    with pytest.raises(gg.InputError, match="has no field 'more'") as caught:
        type(made).from_dict(stated | {"more": 1})
    assert caught.value.field == "more"
    with pytest.raises(gg.InputError, match="type must be one that as_dict"):
        type(made).from_dict(stated | {"type": [1]})


def test_whole_numbers_of_json_are_numbers_too() -> None:
    stated = gg.validate(GAIT).as_dict()
    assert gg.Report.from_dict(stated | {"hover_power": 2}).hover_power == 2


@pytest.mark.parametrize("wrong", [[0.0] * 3, [0.0] * 5, [0.0, 0.0, 0.0, "x"]])
def test_a_tuple_has_as_many_items_as_its_field_states(wrong: Any) -> None:
    stated = gg.FlightSettings().as_dict()
    errors = {"type": "tuple", "items": wrong}
    with pytest.raises(gg.InputError, match="^servo_errors must be tuple"):
        gg.FlightSettings.from_dict(stated | {"servo_errors": errors})


RECORDS = sorted(name for name in MADE if name not in ("Region", "Cycle"))


@pytest.mark.parametrize("name", RECORDS)
def test_another_record_in_a_field_is_refused_at_once_with_its_place(name: str) -> None:
    made = ALL[name]()
    if not isinstance(made, Record):
        return
    stated = made.as_dict()
    for field in stated.keys() - {"type"}:
        with pytest.raises(gg.InputError) as refused:
            type(made).from_dict(stated | {field: X_FRAME.joints[0].as_dict()})
        assert refused.value.field == field
        assert "\n" not in str(refused.value)


def test_what_is_wrong_inside_a_record_has_its_place() -> None:
    stated = plan().as_dict()
    stated["request"]["vehicle"]["mass"] = "heavy"
    with pytest.raises(gg.InputError, match="mass must be") as refused:
        gg.Plan.from_dict(stated)
    assert refused.value.field == "request.vehicle.mass"
    stated = gg.validate(GAIT).as_dict()
    stated["checks"]["items"][1]["value"] = "x"
    with pytest.raises(gg.InputError) as refused:
        gg.Report.from_dict(stated)
    assert (refused.value.field, refused.value.value) == ("checks.1.value", "x")


@pytest.mark.parametrize(
    ("field", "wrong", "said"),
    [
        ("document", {}, "document must be .* with the names format, .* claims"),
        ("document", {"claims": 3}, "document must be .*: claims must be .* got 3"),
        ("document", {"pieces": "x"}, "document must be .*: pieces must be .* got 'x'"),
        ("document", {"claims": math.nan}, "document must be .*: claims must be "),
        ("intervals", {"joints": 3}, "intervals must have the names joints, least_"),
    ],
)
def test_a_certificate_without_its_claims_is_refused(
    field: str, wrong: dict[str, Any], said: str
) -> None:
    stated = gg.certify(GAIT).as_dict()
    if wrong and field == "document":
        wrong = stated["document"] | wrong
    with pytest.raises(gg.InputError, match=f"^{said}") as refused:
        gg.certificates.Certified.from_dict(stated | {field: wrong})
    assert refused.value.field == field


def cost(first: Any, second: Any, edge: dict[str, float]) -> float:
    return edge["length"]


def test_a_plan_with_an_own_cost_is_pickled_and_has_no_mapping() -> None:
    made = gg.plan_loop(LOOP, divisions=4, weight=cost)
    assert pickle.loads(pickle.dumps(made)) == made
    with pytest.raises(gg.InputError, match="have a form in JSON") as refused:
        made.as_dict()
    assert refused.value.field == "weight"


def test_a_mapping_that_is_nested_too_deeply_is_refused() -> None:
    nested: dict[str, Any] = {}
    for _ in range(5000):
        nested = {"a": nested}
    with pytest.raises(gg.InputError, match="nested too deeply"):
        gg.Gait.from_dict(nested)


def test_a_region_explains_itself_after_the_way_and_is_stated_by_its_polygons() -> None:
    region = ALL["Region"]()
    again = pickle.loads(pickle.dumps(region))
    for point in ((0.65, 0.55), (1.4, 0.0), (-0.4, 0.4), (0.1, 0.1)):
        assert again.why_not(point) == region.why_not(point)
    stated = json.loads(json.dumps(region.as_dict()))
    areas = [Polygon(shell, holes).area for shell, *holes in stated["inner"]]
    assert sum(areas) == pytest.approx(region.inner.area)


CHANGING = {"Motion", "Engine", "Simulation"}  # the arrays are the caller's, or change
WITHOUT_ARRAYS = {"closed walk"} | set(
    "AcceptableAttitudes Certified Check Coloring ColoringRefusal Condition FlightSettings "
    "Joint ServoMap ShortestPaths Verified Zones graph roots settings".split()
)


def arrays_in(value: Any, name: str, seen: set[int]) -> Iterator[tuple[str, Any]]:
    """Yield every array that the fields and properties of an object hand out, with its name."""
    if isinstance(value, np.ndarray):
        yield name, value
        return
    home = type(value).__module__
    if id(value) in seen or not home.startswith(("gaitgraph", "builtins")):
        return
    seen.add(id(value))
    if isinstance(value, dict):
        for key, item in value.items():
            yield from arrays_in(item, f"{name}[{key!r}]", seen)
    elif isinstance(value, (tuple, list)):
        for k, item in enumerate(value):
            yield from arrays_in(item, f"{name}[{k}]", seen)
    elif home != "builtins":
        for field in dir(value):
            if field.startswith("_") or callable(inspect.getattr_static(value, field)):
                continue
            try:
                item = getattr(value, field)
            except gg.GaitgraphError:
                continue
            yield from arrays_in(item, f"{name}.{field}", seen)


@pytest.mark.parametrize("name", sorted(ALL.keys() - CHANGING))
def test_its_arrays_cannot_be_written_to(name: str) -> None:
    made = ALL[name]()
    others = [made]
    if isinstance(made, Record):
        others += [copy.deepcopy(made), pickle.loads(pickle.dumps(made))]
    for other in others:
        arrays = list(arrays_in(other, name, set()))
        assert [place for place, array in arrays if array.flags.writeable] == []
        assert bool(arrays) != (name in WITHOUT_ARRAYS)


def test_the_mappings_of_a_table_cannot_be_changed() -> None:
    table = gg.timing.table_of(TIMED)
    for taken in (table, copy.deepcopy(table), pickle.loads(pickle.dumps(table))):
        for mapping in (taken.columns, taken.about, taken.about["vehicle"]):
            with pytest.raises(TypeError, match="read-only"):
                mapping["alpha1"] = 0.0
            with pytest.raises(TypeError, match="read-only"):
                mapping.update(alpha1=0.0)
        assert taken == table
    given = np.array([0.4, 0.8])
    kept = gg.Table(columns={"alpha1": given})
    given[0] = 0.5  # an array that was given stays its owner's
    with pytest.raises(ValueError, match="read-only"):
        kept["alpha1"][0] = 1.5


def test_answers_with_rows_go_to_pandas() -> None:
    pytest.importorskip("pandas", reason="install pandas")
    report = gg.validate(GAIT)
    checks = report.to_pandas().set_index("name")
    assert list(checks.index) == [check.name for check in report.checks]
    assert checks.loc["R_sign", "value"] == report["R_sign"].value
    gaits = robustness().to_pandas()
    stated = [each.as_mapping() for each in (robustness().gait, *robustness().sweep)]
    assert gaits.verdict.tolist() == [each["verdict"] for each in stated]
    assert "singular_curves" not in gaits
