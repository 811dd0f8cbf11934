// The script's steps as cards: chosen, changed, moved about and taken away. The numbers are those in the picture.
import { act } from "../actions";
import { api } from "../api";
import { fill, h, number_input, read_number, set_options, show_if } from "../dom";
import { degrees, rpy_deg } from "../format";
import { from_rpy_deg } from "../math3";
import { edit_move, edit_step, in_frame, remove, reorder, select, shifted, turned } from "../script_actions";
import { store } from "../store";
import type { MoveStep, NamedFrame, Step, Vec3 } from "../types";

const in_out_m = 0.005;
const turn_deg = 15;
const millimetres = (metres: number) => String(Number((metres * 1000).toFixed(1)) || 0);

function summary(step: Step): string {
  if (step.kind === "gripper") return step.openness === 1 ? "gripper open" : step.openness === 0 ? "gripper close" : `gripper ${step.openness.toFixed(2)} open`;
  return `${step.position.map((v) => millimetres(v)).join(" ")} mm  ${rpy_deg(step.quaternion).map((a) => degrees(Math.round(a)).replace(".0", "")).join(" ")}`;
}

function chip(label: string, pressed: boolean, title: string, test_id: string, onclick: () => void): HTMLElement {
  return h("button", { type: "button", class: "tiny", "aria-pressed": String(pressed), title, "data-testid": test_id,
    onclick: (event: Event) => {
      event.stopPropagation();
      onclick();
    } }, label);
}

function card(step: Step, index: number, selected: boolean, failed: boolean): HTMLElement {
  const change = (edit: (step: MoveStep) => MoveStep) => void act(() => edit_move(index, edit));
  const chips = step.kind === "gripper"
    ? [chip(step.openness > 0.5 ? "→ close" : "→ open", false, "the other way", "card-flip",
      () => void act(() => edit_step(index, () => ({ kind: "gripper", openness: step.openness > 0.5 ? 0 : 1 }))))]
    : [chip(step.path === "linear" ? "straight" : "planned", step.path === "linear", "the way there: planned without collisions, or a straight line of the tool", "card-path",
      () => change((now) => ({ ...now, path: step.path === "linear" ? "planned" : "linear" }))),
    chip("touch", step.ignore_collisions, "may touch things on the way: press, push, pull", "card-touch", () => change((now) => ({ ...now, ignore_collisions: !step.ignore_collisions })))];
  const problem = step.kind === "move" ? step.problem : undefined;
  const element = h("li", { class: "waypoint", draggable: "true", tabindex: "0", role: "option", "aria-selected": String(selected), "data-testid": "waypoint-card",
    "data-kind": step.kind, "data-failed": String(failed), title: problem ?? (failed ? "the last run ended here" : ""), onclick: () => select(selected ? null : index) },
    h("b", { class: "number" }, index + 1),
    h("span", { class: problem ? "failure-text what" : "what" }, step.kind === "move" ? h("span", { class: "frame-name" }, step.frame) : null, problem ? "unknown frame" : summary(step)),
    ...chips,
    h("button", { type: "button", class: "icon small", "aria-label": `delete step ${index + 1}`, title: "delete (Delete)", "data-testid": "card-delete",
      onclick: (event: Event) => {
        event.stopPropagation();
        void act(() => remove(index));
      } }, "×"));
  element.addEventListener("keydown", (event) => {
    if (event.target !== element) return;
    const to = { ArrowUp: -1, ArrowDown: 1 }[event.key];
    if (event.key === "Enter") select(selected ? null : index);
    else if (event.key === "Delete") void act(() => remove(index));
    else if (to !== undefined && event.altKey) void act(() => reorder(index, index + to));
    else if (to !== undefined) element.parentElement?.querySelectorAll<HTMLElement>(".waypoint")[index + to]?.focus();
    else return;
    event.preventDefault();
    event.stopPropagation();
  });
  return element;
}

/// Drag a card between others.
function listen_to_drags(list: HTMLElement): void {
  let from: number | null = null;
  const index_of = (target: EventTarget | null) => {
    const at = target instanceof Element ? target.closest(".waypoint") : null;
    return at ? [...list.querySelectorAll(".waypoint")].indexOf(at) : -1;
  };
  const mark = (at: number) => list.querySelectorAll(".waypoint").forEach((e, i) => e.classList.toggle("drop-here", i === at && at !== from));
  list.addEventListener("dragstart", (event) => {
    from = index_of(event.target);
    event.dataTransfer?.setData("text/plain", String(from));
  });
  list.addEventListener("dragover", (event) => {
    if (from === null) return;
    event.preventDefault();
    mark(index_of(event.target));
  });
  list.addEventListener("drop", (event) => {
    event.preventDefault();
    const to = index_of(event.target);
    if (from !== null && to >= 0) void act(() => reorder(from!, to));
  });
  list.addEventListener("dragend", () => {
    from = null;
    mark(-1);
  });
}

/// Numbers and turns of the chosen move; it keeps its place below the list, so that nothing jumps.
function move_form(go: (step: MoveStep) => Promise<void>): HTMLElement {
  const chosen = (): { index: number; step: MoveStep } | null => {
    const { selected, steps } = store.state.script;
    const step = selected === null ? undefined : steps[selected];
    return step?.kind === "move" && selected !== null ? { index: selected, step } : null;
  };
  const change = (edit: (step: MoveStep) => MoveStep) => void act(async () => {
    const now = chosen();
    if (now) await edit_move(now.index, edit);
  });
  const place = (["x", "y", "z"] as const).map((axis) => number_input(`wp-${axis}`, `position ${axis} [mm]`, 0, { min: -3000, max: 3000, step: 0.1 }));
  const angles = (["roll", "pitch", "yaw"] as const).map((name) => number_input(`wp-${name}`, `${name} [°]`, 0, { min: -360, max: 360, step: 0.01 }));
  const typed = (inputs: HTMLInputElement[], edit: () => Partial<MoveStep>) => {
    for (const input of inputs) {
      input.addEventListener("change", () => {
        const values = edit();
        change((step) => ({ ...step, ...values }));
      });
    }
  };
  typed(place, () => ({ position: place.map((i) => read_number(i) / 1000) as Vec3 }));
  typed(angles, () => ({ quaternion: from_rpy_deg(angles.map(read_number) as Vec3) }));

  const frame = h("select", { "data-testid": "wp-frame", "aria-label": "frame", title: "what the waypoint follows to other placements" });
  let frames: NamedFrame[] = [];
  frame.addEventListener("change", () => {
    const wanted = frames.find((f) => f.name === frame.value);
    if (wanted) change((step) => (step.world ? in_frame(step, wanted) : { ...step, frame: wanted.name }));
  });
  const symmetry = h("select", { "data-testid": "wp-yaw", "aria-label": "yaws that are as good", title: "turns about the frame's z that are as good; the nearest is taken" },
    h("option", { value: "1" }, "this yaw"), h("option", { value: "2" }, "½ turns"), h("option", { value: "4" }, "¼ turns"), h("option", { value: "0" }, "any yaw"));
  symmetry.addEventListener("change", () => change((step) => ({ ...step, yaw_symmetry: Number(symmetry.value) })));
  const nudge = (label: string, title: string, test_id: string, edit: (step: MoveStep) => MoveStep) =>
    h("button", { type: "button", class: "tiny", title, "data-testid": test_id, onclick: () => change((step) => (step.world ? edit(step) : step)) }, label);

  const there = h("button", { type: "button", class: "tiny", title: "move the arm there now", "data-testid": "wp-go", onclick: () => void act(async () => {
    const now = chosen();
    if (now) await go(now.step);
  }, there) }, "go");
  const form = h("div", { class: "move-form", "data-testid": "move-form" },
    h("div", { class: "row tight" }, frame, symmetry, there,
      nudge("in", "5 mm the way the hand points", "wp-in", (s) => shifted(s, in_out_m)), nudge("out", "5 mm back", "wp-out", (s) => shifted(s, -in_out_m)),
      nudge("↺", "15° about the tool's z (Alt+wheel in the picture)", "wp-turn-left", (s) => turned(s, [0, 0, 1], -turn_deg)),
      nudge("↻", "15° about the tool's z (Alt+wheel in the picture)", "wp-turn-right", (s) => turned(s, [0, 0, 1], turn_deg)),
      nudge("tilt−", "tilt 15° about the fingers' axis (Alt+Shift+wheel)", "wp-tilt-back", (s) => turned(s, [0, 1, 0], -turn_deg)),
      nudge("tilt+", "tilt 15° about the fingers' axis (Alt+Shift+wheel)", "wp-tilt", (s) => turned(s, [0, 1, 0], turn_deg))),
    h("div", { class: "row tight" }, ...place, h("span", { class: "unit" }, "mm"), ...angles, h("span", { class: "unit" }, "°")));
  store.watch((s) => [s.script.steps, s.script.selected] as const, () => {
    const now = chosen();
    form.classList.toggle("off", !now);
    for (const control of form.querySelectorAll<HTMLInputElement>("input, select, button")) control.disabled = !now;
    if (!now) return;
    now.step.position.forEach((v, i) => {
      if (document.activeElement !== place[i]) place[i]!.value = millimetres(v);
    });
    rpy_deg(now.step.quaternion).forEach((a, i) => {
      if (document.activeElement !== angles[i]) angles[i]!.value = String(Number(a.toFixed(2)) || 0);
    });
    const known = frames.some((f) => f.name === now.step.frame) ? frames : [...frames, { name: now.step.frame }];
    set_options(frame, known.map((f) => ({ value: f.name, text: f.name })), now.step.frame);
    symmetry.value = String([0, 1, 2, 4].includes(now.step.yaw_symmetry) ? now.step.yaw_symmetry : 1);
  });
  store.watch((s) => [s.tab === "record" && s.script.selected !== null, s.snapshot?.episode] as const, (wanted) => {
    if (wanted) void api.frames().then((found) => { frames = found; }, () => undefined);
  });
  return form;
}

/// `go` moves the arm to a step's pose.
export function waypoint_cards(go: (step: MoveStep) => Promise<void>): HTMLElement {
  const list = h("ol", { class: "waypoints", role: "listbox", "aria-label": "waypoints", "data-testid": "waypoints" });
  const error = h("p", { class: "failure-text problem", "data-testid": "script-problem" });
  listen_to_drags(list);
  store.watch((s) => [s.script.steps, s.script.selected, s.script.failed] as const, (steps, selected, failed) => {
    const focused = document.activeElement?.closest(".waypoint");
    const at = focused ? [...list.querySelectorAll(".waypoint")].indexOf(focused) : -1;
    const { scrollTop } = list;
    fill(list, ...steps.map((step, i) => card(step, i, i === selected, failed !== null && step.line === failed)));
    if (steps.length === 0) fill(list, h("li", { class: "quiet none" }, "No waypoints yet. Choose “Click in picture” and click on a thing, or move the tool by hand and press k."));
    list.scrollTop = scrollTop;
    const cards = list.querySelectorAll<HTMLElement>(".waypoint");
    if (at >= 0) cards[Math.min(at, cards.length - 1)]?.focus();
    if (selected !== null) cards[selected]?.scrollIntoView({ block: "nearest" });
  });
  store.watch((s) => [s.script.problem] as const, (problem) => {
    show_if(error, problem !== null);
    fill(error, problem ? problem.message : "");
  });
  return h("div", { class: "cards-box" }, error, list, move_form(go));
}
