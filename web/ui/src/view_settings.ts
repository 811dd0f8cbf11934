// The live view's settings: the server's, as the newest snapshot has them.
import { api } from "./api";
import { store } from "./store";
import type { ViewSettings } from "./types";

export const view_id = "main";

export function main_view(): ViewSettings | undefined {
  return store.state.snapshot?.views.find((view) => view.id === view_id) ?? store.state.snapshot?.views[0];
}

export async function change_view(change: Partial<ViewSettings>): Promise<void> {
  const view = await api.set_view(view_id, change);
  const { snapshot } = store.state;
  if (snapshot && view) store.set({ snapshot: { ...snapshot, views: snapshot.views.map((v) => (v.id === view.id ? view : v)) } });
}
