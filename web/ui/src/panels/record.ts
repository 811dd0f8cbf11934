// Record: the waypoint script of the scene, run or recorded; what failed is marked at its line.
import { act, inform, is_recording, job_over, open_tab } from "../actions";
import { api } from "../api";
import { fill, h, number_input, read_number, set_text, show_if } from "../dom";
import { job_view } from "../job_view";
import { store } from "../store";
import { terms_block } from "./terms";

function line_of(where: string | undefined): number | null {
  const match = /:(\d+)(?::\d+)?:?$/.exec(where ?? "") ?? /\bline (\d+)/.exec(where ?? "");
  return match ? Number(match[1]) : null;
}

function script_editor() {
  const gutter = h("div", { class: "gutter", "aria-hidden": "true" });
  const text = h("textarea", { class: "script", spellcheck: "false", wrap: "off", "data-testid": "script", "aria-label": "waypoint script (YAML)" });
  let failed_line: number | null = null;
  const number_lines = () => {
    const lines = text.value.split("\n").length;
    fill(gutter, ...Array.from({ length: lines }, (_, i) =>
      h("span", i + 1 === failed_line ? { class: "failed", "data-testid": "failed-line" } : {}, i + 1)));
    gutter.scrollTop = text.scrollTop;
  };
  text.addEventListener("input", () => {
    failed_line = null;
    number_lines();
  });
  text.addEventListener("scroll", () => {
    gutter.scrollTop = text.scrollTop;
  });
  return {
    element: h("div", { class: "editor" }, gutter, text),
    text,
    load(script: string) {
      text.value = script;
      failed_line = null;
      number_lines();
    },
    mark(line: number | null) {
      failed_line = line;
      number_lines();
      if (line !== null) text.scrollTop = Math.max(0, (line - 4) * parseFloat(getComputedStyle(text).lineHeight));
    },
  };
}

export function record_panel(): HTMLElement {
  const editor = script_editor();
  const job = job_view("record-job");
  const episodes = number_input("episodes", "episodes", 1, { min: 1, max: 200, step: 1 });
  const tally = h("span", { class: "quiet", "data-testid": "tally" });
  let stop_wanted = false;
  let changed = false;
  editor.text.addEventListener("input", () => {
    changed = true;
  });

  const load_own = (task: string) => act(async () => {
    editor.load(await api.script(task));
    changed = false;
  });
  const run_once = async (record: boolean) => {
    editor.mark(null);
    const task = store.state.snapshot?.task ?? "";
    const id = await api.run_script(changed ? { script: editor.text.value } : { task }, record).catch((error: unknown) => {
      editor.mark(line_of((error as { where?: string }).where));
      throw error;
    });
    job.follow(id);
    const over = await job_over(id);
    if (over.state === "failed") editor.mark(line_of(over.error?.where) ?? line_of(over.error?.message));
    return over;
  };
  const record_many = async (wanted: number) => {
    let saved = 0;
    stop_wanted = false;
    for (let episode = 0; episode < wanted && !stop_wanted; ++episode) {
      const scene = store.state.snapshot;
      if (episode > 0 && scene) await api.reset(scene.task, scene.variation, scene.seed + 1);
      const over = await run_once(true);
      if (over.state === "done" && over.result?.demo) ++saved;
      set_text(tally, `${saved} saved of ${episode + 1} tried`);
      if (over.state === "cancelled" || (changed && over.state === "failed")) break;
    }
    if (saved > 0) inform(`${saved} demonstration${saved === 1 ? "" : "s"} saved. Train on them, or record more.`);
  };

  const run = h("button", { type: "button", "data-testid": "run-script", title: "run the script without recording",
    onclick: () => void act(() => run_once(false), run) }, "Run");
  const record = h("button", { type: "button", class: "primary record", "data-testid": "record", title: "run the script and keep the demonstration",
    onclick: () => void act(() => record_many(read_number(episodes)), record) }, "● Record");
  const stop = h("button", { type: "button", "data-testid": "stop-recording", onclick: () => {
    stop_wanted = true;
    const running = store.state.snapshot?.recording.job;
    if (running) void act(() => api.cancel(running));
  } }, "Stop");
  const own = h("button", { type: "button", class: "link", "data-testid": "own-script", onclick: () => {
    const task = store.state.snapshot?.task;
    if (task) void load_own(task);
  } }, "the task's own script");
  const to_train = h("button", { type: "button", class: "link", onclick: () => open_tab("train") }, "Go to Train →");

  store.watch((s) => [s.snapshot?.task, s.snapshot?.variation, s.connection === "live"] as const, (task, _variation, live) => {
    if (task && live && !changed) void load_own(task);
  });
  store.watch((s) => [is_recording(s)] as const, (running) => show_if(stop, running));
  store.watch((s) => [(s.demos?.length ?? 0) > 0] as const, (any) => show_if(to_train, any));

  return h("div", { class: "panel record-panel" },
    h("div", { class: "row spread" }, h("h2", {}, "Waypoint script"), own),
    editor.element,
    h("div", { class: "row" }, run, record, h("label", { class: "inline" }, h("span", { class: "times" }, "×"), episodes, h("span", { class: "quiet" }, "episodes, a seed each")), stop),
    job.element,
    h("div", { class: "row spread" }, tally, to_train),
    terms_block());
}
