// SPDX-License-Identifier: Apache-2.0
// A camera that orbits a target, z up, and what it makes of points: matrices are column-major, as
// WebGL takes them.

const PITCH_MAX = 1.55;
const FIELD_OF_VIEW = 0.8;
/** Share of the picture that a framed box takes. */
const FRAMED = 0.95;

/** The product a * b of two 4x4 matrices. */
function times(a, b) {
  const out = new Float64Array(16);
  for (let column = 0; column < 4; ++column) {
    for (let row = 0; row < 4; ++row) {
      let sum = 0;
      for (let k = 0; k < 4; ++k) sum += a[k * 4 + row] * b[column * 4 + k];
      out[column * 4 + row] = sum;
    }
  }
  return out;
}

export class Camera {
  constructor() {
    /** Point in the middle of the picture, map frame, metres. */
    this.target = [0, 0, 0];
    this.distance = 30;
    /** Heading of the view in radians, and how far it looks down. */
    this.yaw = 0.9;
    this.pitch = 0.9;
  }

  /** Where the camera is. */
  get eye() {
    const flat = Math.cos(this.pitch) * this.distance;
    return [
      this.target[0] - Math.cos(this.yaw) * flat,
      this.target[1] - Math.sin(this.yaw) * flat,
      this.target[2] + Math.sin(this.pitch) * this.distance,
    ];
  }

  /** Right, up and forward. */
  #axes() {
    const [cy, sy] = [Math.cos(this.yaw), Math.sin(this.yaw)];
    const [cp, sp] = [Math.cos(this.pitch), Math.sin(this.pitch)];
    return {right: [sy, -cy, 0], up: [cy * sp, sy * sp, cp], forward: [cy * cp, sy * cp, -sp]};
  }

  orbit(dx, dy) {
    this.yaw -= dx;
    this.pitch = Math.min(PITCH_MAX, Math.max(-PITCH_MAX, this.pitch + dy));
  }

  /** Moves the target with the pointer; dx, dy as shares of the picture's height. */
  pan(dx, dy) {
    const {right, up} = this.#axes();
    const reach = 2 * Math.tan(FIELD_OF_VIEW / 2) * this.distance;
    for (let i = 0; i < 3; ++i) this.target[i] += (-dx * right[i] + dy * up[i]) * reach;
  }

  /** Towards a point that stays where it is on the screen. */
  zoom(factor, point) {
    const next = Math.min(20000, Math.max(0.2, this.distance * factor));
    const share = 1 - next / this.distance;
    this.distance = next;
    if (!point) return;
    for (let i = 0; i < 3; ++i) this.target[i] += (point[i] - this.target[i]) * share;
  }

  /** Shows a box whole, in a picture that is `aspect` times as wide as high. */
  frame(min, max, aspect) {
    this.target = min.map((value, i) => (value + max[i]) / 2);
    const {right, up, forward} = this.#axes();
    const high = Math.tan(FIELD_OF_VIEW / 2) * FRAMED;
    this.distance = 2;
    for (let corner = 0; corner < 8; ++corner) {
      const offset = min.map((low, i) => (corner >> i & 1 ? max[i] : low) - this.target[i]);
      const along = (axis) => axis[0] * offset[0] + axis[1] * offset[1] + axis[2] * offset[2];
      const reach = Math.max(Math.abs(along(up)), Math.abs(along(right)) / aspect) / high;
      this.distance = Math.max(this.distance, reach - along(forward));
    }
  }

  /**
   * The map frame to clip space, in doubles. With an origin: from a frame with the same axes that
   * begins there, whose coordinates are small enough for floats.
   */
  matrix(aspect, origin = [0, 0, 0]) {
    const {right, up, forward} = this.#axes();
    const eye = this.eye.map((value, i) => value - origin[i]);
    const dot = (a) => a[0] * eye[0] + a[1] * eye[1] + a[2] * eye[2];
    const view = Float64Array.of(
        right[0], up[0], -forward[0], 0, right[1], up[1], -forward[1], 0,
        right[2], up[2], -forward[2], 0, -dot(right), -dot(up), dot(forward), 1);
    const near = Math.max(0.02, this.distance / 200);
    const far = this.distance * 20 + 200;
    const f = 1 / Math.tan(FIELD_OF_VIEW / 2);
    const projection = Float64Array.of(
        f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0,
        2 * far * near / (near - far), 0);
    return times(projection, view);
  }

  /** How large a metre is in a picture of this height, so far in front of the camera. */
  pixelsPerMetre(depth, height) {
    return height / (2 * Math.tan(FIELD_OF_VIEW / 2) * depth);
  }

  /** The ray through a point of the picture; x and y from -1 to 1, y up. */
  ray(x, y, aspect) {
    const {right, up, forward} = this.#axes();
    const half = Math.tan(FIELD_OF_VIEW / 2);
    const direction = [0, 1, 2].map(
        (i) => forward[i] + right[i] * x * half * aspect + up[i] * y * half);
    const length = Math.hypot(...direction);
    return {origin: this.eye, direction: direction.map((value) => value / length)};
  }
}

/**
 * Where a point of the map is in the picture, in pixels; null behind the camera.
 * @returns {{x: number, y: number, depth: number} | null}
 */
export function project(matrix, point, width, height) {
  const [x, y, z] = point;
  const w = matrix[3] * x + matrix[7] * y + matrix[11] * z + matrix[15];
  if (w <= 0) return null;
  const clip = (row) =>
      (matrix[row] * x + matrix[row + 4] * y + matrix[row + 8] * z + matrix[row + 12]) / w;
  return {x: (clip(0) + 1) / 2 * width, y: (1 - clip(1)) / 2 * height, depth: w};
}
