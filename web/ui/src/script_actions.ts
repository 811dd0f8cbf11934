// The script and its waypoints: every change is a new text; the server reads it, draws it and says where its steps lie.
import { report } from "./actions";
import { api, ApiError } from "./api";
import { compose, inverse, product, rotate, about, plus, scaled } from "./math3";
import { insert_steps, move_step, remove_step, replace_step, type Edit } from "./script_text";
import { store, type ScriptState } from "./store";
import type { MoveStep, NamedFrame, Pose, Step, Vec3 } from "./types";

export function line_of(where: string | undefined): number | null {
  const match = /:(\d+)(?::\d+)?:?$/.exec(where ?? "") ?? /\bline (\d+)/.exec(where ?? "");
  return match ? Number(match[1]) : null;
}

function change(part: Partial<ScriptState>): void {
  const { script } = store.state;
  const failed = part.text !== undefined && part.text !== script.text ? null : script.failed; // another text has not been run
  store.set({ script: { ...script, failed, ...part } });
}

export function mark_failed(line: number | null): void {
  if (store.state.script.failed !== line) change({ failed: line });
}

// --- what the server makes of it ----------------------------------------------------------------------------------------

const has_steps = (text: string) => /^\s*-\s/m.test(text) || /steps:\s*\[/.test(text);

async function read(): Promise<void> {
  const { tab, script, snapshot } = store.state;
  const text = tab === "record" && has_steps(script.text) ? script.text : "";
  try {
    const steps = await api.waypoints(text, script.selected);
    if (store.state.script.text === text) change({ steps, problem: null });
    else if (text === "" && tab === "record" && store.state.script.text === script.text) change({ steps: [], problem: null });
  } catch (error) {
    if (!(error instanceof ApiError) || error.status >= 500) return report(error);
    if (error.status === 0 || store.state.script.text !== text) return;
    // A script of another task waits for its task; the scene that is open has its own.
    if (error.code === "other_task" && snapshot) return change({ problem: { message: error.message, line: null } });
    change({ problem: { message: error.message, line: line_of(error.where) } });
  }
}

let reading: Promise<void> | null = null;
let again = false;

/// Reads and draws the present text; resolves when the server has answered for the newest.
export function redraw(): Promise<void> {
  again = true;
  reading ??= (async () => {
    while (again) {
      again = false;
      await read();
    }
    reading = null;
  })();
  return reading;
}

// --- undo ---------------------------------------------------------------------------------------------------------------

interface Entry { text: string; selected: number | null; changed: boolean }
const most_entries = 200;
let undone: Entry[] = [], done: Entry[] = [];
const entry = (): Entry => ({ text: store.state.script.text, selected: store.state.script.selected, changed: store.state.script.changed });

/// Remembers the present text, so that undo comes back to it.
export function remember(): void {
  done.push(entry());
  if (done.length > most_entries) done.shift();
  undone = [];
}

function go_back(from: Entry[], to: Entry[]): void {
  const target = from.pop();
  if (!target) return;
  to.push(entry());
  change(target);
  void redraw();
}
export const undo = () => go_back(done, undone);
export const redo = () => go_back(undone, done);

// --- changes ------------------------------------------------------------------------------------------------------------

/// A text that came from elsewhere: nothing to undo to.
export function load_text(text: string, changed: boolean): void {
  done = [];
  undone = [];
  change({ text, changed, selected: null, problem: null });
  void redraw();
}

let typed_at = 0;
const one_entry_ms = 1200; // what is typed without a pause is undone together

export function type_text(text: string): void {
  const now = performance.now();
  if (now - typed_at > one_entry_ms) remember();
  typed_at = now;
  change({ text, changed: true });
  void redraw();
}

export function select(index: number | null): void {
  if (store.state.script.selected === index) return;
  change({ selected: index });
  void redraw();
}

const edited = (): Edit => ({ text: store.state.script.text, steps: store.state.script.steps, task: store.state.snapshot?.task ?? "" });

let edits: Promise<unknown> = Promise.resolve();

/// What an edit makes of the script: the text, and the step that is chosen then.
interface Edited { text: string; selected: number | null }

/// Cards belong to the text that the server could read; what it could not read is mended in the text first. One after the
/// other: each edit starts from what the one before has become, in its text, its steps and its choice.
function guarded(edit: (now: Edit, selected: number | null) => Edited, keep = true): Promise<void> {
  const next = edits.then(async () => {
    if (reading) await reading;
    const { problem, selected, text } = store.state.script;
    if (problem) throw new Error(`The script has an error${problem.line ? ` in line ${problem.line}` : ""}; mend it in the text first.`);
    const became = edit(edited(), selected);
    if (keep && became.text !== text) remember();
    change({ ...became, changed: true });
    await redraw();
  });
  edits = next.catch(() => undefined);
  return next;
}

export function insert(steps: Step[]): Promise<void> {
  return guarded((now, selected) => {
    const at = selected === null ? now.steps.length : Math.min(selected + 1, now.steps.length);
    return { text: insert_steps(now, at, steps), selected: at + steps.length - 1 };
  });
}
/// `edit` gets the step as it is when its turn comes: an edit before it, or the scene, may have changed it by then.
/// `keep`: an undo comes back to before it; false while a drag goes on.
export function edit_step(index: number, edit: (step: Step) => Step, keep = true): Promise<void> {
  return guarded((now) => ({ text: now.steps[index] ? replace_step(now, index, edit(now.steps[index])) : now.text, selected: index }), keep);
}
export function edit_move(index: number, edit: (step: MoveStep) => MoveStep, keep = true): Promise<void> {
  return edit_step(index, (step) => (step.kind === "move" ? edit(step) : step), keep);
}
export function remove(index: number): Promise<void> {
  return guarded((now, selected) => {
    if (!now.steps[index]) return { text: now.text, selected };
    const next = selected === null ? -1 : Math.min(selected > index ? selected - 1 : selected, now.steps.length - 2);
    return { text: remove_step(now, index), selected: next >= 0 ? next : null };
  });
}
export function reorder(from: number, to: number): Promise<void> {
  const { length } = store.state.script.steps;
  if (from === to || to < 0 || to >= length) return Promise.resolve();
  return guarded((now, selected) => (now.steps.length === length ? { text: move_step(now, from, to), selected: to } : { text: now.text, selected }));
}

// --- moves --------------------------------------------------------------------------------------------------------------

/// The same step with the tool elsewhere in the world.
export function at_world(step: MoveStep, world: Pose): MoveStep {
  const local = step.base ? compose(inverse(step.base), world) : world;
  return { ...step, ...local, world };
}
export function in_frame(step: MoveStep, frame: NamedFrame): MoveStep {
  const base: Pose = { position: frame.position, quaternion: frame.quaternion };
  return { ...at_world({ ...step, base }, step.world!), frame: frame.name, yaw_symmetry: 1 };
}
/// Along the tool's own z (into the scene) and turned about the tool's axes through its point.
export function shifted(step: MoveStep, along_z_m: number): MoveStep {
  const { position, quaternion } = step.world!;
  return at_world(step, { position: plus(position, scaled(rotate(quaternion, [0, 0, 1]), along_z_m)), quaternion });
}
export function turned(step: MoveStep, axis: Vec3, angle_deg: number): MoveStep {
  const { position, quaternion } = step.world!;
  return at_world(step, { position, quaternion: product(quaternion, about(axis, angle_deg)) });
}
/// A straight way in from `distance_m` before it.
export function with_approach(step: MoveStep, distance_m: number): MoveStep[] {
  return [{ ...shifted(step, -distance_m), path: "planned" }, { ...step, path: "linear" }];
}

export function selected_move(): { index: number; step: MoveStep } | null {
  const { selected, steps } = store.state.script;
  const step = selected === null ? undefined : steps[selected];
  return step?.kind === "move" && step.world && selected !== null ? { index: selected, step } : null;
}

// --- when to read and draw anew -----------------------------------------------------------------------------------------

const rest_ms = 300; // without a frame: the scene is at rest
const drafts = new Map<string, string>(); // what was changed for each task, while another one is open

export function start_script(): void {
  let task = "";
  const own = async () => {
    const wanted = store.state.snapshot?.task;
    if (!wanted) return;
    const text = await api.script(wanted);
    const { script, snapshot } = store.state;
    if (snapshot?.task === wanted && !script.changed && script.text !== text) load_text(text, false);
  };
  store.watch((s) => [s.snapshot?.task, s.snapshot?.variation, s.snapshot?.episode, s.connection === "live"] as const, (now, _variation, _episode, live) => {
    if (!now || !live) return;
    const { script } = store.state;
    if (now !== task) {
      if (task && script.changed) drafts.set(task, script.text);
      const draft = drafts.get(now);
      if (draft !== undefined) load_text(draft, true);
      else if (task) change({ changed: false, text: "", steps: [], selected: null, problem: null });
      task = now;
    }
    if (!store.state.script.changed) void own().catch(report);
  });
  const draw = () => {
    if (store.state.connection === "live" && store.state.script.text !== "") void redraw();
  };
  // Another placement, or another tab: the waypoints are drawn only where they are edited.
  store.watch((s) => [s.tab === "record", s.snapshot?.episode, s.connection === "live"] as const, draw);
  // What was moved took its waypoints along: the server draws them there, and there they are taken hold of.
  let rest: number | undefined;
  store.watch((s) => [s.tab === "record" && !s.snapshot?.recording.job, s.snapshot?.time_s] as const, (still) => {
    window.clearTimeout(rest);
    if (still) rest = window.setTimeout(draw, rest_ms);
  });
}

export async function load_own(): Promise<void> {
  const task = store.state.snapshot?.task;
  if (!task) return;
  const text = await api.script(task);
  drafts.delete(task);
  remember();
  change({ text, changed: false, selected: null });
  await redraw();
}
