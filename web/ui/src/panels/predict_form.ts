// What to ask the policy on the scene as it is now.
import { act, open_tab, refresh_traces, select_trace, reset } from "../actions";
import { api } from "../api";
import { leave_scene } from "../by_hand";
import { field, h, number_input, read_number, show_if } from "../dom";
import { store } from "../store";

export function predict_form(): HTMLElement {
  const flow_steps = number_input("flow-steps", "flow steps", 8, { min: 1, max: 256, step: 1 });
  const seed = number_input("predict-seed", "seed of the noise", 0, { min: 0, max: 4294967295, step: 1 });
  const samples = number_input("samples", "samples", 1, { min: 1, max: 16, step: 1 });
  const radius = h("select", { "data-testid": "predict-radius", "aria-label": "radius schedule" },
    h("option", { value: "" }, "as trained"), ...["linear", "cosine", "off"].map((kind) => h("option", { value: kind }, kind)));
  const integrator = h("select", { "data-testid": "predict-integrator", "aria-label": "integrator of the flow",
    title: "midpoint looks twice a step, Runge–Kutta four times; diffusion policies take their own steps" },
    ...[["euler", "Euler"], ["midpoint", "midpoint"], ["rk4", "Runge–Kutta 4"]].map(([value, text]) => h("option", { value: value! }, text!)));
  const predict = h("button", { type: "button", class: "primary", "data-testid": "predict", title: "predict on the scene as it is now (p)",
    onclick: () => void act(async () => {
      const ids = await api.predict({ flow_steps: read_number(flow_steps), seed: read_number(seed), samples: read_number(samples),
        ...(radius.value ? { radius: radius.value } : {}), ...(integrator.value === "euler" ? {} : { integrator: integrator.value }) });
      await refresh_traces();
      if (ids[0]) await select_trace(ids[0]);
    }, predict) }, "Predict");
  const empty = h("div", { class: "empty slim", "data-testid": "debug-empty" },
    h("p", {}, "No policy yet: record demonstrations, then train."),
    h("button", { type: "button", onclick: () => open_tab((store.state.demos?.length ?? 0) > 0 ? "train" : "record") }, "Start there"));
  const done = h("div", { class: "empty slim", "data-testid": "debug-done" },
    h("p", {}, "The task is already done in this scene: there is nothing left to predict."),
    h("button", { type: "button", onclick: () => void act(async () => {
      const now = store.state.snapshot;
      if (now) await leave_scene("reset", () => reset(now.task, now.variation, now.seed));
    }) }, "Start this scene again"));
  store.watch((s) => [s.snapshot?.success ?? false] as const, (success) => show_if(done, success));
  store.watch((s) => [s.snapshot?.policy.loaded ?? false, s.snapshot?.policy.file ?? "", s.train?.step ?? 0] as const,
    (loaded, file, step) => {
      const usable = loaded || step > 0;
      show_if(empty, !usable);
      predict.disabled = !usable;
      predict.title = `predict on the scene as it is now (p)${file ? ` with ${file}` : ""}`;
    });
  return h("section", { class: "predict" },
    h("div", { class: "row tight" }, field("flow steps", flow_steps), field("seed", seed), field("samples", samples), field("radius", radius), field("integrator", integrator), predict), empty, done);
}
