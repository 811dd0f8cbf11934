// The top line: which scene this is, what it shall become, and what the program is doing now.
import { act, inform, is_recording, reset } from "./actions";
import { leave_scene } from "./by_hand";
import { fill, h, number_input, read_number, set_options, set_text } from "./dom";
import { count } from "./format";
import { store } from "./store";

export function reset_scene(): Promise<void> {
  return act(async () => {
    const { seed, task, variation } = choice();
    await reset(task, variation, seed);
  });
}

/// What is chosen here becomes the scene.
function change_scene(): Promise<void> {
  return act(async () => {
    const { seed, task, variation } = choice();
    const other = task !== store.state.snapshot?.task;
    await leave_scene("change", async () => {
      await reset(task, variation, seed);
      if (other) inform(`New scene: ${task}`);
    });
  });
}

const task_select = h("select", { "data-testid": "task", "aria-label": "task", title: "task" });
const variation_select = h("select", { "data-testid": "variation", "aria-label": "variation", title: "variation" });
const seed_input = number_input("seed", "seed", 0, { min: 0, max: 4294967295, step: 1 });

function choice(): { task: string; variation: number; seed: number } {
  return { task: task_select.value, variation: Number(variation_select.value), seed: read_number(seed_input) };
}

function variations_of(task: string): { value: string; text: string }[] {
  const entry = store.state.tasks.find((t) => t.name === task);
  return Array.from({ length: entry?.variations ?? 1 }, (_, k) => {
    const instruction = entry?.instructions[k];
    return { value: String(k), text: instruction ? `${k}: ${instruction}` : String(k) };
  });
}

function pill(test_id: string, label: string): { element: HTMLElement; update: (text: string, tone: string) => void } {
  const value = h("span");
  const element = h("span", { class: "pill", "data-testid": test_id, title: label }, h("i", { class: "lamp" }), value);
  return {
    element,
    update(text, tone) {
      set_text(value, text);
      element.dataset.tone = tone;
    },
  };
}

function status_pills(): HTMLElement {
  const recording = pill("pill-recording", "recording");
  const training = pill("pill-training", "training");
  const viewers = pill("pill-viewers", "viewers of the stream");
  const connection = pill("pill-connection", "connection");
  store.watch((s) => [s.snapshot, s.train, s.connection, is_recording(s)] as const, (snapshot, train, link, records) => {
    recording.update(records ? "rec" : "idle", records ? "failure" : "off");
    const running = train?.running ?? snapshot?.training ?? false;
    const step = train?.step ?? snapshot?.train.step ?? 0;
    const rests = step > 0 ? `step ${count(step)}` : snapshot?.policy.loaded ? "policy loaded" : "untrained";
    training.update(running ? `training ${count(step)}` : rests, running ? "inside" : "off");
    viewers.update(`${snapshot?.viewers ?? 0} viewer${snapshot?.viewers === 1 ? "" : "s"}`, "off");
    const tones = { live: "expert", lost: "failure", connecting: "off", loading: "action" };
    connection.update(link, tones[link]);
  });
  return h("div", { class: "pills" }, recording.element, training.element, viewers.element, connection.element);
}

/// `reset_episode`, `next_episode`: what the buttons beside the seed do.
export function header(reset_episode: () => Promise<void>, next_episode: () => Promise<void>): HTMLElement {
  const instruction = h("p", { class: "instruction", "data-testid": "instruction" });
  const again = h("button", { type: "button", class: "icon", "data-testid": "reset", "aria-label": "reset the scene (r)",
    title: "reset the scene (r)", onclick: () => void act(reset_episode) }, "⟲");
  const next = h("button", { type: "button", class: "icon", "data-testid": "next-seed", "aria-label": "next seed (n)",
    title: "next seed (n)", onclick: () => void act(next_episode) }, "+1");
  task_select.addEventListener("change", () => {
    set_options(variation_select, variations_of(task_select.value), "0");
    void change_scene();
  });
  variation_select.addEventListener("change", () => void change_scene());
  seed_input.addEventListener("keydown", (event) => {
    if (event.key === "Enter") void change_scene();
  });
  store.watch((s) => [s.tasks, s.snapshot?.task, s.snapshot?.variation, s.snapshot?.seed, s.snapshot?.episode, s.ask === null] as const,
    (tasks, task, variation, seed, _episode, decided) => {
      if (task === undefined || !decided) return; // while the page asks, what was chosen stays to be seen
      const names = tasks.length > 0 ? tasks.map((t) => t.name) : [task];
      set_options(task_select, names.map((name) => ({ value: name, text: name.replaceAll("_", " ") })), task);
      set_options(variation_select, variations_of(task), String(variation));
      if (document.activeElement !== seed_input) seed_input.value = String(seed);
    });
  store.watch((s) => [s.snapshot?.instruction, s.snapshot?.success] as const, (text, success) => {
    fill(instruction, text ? `“${text}”` : "", success ? h("span", { class: "done-mark", "data-testid": "success" }, "done") : null);
    instruction.title = text ?? "";
  });
  return h("header", { class: "top" }, h("h1", {}, h("span", { class: "flow-mark" }), "flowscope"),
    h("div", { class: "scene-choice" }, task_select, variation_select,
      h("label", { class: "seed" }, h("span", {}, "seed"), seed_input), again, next),
    instruction, status_pills());
}

export async function next_seed(): Promise<void> {
  const { seed } = choice();
  seed_input.value = String(seed + 1);
  await reset_scene();
}
