// From one episode to the next, as LeRobot's keys do: n next, r redo, q stop.
import { act, inform, is_recording, job_over, reset } from "./actions";
import { api } from "./api";
import { leave_scene, save_by_hand, unsaved_by_hand } from "./by_hand";
import { next_seed, reset_scene } from "./header";
import { let_go } from "./jog";
import { set_pick } from "./picture_tools";
import { store } from "./store";
import type { Job } from "./types";

type Wish = "next" | "redo" | "stop";
let running = false;
let wish: Wish | null = null;

/// Records `wanted` episodes, a seed each. `run` runs the script once; `tell` hears the tally after each. Ends early when the
/// user stops it, or when `broken` says that going on is useless.
export async function record_many(wanted: number, run: () => Promise<Job>, tell: (saved: number, tried: number) => void,
  broken: () => boolean): Promise<void> {
  if (running) return;
  running = true;
  wish = null;
  let saved = 0, tried = 0;
  try {
    for (let episode = 0; episode < wanted;) {
      const over = await run();
      ++tried;
      if (over.state === "done" && over.result?.demo) ++saved;
      tell(saved, tried);
      const said = wish as Wish | null;
      wish = null;
      if (said === "stop" || (over.state === "cancelled" && said === null)) break;
      if (over.state === "failed" && broken()) break;
      if (said !== "redo") ++episode;
      const scene = store.state.snapshot;
      if (said !== "redo" && episode < wanted && scene) await reset(scene.task, scene.variation, scene.seed + 1);
    }
  } finally {
    running = false;
  }
  if (saved > 0) inform(`${saved} demonstration${saved === 1 ? "" : "s"} saved. Train on them, or record more.`);
}

/// Ends the episode that is being recorded; the loop above then does as wished.
async function ask_loop(what: Wish): Promise<void> {
  wish = what;
  const job = store.state.snapshot?.recording.job;
  if (job && is_recording(store.state)) {
    await api.cancel(job);
    await job_over(job);
  }
}

/// n: saves what was done by hand and succeeded, then the next placement. What did not succeed is asked about first; a
/// second n leaves it.
export async function next_episode(): Promise<void> {
  if (running) return ask_loop("next");
  if (unsaved_by_hand() && store.state.snapshot?.success) await save_by_hand(false);
  await leave_scene("next", next_seed);
}

/// r: the same placement anew. Asks first what becomes of an unsaved session; a second r leaves it.
export async function redo_episode(): Promise<void> {
  if (running) return ask_loop("redo");
  await leave_scene("reset", reset_scene);
}

export async function stop_episode(): Promise<void> {
  let_go();
  set_pick(null);
  store.set({ ask: null });
  if (running) return ask_loop("stop");
  const job = store.state.snapshot?.recording;
  if (job?.running) await api.cancel(job.job);
}

export const episode_keys: Record<string, () => void> = {
  n: () => void act(next_episode), r: () => void act(redo_episode), q: () => void act(stop_episode),
};
