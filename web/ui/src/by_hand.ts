// What was moved by hand since the reset: saved, or left only when the user says so.
import { inform, refresh_demos } from "./actions";
import { api } from "./api";
import { let_go } from "./jog";
import { store, type Leaving } from "./store";

/// The session that was saved last, so that it is not saved twice.
let saved_session = "";
let wished: () => Promise<unknown> = async () => undefined;
const session = () => `${store.state.snapshot?.episode}:${store.state.teleop?.frames}`;
export const unsaved_by_hand = () => (store.state.teleop?.by_hand ?? false) && session() !== saved_session;

export async function save_by_hand(unfinished: boolean): Promise<void> {
  let_go();
  const id = await api.save_teleop(unfinished);
  saved_session = session();
  store.set({ ask: null });
  inform(`Saved as demonstration ${id}${unfinished ? ", though the task is not done: training leaves it out" : ""}.`);
  await refresh_demos();
}

/// Does `go`, which ends the present episode. While something moved by hand is unsaved, only when the same is wished a second
/// time, or leave_now says so; another scene is another wish each time.
export async function leave_scene(why: Leaving, go: () => Promise<unknown>): Promise<void> {
  wished = go;
  if (unsaved_by_hand() && (store.state.ask !== why || why === "change")) return store.set({ ask: why, tab: "record" });
  await leave_now();
}

export async function leave_now(): Promise<void> {
  let_go();
  try {
    await wished();
  } finally {
    store.set({ ask: null });
  }
}

// Another page may have ended the episode: a question about it is out of date.
store.watch((s) => [s.snapshot?.episode] as const, () => {
  if (store.state.ask !== null) store.set({ ask: null });
});
