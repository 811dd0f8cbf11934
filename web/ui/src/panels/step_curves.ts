// Speed and distance over the steps, with a line at the shown one; another trace is drawn beside it, dashed.
import { go_to_step } from "../actions";
import { Chart } from "../charts";
import { chart, flow_color, palette } from "../colors";
import { h, show_if } from "../dom";
import { quantity_at, type Quantity } from "../playback";
import { store } from "../store";
import type { Trace, Vec3 } from "../types";
import { distance_m } from "../format";

function values(trace: Trace | null, quantity: Quantity, ts: number[]): (number | null)[] {
  const by_t = new Map(trace?.steps.map((step, k) => [step.t, quantity_at(trace, k, quantity) ?? null]));
  return ts.map((t) => by_t.get(t) ?? null);
}

function distances_mm(trace: Trace | null, target: Vec3 | undefined, ts: number[]): (number | null)[] {
  const by_t = new Map(trace?.steps.map((step) => [step.t, target ? 1000 * distance_m(step.pose.position, target) : null]));
  return ts.map((t) => by_t.get(t) ?? null);
}

function step_at(trace: Trace | null, t: number): number {
  if (!trace) return 0;
  const gaps = trace.steps.map((step) => Math.abs(step.t - t));
  return gaps.indexOf(Math.min(...gaps));
}

export function step_curves(): HTMLElement {
  const cursor = {
    cursor_x: () => store.state.trace?.steps[store.state.step]?.t,
    cursor_color: () => flow_color(store.state.trace?.steps[store.state.step]?.t ?? 0),
    on_pick: (t: number) => go_to_step(step_at(store.state.trace, t)),
    x_label: "flow time t",
  };
  const dash = [5, 4];
  const speed = new Chart({ test_id: "speed-chart", title: "Speed |v|", ...cursor, curves: [
    { label: "this", color: palette.action, unit: "", points: true }, { label: "other", color: chart.other, unit: "", dash }] });
  const distance = new Chart({ test_id: "distance-chart", title: "Distance [mm]", ...cursor, curves: [
    { label: "expert", color: palette.expert, unit: "", points: true },
    { label: "end", color: palette.action, unit: "" }, { label: "other", color: chart.other, unit: "", dash }] });
  const element = h("section", { class: "curves" }, speed.element, distance.element);
  store.watch((s) => [s.trace, s.other] as const, (trace, other) => {
    show_if(element, trace !== null);
    if (!trace) return;
    const ts = [...new Set([...trace.steps, ...(other?.steps ?? [])].map((step) => step.t))].sort((a, b) => a - b);
    speed.set([ts, values(trace, "speed", ts), values(other, "speed", ts)]);
    const expert = trace.expert?.position;
    distance.set([ts, distances_mm(trace, expert, ts), distances_mm(trace, trace.result.position, ts),
      distances_mm(other, expert ?? other?.result.position, ts)]);
  });
  store.watch((s) => [s.step] as const, () => {
    speed.redraw();
    distance.redraw();
  });
  return element;
}
