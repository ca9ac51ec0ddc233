// The pictures: the map with its legend, the charts, the vehicle and the roll–pitch diagrams, at one time of the clock.

import { figure, number } from "./angles.js";
import { CHARTS, chartsIn } from "./charts.js";
import { clockOf, prefersStillness } from "./clock.js";
import { showDiagram } from "./diagram.js";
import { byId, html } from "./elements.js";
import { mapIn } from "./map.js";
import { SHADES } from "./picture.js";
import { diagramOf, drawn, ghostOf, isDiagramDue, isPlanDue, mapNote, movingOf, reportOf } from "./store.js";

const STEPS = 8; // of a period, for those who asked for less motion

/**
 * Make the pictures of a store, with the vehicle that is there already. `onMap` has what the map reports, see map.js.
 *
 * Returns `map`, the function `showMap` for what is to be painted first, and `show` for the rest.
 */
export function picturesIn(store, vehicle, onMap) {
  const map = mapIn(byId("map-root"), onMap);
  const clock = clockOf(showPhase, (isPlaying) => {
    byId("play").textContent = isPlaying ? "Pause" : playText();
  });
  const charts = chartsIn(byId("chart-upper"), byId("chart-lower"), byId("legend-alpha"), (phase) =>
    clock.hold(phase, "chart"),
  );
  let wantsMotion = !prefersStillness(); // until the reader stops it
  let mostThrust = 0; // of the rotors of the gait shown, as a share of the weight

  // One time for all ------------------------------------------------------------------------------------------------

  function showPhase(phase, source) {
    const moving = movingOf(store.page);
    const at = charts.at(phase);
    map.showDot(at && [at.alpha[0], at.alpha[1]], moving?.color ?? "");
    if (at) vehicle.at({ phase, alpha: at.alpha, shares: thrustsAt(moving.series, at), most: mostThrust });
    if (source !== "scrub") byId("scrub").value = String(Math.round(phase * 1000));
    const text = at ? timeText(moving, at.time) : "";
    byId("clock").textContent = text;
    byId("scrub").setAttribute("aria-valuetext", text || "no gait");
  }

  /** Step on by a part of the period instead of moving. */
  function stepClock() {
    clock.set(clock.phase >= 0.999 ? 0 : Math.min(1, Math.floor(clock.phase * STEPS + 1.001) / STEPS), "step");
  }

  function play(isWanted) {
    wantsMotion = isWanted;
    clock.play(isWanted);
  }

  /** Let a period, of a table that of its rows, take as long on the screen as the speed says. */
  function setPace() {
    const { tab, table, state } = store.page;
    const t = tab === "table" ? table.series.t : null;
    const seconds = t ? t.at(-1) - t[0] : state.period;
    clock.setSeconds(seconds / Number(byId("pace").value));
  }

  function bindPlayer() {
    byId("play").textContent = playText();
    byId("play").addEventListener("click", () => (prefersStillness() ? stepClock() : play(!clock.playing)));
    byId("scrub").addEventListener("input", (event) => {
      play(false);
      clock.set(Number(event.target.value) / 1000, "scrub");
    });
    // The pointer over a curve or over the loop sets the time.
    for (const id of ["chart-upper", "chart-lower", "map-root"]) {
      byId(id).addEventListener("pointerleave", clock.release);
    }
    map.element.addEventListener("pointermove", (event) => {
      const phase = event.buttons ? null : map.phaseAt(event, movingOf(store.page)?.series);
      if (phase === null) clock.release();
      else clock.hold(phase, "map");
    });
    byId("pace").addEventListener("change", setPace);
  }

  function bindChoice() {
    for (const [value, { title, unit }] of Object.entries(CHARTS)) {
      const onchange = () => store.look({ chart: value });
      const input = html("input", { type: "radio", name: "chart", value, id: `chart-${value}`, onchange });
      byId("field-chart").append(input, html("label", { for: input.id, class: "choice", title: unit }, title));
    }
  }

  // Drawing ---------------------------------------------------------------------------------------------------------

  function showMotion(page) {
    const moving = movingOf(page);
    const report = reportOf(page);
    mostThrust = largest(moving?.series.hover_thrusts.flat() ?? []);
    charts.show(moving?.series ?? null, page.state.view.chart, moving?.color);
    vehicle.show((moving ?? report)?.vehicle_view ?? null);
    if (!moving && report?.posture) {
      const name = report.status === "empty" ? "Upright, in hover" : "The posture of waypoint 1";
      vehicle.at({ phase: 0, name, ...report.posture, most: largest(report.posture.shares) });
    }
    byId("field-chart").hidden = !moving;
    for (const id of ["play", "scrub"]) byId(id).disabled = !moving;
    clock.play(Boolean(moving) && wantsMotion);
    showPhase(clock.phase, null);
  }

  function showChoice({ state }) {
    for (const key of Object.keys(CHARTS)) byId(`chart-${key}`).checked = state.view.chart === key;
    charts.choose(state.view.chart);
  }

  function showAttitudes(page) {
    byId("eta-row").hidden = page.tab === "table"; // only plans are biased
    showDiagram(byId("diagram-root"), diagramOf(page));
  }

  function repaint() {
    map.repaint();
    charts.rebuild();
    vehicle.repaint();
  }

  const inTheme = drawn((page) => [page.state.view.theme], ({ state }) => {
    document.documentElement.dataset.theme = state.view.theme;
    repaint();
  });
  const parts = [
    drawn((page) => [page.background, page.state.view], showLegend),
    drawn((page) => [mapNote(page)], showNote),
    drawn((page) => [ghostOf(page)], (page) => (byId("welcome").hidden = !ghostOf(page))),
    drawn((page) => [page.tab, page.table, page.state.period], setPace),
    drawn((page) => [movingOf(page), reportOf(page)], showMotion),
    drawn((page) => [page.state.view.chart], showChoice),
    drawn((page) => [diagramOf(page), page.tab], showAttitudes),
    (page) => {
      vehicle.rest(isPlanDue(page) && !page.isGone); // the processor plans first
      byId("diagram-root").setAttribute("aria-busy", String(isDiagramDue(page)));
      byId("diagram-root").classList.toggle("waiting", page.isDiagramSlow);
    },
  ];

  bindPlayer();
  bindChoice();
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", repaint);
  return {
    map,
    showMap(page) {
      inTheme(page);
      map.show(page);
    },
    show: (page) => parts.forEach((part) => part(page)),
  };
}

const playText = () => (prefersStillness() ? "Step" : "Play");
const largest = (thrusts) => thrusts.reduce((most, thrust) => Math.max(most, Math.abs(thrust)), 0);

function timeText({ series, rows }, time) {
  if (series.t) return `${number(time, 3)} s`;
  return `row ${((Math.round(time) - 1) % rows) + 1}`;
}

/** Return the hover thrusts at a row and a part of the way to the next; null where there are none. */
function thrustsAt(series, { row, part }) {
  return series.hover_thrusts.map((column) => {
    const [from, to] = [column[row], column[Math.min(row + 1, column.length - 1)]];
    return from === null || to === null ? null : from + part * (to - from);
  });
}

function showNote(page) {
  const text = mapNote(page);
  byId("map-note").hidden = !text;
  byId("map-note").textContent = text;
}

/** Return what the shading of the map means, as elements. */
function scaleOf({ shading, range, sheet, raised }) {
  if (shading === "none") return [];
  const { name, unit } = SHADES[shading];
  const ramp = (kind) => html("span", { class: `ramp ${kind}`, "aria-hidden": "true" });
  if (sheet === "blue") return [ramp("hatched"), raised ? "no gait surface" : `${name} = 0 in exact physics`];
  const reach = Math.max(...range.map(Math.abs));
  const [low, high] = shading === "R" ? [-reach, reach] : [0, range[1]];
  const end = (value) => html("span", {}, `${figure(value, 3)}${unit}`);
  return [html("span", {}, name), end(low), ramp(shading), end(high)];
}

function showLegend({ background, state }) {
  if (!background) return;
  const isBounded = background.regions.some(({ name, polygons }) => name.startsWith("flyable") && polygons.length);
  const isOutlined = isBounded && state.view.regions;
  const key = isOutlined ? [html("span", { class: "flyable-key" }, "inside: flyable")] : [];
  byId("legend").replaceChildren(...scaleOf(background), ...key);
}
