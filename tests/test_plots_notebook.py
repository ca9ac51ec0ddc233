"""What a notebook shows of an object: HTML that is safe, small and true; its text and its repr."""

from __future__ import annotations

import base64
import json
import re
import sys
from html.parser import HTMLParser
from io import BytesIO, StringIO
from typing import Any

import numpy as np
import pytest
from PIL import Image

import gaitgraph as gg
from gaitgraph.vehicle import preset_names, vehicle_named
from tests.samples import cases, gait_of_paper

NASTY = "<script>alert(\"x\")</script><img src=x onerror='y'> & co"
RED, BLUE = gait_of_paper(3), gait_of_paper(2)
HOSTILE = gg.Vehicle(name=NASTY, drag_ratio=0.1, max_thrust=4.0)
LIMITED = gg.PAPER.replace(
    max_tilt_rate=5.0, max_tilt_acceleration=50.0, max_tilt_jerk=500.0
)
AROUND = np.exp(np.linspace(0, 2j * np.pi, 3000, endpoint=False))
RING = np.column_stack([0.3 * AROUND.real - 0.8, 0.3 * AROUND.imag + 0.8])
OUTSIDE = np.array([[2.0, -0.3, 0.1, 9.0], [0.3, -3.0, 0.1, 9.0]])
CORNERS = [(-0.4, 0.4), (-0.4, 1.2), (-1.2, 1.2)]
BAR = [(-0.9, 0.3), (-0.7, 0.3), (-0.7, 0.6), (-0.9, 0.6)]
LIMITS = gg.Limits(rate=6, acceleration=90)
PLANE_LOOP = {"alpha1": [0.4, 0.8], "alpha2": [-0.4, -0.5], "color": "red"}

# Each with words of its page or its text.
SHOWN = {
    name: (make, words)
    for name, make, words in cases("""
red gait | RED | shaded: where a red gait with R < 0 is flyable
biased gait | RED.biased(0.8) | its loop in the plane of α1 and α2
point | gg.lift([(0.4, -0.4)], "red") | Gait, red: 1 corner
outside | gg.Gait(alpha=OUTSIDE) | off the surfaces
long gait | gg.lift(RING, "red") | 3000 corners
hostile | gg.lift(CORNERS, "red", vehicle=HOSTILE) | <script>alert
timed gait | RED.parametrize(2.0) | the vehicle states no limit
full speed | BLUE.parametrize(law="equal-time") | infinite
limits | gg.lift(CORNERS, "red", vehicle=LIMITED).parametrize() | 500
table | gg.timing.table_of(RED.parametrize(2.0)) | 101 rows
plane loop | gg.timing.table_of(PLANE_LOOP) | 101 rows
report | gg.validate(BLUE) | Flyable: no
plan | gg.plan_loop(CORNERS) | rings: waypoints
no plan | gg.plan_loop([(0.5, 0.5)], color="red", sign="negative") | where a red gait with R < 0 is flyable
no blue plan | gg.plan_loop([(0.5, 0.5)], color="blue", coefficients="exact") | where a blue gait is valid
polygons | gg.plan_loop(CORNERS, keep_out=[BAR]) | with the given polygons
vehicle | LIMITED | max tilt jerk
region | gg.admissible_region() | hover thrusts > 0
empty region | gg.admissible_region(floor=1.5) | Region
least period | gg.least_period(RED, LIMITS, nodes=30) | period
optimal | gg.optimal_gait(CORNERS[:1], pieces=8) | gait
transition | gg.transition("hover", "gait4") | corner
retargeted | gg.retarget("gait3", sign="positive") | gait
location | gg.location_of([(-0.3, 0.3), (0.5, 0.5)]) | waypoint 2
comparison | gg.robustness.comparison_of(["gait3", "gait4"]) | peak rate (rad/s)
robustness | gg.robustness_of("gait4", bias=0.8) | acceptable
""")
}


class Page(HTMLParser):
    """The elements and texts of a page; raises if they do not nest."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.elements: list[tuple[str, dict[str, Any]]] = []
        self.texts: list[str] = []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        if tag != "img":
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.texts.append(data)


@pytest.mark.parametrize("name", SHOWN)
def test_pages_are_small_and_safe_and_texts_fit_a_screen(name: str) -> None:
    make, words = SHOWN[name]
    shown = eval(make)
    html = shown._repr_html_()
    lines = str(shown).splitlines()
    page = Page(html)
    text = " ".join(page.texts)
    tags = [tag for tag, _ in page.elements]
    assert words in text
    assert len(html) < 120_000
    assert {*tags} <= set("div strong pre img".split())
    for _, attributes in page.elements:
        assert not {"id", "class", "href"} & attributes.keys()
    # Names and messages of the user are there, whatever they hold.
    assert set(str(shown).split()) <= set(text.split())
    pictures = [attributes for tag, attributes in page.elements if tag == "img"]
    assert len(pictures) == (name != "report")
    for picture in pictures:
        content = base64.b64decode(picture["src"].partition("base64,")[2])
        with Image.open(BytesIO(content)) as image:
            assert image.width == pytest.approx(2 * int(picture["width"]), abs=2)
    assert 1 < len(lines) < 40
    assert max(map(len, lines)) <= 240
    assert len(repr(shown)) < 400
    assert re.fullmatch(rf"(?!.*array).*{type(shown).__name__}.*", repr(shown))


def test_without_matplotlib_there_is_the_text(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    for name in ("red gait", "timed gait", "plan", "region", "vehicle"):
        assert "img" not in eval(SHOWN[name][0])._repr_html_()


def test_the_repr_of_a_vehicle_makes_it_again() -> None:
    # One that contradicts what it follows from, though by less than is allowed, and one with everything stated.
    stated = gg.Vehicle(
        drag_to_thrust=0.02, arm_length=0.25, drag_ratio=0.08 * (1 + 1e-7)
    )
    whole = LIMITED.replace(
        mass=0.1 + 0.2,
        inertia=(1e-4, 0.5, 1.0),
        max_tilt=1.5,
    )
    names = {"Vehicle": gg.Vehicle, "PAPER": gg.PAPER}
    for vehicle in (stated, whole, HOSTILE, *map(vehicle_named, preset_names())):
        assert eval(repr(vehicle), names) == vehicle
    assert "None" not in repr(LIMITED)
    assert repr(gg.PAPER) == "PAPER"


STUDY = StringIO("name = 'small'\ngaits = ['gait4']")


@pytest.mark.parametrize(
    ("make", "start"),
    cases("""
gg.timing.rounded(RED, "2deg") | <Rounding: 4 corners
gg.timing.rounded(RED, "2deg").curve | <Curve: red,
gg.plan_loop(CORNERS).loop | <Loop: red, R > 0, 3 corners
gg.surface.root_arrays([0.1] * 100, 0.2) | <RootArrays: 100 points, 200 roots
gg.timing.servo_response(RED, 0.02) | <ServoResponse: error at most
gg.export(RED, []) | <Exported: 101 rows, 20 columns>
gg.study.read_study(STUDY) | <Study: 'small', cases: 1>
gg.flight.from_hover(gg.lift(CORNERS, "red")) | <Course: hover, entry, gait, exit, hover
gg.io.servo_map_named("x_frame") | <ServoMap: 'x_frame', joints
gg.location_of([(-0.3, 0.3)]) | <Location: 2 flyable regions, 1
gg.invertibility.Geometry.of_vehicle("paper") | <Geometry: 4 rotors, L = 0.1785 m>
gg.planning.Replanner(rate=3.0) | <Replanner: <Region:
LIMITS | Limits(rate=[6.0, 6.0, 6.0, 6.0], acceleration=[90.0
"""),
)
def test_reprs_of_answers_are_one_line(make: str, start: str) -> None:
    shown = repr(eval(make))
    assert re.fullmatch(f"{re.escape(start)}.*", shown)
    assert len(shown) < 200


def test_a_flight_draws_its_attitude() -> None:
    pytest.importorskip("mujoco")
    settings = gg.flight.FlightSettings(duration=0.2)
    flight = gg.flight.fly("gait4", settings=settings)
    labels = [line.get_label() for line in flight.plot().lines]
    assert labels == ["roll", "pitch", "yaw"]
    read = json.loads(json.dumps(flight.as_dict()))
    assert type(flight).from_dict(read) == flight


def test_an_answer_without_a_gait_is_its_text() -> None:
    refused = gg.transition("hover", "gait3")
    with pytest.raises(gg.InputError, match="must have a gait to be plotted, got: No"):
        refused.plot()
    assert "<img" not in refused._repr_html_()


def test_a_title_speaks_of_all_that_is_drawn() -> None:
    location = gg.location_of([(-0.4, 0.4), (0.5, 0.5)])
    assert location.plot().get_title() == "Admissible regions, vehicle paper"
    empty = gg.location_of([(0.5, 0.5)], floor=2.0)
    assert empty.plot().get_title() == "Admissible regions, vehicle paper: none"
    comparison = gg.robustness.comparison_of(["gait3", "gait4"])
    assert comparison.plot().get_title() == "gait3, gait4"
