// A gait table that is opened: its bar, and the choice between the plan and the table.

import { startOf } from "./address.js";
import { byId } from "./elements.js";
import { bindFile } from "./files.js";
import { problem } from "./lines.js";
import { questionOf } from "./store.js";

/** Bind the opening of tables, and return the function that draws their bar. `on` has commit(patch), failed(error). */
export function tableViewIn(setup, store, on) {
  function close() {
    store.put({ table: null, tab: "plan" });
    byId("open").focus();
  }

  bindFile(setup.most_bytes, {
    onReport(table) {
      problem(null);
      store.put({ table, tab: "table" });
    },
    onError: on.failed,
  });
  byId("tab-plan").addEventListener("click", () => store.put({ tab: "plan" }));
  byId("tab-table").addEventListener("click", () => store.put({ tab: "table" }));
  byId("close-table").addEventListener("click", close);
  byId("use-request").addEventListener("click", () => {
    const asked = questionOf({ ...startOf(setup), ...store.page.table.request });
    close();
    on.commit(asked);
  });

  return ({ table, tab }) => {
    byId("tabs").hidden = byId("table-bar").hidden = !table;
    byId("tab-plan").setAttribute("aria-pressed", String(tab === "plan"));
    byId("tab-table").setAttribute("aria-pressed", String(tab === "table"));
    byId("table-name").textContent = table?.name ?? "";
    byId("use-request").hidden = !table?.request;
  };
}
