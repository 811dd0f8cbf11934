// Numbers as text with their unit, in fixed widths so that nothing jumps.
import type { Quaternion, Vec3 } from "./types";

const thin = "\u202f"; // thin no-break space between number and unit, and between thousands

export function metres(value: number, digits = 3): string {
  return `${minus(value.toFixed(digits))}${thin}m`;
}
export function millimetres(metres_value: number): string {
  return `${minus((metres_value * 1000).toFixed(1))}${thin}mm`;
}
export function degrees(value: number): string {
  return `${minus(value.toFixed(1))}°`;
}
export function milliseconds(value: number): string {
  return `${value.toFixed(value < 10 ? 2 : 1)}${thin}ms`;
}
export function percent(fraction: number): string {
  return `${(fraction * 100).toFixed(0)}${thin}%`;
}
export function count(value: number): string {
  return String(Math.round(value)).replace(/\B(?=(\d{3})+$)/g, thin);
}
export function bytes(value: number): string {
  if (value < 1e3) return `${value}${thin}B`;
  return value < 1e6 ? `${(value / 1e3).toFixed(0)}${thin}kB` : `${(value / 1e6).toFixed(1)}${thin}MB`;
}
export function minutes(value: number): string {
  return `${value.toFixed(1)}${thin}min`;
}
/// 3 significant digits without an exponent for the sizes a loss has.
export function loss(value: number): string {
  return Number.isFinite(value) ? Number(value.toPrecision(3)).toString() : "–";
}
export function clock(iso: string): string {
  const date = new Date(iso);
  return Number.isNaN(date.getTime()) ? iso : date.toLocaleString(undefined, { dateStyle: "short", timeStyle: "short" });
}
function minus(text: string): string {
  const positive = text.replace("-", "");
  return Number(positive) === 0 ? positive : text.replace("-", "\u2212");
}

/// Roll, pitch, yaw in degrees: R = Rz(yaw) Ry(pitch) Rx(roll).
export function rpy_deg([w, x, y, z]: Quaternion): Vec3 {
  const roll = Math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y));
  const pitch = Math.asin(Math.max(-1, Math.min(1, 2 * (w * y - z * x))));
  const yaw = Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z));
  return [roll, pitch, yaw].map((angle) => (angle * 180) / Math.PI) as Vec3;
}
export function norm(values: readonly number[]): number {
  return Math.hypot(...values);
}
export function distance_m(a: Vec3, b: Vec3): number {
  return Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}
