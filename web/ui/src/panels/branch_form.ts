// Change the state at the shown step and let it run on; then both futures can be chosen. Or carry the prediction out.
import { act, inform, job_over, refresh_traces, select_trace } from "../actions";
import { api } from "../api";
import { h, number_input, read_number, show_if } from "../dom";
import { job_view } from "../job_view";
import { quantities, set_breakpoint, type Quantity } from "../playback";
import { store } from "../store";
import type { Vec3 } from "../types";

function breakpoint_row(): HTMLElement {
  const quantity = h("select", { "data-testid": "break-quantity", "aria-label": "stop playing at" },
    ...Object.entries(quantities).map(([value, { label, unit }]) => h("option", { value }, unit ? `${label} [${unit}]` : label)));
  const side = h("select", { "aria-label": "above or below" }, h("option", { value: "above" }, "above"), h("option", { value: "below" }, "below"));
  const value = number_input("break-value", "breakpoint value", 0, { step: 0.1 });
  const changed = () => {
    side.hidden = value.hidden = quantity.value === "none";
    const limit = value.valueAsNumber;
    set_breakpoint({ quantity: Number.isFinite(limit) ? (quantity.value as Quantity) : "none", above: side.value === "above", value: limit });
  };
  for (const control of [quantity, side, value]) control.addEventListener("input", changed);
  changed();
  return h("div", { class: "row tight" }, h("span", { class: "row-label" }, "Stop playing at"), quantity, side, value);
}

export function branch_form(): HTMLElement {
  const axes = (["x", "y", "z"] as const).map((name) => number_input(`branch-${name}`, `position ${name}`, 0, { min: -2, max: 3, step: 0.001 }));
  const radius = number_input("branch-radius", "radius", 0, { min: 0.01, max: 2, step: 0.001 });
  const branch = h("button", { type: "button", "data-testid": "branch", title: "change the state at this step and let the flow run on",
    onclick: () => void act(async () => {
      const { trace, step } = store.state;
      if (!trace) return;
      const now = trace.steps[step]!;
      const wanted_radius = read_number(radius);
      const id = await api.branch(trace.id, { step, position: axes.map(read_number) as Vec3,
        ...(Math.abs(wanted_radius - now.region.radius) > 5e-4 ? { radius: wanted_radius } : {}) });
      await refresh_traces();
      await select_trace(id);
      inform(`Branched at step ${step}; the dashed curves are its parent ${trace.id}.`);
    }, branch) }, "Branch from here");
  let moved_to = "";
  const job = job_view("execute-job", (over) => `Moved as ${moved_to} says; ${over.result?.success ? "the task succeeded." : "the task is not done yet."}`);
  const execute = h("button", { type: "button", class: "primary", "data-testid": "execute", title: "plan to the predicted keyframe and move the robot there",
    onclick: () => void act(async () => {
      const { trace } = store.state;
      if (!trace) return;
      const id = await api.execute(trace.id);
      moved_to = trace.id;
      job.follow(id);
      await job_over(id);
    }, execute) }, "Execute");
  const element = h("section", { class: "branch" },
    h("div", { class: "row tight" }, h("span", { class: "row-label" }, "State"), ...axes, h("span", { class: "unit" }, "m"),
      h("span", { class: "inside-text" }, "radius"), radius, h("span", { class: "unit" }, "m")),
    breakpoint_row(), h("div", { class: "row tight" }, branch, execute, job.element));
  store.watch((s) => [s.trace, s.step] as const, (trace, step) => {
    show_if(element, trace !== null);
    const now = trace?.steps[step];
    if (!trace || !now) return;
    axes.forEach((input, i) => {
      input.value = now.pose.position[i]!.toFixed(3);
    });
    radius.value = now.region.radius.toFixed(3);
    branch.disabled = step >= trace.steps.length - 1;
  });
  // Not with the trace: at the end of a motion the page goes to the next prediction, and the outcome must stay readable.
  store.watch((s) => [s.snapshot?.episode] as const, () => job.follow(null));
  return element;
}
