// Under the picture: the steps of the shown trace, from noise (t = 0) to action (t = 1).
import { go_to_step, last_step } from "./actions";
import { flow_color } from "./colors";
import { fill, h, set_text } from "./dom";
import { metres } from "./format";
import { toggle_play } from "./playback";
import { store } from "./store";

const icons = {
  first: "M5 4v12M16 4 8 10l8 6z", back: "M14 4 6 10l8 6z", play: "M6 4l10 6-10 6z", pause: "M6 4v12M14 4v12",
  forward: "M6 4l8 6-8 6z", last: "M15 4v12M4 4l8 6-8 6z",
};

function icon(name: keyof typeof icons): SVGSVGElement {
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  svg.setAttribute("viewBox", "0 0 20 20");
  svg.setAttribute("aria-hidden", "true");
  const path = document.createElementNS("http://www.w3.org/2000/svg", "path");
  path.setAttribute("d", icons[name]);
  svg.append(path);
  return svg;
}

function transport(test_id: string, label: string, picture: keyof typeof icons, press: () => void): HTMLButtonElement {
  return h("button", { type: "button", class: "transport", "data-testid": test_id, "aria-label": label, title: label, onclick: press },
    icon(picture));
}

export function timeline(): HTMLElement {
  const play = transport("play", "play (space)", "play", toggle_play);
  const buttons = [
    transport("step-first", "first step (Home)", "first", () => go_to_step(0)),
    transport("step-back", "one step back (←)", "back", () => go_to_step(store.state.step - 1)),
    play,
    transport("step-forward", "one step on (→)", "forward", () => go_to_step(store.state.step + 1)),
    transport("step-last", "last step (End)", "last", () => go_to_step(last_step())),
  ];
  const slider = h("input", { type: "range", class: "slider", min: 0, max: 1, step: 1, value: 0, "data-testid": "slider",
    "aria-label": "flow step", oninput: () => go_to_step(slider.valueAsNumber) });
  const ticks = h("div", { class: "ticks", "aria-hidden": "true" });
  const readout = h("output", { class: "readout", "data-testid": "readout" });
  const t_text = h("b", { class: "t" });
  const step_text = h("span", { "data-testid": "step-readout" });
  const radius_text = h("span", { class: "radius" });
  fill(readout, t_text, step_text, radius_text);

  store.watch((s) => [s.trace, s.step, s.connection === "live"] as const, (trace, step, live) => {
    const usable = trace !== null && live;
    for (const control of [...buttons, slider]) control.disabled = !usable;
    const last = Math.max(1, last_step());
    slider.max = String(last);
    slider.value = String(step);
    const now = trace?.steps[step];
    set_text(t_text, now ? `t ${now.t.toFixed(3)}` : "t –");
    set_text(step_text, now ? `step ${step}/${last}` : "no trace");
    set_text(radius_text, now ? `r ${metres(now.region.radius)}` : "");
    const color = flow_color(now?.t ?? 0);
    slider.style.setProperty("--flow", color);
    t_text.style.setProperty("color", now ? color : "");
    slider.setAttribute("aria-valuetext", now ? `step ${step} of ${last}, t ${now.t.toFixed(3)}` : "no trace");
  });
  store.watch((s) => [s.trace] as const, (trace) => {
    const count = trace ? trace.steps.length : 0;
    fill(ticks, ...(count > 1 && count <= 65 ? trace!.steps.map((_, k) => {
      const tick = h("i", { class: "tick" });
      tick.style.left = `${(100 * k) / (count - 1)}%`;
      return tick;
    }) : []));
  });
  store.watch((s) => [s.playing] as const, (playing) => {
    play.replaceChildren(icon(playing ? "pause" : "play"));
    play.setAttribute("aria-label", playing ? "pause (space)" : "play (space)");
    play.setAttribute("aria-pressed", String(playing));
  });
  return h("section", { class: "timeline", "aria-label": "time line of the flow" },
    h("div", { class: "transports", role: "group", "aria-label": "steps" }, ...buttons),
    h("div", { class: "scale" }, h("span", { class: "end noise" }, "t = 0 noise"),
      h("div", { class: "slot" }, ticks, slider), h("span", { class: "end action" }, "t = 1 action")),
    readout);
}
