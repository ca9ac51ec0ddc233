"""The explorer's page in a real headless Chromium: what a reader clicks, drags, types, opens and saves.

Without selenium, Chromium or its driver these tests skip and say which is missing.
"""

from __future__ import annotations

import cmath
import math
import subprocess
import sys
import time
from contextlib import contextmanager
from itertools import combinations
from typing import TYPE_CHECKING, Any

import pytest

import gaitgraph as gg
from tests.published import GAITS
from tests.samples import LEANING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

from tests.chromium import (
    chromium,
    serious_findings,
    show,
)  # skips where a part is missing

# isort: split
from selenium.webdriver.common.action_chains import ActionChains

for name in ("starlette", "uvicorn"):
    pytest.importorskip(name, reason=f"install {name}, of the extra 'explore'")

pytestmark = pytest.mark.slow

WIDE, NARROW = (1280, 900), (400, 800)
PATIENCE = 30.0  # until a page that does not come counts as broken [s]
LEFT, RIGHT, UP, DOWN, ENTER, DELETE, ESCAPE, TAB = (
    "\ue012\ue014\ue013\ue015\ue007\ue017\ue00c\ue004"
)
CONTROL = "\ue009"
CONTROLS = {"button", "textbox", "combobox", "checkbox", "radio", "slider", "link"}
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
        show(self.driver, width, height, "light")

    def open(self, state: str = "") -> None:
        """Load the page anew, with a state in its address."""
        self.driver.get("about:blank")
        self.driver.get(f"{self.address}#{state}")
        self.ready()

    def ready(self) -> None:
        """Wait until a loaded page is at work."""
        self.until(lambda: self.js("return document.documentElement.dataset.ready"))
        self.planned()

    def planned(self) -> None:
        """Wait until the plan of the present state is shown."""
        self.until(
            lambda: self.js("return document.documentElement.dataset.planned === 'yes'")
        )

    def id(self, name: str) -> Any:
        return self.driver.find_element("id", name)

    def all(self, selector: str) -> list[Any]:
        return list(self.driver.find_elements("css selector", selector))

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

    def count(self, selector: str) -> int:
        return int(
            self.js("return document.querySelectorAll(arguments[0]).length", selector)
        )

    @property
    def state(self) -> str:
        return str(self.js("return decodeURIComponent(location.hash.slice(1))"))

    def shows(self, headline: str) -> None:
        """Wait until the verdict has a headline."""
        self.until(lambda: self.text("headline") == headline)

    def has(self, selector: str, count: int) -> None:
        """Wait until there are so many elements."""
        self.until(lambda: self.count(selector) == count)

    def at(self, state: str) -> None:
        """Wait until the address holds a state, and its plan is shown."""
        self.until(lambda: self.state == state)
        self.planned()

    def place(self, alpha1: float, alpha2: float) -> tuple[int, int]:
        """Return where on the screen a point of the map lies [px]."""
        left, top, side = self.js(
            "const frame = document.querySelector('#map .frame').getBoundingClientRect();"
            " return [frame.left, frame.top, frame.width];"
        )
        return round(left + (alpha1 / math.pi + 0.5) * side), round(
            top + (0.5 - alpha2 / math.pi) * side
        )

    def mouse(self, kind: str, alpha1: float, alpha2: float) -> None:
        x, y = self.place(alpha1, alpha2)
        count = int(kind != "Moved")
        event = {"type": f"mouse{kind}", "x": x, "y": y, "clickCount": count}
        self.cdp("Input.dispatchMouseEvent", button="left", buttons=1, **event)

    def click(self, alpha1: float, alpha2: float) -> None:
        self.mouse("Pressed", alpha1, alpha2)
        self.mouse("Released", alpha1, alpha2)

    def drag(self, *points: tuple[float, float]) -> None:
        """Press the mouse at the first point, and move it over the others."""
        self.mouse("Pressed", *points[0])
        for point in points[1:]:
            self.mouse("Moved", *point)

    def keys(self, *keys: str, held: str = "") -> None:
        """Press keys one after another, with others held down."""
        chain = ActionChains(self.driver)
        if held:
            chain.key_down(held)
        chain.send_keys(*keys)
        if held:
            chain.key_up(held)
        chain.perform()

    def choose(self, name: str, value: str, event: str = "change") -> None:
        self.js(
            "const field = document.getElementById(arguments[0]); field.value = arguments[1];"
            " field.dispatchEvent(new Event(arguments[2], { bubbles: true }));",
            name,
            value,
            event,
        )

    def complaints(self) -> list[str]:
        """Return the lines of the console, and clear it; those of the graphics driver do not count."""
        lines = [entry["message"] for entry in self.driver.get_log("browser")]
        return [line for line in lines if "WebGL" not in line]

    def touch(self, *places: tuple[int, int]) -> None:
        """Touch the first place [px], drag over the others, and let go."""
        kind = "touchStart"
        for x, y in places:
            points = [{"x": x, "y": y}]
            self.cdp("Input.dispatchTouchEvent", type=kind, touchPoints=points)
            kind = "touchMove"
            time.sleep(0.02)
        self.cdp("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])

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
    assert page.text("headline") == "No waypoints yet"
    for point in GAITS[2].angles:
        page.click(*point)
    page.at(GAIT_3)
    page.shows("✓Flyable")
    assert page.text("reason").startswith("red, R < 0, length π rad. No limit stated")
    corner = [cell.text for cell in page.all("#corners tbody tr:first-child .angle")]
    assert corner == ["3π/8", "−3π/8", "3π/8", "−3π/8"]
    assert page.count(".waypoint") == page.count(".corner") == 4
    assert page.count(".check.ok") == page.count(".check") == 9
    assert "Flyable. red gait, 4 corners" in page.text("verdict-spoken")
    page.has(".attitudes svg", 1)  # the biased gait; that of the gait is one line
    assert page.text("all-acceptable").startswith("✓ Gait: no singular attitude")
    page.has("#vehicle-root canvas", 1)
    assert page.count(".uplot canvas") == 2


def test_the_first_visit_shows_gait_4_and_offers_to_try_it(page: Page) -> None:
    page.open()
    page.until(page.id("welcome").is_displayed)
    assert "Gait 4 of the paper" in page.text("welcome")
    assert (page.count(".path.ghost"), page.count(".waypoint")) == (1, 0)
    standing = page.vehicle()
    page.id("play").click()
    assert page.vehicle() != standing
    page.id("try-gait").click()
    page.has(".waypoint", 4)
    page.shows("✓Flyable")
    assert page.count(".path.ghost") == 0
    assert not page.id("welcome").is_displayed()
    page.open()
    page.until(page.id("welcome").is_displayed)
    page.id("draw-own").click()
    assert not page.id("welcome").is_displayed()
    assert page.js("return document.activeElement.id") == "map"


def test_the_vehicle_moves_by_itself_until_it_is_paused(page: Page) -> None:
    counting = "window.asked = 0; const ask = requestAnimationFrame;"
    counting += "window.requestAnimationFrame = (call) => { window.asked += 1; return ask(call); };"
    with page.emulated(still=False, script=counting):
        page.open(GAIT_3)
        shown = page.text("clock")
        page.until(lambda: page.text("clock") != shown)
        page.id("play").click()
        page.vehicle()
        shown = page.text("clock")
        asked = page.js("return window.asked")
        time.sleep(0.5)
        assert page.text("clock") == shown
        assert page.js("return window.asked") == asked  # nothing runs in a pause


def test_slider_steps_and_the_pointer_set_the_posture(page: Page) -> None:
    """The browser prefers reduced motion: it steps instead of playing."""
    page.open(GAIT_3)
    pictures = {page.vehicle()}
    assert page.text("play") == "Step"
    for _ in range(3):
        page.id("play").click()
    assert page.text("clock") == "0.375 s"
    pictures.add(page.vehicle())
    page.choose("scrub", "600", "input")
    assert page.text("clock") == "0.600 s"
    x, y = page.place(6 * STEP, -4 * STEP)  # in the middle of the first leg
    page.cdp("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y)
    page.until(lambda: page.text("clock") == "0.125 s")
    pictures.add(page.vehicle())
    assert len(pictures) == 3


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
        page.id("play").click()
        assert page.text("clock") == "0.125 s"  # the rest of the page goes on
        assert "no WebGL\u00a02" in page.text("vehicle-root")
        assert page.count("#vehicle-root canvas") == 0


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
    page.planned()
    assert all("THREE" in line for line in page.complaints())


def test_gait_1_is_valid_and_not_flyable(page: Page) -> None:
    page.open()
    page.choose("load", "0")
    page.shows("△Not flyable, obeys the paper’s rules")
    failed = [check.get_attribute("data-check") for check in page.all(".check.no")]
    assert failed == ["least_singular_value", "hover_thrust"]
    assert page.count(".path.blue") == 1
    assert page.count(".broken") >= 1
    # The map shows the gait's own sheet.
    page.until(lambda: "rounding" in page.text("map-note"))


def test_the_loop_follows_a_drag_and_undo_takes_it_back(page: Page) -> None:
    page.open(GAIT_3)
    loop = "return document.querySelector('.path').getAttribute('d')"
    before = page.js(loop)
    page.drag((2 * STEP, -2 * STEP), (2 * STEP, -3 * STEP))
    page.until(lambda: page.js(loop) != before)  # still held down
    page.mouse("Moved", 3 * STEP, -4 * STEP)
    page.mouse("Released", 3 * STEP, -4 * STEP)
    moved = "waypoints=3pi/8,-3pi/8;3pi/8,-pi/8;3pi/16,-pi/4;pi/8,-3pi/8"
    page.at(moved)
    page.id("undo").click()
    page.at(GAIT_3)
    page.keys("y", held=CONTROL)
    page.at(moved)
    # A double click removes.
    page.click(3 * STEP, -4 * STEP)
    page.click(3 * STEP, -4 * STEP)
    page.has(".waypoint", 3)
    page.planned()


def test_the_address_holds_everything(page: Page) -> None:
    state = f"{GAIT_3}&keep_out=pi/4,-3pi/16;5pi/16,-3pi/16;5pi/16,-5pi/16;0.8,-0.9"
    state += "&keep_in=0,0.1;pi/2,0.1;pi/2,-pi/2;0,-pi/2&objective=robust&period=2.5&theme=dark"
    page.open(state)
    page.at(state)
    scheme = "return getComputedStyle(document.documentElement).colorScheme"
    assert page.js(scheme) == "dark"
    assert page.id("period").get_property("value") == "2.5"
    assert page.id("objective").get_property("value") == "robust"
    assert page.count(".polygon.keep_out") == page.count(".polygon.keep_in") == 1
    report = page.text("report")
    page.driver.refresh()
    page.ready()
    assert (page.state, page.text("report")) == (state, report)


def test_a_download_is_a_gait_that_flies(page: Page) -> None:
    page.open(GAIT_3)
    page.css("#download > summary").click()
    page.css("#formats [data-suffix='.csv']").click()
    saved = page.downloads / "gait.csv"
    page.until(saved.exists)
    assert gg.validate(saved).flyable


def test_a_broken_table_is_marked_where_it_breaks(page: Page, tmp_path: Path) -> None:
    page.open()
    table = tmp_path / "broken.csv"
    table.write_text(BROKEN)
    page.id("file").send_keys(str(table))
    page.shows("✕Not flyable, breaks the paper’s rules")
    assert page.text("table-name") == "broken.csv"
    distances = []
    for node in page.all(".broken .place"):
        box = node.rect
        middle = (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
        distances.append(math.dist(middle, page.place(0.393, -0.393)))
    assert min(distances) < 3
    assert not page.id("use-request").is_displayed()
    page.choose("scrub", "1000", "input")
    assert page.text("clock") == "row 1"  # it states no times
    page.id("close-table").click()
    assert page.text("headline") == "No waypoints yet"
    assert page.count(".broken") == 0


def test_a_vehicle_of_any_four_rotors_is_opened_planned_and_left(page: Page) -> None:
    """What has no meaning on its curved sheet is hidden; corners are marked where the loop turns, not at each row."""
    page.open("types=yes&sheet=blue")
    plan = gg.plan_loop([(-0.8, 0.8), (-0.8, 0.5), (-1, 0.8)], vehicle=LEANING)
    path = page.downloads / "leaning.json"
    plan.timed().write(path)
    page.id("file").send_keys(str(path))
    page.shows("✓Flyable")
    page.until(lambda: "which is curved" in page.text("map-note"))
    assert page.count(".table-path") == 1
    page.id("use-request").click()
    page.has(".waypoint", 3)
    page.planned()
    assert page.text("reason").startswith("R > 0, length 0.8606 rad")
    assert (page.count(".corner"), page.count("#corners tbody tr")) == (3, 48)
    assert page.count(".type") == 0
    assert not page.id("field-color").is_displayed()
    page.vehicle()
    assert page.state.partition("&vehicle=")[2].startswith('{"name":"leaning"')
    page.open(page.state)
    page.shows("✓Flyable")
    page.js("document.getElementById('advanced').open = true")
    assert "leaning (κ = " in page.css("#vehicle option:checked").text
    page.choose("vehicle", "paper")
    page.until(lambda: "vehicle" not in page.state)  # the address follows the plan
    page.until(page.id("field-color").is_displayed)


def test_the_keyboard_alone(page: Page) -> None:
    page.open()
    page.js("document.activeElement.blur()")
    page.keys(TAB)
    assert page.js("return document.activeElement.className") == "skip"
    page.js("document.getElementById('map').focus()")
    corners = (RIGHT * 6 + DOWN * 6, UP * 4, LEFT * 4, DOWN * 4)
    for way in corners:
        page.keys(*way, ENTER)
    page.at(GAIT_3)
    assert page.text("moves-spoken") == "Waypoint 4 added: α1 π/8, α2 −3π/8"
    page.keys("[", RIGHT)
    page.at(GAIT_3.replace(";pi/8,-3pi/8", ";3pi/16,-3pi/8"))
    page.keys(DELETE)
    page.has(".waypoint", 3)
    page.planned()
    page.id("mode-keep_out").send_keys(ENTER)  # gives the focus to the map
    page.keys(" ", RIGHT, " ", UP, " ", ENTER)
    page.until(lambda: "&keep_out=" in page.state)
    page.keys(DELETE)
    page.has(".polygon", 0)
    page.id("mode-keep_in").send_keys(ENTER)
    page.keys(" ", ESCAPE)
    assert page.id("mode-waypoints").get_attribute("aria-pressed") == "true"
    outline = "return getComputedStyle(document.activeElement).outlineStyle"
    assert page.js(outline) == "solid"
    page.planned()


def test_waypoints_and_numbers_can_be_typed(page: Page) -> None:
    page.open(GAIT_3)
    angle = page.css("[aria-label='Waypoint 2, α2']")
    page.css("#advanced > summary").click()
    period = page.id("period")
    for field, text, problem in (
        (angle, "2", "Waypoint 2, α2 must be an angle within ±π/2"),
        (period, "2,5", "Period (s) must be a number of seconds"),
    ):
        page.typed(field, text)
        assert page.text("problem").startswith(problem)
        assert field.get_attribute("aria-invalid") == "true"
        assert page.state == GAIT_3
    page.typed(period, "2.5")
    page.at(f"{GAIT_3}&period=2.5")
    assert not page.id("problem").is_displayed()
    assert page.text("advanced-changed") == "(1 changed)"
    page.typed(angle, "-60deg")
    page.at(f"{GAIT_3.replace('3pi/8,-pi/8', '3pi/8,-pi/3')}&period=2.5")
    assert angle.get_property("value") == "−π/3"


def test_refusals_and_a_server_that_is_gone(page: Page) -> None:
    page.open(f"{GAIT_3}&keep_out=0,0;pi/8,pi/8;pi/8,0;0,pi/8")  # it crosses itself
    assert page.text("headline") == "✕Wrong input"
    assert "keep_out" in page.text("report")
    page.css("#polygon-list .quiet").click()
    page.shows("✓Flyable")
    page.cdp("Network.enable")
    network = {"latency": 0, "downloadThroughput": -1, "uploadThroughput": -1}
    page.cdp("Network.emulateNetworkConditions", offline=True, **network)
    page.click(4 * STEP, -6 * STEP)
    page.until(lambda: "does not answer" in page.text("connection"))
    assert page.text("headline") == "Not planned yet"
    assert page.count(".waypoint") == 5  # what was clicked is kept
    page.cdp("Network.emulateNetworkConditions", offline=False, **network)
    page.shows("✓Flyable")
    expected = ("400", "ERR_INTERNET_DISCONNECTED")
    for line in page.complaints():
        assert any(part in line for part in expected)


@pytest.mark.parametrize(("size", "theme"), [(WIDE, "light"), (NARROW, "dark")])
def test_nothing_is_too_wide_too_pale_or_without_a_name(
    page: Page, size: tuple[int, int], theme: str
) -> None:
    page.size(*size)
    page.open(f"{GAIT_3}&keep_out=0,0;pi/16,pi/8;pi/8,0&theme={theme}&types=yes")
    if page.id("menu").is_displayed():
        page.id("menu").click()
    page.css("#download > summary").click()
    assert page.js("return document.documentElement.scrollWidth") <= size[0]
    page.has("#diagram-root.waiting", 0)  # it is pale till then
    assert serious_findings(page.driver) == []
    roles = set()
    for node in page.cdp("Accessibility.getFullAXTree")["nodes"]:
        role = node.get("role", {}).get("value")
        roles.add(role)
        name = node.get("name", {}).get("value", "").strip()
        assert name or node["ignored"] or role not in CONTROLS, node
    assert roles >= CONTROLS | {"main", "banner", "region", "status"}


def test_without_a_gait_a_waypoint_can_be_moved_to_where_there_is_one(
    page: Page,
) -> None:
    state = "waypoints=pi/8,pi/8;5pi/16,-5pi/16;pi/8,-5pi/16"
    page.open(state)
    assert page.text("headline") == "✕No gait"
    assert "waypoint 1 (π/8, π/8) has R = 2.9" in page.text("reason")
    assert page.count(".layer-advice .from") == page.count(".advice-head") == 1
    assert serious_findings(page.driver) == []
    page.vehicle()
    assert page.css(".vehicle-note").text == "The posture of waypoint 1"
    page.id("move-there").click()
    page.shows("✓Flyable")
    assert page.count(".layer-advice *") == page.count("#actions *") == 0
    page.id("undo").click()
    page.at(state)
    page.id("allow-valid").click()
    page.at(f"{state}&require=valid")
    # The map becomes blue, and says so; nothing there is shaded as a value.
    page.until(lambda: page.text("map-note").startswith("No red gait through"))
    page.until(lambda: page.text("legend") == "R = 0 in exact physics")


def test_the_map_follows_the_drag_ratio_while_it_is_dragged(page: Page) -> None:
    page.open(GAIT_3)
    region = "return document.querySelector('.region.flyable').getAttribute('d')"
    page.has(".region.flyable", 1)
    before = page.js(region)
    for value in range(560, 500, -4):
        page.choose("drag_ratio", str(value), "input")
        time.sleep(0.03)
    page.until(lambda: page.js(region) != before)  # no change event: it is still held
    page.choose("drag_ratio", "500")
    page.planned()


@pytest.mark.parametrize("size", [WIDE, (390, 844)])
def test_the_verdict_stays_in_sight(page: Page, size: tuple[int, int]) -> None:
    page.size(*size)
    page.open(GAIT_3)
    page.js("scrollTo(0, document.documentElement.scrollHeight)")
    box = page.js(
        "const box = document.getElementById('headline').getBoundingClientRect(); return [box.top, box.bottom]"
    )
    assert 0 <= box[0] < box[1] <= size[1]
    is_sheet = size != WIDE
    assert page.id("sheet-toggle").is_displayed() == is_sheet
    assert page.id("report").is_displayed() != is_sheet
    if is_sheet:
        page.id("sheet-toggle").click()
        assert page.id("report").is_displayed()


def test_many_waypoints_on_a_narrow_map_do_not_overlap(page: Page) -> None:
    circle = [0.3 * cmath.exp(1j * k * math.pi / 7) for k in range(14)]
    points = ";".join(f"{0.75 + z.real:.3f},{z.imag - 0.75:.3f}" for z in circle)
    page.size(390, 844)
    page.open(f"waypoints={points}")
    discs = page.js(
        "return [...document.querySelectorAll('.waypoint')].map((one) => [one.transform.baseVal[0].matrix.e,"
        " one.transform.baseVal[0].matrix.f, Number(one.firstChild.getAttribute('r'))])"
    )
    assert len(discs) == 14
    for (x, y, radius), (x2, y2, radius2) in combinations(discs, 2):
        assert math.hypot(x - x2, y - y2) > radius + radius2 >= 7


class TestTouch:
    @pytest.fixture
    def phone(self, page: Page) -> Iterator[Page]:
        page.size(390, 844)
        page.cdp("Emulation.setTouchEmulationEnabled", enabled=True)
        yield page
        page.cdp("Emulation.setTouchEmulationEnabled", enabled=False)

    def test_waypoints_are_dragged_and_a_tap_adds_another(self, phone: Page) -> None:
        phone.open("waypoints=3pi/8,-3pi/8")
        phone.js("document.getElementById('map').scrollIntoView({ block: 'start' })")
        before = phone.js("return scrollY")
        phone.touch(phone.place(5 * STEP, -6 * STEP))
        phone.at("waypoints=3pi/8,-3pi/8;5pi/16,-3pi/8")
        x, y = phone.place(6 * STEP, -6 * STEP)
        phone.touch((x + 3, y + 3))  # on it: nothing is added
        assert phone.count(".waypoint.chosen[data-index='0']") == 1
        phone.touch(*(phone.place(5 * STEP, -k * STEP) for k in (6, 5, 4.5, 4)))
        phone.at("waypoints=3pi/8,-3pi/8;5pi/16,-pi/4")
        assert phone.js("return scrollY") == before

    def test_the_free_map_scrolls_the_page(self, phone: Page) -> None:
        phone.open("waypoints=3pi/8,-3pi/8")
        phone.js("scrollTo(0, 200)")
        _, y = phone.place(0, 0)
        phone.touch(*((200, y - 20 * k) for k in range(8)))
        phone.until(lambda: phone.js("return scrollY") > 250)
        assert phone.state == "waypoints=3pi/8,-3pi/8"
