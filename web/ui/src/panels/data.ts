// Data: the demonstrations on disk, each with its pictures.
import { act, inform, open_tab, refresh_demos, reset } from "../actions";
import { api } from "../api";
import { leave_scene } from "../by_hand";
import { fill, h, set_text, show_if } from "../dom";
import { bytes, clock } from "../format";
import { store } from "../store";
import type { DemoInfo } from "../types";

const camera = "front"; // every recorded observation has it

function picture(demo: DemoInfo, keyframe: number): HTMLElement {
  const image = h("img", { loading: "lazy", alt: keyframe < 0 ? "start" : `keyframe ${keyframe}`, src: api.demo_picture(demo.id, keyframe, camera) });
  image.addEventListener("error", () => image.classList.add("missing"), { once: true });
  return image;
}

function card(demo: DemoInfo, selected: boolean): HTMLElement {
  return h("button", { type: "button", class: "card", "aria-pressed": String(selected), "data-testid": "demo-card", "data-id": demo.id,
    onclick: () => store.set({ selected_demo: selected ? null : demo.id }) },
    picture(demo, -1),
    h("span", { class: "card-text" }, h("b", {}, demo.task.replaceAll("_", " ")), h("span", {}, demo.instruction),
      h("span", { class: "quiet" }, `${demo.keyframes} keyframes · seed ${demo.seed}`),
      demo.success === false ? h("span", { class: "quiet", "data-testid": "demo-unfinished" }, "unfinished: not learnt from") : null));
}

function remove_button(demo: DemoInfo): HTMLElement {
  const box = h("span", { class: "row" });
  const ask = h("button", { type: "button", "data-testid": "demo-delete", onclick: () => {
    fill(box, h("span", {}, "Move to the bin?"), sure, back);
    back.focus();
  } }, "Delete…");
  const sure = h("button", { type: "button", class: "danger", "data-testid": "demo-delete-confirm",
    onclick: () => void act(async () => {
      await api.remove_demo(demo.id);
      store.set({ selected_demo: null });
      await refresh_demos();
      inform(`Demonstration ${demo.id} moved to the bin.`);
    }, sure) }, "Delete");
  const back = h("button", { type: "button", onclick: () => fill(box, ask) }, "Keep");
  fill(box, ask);
  return box;
}

function detail(demo: DemoInfo): HTMLElement {
  const pictures = Array.from({ length: demo.keyframes + 1 }, (_, i) =>
    h("figure", { class: "shot" }, picture(demo, i - 1), h("figcaption", {}, i === 0 ? "start" : `keyframe ${i - 1}`)));
  const origin = `${demo.robot ?? "robot not recorded"}${demo.scene ? ` in ${demo.scene}` : ""}`;
  const facts = `${origin} · variation ${demo.variation} · ${demo.frames} frames · ${bytes(demo.bytes)} · ${clock(demo.created)} · ${demo.id}`;
  return h("div", { class: "detail", "data-testid": "demo-detail" },
    h("p", { class: "quiet", title: facts }, facts), h("div", { class: "strip", "data-testid": "keyframes" }, ...pictures),
    h("div", { class: "row spread" },
      h("button", { type: "button",
        onclick: () => void act(() => leave_scene("change", () => reset(demo.task, demo.variation, demo.seed))) }, "Set up this scene"),
      remove_button(demo)));
}

export function data_panel(): HTMLElement {
  const title = h("h2", {}, "Demonstrations");
  const total = h("span", { class: "quiet", "data-testid": "demo-count" });
  const filter = h("input", { type: "search", placeholder: "filter by task or instruction", "aria-label": "filter demonstrations" });
  const cards = h("div", { class: "cards" });
  const chosen = h("div");
  const empty = h("div", { class: "empty", "data-testid": "data-empty" }, h("p", {}, "No demonstrations yet."),
    h("button", { type: "button", onclick: () => open_tab("record") }, "Record the first"));
  const loading = h("p", { class: "quiet" }, "reading the demonstrations …");
  const draw = () => {
    const { demos, selected_demo } = store.state;
    const wanted = filter.value.trim().toLowerCase();
    const listed = [...(demos ?? [])].reverse().filter((d) => `${d.task} ${d.instruction}`.toLowerCase().replaceAll("_", " ").includes(wanted));
    show_if(loading, demos === null);
    show_if(empty, demos?.length === 0);
    show_if(filter, (demos?.length ?? 0) > 0);
    set_text(total, demos ? `${demos.length}, ${bytes(demos.reduce((sum, d) => sum + d.bytes, 0))}` : "");
    fill(cards, ...listed.map((demo) => card(demo, demo.id === selected_demo)));
    const one = demos?.find((d) => d.id === selected_demo);
    fill(chosen, one ? detail(one) : null);
  };
  filter.addEventListener("input", draw);
  store.watch((s) => [s.demos, s.selected_demo] as const, draw);
  return h("div", { class: "panel data-panel" }, h("div", { class: "row spread" }, title, total), filter, loading, empty, cards, chosen);
}
