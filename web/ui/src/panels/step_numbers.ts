// The numbers of the shown step, and how far the prediction ends from the expert's keyframe.
import { flow_color } from "../colors";
import { h, set_text, show_if } from "../dom";
import { degrees, distance_m, metres, milliseconds, millimetres, norm, percent, rpy_deg } from "../format";
import { store } from "../store";
import type { Trace } from "../types";

type Row = { label: string; test_id: string; tone?: string; text: (trace: Trace, k: number) => string };

const rows: Row[] = [
  { label: "position x, y, z", test_id: "step-position", text: (t, k) => t.steps[k]!.pose.position.map((v) => metres(v)).join("  ") },
  { label: "roll, pitch, yaw", test_id: "step-rotation", text: (t, k) => rpy_deg(t.steps[k]!.pose.quaternion).map(degrees).join("  ") },
  { label: "speed |v|", test_id: "step-speed", text: (t, k) => (k < t.steps.length - 1 ? `${norm(t.steps[k]!.velocity).toFixed(3)} per unit t` : "at the end") },
  { label: "perception radius", test_id: "step-radius", tone: "inside", text: (t, k) => metres(t.steps[k]!.region.radius) },
  { label: "points inside", test_id: "step-points", tone: "inside", text: (t, k) => String(t.steps[k]!.region.points) },
  { label: "gripper open", test_id: "step-open", text: (t, k) => percent(t.steps[k]!.open_probability) },
  { label: "evaluation", test_id: "step-ms", text: (t, k) => (k < t.steps.length - 1 ? milliseconds(t.steps[k]!.ms) : "–") },
  { label: "to expert here", test_id: "step-expert", tone: "expert",
    text: (t, k) => (t.expert ? millimetres(distance_m(t.steps[k]!.pose.position, t.expert.position)) : "no expert") },
];

function verdict(trace: Trace): string {
  const { error } = trace;
  if (!error) return "No expert keyframe for this scene: reset the scene to compare.";
  return `Ends ${millimetres(error.position_m)} and ${degrees(error.rotation_deg)} from the expert; gripper ${error.open_correct ? "as" : "not as"} the expert's.`;
}

/// The other trace at the same flow time (its nearest step), and where it ends.
function comparison(trace: Trace, other: Trace, k: number): string {
  const { t, pose } = trace.steps[k]!;
  const there = other.steps.reduce((best, step) => (Math.abs(step.t - t) < Math.abs(best.t - t) ? step : best));
  return `Beside ${other.id}: ${millimetres(distance_m(pose.position, there.pose.position))} apart at t = ${there.t.toFixed(3)}, ` +
    `${millimetres(distance_m(trace.result.position, other.result.position))} at the end.`;
}

export function step_numbers(): HTMLElement {
  const heading = h("b", { class: "t", "data-testid": "step-t" });
  const origin = h("span", { class: "quiet", "data-testid": "trace-origin" });
  const cells = rows.map((row) => h("dd", { "data-testid": row.test_id, ...(row.tone ? { class: `${row.tone}-text` } : {}) }));
  const list = h("dl", { class: "numbers" }, ...rows.flatMap((row, i) => [h("dt", {}, row.label), cells[i]!]));
  const error = h("p", { class: "verdict", "data-testid": "trace-error" });
  const beside = h("p", { class: "quiet", "data-testid": "comparison" });
  const element = h("section", { class: "step-numbers" }, h("div", { class: "row spread" }, heading, origin), list, error, beside);
  store.watch((s) => [s.trace, s.other, s.step] as const, (trace, other, step) => {
    const now = trace?.steps[step];
    show_if(element, now !== undefined);
    if (!trace || !now) return;
    set_text(heading, `step ${now.k} of ${trace.steps.length - 1}   t = ${now.t.toFixed(3)}`);
    heading.style.color = flow_color(now.t);
    const { policy, radius, parent } = trace;
    set_text(origin, parent ? `branched from ${parent.trace} at step ${parent.step}` :
      `${policy.backbone}, ${policy.objective}, ${radius.kind} radius, ${trace.integrator}, seed ${trace.seed}, weights ${policy.generation}`);
    origin.title = origin.textContent ?? "";
    rows.forEach((row, i) => set_text(cells[i]!, row.text(trace, step)));
    set_text(error, verdict(trace));
    show_if(beside, other !== null);
    set_text(beside, other ? comparison(trace, other, step) : "");
    error.dataset.tone = trace.error ? "expert" : "off";
  });
  return element;
}
