// SPDX-License-Identifier: Apache-2.0
// A map at one revision, as the viewer holds it: nodes, edges and tracks, with times in seconds
// since the map's epoch. load.js fills it.
import {transformed} from './shapes.js';
import {OPEN_BEGIN, OPEN_END, secondsOf} from './time.js';

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

/** The colour of a group. */
export const colorOfGroup = (name) => GROUPS.find((group) => group.name === name).color;

const ORIGIN = [0, 0, 0];

function groupOf({kind, layer, hasRegion}) {
  if (layer === 'agents' || kind === 'human' || kind === 'robot') return 'agents';
  if (kind === 'place') return 'places';
  if (kind === 'structure') return 'structures';
  if (kind === 'room') return 'rooms';
  if (hasRegion || kind === 'building') return 'building';
  return 'objects';
}

const vector = (v) => [v?.x ?? 0, v?.y ?? 0, v?.z ?? 0];

/** The floor of a box as the outline of a region that has none, with heights. */
function outlineOfBox({position, orientation, box}) {
  const corners = [[box.min[0], box.min[1]], [box.max[0], box.min[1]], [box.max[0], box.max[1]],
                   [box.min[0], box.max[1]]];
  return {
    outline: corners.map(([x, y]) => transformed(position, orientation, [x, y, 0]).slice(0, 2)),
    zMin: position[2] + box.min[2],
    zMax: position[2] + box.max[2],
  };
}

/** A node with its group; one of rooms and above has an outline where it has a box. */
export function withGroup(node) {
  const group = groupOf({...node, hasRegion: node.outline.length > 0});
  const isRegion = group === 'rooms' || group === 'building';
  const needsOutline = isRegion && node.outline.length < 3 && node.box && node.position;
  return Object.assign(node, {group}, needsOutline ? outlineOfBox(node) : {});
}

/** A node of a reply in JSON; `from` and `to` are when it is valid, seconds. */
export function toNode(message, epoch) {
  const pose = message.map_T_node;
  const q = pose?.orientation;
  const corners = message.bounding_box;
  const xy = message.region?.footprint?.xy ?? [];
  const outline = [];
  for (let i = 0; i + 1 < xy.length; i += 2) outline.push([xy[i], xy[i + 1]]);
  return withGroup({
    id: message.id,
    name: message.name ?? '',
    kind: message.kind,
    layer: message.layer,
    className: message.semantic_class?.name ?? '',
    position: pose?.position ? vector(pose.position) : null,
    orientation: q ? [q.x, q.y, q.z, q.w] : [0, 0, 0, 1],
    box: corners ? {min: vector(corners.min), max: vector(corners.max)} : null,
    outline,
    zMin: message.region?.z_min_m ?? 0,
    zMax: message.region?.z_max_m ?? 0,
    from: secondsOf(message.valid_from_ns ?? OPEN_BEGIN, epoch),
    to: secondsOf(message.valid_to_ns ?? OPEN_END, epoch),
  });
}

/** Poses of an agent, or some of them; nobody knows where it was in a gap. */
export class Track {
  constructor() {
    this.times = [];
    this.positions = [];
    /** Indices of poses after a gap. */
    this.gaps = new Set();
  }

  /** Appends poses; `gaps` are indices into them. */
  append(times, positions, gaps) {
    for (const row of gaps) this.gaps.add(this.times.length + row);
    for (const time of times) this.times.push(time);
    for (const position of positions) this.positions.push(position);
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
    if (this.gaps.has(i + 1) && time > this.times[i]) return {position: before, known: false};
    const share = (time - this.times[i]) / span;
    const after = this.positions[i + 1];
    return {position: before.map((v, k) => v + (after[k] - v) * share), known: true};
  }
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
    /** Bodies of people at one time, as meshes by id of the agent. */
    this.bodies = {time: NaN, meshes: new Map()};
    this.changes = new Float64Array(0);
    this.changesOf = 0;
    /** Agents that were seen in each of some bins of equal length between begin and end. */
    this.timeline = [];
    /** What was left out, and why; shown, never silent. */
    this.notes = [];
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

  /** The last time at which the most agents were seen; the end if nobody was. */
  get busiest() {
    const most = Math.max(...this.timeline);
    if (!(most > 0)) return this.end;
    const bin = this.timeline.lastIndexOf(most);
    return this.begin + (bin + 0.5) * (this.end - this.begin) / this.timeline.length;
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
}
