// Messages: problems and notices in lines of the page, and announcements for screen readers.

import { byId } from "./elements.js";

function shownIn(id, text) {
  const line = byId(id);
  line.hidden = !text;
  line.firstElementChild.textContent = text ?? "";
}

/** Show a problem with the last action; null, or the next change, removes it. */
export function problem(text) {
  shownIn("problem", text);
}

/** Show a notice until it is dismissed. */
export function notice(text) {
  shownIn("notice", text);
}

/** Announce an action on the map to screen readers. */
export function say(text) {
  byId("moves-spoken").textContent = text;
}

/** Show that the server does not answer and is asked again in `pause` [s]; null removes the line. */
export function gone(pause) {
  const line = byId("connection");
  line.hidden = pause === null;
  line.textContent =
    "The server does not answer. Check that “gaitgraph explore” is still running. " +
    `Next try in ${pause} s. Your work is kept in the address.`;
}

export function bindLines() {
  byId("problem-close").addEventListener("click", () => problem(null));
  byId("notice-close").addEventListener("click", () => notice(null));
}
