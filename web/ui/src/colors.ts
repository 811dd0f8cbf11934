// The twin of render/overlay.h's palette: a colour means the same in the picture, the curves and the numbers.
export const palette = {
  noise: "rgb(140, 92, 245)", // violet: t = 0
  action: "rgb(250, 191, 36)", // amber: t = 1
  region: "rgba(33, 212, 237, 0.22)", // cyan: perception sphere
  inside: "rgb(33, 212, 237)", // cyan: points inside it
  expert: "rgb(74, 222, 128)", // green
  prediction: "rgba(250, 191, 36, 0.7)", // amber
  failure: "rgb(247, 112, 112)", // red
  met: "rgba(74, 222, 128, 0.2)", // green: a success term that holds
  unmet: "rgba(245, 115, 181, 0.2)", // pink: one that does not
} as const;

/// What the curves share with the page's style sheet.
export const chart = {
  text: "rgb(139, 148, 163)",
  grid: "rgba(148, 163, 184, 0.10)",
  neutral: "rgb(203, 213, 225)",
  position: "rgb(124, 199, 247)",
  rotation: "rgb(203, 213, 225)",
  other: "rgba(203, 213, 225, 0.45)",
} as const;

/// The flow's colour at time t: the blend that the picture uses along the trajectory.
export function flow_color(t: number): string {
  const clamped = Math.min(1, Math.max(0, t));
  const ends = [[140, 92, 245], [250, 191, 36]] as const;
  const mixed = ends[0].map((from, i) => Math.round(from + (ends[1][i]! - from) * clamped));
  return `rgb(${mixed.join(", ")})`;
}
