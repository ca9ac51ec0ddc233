// The state as the text of an address, in both directions.

import { HALF_PI, angleFromText, exactText } from "./angles.js";

const VIEW = {
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
  shading: ["R", "least_singular_value", "servo_margin", "none"],
  chart: ["rates", "R", "least_singular_value", "hover_thrusts"],
  theme: ["auto", "light", "dark"],
};

const POLYGONS = ["keep_out", "keep_in"];
const OPTIONAL = ["coefficients", "drag_ratio"]; // by default those of the vehicle
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
    vehicle: setup.presets.map((preset) => plainText(preset.vehicle)),
    coefficients: setup.coefficients,
  };
}

/** Return the state that a new page starts with. */
export function startOf(setup) {
  return { ...structuredClone(setup.defaults), view: { ...VIEW } };
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
    if (plainText(state[key]) !== plainText(start[key])) parts.push(`${key}=${encodeURIComponent(plainText(state[key]))}`);
  }
  for (const key of Object.keys(VIEW)) {
    if (state.view[key] !== VIEW[key]) parts.push(`${key}=${plainText(state.view[key])}`);
  }
  return parts.join("&");
}

/** Return a value as a text: a vehicle of its own constants as JSON. */
export function plainText(value) {
  if (value === null) return "own";
  if (typeof value === "object") return JSON.stringify(value);
  if (value === true) return "yes";
  if (value === false) return "no";
  return String(value);
}

/** Return the vehicle that a text is: the name of a preset, or its own constants. */
export function vehicleFrom(text) {
  return text.startsWith("{") ? JSON.parse(text) : text;
}

/** A field must be `wanted`, but is `got`. */
class Wrong extends Error {
  constructor(wanted, got) {
    super(`must be ${wanted}, got “${got}”`);
  }
}

function pointsFrom(text) {
  return text.split(";").map((pair) => {
    const angles = pair.split(",").map(angleFromText);
    if (angles.length !== 2 || angles.some((a) => a === null || Math.abs(a) > HALF_PI)) {
      throw new Wrong("pairs of angles within ±pi/2", pair);
    }
    return angles;
  });
}

/** Return the number that a text is, if it lies in a range of the server's setup, else null. */
export function numberFrom(text, range) {
  const plain = text.trim();
  if (!/^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i.test(plain)) return null;
  const value = Number(plain);
  return value < range.low || value > range.high || (range.whole && !Number.isInteger(value)) ? null : value;
}

function ringsFrom(text) {
  const rings = text.split("~").map(pointsFrom);
  if (rings.some((ring) => ring.length < 3)) throw new Wrong("polygons of at least 3 corners", text);
  return rings;
}

function valueFrom(key, text, setup) {
  if (key === "waypoints") return pointsFrom(text);
  if (POLYGONS.includes(key)) return ringsFrom(text);
  if (OPTIONAL.includes(key) && text === "own") return null;
  if (key === "vehicle" && text.startsWith("{")) return vehicleFrom(text);
  const choices = choicesOf(setup)[key] ?? VIEW_CHOICES[key];
  if (choices) {
    if (!choices.includes(text)) throw new Wrong(`one of ${choices.join(", ")}`, text);
    return text;
  }
  if (FLAGS.includes(key) || typeof VIEW[key] === "boolean") {
    if (text !== "yes" && text !== "no") throw new Wrong("yes or no", text);
    return text === "yes";
  }
  const range = setup.ranges[key];
  const value = numberFrom(text, range);
  if (value === null) throw new Wrong(range.allowed, text);
  return value;
}

const short = (text) => (text.length > 120 ? `${text.slice(0, 120)}…` : text);

/** Return the state that an address holds, and a sentence for each part that it could not keep. */
export function stateFrom(hash, setup) {
  const state = startOf(setup);
  const problems = [];
  const known = new Set(["waypoints", ...POLYGONS, ...FLAGS, ...NUMBERS, ...Object.keys(choicesOf(setup))]);
  for (const part of hash.replace(/^#/, "").split("&").filter(Boolean)) {
    const at = part.indexOf("=");
    const key = at < 0 ? part : part.slice(0, at);
    try {
      if (!known.has(key) && !(key in VIEW)) {
        problems.push(`“${short(key)}” is not a field of the page`);
        continue;
      }
      const value = valueFrom(key, decodeURIComponent(at < 0 ? "" : part.slice(at + 1)), setup);
      if (key in VIEW) state.view[key] = value;
      else state[key] = value;
    } catch (error) {
      problems.push(`${key} ${error instanceof Wrong ? short(error.message) : "cannot be decoded"}`);
    }
  }
  return { state, problems };
}
