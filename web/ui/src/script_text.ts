// A waypoint script as text whose steps can be changed one by one; comments and the other lines stay as they are.
import { rpy_deg } from "./format";
import type { Step } from "./types";

const plain = (value: number, digits: number) => String(Number(value.toFixed(digits)) || 0);
const listed = (values: readonly number[], digits: number) => `[${values.map((v) => plain(v, digits)).join(", ")}]`;
const word = (text: string) => (/^[A-Za-z_][\w-]*$/.test(text) ? text : JSON.stringify(text));

/// One step in one line, to a tenth of a millimetre and a hundredth of a degree.
export function step_text(step: Step): string {
  if (step.kind === "gripper") return `gripper: ${step.openness === 1 ? "open" : step.openness === 0 ? "close" : plain(step.openness, 3)}`;
  const angles = rpy_deg(step.quaternion);
  const upright = Math.abs(angles[1]) > 89; // there roll and yaw turn about one axis
  const rotation = upright ? `quaternion: ${listed(step.quaternion, 6)}` :
    `rpy_deg: ${listed(angles.map((a) => (a < -179.995 ? a + 360 : a)), 2)}`;
  return `move: {frame: ${word(step.frame)}, position: ${listed(step.position, 4)}, ${rotation}` +
    (step.path === "linear" ? ", path: linear" : "") + (step.ignore_collisions ? ", ignore_collisions: true" : "") +
    (step.yaw_symmetry === 1 ? "" : `, yaw_symmetry: ${step.yaw_symmetry}`) + "}";
}

interface Parts { head: string[]; blocks: string[][]; tail: string[]; indent: string }

/// Each step's lines, from its own to the next one's; a script that is not written line by line is written anew.
function parts_of(text: string, steps: Step[], task: string): Parts {
  const lines = text.split("\n");
  const starts = steps.map((step) => (step.line ?? 0) - 1);
  const indent = /^(\s*)-\s/.exec(lines[starts[0] ?? -1] ?? "")?.[1] ?? "  ";
  const by_line = starts.every((line, i) => line > (starts[i - 1] ?? 0) && /^\s*-\s/.test(lines[line] ?? ""));
  if (!by_line || steps.length === 0) {
    return { head: [`task: ${task}`, "steps:"], blocks: steps.map((step) => [`  - ${step_text(step)}`]), tail: [""], indent: "  " };
  }
  const blocks = starts.map((line, i) => lines.slice(line, starts[i + 1] ?? lines.length));
  const last = blocks.at(-1)!;
  let end = last.length;
  while (end > 1 && /^\s*(#.*)?$/.test(last[end - 1]!)) --end;
  return { head: lines.slice(0, starts[0]), blocks, tail: last.splice(end), indent };
}

const comment_of = (line: string) => /[}\w]\s*(#.*)$/.exec(line)?.[1];

function joined({ head, blocks, tail }: Parts): string {
  return [...head, ...blocks.flat(), ...tail].join("\n");
}

export interface Edit { text: string; steps: Step[]; task: string }

export function replace_step({ text, steps, task }: Edit, index: number, step: Step): string {
  const parts = parts_of(text, steps, task);
  const old = parts.blocks[index]!;
  const comment = comment_of(old[0]!);
  parts.blocks[index] = [`${parts.indent}- ${step_text(step)}${comment ? `   ${comment}` : ""}`, ...old.slice(1).filter((l) => /^\s*(#.*)?$/.test(l))];
  return joined(parts);
}

export function insert_steps({ text, steps, task }: Edit, index: number, added: Step[]): string {
  const parts = parts_of(text, steps, task);
  parts.blocks.splice(index, 0, ...added.map((step) => [`${parts.indent}- ${step_text(step)}`]));
  return joined(parts);
}

export function remove_step({ text, steps, task }: Edit, index: number): string {
  const parts = parts_of(text, steps, task);
  parts.blocks.splice(index, 1);
  return joined(parts);
}

export function move_step({ text, steps, task }: Edit, from: number, to: number): string {
  const parts = parts_of(text, steps, task);
  parts.blocks.splice(to, 0, ...parts.blocks.splice(from, 1));
  return joined(parts);
}
