// All that the page knows, in one place. Components watch the parts they show; only actions.ts and events write.
import type { Approach, DemoInfo, Job, Snapshot, Step, TaskEntry, Teleop, Trace, TraceEntry, TrainReport } from "./types";

export type Connection = "connecting" | "loading" | "live" | "lost";
export type Tab = "record" | "train" | "debug" | "data" | "export";
export interface Notice { level: "error" | "info"; message: string; where: string }

/// The waypoint script that the editor shows and the cards change; `steps` is how the server read it last.
export interface ScriptState {
  text: string;
  changed: boolean; // no longer the task's own
  steps: Step[];
  selected: number | null;
  problem: { message: string; line: number | null } | null;
  failed: number | null; // the line at which a run ended
}

/// Ways out of an episode.
export type Leaving = "next" | "reset" | "change";

export interface PageState {
  connection: Connection;
  loading_message: string;
  retry_at: number; // ms since the epoch; when the next attempt to connect starts
  notice: Notice | null;
  tab: Tab;
  tasks: TaskEntry[];
  snapshot: Snapshot | null;
  jobs: ReadonlyMap<string, Job>;
  train: TrainReport | null;
  demos: DemoInfo[] | null; // null: not asked yet
  selected_demo: string | null;
  traces: TraceEntry[];
  trace: Trace | null;
  other: Trace | null; // compared with the shown one: first the parent of a branch, then what the user picks
  step: number;
  playing: boolean;
  script: ScriptState;
  pick: Approach | null; // a click in the picture makes a waypoint, in this way
  teleop: Teleop | null;
  ask: Leaving | "save" | null; // what was moved by hand is unsaved: what shall become of it
}

export const initial: PageState = {
  connection: "connecting", loading_message: "", retry_at: 0, notice: null, tab: "record", tasks: [], snapshot: null,
  jobs: new Map(), train: null, demos: null, selected_demo: null, traces: [], trace: null, other: null, step: 0,
  playing: false, script: { text: "", changed: false, steps: [], selected: null, problem: null, failed: null }, pick: null, teleop: null, ask: null,
};

/// The selected values as parameters; a conditional type so that only `select` decides them.
type Values<T> = T extends readonly [...infer V] ? V : never;

export class Store {
  private current: PageState = initial;
  private watchers = new Set<() => void>();

  get state(): Readonly<PageState> {
    return this.current;
  }

  set(change: Partial<PageState>): void {
    this.current = { ...this.current, ...change };
    for (const notify of this.watchers) notify();
  }

  /// Calls `react` now and whenever any of the selected values is no longer the same object or number. Returns the end of it.
  watch<T extends readonly unknown[]>(
    select: (state: PageState) => readonly [...T], react: (...values: Values<T>) => void): () => void {
    let seen = select(this.current);
    const notify = () => {
      const next = select(this.current);
      if (next.every((value, i) => Object.is(value, seen[i]))) return;
      seen = next;
      react(...(next as unknown as Values<T>));
    };
    this.watchers.add(notify);
    react(...(seen as unknown as Values<T>));
    return () => this.watchers.delete(notify);
  }
}

export const store = new Store();
