// How a new policy is to be trained: the parts of the method that the publication compares.
import type { TrainOptions } from "../api";
import { field, h } from "../dom";

interface Choice { key: "objective" | "backbone" | "radius" | "point_encoder" | "grounded"; label: string; values: [value: string, text: string][] }

/// The first of each is what flowscope trains when nothing is said.
const choices: Choice[] = [
  { key: "objective", label: "objective", values: [["cfm", "flow matching"], ["ddim", "DDIM"], ["ddpm", "DDPM"]] },
  { key: "backbone", label: "backbone", values: [["mamba", "Mamba"], ["transformer", "transformer"]] },
  { key: "radius", label: "radius", values: [["linear", "linear"], ["cosine", "cosine"], ["off", "off"]] },
  { key: "point_encoder", label: "point encoder", values: [["true", "on"], ["false", "off"]] },
  { key: "grounded", label: "action from", values: [["true", "points of the scene"], ["false", "one token, as published"]] },
];

export function method_choice(): { element: HTMLElement; chosen: () => TrainOptions; enable: (on: boolean) => void } {
  const selects = choices.map((c) => h("select", { "data-testid": `train-${c.key}`, "aria-label": c.label },
    ...c.values.map(([value, text]) => h("option", { value }, text))));
  const changed = h("span", { class: "quiet", "data-testid": "train-method" });
  const is_first = (i: number) => selects[i]!.selectedIndex === 0;
  const tell = () => {
    const others = choices.flatMap((c, i) => (is_first(i) ? [] : [`${c.label}: ${selects[i]!.selectedOptions[0]!.text}`]));
    changed.textContent = others.length > 0 ? ` – ${others.join(", ")}` : "";
  };
  for (const select of selects) select.addEventListener("change", tell);
  return {
    element: h("details", { class: "method" }, h("summary", {}, "Method", changed),
      h("div", { class: "row wrap" }, ...choices.map((c, i) => field(c.label, selects[i]!)))),
    chosen: () => Object.fromEntries(choices.flatMap((c, i) => {
      const value = selects[i]!.value;
      return is_first(i) ? [] : [[c.key, value === "true" || value === "false" ? value === "true" : value]];
    })),
    enable: (on) => { for (const select of selects) select.disabled = !on; },
  };
}
