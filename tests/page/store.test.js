// The store of the explorer's page, and its text in the address, without a browser.

import assert from "node:assert/strict";
import { test } from "node:test";

import { addressOf, startOf, stateFrom } from "../../gaitgraph/explorer/page/address.js";
import {
  diagramKey,
  diagramOf,
  drawn,
  ghostOf,
  isDiagramDue,
  isPlanDue,
  mapNote,
  mapQuestion,
  movingOf,
  planKey,
  questionOf,
  reportOf,
  sheetOf,
  storeOf,
} from "../../gaitgraph/explorer/page/store.js";

const SETUP = {
  colors: ["auto", "red", "blue"],
  signs: ["auto", "positive", "negative"],
  objectives: ["shortest", "robust"],
  methods: ["exact", "grid"],
  requires: ["flyable", "valid"],
  laws: ["smooth", "constant-speed"],
  presets: [
    { name: "paper", vehicle: "paper", drag_ratio: 0.1687 },
    { name: "beetle_omni", vehicle: "beetle_omni", drag_ratio: 0.06 },
  ],
  coefficients: ["published", "exact"],
  ranges: {
    divisions: { low: 2, high: 64, whole: true, allowed: "a whole number from 2 to 64" },
    accuracy: { low: 1e-5, high: 0.1, allowed: "a number from 1e-5 to 0.1" },
    drag_ratio: { low: 0.02, high: 1, allowed: "a number from 0.02 to 1" },
    period: { low: 1e-6, high: 1e9, allowed: "a number of seconds" },
    samples: { low: 1, high: 10000, whole: true, allowed: "a whole number" },
    eta: { low: 0.01, high: 1, allowed: "a number from 0.01 to 1" },
  },
  defaults: {
    waypoints: [], keep_out: [], keep_in: [], color: "auto", sign: "auto", objective: "shortest", method: "exact",
    require: "flyable", law: "smooth", vehicle: "paper", coefficients: null, divisions: 16, accuracy: 1e-4,
    drag_ratio: null, period: 1, samples: 100, eta: 0.8, any_order: false, reverse: false,
  },
};
const [A, B, C, D] = [[0.1, -0.1], [0.5, -0.5], [1, -1], [1.5, -1.5]];
const RED = { status: "planned", color: "red", series: {}, warnings: [] };
const BLUE = { ...RED, color: "blue" };

/** Return a store with one waypoint, A, and its plan. */
function planned(plan = RED) {
  const state = { ...startOf(SETUP), waypoints: [A] };
  const store = storeOf(state, false);
  answer(store, plan);
  return store;
}

/** Let the server answer the present state. */
function answer(store, plan) {
  store.put({ plan, planned: planKey(store.page.state) });
}

const waypoints = (store) => store.page.state.waypoints;
const moved = (store, point) => store.preview({ waypoints: [point] });

test("a drag is one step, from before its first move to its end", () => {
  const store = planned();
  moved(store, B);
  moved(store, C);
  assert.equal(store.page.isHeld, true);
  assert.equal(store.page.canUndo, false); // nothing is a step yet
  store.settle();
  assert.equal(store.page.isHeld, false);
  store.undo();
  assert.deepEqual(waypoints(store), [A]);
  store.redo();
  assert.deepEqual(waypoints(store), [C]);
  assert.deepEqual([store.page.canUndo, store.page.canRedo], [true, false]);
});

test("undo while dragging ends the drag, and takes nothing else back", () => {
  const store = planned();
  store.commit({ waypoints: [B] });
  for (const end of [store.undo, store.redo, store.cancel]) {
    moved(store, C);
    end();
    assert.deepEqual(waypoints(store), [B]);
    assert.deepEqual([store.page.isHeld, store.page.canUndo, store.page.canRedo], [false, true, false]);
  }
  store.settle(); // a button that is released after that
  assert.deepEqual(waypoints(store), [B]);
  store.undo();
  assert.deepEqual(waypoints(store), [A]);
});

test("a drag that ends where it began is no step, and keeps what can be redone", () => {
  const store = planned();
  store.commit({ waypoints: [B] });
  store.undo();
  moved(store, C);
  moved(store, A);
  store.settle();
  assert.deepEqual([store.page.canUndo, store.page.canRedo], [false, true]);
});

test("a new step ends what can be redone", () => {
  const store = planned();
  store.commit({ waypoints: [B] });
  store.commit({ waypoints: [C] });
  store.undo();
  store.undo();
  store.redo();
  assert.deepEqual(waypoints(store), [B]);
  store.commit({ waypoints: [D] });
  assert.equal(store.page.canRedo, false);
  store.redo();
  assert.deepEqual(waypoints(store), [D]);
  store.undo();
  store.undo();
  assert.deepEqual(waypoints(store), [A]);
  store.undo(); // there is no more
  assert.deepEqual(waypoints(store), [A]);
});

test("the view is no step and is not undone; η is a step but no other plan", () => {
  const store = planned();
  store.look({ theme: "dark" });
  assert.equal(store.page.canUndo, false);
  store.commit({ eta: 0.5 });
  assert.equal(isPlanDue(store.page), false);
  store.undo();
  assert.deepEqual([store.page.state.eta, store.page.state.view.theme], [0.8, "dark"]);
});

test("500 steps can be undone", () => {
  const store = planned();
  for (let k = 1; k <= 600; k += 1) store.commit({ period: k + 1 });
  for (let k = 0; k < 700; k += 1) store.undo();
  assert.equal(store.page.state.period, 101);
});

test("a link leads to the state that it was made from", () => {
  const ring = [A, B, C];
  const patch = {
    waypoints: [[(3 * Math.PI) / 8, -Math.PI / 8], [0.1, 0]], keep_out: [ring], color: "red", coefficients: "exact",
    drag_ratio: 0.25, period: 2.5, any_order: true, eta: 0.3, vehicle: "beetle_omni",
  };
  const state = { ...startOf(SETUP), ...patch };
  state.view = { ...state.view, sheet: "blue", regions: false };
  const text = addressOf(state, SETUP);
  assert.match(text, /^waypoints=3pi\/8,-pi\/8;0\.1,0&keep_out=/);
  assert.deepEqual(stateFrom(`#${encodeURI(text)}`, SETUP), { state, problems: [] });
  assert.equal(addressOf(startOf(SETUP), SETUP), "");
  // Such a state is opened as one step, which can be undone.
  const store = planned();
  store.commit(questionOf(state));
  assert.deepEqual(questionOf(store.page.state), questionOf(state));
  store.undo();
  assert.deepEqual(waypoints(store), [A]);
});

test("a link holds the constants of a vehicle that is no preset", () => {
  const vehicle = { name: "a & b", drag_ratio: 0.1, spins: ["clockwise"] };
  const state = { ...startOf(SETUP), vehicle };
  const text = addressOf(state, SETUP);
  assert.deepEqual(stateFrom(`#${text}`, SETUP), { state, problems: [] });
  const own = { ...SETUP, defaults: { ...SETUP.defaults, vehicle } };
  assert.equal(addressOf(startOf(own), own), ""); // it is where this page begins
  assert.match(addressOf({ ...startOf(own), vehicle: "paper" }, own), /^vehicle=paper$/);
  const { problems } = stateFrom("#vehicle={", SETUP);
  assert.deepEqual(problems, ["vehicle cannot be decoded"]);
});

test("a part of a link that cannot be used is named, and the rest is kept", () => {
  const cases = {
    "color=green": "color must be one of auto, red, blue, got “green”",
    "waypoints=0,9": "waypoints must be pairs of angles within ±pi/2, got “0,9”",
    "keep_in=0,0;1,1": "keep_in must be polygons of at least 3 corners, got “0,0;1,1”",
    "reverse=maybe": "reverse must be yes or no, got “maybe”",
    "samples=1.5": "samples must be a whole number, got “1.5”",
    "nothing=1": "“nothing” is not a field of the page",
    "period=%": "period cannot be decoded",
  };
  for (const [part, problem] of Object.entries(cases)) {
    const { state, problems } = stateFrom(`#${part}&law=constant-speed`, SETUP);
    assert.deepEqual(problems, [problem]);
    assert.deepEqual(state, { ...startOf(SETUP), law: "constant-speed" });
  }
});

test("a table that is loaded is shown until its tab or the plan's is chosen", () => {
  const store = planned();
  const map = { vehicle: "beetle_omni", drag_ratio: 0.3, coefficients: "exact" };
  const table = { color: "blue", map, vehicle: "other", series: {}, diagram: { own: 1 } };
  store.put({ table, tab: "table" });
  assert.deepEqual([reportOf(store.page), movingOf(store.page)], [table, table]);
  assert.equal(sheetOf(store.page), "blue");
  assert.equal(diagramOf(store.page), table.diagram);
  assert.deepEqual([isDiagramDue(store.page), diagramKey(store.page)], [false, ""]);
  assert.deepEqual(mapQuestion(store.page), {
    vehicle: "beetle_omni", drag_ratio: 0.3, coefficients: "exact", sheet: "blue", shading: "R",
  });
  store.put({ tab: "plan" });
  assert.equal(reportOf(store.page), RED);
  assert.equal(sheetOf(store.page), "red");
  store.put({ table: null });
  store.undo(); // a table is no step
  assert.deepEqual(waypoints(store), [A]);
});

test("the map follows the color of the plan, but not while something is held", () => {
  const store = planned();
  moved(store, B);
  answer(store, BLUE);
  assert.equal(sheetOf(store.page), "red");
  assert.match(mapNote(store.page), /the loop is on the blue sheet\.$/);
  store.settle();
  assert.equal(sheetOf(store.page), "blue");
  assert.match(mapNote(store.page), /now on the blue sheet, and so is the map\.$/);
  store.look({ sheet: "red" });
  assert.equal(sheetOf(store.page), "red");
});

test("a first visit shows a gait to try, until something is set; it flies on until there is an answer", () => {
  const store = storeOf(startOf(SETUP), true);
  const empty = { status: "empty" };
  answer(store, empty);
  store.put({ ghost: RED });
  assert.deepEqual([ghostOf(store.page), movingOf(store.page)], [RED, RED]);
  store.look({ theme: "dark" });
  assert.equal(ghostOf(store.page), RED);
  store.commit({ waypoints: [A] });
  assert.deepEqual([ghostOf(store.page), movingOf(store.page)], [null, RED]);
  answer(store, BLUE);
  assert.equal(movingOf(store.page), BLUE);
  store.undo();
  answer(store, empty);
  assert.deepEqual([ghostOf(store.page), movingOf(store.page)], [null, null]);
});

test("a plan and a diagram are due until they are answered for the present state", () => {
  const store = planned();
  assert.deepEqual([isPlanDue(store.page), isDiagramDue(store.page)], [false, true]);
  const key = diagramKey(store.page);
  store.put({ diagram: { own: 1 }, diagrammed: key });
  assert.equal(isDiagramDue(store.page), false);
  store.commit({ eta: 0.5 });
  assert.deepEqual([isPlanDue(store.page), isDiagramDue(store.page)], [false, true]);
  store.commit({ waypoints: [B] });
  assert.deepEqual([isPlanDue(store.page), diagramKey(store.page)], [true, ""]);
  answer(store, { status: "infeasible" });
  assert.deepEqual([isDiagramDue(store.page), diagramOf(store.page)], [false, null]);
});

test("a view is drawn again where what it takes has changed, also by a listener before it", () => {
  const store = planned();
  const seen = [];
  const draw = drawn(({ state }) => [state.period, state.law], ({ state }) => seen.push(state.period));
  store.subscribe(() => store.page.state.period === 2 && store.preview({ period: 3 }));
  store.subscribe(() => draw(store.page));
  store.put({});
  store.commit({ waypoints: [B] });
  store.commit({ period: 2 });
  assert.deepEqual(seen, [1, 3]);
});
