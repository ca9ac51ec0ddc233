// Files: a table that is opened or dropped, and downloads of the planned gait.

import { byId, html } from "./elements.js";
import { problem, say } from "./lines.js";
import { download, tableReport } from "./queries.js";

/** Open a file from the button or by drag and drop; `onReport` gets the answer of the server. */
export function bindFile(mostBytes, { onReport, onError }) {
  const input = byId("file");
  const hint = byId("drop-hint");

  async function open(file) {
    if (!file) return;
    if (file.size > mostBytes) {
      problem(`${file.name} must have at most ${mostBytes} bytes, got ${file.size}`);
      return;
    }
    byId("main").classList.add("waiting");
    try {
      onReport(await tableReport(file));
    } catch (error) {
      onError(error);
    } finally {
      byId("main").classList.remove("waiting");
    }
  }

  byId("open").addEventListener("click", () => input.click());
  input.addEventListener("change", () => {
    open(input.files[0]);
    input.value = ""; // so that the same file can be opened again
  });
  addEventListener("dragover", (event) => {
    if (!event.dataTransfer?.types.includes("Files")) return;
    event.preventDefault();
    hint.hidden = false;
  });
  addEventListener("dragleave", (event) => {
    if (!event.relatedTarget) hint.hidden = true;
  });
  addEventListener("drop", (event) => {
    hint.hidden = true;
    if (!event.dataTransfer?.files.length) return;
    event.preventDefault();
    open(event.dataTransfer.files[0]);
  });
}

async function save(state, suffix, onError) {
  byId("download").open = false;
  try {
    const { blob, name } = await download(state, suffix);
    const link = html("a", { href: URL.createObjectURL(blob), download: name });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
    say(`${name} saved`);
  } catch (error) {
    onError(error);
  }
}

/** Fill the menu of formats; `question` returns the state to save. */
export function bindDownloads(formats, question, onError) {
  const items = formats.map(({ suffix, name, why_not: why }) =>
    html(
      "li",
      {},
      html(
        "button",
        {
          type: "button",
          "data-suffix": suffix,
          "data-available": !why,
          disabled: true,
          "aria-describedby": why ? `why${suffix}` : null,
          onclick: () => save(question(), suffix, onError),
        },
        name,
        html("span", { class: "suffix" }, suffix),
      ),
      why ? html("p", { class: "small", id: `why${suffix}` }, why) : null,
    ),
  );
  byId("formats").append(...items);
}

/** Close the menus with Escape, or by a press elsewhere. */
export function bindMenus() {
  for (const menu of document.querySelectorAll(".menu")) {
    addEventListener("pointerdown", (event) => {
      if (!menu.contains(event.target)) menu.open = false;
    });
    menu.addEventListener("keydown", (event) => {
      if (event.key !== "Escape" || !menu.open) return;
      menu.open = false;
      menu.firstElementChild.focus();
    });
  }
}

/** Let the available formats be chosen, or none while there is no gait. */
export function allowDownloads(allowed) {
  for (const item of document.querySelectorAll("#formats button[data-available]")) item.disabled = !allowed;
}
