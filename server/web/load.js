// SPDX-License-Identifier: Apache-2.0
// Loads a scene in the order in which it is worth seeing: rooms, places and objects, the edges
// between them, tracks; and its mesh, revisions and tags.
import {
  edgesOf, nodesOf, readMeshMessage, readSceneMessage, readTracksMessage,
} from './columns.js';
import {CallError} from './rpc.js';
import {Scene, Track, withGroup} from './scene.js';
import {nsOf} from './time.js';
import {Writer} from './wire.js';

/** The drawn mesh has at most about so many triangles; a picture takes longer with more. */
const TRIANGLES_MAX = 400000;
/** Edge lengths of cells that vertices share, metres: of a large mesh a coarser one is drawn. */
const CELLS = [0, 0.1, 0.2, 0.4, 0.8];
const MESH_CHANNEL_COLORS = 3;
const MESH_ENCODING_COARSE_COLUMNS = 3;
const PAGE = 1000;
/** More edges than these hide the map: the hierarchy alone is drawn, of layers not too large. */
const EDGES_MAX = 30000;
const NODES_A_LAYER_MAX = 200000;
/** About so many poses of each track; drawn they are closer than a pixel. */
const POSES_A_TRACK = 1500;
/** Tracks of a shorter log are loaded whole, seconds. */
const WHOLE_S_MAX = 60;
const BINS = 200;
/** How often a scene that is being loaded is drawn, milliseconds. */
const PROGRESS_MS = 250;

/** A request's message with map and revision, to which more fields can be written. */
export function requestOf(scene) {
  const readAt = new Writer().number(3, scene.revision).done();
  return new Writer().text(1, scene.map.name).block(2, readAt);
}

/** Nodes and, if they are not too many, edges. */
async function loadGraph(client, scene, signal, progress) {
  const hasEdges = Number(scene.stats.edge_count) <= EDGES_MAX;
  const request = requestOf(scene).number(7, NODES_A_LAYER_MAX);
  if (!hasEdges) request.number(5, 1);
  const rows = [];
  let head = {layers: [], origin: [0, 0, 0]};
  for await (const bytes of client.bytes('QueryService/GetScene', request.done(), signal)) {
    const message = readSceneMessage(bytes);
    head = message.head ?? head;
    if (message.nodes) {
      const origin = head.origin ?? [0, 0, 0];
      for (const node of nodesOf(message.nodes, origin, scene.epoch)) {
        rows.push(node);
        scene.add(withGroup(node));
      }
      progress(`${message.nodes.layer}: ${rows.length} nodes`);
    }
    if (message.edges) {
      scene.edges.push(...edgesOf(message.edges, (row) => rows[row]?.id, scene.epoch));
    }
  }
  for (const {name, count, sent} of head.layers) {
    if (sent < count) scene.notes.push(`of ${count} nodes of ${name} some ${sent} are drawn`);
  }
  if (hasEdges) return;
  addHierarchy(scene, rows);
  scene.notes.push(`of ${scene.stats.edge_count} edges only the hierarchy is drawn, and what is ` +
                   'selected has');
}

/** Edges to parents, of layers with not too many nodes. */
function addHierarchy(scene, rows) {
  const counts = new Map();
  for (const {layer} of rows) counts.set(layer, (counts.get(layer) ?? 0) + 1);
  for (const node of rows) {
    const parent = rows[node.parent];
    if (!parent || counts.get(node.layer) > EDGES_MAX) continue;
    scene.edges.push({source: parent.id, relation: 'CONTAINS', target: node.id, from: node.from,
                      to: node.to});
  }
}

async function loadTracks(client, scene, signal, progress) {
  const span = scene.end - scene.begin;
  scene.isThinned = span > WHOLE_S_MAX;
  const request = requestOf(scene).number(8, 1).number(9, 1);
  if (scene.isThinned) request.number(7, nsOf(Math.max(0.05, span / POSES_A_TRACK), 0n));
  let heads = [];
  for await (const bytes of client.bytes('QueryService/GetTracks', request.done(), signal)) {
    const message = readTracksMessage(bytes, scene.epoch);
    if (message.tracks.length) heads = message.tracks;
    for (const {track, times, positions, gaps} of message.poses) {
      const id = heads[track]?.id;
      if (id === undefined) throw new RangeError(`there is no track ${track}`);
      if (!scene.tracks.has(id)) scene.tracks.set(id, new Track());
      scene.tracks.get(id).append(times, positions, gaps);
    }
    progress(`tracks: ${scene.tracks.size} of ${heads.length}`);
  }
}

/** How many agents were seen when, for the bars behind the slider. */
async function loadTimeline(client, scene, signal) {
  if (!scene.tracks.size) return;
  const reply = await client.call('QueryService/GetTimeline', {
    map: scene.map.name, read_at: {exact_revision: String(scene.revision)}, bin_count: BINS,
  }, signal);
  scene.timeline = reply.agent_counts;
}

/**
 * Loads a map, and tells after each part that there is more to see.
 * @param {import('./rpc.js').Client} client
 * @param {string} name
 * @param {number | null} revision null for the newest
 * @param {function(Scene, string): void} progress with what comes next
 */
export async function loadScene(client, name, revision, signal, progress) {
  const readAt = revision === null ? {latest: true} : {exact_revision: String(revision)};
  const stats = await client.call('MapService/GetMapStats', {map: name, read_at: readAt}, signal);
  const scene = new Scene(stats.map, stats.header, stats);
  let shown = 0;
  const tell = (what) => {
    if (Date.now() - shown < PROGRESS_MS) return;
    shown = Date.now();
    progress(scene, what);
  };
  await loadGraph(client, scene, signal, tell);
  progress(scene, 'tracks');
  performance.mark('graph');
  await loadTracks(client, scene, signal, tell);
  await loadTimeline(client, scene, signal);
  scene.settleSpan();
  progress(scene, '');
  return scene;
}

/** The bits of a double as a number of 64 bits. */
function bitsOf(value) {
  const view = new DataView(new ArrayBuffer(8));
  view.setFloat64(0, value);
  return view.getBigUint64(0);
}

/** The mesh with one vertex a cell; false, and not all of it, if it has too many triangles. */
async function loadMeshOf(client, scene, cell, signal, progress) {
  scene.mesh = [];
  const request = requestOf(scene).block(7, Uint8Array.of(MESH_CHANNEL_COLORS))
      .number(8, MESH_ENCODING_COARSE_COLUMNS);
  if (cell > 0) request.fixed64(6, bitsOf(cell));
  let count = 0;
  for await (const bytes of client.bytes('QueryService/GetMesh', request.done(), signal)) {
    for (const block of readMeshMessage(bytes)) {
      scene.mesh.push(block);
      count += block.faces.length / 3;
    }
    progress();
    if (count > TRIANGLES_MAX && cell < CELLS[CELLS.length - 1]) return false;
  }
  return true;
}

/** Loads the mesh of a scene, block by block; a coarser one where it has too many triangles. */
export async function loadMesh(client, scene, signal, progress) {
  for (const cell of CELLS) {
    if (!await loadMeshOf(client, scene, cell, signal, progress)) continue;
    if (cell > 0) scene.notes.push(`the mesh is drawn with a vertex for each ${cell} m`);
    return;
  }
}

/** The revisions of a map, oldest first, at most so many of the newest. */
export async function loadRevisions(client, name, most, signal) {
  const revisions = [];
  let before = 0;
  while (revisions.length < most) {
    const reply = await client.call('MapService/ListRevisions', {
      map: name, before_revision: String(before), page_size: PAGE,
    }, signal);
    revisions.push(...reply.revisions.map((one) => ({
      number: Number(one.revision), message: one.message, author: one.author,
      committed: Number(BigInt(one.committed_ns) / 1000000n),
    })));
    if (reply.revisions.length < PAGE) break;
    before = revisions[revisions.length - 1].number;
  }
  return revisions.reverse();
}

/** Tags by name; none of a server that keeps none. */
export async function loadTags(client, name, signal) {
  try {
    const reply = await client.call('MaintenanceService/ListTags', {map: name}, signal);
    return reply.tags ?? [];
  } catch (error) {
    if (error instanceof CallError && error.code !== 'unavailable') return [];
    throw error;
  }
}
