// Poses and pinhole cameras, as the server has them: metres, unit quaternions w,x,y,z; camera axes x right, y down, z forward.
import type { Camera, Pose, Quaternion, Vec3 } from "./types";

export const plus = (a: Vec3, b: Vec3): Vec3 => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const minus = (a: Vec3, b: Vec3): Vec3 => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const scaled = (a: Vec3, factor: number): Vec3 => [a[0] * factor, a[1] * factor, a[2] * factor];
export const dot = (a: Vec3, b: Vec3): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

export function product([aw, ax, ay, az]: Quaternion, [bw, bx, by, bz]: Quaternion): Quaternion {
  return [aw * bw - ax * bx - ay * by - az * bz, aw * bx + ax * bw + ay * bz - az * by,
    aw * by - ax * bz + ay * bw + az * bx, aw * bz + ax * by - ay * bx + az * bw];
}
export const conjugate = ([w, x, y, z]: Quaternion): Quaternion => [w, -x, -y, -z];
export function rotate(q: Quaternion, [x, y, z]: Vec3): Vec3 {
  const [, rx, ry, rz] = product(product(q, [0, x, y, z]), conjugate(q));
  return [rx, ry, rz];
}
export function about(axis: Vec3, angle_deg: number): Quaternion {
  const half = (angle_deg * Math.PI) / 360;
  return [Math.cos(half), ...scaled(axis, Math.sin(half))];
}
/// R = Rz(yaw) Ry(pitch) Rx(roll), degrees.
export function from_rpy_deg([roll, pitch, yaw]: Vec3): Quaternion {
  return product(product(about([0, 0, 1], yaw), about([0, 1, 0], pitch)), about([1, 0, 0], roll));
}
export const compose = (a: Pose, b: Pose): Pose =>
  ({ position: plus(a.position, rotate(a.quaternion, b.position)), quaternion: product(a.quaternion, b.quaternion) });
export function inverse({ position, quaternion }: Pose): Pose {
  const back = conjugate(quaternion);
  return { position: scaled(rotate(back, position), -1), quaternion: back };
}

/// Fractions of the picture's width and height, and the depth; null behind the camera.
export function project(camera: Camera, point: Vec3): { u: number; v: number; depth: number } | null {
  const [x, y, z] = compose(inverse(camera.world_from_camera), { position: point, quaternion: [1, 0, 0, 0] }).position;
  if (z <= 0) return null;
  return { u: ((camera.fx * x) / z + camera.cx) / camera.width, v: ((camera.fy * y) / z + camera.cy) / camera.height, depth: z };
}
/// The ray of a place in the picture; `direction` has length 1 along the camera's z.
export function ray(camera: Camera, u: number, v: number): { from: Vec3; direction: Vec3 } {
  const { position, quaternion } = camera.world_from_camera;
  return { from: position, direction: rotate(quaternion, [(u * camera.width - camera.cx) / camera.fx, (v * camera.height - camera.cy) / camera.fy, 1]) };
}
