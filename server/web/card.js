// SPDX-License-Identifier: Apache-2.0
// Programs and buffers of the graphics card.

function compiled(gl, type, source) {
  const shader = gl.createShader(type);
  gl.shaderSource(shader, source);
  gl.compileShader(shader);
  if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) {
    throw new Error(`shader: ${gl.getShaderInfoLog(shader)}`);
  }
  return shader;
}

/** A program of two shaders. */
export function linked(gl, vertexSource, fragmentSource) {
  const program = gl.createProgram();
  gl.attachShader(program, compiled(gl, gl.VERTEX_SHADER, vertexSource));
  gl.attachShader(program, compiled(gl, gl.FRAGMENT_SHADER, fragmentSource));
  gl.linkProgram(program);
  return program;
}

/** Vertices on the card, drawn as triangles, lines or points. */
export class Buffer {
  /**
   * @param {number} mode gl.TRIANGLES, gl.LINES or gl.POINTS
   * @param {number[]} sizes of the attributes, in numbers; "bytes" is a colour of four bytes
   */
  constructor(gl, mode, sizes) {
    this.gl = gl;
    this.mode = mode;
    this.count = 0;
    this.array = gl.createVertexArray();
    this.bytes = gl.createBuffer();
    gl.bindVertexArray(this.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.bytes);
    const bytesOf = (size) => (size === 'bytes' ? 4 : 4 * size);
    const stride = sizes.reduce((sum, size) => sum + bytesOf(size), 0);
    let offset = 0;
    sizes.forEach((size, at) => {
      gl.enableVertexAttribArray(at);
      if (size === 'bytes') gl.vertexAttribPointer(at, 4, gl.UNSIGNED_BYTE, true, stride, offset);
      else gl.vertexAttribPointer(at, size, gl.FLOAT, false, stride, offset);
      offset += bytesOf(size);
    });
  }

  /** @param {{count: number, filled: Float32Array}} vertices */
  fill(vertices, usage) {
    this.count = vertices.count;
    this.gl.bindBuffer(this.gl.ARRAY_BUFFER, this.bytes);
    this.gl.bufferData(this.gl.ARRAY_BUFFER, vertices.filled, usage);
  }

  draw() {
    if (this.count === 0) return;
    this.gl.bindVertexArray(this.array);
    this.gl.drawArrays(this.mode, 0, this.count);
  }
}
