"""From a click on the explorer's map to the repainted loop of 8 waypoints, in headless Chromium.

The browser's own clock counts, from the event's time stamp to the task after the frame in which the loop was painted.
Beside it stands a click of which the server has nothing to do but answer: the same, with an empty state.
"""

from __future__ import annotations

import statistics
from typing import TYPE_CHECKING

from tests.test_browser import STEP, Page, address, window  # noqa: F401 - the fixtures

if TYPE_CHECKING:
    from collections.abc import Callable

    import pytest

ROUNDS = 25
AIM = 100.0  # median [ms]

# Seven waypoints round the square of Gait 3; the click that is measured sets the eighth.
SEVEN = "waypoints=3pi/8,-3pi/8;3pi/8,-pi/4;3pi/8,-pi/8;pi/4,-pi/8;pi/8,-pi/8;pi/8,-pi/4;pi/8,-3pi/8&snap=no"

WATCH = """
window.clicked = window.painted = null;
const afterPaint = (then) => requestAnimationFrame(() => {
  const channel = new MessageChannel();
  channel.port1.onmessage = () => then(performance.now());
  channel.port2.postMessage(null);
});
const loop = document.querySelector(".layer-loop");
new MutationObserver(() => {
  if (window.clicked !== null && window.painted === null) {
    window.painted = 0;
    afterPaint((now) => { window.painted = now; });
  }
}).observe(loop, { childList: true });
addEventListener("pointerup", (event) => {
  window.clicked = event.timeStamp;
  window.painted = null;
  if (!window.empty) return;
  event.stopImmediatePropagation();
  window.painted = 0;
  const options = { method: "POST", headers: { "Content-Type": "application/json" }, body: "{}" };
  fetch("api/plan", options).then((answer) => answer.json()).then(() => {
    document.getElementById("readout").textContent = String(event.timeStamp);
    afterPaint((now) => { window.painted = now; });
  });
}, true);
"""


def milliseconds(page: Page, act: Callable[[], None]) -> float:
    page.js("window.clicked = window.painted = null")
    act()
    taken = page.until(
        lambda: page.js(
            "return window.painted ? window.painted - window.clicked : null"
        )
    )
    return float(taken)


def settled(page: Page, waypoints: int) -> None:
    """Wait until everything is painted, the roll–pitch diagram too, which the server works longest on."""
    page.until(lambda: page.count(".waypoint") == waypoints)
    page.planned()
    page.until(lambda: page.count("#diagram-root[aria-busy=false]") == 1)


def test_click_to_repaint(window: Page, capsys: pytest.CaptureFixture[str]) -> None:  # noqa: F811
    page = window
    page.open(SEVEN)
    page.js(WATCH)
    settled(page, 7)
    ours, empty = [], []
    for turn in range(ROUNDS):
        place = (
            4 * STEP + 0.012 * (turn - ROUNDS / 2),
            -6.5 * STEP,
        )  # another one each time: no answer is at hand
        page.js("window.empty = false")
        ours.append(milliseconds(page, lambda: page.click(*place)))  # noqa: B023 - called at once
        settled(page, 8)
        page.js("window.clicked = null")
        page.id("undo").click()
        settled(page, 7)
        page.js("window.empty = true")
        empty.append(milliseconds(page, lambda: page.click(-4 * STEP, 4 * STEP)))
    median, nothing = statistics.median(ours), statistics.median(empty)
    with capsys.disabled():
        print(
            f"\nclick to repaint, 8 waypoints: median {median:.0f} ms (aim: at most {AIM:.0f}), "
            f"{min(ours):.0f} to {max(ours):.0f}; an empty question: {nothing:.0f} ms; ratio {median / nothing:.2f}"
        )
