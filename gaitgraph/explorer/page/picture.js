// What the map shows: shading on a canvas, everything else as SVG over it. What hands do to it is in map.js.

import { HALF_PI, angle, clamped, number, snapped } from "./angles.js";
import { byId, html, svg, themed } from "./elements.js";
import { drawn, ghostOf, reportOf } from "./store.js";
import { adviceOf } from "./verdict.js";

/** What the map can show as shading, in its legend and beside the pointer. */
export const SHADES = {
  R: { name: "R", unit: "" },
  least_singular_value: { name: "σ", unit: "" },
  servo_margin: { name: "servo margin", unit: "°" },
};

const TICKS = [-8, -6, -4, -2, 0, 2, 4, 6, 8].map((n) => (n * Math.PI) / 16);

const RING = 9; // radius of a waypoint's ring [px]
const NEAR = 12; // how near to the loop the pointer shows the posture there [px]

const LAYERS = [
  "grid",
  "regions",
  "types",
  "polygons",
  "crosshair",
  "alternatives",
  "ghost",
  "loop",
  "corners",
  "table",
  "marks",
  "waypoints",
  "advice",
  "draft",
  "dot",
  "pointer",
];

/**
 * Make the picture of the map inside `root`: its element, what it shows, its geometry, and its painting.
 */
export function pictureIn(root) {
  const canvas = html("canvas", { "aria-hidden": "true" });
  const layers = Object.fromEntries(LAYERS.map((name) => [name, svg("g", { class: `layer-${name}` })]));
  const clip = svg("clipPath", { id: "map-clip" }, svg("rect"));
  const picture = svg(
    "svg",
    {
      id: "map",
      tabindex: "0",
      role: "application",
      "aria-label": "Map of α1 and α2: waypoints and loop",
      "aria-describedby": "map-keys",
    },
    svg("defs", {}, clip),
    ...Object.values(layers),
  );
  root.append(canvas, picture);

  const shown = {
    page: null, // of the store
    get state() {
      return this.page?.state;
    },
    selected: null, // {kind: "waypoint" | "keep_out" | "keep_in", index}
    mode: "waypoints", // or "keep_out", "keep_in"
    draft: [],
    crosshair: [0, 0],
    keyboard: false,
    hover: null,
    dot: null, // where the gait is at the time shown
  };
  let size = 0;
  let box = { left: 0, top: 0, side: 0 };

  const x = (a) => box.left + ((a + HALF_PI) / Math.PI) * box.side;
  const y = (a) => box.top + ((HALF_PI - a) / Math.PI) * box.side;
  const at = (p) => `${x(p[0]).toFixed(2)} ${y(p[1]).toFixed(2)}`;
  const line = (points, closed) => (points.length ? `M${points.map(at).join("L")}${closed ? "Z" : ""}` : "");
  const raw = (event) => {
    const frame = picture.getBoundingClientRect();
    const a1 = ((event.clientX - frame.left - box.left) / box.side) * Math.PI - HALF_PI;
    const a2 = HALF_PI - ((event.clientY - frame.top - box.top) / box.side) * Math.PI;
    return [a1, a2];
  };
  const settled = (point) => point.map(shown.state.view.snap ? snapped : clamped);
  const pixels = (p, q) => Math.hypot(x(p[0]) - x(q[0]), y(p[1]) - y(q[1]));

  // Painting ------------------------------------------------------------------------------------------------------

  function measure() {
    const width = Math.floor(root.clientWidth);
    if (!width || width === size) return false;
    size = width;
    const left = width < 440 ? 40 : 48;
    const side = width - left - 12;
    box = { left, top: 10, side };
    const height = side + 10 + 38;
    picture.setAttribute("viewBox", `0 0 ${width} ${height}`);
    picture.setAttribute("height", height);
    root.classList.toggle("small", side < 420);
    const rect = clip.firstChild;
    for (const [name, value] of Object.entries({ x: left, y: 10, width: side, height: side })) {
      rect.setAttribute(name, value);
    }
    canvas.style.left = `${left}px`;
    canvas.style.top = "10px";
    canvas.style.width = canvas.style.height = `${side}px`;
    return true;
  }

  function paintGrid() {
    const { left, top, side } = box;
    const bits = [];
    for (const a of TICKS) {
      const major = Math.abs(a) < 1e-9;
      bits.push(svg("path", { class: major ? "rule zero" : "rule", d: `M${x(a)} ${top}V${top + side}` }));
      bits.push(svg("path", { class: major ? "rule zero" : "rule", d: `M${left} ${y(a)}H${left + side}` }));
      bits.push(svg("text", { class: "tick", x: x(a), y: top + side + 16, "text-anchor": "middle" }, angle(a)));
      bits.push(svg("text", { class: "tick", x: left - 6, y: y(a) + 4, "text-anchor": "end" }, angle(a)));
    }
    bits.push(svg("rect", { class: "frame", x: left, y: top, width: side, height: side }));
    bits.push(svg("text", { class: "axis", x: left + side / 2, y: top + side + 34, "text-anchor": "middle" }, "α1"));
    bits.push(svg("text", { class: "axis", x: 4, y: top + side / 2 - 12 }, "α2"));
    layers.grid.replaceChildren(...bits);
  }

  function paintShading() {
    const data = shown.page.background;
    const ratio = window.devicePixelRatio || 1;
    canvas.width = canvas.height = Math.max(1, Math.round(box.side * ratio));
    if (!data || shown.state.view.shading === "none") return;
    if (data.sheet === "blue") {
      paintHatching(canvas.getContext("2d"), ratio);
      return;
    }
    const { n, values } = data;
    const [low, high] = data.range;
    const colors = ["--shade-negative", "--shade-positive", "--shade-zero", "--shade-sigma"].map(rgbOf);
    const image = new ImageData(n, n);
    const reach = Math.max(Math.abs(low), Math.abs(high)) || 1;
    for (let row = 0; row < n; row += 1) {
      for (let column = 0; column < n; column += 1) {
        const value = values[row * n + column];
        if (value === null) continue;
        const signed = data.shading === "R";
        const part = Math.sqrt(Math.min(1, Math.abs(value) / reach));
        const sign = value < 0 ? 0 : 1;
        const full = colors[signed ? sign : 3];
        const place = 4 * ((n - 1 - row) * n + column);
        for (let k = 0; k < 3; k += 1) image.data[place + k] = colors[2][k] + (full[k] - colors[2][k]) * part;
        image.data[place + 3] = 255;
      }
    }
    const small = new OffscreenCanvas(n, n);
    small.getContext("2d").putImageData(image, 0, 0);
    const brush = canvas.getContext("2d");
    brush.imageSmoothingQuality = "high";
    // Values stand at the nodes, so the outer half of the outer cells lies outside the map.
    brush.drawImage(small, 0.5, 0.5, n - 1, n - 1, 0, 0, canvas.width, canvas.height);
  }

  /** Hatch the map where the values are rounding noise: R and σ are 0 on the whole blue sheet. */
  function paintHatching(brush, ratio) {
    const { width, height } = canvas;
    brush.strokeStyle = themed("--line");
    brush.lineWidth = 1.5 * ratio;
    brush.beginPath();
    for (let from = 0; from < width + height; from += 9 * ratio) {
      brush.moveTo(from, 0);
      brush.lineTo(from - height, height);
    }
    brush.stroke();
  }

  function paintRegions() {
    const visible = shown.page.background && shown.state.view.regions ? shown.page.background.regions : [];
    layers.regions.replaceChildren(
      ...visible.flatMap((region) => {
        const d = region.polygons.map((ring) => line(ring, true)).join("");
        const kind = region.name.startsWith("flyable") ? "flyable" : "other";
        return d
          ? [svg("path", { class: `region ${kind}`, d, "clip-path": "url(#map-clip)" }, svg("title", {}, region.label))]
          : [];
      }),
    );
  }

  function paintTypes() {
    const codes = shown.page.background && shown.state.view.types ? shown.page.background.types : null;
    if (!codes) return layers.types.replaceChildren();
    const { n } = codes;
    const small = box.side < 420;
    const bits = [];
    const { sheet } = shown.page.background;
    codes.codes.forEach((code, k) => {
      const place2 = [k % n, Math.floor(k / n)];
      if (!code || place2.some((i) => i === 0 || i === n - 1)) return; // as in the paper, the inner nodes
      const point = place2.map((i) => -HALF_PI + (i * Math.PI) / (n - 1));
      const text = code.replaceAll("-", "−");
      if (code === "(+,+)") return bits.push(square(point, small ? 2 : 3, `type ${sheet}`));
      if (code === "(-,-)") return bits.push(disc(point, small ? 2.3 : 3.4, `type ${sheet}`));
      bits.push(
        svg(
          "text",
          { class: `type ${sheet}`, x: x(point[0]), y: y(point[1]) + 3, "text-anchor": "middle" },
          small ? text.replace(/[(),]/g, "") : text,
        ),
      );
      return undefined;
    });
    return layers.types.replaceChildren(...bits);
  }

  function paintPolygons() {
    const bits = [];
    for (const kind of ["keep_out", "keep_in"]) {
      shown.state[kind].forEach((ring, index) => {
        const chosen = shown.selected?.kind === kind && shown.selected.index === index;
        bits.push(svg("path", { class: `polygon ${kind}${chosen ? " chosen" : ""}`, d: line(ring, true) }));
        if (chosen) ring.forEach((p) => bits.push(square(p, 4, "handle")));
      });
    }
    layers.polygons.replaceChildren(...bits);
  }

  const square = (p, r, kind) =>
    svg("rect", { class: kind, x: x(p[0]) - r, y: y(p[1]) - r, width: 2 * r, height: 2 * r });
  const disc = (p, r, kind) => svg("circle", { class: kind, cx: x(p[0]), cy: y(p[1]), r });

  /** Return arrow heads along a path, evenly spaced on the screen. */
  function arrows(path, kind) {
    const lengths = path.slice(1).map((p, k) => pixels(path[k], p));
    const total = lengths.reduce((sum, l) => sum + l, 0);
    if (total < 30) return [];
    const count = Math.min(32, Math.max(4, Math.round(total / 110)));
    const heads = [];
    let along = 0;
    let next = (0.5 * total) / count;
    lengths.forEach((length, k) => {
      while (length > 0 && next <= along + length && heads.length < count) {
        const part = (next - along) / length;
        const [p, q] = [path[k], path[k + 1]];
        const place = [x(p[0]) + (x(q[0]) - x(p[0])) * part, y(p[1]) + (y(q[1]) - y(p[1])) * part];
        const turn = (Math.atan2(y(q[1]) - y(p[1]), x(q[0]) - x(p[0])) * 180) / Math.PI;
        heads.push(
          svg("path", {
            class: `arrow ${kind}`,
            d: "M-5 -5.5L6 0L-5 5.5Z",
            transform: `translate(${place[0].toFixed(2)} ${place[1].toFixed(2)}) rotate(${turn.toFixed(1)})`,
          }),
        );
        next += total / count;
      }
      along += length;
    });
    return heads;
  }

  function paintLoop() {
    const plan = shown.page.plan;
    const faint = shown.page.tab === "table" ? " faint" : "";
    const others = [];
    const bits = [];
    const corners = [];
    plan?.alternatives?.forEach((other) => {
      others.push(svg("path", { class: `alternative ${other.color}`, d: line(other.corners, true) }));
    });
    if (plan?.status === "planned") {
      const kind = plan.color + faint;
      const d = line(plan.corners, true);
      bits.push(svg("path", { class: "casing", d }), svg("path", { class: `path ${kind}`, d }));
      bits.push(...arrows([...plan.corners, plan.corners[0]], kind));
      plan.corners.forEach((corner, k) => {
        if (!plan.colors.length && !turnsAt(plan.corners, k)) return; // a row of a curved sheet between corners
        const color = plan.colors[k] ?? plan.color;
        // Under a waypoint's ring the marker is made wide enough to be seen around it.
        const under = shown.state.waypoints.findIndex((p) => pixels(p, corner) < 7);
        const half = under < 0 ? 4 : radiusOf(under) + 1.5;
        corners.push(
          color === "red" ? square(corner, half, `corner ${kind}`) : disc(corner, half * 1.15, `corner ${kind}`),
        );
      });
    }
    layers.alternatives.replaceChildren(...others);
    layers.loop.replaceChildren(...bits);
    layers.corners.replaceChildren(...corners);
  }

  /** Return whether a closed line of the plane turns at a point. */
  function turnsAt(points, k) {
    const [before, after] = [points.at(k - 1), points[(k + 1) % points.length]];
    const [a, b] = points[k];
    return Math.abs((a - before[0]) * (after[1] - b) - (b - before[1]) * (after[0] - a)) > 1e-9;
  }

  function paintGhost() {
    const ghost = ghostOf(shown.page);
    if (!ghost) return layers.ghost.replaceChildren();
    const kind = `ghost ${ghost.color}`;
    const loop = svg("path", { class: `path ${kind}`, d: line(ghost.corners, true) });
    return layers.ghost.replaceChildren(loop, ...arrows([...ghost.corners, ghost.corners[0]], kind));
  }

  function paintTable() {
    const table = shown.page.table;
    const faint = shown.page.tab === "table" ? "" : " faint";
    if (!table) return layers.table.replaceChildren();
    const [first, second] = table.series.alpha;
    const path = first.map((a, k) => [a, second[k]]);
    const d = line(path, false);
    return layers.table.replaceChildren(
      svg("path", { class: `casing${faint}`, d }),
      svg("path", { class: `table-path ${table.color}${faint}`, d }),
      ...arrows(path, table.color + faint),
    );
  }

  function paintMarks() {
    const report = reportOf(shown.page);
    const broken = new Map();
    for (const { where, message, ok, decided } of report?.checks ?? []) {
      if (ok || !decided || !where) continue;
      const [a1, a2] = where.alpha;
      const key = `${a1.toFixed(3)},${a2.toFixed(3)}`; // several rules may break at one place
      const messages = broken.get(key)?.messages ?? [];
      broken.set(key, { a1, a2, messages: [...messages, message] });
    }
    const bits = [...broken.values()].map(({ a1, a2, messages }) =>
      svg(
        "g",
        { class: "broken", transform: `translate(${x(a1)} ${y(a2)})` },
        svg("title", {}, messages.join("\n")),
        svg("circle", { class: "place", r: 3 }),
        // Beside its place, so that the number of a waypoint there can be read.
        svg("circle", { cx: 16, cy: -16, r: 8 }),
        svg("path", { d: "M13 -19L19 -13M13 -13L19 -19" }),
      ),
    );
    layers.marks.replaceChildren(...bits);
  }

  const isChosen = (index) => shown.selected?.kind === "waypoint" && shown.selected.index === index;

  /** Return the radius of the ring of a waypoint: smaller where another is near, so that they do not overlap. */
  function radiusOf(index) {
    const { waypoints } = shown.state;
    const gaps = waypoints.map((p) => pixels(p, waypoints[index])).filter((gap) => gap > 1);
    return isChosen(index) ? RING : Math.max(3.5, Math.min(RING, ...gaps.map((gap) => gap / 2 - 1)));
  }

  function paintWaypoints() {
    const bits = shown.state.waypoints.map((p, index) => {
      const chosen = isChosen(index);
      const radius = radiusOf(index);
      return svg(
        "g",
        {
          class: `waypoint${chosen ? " chosen" : ""}`,
          transform: `translate(${x(p[0])} ${y(p[1])})`,
          "data-index": index,
        },
        svg("circle", { class: "ring", r: radius }),
        radius < 7 ? "" : svg("text", { y: 3.5, "text-anchor": "middle" }, String(index + 1)),
      );
    });
    layers.waypoints.replaceChildren(...bits.toSorted((a, b) => a.classList.contains("chosen") - b.classList.contains("chosen")));
  }

  /** Ring the waypoints that have no gait; an arrow leads from the first to its nearest admissible point. */
  function paintAdvice() {
    const advice = shown.page.tab === "plan" ? adviceOf(shown.page.plan, shown.state.waypoints) : null;
    const { waypoints } = shown.state;
    const bits = (advice?.indices ?? []).map((k) => disc(waypoints[k], 15, "advice-line from"));
    if (advice?.to && bits.length) {
      const from = waypoints[advice.indices[0]];
      const ends = [from, advice.to].map(([p, q]) => [x(p), y(q)]);
      const [dx, dy] = ends[1].map((end, k) => end - ends[0][k]);
      const length = Math.hypot(dx, dy);
      if (length > 24) {
        const [ux, uy] = [dx / length, dy / length];
        const start = [ends[0][0] + 15 * ux, ends[0][1] + 15 * uy];
        const turn = (Math.atan2(dy, dx) * 180) / Math.PI;
        bits.push(
          svg("path", { class: "advice-line to", d: `M${start.join(" ")}L${ends[1][0] - 12 * ux} ${ends[1][1] - 12 * uy}` }),
          svg("path", {
            class: "advice-head",
            d: "M-8 -6L4 0L-8 6Z",
            transform: `translate(${ends[1][0] - 9 * ux} ${ends[1][1] - 9 * uy}) rotate(${turn})`,
          }),
        );
      }
      bits.push(disc(advice.to, 5, "advice-line to"));
    }
    layers.advice.replaceChildren(...bits);
  }

  function paintDraft() {
    const bits = [];
    if (shown.draft.length) {
      const pointed = shown.hover && settled(shown.hover);
      const end = shown.keyboard ? shown.crosshair : pointed;
      bits.push(
        svg("path", { class: `draft ${shown.mode}`, d: line(end ? [...shown.draft, end] : shown.draft, false) }),
      );
      shown.draft.forEach((p, k) => bits.push(k ? square(p, 3, "handle") : disc(p, 6, "handle first")));
    }
    layers.draft.replaceChildren(...bits);
  }

  function paintCrosshair() {
    const [p, q] = shown.crosshair;
    const { left, top, side } = box;
    layers.crosshair.replaceChildren(
      ...(shown.keyboard
        ? [svg("path", { d: `M${x(p)} ${top}V${top + side}M${left} ${y(q)}H${left + side}` }), disc([p, q], 5, "")]
        : []),
    );
  }

  function paintDot() {
    layers.dot.replaceChildren(
      ...(shown.dot
        ? [disc(shown.dot.point, 13, "dot-casing"), disc(shown.dot.point, 13, `dot ${shown.dot.kind}`)]
        : []),
    );
  }

  function paintBackground() {
    paintShading();
    paintRegions();
    paintTypes();
  }

  function paintSet() {
    paintPolygons();
    paintWaypoints();
  }

  function paintAnswers() {
    paintTable();
    paintLoop();
    paintMarks();
    paintAdvice();
  }

  function paintAll() {
    if (!shown.page || !box.side) return;
    paintGrid();
    paintBackground();
    paintSet();
    paintAnswers();
    paintGhost();
    paintDraft();
    paintDot();
    paintCrosshair();
  }

  const parts = [
    drawn(({ state }) => [state.view], paintAll),
    drawn(({ background }) => [background], paintBackground),
    drawn(({ state }) => [state.waypoints, state.keep_out, state.keep_in], paintSet),
    drawn(({ plan, table, tab }) => [plan, table, tab], paintAnswers),
    drawn((page) => [ghostOf(page)], paintGhost),
  ];

  // Reading -------------------------------------------------------------------------------------------------------

  function readout(point) {
    const field = byId("readout");
    if (!point) {
      field.textContent = "\u00a0"; // keeps its line
      return;
    }
    let text = `α1 ${place(point[0])} · α2 ${place(point[1])}`;
    const data = shown.page.background;
    const { name, unit } = SHADES[data?.shading] ?? SHADES.R;
    if (data?.sheet === "blue" && shown.state.view.shading !== "none")
      text += data.raised ? " · no gait surface" : ` · ${name} = 0 in exact physics`;
    else if (data?.values && shown.state.view.shading !== "none") {
      const [column, row] = point.map((a) => Math.round(((a + HALF_PI) / Math.PI) * (data.n - 1)));
      const value = data.values[row * data.n + column];
      text += value === null || value === undefined ? " · no root" : ` · ${name} ≈ ${number(value, 2)}${unit}`;
    }
    field.textContent = text;
  }

  /** Return the phase of the period at which a gait is nearest to the pointer, or null if it is not near. */
  function phaseAt(event, series) {
    if (!series || !box.side) return null;
    const [a1, a2] = series.alpha;
    const clock = series.t ?? a1.map((_, k) => k);
    const [left, top] = raw(event).map((a, k) => (k ? y(a) : x(a)));
    let best = { distance: NEAR, time: null };
    for (let k = 0; k + 1 < a1.length; k += 1) {
      const [x0, y0] = [x(a1[k]), y(a2[k])];
      const [dx, dy] = [x(a1[k + 1]) - x0, y(a2[k + 1]) - y0];
      const square2 = dx * dx + dy * dy;
      const part = square2 ? Math.max(0, Math.min(1, ((left - x0) * dx + (top - y0) * dy) / square2)) : 0;
      const distance = Math.hypot(x0 + part * dx - left, y0 + part * dy - top);
      if (distance < best.distance) best = { distance, time: clock[k] + part * (clock[k + 1] - clock[k]) };
    }
    return best.time === null ? null : (best.time - clock[0]) / (clock.at(-1) - clock[0]);
  }

  const place = (a) => (angle(a) === number(a) ? `${number(a)}` : `${angle(a)} (${number(a, 3)})`);

  new ResizeObserver(() => {
    if (measure()) paintAll();
  }).observe(root);

  return {
    picture,
    shown,
    line,
    pixels,
    raw,
    readout,
    settled,
    x,
    y,
    box: () => box,
    paintCrosshair,
    paintDraft,
    paintPolygons,
    paintWaypoints,
    /** Show a page: what is set is there at once, the loop follows when it is planned. */
    show(page) {
      shown.page = page;
      const { selected } = shown;
      const known = selected?.kind === "waypoint" ? page.state.waypoints : page.state[selected?.kind];
      if (selected && selected.index >= known.length) shown.selected = null;
      if (measure()) paintAll();
      parts.forEach((part) => part(page));
    },
    showDot(point, kind) {
      shown.dot = point && { point, kind };
      paintDot();
    },
    phaseAt,
    /** Ring a place, for instance where a check was worst; null takes the ring away. */
    point(where) {
      layers.pointer.replaceChildren(...(where ? [disc(where.alpha, 18, "pointer")] : []));
    },
    repaint: paintAll,
  };
}

function rgbOf(name) {
  return themed(name)
    .match(/[\d.]+/g)
    .slice(0, 3)
    .map(Number);
}
