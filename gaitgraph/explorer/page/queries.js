// Queries to the server: only the latest answer counts; a server that does not answer is asked again.

class Refused extends Error {}
export class Gone extends Error {}

async function answerOf(path, options) {
  let response;
  try {
    response = await fetch(path, { cache: "no-store", ...options });
  } catch (error) {
    if (error.name === "AbortError") throw error;
    throw new Gone("the server does not answer");
  }
  if (response.ok) return response;
  let line = `the server answered ${response.status}`;
  try {
    line = (await response.json()).error ?? line;
  } catch {
    // The answer is not JSON; the status is shown.
  }
  throw new Refused(line);
}

const jsonOptions = (body, signal) => ({
  method: "POST",
  headers: { "Content-Type": "application/json" },
  body: JSON.stringify(body),
  signal,
});

export async function setupOf() {
  return (await answerOf("api/setup")).json();
}

/** Return the plan of a state, beside those that `latest` asks for. */
export async function planOf(state) {
  return (await answerOf("api/plan", jsonOptions(state))).json();
}

export async function tableReport(file) {
  const path = `api/table?name=${encodeURIComponent(file.name)}`;
  const options = { method: "POST", headers: { "Content-Type": "application/octet-stream" }, body: file };
  return (await answerOf(path, options)).json();
}

/** Return the bytes of a gait in one format, and the name that the server gives them. */
export async function download(state, suffix) {
  const response = await answerOf("api/download", jsonOptions({ state, suffix }));
  const named = /filename="?([^";]+)"?/.exec(response.headers.get("Content-Disposition") ?? "");
  return { blob: await response.blob(), name: named ? named[1] : `gait${suffix}` };
}

/**
 * Return a function that asks `path`, of which only the latest answer counts.
 *
 * A new query aborts the one before. While dragging (`live`), a query younger than `patience` [ms] is not aborted: the
 * new one waits for its answer, so that the page follows the drag.
 */
export function latest(path, { onAnswer, onError, onWaiting = () => {}, patience = 150 }) {
  let flight = null;
  let waiting = null;
  let timer = 0;

  async function send(body) {
    const mine = { controller: new AbortController(), since: performance.now() };
    flight = mine;
    clearTimeout(timer);
    timer = setTimeout(() => onWaiting(true), patience);
    try {
      const answer = await (await answerOf(path, jsonOptions(body, mine.controller.signal))).json();
      if (flight === mine) onAnswer(answer, body);
    } catch (error) {
      if (error.name !== "AbortError" && flight === mine) onError(error, body);
    } finally {
      if (flight === mine) {
        flight = null;
        clearTimeout(timer);
        onWaiting(false);
        const next = waiting;
        waiting = null;
        if (next) send(next);
      }
    }
  }

  return {
    ask(body, live = false) {
      if (flight && live && performance.now() - flight.since < patience) {
        waiting = body;
        return;
      }
      flight?.controller.abort();
      waiting = null;
      send(body);
    },
    stop() {
      flight?.controller.abort();
      flight = null;
      waiting = null;
      clearTimeout(timer);
      onWaiting(false);
    },
  };
}

const LONGEST_PAUSE = 15; // between two tries [s]
const wait = (seconds) => new Promise((done) => setTimeout(done, seconds * 1000));

/** Wait until the server answers again; `onTry` is told how long it is until the next try [s]. */
export async function untilBack(onTry) {
  for (let pause = 1; ; pause = Math.min(LONGEST_PAUSE, 2 * pause)) {
    onTry(pause);
    await wait(pause);
    try {
      await setupOf();
      return;
    } catch {
      // Not yet
    }
  }
}
