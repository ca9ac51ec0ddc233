// The explorer's page: a store, the views of plan, table and pictures that draw it, and what asks the server for it.

import { addressOf, startOf, stateFrom } from "./address.js";
import { angle } from "./angles.js";
import { askingFor } from "./asking.js";
import { byId, html } from "./elements.js";
import { bindMenus } from "./files.js";
import { bindLines, notice, problem, say } from "./lines.js";
import { picturesIn } from "./pictures_view.js";
import { planViewIn } from "./plan_view.js";
import { Gone, planOf, setupOf } from "./queries.js";
import { isPlanDue, planKey, questionOf, storeOf } from "./store.js";
import { tableViewIn } from "./table_view.js";
import { vehicleIn } from "./vehicle.js";

const FIRST_GAIT = 3; // of the paper's gaits, the one that a first visit shows: Gait 4
const MODES = ["waypoints", "keep_out", "keep_in"];
const MOST_PROBLEMS = 8; // of an address that are told

// The address -----------------------------------------------------------------------------------------------------

function stateOfAddress(setup) {
  const { state, problems } = stateFrom(location.hash, setup);
  const more = problems.length - MOST_PROBLEMS;
  const told = [...problems.slice(0, MOST_PROBLEMS), ...(more > 0 ? [`and ${more} more`] : [])].join(" · ");
  notice(told ? `Parts of the address cannot be used and have their defaults: ${told}` : null);
  return state;
}

/** Keep the state in the address; returns `write`, which does so at once. */
function bindAddress(setup, store, commit) {
  let timer = 0;
  let written = null;

  function write() {
    clearTimeout(timer);
    const text = addressOf(store.page.state, setup);
    if (`#${text}` === location.hash || (!text && !location.hash)) return;
    history.replaceState(null, "", text ? `#${text}` : location.pathname);
  }

  store.subscribe(() => {
    const { state, isHeld } = store.page;
    if (state === written) return;
    written = state;
    // A change of the address costs 10 ms, and browsers refuse many in a row: it waits until the loop is painted.
    clearTimeout(timer);
    timer = setTimeout(write, isHeld ? 300 : 80);
  });
  addEventListener("hashchange", () => {
    const next = stateOfAddress(setup);
    store.look(next.view);
    commit(questionOf(next));
  });
  addEventListener("pagehide", write);
  return write;
}

// The page --------------------------------------------------------------------------------------------------------

function bindPage(setup, vehicle) {
  const first = stateOfAddress(setup);
  const start = startOf(setup);
  const isPaper = start.vehicle === setup.paper_gaits[FIRST_GAIT].vehicle;
  const store = storeOf(first, isPaper && planKey(first) === planKey(start));
  const asking = askingFor(store);

  // Changes -------------------------------------------------------------------------------------------------------

  function commit(patch) {
    if ("waypoints" in patch) showPlan();
    pictures.map.letGo(); // of a waypoint or polygon that may be gone now
    store.commit(patch);
  }

  function showPlan() {
    if (store.page.tab === "table") store.put({ tab: "plan" });
  }

  function removeWaypoint(index) {
    pictures.map.select(null);
    commit({ waypoints: store.page.state.waypoints.filter((_, k) => k !== index) });
    say(`Waypoint ${index + 1} removed`);
  }

  function removePolygon(kind, index) {
    pictures.map.select(null);
    commit({ [kind]: store.page.state[kind].filter((_, k) => k !== index) });
    say("Polygon removed");
  }

  /** Plan a gait of the paper. */
  function loadGait(number) {
    const { name: _name, ...gait } = setup.paper_gaits[number];
    commit({ ...questionOf(start), ...gait, eta: store.page.state.eta });
  }

  function undo() {
    pictures.map.letGo();
    store.undo();
  }

  function redo() {
    pictures.map.letGo();
    store.redo();
  }

  // Views ---------------------------------------------------------------------------------------------------------

  const pictures = picturesIn(store, vehicle, {
    add(point, index) {
      const { waypoints } = store.page.state;
      commit({ waypoints: waypoints.toSpliced(index, 0, point) });
      say(`Waypoint ${index + 1} added: α1 ${angle(point[0])}, α2 ${angle(point[1])}`);
    },
    move(index, point) {
      showPlan();
      store.preview({ waypoints: store.page.state.waypoints.with(index, point) });
    },
    movePolygon: (kind, index, ring) => store.preview({ [kind]: store.page.state[kind].with(index, ring) }),
    drop: store.settle,
    cancel: store.cancel,
    remove: removeWaypoint,
    polygon(kind, ring) {
      const polygons = store.page.state[kind];
      commit({ [kind]: [...polygons, ring] });
      pictures.map.select({ kind, index: polygons.length });
      say("Polygon closed");
    },
    removePolygon,
    say,
    modeChanged(mode) {
      for (const name of MODES) byId(`mode-${name}`).setAttribute("aria-pressed", String(name === mode));
    },
  });
  const { map } = pictures;
  const drawPlan = planViewIn(setup, store, {
    commit,
    removeWaypoint,
    removePolygon,
    selectPolygon(kind, index) {
      map.select({ kind, index });
      map.element.focus();
    },
    point: map.point,
    problem,
    failed: asking.failed,
  });
  const drawTable = tableViewIn(setup, store, { commit, failed: asking.failed });

  let isAwaited = false; // the frame in which the loop is painted
  let plan = null;

  /** Draw all but the map. */
  function drawRest() {
    isAwaited = false;
    drawTable(store.page);
    drawPlan(store.page);
    pictures.show(store.page);
    document.documentElement.dataset.planned = isPlanDue(store.page) ? "no" : "yes";
  }

  function draw() {
    pictures.showMap(store.page);
    if (isAwaited) return;
    isAwaited = store.page.plan !== plan;
    plan = store.page.plan;
    // A new loop is painted first; panels, charts and the rest take the time after its frame.
    if (isAwaited) requestAnimationFrame(() => setTimeout(drawRest, 0));
    else drawRest();
  }

  // Header and keys -----------------------------------------------------------------------------------------------

  function bindHeader(writeAddress) {
    byId("version").textContent = setup.version;
    const load = byId("load");
    const gaits = setup.paper_gaits.map(({ name, color }, k) => html("option", { value: String(k) }, `${name}, ${color}`));
    load.append(...gaits);
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
    byId("copy").addEventListener("click", () => {
      writeAddress();
      copyAddress();
    });
    for (const mode of MODES) {
      byId(`mode-${mode}`).addEventListener("click", () => {
        map.setMode(mode);
        map.element.focus({ preventScroll: true });
      });
    }
  }

  function bindKeys() {
    addEventListener("keydown", (event) => {
      if (event.altKey || event.target.matches?.("input[type=text]")) return;
      if (event.ctrlKey || event.metaKey) travel(event);
      else if (event.target !== map.element && map.mode() !== "waypoints") endDraft(event);
    });
  }

  /** Undo or redo with the keys of the system. */
  function travel(event) {
    const key = event.key.toLowerCase();
    if (key === "z" && !event.shiftKey) undo();
    else if (key === "z" || key === "y") redo();
    else return;
    event.preventDefault();
  }

  /** End the drawing of a polygon, wherever the focus is. */
  function endDraft(event) {
    const isControl = event.target.matches?.("button, summary, select, input");
    if (event.key === "Escape") map.setMode("waypoints");
    else if (event.key === "Enter" && map.hasDraft() && !isControl) map.closeDraft();
  }

  function bindWelcome() {
    byId("try-gait").addEventListener("click", () => loadGait(FIRST_GAIT));
    byId("draw-own").addEventListener("click", () => {
      store.put({ isNew: false, ghost: null });
      map.element.focus({ preventScroll: true });
      say("Click the map, or press Enter at the crosshair, to set the first waypoint");
    });
  }

  /** Show a gait of the paper at a first visit, as a ghost: it plays, and can be tried. */
  async function showGhost() {
    const { name, ...gait } = setup.paper_gaits[FIRST_GAIT];
    const found = await planOf({ ...questionOf(start), ...gait });
    if (store.page.isNew) store.put({ ghost: { ...found, name } });
  }

  bindHeader(bindAddress(setup, store, commit));
  bindKeys();
  bindWelcome();
  store.subscribe(draw);
  store.subscribe(asking.ask);
  store.put({});
  if (store.page.isNew) showGhost().catch(asking.failed);
}

async function copyAddress() {
  try {
    await navigator.clipboard.writeText(location.href);
    byId("copy").textContent = "Copied";
    say("Link copied");
    setTimeout(() => (byId("copy").textContent = "Copy link"), 1500);
  } catch {
    problem("The browser does not allow this page to copy. The link is the address of the page");
  }
}

/** Let a button open and close a part of the page; only narrow windows show such a button. */
function bindToggle(id, part) {
  byId(id).addEventListener("click", () => {
    const isOpen = part.classList.toggle("open");
    byId(id).setAttribute("aria-expanded", String(isOpen));
  });
}

async function begin() {
  bindLines();
  bindMenus();
  bindToggle("menu", byId("tools"));
  bindToggle("sheet-toggle", byId("result"));
  new ResizeObserver(([{ target }]) =>
    document.documentElement.style.setProperty("--sheet", `${target.offsetHeight}px`),
  ).observe(byId("verdict"));
  const vehicle = vehicleIn(byId("vehicle-root")); // its module is loaded meanwhile
  let setup;
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
  bindPage(setup, vehicle);
  document.documentElement.dataset.ready = "yes";
}

begin();
