// The five panels, one shown at a time; hidden ones keep what was typed in them.
import { open_tab } from "./actions";
import { h, show_if } from "./dom";
import { data_panel } from "./panels/data";
import { debug_panel } from "./panels/debug";
import { export_panel } from "./panels/export";
import { record_panel } from "./panels/record";
import { train_panel } from "./panels/train";
import { store, type Tab } from "./store";

const tabs: { tab: Tab; title: string; panel: () => HTMLElement }[] = [
  { tab: "record", title: "Record", panel: record_panel },
  { tab: "train", title: "Train", panel: train_panel },
  { tab: "debug", title: "Debug", panel: debug_panel },
  { tab: "data", title: "Data", panel: data_panel },
  { tab: "export", title: "Export", panel: export_panel },
];

export function side(): HTMLElement {
  const buttons = tabs.map(({ tab, title }) =>
    h("button", { type: "button", role: "tab", id: `tab-${tab}`, "aria-controls": `panel-${tab}`, "data-testid": `tab-${tab}`,
      onclick: () => open_tab(tab) }, title));
  const panels = tabs.map(({ tab, panel }) =>
    h("div", { class: "tab-panel", role: "tabpanel", id: `panel-${tab}`, "aria-labelledby": `tab-${tab}` }, panel()));
  const bar = h("div", { class: "tabs", role: "tablist", "aria-label": "panels", onkeydown: (event: KeyboardEvent) => {
    const move = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (move === undefined) return;
    event.stopPropagation();
    const at = tabs.findIndex(({ tab }) => tab === store.state.tab);
    const next = (at + move + tabs.length) % tabs.length;
    open_tab(tabs[next]!.tab);
    buttons[next]!.focus();
  } }, ...buttons);
  store.watch((s) => [s.tab] as const, (chosen) => {
    tabs.forEach(({ tab }, i) => {
      buttons[i]!.setAttribute("aria-selected", String(tab === chosen));
      buttons[i]!.tabIndex = tab === chosen ? 0 : -1;
      show_if(panels[i]!, tab === chosen);
    });
  });
  return h("aside", { class: "side" }, bar, ...panels);
}
