// The explorer's page: one state, what the server answers to it, and the pictures of both.

import { angle, figure, number } from "./angles.js";
import { CHARTS, chartsIn } from "./charts.js";
import { clockOf, prefersStillness } from "./clock.js";
import { bindControls } from "./controls.js";
import { showDiagram } from "./diagram.js";
import { byId, html } from "./elements.js";
import { allowDownloads, bindDownloads, bindFile, bindMenus } from "./files.js";
import { bindLines, gone, notice, problem, say } from "./lines.js";
import { mapIn } from "./map.js";
import { Gone, latest, planOf, setupOf, waitForServer } from "./queries.js";
import { addressOf, historyOf, planKey, startOf, stateFrom } from "./state.js";
import { vehicleIn } from "./vehicle.js";
import { adviceOf, sentenceOf, showReport, showVerdict, verdictOf } from "./verdict.js";

const FIRST_GAIT = 3; // of the paper's gaits, the one that a first visit shows: Gait 4
const QUIET = 200; // after the last change, before the diagram is asked for [ms]

let setup = null;
let store = null;
let showControls = () => {};
let plan = null;
let planFor = "";
let askedFor = "";
let table = null;
let tab = "plan";
let away = null;
let diagramTimer = 0;
let diagramFor = "";
let mapFor = "";
let mapNote = "";
let sheetShown = "red"; // of a map that follows the plan
let emptyKey = ""; // of the state without waypoints that a first visit has
let addressTimer = 0;
let ghost = null; // the plan of the gait that a first visit shows
let moving = null; // the report whose gait the charts show; it lasts until the next answer is shown
let mostThrust = 0; // of its rotors, as a share of the weight
let wantsMotion = !prefersStillness(); // until the reader stops it
const maps = new Map();

function failed(error) {
  if (!(error instanceof Gone)) {
    problem(error.message);
    return;
  }
  away ??= waitForServer(() => {
    away = null;
    gone(null);
    askedFor = diagramFor = mapFor = "";
    refresh({ live: false });
  }, gone);
}

// Questions -------------------------------------------------------------------------------------------------------

/** Return what the server is to know: all but the view. */
function question(state) {
  const { view: _view, ...rest } = state;
  return rest;
}

const planner = latest("api/plan", {
  onAnswer(answer, body) {
    plan = answer;
    planFor = planKey(body);
    byId("main").classList.remove("stale");
    map.showPlan(plan);
    // The loop is painted first; panels, charts and the rest may take the frames after it.
    requestAnimationFrame(() => setTimeout(showFound, 0));
  },
  onError(error, body) {
    if (error instanceof Gone) {
      byId("main").classList.add("stale");
      showVerdict({ status: "gone" }, null, {}); // the old one was that of another loop
      failed(error);
      return;
    }
    // Without waypoints there is no verdict: the error is a line of the page.
    const isEmpty = !body.waypoints.length;
    if (isEmpty) problem(error.message);
    plan = isEmpty ? { status: "empty" } : { status: "refused", reason: error.message };
    planFor = planKey(body);
    byId("main").classList.remove("stale");
    map.showPlan(plan);
    showFound();
  },
  onWaiting: (waits) => byId("main").classList.toggle("waiting", waits),
});

const diagrams = latest("api/diagram", {
  onAnswer: (answer) => {
    drawDiagram(answer);
  },
  onError: (error) => {
    diagramFor = "";
    if (error instanceof Gone) failed(error);
    else drawDiagram({ reason: error.message });
  },
  onWaiting: (waits) => byId("diagram-root").classList.toggle("waiting", waits),
});

const backgrounds = latest("api/map", {
  onAnswer(answer, body) {
    const background = { ...answer, sheet: body.sheet, shading: body.shading };
    maps.set(JSON.stringify(body), background);
    if (maps.size > 16) maps.delete(maps.keys().next().value);
    showBackground(background); // also one that is late, while κ is dragged: the newest one follows
  },
  onError: (error) => {
    mapFor = "";
    failed(error);
  },
});

/** Return the sheet that the map shows: while something is dragged it stays what it is. */
function sheetOf(state, live) {
  const { sheet } = state.view;
  if (sheet !== "auto") return sheet;
  if (state.color !== "auto") return state.color;
  if (!live && !store.isPreview() && shownReport()?.color) sheetShown = shownReport().color === "blue" ? "blue" : "red";
  return sheetShown;
}

/** Say that red has become impossible, or that the map is not a table's, instead of changing the map silently. */
function sheetNote(state) {
  if (tab === "table" && !table.map) {
    return `The map is that of the vehicle ${state.vehicle}, not that of the table, ${table.vehicle}.`;
  }
  if (tab !== "plan" || plan?.color !== "blue" || state.color !== "auto") return "";
  const same = sheetOf(state, true) === "blue";
  return `No red gait through these waypoints: the loop is ${same ? "now on the blue sheet, and so is the map" : "on the blue sheet"}.`;
}

function askMap(state, live) {
  const sheet = sheetOf(state, live);
  const { shading } = state.view;
  showNote(state);
  const { vehicle, drag_ratio, coefficients } = (tab === "table" && table.map) || state;
  const body = { vehicle, drag_ratio, coefficients, sheet, shading };
  const key = JSON.stringify(body);
  if (key === mapFor) return;
  mapFor = key;
  if (maps.has(key)) showBackground(maps.get(key));
  else backgrounds.ask(body, live);
}

function drawDiagram(answer) {
  byId("diagram-root").setAttribute("aria-busy", "false");
  byId("eta-row").hidden = tab === "table"; // only plans are biased
  showDiagram(byId("diagram-root"), answer);
}

function askDiagram() {
  clearTimeout(diagramTimer);
  const state = store.state;
  if (tab === "table") {
    diagrams.stop();
    diagramFor = "";
    drawDiagram(table.diagram);
    return;
  }
  if (plan?.status !== "planned") {
    diagrams.stop();
    diagramFor = "";
    drawDiagram(null);
    return;
  }
  const key = JSON.stringify(question(state));
  if (key === diagramFor || planFor !== planKey(state)) return;
  byId("diagram-root").setAttribute("aria-busy", "true");
  diagramTimer = setTimeout(() => {
    diagramFor = key;
    diagrams.ask(question(state));
  }, QUIET);
}

// Showing ---------------------------------------------------------------------------------------------------------

const shownReport = () => (tab === "table" ? table : plan);

function showBackground(background) {
  map.showMap(background);
  mapNote = background.note ?? "";
  showNote(store.state);
  const legend = byId("legend");
  const { shading, range, sheet } = background;
  const name = shading === "R" ? "R" : "σ";
  const ramp = (kind) => html("span", { class: `ramp ${kind}`, "aria-hidden": "true" });
  if (shading === "none") legend.replaceChildren();
  else if (sheet === "blue" && !background.raised) legend.replaceChildren(ramp("hatched"), `${name} = 0 in exact physics`);
  else if (sheet === "blue") legend.replaceChildren(ramp("hatched"), "no gait surface");
  else {
    const [low, high] = shading === "R" ? spread(range) : [0, range[1]];
    legend.replaceChildren(
      html("span", {}, name),
      html("span", {}, figure(low, 3)),
      ramp(shading),
      html("span", {}, figure(high, 3)),
    );
  }
  if (
    byId("regions").checked &&
    background.regions.some((region) => region.name.startsWith("flyable") && region.polygons.length)
  ) {
    legend.append(html("span", { class: "flyable-key" }, "inside: flyable"));
  }
}

function showNote(state) {
  const text = [sheetNote(state), mapNote].filter(Boolean).join(" ");
  byId("map-note").hidden = !text;
  byId("map-note").textContent = text;
}

function spread([low, high]) {
  const reach = Math.max(Math.abs(low), Math.abs(high));
  return [-reach, reach];
}

function showFound() {
  vehicle.rest(false);
  const report = shownReport();
  const advice = adviceOf(report, store.state.waypoints);
  showVerdict(report, advice, {
    move: (index, point) => commit({ waypoints: store.state.waypoints.with(index, point) }),
    allowValid: () => commit({ require: "valid" }),
  });
  if (ghost) byId("reason").textContent = `The vehicle flies ${setup.paper_gaits[FIRST_GAIT].name} of the paper`;
  showReport(byId("report"), report, advice, {
    point: (where) => map.point(where),
    take: ({ color, sign, flyable }) => commit({ color, sign, require: flyable ? "flyable" : "valid" }),
  });
  const sentence = sentenceOf(report, advice);
  if (byId("verdict-spoken").textContent !== sentence) byId("verdict-spoken").textContent = sentence;
  document.title =
    report && report.status !== "empty" ? `${verdictOf(report).headline} · gaitgraph` : "gaitgraph explore";
  moving = tab === "table" ? table : plan?.status === "planned" ? plan : ghost;
  mostThrust = largest(moving?.series.hover_thrusts.flat() ?? []);
  charts.show(moving?.series ?? null, store.state.view.chart, moving?.color);
  vehicle.show((moving ?? report)?.vehicle_view ?? null, tab === "table");
  if (!moving && report?.posture) {
    const name = report.status === "empty" ? "Upright, in hover" : "The posture of waypoint 1";
    vehicle.at({ phase: 0, name, ...report.posture, most: largest(report.posture.shares) });
  }
  byId("field-chart").hidden = !moving;
  for (const id of ["play", "scrub"]) byId(id).disabled = !moving;
  setPace();
  clock.play(Boolean(moving) && wantsMotion);
  allowDownloads(plan?.status === "planned");
  showPhase(clock.phase, null);
  document.documentElement.dataset.planned = planFor === planKey(store.state) ? "yes" : "no";
  askMap(store.state, false);
  askDiagram();
}

function showPhase(phase, source) {
  const at = charts.at(phase);
  map.showDot(at && [at.alpha[0], at.alpha[1]], moving?.color ?? "");
  if (at) vehicle.at({ phase, alpha: at.alpha, shares: thrustsAt(moving.series, at), most: mostThrust });
  if (source !== "scrub") byId("scrub").value = String(Math.round(phase * 1000));
  const text = at ? (moving.series.t ? `${number(at.time, 3)} s` : `row ${((Math.round(at.time) - 1) % moving.rows) + 1}`) : "";
  byId("clock").textContent = text;
  byId("scrub").setAttribute("aria-valuetext", text || "no gait");
}

const largest = (thrusts) => thrusts.reduce((most, thrust) => Math.max(most, Math.abs(thrust)), 0);

/** Return the hover thrusts at a row and a part of the way to the next; null where there are none. */
function thrustsAt(series, { row, part }) {
  return series.hover_thrusts.map((column) => {
    const [from, to] = [column[row], column[Math.min(row + 1, column.length - 1)]];
    return from === null || to === null ? null : from + part * (to - from);
  });
}

function showTabs() {
  byId("tabs").hidden = byId("table-bar").hidden = !table;
  byId("tab-plan").setAttribute("aria-pressed", String(tab === "plan"));
  byId("tab-table").setAttribute("aria-pressed", String(tab === "table"));
  if (table) {
    byId("table-name").textContent = table.name;
    byId("use-request").hidden = !table.request;
  }
  map.showTable(table, tab);
}

// A change of the state ------------------------------------------------------------------------------------------

function refresh({ live }) {
  const state = store.state;
  const theme = document.documentElement.dataset.theme;
  if (theme !== state.view.theme) {
    document.documentElement.dataset.theme = state.view.theme;
    map.repaint();
    charts.rebuild();
    vehicle.repaint();
  }
  map.showState(state);
  const key = planKey(state);
  if (planFor !== key) document.documentElement.dataset.planned = "no";
  if (key !== emptyKey) dropGhost();
  if (key !== askedFor) {
    askedFor = key;
    problem(null);
    clearTimeout(diagramTimer);
    diagrams.stop(); // the server is to plan first
    diagramFor = "";
    byId("diagram-root").setAttribute("aria-busy", "true");
    vehicle.rest(true); // until the loop is painted
    planner.ask(question(state), live);
  } else if (!live) askDiagram();
  showControls(state);
  for (const key of Object.keys(CHARTS)) byId(`chart-${key}`).checked = state.view.chart === key;
  byId("undo").disabled = !store.canUndo();
  byId("redo").disabled = !store.canRedo();
  setPace();
  charts.choose(state.view.chart);
  askMap(state, live);
  // A change of the address costs 10 ms, and browsers refuse many in a row: it waits until the loop is painted.
  clearTimeout(addressTimer);
  addressTimer = setTimeout(writeAddress, live ? 300 : 80);
}

function writeAddress() {
  clearTimeout(addressTimer);
  const text = addressOf(store.state, setup);
  if (`#${text}` === location.hash || (!text && !location.hash)) return;
  history.replaceState(null, "", text ? `#${text}` : location.pathname);
}

function commit(patch) {
  if (tab === "table" && "waypoints" in patch) showTab("plan");
  map.letGo(); // of a waypoint or polygon that may be gone now
  store.commit(patch);
}

function showTab(name) {
  tab = name;
  showTabs();
  showFound();
}

function limited(count, limit, what) {
  if (count < limit) return false;
  problem(`${what} must be at most ${limit}, got ${count + 1}`);
  return true;
}

// Parts -----------------------------------------------------------------------------------------------------------

function removeWaypoint(index) {
  map.select(null);
  commit({ waypoints: store.state.waypoints.filter((_, k) => k !== index) });
  say(`Waypoint ${index + 1} removed`);
}

function removePolygon(kind, index) {
  map.select(null);
  commit({ [kind]: store.state[kind].filter((_, k) => k !== index) });
  say("Polygon removed");
}

const map = mapIn(byId("map-root"), {
  add(point, index) {
    const { waypoints } = store.state;
    if (limited(waypoints.length, setup.limits.waypoints, "Waypoints")) return;
    commit({ waypoints: waypoints.toSpliced(index, 0, point) });
    say(`Waypoint ${index + 1} added: α1 ${angle(point[0])}, α2 ${angle(point[1])}`);
  },
  move(index, point) {
    if (tab === "table") showTab("plan");
    store.preview({ waypoints: store.state.waypoints.with(index, point) });
  },
  movePolygon(kind, index, ring) {
    store.preview({ [kind]: store.state[kind].with(index, ring) });
  },
  drop: () => store?.settle(),
  cancel: () => store.cancel(),
  remove: removeWaypoint,
  polygon(kind, ring) {
    if (limited(store.state[kind].length, setup.limits.polygons, "Polygons")) return;
    commit({ [kind]: [...store.state[kind], ring] });
    map.select({ kind, index: store.state[kind].length - 1 });
    say("Polygon closed");
  },
  removePolygon,
  selected() {},
  say,
  modeChanged(mode) {
    for (const name of ["waypoints", "keep_out", "keep_in"]) {
      byId(`mode-${name}`).setAttribute("aria-pressed", String(name === mode));
    }
  },
});

const vehicle = vehicleIn(byId("vehicle-root"));
const clock = clockOf(
  showPhase,
  (playing) => (byId("play").textContent = playing ? "Pause" : prefersStillness() ? "Step" : "Play"),
);
const charts = chartsIn(byId("chart-upper"), byId("chart-lower"), byId("legend-alpha"), (phase) =>
  clock.hold(phase, "chart"),
);

/** Step on by an eighth of the period instead of moving, for those who asked for less motion. */
function stepClock() {
  clock.set(clock.phase >= 0.999 ? 0 : Math.min(1, Math.floor(clock.phase * 8 + 1.001) / 8), "step");
}

/** Let a period, of a table that of its rows, take as long on the screen as the speed says. */
function setPace() {
  const t = tab === "table" ? table.series.t : null;
  clock.setSeconds((t ? t.at(-1) - t[0] : store.state.period) / Number(byId("pace").value));
}

function bindPlayer() {
  if (prefersStillness()) byId("play").textContent = "Step";
  const play = (wanted) => clock.play((wantsMotion = wanted));
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
    const phase = event.buttons ? null : map.phaseAt(event, moving?.series);
    if (phase === null) clock.release();
    else clock.hold(phase, "map");
  });
  byId("pace").addEventListener("change", setPace);
}

/** Show a gait of the paper at a first visit, as a ghost: it plays, and can be tried. */
async function showGhost() {
  const { name: _name, ...gait } = setup.paper_gaits[FIRST_GAIT];
  const { view: _view, ...begin } = startOf(setup);
  const found = await planOf({ ...begin, ...gait });
  if (table || (plan && plan.status !== "empty")) return;
  ghost = found;
  map.showGhost(ghost);
  byId("welcome").hidden = false;
  showFound();
}

function dropGhost() {
  byId("welcome").hidden = true;
  if (!ghost) return;
  ghost = null;
  map.showGhost(null);
}

function bindWelcome() {
  byId("try-gait").addEventListener("click", () => loadGait(FIRST_GAIT));
  byId("draw-own").addEventListener("click", () => {
    dropGhost();
    showFound();
    map.element.focus({ preventScroll: true });
    say("Click the map, or press Enter at the crosshair, to set the first waypoint");
  });
}

/** Plan a gait of the paper. */
function loadGait(number) {
  const { name: _name, ...gait } = setup.paper_gaits[number];
  const { view: _view, ...begin } = startOf(setup);
  commit({ ...begin, ...gait, eta: store.state.eta });
}

function closeTable() {
  table = null;
  showTab("plan");
  byId("open").focus();
}

function bindTable() {
  bindFile(setup.limits.table_bytes, {
    onReport(report) {
      table = report;
      dropGhost();
      problem(null);
      map.select(null);
      showTab("table");
    },
    onError: failed,
  });
  byId("tab-plan").addEventListener("click", () => showTab("plan"));
  byId("tab-table").addEventListener("click", () => showTab("table"));
  byId("close-table").addEventListener("click", closeTable);
  byId("use-request").addEventListener("click", () => {
    const { view: _view, ...asked } = { ...startOf(setup), ...table.request };
    closeTable();
    commit(asked);
  });
}

/** Let a button open and close a part of the page; only narrow windows show such a button. */
function bindToggle(id, part) {
  byId(id).addEventListener("click", () => {
    const open = part.classList.toggle("open");
    byId(id).setAttribute("aria-expanded", String(open));
  });
}

function bindHeader() {
  byId("version").textContent = setup.version;
  const load = byId("load");
  load.append(
    ...setup.paper_gaits.map((gait, k) => html("option", { value: String(k) }, `${gait.name}, ${gait.color}`)),
  );
  load.addEventListener("change", () => {
    loadGait(Number(load.value));
    load.value = "";
  });
  byId("undo").addEventListener("click", undo);
  byId("redo").addEventListener("click", redo);
  byId("clear").addEventListener("click", () => {
    map.select(null);
    commit({ waypoints: [] });
  });
  byId("copy").addEventListener("click", async () => {
    writeAddress();
    try {
      await navigator.clipboard.writeText(location.href);
      byId("copy").textContent = "Copied";
      say("Link copied");
      setTimeout(() => (byId("copy").textContent = "Copy link"), 1500);
    } catch {
      problem("The browser does not allow this page to copy. The link is the address of the page");
    }
  });
  new ResizeObserver(([{ target }]) =>
    document.documentElement.style.setProperty("--sheet", `${target.offsetHeight}px`),
  ).observe(byId("verdict"));
  bindLines();
  bindMenus();
  bindToggle("menu", byId("tools"));
  bindToggle("sheet-toggle", byId("result"));
  for (const mode of ["waypoints", "keep_out", "keep_in"]) {
    byId(`mode-${mode}`).addEventListener("click", () => {
      map.setMode(mode);
      map.element.focus({ preventScroll: true });
    });
  }
  const names = Object.entries(CHARTS);
  for (const [value, { title, unit }] of names) {
    const input = html("input", {
      type: "radio",
      name: "chart",
      value,
      id: `chart-${value}`,
      onchange: () => store.look({ chart: value }),
    });
    byId("field-chart").append(input, html("label", { for: input.id, class: "choice", title: unit }, title));
  }
}

function undo() {
  map.letGo();
  store.undo();
}

function redo() {
  map.letGo();
  store.redo();
}

function bindKeys() {
  addEventListener("keydown", (event) => {
    const isText = event.target.matches?.("input[type=text]");
    if ((event.ctrlKey || event.metaKey) && !event.altKey && !isText) {
      const key = event.key.toLowerCase();
      if (key === "z") (event.shiftKey ? redo : undo)();
      else if (key === "y") redo();
      else return;
      event.preventDefault();
      return;
    }
    if (event.target === map.element || isText || event.ctrlKey || event.metaKey || event.altKey) return;
    if (map.mode() === "waypoints") return;
    if (event.key === "Escape") map.setMode("waypoints");
    else if (event.key === "Enter" && map.hasDraft() && !event.target.matches?.("button, summary, select, input"))
      map.closeDraft();
  });
}

function readAddress() {
  const { state, problems } = stateFrom(location.hash, setup);
  if (problems.length) {
    const more = problems.length > 8 ? [`and ${problems.length - 8} more`] : [];
    const told = [...problems.slice(0, 8), ...more].join(" · ");
    notice(`Parts of the address cannot be used and have their defaults: ${told}`);
  } else notice(null);
  return state;
}

async function start() {
  try {
    setup = await setupOf();
  } catch (error) {
    problem(
      error instanceof Gone
        ? "The server does not answer. Start “gaitgraph explore” again and open the address that it prints."
        : `${error.message}. Open the address that “gaitgraph explore” prints.`,
    );
    return;
  }
  bindHeader();
  bindTable();
  bindDownloads(setup.formats, () => question(store.state), failed);
  bindPlayer();
  bindKeys();
  emptyKey = planKey(startOf(setup));
  store = historyOf(readAddress(), (_state, how) => refresh(how));
  showControls = bindControls(setup, {
    commit,
    preview: (patch) => store.preview(patch),
    look: (patch) => store.look(patch),
    problem,
    remove: removeWaypoint,
    removePolygon,
    selectPolygon(kind, index) {
      map.select({ kind, index });
      map.element.focus();
    },
  });
  store.look({});
  bindWelcome();
  if (planKey(store.state) === emptyKey) showGhost().catch(failed);
  addEventListener("hashchange", () => {
    const next = readAddress();
    store.look(next.view);
    const { view: _view, ...rest } = next;
    commit(rest);
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    map.repaint();
    charts.rebuild();
    vehicle.repaint();
  });
  addEventListener("pagehide", writeAddress);
  document.documentElement.dataset.ready = "yes";
}

start();
