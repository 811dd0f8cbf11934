// Train: the policy learns while you record; loss and the error against held-out expert keyframes.
import { act, open_tab } from "../actions";
import { api } from "../api";
import { Chart } from "../charts";
import { chart } from "../colors";
import { field, fill, h, number_input, read_number, set_text, show_if } from "../dom";
import { count, degrees, loss, minutes } from "../format";
import { store } from "../store";
import { method_choice } from "./train_method";
import { loss_parts, task_errors } from "./train_parts";

const presets = [
  { value: "nano", text: "nano (to try)" },
  { value: "desk", text: "desk (CPU)" },
  { value: "paper", text: "paper (GPU)" },
];

function figure(test_id: string, label: string): { element: HTMLElement; value: HTMLElement } {
  const value = h("b", { "data-testid": test_id }, "–");
  return { element: h("div", { class: "figure" }, h("span", {}, label), value), value };
}

function task_choice(): { element: HTMLElement; chosen: () => string[] } {
  const list = h("div", { class: "checks", role: "group", "aria-label": "tasks to train on" });
  store.watch((s) => [s.demos] as const, (demos) => {
    const counts = new Map<string, number>();
    for (const demo of demos ?? []) counts.set(demo.task, (counts.get(demo.task) ?? 0) + 1);
    const off = new Set([...list.querySelectorAll<HTMLInputElement>("input:not(:checked)")].map((box) => box.value));
    fill(list, ...[...counts].sort().map(([task, demo_count]) =>
      h("label", { class: "check" }, h("input", { type: "checkbox", value: task, checked: !off.has(task) }),
        `${task.replaceAll("_", " ")} (${demo_count})`)));
  });
  const boxes = () => [...list.querySelectorAll<HTMLInputElement>("input")];
  return {
    element: list,
    chosen: () => (boxes().every((box) => box.checked) ? [] : boxes().filter((box) => box.checked).map((box) => box.value)),
  };
}

function figures(): HTMLElement {
  const step = figure("train-step", "step");
  const speed = figure("train-speed", "samples/s");
  const time = figure("train-minutes", "time");
  const demos = figure("train-demos", "demonstrations");
  const loss_now = figure("train-loss", "loss");
  const position = figure("train-mm", "held-out position");
  const rotation = figure("train-deg", "held-out rotation");
  store.watch((s) => [s.train] as const, (train) => {
    if (!train) return;
    set_text(step.value, count(train.step));
    set_text(speed.value, train.samples_per_s.toFixed(1));
    set_text(time.value, minutes(train.minutes));
    set_text(demos.value, count(train.demos));
    set_text(loss_now.value, train.step > 0 ? loss(train.loss) : "–");
    const { position_mm, rotation_deg, keyframes } = train.validation;
    const nothing = train.step > 0 && keyframes === 0 ? "nothing held out" : "–";
    set_text(position.value, position_mm !== null && keyframes > 0 ? `${position_mm.toFixed(1)} mm` : nothing);
    set_text(rotation.value, rotation_deg !== null && keyframes > 0 ? degrees(rotation_deg) : nothing);
  });
  return h("div", { class: "figures" }, ...[step, loss_now, speed, time, demos, position, rotation].map((f) => f.element));
}

function curves(): HTMLElement[] {
  const loss_chart = new Chart({ test_id: "loss-chart", title: "Loss", x_label: "training step", log: true,
    curves: [{ label: "flow + openness", color: chart.neutral, unit: "" }] });
  const validation_chart = new Chart({ test_id: "validation-chart", title: "Held-out keyframes, median error", x_label: "training step",
    curves: [{ label: "position", color: chart.position, unit: "mm", points: true },
      { label: "rotation", color: chart.rotation, unit: "°", axis: "right", points: true }] });
  store.watch((s) => [s.train?.loss_history] as const, (history) => {
    const usable = (history ?? []).filter(([, value]) => value > 0); // the axis is logarithmic
    loss_chart.set([usable.map((p) => p[0]), usable.map((p) => p[1])], "the curve starts with the first steps");
  });
  store.watch((s) => [s.train?.validation_history] as const, (history = []) =>
    validation_chart.set([history.map((p) => p[0]), history.map((p) => p[1]), history.map((p) => p[2])],
      "shown once demonstrations are held out"));
  return [loss_chart.element, validation_chart.element];
}

export function train_panel(): HTMLElement {
  const preset = h("select", { "data-testid": "preset", "aria-label": "preset" }, ...presets.map((p) => h("option", { value: p.value }, p.text)));
  preset.value = "desk";
  const limit = number_input("train-limit", "minutes", 10, { min: 0.1, max: 10080, step: 0.1 });
  const tasks = task_choice();
  const method = method_choice();
  const start = h("button", { type: "button", class: "primary", "data-testid": "train-start",
    onclick: () => void act(() => api.train_start({ preset: preset.value, minutes: read_number(limit), ...method.chosen(),
      ...(tasks.chosen().length > 0 ? { tasks: tasks.chosen() } : {}) }), start) }, "Start training");
  const resume = h("button", { type: "button", "data-testid": "train-resume", title: "train the policy in use further, with the demonstrations there are now",
    onclick: () => void act(() => api.train_start({ resume: true, minutes: read_number(limit),
      ...(tasks.chosen().length > 0 ? { tasks: tasks.chosen() } : {}) }), resume) }, "Go on");
  const stop = h("button", { type: "button", "data-testid": "train-stop", onclick: () => void act(() => api.train_stop(), stop) }, "Stop");
  const failure = h("p", { class: "failure-text", role: "alert", "data-testid": "train-error" });
  const left_out = h("details", { class: "quiet", "data-testid": "train-left-out" });
  const empty = h("div", { class: "empty", "data-testid": "train-empty" },
    h("p", {}, "Nothing to learn from yet."),
    h("p", { class: "quiet" }, "Record a few demonstrations first; training can go on while you record more."),
    h("button", { type: "button", onclick: () => open_tab("record") }, "Record demonstrations"));
  const form = h("div", { class: "row wrap" }, field("preset", preset), field("stop after", limit, "min"), start, resume, stop);

  store.watch((s) => [s.train?.running ?? false, s.demos?.length ?? 0, s.train?.step ?? 0, s.snapshot?.policy.loaded ?? false] as const, (running, demo_count, step, loaded) => {
    show_if(empty, demo_count === 0 && step === 0);
    start.disabled = running || demo_count === 0;
    show_if(resume, loaded && !running && demo_count > 0);
    stop.disabled = !running;
    preset.disabled = limit.disabled = running;
    method.enable(!running);
    set_text(start, (step > 0 || loaded) && !running ? "Train anew" : "Start training");
  });
  store.watch((s) => [s.train?.error] as const, (message) => {
    show_if(failure, Boolean(message));
    set_text(failure, message ? `Training stopped: ${message}` : "");
  });
  store.watch((s) => [s.train?.left_out] as const, (bad = []) => {
    show_if(left_out, bad.length > 0);
    fill(left_out, h("summary", {}, `${count(bad.length)} damaged demonstration${bad.length === 1 ? " is" : "s are"} left out`),
      ...bad.map(({ problem }) => h("p", {}, problem)));
  });
  return h("div", { class: "panel train-panel" }, empty, form, method.element, tasks.element, failure, left_out, figures(), loss_parts(), ...curves(), task_errors());
}
