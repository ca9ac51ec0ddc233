// What the page knows: the state that the reader set, with its history, and what the server answered to it.
//
// The store has no picture and asks nothing. Views draw what `page` holds; whatever can be told from it is a function
// here, so that it is told in one place.

/** Return what the server is to know of a state: all but the view. */
export function questionOf(state) {
  const { view: _view, ...rest } = state;
  return rest;
}

const keys = new WeakMap(); // no state is ever changed, so that its text can be kept

/** Return what a plan depends on, as a text to compare: everything but the view and the biased gait. */
export function planKey(state) {
  if (!keys.has(state)) {
    const { eta: _eta, ...rest } = questionOf(state);
    keys.set(state, JSON.stringify(rest));
  }
  return keys.get(state);
}

const isSame = (a, b) => planKey(a) === planKey(b) && a.eta === b.eta;
const MOST_STEPS = 500; // that can be undone

/**
 * Hold a page that begins with a state; `isNew` says that nothing is planned yet, so that a gait may be shown to try.
 *
 * `commit` makes one step that can be undone. `preview` changes the state without a step, as while dragging; the next
 * `commit` then makes one step from the state before the first preview. Undo and redo during a preview end it without a
 * step. Undo does not change the view. Everything else of the page is `put`.
 */
export function storeOf(first, isNew) {
  let page = {
    state: first,
    isHeld: false, // something is dragged
    canUndo: false,
    canRedo: false,
    isNew, // until a first change
    plan: null, // the newest answer
    planned: "", // the key of the state that it answers
    isPlanSlow: false, // the answer takes a while
    isGone: false, // the server does not answer
    ghost: null, // the plan of a gait to try
    table: null, // the report of a table that is opened
    tab: "plan", // or "table"
    sheet: "red", // of a map that follows the plan
    background: null, // of the map
    diagram: null, // roll–pitch
    diagrammed: "", // the question that it answers, as text
    isDiagramSlow: false,
  };
  let before = null; // the state before the first preview
  const past = [];
  const future = [];
  const listeners = [];

  /** Take a patch of the page; views that are drawn meanwhile see the whole of it. */
  function put(patch) {
    const next = { ...page, ...patch };
    next.isHeld = before !== null;
    next.canUndo = past.length > 0;
    next.canRedo = future.length > 0;
    if (planKey(next.state) !== planKey(page.state) || next.table) next.isNew = false;
    // A ghost flies on until there is an answer to show instead.
    const isAnswered = next.plan !== page.plan || next.table !== page.table;
    if (isAnswered && !next.isNew) next.ghost = null;
    const color = reportOf(next)?.color;
    if (color && !next.isHeld) next.sheet = color === "blue" ? "blue" : "red";
    page = next;
    for (const listener of listeners) listener();
  }

  function cancel() {
    const state = before;
    before = null;
    if (state) put({ state });
  }

  /** Go one step from one of the lists of states to the other. */
  function step(from, to) {
    if (before) return cancel();
    if (!from.length) return undefined;
    to.push(page.state);
    return put({ state: { ...from.pop(), view: page.state.view } });
  }

  function commit(patch = {}) {
    const from = before ?? page.state;
    const state = { ...page.state, ...patch };
    before = null;
    if (!isSame(from, state)) {
      past.push(from);
      if (past.length > MOST_STEPS) past.shift();
      future.length = 0;
    }
    put({ state });
  }

  return {
    get page() {
      return page;
    },
    subscribe: (listener) => listeners.push(listener),
    put,
    preview(patch) {
      before ??= page.state;
      put({ state: { ...page.state, ...patch } });
    },
    commit,
    cancel,
    /** End a preview, if there is one: it becomes a step. */
    settle() {
      if (before) commit();
    },
    look: (patch) => put({ state: { ...page.state, view: { ...page.state.view, ...patch } } }),
    undo: () => step(past, future),
    redo: () => step(future, past),
  };
}

// What can be told from a page ------------------------------------------------------------------------------------

/** Return the plan or the report of the table, whichever is shown. */
export function reportOf(page) {
  return page.tab === "table" ? page.table : page.plan;
}

/** Return the gait to try that a first visit shows, if it does. */
export function ghostOf(page) {
  return page.isNew ? page.ghost : null;
}

/** Return the report whose gait the pictures show; until the next answer that is the one of the state before. */
export function movingOf(page) {
  if (page.tab === "table") return page.table;
  return page.plan?.status === "planned" ? page.plan : page.ghost;
}

/** Return whether the plan of the present state is still to come. */
export function isPlanDue(page) {
  return page.planned !== planKey(page.state);
}

/** Return the sheet that the map shows. */
export function sheetOf({ state, sheet }) {
  if (state.view.sheet !== "auto") return state.view.sheet;
  return state.color === "auto" ? sheet : state.color;
}

/** Return what the server is to know for the map: for a table, its vehicle. */
export function mapQuestion(page) {
  const ofTable = page.tab === "table" ? page.table.map : null;
  const { vehicle, drag_ratio, coefficients } = ofTable ?? page.state;
  return { vehicle, drag_ratio, coefficients, sheet: sheetOf(page), shading: page.state.view.shading };
}

/** Return why the map is not what one may expect, or an empty text. */
export function mapNote(page) {
  const { state, plan, tab, background } = page;
  const notes = [background?.note];
  if (tab === "plan" && plan?.color === "blue" && state.color === "auto") {
    const where = sheetOf(page) === "blue" ? "now on the blue sheet, and so is the map" : "on the blue sheet";
    notes.unshift(`No red gait through these waypoints: the loop is ${where}.`);
  }
  return notes.filter(Boolean).join(" ");
}

/** Return what a roll–pitch diagram is to be asked for, as text; empty where there is none to ask for. */
export function diagramKey(page) {
  if (page.tab === "table" || page.plan?.status !== "planned" || isPlanDue(page)) return "";
  return JSON.stringify(questionOf(page.state));
}

/** Return the roll–pitch diagram to show, or null. */
export function diagramOf(page) {
  if (page.tab === "table") return page.table.diagram;
  return page.plan?.status === "planned" ? page.diagram : null;
}

/** Return whether another diagram is still to come. */
export function isDiagramDue(page) {
  if (page.tab === "table") return false;
  return isPlanDue(page) || (page.plan.status === "planned" && page.diagrammed !== diagramKey(page));
}

/**
 * Return a function that takes a page and draws it where one of the values that `pick` takes from it has changed.
 */
export function drawn(pick, draw) {
  let shown = null;
  return (page) => {
    const next = pick(page);
    if (shown?.every((value, k) => value === next[k])) return;
    shown = next;
    draw(page);
  };
}
