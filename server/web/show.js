// SPDX-License-Identifier: Apache-2.0
// What of a scene is shown, and how.

import {GROUPS} from './scene.js';

/**
 * Layers apart are so far from each other that none covers another, seen from the side as
 * `lookAtAll` (picture.js) does: a storey, and shares of the map's shorter and longer side.
 */
const STOREY_M = 3;
const STEP_SHARES = {shorter: 0.36, longer: 0.13};
const LIFTS = Object.fromEntries(GROUPS.map(({name, lift}) => [name, lift]));

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
    /**
     * Ways that somebody may go: points, and how far they may be off, as covariances in square
     * metres.
     * @type {{probability: number, points: number[][], covariances: number[][]}[]}
     */
    this.predictions = [];
    /** @type {Map<string, string> | null} id to "added", "removed", "changed" */
    this.diff = null;
    /** Nodes that the other revision had, and this one has no more. */
    this.ghosts = [];
  }
}

/** Metres between two steps of the exploded view. */
export function stepOf(scene, explode) {
  const {min, max} = scene.bounds;
  const [shorter, longer] = [max[0] - min[0], max[1] - min[1]].sort((a, b) => a - b);
  return explode * (STOREY_M + STEP_SHARES.shorter * shorter + STEP_SHARES.longer * longer);
}

/** How far a node is lifted while layers are apart, metres. */
export function liftOf(scene, show, node) {
  return show.explode > 0 ? LIFTS[node.group] * stepOf(scene, show.explode) : 0;
}
