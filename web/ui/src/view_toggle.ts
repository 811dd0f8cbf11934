// A check box that shows and sets one switch of the live view.
import { act } from "./actions";
import { h } from "./dom";
import { store } from "./store";
import { change_view, main_view } from "./view_settings";

type Switch = "overlays" | "detectors";

export function view_toggle(name: Switch, otherwise: boolean): HTMLInputElement {
  let asked = 0; // changes under way: news from before them must not flip the box back under the hand
  const show = () => {
    if (asked === 0) box.checked = main_view()?.[name] ?? otherwise;
  };
  const change = async () => {
    ++asked;
    await act(() => change_view({ [name]: box.checked }));
    --asked;
    show();
  };
  const box = h("input", { type: "checkbox", "data-testid": name, onchange: () => void change() });
  store.watch((s) => [s.snapshot?.views] as const, show);
  return box;
}
