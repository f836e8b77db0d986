// SPDX-License-Identifier: Apache-2.0
// The bodies of people at one time, as meshes in the frame of the map.
import {fieldsOf, vectorOf} from './columns.js';
import {requestOf} from './load.js';
import {transformed} from './shapes.js';
import {nsOf} from './time.js';

/** Shapes of more people at a time take too long to come and to draw. */
const BODIES_MAX = 40;
const PART_VERTICES = 3;
const PART_TOPOLOGY = 4;

const block = (reader) => reader.block();
const text = (reader) => new TextDecoder().decode(reader.block());
const MESSAGE = {2: ['shapes', block], 3: ['topologies', block]};
const OF_AGENT = {1: ['id', text], 2: ['shape', block]};
const SHAPE = {1: ['body', block], 2: ['pose', block], 5: ['topology', block]};
const BODY = {4: ['vertices', (reader) => reader.floats()]};
const POSE = {1: ['position', block], 2: ['orientation', block]};
const ASSET = {1: ['sha256', block], 3: ['content', block]};

const keyOf = (digest) => String.fromCharCode(...digest);

/** The corners of the faces of a topology; throws if one names a vertex that is not there. */
function facesOf(content) {
  if (content.length < 8 || content.length % 4 !== 0) throw new RangeError('no topology');
  const words = new Uint32Array(content.slice().buffer);
  const faces = words.subarray(2);
  if (faces.length !== 3 * words[1] || faces.some((vertex) => vertex >= words[0])) {
    throw new RangeError('a topology has faces of vertices that are not there');
  }
  return faces;
}

/** Vertices of a body in the frame of the map; null if the shape has none. */
function meshOf(shape, topologies) {
  const faces = shape.topology && topologies.get(keyOf(shape.topology));
  const vertices = shape.body && fieldsOf(shape.body, BODY).vertices;
  if (!faces || !vertices?.length || !shape.pose) return null;
  const pose = fieldsOf(shape.pose, POSE);
  const at = pose.position ? vectorOf(pose.position) : [0, 0, 0];
  const turn = pose.orientation ? vectorOf(pose.orientation, 4) : [0, 0, 0, 1];
  const positions = new Float64Array(vertices.length);
  for (let i = 0; i + 2 < vertices.length; i += 3) {
    positions.set(transformed(at, turn, [vertices[i], vertices[i + 1], vertices[i + 2]]), i);
  }
  const count = positions.length / 3;
  return faces.some((vertex) => vertex >= count) ? null : {positions, faces};
}

/** Bodies at a time by id of the agent; those that a map has none of are left out. */
export async function loadBodies(client, scene, agents, time, signal) {
  const request = requestOf(scene);
  for (const agent of agents.slice(0, BODIES_MAX)) request.text(3, agent);
  request.number(4, nsOf(time, scene.epoch))
      .block(5, Uint8Array.of(PART_VERTICES, PART_TOPOLOGY));
  const topologies = new Map();
  const bodies = new Map();
  const repeated = new Set(['shapes', 'topologies']);
  for await (const bytes of client.bytes('QueryService/BatchGetShapes', request.done(), signal)) {
    const message = fieldsOf(bytes, MESSAGE, repeated);
    for (const one of message.topologies ?? []) {
      const {sha256, content} = fieldsOf(one, ASSET);
      topologies.set(keyOf(sha256), facesOf(content));
    }
    for (const one of message.shapes ?? []) {
      const {id, shape} = fieldsOf(one, OF_AGENT);
      const mesh = meshOf(fieldsOf(shape, SHAPE), topologies);
      if (mesh) bodies.set(id, mesh);
    }
  }
  return bodies;
}
