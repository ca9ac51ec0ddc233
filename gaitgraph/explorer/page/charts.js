// The time series: the tilt angles, and below them a second quantity, with one cursor at the phase of the clock.

import uPlot from "./vendor/uPlot.esm.js";
import { angle, figure, number } from "./angles.js";
import { html, themed } from "./elements.js";

const NAMES = ["α1", "α2", "α3", "α4"];
const COLORS = ["--alpha1", "--alpha2", "--alpha3", "--alpha4"];
// On red α3 lies on α1 and α4 on α2: a thin dark dashed line on a wide light one shows both.
const WIDTHS = [5, 5, 1.75, 1.75];
const DASHES = [undefined, [9, 3], [5, 3], [2, 3]];
const ONE = { colors: ["--ink"], widths: [1.75], dashes: [undefined] };
const FOUR = { colors: COLORS, widths: WIDTHS, dashes: DASHES };

export const CHARTS = {
  rates: { title: "Rates", unit: "rad/s", names: NAMES.map((name) => `${name}′`) },
  R: { title: "R", unit: "dimensionless", names: ["R"] },
  least_singular_value: { title: "Least singular value σ", unit: "dimensionless", names: ["σ"] },
  hover_thrusts: { title: "Hover thrusts", unit: "share of m·g", names: ["rotor 1", "rotor 2", "rotor 3", "rotor 4"] },
};

/** Return the rows of a series for uPlot, or null where the server sent none. */
function rowsOf(series, key) {
  const rows = key === "alpha" ? series.alpha : series[key];
  if (!rows?.length) return null;
  return Array.isArray(rows[0]) ? rows : [rows];
}

function ticksOfPi(self, axis, low, high) {
  const unit = [8, 4, 2, 1].map((d) => Math.PI / d).find((step) => (high - low) / step <= 6) ?? Math.PI;
  const ticks = [];
  for (let n = Math.ceil(low / unit - 1e-9); n * unit <= high + 1e-9; n += 1) ticks.push(n * unit);
  return ticks;
}

function chartIn(root, { names, colors, widths, dashes, isAngle, height, isLast, fromZero, timeUnit, onCursor }) {
  const ink = themed("--soft");
  const rule = themed("--rule");
  const font = "12px system-ui, sans-serif";
  const plot = new uPlot(
    {
      width: root.clientWidth || 300,
      height,
      legend: { show: false },
      cursor: { y: false, drag: { x: false, y: false }, points: { size: 6 } },
      padding: [8, 10, isLast ? 0 : 2, 0],
      scales: {
        x: { time: false },
        y: {
          range: (self, low, high) => {
            if (low === null) return [0, 1];
            const [from, to] = fromZero ? [Math.min(0, low), Math.max(0, high)] : [low, high];
            const margin = (to - from) * 0.08 || Math.abs(to) * 0.1 || 1;
            return [from < 0 || !fromZero ? from - margin : from, to > 0 || !fromZero ? to + margin : to];
          },
        },
      },
      axes: [
        {
          stroke: ink,
          font,
          size: isLast ? 22 : 20,
          gap: 4,
          incrs:
            timeUnit === "row"
              ? [1, 2, 5].flatMap((m) => [0, 1, 2, 3, 4, 5, 6].map((e) => m * 10 ** e)).sort((a, b) => a - b)
              : undefined,
          grid: { stroke: rule, width: 1 },
          ticks: { show: false },
          label: isLast ? timeUnit : undefined,
          labelSize: 16,
          labelFont: font,
          labelGap: 0,
          values: (self, splits) => splits.map((v) => (isLast ? figure(v) : "")),
        },
        {
          stroke: ink,
          font,
          size: 52,
          gap: 6,
          grid: { stroke: rule, width: 1 },
          ticks: { show: false },
          splits: isAngle ? ticksOfPi : undefined,
          values: (self, splits) => splits.map((v) => (isAngle ? angle(v) : figure(v))),
        },
      ],
      series: [
        {},
        ...names.map((label, k) => ({
          label,
          stroke: themed(colors[k]),
          width: widths[k],
          pxAlign: 0,
          dash: dashes[k],
          points: { show: false },
        })),
      ],
      hooks: {
        setCursor: [
          (self) => {
            if (self.cursor.event && self.cursor.left >= 0) onCursor(self.posToVal(self.cursor.left, "x"));
          },
        ],
      },
    },
    [[0], ...names.map(() => [0])],
    root,
  );
  return plot;
}

/**
 * Draw time series in `upper` and `lower`; `onTime(phase)` is told when the pointer is over one of them.
 */
export function chartsIn(upper, lower, legend, onTime) {
  let series = null;
  let kind = "least_singular_value";
  let plots = [];
  let built = "";
  const hidden = [false, false, false, false];
  let values = [];
  let phaseShown = 0;
  let sheet = null;
  const note = html("p", { class: "small", hidden: true }, "Blue: 0 in exact physics. The values are rounding noise.");
  lower.after(note);

  const clockOf = () => series.t ?? series.rows;
  const onCursor = (t) => {
    const clock = clockOf();
    const [first, last] = [clock[0], clock.at(-1)];
    if (last > first) onTime((t - first) / (last - first));
  };

  function build() {
    plots.forEach((plot) => plot.destroy());
    plots = [];
    upper.replaceChildren();
    lower.replaceChildren();
    if (!series) return upper.append(html("p", { class: "nothing" }, "No gait to draw."));
    const rows = rowsOf(series, kind);
    const common = { onCursor, timeUnit: series.t ? "t (s)" : "row" };
    plots.push(
      chartIn(upper, {
        ...common,
        ...FOUR,
        names: NAMES,
        isAngle: true,
        height: 190,
        isLast: !rows,
      }),
    );
    if (rows) {
      plots.push(
        chartIn(lower, {
          ...common,
          ...(rows.length > 1 ? FOUR : ONE),
          names: CHARTS[kind].names,
          isAngle: false,
          height: 150,
          isLast: true,
          fromZero: true,
        }),
      );
    } else lower.append(html("p", { class: "nothing" }, "Rates are drawn for plans only."));
    fill();
  }

  function fill() {
    const t = clockOf();
    plots[0]?.setData([t, ...series.alpha]);
    plots[1]?.setData([t, ...rowsOf(series, kind)]);
    hidden.forEach((off, k) => {
      plots[0]?.setSeries(k + 1, { show: !off });
      if (plots[1]?.series.length === 5) plots[1].setSeries(k + 1, { show: !off });
    });
  }

  function showLegend() {
    values = NAMES.map((name, k) => {
      const value = html("span", { class: "value" });
      const box = html("input", {
        type: "checkbox",
        checked: !hidden[k],
        onchange: (event) => {
          hidden[k] = !event.target.checked;
          if (series) fill();
        },
      });
      box.checked = !hidden[k];
      legend.append(
        html("label", { class: "key" }, box, html("span", { class: `swatch alpha${k + 1}` }), name, " ", value),
      );
      return value;
    });
  }
  showLegend();

  const observer = new ResizeObserver(() => {
    for (const plot of plots) {
      const width = plot.root.parentElement.clientWidth;
      if (width && width !== plot.width) plot.setSize({ width, height: plot.height });
    }
  });
  observer.observe(upper);

  /** Put the cursor at a phase; return the row there. */
  function at(phase) {
    phaseShown = phase;
    if (!series) return null;
    const clock = clockOf();
    const time = clock[0] + phase * (clock.at(-1) - clock[0]);
    for (const plot of plots) {
      const left = plot.valToPos(time, "x");
      if (Number.isFinite(left)) plot.setCursor({ left, top: 0 }, false);
    }
    let row = Math.round(phase * (clock.length - 1));
    while (row > 0 && clock[row] > time) row -= 1;
    while (row < clock.length - 1 && clock[row + 1] <= time) row += 1;
    const next = Math.min(row + 1, clock.length - 1);
    const part = clock[next] > clock[row] ? (time - clock[row]) / (clock[next] - clock[row]) : 0;
    const alpha = series.alpha.map((column) => column[row] + part * (column[next] - column[row]));
    values.forEach((value, k) => (value.textContent = number(alpha[k], 3)));
    return { time, row, part, alpha };
  }

  // uPlot hides its cursor when the pointer leaves; here it is the time, which stays.
  for (const root of [upper, lower])
    root.addEventListener("pointerleave", () => requestAnimationFrame(() => at(phaseShown)));

  return {
    show(next, chart, color) {
      const isNoise = color === "blue" && (chart === "R" || chart === "least_singular_value");
      note.hidden = !isNoise || !next;
      sheet = color;
      series = next?.alpha?.[0]?.length ? next : null;
      const wanted = JSON.stringify([chart, series && [Boolean(series.t), Boolean(rowsOf(series, chart))]]);
      kind = chart;
      if (wanted !== built) {
        built = wanted;
        build();
      } else if (series) fill();
      values.forEach((value) => (value.textContent = ""));
    },
    /** Show another quantity below, of the same series. */
    choose(chart) {
      if (kind !== chart) this.show(series, chart, sheet);
    },
    rebuild: build,
    at,
  };
}
