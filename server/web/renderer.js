// SPDX-License-Identifier: Apache-2.0
// Draws a scene with WebGL2. What stands still is in one buffer a group, made when the scene or its
// time changes; people and trails are made anew for each picture. Nothing is drawn while nothing
// changes.
import {Buffer, linked} from './card.js';
import {BACKGROUND, DIFF_COLORS, SELECTED, lookOf} from './colors.js';
import {addAnswers, addPeople} from './moving.js';
import {Pieces, Ribbons} from './ribbons.js';
import {GROUPS, colorOfGroup} from './scene.js';
import {
  VERTEX, Vertices, addBox, addBoxEdges, addFace, addLine, addPoint, addPrism, cornersOf,
} from './shapes.js';
import {stepOf} from './show.js';

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

function isAgent(scene, id) {
  return scene.nodes.get(id)?.group === 'agents';
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
    this.program = linked(gl, VERTEX_SHADER, FRAGMENT_SHADER);
    this.uniforms = Object.fromEntries(['matrix', 'step_m', 'point_size'].map(
        (name) => [name, gl.getUniformLocation(this.program, name)]));
    this.solid = new Buffer(gl, gl.TRIANGLES, VERTEX);
    this.glass = new Buffer(gl, gl.TRIANGLES, VERTEX);
    this.lines = new Buffer(gl, gl.LINES, VERTEX);
    this.points = new Buffer(gl, gl.POINTS, VERTEX);
    this.mesh = new Buffer(gl, gl.TRIANGLES, VERTEX);
    this.movingSolid = new Buffer(gl, gl.TRIANGLES, VERTEX);
    this.movingLines = new Buffer(gl, gl.LINES, VERTEX);
    this.ribbons = new Ribbons(gl);
    this.movingEdges = [];
    this.meshOf = null;
    this.meshBlocks = 0;
  }

  /** Of the screen's pixels, in the middle of the picture. */
  pixelsPerMetre(scene, camera) {
    return scene ? camera.pixelsPerMetre(camera.distance, this.canvas.clientHeight) : 0;
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
      addBoxEdges(out.lines, node.box, node.position, node.orientation, BACKGROUND, 0.8, lift);
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
      const color = isSelected ? SELECTED : colorOfGroup(target.group);
      const opacity = isSelected ? 0.9 : show.diff || show.explode === 0 ? 0.1 : 0.28;
      addLine(lines, from, to, color, opacity, lifts[source.group], lifts[target.group]);
    }
  }

  #buildMesh(scene) {
    if (this.meshOf === scene && this.meshBlocks === scene.mesh.length) return;
    const vertices = new Vertices(scene.origin, 65536);
    for (const block of scene.mesh) {
      for (let i = 0; i + 2 < block.faces.length; i += 3) {
        const rgb = block.colors?.[block.faces[i]] ?? 0x9aa4b2;
        addFace(vertices, ...cornersOf(block, i), [rgb >> 16 & 255, rgb >> 8 & 255, rgb & 255], 1);
      }
    }
    this.mesh.fill(vertices, this.gl.STATIC_DRAW);
    this.meshOf = scene;
    this.meshBlocks = scene.mesh.length;
  }

  /** People, their trails, and what was asked for last. */
  #buildMoving(scene, show) {
    const {origin} = scene;
    const out = {solid: new Vertices(origin), ribbons: new Pieces(origin)};
    const lines = new Vertices(origin);
    addPeople(out, scene, show);
    addAnswers(out.ribbons, show);
    if (show.hasEdges) this.#addEdges(lines, scene, show, this.movingEdges);
    this.movingSolid.fill(out.solid, this.gl.DYNAMIC_DRAW);
    this.movingLines.fill(lines, this.gl.DYNAMIC_DRAW);
    this.ribbons.fill(out.ribbons);
  }

  draw(scene, show, camera) {
    const gl = this.gl;
    const {width, height} = this.canvas;
    gl.viewport(0, 0, width, height);
    gl.clearColor(...BACKGROUND.map((value) => value / 255), 1);
    gl.enable(gl.DEPTH_TEST);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    if (!scene) return;
    this.#buildMoving(scene, show);
    const matrix = Float32Array.from(camera.matrix(width / height, scene.origin));
    gl.useProgram(this.program);
    gl.uniformMatrix4fv(this.uniforms.matrix, false, matrix);
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
    // What is seen through hides nothing that is drawn later.
    gl.depthMask(false);
    this.points.draw();
    this.lines.draw();
    this.movingLines.draw();
    this.ribbons.draw(matrix, width, height);
    gl.useProgram(this.program);
    this.glass.draw();
    gl.depthMask(true);
  }
}
