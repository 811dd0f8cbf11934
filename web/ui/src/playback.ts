// Plays the steps of the shown trace, about 3 s for a whole flow, and stops at the end or at a breakpoint.
import { inform, last_step, set_step } from "./actions";
import { distance_m, norm } from "./format";
import { store } from "./store";
import type { Trace } from "./types";

export type Quantity = "none" | "speed" | "expert_mm" | "points" | "jump_mm";
export interface Breakpoint { quantity: Quantity; above: boolean; value: number }

export const quantities: Record<Quantity, { label: string; unit: string }> = {
  none: { label: "none", unit: "" },
  speed: { label: "speed |v|", unit: "" },
  expert_mm: { label: "to expert", unit: "mm" },
  points: { label: "points inside", unit: "" },
  jump_mm: { label: "jump between steps", unit: "mm" },
};

/// The quantity at a step; undefined where it has no meaning (no expert, no step before).
export function quantity_at(trace: Trace, k: number, quantity: Quantity): number | undefined {
  const step = trace.steps[k];
  if (!step) return undefined;
  if (quantity === "speed") return k < trace.steps.length - 1 ? norm(step.velocity) : undefined;
  if (quantity === "points") return step.region.points;
  if (quantity === "expert_mm") return trace.expert ? 1000 * distance_m(step.pose.position, trace.expert.position) : undefined;
  const before = trace.steps[k - 1];
  if (quantity === "jump_mm" && before) return 1000 * distance_m(step.pose.position, before.pose.position);
  return undefined;
}

export function hits(trace: Trace, k: number, stop: Breakpoint): boolean {
  const value = quantity_at(trace, k, stop.quantity);
  return value !== undefined && (stop.above ? value > stop.value : value < stop.value);
}

let breakpoint: Breakpoint = { quantity: "none", above: true, value: 0 };
let timer = 0;

export function set_breakpoint(next: Breakpoint): void {
  breakpoint = next;
}

export function toggle_play(): void {
  if (!store.state.trace) return;
  if (store.state.playing) {
    store.set({ playing: false });
    return;
  }
  if (store.state.step >= last_step()) set_step(0);
  store.set({ playing: true });
}

function advance(): void {
  const { playing, trace, step } = store.state;
  if (!playing || !trace) return;
  const next = step + 1;
  set_step(next);
  if (hits(trace, next, breakpoint)) {
    store.set({ playing: false });
    inform(`Stopped at step ${next}: ${quantities[breakpoint.quantity].label} is ${breakpoint.above ? "above" : "below"} ` +
      `${breakpoint.value} ${quantities[breakpoint.quantity].unit}`.trimEnd());
  } else if (next >= last_step()) {
    store.set({ playing: false });
  }
}

export function start_playback(): void {
  store.watch((s) => [s.playing, s.trace] as const, (playing, trace) => {
    clearInterval(timer);
    if (playing && trace) timer = window.setInterval(advance, Math.max(120, 3000 / trace.steps.length));
  });
}
