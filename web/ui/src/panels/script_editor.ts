// The script as text, with line numbers; the line of an error is marked.
import { act } from "../actions";
import { fill, h } from "../dom";
import { redo, type_text, undo } from "../script_actions";
import { store } from "../store";

export function script_editor(): HTMLElement {
  const gutter = h("div", { class: "gutter", "aria-hidden": "true" });
  const text = h("textarea", { class: "script", spellcheck: "false", wrap: "off", "data-testid": "script", "aria-label": "waypoint script (YAML)" });
  let failed_line: number | null = null;
  const number_lines = () => {
    const lines = text.value.split("\n").length;
    fill(gutter, ...Array.from({ length: lines }, (_, i) =>
      h("span", i + 1 === failed_line ? { class: "failed", "data-testid": "failed-line" } : {}, i + 1)));
    gutter.scrollTop = text.scrollTop;
  };
  const mark = (line: number | null) => {
    if (line === failed_line) return;
    failed_line = line;
    number_lines();
    if (line !== null && document.activeElement !== text) {
      text.scrollTop = Math.max(0, (line - 4) * parseFloat(getComputedStyle(text).lineHeight));
    }
  };
  text.addEventListener("input", () => {
    number_lines();
    void act(async () => type_text(text.value));
  });
  // What the cards changed is undone here, too: a browser forgets its own history when a text is set.
  text.addEventListener("keydown", (event) => {
    if (!(event.ctrlKey || event.metaKey) || event.key.toLowerCase() !== "z") return;
    event.preventDefault();
    (event.shiftKey ? redo : undo)();
  });
  text.addEventListener("scroll", () => {
    gutter.scrollTop = text.scrollTop;
  });
  store.watch((s) => [s.script.text] as const, (now) => {
    if (text.value === now) return;
    text.value = now;
    number_lines();
  });
  store.watch((s) => [s.script.problem?.line ?? s.script.failed] as const, (line) => mark(line));
  number_lines();
  return h("div", { class: "editor" }, gutter, text);
}
