// SPDX-License-Identifier: Apache-2.0
// What colours mean, one home for the picture, its names and the legend. Those of layers are with
// the layers (GROUPS of scene.js).

export const BACKGROUND = [0x10, 0x14, 0x1a];
export const SELECTED = [255, 255, 255];
export const HIT = [255, 90, 200];
export const PATH = [120, 255, 160];
export const PREDICTION = [255, 90, 200];
export const DIFF_COLORS = {added: [0x4d, 0xa3, 0xff], removed: [0xff, 0x7a, 0x33],
                            changed: [0xf5, 0xf0, 0xa0], same: [0x5a, 0x61, 0x6b]};
/** Palette of people, without repeats among the first ten. */
const PEOPLE = [
  [0xe6, 0x9f, 0x00], [0xff, 0x6f, 0x61], [0x9b, 0x8c, 0xff], [0x2e, 0xc4, 0xb6],
  [0xd4, 0xe1, 0x57], [0xff, 0xb3, 0xc6], [0x8d, 0x6e, 0x63], [0x4f, 0xc3, 0xf7],
  [0xba, 0x68, 0xc8], [0xa5, 0xd6, 0xa7],
];

/** Colour of an agent: always the same for the same id. */
export function colorOfAgent(id) {
  let hash = 0;
  for (const letter of id) hash = (hash * 31 + letter.charCodeAt(0)) >>> 0;
  return PEOPLE[(Number(id.slice(1)) || hash) % PEOPLE.length];
}

/** A colour of a node, and how opaque it is. */
export function lookOf(show, node, color) {
  if (show.diff) {
    const state = show.diff.get(node.id) ?? 'same';
    return [DIFF_COLORS[state], state === 'same' ? 0.35 : 1];
  }
  if (node.id === show.selected) return [SELECTED, 1];
  if (show.hits.has(node.id)) return [HIT, 1];
  return [color, show.hits.size ? 0.4 : 1];
}

/** Between two colours: the first one at 0, the second at 1. */
export function mixed(a, b, share) {
  return a.map((value, i) => value + (b[i] - value) * share);
}

/** As style sheets and canvases take it. */
export const cssOf = (rgb) => `rgb(${rgb.join(',')})`;
