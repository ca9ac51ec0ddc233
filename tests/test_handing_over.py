"""One way to hand over a gait, a vehicle, coefficients, angles; and the names of what takes them."""

from __future__ import annotations

import inspect
import json
import math
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import gaitgraph as gg
from tests.calls import CALLS, FUNCTIONS, GAIT, LIMITS, LOOP, POINT, ROWS, TIMED

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

COLUMNS = dict(gg.timing.table_of(TIMED).columns)


def library(name: str) -> Any:
    """Return an imported library; the test skips where it is not installed."""
    return pytest.importorskip(name, reason=f"install {name}, of the extra 'dev'")


FORMS: dict[str, Callable[[Path], Any]] = {
    "gait": lambda _: GAIT,
    "timed gait": lambda _: TIMED,
    "plan": lambda _: gg.plan_loop(LOOP),
    "other answer": lambda _: gg.least_period(GAIT, LIMITS, samples=8),
    "table": lambda _: gg.timing.table_of(TIMED),
    "pandas": lambda _: library("pandas").DataFrame(COLUMNS),
    "polars": lambda _: library("polars").DataFrame(COLUMNS),
    "columns": lambda _: COLUMNS,
    "array": lambda _: GAIT.alpha,
    "texts": lambda _: [[str(angle) for angle in row] for row in ROWS],
    "file": lambda folder: str(folder / "gait.csv"),
    "path": lambda folder: folder / "gait.csv",
}


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("files")
    TIMED.write(made / "gait.csv")
    TIMED.write(made / "there.csv")
    gg.certify(GAIT).write(made / "proof.json")
    return made


@pytest.fixture
def folder(files: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(files)
    monkeypatch.setattr("gaitgraph.plots.planes._MARGINS", 9)
    return files


@pytest.mark.parametrize("form", FORMS)
def test_a_gait_is_taken_in_every_form(folder: Path, form: str) -> None:
    given = FORMS[form](folder)
    np.testing.assert_allclose(gg.gait_of(given).vertices(), GAIT.alpha, atol=1e-9)
    assert gg.validate(given).flyable
    assert gg.export(given, "out.csv", period=2.0, samples=8, force=True).rows == 9
    assert gg.read_table("out.csv")["t"][-1] == 2.0


OF_A_GAIT = [
    (name, argument)
    for name, call in CALLS.items()
    for argument in ("gait", "source", "path")
    if argument in call and name not in ("read_table", "TimedGait")
]


@pytest.mark.parametrize(("name", "argument"), OF_A_GAIT)
@pytest.mark.usefixtures("folder")
def test_every_function_of_a_gait_takes_the_name_of_a_file(
    name: str, argument: str
) -> None:
    FUNCTIONS[name](**CALLS[name] | {argument: "gait.csv"})


def as_text(answer: Any) -> str:
    """Return what an answer says, all digits of arrays and lines of a picture."""
    if isinstance(answer, (list, tuple)):
        return "\n".join(map(as_text, answer))
    for name in ("lines", "inner", "position", "document"):
        answer = getattr(answer, name, answer)
    if hasattr(answer, "get_xydata"):
        answer = answer.get_xydata()
    text = str(np.asarray(answer).tolist() if hasattr(answer, "tolist") else answer)
    return "" if " at 0x" in text else text


OF_A_VEHICLE = [
    name for name in CALLS if "vehicle" in inspect.signature(FUNCTIONS[name]).parameters
]


@pytest.mark.parametrize("name", OF_A_VEHICLE)
@pytest.mark.usefixtures("folder")
def test_a_vehicle_is_taken_by_its_name(name: str) -> None:
    call = CALLS[name] | ({"gait": ROWS} if "gait" in CALLS[name] else {})
    call |= {"source": ROWS} if "source" in call else {}
    answers = [
        as_text(FUNCTIONS[name](**call | {"vehicle": vehicle}))
        for vehicle in ("padova", gg.vehicle_named("padova"))
    ]
    assert answers[0] == answers[1]
    with pytest.raises(gg.InputError, match="did you mean 'padova'"):
        FUNCTIONS[name](**call | {"vehicle": "padovo"})


ANSWERS = {  # records that functions return, and methods of records
    "FlightSettings.arms_of",
    "ServoMap.check_vehicle",
    "ServoMap.linked_to",
    "invertibility.Geometry.of_vehicle",
    "planning.PlanRequest",
    "planning.Replan",
    "robustness.Robustness",
    "robustness.RobustnessReport",
    "timing.Curve",
}


def test_every_public_function_of_a_vehicle_is_tried_and_the_bias_has_one_name() -> (
    None
):
    takers = set()
    for name, value in FUNCTIONS.items():
        with suppress(ValueError):  # of a type without a signature
            parameters = {*inspect.signature(value).parameters}
            if "vehicle" in parameters:
                takers.add(name)
            assert not {"eta", "etas", "biases"} & parameters, name
        assert not hasattr(value, "eta"), name
    assert takers == {*OF_A_VEHICLE, *ANSWERS}


@pytest.mark.parametrize("vehicle", [{"preset": "beetle_omni"}, "own.toml"])
def test_vehicles_and_coefficients_in_every_form(vehicle: Any, folder: Path) -> None:
    (folder / "own.toml").write_text('preset = "beetle_omni"', encoding="utf-8")
    exact = gg.invertibility.coefficients_of("beetle_omni")
    for coefficients in ("exact", exact, None):
        gait = gg.gait_of(ROWS, vehicle=vehicle, coefficients=coefficients)
        kappa = gg.vehicle_named("beetle_omni").drag_ratio
        assert gait.vehicle.drag_ratio == kappa
        assert gait.coefficients == exact


def test_texts_are_angles_in_every_function() -> None:
    texts, numbers = ["pi/8", "0.1", "22.5deg", 0.1], [math.pi / 8, 0.1] * 2
    for name in CALLS:
        if CALLS[name].get("alpha") is POINT:
            answers = [
                as_text(FUNCTIONS[name](**CALLS[name] | {"alpha": alpha}))
                for alpha in (texts, numbers)
            ]
            assert answers[0] == answers[1], name


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


REFUSALS: list[Callable[[], Any]] = [
    lambda: gg.plan_loop([(1.5, 1.5), (0.3, -0.3)]),
    lambda: gg.transition("hover", "gait3"),
    lambda: gg.optimal_gait([(1.5, 1.5)]),
]


@pytest.mark.parametrize("refuse", REFUSALS)
def test_a_refusal_raises_its_reason_for_what_it_does_not_have(
    refuse: Callable[[], Any],
) -> None:
    refusal = refuse()
    assert not refusal
    for missing in ("gait", "report"):
        with pytest.raises(gg.Infeasible) as caught:
            getattr(refusal, missing)
        assert str(caught.value).startswith(refusal.reason)
    with pytest.raises(gg.Infeasible):
        gg.validate(refusal)


@pytest.mark.parametrize(("sign", "code"), [("negative", 0), ("positive", 1)])
def test_commands_plan_a_request_or_say_why_not(run: Any, sign: str, code: int) -> None:
    waypoints = "waypoints = [[0.8, -0.8], [0.4, -0.4]]\n"
    with open("request.toml", "w", encoding="utf-8") as file:  # noqa: PTH123
        file.write(f"{waypoints}sign = '{sign}'")
    for command in ("validate", "pace --max-acceleration 40", "fly --duration 1"):
        name, *options = command.split()
        done = run(name, "request.toml", *options, "--json")
        assert (done.code, done.err) == (code, "")
        if code:
            assert json.loads(done.out)["status"] == "infeasible"


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
    for name, value in FUNCTIONS.items():
        if "." in name and inspect.isfunction(value):
            alone = [*inspect.signature(value).parameters] == ["self"]
            assert not alone or value.__name__ in VERBS, name
