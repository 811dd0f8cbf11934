// Record: waypoints as cards or as text, movements by hand, and episodes run or recorded.
import { act, is_recording, job_over, open_tab } from "../actions";
import { api } from "../api";
import { h, number_input, read_number, set_text, show_if } from "../dom";
import { record_many, stop_episode } from "../episodes";
import { job_view } from "../job_view";
import { set_pick, set_straight_in } from "../picture_tools";
import { insert, line_of, load_own, mark_failed, redo, undo } from "../script_actions";
import { insert_steps } from "../script_text";
import { store } from "../store";
import type { Approach } from "../types";
import { jog_pad } from "./jog_pad";
import { script_editor } from "./script_editor";
import { terms_block } from "./terms";
import { waypoint_cards } from "./waypoint_cards";

/// How new waypoints come: a click in the picture, and the fingers.
function add_row(): HTMLElement {
  const approach = h("select", { "data-testid": "pick-approach", "aria-label": "how the tool comes to a clicked point", title: "how the tool comes to a clicked point" },
    h("option", { value: "above" }, "from above"), h("option", { value: "normal" }, "facing the surface"), h("option", { value: "middle" }, "middle of the part"));
  const pick = h("button", { type: "button", class: "pick", "data-testid": "pick", title: "a click in the picture makes a waypoint; drag one to move it (Shift: parallel to the picture, Ctrl: along the surface)",
    onclick: () => set_pick(store.state.pick ? null : (approach.value as Approach)) }, "+ Click in picture");
  approach.addEventListener("change", () => {
    if (store.state.pick) set_pick(approach.value as Approach);
  });
  store.watch((s) => [s.pick !== null] as const, (on) => pick.setAttribute("aria-pressed", String(on)));
  const way_in = h("input", { type: "checkbox", "data-testid": "pick-way-in" });
  way_in.addEventListener("change", () => set_straight_in(way_in.checked));
  const fingers = (label: string, openness: number) => h("button", { type: "button", class: "tiny", "data-testid": `add-${label}`, title: `add a step: gripper ${label}`,
    onclick: () => void act(() => insert([{ kind: "gripper", openness }])) }, `+ ${label}`);
  return h("div", { class: "row tight add-row" }, pick, approach,
    h("label", { class: "check", title: "with a waypoint 80 mm before it, and a straight way in" }, way_in, "way in"), fingers("open", 1), fingers("close", 0));
}

export function record_panel(): HTMLElement {
  const editor = script_editor();
  const job = job_view("record-job");
  const episodes = number_input("episodes", "episodes", 1, { min: 1, max: 200, step: 1 });
  const tally = h("span", { class: "quiet", "data-testid": "tally" });

  const cards = waypoint_cards(async (step) => {
    const id = await api.run_script({ script: insert_steps({ text: "", steps: [], task: store.state.snapshot?.task ?? "" }, 0, [step]) }, false);
    job.follow(id);
    await job_over(id);
  });
  const run_once = async (record: boolean) => {
    mark_failed(null);
    const { script, snapshot } = store.state;
    const id = await api.run_script(script.changed ? { script: script.text } : { task: snapshot?.task ?? "" }, record).catch((error: unknown) => {
      mark_failed(line_of((error as { where?: string }).where));
      throw error;
    });
    job.follow(id);
    const over = await job_over(id);
    if (over.state === "failed") mark_failed(line_of(over.error?.where) ?? line_of(over.error?.message));
    return over;
  };
  const run = h("button", { type: "button", "data-testid": "run-script", title: "run the script without recording",
    onclick: () => void act(() => run_once(false), run) }, "Run");
  const record = h("button", { type: "button", class: "primary record", "data-testid": "record", title: "run the script and keep the demonstration",
    onclick: () => void act(() => record_many(read_number(episodes), () => run_once(true),
      (saved, tried) => set_text(tally, `${saved} saved of ${tried} tried`), () => store.state.script.changed), record) }, "● Record");
  const keys = h("span", { class: "quiet keys" }, ...[["n", "next"], ["r", "redo"], ["q", "stop"]].flatMap(([key, what]) => [h("kbd", {}, key!), `${what!} `]));
  const stop = h("button", { type: "button", "data-testid": "stop-recording", title: "stop (q)", onclick: () => void act(stop_episode) }, "Stop");
  const unit = h("span", { class: "quiet", title: "a seed each" }, "episodes");
  const own = h("button", { type: "button", class: "link", "data-testid": "own-script", onclick: () => void act(load_own) }, "the task's own");
  const to_train = h("button", { type: "button", class: "link", onclick: () => open_tab("train") }, "Go to Train →");
  const forms = (["cards", "text"] as const).map((form) =>
    h("button", { type: "button", class: "chip", "data-testid": `script-as-${form}`, onclick: () => show(form) }, form === "cards" ? "cards" : "text"));
  const show = (form: "cards" | "text") => {
    show_if(cards, form === "cards");
    show_if(editor, form === "text");
    forms.forEach((button, i) => button.setAttribute("aria-pressed", String((i === 0) === (form === "cards"))));
  };
  show("cards");

  store.watch((s) => [is_recording(s)] as const, (running) => {
    show_if(stop, running);
    show_if(unit, !running); // both do not fit beside the keys
  });
  store.watch((s) => [(s.demos?.length ?? 0) > 0] as const, (any) => show_if(to_train, any));

  return h("div", { class: "panel record-panel" },
    h("div", { class: "row spread" }, h("div", { class: "row tight" }, h("h2", {}, "Waypoints"), ...forms),
      h("div", { class: "row tight" }, h("button", { type: "button", class: "icon small", "aria-label": "undo", title: "undo (Ctrl+Z)", "data-testid": "undo", onclick: () => undo() }, "↶"),
        h("button", { type: "button", class: "icon small", "aria-label": "redo", title: "redo (Ctrl+Shift+Z)", "data-testid": "redo", onclick: () => redo() }, "↷"), own)),
    cards, editor, add_row(), jog_pad(),
    h("div", { class: "row tight" }, run, record, h("label", { class: "inline" }, h("span", { class: "times" }, "×"), episodes, unit), stop, keys),
    h("div", { class: "row spread job-row" }, job.element, tally, to_train),
    terms_block());
}
