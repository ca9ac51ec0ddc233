// The answer: the headline and why, what to do when there is no gait, each check, the corners, other loops, warnings.

import { angle, inPi, number } from "./angles.js";
import { byId, html, spoken } from "./elements.js";

const MARKS = { ok: ["✓", "holds"], no: ["✕", "broken"], undecided: ["?", "undecided"] };
const GLYPHS = { yes: "✓", partly: "△", no: "✕" };
const MOST_OPEN = 12; // corners
const MOST_CORNERS = 64;

/** Return the kind ("yes", "partly", "no", "none"), the headline and the reason of a plan or a table's report. */
export function verdictOf(report, advice = null) {
  const said = (kind, headline, reason = "") => ({ kind, headline, reason });
  if (!report || report.status === "empty") return said("none", "No waypoints yet");
  if (report.status === "gone") return said("none", "Not planned yet", "The server does not answer");
  if (report.status === "refused") return said("no", "Wrong input", report.reason);
  if (report.status === "infeasible") return said("no", "No gait", inPi(advice?.refusal.message ?? report.reason));
  const isPosture = report.corners.length === 1;
  if (isPosture && report.flyable) return said("none", "One posture", ADD);
  const verdict = report.verdict.replaceAll("'", "’");
  const headline = isPosture ? `One posture, ${verdict}` : verdict[0].toUpperCase() + verdict.slice(1);
  if (report.flyable) return said("yes", headline, withCaveat(outline(report), report));
  const broken = report.checks.filter((check) => !check.ok).map(titleOf);
  const reason = withCaveat(`Broken: ${broken.join(", ")}`, report);
  return said(report.valid ? "partly" : "no", headline, isPosture ? `${ADD} ${reason}` : reason);
}

const ADD = "Add a waypoint for a gait.";
const titleOf = (check) => check.name.replaceAll("_", " ");

/** Return which of MARKS a check has. */
function markOf(check) {
  if (check.ok) return "ok";
  return check.decided ? "no" : "undecided";
}

function withCaveat(text, report) {
  return report.caveat ? `${text}. ${report.caveat}` : text;
}

function outline(report) {
  const length = Number.isFinite(report.length) ? `length ${angle(report.length)} rad` : `${report.rows} rows`;
  return [report.surface, length].filter(Boolean).join(", ");
}

/** Return one sentence for screen readers. */
export function sentenceOf(report, advice) {
  const { headline, reason } = verdictOf(report, advice);
  const what = report?.colors?.length ? `${report.color} gait, ${report.corners.length} corners. ` : "";
  return `${headline}. ${what}${reason}`.trim();
}

/**
 * Return what is nearest to a gait where there is none: the refusal, which of the waypoints are its, and the place
 * `to` which the first of them is to move, or null.
 */
export function adviceOf(plan, waypoints) {
  if (plan?.status !== "infeasible") return null;
  const [refusal] = plan.refusals; // the one that the shortest moves remove
  const isSame = ([p, q], [r, s]) => p === r && q === s;
  const moves = refusal.waypoints
    .map((k) => ({ from: plan.waypoints[k - 1], to: refusal.moved[k - 1] ?? plan.waypoints[k - 1] }))
    .toSorted((a, b) => isSame(a.from, a.to) - isSame(b.from, b.to));
  // The server merges waypoints that repeat, and those of the page may be newer.
  const indices = moves.map(({ from }) => waypoints.findIndex((point) => isSame(point, from)));
  if (indices.includes(-1)) return null;
  return { refusal, indices, to: moves.length && !isSame(moves[0].from, moves[0].to) ? moves[0].to : null };
}

/** Show the verdict in its line, with the way from "No gait" to a gait. `on` has move(index, point), allowValid(). */
export function showVerdict(report, advice, on) {
  const { kind, headline, reason } = verdictOf(report, advice);
  const glyph = GLYPHS[kind];
  const line = byId("headline");
  line.className = `headline ${kind}`;
  line.replaceChildren(glyph ? html("span", { class: "mark", "aria-hidden": "true" }, glyph) : "", headline);
  byId("reason").textContent = byId("reason").title = reason;
  const button = (id, text, onclick) => html("button", { type: "button", id, onclick }, text);
  const [index] = advice?.indices ?? [];
  const actions = [
    advice?.to ? button("move-there", `Move waypoint ${index + 1} there`, () => on.move(index, advice.to)) : null,
    report?.advice ? button("allow-valid", "Allow valid loops", () => on.allowValid()) : null,
  ];
  byId("actions").replaceChildren(...actions.filter(Boolean));
}

function folded(key, title, open, ...children) {
  return html("details", { open, "data-key": key }, html("summary", {}, title), ...children);
}

function facts(report) {
  const yesNo = (value) => ({ true: "yes", false: "no" })[value];
  const rad = (value) => (Number.isFinite(value) ? `${angle(value)} rad` : null);
  const power = Number.isFinite(report.hover_power)
    ? `${report.hover_power.toFixed(3)} times level hover, over ${report.hover_power_over}`
    : null;
  const rows = [
    ["sheet", report.surface],
    ["vehicle", report.vehicle],
    ["rows", report.rows === undefined ? null : String(report.rows)],
    ["length", rad(report.length)],
    ["lower bound", rad(report.lower_bound)],
    ["hover power", power],
    ["reachable from hover", yesNo(report.reachable_from_hover)],
    ["two-color", yesNo(report.two_color)],
  ].filter(([, value]) => value);
  return html(
    "dl",
    { class: "facts" },
    ...rows.map(([name, value]) => html("div", {}, html("dt", {}, name), html("dd", {}, value))),
  );
}

function checkRow(check, onPoint) {
  const mark = markOf(check);
  const [glyph, words] = MARKS[mark];
  const show = () => onPoint(check.where);
  const hide = () => onPoint(null);
  const events = { onmouseenter: show, onmouseleave: hide, onfocus: show, onblur: hide, onclick: show };
  const title = check.where
    ? html("button", { type: "button", class: "plain", title: "Show the place on the map", ...events }, titleOf(check))
    : titleOf(check);
  return html(
    "li",
    { class: `check ${mark}`, "data-check": check.name },
    html("span", { class: "mark", "aria-hidden": "true" }, glyph),
    html(
      "p",
      {},
      html("span", { class: "check-title" }, title),
      spoken(` ${words}: `),
      " ",
      html("span", { class: "small" }, inPi(check.message)),
    ),
  );
}

/** Return the checks: those that fail are listed, those that hold are one line to unfold. */
function checksOf(checks, onPoint) {
  const list = (some) => html("ul", { class: "checks" }, ...some.map((check) => checkRow(check, onPoint)));
  const passed = checks.filter((check) => check.ok);
  const failed = checks.filter((check) => !check.ok);
  const title = `✓ ${failed.length ? "" : "All "}${passed.length} checks hold`;
  return [failed.length ? list(failed) : null, passed.length ? folded("passed", title, false, list(passed)) : null];
}

function cornersTable(report) {
  const { corners, types = [], colors = [] } = report;
  if (!corners?.length) return null;
  const names = ["", "α1", "α2", "α3", "α4", "types"];
  const head = names.map((name) => html("th", { scope: "col" }, name || spoken("corner")));
  const cell = (a) => {
    const isPlain = angle(a) === number(a);
    const digits = number(a, 3);
    return html(
      "td",
      {},
      html("span", { class: "angle" }, isPlain ? digits : angle(a)),
      isPlain ? null : html("span", { class: "small" }, digits),
    );
  };
  const row = (corner, k) =>
    html(
      "tr",
      {},
      html("th", { scope: "row" }, String(k + 1)),
      ...corner.map(cell),
      html("td", { class: `types ${colors[k] ?? ""}` }, (types[k] ?? "").replaceAll("-", "−")),
    );
  const table = html(
    "table",
    { class: "corners", id: "corners" },
    html("thead", {}, html("tr", {}, ...head)),
    html("tbody", {}, ...corners.slice(0, MOST_CORNERS).map(row)),
  );
  return folded(
    "corners",
    `Corners (${corners.length})`,
    corners.length <= MOST_OPEN,
    html("div", { class: "scrolls", tabindex: "0", role: "region", "aria-label": "Corners, in radians" }, table),
    corners.length > MOST_CORNERS ? html("p", { class: "small" }, `The first ${MOST_CORNERS} of them.`) : null,
  );
}

function others(report, onTake) {
  if (!report.alternatives?.length) return null;
  const item = (other) => {
    const take = html(
      "button",
      { type: "button", class: "quiet", onclick: () => onTake(other) },
      "Take",
      spoken(` the ${other.surface} loop`),
    );
    return html(
      "li",
      { class: "other" },
      html("span", { class: `sheet-key ${other.color}`, "aria-hidden": "true" }),
      html("span", {}, `${other.surface}, ${angle(other.length)} rad: ${other.verdict}`),
      other.color === "mixed" ? null : take,
    );
  };
  return folded(
    "alternatives",
    `Other loops (${report.alternatives.length})`,
    report.status === "planned",
    html("ul", { class: "plainlist" }, ...report.alternatives.map(item)),
  );
}

function listed(texts) {
  return html("ul", { class: "ways small" }, ...texts.map((text) => html("li", {}, inPi(text))));
}

/**
 * Show a plan or a table's report in `root`. `on` has point(where) and take(alternative).
 */
export function showReport(root, report, advice, on) {
  const open = new Map([...root.querySelectorAll("details[data-key]")].map((node) => [node.dataset.key, node.open]));
  const { reason } = verdictOf(report, advice);
  const parts = [];
  if (!report || report.status === "empty") {
    parts.push(
      html("p", { class: "hint" }, "Click on the map to set the first waypoint, or load one of the paper’s gaits."),
    );
  } else {
    const { checks = [], warnings = [], refusals = [] } = report;
    if (!checks.length) parts.push(html("p", {}, reason)); // whole; its line may cut it off
    if (checks.length) parts.push(facts(report), ...checksOf(checks, on.point));
    const rest = warnings.filter((text) => !checks.some((check) => check.message === text));
    if (rest.length) {
      parts.push(
        html("div", { class: "notes" }, html("h3", {}, rest.length > 1 ? "Warnings" : "Warning"), listed(rest)),
      );
    }
    parts.push(cornersTable(report), others(report, on.take));
    const ways = refusals.filter((one) => one !== advice?.refusal).map((one) => one.message);
    if (ways.length) parts.push(folded("ways", `Why no other color or sign (${ways.length})`, false, listed(ways)));
  }
  root.replaceChildren(...parts.filter(Boolean));
  for (const node of root.querySelectorAll("details[data-key]")) {
    const { key } = node.dataset;
    if (open.has(key) && !(key === "corners" && report.corners.length > MOST_OPEN)) node.open = open.get(key);
  }
}
