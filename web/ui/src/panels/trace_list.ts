// Every prediction that is kept; a branched one stands under its parent's name.
import { act, close_trace, compare_with, remove_trace, select_trace } from "../actions";
import { fill, h } from "../dom";
import { clock, degrees, millimetres } from "../format";
import { store } from "../store";
import type { TraceEntry } from "../types";

/// On the shown trace: the way to its parent. On the others: put it beside the shown one.
function side_button(entry: TraceEntry, chosen: boolean, other: boolean): HTMLElement {
  const { parent } = entry;
  if (!chosen && store.state.trace) {
    return h("button", { type: "button", class: "icon small", "aria-pressed": String(other), title: "compare with the shown trace",
      "aria-label": `compare with ${entry.id}`, "data-testid": "trace-compare", onclick: () => void act(() => compare_with(entry.id)) }, "⇄");
  }
  if (!chosen || !parent) return h("span", { class: "no-button" });
  return h("button", { type: "button", class: "icon small", title: `branched from ${parent}: show it`, "aria-label": `show the parent ${parent}`,
    "data-testid": "trace-parent", onclick: () => void act(() => select_trace(parent)) }, "↰");
}

function row(entry: TraceEntry, chosen: boolean, other: boolean): HTMLElement {
  const error = entry.error ? `${millimetres(entry.error.position_m)} · ${degrees(entry.error.rotation_deg)}` : "no expert";
  const select = h("button", { type: "button", class: "trace-row", "aria-pressed": String(chosen), "data-testid": "trace-row", "data-id": entry.id,
    title: `${entry.instruction}\n${clock(entry.created)}`, onclick: () => void act(async () => (chosen ? close_trace() : select_trace(entry.id))) },
    h("i", { class: chosen ? "dot action" : other ? "dot other" : "dot none" }),
    h("span", { class: "mono" }, entry.id), h("span", { class: "quiet" }, entry.parent ? `from ${entry.parent}` : ""),
    h("span", { class: "quiet" }, `${entry.flow_steps} steps`),
    h("span", { class: entry.error ? "expert-text" : "quiet" }, error));
  return h("li", {}, select, side_button(entry, chosen, other),
    h("button", { type: "button", class: "icon small", title: "delete this trace", "aria-label": `delete trace ${entry.id}`,
      onclick: () => void act(() => remove_trace(entry.id)) }, "×"));
}

export function trace_list(): HTMLElement {
  const list = h("ul", { class: "traces", "data-testid": "traces", "aria-label": "predictions" });
  store.watch((s) => [s.traces, s.trace, s.other] as const, (traces, trace, other) => {
    const scroll = list.scrollTop;
    fill(list, ...traces.map((t) => row(t, t.id === trace?.id, t.id === other?.id)),
      traces.length === 0 && h("li", { class: "quiet none-yet" }, "No predictions yet."));
    list.scrollTop = scroll;
  });
  return list;
}
