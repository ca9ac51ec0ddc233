// What the page asks the server when it changes: a plan, a background of the map, a roll–pitch diagram.

import { gone, problem } from "./lines.js";
import { Gone, latest, untilBack } from "./queries.js";
import { diagramKey, mapQuestion, planKey, questionOf } from "./store.js";

const QUIET = 200; // after the last change, before the diagram is asked for [ms]
const MOST_MAPS = 16; // that are kept

/** Ask for what the page of a store needs; returns `ask`, for each change, and `failed`, for an error of any query. */
export function askingFor(store) {
  let asked = { plan: "", map: "", diagram: "" };
  let timer = 0;
  let isAway = false;
  const maps = new Map();

  /** Show an error; where the server does not answer, wait until it does and ask for everything again. */
  async function failed(error) {
    if (!(error instanceof Gone)) {
      problem(error.message);
      return;
    }
    if (isAway) return;
    isAway = true;
    await untilBack(gone);
    isAway = false;
    gone(null);
    asked = { plan: "", map: "", diagram: "" };
    ask();
  }

  function planned(plan, body) {
    const diagram = plan.status === "planned" ? store.page.diagram : null;
    store.put({ plan, planned: planKey(body), isGone: false, diagram });
  }

  const planner = latest("api/plan", {
    onAnswer: planned,
    onError(error, body) {
      if (error instanceof Gone) {
        store.put({ isGone: true });
        failed(error);
      } else if (body.waypoints.length) planned({ status: "refused", reason: error.message }, body);
      else {
        problem(error.message); // there is no verdict to say it
        planned({ status: "empty" }, body);
      }
    },
    onWaiting: (isSlow) => store.put({ isPlanSlow: isSlow }),
  });

  const diagrams = latest("api/diagram", {
    onAnswer: (diagram, body) => store.put({ diagram, diagrammed: JSON.stringify(body) }),
    onError(error, body) {
      if (error instanceof Gone) failed(error);
      else store.put({ diagram: { reason: error.message }, diagrammed: JSON.stringify(body) });
    },
    onWaiting: (isSlow) => store.put({ isDiagramSlow: isSlow }),
  });

  const backgrounds = latest("api/map", {
    onAnswer(answer, body) {
      const range = answer.values && [Math.min(...answer.values), Math.max(...answer.values)];
      const sheet = answer.curved ? "red" : body.sheet; // the only one
      const background = { ...answer, range, sheet, shading: body.shading };
      maps.set(JSON.stringify(body), background);
      if (maps.size > MOST_MAPS) maps.delete(maps.keys().next().value);
      store.put({ background }); // also one that is late, while κ is dragged: the newest one follows
    },
    onError(error) {
      asked.map = "";
      failed(error);
    },
  });

  function askPlan({ state, isHeld }) {
    const key = planKey(state);
    if (key === asked.plan) return;
    asked.plan = key;
    problem(null);
    planner.ask(questionOf(state), isHeld);
  }

  function askMap(page) {
    const question = mapQuestion(page);
    const key = JSON.stringify(question);
    if (key === asked.map) return;
    asked.map = key;
    if (maps.has(key)) store.put({ background: maps.get(key) });
    else backgrounds.ask(question, page.isHeld);
  }

  /** Ask for the diagram when nothing has changed for a while: the server is to plan first. */
  function askDiagram(page) {
    const key = diagramKey(page);
    if (key === asked.diagram) return;
    asked.diagram = key;
    clearTimeout(timer);
    diagrams.stop();
    if (key) timer = setTimeout(() => diagrams.ask(questionOf(page.state)), QUIET);
  }

  function ask() {
    askPlan(store.page);
    askMap(store.page);
    askDiagram(store.page);
  }

  return { ask, failed };
}
