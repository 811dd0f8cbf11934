// The wire as it is: field names of the server's values, metres, radians, seconds unless a name says otherwise.
export type Vec3 = [number, number, number];
export type Quaternion = [number, number, number, number]; // w, x, y, z

export interface TaskEntry { name: string; variations: number; instructions: string[] }
export interface SuccessTerm {
  name: string; met: boolean; value: string;
  path: string; // place in the task's success tree, "all/1/in_order/0"
  measured: number | null; threshold: number | null; unit: string; wanted: "above" | "at most";
  first_met_s: number | null;
}
export interface Orbit { azimuth_deg: number; elevation_deg: number; distance_m: number; lookat: Vec3; fovy_deg: number }
export interface ViewSettings {
  id: string; camera: string | null; orbit: Orbit; width: number; height: number; overlays: boolean; detectors: boolean;
}
export interface TaskError { task: string; position_mm: number | null; rotation_deg: number | null; keyframes: number }
/// null: nothing is held out
export interface Validation { position_mm: number | null; rotation_deg: number | null; keyframes: number; tasks: TaskError[] }
export interface TrainStatus {
  step: number; loss: number; loss_flow: number; loss_position: number; loss_rotation: number; loss_open: number; skipped: number;
  samples_per_s: number; minutes: number; demos: number; validation: Validation;
}
export interface TrainReport extends TrainStatus {
  running: boolean;
  loss_history: [step: number, loss: number][];
  validation_history: [step: number, position_mm: number, rotation_deg: number][];
  error?: string | null;
  left_out?: { id: string; problem: string }[];
}
export interface Snapshot {
  task: string; variation: number; seed: number; instruction: string;
  views: ViewSettings[]; cameras: string[];
  episode: number; time_s: number; success: boolean; terms: SuccessTerm[];
  recording: { running: boolean; job: string };
  training: boolean; train: TrainStatus;
  policy: { loaded: boolean; file: string; generation: number };
  viewers: number;
  rendering_error: string | null;
  shown?: { trace: string; step: number } | null;
  teleop?: Teleop;
}
export interface Pose { position: Vec3; quaternion: Quaternion }
export interface MoveStep extends Pose {
  kind: "move"; frame: string; path: "linear" | "planned"; ignore_collisions: boolean; yaw_symmetry: number;
  line?: number; world?: Pose; base?: Pose; problem?: string;
}
export interface GripperStep { kind: "gripper"; openness: number; line?: number }
export type Step = MoveStep | GripperStep;
export interface Camera {
  name: string; width: number; height: number; fx: number; fy: number; cx: number; cy: number; world_from_camera: Pose;
}
export type Approach = "above" | "normal" | "middle";
export interface Picked {
  point: Vec3; normal: Vec3; body: string; geom: string; depth_m: number;
  proposals: { approach: Approach; step: MoveStep; world: Pose }[];
}
export interface NamedFrame extends Pose { name: string }
export interface Teleop extends Pose {
  openness: number; jog: "still" | "moving" | "blocked" | "unreachable"; message: string;
  frames: number; strokes: number; marks: number; by_hand: boolean; success: boolean;
}
export interface JogOptions { linear: Vec3; angular: Vec3; frame: "world" | "tool"; may_touch: boolean }
export interface Problem { code: string; message: string; where?: string }
export interface Job {
  id: string; kind: string; state: "queued" | "running" | "done" | "failed" | "cancelled";
  progress: number; message: string;
  result?: { demo?: string; url?: string; path?: string; success?: boolean } | null;
  error?: Problem | null;
}
export interface DemoInfo {
  id: string; task: string; variation: number; seed: number; instruction: string;
  created: string; frames: number; keyframes: number; bytes: number;
  robot?: string | null; scene?: string | null; success?: boolean | null; // null: the file does not say
}
export interface PoseError { position_m: number; rotation_deg: number; open_correct: boolean }
export interface TraceEntry {
  id: string; created: string; task: string; instruction: string; flow_steps: number;
  error?: PoseError | null; parent?: string | null;
}
export interface FlowStep {
  k: number; t: number; x: number[]; velocity: number[];
  pose: { position: Vec3; quaternion: Quaternion };
  region: { center: Vec3; radius: number; points: number };
  open_probability: number; ms: number;
}
export interface Action { position: Vec3; quaternion: Quaternion; open: boolean }
export interface Trace {
  id: string; created: string;
  policy: { file: string; weights_sha256: string; generation: number; backbone: string; objective: string };
  radius: { kind: string; r_0: number; r_min: number };
  flow_steps: number; seed: number; integrator: string;
  scene: { task: string; variation: number; seed: number; demo?: string; keyframe?: number; state_sha256: string };
  instruction: string; steps: FlowStep[]; result: Action;
  expert: Action | null; error: PoseError | null; parent: { trace: string; step: number } | null;
}
export interface LogEvent { level: string; message: string }
export type ServerEvent =
  | { type: "state"; data: Snapshot } | { type: "job"; data: Job } | { type: "train"; data: TrainReport }
  | { type: "trace"; data: TraceEntry } | { type: "log"; data: LogEvent };
