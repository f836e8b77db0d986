// SPDX-License-Identifier: Apache-2.0
// Draws a scene with WebGL2. What stands still is in one buffer a group, made when the scene or its
// time changes; people and trails are made anew for each picture. Nothing is drawn while nothing
// changes.
import {GROUPS} from './scene.js';
import {
  FLOATS_PER_VERTEX, Vertices, addBox, addBoxEdges, addFigure, addLine, addPoint, addPrism, addRing,
  addTriangle,
} from './shapes.js';

const BACKGROUND = [0x10 / 255, 0x14 / 255, 0x1a / 255];
export const PERSON_HEIGHT = 1.7;
/** A crowd of more people is drawn as boxes. */
const FIGURES_MAX = 300;
export const ROBOT_BOX = {min: [-0.25, -0.25, 0], max: [0.25, 0.25, 0.5]};
const DIFF_COLORS = {added: [0x4d, 0xa3, 0xff], removed: [0xff, 0x7a, 0x33],
                     changed: [0xf5, 0xf0, 0xa0], same: [0x5a, 0x61, 0x6b]};
const SELECTED = [255, 255, 255];
const HIT = [255, 90, 200];
const PATH = [120, 255, 160];
/** Palette of people, without repeats among the first ten. */
const PEOPLE = [
  [0xe6, 0x9f, 0x00], [0xff, 0x6f, 0x61], [0x9b, 0x8c, 0xff], [0x2e, 0xc4, 0xb6],
  [0xd4, 0xe1, 0x57], [0xff, 0xb3, 0xc6], [0x8d, 0x6e, 0x63], [0x4f, 0xc3, 0xf7],
  [0xba, 0x68, 0xc8], [0xa5, 0xd6, 0xa7],
];

const VERTEX_SHADER = `#version 300 es
layout(location = 0) in vec3 position;
layout(location = 1) in vec4 color;
layout(location = 2) in float shade;
layout(location = 3) in float lift;
uniform mat4 matrix;
uniform float step_m;
uniform float point_size;
out vec4 tint;
void main() {
  gl_Position = matrix * vec4(position + vec3(0, 0, lift * step_m), 1);
  gl_PointSize = clamp(point_size / gl_Position.w, 1.5, 9.0);
  tint = vec4(color.rgb * shade, color.a * 255.0 / 126.0);
}`;
const FRAGMENT_SHADER = `#version 300 es
precision mediump float;
in vec4 tint;
out vec4 result;
void main() { result = tint; }`;

/** Colour of an agent: always the same for the same id. */
export function colorOfAgent(id) {
  let hash = 0;
  for (const letter of id) hash = (hash * 31 + letter.charCodeAt(0)) >>> 0;
  return PEOPLE[(Number(id.slice(1)) || hash) % PEOPLE.length];
}

function compiled(gl, type, source) {
  const shader = gl.createShader(type);
  gl.shaderSource(shader, source);
  gl.compileShader(shader);
  if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) {
    throw new Error(`shader: ${gl.getShaderInfoLog(shader)}`);
  }
  return shader;
}

/** Vertices on the card, drawn as triangles, lines or points. */
class Buffer {
  constructor(gl, mode) {
    this.gl = gl;
    this.mode = mode;
    this.count = 0;
    this.array = gl.createVertexArray();
    this.bytes = gl.createBuffer();
    gl.bindVertexArray(this.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.bytes);
    const stride = FLOATS_PER_VERTEX * 4;
    [[0, 3, gl.FLOAT, false, 0], [1, 4, gl.UNSIGNED_BYTE, true, 12], [2, 1, gl.FLOAT, false, 16],
     [3, 1, gl.FLOAT, false, 20]].forEach(([at, size, type, normalized, offset]) => {
      gl.enableVertexAttribArray(at);
      gl.vertexAttribPointer(at, size, type, normalized, stride, offset);
    });
  }

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

  free() {
    this.gl.deleteBuffer(this.bytes);
    this.gl.deleteVertexArray(this.array);
  }
}

/** What of a scene is shown, and how. */
export class Show {
  constructor() {
    /** World time, seconds since the epoch. */
    this.time = 0;
    /** Names of groups that are not drawn. */
    this.hidden = new Set(['mesh', 'structures']);
    /** From 0, in place, to 1, layers apart. */
    this.explode = 0;
    this.hasEdges = true;
    /** Length of the trails behind agents, seconds. */
    this.tail = 20;
    this.selected = '';
    this.hits = new Set();
    /** @type {number[][]} corners of a planned path */
    this.path = [];
    /** @type {{probability: number, points: number[][]}[]} */
    this.predictions = [];
    /** @type {Map<string, string> | null} id to "added", "removed", "changed" */
    this.diff = null;
    /** Nodes that the other revision had, and this one has no more. */
    this.ghosts = [];
  }
}

function isAgent(scene, id) {
  return scene.nodes.get(id)?.group === 'agents';
}

/** Metres between two steps of the exploded view. */
export function stepOf(scene, explode) {
  const {min, max} = scene.bounds;
  const size = Math.max(max[0] - min[0], max[1] - min[1]);
  return explode * Math.max(4, size * 0.16);
}

/** A colour of a node, and how opaque it is. */
function lookOf(show, node, color) {
  if (show.diff) {
    const state = show.diff.get(node.id) ?? 'same';
    return [DIFF_COLORS[state], state === 'same' ? 0.35 : 1];
  }
  if (node.id === show.selected) return [SELECTED, 1];
  if (show.hits.has(node.id)) return [HIT, 1];
  return [color, show.hits.size ? 0.4 : 1];
}

export class Renderer {
  /** Throws where there is no WebGL2. */
  constructor(canvas) {
    this.canvas = canvas;
    this.gl = canvas.getContext('webgl2', {antialias: false, powerPreference: 'low-power'});
    if (!this.gl) throw new Error('this browser has no WebGL2');
    this.#setUp();
  }

  /** After a lost context; the buffers must be filled again. */
  restore() {
    this.#setUp();
  }

  #setUp() {
    const gl = this.gl;
    const program = gl.createProgram();
    gl.attachShader(program, compiled(gl, gl.VERTEX_SHADER, VERTEX_SHADER));
    gl.attachShader(program, compiled(gl, gl.FRAGMENT_SHADER, FRAGMENT_SHADER));
    gl.linkProgram(program);
    this.program = program;
    this.uniforms = Object.fromEntries(['matrix', 'step_m', 'point_size'].map(
        (name) => [name, gl.getUniformLocation(program, name)]));
    this.solid = new Buffer(gl, gl.TRIANGLES);
    this.glass = new Buffer(gl, gl.TRIANGLES);
    this.lines = new Buffer(gl, gl.LINES);
    this.points = new Buffer(gl, gl.POINTS);
    this.mesh = new Buffer(gl, gl.TRIANGLES);
    this.movingSolid = new Buffer(gl, gl.TRIANGLES);
    this.movingLines = new Buffer(gl, gl.LINES);
    this.movingEdges = [];
    this.meshOf = null;
    this.meshBlocks = 0;
  }

  /** Makes the buffers of what stands still. */
  build(scene, show) {
    const out = Object.fromEntries(['solid', 'glass', 'lines', 'points'].map(
        (name) => [name, new Vertices(scene.origin)]));
    this.movingEdges = scene.edges.filter(
        ({source, target}) => isAgent(scene, source) || isAgent(scene, target));
    const moving = new Set(this.movingEdges);
    for (const group of GROUPS) {
      if (show.hidden.has(group.name) || group.name === 'agents' || group.name === 'mesh') continue;
      for (const node of scene.of(group.name)) {
        if (scene.isValid(node, show.time) || show.diff?.has(node.id)) {
          this.#addNode(out, node, group, show);
        }
      }
    }
    for (const node of show.ghosts) this.#addGhost(out, node, show);
    if (show.hasEdges) {
      this.#addEdges(out.lines, scene, show, scene.edges.filter((one) => !moving.has(one)));
    }
    for (const [name, vertices] of Object.entries(out)) {
      this[name].fill(vertices, this.gl.STATIC_DRAW);
    }
    this.#buildMesh(scene);
  }

  #addNode(out, node, group, show) {
    const [color, opacity] = lookOf(show, node, group.color);
    const lift = group.lift;
    if (node.outline.length >= 3) {
      addPrism(out.glass, out.lines, node.outline, node.zMin, node.zMax, color, opacity * 0.16,
               lift);
    } else if (group.name === 'structures' && node.box && node.position) {
      addBoxEdges(out.lines, node.box, node.position, node.orientation, color, opacity * 0.7, lift);
    } else if (group.name === 'places' && node.position) {
      // In place they would hide the floor.
      const share = show.explode > 0 || node.id === show.selected ? 1 : 0.45;
      addPoint(out.points, node.position, color, opacity * share, lift);
    } else if (node.box && node.position) {
      addBox(out.solid, node.box, node.position, node.orientation, color, 1, lift);
      addBoxEdges(out.lines, node.box, node.position, node.orientation, [16, 20, 26], 0.8, lift);
    } else if (node.position) {
      const half = group.name === 'objects' ? 0.12 : 0.4;
      const box = {min: [-half, -half, -half], max: [half, half, half]};
      addBox(out.solid, box, node.position, node.orientation, color, 1, lift);
    }
  }

  #addGhost(out, node, show) {
    const group = GROUPS.find((one) => one.name === node.group);
    if (show.hidden.has(node.group) || !node.position || node.group === 'agents') return;
    if (node.box && node.group !== 'places') {
      addBoxEdges(out.lines, node.box, node.position, node.orientation, DIFF_COLORS.removed, 1,
                  group.lift);
    } else {
      addPoint(out.points, node.position, DIFF_COLORS.removed, 1, group.lift);
    }
  }

  // The hierarchy is drawn when layers are apart, the other relations while both ends are to be
  // seen; of the selected node, always. Edges of agents move with them.
  #addEdges(lines, scene, show, edges) {
    const lifts = Object.fromEntries(GROUPS.map((group) => [group.name, group.lift]));
    for (const edge of edges) {
      const [source, target] = [scene.nodes.get(edge.source), scene.nodes.get(edge.target)];
      if (!source || !target) continue;
      if (!(edge.from <= show.time && show.time < edge.to)) continue;
      if (show.hidden.has(source.group) || show.hidden.has(target.group)) continue;
      const isSelected = edge.source === show.selected || edge.target === show.selected;
      if (edge.relation === 'CONTAINS' && show.explode === 0 && !isSelected) continue;
      const from = scene.placeOf(source, show.time);
      const to = scene.placeOf(target, show.time);
      if (!from || !to) continue;
      const color = isSelected ? SELECTED : GROUPS.find((one) => one.name === target.group).color;
      const opacity = isSelected ? 0.9 : show.diff || show.explode === 0 ? 0.1 : 0.28;
      addLine(lines, from, to, color, opacity, lifts[source.group], lifts[target.group]);
    }
  }

  #buildMesh(scene) {
    if (this.meshOf === scene && this.meshBlocks === scene.mesh.length) return;
    const vertices = new Vertices(scene.origin, 65536);
    for (const block of scene.mesh) {
      for (let i = 0; i + 2 < block.faces.length; i += 3) {
        this.#addFace(vertices, block, i, block.colors?.[block.faces[i]] ?? 0x9aa4b2);
      }
    }
    this.mesh.fill(vertices, this.gl.STATIC_DRAW);
    this.meshOf = scene;
    this.meshBlocks = scene.mesh.length;
  }

  #addFace(vertices, block, i, rgb) {
    const corner = (k) => block.positions.subarray(block.faces[i + k] * 3,
                                                   block.faces[i + k] * 3 + 3);
    const [a, b, c] = [corner(0), corner(1), corner(2)];
    const u = [b[0] - a[0], b[1] - a[1], b[2] - a[2]];
    const v = [c[0] - a[0], c[1] - a[1], c[2] - a[2]];
    const normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2],
                    u[0] * v[1] - u[1] * v[0]];
    const length = Math.hypot(...normal) || 1;
    const shade = 0.55 + 0.35 * Math.abs(normal[2] / length) + 0.1 * (normal[0] / length);
    addTriangle(vertices, a, b, c, [rgb >> 16 & 255, rgb >> 8 & 255, rgb & 255], 1, shade, 0);
  }

  /** People, their trails, and what was asked for last. */
  #buildMoving(scene, show) {
    const [solid, lines] = [new Vertices(scene.origin), new Vertices(scene.origin)];
    if (!show.hidden.has('agents')) {
      for (const node of scene.of('agents')) this.#addAgent(solid, lines, scene, show, node);
    }
    if (show.hasEdges) this.#addEdges(lines, scene, show, this.movingEdges);
    show.path.slice(1).forEach((point, i) => {
      const lifted = (p) => [p[0], p[1], p[2] + 0.05];
      addLine(lines, lifted(show.path[i]), lifted(point), PATH, 1, 0);
    });
    for (const {probability, points} of show.predictions) {
      points.slice(1).forEach((point, i) => {
        addLine(lines, points[i], point, HIT, 0.2 + 0.8 * probability, 0);
      });
    }
    this.movingSolid.fill(solid, this.gl.DYNAMIC_DRAW);
    this.movingLines.fill(lines, this.gl.DYNAMIC_DRAW);
  }

  #addAgent(solid, lines, scene, show, node) {
    const track = scene.tracks.get(node.id);
    if (!track) return;
    const [color] = lookOf(show, node, colorOfAgent(node.id));
    this.#addTrail(lines, track, show, color);
    const here = scene.agentAt(node.id, show.time);
    if (!here) return;
    const foot = scene.footOf(here.position);
    const body = scene.bodies.time === show.time && scene.bodies.meshes.get(node.id);
    if (!here.known) {
      addRing(lines, foot, 0.35, color, 0.9, 0);
    } else if (body) {
      const rgb = color[0] << 16 | color[1] << 8 | color[2];
      for (let i = 0; i + 2 < body.faces.length; i += 3) this.#addFace(solid, body, i, rgb);
    } else if (node.kind === 'human' && scene.of('agents').length <= FIGURES_MAX) {
      addFigure(solid, foot, PERSON_HEIGHT, color, 1, 0);
    } else {
      addBox(solid, ROBOT_BOX, foot, [0, 0, 0, 1], color, 1, 0);
    }
    if (node.id === show.selected) addRing(lines, foot, 0.6, SELECTED, 1, 0);
  }

  #addTrail(lines, track, show, color) {
    const begin = Math.max(0, track.indexAt(show.time - show.tail));
    const end = track.indexAt(show.time);
    for (let i = begin; i < end; ++i) {
      if (track.times[i] < show.time - show.tail) continue;
      if (track.gaps.has(i + 1)) continue;
      const age = (show.time - track.times[i]) / show.tail;
      addLine(lines, track.positions[i], track.positions[i + 1], color, 1 - 0.85 * age, 0);
    }
  }

  draw(scene, show, camera) {
    const gl = this.gl;
    const {width, height} = this.canvas;
    gl.viewport(0, 0, width, height);
    gl.clearColor(...BACKGROUND, 1);
    gl.enable(gl.DEPTH_TEST);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    if (!scene) return;
    this.#buildMoving(scene, show);
    gl.useProgram(this.program);
    gl.uniformMatrix4fv(this.uniforms.matrix, false,
                        Float32Array.from(camera.matrix(width / height, scene.origin)));
    gl.uniform1f(this.uniforms.step_m, stepOf(scene, show.explode));
    gl.uniform1f(this.uniforms.point_size, height * 0.12);
    gl.disable(gl.BLEND);
    gl.depthMask(true);
    // Surfaces face the room: from above, ceilings do not hide what is below them.
    gl.enable(gl.CULL_FACE);
    if (!show.hidden.has('mesh')) this.mesh.draw();
    gl.disable(gl.CULL_FACE);
    this.solid.draw();
    this.movingSolid.draw();
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    this.points.draw();
    this.lines.draw();
    this.movingLines.draw();
    gl.depthMask(false);
    this.glass.draw();
    gl.depthMask(true);
  }
}
