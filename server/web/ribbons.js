// SPDX-License-Identifier: Apache-2.0
// Lines with a width in pixels, which WebGL's own lines have not: each piece is a rectangle on the
// screen with round ends, so that the pieces of a way join without gaps.
import {Buffer, linked} from './card.js';
import {Rows, packed} from './shapes.js';

/** Two ends, colour, which corner it is (two bits: the end, the side), and the width. */
const FLOATS_PER_VERTEX = 9;
const CORNERS = [0, 1, 2, 2, 1, 3];
const RING_PIECES = 32;

const VERTEX_SHADER = `#version 300 es
layout(location = 0) in vec3 from;
layout(location = 1) in vec3 to;
layout(location = 2) in vec4 color;
layout(location = 3) in float corner;
layout(location = 4) in float width;
uniform mat4 matrix;
uniform vec2 half_size;
out vec4 tint;
// Pixels along the piece from its begin, and beside it; its length; half its width.
out vec2 spot;
out float span;
out float half_width;
const float NEAR = 0.01;
// Nearer to the front by so much, so that floors do not swallow what lies on them.
const float BIAS = 0.0008;
void main() {
  vec4 a = matrix * vec4(from, 1);
  vec4 b = matrix * vec4(to, 1);
  if (a.w < NEAR && b.w < NEAR) {
    gl_Position = vec4(2, 2, 2, 1);
    return;
  }
  if (a.w < NEAR) a = mix(a, b, (NEAR - a.w) / (b.w - a.w));
  if (b.w < NEAR) b = mix(b, a, (NEAR - b.w) / (a.w - b.w));
  vec2 begin = a.xy / a.w * half_size;
  vec2 end = b.xy / b.w * half_size;
  span = length(end - begin);
  vec2 along = span > 0.001 ? (end - begin) / span : vec2(1, 0);
  float isEnd = floor(corner / 2.0);
  float side = mod(corner, 2.0) * 2.0 - 1.0;
  half_width = width / 2.0;
  float reach = half_width + 1.0;
  spot = vec2(isEnd > 0.5 ? span + reach : -reach, side * reach);
  vec2 at = begin + along * spot.x + vec2(-along.y, along.x) * spot.y;
  float depth = isEnd > 0.5 ? b.z / b.w : a.z / a.w;
  gl_Position = vec4(at / half_size, depth - BIAS, 1);
  tint = vec4(color.rgb, color.a * 255.0 / 126.0);
}`;
const FRAGMENT_SHADER = `#version 300 es
precision highp float;
in vec4 tint;
in vec2 spot;
in float span;
in float half_width;
out vec4 result;
void main() {
  float away = length(vec2(spot.x - clamp(spot.x, 0.0, span), spot.y));
  float cover = clamp(half_width + 0.5 - away, 0.0, 1.0);
  if (cover < 0.02) discard;
  result = vec4(tint.rgb, tint.a * cover);
}`;

/** Pieces of ribbons that grow. */
export class Pieces extends Rows {
  /** @param {number[]} origin what positions are written relative to, metres */
  constructor(origin) {
    super(FLOATS_PER_VERTEX, 256);
    this.origin = origin;
  }

  /** A piece between two points, so many pixels wide. */
  add(from, to, rgb, opacity, width) {
    const [x, y, z] = this.origin;
    const ends = [from[0] - x, from[1] - y, from[2] - z, to[0] - x, to[1] - y, to[2] - z];
    const color = packed(rgb, opacity);
    for (const corner of CORNERS) {
      this.append([...ends, color, corner, width]);
    }
  }

  /** A way through points, lifted so many metres. */
  addWay(points, rgb, width, up) {
    const lifted = points.map(([x, y, z]) => [x, y, z + up]);
    lifted.slice(1).forEach((point, i) => this.add(lifted[i], point, rgb, 1, width));
  }

  /** An ellipse on the floor, of two half axes [x, y] in metres. */
  addEllipse([x, y, z], [ax, ay], [bx, by], rgb, width) {
    const points = Array.from({length: RING_PIECES + 1}, (_, i) => {
      const [c, s] = [Math.cos, Math.sin].map((f) => f(2 * Math.PI * i / RING_PIECES));
      return [x + c * ax + s * bx, y + c * ay + s * by, z];
    });
    this.addWay(points, rgb, width, 0);
  }

  /** A ring on the floor. */
  addRing(center, radius, rgb, width) {
    this.addEllipse(center, [radius, 0], [0, radius], rgb, width);
  }
}

/** Ribbons on the card. */
export class Ribbons {
  constructor(gl) {
    this.gl = gl;
    this.program = linked(gl, VERTEX_SHADER, FRAGMENT_SHADER);
    this.matrix = gl.getUniformLocation(this.program, 'matrix');
    this.halfSize = gl.getUniformLocation(this.program, 'half_size');
    this.buffer = new Buffer(gl, gl.TRIANGLES, [3, 3, 'bytes', 1, 1]);
  }

  /** @param {Pieces} pieces */
  fill(pieces) {
    this.buffer.fill(pieces, this.gl.DYNAMIC_DRAW);
  }

  /**
   * @param {Float32Array} matrix from the pieces' origin to clip space
   * @param {number} width of the picture, pixels
   */
  draw(matrix, width, height) {
    this.gl.useProgram(this.program);
    this.gl.uniformMatrix4fv(this.matrix, false, matrix);
    this.gl.uniform2f(this.halfSize, width / 2, height / 2);
    this.buffer.draw();
  }
}
