// The loss by its parts, and the held-out error of each task.
import { fill, h, set_text, show_if } from "../dom";
import { degrees, loss } from "../format";
import { store } from "../store";

export function loss_parts(): HTMLElement {
  const line = h("p", { class: "quiet parts", "data-testid": "train-parts" });
  store.watch((s) => [s.train] as const, (train) => {
    show_if(line, Boolean(train && train.step > 0));
    if (!train) return;
    const skipped = train.skipped > 0 ? `; ${train.skipped} steps skipped, their loss was not finite` : "";
    set_text(line, `loss of position ${loss(train.loss_position)}, rotation ${loss(train.loss_rotation)}, openness ${loss(train.loss_open)}${skipped}`);
  });
  return line;
}

export function task_errors(): HTMLElement {
  const body = h("tbody", {});
  const table = h("table", { class: "task-errors", "data-testid": "task-errors" },
    h("thead", {}, h("tr", {}, ...["held-out keyframes of", "position", "rotation", ""].map((text) => h("th", {}, text)))), body);
  store.watch((s) => [s.train?.validation.tasks] as const, (tasks = []) => {
    show_if(table, tasks.length > 1); // one task alone is what the figures say already
    fill(body, ...tasks.map((t) => h("tr", {}, h("td", {}, t.task.replaceAll("_", " ")), h("td", {}, t.position_mm === null ? "–" : `${t.position_mm.toFixed(1)} mm`),
      h("td", {}, t.rotation_deg === null ? "–" : degrees(t.rotation_deg)), h("td", { class: "quiet" }, `${t.keyframes} keyframes`))));
  });
  return table;
}
