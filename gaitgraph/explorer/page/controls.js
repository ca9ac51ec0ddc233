// The controls: each is tied to one field of the state, in both directions.

import { HALF_PI, angle, angleFromText, figure, number } from "./angles.js";
import { byId, html, spoken } from "./elements.js";
import { numberFrom, plainText, vehicleFrom } from "./address.js";

const LABELS = {
  auto: "auto",
  red: "red",
  blue: "blue",
  positive: "R > 0",
  negative: "R < 0",
  exact: "any angle",
  grid: "grid",
  shortest: "shortest",
  robust: "most robust",
  least_singular_value: "least singular value σ",
  servo_margin: "servo margin",
};

const ADVANCED = "sign require method divisions any_order reverse vehicle coefficients period law samples".split(" ");

/** What the words of the page mean that are of the paper or of this package; those of commands come from the server. */
const WORDS = {
  color: "Red and blue are the two surfaces of tilt angles on which roll and pitch do not depend on thrust.",
  drag_ratio: "κ, the ratio of a rotor’s drag torque to the torque of its thrust about the hub.",
  R: "R, the determinant of the decoupling matrix at level attitude. A gait must not pass R = 0.",
  coefficients: "The coefficients of R: published (rounded), printed (the same digits as exact numbers), exact, or by rule from the vehicle.",
  sheet: "The surface that the map shows. Auto follows the plan.",
  types: "Plane types: the signs by which α3 and α4 follow α1 and α2, drawn on the paper’s grid.",
  eta: "Biased gait: α3 and α4 scaled by η. On red, that tells which attitudes become singular.",
};

/** Explain the words where they stand, and in a list for those who have no pointer. */
function explainWords(shared) {
  const words = { ...WORDS, ...shared };
  for (const place of document.querySelectorAll("[data-word]")) {
    const text = words[place.dataset.word];
    place.title = text;
    byId("words").append(html("dt", {}, place.textContent), html("dd", {}, text));
  }
}

/** Make radio buttons in a fieldset; return a function that shows a value. */
function segmented(fieldset, name, options, onChoose) {
  const inputs = options.map(([value, label]) => {
    const input = html("input", {
      type: "radio",
      name,
      value,
      id: `${name}-${value}`,
      onchange: () => onChoose(value),
    });
    fieldset.append(input, html("label", { for: input.id, class: `choice ${value}` }, label));
    return input;
  });
  return (shown) => inputs.forEach((input) => (input.checked = input.value === shown));
}

function filled(select, options, onChoose) {
  select.replaceChildren(...options.map(([value, label]) => html("option", { value }, label)));
  select.addEventListener("change", () => onChoose(select.value));
  return (shown) => (select.value = shown);
}

const labelled = (values) => values.map((value) => [value, LABELS[value] ?? value]);

/**
 * Bind every control. `on` has commit(patch), preview(patch), look(patch), removeWaypoint(index), removePolygon(kind, index),
 * selectPolygon(kind, index), problem(text).
 *
 * Returns a function that shows a state.
 */
export function bindControls(setup, on) {
  const shows = [];
  const choose = (key) => (value) => on.commit({ [key]: value });
  explainWords(setup.words);

  for (const [key, values] of [
    ["color", setup.colors],
    ["sign", setup.signs],
    ["method", setup.methods],
    ["require", setup.requires],
  ]) {
    const show = segmented(byId(`field-${key}`), key, labelled(values), choose(key));
    shows.push((state) => show(state[key]));
  }
  const nameOf = ({ name, drag_ratio: ratio }) => `${name} (κ = ${figure(ratio)})`;
  const presets = setup.presets.map((preset) => [plainText(preset.vehicle), nameOf(preset)]);
  const rules = [["", "by rule"], ...labelled(setup.coefficients)];
  shows.push(({ vehicle }) => {
    const options = byId("vehicle");
    const value = plainText(vehicle);
    if ([...options].some((option) => option.value === value)) return;
    options.append(html("option", { value }, nameOf(vehicle))); // of an address or a table
  });
  for (const [id, options, patch] of [
    ["objective", labelled(setup.objectives)],
    ["law", labelled(setup.laws)],
    ["vehicle", presets, (text) => ({ vehicle: vehicleFrom(text), drag_ratio: null })],
    ["coefficients", rules, (value) => ({ coefficients: value || null })],
  ]) {
    const show = filled(byId(id), options, (value) => on.commit(patch?.(value) ?? { [id]: value }));
    shows.push((state) => show(plainText(state[id] ?? "")));
  }

  for (const key of ["any_order", "reverse"]) {
    byId(key).addEventListener("change", (event) => on.commit({ [key]: event.target.checked }));
    shows.push((state) => (byId(key).checked = state[key]));
  }
  for (const key of ["snap", "types", "regions"]) {
    byId(key).addEventListener("change", (event) => on.look({ [key]: event.target.checked }));
    shows.push((state) => (byId(key).checked = state.view[key]));
  }
  for (const [key, values] of [
    ["sheet", ["auto", "red", "blue"]],
    ["shading", setup.shadings],
    ["theme", ["auto", "light", "dark"]],
  ]) {
    const show = filled(byId(key), labelled(values), (value) => on.look({ [key]: value }));
    shows.push((state) => show(state.view[key]));
  }

  for (const key of ["period", "samples", "divisions"]) {
    const input = byId(key);
    const range = setup.ranges[key];
    input.addEventListener("change", () => {
      const value = numberFrom(input.value, range);
      input.setAttribute("aria-invalid", String(value === null));
      if (value === null) {
        on.problem(`${input.labels[0].textContent.trim()} must be ${range.allowed}, got “${input.value}”`);
      } else on.commit({ [key]: value });
    });
    shows.push((state) => {
      if (document.activeElement !== input || input.getAttribute("aria-invalid") !== "true") {
        input.value = String(state[key]);
        input.removeAttribute("aria-invalid");
      }
    });
  }
  shows.push((state) => {
    byId("divisions-row").hidden = state.method !== "grid";
    const changed = ADVANCED.filter((key) => plainText(state[key]) !== plainText(setup.defaults[key])).length;
    byId("advanced-changed").textContent = changed ? `(${changed} changed)` : "";
  });

  shows.push(bindDragRatio(setup, on), bindEta(on), bindWaypoints(on), bindPolygons(on));
  return (state) => shows.forEach((show) => show(state));
}

function bindDragRatio(setup, on) {
  const slider = byId("drag_ratio");
  const value = byId("drag_ratio-value");
  const reset = byId("drag_ratio-reset");
  const [low, high] = [setup.ranges.drag_ratio.low, setup.ranges.drag_ratio.high].map(Math.log);
  const ratio = () => Number(Math.exp(low + (Number(slider.value) / 1000) * (high - low)).toPrecision(4));
  slider.addEventListener("input", () => on.preview({ drag_ratio: ratio() }));
  slider.addEventListener("change", () => on.commit({ drag_ratio: ratio() }));
  reset.addEventListener("click", () => {
    on.commit({ drag_ratio: null });
    slider.focus();
  });
  return (state) => {
    const preset = setup.presets.find(({ vehicle }) => vehicle === state.vehicle) ?? state.vehicle;
    const own = preset.drag_ratio;
    const shown = state.drag_ratio ?? own;
    const text = figure(shown);
    slider.value = String(Math.round((1000 * (Math.log(shown) - low)) / (high - low)));
    slider.setAttribute("aria-valuetext", `${text}${state.drag_ratio === null ? ", the vehicle’s own" : ""}`);
    value.textContent = text;
    reset.disabled = state.drag_ratio === null;
  };
}

function bindEta(on) {
  const slider = byId("eta");
  slider.addEventListener("input", () => on.preview({ eta: Number(slider.value) }));
  slider.addEventListener("change", () => on.commit({ eta: Number(slider.value) }));
  return (state) => {
    slider.value = String(state.eta);
    byId("eta-value").textContent = number(state.eta, 2);
  };
}

/** The waypoints as a list of texts, for those who type and for those who do not see the map. */
function bindWaypoints(on) {
  const list = byId("waypoint-list");
  let state = null;

  function changed(input, index, axis) {
    const value = angleFromText(input.value);
    const wrong = value === null || Math.abs(value) > HALF_PI + 1e-12;
    input.setAttribute("aria-invalid", String(wrong));
    if (wrong) {
      on.problem(
        `Waypoint ${index + 1}, α${axis + 1} must be an angle within ±π/2, such as 3pi/8, 67.5deg or 1.178, ` +
          `got “${input.value}”`,
      );
      return;
    }
    const waypoints = state.waypoints.map((p) => [...p]);
    waypoints[index][axis] = Math.max(-HALF_PI, Math.min(HALF_PI, value));
    on.commit({ waypoints });
  }

  function row(index) {
    const inputs = [0, 1].map((axis) => {
      const input = html("input", {
        type: "text",
        inputmode: "text",
        autocomplete: "off",
        spellcheck: "false",
        "aria-label": `Waypoint ${index + 1}, α${axis + 1}`,
      });
      input.addEventListener("change", () => changed(input, index, axis));
      return input;
    });
    const remove = html(
      "button",
      {
        type: "button",
        class: "quiet",
        onclick: () => {
          on.removeWaypoint(index);
          (list.querySelectorAll("button")[Math.min(index, state.waypoints.length - 1)] ?? byId("map")).focus();
        },
      },
      html("span", { "aria-hidden": "true" }, "×"),
      spoken(`Remove waypoint ${index + 1}`),
    );
    return html(
      "li",
      {},
      html("span", { class: "index", "aria-hidden": "true" }, String(index + 1)),
      ...inputs,
      remove,
    );
  }

  return (next) => {
    state = next;
    while (list.children.length > next.waypoints.length) list.lastChild.remove();
    while (list.children.length < next.waypoints.length) list.append(row(list.children.length));
    next.waypoints.forEach((point, index) => {
      list.children[index].querySelectorAll("input").forEach((input, axis) => {
        const isTyped = document.activeElement === input && input.getAttribute("aria-invalid") === "true";
        if (isTyped) return;
        const text = angle(point[axis]);
        input.value = text === number(point[axis]) ? String(Number(point[axis].toPrecision(6))) : text;
        input.removeAttribute("aria-invalid");
      });
    });
    byId("waypoint-none").hidden = next.waypoints.length > 0;
    byId("clear").disabled = next.waypoints.length === 0;
  };
}

function bindPolygons(on) {
  const list = byId("polygon-list");
  return (state) => {
    const rows = ["keep_out", "keep_in"].flatMap((kind) =>
      state[kind].map((ring, index) => {
        const name = `${kind === "keep_out" ? "Keep-out" : "Keep-in"} ${index + 1}`;
        return html(
          "li",
          { class: kind },
          html(
            "button",
            { type: "button", class: "plain", onclick: () => on.selectPolygon(kind, index) },
            `${name}, ${ring.length} corners`,
          ),
          html(
            "button",
            { type: "button", class: "quiet", onclick: () => on.removePolygon(kind, index) },
            html("span", { "aria-hidden": "true" }, "×"),
            spoken(`Remove ${name}`),
          ),
        );
      }),
    );
    const text = JSON.stringify([state.keep_out.map((r) => r.length), state.keep_in.map((r) => r.length)]);
    if (list.dataset.shown === text) return;
    list.dataset.shown = text;
    list.replaceChildren(...rows);
  };
}
