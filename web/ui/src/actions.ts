// What the page does: each action calls the server and writes the store. Failures become the notice line.
import { api, ApiError } from "./api";
import { LatestCall } from "./latest";
import { store, type PageState, type Tab } from "./store";
import type { Job, ServerEvent, TraceEntry } from "./types";

export function report(error: unknown): void {
  if (error instanceof ApiError) {
    if (error.status === 0) return; // the connection banner says it
    const advice = error.status === 401 ? " Open the address that flowscope printed, with its token." : "";
    store.set({ notice: { level: "error", message: `${error.message}${advice}`, where: error.where || error.code } });
  } else {
    store.set({ notice: { level: "error", message: error instanceof Error ? error.message : String(error), where: "" } });
  }
}

/// Runs one action; the control that started it is off meanwhile, so that a second click does nothing.
export async function act(action: () => Promise<unknown>, control?: HTMLButtonElement): Promise<void> {
  if (control) control.setAttribute("aria-busy", "true");
  if (store.state.notice) store.set({ notice: null });
  try {
    await action();
  } catch (error) {
    report(error);
  } finally {
    control?.removeAttribute("aria-busy");
  }
}

export function inform(message: string): void {
  store.set({ notice: { level: "info", message, where: "" } });
}

export function open_tab(tab: Tab): void {
  store.set({ tab });
}

export async function refresh_demos(): Promise<void> {
  const demos = await api.demos();
  const selected = demos.some((d) => d.id === store.state.selected_demo) ? store.state.selected_demo : null;
  store.set({ demos, selected_demo: selected });
}

/// A prediction that an event brought while the server was asked may be missing in its answer.
export async function refresh_traces(): Promise<void> {
  const before = store.state.traces;
  const answer = await api.traces();
  const meanwhile = store.state.traces.filter((t) => !before.includes(t) && !answer.some((a) => a.id === t.id));
  store.set({ traces: newest_first([...meanwhile, ...answer]) });
}

function newest_first(traces: TraceEntry[]): TraceEntry[] {
  return [...traces].sort((a, b) => b.created.localeCompare(a.created) || b.id.localeCompare(a.id));
}

/// After every (re)connection: what events do not carry. A state that an event brought meanwhile is newer than the answer.
export async function load_everything(): Promise<void> {
  const before = store.state.snapshot;
  const [answer, tasks, train] = await Promise.all([api.state(), api.tasks(), api.train()]);
  const snapshot = store.state.snapshot === before ? answer : store.state.snapshot;
  store.set({ snapshot, tasks, train, teleop: snapshot?.teleop ?? null });
  await Promise.all([refresh_demos(), refresh_traces()]);
  const shown = snapshot?.shown;
  if (shown && !store.state.trace) await select_trace(shown.trace, shown.step);
}

/// Starts an episode. The page knows of it when this resolves: what is done next must not take it for the one before.
export async function reset(task: string, variation: number, seed: number): Promise<void> {
  const answer = await api.reset(task, variation, seed);
  if (answer.episode > (store.state.snapshot?.episode ?? 0)) take_event({ type: "state", data: answer });
}

export function take_event(event: ServerEvent): void {
  switch (event.type) {
    case "state": {
      if (event.data.episode < (store.state.snapshot?.episode ?? 0)) break; // overtaken by the answer to a reset
      const before = store.state.snapshot?.shown;
      store.set({ snapshot: event.data, teleop: event.data.teleop ?? store.state.teleop });
      follow(event.data.shown ?? null, before ?? null);
      break;
    }
    case "train": {
      const known = store.state.train;
      const demos_changed = known !== null && known.demos !== event.data.demos;
      store.set({ train: { ...known, ...event.data } });
      if (demos_changed) refresh_demos().catch(report);
      break;
    }
    case "job":
      take_job(event.data);
      break;
    case "trace":
      store.set({ traces: newest_first([event.data, ...store.state.traces.filter((t) => t.id !== event.data.id)]) });
      break;
    case "log":
      if (event.data.level === "error") store.set({ notice: { level: "error", message: event.data.message, where: "" } });
      break;
  }
}

function take_job(job: Job): void {
  const before = store.state.jobs.get(job.id);
  if (before && is_over(before)) return; // an older message may come after a polled answer
  store.set({ jobs: new Map(store.state.jobs).set(job.id, job) });
  if (job.state === "done" && job.result?.demo) refresh_demos().catch(report);
}

export function is_over(job: Job): boolean {
  return job.state === "done" || job.state === "failed" || job.state === "cancelled";
}

/// A scene that rests sends no news: the end of the job is then known earlier than the end of the recording.
export function is_recording(state: PageState): boolean {
  const recording = state.snapshot?.recording;
  const job = recording ? state.jobs.get(recording.job) : undefined;
  return recording !== undefined && recording.running && !(job && is_over(job));
}

/// The job when it is over, whatever its end. Events bring it; a slow poll covers a lost connection.
export async function job_over(id: string): Promise<Job> {
  const ask = () => void api.job(id).then(take_job, () => undefined);
  const poll = window.setInterval(ask, 1500);
  ask();
  const job = await new Promise<Job>((resolve) => {
    const stop: { watching?: () => void } = {};
    stop.watching = store.watch((s) => [s.jobs.get(id)] as const, (now) => {
      if (!now || !is_over(now)) return;
      stop.watching?.();
      resolve(now);
    });
  });
  clearInterval(poll);
  return job;
}

// --- traces and their steps -------------------------------------------------------------------------------------------

type Shown = { trace: string; step: number };
const settle_ms = 500; // an event may have been on its way when the page itself moved

let moved_at = 0;
const shown = new LatestCall<Shown>(async ({ trace, step }) => {
  await api.show(trace, step);
  moved_at = performance.now();
}, report);

/// The server draws another step than the page shows: another page moved it, a reset cleared it, or a run predicted anew.
function follow(now: Shown | null, before: Shown | null): void {
  const { trace, step, playing } = store.state;
  if (playing || !shown.idle || performance.now() - moved_at < settle_ms) return;
  if (!now) {
    if (before && trace) store.set({ trace: null, other: null, step: 0 });
  } else if (now.trace !== trace?.id) {
    fetch_trace(now.trace).then((found) => store.set({ ...found, step: now.step }), report);
  } else if (now.step !== step) {
    store.set({ step: now.step });
  }
}

async function fetch_trace(id: string) {
  const trace = await api.trace(id);
  const other = trace.parent ? await api.trace(trace.parent.trace).catch(() => null) : null;
  return { trace, other };
}

export async function select_trace(id: string, step?: number): Promise<void> {
  const found = await fetch_trace(id);
  store.set({ ...found, playing: false });
  set_step(step ?? last_step());
}

/// Puts another trace's curves and end beside the shown one's; the same again takes them away.
export async function compare_with(id: string): Promise<void> {
  store.set({ other: store.state.other?.id === id ? null : await api.trace(id) });
}

export function close_trace(): void {
  const { trace } = store.state;
  store.set({ trace: null, other: null, step: 0, playing: false });
  moved_at = performance.now();
  if (trace) api.show(trace.id, null).catch(report);
}

export async function remove_trace(id: string): Promise<void> {
  if (store.state.trace?.id === id) close_trace();
  await api.remove_trace(id);
  store.set({ traces: store.state.traces.filter((t) => t.id !== id) });
}

export function last_step(): number {
  return (store.state.trace?.steps.length ?? 1) - 1;
}

export function set_step(step: number): void {
  const { trace } = store.state;
  if (!trace) return;
  const k = Math.min(last_step(), Math.max(0, Math.round(step)));
  store.set({ step: k });
  void shown.send({ trace: trace.id, step: k });
}

/// A move by hand; it ends playing.
export function go_to_step(step: number): void {
  if (store.state.playing) store.set({ playing: false });
  set_step(step);
}
