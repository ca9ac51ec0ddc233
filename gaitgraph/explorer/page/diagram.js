// The roll–pitch diagrams: the attitudes at which the matrix is singular, for the gait and for the biased gait.

import { HALF_PI, angle, figure, number } from "./angles.js";
import { html, svg } from "./elements.js";

const SIZE = 200;
const EDGE = { left: 30, top: 6, right: 13, bottom: 32 };
const SIDE = SIZE - EDGE.left - EDGE.right;

const x = (a) => EDGE.left + ((a + HALF_PI) / Math.PI) * SIDE;
const y = (a) => EDGE.top + ((HALF_PI - a) / Math.PI) * SIDE;

function square(drawn, kind, title) {
  const outline = drawn.acceptable?.length
    ? [
        svg("path", {
          class: "acceptable",
          d: `M${drawn.acceptable.map(([r, p]) => `${x(r).toFixed(1)} ${y(p).toFixed(1)}`).join("L")}Z`,
        }),
      ]
    : [];
  const bits = [...outline, svg("rect", { class: "frame", x: EDGE.left, y: EDGE.top, width: SIDE, height: SIDE })];
  for (const a of [-HALF_PI, 0, HALF_PI]) {
    bits.push(svg("text", { class: "tick", x: x(a), y: EDGE.top + SIDE + 16, "text-anchor": "middle" }, angle(a)));
    bits.push(svg("text", { class: "tick", x: EDGE.left - 4, y: y(a) + 3.5, "text-anchor": "end" }, angle(a)));
  }
  bits.push(svg("path", { class: "rule", d: `M${x(0)} ${EDGE.top}v${SIDE}M${EDGE.left} ${y(0)}h${SIDE}` }));
  bits.push(
    svg("text", { class: "axis", x: x(0), y: EDGE.top + SIDE + 30, "text-anchor": "middle" }, "roll φ"),
    svg("text", { class: "axis", transform: `translate(9 ${y(0)}) rotate(-90)`, "text-anchor": "middle" }, "pitch θ"),
  );
  const d = drawn.curves
    .filter((curve) => curve.length)
    .map((curve) => `M${curve.map(([roll, pitch]) => `${x(roll).toFixed(1)} ${y(pitch).toFixed(1)}`).join("L")}`)
    .join("");
  if (d) bits.push(svg("path", { class: `singular ${kind}`, d }));
  bits.push(svg("path", { class: "upright", d: `M${x(0) - 4} ${y(0)}h8M${x(0)} ${y(0) - 4}v8` }));
  return svg(
    "svg",
    { viewBox: `0 0 ${SIZE} ${SIZE + 6}`, role: "img", "aria-label": `${title}: ${words(drawn)}` },
    ...bits,
  );
}

function margin(drawn) {
  return drawn.tilt_margin_deg === null ? "no margin" : `${number(drawn.tilt_margin_deg, 1)}°`;
}

function words(drawn) {
  return `${drawn.verdict}; tilt margin ${margin(drawn)}, acceptable ${drawn.acceptable_percent}`;
}

function side(drawn, kind, title) {
  return html(
    "figure",
    { class: "attitudes" },
    html("figcaption", {}, `${title}: ${drawn.verdict}`),
    square(drawn, kind, title),
    html(
      "dl",
      {},
      html("div", {}, html("dt", {}, "tilt margin"), html("dd", {}, margin(drawn))),
      html("div", {}, html("dt", {}, "acceptable"), html("dd", {}, drawn.acceptable_percent)),
    ),
    drawn.tilt_margin_reason ? html("p", { class: "small" }, drawn.tilt_margin_reason) : null,
  );
}

/** Show the diagram of a gait and of the biased gait; one line where no attitude is singular, as on red. */
export function showDiagram(root, answer) {
  if (!answer?.own) {
    root.replaceChildren(html("p", { class: "nothing" }, answer?.reason ?? "No gait to draw."));
    return;
  }
  const isFree = answer.own.acceptable_fraction === 1 && !answer.own.curves.length;
  const free = html("p", { id: "all-acceptable" }, `✓ Gait: ${words(answer.own)}`);
  const parts = [isFree ? free : side(answer.own, "own", "Gait")];
  if (answer.biased) parts.push(side(answer.biased, "biased", `Biased, η = ${figure(answer.eta)}`));
  root.classList.toggle("single", isFree || !answer.biased);
  root.replaceChildren(...parts);
  if (answer.reason) root.append(html("p", { class: "small whole" }, answer.reason));
}
