// SPDX-License-Identifier: Apache-2.0
// Triangles and lines of boxes, prisms and people, appended to growing rows. A vertex is six
// floats: position in metres from the scene's origin, colour and opacity as four bytes in one,
// how light it is, and its lift (which step of the exploded view).

const FLOATS_PER_VERTEX = 6;
/** Sizes of a vertex's attributes, as Buffer of card.js takes them. */
export const VERTEX = [3, 'bytes', 1, 1];

const colorBytes = new Uint8Array(4);
const colorFloat = new Float32Array(colorBytes.buffer);

/** Four bytes as one float, as the vertex format has them. */
export function packed([red, green, blue], opacity) {
  colorBytes[0] = red;
  colorBytes[1] = green;
  colorBytes[2] = blue;
  // The pattern of a NaN would not survive: the opacity has seven bits.
  colorBytes[3] = Math.round(Math.min(1, Math.max(0, opacity)) * 126);
  return colorFloat[0];
}

/** Rows of floats that grow; doubled when full, so that appending is cheap. */
export class Rows {
  /** @param {number} width floats of a row */
  constructor(width, capacity) {
    this.width = width;
    this.data = new Float32Array(capacity * width);
    this.count = 0;
  }

  /** The part that is filled. */
  get filled() {
    return this.data.subarray(0, this.count * this.width);
  }

  append(row) {
    if ((this.count + 1) * this.width > this.data.length) {
      const larger = new Float32Array(this.data.length * 2);
      larger.set(this.data);
      this.data = larger;
    }
    this.data.set(row, this.count++ * this.width);
  }
}

/** Vertices as the head of this file says. */
export class Vertices extends Rows {
  /** @param {number[]} origin what positions are written relative to, metres */
  constructor(origin, capacity = 1024) {
    super(FLOATS_PER_VERTEX, capacity);
    this.origin = origin;
  }

  push(x, y, z, color, shade, lift) {
    const [ox, oy, oz] = this.origin;
    this.append([x - ox, y - oy, z - oz, color, shade, lift]);
  }
}

// Faces of a box by corner (bit 0: x, bit 1: y, bit 2: z), and how light each is.
const FACES = [
  [0, 2, 6, 4, 0.62], [1, 5, 7, 3, 0.8], [0, 4, 5, 1, 0.7], [2, 3, 7, 6, 0.74],
  [0, 1, 3, 2, 0.5], [4, 6, 7, 5, 1],
];
const BOX_EDGES = [
  0, 1, 1, 3, 3, 2, 2, 0, 4, 5, 5, 7, 7, 6, 6, 4, 0, 4, 1, 5, 2, 6, 3, 7,
];

/** A point of a frame in the map: position and orientation (x, y, z, w). */
export function transformed(position, orientation, point) {
  const [qx, qy, qz, qw] = orientation;
  const [x, y, z] = point;
  const tx = 2 * (qy * z - qz * y);
  const ty = 2 * (qz * x - qx * z);
  const tz = 2 * (qx * y - qy * x);
  return [
    position[0] + x + qw * tx + qy * tz - qz * ty,
    position[1] + y + qw * ty + qz * tx - qx * tz,
    position[2] + z + qw * tz + qx * ty - qy * tx,
  ];
}

/** The eight corners of a node's box. */
function boxCorners(box, position, orientation) {
  const corners = [];
  for (let i = 0; i < 8; ++i) {
    corners.push(transformed(position, orientation, [
      (i & 1 ? box.max : box.min)[0], (i & 2 ? box.max : box.min)[1],
      (i & 4 ? box.max : box.min)[2],
    ]));
  }
  return corners;
}

export function addBox(out, box, position, orientation, rgb, opacity, lift) {
  const corners = boxCorners(box, position, orientation);
  const color = packed(rgb, opacity);
  for (const [a, b, c, d, shade] of FACES) {
    for (const i of [a, b, c, a, c, d]) out.push(...corners[i], color, shade, lift);
  }
}

export function addBoxEdges(out, box, position, orientation, rgb, opacity, lift) {
  const corners = boxCorners(box, position, orientation);
  const color = packed(rgb, opacity);
  for (const i of BOX_EDGES) out.push(...corners[i], color, 1, lift);
}

export function addLine(out, from, to, rgb, opacity, fromLift, toLift = fromLift) {
  const color = packed(rgb, opacity);
  out.push(...from, color, 1, fromLift);
  out.push(...to, color, 1, toLift);
}

export function addPoint(out, position, rgb, opacity, lift) {
  out.push(...position, packed(rgb, opacity), 1, lift);
}

export function addTriangle(out, a, b, c, rgb, opacity, shade, lift) {
  const color = packed(rgb, opacity);
  for (const point of [a, b, c]) out.push(...point, color, shade, lift);
}

/** The corners of the face of a mesh that begins at an index into its faces. */
export function cornersOf({positions, faces}, i) {
  return [0, 1, 2].map((k) => positions.subarray(faces[i + k] * 3, faces[i + k] * 3 + 3));
}

/** A face of a mesh: the flatter it lies, the lighter it is. */
export function addFace(out, a, b, c, rgb, opacity) {
  const u = [b[0] - a[0], b[1] - a[1], b[2] - a[2]];
  const v = [c[0] - a[0], c[1] - a[1], c[2] - a[2]];
  const normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
  const length = Math.hypot(...normal) || 1;
  const shade = 0.55 + 0.35 * Math.abs(normal[2] / length) + 0.1 * (normal[0] / length);
  addTriangle(out, a, b, c, rgb, opacity, shade, 0);
}

function cross(o, a, b) {
  return (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0]);
}

function isInside(a, b, c, p) {
  return cross(a, b, p) >= 0 && cross(b, c, p) >= 0 && cross(c, a, p) >= 0;
}

/**
 * Triangles of a simple polygon, by cutting ears. Of one that crosses itself, as far as it goes.
 * @param {number[][]} outline corners [x, y] in order
 * @returns {number[][][]}
 */
export function triangulated(outline) {
  let area = 0;
  outline.forEach((point, i) => {
    const next = outline[(i + 1) % outline.length];
    area += point[0] * next[1] - next[0] * point[1];
  });
  const left = area < 0 ? [...outline].reverse() : [...outline];
  const triangles = [];
  while (left.length >= 3) {
    const at = left.findIndex((corner, i) => {
      const before = left[(i + left.length - 1) % left.length];
      const after = left[(i + 1) % left.length];
      if (cross(before, corner, after) <= 0) return false;
      return !left.some((point) => point !== before && point !== corner && point !== after &&
                                   isInside(before, corner, after, point));
    });
    if (at < 0) break;
    const before = left[(at + left.length - 1) % left.length];
    const after = left[(at + 1) % left.length];
    triangles.push([before, left[at], after]);
    left.splice(at, 1);
  }
  return triangles;
}

/** A room: its floor filled, its outline at the floor and at `top`, and its upright edges. */
export function addPrism(triangles, lines, outline, bottom, top, rgb, opacity, lift) {
  for (const [a, b, c] of triangulated(outline)) {
    addTriangle(triangles, [...a, bottom], [...b, bottom], [...c, bottom], rgb, opacity, 1, lift);
  }
  outline.forEach((a, i) => {
    const b = outline[(i + 1) % outline.length];
    addLine(lines, [...a, bottom], [...b, bottom], rgb, 0.9, lift);
    if (top <= bottom) return;
    addLine(lines, [...a, top], [...b, top], rgb, 0.35, lift);
    addLine(lines, [...a, bottom], [...a, top], rgb, 0.35, lift);
  });
}

const SIDES = 10;
// Half the outline of a standing person: radius and height as shares of the whole height.
const FIGURE = [
  [0.05, 0], [0.08, 0.02], [0.09, 0.48], [0.12, 0.6], [0.13, 0.76], [0.11, 0.81], [0.04, 0.83],
  [0.035, 0.86], [0.062, 0.89], [0.068, 0.93], [0.05, 0.98], [0, 1],
];

/** A standing figure whose feet are at `foot`. */
export function addFigure(out, foot, height, rgb, opacity, lift) {
  const color = packed(rgb, opacity);
  for (let ring = 0; ring + 1 < FIGURE.length; ++ring) {
    const [r0, z0] = FIGURE[ring];
    const [r1, z1] = FIGURE[ring + 1];
    for (let i = 0; i < SIDES; ++i) {
      const [a, b] = [i, i + 1].map((side) => 2 * Math.PI * side / SIDES);
      const shade = 0.75 + 0.25 * Math.cos(a - 0.9);
      const at = (angle, r, z) => [
        foot[0] + Math.cos(angle) * r * height, foot[1] + Math.sin(angle) * r * height,
        foot[2] + z * height,
      ];
      for (const point of [at(a, r0, z0), at(b, r0, z0), at(b, r1, z1), at(a, r0, z0),
                           at(b, r1, z1), at(a, r1, z1)]) {
        out.push(...point, color, shade, lift);
      }
    }
  }
}
