// Working in the picture: a click makes a waypoint, a drag moves one, Alt and the wheel turn it.
import { act, report } from "./actions";
import { api } from "./api";
import { LatestCall } from "./latest";
import { compose, dot, inverse, minus, plus, project, ray, rotate, scaled } from "./math3";
import { at_world, edit_move, insert, remember, select, selected_move, turned, with_approach } from "./script_actions";
import { store } from "./store";
import type { Approach, Camera, MoveStep, Pose, Vec3 } from "./types";
import { view_id } from "./view_settings";

const near_px = 14;
const click_px = 4;
const approach_m = 0.08;
const clearance_m = 0.004; // of a tool point before a surface, as the server proposes it
const level_limit = 0.1; // a ray flatter than this would carry a point away along its plane
const turn_deg = 5; // a notch of the wheel

let camera: Camera | null = null;
const cameras = new LatestCall<void>(async () => {
  camera = await api.camera(view_id);
}, report);

let straight_in = false; // a picked point gets a waypoint before it, too
export function set_straight_in(on: boolean): void {
  straight_in = on;
}

export function set_pick(approach: Approach | null): void {
  store.set({ pick: approach });
}

/// Fractions of the shown picture, which keeps its shape inside its box; null beside it.
function place_in(picture: HTMLImageElement, event: MouseEvent): { u: number; v: number; width_px: number; height_px: number } | null {
  const box = picture.getBoundingClientRect();
  const scale = Math.min(box.width / picture.naturalWidth, box.height / picture.naturalHeight);
  const width_px = picture.naturalWidth * scale, height_px = picture.naturalHeight * scale;
  const u = (event.clientX - box.left - (box.width - width_px) / 2) / width_px;
  const v = (event.clientY - box.top - (box.height - height_px) / 2) / height_px;
  return u >= 0 && u <= 1 && v >= 0 && v <= 1 ? { u, v, width_px, height_px } : null;
}

/// The waypoint under the pointer, the selected one first.
function waypoint_at(picture: HTMLImageElement, event: MouseEvent): number | null {
  const place = place_in(picture, event);
  const { script, tab, trace } = store.state;
  if (!place || !camera || tab !== "record" || trace || script.problem) return null;
  let best: number | null = null, nearest = near_px;
  script.steps.forEach((step, i) => {
    const seen = step.kind === "move" && step.world ? project(camera!, step.world.position) : null;
    if (!seen) return;
    const apart = Math.hypot((seen.u - place.u) * place.width_px, (seen.v - place.v) * place.height_px);
    const closeness = i === script.selected ? apart - 4 : apart;
    if (closeness >= nearest) return;
    nearest = closeness;
    best = i;
  });
  return best;
}

// --- a click ------------------------------------------------------------------------------------------------------------

async function pick_at(place: { u: number; v: number }, approach: Approach): Promise<void> {
  const picked = await api.pick(view_id, { u: place.u, v: place.v });
  const proposal = picked.proposals.find((p) => p.approach === approach) ?? picked.proposals[0]!;
  const base = compose(proposal.world, inverse(proposal.step));
  const step: MoveStep = { ...proposal.step, world: proposal.world, base };
  await insert(straight_in ? with_approach(step, approach_m) : [step]);
}

// --- a drag -------------------------------------------------------------------------------------------------------------

interface Drag { index: number; moved: boolean }
let drag: Drag | null = null;

/// Where the pointer's ray meets the plane through `point`: level, or parallel to the picture.
function carried(at: Camera, point: Vec3, u: number, v: number, level: boolean): Vec3 {
  const { from, direction } = ray(at, u, v);
  const flat = level && Math.abs(direction[2]) > level_limit;
  const normal: Vec3 = flat ? [0, 0, 1] : rotate(at.world_from_camera.quaternion, [0, 0, 1]);
  const distance = dot(minus(point, from), normal) / dot(direction, normal);
  return distance > 0 ? plus(from, scaled(direction, distance)) : point;
}

const put = (index: number, place: (world: Pose) => Vec3) => edit_move(index, (step) =>
  step.world ? at_world(step, { ...step.world, position: place(step.world) }) : step, false);

const surfaces = new LatestCall<{ index: number; u: number; v: number }>(async ({ index, u, v }) => {
  const { point } = await api.pick(view_id, { u, v });
  if (drag?.index === index) await put(index, (world) => minus(point, scaled(rotate(world.quaternion, [0, 0, 1]), clearance_m)));
}, () => undefined); // beside everything the point stays where it was

const planes = new LatestCall<{ index: number; at: Camera; u: number; v: number; level: boolean }>(({ index, at, u, v, level }) =>
  put(index, (world) => carried(at, world.position, u, v, level)), report);

function drag_to(picture: HTMLImageElement, event: PointerEvent): void {
  const place = place_in(picture, event);
  if (!drag || !camera || !place) return;
  if (!drag.moved) {
    remember();
    drag.moved = true;
  }
  const { index } = drag, { u, v } = place;
  if (event.ctrlKey || event.metaKey) void surfaces.send({ index, u, v });
  else void planes.send({ index, at: camera, u, v, level: !event.shiftKey });
}

/// True when the pointer took hold of a waypoint: it does not turn the camera then.
export function take_pointer(event: PointerEvent, picture: HTMLImageElement): boolean {
  const index = event.button === 0 ? waypoint_at(picture, event) : null;
  const step = index === null ? undefined : store.state.script.steps[index];
  if (index === null || step?.kind !== "move" || !step.world) return false;
  event.preventDefault();
  select(index);
  drag = { index, moved: false };
  picture.setPointerCapture(event.pointerId);
  return true;
}

export function watch_picture(picture: HTMLImageElement): void {
  let pressed: { x: number; y: number } | null = null;
  picture.addEventListener("pointerdown", (event) => {
    pressed = event.button === 0 && !drag ? { x: event.clientX, y: event.clientY } : null;
  });
  picture.addEventListener("pointermove", (event) => {
    if (drag) return drag_to(picture, event);
    if (event.buttons === 0) picture.classList.toggle("over-waypoint", waypoint_at(picture, event) !== null);
  });
  picture.addEventListener("pointerup", (event) => {
    const { pick, tab } = store.state;
    const still = pressed !== null && Math.hypot(event.clientX - pressed.x, event.clientY - pressed.y) < click_px;
    const place = place_in(picture, event);
    const dragged = drag !== null;
    drag = null;
    pressed = null;
    if (!dragged && still && pick && place && tab === "record") void act(() => pick_at(place, pick));
  });
  picture.addEventListener("pointercancel", () => {
    drag = null;
    pressed = null;
  });
  picture.addEventListener("wheel", (event) => {
    const chosen = event.altKey && store.state.tab === "record" ? selected_move() : null;
    if (!chosen) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    const axis: Vec3 = event.shiftKey ? [0, 1, 0] : [0, 0, 1];
    const notches = Math.sign(event.deltaY || event.deltaX);
    void act(() => edit_move(chosen.index, (step) => (step.world ? turned(step, axis, turn_deg * notches) : step)));
  }, { passive: false, capture: true });
  store.watch((s) => [s.pick !== null && s.tab === "record"] as const, (picking) => picture.classList.toggle("picking", picking));
  // The camera moves with the settings of the view, and one that hangs on the arm with the arm.
  store.watch((s) => [s.connection === "live" && s.tab === "record", JSON.stringify(s.snapshot?.views ?? []),
    s.snapshot?.views[0]?.camera ? s.snapshot.time_s : 0, s.snapshot?.episode] as const, (wanted) => {
    if (wanted && store.state.snapshot) void cameras.send();
  });
}
