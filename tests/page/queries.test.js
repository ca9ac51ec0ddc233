// Queries of the explorer's page: of those to one path only the newest answer counts.

import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";
import { setTimeout as pause } from "node:timers/promises";

import { Gone, latest, untilBack } from "../../gaitgraph/explorer/page/queries.js";

let asked = [];

beforeEach(() => {
  asked = [];
  globalThis.fetch = (path, { body, signal }) =>
    new Promise((resolve, reject) => {
      const query = { body: JSON.parse(body), isAborted: false };
      query.answer = (value, ok = true) => resolve({ ok, status: 400, json: async () => value });
      query.fail = reject;
      asked.push(query);
      signal.addEventListener("abort", () => {
        query.isAborted = true;
        reject(new DOMException("", "AbortError"));
      });
    });
});

/** Return a query with a patience [ms], and the list of what it told. */
function watched(patience) {
  const told = [];
  const query = latest("api/plan", {
    onAnswer: (answer, body) => told.push([body, answer]),
    onError: (error, body) => told.push([body, error]),
    patience,
  });
  return { query, told };
}

test("a new query aborts the one before, whose answer is not told", async () => {
  const { query, told } = watched(1000);
  query.ask(1);
  query.ask(2);
  assert.deepEqual(asked.map((one) => one.isAborted), [true, false]);
  asked[1].answer("two");
  await pause(1);
  assert.deepEqual(told, [[2, "two"]]);
});

test("while dragging the page follows: a young query is answered, and then the newest one asked", async () => {
  const { query, told } = watched(1000);
  for (const body of [1, 2, 3]) query.ask(body, true);
  assert.equal(asked.length, 1);
  asked[0].answer("one");
  await pause(1);
  asked[1].answer("three");
  await pause(1);
  assert.deepEqual(told, [[1, "one"], [3, "three"]]);
});

test("a query that takes long is aborted by the next move of a drag", async () => {
  const { query, told } = watched(5);
  query.ask(1, true);
  await pause(20);
  query.ask(2, true);
  assert.deepEqual(asked.map((one) => one.isAborted), [true, false]);
  asked[1].answer("two");
  await pause(1);
  assert.deepEqual(told, [[2, "two"]]);
});

test("what is stopped tells nothing, and neither does what waited behind it", async () => {
  const { query, told } = watched(1000);
  query.ask(1, true);
  query.ask(2, true);
  query.stop();
  await pause(1);
  assert.deepEqual([asked.length, told], [1, []]);
});

test("a refusal has the server's reason; no answer at all is another error", async () => {
  const { query, told } = watched(1000);
  query.ask(1);
  asked[0].answer({ error: "waypoints must be a list" }, false);
  await pause(1);
  query.ask(2);
  asked[1].fail(new TypeError("Failed to fetch"));
  await pause(1);
  const [[, refused], [, gone]] = told;
  assert.equal(refused.message, "waypoints must be a list");
  assert.deepEqual([refused instanceof Gone, gone instanceof Gone], [false, true]);
});

test("a server that is gone is asked again after 1, 2, 4 seconds", async (context) => {
  context.mock.timers.enable({ apis: ["setTimeout"] });
  let tries = 0;
  globalThis.fetch = async () => {
    tries += 1;
    if (tries < 3) throw new TypeError("Failed to fetch");
    return { ok: true, json: async () => ({}) };
  };
  const pauses = [];
  const back = untilBack((seconds) => pauses.push(seconds));
  for (const seconds of [1, 2, 4]) {
    context.mock.timers.tick(seconds * 1000);
    for (let k = 0; k < 20; k += 1) await null;
  }
  await back;
  assert.deepEqual([pauses, tries], [[1, 2, 4], 3]);
});
