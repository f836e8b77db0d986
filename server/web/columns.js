// SPDX-License-Identifier: Apache-2.0
// The packed columns of proto/dsg/v1/scene.proto as nodes, edges and tracks of a scene. A column
// that is cut off, or that names a row that is not there, is refused.
import {secondsOf} from './time.js';
import {Reader} from './wire.js';

const NO_ROW = 0xffffffff;
/** Numbers of ids from here on need more bits than a double has. */
const HIGH_MAX = 1 << 21;

/** A column as an array of a type, with so many values a row; null if it is empty. */
function column(bytes, Type, rowCount, perRow = 1) {
  if (!bytes || bytes.length === 0) return null;
  if (bytes.length !== rowCount * perRow * Type.BYTES_PER_ELEMENT) {
    throw new RangeError(`a column of ${rowCount} rows has ${bytes.length} bytes`);
  }
  // A copy, since a column may begin at any byte.
  return new Type(bytes.slice().buffer);
}

/** A column that must be there. */
function required(bytes, Type, rowCount, perRow = 1) {
  const found = column(bytes, Type, rowCount, perRow);
  if (!found && rowCount !== 0) throw new RangeError(`${rowCount} rows lack a column`);
  return found ?? new Type(0);
}

/** A column of any number of values. */
function values(bytes, Type) {
  if (!bytes) return new Type(0);
  if (bytes.length % Type.BYTES_PER_ELEMENT !== 0) throw new RangeError('a column is cut off');
  return new Type(bytes.slice().buffer);
}

/** Where the parts of rows begin and end in one column of all. */
function parts(bytes, rowCount, size) {
  const ends = column(bytes, Uint32Array, rowCount);
  if (!ends) return null;
  let before = 0;
  for (const end of ends) {
    if (end < before || end > size) throw new RangeError('a row ends outside of its column');
    before = end;
  }
  return (row) => [row > 0 ? ends[row - 1] : 0, ends[row]];
}

/** The doubles of a Vector3, or of a Quaternion. */
export function vectorOf(bytes, size = 3) {
  const out = new Array(size).fill(0);
  new Reader(bytes).each(Object.fromEntries(
      out.map((_, i) => [i + 1, (reader) => { out[i] = reader.double(); }])));
  return out;
}

/**
 * The fields of a message by their names; repeated ones in arrays.
 * @param {Object<number, [string, function(Reader): *]>} names name and reader of each field
 */
export function fieldsOf(bytes, names, repeated = new Set()) {
  const out = {};
  const readers = {};
  for (const [number, [name, read]] of Object.entries(names)) {
    readers[number] = (reader) => {
      const value = read(reader);
      if (repeated.has(name)) (out[name] ??= []).push(value);
      else out[name] = value;
    };
  }
  new Reader(bytes).each(readers);
  return out;
}

const block = (reader) => reader.block();
const int = (reader) => Number(reader.int64());
const text = (reader) => new TextDecoder().decode(reader.block());
const vector = (reader) => vectorOf(reader.block());

const LAYER = {2: ['name', text]};
const SCENE_LAYER = {1: ['layer', block], 2: ['count', int], 3: ['sent', int]};
const HEAD = {1: ['layers', block], 2: ['origin', vector]};
const NODES = {
  1: ['layer', text], 3: ['rowCount', int], 4: ['ids', block],
  5: ['parents', block], 6: ['positions', block], 7: ['orientations', block], 8: ['boxes', block],
  9: ['kinds', text], 10: ['kindIndices', block], 11: ['classes', text],
  12: ['classIndices', block], 14: ['from', block], 15: ['to', block], 16: ['nameEnds', block],
  17: ['names', block], 19: ['outlineEnds', block], 20: ['outlines', block],
  21: ['heights', block],
};
const EDGES = {
  1: ['relation', text], 2: ['rowCount', int], 3: ['sources', block], 4: ['targets', block],
  6: ['from', block], 7: ['to', block],
};
const SCENE = {2: ['head', block], 3: ['nodes', block], 4: ['edges', block]};
const TRACK = {1: ['id', text]};
const POSES = {
  1: ['track', int], 2: ['rowCount', int], 3: ['times', block], 4: ['valueBytes', int],
  5: ['origin', vector], 6: ['positions', block], 8: ['gaps', block],
};
const TRACKS = {2: ['tracks', block], 3: ['poses', block]};
const double = (reader) => reader.double();
const MESH = {3: ['pieces', block]};
const MESH_PIECE = {
  2: ['vertexCount', int], 3: ['faceCount', int], 4: ['step', double], 5: ['origin', vector],
  6: ['positions', block], 8: ['colors', block], 13: ['faces', block],
};

/** "O42" of an id in 64 bits. */
function idOf(low, high) {
  const letter = String.fromCharCode(high >>> 24);
  const rest = high & 0xffffff;
  if (rest < HIGH_MAX) return `${letter}${rest * 0x100000000 + low}`;
  return `${letter}${(BigInt(rest) << 32n) | BigInt(low)}`;
}

/** One GetSceneResponse: what of head, nodes and edges it has, undecoded columns inside. */
export function readSceneMessage(bytes) {
  const message = fieldsOf(bytes, SCENE);
  const out = {};
  if (message.head) {
    out.head = fieldsOf(message.head, HEAD, new Set(['layers']));
    out.head.layers = (out.head.layers ?? []).map((one) => {
      const {layer, count = 0, sent = 0} = fieldsOf(one, SCENE_LAYER);
      return {count, sent, ...fieldsOf(layer ?? new Uint8Array(0), LAYER)};
    });
  }
  if (message.nodes) out.nodes = fieldsOf(message.nodes, NODES, new Set(['kinds', 'classes']));
  if (message.edges) out.edges = fieldsOf(message.edges, EDGES);
  return out;
}

/** Words of rows, by an index each or all the first one. */
function words(list, bytes, rowCount) {
  const indices = column(bytes, Uint16Array, rowCount);
  return (row) => list?.[indices ? indices[row] : 0] ?? '';
}

/** Seconds of rows; `usual` where the column is empty. */
function times(bytes, rowCount, epoch, usual) {
  const all = column(bytes, BigInt64Array, rowCount);
  return (row) => (all ? secondsOf(all[row], epoch) : usual);
}

/**
 * The nodes of one message, in the order of their rows: id, layer, kind, name, className, parent
 * (its row, or -1), position, orientation, box, outline, zMin, zMax, from, to.
 * @param {object} message of readSceneMessage
 * @param {number[]} origin of the head
 */
export function nodesOf(message, origin, epoch) {
  const count = message.rowCount ?? 0;
  const ids = required(message.ids, Uint32Array, count, 2);
  const parents = column(message.parents, Uint32Array, count);
  const positions = column(message.positions, Float32Array, count, 3);
  const orientations = column(message.orientations, Float32Array, count, 4);
  const boxes = column(message.boxes, Float32Array, count, 6);
  const kindOf = words(message.kinds, message.kindIndices, count);
  const classOf = words(message.classes, message.classIndices, count);
  const fromOf = times(message.from, count, epoch, -Infinity);
  const toOf = times(message.to, count, epoch, Infinity);
  const names = message.names ?? new Uint8Array(0);
  const nameOf = parts(message.nameEnds, count, names.length);
  const corners = values(message.outlines, Float32Array);
  const outlineOf = parts(message.outlineEnds, count, corners.length / 2);
  const heights = column(message.heights, Float32Array, count, 2);
  const decoder = new TextDecoder();
  const nodes = [];
  for (let row = 0; row < ids.length / 2; ++row) {
    const at = positions?.subarray(3 * row, 3 * row + 3);
    const box = boxes?.subarray(6 * row, 6 * row + 6);
    const outline = [];
    const [first, last] = outlineOf?.(row) ?? [0, 0];
    for (let i = first; i < last; ++i) {
      outline.push([corners[2 * i] + origin[0], corners[2 * i + 1] + origin[1]]);
    }
    const [begin, end] = nameOf?.(row) ?? [0, 0];
    nodes.push({
      id: idOf(ids[2 * row], ids[2 * row + 1]),
      layer: message.layer ?? '',
      kind: kindOf(row),
      name: end > begin ? decoder.decode(names.subarray(begin, end)) : '',
      className: classOf(row),
      parent: parents && parents[row] !== NO_ROW ? parents[row] : -1,
      position: at && !Number.isNaN(at[0])
          ? [at[0] + origin[0], at[1] + origin[1], at[2] + origin[2]] : null,
      orientation: orientations ? [...orientations.subarray(4 * row, 4 * row + 4)] : [0, 0, 0, 1],
      box: box && !Number.isNaN(box[0]) ? {min: [...box.subarray(0, 3)], max: [...box.subarray(3)]}
                                        : null,
      outline,
      zMin: heights ? heights[2 * row] + origin[2] : 0,
      zMax: heights ? heights[2 * row + 1] + origin[2] : 0,
      from: fromOf(row),
      to: toOf(row),
    });
  }
  return nodes;
}

/** The edges of one message; `idAt` gives the id of a row. */
export function edgesOf(message, idAt, epoch) {
  const count = message.rowCount ?? 0;
  const sources = required(message.sources, Uint32Array, count);
  const targets = required(message.targets, Uint32Array, count);
  const fromOf = times(message.from, count, epoch, -Infinity);
  const toOf = times(message.to, count, epoch, Infinity);
  return Array.from(sources, (source, row) => {
    const [from, to] = [idAt(source), idAt(targets[row])];
    if (from === undefined || to === undefined) {
      throw new RangeError(`an edge names row ${source} or ${targets[row]}, which is not there`);
    }
    return {source: from, relation: message.relation ?? '', target: to, from: fromOf(row),
            to: toOf(row)};
  });
}

/**
 * One GetTracksResponse: ids of tracks in the first message, then poses: the number of the
 * track, times in seconds, positions, and the rows before which it has a gap.
 */
export function readTracksMessage(bytes, epoch) {
  const message = fieldsOf(bytes, TRACKS, new Set(['tracks', 'poses']));
  return {
    tracks: (message.tracks ?? []).map((one) => fieldsOf(one, TRACK)),
    poses: (message.poses ?? []).map((one) => {
      const poses = fieldsOf(one, POSES);
      const count = poses.rowCount ?? 0;
      const Type = poses.valueBytes === 8 ? Float64Array : Float32Array;
      const all = required(poses.positions, Type, count, 3);
      const at = poses.origin ?? [0, 0, 0];
      const stamps = required(poses.times, BigInt64Array, count);
      return {
        track: poses.track ?? 0,
        times: Array.from(stamps, (ns) => secondsOf(ns, epoch)),
        positions: Array.from({length: count}, (_, row) => [
          all[3 * row] + at[0], all[3 * row + 1] + at[1], all[3 * row + 2] + at[2],
        ]),
        gaps: [...values(poses.gaps, Uint32Array)],
      };
    }),
  };
}

/**
 * One GetMeshResponse with coarse columns: blocks with positions (x y z of each vertex, metres,
 * frame of the map), colours (0xRRGGBB, or null) and faces.
 */
export function readMeshMessage(bytes) {
  const {pieces = []} = fieldsOf(bytes, MESH, new Set(['pieces']));
  return pieces.map((one) => {
    const {vertexCount = 0, faceCount = 0, step = 0, origin = [0, 0, 0], ...columns} =
        fieldsOf(one, MESH_PIECE);
    const positions = Float32Array.from(required(columns.positions, Uint16Array, vertexCount, 3),
                                        (value, i) => origin[i % 3] + step * value);
    const rgb = column(columns.colors, Uint8Array, vertexCount, 3);
    const faces = required(columns.faces, Uint16Array, faceCount, 3);
    if (faces.some((vertex) => vertex >= vertexCount)) {
      throw new RangeError('a face of the mesh names a vertex that is not there');
    }
    const colors = rgb && Uint32Array.from(
        {length: vertexCount}, (_, i) => rgb[3 * i] << 16 | rgb[3 * i + 1] << 8 | rgb[3 * i + 2]);
    return {positions, colors, faces};
  });
}
