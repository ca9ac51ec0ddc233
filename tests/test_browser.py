"""The explorer's page in a real headless Chromium: what a reader clicks, drags, types, opens and saves.

Without selenium, Chromium or its driver these tests skip and say which is missing.
"""

from __future__ import annotations

import math
import subprocess
import sys
import time
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING, Any

import pytest

import gaitgraph as gg
from tests.published import GAITS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

from tests.chromium import chromium, serious_findings  # skips where a part is missing

# isort: split
from selenium.webdriver.common.action_chains import ActionChains

for name in ("starlette", "uvicorn"):
    pytest.importorskip(name, reason=f"install {name}, of the extra 'explore'")

pytestmark = pytest.mark.slow

# Every visible text, with the contrast [1, 21] of its color to what is behind it.
CONTRASTS = """
const light = (rgb) => rgb.map((c) => c / 255).map((c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4))
  .reduce((sum, c, k) => sum + c * [0.2126, 0.7152, 0.0722][k], 0);
const parts = (text) => text.match(/[\\d.]+/g).map(Number);
const found = [];
for (const node of document.querySelectorAll("body *:not(option):not(script):not(svg *)")) {
  const own = [...node.childNodes].some((child) => child.nodeType === 3 && child.textContent.trim());
  if (!own || !node.checkVisibility() || node.closest(":disabled, .spoken, .skip, canvas")) continue;
  let behind = node;
  while (behind && (parts(getComputedStyle(behind).backgroundColor)[3] ?? 1) === 0) behind = behind.parentElement;
  const ratio = [getComputedStyle(node).color, getComputedStyle(behind ?? document.body).backgroundColor]
    .map((color) => light(parts(color).slice(0, 3)) + 0.05).sort((a, b) => b - a);
  found.push([`${node.tagName}.${node.className} ${node.textContent.trim().slice(0, 30)}`, ratio[0] / ratio[1]]);
}
return found;
"""
WIDE, NARROW = (1280, 900), (400, 800)
PATIENCE = 30.0  # until a page that does not come counts as broken [s]
LEFT, RIGHT, UP, DOWN, ENTER, DELETE, ESCAPE, TAB = (
    "\ue012\ue014\ue013\ue015\ue007\ue017\ue00c\ue004"
)
CONTROL, SHIFT = "\ue009", "\ue008"
STEP = math.pi / 16

# The waypoints of Gait 3, as the page writes them in its address.
GAIT_3 = "waypoints=3pi/8,-3pi/8;3pi/8,-pi/8;pi/8,-pi/8;pi/8,-3pi/8"

BROKEN = """alpha1,alpha2,alpha3,alpha4
1.178,-1.178,1.178,-1.178
1.178,-0.393,1.178,-0.393
0.393,-0.393,0.6,-0.393
0.393,-1.178,0.393,-1.178
"""


class Page:
    """The page as a reader meets it: the map by its angles, the rest by ids."""

    def __init__(self, driver: Any, address: str, downloads: Path) -> None:
        self.driver, self.address, self.downloads = driver, address, downloads

    def js(self, script: str, *values: object) -> Any:
        return self.driver.execute_script(script, *values)

    def cdp(self, command: str, **values: object) -> Any:
        return self.driver.execute_cdp_cmd(command, values)

    def until(self, what: Callable[[], Any]) -> Any:
        """Return what is found as soon as it is true."""
        end = time.monotonic() + PATIENCE
        while not (found := what()):
            assert time.monotonic() < end, (
                f"waited in vain; the page says {self.text('main')!r}"
            )
            time.sleep(0.01)
        return found

    def size(self, width: int, height: int) -> None:
        self.cdp(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=False,
        )

    def open(self, state: str = "") -> None:
        """Load the page anew, with a state in its address."""
        self.driver.get("about:blank")
        self.driver.get(f"{self.address}#{state}")
        self.until(lambda: self.js("return document.documentElement.dataset.ready"))
        self.planned()

    def planned(self) -> None:
        """Wait until the plan of the present state is shown."""
        self.until(
            lambda: self.js("return document.documentElement.dataset.planned === 'yes'")
        )

    def id(self, name: str) -> Any:
        return self.driver.find_element("id", name)

    def css(self, selector: str) -> Any:
        return self.driver.find_element("css selector", selector)

    def typed(self, field: Any, text: str) -> None:
        """Type a text in place of what a field holds, and enter it."""
        field.clear()
        field.send_keys(text, ENTER)

    def text(self, name: str) -> str:
        return str(
            self.js("return document.getElementById(arguments[0]).textContent", name)
        ).strip()

    def shows_clock(self, text: str) -> bool:
        return self.text("clock") == text

    def count(self, selector: str) -> int:
        return int(
            self.js("return document.querySelectorAll(arguments[0]).length", selector)
        )

    @property
    def state(self) -> str:
        return str(self.js("return decodeURIComponent(location.hash.slice(1))"))

    def headline(self) -> str:
        return self.text("headline")

    def shows(self, headline: str) -> None:
        """Wait until the verdict has a headline."""
        self.until(lambda: self.headline() == headline)

    def has(self, selector: str, count: int) -> None:
        """Wait until there are so many elements."""
        self.until(lambda: self.count(selector) == count)

    def at(self, state: str) -> None:
        """Wait until the address holds a state, and its plan is shown."""
        self.until(lambda: self.state == state)
        self.planned()

    def corners(self) -> list[list[str]]:
        found: list[list[str]] = self.js(
            "return [...document.querySelectorAll('#corners tbody tr')].map((row) =>"
            " [...row.querySelectorAll('.angle')].map((cell) => cell.textContent))"
        )
        return found

    def place(self, alpha1: float, alpha2: float) -> tuple[int, int]:
        """Return where on the screen a point of the map lies [px]."""
        left, top, side = self.js(
            "const frame = document.querySelector('#map .frame').getBoundingClientRect();"
            " return [frame.left, frame.top, frame.width];"
        )
        return round(left + (alpha1 / math.pi + 0.5) * side), round(
            top + (0.5 - alpha2 / math.pi) * side
        )

    def mouse(self, kind: str, alpha: tuple[float, float]) -> None:
        x, y = self.place(*alpha)
        count = int(kind != "mouseMoved")
        self.cdp(
            "Input.dispatchMouseEvent",
            type=kind,
            x=x,
            y=y,
            button="left",
            buttons=1,
            clickCount=count,
        )

    def click(self, *alpha: float) -> None:
        point = (alpha[0], alpha[1])
        self.mouse("mousePressed", point)
        self.mouse("mouseReleased", point)

    def keys(self, *keys: str, held: str = "") -> None:
        """Press keys one after another, with others held down."""
        chain = ActionChains(self.driver)
        for key in held:
            chain.key_down(key)
        chain.send_keys(*keys)
        for key in held:
            chain.key_up(key)
        chain.perform()

    def choose(self, name: str, value: str) -> None:
        self.js(
            "const field = document.getElementById(arguments[0]); field.value = arguments[1];"
            " field.dispatchEvent(new Event('change', { bubbles: true }));",
            name, value,
        )  # fmt: skip

    def complaints(self) -> list[str]:
        """Return the lines of the console, and clear it; those of the graphics driver do not count."""
        lines = [entry["message"] for entry in self.driver.get_log("browser")]
        return [line for line in lines if "WebGL" not in line]

    def touch(
        self, *points: tuple[float, float], moved: tuple[int, int] = (0, 0)
    ) -> None:
        """Touch the first point of the map, drag over the others, each moved by some pixels, and let go."""
        for k, point in enumerate(points):
            x, y = (
                place + by for place, by in zip(self.place(*point), moved, strict=True)
            )
            kind = "touchMove" if k else "touchStart"
            self.cdp(
                "Input.dispatchTouchEvent", type=kind, touchPoints=[{"x": x, "y": y}]
            )
        self.cdp("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])

    def opened(self, path: Path) -> None:
        """Open a table."""
        self.id("file").send_keys(str(path))
        self.until(lambda: self.text("table-name") == path.name)

    @contextmanager
    def emulated(self, *, still: bool = True, script: str = "") -> Iterator[None]:
        """Run a script before those of each page, and prefer reduced motion or not."""
        motion = {
            "name": "prefers-reduced-motion",
            "value": "reduce" if still else "no-preference",
        }
        self.cdp("Emulation.setEmulatedMedia", features=[motion])
        added = self.cdp("Page.addScriptToEvaluateOnNewDocument", source=script)
        try:
            yield
        finally:
            self.cdp("Page.removeScriptToEvaluateOnNewDocument", **added)
            self.cdp("Emulation.setEmulatedMedia", features=[])

    def vehicle(self) -> bytes:
        """Return a picture of the vehicle in three dimensions, as soon as it is there and stands still."""
        self.has("#vehicle-root canvas", 1)
        seen = [b"", self.css("#vehicle-root canvas").screenshot_as_png]
        while seen[-1] != seen[-2]:
            time.sleep(0.1)
            seen.append(self.css("#vehicle-root canvas").screenshot_as_png)
        return bytes(seen[-1])


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """A server of its own, as a user starts it."""
    command = [sys.executable, "-m", "gaitgraph", "explore", "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        assert server.stdout is not None
        yield server.stdout.readline().strip()
        server.terminate()


@pytest.fixture(scope="module")
def window(address: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    downloads, profile = (
        tmp_path_factory.mktemp("downloads"),
        tmp_path_factory.mktemp("profile"),
    )
    with chromium(profile, f"--window-size={WIDE[0]},{WIDE[1]}") as driver:
        page = Page(driver, address, downloads)
        page.cdp(
            "Browser.setDownloadBehavior", behavior="allow", downloadPath=str(downloads)
        )
        yield page


@pytest.fixture
def page(window: Page) -> Iterator[Page]:
    """The window, wide; afterwards nothing may stand in its console, and nothing may have come from elsewhere."""
    window.size(*WIDE)
    yield window
    names = window.js(
        "return performance.getEntriesByType('resource').map((entry) => entry.name)"
    )
    ours = (window.address, f"blob:{window.address[:16]}", "data:")
    assert len(names) > 10
    assert [name for name in names if not name.startswith(ours)] == []
    assert window.complaints() == []


def test_clicking_the_waypoints_of_gait_3(page: Page) -> None:
    page.open()
    assert page.headline() == "No waypoints yet"
    for point in GAITS[2].angles:
        page.click(*point)
    page.until(lambda: page.headline() == "✓Flyable" and len(page.corners()) == 4)
    page.at(GAIT_3)
    caveat = "No limit stated of thrust, tilt angle, tilt rate, tilt acceleration."
    assert page.text("reason") == f"red, R < 0, length π rad. {caveat}"
    assert page.corners()[0] == ["3π/8", "−3π/8", "3π/8", "−3π/8"]
    assert page.count(".waypoint") == page.count(".corner") == 4
    assert page.count(".check.ok") == page.count(".check") == 9
    assert "Flyable. red gait, 4 corners" in page.text("verdict-spoken")
    page.has(".attitudes svg", 1)  # the biased gait; that of the gait is one line
    assert (
        page.text("all-acceptable")
        == "✓ Gait: no singular attitude; tilt margin 90.0°, acceptable 100.00 %"
    )
    page.has("#vehicle-root canvas", 1)
    assert page.count(".uplot canvas") == 2


def test_the_first_visit_shows_gait_4_and_offers_to_try_it(page: Page) -> None:
    gait_4 = "waypoints=-pi/8,pi/8;-pi/8,3pi/8;-3pi/8,3pi/8;-3pi/8,pi/8&color=red&sign=positive"
    page.open()
    page.until(page.id("welcome").is_displayed)
    assert "Gait 4 of the paper" in page.text("welcome")
    assert [
        page.count(selector)
        for selector in (".path.ghost", ".path:not(.ghost)", ".waypoint")
    ] == [1, 0, 0]
    assert page.state == ""
    standing = page.vehicle()
    page.id("play").click()
    assert page.vehicle() != standing
    page.id("try-gait").click()
    page.at(gait_4)
    assert page.headline() == "✓Flyable"
    assert page.count(".path.ghost") == 0
    assert not page.id("welcome").is_displayed()
    page.id("undo").click()
    page.at("")
    assert not page.id("welcome").is_displayed()

    page.open()
    page.until(page.id("welcome").is_displayed)
    page.id("draw-own").click()
    assert not page.id("welcome").is_displayed()
    assert (page.count(".path"), page.js("return document.activeElement.id")) == (
        0,
        "map",
    )
    page.open(GAIT_3)
    assert not page.id("welcome").is_displayed()


def test_the_vehicle_moves_by_itself_until_it_is_paused(page: Page) -> None:
    counting = "window.asked = 0; const ask = requestAnimationFrame;"
    counting += "window.requestAnimationFrame = (call) => { window.asked += 1; return ask(call); };"
    with page.emulated(still=False, script=counting):
        page.open(GAIT_3)
        assert page.text("play") == "Pause"
        shown = page.text("clock")
        page.until(lambda: page.text("clock") != shown)
        page.until(lambda: page.js("return window.asked") > 20)
        page.id("play").click()
        assert page.text("play") == "Play"
        page.vehicle()
        shown, asked = page.text("clock"), page.js("return window.asked")
        time.sleep(0.5)
        assert (page.text("clock"), page.js("return window.asked")) == (
            shown,
            asked,
        )  # nothing runs in a pause
        page.click(2 * STEP, -2 * STEP)  # a change of the gait does not start it
        page.planned()
        assert page.text("play") == "Play"


@pytest.mark.parametrize("way", ["try-gait", "map", "load"])
def test_the_motion_goes_on_when_the_ghost_makes_room_for_a_gait(
    page: Page, way: str
) -> None:
    with page.emulated(still=False):
        page.open()
        page.until(page.id("welcome").is_displayed)
        if way == "try-gait":
            page.id(way).click()
        elif way == "load":
            page.choose(way, "2")
        else:
            page.click(2 * STEP, -2 * STEP)
            page.click(6 * STEP, -2 * STEP)
        page.until(lambda: page.headline().endswith("Flyable"))
        page.planned()
        shown = page.text("clock")
        page.until(lambda: page.text("clock") != shown)


def test_slider_steps_and_the_pointer_set_the_posture(page: Page) -> None:
    page.open(GAIT_3)
    pictures = [page.vehicle()]
    assert (page.text("play"), page.text("clock")) == (
        "Step",
        "0.000 s",
    )  # the browser prefers reduced motion
    for _ in range(3):
        page.id("play").click()
    assert page.text("clock") == "0.375 s"
    pictures.append(page.vehicle())
    page.js(
        "const slider = document.getElementById('scrub'); slider.value = '600';"
        " slider.dispatchEvent(new Event('input', { bubbles: true }));"
    )
    assert page.text("clock") == "0.600 s"
    pictures.append(page.vehicle())
    x, y = page.place(
        3 * math.pi / 8, -2 * STEP - math.pi / 8
    )  # in the middle of the first leg
    for dx, clock in ((60, "0.600 s"), (4, "0.125 s"), (-60, "0.125 s")):
        page.cdp("Input.dispatchMouseEvent", type="mouseMoved", x=x + dx, y=y)
        page.until(partial(page.shows_clock, clock))
    pictures.append(page.vehicle())
    assert len(set(pictures)) == len(pictures)


def test_the_vehicle_can_be_turned(page: Page) -> None:
    page.open(GAIT_3)
    page.vehicle()
    canvas = page.css("#vehicle-root canvas")
    canvas.send_keys("0")  # from now on it has the focus
    first = page.vehicle()
    ActionChains(page.driver).drag_and_drop_by_offset(canvas, 80, 20).perform()
    dragged = page.vehicle()
    canvas.send_keys(LEFT, UP, "+")
    assert len({first, dragged, page.vehicle()}) == 3
    canvas.send_keys("0")
    assert page.vehicle() == first


def test_without_webgl_a_line_says_why_there_is_no_vehicle(page: Page) -> None:
    none = "HTMLCanvasElement.prototype.getContext = new Proxy(HTMLCanvasElement.prototype.getContext, {"
    none += "apply: (get, canvas, [kind, ...rest]) => (kind === 'webgl2' ? null : get.call(canvas, kind, ...rest)) });"
    with page.emulated(script=none):
        page.open(GAIT_3)
        assert "no WebGL\u00a02" in page.text("vehicle-root")
        assert page.count("#vehicle-root canvas") == 0
        names = page.js(
            "return performance.getEntriesByType('resource').map((e) => e.name)"
        )
        assert not any("three" in name for name in names)
        for _ in range(3):
            page.id("play").click()
        assert page.text("clock") == "0.375 s"  # the rest of the page goes on
        assert "no WebGL\u00a02" in page.text("vehicle-root")


def test_a_vehicle_whose_context_is_lost_becomes_a_line(page: Page) -> None:
    page.open(GAIT_3)
    page.vehicle()
    page.js(
        "const canvas = document.querySelector('#vehicle-root canvas');"
        " canvas.getContext('webgl2').getExtension('WEBGL_lose_context').loseContext();"
    )
    page.until(lambda: "has stopped it" in page.text("vehicle-root"))
    page.click(2 * STEP, 2 * STEP)  # the rest of the page goes on
    page.shows("✕No gait")
    assert "has stopped it" in page.text("vehicle-root")
    page.planned()
    assert all("THREE" in line for line in page.complaints())


def test_gait_1_is_valid_and_not_flyable(page: Page) -> None:
    page.open()
    page.choose("load", "0")
    page.shows("△Not flyable, obeys the paper’s rules")
    assert "least singular value" in page.text("report")
    assert {"least_singular_value", "hover_thrust"} == set(
        page.js(
            "return [...document.querySelectorAll('.check.no')].map((node) => node.dataset.check)"
        )
    )
    assert page.count(".path.blue") == 1
    assert page.count(".broken") >= 1
    assert "whole blue sheet" in page.text("report")
    page.until(
        lambda: "rounding" in page.text("map-note")
    )  # the map shows the gait's own sheet


def test_the_loop_follows_a_drag_and_undo_takes_it_back(page: Page) -> None:
    page.open(GAIT_3)
    loop = "return document.querySelector('.path').getAttribute('d')"
    before = page.js(loop)
    page.mouse("mousePressed", (2 * STEP, -2 * STEP))
    page.mouse("mouseMoved", (2 * STEP, -3 * STEP))
    page.until(lambda: page.js(loop) != before)  # still held down
    page.mouse("mouseMoved", (3 * STEP, -4 * STEP))
    page.mouse("mouseReleased", (3 * STEP, -4 * STEP))
    moved = "waypoints=3pi/8,-3pi/8;3pi/8,-pi/8;3pi/16,-pi/4;pi/8,-3pi/8"
    page.at(moved)
    assert ["3π/16", "−π/4"] in [corner[:2] for corner in page.corners()]
    page.id("undo").click()
    page.until(lambda: page.state == GAIT_3 and page.js(loop) == before)
    for key, held, state in (
        ("y", CONTROL, moved),
        ("z", CONTROL, GAIT_3),
        ("z", CONTROL + SHIFT, moved),
    ):
        page.keys(key, held=held)
        page.at(state)
    assert page.id("redo").get_property("disabled")
    # Undo during a drag ends the drag; history is as before it.
    page.keys("z", held=CONTROL)
    page.at(GAIT_3)
    page.mouse("mousePressed", (2 * STEP, -2 * STEP))
    page.mouse("mouseMoved", (3 * STEP, -5 * STEP))
    page.until(lambda: page.js(loop) != before)
    page.keys("z", held=CONTROL)
    page.until(lambda: page.js(loop) == before)
    page.mouse("mouseMoved", (4 * STEP, -5 * STEP))
    page.mouse("mouseReleased", (4 * STEP, -5 * STEP))
    page.at(GAIT_3)
    assert page.id("undo").get_property("disabled")
    page.keys("y", held=CONTROL)
    page.at(moved)
    assert page.id("redo").get_property("disabled")
    # The newest waypoint too, which undo would take away.
    page.click(-2 * STEP, 2 * STEP)
    page.until(lambda: page.state.count(";") == 4)
    newest = page.state
    page.mouse("mousePressed", (-2 * STEP, 2 * STEP))
    page.mouse("mouseMoved", (-3 * STEP, 3 * STEP))
    page.keys("z", held=CONTROL)
    page.mouse("mouseMoved", (-4 * STEP, 3 * STEP))
    page.mouse("mouseReleased", (-4 * STEP, 3 * STEP))
    page.at(newest)
    page.keys("z", held=CONTROL)
    page.at(moved)
    assert page.complaints() == []
    # A double click removes; it needs the waypoint to have been there before the first click.
    for point, count in (((3 * STEP, -4 * STEP), 3), ((-3 * STEP, 3 * STEP), 4)):
        page.click(*point)
        page.click(*point)
        page.has(".waypoint", count)
    page.planned()


@pytest.mark.parametrize("after", [GAIT_3, "waypoints=pi/8,-3pi/8"])
def test_a_waypoint_that_is_gone_is_not_dragged_on(page: Page, after: str) -> None:
    page.open(f"{GAIT_3};-pi/8,pi/8")
    page.mouse("mousePressed", (-2 * STEP, 2 * STEP))
    page.mouse("mouseMoved", (-3 * STEP, 3 * STEP))
    if after == GAIT_3:
        page.keys(DELETE)
    else:
        page.js("location.hash = arguments[0]", after)
    page.at(after)
    page.mouse("mouseMoved", (-4 * STEP, 3 * STEP))
    page.mouse("mouseReleased", (-4 * STEP, 3 * STEP))
    assert page.complaints() == []
    page.at(after)


def test_the_address_holds_everything(page: Page) -> None:
    state = (
        f"{GAIT_3}&keep_out=pi/4,-3pi/16;5pi/16,-3pi/16;5pi/16,-5pi/16;0.8,-0.9&keep_in=0,0.1;pi/2,0.1;pi/2,-pi/2;0,-pi/2"
        "&color=red&sign=negative&objective=robust&method=grid&law=constant-speed&coefficients=exact&divisions=32&drag_ratio=0.2"
        "&period=2.5&samples=60&eta=0.7&any_order=yes&reverse=yes&sheet=blue&shading=least_singular_value&regions=no"
        "&types=yes&snap=no&chart=rates&theme=dark"
    )
    page.open(state)
    page.at(state)
    assert (
        page.js("return getComputedStyle(document.documentElement).colorScheme")
        == "dark"
    )
    expected = {
        "period": "2.5",
        "samples": "60",
        "divisions": "32",
        "law": "constant-speed",
        "objective": "robust",
    }
    assert {name: page.id(name).get_property("value") for name in expected} == expected
    assert page.count(".polygon.keep_out") == page.count(".polygon.keep_in") == 1
    before = page.text("report")
    page.driver.refresh()
    page.until(lambda: page.js("return document.documentElement.dataset.ready"))
    page.planned()
    assert (page.state, page.text("report")) == (state, before)


def test_a_broken_address_is_reported_and_the_rest_of_it_kept(page: Page) -> None:
    page.open(
        "waypoints=3pi/8,9&color=green&period=2&nonsense&keep_out=%E0%A4%A&eta=0&samples=1e9&accuracy=1e-9"
    )
    for said in (
        "color must be one of auto, red, blue, got “green”", "pairs of angles within ±pi/2, got “3pi/8,9”",
        "eta must be a number from 0.01 to 1, got “0”", "samples must be a whole number from 1 to 10000, got “1e9”",
        "accuracy must be a number from 1e-5 to 0.1, got “1e-9”", "“nonsense” is not a field of the page",
        "keep_out cannot be decoded",
    ):  # fmt: skip
        assert said in page.text("notice")
    assert page.id("period").get_property("value") == "2"
    assert page.headline() == "No waypoints yet"
    page.id("notice-close").click()
    page.click(2 * STEP, -2 * STEP)
    page.at("waypoints=pi/8,-pi/8&period=2")


def test_a_download_is_a_gait_that_flies(page: Page) -> None:
    page.open(GAIT_3)
    page.css("#download > summary").click()
    page.css("#formats [data-suffix='.csv']").click()
    saved = page.downloads / "gait.csv"
    page.until(saved.exists)
    assert gg.validate(gg.read_table(saved)).flyable
    assert page.count("#formats button") == page.count(
        "#formats button:not(:disabled)"
    ) + page.count("#formats .small")


def test_a_broken_table_is_marked_where_it_breaks(page: Page, tmp_path: Path) -> None:
    page.open()
    table = tmp_path / "broken.csv"
    table.write_text(BROKEN)
    page.id("file").send_keys(str(table))
    page.shows("✕Not flyable, breaks the paper’s rules")
    assert page.text("table-name") == "broken.csv"
    left, top = page.place(0.393, -0.393)
    places = page.js(
        "return [...document.querySelectorAll('.broken .place')].map((node) => node.getBoundingClientRect())"
        ".map((box) => [box.x + box.width / 2, box.y + box.height / 2])"
    )
    assert min(math.hypot(x - left, y - top) for x, y in places) < 3
    assert (
        page.js("return document.getElementById('use-request').checkVisibility()")
        is False
    )
    assert page.js(
        "return document.getElementById('welcome').hidden"
    )  # the ghost of a first visit is gone
    assert page.count(".path.ghost") == 0
    page.size(*NARROW)
    for name in ("headline", "reason"):
        box = f"document.getElementById('{name}')"
        assert page.js(f"return {box}.getBoundingClientRect().right <= innerWidth"), (
            name
        )
        assert page.js(f"return {box}.scrollWidth <= {box}.clientWidth"), name
    page.size(*WIDE)
    page.id("close-table").click()
    assert page.headline() == "No waypoints yet"
    assert page.count(".broken") == 0


def test_a_table_of_ours_brings_its_request(page: Page, tmp_path: Path) -> None:
    page.open()
    path = tmp_path / "gait.json"
    gg.plan_loop(GAITS[3].waypoints, color="red").gait.parametrize(period=1.0).write(
        path
    )
    page.id("file").send_keys(str(path))
    page.shows("✓Flyable")
    page.id("use-request").click()
    page.has(".waypoint", 4)
    page.planned()
    assert page.headline() == "✓Flyable"
    assert page.state.startswith(
        "waypoints=-pi/8,pi/8;-pi/8,3pi/8;-3pi/8,3pi/8;-3pi/8,pi/8&color=red"
    )


def test_the_keyboard_alone(page: Page) -> None:
    page.open()
    page.js("document.activeElement.blur()")
    page.keys(TAB)
    assert page.js("return document.activeElement.className") == "skip"
    page.js("document.getElementById('map').focus()")
    page.keys(
        *(RIGHT * 6),
        *(DOWN * 6),
        ENTER,
        *(UP * 4),
        ENTER,
        *(LEFT * 4),
        ENTER,
        *(DOWN * 4),
        ENTER,
    )
    page.until(lambda: page.state == GAIT_3 and page.headline() == "✓Flyable")
    assert page.text("moves-spoken") == "Waypoint 4 added: α1 π/8, α2 −3π/8"
    page.keys("[", RIGHT)
    page.at(GAIT_3[: -len("pi/8,-3pi/8")] + "3pi/16,-3pi/8")
    assert page.text("moves-spoken") == "Waypoint 4: α1 3π/16, α2 −3π/8"
    for _ in range(3):
        page.keys(RIGHT, held=SHIFT)
    page.until(
        lambda: page.state.endswith("27pi/128,-3pi/8")
    )  # a fraction again, whatever was added up
    assert page.text("moves-spoken") == "Waypoint 4: α1 27π/128, α2 −3π/8"
    page.keys(DELETE)
    page.has(".waypoint", 3)
    page.planned()
    page.id("mode-keep_out").send_keys(ENTER)  # gives the focus to the map
    page.keys(" ", RIGHT, " ", UP, " ", ENTER)
    page.until(lambda: "&keep_out=" in page.state)
    assert page.count(".polygon.chosen") == 1
    page.keys(DELETE)
    page.has(".polygon", 0)
    page.id("mode-keep_in").send_keys(ENTER)
    page.keys(" ", ESCAPE)
    assert page.id("mode-waypoints").get_attribute("aria-pressed") == "true"
    assert (
        page.js("return getComputedStyle(document.activeElement).outlineStyle")
        == "solid"
    )
    page.planned()


def test_waypoints_and_numbers_can_be_typed(page: Page) -> None:
    page.open(GAIT_3)
    field = page.css("[aria-label='Waypoint 2, α2']")
    page.typed(field, "-22.5deg")
    page.planned()
    page.at(GAIT_3)
    page.css("#advanced > summary").click()
    for one, text, wanted in (
        (field, "2", "Waypoint 2, α2 must be an angle within ±π/2"),
        (field, "0,5", "Waypoint 2, α2 must be an angle within ±π/2"),
        (
            page.id("period"),
            "2,5",
            "Period (s) must be a number of seconds from 1e-6 to 1e9, got “2,5”",
        ),
        (
            page.id("samples"),
            "0x10",
            "Samples must be a whole number from 1 to 10000, got “0x10”",
        ),
    ):
        page.typed(one, text)
        assert page.text("problem").startswith(wanted)
        assert one.get_attribute("aria-invalid") == "true"
        assert page.state == GAIT_3
    page.typed(page.id("period"), "2.5")
    page.at(f"{GAIT_3}&period=2.5")
    assert page.id("problem").is_displayed() is False
    assert page.text("advanced-changed") == "(1 changed)"
    for text, shown, kept in (
        ("-60deg", "−π/3", "-pi/3"),
        ("-50°", "−5π/18", "-5pi/18"),
    ):
        page.typed(field, text)
        page.at(f"{GAIT_3.replace('3pi/8,-pi/8', f'3pi/8,{kept}')}&period=2.5")
        assert field.get_property("value") == shown


def test_refusals_and_a_server_that_is_gone(page: Page) -> None:
    page.open(
        f"{GAIT_3}&keep_out=0,0;pi/8,pi/8;pi/8,0;0,pi/8"
    )  # a polygon that crosses itself
    assert page.headline() == "✕Wrong input"
    assert "keep_out" in page.text("report")
    assert page.count(".path") == 0
    page.id("clear").click()
    page.shows("No waypoints yet")
    assert "keep_out" in page.text("problem")
    page.id("undo").click()
    page.shows("✕Wrong input")
    page.css("#polygon-list .quiet").click()
    page.shows("✓Flyable")
    page.cdp("Network.enable")
    network = {"latency": 0, "downloadThroughput": -1, "uploadThroughput": -1}
    page.cdp("Network.emulateNetworkConditions", offline=True, **network)
    page.click(4 * STEP, -6 * STEP)
    page.until(lambda: "does not answer" in page.text("connection"))
    assert (page.headline(), page.text("reason")) == (
        "Not planned yet",
        "The server does not answer",
    )
    assert page.count(".waypoint") == 5  # what was clicked is kept
    page.cdp("Network.emulateNetworkConditions", offline=False, **network)
    page.until(lambda: not page.id("connection").is_displayed())
    page.planned()
    page.shows("✓Flyable")
    assert all(
        "400" in line or "ERR_INTERNET_DISCONNECTED" in line
        for line in page.complaints()
    )


@pytest.mark.parametrize(("size", "theme"), [(WIDE, "light"), (NARROW, "dark")])
def test_nothing_is_too_wide_too_pale_or_without_a_name(
    page: Page, size: tuple[int, int], theme: str
) -> None:
    page.size(*size)
    page.open(f"{GAIT_3}&keep_out=0,0;pi/16,pi/8;pi/8,0&theme={theme}&types=yes")
    if page.id("menu").is_displayed():
        page.id("menu").click()
    page.css("#download > summary").click()
    width = page.js("return [document.documentElement.scrollWidth, innerWidth]")
    assert width[0] <= width[1] == size[0]
    page.until(lambda: page.count("#diagram-root.waiting") == 0)  # it is pale till then
    assert serious_findings(page.driver) == []
    nodes = [
        node
        for node in page.cdp("Accessibility.getFullAXTree")["nodes"]
        if not node["ignored"]
    ]
    found = [
        (node["role"]["value"], node.get("name", {}).get("value", "").strip())
        for node in nodes
    ]
    controls = {
        "button",
        "textbox",
        "combobox",
        "checkbox",
        "radio",
        "slider",
        "link",
        "application",
    }
    assert {role for role, _ in found} >= controls | {
        "main",
        "banner",
        "region",
        "status",
    }
    assert [
        role
        for role, name in found
        if role in controls | {"DisclosureTriangle", "image"} and not name
    ] == []


def test_without_a_gait_a_waypoint_can_be_moved_to_where_there_is_one(
    page: Page,
) -> None:
    state = "waypoints=pi/8,pi/8;5pi/16,-5pi/16;pi/8,-5pi/16"
    page.open(state)
    assert page.headline() == "✕No gait"
    assert page.text("reason").startswith(
        "red, R < 0: waypoint 1 (π/8, π/8) has R = 2.9; the nearest admissible point is"
    )
    assert page.count(".layer-advice .from") == page.count(".advice-head") == 1
    assert serious_findings(page.driver) == []
    page.vehicle()
    assert page.css(".vehicle-note").text == "The posture of waypoint 1"
    assert (
        page.count("[data-key=ways]:not([open])")
        == page.count("[data-key=alternatives]:not([open])")
        == 1
    )
    page.id("move-there").click()
    page.shows("✓Flyable")
    assert page.state.startswith("waypoints=pi/8,-0.167")
    assert page.count(".layer-advice *") == page.count("#actions *") == 0
    page.id("undo").click()
    page.at(state)
    page.id("allow-valid").click()
    page.at(f"{state}&require=valid")
    # The map becomes blue, and says so; nothing there is shaded as a value.
    page.until(
        lambda: page.text("map-note").startswith("No red gait through these waypoints")
    )
    page.until(lambda: page.text("legend") == "R = 0 in exact physics")
    for name in ("R", "least_singular_value"):
        page.js("document.getElementById(arguments[0]).click()", f"chart-{name}")
        page.until(lambda: "rounding noise" in page.css(".series-section").text)


@pytest.mark.parametrize(
    "state",
    ["3pi/16,-pi/4;0.9,-0.4;0.9,-0.4;-7pi/16,7pi/16", "-0.5,0.5;-1.5,1.5;-0.5,1.55"],
)
def test_moves_that_are_advised_end_in_a_gait(page: Page, state: str) -> None:
    page.open(f"waypoints={state}")
    for _ in range(4):
        if page.count("#move-there"):
            before = page.state
            page.id("move-there").click()
            page.until(lambda before=before: page.state != before)  # type: ignore[misc]
            page.planned()
    assert page.headline().endswith("Flyable")


def test_a_drag_that_makes_red_impossible_is_told(page: Page) -> None:
    page.open("waypoints=pi/4,-pi/8;5pi/16,-5pi/16;pi/8,-5pi/16&require=valid")
    page.mouse("mousePressed", (4 * STEP, -2 * STEP))
    for step in (0, 2, 4):
        page.mouse("mouseMoved", (2 * STEP, step * STEP / 2))
    page.until(lambda: page.text("map-note").endswith("the loop is on the blue sheet."))
    assert page.text("legend").startswith("R−")  # still held: the map stays red
    page.mouse("mouseReleased", (2 * STEP, 2 * STEP))
    page.until(
        lambda: "now on the blue sheet, and so is the map" in page.text("map-note")
    )
    page.until(lambda: page.text("legend") == "R = 0 in exact physics")
    page.planned()


@pytest.mark.parametrize(
    ("state", "headline", "corners_open"),
    [
        ("waypoints=3pi/8,-3pi/8", "One posture", True),
        ("waypoints=pi/8,pi/8&require=valid", "△One posture, not flyable, obeys the paper’s rules", True),
        (f"{GAIT_3};pi/4,-pi/4;5pi/16,-pi/4;3pi/16,-3pi/16;pi/4,-3pi/8;7pi/16,-pi/4;3pi/8,-5pi/16;pi/8,-pi/4;5pi/16,-pi/8"
         ";3pi/16,-3pi/8", "✓Flyable", False),
    ],
    ids=["posture", "posture not flyable", "13 corners"],
)  # fmt: skip
def test_headlines_and_what_is_folded(
    page: Page, state: str, headline: str, corners_open: bool
) -> None:
    page.open(GAIT_3)
    page.js(
        "document.querySelectorAll('#report details').forEach((node) => { node.open = true; })"
    )
    page.js("location.hash = arguments[0]", state)
    page.shows(headline)
    page.planned()
    assert page.count("[data-key=corners][open]") == int(corners_open)
    assert page.count("[data-key=passed]") == 1
    assert page.count("#report > .checks .check.ok") == 0


def test_an_opened_table_shows_its_color_types_and_singular_attitudes(
    page: Page, tmp_path: Path
) -> None:
    page.open()
    path = tmp_path / "gait.csv"
    gg.plan_loop(GAITS[2].waypoints, color="red").timed(samples=40).write(path)
    page.opened(path)
    assert page.count(".table-path.red") == 1
    types = page.js(
        "return [...document.querySelectorAll('#corners .types')].map((node) => node.textContent)"
    )
    assert types == ["(+,+)"] * 4
    assert page.text("all-acceptable").startswith("✓ Gait: no singular attitude")
    assert page.id("eta-row").is_displayed() is False
    page.id("close-table").click()


def test_the_map_is_that_of_the_vehicle_of_a_table_or_says_that_it_is_not(
    page: Page, tmp_path: Path
) -> None:
    page.open()
    region = "return document.querySelector('.region.flyable').getAttribute('d')"
    page.until(lambda: page.count(".region.flyable"))
    before = page.js(region)
    other = gg.PAPER.replace(name="other", max_tilt=1.2)
    for name, vehicle, note in (
        ("bee", "beetle_omni", ""),
        ("other", other, "not that of the table, other."),
    ):
        path = tmp_path / f"{name}.csv"
        gg.plan_loop(
            [(-0.4, 0.4), (-0.9, 0.9)], color="red", vehicle=vehicle
        ).timed().write(path)
        page.opened(path)
        page.until(lambda note=note: page.text("map-note").endswith(note))  # type: ignore[misc]
        assert f"vehicle{'other' if note else vehicle}" in page.text("report")
        page.until(lambda note=note: (page.js(region) == before) == bool(note))  # type: ignore[misc]
    page.id("close-table").click()


def test_a_table_plays_at_its_own_period(page: Page, tmp_path: Path) -> None:
    with page.emulated(still=False):
        page.open()
        path = tmp_path / "slow.csv"
        gg.plan_loop(GAITS[2].waypoints, color="red", period=4000.0).timed().write(path)
        page.opened(path)
        page.until(lambda: float(page.text("clock").removesuffix(" s")) > 0)
        page.id("play").click()
        first, start = float(page.text("clock").removesuffix(" s")), time.monotonic()
        page.id("play").click()
        page.until(lambda: float(page.text("clock").removesuffix(" s")) > first)
        time.sleep(0.3)
        assert float(page.text("clock").removesuffix(" s")) - first < 5 * (
            time.monotonic() - start
        )
        page.id("close-table").click()


def test_rows_without_times_are_joined_by_what_is_true_between_them(
    page: Page, tmp_path: Path
) -> None:
    page.open()
    path = tmp_path / "untimed.csv"
    path.write_text(
        "alpha1,alpha2,alpha3,alpha4\n"
        + "".join(f"{a},{b},{a},{b}\n" for a, b in GAITS[2].angles)
    )
    page.opened(path)
    page.js(
        "const slider = document.getElementById('scrub'); slider.value = '1000';"
        " slider.dispatchEvent(new Event('input', { bubbles: true }));"
    )
    assert page.text("clock") == "row 1"
    page.id("close-table").click()


def test_the_map_follows_the_drag_ratio_while_it_is_dragged(page: Page) -> None:
    page.open(GAIT_3)
    region = "return document.querySelector('.region.flyable').getAttribute('d')"
    page.until(lambda: page.count(".region.flyable"))
    before = page.js(region)
    for value in range(560, 500, -4):
        page.js(
            "const slider = document.getElementById('drag_ratio'); slider.value = arguments[0];"
            " slider.dispatchEvent(new Event('input', { bubbles: true }));",
            value,
        )
        time.sleep(0.03)
    page.until(lambda: page.js(region) != before)  # no change event: it is still held
    page.js("document.getElementById('drag_ratio').dispatchEvent(new Event('change'))")
    page.planned()


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_a_pressed_button_can_be_read_while_hovered(page: Page, theme: str) -> None:
    page.open(f"theme={theme}")
    button = page.id("mode-waypoints")
    ActionChains(page.driver).move_to_element(button).perform()
    assert page.js("return arguments[0].matches(':hover')", button)
    assert [
        ratio for name, ratio in page.js(CONTRASTS) if "mode" in name and ratio < 4.5
    ] == []


@pytest.mark.parametrize("size", [WIDE, (900, 700), (600, 800), (390, 844)])
def test_the_verdict_stays_in_sight(page: Page, size: tuple[int, int]) -> None:
    page.size(*size)
    page.open(GAIT_3)
    page.js("scrollTo(0, document.documentElement.scrollHeight)")
    box = page.js(
        "const box = document.getElementById('headline').getBoundingClientRect(); return [box.top, box.bottom]"
    )
    assert 0 <= box[0] < box[1] <= size[1]
    assert page.js("return document.documentElement.scrollWidth <= innerWidth")
    is_sheet = size[0] < 640
    assert (
        page.id("sheet-toggle").is_displayed()
        == page.id("menu").is_displayed()
        == is_sheet
    )
    assert page.id("report").is_displayed() != is_sheet
    if is_sheet:
        page.id("sheet-toggle").click()
        assert page.id("report").is_displayed()
        assert page.id("tools").is_displayed() is False


def test_many_waypoints_on_a_narrow_map_do_not_overlap(page: Page) -> None:
    circle = [
        (
            0.75 + 0.27 * math.cos(k * math.pi / 7),
            0.3 * math.sin(k * math.pi / 7) - 0.75,
        )
        for k in range(14)
    ]
    page.size(390, 844)
    page.open(
        "waypoints=" + ";".join(f"{a:.3f},{b:.3f}" for a, b in [*circle, (-1.0, 1.0)])
    )
    discs = page.js(
        "return [...document.querySelectorAll('.waypoint')].map((one) => [one.transform.baseVal[0].matrix.e,"
        " one.transform.baseVal[0].matrix.f, Number(one.firstChild.getAttribute('r')), one.textContent])"
    )
    assert [text for *_, text in discs] == [""] * 14 + ["15"]
    for k, (x, y, radius, _) in enumerate(discs):
        assert all(
            math.hypot(x - x2, y - y2) > radius + r2 for x2, y2, r2, _ in discs[:k]
        )
        assert radius >= 3.5


class TestTouch:
    @pytest.fixture
    def phone(self, page: Page) -> Iterator[Page]:
        page.size(390, 844)
        page.cdp("Emulation.setTouchEmulationEnabled", enabled=True)
        yield page
        page.cdp("Emulation.setTouchEmulationEnabled", enabled=False)

    def test_waypoints_and_keep_outs_are_dragged(self, phone: Page) -> None:
        phone.open(f"{GAIT_3}&keep_out=-pi/8,pi/8;-pi/4,pi/8;-pi/4,pi/4")
        phone.js("document.getElementById('map').scrollIntoView({ block: 'start' })")
        before = phone.js("return scrollY")
        phone.touch(
            (2 * STEP, -2 * STEP),
            (2 * STEP, -3 * STEP),
            (3 * STEP, -3.5 * STEP),
            (3 * STEP, -4 * STEP),
        )
        phone.until(lambda: "3pi/16,-pi/4;" in phone.state)
        phone.touch(
            (-3.2 * STEP, 2.7 * STEP),
            (-3.2 * STEP, 4 * STEP),
            (-3.2 * STEP, 4.7 * STEP),
        )
        phone.until(
            lambda: phone.state.endswith("keep_out=-pi/8,pi/4;-pi/4,pi/4;-pi/4,3pi/8")
        )
        assert phone.js("return scrollY") == before
        phone.planned()

    def test_a_tap_beside_a_waypoint_adds_another(self, phone: Page) -> None:
        phone.open("waypoints=3pi/8,-3pi/8")
        phone.js("document.getElementById('map').scrollIntoView({ block: 'start' })")
        phone.touch((5 * STEP, -6 * STEP))
        phone.at("waypoints=3pi/8,-3pi/8;5pi/16,-3pi/8")
        phone.touch((6 * STEP, -6 * STEP), moved=(3, 3))  # on it: nothing is added
        assert phone.count(".waypoint.chosen[data-index='0']") == 1
        phone.planned()

    @pytest.mark.parametrize("left", [8, 200])
    def test_the_gutter_and_the_free_map_scroll_the_page(
        self, phone: Page, left: int
    ) -> None:
        phone.open("waypoints=3pi/8,-3pi/8")
        phone.js("scrollTo(0, 200)")
        _, y = phone.place(0, 0)
        for k in range(8):
            kind = "touchMove" if k else "touchStart"
            phone.cdp(
                "Input.dispatchTouchEvent",
                type=kind,
                touchPoints=[{"x": left, "y": y - 20 * k}],
            )
            time.sleep(0.02)
        phone.cdp("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
        phone.until(lambda: phone.js("return scrollY") > 250)
        assert phone.state == "waypoints=3pi/8,-3pi/8"
