// Lines to the reader: what is wrong now, what stays to be known, what is only spoken.

import { byId } from "./elements.js";

function shownIn(id, text) {
  const line = byId(id);
  line.hidden = !text;
  line.firstElementChild.textContent = text ?? "";
}

/** Say what is wrong with what was just done; null, and the next change, take it away. */
export function problem(text) {
  shownIn("problem", text);
}

/** Say what stays until it is dismissed. */
export function notice(text) {
  shownIn("notice", text);
}

/** Inform the listeners of what a hand on the map did. */
export function say(text) {
  byId("moves-spoken").textContent = text;
}

/** Say that the server is gone and asked again in `pause` [s]; null: that it is back. */
export function gone(pause) {
  const line = byId("connection");
  line.hidden = pause === null;
  line.textContent =
    "The server does not answer; is “gaitgraph explore” still running? " +
    `Trying again in ${pause} s. Your work stays in the address.`;
}

export function bindLines() {
  byId("problem-close").addEventListener("click", () => problem(null));
  byId("notice-close").addEventListener("click", () => notice(null));
}
