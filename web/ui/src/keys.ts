// Keys of the time line; never while a field has the focus, so that typing stays typing.
import { act, go_to_step, last_step } from "./actions";
import { toggle_play } from "./playback";
import { redo, undo } from "./script_actions";
import { store } from "./store";

export function types_text(target: EventTarget | null): boolean {
  if (target instanceof HTMLInputElement) return !/^(range|checkbox|radio|button)$/.test(target.type);
  return target instanceof HTMLTextAreaElement || target instanceof HTMLSelectElement;
}

/// Ctrl+Z and Ctrl+Shift+Z (or Ctrl+Y) undo and redo changes of the waypoints.
function undo_key(event: KeyboardEvent): void {
  if (event.altKey || store.state.tab !== "record" || types_text(event.target)) return;
  const key = event.key.toLowerCase();
  if (key !== "z" && key !== "y") return;
  event.preventDefault();
  (key === "y" || event.shiftKey ? redo : undo)();
}

/// `actions`: letter keys that other parts of the page own.
export function listen_to_keys(actions: Record<string, () => void>): void {
  window.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey) return undo_key(event);
    if (event.altKey) return;
    if (types_text(event.target)) {
      if (event.key === "Escape") (event.target as HTMLElement).blur();
      return;
    }
    const on_button = event.target instanceof HTMLButtonElement || event.target instanceof HTMLAnchorElement;
    if (event.key === " " && on_button) return; // space presses the focused button
    const { step } = store.state;
    const moves: Record<string, () => void> = {
      " ": toggle_play,
      ArrowLeft: () => go_to_step(step - 1),
      ArrowRight: () => go_to_step(step + 1),
      Home: () => go_to_step(0),
      End: () => go_to_step(last_step()),
      ...actions,
    };
    const move = moves[event.key];
    if (!move || (event.repeat && actions[event.key])) return; // a letter held down is one press
    event.preventDefault();
    void act(async () => move());
  });
}
