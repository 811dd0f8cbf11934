// Moving the tool by hand: a button for every key, the speed, and what came of it.
import { act } from "../actions";
import { leave_now, save_by_hand, unsaved_by_hand } from "../by_hand";
import { h, set_text, show_if } from "../dom";
import { metres, rpy_deg, degrees } from "../format";
import { fingers_open, jog_axes, jog_button, jog_settings, mark_here, toggle_gripper, undo_jog } from "../jog";
import { store } from "../store";

const full_mm_s = 250;
const frame_s = 0.05;

function axis_buttons(): HTMLElement {
  return h("div", { class: "jog-axes", role: "group", "aria-label": "move the tool" }, ...jog_axes.map((axis) => {
    const button = h("button", { type: "button", class: "jog", title: `${axis.title} (hold ${axis.key.toUpperCase()})`, "data-testid": `jog-${axis.key}`, "aria-label": `${axis.label}, ${axis.title}` },
      h("span", {}, axis.label), h("kbd", {}, axis.key.toUpperCase()));
    jog_button(button, axis);
    return button;
  }));
}

function settings(): HTMLElement {
  const frame = h("select", { "data-testid": "jog-frame", "aria-label": "axes", title: "whose axes: the world's or the tool's" },
    h("option", { value: "world" }, "world"), h("option", { value: "tool" }, "tool"));
  frame.addEventListener("change", () => {
    jog_settings.frame = frame.value === "tool" ? "tool" : "world";
  });
  const readout = h("span", { class: "unit jog-speed" });
  const speed = h("input", { type: "range", min: 0.04, max: 1, step: 0.04, value: jog_settings.speed, "data-testid": "jog-speed", "aria-label": "speed" });
  const said = () => {
    jog_settings.speed = speed.valueAsNumber;
    set_text(readout, `${Math.round(full_mm_s * jog_settings.speed)} mm/s`);
  };
  speed.addEventListener("input", said);
  said();
  const touch = h("input", { type: "checkbox", "data-testid": "jog-touch" });
  touch.addEventListener("change", () => {
    jog_settings.may_touch = touch.checked;
  });
  const fingers = h("button", { type: "button", class: "tiny", "data-testid": "jog-gripper", title: "open or close the fingers (g)", onclick: () => void act(toggle_gripper, fingers) });
  store.watch((s) => [s.teleop?.openness] as const, () => set_text(fingers, fingers_open() ? "close G" : "open G"));
  const undo = h("button", { type: "button", class: "tiny", "data-testid": "jog-undo", title: "take the last movement by hand back (b)", onclick: () => void act(undo_jog, undo) }, "back B");
  store.watch((s) => [(s.teleop?.strokes ?? 0) > 0] as const, (any) => {
    undo.disabled = !any;
  });
  const mark = h("button", { type: "button", class: "tiny", "data-testid": "jog-mark", title: "the tool's pose becomes a waypoint and a keyframe (k)", onclick: () => void act(mark_here, mark) }, "waypoint K");
  return h("div", { class: "row tight jog-settings" }, frame, speed, readout,
    h("label", { class: "check", title: "push on what is in the way, instead of stopping at it" }, touch, "push"), fingers, undo, mark);
}

function said(): HTMLElement {
  const text = h("span", { class: "jog-said", "data-testid": "jog-said" });
  store.watch((s) => [s.teleop] as const, (now) => {
    if (!now) return set_text(text, "");
    const stopped = now.jog === "blocked" || now.jog === "unreachable";
    text.classList.toggle("failure-text", stopped);
    set_text(text, stopped ? `${now.jog === "blocked" ? "In the way: " : "Out of reach: "}${now.message}` :
      `tool ${now.position.map((v) => metres(v)).join("  ")}   ${rpy_deg(now.quaternion).map((a) => degrees(a)).join(" ")}`);
    text.title = text.textContent ?? "";
  });
  return text;
}

/// What was moved by hand is saved when the task succeeded; otherwise only on a second word.
function session_row(): HTMLElement {
  const text = h("span", { class: "quiet", "data-testid": "session" });
  const save = h("button", { type: "button", class: "record", "data-testid": "save-session", title: "keep what was moved by hand since the reset as a demonstration",
    onclick: () => void act(async () => {
      if (store.state.snapshot?.success) await save_by_hand(false);
      else store.set({ ask: "save" });
    }, save) }, "● Save");
  const anyway = h("button", { type: "button", class: "danger", "data-testid": "save-anyway",
    onclick: () => void act(() => save_by_hand(!store.state.snapshot?.success), anyway) });
  const leave = h("button", { type: "button", "data-testid": "leave-session", onclick: () => void act(leave_now, leave) });
  const stay = h("button", { type: "button", "data-testid": "stay", onclick: () => store.set({ ask: null }) }, "Go on");
  const row = h("div", { class: "row tight session-row", "data-testid": "session-row" }, text, save, anyway, leave, stay);
  store.watch((s) => [s.ask, s.teleop?.by_hand, s.teleop?.frames, s.teleop?.marks, s.snapshot?.success, s.snapshot?.episode] as const, (ask, by_hand, frames, marks, success) => {
    row.classList.toggle("off", !by_hand);
    show_if(save, ask === null);
    show_if(anyway, ask !== null);
    show_if(leave, ask !== null && ask !== "save");
    set_text(anyway, success ? "Save it" : "Save all the same");
    set_text(leave, ask === "next" ? "Next without it (n)" : ask === "reset" ? "Reset without it (r)" : "Leave without it");
    show_if(stay, ask !== null);
    save.disabled = !by_hand || !unsaved_by_hand();
    const seconds = ((frames ?? 0) * frame_s).toFixed(1);
    set_text(text, ask !== null ? (success ? "Not saved." : "Not done.") : !by_hand ? "Nothing moved by hand yet." :
      `By hand: ${seconds} s, ${marks ?? 0} keyframe${marks === 1 ? "" : "s"} marked${success ? "; done" : ""}.`);
  });
  return row;
}

export function jog_pad(): HTMLElement {
  return h("section", { class: "block jog-pad", "aria-label": "move by hand" }, axis_buttons(), settings(), said(), session_row());
}
