// SPDX-License-Identifier: Apache-2.0
// A map at one revision, as the viewer holds it: nodes, edges and tracks, with times in seconds
// since the map's epoch. Loaded in the order in which it is worth seeing.
import {CallError} from './rpc.js';
import {transformed} from './shapes.js';
import {OPEN_BEGIN, OPEN_END, nsOf, secondsOf} from './time.js';
import {Reader, Writer} from './wire.js';

/** The drawn mesh has at most about so many triangles; a picture takes longer with more. */
export const TRIANGLES_MAX = 400000;
const PAGE = 1000;
/** More edges than these hide the map, and are not loaded. */
const EDGES_MAX = 30000;
const NODES_MAX = 200000;
/** About so many poses of each track; drawn they are closer than a pixel. */
const POSES_A_TRACK = 1500;
const TRACKS_AT_ONCE = 4;
/** Tracks of a shorter log are loaded whole, seconds. */
const WHOLE_S_MAX = 60;
/** How often a scene that is being loaded is drawn, milliseconds. */
const PROGRESS_MS = 250;

/** The seven groups of the legend, in the order of their keys. */
export const GROUPS = [
  {name: 'agents', title: 'People and robots', color: [0xe6, 0x9f, 0x00], lift: 0},
  {name: 'objects', title: 'Objects', color: [0x56, 0xb4, 0xe9], lift: 0},
  {name: 'places', title: 'Places', color: [0x00, 0x9e, 0x73], lift: 1},
  {name: 'rooms', title: 'Rooms', color: [0xf0, 0xe4, 0x42], lift: 2},
  {name: 'building', title: 'Building and above', color: [0xcc, 0x79, 0xa7], lift: 3},
  {name: 'structures', title: 'Walls and floors', color: [0x8a, 0x90, 0x9a], lift: 0},
  {name: 'mesh', title: 'Mesh', color: [0x9a, 0xa4, 0xb2], lift: 0},
];

const ORIGIN = [0, 0, 0];

function groupOf(node) {
  if (node.agent || node.kind === 'human' || node.kind === 'robot') return 'agents';
  if (node.kind === 'place') return 'places';
  if (node.kind === 'structure') return 'structures';
  if (node.kind === 'room') return 'rooms';
  if (node.region || node.kind === 'building') return 'building';
  return 'objects';
}

const vector = (v) => [v?.x ?? 0, v?.y ?? 0, v?.z ?? 0];

/** Outline and heights of a region: its footprint, or else the floor of its box. */
function regionOf(message, box, position, orientation) {
  const xy = message.region?.footprint?.xy ?? [];
  if (xy.length >= 6) {
    const outline = [];
    for (let i = 0; i + 1 < xy.length; i += 2) outline.push([xy[i], xy[i + 1]]);
    return {outline, zMin: message.region.z_min_m, zMax: message.region.z_max_m};
  }
  if (!box || !position) return {outline: [], zMin: 0, zMax: 0};
  const corners = [[box.min[0], box.min[1]], [box.max[0], box.min[1]], [box.max[0], box.max[1]],
                   [box.min[0], box.max[1]]];
  return {
    outline: corners.map(([x, y]) => transformed(position, orientation, [x, y, 0]).slice(0, 2)),
    zMin: position[2] + box.min[2],
    zMax: position[2] + box.max[2],
  };
}

/** A node in numbers; `from` and `to` are when it is valid, seconds. */
export function toNode(message, epoch) {
  const pose = message.map_T_node;
  const q = pose?.orientation;
  const group = groupOf(message);
  const position = pose?.position ? vector(pose.position) : null;
  const orientation = q ? [q.x, q.y, q.z, q.w] : [0, 0, 0, 1];
  const corners = message.bounding_box;
  const box = corners ? {min: vector(corners.min), max: vector(corners.max)} : null;
  const region = group === 'rooms' || group === 'building'
      ? regionOf(message, box, position, orientation) : {outline: [], zMin: 0, zMax: 0};
  return {
    id: message.id,
    name: message.name ?? '',
    kind: message.kind,
    layer: message.layer,
    className: message.semantic_class?.name ?? '',
    group,
    position,
    orientation,
    box,
    ...region,
    from: secondsOf(message.valid_from_ns ?? OPEN_BEGIN, epoch),
    to: secondsOf(message.valid_to_ns ?? OPEN_END, epoch),
  };
}

/** Poses of an agent, sampled evenly; between two further apart than a gap nobody knows. */
export class Track {
  constructor(gap) {
    this.gap = gap;
    this.times = [];
    this.positions = [];
  }

  get from() {
    return this.times[0];
  }

  get to() {
    return this.times[this.times.length - 1];
  }

  /** Index of the last pose at or before a time; -1 before the first. */
  indexAt(time) {
    let low = 0;
    let high = this.times.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.times[middle] <= time) low = middle + 1;
      else high = middle;
    }
    return low - 1;
  }

  /** The last position at or before a time; undefined before the first. */
  before(time) {
    return this.positions[this.indexAt(time)];
  }

  /**
   * Where the agent is at a time; `known` is false in a gap, where it was last. Null outside of the
   * track.
   */
  at(time) {
    const i = this.indexAt(time);
    if (i < 0 || time > this.to) return null;
    const before = this.positions[i];
    if (i + 1 === this.times.length) return {position: before, known: true};
    const span = this.times[i + 1] - this.times[i];
    if (span > this.gap && time > this.times[i]) return {position: before, known: false};
    const share = (time - this.times[i]) / span;
    const after = this.positions[i + 1];
    return {position: before.map((v, k) => v + (after[k] - v) * share), known: true};
  }
}

/** The message GetTrajectoryRequest: a pose each period, or all poses from a time on. */
function trajectoryRequest(scene, agent, {period, from}) {
  const readAt = new Writer().number(3, scene.revision).done();
  const request = new Writer().text(1, scene.map.name).block(2, readAt).text(3, agent);
  if (from !== undefined) request.number(4, from);
  if (period !== undefined) request.number(6, period);
  return request.done();
}

function readVector(reader) {
  const out = [0, 0, 0];
  new Reader(reader.block()).each({
    1: (r) => { out[0] = r.double(); },
    2: (r) => { out[1] = r.double(); },
    3: (r) => { out[2] = r.double(); },
  });
  return out;
}

/** Appends the poses of one GetTrajectoryResponse. */
export function readPoses(bytes, epoch, track) {
  new Reader(bytes).each({
    3: (poses) => {
      let time = 0n;
      let position = [0, 0, 0];
      new Reader(poses.block()).each({
        1: (r) => { time = r.int64(); },
        2: (r) => {
          new Reader(r.block()).each({1: (inner) => { position = readVector(inner); }});
        },
      });
      track.times.push(secondsOf(time, epoch));
      track.positions.push(position);
    },
  });
}

/** The blocks of one GetMeshResponse. */
export function readMesh(bytes) {
  const blocks = [];
  new Reader(bytes).each({
    2: (reader) => {
      const block = {positions: new Float32Array(0), colors: null, faces: new Uint32Array(0)};
      new Reader(reader.block()).each({
        4: (r) => { block.positions = r.floats(); },
        6: (r) => { block.colors = r.fixed32s(); },
        11: (r) => { block.faces = r.varints(); },
      });
      const count = block.positions.length / 3;
      if (block.faces.some((index) => index >= count)) {
        throw new RangeError('a face of the mesh names a vertex that is not there');
      }
      blocks.push(block);
    },
  });
  return blocks;
}

export class Scene {
  constructor(map, header, stats) {
    this.map = map;
    this.epoch = BigInt(map.epoch_ns);
    this.revision = Number(header.read_revision);
    this.head = Number(header.head_revision);
    this.stats = stats;
    /** @type {Map<string, object>} by id */
    this.nodes = new Map();
    /** The same nodes by the name of their group. */
    this.groups = new Map(GROUPS.map(({name: group}) => [group, []]));
    this.edges = [];
    /** @type {Map<string, Track>} by id of the agent */
    this.tracks = new Map();
    this.mesh = [];
    /** Whether the mesh was asked for. */
    this.meshAsked = false;
    /** Drawn positions are relative to it: floats are too coarse for a national grid. */
    this.origin = ORIGIN;
    /** Whether tracks have fewer poses than the map. */
    this.isThinned = false;
    /**
     * What the server said of one time: positions by id of the agent, undefined in a gap, null
     * outside of the track.
     */
    this.exact = {time: NaN, positions: new Map()};
    this.changes = new Float64Array(0);
    this.changesOf = 0;
    /** What was left out, and why; shown, never silent. */
    this.notes = [];
    const gap = Number(map.gap_ns_max) / 1e9;
    this.gap = gap > 0 ? gap : 2;
    this.begin = stats.first_pose_ns ? secondsOf(stats.first_pose_ns, this.epoch) : 0;
    this.end = stats.last_pose_ns ? secondsOf(stats.last_pose_ns, this.epoch) : 0;
  }

  add(node) {
    if (this.nodes.has(node.id)) return;
    this.nodes.set(node.id, node);
    if (node.position && this.origin === ORIGIN) this.origin = node.position;
    this.groups.get(node.group).push(node);
  }

  of(group) {
    return this.groups.get(group);
  }

  /** A node as it is called on the screen. */
  titleOf(id) {
    const node = this.nodes.get(id);
    if (!node) return id;
    return node.name || (node.className ? `${node.className} ${id}` : id);
  }

  /**
   * Where an agent is at a time, and whether that is known or it is in a gap of its track; null
   * outside of the track. Exact where the server was asked for this time, else by the samples.
   */
  agentAt(id, time) {
    const track = this.tracks.get(id);
    if (this.exact.time !== time || !this.exact.positions.has(id)) return track?.at(time) ?? null;
    const position = this.exact.positions.get(id);
    if (position) return {position, known: true};
    const last = position === null ? null : track?.before(time);
    return last ? {position: last, known: false} : null;
  }

  /** Where a node is at a time: an agent on its track, everything else at its place. */
  placeOf(node, time) {
    if (node.group !== 'agents') return node.position;
    return this.agentAt(node.id, time)?.position ?? null;
  }

  /** What of the world's time there is to see, once all is loaded: tracks, else what changes. */
  settleSpan() {
    if (this.end > this.begin) return;
    this.changesBetween(0, 0);
    if (!this.changes.length) return;
    this.begin = Math.min(this.begin, this.changes[0]);
    this.end = Math.max(this.end, this.changes[this.changes.length - 1] + 1);
  }

  /** Where an agent stands: tracks may be of torsos, so the floor of a room below them counts. */
  footOf(position) {
    let floor = -Infinity;
    for (const {zMin} of this.of('rooms')) {
      if (zMin <= position[2] + 0.3) floor = Math.max(floor, zMin);
    }
    return position[2] - floor < 1.8 ? [position[0], position[1], floor] : position;
  }

  /** Whether a node or an edge begins or ends after the earlier and up to the later time. */
  changesBetween(a, b) {
    const count = this.nodes.size + this.edges.length;
    if (this.changesOf !== count) {
      const times = [...this.nodes.values(), ...this.edges].flatMap(({from, to}) => [from, to]);
      this.changes = Float64Array.from(times.filter(Number.isFinite)).sort();
      this.changesOf = count;
    }
    const [low, high] = [Math.min(a, b), Math.max(a, b)];
    const next = this.changes.find((time) => time > low);
    return next !== undefined && next <= high;
  }

  isValid(node, time) {
    return node.from <= time && time < node.to;
  }

  /** Corners of what has a place. */
  get bounds() {
    const min = [Infinity, Infinity, Infinity];
    const max = [-Infinity, -Infinity, -Infinity];
    const include = (point) => point.forEach((value, i) => {
      min[i] = Math.min(min[i], value);
      max[i] = Math.max(max[i], value);
    });
    for (const node of this.nodes.values()) {
      if (node.position && node.group !== 'agents') include(node.position);
      for (const [x, y] of node.outline) include([x, y, node.zMin]);
    }
    for (const track of this.tracks.values()) {
      if (track.positions.length) include(track.positions[0]);
    }
    return min[0] <= max[0] ? {min, max} : {min: [-5, -5, 0], max: [5, 5, 3]};
  }

  /** Seconds in which people or robots were seen, in so many bins. */
  histogram(bins) {
    const counts = new Array(bins).fill(0);
    const width = (this.end - this.begin) / bins;
    if (!(width > 0)) return counts;
    for (const track of this.tracks.values()) {
      for (let i = 0; i < bins; ++i) {
        const time = this.begin + (i + 0.5) * width;
        if (track.at(time)?.known) ++counts[i];
      }
    }
    return counts;
  }
}

/** Nodes of some pages; `take` gets each page. */
async function listNodes(client, scene, filter, signal, take) {
  let token = '';
  do {
    const reply = await client.call('QueryService/ListNodes', {
      map: scene.map.name, read_at: {exact_revision: String(scene.revision)}, filter,
      view: 'NODE_VIEW_FULL', page_size: PAGE, page_token: token,
    }, signal);
    for (const message of reply.nodes) scene.add(toNode(message, scene.epoch));
    take();
    token = reply.next_page_token;
    if (scene.nodes.size >= NODES_MAX && token) {
      scene.notes.push(`only ${NODES_MAX} nodes are drawn`);
      return;
    }
  } while (token);
}

async function listEdges(client, scene, signal) {
  if (Number(scene.stats.edge_count) > EDGES_MAX) {
    scene.notes.push(`${scene.stats.edge_count} edges are too many to draw`);
    return;
  }
  let token = '';
  do {
    const reply = await client.call('QueryService/ListEdges', {
      map: scene.map.name, read_at: {exact_revision: String(scene.revision)}, page_size: PAGE,
      page_token: token,
    }, signal);
    for (const edge of reply.edges) {
      scene.edges.push({
        source: edge.source, relation: edge.relation, target: edge.target,
        from: secondsOf(edge.valid_from_ns ?? OPEN_BEGIN, scene.epoch),
        to: secondsOf(edge.valid_to_ns ?? OPEN_END, scene.epoch),
      });
    }
    token = reply.next_page_token;
  } while (token);
}

async function loadTrack(client, scene, agent, signal) {
  const span = scene.end - scene.begin;
  const period = Math.max(0.05, span / POSES_A_TRACK);
  const isThinned = span > WHOLE_S_MAX;
  const track = new Track(isThinned ? Math.max(scene.gap, period * 1.5) : scene.gap);
  const read = async (choice, into) => {
    const request = trajectoryRequest(scene, agent, choice);
    for await (const bytes of client.bytes('QueryService/GetTrajectory', request, signal)) {
      readPoses(bytes, scene.epoch, into);
    }
  };
  await read(isThinned ? {period: nsOf(period, 0n)} : {}, track);
  if (!track.times.length) return;
  if (isThinned) {
    // The samples end before the track does.
    scene.isThinned = true;
    const rest = new Track(scene.gap);
    await read({from: nsOf(track.to, scene.epoch)}, rest);
    if (rest.to > track.to) {
      track.times.push(rest.to);
      track.positions.push(rest.positions[rest.positions.length - 1]);
    }
  }
  scene.tracks.set(agent, track);
}

async function loadTracks(client, scene, signal, take) {
  const agents = scene.of('agents').map((node) => node.id);
  const worker = async () => {
    for (let agent = agents.pop(); agent; agent = agents.pop()) {
      await loadTrack(client, scene, agent, signal);
      take();
    }
  };
  await Promise.all(Array.from({length: TRACKS_AT_ONCE}, worker));
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
  const layers = stats.layers.filter((layer) => Number(layer.node_count) > 0)
                     .sort((a, b) => b.rank - a.rank);
  const isFine = (layer) => layer.name === 'places';
  for (const layer of [...layers.filter((one) => !isFine(one)), ...layers.filter(isFine)]) {
    progress(scene, `${layer.name}: ${layer.node_count}`);
    await listNodes(client, scene, {layer: layer.name}, signal, () => progress(scene, layer.name));
  }
  progress(scene, 'tracks');
  let shown = 0;
  await loadTracks(client, scene, signal, () => {
    if (Date.now() - shown < PROGRESS_MS) return;
    shown = Date.now();
    progress(scene, `tracks: ${scene.tracks.size} of ${scene.of('agents').length}`);
  });
  progress(scene, 'edges');
  await listEdges(client, scene, signal);
  scene.settleSpan();
  progress(scene, '');
  return scene;
}

/** Loads the mesh of a scene, block by block. */
export async function loadMesh(client, scene, signal, progress) {
  const readAt = new Writer().number(3, scene.revision).done();
  const request = new Writer().text(1, scene.map.name).block(2, readAt).done();
  for await (const bytes of client.bytes('QueryService/GetMesh', request, signal)) {
    scene.mesh.push(...readMesh(bytes));
    progress();
  }
  const count = scene.mesh.reduce((sum, block) => sum + block.faces.length / 3, 0);
  if (count > TRIANGLES_MAX) {
    scene.notes.push(`of ${count} triangles of the mesh some ${TRIANGLES_MAX} are drawn`);
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
