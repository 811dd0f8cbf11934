// Every address of the server that the page calls, typed. Failures are ApiError with the server's code, message and place.
import type { Camera, DemoInfo, Job, JogOptions, NamedFrame, Picked, Problem, Snapshot, Step, TaskEntry, Teleop, Trace, TraceEntry, TrainReport, Vec3,
  ViewSettings } from "./types";

export class ApiError extends Error {
  constructor(readonly status: number, readonly code: string, message: string, readonly where = "") {
    super(message);
  }
}

/// Where a path of the server lies for this page: a proxy may show both below a path of its own.
export function address(path: string): string {
  return new URL(path.replace(/^\/+/, ""), document.baseURI).href;
}

async function call(method: string, path: string, body?: unknown): Promise<Response> {
  const init: RequestInit = { method, headers: { Accept: "application/json" } };
  if (body !== undefined) {
    init.headers = { ...init.headers, "Content-Type": "application/json" };
    init.body = JSON.stringify(body);
  }
  let response: Response;
  try {
    response = await fetch(address(path), init);
  } catch {
    throw new ApiError(0, "unreachable", "the server does not answer");
  }
  if (response.ok) return response;
  const problem = await response.json().then((json: { error?: Problem }) => json.error, () => undefined);
  throw new ApiError(response.status, problem?.code ?? String(response.status),
    problem?.message ?? response.statusText, /^[A-Z]+ \//.test(problem?.where ?? "") ? "" : problem?.where); // the call itself is no news here
}

async function json<T>(method: string, path: string, body?: unknown): Promise<T> {
  const response = await call(method, path, body);
  return (response.status === 204 ? undefined : await response.json()) as T;
}

const v1 = "api/v1";
const id_of = encodeURIComponent;

export interface PredictOptions { flow_steps: number; seed: number; samples: number; radius?: string; objective?: string; integrator?: string }
export interface BranchOptions { step: number; position?: Vec3; radius?: number; flow_steps?: number }
export interface TrainOptions {
  preset?: string; resume?: boolean; minutes?: number; steps?: number; tasks?: string[];
  objective?: string; backbone?: string; radius?: string; point_encoder?: boolean; grounded?: boolean;
}
export interface ExportOptions {
  kind: "png" | "mp4" | "strip" | "cloud"; trace?: string; demo?: string; step?: number; camera?: string; width?: number; height?: number;
  detectors?: boolean;
}
export interface CameraDrag { action: "rotate" | "pan" | "zoom"; dx: number; dy: number }
export interface Health { status: "loading" | "ready"; message?: string }

export const api = {
  /// "loading" is an answer here, not a failure.
  async health(): Promise<Health> {
    const response = await fetch(address("health"), { cache: "no-store" });
    return (await response.json()) as Health;
  },
  state: () => json<Snapshot>("GET", `${v1}/state`),
  tasks: () => json<{ tasks: TaskEntry[] }>("GET", `${v1}/tasks`).then((r) => r.tasks),
  script: (task: string) => call("GET", `${v1}/tasks/${id_of(task)}/script`).then((r) => r.text()),
  reset: (task: string, variation: number, seed: number) =>
    json<Snapshot>("POST", `${v1}/reset`, { task, variation, seed }),
  set_view: (id: string, change: Partial<ViewSettings>) => json<ViewSettings>("PUT", `${v1}/views/${id_of(id)}`, change),
  drag: (id: string, drag: CameraDrag) => json<ViewSettings>("POST", `${v1}/views/${id_of(id)}/drag`, drag),
  run_script: (what: { script: string } | { task: string }, record: boolean) =>
    json<{ job: string }>("POST", `${v1}/script`, { ...what, record }).then((r) => r.job),
  camera: (view: string) => json<Camera>("GET", `${v1}/views/${id_of(view)}/camera`),
  pick: (view: string, place: { u: number; v: number }) => json<Picked>("POST", `${v1}/views/${id_of(view)}/pick`, place),
  frames: () => json<{ frames: NamedFrame[] }>("GET", `${v1}/frames`).then((r) => r.frames),
  waypoints: (script: string, selected: number | null) =>
    json<{ steps: Step[] }>("PUT", `${v1}/waypoints`, { script, selected }).then((r) => r.steps),
  jog: (options: JogOptions) => json<Teleop>("POST", `${v1}/teleop/jog`, options),
  gripper: (openness: number) => json<Teleop>("POST", `${v1}/teleop/gripper`, { openness }),
  undo_jog: () => json<Teleop>("POST", `${v1}/teleop/undo`, {}),
  mark: () => json<{ steps: Step[] }>("POST", `${v1}/teleop/mark`, {}).then((r) => r.steps),
  save_teleop: (unfinished: boolean) => json<{ demo: string }>("POST", `${v1}/teleop/save`, { unfinished }).then((r) => r.demo),
  job: (id: string) => json<Job>("GET", `${v1}/jobs/${id_of(id)}`),
  cancel: (id: string) => json<void>("DELETE", `${v1}/jobs/${id_of(id)}`),
  demos: () => json<{ demos: DemoInfo[] }>("GET", `${v1}/demos`).then((r) => r.demos),
  remove_demo: (id: string) => json<void>("DELETE", `${v1}/demos/${id_of(id)}`),
  demo_picture: (id: string, keyframe: number, camera: string) =>
    address(`${v1}/demos/${id_of(id)}/picture?keyframe=${keyframe}&camera=${id_of(camera)}`),
  train: () => json<TrainReport>("GET", `${v1}/train`),
  train_start: (options: TrainOptions) => json<unknown>("POST", `${v1}/train`, { action: "start", ...options }),
  train_stop: () => json<unknown>("POST", `${v1}/train`, { action: "stop" }),
  predict: (options: PredictOptions) =>
    json<{ traces: string[] }>("POST", `${v1}/predict`, options).then((r) => r.traces),
  traces: () => json<{ traces: TraceEntry[] }>("GET", `${v1}/traces`).then((r) => r.traces),
  trace: (id: string) => json<Trace>("GET", `${v1}/traces/${id_of(id)}`),
  remove_trace: (id: string) => json<void>("DELETE", `${v1}/traces/${id_of(id)}`),
  show: (id: string, step: number | null) => json<void>("POST", `${v1}/traces/${id_of(id)}/show`, { step }),
  branch: (id: string, options: BranchOptions) =>
    json<{ trace: string }>("POST", `${v1}/traces/${id_of(id)}/branch`, options).then((r) => r.trace),
  execute: (id: string) => json<{ job: string }>("POST", `${v1}/traces/${id_of(id)}/execute`, {}).then((r) => r.job),
  export_media: (options: ExportOptions) => json<{ job: string }>("POST", `${v1}/export`, options).then((r) => r.job),
};
