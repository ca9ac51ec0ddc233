// What the page is asked for: one plain object, its way into the address and back, and its history.

import { HALF_PI, angleFromText, exactText } from "./angles.js";

export const VIEW = {
  sheet: "auto",
  shading: "R",
  regions: true,
  types: false,
  snap: true,
  chart: "least_singular_value",
  theme: "auto",
};

const VIEW_CHOICES = {
  sheet: ["auto", "red", "blue"],
  shading: ["R", "least_singular_value", "none"],
  chart: ["rates", "R", "least_singular_value", "hover_thrusts"],
  theme: ["auto", "light", "dark"],
};

const POINTS = { waypoints: "waypoints" };
const POLYGONS = ["keep_out", "keep_in"];
const FLAGS = ["any_order", "reverse"];
const NUMBERS = ["divisions", "accuracy", "drag_ratio", "period", "samples", "eta"];

/** Return the choices of each field that has a fixed list, from the server's setup. */
function choicesOf(setup) {
  return {
    color: setup.colors,
    sign: setup.signs,
    objective: setup.objectives,
    method: setup.methods,
    require: setup.requires,
    law: setup.laws,
    vehicle: setup.presets.map((preset) => preset.name),
    coefficients: ["published", "exact"],
  };
}

export function clone(state) {
  return structuredClone(state);
}

/** Return the state that a new page starts with. */
export function startOf(setup) {
  return { ...clone(setup.defaults), view: { ...VIEW } };
}

const pointText = (point) => point.map(exactText).join(",");

/** Return the state as the part of an address after "#": only what differs from the start, readable. */
export function addressOf(state, setup) {
  const start = startOf(setup);
  const parts = [];
  if (state.waypoints.length) parts.push(`waypoints=${state.waypoints.map(pointText).join(";")}`);
  for (const key of POLYGONS) {
    if (state[key].length) parts.push(`${key}=${state[key].map((ring) => ring.map(pointText).join(";")).join("~")}`);
  }
  for (const key of [...Object.keys(choicesOf(setup)), ...NUMBERS, ...FLAGS]) {
    if (state[key] !== start[key]) parts.push(`${key}=${encodeURIComponent(plainText(state[key]))}`);
  }
  for (const key of Object.keys(VIEW)) {
    if (state.view[key] !== VIEW[key]) parts.push(`${key}=${plainText(state.view[key])}`);
  }
  return parts.join("&");
}

function plainText(value) {
  if (value === null) return "own";
  if (value === true) return "yes";
  if (value === false) return "no";
  return String(value);
}

class Wrong extends Error {}

function pointsFrom(text, limit, what) {
  const points = text.split(";").map((pair) => {
    const angles = pair.split(",").map(angleFromText);
    if (angles.length !== 2 || angles.some((a) => a === null || Math.abs(a) > HALF_PI)) {
      throw new Wrong(`“${pair}” is no pair of angles within ±pi/2`);
    }
    return angles;
  });
  if (points.length > limit) throw new Wrong(`${points.length} ${what}; at most ${limit} are allowed`);
  return points;
}

/** Return the number that a text is, if it lies in a range of the server's setup, else null. */
export function numberFrom(text, range) {
  const plain = text.trim();
  if (!/^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i.test(plain)) return null;
  const value = Number(plain);
  const isLow = range.above ? value <= range.low : value < range.low;
  return isLow || value > range.high || (range.whole && !Number.isInteger(value)) ? null : value;
}

function valueFrom(key, text, setup) {
  if (key === "waypoints") return pointsFrom(text, setup.limits.waypoints, "waypoints");
  if (POLYGONS.includes(key)) {
    const rings = text.split("~").map((ring) => pointsFrom(ring, setup.limits.corners, "corners"));
    if (rings.length > setup.limits.polygons) throw new Wrong(`at most ${setup.limits.polygons} polygons are allowed`);
    if (rings.some((ring) => ring.length < 3)) throw new Wrong("a polygon has at least 3 corners");
    return rings;
  }
  const choices = choicesOf(setup)[key] ?? VIEW_CHOICES[key];
  if (choices) {
    if (key === "coefficients" && text === "own") return null;
    if (!choices.includes(text)) throw new Wrong(`allowed are ${choices.join(", ")}`);
    return text;
  }
  if (FLAGS.includes(key) || typeof VIEW[key] === "boolean") {
    if (text !== "yes" && text !== "no") throw new Wrong("allowed are yes, no");
    return text === "yes";
  }
  if (key === "drag_ratio" && text === "own") return null;
  const range = setup.ranges[key];
  const value = numberFrom(text, range);
  if (value === null) throw new Wrong(`allowed is ${range.allowed}`);
  return value;
}

/** Return the state that an address holds, and a sentence for each part that it could not keep. */
export function stateFrom(hash, setup) {
  const state = startOf(setup);
  const problems = [];
  const known = new Set([...Object.keys(POINTS), ...POLYGONS, ...FLAGS, ...NUMBERS, ...Object.keys(choicesOf(setup))]);
  for (const part of hash.replace(/^#/, "").split("&").filter(Boolean)) {
    const at = part.indexOf("=");
    const key = at < 0 ? part : part.slice(0, at);
    try {
      if (!known.has(key) && !(key in VIEW)) throw new Wrong("no field has this name");
      const value = valueFrom(key, decodeURIComponent(at < 0 ? "" : part.slice(at + 1)), setup);
      if (key in VIEW) state.view[key] = value;
      else state[key] = value;
    } catch (error) {
      const why = error instanceof Wrong ? error.message : "it cannot be read";
      problems.push(`${part.length > 60 ? `${part.slice(0, 60)}…` : part}: ${why}`);
    }
  }
  return { state, problems };
}

/** Return what a plan depends on, as a text to compare: everything but the view and the biased gait. */
export function planKey(state) {
  const { view: _view, eta: _eta, ...rest } = state;
  return JSON.stringify(rest);
}

/**
 * Hold the state with its past and future.
 *
 * `commit` makes one step that can be undone. `preview` changes the state without one, as while dragging: the next
 * `commit` then counts from before the first preview. What a step means for the view alone is not kept: undo never
 * changes the theme.
 */
export function historyOf(first, onChange) {
  let state = first;
  let before = null;
  const past = [];
  const future = [];
  const isSame = (a, b) => planKey(a) + a.eta === planKey(b) + b.eta;

  function change(next, live) {
    state = next;
    onChange(state, { live });
  }

  return {
    get state() {
      return state;
    },
    canUndo: () => past.length > 0,
    canRedo: () => future.length > 0,
    preview(patch) {
      before ??= state;
      change({ ...state, ...patch }, true);
    },
    commit(patch = {}) {
      const from = before ?? state;
      before = null;
      const next = { ...state, ...patch };
      if (!isSame(from, next)) {
        past.push(from);
        if (past.length > 500) past.shift();
        future.length = 0;
      }
      change(next, false);
    },
    cancel() {
      if (before) change(before, false);
      before = null;
    },
    /** End a preview, if there is one: it becomes a step. */
    settle() {
      if (before) this.commit();
    },
    look(patch) {
      change({ ...state, view: { ...state.view, ...patch } }, false);
    },
    undo() {
      if (!past.length) return;
      future.push(state);
      change({ ...past.pop(), view: state.view }, false);
    },
    redo() {
      if (!future.length) return;
      past.push(state);
      change({ ...future.pop(), view: state.view }, false);
    },
  };
}
