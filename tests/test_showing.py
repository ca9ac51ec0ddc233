"""How objects show themselves: pages that are safe, small and true, and reprs of one line."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from functools import cache
from html.parser import HTMLParser
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import shapely
from gaitgraph.plots.sketches import HUES, MOST_RINGS
from hypothesis import given, strategies as st

import gaitgraph as gg
from gaitgraph.angles import HALF_PI
from gaitgraph.vehicle import preset_names, vehicle_named
from tests.published import GAITS

if TYPE_CHECKING:
    from collections.abc import Callable

NASTY = "<script>alert(\"x\")</script><img src=x onerror='y'> & co"
VOID = {"br", "img", "hr", "input", "meta", "link"}
SQUARE = [(1.178, -1.178), (1.178, -0.393), (0.393, -0.393), (0.393, -1.178)]
RED = gg.lift(SQUARE, "red")
BLUE = gg.lift(SQUARE, "blue")
HOSTILE = gg.Vehicle(name=NASTY, drag_ratio=0.1, first_arm_angle=math.pi / 4, max_thrust=4.0)
ROUND = np.linspace(0, 2 * np.pi, 3000, endpoint=False)
LONG = gg.lift(np.column_stack([-0.8 + 0.3 * np.cos(ROUND), 0.8 + 0.3 * np.sin(ROUND)]), "red")
HOLES = [
    [(x + 0.03 * math.cos(turn), y + 0.03 * math.sin(turn)) for turn in np.arange(0, 6.28, math.pi / 6)]
    for x in np.arange(-1.3, 0, 0.1)
    for y in np.arange(0.05, 1.3, 0.1)
]
GAPS = np.linspace(0.2, 1.1, 8)
AT = gg.invertibility.coefficients_of().delta
FIBER = gg.Gait(alpha=[(AT, 0.2, AT, 0.4), (AT, 0.9, AT, 0.3), (AT, 0.5, AT, 0.8)], colors=("fiber1",) * 3)
CORNERS = [(-0.4, 0.4), (-0.4, 1.2), (-1.2, 1.2)]
BAR = [(-0.9, 0.3), (-0.7, 0.3), (-0.7, 0.6), (-0.9, 0.6)]

MADE: dict[str, Callable[[], Any]] = {
    "red gait": lambda: RED,
    "blue gait": lambda: BLUE,
    "biased gait": lambda: RED.biased(0.8),
    "mixed gait": lambda: gg.lift([(0.2, 0.4), (0.9, 0.3), (0.5, 0.8)], ["red", "blue", "red"]),
    "long mixed gait": lambda: gg.lift(LONG.alpha[::15, :2], ["red", "blue"] * 100),
    "point": lambda: gg.lift([(0.4, -0.4)], "red"),
    "standing gait": lambda: gg.lift([(0.4, -0.4)] * 100, "red"),
    "gait on a fibre": lambda: FIBER,
    "gait out of the square": lambda: gg.Gait(alpha=np.array([[2.0, -0.3, 0.1, 9.0], [0.3, -3.0, 0.1, 9.0]])),
    "long gait": lambda: LONG,
    "zigzag gait": lambda: gg.lift([(-0.1 - k / 2000, 0.2 + k % 2) for k in range(2000)], "red"),
    "gait of a hostile name": lambda: gg.lift([(-0.4, 0.4), (-0.4, 0.8)], "red", vehicle=HOSTILE),
    "timed gait": lambda: RED.parametrize(2.0),
    "timed at full speed": lambda: BLUE.parametrize(law="equal-time"),
    "long timed gait": LONG.parametrize,
    "paced gait": lambda: gg.least_period(RED, gg.Limits(rate=10, acceleration=100), rounding="5deg").timed,
    "timed with limits": lambda: gg.lift(
        SQUARE, "red", vehicle=gg.PAPER.replace(max_tilt_rate=5.0, max_tilt_acceleration=50.0)
    ).parametrize(),
    "report": lambda: gg.validate(RED),
    "report of blue": lambda: gg.validate(BLUE),
    "report with notes": lambda: replace(gg.validate(RED), reachable_from_hover=None, notes=("a <note>",)),
    "plan": lambda: gg.plan_loop(SQUARE),
    "no plan": lambda: gg.plan_loop([(0.5, 0.5)], color="red", sign="negative"),
    "no plan on blue": lambda: gg.plan_loop([(0.5, 0.5)], color="blue", coefficients="exact"),
    "plan with polygons": lambda: gg.plan_loop(CORNERS, keep_out=[BAR]),
    "plan of many": lambda: gg.plan_loop(LONG.alpha[::30, :2].tolist()),
    "paper's vehicle": lambda: gg.PAPER,
    "preset": lambda: vehicle_named("beetle_omni"),
    "hostile vehicle": lambda: HOSTILE,
    "region": gg.admissible_region,
    "empty region": lambda: gg.admissible_region(floor=1.5),
    "region with holes": lambda: gg.admissible_region(
        zones=gg.planning.request_of([(-0.45, 0.45)], keep_out=HOLES).zones
    ),
}


@cache
def shown(name: str) -> Any:
    """Made when it is first asked for, and once."""
    return MADE[name]()


class Page(HTMLParser):
    """The elements and texts of a page; raises if they do not nest."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.elements: list[tuple[str, dict[str, str]]] = []
        self.texts: list[str] = []
        self.titles: list[str] = []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, {name: value or "" for name, value in attrs}))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        (self.titles if self.open[-1] == "title" else self.texts).append(data)

    def of(self, tag: str) -> list[dict[str, str]]:
        return [attributes for name, attributes in self.elements if name == tag]

    @property
    def text(self) -> str:
        return " ".join(self.texts)


def page_of(one: Any) -> Page:
    return Page(one._repr_html_())


def points_of(path: str) -> np.ndarray[Any, Any]:
    """The points of a path of one polyline."""
    return np.array([[float(number) for number in pair.split(",")] for pair in re.findall(r"[-\d.]+,[-\d.]+", path)])


def plane_from_page(points: np.ndarray[Any, Any], end: float = HALF_PI) -> np.ndarray[Any, Any]:
    """What stands at places of a square picture, 150 wide from (30, 8) on."""
    return np.column_stack([(points[:, 0] - 30) / 75 - 1, 1 - (points[:, 1] - 8) / 75]) * end


@pytest.mark.parametrize("name", MADE)
def test_pages_are_small_and_stand_anywhere_and_twice(name: str) -> None:
    text = shown(name)._repr_html_()
    page = Page(text)
    assert text == shown(name)._repr_html_()
    assert len(text.encode()) < 20_000
    allowed = {"div", "strong", "table", "tr", "th", "td", "svg", "title", "rect", "line", "text", "path", "circle"}
    assert {tag for tag, _ in page.elements} <= allowed
    for _, attributes in page.elements:
        assert not {"id", "class", "href", "src"} & set(attributes)
        assert not any(attribute.startswith("on") for attribute in attributes)
        assert "url(" not in attributes.get("style", "")
        assert not {"nan", "inf"} & set(re.findall("[a-z]+", attributes.get("d", "")))
    (picture,) = page.of("svg")
    assert picture["role"] == "img"
    assert page.titles == [picture["aria-label"]] != [""]


@pytest.mark.parametrize("name", MADE)
def test_reprs_are_one_short_line(name: str) -> None:
    text = repr(shown(name))
    assert "\n" not in text
    assert "array" not in text
    assert len(text) < (400 if isinstance(shown(name), gg.Vehicle) else 200)
    assert type(shown(name)).__name__ in text


@pytest.mark.parametrize("name", MADE)
def test_prints_are_lines_that_fit_a_screen(name: str) -> None:
    lines = str(shown(name)).splitlines()
    assert 1 < len(lines) < 40
    assert all(len(line) <= 240 for line in lines)


@pytest.mark.parametrize("name", ["hostile vehicle", "gait of a hostile name"])
def test_a_name_is_text_whatever_it_holds(name: str) -> None:
    page = page_of(shown(name))
    assert NASTY in page.text
    assert "<script" not in shown(name)._repr_html_()
    assert NASTY in page_of(gg.lift([(-0.4, 0.4)], "red", vehicle=HOSTILE).parametrize()).text


def test_a_gait_that_cannot_be_judged_says_why() -> None:
    assert "not judged" in page_of(shown("gait of a hostile name")).text
    assert "states no mass" in page_of(shown("gait of a hostile name")).text
    assert "shaded: where a red gait with R > 0 is valid" in page_of(shown("gait of a hostile name")).text
    assert "check() does" in page_of(LONG).text
    assert "… and 2994 more" in page_of(LONG).text


@pytest.mark.parametrize("published", GAITS, ids=lambda gait: f"gait {gait.number}")
def test_a_gait_shows_its_loop_and_its_verdict(published: Any) -> None:
    gait = gg.lift(published.angles, published.color)
    page = page_of(gait)
    verdict = f"flyable {'yes' if published.flyable else 'no'} · reachable from hover"
    assert verdict in page.text
    assert verdict not in page_of(gait.biased(0.8) if published.flyable else RED).text
    (loop,) = (path for path in page.of("path") if path.get("stroke") == HUES[published.color])
    np.testing.assert_allclose(plane_from_page(points_of(loop["d"]))[:-1], gait.alpha[:, :2], atol=2e-3)
    marks = page.of("rect")[1:] if published.color == "red" else [one for one in page.of("circle") if one["r"] == "3"]
    assert len(marks) == 4
    for text in (f"{gait.length:.4f} rad around", *gait.types, "published coefficients"):
        assert text in page.text


def test_the_shaded_region_is_the_one_it_says() -> None:
    page = page_of(RED)
    assert "shaded: where a red gait with R < 0 is flyable" in page.text
    (shaded,) = (path for path in page.of("path") if path.get("fill-rule"))
    parts = [shapely.Polygon(plane_from_page(points_of(one))) for one in shaded["d"].split("Z")[:-1]]
    region = gg.admissible_region(sign="negative")
    assert shapely.union_all(parts).symmetric_difference(region.inner).area < 0.02 * region.area
    assert shapely.union_all(parts).covers(shapely.Polygon(RED.alpha[:, :2]))


def test_a_region_shows_its_holes() -> None:
    region = shown("region with holes")
    page = page_of(region)
    (shaded,) = (path for path in page.of("path") if path.get("fill-rule"))
    assert shaded["d"].count("Z") > 100
    assert "keep" in page.text
    assert "empty" in page_of(shown("empty region")).text
    assert page_of(shown("empty region")).of("table") == []
    assert "1  " in str(gg.admissible_region())
    parts = gg.planning.request_of([(-0.4, 0.4)], keep_in=[[(-x, 0.1), (-x - 0.05, 0.1), (-x, 1.0)] for x in GAPS])
    assert "… and 2 more" in str(gg.admissible_region(zones=parts.zones))


def test_a_gait_on_a_fibre_shows_its_free_angles() -> None:
    page = page_of(FIBER)
    assert {"α2", "α4"} <= set(page.texts)
    (loop,) = (path for path in page.of("path") if path.get("stroke-width") == "2")
    np.testing.assert_allclose(plane_from_page(points_of(loop["d"]))[:-1], FIBER.alpha[:, [1, 3]], atol=2e-3)
    second = gg.Gait(alpha=[(0.2, -AT, 0.4, -AT), (0.9, -AT, 0.3, -AT)], colors=("fiber2",) * 2)
    assert "its loop in the plane of α1 and α3" in page_of(second).text


def test_a_long_gait_is_drawn_where_it_is() -> None:
    (loop,) = (path for path in page_of(LONG).of("path") if path.get("stroke") == HUES["red"])
    drawn = plane_from_page(points_of(loop["d"]))
    assert 30 < len(drawn) <= 400
    line = shapely.LineString(LONG.alpha[:, :2])
    assert shapely.hausdorff_distance(shapely.LineString(drawn), line, densify=0.01) < 0.01


@pytest.mark.parametrize("name", ["timed gait", "timed at full speed", "paced gait", "long timed gait"])
def test_a_timed_gait_shows_its_angles_in_time(name: str) -> None:
    timed = shown(name)
    paths = page_of(timed).of("path")
    assert len(paths) == 4
    for k, path in enumerate(paths):
        points = points_of(path["d"])
        times = np.clip((points[:, 0] - 34) / 250 * timed.period, 0, timed.period * (1 - 1e-12))
        # A place is rounded to a tenth; how much that is of an angle depends on how steep it is.
        slack = 1e-3 + 0.06 / 75 * HALF_PI + 0.06 / 250 * timed.period * timed.peak_rates()[k]
        assert (np.abs((1 - (points[:, 1] - 24) / 75) * HALF_PI - timed.at(times)[0][:, k]) < slack).all()
        assert points[0, 0] == 34
        assert points[-1, 0] == 284
    for peak in timed.peak_rates():
        assert f"{peak:.4g}" in str(timed)
        assert f"{peak:.4g}" in page_of(timed).text


def test_limits_of_the_vehicle_are_beside_the_peaks() -> None:
    assert "the vehicle's limits are 5 rad/s, 50 rad/s²" in str(shown("timed with limits"))
    assert "the vehicle states no limits" in page_of(shown("timed gait")).text
    assert "infinite" in str(shown("timed at full speed"))


def test_a_report_shows_every_check_with_its_mark() -> None:
    report = shown("report of blue")
    page = page_of(report)
    for check in report.checks:
        assert check.message in page.texts
        at = page.texts.index(check.message)
        assert page.texts[at - 2 : at] == [check.mark, check.name.replace("_", " ")]
    assert page.titles == ["valid yes · flyable no · reachable from hover no"]
    assert {one.get("stroke") for one in page.of("circle")} == {HUES["yes"], HUES["no"]}
    assert HUES["unknown"] in shown("report with notes")._repr_html_()
    assert "warning: a <note>" in page_of(shown("report with notes")).text
    assert "not ok: R sign, least singular value, hover thrust" in repr(report)
    assert "not ok: none" in repr(shown("report"))


def test_a_plan_shows_its_waypoints_and_its_verdict() -> None:
    page = page_of(shown("plan"))
    rings = [one for one in page.of("circle") if one["r"] == "5"]
    places = np.array([[float(one["cx"]), float(one["cy"])] for one in rings])
    np.testing.assert_allclose(plane_from_page(places), SQUARE, atol=2e-3)
    assert str(shown("plan")).splitlines()[0] in page.texts
    assert "alternative: blue, R < 0, 3.1400 rad, valid, not flyable" in page.text
    assert "flyable" in repr(shown("plan"))
    many = page_of(shown("plan of many"))
    assert len([one for one in many.of("circle") if one["r"] == "5"]) == MOST_RINGS
    assert f"the first {MOST_RINGS} of 100 waypoints" in many.text


def test_a_plan_without_a_gait_shows_why() -> None:
    page = page_of(shown("no plan"))
    assert "No gait." in page.texts
    assert "waypoint 1 (0.5000, 0.5000) has R = 2.352" in page.text
    assert "where a red gait with R < 0 is flyable" in page.text
    assert "where a blue gait is valid" in page_of(shown("no plan on blue")).text
    assert "with the given polygons" in page_of(shown("plan with polygons")).text
    assert "infeasible" in repr(shown("no plan"))


def test_a_vehicle_shows_its_arms_and_spins() -> None:
    for vehicle, places, sweeps in (
        (gg.PAPER, [(90, 38), (38, 90), (90, 142), (142, 90)], ["1", "0", "1", "0"]),
        (vehicle_named("beetle_omni"), [(53.2, 53.2), (53.2, 126.8), (126.8, 126.8), (126.8, 53.2)], ["0", "1"] * 2),
    ):
        page = page_of(vehicle)
        discs = [(float(one["cx"]), float(one["cy"])) for one in page.of("circle") if one["r"] == "23"]
        assert discs == places  # rotor 1 forward, which is up the page; the others counter-clockwise
        turns = [re.search(r"0 1 (\d)", path["d"]) for path in page.of("path")]
        assert [turn.group(1) for turn in turns if turn] == sweeps
    assert "8.048e-06 N s²/rad²" in page_of(gg.PAPER).texts
    assert "max tilt" in str(gg.PAPER.replace(max_tilt="75deg"))
    assert "1.3090 rad" in str(gg.PAPER.replace(max_tilt="75deg"))


VEHICLES = st.builds(
    gg.Vehicle,
    name=st.text(st.characters(categories=["L", "P", "Zs"]), min_size=1).filter(str.isprintable),
    drag_to_thrust=st.floats(1e-3, 1.0),
    arm_length=st.floats(0.01, 10.0),
    mass=st.none() | st.floats(0.1, 100.0),
    first_arm_angle=st.floats(-3.0, 3.0),
    first_rotor_spin=st.sampled_from(["clockwise", "counterclockwise"]),
    inertia=st.none() | st.tuples(*[st.floats(1e-4, 1.0)] * 3),
    max_tilt=st.none() | st.floats(0.1, 1.5),
)


@given(VEHICLES)
def test_the_repr_of_a_vehicle_makes_it_again(vehicle: gg.Vehicle) -> None:
    assert eval(repr(vehicle), {"Vehicle": gg.Vehicle}) == vehicle


def test_the_repr_of_a_vehicle_says_nothing_that_follows() -> None:
    for name in preset_names():
        assert eval(repr(vehicle_named(name)), {"Vehicle": gg.Vehicle}) == vehicle_named(name)
    assert "drag_ratio" not in repr(gg.PAPER)
    assert "None" not in repr(gg.PAPER)
    # One that contradicts what it follows from, though by less than is allowed, is stated.
    stated = gg.Vehicle(drag_to_thrust=0.02, arm_length=0.25, drag_ratio=0.08 * (1 + 1e-7))
    assert eval(repr(stated), {"Vehicle": gg.Vehicle}) == stated


def test_reprs_of_answers_are_one_line() -> None:
    answers = {
        "<LeastPeriod: period 0.7095 s": gg.least_period(RED, gg.Limits(rate=10, acceleration=100)),
        "<Rounding: 4 corners": gg.timing.rounded(RED, "2deg"),
        "<Curve: red, ": gg.timing.rounded(RED, "2deg").curve,
        "<Transition: infeasible>": gg.transition("hover", RED),
        "<Transition: 2 corners": gg.transition("hover", gg.lift([(-0.4, 0.4), (-0.4, 0.8)], "red")),
        "<Retargeted: retargeted, 4 rows": gg.retarget(BLUE),
        "<Retargeted: infeasible>": gg.retarget(BLUE, floor=1.5),
        "<OptimalGait: least singular value": gg.optimal_gait([(0.4, -0.4), (1.2, -0.4)], radius=0.1),
        "<OptimalGait: infeasible, 2 discs>": gg.optimal_gait([(0.5, 0.5), (0.6, 0.6)], radius=0.05),
        "<LeastPeriod: no period>": gg.least_period(RED, gg.Limits(rate=[0, 6, 6, 6], acceleration=60)),
        "<RobustnessReport: <Robustness of the gait itself: tilt margin 1.5708 rad": gg.robustness_of(RED, curves=0),
        "<Loop: red, R < 0, 4 corners": shown("plan").loop,
    }
    for start, answer in answers.items():
        assert repr(answer).startswith(start)
        assert repr(answer).endswith(">")
        assert "\n" not in repr(answer)
        assert len(repr(answer)) < 200
    assert "no tilt margin" in repr(gg.robustness_of(BLUE, tilt=0, curves=0))


def luminance(color: str) -> float:
    channels = [int(color[k : k + 2], 16) / 255 for k in (1, 3, 5)]
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in channels]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


@pytest.mark.parametrize("page", ["#ffffff", "#111111"])
def test_colors_can_be_told_from_light_and_dark_pages(page: str) -> None:
    used = set(HUES.values())
    for name in ("timed gait", "paper's vehicle"):
        used |= set(re.findall(r"#[0-9a-f]{6}", shown(name)._repr_html_()))
    assert len(used) > 4
    for color in used:
        light, dark = sorted((luminance(color), luminance(page)), reverse=True)
        assert (light + 0.05) / (dark + 0.05) >= 3, color
