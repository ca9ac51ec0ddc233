// What was found: the headline, why, each check with its mark, the corners, other loops, warnings.

import { angle, number } from "./angles.js";
import { html, spoken } from "./elements.js";

const MARKS = { ok: ["✓", "holds"], no: ["✕", "broken"], undecided: ["?", "undecided"] };
const SIGNS = { positive: "R > 0", negative: "R < 0" };

/** Return the kind ("yes", "partly", "no", "none"), the headline and the reasons of a plan or a table's report. */
export function verdictOf(report) {
  if (!report || report.status === "empty") {
    return { kind: "none", headline: "No waypoints yet", reasons: [] };
  }
  if (report.status === "refused") return { kind: "no", headline: "Wrong input", reasons: [report.reason] };
  if (report.status === "infeasible") return { kind: "no", headline: "No gait", reasons: [report.reason] };
  const checks = report.checks ?? [];
  const broken = checks.filter((check) => check.mark !== "ok").map((check) => check.title);
  if (report.flyable) return { kind: "yes", headline: "Flyable", reasons: [] };
  if (report.valid) return { kind: "partly", headline: "Not flyable, obeys the paper’s rules", reasons: broken };
  return { kind: "no", headline: "Not flyable, breaks the paper’s rules", reasons: broken };
}

/** Return one sentence for screen readers. */
export function sentenceOf(report) {
  const { headline, reasons } = verdictOf(report);
  const what = report?.color ? `${report.color} gait, ${report.corners.length} corners. ` : "";
  return `${headline}. ${what}${reasons.join(", ")}`.trim();
}

const yesNo = { true: "yes", false: "no" };

function facts(report) {
  const rows = [];
  if (report.color)
    rows.push(["sheet", report.sign ? `${report.color}, ${SIGNS[report.sign] ?? report.sign}` : report.color]);
  const twoColor = () => {
    if (report.two_color !== null && report.two_color !== undefined) rows.push(["two-color", yesNo[report.two_color]]);
  };
  if (report.rows !== undefined) {
    rows.push(["rows", String(report.rows)]);
    twoColor();
  }
  if (Number.isFinite(report.length)) rows.push(["length", `${number(report.length)} rad`]);
  if (report.reachable_from_hover !== null && report.reachable_from_hover !== undefined) {
    rows.push(["reachable from hover", yesNo[report.reachable_from_hover]]);
  }
  if (report.rows === undefined) twoColor();
  if (Number.isFinite(report.lower_bound)) rows.push(["lower bound", `${number(report.lower_bound)} rad`]);
  return html(
    "dl",
    { class: "facts" },
    ...rows.map(([name, value]) => html("div", {}, html("dt", {}, name), html("dd", {}, value))),
  );
}

function checkRow(check, onPoint) {
  const [glyph, words] = MARKS[check.mark] ?? MARKS.undecided;
  const hasPlace = check.where && Number.isFinite(check.where.alpha1);
  const point = (where) => () => onPoint(where);
  const title = hasPlace
    ? html(
        "button",
        {
          type: "button",
          class: "plain",
          title: "Show the place on the map",
          onmouseenter: point(check.where),
          onmouseleave: point(null),
          onfocus: point(check.where),
          onblur: point(null),
          onclick: point(check.where),
        },
        check.title,
      )
    : html("span", {}, check.title);
  return html(
    "li",
    { class: `check ${check.mark}`, "data-check": check.name },
    html("span", { class: "mark", "aria-hidden": "true" }, glyph),
    html(
      "p",
      {},
      html("span", { class: "check-title" }, title),
      spoken(` ${words}: `),
      " ",
      html("span", { class: "small" }, check.message),
    ),
  );
}

function cornersTable(report) {
  if (!report.corners?.length) return null;
  const most = 64;
  const head = html(
    "tr",
    {},
    ...["", "α1", "α2", "α3", "α4", "types"].map((name) => html("th", { scope: "col" }, name || spoken("corner"))),
  );
  const body = report.corners.slice(0, most).map((corner, k) =>
    html(
      "tr",
      {},
      html("th", { scope: "row" }, String(k + 1)),
      ...corner.map((a) => {
        const text = angle(a);
        const plain = number(a, 3);
        return html(
          "td",
          {},
          html("span", { class: "angle" }, text === number(a) ? plain : text),
          text === number(a) ? null : html("span", { class: "small" }, plain),
        );
      }),
      html("td", { class: `types ${report.colors?.[k] ?? ""}` }, (report.types?.[k] ?? "").replaceAll("-", "−")),
    ),
  );
  return html(
    "details",
    { open: report.corners.length <= 12, "data-key": "corners" },
    html("summary", {}, `Corners (${report.corners.length})`),
    html(
      "div",
      { class: "scrolls", tabindex: "0", role: "region", "aria-label": "Corners, in radians" },
      html("table", { class: "corners", id: "corners" }, html("thead", {}, head), html("tbody", {}, ...body)),
    ),
    report.corners.length > most ? html("p", { class: "small" }, `The first ${most} of them.`) : null,
  );
}

function others(report, onTake) {
  if (!report.alternatives?.length) return null;
  return html(
    "details",
    { open: true, "data-key": "alternatives" },
    html("summary", {}, `Other loops (${report.alternatives.length})`),
    html(
      "ul",
      { class: "plainlist" },
      ...report.alternatives.map((other) => {
        const rules = other.valid ? "obeys the paper’s rules, cannot fly" : "breaks the paper’s rules";
        const verdict = other.flyable ? "flyable" : rules;
        const can = ["red", "blue"].includes(other.color);
        const words = `${other.color}, ${SIGNS[other.sign] ?? "no sign of R"}`;
        return html(
          "li",
          { class: "other" },
          html("span", { class: `sheet-key ${other.color}`, "aria-hidden": "true" }),
          html("span", {}, `${words}, ${number(other.length)} rad: ${verdict}`),
          can
            ? html(
                "button",
                { type: "button", class: "quiet", onclick: () => onTake(other) },
                "Take",
                spoken(` the ${words} loop`),
              )
            : null,
        );
      }),
    ),
  );
}

function lines(title, texts, kind) {
  if (!texts?.length) return null;
  return html(
    "div",
    { class: `notes ${kind}` },
    html("h3", {}, title),
    html("ul", {}, ...texts.map((text) => html("li", {}, text))),
  );
}

/** Show a plan or a table's report in `root`. `on` has point(where) and take(alternative). */
export function showReport(root, report, on) {
  const open = new Map([...root.querySelectorAll("details[data-key]")].map((node) => [node.dataset.key, node.open]));
  const { kind, headline, reasons } = verdictOf(report);
  const glyph = { yes: "✓", partly: "△", no: "✕" }[kind];
  const parts = [
    html(
      "p",
      { class: `headline ${kind}`, id: "headline" },
      glyph ? html("span", { class: "mark", "aria-hidden": "true" }, glyph) : null,
      headline,
    ),
  ];
  if (kind === "none") {
    parts.push(
      html("p", { class: "hint" }, "Click on the map to set the first waypoint, or load one of the paper’s gaits."),
    );
  } else {
    if (reasons.length) parts.push(html("p", { class: "reasons" }, reasons.join(", ")));
    if (report.checks?.length) parts.push(facts(report));
    const checks = (report.checks ?? []).toSorted((a, b) => Number(a.mark === "ok") - Number(b.mark === "ok"));
    if (checks.length) {
      parts.push(
        html("h3", {}, "Checks"),
        html("ul", { class: "checks" }, ...checks.map((check) => checkRow(check, on.point))),
      );
    }
    // What a check says already is not said twice.
    const warnings = report.warnings?.filter((text) => !checks.some((check) => check.message === text));
    parts.push(lines(warnings?.length > 1 ? "Warnings" : "Warning", warnings, "warnings"));
    parts.push(cornersTable(report), others(report, on.take));
    const ways = (report.obstacles ?? [])
      .map((obstacle) => obstacle.message)
      .filter((text) => !report.reason?.includes(text));
    if (ways.length) {
      parts.push(
        html(
          "details",
          { "data-key": "ways" },
          html("summary", {}, `Why not otherwise (${ways.length})`),
          html("ul", { class: "ways small" }, ...ways.map((text) => html("li", {}, text))),
        ),
      );
    }
  }
  root.replaceChildren(...parts.filter(Boolean));
  for (const node of root.querySelectorAll("details[data-key]")) {
    if (open.has(node.dataset.key)) node.open = open.get(node.dataset.key);
  }
}
