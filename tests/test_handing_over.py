"""One way to hand over a gait, a vehicle, coefficients, points; what is none of them is refused in one line."""

from __future__ import annotations

import inspect
import json
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import gaitgraph as gg
from gaitgraph.cli import main
from gaitgraph.gait.gait import lift
from gaitgraph.graph.build import metadata_of
from tests.samples import public_callables

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

WAYPOINTS = [
    ("3pi/8", "-3pi/8"),
    ("3pi/8", "-pi/8"),
    ("pi/8", "-pi/8"),
    ("pi/8", "-3pi/8"),
]


def library(name: str) -> Any:
    """Return an imported library; the test skips where it is not installed."""
    return pytest.importorskip(name, reason=f"install {name}, of the extra 'dev'")


GAIT = lift(WAYPOINTS, "red")
TIMED, LIMITS = GAIT.parametrize(samples=8), gg.Limits(acceleration=40.0)
COLUMNS = dict(gg.timing.table_of(TIMED).columns)
FORMS: dict[str, Callable[[Path], Any]] = {
    "gait": lambda _: GAIT,
    "timed gait": lambda _: TIMED,
    "plan": lambda _: gg.plan_loop(WAYPOINTS),
    "other answer": lambda _: gg.least_period(GAIT, LIMITS, samples=8),
    "table": lambda _: gg.timing.table_of(TIMED),
    "pandas": lambda _: library("pandas").DataFrame(COLUMNS),
    "polars": lambda _: library("polars").DataFrame(COLUMNS),
    "array": lambda _: TIMED.alpha,
    "texts": lambda _: [[a, b, a, b] for a, b in WAYPOINTS],
    "file": lambda folder: str(folder / "gait.csv"),
    "path": lambda folder: folder / "gait.csv",
    "name": lambda _: "gait3",
}
USES: dict[str, Callable[[Any], Any]] = {
    "gait_of": lambda gait: np.allclose(
        gg.gait_of(gait).vertices(), GAIT.alpha, atol=1e-9
    ),
    "validate": lambda gait: gg.validate(gait).flyable,
    "robustness_of": lambda gait: (
        gg.robustness_of(gait, curves=0).gait.tilt_margin == pytest.approx(np.pi / 2)
    ),
    "retarget": lambda gait: gg.retarget(gait).status == "unchanged",
    "least_period": lambda gait: (
        gg.least_period(gait, LIMITS, samples=8).least == pytest.approx(1.122, abs=1e-3)
    ),
    "paced": lambda gait: gg.paced(gait, LIMITS, period=2.0),
    "transition": lambda gait: gg.transition(gait, gait),
    "servo_response": lambda gait: (
        gg.timing.servo_response(gait, 0.02).distance_off_sheet
        == pytest.approx(0.0, abs=1e-9)
    ),
    "rounded": lambda gait: len(gg.timing.rounded(gait, 0.05).corners) == 4,
    "table_of": lambda gait: (
        np.ptp(gg.timing.table_of(gait)["alpha1"]) == pytest.approx(np.pi / 4)
    ),
    "gait_loop": gg.plots.gait_loop,
    "roll_pitch_diagram": gg.plots.roll_pitch_diagram,
    "draw": lambda gait: gg.plots.draw("set", gait=gait),
    "from_hover": lambda gait: isinstance(gg.flight.from_hover(gait), str),  # R < 0
    "fly": lambda gait: gg.fly(gait, settings=gg.FlightSettings(duration=1.0)).settled,
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("gaits")
    TIMED.write(path / "gait.csv")
    return path


# All uses are through one function: those that take longer are tried with two forms.
QUICK = ("gait_of", "validate", "retarget", "table_of", "rounded", "gait_loop")
CASES = [
    (use, form)
    for use in USES
    for form in FORMS
    if use in QUICK or form in ("array", "file")
]


@pytest.mark.parametrize(("use", "form"), CASES)
def test_every_use_of_a_gait_takes_it_in_every_form(
    folder: Path, use: str, form: str
) -> None:
    assert USES[use](FORMS[form](folder))


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("request.json", '{"waypoints": [[0.8, -0.8]]}'),
        ("request.toml", "waypoints = [[0.8, -0.8]]"),
    ],
)
def test_a_request_is_no_gait(tmp_path: Path, name: str, text: str) -> None:
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    with pytest.raises(gg.InputError, match="a request,? (which )?is planned first"):
        gg.validate(path)


@pytest.mark.parametrize("form", FORMS)
def test_every_form_is_exported(folder: Path, form: str, tmp_path: Path) -> None:
    done = gg.export(FORMS[form](folder), tmp_path / "out.csv", period=2.0, samples=8)
    table = gg.read_table(tmp_path / "out.csv")
    assert (done.rows, table["t"][-1]) == (9, 2.0)
    assert len(gg.gait.vertices(table.alpha)) == 4


def test_an_optimal_gait_is_a_gait(tmp_path: Path) -> None:
    optimal = gg.optimal_gait(
        [(0.9, -0.9), (0.6, -0.4), (0.4, -0.8)], objective="hover_reserve"
    )
    rates = optimal.timed(samples=10).rate_checks()
    assert gg.validate(optimal).checks[-len(rates) :] == rates
    assert gg.gait_of(optimal).alpha.tolist() == optimal.gait.alpha.tolist()
    assert gg.export(optimal, tmp_path / "a.csv").rows == 101
    assert gg.read_table(tmp_path / "a.csv").about["made_by"] == "optimize"
    assert gg.export(optimal, tmp_path / "a.csv", rate=5, force=True).rows == 6
    with pytest.raises(gg.Infeasible, match="waypoint 1 .* is not flyable"):
        gg.validate(gg.optimal_gait([(1.5, 1.5)]))


@pytest.mark.parametrize(
    "vehicle",
    [
        "beetle_omni",
        {"preset": "beetle_omni"},
        "own.toml",
        gg.vehicle_named("beetle_omni"),
    ],
)
def test_vehicles_and_coefficients_in_every_form(
    vehicle: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "own.toml").write_text('preset = "beetle_omni"', encoding="utf-8")
    kappa = gg.vehicle_named("beetle_omni").drag_ratio
    exact = gg.invertibility.coefficients_of(vehicle)
    for coefficients in ("exact", exact, None):
        own: Any = {"vehicle": vehicle, "coefficients": coefficients}
        loop = [(-0.8, 0.8), (-0.8, 0.4), (-0.4, 0.4)]
        for gait in (
            lift(loop, "red", **own),
            gg.gait_of([(a, b, a, b) for a, b in loop], **own),
        ):
            assert (gait.vehicle.drag_ratio, gait.coefficients) == (kappa, exact)
        assert gg.plan_loop(loop, **own).request.vehicle.drag_ratio == kappa
        assert (
            gg.admissible_region(**own).area
            == gg.admissible_region(gg.vehicle_named("beetle_omni")).area
        )
        assert gg.colorings(loop, **own).count == 1
        assert (
            metadata_of(gg.surface_graph(divisions=4, **own))["vehicle"]["drag_ratio"]
            == kappa
        )
        assert gg.validate(TIMED.alpha, **own).valid


ROWS = [(-0.8, 0.8, -0.8, 0.8), (-0.8, 0.4, -0.8, 0.4), (-0.4, 0.4, -0.4, 0.4)]
LOOP = [row[:2] for row in ROWS]
OF_A_VEHICLE: dict[str, Callable[[Any], Any]] = {
    "Gait": lambda one: gg.Gait(alpha=ROWS, vehicle=one),
    "admissible_region": lambda one: gg.admissible_region(one, accuracy=1e-3).area,
    "certify": lambda one: gg.certify(ROWS, vehicle=one).document,
    "colorings": lambda one: gg.colorings(LOOP, vehicle=one),
    "gait_of": lambda one: gg.gait_of(ROWS, vehicle=one),
    "lift": lambda one: gg.lift(LOOP, "red", vehicle=one),
    "location_of": lambda one: gg.location_of(LOOP, vehicle=one),
    "mission": lambda one: gg.mission(ROWS, vehicle=one).period,
    "optimal_gait": lambda one: gg.optimal_gait(
        LOOP, vehicle=one, pieces=8, objective="hover_reserve"
    ),
    "plan_loop": lambda one: gg.plan_loop(LOOP, vehicle=one),
    "retarget": lambda one: gg.retarget(ROWS, vehicle=one).after,
    "robustness_of": lambda one: gg.robustness_of(ROWS, vehicle=one, curves=0),
    "robustness.drag_margin": lambda one: gg.robustness.drag_margin(ROWS, one).proven,
    "surface.servo_margin_region": lambda one: (
        gg.surface.servo_margin_region(0.1, one).area
    ),
    "robustness.servo_margin": lambda one: gg.robustness.servo_margin(ROWS, one).proven,
    "roots": lambda one: gg.roots(0.3, 0.2, vehicle=one),
    "surface_graph": lambda one: gg.surface_graph(divisions=4, vehicle=one).graph,
    "transition": lambda one: gg.transition("hover", ROWS, vehicle=one),
    "validate": lambda one: gg.validate(ROWS, vehicle=one),
    "vehicle_named": gg.vehicle_named,
    "flight.Engine": lambda one: gg.flight.Engine(one).model.body_mass,
    "invertibility.Geometry.of_vehicle": lambda one: (
        gg.invertibility.Geometry.of_vehicle(one).position
    ),
    "invertibility.coefficients_of": gg.invertibility.coefficients_of,
    "invertibility.least_singular_value_within": lambda one: (
        gg.invertibility.least_singular_value_within(ROWS, 0.1, one)[0]
    ),
    "FlightSettings.arms_of": gg.FlightSettings().arms_of,
    "ServoMap.linked_to": gg.io.servo_map_named("x_frame").linked_to,
    "ServoMap.check_vehicle": gg.io.servo_map_named("x_frame").check_vehicle,
    "planning.Replanner": lambda one: gg.planning.Replanner(one, rate=5.0).vehicle,
    "planning.PlanRequest": lambda one: gg.planning.PlanRequest(
        waypoints=tuple(LOOP), vehicle=one
    ),
    "surface.curved_sheet": lambda one: gg.surface.curved_sheet(one).angles(-0.3, 0.3),
    "plots.draw": lambda one: gg.plots.draw("2", vehicle=one).axes[0].lines,
    "plots.regions_map": lambda one: gg.plots.regions_map(one).lines,
    "plots.singular_value_map": lambda one: gg.plots.singular_value_map(one).lines,
    "plots.type_map": lambda one: gg.plots.type_map(vehicle=one).lines,
    "plots.vehicle_figure": lambda one: gg.plots.vehicle_figure(one).lines,
    "plots.vehicle_view": lambda one: gg.plots.vehicle_view(ROWS[0], one).arms,
    "robustness.singular_curve": lambda one: (
        gg.robustness.singular_curve((-0.8, 0.8, 0.2, 0.3), vehicle=one).normal
    ),
    "robustness.acceptable_attitudes": lambda one: (
        gg.robustness.acceptable_attitudes(ROWS, vehicle=one).fraction
    ),
    "surface.hover_region": lambda one: gg.surface.hover_region(one).area,
    "surface.red_label": lambda one: gg.surface.red_label(0.15, -0.2, one),
    "surface.root_arrays": lambda one: gg.surface.root_arrays(0.3, 1, vehicle=one).R,
    "surface.sheet_angles": lambda one: gg.surface.sheet_angles(
        "blue", 0.3, 0.2, vehicle=one
    ),
    "surface.sign_region": lambda one: (
        gg.surface.sign_region("positive", one, accuracy=1e-3).area
    ),
    "surface.singular_value_region": lambda one: (
        gg.surface.singular_value_region(0.1, one, accuracy=1e-3).area
    ),
    "surface.thrust_region": lambda one: (
        gg.surface.thrust_region(0.4, one, accuracy=1e-3).area
    ),
    "export": lambda one: gg.export(ROWS, "a.csv", vehicle=one, period=1, force=True),
    "plots.write_figures": lambda one: gg.plots.write_figures(
        ".", only=["2"], vehicle=one, formats=["svg"], force=True
    ),
    "timing.played": lambda one: gg.timing.played(ROWS, vehicle=one),
    "timing.timed_gait_of": lambda one: gg.timing.timed_gait_of(
        ROWS, vehicle=one, period=1.0
    ),
}
OF_ANGLES = (
    "control_force_matrix control_moment_matrix decoupling_matrix hover_thrust_shares hover_power "
    "least_singular_value zero_moment_direction attitude_sensitivities determinant "
    "level_determinant roll_sensitivity pitch_sensitivity nearest_singular_attitude tilt_margin"
).split()
ANSWERS = {  # records that functions return
    "planning.Replan",
    "robustness.Robustness",
    "robustness.RobustnessReport",
    "timing.Curve",
}
BIASED = (-0.8, 0.8, 0.2, 0.3)


def of_angles(name: str) -> Callable[[Any], Any]:
    """Return what a function of tilt angles and a vehicle gives for a vehicle."""
    package = gg.surface if name == "sheet_distances" else gg.invertibility
    return lambda one: getattr(package, name)(BIASED, vehicle=one)


OF_A_VEHICLE |= {f"invertibility.{name}": of_angles(name) for name in OF_ANGLES}
OF_A_VEHICLE |= {"surface.sheet_distances": of_angles("sheet_distances")}


def as_text(answer: Any) -> str:
    """Return what an answer says, all digits of arrays and lines of a picture."""
    if isinstance(answer, (list, tuple)):
        return "\n".join(map(as_text, answer))
    if hasattr(answer, "get_xydata"):
        return as_text(answer.get_xydata())
    return str(np.asarray(answer).tolist() if hasattr(answer, "tolist") else answer)


def test_every_public_function_of_a_vehicle_is_tried() -> None:
    takers = set()
    for name, value in public_callables():
        with suppress(ValueError):  # of a type without a signature
            parameter = inspect.signature(value).parameters.get("vehicle")
            if parameter is not None:
                takers.add(name)
    assert takers == {*OF_A_VEHICLE, *ANSWERS}


def test_the_bias_has_one_name() -> None:
    for name, value in public_callables():
        with suppress(ValueError):
            parameters = inspect.signature(value).parameters
            assert not {"eta", "etas", "biases"} & {*parameters}, name
        assert not hasattr(value, "eta"), name


@pytest.mark.parametrize("name", OF_A_VEHICLE)
def test_the_name_of_a_preset_is_a_vehicle(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    use, padova = OF_A_VEHICLE[name], gg.vehicle_named("padova")
    assert as_text(use("padova")) == as_text(use(padova))
    with pytest.raises(gg.InputError, match="did you mean 'padova'"):
        use("padovo")


WRONG: list[Any] = [
    None,
    3,
    True,
    1j,
    float("nan"),
    "x",
    "no.csv",
    b"x",
    object(),
    {},
    [],
    [[1, 2]],
    [["a"] * 4],
    np.zeros((2, 3)),
]
OTHERS: dict[str, Any] = {
    "sign": "negative",
    "start": "hover",
    "colors": "red",
    "outputs": ["out.csv"],
}
OTHERS |= {
    "alpha1": 0.1,
    "alpha2": 0.2,
    "points": [(0.1, 0.2)],
    "waypoints": [(1.5, 1.5)],  # which no gait passes, and that is found at once
}


FUNCTIONS = [
    name
    for name in gg.__all__  # type: ignore[attr-defined]
    if not isinstance(getattr(gg, name), type)
]


@pytest.mark.parametrize("name", FUNCTIONS)
def test_what_is_none_of_them_is_refused_in_one_line(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    function = getattr(gg, name)
    parameters = (
        inspect.signature(function).parameters.values() if callable(function) else ()
    )
    needed = [one.name for one in parameters if one.default is one.empty]
    for changed in [
        *needed,
        *(one.name for one in parameters if one.name in ("vehicle", "coefficients")),
    ]:
        for value in WRONG:
            given = {other: OTHERS.get(other, GAIT) for other in needed} | {
                changed: value
            }
            try:
                function(**given)
            except gg.GaitgraphError as error:
                assert "\n" not in str(error)


@pytest.mark.parametrize("name", ["pandas", "polars"])
def test_a_frame_without_tilt_angles_is_refused_in_one_line(name: str) -> None:
    frame = library(name).DataFrame({"a": [1]})
    for wrong in (frame, frame.lazy() if name == "polars" else frame.T):
        with pytest.raises(gg.GaitgraphError) as refused:
            gg.gait_of(wrong)
        assert "\n" not in str(refused.value)


REFUSALS: dict[str, Callable[[], Any]] = {
    "plan": lambda: gg.plan_loop([(1.5, 1.5), (0.3, -0.3)]),
    "transition": lambda: gg.transition("hover", GAIT),
    "optimal gait": lambda: gg.optimal_gait([(1.5, 1.5)]),
}


@pytest.mark.parametrize("name", REFUSALS)
def test_a_refusal_raises_its_reason_for_what_it_does_not_have(name: str) -> None:
    refusal = REFUSALS[name]()
    assert not refusal
    for missing in ("gait", "report"):
        with pytest.raises(gg.Infeasible) as caught:
            getattr(refusal, missing)
        assert str(caught.value).startswith(refusal.reason)
    with pytest.raises(gg.Infeasible):
        gg.validate(refusal)


def test_commands_plan_a_request_or_say_why_not(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "request.toml"
    for sign, code in (("negative", 0), ("positive", 1)):
        path.write_text(
            f"waypoints = [[0.8, -0.8], [0.4, -0.4]]\nsign = '{sign}'", encoding="utf-8"
        )
        for command in (
            ["validate"],
            ["pace", "--max-acceleration", "40"],
            ["robustness"],
            ["fly", "--duration", "1"],
        ):
            with pytest.raises(SystemExit) as ended:
                main([command[0], str(path), *command[1:], "--json"])
            assert ended.value.code == code, command
            told = capsys.readouterr()
            answer = json.loads(told.out)
            assert code == 0 or (
                answer.keys() == {"status", "reason"}
                and answer["status"] == "infeasible"
            )
            assert told.err == ""


VERBS = {
    "as_mapping",
    "in_radians",
    "as_dict",
    "look_ahead",
    "merged",
    "once",
    "reversed",
    "to_pandas",
}


def test_what_has_no_argument_is_a_property() -> None:
    """All but conversions, other gaits and work."""
    for name, value in public_callables():
        if "." in name and inspect.isfunction(value):
            alone = [*inspect.signature(value).parameters] == ["self"]
            assert not alone or value.__name__ in VERBS, name
