// The plan: its controls, the verdict on it or on a table, and the report below.

import { bindControls } from "./controls.js";
import { byId } from "./elements.js";
import { allowDownloads, bindDownloads } from "./files.js";
import { drawn, ghostOf, questionOf, reportOf } from "./store.js";
import { adviceOf, sentenceOf, showReport, showVerdict, verdictOf } from "./verdict.js";

const OF_PLANES = ["color", "objective", "method", "require"]; // what other vehicles cannot choose
const GONE = { status: "gone" };

/**
 * Bind what belongs to the plan of a store, and return the function that draws it.
 *
 * `on` has commit(patch), removeWaypoint(index), removePolygon(kind, index), selectPolygon(kind, index),
 * point(where or null), problem(text), failed(error).
 */
export function planViewIn(setup, store, on) {
  const showControls = bindControls(setup, { ...on, preview: store.preview, look: store.look });
  bindDownloads(setup.formats, () => questionOf(store.page.state), on.failed);

  function showAnswer(page) {
    const isLost = page.isGone && page.tab === "plan";
    const report = isLost ? GONE : reportOf(page);
    const { waypoints } = page.state;
    const advice = adviceOf(report, waypoints);
    showVerdict(report, advice, {
      move: (index, point) => on.commit({ waypoints: store.page.state.waypoints.with(index, point) }),
      allowValid: () => on.commit({ require: "valid" }),
    });
    const ghost = ghostOf(page);
    if (ghost) byId("reason").textContent = `The vehicle flies ${ghost.name} of the paper`;
    const sentence = sentenceOf(report, advice);
    if (byId("verdict-spoken").textContent !== sentence) byId("verdict-spoken").textContent = sentence;
    document.title =
      report && report.status !== "empty" ? `${verdictOf(report).headline} · gaitgraph` : "gaitgraph explore";
    if (isLost) return; // the report stays, that of another loop
    showReport(byId("report"), report, advice, {
      point: on.point,
      take: ({ color, sign, flyable }) => on.commit({ color, sign, require: flyable ? "flyable" : "valid" }),
    });
  }

  /** Hide what has no meaning on a curved sheet, unless something else than the default is chosen there. */
  function showPlanes({ background, state }) {
    const isCurved = Boolean(background?.curved);
    const place = (id) => (byId(id) ?? byId(`field-${id}`)).closest("fieldset, .row, label");
    for (const key of OF_PLANES) place(key).hidden = isCurved && state[key] === setup.defaults[key];
    for (const key of ["sheet", "types"]) place(key).hidden = isCurved;
  }

  const parts = [
    drawn((page) => [page.state], (page) => showControls(page.state)),
    drawn((page) => [reportOf(page), page.isGone, page.tab, ghostOf(page)], showAnswer),
    drawn((page) => [page.background?.curved, page.state], showPlanes),
    drawn((page) => [page.plan], (page) => allowDownloads(page.plan?.status === "planned")),
    drawn((page) => [page.isGone], (page) => byId("main").classList.toggle("stale", page.isGone)),
    drawn((page) => [page.isPlanSlow], (page) => byId("main").classList.toggle("waiting", page.isPlanSlow)),
    (page) => {
      byId("undo").disabled = !page.canUndo;
      byId("redo").disabled = !page.canRedo;
    },
  ];
  return (page) => parts.forEach((part) => part(page));
}
