"""What a notebook shows of an object: HTML that is safe, small and true; its text and its repr."""

from __future__ import annotations

import base64
import json
import math
import re
import sys
from dataclasses import replace
from functools import cache
from html.parser import HTMLParser
from io import BytesIO
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from matplotlib import pyplot as plt
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from PIL import Image

import gaitgraph as gg
from gaitgraph.plots.axes import RED as RED_LINE
from gaitgraph.study.design import study_from_mapping
from gaitgraph.vehicle import preset_names, vehicle_named

if TYPE_CHECKING:
    from collections.abc import Callable

NASTY = "<script>alert(\"x\")</script><img src=x onerror='y'> & co"
SQUARE = [(1.178, -1.178), (1.178, -0.393), (0.393, -0.393), (0.393, -1.178)]
RED, BLUE = gg.lift(SQUARE, "red"), gg.lift(SQUARE, "blue")
HOSTILE = gg.Vehicle(
    name=NASTY, drag_ratio=0.1, first_arm_angle=math.pi / 4, max_thrust=4.0
)
LIMITED = gg.PAPER.replace(
    max_tilt_rate=5.0, max_tilt_acceleration=50.0, max_tilt_jerk=500.0
)
ROUND = np.linspace(0, 2 * np.pi, 3000, endpoint=False)
CORNERS = [(-0.4, 0.4), (-0.4, 1.2), (-1.2, 1.2)]
BAR = [(-0.9, 0.3), (-0.7, 0.3), (-0.7, 0.6), (-0.9, 0.6)]

MADE: dict[str, Callable[[], Any]] = {
    "red gait": lambda: RED,
    "biased gait": lambda: RED.biased(0.8),
    "mixed gait": lambda: gg.lift(
        [(0.2, 0.4), (0.9, 0.3), (0.5, 0.8)], ["red", "blue", "red"]
    ),
    "point": lambda: gg.lift([(0.4, -0.4)], "red"),
    "gait out of the square": lambda: gg.Gait(
        alpha=np.array([[2.0, -0.3, 0.1, 9.0], [0.3, -3.0, 0.1, 9.0]])
    ),
    "long gait": lambda: gg.lift(
        np.column_stack([0.3 * np.cos(ROUND) - 0.8, 0.3 * np.sin(ROUND) + 0.8]), "red"
    ),
    "gait of a hostile name": lambda: gg.lift(
        [(-0.4, 0.4), (-0.4, 0.8)], "red", vehicle=HOSTILE
    ),
    "timed gait": lambda: RED.parametrize(2.0),
    "timed at full speed": lambda: BLUE.parametrize(law="equal-time"),
    "timed with limits": lambda: gg.lift(SQUARE, "red", vehicle=LIMITED).parametrize(),
    "table": lambda: gg.timing.table_of(RED.parametrize(2.0)),
    "table of a plane loop": lambda: gg.timing.table_of(
        {"alpha1": [0.4, 0.8], "alpha2": [-0.4, -0.5], "color": "red"}
    ),
    "report": lambda: gg.validate(RED),
    "report of blue": lambda: gg.validate(BLUE),
    "report with notes": lambda: replace(
        gg.validate(RED), reachable_from_hover=None, notes=("a <note>",)
    ),
    "plan": lambda: gg.plan_loop(SQUARE),
    "no plan": lambda: gg.plan_loop([(0.5, 0.5)], color="red", sign="negative"),
    "no plan on blue": lambda: gg.plan_loop(
        [(0.5, 0.5)], color="blue", coefficients="exact"
    ),
    "plan with polygons": lambda: gg.plan_loop(CORNERS, keep_out=[BAR]),
    "vehicle": lambda: LIMITED,
    "hostile vehicle": lambda: HOSTILE,
    "region": gg.admissible_region,
    "empty region": lambda: gg.admissible_region(floor=1.5),
}


@cache
def made(name: str) -> Any:
    return MADE[name]()


class Page(HTMLParser):
    """The elements and texts of a page; raises if they do not nest."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.elements: list[tuple[str, dict[str, str]]] = []
        self.texts: list[str] = []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, {name: value or "" for name, value in attrs}))
        if tag != "img":
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.texts.append(data)

    def of(self, tag: str) -> list[dict[str, str]]:
        return [attributes for name, attributes in self.elements if name == tag]

    @property
    def text(self) -> str:
        return " ".join(self.texts)


def page_of(one: Any) -> Page:
    return Page(one._repr_html_())


@pytest.mark.parametrize("name", MADE)
def test_pages_are_small_and_safe_and_texts_fit_a_screen(name: str) -> None:
    one = made(name)
    text, lines = one._repr_html_(), str(one).splitlines()
    page = Page(text)
    assert len(text.encode()) < 60_000
    assert {tag for tag, _ in page.elements} <= {"div", "strong", "pre", "img"}
    assert not any(
        {"id", "class", "href"} & set(attributes) for _, attributes in page.elements
    )
    assert page.texts[0] == lines[0]
    assert set(str(one).split()) <= set(
        page.text.split()
    )  # names and messages of the user, whatever they hold
    pictures = page.of("img")
    assert len(pictures) == (0 if "report" in name else 1)
    for picture in pictures:
        assert picture["alt"]
        with Image.open(
            BytesIO(
                base64.b64decode(picture["src"].removeprefix("data:image/png;base64,"))
            )
        ) as image:
            assert image.width == pytest.approx(2 * int(picture["width"]), abs=2)
    assert 1 < len(lines) < 40
    assert max(map(len, lines)) <= 240
    assert re.fullmatch(rf"(?!.*array).*{type(one).__name__}.*", repr(one))
    assert len(repr(one)) < (400 if isinstance(one, gg.Vehicle) else 200)


def test_without_matplotlib_there_is_the_text(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    for name in ("red gait", "timed gait", "plan", "region", "vehicle"):
        assert "img" not in made(name)._repr_html_()


def test_a_gait_shows_its_loop_and_its_region() -> None:
    assert "shaded: where a red gait with R < 0 is flyable" in page_of(RED).text
    assert "its loop in the plane of α1 and α2" in page_of(RED.biased(0.8)).text
    ax = RED.plot(ax=Figure().add_subplot())
    np.testing.assert_allclose(
        np.asarray(ax.lines[-1].get_xydata())[:4], RED.alpha[:, :2]
    )
    assert to_hex(ax.lines[-1].get_color()) == RED_LINE
    region = gg.admissible_region(sign="negative", accuracy=1e-3)
    assert len(ax.patches) == len(region.components)
    shaded = [np.asarray(patch.get_path().vertices) for patch in ax.patches]
    assert shaded[0][:, 0].min() == pytest.approx(
        region.components[0].bounds[0], abs=2e-3
    )


def test_texts_state_peaks_and_limits() -> None:
    timed = made("timed gait")
    for k, line in enumerate(timed.plot(ax=Figure().add_subplot()).lines):
        np.testing.assert_allclose(
            line.get_xydata(), np.column_stack([timed.t, timed.alpha[:, k]])
        )
    assert f"tilt rate: peak {timed.peak_rates.max():.3g} rad/s" in str(timed)
    limited = str(made("timed with limits"))
    assert all(f"limit {limit}" in limited for limit in (5, 50, 500))
    assert "the vehicle states no limit" in str(timed)
    assert "infinite" in str(made("timed at full speed"))
    assert "not ok: R sign, least singular value, hover thrust" in repr(
        made("report of blue")
    )
    assert "not ok: none" in repr(made("report"))
    assert "hover thrusts > 0" in str(made("region"))
    assert "1.3090 rad" in str(gg.PAPER.replace(max_tilt="75deg"))


def test_a_plan_shows_its_waypoints_and_its_region() -> None:
    assert "rings: waypoints" in page_of(made("plan")).text
    np.testing.assert_allclose(
        made("plan").plot(ax=Figure().add_subplot()).lines[-1].get_xydata(), SQUARE
    )
    assert "where a red gait with R < 0 is flyable" in page_of(made("no plan")).text
    assert "where a blue gait is valid" in page_of(made("no plan on blue")).text
    assert "with the given polygons" in page_of(made("plan with polygons")).text
    assert "infeasible" in repr(made("no plan"))
    numbers = [
        text.get_text() for text in gg.PAPER.plot(ax=Figure().add_subplot()).texts
    ]
    assert [text for text in numbers if text] == ["1", "2", "3", "4"]


def test_the_repr_of_a_vehicle_makes_it_again() -> None:
    # One that contradicts what it follows from, though by less than is allowed, and one with everything stated.
    stated = gg.Vehicle(
        drag_to_thrust=0.02, arm_length=0.25, drag_ratio=0.08 * (1 + 1e-7)
    )
    whole = LIMITED.replace(
        mass=0.1 + 0.2,
        inertia=(1e-4, 0.5, 1.0),
        max_tilt=1.5,
        first_rotor_spin="counterclockwise",
    )
    for one in (stated, whole, HOSTILE, *map(vehicle_named, preset_names())):
        assert eval(repr(one), {"Vehicle": gg.Vehicle, "PAPER": gg.PAPER}) == one
    assert "None" not in repr(LIMITED)
    assert repr(gg.PAPER) == "PAPER"


def test_reprs_of_answers_are_one_line() -> None:
    limits, out = (
        gg.Limits(rate=10, acceleration=100),
        gg.lift([(-0.4, 0.4), (-0.4, 0.8)], "red"),
    )
    answers = {
        "<LeastPeriod: period 0.7095 s": gg.least_period(RED, limits),
        "<Rounding: 4 corners": gg.timing.rounded(RED, "2deg"),
        "<Curve: red, ": gg.timing.rounded(RED, "2deg").curve,
        "<Transition: infeasible>": gg.transition("hover", RED),
        "<Transition: 2 corners": gg.transition("hover", out),
        "<Retargeted: The nearest flyable gait stands still": gg.retarget(BLUE),
        "<OptimalGait: infeasible, 2 discs>": gg.optimal_gait(
            [(0.5, 0.5), (0.6, 0.6)], radius=0.05
        ),
        "<LeastPeriod: no period>": gg.least_period(
            RED, gg.Limits(rate=[0, 6, 6, 6], acceleration=60)
        ),
        "<RobustnessReport: <Robustness of the gait itself: tilt margin 90.00°, 100.00 %": gg.robustness_of(
            RED, curves=0
        ),
        "<Loop: red, R < 0, 4 corners": made("plan").loop,
        "<RootArrays: 100 points, 200 roots": gg.surface.root_arrays([0.1] * 100, 0.2),
        "<ServoResponse: error at most 0.": gg.timing.servo_response(RED, 0.02),
        "<Exported: 101 rows, 20 columns>": gg.export(RED, []),
        "<Study: 'small', cases: 1>": study_from_mapping(
            {"name": "small", "gaits": ["gait4"]}
        ),
        "<Course: hover, entry, gait, exit, hover over 6 s>": gg.flight.from_hover(out),
        "<ServoMap: 'x_frame', joints ": gg.io.servo_map_named("x_frame"),
        "<Location: 2 flyable regions, 1 ": gg.location_of([(-0.3, 0.3)]),
        "<Report: Flyable: yes. The paper's rules do not apply to this geometry. 2 checks, ": gg.validation.validate_geometry(
            RED.alpha, gg.invertibility.Geometry.of_vehicle("paper")
        ),
        "<Geometry: 4 rotors, L = 0.1785 m>": gg.invertibility.Geometry.of_vehicle(
            "paper"
        ),
        "<Replanner: <Region: ": gg.planning.Replanner(rate=3.0),
        "Limits(rate=[10.0, 10.0, 10.0, 10.0], acceleration=[100.0": limits,
    }
    for start, answer in answers.items():
        assert re.fullmatch(re.escape(start) + ".*", repr(answer))
        assert len(repr(answer)) < 200


ANSWERS: dict[str, Any] = {
    "least period": lambda: gg.least_period(
        gg.lift([(-0.4, 0.4), (-0.4, 1.2)], "red"), gg.Limits(rate=6, acceleration=90)
    ),
    "optimal gait": lambda: gg.optimal_gait(
        [(-0.4, 0.4), (-0.4, 1.2), (-1.2, 1.2)], radius=0.1
    ),
    "transition": lambda: gg.transition("hover", "gait4"),
    "retargeted": lambda: gg.retarget("gait3", sign="positive"),
    "robustness": lambda: gg.robustness_of("gait4", bias=0.8),
}


@pytest.mark.parametrize("name", ANSWERS)
def test_every_answer_draws_itself_into_given_axes_and_in_a_notebook(name: str) -> None:
    answer = ANSWERS[name]()
    _, ax = plt.subplots()
    assert answer.plot(ax=ax) is ax
    assert ax.lines or ax.patches or ax.collections
    plt.close("all")
    html = answer._repr_html_()
    assert html.count("<img") == 1
    assert html.count("<strong>") == 1


def test_a_flight_draws_its_attitude() -> None:
    pytest.importorskip("mujoco")
    flight = gg.flight.fly("gait4", settings=gg.flight.FlightSettings(duration=0.2))
    ax = flight.plot()
    assert [line.get_label() for line in ax.lines] == ["roll", "pitch", "yaw"]
    plt.close("all")
    assert type(flight).from_dict(json.loads(json.dumps(flight.as_dict()))) == flight


def test_an_answer_without_a_gait_is_its_text() -> None:
    refused = gg.transition("hover", "gait3")
    with pytest.raises(gg.InputError, match="must have a gait to be plotted, got: No"):
        refused.plot()
    assert "<img" not in refused._repr_html_()
