// Moving the tool by hand: keys and buttons held down become speeds, sent often enough that the server keeps going.
import { act, report } from "./actions";
import { api } from "./api";
import { LatestCall } from "./latest";
import { types_text } from "./keys";
import { insert } from "./script_actions";
import { store } from "./store";
import type { GripperStep, JogOptions, MoveStep, Vec3 } from "./types";

const every_ms = 40; // the server goes on for 300 ms without word
const full_m_s = 0.25, full_rad_s = 1.2;

export interface JogAxis { key: string; label: string; title: string; linear: Vec3; angular: Vec3 }
const moves = (key: string, label: string, title: string, linear: Vec3): JogAxis => ({ key, label, title, linear, angular: [0, 0, 0] });
const turns = (key: string, label: string, title: string, angular: Vec3): JogAxis => ({ key, label, title, linear: [0, 0, 0], angular });
export const jog_axes: JogAxis[] = [
  moves("w", "x+", "away from the robot", [1, 0, 0]), moves("s", "x−", "towards the robot", [-1, 0, 0]),
  moves("a", "y+", "to the robot's left", [0, 1, 0]), moves("d", "y−", "to the robot's right", [0, -1, 0]),
  moves("e", "z+", "up", [0, 0, 1]), moves("c", "z−", "down", [0, 0, -1]),
  turns("j", "yaw+", "turn about z", [0, 0, 1]), turns("l", "yaw−", "turn about z", [0, 0, -1]),
  turns("u", "rx+", "turn about x", [1, 0, 0]), turns("o", "rx−", "turn about x", [-1, 0, 0]),
  turns("y", "ry+", "turn about y", [0, 1, 0]), turns("h", "ry−", "turn about y", [0, -1, 0]),
];

export const jog_settings = { speed: 0.4, frame: "world" as JogOptions["frame"], may_touch: false };

const held = new Map<string, JogAxis>(); // by key, or by button
let timer = 0;

const sent = new LatestCall<JogOptions>(async (options) => {
  store.set({ teleop: await api.jog(options) });
}, (error) => {
  let_go();
  report(error);
});

function speeds(): JogOptions {
  const sum = (part: "linear" | "angular", full: number) =>
    [0, 1, 2].map((i) => Math.max(-1, Math.min(1, [...held.values()].reduce((total, axis) => total + axis[part][i]!, 0))) *
      full * jog_settings.speed) as Vec3;
  return { linear: sum("linear", full_m_s), angular: sum("angular", full_rad_s), frame: jog_settings.frame, may_touch: jog_settings.may_touch };
}

function hold(name: string, axis: JogAxis): void {
  if (held.has(name) || store.state.connection !== "live") return;
  held.set(name, axis);
  void sent.send(speeds());
  if (!timer) timer = window.setInterval(() => void sent.send(speeds()), every_ms);
}

function release(name: string): void {
  if (!held.delete(name)) return;
  if (held.size === 0) let_go();
}

/// Everything stops; the server is told, and would stop without word, too.
export function let_go(): void {
  const moving = timer !== 0;
  held.clear();
  clearInterval(timer);
  timer = 0;
  if (moving) void sent.send(speeds());
}

export function jog_button(button: HTMLButtonElement, axis: JogAxis): void {
  const name = `button ${axis.key}`;
  button.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    button.setPointerCapture(event.pointerId);
    hold(name, axis);
  });
  for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) button.addEventListener(end, () => release(name));
  // By keyboard: as long as Enter or Space is down.
  button.addEventListener("keydown", (event) => {
    if ((event.key === " " || event.key === "Enter") && !event.repeat) hold(name, axis);
  });
  button.addEventListener("keyup", () => release(name));
  button.addEventListener("blur", () => release(name));
}

export const fingers_open = () => (store.state.teleop?.openness ?? 1) > 0.5;

export async function toggle_gripper(): Promise<void> {
  let_go();
  store.set({ teleop: await api.gripper(fingers_open() ? 0 : 1) });
}

export async function undo_jog(): Promise<void> {
  let_go();
  store.set({ teleop: await api.undo_jog() });
}

const open_from = 0.95; // the benchmark's rule: anything narrower is closed, on something or on nothing

/// The present pose of the tool becomes a waypoint, and the fingers' a step where the script has them otherwise by then.
export async function mark_here(): Promise<void> {
  const [move, fingers] = (await api.mark()) as [MoveStep, GripperStep];
  const { selected, steps } = store.state.script;
  const so_far = steps.slice(0, selected === null ? steps.length : selected + 1).filter((step) => step.kind === "gripper").at(-1);
  const open = fingers.openness > open_from, script_open = (so_far?.openness ?? 1) > open_from;
  await insert(open === script_open ? [move] : [move, { kind: "gripper", openness: open ? 1 : 0 }]);
}

export function listen_to_jog_keys(): void {
  const axes = new Map(jog_axes.map((axis) => [axis.key, axis]));
  const once: Record<string, () => Promise<void>> = { g: toggle_gripper, k: mark_here, b: undo_jog };
  window.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || store.state.tab !== "record" || types_text(event.target)) return;
    const key = event.key.toLowerCase();
    const axis = axes.get(key);
    if (axis) {
      event.preventDefault();
      if (!event.repeat) hold(key, axis);
    } else if (once[key]) {
      event.preventDefault();
      if (!event.repeat) void act(once[key]);
    }
  });
  window.addEventListener("keyup", (event) => release(event.key.toLowerCase()));
  window.addEventListener("blur", let_go);
  document.addEventListener("visibilitychange", () => document.hidden && let_go());
  store.watch((s) => [s.tab, s.connection] as const, let_go);
}
