// The live picture: one MJPEG stream, MuJoCo's mouse bindings, cameras and overlays under it.
import { act, close_trace, report } from "./actions";
import { address, api, type CameraDrag } from "./api";
import { fill, h, set_text, show_if } from "./dom";
import { LatestCall } from "./latest";
import { take_pointer, watch_picture } from "./picture_tools";
import { store } from "./store";
import { change_view, main_view, view_id } from "./view_settings";
import { view_toggle } from "./view_toggle";

const retry_ms = 1500;
const wheel_step = 0.05; // of the view height, for one notch of the wheel

const drags = new LatestCall<CameraDrag>((drag) => api.drag(view_id, drag), report);

function add_drags(waiting: CameraDrag, added: CameraDrag): CameraDrag {
  return waiting.action === added.action ? { ...added, dx: waiting.dx + added.dx, dy: waiting.dy + added.dy } : added;
}

/// Left rotates, right pans, middle zooms; Shift keeps to the horizontal. A camera of the scene gives way to the free one.
function listen_to_mouse(picture: HTMLImageElement): void {
  const actions: Record<number, CameraDrag["action"]> = { 0: "rotate", 1: "zoom", 2: "pan" };
  let held: CameraDrag["action"] | null = null;
  picture.addEventListener("contextmenu", (event) => event.preventDefault());
  picture.addEventListener("dragstart", (event) => event.preventDefault());
  picture.addEventListener("pointerdown", (event) => {
    held = take_pointer(event, picture) ? null : (actions[event.button] ?? null);
    if (!held) return;
    event.preventDefault();
    picture.setPointerCapture(event.pointerId);
    picture.classList.add("dragging");
  });
  picture.addEventListener("pointermove", (event) => {
    if (!held) return;
    const height = picture.clientHeight || 1;
    const dx = event.movementX / height;
    const dy = event.shiftKey ? 0 : event.movementY / height;
    if (dx !== 0 || dy !== 0) void drags.send({ action: held, dx, dy }, add_drags);
  });
  const release = () => {
    held = null;
    picture.classList.remove("dragging");
  };
  picture.addEventListener("pointerup", release);
  picture.addEventListener("pointercancel", release);
  picture.addEventListener("wheel", (event) => {
    event.preventDefault();
    void drags.send({ action: "zoom", dx: 0, dy: Math.sign(event.deltaY) * wheel_step }, add_drags);
  }, { passive: false });
}

function stream_picture(): HTMLImageElement {
  const picture = h("img", { class: "picture", alt: "live picture of the scene", "data-testid": "picture", draggable: "false" });
  let attempt = 0;
  let timer = 0;
  const start = () => {
    clearTimeout(timer);
    picture.src = address(`stream?view=${view_id}&attempt=${++attempt}`);
  };
  picture.addEventListener("error", () => {
    clearTimeout(timer);
    if (store.state.connection === "live") timer = window.setTimeout(start, retry_ms);
  });
  store.watch((s) => [s.connection === "live"] as const, (live) => {
    if (live) start();
    picture.classList.toggle("stale", !live);
  });
  listen_to_mouse(picture);
  watch_picture(picture);
  return picture;
}

function camera_title(name: string): string {
  return name.replaceAll("_", " ");
}

function camera_buttons(): HTMLElement {
  const bar = h("div", { class: "cameras", role: "group", "aria-label": "camera" });
  store.watch((s) => [s.snapshot?.cameras.join("\n") ?? "", main_view()?.camera ?? null] as const, (cameras, chosen) => {
    const names = cameras === "" ? [] : cameras.split("\n");
    const button = (name: string | null) =>
      h("button", {
        type: "button", class: "chip", "aria-pressed": String(chosen === name), "data-testid": `camera-${name ?? "free"}`,
        title: name ? `the scene's camera "${name}"` : "drag the picture: left rotates, right pans, wheel zooms",
        onclick: () => void act(() => change_view({ camera: name })),
      }, name ? camera_title(name) : "free");
    const focused = document.activeElement instanceof HTMLElement ? document.activeElement.dataset.testid : undefined;
    fill(bar, ...names.map(button), names.length > 0 && button(null));
    if (focused) bar.querySelector<HTMLElement>(`[data-testid="${focused}"]`)?.focus();
  });
  return bar;
}

function overlay_toggle(): HTMLElement {
  const legend = (["noise", "action", "inside", "expert"] as const).map((meaning) =>
    h("span", { class: "legend" }, h("i", { class: `dot ${meaning}` }), { noise: "t = 0 noise", action: "t = 1 action", inside: "region", expert: "expert" }[meaning]));
  const key = h("span", { class: "legends" }, ...legend);
  store.watch((s) => [s.trace !== null] as const, (has_trace) => show_if(key, has_trace));
  return h("div", { class: "overlays" }, key, h("label", { class: "check" }, view_toggle("overlays", true), "overlays"));
}

/// While a step is drawn the picture stands still at the moment of the prediction; this says so and leads back.
function shown_tag(): HTMLElement {
  const text = h("span");
  const back = h("button", { type: "button", class: "link", "data-testid": "back-to-live", onclick: () => void act(async () => close_trace()) }, "back to the live scene");
  const tag = h("div", { class: "shown-tag", "data-testid": "shown" }, text, back);
  store.watch((s) => [s.trace?.id, s.step] as const, (id, step) => {
    show_if(tag, id !== undefined);
    set_text(text, `${id ?? ""}, step ${step}`);
  });
  return tag;
}

export function view(): HTMLElement {
  const empty = h("p", { class: "stage-note", "data-testid": "stage-note" });
  store.watch((s) => [s.snapshot?.rendering_error ?? null] as const, (error) =>
    set_text(empty, error ? `No picture: ${error}. “flowscope doctor” says how to mend it.` : "waiting for the picture…"));
  const picture = stream_picture();
  picture.addEventListener("load", () => empty.remove(), { once: true });
  return h("section", { class: "stage", "aria-label": "live view" },
    h("div", { class: "screen" }, empty, picture, shown_tag()),
    h("div", { class: "view-bar" }, camera_buttons(), overlay_toggle()));
}
